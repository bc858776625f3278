//! Numbers with their standard errors in a few characters.

/// A value with its standard error in parentheses, in units of the last digit: `0.0879(5)`,
/// `3.21(4)e-13`. The error is shown with one digit, rounded up where that digit would be 0.
///
/// An undefined value is `-`; an error that is undefined or zero is left out, with four digits shown.
pub fn uncertain(value: f64, error: f64) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    if !(error > 0.0 && error.is_finite()) {
        return plain(value);
    }
    let exponent = exponent_of(value.abs().max(error));
    if (-4..5).contains(&exponent) {
        let mut decimals = -exponent_of(error);
        if digits(error, decimals) >= 10 {
            decimals -= 1;
        }
        let decimals = decimals.max(0);
        return format!("{value:.*}({})", decimals as usize, digits(error, decimals));
    }
    let scale = 10.0_f64.powi(-exponent);
    let (mantissa, error) = (value * scale, error * scale);
    let decimals = (-exponent_of(error)).max(0);
    format!(
        "{mantissa:.*}({})e{exponent}",
        decimals as usize,
        digits(error, decimals)
    )
}

/// The decimal exponent of a positive number.
fn exponent_of(x: f64) -> i32 {
    x.log10().floor() as i32
}

/// An error in units of the last of `decimals` decimals, at least 1.
fn digits(error: f64, decimals: i32) -> u64 {
    ((error * 10.0_f64.powi(decimals)).round() as u64).max(1)
}

/// Four significant digits.
fn plain(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent_of(value.abs());
    if (-4..5).contains(&exponent) {
        format!("{value:.*}", (3 - exponent).max(0) as usize)
    } else {
        format!("{value:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_stand_in_units_of_the_last_digit() {
        for (value, error, text) in [
            (0.087_912, 0.000_52, "0.0879(5)"),
            (0.119_0, 0.000_97, "0.119(1)"),
            (0.119_0, 0.000_949, "0.1190(9)"),
            (12.345, 0.1, "12.3(1)"),
            (1234.5, 23.0, "1234(23)"),
            (3.214e-13, 4e-15, "3.21(4)e-13"),
            (0.0, 0.0, "0"),
            (0.5, 0.0, "0.5000"),
            (1e-20, f64::NAN, "1.000e-20"),
            (f64::NAN, 1.0, "-"),
        ] {
            assert_eq!(uncertain(value, error), text);
        }
    }
}
