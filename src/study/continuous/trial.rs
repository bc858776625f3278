//! One trial in continuous time: draw the disturbance, run every observer, measure.

use super::trace::append;
use super::{ContinuousCell, Traces};
use crate::estimator::{Failure, FailureKind, Stage};
use crate::observer::gpebo::{
    Cascade, CascadeError, Convergence, ObserverSpec, ObserverSummary, Outcome, Sample, halve,
};
use crate::study::{Experiment, Figure, Row, Trials};

/// theta is reached where its relative error is below this.
const REACHED: f64 = 0.1;

/// Runs trials of one cell: one value per worker.
pub struct ContinuousTrial<'e> {
    cell: &'e ContinuousCell,
    seed: u64,
    scores: Vec<Score>,
}

impl ContinuousCell {
    /// The run of a trial.
    ///
    /// # Errors
    /// If the parts do not fit each other: [`CascadeError`].
    pub fn cascade(&self, seed: u64, trial: u64) -> Result<Cascade, CascadeError> {
        let scenario = self.scenario(self.draw(seed, trial));
        Cascade::new(&self.plant, &scenario, &self.gpebo, &self.observers)
    }

    /// Whether a trial can be run; which one does not matter.
    ///
    /// # Errors
    /// As [`Self::cascade`].
    pub(super) fn check(&self, seed: u64) -> Result<(), CascadeError> {
        self.cascade(seed, 0).map(|_| ())
    }
}

impl<'e> ContinuousTrial<'e> {
    /// Buffers for a cell.
    ///
    /// # Errors
    /// As [`ContinuousCell::cascade`].
    pub fn new(experiment: &Experiment, cell: &'e ContinuousCell) -> Result<Self, CascadeError> {
        cell.check(experiment.file.seed)?;
        Ok(Self {
            cell,
            seed: experiment.file.seed,
            scores: vec![Score::default(); cell.observers.len()],
        })
    }

    /// Runs a trial and appends its rows, one per observer; of trial 0 its course too, where it is wanted.
    pub fn run_into(&mut self, trial: u64, to: &mut Trials) {
        let every = self.cell.trace_every.filter(|_| trial == 0);
        self.run_with_course(trial, every, to);
    }

    /// The same, with the trial's course in points of so many seconds, where they are given.
    pub fn run_with_course(&mut self, trial: u64, every: Option<f64>, to: &mut Trials) {
        let rows = 0..self.cell.observers.len();
        // Checked by `new`; but random phases may make steps of too many lengths.
        let Ok(cascade) = self.cell.cascade(self.seed, trial) else {
            to.rows
                .extend(rows.map(|output| failed(Row::new(trial, output), FailureKind::NotRun)));
            return;
        };
        self.scores.fill(Score::default());
        let mut course = every.map(|every| self.course(every, &cascade));
        let found = halve(&cascade, |sample| {
            for (score, estimate) in self.scores.iter_mut().zip(sample.estimates) {
                let of = (sample.t, sample.x, cascade.theta());
                score.add(of, &estimate.x, &estimate.theta, self.cell.scored_from);
            }
            if let Some(course) = &mut course {
                course.add(sample);
            }
        });
        let dbar = found
            .summary
            .largest_dbar
            .iter()
            .fold(0.0, |most: f64, x| most.max(*x));
        for output in rows {
            let mut row = Row::new(trial, output);
            row[Figure::MixedDisturbance] = dbar;
            row[Figure::Excitation] = found.summary.smallest_eigenvalue.unwrap_or(f64::NAN);
            let (of, step) = (&found.summary.observers[output], found.observers[output]);
            to.rows.push(self.row(row, of, step));
        }
        if let Some(course) = course {
            to.traces = Some(course.traces);
        }
    }

    /// What of a trial is kept.
    fn course(&self, every: f64, cascade: &Cascade) -> Course {
        let is_gpebo = |spec: &ObserverSpec| !matches!(spec, ObserverSpec::Luenberger { .. });
        let estimates: Vec<bool> = self.cell.observers.iter().map(is_gpebo).collect();
        Course {
            every,
            traces: Traces::new(cascade.theta().to_vec(), &estimates),
        }
    }

    /// The row of an observer, from its score.
    fn row(&self, mut row: Row, of: &ObserverSummary, step: Convergence) -> Row {
        let score = &self.scores[row.output];
        if of.outcome != Outcome::Finite {
            return failed(row, FailureKind::NonFinite);
        }
        let relative = step.relative();
        row[Figure::StepError] = relative;
        row[Figure::StepOrder] = step.state.order.unwrap_or(f64::NAN);
        // A NaN is no small error.
        if !(relative <= self.cell.error_limit) {
            return failed(row, FailureKind::StepTooLong);
        }
        if score.overflows() {
            return failed(row, FailureKind::NonFinite);
        }
        score.fill(&mut row, self.cell.until - self.cell.scored_from);
        let gains: &[f64] = match &self.cell.observers[row.output] {
            ObserverSpec::Gradient { gains } | ObserverSpec::Proposed { gains, .. } => gains,
            ObserverSpec::Luenberger { .. } | ObserverSpec::KalmanBucy { .. } => &[],
        };
        let learnt = gains
            .iter()
            .zip(&of.excitation.integral)
            .map(|(gain, of)| gain * of);
        row[Figure::Adaptation] = learnt.fold(f64::NAN, f64::min);
        let frozen = of.excitation.frozen_at.iter().copied();
        // All components: the estimate as a whole is frozen when the last one is.
        let last = frozen.collect::<Option<Vec<f64>>>();
        let last = last.map_or(f64::NAN, |of| of.into_iter().fold(f64::NAN, f64::max));
        row[Figure::Frozen] = last;
        row
    }
}

