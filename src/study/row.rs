//! One line of results: one output of one method on one trial.

use crate::estimator::Failure;
use crate::metric::Worse;
use crate::names::named_enum;
use serde::{Deserialize, Serialize};
use std::ops::{Index, IndexMut};

named_enum! {
    /// A measure of a row. NaN, stored as null, where it is undefined.
    Measure, "measure" {
        /// Relative error of a.
        Ea = "e_a",
        /// Relative error of b.
        Eb = "e_b",
        /// Relative error of h.
        Eh = "e_h",
        /// Relative error of x0.
        Ex0 = "e_x0",
        /// Largest e_x(k), N <= k < K (or 0 <= k < K: setting `scored_from`).
        ExMax = "e_x_max",
        /// Root mean square of e_x(k), over the same k.
        ExRms = "e_x_rms",
        /// e_a as Eq. (7) is printed (reading E3), and so on for the others.
        EaPrinted = "e_a_as_printed",
        /// e_b as printed.
        EbPrinted = "e_b_as_printed",
        /// e_h as printed.
        EhPrinted = "e_h_as_printed",
        /// e_x0 as printed.
        Ex0Printed = "e_x0_as_printed",
        /// Largest e_x(k) as printed, over the k where it is defined.
        ExMaxPrinted = "e_x_max_as_printed",
        /// Root mean square of e_x(k) as printed, over the k where it is defined.
        ExRmsPrinted = "e_x_rms_as_printed",
        /// Spectral radius of A-hat.
        SpectralRadius = "spectral_radius",
        /// Condition number: [`crate::estimator::solver::Solution::condition`]; null where the solve failed.
        Condition = "condition",
        /// Relative error of the impulse response: [`crate::metric::Response::impulse_response_error`].
        ImpulseResponse = "e_g",
        /// Simulated FIT on fresh data, per cent: [`crate::metric::Response::fresh_fit`].
        FreshFit = "fit_fresh",
        /// Relative change of a from the pass before; null for pass 0.
        Change = "change",
        /// `sqrt(mean over k of ||x(k) - xhat(k)||^2)`, in the states' units, over the same k as e_x; in continuous time over the scored time. Its root mean square
        /// over trials is that of the state's error over trials and samples, and the ratio of two outputs' (RMSE ratio of
        /// a comparison) that of the two observers: the measure in which no observer of the same information is better
        /// than the Kalman filter.
        RmsState = "rms_x",
        /// Continuous time: of x_1 - xhat_1.
        RmsState1 = "rms_x1",
        /// Continuous time: of x_2 - xhat_2.
        RmsState2 = "rms_x2",
        /// Continuous time: relative error of theta at the end.
        Theta = "e_theta",
        /// Continuous time: its root mean square over the scored time.
        ThetaRms = "e_theta_rms",
        /// Continuous time: seconds until the relative error of theta is below 10 % for the first time.
        Reaching = "t_reach",
        /// Continuous time: seconds until the relative error of theta is below 10 % for good: the
        /// last entry; null where it is outside at the end.
        Settling = "t_settle",
        /// Continuous time: seconds after which gamma int Delta^2 grows by less than 0.01, so that theta keeps 99 % of what it
        /// is; null where it still moves.
        Frozen = "t_frozen",
        /// Continuous time: the smallest gamma int Delta^2 of the components: exp(-this) of the first error is left.
        Adaptation = "adaptation",
        /// Continuous time: the smallest eigenvalue of int phi'phi dt of regression (9), the interval excitation.
        Excitation = "excitation",
        /// Continuous time: the largest |dbar_i|, which the paper assumes to be below 1.
        MixedDisturbance = "dbar_max",
        /// Continuous time: relative error by step halving of xhat, of theta_hat and of the
        /// measures of their errors, the largest.
        StepError = "step_error",
        /// Continuous time: observed order of the integration of xhat.
        StepOrder = "step_order",
    }
}

impl Measure {
    /// The worse end of the order, where lost trials stand.
    pub fn worse(self) -> Worse {
        if self == Self::FreshFit {
            Worse::Smaller
        } else {
            Worse::Larger
        }
    }

    /// Whether the measure is of the state's error, over the samples that are scored.
    pub(super) fn is_of_state(self) -> bool {
        let relative = [
            Self::ExMax,
            Self::ExRms,
            Self::ExMaxPrinted,
            Self::ExRmsPrinted,
        ];
        self == Self::RmsState || relative.contains(&self)
    }

    /// Whether a study in continuous time, or in discrete time, has the measure.
    pub fn is_of(self, continuous: bool) -> bool {
        self == Self::RmsState || (self > Self::RmsState) == continuous
    }
}

/// One output of one method on one trial.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Row {
    /// The trial's index.
    pub trial: u64,
    /// The output's index in [`super::Experiment::outputs`].
    pub output: usize,
    /// What stopped the pass, if anything did.
    pub failure: Option<Failure>,
    /// Whether A-hat has a pole on or outside the unit circle; `None` where there is no A-hat.
    pub unstable: Option<bool>,
    /// Whether this or an earlier pass of the method had such an A-hat, reported or not.
    pub unstable_so_far: bool,
    values: [f64; Measure::ALL.len()],
}

impl Row {
    /// A row without values.
    pub fn new(trial: u64, output: usize) -> Self {
        Self {
            trial,
            output,
            failure: None,
            unstable: None,
            unstable_so_far: false,
            values: [f64::NAN; Measure::ALL.len()],
        }
    }

    /// "ok" or the failure's kind.
    pub fn status(&self) -> &'static str {
        self.failure.map_or("ok", |failure| failure.kind.name())
    }

    /// Whether two rows are equal bit for bit.
    pub fn same_bits(&self, other: &Self) -> bool {
        let bits = |row: &Self| row.values.map(f64::to_bits);
        let rest = |row: &Self| {
            let unstable = (row.unstable, row.unstable_so_far);
            (row.trial, row.output, row.failure, unstable)
        };
        rest(self) == rest(other) && bits(self) == bits(other)
    }

    /// A measure as statistics take it: NaN of a failed row, whatever it had got to.
    pub fn counted(&self, measure: Measure) -> f64 {
        match self.failure {
            None => self[measure],
            Some(_) => f64::NAN,
        }
    }

    /// Whether the trial failed or left an unstable A-hat.
    pub fn is_lost(&self) -> bool {
        self.failure.is_some() || self.unstable == Some(true)
    }
}

impl Index<Measure> for Row {
    type Output = f64;

    fn index(&self, measure: Measure) -> &f64 {
        &self.values[measure as usize]
    }
}

impl IndexMut<Measure> for Row {
    fn index_mut(&mut self, measure: Measure) -> &mut f64 {
        &mut self.values[measure as usize]
    }
}
