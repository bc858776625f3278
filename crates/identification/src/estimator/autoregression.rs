//! Autoregressions: `D(q) v(k) = e(k)`, with the order that AIC chooses.

use super::FailureKind;
use crate::signal::NoiseFilter;

/// An autoregression of a signal of mean zero, with its memory.
#[derive(Default)]
pub struct Autoregression {
    /// `D = 1 + d_1 q^-1 + ...` of the order being tried, and the best D so far.
    d: Vec<f64>,
    best: Vec<f64>,
    /// Covariances of the signal.
    covariances: Vec<f64>,
}

impl Autoregression {
    /// Fits D by the Yule-Walker equations. The order is the one of 0 ... min(10 log10 M, M/4) with the smallest
    /// `M ln(variance) + 2 order` for M samples. All roots of D are inside the unit circle. Returns the variance of e.
    ///
    /// Source: Brockwell and Davis, Time Series: Theory and Methods, 2nd ed., sections 8.1 and 9.3.
    pub(super) fn fit(&mut self, v: &[f64]) -> f64 {
        let most = (10.0 * (v.len() as f64).log10()) as usize;
        self.fit_within(v, most)
    }

    /// Does the same with a largest order of `most`, and M/4.
    pub(crate) fn fit_within(&mut self, v: &[f64], most: usize) -> f64 {
        let samples = v.len() as f64;
        let most = most.min(v.len() / 4);
        self.covariances.clear();
        for lag in (0..=most).step_by(LAGS) {
            let sums = with_fma!(|| lag_sums(v, lag));
            self.covariances.extend(sums.map(|sum| sum / samples));
        }
        let covariance = |lag: usize| self.covariances[lag];
        self.d.clear();
        self.d.push(1.0);
        self.best.clone_from(&self.d);
        let mut variance = covariance(0);
        let (mut of_best, mut least) = (variance, samples * variance.ln());
        for order in 1..=most {
            self.d.push(0.0);
            if durbin_step(&mut self.d, order, &mut variance, covariance).is_err() {
                break;
            }
            let criterion = samples * variance.ln() + 2.0 * order as f64;
            if criterion < least {
                (of_best, least) = (variance, criterion);
                self.best.clone_from(&self.d);
            }
        }
        of_best
    }

    /// D of the last fit.
    pub(crate) fn denominator(&self) -> &[f64] {
        &self.best
    }
}

/// Lags whose sums are computed side by side.
const LAGS: usize = 24;

/// Returns `sum v(k) v(k - l)` for each l from `lag` on.
#[inline(always)]
fn lag_sums(v: &[f64], lag: usize) -> [f64; LAGS] {
    // The sum of lag + i is in lane LAGS - 1 - i, as early samples lie in memory.
    let mut sums = [-0.0; LAGS];
    let first = (lag + LAGS - 1).min(v.len());
    for (lane, sum) in sums.iter_mut().enumerate() {
        let lag = lag + LAGS - 1 - lane;
        (lag..first).for_each(|k| *sum += v[k] * v[k - lag]);
    }
    for (late, early) in v[first..].iter().zip(v.array_windows::<LAGS>()) {
        for lane in 0..LAGS {
            sums[lane] += late * early[lane];
        }
    }
    sums.reverse();
    sums
}

/// The filter `1/D` that gives white noise the spectrum of a signal of mean zero; 1 for a signal without spread.
pub fn spectrum(u: &[f64]) -> NoiseFilter {
    let mut fitted = Autoregression::default();
    fitted.fit(u);
    // Rounding alone can move a root to the circle.
    NoiseFilter::new(&[1.0], fitted.denominator()).unwrap_or_else(|_| NoiseFilter::white())
}

/// Does one step of the Levinson-Durbin recursion: computes `l = 1 + l_1 q^-1 + ... + l_lag q^-lag` and the variance of
/// `l w` from those of the previous order.
///
/// # Errors
/// [`FailureKind::Singular`] if no variance is left.
pub(super) fn durbin_step(
    l: &mut [f64],
    lag: usize,
    variance: &mut f64,
    covariance: impl Fn(usize) -> f64,
) -> Result<(), FailureKind> {
    if *variance <= 0.0 || !variance.is_finite() {
        return Err(FailureKind::Singular);
    }
    let sum: f64 = (0..lag).map(|i| l[i] * covariance(lag - i)).sum();
    let reflection = -sum / *variance;
    // Computes l_i + k l_(lag - i) for both ends at once.
    for i in 0..=lag / 2 {
        let (low, high) = (l[i], l[lag - i]);
        l[i] = reflection.mul_add(high, low);
        if i != lag - i {
            l[lag - i] = reflection.mul_add(low, high);
        }
    }
    *variance *= 1.0 - reflection * reflection;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

    /// The coefficients of an AR(2) signal are found within 4.5 standard errors, sqrt((1 - d_2^2)/N) each (Box and
    /// Jenkins, Time Series Analysis, chapter 7), if AIC finds this order. White signals have a spectrum near 1.
    #[test]
    fn the_spectrum_of_an_autoregression_is_found() {
        const N: usize = 4000;
        let (d, mut found) = ([1.0, -1.2, 0.7], 0);
        let input = Input::Filtered {
            filter: NoiseFilter::new(&[1.0], &d).unwrap(),
            amplitude: 5.0,
        };
        for trial in 0..20 {
            let mut u = vec![0.0; N];
            input.fill(&mut stream(5, trial, Purpose::Input), &mut u);
            let fitted = spectrum(&u).denominator();
            assert!(fitted.len() >= 3, "{fitted:?}");
            if fitted.len() == 3 {
                found += 1;
                let error = ((1.0 - 0.49) / N as f64).sqrt();
                for (fitted, d) in fitted.iter().zip(d) {
                    assert!((fitted - d).abs() < 4.5 * error, "{fitted} for {d}");
                }
            }
        }
        // AIC takes the right order in 71 % of long records (Shibata, 1976). 20 trials give fewer than 7 with
        // probability 2e-4.
        assert!(found >= 7, "{found}");
        let mut white = vec![0.0; N];
        let input = Input::new(InputLaw::Gaussian, 5.0, Sequence::default());
        input.fill(&mut stream(5, 1, Purpose::Input), &mut white);
        let variance = spectrum(&white).variance();
        assert!((1.0..1.1).contains(&variance), "{variance}");
    }

    /// A signal without spread, or of two samples, has no model but 1. That is not a failure.
    #[test]
    fn signals_without_a_spectrum_are_white() {
        assert_eq!(spectrum(&[0.0; 50]), NoiseFilter::white());
        assert_eq!(spectrum(&[1.0, -1.0]), NoiseFilter::white());
    }
}
