//! Files that are first written under temporary names in the same folder, then renamed.

use super::kind::too_large;
use super::{Kind, PathError, irregularity, remove_file, replaceable};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Attempts to find a free temporary name.
const ATTEMPTS: usize = 1000;

/// A file that still has its temporary name.
#[derive(Debug)]
struct Pending {
    temporary: PathBuf,
    path: PathBuf,
    kind: Kind,
}

/// Files that wait to be renamed. Dropping this removes those that were not renamed.
#[derive(Debug, Default)]
pub struct Staged(Vec<Pending>);

impl Staged {
    /// Creates a new file that will become `path`, and returns it with its temporary name.
    ///
    /// # Errors
    /// If `path` exists and is not the program's own file of this kind, or if no file can be created.
    pub fn create(&mut self, path: &Path, kind: Kind) -> Result<(File, PathBuf), PathError> {
        replaceable(path, kind)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let (file, temporary) = create_temporary(folder, kind).map_err(PathError::io(path))?;
        self.0.push(Pending {
            temporary: temporary.clone(),
            path: path.to_owned(),
            kind,
        });
        Ok((file, temporary))
    }

    /// Writes a file that will become `path`.
    ///
    /// # Errors
    /// As for [`Self::create`]; if it cannot be written; or if it is too large to be read again.
    pub fn write(&mut self, path: &Path, kind: Kind, content: &[u8]) -> Result<(), PathError> {
        if content.len() as u64 > kind.limit() {
            return Err(PathError::io(path)(too_large(kind)));
        }
        let (mut file, _) = self.create(path, kind)?;
        let written = file.write_all(content).and_then(|()| {
            if kind.is_synced() {
                file.sync_all()?;
            }
            Ok(())
        });
        written.map_err(PathError::io(path))
    }

    /// Returns the files with their names and temporary paths.
    pub fn files(&self) -> impl Iterator<Item = (&str, &Path)> {
        let files = self.0.iter();
        files.filter_map(|file| Some((file.path.file_name()?.to_str()?, file.temporary.as_path())))
    }

    /// Checks once more that every file may be put in its place.
    ///
    /// # Errors
    /// The first file that may not.
    pub fn check(&self) -> Result<(), PathError> {
        let mut files = self.0.iter();
        files.try_for_each(|file| replaceable(&file.path, file.kind))
    }

    /// Renames every file to its final name, in the order of creation.
    ///
    /// # Errors
    /// If a file may not be replaced (then none is renamed), or if one cannot be renamed.
    pub fn publish(&mut self) -> Result<(), PathError> {
        self.check()?;
        // Taken from the end, so files that were not renamed are still listed and will be removed.
        self.0.reverse();
        while let Some(Pending { temporary, path, .. }) = self.0.last() {
            fs::rename(temporary, path).map_err(PathError::io(path))?;
            self.0.pop();
        }
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        for Pending { temporary, .. } in &self.0 {
            // A failure here cannot be handled.
            let _ = fs::remove_file(temporary);
        }
    }
}

/// Writes one file completely.
///
/// # Errors
/// As for [`Staged::write`].
pub fn replace(path: &Path, kind: Kind, content: &[u8]) -> Result<(), PathError> {
    let mut staged = Staged::default();
    staged.write(path, kind, content)?;
    staged.publish()
}

/// Creates and removes a file in a folder, to test whether this is possible.
///
/// # Errors
/// If it is not.
pub(crate) fn probe(folder: &Path) -> Result<(), PathError> {
    let made = create_temporary(folder, Kind::Manifest).and_then(|(mut file, path)| {
        let written = file.write_all(b"asobench");
        fs::remove_file(path).and(written)
    });
    made.map_err(PathError::io(folder))
}

/// Creates a file with a name of the program's temporary pattern. An existing file is never opened or followed.
fn create_temporary(folder: &Path, kind: Kind) -> io::Result<(File, PathBuf)> {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let mut made = Err(io::Error::from(io::ErrorKind::AlreadyExists));
    for _ in 0..ATTEMPTS {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!(".asobench-{}-{}-{number}.tmp", kind.name(), std::process::id());
        let path = folder.join(name);
        made = File::create_new(&path).map(|file| (file, path));
        if !matches!(&made, Err(error) if error.kind() == io::ErrorKind::AlreadyExists) {
            break;
        }
    }
    made
}

/// Whether a name is that of a temporary file of this kind.
fn is_temporary(name: &str, kind: Kind) -> bool {
    let number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    name.strip_prefix(".asobench-")
        .and_then(|rest| rest.strip_prefix(kind.name()))
        .and_then(|rest| rest.strip_prefix('-'))
        .and_then(|rest| rest.strip_suffix(".tmp"))
        .and_then(|rest| rest.split_once('-'))
        .is_some_and(|(process, count)| number(process) && number(count))
}

/// Removes temporary files of some kinds that a killed run left in a folder. The caller must hold the folder's lock,
/// and no other command may create files of these kinds there.
///
/// # Errors
/// If the folder cannot be read or a file cannot be removed.
pub(crate) fn remove_temporary(folder: &Path, kinds: &[Kind]) -> Result<(), PathError> {
    for path in super::list(folder)? {
        let name = path.file_name().and_then(|name| name.to_str());
        let is_own = name.is_some_and(|name| kinds.iter().any(|kind| is_temporary(name, *kind)));
        let is_file = || fs::symlink_metadata(&path).is_ok_and(|metadata| irregularity(&metadata).is_none());
        if is_own && is_file() {
            remove_file(&path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_pattern_is_temporary() {
        assert!(is_temporary(".asobench-block-17-0.tmp", Kind::Block));
        for name in [
            ".asobench-block-17-0.tmp",
            ".asobench-page-17-.tmp",
            ".asobench-page-x-1.tmp",
            ".asobench-page-1-2-3.tmp",
            ".asobench-page-1-2.tmp~",
            "asobench-page-1-2.tmp",
            ".report.html.tmp",
        ] {
            assert!(!is_temporary(name, Kind::Page), "{name}");
        }
    }
}
