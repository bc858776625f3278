//! The general linear model `A(q) y = B(q)/F(q) u + C(q)/D(q) e`, the form of every estimate and of every true plant.
//!
//! Polynomials are in q^-1 with their leading coefficient: `A = [1, a_1, ...]`, and C, D and F alike. `B` has `nk`
//! zeros before its `nb` coefficients. Nothing is shifted: a delay stays a delay.

mod continuous;
mod equation;
mod orders;
pub mod polynomial;
mod realisation;
mod units;

pub use continuous::{ContinuousModel, Hold};
pub(crate) use continuous::{Sampled, controller_form, output_of, row_times_form};
pub(crate) use orders::LARGEST;
pub use orders::{Orders, OrdersError};
pub use realisation::Realisation;
pub use units::Units;
pub(crate) use units::multiply;

use crate::plant::StateSpace;
use polynomial::{divide, filter};
use units::multiply_part;

/// A denominator whose sum is a smaller part of its coefficients' sum has a zero at 1: with less than three digits of
/// it left after rounding, no gain is computed.
const AT_ONE: f64 = 1e-13;

/// The model `A(q) y = B(q)/F(q) u + C(q)/D(q) e`, with what is known of e and of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearModel {
    /// `1, a_1 ... a_na`.
    pub a: Vec<f64>,
    /// `nk` zeros, then `nb` coefficients.
    pub b: Vec<f64>,
    /// `1, c_1 ... c_nc`.
    pub c: Vec<f64>,
    /// `1, d_1 ... d_nd`.
    pub d: Vec<f64>,
    /// `1, f_1 ... f_nf`.
    pub f: Vec<f64>,
    /// The delay nk.
    pub delay: usize,
    /// The variance of e; NaN if not known.
    pub noise_variance: f64,
    /// The covariance of the parameters, row by row, in the order A, B, C, D, F; empty if there is none.
    pub covariance: Vec<f64>,
}

impl LinearModel {
    /// Makes a model of given orders whose free coefficients are 0.
    pub fn zero(orders: Orders) -> Self {
        let monic = |n: usize| {
            let mut polynomial = vec![0.0; n + 1];
            polynomial[0] = 1.0;
            polynomial
        };
        Self {
            a: monic(orders.na),
            b: vec![0.0; orders.nk + orders.nb],
            c: monic(orders.nc),
            d: monic(orders.nd),
            f: monic(orders.nf),
            delay: orders.nk,
            noise_variance: f64::NAN,
            covariance: Vec::new(),
        }
    }

    /// Makes the paper's plant, `A(q) y = B(q) u` with `alpha_i = -a_(n+1-i)` and `beta_i = h_i`, delayed by
    /// `delay - 1` more samples.
    ///
    /// # Panics
    /// If the lengths differ or the delay is 0.
    pub fn from_canonical(a: &[f64], h: &[f64], delay: usize) -> Self {
        let n = a.len();
        assert!(h.len() == n && delay > 0);
        let mut model = Self::zero(Orders::arx(n, n, delay));
        crate::plant::canonical::reverse_negated(a, &mut model.a[1..]);
        model.b[delay..].copy_from_slice(h);
        model
    }

    /// Copies another model, reusing the buffers.
    pub fn assign(&mut self, other: &Self) {
        let Self {
            a,
            b,
            c,
            d,
            f,
            delay,
            noise_variance,
            covariance,
        } = other;
        self.a.clone_from(a);
        self.b.clone_from(b);
        self.c.clone_from(c);
        self.d.clone_from(d);
        self.f.clone_from(f);
        self.delay = *delay;
        self.noise_variance = *noise_variance;
        self.covariance.clone_from(covariance);
    }

    /// Returns the orders.
    pub fn orders(&self) -> Orders {
        Orders {
            na: self.a.len() - 1,
            nb: self.b.len() - self.delay,
            nc: self.c.len() - 1,
            nd: self.d.len() - 1,
            nf: self.f.len() - 1,
            nk: self.delay,
        }
    }

