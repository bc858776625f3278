//! Corrects the verdicts over all claims of a file, each side by itself.
//!
//! Every claim has two hypotheses of which one is true: "it does not hold", which the verdict "holds" rejects, and "it
//! holds", which the verdict "does not hold" rejects. Holm's step-down (Holm 1979) goes over the m claims once for each
//! side: the k-th rejection of a side (k = 1, 2, ...) is at level / (m + 1 - k). So the chance that any claim wrongly
//! holds is at most the level, and so is the chance that any wrongly does not hold, whatever the claims have to do with
//! each other. One step-down over both sides would not keep that: a claim that is decided one way has not used up its
//! error the other way, so the levels of the others may not rise for it.
//!
//! The p-value of a verdict is the smallest level at which the results give it. Holm's procedure compares it with level
//! / j for whole j alone, so it is enough to know the largest j at which the verdict stands. If a condition (`given`)
//! selects the cells by the level, a verdict may stand at a small level and not at a larger one. Then it counts only as
//! far as it stands at all larger levels, which keeps the error rates.

use crate::claim::decision_rule::Verdict;
use crate::claim::judged::{Judged, undecided};
use crate::design::file::{ClaimTable, ExperimentFile};

/// The claims of a file whose verdicts are corrected together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Family {
    /// How many claims with tests there are.
    pub(crate) claims: usize,
    /// The smallest level of a claim: the error rate of each side over all of them.
    pub(crate) level: f64,
}

/// How a claim is decided at the levels level / j.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Strength {
    verdict: Verdict,
    /// The largest j at which it is decided so; 0 if it is not decided at the level itself.
    divisor: usize,
}

impl Family {
    /// Returns the family of a file; `None` if its claims are judged each by itself.
    pub(crate) fn of(file: &ExperimentFile) -> Option<Self> {
        let tested = file.claims.iter().filter(|claim| !claim.test.is_empty());
        let levels: Vec<f64> = tested.map(|claim| claim.level).collect();
        let level = levels.iter().copied().fold(f64::INFINITY, f64::min);
        let claims = levels.len();
        (file.family && claims > 0).then_some(Self { claims, level })
    }

    /// Judges all claims. `alone` judges one by itself, at the level that it states.
    pub(crate) fn judge(self, claims: &[&ClaimTable], alone: impl Fn(&ClaimTable) -> Judged) -> Vec<Judged> {
        let at = |claim: &ClaimTable, divisor: usize| {
            alone(&ClaimTable {
                level: self.level / divisor as f64,
                ..claim.clone()
            })
        };
        let strength = |claim: &&ClaimTable| {
            let monotone = claim.given.is_none();
            Strength::find(self.claims, monotone, |j| at(claim, j).verdict)
        };
        let strengths: Vec<Strength> = claims.iter().map(strength).collect();
        let sides = [Verdict::Holds, Verdict::DoesNotHold].map(|side| {
            let of_side = |of: &Strength| if of.verdict == side { of.divisor } else { 0 };
            let divisors: Vec<usize> = strengths.iter().map(of_side).collect();
            holm(&divisors, self.claims)
        });
        // An open claim is judged at the smaller level of the two steps at which the sides ended.
        let decided = |side: &Vec<Option<usize>>| side.iter().flatten().count();
        let open = self.claims - sides.iter().map(decided).min().unwrap_or(0);
        let judge = |(i, claim): (usize, &&ClaimTable)| {
            let certain = sides.iter().find_map(|side| side[i]);
            let mut judged = at(claim, certain.unwrap_or(open));
            let says = matches!(judged.verdict, Verdict::Holds | Verdict::DoesNotHold);
            if certain.is_none() && says {
                let why = "the cells that meet its condition change with the correction's levels, and so does the \
                    verdict";
                judged = undecided(claim, judged.level, why);
            }
            judged.line.push_str(&self.words());
            judged
        };
        claims.iter().enumerate().map(judge).collect()
    }

    fn words(self) -> String {
        match self.claims {
            1 => String::new(),
            claims => format!(" Corrected over {claims} claims."),
        }
    }
}

/// Returns a claim at the level at which it is certain whatever the others say (Bonferroni), if it is of a family.
pub(crate) fn strictest(claim: &ClaimTable, file: &ExperimentFile) -> ClaimTable {
    let level = Family::of(file).map_or(claim.level, |of| of.level / of.claims as f64);
    ClaimTable { level, ..claim.clone() }
}

