//! The exit codes. 0: done, whatever failed numerically or was refuted.

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
