//! QR and SVD of the (N-n) x 2n data matrix.
//!
//! Least squares uses `Phi = Q R`. With instruments, `Z = Q R` leaves the small system `(Q'Phi) p = Q'y`. Neither
//! squares a condition number, so these solvers keep about twice as many digits as those with the information matrix.

use super::linear::EquilibratedLu;
use super::rank::{Equilibration, check_rank, inverse_norm1_estimate, maximum, norm1};
use super::reduction::Reduction;
use super::{Instruments, Solution, SolveInstruments, SolveLeastSquares};
use crate::estimator::regressors::fill_rows;
use crate::estimator::{FailureKind, Window};
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::reborrow::ReborrowMut;
use faer::{Mat, MatMut, MatRef, Par};

/// Reduces the data matrix and tests the rank of R; both solvers begin with it.
struct Triangle {
    order: usize,
    reduction: Reduction,
    equilibration: Equilibration,
    scratch: Vec<f64>,
}

impl Triangle {
    fn new(order: usize, window: usize, instruments: bool) -> Self {
        Self {
            order,
            reduction: Reduction::new(2 * order, window - order, if instruments { 2 * order + 1 } else { 1 }),
            equilibration: Equilibration::new(2 * order, 2 * order),
            scratch: vec![0.0; 2 * order],
        }
    }

    /// Computes R of the data matrix with the signals of `z`, its column scales and its condition.
    fn reduce(&mut self, window: Window<'_>, z: Instruments<'_>, condition: &mut f64) -> Result<(), FailureKind> {
        let n = self.order;
        let fill = |first: usize, block: MatMut<'_, f64>, companions: MatMut<'_, f64>| {
            fill_rows(z.output, z.input(window), n, first, block);
            let phi_columns = companions.ncols() - 1;
            let (mut phi, mut y) = companions.split_at_col_mut(phi_columns);
            if phi.ncols() > 0 {
                fill_rows(window.y, window.u, n, first, phi.rb_mut());
            }
            for row in 0..y.nrows() {
                y[(row, 0)] = window.y[n + first + row];
            }
        };
        self.reduction.run(window.len() - n, fill)?;
        let r = self.reduction.r();
        *condition = self.equilibration.of_triangle(r, &mut self.scratch)?;
        check_rank(*condition, self.order)
    }

    /// Copies `Q'y`.
    fn copy_rhs(&self, p: &mut [f64]) {
        let top = self.reduction.top();
        let column = top.ncols() - 1;
        for (i, p) in p.iter_mut().enumerate() {
            *p = top[(i, column)];
        }
    }

    /// Returns `Q'Phi`.
    fn small(&self) -> MatRef<'_, f64> {
        self.reduction.top().get(.., ..2 * self.order)
    }
}

/// Householder QR; with instruments, the small system is solved by LU.
pub struct Qr {
    regressors: Triangle,
    instruments: Triangle,
    lu: EquilibratedLu,
}

impl Qr {
    /// Makes buffers for order n and windows of N samples.
    pub fn new(order: usize, window: usize) -> Self {
        Self {
            regressors: Triangle::new(order, window, false),
            instruments: Triangle::new(order, window, true),
            lu: EquilibratedLu::new(2 * order, order),
        }
    }
}

impl SolveLeastSquares for Qr {
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        let triangle = &mut self.regressors;
        triangle.reduce(window, Instruments::new(window.y), &mut solution.condition)?;
        triangle.copy_rhs(&mut solution.p);
        let dimension = solution.p.len();
        let p = MatMut::from_column_major_slice_mut(&mut solution.p, dimension, 1);
        solve_upper_triangular_in_place(triangle.reduction.r(), p, Par::Seq);
        Ok(())
    }
}

impl SolveInstruments for Qr {
    fn instruments(
        &mut self,
        window: Window<'_>,
        instruments: Instruments<'_>,
        solution: &mut Solution,
    ) -> Result<(), FailureKind> {
        let (triangle, lu) = (&mut self.instruments, &mut self.lu);
        let mut condition_z = f64::NAN;
        let reduced = triangle.reduce(window, instruments, &mut condition_z);
        solution.condition = condition_z;
        reduced?;
        triangle.copy_rhs(&mut solution.p);
        lu.matrix().copy_from(triangle.small());
        let solved = lu.solve(&mut solution.p, &mut solution.condition);
        solution.condition = maximum(solution.condition, condition_z);
        solved
    }
}

