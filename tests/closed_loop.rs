//! Closed loops, random plants and measured inputs against theory.

use asobench::data::{
    Feedback, NoiseColour, OutputFeedback, PlantSource, Process, ProcessError, ProcessSettings, Realisation,
};
use asobench::estimator::{
    Estimator, FailureKind, InstrumentSource, InstrumentalVariables, IvOptions, LeastSquares, Pass, SetupError, Shape,
    Solver, Stabilise, Stage, StartState, Window,
};
use asobench::observer::Gain;
use asobench::plant::{PoleFinder, StateSpace};
use asobench::signal::{Input, InputLaw, LevelOf, LevelOver, LevelReading, NoiseFilter, Sequence};
use asobench::study::file::ExperimentFile;
use asobench::study::{Experiment, LoopModel, Measure, StateFeedback, Trial};

const SEED: u64 = 2023;

/// A(q) = 1 - 1.5 q^-1 + 0.7 q^-2, B(q) = q^-1 + 0.5 q^-2.
fn plant() -> StateSpace {
    let (alpha, beta) = ([-1.5, 0.7], [1.0, 0.5]);
    StateSpace::from_polynomials(&alpha, &beta).unwrap()
}

fn settings(noise: &str, feedback: Feedback) -> ProcessSettings {
    ProcessSettings {
        plant: plant().into(),
        x0: vec![1.0; 2],
        x0_deviation: 0.0,
        input: Input::new(InputLaw::Signs, 1.0, Sequence::Independent),
        noise: noise.parse().unwrap(),
        level: LevelReading::default(),
        input_noise: 0.0,
        process_noise: 0.0,
        state_noise: None,
        feedback,
        change: None,
    }
}

fn output(law: &str) -> Feedback {
    Feedback::Output(law.parse().unwrap())
}

fn state_feedback(pilot: usize) -> Feedback {
    let law = StateFeedback {
        k: vec![0.1, 0.2],
        pilot,
        model: LoopModel::default(),
        gain: Gain::DeadBeat,
        solver: Solver::Qr,
    };
    Feedback::Controlled(law.law().unwrap())
}

fn process(settings: ProcessSettings) -> Process {
    Process::from_settings(settings).unwrap()
}

fn draw(process: &Process, trial: u64, eta: f64, samples: usize) -> Realisation {
    let mut record = Realisation::default();
    process.realise(SEED, trial, eta, samples, samples, &mut record);
    record
}

fn window(record: &Realisation) -> Window<'_> {
    Window::with_reference(&record.u, &record.y, &record.r, record.y.len())
}

/// IV with unstable auxiliary models reflected: in a loop, the bias of least squares in white noise can put a pole of
/// its A-hat outside the unit circle, and the instruments of pass 1 then grow to a rank-deficient system.
fn from(instruments: InstrumentSource) -> Box<dyn Fn(Shape) -> Box<dyn Estimator>> {
    let options = IvOptions {
        instruments,
        stabilise: Stabilise::Reflect,
        ..IvOptions::default()
    };
    Box::new(move |shape| Box::new(InstrumentalVariables::new(shape, &options).unwrap()))
}

fn least_squares() -> Box<dyn Fn(Shape) -> Box<dyn Estimator>> {
    Box::new(|shape| Box::new(LeastSquares::new(shape, Solver::default()).unwrap()))
}

/// Errors of (a, h) of the last pass, trial by trial.
fn errors(
    process: &Process,
    make: &dyn Fn(Shape) -> Box<dyn Estimator>,
    passes: usize,
    (eta, samples): (f64, usize),
    trials: u64,
) -> Vec<[f64; 4]> {
    let shape = Shape {
        order: 2,
        window: samples,
    };
    let mut estimator = make(shape);
    let mut passes = vec![Pass::new(2); passes];
    let mut record = Realisation::default();
    let mut errors = Vec::new();
    for trial in 0..trials {
        process.realise(SEED, trial, eta, samples, samples, &mut record);
        assert_eq!(record.failure, None);
        passes.iter_mut().for_each(Pass::clear);
        estimator.estimate(window(&record), &mut passes);
        let pass = passes.last().unwrap();
        assert_eq!(pass.failure, None, "trial {trial}");
        let (truth, pass) = (&record.truth, &pass);
        errors.push([
            pass.a[0] - truth.a[0],
            pass.a[1] - truth.a[1],
            pass.h[0] - truth.h[0],
            pass.h[1] - truth.h[1],
        ]);
    }
    errors
}

