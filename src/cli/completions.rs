//! `asobench completions`: prints the completions of commands and flags for a shell.

use super::error::{Error, failed};
use super::{Cli, print};
use clap::CommandFactory as _;
use clap_complete::Shell;
use std::process::ExitCode;

/// Print the completions of a shell, such as: asobench completions bash >
/// ~/.local/share/bash-completion/completions/asobench
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// bash, zsh, fish, elvish or powershell
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let mut script = Vec::new();
    let mut command = Cli::command();
    let name = command.get_name().to_owned();
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    print(&String::from_utf8(script).map_err(failed)?)?;
    Ok(ExitCode::SUCCESS)
}
