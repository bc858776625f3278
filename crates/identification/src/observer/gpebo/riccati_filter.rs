//! The time-varying Kalman-Bucy filter with process noise, exact from step to step.
//!
//! `P' = A P + P A' + Q - P C C'P / r` and `xhat' = A xhat + B u + P C (y - C'xhat) / r` follow from one linear
//! system: `X' = -A'X + C C'Y / r`, `Y' = Q X + A Y` from X = I, Y = P(t) gives `P(t + h) = Y X^-1`, and
//! `p' = -A'p + C C'x / r - C y / r`, `x' = Q p + A x + B u` from p = 0, x = xhat(t) gives
//! `xhat(t + h) = x - P(t + h) p`. For `x - P p - xhat` obeys a homogeneous equation. Started anew in each step,
//! nothing grows. Noises with a common intensity S are reduced to this: A - S C'/r and Q - S S'/r for A and Q, and S y
//! / r drives xhat. Source of the first: Bucy and Joseph, Filtering for Stochastic Processes (1968), chapter 5.

use super::matrices::add_product;
use super::observer_spec::ObserverSpec;
use crate::observer::eliminate;
use crate::plant::ContinuousPlant;
use crate::real::Real;
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
pub struct FilterState<R> {
    x: Vec<R>,
    /// P, n x n, symmetric.
    p: Vec<R>,
    /// `[p; x]`, then `[X; Y]` column by column, before and after a step.
    before: Vec<R>,
    after: Vec<R>,
    /// X' and Y', by columns.
    transposed: [Vec<R>; 2],
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
        let ObserverSpec::Filter { p0, q, s, r, x0 } = spec else {
            return None;
        };
        let (n, size) = (plant.order(), base.nrows());
        let (b, c) = (plant.b(), plant.c());
        let a = |i: usize, j: usize| plant.a()[(i, j)] - s[i] * c[j] / r;
        let mut matrix = Mat::zeros(size + 2 * n, size + 2 * n);
        matrix.submatrix_mut(0, 0, size, size).copy_from(base);
        for i in 0..n {
            let (p, x) = (size + i, size + n + i);
            for j in 0..n {
                matrix[(p, size + j)] = -a(j, i);
                matrix[(p, size + n + j)] = c[i] * c[j] / r;
                matrix[(x, size + n + j)] = a(i, j);
                matrix[(x, size + j)] = q[(i, j)] - s[i] * s[j] / r;
                // y = C'x + delta
                matrix[(p, j)] = -c[i] * c[j] / r;
                matrix[(x, j)] = s[i] * c[j] / r;
            }
            for &k in disturbance {
                matrix[(p, k)] = -c[i] / r;
                matrix[(x, k)] = s[i] / r;
            }
            for &k in input {
                matrix[(x, k)] += b[i];
            }
        }
        Some(Self {
            matrix,
            x0: x0.clone(),
            p0: *p0,
        })
    }

    /// Returns the state at t = 0.
    pub(super) fn initial<R: Real>(&self) -> FilterState<R> {
        let n = self.x0.len();
        let identity = |i: usize| f64::from(u8::from(i % n == i / n));
        let zeros = |count: usize| vec![R::zero(); count];
        FilterState {
            x: self.x0.iter().map(|x| R::splat(*x)).collect(),
            p: (0..n * n).map(|i| R::splat(self.p0 * identity(i))).collect(),
            before: zeros(2 * n),
            after: zeros(2 * n),
            transposed: [zeros(n * n), zeros(n * n)],
        }
    }
}

impl<R: Real> FilterState<R> {
    /// Returns xhat.
    pub(super) fn x(&self) -> &[R] {
        &self.x
    }

    /// Takes over the state of the same filter.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.x.copy_from_slice(&other.x);
        self.p.copy_from_slice(&other.p);
    }

    /// Advances by a propagator: its 2n rows of `[p; x]`, for the base state at the start of the step and `[p; x]`.
    #[inline(always)]
    pub(super) fn advance(&mut self, by: &[R], base: &[R]) {
        let (n, size) = (self.x.len(), base.len());
        let width = size + 2 * n;
        for j in 0..n {
            for i in 0..n {
                self.before[i] = R::splat(if i == j { 1.0 } else { 0.0 });
                self.before[n + i] = self.p[j * n + i];
            }
            for i in 0..2 * n {
                let own = &by[i * width + size..][..2 * n];
                let value = add_product(R::zero(), own, &self.before);
                self.transposed[i / n][i % n * n + j] = value;
            }
        }
        // P' = X'^-1 Y'. X is regular; where rounding makes it singular, P is not finite and the observer fails.
        let [x, y] = &mut self.transposed;
        let regular = eliminate(n, x, &mut [y]);
        for i in 0..n * n {
            y[i] = R::select(regular, y[i], R::splat(f64::NAN));
        }
        for i in 0..n {
            for j in 0..n {
                self.p[i * n + j] = R::splat(0.5) * (y[i * n + j] + y[j * n + i]);
            }
        }
        for i in 0..n {
            self.before[i] = R::zero();
            self.before[n + i] = self.x[i];
        }
        for i in 0..2 * n {
            let row = &by[i * width..][..width];
            let sum = add_product(R::zero(), &row[..size], base);
            self.after[i] = add_product(sum, &row[size..], &self.before);
        }
        for i in 0..n {
            // The sum of nothing is -0.
            let mut sum = R::splat(-0.0);
            for j in 0..n {
                sum = sum + self.p[j * n + i] * self.after[j];
            }
            self.x[i] = self.after[n + i] - sum;
        }
    }
}
