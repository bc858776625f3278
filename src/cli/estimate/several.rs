//! Several records of one plant: `asobench estimate a.csv b.csv c.csv`.

use super::arguments::Arguments;
use super::load::{check_moves, check_order, clock_of};
use super::orders::ranges;
use super::record::{self, Recognised};
use super::report::{Clock, Part, Report};
use super::unit::in_own_unit;
use crate::cli::error::Error;
use crate::data::csv::Record;
use crate::data::{Detrend, Trend};
use crate::diagnosis::feedback_p_value;
use crate::model::Orders;
use crate::text::rounded;
use std::path::PathBuf;

/// Refuses the flags of one record.
fn check(arguments: &Arguments) -> Result<(), Error> {
    let of_one = [
        ("--window", arguments.record.window.is_some()),
        ("--validate", arguments.validate.is_some()),
        ("--plot", !arguments.plot.is_empty()),
        ("--report", arguments.report.is_some()),
        ("--states", arguments.states.is_some()),
        ("--order", ranges(arguments).is_some()),
    ];
    match of_one.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some(("--order", _)) => Err(Error::Input(
            "--order: a range compares models of one record; expected one order for several records".to_owned(),
        )),
        Some((flag, _)) => Err(Error::Input(format!(
            "{flag}: is for one record; expected it without further records"
        ))),
    }
}

/// Reads the records, and subtracts from each its own trend. They follow each other in the report's record.
pub(super) fn load(arguments: &Arguments, orders: Orders) -> Result<Report, Error> {
    check(arguments)?;
    check_order(orders)?;
    let files: Vec<&PathBuf> = [&arguments.record.file]
        .into_iter()
        .chain(&arguments.more)
        .collect();
    let mut all = Record {
        u: Vec::new(),
        y: Vec::new(),
        r: Vec::new(),
    };
    let (mut parts, mut clocks, mut form) = (Vec::new(), Vec::new(), Vec::new());
    for file in &files {
        let bad = |message: String| Error::Input(format!("{}: {message}", file.display()));
        let Recognised {
            mut record,
            clock,
            form: own,
        } = record::read(file, &arguments.record)?;
        form.extend(own);
        let (rows, least) = (record.y.len(), orders.reach() + 1);
        if rows < least {
            return Err(bad(format!(
                "{rows} samples are too few for orders {orders}: at least {least} are needed"
            )));
        }
        clocks.push(clock_of(arguments, clock)?);
        let point = arguments.record.operating_point;
        let points = point.map_or([None; 2], |point| point.map(Some));
        for (values, point) in [&mut record.u, &mut record.y].into_iter().zip(points) {
            let own = || Trend::fit(arguments.record.detrend, values);
            point.map_or_else(own, Trend::constant).subtract(values);
        }
        if !record.r.is_empty() {
            let detrend = point.map_or(arguments.record.detrend, |_| Detrend::Mean);
            Trend::fit(detrend, &record.r).subtract(&mut record.r);
        }
        parts.push(Part {
            file: (*file).clone(),
            samples: rows,
            feedback: feedback_p_value(&record.u, &record.y, orders.nk),
        });
        all.u.append(&mut record.u);
        all.y.append(&mut record.y);
        all.r.append(&mut record.r);
    }
    let clock = same_clock(&files, &clocks)?;
    if !all.r.is_empty() && all.r.len() < all.y.len() {
        let message = "--reference: some of the records have a reference and some have none";
        return Err(Error::Input(message.to_owned()));
    }
    let (window, first) = (all.y.len(), arguments.record.file.display());
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
        validation: None,
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
            let told = |step: Option<f64>| {
                step.map_or("unknown".to_owned(), |step| {
                    format!("{} s", rounded(step, 6))
                })
            };
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
