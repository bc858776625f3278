//! The matrix exponential.

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

/// The largest 1-norm for which the approximant is accurate to unit roundoff, Table 2.3 of the source.
const THETA_13: f64 = 5.371920351148152;

/// Computes `e^A` of a square matrix by scaling and squaring with the [13/13] Pade approximant:
/// `e^A = r(A / 2^s)^(2^s)`, where `s` is the smallest integer with `norm1(A) / 2^s <= 5.37`.
///
/// If an entry of A is not finite, all entries are NaN. If `e^A` overflows, entries are infinite or NaN. Source: N. J.
/// Higham, The scaling and squaring method for the matrix exponential revisited, SIAM J. Matrix Anal. Appl. 26 (2005)
/// 1179-1193, Algorithm 2.3.
///
/// # Panics
/// If A is not square.
pub fn exponential(a: MatRef<'_, f64>) -> Mat<f64> {
    let n = a.nrows();
    assert!(n == a.ncols(), "the exponential needs a square matrix");
    let norm = (0..n)
        .map(|j| (0..n).map(|i| a[(i, j)].abs()).sum::<f64>())
        .fold(0.0, |largest: f64, sum| {
            // `max` would drop a NaN.
            if sum <= largest { largest } else { sum }
        });
    if !norm.is_finite() {
        return Mat::full(n, n, f64::NAN);
    }
    let squarings = (norm / THETA_13).log2().ceil().max(0.0) as i32;
    // Two factors: 2^-s alone would underflow for the largest norms.
    let scale = 0.5_f64.powi(squarings / 2) * 0.5_f64.powi(squarings - squarings / 2);
    let mut result = pade_13(&(Scale(scale) * a));
    for _ in 0..squarings {
        result = &result * &result;
    }
    result
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
            assert!(
                (found / x.exp() - 1.0).abs() < 1e-13 * x.abs().max(1.0),
                "{x}"
            );
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
}
