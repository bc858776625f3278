//! The Fisher information against bounds, against published bounds of finite records, and against finite differences.

use super::*;
use crate::model::Orders;

const ABSOLUTE: LevelReading = LevelReading {
    over: LevelOver::Nothing,
    of: LevelOf::NoiseFree,
};

fn of(a: &[f64], b: &[f64], input: Input, noise: NoiseColour, feedback: Feedback) -> Process {
    let plant = StateSpace::from_polynomials(a, b).unwrap();
    let settings = ProcessSettings {
        input,
        feedback,
        ..process(&plant, noise, ABSOLUTE).settings().clone()
    };
    Process::from_settings(settings).unwrap()
}

fn gaussian(amplitude: f64) -> Input {
    Input::new(InputLaw::Gaussian, amplitude, Sequence::default())
}

/// The deviations at the bound, for some of `alpha_1 ..., beta_1 ...`.
fn deviations(information: &FisherInformation, free: &[usize]) -> Vec<f64> {
    let n = information.matrix.nrows() / 2;
    let column = |i: usize| if i < n { n - 1 - i } else { i };
    let all = free.iter().map(|i| information.deviation(column(*i)).unwrap());
    all.collect()
}

fn close(found: &[f64], expected: &[f64], half_digit: f64) {
    for (found, expected) in found.iter().zip(expected) {
        let apart = (found - expected).abs();
        assert!(apart <= half_digit, "{found} {expected}");
    }
}

/// Finite-record bounds of two output-error plants under sums of sines, to their printed digits (pysib's cases
/// `robustness_noisy_data`, bounds by numerical differentiation).
#[test]
fn given_inputs_have_the_bound_of_their_record() {
    let sines = |terms: [(f64, f64); 3], n: usize| {
        let u = |t: usize| -> f64 {
            let wave = |(size, period): &(f64, f64)| size * (std::f64::consts::TAU * t as f64 / period).sin();
            terms.iter().map(wave).sum()
        };
        Input::Samples((0..n).map(u).collect())
    };
    let white = || NoiseColour::from(NoiseFilter::white());
    let input = sines([(1.0, 18.0), (1.0, 28.0), (1.0, 61.0)], 1000);
    let b = [1.0, 0.0, 0.0];
    let fast = of(&[-2.4, 1.91, -0.504], &b, input, white(), Feedback::None);
    let information = FisherInformation::new(&fast, 100.0, 1000).unwrap();
    assert_eq!(information.orders, "nb=1,nf=3,nk=1".parse().unwrap());
    assert_eq!(information.free(), 4);
    let found = deviations(&information, &[3, 0, 1, 2]);
    close(&found, &[0.00228, 0.00138, 0.00256, 0.00120], 5.001e-6);
    let input = sines([(1.0, 17.0), (0.7, 43.0), (0.4, 97.0)], 500);
    let second = of(&[-1.1, 0.2625], &[1.0, 0.0], input, white(), Feedback::None);
    let information = FisherInformation::new(&second, 10.0, 500).unwrap();
    let found = deviations(&information, &[2, 0, 1]);
    close(&found, &[0.00455, 0.00394, 0.00341], 5.001e-6);
}

/// The ARMAX example of the weighted null-space fitting code, in open loop and in the loop: numbers by another program.
#[test]
fn armax_in_both_loops() {
    let (a, b) = ([-1.5, 0.7], [1.0, 0.5]);
    let noise = || NoiseColour::from(NoiseFilter::new(&[1.0, -0.8, 0.2], &[1.0, -1.5, 0.7]).unwrap());
    let open = of(&a, &b, gaussian(1.0), noise(), Feedback::None);
    let law = OutputFeedback::new(&[0.63, -2.08, 2.82, -1.86, 0.5], &[1.0, -2.65, 3.11, -1.75, 0.39]);
    let closed = of(&a, &b, gaussian(5.0), noise(), Feedback::Output(law.unwrap()));
    for (process, expected) in [
        (open, [0.351, 0.314, 0.990, 1.267]),
        (closed, [0.140, 0.140, 0.174, 0.173]),
    ] {
        let information = FisherInformation::new(&process, 100.0, 1).unwrap();
        let orders: Orders = "na=2,nb=2,nc=2,nk=1".parse().unwrap();
        assert_eq!(information.orders, orders);
        close(&deviations(&information, &[0, 1, 2, 3]), &expected, 5.001e-4);
    }
}

