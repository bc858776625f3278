//! Block files: what one worker computed, whole or not at all, with the design's fingerprint and a checksum.
//!
//! ```text
//! "asobench" | format u32 | fingerprint u128 | cell u32 | first trial u64 | end u64 | content (postcard) | checksum u128
//! ```
//!
//! All little-endian; the checksum is XXH3 of everything before it. A block file may be any range of trials: ranges
//! that lie within others are ignored, gaps are computed.

use super::experiment::Experiment;
use super::file::Store;
use super::folder::{BLOCKS, is_block_name};
use super::row::Row;
use super::runner::{Block, Span};
use super::tally::CellTally;
use crate::files::{self, Kind, PathError};
use serde::{Deserialize, Serialize};
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
    /// A file or folder.
    #[error(transparent)]
    File(#[from] PathError),
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
    /// Whether it is of these trials of an experiment.
    fn fits(&self, experiment: &Experiment, span: &Span) -> bool {
        let outputs = experiment.outputs().len() as u64;
        let row = |(number, row): (u64, &Row)| {
            row.trial == span.trials.start + number / outputs
                && row.output as u64 == number % outputs
        };
        let rows_fit = |rows: &Vec<Row>| {
            Some(rows.len() as u64) == span.len().checked_mul(outputs) && (0..).zip(rows).all(row)
        };
        let keep = experiment.file.store == Store::Trials;
        self.tally.trials == span.len()
            && self.tally.fits(experiment, &experiment.cells[span.cell])
            && self
                .rows
                .as_ref()
                .map_or(!keep, |rows| keep && rows_fit(rows))
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
        Ok(Self {
            path: files::make_subfolder(results, BLOCKS)?,
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
            .map_err(|error| PathError::io(&path)(io::Error::other(error)))?;
        bytes.extend(encoded);
        bytes.extend(xxh3_128(&bytes).to_le_bytes());
        files::replace(&path, Kind::Block, &bytes)?;
        Ok(StoredBlock { span, path })
    }

    /// Every block file, each cell's trials ascending and without overlap, and the damaged ones. Files within
    /// others' ranges are removed; what has no block's name is left alone.
    ///
    /// # Errors
    /// If a file is of another design or a newer version, or the folder cannot be read.
    pub fn list(&self) -> Result<(Vec<StoredBlock>, Vec<BlockError>), BlockError> {
        let (mut found, mut damaged) = (Vec::new(), Vec::new());
        for path in files::list(&self.path)? {
            if !is_block_name(&path) {
                continue;
            }
            match self.verified(&path) {
                Ok((span, _)) => found.push(StoredBlock { span, path }),
                Err(error @ BlockError::Damaged { .. }) => damaged.push(error),
                Err(error) => return Err(error),
            }
        }
        found.sort_by_key(|block| {
            let Span { cell, trials } = &block.span;
            (*cell, trials.start, u64::MAX - trials.end)
        });
        damaged.sort_by_key(ToString::to_string);
        let mut kept: Vec<StoredBlock> = Vec::new();
        for block in found {
            let reached = kept.last().filter(|last| last.span.cell == block.span.cell);
            if reached.is_some_and(|last| block.span.trials.start < last.span.trials.end) {
                files::remove(&block.path, Kind::Block)?;
            } else {
                kept.push(block);
            }
        }
        Ok((kept, damaged))
    }

    /// The span and the content's bytes of a whole file of this design.
    fn verified(&self, path: &Path) -> Result<(Span, Vec<u8>), BlockError> {
        let damaged = |reason| BlockError::Damaged {
            path: path.to_owned(),
            reason,
        };
        let bytes = files::read_own(path, Kind::Block)?;
        let mut bytes = bytes.ok_or_else(|| PathError::io(path)(io::ErrorKind::NotFound.into()))?;
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
        if span.cell >= self.experiment.cells.len() || span.trials.is_empty() {
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
        let content: Content =
            postcard::from_bytes(&bytes).map_err(|_| damaged("its content cannot be decoded"))?;
        if span != block.span || !content.fits(self.experiment, &span) {
            return Err(damaged("its content is not of its cell and trials"));
        }
        Ok(content)
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
            files::remove(&block.path, Kind::Block)?;
        }
        Ok(whole)
    }
}

/// Takes a damaged file out of the way: removes it, or gives it another name where it does not begin as blocks do.
///
/// # Errors
/// If it is no regular file, or cannot be removed.
pub fn discard(path: &Path) -> Result<(), BlockError> {
    if files::is_own(path, Kind::Block)? {
        files::remove(path, Kind::Block)?;
    } else {
        files::set_aside(path)?;
    }
    Ok(())
}

/// Bytes of the head.
fn field<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut field = [0; N];
    field.copy_from_slice(&bytes[at..at + N]);
    field
}
