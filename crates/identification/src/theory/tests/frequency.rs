//! Lyapunov equations compared with integrals over frequency, for signals of every kind.

use super::*;
use crate::theory::spectrum::Spectrum;

/// Points of the trapezoidal rule, which converges geometrically: for a pole of modulus 0.95 the error is 1e-22.
const POINTS: usize = 1024;

/// The transfer function from a source at `q^-1 = exp(-i w)`.
fn transfer(signal: &Signal, source: usize, w: f64) -> c64 {
    let at = |c: &[f64]| {
        let terms = c.iter().enumerate();
        terms.fold(c64::new(0.0, 0.0), |sum, (k, c)| {
            let angle = -w * k as f64;
            sum + c64::new(c * libm::cos(angle), c * libm::sin(angle))
        })
    };
    let parts = signal.parts.iter().filter(|part| part.source == source);
    parts.fold(c64::new(0.0, 0.0), |sum, part| {
        sum + at(&part.numerator) * at(&part.denominator).inv()
    })
}

/// `1/(2 pi) int f(w) dw`.
fn mean(f: impl Fn(f64) -> c64) -> f64 {
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / POINTS as f64;
    let sum = (0..POINTS).fold(c64::new(0.0, 0.0), |sum, i| sum + f(angle(i)));
    sum.re / POINTS as f64
}

/// The cross spectrum of two signals.
fn spectrum(sources: &[Source], a: &Signal, b: &Signal, w: f64) -> c64 {
    let terms = sources.iter().enumerate();
    terms.fold(c64::new(0.0, 0.0), |sum, (s, source)| {
        sum + transfer(a, s, w) * transfer(b, s, w).conj() * source.variance
    })
}

pub fn covariance_over_frequency(sources: &[Source], a: &Signal, b: &Signal) -> f64 {
    mean(|w| spectrum(sources, a, b, w))
}

/// Parseval: `sum_t R_ab(t) R_cd(t) = 1/(2 pi) int Phi_ab(w) conj(Phi_cd(w)) dw`.
pub fn long_run_over_frequency(sources: &[Source], first: &(Signal, Signal), second: &(Signal, Signal)) -> f64 {
    let ((a, b), (c, d)) = (first, second);
    let of = |x: &Signal, y: &Signal, w: f64| spectrum(sources, x, y, w);
    let gaussian = mean(|w| of(a, c, w) * of(b, d, w).conj() + of(a, d, w) * of(b, c, w).conj());
    let fourth = sources.iter().enumerate().map(|(s, source)| {
        let share = |a: &Signal, b: &Signal| source.variance * mean(|w| transfer(a, s, w) * transfer(b, s, w).conj());
        source.excess * share(a, b) * share(c, d)
    });
    gaussian + fourth.sum::<f64>()
}

fn signals() -> (Vec<Source>, Vec<Signal>) {
    let source = Source::white;
    let sources = vec![source(4.0, -2.0), source(0.3, 0.0), source(1.0, 1.5)];
    let x = Signal::new(0, &[0.0, 1.0, 0.5], &[1.0, -1.5, 0.7]);
    let y = x.clone().plus(1.0, &Signal::new(1, &[1.0, 0.6], &[1.0, -0.8]));
    let z = Signal::new(2, &[0.3, 0.0, -1.0], &[1.0])
        .plus(-0.4, &Signal::new(0, &[1.0], &[1.0]))
        .plus(2.0, &y.delayed(3));
    let slow = y.through(&[1.0, -0.2], &[1.0, -0.95]);
    (sources, vec![x, y, z, slow])
}

#[test]
fn covariances_are_integrals_of_spectra() {
    let (sources, signals) = signals();
    let found = covariance(&sources, &signals, &signals).unwrap();
    for (i, a) in signals.iter().enumerate() {
        for (j, b) in signals.iter().enumerate() {
            let expected = covariance_over_frequency(&sources, a, b);
            let size = (found[(i, i)] * found[(j, j)]).sqrt();
            assert!((found[(i, j)] - expected).abs() < 1e-12 * size, "{i} {j}");
        }
    }
}

#[test]
fn long_run_covariances_are_integrals_of_spectra() {
    let (sources, signals) = signals();
    let mut products = Vec::new();
    for (i, a) in signals.iter().enumerate() {
        for b in &signals[i..] {
            products.push((a.clone(), b.clone()));
        }
    }
    let found = long_run_covariance(&sources, &products).unwrap();
    for (i, a) in products.iter().enumerate() {
        for (j, b) in products.iter().enumerate() {
            let expected = long_run_over_frequency(&sources, a, b);
            let size = (found[(i, i)] * found[(j, j)]).sqrt();
            assert!((found[(i, j)] - expected).abs() < 1e-11 * size, "{i} {j}");
        }
    }
}

