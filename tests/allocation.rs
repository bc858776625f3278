//! A trial allocates nothing once its worker has warmed up.

#![expect(unsafe_code, reason = "a global allocator that counts")]

use asobench::study::{Curves, Experiment, Trial, Trials};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_trial_allocates_nothing() {
    let mut experiment = Experiment::nikolov2023(1);
    // Everything that a trial can be asked for.
    experiment.file.parameters = true;
    for cell in &experiment.cells {
        let mut trial = Trial::new(&experiment, cell).expect("a valid cell");
        let mut trials = Trials {
            curves: Some(Curves::new(cell.horizon)),
            ..Trials::default()
        };
        let mut run = |index| {
            trials.rows.clear();
            trials.parameters.clear();
            trial.run_into(index, &mut trials);
            assert_eq!((trials.rows.len(), trials.parameters.len()), (5, 5 * 12));
            trial.run(index);
        };
        // Long enough to meet ill-conditioned models, whose buffers grow to the longest problem met.
        for index in 0..3000 {
            run(index);
        }
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        for index in 3000..3500 {
            run(index);
        }
        let made = ALLOCATIONS.load(Ordering::Relaxed) - before;
        assert_eq!(made, 0, "{}: {made} allocations in 500 trials", cell.claim);
    }
}
