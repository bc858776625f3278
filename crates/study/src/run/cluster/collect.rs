//! The files that processes left in folders: their blocks, and their records of themselves.

use crate::design::Experiment;
use crate::files;
use crate::files::Kind;
use crate::files::PathError;
use crate::outcome::folder_layout::{DESIGN, span_of};
use crate::run::block_file::{BlockError, BlockFolder, StoredBlock, name_of};
use crate::run::cluster::cover::cover;
use crate::run::cluster::shard_plan::{hexadecimal, is_by_faer};
use crate::run::runner::Span;
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_128;

/// The file in which a process describes itself.
pub(crate) const RUN: &str = "run.json";

/// A process's record of itself in `run.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    /// "asobench".
    #[serde(rename = "run")]
    pub(crate) program: String,
    pub(crate) version: String,
    pub(crate) git_revision: Option<String>,
    pub(crate) fingerprint: String,
    /// The number of the shard, from 1.
    pub(crate) shard: usize,
    pub(crate) faer_instructions: String,
    #[serde(flatten)]
    pub(crate) process: Process,
}

/// A process on its machine.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Process {
    /// The machine's name.
    pub host: String,
    /// The process ID.
    pub pid: u32,
    /// Its start, in seconds since 1970.
    pub begin: u64,
    /// The number of the job, if it is one.
    pub job: Option<String>,
}

/// A folder with blocks.
#[derive(Debug)]
struct Source {
    path: PathBuf,
    /// The vector instructions of the process that wrote them, if known.
    faer_instructions: Option<String>,
}

/// A block that was found; the rest is in its name.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    source: Arc<Source>,
    pub(crate) trials: Range<u64>,
}

/// Block files of one design, by cell, in folders and their subfolders.
#[derive(Debug, Default)]
pub struct Collection {
    pub(crate) cells: Vec<Vec<Found>>,
    /// The files that were left out and why, one line each.
    pub refused: Vec<String>,
    /// Whether some of it is of another design.
    pub(crate) has_others: bool,
    /// Block files that were read, and their bytes.
    pub read: (u64, u64),
}

impl Collection {
    /// Looks for blocks of an experiment in folders, at any depth, by names and `run.json` alone; with `verify` it
    /// reads every block, and leaves out those that are damaged or of another design.
    ///
    /// # Errors
    /// If a folder or a block cannot be read.
    pub fn from_folders(folders: &[PathBuf], experiment: &Experiment, verify: bool) -> Result<Self, BlockError> {
        let mut found = Self {
            cells: vec![Vec::new(); experiment.cells.len()],
            ..Self::default()
        };
        let fingerprint = hexadecimal(experiment.fingerprint());
        let mut left: Vec<PathBuf> = folders.iter().rev().cloned().collect();
        while let Some(folder) = left.pop() {
            let [blocks, within, other] = match files::entries(&folder) {
                // A subfolder may have vanished after it was listed. A folder named by the caller must exist.
                Err(error) if is_missing(&error) && !folders.contains(&folder) => continue,
                entries => entries?,
            };
            left.extend(within.into_iter().rev());
            for path in other {
                found.refuse(&path, "not a file or a folder but a link or the like");
            }
            found.take(&folder, &blocks, &fingerprint, verify)?;
        }
        if verify {
            found.verify(experiment)?;
        }
        Ok(found)
    }

    fn refuse(&mut self, path: &Path, why: &str) {
        self.refused.push(format!("{}: {why}, not taken", path.display()));
    }

    /// Reads an object that a process wrote; `None` if there is none, or it is damaged.
    fn object<T: DeserializeOwned>(&mut self, path: &Path, kind: Kind) -> Result<Option<T>, PathError> {
        let Some(text) = files::read_own(path, kind)? else {
            return Ok(None);
        };
        let parsed = files::parsed(&text).and_then(|json| {
            let own = serde_json::from_value(json);
            own.map_err(|error| error.to_string())
        });
        Ok(parsed
            .map_err(|reason| self.refuse(path, &format!("not as it was written ({reason})")))
            .ok())
    }

