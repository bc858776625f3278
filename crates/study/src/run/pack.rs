//! A pack of trials of one cell: draws, estimates and measures them. The rows are as from [`super::Trial`].

use crate::design::{CURVE_TRIALS, Measure, Plan, RESPONSE_SAMPLES};
use crate::outcome::curves::Waiting;
use crate::outcome::rows::Flags;
use crate::outcome::spent::Watch;
use crate::outcome::trials::Trials;
use asobench_identification::estimator::{Failure, FailureKind, Stage};
use asobench_identification::metric::relative_error;
use asobench_identification::plant::radius::spectral_radius;
use asobench_identification::real::{MOST_LANES, Mask, Real};
use asobench_lanes::passes::{PassPack, Passes};
use asobench_lanes::record::Record;
use asobench_lanes::response::Responses;
use asobench_lanes::score::{Errors, PackedObserver as Observer, PackedScorer as Scorer};
use asobench_lanes::{Call, Isa, order};
use std::ops::Range;

/// Buffers to run trials of one cell in lock step.
pub(crate) struct Pack<'e, R: Real, const N: usize> {
    pub(crate) plan: Plan<'e>,
    pub(crate) record: Record<R, N>,
    pub(crate) methods: Vec<Passes<R, N>>,
    scorer: Scorer<R, N>,
    pub(crate) responses: Responses<R, N>,
    outputs: Vec<Output>,
    /// One observer per output.
    observers: Vec<Observer<R, N>>,
    /// e_x(k) of the first and the last output.
    curves: [Waiting; 2],
}

/// One output of a pack.
#[derive(Clone)]
struct Output {
    method: usize,
    pass: usize,
    /// Every measure in every lane.
    values: [[f64; MOST_LANES]; Measure::ALL.len()],
    /// The lanes with an observer.
    observed: u8,
}

/// Runs trials of one cell, a pack at a time, for any type of pack.
pub trait PackTrial {
    /// Runs trials and appends the requested results.
    fn run_into(&mut self, trials: Range<u64>, to: &mut Trials);
    /// Returns the number of trials in a pack.
    fn lanes(&self) -> usize;
}

impl<'e, R: Real, const N: usize> Pack<'e, R, N> {
    pub(crate) fn new(plan: Plan<'e>) -> Self {
        let cell = plan.cell;
        let n = cell.order;
        let methods = plan.methods.iter().map(|method| {
            let (options, passes) = (&method.options, method.passes);
            Passes::new(n, options, passes, cell.window, plan.wanted_condition)
        });
        let outputs = plan.methods.iter().enumerate();
        let outputs = outputs.flat_map(|(method, of)| {
            of.reported.iter().map(move |&pass| Output {
                method,
                pass,
                values: [[f64::NAN; MOST_LANES]; Measure::ALL.len()],
                observed: 0,
            })
        });
        let outputs: Vec<Output> = outputs.collect();
        let curve = if plan.wanted.curves { cell.horizon } else { 0 };
        // For the first and the last output.
        let ends = |output: usize| output == 0 || output + 1 == outputs.len();
        let observers = (0..outputs.len()).map(|output| Observer::new(if ends(output) { curve } else { 0 }));
        let observers: Vec<Observer<R, N>> = observers.collect();
        let (horizon, gain) = (cell.horizon, cell.gain.clone());
        Self {
            record: Record::new(&plan.source, horizon),
            methods: methods.collect(),
            scorer: Scorer::new(cell.window, horizon, gain, &plan.truth, plan.wanted),
            responses: Responses::new(&plan.source, RESPONSE_SAMPLES),
            observers,
            outputs,
            curves: [(); 2].map(|()| Waiting::new(curve)),
            plan,
        }
    }

