//! One figure over trials: moments and quantiles, each with its Monte-Carlo standard error.
//!
//! The formulas are those of Morris, White and Crowther (2019), table 6, where they have one: mean (bias),
//! standard deviation (empirical standard error), mean square. What they state for normal figures is
//! stated here by the fourth moment, and square roots by the delta method.

use super::dd::{Dd, powers};
use super::estimate::{Estimate, nan_is_null};
use super::{ExactSum, Quantile, Sketch};
use crate::signal::arithmetic::with_fma;
use serde::{Deserialize, Serialize};

/// Share of the sum of squares that a single trial may have; see [`Statistics::dominated`].
pub const DOMINANT_SHARE: f64 = 0.1;

/// Share of the trials that the trimmed mean leaves out on either side.
pub const TRIM: f64 = 0.05;

/// A figure over trials, gathered so that nothing depends on the order of trials, on blocks or on merges.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    count: u64,
    undefined: u64,
    overflowed: u64,
    sum: ExactSum,
    squares: ExactSum,
    /// Of cubes and fourth powers in double-double.
    cubes: ExactSum,
    fourths: ExactSum,
    /// Smallest and largest.
    extremes: Option<(f64, f64)>,
    sketch: Sketch,
}

impl Sample {
    /// Gathers the figure of some trials. NaN is no figure: it is counted and left out.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
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
                for &x in &defined {
                    sample.add_powers(x);
                }
            },
        );
        sample.sketch = Sketch::of(defined);
        sample
    }

    #[inline(always)]
    fn add_powers(&mut self, x: f64) {
        let (low, high) = self.extremes.unwrap_or((x, x));
        self.extremes = Some((low.min(x), high.max(x)));
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

    /// Adds the trials of another sample.
    pub fn merge(&mut self, other: &Self) {
        self.merge_sums(other);
        self.sketch.merge(&other.sketch);
    }

    /// Adds all of another sample but its sketch.
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

    /// Trials with a figure.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Trials whose figure was NaN. They enter nothing else.
    pub fn undefined(&self) -> u64 {
        self.undefined
    }

    /// Trials whose figure's fourth power is beyond the range of doubles: no moment that needs it is given.
    pub fn overflowed(&self) -> u64 {
        self.overflowed
    }

    /// The distribution.
    pub fn sketch(&self) -> &Sketch {
        &self.sketch
    }

    /// Largest |x|; 0 of no trial.
    pub fn largest(&self) -> f64 {
        self.extremes
            .map_or(0.0, |(low, high)| low.abs().max(high.abs()))
    }

    /// The q-quantile by the sketch, within smallest and largest value.
    pub fn quantile(&self, q: f64) -> Quantile {
        let quantile = self.sketch.quantile(q);
        Quantile {
            value: self.clamp(quantile.value),
            ..quantile
        }
    }

    fn clamp(&self, x: f64) -> f64 {
        self.extremes.map_or(x, |(low, high)| x.clamp(low, high))
    }

    /// The median alone.
    pub(super) fn median_value(&self) -> f64 {
        self.clamp(self.sketch.quantile_value(0.5))
    }

    /// The arithmetic mean, MCSE `s / sqrt M`.
    pub fn mean(&self) -> Estimate {
        let m = self.count as f64;
        if !self.largest().is_finite() {
            return Estimate::UNDEFINED;
        }
        Estimate::new(self.sum.value() / m, (self.variance() / m).sqrt())
    }

    /// `s^2 = sum (x - mean)^2 / (M - 1)`, NaN where it is undefined.
    ///
    /// With c the rounded mean, `sum (x - c)^2 = sum x^2 - 2 c sum x + M c^2` is taken in exact arithmetic;
    /// what is left of the mean, `(sum x - M c)^2 / M`, is subtracted.
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
        let (square, square_low) = super::dd::two_product(c, c);
        squares.add_product(m, square);
        squares.add_product(m, square_low);
        let rest = rest.value();
        (squares.value() - rest * (rest / m)).max(0.0) / (m - 1.0)
    }

    /// The standard deviation s.
    ///
    /// `Var s^2 = (mu_4 - sigma^4 (M - 3) / (M - 1)) / M`, whatever the distribution; MCSE
    /// `sqrt(Var s^2) / (2 s)` by the delta method, mu_4 estimated by `sum (x - mean)^4 / M`.
    pub fn sd(&self) -> Estimate {
        let m = self.count as f64;
        let variance = self.variance();
        let rest = (m - 3.0) / (m - 1.0) * variance * variance;
        let of_variance = (self.fourth_central() - rest).max(0.0) / m;
        let mcse = if variance == 0.0 {
            0.0
        } else {
            of_variance.sqrt() / (2.0 * variance.sqrt())
        };
        Estimate::new(variance.sqrt(), self.with_fourths(mcse))
    }

    /// `sum (x - mean)^4 / M` in double-double: error some 1e-31 of `mean x^4`.
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
        sum.over(m).value().max(0.0)
    }

    /// The mean square, MCSE the standard deviation of `x^2` over `sqrt M`.
    pub fn mse(&self) -> Estimate {
        let m = self.count as f64;
        let largest = self.largest();
        if !(largest * largest).is_finite() {
            return Estimate::UNDEFINED;
        }
        let s2 = Dd::from(self.squares.value_dd());
        let s4 = Dd::from(self.fourths.value_dd());
        let spread = (s4 - (s2 * s2).over(Dd::from(m))).value().max(0.0);
        let mcse = (spread / (m - 1.0) / m).sqrt();
        Estimate::new(s2.value() / m, self.with_fourths(mcse))
    }

    /// The root of the mean square, `MCSE = MCSE(MSE) / (2 RMSE)` by the delta method.
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

    /// An error that needs fourth powers: NaN where one is missing or there is a single trial.
    fn with_fourths(&self, mcse: f64) -> f64 {
        if self.overflowed == 0 && self.count > 1 {
            mcse
        } else {
            f64::NAN
        }
    }

    /// `sqrt(mean x^2)` alone, of several samples together.
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

    /// `max x^2 / sum x^2`; 0 where all are 0, NaN where the squares are out of range or there is none.
    pub fn largest_share(&self) -> f64 {
        largest_share(self.count, self.largest(), &self.squares)
    }

    /// Everything that is reported of a figure.
    pub fn statistics(&self) -> Statistics {
        let (min, max) = self.extremes.unwrap_or((f64::NAN, f64::NAN));
        let largest_share = self.largest_share();
        Statistics {
            count: self.count,
            undefined: self.undefined,
            overflowed: self.overflowed,
            mean: self.mean(),
            sd: self.sd(),
            mse: self.mse(),
            rmse: self.rmse(),
            trimmed: self.sketch.trimmed_mean(TRIM),
            q05: self.quantile(0.05),
            q25: self.quantile(0.25),
            q50: self.quantile(0.5),
            q75: self.quantile(0.75),
            q95: self.quantile(0.95),
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

#[inline(always)]
pub(super) fn finite((high, low): (f64, f64)) -> bool {
    high.is_finite() && low.is_finite()
}

/// What is reported of a figure over trials. Undefined numbers are NaN, in files null.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Trials with a figure: M.
    pub count: u64,
    /// Trials whose figure is NaN; they enter nothing else.
    pub undefined: u64,
    /// Trials whose figure's fourth power is beyond the range of doubles.
    pub overflowed: u64,
    /// Arithmetic mean.
    pub mean: Estimate,
    /// Standard deviation, divisor M - 1.
    pub sd: Estimate,
    /// Mean square, about 0: the mean square error where the figure is an error.
    pub mse: Estimate,
    /// Its root.
    pub rmse: Estimate,
    /// Mean without the 5 % smallest and the 5 % largest ([`TRIM`]), by the sketch.
    pub trimmed: Estimate,
    /// 5 % quantile, by the sketch, as the others.
    pub q05: Quantile,
    /// Lower quartile.
    pub q25: Quantile,
    /// Median.
    pub q50: Quantile,
    /// Upper quartile.
    pub q75: Quantile,
    /// 95 % quantile.
    pub q95: Quantile,
    /// Smallest, as it was.
    #[serde(with = "nan_is_null")]
    pub min: f64,
    /// Largest, as it was.
    #[serde(with = "nan_is_null")]
    pub max: f64,
    /// Whether one trial has more than [`DOMINANT_SHARE`] of the sum of squares, or squares are out of
    /// range. Then the figure has a heavy tail (or there are fewer than some ten trials): mean, sd, MSE and
    /// RMSE say little, and their standard errors, which rest on fourth moments, even less. Read the
    /// quantiles and the trimmed mean. The reverse does not hold: not every heavy tail shows.
    pub dominated: bool,
    /// The largest `x^2` over the sum of `x^2`.
    #[serde(with = "nan_is_null")]
    pub largest_share: f64,
}
