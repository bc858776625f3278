//! What is known of one number from trials, and how certain that makes it that the number is within
//! limits.

use crate::metric::Z;
use crate::metric::tails::{
    binomial_at_most, normal_above, normal_point, student_above, student_point,
};

/// The numbers that meet a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    /// Minus infinity where there is no lower limit.
    pub(super) low: f64,
    /// Infinity where there is no upper one.
    pub(super) high: f64,
    /// Whether the ends themselves are outside.
    pub(super) open: bool,
}

impl Range {
    /// The ends that there are.
    fn ends(self) -> [Option<f64>; 2] {
        [self.low, self.high].map(|end| end.is_finite().then_some(end))
    }
}

/// How many degrees of freedom a standard error has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Freedom {
    now: f64,
    /// The power of the number of trials with which they grow; None where more trials change
    /// nothing at all.
    grows: Option<f64>,
}

impl Freedom {
    /// Of an error to which more trials do nothing, as that of a time.
    pub(super) const FIXED: Self = Self {
        now: f64::INFINITY,
        grows: None,
    };

    /// So many, whatever the number of trials.
    pub(super) const fn constant(now: f64) -> Self {
        Self {
            now,
            grows: Some(0.0),
        }
    }

    /// Of a mean, or of what is made of means.
    pub(super) fn of_mean(trials: u64) -> Self {
        Self {
            now: trials.saturating_sub(1).max(1) as f64,
            grows: Some(1.0),
        }
    }

    /// Of the q-quantile of n trials. Its standard error is a multiple of the distance W between
    /// two order statistics, k = 2 * 1.96 sqrt(n q (1 - q)) ranks apart. Near a quantile W is a sum
    /// of k spacings that are nearly independent and exponential, so its relative variance is 1/k
    /// and that of W^2 is 4/k. That of a mean square with nu degrees of freedom is 2/nu; hence nu =
    /// k/2 = 1.96 sqrt(n q (1 - q)). Half of that is taken: far in the tails, where many cells are
    /// judged, the changing density between the two ranks counts too, and a test finds the level
    /// exceeded without it.
    pub(super) fn of_quantile(q: f64, trials: u64) -> Self {
        Self {
            now: (0.5 * Z * (trials as f64 * q * (1.0 - q)).sqrt()).max(1.0),
            grows: Some(0.5),
        }
    }
}

/// What trials say of a number.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Known {
    /// Everything.
    Exact(f64),
    /// An estimate with a standard error above 0.
    Estimate {
        /// The estimate.
        value: f64,
        /// Its standard error.
        error: f64,
        /// How well the error is known.
        freedom: Freedom,
        /// Whether it is the logarithm that scatters as a normal number does: ratios of positive
        /// numbers.
        logarithmic: bool,
    },
    /// A share of trials.
    Count {
        /// Trials that count.
        count: u64,
        /// Of so many.
        total: u64,
    },
    /// A quantile without a usable standard error: lost trials or equal values are around it. What
    /// is left is how many of the trials are on either side of a limit.
    Ranks {
        /// The quantile as far as it is known: infinite, of either sign, where it is lost.
        value: f64,
        /// Which quantile.
        q: f64,
        /// Trials.
        total: u64,
        /// (x, count): where x is below a limit at least `count` trials are, where it is not at
        /// most `count`.
        points: Vec<(f64, u64)>,
    },
}

/// On which side of a limit a number is said to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Below,
    Above,
}

/// The test of "certainly on this side of the limit".
#[derive(Clone, Copy, Debug)]
enum OneSided {
    /// It needs none.
    Sure(bool),
    /// t standard errors on the right side.
    Student(f64, Freedom),
    /// So few of so many trials where each would be one with this chance, at the limit.
    Few(u64, u64, f64),
}

impl OneSided {
    fn p(self) -> f64 {
        match self {
            Self::Sure(is) => f64::from(u8::from(!is)),
            Self::Student(t, freedom) => student_above(t, freedom.now),
            Self::Few(count, total, chance) => binomial_at_most(count, total, chance),
        }
    }

