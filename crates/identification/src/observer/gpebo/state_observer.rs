//! Observers that estimate the state itself: the full-order observer, Eq. (4), and the time-varying Kalman-Bucy filter
//! with process noise, both exact from step to step.
//!
//! The filter's `P' = A P + P A' + Q - P C C'P / r` and `xhat' = A xhat + B u + P C (y - C'xhat) / r` follow from one
//! linear system: `X' = -A'X + C C'Y / r`, `Y' = Q X + A Y` from X = I, Y = P(t) gives `P(t + h) = Y X^-1`, and
//! `p' = -A'p + C C'x / r - C y / r`, `x' = Q p + A x + B u` from p = 0, x = xhat(t) gives
//! `xhat(t + h) = x - P(t + h) p`. For `x - P p - xhat` obeys a homogeneous equation. Started anew in each step,
//! nothing grows. Noises with a common intensity S are reduced to this: A - S C'/r and Q - S S'/r for A and Q, and S y
//! / r drives xhat. Source of the first: Bucy and Joseph, Filtering for Stochastic Processes (1968), chapter 5.

use super::matrices::add_product;
use super::settings::ObserverSpec;
use crate::observer::eliminate;
use crate::plant::ContinuousPlant;
use crate::real::Real;
use faer::Mat;

/// The matrix of the base state with the observer's own state below, xhat or `[p; x]`, and the start.
#[derive(Clone, Debug, PartialEq)]
pub struct StateObserver {
    pub(super) matrix: Mat<f64>,
    x0: Vec<f64>,
    /// P(0) = p0 I of a filter.
    p0: Option<f64>,
}

/// xhat, and P of a filter, with scratch.
#[derive(Clone, Debug)]
pub struct StateEstimate<R> {
    /// xhat.
    pub x: Vec<R>,
    /// P, n x n, symmetric; empty for a full-order observer.
    p: Vec<R>,
    /// xhat; of a filter `[X; Y]` column by column, then `[p; x]`; before and after a step.
    before: Vec<R>,
    after: Vec<R>,
    /// X' and Y', by columns.
    transposed: [Vec<R>; 2],
}

impl StateObserver {
    /// Returns the system of an observer; `None` for those that estimate theta. Given the indices of the base states
    /// that add up to u and to delta.
    pub(super) fn new(
        spec: &ObserverSpec,
        base: &Mat<f64>,
        plant: &ContinuousPlant,
        signals: [&[usize]; 2],
    ) -> Option<Self> {
        let (matrix, x0, p0) = match spec {
            ObserverSpec::Luenberger { gain, x0 } => (observer_matrix(base, plant, gain, signals), x0, None),
            ObserverSpec::Filter { p0, q, s, r, x0 } => {
                (filter_matrix(base, plant, (q, s, *r), signals), x0, Some(*p0))
            }
            _ => return None,
        };
        let x0 = x0.clone();
        Some(Self { matrix, x0, p0 })
    }

    /// Returns the state at t = 0.
    pub(super) fn initial<R: Real>(&self) -> StateEstimate<R> {
        let n = self.x0.len();
        let identity = |i: usize| f64::from(u8::from(i % n == i / n));
        let zeros = |count: usize| vec![R::zero(); count];
        let of_filter = |count: usize| if self.p0.is_some() { count } else { 0 };
        let covariance = |p0: f64| (0..n * n).map(|i| R::splat(p0 * identity(i))).collect();
        StateEstimate {
            x: self.x0.iter().map(|x| R::splat(*x)).collect(),
            p: self.p0.map(covariance).unwrap_or_default(),
            before: zeros(n + of_filter(n)),
            after: zeros(n + of_filter(n)),
            transposed: [zeros(of_filter(n * n)), zeros(of_filter(n * n))],
        }
    }
}

/// Returns the matrix with the rows `xhat' = (A - L C') xhat + B u + L (C'x + delta)` below the base state.
fn observer_matrix(
    base: &Mat<f64>,
    plant: &ContinuousPlant,
    gain: &[f64],
    [input, disturbance]: [&[usize]; 2],
) -> Mat<f64> {
    let (n, size) = (plant.order(), base.nrows());
    let mut m = Mat::zeros(size + n, size + n);
    m.submatrix_mut(0, 0, size, size).copy_from(base);
    for i in 0..n {
        for j in 0..n {
            m[(size + i, j)] = gain[i] * plant.c()[j];
            m[(size + i, size + j)] = plant.a()[(i, j)] - gain[i] * plant.c()[j];
        }
        for &k in input {
            m[(size + i, k)] = plant.b()[i];
        }
        for &k in disturbance {
            m[(size + i, k)] = gain[i];
        }
    }
    m
}

/// Returns the matrix with the rows of `[p; x]` below the base state.
fn filter_matrix(
    base: &Mat<f64>,
    plant: &ContinuousPlant,
    (q, s, r): (&Mat<f64>, &[f64], f64),
    [input, disturbance]: [&[usize]; 2],
) -> Mat<f64> {
    let (n, size) = (plant.order(), base.nrows());
    let (b, c) = (plant.b(), plant.c());
    let a = |i: usize, j: usize| plant.a()[(i, j)] - s[i] * c[j] / r;
    let mut m = Mat::zeros(size + 2 * n, size + 2 * n);
    m.submatrix_mut(0, 0, size, size).copy_from(base);
    for i in 0..n {
        let (p, x) = (size + i, size + n + i);
        for j in 0..n {
            m[(p, size + j)] = -a(j, i);
            m[(p, size + n + j)] = c[i] * c[j] / r;
            m[(x, size + n + j)] = a(i, j);
            m[(x, size + j)] = q[(i, j)] - s[i] * s[j] / r;
            // y = C'x + delta
            m[(p, j)] = -c[i] * c[j] / r;
            m[(x, j)] = s[i] * c[j] / r;
        }
        for &k in disturbance {
            m[(p, k)] = -c[i] / r;
            m[(x, k)] = s[i] / r;
        }
        for &k in input {
            m[(x, k)] += b[i];
        }
    }
    m
}

impl<R: Real> StateEstimate<R> {
    /// Takes over the state of the same observer.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.x.copy_from_slice(&other.x);
        self.p.copy_from_slice(&other.p);
    }

    /// Advances by a propagator: the rows of the observer's own state, for the base state at the start of the step and
    /// that state.
    #[inline(always)]
    pub(super) fn advance(&mut self, by: &[R], base: &[R]) {
        let (n, size) = (self.x.len(), base.len());
        let is_filter = !self.p.is_empty();
        if is_filter {
            self.advance_covariance(by, size);
            self.before[..n].fill(R::zero());
        }
        let own = self.before.len();
        self.before[own - n..].copy_from_slice(&self.x);
        for i in 0..own {
            let row = &by[i * (size + own)..][..size + own];
            let sum = add_product(R::zero(), &row[..size], base);
            self.after[i] = add_product(sum, &row[size..], &self.before);
        }
        if !is_filter {
            self.x.copy_from_slice(&self.after[own - n..]);
            return;
        }
        for i in 0..n {
            // The sum of nothing is -0.
            let mut sum = R::splat(-0.0);
            for j in 0..n {
                sum = sum + self.p[j * n + i] * self.after[j];
            }
            self.x[i] = self.after[own - n + i] - sum;
        }
    }

    /// Advances P of a filter.
    #[inline(always)]
    fn advance_covariance(&mut self, by: &[R], size: usize) {
        let n = self.x.len();
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
    }
}
