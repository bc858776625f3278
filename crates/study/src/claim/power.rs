//! Computes how many trials would decide an undecided claim.

use crate::claim::decision_rule::level_of_each;
use crate::claim::evidence::Evidence;
use crate::claim::needed::Needed;
use crate::claim::one_sided::More;
use crate::design::file::{Holds, TRIAL_LIMIT};
use asobench_identification::metric::tails::normal_above;

/// The required chance of a decision.
const POWER: f64 = 0.8;

/// Up to so many cells, the number of certain ones is computed exactly; beyond, with the normal approximation.
const EXACT_CELLS: usize = 400;

/// Half the width of the interval of an effect from which a range of trials follows, in standard errors: 80 %.
const EFFECT_POINT: f64 = 1.281_551_565_544_600_4;

/// A cell of an undecided claim.
#[derive(Clone, Copy)]
pub(crate) struct Open<'a> {
    /// The evidence on its tests.
    pub(crate) evidence: &'a Evidence,
    /// The evidence on the claim's condition, if it has one.
    pub(crate) given: Option<&'a Evidence>,
    /// Its trials.
    pub(crate) trials: u64,
}

/// The cells of an undecided claim.
#[derive(Clone, Copy)]
pub(crate) struct Undecided<'a> {
    /// Every judged cell.
    pub(crate) cells: &'a [Open<'a>],
    /// How many cells there were before results selected the judged ones.
    pub(crate) among: usize,
    /// In how many cells the claim says that it holds.
    pub(crate) holds: Holds,
    /// Its level at the next look.
    pub(crate) level: f64,
}

impl Undecided<'_> {
    /// Returns the range of trials that decides. The decision is "holds" if enough cells seem to pass, otherwise "does
    /// not hold".
    pub(crate) fn needed(self) -> Needed {
        if self.level > 0.0 {
            Needed {
                from: self.trials(EFFECT_POINT),
                to: self.trials(-EFFECT_POINT),
            }
        } else {
            Needed::NEVER
        }
    }

    /// Returns the fewest trials, the same in every cell, that decide with 80 %, but more than there are. It assumes
    /// that cells are independent, and that every number is `shift` standard errors farther on the side of its limit on
    /// which it seems to be.
    pub(crate) fn trials(self, shift: f64) -> Option<u64> {
        let there = self.cells.iter().map(|cell| cell.trials).max();
        let mut low = there.unwrap_or(1).max(1);
        let mut high = low + 1;
        while self.power(high, shift) < POWER {
            if high == TRIAL_LIMIT {
                return None;
            }
            low = high;
            high = high.saturating_mul(2).min(TRIAL_LIMIT);
        }
        // Accurate to a thousandth.
        while high - low > 1 + low / 1000 {
            let middle = low + (high - low) / 2;
            if self.power(middle, shift) < POWER {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(high)
    }

    /// Returns the chance that so many trials decide the claim.
    pub(crate) fn power(self, trials: u64, shift: f64) -> f64 {
        let m = self.cells.len();
        let (passes, fails) = (self.holds.passes(m), self.holds.fails(m));
        let seem = self.cells.iter().filter(|cell| cell.evidence.seems_to_pass());
        let towards_holds = seem.count() >= passes;
        let r = if towards_holds { passes } else { fails };
        let cell_level = level_of_each(r, m, self.among, self.level);
        let of_cell = |cell: &Open<'_>| {
            let more = More {
                factor: trials as f64 / cell.trials as f64,
                shift,
            };
            let condition = |given: &Evidence| given.power_of_pass(more, cell_level);
            let condition = cell.given.map_or(1.0, condition);
            match (towards_holds, self.holds) {
                (true, Holds::Everywhere) => cell.evidence.power_of_pass(more, cell_level),
                (true, _) => condition * cell.evidence.power_of_pass(more, cell_level),
                (false, Holds::Somewhere) => cell.evidence.power_of_fail(more, cell_level),
                (false, _) => condition * cell.evidence.power_of_fail(more, cell_level),
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
