//! Estimates and bounds of cells of every kind, compared with each other and with a second method.

use super::frequency::{covariance_over_frequency, long_run_over_frequency};
use super::*;
use crate::data::{Change, ChangedPlant};
use crate::theory::canonical::Shape;
use crate::theory::linear::Linear;
use crate::theory::passes::{least_squares, model_instruments, regressors};
use crate::theory::population::NOISE;

fn second_order() -> StateSpace {
    StateSpace::from_polynomials(&[-1.2, 0.52], &[1.0, 0.5]).unwrap()
}

fn noises() -> Vec<NoiseColour> {
    let filter = |c: &[f64], d: &[f64]| NoiseColour::from(NoiseFilter::new(c, d).unwrap());
    vec![
        NoiseColour::InverseDenominator,
        NoiseFilter::white().into(),
        filter(&[1.0, 0.6], &[1.0, -0.8]),
        filter(&[0.0, 2.0, -1.0], &[1.0]),
        // A zero outside the unit circle.
        filter(&[1.0, -1.6], &[1.0, -0.3, 0.2]),
    ]
}

fn loops() -> Vec<Feedback> {
    let law = OutputFeedback::new(&[0.2, -0.1], &[1.0, -0.5]).unwrap();
    vec![Feedback::None, Feedback::Output(law)]
}

/// Processes with every noise, in open and closed loop, with random signs and Gaussian inputs.
fn processes() -> Vec<Process> {
    let mut all = Vec::new();
    for (i, noise) in noises().into_iter().enumerate() {
        for feedback in loops() {
            let law = [InputLaw::Signs, InputLaw::Gaussian][i % 2];
            let settings = ProcessSettings {
                feedback,
                input: Input::new(law, 3.0, Sequence::default()),
                ..process(&second_order(), noise.clone(), LevelReading::default())
                    .settings()
                    .clone()
            };
            all.push(Process::from_settings(settings).unwrap());
        }
    }
    let disturbed = ProcessSettings {
        process_noise: 0.4,
        input_noise: 20.0,
        ..process(
            &second_order(),
            NoiseColour::InverseDenominator,
            LevelReading::default(),
        )
        .settings()
        .clone()
    };
    all.push(Process::from_settings(disturbed).unwrap());
    all
}

const ETA: f64 = 40.0;

fn shape() -> Shape {
    Shape::new(Orders::arx(2, 2, 1))
}

fn close(found: &Matrix, expected: &Matrix, tolerance: f64) {
    let difference = (found - expected).norm_max();
    assert!(difference <= tolerance * expected.norm_max(), "{found:?}\n{expected:?}");
}

/// `W S W'` with S integrated over frequency.
fn over_frequency(sources: &[Source], of: &Influence) -> Matrix {
    let n = of.products.len();
    let s = Matrix::from_fn(n, n, |i, j| {
        long_run_over_frequency(sources, &of.products[i], &of.products[j])
    });
    &(&of.weights * &s) * &of.weights.transpose()
}

/// Limit and covariance of least squares agree with integrals over frequency.
#[test]
fn least_squares_is_what_integrals_over_frequency_say() {
    for process in processes() {
        let population = Population::new(&process, ETA).unwrap();
        let sources = &population.sources;
        let linear = least_squares(&population, shape()).unwrap();
        let phi = regressors(&population.y, &population.u, shape());
        let r = Matrix::from_fn(4, 4, |i, j| covariance_over_frequency(sources, &phi[i], &phi[j]));
        let right = Matrix::from_fn(4, 1, |i, _| covariance_over_frequency(sources, &phi[i], &population.y));
        let limit = r.solve(&right);
        for (i, theta) in linear.theta.iter().enumerate() {
            assert!((theta - limit[(i, 0)]).abs() < 1e-9, "{theta} {limit:?}");
        }
        let found = linear.influence.covariance(sources).unwrap();
        close(&found, &over_frequency(sources, &linear.influence), 1e-9);
    }
}

