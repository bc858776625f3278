//! What trials say about a number, and how certainly the number lies within limits.

use crate::claim::freedom::Freedom;
use crate::design::file::claim::CLAIM_LEVEL;
use asobench_identification::metric::Estimate;
use asobench_identification::metric::tails::{normal_point, student_above, student_point};
use one_sided::OneSided;

mod one_sided;

pub(super) use one_sided::{Allowance, Line, More, Side, SidedTest};

/// The numbers that meet a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    /// Minus infinity if there is no lower limit.
    pub(crate) low: f64,
    /// Infinity if there is no upper limit.
    pub(crate) high: f64,
    /// Whether the ends are excluded.
    pub(crate) open: bool,
}

impl Range {
    /// Returns the finite ends.
    fn ends(self) -> [Option<f64>; 2] {
        [self.low, self.high].map(|end| end.is_finite().then_some(end))
    }
}

/// What trials say about a number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Known {
    /// The number itself, without error.
    Exact(f64),
    /// An estimate with a standard error above 0.
    Estimate {
        /// The estimate.
        value: f64,
        /// Its standard error.
        error: f64,
        /// The degrees of freedom of the error.
        freedom: Freedom,
        /// Whether the logarithm is nearly normal instead of the value: for ratios of positive numbers.
        logarithmic: bool,
    },
    /// A moment, whose sides are tested each in its own way.
    Moment {
        /// The estimate.
        value: f64,
        /// Its standard error.
        error: f64,
        /// The degrees of freedom of the error.
        freedom: Freedom,
        /// How it is certainly below a limit, and how above.
        sides: Box<[SidedTest; 2]>,
    },
    /// A share of trials.
    Count {
        /// Trials that count.
        count: u64,
        /// All trials.
        total: u64,
    },
    /// A quantile without a usable standard error, because failed trials or equal values surround it. Known are only
    /// the numbers of trials on either side of a limit.
    Ranks {
        /// The quantile as far as it is known; infinite, of either sign, if it is that of a failed trial.
        value: f64,
        /// The probability q of the quantile.
        q: f64,
        /// Trials.
        total: u64,
        /// Pairs (x, count). If x is below a limit, at least `count` trials are; otherwise at most `count` are.
        points: Vec<(f64, u64)>,
    },
}

impl Known {
    /// Makes a moment that is tested in one way below and in another above a limit.
    pub(crate) fn moment(
        Estimate { value, mcse }: Estimate,
        freedom: Freedom,
        below: SidedTest,
        above: SidedTest,
    ) -> Self {
        Self::Moment {
            value,
            error: mcse,
            freedom,
            sides: Box::new([below, above]),
        }
    }

    /// Returns a moment over a number without error, such as that of theory.
    pub(crate) fn over(self, by: f64) -> Self {
        match self {
            Self::Moment {
                value,
                error,
                freedom,
                sides,
            } => Self::Moment {
                value: value / by,
                error: error / by,
                freedom,
                sides,
            },
            Self::Exact(value) => Self::Exact(value / by),
            other => other,
        }
    }

    /// Returns the value with its standard error; NaN if it has none.
    pub(crate) fn shown(&self) -> (f64, f64) {
        match self {
            Self::Exact(value) | Self::Ranks { value, .. } => (*value, f64::NAN),
            Self::Estimate { value, error, .. } | Self::Moment { value, error, .. } => {
                (*value, *error)
            }
            Self::Count { count, total } => {
                let share = *count as f64 / *total as f64;
                (share, (share * (1.0 - share) / *total as f64).sqrt())
            }
        }
    }

    /// Whether the value itself lies within the range, certain or not.
    pub(crate) fn seems_inside(&self, range: Range) -> bool {
        let value = self.shown().0;
        if range.open {
            range.low < value && value < range.high
        } else {
            range.low <= value && value <= range.high
        }
    }

    /// Returns how many standard errors an estimate lies above a limit, on the scale on which it is nearly normal.
    fn distance(&self, limit: f64) -> Option<(f64, Freedom)> {
        let Self::Estimate {
            value,
            error,
            freedom,
            logarithmic,
        } = self
        else {
            return None;
        };
        let distance = if *logarithmic {
            // Delta method: the standard error of the logarithm is the relative error. Such values are never below 0.
            (value.ln() - limit.max(0.0).ln()) * value / error
        } else {
            (value - limit) / error
        };
        Some((distance, *freedom))
    }

