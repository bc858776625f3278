//! Subspace identification with past inputs and outputs as instruments (PO-MOESP; Verhaegen 1994).
//!
//! Block Hankel matrices of s rows are `U_f, U_p, Y_p, Y_f` (future and past), with `[U_f; U_p; Y_p; Y_f] = L Q`. Take
//! the block of L in the rows of `Y_f` and the columns of the past. Its left singular vectors span the range of the
//! extended observability matrix. C is the first row of that matrix, and A follows from its shift.

use super::state_sequence::innovations::characteristic;
use crate::estimator::chosen::{Chosen, OrderRule};
use crate::estimator::excitation::excited_rows;
use crate::estimator::hankel::{Delays, Hankel};
use crate::estimator::lag_sums::dot;
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::null_space::HighOrder;
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::kernels::{Triangle, add_multiple, copy_delayed, divide_each};
use crate::estimator::reflection::{Stabilise, reflect_zeros, stable};
use crate::estimator::solver::rank::{check_rank_of_columns, condition_of_triangle};
use crate::estimator::{Estimator, FailureKind, Pass, SetupError, SinglePass, Window};
use crate::model::{LinearModel, Orders};
use crate::names::named_enum;
use crate::signal::arithmetic::variance;
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::solvers::SolveLstsq;
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, Par};

named_enum! {
    /// The weighting of the oblique projection `O` of the future outputs on the past along the future inputs; `P`
    /// projects the future inputs out (Van Overschee and De Moor, *Subspace Identification for Linear Systems*, 1996,
    /// table 4.1).
    Weights, "weighting" {
        /// Each of the others, whichever output is closest to y, that of a stable model if there is one (the default).
        Auto = "auto",
        /// `O` itself.
        N4sid = "n4sid",
        /// `O P`.
        Moesp = "moesp",
        /// `(Y_f P Y_f')^(-1/2) O P`: canonical variates, the correlations of future outputs with the past.
        Cva = "cva",
    }
}

named_enum! {
    /// The conventions of another tool.
    SubspaceReading, "reading" {
        /// SIPPY: the first sample is subtracted from u and y, and both are divided by their standard deviations.
        Sippy = "sippy",
    }
}

/// The largest number of block rows.
const MOST_ROWS: usize = 200;

/// Defines the options of a method; both methods have almost the same.
macro_rules! subspace {
    ($options:ident, $doc:literal, [$($weights:ident)?], $weighting:expr) => {
        options! {
            #[doc = $doc]
            pub struct $options {
                /// The order n and the delay nk, 0 (D is estimated) or 1, such as n=4,nk=0; by default n is the setting
                /// `order`, nk = 1.
                pub orders: Option<Orders>,
                /// Block rows s of the future and of the past, more than n; by default chosen for each record: k, 3/2 k
                /// or 2 k, k being the order of `A y = B u + e` by AIC, whichever output is closest to y.
                pub block_rows: Option<usize>,
                /// The treatment of an unstable A: none (the default), reflect (its eigenvalues into the unit circle).
                pub stabilise: Stabilise,
                /// The conventions of another tool: sippy, which subtracts the first sample from u and y and divides
                /// them by their standard deviations.
                pub reading: Option<SubspaceReading>,
                /// Chooses the order, from 1 to that of `orders`: bic, aicc, aic, fpe, cross-validation (errors over
                /// the last third of a model of the first two).
                pub choose: Option<OrderRule>,
                $(
                    /// The weighting whose left singular vectors are taken: auto (that of the others whose output is
                    /// closest to y, of the stable models if there is one), n4sid (the oblique projection itself),
                    /// moesp (future inputs projected out, as SLICOT's N4SID), cva (canonical variates).
                    pub $weights: Weights,
                )?
            }
        }

        impl $options {
            fn orders(&self, order: usize) -> Orders {
                let given = self.orders.unwrap_or(Orders::arx(order, order, 1));
                model_orders(given.na.max(given.nf), given.nk)
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                check(self.orders, self.block_rows)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(self.orders(setting))
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = self.orders(problem.shape.order);
                if let Some(rule) = self.choose {
                    return Chosen::prepare(rule, orders.nf, problem, |n| Self {
                        orders: Some(model_orders(n, orders.nk)),
                        choose: None,
                        ..self.clone()
                    });
                }
                let window = problem.shape.window;
                let weighting: fn(&Self) -> Weights = $weighting;
                let (rows, weights) = (self.block_rows, weighting(self));
                Ok(Box::new(Subspace {
                    stabilise: self.stabilise,
                    reading: self.reading,
                    ..Subspace::new(orders, rows, weights, window)?
                }))
            }
        }
    };
}

