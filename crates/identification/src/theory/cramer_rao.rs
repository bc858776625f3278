//! Cramer-Rao bounds: `P = lambda (E psi psi')^-1`, with psi the negative gradient of
//! the stationary prediction error (Ljung, System Identification, 2nd ed., sections 9.3 and 9.4).

use super::canonical::Shape;
use super::joint_state::covariance;
use super::joint_state::is_stable;
use super::linear::is_regular;
use super::matrix::Matrix;
use super::missing::Missing;
use super::noise_model::{NoiseModel, lowest_terms};
use super::passes::regressors;
use super::population::Population;
use super::signal::Signal;
use crate::model::polynomial::divide;
use crate::model::{LinearModel, Orders};

/// Checks that a filter of the predictor is stable.
fn stable(polynomial: &[f64]) -> Result<&[f64], Missing> {
    if is_stable(polynomial) {
        Ok(polynomial)
    } else {
        Err(Missing::UnstableModel)
    }
}

pub(super) fn plain(population: &Population) -> Result<(), Missing> {
    if population.is_plain {
        Ok(())
    } else {
        Err(Missing::OtherNoise)
    }
}

/// The first `count` rows and columns of `lambda (E psi psi')^-1`. If lambda is 0, the noise's parameters are left out
/// and the bound is 0.
pub(super) fn bound(population: &Population, psi: &[Signal], count: usize, lambda: f64) -> Result<Matrix, Missing> {
    let psi = if lambda > 0.0 { psi } else { &psi[..count] };
    let information = covariance(&population.sources, psi, psi)?;
    is_regular(&information)?;
    let inverse = information.solve(&Matrix::identity(psi.len()));
    Ok(Matrix::from_fn(count, count, |i, j| {
        0.5 * lambda * (inverse[(i, j)] + inverse[(j, i)])
    }))
}

/// psi of A and B in `e = D/C (A y - B u)`, then of `counts` coefficients of C and D.
pub(super) fn equation_error_gradient(
    population: &Population,
    shape: Shape,
    (c, d): (&[f64], &[f64]),
    innovation: &Signal,
    counts: [usize; 2],
) -> Result<Vec<Signal>, Missing> {
    let (y, u) = (&population.y, &population.u);
    stable(c)?;
    let mut psi = regressors(&y.through(d, c), &u.through(d, c), shape);
    psi.extend(noise_gradient((c, d), innovation, counts)?);
    Ok(psi)
}

/// psi of C and D in `e = D/C x`: `e(k-i) / C` and `-e(k-i) / D`.
fn noise_gradient((c, d): (&[f64], &[f64]), innovation: &Signal, [nc, nd]: [usize; 2]) -> Result<Vec<Signal>, Missing> {
    let mut psi = innovation.through(&[1.0], stable(c)?).lags(1.0, 1, nc);
    psi.extend(innovation.through(&[1.0], stable(d)?).lags(-1.0, 1, nd));
    Ok(psi)
}

/// psi of F and B in `e = D/C (y - B/F u)`.
pub(super) fn output_error_gradient(
    population: &Population,
    shape: Shape,
    (c, d): (&[f64], &[f64]),
) -> Result<Vec<Signal>, Missing> {
    let Population { alpha, beta, u, .. } = population;
    let u = u.through(d, stable(c)?).through(&[1.0], stable(alpha)?);
    let x = u.through(beta, alpha);
    Ok(regressors(&x, &u, shape))
}

/// The gradient psi of the model with the orders of the truth, and what its parameters are.
pub struct TrueModel {
    /// psi of the plant's parameters, A before F before B, then of the noise's.
    pub psi: Vec<Signal>,
    /// The derivative of `p = (alpha, beta)` with respect to the plant's parameters.
    pub slopes: Matrix,
    /// The model itself, with the variance of the innovations.
    pub model: LinearModel,
}

