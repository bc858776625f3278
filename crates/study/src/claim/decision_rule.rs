//! From cells to a verdict with known error rates, whatever the dependence between the cells, which share their random
//! numbers.
//!
//! Every way to hold requires that the test passes in at least r of m cells: in all, in more than half, or in one. "At
//! least r of m pass" is certain at a level if (m - r + 1) p_(r) is at most this level, with p_(r) the r-th smallest
//! p-value (Bonferroni's test of a partial conjunction: Benjamini and Heller 2008, Biometrics 64, 1215). For r = m this
//! is the largest p-value alone, the intersection-union test; for r = 1 it is Bonferroni's test. The claim does not
//! hold if the same test says that at least m - r + 1 cells fail. So either error has the claim's level, and
//! "undecided" is not an error.

use crate::design::file::claim::Holds;
use asobench_identification::names::named_enum;

named_enum! {
    /// The verdict of the results on a claim.
    Verdict, "verdict" {
        /// Neither verdict is certain.
        Undecided = "undecided",
        /// It holds.
        Holds = "holds",
        /// It certainly holds in some cells and certainly not in others, and the number of cells decides neither way.
        HoldsInPart = "holds in part",
        /// It does not hold.
        DoesNotHold = "does not hold",
    }
}

/// The p-values of a cell's test, for "it does not pass" and "it does not fail".
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PValues {
    /// Small if it certainly passes.
    pub(crate) pass: f64,
    /// Small if it certainly fails.
    pub(crate) fail: f64,
}

/// The cells of a claim.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cells<'a> {
    /// Those that are judged.
    pub(crate) judged: &'a [PValues],
    /// How many cells there were before results selected the judged ones: the selection could have been by chance.
    pub(crate) among: usize,
}

impl Cells<'_> {
    /// Returns the judged cells that certainly pass, and those that certainly fail. They are certain all together
    /// (Holm), or each by itself if the claim needs all of them and all are.
    pub(crate) fn certain(self, holds: Holds, level: f64) -> [Vec<usize>; 2] {
        let [pass, fail]: [Vec<f64>; 2] = [
            self.judged.iter().map(|cell| cell.pass).collect(),
            self.judged.iter().map(|cell| cell.fail).collect(),
        ];
        let together = |p: &[f64]| holm(p, self.among, level);
        let all = |p: &[f64]| {
            if p.iter().all(|p| *p <= level) {
                (0..p.len()).collect()
            } else {
                together(p)
            }
        };
        match holds {
            Holds::Everywhere => [all(&pass), together(&fail)],
            Holds::Typically => [together(&pass), together(&fail)],
            Holds::Somewhere => [together(&pass), all(&fail)],
        }
    }
}

impl Holds {
    /// Returns in how many of m cells the test must pass.
    pub(crate) fn passes(self, m: usize) -> usize {
        match self {
            Self::Everywhere => m,
            Self::Typically => m / 2 + 1,
            Self::Somewhere => 1,
        }
    }

    /// Returns in how many of m cells it must fail for the claim not to hold.
    pub(crate) fn fails(self, m: usize) -> usize {
        m + 1 - self.passes(m)
    }
}

/// Returns the level at which each of r judged cells must be certain, for all r to be certain together.
pub(crate) fn level_of_each(r: usize, judged: usize, among: usize, level: f64) -> f64 {
    if r == judged {
        level
    } else {
        level / (among + 1 - r) as f64
    }
}

/// Whether at least r of the p-values are certain.
pub(crate) fn at_least(p: &[f64], r: usize, among: usize, level: f64) -> bool {
    let cell_level = level_of_each(r, p.len(), among, level);
    r > 0 && p.iter().filter(|p| **p <= cell_level).count() >= r
}

/// Returns the largest number of cells of which "at least so many" is certain, from the number `first` on that the
/// claim itself fixes. "At least r" is tested for `first`, `first` + 1, ... until it is not certain: a fixed sequence
/// of nested hypotheses, so the number that results may be chosen by the results at no cost. The largest r of all
/// without that order would be valid for a fixed r only.
pub(crate) fn certain_count(p: &[f64], first: usize, among: usize, level: f64) -> usize {
    let certain = |r: &usize| at_least(p, *r, among, level);
    (first.max(1)..=p.len()).take_while(certain).last().unwrap_or(0)
}

/// Returns the cells that are certain all together, by Holm's step-down (Holm 1979). The chance that any of them is
/// wrong is at most the level.
pub(crate) fn holm(p: &[f64], among: usize, level: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let steps = order.iter().enumerate();
    let kept = steps.take_while(|(step, cell)| p[**cell] <= level / (among - step) as f64);
    kept.map(|(_, cell)| *cell).collect()
}

