use super::super::likelihood::{ProcessNoise, RatioError, maximum_likelihood_ratio};
use super::super::luenberger::ObservedModel;
use super::super::riccati::tests::Random;
use super::super::stochastic_model::MeasurementNoise;
use super::*;
use faer::linalg::solvers::Solve;
use faer::{Col, ColRef, Scale, Side};

/// Poles 0.9, 0.8 +- 0.3i.
const A: [f64; 3] = [0.657, -2.17, 2.5];
const B: [f64; 3] = [1.0, 0.4, -0.3];
/// D(q) of the ARX structure with A.
const D: [f64; 4] = [1.0, -2.5, 2.17, -0.657];

const COLOURED: MeasurementNoise<'_> = MeasurementNoise {
    numerator: &[0.8, 0.3, -0.1],
    denominator: &[1.0, -0.9],
    deviation: 0.5,
};

const WHITE: MeasurementNoise<'_> = MeasurementNoise {
    numerator: &[1.0],
    denominator: &[1.0],
    deviation: 1.0,
};

fn model(q: &Mat<f64>, noise: MeasurementNoise<'_>) -> StochasticModel {
    StochasticModel::new(&A, &B, q.as_ref(), noise).unwrap()
}

fn definite(random: &mut Random, n: usize) -> Mat<f64> {
    let root = random.matrix(n, n);
    &root * root.transpose()
}

/// Returns a factor L of `[[Q, s], [s', r]]`: w and v are L times n + 1 independent normal numbers.
fn factor(model: &StochasticModel) -> Mat<f64> {
    let m = model.order();
    let all = Mat::from_fn(m + 1, m + 1, |i, j| match (i < m, j < m) {
        (true, true) => model.q[(i, j)],
        (true, false) => model.s[i],
        (false, true) => model.s[j],
        (false, false) => model.r,
    });
    root(&all)
}

/// Returns a square root of a covariance that may be singular.
fn root(all: &Mat<f64>) -> Mat<f64> {
    let n = all.nrows();
    let eigen = all.self_adjoint_eigen(Side::Lower).unwrap();
    let values = eigen.S().column_vector();
    Mat::from_fn(n, n, |i, j| eigen.U()[(i, j)] * values[j].max(0.0).sqrt())
}

/// Simulates y and the states x(0) ... x(K) from x(0).
fn simulate(model: &StochasticModel, x0: Col<f64>, u: &[f64], random: &mut Random) -> (Vec<f64>, Vec<Col<f64>>) {
    let m = model.order();
    let factor = factor(model);
    let mut x = x0;
    let (mut y, mut states) = (Vec::new(), vec![x.clone()]);
    for u in u {
        let noise = &factor * ColRef::from_slice(&random.vector(m + 1));
        y.push(ColRef::from_slice(&model.h).transpose() * &x + noise[m]);
        let next = &model.f * &x;
        x = Col::from_fn(m, |i| next[i] + model.g[i] * u + noise[i]);
        states.push(x.clone());
    }
    (y, states)
}

/// The noise part of the model has the impulse response of C/D, by long division.
#[test]
fn noise_states_realise_the_filter() {
    let model = model(&Mat::zeros(3, 3), COLOURED);
    let (c, d) = (COLOURED.numerator, COLOURED.denominator);
    let at = |p: &[f64], i: usize| p.get(i).copied().unwrap_or(0.0);
    let mut expected: Vec<f64> = Vec::new();
    for i in 0..12 {
        let past: f64 = (1..=i).map(|j| at(d, j) * expected[i - j]).sum();
        expected.push(at(c, i) - past);
    }
    let c0_variance = model.s[3] / (c[1] - c[0] * d[1]);
    let mut x = Col::from_fn(5, |i| model.s[i] / c0_variance);
    assert_eq!((model.order(), model.r), (5, 0.8 * 0.8 * 0.25));
    for expected in &expected[1..] {
        let f = ColRef::from_slice(&model.h).transpose() * &x;
        assert!((f - expected).abs() < 1e-14);
        x = &model.f * x;
    }
}

