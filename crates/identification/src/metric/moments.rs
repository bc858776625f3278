//! Moments and quantiles of one measure over trials, each with its Monte-Carlo standard error.
//!
//! Mean (bias), standard deviation (empirical standard error) and mean square use the formulas of Morris, White and
//! Crowther (2019), table 6. Where their formula assumes normal numbers, this module uses the fourth moment. Square
//! roots use the delta method.

use super::double_double::{Dd, powers};
use super::estimate::{Estimate, FEWEST_FOR_MEANS, FEWEST_FOR_SQUARES, not_negative};
use super::exact_sum::{BLOCK, NO_TERMS, Terms, WAYS};
use super::sketch::{Among, Others, bin_of};
use super::statistics::{DOMINANT_SHARE, Quantiles, TRIM};
use super::{ExactSum, Quantile, Sketch, Statistics, Worse};
use crate::real::Real;
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

/// Sums of `x^2` and `x^4`, the latter in double-double, and the largest |x|.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct EvenPowers {
    pub(super) squares: ExactSum,
    pub(super) fourths: ExactSum,
    pub(super) largest: f64,
}

impl EvenPowers {
    pub(super) fn merge(&mut self, other: &Self) {
        self.squares.merge(&other.squares);
        self.fourths.merge(&other.fourths);
        self.largest = self.largest.max(other.largest);
    }
}

impl Sample {
    /// Gathers the measure of some trials. NaN means "no measure": the trial is counted and left out.
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Self {
        Self::gathered::<f64>(values)
    }

    /// Does the same by the vector instructions of R.
    pub fn gathered<R: Real>(values: impl IntoIterator<Item = f64>) -> Self {
        let mut gathering = Gathering::default();
        values.into_iter().for_each(|x| gathering.push::<R>(x));
        gathering.finish::<R>()
    }

    /// Adds the first to fourth powers of some numbers; zeros add nothing.
    #[inline(always)]
    fn add_powers(&mut self, numbers: &mut [[f64; WAYS]], terms: &mut [Terms; 6]) {
        let mut check = [0.0; WAYS];
        // High and low part of each power.
        for (k, numbers) in numbers.iter().enumerate() {
            for i in 0..WAYS {
                let [square, cube, fourth] = powers(numbers[i]);
                [terms[0][k][i], terms[1][k][i]] = [square.0, square.1];
                [terms[2][k][i], terms[3][k][i]] = [cube.0, cube.1];
                [terms[4][k][i], terms[5][k][i]] = [fourth.0, fourth.1];
                // 0, or NaN if a power is out of range.
                check[i] += (fourth.0 + fourth.1) * 0.0;
            }
        }
        if check.iter().sum::<f64>() != 0.0 {
            let numbers = numbers.as_flattened().iter();
            numbers.for_each(|x| self.add_far_powers(*x));
            return;
        }
        let count = numbers.len();
        self.sum.add_block(numbers);
        let sums = [&mut self.squares, &mut self.cubes, &mut self.fourths];
        for (sum, [high, low]) in sums.into_iter().zip(terms.as_chunks_mut().0) {
            sum.add_block(&mut high[..count]);
            sum.add_block(&mut low[..count]);
        }
    }

    /// Like `add_powers` for one number whose powers may be out of the range of doubles. Only powers in range
    /// are added.
    #[cold]
    fn add_far_powers(&mut self, x: f64) {
        let powers = powers(x);
        let sums = [&mut self.squares, &mut self.cubes, &mut self.fourths];
        for (sum, (high, low)) in sums.into_iter().zip(powers) {
            if high.is_finite() && low.is_finite() {
                sum.add(high);
                sum.add(low);
            }
        }
        if x.is_finite() {
            self.sum.add(x);
        }
        self.overflowed += u64::from(!finite(powers[2]));
    }

