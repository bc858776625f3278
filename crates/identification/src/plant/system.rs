//! State-space and transfer-function forms of the canonical plant.

use super::canonical::{multiply_toeplitz, reverse_negated, solve_toeplitz};
use super::simulate::{simulate, simulate_disturbed};
use super::stability::is_stable;
use crate::step_down::StepDown;

/// The plant in phase-coordinate canonical form, Eqs. (1) to (3):
/// `x(k+1) = A x(k) + b u(k)`, `y(k) = x_1(k)`, `A = [0 | I; a']`.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    a: Vec<f64>,
    b: Vec<f64>,
}

/// Why coefficients do not form a plant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// The two vectors are empty or of different lengths.
    #[error("a plant needs two coefficient vectors of one length n >= 1, not {0} and {1}")]
    Order(usize, usize),
    /// A coefficient is not a finite number.
    #[error("a plant's coefficients must be finite numbers")]
    NotFinite,
}

fn check(first: &[f64], second: &[f64]) -> Result<(), SystemError> {
    if first.is_empty() || first.len() != second.len() {
        return Err(SystemError::Order(first.len(), second.len()));
    }
    if !first.iter().chain(second).all(|c| c.is_finite()) {
        return Err(SystemError::NotFinite);
    }
    Ok(())
}

impl StateSpace {
    /// Makes the plant with last row `a` of A and input vector `b`, Eqs. (2), (3).
    ///
    /// # Errors
    /// If the lengths differ or are zero, or a coefficient is not finite.
    pub fn new(a: Vec<f64>, b: Vec<f64>) -> Result<Self, SystemError> {
        check(&a, &b)?;
        Ok(Self { a, b })
    }

    /// Makes the plant `W(z) = (h_1 z^(n-1) + ... + h_n) / (z^n - a_n z^(n-1) - ... - a_1)`, Eq. (4), with b from
    /// `T b = h`, Eq. (5).
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn from_transfer_function(a: Vec<f64>, mut h: Vec<f64>) -> Result<Self, SystemError> {
        check(&a, &h)?;
        solve_toeplitz(&a, &mut h);
        Ok(Self { a, b: h })
    }

