//! F tests of columns that are added to a regression.
//!
//! Source: R. Davidson and J. G. MacKinnon, *Estimation and Inference in Econometrics*, 1993, chapter 6.

use crate::estimator::solver::Reduction;
use crate::metric::tails::fisher_above;
use faer::{Mat, MatMut, MatRef};

/// Directions that are added count where their singular values, of columns of norm 1, are above this after what is
/// known was projected out.
const LEFT: f64 = 1e-6;

/// The fewest degrees of freedom of a test.
const FREEDOM: usize = 5;

/// A regression of e on known columns, to which others are added: the triangle of `[known | added | e]`, which has the
/// inner products of these columns.
pub(super) struct AddedColumns {
    triangle: Mat<f64>,
    rows: usize,
    /// Singular values of the known columns, each of norm 1, that count: this share of the largest.
    tolerance: f64,
}

/// The result of a test.
pub(super) struct Added {
    /// The probability of this result or a worse one if the added columns have no effect.
    pub(super) p_value: f64,
    /// The share of the squares of e beside the known columns that the added ones leave.
    pub(super) left: f64,
    /// The sum of the squares of e beside the known columns.
    pub(super) squares: f64,
}

impl AddedColumns {
    /// Reduces `rows` rows; `fill(column, first, to)` writes those from `first` on of a column, of which there are
    /// `columns`, e being the last. `None` if a number is not finite.
    pub(super) fn new(
        rows: usize,
        columns: usize,
        tolerance: f64,
        fill: impl Fn(usize, usize, &mut [f64]),
    ) -> Option<Self> {
        let mut reduction = Reduction::new(columns, rows, 0);
        let mut column = Vec::new();
        let reduced = reduction.run(rows, |first, mut z: MatMut<'_, f64>, _: MatMut<'_, f64>| {
            column.resize(z.nrows(), 0.0);
            for j in 0..columns {
                fill(j, first, &mut column);
                for (i, value) in column.iter().enumerate() {
                    z[(i, j)] = *value;
                }
            }
        });
        reduced.ok()?;
        Some(Self {
            triangle: reduction.r().to_owned(),
            rows,
            tolerance,
        })
    }

    /// Tests the `added` columns that follow the first `known` ones. With Q, an orthonormal basis of the known columns,
    /// and U, one of the added columns without them, q directions, it is `F = (|U'e|^2 / q) / ((|e|^2 - |U'e|^2) / d)`
    /// of e without the known columns, d being the rows less the columns of Q and U. `None` where no direction is left,
    /// or fewer than 5 degrees of freedom are.
    pub(super) fn test(&self, known: usize, added: usize) -> Option<Added> {
        let columns = self.triangle.ncols();
        let known_columns = scaled(self.triangle.get(.., ..known));
        let q = basis(&known_columns, |largest| self.tolerance * largest)?;
        let mut e = self.triangle.get(.., columns - 1..).to_owned();
        let mut z = scaled(self.triangle.get(.., known..known + added));
        for _ in 0..2 {
            e -= &q * (q.transpose() * &e);
            z -= &q * (q.transpose() * &z);
        }
        let u = basis(&z, |_| LEFT)?;
        let freedom = self.rows.checked_sub(q.ncols() + u.ncols())?;
        let squares = e.squared_norm_l2();
        if u.ncols() == 0 || freedom < FREEDOM || !(squares > 0.0) {
            return None;
        }
        let explained = (u.transpose() * &e).squared_norm_l2();
        let left = (squares - explained).max(0.0);
        let f = (explained / u.ncols() as f64) / (left / freedom as f64);
        Some(Added {
            p_value: fisher_above(f, u.ncols(), freedom),
            left: left / squares,
            squares,
        })
    }
}

/// Returns the columns with norm 1; a column of zeros stays.
fn scaled(columns: MatRef<'_, f64>) -> Mat<f64> {
    let norms: Vec<f64> = (0..columns.ncols()).map(|j| columns.col(j).norm_l2()).collect();
    Mat::from_fn(columns.nrows(), columns.ncols(), |i, j| {
        if norms[j] > 0.0 {
            columns[(i, j)] / norms[j]
        } else {
            0.0
        }
    })
}

/// Returns an orthonormal basis of the directions whose singular values are above a limit, given that of the largest;
/// `None` if there is no singular value decomposition.
fn basis(columns: &Mat<f64>, limit: impl Fn(f64) -> f64) -> Option<Mat<f64>> {
    if columns.ncols() == 0 {
        return Some(Mat::zeros(columns.nrows(), 0));
    }
    let svd = columns.thin_svd().ok()?;
    let values: Vec<f64> = (0..columns.ncols()).map(|i| svd.S()[i]).collect();
    let least = limit(values[0]);
    let count = values.iter().filter(|value| **value > least).count();
    Some(svd.U().get(.., ..count).to_owned())
}
