//! The only access to the file system: everything that the program opens, writes, renames or removes.
//!
//! A file is written under a new temporary name in its folder and then renamed. An existing file is replaced or removed
//! only if it is a regular file that is empty or that the program recognises as its own by name and content ([`Kind`]).
//! Anything else is refused: links, folders, FIFOs, devices, and all files of others. Such a link is never followed.
//! A folder is removed only if it is empty.
//!
//! There is no protection against another program that swaps files for links at the same time.

#![allow(clippy::disallowed_methods, reason = "this is the place that touches files")]

mod kind;
pub(crate) mod parquet;
#[cfg(target_os = "linux")]
mod pipes;
mod quietly;
mod record;
mod seal;
mod staged;
mod workbook;

pub use kind::{AGREED_TITLE, Kind, LATEX_TITLE, PAGE_MAKER, SIMULATED, SIMULATED_TITLE, WORKERS_TITLE};
use parquet::ParquetText;
pub(crate) use parquet::{Column, Table, Values};
pub use parquet::{numbers_as_parquet, parquet_of};
#[cfg(target_os = "linux")]
pub(crate) use pipes::{Mark, Pipes};
pub use record::read_record;
pub use seal::{checksum, checksum_of, parsed, sealed, unseal};
pub use staged::{Staged, replace};
pub(crate) use staged::{probe, remove_temporary};

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// An error of a file or a folder.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", .path.display())]
pub struct PathError {
    /// The file or folder.
    pub path: PathBuf,
    /// The error.
    pub source: io::Error,
    /// Whether there is something that is not the program's own, so that the user must act.
    pub foreign: bool,
}

impl PathError {
    /// An error of the file system.
    pub fn io(path: &Path) -> impl Fn(io::Error) -> Self + '_ {
        move |source| Self {
            path: path.to_owned(),
            source,
            foreign: false,
        }
    }

    /// An error for something that is not the program's own.
    pub fn foreign(path: &Path, what: &str) -> Self {
        Self {
            path: path.to_owned(),
            source: io::Error::other(what.to_owned()),
            foreign: true,
        }
    }

    /// An error for something other than a regular file.
    fn irregular(path: &Path, what: &str) -> Self {
        Self::foreign(path, &format!("not a regular file but {what}"))
    }
}

/// The message about a file that is not the program's own.
pub(crate) const NOT_OWN: &str = "not written by asobench; move it away or choose another place";

/// Removes the folders of pipes that killed processes of this user left.
pub fn remove_left_pipes() {
    #[cfg(target_os = "linux")]
    Pipes::remove_left();
}

/// Describes a folder entry that is not a regular file; `None` for a regular file.
fn irregularity(metadata: &Metadata) -> Option<&'static str> {
    let kind = metadata.file_type();
    if kind.is_file() {
        None
    } else if kind.is_dir() {
        Some("a directory")
    } else if kind.is_symlink() {
        Some("a link")
    } else {
        Some("a pipe, a socket or a device")
    }
}

/// Opens a regular file without blocking, and checks the opened file once more.
fn open_regular(path: &Path, follow: bool) -> Result<File, PathError> {
    let io = PathError::io(path);
    let check =
        |metadata: &Metadata| irregularity(metadata).map_or(Ok(()), |what| Err(PathError::irregular(path, what)));
    let metadata = if follow {
        fs::metadata(path)
    } else {
        fs::symlink_metadata(path)
    };
    check(&metadata.map_err(&io)?)?;
    let file = at_once(OpenOptions::new().read(true), follow).open(path);
    let file = file.map_err(&io)?;
    check(&file.metadata().map_err(&io)?)?;
    Ok(file)
}

/// Adds the flags against blocking and, unless `follow`, against following a link.
fn at_once(options: &mut OpenOptions, follow: bool) -> &mut OpenOptions {
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt;
        let links = if follow { OFlags::empty() } else { OFlags::NOFOLLOW };
        options.custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY | links).bits().cast_signed());
    }
    options
}

/// A reader that fails if a file is larger than its kind may be.
struct Limited<R> {
    from: R,
    left: u64,
    kind: Kind,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(to)?;
        self.left = self
            .left
            .checked_sub(read as u64)
            .ok_or_else(|| kind::too_large(self.kind))?;
        Ok(read)
    }
}

fn limited<R: Read>(from: R, kind: Kind) -> Limited<R> {
    let left = kind.limit();
    Limited { from, left, kind }
}