/// Without process noise and with C's zeros inside the unit circle, P = 0 solves the equation. The plant's part of the
/// gain is then zero and the noise's part is B_f / c_0. The innovations are `c_0 w`, so an exact start gives exact
/// predictions of the plant's state. ARX noise, D = A, is such a case.
#[test]
fn coloured_noise_without_process_noise() {
    let arx = MeasurementNoise {
        numerator: &[2.0],
        denominator: &D,
        deviation: 0.3,
    };
    for noise in [arx, COLOURED] {
        let model = model(&Mat::zeros(3, 3), noise);
        let gains = GainSequence::steady(&model).unwrap();
        assert!(gains.covariance().norm_max() < 1e-14);
        assert!((gains.variance(7) / model.r - 1.0).abs() < 1e-13);
        for (i, k) in gains.gain(7).iter().enumerate() {
            assert!((k - model.s[i] / model.r).abs() < 1e-13);
        }
        let mut random = Random(4);
        let u = random.vector(200);
        let start = Col::from_fn(model.order(), |i| if i < 3 { 1.0 } else { 0.0 });
        let (y, states) = simulate(&model, start, &u, &mut random);
        let mut filter = Kalman::steady(&model).unwrap();
        let check = |k: usize, x: &[f64]| {
            for i in 0..3 {
                assert!((x[i] - states[k][i]).abs() < 1e-10);
            }
        };
        filter.run(&u, &y, &[1.0; 3], check).unwrap();
        check(200, filter.state());
    }
}

/// A zero z of C outside the unit circle is mirrored in the innovations, whose variance is `|z|^2 c_0^2 sigma^2` (the
/// spectral factorisation of a moving average; Box, Jenkins). A zero on the circle is refused.
#[test]
fn zeros_of_the_noise_are_mirrored() {
    for (numerator, variance) in [([1.0, 2.0, 0.0], 4.0), ([0.5, -0.2, 1.3], 6.76 * 0.25)] {
        let noise = MeasurementNoise {
            numerator: &numerator,
            denominator: &[1.0, -0.3],
            deviation: 1.0,
        };
        let gains = GainSequence::steady(&model(&Mat::zeros(3, 3), noise)).unwrap();
        assert!((gains.variance(0) / variance - 1.0).abs() < 1e-10);
        assert!(gains.gain(0)[..3].iter().all(|k| k.abs() < 1e-10));
    }
    let noise = MeasurementNoise {
        numerator: &[1.0, -1.0],
        denominator: &[1.0],
        deviation: 1.0,
    };
    let refused = GainSequence::steady(&model(&Mat::zeros(3, 3), noise));
    assert!(matches!(refused, Err(RiccatiError::NotStabilising(_))));
}

/// The time-varying filter tends to the stationary one from any start, also for an unstable plant.
#[test]
fn time_varying_tends_to_steady() {
    let mut random = Random(5);
    for a in [A, [0.5, -1.0, 1.3], [-0.3, 0.2, 1.1]] {
        let q = definite(&mut random, 3);
        let model = StochasticModel::new(&a, &B, q.as_ref(), COLOURED).unwrap();
        let steady = GainSequence::steady(&model).unwrap();
        for scale in [0.0, 1.0, 1e4] {
            let p0 = Mat::<f64>::identity(5, 5);
            let gains = GainSequence::time_varying(&model, (Scale(scale) * p0).as_ref(), 5000);
            let gains = gains.unwrap();
            let error = (gains.covariance() - steady.covariance()).norm_l2();
            assert!(error < 1e-11 * steady.covariance().norm_l2());
            for (k, limit) in gains.gain(4999).iter().zip(steady.gain(0)) {
                assert!((k - limit).abs() < 1e-11);
            }
            assert!(gains.stored() < 4000 && gains.covers(1_000_000), "{}", gains.stored());
        }
    }
}

/// The filter's errors over many records have covariance P(k). The sum of e'P^-1 e over N records is chi-squared with n
/// N degrees of freedom. Each product e_i e_j has mean p_ij and variance p_ii p_jj + p_ij^2. Tested within 4 standard
/// deviations, with a fixed seed.
#[test]
fn errors_have_the_covariance_p() {
    let mut random = Random(6);
    let q = Scale(0.05) * definite(&mut random, 3);
    let model = model(&q, COLOURED);
    let p0 = model.initial_covariance(definite(&mut random, 3).as_ref()).unwrap();
    let start = root(&p0);
    let (records, samples) = (4000, 10);
    let u = random.vector(samples);
    let x0 = [1.0, -2.0, 0.5];
    let mut filter = Kalman::time_varying(&model, p0.as_ref(), samples).unwrap();
    let mut sums = Mat::<f64>::zeros(3, 3);
    for _ in 0..records {
        let deviation = &start * ColRef::from_slice(&random.vector(5));
        let state = Col::from_fn(5, |i| deviation[i] + if i < 3 { x0[i] } else { 0.0 });
        let (y, states) = simulate(&model, state, &u, &mut random);
        filter.run(&u, &y, &x0, |_, _| ()).unwrap();
        let e: Vec<f64> = (0..3).map(|i| filter.state()[i] - states[samples][i]).collect();
        sums += Mat::from_fn(3, 3, |i, j| e[i] * e[j]);
    }
    let p = filter.gains().covariance().submatrix(0, 0, 3, 3).to_owned();
    let n = f64::from(records);
    let solved = p.partial_piv_lu().solve(&sums);
    let chi_squared: f64 = (0..3).map(|i| solved[(i, i)]).sum();
    assert!((chi_squared - 3.0 * n).abs() < 4.0 * (6.0 * n).sqrt(), "{chi_squared}");
    for i in 0..3 {
        for j in 0..3 {
            let variance = p[(i, i)] * p[(j, j)] + p[(i, j)] * p[(i, j)];
            let z = (sums[(i, j)] / n - p[(i, j)]) / (variance / n).sqrt();
            assert!(z.abs() < 4.0, "{i} {j} {z}");
        }
    }
}

