//! Determinants and adjugates of small matrices, singular ones included: the mixing step of DREM.

use crate::observer::determinant;
use crate::real::Real;

/// Buffers for the adjugates of matrices of one order.
#[derive(Clone, Debug)]
pub struct Mixer<R = f64> {
    n: usize,
    minor: Vec<R>,
    adjugate: Vec<R>,
}

impl<R: Real> Mixer<R> {
    /// Makes the buffers for n x n matrices, n >= 1.
    pub fn new(n: usize) -> Self {
        Self {
            n,
            minor: vec![R::zero(); n.saturating_sub(1).pow(2)],
            adjugate: vec![R::zero(); n * n],
        }
    }

    /// Mixes `zbar = M theta + dbar`, Eq. (10): computes `mbar = adj(M) zbar` (n numbers) and returns
    /// `Delta = det(M)`.
    ///
    /// # Panics
    /// If a slice is shorter than n^2 (`m`) or n.
    #[inline(always)]
    pub fn mix(&mut self, m: &[R], zbar: &[R], mbar: &mut [R]) -> R {
        // An order that is a constant is unrolled.
        match self.n {
            2 => self.mix_of_order(2, m, zbar, mbar),
            3 => self.mix_of_order(3, m, zbar, mbar),
            n => self.mix_of_order(n, m, zbar, mbar),
        }
    }

    #[inline(always)]
    fn mix_of_order(&mut self, n: usize, m: &[R], zbar: &[R], mbar: &mut [R]) -> R {
        let (m, zbar, mbar) = (&m[..n * n], &zbar[..n], &mut mbar[..n]);
        let Self { minor, adjugate, .. } = self;
        let adjugate = &mut adjugate[..n * n];
        let delta = self::adjugate(n, m, minor, adjugate);
        for i in 0..n {
            let mut sum = R::splat(-0.0);
            for j in 0..n {
                sum = sum + adjugate[i * n + j] * zbar[j];
            }
            mbar[i] = sum;
        }
        delta
    }

    /// Returns `(det(M), first component of adj(M) zbar)`: the scalar regression of the first unknown alone, for an
    /// order N that is that of the mixer.
    ///
    /// # Panics
    /// If a slice is shorter than N^2 (`m`) or N.
    #[inline(always)]
    pub(super) fn mix_first<const N: usize>(&mut self, m: &[R], zbar: &[R]) -> (R, R) {
        let (m, zbar) = (&m[..N * N], &zbar[..N]);
        let (mut delta, mut mixed) = (R::zero(), R::zero());
        for i in 0..N {
            let cofactor = cofactor(N, m, [i, 0], &mut self.minor);
            delta = delta + m[i * N] * cofactor;
            mixed = mixed + zbar[i] * cofactor;
        }
        (delta, mixed)
    }
}

/// Computes `adj(M)` into `out` and returns `det(M)`; both matrices are row-major n x n.
/// `adj(M) M = M adj(M) = det(M) I`.
///
/// Each cofactor is the determinant of a minor, by LU with partial pivoting, so the rank of M does not matter. The
/// determinant is the expansion along the first row. O(n^5). Errors are of the order `eps norm(M)^(n-1)` for the
/// adjugate and `eps norm(M)^n` for the determinant.
///
/// # Panics
/// If a slice is shorter than n^2, or `minor` than (n-1)^2.
#[inline(always)]
fn adjugate<R: Real>(n: usize, m: &[R], minor: &mut [R], out: &mut [R]) -> R {
    for i in 0..n {
        for j in 0..n {
            out[i * n + j] = cofactor(n, m, [j, i], minor);
        }
    }
    // The sum of nothing is -0.
    let mut sum = R::splat(-0.0);
    for j in 0..n {
        sum = sum + m[j] * out[j * n];
    }
    sum
}

