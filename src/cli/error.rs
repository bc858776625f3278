//! Maps every error to a line and an exit code.

use std::process::ExitCode;

/// An error that ends the program early.
#[derive(Debug, thiserror::Error)]
pub(super) enum Error {
    /// Bad input: exit code 2. The line names the file, key or flag and what was expected.
    #[error("{0}")]
    Input(String),
    /// The run itself failed: exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C: exit code 130.
    #[error("{0}")]
    Interrupted(String),
    /// Stopped before the end, or trials are missing, and the same command resumes: exit code 75.
    #[error("{0}")]
    Again(String),
    /// Standard output failed: exit code 1.
    #[error("cannot write to standard output: {0}")]
    Output(std::io::Error),
}

impl Error {
    pub(super) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Failed(_) | Self::Output(_) => ExitCode::from(1),
            Self::Input(_) => ExitCode::from(2),
            Self::Again(_) => ExitCode::from(75),
            Self::Interrupted(_) => ExitCode::from(130),
        }
    }
}

/// Makes the error of a failed run.
pub(super) fn failed(error: impl std::fmt::Display) -> Error {
    Error::Failed(error.to_string())
}

/// Prints help and version if requested; turns a usage error into one line.
pub(super) fn usage(error: &clap::Error) -> Result<ExitCode, Error> {
    use clap::error::ErrorKind;
    let text = error.render().to_string();
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            super::print(&text)?;
            Ok(ExitCode::SUCCESS)
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            for line in text.lines() {
                super::note(line);
            }
            Ok(ExitCode::from(2))
        }
        _ => Err(Error::Input(one_line(&text))),
    }
}

/// Returns the message and its tip, without the usage lines.
fn one_line(text: &str) -> String {
    let ends = ["\nUsage:", "\nFor more information"];
    let end = ends
        .iter()
        .filter_map(|end| text.find(end))
        .min()
        .unwrap_or(text.len());
    let mut line = String::new();
    for part in text[..end]
        .lines()
        .map(str::trim)
        .filter(|part| !part.is_empty())
    {
        match part.strip_prefix("tip: ") {
            Some(tip) => line.extend(["; ", tip]),
            None if line.is_empty() => line.push_str(part.trim_start_matches("error: ")),
            None => line.extend([" ", part]),
        }
    }
    line
}

#[cfg(test)]
mod tests {
    #[test]
    fn usage_errors_become_one_line() {
        let text = "error: unexpected argument '--trails' found\n\n  tip: a similar argument \
                    exists: '--trials'\n\nUsage: asobench reproduce\n\nFor more information, try \
                    '--help'.\n";
        let line = super::one_line(text);
        assert_eq!(
            line,
            "unexpected argument '--trails' found; a similar argument exists: '--trials'"
        );
    }
}
