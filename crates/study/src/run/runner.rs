//! The runner: computes blocks of trials on rayon's threads.

use crate::design::file::{Engine, Store};
use crate::design::{Experiment, Source};
use crate::outcome::rows::Rows;
use crate::outcome::spent::{Spent, Watch};
use crate::outcome::tally::CellTally;
use crate::outcome::trials::Trials;
use crate::run::trial_worker::{Worker, WorkerError};
use asobench_identification::estimator::{Method, ProgramError};
use asobench_identification::real::MOST_LANES;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::ops::{Range, RangeInclusive};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// About how many times more trials than faer the lanes run in the same time.
const LANES_SPEED: usize = 64;

/// The work of one step of all observers in continuous time, with its half steps, in samples times outputs
/// (approximate).
const STEP_WORK: usize = 6;

/// The work of a block in samples times outputs: about half a second.
const BLOCK_WORK: usize = 1 << 21;

/// If rows are not kept, so many trials are tallied at once. More make fewer tallies to merge; above the fewest their
/// numbers are at most [`TALLIED_VALUES`].
const TALLIED: RangeInclusive<u64> = 1 << 14..=1 << 16;

/// 16 MB of measures and coefficients.
const TALLIED_VALUES: u64 = 1 << 21;

/// The most trials in a block with rows.
const ROWS: u64 = 1 << 14;

/// The least number of blocks per thread, if there are enough trials.
const BLOCKS_OF_A_THREAD: u64 = 4;

/// A block that takes longer is delivered as far as it is computed; the rest follows as another block.
const LONGEST: Duration = Duration::from_secs(5);

/// Whether the time of a block is up. Once it is, it stays so: if a clock went back, and some trials were computed
/// after all, a block would have the tally of more trials than rows.
#[derive(Default)]
struct TimeUp(bool);

impl TimeUp {
    fn is_up(&mut self, elapsed: Duration) -> bool {
        self.0 |= elapsed >= LONGEST;
        self.0
    }
}

/// A contiguous range of trials of one cell, as assigned to one worker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    /// The cell's index.
    pub cell: usize,
    /// The trials.
    pub trials: Range<u64>,
}

impl Span {
    /// Returns the number of trials.
    pub fn len(&self) -> u64 {
        self.trials.end - self.trials.start
    }

    /// Whether there are no trials.
    pub fn is_empty(&self) -> bool {
        self.trials.is_empty()
    }

    /// Whether another span lies within this one.
    pub(crate) fn holds(&self, part: &Self) -> bool {
        let (whole, trials) = (&self.trials, &part.trials);
        self.cell == part.cell && whole.start <= trials.start && trials.end <= whole.end
    }
}

/// A block: a contiguous range of trials of one cell, from the thread that computes them to their file.
pub struct Block {
    /// The cell and the trials.
    pub span: Span,
    /// Their rows; empty if rows are not kept.
    pub rows: Rows,
    /// Their tally.
    pub tally: CellTally,
    /// Where the time went; nothing if it was read.
    pub spent: Spent,
}

/// The data that a block keeps of its trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The rows and their tally.
    Rows,
    /// The tally alone.
    Tally,
    /// Nothing.
    Nothing,
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
    #[error("interrupted after {done} of {total} trials")]
    Interrupted {
        /// Trials that were delivered, over all cells.
        done: u64,
        /// Trials that were asked for, over all cells.
        total: u64,
    },
    /// No worker serves a cell, for example because a caller's own method refuses its shape.
    #[error(transparent)]
    Worker(WorkerError),
    /// The consumer failed.
    #[error(transparent)]
    Consumer(E),
}

/// Returns the default number of trials in a block of a cell: about half a second of work.
pub fn block_size(experiment: &Experiment, cell: usize) -> u64 {
    let outputs: usize = experiment.methods.iter().map(Method::passes).sum();
    let samples = match &experiment.cells[cell].source {
        Source::Discrete(cell) => cell.horizon * outputs.max(1),
        Source::Continuous(cell) => STEP_WORK * cell.steps(),
    };
    let work = BLOCK_WORK / samples.max(1);
    let work = match experiment.engine(cell) {
        Ok(Engine::Lanes) => LANES_SPEED * work,
        _ => work,
    };
    // Rows stay in memory until their block ends.
    let most = match experiment.file.store {
        Store::Trials => ROWS,
        Store::Summaries => 1 << 20,
    };
    let work = (work as u64).clamp(1, most);
    match &experiment.cells[cell].source {
        Source::Discrete(_) => work,
        Source::Continuous(_) => work.next_multiple_of(MOST_LANES as u64),
    }
}

