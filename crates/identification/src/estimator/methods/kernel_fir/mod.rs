//! The impulse response of a record with a prior that it is smooth and decays, and its reduction to a model `B/F`.
//!
//! `y(k) = g_1 u(k-nk) + ... + g_n u(k-nk-n+1) + e(k)`, `g ~ N(0, c K)`: the estimate is the posterior mean, and the
//! hyperparameters have the greatest marginal likelihood.
//!
//! Sources: T. Chen, H. Ohlsson, L. Ljung, "On the estimation of transfer functions, regularizations and Gaussian
//! processes - revisited", Automatica 48 (2012), 1525-1535; G. Pillonetto, F. Dinuzzo, T. Chen, G. De Nicolao, L.
//! Ljung, "Kernel methods in system identification, machine learning and function estimation: a survey", Automatica 50
//! (2014),
//! 657-682.

mod evidence;
mod kernel;
mod reduced;

use super::output_error_iteration::{check_output_error, output_error};
use crate::estimator::least_value::least;
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::null_space::is_cut;
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::kernels::{Triangle, add_multiple};
use crate::estimator::regression::{Lagged, Rows};
use crate::estimator::solver::rank::{check_rank_of_columns, condition_of_triangle};
use crate::estimator::solver::{Reduction, column};
use crate::estimator::triangular::solve_transposed;
use crate::estimator::{Estimator, FailureKind, Pass, SetupError, SinglePass, Window};
use crate::model::{LARGEST, LinearModel, Orders};
use crate::names::named_enum;
use evidence::{Bidiagonal, Evidence, Variance};
use faer::MatMut;
pub use kernel::Kernel;
use reduced::Reduced;

named_enum! {
    /// Where the noise variance s^2 of a kernel estimate comes from.
    NoiseVariance, "noise variance" {
        /// Least squares without a prior: `RSS / (rows - n)` (the default; both sources).
        LeastSquares = "least-squares",
        /// The marginal likelihood, with the other hyperparameters.
        Likelihood = "likelihood",
    }
}

/// The number of taps, unless half of the samples are fewer, and the most to which they are doubled.
const TAPS: usize = 100;
const MOST_TAPS: usize = 1000;

options! {
    /// The options of `kernel-fir`.
    pub struct KernelFirOptions {
        /// Orders nb, nf and the delay nk of the model to which the response is reduced, such as nb=2,nf=2,nk=1; nf=0:
        /// the response itself, nb taps; by default nb = nf = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The prior of the impulse response: tc (tuned and correlated), dc (diagonal and correlated), ss (stable
        /// spline).
        pub kernel: Kernel,
        /// Taps of the response that is reduced; by default 100, doubled until they hold the response, but at most 1000
        /// and half of the samples.
        pub taps: Option<usize>,
        /// The variance of the noise: least-squares (of the response without a prior), likelihood (as the
        /// hyperparameters).
        pub noise_variance: NoiseVariance,
        /// The equations that are used: prewindow (zeros before the record, the default), complete, padded (zeros
        /// before and after).
        pub rows: Option<Rows>,
    }
}

impl KernelFirOptions {
    fn taps(&self, orders: Orders, window: usize) -> usize {
        if orders.nf == 0 {
            return orders.nb;
        }
        self.taps.unwrap_or(TAPS.min(window / 2).max(1))
    }
}

impl MethodKind for KernelFirOptions {
    fn check(&self) -> Result<(), OptionError> {
        let Some(taps) = self.taps else {
            return check_output_error(self.orders);
        };
        if !(1..=LARGEST).contains(&taps) {
            let message = format!("{taps}; expected 1 to {LARGEST}");
            return Err(OptionError::new("taps", message));
        }
        match self.orders {
            Some(Orders { nf: 0, .. }) => {
                let message = "expected no taps beside nf = 0: the response has nb taps";
                Err(OptionError::new("taps", message))
            }
            orders => check_output_error(orders),
        }
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(output_error(self.orders, setting))
    }

    fn begins_at_rest(&self) -> bool {
        self.rows != Some(Rows::Complete)
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let orders = output_error(self.orders, problem.shape.order);
        Ok(Box::new(KernelFir::new(orders, self, problem.shape.window)?))
    }
}

