//! How many trials each cell is to have: by the rule of the file and what is there.

use super::blocks::{BlockFolder, StoredBlock};
use super::campaign::{CampaignError, go_on};
use super::experiment::Experiment;
use super::file::{TrialRule, Until, UntilDecided, UntilStatistic};
use super::runner::Span;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

/// The blocks of a study that are there, and the rule for its trials.
pub(super) struct Rounds<'a> {
    pub(super) experiment: &'a Experiment,
    pub(super) rule: &'a TrialRule,
    pub(super) blocks: &'a BlockFolder<'a>,
    /// For every cell the blocks that are there, ascending and without overlap.
    pub(super) stored: &'a [Vec<StoredBlock>],
}

impl Rounds<'_> {
    /// The end of the last trial of a cell that is there.
    pub(super) fn extent(&self, cell: usize) -> u64 {
        let last = self.stored[cell].last();
        last.map_or(0, |block| block.span.trials.end)
    }

    /// Where each cell begins: a fixed number, or the first step of the rule that covers what is
    /// there. A step is only left behind when its target was missed, so the steps before need no
    /// second look. A deterministic cell has one trial, whatever the rule.
    pub(super) fn first_targets(&self) -> Vec<u64> {
        let first = |cell: usize| match self.rule {
            TrialRule::Fixed(trials) => self.experiment.trials_of(cell, *trials),
            TrialRule::Until(until) => {
                let mut target = self.experiment.trials_of(cell, until.minimum);
                while target < self.extent(cell).min(until.maximum) {
                    target = next_step(target, until);
                }
                target
            }
            TrialRule::Decided(until) => {
                let there = (0..self.stored.len()).map(|cell| self.extent(cell)).max();
                let mut target = until.minimum;
                while target < there.unwrap_or(0).min(until.maximum) {
                    target = until.next(target);
                }
                self.experiment.trials_of(cell, target)
            }
        };
        (0..self.stored.len()).map(first).collect()
    }

    /// Raises the trials of the cells that need more of them by the rule; false where it is met. A
    /// cell of which trials are still missing is not raised. `is_decided` tells whether what is
    /// there decides the claim of the rule.
    pub(super) fn raise(
        &self,
        targets: &mut [u64],
        stop: &AtomicBool,
        is_decided: impl Fn() -> Result<bool, CampaignError>,
    ) -> Result<bool, CampaignError> {
        match self.rule {
            TrialRule::Fixed(_) => Ok(false),
            TrialRule::Until(until) => self.raise_unknown(targets, until, stop),
            TrialRule::Decided(until) => self.raise_all(targets, until, is_decided),
        }
    }

    /// Doubles the trials of every cell where a claim is not decided; false where it is, or where
    /// there are no more.
    fn raise_all(
        &self,
        targets: &mut [u64],
        until: &UntilDecided,
        is_decided: impl Fn() -> Result<bool, CampaignError>,
    ) -> Result<bool, CampaignError> {
        let most = targets.iter().max().copied().unwrap_or(0);
        let next = until.next(most);
        let raised = |cell: usize| self.experiment.trials_of(cell, next);
        let more = (0..targets.len()).any(|cell| raised(cell) > targets[cell]);
        let whole = || (0..targets.len()).all(|cell| self.is_whole(cell, targets[cell]));
        if !more || !whole() || is_decided()? {
            return Ok(false);
        }
        (0..targets.len()).for_each(|cell| targets[cell] = raised(cell));
        Ok(true)
    }

    /// Doubles the trials of every cell whose measure is not known well enough; false where none is
    /// left.
    fn raise_unknown(
        &self,
        targets: &mut [u64],
        until: &Until,
        stop: &AtomicBool,
    ) -> Result<bool, CampaignError> {
        let mut raised = false;
        for (cell, target) in targets.iter_mut().enumerate() {
            go_on(stop)?;
            let most = self.experiment.trials_of(cell, until.maximum);
            if *target < most && self.is_whole(cell, *target) && !self.is_known(cell, until)? {
                *target = next_step(*target, until);
                raised = true;
            }
        }
        Ok(raised)
    }

    fn is_known(&self, cell: usize, until: &Until) -> Result<bool, CampaignError> {
        let (output, measure) = self.experiment.target(until)?;
        let tally = self.blocks.tally(&self.stored[cell])?;
        let sample = &tally.outputs[output].samples[measure];
        let (value, mcse) = match until.statistic {
            UntilStatistic::Median => {
                let quantile = sample.quantile(0.5, until.until.worse());
                (quantile.value, quantile.mcse)
            }
            UntilStatistic::Mean => (sample.mean().value, sample.mean().mcse),
            UntilStatistic::Rmse => (sample.rmse().value, sample.rmse().mcse),
        };
        Ok(mcse <= until.relative_mcse * value.abs())
    }

    /// Whether all trials of a cell below `target` are there.
    fn is_whole(&self, cell: usize, target: u64) -> bool {
        self.missing(cell, target).next().is_none()
    }

    /// The ranges of a cell's trials below `target` that no block covers.
    pub(super) fn missing(&self, cell: usize, target: u64) -> impl Iterator<Item = Span> {
        let stored = self.stored[cell].iter();
        let trials = stored.map(|block| block.span.trials.clone());
        gaps(trials, 0..target).map(move |trials| Span { cell, trials })
    }
}

/// What ascending ranges without overlap leave of a whole.
pub(super) fn gaps(
    ranges: impl Iterator<Item = Range<u64>> + Clone,
    whole: Range<u64>,
) -> impl Iterator<Item = Range<u64>> {
    let ends = std::iter::once(whole.start).chain(ranges.clone().map(|range| range.end));
    let starts = ranges.map(|range| range.start).chain([whole.end]);
    let between = ends.zip(starts).map(|(from, to)| from..to);
    between.filter(|range| range.start < range.end)
}

fn next_step(trials: u64, until: &Until) -> u64 {
    trials.saturating_mul(2).min(until.maximum)
}
