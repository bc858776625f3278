//! Numbers computed by other programs: references and cases are in `expected_methods.json`.

use super::*;

/// The paper's plant at eta = 10.018 %: an independent computation, compared to the printed digits.
#[test]
fn the_papers_plant() {
    let methods = || {
        [
            Method::named("iv", IvOptions::default()),
            Method::named("oe", OeOptions::default()),
        ]
    };
    let plant = nikolov2023(Numerator::default());
    let cell = |noise: NoiseColour| {
        let process = process(&plant, noise, LevelReading::default());
        CellTheory::new(&process, 10.018, 6, &methods()).unwrap()
    };
    let rms = |theory: &Result<Theory, Missing>| {
        let theory = theory.as_ref().unwrap();
        theory.figure(SmoothMeasure::Ea).unwrap().sqrt_n_rms
    };
    let trace = |theory: &Result<Theory, Missing>| theory.as_ref().unwrap().trace;
    let is = |found: f64, printed: f64| {
        assert!((found - printed).abs() <= 5.001e-4, "{found} {printed}");
    };

    let coloured = cell(NoiseColour::InverseDenominator);
    let [ls, iv] = [&coloured.outputs[0].1, &coloured.outputs[4].1];
    assert!(ls.as_ref().unwrap().is_consistent);
    is(rms(ls), 0.970);
    is(rms(iv), 1.297);
    is(trace(ls), 3.255);
    is(trace(iv), 5.887);
    is(trace(&coloured.shared), 3.255);
    is(trace(&coloured.separate), 5.887);

    let white = cell(NoiseFilter::white().into());
    let ls = white.outputs[0].1.as_ref().unwrap();
    assert!(!ls.is_consistent);
    let limit = ls.figure(SmoothMeasure::Ea).unwrap().limit;
    assert!((limit - 0.8435).abs() <= 5.001e-5, "{limit}");
    is(ls.trace, 6.082);
    is(rms(&white.outputs[1].1), 8.260);
    is(rms(&white.outputs[4].1), 4.741);
    is(rms(&white.optimal_instruments), 4.092);
    is(rms(&white.separate), 4.092);
    is(rms(&white.shared), 4.092);
    is(rms(&white.outputs[5].1), 4.092);

    let level = LevelReading {
        over: LevelOver::Process,
        of: LevelOf::NoiseFree,
    };
    let process = process(&plant, NoiseFilter::white().into(), level);
    let nominal = CellTheory::new(&process, 10.018, 6, &methods()).unwrap();
    is(trace(&nominal.outputs[0].1), 5.985);
}

/// `y = B/A u + C/D e`, u white of variance 1, e of variance lambda: P of (a, b), lower triangle.
fn check(a: [f64; 2], b: [f64; 2], (c, d): (&[f64], &[f64]), lambda: f64, method: Method, expected: [f64; 10]) {
    let plant = StateSpace::from_polynomials(&a, &b).unwrap();
    let noise = NoiseFilter::new(c, d).unwrap();
    let eta = 100.0 * (lambda * noise.variance() / plant.energy().unwrap()).sqrt();
    let settings = ProcessSettings {
        input: Input::new(InputLaw::Gaussian, 1.0, Sequence::default()),
        ..process(&plant, noise.into(), LevelReading::default())
            .settings()
            .clone()
    };
    let process = Process::from_settings(settings).unwrap();
    let theory = CellTheory::new(&process, eta, 2, &[method]).unwrap();
    let is_armax = d.len() == 3;
    let bound = if is_armax { &theory.shared } else { &theory.separate };
    for found in [&theory.outputs[0].1, bound] {
        let p = &found.as_ref().unwrap().asymptotic.covariance;
        let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut expected = expected.iter();
        for i in 0..4 {
            for j in 0..=i {
                let expected = expected.next().unwrap();
                assert!((p[(i, j)] - expected).abs() < 1e-10 * largest, "{i} {j} {p:?}");
            }
        }
    }
}

#[test]
fn output_error_of_second_order() {
    check(
        [-1.5, 0.7],
        [1.0, 0.5],
        (&[1.0], &[1.0]),
        0.64,
        Method::named("oe", OeOptions::default()),
        [
            0.020628747404842548,
            -0.016009635986157796,
            0.013737794325258408,
            -0.03373835294117386,
            0.014455905882351069,
            0.4863359999999954,
            0.09396286505189588,
            -0.05904107128027128,
            -0.5656743529411652,
            0.9011689826989318,
        ],
    );
}

#[test]
fn armax_of_second_order() {
    check(
        [-1.5, 0.7],
        [1.0, 0.5],
        (&[1.0, -1.0, 0.2], &[1.0, -1.5, 0.7]),
        0.49,
        Method::named("armax", ArmaxOptions::default()),
        [
            0.04674833012166969,
            -0.037296957004627596,
            0.03293861954679387,
            -0.013776311886474924,
            0.00670325998226228,
            0.4802373263272005,
            0.11476176444743488,
            -0.07447933592700504,
            -0.44883404654640124,
            0.843805652270396,
        ],
    );
}

#[test]
fn box_jenkins_of_second_order() {
    check(
        [-1.2, 0.52],
        [1.0, 0.5],
        (&[1.0, 0.6], &[1.0, -0.8]),
        0.25,
        Method::named("bj", BjOptions::default()),
        [
            0.1577448998057792,
            -0.13785716511777985,
            0.15620810441728736,
            0.038553993726059235,
            -0.05584428219709034,
            0.24158128958640065,
            0.174632746473742,
            -0.1706393299632622,
            0.089017444607568,
            0.4208461978594016,
        ],
    );
}
