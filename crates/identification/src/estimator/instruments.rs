//! Instrumental variables for any orders: `theta = argmin || Q'(y - Phi theta) ||`, `Z = Q R`.
//!
//! With as many instruments as parameters this is `(Z'Phi)^-1 Z'y`; with more it is two-stage least squares. Neither
//! `Z'Z` nor `Z'Phi` is formed.

use super::covariance::{Covariance, Influence, ROWS};
use super::regression::{Lagged, Rows, covariance_of_triangle};
use super::solver::Reduction;
use super::solver::rank::{Equilibration, check_rank_of_columns};
use super::triangular::{solve_normal, solve_transposed_of, sum_of_products};
use super::{FailureKind, Runs, SetupError};
use crate::model::Orders;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::reborrow::ReborrowMut;
use faer::{MatMut, Par};

/// The choice of instruments for the past outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruments {
    /// `-x(k-1) ... -x(k-na)` of another signal x, such as the output of a model.
    Signal,
    /// `na + extra` inputs from before those of the regression.
    DelayedInputs {
        /// How many more instruments than outputs in the regression.
        extra: usize,
    },
}

impl Instruments {
    /// Returns the number of instruments besides the inputs of the regression.
    fn count(self, orders: Orders) -> usize {
        match self {
            Self::Signal => orders.na,
            Self::DelayedInputs { extra } => orders.na + extra,
        }
    }

    /// Returns how many samples before k a row looks back.
    fn reach(self, orders: Orders) -> usize {
        match self {
            Self::Signal => orders.reach(),
            Self::DelayedInputs { extra } => orders.reach().max(orders.nk + orders.nb + orders.na + extra - 1),
        }
    }
}

/// The signals of a regression with instruments, all of one length.
#[derive(Clone, Copy, Debug)]
pub struct Signals<'a> {
    /// The input.
    pub u: &'a [f64],
    /// The output.
    pub y: &'a [f64],
    /// Replaces the output in the instruments; not used for delayed inputs.
    pub x: &'a [f64],
    /// Replaces the input in the instruments; `None`: the input itself.
    pub v: Option<&'a [f64]>,
}

impl<'a> Signals<'a> {
    /// Makes signals with the input itself among the instruments.
    pub fn new(u: &'a [f64], y: &'a [f64], x: &'a [f64]) -> Self {
        Self { u, y, x, v: None }
    }
}

/// Buffers of a regression with instruments, for records of one length.
pub struct InstrumentalRegression {
    lagged: Lagged,
    instruments: Instruments,
    /// The signals instead of output and input, between zeros.
    x: Vec<f64>,
    v: Vec<f64>,
    stages: TwoStages,
    influence: Influence,
}

/// `theta = argmin || Q'(y - Phi theta) ||`, `Z = Q R`, for rows of any signals.
pub(super) struct TwoStages {
    /// `Z = Q R` with Phi and y as companions, then `Q'Phi` with `Q'y`.
    outer: Reduction,
    inner: Reduction,
    equilibration: Equilibration,
    scratch: Vec<f64>,
    pub(super) theta: Vec<f64>,
}

impl TwoStages {
    /// Makes buffers for `wide` instruments, `width` parameters and `rows` rows.
    pub(super) fn new(wide: usize, width: usize, rows: usize) -> Self {
        Self {
            outer: Reduction::new(wide, rows, width + 1),
            inner: Reduction::new(width, wide, 1),
            equilibration: Equilibration::new(wide, wide),
            scratch: vec![0.0; wide],
            theta: vec![0.0; width],
        }
    }

