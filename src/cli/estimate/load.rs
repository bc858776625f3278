//! Reads the record of `asobench estimate`, and checks that flags, estimators and record fit each other.

use super::arguments::{Arguments, RecordArguments};
use super::hints;
use super::record;
use super::report::{Clock, MOST_EXCITED, Report, Validation};
use super::unit::in_own_unit;
use crate::cli::error::{Error, bad_input};
use crate::data::csv::{Record, Table};
use crate::data::{Detrend, Rounding, Trend};
use crate::diagnosis::FeedbackTest;
use crate::estimator::{SetupError, excitation_order};
use crate::model::Orders;
use crate::plant::ORDER_LIMIT;
use crate::text::rounded;

/// Checks and detrends a record.
pub(super) fn load(arguments: &Arguments, orders: Orders, table: Table) -> Result<Report, Error> {
    let path = arguments.record.file.display();
    let bad = |message: String| Error::Input(format!("{path}: {message}"));
    let Table {
        mut record,
        lines,
        times,
        form,
        ..
    } = table;
    let clock = clock_of(arguments, times)?;
    let rows = record.y.len();
    // The samples that the equations look back, and one row per parameter.
    let needed = orders.reach().saturating_add(orders.na.saturating_add(orders.nb));
    let asked = if arguments.options.has("orders") {
        format!("orders {orders}")
    } else {
        format!("order {} and delay {}", orders.na, orders.nk)
    };
    if rows < needed {
        return Err(bad(format!(
            "{rows} samples are too few for {asked}: at least {needed} are needed"
        )));
    }
    check_order(orders)?;
    let window = arguments.record.window.map_or(rows, |part| part.of(rows));
    if window > rows {
        return Err(Error::Input(format!(
            "--window: {window} is more than the {rows} samples of {path}"
        )));
    }
    if window < needed {
        return Err(Error::Input(format!(
            "--window: {window} is too short for {asked}: at least {needed} are needed"
        )));
    }
    check_moves(arguments, &record, window).map_err(&bad)?;
    let (u, y) = (&record.u[..window], &record.y[..window]);
    let (rounding, excitation) = (Rounding::of(u, y), excitation_order(u, MOST_EXCITED));
    let unit = in_own_unit(&mut record, window).map_err(&bad)?;
    let rounding = rounding.divided_by(unit);
    let largest = |record: &Record| {
        let columns = [&record.u, &record.y].map(|column| column[..window].iter());
        columns.map(|column| column.fold(0.0_f64, |most, sample| most.max(sample.abs())))
    };
    let before = largest(&record);
    let trends = subtract(&arguments.record, &mut record, window, unit);
    let mut left = largest(&record).into_iter().zip(before);
    if let Some(i) = left.position(|(left, before)| left <= 64.0 * f64::EPSILON * before) {
        let level = arguments.record.operating_point.map(|point| point[i].to_string());
        return Err(bad(format!(
            "column {} is exactly {} over the window; nothing is left to identify from",
            ["u", "y"][i],
            level.unwrap_or_else(|| format!("its {} trend", arguments.record.detrend))
        )));
    }
    let validation = validation(arguments, unit, &trends, needed)?;
    Ok(Report {
        file: arguments.record.file.clone(),
        parts: Vec::new(),
        form,
        skipped: arguments.record.skip,
        clock,
        hertz: arguments.hz,
        horizon: arguments.horizon,
        validation,
        lines,
        rounding,
        excitation,
        unit,
        window,
        orders,
        detrend: arguments.record.detrend,
        trends,
        gain: arguments.gain.clone(),
        feedback: FeedbackTest::of(&record.u[..window], &record.y[..window], orders.nk, rounding),
        record,
        estimates: Vec::new(),
    })
}

