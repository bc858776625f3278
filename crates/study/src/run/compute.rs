//! Computes spans of trials into block files, for runs in a folder and for shards.

use crate::design::Experiment;
use crate::design::file::Store;
use crate::outcome::rows::Rows;
use crate::outcome::spent::Watch;
use crate::outcome::tally::CellTally;
use crate::run::block_file::{BlockError, BlockFolder, EncodedBlock, StoredBlock};
use crate::run::event::Event;
use crate::run::runner::{Block, Keep, RunError, Span, run_spans};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// The trials to compute, and where to write them.
pub(crate) struct Work<'a> {
    pub(crate) experiment: &'a Experiment,
    pub(crate) blocks: &'a BlockFolder<'a>,
    pub(crate) spans: &'a [Span],
    /// Trials in a block; `None`: the default.
    pub(crate) block: Option<u64>,
    pub(crate) threads: usize,
}

/// Tallies are written when a span is whole, or after this time: so much is lost if the process is killed.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// The progress of a span, and its tallies that wait to be written. Tallies of neighbouring trials are put together, so
/// that a span becomes one file. Spans stay apart: what they are for, such as a block to be replaced, may need each
/// alone.
struct Waiting {
    span: Span,
    left: u64,
    /// By first trial, with the end of the trials.
    tallies: BTreeMap<u64, (u64, CellTally)>,
}

impl Waiting {
    fn new(span: &Span) -> Self {
        Self {
            span: span.clone(),
            left: span.len(),
            tallies: BTreeMap::new(),
        }
    }

    fn add(&mut self, trials: Range<u64>, mut tally: CellTally) {
        let Range { mut start, mut end } = trials;
        self.left -= end - start;
        let before = self.tallies.range(..start).next_back();
        let before = before.filter(|(_, (end, _))| *end == start);
        if let Some(first) = before.map(|(first, _)| *first)
            && let Some((_, before)) = self.tallies.remove(&first)
        {
            start = first;
            tally.merge(before);
        }
        if let Some((last, behind)) = self.tallies.remove(&end) {
            end = last;
            tally.merge(behind);
        }
        self.tallies.insert(start, (end, tally));
    }

    fn take(&mut self) -> Vec<(Span, CellTally)> {
        let cell = self.span.cell;
        let tallies = std::mem::take(&mut self.tallies).into_iter();
        let block = |(start, (end, tally))| {
            let trials = start..end;
            (Span { cell, trials }, tally)
        };
        tallies.map(block).collect()
    }
}

/// The receiver of a written file, as in [`Work::run`].
type OnFile<'a> = dyn FnMut(StoredBlock, Option<&CellTally>) -> Result<bool, BlockError> + 'a;

/// Takes all that wait.
fn take_all(waiting: &mut BTreeMap<(usize, u64), Waiting>) -> Vec<(Span, CellTally)> {
    waiting.values_mut().flat_map(Waiting::take).collect()
}

