//! A folder of results, which are written completely or not at all.

use crate::design::experiment::design_of;
use crate::files;
use crate::files::Kind;
use crate::files::PathError;
use crate::files::Staged;
use crate::outcome::design_difference::{different, same_but_for_methods};
use serde::Serialize;
use serde_json::{Value, json};
use std::fs::{File, TryLockError};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Why a folder cannot take the results.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file or folder failed.
    #[error(transparent)]
    File(#[from] PathError),
    /// The manifest cannot be read.
    #[error("{}: not a manifest of this program ({reason})", .path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The list of looks cannot be read.
    #[error("{}: not a list of looks of this program ({reason})", .path.display())]
    Looks {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// A result is not what was written.
    #[error("{}: damaged: the checksum in manifest.json differs", .0.display())]
    Damaged(PathBuf),
    /// Another run has the folder.
    #[error("{}: another run is writing there", .0.display())]
    Busy(PathBuf),
    /// A newer version wrote the results.
    #[error(
        "{}: written by asobench {version}, which is newer than this one ({})",
        .path.display(),
        env!("CARGO_PKG_VERSION")
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: String,
    },
    /// The folder holds results of unknown design.
    #[error(
        "{}: holds {file} without manifest.json, so its study is unknown; remove it or \
        choose another folder",
        .path.display()
    )]
    Unknown {
        /// The folder.
        path: PathBuf,
        /// The file.
        file: &'static str,
    },
    /// The folder holds results of another design.
    #[error(
        "{}: holds results of another design (different: {}); choose another folder (--out DIR)",
        .path.display(), .keys.join(", ")
    )]
    OtherDesign {
        /// The folder.
        path: PathBuf,
        /// The keys that differ.
        keys: Vec<String>,
    },
}

/// A folder whose files are written under temporary names and renamed together.
#[derive(Debug)]
pub struct ResultsFolder {
    path: PathBuf,
    _lock: Lock,
    staged: Staged,
}

/// A locked file. The system releases the lock when the process ends.
#[derive(Debug)]
struct Lock(File);

impl Drop for Lock {
    /// Closing the file would not do: a process that another thread starts just then has it open too for a moment.
    fn drop(&mut self) {
        // A failure here cannot be handled; where there are no locks, none was taken.
        let _ = self.0.unlock();
    }
}

/// The lock file. It stays in the folder: if it were removed, a third run could enter beside a second.
const LOCK: &str = ".lock";
/// The file with the looks at a study.
pub(crate) const LOOKS: &str = "looks.json";

/// The file of a results folder that says what was run.
pub const MANIFEST: &str = "manifest.json";
/// The results that a manifest describes. Without the manifest or the design of the blocks, their study is unknown.
const RESULTS: [(&str, Kind); 3] = [
    ("trials.parquet", Kind::Parquet),
    ("summary.json", Kind::Summary),
    ("summary.parquet", Kind::Parquet),
];
pub(crate) const BLOCKS: &str = "blocks";
pub(crate) const DESIGN: &str = "design.json";

/// Reads the manifest of the results in a folder. Returns `None` if there are no results, or they were not completely
/// written.
///
/// # Errors
/// If the manifest cannot be read, or is of a newer version.
pub fn read_manifest(folder: &Path) -> Result<Option<Value>, FolderError> {
    let path = folder.join(MANIFEST);
    let Some(text) = files::read_own(&path, Kind::Manifest)? else {
        return Ok(None);
    };
    parse_manifest(&path, &text).map(Some)
}

/// Parses the text of a manifest.
///
/// # Errors
/// What is wrong with the content.
pub fn parse_manifest(path: &Path, text: &[u8]) -> Result<Value, FolderError> {
    let wrong = |reason: String| FolderError::Manifest {
        path: path.to_owned(),
        reason,
    };
    let mut manifest: Value = serde_json::from_slice(text).map_err(|e| wrong(e.to_string()))?;
    refuse_newer(path, &manifest)?;
    files::unseal(&mut manifest, text).map_err(|reason| wrong(reason.to_owned()))?;
    if manifest["experiment"].is_object() {
        Ok(manifest)
    } else {
        Err(wrong("no experiment in it".to_owned()))
    }
}

