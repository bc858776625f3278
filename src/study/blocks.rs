//! Block files: what one worker computed, whole or not at all, with the design's fingerprint and a checksum.
//!
//! ```text
//! "asobench" | format u32 | fingerprint u128 | cell u32 | first trial u64 | end u64 | content (postcard) | checksum u128
//! ```
//!
//! All little-endian; the checksum is XXH3 of everything before it. A block file may be any range of trials: ranges
//! that lie within others are ignored, gaps are computed.

use super::experiment::Experiment;
use super::file::{Store, TRIAL_LIMIT};
use super::folder::replace_file;
use super::row::Row;
use super::runner::{Block, Span};
use super::tally::{CellTally, OutputTally, outcomes};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_128;

const MAGIC: &[u8; 8] = b"asobench";
/// The format of block files.
const FORMAT: u32 = 1;
const HEAD: usize = 8 + 4 + 16 + 4 + 8 + 8;
const CHECKSUM: usize = 16;

/// Why a block file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BlockError {
    /// The file system.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The error.
        source: io::Error,
    },
    /// The content is not what was written.
    #[error("{}: damaged ({reason}); --repair computes it again", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: &'static str,
    },
    /// Another version's file.
    #[error("{}: written by a newer version of asobench (format {format}; this one knows {FORMAT})", .path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: u32,
    },
    /// Another design's file.
    #[error("{}: a block of another experiment; remove this file, then its trials are computed", .path.display())]
    OtherDesign {
        /// The file.
        path: PathBuf,
    },
}

/// A block file that was found whole.
#[derive(Clone, Debug)]
pub struct StoredBlock {
    /// The cell and the trials.
    pub span: Span,
    /// The file.
    pub path: PathBuf,
}

/// What a block file holds.
#[derive(Serialize, Deserialize)]
pub struct Content {
    /// What is left of the trials.
    pub tally: CellTally,
    /// The trials themselves, where they are kept.
    pub rows: Option<Vec<Row>>,
}

impl Content {
    /// Decodes the content of a block of these trials of an experiment, and checks it: whoever wrote it, what comes out
    /// is what a run could have left.
    ///
    /// # Errors
    /// What is wrong.
    pub(crate) fn decode(
        bytes: &[u8],
        experiment: &Experiment,
        span: &Span,
    ) -> Result<Self, &'static str> {
        let (content, rest): (Self, _) =
            postcard::take_from_bytes(bytes).map_err(|_| "its content cannot be decoded")?;
        if !rest.is_empty() {
            return Err("more than its content");
        }
        let cell = &experiment.cells[span.cell];
        content.tally.check(experiment, cell, &span.trials)?;
        match (&content.rows, experiment.file.store == Store::Trials) {
            (None, false) => {}
            (Some(rows), true) if content.rows_fit(rows, experiment, span) => {}
            _ => return Err("rows that are not of its trials"),
        }
        Ok(content)
    }

    fn rows_fit(&self, rows: &[Row], experiment: &Experiment, span: &Span) -> bool {
        let outputs = experiment.output_count();
        let count = outputs as u64;
        let row = |(number, row): (u64, &Row)| {
            row.trial == span.trials.start + number / count && row.output as u64 == number % count
        };
        let counted = |(number, of): (usize, &OutputTally)| {
            outcomes(rows.iter().skip(number).step_by(outputs)) == of.outcomes
        };
        Some(rows.len() as u64) == span.len().checked_mul(count)
            && (0..).zip(rows).all(row)
            && self.tally.outputs.iter().enumerate().all(counted)
    }
}

/// The folder of the block files of one design.
pub struct BlockFolder<'e> {
    path: PathBuf,
    experiment: &'e Experiment,
    fingerprint: u128,
}

