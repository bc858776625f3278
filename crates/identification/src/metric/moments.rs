//! Moments and quantiles of one measure over trials, each with its Monte-Carlo standard error.
//!
//! Mean (bias), standard deviation (empirical standard error) and mean square use the formulas of Morris, White and
//! Crowther (2019), table 6. Where their formula assumes normal numbers, this module uses the fourth moment. Square
//! roots use the delta method.

use super::double_double::{Dd, powers};
use super::estimate::{Estimate, FEWEST_FOR_MEANS, FEWEST_FOR_SQUARES, not_negative};
use super::exact_sum::{BUNDLE, Buckets, Bundle, bundles};
use super::sketch::Others;
use super::statistics::{DOMINANT_SHARE, Quantiles, TRIM, largest_for_tail};
use super::{ExactSum, Quantile, Sketch, Statistics, Worse};
use crate::signal::arithmetic::with_fma;
use serde::{Deserialize, Serialize};

/// A measure over trials, gathered so that the result does not depend on the order of trials, on blocks or on merges.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    count: u64,
    undefined: u64,
    overflowed: u64,
    sum: ExactSum,
    squares: ExactSum,
    /// Sums of cubes; like those of fourth powers, of terms in double-double.
    cubes: ExactSum,
    fourths: ExactSum,
    /// Smallest and largest.
    extremes: Option<(f64, f64)>,
    sketch: Sketch,
}