/// Means over trials, and the means in units of their standard errors.
fn means(errors: &[[f64; 4]]) -> ([f64; 4], [f64; 4]) {
    let count = errors.len() as f64;
    let mean = |i: usize| errors.iter().map(|e| e[i]).sum::<f64>() / count;
    let means = [0, 1, 2, 3].map(mean);
    let scaled = [0, 1, 2, 3].map(|i| {
        let squares = errors.iter().map(|e| (e[i] - means[i]).powi(2));
        means[i] / (squares.sum::<f64>() / (count - 1.0) / count).sqrt()
    });
    (means, scaled)
}

fn median_size(errors: &[[f64; 4]]) -> f64 {
    let sizes = errors.iter().map(|e| e.iter().map(|e| e * e).sum::<f64>());
    let mut sizes: Vec<f64> = sizes.map(f64::sqrt).collect();
    sizes.sort_by(f64::total_cmp);
    sizes[sizes.len() / 2]
}

const ALL_SOLVERS: &[Solver] = Solver::ALL;

/// Failures of least squares and IV (from u and from r) by every solver but `dual`, which hides rank deficiency.
fn failures(record: &Realisation, order: usize) -> Vec<(Solver, Option<FailureKind>)> {
    let shape = Shape {
        order,
        window: record.y.len(),
    };
    let mut kinds = Vec::new();
    for &solver in ALL_SOLVERS {
        if solver == Solver::Dual {
            continue;
        }
        let mut passes = vec![Pass::new(order); 2];
        let mut least_squares = LeastSquares::new(shape, solver).unwrap();
        least_squares.estimate(window(record), &mut passes[..1]);
        kinds.push((solver, passes[0].failure.map(|failure| failure.kind)));
        for &instruments in InstrumentSource::ALL {
            if solver == Solver::Cholesky {
                continue;
            }
            let options = IvOptions {
                solver,
                instruments,
                ..IvOptions::default()
            };
            let mut estimator = InstrumentalVariables::new(shape, &options).unwrap();
            estimator.estimate(window(record), &mut passes);
            kinds.push((solver, passes[1].failure.map(|failure| failure.kind)));
        }
    }
    kinds
}

/// C7, r = 0: u = -K y makes the columns of y and u proportional, and nothing is identifiable.
#[test]
fn static_feedback_without_a_reference_is_rank_deficient() {
    for law in ["0.5", "0.3", "-0.1"] {
        for noise in ["white", "1/A"] {
            let mut settings = settings(noise, output(law));
            settings.input = Input::new(InputLaw::Signs, 0.0, Sequence::Independent);
            let process = process(settings);
            for trial in 0..20 {
                let record = draw(&process, trial, 10.0, 120);
                assert!(record.scale > 0.0 && record.r.iter().all(|r| *r == 0.0));
                for (solver, kind) in failures(&record, 2) {
                    let typed = [Some(FailureKind::RankDeficient), Some(FailureKind::Singular)];
                    assert!(typed.contains(&kind), "{law} {noise} {solver}: {kind:?}");
                }
            }
        }
    }
}