    /// Makes the plant `A(q) y = B(q) u` from `alpha_1 ... alpha_n` and `beta_1 ... beta_n`: `alpha_i = -a_(n+1-i)` and
    /// `beta_i = h_i`.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn from_polynomials(alpha: &[f64], beta: &[f64]) -> Result<Self, SystemError> {
        let mut a = vec![0.0; alpha.len()];
        reverse_negated(alpha, &mut a);
        Self::from_transfer_function(a, beta.to_vec())
    }

    /// Returns the order n.
    pub fn order(&self) -> usize {
        self.a.len()
    }

    /// Returns the last row of A, `a_1 ... a_n`.
    pub fn a(&self) -> &[f64] {
        &self.a
    }

    /// Returns the input vector `b_1 ... b_n`: the first n Markov parameters.
    pub fn b(&self) -> &[f64] {
        &self.b
    }

    /// Returns the numerator `h = T b`, Eq. (5).
    pub fn h(&self) -> Vec<f64> {
        let mut h = self.b.clone();
        multiply_toeplitz(&self.a, &mut h);
        h
    }

    /// Returns the coefficients `1, alpha_1, ..., alpha_n` of A(q).
    pub fn denominator(&self) -> Vec<f64> {
        let mut alpha = vec![1.0; self.order() + 1];
        reverse_negated(&self.a, &mut alpha[1..]);
        alpha
    }

    /// Returns whether all poles lie inside the unit circle.
    pub fn is_stable(&self) -> bool {
        is_stable(&self.a, &mut vec![0.0; self.order()])
    }

    /// Returns `sum_k w(k)^2` of the impulse response: the variance of the output under white input of unit variance.
    /// `None` for an unstable plant.
    pub fn energy(&self) -> Option<f64> {
        let step_down = StepDown::new(&self.denominator()[1..])?;
        let mut numerator = self.h();
        numerator.insert(0, 0.0);
        Some(step_down.energy(&numerator))
    }

    /// Computes the noise-free output in `y0` and the states in `states` (row k holds x(k), n numbers a row). `x` holds
    /// the initial state on entry and the state after the last input on return.
    ///
    /// # Panics
    /// If `x` is not of length n, or the outputs' lengths do not fit `u`.
    pub fn simulate(&self, x: &mut [f64], u: &[f64], y0: &mut [f64], states: &mut [f64]) {
        let n = self.order();
        assert!(y0.len() == u.len() && states.len() == n * u.len());
        simulate(
            &self.a,
            &self.b,
            x,
            u,
            #[inline(always)]
            |k, x| {
                y0[k] = x[0];
                // The length of x is a constant for small orders.
                let n = x.len();
                states[k * n..(k + 1) * n].copy_from_slice(x);
            },
        );
    }

    /// Does the same with process noise, `x(k+1) = A x(k) + b u(k) + w(k)`. On entry, row k of `states` holds w(k); it
    /// is overwritten by x(k).
    ///
    /// # Panics
    /// As for [`Self::simulate`].
    pub fn simulate_disturbed(&self, x: &mut [f64], u: &[f64], y0: &mut [f64], states: &mut [f64]) {
        assert!(y0.len() == u.len() && states.len() == self.order() * u.len());
        simulate_disturbed(&self.a, &self.b, x, u, states);
        for (y0, x) in y0.iter_mut().zip(states.chunks_exact(self.order())) {
            *y0 = x[0];
        }
    }

    /// Returns `sum_k ||c'A^k||^2`: the variance of the output under process noise `w(k) ~ N(0, I)` alone. `None` for
    /// an unstable plant.
    pub fn disturbance_energy(&self) -> Option<f64> {
        let n = self.order();
        let of_component = |i: usize| {
            let unit = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
            Self {
                a: self.a.clone(),
                b: unit,
            }
            .energy()
        };
        (0..n).map(of_component).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An order-2 impulse response by hand: b holds the first Markov parameters.
    #[test]
    fn b_holds_the_first_markov_parameters() {
        let plant = StateSpace::from_polynomials(&[-1.5, 0.7], &[1.0, 0.5]).unwrap();
        // w(1) = 1, w(2) = 0.5 + 1.5, w(3) = 1.5 * 2 - 0.7
        assert_eq!(plant.b(), [1.0, 2.0]);
        let mut y = [0.0; 4];
        let mut states = [0.0; 8];
        plant.simulate(&mut [0.0; 2], &[1.0, 0.0, 0.0, 0.0], &mut y, &mut states);
        assert_eq!(y[..3], [0.0, 1.0, 2.0]);
        assert!((y[3] - 2.3).abs() < 1e-15);
        assert_eq!(states[2..4], [1.0, 2.0]);
    }

    /// On entry, row k of the states is w(k). By hand for order 2.
    #[test]
    fn process_noise_enters_every_component_a_step_later() {
        let plant = StateSpace::new(vec![-0.7, 1.5], vec![1.0, 2.0]).unwrap();
        let (mut x, mut y0) = ([1.0, -1.0], [0.0; 3]);
        let mut states = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        plant.simulate_disturbed(&mut x, &[1.0, 0.0, 0.0], &mut y0, &mut states);
        let second = [-1.0 + 1.0 + 0.1, -0.7 - 1.5 + 2.0 + 0.2];
        let third = [second[1] + 0.3, -0.7 * second[0] + 1.5 * second[1] + 0.4];
        let expected = [[1.0, -1.0], second, third].concat();
        for (found, expected) in states.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-15, "{states:?}");
        }
        assert_eq!(y0, [states[0], states[2], states[4]]);
        assert!((x[0] - (third[1] + 0.5)).abs() < 1e-15, "{x:?}");
    }

    /// Compared with the sum itself.
    #[test]
    fn the_energy_of_process_noise() {
        let plant = StateSpace::new(vec![-0.7, 1.5], vec![1.0, 2.0]).unwrap();
        let (mut row, mut sum) = ([1.0, 0.0], 0.0);
        for _ in 0..500 {
            sum += row[0] * row[0] + row[1] * row[1];
            row = [-0.7 * row[1], row[0] + 1.5 * row[1]];
        }
        let energy = plant.disturbance_energy().unwrap();
        assert!((energy / sum - 1.0).abs() < 1e-13, "{energy} {sum}");
    }

    #[test]
    fn refusals() {
        assert_eq!(StateSpace::new(vec![], vec![]), Err(SystemError::Order(0, 0)));
        assert_eq!(
            StateSpace::from_transfer_function(vec![0.5], vec![1.0, 2.0]),
            Err(SystemError::Order(1, 2))
        );
        assert_eq!(StateSpace::new(vec![f64::NAN], vec![1.0]), Err(SystemError::NotFinite));
    }
}
