//! Computes spans of trials into block files, for runs in a folder and for shards.

use crate::design::experiment::Experiment;
use crate::design::file::experiment_file::Store;
use crate::outcome::spent::{Spent, Watch};
use crate::run::blocks::{BlockError, BlockFolder, Content, EncodedBlock, StoredBlock};
use crate::run::event::Event;
use crate::run::runner::{Block, Delivery, Keep, RunError, Span, run_spans};
use std::sync::atomic::AtomicBool;

/// What to compute, and where to write it.
pub(crate) struct Work<'a> {
    pub(crate) experiment: &'a Experiment,
    pub(crate) blocks: &'a BlockFolder<'a>,
    pub(crate) spans: &'a [Span],
    /// Trials in a block; `None`: the default.
    pub(crate) block: Option<u64>,
    pub(crate) threads: usize,
}

/// A block on its way from the thread that computed it to its file.
struct Computed {
    trials: u64,
    failures: u64,
    spent: Spent,
    encoded: Result<EncodedBlock, BlockError>,
}

impl Computed {
    pub(crate) fn new(block: Block, keep: bool, blocks: &BlockFolder<'_>) -> Self {
        let mut watch = Watch::start();
        let Block {
            span,
            rows,
            tally,
            mut spent,
        } = block;
        let (trials, outputs) = (span.len(), tally.outputs.iter());
        let failures = outputs.map(|output| output.outcomes.failed()).sum();
        let rows = keep.then_some(rows);
        let encoded = blocks.encode(span, &Content { tally, rows });
        spent.storage += watch.lap();
        Self {
            trials,
            failures,
            spent,
            encoded,
        }
    }
}

impl Delivery for Computed {
    fn trials(&self) -> u64 {
        self.trials
    }
}

impl Work<'_> {
    /// Computes the spans and writes a file for each block. `file` receives each written block, and returns whether it
    /// completes the trials of a cell.
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
        let store = |computed: Computed| {
            let mut watch = Watch::start();
            let is_whole = file(computed.encoded?.write()?)?;
            let mut spent = computed.spent;
            spent.storage += watch.lap();
            on_event(Event::Block {
                trials: computed.trials,
                failures: computed.failures,
                spent,
            });
            if is_whole {
                on_event(Event::Cell);
            }
            Ok(())
        };
        let spans = (self.spans, self.block);
        run_spans(
            self.experiment,
            spans,
            keep,
            self.threads,
            stop,
            encode,
            store,
        )
    }
}
