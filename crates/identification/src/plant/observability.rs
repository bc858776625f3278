//! Observability in any coordinates.

use faer::MatRef;

/// Returns the numerical rank of the observability matrix `[C'; C'A; ...; C'A^(n-1)]` without forming it.
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
    // In units of its largest entry, no square of C overflows or underflows.
    let largest = c.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if largest == 0.0 {
        return 0;
    }
    let mut q: Vec<f64> = c.iter().map(|v| v / largest).collect();
    let unit = norm(&q);
    scale(&mut q, 1.0 / unit);
    let tolerance = 16.0 * n as f64 * f64::EPSILON;
    let mut basis = vec![q];
    while basis.len() < n {
        let q = &basis[basis.len() - 1];
        let mut next: Vec<f64> = (0..n)
            .map(|j| (0..n).map(|i| a[(i, j)] * q[i]).sum())
            .collect();
        let rounding: Vec<f64> = (0..n)
            .map(|j| (0..n).map(|i| (a[(i, j)] * q[i]).abs()).sum())
            .collect();
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
    use faer::{Mat, mat};

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
}
