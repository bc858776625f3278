//! Files that the user names: written whole or not at all.

use super::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file under a temporary name beside it, then renames it. `flag` names the option in a message.
pub(super) fn write_whole(
    flag: &str,
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> Result<(), Error> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(".tmp");
    let temporary = PathBuf::from(temporary);
    let attempt = || -> std::io::Result<()> {
        if path.is_dir() {
            return Err(std::io::ErrorKind::IsADirectory.into());
        }
        let mut to = BufWriter::new(File::create(&temporary)?);
        write(&mut to)?;
        to.flush()?;
        std::fs::rename(&temporary, path)
    };
    attempt().map_err(|error| {
        // The temporary file may not even exist; the first error is the one to report.
        let _ = std::fs::remove_file(&temporary);
        Error::Input(format!("{flag} {}: {error}", path.display()))
    })
}