subspace!(MoespOptions, "The options of `moesp`.", [], |_| { Weights::Moesp });
subspace!(N4sidOptions, "The options of `n4sid`.", [weights], |options| {
    options.weights
});

/// Returns the orders of a model of order n.
fn model_orders(n: usize, nk: usize) -> Orders {
    Orders::output_error(n + 1 - nk.min(1), n, nk)
}

/// Checks the options of a subspace method.
pub(super) fn check(orders: Option<Orders>, block_rows: Option<usize>) -> Result<(), OptionError> {
    let n = orders.map_or(0, |orders| orders.na.max(orders.nf));
    if let Some(given) = orders {
        let nk = given.nk;
        let known = given == Orders::arx(n, n, nk) || given == model_orders(n, nk);
        if n == 0 || nk > 1 || !known {
            let message = "expected n of at least 1 and nk = 0 or 1, such as n=4,nk=0";
            return Err(OptionError::new("orders", message));
        }
    }
    let Some(block_rows) = block_rows else {
        return Ok(());
    };
    if !(2..=MOST_ROWS).contains(&block_rows) {
        let message = format!("{block_rows}; expected 2 to {MOST_ROWS}");
        return Err(OptionError::new("block_rows", message));
    }
    if n >= block_rows {
        let message = format!("{block_rows}; expected more than the order {n}");
        return Err(OptionError::new("block_rows", message));
    }
    Ok(())
}

/// Computes A and C from the shift of the first n left singular vectors. Then finds B, D and x0 such that the simulated
/// output is closest to y over all samples; `y = B/F u + I/F delta` is linear in them.
pub struct Subspace {
    orders: Orders,
    weights: Weights,
    stabilise: Stabilise,
    reading: Option<SubspaceReading>,
    /// The source of the number of block rows; `None` if it is given.
    high: Option<HighOrder>,
    rows: usize,
    outputs: Triangle,
    model: LinearModel,
    theta: Vec<f64>,
    x0: Vec<f64>,
    sum: f64,
}

impl Subspace {
    /// Makes buffers for windows of `window` samples. Without a number of block rows it is chosen for each record.
    ///
    /// # Errors
    /// [`SetupError::ShortHankel`] if the Hankel matrices have fewer columns than rows.
    pub fn new(orders: Orders, rows: Option<usize>, weights: Weights, window: usize) -> Result<Self, SetupError> {
        let high = rows.is_none().then(|| HighOrder::new(true, 1, None, window));
        let rows = block_rows(rows, orders.nf, window)?;
        let parameters = orders.nb + orders.nf;
        Ok(Self {
            orders,
            weights,
            stabilise: Stabilise::None,
            reading: None,
            high,
            rows,
            outputs: Triangle::new(parameters),
            model: LinearModel::zero(orders),
            theta: vec![0.0; parameters],
            x0: vec![0.0; orders.nf],
            sum: f64::NAN,
        })
    }

