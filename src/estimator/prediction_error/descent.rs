//! One search: Levenberg-Marquardt steps from a start to the minimum that it leads to.

use crate::estimator::FailureKind;
use crate::estimator::covariance::{Covariance, Influence};
use crate::estimator::output_error_iteration::stable;
use crate::estimator::regression::{covariance_of_triangle, solve_normal};
use crate::estimator::solver::Reduction;
use crate::estimator::solver::condition::{
    Equilibration, check_rank_of_columns, triangular_condition,
};
use crate::model::polynomial::{divide, filter};
use crate::model::{LinearModel, Orders};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Mat, MatMut, Par};

/// The largest number of linearisations of a search.
const MOST_ITERATIONS: usize = 200;

/// Steps shorter than this are taken although rounding hides whether the loss falls.
const LAST: f64 = 1e-7;

/// After the first iterations, Newton's method is tried once steps are shorter than this.
const NEAR: f64 = 0.03;
const EARLY: usize = 8;

/// The relative step of the differences from which Newton's Hessian is computed.
const DIFFERENCE: f64 = 1e-5;

/// A search ends without success when steps get shorter than this.
const SMALLEST: f64 = 1e-13;

/// A sum below this share of the sum of y's squares is mere rounding.
const ROUNDING: f64 = 1e-24;

/// The largest scaled gradient that counts as a minimum.
const FLAT: f64 = 1e-6;

/// The result of a search.
#[derive(Clone, Copy, Debug)]
pub(in crate::estimator) struct Found {
    /// `sum e(k)^2`.
    pub(in crate::estimator) sum: f64,
    pub(in crate::estimator) iterations: usize,
    pub(in crate::estimator) failure: Option<FailureKind>,
}

/// Buffers for records of one length.
pub(in crate::estimator) struct Descent {
    orders: Orders,
    model: LinearModel,
    theta: Vec<f64>,
    trial: Vec<f64>,
    step: Vec<f64>,
    /// `B/F u`, `A y - B/F u` and the prediction errors.
    x: Vec<f64>,
    w: Vec<f64>,
    e: Vec<f64>,
    /// `D/C y`, `D/(C F) u`, `D/(C F) x`, `e/C`, `w/C`. Each column of psi is one of these, delayed.
    filtered: [Vec<f64>; 5],
    /// How many numbers represent the signals before the record; they follow the parameters in theta.
    initial: usize,
    /// The impulse response of `1/(C F)`, and the contribution of the initial numbers to e.
    impulse: Vec<f64>,
    free: Vec<f64>,
    /// The root mean square of y, in whose units the initial numbers are.
    unit: f64,
    scratch: Vec<f64>,
    psi: Reduction,
    damped: Reduction,
    equilibration: Equilibration,
    column: Vec<f64>,
    beside: Vec<f64>,
    hessian: Mat<f64>,
    influence: Influence,
}

/// Returns how many numbers represent the effect on e of the signals before the record. The effect is `P(q)/(C F)` of
/// an impulse at k = 0; P has as many coefficients as the predictor `(D A F y - D B u)/(C F)` has states.
pub(in crate::estimator) fn initial_numbers(orders: Orders) -> usize {
    let Orders {
        na,
        nb,
        nc,
        nd,
        nf,
        nk,
    } = orders;
    (nc + nf)
        .max(nd + na + nf)
        .max((nd + nb + nk).saturating_sub(1))
}

/// Columns of psi: a signal, the number of columns, the first delay, a sign.
type Block<'a> = (&'a [f64], usize, usize, f64);

fn blocks<'a>(
    signals: &'a [Vec<f64>; 5],
    impulse: &'a [f64],
    orders: Orders,
    initial: usize,
) -> [Block<'a>; 6] {
    let Orders {
        na,
        nb,
        nc,
        nd,
        nf,
        nk,
    } = orders;
    let [of_y, of_u, of_x, of_e, of_w] = signals;
    [
        (of_y, na, 1, 1.0),
        (of_u, nb, nk, -1.0),
        (of_e, nc, 1, -1.0),
        (of_w, nd, 1, 1.0),
        (of_x, nf, 1, 1.0),
        (impulse, initial, 0, 1.0),
    ]
}

