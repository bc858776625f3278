use super::super::lyapunov::{lyapunov, spectral_radius};
use super::equation::symmetric;
use super::*;
use crate::observer::{parse_poles, place};
use RiccatiError as E;
use faer::{ColRef, Scale, Side, c64, mat};
use serde_json::Value;

/// A reproducible source of uniform (Knuth's MMIX congruence, high 53 bits) and normal (Box-Muller) numbers.
pub(in crate::observer) struct Random(pub u64);

impl Random {
    /// Returns a number uniform in (0, 1).
    pub(in crate::observer) fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Returns a standard normal number.
    pub(in crate::observer) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    /// Returns n normal numbers.
    pub(in crate::observer) fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.normal()).collect()
    }

    /// Returns a matrix of normal numbers.
    pub(in crate::observer) fn matrix(&mut self, rows: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| self.normal())
    }

    /// Returns Q, s and r of a random joint covariance of (w, v), n + 1 square and positive definite.
    fn covariance(&mut self, n: usize) -> (Mat<f64>, Vec<f64>, f64) {
        let root = self.matrix(n + 1, n + 1);
        let all = &root * root.transpose();
        let s = (0..n).map(|i| all[(i, n)]).collect();
        (all.submatrix(0, 0, n, n).to_owned(), s, all[(n, n)])
    }
}

fn smallest_eigenvalue(m: &Mat<f64>) -> f64 {
    symmetric(m).self_adjoint_eigenvalues(Side::Lower).unwrap()[0]
}

fn closed_loop(f: &Mat<f64>, gain: &[f64], h: &[f64]) -> Mat<f64> {
    f - ColRef::from_slice(gain) * ColRef::from_slice(h).transpose()
}

fn assert_close(actual: &Mat<f64>, expected: &Mat<f64>, relative: f64) {
    let error = (actual - expected).norm_l2() / expected.norm_l2();
    assert!(error <= relative, "{error:e}: {actual:?} for {expected:?}");
}

/// `p^2 h^2 + p (r - f^2 r - q h^2) - q r = 0`, the larger root; f = h = q = r = 1 is the golden
/// ratio.
#[test]
fn scalar_closed_form() {
    for (f, h, q, r) in [(1.0, 1.0, 1.0, 1.0), (1.7, -0.6, 0.3, 2.0), (0.2, 3.0, 5.0, 0.1)] {
        let (f, h, q, r): (f64, f64, f64, f64) = (f, h, q, r);
        let half = (r - f * f * r - q * h * h) / 2.0;
        let p = (-half + (half * half + h * h * q * r).sqrt()) / (h * h);
        let found = dare(mat![[f]].as_ref(), &[h], mat![[q]].as_ref(), &[0.0], r).unwrap();
        assert!((found.p[(0, 0)] / p - 1.0).abs() < 1e-14, "{found:?}");
        assert!((found.gain[0] / (f * p * h / (h * h * p + r)) - 1.0).abs() < 1e-14);
        assert!((found.innovation / (h * h * p + r) - 1.0).abs() < 1e-14);
    }
    let found = dare(mat![[1.0]].as_ref(), &[1.0], mat![[1.0]].as_ref(), &[0.0], 1.0).unwrap();
    assert!((found.p[(0, 0)] - f64::midpoint(1.0, 5.0_f64.sqrt())).abs() < 1e-15);
}

/// Benner, Laub, Mehrmann, "DAREX", SPC 95-23 (1995), Example 1.1, transposed: X = (1 + sqrt 5) / 2
/// Q. Its continuous counterpart in "CAREX", SPC 95-22, Example 1.2: X = (1 + sqrt 2) Q.
#[test]
fn benchmark_collections() {
    let f = mat![[4.0, -4.5], [3.0, -3.5]];
    let q = mat![[9.0, 6.0], [6.0, 4.0]];
    let h = [1.0, -1.0];
    let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
    let discrete = dare(f.as_ref(), &h, q.as_ref(), &[0.0; 2], 1.0).unwrap();
    assert_close(&discrete.p, &(Scale(golden) * &q), 1e-12);
    let continuous = care(f.as_ref(), &h, q.as_ref(), 1.0).unwrap();
    assert_close(&continuous.p, &(Scale(1.0 + 2.0_f64.sqrt()) * &q), 1e-12);
}

