//! Why an option is refused.

/// An error in an option.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", .key.as_ref().map_or_else(String::new, |key| format!("{key}: ")))]
pub struct OptionError {
    /// The option's key; `None` if the message names it.
    pub key: Option<String>,
    /// The mistake and what was expected.
    pub message: String,
}

impl OptionError {
    /// Makes the error of a key.
    pub fn new(key: &str, message: impl Into<String>) -> Self {
        Self {
            key: Some(key.to_owned()),
            message: message.into(),
        }
    }
}
