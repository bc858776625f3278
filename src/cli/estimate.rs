//! `asobench estimate`: the twelve stages on a user's own record.

use super::error::Error;
use super::exit_code::FAILED;
use super::files::check_output;
use super::output::{note, show};
use crate::estimator::EstimatorName;
use crate::files::Kind;
use crate::observer::Gain;
use arguments::refuse;
use load::load;
use one_estimator::estimate;
use orders::{orders, ranges};
use outputs::{write_drawings, write_states};
use report::Report;
use scan::StartChoice;
use serde_json::json;
use span::Span;

mod arguments;
mod comparison;
mod drawing;
mod flags;
mod hints;
mod json;
mod levels;
mod load;
pub(super) mod observe;
mod one_estimator;
mod orders;
mod outputs;
mod page;
mod panel;
mod pictures;
mod record;
mod report;
mod scan;
mod several;
mod span;
pub(super) mod study_from;
mod text;
mod unit;
mod words;

pub(super) use arguments::{Arguments, estimator};

pub(super) fn run(mut arguments: Arguments) -> Result<(), Error> {
    if panel::is_asked(&arguments) {
        return panel::run(arguments);
    }
    let is_chosen = !arguments.estimator.is_empty();
    orders::understand(&mut arguments)?;
    let arguments = &arguments;
    check_output("--states", arguments.states.as_deref(), Kind::States)?;
    for drawing in &arguments.plot {
        check_output("--plot", Some(&drawing.path), Kind::Figure)?;
    }
    check_output("--report", arguments.report.as_deref(), Kind::Page)?;
    let orders = orders(arguments)?;
    let first = record::read(&arguments.record.file, &arguments.record)?;
    let is_one = arguments.more.is_empty() && first.segments.is_empty();
    let mut report = if is_one {
        load(arguments, orders, first)?
    } else {
        several::load(arguments, orders, first)?
    };
    if let Some(ranges) = ranges(arguments) {
        return tables(arguments, report, ranges);
    }
    for (i, name) in arguments.estimator.iter().enumerate() {
        if !arguments.estimator[..i].contains(name) {
            let estimate = estimate(arguments, *name, &report)?;
            report.estimates.push(estimate);
        }
    }
    report.tell_in_unit_of_file();
    warn(&report, &arguments.estimator);
    let left_out = arguments.options.left_out(&arguments.estimator);
    for (flag, without) in left_out.iter().filter(|_| is_chosen) {
        let names: Vec<&str> = without.iter().map(|name| name.name()).collect();
        note(&format!(
            "note: {flag} is no option of {}: estimated without it",
            names.join(", ")
        ));
    }
    if let Some(path) = &arguments.states {
        write_states(path, &report)?;
    }
    write_drawings(
        arguments,
        |kind| drawing::picture(kind, &report),
        || page::of_models(&report).html(),
    )?;
    let text = || text::render(&report, arguments.details || !is_chosen);
    show(arguments.format, text, || json::render(&report))?;
    let failed = report
        .estimates
        .iter()
        .any(|estimate| estimate.failure().is_some_and(|of| !of.kind.leaves_a_model()));
    if failed { Err(Error::Told(FAILED)) } else { Ok(()) }
}

/// Prints a table of models of several orders for each estimator.
fn tables(arguments: &Arguments, mut report: Report, (order, delay): (Span, Span)) -> Result<(), Error> {
    let estimators = orders::of_tables(&arguments.estimator)?;
    let (mut scans, mut hints) = (Vec::new(), Vec::new());
    for &estimator in &estimators {
        let options = arguments.options.taken_by(estimator);
        let start = if arguments.options.start_is_free(estimator) {
            StartChoice::Free
        } else {
            StartChoice::Given
        };
        let ends = false;
        let ranges = scan::Ranges { order, delay, ends };
        let (scan, hint) = scan::scan_from_start(&report, (estimator, options), ranges, start)?;
        if let Some(reason) = scan.refused() {
            return Err(Error::Input(reason.to_owned()));
        }
        scans.push(scan);
        hints.push(hint);
    }
    let one = match scans.as_slice() {
        [one] => Some(one),
        _ => None,
    };
    if one.is_none() {
        let [plot, page, _] = arguments.drawn();
        refuse(&[plot, page], "of a range of orders with one estimator; expected one")?;
    }
    report.tell_in_unit_of_file();
    hints::warn_of_offset(&report, &estimators);
    if let Some(scan) = one {
        let about = "criteria and FIT over the order";
        let picture = |_| Ok((scan.picture(), about.to_owned()));
        write_drawings(arguments, picture, || scan.page(&report))?;
    }
    let text = || {
        let texts = scans.iter().zip(&hints);
        let texts = texts.map(|(scan, hint)| scan.text(&report, hint.as_deref()));
        texts.collect::<Vec<String>>().join("\n")
    };
    show(arguments.format, text, || match one {
        Some(scan) => scan.json(&report),
        None => json!({ "tables": scans.iter().map(|scan| scan.json(&report)).collect::<Vec<_>>() }),
    })
}

/// Prints warnings to standard error, one line each.
fn warn(report: &Report, methods: &[EstimatorName]) {
    hints::warn_of_offset(report, methods);
    if report.gain.places_unstable_pole() {
        note(&format!(
            "warning: --gain {} has a pole on or outside the unit circle",
            report.gain
        ));
    }
    for estimate in &report.estimates {
        let last = estimate.last();
        if last.fitted.pass.unstable {
            note(&format!(
                "warning: {}: A-hat has a pole on or outside the unit circle",
                estimate.name
            ));
        }
        if let Some(sentence) = words::unfinished(estimate) {
            note(&format!("warning: {}: {sentence}", estimate.name));
        }
        if let (Gain::Scaled(rho), Some(pole)) = (&report.gain, last.precision.as_ref().and_then(|of| of.poles.first()))
            && rho.abs() * pole.at.norm() >= 1.0
        {
            note(&format!(
                "warning: {}: --gain {} leaves a pole on or outside the unit circle",
                estimate.name, report.gain
            ));
        }
    }
}
