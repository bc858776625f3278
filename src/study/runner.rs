//! The runner: blocks of trials over rayon's threads, delivered in order.

use super::{Curves, Experiment, Row, Trial};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};

/// Trials in a block: the unit of work and of delivery. No result depends on it.
const BLOCK: u64 = 256;

/// The rows of a contiguous range of trials of one cell.
pub struct Block {
    /// The cell's index.
    pub cell: usize,
    /// The trials.
    pub trials: Range<u64>,
    /// Their rows: all outputs of the first trial, then of the next.
    pub rows: Vec<Row>,
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunError<E> {
    /// Threads could not be started.
    #[error("cannot start {threads} threads: {reason}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// The reason.
        reason: String,
    },
    /// The `stop` flag was raised.
    #[error("interrupted after {done} of {of} trials")]
    Interrupted {
        /// Trials that were computed, over all cells.
        done: u64,
        /// Trials that were asked for, over all cells.
        of: u64,
    },
    /// The consumer failed.
    #[error(transparent)]
    Consumer(E),
}

/// Runs trials 0 ... `trials` - 1 of every cell of a valid experiment on `threads` threads.
///
/// `consume` sees the blocks in order (cell by cell, trials ascending) on the calling thread, whatever
/// the threads; its error, or raising `stop`, ends the run after the blocks under way. Returns the
/// curves of every cell.
///
/// # Errors
/// [`RunError`].
///
/// # Panics
/// If the experiment is not valid ([`Experiment::validate`]), or with the panic of an estimator.
pub fn run<E>(
    experiment: &Experiment,
    trials: u64,
    threads: usize,
    stop: &AtomicBool,
    consume: impl FnMut(Block) -> Result<(), E>,
) -> Result<Vec<Curves>, RunError<E>> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| RunError::Threads {
            threads,
            reason: error.to_string(),
        })?;
    let curves = experiment
        .cells
        .iter()
        .map(|cell| Curves::new(cell.horizon));
    let shared = Shared {
        experiment,
        trials,
        stop,
        ended: AtomicBool::new(false),
        next: AtomicUsize::new(0),
        curves: Mutex::new(curves.collect()),
    };
    let (sender, receiver) = sync_channel(2 * pool.current_num_threads());
    let delivered = pool.in_place_scope(|scope| {
        scope.spawn_broadcast(|_, _| shared.work(&sender));
        shared.deliver(receiver, consume)
    });
    let of = trials * experiment.cells.len() as u64;
    match delivered {
        Err(error) => Err(RunError::Consumer(error)),
        Ok(done) if done < of => Err(RunError::Interrupted { done, of }),
        Ok(_) => Ok(shared
            .curves
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)),
    }
}

/// Ends the run where a worker or the consumer panics: a block that was taken will never come.
struct EndOnPanic<'a>(&'a AtomicBool);

impl Drop for EndOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

/// What the workers share.
struct Shared<'a> {
    experiment: &'a Experiment,
    trials: u64,
    stop: &'a AtomicBool,
    /// Raised where the consumer failed or a worker panicked.
    ended: AtomicBool,
    /// The next block to be taken.
    next: AtomicUsize,
    curves: Mutex<Vec<Curves>>,
}

impl Shared<'_> {
    fn blocks_per_cell(&self) -> usize {
        self.trials.div_ceil(BLOCK) as usize
    }

    fn blocks(&self) -> usize {
        self.blocks_per_cell() * self.experiment.cells.len()
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.ended.load(Ordering::Relaxed)
    }

    /// One worker: takes blocks in order until none is left.
    fn work(&self, sender: &SyncSender<(usize, Block)>) {
        let _guard = EndOnPanic(&self.ended);
        let mut current: Option<(usize, Trial<'_>, Curves)> = None;
        while !self.stopped() {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            if index >= self.blocks() {
                break;
            }
            let cell = index / self.blocks_per_cell();
            if current.as_ref().is_none_or(|(known, ..)| *known != cell) {
                self.merge(current.take());
                let settings = &self.experiment.cells[cell];
                let trial = Trial::new(self.experiment, settings).expect("a valid experiment");
                current = Some((cell, trial, Curves::new(settings.horizon)));
            }
            let Some((_, trial, curves)) = &mut current else {
                break;
            };
            let first = (index % self.blocks_per_cell()) as u64 * BLOCK;
            let trials = first..(first + BLOCK).min(self.trials);
            let mut rows = Vec::new();
            for index in trials.clone() {
                rows.extend_from_slice(trial.run(index, Some(curves)));
            }
            let block = Block { cell, trials, rows };
            if sender.send((index, block)).is_err() {
                break;
            }
        }
        self.merge(current);
    }

    /// Adds a worker's curves of one cell to the whole.
    fn merge(&self, part: Option<(usize, Trial<'_>, Curves)>) {
        if let Some((cell, _, curves)) = part {
            let mut whole = self.curves.lock().unwrap_or_else(PoisonError::into_inner);
            whole[cell].merge(&curves);
        }
    }

    #[expect(
        clippy::needless_pass_by_value,
        reason = "dropping the receiver ends the workers"
    )]
    /// Hands blocks over in order; returns the number of trials delivered.
    fn deliver<E>(
        &self,
        receiver: Receiver<(usize, Block)>,
        mut consume: impl FnMut(Block) -> Result<(), E>,
    ) -> Result<u64, E> {
        // Where the consumer panics, the receiver goes with it, and so end the workers that wait to send.
        let _guard = EndOnPanic(&self.ended);
        let mut waiting = BTreeMap::new();
        let (mut next, mut done) = (0, 0);
        let mut outcome = Ok(());
        // After a stop no more blocks are taken, and waiting for the next one in order may be in vain.
        while next < self.blocks() {
            match receiver.recv_timeout(std::time::Duration::from_millis(50)) {
                Ok((index, block)) => {
                    waiting.insert(index, block);
                }
                Err(_) if self.stopped() => break,
                Err(_) => {}
            }
            while let Some(block) = waiting.remove(&next) {
                next += 1;
                done += block.trials.end - block.trials.start;
                if outcome.is_ok() {
                    outcome = consume(block);
                    if outcome.is_err() {
                        self.ended.store(true, Ordering::Relaxed);
                    }
                }
            }
        }
        outcome.map(|()| done)
    }
}
