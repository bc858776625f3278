//! Why a process gives no answer.

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// No answer in time; the text says what arrived instead.
    #[error("timeout: {0}")]
    Timeout(String),
    /// The process ended or closed a pipe; the text says how.
    #[error("crashed: {0}")]
    Crashed(String),
    /// The answer violates the protocol.
    #[error("malformed: {0}")]
    Malformed(String),
    /// The run must stop.
    #[error("the run is to stop")]
    Stopped,
}