/// C7 with r: instruments from r are consistent in any noise. Means of the errors within 4 standard errors of zero at
/// N = 8000; medians of their size fall like N^-1/2 (by 4 from N = 500; each median's standard error is about
/// 1.25 * 0.4 / sqrt(400) = 2.5 % of it, so 15 % are four of their ratio's).
#[test]
fn instruments_from_the_reference_are_consistent() {
    for (name, feedback) in [
        ("K", output("0.3")),
        ("K(q)", output("0.3,-0.1/1,-0.5")),
        ("xhat", state_feedback(200)),
    ] {
        for noise in ["white", "1/A"] {
            let process = process(settings(noise, feedback.clone()));
            let make = from(InstrumentSource::Reference);
            let long = errors(&process, &make, 5, (20.0, 8000), 400);
            let (_, scaled) = means(&long);
            assert!(scaled.iter().all(|s| s.abs() < 4.0), "{name} {noise}: {scaled:?}");
            let short = errors(&process, &make, 5, (20.0, 500), 400);
            let ratio = median_size(&short) / median_size(&long);
            assert!((ratio / 4.0 - 1.0).abs() < 0.15, "{name} {noise}: {ratio}");
        }
    }
}

/// C7: instruments from u are biased where the equation error A(q) f is not white, by an amount that grows as
/// eta^2; where it is white (noise 1/A) they are not, and neither is least squares.
#[test]
fn instruments_from_the_input_are_biased_by_coloured_equation_error() {
    let coloured = process(settings("white", output("0.3")));
    let make = from(InstrumentSource::Input);
    let (mild, mild_scaled) = means(&errors(&coloured, &make, 5, (10.0, 8000), 400));
    let (strong, scaled) = means(&errors(&coloured, &make, 5, (20.0, 8000), 400));
    assert!(scaled.iter().any(|s| s.abs() > 20.0), "{scaled:?}");
    // The largest component, whose mean is known best.
    let largest = (0..4).max_by(|&i, &j| mild_scaled[i].abs().total_cmp(&mild_scaled[j].abs()));
    let largest = largest.unwrap();
    let ratio = strong[largest] / mild[largest];
    let deviation = 4.0 * (1.0 / mild_scaled[largest].abs() + 1.0 / scaled[largest].abs());
    // The next term is of relative size eta^2 = 4 %.
    assert!((ratio / 4.0 - 1.0).abs() < deviation + 0.1, "{ratio} {deviation}");

    let white = process(settings("1/A", output("0.3")));
    let (_, scaled) = means(&errors(&white, &make, 5, (20.0, 8000), 400));
    assert!(scaled.iter().all(|s| s.abs() < 4.0), "iv in 1/A: {scaled:?}");
    let (_, scaled) = means(&errors(&white, &least_squares(), 1, (20.0, 8000), 400));
    assert!(scaled.iter().all(|s| s.abs() < 4.0), "ls in 1/A: {scaled:?}");
    let (_, scaled) = means(&errors(&coloured, &least_squares(), 1, (20.0, 8000), 400));
    assert!(scaled.iter().any(|s| s.abs() > 20.0), "ls in white: {scaled:?}");
}

/// The record obeys `D(q) (r - u) = C(q) y`, the plant's equation and the noise level, which is that of the loop
/// without noise.
#[test]
fn output_feedback_obeys_its_equations() {
    let (c, d) = ([0.3, -0.1], [1.0, -0.5]);
    let law = OutputFeedback::new(&c, &d).unwrap();
    assert_eq!(law.to_string().parse::<OutputFeedback>().unwrap(), law);
    let process = process(settings("1/A", Feedback::Output(law)));
    let record = draw(&process, 3, 15.0, 300);
    let mut y0 = vec![0.0; 300];
    let mut states = vec![0.0; 600];
    plant().simulate(&mut [1.0; 2], &record.u0, &mut y0, &mut states);
    assert_eq!(record.states, states);
    assert_eq!((&record.u, record.origin), (&record.u0, 0));
    for k in 0..300 {
        let fed_back = |k: usize| record.r[k] - record.u[k];
        let left = fed_back(k) + if k > 0 { d[1] * fed_back(k - 1) } else { 0.0 };
        let right = c[0] * record.y[k] + if k > 0 { c[1] * record.y[k - 1] } else { 0.0 };
        assert!((left - right).abs() < 1e-12, "k = {k}");
        let y = y0[k] + record.scale * record.f[k];
        assert!((record.y[k] - y).abs() < 1e-12, "k = {k}");
    }
    let quiet = draw(&process, 3, 0.0, 300);
    assert_eq!(quiet.y, quiet.y0);
    let deviation = |values: &[f64]| asobench::signal::arithmetic::variance(values).sqrt();
    let eta = 100.0 * record.scale * deviation(&record.f) / deviation(&quiet.y0);
    assert!((eta - 15.0).abs() < 1e-12, "{eta}");
}

