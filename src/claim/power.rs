//! How many trials would decide what is undecided.

use super::decision::level_of_each;
use super::evidence::Evidence;
use crate::metric::tails::normal_above;
use crate::study::file::{Holds, TRIAL_LIMIT};
use serde::Serialize;

/// The chance that a decision is to have.
const POWER: f64 = 0.8;

/// Up to so many cells the number of certain ones is counted exactly, from there on by the normal
/// law.
const EXACT_CELLS: usize = 400;

/// How many trials in every cell would decide a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Needed {
    /// So many.
    Trials(u64),
    /// More than this, the most that a study can have.
    MoreThan(u64),
}

/// The cells of an undecided claim.
#[derive(Clone, Copy)]
pub(super) struct Undecided<'a> {
    /// What every judged cell says, and its trials.
    pub(super) cells: &'a [(&'a Evidence, u64)],
    /// How many there were before results told which of them are judged.
    pub(super) among: usize,
    /// Where the claim holds.
    pub(super) holds: Holds,
    /// Its level.
    pub(super) level: f64,
}

impl Undecided<'_> {
    /// The fewest trials, the same in every cell, that decide with 80 % where every number is what
    /// it now seems to be, the cells taken as independent: towards "holds" where as many cells as
    /// it needs seem to pass, else towards "does not hold". At least twice what there is, for a
    /// single open cell needs (1.96 + 0.84)^2 / 1.96^2 = 2.04 times as many.
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
        // To within a thousandth.
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

    /// The chance that so many trials decide it.
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

/// The probability of at least r of independent events.
fn at_least(chances: &[f64], r: usize) -> f64 {
    if r == chances.len() {
        return chances.iter().product();
    }
    if chances.len() > EXACT_CELLS {
        let mean: f64 = chances.iter().sum();
        let variance: f64 = chances.iter().map(|p| p * (1.0 - p)).sum();
        return normal_above((r as f64 - 0.5 - mean) / variance.sqrt().max(1e-9));
    }
    // of[k]: k events so far; the last one: r or more.
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

    /// Of three fair coins two or more fall heads with 1/2, one or more with 7/8; the same of many
    /// by the normal law.
    #[test]
    fn events_by_hand() {
        assert!((at_least(&[0.5; 3], 2) - 0.5).abs() < 1e-15);
        assert!((at_least(&[0.5; 3], 1) - 0.875).abs() < 1e-15);
        assert!((at_least(&[0.5; 3], 3) - 0.125).abs() < 1e-15);
        assert!((at_least(&[0.2, 0.7], 1) - (1.0 - 0.8 * 0.3)).abs() < 1e-15);
        assert!((at_least(&[0.5; 1000], 501) - at_least(&[0.5; 400], 201)).abs() < 0.02);
    }
}