/// F times the bound of the same structure is the identity, also where plant and noise share some poles only.
#[test]
fn the_information_is_the_inverse_of_the_bound() {
    for (c, d, orders) in [
        (vec![1.0], vec![1.0, -1.5, 0.7], "na=2,nb=2,nk=1"),
        (vec![1.0, 0.6], vec![1.0, -0.8], "nb=2,nc=1,nd=1,nf=2,nk=1"),
    ] {
        let noise = NoiseFilter::new(&c, &d).unwrap();
        let process = of(&[-1.5, 0.7], &[1.0, 0.5], gaussian(2.0), noise.into(), Feedback::None);
        let information = FisherInformation::new(&process, 50.0, 300).unwrap();
        assert_eq!(information.orders, orders.parse().unwrap());
        let theory = CellTheory::new(&process, 50.0, 2, &[]).unwrap();
        let bound = theory.shared.unwrap().asymptotic.covariance;
        let product = &information.matrix * &bound;
        for i in 0..4 {
            for j in 0..4 {
                let expected = if i == j { 300.0 } else { 0.0 };
                let tolerance = 1e-7 * product.norm_max();
                assert!((product[(i, j)] - expected).abs() < tolerance, "{i} {j} {product:?}");
            }
        }
    }
}

/// A delay and zeros at the ends are not counted; d is the quadratic form in the paper's order of coefficients.
#[test]
fn free_coefficients_and_the_distance() {
    let white = NoiseFilter::white();
    let process = of(
        &[-0.5, 0.0, 0.0],
        &[0.0, 0.6, -0.2],
        gaussian(1.0),
        white.into(),
        Feedback::None,
    );
    let information = FisherInformation::new(&process, 30.0, 100).unwrap();
    assert_eq!(information.orders, "nb=2,nf=1,nk=2".parse().unwrap());
    let truth = StateSpace::from_polynomials(&[-0.5, 0.0, 0.0], &[0.0, 0.6, -0.2]).unwrap();
    let (a, h) = (truth.a().to_vec(), truth.h());
    let mut found = (a.clone(), h.clone());
    found.0[2] += 0.01;
    found.1[1] -= 0.02;
    // The step of a_3 is minus that of alpha_1; h_2 is beta_2.
    let f = &information.matrix;
    let square = 1e-4 * f[(0, 0)] + 4e-4 * f[(4, 4)] + 2.0 * 2e-4 * f[(0, 4)];
    let d = information.distance([&found.0, &found.1], [&a, &h]);
    assert!((d - square / 3.0).abs() < 1e-12 * d, "{d} {square}");
    assert!(information.distance([&a[1..], &h], [&a, &h]).is_nan());
    let silent = FisherInformation::new(&process, 0.0, 100);
    assert_eq!(silent.unwrap_err(), Missing::Singular);
}

