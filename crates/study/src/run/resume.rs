//! How an interrupted run is resumed: which trials of a study are computed already, and which are missing.
//!
//! An intact block is never computed again. A damaged one ends the run, or is computed anew where the user asks for a
//! repair.

use crate::design::Experiment;
use crate::files;
use crate::files::Kind;
use crate::outcome::folder_layout::{BLOCKS, DESIGN, Done, done_in};
use crate::outcome::publication::REPLACING;
use crate::run::block_file::{BlockError, BlockFolder, StoredBlock};
use crate::run::runner::Span;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Returns the intact blocks of every cell, ascending and without overlap.
///
/// # Errors
/// If a block is damaged and `repair` is not set, or a file cannot be read or moved.
pub(crate) fn stored(blocks: &BlockFolder, cells: usize, repair: bool) -> Result<Vec<Vec<StoredBlock>>, BlockError> {
    let (mut found, mut damaged) = blocks.list()?;
    if repair {
        // An intact file may still hold content that this program cannot decode.
        found.retain(|block| match blocks.read(block) {
            Err(error @ BlockError::Damaged { .. }) => {
                damaged.push(error);
                false
            }
            _ => true,
        });
    }
    discard_damaged(damaged, repair)?;
    let mut stored = vec![Vec::new(); cells];
    for block in found {
        stored[block.span.cell].push(block);
    }
    Ok(stored)
}

/// Returns the ranges of a cell's trials below `target` that none of its blocks covers.
pub(crate) fn missing(stored: &[StoredBlock], cell: usize, target: u64) -> impl Iterator<Item = Span> {
    let trials = stored.iter().map(|block| block.span.trials.clone());
    gaps(trials, 0..target).map(move |trials| Span { cell, trials })
}

/// Returns the gaps in a whole that ascending ranges without overlap leave.
pub(crate) fn gaps(
    ranges: impl Iterator<Item = Range<u64>> + Clone,
    whole: Range<u64>,
) -> impl Iterator<Item = Range<u64>> {
    let ends = std::iter::once(whole.start).chain(ranges.clone().map(|range| range.end));
    let starts = ranges.map(|range| range.start).chain([whole.end]);
    let between = ends.zip(starts).map(|(from, to)| from..to);
    between.filter(|range| range.start < range.end)
}

/// Moves damaged blocks out of the way where a repair is wanted.
///
/// # Errors
/// Otherwise the first of them; and if a file cannot be moved.
pub(crate) fn discard_damaged(damaged: Vec<BlockError>, repair: bool) -> Result<(), BlockError> {
    for error in damaged {
        match &error {
            BlockError::Damaged { path, .. } if repair => discard(path)?,
            _ => return Err(error),
        }
    }
    Ok(())
}

/// Moves a damaged file out of the way: removes it, or renames it if it does not begin like a block.
///
/// # Errors
/// If it is not a regular file, or cannot be removed.
fn discard(path: &Path) -> Result<(), BlockError> {
    if files::is_own(path, Kind::Block)? {
        files::remove(path, Kind::Block)?;
    } else {
        files::set_aside(path)?;
    }
    Ok(())
}

/// Returns how much of an experiment a results folder holds, by the names of its block files. Nothing if there are
/// none, or of another design. Writes nothing and reads no block.
pub fn done(results: &Path, experiment: &Experiment) -> Done {
    let design = experiment.stamped_design();
    let places = [results.to_owned(), results.join(REPLACING)].map(|place| place.join(BLOCKS));
    let of_design = |blocks: &PathBuf| {
        let text = files::read_own(&blocks.join(DESIGN), Kind::Design);
        let stored = text.ok().flatten().map(|text| files::parsed(&text));
        stored.is_some_and(|stored| stored.is_ok_and(|stored| stored == design))
    };
    let found = places.into_iter().find(of_design);
    found.map_or_else(Done::default, |blocks| done_in(&blocks))
}
