//! A page about a record and the models estimated from it.

use super::report::{Estimate, Fits, Frequency, PassReport, Report, Validation};
use super::{pictures, words};
use crate::cli::equation::broken;
use crate::diagnosis::{Mode, Precision, Root, Z_95};
use crate::number::measured;
use crate::report::html::{CellText, Column, Page, Section, Table};
use crate::text::{rounded, visible};

/// Significant digits of values without standard errors.
const DIGITS: usize = 6;

/// Begins the page of a record, without its sections about models.
pub(super) fn begin(report: &Report) -> Page {
    let mut page = Page::new(title(report));
    page.introduction(|section| section.settings(&settings(report)));
    page.section("record", "The record", |section| {
        let caption = if report.subtracted().is_none() {
            "Input u and output y as they were read."
        } else {
            "Input u and output y, less what was subtracted."
        };
        section.figure(&pictures::record(report), caption);
    });
    page
}

/// The page of a record and its models.
pub(super) fn of_models(report: &Report) -> Page {
    let mut page = begin(report);
    page.section("outputs", "Measured and simulated output", |section| {
        section.table(&fits(report));
        section.figure(
            &pictures::outputs(report),
            "Above: the measured output, and that of each model under u alone, from its x0. Below: \
             the errors of each model's one-step prediction. An unstable model ends where it \
             leaves the axes.",
        );
    });
    page.section("responses", "Step and frequency response", |section| {
        let without_bands = report.estimates.iter().filter_map(|estimate| {
            let reason = words::no_errors(estimate.last().known_model()?)?;
            Some(format!("`{}` has no bands: {reason}.", estimate.name))
        });
        section.list(&without_bands.collect::<Vec<String>>());
        section.figure(
            &pictures::steps(report),
            "Step response of B/(A F) from rest, with 95 % bands of each sample by the derivatives of \
             the response (delta method). An unstable model has no band, and ends where it leaves the axes.",
        );
        section.figure(
            &pictures::bode(report),
            "Frequency response of B/(A F), with 95 % bands of each frequency by the derivatives of \
             ln |G| and of the phase.",
        );
    });
    for (i, estimate) in report.estimates.iter().enumerate() {
        let name = estimate.name.name();
        page.section(name, &words::heading(estimate), |section| {
            write(section, i + 1, estimate, report);
            if let Some(observer) = &estimate.observer {
                let list = |values: &[f64]| {
                    values
                        .iter()
                        .map(|x| rounded(*x, DIGITS))
                        .collect::<Vec<_>>()
                        .join(", ")
                };
                section.heading("Observer");
                section.settings(&[
                    ("poles", report.gain.to_string()),
                    ("gain g", list(&observer.g)),
                    ("state after the window", list(observer.at_window())),
                    ("last state", list(observer.last())),
                ]);
            }
        });
    }
    page
}

/// Returns the page's title, by which the program recognises the page as its own.
fn title(report: &Report) -> String {
    format!("asobench report: {}", visible(report.name()))
}

fn settings(report: &Report) -> Vec<(&'static str, String)> {
    let [u, y] = &report.trends;
    let samples = report.record.y.len();
    let validation = match (&report.validation, samples - report.window) {
        (Some(Validation { file, record }), _) => {
            format!("{}, {} samples", visible(file.display()), record.y.len())
        }
        (None, 0) => "none".to_owned(),
        (None, rest) => format!("{rest} samples after the window"),
    };
    let subtracted = match (report.subtracted(), report.detrend.is_none()) {
        (None, _) => "nothing".to_owned(),
        (Some(_), true) => format!("--operating-point: {u} from u, {y} from y"),
        (Some(_), false) => format!("--detrend {}: {u} from u, {y} from y", report.detrend),
    };
    let read_as = match report.form.as_slice() {
        [] => "columns u and y".to_owned(),
        form => visible(form.join(", ")),
    };
    let mut settings = vec![
        ("file", visible(report.file.display())),
        ("read as", read_as),
        ("samples", samples.to_string()),
        ("window", format!("{} samples", report.window)),
        ("validation", validation),
        ("subtracted", subtracted),
    ];
    if report.skipped > 0 {
        settings.push(("left out", format!("the first {} samples", report.skipped)));
    }
    if let Some(clock) = report.clock {
        settings.push(("sampling", format!("{} s between samples", rounded(clock.step, 6))));
    }
    settings.extend(report.unit_in_words().map(|words| ("unit", words)));
    settings
}