impl TrueModel {
    /// The model if plant and noise share their common poles: `A y = B/F u + C/D e`, all in lowest terms and with the
    /// orders of the truth. Under 1/A noise F, C and D are 1; without a common pole A is 1.
    ///
    /// # Errors
    /// [`Missing`].
    pub fn new(population: &Population) -> Result<Self, Missing> {
        plain(population)?;
        let noise = NoiseModel::new(population)?;
        let Population { alpha, beta, y, u, .. } = population;
        let (f, d) = lowest_terms(alpha, &noise.d);
        let (n, nf) = (alpha.len() - 1, f.len() - 1);
        let na = n - nf;
        // alpha / F; the remainder is zero.
        let mut a = alpha.clone();
        divide(&f, &mut a);
        a.truncate(na + 1);
        let c = stable(&noise.c)?;
        let [y, u] = [y, u].map(|signal| signal.through(&d, c));
        let u = u.through(&[1.0], stable(&f)?);
        let mut psi = y.lags(-1.0, 1, na);
        psi.extend(u.through(beta, &f).lags(-1.0, 1, nf));
        psi.extend(u.lags(1.0, 1, n));
        let [nc, nd] = [c.len() - 1, d.len() - 1];
        psi.extend(noise_gradient((c, &d), &noise.innovation, [nc, nd])?);
        // alpha = A F.
        let at = |c: &[f64], i: usize, j: usize| i.checked_sub(j).and_then(|i| c.get(i)).copied();
        let slopes = Matrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j) {
            (true, j) if j < na => at(&f, i, j).unwrap_or(0.0),
            (true, j) if j < n => at(&a, i, j - na).unwrap_or(0.0),
            _ => f64::from(u8::from(i == j && i >= n)),
        });
        let orders = Orders {
            na,
            nb: n,
            nc,
            nd,
            nf,
            nk: 1,
        };
        let model = LinearModel {
            b: beta.clone(),
            noise_variance: noise.variance,
            a,
            c: noise.c,
            d,
            f,
            ..LinearModel::zero(orders)
        };
        Ok(Self { psi, slopes, model })
    }
}

/// The bound of [`TrueModel`].
///
/// # Errors
/// [`Missing`].
pub fn shared_bound(population: &Population) -> Result<Matrix, Missing> {
    let TrueModel { psi, slopes, model } = TrueModel::new(population)?;
    if model.orders().na == 0 {
        return separate_bound(population);
    }
    let covariance = bound(population, &psi, slopes.nrows(), model.noise_variance)?;
    Ok(&(&slopes * &covariance) * &slopes.transpose())
}

/// The bound if the noise has its own model: `y = B/A u + C/D e`.
///
/// # Errors
/// [`Missing`].
pub fn separate_bound(population: &Population) -> Result<Matrix, Missing> {
    plain(population)?;
    let noise = NoiseModel::new(population)?;
    let n = population.plant.order();
    box_jenkins(
        population,
        &noise,
        Shape::new(Orders::arx(n, n, 1)),
        [noise.c.len() - 1, noise.d.len() - 1],
    )
}

/// In open loop the estimates of the noise's and the plant's parameters are uncorrelated.
pub(super) fn box_jenkins(
    population: &Population,
    noise: &NoiseModel,
    shape: Shape,
    counts: [usize; 2],
) -> Result<Matrix, Missing> {
    let filters = (noise.c.as_slice(), noise.d.as_slice());
    let mut psi = output_error_gradient(population, shape, filters)?;
    let count = psi.len();
    if population.feedback.is_some() {
        psi.extend(noise_gradient(filters, &noise.innovation, counts)?);
    }
    bound(population, &psi, count, noise.variance)
}

/// Instrumental variables with optimal instruments, `lambda (E phi_H phi_H')^-1`. phi_H is the part of the regressors
/// due to the reference, filtered by `1/H`, where the equation error is `H e` (Soderstrom and Stoica, System
/// Identification, section 8.2).
///
/// # Errors
/// [`Missing`].
pub fn optimal_instruments(population: &Population) -> Result<Matrix, Missing> {
    plain(population)?;
    let noise = NoiseModel::new(population)?;
    let (c, d) = noise.equation_error(&population.alpha);
    stable(&c)?;
    let of_reference = |signal: &Signal| Population::part_of_reference(signal).through(&d, &c);
    let n = population.plant.order();
    let shape = Shape::new(Orders::arx(n, n, 1));
    let (y, u) = (of_reference(&population.y), of_reference(&population.u));
    bound(population, &regressors(&y, &u, shape), 2 * n, noise.variance)
}