/// Without noise the identified model is the plant, so `u(k) = r(k) - k'x(k)` from the record's first sample on;
/// the record begins at N1, where its truth is.
#[test]
fn state_feedback_closes_the_loop_at_the_first_sample() {
    let closed = process(settings("white", state_feedback(50)));
    let record = draw(&closed, 4, 0.0, 200);
    assert_eq!((record.origin, record.failure), (50, None));
    for (k, x) in record.states.chunks(2).enumerate() {
        let expected = record.r[k] - 0.1 * x[0] - 0.2 * x[1];
        assert!((record.u[k] - expected).abs() < 1e-10, "k = {k}");
    }
    assert_eq!(record.truth.x0, record.states[..2]);
    let open = draw(&process(settings("white", Feedback::None)), 4, 0.0, 250);
    assert_eq!(record.r, open.u[50..]);
    assert_eq!(record.truth.x0, open.states[100..102]);
    assert_eq!(record.u.len(), 200);
    // The same buffers serve another process, and the same one again.
    let mut again = record.clone();
    process(settings("white", state_feedback(60))).realise(SEED, 4, 5.0, 100, 100, &mut again);
    assert_eq!((again.origin, again.y.len()), (60, 100));
    closed.realise(SEED, 4, 0.0, 200, 200, &mut again);
    assert_eq!((again.u, again.y), (record.u, record.y));
}

