//! The number of trials that each cell should have, from the rule of the file and the stored blocks.

use crate::design::Experiment;
use crate::design::file::{TrialRule, Until, UntilDecided, UntilStatistic};
use crate::run::block_file::{BlockFolder, StoredBlock};
use crate::run::event::{CampaignError, go_on};
use crate::run::resume::missing;
use crate::run::runner::Span;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The stored blocks of a study, and the rule for its trials.
pub(crate) struct Rounds<'a> {
    pub(crate) experiment: &'a Experiment,
    pub(crate) rule: &'a TrialRule,
    pub(crate) blocks: &'a BlockFolder<'a>,
    /// The stored blocks of every cell, ascending and without overlap.
    pub(crate) stored: &'a [Vec<StoredBlock>],
}

impl Rounds<'_> {
    /// Returns the end of the last stored trial of a cell.
    pub(crate) fn extent(&self, cell: usize) -> u64 {
        let last = self.stored[cell].last();
        last.map_or(0, |block| block.span.trials.end)
    }

    /// Checks that the rule asks for no fewer trials than there are.
    ///
    /// # Errors
    /// [`CampaignError::Fewer`], with the results' folder.
    pub(crate) fn check_extent(&self, folder: &Path) -> Result<(), CampaignError> {
        let (_, asked) = self.rule.extent();
        for cell in 0..self.stored.len() {
            let there = self.extent(cell);
            let asked = self.experiment.trials_of(cell, asked);
            if there > asked {
                let folder = folder.display().to_string();
                return Err(CampaignError::Fewer {
                    folder,
                    cell,
                    there,
                    asked,
                });
            }
        }
        Ok(())
    }

    /// Returns the first target of each cell: a fixed number, or the first step of the rule that covers the stored
    /// trials. A step is left behind only when it missed its target, so earlier steps need no second look. A
    /// deterministic cell has one trial, whatever the rule.
    pub(crate) fn first_targets(&self) -> Vec<u64> {
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

    /// Raises the targets of cells that need more trials by the rule. Returns false if the rule is met. A cell with
    /// trials still missing is not raised. `is_decided` returns whether the stored trials decide the claim of the rule.
    pub(crate) fn raise(
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

    /// Doubles the trials of every cell if a claim is not decided. Returns false if it is, or if the maximum is
    /// reached.
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

    /// Doubles the trials of every cell whose measure is not known well enough. Returns false if there is none.
    fn raise_unknown(&self, targets: &mut [u64], until: &Until, stop: &AtomicBool) -> Result<bool, CampaignError> {
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

    /// Whether all trials of a cell below `target` are stored.
    fn is_whole(&self, cell: usize, target: u64) -> bool {
        self.missing(cell, target).next().is_none()
    }

    /// Returns the ranges of a cell's trials below `target` that no block covers.
    pub(crate) fn missing(&self, cell: usize, target: u64) -> impl Iterator<Item = Span> {
        missing(&self.stored[cell], cell, target)
    }
}

fn next_step(trials: u64, until: &Until) -> u64 {
    trials.saturating_mul(2).min(until.maximum)
}
