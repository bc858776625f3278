//! Named pipes in a folder of their own, through which a program and its worker talk.

use super::PathError;
use rustix::fs::{CWD, Mode, OFlags, mkfifoat};
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A folder that only this user may enter, with two named pipes; both are removed when this is dropped.
#[derive(Debug)]
pub struct Pipes {
    folder: PathBuf,
}

impl Pipes {
    /// Makes them, in the folder for temporary files.
    ///
    /// # Errors
    /// If they cannot be made.
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
                // A folder that a killed process of this number left.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(PathError::io(&folder)(error)),
            }
        }
    }

    /// What no other process has in its surroundings.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The pipe to the worker.
    pub fn requests(&self) -> PathBuf {
        self.folder.join("requests")
    }

    /// The pipe from the worker.
    pub fn replies(&self) -> PathBuf {
        self.folder.join("replies")
    }

    /// The end that replies are read from; nothing waits.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open_replies(&self) -> io::Result<File> {
        at_once(OpenOptions::new().read(true)).open(self.replies())
    }

    /// The end that requests are written to; `None` as long as the worker has not opened the other.
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
        // Nothing more can be done here.
        for path in [self.requests(), self.replies()] {
            let _ = fs::remove_file(path);
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

/// The processes with this text in their surroundings, whatever group they are in.
pub fn processes_with(text: &Path) -> Vec<i32> {
    let text = text.as_os_str().as_bytes();
    let Ok(entries) = fs::read_dir("/proc") else {
        return Vec::new();
    };
    let numbers = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let has = |number: &i32| {
        let surroundings = fs::read(format!("/proc/{number}/environ")).unwrap_or_default();
        surroundings
            .windows(text.len() + 1)
            .any(|part| part.starts_with(text) && part.ends_with(b"/"))
    };
    numbers.filter(has).collect()
}
