//! Named pipes in a private folder, between the program and a worker.

use super::PathError;
use rustix::fs::{CWD, FlockOperation, Mode, OFlags, flock, fstat, mkfifoat, open};
use rustix::io::Errno;
use rustix::pipe::fcntl_setpipe_size;
use rustix::process::getuid;
use std::ffi::OsString;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that a pipe holds: what Linux allows every user by default.
const ROOM: usize = 1 << 20;

/// How the name of a folder of pipes begins.
const NAME: &str = "asobench-";

/// A folder with two named pipes that only this user may enter. Dropping it removes both pipes and the folder.
#[derive(Debug)]
pub struct Pipes {
    folder: PathBuf,
    /// The folder, locked: one without a lock is that of a process that was killed. `None` where the file system has no
    /// locks.
    _lock: Option<OwnedFd>,
}

impl Pipes {
    /// Creates folder and pipes, in the folder for temporary files.
    ///
    /// # Errors
    /// If they cannot be created.
    pub fn new() -> Result<Self, PathError> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        // The folder for temporary files may be given as a relative path, but workers run elsewhere.
        let place = std::path::absolute(temporary());
        let place = place.map_err(PathError::io(Path::new("TMPDIR")))?;
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let folder = place.join(format!("{NAME}{}-{number}", std::process::id()));
            match DirBuilder::new().mode(0o700).create(&folder) {
                Ok(()) => {
                    let lock = match lock(&folder) {
                        // Another process that removes what was left was faster.
                        Err(Errno::NOENT | Errno::WOULDBLOCK) => continue,
                        other => other.ok(),
                    };
                    let pipes = Self { folder, _lock: lock };
                    for path in [pipes.requests(), pipes.replies()] {
                        let made = mkfifoat(CWD, &path, Mode::RUSR | Mode::WUSR);
                        made.map_err(|error| PathError::io(&path)(error.into()))?;
                    }
                    return Ok(pipes);
                }
                // A folder left by a killed process with the same process id.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(PathError::io(&folder)(error)),
            }
        }
    }

    /// Removes what killed processes of this user left in the folder for temporary files: a folder named like one of
    /// these, with only pipes named like these, that no process has locked. A folder that cannot be removed stays.
    pub fn remove_left() {
        let Ok(entries) = fs::read_dir(temporary()) else {
            return;
        };
        for folder in entries.flatten().map(|entry| entry.path()) {
            let is_own = owner(&folder).is_some()
                && fs::symlink_metadata(&folder).is_ok_and(|metadata| {
                    metadata.is_dir() && metadata.uid() == getuid().as_raw() && metadata.mode() & 0o777 == 0o700
                });
            if !is_own {
                continue;
            }
            let Ok(_lock) = lock(&folder) else { continue };
            let Ok(inside) = super::list(&folder) else {
                continue;
            };
            let is_pipe = |path: &PathBuf| {
                ["requests", "replies"].iter().any(|name| path.ends_with(name))
                    && fs::symlink_metadata(path).is_ok_and(|of| of.file_type().is_fifo())
            };
            if inside.iter().all(is_pipe) {
                remove(&folder);
            }
        }
    }

    /// Returns the mark of the processes that use these pipes. `printed` are our ends of the pipes that they print to.
    pub fn mark(&self, printed: &[impl AsFd]) -> Mark {
        Mark {
            folder: self.folder.clone(),
            printed: printed.iter().filter_map(|end| Some(fstat(end).ok()?.st_ino)).collect(),
        }
    }

    /// The pipe to the worker.
    pub fn requests(&self) -> PathBuf {
        self.folder.join("requests")
    }

    /// The pipe from the worker.
    pub fn replies(&self) -> PathBuf {
        self.folder.join("replies")
    }

    /// Opens the end that replies are read from; does not block.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open_replies(&self) -> io::Result<File> {
        at_once(OpenOptions::new().read(true)).open(self.replies()).map(widened)
    }

    /// Opens the end that requests are written to; `None` until the worker has opened the other end.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open_requests(&self) -> io::Result<Option<File>> {
        match at_once(OpenOptions::new().write(true)).open(self.requests()) {
            Ok(file) => Ok(Some(widened(file))),
            Err(error) if error.raw_os_error() == Some(Errno::NXIO.raw_os_error()) => Ok(None),
            Err(error) => Err(error),
        }
    }
}

/// Gives a pipe room for a message of some hundred records, so that the processes wake each other less often.
fn widened(pipe: File) -> File {
    // Smaller where the system allows less.
    let _ = fcntl_setpipe_size(&pipe, ROOM);
    pipe
}

fn at_once(options: &mut OpenOptions) -> &mut OpenOptions {
    options.custom_flags(OFlags::NONBLOCK.bits().cast_signed())
}

impl Drop for Pipes {
    fn drop(&mut self) {
        remove(&self.folder);
    }
}

/// Removes pipes and their folder.
fn remove(folder: &Path) {
    // A failure here cannot be handled.
    for name in ["requests", "replies"] {
        let _ = fs::remove_file(folder.join(name));
    }
    let _ = fs::remove_dir(folder);
}

/// Locks a folder, which must not be a link, until the returned file is closed. No worker inherits it.
fn lock(folder: &Path) -> rustix::io::Result<OwnedFd> {
    let flags = OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let opened = open(folder, flags, Mode::empty())?;
    flock(&opened, FlockOperation::NonBlockingLockExclusive)?;
    Ok(opened)
}

/// The process that made a folder of pipes, by the name of the folder.
fn owner(folder: &Path) -> Option<u32> {
    let name = folder.file_name()?.to_str()?.strip_prefix(NAME)?;
    let (process, number) = name.split_once('-')?;
    let whole = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    (whole(process) && number.parse::<u64>().is_ok() && whole(number)).then(|| process.parse().ok())?
}

