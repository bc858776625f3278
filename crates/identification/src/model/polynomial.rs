//! Polynomials in q^-1, `c_0 + c_1 q^-1 + ...`, as filters of signals that are zero before k = 0.

use faer::c64;

/// Reads coefficients such as `1,-0.5`; `None` if one of them is not a number.
pub fn parse(list: &str) -> Option<Vec<f64>> {
    let numbers = list.split(',').map(|number| number.trim().parse().ok());
    numbers.collect()
}

/// Writes coefficients as [`parse`] reads them, with all digits.
pub fn text(coefficients: &[f64]) -> String {
    let texts: Vec<String> = coefficients.iter().map(f64::to_string).collect();
    texts.join(",")
}

/// Returns the places of the first and the last coefficient that is more than the rounding of a sum of the others,
/// 1e-13 of the largest; `None` for a polynomial of zeros.
pub fn extent(c: &[f64]) -> Option<(usize, usize)> {
    let size = c.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
    let is_there = |c: &f64| c.abs() > 1e-13 * size;
    Some((c.iter().position(is_there)?, c.iter().rposition(is_there)?))
}

/// Returns the value of a polynomial at a `q^-1`.
pub(crate) fn value(c: &[f64], delay: c64) -> c64 {
    c.iter().rev().fold(c64::new(0.0, 0.0), |sum, c| sum * delay + c)
}

/// Returns the product of two polynomials.
pub fn multiply(first: &[f64], second: &[f64]) -> Vec<f64> {
    let mut product = Vec::new();
    multiply_into(first, second, &mut product);
    product
}

/// Computes the product of two polynomials in `product`, replacing its content.
pub fn multiply_into(first: &[f64], second: &[f64], product: &mut Vec<f64>) {
    product.clear();
    product.resize((first.len() + second.len()).saturating_sub(1), 0.0);
    for (i, f) in first.iter().enumerate() {
        for (product, s) in product[i..].iter_mut().zip(second) {
            *product += f * s;
        }
    }
}

/// Computes `to(k) = sum_i c_i x(k-i)`.
///
/// # Panics
/// If the lengths of the signals differ.
pub fn filter(c: &[f64], x: &[f64], to: &mut [f64]) {
    assert_eq!(x.len(), to.len());
    with_fma!(|| match c.len() {
        1 => filter_of::<1>(c, x, to),
        2 => filter_of::<2>(c, x, to),
        3 => filter_of::<3>(c, x, to),
        4 => filter_of::<4>(c, x, to),
        5 => filter_of::<5>(c, x, to),
        6 => filter_of::<6>(c, x, to),
        7 => filter_of::<7>(c, x, to),
        _ => {
            to.fill(0.0);
            for (lag, c) in c.iter().enumerate().take(x.len()) {
                for (to, x) in to[lag..].iter_mut().zip(x) {
                    *to += c * x;
                }
            }
        }
    });
}

/// Does the same for L coefficients in one run over the signal, with the same sums.
#[inline(always)]
fn filter_of<const L: usize>(c: &[f64], x: &[f64], to: &mut [f64]) {
    let mut coefficients = [0.0; L];
    coefficients.copy_from_slice(c);
    let (first, rest) = to.split_at_mut((L - 1).min(x.len()));
    for (k, to) in first.iter_mut().enumerate() {
        *to = 0.0;
        for lag in 0..=k {
            *to += c[lag] * x[k - lag];
        }
    }
    for (to, x) in rest.iter_mut().zip(x.array_windows::<L>()) {
        let mut sum = 0.0;
        for lag in 0..L {
            sum += coefficients[lag] * x[L - 1 - lag];
        }
        *to = sum;
    }
}

/// Returns a signal delayed, with zeros before it, times a factor.
pub(crate) fn delayed(x: &[f64], delay: usize, factor: f64) -> Vec<f64> {
    let mut y = vec![0.0; delay.min(x.len())];
    y.extend(x[..x.len() - y.len()].iter().map(|x| factor * x));
    y
}

/// Divides a signal by a monic polynomial, in place: `x(k) <- x(k) - sum_(i >= 1) d_i x(k-i)`.
pub fn divide(d: &[f64], x: &mut [f64]) {
    divide_each(d, [x]);
}