/// The error of a response over its bound, against sums over a grid of frequencies, which are exact where the responses
/// have decayed within its points: of one model, and the second moment of the law.
#[test]
fn a_response_has_its_bound_over_all_frequencies() {
    const POINTS: usize = 4096;
    let (alpha, beta) = ([-1.5, 0.7], [1.0, 0.5]);
    let white = NoiseColour::from(NoiseFilter::white());
    let process = of(&alpha, &beta, gaussian(1.0), white, Feedback::None);
    let information = FisherInformation::new(&process, 100.0, 500).unwrap();
    let plant = process.plant().unwrap();
    let bound = ResponseBound::new(&information, plant).unwrap();
    let inverse = information.matrix.solve(&Matrix::identity(4));
    let response = |alpha: &[f64], beta: &[f64], z: c64| {
        let denominator = alpha.iter().rev().fold(c64::new(0.0, 0.0), |sum, a| (sum + *a) * z);
        let numerator = beta.iter().rev().fold(c64::new(0.0, 0.0), |sum, b| (sum + *b) * z);
        [numerator, denominator + 1.0]
    };
    let other = ([-1.48, 0.69], [1.02, 0.45]);
    let (mut square, mut gram) = (0.0, Matrix::zeros(4, 4));
    for point in 0..POINTS {
        let angle = -std::f64::consts::TAU * point as f64 / POINTS as f64;
        let z = c64::new(angle.cos(), angle.sin());
        let [b, a] = response(&alpha, &beta, z);
        let [other_b, other_a] = response(&other.0, &other.1, z);
        square += (b / a - other_b / other_a).norm_sqr() / POINTS as f64;
        let slope = [-(b * z) / (a * a), -(b * z * z) / (a * a), z / a, z * z / a];
        for i in 0..4 {
            for j in 0..4 {
                gram[(i, j)] += (slope[i] * slope[j].conj()).re / POINTS as f64;
            }
        }
    }
    let relative = &gram * &inverse;
    let trace = |of: &Matrix| (0..4).map(|i| of[(i, i)]).sum::<f64>();
    let h: Vec<f64> = other.1.to_vec();
    let model = StateSpace::from_polynomials(&other.0, &h).unwrap();
    let found = bound.distance(model.a(), model.b(), 0.0);
    let expected = square / trace(&relative);
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    let second: f64 = bound.weights.iter().map(|w| w * w).sum();
    let expected = trace(&(&relative * &relative)) / trace(&relative).powi(2);
    assert!((second / expected - 1.0).abs() < 1e-9, "{second} {expected}");
    assert!((bound.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    // A direct term adds its square.
    let with_direct = bound.distance(plant.a(), plant.b(), 0.5) * trace(&relative);
    assert!((with_direct - 0.25).abs() < 1e-9, "{with_direct}");
}

/// Noise on the measured input: the information of N samples more by covariances in time
/// (`errors_in_variables.py` beside this file), and what has none.
#[test]
fn a_noisy_input_has_the_information_of_its_spectra() {
    let with_noise = |a: &[f64], b: &[f64], input: Input, noise: NoiseColour, percent: f64| {
        let settings = of(a, b, input, noise, Feedback::None);
        let settings = ProcessSettings {
            input_noise: percent,
            ..settings.settings().clone()
        };
        Process::from_settings(settings).unwrap()
    };
    let white = || NoiseColour::from(NoiseFilter::white());
    type Case = (&'static [f64], &'static [f64], f64, &'static [f64]);
    let cases: [Case; 2] = [
        (
            &[-1.5, 0.7],
            &[1.0, 0.5],
            0.1,
            &[
                7.928384839e+01,
                7.242320267e+01,
                -1.971706656,
                -4.704925837,
                7.242320267e+01,
                7.953632992e+01,
                -6.566721728e-02,
                -1.783401891,
                -1.971706656,
                -6.566721728e-02,
                1.403112374,
                1.052006042,
                -4.704925837,
                -1.783401891,
                1.052006042,
                1.420334242,
            ],
        ),
        (
            &[-0.9],
            &[0.8],
            0.25,
            &[19.094875504, -1.949302172, -1.949302172, 0.93755493],
        ),
    ];
    for (a, b, variance, expected) in cases {
        let percent = 100.0 * f64::sqrt(variance);
        let process = with_noise(a, b, gaussian(1.0), white(), percent);
        let information = FisherInformation::new(&process, 100.0, 1).unwrap();
        assert_eq!(information.free(), 2 * a.len());
        let n = 2 * a.len();
        for (place, expected) in expected.iter().enumerate() {
            let found = information.matrix[(place / n, place % n)];
            // The script's central differences have some 1e-9 of the largest entry.
            assert!(
                (found - expected).abs() < 1e-7 * information.matrix.norm_max(),
                "{found} {expected}"
            );
        }
    }
    let coloured = NoiseColour::InverseDenominator;
    let process = with_noise(&[-0.9], &[0.8], gaussian(1.0), coloured, 50.0);
    let refused = FisherInformation::new(&process, 100.0, 100);
    assert_eq!(refused.err(), Some(Missing::NoisyInput));
}

/// Innovations of heavy tails tell more: `nu (nu + 1) / ((nu - 2) (nu + 3))` times as much, 2 for three degrees of
/// freedom.
#[test]
fn heavy_tails_have_more_information() {
    let made = |noise: NoiseFilter| {
        let (a, b) = ([-1.5, 0.7], [1.0, 0.5]);
        let process = of(&a, &b, gaussian(1.0), noise.into(), Feedback::None);
        FisherInformation::new(&process, 50.0, 300).unwrap()
    };
    let filter = || NoiseFilter::new(&[1.0, 0.6], &[1.0, -0.8]).unwrap();
    let heavy = made(filter().student_t(3).unwrap());
    let normal = made(filter());
    let (heavy, normal) = (&heavy.matrix, &normal.matrix);
    assert!((heavy - &(normal + normal)).norm_max() < 1e-12 * heavy.norm_max());
}
