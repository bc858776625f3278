//! Stationary signals: rational filters of independent white sources.

use super::spectrum::Spectrum;
use crate::model::polynomial::multiply;
use std::sync::Arc;

/// A source: white, or with a spectrum of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Its variance.
    pub variance: f64,
    /// The fourth cumulant over the squared variance: 0 for Gaussian numbers, -2 for random signs.
    pub excess: f64,
    /// Its spectrum; white if absent. No two sources have a line of the same frequency.
    pub spectrum: Option<Arc<Spectrum>>,
}

impl Source {
    /// A white source.
    pub const fn white(variance: f64, excess: f64) -> Self {
        Self {
            variance,
            excess,
            spectrum: None,
        }
    }

    /// A source with a spectrum of lines.
    pub fn lines(spectrum: Spectrum) -> Self {
        Self {
            variance: spectrum.power(),
            excess: 0.0,
            spectrum: Some(Arc::new(spectrum)),
        }
    }
}

/// `sum_s N_s(q) / D_s(q) w_s(k)` over the sources w_s, one part per term; polynomials in q^-1, D monic.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signal {
    pub(super) parts: Vec<Part>,
}

/// A source through one filter.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    pub(super) source: usize,
    pub(super) numerator: Vec<f64>,
    pub(super) denominator: Vec<f64>,
}

impl Signal {
    /// A source through `numerator / denominator`.
    pub fn new(source: usize, numerator: &[f64], denominator: &[f64]) -> Self {
        let mut signal = Self::default();
        signal.add(source, numerator.to_vec(), trimmed(denominator.to_vec()));
        signal
    }

    fn add(&mut self, source: usize, numerator: Vec<f64>, denominator: Vec<f64>) {
        let same = |part: &&mut Part| part.source == source && part.denominator == denominator;
        if let Some(part) = self.parts.iter_mut().find(same) {
            let length = part.numerator.len().max(numerator.len());
            part.numerator.resize(length, 0.0);
            for (sum, more) in part.numerator.iter_mut().zip(&numerator) {
                *sum += more;
            }
        } else if numerator.iter().any(|c| *c != 0.0) {
            self.parts.push(Part {
                source,
                numerator,
                denominator,
            });
        }
    }

    /// Passes the signal through a further filter.
    #[must_use]
    pub fn through(&self, numerator: &[f64], denominator: &[f64]) -> Self {
        let mut result = Self::default();
        for part in &self.parts {
            let bottom = trimmed(multiply(&part.denominator, denominator));
            result.add(part.source, multiply(&part.numerator, numerator), bottom);
        }
        result
    }

    /// `x(k - lag)`.
    #[must_use]
    pub fn delayed(&self, lag: usize) -> Self {
        let mut delay = vec![0.0; lag + 1];
        delay[lag] = 1.0;
        self.through(&delay, &[1.0])
    }

    /// `self + factor other`.
    #[must_use]
    pub fn plus(mut self, factor: f64, other: &Self) -> Self {
        for part in &other.parts {
            let numerator = part.numerator.iter().map(|c| factor * c).collect();
            self.add(part.source, numerator, part.denominator.clone());
        }
        self
    }

    /// The part that comes from some sources.
    fn part_from(&self, are_meant: impl Fn(usize) -> bool) -> Self {
        let parts = self.parts.iter().filter(|part| are_meant(part.source));
        Self {
            parts: parts.cloned().collect(),
        }
    }

    /// The part that comes from one source.
    #[must_use]
    pub fn from_source(&self, source: usize) -> Self {
        self.part_from(|of| of == source)
    }

    /// Returns the signal from rest if every source is this sequence.
    pub(super) fn course(&self, w: &[f64]) -> Vec<f64> {
        let mut course = vec![0.0; w.len()];
        for part in &self.parts {
            let mut x = w.to_vec();
            for k in 0..w.len() {
                let bottom = part.denominator.iter().enumerate().skip(1).take(k);
                x[k] -= bottom.map(|(i, d)| d * x[k - i]).sum::<f64>();
                let top = part.numerator.iter().enumerate().take(k + 1);
                course[k] += top.map(|(i, c)| c * x[k - i]).sum::<f64>();
            }
        }
        course
    }

    /// The part that comes from white sources.
    #[must_use]
    pub fn from_white(&self, sources: &[Source]) -> Self {
        self.part_from(|of| sources[of].spectrum.is_none())
    }

    /// The lags `sign x(k-first) ... sign x(k-first-count+1)` of the signal x.
    pub fn lags(&self, sign: f64, first: usize, count: usize) -> Vec<Self> {
        let lag = |i: usize| Self::default().plus(sign, &self.delayed(first + i));
        (0..count).map(lag).collect()
    }
}

/// The polynomial without trailing zeros.
fn trimmed(mut polynomial: Vec<f64>) -> Vec<f64> {
    while polynomial.len() > 1 && polynomial.last() == Some(&0.0) {
        polynomial.pop();
    }
    polynomial
}
