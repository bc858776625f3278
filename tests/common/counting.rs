//! An allocator that counts what each thread takes: a program has one, so each program of tests includes this file.

#![expect(unsafe_code, reason = "a global allocator that counts")]
#![allow(dead_code, reason = "each program asks for one of the counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    /// Of this thread: calls, bytes that it holds, and the most that it held.
    static CALLS: Cell<usize> = const { Cell::new(0) };
    static HELD: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

/// The allocations of this thread: those of the test harness beside it are not its own.
pub fn allocations() -> usize {
    CALLS.get()
}

/// Begins to look for the most bytes that this thread holds, and returns those that it holds now.
pub fn begin() -> isize {
    MOST.set(HELD.get());
    HELD.get()
}

/// The most bytes that this thread held since then.
pub fn most_held() -> isize {
    MOST.get()
}

fn hold(bytes: isize) {
    HELD.set(HELD.get() + bytes);
    MOST.set(MOST.get().max(HELD.get()));
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.set(CALLS.get() + 1);
        hold(layout.size().cast_signed());
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        hold(-layout.size().cast_signed());
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;