/// Runs trials 0 ... `trials` - 1 of every cell on `threads` threads; a deterministic cell has one trial. `consume`
/// receives each block on the calling thread when it is finished, in no particular order.
///
/// # Errors
/// [`RunError`].
///
/// # Panics
/// With the panic of an estimator or of `consume`.
pub fn run<E>(
    experiment: &Experiment,
    trials: u64,
    threads: usize,
    stop: &AtomicBool,
    consume: impl FnMut(Block) -> Result<(), E>,
) -> Result<(), RunError<E>> {
    let spans = whole(experiment, trials);
    let shared = Shared::new(experiment, &spans, None, Keep::Rows, stop);
    shared.run(threads, |block| block, consume)
}

/// Runs the same trials and discards the results. This times simulation, estimation and measures alone.
///
/// # Errors
/// [`RunError`].
///
/// # Panics
/// With the panic of an estimator.
pub fn run_and_forget(
    experiment: &Experiment,
    trials: u64,
    threads: usize,
    stop: &AtomicBool,
) -> Result<Spent, RunError<Infallible>> {
    let spans = whole(experiment, trials);
    let mut spent = Spent::default();
    let shared = Shared::new(experiment, &spans, None, Keep::Nothing, stop);
    let consume = |block: Block| {
        spent += block.spent;
        Ok(())
    };
    shared.run(threads, |block| block, consume)?;
    Ok(spent)
}

/// Returns trials 0 ... `trials` - 1 of every cell; a deterministic cell has one.
fn whole(experiment: &Experiment, trials: u64) -> Vec<Span> {
    let whole = |cell| Span {
        cell,
        trials: 0..experiment.trials_of(cell, trials),
    };
    (0..experiment.cells.len()).map(whole).collect()
}

/// Runs spans on `threads` threads, in blocks of `block` trials, by default [`block_size`]. No result depends on the
/// size of blocks.
///
/// `finish` converts a block on the thread that computed it. `consume` receives the result on the calling thread when
/// the block is finished, in no particular order. A block that takes long arrives in several parts. An error of
/// `consume`, or raising `stop`, ends the run after the trials under way; the finished part of every span is still
/// delivered.
///
/// # Errors
/// [`RunError`].
///
/// # Panics
/// With the panic of an estimator, of `finish` or of `consume`.
pub(crate) fn run_spans<E, T: Send>(
    experiment: &Experiment,
    (spans, block): (&[Span], Option<u64>),
    keep: Keep,
    threads: usize,
    stop: &AtomicBool,
    finish: impl Fn(Block) -> T + Sync,
    consume: impl FnMut(T) -> Result<(), E>,
) -> Result<(), RunError<E>> {
    Shared::new(experiment, spans, block, keep, stop).run(threads, finish, consume)
}

/// Returns a pool of so many threads.
pub(crate) fn pool<E>(threads: usize) -> Result<rayon::ThreadPool, RunError<E>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().map_err(|error| RunError::Threads {
        threads,
        reason: error.to_string(),
    })
}

/// A block's result with the number of its trials, or that a worker is done.
type Message<T> = Option<(u64, T)>;

/// Reports that a worker is done when dropped. If the worker panicked, this ends the run.
struct Done<'a, T> {
    sender: &'a SyncSender<Message<T>>,
    ended: &'a AtomicBool,
}

impl<T> Drop for Done<'_, T> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.ended.store(true, Ordering::Relaxed);
        }
        // If the receiver is gone, nobody waits.
        let _ = self.sender.send(None);
    }
}

/// The state that the workers share.
struct Shared<'a> {
    experiment: &'a Experiment,
    spans: &'a [Span],
    /// Trials in a block; `None`: [`block_size`].
    block: Option<u64>,
    keep: Keep,
    /// The upper limit of the default size of a block, so that no thread waits long for another's last block.
    share: u64,
    threads: u64,
    stop: &'a AtomicBool,
    /// Raised when the consumer or a worker has failed.
    ended: AtomicBool,
    /// The next trials to take: the index of a span, how many of its trials are taken, how many of all are left.
    next: Mutex<(usize, u64, u64)>,
    /// Why a cell has no worker.
    failed: OnceLock<WorkerError>,
}

