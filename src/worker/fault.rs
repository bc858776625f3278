//! Why a process gives no answer.

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// None in time, and what came instead.
    Timeout(String),
    /// The process ended or closed a pipe: how.
    Crashed(String),
    /// None by the protocol.
    Malformed(String),
    /// The run is to stop.
    Stopped,
}
