//! Comparison of two methods on the same trials.

use super::double_double::{Dd, powers, product, two_product};
use super::estimate::{Estimate, FEWEST_FOR_SQUARES, not_negative};
use super::exact_sum::{BLOCK, NO_TERMS, Terms, WAYS};
use super::moments::{self, EvenPowers, finite, largest_share};
use super::sketch::{Others, bin_of};
use super::statistics::DOMINANT_SHARE;
use super::{ExactSum, Quantile, Sample, Share, Sketch, Worse};
use crate::real::Real;
use serde::{Deserialize, Serialize};

/// One measure of two methods over the same trials, independent of their order like [`Sample`].
///
/// NaN means "no measure". In ratios and in the share of smaller ones, a trial that only one method has is a loss of
/// the other, and a trial that neither has is a tie. Differences and both RMSEs use the trials where both methods have
/// the measure; the others are counted separately.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Paired {
    both: u64,
    only_first: u64,
    only_second: u64,
    neither: u64,
    smaller: u64,
    ties: u64,
    /// Pairs with a fourth power out of the range of doubles.
    overflowed: u64,
    /// first - second
    difference: Sample,
    /// first / second if it is a number and the two are not equal
    ratio: Sketch,
    first: EvenPowers,
    second: EvenPowers,
    /// `x^2 y^2` in double-double
    product: ExactSum,
}

impl Paired {
    /// Gathers the measures (first, second) of some trials; `None` or NaN if a method has none.
    pub fn from_pairs(pairs: impl IntoIterator<Item = (Option<f64>, Option<f64>)>) -> Self {
        let mut gathering = Gathering::new(false);
        let number = |x: Option<f64>| x.unwrap_or(f64::NAN);
        let pairs = pairs.into_iter();
        pairs.for_each(|(x, y)| gathering.push::<f64>(number(x), number(y)));
        gathering.finish::<f64>()
    }

    /// The same of two columns, NaN where a method has no measure, whose samples are known, by the vector instructions
    /// of R.
    pub fn of_columns<R: Real>(columns: [&[f64]; 2], samples: [&Sample; 2]) -> Self {
        let [first, second] = columns;
        // Without trials that are left out the powers are those of the samples.
        let whole = |sample: &&Sample| sample.undefined() == 0 && sample.overflowed() == 0;
        let are_known = samples.iter().all(whole);
        let mut gathering = Gathering::new(are_known);
        for (x, y) in first.iter().zip(second) {
            gathering.push::<R>(*x, *y);
        }
        let mut paired = gathering.finish::<R>();
        if are_known {
            [paired.first, paired.second] = samples.map(Sample::even_powers);
        }
        paired
    }

    /// The bytes of the comparison in memory.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() - size_of::<Sample>() + self.difference.bytes() + self.ratio.bytes()
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

    /// The distribution of the ratios first / second, without ties.
    pub fn ratio(&self) -> &Sketch {
        &self.ratio
    }

    /// The trials whose ratio is in no bin: ties, and trials in which a method has no measure.
    fn others(&self, worse: Worse) -> Others {
        let (below, above) = match worse {
            Worse::Larger => (self.only_first, self.only_second),
            Worse::Smaller => (self.only_second, self.only_first),
        };
        Others {
            below,
            ones: self.ties + self.neither,
            above,
        }
    }

