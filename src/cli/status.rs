//! `asobench status`: prints which trials of a plan are computed.

use super::cluster::{self, folders, refused, word};
use super::error::Error;
use super::output::{note, print};
use crate::study::cluster::{Collection, PlaceStatus, ShardPlan, Status};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Show how much of a plan is computed, by shard and by cell, and print the line that computes what is
/// missing. Ends with exit code 75 while something is.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The plan, as `asobench plan` writes it
    plan: PathBuf,
    /// Folders with what shards left, at any depth [default: NAME-shards beside the plan]
    folders: Vec<PathBuf>,
    /// Read every block, and count only those that are intact
    #[arg(long)]
    verify: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let path = &arguments.plan;
    let (plan, experiment) = ShardPlan::read(path).map_err(refused)?;
    let mut folders = folders(path, &arguments.folders);
    if arguments.folders.is_empty() {
        // No folder exists before the first shard has run.
        folders.retain(|folder| crate::files::is_there(folder));
    }
    let mut found =
        Collection::from_folders(&folders, &experiment).map_err(|e| refused(e.into()))?;
    if arguments.verify {
        found.verify(&experiment).map_err(|e| refused(e.into()))?;
    } else {
        found.forget_unknown();
    }
    for line in found.refused.iter().take(cluster::LINES) {
        note(line);
    }
    let status = Status::new(&plan, &found);
    let mut text = table("shard", 1, &status.shards);
    text += &table("cell", 0, &status.cells);
    if !arguments.verify {
        text += "By the names of files; --verify reads them.\n";
    }
    if status.is_complete() {
        // Writing to a string does not fail.
        let _ = writeln!(text, "all there: asobench merge {}", word(path));
        print(&text)?;
        return Ok(ExitCode::SUCCESS);
    }
    if status.unplanned > 0 {
        let _ = writeln!(
            text,
            "{} trials are in no shard of this plan; plan again: asobench plan {} --out {}",
            status.unplanned,
            word(path),
            word(path)
        );
    }
    if let Some(again) = cluster::again(path, &plan, &status) {
        let _ = writeln!(text, "{again}");
    }
    print(&text)?;
    Ok(ExitCode::from(75))
}

/// Counts the places that are whole, and gives a line for each of the first that are not.
fn table(name: &str, first: usize, places: &[PlaceStatus]) -> String {
    let (mut whole, mut begun, mut listed, mut text) = (0, 0, 0, String::new());
    for (i, place) in places.iter().enumerate() {
        let PlaceStatus { wanted, missing } = *place;
        if missing == 0 {
            whole += 1;
            continue;
        }
        begun += usize::from(missing < wanted);
        listed += 1;
        if listed > cluster::LINES {
            continue;
        }
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "  {name} {}: {missing} of {wanted} trials missing",
            i + first
        );
    }
    if let Some(more @ 1..) = listed.checked_sub(cluster::LINES) {
        let _ = writeln!(text, "  and {more} more");
    }
    let not_begun = places.len() - whole - begun;
    format!(
        "{} {name}s: {whole} whole, {begun} begun, {not_begun} not begun\n{text}",
        places.len()
    )
}