/// Writes the section of one estimator.
fn write(section: &mut Section, slot: usize, estimate: &Estimate, report: &Report) {
    let last = estimate.last();
    match words::status(estimate, report) {
        Some(Ok(status)) => section.paragraph(&format!("Status {status}.")),
        Some(Err(failed)) => section.paragraph(&format!("Failed: {failed}.")),
        None => {}
    }
    for hint in &estimate.hints {
        section.paragraph(&format!("{}.", words::capitalised(hint)));
    }
    let Some(model) = last.known_model() else {
        return;
    };
    let equation = model.equation(Some(DIGITS));
    let lines = equation.lines().map(|line| broken(line, 0, 4));
    section.code(&lines.collect::<Vec<String>>().join("\n"));
    if last.fitted.pass.unstable {
        section.paragraph("The model has a pole on or outside of the unit circle: it is unstable.");
    }
    section.table(&parameters(last));
    if let Some(reason) = words::no_errors(model) {
        section.paragraph(&format!("No standard errors: {reason}."));
    }
    let number = |value: f64| {
        if value.is_finite() {
            rounded(value, DIGITS)
        } else {
            "undefined".to_owned()
        }
    };
    let mut settings = vec![
        ("noise variance", number(model.noise_variance)),
        ("loss", number(last.fitted.pass.loss)),
    ];
    settings.extend(words::start(estimate).map(|start| ("start", start)));
    section.settings(&settings);
    section.heading("Residuals");
    match &last.residuals {
        None => section.paragraph(&format!("{}.", words::capitalised(words::NOT_TESTED))),
        Some(residuals) => {
            section.list(&words::residual_tests(residuals, report.feedback));
            section.figure(
                &pictures::correlations(slot, residuals),
                &format!(
                    "Correlations of the residuals e; the bounds hold for one lag alone. The verdicts are on all \
                     lags at once: {}.",
                    words::residual_basis(residuals)
                ),
            );
        }
    }
    section.heading("Poles and zeros");
    if let Some(precision) = &last.precision {
        if let Some(sentence) = words::cancellation(model, precision) {
            section.paragraph(&format!("{}.", words::capitalised(&sentence)));
        }
        section.figure(
            &pictures::plane(precision),
            "Poles and zeros of B/(A F) without the zeros of the delay, with 95 % ellipses of complex ones and \
             95 % intervals of real ones.",
        );
        section.table(&roots(precision));
        if let Some(known) = last.modes.as_deref().filter(|modes| !modes.is_empty()) {
            section.table(&modes(known, report.frequency()));
        }
    }
}

fn number(value: f64, digits: usize) -> CellText {
    if value.is_finite() {
        CellText::number(rounded(value, digits), value)
    } else {
        CellText::number("-", f64::NAN)
    }
}

/// A number and its standard error, as [`measured`] has them.
fn pair(value: f64, error: f64) -> [CellText; 2] {
    if value.is_nan() || !(error > 0.0 && error.is_finite()) {
        return [number(value, DIGITS), number(f64::NAN, DIGITS)];
    }
    let [text, of_error] = measured(value, error);
    [CellText::number(text, value), CellText::number(of_error, error)]
}

/// Returns each parameter with its standard error and its 95 % interval.
fn parameters(report: &PassReport) -> Table {
    let mut columns = vec![
        Column::text("parameter"),
        Column::number("estimate", ""),
        Column::number("standard error", ""),
        Column::number("95 % from", ""),
        Column::number("95 % to", ""),
    ];
    if report.fitted.model.standard_errors().is_none() {
        columns.truncate(2);
    }
    let mut table = Table::new("Parameters", columns);
    for (name, theta, error) in words::parameters(&report.fitted) {
        let [low, high] = [theta - Z_95 * error, theta + Z_95 * error];
        let ends = [low, high].map(|end| pair(end, error)).into_iter();
        let row = [CellText::text(name)].into_iter().chain(pair(theta, error));
        table.row(row.chain(ends.map(|[end, _]| end)));
    }
    table
}

