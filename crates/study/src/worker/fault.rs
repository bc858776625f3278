//! Why a process gives no answer.

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No answer in time; the text says what arrived instead.
    Timeout(String),
    /// The process ended or closed a pipe; the text says how.
    Crashed(String),
    /// The answer violates the protocol.
    Malformed(String),
    /// The run must stop.
    Stopped,
}
