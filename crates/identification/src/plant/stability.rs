//! Stability without eigenvalues, by Levinson's step-down recursion, also known as the Schur-Cohn or Jury test.

pub use crate::step_down::StepDown;

use crate::real::{Mask, Real};
use crate::step_down::step_down;

/// Returns whether all zeros of `z^n - a_n z^(n-1) - ... - a_1` lie inside the unit circle, in O(n^2).
///
/// `scratch` has room for n numbers.
///
/// # Panics
/// In debug builds, if the lengths differ.
#[inline(always)]
pub fn is_stable<R: Real>(a: &[R], scratch: &mut [R]) -> R::Mask {
    super::canonical::reverse_negated(a, scratch);
    let inside = |kappa: R| kappa.abs().less(R::splat(1.0));
    let mut stable = R::Mask::from_bits(u8::MAX);
    for m in (1..=scratch.len()).rev() {
        stable = stable & inside(step_down(&mut scratch[..m]));
    }
    stable
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_quadratic() {
        // z^2 - 1.5 z + 0.7: poles 0.75 +- 0.37i, modulus 0.837.
        assert!(is_stable(&[-0.7, 1.5], &mut [0.0; 2]));
        assert!(!is_stable(&[-1.0, 1.5], &mut [0.0; 2]));
        assert!(!is_stable(&[-0.7, 1.75], &mut [0.0; 2]));
        assert!(!is_stable(&[f64::NAN, 1.0], &mut [0.0; 2]));
        assert!(is_stable::<f64>(&[], &mut []));
    }

    #[test]
    fn energy_is_the_sum_of_the_squared_impulse_response() {
        for (c, d) in [
            (vec![1.0], vec![-0.9]),
            (vec![0.5, -1.0, 2.0], vec![-1.2, 0.5]),
            (vec![1.0, 0.3, 0.0, -0.4, 2.0], vec![0.4, -0.3]),
            (vec![2.0, 1.0], vec![]),
            (vec![0.0, 1.0], vec![-1.4, 0.7875, -0.2275, 0.035525]),
        ] {
            let mut g: Vec<f64> = Vec::new();
            for k in 0..2000 {
                let mut sum = c.get(k).copied().unwrap_or(0.0);
                for (i, d) in d.iter().enumerate().take(k) {
                    sum -= d * g[k - 1 - i];
                }
                g.push(sum);
            }
            let direct: f64 = g.iter().map(|g| g * g).sum();
            let energy = StepDown::new(&d).unwrap().energy(&c);
            assert!((energy / direct - 1.0).abs() < 1e-13, "{energy} {direct}");
        }
    }
}