    /// `R = RMSE(first) / RMSE(second)` over the M pairs.
    ///
    /// By the delta method on `sqrt(X / Y)`, with the mean squares X and Y,
    /// `MCSE = R/2 sqrt( sum (x^2/X - y^2/Y)^2 / (M (M - 1)) )`. It is computed in double-double from the sums of
    /// `x^4`, `x^2 y^2` and `y^4`, and given for [`FEWEST_FOR_SQUARES`] pairs or more. Undefined if a fourth power
    /// overflows or second is all 0.
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
        let mcse = if self.both < FEWEST_FOR_SQUARES {
            f64::NAN
        } else {
            0.5 * ratio * (not_negative(spread.value()) / (m - 1.0)).sqrt()
        };
        Estimate::new(ratio, mcse)
    }

    /// Computes all statistics reported of a comparison.
    pub fn statistics(&self, worse: Worse) -> PairedStatistics {
        let others = self.others(worse);
        let ratios = self.ratio.among(others);
        let ratio = |q: f64| ratios.quantile(q).ranked();
        let trials = self.both + self.only_first + self.only_second + self.neither;
        let dominated =
            |powers: &EvenPowers| !(largest_share(self.both, powers.largest, &powers.squares) <= DOMINANT_SHARE);
        PairedStatistics {
            both: self.both,
            only_first: self.only_first,
            only_second: self.only_second,
            neither: self.neither,
            mean_difference: self.difference.mean(),
            median_difference: self.difference.quantile(0.5, Worse::Larger),
            median_ratio: ratio(0.5),
            ratio_q05: ratio(0.05),
            ratio_q25: ratio(0.25),
            ratio_q75: ratio(0.75),
            ratio_q95: ratio(0.95),
            share_smaller: Share::new(self.smaller + others.below, trials - others.ones),
            ties: others.ones,
            rmse_ratio: self.rmse_ratio(),
            dominated: self.both > 0 && (self.overflowed > 0 || dominated(&self.first) || dominated(&self.second)),
        }
    }
}

/// A comparison while its pairs are gathered.
struct Gathering {
    paired: Paired,
    /// Whether the powers of x and of y come from elsewhere.
    powers_are_known: bool,
    /// Pairs of numbers that wait until there is a block of them.
    x: Terms,
    y: Terms,
    count: usize,
    /// Room for high and low part of `x^2`, `x^4`, `y^2`, `y^4` and `x^2 y^2`.
    terms: Vec<[Terms; 2]>,
    difference: moments::Gathering,
    ratios: Vec<i32>,
}

impl Gathering {
    fn new(powers_are_known: bool) -> Self {
        Self {
            paired: Paired::default(),
            powers_are_known,
            x: NO_TERMS,
            y: NO_TERMS,
            count: 0,
            terms: vec![[NO_TERMS; 2]; 5],
            difference: moments::Gathering::default(),
            ratios: Vec::new(),
        }
    }

    /// Adds a pair; NaN if a method has no measure.
    #[inline(always)]
    fn push<R: Real>(&mut self, x: f64, y: f64) {
        match (x.is_nan(), y.is_nan()) {
            (false, false) => {
                self.x.as_flattened_mut()[self.count] = x;
                self.y.as_flattened_mut()[self.count] = y;
                self.count += 1;
                if self.count == BLOCK {
                    self.add_waiting::<R>();
                }
            }
            (false, true) => self.paired.only_first += 1,
            (true, false) => self.paired.only_second += 1,
            (true, true) => self.paired.neither += 1,
        }
    }

    fn add_waiting<R: Real>(&mut self) {
        let count = std::mem::take(&mut self.count);
        self.paired.both += count as u64;
        // Every bin is written to the next free place, which is kept only if it is that of a ratio.
        let mut next = self.ratios.len();
        self.ratios.resize(next + count, 0);
        let mut differences = [0.0; BLOCK];
        run!(R, || {
            let (x, y) = (self.x.as_flattened_mut(), self.y.as_flattened_mut());
            for ((x, y), difference) in x.iter().zip(&*y).zip(&mut differences).take(count) {
                self.paired.smaller += u64::from(x < y);
                self.paired.ties += u64::from(x == y);
                *difference = x - y;
                let ratio = x / y;
                self.ratios[next] = bin_of(ratio);
                next += usize::from(x != y && !ratio.is_nan());
            }
            x[count..].fill(0.0);
            y[count..].fill(0.0);
            let rows = count.div_ceil(WAYS);
            if self.powers_are_known {
                self.add_products(rows);
            } else {
                self.add_powers(rows);
            }
        });
        self.ratios.truncate(next);
        for difference in &differences[..count] {
            self.difference.push::<R>(*difference);
        }
    }