/// Opens a file that the user names: a regular file, a link to one, or `-` for standard input.
///
/// # Errors
/// If it is something else. Reading beyond [`Kind::limit`] fails.
pub fn open_named(path: &Path, kind: Kind) -> io::Result<Box<dyn Read>> {
    if path == Path::new("-") {
        return Ok(Box::new(limited(io::stdin().lock(), kind)));
    }
    let file = open_regular(path, true).map_err(|error| error.source)?;
    if file.metadata()?.len() > kind.limit() {
        return Err(kind::too_large(kind));
    }
    Ok(Box::new(limited(file, kind)))
}

/// Reads a file that the user names.
///
/// # Errors
/// As for [`open_named`], and if it is not UTF-8.
pub fn read_named(path: &Path, kind: Kind) -> io::Result<String> {
    let mut text = String::new();
    open_named(path, kind)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Opens a file of a results folder; `None` if it does not exist.
///
/// # Errors
/// If it is not a regular file, or cannot be opened.
pub(crate) fn open_own(path: &Path) -> Result<Option<File>, PathError> {
    match open_regular(path, false) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.source.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Reads a file of a results folder; `None` if it does not exist.
///
/// # Errors
/// As for `open_own`, and if it cannot be read or is larger than [`Kind::limit`].
pub fn read_own(path: &Path, kind: Kind) -> Result<Option<Vec<u8>>, PathError> {
    let io = PathError::io(path);
    let Some(file) = open_own(path)? else {
        return Ok(None);
    };
    let length = file.metadata().map_err(&io)?.len();
    if length > kind.limit() {
        return Err(io(kind::too_large(kind)));
    }
    let mut bytes = Vec::new();
    bytes
        .try_reserve_exact(length as usize)
        .map_err(|error| io(io::Error::other(error)))?;
    limited(file, kind).read_to_end(&mut bytes).map_err(&io)?;
    Ok(Some(bytes))
}

/// Whether the program's own file of this kind exists.
///
/// # Errors
/// As for [`open_own`], and if it cannot be read.
pub(crate) fn is_own(path: &Path, kind: Kind) -> Result<bool, PathError> {
    match open_own(path)? {
        Some(mut file) => kind.is_own(&mut file).map_err(PathError::io(path)),
        None => Ok(false),
    }
}

/// Whether anything exists at a path, even a broken link.
pub fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// Checks that a file may be written: the path is free, or has an empty file or the program's own of this kind.
///
/// # Errors
/// If it may not, or if the existing file cannot be read.
pub fn replaceable(path: &Path, kind: Kind) -> Result<(), PathError> {
    if is_there(path) && !is_own(path, kind)? {
        return Err(PathError::foreign(path, NOT_OWN));
    }
    Ok(())
}

/// Creates a new file. An existing file is left alone, and a file that could not be written is removed.
///
/// # Errors
/// If the path exists, or the file cannot be written.
pub fn create(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(content).inspect_err(|_| {
        // The first error is the one to report.
        let _ = fs::remove_file(path);
    })
}

/// Removes the program's own file of this kind, if it exists.
///
/// # Errors
/// If it is not the program's own, or cannot be removed.
pub(crate) fn remove(path: &Path, kind: Kind) -> Result<(), PathError> {
    replaceable(path, kind)?;
    remove_file(path)
}

fn remove_file(path: &Path) -> Result<(), PathError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(PathError::io(path)(error)),
        _ => Ok(()),
    }
}

/// Moves one of the program's own files over another of this kind.
///
/// # Errors
/// If what is there is not the program's own, or the file cannot be moved.
pub(crate) fn move_over(from: &Path, to: &Path, kind: Kind) -> Result<(), PathError> {
    replaceable(to, kind)?;
    fs::rename(from, to).map_err(PathError::io(to))
}

/// Renames one of the program's own folders, to a name that is free or has an empty folder.
///
/// # Errors
/// If it cannot be renamed.
pub(crate) fn rename_folder(from: &Path, to: &Path) -> Result<(), PathError> {
    fs::rename(from, to).map_err(PathError::io(to))
}

