//! The distribution of values in fixed bins: independent of order, mergeable, small.

use super::estimate::{Estimate, FEWEST_FOR_MEANS, Z, not_negative};
use super::quantile::standard_error;
use super::{Quantile, Share};
use serde::{Deserialize, Serialize, Serializer};

/// Largest relative error of a normal number that is replaced by the middle of its bin: every octave has 1024 bins of
/// equal width. Subnormal numbers have bins of width 2^-1032.
pub const SKETCH_ERROR: f64 = 1.0 / 2048.0;

/// Bits of the mantissa that vary within a bin.
const OPEN_BITS: u32 = 42;
/// The bin of plus infinity; the bin of minus infinity is its negative.
const INFINITE: i32 = (0x7ff << 10) + 1;

/// Counts of values in fixed bins. A bin is given by the sign, the exponent and the first ten bits of the mantissa.
///
/// Zero and the infinities have bins of their own; -0 counts as 0. Counts are integers, so a sketch does not depend on
/// the order of values or merges. The j-th of the c values of a bin [low, high) is taken to be
/// `low + (j + 1/2) / c (high - low)`, j = 0 ... c-1.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(try_from = "Canonical")]
pub struct Sketch {
    /// In ascending order of value.
    bins: Vec<Bin>,
}

/// A bin and its count, above zero in a sketch, in one word that ascends with the bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Bin(u64);

impl Bin {
    /// The lowest bits are the count.
    const BITS: u32 = 42;
    const MOST: u64 = (1 << Self::BITS) - 1;

    fn new(number: i32, count: u64) -> Self {
        Self(((number + INFINITE) as u64) << Self::BITS | count)
    }

    fn number(self) -> i32 {
        (self.0 >> Self::BITS) as i32 - INFINITE
    }

    fn count(self) -> u64 {
        self.0 & Self::MOST
    }
}

/// The approximate number of bins that a sketch of this many values has. Values whose spread is a third of their size
/// take about 2000 bins; the tails add a few with every value.
pub fn expected_bins(values: f64) -> f64 {
    const USUAL: f64 = 2000.0;
    USUAL * (1.0 - (-values / USUAL).exp())
}

impl Sketch {
    /// The bytes of its bins in memory.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.bins[..])
    }
}

/// Returns the bin of a value; bins ascend with values.
#[inline(always)]
pub(super) fn bin_of(x: f64) -> i32 {
    let size = (x.abs().to_bits() >> OPEN_BITS) as i32 + 1;
    if x == 0.0 {
        0
    } else if x < 0.0 {
        -size
    } else {
        size
    }
}

/// Returns the lower and upper edge of a bin.
fn edges(bin: i32) -> (f64, f64) {
    if bin < 0 {
        let (low, high) = edges(-bin);
        return (-high, -low);
    }
    let edge = |index: i32| f64::from_bits((index as u64) << OPEN_BITS);
    match bin {
        0 => (0.0, 0.0),
        INFINITE => (f64::INFINITY, f64::INFINITY),
        _ => (edge(bin - 1), edge(bin).min(f64::MAX)),
    }
}

/// The value at the fraction `part` of a bin's width.
fn inside(bin: i32, part: f64) -> f64 {
    let (low, high) = edges(bin);
    between(low, high, part)
}

/// `low + part (high - low)` for part in [0, 1], infinite ends included.
fn between(low: f64, high: f64, part: f64) -> f64 {
    if part == 0.0 || low == high || low == f64::NEG_INFINITY {
        low
    } else {
        part.mul_add(high - low, low)
    }
}

/// An order statistic to the resolution of the sketch.
#[derive(Clone, Copy, Debug)]
struct OrderStatistic {
    value: f64,
    /// Half the width of its bin.
    half_width: f64,
}

impl OrderStatistic {
    /// Returns the value at a place in a bin.
    fn inside(bin: Bin, place: u64) -> Self {
        let (low, high) = edges(bin.number());
        Self {
            value: between(low, high, (place as f64 + 0.5) / bin.count() as f64),
            half_width: if low == high { 0.0 } else { (high - low) / 2.0 },
        }
    }
}

impl Sketch {
    /// Builds the sketch of some values.
    ///
    /// # Panics
    /// In debug builds, if a value is NaN.
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Self {
        let bin = |x: f64| {
            debug_assert!(!x.is_nan());
            bin_of(x)
        };
        let bins: Vec<i32> = values.into_iter().map(bin).collect();
        Self::of_bins(&bins)
    }

    /// The sketch of the values whose bins these are.
    pub(super) fn of_bins(bins: &[i32]) -> Self {
        let spans = with_fma!(|| Spans::of(bins));
        // If there are many values, those of a sign lie in neighbouring bins, and counting is faster than sorting.
        if spans.width() <= 8 * bins.len() {
            return spans.count(bins);
        }
        let mut bins = bins.to_vec();
        bins.sort_unstable();
        let runs = bins.chunk_by(|a, b| a == b);
        Self {
            bins: runs.map(|run| Bin::new(run[0], run.len() as u64)).collect(),
        }
    }

