//! Linear regression of a record on its past for any orders: `y(k) = phi(k)' theta`, by Householder QR.
//!
//! `phi(k) = (-y(k-1) ... -y(k-na), u(k-nk) ... u(k-nk-nb+1))`, `theta = (a_1 ... a_na, b_1 ... b_nb)`.

use super::covariance::{Covariance, Influence};
use super::solver::rank::{Equilibration, check_rank_of_columns, columns_of_inverse};
use super::solver::{Reduction, column};
use super::{FailureKind, Runs, SetupError, enough_equations};
use crate::model::Orders;
use crate::names::named_enum;
use faer::Par;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::reborrow::ReborrowMut;
use faer::{MatMut, MatRef};
use std::ops::Range;

named_enum! {
    /// Which equations of a record of N samples are used.
    Rows, "choice of rows" {
        /// Those with all samples in the record, `k = max(na, nb + nk - 1) ... N-1` (the default).
        Complete = "complete",
        /// `k = 0 ... N-1`, with zeros before the record.
        Prewindow = "prewindow",
        /// With zeros before and after the record, `k = 0 ... N-1 + max(na, nb + nk - 1)`.
        Padded = "padded",
    }
}

impl Rows {
    /// Returns k of the first row and the number of rows, if each row looks back `reach` samples.
    pub(super) fn extent(self, reach: usize, window: usize) -> (usize, usize) {
        match self {
            Self::Complete => (reach, window.saturating_sub(reach)),
            Self::Prewindow => (0, window),
            Self::Padded => (0, window + reach),
        }
    }
}

/// A record with zeros before and after it, and the rows made of it.
pub(super) struct Lagged {
    pub(super) orders: Orders,
    reach: usize,
    first: usize,
    /// The number of rows, those that touch two records included: they are zero.
    pub(super) total: usize,
    /// The number of equations.
    pub(super) count: usize,
    /// The rows that touch two records, as ranges of k.
    broken: Vec<Range<usize>>,
    pub(super) u: Vec<f64>,
    pub(super) y: Vec<f64>,
}

impl Lagged {
    /// Makes buffers for windows of `window` samples. Each row looks back `reach` samples; at least `needed` rows are
    /// needed.
    pub(super) fn new(
        orders: Orders,
        reach: usize,
        needed: usize,
        rows: Rows,
        window: usize,
    ) -> Result<Self, SetupError> {
        let (first, count) = rows.extent(reach, window);
        if orders.na + orders.nb == 0 || count < needed {
            return Err(SetupError::ShortRecord {
                orders,
                window,
                rows: count,
                needed,
            });
        }
        let padded = || vec![0.0; window + 2 * reach];
        Ok(Self {
            orders,
            reach,
            first,
            total: count,
            count,
            broken: Vec::new(),
            u: padded(),
            y: padded(),
        })
    }

    /// Leaves out the rows that look back into another record. The rows of the first record begin as in one record.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if fewer than `needed` are left.
    pub(super) fn of_runs(mut self, runs: &Runs, needed: usize) -> Result<Self, SetupError> {
        // A first record may be shorter than the rows reach.
        let rows = self.rows();
        let later = runs.iter().skip(1).map(|run| {
            let [start, end] = [run.start, run.end].map(|k| k + self.reach);
            let end = (start + self.reach).min(end).min(rows.end);
            start.max(rows.start)..end.max(rows.start)
        });
        self.broken = later.collect();
        self.count -= self.broken.iter().map(Range::len).sum::<usize>();
        enough_equations(self.orders, self.record().len(), self.count, needed)?;
        Ok(self)
    }

    /// Returns whether the equation of k is within one record.
    pub(super) fn is_whole(&self, k: usize) -> bool {
        !self.broken.iter().any(|rows| rows.contains(&k))
    }

    /// Zeroes the rows of a matrix, which begins with the row `first`, that touch two records.
    pub(super) fn blank(&self, first: usize, mut matrix: MatMut<'_, f64>) {
        let start = self.start() + first;
        let rows = start..start + matrix.nrows();
        for broken in &self.broken {
            for k in broken.start.max(rows.start)..broken.end.min(rows.end) {
                matrix.rb_mut().row_mut(k - start).fill(0.0);
            }
        }
    }

