//! The score of a method: shares and quantiles of d in each scenario, averaged over scenarios with equal weights. d
//! itself is the `distance` of `FisherInformation` in the crate of identification.
//!
//! Scenarios have records of their own settings, so the errors of their numbers are independent. Nothing here depends
//! on another method.

use super::manifest::VALUES;
use super::results::ScenarioResults;
use super::scenario::Scenario;
use crate::files::checksum;
use asobench_identification::theory::{distribution, quantile};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Resamples of a bootstrap.
const RESAMPLES: usize = 200;
/// So many standard errors make a difference from the bound certain.
const CERTAIN: f64 = 4.0;
/// From this efficiency on a method is near the bound.
pub const NEAR: f64 = 0.5;

/// A number with its Monte-Carlo standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// The score of a method over some scenarios.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The share of lost runs.
    pub lost: Estimated,
    /// For each of [`VALUES`], the quantile of d that the bound has over that of the method: 1 if it is efficient, 0 if
    /// that many runs are not kept.
    pub efficiency: [Estimated; 2],
    /// The share of 95 % intervals that hold the truth, none in a lost run, over the scenarios in which the method
    /// gives intervals or loses every run; `None` where it never gives any.
    pub coverage: Option<Estimated>,
    /// The median FIT on fresh data, per cent, 0 where it is below.
    pub fit: Estimated,
    /// In how many scenarios the efficiency of a typical run is at least [`NEAR`].
    pub near: usize,
    /// Whether d is certainly smaller than the bound allows, in some scenario or over all: more runs below the bound's
    /// median than chance has.
    pub is_below: bool,
}

/// Returns the share of runs of an efficient method with d up to x, scenarios weighted equally.
pub fn ideal_share<'a>(x: f64, scenarios: impl Iterator<Item = &'a Scenario>) -> f64 {
    let shares = scenarios.map(|scenario| distribution(&scenario.weights, x));
    mean(&shares.collect::<Vec<_>>())
}

/// Returns the share of runs with d up to x, scenarios weighted equally.
pub fn share_within<'a>(x: f64, results: impl Iterator<Item = &'a ScenarioResults>) -> Estimated {
    let counts = results.map(|of| (of.distances().filter(|d| *d <= x).count(), of.d.len()));
    share(&counts.collect::<Vec<_>>())
}

/// Returns the efficiency in one scenario at a quantile, one of [`VALUES`].
pub fn efficiency(scenario: &Scenario, results: &ScenarioResults, at: f64) -> Estimated {
    let ideal = quantile(&scenario.weights, at).powi(2);
    let of = |d: &mut [f64]| {
        let found = sample_quantile(d, at);
        if found.is_finite() {
            ideal / found
        } else {
            0.0
        }
    };
    let d: Vec<f64> = results.distances().collect();
    bootstrap(&scenario.content, &d, of)
}

/// Returns the score of a method over scenarios with their results.
pub fn score(of: &[(&Scenario, &ScenarioResults)]) -> Score {
    let each = |number: &dyn Fn(&Scenario, &ScenarioResults) -> Estimated| {
        let numbers: Vec<Estimated> = of.iter().map(|(of, results)| number(of, results)).collect();
        average(&numbers)
    };
    let covered: Vec<Estimated> = of
        .iter()
        .filter(|(_, results)| results.intervals > 0 || results.lost_runs() == results.d.len())
        .map(|(_, results)| coverage(results))
        .collect();
    let has_intervals = of.iter().any(|(_, results)| results.intervals > 0);
    let efficiencies = VALUES.map(|at| -> Vec<Estimated> {
        let each = of.iter();
        each.map(|(of, results)| efficiency(of, results, at))
            .collect()
    });
    let typical = efficiencies[0].iter();
    let near = typical.filter(|of| of.value >= NEAR).count();
    let lost = of
        .iter()
        .map(|(_, results)| (results.lost_runs(), results.d.len()));
    let lost: Vec<(usize, usize)> = lost.collect();
    Score {
        lost: share(&lost),
        efficiency: efficiencies.map(|each| average(&each)),
        coverage: has_intervals.then(|| average(&covered)),
        fit: each(&|of, results| {
            let fit = results
                .fit
                .iter()
                .map(|fit| fit.unwrap_or(f64::NEG_INFINITY));
            bootstrap(&of.content, &fit.collect::<Vec<_>>(), |fit| {
                sample_quantile(fit, 0.5).max(0.0)
            })
        }),
        near,
        is_below: is_below(of),
    }
}

