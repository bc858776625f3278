//! Equilibration, condition numbers and the rank rule common to all solvers.

use crate::estimator::FailureKind;
use faer::{MatMut, MatRef};

/// A matrix counts as rank deficient if the reciprocal of its equilibrated 1-norm condition number is below this
/// multiple of 2n eps.
///
/// Rounding hides exact singularity: the computed reciprocal condition of a singular matrix of this size is a few eps.
pub const RANK_MULTIPLE: f64 = 4.0;

/// Applies the rank rule: fails if `1 / condition < RANK_MULTIPLE * 2n * eps`.
///
/// # Errors
/// [`FailureKind::RankDeficient`], or [`FailureKind::NonFinite`] if the condition is NaN.
pub fn check_rank(condition: f64, order: usize) -> Result<(), FailureKind> {
    check_rank_of_columns(condition, 2 * order)
}

/// Applies the rank rule to a matrix with any number of columns.
///
/// # Errors
/// As for [`check_rank`].
pub fn check_rank_of_columns(condition: f64, columns: usize) -> Result<(), FailureKind> {
    if condition.is_nan() {
        Err(FailureKind::NonFinite)
    } else if condition.recip() < RANK_MULTIPLE * columns as f64 * f64::EPSILON {
        Err(FailureKind::RankDeficient)
    } else {
        Ok(())
    }
}

/// Returns the reciprocal condition below which a matrix of 2n rows is rank deficient.
pub fn rank_limit(order: usize) -> f64 {
    RANK_MULTIPLE * 2.0 * order as f64 * f64::EPSILON
}

/// Row and column scales that bring the largest entry of every row and column of a matrix into [1, 2). They are powers
/// of two, so that scaling does not round.
#[derive(Clone, Debug)]
pub struct Equilibration {
    /// Factors of the rows.
    pub rows: Vec<f64>,
    /// Factors of the columns.
    pub columns: Vec<f64>,
}

/// Returns the power of two `s` with `s x` in [1, 2), kept in the range of normal numbers.
pub(in crate::estimator) fn inverse_power_of_two(x: f64) -> f64 {
    let exponent = (x.to_bits() >> 52) & 0x7ff;
    f64::from_bits(2046_u64.saturating_sub(exponent).max(1) << 52)
}

impl Equilibration {
    /// Makes buffers for `rows` x `columns`.
    pub fn new(rows: usize, columns: usize) -> Self {
        Self {
            rows: vec![1.0; rows],
            columns: vec![1.0; columns],
        }
    }

    /// Computes the scales of `matrix`: rows first, then the columns of the row-scaled matrix.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if an entry is not finite, [`FailureKind::Singular`] if a row or column is zero.
    pub fn of(&mut self, matrix: MatRef<'_, f64>) -> Result<(), FailureKind> {
        self.rows.fill(0.0);
        with_fma!(|| largest_of_rows(matrix, &mut self.rows));
        if !self.rows.iter().all(|r| r.is_finite()) {
            return Err(FailureKind::NonFinite);
        }
        if self.rows.contains(&0.0) {
            return Err(FailureKind::Singular);
        }
        for scale in &mut self.rows {
            *scale = inverse_power_of_two(*scale);
        }
        for (j, scale) in self.columns.iter_mut().enumerate() {
            *scale = with_fma!(|| largest_of_column(matrix, j, &self.rows));
            if *scale == 0.0 {
                return Err(FailureKind::Singular);
            }
            *scale = inverse_power_of_two(*scale);
        }
        Ok(())
    }

    /// Computes one scale for both row and column i of a symmetric matrix: the power of two in
    /// `[1, 2) / sqrt(diagonal_i)`.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if an entry is not finite, [`FailureKind::Singular`] if a diagonal entry is not
    /// positive.
    pub fn of_symmetric(&mut self, matrix: MatRef<'_, f64>) -> Result<(), FailureKind> {
        if !matrix.norm_l1().is_finite() {
            return Err(FailureKind::NonFinite);
        }
        for i in 0..matrix.nrows() {
            if matrix[(i, i)] <= 0.0 {
                return Err(FailureKind::Singular);
            }
            let scale = inverse_power_of_two(matrix[(i, i)].sqrt());
            self.rows[i] = scale;
            self.columns[i] = scale;
        }
        Ok(())
    }

