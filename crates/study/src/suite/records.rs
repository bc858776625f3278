//! Runs behind published tables: estimates of systems that no scenario of the suite has, on records drawn as their
//! sources say.

use super::score::{deviation, mean};
use asobench_identification::estimator::{OeOptions, SrivcOptions};
use asobench_identification::model::polynomial::{divide, filter};
use asobench_identification::model::{ContinuousModel, Hold, LinearModel, Orders};
use asobench_identification::signal::{Purpose, Stream, fill_white, stream};
use asobench_identification::{FitError, fit};
use rand_xoshiro::rand_core::Rng;

/// Estimates of several runs.
pub(super) struct Estimates {
    /// The estimated numbers of each run that left a model.
    pub(super) values: Vec<Vec<f64>>,
    /// The standard deviation of each at the Cramer-Rao bound, where there is one.
    pub(super) bound: Vec<Option<f64>>,
    /// So many runs in a row share their input.
    pub(super) shared: usize,
}

/// Samples of a record of P13, its noises for each input, and the time between samples.
const SAMPLES: usize = 5000;
const NOISES: u64 = 4;
const STEP: f64 = 0.1;
/// Samples of a record of P27.
const LONG: usize = 200_000;

/// Returns the estimates of a system by its name, in the order of the published table; `None` if there is no such
/// system here.
///
/// # Errors
/// If a method cannot serve a record.
pub(super) fn drawn(name: &str, runs: u64, seed: u64) -> Option<Result<Estimates, FitError>> {
    match name {
        "P13" => Some(errors_in_variables(runs, seed)),
        "P27" => Some(reduced(runs, seed)),
        _ => None,
    }
}

/// a_1, a_2, b_0, b_1 of `(s - 1)/(s + 1)^2` by `srivc`, which does not know that u is noisy. The input is skewed and
/// joined by straight lines, the noises of u and y are coloured and correlated, 10 dB each.
///
/// Source: Thil, Garnier, Gilson, *Third-order cumulants based methods for continuous-time errors-in-variables model
/// identification*, Automatica 44 (2008), and its demonstration in CONTSID.
fn errors_in_variables(runs: u64, seed: u64) -> Result<Estimates, FitError> {
    let truth = ContinuousModel {
        numerator: vec![1.0, -1.0],
        denominator: vec![1.0, 2.0, 1.0],
        step: STEP,
        hold: Hold::First,
        ..ContinuousModel::default()
    };
    let mut plant = LinearModel::zero(ContinuousModel::sampled_orders(2, 2, Hold::First, 0.0));
    truth.sample(&mut plant);
    let options = SrivcOptions {
        orders: Some(Orders::output_error(2, 2, 1)),
        hold: Hold::First,
        ts: Some(STEP),
        ..SrivcOptions::default()
    };
    let mut values = Vec::new();
    for input in 0..runs.div_ceil(NOISES) {
        let u = skewed(&mut stream(seed, input, Purpose::Input));
        let mut y = vec![0.0; SAMPLES];
        plant.simulate(&u, &mut y);
        for noise in 0..NOISES {
            let [of_u, of_y] = noises(&mut stream(seed, NOISES * input + noise, Purpose::InputNoise));
            let size = |signal: &[f64]| deviation(signal) / 10.0_f64.sqrt();
            let [u, y] = [(&u, &of_u), (&y, &of_y)].map(|(signal, noise)| -> Vec<f64> {
                let size = size(signal);
                signal.iter().zip(noise).map(|(x, noise)| x + size * noise).collect()
            });
            let model = fit(options.clone(), 2, &u, &y)?;
            let [b, a] = [&model.pass.continuous.numerator, &model.pass.continuous.denominator];
            values.push(vec![a[1], a[2], b[0], b[1]]);
        }
    }
    Ok(Estimates {
        values,
        bound: vec![None; 4],
        shared: NOISES as usize,
    })
}

/// Chi-squared numbers with two degrees of freedom through `1 - 0.2 q^-1 + 0.3 q^-2`, standardised.
fn skewed(stream: &mut Stream) -> Vec<f64> {
    let mut z = vec![0.0; 2 * SAMPLES];
    fill_white(stream, 1.0, &mut z);
    let squares: Vec<f64> = z.chunks_exact(2).map(|z| z[0] * z[0] + z[1] * z[1]).collect();
    let mut u = vec![0.0; SAMPLES];
    filter(&[1.0, -0.2, 0.3], &squares, &mut u);
    standardised(u)
}

/// Uniform numbers through `1 + 2 q^-1 - q^-2`, and these through `1/(1 + 0.8 q^-1)`, both standardised.
fn noises(stream: &mut Stream) -> [Vec<f64>; 2] {
    let uniform = |_| (stream.next_u64() >> 11) as f64 / 9_007_199_254_740_992.0;
    let uniform: Vec<f64> = (0..SAMPLES).map(uniform).collect();
    let mut of_u = vec![0.0; SAMPLES];
    filter(&[1.0, 2.0, -1.0], &uniform, &mut of_u);
    let of_u = standardised(of_u);
    let mut of_y = of_u.clone();
    divide(&[1.0, 0.8], &mut of_y);
    [of_u, standardised(of_y)]
}

fn standardised(mut x: Vec<f64>) -> Vec<f64> {
    let (mean, deviation) = (mean(&x), deviation(&x));
    for x in &mut x {
        *x = (*x - mean) / deviation;
    }
    x
}

/// b_0 and f_1 of the best first-order model of a plant of second order without noise, by `oe`. Its criterion has a
/// second minimum at b_0 = 0.114, f_1 = 0.519.
fn reduced(runs: u64, seed: u64) -> Result<Estimates, FitError> {
    let mut plant = LinearModel::zero(Orders::output_error(2, 2, 0));
    plant.b.copy_from_slice(&[0.05, -0.4]);
    plant.f.copy_from_slice(&[1.0, -1.1314, 0.25]);
    let options = OeOptions {
        orders: Some(Orders::output_error(1, 1, 0)),
        ..OeOptions::default()
    };
    let (mut u, mut y) = (vec![0.0; LONG], vec![0.0; LONG]);
    let mut values = Vec::new();
    for run in 0..runs {
        fill_white(&mut stream(seed, run, Purpose::Input), 1.0, &mut u);
        plant.simulate(&u, &mut y);
        let model = fit(options.clone(), 1, &u, &y)?;
        values.push(vec![model.linear().b[0], model.linear().f[1]]);
    }
    Ok(Estimates {
        values,
        bound: vec![None; 2],
        shared: 1,
    })
}
