//! Stages 1 to 11 in lock step: least squares and the IV passes of a pack of trials.

use super::information::PackedInformation;
use super::partitioned::{Parameters, Triangles};
use super::{initial_state, inverses, order, partitioned};
use asobench_identification::estimator::{Auxiliary, Drive, Failure, FailureKind, IvOptions, Stage, StartState};
use asobench_identification::observer::Gain;
use asobench_identification::plant::canonical::{reverse_negated, solve_toeplitz};
use asobench_identification::plant::inlined::{observe, simulate};
use asobench_identification::plant::stability::is_stable;
use asobench_identification::real::{MOST_LANES, Mask, Real};

/// The result of a pass in each lane: [`asobench_identification::estimator::Pass`].
#[derive(Clone, Copy)]
pub struct PassPack<R: Real, const N: usize> {
    /// The last row of A.
    pub a: [R; N],
    pub(crate) b: [R; N],
    /// The numerator.
    pub h: [R; N],
    /// The initial state.
    pub x0: [R; N],
    /// The condition number of what was solved.
    pub condition: R,
    /// The lanes whose model is unstable.
    pub unstable: R::Mask,
    /// The lanes in which a, b and h are valid.
    pub parameters: R::Mask,
    /// The lanes in which x0 is valid too.
    pub state: R::Mask,
    /// Why the other lanes have nothing.
    pub failures: [Option<Failure>; MOST_LANES],
}

impl<R: Real, const N: usize> PassPack<R, N> {
    /// Nothing estimated yet.
    pub fn unknown() -> Self {
        let none = R::Mask::from_bits(0);
        let unknown = [R::splat(f64::NAN); N];
        Self {
            a: unknown,
            b: unknown,
            h: unknown,
            x0: unknown,
            condition: R::splat(f64::NAN),
            unstable: none,
            parameters: none,
            state: none,
            failures: [None; MOST_LANES],
        }
    }

    fn fail(&mut self, lane: usize, kind: FailureKind, stage: Stage, pass: usize) {
        self.failures[lane] = Some(Failure { kind, stage, pass });
    }
}

/// The passes of one method, with its buffers.
pub struct Passes<R: Real, const N: usize> {
    start: StartState,
    auxiliary: Auxiliary,
    drive: Drive,
    /// The gain if the observer is the auxiliary model.
    gain: Gain,
    /// Whether condition numbers are wanted.
    with_condition: bool,
    information: PackedInformation<R, N>,
    triangles: Triangles<R, N>,
    yhat: Vec<R>,
    /// Scratch rows for lanes whose initial state is solved alone.
    rows: Vec<([f64; N], f64)>,
    /// The result of each pass.
    pub done: Vec<PassPack<R, N>>,
    /// How many solves of the last estimate were repeated for one lane alone.
    fallbacks: u64,
}

impl<R: Real, const N: usize> Passes<R, N> {
    /// Makes buffers for windows of N samples; `passes` includes iteration 0.
    pub fn new(n: usize, options: &IvOptions, passes: usize, window: usize, with_condition: bool) -> Self {
        Self {
            start: options.initial_state,
            auxiliary: options.auxiliary,
            drive: options.drive,
            gain: options.gain.clone(),
            with_condition,
            information: PackedInformation::new(n),
            triangles: Triangles::new(),
            yhat: vec![R::zero(); window],
            rows: Vec::new(),
            done: vec![PassPack::unknown(); passes],
            fallbacks: 0,
        }
    }

    /// Estimates on the window (u, y) for the lanes of `asked`. Returns how many solves were repeated for one lane
    /// alone.
    pub fn estimate(&mut self, u: &[R], y: &[R], asked: R::Mask) -> u64 {
        self.fallbacks = 0;
        self.sum_least_squares(u, y);
        let mut done = std::mem::take(&mut self.done);
        for number in 0..done.len() {
            let (before, rest) = done.split_at_mut(number);
            let pass = &mut rest[0];
            let mut going = asked;
            pass.failures = [None; MOST_LANES];
            if let Some(previous) = before.last() {
                pass.failures = previous.failures;
                going = self.simulate(before, (u, y), pass, asked & previous.state);
                self.sum_instruments(u, y);
            }
            self.solve(number, pass, going);
            self.estimate_state(before, u, y, pass);
        }
        self.done = done;
        self.fallbacks
    }

    /// Computes stage 2, and the part of stage 3 that is the same in all passes.
    pub fn sum_least_squares(&mut self, u: &[R], y: &[R]) {
        let (information, triangles) = (&mut self.information, &mut self.triangles);
        R::run(
            #[inline(always)]
            || {
                information.least_squares(u, y);
                triangles.eliminate_input(information);
            },
        );
    }

    /// Computes stage 9.
    pub fn sum_instruments(&mut self, u: &[R], y: &[R]) {
        let (information, yhat) = (&mut self.information, &self.yhat);
        R::run(
            #[inline(always)]
            || information.instruments(u, y, yhat),
        );
    }