/// The state that is fed back, by a plain simulation of the same trial: the pilot's record is that of the open loop,
/// whose model is the plant or least squares on the pilot's samples; the dead-beat gain of order 2 is (a_2, a_1 +
/// a_2^2). Errors of the state that is fed back are those of a trial's row.
#[test]
fn the_state_that_is_fed_back_is_scored() {
    const PILOT: usize = 50;
    let file = |model: &str, eta: f64| {
        ExperimentFile::parse(&format!(
            "measures = ['e_x_fed_back_max', 'e_x_fed_back_rms', 'e_x_max']
            seed = {SEED}
            [settings]
            plant = 'mine'
            noise = 'white'
            feedback = 'state'
            eta = {eta}
            amplitude = 1
            window = 100
            horizon = 150
            x0 = 1
            [plants.mine]
            a = [-0.7, 1.5]
            b = [1.0, 2.0]
            [feedbacks.state]
            state_gain = [0.1, 0.2]
            identify = {PILOT}
            model = '{model}'"
        ))
    };
    for (model, eta) in [("identified", 10.0), ("true", 10.0), ("identified", 0.0), ("true", 0.0)] {
        let experiment = Experiment::new(file(model, eta).unwrap()).unwrap();
        let mut trial = Trial::new(&experiment, &experiment.cells[0]).unwrap();
        trial.run(3).unwrap();
        let found = trial.record();
        let record = found.realisation;
        let mut open = settings("white", Feedback::None);
        open.plant = plant().into();
        let pilot = draw(&process(open), 3, eta, PILOT);
        let (a, b, x0) = if model == "true" {
            (vec![-0.7, 1.5], vec![1.0, 2.0], vec![1.0; 2])
        } else {
            let shape = Shape {
                order: 2,
                window: PILOT,
            };
            let mut passes = vec![Pass::new(2)];
            let mut estimator = LeastSquares::new(shape, Solver::default()).unwrap();
            estimator.estimate(window(&pilot), &mut passes);
            let Pass { a, b, x0, .. } = passes.remove(0);
            (a, b, x0)
        };
        let gain = [a[1], a[0] + a[1] * a[1]];
        let mut x_hat = [x0[0], x0[1]];
        let advance = |x_hat: &mut [f64; 2], u: f64, y: f64| {
            let error = y - x_hat[0];
            *x_hat = [
                x_hat[1] + b[0] * u + gain[0] * error,
                a[0] * x_hat[0] + a[1] * x_hat[1] + b[1] * u + gain[1] * error,
            ];
        };
        for (u, y) in pilot.u.iter().zip(&pilot.y) {
            advance(&mut x_hat, *u, *y);
        }
        let (mut largest, mut sum) = (0.0_f64, 0.0);
        for (k, x) in record.states.chunks(2).enumerate() {
            let input = record.r[k] - 0.1 * x_hat[0] - 0.2 * x_hat[1];
            assert!((record.u[k] - input).abs() < 1e-9, "{model} {eta} k = {k}");
            let error = (x[0] - x_hat[0]).hypot(x[1] - x_hat[1]) / x[0].hypot(x[1]);
            largest = largest.max(error);
            sum += error * error;
            advance(&mut x_hat, record.u[k], record.y[k]);
        }
        let rms = (sum / 150.0).sqrt();
        for row in found.rows {
            let max = row[Measure::FedBackMax];
            assert!(
                (max - largest).abs() < 1e-9 * largest.max(1.0),
                "{model} {eta}: {max} {largest}"
            );
            let found = row[Measure::FedBackRms];
            assert!((found - rms).abs() < 1e-9, "{model} {eta}: {found} {rms}");
        }
        assert_eq!(largest < 1e-9, eta == 0.0, "{model} {eta}: {largest}");
    }
}

/// A pilot record from which nothing can be identified fails the whole trial, typed; no number is printed.
#[test]
fn a_failed_pilot_identification_fails_every_output() {
    let file = ExperimentFile::parse(
        "[settings]
        plant = 'mine'
        noise = 'white'
        feedback = 'state'
        eta = 10
        amplitude = 0
        window = 100
        horizon = 150
        [plants.mine]
        a = [-0.7, 1.5]
        h = [1.0, 0.5]
        [feedbacks.state]
        state_gain = [0.1, 0.2]
        identify = 50",
    );
    let experiment = Experiment::new(file.unwrap()).unwrap();
    assert_eq!(experiment.outputs().len(), 5);
    let mut trial = Trial::new(&experiment, &experiment.cells[0]).unwrap();
    let rows = trial.run(0).unwrap();
    assert_eq!(rows.len(), 5);
    for row in rows {
        let failure = row.failure.unwrap();
        assert_eq!((failure.kind, failure.stage), (FailureKind::Singular, Stage::Data));
        assert!(row[asobench::study::Measure::Ea].is_nan());
    }
    assert!(trial.record().realisation.y.iter().all(|y| y.is_nan()));
}

/// A loop that overflows gives data that no estimator takes for numbers.
#[test]
fn a_diverging_loop_is_typed() {
    let process = process(settings("white", output("-5")));
    let record = draw(&process, 0, 10.0, 2000);
    assert!(record.y.iter().any(|y| !y.is_finite()));
    for (solver, kind) in failures(&record, 2) {
        assert_eq!(kind, Some(FailureKind::NonFinite), "{solver}");
    }
}

