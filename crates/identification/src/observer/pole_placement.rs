//! The observer's gain by pole placement: reading E8.
//!
//! The observability matrix of the canonical form is I. Hence `F = A - g c'` has the characteristic polynomial phi_F if
//! `T g = phi_F - phi_A`, that is `(T g)_i = (phi_F)_i + a_(n+1-i)`, with T of stage 5. `ackermann.rs` is for other
//! pairs (A, C), and continuous time.

use crate::plant::canonical::solve_toeplitz;
use crate::plant::{parse_pole, polynomial_from_poles, unmatched_pole};
use crate::real::Real;
use crate::text::text_in_files;
use faer::c64;

/// Where the eigenvalues of `F = A-hat - g c'` are placed.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Gain {
    /// At zero (the default): with the right model, the error vanishes after n steps.
    #[default]
    DeadBeat,
    /// At rho times the eigenvalues of A-hat; rho = 1 means no feedback.
    Scaled(f64),
    /// At n given places, complex ones in conjugate pairs; see [`Gain::poles`].
    Poles(Poles),
}

/// Placed poles and the coefficients `phi_1 ... phi_n` of their polynomial.
#[derive(Clone, Debug, PartialEq)]
pub struct Poles {
    poles: Vec<c64>,
    phi: Vec<f64>,
}

/// Why a gain was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GainError {
    /// The text has none of the known forms.
    #[error(
        "unknown gain '{0}'; expected dead-beat, scaled:RHO (such as scaled:0.5) or poles:LIST \
         (such as poles:0.2,0.1+0.3i,0.1-0.3i)"
    )]
    Form(String),
    /// A number cannot be read.
    #[error("gain '{0}': '{1}' is not a finite number")]
    Number(String, String),
    /// A complex pole lacks its conjugate.
    #[error("gain '{0}': complex poles must come in conjugate pairs")]
    Conjugates(String),
    /// The observability matrix is singular up to rounding.
    #[error(
        "the observability matrix has the condition number {0:.1e} in units of its own rows and columns, \
         too large to place poles; expected at most 1e9, or a gain of your own"
    )]
    Observability(f64),
    /// The number of poles differs from the order.
    #[error("the gain has {0} poles, but the order is {1}")]
    Count(usize, usize),
}

impl Poles {
    /// Makes a set of poles, in which complex ones must come in conjugate pairs.
    pub(super) fn new(poles: Vec<c64>) -> Self {
        let phi = polynomial_from_poles(&poles).iter().map(|phi| phi.re).collect();
        Self { poles, phi }
    }

    /// Returns the number of poles.
    pub(super) fn len(&self) -> usize {
        self.poles.len()
    }

    /// Returns `phi_1 ... phi_n` of `s^n + phi_1 s^(n-1) + ... + phi_n`.
    pub(super) fn polynomial(&self) -> &[f64] {
        &self.phi
    }
}

impl Gain {
    /// Returns a gain that places the given poles.
    ///
    /// # Errors
    /// [`GainError::Conjugates`] if complex poles do not come in conjugate pairs.
    pub fn poles(poles: Vec<c64>) -> Result<Self, GainError> {
        if let Some(pole) = unmatched_pole(&poles) {
            return Err(GainError::Conjugates(format!("{pole}")));
        }
        Ok(Self::Poles(Poles::new(poles)))
    }

    /// Checks that the gain fits an order.
    ///
    /// # Errors
    /// [`GainError::Count`].
    pub fn check(&self, order: usize) -> Result<(), GainError> {
        match self {
            Self::Poles(Poles { poles, .. }) if poles.len() != order => Err(GainError::Count(poles.len(), order)),
            _ => Ok(()),
        }
    }

    /// Returns the poles of F, largest modulus first, for a model with these poles of its own in that order.
    pub fn placed(&self, own: &[c64]) -> Vec<c64> {
        let mut poles = match self {
            Self::DeadBeat => vec![c64::new(0.0, 0.0); own.len()],
            Self::Scaled(rho) => own.iter().map(|pole| pole * *rho).collect(),
            Self::Poles(Poles { poles, .. }) => poles.clone(),
        };
        poles.sort_by(|p, q| q.norm().total_cmp(&p.norm()).then(q.im.total_cmp(&p.im)));
        poles
    }

    /// Returns whether a placed pole lies on or outside the unit circle for every model.
    pub fn places_unstable_pole(&self) -> bool {
        match self {
            Self::Poles(Poles { poles, .. }) => poles.iter().any(|pole| pole.norm() >= 1.0),
            _ => false,
        }
    }

    /// Computes `g` (n numbers) for a model whose A-hat has the last row `a`.
    ///
    /// # Panics
    /// If the lengths differ, or the number of poles is not n.
    #[inline(always)]
    pub fn compute<R: Real>(&self, a: &[R], g: &mut [R]) {
        let n = a.len();
        match self {
            Self::DeadBeat => {
                for i in 0..n {
                    g[i] = a[n - 1 - i];
                }
            }
            Self::Scaled(rho) => {
                // phi_F(z) = rho^n phi_A(z / rho): (phi_F)_i = -rho^i a_(n+1-i).
                let mut power = 1.0;
                for i in 0..n {
                    power *= rho;
                    g[i] = a[n - 1 - i] * R::splat(1.0 - power);
                }
            }
            Self::Poles(Poles { phi, .. }) => {
                for i in 0..n {
                    g[i] = R::splat(phi[i]) + a[n - 1 - i];
                }
            }
        }
        solve_toeplitz(a, g);
    }
}

