//! A sample of a recursion or of an adaptive observer allocates nothing.

#![expect(unsafe_code, reason = "a global allocator that counts")]

use asobench_identification::adaptive::{
    AdaptiveObserver, FedObserver, JointEkf, JointEkfSettings, Kreisselmeier, KreisselmeierSettings, StateFilters,
    Zhang, ZhangSettings,
};
use asobench_identification::estimator::IvOptions;
use asobench_identification::estimator::recursive::{
    ExtendedLeastSquares, RecursiveEstimator, RecursiveForm, RecursiveInstruments, RecursiveIv, RecursiveLeastSquares,
    RecursivePrediction, RecursiveSettings, RecursiveSriv, Rerun, RerunWindow,
};
use asobench_identification::model::Orders;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell as Counter;

struct Counting;

thread_local! {
    /// Allocations of this thread.
    static ALLOCATIONS: Counter<usize> = const { Counter::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
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

/// A fed observer runs an estimator and the filters, so it stands for the estimator too.
fn observers() -> Vec<(&'static str, Box<dyn AdaptiveObserver>)> {
    fn fed<R: RecursiveEstimator + 'static>(estimator: R) -> Box<dyn AdaptiveObserver> {
        Box::new(FedObserver::new(estimator, StateFilters::new(&[0.0; 2])))
    }
    let of = |orders: &str| RecursiveSettings::new(orders.parse::<Orders>().expect("orders"));
    let rls = |form| {
        let settings = RecursiveSettings {
            p0: Some(100.0),
            ..of("na=2,nb=2")
        };
        RecursiveLeastSquares::new(settings, form)
    };
    let iv = |instruments| RecursiveIv::new(of("na=2,nb=2"), instruments);
    let (armax, bj) = ("na=2,nb=2,nc=2", "nb=2,nc=1,nd=1,nf=2");
    let sliding = Rerun::new(IvOptions::default(), 2, RerunWindow::Sliding(60), 1);
    vec![
        ("rls", fed(rls(RecursiveForm::SquareRoot))),
        ("rls, P", fed(rls(RecursiveForm::Covariance))),
        ("delayed", fed(iv(RecursiveInstruments::Delayed))),
        ("auxiliary", fed(iv(RecursiveInstruments::Auxiliary))),
        ("rels", fed(ExtendedLeastSquares::new(of(armax)))),
        ("sriv", fed(RecursiveSriv::new(of("nb=2,nf=2")))),
        ("rpem", fed(RecursivePrediction::new(of(bj)))),
        ("sliding", fed(sliding.expect("a shape"))),
        (
            "kreisselmeier",
            Box::new(Kreisselmeier::new(KreisselmeierSettings {
                filter: vec![-0.5, 0.06],
                memory: 0.98,
                gain: 1.0,
            })),
        ),
        (
            "zhang",
            Box::new(Zhang::new(ZhangSettings {
                gain: vec![-0.5, 0.06],
                forgetting: 0.99,
                p0: 100.0,
            })),
        ),
        (
            "ekf",
            Box::new(JointEkf::new(JointEkfSettings {
                x0: vec![0.0; 2],
                a0: vec![-0.5, 1.0],
                b0: vec![0.5; 2],
                state_variance: 1.0,
                parameter_variance: 0.1,
                noise: 0.01,
                state_noise: 0.0,
                parameter_noise: 0.0,
            })),
        ),
    ]
}

#[test]
fn a_sample_allocates_nothing() {
    // Noise of a linear congruence: 32 bits of Knuth's.
    let mut bits = 1_u64;
    let mut uniform = || {
        bits = bits.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (bits >> 33) as f64 / 2_f64.powi(30) - 1.0
    };
    let samples = 400;
    let u: Vec<f64> = (0..samples).map(|_| uniform()).collect();
    let mut y = vec![0.0; samples];
    for k in 2..samples {
        y[k] = 1.5 * y[k - 1] - 0.7 * y[k - 2] + u[k - 1] + 0.1 * uniform();
    }
    for (name, mut observer) in observers() {
        // The rerun fills its window first.
        let warm = if name == "sliding" { 100 } else { 0 };
        let mut before = 0;
        for k in 0..samples {
            if k == warm {
                before = ALLOCATIONS.with(Counter::get);
            }
            observer.update(u[k], y[k]).expect("no divergence");
        }
        let made = ALLOCATIONS.with(Counter::get) - before;
        assert_eq!(made, 0, "{name}: {made} allocations");
    }
}