    /// Returns the numbers of block rows that are tried: by default k, 3/2 k and 2 k, k being the order of the model
    /// `A y = B u + e` by AIC, as far as the record, the order and the excitation of u allow.
    fn candidates(&mut self, u: &[f64], y: &[f64]) -> Result<[usize; 3], FailureKind> {
        let Some(high) = &mut self.high else {
            return Ok([excited_rows(u, self.rows, self.rows)?; 3]);
        };
        high.fit(u, y);
        let order = high.chosen();
        let least = self.orders.nf + 1;
        let most = longest_rows(y.len()).max(least);
        let wanted = [2 * order, 3 * order, 4 * order];
        let wanted = wanted.map(|twice| (twice / 2).max(least + 1).min(most));
        let excited = excited_rows(u, wanted[2], least)?;
        Ok(wanted.map(|rows| rows.min(excited)))
    }

    /// Computes the model with the number of block rows and the weighting, of those tried, whose simulated output is
    /// closest to y, a stable one if there is one; returns the condition.
    fn find(&mut self, u: &[f64], y: &[f64], singular_values: &mut Vec<f64>) -> Result<f64, FailureKind> {
        let candidates = self.candidates(u, y)?;
        let weights = match &self.weights {
            Weights::Auto => &[Weights::N4sid, Weights::Moesp, Weights::Cva],
            one => std::slice::from_ref(one),
        };
        let weights = weights.to_vec();
        let mut best = (true, f64::INFINITY);
        let mut kept = None;
        let mut failed = FailureKind::RankDeficient;
        for (i, rows) in candidates.into_iter().enumerate() {
            if candidates[..i].contains(&rows) {
                continue;
            }
            let hankel = match reduce(u, y, rows) {
                Ok(hankel) => hankel,
                Err(kind) => {
                    failed = kind;
                    continue;
                }
            };
            for weights in &weights {
                let found = self.denominator(&hankel, rows, *weights, singular_values);
                let found = found.and_then(|()| self.numerators(u, y));
                let rank = (!stable(&self.model.f, &mut Vec::new()), self.sum);
                match found {
                    Ok(condition) if rank < best => {
                        best = rank;
                        let model = self.model.clone();
                        kept = Some((model, self.x0.clone(), singular_values.clone(), condition));
                    }
                    Err(kind) => failed = kind,
                    Ok(_) => {}
                }
            }
        }
        let (model, x0, values, condition) = kept.ok_or(failed)?;
        (self.model, self.x0, self.sum, *singular_values) = (model, x0, best.1, values);
        Ok(condition)
    }

    /// Computes the denominator F, and the singular values that indicate the order, from Hankel matrices of s rows.
    fn denominator(
        &mut self,
        hankel: &Hankel,
        s: usize,
        weights: Weights,
        singular_values: &mut Vec<f64>,
    ) -> Result<(), FailureKind> {
        let r = hankel.r();
        // L is R transposed: rows of Y_f, columns of U_p and Y_p.
        let past = Mat::from_fn(s, 2 * s, |i, j| r[(s + j, 3 * s + i)]);
        let mut root = None;
        let projected = match weights {
            Weights::Moesp | Weights::Auto => past,
            Weights::N4sid => {
                // L_32 L_22^+ [L_21 L_22], where L_21 belongs to the future inputs.
                let mut of_inputs = Mat::from_fn(2 * s, s, |i, j| r[(j, s + i)]);
                let of_past = Mat::from_fn(2 * s, 2 * s, |i, j| r[(s + j, s + i)]);
                if hankel.is_well_conditioned() {
                    solve_lower_triangular_in_place(of_past.as_ref(), of_inputs.as_mut(), Par::Seq);
                } else {
                    of_inputs = pseudo_inverse_times(&of_past, &of_inputs)?;
                }
                let product = &past * of_inputs;
                Mat::from_fn(s, 3 * s, |i, j| match j.checked_sub(s) {
                    None => product[(i, j)],
                    Some(j) => past[(i, j)],
                })
            }
            Weights::Cva => {
                // Y_f P = [L_32 L_33] Q.
                let outputs = Mat::from_fn(s, 3 * s, |i, j| r[(s + j, 3 * s + i)]);
                root = Some(Root::of(&outputs)?);
                root.as_ref().map_or(past.clone(), |root| &root.inverse * &past)
            }
        };
        let (left, values) = left_singular_vectors(&projected)?;
        *singular_values = values;
        let n = self.orders.nf;
        if !(singular_values[n - 1] > 0.0) {
            return Err(FailureKind::RankDeficient);
        }
        let of_states = left.get(.., ..n);
        let observability = match &root {
            None => of_states.to_owned(),
            Some(Root { root, .. }) => root * of_states,
        };
        let mut shift = observability.get(1.., ..).to_owned();
        observability.get(..s - 1, ..).qr().solve_lstsq_in_place(&mut shift);
        let f = &mut self.model.f;
        characteristic(shift.get(..n, ..), f)?;
        let finite = self.stabilise == Stabilise::None || stable(f, &mut Vec::new()) || reflect_zeros(f);
        finite.then_some(()).ok_or(FailureKind::NonFinite)
    }

