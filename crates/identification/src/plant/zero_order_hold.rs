//! A plant in continuous time, sampled under an input that is held between samples.

use super::{StateSpace, SystemError};

/// The largest order. Beyond it, coefficients of `s` say too little of the plant.
const LARGEST: usize = 20;

/// Why a transfer function of s has no sampled plant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HoldError {
    /// The denominator is empty, or its leading coefficient is 0.
    #[error("expected a denominator in falling powers of s whose first coefficient is not 0")]
    Denominator,
    /// The numerator is 0.
    #[error("expected a numerator in falling powers of s that is not 0")]
    Numerator,
    /// The numerator is not of lower degree than the denominator.
    #[error("the numerator's degree {0} is not below the denominator's {1}: u would act on y at once")]
    Proper(usize, usize),
    /// The order is too high.
    #[error("order {0}; expected at most {LARGEST}")]
    Order(usize),
    /// The time between samples is not positive.
    #[error("the time between samples is {0}; expected a number above 0")]
    Step(f64),
    /// The sampled plant has no finite coefficients.
    #[error(transparent)]
    System(#[from] SystemError),
}

/// Samples `numerator(s) / denominator(s)`, coefficients in falling powers, every `step` seconds under a zero-order hold
/// of the input, as MATLAB's `c2d(tf(num, den), step)`.
///
/// With the companion form (F, g, h) of the transfer function, `[A b; 0 1] = exp([F g; 0 0] step)`. The plant has the
/// characteristic polynomial of A (by Faddeev and Le Verrier) and the impulse response `h' A^(k-1) b`. All arithmetic is
/// plain, so that the bits are those of every machine.
///
/// # Errors
/// [`HoldError`].
pub fn zero_order_hold(numerator: &[f64], denominator: &[f64], step: f64) -> Result<StateSpace, HoldError> {
    let (leading, n) = match denominator {
        [] | [0.0, ..] => return Err(HoldError::Denominator),
        [leading, rest @ ..] => (*leading, rest.len()),
    };
    let zeros = numerator.iter().take_while(|c| **c == 0.0).count();
    let numerator = &numerator[zeros..];
    if numerator.is_empty() {
        return Err(HoldError::Numerator);
    }
    if numerator.len() > n {
        return Err(HoldError::Proper(numerator.len() - 1, n));
    }
    if n > LARGEST {
        return Err(HoldError::Order(n));
    }
    if !(step > 0.0 && step.is_finite()) {
        return Err(HoldError::Step(step));
    }
    let mut system = Square::zero(n + 1);
    for (j, d) in denominator[1..].iter().enumerate() {
        system.set(0, j, -d / leading * step);
    }
    system.set(0, n, step);
    for i in 1..n {
        system.set(i, i - 1, step);
    }
    let held = system.exponential();
    let mut a = Square::zero(n);
    for i in 0..n {
        for j in 0..n {
            a.set(i, j, held.at(i, j));
        }
    }
    let mut output = vec![0.0; n];
    for (h, c) in output.iter_mut().rev().zip(numerator.iter().rev()) {
        *h = c / leading;
    }
    let mut x: Vec<f64> = (0..n).map(|i| held.at(i, n)).collect();
    let impulse = (0..n).map(|_| {
        let y = dot(&output, &x);
        x = (0..n).map(|i| dot(a.row(i), &x)).collect();
        y
    });
    let impulse: Vec<f64> = impulse.collect();
    let last_row = a.characteristic().into_iter().rev().map(|alpha| -alpha);
    Ok(StateSpace::new(last_row.collect(), impulse)?)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A square matrix.
#[derive(Clone)]
struct Square {
    n: usize,
    rows: Vec<f64>,
}

impl Square {
    fn zero(n: usize) -> Self {
        Self {
            n,
            rows: vec![0.0; n * n],
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.rows[i * self.n + j]
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.rows[i * self.n..(i + 1) * self.n]
    }

    fn set(&mut self, i: usize, j: usize, value: f64) {
        self.rows[i * self.n + j] = value;
    }

    fn add_identity(&mut self, times: f64) {
        for i in 0..self.n {
            self.rows[i * self.n + i] += times;
        }
    }

    fn times(&self, other: &Self) -> Self {
        let mut product = Self::zero(self.n);
        for i in 0..self.n {
            for j in 0..self.n {
                let terms = (0..self.n).map(|k| self.at(i, k) * other.at(k, j));
                product.set(i, j, terms.sum());
            }
        }
        product
    }

    /// `e^A` by its series at `A / 2^s`, whose rows sum to at most 1/2, and s squarings.
    fn exponential(&self) -> Self {
        // (1/2)^17 / 17! is below 2^-64.
        const TERMS: u32 = 16;
        let sums = (0..self.n).map(|i| self.row(i).iter().map(|x| x.abs()).sum::<f64>());
        let mut size = sums.fold(0.0, f64::max);
        let (mut scaled, mut squarings) = (self.clone(), 0);
        while size > 0.5 && size.is_finite() {
            size *= 0.5;
            squarings += 1;
            for x in &mut scaled.rows {
                *x *= 0.5;
            }
        }
        let mut sum = Self::zero(self.n);
        sum.add_identity(1.0);
        // Horner's rule: 1 + A/1 (1 + A/2 (1 + A/3 ...)).
        for term in (1..=TERMS).rev() {
            sum = scaled.times(&sum);
            for x in &mut sum.rows {
                *x /= f64::from(term);
            }
            sum.add_identity(1.0);
        }
        for _ in 0..squarings {
            sum = sum.times(&sum);
        }
        sum
    }

    /// The coefficients `alpha_1 ... alpha_n` of `det(z I - A) = z^n + alpha_1 z^(n-1) + ...`.
    fn characteristic(&self) -> Vec<f64> {
        let mut alpha = Vec::with_capacity(self.n);
        let mut m = Self::zero(self.n);
        m.add_identity(1.0);
        for k in 1..=self.n {
            m = self.times(&m);
            let trace: f64 = (0..self.n).map(|i| m.at(i, i)).sum();
            let next = -trace / k as f64;
            m.add_identity(next);
            alpha.push(next);
        }
        alpha
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: &[f64], expected: &[f64], tolerance: f64) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() <= tolerance, "{found} {expected}");
        }
    }

    /// `k / (tau s + 1)` is `b/(z - e^(-T/tau))` with `b = k (1 - e^(-T/tau))`; an integrator `1/s` is `T/(z - 1)`.
    #[test]
    fn first_order() {
        let plant = zero_order_hold(&[3.0], &[2.0, 1.0], 0.5).unwrap();
        let pole = (-0.25_f64).exp();
        near(plant.a(), &[pole], 1e-15);
        near(plant.b(), &[3.0 * (1.0 - pole)], 4e-15);
        let integrator = zero_order_hold(&[1.0], &[1.0, 0.0], 0.2).unwrap();
        assert_eq!((integrator.a(), integrator.b()), (&[1.0][..], &[0.2][..]));
    }

    /// Of `w^2/(s^2 + 2 zeta w s + w^2)` with `c = e^(-zeta w T)`, `v = w sqrt(1 - zeta^2)`: alpha = (-2 c cos(v T), c^2),
    /// and the step response `1 - e^(-zeta w t) (cos(v t) + zeta w/v sin(v t))` at the samples gives the impulse response.
    #[test]
    fn second_order() {
        let (w, zeta, step) = (6.0, 0.3, 0.1);
        let plant = zero_order_hold(&[w * w], &[1.0, 2.0 * zeta * w, w * w], step).unwrap();
        let v = w * f64::sqrt(1.0 - zeta * zeta);
        let c = (-zeta * w * step).exp();
        near(plant.a(), &[-c * c, 2.0 * c * (v * step).cos()], 1e-14);
        let response = |t: f64| 1.0 - (-zeta * w * t).exp() * ((v * t).cos() + zeta * w / v * (v * t).sin());
        near(plant.b(), &[response(step), response(2.0 * step) - response(step)], 1e-14);
    }

    /// Ten poles between -1 and -10, of which each goes to `e^(p T)`, and the gain stays.
    #[test]
    fn poles_and_gain_of_a_large_plant() {
        let mut denominator = vec![1.0];
        for pole in 1..=10 {
            denominator.push(0.0);
            for i in (1..denominator.len()).rev() {
                denominator[i] += f64::from(pole) * denominator[i - 1];
            }
        }
        let last = denominator[10];
        let plant = zero_order_hold(&[2.0 * last], &denominator, 0.3).unwrap();
        let mut expected = vec![1.0];
        for pole in 1..=10 {
            expected.push(0.0);
            for i in (1..expected.len()).rev() {
                expected[i] -= (-0.3 * f64::from(pole)).exp() * expected[i - 1];
            }
        }
        let alpha: Vec<f64> = plant.a().iter().rev().map(|a| -a).collect();
        near(&alpha, &expected[1..], 1e-9);
        let gain = plant.h().iter().sum::<f64>() / expected.iter().sum::<f64>();
        assert!((gain - 2.0).abs() < 1e-6, "{gain}");
    }

    #[test]
    fn what_is_refused() {
        let error = |numerator: &[f64], denominator: &[f64], step| {
            zero_order_hold(numerator, denominator, step).unwrap_err()
        };
        assert_eq!(error(&[1.0], &[], 1.0), HoldError::Denominator);
        assert_eq!(error(&[0.0], &[1.0, 1.0], 1.0), HoldError::Numerator);
        assert_eq!(error(&[1.0, 1.0], &[1.0, 1.0], 1.0), HoldError::Proper(1, 1));
        assert_eq!(error(&[1.0], &[1.0; 30], 1.0), HoldError::Order(29));
        assert_eq!(error(&[1.0], &[1.0, 1.0], 0.0), HoldError::Step(0.0));
        assert!(matches!(error(&[1.0], &[1.0, -1.0], 1e4), HoldError::System(_)));
    }
}
