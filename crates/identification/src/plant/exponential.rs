//! The matrix exponential.

use super::balance::{balance, in_units, norm_1, power_of_two};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Scale};

/// Numerator coefficients of the [13/13] Pade approximant of `e^x`, lowest power first.
const PADE_13: [f64; 14] = [
    64764752532480000.0,
    32382376266240000.0,
    7771770303897600.0,
    1187353796428800.0,
    129060195264000.0,
    10559470521600.0,
    670442572800.0,
    33522128640.0,
    1323241920.0,
    40840800.0,
    960960.0,
    16380.0,
    182.0,
    1.0,
];

/// The largest size of A for which the approximant's backward error is unit roundoff, Table 3.1 of the source.
const THETA_13: f64 = 4.25;

/// `-log2 |c_27|`, the first coefficient of that backward error: `1 / |c_27| = (26 over 13) 27!`.
const FIRST_COEFFICIENT: f64 = 116.447_004_251_763;

/// Computes `e^A` of a square matrix by scaling and squaring with the [13/13] Pade approximant:
/// `e^A = D r(D^-1 A D / 2^s)^(2^s) D^-1`. D are the units of [`balance`], so that the states' units do not matter.
/// s is the smallest integer for which `4.25 2^s` is at least `min(max(d_6, d_8), max(d_8, d_10))`, with
/// `d_p = ||A^p||^(1/p)`, and more where the approximant's own rounding asks for it.
///
/// If an entry of A is not finite, all entries are NaN. If `e^A` overflows, entries are infinite or NaN. Source: A. H.
/// Al-Mohy, N. J. Higham, A new scaling and squaring algorithm for the matrix exponential, SIAM J. Matrix Anal. Appl.
/// 31 (2009) 970-989, Algorithm 5.1, with m = 13 for all matrices.
///
/// # Panics
/// If A is not square.
pub fn exponential(a: MatRef<'_, f64>) -> Mat<f64> {
    exponential_by(a, 0)
}

/// Does the same with `more` squarings than that takes: the same number in other steps, whose rounding is another.
pub(crate) fn exponential_by(a: MatRef<'_, f64>, more: i32) -> Mat<f64> {
    let n = a.nrows();
    assert!(n == a.ncols(), "the exponential needs a square matrix");
    if !a.is_all_finite() {
        return Mat::full(n, n, f64::NAN);
    }
    let units = balance(a);
    let balanced = in_units(a, &units);
    let norm = norm_1(balanced.as_ref());
    if !norm.is_finite() {
        return Mat::full(n, n, f64::NAN);
    }
    // Of a matrix with a norm from 1 to 2, no power overflows.
    let unit = power_of_two(norm);
    let scaled = Scale(unit.recip()) * &balanced;
    let squarings = squarings(&scaled, unit.log2() as i32) + more;
    // Two factors: 2^-s alone would underflow for the largest norms.
    let scale = 0.5_f64.powi(squarings / 2) * 0.5_f64.powi(squarings - squarings / 2);
    let mut result = pade_13(&(Scale(scale) * &balanced));
    for _ in 0..squarings {
        result = &result * &result;
    }
    Mat::from_fn(n, n, |i, j| result[(i, j)] * (units[i] / units[j]))
}

