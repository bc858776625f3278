//! Coloured noise: white noise, Gaussian, of heavy tails or drawn from given numbers, through a rational filter. It is
//! stationary from its first sample.

use super::arithmetic::{mean, variance, with_fma};
use super::normal::fill_standard_normal;
use super::random_stream::Stream;
use crate::real::Real;
use crate::step_down::StepDown;
use rand::Rng;
use std::sync::Arc;

/// The most degrees of freedom of Student's t: beyond, the law is as good as normal.
const MOST_FREEDOM: u16 = 100;

/// The distribution of the white noise w, with mean 0 and variance 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum NoiseLaw {
    /// Normal numbers.
    #[default]
    Gaussian,
    /// Student's t with so many degrees of freedom, at least 3, scaled to variance 1: a normal number z over the root
    /// of the mean of as many squares of others, `w = z sqrt((nu - 2) / (z_1^2 + ... + z_nu^2))`.
    StudentT(u16),
    /// Normal numbers, a share of which are outliers, `scale` times as large; all scaled to variance 1. The density is
    /// `(1 - share) phi(x/s)/s + share phi(x/(scale s))/(scale s)`, `1/s^2 = 1 - share + share scale^2` (Tukey, *A
    /// survey of sampling from contaminated distributions*, 1960).
    Contaminated {
        /// The share of outliers, between 0 and 1.
        share: f64,
        /// Their size, above 1.
        scale: f64,
    },
    /// Given numbers, with replacement.
    Drawn(Arc<[f64]>),
}

impl NoiseLaw {
    /// The Fisher information of one number about a shift of it, `E[(f' / f)^2]` with f the density: 1 for normal
    /// numbers,
    /// `nu (nu + 1) / ((nu - 2) (nu + 3))` for Student's t (Lange, Little and Taylor, *Robust statistical modeling
    /// using the t distribution*, JASA 84, 1989), an integral for contamination. `None` for given numbers, which have
    /// no density.
    pub fn information(&self) -> Option<f64> {
        match self {
            Self::Gaussian => Some(1.0),
            Self::StudentT(freedom) => {
                let nu = f64::from(*freedom);
                Some(nu * (nu + 1.0) / ((nu - 2.0) * (nu + 3.0)))
            }
            Self::Contaminated { share, scale } => Some(contaminated(*share, *scale)),
            Self::Drawn(_) => None,
        }
    }

    /// Draws white numbers. A longer w extends a shorter one.
    fn fill(&self, stream: &mut Stream, w: &mut [f64]) {
        match self {
            Self::Gaussian => fill_standard_normal(stream, w),
            Self::StudentT(freedom) => {
                let mut normals = [0.0; 1 + MOST_FREEDOM as usize];
                let z = &mut normals[..=usize::from(*freedom)];
                for w in w {
                    fill_standard_normal(stream, z);
                    let squares: f64 = z[1..].iter().map(|z| z * z).sum();
                    *w = z[0] * ((f64::from(*freedom) - 2.0) / squares).sqrt();
                }
            }
            Self::Contaminated { share, scale } => {
                let size = (1.0 - share + share * scale * scale).sqrt().recip();
                for w in w {
                    fill_standard_normal(stream, std::slice::from_mut(w));
                    let place = (stream.next_u64() >> 11) as f64 / 9_007_199_254_740_992.0;
                    *w *= if place < *share { scale * size } else { size };
                }
            }
            Self::Drawn(numbers) => {
                for w in w {
                    // Each number has the probability 1/count, up to 2^-64.
                    let index = (u128::from(stream.next_u64()) * numbers.len() as u128) >> 64;
                    *w = numbers[index as usize];
                }
            }
        }
    }
}

/// The information of a contaminated density about a shift, by the trapezoidal rule: with `w = s x`, f the mixture of
/// x and `1/s^2` its variance, `E[(f'/f)^2] / s^2`. The sum is exact to rounding: f'^2/f is analytic and decays as f.
fn contaminated(share: f64, scale: f64) -> f64 {
    const STEP: f64 = 1.0 / 64.0;
    let part = |weight: f64, size: f64, x: f64| {
        let z = x / size;
        weight / size * libm::exp(-0.5 * z * z)
    };
    let last = (40.0 * scale / STEP).ceil() as usize;
    let at = |k: usize| {
        let x = k as f64 * STEP;
        let (inner, outer) = (part(1.0 - share, 1.0, x), part(share, scale, x));
        let (density, slope) = (inner + outer, x * (inner + outer / (scale * scale)));
        if density > 0.0 { slope * slope / density } else { 0.0 }
    };
    // An even function whose term at 0 is 0.
    let sum: f64 = (1..=last).map(at).sum();
    let variance = 1.0 - share + share * scale * scale;
    variance * sum * 2.0 * STEP / (2.0 * std::f64::consts::PI).sqrt()
}

