//! How far the results depend on the step.

use super::cascade::{Cascade, Run};
use super::grid::REFINEMENTS;
use super::score::Accuracy;
use super::summary::{Sample, Summary};

/// The step's influence on one observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convergence {
    /// Of xhat, in the unit of x.
    pub state: StepError,
    /// Of theta_hat, in the unit of theta; all zero for observers without one.
    pub theta: StepError,
    /// Of its measures, the largest: the difference of the runs with h/2 and h/4 itself, since
    /// their integrals are of different orders. A root mean square's is relative to itself (to what
    /// is estimated where it is rounding); that of the relative error of theta at the end is what
    /// it is.
    pub measures: f64,
}

impl Convergence {
    /// The largest of the relative errors of xhat, of theta_hat and of the measures; NaN if a run
    /// was not finite.
    pub fn relative(&self) -> f64 {
        let estimates = larger(self.state.relative(), self.theta.relative());
        larger(estimates, self.measures)
    }
}

/// The step's influence on one vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepError {
    /// Estimate of the error of the finest run: the largest difference of a component of the runs
    /// with h/2 and h/4 over time, by `2^p - 1` with the observed order p limited to 1 ... 4 (1
    /// where it is unknown); NaN if a run was not finite.
    pub error: f64,
    /// The largest component of the finest run's vector or of what it estimates over time, to
    /// compare with.
    pub largest: f64,
    /// `log2` of the ratio of the largest differences of neighbouring runs; `None` where they are
    /// rounding, i.e. below eps times `largest` for each propagation of the finest run.
    pub order: Option<f64>,
}

impl StepError {
    /// The error over the largest component; 0 where there is neither.
    pub fn relative(&self) -> f64 {
        if self.error == 0.0 {
            0.0
        } else {
            self.error / self.largest
        }
    }
}

/// Three runs and what they say of each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Halving {
    /// Of the finest run, h/4.
    pub summary: Summary,
    /// One for each observer, in their order.
    pub observers: Vec<Convergence>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Differences {
    coarse: f64,
    fine: f64,
    largest: f64,
}

/// The larger one; NaN if one is NaN.
fn larger(a: f64, b: f64) -> f64 {
    if b <= a || a.is_nan() { a } else { b }
}

/// What two propagations in each of so many steps may round.
fn rounding(largest: f64, steps: usize) -> f64 {
    f64::EPSILON * largest * 2.0 * steps as f64
}

impl Differences {
    /// Compares three vectors, and takes the size of what they estimate.
    fn note(&mut self, [coarse, middle, fine]: [&[f64]; 3], truth: &[f64]) {
        for (i, truth) in truth.iter().enumerate().take(fine.len()) {
            self.coarse = larger(self.coarse, (coarse[i] - middle[i]).abs());
            self.fine = larger(self.fine, (middle[i] - fine[i]).abs());
            self.largest = larger(self.largest, fine[i].abs().max(truth.abs()));
        }
    }

    fn step_error(&self, steps: usize) -> StepError {
        let rounding = rounding(self.largest, steps);
        let order = (self.fine > rounding && self.coarse > rounding)
            .then(|| (self.coarse / self.fine).log2());
        let divisor = order.unwrap_or(1.0).clamp(1.0, 4.0).exp2() - 1.0;
        StepError {
            error: self.fine / divisor,
            largest: self.largest,
            order,
        }
    }
}

/// Runs with steps h, h/2 and h/4 side by side; `visit` sees the finest at t = 0 and after each
/// base step.
pub fn halve(cascade: &Cascade, mut visit: impl FnMut(&Sample<'_>)) -> Halving {
    let mut runs = REFINEMENTS.map(|refine| cascade.start(refine));
    let mut differences = vec![[Differences::default(); 2]; cascade.observers()];
    loop {
        visit(&runs[2].sample());
        let samples = runs.each_ref().map(Run::sample);
        for (observer, [state, theta]) in differences.iter_mut().enumerate() {
            let estimates = samples.map(|sample| &sample.estimates[observer]);
            state.note(estimates.map(|estimate| &estimate.x[..]), samples[2].x);
            theta.note(
                estimates.map(|estimate| &estimate.theta[..]),
                cascade.theta(),
            );
        }
        let [_, _, more] = runs.each_mut().map(Run::advance);
        if !more {
            break;
        }
    }
    let [_, middle, summary] = runs.each_ref().map(Run::summary);
    let size = cascade
        .theta()
        .iter()
        .map(|theta| theta * theta)
        .sum::<f64>();
    let convergence = |(number, differences): (usize, &[Differences; 2])| {
        let [state, theta] = differences.map(|runs| runs.step_error(summary.steps));
        let [state_scale, theta_scale] = [state.largest, theta.largest / size.sqrt()];
        let accuracies = [&middle, &summary].map(|run| &run.observers[number].accuracy);
        Convergence {
            state,
            theta,
            measures: measures(accuracies, [state_scale, theta_scale], summary.steps),
        }
    };
    Halving {
        observers: differences.iter().enumerate().map(convergence).collect(),
        summary,
    }
}

/// [`Convergence::measures`]; the scales are the largest numbers of which the root mean squares
/// of the state and of theta hold errors.
fn measures([middle, fine]: [&Accuracy; 2], [state, theta]: [f64; 2], steps: usize) -> f64 {
    let mut most = (fine.theta - middle.theta).abs().max(0.0);
    let states = middle.rms_states.iter().zip(&fine.rms_states);
    let states = states.map(|(middle, fine)| (*middle, *fine, state));
    let both = [
        (middle.rms_state, fine.rms_state, state),
        (middle.rms_theta, fine.rms_theta, theta),
    ];
    for (middle, fine, scale) in both.into_iter().chain(states) {
        let difference = (middle - fine).abs();
        // No such measure.
        if fine.is_nan() {
            continue;
        }
        let rounds = difference <= rounding(scale, steps);
        let relative = difference / if rounds { scale } else { fine };
        most = larger(most, if difference == 0.0 { 0.0 } else { relative });
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn richardson() {
        let differences = Differences {
            coarse: 1.6,
            fine: 0.1,
            largest: 2.0,
        };
        let found = differences.step_error(100);
        assert_eq!(found.order, Some(4.0));
        assert_eq!(found.error, 0.1 / 15.0);
        let slow = Differences {
            coarse: 0.11,
            fine: 0.1,
            largest: 2.0,
        }
        .step_error(100);
        assert_eq!(slow.error, 0.1);
        let rounding = Differences {
            coarse: 1e-16,
            fine: 1e-16,
            largest: 1.0,
        }
        .step_error(100);
        assert_eq!((rounding.order, rounding.error), (None, 1e-16));
        assert!(larger(f64::NAN, 1.0).is_nan() && larger(1.0, f64::NAN).is_nan());
    }
}
