//! A folder of results: written whole or not at all.

use super::experiment::design_of;
use serde::Serialize;
use serde_json::{Value, json};
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Why a folder cannot take the results.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The file system.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The error.
        source: io::Error,
    },
    /// The manifest cannot be read.
    #[error("{}: not a manifest of this program ({reason})", .path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// Another run has the folder.
    #[error("{}: another run is writing there", .0.display())]
    Busy(PathBuf),
    /// A newer version's results.
    #[error("{}: written by asobench {version}, which is newer than this one ({})", .path.display(), env!("CARGO_PKG_VERSION"))]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: String,
    },
    /// The folder holds results of unknown design.
    #[error(
        "{}: holds {file} without manifest.json, so nobody knows of which study; remove it or choose another folder",
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
        "{}: holds results of another design (different: {}); choose another folder",
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
    /// Held open for its lock, which ends with the process whatever happens to it.
    _lock: fs::File,
    pending: Vec<String>,
}

/// Stays in the folder: removing it would let a third run in beside a second.
const LOCK: &str = ".lock";
const MANIFEST: &str = "manifest.json";
/// What a manifest tells of: without it (or the design of the blocks) nobody knows whose they are.
const RESULTS: [&str; 3] = ["trials.parquet", "summary.json", "summary.parquet"];
const BLOCKS: &str = "blocks";
const DESIGN: &str = "blocks/design.json";

fn io_error(path: &Path) -> impl Fn(io::Error) -> FolderError + '_ {
    move |source| FolderError::Io {
        path: path.to_owned(),
        source,
    }
}

/// Writes a file under a temporary name beside it (its own with the extension "tmp"), then renames it. Nothing is
/// left where that fails.
pub(crate) fn replace_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = path.with_extension("tmp");
    let written = fs::File::create(&temporary).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)
    });
    if written.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// The manifest of the results in a folder; `None` where there are none, or they were not written to their end.
///
/// # Errors
/// If the manifest cannot be read, or is of a newer version.
pub fn read_manifest(folder: &Path) -> Result<Option<Value>, FolderError> {
    let path = folder.join(MANIFEST);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(io_error(&path)(error)),
    };
    parse_manifest(path, &text).map(Some)
}

/// The manifest that a file holds.
pub(crate) fn parse_manifest(path: PathBuf, text: &str) -> Result<Value, FolderError> {
    let manifest: Result<Value, String> = serde_json::from_str(text).map_err(|e| e.to_string());
    if let Ok(manifest) = &manifest {
        refuse_newer(&path, manifest)?;
    }
    match manifest {
        Ok(manifest) if manifest["experiment"].is_object() => Ok(manifest),
        Ok(_) => Err("no experiment in it".to_owned()),
        Err(reason) => Err(reason),
    }
    .map_err(|reason| FolderError::Manifest { path, reason })
}

/// A result file in a folder, if there is one.
fn result_file(folder: &Path) -> Option<&'static str> {
    RESULTS.into_iter().find(|name| folder.join(name).is_file())
}