/// MathWorks, "Kalman Filter Design" (Control System Toolbox): the innovation gain
/// `M = P h / (h'P h + r)` printed for Q = 2.3.
#[test]
fn matlab_kalman_example() {
    let f = mat![[1.1269, -0.4940, 0.1129], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let b = [-0.3832, 0.5919, 0.5191];
    let q = Mat::from_fn(3, 3, |i, j| 2.3 * b[i] * b[j]);
    let found = dare(f.as_ref(), &[1.0, 0.0, 0.0], q.as_ref(), &[0.0; 3], 1.0).unwrap();
    for (i, m) in [0.5345, 0.0101, -0.4776].into_iter().enumerate() {
        assert!((found.p[(i, 0)] / found.innovation - m).abs() <= 0.5e-4);
    }
}

/// scipy 1.17.1: `scipy.linalg.solve_discrete_are(F.T, h, Q, [[r]], s=s)`,
/// `K = (F @ P @ h + s) / (h.T @ P @ h + r)`; F has the poles 0.9, 0.8 +- 0.3i, -0.5.
#[test]
fn cross_covariance_as_scipy() {
    let a = [0.3285, -0.428, -0.92, 2.0];
    let f = Mat::from_fn(4, 4, |i, j| if i == 3 { a[j] } else { f64::from(i + 1 == j) });
    let q = mat![
        [2.0, 0.5, 0.0, 0.1],
        [0.5, 1.0, 0.3, 0.0],
        [0.0, 0.3, 1.5, 0.2],
        [0.1, 0.0, 0.2, 1.0]
    ];
    let s = [0.3, -0.2, 0.1, 0.4];
    let found = dare(f.as_ref(), &[1.0, 0.0, 0.0, 0.0], q.as_ref(), &s, 0.7).unwrap();
    let p = mat![
        [
            14.605747921184253,
            20.57869360900702,
            26.00888604583896,
            28.26826330289297
        ],
        [
            20.57869360900702,
            41.08654148080112,
            55.284802249736565,
            64.70626174878913
        ],
        [
            26.00888604583896,
            55.284802249736565,
            83.60604816267582,
            102.81998669631395
        ],
        [
            28.26826330289297,
            64.70626174878913,
            102.81998669631395,
            134.68488109303766
        ]
    ];
    assert_close(&found.p, &p, 1e-12);
    let gain = [
        1.3641080276847766,
        1.6862218154081585,
        1.8534385545203746,
        1.8946253995815443,
    ];
    for (found, k) in found.gain.iter().zip(gain) {
        assert!((found - k).abs() < 1e-12);
    }
}

/// Kalata, "The tracking index", IEEE Trans. AES 20 (1984) 174: with
/// `Lambda = T^2 sigma_w / sigma_v` and `rho = (4 + Lambda - sqrt(8 Lambda + Lambda^2)) / 4`,
/// `alpha = 1 - rho^2`, `beta = 2 (2 - alpha) - 4 sqrt(1 - alpha)`; the predictor's gain is
/// `F [alpha, beta / T]`.
#[test]
fn alpha_beta_tracker() {
    for (t, w, v) in [(1.0, 1.0, 1.0), (0.1, 2.0, 0.5), (2.0, 0.01, 3.0)] {
        let (t, w, v): (f64, f64, f64) = (t, w, v);
        let noise = [t * t / 2.0 * w, t * w];
        let q = Mat::from_fn(2, 2, |i, j| noise[i] * noise[j]);
        let f = mat![[1.0, t], [0.0, 1.0]];
        let found = dare(f.as_ref(), &[1.0, 0.0], q.as_ref(), &[0.0; 2], v * v).unwrap();
        let index = t * t * w / v;
        let rho = (4.0 + index - (8.0 * index + index * index).sqrt()) / 4.0;
        let alpha = 1.0 - rho * rho;
        let beta = 2.0 * (2.0 - alpha) - 4.0 * rho;
        assert!((found.gain[0] / (alpha + beta) - 1.0).abs() < 1e-11);
        assert!((found.gain[1] / (beta / t) - 1.0).abs() < 1e-11);
    }
}

/// The double integrator with measured position, by hand: `p_12 = sqrt(q r)`, `p_11 = sqrt(2 r p_12)`,
/// `p_22 = p_11 p_12 / r`.
#[test]
fn continuous_double_integrator() {
    for (q, r) in [(1.0, 1.0), (4.0, 0.01), (1e-3, 2.0)] {
        let (q, r): (f64, f64) = (q, r);
        let a = mat![[0.0, 1.0], [0.0, 0.0]];
        let noise = mat![[0.0, 0.0], [0.0, q]];
        let found = care(a.as_ref(), &[1.0, 0.0], noise.as_ref(), r).unwrap();
        let p12 = (q * r).sqrt();
        let p11 = (2.0 * r * p12).sqrt();
        let p = mat![[p11, p12], [p12, p11 * p12 / r]];
        assert_close(&found.p, &p, 1e-12);
        assert!((found.gain[1] * r / p12 - 1.0).abs() < 1e-12);
    }
}

/// MathWorks, `care`, Example 1, and Altair Compose 2022, `care` (SLICOT SB02OD): the printed X,
/// transposed problems.
#[test]
fn continuous_published_examples() {
    let q = mat![[1.0, -1.0], [-1.0, 1.0]];
    let found = care(mat![[-3.0, 1.0], [2.0, 1.0]].as_ref(), &[0.0, 1.0], q.as_ref(), 3.0).unwrap();
    let x = mat![[0.5895, 1.8216], [1.8216, 8.8188]];
    assert!((&found.p - x).norm_max() <= 0.5e-4);
    let q = mat![[25.0, -2.5], [-2.5, 0.25]];
    let a = mat![[-15.0, 0.5], [1.0, 5.0]];
    let found = care(a.as_ref(), &[0.0, 5.0], q.as_ref(), 1.5).unwrap();
    let x = mat![[0.82854, -0.06766], [-0.06766, 0.61126]];
    assert!((&found.p - x).norm_max() <= 0.5e-5);
    assert!((found.gain[0] + 0.22552).abs() <= 0.5e-5 && (found.gain[1] - 2.03752).abs() <= 0.5e-5);
}

/// On random plants with poles of modulus up to 1.5, most of them unstable, both equations are
/// solved to 1e-12, P is >= 0 and the filter is stable.
#[test]
fn random_plants() {
    let mut random = Random(1);
    for trial in 0..200 {
        let n = 1 + trial % 10;
        let f = random.matrix(n, n);
        let radius = 0.2 + 1.3 * random.uniform();
        let f = Scale(radius / spectral_radius(f.as_ref())) * f;
        let h = random.vector(n);
        let (q, s, r) = random.covariance(n);
        let found = dare(f.as_ref(), &h, q.as_ref(), &s, r).unwrap();
        assert!(found.residual <= 1e-12, "{n} {radius} {found:?}");
        assert!(smallest_eigenvalue(&found.p) > -1e-14 * found.p.norm_l2());
        assert!(spectral_radius(closed_loop(&f, &found.gain, &h).as_ref()) < 1.0);
        let found = care(f.as_ref(), &h, q.as_ref(), r).unwrap();
        assert!(found.residual <= 1e-12, "{n} {radius} {found:?}");
        assert!(smallest_eigenvalue(&found.p) > -1e-14 * found.p.norm_l2());
        let poles = closed_loop(&f, &found.gain, &h).eigenvalues().unwrap();
        assert!(poles.iter().all(|z| z.re < 0.0));
    }
}

/// Spectral factorisation: the spectrum of y from the noises equals that of the innovations form,
/// `[h'(z - F)^-1, 1] [[Q, s], [s', r]] [h'(z - F)^-1, 1]^* = omega |1 + h'(z - F)^-1 K|^2` on |z| = 1.
#[test]
fn spectral_factorisation() {
    use faer::linalg::solvers::Solve;
    let mut random = Random(2);
    for n in 1..=6 {
        let f = random.matrix(n, n);
        let h = random.vector(n);
        let (q, s, r) = random.covariance(n);
        let found = dare(f.as_ref(), &h, q.as_ref(), &s, r).unwrap();
        for frequency in [0.0, 0.3, 1.1, 2.0, 3.0] {
            let z = c64::new(0.0, frequency).exp();
            // t' = h'(z - F)^-1
            let pencil = Mat::from_fn(n, n, |i, j| z * f64::from(i == j) - c64::new(f[(j, i)], 0.0));
            let t = pencil
                .partial_piv_lu()
                .solve(Mat::from_fn(n, 1, |i, _| c64::new(h[i], 0.0)));
            let t = |i: usize| t[(i, 0)];
            let pairs = || (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
            let driven: c64 = pairs().map(|(i, j)| t(i) * q[(i, j)] * t(j).conj()).sum();
            let crossed: c64 = (0..n).map(|i| t(i) * s[i]).sum();
            let innovations: c64 = (0..n).map(|i| t(i) * found.gain[i]).sum();
            let left = driven.re + 2.0 * crossed.re + r;
            let right = found.innovation * (innovations + 1.0).norm_sqr();
            assert!((left / right - 1.0).abs() < 1e-10, "{left} {right}");
        }
    }
}

/// No other stabilising gain has a smaller error covariance: `P_L - P >= 0`, and it is > 0 for a different gain.
#[test]
fn no_other_gain_is_better() {
    let mut random = Random(3);
    for trial in 0..100 {
        let n = 1 + trial % 5;
        let f = random.matrix(n, n);
        let h = random.vector(n);
        let (q, s, r) = random.covariance(n);
        let best = dare(f.as_ref(), &h, q.as_ref(), &s, r).unwrap();
        let mut size = 1.0;
        let (other, closed) = loop {
            let other: Vec<f64> = best.gain.iter().map(|k| k + size * random.normal()).collect();
            let closed = closed_loop(&f, &other, &h);
            if spectral_radius(closed.as_ref()) < 1.0 {
                break (other, closed);
            }
            size *= 0.7;
        };
        let noise = Mat::from_fn(n, n, |i, j| {
            let (ki, kj) = (other[i], other[j]);
            q[(i, j)] - ki * s[j] - s[i] * kj + ki * r * kj
        });
        let p = lyapunov(closed.as_ref(), noise.as_ref()).unwrap();
        let excess = &p - &best.p;
        assert!(smallest_eigenvalue(&excess) >= -1e-12 * p.norm_l2());
        assert!(excess.norm_l2() > 1e-9 * p.norm_l2());
    }
}

/// Without process noise, a stable plant is predicted from its model alone. The filter of an unstable plant has the
/// unstable poles mirrored in the unit circle (Anderson, Moore, "Optimal Filtering", 1979): for f = 2, h = r = 1, P =
/// f^2 - 1 and K = f - 1 / f.
#[test]
fn without_process_noise() {
    let zero = Mat::zeros(2, 2);
    let f = mat![[0.0, 1.0], [-0.7, 1.5]];
    let found = dare(f.as_ref(), &[1.0, 0.0], zero.as_ref(), &[0.0; 2], 1.0).unwrap();
    assert_eq!(
        (found.p.norm_max(), found.gain, found.residual),
        (0.0, vec![0.0; 2], 0.0)
    );
    let zero = Mat::zeros(1, 1);
    let found = dare(mat![[2.0]].as_ref(), &[1.0], zero.as_ref(), &[0.0], 1.0).unwrap();
    assert!((found.p[(0, 0)] - 3.0).abs() < 1e-13 && (found.gain[0] - 1.5).abs() < 1e-13);
    // With poles 2, -1.25 and 0.5 the filter's are 0.5, -0.8 and 0.5; their sum is the trace.
    let f = mat![[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.25, 2.125, 1.25]];
    let zero = Mat::zeros(3, 3);
    let found = dare(f.as_ref(), &[1.0, 0.0, 0.0], zero.as_ref(), &[0.0; 3], 1.0).unwrap();
    assert!((1.25 - found.gain[0] - 0.2).abs() < 1e-12, "{found:?}");
    // dx/dt = x + w: P = 2 a r / c^2.
    let zero = Mat::zeros(1, 1);
    let found = care(mat![[1.0]].as_ref(), &[1.0], zero.as_ref(), 1.0).unwrap();
    assert!((found.p[(0, 0)] - 2.0).abs() < 1e-13);
}

#[test]
fn refusals() {
    let f = mat![[0.0, 1.0], [-1.0, 1.6]];
    let (h, s) = ([1.0, 0.0], [0.0; 2]);
    let q = Mat::<f64>::identity(2, 2);
    let zero = Mat::<f64>::zeros(2, 2);
    let refused =
        |f: &Mat<f64>, h: &[f64], q: &Mat<f64>, s: &[f64], r: f64| dare(f.as_ref(), h, q.as_ref(), s, r).unwrap_err();
    // An undamped oscillation without process noise, an integrator, and an unstable mode that y does not show.
    assert!(matches!(refused(&f, &h, &zero, &s, 1.0), E::NotStabilising(_)));
    let integrator = mat![[1.0, 0.0], [0.0, 0.5]];
    assert!(matches!(refused(&integrator, &h, &zero, &s, 1.0), E::NotStabilising(_)));
    let unseen = mat![[0.5, 0.0], [0.0, 1.5]];
    assert!(matches!(refused(&unseen, &h, &q, &s, 1.0), E::NotStabilising(_)));
    assert!(matches!(refused(&f, &h[..1], &q, &s, 1.0), E::Shape { name: "h", .. }));
    assert!(matches!(
        refused(&f, &h, &Mat::identity(3, 3), &s, 1.0),
        E::Shape { name: "Q", .. }
    ));
    assert!(matches!(
        refused(&Mat::zeros(2, 3), &h, &q, &s, 1.0),
        E::Shape { name: "F", .. }
    ));
    assert_eq!(refused(&f, &[f64::NAN, 0.0], &q, &s, 1.0), E::NotFinite("h"));
    assert_eq!(refused(&f, &h, &q, &s, 0.0), E::Variance(0.0));
    assert!(matches!(refused(&f, &h, &q, &s, f64::NAN), E::Variance(_)));
    assert_eq!(
        refused(&f, &h, &mat![[1.0, 0.1], [0.0, 1.0]], &s, 1.0),
        E::NotSymmetric("Q")
    );
    let indefinite = mat![[1.0, 2.0], [2.0, 1.0]];
    assert!(matches!(refused(&f, &h, &indefinite, &s, 1.0), E::Indefinite("Q", _)));
    assert!(matches!(refused(&f, &h, &q, &[2.0, 0.0], 1.0), E::Indefinite(..)));
    let axis = care(mat![[0.0, 1.0], [-1.0, 0.0]].as_ref(), &h, zero.as_ref(), 1.0);
    assert!(matches!(axis, Err(E::NotStabilising(_))), "{axis:?}");
    let huge = Scale(1e200) * &f;
    assert!(dare(huge.as_ref(), &h, q.as_ref(), &s, 1.0).is_err());
}

/// scipy 1.17.1: `scipy.linalg.solve_discrete_lyapunov(F, Q)`; and the variance of an AR(2) process,
/// `(1 + d_2) / ((1 - d_2) ((1 + d_2)^2 - d_1^2))` (Box, Jenkins).
#[test]
fn lyapunov_values() {
    let f = mat![[0.5, 0.3, 0.0], [-0.2, 0.7, 0.1], [0.4, 0.0, -0.6]];
    let q = mat![[1.0, 0.2, 0.0], [0.2, 2.0, 0.1], [0.0, 0.1, 0.5]];
    let p = mat![
        [2.181764623683908, 1.0581024650568795, 0.4112481406330927],
        [1.0581024650568795, 3.543252536065189, 0.1594590984477035],
        [0.41124814063309273, 0.1594590984477035, 1.0182550504461576]
    ];
    assert_close(&lyapunov(f.as_ref(), q.as_ref()).unwrap(), &p, 1e-14);
    let (d1, d2) = (-1.5, 0.7);
    let f = mat![[-d1, 1.0], [-d2, 0.0]];
    let q = mat![[1.0, 0.0], [0.0, 0.0]];
    let variance = (1.0 + d2) / ((1.0 - d2) * ((1.0 + d2) * (1.0 + d2) - d1 * d1));
    let p = lyapunov(f.as_ref(), q.as_ref()).unwrap();
    assert!((p[(0, 0)] / variance - 1.0).abs() < 1e-13);
    let unstable = lyapunov(mat![[1.0]].as_ref(), mat![[1.0]].as_ref());
    assert_eq!(unstable.unwrap_err(), RiccatiError::Unstable(1.0));
}

fn numbers(of: &Value) -> Vec<f64> {
    let all = of.as_array().unwrap().iter();
    all.map(|x| x.as_f64().unwrap()).collect()
}

/// `reference.py`: 50 filters, discrete and continuous, of plants in units of states and time from 1e-9 to 1e9, to 60
/// digits. Errors in the plants' own units are those that the conditions of the problems allow.
#[test]
fn as_mpmath_in_any_units() {
    let all: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let cases = all["filters"].as_array().unwrap();
    assert_eq!(cases.len(), 50);
    for case in cases {
        let [units, a, c, q, p, gain] = ["units", "a", "c", "q", "p", "gain"].map(|key| numbers(&case[key]));
        let (n, r) = (units.len(), case["r"].as_f64().unwrap());
        let square = |m: &[f64]| Mat::from_fn(n, n, |i, j| m[i * n + j]);
        let (a, q) = (square(&a), square(&q));
        let found = if case["discrete"] == true {
            dare(a.as_ref(), &c, q.as_ref(), &vec![0.0; n], r)
        } else {
            care(a.as_ref(), &c, q.as_ref(), r)
        };
        let found = found.unwrap();
        let own = |m: &Mat<f64>| Mat::from_fn(n, n, |i, j| m[(i, j)] / units[i] / units[j]);
        let tolerance = 10.0 * n as f64 * f64::EPSILON * case["condition"].as_f64().unwrap();
        assert_close(&own(&found.p), &own(&square(&p)), tolerance);
        let column = |v: &[f64]| Mat::from_fn(n, 1, |i, _| v[i] / units[i]);
        assert_close(&column(&found.gain), &column(&gain), 10.0 * tolerance);
        assert!(found.residual <= 1e-12, "{found:?}");
    }
}

/// `reference.py`: 50 placements of such plants, heat rods and lags among them.
#[test]
fn placements_as_mpmath_in_any_units() {
    let all: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let cases = all["placements"].as_array().unwrap();
    assert_eq!(cases.len(), 50);
    for case in cases {
        let [units, a, c, gain] = ["units", "a", "c", "gain"].map(|key| numbers(&case[key]));
        let n = units.len();
        let a = Mat::from_fn(n, n, |i, j| a[i * n + j]);
        let poles = parse_poles(case["poles"].as_str().unwrap()).unwrap();
        let found = place(a.as_ref(), &c, &poles).unwrap();
        let column = |v: &[f64]| Mat::from_fn(n, 1, |i, _| v[i] / units[i]);
        let tolerance = 10.0 * n as f64 * f64::EPSILON * case["condition"].as_f64().unwrap();
        assert_close(&column(&found), &column(&gain), tolerance);
    }
}

/// scipy 1.17.1, numpy: `solve_discrete_are(F.T, h, Q, [[r]], s=s)` and `solve_continuous_are(A.T, c, Q, [[r]], s=s)`
/// with their gains; also in other units of states and y.
#[test]
fn cross_covariances_of_both_equations_as_scipy() {
    let f = mat![[1.1, 0.4, 0.0], [0.0, 0.6, 0.2], [0.1, 0.0, -0.5]];
    let q = mat![[1.0, 0.2, 0.1], [0.2, 0.8, 0.0], [0.1, 0.0, 0.4]];
    let (h, s, r) = ([1.0, 0.0, 2.0], [-0.3, 0.2, 0.1], 2.0);
    let p = [
        3.5645125355909144,
        0.4977172033833902,
        0.39065703493298465,
        0.4977172033833902,
        1.1780365450500998,
        0.0008069266617434677,
        0.39065703493298465,
        0.0008069266617434677,
        0.5238463237949507,
    ];
    let gain = [0.507468529083496, 0.08536365991776057, -0.020015360358556274];
    for units in [[1.0; 3], [1.0, 1e-9, 1e6], [1e4, 3.0, 1e-7]] {
        for of_y in [1.0, 1e-6, 1e9] {
            let in_units = |m: &Mat<f64>| Mat::from_fn(3, 3, |i, j| m[(i, j)] * units[i] * units[j]);
            let own = Mat::from_fn(3, 3, |i, j| f[(i, j)] * units[i] / units[j]);
            let h = [0, 1, 2].map(|i| h[i] * of_y / units[i]);
            let s = [0, 1, 2].map(|i| s[i] * of_y * units[i]);
            let (q, r) = (in_units(&q), r * of_y * of_y);
            let found = dare(own.as_ref(), &h, q.as_ref(), &s, r).unwrap();
            for i in 0..3 {
                let k = found.gain[i] * of_y / units[i];
                assert!((k - gain[i]).abs() < 1e-10, "{units:?} {of_y}: {k}");
                for j in 0..3 {
                    let own = found.p[(i, j)] / units[i] / units[j];
                    assert!((own - p[3 * i + j]).abs() < 1e-10, "{units:?} {of_y}: {own}");
                }
            }
            assert!((found.innovation / of_y / of_y - 9.222525970502655).abs() < 1e-10);
        }
    }
    let a = mat![[0.0, 1.0], [-4.0, -0.4]];
    let q = mat![[0.3, 0.1], [0.1, 0.5]];
    let found = care_correlated(a.as_ref(), &[1.0, 0.5], q.as_ref(), &[0.1, -0.05], 0.2).unwrap();
    let p = mat![
        [0.13016871612013428, -0.03909871380897628],
        [-0.03909871380897628, 0.6573128227280436]
    ];
    assert_close(&found.p, &p, 1e-10);
    for (gain, expected) in found.gain.iter().zip([1.0530967960782307, 1.1977884877752276]) {
        assert!((gain - expected).abs() < 1e-10, "{gain}");
    }
    let much = care_correlated(a.as_ref(), &[1.0, 0.5], q.as_ref(), &[0.5, 0.0], 0.2);
    assert!(matches!(much, Err(RiccatiError::Indefinite(..))), "{much:?}");
}