/// Renames a regular file that is in the way. The new name ends in `.damaged`, with a number if that name is taken.
///
/// # Errors
/// If it is not a regular file, or cannot be renamed.
pub(crate) fn set_aside(path: &Path) -> Result<(), PathError> {
    open_own(path)?;
    let name = |number: u32| {
        let mut name = path.as_os_str().to_owned();
        let number = if number == 0 { String::new() } else { number.to_string() };
        name.push(format!(".damaged{number}"));
        PathBuf::from(name)
    };
    let free = (0..=u32::MAX).map(name).find(|path| !is_there(path));
    let free = free.unwrap_or_else(|| path.to_owned());
    fs::rename(path, free).map_err(PathError::io(path))
}

/// Creates a folder that the user names, with its parents. The folder itself must not be a link.
///
/// # Errors
/// If something else exists there, or it cannot be created.
pub fn make_folder(path: &Path) -> Result<(), PathError> {
    // Without a trailing slash, which would follow a link.
    let bare: PathBuf = path.components().collect();
    if real_folder(&bare)? {
        return Ok(());
    }
    fs::create_dir_all(&bare).map_err(PathError::io(path))
}

/// Whether a real folder exists at a path, not a link to one.
fn real_folder(path: &Path) -> Result<bool, PathError> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_dir() => Ok(true),
        Ok(metadata) => {
            let what = irregularity(&metadata).unwrap_or("a file");
            Err(PathError::foreign(path, &format!("not a folder but {what}")))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(PathError::io(path)(error)),
    }
}

/// A folder inside the program's own; `None` if it does not exist.
///
/// # Errors
/// If it is a link or something else.
pub fn subfolder(folder: &Path, name: &str) -> Result<Option<PathBuf>, PathError> {
    let path = folder.join(name);
    Ok(real_folder(&path)?.then_some(path))
}

/// Returns a folder inside the program's own, and creates it if needed.
///
/// # Errors
/// As for [`subfolder`], and if it cannot be created.
pub fn make_subfolder(folder: &Path, name: &str) -> Result<PathBuf, PathError> {
    let path = folder.join(name);
    if !real_folder(&path)? {
        fs::create_dir(&path).map_err(PathError::io(&path))?;
    }
    Ok(path)
}

/// Creates a folder in an existing one; returns false if the name is taken.
///
/// # Errors
/// If it cannot be created.
pub(crate) fn make_new_subfolder(path: &Path) -> Result<bool, PathError> {
    match fs::create_dir(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(PathError::io(path)(error)),
    }
}

/// Returns the real folders beside a folder, in the same parent and in order; none where that cannot be read.
pub(crate) fn beside(folder: &Path) -> Vec<PathBuf> {
    let own = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    let there = own.parent().and_then(|parent| entries(parent).ok());
    let [_, folders, _] = there.unwrap_or_default();
    folders.into_iter().filter(|other| *other != own).collect()
}

/// The content of a folder: its files, its subfolders, and what is neither, such as links.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn entries(folder: &Path) -> Result<[Vec<PathBuf>; 3], PathError> {
    let io = PathError::io(folder);
    let (mut found, mut folders, mut others) = (Vec::new(), Vec::new(), Vec::new());
    for entry in fs::read_dir(folder).map_err(&io)? {
        let entry = entry.map_err(&io)?;
        let kind = entry.file_type().map_err(&io)?;
        if kind.is_dir() {
            folders.push(entry.path());
        } else if kind.is_file() {
            found.push(entry.path());
        } else {
            others.push(entry.path());
        }
    }
    folders.sort();
    others.sort();
    Ok([found, folders, others])
}

/// Removes a folder if it is empty.
///
/// # Errors
/// If it cannot be removed.
pub(crate) fn remove_empty(folder: &Path) -> Result<(), PathError> {
    match fs::remove_dir(folder) {
        Err(error) if error.kind() != io::ErrorKind::DirectoryNotEmpty => Err(PathError::io(folder)(error)),
        _ => Ok(()),
    }
}

/// The paths of all entries of a folder.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn list(folder: &Path) -> Result<Vec<PathBuf>, PathError> {
    let entries = fs::read_dir(folder).map_err(PathError::io(folder))?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    paths.collect::<io::Result<_>>().map_err(PathError::io(folder))
}

/// Opens the file of a lock, which stays empty, and creates it if needed.
///
/// # Errors
/// If something else exists there, or it cannot be created.
pub(crate) fn open_lock(path: &Path) -> Result<File, PathError> {
    if is_there(path) {
        open_regular(path, false)?;
    }
    let mut options = OpenOptions::new();
    let lock = at_once(options.create(true).append(true), false).open(path);
    lock.map_err(PathError::io(path))
}
