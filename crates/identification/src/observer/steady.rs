//! Steady gains of one canonical plant for many process noises, by spectral factorisation.

use crate::plant::canonical::solve_toeplitz;
use crate::real::{Mask, Real};

/// The steady-state filter of `x(k+1) = A x(k) + w(k)`, `y(k) = x_1(k) + v(k)`, `A = [0 | I; a']`, `E[v v] = 1`,
/// `E[w w'] = rho I`.
///
/// With `A(q) = det(q I - A)` and `N_i(q)` the polynomial from w_i to `A(q) y(k)`, the first i coefficients of A(q),
/// the spectrum of A(q) y is `A A* + rho sum_i N_i N_i* = v C C*`. C, monic and stable, is the characteristic
/// polynomial of `A - K c'`, and v is the variance of the innovations: the stabilising solution of the Riccati equation
/// without P. C is found by Newton's method on its coefficients, which converges from every stable C. Source: G.
/// Wilson, Factorization of the covariance generating function of a pure moving average process, SIAM J. Numer. Anal. 6
/// (1969) 1-7.
#[derive(Clone, Debug)]
pub(super) struct SteadyGain {
    a: Vec<f64>,
    /// The coefficients of A(q), from 1 on.
    alpha: Vec<f64>,
    /// The coefficients of `A A*` and of `sum_i N_i N_i*` at q^0 ... q^n.
    plant: Vec<f64>,
    states: Vec<f64>,
    /// The coefficients of `sqrt(v) C`, of the last rho that was solved.
    c: Vec<f64>,
    /// The coefficients of the next step, and its equations, by columns.
    next: Vec<f64>,
    matrix: Vec<f64>,
    gain: Vec<f64>,
}

/// Steps of Newton's method: it takes fewer than ten, unless zeros of C are near the unit circle, and halves the error
/// on it.
const STEPS: usize = 25;
/// The change at which a quadratic convergence has reached rounding.
const CONVERGED: f64 = 1e-10;

impl SteadyGain {
    /// Makes the buffers for the plant with the last row `a` of A.
    pub(super) fn new(a: &[f64]) -> Self {
        let n = a.len();
        let alpha: Vec<f64> = std::iter::once(1.0).chain(a.iter().rev().map(|a| -a)).collect();
        let states = (0..=n).map(|lag| (1..=n).map(|i| correlation(&alpha[..i], lag)).sum());
        let mut c = vec![0.0; n + 1];
        c[0] = 1.0;
        Self {
            a: a.to_vec(),
            plant: (0..=n).map(|lag| correlation(&alpha, lag)).collect(),
            states: states.collect(),
            alpha,
            c,
            next: vec![0.0; n + 1],
            matrix: vec![0.0; (n + 1) * (n + 1)],
            gain: vec![0.0; n],
        }
    }

    /// Returns the gain K, n numbers, and the innovation variance. `None` if Newton's method does not converge, as
    /// where a pole of the filter is at the unit circle.
    pub(super) fn solve(&mut self, rho: f64) -> Option<(&[f64], f64)> {
        let size = self.plant[0] + rho * self.states[0];
        let scale = (size / correlation(&self.c, 0)).sqrt();
        self.c.iter_mut().for_each(|c| *c *= scale);
        for _ in 0..STEPS {
            if self.step(rho)? <= CONVERGED * size.sqrt() {
                return Some(self.gain());
            }
        }
        self.restart()
    }

    /// Does one step, `C X* + X C* = S + C C*` for the next C = X, and returns the largest change of a coefficient.
    fn step(&mut self, rho: f64) -> Option<f64> {
        let order = self.c.len();
        for l in 0..order {
            for j in 0..order {
                let before = if l >= j { self.c[l - j] } else { 0.0 };
                let after = self.c.get(l + j).copied().unwrap_or(0.0);
                self.matrix[l * order + j] = before + after;
            }
            self.next[l] = self.plant[l] + rho * self.states[l] + correlation(&self.c, l);
        }
        if !eliminate(order, &mut self.matrix, &mut [&mut self.next]) {
            return self.restart();
        }
        let changes = self.c.iter().zip(&self.next);
        let change = changes.fold(0.0_f64, |most, (c, next)| most.max((c - next).abs()));
        if !change.is_finite() {
            return self.restart();
        }
        std::mem::swap(&mut self.c, &mut self.next);
        Some(change)
    }

    /// Forgets a C that may not be stable.
    fn restart<T>(&mut self) -> Option<T> {
        self.c.fill(0.0);
        self.c[0] = 1.0;
        None
    }

