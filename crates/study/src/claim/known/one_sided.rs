//! One-sided tests: how far a number is from a limit, with the trials that there are and with more.

use crate::claim::freedom::Freedom;
use asobench_identification::metric::tails::{
    binomial_at_most, normal_above, normal_point, student_above, student_point,
};

/// The scale on which an estimate is compared with a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// x.
    Value,
    /// x^2.
    Square,
    /// ln x.
    Logarithm,
}

impl Line {
    pub(crate) fn at(self, x: f64) -> f64 {
        match self {
            Self::Value => x,
            Self::Square => x * x.abs(),
            Self::Logarithm => x.max(0.0).ln(),
        }
    }

    /// Returns the standard error on this scale, by the delta method.
    pub(crate) fn error(self, value: f64, error: f64) -> f64 {
        match self {
            Self::Value => error,
            Self::Square => 2.0 * value * error,
            Self::Logarithm => error / value,
        }
    }
}

/// What unseen trials may add to an estimate: see [`super::moment`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Allowance {
    /// Pairs (a, w) of terms `a ln(1 + c w)`.
    pub(crate) logs: Vec<(f64, f64)>,
    /// The factor of c in a term.
    pub(crate) linear: f64,
    /// The factor of c in the variance.
    pub(crate) square: f64,
}

/// How a moment is tested on one side of a limit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SidedTest {
    /// The scale.
    pub(crate) line: Line,
    /// The factor by which trials must grow before there is a test; 1 if there is one.
    pub(crate) from: f64,
    /// The allowance for unseen trials.
    pub(crate) allowance: Allowance,
}

impl SidedTest {
    /// Student's test.
    pub(crate) const PLAIN: Self = Self {
        line: Line::Value,
        from: 1.0,
        allowance: Allowance {
            logs: Vec::new(),
            linear: 0.0,
            square: 0.0,
        },
    };

    /// Returns how many errors an estimate is beyond a limit, `distance` away with this error, with `factor` times the
    /// trials at a level. A share w of the largest trial falls with their number.
    pub(crate) fn t(&self, (distance, error): (f64, f64), factor: f64, level: f64) -> f64 {
        let c = -level.ln();
        let Allowance {
            logs,
            linear,
            square,
        } = &self.allowance;
        let of_logs = logs.iter().map(|(a, w)| a * (c * w / factor).ln_1p());
        let shift = of_logs.sum::<f64>() + c * linear / factor;
        let variance = error * error / factor + c * square / (factor * factor);
        (distance - shift) / variance.sqrt()
    }
}

/// The side of a limit on which a number is claimed to lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Below,
    Above,
}

/// More trials than there are, and what they may find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct More {
    /// The number of trials over the present one.
    pub(crate) factor: f64,
    /// The truth, in present standard errors from the present estimate: positive on the side of a limit on which it is
    /// to be certain.
    pub(crate) shift: f64,
}

/// The test of "certainly on this side of the limit".
#[derive(Clone, Copy, Debug)]
pub(crate) enum OneSided<'a> {
    /// The answer is certain; no test is needed.
    Sure(bool),
    /// The estimate is t standard errors from the limit, positive on the right side.
    Student(f64, Freedom),
    /// A moment's test, the distance to the right side of the limit with its error, and the degrees of freedom.
    Moment(&'a SidedTest, (f64, f64), Freedom),
    /// (count, total, chance): few successes among the trials, if each has this chance at the limit.
    Few(u64, u64, f64),
}