impl Sample {
    /// Gathers the measure of some trials. NaN means "no measure": the trial is counted and left out.
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sample = Self::default();
        let mut defined = Vec::new();
        for x in values {
            if x.is_nan() {
                sample.undefined += 1;
            } else {
                // -0 becomes 0, so that the extremes are unique.
                defined.push(x + 0.0);
            }
        }
        sample.count = defined.len() as u64;
        with_fma(
            #[inline(always)]
            || {
                let mut buckets = [(); 4].map(|()| Buckets::new());
                for (bundle, numbers) in bundles(&defined) {
                    sample.add_powers(&bundle, numbers, &mut buckets);
                }
                sample.extremes = extremes(&defined);
                for (sum, buckets) in sample.sums().into_iter().zip(&mut buckets) {
                    buckets.empty_into(sum);
                }
            },
        );
        sample.sketch = Sketch::from_values(defined);
        sample
    }

    /// Adds numbers and their second to fourth powers; the zeros that fill up the bundle add nothing.
    #[inline(always)]
    fn add_powers(&mut self, bundle: &Bundle, numbers: &[f64], buckets: &mut [Buckets; 4]) {
        // High and low part of each power.
        let mut terms = [[0.0; BUNDLE]; 6];
        let mut check = [0.0; BUNDLE];
        for i in 0..BUNDLE {
            let [square, cube, fourth] = powers(bundle[i]);
            [terms[0][i], terms[1][i]] = [square.0, square.1];
            [terms[2][i], terms[3][i]] = [cube.0, cube.1];
            [terms[4][i], terms[5][i]] = [fourth.0, fourth.1];
            // 0, or NaN if a power is out of range.
            check[i] = (fourth.0 + fourth.1) * 0.0;
        }
        if check.iter().sum::<f64>() != 0.0 {
            for &x in numbers {
                self.add_far_powers(x, buckets);
            }
            return;
        }
        let [sum, sums @ ..] = self.sums();
        let [first, others @ ..] = buckets;
        first.add(bundle, sum);
        for ((sum, buckets), [high, low]) in sums.into_iter().zip(others).zip(terms.as_chunks().0) {
            buckets.add(high, sum);
            buckets.add(low, sum);
        }
    }

    /// Like `add_powers` for one number whose powers may be out of the range of doubles. Only powers in range
    /// are added.
    #[cold]
    fn add_far_powers(&mut self, x: f64, buckets: &mut [Buckets; 4]) {
        let alone = |x: f64| std::array::from_fn(|i| if i == 0 { x } else { 0.0 });
        let powers = powers(x);
        let [sum, sums @ ..] = self.sums();
        let [first, others @ ..] = buckets;
        for ((sum, buckets), (high, low)) in sums.into_iter().zip(others).zip(powers) {
            if high.is_finite() && low.is_finite() {
                buckets.add(&alone(high), sum);
                buckets.add(&alone(low), sum);
            }
        }
        if x.is_finite() {
            first.add(&alone(x), sum);
        }
        self.overflowed += u64::from(!finite(powers[2]));
    }

    /// The sums of the first to fourth powers.
    fn sums(&mut self) -> [&mut ExactSum; 4] {
        [
            &mut self.sum,
            &mut self.squares,
            &mut self.cubes,
            &mut self.fourths,
        ]
    }

    /// Adds the trials of another sample.
    pub fn merge(&mut self, other: &Self) {
        self.merge_sums(other);
        self.sketch.merge(&other.sketch);
    }

    /// Adds everything of another sample except its sketch.
    fn merge_sums(&mut self, other: &Self) {
        self.count += other.count;
        self.undefined += other.undefined;
        self.overflowed += other.overflowed;
        self.sum.merge(&other.sum);
        self.squares.merge(&other.squares);
        self.cubes.merge(&other.cubes);
        self.fourths.merge(&other.fourths);
        self.extremes = match (self.extremes, other.extremes) {
            (Some((low, high)), Some((a, b))) => Some((low.min(a), high.max(b))),
            (extremes, None) | (None, extremes) => extremes,
        };
    }

    /// The bytes of the sample in memory.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.sketch.bytes()
    }

    /// Trials with a measure.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Trials whose measure is NaN. They enter nothing but the quantiles over all trials.
    pub fn undefined(&self) -> u64 {
        self.undefined
    }

    /// Trials whose value has a fourth power out of the range of doubles. Moments that need it are then undefined.
    pub fn overflowed(&self) -> u64 {
        self.overflowed
    }

    /// The distribution.
    pub fn sketch(&self) -> &Sketch {
        &self.sketch
    }

    /// Largest |x|; 0 without trials.
    pub fn largest(&self) -> f64 {
        self.extremes
            .map_or(0.0, |(low, high)| low.abs().max(high.abs()))
    }

    /// Places the trials without a measure at the worse end of the order.
    fn without_value(&self, worse: Worse) -> Others {
        let mut others = Others::default();
        match worse {
            Worse::Larger => others.above = self.undefined,
            Worse::Smaller => others.below = self.undefined,
        }
        others
    }

    fn quantile_among(&self, q: f64, others: Others) -> Quantile {
        let quantile = self.sketch.among(others).quantile(q).ranked();
        Quantile {
            value: self.clamp(quantile.value),
            ..quantile
        }
    }

    /// The q-quantile over all trials from the sketch, clamped to the smallest and largest value. Trials without a
    /// measure stand at the worse end.
    pub fn quantile(&self, q: f64, worse: Worse) -> Quantile {
        self.quantile_among(q, self.without_value(worse))
    }

    /// The reported quantiles, with the trials without a measure given by `others` (none: over trials with a measure
    /// only).
    fn quantiles(&self, others: Others) -> Quantiles {
        let [q05, q25, q50, q75, q95] = Quantiles::SHARES.map(|q| self.quantile_among(q, others));
        Quantiles {
            q05,
            q25,
            q50,
            q75,
            q95,
        }
    }

    fn clamp(&self, x: f64) -> f64 {
        // Not `f64::clamp`: that panics on limits that only a forged file can hold.
        match self.extremes {
            Some((low, _)) if x < low => low,
            Some((_, high)) if x > high => high,
            _ => x,
        }
    }

    /// The value of the median over all trials; infinite if it falls among trials without a measure.
    pub(super) fn median_value(&self, worse: Worse) -> f64 {
        let median = self
            .sketch
            .among(self.without_value(worse))
            .quantile_value(0.5);
        if median.is_finite() {
            self.clamp(median)
        } else {
            median
        }
    }

    /// The arithmetic mean, MCSE `s / sqrt M` from [`FEWEST_FOR_MEANS`] trials on.
    pub fn mean(&self) -> Estimate {
        let m = self.count as f64;
        if !self.largest().is_finite() {
            return Estimate::UNDEFINED;
        }
        let mcse = if self.count < FEWEST_FOR_MEANS {
            f64::NAN
        } else {
            (self.variance() / m).sqrt()
        };
        Estimate::new(self.sum.value() / m, mcse)
    }

    /// `s^2 = sum (x - mean)^2 / (M - 1)`; NaN if undefined.
    ///
    /// With c the rounded mean, `sum (x - c)^2 = sum x^2 - 2 c sum x + M c^2` is computed in exact arithmetic. The
    /// rounding error of the mean is then corrected by subtracting `(sum x - M c)^2 / M`.
    fn variance(&self) -> f64 {
        let m = self.count as f64;
        let c = self.sum.value() / m;
        if self.count < 2 || !(self.largest() * self.largest()).is_finite() {
            return f64::NAN;
        }
        if self.extremes.is_some_and(|(low, high)| low == high) {
            return 0.0;
        }
        let (high, low) = self.sum.value_dd();
        let mut squares = self.squares.clone();
        let mut rest = self.sum.clone();
        rest.add_product(-m, c);
        if !(c * c * m).is_finite() || !(2.0 * c * high).is_finite() {
            return f64::NAN;
        }
        squares.add_product(-2.0 * c, high);
        squares.add_product(-2.0 * c, low);
        let (square, square_low) = super::double_double::two_product(c, c);
        squares.add_product(m, square);
        squares.add_product(m, square_low);
        let rest = rest.value();
        not_negative(squares.value() - rest * (rest / m)) / (m - 1.0)
    }

    /// The standard deviation s.
    ///
    /// For any distribution, `Var s^2 = (mu_4 - sigma^4 (M - 3) / (M - 1)) / M`. The MCSE is `sqrt(Var s^2) / (2 s)` by
    /// the delta method, with mu_4 estimated by `sum (x - mean)^4 / M`.
    pub fn sd(&self) -> Estimate {
        let m = self.count as f64;
        let variance = self.variance();
        let rest = (m - 3.0) / (m - 1.0) * variance * variance;
        let of_variance = not_negative(self.fourth_central() - rest) / m;
        let mcse = if variance == 0.0 {
            0.0
        } else {
            of_variance.sqrt() / (2.0 * variance.sqrt())
        };
        Estimate::new(variance.sqrt(), self.with_fourths(mcse))
    }

    /// `sum (x - mean)^4 / M` in double-double; the error is about 1e-31 of `mean x^4`.
    fn fourth_central(&self) -> f64 {
        let m = Dd::from(self.count as f64);
        let s1 = Dd::from(self.sum.value_dd());
        let s2 = Dd::from(self.squares.value_dd());
        let s3 = Dd::from(self.cubes.value_dd());
        let s4 = Dd::from(self.fourths.value_dd());
        let c = s1.over(m);
        let times = |factor: f64, x: Dd| Dd::from(factor) * x;
        // s4 - 4 c s3 + 6 c^2 s2 - 3 c^3 s1
        let inner = times(6.0, s2) - c * times(3.0, s1);
        let sum = s4 - c * (times(4.0, s3) - c * inner);
        not_negative(sum.over(m).value())
    }

    /// The skewness `mean (x - mean)^3 / s^3`; NaN if undefined.
    pub fn skewness(&self) -> f64 {
        let m = Dd::from(self.count as f64);
        let s1 = Dd::from(self.sum.value_dd());
        let s2 = Dd::from(self.squares.value_dd());
        let s3 = Dd::from(self.cubes.value_dd());
        let c = s1.over(m);
        // s3 - 3 c s2 + 2 c^2 s1
        let sum = s3 - c * (Dd::from(3.0) * s2 - c * (Dd::from(2.0) * s1));
        let variance = self.variance();
        let skewness = sum.over(m).value() / (variance * variance.sqrt());
        self.with_fourths(if skewness.is_finite() {
            skewness
        } else {
            f64::NAN
        })
    }

    /// The mean square; its MCSE is the standard deviation of `x^2` over `sqrt M`.
    pub fn mse(&self) -> Estimate {
        let m = self.count as f64;
        let largest = self.largest();
        if !(largest * largest).is_finite() {
            return Estimate::UNDEFINED;
        }
        let s2 = Dd::from(self.squares.value_dd());
        let s4 = Dd::from(self.fourths.value_dd());
        let spread = not_negative((s4 - (s2 * s2).over(Dd::from(m))).value());
        let mcse = (spread / (m - 1.0) / m).sqrt();
        Estimate::new(s2.value() / m, self.with_fourths(mcse))
    }

    /// The root mean square, `MCSE = MCSE(MSE) / (2 RMSE)` by the delta method.
    pub fn rmse(&self) -> Estimate {
        let mse = self.mse();
        let rmse = mse.value.sqrt();
        let mcse = if rmse == 0.0 {
            0.0
        } else {
            mse.mcse / (2.0 * rmse)
        };
        Estimate::new(rmse, self.with_fourths(mcse))
    }

    /// Returns an error that needs fourth powers, or NaN if one is missing or there are fewer than
    /// [`FEWEST_FOR_SQUARES`] trials.
    fn with_fourths(&self, mcse: f64) -> f64 {
        if self.overflowed == 0 && self.count >= FEWEST_FOR_SQUARES {
            mcse
        } else {
            f64::NAN
        }
    }

    /// `sqrt(mean x^2)` of several samples together, without standard error.
    pub(super) fn rmse_of_all<'a>(samples: impl Iterator<Item = &'a Self>) -> f64 {
        let (mut count, mut squares, mut largest) = (0, ExactSum::default(), 0.0_f64);
        for sample in samples {
            count += sample.count;
            squares.merge(&sample.squares);
            largest = largest.max(sample.largest());
        }
        if count > 0 && (largest * largest).is_finite() {
            (squares.value() / count as f64).sqrt()
        } else {
            f64::NAN
        }
    }

    /// `max x^2 / sum x^2`; 0 if all values are 0, NaN if there are none or the squares are out of range.
    pub fn largest_share(&self) -> f64 {
        largest_share(self.count, self.largest(), &self.squares)
    }

    /// The mean logarithm of the largest `|x|` over the next: see [`Statistics::tail`].
    fn tail(&self) -> f64 {
        let is_signed = self.extremes.is_some_and(|(low, _)| low < 0.0);
        let center = if is_signed { self.mean().value } else { 0.0 };
        let largest = largest_for_tail(self.count);
        if largest >= self.count {
            return f64::NAN;
        }
        self.sketch.mean_log_excess(center, largest)
    }

    /// Everything that is reported of a measure.
    pub fn statistics(&self, worse: Worse) -> Statistics {
        let (min, max) = self.extremes.unwrap_or((f64::NAN, f64::NAN));
        let largest_share = self.largest_share();
        Statistics {
            count: self.count,
            undefined: self.undefined,
            overflowed: self.overflowed,
            mean: self.mean(),
            sd: self.sd(),
            skewness: self.skewness(),
            mse: self.mse(),
            rmse: self.rmse(),
            trimmed: self.sketch.trimmed_mean(TRIM),
            quantiles: self.quantiles(self.without_value(worse)),
            conditional: (self.undefined > 0).then(|| self.quantiles(Others::default())),
            min,
            max,
            dominated: self.count > 0 && !(largest_share <= DOMINANT_SHARE),
            largest_share,
            tail: self.tail(),
        }
    }
}