/// Whether the number of runs below the bound's median is certainly more than half, in a scenario or over all.
fn is_below(of: &[(&Scenario, &ScenarioResults)]) -> bool {
    let is_certain = |excess: f64, runs: f64| excess > CERTAIN * (0.25 * runs).sqrt();
    let (mut excess, mut runs, mut any) = (0.0, 0.0, false);
    for (scenario, results) in of {
        let median = quantile(&scenario.weights, 0.5).powi(2);
        let count = results.distances().filter(|d| *d < median).count() as f64;
        let own = results.d.len() as f64;
        any |= is_certain(count - 0.5 * own, own);
        excess += count - 0.5 * own;
        runs += own;
    }
    any || is_certain(excess, runs)
}

/// The share of intervals that hold the truth, over all runs.
fn coverage(results: &ScenarioResults) -> Estimated {
    let intervals = f64::from(results.intervals.max(1));
    let held = results
        .hits
        .iter()
        .map(|hits| f64::from(hits.unwrap_or(0)) / intervals);
    let held: Vec<f64> = held.collect();
    let (value, count) = (mean(&held), held.len() as f64);
    let squares: f64 = held.iter().map(|held| (held - value).powi(2)).sum();
    let error = (squares / (count - 1.0).max(1.0) / count).sqrt();
    Estimated { value, error }
}

/// The mean of the shares of successes in each scenario. Its standard error is at least what one run more makes of it,
/// so that none and all are not certain.
fn share(counts: &[(usize, usize)]) -> Estimated {
    let each = counts.iter().map(|(count, runs)| {
        let (value, runs) = (*count as f64 / *runs as f64, *runs as f64);
        let error = (value * (1.0 - value) / runs).sqrt();
        Estimated { value, error }
    });
    let Estimated { value, error } = average(&each.collect::<Vec<_>>());
    let runs: usize = counts.iter().map(|(_, runs)| runs).sum();
    Estimated {
        value,
        error: error.max(1.0 / (runs + 2) as f64),
    }
}

/// The mean of independent numbers.
fn average(numbers: &[Estimated]) -> Estimated {
    let values: Vec<f64> = numbers.iter().map(|of| of.value).collect();
    let squares: f64 = numbers.iter().map(|of| of.error * of.error).sum();
    Estimated {
        value: mean(&values),
        error: squares.sqrt() / numbers.len() as f64,
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The quantile at place `(n + 1/3) q + 1/3` of the ordered sample, which is nearly median-unbiased (Hyndman and Fan,
/// *Sample quantiles in statistical packages*, 1996, definition 8). Orders the sample.
fn sample_quantile(x: &mut [f64], q: f64) -> f64 {
    x.sort_unstable_by(f64::total_cmp);
    let place = ((x.len() as f64 + 1.0 / 3.0) * q + 1.0 / 3.0).clamp(1.0, x.len() as f64) - 1.0;
    let (below, part) = (place as usize, place.fract());
    match x.get(below + 1) {
        // A part of infinity is infinite, and nothing of it is not.
        Some(above) if part > 0.0 => x[below] + part * (above - x[below]),
        _ => x[below],
    }
}

/// A statistic with its bootstrap standard error. Its random numbers follow from what the scenario is.
fn bootstrap(content: &str, x: &[f64], statistic: impl Fn(&mut [f64]) -> f64) -> Estimated {
    let value = statistic(&mut x.to_vec());
    let seed = u64::from_str_radix(&checksum(content.as_bytes())[..16], 16).unwrap_or(0);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut drawn = vec![0.0; x.len()];
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..RESAMPLES {
        for drawn in &mut drawn {
            let place = (u128::from(random.next_u64()) * x.len() as u128) >> 64;
            *drawn = x[place as usize];
        }
        let apart = statistic(&mut drawn) - value;
        sum += apart;
        squares += apart * apart;
    }
    let count = RESAMPLES as f64;
    let variance = (squares - sum * sum / count) / (count - 1.0);
    Estimated {
        value,
        error: variance.max(0.0).sqrt(),
    }
}
