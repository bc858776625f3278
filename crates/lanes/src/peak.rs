//! Fused multiply-adds on registers alone, to measure the machine's peak.

use super::{Call, Isa, LARGEST_ORDER};
use asobench_identification::real::Real;
use std::hint::black_box;

/// Number of independent chains: latency times throughput of all recent machines, and below the number of registers.
const CHAINS: usize = 12;

/// Number of multiply-adds of a chain, for some 50 microseconds.
const ROUNDS: usize = 20_000;

impl Isa {
    /// Does fused multiply-adds; returns the number of floating-point operations, two per multiply-add and lane.
    ///
    /// # Panics
    /// If this machine does not have the instructions.
    pub fn multiply_add(self) -> f64 {
        self.dispatch(LARGEST_ORDER, MultiplyAdd)
    }
}

struct MultiplyAdd;

impl Call for MultiplyAdd {
    type Output = f64;

    fn with<R: Real, const N: usize>(self) -> f64 {
        black_box(chains::<R>());
        (2 * R::LANES * CHAINS * ROUNDS) as f64
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
