//! Steady gains of one canonical plant for many process noises: the doubling of `riccati`, without allocation.

/// The steady-state filter of `x(k+1) = A x(k) + w(k)`, `y(k) = x_1(k) + v(k)`, `A = [0 | I; a']`, `E[v v] = 1`.
#[derive(Clone, Debug)]
pub(super) struct SteadyGain {
    n: usize,
    /// A', G and H of the doubling, then scratch; each n x n by columns.
    a: Vec<f64>,
    g: Vec<f64>,
    h: Vec<f64>,
    w: Vec<f64>,
    wa: Vec<f64>,
    wg: Vec<f64>,
    product: Vec<f64>,
    more: Vec<f64>,
    gain: Vec<f64>,
}

impl SteadyGain {
    /// Returns the buffers for order n.
    pub(super) fn new(n: usize) -> Self {
        let square = || vec![0.0; n * n];
        Self {
            n,
            a: square(),
            g: square(),
            h: square(),
            w: square(),
            wa: square(),
            wg: square(),
            product: square(),
            more: square(),
            gain: vec![0.0; n],
        }
    }

    /// Returns the gain `K = A P e_1 / (P_11 + 1)`, n numbers, and the innovation variance `P_11 + 1` for E[w w'] = Q
    /// (n x n, by columns), which must be positive definite: then the only solution P >= 0 stabilises. `None` if the
    /// doubling overflows or does not settle.
    pub(super) fn solve(&mut self, a: &[f64], q: &[f64]) -> Option<(&[f64], f64)> {
        let n = self.n;
        self.a.fill(0.0);
        for (i, a) in a.iter().enumerate() {
            self.a[(n - 1) * n + i] = *a;
            if i + 1 < n {
                self.a[i * n + i + 1] = 1.0;
            }
        }
        self.g.fill(0.0);
        self.g[0] = 1.0;
        self.h.copy_from_slice(q);
        for _ in 0..60 {
            self.double()?;
            let (norm, change) = (square(&self.h), square(&self.more));
            if !(norm.is_finite() && square(&self.g).is_finite() && square(&self.a).is_finite()) {
                return None;
            }
            if change <= f64::EPSILON * f64::EPSILON * norm {
                return Some(self.gain(a));
            }
        }
        None
    }

    /// Does one step: `H+ = H + A'H W^-1 A`, `G+ = G + A W^-1 G A'`, `A+ = A W^-1 A` with `W = I + G H`, for the
    /// transposed plant.
    fn double(&mut self) -> Option<()> {
        let n = self.n;
        multiply(n, &self.g, &self.h, &mut self.w);
        for i in 0..n {
            self.w[i * n + i] += 1.0;
        }
        self.wa.copy_from_slice(&self.a);
        self.wg.copy_from_slice(&self.g);
        eliminate(n, &mut self.w, &mut [&mut self.wa, &mut self.wg])?;
        multiply(n, &self.h, &self.wa, &mut self.product);
        multiply_transposed(n, &self.a, &self.product, &mut self.more);
        add_symmetric(n, &self.more, &mut self.h);
        multiply(n, &self.a, &self.wg, &mut self.product);
        // product A', by the transposed a
        transpose(n, &self.a, &mut self.w);
        multiply(n, &self.product, &self.w, &mut self.wg);
        add_symmetric(n, &self.wg, &mut self.g);
        multiply(n, &self.a, &self.wa, &mut self.product);
        std::mem::swap(&mut self.a, &mut self.product);
        Some(())
    }

    /// Returns the gain of P = H and the innovation variance.
    fn gain(&mut self, a: &[f64]) -> (&[f64], f64) {
        let (n, p) = (self.n, &self.h[..self.n]);
        let innovation = p[0] + 1.0;
        let last: f64 = a.iter().zip(p).map(|(a, p)| a * p).sum();
        for i in 0..n {
            let predicted = if i + 1 < n { p[i + 1] } else { last };
            self.gain[i] = predicted / innovation;
        }
        (&self.gain, innovation)
    }
}

/// Returns the sum of squares.
fn square(m: &[f64]) -> f64 {
    m.iter().map(|x| x * x).sum()
}

/// Computes `C = A B`.
fn multiply(n: usize, a: &[f64], b: &[f64], c: &mut [f64]) {
    c.fill(0.0);
    for (b, c) in b.chunks_exact(n).zip(c.chunks_exact_mut(n)) {
        for (a, b) in a.chunks_exact(n).zip(b) {
            for (c, a) in c.iter_mut().zip(a) {
                *c += a * b;
            }
        }
    }
}

