//! The information of records against reference values: power series in ball arithmetic of 256 bits, whose every
//! printed digit is right, and second differences of the likelihood with 700 bits; of t-distributed errors by
//! quadrature.

use super::*;
use crate::estimator::{MethodOptions, Pass, PemEivOptions, PemTOptions, SearchStarts, Shape, Window};
use crate::model::LinearModel;
use crate::signal::{NoiseLaw, Purpose, stream};
use serde::Deserialize;
use std::collections::HashMap;

#[derive(Deserialize)]
struct Case {
    name: String,
    #[serde(rename = "N")]
    samples: usize,
    model: HashMap<String, Vec<f64>>,
    #[serde(default)]
    variance_e: f64,
    plant_parameters: usize,
    input: Option<Drive>,
    #[serde(default)]
    input_first: Vec<f64>,
    controller: Option<Law>,
    student_t: Option<u16>,
    errors_in_variables: Option<Variances>,
    #[serde(rename = "F_all")]
    all: Vec<Vec<f64>>,
    #[serde(rename = "F")]
    of_plant: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct Variances {
    input_var: f64,
    input_noise: f64,
    output_noise: f64,
}

#[derive(Deserialize)]
struct Law {
    num: Vec<f64>,
    den: Vec<f64>,
    reference: f64,
}

/// The laws of the inputs, by a generator that any program has.
#[derive(Deserialize)]
struct Drive {
    law: String,
    seed: u64,
    clock: Option<usize>,
    hold: Option<usize>,
    #[serde(default)]
    pole: f64,
    #[serde(default)]
    amplitudes: Vec<f64>,
    #[serde(default)]
    periods: Vec<f64>,
}

impl Drive {
    fn samples(&self, count: usize) -> Vec<f64> {
        let mut x = self.seed;
        let mut share = || {
            x = (1_664_525 * x + 1_013_904_223) % (1 << 32);
            x as f64 / 2_f64.powi(32)
        };
        let mut past = 0.0;
        let held = self.clock.or(self.hold).unwrap_or(1);
        let mut value = |k: usize| match self.law.as_str() {
            "signs" => (share() - 0.5).signum(),
            "uniform" | "steps" => 2.0 * share() - 1.0,
            "gaussian12" => (0..12).map(|_| share()).sum::<f64>() - 6.0,
            "filtered" => {
                let sign = if share() >= 0.5 { 1.0 } else { -1.0 };
                past = self.pole * past + sign;
                past
            }
            "sines" => {
                let wave = |(a, period): (&f64, &f64)| a * (std::f64::consts::TAU * k as f64 / period).sin();
                self.amplitudes.iter().zip(&self.periods).map(wave).sum()
            }
            law => panic!("{law}"),
        };
        let mut u = Vec::new();
        while u.len() < count {
            let next = value(u.len());
            u.extend(std::iter::repeat_n(next, held));
        }
        u.truncate(count);
        u
    }
}

impl Case {
    fn model(&self) -> LinearModel {
        let of = |name: &str| self.model[name].clone();
        let delay = of("B").iter().position(|b| *b != 0.0).unwrap();
        LinearModel {
            a: of("A"),
            b: of("B"),
            c: of("C"),
            d: of("D"),
            f: of("F"),
            delay,
            noise_variance: self.variance_e,
            covariance: Vec::new(),
        }
    }

    fn reference(&self) -> Vec<f64> {
        let gain = self.controller.as_ref().map_or(1.0, |law| law.reference);
        let u = self.input.as_ref().unwrap().samples(self.samples);
        for (found, expected) in u.iter().zip(&self.input_first) {
            assert!((found - expected).abs() < 1e-15, "{}: {u:?}", self.name);
        }
        u.iter().map(|u| gain * u).collect()
    }