/// Without process noise the filter is least squares for x(0), weighted by its prior: the minimiser
/// of `(x - x0)'P0^-1 (x - x0) + sum_k (y(k) - h'x(k))^2 / r`, propagated to k = K.
#[test]
fn without_process_noise_it_is_batch_least_squares() {
    let mut random = Random(7);
    let model = model(&Mat::zeros(3, 3), MeasurementNoise::white(0.7));
    let p0 = definite(&mut random, 3);
    let x0 = [0.5, -1.0, 2.0];
    let u = random.vector(40);
    let (y, _) = simulate(&model, Col::from_fn(3, |i| 2.0 * x0[i]), &u, &mut random);
    let identity = Mat::<f64>::identity(3, 3);
    let mut information = p0.partial_piv_lu().solve(&identity);
    let mut right = &information * ColRef::from_slice(&x0);
    let mut power = identity;
    let mut forced = Col::<f64>::zeros(3);
    for (u, y) in u.iter().zip(&y) {
        // y(k) = h'F^k x(0) + h' forced(k)
        let row = Col::from_fn(3, |j| power[(0, j)]);
        information += Scale(1.0 / model.r) * (&row * row.transpose());
        right += Scale((y - forced[0]) / model.r) * &row;
        power = &model.f * power;
        forced = &model.f * forced + Scale(*u) * ColRef::from_slice(&model.g);
    }
    let expected = power * information.partial_piv_lu().solve(&right) + forced;
    let mut filter = Kalman::time_varying(&model, p0.as_ref(), 40).unwrap();
    filter.run(&u, &y, &x0, |_, _| ()).unwrap();
    for i in 0..3 {
        assert!((filter.state()[i] - expected[i]).abs() < 1e-10);
    }
}

/// The likelihood from the innovations is that of y's joint normal density. The covariance of y is built from the map
/// from x(0) and all noises to y.
#[test]
fn likelihood_is_the_joint_density() {
    let mut random = Random(8);
    let model = model(&definite(&mut random, 3), COLOURED);
    let p0 = model.initial_covariance(definite(&mut random, 3).as_ref()).unwrap();
    let (m, samples) = (model.order(), 12);
    let u = random.vector(samples);
    let x0 = [1.0, 0.0, -1.0];
    let (y, _) = simulate(&model, Col::zeros(m), &u, &mut random);
    let h = ColRef::from_slice(&model.h);
    // Row k of y = mean + map * (independent normal numbers).
    let (start, factor) = (root(&p0), factor(&model));
    let mut state = Mat::<f64>::zeros(m, m + samples * (m + 1));
    state.submatrix_mut(0, 0, m, m).copy_from(&start);
    let mut map = Mat::<f64>::zeros(samples, state.ncols());
    let mut mean = Col::from_fn(m, |i| if i < 3 { x0[i] } else { 0.0 });
    let mut error = Vec::new();
    for k in 0..samples {
        let first = m + k * (m + 1);
        map.row_mut(k).copy_from(h.transpose() * &state);
        map.submatrix_mut(k, first, 1, m + 1)
            .copy_from(factor.submatrix(m, 0, 1, m + 1));
        state = &model.f * state;
        state
            .submatrix_mut(0, first, m, m + 1)
            .copy_from(factor.submatrix(0, 0, m, m + 1));
        error.push(y[k] - h.transpose() * &mean);
        mean = &model.f * mean + Scale(u[k]) * ColRef::from_slice(&model.g);
    }
    let covariance = &map * map.transpose();
    let lower = covariance.llt(Side::Lower).unwrap();
    let log_determinant: f64 = (0..samples).map(|i| 2.0 * lower.L()[(i, i)].ln()).sum();
    let error = ColRef::from_slice(&error);
    let square = error.transpose() * lower.solve(error);
    let n = samples as f64;
    let expected = n * ((std::f64::consts::TAU * square / n).ln() + 1.0) + log_determinant;
    let mut filter = Kalman::time_varying(&model, p0.as_ref(), samples).unwrap();
    let found = filter.log_likelihood(&u, &y, &x0).unwrap();
    assert!((found.sigma2 / (square / n) - 1.0).abs() < 1e-11);
    assert!((found.minus_two_log - expected).abs() < 1e-9);
}