/// Returns `(-1)^(row + column)` times the determinant of M without that row and column.
#[inline(always)]
fn cofactor<R: Real>(n: usize, m: &[R], [row, column]: [usize; 2], minor: &mut [R]) -> R {
    let after = |skipped: usize, k: usize| k + usize::from(k >= skipped);
    let at = |i: usize, j: usize| m[after(row, i) * n + after(column, j)];
    let minor = match n {
        1 => R::splat(1.0),
        2 => at(0, 0),
        3 => at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0),
        _ => {
            for i in 0..n - 1 {
                for j in 0..n - 1 {
                    minor[j * (n - 1) + i] = at(i, j);
                }
            }
            determinant(n - 1, minor)
        }
    };
    if (row + column).is_multiple_of(2) {
        minor
    } else {
        -minor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers in (-1, 1) from Knuth's MMIX generator.
    struct Uniform(u64);
    impl Uniform {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn product(a: &[f64], b: &[f64], n: usize, inner: usize) -> Vec<f64> {
        (0..n * n)
            .map(|k| (0..inner).map(|l| a[k / n * inner + l] * b[l * n + k % n]).sum())
            .collect()
    }

    fn norm(m: &[f64]) -> f64 {
        m.iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// adj(M) M = M adj(M) = det(M) I for random matrices of rank n, n - 1, n - 2.
    #[test]
    fn adjugate_times_matrix_is_determinant() {
        let mut uniform = Uniform(1);
        for n in 1..=6_usize {
            let mut minor = vec![0.0; n.saturating_sub(1).pow(2)];
            for rank in n.saturating_sub(2)..=n {
                for _ in 0..50 {
                    let left: Vec<f64> = (0..n * rank).map(|_| uniform.next()).collect();
                    let right: Vec<f64> = (0..n * rank).map(|_| uniform.next()).collect();
                    let m = product(&left, &right, n, rank);
                    let mut adjugate = vec![0.0; n * n];
                    let det = super::adjugate(n, &m, &mut minor, &mut adjugate);
                    let tolerance = 8.0 * (n * n) as f64 * f64::EPSILON * norm(&m).powi(n as i32);
                    assert!((det - determinant(n, &mut m.clone())).abs() <= tolerance);
                    if rank < n {
                        assert!(det.abs() <= tolerance);
                    }
                    for p in [product(&adjugate, &m, n, n), product(&m, &adjugate, n, n)] {
                        for (k, p) in p.iter().enumerate() {
                            let expected = if k / n == k % n { det } else { 0.0 };
                            assert!((p - expected).abs() <= tolerance, "n {n} rank {rank}");
                        }
                    }
                }
            }
        }
    }

    /// The adjugate of a matrix of rank n - 1 is not zero: it is the product of its null vectors.
    /// By hand.
    #[test]
    fn adjugate_of_rank_two_of_three() {
        let m = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        let mut out = [0.0; 9];
        let det = adjugate(3, &m, &mut [], &mut out);
        assert_eq!(det, 0.0);
        assert_eq!(out, [-3.0, 6.0, -3.0, 6.0, -12.0, 6.0, -3.0, 6.0, -3.0]);
    }

    #[test]
    fn mixing_a_vector() {
        let mut uniform = Uniform(2);
        for n in 1..=5 {
            let m: Vec<f64> = (0..n * n).map(|_| uniform.next()).collect();
            let theta: Vec<f64> = (0..n).map(|_| uniform.next()).collect();
            let zbar: Vec<f64> = (0..n).map(|i| (0..n).map(|j| m[i * n + j] * theta[j]).sum()).collect();
            let mut mbar = vec![0.0; n];
            let mut mixer = Mixer::new(n);
            let delta = mixer.mix(&m, &zbar, &mut mbar);
            for (mbar, theta) in mbar.iter().zip(&theta) {
                assert!((mbar - delta * theta).abs() < 1e-14 * norm(&m).powi(n as i32) * 8.0);
            }
            let (first_delta, first) = match n {
                1 => mixer.mix_first::<1>(&m, &zbar),
                2 => mixer.mix_first::<2>(&m, &zbar),
                3 => mixer.mix_first::<3>(&m, &zbar),
                4 => mixer.mix_first::<4>(&m, &zbar),
                _ => mixer.mix_first::<5>(&m, &zbar),
            };
            assert!((first - mbar[0]).abs() < 1e-14 && (first_delta - delta).abs() < 1e-14);
        }
    }
}