/// Poles uniform on the disc: E |p|^2 = radius^2 / 2 for a complex pair, radius^2 / 3 for the real one; b standard
/// normal; and the noise `1/A` is that of the trial's own plant: A(q) f is white of unit variance.
#[test]
fn random_plants_have_the_stated_moments() {
    let mut settings = settings("1/A", Feedback::None);
    settings.plant = PlantSource::Random { order: 3, radius: 0.8 };
    settings.x0 = vec![0.0; 3];
    let process = process(settings);
    let (trials, mut poles) = (4000_u32, PoleFinder::new(3));
    let (mut pairs, mut reals, mut b, mut white) = (0.0, 0.0, 0.0, [0.0; 2]);
    for trial in 0..trials {
        let record = draw(&process, u64::from(trial), 10.0, 43);
        let truth = &record.truth;
        for pole in poles.poles(&truth.a) {
            let square = pole.norm().powi(2);
            if pole.im == 0.0 {
                reals += square;
            } else {
                pairs += square / 2.0;
            }
        }
        b += truth.b.iter().map(|b| b * b).sum::<f64>() / 3.0;
        let v = |k: usize| {
            let lags = 1..=3;
            record.f[k] - lags.map(|i| truth.a[3 - i] * record.f[k - i]).sum::<f64>()
        };
        for k in 4..43 {
            white[0] += v(k) * v(k) / 39.0;
            white[1] += v(k) * v(k - 1) / 39.0;
        }
    }
    let count = f64::from(trials);
    // Variances: |p|^2 uniform on (0, r^2): r^4 / 12; x^2 of x uniform: r^4 (1/5 - 1/9); normal squares: 2.
    for (what, sum, expected, variance) in [
        ("pairs", pairs, 0.32, 0.4096 / 12.0),
        ("reals", reals, 0.64 / 3.0, 0.4096 * (0.2 - 1.0 / 9.0)),
        ("b", b, 1.0, 2.0 / 3.0),
        ("variance of A f", white[0], 1.0, 2.0 / 39.0),
        ("covariance of A f", white[1], 0.0, 1.0 / 39.0),
    ] {
        let error = (sum / count - expected) / (variance / count).sqrt();
        assert!(error.abs() < 4.5, "{what}: {error} standard errors");
    }
}

/// The measured input has the stated noise; the plant knows nothing of it; and nothing else changes.
#[test]
fn input_measurement_noise_has_its_level() {
    const COUNT: usize = 100_000;
    for feedback in [Feedback::None, output("0.3")] {
        let exact = process(settings("white", feedback.clone()));
        let mut noisy = settings("white", feedback);
        noisy.input = Input::new(InputLaw::Signs, 10.0, Sequence::Independent);
        let mut ten = noisy.clone();
        noisy.input_noise = 5.0;
        ten.input_noise = 0.0;
        let (record, clean) = (
            draw(&process(noisy), 1, 10.0, COUNT),
            draw(&process(ten), 1, 10.0, COUNT),
        );
        assert_eq!((&record.y, &record.u0), (&clean.y, &clean.u));
        let noise: Vec<f64> = record.u.iter().zip(&record.u0).map(|(u, u0)| u - u0).collect();
        let square = noise.iter().map(|w| w * w).sum::<f64>() / COUNT as f64;
        // 5 % of 10.
        let error = (square / 0.25 - 1.0) / (2.0 / COUNT as f64).sqrt();
        assert!(error.abs() < 4.5, "{error} standard errors");
        let quiet = draw(&exact, 1, 10.0, 50);
        assert_eq!(quiet.u, quiet.u0);
    }
}

/// An order above the plant's leaves Phi without full rank where there is no noise.
#[test]
fn over_order_without_noise_is_rank_deficient() {
    let process = process(settings("white", Feedback::None));
    for trial in 0..20 {
        let record = draw(&process, trial, 0.0, 80);
        for order in [3, 4] {
            for (solver, kind) in failures(&record, order) {
                assert_eq!(kind, Some(FailureKind::RankDeficient), "{order} {solver}");
            }
        }
    }
}

