//! A folder of results, which are written completely or not at all.

use super::folder_error::FolderError;
use super::stored_results::{check_result, lists, read_announced, read_manifest, refuse_newer};
use crate::design::design_of;
use crate::files;
use crate::files::Kind;
use crate::files::PathError;
use crate::files::Staged;
use crate::outcome::design_difference::{different, same_but_for_methods};
use crate::outcome::folder_layout::{BLOCKS, DESIGN, LOCK, LOOKS, MANIFEST, RESULTS, TIMING, own_blocks, result_file};
use crate::outcome::publication::{self, NEW, PUBLISHED, REPLACING};
use serde::Serialize;
use serde_json::{Value, json};
use std::fs::{File, TryLockError};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// A folder whose files are written under temporary names and renamed together.
#[derive(Debug)]
pub struct ResultsFolder {
    path: PathBuf,
    /// Whether results of another study are there, which stay until the new ones are whole.
    replaces: bool,
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

impl ResultsFolder {
    /// Opens a folder and checks that it can be written to. Makes it if needed, and finishes what a killed run left.
    ///
    /// # Errors
    /// If the folder cannot be made or written to, or another run uses it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
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
        publication::settle(path)?;
        publication::discard_parts(path)?;
        files::remove_temporary(path, &PUBLISHED)?;
        for place in [path, &path.join(REPLACING)] {
            if let Some(blocks) = files::subfolder(place, BLOCKS)? {
                files::remove_temporary(&blocks, &[Kind::Block, Kind::Design])?;
            }
        }
        files::probe(path)?;
        Ok(Self {
            path: path.to_owned(),
            replaces: false,
            _lock: Lock(lock),
            staged: Staged::default(),
        })
    }

    /// Refuses to replace anything in a folder with files of which nothing says that they are results. Changes nothing.
    ///
    /// # Errors
    /// [`FolderError::NotResults`], or the foreign file.
    pub fn refuse_foreign(path: &Path) -> Result<(), FolderError> {
        if !files::is_there(path) {
            return Ok(());
        }
        let (manifest, design) = (path.join(MANIFEST), path.join(BLOCKS).join(DESIGN));
        files::replaceable(&manifest, Kind::Manifest)?;
        let blocks = files::subfolder(path, BLOCKS)?;
        if blocks.is_some() {
            files::replaceable(&design, Kind::Design)?;
        }
        let marked = files::is_there(&manifest) || files::is_there(&design);
        let is_own = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name == LOCK || name.starts_with(OWN_PREFIX)
        };
        if marked || files::list(path)?.iter().all(is_own) {
            Ok(())
        } else {
            Err(FolderError::NotResults(path.to_owned()))
        }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether results of another study are replaced; if so, the names of what else is in the folder, and stays.
    pub fn replaced_beside(&self) -> Option<Result<Vec<String>, PathError>> {
        self.replaces.then(|| others(&self.path))
    }

    /// Whether results of another study are replaced.
    pub fn replaces(&self) -> bool {
        self.replaces
    }

    /// The folder with the blocks.
    pub fn place_of_blocks(&self) -> PathBuf {
        if self.replaces {
            self.path.join(REPLACING)
        } else {
            self.path.clone()
        }
    }

    /// Checks that results of this design, with `figures`, may be written. Refuses a folder with results or blocks of
    /// another design, and one in which a foreign file has the name of a result or of a figure. Results without a
    /// manifest are accepted if the blocks' design is there. Otherwise they are foreign.
    ///
    /// # Errors
    /// [`FolderError::OtherDesign`] with the keys that differ, [`FolderError::Newer`],
    /// [`FolderError::Unknown`], [`FolderError::File`], and as for [`read_manifest`].
    pub fn check_design(&self, design: &Value, figures: &[&str]) -> Result<(), FolderError> {
        let manifest = read_manifest(&self.path)?;
        let stored = Self::design_text(&self.path)?;
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
        match (&stored, &manifest, result_file(&self.path)) {
            (Some(text), ..) => self.compare(&self.parse_design(text)?, design)?,
            (None, None, Some(file)) => {
                let path = self.path.clone();
                return Err(FolderError::Unknown { path, file });
            }
            _ => {}
        }
        self.check_targets(figures)
    }

