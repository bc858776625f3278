//! The Fisher information of a record, and the distance of an estimate from the truth in its metric.

use super::cramer_rao::TrueModel;
use super::errors_in_variables::errors_in_variables;
use super::joint_state::covariance;
use super::linear::without_noise;
use super::matrix::Matrix;
use super::missing::{Missing, NoTheory};
use super::population::{NOISE, Population, REFERENCE};
use super::signal::Signal;
use crate::data::{NoiseColour, Process};
use crate::model::Orders;
use crate::model::polynomial::extent;
use crate::signal::Input;

/// The Fisher information `F = N E[psi psi'] / lambda` of a record of N samples about `p = (alpha, beta)`, with the
/// noise's parameters unknown: the Schur complement of their block. psi is that of `A y = B/F u + C/D e` with the
/// orders of the truth, all in lowest terms. Where the reference is given sample by sample, what comes from it is
/// summed over the record, from rest.
///
/// For an estimate theta_hat of the p free coefficients that reaches the Cramer-Rao bound,
///
/// ```text
/// d = (theta_hat - theta)' F (theta_hat - theta) / p
/// ```
///
/// is chi-squared with p degrees of freedom over p as N grows, of mean 1.
///
/// Innovations of heavy tails say more: F is that times [`crate::signal::NoiseLaw::information`] of their density.
/// Where the input is measured with noise, F is that of the spectra of u and y, with the variances of input and noises
/// unknown:
/// `errors_in_variables.rs`.
///
/// Everything is stationary here; [`super::OwnInformation`] is that of each record, from rest.
///
/// Source: Ljung, System Identification, 2nd ed., sections 7.4 and 9.3.
#[derive(Clone, Debug)]
pub struct FisherInformation {
    /// F, 2n x 2n, about `alpha_1 ... alpha_n, beta_1 ... beta_n`.
    pub matrix: Matrix,
    /// The orders of the truth, `A y = B/F u + C/D e` in lowest terms, with its delay and without zeros at the ends of
    /// its polynomials.
    pub orders: Orders,
}

impl FisherInformation {
    /// Computes the information of a record of `window` samples at noise level `eta`, in per cent.
    ///
    /// # Errors
    /// [`Missing`].
    pub fn new(process: &Process, eta: f64, window: usize) -> Result<Self, Missing> {
        let population = Population::of_record(process, eta)?;
        if process.settings().input_noise > 0.0 {
            return Ok(Self {
                matrix: errors_in_variables(process, &population, window)?,
                orders: output_error_orders(&population),
            });
        }
        let TrueModel { psi, slopes, model } = TrueModel::new(&population)?;
        if !(model.noise_variance > 0.0) {
            return Err(Missing::Singular);
        }
        let moments = moments(process, &population, &psi, window)?;
        let of_plant = without_noise(&moments, slopes.nrows())?;
        let density = match &process.settings().noise {
            NoiseColour::InverseDenominator => Some(1.0),
            NoiseColour::Filter(filter) => filter.law().information(),
        };
        let density = density.ok_or(NoTheory::NotGaussian)?;
        let scale = 0.5 * window as f64 * density / model.noise_variance;
        let orders = without_zeros(model.orders(), &population);
        Self::about_p(&of_plant, &slopes, scale, orders)
    }

    /// The information about p, `S^-T F S^-1`, from twice the scale, F about the plant's parameters and
    /// `S = dp / d(parameters)`.
    pub(super) fn about_p(of_plant: &Matrix, slopes: &Matrix, scale: f64, orders: Orders) -> Result<Self, Missing> {
        let count = slopes.nrows();
        let inverse = slopes.solve(&Matrix::identity(count));
        let about_p = &(&inverse.transpose() * of_plant) * &inverse;
        let matrix = Matrix::from_fn(count, count, |i, j| scale * (about_p[(i, j)] + about_p[(j, i)]));
        if !matrix.is_all_finite() {
            return Err(Missing::Singular);
        }
        Ok(Self { matrix, orders })
    }

    /// The number p of free coefficients of the plant.
    pub fn free(&self) -> usize {
        let Orders { na, nb, nf, .. } = self.orders;
        na + nb + nf
    }

