//! Polynomials in q^-1, `c_0 + c_1 q^-1 + ...`, as filters of signals that are zero before k = 0.

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

/// Returns the places of the first and the last coefficient that is more than the rounding of a sum of the others, 1e-13 of
/// the largest; `None` for a polynomial of zeros.
pub fn extent(c: &[f64]) -> Option<(usize, usize)> {
    let size = c.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
    let is_there = |c: &f64| c.abs() > 1e-13 * size;
    Some((c.iter().position(is_there)?, c.iter().rposition(is_there)?))
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
    to.fill(0.0);
    for (lag, c) in c.iter().enumerate().take(x.len()) {
        for (to, x) in to[lag..].iter_mut().zip(x) {
            *to += c * x;
        }
    }
}

/// Divides a signal by a monic polynomial, in place: `x(k) <- x(k) - sum_(i >= 1) d_i x(k-i)`.
pub fn divide(d: &[f64], x: &mut [f64]) {
    let n = d.len() - 1;
    if n == 0 {
        return;
    }
    for k in 0..x.len() {
        let mut value = x[k];
        for i in 1..=n.min(k) {
            value -= d[i] * x[k - i];
        }
        x[k] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_filters_by_hand() {
        assert_eq!(
            multiply(&[1.0, 2.0], &[1.0, -1.0, 3.0]),
            [1.0, 1.0, 1.0, 6.0]
        );
        let mut y = [0.0; 4];
        filter(&[0.0, 1.0, 0.5], &[1.0, 2.0, 4.0, 8.0], &mut y);
        assert_eq!(y, [0.0, 1.0, 2.5, 5.0]);
        divide(&[1.0, -0.5], &mut y);
        assert_eq!(y, [0.0, 1.0, 3.0, 6.5]);
    }
}
