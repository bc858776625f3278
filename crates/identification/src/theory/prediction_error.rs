//! Prediction-error estimates and Cramer-Rao bounds: `P = lambda (E psi psi')^-1`, with psi the negative gradient of
//! the stationary prediction error (Ljung, System Identification, 2nd ed., sections 9.3 and 9.4).

use super::canonical::{Asymptotic, Shape};
use super::joint_state::is_stable;
use super::joint_state::{covariance, long_run_covariance};
use super::linear::{Linear, are_orthogonal, invertible, is_regular};
use super::missing::Missing;
use super::noise_model::{NoiseModel, lowest_terms};
use super::passes::{least_squares, model_instruments, regressors};
use super::population::Population;
use super::signal::Signal;
use crate::model::Orders;
use crate::model::polynomial::divide;
use faer::Mat;
use faer::linalg::solvers::Solve;

/// Checks that a filter of the predictor is stable.
fn stable(polynomial: &[f64]) -> Result<&[f64], Missing> {
    if is_stable(polynomial) {
        Ok(polynomial)
    } else {
        Err(Missing::UnstableModel)
    }
}

fn plain(population: &Population) -> Result<(), Missing> {
    if population.is_plain {
        Ok(())
    } else {
        Err(Missing::OtherNoise)
    }
}

/// The first `count` rows and columns of `lambda (E psi psi')^-1`. If lambda is 0, the noise's parameters are left out
/// and the bound is 0.
fn bound(
    population: &Population,
    psi: &[Signal],
    count: usize,
    lambda: f64,
) -> Result<Mat<f64>, Missing> {
    let psi = if lambda > 0.0 { psi } else { &psi[..count] };
    let information = covariance(&population.sources, psi, psi)?;
    is_regular(&information)?;
    let unit = Mat::<f64>::identity(psi.len(), psi.len());
    let inverse = information.partial_piv_lu().solve(&unit);
    Ok(Mat::from_fn(count, count, |i, j| {
        0.5 * lambda * (inverse[(i, j)] + inverse[(j, i)])
    }))
}

/// psi of A and B in `e = D/C (A y - B u)`, then of `counts` coefficients of C and D.
fn equation_error_gradient(
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
fn noise_gradient(
    (c, d): (&[f64], &[f64]),
    innovation: &Signal,
    [nc, nd]: [usize; 2],
) -> Result<Vec<Signal>, Missing> {
    let mut psi = innovation.through(&[1.0], stable(c)?).lags(1.0, 1, nc);
    psi.extend(innovation.through(&[1.0], stable(d)?).lags(-1.0, 1, nd));
    Ok(psi)
}

/// psi of F and B in `e = D/C (y - B/F u)`.
fn output_error_gradient(
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
    /// Its orders.
    pub orders: Orders,
    /// The derivative of `p = (alpha, beta)` with respect to the plant's parameters.
    pub slopes: Mat<f64>,
    /// The variance of the innovations.
    pub variance: f64,
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
        let Population {
            alpha, beta, y, u, ..
        } = population;
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
        let slopes = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j) {
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
        Ok(Self {
            psi,
            orders,
            slopes,
            variance: noise.variance,
        })
    }
}

/// The bound of [`TrueModel`].
///
/// # Errors
/// [`Missing`].
pub fn shared_bound(population: &Population) -> Result<Mat<f64>, Missing> {
    let model = TrueModel::new(population)?;
    if model.orders.na == 0 {
        return separate_bound(population);
    }
    let TrueModel { psi, slopes, .. } = &model;
    let covariance = bound(population, psi, slopes.nrows(), model.variance)?;
    Ok(slopes * covariance * slopes.transpose())
}