    /// Runs up to a pack of trials.
    fn run_pack(&mut self, trials: Range<u64>, to: &mut Trials) {
        let count = (trials.end - trials.start) as usize;
        // Surplus lanes repeat the last trial; their results are discarded.
        let indices = std::array::from_fn(|lane| trials.start + lane.min(count - 1) as u64);
        let asked = R::Mask::from_bits(((1_u16 << count) - 1) as u8);
        let mut watch = Watch::start();
        self.record.draw(&self.plan.source, &indices);
        if self.plan.wanted_fresh_fit {
            self.responses.draw(&self.plan.source, &indices);
        }
        to.spent.simulation += watch.lap();
        let (u, y) = (&self.record.u[..self.plan.cell.window], &self.record.y[..]);
        for method in &mut self.methods {
            to.fallbacks += method.estimate(u, y, asked);
        }
        to.spent.estimation += watch.lap();
        if self.plan.wanted_states {
            self.observe();
        }
        for output in 0..self.outputs.len() {
            self.measure(output);
        }
        self.emit(&trials, to);
        to.spent.measures += watch.lap();
        if to.curves.is_some() && trials.start < CURVE_TRIALS {
            let counted = count.min((CURVE_TRIALS - trials.start) as usize);
            let asked = R::Mask::from_bits(((1_u16 << counted) - 1) as u8);
            let ends = [0, self.outputs.len() - 1];
            for (waiting, at) in self.curves.iter_mut().zip(ends) {
                let observed = self.outputs[at].observed & asked.bits();
                waiting.add_squares(&self.observers[at].curve, observed);
            }
            if self.curves[0].is_full() {
                self.count_curves(to);
            }
            to.spent.statistics += watch.lap();
        }
    }

    /// Counts the waiting errors.
    fn count_curves(&mut self, to: &mut Trials) {
        if let Some(curves) = &mut to.curves {
            for (last, waiting) in [false, true].into_iter().zip(&mut self.curves) {
                curves.add_waiting(last, waiting);
            }
        }
    }

    /// Runs all observers along the true trajectory, a chunk at a time.
    pub(crate) fn observe(&mut self) {
        let zero = [R::zero(); N];
        let (record, methods, scorer) = (&self.record, &self.methods, &mut self.scorer);
        let pass_of = |output: &Output| &methods[output.method].done[output.pass];
        for (output, observer) in self.outputs.iter().zip(&mut self.observers) {
            let pass = pass_of(output);
            let x0 = if self.plan.from_zero { &zero } else { &pass.x0 };
            scorer.start(pass, x0, record, observer);
        }
        let Some(first) = self.outputs.first() else {
            return;
        };
        let beside = usize::from(Scorer::<R, N>::BESIDE);
        let mut k = scorer.begin(record);
        while k < self.plan.cell.horizon {
            let observer = &mut self.observers[0];
            let chunk = if self.outputs.len() == beside {
                scorer.advance::<false>(record, k, pass_of(first), observer)
            } else {
                scorer.advance::<true>(record, k, pass_of(first), observer)
            };
            k = chunk.end;
            let others = self.outputs.iter().zip(&mut self.observers).skip(beside);
            for (output, observer) in others {
                scorer.observe(pass_of(output), record, chunk.clone(), observer);
            }
        }
    }

    /// Fills in the measures of an output.
    pub(crate) fn measure(&mut self, output: usize) {
        let Output {
            method,
            pass: number,
            values: to,
            observed,
        } = &mut self.outputs[output];
        let passes = &self.methods[*method].done;
        let pass = &passes[*number];
        let mut errors = Errors::<R>::unknown();
        self.scorer.parameters(pass, &mut errors);
        *observed = 0;
        if self.plan.wanted_states {
            let observer = &self.observers[output];
            let finite = self.scorer.finish(pass, observer, &mut errors);
            *observed = (pass.state & finite).bits();
        }
        let before = number.checked_sub(1).map(|before| &passes[before]);
        let (n, wanted_radius) = (self.plan.cell.order, self.plan.wanted_radius);
        let (plan, responses) = (&self.plan, &self.responses);
        let e_g = (plan.wanted_impulse_response).then(|| responses.impulse_response_error(pass));
        let fit = (plan.wanted_fresh_fit).then(|| responses.fresh_fit(pass));
        R::run(
            #[inline(always)]
            || {
                let n = order::<N>(n);
                let unknown = R::splat(f64::NAN);
                let mut put = |measure: Measure, value: R| value.store(&mut to[measure as usize]);
                let Errors {
                    relative: [e_a, e_b, e_h, e_x0],
                    as_printed: [a_printed, b_printed, h_printed, x0_printed],
                    state: [maximum, rms],
                    state_as_printed: [maximum_printed, rms_printed],
                    state_absolute,
                } = errors;
                put(Measure::Ea, e_a);
                put(Measure::Eb, e_b);
                put(Measure::Eh, e_h);
                put(Measure::Ex0, e_x0);
                put(Measure::EaPrinted, a_printed);
                put(Measure::EbPrinted, b_printed);
                put(Measure::EhPrinted, h_printed);
                put(Measure::Ex0Printed, x0_printed);
                put(Measure::ExMax, maximum);
                put(Measure::ExRms, rms);
                put(Measure::ExMaxPrinted, maximum_printed);
                put(Measure::ExRmsPrinted, rms_printed);
                put(Measure::RmsState, state_absolute);
                if let Some(e_g) = e_g {
                    put(Measure::ImpulseResponse, e_g);
                }
                if let Some(fit) = fit {
                    put(Measure::FreshFit, fit);
                }
                put(Measure::Condition, pass.condition);
                if wanted_radius {
                    let radius = spectral_radius::<R, N>(&pass.a[..n], !pass.unstable);
                    let radius = R::select(pass.parameters, radius, unknown);
                    put(Measure::SpectralRadius, radius);
                }
                if let Some(before) = before {
                    let change = relative_error(&before.a[..n], &pass.a[..n]);
                    let known = before.parameters & pass.parameters;
                    put(Measure::Change, R::select(known, change, unknown));
                }
            },
        );
    }

