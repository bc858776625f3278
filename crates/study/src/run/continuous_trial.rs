//! Trials in continuous time: draw the disturbances, run every observer, measure.

use crate::design::{ContinuousCell, Experiment, Measure};
use crate::outcome::row::Row;
use crate::outcome::spent::Watch;
use crate::outcome::traces::{Traces, append};
use crate::outcome::trials::Trials;
use asobench_identification::estimator::{Failure, FailureKind, Stage};
use asobench_identification::observer::gpebo::{
    Cascade, CascadeError, Convergence, Halving, ObserverSpec, ObserverSummary, Outcome, Propagators, Sample, halve,
    halve_pack,
};
use asobench_identification::real::Real;
use asobench_lanes::{Call, Isa};
use std::ops::Range;

/// Runs trials of one cell, as many in lock step as the machine's registers hold; each worker has its own.
pub struct ContinuousTrial<'e> {
    cell: &'e ContinuousCell,
    seed: u64,
    isa: Isa,
    known: Propagators,
}

/// Runs trials in lock step.
struct Halve<'a> {
    cascades: &'a [Cascade],
    known: &'a mut Propagators,
}

impl Call for Halve<'_> {
    type Output = Vec<Halving>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        halve_pack::<R>(self.cascades, self.known)
    }
}

impl ContinuousCell {
    /// Makes the run of a trial.
    ///
    /// # Errors
    /// If the parts do not fit each other: [`CascadeError`].
    pub fn cascade(&self, seed: u64, trial: u64) -> Result<Cascade, CascadeError> {
        let scenario = self.scenario(self.draw(seed, trial));
        Cascade::new(&self.plant, &scenario, &self.gpebo, &self.observers)
    }

    /// Checks that a trial can be run; any trial serves.
    ///
    /// # Errors
    /// As for [`Self::cascade`].
    pub(crate) fn check(&self, seed: u64) -> Result<(), CascadeError> {
        self.cascade(seed, 0).map(|_| ())
    }
}

impl<'e> ContinuousTrial<'e> {
    /// Makes buffers for a cell.
    ///
    /// # Errors
    /// As for [`ContinuousCell::cascade`].
    pub fn new(experiment: &Experiment, cell: &'e ContinuousCell) -> Result<Self, CascadeError> {
        cell.check(experiment.file.seed)?;
        Ok(Self {
            cell,
            seed: experiment.file.seed,
            isa: Isa::best(),
            known: Propagators::default(),
        })
    }

    /// Runs trials and appends their rows, one per observer. For trial 0 also stores its course, if wanted.
    pub fn run_into(&mut self, mut trials: Range<u64>, to: &mut Trials) {
        if self.cell.trace_every.is_some() && trials.start == 0 && !trials.is_empty() {
            self.run_with_course(0, self.cell.trace_every, to);
            trials.start = 1;
        }
        let mut watch = Watch::start();
        let drawn = trials.map(|trial| (trial, self.cell.cascade(self.seed, trial)));
        let drawn: Vec<_> = drawn.collect();
        let cascades = drawn.iter().filter_map(|(_, drawn)| drawn.as_ref().ok());
        let cascades: Vec<Cascade> = cascades.cloned().collect();
        let halve = Halve {
            cascades: &cascades,
            known: &mut self.known,
        };
        // No code is specialised for an order.
        let mut found = self.isa.dispatch(1, halve).into_iter();
        for (trial, drawn) in drawn {
            let halving = drawn.ok().and_then(|_| found.next());
            self.append(trial, halving.as_ref(), to);
        }
        to.spent.simulation += watch.lap();
    }

    /// Does the same, and stores the trial's course with a point every `every` seconds, if given.
    pub fn run_with_course(&self, trial: u64, every: Option<f64>, to: &mut Trials) {
        let Ok(cascade) = self.cell.cascade(self.seed, trial) else {
            return self.append(trial, None, to);
        };
        let mut course = every.map(|every| self.course(every, &cascade));
        let mut watch = Watch::start();
        let found = halve(&cascade, |sample| {
            if let Some(course) = &mut course {
                course.add(sample);
            }
        });
        self.append(trial, Some(&found), to);
        to.spent.simulation += watch.lap();
        if let Some(course) = course {
            to.traces = Some(course.traces);
        }
    }

