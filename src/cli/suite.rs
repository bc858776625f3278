//! `asobench suite`: the reference suite. Runs it, lists and shows it, prints its numbers, and measures a newcomer.

mod archive;
mod law;
mod newcomer;
mod page;
mod part;
mod published;
mod recorded;
mod run;
mod show;
mod times;

use super::error::Error;

/// Measure a method against published systems and their Cramer-Rao bounds: the reference suite
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, arg_required_else_help = true)]
pub(super) struct Arguments {
    #[command(subcommand)]
    what: Option<What>,
    #[command(flatten)]
    newcomer: newcomer::Arguments,
}

#[derive(clap::Subcommand)]
enum What {
    Run(run::Arguments),
    /// List the scenarios of a tier
    List(part::Part),
    Show(show::Arguments),
    Scores(page::Arguments),
    Published(published::Arguments),
    Times(times::Arguments),
    Law(law::Arguments),
    Recorded(recorded::Arguments),
    Export(archive::Export),
    Add(archive::Add),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    match &arguments.what {
        None => newcomer::run(&arguments.newcomer),
        Some(What::Run(arguments)) => run::run(arguments),
        Some(What::List(arguments)) => show::list(arguments),
        Some(What::Show(arguments)) => show::run(arguments),
        Some(What::Scores(arguments)) => page::run(arguments),
        Some(What::Published(arguments)) => published::run(arguments),
        Some(What::Times(arguments)) => times::run(arguments),
        Some(What::Law(arguments)) => law::run(arguments),
        Some(What::Recorded(arguments)) => recorded::run(arguments),
        Some(What::Export(arguments)) => archive::export(arguments),
        Some(What::Add(arguments)) => archive::add(arguments),
    }
}