/// The noise filter `C(q) / D(q)`: `f(k) = sum_i c_i v(k-i)`, `v(k) = w(k) - sum_i d_i v(k-i)`, with w white, of unit
/// variance, Gaussian unless another [`NoiseLaw`] is given.
///
/// v is stationary: its samples before k = 0 are an exact draw, not a burn-in. Let `v_1, v_2, ...` be the samples in
/// order of time. Given its predecessors, `v_j` is normal with mean `-sum_i d^(j-1)_i v_(j-i)` and variance
/// `sigma_(j-1)^2`. Here `d^(m)` is the predictor polynomial of order m and `sigma_m^2` its error variance. Both come
/// from D by Levinson's step-down recursion, which also tests whether D is stable.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseFilter {
    /// c_0 ... c_q.
    numerator: Vec<f64>,
    /// d_1 ... d_p of the monic D.
    denominator: Vec<f64>,
    /// Predictors of order 0 ... p for the start.
    predictors: StepDown,
    /// The distribution of w.
    law: NoiseLaw,
    /// Whether all is zero before k = 0.
    is_from_rest: bool,
}

/// Why a noise filter was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoiseFilterError {
    /// The numerator is empty or has a coefficient that is not finite.
    #[error("the noise filter's numerator must be finite numbers, at least one")]
    Numerator,
    /// The denominator is empty, does not begin with 1, or has a coefficient that is not finite.
    #[error("the noise filter's denominator must be finite numbers beginning with 1")]
    Denominator,
    /// D has a zero on or outside the unit circle: no stationary noise exists.
    #[error("the noise filter's denominator has a zero on or outside the unit circle")]
    Unstable,
    /// The numbers to draw from have no spread, or are not finite.
    #[error("the numbers that noise is drawn from must be finite and not all the same")]
    Residuals,
    /// Student's t has no variance, or is too near to the normal law for its cost.
    #[error("{0} degrees of freedom of Student's t; expected 3 to {MOST_FREEDOM}")]
    Freedom(u16),
    /// Outliers are none, or all.
    #[error("a share of {0} and a scale of {1}; expected a share between 0 and 1 and a scale above 1, up to 1000")]
    Contamination(f64, f64),
}

impl NoiseFilter {
    /// Makes the filter `(c_0 + c_1 q^-1 + ...) / (1 + d_1 q^-1 + ...)`.
    ///
    /// # Errors
    /// If a polynomial is empty or not finite, D is not monic, or D is not stable.
    pub fn new(numerator: &[f64], denominator: &[f64]) -> Result<Self, NoiseFilterError> {
        if numerator.is_empty() || !numerator.iter().all(|c| c.is_finite()) {
            return Err(NoiseFilterError::Numerator);
        }
        if denominator.first() != Some(&1.0) || !denominator.iter().all(|d| d.is_finite()) {
            return Err(NoiseFilterError::Denominator);
        }
        let predictors = StepDown::new(&denominator[1..]).ok_or(NoiseFilterError::Unstable)?;
        Ok(Self {
            numerator: numerator.to_vec(),
            denominator: denominator[1..].to_vec(),
            predictors,
            law: NoiseLaw::Gaussian,
            is_from_rest: false,
        })
    }

    /// Changes w to white noise drawn with replacement from given numbers, after their mean is subtracted and their
    /// variance scaled to 1 (Efron and Tibshirani, An Introduction to the Bootstrap, section 9.5). The stationary start
    /// is still Gaussian: its mean and covariance are right, its higher moments are not.
    ///
    /// # Errors
    /// If the numbers are not finite, or are all the same.
    pub fn drawn_from(mut self, residuals: &[f64]) -> Result<Self, NoiseFilterError> {
        let (mean, deviation) = (mean(residuals), variance(residuals).sqrt());
        if !(deviation > 0.0 && deviation.is_finite()) {
            return Err(NoiseFilterError::Residuals);
        }
        let scaled = residuals.iter().map(|e| (e - mean) / deviation);
        self.law = NoiseLaw::Drawn(scaled.collect());
        Ok(self)
    }