/// Divides several signals of one length by a monic polynomial, in place. Each waits for its own past alone, so
/// that they take little longer than one.
///
/// # Panics
/// If the lengths differ.
pub fn divide_each<const K: usize>(d: &[f64], x: [&mut [f64]; K]) {
    match d.len() {
        0 | 1 => {}
        2 => divide_of::<1, K>(d, x),
        3 => divide_of::<2, K>(d, x),
        4 => divide_of::<3, K>(d, x),
        5 => divide_of::<4, K>(d, x),
        6 => divide_of::<5, K>(d, x),
        7 => divide_of::<6, K>(d, x),
        _ => {
            for x in x {
                divide_first(d, x, x.len());
            }
        }
    }
}

/// Divides the first samples.
#[inline(always)]
fn divide_first(d: &[f64], x: &mut [f64], samples: usize) {
    for k in 0..samples {
        let mut value = x[k];
        for i in 1..d.len().min(k + 1) {
            value -= d[i] * x[k - i];
        }
        x[k] = value;
    }
}

#[inline(always)]
fn divide_of<const N: usize, const K: usize>(d: &[f64], mut x: [&mut [f64]; K]) {
    let Some(length) = x.first().map(|x| x.len()) else {
        return;
    };
    let mut coefficients = [0.0; N];
    coefficients.copy_from_slice(&d[1..]);
    let mut past = [[0.0; K]; N];
    for (signal, x) in x.iter_mut().enumerate() {
        assert_eq!(x.len(), length);
        divide_first(d, x, N.min(length));
        for (i, past) in past.iter_mut().enumerate().take(length) {
            past[signal] = x[N.min(length).saturating_sub(1 + i)];
        }
    }
    let mut rest = x.map(|x| &mut x[N.min(length)..]);
    for k in 0..length.saturating_sub(N) {
        let mut values = [0.0; K];
        for (value, x) in values.iter_mut().zip(&rest) {
            *value = x[k];
        }
        for (d, past) in coefficients.iter().zip(&past) {
            for (value, past) in values.iter_mut().zip(past) {
                *value -= d * past;
            }
        }
        for i in (1..N).rev() {
            past[i] = past[i - 1];
        }
        past[0] = values;
        for (x, value) in rest.iter_mut().zip(values) {
            x[k] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_filters_by_hand() {
        assert_eq!(multiply(&[1.0, 2.0], &[1.0, -1.0, 3.0]), [1.0, 1.0, 1.0, 6.0]);
        let mut y = [0.0; 4];
        filter(&[0.0, 1.0, 0.5], &[1.0, 2.0, 4.0, 8.0], &mut y);
        assert_eq!(y, [0.0, 1.0, 2.5, 5.0]);
        divide(&[1.0, -0.5], &mut y);
        assert_eq!(y, [0.0, 1.0, 3.0, 6.5]);
    }

    /// Every order and length has the bits of the definitions, term by term; signals side by side too.
    #[test]
    fn bits_of_the_definitions() {
        let signal = |count: usize, factor: f64| -> Vec<f64> {
            (0..count)
                .map(|k| (factor * (k * k) as f64).sin() * if k % 5 == 3 { -0.0 } else { 1.0 })
                .collect()
        };
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for order in 0..=9 {
            let mut d = vec![1.0];
            d.extend((1..=order).map(|i| 0.6_f64.powi(i) * (1.3 * f64::from(i)).cos()));
            for length in [0, 1, 2, 3, 5, 8, 9, 10, 11, 12, 13, 40] {
                let (x, other) = (signal(length, 0.37), signal(length, 0.71));
                let mut filtered = vec![0.0; length];
                let mut divided = x.clone();
                for k in 0..length {
                    let known = 0..d.len().min(k + 1);
                    for i in known.clone() {
                        filtered[k] += d[i] * x[k - i];
                    }
                    for i in known.skip(1) {
                        divided[k] -= d[i] * divided[k - i];
                    }
                }
                let mut found = vec![f64::NAN; length];
                filter(&d, &x, &mut found);
                assert_eq!(bits(&found), bits(&filtered), "{order} {length}");
                let (mut first, mut second, mut alone) = (x.clone(), other.clone(), other);
                divide_each(&d, [&mut first, &mut second]);
                divide(&d, &mut alone);
                assert_eq!(bits(&first), bits(&divided), "{order} {length}");
                assert_eq!(bits(&second), bits(&alone), "{order} {length}");
            }
        }
    }
}
