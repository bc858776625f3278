//! `asobench estimate`: the stages on a record of the user's own.

use super::error::{Error, input};
use super::{Format, print};
use std::process::ExitCode;

/// a
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    format: Format,
}
pub(super) fn run(_arguments: &Arguments) -> Result<ExitCode, Error> {
    print("")?;
    Err(input(""))
}