    /// Adds `x^2 y^2` of so many rows of pairs whose fourth powers are in range; zeros add nothing.
    #[inline(always)]
    fn add_products(&mut self, rows: usize) {
        let [high, low] = &mut self.terms[0];
        for (k, (x, y)) in self.x.iter().zip(&self.y).take(rows).enumerate() {
            for i in 0..WAYS {
                let square = |x: f64| two_product(x, x);
                (high[k][i], low[k][i]) = product(square(x[i]), square(y[i]));
            }
        }
        self.paired.product.add_block(&mut high[..rows]);
        self.paired.product.add_block(&mut low[..rows]);
    }

    /// Adds all powers of so many rows of pairs; zeros add nothing.
    #[inline(always)]
    fn add_powers(&mut self, rows: usize) {
        let (terms, paired) = (&mut self.terms, &mut self.paired);
        let mut largest = [[0.0; WAYS]; 2];
        let mut overflowed = [0; WAYS];
        for (k, (x, y)) in self.x.iter().zip(&self.y).take(rows).enumerate() {
            for i in 0..WAYS {
                let ([x2, _, x4], [y2, _, y4]) = (powers(x[i]), powers(y[i]));
                let cross = product(x2, y2);
                let fits = finite(x4) && finite(y4) && finite(cross);
                overflowed[i] += u64::from(!fits);
                for (j, (high, low)) in [x2, x4, y2, y4, cross].into_iter().enumerate() {
                    terms[j][0][k][i] = if fits { high } else { 0.0 };
                    terms[j][1][k][i] = if fits { low } else { 0.0 };
                }
                for (largest, x) in largest.iter_mut().zip([x[i], y[i]]) {
                    let size = if fits { x.abs() } else { 0.0 };
                    largest[i] = if largest[i] < size { size } else { largest[i] };
                }
            }
        }
        paired.overflowed += overflowed.iter().sum::<u64>();
        let sums = [
            &mut paired.first.squares,
            &mut paired.first.fourths,
            &mut paired.second.squares,
            &mut paired.second.fourths,
            &mut paired.product,
        ];
        for (sum, [high, low]) in sums.into_iter().zip(terms) {
            sum.add_block(&mut high[..rows]);
            sum.add_block(&mut low[..rows]);
        }
        for (powers, of_row) in [&mut paired.first, &mut paired.second].into_iter().zip(largest) {
            powers.largest = of_row.into_iter().fold(powers.largest, f64::max);
        }
    }

    fn finish<R: Real>(mut self) -> Paired {
        self.add_waiting::<R>();
        let mut paired = self.paired;
        paired.difference = self.difference.finish::<R>();
        paired.ratio = Sketch::of_bins(&self.ratios);
        paired
    }
}

/// The statistics reported of two methods on the same trials. Undefined numbers are NaN, in files null.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairedStatistics {
    /// Trials where both methods have the measure: the basis of differences and RMSEs.
    pub both: u64,
    /// Trials where only the first has it.
    pub only_first: u64,
    /// Trials where only the second has it.
    pub only_second: u64,
    /// Trials where neither has it.
    pub neither: u64,
    /// Mean of first - second. Its MCSE comes from the differences themselves, so whatever both methods share cancels.
    pub mean_difference: Estimate,
    /// Median of first - second.
    pub median_difference: Quantile,
    /// Median of first / second over all trials. A trial in which one method has no measure has the ratio 0 or
    /// infinity; one in which neither has has 1. A median among the former is null, with `lost` set.
    pub median_ratio: Quantile,
    /// 5 % quantile of the ratio.
    pub ratio_q05: Quantile,
    /// Lower quartile of the ratio.
    pub ratio_q25: Quantile,
    /// Upper quartile of the ratio.
    pub ratio_q75: Quantile,
    /// 95 % quantile of the ratio.
    pub ratio_q95: Quantile,
    /// Share of trials with first < second, with Wilson's interval; no measure stands at the worse end. Ties are left
    /// out, as in the sign test, and counted in `ties`. For two equal methods this share is undefined, not 0.
    pub share_smaller: Share,
    /// Trials with first = second, and trials in which neither method has the measure.
    pub ties: u64,
    /// RMSE of first over RMSE of second.
    pub rmse_ratio: Estimate,
    /// Whether one trial has more than [`DOMINANT_SHARE`] of either sum of squares, or a fourth power overflowed. Then
    /// do not trust `mean_difference` and `rmse_ratio`.
    pub dominated: bool,
}

