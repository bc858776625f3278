//! Small dense matrices. Every sum has a stated order and every fused multiplication is written out, so theory has the
//! same bits on every machine, which no library does that chooses its kernels by the machine.

use crate::estimator::recursive::Elimination;
use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Range, Sub};

/// A matrix of doubles.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    /// Column by column.
    numbers: Vec<f64>,
}

impl Matrix {
    /// Makes a matrix from its entries.
    pub fn from_fn(rows: usize, columns: usize, mut entry: impl FnMut(usize, usize) -> f64) -> Self {
        let mut numbers = Vec::with_capacity(rows * columns);
        for j in 0..columns {
            numbers.extend((0..rows).map(|i| entry(i, j)));
        }
        Self { rows, columns, numbers }
    }

    /// Makes a matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self::from_fn(rows, columns, |_, _| 0.0)
    }

    /// Makes the identity.
    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |i, j| f64::from(u8::from(i == j)))
    }

    /// Returns the number of rows.
    pub fn nrows(&self) -> usize {
        self.rows
    }

    /// Returns the number of columns.
    pub fn ncols(&self) -> usize {
        self.columns
    }

    /// Returns a column.
    pub fn col(&self, j: usize) -> &[f64] {
        &self.numbers[j * self.rows..][..self.rows]
    }

    /// Returns the transpose.
    #[must_use]
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self[(j, i)])
    }

    /// Returns some rows of some columns.
    #[must_use]
    pub fn part(&self, rows: Range<usize>, columns: Range<usize>) -> Self {
        let (first, left) = (rows.start, columns.start);
        Self::from_fn(rows.len(), columns.len(), |i, j| self[(first + i, left + j)])
    }

    /// Appends a column of zeros.
    pub fn push_column(&mut self) {
        self.columns += 1;
        self.numbers.resize(self.rows * self.columns, 0.0);
    }

    /// Returns the largest size of an entry.
    pub fn norm_max(&self) -> f64 {
        self.numbers.iter().fold(0.0, |most, x| x.abs().max(most))
    }

    /// Whether all entries are finite.
    pub fn is_all_finite(&self) -> bool {
        self.numbers.iter().all(|x| x.is_finite())
    }

    fn rows_of_numbers(&self) -> Vec<f64> {
        self.transpose().numbers
    }

    /// Returns X of `self X = right`; not finite if the matrix is singular.
    ///
    /// # Panics
    /// If the matrix is not square, or `right` has other rows.
    #[must_use]
    pub fn solve(&self, right: &Self) -> Self {
        assert!(self.rows == self.columns && self.rows == right.rows);
        let mut solution = right.rows_of_numbers();
        if !solution.is_empty() {
            let matrix = self.rows_of_numbers();
            Elimination::new(self.rows).solve(self.rows, &matrix, &mut solution);
        }
        Self::from_fn(right.rows, right.columns, |i, j| solution[i * right.columns + j])
    }

    /// Returns the condition number in the 1-norm; not finite if the matrix is singular.
    pub fn condition(&self) -> f64 {
        let norm = |of: &Self| {
            let sums = (0..of.columns).map(|j| of.col(j).iter().map(|x| x.abs()).sum::<f64>());
            sums.fold(0.0, |most, sum| if sum > most || sum.is_nan() { sum } else { most })
        };
        norm(self) * norm(&self.solve(&Self::identity(self.rows)))
    }

    /// Returns L with `L L' = self` for a symmetric matrix without negative eigenvalues, its rows in their order but
    /// not triangular: pivots are the largest that are left, until what is left is rounding.
    #[must_use]
    pub fn root(&self) -> Self {
        let n = self.rows;
        let mut left = self.clone();
        let mut root = Self::zeros(n, n);
        let least = (0..n).map(|i| self[(i, i)]).fold(0.0, f64::max) * n as f64 * f64::EPSILON;
        for k in 0..n {
            let largest = (0..n).fold(0, |of, i| if left[(i, i)] > left[(of, of)] { i } else { of });
            let pivot = left[(largest, largest)];
            if !(pivot > least) {
                break;
            }
            for i in 0..n {
                root[(i, k)] = left[(i, largest)] / pivot.sqrt();
            }
            let column = root.col(k).to_vec();
            for j in 0..n {
                for i in 0..n {
                    left[(i, j)] -= column[i] * column[j];
                }
            }
            // Nothing of this row is left, not even rounding.
            for i in 0..n {
                left[(i, largest)] = 0.0;
                left[(largest, i)] = 0.0;
            }
        }
        root
    }

    /// Returns the eigenvalues of a symmetric matrix, of which the lower triangle is used; `None` if an iteration does
    /// not end.
    ///
    /// Source: H. Bowdler, R. S. Martin, C. Reinsch and J. H. Wilkinson, *The QR and QL algorithms for symmetric
    /// matrices*, Numerische Mathematik 11 (1968): Householder's reduction to a tridiagonal matrix, then QL with
    /// shifts.
    pub fn symmetric_eigenvalues(&self) -> Option<Vec<f64>> {
        let (mut diagonal, mut beside) = tridiagonal(self);
        ql(&mut diagonal, &mut beside).then_some(diagonal)
    }
}

