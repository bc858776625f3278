//! The spectrum of a signal as an autoregression whose order AIC chooses.

use super::{Criterion, OrderComparison};
use crate::model::Orders;
use crate::signal::NoiseFilter;

/// Fits `D(q) u(k) = e(k)` to a signal of mean zero by least squares and returns the filter `1/D`.
///
/// The order is the one with the smallest AIC among 0 ... min(10 log10 N, N/4), all fitted over the same equations
/// (Ljung, System Identification, 2nd ed., section 16.4). Unstable models are left out. That of order 0 is always
/// stable.
///
/// # Panics
/// Never: the filter 1 is stable.
pub fn autoregression(u: &[f64]) -> NoiseFilter {
    let n = u.len();
    let most = ((10.0 * (n as f64).log10()) as usize).min(n / 4);
    let orders: Vec<Orders> = (1..=most).map(|na| Orders::arx(na, 0, 1)).collect();
    let mut best = NoiseFilter::white();
    let Ok(mut comparison) = OrderComparison::new(&orders, n) else {
        return best;
    };
    let equations = comparison.equations();
    let loss = u[most..].iter().map(|u| u * u).sum::<f64>() / equations as f64;
    let mut least = Criterion::Aic.value(loss, equations, 0);
    comparison.run(u, u);
    for candidate in comparison.candidates() {
        let Ok(loss) = candidate.loss else { continue };
        let value = Criterion::Aic.value(loss, equations, candidate.orders.na);
        let denominator = [&[1.0], candidate.theta()].concat();
        if value < least
            && let Ok(filter) = NoiseFilter::new(&[1.0], &denominator)
        {
            (best, least) = (filter, value);
        }
    }
    best
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
            let fitted = autoregression(&u).denominator();
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
        let variance = autoregression(&white).variance();
        assert!((1.0..1.1).contains(&variance), "{variance}");
    }

    /// For a signal without spread, or one that repeats itself exactly, only the model 1 is stable. That is not a
    /// failure.
    #[test]
    fn signals_without_a_spectrum_are_white() {
        assert_eq!(autoregression(&[0.0; 50]), NoiseFilter::white());
        assert_eq!(autoregression(&[1.0, -1.0]), NoiseFilter::white());
    }
}
