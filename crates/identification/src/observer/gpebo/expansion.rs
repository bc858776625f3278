//! Eq. (17): the regression of the expanded exponential.

use crate::real::Real;

/// The treatment of the factor `g = e^m`. It cancels from the identity of Eq. (16) but weights its terms in time.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Factor {
    /// Kept, as the paper's gains assume.
    #[default]
    Keep,
    /// Replaced by 1, which needs gains of its own.
    Drop,
}

/// Highest order of the expansion.
pub const HIGHEST_ORDER: usize = 2;

/// The regression of one component at one time: `values[0]` is zeta, `values[1 ..= q+1]` is psi.
pub type Regression<R = f64> = [R; HIGHEST_ORDER + 2];

/// Computes Eq. (17) for one component from m, m', phi, phi' and the factor g, [`Factor`], with `e^d`,
/// `d = m - phi theta`, expanded to order q (1 or 2):
/// `zeta - psi'(theta, ..., theta^(q+1)) = (g / q!) (m - phi theta)^q (m' - phi' theta)`.
///
/// From Eq. (12), `g' = g m'`. From Eq. (15) with `E_q(d) = 1 + d + ... + d^q / q!`, multiplied by E_q,
/// `E_q g' = E_q phi' theta g + E_(q-1) d' g`. The difference of the two is the right-hand side above. It is what the
/// expansion neglects, and the estimator takes it for zero. The paper prints further terms in psi_1, which do not
/// belong there (erratum E10).
///
/// An order above 2 is taken as 2, and 0 as 1. Unused entries are zero.
#[inline(always)]
pub fn regression<R: Real>(order: usize, [m, dm]: [R; 2], [phi, dphi]: [R; 2], g: R) -> Regression<R> {
    if order < 2 {
        let first = g * m * dm;
        return [first, g * (m * dphi + phi * dm), -g * phi * dphi, R::zero()];
    }
    // Division by a power of two is multiplication by its inverse.
    let half = R::splat(0.5);
    [
        g * m * m * dm * half,
        g * (phi * m * dm + m * m * dphi * half),
        -g * (m * phi * dphi + phi * phi * dm * half),
        g * phi * phi * dphi * half,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: [f64; 4] = [-2.0, -1.0, 1.0, 3.0];

    /// Calls `check(m, dm, phi, dphi, theta)` on a grid that has more points per variable than the polynomials'
    /// degree (3 at most), so polynomials that agree there are equal. All numbers are small multiples of 1/2, so f64
    /// is exact.
    fn on_grid(check: impl Fn(f64, f64, f64, f64, f64)) {
        for k in 0..4_usize.pow(5) {
            let at = |digit: u32| GRID[k / 4_usize.pow(digit) % 4];
            check(at(0), at(1), at(2), at(3), at(4));
        }
    }

    fn residual(r: &Regression, theta: f64) -> f64 {
        r[0] - (r[1] * theta + r[2] * theta.powi(2) + r[3] * theta.powi(3))
    }

    #[test]
    fn residual_is_the_neglected_term() {
        on_grid(|m, dm, phi, dphi, theta| {
            let (d, dd) = (m - phi * theta, dm - dphi * theta);
            let first = regression(1, [m, dm], [phi, dphi], 1.0);
            assert_eq!(residual(&first, theta), d * dd);
            let second = regression(2, [m, dm], [phi, dphi], 1.0);
            assert_eq!(residual(&second, theta), d * d * dd / 2.0);
        });
    }

    /// Eq. (15) differentiated gives Eq. (16); `g' = g m'` is subtracted from it.
    #[test]
    fn residual_is_equation_16() {
        on_grid(|m, dm, phi, dphi, theta| {
            let (d, dd) = (m - phi * theta, dm - dphi * theta);
            let e = [1.0, 1.0 + d, 1.0 + d + d * d / 2.0];
            for q in 1..=2 {
                let left = e[q] * dm;
                let right = e[q] * dphi * theta + e[q - 1] * dd;
                let r = regression(q, [m, dm], [phi, dphi], 1.0);
                assert_eq!(residual(&r, theta), left - right);
            }
        });
    }

    #[test]
    fn g_is_a_common_factor() {
        let (m, dm, phi, dphi) = (0.3, -0.7, 1.1, 0.4);
        for q in 1..=2 {
            let kept = regression(q, [m, dm], [phi, dphi], 0.3_f64.exp());
            let dropped = regression(q, [m, dm], [phi, dphi], 1.0);
            for (k, d) in kept.iter().zip(dropped) {
                assert!((k - d * 0.3_f64.exp()).abs() < 1e-15);
            }
        }
    }
}
