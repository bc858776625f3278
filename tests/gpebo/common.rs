//! Random plants and an independent integrator.

use asobench::observer::gpebo::{Cascade, Factor, GpeboOptions, ObserverSpec, Operator, Scenario};
use asobench::plant::ContinuousPlant;
use asobench::signal::{Signal, Wave};

/// The paper's example with an amplitude and frequency of its sine, and an operator of the first mixing, of its own.
pub fn example_of([amplitude, frequency]: [f64; 2], first: Operator, step: f64, observers: &[ObserverSpec]) -> Cascade {
    let scenario = Scenario {
        u: Signal::new(vec![Wave::Constant { value: 1.0 }]),
        delta: Signal::new(vec![Wave::Sine {
            amplitude,
            frequency,
            phase: 0.0,
        }]),
        x0: vec![1.0, 2.0],
        horizon: 20.0,
        scored_from: 0.0,
        step,
    };
    let options = GpeboOptions {
        xi0: vec![0.0; 2],
        filters: vec![first],
    };
    let plant = ContinuousPlant::bobtsov2023();
    Cascade::new(&plant, &scenario, &options, observers).unwrap()
}

/// Uniform numbers in (-1, 1), Knuth's MMIX generator.
pub struct Uniform(pub u64);
impl Uniform {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
    pub fn plant(&mut self, n: usize) -> ContinuousPlant {
        let a: Vec<Vec<f64>> = (0..n).map(|_| self.vector(n)).collect();
        ContinuousPlant::new(&a, self.vector(n), self.vector(n)).unwrap()
    }
}

/// One step of the Gauss-Legendre method of order 6 (Hairer, Norsett, Wanner, Solving ODEs I, table II.7.4), its stages
/// by fixed-point iteration.
pub fn gauss_legendre(f: &impl Fn(f64, &[f64]) -> Vec<f64>, t: f64, y: &mut [f64], h: f64) {
    let r = 15_f64.sqrt();
    let nodes = [0.5 - r / 10.0, 0.5, 0.5 + r / 10.0];
    let a = [
        [5.0 / 36.0, 2.0 / 9.0 - r / 15.0, 5.0 / 36.0 - r / 30.0],
        [5.0 / 36.0 + r / 24.0, 2.0 / 9.0, 5.0 / 36.0 - r / 24.0],
        [5.0 / 36.0 + r / 30.0, 2.0 / 9.0 + r / 15.0, 5.0 / 36.0],
    ];
    let weights = [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0];
    let mut k = [f(t, y), f(t, y), f(t, y)];
    for _ in 0..25 {
        k = [0, 1, 2].map(|i| {
            let stage: Vec<f64> = (0..y.len())
                .map(|j| y[j] + h * (0..3).map(|l| a[i][l] * k[l][j]).sum::<f64>())
                .collect();
            f(t + nodes[i] * h, &stage)
        });
    }
    for j in 0..y.len() {
        y[j] += h * (0..3).map(|i| weights[i] * k[i][j]).sum::<f64>();
    }
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub fn a_times(plant: &ContinuousPlant, x: &[f64]) -> Vec<f64> {
    let n = plant.order();
    (0..n).map(|i| (0..n).map(|j| plant.a()[(i, j)] * x[j]).sum()).collect()
}

pub fn proposed(factor: Factor, gains: Vec<f64>) -> ObserverSpec {
    ObserverSpec::Proposed {
        k: 1.0,
        order: 2,
        filters: vec![Operator::Lag(2.0), Operator::Lag(6.0)],
        gains,
        factor,
    }
}
