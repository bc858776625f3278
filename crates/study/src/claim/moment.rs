//! Tests of moments that hold where tails are heavy: means, root mean squares, their ratios and slopes, biases.
//!
//! A standard error knows only the trials that were seen. With M trials, an event that befalls a trial with chance
//! `c / M`, `c = -ln level`, is missed by all of them with a chance of `level`. So a bound on a moment allows for c
//! further trials like the largest one (Bahadur and Savage 1956: no test of a mean keeps its level without such an
//! assumption). Let w be the share of the largest trial in the sum that the moment rests on. Then c further ones raise
//! the logarithm of this sum by `ln(1 + c w)`, with variance `c w^2` (of a Poisson number of them).
//!
//! The allowance means something only where the sum has a finite mean, and where its largest trials are enough to show
//! it. So three things are demanded: [`FEWEST_FOR_MOMENTS`] trials, no trial with more than a tenth of the sum
//! ([`DOMINANT_SHARE`]), and a tail index that is above [`TAIL_MARGIN`] times the power with 90 % confidence
//! ([`Statistics::least_tail_index`]). Elsewhere the moment stays undecided.
//!
//! Unseen trials only raise a sum of numbers that are not negative, so "above" a limit needs neither.

use crate::claim::freedom::Freedom;
use crate::claim::known::Known;
use crate::claim::known::{Allowance, Line, Side, SidedTest};
use crate::design::measure::Measure;
use asobench_identification::metric::{DOMINANT_SHARE, Estimate, Statistics};

/// Fewest trials from which an upper bound on a moment is given. One in a hundred trials may be an outlier: with fewer
/// trials, studies with less than five of them, which say little of their size, are more frequent than 2.5 %.
pub const FEWEST_FOR_MOMENTS: u64 = 1000;

/// The least tail index, over the power that is summed, with which the sum is taken to have a mean that trials show.
const TAIL_MARGIN: f64 = 1.25;

/// A sum over trials on which a moment rests: of the powers of a measure, or of squares about the mean.
pub(crate) struct Sum {
    /// The share of the largest trial.
    share: f64,
    /// By what factor the number of trials must grow before bounds are given: 1 if they are, infinite if the tail is
    /// too heavy.
    from: f64,
    /// Why they are not.
    why: Option<String>,
}

impl Sum {
    /// The sum of `|x|` (power 1) or `x^2` (power 2).
    pub(crate) fn of_powers(statistics: &Statistics, power: u8, measure: Measure) -> Self {
        let largest = statistics.min.abs().max(statistics.max.abs());
        let share = if power == 1 {
            largest / (statistics.mean.value * statistics.count as f64)
        } else {
            statistics.largest_share
        };
        Self::new(statistics, f64::from(power), share, &measure.to_string())
    }

    /// The sum of squares about the mean.
    pub(crate) fn about_mean(statistics: &Statistics, name: &str) -> Self {
        let mean = statistics.mean.value;
        let largest = (statistics.min - mean)
            .abs()
            .max((statistics.max - mean).abs());
        let scale = statistics.sd.value * (statistics.count.saturating_sub(1) as f64).sqrt();
        Self::new(statistics, 2.0, (largest / scale).powi(2), name)
    }

    pub(crate) fn new(statistics: &Statistics, power: f64, share: f64, name: &str) -> Self {
        let count = statistics.count;
        let heavy = !(statistics.least_tail_index() > TAIL_MARGIN * power);
        let few = FEWEST_FOR_MOMENTS as f64 / count.max(1) as f64;
        let (from, why) = if count < FEWEST_FOR_MOMENTS {
            let why = format!(
                "moments of {name} are bounded from {FEWEST_FOR_MOMENTS} trials on, since fewer may miss outliers"
            );
            (few.max(share / DOMINANT_SHARE), Some(why))
        } else if !(share <= DOMINANT_SHARE) {
            let why = format!(
                "a single trial makes up more than a tenth of the sum for {name}; quantiles can be judged"
            );
            (share / DOMINANT_SHARE, Some(why))
        } else if heavy {
            let why = format!(
                "the largest values of {name} do not show that its tail is light enough for a moment; quantiles can be \
                judged"
            );
            (f64::INFINITY, Some(why))
        } else {
            (1.0, None)
        };
        Self {
            share,
            from: if from.is_nan() { f64::INFINITY } else { from },
            why,
        }
    }
}

