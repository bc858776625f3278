//! The rounding of printed numbers.

/// Digits that doubles hold for certain: more of them are not what somebody printed.
const DOUBLE: i32 = 15;

/// The fewest digits of a column that is taken as rounded. A setting such as 1 or 12.5 is exact.
const MEASURED: i32 = 6;

/// How numbers are printed: with so many significant digits at most, and so many decimals at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Digits {
    significant: i32,
    decimals: i32,
}

impl Digits {
    /// The most digits that one of the values has.
    fn of<'a>(values: impl Iterator<Item = &'a f64>) -> Self {
        let mut all = Self {
            significant: 1,
            decimals: 0,
        };
        for value in values.filter(|value| value.is_finite() && **value != 0.0) {
            let text = format!("{value:e}");
            let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            let significant = mantissa.bytes().filter(u8::is_ascii_digit).count() as i32;
            let exponent: i32 = exponent.parse().unwrap_or(0);
            all.significant = all.significant.max(significant.min(DOUBLE));
            all.decimals = all.decimals.max(significant - 1 - exponent);
            if all.significant == DOUBLE {
                break;
            }
        }
        all
    }

    /// The unit of the last digit of a value. Of numbers with equally many decimals it is that of a decimal, of numbers
    /// with equally many digits that of the last one: whichever is larger, since the other form has far smaller ones.
    fn last(self, value: f64) -> f64 {
        let of_digit = if value == 0.0 {
            0.0
        } else {
            10_f64.powi(value.abs().log10().floor() as i32 + 1 - self.significant)
        };
        of_digit.max(10_f64.powi(-self.decimals))
    }

    /// The root mean square of the units of the last digits of finite values.
    fn unit(self, values: &[f64]) -> f64 {
        let finite = values.iter().filter(|value| value.is_finite());
        let (sum, count) = finite.fold((0.0, 0_usize), |(sum, count), value| {
            (sum + self.last(*value).powi(2), count + 1)
        });
        (sum / count.max(1) as f64).sqrt()
    }
}

/// The units of the last printed digits of a record, root mean squares over its samples: errors of rounding have a
/// standard deviation of `1/sqrt 12` of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// Of u.
    pub u: f64,
    /// Of y.
    pub y: f64,
}

impl Rounding {
    /// Takes the digits that the numbers of a column need, at most 15; u with fewer than six is exact.
    pub fn of(u: &[f64], y: &[f64]) -> Self {
        Self {
            u: rounding_of(u),
            y: Digits::of(y.iter()).unit(y),
        }
    }

    /// The units of the record in another unit.
    #[must_use]
    pub fn divided_by(self, unit: f64) -> Self {
        Self {
            u: self.u / unit,
            y: self.y / unit,
        }
    }
}

/// The unit of the last digit of a single signal, root mean square; 0 of one with fewer than six digits, which is
/// exact.
pub fn rounding_of(signal: &[f64]) -> f64 {
    let digits = Digits::of(signal.iter());
    if digits.significant < MEASURED {
        0.0
    } else {
        digits.unit(signal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six decimals, nine significant digits, integers beside decimals, doubles: by hand.
    #[test]
    fn units_of_the_last_digit() {
        let near = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        };
        let decimals = Rounding::of(&[1.0, -1.0], &[12.345678, 0.5, 0.000001]);
        near(decimals.y, 1e-6);
        assert_eq!(decimals.u, 0.0);
        let digits = Rounding::of(&[500.123, -500.0], &[1.97953943e-10, 2.30262656e-10]);
        near(digits.y, 1e-18);
        near(digits.u, 1e-3);
        // 1/3 to 15 digits.
        near(Rounding::of(&[1.0], &[1.0 / 3.0]).y, 1e-15);
        assert_eq!(rounding_of(&[1.0, -1.0, 12.5]), 0.0);
        near(rounding_of(&[1.47760103331, -1.2]), 1e-11);
    }
}