impl Strength {
    /// Finds how far down a claim is decided, up to j = `most`. If it is decided at a level, it is so at every larger
    /// one where `monotone`; otherwise all levels are tried.
    fn find(most: usize, monotone: bool, verdict_at: impl Fn(usize) -> Verdict) -> Self {
        let verdict = verdict_at(1);
        if !matches!(verdict, Verdict::Holds | Verdict::DoesNotHold) {
            return Self { verdict, divisor: 0 };
        }
        let (mut divisor, mut above) = (1, most + 1);
        while above - divisor > 1 {
            let next = if monotone {
                divisor + (above - divisor) / 2
            } else {
                divisor + 1
            };
            if verdict_at(next) == verdict {
                divisor = next;
            } else {
                above = next;
            }
        }
        Self { verdict, divisor }
    }
}

/// Returns for each claim the j of the level / j at which Holm's step-down over `among` claims makes it certain. Claim
/// i is certain by itself at level / j for every j up to `divisors[i]`.
fn holm(divisors: &[usize], among: usize) -> Vec<Option<usize>> {
    let mut order: Vec<usize> = (0..divisors.len()).collect();
    order.sort_by_key(|claim| std::cmp::Reverse(divisors[*claim]));
    let mut certain = vec![None; divisors.len()];
    for (step, claim) in order.into_iter().enumerate() {
        let needed = among - step;
        if divisors[claim] < needed {
            break;
        }
        certain[claim] = Some(needed);
    }
    certain
}

#[cfg(test)]
mod tests {
    use super::*;

    /// p-values 0.01, 0.04, 0.03, 0.005 at 0.05 stand at 0.05/4, 0.05/1, 0.05/1, 0.05/4 at least. Holm: 0.005 is below
    /// 0.05/4 and 0.01 below 0.05/3; 0.03 is above 0.05/2 and ends the procedure.
    #[test]
    fn holm_by_hand() {
        assert_eq!(holm(&[4, 1, 1, 4], 4), [Some(4), None, None, Some(3)]);
        assert_eq!(holm(&[0, 0, 4, 0], 4), [None, None, Some(4), None]);
        assert_eq!(holm(&[1, 2, 3, 4], 4), [Some(1), Some(2), Some(3), Some(4)]);
        assert_eq!(holm(&[3, 3, 3, 3], 4), [None; 4]);
        assert!(holm(&[], 0).is_empty());
    }

    /// The same claims as Holm's procedure on the p-values themselves.
    #[test]
    fn the_divisors_give_what_the_p_values_give() {
        let mut z = vec![0.0; 4000];
        let mut stream = asobench_identification::signal::stream(1, 0, asobench_identification::signal::Purpose::Input);
        asobench_identification::signal::normal::fill_standard_normal(&mut stream, &mut z);
        let mut decided = [0; 2];
        for z in z.chunks_exact(8) {
            let p: Vec<f64> = z.iter().map(|z| 0.1 * z.abs()).collect();
            let divisor = |p: &f64| (1..=8).rev().find(|j| *p <= 0.05 / *j as f64).unwrap_or(0);
            let divisors: Vec<usize> = p.iter().map(divisor).collect();
            let mut expected = super::super::decision_rule::holm(&p, 8, 0.05);
            expected.sort_unstable();
            let found = holm(&divisors, 8);
            let found: Vec<usize> = (0..8).filter(|i| found[*i].is_some()).collect();
            assert_eq!(found, expected, "{p:?}");
            decided[usize::from(!found.is_empty())] += 1;
        }
        assert!(decided.iter().all(|count| *count > 20), "{decided:?}");
    }

    #[test]
    fn how_far_down_a_verdict_stands() {
        use Verdict::{DoesNotHold, Holds, HoldsInPart, Undecided};
        for last in 0..=12 {
            let verdict = |j: usize| if j <= last { Holds } else { Undecided };
            for monotone in [true, false] {
                let found = Strength::find(9, monotone, verdict);
                assert_eq!(found.divisor, last.min(9), "{last}, {monotone}");
            }
        }
        // It stands at level / 3 again, but not at level / 2.
        let gap = |j: usize| if j == 2 { Undecided } else { DoesNotHold };
        assert_eq!(Strength::find(9, false, gap).divisor, 1);
        let part = Strength::find(9, true, |_| HoldsInPart);
        assert_eq!((part.verdict, part.divisor), (HoldsInPart, 0));
    }
}
