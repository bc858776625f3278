//! Replacements for systems other than Linux: no process is started.

/// Replaces the guard of `guard.rs`.
pub mod guard {
    use std::io::{BufRead, Error};
    use std::path::Path;

    /// The subcommand that runs a guard.
    pub const SUBCOMMAND: &str = "guard-workers";

    /// A guard cannot exist here.
    #[derive(Debug)]
    pub enum Guard {}

    impl Guard {
        /// Returns an error.
        ///
        /// # Errors
        /// Always.
        pub fn start(_program: &Path) -> std::io::Result<Self> {
            Err(Error::other("methods that are external programs need Linux"))
        }
    }

    /// Does nothing.
    pub fn stand(_input: impl BufRead) {}
}

/// Replaces the processes of `process.rs`.
pub mod process {
    use super::guard::Guard;
    use crate::worker::fault::Fault;
    use crate::worker::log::Log;
    use crate::worker::message::Incoming;
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    /// A process cannot exist here.
    pub enum Process {}

    impl Process {
        /// Returns an error.
        pub fn start(
            _command: &[String],
            _folder: &Path,
            _guard: Option<Arc<Guard>>,
            _log: &Log,
        ) -> Result<Self, String> {
            Err("methods that are external programs need Linux".to_owned())
        }

        /// Never called.
        pub fn is_clean(&mut self) -> bool {
            match *self {}
        }

        /// Never called.
        pub fn ask<T>(
            &mut self,
            _message: &[u8],
            _take: impl Fn(&mut Incoming) -> Result<Option<T>, String>,
            _time: Duration,
            _stop: &AtomicBool,
        ) -> Result<T, Fault> {
            match *self {}
        }

        /// Never called.
        pub fn end(self) {
            match self {}
        }
    }
}
