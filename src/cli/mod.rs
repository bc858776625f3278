//! The command line: `commands.rs` lists the subcommands, each of which has a file of its own; `output.rs` prints, and
//! `error.rs` has the errors, each a line, `exit_code.rs` their exit codes.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the place that prints")]

mod check;
mod cluster;
mod colour;
mod commands;
mod compare;
mod completions;
mod confirm;
mod equation;
mod error;
mod estimate;
mod execute;
mod exit_code;
mod explain;
mod failures;
mod files;
mod first_guess;
mod groups;
mod memory;
mod merge;
mod methods;
mod need;
mod new_experiment;
mod output;
mod plan;
mod plot;
mod programs;
mod progress;
mod replay;
mod report;
mod reproduce;
mod run;
mod schema;
mod shard;
mod slurm;
mod status;
mod study_arguments;
mod suite;
mod template;
mod test_method;
mod theory;
mod throughput;
mod timing;

pub use commands::main;