/// The estimated ratio is a maximum: the likelihood is lower 2 % to either side. The ratio is near the truth, and
/// negligible if there is no process noise.
#[test]
fn the_ratio_of_the_largest_likelihood() {
    let mut random = Random(9);
    let u = random.vector(3000);
    let x0 = [0.0; 3];
    let observed = ObservedModel { a: &A, b: &B, x0: &x0 };
    for (process, rho) in [
        (ProcessNoise::States, 0.3),
        (ProcessNoise::Input, 0.05),
        (ProcessNoise::Input, 0.0),
    ] {
        let model = |rho: f64, deviation: f64| {
            let q = process.covariance(&B, rho);
            StochasticModel::new(&A, &B, q.as_ref(), MeasurementNoise::white(deviation)).unwrap()
        };
        let (y, _) = simulate(&model(rho * 4.0, 2.0), Col::zeros(3), &u, &mut random);
        let found = maximum_likelihood_ratio(observed, &u, &y, process, WHITE, None).unwrap();
        assert!((found.likelihood.sigma2 / 4.0 - 1.0).abs() < 0.2, "{found:?}");
        if rho == 0.0 {
            assert!(found.rho < 1e-3, "{found:?}");
            continue;
        }
        assert!((found.rho / rho).ln().abs() < 0.4, "{found:?}");
        for factor in [0.98, 1.02] {
            let mut other = Kalman::steady(&model(found.rho * factor, 1.0)).unwrap();
            let other = other.log_likelihood(&u, &y, &x0).unwrap();
            assert!(other.minus_two_log > found.likelihood.minus_two_log);
        }
        let p0 = Mat::<f64>::zeros(3, 3);
        let varying = maximum_likelihood_ratio(observed, &u[..200], &y[..200], process, WHITE, Some(p0.as_ref()));
        assert!((varying.unwrap().rho / rho).ln().abs() < 2.0);
    }
}

#[test]
fn refusals() {
    let zero = Mat::<f64>::zeros(3, 3);
    let refused = |noise| StochasticModel::new(&A, &B, zero.as_ref(), noise).map(|_| ());
    let noise = |numerator, denominator| MeasurementNoise {
        numerator,
        denominator,
        deviation: 1.0,
    };
    assert_eq!(refused(noise(&[0.0, 1.0], &[1.0])), Err(RiccatiError::Variance(0.0)));
    assert_eq!(refused(noise(&[1.0], &[2.0])), Err(RiccatiError::NotMonic(2.0)));
    assert!(matches!(
        refused(noise(&[], &[1.0])),
        Err(RiccatiError::Shape { name: "C", .. })
    ));
    assert_eq!(refused(MeasurementNoise::white(0.0)), Err(RiccatiError::Variance(0.0)));
    let empty = StochasticModel::new(&[], &[], Mat::zeros(0, 0).as_ref(), COLOURED);
    assert!(matches!(empty, Err(RiccatiError::Shape { name: "a", .. })));
    let model = model(&Mat::identity(3, 3), MeasurementNoise::white(1.0));
    let mut filter = Kalman::steady(&model).unwrap();
    let u = [0.0; 3];
    let run = |filter: &mut Kalman, y: &[f64]| filter.run(&u, y, &[0.0; 3], |_, _| ());
    assert_eq!(run(&mut filter, &[0.0, f64::NAN, 0.0]), Err(FailureKind::NonFinite));
    assert_eq!(run(&mut filter, &[0.0; 3]), Ok(()));
    // An exactly predicted record: the likelihood has no maximum.
    let exact = filter.log_likelihood(&u, &[0.0; 3], &[0.0; 3]);
    assert_eq!(exact, Err(FailureKind::NonFinite));
    let observed = ObservedModel {
        a: &A,
        b: &B,
        x0: &[0.0; 3],
    };
    let refused =
        |u: &[f64], y: &[f64]| maximum_likelihood_ratio(observed, u, y, ProcessNoise::States, WHITE, None).unwrap_err();
    assert_eq!(refused(&u, &[0.0; 2]), RatioError::Record);
    assert_eq!(refused(&u, &[0.0; 3]), RatioError::NonFinite);
}