/// Returns the diagonal and what is beside it (from place 1 on) of a tridiagonal matrix with the same eigenvalues.
fn tridiagonal(of: &Matrix) -> (Vec<f64>, Vec<f64>) {
    let n = of.nrows();
    let mut a = Matrix::from_fn(n, n, |i, j| of[(i.max(j), i.min(j))]);
    let mut beside = vec![0.0; n];
    for k in (1..n).rev() {
        // Row k before place k is reflected onto its last entry.
        let mut v: Vec<f64> = (0..k).map(|j| a[(k, j)]).collect();
        let size = v.iter().fold(0.0_f64, |most, x| x.abs().max(most));
        if k == 1 || size == 0.0 {
            beside[k] = v[k - 1];
            continue;
        }
        for x in &mut v {
            *x /= size;
        }
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let length = if v[k - 1] > 0.0 { -length } else { length };
        beside[k] = size * length;
        v[k - 1] -= length;
        let half = v.iter().map(|x| x * x).sum::<f64>() / 2.0;
        // A - v q' - q v', q = (p - (v'p / 2h) v) / h, p = A v.
        let product = |i: usize| v.iter().enumerate().map(|(j, v)| a[(i, j)] * v).sum();
        let mut q: Vec<f64> = (0..k).map(product).collect();
        for q in &mut q {
            *q /= half;
        }
        let share = v.iter().zip(&q).map(|(v, q)| v * q).sum::<f64>() / (2.0 * half);
        q.iter_mut().zip(&v).for_each(|(q, v)| *q -= share * v);
        for j in 0..k {
            for i in 0..k {
                a[(i, j)] -= v[i] * q[j] + q[i] * v[j];
            }
        }
    }
    ((0..n).map(|i| a[(i, i)]).collect(), beside)
}

/// The QL algorithm with implicit shifts; leaves the eigenvalues in the diagonal, or returns false.
fn ql(diagonal: &mut [f64], beside: &mut [f64]) -> bool {
    const MOST: usize = 60;
    let n = diagonal.len();
    if n > 0 {
        beside.rotate_left(1);
        beside[n - 1] = 0.0;
    }
    for l in 0..n {
        for iteration in 0.. {
            let is_small = |m: &usize| {
                let both = diagonal[*m].abs() + diagonal[m + 1].abs();
                beside[*m].abs() <= f64::EPSILON * both
            };
            let m = (l..n - 1).find(is_small).unwrap_or(n - 1);
            if m == l {
                break;
            }
            if iteration == MOST {
                return false;
            }
            let g = (diagonal[l + 1] - diagonal[l]) / (2.0 * beside[l]);
            let r = (g * g + 1.0).sqrt().copysign(g);
            let mut g = diagonal[m] - diagonal[l] + beside[l] / (g + r);
            let (mut sin, mut cos, mut p) = (1.0, 1.0, 0.0);
            let mut ended = false;
            for i in (l..m).rev() {
                let (f, b) = (sin * beside[i], cos * beside[i]);
                let r = (f * f + g * g).sqrt();
                beside[i + 1] = r;
                if r == 0.0 {
                    diagonal[i + 1] -= p;
                    beside[m] = 0.0;
                    ended = true;
                    break;
                }
                (sin, cos) = (f / r, g / r);
                g = diagonal[i + 1] - p;
                let r = (diagonal[i] - g) * sin + 2.0 * cos * b;
                p = sin * r;
                diagonal[i + 1] = g + p;
                g = cos * r - b;
            }
            if !ended {
                diagonal[l] -= p;
                beside[l] = g;
                beside[m] = 0.0;
            }
        }
    }
    true
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.numbers[j * self.rows..][..self.rows][i]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.numbers[j * self.rows..][..self.rows][i]
    }
}

impl Mul for &Matrix {
    type Output = Matrix;

    fn mul(self, other: Self) -> Matrix {
        assert_eq!(self.columns, other.rows);
        let mut product = Matrix::zeros(self.rows, other.columns);
        if self.rows > 0 {
            with_fma!(|| multiply(self, other, &mut product.numbers));
        }
        product
    }
}