impl<'e> BlockFolder<'e> {
    /// The folder `blocks` within `results`, made where needed.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn open(results: &Path, experiment: &'e Experiment) -> Result<Self, BlockError> {
        let path = results.join("blocks");
        fs::create_dir_all(&path).map_err(io_error(&path))?;
        Ok(Self {
            path,
            experiment,
            fingerprint: experiment.fingerprint(),
        })
    }

    /// Writes a block; `keep` tells whether with its rows.
    ///
    /// # Errors
    /// If it cannot be written; nothing is left then.
    pub fn write(&self, block: Block, keep: bool) -> Result<StoredBlock, BlockError> {
        let Block { span, rows, tally } = block;
        let content = Content {
            tally,
            rows: keep.then_some(rows),
        };
        self.write_content(span, &content)
    }

    fn write_content(&self, span: Span, content: &Content) -> Result<StoredBlock, BlockError> {
        let name = format!(
            "c{:05}-{:010}-{:010}.block",
            span.cell, span.trials.start, span.trials.end
        );
        let path = self.path.join(name);
        let mut bytes = Vec::from(MAGIC);
        bytes.extend(FORMAT.to_le_bytes());
        bytes.extend(self.fingerprint.to_le_bytes());
        bytes.extend((span.cell as u32).to_le_bytes());
        bytes.extend(span.trials.start.to_le_bytes());
        bytes.extend(span.trials.end.to_le_bytes());
        let encoded = postcard::to_stdvec(content)
            .map_err(|error| io_error(&path)(io::Error::other(error)))?;
        bytes.extend(encoded);
        bytes.extend(xxh3_128(&bytes).to_le_bytes());
        replace_file(&path, &bytes).map_err(io_error(&path))?;
        Ok(StoredBlock { span, path })
    }

    /// Every block file, each cell's trials ascending and without overlap, and the damaged ones. Temporary files
    /// and files within others' ranges are removed.
    ///
    /// # Errors
    /// If a file is of another design or a newer version, or the folder cannot be read.
    pub fn list(&self) -> Result<(Vec<StoredBlock>, Vec<BlockError>), BlockError> {
        let (mut found, mut damaged) = (Vec::new(), Vec::new());
        for entry in fs::read_dir(&self.path).map_err(io_error(&self.path))? {
            let path = entry.map_err(io_error(&self.path))?.path();
            match path.extension().and_then(|extension| extension.to_str()) {
                Some("tmp") => fs::remove_file(&path).map_err(io_error(&path))?,
                Some("block") => match self.verified(&path) {
                    Ok((span, _)) => found.push(StoredBlock { span, path }),
                    Err(error @ BlockError::Damaged { .. }) => damaged.push(error),
                    Err(error) => return Err(error),
                },
                _ => {}
            }
        }
        found.sort_by_key(|block| {
            let Span { cell, trials } = &block.span;
            (*cell, trials.start, u64::MAX - trials.end)
        });
        let mut kept: Vec<StoredBlock> = Vec::new();
        'next: for block in found {
            let overlaps = |last: &&StoredBlock| {
                let of = &last.span;
                of.cell == block.span.cell && block.span.trials.start < of.trials.end
            };
            while let Some(last) = kept.last().filter(overlaps) {
                // Only what can be decoded takes the place of another file.
                match self.read(last) {
                    Ok(_) => {
                        fs::remove_file(&block.path).map_err(io_error(&block.path))?;
                        continue 'next;
                    }
                    Err(error @ BlockError::Damaged { .. }) => damaged.push(error),
                    Err(error) => return Err(error),
                }
                kept.pop();
            }
            kept.push(block);
        }
        damaged.sort_by_key(ToString::to_string);
        Ok((kept, damaged))
    }

    /// The span and the content's bytes of a whole file of this design.
    fn verified(&self, path: &Path) -> Result<(Span, Vec<u8>), BlockError> {
        self.parsed(path, fs::read(path).map_err(io_error(path))?)
    }

    /// The same of what a file holds.
    pub(crate) fn parsed(
        &self,
        path: &Path,
        mut bytes: Vec<u8>,
    ) -> Result<(Span, Vec<u8>), BlockError> {
        let damaged = |reason| BlockError::Damaged {
            path: path.to_owned(),
            reason,
        };
        if bytes.len() < HEAD + CHECKSUM {
            return Err(damaged("truncated"));
        }
        let checksum = bytes.split_off(bytes.len() - CHECKSUM);
        if xxh3_128(&bytes).to_le_bytes() != *checksum {
            return Err(damaged("the checksum differs"));
        }
        if !bytes.starts_with(MAGIC) {
            return Err(damaged("not a block file"));
        }
        let format = u32::from_le_bytes(field(&bytes, 8));
        if format > FORMAT {
            let path = path.to_owned();
            return Err(BlockError::Newer { path, format });
        }
        if u128::from_le_bytes(field(&bytes, 12)) != self.fingerprint {
            let path = path.to_owned();
            return Err(BlockError::OtherDesign { path });
        }
        let span = Span {
            cell: u32::from_le_bytes(field(&bytes, 28)) as usize,
            trials: u64::from_le_bytes(field(&bytes, 32))..u64::from_le_bytes(field(&bytes, 40)),
        };
        let trials = &span.trials;
        if span.cell >= self.experiment.cells.len() || trials.is_empty() || trials.end > TRIAL_LIMIT
        {
            return Err(damaged("no such cell or no trials"));
        }
        bytes.drain(..HEAD);
        Ok((span, bytes))
    }

    /// Reads a block.
    ///
    /// # Errors
    /// If it cannot be read or is damaged.
    pub fn read(&self, block: &StoredBlock) -> Result<Content, BlockError> {
        let damaged = |reason| BlockError::Damaged {
            path: block.path.clone(),
            reason,
        };
        let (span, bytes) = self.verified(&block.path)?;
        if span != block.span {
            return Err(damaged("replaced since it was found"));
        }
        Content::decode(&bytes, self.experiment, &span).map_err(damaged)
    }

    /// Merges the tallies of some blocks, one in memory at a time.
    ///
    /// # Errors
    /// As for [`Self::read`].
    pub fn tally(&self, blocks: &[StoredBlock]) -> Result<CellTally, BlockError> {
        let mut whole = CellTally::default();
        for block in blocks {
            whole.merge(&self.read(block)?.tally);
        }
        Ok(whole)
    }

    /// Puts one block in the place of blocks without rows that follow each other.
    ///
    /// # Errors
    /// If a file cannot be read, written or removed.
    pub fn consolidate(&self, blocks: &[StoredBlock]) -> Result<StoredBlock, BlockError> {
        let (first, last) = (&blocks[0].span, &blocks[blocks.len() - 1].span);
        let span = Span {
            cell: first.cell,
            trials: first.trials.start..last.trials.end,
        };
        let content = Content {
            tally: self.tally(blocks)?,
            rows: None,
        };
        let whole = self.write_content(span, &content)?;
        for block in blocks {
            fs::remove_file(&block.path).map_err(io_error(&block.path))?;
        }
        Ok(whole)
    }
}