/// Solves `H x = b` in place by Cholesky, using H's lower triangle; returns false if H is not positive definite.
fn solve_positive(h: &mut Mat<f64>, x: &mut [f64]) -> bool {
    let n = x.len();
    for j in 0..n {
        let square = h[(j, j)] - (0..j).map(|l| h[(j, l)] * h[(j, l)]).sum::<f64>();
        if !(square > 0.0 && square.is_finite()) {
            return false;
        }
        let root = square.sqrt();
        h[(j, j)] = root;
        for i in j + 1..n {
            let product: f64 = (0..j).map(|l| h[(i, l)] * h[(j, l)]).sum();
            h[(i, j)] = (h[(i, j)] - product) / root;
        }
    }
    for i in 0..n {
        let sum: f64 = (0..i).map(|l| h[(i, l)] * x[l]).sum();
        x[i] = (x[i] - sum) / h[(i, i)];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|l| h[(l, i)] * x[l]).sum();
        x[i] = (x[i] - sum) / h[(i, i)];
    }
    true
}

impl Descent {
    /// Makes buffers for windows of `window` samples, with `initial` numbers for the signals before them.
    pub(in crate::estimator) fn new(orders: Orders, initial: usize, window: usize) -> Self {
        let n = orders.parameters() + initial;
        let signal = || vec![0.0; window];
        let column = || vec![0.0; n];
        Self {
            orders,
            model: LinearModel::zero(orders),
            theta: column(),
            trial: column(),
            step: column(),
            x: signal(),
            w: signal(),
            e: signal(),
            filtered: [signal(), signal(), signal(), signal(), signal()],
            initial,
            impulse: signal(),
            free: signal(),
            unit: 1.0,
            scratch: Vec::new(),
            psi: Reduction::new(n, window, 1),
            damped: Reduction::new(n, 2 * n, 1),
            equilibration: Equilibration::new(n, n),
            column: column(),
            beside: column(),
            hessian: Mat::zeros(n, n),
            influence: Influence::default(),
        }
    }

    /// Returns the final parameters of the last search.
    pub(in crate::estimator) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Computes `sum e(k)^2` at the trial or the present parameters. `None` if the predictor is not stable or something
    /// overflows.
    fn sum(&mut self, u: &[f64], y: &[f64], trial: bool) -> Option<f64> {
        let theta = if trial { &self.trial } else { &self.theta };
        let (parameters, initial) = theta.split_at(theta.len() - self.initial);
        self.model.set_parameters(parameters);
        let LinearModel { a, b, c, d, f, .. } = &self.model;
        if !(stable(f, &mut self.scratch) && stable(c, &mut self.scratch)) {
            return None;
        }
        filter(b, u, &mut self.x);
        divide(f, &mut self.x);
        filter(a, y, &mut self.w);
        for (w, x) in self.w.iter_mut().zip(&self.x) {
            *w -= x;
        }
        filter(d, &self.w, &mut self.e);
        divide(c, &mut self.e);
        if self.initial > 0 {
            self.impulse.fill(0.0);
            self.impulse[0] = 1.0;
            divide(c, &mut self.impulse);
            divide(f, &mut self.impulse);
            filter(initial, &self.impulse, &mut self.free);
            for (e, free) in self.e.iter_mut().zip(&self.free) {
                *e += free;
            }
        }
        let sum: f64 = self.e.iter().map(|e| e * e).sum();
        sum.is_finite().then_some(sum)
    }

    /// Computes the signals that make up psi = de/dtheta, at the parameters of the last [`Self::sum`].
    fn filter_signals(&mut self, u: &[f64], y: &[f64]) {
        let LinearModel { c, d, f, .. } = &self.model;
        let [of_y, of_u, of_x, of_e, of_w] = &mut self.filtered;
        for (to, from) in [(&mut *of_y, y), (&mut *of_u, u), (&mut *of_x, &self.x)] {
            filter(d, from, to);
            divide(c, to);
        }
        if self.initial > 0 {
            // The contribution of the initial numbers has C F in the denominator too.
            for (of_x, free) in of_x.iter_mut().zip(&self.free) {
                *of_x -= free;
            }
        }
        divide(f, of_u);
        divide(f, of_x);
        for (to, from) in [(&mut *of_e, &self.e), (&mut *of_w, &self.w)] {
            to.copy_from_slice(from);
            divide(c, to);
        }
    }