pub(super) fn largest_share(count: u64, largest: f64, squares: &ExactSum) -> f64 {
    let (square, sum) = (largest * largest, squares.value());
    if count == 0 || !square.is_finite() || !sum.is_finite() {
        f64::NAN
    } else if sum == 0.0 {
        0.0
    } else {
        square / sum
    }
}

/// Smallest and largest of some numbers; `None` for no numbers.
#[inline(always)]
fn extremes(numbers: &[f64]) -> Option<(f64, f64)> {
    let first = *numbers.first()?;
    let (mut low, mut high) = (first, first);
    for &x in numbers {
        low = if x < low { x } else { low };
        high = if high < x { x } else { high };
    }
    Some((low, high))
}

#[inline(always)]
pub(super) fn finite((high, low): (f64, f64)) -> bool {
    high.is_finite() && low.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::normal::fill_standard_normal;
    use crate::signal::{Purpose, stream};
    use proptest::prelude::*;

    fn normals(seed: u64, count: usize) -> Vec<f64> {
        let mut z = vec![0.0; count];
        fill_standard_normal(&mut stream(seed, 0, Purpose::NoiseDrive), &mut z);
        z
    }

    fn near(found: f64, expected: f64, tolerance: f64) {
        assert!(
            (found - expected).abs() <= tolerance * expected.abs(),
            "{found:e} {expected:e}"
        );
    }

    /// 1 ... M: mean (M + 1)/2, variance M (M + 1)/12, mean fourth central moment
    /// (M^2 - 1)(3 M^2 - 7)/240, mean square (M + 1)(2 M + 1)/6, sum of fourth powers
    /// M (M + 1)(2 M + 1)(3 M^2 + 3 M - 1)/30.
    #[test]
    fn consecutive_integers() {
        let count = 1000;
        let m = f64::from(count);
        let found = Sample::from_values((1..=count).map(f64::from)).statistics(Worse::Larger);
        let eps = 8.0 * f64::EPSILON;
        assert_eq!(found.mean.value, 500.5);
        let variance = m * (m + 1.0) / 12.0;
        near(found.mean.mcse, (variance / m).sqrt(), eps);
        near(found.sd.value, variance.sqrt(), eps);
        let fourth = (m * m - 1.0) * (3.0 * m * m - 7.0) / 240.0;
        let of_variance = (fourth - variance * variance * (m - 3.0) / (m - 1.0)) / m;
        near(
            found.sd.mcse,
            (of_variance / (4.0 * variance)).sqrt(),
            2.0 * eps,
        );
        let mse = (m + 1.0) * (2.0 * m + 1.0) / 6.0;
        near(found.mse.value, mse, eps);
        let fourths = (m + 1.0) * (2.0 * m + 1.0) * (3.0 * m * m + 3.0 * m - 1.0) / 30.0;
        let mcse = ((fourths - mse * mse) / (m - 1.0)).sqrt();
        near(found.mse.mcse, mcse, 2.0 * eps);
        near(found.rmse.value, mse.sqrt(), eps);
        near(found.rmse.mcse, mcse / (2.0 * mse.sqrt()), 2.0 * eps);
        assert_eq!((found.min, found.max, found.count), (1.0, m, 1000));
        near(found.largest_share, 1.0 / mse * m, eps);
        assert!(!found.dominated);
        // Integers are the lower edges of their bins, so the sketch overestimates each.
        near(found.trimmed.value, 500.5, crate::metric::SKETCH_ERROR);
        near(found.q25.value, 250.75, 2.0 * crate::metric::SKETCH_ERROR);
    }

    /// With an offset of 2^40, x^4 needs 160 bits more than the spread. sd and its error must not change: x + 2^40 is
    /// exact for these x.
    #[test]
    fn offsets_do_not_cancel() {
        let plain = Sample::from_values((0..500).map(|i| f64::from((i * i) % 97)));
        for offset in [2.0_f64.powi(20), 2.0_f64.powi(40)] {
            let moved = Sample::from_values((0..500).map(|i| f64::from((i * i) % 97) + offset));
            let (a, b) = (plain.sd(), moved.sd());
            near(b.value, a.value, 1e-15);
            near(moved.mean().mcse, plain.mean().mcse, 1e-15);
            assert_eq!(moved.mean().value, plain.mean().value + offset);
            // mu_4 has an error of 2^-104 of mean x^4: (offset / sd)^4 2^-104.
            let condition = (offset / a.value).powi(4) * 2.0_f64.powi(-100);
            if condition < 0.01 {
                near(b.mcse, a.mcse, condition.max(1e-14));
            }
        }
        let constant = Sample::from_values([0.1; 50]).statistics(Worse::Larger);
        assert_eq!((constant.sd.value, constant.sd.mcse), (0.0, 0.0));
        assert_eq!((constant.mean.value, constant.mean.mcse), (0.1, 0.0));
        assert_eq!(constant.q50.value, 0.1);
    }

    /// Theory, at a million values: statistics within 4.5 standard errors, the standard errors within 2 %. Uniform:
    /// mean 1/2, variance 1/12, mu_4 = 1/80; normal: error of sd sigma / sqrt(2 M); exponential: mean and sd 1, mu_4 =
    /// 9, E x^4 = 24, median ln 2.
    #[test]
    fn known_distributions() {
        let count = 1 << 20;
        let m = f64::from(count);
        let z = normals(5, 2 * count as usize);
        let exponential = z.as_chunks::<2>().0.iter();
        let exponential: Vec<f64> = exponential.map(|[a, b]| 0.5 * (a * a + b * b)).collect();
        let uniform = exponential.iter().map(|x| (-x).exp());
        // mean, sd, its error, mean square, its error, median, its error
        let laws = [
            (
                Sample::from_values(uniform),
                [0.5, (1.0_f64 / 12.0).sqrt(), 1.0 / 3.0, 0.5],
                [1.0 / 80.0, 1.0 / 5.0 - 1.0 / 9.0, 0.5],
            ),
            (
                Sample::from_values(z[..count as usize].iter().copied()),
                [0.0, 1.0, 1.0, 0.0],
                [3.0, 2.0, (0.5 * std::f64::consts::PI).sqrt()],
            ),
            (
                Sample::from_values(exponential.iter().copied()),
                [1.0, 1.0, 2.0, std::f64::consts::LN_2],
                [9.0, 20.0, 1.0],
            ),
        ];
        for (sample, [mean, sd, mse, median], [fourth, of_square, of_median]) in laws {
            let found = sample.statistics(Worse::Larger);
            let root = m.sqrt();
            let of_sd = (fourth - sd.powi(4)).sqrt() / (2.0 * sd) / root;
            let of_mse = of_square.sqrt() / root;
            for (estimate, truth, error) in [
                (found.mean, mean, sd / root),
                (found.sd, sd, of_sd),
                (found.mse, mse, of_mse),
                (found.rmse, mse.sqrt(), of_mse / (2.0 * mse.sqrt())),
            ] {
                assert!((estimate.value - truth).abs() < 4.5 * error, "{found:?}");
                near(estimate.mcse, error, 0.02);
            }
            assert!((found.q50.value - median).abs() < 4.5 * of_median / root + 2e-4);
            let floor = median * crate::metric::SKETCH_ERROR / super::super::Z;
            near(found.q50.mcse, (of_median / root).max(floor), 0.1);
            assert!(!found.dominated && found.overflowed == 0);
        }
    }

    /// Of 101 trials, those with the values 0 ... 60 have a measure. The median is the 51st of all, 50; the upper
    /// quartile, the 76th, has none. If larger is better, the 40 others are the smallest: the lower quartile, the
    /// 26th, has none, and the median is the 11th of the others, 10.
    #[test]
    fn quantiles_are_over_all_trials_with_failed_ones_at_the_worse_end() {
        let values = (0..101).map(|i| if i <= 60 { f64::from(i) } else { f64::NAN });
        let sample = Sample::from_values(values);
        let found = sample.statistics(Worse::Larger);
        assert!((found.q50.value - 50.0).abs() < 0.03, "{found:?}");
        assert!((found.q25.value - 25.0).abs() < 0.02);
        assert!(found.q75.lost && found.q75.value.is_nan() && found.q75.mcse.is_nan());
        // Its interval, 51 -+ 9.9 ranks, ends at rank 60.9, just below the last measure.
        assert!(found.q50.mcse > 0.0 && !found.q50.lost);
        let conditional = found.conditional.unwrap();
        assert!((conditional.q50.value - 30.0).abs() < 0.02);
        assert!((conditional.q75.value - 45.0).abs() < 0.03);
        let better = sample.statistics(Worse::Smaller);
        assert!(better.q25.lost && (better.q50.value - 10.0).abs() < 0.01);
        let text = serde_json::to_string(&found).unwrap();
        assert!(
            text.contains(r#""q75":{"value":null,"mcse":null,"lost":true}"#),
            "{text}"
        );
        let read: Statistics = serde_json::from_str(&text).unwrap();
        assert!(read.q75.lost);
        assert!(
            Sample::from_values([1.0, 2.0])
                .statistics(Worse::Larger)
                .conditional
                .is_none()
        );
    }

    #[test]
    fn powers_that_overflow_are_counted() {
        let fourth = Sample::from_values([1e80, 1.0, -1.0].repeat(20)).statistics(Worse::Larger);
        assert_eq!(fourth.overflowed, 20);
        assert!(fourth.mean.mcse.is_finite() && fourth.rmse.value.is_finite());
        assert!(fourth.sd.value.is_finite() && fourth.sd.mcse.is_nan());
        assert!(fourth.mse.mcse.is_nan() && fourth.rmse.mcse.is_nan());
        let square = Sample::from_values([1e200, 1.0, -1.0]).statistics(Worse::Larger);
        assert!(square.mean.value.is_finite() && square.mean.mcse.is_nan());
        assert!(square.sd.value.is_nan() && square.mse.value.is_nan() && square.dominated);
        // Each power is in range, but their sum is not.
        let sum = Sample::from_values([1e77, -1e77, 9e76].repeat(50)).statistics(Worse::Larger);
        assert!(sum.overflowed == 0 && sum.mse.value.is_finite() && sum.sd.value.is_finite());
        assert!(sum.mse.mcse.is_nan() && sum.rmse.mcse.is_nan() && sum.sd.mcse.is_nan());
        let infinite = Sample::from_values([f64::INFINITY, 1.0, 2.0]).statistics(Worse::Larger);
        assert!(infinite.mean.value.is_nan() && infinite.max == f64::INFINITY);
        assert!(infinite.overflowed == 1 && infinite.q05.value.is_finite());
        let undefined = Sample::from_values([f64::NAN, 1.0]).statistics(Worse::Larger);
        assert_eq!((undefined.count, undefined.undefined), (1, 1));
        assert!(undefined.mean.value == 1.0 && undefined.mean.mcse.is_nan());
        let empty = Sample::default().statistics(Worse::Larger);
        assert!(empty.mean.value.is_nan() && empty.min.is_nan() && !empty.dominated);
    }

    /// Errors begin at [`FEWEST_FOR_MEANS`] and [`FEWEST_FOR_SQUARES`] trials, and for quantiles when their interval
    /// exists.
    #[test]
    fn errors_begin_with_enough_trials() {
        let z = normals(9, 100);
        let errors = |count: usize| {
            let found = Sample::from_values(z[..count].iter().copied()).statistics(Worse::Larger);
            let moments = [found.mean, found.trimmed, found.sd, found.mse, found.rmse]
                .map(|estimate| estimate.mcse);
            let quantiles = [found.q50, found.q25, found.q05].map(|estimate| estimate.mcse);
            [&moments[..], &quantiles[..]].concat()
        };
        let from = [7, 7, 40, 40, 40, 6, 16, 92];
        for count in 1..=z.len() {
            for (error, from) in errors(count).into_iter().zip(from) {
                assert_eq!(error > 0.0, count >= from, "{count} {from} {error}");
                assert_eq!(error.is_nan(), count < from, "{count} {from} {error}");
            }
        }
    }

    #[test]
    fn undefined_numbers_are_null_in_json_and_come_back() {
        let found = Sample::from_values([f64::NAN, 1.0]).statistics(Worse::Larger);
        let text = serde_json::to_string(&found).unwrap();
        assert!(text.contains(r#""mean":{"value":1.0,"mcse":null}"#));
        let read: Statistics = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
        assert!(read.mean.mcse.is_nan());
        let full = Sample::from_values(normals(1, 100)).statistics(Worse::Larger);
        let text = serde_json::to_string(&full).unwrap();
        assert_eq!(serde_json::from_str::<Statistics>(&text).unwrap(), full);
    }

    fn value() -> impl Strategy<Value = f64> {
        prop_oneof![
            4 => -2.0..2.0,
            1 => any::<u64>().prop_map(f64::from_bits),
            1 => Just(0.0),
            1 => Just(-0.0),
        ]
    }

    proptest! {
        #[test]
        fn order_and_grouping_do_not_matter(
            values in prop::collection::vec(value(), 0..60)
                .prop_flat_map(|values| (Just(values.clone()), Just(values).prop_shuffle())),
            cuts in (0..60_usize, 0..60_usize),
        ) {
            let (values, shuffled) = values;
            let whole = Sample::from_values(values.iter().copied());
            prop_assert!(whole.count() + whole.undefined() == values.len() as u64);
            let ends = [cuts.0.min(cuts.1), cuts.0.max(cuts.1)];
            let [a, b] = ends.map(|end| end.min(values.len()));
            let mut merged = Sample::from_values(shuffled[b..].iter().copied());
            let mut rest = Sample::from_values(shuffled[..a].iter().copied());
            rest.merge(&Sample::from_values(shuffled[a..b].iter().copied()));
            merged.merge(&rest);
            let bytes = postcard::to_stdvec(&whole).unwrap();
            prop_assert_eq!(&whole, &merged);
            prop_assert_eq!(&bytes, &postcard::to_stdvec(&merged).unwrap());
            let read: Sample = postcard::from_bytes(&bytes).unwrap();
            prop_assert_eq!(&read, &merged);
            prop_assert_eq!(
                format!("{:?}", read.statistics(Worse::Larger)),
                format!("{:?}", merged.statistics(Worse::Larger))
            );
        }
    }
}
