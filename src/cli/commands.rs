//! The subcommands and what runs each of them; the exit code.

use super::error::Error;
use super::exit_code;
use super::first_guess;
use super::output::{note, print};
use super::{
    check, compare, completions, estimate, explain, failures, merge, methods, new_experiment, plan, plot, replay,
    report, reproduce, run, schema, shard, slurm, status, suite, test_method, theory, throughput,
};
use crate::lanes::Isa;
use crate::names::UnknownName;
use crate::worker;
use clap::{CommandFactory as _, Parser, Subcommand};
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
    Failures(failures::Arguments),
    Plot(plot::Arguments),
    Compare(compare::Arguments),
    Theory(theory::Arguments),
    Suite(suite::Arguments),
    Estimate(estimate::Arguments),
    Observe(estimate::observe::Arguments),
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
    Methods(methods::Arguments),
    Explain(explain::Arguments),
    Schema(schema::Arguments),
    Completions(completions::Arguments),
}

/// The stack on which the program runs. The one that the system gives (`ulimit -s`) may be too small.
const STACK: usize = 8 << 20;

/// Runs the program and returns its exit code: 0 done, 1 the run or a single estimate failed, 2 bad input, 75 stopped
/// or trials missing (run again), 130 interrupted.
pub fn main(arguments: impl IntoIterator<Item = OsString> + Send + 'static) -> ExitCode {
    let thread = std::thread::Builder::new().name("main".to_owned());
    match thread.stack_size(STACK).spawn(|| run_command(arguments)) {
        // A panic has said what it is; the exit code is that of Rust.
        Ok(running) => running.join().unwrap_or_else(|_| ExitCode::from(exit_code::PANIC)),
        Err(error) => {
            note(&format!("asobench: no memory for a stack of {STACK} bytes: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn run_command(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    errors_of_large_files();
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let done = choose_instructions().and_then(|()| match Cli::try_parse_from(&arguments) {
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
            Command::Failures(arguments) => failures::run(&arguments),
            Command::Plot(arguments) => plot::run(arguments),
            Command::Compare(arguments) => compare::run(&arguments),
            Command::Theory(arguments) => theory::run(&arguments),
            Command::Suite(arguments) => suite::run(&arguments),
            Command::Estimate(arguments) => estimate::run(arguments),
            Command::Observe(arguments) => estimate::observe::run(&arguments),
            Command::StudyFrom(arguments) => estimate::study_from::run(arguments),
            Command::TestMethod(arguments) => test_method::run(&arguments),
            Command::Guard => {
                worker::stand(std::io::stdin().lock());
                Ok(())
            }
            Command::Methods(arguments) => methods::run(&arguments),
            Command::Explain(arguments) => explain::run(&arguments, &every_command()),
            Command::Schema(arguments) => schema::run(&arguments),
            Command::Completions(arguments) => completions::run(&arguments, Cli::command()),
        },
        Err(error) => usage(&error, arguments.get(1..).unwrap_or_default()),
    });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            for (i, line) in error.lines().enumerate() {
                let begin = if i == 0 { "asobench:" } else { " " };
                note(&format!("{begin} {line}"));
            }
            error.exit_code()
        }
    }
}

/// The environment variable that names the instruction set to be used instead of the machine's widest.
const INSTRUCTIONS: &str = "ASOBENCH_INSTRUCTIONS";

fn choose_instructions() -> Result<(), Error> {
    let Some(given) = std::env::var_os(INSTRUCTIONS).filter(|given| !given.is_empty()) else {
        return Ok(());
    };
    let wrong = |reason: String| Error::Input(format!("{INSTRUCTIONS}: {reason}"));
    let isa: Isa = given.to_string_lossy().parse().map_err(|error| {
        let error: UnknownName = error;
        wrong(error.to_string())
    })?;
    isa.choose().map_err(|error| {
        let here = Isa::ALL.iter().filter(|isa| isa.is_here());
        let here: Vec<&str> = here.map(|isa| isa.name()).collect();
        wrong(format!("{error}; expected {}", here.join(" or ")))
    })
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
    format!("{} ({}, {isa})", env!("CARGO_PKG_VERSION"), short.unwrap_or(revision))
});

/// Prints help and version if requested; turns a usage error into a line for each thing that is wrong.
fn usage(error: &clap::Error, given: &[OsString]) -> Result<(), Error> {
    use clap::error::ErrorKind;
    let text = error.render().to_string();
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => print(&text),
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            text.lines().for_each(note);
            Err(Error::Told(exit_code::BAD_INPUT))
        }
        _ => Err(Error::Usage(first_guess::lines(
            error,
            given,
            &every_command(),
            one_line,
        ))),
    }
}

/// Every command with its arguments, those that clap adds among them.
fn every_command() -> clap::Command {
    let mut all = Cli::command();
    all.build();
    all
}

/// Returns the message and its tip, without the usage lines.
fn one_line(text: &str) -> String {
    let ends = ["\nUsage:", "\nFor more information"];
    let end = ends.iter().filter_map(|end| text.find(end)).min().unwrap_or(text.len());
    let mut line = String::new();
    for part in text[..end].lines().map(str::trim).filter(|part| !part.is_empty()) {
        match part.strip_prefix("tip: ") {
            // A flag is never meant as a value here.
            Some(tip) if tip.starts_with("to pass ") => {}
            Some(tip) => line.extend(["; ", tip]),
            None if line.is_empty() => line.push_str(part.trim_start_matches("error: ")),
            None => line.extend([" ", part]),
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::{every_command, first_guess};

    #[test]
    fn answers_to_first_guesses_fit_their_command() {
        first_guess::tests::answers_fit(&every_command());
    }

    #[test]
    fn usage_errors_become_one_line() {
        let text = "error: unexpected argument '--trails' found\n\n  tip: a similar argument \
                    exists: '--trials'\n\nUsage: asobench reproduce\n\nFor more information, try \
                    '--help'.\n";
        let line = super::one_line(text);
        assert_eq!(
            line,
            "unexpected argument '--trails' found; a similar argument exists: '--trials'"
        );
    }
}
