//! The measures of an output of a trial. Each has one entry of one table.

use crate::design::file::{StudyKind, Time};
use asobench_identification::metric::Worse;
use asobench_identification::names::named_table;

/// The properties of a measure, other than its name and description.
#[expect(clippy::struct_excessive_bools, reason = "each is one property")]
pub struct Entry {
    /// Its name in texts and pictures, without its unit.
    label: &'static str,
    /// Its unit; empty if it has none.
    pub unit: &'static str,
    /// Whether it is an error relative to the true value.
    relative: bool,
    /// Which of two values is the better one.
    pub better: Better,
    /// How an axis of it is drawn.
    pub scale: Scale,
    /// Which studies have it.
    time: Time,
    /// Whether it measures the state's error over the scored samples.
    pub of_state: bool,
    /// Whether it is taken from the points of `[course]`.
    pub of_course: bool,
    /// Whether lanes compute it, or it is undefined in the cells that they cover.
    pub in_lanes: bool,
}

/// Which of two values is the better one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Better {
    /// The smaller one.
    Smaller,
    /// The larger one; failed trials then rank as the smallest.
    Larger,
    /// Neither: the measure describes the trial.
    Neither,
}

/// How an axis of the measure is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Logarithmic.
    Log,
    /// Linear.
    Linear,
    /// Linear in per cent, from below 0 to 100.
    Percent,
}

const PLAIN: Entry = Entry {
    label: "",
    unit: "",
    relative: false,
    better: Better::Smaller,
    scale: Scale::Log,
    time: Time::Discrete,
    of_state: false,
    of_course: false,
    in_lanes: false,
};

const RELATIVE: Entry = Entry {
    relative: true,
    in_lanes: true,
    ..PLAIN
};

const STATE: Entry = Entry {
    of_state: true,
    ..RELATIVE
};

const OF_COURSE: Entry = Entry {
    of_course: true,
    in_lanes: true,
    ..PLAIN
};

const SETTLED: Entry = Entry {
    unit: "samples",
    scale: Scale::Linear,
    ..OF_COURSE
};

const CONTINUOUS: Entry = Entry {
    time: Time::Continuous,
    ..PLAIN
};

