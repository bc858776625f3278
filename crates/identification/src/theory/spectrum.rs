//! Spectra of inputs that no filter of white numbers has.

use super::missing::NoTheory;
use crate::model::polynomial::divide;
use crate::signal::NoiseFilter;
use faer::c64;
use std::f64::consts::PI;

/// The longest period for which there is theory; the time of its spectrum grows with the square.
pub const LONGEST_PERIOD: usize = 1 << 14;

/// A line of a spectrum, counted with its twin of negative frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// `e^(-i omega)`.
    pub delay: c64,
    /// The mean square of the component of this frequency.
    pub power: f64,
}

/// A spectrum of lines.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// The lines that have power.
    pub lines: Vec<Line>,
    /// Whether it stands for a continuous spectrum of numbers that each trial draws anew, whose fourth moments are not
    /// known. Else the signal is the same in every trial.
    pub is_drawn: bool,
}

impl Spectrum {
    /// The spectrum of a sequence that is repeated: `|sum_k u(k) e^(-i omega k)|^2 / P^2` at `omega = 2 pi m / P`.
    ///
    /// # Errors
    /// [`NoTheory::LongPeriod`].
    pub fn of_period(period: &[f64]) -> Result<Self, NoTheory> {
        let power = |sum: c64| sum.norm_sqr() / (period.len() as f64).powi(2);
        Self::new(period, power, false)
    }

    /// The spectrum of the signs of Gaussian numbers through a filter: the arcsine law gives the autocovariance
    /// `r(t) = (2/pi) asin(rho(t))` for their autocorrelation rho. The lines are those of r repeated with a period at
    /// whose half it has decayed.
    ///
    /// Source: A. Papoulis, *Probability, Random Variables, and Stochastic Processes*, 3rd ed., section 10-2.
    ///
    /// # Errors
    /// [`NoTheory::SlowInput`] if it decays too slowly.
    pub fn of_signs(filter: &NoiseFilter, amplitude: f64) -> Result<Self, NoTheory> {
        const DECAYED: f64 = 1e-12;
        let mut length = 64;
        loop {
            let mut response = filter.numerator().to_vec();
            response.resize(length, 0.0);
            divide(&filter.denominator(), &mut response);
            let of_lag = |lag: usize| -> f64 { response.iter().zip(&response[lag..]).map(|(x, y)| x * y).sum() };
            let covariance: Vec<f64> = (0..length).map(of_lag).collect();
            let late = covariance[length / 2..]
                .iter()
                .fold(0.0, |most: f64, x| most.max(x.abs()));
            if late > DECAYED * covariance[0] {
                length *= 2;
                if length > LONGEST_PERIOD / 2 {
                    return Err(NoTheory::SlowInput);
                }
                continue;
            }
            let correlation = |lag: usize| (covariance[lag] / covariance[0]).clamp(-1.0, 1.0);
            let lags = (0..length).map(|k| correlation(k.min(length - k)));
            let signs: Vec<f64> = lags
                .map(|rho| amplitude * amplitude * 2.0 / PI * libm::asin(rho))
                .collect();
            return Self::new(&signs, |sum| sum.re.max(0.0) / length as f64, true);
        }
    }

    /// The lines of the Fourier sums of a period.
    fn new(period: &[f64], power: impl Fn(c64) -> f64, is_drawn: bool) -> Result<Self, NoTheory> {
        /// A smaller share of the power is rounding.
        const NOTHING: f64 = 1e-26;
        let length = period.len();
        if length > LONGEST_PERIOD {
            return Err(NoTheory::LongPeriod(length));
        }
        let turns: Vec<c64> = (0..length).map(|m| turn(m, length)).collect();
        let line = |m: usize| {
            let (mut sum, mut at) = (c64::new(0.0, 0.0), 0);
            for u in period {
                sum += turns[at] * u;
                at += m;
                at -= if at >= length { length } else { 0 };
            }
            let both = if m == 0 || 2 * m == length { 1.0 } else { 2.0 };
            Line {
                delay: turns[m],
                power: both * power(sum),
            }
        };
        let mut lines: Vec<Line> = (0..=length / 2).map(line).collect();
        let all: f64 = lines.iter().map(|line| line.power).sum();
        lines.retain(|line| line.power > NOTHING * all);
        Ok(Self { lines, is_drawn })
    }

    /// The mean of a signal that is the same in every trial, if it has one, and the other lines.
    pub fn split_mean(mut self) -> (Option<Self>, Self) {
        let is_mean = |line: &mut Line| !self.is_drawn && line.delay == c64::new(1.0, 0.0);
        let lines: Vec<Line> = self.lines.extract_if(.., is_mean).collect();
        let is_drawn = self.is_drawn;
        let mean = (!lines.is_empty()).then_some(Self { lines, is_drawn });
        (mean, self)
    }

    /// The variance, or of a given sequence the mean square.
    pub fn power(&self) -> f64 {
        self.lines.iter().map(|line| line.power).sum()
    }
}

/// `e^(-2 pi i m / length)`.
pub fn turn(m: usize, length: usize) -> c64 {
    let (sin, cos) = libm::sincos(-2.0 * PI * (m % length) as f64 / length as f64);
    c64::new(cos, sin)
}
