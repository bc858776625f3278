//! Canonical correlations of the past with the future, and the states that they define.

use crate::estimator::hankel::{Delays, Hankel};
use crate::estimator::methods::subspace::columns;
use crate::estimator::solver::{Reduction, column};
use crate::estimator::{Criterion, FailureKind};
use crate::model::LinearModel;
use faer::{Mat, MatMut, MatRef};

/// The past and the future as triangles: `[W Z Y] = Q R`, W the inputs that are projected out.
pub(super) struct Canonical {
    /// Canonical correlations in descending order, as many as block rows.
    pub(super) correlations: Vec<f64>,
    /// The directions of the past, a row for each correlation.
    directions: Mat<f64>,
    /// Columns of the Hankel matrices.
    count: usize,
}

impl Canonical {
    /// Correlates past and future outputs, future inputs projected out of both.
    pub(super) fn projected(u: &[f64], y: &[f64], s: usize) -> Result<Self, FailureKind> {
        let future = |signal, at| Delays::new(signal, s, s, at);
        let past = |signal, at| Delays::new(signal, 0, s, at).backwards();
        let blocks = [future(u, 0), past(y, s), past(u, 2 * s), future(y, 3 * s)];
        let count = columns(s, y.len());
        let triangle = Hankel::new(&blocks, count)?;
        Self::of(triangle.r().get(s.., s..), s, count)
    }

    /// Correlates the past with `y(t+i) - sum_j h_j (y or u)(t+i-j)`, j up to i, h being the predictor of an ARX model:
    /// what is left is the state's.
    pub(super) fn predicted(u: &[f64], y: &[f64], s: usize, high: &LinearModel) -> Result<Self, FailureKind> {
        let count = columns(s, y.len());
        let mut reduction = Reduction::new(3 * s, count, 0);
        let mut of_input = Vec::new();
        reduction.run(count, |first: usize, mut z: MatMut<'_, f64>, _: MatMut<'_, f64>| {
            let (begin, rows) = (s + first, z.nrows());
            for i in 0..s {
                column(&mut z, i).copy_from_slice(&y[begin - 1 - i..][..rows]);
                column(&mut z, s + i).copy_from_slice(&u[begin - 1 - i..][..rows]);
                let future = column(&mut z, 2 * s + i);
                of_input.clear();
                of_input.resize(rows, 0.0);
                sum_lags(&high.a, &y[..begin + i + rows], i, future);
                sum_lags(&high.b, &u[..begin + i + rows], i, &mut of_input);
                future.iter_mut().zip(&of_input).for_each(|(y, u)| *y -= u);
            }
        })?;
        Self::of(reduction.r(), s, count)
    }

    /// The triangle of `[Z Y]` without W: R_22, and for Y (R_23; R_33).
    fn of(r: MatRef<'_, f64>, s: usize, count: usize) -> Result<Self, FailureKind> {
        let past = Whitened::of(r.get(.., ..2 * s))?;
        let future = Whitened::of(r.get(.., 2 * s..))?;
        let product = future.basis.transpose() * &past.basis;
        let svd = product.thin_svd().map_err(|_| FailureKind::NonFinite)?;
        let found = product.nrows().min(product.ncols());
        let mut correlations = vec![0.0; s];
        for (to, i) in correlations.iter_mut().zip(0..found) {
            *to = svd.S()[i].min(1.0);
        }
        let directions = svd.V().transpose() * &past.root;
        Ok(Self {
            correlations,
            directions,
            count,
        })
    }

    /// Returns the order n from 1 to `most` with the least criterion of `V = prod 1/(1 - rho_i^2)`, i > n, of M columns
    /// and `n (3 s - n)` parameters, those of a matrix of rank n with s rows and 2 s columns.
    pub(super) fn order(&self, criterion: Criterion, most: usize) -> usize {
        let s = self.correlations.len();
        let value = |n: usize| {
            let beyond = self.correlations[n..].iter();
            // A correlation of 1 is rounding of a record without noise.
            let logarithm: f64 = beyond.map(|rho| -(1.0 - rho * rho).max(1e-30).ln()).sum();
            criterion.value(logarithm.exp(), self.count, n * (3 * s - n))
        };
        let orders = 1..=most;
        orders.min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap_or(1)
    }

    /// Returns the n rows of J.
    pub(super) fn states(&mut self, n: usize) -> Result<MatRef<'_, f64>, FailureKind> {
        if self.directions.nrows() < n || !(self.correlations[n - 1] > 0.0) {
            return Err(FailureKind::RankDeficient);
        }
        Ok(self.directions.get(..n, ..))
    }
}

/// Computes `sum_j c_j x(k-j)`, j up to i, for the last samples of x.
fn sum_lags(c: &[f64], x: &[f64], i: usize, to: &mut [f64]) {
    to.fill(0.0);
    for (j, c) in c.iter().enumerate().take(i + 1) {
        let delayed = &x[x.len() - to.len() - j..];
        with_fma!(|| to.iter_mut().zip(delayed).for_each(|(to, x)| *to += c * x));
    }
}

/// A matrix X of columns as an orthonormal basis of their span, `X = basis S V'`, and `root = S^-1 V'`. Singular values
/// that are rounding of the largest are taken as 0, as in a record without noise.
struct Whitened {
    basis: Mat<f64>,
    root: Mat<f64>,
}

impl Whitened {
    fn of(x: MatRef<'_, f64>) -> Result<Self, FailureKind> {
        // Columns have units of their own.
        let n = x.ncols();
        let scales: Vec<f64> = (0..n).map(|j| x.col(j).norm_l2()).collect();
        let inverse = |j: usize| {
            if scales[j] > 0.0 { scales[j].recip() } else { 0.0 }
        };
        let scaled = Mat::from_fn(x.nrows(), n, |i, j| x[(i, j)] * inverse(j));
        let svd = scaled.thin_svd().map_err(|_| FailureKind::NonFinite)?;
        let values = svd.S();
        let smallest = values[0] * n as f64 * f64::EPSILON * 16.0;
        let rank = (0..n).filter(|i| values[*i] > smallest).count();
        if rank == 0 {
            return Err(FailureKind::Singular);
        }
        Ok(Self {
            basis: svd.U().get(.., ..rank).to_owned(),
            root: Mat::from_fn(rank, n, |i, j| svd.V()[(j, i)] / values[i] * inverse(j)),
        })
    }
}