    /// Returns the index range of the samples between the zeros.
    pub(super) fn record(&self) -> Range<usize> {
        self.reach..self.y.len() - self.reach
    }

    /// Returns the index of the first row's k.
    pub(super) fn start(&self) -> usize {
        self.first + self.reach
    }

    /// Copies a record between the zeros.
    ///
    /// # Panics
    /// If it is not of the length that the buffers were made for.
    pub(super) fn load(&mut self, u: &[f64], y: &[f64]) {
        let record = self.record();
        self.u[record.clone()].copy_from_slice(u);
        self.y[record].copy_from_slice(y);
    }

    /// Returns the index range of the rows' k.
    pub(super) fn rows(&self) -> Range<usize> {
        self.start()..self.start() + self.total
    }

    /// Returns `y(k) - phi(k)' theta`; 0 of a row that touches two records.
    pub(super) fn residual(&self, theta: &[f64], k: usize) -> f64 {
        if !self.is_whole(k) {
            return 0.0;
        }
        let (u, y, Orders { na, nk, .. }) = (&self.u, &self.y, self.orders);
        let (a, b) = theta.split_at(na);
        let of_y = a.iter().enumerate().map(|(i, a)| a * y[k - 1 - i]);
        let of_u = b.iter().enumerate().map(|(i, b)| b * u[k - nk - i]);
        y[k] + of_y.sum::<f64>() - of_u.sum::<f64>()
    }

    /// Returns `sum (y(k) - phi(k)' theta)^2` over the rows.
    pub(super) fn residual_sum(&self, theta: &[f64]) -> f64 {
        self.rows().map(|k| self.residual(theta, k).powi(2)).sum()
    }

    /// Computes phi(k).
    fn regressors(&self, k: usize, to: &mut [f64]) {
        let Orders { na, nk, .. } = self.orders;
        let (of_y, of_u) = to.split_at_mut(na);
        for (i, to) in of_y.iter_mut().enumerate() {
            *to = -self.y[k - 1 - i];
        }
        for (i, to) in of_u.iter_mut().enumerate() {
            *to = self.u[k - nk - i];
        }
    }
}

/// Buffers for the regression of records of one length.
pub struct Regression {
    lagged: Lagged,
    /// The weight lambda of `lambda || theta ||^2`, which is added to the sum of squares.
    ridge: f64,
    reduction: Reduction,
    equilibration: Equilibration,
    scratch: Vec<f64>,
    theta: Vec<f64>,
    influence: Influence,
}

impl Regression {
    /// Makes buffers for windows of `window` samples. The orders of C, D and F are ignored.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if there are fewer rows than parameters.
    pub fn new(orders: Orders, rows: Rows, window: usize) -> Result<Self, SetupError> {
        Self::with_ridge(orders, rows, 0.0, window)
    }

