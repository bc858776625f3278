//! Reads the user's records, and says what was recognised in them.

use super::arguments::RecordArguments;
use crate::cli::error::Error;
use crate::cli::output::note;
use crate::data::csv::{Kept, LikeTimes, ReadOptions, RecordError, Segment, Table};
use crate::files;
use crate::text::shell_word;
use std::borrow::Cow;
use std::path::Path;

/// Returns a record without gaps, as a flag needs it.
pub(super) fn whole(table: Table, path: &Path, flag: &str) -> Result<Table, Error> {
    if table.segments.is_empty() {
        return Ok(table);
    }
    let (path, parts) = (path.display(), table.segments.len());
    Err(Error::Input(format!(
        "{path}: {parts} parts between gaps, but {flag} needs one; expected --missing longest-run, or one \
         model of all parts: asobench estimate with --estimator oe and --order n"
    )))
}

/// Reads a record without the samples that `--skip` leaves out, and prints a line on what is not plain.
pub(super) fn read(path: &Path, arguments: &RecordArguments) -> Result<Table, Error> {
    let file = path.display();
    let bad = |message: String| Error::Input(format!("{file}: {message}"));
    let options = ReadOptions {
        input: arguments.input.clone(),
        output: arguments.output.clone(),
        time: arguments.time.clone(),
        reference: arguments.reference.clone(),
        missing: arguments.missing,
        decimal: arguments.decimal,
        alone: false,
    };
    let table = files::read_record(path, arguments.sheet.as_deref(), &options);
    // Of the input or the output.
    let is_several = |column: &String| {
        let chosen = [&arguments.input, &arguments.output];
        column.contains(',') && chosen.into_iter().flatten().any(|of| of == column)
    };
    let mut table = table.map_err(|error| match error {
        RecordError::NotThere { column, .. } if is_several(&column) => Error::Input(format!(
            "{file}: --{flag} {column}: one {flag}; this program is for single-input single-output systems",
            flag = if arguments.input.as_ref() == Some(&column) {
                "input"
            } else {
                "output"
            }
        )),
        error => bad(format!("{error}{}", ways_on(&error))),
    })?;
    let Table {
        record,
        lines,
        times,
        form,
        kept,
        like_times,
        segments,
    } = &mut table;
    form.extend(kept.take().map(|kept| part(kept, record.y.len())));
    if !segments.is_empty() {
        form.push(format!(
            "{} parts between gaps, {} rows",
            segments.len(),
            record.y.len()
        ));
    }
    if !form.is_empty() {
        note(&format!("{file}: {}", form.join(", ")));
    }
    if let Some(like_times) = like_times.take() {
        note(&of_times(like_times));
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
    lines.drain(..skip.min(lines.len()));
    skip_segments(segments, skip);
    *times = times.map(|[first, step]| [first + skip as f64 * step, step]);
    Ok(table)
}

/// Leaves out the first samples; the lines stay those of the whole part.
fn skip_segments(segments: &mut Vec<Segment>, mut skip: usize) {
    for segment in segments.iter_mut() {
        let left_out = skip.min(segment.samples);
        segment.samples -= left_out;
        skip -= left_out;
    }
    segments.retain(|segment| segment.samples > 0);
}

/// Tells of a column that is not used, but holds times.
fn of_times(LikeTimes { column, gaps }: LikeTimes) -> String {
    let column = shell_word(column);
    let Some((count, line)) = gaps else {
        return format!(
            "hint: column {column} has equal steps, as times have: --time {column} tells frequencies and time constants"
        );
    };
    let steps = match count {
        1 => "a step that is longer than the others".to_owned(),
        _ => format!("{count} steps that are longer than the others, the first"),
    };
    format!(
        "warning: column {column}, which is not used, has {steps} before line {line}: samples are missing, and the \
         model takes them as consecutive; --time {column} --missing equations leaves out what touches a gap, \
         longest-run takes the longest part without one"
    )
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
    // Of two columns with names of their own, perhaps behind one of times, the input commonly stands first.
    if let RecordError::UnknownColumn { column, found, .. } = error {
        let names = found.split(", ").map(|name| name.trim_matches('\''));
        let names: Vec<&str> = names.collect();
        let is_time = |name: &str| {
            let name = name.to_lowercase();
            name.starts_with("zeit") || name.starts_with("time") || name.split(['_', '(', '[', ' ']).next() == Some("t")
        };
        let (time, signals) = match names.as_slice() {
            [time, signals @ ..] if is_time(time) && signals.len() == 2 => (Some(*time), signals),
            all => (None, all),
        };
        if let [input, output] = signals
            && (time == Some(column) || input == column)
            && !["u", "k", "t", "time"].contains(&output.to_lowercase().as_str())
        {
            let time = time.map_or_else(String::new, |time| format!("--time {} ", shell_word(time)));
            let [input, output] = [input, output].map(shell_word);
            return format!("; or {time}--input {input} --output {output}, or the reverse").into();
        }
    }
    let ways = match error {
        RecordError::DataAbove { .. } => "; begin a line that is no row with #",
        RecordError::NoHeader(_) | RecordError::UnknownColumn { .. } | RecordError::MissingColumn { .. } => {
            "; or --input and --output with a column's name or number"
        }
        RecordError::RepeatedColumn { .. } => "; --input, --output and --time choose one by its number",
        RecordError::Missing { .. } | RecordError::Gap { .. } => {
            "; --missing longest-run takes the longest part without a gap, --missing equations leaves out the \
             equations that touch one"
        }
        RecordError::Thousands { .. } | RecordError::MixedDecimals { .. } => {
            "; --decimal point or --decimal comma says which mark separates decimals"
        }
        RecordError::Time { .. } | RecordError::AmbiguousTimes { .. } => {
            "; --time none --ts SECONDS, if the samples are equally spaced"
        }
        // Without its times such a record would be estimated backwards.
        RecordError::Spacing { falls: true, .. } => {
            "; turn the rows round, and resample them or take the longest part at equal steps by --missing longest-run"
        }
        RecordError::Spacing { found, first, .. } if found * first <= 0.0 => {
            "; sort the rows by time, or take the longest part at equal steps by --missing longest-run"
        }
        RecordError::Falling(_) => "; --time with its name turns the rows round, --time none takes them as they stand",
        RecordError::Spacing { .. } => {
            "; resample it, take the longest part at equal steps by --missing longest-run, or say --time none --ts \
             SECONDS if the samples were equally spaced and the column is not exact"
        }
        RecordError::ShortRun { .. } => {
            "; resample it, or say --time none --ts SECONDS if the samples were equally spaced and the column is not \
             exact"
        }
        RecordError::NotThere { column, .. } if column == "fixed" || column == "spectrum" => {
            "; --trial-input sets the input of the trials of study-from"
        }
        _ => "",
    };
    ways.into()
}
