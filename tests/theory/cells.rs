//! The processes of the shipped files' cells, and what theory says of them.

use super::limit::least_squares_limit;
use super::population::{Made, Population, relative_covariance, trace};
use super::study::{Check, Theory};
use asobench::plant::{Numerator, StateSpace, nikolov2023};
use asobench::signal::NoiseFilter;
use faer::Mat;

pub const AMPLITUDE: f64 = 10.0;
pub const OPEN: (&[f64], &[f64]) = (&[0.0], &[1.0]);

pub fn plant() -> StateSpace {
    nikolov2023(Numerator::default())
}

/// The noise filters of the shipped files.
pub fn filter(colour: &str) -> (Vec<f64>, Vec<f64>) {
    match colour {
        "ar" => (vec![1.0], plant().denominator()),
        "white" => (vec![1.0], vec![1.0]),
        "ma" => (vec![1.0, 0.8], vec![1.0]),
        "arma" => (vec![1.0, 0.5], vec![1.0, -0.7]),
        "strong" => (vec![1.0], vec![1.0, -0.95]),
        _ => panic!("{colour}"),
    }
}

pub fn population(colour: &str, eta: f64, input_noise: f64, feedback: (&[f64], &[f64])) -> Population {
    let (plant, (c, d)) = (plant(), filter(colour));
    let noise = (c.as_slice(), d.as_slice());
    Made {
        plant: &plant,
        amplitude: AMPLITUDE,
        noise,
        eta,
        input_noise,
        feedback,
    }
    .population()
}

pub fn open(colour: &str, eta: f64) -> Population {
    population(colour, eta, 0.0, OPEN)
}

/// The limit of least squares, which two ways have to confirm.
pub fn limit(colour: &str, eta: f64, input_noise: f64) -> Vec<f64> {
    let (c, d) = filter(colour);
    let noise = NoiseFilter::new(&c, &d).unwrap();
    let limit = least_squares_limit(&plant(), AMPLITUDE, &noise, eta, input_noise).unwrap();
    let other = population(colour, eta, input_noise, OPEN).least_squares(6);
    for (p, q) in limit.iter().zip(&other) {
        assert!(
            (p - q).abs() < 1e-10,
            "{colour} {eta} {input_noise}: {limit:?} {other:?}"
        );
    }
    limit
}

pub fn bias(limit: &[f64], theta: &[f64]) -> Vec<f64> {
    limit.iter().zip(theta).map(|(p, theta)| p - theta).collect()
}

pub fn component(errors: &[Vec<f64>], i: usize) -> Vec<f64> {
    errors.iter().map(|e| e[i]).collect()
}

pub fn check(
    experiment: &'static str,
    figure: impl Into<String>,
    trials: u64,
    found: (f64, f64),
    theory: Theory,
) -> Check {
    Check {
        experiment,
        figure: figure.into(),
        trials,
        found,
        theory,
    }
}

/// The RMSE of a relative error (part 0: e_a, 1: e_h, 2: e_b) from N times the covariance of p.
pub fn expected(population: &Population, covariance: &Mat<f64>, part: usize, window: usize) -> Theory {
    Theory::Value(size(population, covariance, part, window))
}

pub fn size(population: &Population, covariance: &Mat<f64>, part: usize, window: usize) -> f64 {
    let square = trace(&relative_covariance(&population.theta, covariance, part));
    (square / (window - population.n) as f64).sqrt()
}
