//! Files that `asobench estimate` writes: states, pictures, pages.

use super::arguments::Arguments;
use super::drawing::{self, Drawing};
use super::report::Report;
use crate::cli::error::Error;
use crate::cli::files::{drawn, write_whole};
use crate::cli::output::note;
use crate::data::csv;
use crate::files::Kind;
use crate::observer::Observer;
use crate::report::plot::Picture;
use std::io::Write as _;
use std::iter;
use std::path::Path;

/// Writes the pictures and the page that were requested, and says what was written.
pub(super) fn write_drawings(
    arguments: &Arguments,
    picture: impl Fn(drawing::Kind) -> Result<(Picture, String), String>,
    page: impl FnOnce() -> String,
) -> Result<(), Error> {
    let write = |flag: &str, path: &Path, kind: Kind, content: &[u8], about: &str| {
        write_whole(flag, path, kind, |to| to.write_all(content))?;
        note(&format!("wrote {}: {about}", path.display()));
        Ok(())
    };
    for Drawing { kind, path } in &arguments.plot {
        let (picture, about) = picture(*kind).map_err(|message| Error::Input(format!("--plot {kind}: {message}")))?;
        let content = drawn("--plot", path, &picture.wide)?;
        write("--plot", path, Kind::Figure, &content, &about)?;
    }
    if let Some(path) = &arguments.report {
        let about = "a page, for a browser";
        write("--report", path, Kind::Page, page().as_bytes(), about)?;
    }
    Ok(())
}

/// Writes the last estimator's observer states, k = 0 ... K, if they are known.
pub(super) fn write_states(path: &Path, report: &Report) -> Result<(), Error> {
    let Some(estimate) = report.estimates.last().filter(|estimate| estimate.observer.is_some()) else {
        note(&format!(
            "warning: --states {}: not written, there is no observer",
            path.display()
        ));
        return Ok(());
    };
    let Some(model) = estimate.last().fitted.pass.observed() else {
        return Ok(());
    };
    let samples = report.shifted(estimate.shift());
    let y = estimate.last().fitted.less_offset(samples.y);
    write_whole("--states", path, Kind::States, |to| {
        let unit = report
            .unit_in_words()
            .map_or_else(String::new, |words| format!("; {words}"));
        let comment = format!("observer {}, gain {}{unit}", estimate.name, report.gain);
        writeln!(to, "{}", csv::comment(&comment))?;
        let states = (1..=model.a.len()).map(|i| format!("x{i}"));
        let names: Vec<String> = iter::once("k".to_owned()).chain(states).collect();
        let names = names.iter().map(|name| csv::Cell::Text(name));
        writeln!(to, "{}", csv::line(names))?;
        let mut row = |k: usize, x: &[f64]| {
            let numbers = iter::once(k as f64).chain(x.iter().copied());
            writeln!(to, "{}", csv::line(numbers.map(csv::Cell::Number)))
        };
        let mut observer = Observer::new(report.gain.clone(), model.a.len());
        let mut written = Ok(());
        let observed = observer.run(model, samples.u, &y, |k, x| {
            if written.is_ok() {
                written = row(k, x);
            }
        });
        written?;
        observed.map_err(|kind| std::io::Error::other(kind.name()))?;
        row(samples.y.len(), observer.state())
    })
}
