//! Normal equations of delayed signals, from which starts of searches come: few inner products, in time linear in N.

use super::FailureKind;
use crate::failure::all_finite;
use crate::signal::arithmetic;

/// Checks that the squares of samples can be summed.
///
/// # Errors
/// [`FailureKind::NonFinite`]; pivots of such sums would say that the record determines nothing.
pub(super) fn check_squares(signals: [&[f64]; 2]) -> Result<(), FailureKind> {
    all_finite(&signals.map(|signal| dot(signal, signal)))
}

/// Calls `put(i, j, sum_k a(k-i) b(k-j))` for delays i in `of_a` and j in `of_b` (first delay and count), k = 0 ...
/// N-1, with zeros before the record. Only sums with the first i or the first j are inner products; the others follow:
/// `s(i+1, j+1) = s(i, j) - a(N-1-i) b(N-1-j)`.
pub(super) fn lagged_products(
    a: &[f64],
    b: &[f64],
    of_a: (usize, usize),
    of_b: (usize, usize),
    mut put: impl FnMut(usize, usize, f64),
) {
    let n = a.len();
    let ((first_a, count_a), (first_b, count_b)) = (of_a, of_b);
    let mut diagonal = |i: usize, j: usize| {
        let (delay_a, delay_b) = (first_a + i, first_b + j);
        let late = delay_a.max(delay_b);
        let mut sum = if late < n {
            dot(&a[late - delay_a..n - delay_a], &b[late - delay_b..n - delay_b])
        } else {
            0.0
        };
        for step in 0..(count_a - i).min(count_b - j) {
            put(i + step, j + step, sum);
            if late + step < n {
                sum -= a[n - 1 - delay_a - step] * b[n - 1 - delay_b - step];
            }
        }
    };
    for j in 0..if count_a > 0 { count_b } else { 0 } {
        diagonal(0, j);
    }
    for i in 1..if count_b > 0 { count_a } else { 0 } {
        diagonal(i, 0);
    }
}

/// A square system `M x = right`, row by row.
#[derive(Default)]
pub(super) struct System {
    width: usize,
    pub(super) m: Vec<f64>,
    pub(super) right: Vec<f64>,
}

/// Pivots below this share of the diagonal are rounding, whatever is done with the solution.
pub(super) const TINY: f64 = 1e-13;

impl System {
    /// Makes room for a system with `width` unknowns, all zero.
    pub(super) fn clear(&mut self, width: usize) {
        self.width = width;
        self.m.clear();
        self.m.resize(width * width, 0.0);
        self.right.clear();
        self.right.resize(width, 0.0);
    }

    /// Sets an entry of M, and of the right-hand side for the column after the last.
    pub(super) fn put(&mut self, row: usize, column: usize, value: f64) {
        if column == self.width {
            self.right[row] = value;
        } else {
            self.m[row * self.width + column] = value;
        }
    }