/// Computes `C = A'B`.
fn multiply_transposed(n: usize, a: &[f64], b: &[f64], c: &mut [f64]) {
    for (b, c) in b.chunks_exact(n).zip(c.chunks_exact_mut(n)) {
        for (a, c) in a.chunks_exact(n).zip(c) {
            *c = a.iter().zip(b).map(|(a, b)| a * b).sum();
        }
    }
}

/// Computes `B = A'`.
fn transpose(n: usize, a: &[f64], b: &mut [f64]) {
    for i in 0..n {
        for j in 0..n {
            b[i * n + j] = a[j * n + i];
        }
    }
}

/// Adds the symmetric part of M.
fn add_symmetric(n: usize, m: &[f64], to: &mut [f64]) {
    for i in 0..n {
        for j in 0..n {
            to[i * n + j] += 0.5 * (m[i * n + j] + m[j * n + i]);
        }
    }
}

/// Replaces the columns b of each matrix by the solutions of `W x = b`, by elimination with row exchanges, which
/// destroys W. `None` if W is exactly singular.
pub(super) fn eliminate(n: usize, w: &mut [f64], of: &mut [&mut [f64]]) -> Option<()> {
    for k in 0..n {
        let larger = |best: usize, i: usize| {
            if w[k * n + i].abs() > w[k * n + best].abs() {
                i
            } else {
                best
            }
        };
        let pivot = (k + 1..n).fold(k, larger);
        if w[k * n + pivot] == 0.0 {
            return None;
        }
        for columns in std::iter::once(&mut *w).chain(of.iter_mut().map(|b| &mut **b)) {
            for column in columns.chunks_exact_mut(n) {
                column.swap(k, pivot);
            }
        }
        for i in k + 1..n {
            let factor = w[k * n + i] / w[k * n + k];
            for j in k + 1..n {
                w[j * n + i] -= factor * w[j * n + k];
            }
            for columns in of.iter_mut() {
                for column in columns.chunks_exact_mut(n) {
                    column[i] -= factor * column[k];
                }
            }
        }
    }
    for columns in of {
        for b in columns.chunks_exact_mut(n) {
            for i in (0..n).rev() {
                let sum: f64 = (i + 1..n).map(|j| w[j * n + i] * b[j]).sum();
                b[i] = (b[i] - sum) / w[i * n + i];
            }
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::{MeasurementNoise, StochasticModel};
    use crate::plant::polynomial_from_poles;
    use faer::{Mat, c64};

    /// The gains are those of the general solver, for stable, marginal and unstable plants and ratios over eleven
    /// orders.
    #[test]
    fn the_gains_of_the_general_solver() {
        let pair = |re: f64, im: f64| [c64::new(re, im), c64::new(re, -im)];
        let cases = [
            vec![c64::new(0.7, 0.0)],
            pair(0.75, 0.37).to_vec(),
            [pair(0.9, 0.3), pair(0.2, 0.6), pair(-0.5, 0.1)].concat(),
            [pair(0.6, 0.8), pair(1.1, 0.2)].concat(),
        ];
        for poles in cases {
            let n = poles.len();
            let phi = polynomial_from_poles(&poles);
            let a: Vec<f64> = (0..n).map(|i| -phi[n - 1 - i].re).collect();
            let mut steady = SteadyGain::new(n);
            for exponent in -7..=4 {
                let rho = 10_f64.powi(exponent);
                let q = Mat::from_fn(n, n, |i, j| rho * f64::from(u8::from(i == j)));
                let flat: Vec<f64> = (0..n * n).map(|k| q[(k % n, k / n)]).collect();
                let (gain, innovation) = steady.solve(&a, &flat).unwrap();
                let white = MeasurementNoise::white(1.0);
                let model = StochasticModel::new(&a, &vec![1.0; n], q.as_ref(), white).unwrap();
                let exact = model.riccati().unwrap();
                assert!(
                    (innovation / exact.innovation - 1.0).abs() < 1e-9,
                    "{n} {rho:e}"
                );
                let size = exact
                    .gain
                    .iter()
                    .fold(1e-3_f64, |most, k| most.max(k.abs()));
                for (gain, exact) in gain.iter().zip(&exact.gain) {
                    assert!(
                        (gain - exact).abs() < 1e-9 * size,
                        "{n} {rho:e}: {gain} {exact}"
                    );
                }
            }
        }
    }
}