    /// The chance of p <= `level` with `factor` times the trials, where the truth is what it now
    /// seems to be.
    fn power(self, factor: f64, level: f64) -> f64 {
        match self {
            Self::Sure(is) => f64::from(u8::from(is)),
            Self::Student(t, Freedom { now, grows: None }) => beyond(t, now, level),
            Self::Student(
                t,
                Freedom {
                    now,
                    grows: Some(power),
                },
            ) => beyond(t * factor.sqrt(), now * factor.powf(power), level),
            Self::Few(count, total, chance) => {
                let trials = (total as f64 * factor).round() as u64;
                few(trials, count as f64 / total as f64, chance, level)
            }
        }
    }
}

/// P(T' > t) of the noncentral t with this distance and nu degrees of freedom at the point t of
/// Student's law with that level: the normal approximation of Johnson and Kotz (Abramowitz and
/// Stegun 26.7.10).
fn beyond(distance: f64, nu: f64, level: f64) -> f64 {
    let t = student_point(normal_point(level), nu);
    let bias = 1.0 - 1.0 / (4.0 * nu);
    normal_above((t * bias - distance) / (1.0 + t * t / (2.0 * nu)).sqrt())
}

/// P(P(K <= k) <= level) where k and K are numbers of successes in so many trials, of chance
/// `share` and `chance`.
fn few(trials: u64, share: f64, chance: f64, level: f64) -> f64 {
    /// From this variance on the normal law will do.
    const LARGE: f64 = 1000.0;
    let n = trials as f64;
    let deviation = |p: f64| (n * p * (1.0 - p)).sqrt();
    if deviation(chance) * deviation(chance) > LARGE && deviation(share) > 0.0 {
        let critical = n * chance - normal_point(level) * deviation(chance);
        return normal_above((n * share - critical) / deviation(share));
    }
    // The first count that is not few enough, by bisection.
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

impl Known {
    /// The value with its standard error; NaN where it has none.
    pub(super) fn shown(&self) -> (f64, f64) {
        match self {
            Self::Exact(value) | Self::Ranks { value, .. } => (*value, f64::NAN),
            Self::Estimate { value, error, .. } => (*value, *error),
            Self::Count { count, total } => {
                let share = *count as f64 / *total as f64;
                (share, (share * (1.0 - share) / *total as f64).sqrt())
            }
        }
    }

    /// Whether the value itself is within the range, certain or not.
    pub(super) fn seems_inside(&self, range: Range) -> bool {
        let value = self.shown().0;
        if range.open {
            range.low < value && value < range.high
        } else {
            range.low <= value && value <= range.high
        }
    }

    /// How far an estimate is above a limit, in standard errors, on the scale on which it is near
    /// normal.
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
            // The delta method: the logarithm has the relative error. No such number is below 0.
            (value.ln() - limit.max(0.0).ln()) * value / error
        } else {
            (value - limit) / error
        };
        Some((distance, *freedom))
    }

    /// How far inside a range the value itself is, on the scale on which it is compared; below 0
    /// outside.
    pub(super) fn depth(&self, range: Range) -> f64 {
        let logarithmic = matches!(
            self,
            Self::Estimate {
                logarithmic: true,
                ..
            }
        );
        let scaled = |x: f64| if logarithmic { x.max(0.0).ln() } else { x };
        let value = scaled(self.shown().0);
        let [low, high] = range.ends().map(|end| end.map(scaled));
        let low = low.map_or(f64::INFINITY, |low| value - low);
        let high = high.map_or(f64::INFINITY, |high| high - value);
        low.min(high)
    }

    /// How far inside a range the number is, about in standard errors; below 0 outside.
    pub(super) fn margin(&self, range: Range) -> f64 {
        let of_test = |test: OneSided| match test {
            OneSided::Sure(is) => {
                if is {
                    f64::INFINITY
                } else {
                    f64::NEG_INFINITY
                }
            }
            OneSided::Student(t, _) => t,
            OneSided::Few(count, total, chance) => {
                let (n, k) = (total as f64, count as f64);
                (n * chance - k) / (n * chance * (1.0 - chance)).sqrt().max(1e-300)
            }
        };
        self.tests_inside(range)
            .map(of_test)
            .fold(f64::INFINITY, f64::min)
    }

    /// The test of being on one side of a limit, the limit itself included where `closed`.
    fn one_sided(&self, side: Side, limit: f64, closed: bool) -> OneSided {
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

    /// The tests that the number is inside the range: all must be certain (two one-sided tests of a
    /// range with two ends, Schuirmann 1987).
    fn tests_inside(&self, range: Range) -> impl Iterator<Item = OneSided> {
        let [low, high] = range.ends();
        let low = low.map(|low| self.one_sided(Side::Above, low, !range.open));
        let high = high.map(|high| self.one_sided(Side::Below, high, !range.open));
        low.into_iter().chain(high)
    }

    /// The tests that it is outside: one must be certain.
    fn tests_outside(&self, range: Range) -> impl Iterator<Item = OneSided> {
        let [low, high] = range.ends();
        let low = low.map(|low| self.one_sided(Side::Below, low, range.open));
        let high = high.map(|high| self.one_sided(Side::Above, high, range.open));
        low.into_iter().chain(high)
    }

    /// The width of a range with two ends in standard errors of an estimate, and the degrees of
    /// freedom.
    fn width(&self, range: Range) -> Option<(f64, Freedom)> {
        let [Some(low), Some(high)] = range.ends() else {
            return None;
        };
        let ((to_low, freedom), (to_high, _)) = (self.distance(low)?, self.distance(high)?);
        Some((to_low - to_high, freedom))
    }

    /// The p-value of "not inside the range": small where the number certainly is.
    pub(super) fn inside(&self, range: Range) -> f64 {
        self.tests_inside(range).map(OneSided::p).fold(0.0, worst)
    }

    /// The p-value of "inside the range": small where the number certainly is not.
    ///
    /// Of an estimate at distance t from the nearer end of a range with two ends that are w apart,
    /// both in standard errors, it is P(T > t) + P(T > t + w), exact for a number at either end:
    /// near one-sided where the range is wide, the two-sided test where it is a point. Of counts it
    /// is twice the smaller tail.
    pub(super) fn outside(&self, range: Range) -> f64 {
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

    /// The factor by which two tests, of which one is enough, are corrected.
    fn ends_at_once(&self) -> f64 {
        if matches!(self, Self::Exact(_)) {
            1.0
        } else {
            2.0
        }
    }

    /// The chance that [`Self::inside`] is at most a level with `factor` times the trials.
    pub(super) fn power_inside(&self, range: Range, factor: f64, level: f64) -> f64 {
        let misses = self
            .tests_inside(range)
            .map(|test| 1.0 - test.power(factor, level));
        (1.0 - misses.sum::<f64>()).max(0.0)
    }

    /// The chance that [`Self::outside`] is.
    pub(super) fn power_outside(&self, range: Range, factor: f64, level: f64) -> f64 {
        let of_each = match (self.width(range), range.ends()) {
            (Some((width, Freedom { now, grows })), _) => {
                let growth = grows.map_or(1.0, |_| factor);
                let nu = now * growth.powf(grows.unwrap_or(0.0));
                level_of_an_end(width * growth.sqrt(), nu, level)
            }
            (None, [Some(_), Some(_)]) => level / self.ends_at_once(),
            _ => level,
        };
        let hits = self
            .tests_outside(range)
            .map(|test| test.power(factor, of_each));
        hits.sum::<f64>().min(1.0)
    }
}

/// P(T > t) for the t with P(T > t) + P(T > t + width) = level.
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

/// The larger of two p-values; 1 where one is undefined.
pub(super) fn worst(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        1.0
    } else {
        a.max(b)
    }
}