    /// Returns how far inside a range the value lies, on its scale of comparison; negative outside.
    pub(crate) fn depth(&self, range: Range) -> f64 {
        let logarithmic = match self {
            Self::Estimate { logarithmic, .. } => *logarithmic,
            // Both sides only of ratios.
            Self::Moment { sides, .. } => sides.iter().all(|test| test.line == Line::Logarithm),
            _ => false,
        };
        let scaled = |x: f64| if logarithmic { x.max(0.0).ln() } else { x };
        let value = scaled(self.shown().0);
        let [low, high] = range.ends().map(|end| end.map(scaled));
        let low = low.map_or(f64::INFINITY, |low| value - low);
        let high = high.map_or(f64::INFINITY, |high| high - value);
        low.min(high)
    }

    /// Returns how far inside a range the number lies, in approximate standard errors; negative outside.
    pub(crate) fn margin(&self, range: Range) -> f64 {
        let of_test = |test: OneSided| match test {
            OneSided::Sure(is) => {
                if is {
                    f64::INFINITY
                } else {
                    f64::NEG_INFINITY
                }
            }
            OneSided::Student(t, _) => t,
            OneSided::Moment(test, distance, _) => test.t(distance, 1.0, CLAIM_LEVEL),
            OneSided::Few(count, total, chance) => {
                let (n, k) = (total as f64, count as f64);
                (n * chance - k) / (n * chance * (1.0 - chance)).sqrt().max(1e-300)
            }
        };
        self.tests_inside(range)
            .map(of_test)
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the test of lying on one side of a limit. `closed`: the limit itself counts as that side.
    fn one_sided(&self, side: Side, limit: f64, closed: bool) -> OneSided<'_> {
        match self {
            Self::Exact(value) => OneSided::Sure(match side {
                _ if *value == limit => closed,
                Side::Below => *value < limit,
                Side::Above => *value > limit,
            }),
            Self::Estimate { .. } => match (self.distance(limit), side) {
                (Some((t, freedom)), Side::Above) => OneSided::Student(t, freedom),
                (Some((t, freedom)), Side::Below) => OneSided::Student(-t, freedom),
                (None, _) => OneSided::Sure(false),
            },
            Self::Moment {
                value,
                error,
                freedom,
                sides,
            } => {
                let [below, above] = &**sides;
                let (test, sign) = match side {
                    Side::Below => (below, -1.0),
                    Side::Above => (above, 1.0),
                };
                let line = test.line;
                let distance = sign * (line.at(*value) - line.at(limit));
                OneSided::Moment(test, (distance, line.error(*value, *error)), *freedom)
            }
            Self::Count { count, total } => match side {
                Side::Below => OneSided::Few(*count, *total, limit),
                Side::Above => OneSided::Few(total - count, *total, 1.0 - limit),
            },
            Self::Ranks {
                q, total, points, ..
            } => {
                let counts_as_below =
                    |x: f64| x < limit || x == limit && closed == (side == Side::Below);
                let (below, others): (Vec<_>, Vec<_>) =
                    points.iter().partition(|(x, _)| counts_as_below(*x));
                let at_least = below.iter().map(|(_, count)| *count).max().unwrap_or(0);
                let at_most = others
                    .iter()
                    .map(|(_, count)| *count)
                    .min()
                    .unwrap_or(*total);
                match side {
                    Side::Below => OneSided::Few(total - at_least, *total, 1.0 - q),
                    Side::Above => OneSided::Few(at_most, *total, *q),
                }
            }
        }
    }

