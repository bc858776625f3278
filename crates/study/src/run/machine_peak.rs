//! The machine's peak of fused multiply-adds.

use asobench_lanes::Isa;
use std::time::{Duration, Instant};

/// Returns the floating-point operations per second of some threads at once, on registers alone. It is the sum of each
/// thread's best stretch of some 50 microseconds within `time`.
///
/// # Panics
/// If this machine does not have the instructions.
pub fn fma_peak(isa: Isa, threads: usize, time: Duration) -> f64 {
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..threads).map(|_| scope.spawn(|| of_one(isa, time))).collect();
        let peaks = all.into_iter().map(std::thread::ScopedJoinHandle::join);
        peaks.map(|peak| peak.unwrap_or(f64::NAN)).sum()
    })
}

fn of_one(isa: Isa, time: Duration) -> f64 {
    let begin = Instant::now();
    let mut best = 0.0_f64;
    while begin.elapsed() < time {
        let stretch = Instant::now();
        let flop = isa.multiply_add();
        best = best.max(flop / stretch.elapsed().as_secs_f64());
    }
    best
}
