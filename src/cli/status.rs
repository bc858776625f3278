//! `asobench status`: prints which trials of a plan are computed.

use super::cluster::{self, refused, word};
use super::error::Error;
use super::exit_code::AGAIN;
use super::output::print;
use crate::study::cluster::{PlaceStatus, ShardPlan, Status};
use std::path::PathBuf;

/// Show how much of a plan is computed, by shard and by cell, and print the command that computes the
/// rest. Ends with exit code 75 while trials are missing.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The plan, as `asobench plan` writes it
    plan: PathBuf,
    /// Folders of the shards' results, at any depth [default: NAME-shards beside the plan]
    folders: Vec<PathBuf>,
    /// Read every block, and count only those that are intact
    #[arg(long)]
    verify: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let path = &arguments.plan;
    let (plan, experiment) = ShardPlan::read(path).map_err(refused)?;
    // No folder exists before the first shard has run.
    let (given, may_lack) = (&arguments.folders, arguments.folders.is_empty());
    let found = cluster::collected((path, given), &experiment, arguments.verify, may_lack)?;
    let status = Status::new(&plan, &found);
    let mut text = table("shard", 1, &status.shards);
    text += &table("cell", 0, &status.cells);
    if !arguments.verify {
        text += "By the names of files; --verify reads them.\n";
    }
    let code = if status.is_complete() {
        text.extend([format!("all there: asobench merge {}\n", word(path))]);
        Ok(())
    } else {
        text += &cluster::again(path, &plan, &status);
        Err(Error::Told(AGAIN))
    };
    print(&text).and(code)
}

/// Counts the places that are whole, and gives a line for each of the first that are not.
fn table(name: &str, first: usize, places: &[PlaceStatus]) -> String {
    let lacking = places.iter().enumerate().filter(|(_, place)| place.missing > 0);
    let lines = lacking.clone().map(|(i, PlaceStatus { wanted, missing })| {
        format!("  {name} {}: {missing} of {wanted} trials missing\n", i + first)
    });
    let mut text: String = lines.take(cluster::LINES).collect();
    let lacking = lacking.count();
    if let Some(more @ 1..) = lacking.checked_sub(cluster::LINES) {
        text.extend([format!("  and {more} more\n")]);
    }
    let not_begun = places
        .iter()
        .filter(|place| place.missing > 0 && place.missing == place.wanted);
    let not_begun = not_begun.count();
    format!(
        "{} {name}s: {} whole, {} begun, {not_begun} not begun\n{text}",
        places.len(),
        places.len() - lacking,
        lacking - not_begun
    )
}
