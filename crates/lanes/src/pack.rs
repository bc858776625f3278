//! Packs of trials of one cell: drawn, estimated and measured in lock step.
//!
//! A [`Pack`] hides its width and its order, so that all code that depends on them is compiled in this crate.

use crate::passes::{PassPack, Passes};
use crate::record::{Record, RecordSource};
use crate::response::Responses;
use crate::score::{Errors, PackedObserver as Observer, PackedScorer as Scorer, Wanted};
use crate::{Call, Isa, order};
use asobench_identification::data::Truth;
use asobench_identification::estimator::{Failure, FailureKind, IvOptions, Stage};
use asobench_identification::metric::relative_error;
use asobench_identification::observer::Gain;
use asobench_identification::plant::radius::spectral_radius;
use asobench_identification::real::{MOST_LANES, Mask, Real};
use std::ops::Range;

mod kernels;

pub use kernels::Kernel;

/// A number in every lane; only the first [`Pack::lanes`] have a meaning.
pub type Lanes = [f64; MOST_LANES];

/// A method of a pack.
pub struct PackMethod<'a> {
    /// The variants of stages 2 to 11.
    pub options: IvOptions,
    /// The passes, with iteration 0.
    pub passes: usize,
    /// The passes that are outputs.
    pub reported: &'a [usize],
}

/// The computations of a pack.
#[expect(clippy::struct_excessive_bools, reason = "what is asked for")]
pub struct PackPlan<'a> {
    /// Where the records come from.
    pub source: RecordSource<'a>,
    /// The plant.
    pub truth: Truth,
    /// The order of plant and models, at most [`crate::LARGEST_ORDER`].
    pub order: usize,
    /// The samples of a record, K.
    pub horizon: usize,
    /// The gain of the observers.
    pub gain: Gain,
    /// Whether observers start at 0 instead of stage 6's estimate.
    pub from_zero: bool,
    /// The methods. Each has an output for every pass that it reports.
    pub methods: Vec<PackMethod<'a>>,
    /// The errors of states to compute, if any are.
    pub wanted: Wanted,
    /// Whether stage 12 runs.
    pub wanted_states: bool,
    /// Whether condition numbers are wanted.
    pub wanted_condition: bool,
    /// Whether the spectral radius of A-hat is wanted.
    pub wanted_radius: bool,
    /// Whether the error of the impulse response is wanted.
    pub wanted_impulse_response: bool,
    /// Whether the FIT under a fresh input is wanted.
    pub wanted_fresh_fit: bool,
    /// The samples of both.
    pub response_samples: usize,
    /// Whether the errors of the coefficients are wanted.
    pub wanted_coefficients: bool,
}

/// An output of a pack. Numbers are NaN where they are undefined or not wanted; bits are those of lanes.
#[derive(Clone)]
pub struct Measured {
    /// The errors of parameters and states.
    pub errors: Errors<Lanes>,
    /// The error of the impulse response.
    pub impulse_response: Lanes,
    /// The FIT under a fresh input.
    pub fresh_fit: Lanes,
    /// The condition number of what was solved.
    pub condition: Lanes,
    /// The spectral radius of A-hat.
    pub radius: Lanes,
    /// The relative change of a since the pass before.
    pub change: Lanes,
    /// a-hat - a, then h-hat - h; empty if they are not wanted.
    pub coefficients: Vec<Lanes>,
    /// The lanes with a model.
    pub known: u8,
    /// The lanes whose model is unstable.
    pub unstable: u8,
    /// The lanes whose model of this or an earlier pass is.
    pub unstable_so_far: u8,
    /// The lanes with an observer whose states are finite.
    pub observed: u8,
    /// Why the other lanes lack something.
    pub failures: [Option<Failure>; MOST_LANES],
}

/// Buffers to run trials of one cell in lock step. The steps of a pack are called in the order of the methods.
pub trait Pack {
    /// Returns the number of trials in a pack.
    fn lanes(&self) -> usize;

    /// Draws the records of up to [`Self::lanes`] consecutive trials. Surplus lanes repeat the last one.
    fn draw(&mut self, trials: Range<u64>);

    /// Runs all passes of all methods. Returns how many solves of a lane were repeated with pivoting.
    fn estimate(&mut self) -> u64;

    /// Runs stage 12 and computes what is wanted of every output.
    fn measure(&mut self);

    /// Returns the outputs: those of the first method, then of the next.
    fn measured(&self) -> &[Measured];

    /// Returns e_x(k) of the first or the last output for k = 0 ... K-1, if it is wanted.
    fn state_errors(&self, last: bool, to: &mut Vec<Lanes>);