/// Singular value decomposition of R, and with instruments of `Q'Phi`, with equilibrated columns.
pub struct Svd {
    regressors: Triangle,
    instruments: Triangle,
    matrix: Mat<f64>,
    u: Mat<f64>,
    values: Diag<f64>,
    v: Mat<f64>,
    equilibration: Equilibration,
    scratch: [Vec<f64>; 3],
    memory: MemBuffer,
}

impl Svd {
    /// Makes buffers for order n and windows of N samples.
    pub fn new(order: usize, window: usize) -> Self {
        let dimension = 2 * order;
        let vectors = ComputeSvdVectors::Thin;
        let memory = svd_scratch::<f64>(dimension, dimension, vectors, vectors, Par::Seq, Default::default());
        let square = || Mat::zeros(dimension, dimension);
        let column = || vec![0.0; dimension];
        Self {
            regressors: Triangle::new(order, window, false),
            instruments: Triangle::new(order, window, true),
            matrix: square(),
            u: square(),
            values: Diag::zeros(dimension),
            v: square(),
            equilibration: Equilibration::new(dimension, dimension),
            scratch: [column(), column(), column()],
            memory: MemBuffer::new(memory),
        }
    }

    /// Factorises the equilibrated `self.matrix`; returns false if the iteration did not converge.
    fn decompose(&mut self) -> bool {
        self.equilibration.apply(self.matrix.as_mut());
        svd(
            self.matrix.as_ref(),
            self.values.as_mut(),
            Some(self.u.as_mut()),
            Some(self.v.as_mut()),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        )
        .is_ok()
    }

    /// Computes `p <- columns V S^-1 U' rows p`, the solution of the unscaled system.
    fn solve(&mut self, p: &mut [f64]) {
        for (p, scale) in p.iter_mut().zip(&self.equilibration.rows) {
            *p *= scale;
        }
        let scratch = &mut self.scratch[2];
        apply_inverse(&self.u, &self.values, &self.v, p, scratch, false);
        for (p, scale) in p.iter_mut().zip(&self.equilibration.columns) {
            *p *= scale;
        }
    }
}

/// Computes `x <- V S^-1 U' x`, or transposed `x <- U S^-1 V' x`.
fn apply_inverse(u: &Mat<f64>, s: &Diag<f64>, v: &Mat<f64>, x: &mut [f64], scratch: &mut [f64], transposed: bool) {
    let (from, to) = if transposed { (v, u) } else { (u, v) };
    for (i, scratch) in scratch.iter_mut().enumerate() {
        let sum: f64 = from.col_as_slice(i).iter().zip(&*x).map(|(u, x)| u * x).sum();
        *scratch = sum / s[i];
    }
    x.fill(0.0);
    for (i, scratch) in scratch.iter().enumerate() {
        for (x, to) in x.iter_mut().zip(to.col_as_slice(i)) {
            *x += to * scratch;
        }
    }
}

impl SolveLeastSquares for Svd {
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        let triangle = &mut self.regressors;
        triangle.reduce(window, Instruments::new(window.y), &mut solution.condition)?;
        triangle.copy_rhs(&mut solution.p);
        let r = triangle.reduction.r();
        self.matrix.copy_from(r);
        self.equilibration.rows.fill(1.0);
        self.equilibration
            .columns
            .copy_from_slice(&triangle.equilibration.columns);
        if !self.decompose() {
            return Err(FailureKind::NonFinite);
        }
        self.solve(&mut solution.p);
        Ok(())
    }
}

impl SolveInstruments for Svd {
    fn instruments(
        &mut self,
        window: Window<'_>,
        instruments: Instruments<'_>,
        solution: &mut Solution,
    ) -> Result<(), FailureKind> {
        let triangle = &mut self.instruments;
        triangle.reduce(window, instruments, &mut solution.condition)?;
        triangle.copy_rhs(&mut solution.p);
        self.matrix.copy_from(triangle.small());
        self.equilibration.of(self.matrix.as_ref())?;
        let order = triangle.order;
        if !self.decompose() {
            return Err(FailureKind::NonFinite);
        }
        if self.values[2 * order - 1] == 0.0 {
            return Err(FailureKind::RankDeficient);
        }
        let [x, z, scratch] = &mut self.scratch;
        let (u, s, v) = (&self.u, &self.values, &self.v);
        let inverse_norm = inverse_norm1_estimate(x, z, |x, transposed| {
            apply_inverse(u, s, v, x, scratch, transposed);
        });
        let condition = norm1(self.matrix.as_ref()) * inverse_norm;
        solution.condition = maximum(solution.condition, condition);
        check_rank(solution.condition, order)?;
        self.solve(&mut solution.p);
        Ok(())
    }
}