impl<'a> Shared<'a> {
    pub(crate) fn new(
        experiment: &'a Experiment,
        spans: &'a [Span],
        block: Option<u64>,
        keep: Keep,
        stop: &'a AtomicBool,
    ) -> Self {
        Self {
            experiment,
            spans,
            block,
            keep,
            share: u64::MAX,
            threads: 1,
            stop,
            ended: AtomicBool::new(false),
            next: Mutex::new((0, 0, spans.iter().map(Span::len).sum())),
            failed: OnceLock::new(),
        }
    }

    /// Runs all blocks.
    fn run<E, T: Send>(
        mut self,
        threads: usize,
        finish: impl Fn(Block) -> T + Sync,
        consume: impl FnMut(T) -> Result<(), E>,
    ) -> Result<(), RunError<E>> {
        let trials: u64 = self.spans.iter().map(Span::len).sum();
        let share = trials.div_ceil(BLOCKS_OF_A_THREAD * threads.max(1) as u64);
        self.share = share.max(1).next_multiple_of(MOST_LANES as u64);
        self.threads = threads.max(1) as u64;
        let threads = self.blocks().clamp(1, threads.max(1) as u64) as usize;
        let (sender, receiver) = sync_channel(threads);
        let delivered = pool(threads)?.in_place_scope(|scope| {
            scope.spawn_broadcast(|_, _| self.work(&sender, &finish));
            self.deliver(receiver, threads, consume)
        });
        let total = trials;
        if let Some(error) = self.failed.into_inner() {
            return Err(RunError::Worker(error));
        }
        match delivered {
            Err(error) => Err(RunError::Consumer(error)),
            Ok(done) if done < total => Err(RunError::Interrupted { done, total }),
            Ok(_) => Ok(()),
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.ended.load(Ordering::Relaxed)
    }

    fn block_size(&self, cell: usize) -> u64 {
        if let Some(block) = self.block {
            return block.max(1);
        }
        let most = if self.keep == Keep::Rows { ROWS } else { u64::MAX };
        block_size(self.experiment, cell).min(most).min(self.share)
    }

    /// Returns the upper limit of a block when so many trials are left: half of what is left for each thread, but not
    /// below an eighth of a usual share. So the threads end at nearly the same time.
    fn last_blocks(&self, left: u64) -> u64 {
        if self.block.is_some() {
            return u64::MAX;
        }
        let half = left / (2 * self.threads);
        half.max(self.share / 8).max(1).next_multiple_of(MOST_LANES as u64)
    }

    /// Returns the number of blocks.
    fn blocks(&self) -> u64 {
        let blocks = self.spans.iter();
        let blocks = blocks.map(|span| span.len().div_ceil(self.block_size(span.cell)));
        blocks.sum()
    }

    /// Takes the next block to compute.
    fn take(&self) -> Option<Span> {
        // No code panics while holding the lock.
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        let (index, taken, left) = *next;
        let span = self.spans.get(index)?;
        let start = span.trials.start + taken;
        let batch = self.experiment.batch();
        let size = self.block_size(span.cell).min(self.last_blocks(left));
        let end = start.saturating_add(size.next_multiple_of(batch));
        let end = span.trials.end.min(end - end % batch);
        let left = left - (end - start);
        *next = if end == span.trials.end {
            (index + 1, 0, left)
        } else {
            (index, end - span.trials.start, left)
        };
        Some(Span {
            cell: span.cell,
            trials: start..end,
        })
    }

    /// Runs one worker: takes blocks in order until none is left.
    fn work<T>(&self, sender: &SyncSender<Message<T>>, finish: impl Fn(Block) -> T) {
        let _done = Done {
            sender,
            ended: &self.ended,
        };
        let mut current: Option<(usize, Worker<'_>, Trials)> = None;
        while !self.stopped() {
            let Some(span) = self.take() else {
                return;
            };
            if current.as_ref().is_none_or(|(known, ..)| *known != span.cell) {
                let cell = &self.experiment.cells[span.cell];
                match Worker::new(self.experiment, cell) {
                    Ok(worker) => {
                        let mut trials = Trials::new(self.experiment, cell);
                        if self.keep == Keep::Nothing {
                            trials.curves = None;
                        }
                        current = Some((span.cell, worker, trials));
                    }
                    Err(error) => return self.fail(error),
                }
            }
            let Some((_, worker, room)) = &mut current else {
                return;
            };
            let mut from = span.trials.start;
            while from < span.trials.end && !self.stopped() {
                let (block, error) = self.block(worker, room, span.cell, from..span.trials.end);
                from = block.span.trials.end;
                let trials = block.span.len();
                if trials > 0 && sender.send(Some((trials, finish(block)))).is_err() {
                    return;
                }
                if let Some(error) = error {
                    self.fail(error);
                    return;
                }
            }
        }
    }

    /// Ends the run. Keeps the first error; a program that was stopped is not an error.
    fn fail(&self, error: WorkerError) {
        if error != WorkerError::Setup(ProgramError::Stopped.into()) {
            let _ = self.failed.set(error);
        }
        self.ended.store(true, Ordering::Relaxed);
    }

    /// Computes trials of one cell until the time or the stop flag ends it: at least one trial, unless an external
    /// program fails.
    fn block(
        &self,
        worker: &mut Worker<'_>,
        room: &mut Trials,
        cell: usize,
        trials: Range<u64>,
    ) -> (Block, Option<WorkerError>) {
        let settings = &self.experiment.cells[cell];
        let (begin, mut time) = (Instant::now(), TimeUp::default());
        let mut goes_on = |end: u64| {
            let is_open = end < trials.end && !self.stopped() && !time.is_up(begin.elapsed());
            end == trials.start || is_open
        };
        let (mut tally, mut end) = (CellTally::default(), trials.start);
        let (mut rows, mut error) = (Rows::default(), None);
        while error.is_none() && goes_on(end) {
            // Rows that are not kept are tallied once there are many.
            let most = match self.keep {
                Keep::Rows => trials.end - trials.start,
                Keep::Tally | Keep::Nothing => {
                    let values = room.rows.values_of_trial().max(1) as u64;
                    (TALLIED_VALUES / values).clamp(*TALLIED.start(), *TALLIED.end())
                }
            };
            let to = trials.end.min(end + most);
            room.rows.reserve((to - end) as usize);
            let stride = worker.stride(settings);
            let first = end;
            while end < to && (end == first || goes_on(end)) {
                let next = to.min(end + stride);
                error = worker.run_into(end..next, room).err();
                if error.is_some() {
                    break;
                }
                end = next;
            }
            if end == first {
                break;
            }
            let mut watch = Watch::start();
            if self.keep != Keep::Nothing {
                // Curves are counted over the whole block.
                let curves = room.curves.take();
                tally.merge(CellTally::from_trials(self.experiment, settings, room));
                room.curves = curves;
            }
            room.spent.statistics += watch.lap();
            if self.keep == Keep::Rows {
                rows = room.rows.take();
            }
            room.clear();
        }
        if let Some(curves) = &mut room.curves {
            tally.curves = Some(curves.take(&(trials.start..end)));
        }
        let block = Block {
            span: Span {
                cell,
                trials: trials.start..end,
            },
            tally,
            rows,
            spent: std::mem::take(&mut room.spent),
        };
        (block, error)
    }

    #[expect(clippy::needless_pass_by_value, reason = "dropping the receiver ends the workers")]
    /// Passes blocks to `consume` until every worker is done. Returns the number of trials delivered.
    fn deliver<E, T: Send>(
        &self,
        receiver: Receiver<Message<T>>,
        mut working: usize,
        mut consume: impl FnMut(T) -> Result<(), E>,
    ) -> Result<u64, E> {
        /// Ends the workers if the consumer panics. The receiver is dropped too, which frees workers that wait to send.
        struct EndOnPanic<'a>(&'a AtomicBool);
        impl Drop for EndOnPanic<'_> {
            fn drop(&mut self) {
                if std::thread::panicking() {
                    self.0.store(true, Ordering::Relaxed);
                }
            }
        }
        let _guard = EndOnPanic(&self.ended);
        let mut done = 0;
        while working > 0 {
            let Ok(message) = receiver.recv() else {
                break;
            };
            let Some((trials, result)) = message else {
                working -= 1;
                continue;
            };
            done += trials;
            if let Err(error) = consume(result) {
                self.ended.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
        Ok(done)
    }
}

#[cfg(test)]
mod tests {
    use super::{Duration, LONGEST, TimeUp};

    #[test]
    fn a_clock_that_goes_back_gives_no_time() {
        let mut time = TimeUp::default();
        assert!(!time.is_up(LONGEST / 2) && time.is_up(LONGEST) && time.is_up(Duration::ZERO));
    }
}