/// Refuses what a newer version wrote.
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
    /// Opens a folder, making it where needed, and checks that it can be written to.
    ///
    /// # Errors
    /// If it cannot be made or written to, or another run has it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        fs::create_dir_all(path).map_err(io_error(path))?;
        let lock_path = path.join(LOCK);
        let lock = fs::File::options()
            .create(true)
            .append(true)
            .open(&lock_path);
        let lock = lock.map_err(io_error(&lock_path))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => return Err(FolderError::Busy(path.to_owned())),
            // A file system without locks: two runs at once are then the user's to avoid.
            Err(fs::TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
            Err(fs::TryLockError::Error(error)) => return Err(io_error(&lock_path)(error)),
        }
        let probe = path.join(".writable.tmp");
        fs::write(&probe, b"asobench")
            .and_then(|()| fs::remove_file(&probe))
            .map_err(io_error(path))?;
        Ok(Self {
            path: path.to_owned(),
            _lock: lock,
            pending: Vec::new(),
        })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the folder one of this design, refusing one that holds results or blocks of another. Results without a
    /// manifest are those of a run that was killed while it published them, where the blocks' design is there to tell
    /// of which study; else they are foreign.
    ///
    /// # Errors
    /// [`FolderError::OtherDesign`] with the keys that differ, [`FolderError::Newer`], [`FolderError::Unknown`], and
    /// as for [`read_manifest`].
    pub fn claim_design(&self, design: &Value) -> Result<(), FolderError> {
        let manifest = read_manifest(&self.path)?;
        if let Some(manifest) = &manifest {
            let experiment = design_of(&manifest["experiment"]);
            let stored = json!({ "version": manifest["version"], "experiment": experiment });
            self.compare(&stored, design)?;
        }
        let path = self.path.join(DESIGN);
        let unreadable = |reason: String| FolderError::Manifest {
            path: path.clone(),
            reason,
        };
        match fs::read_to_string(&path) {
            Ok(text) => {
                let stored = serde_json::from_str(&text).map_err(|e| unreadable(e.to_string()))?;
                refuse_newer(&path, &stored)?;
                self.compare(&stored, design)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                if let (None, Some(file)) = (&manifest, result_file(&self.path)) {
                    let path = self.path.clone();
                    return Err(FolderError::Unknown { path, file });
                }
                let folder = self.path.join(BLOCKS);
                fs::create_dir_all(&folder).map_err(io_error(&folder))?;
                replace_file(&path, design.to_string().as_bytes()).map_err(io_error(&path))
            }
            Err(error) => Err(io_error(&path)(error)),
        }
    }

    fn compare(&self, stored: &Value, design: &Value) -> Result<(), FolderError> {
        let mut keys = Vec::new();
        differences("", stored, design, &mut keys);
        if keys.is_empty() {
            return Ok(());
        }
        for key in &mut keys {
            *key = key.trim_start_matches("experiment.").to_owned();
        }
        Err(FolderError::OtherDesign {
            path: self.path.clone(),
            keys,
        })
    }

    /// Forgets what is in a folder: blocks and results, so that results of any design can go there.
    ///
    /// # Errors
    /// If they cannot be removed.
    pub fn clear(path: &Path) -> Result<(), FolderError> {
        for name in [MANIFEST].into_iter().chain(RESULTS) {
            let path = path.join(name);
            if path.is_file() {
                fs::remove_file(&path).map_err(io_error(&path))?;
            }
        }
        Self::remove_blocks(path)
    }

    /// Removes the blocks: what remains are the results. The design stays where nothing else tells of which study
    /// these are.
    ///
    /// # Errors
    /// If they cannot be removed.
    pub fn remove_blocks(path: &Path) -> Result<(), FolderError> {
        let blocks = path.join(BLOCKS);
        if !blocks.exists() {
            return Ok(());
        }
        if result_file(path).is_none() || path.join(MANIFEST).exists() {
            return fs::remove_dir_all(&blocks).map_err(io_error(&blocks));
        }
        for entry in fs::read_dir(&blocks).map_err(io_error(&blocks))? {
            let file = entry.map_err(io_error(&blocks))?.path();
            if file != path.join(DESIGN) {
                fs::remove_file(&file).map_err(io_error(&file))?;
            }
        }
        Ok(())
    }

    /// The temporary path of a file that [`Self::publish`] will rename to `name`.
    pub fn stage(&mut self, name: &str) -> PathBuf {
        if !self.pending.iter().any(|pending| pending == name) {
            self.pending.push(name.to_owned());
        }
        self.temporary(name)
    }

    fn temporary(&self, name: &str) -> PathBuf {
        self.path.join(format!(".{name}.tmp"))
    }

    /// Writes a file under its temporary name.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, name: &str, content: &[u8]) -> Result<(), FolderError> {
        let path = self.stage(name);
        let written = fs::File::create(&path).and_then(|mut file| {
            file.write_all(content)?;
            file.sync_all()
        });
        written.map_err(io_error(&path))
    }

    /// Writes a JSON file under its temporary name.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_json(&mut self, name: &str, value: &impl Serialize) -> Result<(), FolderError> {
        let path = self.stage(name);
        let written = fs::File::create(&path).and_then(|file| {
            let mut writer = BufWriter::new(file);
            serde_json::to_writer(&mut writer, value)?;
            writer.write_all(b"\n")?;
            writer.into_inner()?.sync_all()
        });
        written.map_err(io_error(&path))
    }

    /// Renames every staged file to its name; the manifest last, and an older one removed first, so
    /// that a manifest always tells of the files beside it.
    ///
    /// # Errors
    /// If a file cannot be renamed.
    pub fn publish(&mut self) -> Result<(), FolderError> {
        let manifest = self.path.join(MANIFEST);
        match fs::remove_file(&manifest) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(io_error(&manifest)(error));
            }
            _ => {}
        }
        self.pending.sort_by_key(|name| name != MANIFEST);
        // From the end, so that what was not renamed is still pending and removed when this is dropped.
        while let Some(name) = self.pending.last() {
            let path = self.path.join(name);
            fs::rename(self.temporary(name), &path).map_err(io_error(&path))?;
            self.pending.pop();
        }
        Ok(())
    }
}