/// Adds the products `a_ik b_kj` in the order of k, two columns of the result and four of a at a time.
#[inline(always)]
fn multiply(a: &Matrix, b: &Matrix, to: &mut [f64]) {
    let (rows, inner) = (a.rows, a.columns);
    for (j, pair) in to.chunks_mut(2 * rows).enumerate() {
        let (left, right) = pair.split_at_mut(rows);
        let of_left = b.col(2 * j);
        let of_right = if right.is_empty() { of_left } else { b.col(2 * j + 1) };
        let mut k = 0;
        while k + 4 <= inner {
            let [a0, a1, a2, a3] = [0, 1, 2, 3].map(|l| &a.col(k + l)[..rows]);
            for (to, of) in [(&mut *left, of_left), (&mut *right, of_right)] {
                let [b0, b1, b2, b3] = [of[k], of[k + 1], of[k + 2], of[k + 3]];
                for (i, to) in to.iter_mut().enumerate() {
                    let sum = a1[i].mul_add(b1, a0[i].mul_add(b0, *to));
                    *to = a3[i].mul_add(b3, a2[i].mul_add(b2, sum));
                }
            }
            k += 4;
        }
        for k in k..inner {
            for (to, of) in [(&mut *left, of_left), (&mut *right, of_right)] {
                for (to, a) in to.iter_mut().zip(a.col(k)) {
                    *to = a.mul_add(of[k], *to);
                }
            }
        }
    }
}

/// Defines an operation on two matrices entry by entry.
macro_rules! by_entries {
    ($operation:ident, $name:ident, $sign:tt) => {
        impl $operation for &Matrix {
            type Output = Matrix;

            fn $name(self, other: Self) -> Matrix {
                assert!(self.rows == other.rows && self.columns == other.columns);
                Matrix::from_fn(self.rows, self.columns, |i, j| self[(i, j)] $sign other[(i, j)])
            }
        }
    };
}

by_entries!(Add, add, +);
by_entries!(Sub, sub, -);

impl AddAssign<&Self> for Matrix {
    fn add_assign(&mut self, other: &Self) {
        assert!(self.rows == other.rows && self.columns == other.columns);
        for (to, x) in self.numbers.iter_mut().zip(&other.numbers) {
            *to += x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Matrix;
    use crate::signal::{Purpose, stream};
    use faer::{Mat, Side};
    use rand::Rng as _;

    fn random(rows: usize, columns: usize, seed: u64) -> Matrix {
        let mut random = stream(seed, 0, Purpose::Plant);
        let mut uniform = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
        Matrix::from_fn(rows, columns, |_, _| uniform())
    }

    fn faer(of: &Matrix) -> Mat<f64> {
        Mat::from_fn(of.nrows(), of.ncols(), |i, j| of[(i, j)])
    }

    fn close(found: &Matrix, expected: &Mat<f64>, tolerance: f64) {
        let off = (faer(found) - expected).norm_max();
        assert!(off <= tolerance * expected.norm_max(), "{off:e}");
    }

    /// Products, solutions, roots and eigenvalues are those of faer, to rounding times the condition.
    #[test]
    fn the_numbers_of_another_library() {
        for n in [1, 2, 3, 7, 30] {
            let (a, b) = (random(n, n, 1), random(n, n + 2, 2));
            close(&(&a * &b), &(faer(&a) * faer(&b)), 1e-14);
            let condition = a.condition();
            let inverse = {
                use faer::linalg::solvers::Solve as _;
                let lu = faer(&a).partial_piv_lu();
                close(&a.solve(&b), &lu.solve(faer(&b)), 1e-14 * condition);
                lu.solve(Mat::<f64>::identity(n, n))
            };
            let norm = |m: &Mat<f64>| {
                (0..n)
                    .map(|j| (0..n).map(|i| m[(i, j)].abs()).sum::<f64>())
                    .fold(0.0, f64::max)
            };
            let expected = norm(&faer(&a)) * norm(&inverse);
            assert!((condition / expected - 1.0).abs() < 1e-13 * condition);
            let symmetric = &a + &a.transpose();
            let mut found = symmetric.symmetric_eigenvalues().unwrap();
            found.sort_by(f64::total_cmp);
            let expected = faer(&symmetric).self_adjoint_eigenvalues(Side::Lower).unwrap();
            for (x, y) in found.iter().zip(&expected) {
                assert!((x - y).abs() < 1e-13 * n as f64, "{x} {y}");
            }
            // Of rank n - 1.
            let half = random(n, n.max(2) - 1, 3);
            let gram = &half * &half.transpose();
            let root = gram.root();
            close(&(&root * &root.transpose()), &faer(&gram), 1e-14);
        }
    }

    #[test]
    fn singular_matrices_have_no_finite_condition() {
        let one = Matrix::from_fn(3, 3, |_, _| 1.0);
        assert!(!(one.condition() < 1e15));
        assert_eq!(one.symmetric_eigenvalues().unwrap().len(), 3);
        assert_eq!(Matrix::zeros(0, 0).symmetric_eigenvalues(), Some(vec![]));
    }
}