    /// Returns the gain of C, by `T K = C - A(q)` as in pole placement, and v.
    fn gain(&mut self) -> (&[f64], f64) {
        let first = self.c[0];
        for (i, gain) in self.gain.iter_mut().enumerate() {
            *gain = self.c[i + 1] / first - self.alpha[i + 1];
        }
        solve_toeplitz(&self.a, &mut self.gain);
        (&self.gain, first * first)
    }
}

/// Returns the coefficient of `P P*` at q^lag.
fn correlation(p: &[f64], lag: usize) -> f64 {
    let later = p.get(lag..).unwrap_or(&[]);
    p.iter().zip(later).map(|(a, b)| a * b).sum()
}

/// Makes W, n x n and column by column, upper triangular by elimination with row exchanges, and does the same to
/// further columns. Returns the lanes in which W is not exactly singular, and the sign that the exchanges give its
/// determinant.
#[inline(always)]
fn triangularise<R: Real>(n: usize, w: &mut [R], of: &mut [&mut [R]]) -> (R::Mask, R) {
    let (mut regular, mut sign) = (R::Mask::from_bits(u8::MAX), R::splat(1.0));
    for k in 0..n {
        // The pivot is the first of the largest.
        let (first, mut largest) = (w[k * n + k].abs(), w[k * n + k].abs());
        for i in k + 1..n {
            let size = w[k * n + i].abs();
            largest = R::select(largest.less(size), size, largest);
        }
        let mut left = first.less(largest);
        sign = R::select(left, -sign, sign);
        for i in k + 1..n {
            let here = left & largest.at_most(w[k * n + i].abs());
            left = left & !here;
            if here.any() {
                exchange(&mut w[k * n..], n, [k, i], here);
                for columns in of.iter_mut() {
                    exchange(columns, n, [k, i], here);
                }
            }
        }
        let pivot = w[k * n + k];
        regular = regular & !(pivot.at_most(R::zero()) & R::zero().at_most(pivot));
        for i in k + 1..n {
            let factor = w[k * n + i] / pivot;
            for j in k + 1..n {
                w[j * n + i] = w[j * n + i] - factor * w[j * n + k];
            }
            for columns in of.iter_mut() {
                for j in 0..columns.len() / n {
                    columns[j * n + i] = columns[j * n + i] - factor * columns[j * n + k];
                }
            }
        }
    }
    (regular, sign)
}

/// Returns the determinant of W, which is destroyed.
///
/// # Panics
/// If the slice is shorter than n^2.
#[inline(always)]
pub(super) fn determinant<R: Real>(n: usize, w: &mut [R]) -> R {
    let (regular, mut product) = triangularise(n, w, &mut []);
    for k in 0..n {
        product = product * w[k * n + k];
    }
    R::select(regular, product, R::zero())
}

/// Replaces the columns b of each matrix by the solutions of `W x = b` and destroys W. Returns the lanes in which W is
/// not exactly singular; elsewhere the columns are no solutions.
#[inline(always)]
pub(super) fn eliminate<R: Real>(n: usize, w: &mut [R], of: &mut [&mut [R]]) -> R::Mask {
    let (regular, _) = triangularise(n, w, of);
    for columns in of.iter_mut() {
        for c in 0..columns.len() / n {
            let b = &mut columns[c * n..][..n];
            for i in (0..n).rev() {
                // The sum of nothing is -0.
                let mut sum = R::splat(-0.0);
                for j in i + 1..n {
                    sum = sum + w[j * n + i] * b[j];
                }
                b[i] = (b[i] - sum) / w[i * n + i];
            }
        }
    }
    regular
}

/// Exchanges two entries of each column in the lanes chosen.
#[inline(always)]
fn exchange<R: Real>(columns: &mut [R], n: usize, [k, i]: [usize; 2], chosen: R::Mask) {
    for column in columns.chunks_exact_mut(n) {
        let (upper, lower) = (column[k], column[i]);
        column[k] = R::select(chosen, lower, upper);
        column[i] = R::select(chosen, upper, lower);
    }
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
            let mut steady = SteadyGain::new(&a);
            for exponent in -7..=4 {
                let rho = 10_f64.powi(exponent);
                let q = Mat::from_fn(n, n, |i, j| rho * f64::from(u8::from(i == j)));
                let (gain, innovation) = steady.solve(rho).unwrap();
                let white = MeasurementNoise::white(1.0);
                let model = StochasticModel::new(&a, &vec![1.0; n], q.as_ref(), white).unwrap();
                let exact = model.riccati().unwrap();
                assert!((innovation / exact.innovation - 1.0).abs() < 1e-9, "{n} {rho:e}");
                let size = exact.gain.iter().fold(1e-3_f64, |most, k| most.max(k.abs()));
                for (gain, exact) in gain.iter().zip(&exact.gain) {
                    assert!((gain - exact).abs() < 1e-9 * size, "{n} {rho:e}: {gain} {exact}");
                }
            }
        }
    }
}
