//! Runs the kernels of a pack one at a time, for benches and examples that measure.

use super::PackOf;
use crate::order;
use crate::passes::PassPack;
use asobench_identification::names::named_enum;
use asobench_identification::plant::radius::spectral_radius;
use asobench_identification::real::{Mask, Real};
use std::hint::black_box;

named_enum! {
    /// A kernel of a pack.
    Kernel, "kernel" {
        /// Drawing the records.
        Draw = "draw",
        /// Stage 2.
        LeastSquaresSums = "ls_sums",
        /// Stage 9.
        IvSums = "iv_sums",
        /// Stages 3 to 5, or 10, with the condition number if a measure asks for it.
        Solve = "solve",
        /// Stage 6.
        InitialState = "initial_state",
        /// Stage 7.
        Auxiliary = "auxiliary",
        /// All passes: stages 2 to 11.
        Estimate = "estimate",
        /// Stage 12 of every output, together with the true plant.
        Observer = "observer",
        /// The spectral radius of the last pass.
        SpectralRadius = "spectral_radius",
        /// The error of the last pass's impulse response.
        ImpulseResponse = "impulse_response",
        /// A fresh input, the plant's output under it, and the last pass's FIT.
        FreshFit = "fresh_fit",
    }
}

impl<R: Real, const N: usize> PackOf<'_, R, N> {
    pub(super) fn kernel(&mut self, kernel: Kernel) {
        let Self {
            plan,
            record,
            methods,
            responses,
            ..
        } = self;
        let trials = std::array::from_fn(|lane| lane as u64);
        if kernel == Kernel::Draw {
            return record.draw(&plan.source, &trials);
        }
        let (u, y) = (&record.u[..plan.source.window], &record.y[..]);
        let all = R::Mask::from_bits(u8::MAX);
        let (passes, last) = (&mut methods[0], plan.methods[0].passes - 1);
        let mut pass = PassPack::unknown();
        match kernel {
            Kernel::Draw => {}
            Kernel::LeastSquaresSums => passes.sum_least_squares(u, y),
            Kernel::IvSums => passes.sum_instruments(u, y),
            Kernel::Solve => passes.solve(last, &mut pass, all),
            Kernel::InitialState => {
                let done = std::mem::take(&mut passes.done);
                pass = done[last];
                passes.estimate_state(&done[..last], u, y, &mut pass);
                passes.done = done;
            }
            Kernel::Auxiliary => {
                let done = std::mem::take(&mut passes.done);
                passes.simulate(&done[..last], (u, y), &mut pass, all);
                passes.done = done;
            }
            Kernel::Estimate => {
                passes.estimate(u, y, all);
            }
            Kernel::Observer => self.observe(),
            Kernel::ImpulseResponse => {
                pass.a[0] = responses.impulse_response_error(&passes.done[last]);
            }
            Kernel::FreshFit => {
                responses.draw(&plan.source, &trials);
                pass.a[0] = responses.fresh_fit(&passes.done[last]);
            }
            Kernel::SpectralRadius => {
                let PassPack { a, unstable, .. } = &passes.done[last];
                let n = plan.order;
                pass.a[0] = R::run(
                    #[inline(always)]
                    || spectral_radius::<R, N>(&a[..order::<N>(n)], !*unstable),
                );
            }
        }
        black_box(&pass);
    }
}