    /// The sums that a comparison needs.
    pub(super) fn even_powers(&self) -> EvenPowers {
        EvenPowers {
            squares: self.squares.clone(),
            fourths: self.fourths.clone(),
            largest: self.largest(),
        }
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
        self.extremes.map_or(0.0, |(low, high)| low.abs().max(high.abs()))
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

    fn quantile_among(&self, q: f64, all: &Among<'_>) -> Quantile {
        let quantile = all.quantile(q).ranked();
        Quantile {
            value: self.clamp(quantile.value),
            ..quantile
        }
    }

    /// The q-quantile over all trials from the sketch, clamped to the smallest and largest value. Trials without a
    /// measure stand at the worse end.
    pub fn quantile(&self, q: f64, worse: Worse) -> Quantile {
        self.quantile_among(q, &self.sketch.among(self.without_value(worse)))
    }

    /// The reported quantiles, with the trials without a measure given by `others` (none: over trials with a measure
    /// only).
    fn quantiles(&self, others: Others) -> Quantiles {
        let all = self.sketch.among(others);
        Quantiles::of(|q| self.quantile_among(q, &all))
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
        let median = self.sketch.among(self.without_value(worse)).quantile_value(0.5);
        if median.is_finite() { self.clamp(median) } else { median }
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
        self.with_fourths(if skewness.is_finite() { skewness } else { f64::NAN })
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
        let mcse = if rmse == 0.0 { 0.0 } else { mse.mcse / (2.0 * rmse) };
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

/// A sample while its values are gathered.
pub(super) struct Gathering {
    sample: Sample,
    /// Values that wait until there is a block of them.
    waiting: Terms,
    count: usize,
    /// Room for their powers.
    powers: Box<[Terms; 6]>,
    lowest: [f64; WAYS],
    highest: [f64; WAYS],
    bins: Vec<i32>,
}

impl Default for Gathering {
    fn default() -> Self {
        Self {
            sample: Sample::default(),
            waiting: NO_TERMS,
            count: 0,
            powers: Box::new([NO_TERMS; 6]),
            lowest: [f64::INFINITY; WAYS],
            highest: [f64::NEG_INFINITY; WAYS],
            bins: Vec::new(),
        }
    }
}

impl Gathering {
    /// Adds a value or NaN.
    #[inline(always)]
    pub(super) fn push<R: Real>(&mut self, x: f64) {
        if x.is_nan() {
            self.sample.undefined += 1;
            return;
        }
        // -0 becomes 0, so that the extremes are unique.
        self.waiting.as_flattened_mut()[self.count] = x + 0.0;
        self.count += 1;
        if self.count == BLOCK {
            self.add_waiting::<R>();
        }
    }

    fn add_waiting<R: Real>(&mut self) {
        let count = std::mem::take(&mut self.count);
        let numbers = self.waiting.as_flattened_mut();
        self.sample.count += count as u64;
        let before = self.bins.len();
        self.bins.resize(before + count, 0);
        let bins = &mut self.bins[before..];
        // The padding of the last numbers side by side must not be an extreme.
        let whole = count.next_multiple_of(WAYS);
        if count < whole {
            let first = numbers[0];
            numbers[count..whole].fill(first);
        }
        let numbers = &mut self.waiting[..whole / WAYS];
        let (lowest, highest) = (&mut self.lowest, &mut self.highest);
        run!(R, || {
            for (bin, x) in bins.iter_mut().zip(numbers.as_flattened()) {
                *bin = bin_of(*x);
            }
            for numbers in &*numbers {
                for i in 0..WAYS {
                    let x = numbers[i];
                    lowest[i] = if x < lowest[i] { x } else { lowest[i] };
                    highest[i] = if highest[i] < x { x } else { highest[i] };
                }
            }
            numbers.as_flattened_mut()[count..].fill(0.0);
            self.sample.add_powers(numbers, &mut self.powers);
        });
    }

    /// Returns the sample of all values.
    pub(super) fn finish<R: Real>(mut self) -> Sample {
        self.add_waiting::<R>();
        let mut sample = self.sample;
        let low = self.lowest.into_iter().fold(f64::INFINITY, f64::min);
        let high = self.highest.into_iter().fold(f64::NEG_INFINITY, f64::max);
        sample.extremes = (sample.count > 0).then_some((low, high));
        sample.sketch = Sketch::of_bins(&self.bins);
        sample
    }
}

#[inline(always)]
pub(super) fn finite((high, low): (f64, f64)) -> bool {
    high.is_finite() && low.is_finite()
}

#[cfg(test)]
mod tests;