/// `r = u` given as the reference changes no more than rounding; reflection changes nothing of stable models; a zero
/// initial state is reported as such.
#[test]
fn new_readings_of_iv_agree_where_they_should() {
    let process = process(settings("white", Feedback::None));
    let record = draw(&process, 0, 5.0, 300);
    let shape = Shape { order: 2, window: 300 };
    let run = |options: IvOptions| {
        let mut passes = vec![Pass::new(2); 5];
        let mut estimator = InstrumentalVariables::new(shape, &options).unwrap();
        estimator.estimate(window(&record), &mut passes);
        passes
    };
    let plain = run(IvOptions::default());
    for &solver in &[
        Solver::Partitioned,
        Solver::Lu,
        Solver::Qr,
        Solver::Svd,
        Solver::Augmented,
    ] {
        let by_u = run(IvOptions {
            solver,
            ..IvOptions::default()
        });
        let by_r = run(IvOptions {
            solver,
            instruments: InstrumentSource::Reference,
            ..IvOptions::default()
        });
        for (u, r) in by_u.iter().zip(&by_r) {
            let difference = asobench::metric::relative_error(&u.a, &r.a);
            assert!(
                difference < 1e3 * f64::EPSILON * u.condition,
                "{solver}: {difference:e}"
            );
        }
    }
    let reflected = run(IvOptions {
        stabilise: Stabilise::Reflect,
        ..IvOptions::default()
    });
    assert_eq!(reflected[4].a, plain[4].a);
    let zero = run(IvOptions {
        initial_state: StartState::Zero,
        ..IvOptions::default()
    });
    assert!(zero.iter().all(|pass| pass.x0 == [0.0; 2]));
    assert_eq!(zero[0].a, plain[0].a);
    assert_ne!(zero[1].a, plain[1].a);
}

#[test]
fn refusals() {
    let refused = |settings| Process::from_settings(settings).unwrap_err();
    let mut open = settings("white", Feedback::None);
    open.input = Input::new(InputLaw::Gaussian, 0.0, Sequence::Independent);
    assert_eq!(refused(open.clone()), ProcessError::Amplitude(0.0));
    open.feedback = output("0.5");
    open.input_noise = 1.0;
    assert_eq!(refused(open), ProcessError::InputNoise(1.0, 0.0));
    for level in [
        LevelReading {
            over: LevelOver::Process,
            of: LevelOf::NoiseFree,
        },
        LevelReading {
            over: LevelOver::Window,
            of: LevelOf::Measured,
        },
    ] {
        let mut closed = settings("white", output("0.5"));
        closed.level = level;
        assert!(matches!(refused(closed), ProcessError::LevelWithFeedback { .. }));
    }
    let mut random = settings("1/A", Feedback::None);
    random.plant = PlantSource::Random { order: 2, radius: 1.0 };
    assert_eq!(refused(random), ProcessError::RandomPlant(2, 1.0));
    for text in ["", "a", "1/2", "1/", "nan", "1,2/0.5"] {
        assert!(text.parse::<OutputFeedback>().is_err(), "{text}");
    }
    for text in ["", "grey", "1", "1/1,-1", "1/2"] {
        assert!(text.parse::<NoiseColour>().is_err(), "{text}");
    }
    let colour: NoiseColour = "1,0.5/1,-0.9".parse().unwrap();
    assert_eq!(colour.to_string(), "1,0.5/1,-0.9");
    assert_eq!("white".parse(), Ok(NoiseColour::Filter(NoiseFilter::white())));
    let law = StateFeedback {
        k: vec![0.1; 3],
        pilot: 8,
        model: LoopModel::default(),
        gain: Gain::DeadBeat,
        solver: Solver::Qr,
    };
    assert!(matches!(law.law(), Err(SetupError::ShortWindow(_))));
    let options = IvOptions {
        instruments: InstrumentSource::Reference,
        drive: asobench::estimator::Drive::Observer,
        ..IvOptions::default()
    };
    let shape = Shape { order: 2, window: 50 };
    assert!(InstrumentalVariables::new(shape, &options).is_err());
}
