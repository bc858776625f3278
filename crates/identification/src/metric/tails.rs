//! Tails of the normal, Student's, the chi-square and the binomial law.
//!
//! statrs has them too, but stops the continued fraction of the incomplete beta function after 140 terms without a
//! warning: for 10^7 trials its binomial tail at one half is 0.365. This module takes as many terms as the sum needs.

use std::f64::consts::{PI, SQRT_2};

/// P(Z > z) of a standard normal Z.
pub fn normal_above(z: f64) -> f64 {
    if z.is_nan() {
        return f64::NAN;
    }
    if z < 0.0 {
        return 1.0 - normal_above(-z);
    }
    let density = (-z * z / 2.0).exp() / (SQRT_2 * PI.sqrt());
    if z < 3.0 {
        // 1/2 - density (z + z^3/3 + z^5/(3 5) + ...)
        let (mut term, mut sum, mut odd) = (z, 0.0, 1.0);
        while term > sum * f64::EPSILON {
            sum += term;
            odd += 2.0;
            term *= z * z / odd;
        }
        return 0.5 - density * sum;
    }
    // density / (z + 1/(z + 2/(z + 3/(z + ...)))), evaluated from the inside; for z >= 3, 80 levels are enough.
    let tail = (1..=80).rev().fold(z, |inner, k| z + f64::from(k) / inner);
    density / tail
}