    /// Changes w to white noise of Student's t with so many degrees of freedom. The stationary start is still Gaussian:
    /// its mean and covariance are right, its higher moments are not.
    ///
    /// # Errors
    /// If they are not 3 to 100.
    pub fn student_t(mut self, freedom: u16) -> Result<Self, NoiseFilterError> {
        if !(3..=MOST_FREEDOM).contains(&freedom) {
            return Err(NoiseFilterError::Freedom(freedom));
        }
        self.law = NoiseLaw::StudentT(freedom);
        Ok(self)
    }

    /// Changes w to contaminated normal numbers. The stationary start is still Gaussian: its mean and covariance are
    /// right, its higher moments are not.
    ///
    /// # Errors
    /// If the share is not between 0 and 1, or the scale not between 1 and 1000.
    pub fn contaminated(mut self, share: f64, scale: f64) -> Result<Self, NoiseFilterError> {
        if !(share > 0.0 && share < 1.0 && scale > 1.0 && scale <= 1000.0) {
            return Err(NoiseFilterError::Contamination(share, scale));
        }
        self.law = NoiseLaw::Contaminated { share, scale };
        Ok(self)
    }

    /// Lets the noise begin at k = 0, from rest, instead of being stationary.
    #[must_use]
    pub fn from_rest(mut self) -> Self {
        self.is_from_rest = true;
        self
    }

    /// Returns what w is drawn from.
    pub fn law(&self) -> &NoiseLaw {
        &self.law
    }

    /// Returns whether w is Gaussian.
    pub fn is_gaussian(&self) -> bool {
        self.law == NoiseLaw::Gaussian
    }

    /// Makes white noise: the filter 1.
    ///
    /// # Panics
    /// Never: the filter is valid.
    pub fn white() -> Self {
        Self::new(&[1.0], &[1.0]).expect("white noise is stationary")
    }

    /// Returns c_0 ... c_q.
    pub fn numerator(&self) -> &[f64] {
        &self.numerator
    }

    /// Returns 1, d_1 ... d_p.
    pub fn denominator(&self) -> Vec<f64> {
        [&[1.0], self.denominator.as_slice()].concat()
    }

    /// Returns how many samples of v before k = 0 the recursions use.
    pub fn memory(&self) -> usize {
        self.denominator.len().max(self.numerator.len() - 1)
    }

    /// Returns the process variance of f, `sum_k g(k)^2` with g the impulse response of C/D.
    pub fn variance(&self) -> f64 {
        self.predictors.energy(&self.numerator)
    }

    /// Fills `f` with f(0), f(1), ... of one realisation. A longer `f` extends a shorter one.
    ///
    /// `v` is scratch memory, resized as needed.
    pub fn fill(&self, start: &mut Stream, drive: &mut Stream, v: &mut Vec<f64>, f: &mut [f64]) {
        let memory = self.memory();
        v.resize(memory + f.len(), 0.0);
        fill_standard_normal(start, &mut v[..memory]);
        self.start(&mut v[..memory]);
        self.law.fill(drive, &mut v[memory..]);
        self.colour(v);
        f.copy_from_slice(&v[memory..]);
    }

    /// Fills `f` with a realisation whose start and drive come from one stream, both Gaussian. A longer `f` extends a
    /// shorter one.
    pub(crate) fn fill_from_one(&self, stream: &mut Stream, f: &mut [f64]) {
        let memory = self.memory();
        let mut v = vec![0.0; memory + f.len()];
        fill_standard_normal(stream, &mut v);
        self.start(&mut v[..memory]);
        self.colour(&mut v);
        f.copy_from_slice(&v[memory..]);
    }

    /// Colours white numbers. On entry, v holds [`Self::memory`] numbers of the stationary start followed by the drive
    /// w, which becomes f.
    fn colour(&self, v: &mut [f64]) {
        with_fma(
            #[inline(always)]
            || self.colour_as_drawn(v, Drawn),
        );
    }