/// In open loop `P = G^-1 E[z_H z_H'] G^-T`, `z_H = H z` with `v = H w` (Soderstrom and Stoica, chapter 8). G and the
/// middle factor are computed from integrals.
#[test]
fn instruments_in_open_loop_have_the_textbook_covariance() {
    for (noise, auxiliary) in noises()
        .into_iter()
        .zip([[-0.9, 0.3, 1.0, 0.7], [-1.2, 0.52, 1.0, 0.5]].into_iter().cycle())
    {
        let process = process(&second_order(), noise, LevelReading::default());
        let population = Population::new(&process, ETA).unwrap();
        let Population {
            sources,
            y,
            u,
            alpha,
            noise,
            equation_error,
            ..
        } = &population;
        let z = model_instruments(&auxiliary, shape(), u).unwrap();
        let phi = regressors(y, u, shape());
        let truth = shape().truth(&population).unwrap();
        let linear = Linear::new(&population, &z, &phi, y, Some((truth, equation_error))).unwrap();
        assert!(linear.is_consistent);
        let found = linear.influence.covariance(sources).unwrap();
        let filter = crate::model::polynomial::multiply(alpha, &noise.0);
        let filtered: Vec<Signal> = z.iter().map(|z| z.through(&filter, &noise.1)).collect();
        let integrals =
            |a: &[Signal], b: &[Signal]| Matrix::from_fn(4, 4, |i, j| covariance_over_frequency(sources, &a[i], &b[j]));
        let middle = integrals(&filtered, &filtered);
        let variance = sources[NOISE].variance;
        let middle = Matrix::from_fn(4, 4, |i, j| variance * middle[(i, j)]);
        let g = integrals(&z, &phi);
        close(&found, &g.solve(&g.solve(&middle).transpose()), 1e-9);
    }
}

/// The influence of pass 4, whose instruments depend on all passes before, is the derivative of its limit: if the
/// variance of one source changes, the mean of every product changes by the share of that source. In closed loop and
/// with noise on the input the passes are biased. If eta holds in each window, the additional term is the derivative
/// with respect to the noise's factor.
#[test]
fn the_influence_of_a_pass_is_the_derivative_of_its_limit() {
    for auxiliary in Auxiliary::ALL {
        for instruments in InstrumentSource::ALL {
            for process in processes() {
                let options = IvOptions {
                    auxiliary: *auxiliary,
                    instruments: *instruments,
                    ..IvOptions::default()
                };
                let population = Population::new(&process, ETA).unwrap();
                let of = |population: &Population| Passes::new(population, &options, 2).last_of(4).unwrap();
                let (_, influence) = of(&population);
                for source in 0..population.sources.len() {
                    const STEP: f64 = 1e-4;
                    let moved = |step: f64| {
                        let mut moved = population.clone();
                        moved.sources[source].variance *= 1.0 + step;
                        of(&moved).0
                    };
                    let (up, down) = (moved(STEP), moved(-STEP));
                    for i in 0..4 {
                        let slope = (up[i] - down[i]) / (2.0 * STEP);
                        check_slope(&population, &influence, i, source, slope);
                    }
                }
            }
        }
    }
}

/// Compares row i of the influence with the derivative of theta_i with respect to the log of a source's variance.
fn check_slope(population: &Population, influence: &Influence, i: usize, source: usize, slope: f64) {
    let mut sum = 0.0;
    for (j, (a, b)) in influence.products.iter().enumerate() {
        let weight = influence.weights[(i, j)];
        let level = population.level.iter().find(|(_, c, d)| (c, d) == (a, b));
        if let Some((of_level, ..)) = level {
            if source == NOISE {
                let expected = 2.0 * slope * of_level;
                let size = of_level.abs().max(1e-3);
                assert!((weight - expected).abs() < 1e-5 * size, "{weight} {expected}");
            }
            continue;
        }
        let [a, b] = [a, b].map(|x| [x.from_source(source)]);
        sum += weight * covariance(&population.sources, &a, &b).unwrap()[(0, 0)];
    }
    assert!((slope - sum).abs() < 1e-6, "{slope} {sum}");
}

