//! Counts of what became of trials.

use asobench_identification::estimator::{FailureKind, Reason};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The most failed trials of a kind that a tally lists by number.
pub(crate) const LISTED: usize = 10;

/// The most reasons of programs that are counted one by one.
pub(crate) const REASONS: usize = 20;

/// Counts of an output.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcomes {
    /// Trials.
    pub trials: u64,
    /// Trials by failure.
    pub failures: BTreeMap<String, u64>,
    /// The numbers of the first trials with each failure, ascending: all of them, or ten. Summaries of older
    /// builds have none.
    #[serde(default)]
    pub failed_trials: BTreeMap<String, Vec<u64>>,
    /// Trials with an unstable A-hat, failed or not.
    pub unstable: u64,
    /// Trials in which this or an earlier pass had an unstable A-hat, reported or not.
    #[serde(default)]
    pub unstable_so_far: u64,
    /// Trials with a failure or an unstable A-hat: for shares only, since a trial with an unstable A-hat and no failure
    /// keeps its measures. Older summaries are without it: [`Self::lost_trials`].
    #[serde(default)]
    pub lost: u64,
}

impl Outcomes {
    /// Returns the number of trials with a failure. Models without a minimum that the study counts are not failures.
    pub fn failed(&self) -> u64 {
        let lost = self.failures.iter().filter(|(kind, _)| !is_counted(kind));
        lost.map(|(_, count)| count).sum()
    }

    /// Returns the number of lost trials (failed or unstable), and whether it is exact. Summaries of older versions are
    /// without it. Then it is the number of failed and of unstable trials, in which a trial that is both counts twice.
    pub fn lost_trials(&self) -> (u64, bool) {
        if self.lost >= self.failed().max(self.unstable) {
            return (self.lost, true);
        }
        ((self.failed() + self.unstable).min(self.trials), false)
    }

    /// Counts a failed trial. Trials come in ascending order.
    pub(crate) fn add_failure(&mut self, kind: &str, trial: u64) {
        if let (Some(count), Some(listed)) = (self.failures.get_mut(kind), self.failed_trials.get_mut(kind)) {
            *count += 1;
            if listed.len() < LISTED {
                listed.push(trial);
            }
        } else {
            self.failures.insert(kind.to_owned(), 1);
            self.failed_trials.insert(kind.to_owned(), vec![trial]);
            self.fold_reasons();
        }
    }

    /// Counts programs' reasons beyond the first [`REASONS`], in alphabetical order, as one. A reason that is among the
    /// first of all trials is so among those of any part of them: the counts do not depend on the order of trials.
    fn fold_reasons(&mut self) {
        let others = FailureKind::External(Reason::others());
        let of_program = |kind: &&String| kind.starts_with(Reason::PREFIX) && *kind != others.name();
        let kinds = self.failures.keys().filter(of_program).skip(REASONS);
        let beyond: Vec<String> = kinds.cloned().collect();
        for kind in beyond {
            let count = self.failures.remove(&kind).unwrap_or_default();
            *self.failures.entry(others.name().to_owned()).or_default() += count;
            let trials = self.failed_trials.remove(&kind).unwrap_or_default();
            let listed = self.failed_trials.entry(others.name().to_owned()).or_default();
            listed.extend(trials);
            listed.sort_unstable();
            listed.truncate(LISTED);
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for (kind, trials) in &other.failed_trials {
            let listed = self.failed_trials.entry(kind.clone()).or_default();
            listed.extend(trials);
            listed.sort_unstable();
            listed.truncate(LISTED);
        }
        self.trials += other.trials;
        self.unstable += other.unstable;
        self.unstable_so_far += other.unstable_so_far;
        self.lost += other.lost;
        for (kind, count) in &other.failures {
            *self.failures.entry(kind.clone()).or_default() += count;
        }
        self.fold_reasons();
    }
}

/// Whether trials of this kind count ([`FailureKind::is_counted`]).
pub(crate) fn is_counted(kind: &str) -> bool {
    kind.parse().is_ok_and(FailureKind::is_counted)
}