/// Returns s for `2^exponent M`, M with a norm from 1 to 2.
fn squarings(m: &Mat<f64>, exponent: i32) -> i32 {
    let m2 = m * m;
    let m4 = &m2 * &m2;
    let m6 = &m2 * &m4;
    let size = |power: &Mat<f64>, p: f64| norm_1(power.as_ref()).log2() / p;
    let d6 = size(&m6, 6.0);
    let d8 = size(&(&m4 * &m4), 8.0);
    let d10 = size(&(&m4 * &m6), 10.0);
    let eta = d6.max(d8).min(d8.max(d10)) + f64::from(exponent);
    let least = (eta - THETA_13.log2()).ceil().max(0.0) as i32;
    // log2 of || |M|^27 ||_1 / ||M||_1, of which a factor is taken out in every product.
    let sizes = Mat::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)].abs());
    let mut sums = Mat::full(1, m.nrows(), 1.0);
    let mut power = -norm_1(m.as_ref()).log2();
    for _ in 0..27 {
        sums = &sums * &sizes;
        let largest = sums.norm_max();
        if largest == 0.0 {
            return least;
        }
        power += largest.log2();
        sums = Scale(largest.recip()) * &sums;
    }
    let alpha = power + 26.0 * f64::from(exponent - least) - FIRST_COEFFICIENT;
    let rounding = f64::from(f64::MANTISSA_DIGITS);
    least + ((alpha + rounding) / 26.0).ceil().max(0.0) as i32
}