/// Methods that agree in the limit do so, and bounds are below all consistent estimates.
#[test]
fn methods_and_bounds_agree_where_they_must() {
    for process in processes() {
        let orders = |text: &str| Some(text.parse().unwrap());
        let methods = [
            Method::named("ls", LsOptions::default()),
            Method::named(
                "arx",
                ArxOptions {
                    orders: orders("na=2,nb=2,nk=1"),
                    ..ArxOptions::default()
                },
            ),
            Method::named("oe", OeOptions::default()),
            Method::named("sriv", SrivOptions::default()),
            Method::named("iv4", Iv4Options::default()),
            Method::named("iv-delayed", IvDelayedOptions::default()),
            Method::named("armax", ArmaxOptions::default()),
            Method::named(
                "bj",
                BjOptions {
                    orders: orders("nb=2,nc=1,nd=2,nf=2"),
                    ..BjOptions::default()
                },
            ),
        ];
        let theory = CellTheory::new(&process, ETA, 2, &methods).unwrap();
        let p = |theory: &Result<Theory, Missing>| theory.as_ref().ok().map(|t| t.asymptotic.covariance.clone());
        let outputs: Vec<_> = theory.outputs.iter().map(|(_, theory)| p(theory)).collect();
        close(outputs[0].as_ref().unwrap(), outputs[1].as_ref().unwrap(), 1e-9);
        if let (Some(oe), Some(sriv)) = (&outputs[2], &outputs[3]) {
            close(oe, sriv, 1e-9);
        }
        let open = matches!(process.settings().feedback, Feedback::None);
        let plain = process.settings().process_noise == 0.0;
        assert_eq!([&theory.shared, &theory.separate].map(Result::is_ok), [plain; 2]);
        let (Some(shared), Some(separate)) = (p(&theory.shared), p(&theory.separate)) else {
            continue;
        };
        let white_equation = process.settings().noise == NoiseColour::InverseDenominator;
        if white_equation {
            close(outputs[0].as_ref().unwrap(), &shared, 1e-9);
        }
        if open {
            close(&p(&theory.optimal_instruments).unwrap(), &separate, 1e-8);
            if let Some(bj) = &outputs[7] {
                close(bj, &separate, 1e-8);
            }
        }
        let bound = if white_equation { &shared } else { &separate };
        for ((label, theory), covariance) in theory.outputs.iter().zip(&outputs) {
            let Some(covariance) = covariance.as_ref().filter(|_| theory.as_ref().unwrap().is_consistent) else {
                continue;
            };
            let values = (covariance - bound).symmetric_eigenvalues().unwrap();
            let least = -1e-8 * covariance.norm_max();
            assert!(values.iter().all(|of| *of > least), "{label} {values:?}");
        }
    }
}

/// Bounds from integrals of spectra; a zero of the noise outside the unit circle is reflected by hand.
#[test]
fn the_bound_of_noise_with_a_zero_outside() {
    let filter = |c: &[f64]| NoiseColour::from(NoiseFilter::new(c, &[1.0, -0.3]).unwrap());
    let theory = |c: &[f64]| {
        let process = process(&second_order(), filter(c), LevelReading::default());
        let theory = CellTheory::new(&process, ETA, 2, &[]).unwrap();
        theory.separate.unwrap().asymptotic.covariance
    };
    close(&theory(&[1.0, -2.0]), &theory(&[2.0, -1.0]), 1e-12);
    close(&theory(&[0.0, 1.0, -2.0]), &theory(&[-6.0, 3.0]), 1e-12);
}