    fn information(&self) -> RecordInformation {
        let model = self.model();
        if let Some(of) = &self.errors_in_variables {
            let variances = [of.input_var, of.input_noise, of.output_noise];
            return RecordInformation::of_noisy_input(&model, variances, self.samples).unwrap();
        }
        let feedback = self.controller.as_ref();
        let feedback = feedback.map(|law| OutputFeedback::new(&law.num, &law.den).unwrap());
        let law = self.student_t.map_or(NoiseLaw::Gaussian, NoiseLaw::StudentT);
        RecordInformation::new(&model, &law, feedback.as_ref(), &self.reference()).unwrap()
    }
}

fn cases() -> Vec<Case> {
    serde_json::from_str(include_str!("records.json")).unwrap()
}

/// Every element, in units of the roots of its diagonal.
fn agree(found: &Matrix, expected: &[Vec<f64>], name: &str) {
    assert_eq!(found.nrows(), expected.len(), "{name}");
    for (i, row) in expected.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let unit = (expected[i][i] * expected[j][j]).sqrt();
            let apart = (found[(i, j)] - value).abs() / unit;
            assert!(apart < 1e-11, "{name} {i} {j}: {} {value}", found[(i, j)]);
        }
    }
}

#[test]
fn reference_records() {
    let cases = cases();
    assert_eq!(cases.len(), 19);
    for case in cases {
        let found = case.information();
        agree(&found.all, &case.all, &case.name);
        agree(&found.of_plant, &case.of_plant, &case.name);
        assert_eq!(found.of_plant.nrows(), case.plant_parameters);
    }
}

/// The information of a process's records is that of its model, in the coordinates of alpha and beta.
#[test]
fn records_of_a_process() {
    let names = ["OE-P06-300", "ARX-P18-120", "t5-loop-ARMAX-P03-200"];
    for case in cases().iter().filter(|case| names.contains(&case.name.as_str())) {
        let model = case.model();
        let plant: StateSpace = model.plant().unwrap();
        let denominator = crate::model::polynomial::multiply(&model.a, &model.d);
        let noise = NoiseFilter::new(&model.c, &denominator).unwrap();
        let noise = match case.student_t {
            Some(freedom) => noise.student_t(freedom).unwrap(),
            None => noise,
        };
        let absolute = LevelReading {
            over: LevelOver::Nothing,
            of: LevelOf::NoiseFree,
        };
        let feedback = case.controller.as_ref().map_or(Feedback::None, |law| {
            Feedback::Output(OutputFeedback::new(&law.num, &law.den).unwrap())
        });
        let settings = ProcessSettings {
            feedback,
            ..process(&plant, noise.into(), absolute).settings().clone()
        };
        let process = Process::from_settings(settings).unwrap();
        let scale = case.variance_e.sqrt();
        let own = OwnInformation::new(&process, 100.0 * scale, case.samples).unwrap();
        let found = own.of(&case.reference(), scale).unwrap();
        let (_, free) = found.of_free();
        // p is alpha_1 ..., beta_1 ...: the order of A, F, B.
        agree(&free, &case.of_plant, &case.name);
    }
}

/// Nothing that has no information of a record gets one.
#[test]
fn refusals() {
    let mut model = LinearModel::zero("nb=1,nf=1,nk=0".parse().unwrap());
    model.set_parameters(&[1.0, -0.5]);
    let r = [1.0, -1.0, 1.0, 1.0, -1.0];
    let of = |model: &LinearModel, feedback: Option<&OutputFeedback>| {
        RecordInformation::new(model, &NoiseLaw::Gaussian, feedback, &r).map(|_| ())
    };
    assert_eq!(of(&model, None), Err(Missing::Singular));
    model.noise_variance = 1.0;
    assert_eq!(of(&model, None), Ok(()));
    let direct = OutputFeedback::new(&[0.5], &[1.0]).unwrap();
    assert_eq!(of(&model, Some(&direct)), Err(Missing::DirectLoop));
    model.f[1] = -1.5;
    assert_eq!(of(&model, None), Err(Missing::UnstableModel));
    model.f[1] = -0.5;
    let noisy = RecordInformation::of_noisy_input(&model, [1.0, 0.0, 1.0], 5);
    assert_eq!(noisy.map(|_| ()), Err(Missing::Singular));
}

/// `y = 0.8 q^-1 / (1 - 0.9 q^-1) u + e`, e of variance 1.
fn first_order() -> LinearModel {
    let mut truth = LinearModel::zero("nb=1,nf=1,nk=1".parse().unwrap());
    truth.set_parameters(&[0.8, -0.9]);
    truth.noise_variance = 1.0;
    truth
}

/// Records of the tests of efficiency, and their samples.
const RECORDS: u64 = 300;
const SAMPLES: usize = 400;

