//! Against scipy: reference.py.

use super::*;
use crate::estimator::test_setup::estimate;
use crate::model::polynomial::{divide, filter};

const N: usize = 300;

/// The record of reference.py.
fn record(a: &[f64], b: &[f64], c: &[f64], f: &[f64], gain: f64) -> [Vec<f64>; 2] {
    let mut x = 1_u64;
    let mut share = || {
        x = (1_664_525 * x + 1_013_904_223) % (1 << 32);
        x as f64 / 2_f64.powi(32)
    };
    let u: Vec<f64> = (0..N).map(|_| (share() - 0.5).signum()).collect();
    let wave = |share: f64| (0.9 * std::f64::consts::PI * (share - 0.5)).tan();
    let e: Vec<f64> = (0..N).map(|_| gain * wave(share())).collect();
    let (mut y, mut noise) = (vec![0.0; N], vec![0.0; N]);
    filter(b, &u, &mut y);
    divide(f, &mut y);
    filter(c, &e, &mut noise);
    y.iter_mut().zip(&noise).for_each(|(y, v)| *y += v);
    divide(a, &mut y);
    [u, y]
}

fn fitted(options: &PemTOptions, u: &[f64], y: &[f64]) -> Pass {
    options.check().unwrap();
    estimate(options, 1, u, y)
}

/// The minimum by scipy: theta, s^2 and nu.
fn check(orders: &str, record: &[Vec<f64>; 2], given: Option<f64>, expected: (&[f64], f64, f64)) {
    let (theta, square, nu) = expected;
    let [u, y] = record;
    let options = PemTOptions {
        orders: Some(orders.parse().unwrap()),
        freedom: given,
        ..PemTOptions::default()
    };
    let pass = fitted(&options, u, y);
    assert_eq!(pass.failure, None, "{orders}");
    for (found, expected) in pass.model.parameters().zip(theta) {
        assert!(
            (found - expected).abs() < 1e-6,
            "{orders} {given:?}: {found} {expected}"
        );
    }
    let count = N as f64 / (N - theta.len()) as f64;
    let variance = count * square * nu / (nu - 2.0);
    let off = pass.model.noise_variance / variance - 1.0;
    assert!(off.abs() < 1e-5, "{orders} {given:?}: {off}");
    assert_eq!(pass.model.covariance.len(), theta.len().pow(2));
}

#[test]
fn the_minimum_of_scipy() {
    let first = record(&[1.0], &[0.0, 0.8], &[1.0], &[1.0, -0.9], 0.3);
    assert!((first[1][N - 1] - 0.424_471_470_524_489_64).abs() < 1e-12);
    let orders = "nb=1,nf=1,nk=1";
    let given = (&[0.799_828_503_6, -0.905_330_647_8][..], 0.156_809_449_1, 3.0);
    check(orders, &first, Some(3.0), given);
    let free = (
        &[0.799_172_870_5, -0.905_366_758_2][..],
        0.137_209_629_71,
        2.441_582_928,
    );
    check(orders, &first, None, free);
    let a = [1.0, -1.5, 0.7];
    let second = record(&a, &[0.0, 1.0, 0.5], &[1.0, -0.5], &[1.0], 0.2);
    let orders = "na=2,nb=2,nc=1,nk=1";
    let theta = [
        -1.491_266_328_0,
        0.691_317_450_4,
        1.004_858_454_3,
        0.506_743_560_2,
        -0.475_618_968_1,
    ];
    check(orders, &second, Some(3.0), (&theta, 0.069_998_997_6, 3.0));
    let theta = [
        -1.490_913_485_1,
        0.690_931_650_8,
        1.003_893_685_9,
        0.507_379_353_3,
        -0.477_123_231_6,
    ];
    check(orders, &second, None, (&theta, 0.061_038_875_8, 2.433_603_596));
}

#[test]
fn mistakes_are_told() {
    for (orders, freedom, key) in [(Some("nf=1"), None, "orders"), (None, Some(2.0), "freedom")] {
        let options = PemTOptions {
            orders: orders.map(|orders| orders.parse().unwrap()),
            freedom,
            ..PemTOptions::default()
        };
        assert_eq!(options.check().unwrap_err().key.as_deref(), Some(key));
    }
    let zeros = vec![0.0; 30];
    assert!(fitted(&PemTOptions::default(), &zeros, &zeros).failure.is_some());
}
