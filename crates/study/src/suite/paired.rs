//! Two methods on the same records, trial by trial.

use super::results::{MethodResults, ScenarioResults};
use super::score::Estimated;
use std::cmp::Ordering;

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
    pub lead: Estimated,
}

/// Compares two methods of the same suite in the scenarios that both are for; `None` without any.
pub fn paired(first: &MethodResults, second: &MethodResults) -> Option<Paired> {
    let both = first.scenarios.iter().zip(&second.scenarios);
    let both = both.filter(|(a, b)| a.has_runs() && b.has_runs());
    let each: Vec<[f64; 4]> = both.map(|(a, b)| in_scenario(a, b)).collect();
    if each.is_empty() {
        return None;
    }
    let count = each.len() as f64;
    let mean = |i: usize| each.iter().map(|of| of[i]).sum::<f64>() / count;
    let [win, tie, loss] = [0, 1, 2].map(mean);
    Some(Paired {
        win,
        tie,
        loss,
        lead: Estimated {
            value: win - loss,
            error: each.iter().map(|of| of[3]).sum::<f64>().sqrt() / count,
        },
    })
}

/// Win, tie, loss, and the squared standard error of win - loss.
fn in_scenario(a: &ScenarioResults, b: &ScenarioResults) -> [f64; 4] {
    let mut counts = [0.0; 3];
    for (a, b) in a.distances().zip(b.distances()) {
        let place = match a.total_cmp(&b) {
            Ordering::Less => 0,
            Ordering::Equal => 1,
            Ordering::Greater => 2,
        };
        counts[place] += 1.0;
    }
    let runs: f64 = counts.iter().sum();
    let [win, tie, loss] = counts.map(|count| count / runs);
    let variance = (win + loss - (win - loss).powi(2)) / (runs - 1.0).max(1.0);
    [win, tie, loss, variance]
}
