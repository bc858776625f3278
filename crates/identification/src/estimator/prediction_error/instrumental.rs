//! Denominators of `y = B/F u + noise` by iterations that solve a small linear system of lag sums in each pass, with
//! reflected zeros: least squares, Steiglitz and McBride's iteration, Young's simplified refined instruments.
//!
//! They are starts of searches, so they need not converge.

use super::kernels::{divide, filter};
use crate::estimator::lag_sums::dot;
use crate::estimator::lag_sums::{System, lagged_products};
use crate::estimator::reflection::reflect_zeros;
use crate::estimator::reflection::stable;
use crate::model::Orders;

/// The largest number of passes, and the relative change at which they end.
const PASSES: usize = 15;
const REST: f64 = 1e-3;

/// The linear problem of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `F y = B u`, once.
    LeastSquares,
    /// The same for `y/F` and `u/F`, F of the pass before.
    SteiglitzMcBride,
    /// With `B/F u` instead of y in the instruments.
    Refined,
    /// The same from least squares for signals through `1/(1 - SLOW q^-1)^n` instead: noise hides a plant that is
    /// sampled fast from the signals themselves.
    Slow,
}

/// The zeros of the filter of [`Kind::Slow`].
const SLOW: f64 = 0.99;

/// Buffers for records of one length.
pub(super) struct Instrumental {
    /// The degree of F, nb and nk.
    degree: usize,
    nb: usize,
    nk: usize,
    system: System,
    theta: Vec<f64>,
    f: Vec<f64>,
    b: Vec<f64>,
    /// The solution of least squares, from which the iterations begin, and the best F of the last iteration.
    first: Option<Vec<f64>>,
    best: Vec<f64>,
    u: Vec<f64>,
    y: Vec<f64>,
    x: Vec<f64>,
    scratch: Vec<f64>,
}

impl Instrumental {
    pub(super) fn new(orders: Orders, window: usize) -> Self {
        let Orders { na, nb, nf, nk, .. } = orders;
        let degree = if nf > 0 { nf } else { na };
        let signal = || vec![0.0; window];
        Self {
            degree,
            nb,
            nk,
            system: System::default(),
            theta: vec![0.0; degree + nb],
            f: vec![1.0; degree + 1],
            b: vec![0.0; nk + nb],
            first: None,
            best: vec![1.0; degree + 1],
            u: signal(),
            y: signal(),
            x: signal(),
            scratch: Vec::new(),
        }
    }

    /// Forgets the record.
    pub(super) fn begin(&mut self) {
        self.first = None;
    }

    /// Returns the denominator, zeros inside the unit circle; `None` if no linear problem had a solution.
    pub(super) fn find(&mut self, kind: Kind, u: &[f64], y: &[f64]) -> Option<&[f64]> {
        if self.first.is_none() {
            self.u.copy_from_slice(u);
            self.y.copy_from_slice(y);
            self.solve(false)?;
            self.first = Some(self.theta.clone());
        }
        self.theta.copy_from_slice(self.first.as_ref()?);
        if kind == Kind::Slow {
            for (to, from) in [(&mut self.u, u), (&mut self.y, y)] {
                to.copy_from_slice(from);
                for _ in 0..self.degree {
                    divide(&[1.0, -SLOW], to);
                }
            }
            self.solve(false)?;
        }
        self.take()?;
        self.best.copy_from_slice(&self.f);
        if kind == Kind::LeastSquares {
            return Some(&self.best);
        }
        let mut least = f64::INFINITY;
        for _ in 0..PASSES {
            for (to, from) in [(&mut self.u, u), (&mut self.y, y)] {
                to.copy_from_slice(from);
                divide(&self.f, to);
            }
            // `B/F u`, whose errors tell how good F is.
            filter(&self.b, &self.u, &mut self.x);
            let cross = dot(&self.x, y);
            let square = dot(&self.x, &self.x);
            // The sum of squares for the best gain of B.
            let sum = if square > 0.0 { -cross * cross / square } else { 0.0 };
            if sum < least {
                least = sum;
                self.best.copy_from_slice(&self.f);
            }
            divide(&self.f, &mut self.x);
            if self.solve(kind != Kind::SteiglitzMcBride).is_none() {
                break;
            }
            let before = self.f.clone();
            if self.take().is_none() {
                break;
            }
            let change = before.iter().zip(&self.f).map(|(x, y)| (x - y).abs());
            if change.fold(0.0, f64::max) < REST {
                break;
            }
        }
        Some(&self.best)
    }

    /// Takes F, reflected, and B of the solution.
    fn take(&mut self) -> Option<()> {
        let (f, b) = self.theta.split_at(self.degree);
        self.f[1..].copy_from_slice(f);
        self.b[self.nk..].copy_from_slice(b);
        let inside = stable(&self.f, &mut self.scratch) || reflect_zeros(&mut self.f);
        inside.then_some(())
    }

    /// Solves `Z'Phi theta = Z'y` for `phi(k) = (-y(k-1) ..., u(k-nk) ...)`, Z with x for y if refined.
    fn solve(&mut self, refined: bool) -> Option<()> {
        let (n, nb, nk) = (self.degree, self.nb, self.nk);
        let width = n + nb;
        let (u, y) = (&self.u, &self.y);
        let z = if refined { &self.x } else { y };
        let system = &mut self.system;
        system.clear(width);
        lagged_products(z, y, (1, n), (0, n + 1), |i, j, value| match j {
            0 => system.put(i, width, -value),
            _ => system.put(i, j - 1, value),
        });
        lagged_products(z, u, (1, n), (nk, nb), |i, j, value| {
            system.put(i, n + j, -value);
        });
        lagged_products(u, y, (nk, nb), (0, n + 1), |i, j, value| match j {
            0 => system.put(n + i, width, value),
            _ => system.put(n + i, j - 1, -value),
        });
        lagged_products(u, u, (nk, nb), (nk, nb), |i, j, value| {
            system.put(n + i, n + j, value);
        });
        system.solve(&mut self.theta).then_some(())
    }
}
