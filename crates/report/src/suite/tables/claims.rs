//! Sentences on which method to use when, where the results are certain.

use super::{Group, NOISES, Tables, efficient};
use asobench_study::suite::{MethodResults, paired_in};
use std::collections::BTreeSet;

/// So many standard errors make a difference of two methods certain.
const CERTAIN: f64 = 4.0;
/// A claim names at most so many methods that are not told apart from the best.
const ALIKE: usize = 2;

impl Tables<'_> {
    /// Which method to use when, where that is certain.
    pub(in crate::suite) fn claims(&self) -> Vec<String> {
        self.groups.iter().filter_map(|of| self.claim(of)).collect()
    }

    /// The claim of a group: its first method is certainly nearer to the truth, run by run on the same records, than
    /// all others but [`ALIKE`], and certainly farther than none.
    fn claim(&self, group: &Group) -> Option<String> {
        let ranked = self.distinct(group);
        let ((first, score), others) = ranked.split_first()?;
        let mut alike = Vec::new();
        for (other, _) in others {
            let lead = lead(first, other, &group.members);
            if lead < -CERTAIN {
                return None;
            }
            if lead <= CERTAIN {
                alike.push(format!("`{}`", other.method));
            }
        }
        let behind = others.len() - alike.len();
        if alike.len() > ALIKE || behind == 0 {
            return None;
        }
        let when = match group.words.as_str() {
            "all" => "Over all scenarios".to_owned(),
            words if NOISES.contains(&words) => format!("Where the noise model is {words}"),
            words => format!("Where the difficulty is {words}"),
        };
        let not_told_apart = if alike.is_empty() {
            String::new()
        } else {
            format!(" (or {}, not told apart from it)", alike.join(" or "))
        };
        let others = if alike.is_empty() { "" } else { " other" };
        Some(format!(
            "{when}, use `{}`{not_told_apart}: efficiency {}, certainly nearer to the truth than {behind}{others} \
             methods.",
            first.method,
            efficient(score.efficiency[0]).text
        ))
    }
}

/// In how many runs of some scenarios, which have equal weights, the first method is nearer to the truth than the
/// second one, less in how many it is farther, in standard errors of equal methods (McNemar's, by scenario), so that a
/// few runs are not certain.
fn lead(first: &MethodResults, second: &MethodResults, members: &BTreeSet<usize>) -> f64 {
    let (mut sum, mut square) = (0.0, 0.0);
    for i in members.iter().copied() {
        if let Some(found) = paired_in(&first.scenarios[i], &second.scenarios[i]) {
            sum += found.win - found.loss;
            square += (found.win + found.loss) / first.scenarios[i].d.len() as f64;
        }
    }
    if square > 0.0 { sum / square.sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asobench_study::suite::ScenarioResults;

    fn method(scenarios: &[(usize, f64)]) -> MethodResults {
        let scenarios = scenarios.iter().map(|(runs, d)| ScenarioResults {
            d: vec![Some(*d); *runs],
            ..ScenarioResults::default()
        });
        MethodResults {
            scenarios: scenarios.collect(),
            ..MethodResults::default()
        }
    }

    /// By hand: n wins of n are n / sqrt(n) standard errors of equal methods; with 4 and 16 runs in two scenarios of
    /// equal weight 2 / sqrt(1/4 + 1/16).
    #[test]
    fn a_lead_is_in_errors_of_equal_methods() {
        let near = method(&[(4, 1.0), (16, 1.0)]);
        let far = method(&[(4, 2.0), (16, 3.0)]);
        let of = |members: &[usize]| lead(&near, &far, &members.iter().copied().collect());
        assert_eq!(of(&[1]), 4.0);
        assert_eq!(of(&[0]), 2.0);
        assert!((of(&[0, 1]) - 2.0 / 0.3125_f64.sqrt()).abs() < 1e-12);
        let all = [0, 1].into_iter().collect();
        assert_eq!(lead(&far, &near, &all), -of(&[0, 1]));
        assert_eq!(lead(&near, &near, &all), 0.0);
    }
}