    /// Computes theta of `rows` rows; `fill(first, z, right)` writes Z, and Phi beside y, from the row `first` on. The
    /// condition is the worse of those of R and of the triangle of `Q'Phi`, columns scaled.
    ///
    /// # Errors
    /// As for [`super::Regression::solve`].
    pub(super) fn solve(
        &mut self,
        rows: usize,
        fill: impl FnMut(usize, MatMut<'_, f64>, MatMut<'_, f64>),
    ) -> Result<f64, FailureKind> {
        self.outer.run(rows, fill)?;
        let (wide, width) = (self.outer.r().ncols(), self.theta.len());
        let of_z = self.triangle(true, wide)?;
        let top = self.outer.top();
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut right: MatMut<'_, f64>| {
            for row in 0..z.nrows() {
                for column in 0..width {
                    z[(row, column)] = top[(first + row, column)];
                }
                right[(row, 0)] = top[(first + row, width)];
            }
        };
        self.inner.run(wide, fill)?;
        let of_phi = self.triangle(false, width)?;
        let top = self.inner.top();
        for (i, theta) in self.theta.iter_mut().enumerate() {
            *theta = top[(i, 0)];
        }
        let theta = MatMut::from_column_major_slice_mut(&mut self.theta, width, 1);
        solve_upper_triangular_in_place(self.inner.r(), theta, Par::Seq);
        Ok(of_z.max(of_phi))
    }

    /// Returns the condition of a triangle after checking its rank.
    fn triangle(&mut self, outer: bool, columns: usize) -> Result<f64, FailureKind> {
        let reduction = if outer { &self.outer } else { &self.inner };
        self.equilibration.columns.resize(columns, 1.0);
        let condition = self.equilibration.of_triangle(reduction.r(), &mut self.scratch)?;
        check_rank_of_columns(condition, columns)?;
        Ok(condition)
    }

    /// Returns the length of column j of `Q'Phi`.
    pub(super) fn length(&self, j: usize) -> f64 {
        let r = self.inner.r();
        (0..=j).map(|i| r[(i, j)] * r[(i, j)]).sum::<f64>().sqrt()
    }

    /// Computes `x = (Phi' Q Q' Phi)^-1 x` of the last solution.
    pub(super) fn solve_normal(&self, x: &mut [f64]) {
        solve_normal(self.inner.r(), x);
    }

    /// Computes `variance (Z'Z)^-1` of the last solution, row by row.
    pub(super) fn covariance_of_instruments(&mut self, variance: f64, to: &mut Vec<f64>) {
        covariance_of_triangle(self.outer.r(), variance, &mut self.scratch, to);
    }
}

impl InstrumentalRegression {
    /// Makes buffers for windows of `window` samples. The orders of C, D and F are ignored.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if there are fewer rows than instruments.
    pub fn new(orders: Orders, instruments: Instruments, rows: Rows, window: usize) -> Result<Self, SetupError> {
        let width = orders.na + orders.nb;
        let wide = instruments.count(orders) + orders.nb;
        let lagged = Lagged::new(orders, instruments.reach(orders), wide, rows, window)?;
        Ok(Self {
            instruments,
            x: vec![0.0; lagged.y.len()],
            v: vec![0.0; lagged.y.len()],
            stages: TwoStages::new(wide, width, lagged.total),
            lagged,
            influence: Influence::default(),
        })
    }

    /// Uses the equations of several records that follow each other.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if there are fewer than instruments.
    pub(super) fn of_runs(mut self, runs: &Runs) -> Result<Self, SetupError> {
        let orders = self.lagged.orders;
        let wide = self.instruments.count(orders) + orders.nb;
        self.lagged = self.lagged.of_runs(runs, wide)?;
        Ok(self)
    }

    /// Returns the number of equations.
    pub fn rows(&self) -> usize {
        self.lagged.count
    }

    /// Returns the last solution.
    pub fn theta(&self) -> &[f64] {
        &self.stages.theta
    }