impl PairedStatistics {
    /// All trials.
    pub fn trials(&self) -> u64 {
        self.both + self.only_first + self.only_second + self.neither
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::normal::fill_standard_normal;
    use crate::signal::{Purpose, stream};

    fn normals(trial: u64, count: usize) -> Vec<f64> {
        let mut z = vec![0.0; count];
        fill_standard_normal(&mut stream(21, trial, Purpose::NoiseDrive), &mut z);
        z
    }

    fn pairs(count: usize) -> Vec<(Option<f64>, Option<f64>)> {
        let shared = normals(0, count);
        let own = normals(1, count);
        let pair = |(a, b): (&f64, &f64)| (Some(1.5 * a + b), Some(a - b));
        shared.iter().zip(&own).map(pair).collect()
    }

    /// The linearised ratio trial by trial: the sd of x^2/X - y^2/Y over the trials, times R/2 over sqrt M.
    #[test]
    fn the_ratio_of_rmses_by_residuals() {
        let pairs = pairs(1000);
        let squares: Vec<(f64, f64)> = pairs
            .iter()
            .map(|(x, y)| (x.unwrap().powi(2), y.unwrap().powi(2)))
            .collect();
        let m = squares.len() as f64;
        let x = squares.iter().map(|s| s.0).sum::<f64>() / m;
        let y = squares.iter().map(|s| s.1).sum::<f64>() / m;
        let spread: f64 = squares.iter().map(|s| (s.0 / x - s.1 / y).powi(2)).sum();
        let ratio = (x / y).sqrt();
        let expected = ratio / 2.0 * (spread / (m * (m - 1.0))).sqrt();
        let found = Paired::from_pairs(pairs).rmse_ratio();
        assert!((found.value - ratio).abs() < 1e-13);
        assert!((found.mcse / expected - 1.0).abs() < 1e-12);
    }

    /// Equal methods have no difference and no share. For nearly equal ones, y = x (1 + 1e-9 w), the error of the ratio
    /// is about 1e-9 / sqrt M. Sums in doubles (1e-16 of 1) would not give it to three digits.
    #[test]
    fn methods_that_hardly_differ() {
        let x = normals(2, 400);
        let equal = Paired::from_pairs(x.iter().map(|x| (Some(*x), Some(*x)))).statistics(Worse::Larger);
        assert_eq!((equal.ties, equal.share_smaller.total), (400, 0));
        assert!(equal.share_smaller.share.is_nan());
        assert_eq!((equal.rmse_ratio.value, equal.rmse_ratio.mcse), (1.0, 0.0));
        assert_eq!(equal.mean_difference.mcse, 0.0);
        let w = normals(3, 400);
        let near = x.iter().zip(&w).map(|(x, w)| (*x, x * (1.0 + 1e-9 * w)));
        let near: Vec<(f64, f64)> = near.collect();
        let found = Paired::from_pairs(near.iter().map(|(x, y)| (Some(*x), Some(*y)))).rmse_ratio();
        // d(x^2/X - y^2/Y) = -(2/X) (x (y - x) - x^2 mean(x (y - x))/X) to first order
        let mean = x.iter().map(|x| x * x).sum::<f64>() / 400.0;
        let shift = near.iter().map(|(x, y)| x * (y - x)).sum::<f64>() / 400.0;
        let residual = |(x, y): &(f64, f64)| (x * (y - x) - x * x * shift / mean) / mean;
        let squares: f64 = near.iter().map(|pair| residual(pair).powi(2)).sum();
        let expected = (squares / (400.0 * 399.0)).sqrt();
        assert!((found.mcse / expected - 1.0).abs() < 1e-6, "{found:?} {expected:e}");
    }

    #[test]
    fn the_ratio_of_rmses_has_an_error_from_enough_pairs() {
        let pairs = pairs(50);
        for count in 1..=pairs.len() {
            let ratio = Paired::from_pairs(pairs[..count].iter().copied()).rmse_ratio();
            assert!(ratio.value > 0.0);
            assert_eq!((ratio.mcse > 0.0, ratio.mcse.is_nan()), (count >= 40, count < 40));
        }
    }

    /// Ratios: 1/2 (30 trials), exactly 1 (25 equal and 6 in which both fail), 2 (20), 0 (10 in which only the second
    /// fails), infinity (10 in which only the first fails). Of 101 trials the median is the 51st, a tie.
    #[test]
    fn failed_trials_lose_and_ties_are_exactly_one() {
        let some = |x: f64, y: f64| (Some(x), Some(y));
        let mut all = vec![some(1.0, 2.0); 30];
        all.extend([some(0.7, 0.7); 25]);
        all.extend([(None, None); 6]);
        all.extend([some(2.0, 1.0); 20]);
        all.extend([(Some(1.0), None); 10]);
        all.extend([(None, Some(1.0)); 10]);
        let pair = Paired::from_pairs(all);
        let found = pair.statistics(Worse::Larger);
        assert_eq!(found.trials(), 101);
        assert_eq!((found.median_ratio.value, found.median_ratio.mcse), (1.0, 0.0));
        assert!((found.ratio_q25.value - 0.5).abs() < 1e-3);
        assert!((found.ratio_q75.value - 2.0).abs() < 2e-3);
        assert!(found.ratio_q05.lost && found.ratio_q95.lost);
        assert_eq!((found.share_smaller.count, found.share_smaller.total), (40, 70));
        assert_eq!(found.ties, 31);
        // If larger is better, a failed trial counts as the smaller one.
        let fit = pair.statistics(Worse::Smaller).share_smaller;
        assert_eq!((fit.count, fit.total), (40, 70));
    }

    #[test]
    fn missing_figures_are_counted() {
        let pairs = [
            (Some(1.0), Some(2.0)),
            (Some(3.0), None),
            (None, Some(1.0)),
            (Some(f64::NAN), None),
            (Some(2.0), Some(2.0)),
            (Some(0.0), Some(0.0)),
            (Some(6.0), Some(3.0)),
        ];
        let found = Paired::from_pairs(pairs).statistics(Worse::Larger);
        let counts = [found.both, found.only_first, found.only_second, found.neither];
        assert_eq!(counts, [4, 1, 1, 1]);
        assert_eq!(found.ties, 3);
        // 1/2 and 2, one loss of each method; two ties and one trial in which both fail.
        assert_eq!((found.share_smaller.count, found.share_smaller.total), (2, 4));
        // 1/2 and 2.
        assert_eq!(Paired::from_pairs(pairs).ratio().count(), 2);
        assert!((found.median_ratio.value - 1.0).abs() < 1e-3);
        assert_eq!(found.mean_difference.value, 0.5);
        let large = Paired::from_pairs([(Some(1e100), Some(1.0)), (Some(1.0), Some(1.0))]).statistics(Worse::Larger);
        assert!(large.rmse_ratio.value.is_nan() && large.dominated);
        let none = Paired::default().statistics(Worse::Larger);
        assert!(none.rmse_ratio.value.is_nan() && !none.dominated);
    }

    #[test]
    fn order_and_grouping_do_not_matter() {
        let mut pairs = pairs(300);
        pairs[7].0 = None;
        pairs[8].1 = Some(1e90);
        let whole = Paired::from_pairs(pairs.iter().copied());
        let mut merged = Paired::default();
        for block in pairs.rchunks(37) {
            merged.merge(&Paired::from_pairs(block.iter().rev().copied()));
        }
        assert_eq!(whole, merged);
        let bytes = postcard::to_stdvec(&whole).unwrap();
        assert_eq!(bytes, postcard::to_stdvec(&merged).unwrap());
        assert_eq!(postcard::from_bytes::<Paired>(&bytes).unwrap(), whole);
    }
}
