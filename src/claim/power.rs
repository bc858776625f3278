//! Computes how many trials would decide an undecided claim.

use super::decision::level_of_each;
use super::evidence::Evidence;
use crate::metric::tails::normal_above;
use crate::study::file::{Holds, TRIAL_LIMIT};
use serde::Serialize;

/// The required chance of a decision.
const POWER: f64 = 0.8;

/// Up to so many cells, the number of certain ones is computed exactly; beyond, with the normal approximation.
const EXACT_CELLS: usize = 400;

/// The number of trials in every cell that would decide a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Needed {
    /// This many.
    Trials(u64),
    /// More than this, the most that a study can have.
    MoreThan(u64),
}

/// The cells of an undecided claim.
#[derive(Clone, Copy)]
pub(super) struct Undecided<'a> {
    /// The evidence of every judged cell, and its trials.
    pub(super) cells: &'a [(&'a Evidence, u64)],
    /// How many cells there were before results selected the judged ones.
    pub(super) among: usize,
    /// In how many cells the claim says that it holds.
    pub(super) holds: Holds,
    /// Its level.
    pub(super) level: f64,
}

impl Undecided<'_> {
    /// Returns the fewest trials, the same in every cell, that decide with 80 %. It assumes that every number equals
    /// its present estimate and that cells are independent. The decision is "holds" if enough cells seem to pass,
    /// otherwise "does not hold". The result is at least twice the present number: a single open cell needs
    /// (1.96 + 0.84)^2 / 1.96^2 = 2.04 times as many.
    pub(super) fn trials(self) -> Needed {
        let there = self
            .cells
            .iter()
            .map(|(_, trials)| *trials)
            .max()
            .unwrap_or(1);
        let mut high = there.max(1).saturating_mul(2);
        let mut low = high;
        while self.power(high) < POWER {
            if high == TRIAL_LIMIT {
                return Needed::MoreThan(TRIAL_LIMIT);
            }
            low = high;
            high = high.saturating_mul(2).min(TRIAL_LIMIT);
        }
        // Accurate to a thousandth.
        while high - low > 1 + low / 1000 {
            let middle = low + (high - low) / 2;
            if self.power(middle) < POWER {
                low = middle;
            } else {
                high = middle;
            }
        }
        Needed::Trials(high)
    }

    /// Returns the chance that so many trials decide the claim.
    pub(super) fn power(self, trials: u64) -> f64 {
        let m = self.cells.len();
        let (passes, fails) = (self.holds.passes(m), self.holds.fails(m));
        let seem = self
            .cells
            .iter()
            .filter(|(evidence, _)| evidence.seems_to_pass());
        let towards_holds = seem.count() >= passes;
        let r = if towards_holds { passes } else { fails };
        let cell_level = level_of_each(r, m, self.among, self.level);
        let of_cell = |(evidence, there): &(&Evidence, u64)| {
            let factor = trials as f64 / *there as f64;
            if towards_holds {
                evidence.power_of_pass(factor, cell_level)
            } else {
                evidence.power_of_fail(factor, cell_level)
            }
        };
        let chances: Vec<f64> = self.cells.iter().map(of_cell).collect();
        at_least(&chances, r)
    }
}

/// Returns the probability of at least r of independent events.
fn at_least(chances: &[f64], r: usize) -> f64 {
    if r == chances.len() {
        return chances.iter().product();
    }
    if chances.len() > EXACT_CELLS {
        let mean: f64 = chances.iter().sum();
        let variance: f64 = chances.iter().map(|p| p * (1.0 - p)).sum();
        return normal_above((r as f64 - 0.5 - mean) / variance.sqrt().max(1e-9));
    }
    // chance[k]: k events so far; the last entry: r or more.
    let mut chance = vec![0.0; r + 1];
    chance[0] = 1.0;
    for p in chances {
        chance[r] += chance[r - 1] * p;
        for k in (1..r).rev() {
            chance[k] = chance[k] * (1.0 - p) + chance[k - 1] * p;
        }
        chance[0] *= 1.0 - p;
    }
    chance[r]
}

#[cfg(test)]
mod tests {
    use super::at_least;

    /// Of three fair coins at least two show heads with probability 1/2, at least one with 7/8. The same for many coins
    /// by the normal approximation.
    #[test]
    fn events_by_hand() {
        assert!((at_least(&[0.5; 3], 2) - 0.5).abs() < 1e-15);
        assert!((at_least(&[0.5; 3], 1) - 0.875).abs() < 1e-15);
        assert!((at_least(&[0.5; 3], 3) - 0.125).abs() < 1e-15);
        assert!((at_least(&[0.2, 0.7], 1) - (1.0 - 0.8 * 0.3)).abs() < 1e-15);
        assert!((at_least(&[0.5; 1000], 501) - at_least(&[0.5; 400], 201)).abs() < 0.02);
    }
}