named_table! {
    /// A measure of a row. NaN, stored as null, if it is undefined.
    Measure, "measure", Entry {
        /// Relative error of a.
        Ea = "e_a": Entry { label: "e_a", ..RELATIVE },
        /// Relative error of b.
        Eb = "e_b": Entry { label: "e_b", ..RELATIVE },
        /// Relative error of h.
        Eh = "e_h": Entry { label: "e_h", ..RELATIVE },
        /// Relative error of x0.
        Ex0 = "e_x0": Entry { label: "e_x0", ..RELATIVE },
        /// Largest e_x(k), N <= k < K (or 0 <= k < K: setting `scored_from`).
        ExMax = "e_x_max": Entry { label: "max e_x", ..STATE },
        /// Root mean square of e_x(k), over the same k as e_x_max.
        ExRms = "e_x_rms": Entry { label: "rms e_x", ..STATE },
        /// e_a as Eq. (7) is printed (reading E3), and so on for the others.
        EaPrinted = "e_a_as_printed": Entry { label: "e_a as printed", ..RELATIVE },
        /// e_b as printed.
        EbPrinted = "e_b_as_printed": Entry { label: "e_b as printed", ..RELATIVE },
        /// e_h as printed.
        EhPrinted = "e_h_as_printed": Entry { label: "e_h as printed", ..RELATIVE },
        /// e_x0 as printed.
        Ex0Printed = "e_x0_as_printed": Entry { label: "e_x0 as printed", ..RELATIVE },
        /// Largest e_x(k) as printed, over the k where it is defined.
        ExMaxPrinted = "e_x_max_as_printed": Entry { label: "max e_x as printed", ..STATE },
        /// Root mean square of e_x(k) as printed, over the k where it is defined.
        ExRmsPrinted = "e_x_rms_as_printed": Entry { label: "rms e_x as printed", ..STATE },
        /// Spectral radius of A-hat.
        SpectralRadius = "spectral_radius": Entry {
            label: "spectral radius",
            better: Better::Neither,
            scale: Scale::Linear,
            in_lanes: true,
            ..PLAIN
        },
        /// Condition number of the matrix that the solver factorises; null if the solve failed.
        Condition = "condition": Entry { label: "condition number", in_lanes: true, ..PLAIN },
        /// Relative error of the impulse response.
        ImpulseResponse = "e_g": Entry { label: "e_g", ..RELATIVE },
        /// Squared distance of the coefficients from the truth in the metric of the Fisher information, over the number
        /// of free coefficients: 1 on average where the Cramer-Rao bound is reached. Null where there is no such
        /// information, or in a model of another order.
        Distance = "d": Entry { label: "d", ..PLAIN },
        /// Squared error of the impulse response over what it is on average at the Cramer-Rao bound. Null where there
        /// is no such bound; a model of any order has one.
        ResponseDistance = "d_g": Entry { label: "d of the response", ..PLAIN },
        /// Simulated FIT on fresh data, per cent.
        FreshFit = "fit_fresh": Entry {
            label: "FIT on fresh data",
            unit: "%",
            better: Better::Larger,
            scale: Scale::Percent,
            in_lanes: true,
            ..PLAIN
        },
        /// FIT of the record's output predicted `ahead` samples ahead (setting), over the same k as e_x_max, per cent.
        /// The prediction knows u up to k and y up to k - ahead, and has the model of the noise.
        FitAhead = "fit_ahead": Entry {
            label: "FIT of predictions",
            unit: "%",
            better: Better::Larger,
            scale: Scale::Percent,
            ..PLAIN
        },
        /// Relative change of a from the pass before; null for pass 0.
        Change = "change": Entry { label: "change of a", in_lanes: true, ..PLAIN },
        /// `sqrt(mean over k of ||x(k) - xhat(k)||^2)`, in the states' units, over the same k as
        /// e_x; in continuous time over the scored time. Its root mean square over trials is that
        /// of the state's error over trials and samples. The RMSE ratio of two outputs in a comparison
        /// is that of their observers. In this measure no observer with the same
        /// information is better than the Kalman filter.
        RmsState = "rms_x": Entry {
            label: "rms of the state's error",
            time: Time::Both,
            of_state: true,
            in_lanes: true,
            ..PLAIN
        },
        /// p-value of the test by Ljung and Box's statistic over 25 lags that the observer's innovations y(k) - yhat(k)
        /// are white, over the same k as e_x_max, of time-varying filters over their standard deviations. Of white ones
        /// it is uniform from 0 to 1, to the order of 25 over the number of samples; null of fewer than four samples,
        /// or of a model of another order.
        InnovationsWhite = "p_white": Entry {
            label: "p-value of white innovations",
            better: Better::Neither,
            scale: Scale::Linear,
            of_state: true,
            ..PLAIN
        },
        /// State feedback: the largest relative error of the state's estimate that is fed back, over the record, which
        /// begins where the loop is closed. The same for every method that did not fail.
        FedBackMax = "e_x_fed_back_max": Entry { label: "max e_x fed back", ..RELATIVE },
        /// State feedback: root mean square of the same error.
        FedBackRms = "e_x_fed_back_rms": Entry { label: "rms e_x fed back", ..RELATIVE },
        /// Root mean square of e_a(k) over the points of [course]; null if a point has no model.
        CourseEa = "e_a_course": Entry { label: "rms e_a(k)", relative: true, ..OF_COURSE },
        /// Root mean square of e_b(k) over the points of [course]; null if a point has no model.
        CourseEb = "e_b_course": Entry { label: "rms e_b(k)", relative: true, ..OF_COURSE },
        /// Root mean square of e_x(k) over the points of [course], the observer having the model of k; null if a point
        /// has no model.
        CourseEx = "e_x_course": Entry { label: "rms e_x(k)", relative: true, ..OF_COURSE },
        /// The samples after `from` of [course] at which e_a(k) is below its bound and stays there up to the last
        /// point; null if it is above it at the last.
        SettledA = "k_a": Entry { label: "samples until e_a(k) stays below the bound", ..SETTLED },
        /// The same for e_b(k).
        SettledB = "k_b": Entry { label: "samples until e_b(k) stays below the bound", ..SETTLED },
        /// The same for e_x(k).
        SettledX = "k_x": Entry { label: "samples until e_x(k) stays below the bound", ..SETTLED },
        /// Continuous time: root mean square of x_1 - xhat_1 over the scored time.
        RmsState1 = "rms_x1": Entry { label: "rms error of x_1", of_state: true, ..CONTINUOUS },
        /// Continuous time: root mean square of x_2 - xhat_2 over the scored time.
        RmsState2 = "rms_x2": Entry { label: "rms error of x_2", of_state: true, ..CONTINUOUS },
        /// Continuous time: root mean square of x_3 - xhat_3 over the scored time.
        RmsState3 = "rms_x3": Entry { label: "rms error of x_3", of_state: true, ..CONTINUOUS },
        /// Continuous time: root mean square of x_4 - xhat_4 over the scored time.
        RmsState4 = "rms_x4": Entry { label: "rms error of x_4", of_state: true, ..CONTINUOUS },
        /// Continuous time: root mean square of x_5 - xhat_5 over the scored time.
        RmsState5 = "rms_x5": Entry { label: "rms error of x_5", of_state: true, ..CONTINUOUS },
        /// Continuous time: root mean square of x_6 - xhat_6 over the scored time.
        RmsState6 = "rms_x6": Entry { label: "rms error of x_6", of_state: true, ..CONTINUOUS },
        /// Continuous time: root mean square of x_7 - xhat_7 over the scored time.
        RmsState7 = "rms_x7": Entry { label: "rms error of x_7", of_state: true, ..CONTINUOUS },
        /// Continuous time: root mean square of x_8 - xhat_8 over the scored time.
        RmsState8 = "rms_x8": Entry { label: "rms error of x_8", of_state: true, ..CONTINUOUS },
        /// Continuous time: relative error of theta at the end.
        Theta = "e_theta": Entry { label: "e_theta", relative: true, ..CONTINUOUS },
        /// Continuous time: root mean square of the relative error of theta over the scored time.
        ThetaRms = "e_theta_rms": Entry { label: "rms e_theta", relative: true, ..CONTINUOUS },
        /// Continuous time: seconds until the relative error of theta is below 10 % for the first
        /// time.
        Reaching = "t_reach": Entry { label: "time to come within 10 %", unit: "s", ..CONTINUOUS },
        /// Continuous time: seconds until the relative error of theta is below 10 % for good: the
        /// last time that it enters; null if it is outside at the end.
        Settling = "t_settle": Entry { label: "time to stay within 10 %", unit: "s", ..CONTINUOUS },
        /// Continuous time: seconds after which gamma int Delta^2 grows by less than 0.01, so that
        /// theta keeps 99 % of its value; null if it still moves.
        Frozen = "t_frozen": Entry {
            label: "frozen from",
            unit: "s",
            better: Better::Neither,
            ..CONTINUOUS
        },
        /// Continuous time: the smallest gamma int Delta^2 of the components: exp(-this) of the
        /// first error is left.
        Adaptation = "adaptation": Entry {
            label: "adaptation",
            better: Better::Larger,
            ..CONTINUOUS
        },
        /// Continuous time: the smallest eigenvalue of int phi'phi dt of regression (9), the
        /// interval excitation.
        Excitation = "excitation": Entry {
            label: "excitation",
            better: Better::Larger,
            ..CONTINUOUS
        },
        /// Continuous time: the largest |dbar_i|, which the paper assumes to be below 1.
        MixedDisturbance = "dbar_max": Entry {
            label: "largest |dbar|",
            better: Better::Neither,
            ..CONTINUOUS
        },
        /// Continuous time: relative error of the integration, estimated by step halving, of xhat, of theta_hat and of
        /// the reported measures of their errors, the largest.
        StepError = "step_error": Entry { label: "error by step halving", ..CONTINUOUS },
        /// Continuous time: observed order of the integration of xhat.
        StepOrder = "step_order": Entry {
            label: "order of the integration",
            better: Better::Neither,
            scale: Scale::Linear,
            ..CONTINUOUS
        },
    }
}