/// e_a and e_h from P's blocks, e_b and e_g by differences.
#[test]
fn measures_by_differences() {
    let process = process(&second_order(), NoiseFilter::white().into(), LevelReading::default());
    let methods = [Method::named("oe", OeOptions::default())];
    let theory = CellTheory::new(&process, ETA, 2, &methods).unwrap();
    let theory = theory.outputs[0].1.as_ref().unwrap();
    let p = &theory.asymptotic.covariance;
    let vector = |p: &[f64], measure: SmoothMeasure| -> Vec<f64> {
        let plant = StateSpace::from_polynomials(&p[..2], &p[2..]).unwrap();
        match measure {
            SmoothMeasure::Ea => plant.a().to_vec(),
            SmoothMeasure::Eb => plant.b().to_vec(),
            SmoothMeasure::Eh => plant.h(),
            SmoothMeasure::ImpulseResponse => {
                let u: Vec<f64> = (0..201).map(|k| f64::from(u8::from(k == 0))).collect();
                let (mut y, mut states) = (vec![0.0; 201], vec![0.0; 402]);
                plant.simulate(&mut [0.0; 2], &u, &mut y, &mut states);
                y[1..].to_vec()
            }
        }
    };
    let truth = theory.asymptotic.p.clone();
    for measure in SmoothMeasure::ALL {
        let v = vector(&truth, *measure);
        const STEP: f64 = 1e-5;
        let column = |j: usize| -> Vec<f64> {
            let at = |step: f64| {
                let mut p = truth.clone();
                p[j] += step;
                vector(&p, *measure)
            };
            let pairs = at(STEP).into_iter().zip(at(-STEP));
            pairs.map(|(up, down)| (up - down) / (2.0 * STEP)).collect()
        };
        let columns: Vec<Vec<f64>> = (0..4).map(column).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let pairs = (0..4).flat_map(|i| (0..4).map(move |j| (i, j)));
        let square: f64 = pairs.map(|(i, j)| p[(i, j)] * dot(&columns[i], &columns[j])).sum();
        let expected = (square / dot(&v, &v)).sqrt();
        let found = theory.figure(*measure).unwrap();
        assert!((found.sqrt_n_rms / expected - 1.0).abs() < 1e-7, "{measure}");
        assert!(found.limit < 1e-12);
        let [low, middle, high] = [0.1, 0.5, 0.9].map(|p| found.quantile(p));
        assert!(low < middle && middle < high && middle < expected);
    }
}

#[test]
fn cells_without_theory_say_why() {
    let why = |settings: ProcessSettings| {
        let process = Process::from_settings(settings).unwrap();
        Population::new(&process, ETA).unwrap_err()
    };
    let base = || {
        process(&second_order(), NoiseFilter::white().into(), LevelReading::default())
            .settings()
            .clone()
    };
    let unstable = StateSpace::new(vec![1.5], vec![1.0]).unwrap();
    let random = PlantSource::Random { order: 2, radius: 0.9 };
    for (settings, expected) in [
        (
            ProcessSettings {
                plant: random,
                ..base()
            },
            NoTheory::RandomPlant,
        ),
        (
            ProcessSettings {
                change: Some(Change {
                    to: ChangedPlant::Plant(second_order()),
                    at: 10,
                    over: 0,
                }),
                ..base()
            },
            NoTheory::ChangingPlant,
        ),
        (
            ProcessSettings {
                input: Input::new(InputLaw::Signs, 1.0, Sequence::Periodic127),
                ..base()
            },
            NoTheory::PeriodicInput,
        ),
        (
            ProcessSettings {
                plant: unstable.into(),
                x0: vec![0.0],
                ..base()
            },
            NoTheory::UnstablePlant,
        ),
        (
            ProcessSettings {
                feedback: Feedback::Output(OutputFeedback::new(&[-5.0], &[1.0]).unwrap()),
                ..base()
            },
            NoTheory::UnstableLoop,
        ),
    ] {
        assert_eq!(why(settings), expected);
    }
}

