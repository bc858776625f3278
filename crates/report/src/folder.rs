//! Writes the files of a report: all of them or none.

use asobench_study::files::{self, Kind, PathError, Staged};
use std::path::Path;

/// The files of a report: name relative to its folder, content.
pub type Files = Vec<(String, String)>;

/// The last file of a report.
const PAGE: &str = "report.html";
/// The folders of the other files.
const SUBFOLDERS: [&str; 2] = ["figures", "tables"];

/// Creates the folder of a report if needed, and checks that the page and its subfolders can be written.
///
/// # Errors
/// The path that is in the way, and why.
pub fn prepare(folder: &Path) -> Result<(), PathError> {
    files::make_folder(folder)?;
    for name in SUBFOLDERS {
        files::subfolder(folder, name)?;
    }
    files::replaceable(&folder.join(PAGE), Kind::Page)
}

/// Writes files under a folder. All are first written under temporary names, so nothing is replaced before everything
/// is written. The last file is renamed last.
///
/// # Errors
/// The path that cannot be written, and why.
pub fn write(folder: &Path, files: &Files) -> Result<(), PathError> {
    prepare(folder)?;
    let mut staged = Staged::default();
    for (name, content) in files {
        let path = folder.join(name);
        if let Some((subfolder, _)) = name.split_once('/') {
            files::make_subfolder(folder, subfolder)?;
        }
        let kind = Kind::of_report(name);
        let kind = kind.ok_or_else(|| PathError::foreign(&path, "not a file of a report"))?;
        staged.write(&path, kind, content.as_bytes())?;
    }
    staged.publish()
}