    /// Adds to what [`Self::put`] sets.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        if column == self.width {
            self.right[row] += value;
        } else {
            self.m[row * self.width + column] += value;
        }
    }

    /// Replaces a symmetric M by L, `M = L L'`, and the right-hand side by `L^-1 right`, as far as M is positive
    /// definite beyond rounding: as pivots exceed this share of the diagonal. Returns to how many unknowns. The lower
    /// triangle of M is used.
    pub(super) fn factorise(&mut self, tiny: f64) -> usize {
        let n = self.width;
        for i in 0..n {
            let (done, row) = self.m.split_at_mut(i * n);
            let diagonal = row[i];
            for j in 0..i {
                let of_j = &done[j * n..];
                row[j] = (row[j] - dot(&row[..j], &of_j[..j])) / of_j[j];
            }
            let square = diagonal - dot(&row[..i], &row[..i]);
            if !(square > tiny * diagonal && square.is_finite()) {
                return i;
            }
            row[i] = square.sqrt();
            self.right[i] = (self.right[i] - dot(&row[..i], &self.right[..i])) / row[i];
        }
        n
    }

    /// Computes `x = L^-T right` of the first unknowns, as many as x has, after [`Self::factorise`].
    pub(super) fn back_substitute(&self, x: &mut [f64]) {
        let n = x.len();
        x.copy_from_slice(&self.right[..n]);
        for i in (0..n).rev() {
            let row = &self.m[i * self.width..];
            x[i] /= row[i];
            let value = x[i];
            for (x, l) in x[..i].iter_mut().zip(row) {
                *x -= l * value;
            }
        }
    }

    /// Returns row i of L up to its diagonal.
    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.m[i * self.width..=i * self.width + i]
    }

    /// Solves by elimination with row pivoting; false if a pivot is zero or something overflows.
    pub(super) fn solve(&mut self, x: &mut [f64]) -> bool {
        let n = self.width;
        for j in 0..n {
            let size = |i: &usize| self.m[i * n + j].abs();
            let pivot = (j..n).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(j);
            if !(self.m[pivot * n + j].abs() > 0.0) {
                return false;
            }
            if pivot != j {
                for column in 0..n {
                    self.m.swap(j * n + column, pivot * n + column);
                }
                self.right.swap(j, pivot);
            }
            let (done, rest) = self.m.split_at_mut((j + 1) * n);
            let row = &done[j * n..];
            for (i, below) in rest.chunks_exact_mut(n).enumerate() {
                let factor = below[j] / row[j];
                for (below, row) in below[j..].iter_mut().zip(&row[j..]) {
                    *below -= factor * row;
                }
                self.right[j + 1 + i] -= factor * self.right[j];
            }
        }
        for i in (0..n).rev() {
            let row = &self.m[i * n..];
            let sum: f64 = (i + 1..n).map(|j| row[j] * x[j]).sum();
            x[i] = (self.right[i] - sum) / row[i];
        }
        x.iter().all(|x| x.is_finite())
    }
}

/// Returns `sum x(k) y(k)`.
pub(in crate::estimator) fn dot(x: &[f64], y: &[f64]) -> f64 {
    with_fma!(|| arithmetic::dot(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the sums themselves, for delays of every kind, also beyond the record.
    #[test]
    fn products_follow_from_the_first() {
        let signal = |factor: f64| -> Vec<f64> { (0..9).map(|k| (factor * f64::from(k)).sin()).collect() };
        let (a, b) = (signal(0.7), signal(1.9));
        for (of_a, of_b) in [((0, 4), (0, 4)), ((1, 3), (0, 6)), ((2, 11), (1, 2)), ((0, 0), (1, 3))] {
            let mut count = 0;
            lagged_products(&a, &b, of_a, of_b, |i, j, found| {
                let at = |x: &[f64], k: usize, delay: usize| k.checked_sub(delay).map_or(0.0, |k| x[k]);
                let expected: f64 = (0..9).map(|k| at(&a, k, of_a.0 + i) * at(&b, k, of_b.0 + j)).sum();
                assert!((found - expected).abs() < 1e-14, "{of_a:?} {of_b:?} {i} {j}");
                count += 1;
            });
            assert_eq!(count, of_a.1 * of_b.1);
        }
    }

    /// `M = [[4, 2], [2, 5]]`, right (8, 14): x = (0.75, 2.5), by Cholesky and by elimination.
    #[test]
    fn systems_by_hand() {
        let mut x = [0.0; 2];
        for cholesky in [true, false] {
            let mut system = System::default();
            system.clear(2);
            for (row, values) in [[4.0, 2.0, 8.0], [2.0, 5.0, 14.0]].iter().enumerate() {
                for (column, value) in values.iter().enumerate() {
                    system.put(row, column, *value);
                }
            }
            if cholesky {
                assert_eq!(system.factorise(TINY), 2);
                system.back_substitute(&mut x);
            } else {
                assert!(system.solve(&mut x));
            }
            assert!((x[0] - 0.75).abs() < 1e-15 && (x[1] - 2.5).abs() < 1e-15);
        }
        let mut singular = System::default();
        singular.clear(2);
        singular.m.fill(1.0);
        assert_eq!(singular.factorise(TINY), 1);
        singular.m.fill(1.0);
        assert!(!singular.solve(&mut x));
    }
}