/// What keeps a moment open, if anything does.
pub(crate) type Caution = Option<String>;

/// The mean (power 1) or root mean square (power 2) of a measure that is never negative.
pub(crate) fn not_negative(
    estimate: Estimate,
    count: u64,
    power: u8,
    sum: Sum,
) -> (Known, Caution) {
    let weight = 1.0 / f64::from(power);
    let below = SidedTest {
        line: Line::Logarithm,
        from: sum.from,
        allowance: Allowance {
            logs: vec![(weight, sum.share)],
            linear: 0.0,
            square: (weight * sum.share).powi(2),
        },
    };
    let above = SidedTest {
        line: if power == 1 {
            Line::Value
        } else {
            Line::Square
        },
        ..SidedTest::PLAIN
    };
    let freedom = Freedom::of_mean(count);
    (Known::moment(estimate, freedom, below, above), sum.why)
}

/// The mean of numbers of either sign; `sum` is about the mean, and `sd` their standard deviation.
pub(crate) fn signed(estimate: Estimate, sd: f64, count: u64, sum: Sum) -> (Known, Caution) {
    let unit = (sum.share / count as f64).sqrt() * sd;
    let test = SidedTest {
        line: Line::Value,
        from: sum.from,
        allowance: Allowance {
            logs: Vec::new(),
            linear: unit,
            square: unit * unit,
        },
    };
    let freedom = Freedom::of_mean(count);
    (
        Known::moment(estimate, freedom, test.clone(), test),
        sum.why,
    )
}

/// A bias over its standard deviation; `sum` is about the mean.
pub(crate) fn bias(estimate: Estimate, count: u64, sum: Sum) -> (Known, Caution) {
    let (share, half) = (sum.share, 0.5 * estimate.value.abs());
    let of_mean = (share / count as f64).sqrt();
    let test = SidedTest {
        line: Line::Value,
        from: sum.from,
        allowance: Allowance {
            logs: vec![(half, share)],
            linear: of_mean,
            square: of_mean * of_mean + (half * share).powi(2),
        },
    };
    let freedom = Freedom::of_mean(count);
    (
        Known::moment(estimate, freedom, test.clone(), test),
        sum.why,
    )
}

/// The ratio of two root mean squares on the same trials, with the sums of squares of both.
pub(crate) fn ratio(estimate: Estimate, count: u64, [first, second]: [Sum; 2]) -> (Known, Caution) {
    let square = 0.25 * (first.share.powi(2) + second.share.powi(2));
    let test = |sum: &Sum| SidedTest {
        line: Line::Logarithm,
        from: sum.from,
        allowance: Allowance {
            logs: vec![(0.5, sum.share)],
            linear: 0.0,
            square,
        },
    };
    let (below, above) = (test(&first), test(&second));
    let freedom = Freedom::of_mean(count);
    (
        Known::moment(estimate, freedom, below, above),
        first.why.or(second.why),
    )
}

/// A log-log slope `sum_j a_j ln rms_j`, with the weight a_j and the sum of squares of every cell.
pub(crate) fn slope(
    estimate: Estimate,
    freedom: Freedom,
    cells: &[(f64, Sum)],
) -> (Known, Caution) {
    let square = cells
        .iter()
        .map(|(a, sum)| (0.5 * a * sum.share).powi(2))
        .sum();
    let test = |side: Side| {
        let rises = |a: f64| {
            if side == Side::Below {
                a > 0.0
            } else {
                a < 0.0
            }
        };
        let cells = || cells.iter().filter(|(a, _)| rises(*a));
        SidedTest {
            line: Line::Value,
            from: cells().map(|(_, sum)| sum.from).fold(1.0, f64::max),
            allowance: Allowance {
                logs: cells().map(|(a, sum)| (0.5 * a.abs(), sum.share)).collect(),
                linear: 0.0,
                square,
            },
        }
    };
    let why = cells.iter().find_map(|(_, sum)| sum.why.clone());
    (
        Known::moment(estimate, freedom, test(Side::Below), test(Side::Above)),
        why,
    )
}
