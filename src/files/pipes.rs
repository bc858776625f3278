//! Named pipes in a private folder, between the program and a worker.

use super::PathError;
use rustix::fs::{CWD, Mode, OFlags, fstat, mkfifoat};
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io;
use std::os::fd::AsFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A folder with two named pipes that only this user may enter. Dropping it removes both pipes and the folder.
#[derive(Debug)]
pub struct Pipes {
    folder: PathBuf,
}

impl Pipes {
    /// Creates folder and pipes, in the folder for temporary files.
    ///
    /// # Errors
    /// If they cannot be created.
    pub fn new() -> Result<Self, PathError> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let place = std::env::temp_dir();
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let name = format!("asobench-{}-{number}", std::process::id());
            let folder = place.join(name);
            match DirBuilder::new().mode(0o700).create(&folder) {
                Ok(()) => {
                    let pipes = Self { folder };
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

    /// Returns the mark of the processes that use these pipes. `printed` are our ends of the pipes that they print to.
    pub fn mark(&self, printed: &[impl AsFd]) -> Mark {
        let number = |end| Some(format!("pipe:[{}]", fstat(end).ok()?.st_ino));
        Mark {
            folder: self.folder.clone(),
            printed: printed.iter().filter_map(number).collect(),
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
        at_once(OpenOptions::new().read(true)).open(self.replies())
    }

    /// Opens the end that requests are written to; `None` until the worker has opened the other end.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open_requests(&self) -> io::Result<Option<File>> {
        match at_once(OpenOptions::new().write(true)).open(self.requests()) {
            Ok(file) => Ok(Some(file)),
            Err(error) if error.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) => {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

fn at_once(options: &mut OpenOptions) -> &mut OpenOptions {
    options.custom_flags(OFlags::NONBLOCK.bits().cast_signed())
}

impl Drop for Pipes {
    fn drop(&mut self) {
        // A failure here cannot be handled.
        for path in [self.requests(), self.replies()] {
            let _ = fs::remove_file(path);
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

/// What every process started by a worker inherits, in any process group or session: the folder of its pipes in the
/// environment, and open files to write to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mark {
    folder: PathBuf,
    printed: Vec<String>,
}

impl std::fmt::Display for Mark {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.printed.join(","), self.folder.display())
    }
}

impl Mark {
    /// Parses the output of [`Display`](std::fmt::Display).
    pub fn read(text: &str) -> Option<Self> {
        let (printed, folder) = text.split_once(' ')?;
        Some(Self {
            folder: PathBuf::from(folder),
            printed: printed.split(',').map(str::to_owned).collect(),
        })
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
        let Ok(open) = fs::read_dir(process.join("fd")) else {
            return false;
        };
        let replies = self.folder.join("replies");
        open.flatten().any(|file| {
            let link = fs::read_link(file.path()).unwrap_or_default();
            // The name of a removed file is followed by " (deleted)".
            let name = link.as_os_str().as_bytes();
            let is_own = name.starts_with(replies.as_os_str().as_bytes())
                || self.printed.iter().any(|pipe| name == pipe.as_bytes());
            let writes = |of: fs::Metadata| of.permissions().mode() & 0o200 != 0;
            is_own && file.metadata().is_ok_and(writes)
        })
    }
}