    /// Computes B and x0 given F, by least squares over all samples; returns the condition.
    fn numerators(&mut self, u: &[f64], y: &[f64]) -> Result<f64, FailureKind> {
        let Orders { nb, nf, nk, .. } = self.orders;
        let (mut filtered, mut impulse) = (u.to_vec(), vec![0.0; y.len()]);
        impulse[0] = 1.0;
        divide_each(&self.model.f, [&mut filtered, &mut impulse]);
        let column = |j: usize| {
            if j < nb {
                (&filtered[..], nk + j)
            } else {
                (&impulse[..], j - nb)
            }
        };
        let n = nb + nf;
        self.outputs.run(y.len(), |j, first, to| {
            let (signal, lag) = if j < n { column(j) } else { (y, 0) };
            copy_delayed(signal, lag, first, to);
        })?;
        let condition = condition_of_triangle(self.outputs.r())?;
        check_rank_of_columns(condition, n)?;
        self.theta.copy_from_slice(self.outputs.top());
        if !self.outputs.solve(&mut self.theta) {
            return Err(FailureKind::Singular);
        }
        self.model.b[nk..].copy_from_slice(&self.theta[..nb]);
        let mut residual = y.to_vec();
        with_fma!(|| {
            for (j, theta) in self.theta.iter().enumerate() {
                let (signal, lag) = column(j);
                add_multiple(-theta, signal, residual.get_mut(lag..).unwrap_or_default());
            }
        });
        self.sum = dot(&residual, &residual);
        // x0 in the paper's coordinates: the first samples of the free response.
        for k in 0..nf {
            self.x0[k] = (0..=k).map(|i| self.theta[nb + i] * impulse[k - i]).sum();
        }
        Ok(condition)
    }

    /// Converts the model from the scaled units back to those of the record.
    fn scale_back(&mut self, [of_u, of_y]: [f64; 2]) {
        self.model.b.iter_mut().for_each(|b| *b *= of_y / of_u);
        self.x0.iter_mut().for_each(|x| *x *= of_y);
        self.sum *= of_y * of_y;
    }
}

