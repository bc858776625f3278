//! Block files: what one worker computed, complete or absent, with the design's fingerprint and a checksum.
//!
//! ```text
//! "asobench" | format u32 | fingerprint u128 | cell u32 | first trial u64 | end u64 |
//! content | checksum u128
//! content: length of the tally u64 | tally (postcard) | rows by columns, if they are kept
//! ```
//!
//! All numbers are little-endian. The checksum is XXH3 of everything before it. A block file may hold any range of
//! trials: ranges within others are ignored, gaps are computed.

use crate::design::Experiment;
use crate::design::file::{Store, TRIAL_LIMIT};
use crate::files;
use crate::files::Kind;
use crate::files::PathError;
use crate::outcome::folder_layout::{BLOCKS, span_of};
use crate::outcome::rows;
use crate::outcome::rows::Rows;
use crate::outcome::spent::Spent;
use crate::outcome::tally::{CellTally, outcomes};
use crate::run::runner::{Block, Span};
use std::io;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_128;

const MAGIC: &[u8; 8] = b"asobench";
/// The format of block files.
const FORMAT: u32 = 6;
const HEAD: usize = 8 + 4 + 16 + 4 + 8 + 8;
pub(crate) const LENGTH: usize = 8;
const CHECKSUM: usize = 16;

/// Why a block file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BlockError {
    /// A file or folder failed.
    #[error(transparent)]
    File(#[from] PathError),
    /// The content is damaged.
    #[error("{}: damaged ({reason})", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: &'static str,
    },
    /// A newer version wrote the file.
    #[error(
        "{}: written by a newer version of asobench (format {format}; this one knows {FORMAT})",
        .path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: u32,
    },
    /// An older build wrote the file.
    #[error(
        "{}: written by an older build of asobench (block format {format}; this one writes {FORMAT}); its results can \
        be reported, but not extended; --overwrite computes all trials again",
        .path.display()
    )]
    Older {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: u32,
    },
    /// The file belongs to another design.
    #[error(
        "{}: a block of another experiment; remove this file, then its trials are computed",
        .path.display()
    )]
    OtherDesign {
        /// The file.
        path: PathBuf,
    },
}

/// A block file that was found intact.
#[derive(Clone, Debug)]
pub struct StoredBlock {
    /// The cell and the trials.
    pub span: Span,
    /// The file.
    pub path: PathBuf,
}

/// A block file that is to be written.
pub struct EncodedBlock {
    stored: StoredBlock,
    bytes: Vec<u8>,
}

impl EncodedBlock {
    /// Writes the file.
    ///
    /// # Errors
    /// If it cannot be written; no file is left then.
    pub fn write(self) -> Result<StoredBlock, BlockError> {
        files::replace(&self.stored.path, Kind::Block, &self.bytes)?;
        Ok(self.stored)
    }
}

impl Block {
    /// Returns a block of trials that are not kept themselves.
    pub(crate) fn of_tally(span: Span, tally: CellTally) -> Self {
        Self {
            span,
            rows: Rows::default(),
            tally,
            spent: Spent::default(),
        }
    }

    /// Appends the content to a block file; the rows if the study keeps them.
    pub(crate) fn encode(&self, experiment: &Experiment, to: &mut Vec<u8>) -> postcard::Result<()> {
        let start = to.len() + LENGTH;
        to.extend([0; LENGTH]);
        *to = postcard::to_extend(&self.tally, std::mem::take(to))?;
        let length = (to.len() - start) as u64;
        to[start - LENGTH..start].copy_from_slice(&length.to_le_bytes());
        match experiment.file.store {
            Store::Trials => rows::stored::encode(&self.rows, experiment, &experiment.cells[self.span.cell], to),
            Store::Summaries => Ok(()),
        }
    }

    /// Decodes the content of a block of these trials of an experiment. Checks that a run could have written it.
    ///
    /// # Errors
    /// The fault in the content.
    pub fn decode(bytes: &[u8], experiment: &Experiment, span: Span) -> Result<Self, &'static str> {
        const UNKNOWN: &str = "its content cannot be decoded";
        let (length, bytes) = bytes.split_first_chunk().ok_or(UNKNOWN)?;
        let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| UNKNOWN)?;
        let (tally, bytes) = bytes.split_at_checked(length).ok_or(UNKNOWN)?;
        let (tally, rest): (CellTally, _) = postcard::take_from_bytes(tally).map_err(|_| UNKNOWN)?;
        if !rest.is_empty() {
            return Err("data after its tally");
        }
        let cell = &experiment.cells[span.cell];
        tally.check(experiment, cell, &span.trials)?;
        if experiment.file.store != Store::Trials {
            return if bytes.is_empty() {
                Ok(Self::of_tally(span, tally))
            } else {
                Err("rows, although the study stores none")
            };
        }
        let rows = rows::stored::decode(bytes, experiment, cell, &span.trials)?;
        let mut outputs = rows.outputs().iter().zip(&tally.outputs);
        if outputs.all(|(rows, tally)| outcomes(rows, span.trials.start) == tally.outcomes) {
            Ok(Self {
                rows,
                ..Self::of_tally(span, tally)
            })
        } else {
            Err("rows of other trials")
        }
    }
}

/// The folder of the block files of one design.
pub struct BlockFolder<'e> {
    path: PathBuf,
    experiment: &'e Experiment,
    fingerprint: u128,
}

impl<'e> BlockFolder<'e> {
    /// Opens the folder `blocks` within `results`. Makes it if needed.
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

