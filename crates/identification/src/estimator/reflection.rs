//! Stabilisation of the auxiliary model: poles outside the unit circle are reflected into it.

use super::FailureKind;
use crate::failure::all_finite;
use crate::names::named_enum;
use crate::plant::canonical::{multiply_toeplitz, reverse_negated, solve_toeplitz};
use crate::plant::stability::is_stable;
use crate::plant::{PoleFinder, polynomial_from_poles};

named_enum! {
    /// The treatment of an unstable auxiliary model before stage 7.
    Stabilise, "stabilisation" {
        /// Nothing (the default).
        None = "none",
        /// Poles outside the unit circle are reflected into it: [`PoleReflection`].
        Reflect = "reflect",
    }
}

/// The largest modulus of a reflected pole. A pole on the circle is its own reflection and is scaled to this.
pub const LARGEST_MODULUS: f64 = 1.0 - 1e-6;

/// Reflects poles: p with `|p| >= 1` becomes `1 / conj(p)`, with the same angle and modulus `1 / |p|` (at most
/// [`LARGEST_MODULUS`]).
///
/// The numerator h is kept: `T(a) b = h = T(a') b'`. The gain is not corrected, because instruments only need a stable
/// model.
pub struct PoleReflection {
    poles: PoleFinder,
    alpha: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
}

impl PoleReflection {
    /// Makes buffers for order n.
    pub fn new(order: usize) -> Self {
        Self {
            poles: PoleFinder::new(order),
            alpha: vec![0.0; order],
            a: vec![0.0; order],
            b: vec![0.0; order],
        }
    }

    /// Returns `(a', b')` for a model (a, b).
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the eigenvalue iteration does not converge or a coefficient is not finite.
    ///
    /// # Panics
    /// If `a` or `b` is not of the order that the buffers were made for.
    pub fn run(&mut self, a: &[f64], b: &[f64]) -> Result<(&[f64], &[f64]), FailureKind> {
        let mut poles = self.poles.poles(a);
        if poles.is_empty() {
            return Err(FailureKind::NonFinite);
        }
        for pole in &mut poles {
            let modulus = pole.norm();
            if modulus >= 1.0 {
                *pole *= modulus.recip().min(LARGEST_MODULUS) / modulus;
            }
        }
        for (alpha, phi) in self.alpha.iter_mut().zip(polynomial_from_poles(&poles)) {
            *alpha = phi.re;
        }
        reverse_negated(&self.alpha, &mut self.a);
        self.b.copy_from_slice(b);
        multiply_toeplitz(a, &mut self.b);
        solve_toeplitz(&self.a, &mut self.b);
        all_finite(self.a.iter().chain(&self.b))?;
        Ok((&self.a, &self.b))
    }
}

/// Reflects the zeros outside the unit circle of a monic polynomial in q^-1, `1 + d_1 q^-1 + ...`, as
/// [`PoleReflection`] does poles. Returns false if the result is not finite.
pub(super) fn reflect_zeros(polynomial: &mut [f64]) -> bool {
    let degree = polynomial.len() - 1;
    if degree == 0 {
        return true;
    }
    let mut reflection = PoleReflection::new(degree);
    let mut a = vec![0.0; degree];
    reverse_negated(&polynomial[1..], &mut a);
    let Ok((reflected, _)) = reflection.run(&a, &vec![0.0; degree]) else {
        return false;
    };
    reverse_negated(reflected, &mut polynomial[1..]);
    true
}

/// Reflects the zeros of a monic polynomial outside the unit circle, if that is wanted.
///
/// # Errors
/// [`FailureKind::UnstablePredictor`] if it is not wanted; [`FailureKind::NonFinite`].
pub(super) fn stay_stable(
    polynomial: &mut [f64],
    stabilise: Stabilise,
    scratch: &mut Vec<f64>,
) -> Result<(), FailureKind> {
    match stabilise {
        _ if stable(polynomial, scratch) => Ok(()),
        Stabilise::None => Err(FailureKind::UnstablePredictor),
        Stabilise::Reflect if reflect_zeros(polynomial) => Ok(()),
        Stabilise::Reflect => Err(FailureKind::NonFinite),
    }
}

/// Returns whether the zeros of a monic polynomial are inside the unit circle. `scratch` has room for twice its degree.
pub(super) fn stable(polynomial: &[f64], scratch: &mut Vec<f64>) -> bool {
    let n = polynomial.len() - 1;
    scratch.resize(2 * n, 0.0);
    let (a, scratch) = scratch.split_at_mut(n);
    reverse_negated(&polynomial[1..], a);
    is_stable(a, scratch)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: &[f64], expected: &[f64]) -> bool {
        let pairs = found.iter().zip(expected);
        found.len() == expected.len() && pairs.into_iter().all(|(f, e)| (f - e).abs() < 1e-12)
    }

    /// By hand: A = (1 - 2 q^-1)(1 - 0.5 q^-1) has a = (-1, 2.5); 2 goes to 0.5, so A' = (1 - 0.5 q^-1)^2, a' = (-0.25,
    /// 1). b = (1, 3) has h = (1, 3 - 2.5) = (1, 0.5), and b' = (1, 0.5 + 1).
    #[test]
    fn a_real_pole_by_hand() {
        let mut reflection = PoleReflection::new(2);
        let (a, b) = reflection.run(&[-1.0, 2.5], &[1.0, 3.0]).unwrap();
        assert!(close(a, &[-0.25, 1.0]), "{a:?}");
        assert!(close(b, &[1.0, 1.5]), "{b:?}");
    }

    /// By hand: poles 1 +- i (z^2 - 2z + 2) go to (1 +- i) / 2, z^2 - z + 0.5; with h = (1, 1), b = (1, 3), b' = (1,
    /// 2).
    #[test]
    fn a_complex_pair_by_hand() {
        let mut reflection = PoleReflection::new(2);
        let (a, b) = reflection.run(&[-2.0, 2.0], &[1.0, 3.0]).unwrap();
        assert!(close(a, &[-0.5, 1.0]), "{a:?}");
        assert!(close(b, &[1.0, 2.0]), "{b:?}");
    }

    #[test]
    fn a_pole_on_the_circle_goes_inside_and_stable_ones_stay() {
        let mut reflection = PoleReflection::new(1);
        let (a, b) = reflection.run(&[-1.0], &[2.0]).unwrap();
        assert_eq!((a[0], b[0]), (-LARGEST_MODULUS, 2.0));
        let (a, _) = reflection.run(&[0.9], &[2.0]).unwrap();
        assert!(close(a, &[0.9]));
        let failed = reflection.run(&[f64::NAN], &[1.0]);
        assert_eq!(failed.err(), Some(FailureKind::NonFinite));
    }
}
