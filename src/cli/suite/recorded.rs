//! `asobench suite recorded`: recorded data beside the simulated systems.

use super::part::write;
use crate::cli::error::{Error, failed};
use crate::cli::output::print;
use crate::data::csv::read;
use crate::files::{self, Kind};
use crate::report::recorded_tables;
use crate::suite::{Manifest, RecordFits, RecordedFits, Stored, choosing, recorded_entries};
use crate::text::visible;
use std::path::{Path, PathBuf};

/// The results beside the page.
const FITS: &str = "fits.json";

/// Estimate models of recorded data with the methods that choose their order, and print their FIT over samples that
/// they have not seen: an appendix without claims
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Folder with the records
    #[arg(long, value_name = "DIR", default_value = "tests/recorded_data/data")]
    data: PathBuf,
    /// Write the numbers into this folder too
    #[arg(long, value_name = "OUT")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { data, out } = arguments;
    let methods = choosing();
    let mut found = RecordedFits {
        suite: Manifest::read(None)?.edition,
        methods: methods.iter().map(|(name, _)| name.clone()).collect(),
        records: Vec::new(),
    };
    for entry in recorded_entries()? {
        let path = data.join(&entry.file);
        let (about, record) = recorded(&path)?;
        found.records.push(RecordFits::of(&entry, about, record, &methods));
    }
    for table in recorded_tables(&found) {
        print(&(table.table.markdown() + "\n"))?;
    }
    for record in &found.records {
        print(&format!("{}: {}\n", record.file, visible(record.about.join("; "))))?;
    }
    if let Some(out) = out {
        write(out, FITS, &found.text())?;
    }
    Ok(())
}

/// A file's comments about its record, and the record.
fn recorded(path: &Path) -> Result<(Vec<String>, crate::data::csv::Record), Error> {
    let wrong = |error: &dyn std::fmt::Display| {
        let message = "expected a record of the suite's list; --data DIR is their folder";
        Error::Input(format!("{}: {error}; {message}", visible(path.display())))
    };
    let text = files::read_named(path, Kind::Record).map_err(|error| wrong(&error))?;
    let comments = text.lines().map_while(|line| line.strip_prefix("# "));
    let said = |line: &&str| !line.starts_with("rows:") && !line.starts_with("note:");
    let about = comments.filter(said).map(str::to_owned).collect();
    let record = read(text.as_bytes()).map_err(|error| wrong(&error))?;
    if record.y.is_empty() {
        return Err(failed(format!("{}: no samples", visible(path.display()))));
    }
    Ok((about, record))
}
