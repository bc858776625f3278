//! Files that `asobench estimate` writes: states, pictures, pages.

use super::arguments::Arguments;
use super::drawing::{self, Drawing};
use super::report::Report;
use crate::cli::error::Error;
use crate::cli::files::{drawn, write_whole};
use crate::cli::output::note;
use crate::data::csv;
use crate::files::Kind;
use crate::report::plot::Picture;
use std::io::Write as _;
use std::path::Path;

/// Writes the pictures and the page that were requested, and says what was written.
pub(super) fn write_drawings(
    arguments: &Arguments,
    picture: impl Fn(drawing::Kind) -> Result<(Picture, String), String>,
    page: impl FnOnce() -> String,
) -> Result<(), Error> {
    for Drawing { kind, path } in &arguments.plot {
        let (picture, about) = picture(*kind).map_err(|message| Error::Input(format!("--plot {kind}: {message}")))?;
        write_picture(path, &picture, &about)?;
    }
    match &arguments.report {
        Some(path) => write_page(path, &page()),
        None => Ok(()),
    }
}

/// Says what was written.
pub(super) fn wrote(path: &Path, about: &str) {
    note(&format!("wrote {}: {about}", path.display()));
}

/// Writes a picture, and says so.
pub(super) fn write_picture(path: &Path, picture: &Picture, about: &str) -> Result<(), Error> {
    let content = drawn("--plot", path, &picture.wide)?;
    write_whole("--plot", path, Kind::Figure, |to| to.write_all(&content))?;
    wrote(path, about);
    Ok(())
}

/// Writes a page, and says so.
pub(super) fn write_page(path: &Path, page: &str) -> Result<(), Error> {
    write_whole("--report", path, Kind::Page, |to| to.write_all(page.as_bytes()))?;
    wrote(path, "a page, for a browser");
    Ok(())
}

/// Writes the last estimator's observer states, k = 0 ... K, if they are known.
pub(super) fn write_states(path: &Path, report: &Report) -> Result<(), Error> {
    let last = report
        .estimates
        .last()
        .and_then(|last| Some((last.name, last.observer.as_ref()?)));
    let Some((name, observer)) = last else {
        note(&format!(
            "warning: --states {}: not written, there is no observer",
            path.display()
        ));
        return Ok(());
    };
    let n = observer.g.len();
    let samples = (0..observer.states.len() / n).map(|k| k as f64);
    let mut columns = vec![("k".to_owned(), samples.collect())];
    columns.extend(state_columns(&observer.states, n, ""));
    let about = format!("observer {name}, gain {}", report.gain);
    write_csv("--states", path, &about, report, &columns)
}

/// A column of numbers, with its name.
pub(super) type Column = (String, Vec<f64>);

/// The columns of n states, or of something else that each state has.
pub(super) fn state_columns(values: &[f64], n: usize, what: &str) -> Vec<Column> {
    let states = if values.is_empty() { 0..0 } else { 0..n };
    let column = |i: usize| values.iter().skip(i).step_by(n).copied().collect();
    states.map(|i| (format!("x{}{what}", i + 1), column(i))).collect()
}

/// Writes columns of equal lengths below a comment; NaN is an empty cell.
pub(super) fn write_csv(
    flag: &str,
    path: &Path,
    about: &str,
    report: &Report,
    columns: &[Column],
) -> Result<(), Error> {
    write_whole(flag, path, Kind::States, |to| {
        let unit = report.unit_in_words().map(|words| format!("; {words}"));
        let comment = about.to_owned() + &unit.unwrap_or_default();
        writeln!(to, "{}", csv::comment(&comment))?;
        let names = columns.iter().map(|(name, _)| csv::Cell::Text(name));
        writeln!(to, "{}", csv::line(names))?;
        for k in 0..columns[0].1.len() {
            let cells = columns.iter().map(|(_, values)| match values[k] {
                value if value.is_nan() => csv::Cell::Text(""),
                value => csv::Cell::Number(value),
            });
            writeln!(to, "{}", csv::line(cells))?;
        }
        Ok(())
    })
}
