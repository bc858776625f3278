//! Short forms of numbers with their standard errors.

use crate::metric::Quantile;
use crate::text::rounded;

/// Formats a value with its standard error in parentheses, in units of the last digit: `0.0879(5)`, `3.21(4)e-13`. The
/// error has one digit, at least 1.
///
/// An undefined value is `-`. If the error is undefined or zero, only the value is shown, with four digits.
pub fn uncertain(value: f64, error: f64) -> String {
    uncertain_within(value, error, 17)
}

/// The most digits of a value, however small its standard error is: a row of numbers has 80 columns.
const MOST: i32 = 9;
/// The digits of a number without a standard error.
const DIGITS: usize = 6;

/// Formats a value and its standard error: two significant digits of the error, and the value to the same place, as in
/// `81.1` and `3.6`, `2.30018e-10` and `1.2e-14`; at most nine digits of the value. Without an error (it is zero or
/// undefined) the value has six significant digits, and the error is empty.
pub fn measured(value: f64, error: f64) -> [String; 2] {
    if !(value.is_finite() && error > 0.0 && error.is_finite()) {
        return [rounded(value, DIGITS), String::new()];
    }
    let scientific = format!("{error:.1e}");
    let exponent = scientific.split_once('e').and_then(|(_, e)| e.parse().ok());
    let place = exponent.unwrap_or(0) - 1;
    let of_value = if value == 0.0 { place } else { exponent_of(value.abs()) };
    let place = place.max(of_value + 1 - MOST);
    if !(-4..6).contains(&of_value.max(place)) {
        let digits = (of_value - place).max(0) as usize;
        return [format!("{value:.digits$e}"), scientific];
    }
    if place > 0 {
        let unit = 10.0_f64.powi(place);
        return [value, error].map(|number| format!("{:.0}", (number / unit).round() * unit + 0.0));
    }
    let decimals = place.unsigned_abs() as usize;
    // Not -0.00.
    let unsigned = format!("{:.decimals$}", value.abs());
    let sign = if value < 0.0 && unsigned.contains(|c| ('1'..='9').contains(&c)) {
        "-"
    } else {
        ""
    };
    let error = if decimals > DIGITS {
        scientific
    } else {
        format!("{error:.decimals$}")
    };
    [format!("{sign}{unsigned}"), error]
}

/// Formats `81.1 +- 3.6` as [`measured`] does; the value alone without an error.
pub fn plus_minus(value: f64, error: f64) -> String {
    let [value, error] = measured(value, error);
    if error.is_empty() {
        value
    } else {
        format!("{value} +- {error}")
    }
}

/// Formats a quantile with its standard error; `none` if it falls among trials without the measure.
pub fn quantile(quantile: Quantile) -> String {
    if quantile.lost {
        "none".to_owned()
    } else {
        uncertain(quantile.value, quantile.mcse)
    }
}

/// Like [`uncertain`] with at most `most` digits of the value; a smaller error is shown as 1 in the last of them.
pub fn uncertain_within(value: f64, error: f64, most: i32) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    if !(error > 0.0 && error.is_finite()) {
        return plain(value);
    }
    let size = if value == 0.0 { error } else { value.abs() };
    let exponent = exponent_of(size);
    if (-4..5).contains(&exponent) {
        return with_error(value, error, most);
    }
    let scale = 10.0_f64.powi(-exponent);
    format!("{}e{exponent}", with_error(value * scale, error * scale, most))
}

/// The value rounded to the decimal of the error's first digit, with at most `most` digits.
fn with_error(value: f64, error: f64, most: i32) -> String {
    let mut decimals = -exponent_of(error);
    if digits(error, decimals) >= 10.0 {
        decimals -= 1;
    }
    let size = if value == 0.0 { error } else { value.abs() };
    let decimals = decimals.min(most - 1 - exponent_of(size)).max(0);
    let digits = digits(error, decimals);
    let decimals = decimals as usize;
    if digits < MOST_DIGITS {
        format!("{value:.decimals$}({digits})")
    } else {
        format!("{value:.decimals$}({digits:.0e})")
    }
}

/// The decimal exponent of a positive number.
fn exponent_of(x: f64) -> i32 {
    x.log10().floor() as i32
}

/// Errors of this many units of the last digit or more have a power of ten: the value says nothing.
const MOST_DIGITS: f64 = 1e6;

/// The error in units of the last of `decimals` decimals, at least 1.
fn digits(error: f64, decimals: i32) -> f64 {
    (error * 10.0_f64.powi(decimals)).round().max(1.0)
}

/// The value with four significant digits.
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

/// "a, b and c".
pub fn listed(items: &[String]) -> String {
    match items {
        [] => "none".to_owned(),
        [item] => item.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: the error to two digits, the value to the same place.
    #[test]
    fn values_end_where_their_errors_do() {
        for (value, error, text) in [
            (9.065_033, 0.190_12, "9.07 +- 0.19"),
            (6.68, 0.17, "6.68 +- 0.17"),
            (2.300_18e-10, 1.234e-14, "2.30018e-10 +- 1.2e-14"),
            (2.300_18e-10, f64::NAN, "2.30018e-10"),
            (81.12, 3.59, "81.1 +- 3.6"),
            (0.5, 0.099_6, "0.50 +- 0.10"),
            (12_343.0, 234.0, "12340 +- 230"),
            (12_345_678.0, 234.0, "1.234568e7 +- 2.3e2"),
            (-0.000_2, 0.034, "0.000 +- 0.034"),
            (0.000_2, 34.0, "0 +- 34"),
            (0.0, 0.25, "0.00 +- 0.25"),
            (1.596_816_674_321_012, 1.2e-20, "1.59681667 +- 1.2e-20"),
            (10.0, 1.02e-6, "10.0000000 +- 1.0e-6"),
            (1.0, 0.0, "1"),
            (f64::INFINITY, f64::NAN, "inf"),
        ] {
            assert_eq!(plus_minus(value, error), text);
        }
    }

    #[test]
    fn errors_stand_in_units_of_the_last_digit() {
        for (value, error, text) in [
            (0.087_912, 0.000_52, "0.0879(5)"),
            (0.119_0, 0.000_97, "0.119(1)"),
            (0.119_0, 0.000_949, "0.1190(9)"),
            (12.345, 0.1, "12.3(1)"),
            (1234.5, 23.0, "1234(23)"),
            (3.214e-13, 4e-15, "3.21(4)e-13"),
            (3.21e-12, 0.96e-13, "3.2(1)e-12"),
            (4.2e-11, 2e-10, "4(20)e-11"),
            (1.5, 123_456.0, "2(123456)"),
            (1.5, 2e30, "2(2e30)"),
            (0.0, 0.0, "0"),
            (0.5, 0.0, "0.5000"),
            (1e-20, f64::NAN, "1.000e-20"),
            (f64::NAN, 1.0, "-"),
        ] {
            assert_eq!(uncertain(value, error), text);
        }
        for (value, error, text) in [
            (1.698_912e-11, 4e-15, "1.70(1)e-11"),
            (0.130_861, 3e-5, "0.131(1)"),
            (0.087_912, 0.005_2, "0.088(5)"),
            (12_345.0, 1.0, "12345(1)"),
        ] {
            assert_eq!(uncertain_within(value, error, 3), text);
        }
    }
}
