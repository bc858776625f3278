//! Where there is no Linux: no process is started.

/// The guard of `guard.rs`.
pub mod guard {
    use std::io::{BufRead, Error};
    use std::path::Path;

    /// The subcommand that a guard runs.
    pub const SUBCOMMAND: &str = "guard-workers";

    /// There is none.
    #[derive(Debug)]
    pub enum Guard {}

    impl Guard {
        /// Starts none.
        ///
        /// # Errors
        /// Always.
        pub fn start(_program: &Path) -> std::io::Result<Self> {
            Err(Error::other("methods that are programs need Linux"))
        }
    }

    /// Does nothing.
    pub fn stand(_input: impl BufRead) {}
}

/// The processes of `process.rs`.
pub mod process {
    use super::guard::Guard;
    use crate::worker::fault::Fault;
    use crate::worker::log::Log;
    use crate::worker::message::{Answer, Awaited};
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    /// How a process is started.
    pub struct Start<'a> {
        pub command: &'a [String],
        pub folder: &'a Path,
        pub guard: Option<Arc<Guard>>,
        pub log: &'a Log,
    }

    /// There is none.
    pub enum Process {}

    impl Process {
        /// Starts none.
        pub fn start(_of: &Start<'_>) -> Result<Self, String> {
            Err("methods that are programs need Linux".to_owned())
        }

        /// Of no process.
        pub fn is_clean(&mut self) -> bool {
            match *self {}
        }

        /// Of no process.
        pub fn ask(
            &mut self,
            _message: &[u8],
            _awaited: Awaited,
            _time: Duration,
            _stop: &AtomicBool,
        ) -> Result<Answer, Fault> {
            match *self {}
        }

        /// Of no process.
        pub fn end(self) {
            match self {}
        }
    }
}
