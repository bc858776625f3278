//! Two methods on the same trials.

use super::dd::{Dd, powers, product};
use super::estimate::Estimate;
use super::moments::{DOMINANT_SHARE, finite, largest_share};
use super::{ExactSum, Quantile, Sample, Share, Sketch};
use crate::signal::arithmetic::with_fma;
use serde::{Deserialize, Serialize};

/// One figure of two methods over the same trials, gathered independently of order, as [`Sample`] is.
///
/// The rule for trials without figure: differences, ratios and both RMSEs are over the trials where both
/// methods have the figure; the other trials are counted beside them, and where a method fails often the
/// comparison must be read with those counts. NaN is no figure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Paired {
    both: u64,
    only_first: u64,
    only_second: u64,
    neither: u64,
    smaller: u64,
    ties: u64,
    /// Pairs with a fourth power beyond the range of doubles.
    overflowed: u64,
    /// first - second
    difference: Sample,
    /// first / second where it is a number
    ratio: Sketch,
    first: Powers,
    second: Powers,
    /// `x^2 y^2` in double-double
    product: ExactSum,
}

/// Sums of `x^2` and `x^4`, the latter in double-double, and the largest |x|.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Powers {
    squares: ExactSum,
    fourths: ExactSum,
    largest: f64,
}

impl Powers {
    #[inline(always)]
    fn add(&mut self, x: f64, square: (f64, f64), fourth: (f64, f64)) {
        self.largest = self.largest.max(x.abs());
        self.squares.add(square.0);
        self.squares.add(square.1);
        self.fourths.add(fourth.0);
        self.fourths.add(fourth.1);
    }

    fn merge(&mut self, other: &Self) {
        self.squares.merge(&other.squares);
        self.fourths.merge(&other.fourths);
        self.largest = self.largest.max(other.largest);
    }
}

impl Paired {
    /// Gathers the figures (first, second) of some trials, None or NaN where a method has none.
    pub fn of(pairs: impl IntoIterator<Item = (Option<f64>, Option<f64>)>) -> Self {
        let mut paired = Self::default();
        let mut both = Vec::new();
        let defined = |x: Option<f64>| x.filter(|x| !x.is_nan());
        for (x, y) in pairs {
            match (defined(x), defined(y)) {
                (Some(x), Some(y)) => both.push((x, y)),
                (Some(_), None) => paired.only_first += 1,
                (None, Some(_)) => paired.only_second += 1,
                (None, None) => paired.neither += 1,
            }
        }
        paired.both = both.len() as u64;
        with_fma(
            #[inline(always)]
            || {
                for &(x, y) in &both {
                    paired.smaller += u64::from(x < y);
                    paired.ties += u64::from(x == y);
                    paired.add_powers(x, y);
                }
            },
        );
        paired.difference = Sample::of(both.iter().map(|(x, y)| x - y));
        let ratios = both.iter().map(|(x, y)| x / y);
        paired.ratio = Sketch::of(ratios.filter(|ratio| !ratio.is_nan()));
        paired
    }

    #[inline(always)]
    fn add_powers(&mut self, x: f64, y: f64) {
        let ([x2, _, x4], [y2, _, y4]) = (powers(x), powers(y));
        let cross = product(x2, y2);
        if finite(x4) && finite(y4) && finite(cross) {
            self.first.add(x, x2, x4);
            self.second.add(y, y2, y4);
            self.product.add(cross.0);
            self.product.add(cross.1);
        } else {
            self.overflowed += 1;
        }
    }

    /// Adds the trials of another comparison.
    pub fn merge(&mut self, other: &Self) {
        self.both += other.both;
        self.only_first += other.only_first;
        self.only_second += other.only_second;
        self.neither += other.neither;
        self.smaller += other.smaller;
        self.ties += other.ties;
        self.overflowed += other.overflowed;
        self.difference.merge(&other.difference);
        self.ratio.merge(&other.ratio);
        self.first.merge(&other.first);
        self.second.merge(&other.second);
        self.product.merge(&other.product);
    }

    /// Everything of the differences first - second.
    pub fn difference(&self) -> &Sample {
        &self.difference
    }