/// Returns the approximant `r(A) = q(A)^-1 p(A)`, `p = v + u`, `q = v - u`, where u has the odd and v the even powers.
fn pade_13(a: &Mat<f64>) -> Mat<f64> {
    let n = a.nrows();
    let identity = Mat::<f64>::identity(n, n);
    let a2 = a * a;
    let a4 = &a2 * &a2;
    let a6 = &a2 * &a4;
    // c_0 I + c_1 A^2 + c_2 A^4 + c_3 A^6
    let combine = |c: [f64; 4]| {
        Mat::from_fn(n, n, |i, j| {
            c[0] * identity[(i, j)] + c[1] * a2[(i, j)] + c[2] * a4[(i, j)] + c[3] * a6[(i, j)]
        })
    };
    let p = &PADE_13;
    let u = a * (&a6 * combine([0.0, p[9], p[11], p[13]]) + combine([p[1], p[3], p[5], p[7]]));
    let v = &a6 * combine([0.0, p[8], p[10], p[12]]) + combine([p[0], p[2], p[4], p[6]]);
    (&v - &u).partial_piv_lu().solve(&v + &u)
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;
    use serde_json::Value;

    fn assert_close(found: &Mat<f64>, expected: &Mat<f64>, tolerance: f64) {
        let scale = expected.norm_max();
        let error = (found - expected).norm_max();
        assert!(error <= tolerance * scale, "{error:e} of {scale:e}");
    }

    #[test]
    fn rotation() {
        for angle in [1e-9_f64, 0.3, 2.0, 40.0, 1000.0] {
            let a = mat![[0.0, angle], [-angle, 0.0]];
            let expected = mat![[angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]];
            // The condition number of this problem is the angle.
            assert_close(&exponential(a.as_ref()), &expected, 8e-16 * angle.max(4.0));
        }
    }

    #[test]
    fn jordan_block() {
        let (l, t) = (-0.7_f64, 5.0);
        let a = Mat::from_fn(3, 3, |i, j| match j.wrapping_sub(i) {
            0 => l * t,
            1 => t,
            _ => 0.0,
        });
        let e = (l * t).exp();
        let expected = mat![[e, t * e, t * t * e / 2.0], [0.0, e, t * e], [0.0, 0.0, e]];
        assert_close(&exponential(a.as_ref()), &expected, 1e-14);
    }

    #[test]
    fn nilpotent() {
        let a = mat![[0.0, 3.0, 5.0], [0.0, 0.0, 7.0], [0.0, 0.0, 0.0]];
        let expected = mat![[1.0, 3.0, 5.0 + 10.5], [0.0, 1.0, 7.0], [0.0, 0.0, 1.0]];
        assert_close(&exponential(a.as_ref()), &expected, 1e-15);
    }

    /// `V diag(-1000, -1, 0) V^-1` with unit lower triangular V, so that the inverse is exact.
    #[test]
    fn stiff() {
        let v = mat![[1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [-1.0, 3.0, 1.0]];
        let inverse = mat![[1.0, 0.0, 0.0], [-2.0, 1.0, 0.0], [7.0, -3.0, 1.0]];
        let diagonal = |d: [f64; 3]| Mat::from_fn(3, 3, |i, j| if i == j { d[i] } else { 0.0 });
        let a = &v * diagonal([-1000.0, -1.0, 0.0]) * &inverse;
        let expected = &v * diagonal([0.0, (-1.0_f64).exp(), 1.0]) * &inverse;
        assert_close(&exponential(a.as_ref()), &expected, 1e-11);
    }

    #[test]
    fn zero_empty_and_one_by_one() {
        let zero = Mat::<f64>::zeros(4, 4);
        assert_close(&exponential(zero.as_ref()), &Mat::identity(4, 4), 1e-15);
        assert_eq!(exponential(Mat::<f64>::zeros(0, 0).as_ref()).nrows(), 0);
        for x in [-700.0, -1.0, 1e-12, 1.0, 700.0_f64] {
            let found = exponential(mat![[x]].as_ref())[(0, 0)];
            assert!((found / x.exp() - 1.0).abs() < 1e-13 * x.abs().max(1.0), "{x}");
        }
    }

    #[test]
    fn not_finite() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let found = exponential(mat![[0.0, bad], [1.0, 0.0]].as_ref());
            assert!((0..4).all(|k| found[(k / 2, k % 2)].is_nan()));
        }
        let _ = exponential(mat![[1e308, 1e308], [1e308, 1e308]].as_ref());
        let _ = exponential(mat![[1e305, 0.0], [-1e305, 1e305]].as_ref());
        assert_eq!(exponential(mat![[-1e307]].as_ref())[(0, 0)], 0.0);
    }

    fn numbers(of: &Value) -> Vec<f64> {
        let all = of.as_array().unwrap().iter();
        all.map(|x| x.as_f64().unwrap()).collect()
    }

    /// `exponential/reference.py`: 200 matrices with states in units from 1e-10 to 1e10, to 60 digits. Errors in the
    /// matrices' own units are those of a backward stable method, whichever number of squarings it takes.
    #[test]
    fn as_mpmath_in_any_units() {
        let cases: Value = serde_json::from_str(include_str!("exponential/reference.json")).unwrap();
        let cases = cases.as_array().unwrap();
        assert_eq!(cases.len(), 200);
        for case in cases {
            let [units, a, exact] = ["units", "a", "exact"].map(|key| numbers(&case[key]));
            let n = units.len();
            let own = |m: &[f64]| Mat::from_fn(n, n, |i, j| m[i * n + j] / (units[i] / units[j]));
            let exact = own(&exact);
            let condition = case["condition"].as_f64().unwrap().max(1.0);
            let tolerance = 4.0 * n as f64 * f64::EPSILON * condition * norm_1(exact.as_ref());
            for more in 0..3 {
                let found = exponential_by(Mat::from_fn(n, n, |i, j| a[i * n + j]).as_ref(), more);
                let found: Vec<f64> = (0..n * n).map(|k| found[(k / n, k % n)]).collect();
                let error = norm_1((own(&found) - &exact).as_ref());
                assert!(error <= tolerance, "{} {more}: {error:e} {tolerance:e}", case["kind"]);
            }
        }
    }

    /// Moler's matrix: its first entry is 0.446849468283175 (MathWorks, 2012), in any units of x_2.
    #[test]
    fn a_badly_scaled_matrix() {
        for unit in [1.0, 1e4, 1e-9, 8.0] {
            let a = mat![
                [0.0, 1e-8 * unit, 0.0],
                [-(2e10 + 4e8 / 6.0) / unit, -3.0, 2e10 / unit],
                [200.0 / 3.0, 0.0, -200.0 / 3.0]
            ];
            let found = exponential(a.as_ref())[(0, 0)];
            assert!((found - 0.446_849_468_283_175).abs() < 1e-14, "{unit} {found}");
        }
    }
}