    /// Computes `psi'e` at the parameters of the last [`Self::sum`].
    fn gradient_of_sum(&mut self, u: &[f64], y: &[f64], to: &mut [f64]) {
        self.filter_signals(u, y);
        let mut to = to.iter_mut();
        let blocks = blocks(&self.filtered, &self.impulse, self.orders, self.initial);
        for (signal, count, delay, sign) in blocks {
            for (lag, to) in (delay..delay + count).zip(&mut to) {
                let late = self.e.get(lag..).unwrap_or_default();
                *to = sign * late.iter().zip(signal).map(|(e, s)| e * s).sum::<f64>();
            }
        }
    }

    /// Computes R and `Q'e` of psi at the parameters of the last [`Self::sum`].
    fn gradient(&mut self, u: &[f64], y: &[f64]) -> Result<(), FailureKind> {
        self.filter_signals(u, y);
        let blocks = blocks(&self.filtered, &self.impulse, self.orders, self.initial);
        let e = &self.e;
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut right: MatMut<'_, f64>| {
            let rows = z.nrows();
            let mut column = 0;
            for (signal, count, delay, sign) in blocks {
                for lag in delay..delay + count {
                    for row in 0..rows {
                        let k = (first + row).checked_sub(lag);
                        z[(row, column)] = k.map_or(0.0, |k| sign * signal[k]);
                    }
                    column += 1;
                }
            }
            for row in 0..rows {
                right[(row, 0)] = e[first + row];
            }
        };
        self.psi.run(e.len(), fill)
    }

    /// Computes the step that minimises `|| R step + Q'e ||^2 + damping || S step ||^2`, S being the lengths of psi's
    /// columns. Returns false if there is none.
    fn damped_step(&mut self, damping: f64) -> bool {
        let n = self.step.len();
        let (r, top, root) = (self.psi.r(), self.psi.top(), damping.sqrt());
        let length = |j: usize| (0..=j).map(|i| r[(i, j)] * r[(i, j)]).sum::<f64>().sqrt();
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut right: MatMut<'_, f64>| {
            for row in 0..z.nrows() {
                let i = first + row;
                for j in 0..n {
                    z[(row, j)] = match i.checked_sub(n) {
                        None if j >= i => r[(i, j)],
                        Some(of) if of == j => root * length(j),
                        _ => 0.0,
                    };
                }
                right[(row, 0)] = if i < n { -top[(i, 0)] } else { 0.0 };
            }
        };
        let rows = if damping > 0.0 { 2 * n } else { n };
        if self.damped.run(rows, fill).is_err() {
            return false;
        }
        let (r, top) = (self.damped.r(), self.damped.top());
        if (0..n).any(|i| r[(i, i)] == 0.0) {
            return false;
        }
        for (i, step) in self.step.iter_mut().enumerate() {
            *step = top[(i, 0)];
        }
        let step = MatMut::from_column_major_slice_mut(&mut self.step, n, 1);
        solve_upper_triangular_in_place(r, step, Par::Seq);
        self.step.iter().all(|step| step.is_finite())
    }

    /// Returns the largest cosine between e and a column of psi.
    fn scaled_gradient(&self, sum: f64) -> f64 {
        let (r, top) = (self.psi.r(), self.psi.top());
        let cosine = |j: usize| {
            let column = (0..=j).map(|i| (r[(i, j)], top[(i, 0)]));
            let (product, square) =
                column.fold((0.0, 0.0), |(p, s), (r, e)| (p + r * e, s + r * r));
            if square > 0.0 {
                (product / (square * sum).sqrt()).abs()
            } else {
                0.0
            }
        };
        (0..self.step.len()).map(cosine).fold(0.0, f64::max)
    }

    /// Searches from a start until steps are shorter than `rest`, relative to the parameters.
    pub(in crate::estimator) fn run(
        &mut self,
        u: &[f64],
        y: &[f64],
        start: &[f64],
        rest: f64,
    ) -> Found {
        self.theta.fill(0.0);
        self.theta[..start.len()].copy_from_slice(start);
        self.unit = (y.iter().map(|y| y * y).sum::<f64>() / y.len() as f64).sqrt();
        let mut found = Found {
            sum: f64::INFINITY,
            iterations: 0,
            failure: None,
        };
        let Some(sum) = self.sum(u, y, false) else {
            found.failure = Some(FailureKind::UnstablePredictor);
            return found;
        };
        found.sum = sum;
        let rounding = ROUNDING * y.iter().map(|y| y * y).sum::<f64>();
        let mut damping = 1e-3;
        let mut near = false;
        for iteration in 1..=MOST_ITERATIONS {
            found.iterations = iteration;
            if found.sum <= rounding {
                return found;
            }
            let mut taken = None;
            if near && iteration > EARLY {
                taken = self.newton(u, y, &mut found.sum);
            }
            if taken.is_none() {
                if let Err(kind) = self.linearise(u, y) {
                    found.failure = Some(kind);
                    return found;
                }
                taken = self.improve(u, y, &mut found.sum, &mut damping);
            }
            near = taken.is_some_and(|step| step < NEAR);
            // Small steps alone do not show a minimum: they are also small near the border of stability.
            let rests = taken.is_none_or(|step| step <= rest);
            if rests && (found.sum <= rounding || self.is_flat(u, y, found.sum, rest)) {
                return found;
            }
            if taken.is_none_or(|step| step < SMALLEST) {
                break;
            }
        }
        found.failure = Some(FailureKind::NoConvergence);
        found
    }

    /// Computes psi's triangle at theta.
    fn linearise(&mut self, u: &[f64], y: &[f64]) -> Result<(), FailureKind> {
        let there = self.sum(u, y, false);
        there.ok_or(FailureKind::UnstablePredictor)?;
        self.gradient(u, y)
    }

    /// Takes a Newton step. It helps if the second derivatives of e matter, so that Gauss-Newton converges slowly. The
    /// Hessian comes from central differences of the exact gradient. Returns the relative length of the step; `None` if
    /// it does not help.
    fn newton(&mut self, u: &[f64], y: &[f64], sum: &mut f64) -> Option<f64> {
        let n = self.theta.len();
        let mut gradient = std::mem::take(&mut self.column);
        let mut there = std::mem::take(&mut self.beside);
        let hessian = self.fill_hessian(u, y, &mut gradient, &mut there);
        (self.column, self.beside) = (gradient, there);
        hessian?;
        for (step, gradient) in self.step.iter_mut().zip(&self.column) {
            *step = -gradient;
        }
        for j in 0..n {
            for i in 0..j {
                let mean = f64::midpoint(self.hessian[(i, j)], self.hessian[(j, i)]);
                self.hessian[(j, i)] = mean;
            }
        }
        solve_positive(&mut self.hessian, &mut self.step).then_some(())?;
        self.take_step(u, y, sum)
    }

    /// Computes the gradient and its differences; `None` if the predictor is unstable at a neighbouring point.
    fn fill_hessian(
        &mut self,
        u: &[f64],
        y: &[f64],
        gradient: &mut [f64],
        there: &mut [f64],
    ) -> Option<()> {
        let n = self.theta.len();
        self.sum(u, y, false)?;
        self.gradient_of_sum(u, y, gradient);
        for j in 0..n {
            let h = DIFFERENCE * self.theta[j].abs().max(1e-3);
            self.hessian.col_mut(j).fill(0.0);
            for side in [-1.0, 1.0] {
                self.trial.copy_from_slice(&self.theta);
                self.trial[j] += side * h;
                self.sum(u, y, true)?;
                self.gradient_of_sum(u, y, there);
                for (i, there) in there.iter().enumerate() {
                    self.hessian[(i, j)] += side * there / (2.0 * h);
                }
            }
        }
        Some(())
    }

    /// Takes the step if it does not raise the sum; returns its relative length.
    fn take_step(&mut self, u: &[f64], y: &[f64], sum: &mut f64) -> Option<f64> {
        let size = |values: &[f64]| values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for ((trial, theta), step) in self.trial.iter_mut().zip(&self.theta).zip(&self.step) {
            *trial = theta + step;
        }
        let n = self.step.len() - self.initial;
        let of_parameters = size(&self.step[..n]) / size(&self.trial[..n]).max(f64::MIN_POSITIVE);
        let initial = size(&self.trial[n..]).max(self.unit);
        let length = of_parameters.max(size(&self.step[n..]) / initial.max(f64::MIN_POSITIVE));
        // Rounding hides whether the last steps lower the sum.
        let allowed = if length < LAST {
            *sum * (1.0 + 1e-12)
        } else {
            *sum
        };
        let lower = self.sum(u, y, true).filter(|lower| *lower <= allowed)?;
        self.theta.copy_from_slice(&self.trial);
        *sum = lower;
        Some(length)
    }

    /// Returns whether the gradient at theta is small enough for a minimum.
    fn is_flat(&mut self, u: &[f64], y: &[f64], sum: f64, rest: f64) -> bool {
        self.linearise(u, y).is_ok() && self.scaled_gradient(sum) < FLAT.max(rest)
    }

    /// Increases the damping until a step lowers the sum, and takes it; returns its relative length.
    fn improve(&mut self, u: &[f64], y: &[f64], sum: &mut f64, damping: &mut f64) -> Option<f64> {
        for _ in 0..24 {
            if self.damped_step(*damping)
                && let Some(length) = self.take_step(u, y, sum)
            {
                *damping = if *damping < 1e-9 {
                    0.0
                } else {
                    *damping / 10.0
                };
                return Some(length);
            }
            *damping = (*damping * 10.0).max(1e-6);
        }
        None
    }

    /// Computes psi's triangle at the parameters, and its condition with columns scaled.
    ///
    /// # Errors
    /// [`FailureKind::NotIdentifiable`] if `psi'psi` is singular up to rounding.
    pub(in crate::estimator) fn condition(
        &mut self,
        u: &[f64],
        y: &[f64],
        theta: &[f64],
    ) -> Result<f64, FailureKind> {
        self.theta.copy_from_slice(theta);
        self.linearise(u, y)?;
        let singular = |_| FailureKind::NotIdentifiable;
        let r = self.psi.r();
        self.equilibration.of_columns(r).map_err(singular)?;
        let columns = &self.equilibration.columns;
        let condition = triangular_condition(r, columns, &mut self.column).map_err(singular)?;
        check_rank_of_columns(condition, theta.len()).map_err(singular)?;
        Ok(condition)
    }

    /// Computes the covariance at the last linearisation. For white prediction errors it is `variance (psi'psi)^-1`;
    /// otherwise it follows from each sample's contribution to theta, `-(psi'psi)^-1 psi(k) e(k)`.
    pub(in crate::estimator) fn covariance(
        &mut self,
        kind: Covariance,
        variance: f64,
        to: &mut Vec<f64>,
    ) {
        let r = self.psi.r();
        if kind == Covariance::White {
            covariance_of_triangle(r, variance, &mut self.column, to);
        } else {
            let all = blocks(&self.filtered, &self.impulse, self.orders, self.initial);
            self.influence.clear();
            for (k, e) in self.e.iter().enumerate() {
                self.influence.push(self.theta.len(), *e, |row| {
                    let delayed = all.iter().flat_map(|(signal, count, delay, sign)| {
                        let value = move |lag| if k < lag { 0.0 } else { sign * signal[k - lag] };
                        (*delay..delay + count).map(value)
                    });
                    row.iter_mut().zip(delayed).for_each(|(psi, x)| *psi = x);
                    solve_normal(r, row);
                });
            }
            self.influence.covariance(kind, to);
        }
        // Keep the covariance of the parameters alone.
        let all = self.theta.len();
        let n = all - self.initial;
        for i in 1..n {
            to.copy_within(i * all..i * all + n, i * n);
        }
        to.truncate(n * n);
    }

    /// Returns `sum e(k)^2` at the given parameters.
    #[cfg(test)]
    pub(super) fn sum_at(&mut self, u: &[f64], y: &[f64], theta: &[f64]) -> f64 {
        self.theta.copy_from_slice(theta);
        self.sum(u, y, false).unwrap()
    }

    /// Returns `psi'e` at the given parameters, from psi's triangle and from the sum itself.
    #[cfg(test)]
    pub(super) fn gradients(&mut self, u: &[f64], y: &[f64], theta: &[f64]) -> [Vec<f64>; 2] {
        self.theta.copy_from_slice(theta);
        self.linearise(u, y).unwrap();
        let (r, top) = (self.psi.r(), self.psi.top());
        let product = |j: usize| (0..=j).map(|i| r[(i, j)] * top[(i, 0)]).sum();
        let by_triangle = (0..theta.len()).map(product).collect();
        let mut by_sum = vec![0.0; theta.len()];
        self.gradient_of_sum(u, y, &mut by_sum);
        [by_triangle, by_sum]
    }
}