/// The means of d of methods over records, each with its information.
fn mean_distances(methods: &[MethodOptions], mut record: impl FnMut(u64) -> ([Vec<f64>; 2], Matrix)) -> Vec<f64> {
    let shape = Shape {
        order: 1,
        window: SAMPLES,
    };
    let prepared = methods.iter().map(|of| of.prepare(&shape.into()).unwrap());
    let mut methods: Vec<_> = prepared.map(|method| (method, 0.0)).collect();
    for trial in 0..RECORDS {
        let ([u, y], f) = record(trial);
        let window = Window { u: &u, y: &y, r: &u };
        for (method, sum) in &mut methods {
            let mut pass = Pass::new(1);
            method.estimate(window, std::slice::from_mut(&mut pass));
            assert_eq!(pass.failure, None);
            // F before B.
            let error = [pass.model.f[1] + 0.9, pass.model.b[1] - 0.8];
            let terms = (0..4).map(|i| error[i / 2] * f[(i / 2, i % 2)] * error[i % 2]);
            *sum += terms.sum::<f64>() / 2.0;
        }
    }
    let means = methods.iter().map(|(_, sum)| sum / RECORDS as f64);
    means.collect()
}

fn white(noise: &NoiseFilter, purpose: Purpose, trial: u64, size: f64) -> Vec<f64> {
    let mut w = vec![0.0; SAMPLES];
    let mut start = stream(60, trial, Purpose::NoiseStart);
    let mut drive = stream(60, trial, purpose);
    noise.fill(&mut start, &mut drive, &mut Vec::new(), &mut w);
    w.iter().map(|w| size * w).collect()
}

fn sum(x: &[f64], w: &[f64]) -> Vec<f64> {
    x.iter().zip(w).map(|(x, w)| x + w).collect()
}

/// Whether a mean is that of chi-squared(2)/2, of variance 1, within four standard errors.
fn is_efficient(mean: f64) -> bool {
    (mean - 1.0).abs() < 4.0 / (RECORDS as f64).sqrt()
}

/// Maximum likelihood of t(3) errors reaches the bound of each record; least squares has half the efficiency.
#[test]
fn maximum_likelihood_reaches_the_bound_of_heavy_tails() {
    let truth = first_order();
    let (orders, starts) = (Some(truth.orders()), SearchStarts::Random(0));
    let robust = PemTOptions {
        orders,
        starts,
        freedom: Some(3.0),
    };
    let squares = OeOptions {
        orders,
        starts,
        ..OeOptions::default()
    };
    let normal = NoiseFilter::white();
    let noise = NoiseFilter::white().student_t(3).unwrap();
    let means = mean_distances(&[robust.into(), squares.into()], |trial| {
        let u = white(&normal, Purpose::Input, trial, 1.0);
        let mut x = vec![0.0; SAMPLES];
        truth.simulate(&u, &mut x);
        let y = sum(&x, &white(&noise, Purpose::NoiseDrive, trial, 1.0));
        let own = RecordInformation::new(&truth, noise.law(), None, &u).unwrap();
        ([u, y], own.of_plant.clone())
    });
    assert!(is_efficient(means[0]), "{means:?}");
    assert!(means[1] > 1.5 * means[0], "{means:?}");
}

/// Maximum likelihood reaches the expected bound where the input is measured with noise; least squares is biased.
#[test]
fn maximum_likelihood_reaches_the_bound_of_a_noisy_input() {
    let truth = first_order();
    let (orders, starts) = (Some(truth.orders()), SearchStarts::Random(0));
    let exact = PemEivOptions { orders, starts };
    let squares = OeOptions {
        orders,
        starts,
        ..OeOptions::default()
    };
    let normal = NoiseFilter::white();
    let variances = [1.0, 0.25, 1.0];
    let bound = RecordInformation::of_noisy_input(&truth, variances, SAMPLES).unwrap();
    let means = mean_distances(&[exact.into(), squares.into()], |trial| {
        let r = white(&normal, Purpose::Input, trial, 1.0);
        let mut x = vec![0.0; SAMPLES];
        truth.simulate(&r, &mut x);
        let u = sum(&r, &white(&normal, Purpose::FreshInput, trial, 0.5));
        let y = sum(&x, &white(&normal, Purpose::NoiseDrive, trial, 1.0));
        ([u, y], bound.of_plant.clone())
    });
    assert!(is_efficient(means[0]), "{means:?}");
    assert!(means[1] > 1.5 * means[0], "{means:?}");
}