    /// Makes buffers for `argmin || y - Phi theta ||^2 + ridge || theta ||^2`.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn with_ridge(orders: Orders, rows: Rows, ridge: f64, window: usize) -> Result<Self, SetupError> {
        let width = orders.na + orders.nb;
        let lagged = Lagged::new(orders, orders.reach(), width, rows, window)?;
        Ok(Self {
            reduction: Reduction::new(width, lagged.total + ridge_rows(ridge, width), 1),
            lagged,
            ridge,
            equilibration: Equilibration::new(width, width),
            scratch: vec![0.0; width],
            theta: vec![0.0; width],
            influence: Influence::default(),
        })
    }

    /// Uses the equations of several records that follow each other.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if there are fewer than parameters.
    pub(super) fn of_runs(mut self, runs: &Runs) -> Result<Self, SetupError> {
        self.lagged = self.lagged.of_runs(runs, self.theta.len())?;
        Ok(self)
    }

    /// Returns the number of equations.
    pub fn rows(&self) -> usize {
        self.lagged.count
    }

    /// Computes `theta = argmin || y - Phi theta ||`, and the 1-norm condition number of Phi's R with its columns
    /// scaled. A ridge lambda adds the rows `sqrt(lambda) I theta = 0`.
    ///
    /// # Errors
    /// [`FailureKind::Singular`] if a column is zero, [`FailureKind::RankDeficient`] by the common rank rule,
    /// [`FailureKind::NonFinite`] if something overflows.
    ///
    /// # Panics
    /// If the record is not of the length that the buffers were made for.
    pub fn solve(&mut self, u: &[f64], y: &[f64]) -> Result<f64, FailureKind> {
        self.lagged.load(u, y);
        let Lagged { orders, u, y, .. } = &self.lagged;
        let (Orders { na, nb, nk, .. }, start) = (*orders, self.lagged.start());
        let (count, root) = (self.lagged.total, self.ridge.sqrt());
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut right: MatMut<'_, f64>| {
            let rows = count.saturating_sub(first).min(z.nrows());
            for row in rows..z.nrows() {
                z.rb_mut().row_mut(row).fill(0.0);
                z[(row, first + row - count)] = root;
                right[(row, 0)] = 0.0;
            }
            if rows == 0 {
                return;
            }
            let start = start + first;
            for i in 1..=na {
                for (to, y) in column(&mut z, i - 1).iter_mut().zip(&y[start - i..][..rows]) {
                    *to = -y;
                }
            }
            for i in 0..nb {
                column(&mut z, na + i)[..rows].copy_from_slice(&u[start - nk - i..][..rows]);
            }
            column(&mut right, 0)[..rows].copy_from_slice(&y[start..][..rows]);
            self.lagged.blank(first, z.rb_mut());
            self.lagged.blank(first, right.rb_mut());
        };
        let total = count + ridge_rows(self.ridge, na + nb);
        self.reduction.run(total, fill)?;
        let r = self.reduction.r();
        let condition = self.equilibration.of_triangle(r, &mut self.scratch)?;
        let width = na + nb;
        check_rank_of_columns(condition, width)?;
        let top = self.reduction.top();
        for (i, theta) in self.theta.iter_mut().enumerate() {
            *theta = top[(i, 0)];
        }
        let theta = MatMut::from_column_major_slice_mut(&mut self.theta, width, 1);
        solve_upper_triangular_in_place(r, theta, Par::Seq);
        Ok(condition)
    }

    /// Returns the last solution.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Returns `sum (y(k) - phi(k)' theta)^2` over the rows of the last solution.
    pub fn residual_sum(&self) -> f64 {
        self.lagged.residual_sum(&self.theta)
    }

    /// Computes the covariance of the last solution, row by row. For white equation errors it is
    /// `variance (Phi'Phi)^-1`; otherwise it follows from each row's contribution to theta, `(Phi'Phi)^-1 phi(k)`.
    pub fn covariance(&mut self, kind: Covariance, variance: f64, to: &mut Vec<f64>) {
        let r = self.reduction.r();
        if kind == Covariance::White {
            covariance_of_triangle(r, variance, &mut self.scratch, to);
            return;
        }
        let (lagged, theta) = (&self.lagged, &self.theta);
        self.influence.clear();
        for k in lagged.rows().filter(|k| lagged.is_whole(*k)) {
            self.influence.push(theta.len(), lagged.residual(theta, k), |row| {
                lagged.regressors(k, row);
            });
        }
        self.influence.solve_normal(r);
        self.influence.covariance(kind, to);
    }
}

/// Returns the number of rows that a ridge adds.
fn ridge_rows(ridge: f64, width: usize) -> usize {
    if ridge > 0.0 { width } else { 0 }
}

/// Computes `variance (R'R)^-1`, row by row; `scratch` has room for a column.
pub(super) fn covariance_of_triangle(r: MatRef<'_, f64>, variance: f64, scratch: &mut [f64], to: &mut Vec<f64>) {
    let n = r.ncols();
    to.clear();
    to.resize(n * n, 0.0);
    // Column j of R^-1 contributes to all entries up to j: (R'R)^-1 = R^-1 R^-T.
    columns_of_inverse(r, scratch, |column| {
        for (i, row) in column.iter().enumerate() {
            for (l, other) in column.iter().enumerate() {
                to[i * n + l] += variance * row * other;
            }
        }
    });
}
