//! `asobench completions`: prints the completions of commands and flags for a shell, or writes the manual pages.

use super::error::{Error, failed};
use super::files::cannot_write;
use super::output::print;
use clap::Command;
use clap_complete::Shell;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Print the completions of a shell, such as: asobench completions bash >
/// ~/.local/share/bash-completion/completions/asobench
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
pub(super) struct Arguments {
    /// bash, zsh, fish, elvish or powershell
    shell: Option<Shell>,
    /// Write the manual pages instead, one a command, such as ~/.local/share/man/man1
    #[arg(long, value_name = "DIR")]
    manual: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, mut command: Command) -> Result<ExitCode, Error> {
    if let Some(folder) = &arguments.manual {
        write_manual(command, folder)?;
    }
    if let Some(shell) = arguments.shell {
        let mut script = Vec::new();
        let name = command.get_name().to_owned();
        clap_complete::generate(shell, &mut command, name, &mut script);
        print(&String::from_utf8(script).map_err(failed)?)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write_manual(command: Command, folder: &Path) -> Result<(), Error> {
    let cannot = |error| cannot_write(folder, &error);
    std::fs::create_dir_all(folder).map_err(cannot)?;
    clap_mangen::generate_to(command, folder).map_err(cannot)
}