/// The posterior mean of the taps, `(Phi'Phi + s^2 (c K)^-1)^-1 Phi'y`, with the posterior covariance, given c, alpha
/// (and rho, s^2) of the greatest marginal likelihood. A model `B/F` is then fitted to its noise-free output.
pub struct KernelFir {
    orders: Orders,
    options: KernelFirOptions,
    lagged: Lagged,
    /// `[Phi y] = Q [R z; 0 r]`.
    reduction: Reduction,
    r: Vec<f64>,
    z: Vec<f64>,
    rest: f64,
    /// L, `M = R L`, and its bidiagonal form.
    factor: Vec<f64>,
    m: Vec<f64>,
    bidiagonal: Bidiagonal,
    posterior: Triangle,
    /// The response with its covariance, B alone.
    response: LinearModel,
    reduced: Option<Reduced>,
}

impl KernelFir {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if there are not more equations than taps, or too few samples for the reduction.
    pub fn new(orders: Orders, options: &KernelFirOptions, window: usize) -> Result<Self, SetupError> {
        Self::of_taps(options.taps(orders, window), orders, options, window)
    }

    fn of_taps(n: usize, orders: Orders, options: &KernelFirOptions, window: usize) -> Result<Self, SetupError> {
        let linear = Orders::arx(0, n, orders.nk);
        let rows = options.rows.unwrap_or(Rows::Prewindow);
        let lagged = Lagged::new(linear, linear.reach(), n + 1, rows, window)?;
        let reduced = if orders.nf > 0 {
            Some(Reduced::new(orders, n, window)?)
        } else {
            None
        };
        Ok(Self {
            orders,
            options: options.clone(),
            reduction: Reduction::new(n + 1, lagged.count, 0),
            lagged,
            r: vec![0.0; n * n],
            z: vec![0.0; n],
            rest: f64::NAN,
            factor: Vec::new(),
            m: vec![0.0; n * n],
            bidiagonal: Bidiagonal::default(),
            posterior: Triangle::new(n),
            response: LinearModel::zero(linear),
            reduced,
        })
    }

    /// Reduces the equations of a record; returns what is known of s^2, and whether the taps cut the response.
    fn load(&mut self, u: &[f64], y: &[f64]) -> Result<(Variance, bool), FailureKind> {
        let (n, nk) = (self.z.len(), self.lagged.orders.nk);
        self.lagged.load(u, y);
        let (lagged, start) = (&self.lagged, self.lagged.start());
        let fill = |first: usize, mut z: MatMut<'_, f64>, _: MatMut<'_, f64>| {
            let (k, rows) = (start + first, z.nrows());
            for i in 0..n {
                column(&mut z, i).copy_from_slice(&lagged.u[k - nk - i..][..rows]);
            }
            column(&mut z, n).copy_from_slice(&lagged.y[k..][..rows]);
        };
        self.reduction.run(lagged.count, fill)?;
        let r = self.reduction.r();
        for (j, column) in self.r.chunks_exact_mut(n).enumerate() {
            for (i, to) in column.iter_mut().enumerate() {
                *to = if i <= j { r[(i, j)] } else { 0.0 };
            }
        }
        for (i, z) in self.z.iter_mut().enumerate() {
            *z = r[(i, n)];
        }
        self.rest = r[(n, n)].powi(2);
        let zero = |values: &[f64]| values.iter().all(|value| *value == 0.0);
        if zero(&self.r) || zero(&self.z) && self.rest == 0.0 {
            return Err(FailureKind::Singular);
        }
        let squares = self.z.iter().map(|z| z * z);
        let of_y = squares.clone().sum::<f64>() + self.rest;
        let variance = self.rest / (lagged.count - n) as f64;
        let is_cut = is_cut(squares, variance, of_y);
        if self.options.noise_variance == NoiseVariance::Likelihood {
            return Ok((Variance::Free, is_cut));
        }
        let r = r.get(..n, ..n);
        check_rank_of_columns(condition_of_triangle(r)?, n)?;
        Ok((Variance::Known(variance), is_cut))
    }

    /// Computes `M = R L`, with L in `factor`.
    fn set_prior(&mut self, alpha: f64, rho: f64) -> Result<(), FailureKind> {
        let n = self.z.len();
        let kernel = self.options.kernel;
        kernel.factor(alpha, rho, n, &mut self.factor)?;
        self.m.fill(0.0);
        with_fma!(|| {
            for (l, m) in self.factor.chunks_exact(n).zip(self.m.chunks_exact_mut(n)) {
                for (i, l) in l.iter().enumerate().filter(|(_, l)| **l != 0.0) {
                    add_multiple(*l, &self.r[i * n..], &mut m[..=i]);
                }
            }
        });
        Ok(())
    }

