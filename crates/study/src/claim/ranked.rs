//! The values of all trials in order, to the bins of a sketch: all that a claim about a quantile looks at.

use crate::claim::one_sided::Side;
use crate::design::Measure;
use asobench_identification::metric::tails::{binomial_at_least, binomial_at_most};
use asobench_identification::metric::{PairedStatistics, Sketch, Statistics, Worse};

/// Values between two numbers, each of which may be one of them; two equal numbers are the value itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Group {
    pub(crate) lowest: f64,
    pub(crate) highest: f64,
    pub(crate) count: u64,
}

impl Group {
    fn exactly(value: f64, count: u64) -> Self {
        Self {
            lowest: value,
            highest: value,
            count,
        }
    }
}

/// The values of all trials in ascending order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ranked {
    groups: Vec<Group>,
    total: u64,
}

impl Ranked {
    pub(crate) fn new(mut groups: Vec<Group>) -> Self {
        groups.retain(|group| group.count > 0);
        groups.sort_by(|a, b| a.lowest.total_cmp(&b.lowest));
        let total = groups.iter().map(|group| group.count).sum();
        Self { groups, total }
    }

    /// The values of a measure. A trial without it is at the worse end, infinitely far.
    pub(crate) fn of_measure(sketch: &Sketch, statistics: &Statistics, measure: Measure) -> Self {
        let lost = match measure.worse() {
            Worse::Larger => f64::INFINITY,
            Worse::Smaller => f64::NEG_INFINITY,
        };
        let mut groups = of_bins(sketch);
        groups.push(Group::exactly(lost, statistics.undefined));
        Self::new(groups)
    }

    /// The ratios of a measure on the same trials. If only one of the two has it, the ratio is 0 or infinite; if
    /// neither has it, or both are equal, it is 1.
    pub(crate) fn of_ratios(pair: &PairedStatistics, ratios: &Sketch, measure: Measure) -> Self {
        let (zero, infinite) = match measure.worse() {
            Worse::Larger => (pair.only_first, pair.only_second),
            Worse::Smaller => (pair.only_second, pair.only_first),
        };
        let mut groups = of_bins(ratios);
        groups.extend([
            Group::exactly(0.0, zero),
            Group::exactly(1.0, pair.ties),
            Group::exactly(f64::INFINITY, infinite),
        ]);
        Self::new(groups)
    }

    /// All values over a positive number.
    pub(crate) fn over(mut self, by: f64) -> Self {
        for group in &mut self.groups {
            group.lowest /= by;
            group.highest /= by;
        }
        self
    }

    pub(crate) fn total(&self) -> u64 {
        self.total
    }

    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn count(&self, is: impl Fn(&Group) -> bool) -> u64 {
        let groups = self.groups.iter().filter(|group| is(group));
        groups.map(|group| group.count).sum()
    }

    /// Returns how many trials speak for "the q-quantile is on this side of the limit", at least: those below it, or
    /// those not below it. `closed`: the limit itself is on this side.
    pub(crate) fn for_side(&self, side: Side, limit: f64, closed: bool) -> u64 {
        match (side, closed) {
            (Side::Below, false) => self.count(|group| group.highest < limit),
            (Side::Below, true) => self.count(|group| group.highest <= limit),
            (Side::Above, false) => self.count(|group| group.lowest > limit),
            (Side::Above, true) => self.count(|group| group.lowest >= limit),
        }
    }

    /// Returns the group of the value of this rank, from 1.
    fn at(&self, rank: u64) -> Option<&Group> {
        let mut before = 0;
        self.groups.iter().find(|group| {
            before += group.count;
            rank <= before
        })
    }

    /// Returns the end of the one-sided interval of the q-quantile on this side: the lower end for [`Side::Above`],
    /// which is the largest order statistic X_(l) with `P(Bin(n, q) <= l - 1) <= level`, the upper one for
    /// [`Side::Below`], the smallest X_(u) with `P(Bin(n, q) >= u) <= level`. Infinite if no order statistic serves.
    pub(crate) fn end(&self, q: f64, side: Side, level: f64) -> f64 {
        let rank = end_rank(self.total, q, side, level);
        match (side, rank.and_then(|rank| self.at(rank))) {
            (Side::Above, Some(group)) => group.lowest,
            (Side::Below, Some(group)) => group.highest,
            (Side::Above, None) => f64::NEG_INFINITY,
            (Side::Below, None) => f64::INFINITY,
        }
    }

    /// Returns the value of the order statistic at the q-quantile: the middle of its group.
    pub(crate) fn quantile(&self, q: f64) -> f64 {
        let rank = (q * self.total.saturating_sub(1) as f64).round() as u64 + 1;
        let group = self.at(rank);
        group.map_or(f64::NAN, |group| match group.highest - group.lowest {
            width if width > 0.0 => group.lowest + width / 2.0,
            _ => group.lowest,
        })
    }
}

fn of_bins(sketch: &Sketch) -> Vec<Group> {
    let group = |(lowest, highest, count)| Group { lowest, highest, count };
    sketch.bins().map(group).collect()
}

/// Returns the rank, from 1, of the end of an interval: see [`Ranked::end`].
pub(crate) fn end_rank(n: u64, q: f64, side: Side, level: f64) -> Option<u64> {
    let (mut low, mut high) = (0, n + 1);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let is_low = match side {
            Side::Above => binomial_at_most(middle - 1, n, q) <= level,
            Side::Below => binomial_at_least(middle, n, q) > level,
        };
        if is_low {
            low = middle;
        } else {
            high = middle;
        }
    }
    match side {
        Side::Above => (low > 0).then_some(low),
        Side::Below => (high <= n).then_some(high),
    }
}
