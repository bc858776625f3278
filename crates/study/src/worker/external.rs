//! The estimator that gets its models from an external program, a batch of trials at a time.

use super::fault::Fault;
use super::message::{Batch, Hello, PROTOCOL, Reply};
use super::options::Told;
use super::program::{Lease, Program};
use asobench_identification::data::Feedback;
use asobench_identification::estimator::{Estimator, FailureKind, Pass, Problem, ProgramError, Records, Window};
use asobench_identification::model::Orders;
use serde_json::json;
use std::ops::Range;
use std::sync::Arc;

/// The outcome of a trial: its reply and its place there, or why it has no model.
type Outcome = Result<(Arc<Reply>, usize), FailureKind>;

/// An estimator that gets its models from an external program.
///
/// Batches begin at multiples of `batch` and are always sent whole, whichever of their trials are wanted. So a trial's
/// model depends on its own batch alone.
pub(super) struct External {
    program: Arc<Program>,
    hello: String,
    batch: Batch,
    /// The first trial of the current batch.
    first: Option<u64>,
    /// The outcomes of its trials; `None` for a trial without a record.
    outcomes: Vec<Option<Outcome>>,
    current: usize,
}

/// Builds the greeting that describes a problem to a program.
pub(super) fn hello(program: &Program, problem: &Problem<'_>) -> String {
    let orders = program.options.orders_for(problem.shape.order);
    let Orders { na, nb, nc, nd, nf, nk } = orders;
    let settings = problem.process.map(|(process, _)| process.settings());
    let closed = settings.is_some_and(|of| !matches!(of.feedback, Feedback::None));
    let noise = program.options.told.contains(&Told::Noise);
    let noise = problem.process.filter(|_| noise);
    let hello = Hello {
        frame: "hello",
        protocol: PROTOCOL,
        program: format!("asobench {}", env!("CARGO_PKG_VERSION")),
        method: program.name.clone(),
        fingerprint: program.fingerprint.clone(),
        order: orders.order(),
        na,
        nb,
        nc,
        nd,
        nf,
        nk,
        samples: problem.shape.window,
        sampling: 1.0,
        feedback: if closed { "closed" } else { "open" },
        noise: noise.map(|(process, eta)| json!({ "eta": eta, "filter": process.describe()["noise"] })),
    };
    hello.line()
}

impl External {
    pub(super) fn new(program: Arc<Program>, problem: &Problem<'_>) -> Self {
        Self {
            hello: hello(&program, problem),
            program,
            batch: Batch::of(problem.shape.window),
            first: None,
            outcomes: Vec::new(),
            current: 0,
        }
    }

    /// Draws the records of a batch. Returns for each trial its place among the records; `None` if it has none.
    fn draw(&mut self, trials: Range<u64>, records: &mut dyn Records) -> Vec<Option<usize>> {
        self.batch.clear();
        let place = trials.map(|trial| {
            let seed = records.seed(trial);
            self.batch.push(trial, seed, records.draw(trial)?);
            Some(self.batch.trials.len() - 1)
        });
        place.collect()
    }

    /// Gets the models of a part of the batch. If no process answers the part, it is halved.
    fn estimate_part(&self, part: Range<usize>, found: &mut [Option<Outcome>]) -> Result<(), ProgramError> {
        if part.is_empty() {
            return Ok(());
        }
        match self.ask(&part)? {
            Ok(reply) => {
                let reply = Arc::new(reply);
                for (place, at) in part.enumerate() {
                    let failure = reply.failure(place);
                    found[at] = Some(failure.map_or(Ok((Arc::clone(&reply), place)), Err));
                }
            }
            Err(kind) if part.len() == 1 => found[part.start] = Some(Err(kind)),
            Err(_) => {
                let middle = part.start + part.len() / 2;
                self.estimate_part(part.start..middle, found)?;
                self.estimate_part(middle..part.end, found)?;
            }
        }
        Ok(())
    }

    /// Sends a part of the batch. A fault counts only if the process had answered nothing before; for the whole batch
    /// or a single trial, a crash counts only if it happens twice. So no trial is blamed for the effects of an earlier
    /// batch or for a signal from elsewhere.
    fn ask(&self, part: &Range<usize>) -> Result<Result<Reply, FailureKind>, ProgramError> {
        let mut lease = self.program.lease(&self.hello)?;
        let ends = part.len() == 1 || part.len() == self.batch.trials.len();
        let mut spared = usize::from(ends);
        loop {
            let fresh = lease.answered() == 0;
            let number = self.batch.number(lease.answered(), part.clone());
            let message = self.batch.frame(number, part.clone());
            let asked = lease.ask(number, &message, part.len());
            let fault = match asked {
                Ok(reply) => {
                    lease.give_back();
                    return Ok(Ok(reply));
                }
                Err(Fault::Stopped) => return Err(ProgramError::Stopped),
                Err(fault) => fault,
            };
            let (first, last) = (self.batch.trials[part.start], self.batch.trials[part.end - 1]);
            self.program.fault(&format!("trials {first} to {last}"), &fault);
            let kind = match fault {
                Fault::Timeout(_) => FailureKind::Timeout,
                Fault::Crashed(_) | Fault::Stopped => FailureKind::Crashed,
                Fault::Malformed(_) => FailureKind::Malformed,
            };
            if fresh && (kind != FailureKind::Crashed || spared == 0) {
                return Ok(Err(kind));
            }
            spared -= usize::from(fresh);
            Lease::renew(&mut lease)?;
        }
    }
}

impl Estimator for External {
    fn gather(&mut self, trial: u64, records: &mut dyn Records) -> Result<(), ProgramError> {
        let size = self.program.options.batch;
        let first = trial - trial % size;
        if self.first != Some(first) {
            self.first = None;
            let places = self.draw(first..first.saturating_add(size), records);
            let count = self.batch.trials.len();
            let mut found = vec![None; count];
            self.estimate_part(0..count, &mut found)?;
            let of = |place: Option<usize>| place.and_then(|place| found[place].clone());
            self.outcomes = places.into_iter().map(of).collect();
            self.first = Some(first);
        }
        self.current = (trial - first) as usize;
        Ok(())
    }

    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        let outcome = self.outcomes.get(self.current);
        match outcome.and_then(Option::as_ref) {
            Some(Ok((reply, place))) => reply.fill(*place, window, pass),
            Some(Err(kind)) => pass.fail((*kind).into()),
            None => pass.fail(FailureKind::NotRun.into()),
        }
    }
}
