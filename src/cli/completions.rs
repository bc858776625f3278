//! `asobench completions`: prints the completions of commands and flags for a shell, or a manual page.

use super::error::{Error, failed};
use super::output::print;
use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;

/// Print the completions of a shell, such as: asobench completions bash >
/// ~/.local/share/bash-completion/completions/asobench
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
pub(super) struct Arguments {
    /// bash, zsh, fish, elvish or powershell
    shell: Option<Shell>,
    /// Print the manual page of a command instead, or of asobench, such as: asobench completions --manual run >
    /// asobench-run.1
    #[arg(long, value_name = "COMMAND", num_args = 0..=1, default_missing_value = "asobench")]
    manual: Option<String>,
}

pub(super) fn run(arguments: &Arguments, mut command: Command) -> Result<(), Error> {
    let mut text = Vec::new();
    let name = command.get_name().to_owned();
    if let Some(of) = &arguments.manual {
        Man::new(page(command, of)?).render(&mut text).map_err(failed)?;
    } else if let Some(shell) = arguments.shell {
        clap_complete::generate(shell, &mut command, name, &mut text);
    }
    print(&String::from_utf8(text).map_err(failed)?)
}

/// Returns the command of a manual page, called `asobench-NAME` as its page is.
fn page(mut program: Command, name: &str) -> Result<Command, Error> {
    program.build();
    if name == program.get_name() {
        return Ok(program);
    }
    let found = program.find_subcommand(name).cloned();
    let command = found.ok_or_else(|| {
        Error::Input(format!(
            "--manual {name}: expected asobench or one of its commands, such as run"
        ))
    })?;
    Ok(command.display_name(format!("asobench-{name}")))
}