    /// Returns the tests that the number is inside the range. All must be significant (two one-sided tests if the range
    /// has two ends, Schuirmann 1987).
    fn tests_inside(&self, range: Range) -> impl Iterator<Item = OneSided<'_>> {
        let [low, high] = range.ends();
        let low = low.map(|low| self.one_sided(Side::Above, low, !range.open));
        let high = high.map(|high| self.one_sided(Side::Below, high, !range.open));
        low.into_iter().chain(high)
    }

    /// Returns the tests that the number is outside the range. One must be significant.
    fn tests_outside(&self, range: Range) -> impl Iterator<Item = OneSided<'_>> {
        let [low, high] = range.ends();
        let low = low.map(|low| self.one_sided(Side::Below, low, range.open));
        let high = high.map(|high| self.one_sided(Side::Above, high, range.open));
        low.into_iter().chain(high)
    }

    /// Returns the width of a range with two ends in standard errors of an estimate, and its degrees of freedom.
    fn width(&self, range: Range) -> Option<(f64, Freedom)> {
        let [Some(low), Some(high)] = range.ends() else {
            return None;
        };
        let ((to_low, freedom), (to_high, _)) = (self.distance(low)?, self.distance(high)?);
        Some((to_low - to_high, freedom))
    }

    /// Returns the p-value of "not inside the range": small if the number is certainly inside.
    pub(crate) fn inside(&self, range: Range) -> f64 {
        self.tests_inside(range).map(OneSided::p).fold(0.0, worst)
    }

    /// Whether the p-value of "not inside the range" is at most the level, which is below one half.
    pub(crate) fn is_inside(&self, range: Range, level: f64) -> bool {
        self.tests_inside(range).all(|test| test.is_certain(level))
    }

    /// Returns the p-value of "inside the range": small if the number is certainly outside.
    ///
    /// For an estimate and a range with two ends, let t be its distance beyond the nearer end and w the width of the
    /// range, both in standard errors. Then the p-value is P(T > t) + P(T > t + w). It is exact for a number at either
    /// end: nearly one-sided if the range is wide, and the two-sided test if it is a point. For counts it is twice the
    /// smaller tail.
    pub(crate) fn outside(&self, range: Range) -> f64 {
        let tests: Vec<OneSided> = self.tests_outside(range).collect();
        match (tests.as_slice(), self.width(range)) {
            ([OneSided::Student(a, _), OneSided::Student(b, _)], Some((width, freedom))) => {
                let (t, nu) = (a.max(*b), freedom.now);
                (student_above(t, nu) + student_above(t + width, nu)).min(1.0)
            }
            ([a, b], _) => (self.ends_at_once() * f64::min(a.p(), b.p())).min(1.0),
            ([a], _) => a.p(),
            _ => 1.0,
        }
    }

    /// Returns the correction factor for two tests of which one suffices.
    fn ends_at_once(&self) -> f64 {
        if matches!(self, Self::Exact(_)) {
            1.0
        } else {
            2.0
        }
    }

    /// Returns the chance that [`Self::inside`] is at most `level` with more trials.
    pub(crate) fn power_inside(&self, range: Range, more: More, level: f64) -> f64 {
        let misses = self
            .tests_inside(range)
            .map(|test| 1.0 - test.power(more, level));
        (1.0 - misses.sum::<f64>()).max(0.0)
    }

    /// Returns the chance that [`Self::outside`] is at most `level` with `factor` times the trials.
    pub(crate) fn power_outside(&self, range: Range, more: More, level: f64) -> f64 {
        let of_each = match (self.width(range), range.ends()) {
            (Some((width, Freedom { now, grows })), _) => {
                let growth = grows.map_or(1.0, |_| more.factor);
                let nu = now * growth.powf(grows.unwrap_or(0.0));
                level_of_an_end(width * growth.sqrt(), nu, level)
            }
            (None, [Some(_), Some(_)]) => level / self.ends_at_once(),
            _ => level,
        };
        let hits = self
            .tests_outside(range)
            .map(|test| test.power(more, of_each));
        hits.sum::<f64>().min(1.0)
    }
}

/// Returns P(T > t) for the t that solves P(T > t) + P(T > t + width) = level.
fn level_of_an_end(width: f64, nu: f64, level: f64) -> f64 {
    let (mut low, mut high) = (level / 2.0, level);
    for _ in 0..20 {
        let middle = f64::midpoint(low, high);
        let t = student_point(normal_point(middle), nu);
        if middle + student_above(t + width, nu) > level {
            high = middle;
        } else {
            low = middle;
        }
    }
    low
}

/// Returns the larger of two p-values; 1 if one is undefined.
pub(crate) fn worst(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        1.0
    } else {
        a.max(b)
    }
}