    /// Computes the scales of the columns alone, from their largest entries. This leaves the least-squares problem of a
    /// tall data matrix unchanged.
    ///
    /// # Errors
    /// As for [`Self::of`].
    pub fn of_columns(&mut self, matrix: MatRef<'_, f64>) -> Result<(), FailureKind> {
        for (j, scale) in self.columns.iter_mut().enumerate() {
            let size = (0..matrix.nrows()).map(|i| matrix[(i, j)].abs()).fold(0.0, maximum);
            if !size.is_finite() {
                return Err(FailureKind::NonFinite);
            }
            if size == 0.0 {
                return Err(FailureKind::Singular);
            }
            *scale = inverse_power_of_two(size);
        }
        Ok(())
    }

    /// Computes the scales of the columns of an upper triangular R, and returns its condition number with them.
    ///
    /// # Errors
    /// As for [`Self::of_columns`] and [`triangular_condition`], of which `scratch` is.
    pub fn of_triangle(&mut self, r: MatRef<'_, f64>, scratch: &mut [f64]) -> Result<f64, FailureKind> {
        self.of_columns(r)?;
        triangular_condition(r, &self.columns, scratch)
    }

    /// Scales `matrix` in place.
    pub fn apply(&self, mut matrix: MatMut<'_, f64>) {
        for (j, scale) in self.columns.iter().enumerate() {
            let column = matrix.as_mut().col_mut(j);
            for (x, row) in column.iter_mut().zip(&self.rows) {
                *x *= row * scale;
            }
        }
    }

    /// Returns the 1-norm of a diagonal block after scaling; `at` is the index of its first row and column in the
    /// matrix.
    pub fn norm1(&self, block: MatRef<'_, f64>, at: usize) -> f64 {
        let (rows, columns) = (&self.rows[at..], &self.columns[at..]);
        let sum = |j: usize| -> f64 {
            let column = (0..block.nrows()).map(|i| rows[i] * block[(i, j)].abs());
            column.sum::<f64>() * columns[j]
        };
        (0..block.ncols()).map(sum).fold(0.0, maximum)
    }

    /// Returns the 1-norm of the inverse of a diagonal block after scaling, given its inverse before scaling.
    pub fn inverse_norm1(&self, inverse: MatRef<'_, f64>, at: usize) -> f64 {
        let (rows, columns) = (&self.rows[at..], &self.columns[at..]);
        let sum = |j: usize| -> f64 {
            let column = (0..inverse.nrows()).map(|i| inverse[(i, j)].abs() / columns[i]);
            column.sum::<f64>() / rows[j]
        };
        (0..inverse.ncols()).map(sum).fold(0.0, maximum)
    }
}

/// Returns the larger number, NaN if either is.
pub(super) fn maximum(x: f64, y: f64) -> f64 {
    if x.is_nan() || x >= y { x } else { y }
}

/// Raises each number to the largest size in a row of the matrix; NaN if one is. Sizes are compared as integers, whose
/// order is the same, with NaN above all.
#[inline(always)]
fn largest_of_rows(matrix: MatRef<'_, f64>, rows: &mut [f64]) {
    for j in 0..matrix.ncols() {
        let column = matrix.col(j);
        match column.try_as_col_major() {
            Some(column) => {
                for (largest, x) in rows.iter_mut().zip(column.as_slice()) {
                    *largest = larger_size(*largest, *x);
                }
            }
            None => {
                for (largest, x) in rows.iter_mut().zip(column.iter()) {
                    *largest = larger_size(*largest, *x);
                }
            }
        }
    }
}

