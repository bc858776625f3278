//! Writes the files of a report: all of them, or none.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Why a report cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", .path.display())]
pub struct WriteError {
    path: PathBuf,
    source: io::Error,
}

fn failed(path: &Path) -> impl Fn(io::Error) -> WriteError + '_ {
    move |source| WriteError {
        path: path.to_owned(),
        source,
    }
}

/// Writes files under a folder, in a folder beside them first, so that nothing is replaced before all is written.
/// The last file is renamed last.
///
/// # Errors
/// The path that cannot be written, and why.
pub fn write(folder: &Path, files: &[(String, String)]) -> Result<(), WriteError> {
    fs::create_dir_all(folder).map_err(failed(folder))?;
    let stage = folder.join(format!(".report.{}.tmp", std::process::id()));
    let written = stage_all(&stage, files).and_then(|()| publish(&stage, folder, files));
    // What is left of the stage is of no use; the first error is the one to tell.
    let _ = fs::remove_dir_all(&stage);
    written
}

fn stage_all(stage: &Path, files: &[(String, String)]) -> Result<(), WriteError> {
    for (name, content) in files {
        let path = stage.join(name);
        let parent = path.parent().unwrap_or(stage);
        fs::create_dir_all(parent).map_err(failed(parent))?;
        fs::write(&path, content).map_err(failed(&path))?;
    }
    Ok(())
}

fn publish(stage: &Path, folder: &Path, files: &[(String, String)]) -> Result<(), WriteError> {
    for (name, _) in files {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(failed(parent))?;
        fs::rename(stage.join(name), &path).map_err(failed(&path))?;
    }
    Ok(())
}
