//! How new results take the place of old ones: by renaming one folder.
//!
//! New results are put together in a folder of their own within that of the results, so that the old ones stay as they
//! are. When all is written it is renamed to [`WHOLE`]. From this step on a file in it counts before one of the same
//! name beside it, and each moves up, the manifest last ([`settle`]). Whenever a run is killed, what counts are the old
//! results or the new ones, and there is a manifest.

use crate::files::{self, Kind, PathError};
use crate::outcome::folder_layout::{BLOCKS, RESULTS, TIMES, TIMING, kind_of, own_blocks, remove_own};
use std::path::{Path, PathBuf};

/// Results that are not whole yet. While a run computes trials, its manifest alone: what the results are to be.
pub(crate) const NEW: &str = ".asobench-new";
/// The same of a study that replaces another one, with its blocks.
pub(crate) const REPLACING: &str = ".asobench-replacing";
/// Whole results that move up.
pub(crate) const WHOLE: &str = ".asobench-whole";

/// The kinds of the files that are published together.
pub(crate) const PUBLISHED: [Kind; 5] = [Kind::Manifest, Kind::Looks, Kind::Summary, Kind::Parquet, Kind::Figure];

/// Returns the place of a file that counts, such as `timing/times.json`; there need not be one.
///
/// # Errors
/// If the folder of whole results is a link or something else.
pub fn current(folder: &Path, name: &str) -> Result<PathBuf, PathError> {
    let whole = files::subfolder(folder, WHOLE)?;
    let top = name.split('/').next().unwrap_or(name);
    let whole = whole.filter(|whole| files::is_there(&whole.join(top)));
    Ok(whole.as_deref().unwrap_or(folder).join(name))
}

/// Reads a file that counts; `None` if there is none.
///
/// # Errors
/// As for [`files::read_own`].
pub fn read_current(folder: &Path, name: &str, kind: Kind) -> Result<Option<Vec<u8>>, PathError> {
    match files::read_own(&current(folder, name)?, kind)? {
        // It may just have moved up.
        None => files::read_own(&current(folder, name)?, kind),
        found => Ok(found),
    }
}

/// Whether whole results are on their way.
pub(crate) fn is_settling(folder: &Path) -> bool {
    files::is_there(&folder.join(WHOLE))
}

/// Returns the files of a folder of new results, with their names and kinds; the manifest is the last.
fn own_files(new: &Path) -> Result<Vec<(PathBuf, String, Kind)>, PathError> {
    let [found, ..] = files::entries(new)?;
    let own = found.into_iter().map(|path| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let kind = kind_of(name).ok_or_else(|| PathError::foreign(&path, files::NOT_OWN))?;
        Ok((path.clone(), name.to_owned(), kind))
    });
    let mut own: Vec<_> = own.collect::<Result<_, PathError>>()?;
    own.sort_by_key(|(_, _, kind)| *kind == Kind::Manifest);
    Ok(own)
}

/// Makes whole results those of a folder, in one step. Nothing has changed if it fails before.
///
/// # Errors
/// If a foreign file or folder has the name of one, or one cannot be moved.
pub(crate) fn publish(folder: &Path, new: &Path) -> Result<(), PathError> {
    for (_, name, kind) in own_files(new)? {
        files::replaceable(&folder.join(name), kind)?;
    }
    if let (Some(_), Some(old)) = (files::subfolder(new, BLOCKS)?, files::subfolder(folder, BLOCKS)?) {
        own_blocks(&old)?;
    }
    files::rename_folder(new, &folder.join(WHOLE))?;
    settle(folder)
}

/// Moves up whole results, if there are any: those of a run that was killed at it, too. The caller has the lock.
///
/// # Errors
/// As for [`publish`].
pub(crate) fn settle(folder: &Path) -> Result<(), PathError> {
    let Some(whole) = files::subfolder(folder, WHOLE)? else {
        return Ok(());
    };
    if let Some(new) = files::subfolder(&whole, BLOCKS)? {
        if let Some(old) = files::subfolder(folder, BLOCKS)? {
            remove_own(&old)?;
        }
        let blocks = folder.join(BLOCKS);
        files::rename_folder(&new, &blocks)?;
        files::remove_empty(&blocks)?;
    }
    if let Some(none) = files::subfolder(&whole, TIMING)? {
        if let Some(old) = files::subfolder(folder, TIMING)? {
            files::remove(&old.join(TIMES), Kind::Times)?;
            files::remove_empty(&old)?;
        }
        files::remove_empty(&none)?;
    }
    for (path, name, kind) in own_files(&whole)? {
        if kind == Kind::Manifest {
            remove_unlisted(folder, &path)?;
        }
        files::move_over(&path, &folder.join(name), kind)?;
    }
    files::remove_empty(&whole)
}

/// Removes the results of a study that was replaced, as far as the new manifest has no such file.
fn remove_unlisted(folder: &Path, manifest: &Path) -> Result<(), PathError> {
    let text = files::read_own(manifest, Kind::Manifest)?.unwrap_or_default();
    let manifest = files::parsed(&text).unwrap_or_default();
    for (name, kind) in RESULTS {
        if manifest["checksums"].is_object() && manifest["checksums"][name].is_null() {
            files::remove(&folder.join(name), kind)?;
        }
    }
    Ok(())
}

/// Removes what a run that was killed or refused left of results that were not whole. Blocks and manifests stay.
///
/// # Errors
/// If a file cannot be removed.
pub(crate) fn discard_parts(folder: &Path) -> Result<(), PathError> {
    for name in [NEW, REPLACING] {
        let Some(new) = files::subfolder(folder, name)? else {
            continue;
        };
        files::remove_temporary(&new, &PUBLISHED)?;
        for (path, _, kind) in own_files(&new)? {
            if kind != Kind::Manifest {
                files::remove(&path, kind)?;
            }
        }
    }
    Ok(())
}

/// Removes all that a study which replaces another has computed.
///
/// # Errors
/// If there is something foreign among it, or a file cannot be removed.
pub(crate) fn discard_replacing(folder: &Path) -> Result<(), PathError> {
    let Some(new) = files::subfolder(folder, REPLACING)? else {
        return Ok(());
    };
    let own = own_files(&new)?;
    for name in [BLOCKS, TIMING] {
        if let Some(within) = files::subfolder(&new, name)? {
            remove_own(&within)?;
        }
    }
    for (path, _, kind) in own {
        files::remove(&path, kind)?;
    }
    files::remove_empty(&new)
}

/// Removes the blocks of a study that replaces another, and leaves their folder: it takes the place of the old one.
pub(crate) fn discard_blocks(new: &Path) -> Result<(), PathError> {
    if let Some(blocks) = files::subfolder(new, BLOCKS)? {
        for (path, kind) in own_blocks(&blocks)? {
            files::remove(&path, kind)?;
        }
    }
    Ok(())
}