/// Returns the largest size in a column of the matrix whose rows are multiplied by these numbers.
#[inline(always)]
fn largest_of_column(matrix: MatRef<'_, f64>, j: usize, rows: &[f64]) -> f64 {
    const WAYS: usize = 8;
    let mut largest = [0.0; WAYS];
    let column = matrix.col(j);
    if let Some(column) = column.try_as_col_major() {
        let (parts, rest) = column.as_slice().as_chunks::<WAYS>();
        let (scales, of_rest) = rows.as_chunks::<WAYS>();
        for (part, scales) in parts.iter().zip(scales) {
            for i in 0..WAYS {
                largest[i] = larger_size(largest[i], scales[i] * part[i]);
            }
        }
        for (largest, (x, scale)) in largest.iter_mut().zip(rest.iter().zip(of_rest)) {
            *largest = larger_size(*largest, scale * x);
        }
    } else {
        for (x, scale) in column.iter().zip(rows) {
            largest[0] = larger_size(largest[0], scale * x);
        }
    }
    largest.into_iter().fold(0.0, larger_size)
}

#[inline(always)]
fn larger_size(size: f64, x: f64) -> f64 {
    let (a, b) = (size.to_bits().cast_signed(), x.abs().to_bits().cast_signed());
    f64::from_bits(if a < b { b } else { a }.cast_unsigned())
}

/// Returns the 1-norm of a matrix: its largest column sum.
pub fn norm1(matrix: MatRef<'_, f64>) -> f64 {
    (0..matrix.ncols())
        .map(|j| (0..matrix.nrows()).map(|i| matrix[(i, j)].abs()).sum())
        .fold(0.0, maximum)
}

/// Returns the exact 1-norm condition number of the upper triangular `R C`, C the diagonal of `columns`, from the
/// columns of the inverse. `scratch` has room for one number per row of R.
///
/// # Errors
/// [`FailureKind::RankDeficient`] if a diagonal entry is zero.
pub fn triangular_condition(r: MatRef<'_, f64>, columns: &[f64], scratch: &mut [f64]) -> Result<f64, FailureKind> {
    let (mut norm, mut inverse_norm) = (0.0_f64, 0.0_f64);
    for (j, scale) in columns.iter().enumerate().take(r.ncols()) {
        if r[(j, j)] == 0.0 {
            return Err(FailureKind::RankDeficient);
        }
        let sum: f64 = (0..=j).map(|i| r[(i, j)].abs()).sum();
        norm = maximum(norm, sum * scale);
    }
    columns_of_inverse(r, scratch, |column| {
        let sum = column.iter().zip(columns).map(|(x, scale)| x.abs() / scale).sum();
        inverse_norm = maximum(inverse_norm, sum);
    });
    Ok(norm * inverse_norm)
}

/// Returns the 1-norm condition number of an upper triangular R with equilibrated columns.
///
/// # Errors
/// As for [`Equilibration::of_columns`] and [`triangular_condition`].
pub fn condition_of_triangle(r: MatRef<'_, f64>) -> Result<f64, FailureKind> {
    let n = r.ncols();
    Equilibration::new(0, n).of_triangle(r, &mut vec![0.0; n])
}

