//! Observability in any coordinates.

use super::balance::{column_sizes, eigenvalues, in_units, own_rate, power_of_two};
use faer::{Mat, MatRef};

/// The observability matrix `[C'; C'A/w; ...; C'(A/w)^(n-1)]` in a unit of time of the plant's own, so that it does not
/// depend on what time is measured in, and its powers neither grow nor vanish.
pub(crate) struct Observability {
    /// w, the largest modulus of the eigenvalues of A; if that is 0, the norm of [`own_rate`].
    pub(crate) rate: f64,
    /// A/w.
    pub(crate) a: Mat<f64>,
    /// The matrix, n x n.
    pub(crate) matrix: Mat<f64>,
}

impl Observability {
    /// Computes it for A (n x n) and C (n).
    pub(crate) fn new(a: MatRef<'_, f64>, c: &[f64]) -> Self {
        let n = a.nrows();
        let poles = eigenvalues(a).unwrap_or_default();
        let radius = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        let rate = if radius > 0.0 { radius } else { own_rate(a) };
        let a = Mat::from_fn(n, n, |i, j| a[(i, j)] / rate);
        let matrix = observability_matrix(&a, c);
        Self { rate, a, matrix }
    }
}

/// Returns the matrix of the rows `C'; C'A; ...; C'A^(n-1)`, n x n.
pub(super) fn observability_matrix(a: &Mat<f64>, c: &[f64]) -> Mat<f64> {
    let n = a.nrows();
    let mut matrix = Mat::<f64>::zeros(n, n);
    let mut row = Mat::from_fn(1, n, |_, j| c[j]);
    for i in 0..n {
        matrix.row_mut(i).copy_from(row.row(0));
        row = &row * a;
    }
    matrix
}

/// Returns the numerical rank of the observability matrix `[C'; C'A; ...; C'A^(n-1)]`, which does not depend on the
/// units of states and time: a state is counted by what it does to y and its derivatives.
///
/// The rank is the dimension of the Krylov space of (A', C), found by the Arnoldi process, whose vectors stay
/// orthonormal when the powers become parallel. The space is complete when the new part of `A'q` is at most `16 n eps`
/// times the norm of `|A'| |q|`, which is the possible rounding error of `A'q`. Source: the staircase algorithm, P. Van
/// Dooren, IEEE Trans. Automatic Control 26 (1981) 111-129, for one output.
///
/// # Panics
/// If C has fewer than n entries.
pub fn observability_rank(a: MatRef<'_, f64>, c: &[f64]) -> usize {
    let n = a.nrows();
    // In units of its largest entry, no power of C overflows or underflows.
    let largest = c.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if largest == 0.0 {
        return 0;
    }
    let c: Vec<f64> = c.iter().map(|v| v / largest).collect();
    let own = Observability::new(a, &c);
    let sizes = column_sizes(own.matrix.as_ref());
    let units: Vec<f64> = sizes.iter().map(|size| power_of_two(*size).recip()).collect();
    let a = in_units(own.a.as_ref(), &units);
    let mut q: Vec<f64> = c.iter().zip(&units).map(|(v, unit)| v * unit).collect();
    let unit = norm(&q);
    scale(&mut q, 1.0 / unit);
    let tolerance = 16.0 * n as f64 * f64::EPSILON;
    let mut basis = vec![q];
    while basis.len() < n {
        let q = &basis[basis.len() - 1];
        let mut next: Vec<f64> = (0..n).map(|j| (0..n).map(|i| a[(i, j)] * q[i]).sum()).collect();
        let rounding: Vec<f64> = (0..n).map(|j| (0..n).map(|i| (a[(i, j)] * q[i]).abs()).sum()).collect();
        // Two orthogonalisations are enough (Kahan, Parlett).
        for _ in 0..2 {
            for q in &basis {
                let along: f64 = next.iter().zip(q).map(|(v, q)| v * q).sum();
                next.iter_mut().zip(q).for_each(|(v, q)| *v -= along * q);
            }
        }
        let new = norm(&next);
        if !(new > tolerance * norm(&rounding)) {
            break;
        }
        scale(&mut next, 1.0 / new);
        basis.push(next);
    }
    basis.len()
}

fn scale(v: &mut [f64], by: f64) {
    for v in v {
        *v *= by;
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::{Scale, mat};

    /// Two equal modes in parallel, hidden by a change of coordinates: rank 2 of 3.
    #[test]
    fn unobservable_in_any_coordinates() {
        let a = mat![[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -2.0]];
        let t = mat![[1.0, 0.3, -2.0], [0.7, 1.1, 0.2], [-0.4, 0.9, 1.7]];
        assert_eq!(observability_rank(a.as_ref(), &[1.0, 2.0, 3.0]), 2);
        let inverse = {
            use faer::linalg::solvers::Solve;
            t.partial_piv_lu().solve(Mat::<f64>::identity(3, 3))
        };
        let hidden = &t * a * &inverse;
        let c: Vec<f64> = (0..3)
            .map(|j| (0..3).map(|i| inverse[(i, j)] * [1.0, 2.0, 3.0][i]).sum())
            .collect();
        assert_eq!(observability_rank(hidden.as_ref(), &c), 2);
    }

    /// Three lags in a row and side by side, with states in units of 1e-12, 1 and 1e12 and times in nanoseconds.
    #[test]
    fn units_do_not_matter() {
        let row = mat![[-1.0, 1.0, 0.0], [0.0, -2.0, 1.0], [0.0, 0.0, -3.0]];
        let side = mat![[-1.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, -3.0]];
        for (plain, c) in [(row, [1.0, 0.0, 0.0]), (side, [1.0, 1.0, 1.0])] {
            for rate in [1e-9, 1.0, 1e9] {
                for units in [[1e-12, 1.0, 1e12], [1e12, 1.0, 1e-12], [1.0, 1e12, 1e-12]] {
                    let a = Scale(rate) * in_units(plain.as_ref(), &units);
                    let c = [0, 1, 2].map(|i| c[i] * units[i]);
                    assert_eq!(observability_rank(a.as_ref(), &c), 3, "{units:?}");
                }
            }
        }
    }
}