    /// Does the same with w drawn during the recursion. The recursion waits for its own results, so it can overlap the
    /// drawing.
    #[inline(always)]
    pub fn colour_as_drawn<R: Real>(&self, v: &mut [R], mut draw: impl Draw<R>) {
        let memory = self.memory();
        let d = &self.denominator[..];
        match d.len() {
            1 => recur::<1, R>(d, v, memory, draw),
            2 => recur::<2, R>(d, v, memory, draw),
            4 => recur::<4, R>(d, v, memory, draw),
            6 => recur::<6, R>(d, v, memory, draw),
            _ => {
                draw.fill(&mut v[memory..]);
                for k in memory..v.len() {
                    v[k] = v[k] + predict(d, v, k);
                }
            }
        }
        let [first, others @ ..] = &self.numerator[..] else {
            return;
        };
        if *first == 1.0 && others.is_empty() {
            return;
        }
        // The last one first, because the values of v that it needs are still there.
        for k in (memory..v.len()).rev() {
            let mut f = R::splat(*first) * v[k];
            for (i, c) in others.iter().enumerate() {
                f = R::splat(*c).mul_add(v[k - 1 - i], f);
            }
            v[k] = f;
        }
    }

    /// Converts white numbers to the samples of v before k = 0, with their stationary distribution; zeros from rest.
    pub fn start<R: Real>(&self, v: &mut [R]) {
        if self.is_from_rest {
            v.fill(R::splat(0.0));
            return;
        }
        R::run(
            #[inline(always)]
            || {
                for j in 0..v.len() {
                    let order = j.min(self.denominator.len());
                    let (predictor, deviation) = self.predictors.predictor(order);
                    v[j] = R::splat(deviation).mul_add(v[j], predict(predictor, v, j));
                }
            },
        );
    }
}

/// Returns `-sum_i d_i v(k-i)`, summed from the oldest sample so that the newest enters last.
#[inline(always)]
fn predict<R: Real>(d: &[f64], v: &[R], k: usize) -> R {
    let mut sum = R::zero();
    for i in (1..=d.len()).rev() {
        sum = R::splat(-d[i - 1]).mul_add(v[k - i], sum);
    }
    sum
}

/// Makes a sequence of numbers in order, two at a time.
pub trait Draw<R> {
    /// Begins the next pairs, at most [`DRAW_PAIRS`].
    fn begin(&mut self, pairs: usize);

    /// Makes the numbers of one of these pairs; only the first if the sequence ends.
    fn pair(&mut self, index: usize, to: &mut [R]);

    /// Makes the whole sequence.
    #[inline(always)]
    fn fill(&mut self, to: &mut [R]) {
        for block in to.chunks_mut(2 * DRAW_PAIRS) {
            self.begin(block.len().div_ceil(2));
            for (i, pair) in block.chunks_mut(2).enumerate() {
                self.pair(i, pair);
            }
        }
    }
}

/// The number of pairs that are begun together.
pub const DRAW_PAIRS: usize = 16;

/// The numbers that are already in place.
struct Drawn;

impl Draw<f64> for Drawn {
    #[inline(always)]
    fn begin(&mut self, _: usize) {}
    #[inline(always)]
    fn pair(&mut self, _: usize, _: &mut [f64]) {}
}