    /// Appends the rows of a trial. It may not have been run: `new` checked it, but random phases may lead to steps of
    /// too many lengths.
    fn append(&self, trial: u64, found: Option<&Halving>, to: &mut Trials) {
        let rows = 0..self.cell.observers.len();
        let Some(found) = found else {
            for output in rows {
                let row = failed(Row::new(trial, output), FailureKind::NotRun);
                to.rows.push(&row, &[]);
            }
            return;
        };
        let largest = found.summary.largest_dbar.iter();
        let dbar = largest.fold(0.0, |most: f64, x| most.max(*x));
        for output in rows {
            let mut row = Row::new(trial, output);
            row[Measure::MixedDisturbance] = dbar;
            row[Measure::Excitation] = found.summary.smallest_eigenvalue.unwrap_or(f64::NAN);
            let (observer, step) = (&found.summary.observers[output], found.observers[output]);
            to.rows.push(&self.row(row, observer, step), &[]);
        }
    }

    /// Makes the empty course of a trial.
    fn course(&self, every: f64, cascade: &Cascade) -> Course {
        let observers = self.cell.observers.iter();
        let estimates: Vec<bool> = observers.map(ObserverSpec::is_gpebo).collect();
        Course {
            every,
            traces: Traces::new(cascade.theta().to_vec(), &estimates),
        }
    }

    /// Fills the row of an observer.
    fn row(&self, mut row: Row, observer: &ObserverSummary, step: Convergence) -> Row {
        if observer.outcome != Outcome::Finite {
            return failed(row, FailureKind::NonFinite);
        }
        let relative = step.relative();
        row[Measure::StepError] = relative;
        row[Measure::StepOrder] = step.state.order.unwrap_or(f64::NAN);
        // A NaN does not count as a small error.
        if !(relative <= self.cell.error_limit) {
            return failed(row, FailureKind::StepTooLong);
        }
        let accuracy = &observer.accuracy;
        if accuracy.overflows() {
            return failed(row, FailureKind::NonFinite);
        }
        row[Measure::RmsState] = accuracy.rms_state;
        for (measure, rms) in Measure::STATES.into_iter().zip(&accuracy.rms_states) {
            row[measure] = *rms;
        }
        row[Measure::ThetaRms] = accuracy.rms_theta;
        row[Measure::Theta] = accuracy.theta;
        row[Measure::Reaching] = accuracy.reached.unwrap_or(f64::NAN);
        row[Measure::Settling] = accuracy.settled.unwrap_or(f64::NAN);
        let gains = self.cell.observers[row.output].gains();
        let learnt = gains
            .iter()
            .zip(&observer.excitation.integral)
            .map(|(gain, integral)| gain * integral);
        row[Measure::Adaptation] = learnt.fold(f64::NAN, f64::min);
        let frozen = observer.excitation.frozen_at.iter().copied();
        // All components: the whole estimate is frozen when its last component is.
        let last = frozen.collect::<Option<Vec<f64>>>();
        let last = last.map_or(f64::NAN, |times| times.into_iter().fold(f64::NAN, f64::max));
        row[Measure::Frozen] = last;
        row
    }
}

/// Returns a row of a failed trial, with no further measures.
fn failed(mut row: Row, kind: FailureKind) -> Row {
    row.failure = Some(Failure {
        kind,
        stage: Stage::Observer,
        pass: 0,
    });
    row
}

/// The stored course of a trial, point by point.
struct Course {
    every: f64,
    traces: Traces,
}

impl Course {
    /// Stores a point if one is due.
    fn add(&mut self, sample: &Sample<'_>) {
        let traces = &mut self.traces;
        let due = traces.times.len() as f64 * self.every;
        // Times are sums of steps, so they have rounding errors.
        if sample.t < due - 1e-9 * self.every {
            return;
        }
        traces.times.push(sample.t);
        append(&mut traces.x, sample.x);
        for (output, estimate) in traces.outputs.iter_mut().zip(sample.estimates) {
            append(&mut output.x_hat, &estimate.x);
            append(&mut output.theta_hat, &estimate.theta);
        }
    }
}