    /// Returns the free coefficients, in the order A, B, C, D, F.
    pub fn parameters(&self) -> impl Iterator<Item = f64> {
        let (a, b) = (&self.a[1..], &self.b[self.delay..]);
        let rest = [&self.c[1..], &self.d[1..], &self.f[1..]];
        [a, b].into_iter().chain(rest).flatten().copied()
    }

    /// Sets the free coefficients, in the order A, B, C, D, F.
    ///
    /// # Panics
    /// If there are not [`Orders::parameters`] of them.
    pub fn set_parameters(&mut self, theta: &[f64]) {
        assert_eq!(theta.len(), self.orders().parameters());
        let delay = self.delay;
        let mut rest = theta;
        let places = [
            &mut self.a[1..],
            &mut self.b[delay..],
            &mut self.c[1..],
            &mut self.d[1..],
            &mut self.f[1..],
        ];
        for place in places {
            let (taken, left) = rest.split_at(place.len());
            place.copy_from_slice(taken);
            rest = left;
        }
    }

    /// Sets F and B to (f, b).
    pub(crate) fn set_plant(&mut self, theta: &[f64]) {
        let (f, b) = theta.split_at(self.f.len() - 1);
        self.f[1..].copy_from_slice(f);
        self.b[self.delay..].copy_from_slice(b);
    }

    /// Writes F and B as (f, b).
    pub(crate) fn write_plant(&self, theta: &mut [f64]) {
        let (f, b) = theta.split_at_mut(self.f.len() - 1);
        f.copy_from_slice(&self.f[1..]);
        b.copy_from_slice(&self.b[self.delay..]);
    }

    /// Takes the model, which is of samples in these units, powers of two, for that of the samples themselves; `lost`
    /// becomes true where a number leaves the range of doubles.
    pub(crate) fn set_units(&mut self, units: Units, lost: &mut bool) {
        let Orders { na, nb, .. } = self.orders();
        let size = self.orders().parameters();
        let b = self.b.iter_mut();
        b.for_each(|b| multiply(b, units.gain(), lost));
        multiply_part(&mut self.covariance, size, na..na + nb, units.gain(), lost);
        for _ in 0..2 {
            multiply(&mut self.noise_variance, units.output, lost);
        }
    }

    /// Returns the standard errors of the parameters, in their order; `None` if there is no covariance.
    pub fn standard_errors(&self) -> Option<Vec<f64>> {
        let n = self.orders().parameters();
        let diagonal = || (0..n).map(|i| self.covariance[i * n + i].sqrt()).collect();
        (!self.covariance.is_empty()).then(diagonal)
    }

    /// Returns the variance `g' P g` of `g' theta`, P being the covariance of the parameters; NaN without one.
    pub fn variance_of(&self, g: &[f64]) -> f64 {
        let n = g.len();
        if self.covariance.len() != n * n {
            return f64::NAN;
        }
        let rows = self.covariance.chunks_exact(n.max(1));
        let products = rows
            .zip(g)
            .map(|(row, g_i)| g_i * row.iter().zip(g).map(|(p, g)| p * g).sum::<f64>());
        // Rounding may make a variance of 0 negative; a NaN stays.
        match products.sum::<f64>() {
            sum if sum < 0.0 => 0.0,
            sum => sum,
        }
    }