/// `x = w` with random signs: x^2 is constant, and products of neighbours are white with variance sigma^4.
#[test]
fn signs_by_hand() {
    let source = Source::white(9.0, -2.0);
    let x = Signal::new(0, &[1.0], &[1.0]);
    let products = [(x.clone(), x.clone()), (x.clone(), x.delayed(1))];
    let s = long_run_covariance(&[source], &products).unwrap();
    assert!(s[(0, 0)].abs() < 1e-12 && s[(0, 1)].abs() < 1e-12);
    assert!((s[(1, 1)] - 81.0).abs() < 1e-11);
}

#[test]
fn what_is_not_stationary_is_refused() {
    let x = Signal::new(0, &[1.0], &[1.0, -1.0]);
    let sources = [Source::white(1.0, 0.0)];
    let one = [x];
    assert_eq!(covariance(&sources, &one, &one).unwrap_err(), NoTheory::NotStationary);
}

/// A cosine by hand: `u = 2 cos(pi k / 2)` through `1 + q^-1` has mean square `2 |1 - i|^2 = 4`. With a lag of one
/// sample its product with white noise of variance v has the long-run variance `2 v`.
#[test]
fn lines_by_hand() {
    let cosine = Spectrum::of_period(&[2.0, 0.0, -2.0, 0.0]).unwrap();
    assert_eq!(cosine.lines.len(), 1);
    let lines = Source::lines(cosine);
    let sources = [lines, Source::white(0.3, 0.0)];
    let u = Signal::new(0, &[1.0], &[1.0]);
    let e = Signal::new(1, &[1.0], &[1.0]);
    let sum = u.through(&[1.0, 1.0], &[1.0]);
    let found = covariance(&sources, &[u.clone(), sum.clone()], &[u.clone(), sum]).unwrap();
    for (i, j, expected) in [(0, 0, 2.0), (0, 1, 2.0), (1, 1, 4.0)] {
        assert!((found[(i, j)] - expected).abs() < 1e-12, "{found:?}");
    }
    let both = u.clone().plus(1.0, &e);
    let products = [(u.delayed(1), e.clone()), (both, e), (u.clone(), u)];
    let found = long_run_covariance(&sources, &products).unwrap();
    // u e and u(k-1) e are uncorrelated, since E[u(k) u(k-1)] = 0; e^2 has the variance 2 v^2; u^2 is fixed.
    let expected = [[0.6, 0.0, 0.0], [0.0, 0.6 + 0.18, 0.0], [0.0; 3]];
    for (i, row) in expected.iter().enumerate() {
        for (j, expected) in row.iter().enumerate() {
            assert!((found[(i, j)] - expected).abs() < 1e-12, "{found:?}");
        }
    }
}

/// The signs of `x(k) = a x(k-1) + w(k)` have the autocovariance `(2/pi) asin(a^t)`.
#[test]
fn signs_of_an_autoregression() {
    let a = 0.6_f64;
    let filter = NoiseFilter::new(&[1.0], &[1.0, -a]).unwrap();
    let spectrum = Spectrum::of_signs(&filter, 2.0).unwrap();
    let lines = Source::lines(spectrum);
    let u = Signal::new(0, &[1.0], &[1.0]);
    let lags = u.lags(1.0, 0, 5);
    let found = covariance(std::slice::from_ref(&lines), &lags, &lags).unwrap();
    for lag in 0..5 {
        let expected = 4.0 * 2.0 / std::f64::consts::PI * a.powi(lag as i32).asin();
        assert!((found[(lag, 0)] - expected).abs() < 1e-10, "{found:?}");
    }
    let pair = [(u.clone(), u)];
    assert_eq!(long_run_covariance(&[lines], &pair).unwrap_err(), NoTheory::BinaryInput);
    let slow = NoiseFilter::new(&[1.0], &[1.0, -0.9999]).unwrap();
    assert_eq!(Spectrum::of_signs(&slow, 1.0).unwrap_err(), NoTheory::SlowInput);
    let long = vec![1.0; 20_000];
    assert_eq!(Spectrum::of_period(&long).unwrap_err(), NoTheory::LongPeriod(20_000));
}