impl Measure {
    /// The root mean square errors of x_1, x_2, ... in continuous time.
    pub const STATES: [Self; 8] = [
        Self::RmsState1,
        Self::RmsState2,
        Self::RmsState3,
        Self::RmsState4,
        Self::RmsState5,
        Self::RmsState6,
        Self::RmsState7,
        Self::RmsState8,
    ];

    /// The least order of a plant that has the measure.
    pub fn least_order(self) -> usize {
        let state = Self::STATES.iter().position(|measure| *measure == self);
        state.map_or(0, |i| i + 1)
    }

    /// As texts name it, without its unit.
    pub const fn label(self) -> &'static str {
        self.entry().label
    }

    /// Returns the label of an axis: with its unit, or "relative".
    pub fn axis_label(self) -> String {
        let Entry {
            label, unit, relative, ..
        } = self.entry();
        match (relative, unit) {
            (true, _) => format!("{label}, relative"),
            (false, "") => label.to_owned(),
            (false, unit) => format!("{label}, {unit}"),
        }
    }

    /// Returns the worse end of the order, where failed trials rank.
    pub const fn worse(self) -> Worse {
        match self.entry().better {
            Better::Larger => Worse::Smaller,
            Better::Smaller | Better::Neither => Worse::Larger,
        }
    }

    /// Whether it can be negative.
    pub const fn may_be_negative(self) -> bool {
        self.highest().is_some()
    }

    /// The number above which it cannot be: a FIT is at most 100 %, and has no least value. All other measures are at
    /// least 0 and have no largest value: an estimate may be arbitrarily wrong.
    pub const fn highest(self) -> Option<f64> {
        match self.entry().scale {
            Scale::Percent => Some(100.0),
            Scale::Log | Scale::Linear => None,
        }
    }

    /// Whether studies of this kind have the measure.
    pub const fn is_of(self, kind: StudyKind) -> bool {
        self.entry().time.is_of(kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// A forgotten label would be empty; a copied one would name two measures.
    #[test]
    fn labels_and_sentences_tell_measures_apart() {
        for of in [Measure::label, Measure::about] {
            let texts: HashSet<&str> = Measure::ALL.iter().map(|measure| of(*measure)).collect();
            assert_eq!(texts.len(), Measure::ALL.len());
            assert!(!texts.contains(""));
        }
        assert_eq!(Measure::Settling.axis_label(), "time to stay within 10 %, s");
        assert_eq!(Measure::Ea.axis_label(), "e_a, relative");
        assert_eq!(Measure::Condition.axis_label(), "condition number");
    }

    /// Both kinds of study have states, but each has identified parameters of its own.
    #[test]
    fn each_kind_of_study_has_its_measures() {
        let kinds = [StudyKind::Discrete, StudyKind::Continuous];
        let is_of = |measure: Measure| kinds.map(|kind| measure.is_of(kind));
        assert_eq!(is_of(Measure::RmsState), [true, true]);
        assert_eq!(is_of(Measure::Ea), [true, false]);
        assert_eq!(is_of(Measure::Theta), [false, true]);
        assert!(Measure::ALL.iter().all(|of| is_of(*of).contains(&true)));
    }
}
