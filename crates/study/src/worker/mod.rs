//! Methods that are external programs. Only this module starts processes. docs/protocol.md defines the messages.
//!
//! [`Program`] keeps the processes of a method, which the threads of a run share. `process` is one of them; `message`
//! has the messages in its pipes, `model` the models in a reply. `external` is the estimator: it sends batches and
//! finds the trial that crashes a process.

#[cfg(not(target_os = "linux"))]
mod elsewhere;
mod external;
mod fault;
#[cfg(target_os = "linux")]
mod guard;
mod layout;
mod log;
mod message;
mod model;
mod once;
mod options;
#[cfg(target_os = "linux")]
mod process;
mod program;

#[cfg(not(target_os = "linux"))]
use elsewhere::{guard, process};

pub use guard::{Guard, SUBCOMMAND, stand};
pub use message::Ready;
#[doc(hidden)]
pub use once::heard;
pub use once::{Answered, Record, ask_once};
pub use options::{CommandOptions, Told, Workers};
pub use program::{Permit, Program};

use asobench_identification::estimator::{Method, Output, Problem, ProgramError};
use asobench_identification::signal::{Purpose, stream};
use rand::Rng as _;
use std::sync::Arc;

/// The seed of a trial that is given to programs, below 2^53. It reveals nothing about the record.
pub fn seed_of(seed: u64, trial: u64) -> u64 {
    stream(seed, trial, Purpose::Program).next_u64() >> 11
}

/// Makes a method of a program, with the program's name in the results.
pub fn method(program: &Arc<Program>) -> Method {
    let output = Output {
        estimator: program.name.clone(),
        pass: 0,
    };
    let (shared, orders) = (Arc::clone(program), program.options.orders);
    Method::own(None, vec![output], orders, move |problem| {
        let external = external::External::new(Arc::clone(&shared), problem);
        Ok(Box::new(external))
    })
}

/// Starts a program and asks for its name and version, for a problem.
///
/// # Errors
/// If it has no permit, does not start, or is not the one named in the file.
pub fn introduce(program: &Arc<Program>, problem: &Problem<'_>) -> Result<Ready, ProgramError> {
    let lease = program.lease(&external::hello(program, problem))?;
    Ok(lease.ready().clone())
}
