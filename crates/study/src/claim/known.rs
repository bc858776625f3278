//! The evidence of trials about a number: on which side of a limit it certainly lies, and how certain that is.
//!
//! Shares and quantiles are judged by exact binomial tests, two medians on the same trials by all cuts (`cuts`), slopes
//! of medians by the order statistics of each cell, means by bets (`bets`). None of these assumes a law.

use crate::claim::bets::mean_above;
use crate::claim::cuts::median_below;
use crate::claim::one_sided::{More, OneSided, Prospect, Side};
use crate::claim::ranked::Ranked;
use asobench_identification::metric::tails::normal_above;

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
    /// Returns the finite ends, each with the side on which the numbers of the range are.
    fn ends(self) -> impl Iterator<Item = (Side, f64)> {
        let ends = [(Side::Above, self.low), (Side::Below, self.high)];
        ends.into_iter().filter(|(_, end)| end.is_finite())
    }

    /// Whether it has two ends.
    pub(crate) fn is_closed_in(self) -> bool {
        self.ends().count() == 2
    }
}

/// How a moment is bounded on one side.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Bound {
    /// Nothing can be known.
    Unknown,
    /// By bets on values with their numbers of trials. The values are powers of the measure, or what they lack of
    /// `top`.
    Bets { values: Vec<(f64, f64)>, top: Option<f64> },
    /// By bets on the squares of two outputs in each trial, of which the first is at most `top`.
    Squares { pairs: Vec<[f64; 2]>, top: f64 },
    /// A root mean square from above, if `E x^4 <= kurtosis (E x^2)^2`: `p = exp(-n (1 - Y/m)^2 / (2 kurtosis))` for
    /// the mean square Y below m. Values that are not negative have a lower tail of their mean that is lighter than
    /// normal with their second moment (Maurer, *Journal of Inequalities in Pure and Applied Mathematics* 4, 2003).
    Kurtosis {
        kurtosis: f64,
        mean_square: f64,
        count: f64,
    },
}

impl Bound {
    /// Tests that the moment of this power is on this side of a limit.
    pub(crate) fn test(&self, side: Side, limit: f64, power: i32) -> OneSided {
        // A root mean square is not negative.
        if limit < 0.0 && power == 2 {
            return OneSided::of(side == Side::Above);
        }
        let m = limit.powi(power);
        match self {
            Self::Unknown => OneSided::NEVER,
            Self::Bets { values, top } => mean_above(values.iter().copied(), top.map_or(m, |top| top - m)),
            Self::Squares { pairs, top } => {
                // A^2 - m B^2 <= top below the limit, m B^2 - A^2 <= m top above it.
                let (top, sign) = match side {
                    Side::Below => (*top, 1.0),
                    Side::Above => (m * top, -1.0),
                };
                let lacks = pairs.iter().map(|[a, b]| (top - sign * (a - m * b), 1.0));
                mean_above(lacks, top)
            }
            Self::Kurtosis {
                kurtosis,
                mean_square,
                count,
            } => {
                let distance = (1.0 - mean_square / m).max(0.0);
                OneSided {
                    p: (-count * distance * distance / (2.0 * kurtosis)).exp(),
                    prospect: Prospect::Root,
                }
            }
        }
    }
}

/// The evidence of trials about a number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Known {
    /// The number itself: nothing is random.
    Exact(f64),
    /// A share of trials.
    Share {
        /// Trials that count.
        count: u64,
        /// All trials.
        total: u64,
    },
    /// A quantile over all trials.
    Quantile {
        /// The probability of the quantile.
        q: f64,
        /// The estimate; infinite if it is that of a trial without a value.
        value: f64,
        /// Its standard error.
        error: f64,
        /// The values of all trials.
        ranked: Ranked,
    },
    /// A mean, a root mean square, or the ratio of two of these.
    Moment {
        value: f64,
        error: f64,
        /// 1 for a mean, 2 for a root mean square.
        power: i32,
        /// The unit in which it is stated: 1, or what it is compared with.
        unit: f64,
        /// How it is certainly below a limit, and how above.
        bounds: Box<[Bound; 2]>,
    },
    /// The ratio of two medians on the same trials.
    Medians {
        value: f64,
        error: f64,
        /// Both values of each trial; infinite where one is lost.
        pairs: Vec<[f64; 2]>,
    },
    /// A log-log slope of medians: `sum_j w_j ln m_j`.
    Slope {
        value: f64,
        error: f64,
        /// The weight w_j of every cell with its values.
        cells: Vec<(f64, Ranked)>,
    },
    /// A ratio of times, whose logarithm is nearly normal. More trials do not make it more precise.
    Time { value: f64, error: f64 },
}