/// A row that has no figure of merit.
fn failed(mut row: Row, kind: FailureKind) -> Row {
    row.failure = Some(Failure {
        kind,
        stage: Stage::Observer,
        pass: 0,
    });
    row
}

/// Squared errors of one observer, integrated over the scored time by the trapezoidal rule.
#[derive(Clone, Copy, Debug, Default)]
struct Score {
    /// Time, then squared errors of x, x_1, x_2 and theta, at the point before.
    before: Option<[f64; 5]>,
    /// Integrals of the squared errors of x, x_1, x_2 and theta.
    integrals: [f64; 4],
    /// Relative error of theta at the last point.
    theta: f64,
    /// Since when it has been below [`REACHED`] once.
    reached: Option<f64>,
    /// Whether there is a second state.
    second: bool,
    estimates: bool,
}

impl Score {
    /// Adds a point: time, x and theta as they are, and as estimated.
    fn add(&mut self, of: (f64, &[f64], &[f64]), x_hat: &[f64], theta_hat: &[f64], from: f64) {
        let (t, x, theta) = of;
        let square = |a: f64, b: f64| (a - b) * (a - b);
        let norm =
            |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| square(*a, *b)).sum() };
        self.second = x.len() > 1;
        self.estimates = !theta_hat.is_empty();
        let mut point = [t, norm(x, x_hat), square(x[0], x_hat[0]), 0.0, 0.0];
        if self.second {
            point[3] = square(x[1], x_hat[1]);
        }
        if self.estimates {
            // Undefined where theta is zero.
            let size: f64 = theta.iter().map(|theta| theta * theta).sum();
            let square = if size > 0.0 {
                norm(theta, theta_hat) / size
            } else {
                f64::NAN
            };
            point[4] = square;
            self.theta = square.sqrt();
            if self.reached.is_none() && self.theta < REACHED {
                self.reached = Some(t);
            }
        }
        if let Some(before) = self.before.filter(|_| t > from) {
            let width = t - before[0].max(from);
            // The value at `from`, on the straight line to it.
            let share = width / (t - before[0]);
            for i in 0..4 {
                let first = point[i + 1] + share * (before[i + 1] - point[i + 1]);
                self.integrals[i] += 0.5 * width * (first + point[i + 1]);
            }
        }
        self.before = Some(point);
    }

    /// Whether a squared error is beyond the largest number.
    fn overflows(&self) -> bool {
        let [states @ .., theta] = self.integrals;
        !states.iter().all(|integral| integral.is_finite()) || theta.is_infinite()
    }

    /// Fills the figures; `time` is how long was scored.
    fn fill(&self, row: &mut Row, time: f64) {
        let [x, x1, x2, theta] = self.integrals.map(|integral| (integral / time).sqrt());
        row[Figure::RmsState] = x;
        row[Figure::RmsState1] = x1;
        if self.second {
            row[Figure::RmsState2] = x2;
        }
        if self.estimates {
            row[Figure::Theta] = self.theta;
            row[Figure::ThetaRms] = theta;
            row[Figure::Reaching] = self.reached.unwrap_or(f64::NAN);
        }
    }
}

/// The course of a trial, a point at a time.
struct Course {
    every: f64,
    traces: Traces,
}

impl Course {
    /// Keeps a point where one is due.
    fn add(&mut self, sample: &Sample<'_>) {
        let traces = &mut self.traces;
        let due = traces.times.len() as f64 * self.every;
        // Times are sums of steps.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors that are straight lines: x_1 - xhat_1 = 2 from t = 1 on, theta nearer and nearer.
    #[test]
    fn scores_of_known_errors() {
        let mut score = Score::default();
        for k in 0..=40 {
            let t = f64::from(k) / 10.0;
            let theta = [3.0 * (1.0 - 0.5 * t).max(0.0)];
            score.add(
                (t, &[5.0, 1.0], &[3.0]),
                &[3.0, 1.0],
                &[3.0 - theta[0]],
                1.05,
            );
        }
        let mut row = Row::new(0, 0);
        score.fill(&mut row, 4.0 - 1.05);
        assert!((row[Figure::RmsState] - 2.0).abs() < 1e-14);
        assert!((row[Figure::RmsState1] - 2.0).abs() < 1e-14);
        assert_eq!(row[Figure::RmsState2], 0.0);
        assert_eq!(row[Figure::Theta], 0.0);
        // 1 - t/2 < 0.1 from t = 1.8 on, where it is 0.1 to rounding.
        assert!((1.8..=1.9).contains(&row[Figure::Reaching]));
    }
}