impl Drop for ResultsFolder {
    /// Removes what was staged and not published.
    fn drop(&mut self) {
        for name in &self.pending {
            // A file that was never made cannot be removed; nothing else can be done here.
            let _ = fs::remove_file(self.temporary(name));
        }
    }
}

/// Whether a version is above this program's.
fn is_newer(version: &str) -> bool {
    let numbers = |version: &str| -> Vec<u64> {
        version
            .split('.')
            .map(|part| part.parse().unwrap_or(0))
            .collect()
    };
    numbers(version) > numbers(env!("CARGO_PKG_VERSION"))
}

/// Collects the paths of values that differ.
fn differences(path: &str, left: &Value, right: &Value, keys: &mut Vec<String>) {
    match (left, right) {
        (Value::Object(left), Value::Object(right)) => {
            let all: std::collections::BTreeSet<&String> =
                left.keys().chain(right.keys()).collect();
            for key in all {
                let dot = if path.is_empty() { "" } else { "." };
                let null = &Value::Null;
                let (left, right) = (
                    left.get(key).unwrap_or(null),
                    right.get(key).unwrap_or(null),
                );
                differences(&format!("{path}{dot}{key}"), left, right, keys);
            }
        }
        _ if left != right => keys.push(path.to_owned()),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_appear_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new");
        let mut results = ResultsFolder::open(&path).unwrap();
        results.write("a.txt", b"a").unwrap();
        drop(results);
        assert_eq!(fs::read_dir(&path).unwrap().count(), 1, "only the lock");

        let mut results = ResultsFolder::open(&path).unwrap();
        results
            .write(
                "manifest.json",
                br#"{"experiment": {"seed": 1, "x": {"y": 2}}}"#,
            )
            .unwrap();
        results.write("a.txt", b"a").unwrap();
        results.publish().unwrap();
        let mut names: Vec<_> = fs::read_dir(&path)
            .unwrap()
            .map(|f| f.unwrap().file_name())
            .collect();
        names.sort();
        assert_eq!(names, [".lock", "a.txt", "manifest.json"]);
        drop(results);

        let results = ResultsFolder::open(&path).unwrap();
        assert!(matches!(
            ResultsFolder::open(&path),
            Err(FolderError::Busy(_))
        ));
        let design = |seed: u64, y: u64| {
            let experiment = json!({"seed": seed, "x": {"y": y}});
            json!({"version": null, "experiment": experiment})
        };
        results.claim_design(&design(1, 2)).unwrap();
        let error = results.claim_design(&design(2, 3)).unwrap_err().to_string();
        assert!(error.contains("(different: seed, x.y)"), "{error}");
        fs::remove_file(path.join(MANIFEST)).unwrap();
        let error = results.claim_design(&design(1, 3)).unwrap_err().to_string();
        assert!(error.contains("(different: x.y)"), "by the blocks: {error}");
        fs::write(path.join(DESIGN), r#"{"version": "99.0.0"}"#).unwrap();
        fs::write(path.join("summary.json"), b"{}").unwrap();
        let error = results.claim_design(&design(1, 2)).unwrap_err().to_string();
        assert!(error.contains("99.0.0, which is newer"), "{error}");
    }

    #[test]
    fn results_without_a_manifest_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let results = ResultsFolder::open(folder.path()).unwrap();
        for name in RESULTS {
            fs::write(folder.path().join(name), b"").unwrap();
            let error = results.claim_design(&json!({})).unwrap_err().to_string();
            assert!(error.contains(&format!("holds {name} without")), "{error}");
            fs::remove_file(folder.path().join(name)).unwrap();
        }
        results.claim_design(&json!({})).unwrap();
    }

    /// The design stays with results that have no manifest, and goes with any others.
    #[test]
    fn removing_blocks_leaves_no_results_unknown() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let results = ResultsFolder::open(path).unwrap();
        results.claim_design(&json!({})).unwrap();
        fs::write(path.join("blocks/x.block"), b"").unwrap();
        fs::write(path.join("summary.json"), b"").unwrap();
        ResultsFolder::remove_blocks(path).unwrap();
        assert!(path.join(DESIGN).exists() && !path.join("blocks/x.block").exists());
        results.claim_design(&json!({})).unwrap();
        ResultsFolder::clear(path).unwrap();
        assert!(!path.join(BLOCKS).exists() && !path.join("summary.json").exists());
        ResultsFolder::remove_blocks(path).unwrap();
    }
}