impl Known {
    /// Returns a quantile or a moment over a number without error, such as that of theory.
    pub(crate) fn over(mut self, by: f64) -> Self {
        match &mut self {
            Self::Quantile {
                value, error, ranked, ..
            } => {
                *ranked = ranked.clone().over(by);
                (*value, *error) = (*value / by, *error / by);
            }
            Self::Moment { value, error, unit, .. } => {
                *unit *= by;
                (*value, *error) = (*value / by, *error / by);
            }
            Self::Exact(value) => *value /= by,
            _ => {}
        }
        self
    }

    /// Returns the value with its standard error; NaN if it has none.
    pub(crate) fn shown(&self) -> (f64, f64) {
        match self {
            Self::Exact(value) => (*value, f64::NAN),
            Self::Share { count, total } => {
                let share = *count as f64 / *total as f64;
                (share, (share * (1.0 - share) / *total as f64).sqrt())
            }
            Self::Quantile { value, error, .. }
            | Self::Moment { value, error, .. }
            | Self::Medians { value, error, .. }
            | Self::Slope { value, error, .. }
            | Self::Time { value, error } => (*value, *error),
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

    /// Returns how far inside a range the value lies; negative outside. On a logarithmic scale in a range of positive
    /// numbers with two ends, which a ratio has.
    pub(crate) fn depth(&self, range: Range) -> f64 {
        let logarithmic = range.low > 0.0 && range.high.is_finite();
        let scaled = |x: f64| if logarithmic { x.max(0.0).ln() } else { x };
        let value = scaled(self.shown().0);
        let of_end = |(side, end): (Side, f64)| match side {
            Side::Above => value - scaled(end),
            Side::Below => scaled(end) - value,
        };
        range.ends().map(of_end).fold(f64::INFINITY, f64::min)
    }

    /// Returns how far inside a range the number lies, in approximate standard errors; negative outside.
    pub(crate) fn margin(&self, range: Range) -> f64 {
        let margins = self.tests_inside(range).map(OneSided::margin);
        margins.fold(f64::INFINITY, f64::min)
    }

    /// Tests that the number is on this side of a limit. `closed`: the limit itself is on this side.
    pub(crate) fn test(&self, side: Side, limit: f64, closed: bool) -> OneSided {
        match self {
            Self::Exact(value) => OneSided::of(match side {
                _ if *value == limit => closed,
                Side::Below => *value < limit,
                Side::Above => *value > limit,
            }),
            Self::Share { count, total } => match side {
                Side::Below => OneSided::few(*count, *total, limit),
                Side::Above => OneSided::few(total - count, *total, 1.0 - limit),
            },
            Self::Quantile { q, ranked, .. } => {
                let against = ranked.total() - ranked.for_side(side, limit, closed);
                let chance = match side {
                    Side::Below => 1.0 - q,
                    Side::Above => *q,
                };
                OneSided::few(against, ranked.total(), chance)
            }
            Self::Moment {
                power, unit, bounds, ..
            } => {
                let [below, above] = &**bounds;
                let bound = if side == Side::Below { below } else { above };
                bound.test(side, limit * unit, *power)
            }
            // Medians of measures that are not negative.
            Self::Medians { .. } if limit <= 0.0 => OneSided::of(limit < 0.0 && side == Side::Above),
            Self::Medians { pairs, .. } => match side {
                Side::Below => median_below(pairs.iter().map(|[a, b]| [*a, limit * b])),
                Side::Above => median_below(pairs.iter().map(|[a, b]| [limit * b, *a])),
            },
            Self::Slope { cells, .. } => OneSided {
                p: least_level(|level| {
                    let end = slope_end(cells, side, level);
                    match side {
                        Side::Below => end < limit,
                        Side::Above => end > limit,
                    }
                }),
                prospect: Prospect::Root,
            },
            Self::Time { value, error } => {
                let t = (value.ln() - limit.max(0.0).ln()) * value / error;
                OneSided {
                    p: normal_above(if side == Side::Above { t } else { -t }),
                    prospect: Prospect::Stays,
                }
            }
        }
    }

    /// Returns the tests that the number is inside the range. All must be significant (two one-sided tests if the range
    /// has two ends, Schuirmann 1987).
    fn tests_inside(&self, range: Range) -> impl Iterator<Item = OneSided> {
        let ends = range.ends();
        ends.map(move |(side, end)| self.test(side, end, !range.open))
    }

    /// Returns the tests that the number is outside the range. One must be significant.
    fn tests_outside(&self, range: Range) -> impl Iterator<Item = OneSided> {
        range.ends().map(move |(side, end)| {
            let other = match side {
                Side::Below => Side::Above,
                Side::Above => Side::Below,
            };
            self.test(other, end, range.open)
        })
    }

    /// Returns the p-value of "not inside the range": small if the number is certainly inside.
    pub(crate) fn inside(&self, range: Range) -> f64 {
        self.tests_inside(range).map(|test| test.p).fold(0.0, worst)
    }

    /// Returns the p-value of "inside the range": small if the number is certainly outside. With two ends it is twice
    /// the smaller one.
    pub(crate) fn outside(&self, range: Range) -> f64 {
        let least = self.tests_outside(range).map(|test| test.p);
        (self.ends_at_once(range) * least.fold(1.0, f64::min)).min(1.0)
    }

    /// Returns the correction factor for the tests of which one suffices.
    pub(crate) fn ends_at_once(&self, range: Range) -> f64 {
        if range.is_closed_in() && !matches!(self, Self::Exact(_)) {
            2.0
        } else {
            1.0
        }
    }

    /// Returns the chance that [`Self::inside`] is at most `level` with more trials.
    pub(crate) fn power_inside(&self, range: Range, more: More, level: f64) -> f64 {
        let misses = self.tests_inside(range).map(|test| 1.0 - test.power(more, level));
        (1.0 - misses.sum::<f64>()).max(0.0)
    }

    /// Returns the chance that [`Self::outside`] is at most `level` with more trials.
    pub(crate) fn power_outside(&self, range: Range, more: More, level: f64) -> f64 {
        let of_each = level / self.ends_at_once(range);
        let hits = self.tests_outside(range).map(|test| test.power(more, of_each));
        hits.sum::<f64>().min(1.0)
    }
}

/// Returns the end of a slope's one-sided interval, which is below the slope on the side above and the other way round:
/// each of the J cells with a weight is at one J-th of the level.
pub(crate) fn slope_end(cells: &[(f64, Ranked)], side: Side, level: f64) -> f64 {
    let weighted = || cells.iter().filter(|(weight, _)| *weight != 0.0);
    let each = level / weighted().count() as f64;
    let ends = weighted().map(|(weight, ranked)| {
        let of_median = match side {
            Side::Below if *weight > 0.0 => Side::Below,
            Side::Above if *weight < 0.0 => Side::Below,
            _ => Side::Above,
        };
        weight * ranked.end(0.5, of_median, each).max(0.0).ln()
    });
    // Infinite ends of different signs leave nothing.
    match ends.sum::<f64>() {
        end if end.is_nan() && side == Side::Below => f64::INFINITY,
        end if end.is_nan() => f64::NEG_INFINITY,
        end => end,
    }
}

/// Returns the least level at which something is certain that is certain at every higher one; 1 if it is at none below
/// one half.
fn least_level(is_certain: impl Fn(f64) -> bool) -> f64 {
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

/// Returns the larger of two p-values; 1 if one is undefined.
pub(crate) fn worst(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { 1.0 } else { a.max(b) }
}
