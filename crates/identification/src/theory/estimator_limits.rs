//! The limits of estimators with orders of their own, and the covariance of their limit distribution (Ljung, System
//! Identification, 2nd ed., sections 9.3 and 9.4; Soderstrom and Stoica, System Identification, chapter 8).

use super::canonical::{Asymptotic, Shape};
use super::cramer_rao::{bound, box_jenkins, equation_error_gradient, output_error_gradient, plain};
use super::joint_state::{covariance, long_run_covariance};
use super::linear::{Linear, are_orthogonal, invertible, is_regular};
use super::missing::Missing;
use super::noise_model::NoiseModel;
use super::passes::{least_squares, model_instruments, regressors};
use super::population::Population;
use super::signal::Signal;
use crate::model::Orders;

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
pub fn output_error(population: &Population, orders: Orders, by_measured: bool) -> Result<Asymptotic, Missing> {
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
    let g = invertible(sources, &z, &psi)?;
    let products: Vec<_> = z.into_iter().map(|z| (z, error.clone())).collect();
    let s = long_run_covariance(sources, &products)?;
    let covariance = g.solve(&g.solve(&s).transpose());
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
        let moments = invertible(sources, &past, &past)?;
        let l = moments.solve(&covariance(sources, &past, now)?);
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
pub fn delayed_inputs(population: &Population, orders: Orders, extra: usize) -> Result<Asymptotic, Missing> {
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
    let normal = &g.transpose() * &whitened;
    is_regular(&normal)?;
    let k = normal.solve(&whitened.transpose());
    let products: Vec<_> = z.into_iter().map(|z| (z, v.clone())).collect();
    let covariance = &(&k * &long_run_covariance(sources, &products)?) * &k.transpose();
    Ok(shape.asymptotic(&theta, true, &covariance))
}