    /// Appends the standard errors of `a_1 ... a_n, h_1 ... h_n`, the paper's form of the part that u drives.
    ///
    /// NaN are those of coefficients that are not estimated, of poles if both A and F have some, and of h if u acts on
    /// y without delay. All are NaN if there is no covariance.
    pub fn canonical_standard_errors(&self, n: usize, to: &mut Vec<f64>) {
        let orders = self.orders();
        let all = orders.parameters();
        let (poles, first) = match (orders.na, orders.nf) {
            (poles, 0) => (poles, 0),
            (0, poles) => (poles, all - poles),
            _ => (0, 0),
        };
        let error = |parameter: Option<usize>| {
            let parameter = parameter.filter(|_| self.covariance.len() == all * all);
            parameter.map_or(f64::NAN, |i| self.covariance[i * all + i].sqrt())
        };
        // a_i is minus the coefficient of q^-(n+1-i), h_i that of q^-i.
        to.extend((1..=n).map(|i| error((n + 1 - i <= poles).then(|| first + n - i))));
        let of_input = orders.nk.max(1)..orders.nk + orders.nb;
        let delayed = orders.nk > 0;
        let h = |i: usize| error((delayed && of_input.contains(&i)).then(|| orders.na + i - orders.nk));
        to.extend((1..=n).map(h));
    }

    /// Computes `B/(A F) u`, with all signals zero before k = 0.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn simulate(&self, u: &[f64], y: &mut [f64]) {
        filter(&self.b, u, y);
        divide(&self.a, y);
        divide(&self.f, y);
    }

    /// Computes the one-step prediction errors `e = D/C (A y - B/F u)`, with all signals zero before k = 0. `scratch`
    /// has room for as many samples.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn residuals(&self, u: &[f64], y: &[f64], e: &mut [f64], scratch: &mut [f64]) {
        filter(&self.b, u, e);
        divide(&self.f, e);
        filter(&self.a, y, scratch);
        for (scratch, e) in scratch.iter_mut().zip(&*e) {
            *scratch -= e;
        }
        filter(&self.d, scratch, e);
        divide(&self.c, e);
    }

    /// Returns the static gain from u to y, `B(1)/(A(1) F(1))`; infinite with a pole at 1, to the rounding of the
    /// coefficients.
    pub fn static_gain(&self) -> f64 {
        let sum = |c: &[f64]| c.iter().sum::<f64>();
        let denominator = |c: &[f64]| {
            let (sum, size) = (sum(c), c.iter().map(|c| c.abs()).sum::<f64>());
            if sum.abs() > AT_ONE * size { sum } else { 0.0 }
        };
        sum(&self.b) / (denominator(&self.a) * denominator(&self.f))
    }

    /// Returns the derivatives of [`Self::static_gain`] with respect to the parameters, in the order A, B, C, D, F.
    pub fn static_gain_gradient(&self) -> Vec<f64> {
        let sum = |c: &[f64]| c.iter().sum::<f64>();
        let (a, f, gain) = (sum(&self.a), sum(&self.f), self.static_gain());
        let orders = self.orders();
        [
            vec![-gain / a; orders.na],
            vec![1.0 / (a * f); orders.nb],
            vec![0.0; orders.nc + orders.nd],
            vec![-gain / f; orders.nf],
        ]
        .concat()
    }

    /// Returns the denominator `A F` of the part that u drives.
    pub fn denominator(&self) -> Vec<f64> {
        polynomial::multiply(&self.a, &self.f)
    }

    /// Returns the part that u drives in the paper's form; `None` if nk = 0, which that form does not have.
    pub fn plant(&self) -> Option<StateSpace> {
        let denominator = self.denominator();
        let n = self.orders().order();
        let mut h = vec![0.0; n];
        let (first, rest) = self.b.split_first().unwrap_or((&0.0, &[]));
        if *first != 0.0 || self.delay == 0 {
            return None;
        }
        h[..rest.len()].copy_from_slice(rest);
        let mut alpha = vec![0.0; n];
        alpha[..denominator.len() - 1].copy_from_slice(&denominator[1..]);
        StateSpace::from_polynomials(&alpha, &h).ok()
    }
}

impl From<&StateSpace> for LinearModel {
    fn from(plant: &StateSpace) -> Self {
        Self::from_canonical(plant.a(), &plant.h(), 1)
    }
}

#[cfg(test)]
mod tests;
