//! The exit codes, and those of each error. 0: done, whatever failed numerically or was refuted.

use super::error::Error;
use std::process::ExitCode;

/// The run itself, or a single estimate, failed.
pub(super) const FAILED: u8 = 1;
/// Bad input.
pub(super) const BAD_INPUT: u8 = 2;
/// Stopped before the end, or trials are missing: the same command resumes.
pub(super) const AGAIN: u8 = 75;
/// A fault of the program, which has said what it is.
pub(super) const PANIC: u8 = 101;
/// Interrupted (Ctrl-C).
pub(super) const INTERRUPTED: u8 = 130;

impl Error {
    pub(super) fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Failed(_) => FAILED,
            Self::Input(_) | Self::Usage(_) => BAD_INPUT,
            Self::Again(_) => AGAIN,
            Self::Interrupted(_) => INTERRUPTED,
            Self::Told(code) => *code,
        })
    }
}
