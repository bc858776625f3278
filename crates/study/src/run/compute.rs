//! Computes spans of trials into block files, for runs in a folder and for shards.

use crate::design::experiment::Experiment;
use crate::design::file::experiment_file::Store;
use crate::outcome::spent::{Spent, Watch};
use crate::outcome::tally::CellTally;
use crate::run::blocks::{BlockError, BlockFolder, Content, EncodedBlock, StoredBlock};
use crate::run::event::Event;
use crate::run::runner::{Block, Delivery, Keep, RunError, Span, run_spans};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// What to compute, and where to write it.
pub(crate) struct Work<'a> {
    pub(crate) experiment: &'a Experiment,
    pub(crate) blocks: &'a BlockFolder<'a>,
    pub(crate) spans: &'a [Span],
    /// Trials in a block; `None`: the default.
    pub(crate) block: Option<u64>,
    pub(crate) threads: usize,
}

/// Tallies are written when a cell is whole, or after this time: so much is lost if the process is killed.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// A block on its way from the thread that computed it to its file.
struct Computed {
    span: Span,
    failures: u64,
    spent: Spent,
    content: Computation,
}

/// What a block keeps.
enum Computation {
    /// Rows and their tally, encoded where they were computed.
    Rows(Result<EncodedBlock, BlockError>),
    /// The tally alone.
    Tally(CellTally),
}

impl Computed {
    fn new(block: Block, keep: bool, blocks: &BlockFolder<'_>) -> Self {
        let mut watch = Watch::start();
        let Block {
            span,
            rows,
            tally,
            mut spent,
        } = block;
        let outputs = tally.outputs.iter();
        let failures = outputs.map(|output| output.outcomes.failed()).sum();
        let content = if keep {
            let rows = Some(rows);
            Computation::Rows(blocks.encode(span.clone(), &Content { tally, rows }))
        } else {
            Computation::Tally(tally)
        };
        spent.storage += watch.lap();
        Self {
            span,
            failures,
            spent,
            content,
        }
    }
}

impl Delivery for Computed {
    fn trials(&self) -> u64 {
        self.span.len()
    }
}

/// Tallies that wait to be written. Those of neighbouring trials are put together, so that a cell becomes one file.
#[derive(Default)]
struct Waiting {
    /// By cell and first trial, with the end of the trials.
    tallies: BTreeMap<(usize, u64), (u64, CellTally)>,
    since: Option<Instant>,
}

impl Waiting {
    fn add(&mut self, span: Span, mut tally: CellTally) {
        let Span { cell, trials } = span;
        self.since.get_or_insert_with(Instant::now);
        let (mut first, mut end) = (trials.start, trials.end);
        let before = self.tallies.range((cell, 0)..(cell, first)).next_back();
        let before = before.filter(|(_, (end, _))| *end == first);
        if let Some(key) = before.map(|(key, _)| *key)
            && let Some((_, before)) = self.tallies.remove(&key)
        {
            first = key.1;
            tally.merge(&before);
        }
        if let Some((after, behind)) = self.tallies.remove(&(cell, end)) {
            end = after;
            tally.merge(&behind);
        }
        self.tallies.insert((cell, first), (end, tally));
    }

    fn is_long(&self) -> bool {
        self.since
            .is_some_and(|since| since.elapsed() > LONGEST_WAIT)
    }

    /// Takes those of a cell, or all.
    fn take(&mut self, cell: Option<usize>) -> Vec<(Span, CellTally)> {
        let of_cell = |(of, _): &(usize, u64), _: &mut _| cell.is_none_or(|cell| cell == *of);
        let taken = self.tallies.extract_if(.., of_cell);
        let span = |((cell, first), (end, tally))| {
            let trials = first..end;
            (Span { cell, trials }, tally)
        };
        let taken = taken.map(span).collect();
        if self.tallies.is_empty() {
            self.since = None;
        }
        taken
    }
}

impl Work<'_> {
    /// Computes the spans and writes them to files: one for each block with rows, or one for the trials of a cell. `file`
    /// receives each written file, and returns whether it completes the trials of a cell.
    ///
    /// # Errors
    /// [`RunError`]; what is finished stays.
    pub(crate) fn run(
        &self,
        stop: &AtomicBool,
        mut on_event: impl FnMut(Event),
        mut file: impl FnMut(StoredBlock) -> Result<bool, BlockError>,
    ) -> Result<(), RunError<BlockError>> {
        let kept = self.experiment.file.store == Store::Trials;
        let keep = if kept { Keep::Rows } else { Keep::Tally };
        let encode = |block: Block| Computed::new(block, kept, self.blocks);
        let mut left: BTreeMap<usize, u64> = BTreeMap::new();
        for span in self.spans {
            *left.entry(span.cell).or_default() += span.len();
        }
        let mut waiting = Waiting::default();
        // Returns how many cells became whole.
        let mut write = |blocks: &mut dyn Iterator<Item = Result<EncodedBlock, BlockError>>| {
            let mut whole = 0;
            for encoded in blocks {
                whole += usize::from(file(encoded?.write()?)?);
            }
            Ok(whole)
        };
        let encoded = |(span, tally): (Span, CellTally)| {
            let rows = None;
            self.blocks.encode(span, &Content { tally, rows })
        };
        let store = |computed: Computed| {
            let mut watch = Watch::start();
            let Computed {
                span,
                failures,
                mut spent,
                content,
            } = computed;
            let (cell, trials) = (span.cell, span.len());
            let whole = match content {
                Computation::Rows(encoded) => write(&mut std::iter::once(encoded))?,
                Computation::Tally(tally) => {
                    waiting.add(span, tally);
                    let left = left.entry(cell).or_default();
                    *left -= trials;
                    let ready = match (*left, waiting.is_long()) {
                        (_, true) => waiting.take(None),
                        (0, false) => waiting.take(Some(cell)),
                        _ => Vec::new(),
                    };
                    write(&mut ready.into_iter().map(encoded))?
                }
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
        let ended = run_spans(
            self.experiment,
            spans,
            keep,
            self.threads,
            stop,
            encode,
            store,
        );
        // Those of a run that ended early.
        let rest = write(&mut waiting.take(None).into_iter().map(encoded));
        ended.and(rest.map(drop).map_err(RunError::Consumer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ops::Range;

    /// In whatever order blocks arrive, those of neighbouring trials become one, and gaps stay.
    #[test]
    fn neighbours_are_put_together() {
        let mut waiting = Waiting::default();
        for (cell, from, to) in [(1, 20, 30), (0, 5, 9), (1, 0, 10), (1, 40, 50), (1, 10, 20)] {
            let tally = CellTally {
                trials: to - from,
                ..CellTally::default()
            };
            let trials = from..to;
            waiting.add(Span { cell, trials }, tally);
        }
        let spans = |taken: Vec<(Span, CellTally)>| -> Vec<(usize, Range<u64>, u64)> {
            let of = |(span, tally): (Span, CellTally)| (span.cell, span.trials, tally.trials);
            taken.into_iter().map(of).collect()
        };
        assert_eq!(
            spans(waiting.take(Some(1))),
            [(1, 0..30, 30), (1, 40..50, 10)]
        );
        assert!(waiting.since.is_some());
        assert_eq!(spans(waiting.take(None)), [(0, 5..9, 4)]);
        assert!(waiting.since.is_none());
    }
}
