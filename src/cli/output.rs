//! Prints to standard output and standard error: the one place of the program that does.

use super::colour;
use super::error::{Error, failed};
use crate::names::named_enum;
use crate::text::{beginning, visible, visible_json, visible_lines, wrap};
use std::fmt::Display;

named_enum! {
    /// The form of the output.
    Format, "format" {
        /// For people, at most 80 columns.
        Text = "text",
        /// For programs.
        Json = "json",
    }
}

/// The columns of a line.
pub(super) const WIDTH: usize = 80;

/// Returns a paragraph as lines, of which all but the first begin with `indent`.
pub(super) fn wrapped(text: &str, indent: &str) -> String {
    wrap(text, WIDTH, indent)
}

/// Text for people that grows by lines.
#[derive(Default)]
pub(super) struct Lines(pub(super) String);

impl Lines {
    /// Appends text.
    pub(super) fn add(&mut self, text: &str) {
        self.0 += text;
    }

    /// Appends a line.
    pub(super) fn line(&mut self, line: impl Display) {
        self.0 += &line.to_string();
        self.0.push('\n');
    }

    /// Appends a paragraph, as [`wrapped`] makes it.
    pub(super) fn paragraph(&mut self, text: &str, indent: &str) {
        self.0 += &wrapped(text, indent);
    }
}

/// Prints lines to standard output. This, [`print_json`] and [`note`] are the only places that print. They make
/// invisible characters visible, whoever wrote them. Foreign text within a line must pass through [`visible`] before it
/// comes here, so that it cannot end the line.
pub(super) fn print(text: &str) -> Result<(), Error> {
    write_out(&visible_lines(text))
}

/// Prints lines that end with the verdicts on claims, which are coloured if wanted.
pub(super) fn print_with_verdicts(text: &str, verdicts: &str) -> Result<(), Error> {
    write_out(&(visible_lines(text) + &colour::verdicts(&visible_lines(verdicts))))
}

/// Prints JSON to standard output.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(failed)?;
    write_out(&format!("{}\n", visible_json(&text)))
}

/// Prints in the form that was asked for.
pub(super) fn show<T: serde::Serialize>(
    format: Format,
    text: impl FnOnce() -> String,
    json: impl FnOnce() -> T,
) -> Result<(), Error> {
    match format {
        Format::Text => print(&text()),
        Format::Json => print_json(&json()),
    }
}

/// Writes to standard output. If the reader has gone away, this is not an error.
fn write_out(text: &str) -> Result<(), Error> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    match written {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(failed(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Prints one line to standard error; of an overlong text only its beginning. If standard error cannot be written to,
/// nothing can be reported.
pub(super) fn note(line: &str) {
    use std::io::Write;
    const LONGEST: usize = 1000;
    let line = visible(beginning(line, LONGEST));
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Asks a question on a terminal, and returns whether the answer is yes; `None` where there is no terminal to ask on.
pub(super) fn asked(question: &str) -> Result<Option<bool>, Error> {
    use std::io::{IsTerminal, Write, stderr, stdin};
    if !(stdin().is_terminal() && stderr().is_terminal()) {
        return Ok(None);
    }
    write!(stderr(), "{question} [y/N] ").map_err(failed)?;
    let mut line = String::new();
    stdin().read_line(&mut line).map_err(failed)?;
    Ok(Some(matches!(line.trim(), "y" | "Y" | "yes")))
}
