//! A pilot: a few trials of every cell, summarised in memory. It touches no folder, and its random numbers are none of
//! the study's.

use crate::design::Experiment;
use crate::outcome::summary::{CellPart, Summary};
use crate::outcome::tally::CellTally;
use crate::run::runner::{Block, Keep, RunError, Span, run_spans};
use std::convert::Infallible;
use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Cells whose tallies are in memory at once.
const CELLS: usize = 256;

/// The findings of a pilot.
#[derive(Clone, Debug)]
pub struct Pilot {
    /// Its summary. Only what claims are judged by is in it: no rows, no times.
    pub summary: Summary,
    /// The trials of every cell.
    trials: u64,
    /// The time that threads spent on them, summed over the threads.
    spent: Duration,
}

/// Returns the seed of a study's pilot: the study's with its highest bit inverted. No run of the study has it,
/// nor its confirmation unless that is asked for by this very number.
pub fn pilot_seed(seed: u64) -> u64 {
    seed ^ (1 << 63)
}

impl Pilot {
    /// Simulates so many trials of every cell; a deterministic cell has one. The experiment should have the seed
    /// [`pilot_seed`]. `on_block` receives the trials of every block.
    ///
    /// # Errors
    /// [`RunError`].
    ///
    /// # Panics
    /// With the panic of an estimator.
    pub fn run(
        experiment: &Experiment,
        trials: u64,
        threads: usize,
        stop: &AtomicBool,
        mut on_block: impl FnMut(u64),
    ) -> Result<Self, RunError<Infallible>> {
        let mut parts = Vec::new();
        let mut spent = Duration::ZERO;
        let all = experiment.cells.len();
        for first in (0..all).step_by(CELLS) {
            let some = first..all.min(first + CELLS);
            let mut add = |block: &Block| {
                spent += block.spent.total();
                on_block(block.span.len());
            };
            let tallies = tallies(experiment, some.clone(), trials, threads, stop, &mut add)?;
            parts.extend(
                some.zip(&tallies)
                    .map(|(cell, tally)| CellPart::new(experiment, cell, tally)),
            );
        }
        Ok(Self {
            summary: Summary::new(experiment, parts),
            trials,
            spent,
        })
    }

    /// Returns the seconds that so many trials of every cell take on some threads, if they go on like the pilot's.
    pub fn seconds(&self, trials: u64, threads: usize) -> f64 {
        let rounds = trials as f64 / self.trials.max(1) as f64;
        self.spent.as_secs_f64() * rounds / threads.max(1) as f64
    }
}

/// Returns the tallies of trials 0 ... `trials` - 1 of some cells.
fn tallies(
    experiment: &Experiment,
    cells: Range<usize>,
    trials: u64,
    threads: usize,
    stop: &AtomicBool,
    add: &mut impl FnMut(&Block),
) -> Result<Vec<CellTally>, RunError<Infallible>> {
    let whole = |cell| Span {
        cell,
        trials: 0..experiment.trials_of(cell, trials),
    };
    let spans: Vec<Span> = cells.clone().map(whole).collect();
    let mut tallies = vec![CellTally::default(); spans.len()];
    let consume = |block: Block| {
        add(&block);
        tallies[block.span.cell - cells.start].merge(block.tally);
        Ok(())
    };
    run_spans(
        experiment,
        (&spans, None),
        Keep::Tally,
        threads,
        stop,
        |block| block,
        consume,
    )?;
    Ok(tallies)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::file::experiment_file::ExperimentFile;
    use crate::design::file::rule::TrialRule;
    use crate::run::campaign::Campaign;
    use crate::run::campaign::RunOptions;

    const FILE: &str = "measures = ['e_a']\ncompare = [['iv(4)', 'ls']]\n\
        [settings]\nwindow = [98, 218]\neta = [0, 10]\n\
        [[slopes]]\nmeasure = 'e_a'\nover = 'window'\n";

    fn experiment(seed: u64) -> Experiment {
        let mut file = ExperimentFile::parse(FILE).unwrap();
        file.seed = seed;
        Experiment::new(file).unwrap()
    }

    fn pilot(seed: u64, threads: usize) -> Pilot {
        let stop = AtomicBool::new(false);
        Pilot::run(&experiment(seed), 64, threads, &stop, |_| ()).unwrap()
    }

    /// The same bits as a run in a folder with the pilot's seed.
    #[test]
    fn a_pilot_is_a_run_without_a_folder() {
        let seed = pilot_seed(2023);
        let experiment = experiment(seed);
        let folder = tempfile::tempdir().unwrap();
        let options = RunOptions {
            threads: 1,
            ..RunOptions::default()
        };
        let rule = TrialRule::Fixed(64);
        let campaign = Campaign::open(folder.path(), &experiment, rule, options).unwrap();
        let stop = AtomicBool::new(false);
        let expected = campaign.run(&stop, |_| (), |_| Vec::new());
        let expected = serde_json::to_value(expected.unwrap()).unwrap();
        for threads in [1, 3] {
            let found = pilot(seed, threads);
            assert_eq!(serde_json::to_value(&found.summary).unwrap(), expected);
            let seconds = found.seconds(640, 2);
            assert!((seconds / (5.0 * found.spent.as_secs_f64()) - 1.0).abs() < 1e-12);
        }
        let study = serde_json::to_value(pilot(2023, 1).summary).unwrap();
        assert_ne!(study["cells"], expected["cells"]);
    }

    /// By hand: 2^63 more than the study's, and back again above 2^63.
    #[test]
    fn the_seed_of_a_pilot_is_another() {
        assert_eq!(pilot_seed(2023), 9_223_372_036_854_777_831);
        assert_eq!(pilot_seed(9_223_372_036_854_777_831), 2023);
    }

    #[test]
    fn a_pilot_can_be_stopped() {
        let stop = AtomicBool::new(true);
        let stopped = Pilot::run(&experiment(1), 64, 1, &stop, |_| ());
        assert!(matches!(stopped, Err(RunError::Interrupted { .. })));
    }
}