/// The z with P(Z > z) = p.
pub fn normal_point(p: f64) -> f64 {
    let (mut low, mut high) = (-40.0, 40.0);
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if normal_above(middle) > p {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

/// P(T > t) of Student's law with nu degrees of freedom; nu need not be an integer. Infinite nu means the normal law.
pub fn student_above(t: f64, nu: f64) -> f64 {
    if nu == f64::INFINITY {
        return normal_above(t);
    }
    if t.is_infinite() {
        return if t > 0.0 { 0.0 } else { 1.0 };
    }
    let square = t * t;
    let both = beta_share(nu / (nu + square), square / (nu + square), nu / 2.0, 0.5);
    if t < 0.0 { 1.0 - both / 2.0 } else { both / 2.0 }
}

/// The t with P(T > t) = p, by the expansion of Cornish and Fisher (Abramowitz and Stegun 26.7.5) about the normal
/// point z. Use it to plan numbers of trials: from 5 degrees of freedom on its error is a few thousandths, which does
/// not matter there.
pub fn student_point(z: f64, nu: f64) -> f64 {
    let s = z * z;
    let terms = [
        (s + 1.0) / 4.0,
        ((5.0 * s + 16.0) * s + 3.0) / 96.0,
        (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0,
        ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92160.0,
    ];
    z * (1.0 + terms.iter().rev().fold(0.0, |sum, term| (sum + term) / nu))
}

/// `P(X > x)` for X of the chi-square law with `degrees` degrees of freedom (at least 1).
///
/// With `h = x/2`: for an even number of degrees `exp(-h) sum_(i < k/2) h^i / i!`, for an odd one
/// `2 P(Z > sqrt x) + exp(-h) sum_(1 <= i <= (k-1)/2) h^(i - 1/2) / Gamma(i + 1/2)` (Abramowitz and Stegun, 26.4.4 and
/// 26.4.5).
pub fn chi_square_above(x: f64, degrees: usize) -> f64 {
    if !(x > 0.0) {
        return if x.is_nan() { f64::NAN } else { 1.0 };
    }
    let half = x / 2.0;
    let odd = degrees % 2 == 1;
    // The term of i as a logarithm: exp(-h) underflows long before the sum does.
    let mut log_term = if odd {
        // h^(1/2) / Gamma(3/2)
        0.5 * half.ln() - (0.5 * PI.sqrt()).ln()
    } else {
        0.0
    };
    let mut sum = if odd { 2.0 * normal_above(x.sqrt()) } else { 0.0 };
    for i in 0..degrees / 2 {
        sum += (log_term - half).exp();
        let next = if odd { i as f64 + 1.5 } else { i as f64 + 1.0 };
        log_term += (half / next).ln();
    }
    sum.min(1.0)
}

/// P(F > f) of Fisher's law with q and d degrees of freedom (Abramowitz and Stegun, 26.6.2).
pub fn fisher_above(f: f64, q: usize, d: usize) -> f64 {
    if !(f > 0.0) {
        return if f.is_nan() { f64::NAN } else { 1.0 };
    }
    let (explained, left) = (f * q as f64, d as f64);
    if explained.is_infinite() {
        return 0.0;
    }
    let sum = explained + left;
    beta_share(left / sum, explained / sum, left / 2.0, q as f64 / 2.0)
}

/// P(K >= k) of the number K of successes in n trials with probability p each.
pub fn binomial_at_least(k: u64, n: u64, p: f64) -> f64 {
    match (k, p) {
        (0, _) => 1.0,
        _ if k > n || p <= 0.0 => 0.0,
        _ if p >= 1.0 => 1.0,
        _ => beta_share(p, 1.0 - p, k as f64, (n - k + 1) as f64),
    }
}

/// P(K <= k) of the same K.
pub fn binomial_at_most(k: u64, n: u64, p: f64) -> f64 {
    if k >= n {
        1.0
    } else {
        binomial_at_least(n - k, n, 1.0 - p)
    }
}

/// The regularised incomplete beta function I_x(a, b), with y = 1 - x, by the continued fraction of Didonato and Morris
/// in Lentz's form (Press et al. 2007, 6.4). It needs about sqrt(max(a, b)) terms if x is near the mean a / (a + b).
fn beta_share(x: f64, y: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 || y <= 0.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta_share_below(y, x, b, a);
    }
    beta_share_below(x, y, a, b)
}

fn beta_share_below(x: f64, y: f64, a: f64, b: f64) -> f64 {
    /// Replaces a zero denominator.
    const TINY: f64 = 1e-300;
    let away = |x: f64| if x.abs() < TINY { TINY } else { x };
    let log = ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * y.ln();
    let mut d = 1.0 / away(1.0 - (a + b) * x / (a + 1.0));
    let (mut c, mut fraction) = (1.0, d);
    let most = 1000 + 20 * a.max(b).sqrt() as u64;
    for m in 1..=most {
        let m = m as f64;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut step = 1.0;
        for term in [even, odd] {
            d = 1.0 / away(1.0 + term * d);
            c = away(1.0 + term / c);
            step = d * c;
            fraction *= step;
        }
        if (step - 1.0).abs() < 4.0 * f64::EPSILON {
            break;
        }
    }
    (log.exp() * fraction / a).min(1.0)
}

/// The logarithm of the gamma function for x > 0, by Stirling's series for x >= 10 (Abramowitz and Stegun 6.1.41).
fn ln_gamma(x: f64) -> f64 {
    if x < 10.0 {
        let steps = (10.0 - x).ceil() as u32;
        let product: f64 = (0..steps).map(|i| x + f64::from(i)).product();
        return ln_gamma(x + f64::from(steps)) - product.ln();
    }
    const SERIES: [f64; 6] = [
        1.0 / 12.0,
        -1.0 / 360.0,
        1.0 / 1260.0,
        -1.0 / 1680.0,
        1.0 / 1188.0,
        -691.0 / 360_360.0,
    ];
    let inverse = 1.0 / (x * x);
    let rest = SERIES.iter().rev().fold(0.0, |sum, c| sum * inverse + c) / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: f64, expected: f64, tolerance: f64) {
        assert!((found / expected - 1.0).abs() < tolerance, "{found:e} {expected:e}");
    }

    /// The rounding error left when logarithms of gamma functions of n, of size n ln n, cancel.
    fn rounding(n: f64) -> f64 {
        1e-12 + 4.0 * f64::EPSILON * n * n.ln()
    }

    /// mpmath, 30 digits: `erfc(z / sqrt 2) / 2`.
    #[test]
    fn normal_tails() {
        const NORMAL: [(f64, f64); 6] = [
            (0.5, 0.3085375387259869),
            (1.959963984540054, 0.025000000000000011),
            (2.9, 0.0018658133003840385),
            (3.1, 0.0009676032132183566),
            (4.5, 3.3976731247300604e-6),
            (8.0, 6.2209605742717841e-16),
        ];
        for (z, p) in NORMAL {
            near(normal_above(z), p, 1e-12);
            near(normal_above(-z), 1.0 - p, 1e-15);
            assert!((normal_point(p) - z).abs() < 1e-9);
        }
        assert!(normal_above(f64::NAN).is_nan());
    }

    /// mpmath: `betainc(nu / 2, 1 / 2, 0, nu / (nu + t^2), regularized = True) / 2`. For one degree of freedom
    /// P(T > 1) = 1/4 (Cauchy's law).
    #[test]
    fn student_tails() {
        const STUDENT: [(f64, f64, f64); 6] = [
            (2.093024054408263, 19.0, 0.025000000000002313),
            (3.5, 9.8, 0.002951841656359251),
            (3.6, 62.0, 0.0003165861418865572),
            (1.5, 4.0, 0.104),
            (2.5, 999.0, 0.0062893637922546097),
            (3.4, 1000000.0, 0.0003369424210074981),
        ];
        near(student_above(1.0, 1.0), 0.25, 1e-14);
        for (t, nu, p) in STUDENT {
            near(student_above(t, nu), p, rounding(nu));
            near(student_above(-t, nu), 1.0 - p, 1e-11);
        }
        assert_eq!(student_above(2.0, f64::INFINITY), normal_above(2.0));
        assert_eq!(student_above(f64::NEG_INFINITY, 3.0), 1.0);
        for (t, nu, p) in STUDENT.into_iter().filter(|(_, nu, _)| *nu > 5.0) {
            assert!((student_point(normal_point(p), nu) / t - 1.0).abs() < 0.01);
        }
    }

    /// mpmath: sums of binomial terms, and for many trials the incomplete beta function. By hand: 2 or more heads of 3
    /// have probability 1/2, none of 10 with p = 0.01 has 0.99^10.
    #[test]
    fn binomial_tails() {
        const BINOMIAL: [(u64, u64, f64, f64); 6] = [
            (7, 10, 0.5, 0.171875),
            (3, 100, 0.01, 0.07937320225218034),
            (60, 4000, 0.01, 0.0017843273519903911),
            (2100, 4000, 0.5, 0.00082463318756784989),
            (500_000, 1_000_000, 0.5, 0.50039894218066588),
            (5_005_000, 10_000_000, 0.5, 0.00078355095284769924),
        ];
        near(binomial_at_least(2, 3, 0.5), 0.5, 1e-14);
        near(binomial_at_most(0, 10, 0.01), 0.99_f64.powi(10), 1e-13);
        for (k, n, p, expected) in BINOMIAL {
            near(binomial_at_least(k, n, p), expected, rounding(n as f64));
        }
        assert_eq!(binomial_at_least(0, 5, 0.3), 1.0);
        assert_eq!(binomial_at_most(5, 5, 0.3), 1.0);
        assert_eq!((binomial_at_least(1, 5, 0.0), binomial_at_most(4, 5, 1.0)), (0.0, 0.0));
    }

    /// SciPy: `scipy.stats.f.sf(f, q, d)`. Of one degree of freedom it is Student's law of both signs.
    #[test]
    fn fisher_tails() {
        const FISHER: [(f64, usize, usize, f64); 5] = [
            (0.4, 3, 12, 0.7555447129145094),
            (2.5, 5, 80, 0.03722005488560024),
            (4.0, 6, 57, 0.0020732809589544357),
            (3.3, 25, 950, 1.1160873540391275e-07),
            (40.0, 2, 30, 3.435014252937534e-09),
        ];
        for (f, q, d, p) in FISHER {
            near(fisher_above(f, q, d), p, 1e-10);
        }
        near(fisher_above(6.25, 1, 999), 2.0 * student_above(2.5, 999.0), 1e-11);
        assert_eq!((fisher_above(0.0, 2, 9), fisher_above(f64::INFINITY, 2, 9)), (1.0, 0.0));
    }

    /// The 5 % and 1 % points of printed tables (Abramowitz and Stegun, table 26.8).
    #[test]
    fn chi_square_quantiles_as_printed() {
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
            let found = chi_square_above(x, degrees);
            assert!((found - tail).abs() < 2e-6, "{degrees}: {found}");
        }
    }

    #[test]
    fn the_ends_of_chi_square() {
        assert_eq!(chi_square_above(0.0, 3), 1.0);
        assert_eq!(chi_square_above(-1.0, 4), 1.0);
        assert!(chi_square_above(1e5, 3) == 0.0 && chi_square_above(f64::NAN, 3).is_nan());
    }
}