/// Subtracts from the signals of a record, which is in this unit, their trends over a window, or the operating point.
pub(super) fn subtract(arguments: &RecordArguments, record: &mut Record, window: usize, unit: f64) -> [Trend; 2] {
    let Record { u, y, r } = record;
    let point = arguments.operating_point;
    let trend_of = |values: &mut Vec<f64>, level: Option<f64>| {
        let own = || Trend::fit(arguments.detrend, &values[..window]);
        let trend = level.map_or_else(own, |level| Trend::constant(level / unit));
        trend.subtract(values);
        trend
    };
    let levels = point.map_or([None; 2], |point| point.map(Some));
    let trends = [trend_of(u, levels[0]), trend_of(y, levels[1])];
    if let Some(of_window) = r.get(..window) {
        // The models have no offset: neither has what drives the loop.
        let detrend = point.map_or(arguments.detrend, |_| Detrend::Mean);
        Trend::fit(detrend, of_window).subtract(r);
    }
    trends
}

/// Refuses an order that no estimator takes.
pub(super) fn check_order(orders: Orders) -> Result<(), Error> {
    if orders.order() > ORDER_LIMIT {
        let error = SetupError::LargeOrder(orders.order());
        return Err(Error::Input(format!("--order: {error}")));
    }
    Ok(())
}

/// Refuses a window in which u or y does not move.
pub(super) fn check_moves(arguments: &Arguments, record: &Record, window: usize) -> Result<(), String> {
    if hints::is_constant(&record.y[..window]) {
        return Err("column y is constant over the window; nothing can be identified from it".to_owned());
    }
    if hints::is_constant(&record.u[..window]) {
        if record.u[0] == 0.0 {
            return Err("column u is zero over the window; nothing can be identified from it".to_owned());
        }
        if !arguments.begins_at_rest() {
            return Err(format!("column u is constant over the window; {}", hints::FROM_REST));
        }
    }
    Ok(())
}

/// Returns the times of the samples: by `--ts`, or by a column of times, with which it must agree.
pub(super) fn clock_of(arguments: &Arguments, times: Option<[f64; 2]>) -> Result<Option<Clock>, Error> {
    // Of times that are rounded, the mean step has an error of about one part in the samples.
    const AGREES: f64 = 0.01;
    let column = times.map(|[start, step]| Clock { start, step });
    let Some(step) = arguments.ts else {
        if arguments.hz && column.is_none() {
            return Err(bad_input(
                "--hz: the time between samples is not known; expected --ts SECONDS or a column of times",
            ));
        }
        return Ok(column);
    };
    match column {
        Some(clock) if (clock.step - step).abs() > AGREES * step => Err(Error::Input(format!(
            "--ts {step}: the column of times has steps of {}; expected the same, or --time none",
            rounded(clock.step, 6)
        ))),
        Some(clock) => Ok(Some(Clock { step, ..clock })),
        None => Ok(Some(Clock {
            start: arguments.record.skip as f64 * step,
            step,
        })),
    }
}

/// Reads the record for validation, in the unit of the other one and less its trend.
fn validation(
    arguments: &Arguments,
    unit: f64,
    trends: &[Trend; 2],
    needed: usize,
) -> Result<Option<Validation>, Error> {
    let Some(path) = &arguments.validate else {
        return Ok(None);
    };
    if arguments.record.detrend == Detrend::Linear {
        return Err(bad_input(
            "--validate: the straight line of one record is not that of another; expected --detrend mean or \
            none",
        ));
    }
    let table = record::read(path, &arguments.record)?;
    let Table { mut record, .. } = record::whole(table, path, "--validate")?;
    let signals = [&mut record.u, &mut record.y];
    for (values, trend) in signals.into_iter().zip(trends) {
        for value in values.iter_mut() {
            *value /= unit;
        }
        trend.subtract(values);
    }
    if record.u.iter().chain(&record.y).any(|value| !value.is_finite()) {
        return Err(Error::Input(format!(
            "{}: samples too large beside those of {}",
            path.display(),
            arguments.record.file.display()
        )));
    }
    if record.y.len() < needed {
        return Err(Error::Input(format!(
            "{}: {} samples are too few to validate a model; at least {needed} are needed",
            path.display(),
            record.y.len()
        )));
    }
    Ok(Some(Validation {
        file: path.clone(),
        record,
    }))
}
