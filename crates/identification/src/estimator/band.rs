//! The covariance of a sum of filtered white noises from rest: a band matrix, and its Cholesky factor.

/// L of `sum_s v_s T_s T_s' = L L'`, T_s the Toeplitz matrix of a polynomial c_s: N x N, lower triangular, with as many
/// diagonals as the longest polynomial has coefficients. It is the covariance of `sum_s c_s(q) w_s(k)`, k = 0 ... N-1,
/// the w_s white with variances v_s and zero before k = 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct BandRoot {
    /// Numbers of a row: the diagonal is the last.
    width: usize,
    rows: Vec<f64>,
}

impl BandRoot {
    /// Factorises in O(N width^2); `None` if the matrix is not positive definite.
    pub(crate) fn new(terms: &[(f64, &[f64])], samples: usize) -> Option<Self> {
        let width = terms.iter().map(|(_, c)| c.len()).max()?.max(1);
        let mut root = Self {
            width,
            rows: vec![0.0; width * samples],
        };
        for k in 0..samples {
            for l in k.saturating_sub(width - 1)..=k {
                let mut sum: f64 = terms.iter().map(|(v, c)| v * lagged(c, c, k - l, l)).sum();
                for m in k.saturating_sub(width - 1)..l {
                    sum -= root.at(k, m) * root.at(l, m);
                }
                if l < k {
                    sum /= root.at(l, l);
                } else if sum > 0.0 && sum.is_finite() {
                    sum = sum.sqrt();
                } else {
                    return None;
                }
                root.rows[k * width + l + width - 1 - k] = sum;
            }
        }
        Some(root)
    }

    /// The derivative of L where that of `L L'` is `sum_s v_s T_x T_y'`, symmetric and within the band: terms v, x, y.
    pub(crate) fn derivative(&self, terms: &[(f64, &[f64], &[f64])]) -> Self {
        let width = self.width;
        let mut by = Self {
            width,
            rows: vec![0.0; self.rows.len()],
        };
        for k in 0..self.rows.len() / width {
            let first = k.saturating_sub(width - 1);
            for l in first..=k {
                let lagged = |(v, x, y): &(f64, &[f64], &[f64])| v * lagged(y, x, k - l, l);
                let mut sum: f64 = terms.iter().map(lagged).sum();
                for m in first..l {
                    sum -= by.at(k, m) * self.at(l, m) + self.at(k, m) * by.at(l, m);
                }
                sum = if l < k {
                    (sum - self.at(k, l) * by.at(l, l)) / self.at(l, l)
                } else {
                    sum / (2.0 * self.at(k, k))
                };
                by.rows[k * width + l + width - 1 - k] = sum;
            }
        }
        by
    }

    /// Subtracts the product with a vector.
    pub(crate) fn subtract_product(&self, x: &[f64], from: &mut [f64]) {
        for (k, to) in from.iter_mut().enumerate() {
            let first = k.saturating_sub(self.width - 1);
            *to -= (first..=k).map(|l| self.at(k, l) * x[l]).sum::<f64>();
        }
    }

    /// Entry (k, l), `l <= k`, within the band.
    pub(crate) fn at(&self, k: usize, l: usize) -> f64 {
        self.rows[k * self.width + l + self.width - 1 - k]
    }

    /// Computes `x = L^-1 x`.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        for k in 0..x.len() {
            let first = k.saturating_sub(self.width - 1);
            let sum: f64 = (first..k).map(|l| self.at(k, l) * x[l]).sum();
            x[k] = (x[k] - sum) / self.at(k, k);
        }
    }

    /// Computes `x = L^-T x`.
    pub(crate) fn solve_transposed(&self, x: &mut [f64]) {
        for k in (0..x.len()).rev() {
            x[k] /= self.at(k, k);
            for l in k.saturating_sub(self.width - 1)..k {
                x[l] -= self.at(k, l) * x[k];
            }
        }
    }
}

/// `sum_m y_m x_(m+lag)` over m up to `most`: the first samples have fewer terms.
fn lagged(y: &[f64], x: &[f64], lag: usize, most: usize) -> f64 {
    let late = x.get(lag..).unwrap_or_default();
    y.iter().zip(late).take(most + 1).map(|(y, x)| y * x).sum()
}