    /// Makes the folder one of a design that was checked; or the part of it where a study is computed that replaces
    /// another one.
    ///
    /// # Errors
    /// If a file cannot be written or removed.
    pub fn claim(&self, design: &Value) -> Result<(), FolderError> {
        let place = self.place_of_blocks();
        if self.replaces {
            let stored = Self::design_text(&place)?;
            if stored.and_then(|text| files::parsed(&text).ok()).as_ref() != Some(design) {
                publication::discard_replacing(&self.path)?;
            }
            files::make_subfolder(&self.path, REPLACING)?;
            // No times, instead of those of the study before.
            files::make_subfolder(&place, TIMING)?;
        }
        let path = files::make_subfolder(&place, BLOCKS)?.join(DESIGN);
        if files::is_there(&path) {
            return Ok(());
        }
        let text = files::sealed(design);
        Ok(files::replace(&path, Kind::Design, text.as_bytes())?)
    }

    /// Reads the design of the blocks in a place.
    fn design_text(place: &Path) -> Result<Option<Vec<u8>>, PathError> {
        match files::subfolder(place, BLOCKS)? {
            Some(blocks) => files::read_own(&blocks.join(DESIGN), Kind::Design),
            None => Ok(None),
        }
    }

    fn parse_design(&self, text: &[u8]) -> Result<Value, FolderError> {
        let path = self.path.join(BLOCKS).join(DESIGN);
        let wrong = |reason: String| FolderError::Manifest {
            path: path.clone(),
            reason,
        };
        let mut stored = serde_json::from_slice(text).map_err(|error| wrong(error.to_string()))?;
        refuse_newer(&path, &stored)?;
        files::unseal(&mut stored, text).map_err(|reason| wrong(reason.to_owned()))?;
        Ok(stored)
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

    /// Checks that the results and blocks that are there are the program's own, as the manifest lists them, so that
    /// those of another study may replace them.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check_listed(&self) -> Result<(), FolderError> {
        let manifest = read_manifest(&self.path)?;
        for (name, _) in RESULTS {
            let path = self.path.join(name);
            let is_listed =
                |manifest: &Value| lists(manifest, name) && check_result(&self.path, manifest, name, None).is_ok();
            if files::is_there(&path) && !manifest.as_ref().is_some_and(is_listed) {
                return Err(PathError::foreign(&path, UNLISTED).into());
            }
        }
        Ok(())
    }

    /// Begins to replace the results that are there, which stay until the new ones are whole; `anew` does not go on
    /// with what an earlier run has computed of these.
    ///
    /// # Errors
    /// If a foreign file has the name of a result or of one of `figures`, or there is one among the blocks. Nothing is
    /// removed then.
    pub fn replace(&mut self, figures: &[&str], anew: bool) -> Result<(), FolderError> {
        self.check_targets(figures)?;
        if let Some(blocks) = files::subfolder(&self.path, BLOCKS)? {
            own_blocks(&blocks)?;
        }
        if anew {
            publication::discard_replacing(&self.path)?;
        }
        self.replaces = true;
        Ok(())
    }

    /// Removes what was computed of results that were to replace others.
    ///
    /// # Errors
    /// If there is something foreign among it, or a file cannot be removed.
    pub fn give_up(&self) -> Result<(), FolderError> {
        Ok(publication::discard_replacing(&self.path)?)
    }

    /// Returns the folder of new results.
    fn new_results(&self) -> Result<PathBuf, PathError> {
        files::make_subfolder(&self.path, if self.replaces { REPLACING } else { NEW })
    }

