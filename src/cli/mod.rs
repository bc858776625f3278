//! The command line: one file per subcommand, and the only place that prints.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "this is the place that prints"
)]

mod check;
mod error;
mod estimate;
mod files;
mod memory;
mod progress;
mod replay;
mod report;
mod reproduce;
mod run;
mod template;
mod throughput;
mod timing;

use crate::names::named_enum;
use clap::{Parser, Subcommand};
use error::Error;
use std::ffi::OsString;
use std::process::ExitCode;

/// Monte-Carlo benchmarks of estimators and adaptive state observers.
#[derive(Parser)]
#[command(
    name = "asobench",
    version,
    arg_required_else_help = true,
    max_term_width = 80
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
    New(template::Arguments),
    Replay(replay::Arguments),
    Report(report::Arguments),
    Estimate(estimate::Arguments),
    Throughput(throughput::Arguments),
    /// Print the JSON schema of experiment files, for editors
    Schema,
}

named_enum! {
    /// The form of what is printed.
    Format, "format" {
        /// For people, at most 80 columns.
        Text = "text",
        /// For programs.
        Json = "json",
    }
}

/// Runs the program; returns its exit code: 0 done, 1 the run or a single estimate failed, 2 bad
/// input, 130 interrupted.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let done = match Cli::try_parse_from(arguments) {
        Ok(Cli { command }) => match command {
            Command::Reproduce(arguments) => reproduce::run(&arguments),
            Command::Run(arguments) => run::run(&arguments),
            Command::Check(arguments) => check::run(&arguments),
            Command::New(arguments) => template::run(&arguments),
            Command::Replay(arguments) => replay::run(&arguments),
            Command::Throughput(arguments) => throughput::run_command(&arguments),
            Command::Report(arguments) => report::run(&arguments),
            Command::Estimate(arguments) => estimate::run(&arguments),
            Command::Schema => template::schema(),
        },
        Err(error) => error::usage(&error),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            if !error.is_broken_pipe() {
                note(&format!("asobench: {error}"));
            }
            error.exit_code()
        }
    }
}

/// Prints to standard output; a reader that went away ends the program quietly.
fn print(text: &str) -> Result<(), Error> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(Error::Output)
}

/// Prints one line to standard error: control characters are escaped, a text without end is cut, and where
/// standard error cannot be written to nothing more can be said.
fn note(line: &str) {
    use std::io::Write;
    const LONGEST: usize = 1000;
    let mut text: String = line
        .chars()
        .take(LONGEST)
        .flat_map(|c| {
            let plain = (!c.is_control()).then_some(c);
            let escaped = c.is_control().then(|| c.escape_default());
            plain.into_iter().chain(escaped.into_iter().flatten())
        })
        .collect();
    if line.chars().count() > LONGEST {
        text.push_str("...");
    }
    let _ = writeln!(std::io::stderr(), "{text}");
}