    /// Runs one kernel of the pack of trials 0, 1, ..., which was drawn and estimated before, to time it; of a kernel
    /// of one pass the last pass of the first method. The numbers are the same every time.
    fn run_kernel(&mut self, kernel: Kernel);
}

impl<'a> PackPlan<'a> {
    /// Makes the buffers to run it.
    ///
    /// # Panics
    /// If this machine does not have the instructions.
    pub fn pack(self, isa: Isa) -> Box<dyn Pack + 'a> {
        isa.dispatch(self.order, self)
    }
}

impl<'a> Call for PackPlan<'a> {
    type Output = Box<dyn Pack + 'a>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        Box::new(PackOf::<R, N>::new(self))
    }
}

/// One output of a pack.
struct Output<R: Real, const N: usize> {
    method: usize,
    pass: usize,
    observer: Observer<R, N>,
}

/// A pack of this width and capacity.
struct PackOf<'a, R: Real, const N: usize> {
    plan: PackPlan<'a>,
    /// How many trials were drawn.
    count: usize,
    record: Record<R, N>,
    methods: Vec<Passes<R, N>>,
    scorer: Scorer<R, N>,
    responses: Responses<R, N>,
    outputs: Vec<Output<R, N>>,
    measured: Vec<Measured>,
}

impl<'a, R: Real, const N: usize> PackOf<'a, R, N> {
    fn new(plan: PackPlan<'a>) -> Self {
        let (n, window) = (plan.order, plan.source.window);
        let methods = plan.methods.iter().map(|method| {
            let (options, passes) = (&method.options, method.passes);
            Passes::new(n, options, passes, window, plan.wanted_condition)
        });
        let curve = if plan.wanted.curves { plan.horizon } else { 0 };
        let places = plan.methods.iter().enumerate();
        let places = places.flat_map(|(method, of)| of.reported.iter().map(move |&pass| (method, pass)));
        let places: Vec<(usize, usize)> = places.collect();
        let outputs = places.iter().enumerate().map(|(output, &(method, pass))| {
            let is_end = output == 0 || output + 1 == places.len();
            let observer = Observer::new(if is_end { curve } else { 0 });
            Output { method, pass, observer }
        });
        Self {
            count: 0,
            record: Record::new(&plan.source, plan.horizon),
            methods: methods.collect(),
            scorer: Scorer::new(window, plan.horizon, plan.gain.clone(), &plan.truth, plan.wanted),
            responses: Responses::new(&plan.source, plan.response_samples),
            outputs: outputs.collect(),
            measured: vec![Measured::unknown(if plan.wanted_coefficients { 2 * n } else { 0 }); places.len()],
            plan,
        }
    }

    /// The lanes with a trial.
    fn asked(&self) -> R::Mask {
        R::Mask::from_bits(((1_u16 << self.count) - 1) as u8)
    }

    /// Runs all observers along the true trajectory, a chunk at a time.
    fn observe(&mut self) {
        let zero = [R::zero(); N];
        let (record, methods, scorer) = (&self.record, &self.methods, &mut self.scorer);
        let pass_of = |method: usize, pass: usize| &methods[method].done[pass];
        for Output { method, pass, observer } in &mut self.outputs {
            let pass = pass_of(*method, *pass);
            let x0 = if self.plan.from_zero { &zero } else { &pass.x0 };
            scorer.start(pass, x0, record, observer);
        }
        let is_alone = self.outputs.len() == usize::from(Scorer::<R, N>::BESIDE);
        let Some((first, others)) = self.outputs.split_first_mut() else {
            return;
        };
        let pass_of_first = pass_of(first.method, first.pass);
        let mut k = scorer.begin(record);
        while k < self.plan.horizon {
            let observer = &mut first.observer;
            let chunk = if is_alone {
                scorer.advance::<false>(record, k, pass_of_first, observer)
            } else {
                scorer.advance::<true>(record, k, pass_of_first, observer)
            };
            k = chunk.end;
            if !Scorer::<R, N>::BESIDE {
                scorer.observe(pass_of_first, record, chunk.clone(), &mut first.observer);
            }
            for Output { method, pass, observer } in &mut *others {
                scorer.observe(pass_of(*method, *pass), record, chunk.clone(), observer);
            }
        }
    }

