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
    use crate::worker::message::{Answer, Awaited};
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    /// Settings to start a process with.
    pub struct Start<'a> {
        pub command: &'a [String],
        pub folder: &'a Path,
        pub guard: Option<Arc<Guard>>,
        pub log: &'a Log,
    }

    /// A process cannot exist here.
    pub enum Process {}

    impl Process {
        /// Returns an error.
        pub fn start(_of: &Start<'_>) -> Result<Self, String> {
            Err("methods that are external programs need Linux".to_owned())
        }

        /// Never called.
        pub fn is_clean(&mut self) -> bool {
            match *self {}
        }

        /// Never called.
        pub fn ask(
            &mut self,
            _message: &[u8],
            _awaited: Awaited,
            _time: Duration,
            _stop: &AtomicBool,
        ) -> Result<Answer, Fault> {
            match *self {}
        }

        /// Never called.
        pub fn end(self) {
            match self {}
        }
    }
}
