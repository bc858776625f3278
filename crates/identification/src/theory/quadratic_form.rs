//! Quantiles of `|L z|`, z standard normal. It is the root of `sum_i w_i z_i^2`, with w the eigenvalues of `L L'`.

use faer::c64;

/// Nodes on the upper half of the contour. The error is 2.85^-26 plus rounding times exp(26 pi/12).
const NODES: usize = 26;

/// `P(sum_i w_i z_i^2 <= x)` for weights w >= 0.
///
/// The Laplace transform of the distribution function is `1/s prod_i (1 + 2 w_i s)^(-1/2)`, whose singularities lie on
/// s <= 0. It is inverted along Weideman's parabola (Weideman and Trefethen, Math. Comp. 76 (2007) 1341), to
/// about 1e-12.
pub fn distribution(weights: &[f64], x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let step = 3.0 / NODES as f64;
    let scale = std::f64::consts::PI * NODES as f64 / (12.0 * x);
    let mut sum = c64::new(0.0, 0.0);
    for k in 0..NODES {
        let angle = (k as f64 + 0.5) * step;
        let node = c64::new(1.0, angle);
        // s = scale (1 + i angle)^2, and its derivative.
        let s = node * node * scale;
        let mut transform = s.inv();
        for w in weights {
            transform *= root(c64::new(1.0, 0.0) + s * (2.0 * w)).inv();
        }
        let (power, (sin, cos)) = (libm::exp(s.re * x), libm::sincos(s.im * x));
        sum += c64::new(power * cos, power * sin) * transform * node;
    }
    // The lower half is the conjugate of the upper one.
    (sum.re * 2.0 * scale * step / std::f64::consts::PI).clamp(0.0, 1.0)
}

/// The square root in the right half-plane.
fn root(of: c64) -> c64 {
    let half = f64::midpoint(of.re.abs(), of.norm_sqr().sqrt()).sqrt();
    let other = of.im.abs() / (2.0 * half);
    if of.re >= 0.0 {
        c64::new(half, other.copysign(of.im))
    } else {
        c64::new(other, half.copysign(of.im))
    }
}

/// Returns the quantile of `|L z|`, 0 < p < 1; 0 if all weights are 0.
///
/// Uses false position and halves the value at an end that stays for two steps (the Illinois method).
pub fn quantile(weights: &[f64], p: f64) -> f64 {
    let sum: f64 = weights.iter().sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return sum;
    }
    let scaled = weights.iter().map(|w| w / sum);
    let scaled: Vec<f64> = scaled.filter(|w| *w > 1e-16).collect();
    let over = |x: f64| distribution(&scaled, x) - p;
    let (mut low, mut high) = ((0.0, -p), (1.0, over(1.0)));
    while high.1 < 0.0 {
        low = high;
        high = (2.0 * high.0, over(2.0 * high.0));
    }
    let (mut x, mut was_low) = (high.0, None);
    for _ in 0..100 {
        let next = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
        let change = (next - x).abs();
        x = next;
        let value = over(x);
        if change <= 1e-12 * x || value == 0.0 {
            break;
        }
        let is_low = value < 0.0;
        let stays = if was_low == Some(is_low) { 0.5 } else { 1.0 };
        if is_low {
            low = (x, value);
            high.1 *= stays;
        } else {
            high = (x, value);
            low.1 *= stays;
        }
        was_low = Some(is_low);
    }
    (x * sum).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chi-squared with 2 degrees of freedom: 1 - exp(-x/2); with 1: erf(sqrt(x/2)), at x = 1 0.6826894921370859
    /// (tables).
    #[test]
    fn chi_squared() {
        for x in [0.01, 0.5, 1.0, 3.0, 12.0] {
            let expected = 1.0 - libm::exp(-x / 2.0);
            let found = distribution(&[1.0, 1.0], x);
            assert!((found - expected).abs() < 1e-11, "{x}: {found} {expected}");
            let expected = libm::erf(libm::sqrt(x / 2.0));
            let found = distribution(&[1.0], x);
            assert!((found - expected).abs() < 1e-11, "{x}: {found} {expected}");
        }
        assert!((quantile(&[0.5, 0.5], 0.5) - libm::sqrt(libm::log(2.0))).abs() < 1e-11);
    }

    /// Two pairs of equal weights: `P = 1 - (a exp(-x/2a) - b exp(-x/2b)) / (a - b)`.
    #[test]
    fn unequal_weights() {
        for (a, b) in [(1.0, 0.5), (1.0, 1e-3), (7.0, 2.0)] {
            for x in [0.1, 1.0, 10.0] {
                let tail = a * libm::exp(-x / (2.0 * a)) - b * libm::exp(-x / (2.0 * b));
                let expected = 1.0 - tail / (a - b);
                let found = distribution(&[a, a, b, b], x);
                assert!((found - expected).abs() < 1e-11, "{found} {expected}");
            }
        }
    }
}