    /// Adds the counts of another sketch. A bin counts up to 2^42 - 1 values, a thousand times as many as a cell may have
    /// trials.
    pub fn merge(&mut self, other: &Self) {
        let (left, right) = (&self.bins, &other.bins);
        if right.is_empty() {
            return;
        }
        let mut bins = vec![Bin::default(); left.len() + right.len()];
        let (mut i, mut j, mut next) = (0, 0, 0);
        // Without a branch: which of the two bins comes first cannot be predicted.
        while i < left.len() && j < right.len() {
            let (a, b) = (left[i], right[j]);
            let (key, other_key) = (a.0 >> Bin::BITS, b.0 >> Bin::BITS);
            let (is_left, is_right) = (key <= other_key, other_key <= key);
            let count = a.count() * u64::from(is_left) + b.count() * u64::from(is_right);
            bins[next] = Bin(key.min(other_key) << Bin::BITS | count.min(Bin::MOST));
            i += usize::from(is_left);
            j += usize::from(is_right);
            next += 1;
        }
        for rest in [&left[i..], &right[j..]] {
            bins[next..next + rest.len()].copy_from_slice(rest);
            next += rest.len();
        }
        bins.truncate(next);
        bins.shrink_to_fit();
        self.bins = bins;
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.bins.iter().map(|bin| bin.count()).sum()
    }

    /// Every bin that is not empty, in ascending order: the lowest and the highest number that it can hold, and the
    /// count.
    pub fn bins(&self) -> impl Iterator<Item = (f64, f64, u64)> {
        self.bins.iter().map(|bin| {
            let number = bin.number();
            let (low, high) = match (edges(number), number.abs()) {
                (edges, 0 | INFINITE) => edges,
                // 0 has a bin of its own, and any other edge belongs to the bin farther from 0.
                ((0.0, high), _) => (0.0_f64.next_up(), high.next_down()),
                ((low, 0.0), _) => (low.next_up(), (0.0_f64).next_down()),
                ((low, high), _) if number > 0 && high < f64::MAX => (low, high.next_down()),
                ((low, high), _) if number < 0 && low > f64::MIN => (low.next_up(), high),
                (edges, _) => edges,
            };
            (low, high, bin.count())
        })
    }

    /// Returns the order statistic of a rank in 0 ... count-1.
    fn order_statistic(&self, rank: u64) -> Option<OrderStatistic> {
        let mut before = 0;
        for bin in &self.bins {
            if rank < before + bin.count() {
                return Some(OrderStatistic::inside(*bin, rank - before));
            }
            before += bin.count();
        }
        None
    }