/// What is there already of a study.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Done {
    /// Trials, over all cells.
    pub trials: u64,
    /// Bytes of their blocks.
    pub bytes: u64,
}

/// What the names of the block files in a results folder tell of an experiment: nothing where there are none, or of
/// another design. Nothing is written, and no block is read.
pub fn done(results: &Path, experiment: &Experiment) -> Done {
    let path = results.join("blocks");
    let design = fs::read_to_string(path.join("design.json")).ok();
    let design = design.and_then(|text| serde_json::from_str::<Value>(&text).ok());
    let (Some(true), Ok(entries)) = (
        design.map(|design| design == experiment.stamped_design()),
        fs::read_dir(&path),
    ) else {
        return Done::default();
    };
    let mut spans: Vec<(usize, u64, u64)> = Vec::new();
    let mut done = Done::default();
    for entry in entries.flatten() {
        let name = entry.file_name();
        if let Some(span) = name.to_str().and_then(span_of) {
            spans.push(span);
            done.bytes += entry.metadata().map_or(0, |of| of.len());
        }
    }
    spans.sort_unstable();
    let mut reached = (0, 0);
    for (cell, start, end) in spans {
        if cell != reached.0 {
            reached = (cell, 0);
        }
        done.trials += end.saturating_sub(start.max(reached.1));
        reached.1 = reached.1.max(end);
    }
    done
}

/// The cell, the first trial and the end in the name of a block file.
fn span_of(name: &str) -> Option<(usize, u64, u64)> {
    let mut parts = name.strip_prefix('c')?.strip_suffix(".block")?.split('-');
    let mut next = || parts.next()?.parse::<u64>().ok();
    Some((next()? as usize, next()?, next()?))
}

/// Bytes of the head.
fn field<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut field = [0; N];
    field.copy_from_slice(&bytes[at..at + N]);
    field
}

fn io_error(path: &Path) -> impl Fn(io::Error) -> BlockError + '_ {
    move |source| BlockError::Io {
        path: path.to_owned(),
        source,
    }
}