    /// Returns the greatest marginal likelihood of a kernel; a prior that overflows has none.
    fn evidence(&mut self, alpha: f64, rho: f64, variance: Variance) -> Evidence {
        let none = Evidence {
            value: f64::INFINITY,
            mu: f64::NAN,
            variance: f64::NAN,
        };
        if self.set_prior(alpha, rho).is_err() {
            return none;
        }
        self.bidiagonal.reduce(&self.m, &self.z);
        let found = self.bidiagonal.best(self.rest, self.lagged.count as f64, variance);
        if found.value.is_nan() { none } else { found }
    }

    /// Searches the hyperparameters, `alpha = exp(-exp t)` and `rho = tanh r`; returns alpha and rho.
    fn search(&mut self, variance: Variance) -> (f64, f64) {
        let alpha = |t: f64| (-t.exp()).exp();
        let grid = (-11..=2).map(f64::from);
        if self.options.kernel != Kernel::Dc {
            let (t, _) = least(grid, |t| self.evidence(alpha(t), f64::NAN, variance).value);
            return (alpha(t), f64::NAN);
        }
        // From the decay of `tc`, whose rho is sqrt(alpha).
        let tuned = |t: f64| alpha(t).sqrt();
        let (begin, _) = least(grid, |t| self.evidence(alpha(t), tuned(t), variance).value);
        let near = || (-2..=2).map(|i| begin + f64::from(i));
        let mut decay = |r: f64| least(near(), |t| self.evidence(alpha(t), r.tanh(), variance).value);
        let (r, _) = least((-3..=7).map(f64::from), |r| decay(r).1);
        let (t, _) = decay(r);
        (alpha(t), r.tanh())
    }

    /// Computes the response and its covariance; returns the condition of the final triangle.
    fn respond(&mut self, variance: Variance) -> Result<f64, FailureKind> {
        let (alpha, rho) = self.search(variance);
        let Evidence { value, mu, variance } = self.evidence(alpha, rho, variance);
        if !value.is_finite() {
            return Err(FailureKind::NonFinite);
        }
        let n = self.z.len();
        let (m, z, root) = (&self.m, &self.z, mu.sqrt());
        self.posterior.run(2 * n, |j, first, to| {
            for (to, row) in to.iter_mut().zip(first..) {
                *to = match row.checked_sub(n) {
                    None if j < n => m[j * n + row],
                    None => z[row],
                    Some(below) if j == below => root,
                    Some(_) => 0.0,
                };
            }
        })?;
        let mut w = self.posterior.top().to_vec();
        if !self.posterior.solve(&mut w) {
            return Err(FailureKind::Singular);
        }
        let r = self.posterior.r();
        let condition = condition_of_triangle(r)?;
        let response = &mut self.response;
        let taps = &mut response.b[response.delay..];
        taps.fill(0.0);
        for (w, l) in w.iter().zip(self.factor.chunks_exact(n)) {
            for (g, l) in taps.iter_mut().zip(l) {
                *g = w.mul_add(*l, *g);
            }
        }
        // The covariance is s^2 V'V, with V = R^-T L'.
        let column = |i: usize| {
            let mut v: Vec<f64> = (0..n).map(|j| self.factor[j * n + i]).collect();
            solve_transposed(r, &mut v);
            v
        };
        let v: Vec<Vec<f64>> = (0..n).map(column).collect();
        response.covariance.clear();
        let products = v.iter().flat_map(|a| v.iter().map(move |b| (a, b)));
        let products = products.map(|(a, b)| variance * crate::estimator::lag_sums::dot(a, b));
        response.covariance.extend(products);
        response.noise_variance = variance;
        Ok(condition)
    }
}

impl SinglePass for KernelFir {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let Window { u, y, .. } = window;
        let (variance, is_cut) = self.load(u, y)?;
        let longer = (2 * self.z.len()).min(MOST_TAPS).min(y.len() / 2);
        let is_given = self.reduced.is_none() || self.options.taps.is_some();
        if is_cut && !is_given && longer > self.z.len() {
            let longer = Self::of_taps(longer, self.orders, &self.options, y.len());
            if let Ok(mut longer) = longer {
                return longer.fit(window, pass);
            }
        }
        let condition = self.respond(variance)?;
        if let Some(reduced) = &mut self.reduced {
            reduced.run(&self.response, window, pass);
            if is_cut && pass.failure.is_none() {
                pass.model.covariance.clear();
                return Err(FailureKind::Implausible);
            }
            return Ok(());
        }
        let mut e = vec![0.0; y.len()];
        self.response.residuals(u, y, &mut e, &mut vec![0.0; y.len()]);
        pass.loss = e.iter().map(|e| e * e).sum::<f64>() / y.len() as f64;
        pass.set_model(&self.response, condition)?;
        pass.start_at_zero();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