/// Returns the verdict on a claim.
pub(crate) fn decide(holds: Holds, cells: Cells<'_>, level: f64) -> Verdict {
    let m = cells.judged.len();
    let pass: Vec<f64> = cells.judged.iter().map(|cell| cell.pass).collect();
    let fail: Vec<f64> = cells.judged.iter().map(|cell| cell.fail).collect();
    if m == 0 {
        return Verdict::Undecided;
    }
    let passes = at_least(&pass, holds.passes(m), cells.among, level);
    let fails = at_least(&fail, holds.fails(m), cells.among, level);
    match (passes, fails) {
        (true, false) => Verdict::Holds,
        (false, true) => Verdict::DoesNotHold,
        _ => {
            let some = |p: &[f64]| !holm(p, cells.among, level).is_empty();
            if holds == Holds::Typically && some(&pass) && some(&fail) {
                Verdict::HoldsInPart
            } else {
                Verdict::Undecided
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(holds: Holds, pass: &[f64], fail: &[f64]) -> Verdict {
        let p_values = pass.iter().zip(fail);
        let judged: Vec<PValues> = p_values
            .map(|(pass, fail)| PValues {
                pass: *pass,
                fail: *fail,
            })
            .collect();
        let among = judged.len();
        decide(holds, Cells { judged: &judged, among }, 0.025)
    }

    /// For 0.01, 0.04, 0.03, 0.005 at 0.05 the thresholds in ascending order are 0.0125, 0.05/3, 0.025, 0.05. So 0.005
    /// and 0.01 are certain. 0.03 is above 0.025 and ends the procedure, although 0.04 is below 0.05.
    #[test]
    fn holm_by_hand() {
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005], 4, 0.05), [3, 0]);
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005], 8, 0.05), [3]);
        assert_eq!(holm(&[0.02, 0.0124, 0.026, 0.049], 4, 0.05), [1]);
        assert_eq!(holm(&[0.012, 0.016, 0.024, 0.049], 4, 0.05), [0, 1, 2, 3]);
        assert!(holm(&[], 0, 0.05).is_empty());
    }

    /// Partial conjunction with 5 cells and r = 3: three times the third smallest.
    #[test]
    fn partial_conjunction_by_hand() {
        let p = [0.9, 0.001, 0.008, 0.4, 0.002];
        assert!(at_least(&p, 3, 5, 0.025), "3 * 0.008 = 0.024");
        assert!(!at_least(&p, 3, 5, 0.023));
        assert!(at_least(&p, 2, 5, 0.008), "4 * 0.002");
        assert!(at_least(&p, 1, 5, 0.005) && !at_least(&p, 1, 5, 0.0049), "5 * 0.001");
        assert!(!at_least(&p, 4, 5, 0.025), "2 * 0.4");
        assert!(at_least(&p, 5, 5, 0.9), "all: the largest, not corrected");
        assert_eq!(certain_count(&p, 1, 5, 0.025), 3);
        assert_eq!(certain_count(&p, 3, 5, 0.025), 3);
        assert_eq!(certain_count(&p, 4, 5, 0.025), 0);
        // Three times the third smallest is certain, four times the second is not: r = 3 only if the claim fixes it.
        let p = [0.9, 0.001, 0.008, 0.4, 0.0065];
        assert_eq!(certain_count(&p, 1, 5, 0.025), 1);
        assert_eq!(certain_count(&p, 3, 5, 0.025), 3);
        // Nine cells, three selected by results. For r = 2: 8 times the second smallest. For r = 3, all of them: the
        // largest alone.
        assert!(!at_least(&[0.001, 0.009, 0.5], 2, 9, 0.07) && at_least(&[0.001, 0.009, 0.5], 2, 9, 0.073));
        assert!(at_least(&[0.001, 0.009, 0.02], 3, 9, 0.025));
    }

    #[test]
    fn verdicts_by_hand() {
        use Verdict::{DoesNotHold, Holds as Yes, HoldsInPart, Undecided};
        let (sure, open) = (0.001, 0.5);
        let not = 1.0 - sure;
        let all = [sure, 0.02, sure, sure];
        let other = [not, 0.98, not, not];
        assert_eq!(verdict(Holds::Everywhere, &all, &other), Yes);
        assert_eq!(verdict(Holds::Everywhere, &other, &all), DoesNotHold);
        assert_eq!(verdict(Holds::Somewhere, &other, &all), DoesNotHold);
        assert_eq!(verdict(Holds::Somewhere, &all, &other), Yes);
        // One of four must fail: certain below 0.025/4.
        let one_low = [not, not, not, 0.007];
        assert_eq!(verdict(Holds::Everywhere, &[open; 4], &one_low), Undecided);
        assert_eq!(
            verdict(Holds::Everywhere, &[open; 4], &[not, not, not, 0.006]),
            DoesNotHold
        );
        // More than half of four is three: 2 * 0.012 is below 0.025. Not more than half: two fail, 3 * 0.008.
        assert_eq!(verdict(Holds::Typically, &[sure, sure, 0.012, open], &[open; 4]), Yes);
        assert_eq!(
            verdict(Holds::Typically, &[open; 4], &[sure, 0.008, open, open]),
            DoesNotHold
        );
        assert_eq!(
            verdict(Holds::Typically, &[sure, open, open, open], &[open, sure, open, open]),
            HoldsInPart
        );
        assert_eq!(verdict(Holds::Everywhere, &[], &[]), Undecided);
    }
}
