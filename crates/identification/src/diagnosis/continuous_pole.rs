//! Poles in continuous time.

use super::{Root, RootError};
use faer::c64;
use serde::Serialize;

/// A pole z of a model with the sampling time T as that of a system in continuous time, `s = ln(z) / T`, with the
/// principal value of the logarithm, as MATLAB's `damp` has it. A pair of complex poles is one mode.
///
/// Standard errors are by the derivatives (delta method), `ds/dz = 1/(z T)`, from the covariance of the pole's parts;
/// NaN where that is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mode {
    /// The natural frequency `|s|`, rad/s; 0 of a pole at 1.
    pub frequency: f64,
    /// Its standard error.
    pub frequency_se: f64,
    /// The damping `-Re(s) / |s|`; NaN of a pole at 1.
    pub damping: f64,
    /// Its standard error; 0 of a real pole.
    pub damping_se: f64,
    /// The time constant `-1/Re(s)`, seconds, in which the mode decays to 1/e; `None` if it does not decay.
    pub time_constant: Option<f64>,
    /// Its standard error; NaN if it does not decay.
    pub time_constant_se: f64,
}

/// A pole that is closer to 1 is at 1: of a simple pole the rounding of the coefficients moves it by less, and a time
/// constant of as many samples is in no record.
const AT_ONE: f64 = 1e-10;

impl Mode {
    /// Returns the mode of a pole, with the time `step` between samples in seconds; `None` of a pole at 0, and of the
    /// lower one of a pair.
    pub fn of(pole: &Root, step: f64) -> Option<Self> {
        let Root { at: z, error } = *pole;
        if z.norm() == 0.0 || z.im < 0.0 {
            return None;
        }
        let is_integrator = (z - 1.0).norm() < AT_ONE;
        let [sigma, omega] = [z.norm().ln(), z.arg()].map(|part| if is_integrator { 0.0 } else { part / step });
        let frequency = sigma.hypot(omega);
        let slope = c64::new(1.0, 0.0) / (z * step);
        // The standard error of `g_1 sigma + g_2 omega`, linear in the parts of z.
        let se = |[by_sigma, by_omega]: [f64; 2]| {
            let by_re = by_sigma * slope.re + by_omega * slope.im;
            let by_im = by_omega * slope.re - by_sigma * slope.im;
            let RootError { re, im, covariance, .. } = error;
            let cross = 2.0 * by_re * by_im * covariance;
            let square = by_re * by_re * re * re + cross + by_im * by_im * im * im;
            // Rounding may end below 0; an unknown number stays unknown.
            if square < 0.0 { 0.0 } else { square.sqrt() }
        };
        let cube = frequency.powi(3);
        Some(Self {
            frequency,
            frequency_se: se([sigma / frequency, omega / frequency]),
            damping: -sigma / frequency,
            damping_se: if z.im == 0.0 && z.re > 0.0 {
                0.0 * error.re
            } else {
                se([-omega * omega / cube, sigma * omega / cube])
            },
            time_constant: (sigma < 0.0).then(|| -1.0 / sigma),
            time_constant_se: if sigma < 0.0 {
                se([1.0 / (sigma * sigma), 0.0])
            } else {
                f64::NAN
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(at: c64) -> Root {
        let error = RootError {
            re: 0.003,
            im: 0.002,
            covariance: -2e-6,
            modulus: f64::NAN,
        };
        Root { at, error }
    }

    /// `z = exp(s T)` of a system of second order, `s = -zeta w + i w sqrt(1 - zeta^2)`, and of one of first order.
    #[test]
    fn frequency_and_damping_of_a_sampled_system() {
        let (w, zeta, step) = (12.0, 0.3, 0.05);
        let s = c64::new(-zeta * w, w * f64::sqrt(1.0 - zeta * zeta));
        let mode = Mode::of(&root((s * step).exp()), step).unwrap();
        assert!((mode.frequency - w).abs() < 1e-12 && (mode.damping - zeta).abs() < 1e-13);
        assert!((mode.time_constant.unwrap() - 1.0 / (zeta * w)).abs() < 1e-13);
        let real = Mode::of(&root(c64::new((-0.5_f64).exp(), 0.0)), 0.1).unwrap();
        assert!((real.frequency - 5.0).abs() < 1e-12 && (real.damping - 1.0).abs() < 1e-15);
        assert!((real.time_constant.unwrap() - 0.2).abs() < 1e-15 && real.damping_se == 0.0);
        let unstable = Mode::of(&root(c64::new(1.1, 0.2)), 1.0).unwrap();
        assert!(unstable.damping < 0.0 && unstable.time_constant.is_none());
        let integrator = Mode::of(&root(c64::new(1.0 - 1e-15, 0.0)), 0.1).unwrap();
        assert!(integrator.frequency == 0.0 && integrator.damping.is_nan() && integrator.time_constant.is_none());
        assert_eq!(Mode::of(&root(c64::new(0.0, 0.0)), 1.0), None);
        assert_eq!(Mode::of(&root(c64::new(0.5, -0.1)), 1.0), None);
    }

    /// Standard errors against derivatives by differences.
    #[test]
    fn errors_by_the_derivatives() {
        let (at, step, h) = (c64::new(0.8, 0.4), 0.02, 1e-6);
        let pole = root(at);
        let mode = Mode::of(&pole, step).unwrap();
        let moved = |by: c64| Mode::of(&root(at + by), step).unwrap();
        let slope = |value: fn(&Mode) -> f64| {
            let along = |by: c64| (value(&moved(by)) - value(&moved(-by))) / (2.0 * h);
            let (re, im) = (along(c64::new(h, 0.0)), along(c64::new(0.0, h)));
            let RootError {
                re: a,
                im: b,
                covariance: c,
                ..
            } = pole.error;
            (re * re * a * a + 2.0 * re * im * c + im * im * b * b).sqrt()
        };
        let frequency = slope(|mode| mode.frequency);
        let damping = slope(|mode| mode.damping);
        assert!((mode.frequency_se / frequency - 1.0).abs() < 1e-7);
        assert!((mode.damping_se / damping - 1.0).abs() < 1e-7);
    }
}