    /// Takes an existing folder, to which blocks are written unchanged.
    pub(crate) fn at(path: PathBuf, experiment: &'e Experiment) -> Self {
        Self {
            path,
            experiment,
            fingerprint: experiment.fingerprint(),
        }
    }

    /// Encodes a block as a file; may run on any thread.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn encode(&self, block: &Block) -> Result<EncodedBlock, BlockError> {
        let span = block.span.clone();
        let path = self.path.join(name_of(&span));
        let mut bytes = Vec::from(MAGIC);
        bytes.extend(FORMAT.to_le_bytes());
        bytes.extend(self.fingerprint.to_le_bytes());
        bytes.extend((span.cell as u32).to_le_bytes());
        bytes.extend(span.trials.start.to_le_bytes());
        bytes.extend(span.trials.end.to_le_bytes());
        let encoded = block.encode(self.experiment, &mut bytes);
        encoded.map_err(|error| PathError::io(&path)(io::Error::other(error)))?;
        bytes.extend(xxh3_128(&bytes).to_le_bytes());
        let stored = StoredBlock { span, path };
        Ok(EncodedBlock { stored, bytes })
    }

    /// Returns every intact block file, each cell's trials ascending and without overlap, and the damaged ones. Removes
    /// files whose trials overlap with those of an earlier one. Ignores files whose name is not a block's.
    ///
    /// # Errors
    /// If a file is of another design, a newer version or an older build, or the folder cannot be read.
    pub fn list(&self) -> Result<(Vec<StoredBlock>, Vec<BlockError>), BlockError> {
        let (mut found, mut damaged) = (Vec::new(), Vec::new());
        for path in files::list(&self.path)? {
            if span_of(&path).is_none() {
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
        let mut kept: Vec<StoredBlock> = Vec::new();
        'next: for block in found {
            let overlaps = |last: &&StoredBlock| {
                let span = &last.span;
                span.cell == block.span.cell && block.span.trials.start < span.trials.end
            };
            while let Some(last) = kept.last().filter(overlaps) {
                // Only a file that can be decoded replaces another.
                match self.read(last) {
                    Ok(_) => {
                        files::remove(&block.path, Kind::Block)?;
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

    /// Returns the span and the content of an intact file of this design.
    pub(crate) fn verified(&self, path: &Path) -> Result<(Span, Vec<u8>), BlockError> {
        let bytes = files::read_own(path, Kind::Block)?;
        let bytes = bytes.ok_or_else(|| PathError::io(path)(io::ErrorKind::NotFound.into()))?;
        self.parsed(path, bytes)
    }

    /// Returns the same, from the bytes of a file.
    ///
    /// # Errors
    /// The fault in the content.
    pub fn parsed(&self, path: &Path, mut bytes: Vec<u8>) -> Result<(Span, Vec<u8>), BlockError> {
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
        if format < FORMAT {
            let path = path.to_owned();
            return Err(BlockError::Older { path, format });
        }
        let span = Span {
            cell: u32::from_le_bytes(field(&bytes, 28)) as usize,
            trials: u64::from_le_bytes(field(&bytes, 32))..u64::from_le_bytes(field(&bytes, 40)),
        };
        let trials = &span.trials;
        if span.cell >= self.experiment.cells.len() || trials.is_empty() || trials.end > TRIAL_LIMIT {
            return Err(damaged("no such cell or no trials in its head"));
        }
        bytes.drain(..HEAD);
        Ok((span, bytes))
    }

    /// Reads a block.
    ///
    /// # Errors
    /// If it cannot be read or is damaged.
    pub fn read(&self, block: &StoredBlock) -> Result<Block, BlockError> {
        let damaged = |reason| BlockError::Damaged {
            path: block.path.clone(),
            reason,
        };
        let (span, bytes) = self.verified(&block.path)?;
        if span != block.span {
            return Err(damaged("replaced since it was found"));
        }
        Block::decode(&bytes, self.experiment, span).map_err(damaged)
    }

    /// Merges the tallies of some blocks, holding one at a time in memory.
    ///
    /// # Errors
    /// As for [`Self::read`].
    pub fn tally(&self, blocks: &[StoredBlock]) -> Result<CellTally, BlockError> {
        let mut whole = CellTally::default();
        for block in blocks {
            whole.merge(self.read(block)?.tally);
        }
        Ok(whole)
    }

    /// Replaces consecutive blocks without rows by one block.
    ///
    /// # Errors
    /// If a file cannot be read, written or removed.
    pub fn consolidate(&self, blocks: &[StoredBlock]) -> Result<StoredBlock, BlockError> {
        let whole = self.join(blocks)?;
        for block in blocks {
            files::remove(&block.path, Kind::Block)?;
        }
        Ok(whole)
    }

    /// Writes one block with the content of consecutive blocks without rows.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub(crate) fn join(&self, blocks: &[StoredBlock]) -> Result<StoredBlock, BlockError> {
        let (first, last) = (&blocks[0].span, &blocks[blocks.len() - 1].span);
        let span = Span {
            cell: first.cell,
            trials: first.trials.start..last.trials.end,
        };
        self.encode(&Block::of_tally(span, self.tally(blocks)?))?.write()
    }
}

/// Returns the file name of a block.
pub(crate) fn name_of(span: &Span) -> String {
    let Span { cell, trials } = span;
    format!("c{cell:05}-{:010}-{:010}.block", trials.start, trials.end)
}

/// Returns a field of the head: N bytes from `at` on.
fn field<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut field = [0; N];
    field.copy_from_slice(&bytes[at..at + N]);
    field
}