/// Checks a result against its checksum in the manifest: its content, or its file if that was not read. Results of
/// version
/// 0.2.0 have no checksum.
///
/// # Errors
/// If the checksum differs, or the file cannot be read.
pub fn check_result(
    folder: &Path,
    manifest: &Value,
    name: &str,
    content: Option<&[u8]>,
) -> Result<(), FolderError> {
    let (path, stored) = (folder.join(name), manifest["checksums"][name].as_str());
    let found = match (stored, content) {
        (None, _) => return Ok(()),
        (_, Some(content)) => files::checksum(content),
        (_, None) => files::checksum_of(&path)?,
    };
    if stored == Some(&found) {
        Ok(())
    } else {
        Err(FolderError::Damaged(path))
    }
}

/// Returns the design of the results or blocks in a folder, if it can be read.
pub fn stored_design(folder: &Path) -> Option<Value> {
    let manifest = read_manifest(folder).ok().flatten();
    let stored = manifest.or_else(|| {
        let path = files::subfolder(folder, BLOCKS).ok()??.join(DESIGN);
        let text = files::read_own(&path, Kind::Design).ok()??;
        files::parsed(&text).ok()
    });
    Some(design_of(&stored?["experiment"]))
}

/// Returns the name of a result file in a folder, if there is one.
fn result_file(folder: &Path) -> Option<&'static str> {
    let mut names = RESULTS.into_iter().map(|(name, _)| name);
    names.find(|name| files::is_there(&folder.join(name)))
}

/// Parses the name of a block file, `c00000-0000000000-0000000100.block`: the cell, the first trial and the end.
pub(crate) fn span_of(path: &Path) -> Option<(usize, u64, u64)> {
    let name = path.file_name()?.to_str()?;
    let mut parts = name.strip_prefix('c')?.strip_suffix(".block")?.split('-');
    let mut number = |digits: usize| {
        let part = parts.next()?;
        let fits = part.len() >= digits && part.bytes().all(|b| b.is_ascii_digit());
        part.parse::<u64>().ok().filter(|_| fits)
    };
    let span = (number(5)? as usize, number(10)?, number(10)?);
    parts.next().is_none().then_some(span)
}

/// Returns the files of a folder of blocks with their kinds.
///
/// # Errors
/// If the folder contains anything else.
fn own_blocks(blocks: &Path) -> Result<Vec<(PathBuf, Kind)>, PathError> {
    let mut own = Vec::new();
    for path in files::list(blocks)? {
        let kind = if span_of(&path).is_some() {
            Kind::Block
        } else if path.ends_with(DESIGN) {
            Kind::Design
        } else {
            return Err(PathError::foreign(&path, files::NOT_OWN));
        };
        files::replaceable(&path, kind)?;
        own.push((path, kind));
    }
    Ok(own)
}

/// Removes the blocks in a folder, and the folder.
///
/// # Errors
/// If the folder contains anything else (nothing is removed then), or a file cannot be removed.
pub(crate) fn remove_own(blocks: &Path) -> Result<(), PathError> {
    for (path, kind) in own_blocks(blocks)? {
        files::remove(&path, kind)?;
    }
    files::remove_empty(blocks)
}

/// Refuses a file that a newer version wrote.
fn refuse_newer(path: &Path, stored: &Value) -> Result<(), FolderError> {
    match stored["version"].as_str() {
        Some(version) if is_newer(version) => Err(FolderError::Newer {
            path: path.to_owned(),
            version: version.to_owned(),
        }),
        _ => Ok(()),
    }
}