    /// Computes theta. The condition is the worse of those of R and of the triangle of `Q'Phi`, columns scaled.
    ///
    /// # Errors
    /// As for [`super::Regression::solve`].
    ///
    /// # Panics
    /// If a signal is not of the length that the buffers were made for.
    pub fn solve(&mut self, signals: Signals<'_>) -> Result<f64, FailureKind> {
        let instruments = self.instruments;
        self.lagged.load(signals.u, signals.y);
        if instruments == Instruments::Signal {
            self.x[self.lagged.record()].copy_from_slice(signals.x);
        }
        self.v[self.lagged.record()].copy_from_slice(signals.v.unwrap_or(signals.u));
        let (Lagged { orders, u, y, .. }, x, v) = (&self.lagged, &self.x, &self.v);
        let (Orders { na, nb, nk, .. }, start) = (*orders, self.lagged.start());
        let more = instruments.count(*orders);
        let put = |mut to: MatMut<'_, f64>, column: usize, from: &[f64], sign: f64| {
            for (row, value) in from.iter().enumerate() {
                to[(row, column)] = sign * value;
            }
        };
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut right: MatMut<'_, f64>| {
            let (rows, start) = (z.nrows(), start + first);
            let lagged = |lag: usize| start - lag..start - lag + rows;
            for i in 0..more {
                match instruments {
                    Instruments::Signal => put(z.rb_mut(), i, &x[lagged(i + 1)], -1.0),
                    Instruments::DelayedInputs { .. } => {
                        put(z.rb_mut(), i, &v[lagged(nk + nb + i)], 1.0);
                    }
                }
            }
            for i in 0..na {
                put(right.rb_mut(), i, &y[lagged(i + 1)], -1.0);
            }
            for i in 0..nb {
                put(z.rb_mut(), more + i, &v[lagged(nk + i)], 1.0);
                put(right.rb_mut(), na + i, &u[lagged(nk + i)], 1.0);
            }
            put(right.rb_mut(), na + nb, &y[lagged(0)], 1.0);
            self.lagged.blank(first, z.rb_mut());
            self.lagged.blank(first, right.rb_mut());
        };
        self.stages.solve(self.lagged.total, fill)
    }

    /// Returns `sum (y(k) - phi(k)' theta)^2` over the rows of the last solution.
    pub fn residual_sum(&self) -> f64 {
        self.lagged.residual_sum(&self.stages.theta)
    }

    /// Computes the covariance of the last solution, row by row.
    ///
    /// For white equation errors it is `variance (Phi'Q Q'Phi)^-1`; with as many instruments as parameters this is
    /// `variance (Z'Phi)^-1 Z'Z (Phi'Z)^-1`. Otherwise it follows from each row's contribution to theta,
    /// `(Phi'Q Q'Phi)^-1 Phi'Q q(k)`, with `q(k)` the row of Q.
    pub fn covariance(&mut self, kind: Covariance, variance: f64, to: &mut Vec<f64>) {
        let TwoStages {
            outer,
            inner,
            scratch,
            theta,
            ..
        } = &mut self.stages;
        let inner = inner.r();
        if kind == Covariance::White {
            covariance_of_triangle(inner, variance, scratch, to);
            return;
        }
        let (lagged, outer, top) = (&self.lagged, outer.r(), outer.top());
        self.influence.clear();
        let (mut q, mut psi) = (vec![[0.0; ROWS]; scratch.len()], vec![[0.0; ROWS]; theta.len()]);
        let mut rows = lagged.rows();
        while !rows.is_empty() {
            let block = rows.start..rows.end.min(rows.start + ROWS);
            rows.start = block.end;
            for (lane, k) in block.clone().enumerate() {
                row_of_instruments(lagged, self.instruments, [&self.x, &self.v], k, scratch);
                q.iter_mut().zip(&*scratch).for_each(|(q, z)| q[lane] = *z);
            }
            with_fma!(|| {
                solve_transposed_of(outer, &mut q);
                for (j, psi) in psi.iter_mut().enumerate() {
                    *psi = sum_of_products(q.iter().enumerate().map(|(i, q)| (top[(i, j)], q)));
                }
            });
            let whole = block.enumerate().filter(|(_, k)| lagged.is_whole(*k));
            for (lane, k) in whole {
                self.influence.push(theta.len(), lagged.residual(theta, k), |row| {
                    row.iter_mut().zip(&psi).for_each(|(to, psi)| *to = psi[lane]);
                });
            }
        }
        self.influence.solve_normal(inner);
        self.influence.covariance(kind, to);
    }

    /// Computes `variance (Z'Z)^-1` of the last solution, row by row.
    pub fn covariance_of_instruments(&mut self, variance: f64, to: &mut Vec<f64>) {
        self.stages.covariance_of_instruments(variance, to);
    }
}

/// Computes z(k).
fn row_of_instruments(lagged: &Lagged, instruments: Instruments, [x, v]: [&[f64]; 2], k: usize, to: &mut [f64]) {
    let Orders { nb, nk, .. } = lagged.orders;
    let (more, of_input) = to.split_at_mut(instruments.count(lagged.orders));
    for (i, to) in more.iter_mut().enumerate() {
        *to = match instruments {
            Instruments::Signal => -x[k - 1 - i],
            Instruments::DelayedInputs { .. } => v[k - nk - nb - i],
        };
    }
    for (i, to) in of_input.iter_mut().enumerate() {
        *to = v[k - nk - i];
    }
}
