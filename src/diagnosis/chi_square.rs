//! The tail of the chi-square law, by its finite sums.

use libm::erfc;

/// `P(X > x)` for X of the chi-square law with so many degrees of freedom (at least 1).
///
/// With `h = x/2`: for an even number of degrees `exp(-h) sum_(i < k/2) h^i / i!`, for an odd one
/// `erfc(sqrt h) + exp(-h) sum_(1 <= i <= (k-1)/2) h^(i - 1/2) / Gamma(i + 1/2)` (Abramowitz and Stegun, 26.4.4 and 26.4.5).
pub fn chi_square_tail(x: f64, degrees: usize) -> f64 {
    if !(x > 0.0) {
        return if x.is_nan() { f64::NAN } else { 1.0 };
    }
    let half = x / 2.0;
    let odd = degrees % 2 == 1;
    // The term of i, by its logarithm: exp(-h) underflows long before the sum does.
    let mut log_term = if odd {
        // h^(1/2) / Gamma(3/2)
        0.5 * half.ln() - (0.5 * std::f64::consts::PI.sqrt()).ln()
    } else {
        0.0
    };
    let mut sum = if odd { erfc(half.sqrt()) } else { 0.0 };
    for i in 0..degrees / 2 {
        sum += (log_term - half).exp();
        let next = if odd { i as f64 + 1.5 } else { i as f64 + 1.0 };
        log_term += (half / next).ln();
    }
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The 5 % and 1 % points of printed tables (Abramowitz and Stegun, table 26.8).
    #[test]
    fn printed_quantiles() {
        for (degrees, x, tail) in [
            (1, 3.84146, 0.05),
            (1, 6.63490, 0.01),
            (2, 5.99147, 0.05),
            (3, 7.81473, 0.05),
            (10, 18.3070, 0.05),
            (23, 35.1725, 0.05),
            (23, 41.6384, 0.01),
            (24, 36.4151, 0.05),
            (25, 37.6525, 0.05),
        ] {
            let found = chi_square_tail(x, degrees);
            assert!((found - tail).abs() < 2e-6, "{degrees}: {found}");
        }
    }

    #[test]
    fn ends() {
        assert_eq!(chi_square_tail(0.0, 3), 1.0);
        assert_eq!(chi_square_tail(-1.0, 4), 1.0);
        assert!(chi_square_tail(1e5, 3) == 0.0 && chi_square_tail(f64::NAN, 3).is_nan());
    }
}