    /// Computes stage 7; returns the lanes whose output is finite.
    pub fn simulate(
        &mut self,
        before: &[PassPack<R, N>],
        (u, y): (&[R], &[R]),
        pass: &mut PassPack<R, N>,
        going: R::Mask,
    ) -> R::Mask {
        let number = before.len();
        let previous = &before[number - 1];
        let source = match self.auxiliary {
            Auxiliary::Refresh => previous,
            Auxiliary::Frozen | Auxiliary::Literal => &before[0],
        };
        let n = self.information.order();
        let (a, b, x0) = (&previous.a, &source.b, &source.x0);
        let (drive, gain, yhat) = (self.drive, &self.gain, &mut self.yhat[..]);
        let finite = R::run(
            #[inline(always)]
            || {
                let n = order::<N>(n);
                let (a, b, mut x) = (*a, *b, *x0);
                let (a, b, x) = (&a[..n], &b[..n], &mut x[..n]);
                match drive {
                    Drive::Model => simulate(
                        a,
                        b,
                        x,
                        u,
                        #[inline(always)]
                        |k, x| yhat[k] = x[0],
                    ),
                    Drive::Observer => {
                        let mut g = [R::zero(); N];
                        gain.compute(a, &mut g[..n]);
                        observe(
                            a,
                            b,
                            &g[..n],
                            x,
                            u,
                            y,
                            #[inline(always)]
                            |k, x| yhat[k] = x[0],
                        );
                    }
                }
                // Once not finite, the output stays so.
                yhat[yhat.len() - 1].is_finite()
            },
        );
        for lane in (going & !finite).lanes() {
            pass.fail(lane, FailureKind::NonFinite, Stage::AuxiliaryModel, number);
        }
        going & finite
    }

    /// Computes stages 3 to 5, or stage 10 with a, h and b.
    pub fn solve(&mut self, number: usize, pass: &mut PassPack<R, N>, going: R::Mask) {
        let stage = if number == 0 {
            Stage::LeastSquares
        } else {
            Stage::Instruments
        };
        let (information, with_condition) = (&self.information, self.with_condition);
        let triangles = &mut self.triangles;
        let (mut solved, unsafe_lanes) = R::run(
            #[inline(always)]
            || partitioned::solve(information, triangles, with_condition),
        );
        let mut parameters = going;
        for lane in (unsafe_lanes & going).lanes() {
            self.fallbacks += 1;
            let (alone, condition) = inverses::solve_alone(information, lane);
            solved.condition = solved.condition.with_lane(lane, condition);
            match alone {
                Ok(p) => solved.set_lane(lane, &p),
                Err(kind) => {
                    parameters = parameters & !R::Mask::from_bits(1 << lane);
                    pass.fail(lane, kind, stage, number);
                }
            }
        }
        let Parameters {
            p: [alpha, beta],
            condition,
        } = solved;
        let finite = R::run(
            #[inline(always)]
            || {
                let n = information.order();
                reverse_negated(&alpha[..n], &mut pass.a[..n]);
                pass.h = beta;
                pass.b = beta;
                solve_toeplitz(&pass.a[..n], &mut pass.b[..n]);
                let mut check = R::zero();
                for i in 0..n {
                    check = alpha[i].mul_add(R::zero(), check);
                    check = beta[i].mul_add(R::zero(), check);
                    check = pass.b[i].mul_add(R::zero(), check);
                }
                pass.unstable = !is_stable(&pass.a[..n], &mut [R::zero(); N][..n]);
                check.is_finite()
            },
        );
        for lane in (parameters & !finite).lanes() {
            pass.fail(lane, FailureKind::NonFinite, stage, number);
        }
        pass.parameters = parameters & finite;
        // In other lanes the condition belongs to a matrix that was not solved, or to an earlier pass.
        pass.condition = R::select(pass.parameters, condition, R::splat(f64::NAN));
    }

    /// Computes stage 6, if the reading includes it.
    pub fn estimate_state(&mut self, before: &[PassPack<R, N>], u: &[R], y: &[R], pass: &mut PassPack<R, N>) {
        let number = before.len();
        pass.state = pass.parameters;
        if let (Some(first), Auxiliary::Frozen | Auxiliary::Literal) = (before.first(), self.auxiliary) {
            pass.x0 = first.x0;
            if self.auxiliary == Auxiliary::Literal {
                pass.b = first.b;
            }
            return;
        }
        if self.start == StartState::Zero {
            pass.x0 = [R::zero(); N];
            return;
        }
        let n = self.information.order();
        let (a, h) = (&pass.a, &pass.h);
        let (x0, unsafe_lanes) = R::run(
            #[inline(always)]
            || initial_state::solve(n, a, h, u, y),
        );
        pass.x0 = x0;
        for lane in (unsafe_lanes & pass.parameters).lanes() {
            self.fallbacks += 1;
            match initial_state::solve_alone(n, &pass.a, &pass.h, u, y, lane, &mut self.rows) {
                Ok(alone) => {
                    for (x0, alone) in pass.x0.iter_mut().zip(alone) {
                        *x0 = x0.with_lane(lane, alone);
                    }
                }
                Err(kind) => {
                    pass.state = pass.state & !R::Mask::from_bits(1 << lane);
                    pass.fail(lane, kind, Stage::InitialState, number);
                }
            }
        }
    }
}

impl<R: Real, const N: usize> Parameters<R, N> {
    fn set_lane(&mut self, lane: usize, p: &[[f64; N]; 2]) {
        for (part, alone) in self.p.iter_mut().zip(p) {
            for (x, alone) in part.iter_mut().zip(alone) {
                *x = x.with_lane(lane, *alone);
            }
        }
    }
}