impl Work<'_> {
    /// Computes the spans and writes them to files: one for each block with rows, else one for each span, or more if it
    /// takes long. `file` receives each written file, with its tally if it is without rows, and returns whether it
    /// completes the trials of a cell.
    ///
    /// # Errors
    /// [`RunError`]; finished blocks stay.
    pub(crate) fn run(
        &self,
        stop: &AtomicBool,
        mut on_event: impl FnMut(Event),
        mut file: impl FnMut(StoredBlock, Option<&CellTally>) -> Result<bool, BlockError>,
    ) -> Result<(), RunError<BlockError>> {
        let kept = self.experiment.file.store == Store::Trials;
        let keep = if kept { Keep::Rows } else { Keep::Tally };
        // Blocks with rows are encoded where they are computed; nothing else of them waits for the calling thread.
        let encode = |mut block: Block| {
            let mut watch = Watch::start();
            let outputs = block.tally.outputs.iter();
            let failures: u64 = outputs.map(|output| output.outcomes.failed()).sum();
            let encoded = kept.then(|| self.blocks.encode(&block));
            if kept {
                (block.rows, block.tally) = (Rows::default(), CellTally::default());
            }
            block.spent.storage += watch.lap();
            (block, failures, encoded)
        };
        let by_start = |span: &Span| ((span.cell, span.trials.start), Waiting::new(span));
        let mut waiting: BTreeMap<_, Waiting> = self.spans.iter().map(by_start).collect();
        let mut written = Instant::now();
        // Return how many cells became whole.
        let write = |encoded: EncodedBlock, tally: Option<&CellTally>, file: &mut OnFile<'_>| {
            file(encoded.write()?, tally).map(usize::from)
        };
        let write_tallies = |ready: Vec<(Span, CellTally)>, file: &mut OnFile<'_>| {
            let of_one = |(span, tally)| {
                let block = Block::of_tally(span, tally);
                write(self.blocks.encode(&block)?, Some(&block.tally), file)
            };
            ready.into_iter().map(of_one).sum::<Result<usize, BlockError>>()
        };
        let store = |(block, failures, encoded): (Block, u64, Option<Result<EncodedBlock, BlockError>>)| {
            let mut watch = Watch::start();
            let Block {
                span, tally, mut spent, ..
            } = block;
            let trials = span.len();
            let whole = if let Some(encoded) = encoded {
                write(encoded?, None, &mut file)?
            } else {
                let mut ready = Vec::new();
                let until = ..=(span.cell, span.trials.start);
                if let Some((_, of_span)) = waiting.range_mut(until).next_back() {
                    of_span.add(span.trials, tally);
                    if of_span.left == 0 {
                        ready = of_span.take();
                    }
                }
                if written.elapsed() > LONGEST_WAIT {
                    ready.extend(take_all(&mut waiting));
                    written = Instant::now();
                }
                write_tallies(ready, &mut file)?
            };
            spent.storage += watch.lap();
            on_event(Event::Block {
                trials,
                failures,
                spent,
            });
            (0..whole).for_each(|_| on_event(Event::Cell));
            Ok(())
        };
        let spans = (self.spans, self.block);
        let ended = run_spans(self.experiment, spans, keep, self.threads, stop, encode, store);
        // The tallies of a run that ended early.
        let rest = write_tallies(take_all(&mut waiting), &mut file);
        ended.and(rest.map(drop).map_err(RunError::Consumer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::file::experiment_file::ExperimentFile;

    /// In whatever order blocks arrive, those of neighbouring trials become one, and gaps stay.
    #[test]
    fn neighbours_are_put_together() {
        let span = |trials| Span { cell: 1, trials };
        let mut waiting = Waiting::new(&span(0..60));
        for trials in [20..30, 0..10, 40..50, 10..20] {
            let tally = CellTally {
                trials: trials.end - trials.start,
                ..CellTally::default()
            };
            waiting.add(trials, tally);
        }
        assert_eq!(waiting.left, 20);
        let of = |(span, tally): (Span, CellTally)| (span, tally.trials);
        let taken: Vec<(Span, u64)> = waiting.take().into_iter().map(of).collect();
        assert_eq!(taken, [(span(0..30), 30), (span(40..50), 10)]);
    }

    /// Spans that touch have files of their own, whatever the blocks.
    #[test]
    fn spans_stay_apart() {
        let text = "trials = 30\n[settings]\nwindow = 18";
        let experiment = Experiment::new(ExperimentFile::parse(text).unwrap()).unwrap();
        let place = tempfile::tempdir().unwrap();
        let blocks = BlockFolder::open(place.path(), &experiment).unwrap();
        let spans = [0..20, 20..30].map(|trials| Span { cell: 0, trials });
        let work = Work {
            experiment: &experiment,
            blocks: &blocks,
            spans: &spans,
            block: Some(4),
            threads: 2,
        };
        let mut found = Vec::new();
        let file = |written: StoredBlock, _: Option<&CellTally>| {
            found.push(written.span);
            Ok(false)
        };
        work.run(&AtomicBool::new(false), |_| (), file).unwrap();
        found.sort_by_key(|span| span.trials.start);
        assert_eq!(found, spans);
    }
}