    /// The places of the free coefficients among `alpha_1 ... alpha_n, beta_1 ... beta_n`, and F about them.
    pub(super) fn of_free(&self) -> (Vec<usize>, Matrix) {
        let n = self.matrix.nrows() / 2;
        let Orders { na, nb, nf, nk, .. } = self.orders;
        let first = (n + nk).saturating_sub(1);
        let free: Vec<usize> = (0..(na + nf).min(n)).chain(first..first + nb).collect();
        let part = Matrix::from_fn(free.len(), free.len(), |i, j| self.matrix[(free[i], free[j])]);
        (free, part)
    }

    /// Returns the standard deviation at the Cramer-Rao bound of coefficient i of `a_1 ... a_n, h_1 ... h_n`; `None` if
    /// it is not free.
    pub fn deviation(&self, i: usize) -> Option<f64> {
        let n = self.matrix.nrows() / 2;
        let column = |i: usize| if i < n { n - 1 - i } else { i };
        let (free, part) = self.of_free();
        let place = free.iter().position(|of| *of == column(i))?;
        let unit = Matrix::from_fn(free.len(), 1, |i, _| f64::from(u8::from(i == place)));
        let variance = part.solve(&unit)[(place, 0)];
        (variance > 0.0).then(|| variance.sqrt())
    }

    /// Returns d of an estimate from the paper's a and h and those of the truth. The coefficients that a model of a
    /// smaller order leaves out are zero; NaN if its order is larger.
    pub fn distance(&self, [a, h]: [&[f64]; 2], [true_a, true_h]: [&[f64]; 2]) -> f64 {
        let n = self.matrix.nrows() / 2;
        if a.len() != h.len() || a.len() > n || [true_a, true_h].iter().any(|of| of.len() != n) {
            return f64::NAN;
        }
        // alpha_i = -a_(m+1-i) of a model of order m.
        let alpha = |a: &[f64], i: usize| a.len().checked_sub(i + 1).map_or(0.0, |place| -a[place]);
        let beta = |h: &[f64], i: usize| h.get(i).copied().unwrap_or(0.0);
        let error = |i: usize| match i.checked_sub(n) {
            None => alpha(a, i) - alpha(true_a, i),
            Some(i) => beta(h, i) - beta(true_h, i),
        };
        let row = |i: usize| -> f64 { (0..2 * n).map(|j| self.matrix[(i, j)] * error(j)).sum() };
        let square: f64 = (0..2 * n).map(|i| error(i) * row(i)).sum();
        square / self.free() as f64
    }
}

/// `E[psi psi']`, or the mean over a record whose reference is given.
fn moments(process: &Process, population: &Population, psi: &[Signal], window: usize) -> Result<Matrix, Missing> {
    let Input::Samples(samples) = process.input() else {
        return Ok(covariance(&population.sources, psi, psi)?);
    };
    let reference: Vec<f64> = samples.iter().copied().cycle().take(window).collect();
    let of_noise: Vec<Signal> = psi.iter().map(|psi| psi.from_source(NOISE)).collect();
    let mut moments = covariance(&population.sources, &of_noise, &of_noise)?;
    let courses: Vec<Vec<f64>> = psi
        .iter()
        .map(|psi| psi.from_source(REFERENCE).course(&reference))
        .collect();
    for (i, a) in courses.iter().enumerate() {
        for (j, b) in courses.iter().enumerate() {
            let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            moments[(i, j)] += sum / window as f64;
        }
    }
    Ok(moments)
}

/// The orders of `y = B/F u + e`.
pub(super) fn output_error_orders(population: &Population) -> Orders {
    let n = population.plant.order();
    let Orders { na, nb, nk, .. } = without_zeros(Orders::arx(n, n, 1), population);
    Orders::output_error(nb, na, nk)
}

/// The orders without the zeros that pad alpha and beta to the plant's order.
pub(super) fn without_zeros(orders: Orders, population: &Population) -> Orders {
    let Population { alpha, beta, .. } = population;
    let (first, last) = extent(beta).unwrap_or((1, 1));
    let padding = alpha.iter().rev().take_while(|a| **a == 0.0).count();
    Orders {
        na: orders.na.saturating_sub(padding),
        nb: last + 1 - first,
        nk: first,
        ..orders
    }
}