impl OneSided<'_> {
    pub(crate) fn p(self) -> f64 {
        match self {
            Self::Moment(test, ..) if test.from > 1.0 => 1.0,
            Self::Moment(test, distance, freedom) => {
                least_level(|level| is_certain(test, distance, freedom, level))
            }
            Self::Sure(is) => f64::from(u8::from(!is)),
            Self::Student(t, freedom) => student_above(t, freedom.now),
            Self::Few(count, total, chance) => binomial_at_most(count, total, chance),
        }
    }

    /// Whether p is at most the level, which is below one half.
    pub(crate) fn is_certain(self, level: f64) -> bool {
        match self {
            // Without looking for p, which is many such questions.
            Self::Moment(test, distance, freedom) => {
                test.from <= 1.0 && is_certain(test, distance, freedom, level)
            }
            other => other.p() <= level,
        }
    }

    /// Returns the chance that p <= `level` with more trials.
    pub(crate) fn power(self, More { factor, shift }: More, level: f64) -> f64 {
        match self {
            Self::Sure(is) => f64::from(u8::from(is)),
            Self::Student(t, Freedom { now, grows: None }) => beyond(t + shift, now, level),
            Self::Student(
                t,
                Freedom {
                    now,
                    grows: Some(power),
                },
            ) => beyond((t + shift) * factor.sqrt(), now * factor.powf(power), level),
            Self::Moment(test, _, _) if factor < test.from => 0.0,
            Self::Moment(test, (distance, error), Freedom { now, grows }) => {
                let t = test.t((distance + shift * error, error), factor, level);
                beyond(t, now * factor.powf(grows.unwrap_or(0.0)), level)
            }
            Self::Few(count, total, chance) => {
                let n = total as f64;
                let share = count as f64 / n;
                // Not 0 where no trial or every trial counts.
                let spread = (share * (1.0 - share)).max(1.0 / (n + 1.0)) / n;
                let share = (share - shift * spread.sqrt()).clamp(0.0, 1.0);
                few((n * factor).round() as u64, share, chance, level)
            }
        }
    }
}

/// Whether a moment lies on the right side of a limit at a level.
fn is_certain(test: &SidedTest, distance: (f64, f64), freedom: Freedom, level: f64) -> bool {
    student_above(test.t(distance, 1.0, level), freedom.now) <= level
}

/// Returns the least level at which something is certain that is certain at every higher one; 1 if it is at none below
/// one half.
pub(crate) fn least_level(is_certain: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (-700.0_f64, 0.5_f64.ln());
    if !is_certain(high.exp()) {
        return 1.0;
    }
    for _ in 0..50 {
        let middle = f64::midpoint(low, high);
        if is_certain(middle.exp()) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high.exp()
}

/// Returns P(T' > t). T' is noncentral t with this noncentrality and nu degrees of freedom; t is the point that
/// Student's t exceeds with probability `level`. Uses the normal approximation of Johnson and Kotz (Abramowitz and
/// Stegun 26.7.10).
pub(crate) fn beyond(distance: f64, nu: f64, level: f64) -> f64 {
    let t = student_point(normal_point(level), nu);
    let bias = 1.0 - 1.0 / (4.0 * nu);
    normal_above((t * bias - distance) / (1.0 + t * t / (2.0 * nu)).sqrt())
}

/// Returns P(P(K <= k) <= level). Here k and K count successes among `trials`, of probability `share` for k and
/// `chance` for K.
pub(crate) fn few(trials: u64, share: f64, chance: f64, level: f64) -> f64 {
    /// From this variance on, the normal approximation suffices.
    const LARGE: f64 = 1000.0;
    let n = trials as f64;
    let deviation = |p: f64| (n * p * (1.0 - p)).sqrt();
    if deviation(chance) * deviation(chance) > LARGE && deviation(share) > 0.0 {
        let critical = n * chance - normal_point(level) * deviation(chance);
        return normal_above((n * share - critical) / deviation(share));
    }
    // Bisection for the smallest count that is not significant.
    let (mut low, mut high) = (0, trials + 1);
    while low < high {
        let middle = low + (high - low) / 2;
        if binomial_at_most(middle, trials, chance) <= level {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low.checked_sub(1)
        .map_or(0.0, |most| binomial_at_most(most, trials, share))
}
