//! The score of a method: shares and quantiles of d in each scenario, averaged over scenarios with their weights. d
//! itself is the `distance` of `FisherInformation` in the crate of identification.
//!
//! Scenarios have records of their own settings, so the errors of their numbers are independent. But for [`paired`],
//! nothing here depends on another method.

use super::manifest::VALUES;
use super::results::{MethodResults, ScenarioResults};
use super::scenario::Scenario;
use crate::files::checksum;
use asobench_identification::metric::Estimate;
use asobench_identification::theory::{distribution, quantile};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::cmp::Ordering;

/// Resamples of a bootstrap.
const RESAMPLES: usize = 200;
/// So many standard errors make a difference from the bound certain.
const CERTAIN: f64 = 4.0;

/// The score of a method over some scenarios.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The share of lost runs.
    pub lost: Estimate,
    /// For each of [`VALUES`], the quantile of d that the bound has over that of the method: 1 if it is efficient, 0 if
    /// that many runs are not kept; from edition 2.0 on at most 1 in each scenario, and the bank's runs are pooled.
    pub efficiency: [Estimate; 2],
    /// The share of 95 % intervals that hold the truth, none in a lost run, over the scenarios in which the method
    /// gives intervals or loses every run; `None` where it never gives any.
    pub coverage: Option<Estimate>,
    /// The median FIT on fresh data, per cent, 0 where it is below.
    pub fit: Estimate,
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
pub fn share_within<'a>(x: f64, results: impl Iterator<Item = &'a ScenarioResults>) -> Estimate {
    let counts = results.map(|of| (of.distances().filter(|d| *d <= x).count(), of.d.len()));
    share(&counts.collect::<Vec<_>>(), std::iter::repeat(1.0))
}

/// Returns the efficiency in one scenario at a quantile, one of [`VALUES`].
pub fn efficiency(scenario: &Scenario, results: &ScenarioResults, at: f64) -> Estimate {
    let ideal = quantile(&scenario.weights, at).powi(2);
    let of = |d: &mut [f64]| {
        let found = sample_quantile(d, at);
        if found.is_finite() { ideal / found } else { 0.0 }
    };
    let d: Vec<f64> = results.distances().collect();
    bootstrap(&scenario.content, &d, of)
}

/// Returns the efficiency over plants of the bank at a quantile. Their few runs are pooled: d over the quantile of the
/// plant's own law has that quantile at 1 if the method is efficient, whatever the plant. The standard error is that of
/// a bootstrap over plants.
fn pooled(of: &[(&Scenario, &ScenarioResults)], at: f64) -> Estimate {
    let each = of.iter().map(|(scenario, results)| -> Vec<f64> {
        let ideal = quantile(&scenario.weights, at).powi(2);
        results.distances().map(|d| d / ideal).collect()
    });
    let each: Vec<Vec<f64>> = each.collect();
    let plants: Vec<f64> = (0..each.len()).map(|i| i as f64).collect();
    let names: Vec<&str> = of.iter().map(|(of, _)| of.content.as_str()).collect();
    let content = checksum(names.join(" ").as_bytes());
    bootstrap(&content, &plants, |drawn| {
        let runs = drawn.iter().flat_map(|i| each[*i as usize].iter());
        let found = sample_quantile(&mut runs.copied().collect::<Vec<_>>(), at);
        if found.is_finite() { 1.0 / found } else { 0.0 }
    })
}

/// The number up to 1, where it counts so; its error stays.
fn capped(of: &Scenario, number: Estimate) -> Estimate {
    let most = if of.is_capped { 1.0 } else { f64::INFINITY };
    Estimate {
        value: number.value.min(most),
        ..number
    }
}

/// Returns the score of a method over scenarios with their results, by the scenarios' weights.
pub fn score(of: &[(&Scenario, &ScenarioResults)]) -> Score {
    score_by(of, |scenario| scenario.weight)
}

/// Returns the score of a method over scenarios with their results, by any weights.
pub fn score_by(of: &[(&Scenario, &ScenarioResults)], weight: impl Fn(&Scenario) -> f64) -> Score {
    let weights = || of.iter().map(|(scenario, _)| weight(scenario));
    let covers = |results: &ScenarioResults| results.intervals > 0 || results.lost_runs() == results.d.len();
    let covered = of.iter().filter(|(_, results)| covers(results));
    let covered = covered.map(|(scenario, results)| (weight(scenario), coverage(results)));
    let covered: Vec<(f64, Estimate)> = covered.collect();
    let has_intervals = of.iter().any(|(_, results)| results.intervals > 0);
    let (bank, published): (Vec<_>, Vec<_>) = of.iter().copied().partition(|(of, _)| of.is_bank);
    let efficiencies = VALUES.map(|at| {
        let each = published.iter();
        let each = each.map(|(of, results)| (weight(of), capped(of, efficiency(of, results, at))));
        let mut each: Vec<(f64, Estimate)> = each.collect();
        if !bank.is_empty() {
            let whole = bank.iter().map(|(of, _)| weight(of)).sum();
            each.push((whole, capped(bank[0].0, pooled(&bank, at))));
        }
        average(&each)
    });
    let lost = of.iter();
    let lost = lost.map(|(_, results)| (results.lost_runs(), results.d.len()));
    let lost: Vec<(usize, usize)> = lost.collect();
    let fits = of.iter().map(|(of, results)| {
        let fit = results.fit.iter();
        let fit = fit.map(|fit| fit.unwrap_or(f64::NEG_INFINITY));
        bootstrap(&of.content, &fit.collect::<Vec<_>>(), |fit| {
            sample_quantile(fit, 0.5).max(0.0)
        })
    });
    Score {
        lost: share(&lost, weights()),
        efficiency: efficiencies,
        coverage: has_intervals.then(|| average(&covered)),
        fit: average(&weights().zip(fits).collect::<Vec<_>>()),
        is_below: is_below(of),
    }
}

