//! `asobench completions`: prints the completions of commands and flags for a shell.

use super::error::{Error, failed};
use super::output::print;
use clap::Command;
use clap_complete::Shell;
use std::process::ExitCode;

/// Print the completions of a shell, such as: asobench completions bash >
/// ~/.local/share/bash-completion/completions/asobench
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// bash, zsh, fish, elvish or powershell
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments, mut command: Command) -> Result<ExitCode, Error> {
    let mut script = Vec::new();
    let name = command.get_name().to_owned();
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    print(&String::from_utf8(script).map_err(failed)?)?;
    Ok(ExitCode::SUCCESS)
}
