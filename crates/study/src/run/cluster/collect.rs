//! What processes left in folders: their blocks, and their records of themselves.

use crate::design::experiment::Experiment;
use crate::files;
use crate::files::Kind;
use crate::files::PathError;
use crate::outcome::folder::{DESIGN, span_of};
use crate::run::blocks::{BlockError, BlockFolder, StoredBlock, name_of};
use crate::run::cluster::cover::cover;
use crate::run::cluster::run_file::{RUN, Run};
use crate::run::cluster::shard_plan::hexadecimal;
use crate::run::runner::Span;
use rayon::prelude::*;
use serde_json::Value;
use std::ops::Range;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_128;

/// A folder with blocks.
#[derive(Clone, Debug)]
pub(crate) struct RunFolder {
    pub(crate) path: PathBuf,
    /// The process that wrote them, if known.
    pub(crate) run: Option<Run>,
}

/// A block that was found; the rest is in its name.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    source: u32,
    pub(crate) trials: Range<u64>,
}

/// Block files of one design, by cell, in folders and their subfolders.
#[derive(Debug, Default)]
pub struct Collection {
    pub(crate) sources: Vec<RunFolder>,
    pub(crate) cells: Vec<Vec<Found>>,
    /// What was left out and why, one line each.
    pub refused: Vec<String>,
    /// Folders without a record of their design; only the content of their blocks tells.
    unknown: Vec<u32>,
}

/// The result of reading the blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verified {
    /// Block files.
    pub files: u64,
    /// Their bytes.
    pub bytes: u64,
}

impl Collection {
    /// Looks for blocks of an experiment in folders, at any depth, by names and `run.json` alone. Blocks of folders
    /// without any record of their design count until they are read.
    ///
    /// # Errors
    /// If a folder cannot be read.
    pub fn from_folders(folders: &[PathBuf], experiment: &Experiment) -> Result<Self, PathError> {
        let mut collection = Self {
            cells: vec![Vec::new(); experiment.cells.len()],
            ..Self::default()
        };
        let fingerprint = hexadecimal(experiment.fingerprint());
        let mut left: Vec<PathBuf> = folders.iter().rev().cloned().collect();
        while let Some(folder) = left.pop() {
            match files::entries(&folder) {
                Ok([found, within, other]) => {
                    left.extend(within.into_iter().rev());
                    let refused = other.iter().map(|path| {
                        format!(
                            "{}: not a file or a folder but a link or the like, not taken",
                            path.display()
                        )
                    });
                    collection.refused.extend(refused);
                    collection.take(&folder, &found, &fingerprint)?;
                }
                // A subfolder may have vanished after it was listed. A folder named by the caller must exist.
                Err(error) if folders.contains(&folder) || !is_missing(&error) => {
                    return Err(error);
                }
                Err(_) => {}
            }
        }
        Ok(collection)
    }

    /// Collects the blocks of one folder.
    fn take(
        &mut self,
        folder: &Path,
        found: &[PathBuf],
        fingerprint: &str,
    ) -> Result<(), PathError> {
        let spans = found.iter().filter_map(|path| Some((path, span_of(path)?)));
        let spans: Vec<(&PathBuf, (usize, u64, u64))> = spans.collect();
        if spans.is_empty() {
            return Ok(());
        }
        let run = read_run(&folder.join(RUN))?;
        let of_design = match &run {
            Some(run) => Some(run.fingerprint.clone()),
            None => design_fingerprint(&folder.join(DESIGN))?,
        };
        if of_design
            .as_deref()
            .is_some_and(|design| design != fingerprint)
        {
            self.refused.push(format!(
                "{}: {} blocks of another experiment or version, not taken",
                folder.display(),
                spans.len()
            ));
            return Ok(());
        }
        let source = self.sources.len() as u32;
        if of_design.is_none() {
            self.unknown.push(source);
        }
        self.sources.push(RunFolder {
            path: folder.to_owned(),
            run,
        });
        for (path, (cell, from, to)) in spans {
            let trials = from..to;
            match self.cells.get_mut(cell) {
                Some(of_cell) if from < to => of_cell.push(Found { source, trials }),
                _ => self.refused.push(format!(
                    "{}: no such cell or no trials in its name, not taken",
                    path.display()
                )),
            }
        }
        Ok(())
    }

    /// Leaves out blocks in folders without a record of their design. Only reading would identify them.
    pub fn forget_unknown(&mut self) {
        for source in &self.unknown {
            let of_cells = self.cells.iter().flatten();
            let blocks = of_cells.filter(|found| found.source == *source).count();
            self.refused.push(format!(
                "{}: {blocks} blocks without {RUN}, not counted; --verify reads them",
                self.sources[*source as usize].path.display()
            ));
        }
        let unknown = std::mem::take(&mut self.unknown);
        for of_cell in &mut self.cells {
            of_cell.retain(|found| !unknown.contains(&found.source));
        }
    }

