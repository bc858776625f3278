//! Libraries that decode files, and may panic.

use std::panic;

/// Calls a library that decodes a file; a panic of it is an error of the file, and says nothing else. The hook is that
/// of the process: nothing else runs while a table is read.
pub(super) fn quietly<T>(work: impl FnOnce() -> Result<T, String>, panicked: &str) -> Result<T, String> {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let done = panic::catch_unwind(panic::AssertUnwindSafe(work));
    panic::set_hook(hook);
    done.unwrap_or_else(|_| Err(panicked.to_owned()))
}