    /// The distribution of the ratios first / second; 0/0 and the like are left out.
    pub fn ratio(&self) -> &Sketch {
        &self.ratio
    }

    /// `R = RMSE(first) / RMSE(second)` over the M pairs.
    ///
    /// By the delta method on `sqrt(X / Y)`, X and Y the mean squares,
    /// `MCSE = R/2 sqrt( sum (x^2/X - y^2/Y)^2 / (M (M - 1)) )`, which the sums of `x^4`, `x^2 y^2` and `y^4`
    /// give in double-double. Undefined where a fourth power overflows or second is all 0.
    pub fn rmse_ratio(&self) -> Estimate {
        if self.overflowed > 0 || self.both == 0 {
            return Estimate::UNDEFINED;
        }
        let m = self.both as f64;
        let mean = |sum: &ExactSum| Dd::from(sum.value_dd()).over(Dd::from(m));
        let (x2, y2) = (mean(&self.first.squares), mean(&self.second.squares));
        let (x4, y4) = (mean(&self.first.fourths), mean(&self.second.fourths));
        let xy = mean(&self.product);
        let cross = xy.over(x2).over(y2);
        let spread = x4.over(x2).over(x2) - (cross + cross) + y4.over(y2).over(y2);
        let ratio = x2.over(y2).value().sqrt();
        let mcse = 0.5 * ratio * (spread.value().max(0.0) / (m - 1.0)).sqrt();
        Estimate::new(ratio, mcse)
    }

    /// Everything that is reported of a comparison.
    pub fn statistics(&self) -> PairedStatistics {
        let dominated = |powers: &Powers| {
            !(largest_share(self.both, powers.largest, &powers.squares) <= DOMINANT_SHARE)
        };
        PairedStatistics {
            both: self.both,
            only_first: self.only_first,
            only_second: self.only_second,
            neither: self.neither,
            mean_difference: self.difference.mean(),
            median_difference: self.difference.quantile(0.5),
            median_ratio: self.ratio.quantile(0.5),
            ratio_q05: self.ratio.quantile(0.05),
            ratio_q25: self.ratio.quantile(0.25),
            ratio_q75: self.ratio.quantile(0.75),
            ratio_q95: self.ratio.quantile(0.95),
            share_smaller: Share::new(self.smaller, self.both - self.ties),
            ties: self.ties,
            rmse_ratio: self.rmse_ratio(),
            dominated: self.both > 0
                && (self.overflowed > 0 || dominated(&self.first) || dominated(&self.second)),
        }
    }
}

/// What is reported of two methods on the same trials. Undefined numbers are NaN, in files null.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairedStatistics {
    /// Trials where both methods have the figure; all that follows is over these.
    pub both: u64,
    /// Trials where only the first has it.
    pub only_first: u64,
    /// Trials where only the second has it.
    pub only_second: u64,
    /// Trials where neither has it.
    pub neither: u64,
    /// Mean of first - second, MCSE from the differences themselves, so that what both methods share drops
    /// out.
    pub mean_difference: Estimate,
    /// Median of first - second.
    pub median_difference: Quantile,
    /// Median of first / second.
    pub median_ratio: Quantile,
    /// 5 % quantile of the ratio.
    pub ratio_q05: Quantile,
    /// Lower quartile of the ratio.
    pub ratio_q25: Quantile,
    /// Upper quartile of the ratio.
    pub ratio_q75: Quantile,
    /// 95 % quantile of the ratio.
    pub ratio_q95: Quantile,
    /// Share of trials with first < second, Wilson's interval. Ties are left out, as in the sign test, and
    /// counted in `ties`: of two equal methods this share is undefined, not 0.
    pub share_smaller: Share,
    /// Trials with first = second.
    pub ties: u64,
    /// RMSE of first over RMSE of second.
    pub rmse_ratio: Estimate,
    /// Whether one trial has more than [`DOMINANT_SHARE`] of either sum of squares, or a fourth power
    /// overflowed: then `mean_difference` and `rmse_ratio` are not to be trusted.
    pub dominated: bool,
}
