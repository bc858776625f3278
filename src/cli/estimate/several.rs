//! Several records of one plant: `asobench estimate a.csv b.csv c.csv`.

use super::arguments::{Arguments, refuse};
use super::load::{check_moves, check_order, clock_of, subtract};
use super::record;
use super::report::{Clock, MOST_EXCITED, Part, Report};
use super::unit::in_own_unit;
use crate::cli::error::{Error, bad_input};
use crate::cli::output::note;
use crate::data::csv::{Record, Table};
use crate::data::{Detrend, Rounding, Trend};
use crate::diagnosis::FeedbackTest;
use crate::estimator::excitation_order;
use crate::model::Orders;
use crate::text::rounded;
use std::path::{Path, PathBuf};

/// Reads the further records, and subtracts from each file its own trend. They follow each other in the report's
/// record, each part between gaps by itself.
pub(super) fn load(arguments: &Arguments, orders: Orders, first: Table) -> Result<Report, Error> {
    let [plot, report, states] = arguments.drawn();
    let window = ("--window", arguments.record.window.is_some());
    let validate = ("--validate", arguments.validate.is_some());
    let why = "is for one record; expected it without further records and without gaps";
    refuse(&[window, validate, plot, report, states], why)?;
    check_order(orders)?;
    let files: Vec<&PathBuf> = [&arguments.record.file].into_iter().chain(&arguments.more).collect();
    let mut all = Record::default();
    let (mut parts, mut clocks, mut form) = (Vec::new(), Vec::new(), Vec::new());
    let (mut first, mut rounding) = (Some(first), Rounding::default());
    for file in &files {
        let mut found = match first.take() {
            Some(first) => first,
            None => record::read(file, &arguments.record)?,
        };
        form.append(&mut found.form);
        clocks.push(clock_of(arguments, found.times)?);
        let own = Rounding::of(&found.record.u, &found.record.y);
        rounding = Rounding {
            u: rounding.u.max(own.u),
            y: rounding.y.max(own.y),
        };
        if arguments.record.detrend == Detrend::Linear && !found.segments.is_empty() {
            return Err(bad_input(
                "--detrend linear: a record with gaps has no line through its samples' numbers; expected mean, first \
                 or none",
            ));
        }
        let samples = found.record.y.len();
        subtract(&arguments.record, &mut found.record, samples, 1.0);
        cut(file, orders, found, &mut parts, &mut all, own)?;
    }
    let clock = same_clock(&files, &clocks)?;
    if !all.r.is_empty() && all.r.len() < all.y.len() {
        return Err(bad_input(
            "--reference: some of the records have a reference and some have none",
        ));
    }
    let (window, first) = (all.y.len(), arguments.record.file.display());
    let excited = parts.iter().scan(0_usize, |start, part: &Part| {
        *start += part.samples;
        Some(excitation_order(&all.u[*start - part.samples..*start], MOST_EXCITED))
    });
    let excitation = excited.max().unwrap_or(0);
    let moves = check_moves(arguments, &all, window);
    let unit = moves.and_then(|()| in_own_unit(&mut all, window));
    let unit = unit.map_err(|message| Error::Input(format!("{first}: {message}")))?;
    Ok(Report {
        file: arguments.record.file.clone(),
        parts,
        form,
        skipped: arguments.record.skip,
        clock,
        hertz: arguments.hz,
        horizon: arguments.horizon,
        validation: None,
        lines: Vec::new(),
        rounding: rounding.divided_by(unit),
        excitation,
        unit,
        window,
        orders,
        detrend: arguments.record.detrend,
        trends: [Trend::default(); 2],
        gain: arguments.gain.clone(),
        feedback: None,
        record: all,
        estimates: Vec::new(),
    })
}

/// Appends the parts of a file between gaps. Those that are too short for an equation are left out, and said.
fn cut(
    file: &Path,
    orders: Orders,
    found: Table,
    parts: &mut Vec<Part>,
    all: &mut Record,
    rounding: Rounding,
) -> Result<(), Error> {
    let Table { record, segments, .. } = found;
    let whole = [(None, record.y.len())];
    let own = segments.iter().map(|of| (Some(of.lines), of.samples));
    let own: Vec<_> = match segments.as_slice() {
        [] => whole.to_vec(),
        _ => own.collect(),
    };
    let least = orders.reach() + 1;
    let (mut start, mut short, mut left_out) = (0, 0, 0);
    for (lines, samples) in own {
        let run = start..start + samples;
        start = run.end;
        if samples < least {
            (short, left_out) = (short + 1, left_out + samples);
            continue;
        }
        let (u, y) = (&record.u[run.clone()], &record.y[run.clone()]);
        parts.push(Part {
            file: file.to_owned(),
            lines,
            samples,
            feedback: FeedbackTest::of(u, y, orders.nk, rounding),
        });
        all.u.extend(u);
        all.y.extend(y);
        all.r.extend(record.r.get(run).unwrap_or_default());
    }
    let file = file.display();
    if left_out == start {
        let between = if segments.is_empty() { "" } else { " without a gap" };
        return Err(Error::Input(format!(
            "{file}: {start} samples are too few for orders {orders}: at least {least}{between} are needed"
        )));
    }
    if short > 0 {
        note(&format!(
            "{file}: {short} of {} parts, with {left_out} rows, are too short for orders {orders} and left out",
            segments.len()
        ));
    }
    Ok(())
}

/// Returns the time between samples, which all records share; the times of the first.
fn same_clock(files: &[&PathBuf], clocks: &[Option<Clock>]) -> Result<Option<Clock>, Error> {
    /// Steps of times that are rounded differ by about this much.
    const AGREES: f64 = 0.01;
    let first = clocks.first().copied().flatten();
    for (file, clock) in files.iter().zip(clocks) {
        let [own, other] = [*clock, first].map(|clock| clock.map(|clock| clock.step));
        let same = match (own, other) {
            (Some(own), Some(other)) => (own - other).abs() <= AGREES * other,
            (own, other) => own.is_none() && other.is_none(),
        };
        if !same {
            let told = |step: Option<f64>| step.map_or("unknown".to_owned(), |step| format!("{} s", rounded(step, 6)));
            return Err(Error::Input(format!(
                "{}: the time between samples is {}, that of {} is {}; expected the same",
                file.display(),
                told(own),
                files[0].display(),
                told(other)
            )));
        }
    }
    Ok(first)
}
