//! Determinants and adjugates of small matrices, singular ones included: the mixing step of DREM.

/// Buffers for the adjugates of matrices of one order.
#[derive(Clone, Debug)]
pub struct Mixer {
    n: usize,
    minor: Vec<f64>,
    adjugate: Vec<f64>,
}

impl Mixer {
    /// Makes the buffers for n x n matrices, n >= 1.
    pub fn new(n: usize) -> Self {
        Self {
            n,
            minor: vec![0.0; n.saturating_sub(1).pow(2)],
            adjugate: vec![0.0; n * n],
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
    /// If a slice is shorter than n^2.
    pub fn adjugate(&mut self, m: &[f64], out: &mut [f64]) -> f64 {
        let n = self.n;
        for i in 0..n {
            for j in 0..n {
                out[i * n + j] = self.cofactor(m, j, i);
            }
        }
        (0..n).map(|j| m[j] * out[j * n]).sum()
    }

    /// Mixes `zbar = M theta + dbar`, Eq. (10): computes `mbar = adj(M) zbar` (n numbers) and returns `Delta = det(M)`.
    ///
    /// # Panics
    /// If a slice is shorter than n^2 (`m`) or n.
    pub fn mix(&mut self, m: &[f64], zbar: &[f64], mbar: &mut [f64]) -> f64 {
        let n = self.n;
        let mut adjugate = std::mem::take(&mut self.adjugate);
        let delta = self.adjugate(m, &mut adjugate);
        for (mbar, row) in mbar.iter_mut().zip(adjugate.chunks_exact(n)) {
            *mbar = row.iter().zip(zbar).map(|(a, z)| a * z).sum();
        }
        self.adjugate = adjugate;
        delta
    }

    /// Returns `(det(M), first component of adj(M) zbar)`: the scalar regression of the first unknown alone.
    ///
    /// # Panics
    /// If a slice is shorter than n^2 (`m`) or n.
    pub fn mix_first(&mut self, m: &[f64], zbar: &[f64]) -> (f64, f64) {
        (0..self.n).fold((0.0, 0.0), |(delta, mixed), i| {
            let cofactor = self.cofactor(m, i, 0);
            (delta + m[i * self.n] * cofactor, mixed + zbar[i] * cofactor)
        })
    }

    /// Returns `(-1)^(row + column)` times the determinant of M without that row and column.
    #[inline]
    fn cofactor(&mut self, m: &[f64], row: usize, column: usize) -> f64 {
        let n = self.n;
        let sign = if (row + column).is_multiple_of(2) {
            1.0
        } else {
            -1.0
        };
        let after = |skipped: usize, k: usize| k + usize::from(k >= skipped);
        let at = |i: usize, j: usize| m[after(row, i) * n + after(column, j)];
        let minor = match n {
            1 => 1.0,
            2 => at(0, 0),
            3 => at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0),
            _ => {
                for i in 0..n - 1 {
                    for j in 0..n - 1 {
                        self.minor[i * (n - 1) + j] = at(i, j);
                    }
                }
                determinant(&mut self.minor, n - 1)
            }
        };
        sign * minor
    }
}

/// Returns the determinant of a row-major n x n matrix by LU with partial pivoting. The matrix is overwritten.
///
/// # Panics
/// If the slice is shorter than n^2.
pub fn determinant(m: &mut [f64], n: usize) -> f64 {
    let mut product = 1.0;
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| {
            if m[i * n + k].abs() > m[best * n + k].abs() {
                i
            } else {
                best
            }
        });
        if pivot != k {
            for j in k..n {
                m.swap(k * n + j, pivot * n + j);
            }
            product = -product;
        }
        let diagonal = m[k * n + k];
        if diagonal == 0.0 {
            return 0.0;
        }
        product *= diagonal;
        for i in k + 1..n {
            let factor = m[i * n + k] / diagonal;
            for j in k + 1..n {
                m[i * n + j] -= factor * m[k * n + j];
            }
        }
    }
    product
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
            .map(|k| {
                (0..inner)
                    .map(|l| a[k / n * inner + l] * b[l * n + k % n])
                    .sum()
            })
            .collect()
    }

    fn norm(m: &[f64]) -> f64 {
        m.iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// adj(M) M = M adj(M) = det(M) I for random matrices of rank n, n - 1, n - 2.
    #[test]
    fn adjugate_times_matrix_is_determinant() {
        let mut uniform = Uniform(1);
        for n in 1..=6 {
            let mut mixer = Mixer::new(n);
            for rank in n.saturating_sub(2)..=n {
                for _ in 0..50 {
                    let left: Vec<f64> = (0..n * rank).map(|_| uniform.next()).collect();
                    let right: Vec<f64> = (0..n * rank).map(|_| uniform.next()).collect();
                    let m = product(&left, &right, n, rank);
                    let mut adjugate = vec![0.0; n * n];
                    let det = mixer.adjugate(&m, &mut adjugate);
                    let tolerance = 8.0 * (n * n) as f64 * f64::EPSILON * norm(&m).powi(n as i32);
                    assert!((det - determinant(&mut m.clone(), n)).abs() <= tolerance);
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
        let det = Mixer::new(3).adjugate(&m, &mut out);
        assert_eq!(det, 0.0);
        assert_eq!(out, [-3.0, 6.0, -3.0, 6.0, -12.0, 6.0, -3.0, 6.0, -3.0]);
    }

    #[test]
    fn mixing_a_vector() {
        let mut uniform = Uniform(2);
        for n in 1..=5 {
            let m: Vec<f64> = (0..n * n).map(|_| uniform.next()).collect();
            let theta: Vec<f64> = (0..n).map(|_| uniform.next()).collect();
            let zbar: Vec<f64> = (0..n)
                .map(|i| (0..n).map(|j| m[i * n + j] * theta[j]).sum())
                .collect();
            let mut mbar = vec![0.0; n];
            let mut mixer = Mixer::new(n);
            let delta = mixer.mix(&m, &zbar, &mut mbar);
            for (mbar, theta) in mbar.iter().zip(&theta) {
                assert!((mbar - delta * theta).abs() < 1e-14 * norm(&m).powi(n as i32) * 8.0);
            }
            let (first_delta, first) = mixer.mix_first(&m, &zbar);
            assert!((first - mbar[0]).abs() < 1e-14 && (first_delta - delta).abs() < 1e-14);
        }
    }
}