/// Computes `v(k) <- w(k) - sum_i d_i v(k-i)` for all k from `from` on: [`predict`] with the past in registers.
#[inline(always)]
fn recur<const P: usize, R: Real>(d: &[f64], v: &mut [R], from: usize, mut draw: impl Draw<R>) {
    let (mut minus_d, mut past) = ([R::zero(); P], [R::zero(); P]);
    for i in 0..P {
        minus_d[i] = R::splat(-d[i]);
        past[i] = v[from - 1 - i];
    }
    let mut step = |v: &mut R| {
        let mut sum = R::zero();
        for i in (0..P).rev() {
            sum = minus_d[i].mul_add(past[i], sum);
        }
        *v = *v + sum;
        for i in (1..P).rev() {
            past[i] = past[i - 1];
        }
        past[0] = *v;
    };
    for block in v[from..].chunks_mut(2 * DRAW_PAIRS) {
        draw.begin(block.len().div_ceil(2));
        let (pairs, last) = block.as_chunks_mut::<2>();
        for (i, pair) in pairs.iter_mut().enumerate() {
            draw.pair(i, pair);
            step(&mut pair[0]);
            step(&mut pair[1]);
        }
        if let [single] = last {
            draw.pair(pairs.len(), std::slice::from_mut(single));
            step(single);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Purpose, stream};

    fn realise(filter: &NoiseFilter, trial: u64, count: usize) -> Vec<f64> {
        let mut f = vec![0.0; count];
        filter.fill(
            &mut stream(1, trial, Purpose::NoiseStart),
            &mut stream(1, trial, Purpose::NoiseDrive),
            &mut Vec::new(),
            &mut f,
        );
        f
    }

    #[test]
    fn white_noise_is_the_drive_itself() {
        let mut w = vec![0.0; 50];
        fill_standard_normal(&mut stream(1, 7, Purpose::NoiseDrive), &mut w);
        assert_eq!(realise(&NoiseFilter::white(), 7, 50), w);
    }

    #[test]
    fn every_colour_obeys_its_difference_equation_with_the_same_drive() {
        let c = [0.7, -0.2, 0.4];
        let d = [1.0, -1.1, 0.4];
        let filter = NoiseFilter::new(&c, &d).unwrap();
        let long = realise(&filter, 5, 300);
        assert_eq!(realise(&filter, 5, 120), long[..120]);
        let w = realise(&NoiseFilter::white(), 5, 300);
        for k in 2..300 {
            let left: f64 = (0..3).map(|i| d[i] * long[k - i]).sum();
            let right: f64 = (0..3).map(|i| c[i] * w[k - i]).sum();
            assert!((left - right).abs() < 1e-13, "k = {k}");
        }
    }

    /// Variances of f(0) and f(20) and their correlations over trials match theory: AR(2) with
    /// gamma_0 = (1 + d2) / ((1 - d2) ((1 + d2)^2 - d1^2)) and gamma_1 = -d1 / (1 + d2) gamma_0.
    #[test]
    fn the_first_sample_is_already_stationary() {
        let (d1, d2) = (-1.5, 0.7);
        let filter = NoiseFilter::new(&[1.0], &[1.0, d1, d2]).unwrap();
        let variance = (1.0 + d2) / ((1.0 - d2) * ((1.0 + d2) * (1.0 + d2) - d1 * d1));
        assert!((filter.variance() / variance - 1.0).abs() < 1e-14);
        let covariance = -d1 / (1.0 + d2) * variance;
        const TRIALS: u64 = 40_000;
        let mut sums = [0.0; 4];
        for trial in 0..TRIALS {
            let f = realise(&filter, trial, 22);
            sums[0] += f[0] * f[0];
            sums[1] += f[0] * f[1];
            sums[2] += f[20] * f[20];
            sums[3] += f[20] * f[21];
        }
        let error = (2.0 / TRIALS as f64).sqrt() * variance;
        for (sum, expected) in sums.iter().zip([variance, covariance, variance, covariance]) {
            let found = sum / TRIALS as f64;
            assert!((found - expected).abs() < 4.5 * error, "{found} for {expected}");
        }
    }

    /// Only the given numbers occur, standardised and equally often: chi-square with 3 degrees of freedom exceeds 24.4
    /// in 2e-5 of such tests.
    #[test]
    fn drawn_noise_has_the_given_numbers_alone_and_evenly() {
        let (given, count) = ([1.0, 2.0, 4.0, 5.0], 40_000);
        let filter = NoiseFilter::white().drawn_from(&given).unwrap();
        let w = realise(&filter, 3, count);
        assert_eq!(realise(&filter, 3, 70), w[..70]);
        let deviation = 2.5_f64.sqrt();
        let counts = given.map(|x| {
            let equal = |w: &&f64| (*w - (x - 3.0) / deviation).abs() < 1e-15;
            w.iter().filter(equal).count()
        });
        assert_eq!(counts.iter().sum::<usize>(), count);
        let expected = count as f64 / 4.0;
        let chi: f64 = counts.iter().map(|c| (*c as f64 - expected).powi(2) / expected).sum();
        assert!(chi < 24.4, "{counts:?}");
        for same in [&[2.0, 2.0][..], &[], &[f64::NAN, 1.0]] {
            let refused = NoiseFilter::white().drawn_from(same);
            assert_eq!(refused, Err(NoiseFilterError::Residuals));
        }
    }

    /// `D f = C w` with zeros before k = 0.
    #[test]
    fn noise_from_rest_is_the_filtered_drive() {
        let (c, d) = ([1.0, 0.5], [1.0, -1.5, 0.7]);
        let filter = NoiseFilter::new(&c, &d).unwrap().from_rest();
        let (f, w) = (realise(&filter, 3, 50), realise(&NoiseFilter::white(), 3, 50));
        let at = |x: &[f64], k: usize, by: usize| k.checked_sub(by).map_or(0.0, |k| x[k]);
        for k in 0..50 {
            let left: f64 = (0..3).map(|i| d[i] * at(&f, k, i)).sum();
            let right: f64 = (0..2).map(|i| c[i] * at(&w, k, i)).sum();
            assert!((left - right).abs() < 1e-12, "{k} {left} {right}");
        }
    }

    /// Against adaptive quadrature (scipy.integrate.quad to 1e-13 over the square of the slope of f over f, f the
    /// mixture of variance 1); the variance of a sample within four standard errors.
    #[test]
    fn contaminated_numbers_have_their_density() {
        for (share, scale, expected) in [(0.05, 10.0, 5.385_506_003_637_427), (0.1, 5.0, 2.713_806_666_871_938)] {
            let filter = NoiseFilter::white().contaminated(share, scale).unwrap();
            let found = filter.law().information().unwrap();
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
        let filter = NoiseFilter::white().contaminated(0.05, 10.0).unwrap();
        let mut w = vec![0.0; 100_000];
        let mut drawn = stream(3, 1, Purpose::NoiseDrive);
        filter.law().fill(&mut drawn, &mut w);
        let square = w.iter().map(|w| w * w).sum::<f64>() / 1e5;
        // E w^4 = 3 (0.95 + 0.05 * 10^4) / (0.95 + 5)^2 = 42.45.
        assert!((square - 1.0).abs() < 4.0 * (41.45_f64 / 1e5).sqrt(), "{square}");
        let mut longer = vec![0.0; 100_001];
        let mut again = stream(3, 1, Purpose::NoiseDrive);
        filter.law().fill(&mut again, &mut longer);
        assert_eq!(w, longer[..100_000]);
        for (share, scale) in [(0.0, 10.0), (1.0, 10.0), (0.1, 1.0), (f64::NAN, 2.0)] {
            assert!(NoiseFilter::white().contaminated(share, scale).is_err());
        }
    }

    /// Mean 0, variance 1, and the share beyond 3 of Student's t with 4 degrees of freedom: P(|t| > 3 sqrt(2)) =
    /// 0.01324 (R: `2 * pt(-3 * sqrt(2), 4)`), five times the normal one. A longer draw extends a shorter one.
    #[test]
    fn heavy_tails_are_those_of_student() {
        let filter = NoiseFilter::white().student_t(4).unwrap();
        let w = realise(&filter, 0, 200_000);
        let count = w.len() as f64;
        assert!((w.iter().sum::<f64>() / count).abs() < 4.0 / count.sqrt());
        let beyond = w.iter().filter(|w| w.abs() > 3.0).count() as f64 / count;
        let error = (0.01324 * (1.0 - 0.01324) / count).sqrt();
        assert!((beyond - 0.01324).abs() < 4.0 * error, "{beyond}");
        // The median of |t| with 4 degrees of freedom is 0.740697.
        let half = 0.740_697 / 2.0_f64.sqrt();
        let within = w.iter().filter(|w| w.abs() < half).count() as f64 / count;
        assert!((within - 0.5).abs() < 4.0 * 0.5 / count.sqrt(), "{within}");
        assert_eq!(realise(&filter, 0, 1000), w[..1000]);
        for refused in [0, 2, 101] {
            assert!(NoiseFilter::white().student_t(refused).is_err());
        }
        let information = NoiseLaw::StudentT(3).information();
        assert_eq!(information, Some(2.0));
    }

    #[test]
    fn refusals() {
        assert_eq!(NoiseFilter::new(&[1.0], &[1.0, -1.0]), Err(NoiseFilterError::Unstable));
        assert_eq!(NoiseFilter::new(&[], &[1.0]), Err(NoiseFilterError::Numerator));
        assert_eq!(NoiseFilter::new(&[1.0], &[2.0]), Err(NoiseFilterError::Denominator));
    }
}