impl ResultsFolder {
    /// Opens a folder and checks that it can be written to. Makes it if needed.
    ///
    /// # Errors
    /// If the folder cannot be made or written to, or another run uses it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        /// The kinds of files that a run writes at the top of the folder.
        const OWN: [Kind; 5] = [
            Kind::Manifest,
            Kind::Looks,
            Kind::Summary,
            Kind::Parquet,
            Kind::Figure,
        ];
        files::make_folder(path)?;
        let lock_path = path.join(LOCK);
        let lock = files::open_lock(&lock_path)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(FolderError::Busy(path.to_owned())),
            // A file system without locks: the user must then avoid two runs at once.
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) => return Err(PathError::io(&lock_path)(error).into()),
        }
        files::remove_temporary(path, &OWN)?;
        if let Some(blocks) = files::subfolder(path, BLOCKS)? {
            files::remove_temporary(&blocks, &[Kind::Block, Kind::Design])?;
        }
        files::probe(path)?;
        Ok(Self {
            path: path.to_owned(),
            _lock: Lock(lock),
            staged: Staged::default(),
        })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the folder one of this design. Refuses a folder with results or blocks of another design, and one in which
    /// a foreign file has the name of a result or of one of `figures`. Results without a manifest are accepted if the
    /// blocks' design is there: a run was killed while it published them. Otherwise they are foreign.
    ///
    /// # Errors
    /// [`FolderError::OtherDesign`] with the keys that differ, [`FolderError::Newer`],
    /// [`FolderError::Unknown`], [`FolderError::File`], and as for [`read_manifest`].
    pub fn claim_design(&self, design: &Value, figures: &[&str]) -> Result<(), FolderError> {
        let manifest = read_manifest(&self.path)?;
        let blocks = files::subfolder(&self.path, BLOCKS)?;
        let path = self.path.join(BLOCKS).join(DESIGN);
        let stored = match blocks {
            Some(_) => files::read_own(&path, Kind::Design)?,
            None => None,
        };
        if let Some(manifest) = &manifest {
            let experiment = design_of(&manifest["experiment"]);
            let of_results = json!({ "version": manifest["version"], "experiment": experiment });
            // Where methods changed, the results before stay until the new ones are there.
            let taken_over = || {
                let blocks = files::parsed(stored.as_deref()?).ok()?;
                (blocks == *design && same_but_for_methods(&of_results, design)).then_some(())
            };
            if taken_over().is_none() {
                self.compare(&of_results, design)?;
            }
        }
        let Some(text) = stored else {
            if let (None, Some(file)) = (&manifest, result_file(&self.path)) {
                let path = self.path.clone();
                return Err(FolderError::Unknown { path, file });
            }
            self.check_targets(figures)?;
            files::make_subfolder(&self.path, BLOCKS)?;
            return Ok(files::replace(
                &path,
                Kind::Design,
                files::sealed(design).as_bytes(),
            )?);
        };
        let wrong = |reason: String| FolderError::Manifest {
            path: path.clone(),
            reason,
        };
        let mut stored = serde_json::from_slice(&text).map_err(|error| wrong(error.to_string()))?;
        refuse_newer(&path, &stored)?;
        files::unseal(&mut stored, &text).map_err(|reason| wrong(reason.to_owned()))?;
        self.compare(&stored, design)?;
        self.check_targets(figures)
    }

    fn compare(&self, stored: &Value, design: &Value) -> Result<(), FolderError> {
        let keys = different(stored, design);
        if keys.is_empty() {
            return Ok(());
        }
        Err(FolderError::OtherDesign {
            path: self.path.clone(),
            keys,
        })
    }

    /// Checks that results can be written: every existing file with the name of a result, or of one of `figures`, was
    /// written by this program.
    fn check_targets(&self, figures: &[&str]) -> Result<(), FolderError> {
        let others = [(MANIFEST, Kind::Manifest), (LOOKS, Kind::Looks)];
        for (name, kind) in others.into_iter().chain(RESULTS) {
            files::replaceable(&self.path.join(name), kind)?;
        }
        for name in figures {
            files::replaceable(&self.path.join(name), Kind::Figure)?;
        }
        Ok(())
    }

    /// Removes the blocks and results in the folder, so that results of any design, with `figures`, can be written
    /// there. The list of looks stays if `keep_looks`.
    ///
    /// # Errors
    /// If a foreign file is in the way (nothing is removed then), or a file cannot be removed.
    pub fn clear(&self, figures: &[&str], keep_looks: bool) -> Result<(), FolderError> {
        self.check_targets(figures)?;
        self.check_blocks()?;
        if !keep_looks {
            files::remove(&self.path.join(LOOKS), Kind::Looks)?;
        }
        for (name, kind) in [(MANIFEST, Kind::Manifest)].into_iter().chain(RESULTS) {
            files::remove(&self.path.join(name), kind)?;
        }
        self.remove_blocks()
    }

    /// Checks that all blocks may be removed.
    ///
    /// # Errors
    /// If there are other files among them.
    pub fn check_blocks(&self) -> Result<(), FolderError> {
        if let Some(blocks) = files::subfolder(&self.path, BLOCKS)? {
            own_blocks(&blocks)?;
        }
        Ok(())
    }

    /// Removes the blocks and leaves the results. The design stays if nothing else identifies the study of the results.
    ///
    /// # Errors
    /// If there are other files among the blocks (nothing is removed then), or a block cannot be removed.
    pub fn remove_blocks(&self) -> Result<(), FolderError> {
        let Some(blocks) = files::subfolder(&self.path, BLOCKS)? else {
            return Ok(());
        };
        let keep_design =
            result_file(&self.path).is_some() && !files::is_there(&self.path.join(MANIFEST));
        for (path, kind) in own_blocks(&blocks)? {
            if kind == Kind::Block || !keep_design {
                files::remove(&path, kind)?;
            }
        }
        if !keep_design {
            files::remove_empty(&blocks)?;
        }
        Ok(())
    }

    /// Creates a file that [`Self::publish`] will rename to `name`. Returns it with its temporary path.
    ///
    /// # Errors
    /// If it cannot be created, or a foreign file has that name.
    pub fn stage(&mut self, name: &str, kind: Kind) -> Result<(File, PathBuf), FolderError> {
        Ok(self.staged.create(&self.path.join(name), kind)?)
    }

    /// Writes a file that [`Self::publish`] will rename to `name`.
    ///
    /// # Errors
    /// As for [`Self::stage`], and if it cannot be written.
    pub fn write(&mut self, name: &str, kind: Kind, content: &[u8]) -> Result<(), FolderError> {
        Ok(self.staged.write(&self.path.join(name), kind, content)?)
    }

    /// Writes a JSON file like [`Self::write`], but piece by piece.
    ///
    /// # Errors
    /// As for [`Self::write`].
    pub fn write_json(
        &mut self,
        name: &str,
        kind: Kind,
        value: &impl Serialize,
    ) -> Result<(), FolderError> {
        let (file, path) = self.stage(name, kind)?;
        let mut writer = BufWriter::new(file);
        let written = serde_json::to_writer(&mut writer, value).map_err(Into::into);
        let written = written
            .and_then(|()| writer.write_all(b"\n"))
            .and_then(|()| writer.into_inner()?.sync_all());
        Ok(written.map_err(PathError::io(&path))?)
    }

    /// Writes the manifest, which is published last, with the checksums of the results that were written before.
    ///
    /// # Errors
    /// As for [`Self::write`].
    pub fn write_manifest(&mut self, mut manifest: Value) -> Result<(), FolderError> {
        for (name, path) in self.staged.files() {
            if RESULTS.iter().any(|(result, _)| *result == name) {
                manifest["checksums"][name] = files::checksum_of(path)?.into();
            }
        }
        self.write(
            MANIFEST,
            Kind::Manifest,
            files::sealed(&manifest).as_bytes(),
        )
    }

    /// Renames every staged file to its final name, the manifest last. An older manifest is removed first, so that a
    /// manifest always describes the files beside it.
    ///
    /// # Errors
    /// If a file cannot be renamed, or a foreign file has its name.
    pub fn publish(&mut self) -> Result<(), FolderError> {
        self.staged.check()?;
        files::remove(&self.path.join(MANIFEST), Kind::Manifest)?;
        Ok(self.staged.publish()?)
    }
}

/// Whether a version is newer than this program's.
fn is_newer(version: &str) -> bool {
    let numbers = |version: &str| -> Vec<u64> {
        version
            .split('.')
            .map(|part| part.parse().unwrap_or(0))
            .collect()
    };
    numbers(version) > numbers(env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests;