    /// Combines the values with others that are in no bin.
    pub(super) fn among(&self, others: Others) -> Among<'_> {
        let mut end = 0;
        let until = |bin: &Bin| {
            end += bin.count();
            end
        };
        let ends: Vec<u64> = self.bins.iter().map(until).collect();
        let below_one = self.bins.partition_point(|bin| bin.number() < bin_of(1.0));
        Among {
            before_one: below_one.checked_sub(1).map_or(0, |last| ends[last]),
            bins: &self.bins,
            ends,
            others,
        }
    }

    /// The q-quantile of the values: type 7 of Hyndman and Fan (1996), on the order statistics to the sketch's
    /// resolution. NaN for an empty sketch. The MCSE is that of [`Quantile::mcse`], but at least half the width of the
    /// value's bin over 1.96.
    ///
    /// # Panics
    /// In debug builds, if q is not in [0, 1].
    pub fn quantile(&self, q: f64) -> Quantile {
        self.among(Others::default()).quantile(q)
    }

    /// The mean of M values without the `g = floor(gamma M)` smallest and largest. Undefined for an empty sketch.
    ///
    /// Its standard error is Tukey and McLaughlin's (1963): `s_w / ((1 - 2 g / M) sqrt M)`. Here s_w is the standard
    /// deviation (divisor M - 1) of the winsorised sample, in which each value left out is replaced by the nearest one
    /// kept. The error follows Student's law with M - 2 g - 1 degrees of freedom, so it is given if at least
    /// [`FEWEST_FOR_MEANS`] values are kept.
    ///
    /// # Panics
    /// In debug builds, if gamma is not in [0, 1/2).
    pub fn trimmed_mean(&self, gamma: f64) -> Estimate {
        debug_assert!((0.0..0.5).contains(&gamma));
        let count = self.count();
        let cut = (gamma * count as f64).floor() as u64;
        let kept = self.kept(cut, count - cut);
        let (Some(first), Some(last)) = (kept.first(), kept.last()) else {
            return Estimate::UNDEFINED;
        };
        let (m, g) = (count as f64, cut as f64);
        let inner = m - 2.0 * g;
        let mean = kept.iter().map(|(x, n)| x * n).sum::<f64>() / inner;
        let low = self.order_statistic(cut).map_or(first.0, |at| at.value);
        let high = self.order_statistic(count - cut - 1).map_or(last.0, |at| at.value);
        // Sums over the winsorised sample, about the trimmed mean.
        let all = || kept.iter().copied().chain([(low, g), (high, g)]);
        let sum: f64 = all().map(|(x, n)| (x - mean) * n).sum();
        let squares: f64 = all().map(|(x, n)| (x - mean) * (x - mean) * n).sum();
        let variance = (squares - sum * sum / m) / (m - 1.0);
        let mcse = if count - 2 * cut < FEWEST_FOR_MEANS {
            f64::NAN
        } else {
            not_negative(variance).sqrt() * m.sqrt() / inner
        };
        Estimate::new(mean, mcse)
    }

    /// The order statistics of the ranks in `from..to`, by bin: mean and number of those in the bin.
    fn kept(&self, from: u64, to: u64) -> Vec<(f64, f64)> {
        let mut before = 0;
        let mut kept = Vec::with_capacity(self.bins.len());
        for bin in &self.bins {
            let count = bin.count();
            let first = from.clamp(before, before + count) - before;
            let last = to.clamp(before, before + count) - before;
            if first < last {
                let part = (first + last) as f64 / 2.0 / count as f64;
                kept.push((inside(bin.number(), part), (last - first) as f64));
            }
            before += count;
        }
        kept
    }

    /// The share of values below x. Of the values in x's own bin, those count that the sketch places below x. So the
    /// share is exact if x begins a bin, that is for x >= 0 with at most 11 significant bits.
    pub fn share_below(&self, x: f64) -> Share {
        let own = bin_of(x);
        let (low, high) = edges(own);
        let part = if low < high { (x - low) / (high - low) } else { 0.0 };
        let below = self.bins.iter().map(|bin| match bin.number().cmp(&own) {
            std::cmp::Ordering::Less => bin.count(),
            std::cmp::Ordering::Equal => (part * bin.count() as f64).round() as u64,
            std::cmp::Ordering::Greater => 0,
        });
        Share::new(below.sum(), self.count())
    }
}

/// The bins from the lowest to the highest of each sign; none if the first is above the last.
struct Spans {
    negative: (i32, i32),
    positive: (i32, i32),
}

impl Spans {
    #[inline(always)]
    fn of(bins: &[i32]) -> Self {
        let mut spans = Self {
            negative: (0, i32::MIN),
            positive: (i32::MAX, 0),
        };
        for &bin in bins {
            let negative = if bin < 0 { bin } else { i32::MIN };
            let positive = if bin > 0 { bin } else { i32::MAX };
            spans.negative.0 = spans.negative.0.min(bin);
            spans.negative.1 = spans.negative.1.max(negative);
            spans.positive.0 = spans.positive.0.min(positive);
            spans.positive.1 = spans.positive.1.max(bin);
        }
        spans
    }

    /// The numbers of bins of each sign.
    fn widths(&self) -> [usize; 2] {
        [self.negative, self.positive].map(|(first, last)| (i64::from(last) - i64::from(first) + 1).max(0) as usize)
    }

    fn width(&self) -> usize {
        self.widths().iter().sum()
    }

    /// The sketch of the values in bins within the spans.
    fn count(&self, bins: &[i32]) -> Sketch {
        let [below, above] = self.widths();
        // Zeros have a place between the signs.
        let mut counts = vec![0_u32; below + 1 + above];
        for &bin in bins {
            let at = match bin.signum() {
                -1 => bin - self.negative.0,
                0 => below as i32,
                _ => bin - self.positive.0 + 1 + below as i32,
            };
            counts[at as usize] += 1;
        }
        let filled = counts.iter().filter(|count| **count > 0).count();
        let numbers = (self.negative.0..).take(below).chain([0]);
        let numbers = numbers.chain((self.positive.0..).take(above));
        // Without a branch: every bin is written to the next free place, which is kept only if the bin is not empty.
        let mut bins = vec![Bin::default(); filled + 1];
        let mut next = 0;
        for (bin, count) in numbers.zip(counts) {
            bins[next] = Bin::new(bin, u64::from(count));
            next += usize::from(count > 0);
        }
        bins.truncate(filled);
        Sketch { bins }
    }
}

/// Numbers of values that are in no bin of a sketch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Others {
    /// Values below all others.
    pub(super) below: u64,
    /// Values that are exactly 1.
    pub(super) ones: u64,
    /// Values above all others.
    pub(super) above: u64,
}