/// Reduces the Hankel matrices of s rows to a triangle.
fn reduce(u: &[f64], y: &[f64], s: usize) -> Result<Hankel, FailureKind> {
    let blocks = [(u, s), (u, 0), (y, 0), (y, s)];
    let blocks: [Delays<'_>; 4] = std::array::from_fn(|i| Delays::new(blocks[i].0, blocks[i].1, s, i * s));
    Hankel::new(&blocks, columns(s, y.len()))
}

/// Returns the number of columns of the Hankel matrices.
pub(super) fn columns(rows: usize, window: usize) -> usize {
    (window + 1).saturating_sub(2 * rows)
}

/// Returns the number of block rows, if it is not given the least.
///
/// # Errors
/// [`SetupError::ShortHankel`] if the Hankel matrices have fewer columns than rows.
pub(super) fn block_rows(given: Option<usize>, order: usize, window: usize) -> Result<usize, SetupError> {
    let rows = given.unwrap_or(order + 1);
    if columns(rows, window) < 4 * rows || order >= rows {
        return Err(SetupError::ShortHankel { rows, window, order });
    }
    Ok(rows)
}

/// Returns the largest number of block rows that a record allows, whose Hankel matrices have four columns for each.
pub(super) fn longest_rows(window: usize) -> usize {
    ((window + 1) / 6).min(MOST_ROWS)
}

/// Returns the left singular vectors of a matrix that is not tall, and its singular values.
pub(super) fn left_singular_vectors(m: &Mat<f64>) -> Result<(Mat<f64>, Vec<f64>), FailureKind> {
    let (rows, columns) = (m.nrows(), m.ncols());
    let (compute, none) = (ComputeSvdVectors::Thin, ComputeSvdVectors::No);
    let memory = svd_scratch::<f64>(rows, columns, compute, none, Par::Seq, Default::default());
    let (mut left, mut values) = (Mat::zeros(rows, rows), Diag::zeros(rows));
    svd(
        m.as_ref(),
        values.as_mut(),
        Some(left.as_mut()),
        None,
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(memory)),
        Default::default(),
    )
    .map_err(|_| FailureKind::NonFinite)?;
    Ok((left, (0..rows).map(|i| values[i]).collect()))
}

/// The symmetric square root of `M M'`, and its inverse.
struct Root {
    root: Mat<f64>,
    inverse: Mat<f64>,
}

impl Root {
    fn of(m: &Mat<f64>) -> Result<Self, FailureKind> {
        let (u, values) = left_singular_vectors(m)?;
        // Directions without any output beyond rounding have no correlation.
        let smallest = values[0] * m.nrows() as f64 * f64::EPSILON * 16.0;
        let with = |of: fn(f64) -> f64| {
            let scaled = Mat::from_fn(u.nrows(), u.ncols(), |i, j| {
                let value = values[j];
                u[(i, j)] * if value > smallest { of(value) } else { 0.0 }
            });
            &scaled * u.transpose()
        };
        Ok(Self {
            root: with(|value| value),
            inverse: with(f64::recip),
        })
    }
}

/// Returns a signal minus its first sample, divided by its standard deviation, and the standard deviation.
fn standardised(signal: &[f64]) -> (Vec<f64>, f64) {
    let unit = variance(signal).sqrt();
    (signal.iter().map(|value| (value - signal[0]) / unit).collect(), unit)
}

/// Computes `L^+ M`. Singular values that are rounding of the largest one, as in a record without noise, are taken as
/// 0.
fn pseudo_inverse_times(l: &Mat<f64>, m: &Mat<f64>) -> Result<Mat<f64>, FailureKind> {
    let svd = l.thin_svd().map_err(|_| FailureKind::NonFinite)?;
    let (values, n) = (svd.S(), l.ncols());
    let smallest = values[0] * n as f64 * f64::EPSILON * 16.0;
    let mut product = svd.U().transpose() * m;
    for j in 0..product.ncols() {
        for i in 0..n {
            let value = values[i];
            product[(i, j)] = if value > smallest { product[(i, j)] / value } else { 0.0 };
        }
    }
    Ok(svd.V() * product)
}

impl SinglePass for Subspace {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let Window { u, y, .. } = window;
        let condition = match self.reading {
            None => self.find(u, y, &mut pass.singular_values)?,
            Some(SubspaceReading::Sippy) => {
                let ((u, of_u), (y, of_y)) = (standardised(u), standardised(y));
                let condition = self.find(&u, &y, &mut pass.singular_values)?;
                self.scale_back([of_u, of_y]);
                condition
            }
        };
        let (n, parameters) = (window.len(), 2 * self.theta.len() - self.orders.nb);
        self.model.noise_variance = self.sum / n.saturating_sub(parameters) as f64;
        pass.loss = self.sum / n as f64;
        pass.start_numbers = self.theta.len() - self.orders.nb;
        pass.set_model(&self.model, condition)?;
        pass.set_initial_state(&self.x0);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