    /// Writes the manifest of results that are to be computed.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn announce(&self, mut manifest: Value) -> Result<(), FolderError> {
        let before = read_announced(&self.path).ok().flatten();
        if !self.replaces && before.is_some_and(|before| before["seen"] == true) {
            manifest["seen"] = true.into();
        }
        let path = self.new_results()?.join(MANIFEST);
        let text = files::sealed(&manifest);
        Ok(files::replace(&path, Kind::Manifest, text.as_bytes())?)
    }

    /// Creates a file that [`Self::publish`] will put in its place. Returns it with its temporary path.
    ///
    /// # Errors
    /// If it cannot be created, or a foreign file has that name.
    pub fn stage(&mut self, name: &str, kind: Kind) -> Result<(File, PathBuf), FolderError> {
        files::replaceable(&self.path.join(name), kind)?;
        let path = self.new_results()?.join(name);
        Ok(self.staged.create(&path, kind)?)
    }

    /// Writes a file that [`Self::publish`] will put in its place.
    ///
    /// # Errors
    /// As for [`Self::stage`], and if it cannot be written.
    pub fn write(&mut self, name: &str, kind: Kind, content: &[u8]) -> Result<(), FolderError> {
        files::replaceable(&self.path.join(name), kind)?;
        let path = self.new_results()?.join(name);
        Ok(self.staged.write(&path, kind, content)?)
    }

    /// Writes a JSON file like [`Self::write`], but piece by piece.
    ///
    /// # Errors
    /// As for [`Self::write`].
    pub fn write_json(&mut self, name: &str, kind: Kind, value: &impl Serialize) -> Result<(), FolderError> {
        let (file, path) = self.stage(name, kind)?;
        let mut writer = BufWriter::new(file);
        let written = serde_json::to_writer(&mut writer, value).map_err(Into::into);
        let written = written
            .and_then(|()| writer.write_all(b"\n"))
            .and_then(|()| writer.into_inner()?.sync_all());
        Ok(written.map_err(PathError::io(&path))?)
    }

    /// Writes the manifest, with the checksums of the results that were written before.
    ///
    /// # Errors
    /// As for [`Self::write`].
    pub fn write_manifest(&mut self, mut manifest: Value) -> Result<(), FolderError> {
        for (name, path) in self.staged.files() {
            if RESULTS.iter().any(|(result, _)| *result == name) {
                manifest["checksums"][name] = files::checksum_of(path)?.into();
            }
        }
        self.write(MANIFEST, Kind::Manifest, files::sealed(&manifest).as_bytes())
    }

    /// Makes what was written the results of the folder, in one step. The blocks stay if `keep_blocks`.
    ///
    /// # Errors
    /// If a file cannot be renamed, or a foreign file has its name.
    pub fn publish(&mut self, keep_blocks: bool) -> Result<(), FolderError> {
        let new = self.new_results()?;
        if self.replaces && !keep_blocks {
            publication::discard_blocks(&new)?;
        }
        self.staged.publish()?;
        Ok(publication::publish(&self.path, &new)?)
    }
}

impl Drop for ResultsFolder {
    /// Leaves no empty folder of new results, while the lock is held.
    fn drop(&mut self) {
        self.staged = Staged::default();
        // There is none as a rule; a failure here cannot be handled.
        let _ = files::remove_empty(&self.path.join(NEW));
    }
}

/// How the names of the program's temporary files and folders begin.
const OWN_PREFIX: &str = ".asobench-";
/// The refusal of a result that a manifest does not list, or that was changed since.
const UNLISTED: &str = "not as manifest.json lists it; move it away or choose another folder";

/// The names of what is in a folder besides results, sorted.
fn others(folder: &Path) -> Result<Vec<String>, PathError> {
    let names = files::list(folder)?.into_iter().filter_map(|path| {
        let name = path.file_name()?.to_string_lossy().into_owned();
        let known = [MANIFEST, LOOKS, LOCK, BLOCKS, TIMING].contains(&name.as_str());
        let result = RESULTS.iter().any(|(result, _)| *result == name);
        (!known && !result && !name.starts_with(OWN_PREFIX)).then_some(name)
    });
    let mut names: Vec<String> = names.collect();
    names.sort();
    Ok(names)
}

#[cfg(test)]
mod tests;