/// Shares of the runs in which one method is nearer to the truth than another, scenarios weighted equally. A lost run
/// is farther than any other; two lost runs, and two equal d, are ties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paired {
    /// The first is nearer.
    pub win: f64,
    /// Neither is.
    pub tie: f64,
    /// The second is nearer.
    pub loss: f64,
    /// `win - loss`, with its standard error.
    pub lead: Estimate,
}

/// Compares two methods of the same suite in the scenarios that both are for; `None` without any.
pub fn paired(first: &MethodResults, second: &MethodResults) -> Option<Paired> {
    let both = first.scenarios.iter().zip(&second.scenarios);
    let each: Vec<Paired> = both.filter_map(|(a, b)| paired_in(a, b)).collect();
    let count = each.len() as f64;
    let mean = |of: fn(&Paired) -> f64| each.iter().map(of).sum::<f64>() / count;
    let (win, loss) = (mean(|of| of.win), mean(|of| of.loss));
    let square: f64 = each.iter().map(|of| of.lead.mcse * of.lead.mcse).sum();
    (!each.is_empty()).then(|| Paired {
        win,
        tie: mean(|of| of.tie),
        loss,
        lead: Estimate {
            value: win - loss,
            mcse: square.sqrt() / count,
        },
    })
}

/// Compares two methods in one scenario; `None` where one of them has no runs.
pub fn paired_in(a: &ScenarioResults, b: &ScenarioResults) -> Option<Paired> {
    let both = a.distances().zip(b.distances());
    let places: Vec<Ordering> = both.map(|(a, b)| a.total_cmp(&b)).collect();
    let runs = places.len() as f64;
    let share = |of: Ordering| places.iter().filter(|place| **place == of).count() as f64 / runs;
    let [win, tie, loss] = [Ordering::Less, Ordering::Equal, Ordering::Greater].map(share);
    let value = win - loss;
    let mcse = ((win + loss - value.powi(2)) / (runs - 1.0).max(1.0)).sqrt();
    let lead = Estimate { value, mcse };
    (runs > 0.0).then_some(Paired { win, tie, loss, lead })
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
fn coverage(results: &ScenarioResults) -> Estimate {
    let intervals = f64::from(results.intervals.max(1));
    let held = results.hits.iter().map(|hits| f64::from(hits.unwrap_or(0)) / intervals);
    mean_of(&held.collect::<Vec<_>>())
}

/// The weighted mean of the shares of successes in each scenario. Its standard error is at least what one run more
/// makes of it, so that none and all are not certain.
fn share(counts: &[(usize, usize)], weights: impl Iterator<Item = f64>) -> Estimate {
    let each = counts.iter().map(|(count, runs)| {
        let (value, runs) = (*count as f64 / *runs as f64, *runs as f64);
        let mcse = (value * (1.0 - value) / runs).sqrt();
        Estimate { value, mcse }
    });
    let Estimate { value, mcse } = average(&weights.zip(each).collect::<Vec<_>>());
    let runs: usize = counts.iter().map(|(_, runs)| runs).sum();
    Estimate {
        value,
        mcse: mcse.max(1.0 / (runs + 2) as f64),
    }
}

/// The weighted mean of independent numbers.
fn average(numbers: &[(f64, Estimate)]) -> Estimate {
    let whole: f64 = numbers.iter().map(|(weight, _)| weight).sum();
    let values = numbers.iter().map(|(weight, of)| weight * of.value);
    let squares = numbers.iter().map(|(weight, of)| (weight * of.mcse).powi(2));
    Estimate {
        value: values.sum::<f64>() / whole,
        mcse: squares.sum::<f64>().sqrt() / whole,
    }
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of a sample with its standard error, 0 of a single number.
pub(super) fn mean_of(values: &[f64]) -> Estimate {
    let (value, count) = (mean(values), values.len() as f64);
    let squares: f64 = values.iter().map(|x| (x - value).powi(2)).sum();
    let mcse = (squares / (count - 1.0).max(1.0) / count).sqrt();
    Estimate { value, mcse }
}

/// The standard deviation of a sample.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
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
fn bootstrap(content: &str, x: &[f64], statistic: impl Fn(&mut [f64]) -> f64) -> Estimate {
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
    Estimate {
        value,
        mcse: variance.max(0.0).sqrt(),
    }
}
