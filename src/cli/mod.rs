//! The command line: one file per subcommand, and the only place that prints.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "this is the place that prints"
)]

mod check;
mod cluster;
mod colour;
mod completions;
mod confirm;
mod equation;
mod error;
mod estimate;
mod files;
mod memory;
mod merge;
mod methods;
mod need;
mod new_experiment;
mod plan;
mod programs;
mod progress;
mod reference;
mod replay;
mod report;
mod reproduce;
mod run;
mod shard;
mod slurm;
mod status;
mod test_method;
mod theory;
mod throughput;
mod timing;

use crate::lanes::Isa;
use crate::names::named_enum;
use crate::text::{beginning, visible, visible_json, visible_lines};
use crate::worker;
use clap::{Parser, Subcommand};
use error::{Error, failed};
use std::ffi::OsString;
use std::process::ExitCode;
use std::sync::LazyLock;

/// Monte-Carlo benchmarks of estimators and adaptive state observers.
#[derive(Parser)]
#[command(
    name = "asobench",
    version = VERSION.as_str(),
    arg_required_else_help = true,
    max_term_width = 80,
    after_help = "Exit codes: 0 done, 1 the run failed, 2 bad input, 75 trials are missing: run \
                  again, 130 interrupted"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Reproduce(reproduce::Arguments),
    Run(run::Arguments),
    Check(check::Arguments),
    New(new_experiment::Arguments),
    Replay(replay::Arguments),
    Report(report::Arguments),
    Theory(theory::Arguments),
    Estimate(estimate::Arguments),
    StudyFrom(estimate::study_from::Arguments),
    Throughput(throughput::Arguments),
    Plan(plan::Arguments),
    Shard(shard::Arguments),
    Merge(merge::Arguments),
    Status(status::Arguments),
    Slurm(slurm::Arguments),
    TestMethod(test_method::Arguments),
    /// Kill the programs of a run that was killed; started by a run
    #[command(name = worker::SUBCOMMAND, hide = true)]
    Guard,
    /// Print the estimators with their options
    Methods,
    Schema(reference::Arguments),
    Completions(completions::Arguments),
}

named_enum! {
    /// The form of the output.
    Format, "format" {
        /// For people, at most 80 columns.
        Text = "text",
        /// For programs.
        Json = "json",
    }
}

/// The stack on which the program runs. The one that the system gives (`ulimit -s`) may be too small.
const STACK: usize = 8 << 20;

/// Runs the program and returns its exit code: 0 done, 1 the run or a single estimate failed, 2 bad input, 75 stopped
/// or trials missing (run again), 130 interrupted.
pub fn main(arguments: impl IntoIterator<Item = OsString> + Send + 'static) -> ExitCode {
    let thread = std::thread::Builder::new().name("main".to_owned());
    match thread.stack_size(STACK).spawn(|| run_command(arguments)) {
        // A panic has said what it is; the exit code is that of Rust.
        Ok(running) => running.join().unwrap_or_else(|_| ExitCode::from(101)),
        Err(error) => {
            note(&format!(
                "asobench: no memory for a stack of {STACK} bytes: {error}"
            ));
            ExitCode::FAILURE
        }
    }
}

fn run_command(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    errors_of_large_files();
    let done = match Cli::try_parse_from(arguments) {
        Ok(Cli { command }) => match command {
            Command::Reproduce(arguments) => reproduce::run(&arguments),
            Command::Run(arguments) => run::run(&arguments),
            Command::Check(arguments) => check::run(&arguments),
            Command::New(arguments) => new_experiment::run(&arguments),
            Command::Replay(arguments) => replay::run(&arguments),
            Command::Throughput(arguments) => throughput::run_command(&arguments),
            Command::Plan(arguments) => plan::run(&arguments),
            Command::Shard(arguments) => shard::run(&arguments),
            Command::Merge(arguments) => merge::run(&arguments),
            Command::Status(arguments) => status::run(&arguments),
            Command::Slurm(arguments) => slurm::run(&arguments),
            Command::Report(arguments) => report::run(&arguments),
            Command::Theory(arguments) => theory::run(&arguments),
            Command::Estimate(arguments) => estimate::run(&arguments),
            Command::StudyFrom(arguments) => estimate::study_from::run(&arguments),
            Command::TestMethod(arguments) => test_method::run(&arguments),
            Command::Guard => {
                worker::stand(std::io::stdin().lock());
                Ok(ExitCode::SUCCESS)
            }
            Command::Methods => methods::run(),
            Command::Schema(arguments) => reference::run(&arguments),
            Command::Completions(arguments) => completions::run(&arguments),
        },
        Err(error) => error::usage(&error),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            note(&format!("asobench: {error}"));
            error.exit_code()
        }
    }
}

/// Makes a file beyond the limit of the system (`ulimit -f`) an error of the write. Its signal would end the program
/// without a word.
fn errors_of_large_files() {
    #[cfg(unix)]
    {
        let signal = rustix::process::Signal::XFSZ.as_raw();
        // Without a handler the program is ended, as before.
        let _ = signal_hook::flag::register(signal, std::sync::Arc::default());
    }
}

/// The version, the source's revision, and the instructions that the lanes use on this machine.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let revision = asobench_study::GIT_REVISION.unwrap_or("no git revision");
    let short = revision.get(..10).filter(|_| !revision.contains(' '));
    let isa = Isa::best();
    format!(
        "{} ({}, {isa})",
        env!("CARGO_PKG_VERSION"),
        short.unwrap_or(revision)
    )
});

/// Prints lines to standard output. This, [`print_json`] and [`note`] are the only places that print. They make
/// invisible characters visible, whoever wrote them. Foreign text within a line must pass through [`visible`] before it
/// comes here, so that it cannot end the line.
fn print(text: &str) -> Result<(), Error> {
    write_out(&visible_lines(text))
}

/// Prints lines that end with the verdicts on claims, which are coloured if wanted.
fn print_with_verdicts(text: &str, verdicts: &str) -> Result<(), Error> {
    write_out(&(visible_lines(text) + &colour::verdicts(&visible_lines(verdicts))))
}

/// Prints JSON to standard output.
fn print_json(value: &impl serde::Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(failed)?;
    write_out(&format!("{}\n", visible_json(&text)))
}

/// Writes to standard output. If the reader has gone away, this is not an error.
fn write_out(text: &str) -> Result<(), Error> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    match written {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::Output(error)),
        _ => Ok(()),
    }
}

/// Prints one line to standard error; of an overlong text only its beginning. If standard error cannot be written to,
/// nothing can be reported.
fn note(line: &str) {
    use std::io::Write;
    const LONGEST: usize = 1000;
    let line = visible(beginning(line, LONGEST));
    let _ = writeln!(std::io::stderr(), "{line}");
}