    /// Computes what is wanted of an output.
    fn measure_output(&mut self, output: usize) {
        let Output {
            method,
            pass: number,
            observer,
        } = &self.outputs[output];
        let passes = &self.methods[*method].done[..=*number];
        let pass = &passes[*number];
        let (plan, responses, to) = (&self.plan, &self.responses, &mut self.measured[output]);
        let mut errors = Errors::<R>::unknown();
        self.scorer.parameters(pass, &mut errors);
        to.failures = pass.failures;
        to.observed = 0;
        if plan.wanted_states {
            let finite = self.scorer.finish(pass, observer, &mut errors);
            to.observed = (pass.state & finite).bits();
            let not_finite = pass.state.bits() & !to.observed;
            for (lane, failure) in to.failures.iter_mut().enumerate() {
                if not_finite >> lane & 1 == 1 {
                    *failure = Some(Failure {
                        kind: FailureKind::NonFinite,
                        stage: Stage::Observer,
                        pass: *number,
                    });
                }
            }
        }
        let unstable = |of: &PassPack<R, N>| (of.parameters & of.unstable).bits();
        to.known = pass.parameters.bits();
        to.unstable = unstable(pass);
        to.unstable_so_far = passes.iter().fold(0, |all, of| all | unstable(of));
        let impulse_response = (plan.wanted_impulse_response).then(|| responses.impulse_response_error(pass));
        let fresh_fit = (plan.wanted_fresh_fit).then(|| responses.fresh_fit(pass));
        let before = number.checked_sub(1).map(|before| &passes[before]);
        R::run(
            #[inline(always)]
            || {
                let n = order::<N>(plan.order);
                let unknown = R::splat(f64::NAN);
                errors.store(&mut to.errors);
                pass.condition.store(&mut to.condition);
                if let Some(error) = impulse_response {
                    error.store(&mut to.impulse_response);
                }
                if let Some(fit) = fresh_fit {
                    fit.store(&mut to.fresh_fit);
                }
                if plan.wanted_radius {
                    let radius = spectral_radius::<R, N>(&pass.a[..n], !pass.unstable);
                    R::select(pass.parameters, radius, unknown).store(&mut to.radius);
                }
                if let Some(before) = before {
                    let change = relative_error(&before.a[..n], &pass.a[..n]);
                    let known = before.parameters & pass.parameters;
                    R::select(known, change, unknown).store(&mut to.change);
                }
                let found = pass.a[..n].iter().chain(&pass.h[..n]);
                let truth = plan.truth.a.iter().chain(&plan.truth.h);
                for ((found, truth), to) in found.zip(truth).zip(&mut to.coefficients) {
                    R::select(pass.parameters, *found - R::splat(*truth), unknown).store(to);
                }
            },
        );
    }
}

impl<R: Real, const N: usize> Pack for PackOf<'_, R, N> {
    fn lanes(&self) -> usize {
        R::LANES
    }

    fn draw(&mut self, trials: Range<u64>) {
        self.count = (trials.end - trials.start) as usize;
        let last = self.count - 1;
        let indices = std::array::from_fn(|lane| trials.start + lane.min(last) as u64);
        self.record.draw(&self.plan.source, &indices);
        if self.plan.wanted_fresh_fit {
            self.responses.draw(&self.plan.source, &indices);
        }
    }

    fn estimate(&mut self) -> u64 {
        let asked = self.asked();
        let (u, y) = (&self.record.u[..self.plan.source.window], &self.record.y[..]);
        self.methods.iter_mut().map(|method| method.estimate(u, y, asked)).sum()
    }

    fn measure(&mut self) {
        if self.plan.wanted_states {
            self.observe();
        }
        (0..self.outputs.len()).for_each(|output| self.measure_output(output));
    }

    fn measured(&self) -> &[Measured] {
        &self.measured
    }

    fn state_errors(&self, last: bool, to: &mut Vec<Lanes>) {
        to.clear();
        let output = if last {
            self.outputs.last()
        } else {
            self.outputs.first()
        };
        let squares = output.map_or(&[][..], |output| &output.observer.curve);
        R::run(
            #[inline(always)]
            || {
                to.extend(squares.iter().map(|square| {
                    let mut error = [0.0; MOST_LANES];
                    square.sqrt().store(&mut error);
                    error
                }));
            },
        );
    }

    fn run_kernel(&mut self, kernel: Kernel) {
        self.kernel(kernel);
    }
}

impl Measured {
    fn unknown(coefficients: usize) -> Self {
        const UNKNOWN: Lanes = [f64::NAN; MOST_LANES];
        Self {
            errors: Errors::all(UNKNOWN),
            impulse_response: UNKNOWN,
            fresh_fit: UNKNOWN,
            condition: UNKNOWN,
            radius: UNKNOWN,
            change: UNKNOWN,
            coefficients: vec![UNKNOWN; coefficients],
            known: 0,
            unstable: 0,
            unstable_so_far: 0,
            observed: 0,
            failures: [None; MOST_LANES],
        }
    }
}
