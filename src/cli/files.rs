//! Files that the user names: written whole or not at all.

use super::error::Error;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file under a temporary name beside it, then renames it. `flag` names the option in a message;
/// `input` is a file that must not be overwritten.
pub(super) fn write_whole(
    flag: &str,
    path: &Path,
    input: Option<&Path>,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let failed = |error: io::Error| Error::Input(format!("{flag} {}: {error}", path.display()));
    // A link is followed; a device or a folder is left alone, and so is the input.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if target.is_symlink() {
        return Err(failed(io::Error::other("a link that leads nowhere")));
    }
    if target.exists() && !target.is_file() {
        return Err(failed(io::Error::other("not a regular file")));
    }
    if input.is_some_and(|input| fs::canonicalize(input).is_ok_and(|input| input == target)) {
        return Err(failed(io::Error::other("would overwrite the input")));
    }
    let mut temporary = target.clone();
    let attempt = || -> io::Result<()> {
        let file;
        (temporary, file) = create_beside(&target)?;
        let mut to = BufWriter::new(file);
        write(&mut to)?;
        to.flush()?;
        fs::rename(&temporary, &target)
    };
    attempt().map_err(|error| {
        if temporary != target {
            // The first error is the one to report.
            let _ = fs::remove_file(&temporary);
        }
        failed(error)
    })
}

/// Creates a file of a new name in the folder of `target`.
fn create_beside(target: &Path) -> io::Result<(PathBuf, File)> {
    let mut attempt = 0;
    loop {
        let mut name = std::ffi::OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(format!(".{}.{attempt}.tmp", std::process::id()));
        let temporary = target.with_file_name(name);
        match File::create_new(&temporary) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && attempt < 1000 => {
                attempt += 1;
            }
            created => return created.map(|file| (temporary, file)),
        }
    }
}