/// Returns the folder for temporary files: `TMPDIR`, unless it is not set or empty.
fn temporary() -> PathBuf {
    let named = std::env::var_os("TMPDIR").filter(|name| !name.is_empty());
    named.map_or_else(|| PathBuf::from("/tmp"), PathBuf::from)
}

/// The mark of every process started by a worker, inherited in any process group or session: the folder of its pipes
/// in the environment, and open files to write to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mark {
    folder: PathBuf,
    /// The inodes of those that are pipes.
    printed: Vec<u64>,
}

impl std::fmt::Display for Mark {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // In hexadecimal digits, since a path may have any byte, such as a line end.
        let printed: Vec<String> = self.printed.iter().map(u64::to_string).collect();
        write!(f, "{} ", printed.join(","))?;
        let mut bytes = self.folder.as_os_str().as_bytes().iter();
        bytes.try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl Mark {
    /// Parses the output of [`Display`](std::fmt::Display); `None` for anything else. A mark that says too little would
    /// be that of other processes.
    pub fn read(text: &str) -> Option<Self> {
        let (printed, folder) = text.split_once(' ')?;
        let printed = match printed {
            "" => Vec::new(),
            list => list
                .split(',')
                .map(|number| number.parse().ok())
                .collect::<Option<_>>()?,
        };
        let digits = folder.as_bytes().chunks(2).map(|pair| {
            let pair = std::str::from_utf8(pair).ok().filter(|_| pair.len() == 2)?;
            u8::from_str_radix(pair, 16).ok()
        });
        let folder = PathBuf::from(OsString::from_vec(digits.collect::<Option<_>>()?));
        let is_own = owner(&folder).is_some() && folder.is_absolute();
        is_own.then_some(Self { folder, printed })
    }

    /// The folder of the pipes; it is different for every mark.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The processes that have this mark.
    pub fn processes(&self) -> Vec<i32> {
        let Ok(entries) = fs::read_dir("/proc") else {
            return Vec::new();
        };
        let numbers = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
        numbers.filter(|number| self.is_of(*number)).collect()
    }

    /// Whether a process has this mark.
    pub fn is_of(&self, number: i32) -> bool {
        let process = PathBuf::from(format!("/proc/{number}"));
        self.is_around(&process) || self.is_open(&process)
    }

    fn is_around(&self, process: &Path) -> bool {
        let surroundings = fs::read(process.join("environ")).unwrap_or_default();
        let text = self.folder.as_os_str().as_bytes();
        surroundings
            .windows(text.len() + 1)
            .any(|part| part.starts_with(text) && part.ends_with(b"/"))
    }

    /// Whether a process can write to one of the pipes that lead here. This process and a child that it is starting
    /// cannot.
    fn is_open(&self, process: &Path) -> bool {
        let Ok(files) = fs::read_dir(process.join("fd")) else {
            return false;
        };
        let replies = self.folder.join("replies");
        let replies = replies.as_os_str().as_bytes();
        let pipes = self.printed.iter().map(|pipe| format!("pipe:[{pipe}]"));
        let pipes: Vec<String> = pipes.collect();
        files.flatten().any(|file| {
            // A file that cannot be read is not known to be one of these.
            let Ok(link) = fs::read_link(file.path()) else {
                return false;
            };
            let name = link.as_os_str().as_bytes();
            let rest = name.strip_prefix(replies);
            let is_own = rest.is_some_and(|rest| rest.is_empty() || rest == b" (deleted)")
                || pipes.iter().any(|pipe| name == pipe.as_bytes());
            let writes = |of: fs::Metadata| of.permissions().mode() & 0o200 != 0;
            is_own && file.metadata().is_ok_and(writes)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(folder: &str, printed: &[u64]) -> Mark {
        Mark {
            folder: folder.into(),
            printed: printed.to_vec(),
        }
    }

    #[test]
    fn marks_are_read_as_they_were_written() {
        for mark in [
            mark("/tmp/asobench-7-0", &[]),
            mark("/tmp/a\nb /\u{e9}/asobench-7-12", &[1]),
            mark("/asobench-1-1", &[12, u64::MAX]),
        ] {
            let text = mark.to_string();
            assert!(!text.contains('\n'));
            assert_eq!(Mark::read(&text), Some(mark));
        }
        let other = mark("/tmp/asobench-7", &[]).to_string();
        for text in ["", " ", "1", ",, 2f61", " 2", "x 2f", " 2f", &other] {
            assert_eq!(Mark::read(text), None, "{text:?}");
        }
    }

    /// A mark without pipes is that of no process, whether its files can be read or not.
    #[test]
    fn a_mark_is_of_nobody_else() {
        let read = Mark::read(&mark("/nowhere/asobench-7-0", &[]).to_string()).unwrap();
        assert!(read.processes().is_empty());
        // A process with a file whose name ends otherwise.
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("asobench-7-1");
        fs::create_dir(&folder).unwrap();
        let _open = File::create(folder.join("replies-of-another")).unwrap();
        let mark = mark(folder.to_str().unwrap(), &[]);
        assert!(!mark.is_open(Path::new("/proc/self")));
        let _open = File::create(folder.join("replies")).unwrap();
        assert!(mark.is_open(Path::new("/proc/self")));
    }

    #[test]
    fn names_of_folders_of_pipes() {
        assert_eq!(owner(Path::new("/tmp/asobench-17-3")), Some(17));
        for name in [
            "asobench",
            "asobench-17",
            "asobench-17-",
            "asobench--3",
            "asobench-+1-3",
            "asobench-1-3-4",
            "xasobench-1-3",
        ] {
            assert_eq!(owner(&Path::new("/tmp").join(name)), None, "{name}");
        }
    }
}
