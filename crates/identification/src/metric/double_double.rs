//! Double-double arithmetic: numbers of 106 bits as the unevaluated sum of two doubles (Dekker 1971; Hida, Li and
//! Bailey 2001). The error of one operation is a few 2^-104 of its result; for sums with cancellation, of the larger
//! term.

use std::ops::{Add, Mul, Sub};

/// Returns `x y` as its rounded value and the rounding error.
#[inline(always)]
pub(super) fn two_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

/// Returns `x^2`, `x^3` and `x^4`, each as two doubles: the square exactly, the others to about 2^-104.
#[inline(always)]
pub(super) fn powers(x: f64) -> [(f64, f64); 3] {
    let (high, low) = two_product(x, x);
    [
        (high, low),
        product((high, low), (x, 0.0)),
        product((high, low), (high, low)),
    ]
}

/// The product of two pairs, not renormalised.
#[inline(always)]
pub(super) fn product(x: (f64, f64), y: (f64, f64)) -> (f64, f64) {
    let (high, low) = two_product(x.0, y.0);
    (high, x.0.mul_add(y.1, x.1.mul_add(y.0, low)))
}

/// A number as `high + low` with `|low|` at most half a unit in the last place of `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dd {
    high: f64,
    low: f64,
}

impl Dd {
    /// The sum of two doubles of any size.
    pub(super) fn new(x: f64, y: f64) -> Self {
        let high = x + y;
        let part = high - x;
        Self {
            high,
            low: (x - (high - part)) + (y - part),
        }
    }

    /// The nearest double.
    pub(super) fn value(self) -> f64 {
        self.high
    }

    /// The quotient of two numbers, by two steps of long division.
    pub(super) fn over(self, divisor: Self) -> Self {
        let first = self.high / divisor.high;
        let rest = self - divisor * Self::from(first);
        let second = rest.high / divisor.high;
        let rest = rest - divisor * Self::from(second);
        Self::new(first, second) + Self::from(rest.high / divisor.high)
    }
}

impl From<f64> for Dd {
    fn from(x: f64) -> Self {
        Self { high: x, low: 0.0 }
    }
}

impl From<(f64, f64)> for Dd {
    fn from((x, y): (f64, f64)) -> Self {
        Self::new(x, y)
    }
}

impl Add for Dd {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let high = Self::new(self.high, other.high);
        let low = Self::new(self.low, other.low);
        let sum = Self::new(high.high, high.low + low.high);
        Self::new(sum.high, sum.low + low.low)
    }
}

impl Sub for Dd {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self {
            high: -other.high,
            low: -other.low,
        }
    }
}

impl Mul for Dd {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let (high, low) = product((self.high, self.low), (other.high, other.low));
        Self::new(high, low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 + 2^-60)^2 - 1 = 2^-59 + 2^-120, and three times 1/3 is 1 to 2^-104.
    #[test]
    fn results_have_106_bits() {
        let one = Dd::from(1.0);
        let x = Dd::new(1.0, 2.0_f64.powi(-60));
        let error = (x * x - one - Dd::from(2.0_f64.powi(-59))).value();
        assert!(error.abs() <= 2.0_f64.powi(-104));
        let three = Dd::from(3.0);
        let error = (one.over(three) * three - one).value();
        assert!(error.abs() <= 2.0_f64.powi(-104));
        let [_, cube, fourth] = powers(0.1);
        let x = Dd::from(0.1);
        assert_eq!(Dd::from(cube), x * x * x);
        assert_eq!(Dd::from(fourth), (x * x) * (x * x));
    }
}
