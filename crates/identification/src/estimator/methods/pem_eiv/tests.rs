//! Against the dense likelihood, minimised by scipy: reference.py.

use super::*;
use crate::estimator::test_setup::estimate;
use crate::model::polynomial::divide;

const N: usize = 150;

/// The record of reference.py.
fn record(b: &[f64], f: &[f64], noise: [f64; 2]) -> [Vec<f64>; 2] {
    let mut x = 1_u64;
    let mut normal = || {
        let share = |_| {
            x = (1_664_525 * x + 1_013_904_223) % (1 << 32);
            x as f64 / 2_f64.powi(32)
        };
        (0..12).map(share).sum::<f64>() - 6.0
    };
    let mut white = |gain: f64| -> Vec<f64> { (0..N).map(|_| gain * normal()).collect() };
    let [r, of_u, of_y] = [1.0, noise[0], noise[1]].map(&mut white);
    let mut y = vec![0.0; N];
    filter(b, &r, &mut y);
    divide(f, &mut y);
    let sum = |x: &[f64], w: &[f64]| x.iter().zip(w).map(|(x, w)| x + w).collect();
    [sum(&r, &of_u), sum(&y, &of_y)]
}

fn fitted(options: &PemEivOptions, [u, y]: &[Vec<f64>; 2]) -> Pass {
    options.check().unwrap();
    estimate(options, 1, u, y)
}

#[test]
fn the_minimum_of_the_dense_likelihood() {
    let first = (
        "nb=1,nf=1,nk=1",
        record(&[0.0, 0.8], &[1.0, -0.9], [0.3, 0.7]),
        vec![0.785_747_554_5, -0.908_317_747_2],
        [0.075_493_259_2, 0.617_028_665_2],
    );
    let second = (
        "nb=2,nf=2,nk=1",
        record(&[0.0, 1.0, 0.5], &[1.0, -1.5, 0.7], [0.3, 1.0]),
        vec![0.875_038_581_1, 0.611_435_931_6, -1.520_351_796_2, 0.709_003_526_3],
        [0.074_898_898_9, 1.365_061_408_6],
    );
    assert!((first.1[1][N - 1] + 3.338_969_002_487_95).abs() < 1e-10);
    for (orders, record, theta, [s_u, s_y]) in [first, second] {
        let options = PemEivOptions {
            orders: Some(orders.parse().unwrap()),
            ..PemEivOptions::default()
        };
        let pass = fitted(&options, &record);
        assert_eq!(pass.failure, None, "{orders}");
        for (found, expected) in pass.model.parameters().zip(&theta) {
            assert!((found - expected).abs() < 1e-6, "{orders}: {found} {expected}");
        }
        let found = pass.noise_variances.unwrap();
        for (found, expected) in found.iter().zip([s_y, s_u]) {
            assert!((found / expected - 1.0).abs() < 1e-5, "{orders}: {found} {expected}");
        }
        assert_eq!(pass.model.covariance.len(), theta.len().pow(2));
    }
}

/// Without noise in u its variance goes to 0, which is told; a record of zeros has no model.
#[test]
fn no_noise_is_a_border() {
    let exact = record(&[0.0, 0.8], &[1.0, -0.9], [0.0, 0.7]);
    let failure = fitted(&PemEivOptions::default(), &exact).failure;
    let kind = failure.map(|failure| failure.kind);
    assert!(matches!(kind, None | Some(FailureKind::Boundary)), "{kind:?}");
    let zeros = [vec![0.0; N], vec![0.0; N]];
    assert!(fitted(&PemEivOptions::default(), &zeros).failure.is_some());
}
