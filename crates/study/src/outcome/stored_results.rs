//! Reads the manifest of a folder of results, and checks results against it.

use super::folder_error::FolderError;
use crate::design::design_of;
use crate::files;
use crate::files::Kind;
use crate::outcome::folder_layout::{BLOCKS, DESIGN, MANIFEST, RESULTS, done_in};
use crate::outcome::publication::{NEW, REPLACING, current, is_settling, read_current};
use serde_json::Value;
use std::path::Path;

/// Reads the manifest of the results in a folder. Returns `None` if there are no results, or they were not completely
/// written.
///
/// # Errors
/// If the manifest cannot be read, or is of a newer version.
pub fn read_manifest(folder: &Path) -> Result<Option<Value>, FolderError> {
    let text = read_current(folder, MANIFEST, Kind::Manifest)?;
    let parse = |text: Vec<u8>| parse_manifest(&folder.join(MANIFEST), &text);
    text.map(parse).transpose()
}

/// Reads the manifest of a run in a folder that has not ended: what its results are to be. `wanted` in it is the number
/// of trials, and `seen` says that what is there was looked at.
///
/// # Errors
/// As for [`read_manifest`].
pub fn read_announced(folder: &Path) -> Result<Option<Value>, FolderError> {
    let Some(new) = files::subfolder(folder, NEW)? else {
        return Ok(None);
    };
    let path = new.join(MANIFEST);
    let text = files::read_own(&path, Kind::Manifest)?;
    text.map(|text| parse_manifest(&path, &text)).transpose()
}

/// Reads results, given their manifest. If they are replaced meanwhile they are read again, so that all of them are old
/// or all are new.
///
/// # Errors
/// [`FolderError::NoResults`], [`FolderError::Unfinished`], those of [`read_manifest`] and those of `read`.
pub fn read_results<T, E: From<FolderError>>(folder: &Path, read: impl Fn(&Value) -> Result<T, E>) -> Result<T, E> {
    let state = || -> Result<_, FolderError> { Ok((is_settling(folder), read_manifest(folder)?)) };
    loop {
        let before = state()?;
        let found = match &before.1 {
            Some(manifest) => read(manifest),
            None => Err(without_results(folder)?.into()),
        };
        if state()? == before {
            return found;
        }
    }
}

/// Returns why a folder has no results.
fn without_results(folder: &Path) -> Result<FolderError, FolderError> {
    let path = folder.to_owned();
    let announced = read_announced(folder)?;
    let blocks = files::subfolder(folder, BLOCKS)?;
    let begun = match &blocks {
        Some(blocks) => files::is_own(&blocks.join(DESIGN), Kind::Design)?,
        None => false,
    };
    if announced.is_none() && !begun {
        return Ok(FolderError::NoResults(path));
    }
    Ok(FolderError::Unfinished {
        path,
        done: blocks.map_or(0, |blocks| done_in(&blocks).trials),
        wanted: announced.and_then(|manifest| manifest["wanted"].as_u64()),
    })
}

/// Parses the text of a manifest.
///
/// # Errors
/// The fault of the content.
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
pub fn check_result(folder: &Path, manifest: &Value, name: &str, content: Option<&[u8]>) -> Result<(), FolderError> {
    let (path, stored) = (current(folder, name)?, manifest["checksums"][name].as_str());
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

/// Checks all results of a folder against their checksums; returns the names of those that have one.
///
/// # Errors
/// As for [`read_results`] and [`check_result`].
pub fn check_results(folder: &Path) -> Result<Vec<&'static str>, FolderError> {
    read_results(folder, |manifest| {
        let names = RESULTS.into_iter().map(|(name, _)| name);
        let names: Vec<_> = names.filter(|name| manifest["checksums"][name].is_string()).collect();
        for name in &names {
            check_result(folder, manifest, name, None)?;
        }
        Ok(names)
    })
}

/// Returns the design of the results or blocks in a folder, if it can be read.
pub fn stored_design(folder: &Path) -> Option<Value> {
    let manifest = read_manifest(folder).ok().flatten();
    let stored = manifest.or_else(|| design_of_blocks(folder));
    Some(design_of(&stored?["experiment"]))
}

/// Returns the same, and the design of what is to replace it.
pub fn stored_designs(folder: &Path) -> Vec<Value> {
    let replacing = design_of_blocks(&folder.join(REPLACING));
    let replacing = replacing.map(|stored| design_of(&stored["experiment"]));
    stored_design(folder).into_iter().chain(replacing).collect()
}

fn design_of_blocks(place: &Path) -> Option<Value> {
    let path = files::subfolder(place, BLOCKS).ok()??.join(DESIGN);
    let text = files::read_own(&path, Kind::Design).ok()??;
    files::parsed(&text).ok()
}

/// Refuses a file that a newer version wrote.
pub(super) fn refuse_newer(path: &Path, stored: &Value) -> Result<(), FolderError> {
    match stored["version"].as_str() {
        Some(version) if is_newer(version) => Err(FolderError::Newer {
            path: path.to_owned(),
            version: version.to_owned(),
        }),
        _ => Ok(()),
    }
}

/// Whether a manifest lists a result. Manifests of version 0.2.0 list none.
pub(crate) fn lists(manifest: &Value, name: &str) -> bool {
    manifest["checksums"].is_null() || manifest["checksums"][name].is_string()
}

/// Whether a version is newer than this program's.
fn is_newer(version: &str) -> bool {
    let numbers = |version: &str| -> Vec<u64> { version.split('.').map(|part| part.parse().unwrap_or(0)).collect() };
    numbers(version) > numbers(env!("CARGO_PKG_VERSION"))
}
