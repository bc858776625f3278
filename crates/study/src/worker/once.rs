//! Sends some records to a worker outside a study, for `asobench test-method` and replays.

use super::external::hello;
use super::fault::Fault;
use super::message::{Batch, Incoming, Reply};
use super::program::Program;
use asobench_identification::estimator::{Pass, Problem, ProgramError, Window};
use std::fmt::Write as _;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A record with its trial and seed.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// The trial's number.
    pub trial: u64,
    /// The trial's seed.
    pub seed: u64,
    /// The input.
    pub u: Vec<f64>,
    /// The output.
    pub y: Vec<f64>,
    /// The reference.
    pub r: Vec<f64>,
}

impl Record {
    fn window(&self) -> Window<'_> {
        Window::with_reference(&self.u, &self.y, &self.r, self.y.len())
    }
}

/// A worker's answer.
pub struct Answered {
    /// The models, or failures.
    pub passes: Vec<Pass>,
    /// Time from the first byte sent to the last one received.
    pub elapsed: Duration,
    /// The seconds of each record, according to the worker.
    pub seconds: Vec<f64>,
    /// The message sent and the answer, as text.
    pub messages: [String; 2],
    reply: Reply,
}

impl Answered {
    /// Whether statuses and models agree bit for bit.
    pub fn same_bits(&self, other: &Self) -> bool {
        let bits = |of: &Self| -> Vec<u64> {
            let numbers = of.reply.blocks().into_iter();
            let rest = numbers.filter(|(name, ..)| *name != "seconds");
            rest.flat_map(|(_, block, _)| block).map(f64::to_bits).collect()
        };
        bits(self) == bits(other)
    }
}

/// Sends records of equal length to a program. The inner error describes a fault in its answer.
///
/// # Errors
/// If it does not run.
pub fn ask_once(
    program: &Arc<Program>,
    problem: &Problem<'_>,
    records: &[Record],
) -> Result<Result<Answered, String>, ProgramError> {
    let mut lease = program.lease(&hello(program, problem))?;
    let mut batch = Batch::of(problem.shape.window);
    for record in records {
        batch.push(record.trial, record.seed, record.window());
    }
    let number = batch.number(lease.answered(), 0..records.len());
    let sent = batch.frame(number, 0..records.len());
    let begin = Instant::now();
    let asked = lease.ask(number, &sent, records.len());
    let elapsed = begin.elapsed();
    let reply = match asked {
        Ok(reply) => reply,
        Err(Fault::Stopped) => return Err(ProgramError::Stopped),
        Err(fault) => return Ok(Err(fault.to_string())),
    };
    lease.give_back();
    let blocks = [
        ("trial", batch.trials.iter().map(|x| *x as f64).collect(), 1),
        ("seed", batch.seeds.iter().map(|x| *x as f64).collect(), 1),
        ("u", batch.u, batch.samples),
        ("y", batch.y, batch.samples),
        ("r", batch.r, batch.samples),
    ];
    let header = sent.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let request = text(&String::from_utf8_lossy(header), blocks.into());
    Ok(Ok(Answered {
        passes: passes(&reply, problem.shape.order, records),
        elapsed,
        seconds: (0..records.len()).map(|place| reply.seconds(place)).collect(),
        messages: [request, text(&reply.header, reply.blocks())],
        reply,
    }))
}

/// The models in the bytes with which a process answers message `number` with some records; none in its greeting, which
/// is expected without a number. For tests of foreign bytes.
///
/// # Errors
/// A description of the fault.
#[doc(hidden)]
pub fn heard(bytes: &[u8], number: Option<u64>, matrices: bool, records: &[Record]) -> Result<Vec<Pass>, String> {
    let mut incoming = Incoming::default();
    for part in bytes.chunks(Incoming::ROOM) {
        incoming.add(part);
        let Some(number) = number else {
            if incoming.ready()?.is_some() {
                return Ok(Vec::new());
            }
            continue;
        };
        if let Some(reply) = incoming.reply(number, records.len(), matrices)? {
            reply.check()?;
            return Ok(passes(&reply, 2, records));
        }
    }
    Err(incoming.came())
}

/// The models of a reply to a message with some records.
fn passes(reply: &Reply, order: usize, records: &[Record]) -> Vec<Pass> {
    let place = |(place, record): (usize, &Record)| {
        let mut pass = Pass::new(order);
        reply.fill(place, record.window(), &mut pass);
        pass
    };
    records.iter().enumerate().map(place).collect()
}

/// Formats a message: its header, then a line for each row of each block.
fn text(header: &str, blocks: Vec<(&str, Vec<f64>, usize)>) -> String {
    let mut text = format!("{}\n", header.trim_end());
    for (name, numbers, width) in blocks {
        for row in numbers.chunks(width.max(1)) {
            let numbers: Vec<String> = row.iter().map(ToString::to_string).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name}: {}", numbers.join(" "));
        }
    }
    text
}