/// Calls `take` with each column of R^-1 down to its diagonal, by back substitution; `scratch` has room for one. A
/// large R, which is stored by columns, is copied row by row, and several columns share what is read. Every sum has the
/// order and the bits of a column alone.
pub fn columns_of_inverse(r: MatRef<'_, f64>, scratch: &mut [f64], mut take: impl FnMut(&[f64])) {
    const SMALL: usize = 64;
    const TOGETHER: usize = 8;
    let n = r.ncols();
    if n <= SMALL {
        for j in 0..n {
            scratch[j] = 1.0 / r[(j, j)];
            for i in (0..j).rev() {
                let sum: f64 = (i + 1..=j).map(|l| r[(i, l)] * scratch[l]).sum();
                scratch[i] = -sum / r[(i, i)];
            }
            take(&scratch[..=j]);
        }
        return;
    }
    let rows: Vec<f64> = (0..n * n).map(|at| r[(at / n, at % n)]).collect();
    let mut block = vec![[0.0; TOGETHER]; n];
    for first in (0..n).step_by(TOGETHER) {
        let end = n.min(first + TOGETHER);
        with_fma!(|| {
            for i in (0..end).rev() {
                let mut sums = [0.0; TOGETHER];
                for (r, row) in rows[i * n..][i + 1..end].iter().zip(&block[i + 1..]) {
                    sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += r * x);
                }
                for (j, (x, sum)) in (first..).zip(block[i].iter_mut().zip(sums)) {
                    *x = match i {
                        _ if i < j => -sum / r[(i, i)],
                        _ if i == j => 1.0 / r[(i, i)],
                        _ => 0.0,
                    };
                }
            }
        });
        for j in first..end {
            for (x, row) in scratch[..=j].iter_mut().zip(&block) {
                *x = row[j - first];
            }
            take(&scratch[..=j]);
        }
    }
}

/// Returns the Hager-Higham estimate of `|| A^-1 ||_1` from solves with A and A' (a lower bound, rarely off by more
/// than a factor of 3; Higham 1988, Algorithm 674).
///
/// `solve(x, transposed)` overwrites x by `A^-1 x` or `A^-T x`; `x` and `z` are scratch of A's dimension.
pub fn inverse_norm1_estimate(x: &mut [f64], z: &mut [f64], mut solve: impl FnMut(&mut [f64], bool)) -> f64 {
    let dimension = x.len();
    let norm = |x: &[f64]| x.iter().map(|x| x.abs()).sum::<f64>();
    x.fill(1.0 / dimension as f64);
    solve(x, false);
    let mut estimate = norm(x);
    let mut previous = usize::MAX;
    for _ in 0..5 {
        for (z, x) in z.iter_mut().zip(&*x) {
            *z = 1.0_f64.copysign(*x);
        }
        solve(z, true);
        let largest = (0..dimension).fold(0, |l, i| if z[i].abs() > z[l].abs() { i } else { l });
        if largest == previous {
            break;
        }
        previous = largest;
        x.fill(0.0);
        x[largest] = 1.0;
        solve(x, false);
        let next = norm(x);
        if !(next > estimate) {
            break;
        }
        estimate = next;
    }
    // The alternating vector covers cases in which the iteration cancels.
    for (i, x) in x.iter_mut().enumerate() {
        let size = 1.0 + i as f64 / (dimension.max(2) - 1) as f64;
        *x = if i % 2 == 0 { size } else { -size };
    }
    solve(x, false);
    maximum(estimate, 2.0 * norm(x) / (3.0 * dimension as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    /// Columns of a large matrix have the bits of those of its leading part, which is small: R^-1 of the part is the
    /// part of R^-1.
    #[test]
    fn columns_of_a_large_inverse_have_the_same_bits() {
        let entry = |i: usize, j: usize| match i {
            _ if i == j => 2.0 + i as f64 / 7.0,
            _ if i < j => ((i * 31 + j * 17) % 23) as f64 / 100.0 - 0.1,
            _ => f64::NAN,
        };
        let columns = |n: usize| {
            let (r, mut found) = (Mat::from_fn(n, n, entry), Vec::new());
            columns_of_inverse(r.as_ref(), &mut vec![0.0; n], |column| {
                found.push(column.to_vec());
            });
            found
        };
        let (small, large) = (columns(64), columns(77));
        assert_eq!((small.len(), large.len()), (64, 77));
        assert_eq!(large[..64], small);
        // R times its inverse's last column is a unit vector.
        for (n, columns) in [(64, small), (77, large)] {
            for i in 0..n {
                let sum: f64 = (i..n).map(|l| entry(i, l) * columns[n - 1][l]).sum();
                let unit = if i == n - 1 { 1.0 } else { 0.0 };
                assert!((sum - unit).abs() < 1e-12, "{i}: {sum}");
            }
        }
    }
}