impl std::fmt::Display for Gain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::DeadBeat => f.write_str("dead-beat"),
            Self::Scaled(rho) => write!(f, "scaled:{rho:?}"),
            Self::Poles(Poles { poles, .. }) => {
                f.write_str("poles:")?;
                for (i, pole) in poles.iter().enumerate() {
                    let comma = if i == 0 { "" } else { "," };
                    if pole.im == 0.0 {
                        write!(f, "{comma}{:?}", pole.re)?;
                    } else {
                        write!(f, "{comma}{:?}{:+?}i", pole.re, pole.im)?;
                    }
                }
                Ok(())
            }
        }
    }
}

text_in_files!(Gain, serde::Deserialize::deserialize, "string");

impl std::str::FromStr for Gain {
    type Err = GainError;

    fn from_str(text: &str) -> Result<Self, GainError> {
        let number = |part: &str| GainError::Number(text.to_owned(), part.to_owned());
        if text == "dead-beat" {
            Ok(Self::DeadBeat)
        } else if let Some(rho) = text.strip_prefix("scaled:") {
            let parsed = rho.parse().ok().filter(|rho: &f64| rho.is_finite());
            parsed.map(Self::Scaled).ok_or_else(|| number(rho))
        } else if let Some(list) = text.strip_prefix("poles:") {
            let poles: Result<Vec<c64>, GainError> = list
                .split(',')
                .map(|part| parse_pole(part.trim()).ok_or_else(|| number(part.trim())))
                .collect();
            Self::poles(poles?).map_err(|_| GainError::Conjugates(text.to_owned()))
        } else {
            Err(GainError::Form(text.to_owned()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Numerator, PoleFinder, nikolov2023};

    /// Returns the poles of F for a gain: the eigenvalues of F itself, found without `T g = phi_F - phi_A`.
    fn placed(gain: &Gain, a: &[f64]) -> Vec<c64> {
        let n = a.len();
        let mut g = vec![0.0; n];
        gain.compute(a, &mut g);
        let mut f = faer::Mat::<f64>::zeros(n, n);
        for i in 0..n {
            if i + 1 < n {
                f[(i, i + 1)] = 1.0;
            }
            f[(n - 1, i)] = a[i];
        }
        for i in 0..n {
            f[(i, 0)] -= g[i];
        }
        let mut poles = f.eigenvalues().unwrap();
        poles.sort_by(|p, q| q.norm().total_cmp(&p.norm()).then(q.im.total_cmp(&p.im)));
        poles
    }

    #[test]
    fn poles_are_placed() {
        let plant = nikolov2023(Numerator::StateSpace);
        let a = plant.a();
        // The computed eigenvalues of a nilpotent matrix are about the 6th root of the rounding.
        assert!(placed(&Gain::DeadBeat, a).iter().all(|p| p.norm() < 0.01));
        let scaled = placed(&Gain::Scaled(0.5), a);
        for (pole, own) in scaled.iter().zip(PoleFinder::new(6).poles(a)) {
            assert!((pole - 0.5 * own).norm() < 1e-6);
        }
        let gain: Gain = "poles:0.5+0.2i,0.5-0.2i,0.3,0.2,0.1,-0.4".parse().unwrap();
        let poles = placed(&gain, a);
        assert!((poles[0] - c64::new(0.5, 0.2)).norm() < 1e-6, "{poles:?}");
        assert!((poles[2].re + 0.4).abs() < 1e-6, "{poles:?}");
        assert_eq!(gain.to_string(), "poles:0.5+0.2i,0.5-0.2i,0.3,0.2,0.1,-0.4");
    }

    #[test]
    fn no_feedback_at_one() {
        let mut g = [1.0; 3];
        Gain::Scaled(1.0).compute(&[0.1, -0.2, 0.3], &mut g);
        assert_eq!(g, [0.0; 3]);
    }

    #[test]
    fn refusals_name_what_is_wrong() {
        for (text, part) in [
            ("deadbeat", "unknown gain"),
            ("scaled:x", "'x'"),
            ("scaled:inf", "finite"),
            ("poles:0.1,a", "'a'"),
            ("poles:0.1+0.2i", "conjugate"),
            ("poles:0.1+0.2i,0.1+0.2i", "conjugate"),
        ] {
            let error = text.parse::<Gain>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(Gain::poles(vec![c64::new(0.1, 0.0)]).unwrap().check(2).is_err());
        assert!("poles:1.0".parse::<Gain>().unwrap().places_unstable_pole());
        assert_eq!(parse_pole("1e-1-2e-1i"), Some(c64::new(0.1, -0.2)));
    }
}