/// `ds/s` from the level's weights agrees with [`LevelReading::scale`]. p and q have mean 0, variance 1 and
/// covariance 0.
#[test]
fn the_level_in_a_window_moves_as_its_weights_say() {
    let (p, q) = ([1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]);
    let unused = crate::signal::ProcessVariances {
        output: 0.0,
        noise: 0.0,
    };
    for of in [LevelOf::NoiseFree, LevelOf::Measured] {
        let level = LevelReading {
            over: LevelOver::Window,
            of,
        };
        let process = process(&second_order(), NoiseFilter::white().into(), level);
        let population = Population::new(&process, ETA).unwrap();
        let variance = |signal: &Signal| {
            let one = std::slice::from_ref(signal);
            covariance(&population.sources, one, one).unwrap()[(0, 0)]
        };
        let (output, noise) = (variance(&population.level[0].1), population.sources[NOISE].variance);
        let scale = |output_more: f64, noise_more: f64, cross: f64| {
            let size = (output * (1.0 + output_more)).sqrt();
            let y0 = p.map(|p| size * p);
            let f: [f64; 4] = std::array::from_fn(|k| (1.0 + noise_more).sqrt() * q[k] + cross * p[k]);
            level.scale(ETA, &y0, &f, unused)
        };
        let s = scale(0.0, 0.0, 0.0);
        assert!((s * s / noise - 1.0).abs() < 1e-12);
        const STEP: f64 = 1e-6;
        // The means of the products change by STEP times these.
        let moves = [output, noise, s * output.sqrt()];
        let moved = [scale(STEP, 0.0, 0.0), scale(0.0, STEP, 0.0), scale(0.0, 0.0, STEP)];
        for (i, (weight, ..)) in population.level.iter().enumerate() {
            let found = (moved[i] / s - 1.0) / STEP;
            assert!((found - weight * moves[i]).abs() < 1e-5, "{of} {i} {found}");
        }
        assert_eq!(population.level.len(), if of == LevelOf::Measured { 3 } else { 2 });
    }
}

/// A plant and noise with one common pole: the model `A y = B/F u + e`. Its gradient comes from differences of the
/// transfer functions from u and e to `A y - B/F u`, integrated over frequency.
#[test]
fn the_bound_of_one_common_pole() {
    let (pole, other, b) = (0.8, 0.4, [1.0, 0.5]);
    let plant = StateSpace::from_polynomials(&[-(pole + other), pole * other], &b);
    let filter = NoiseFilter::new(&[1.0], &[1.0, -pole]).unwrap();
    let process = process(&plant.unwrap(), filter.into(), LevelReading::default());
    let theory = CellTheory::new(&process, ETA, 2, &[]).unwrap();
    let found = &theory.shared.as_ref().unwrap().asymptotic.covariance;
    let population = Population::new(&process, ETA).unwrap();
    let Population { sources, .. } = &population;
    // theta = (a, f, b_1, b_2): e = A y - B/F u, with y = B0/(A0 F0) u + 1/A0 w.
    let (a0, f0) = ([1.0, -pole], [1.0, -other]);
    let b0 = [0.0, b[0], b[1]];
    let a0f0 = crate::model::polynomial::multiply(&a0, &f0);
    let error = |theta: [f64; 4]| {
        let [a, f, b1, b2] = theta;
        let y = Signal::new(0, &b0, &a0f0).plus(1.0, &Signal::new(NOISE, &[1.0], &a0));
        let model = Signal::new(0, &[0.0, b1, b2], &[1.0, f]);
        y.through(&[1.0, a], &[1.0]).plus(-1.0, &model)
    };
    let truth = [-pole, -other, b[0], b[1]];
    const STEP: f64 = 1e-5;
    let psi: Vec<Signal> = (0..4)
        .map(|i| {
            let at = |step: f64| {
                let mut theta = truth;
                theta[i] += step;
                error(theta)
            };
            let slope = at(STEP).plus(-1.0, &at(-STEP));
            Signal::default().plus(0.5 / STEP, &slope)
        })
        .collect();
    let information = Matrix::from_fn(4, 4, |i, j| covariance_over_frequency(sources, &psi[i], &psi[j]));
    let variance = sources[NOISE].variance;
    let unit = Matrix::from_fn(4, 4, |i, j| if i == j { variance } else { 0.0 });
    let p = information.solve(&unit);
    // alpha_1 = a + f, alpha_2 = a f.
    let mut slopes = Matrix::identity(4);
    slopes[(0, 1)] = 1.0;
    slopes[(1, 0)] = -other;
    slopes[(1, 1)] = -pole;
    close(found, &(&(&slopes * &p) * &slopes.transpose()), 1e-6);
    let separate = &theory.separate.as_ref().unwrap();
    assert!(separate.trace > theory.shared.as_ref().unwrap().trace);
}