    /// Reads every block and leaves out those that are damaged or of another design.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn verify(&mut self, experiment: &Experiment) -> Result<Verified, BlockError> {
        let blocks = BlockFolder::at(PathBuf::new(), experiment);
        let mut verified = Verified::default();
        let mut refused = Vec::new();
        for cell in 0..self.cells.len() {
            let of_cell = std::mem::take(&mut self.cells[cell]);
            // A block and its size, or the path of one that is refused.
            type Read = (Result<Found, PathBuf>, u64);
            let read: Vec<Result<Read, BlockError>> = of_cell
                .into_par_iter()
                .map(|found| {
                    let block = self.block(cell, &found);
                    let (span, content) = blocks.verified(&block.path)?;
                    let found = if span == block.span {
                        Ok(found)
                    } else {
                        Err(block.path)
                    };
                    Ok((found, content.len() as u64))
                })
                .collect();
            for result in read {
                match result {
                    Ok((Ok(found), bytes)) => {
                        verified.files += 1;
                        verified.bytes += bytes;
                        self.cells[cell].push(found);
                    }
                    Ok((Err(path), _)) => {
                        let path = path.display();
                        refused.push(format!("{path}: has the name of another block, not taken"));
                    }
                    // It was merged into a larger block after it was listed.
                    Err(BlockError::File(error)) if is_missing(&error) => {}
                    Err(BlockError::File(error)) if !error.foreign => {
                        return Err(error.into());
                    }
                    Err(BlockError::Damaged { path, reason }) => {
                        refused.push(format!("{}: damaged ({reason}), not taken", path.display()));
                    }
                    Err(BlockError::OtherDesign { path }) => refused.push(format!(
                        "{}: of another experiment or version, not taken",
                        path.display()
                    )),
                    Err(error) => refused.push(format!("{error}, not taken")),
                }
            }
        }
        self.unknown.clear();
        self.refused.extend(refused);
        Ok(verified)
    }

    /// Keeps blocks by their cell and the process that wrote them.
    pub(crate) fn retain(&mut self, keep: impl Fn(usize, Option<&Run>) -> bool) {
        let sources = &self.sources;
        for (cell, of_cell) in self.cells.iter_mut().enumerate() {
            of_cell.retain(|found| keep(cell, sources[found.source as usize].run.as_ref()));
        }
    }

    /// Returns the process that wrote each block of a cell; `None` if unknown.
    pub(crate) fn runs_of(&self, cell: usize) -> impl Iterator<Item = Option<&Run>> {
        let of_cell = self.cells[cell].iter();
        of_cell.map(|found| self.sources[found.source as usize].run.as_ref())
    }

    /// Returns the blocks that cover most of a range of a cell's trials: ascending, and without overlap.
    pub(crate) fn cover(&self, cell: usize, trials: &Range<u64>) -> Vec<Found> {
        let of_cell = self.cells[cell].iter();
        let inside = of_cell
            .filter(|found| trials.start <= found.trials.start && found.trials.end <= trials.end);
        cover(inside.cloned().collect(), |found| &found.trials)
    }

    /// Returns how many of a cell's first trials are covered by blocks of some processes.
    pub(crate) fn cover_of(
        &self,
        cell: usize,
        trials: u64,
        is_wanted: impl Fn(Option<&Run>) -> bool,
    ) -> u64 {
        let by = |found: &&Found| is_wanted(self.sources[found.source as usize].run.as_ref());
        let inside = self.cells[cell]
            .iter()
            .filter(|found| found.trials.end <= trials);
        let ranges = inside.filter(by).map(|found| found.trials.clone());
        let covered = cover(ranges.collect(), |range| range);
        covered.iter().map(|range| range.end - range.start).sum()
    }

    /// Returns a block with its path.
    pub(crate) fn block(&self, cell: usize, found: &Found) -> StoredBlock {
        let trials = found.trials.clone();
        let span = Span { cell, trials };
        let folder = &self.sources[found.source as usize].path;
        StoredBlock {
            path: folder.join(name_of(&span)),
            span,
        }
    }

    /// Returns for every cell the blocks that cover most of its first trials.
    pub(crate) fn chosen(&self, trials: impl Fn(usize) -> u64) -> Vec<Vec<StoredBlock>> {
        let of_cell = |cell: usize| {
            let covered = self.cover(cell, &(0..trials(cell)));
            covered
                .iter()
                .map(|found| self.block(cell, found))
                .collect()
        };
        (0..self.cells.len()).map(of_cell).collect()
    }
}

/// Whether the error is only that the file does not exist.
pub(crate) fn is_missing(error: &PathError) -> bool {
    error.source.kind() == std::io::ErrorKind::NotFound
}

/// Reads what a process records of itself; `None` if there is nothing readable.
fn read_run(path: &Path) -> Result<Option<Run>, PathError> {
    let text = files::read_own(path, Kind::Run)?;
    Ok(text.and_then(|text| serde_json::from_slice(&text).ok()))
}

/// Reads the fingerprint of the design beside the blocks in a folder of results.
fn design_fingerprint(path: &Path) -> Result<Option<String>, PathError> {
    let text = files::read_own(path, Kind::Design)?;
    let design = text.and_then(|text| serde_json::from_slice::<Value>(&text).ok());
    Ok(design.map(|design| hexadecimal(xxh3_128(design.to_string().as_bytes()))))
}