/// The columns of a [`pair`].
fn with_error(title: &str, unit: &str, of_error: &str) -> [Column; 2] {
    [
        Column::number(title, unit),
        Column::number("its standard error", of_error),
    ]
}

/// Returns poles and zeros, and the static gain.
fn roots(precision: &Precision) -> Table {
    let parts = ["real part", "imaginary part", "modulus"].map(|part| with_error(part, "", ""));
    let columns = [Column::text("what")].into_iter().chain(parts.into_iter().flatten());
    let mut table = Table::new("Poles, zeros and static gain", columns.collect());
    for (name, roots) in [("pole", &precision.poles), ("zero", &precision.zeros)] {
        for Root { at, error } in roots {
            let parts = [(at.re, error.re), (at.im, error.im), (at.norm(), error.modulus)];
            let parts = parts.into_iter().flat_map(|(value, error)| pair(value, error));
            table.row([CellText::text(name)].into_iter().chain(parts));
        }
    }
    let gain = pair(precision.static_gain, precision.static_gain_se);
    table.row([CellText::text("static gain")].into_iter().chain(gain));
    table
}

/// Returns the poles in continuous time.
fn modes(modes: &[Mode], unit: Frequency) -> Table {
    let columns = [
        with_error("natural frequency", &unit.to_string(), ""),
        with_error("damping", "", ""),
        with_error("time constant", "s", "s"),
    ];
    let mut table = Table::new(
        "Poles in continuous time, a pair as one",
        columns.into_iter().flatten().collect(),
    );
    for mode in modes {
        let time = mode.time_constant.unwrap_or(f64::NAN);
        let numbers = [
            (unit.of(mode.frequency), unit.of(mode.frequency_se)),
            (mode.damping, mode.damping_se),
            (time, mode.time_constant_se),
        ];
        table.row(numbers.into_iter().flat_map(|(value, error)| pair(value, error)));
    }
    table
}

/// Returns the FIT of every model.
fn fits(report: &Report) -> Table {
    type Of = fn(&Fits) -> Option<f64>;
    let fits = || report.estimates.iter().map(|estimate| estimate.fit.as_ref());
    let validated = fits().flatten().any(|fits| fits.validation.is_some());
    let (steps, further) = (report.horizon, report.horizon > 1);
    let all: [(String, bool, Of); 6] = [
        ("window, simulated".to_owned(), true, |of| Some(of.window.simulated)),
        ("window, one step".to_owned(), true, |of| Some(of.window.one_step)),
        ("validation, simulated".to_owned(), validated, |of| {
            Some(of.validation?.simulated)
        }),
        ("validation, one step".to_owned(), validated, |of| {
            Some(of.validation?.one_step)
        }),
        (format!("window, {steps} steps"), further, |of| {
            Some(of.window.ahead?.fit)
        }),
        (format!("validation, {steps} steps"), validated && further, |of| {
            Some(of.validation?.ahead?.fit)
        }),
    ];
    let shown = all.iter().filter(|(_, shown, _)| *shown);
    let columns = shown.clone().map(|(title, ..)| Column::number(title, "%"));
    let columns = [Column::text("estimator")].into_iter().chain(columns).collect();
    let mut table = Table::new("FIT: 100 is a perfect model, 0 the mean of y", columns);
    for (estimate, fits) in report.estimates.iter().zip(fits()) {
        let name = estimate.name.name();
        let name = CellText::text(name).link(format!("#{name}"));
        let values = shown
            .clone()
            .map(|(_, _, of)| number(fits.and_then(of).unwrap_or(f64::NAN), 4));
        table.row([name].into_iter().chain(values));
    }
    table
}