/// The bound if the noise has its own model: `y = B/A u + C/D e`.
///
/// # Errors
/// [`Missing`].
pub fn separate_bound(population: &Population) -> Result<Mat<f64>, Missing> {
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
fn box_jenkins(
    population: &Population,
    noise: &NoiseModel,
    shape: Shape,
    counts: [usize; 2],
) -> Result<Mat<f64>, Missing> {
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
pub fn optimal_instruments(population: &Population) -> Result<Mat<f64>, Missing> {
    plain(population)?;
    let noise = NoiseModel::new(population)?;
    let (c, d) = noise.equation_error(&population.alpha);
    stable(&c)?;
    let of_reference = |signal: &Signal| Population::part_of_reference(signal).through(&d, &c);
    let n = population.plant.order();
    let shape = Shape::new(Orders::arx(n, n, 1));
    let (y, u) = (of_reference(&population.y), of_reference(&population.u));
    bound(
        population,
        &regressors(&y, &u, shape),
        2 * n,
        noise.variance,
    )
}

fn truth(population: &Population, shape: Shape) -> Result<Vec<f64>, Missing> {
    shape.truth(population).ok_or(Missing::Structure)
}

/// The limit of `armax`.
///
/// # Errors
/// [`Missing`].
pub fn armax(population: &Population, orders: Orders) -> Result<Asymptotic, Missing> {
    plain(population)?;
    let shape = Shape::new(orders);
    let theta = truth(population, shape)?;
    let noise = NoiseModel::new(population)?;
    let (c, d) = noise.equation_error(&population.alpha);
    if c.len() - 1 > orders.nc || d.len() > 1 {
        return Err(Missing::Structure);
    }
    let counts = [orders.nc, 0];
    let psi = equation_error_gradient(population, shape, (&c, &d), &noise.innovation, counts)?;
    let covariance = bound(population, &psi, theta.len(), noise.variance)?;
    Ok(shape.asymptotic(&theta, true, &covariance))
}

/// The limit of `bj`.
///
/// # Errors
/// [`Missing`].
pub fn bj(population: &Population, orders: Orders) -> Result<Asymptotic, Missing> {
    plain(population)?;
    let shape = Shape::new(orders);
    let theta = truth(population, shape)?;
    let noise = NoiseModel::new(population)?;
    if noise.c.len() - 1 > orders.nc || noise.d.len() - 1 > orders.nd {
        return Err(Missing::Structure);
    }
    let covariance = box_jenkins(population, &noise, shape, [orders.nc, orders.nd])?;
    Ok(shape.asymptotic(&theta, true, &covariance))
}

/// The limits of `oe` and `sriv`, which solve `sum psi (y - B/F u) = 0`, and of `stmcb`, whose left factor has y
/// instead of the model's output. The noise may have any colour if it is uncorrelated with the left factor.
///
/// # Errors
/// [`Missing`].
pub fn output_error(
    population: &Population,
    orders: Orders,
    by_measured: bool,
) -> Result<Asymptotic, Missing> {
    let shape = Shape::new(orders);
    let theta = truth(population, shape)?;
    let psi = output_error_gradient(population, shape, (&[1.0], &[1.0]))?;
    let z = if by_measured {
        let by = |signal: &Signal| signal.through(&[1.0], &population.alpha);
        regressors(&by(&population.y), &by(&population.u), shape)
    } else {
        psi.clone()
    };
    let (sources, error) = (&population.sources, &population.output_error);
    if !are_orthogonal(sources, &z, error)? {
        return Err(Missing::Biased);
    }
    let factors = invertible(sources, &z, &psi)?;
    let products: Vec<_> = z.into_iter().map(|z| (z, error.clone())).collect();
    let s = long_run_covariance(sources, &products)?;
    let half = factors.solve(&s);
    let covariance = factors.solve(half.transpose());
    Ok(shape.asymptotic(&theta, true, &covariance))
}

/// The limit of `iv4`: the instruments of the true model, and the prefilter L, an autoregression of the equation error.
///
/// # Errors
/// [`Missing`].
pub fn four_steps(population: &Population, orders: Orders) -> Result<Asymptotic, Missing> {
    let shape = Shape::new(orders);
    let theta = truth(population, shape)?;
    let Population {
        y,
        u,
        equation_error: v,
        sources,
        ..
    } = population;
    let first = least_squares(population, shape)?;
    let z = model_instruments(&first.theta, shape, u)?;
    let phi = regressors(y, u, shape);
    let second = Linear::new(population, &z, &phi, y, Some((theta.clone(), v)))?;
    if !second.is_consistent {
        return Err(Missing::Biased);
    }
    let count = orders.na + orders.nb;
    let (now, past) = (std::slice::from_ref(v), v.lags(-1.0, 1, count));
    let mut filter = vec![0.0; count + 1];
    filter[0] = 1.0;
    if covariance(sources, now, now)?[(0, 0)] > 0.0 {
        let factors = invertible(sources, &past, &past)?;
        let l = factors.solve(&covariance(sources, &past, now)?);
        for (i, filter) in filter[1..].iter_mut().enumerate() {
            *filter = l[(i, 0)];
        }
    }
    let by = |signal: &Signal| signal.through(&filter, &[1.0]);
    let z = model_instruments(&theta, shape, &by(u))?;
    let phi = regressors(&by(y), &by(u), shape);
    let last = Linear::new(population, &z, &phi, &by(y), Some((theta, &by(v))))?;
    if !last.is_consistent {
        return Err(Missing::Biased);
    }
    let covariance = last.influence.covariance(sources)?;
    Ok(shape.asymptotic(&last.theta, true, &covariance))
}

/// The limit of `iv-delayed`, two-stage least squares: `K S K'`, `K = (G'W^-1 G)^-1 G'W^-1`, `G = E[z phi']`,
/// `W = E[z z']`, with S the long-run covariance of `z v`.
///
/// # Errors
/// [`Missing`].
pub fn delayed_inputs(
    population: &Population,
    orders: Orders,
    extra: usize,
) -> Result<Asymptotic, Missing> {
    let shape = Shape::new(orders);
    let theta = truth(population, shape)?;
    let Population {
        y,
        u,
        equation_error: v,
        sources,
        ..
    } = population;
    let z = u.lags(1.0, orders.nk, orders.nb + orders.na + extra);
    if !are_orthogonal(sources, &z, v)? {
        return Err(Missing::Biased);
    }
    let phi = regressors(y, u, shape);
    let g = covariance(sources, &z, &phi)?;
    let whitened = invertible(sources, &z, &z)?.solve(&g);
    let normal = g.transpose() * &whitened;
    is_regular(&normal)?;
    let k = normal.partial_piv_lu().solve(whitened.transpose());
    let products: Vec<_> = z.into_iter().map(|z| (z, v.clone())).collect();
    let covariance = &k * long_run_covariance(sources, &products)? * k.transpose();
    Ok(shape.asymptotic(&theta, true, &covariance))
}
