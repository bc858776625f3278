//! The machine's peak: fused multiply-adds on registers alone.

use super::{Call, Isa};
use crate::real::Real;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Independent chains: latency times throughput of every machine of the last years, and below the number of registers.
const CHAINS: usize = 12;

/// Rounds between two looks at the clock.
const ROUNDS: usize = 20_000;

impl Isa {
    /// Floating-point operations per second of one thread, two for each multiply-add in each lane: the best of rounds
    /// of some 50 microseconds within `time`.
    pub fn fma_peak(self, time: Duration) -> f64 {
        self.dispatch(super::LARGEST_ORDER, Peak(time))
    }
}

struct Peak(Duration);

impl Call for Peak {
    type Output = f64;

    fn with<R: Real, const N: usize>(self) -> f64 {
        let begin = Instant::now();
        let mut shortest = f64::INFINITY;
        while begin.elapsed() < self.0 {
            let round = Instant::now();
            black_box(chains::<R>());
            shortest = shortest.min(round.elapsed().as_secs_f64());
        }
        (2 * R::LANES * CHAINS * ROUNDS) as f64 / shortest
    }
}

fn chains<R: Real>() -> f64 {
    let (factor, addend) = black_box((0.999_999, 1e-7));
    let last = R::run(
        #[inline(always)]
        || {
            let (factor, addend) = (R::splat(factor), R::splat(addend));
            let mut chains = [R::splat(1.0); CHAINS];
            for _ in 0..ROUNDS {
                for i in 0..CHAINS {
                    chains[i] = chains[i].mul_add(factor, addend);
                }
            }
            let mut sum = R::zero();
            for i in 0..CHAINS {
                sum = sum + chains[i];
            }
            sum
        },
    );
    last.lane(0)
}
