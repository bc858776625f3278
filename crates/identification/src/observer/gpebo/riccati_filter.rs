//! The time-varying Kalman-Bucy filter with process noise, exact from step to step.
//!
//! `P' = A P + P A' + Q - P C C'P / r` and `xhat' = A xhat + B u + P C (y - C'xhat) / r` follow from one linear system:
//! `X' = -A'X + C C'Y / r`, `Y' = Q X + A Y` from X = I, Y = P(t) gives `P(t + h) = Y X^-1`, and
//! `p' = -A'p + C C'x / r - C y / r`, `x' = Q p + A x + B u` from p = 0, x = xhat(t) gives
//! `xhat(t + h) = x - P(t + h) p`. For `x - P p - xhat` obeys a homogeneous equation. Started anew in each step,
//! nothing grows. Source of the first: Bucy and Joseph, Filtering for Stochastic Processes (1968), chapter 5.

use super::matrices::multiply_add;
use super::observer_spec::ObserverSpec;
use crate::observer::eliminate;
use crate::plant::ContinuousPlant;
use faer::Mat;

/// The matrix of `[base; p; x]`, and the start.
#[derive(Clone, Debug)]
pub struct FilterSystem {
    /// Rows and columns as the base state's, then 2n.
    pub(super) matrix: Mat<f64>,
    x0: Vec<f64>,
    p0: f64,
}

/// xhat and P with scratch.
#[derive(Clone, Debug)]
pub struct FilterState {
    x: Vec<f64>,
    /// P, n x n, symmetric.
    p: Vec<f64>,
    /// `[p; x]`, then `[X; Y]` column by column, before and after a step.
    before: Vec<f64>,
    after: Vec<f64>,
    /// X' and Y', by columns.
    transposed: [Vec<f64>; 2],
}

impl FilterSystem {
    /// Returns the system of a time-varying filter; `None` for other observers.
    pub(super) fn new(
        spec: &ObserverSpec,
        base: &Mat<f64>,
        plant: &ContinuousPlant,
        input: &[usize],
        disturbance: &[usize],
    ) -> Option<Self> {
        let ObserverSpec::Filter { p0, q, r, x0 } = spec else {
            return None;
        };
        let (n, size) = (plant.order(), base.nrows());
        let (a, b, c) = (plant.a(), plant.b(), plant.c());
        let mut matrix = Mat::zeros(size + 2 * n, size + 2 * n);
        matrix.submatrix_mut(0, 0, size, size).copy_from(base);
        for i in 0..n {
            let (p, x) = (size + i, size + n + i);
            for j in 0..n {
                matrix[(p, size + j)] = -a[(j, i)];
                matrix[(p, size + n + j)] = c[i] * c[j] / r;
                matrix[(x, size + n + j)] = a[(i, j)];
                // y = C'x + delta
                matrix[(p, j)] = -c[i] * c[j] / r;
            }
            matrix[(x, size + i)] = *q;
            for &k in disturbance {
                matrix[(p, k)] = -c[i] / r;
            }
            for &k in input {
                matrix[(x, k)] = b[i];
            }
        }
        Some(Self {
            matrix,
            x0: x0.clone(),
            p0: *p0,
        })
    }

    /// Returns the state at t = 0.
    pub(super) fn initial(&self) -> FilterState {
        let n = self.x0.len();
        let identity = |i: usize| f64::from(u8::from(i % n == i / n));
        FilterState {
            x: self.x0.clone(),
            p: (0..n * n).map(|i| self.p0 * identity(i)).collect(),
            before: vec![0.0; 2 * n],
            after: vec![0.0; 2 * n],
            transposed: [vec![0.0; n * n], vec![0.0; n * n]],
        }
    }
}

impl FilterState {
    /// Returns xhat.
    pub(super) fn x(&self) -> &[f64] {
        &self.x
    }

    /// Takes over the state of the same filter.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.x.copy_from_slice(&other.x);
        self.p.copy_from_slice(&other.p);
    }

    /// Advances by a propagator: its 2n rows of `[p; x]`, for the base state at the start of the step and `[p; x]`.
    pub(super) fn advance(&mut self, by: &[f64], base: &[f64]) {
        let n = self.x.len();
        let (from_base, own) = by.split_at(base.len() * 2 * n);
        for j in 0..n {
            self.before.fill(0.0);
            self.before[j] = 1.0;
            self.before[n..].copy_from_slice(&self.p[j * n..(j + 1) * n]);
            self.after.fill(0.0);
            multiply_add(own, &self.before, &mut self.after);
            for (transposed, part) in self.transposed.iter_mut().zip(self.after.chunks_exact(n)) {
                for (i, value) in part.iter().enumerate() {
                    transposed[i * n + j] = *value;
                }
            }
        }
        // P' = X'^-1 Y'. X is regular; where rounding makes it singular, P is not finite and the observer fails.
        let [x, y] = &mut self.transposed;
        if eliminate(n, x, &mut [y]).is_none() {
            y.fill(f64::NAN);
        }
        for i in 0..n {
            for j in 0..n {
                self.p[i * n + j] = 0.5 * (y[i * n + j] + y[j * n + i]);
            }
        }
        self.before[..n].fill(0.0);
        self.before[n..].copy_from_slice(&self.x);
        self.after.fill(0.0);
        multiply_add(from_base, base, &mut self.after);
        multiply_add(own, &self.before, &mut self.after);
        let (adjoint, x) = self.after.split_at(n);
        for i in 0..n {
            let sum: f64 = (0..n).map(|j| self.p[j * n + i] * adjoint[j]).sum();
            self.x[i] = x[i] - sum;
        }
    }
}