    /// Collects the blocks of one folder. Only the content of blocks tells whose they are if nothing beside them does.
    fn take(&mut self, folder: &Path, paths: &[PathBuf], fingerprint: &str, verify: bool) -> Result<(), PathError> {
        let spans = paths.iter().filter_map(|path| Some((path, span_of(path)?)));
        let spans: Vec<_> = spans.collect();
        if spans.is_empty() {
            return Ok(());
        }
        let run: Option<Run> = self.object(&folder.join(RUN), Kind::Run)?;
        let of_design = match &run {
            Some(run) => Some(run.fingerprint.clone()),
            None => self
                .object(&folder.join(DESIGN), Kind::Design)?
                .map(|design: Value| hexadecimal(xxh3_128(design.to_string().as_bytes()))),
        };
        match of_design {
            None if !verify => {
                let (folder, count) = (folder.display(), spans.len());
                self.refused.push(format!(
                    "{folder}: {count} blocks without {RUN}, not counted; --verify reads them"
                ));
                return Ok(());
            }
            Some(of_design) if of_design != fingerprint => {
                let why = format!("{} blocks of another experiment or version", spans.len());
                self.refuse(folder, &why);
                self.has_others = true;
                return Ok(());
            }
            _ => {}
        }
        let source = Arc::new(Source {
            path: folder.to_owned(),
            faer_instructions: run.map(|run| run.faer_instructions),
        });
        for (path, (cell, from, to)) in spans {
            let (source, trials) = (Arc::clone(&source), from..to);
            match self.cells.get_mut(cell) {
                Some(of_cell) if from < to => of_cell.push(Found { source, trials }),
                _ => self.refuse(path, "no such cell or no trials in its name"),
            }
        }
        Ok(())
    }

    fn verify(&mut self, experiment: &Experiment) -> Result<(), BlockError> {
        let blocks = BlockFolder::at(PathBuf::new(), experiment);
        for cell in 0..self.cells.len() {
            let of_cell = std::mem::take(&mut self.cells[cell]).into_par_iter();
            let read = of_cell.map(|found| {
                let block = found.block(cell);
                (blocks.verified(&block.path), block, found)
            });
            for (result, block, found) in read.collect::<Vec<_>>() {
                match result {
                    Ok((span, content)) if span == block.span => {
                        self.read.0 += 1;
                        self.read.1 += content.len() as u64;
                        self.cells[cell].push(found);
                    }
                    Ok(_) => self.refuse(&block.path, "has the name of another block"),
                    // It was merged into a larger block after it was listed.
                    Err(BlockError::File(error)) if is_missing(&error) => {}
                    Err(BlockError::File(error)) if !error.foreign => return Err(error.into()),
                    Err(BlockError::OtherDesign { path }) => {
                        self.refuse(&path, "of another experiment or version");
                        self.has_others = true;
                    }
                    Err(error) => self.refused.push(format!("{error}, not taken")),
                }
            }
        }
        Ok(())
    }

    /// Returns how many blocks of cells by faer were computed with which vector instructions.
    pub(crate) fn instructions(&self, experiment: &Experiment) -> BTreeMap<String, u64> {
        let mut counts = BTreeMap::new();
        for (cell, of_cell) in self.cells.iter().enumerate() {
            for found in of_cell.iter().filter(|_| is_by_faer(experiment, cell)) {
                let known = found.source.faer_instructions.as_deref();
                *counts.entry(known.unwrap_or("unknown").to_owned()).or_default() += 1;
            }
        }
        counts
    }

    /// Returns the blocks without those of cells by faer that were computed with other instructions, whose last bits
    /// differ.
    pub(crate) fn with_instructions(&self, experiment: &Experiment, wanted: &str) -> Self {
        let mut cells = self.cells.clone();
        for (cell, of_cell) in cells.iter_mut().enumerate() {
            if is_by_faer(experiment, cell) {
                of_cell.retain(|found| found.source.faer_instructions.as_deref() == Some(wanted));
            }
        }
        Self {
            cells,
            ..Self::default()
        }
    }

    /// Returns the blocks that cover most of a range of a cell's trials: ascending, and without overlap.
    pub(crate) fn cover(&self, cell: usize, trials: &Range<u64>) -> Vec<Found> {
        let of_cell = self.cells[cell].iter();
        let inside = of_cell.filter(|found| trials.start <= found.trials.start && found.trials.end <= trials.end);
        cover(inside.cloned().collect(), |found| &found.trials)
    }

    /// Returns for every cell the blocks that cover most of its first trials.
    pub(crate) fn chosen(&self, trials: impl Fn(usize) -> u64) -> Vec<Vec<StoredBlock>> {
        let of_cell = |cell: usize| {
            let covered = self.cover(cell, &(0..trials(cell)));
            covered.iter().map(|found| found.block(cell)).collect()
        };
        (0..self.cells.len()).map(of_cell).collect()
    }
}

impl Found {
    /// Returns the block with its path.
    fn block(&self, cell: usize) -> StoredBlock {
        let trials = self.trials.clone();
        let span = Span { cell, trials };
        StoredBlock {
            path: self.source.path.join(name_of(&span)),
            span,
        }
    }
}

/// Whether the error is only that the file does not exist.
fn is_missing(error: &PathError) -> bool {
    error.source.kind() == std::io::ErrorKind::NotFound
}