/// The values of a sketch together with others, in order.
#[derive(Clone, Debug)]
pub(super) struct Among<'a> {
    bins: &'a [Bin],
    /// The values up to the end of each bin.
    ends: Vec<u64>,
    /// The values in bins below that of 1.
    before_one: u64,
    others: Others,
}

impl Among<'_> {
    /// The values in bins.
    fn in_bins(&self) -> u64 {
        self.ends.last().copied().unwrap_or(0)
    }

    fn count(&self) -> u64 {
        let Others { below, ones, above } = self.others;
        below + ones + above + self.in_bins()
    }

    /// Returns the order statistic of a rank in 0 ... count-1; it is infinite among those below and above.
    fn order_statistic(&self, rank: u64) -> Option<OrderStatistic> {
        let exactly = |value: f64| OrderStatistic { value, half_width: 0.0 };
        let Others { below, ones, above } = self.others;
        let Some(rank) = rank.checked_sub(below) else {
            return Some(exactly(f64::NEG_INFINITY));
        };
        let before_one = self.before_one;
        if (before_one..before_one + ones).contains(&rank) {
            return Some(exactly(1.0));
        }
        let rank = if rank < before_one { rank } else { rank - ones };
        if rank >= self.in_bins() {
            return (rank < self.in_bins() + above).then(|| exactly(f64::INFINITY));
        }
        let at = self.ends.partition_point(|end| *end <= rank);
        let bin = self.bins[at];
        Some(OrderStatistic::inside(bin, rank - (self.ends[at] - bin.count())))
    }

    /// The value at a fractional position between the order statistics 0 ... count-1, and the half width of the wider
    /// of the two bins. `None` if there are no values.
    fn at(&self, count: u64, position: f64) -> Option<OrderStatistic> {
        let position = position.clamp(0.0, count.saturating_sub(1) as f64);
        let rank = position.floor() as u64;
        let low = self.order_statistic(rank)?;
        let high = self.order_statistic(rank + 1).unwrap_or(low);
        Some(OrderStatistic {
            value: between(low.value, high.value, position.fract()),
            half_width: low.half_width.max(high.half_width),
        })
    }

    /// The q-quantile: type 7 of Hyndman and Fan (1996), on the order statistics to the sketch's resolution. NaN if
    /// there are no values.
    ///
    /// The MCSE is that of [`Quantile::mcse`], but at least half the width of the value's bin over 1.96. If the values
    /// are denser than the bins, the bin limits the accuracy.
    ///
    /// # Panics
    /// In debug builds, if q is not in [0, 1].
    pub(super) fn quantile(&self, q: f64) -> Quantile {
        debug_assert!((0.0..=1.0).contains(&q));
        let count = self.count();
        let Some(at) = self.at(count, q * (count as f64 - 1.0)) else {
            return Quantile::UNDEFINED;
        };
        let value = |position| self.at(count, position).map_or(f64::NAN, |at| at.value);
        let (mcse, least) = (standard_error(count, q, value), at.half_width / Z);
        Quantile {
            value: at.value,
            // NaN, a difference of infinities, is kept.
            mcse: if mcse < least { least } else { mcse },
            lost: false,
        }
    }

    /// The value of [`Self::quantile`] without its error.
    pub(super) fn quantile_value(&self, q: f64) -> f64 {
        let count = self.count();
        self.at(count, q * (count as f64 - 1.0)).map_or(f64::NAN, |at| at.value)
    }
}

/// A sketch in its stored form: for each bin the gap to the bin before (for the first: to the lowest possible bin) and
/// the count.
#[derive(Deserialize)]
struct Canonical(Vec<(u32, u64)>);

impl Serialize for Sketch {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut previous = -INFINITE;
        serializer.collect_seq(self.bins.iter().map(|bin| {
            let gap = bin.number().abs_diff(previous);
            previous = bin.number();
            (gap, bin.count())
        }))
    }
}

/// A stored sketch that is not in the canonical form.
#[derive(Debug, thiserror::Error)]
#[error("not a sketch: bins are empty, out of range or out of order, or there are too many values")]
struct NotCanonical;

impl TryFrom<Canonical> for Sketch {
    type Error = NotCanonical;

    fn try_from(stored: Canonical) -> Result<Self, NotCanonical> {
        let mut bin = -INFINITE;
        let mut bins = Vec::with_capacity(stored.0.len());
        for (index, (gap, count)) in stored.0.into_iter().enumerate() {
            bin = bin.checked_add_unsigned(gap).ok_or(NotCanonical)?;
            if bin > INFINITE || !(1..=Bin::MOST).contains(&count) || (gap == 0 && index > 0) {
                return Err(NotCanonical);
            }
            bins.push(Bin::new(bin, count));
        }
        Ok(Self { bins })
    }
}

#[cfg(test)]
mod tests;
