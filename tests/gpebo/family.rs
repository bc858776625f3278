//! Estimators of the same family, in the paper's example, against the integration of `family.py`.

use super::common::example_of;
use asobench::observer::gpebo::{ObserverSpec, Operator};

/// t, then theta by least squares, LS+DREM and the finite-time estimator.
const REFERENCE: [[f64; 7]; 5] = [
    [
        0.5,
        1.018862378,
        1.959646516,
        0.4281082962,
        0.1843824956,
        0.08676885222,
        0.03684652549,
    ],
    [
        1.0,
        0.9792275138,
        2.075435733,
        0.8523848708,
        0.5850516879,
        0.7131622734,
        0.3664586587,
    ],
    [
        2.0,
        0.9823166458,
        1.93012682,
        0.9640078279,
        1.141140286,
        0.9357370306,
        0.8768856654,
    ],
    [
        5.0,
        0.9902450159,
        1.976475589,
        0.9896681491,
        1.807395159,
        0.9654962155,
        1.845981587,
    ],
    [
        20.0,
        0.9982391115,
        2.003812454,
        0.9994562206,
        2.000787971,
        0.9919241676,
        2.014992473,
    ],
];

#[test]
fn the_family_integrated_by_another_program() {
    let (p0, r) = (40.0, 1.0);
    let observers = [
        ObserverSpec::KalmanBucy { p0, r },
        ObserverSpec::LsDrem {
            gains: vec![3.0, 0.5],
            p0,
            r,
        },
        ObserverSpec::FiniteTime {
            gains: vec![0.1, 0.02],
            share: 0.5,
        },
    ];
    let cascade = example_of([0.3, 1.0], Operator::Lag(1.0), 2e-3, &observers);
    let mut compared = 0;
    cascade.run(1, |sample| {
        let row = REFERENCE.iter().find(|row| (row[0] - sample.t).abs() < 1e-9);
        let Some([_, exact @ ..]) = row else { return };
        let found = sample.estimates.iter().flat_map(|of| &of.theta);
        for (found, exact) in found.zip(exact) {
            assert!((found - exact).abs() < 2e-7, "{}: {found} {exact}", sample.t);
            compared += 1;
        }
    });
    assert_eq!(compared, 30);
}

/// Without a disturbance the mixed regression is exact, so that theta_i is `theta_i (1 - exp(-gamma int det(H)^2))`;
/// large gains reach theta.
#[test]
fn mixed_least_squares_is_exact_without_a_disturbance() {
    let observer = ObserverSpec::LsDrem {
        gains: vec![1e4, 1e4],
        p0: 1.0,
        r: 0.1,
    };
    let cascade = example_of([0.0, 1.0], Operator::Lag(1.0), 5e-3, &[observer]);
    let mut last = vec![];
    cascade.run(1, |sample| last = sample.estimates[0].theta.clone());
    for (found, exact) in last.iter().zip([1.0, 2.0]) {
        assert!((found - exact).abs() < 1e-9, "{found}");
    }
}