    /// Appends the rows of a pack.
    fn emit(&self, trials: &Range<u64>, to: &mut Trials) {
        let count = (trials.end - trials.start) as usize;
        let plan = &self.plan;
        let (kept, outputs) = to.rows.next(trials.start);
        for (output, rows) in self.outputs.iter().zip(outputs) {
            let passes = &self.methods[output.method].done[..=output.pass];
            let pass = &passes[output.pass];
            let known = pass.parameters.bits();
            let is_unstable = |of: &PassPack<R, N>| (of.parameters & of.unstable).bits();
            let unstable = is_unstable(pass);
            let so_far = passes.iter().fold(0, |all, of| all | is_unstable(of));
            let not_observed = if plan.wanted_states {
                pass.state.bits() & !output.observed
            } else {
                0
            };
            for lane in 0..count {
                let has = |bits: u8| bits >> lane & 1 == 1;
                let unstable = has(known).then(|| has(unstable));
                let not_finite = has(not_observed).then_some(Failure {
                    kind: FailureKind::NonFinite,
                    stage: Stage::Observer,
                    pass: output.pass,
                });
                let flags = Flags::new(unstable, has(so_far));
                rows.push(flags, not_finite.or(pass.failures[lane]));
            }
            let [values, parameters] = rows.columns();
            for (column, &measure) in values.iter_mut().zip(kept) {
                column.extend_from_slice(&output.values[measure as usize][..count]);
            }
            let n = plan.cell.order;
            let parts = [(&pass.a, &plan.truth.a), (&pass.h, &plan.truth.h)];
            for ((found, truth), columns) in parts.into_iter().zip(parameters.chunks_mut(n)) {
                for ((column, found), truth) in columns.iter_mut().zip(found).zip(truth) {
                    let mut lanes = [0.0; MOST_LANES];
                    found.store(&mut lanes);
                    let errors = lanes.iter().enumerate().take(count);
                    column.extend(errors.map(|(lane, found)| {
                        if known >> lane & 1 == 1 {
                            found - truth
                        } else {
                            f64::NAN
                        }
                    }));
                }
            }
        }
    }
}

impl<R: Real, const N: usize> PackTrial for Pack<'_, R, N> {
    fn run_into(&mut self, trials: Range<u64>, to: &mut Trials) {
        let mut from = trials.start;
        while from < trials.end {
            let end = trials.end.min(from + R::LANES as u64);
            self.run_pack(from..end, to);
            from = end;
        }
        self.count_curves(to);
    }

    fn lanes(&self) -> usize {
        R::LANES
    }
}

impl<'e> Call for Plan<'e> {
    type Output = Box<dyn PackTrial + 'e>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        Box::new(Pack::<R, N>::new(self))
    }
}

impl<'e> Plan<'e> {
    /// Makes the buffers to run it.
    ///
    /// # Panics
    /// If this machine does not have the instructions.
    pub fn pack(self, isa: Isa) -> Box<dyn PackTrial + 'e> {
        isa.dispatch(self.cell.order, self)
    }
}
