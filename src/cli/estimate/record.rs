//! Reads the user's records, and says what was recognised in them.

use super::arguments::RecordArguments;
use super::report::Clock;
use crate::cli::error::Error;
use crate::cli::output::note;
use crate::data::csv::{Kept, ReadOptions, Record, RecordError, Table, read_table};
use crate::files::{self, Kind};
use crate::text::shell_word;
use std::borrow::Cow;
use std::path::Path;

/// A record as it is used, and what was recognised in its file.
pub(super) struct Recognised {
    pub(super) record: Record,
    /// The times of the samples, if a column has them.
    pub(super) clock: Option<Clock>,
    /// The form of the file and the names of its columns, where they are not the plain ones.
    pub(super) form: Vec<String>,
}

/// Reads a record without the samples that `--skip` leaves out, and prints a line on what is not plain.
pub(super) fn read(path: &Path, arguments: &RecordArguments) -> Result<Recognised, Error> {
    let file = path.display();
    let bad = |message: String| Error::Input(format!("{file}: {message}"));
    let options = ReadOptions {
        input: arguments.input.clone(),
        output: arguments.output.clone(),
        time: arguments.time.clone(),
        reference: arguments.reference.clone(),
        missing: arguments.missing,
    };
    if let Some(way) = way_from(path) {
        return Err(bad(way.to_owned()));
    }
    let from = files::open_named(path, Kind::Record).map_err(|error| bad(error.to_string()))?;
    let table = if path
        .extension()
        .is_some_and(|own| own.eq_ignore_ascii_case("parquet"))
    {
        read_table(files::ParquetText::open(from).map_err(&bad)?, &options)
    } else {
        read_table(from, &options)
    };
    let table = table.map_err(|error| bad(format!("{error}{}", ways_on(&error))))?;
    let Table {
        mut record,
        times,
        mut form,
        kept,
        like_times,
    } = table;
    form.extend(kept.map(|kept| part(kept, record.y.len())));
    if !form.is_empty() {
        note(&format!("{file}: {}", form.join(", ")));
    }
    if let Some(column) = like_times {
        let column = shell_word(column);
        note(&format!(
            "hint: column {column} has equal steps, as times have: --time {column} tells frequencies and time constants"
        ));
    }
    let (skip, samples) = (arguments.skip, record.y.len());
    if skip >= samples {
        return Err(Error::Input(format!(
            "--skip: {skip} leaves none of the {samples} samples of {file}"
        )));
    }
    record.u.drain(..skip);
    record.y.drain(..skip);
    record.r.drain(..skip.min(record.r.len()));
    let clock = times.map(|[first, step]| Clock {
        start: first + skip as f64 * step,
        step,
    });
    Ok(Recognised {
        record,
        clock,
        form,
    })
}

/// Returns how a record is written as text by the program whose own form the file has.
fn way_from(path: &Path) -> Option<&'static str> {
    let form = path.extension()?.to_str()?.to_lowercase();
    Some(match form.as_str() {
        "xlsx" | "xls" | "ods" => {
            "a spreadsheet; expected CSV or Parquet: save the sheet as \"CSV UTF-8\""
        }
        "mat" => "MATLAB's own form; expected text: save -ascii record.txt z, or writetable",
        "npy" | "npz" | "pkl" | "pickle" => {
            "Python's own form; expected CSV or Parquet: numpy.savetxt, or to_csv and to_parquet of pandas"
        }
        "h5" | "hdf5" | "feather" | "arrow" | "rds" => "expected CSV or Parquet",
        _ => return None,
    })
}

/// Describes the part of a table that is the record.
fn part(kept: Kept, samples: usize) -> String {
    let Kept { lines, rows, parts } = kept;
    format!(
        "the longest run of {parts} without a gap: {samples} of {rows} rows, lines {} to {}",
        lines[0], lines[1]
    )
}

/// Returns what the user may do about a record that is refused.
fn ways_on(error: &RecordError) -> Cow<'static, str> {
    // Of two columns with names of their own, the input commonly stands first.
    if let RecordError::UnknownColumn { column, found, .. } = error
        && let [input, output] = found.split(", ").collect::<Vec<_>>()[..]
        && let [input, output] = [input, output].map(|name| name.trim_matches('\''))
        && input == column
        && !["u", "k", "t", "time"].contains(&output.to_lowercase().as_str())
    {
        let [input, output] = [input, output].map(shell_word);
        return format!("; or --input {input} --output {output}, or the reverse").into();
    }
    let ways = match error {
        RecordError::NoHeader(_)
        | RecordError::UnknownColumn { .. }
        | RecordError::MissingColumn { .. } => {
            "; or --input and --output with a column's name or number"
        }
        RecordError::RepeatedColumn { .. } => {
            "; --input, --output and --time choose one by its number"
        }
        RecordError::Missing { .. } | RecordError::Gap { .. } => {
            "; --missing longest-run takes the longest part without a gap"
        }
        RecordError::Spacing { .. } => {
            "; resample it, take the longest part at equal steps by --missing longest-run, or say --time none --ts \
             SECONDS if the samples were equally spaced and the column is not exact"
        }
        RecordError::ShortRun { .. } => {
            "; resample it, or say --time none --ts SECONDS if the samples were equally spaced and the column is not \
             exact"
        }
        RecordError::NotThere { column, .. } if column == "fixed" || column == "spectrum" => {
            "; what the trials of study-from have is --trial-input"
        }
        _ => "",
    };
    ways.into()
}
