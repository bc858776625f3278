//! Prints the estimates for people, at most 80 columns wide.

use super::report::{Estimate, Frequency, PassReport, Report};
use super::words;
use crate::cli::equation::broken;
use crate::diagnosis::{FeedbackTest, Mode, Residuals, Root, Z_95};
use crate::estimator::Progress;
use crate::metric::Fit;
use crate::model::{ContinuousModel, Orders};
use crate::text::{rounded, visible, wrap};
use asobench_identification::Fitted;
use std::fmt::{self, Write};

/// Significant digits.
const DIGITS: usize = 6;

pub(super) fn render(report: &Report) -> String {
    let mut text = String::new();
    write_report(&mut text, report).expect("writing to a string does not fail");
    text
}

/// The orders as one number and a delay where that says all.
fn asked(orders: Orders) -> String {
    let Orders { na, nk, .. } = orders;
    if orders == Orders::arx(na, na, nk) {
        format!("order {na}, delay {nk}")
    } else {
        format!("orders {orders}")
    }
}

fn write_report(text: &mut String, report: &Report) -> fmt::Result {
    if report.parts.is_empty() {
        writeln!(
            text,
            "{}: {}, window {} of {} samples\ndetrend {}, observer's gain {}",
            visible(report.file.display()),
            asked(report.orders),
            report.window,
            report.record.y.len(),
            report.detrend,
            report.gain
        )?;
    } else {
        let (count, orders) = (report.parts.len(), asked(report.orders));
        let detrend = report.detrend;
        let line = format!(
            "{count} records, {} samples: {orders}, each from a start of its own; detrend {detrend} of each file",
            report.window
        );
        text.push_str(&wrap(&line, 80, ""));
    }
    text.push_str(&words::record(report));
    if let Some(unit) = report.unit_in_words() {
        text.push_str(&wrap(&unit, 80, ""));
    }
    for estimate in &report.estimates {
        write_estimate(text, estimate, report.frequency())?;
        write_parts(text, estimate, report)?;
    }
    let shift = report.shift();
    writeln!(
        text,
        "\nA(q) y = B(q)/F(q) u + C(q)/D(q) e with A = 1 + a_1 q^-1 + ...; in state space\n\
         x(k+1) = A x(k) + b u(k), y = x_1 + d u, last row of A is a; d = 0 where nk > 0"
    )?;
    if shift > 0 {
        let states = format!(
            "the states of ls and iv belong to the record without its delay: their y(k) is the file's y(k + {shift})"
        );
        text.push_str(&wrap(&states, 80, ""));
    }
    Ok(())
}

fn write_estimate(text: &mut String, estimate: &Estimate, unit: Frequency) -> fmt::Result {
    let report = estimate.last();
    writeln!(text, "\n{}", words::heading(estimate))?;
    if let Some(failure) = report.fitted.pass.failure {
        if let Some(sentence) = words::unfinished(estimate) {
            let line = format!("  {:<18} {}: {sentence}", "status", failure.kind);
            text.push_str(&wrap(&line, 80, &" ".repeat(21)));
        } else {
            let cause = words::cause(failure.kind, estimate)
                .map_or(String::new(), |cause| format!(": {cause}"));
            let line = format!("  FAILED: {failure}{cause}");
            text.push_str(&wrap(&line, 80, &" ".repeat(10)));
        }
    }
    for hint in &estimate.hints {
        let line = format!("  {:<18} {hint}", "hint");
        text.push_str(&wrap(&line, 80, &" ".repeat(21)));
    }
    write_pass(text, report, unit, estimate.parts.is_empty())?;
    if let Some(fit) = &estimate.fit {
        let has_noise_model = words::has_noise_model(&report.fitted.model);
        write_fit(text, "window", fit.window, has_noise_model)?;
        match fit.validation {
            Some(fit) => write_fit(text, "validation", fit, has_noise_model)?,
            None => writeln!(
                text,
                "  FIT %, validation  none: no samples after the window"
            )?,
        }
    }
    if let Some(observer) = &estimate.observer {
        write_vector(text, "observer g", &observer.g)?;
        write_vector(text, "xhat(N)", &observer.at_window)?;
        write_vector(text, "xhat(K-1)", &observer.last)?;
    } else if report.fitted.pass.direct != 0.0 {
        writeln!(
            text,
            "  {:<18} none: u acts on y at once (nk = 0)",
            "observer"
        )?;
    }
    Ok(())
}

/// Writes what a model is on each of several records.
fn write_parts(text: &mut String, estimate: &Estimate, report: &Report) -> fmt::Result {
    for (part, of) in report.parts.iter().zip(&estimate.parts) {
        let lines = part.lines.map_or_else(String::new, |[first, last]| {
            format!(", lines {first} to {last}")
        });
        writeln!(
            text,
            "  {}{lines}, {} samples",
            visible(part.file.display()),
            part.samples
        )?;
        let has_noise_model = words::has_noise_model(&estimate.last().fitted.model);
        write_fit(text, "this record", of.fit, has_noise_model)?;
        match &of.residuals {
            Some(residuals) => write_residuals(text, residuals, part.feedback)?,
            None => writeln!(text, "  {:<18} {}", "residuals", words::NOT_TESTED)?,
        }
    }
    if let Some(white) = estimate.white {
        let verdict = if white.passed { "white" } else { "NOT white" };
        let chance = words::chance(white.p_value);
        writeln!(text, "  {:<18} {verdict} ({chance})", "residuals, all")?;
    }
    Ok(())
}

fn write_pass(
    text: &mut String,
    report: &PassReport,
    unit: Frequency,
    of_one: bool,
) -> fmt::Result {
    let Fitted { pass, model, .. } = &report.fitted;
    if pass.progress >= Progress::Parameters {
        let equation = model.equation().rounded(DIGITS).to_string();
        for line in equation.lines() {
            writeln!(text, "  {}", broken(line, 2, 6))?;
        }
        if let Some(errors) = model.standard_errors() {
            let names = words::parameters(model.orders());
            write_parameters(text, &names, model.parameters(), &errors)?;
        }
        write_continuous(text, &pass.continuous)?;
        for (name, value) in [
            ("noise variance", model.noise_variance),
            ("loss", pass.loss),
        ] {
            if value.is_finite() {
                write_vector(text, name, &[value])?;
            } else {
                writeln!(text, "  {name:<18} undefined")?;
            }
        }
        for (name, value) in ["noise of y", "noise of u"]
            .into_iter()
            .zip(pass.noise_variances.iter().flatten())
        {
            write_vector(text, name, &[*value])?;
        }
        write_vector(text, "a", &pass.a)?;
        write_vector(text, "b", &pass.b)?;
        if pass.direct != 0.0 {
            write_vector(text, "d", &[pass.direct])?;
        }
    }
    if pass.progress == Progress::InitialState {
        write_vector(text, "x0", &pass.x0)?;
    }
    if let Some(precision) = &report.precision {
        write_roots(text, "poles", &precision.poles)?;
        write_modes(text, report.modes.as_deref().unwrap_or_default(), unit)?;
        write_roots(text, "zeros", &precision.zeros)?;
        if let Some(sentence) = words::cancellation(model, precision) {
            let line = format!("  {:<18} {sentence}", "order");
            text.push_str(&wrap(&line, 80, &" ".repeat(21)));
        }
        writeln!(
            text,
            "  {:<18} {:.6}{}",
            "static gain",
            precision.static_gain,
            plus_minus(precision.static_gain_se)
        )?;
    }
    if let Some(radius) = report.radius {
        let note = if pass.unstable { " (unstable)" } else { "" };
        writeln!(text, "  {:<18} {radius:.6}{note}", "spectral radius")?;
    }
    match &report.residuals {
        Some(residuals) => write_residuals(text, residuals, report.feedback)?,
        None if of_one && pass.progress >= Progress::Parameters => {
            writeln!(text, "  {:<18} {}", "residuals", words::NOT_TESTED)?;
        }
        None => {}
    }
    if pass.condition.is_finite() {
        writeln!(
            text,
            "  {:<18} {}",
            "condition",
            scientific(pass.condition, 3).trim()
        )?;
    }
    Ok(())
}

/// Writes a model in continuous time, if there is one.
fn write_continuous(text: &mut String, model: &ContinuousModel) -> fmt::Result {
    let (nb, n) = (model.numerator.len(), model.denominator.len().max(1) - 1);
    if nb == 0 {
        return Ok(());
    }
    writeln!(
        text,
        "  {:<18} y = B(s)/A(s) u, {} hold, {} s between samples{}",
        "continuous time",
        model.hold,
        rounded(model.step, DIGITS),
        match model.dead_time {
            0 => String::new(),
            dead => format!(
                ", dead time {} s",
                rounded(dead as f64 * model.step, DIGITS)
            ),
        }
    )?;
    let of_b = (0..nb).rev().map(|power| format!("B(s): s^{power}"));
    let of_a = (0..n).rev().map(|power| format!("A(s): s^{power}"));
    let names: Vec<String> = of_b.chain(of_a).collect();
    if let Some(errors) = model.standard_errors() {
        return write_parameters(text, &names, model.parameters(), &errors);
    }
    for (name, value) in names.iter().zip(model.parameters()) {
        write_vector(text, name, &[value])?;
    }
    Ok(())
}

fn write_roots(text: &mut String, name: &str, roots: &[Root]) -> fmt::Result {
    for (i, Root { at, error }) in roots.iter().enumerate() {
        let name = if i == 0 { name } else { "" };
        let imaginary = if at.im == 0.0 {
            String::new()
        } else {
            format!(" {:+.6} i", at.im)
        };
        let position = format!("{:.6}{imaginary}", at.re);
        writeln!(
            text,
            "  {name:<18} {position:<30} modulus {:.6}{}",
            at.norm(),
            plus_minus(error.modulus)
        )?;
    }
    Ok(())
}

/// Writes the poles in continuous time.
fn write_modes(text: &mut String, modes: &[Mode], unit: Frequency) -> fmt::Result {
    for (i, mode) in modes.iter().enumerate() {
        let name = if i == 0 { "frequencies" } else { "" };
        let frequency = format!(
            "{} {unit}",
            measured(unit.of(mode.frequency), unit.of(mode.frequency_se))
        );
        let decay = mode.time_constant.map_or_else(
            || "does not decay".to_owned(),
            |time| format!("time constant {} s", measured(time, mode.time_constant_se)),
        );
        // Of a real pole the damping is 1 whatever its error.
        let damping = measured(mode.damping, mode.damping_se);
        writeln!(
            text,
            "  {name:<18} {frequency}\n  {:<18} damping {damping}, {decay}",
            ""
        )?;
    }
    Ok(())
}

/// Writes each parameter with its standard error and its 95 % interval.
fn write_parameters(
    text: &mut String,
    names: &[String],
    values: impl IntoIterator<Item = f64>,
    errors: &[f64],
) -> fmt::Result {
    writeln!(
        text,
        "  {:<18} {:>13} {:>13}   95 % interval",
        "parameter", "estimate", "std. error"
    )?;
    for ((name, theta), error) in names.iter().zip(values).zip(errors) {
        writeln!(
            text,
            "  {name:<18} {} {} {} ...{}",
            scientific(theta, DIGITS - 1),
            scientific(*error, 2),
            scientific(theta - Z_95 * error, 3).split_off(2),
            scientific(theta + Z_95 * error, 3).split_off(2)
        )?;
    }
    Ok(())
}

/// Formats " +- 0.01"; nothing if there is no standard error.
fn plus_minus(error: f64) -> String {
    if error.is_finite() {
        format!(" +- {error:.2e}")
    } else {
        String::new()
    }
}

/// Formats "81.1 +- 3.6": two digits of the error, and the value to the same place. Without an error six digits, and
/// where that place is far from the point, as [`plus_minus`] does.
fn measured(value: f64, error: f64) -> String {
    if !(error.is_finite() && error > 0.0) {
        return rounded(value, DIGITS);
    }
    let place = 1 - error.log10().floor() as i32;
    match usize::try_from(place.max(0)) {
        Ok(decimals @ 0..=4) if value.abs() < 1e6 && error < 1e6 => {
            format!("{value:.decimals$} +- {error:.decimals$}")
        }
        _ => format!("{}{}", rounded(value, DIGITS), plus_minus(error)),
    }
}

/// Writes the results of the residual tests in words.
fn write_residuals(
    text: &mut String,
    residuals: &Residuals,
    feedback: Option<FeedbackTest>,
) -> fmt::Result {
    let names = ["residuals", "", ""];
    for (name, verdict) in names.iter().zip(words::residual_tests(residuals, feedback)) {
        let line = format!("  {name:<18} {verdict}");
        text.push_str(&wrap(&line, 80, &" ".repeat(21)));
    }
    if residuals.fits_to_rounding {
        return Ok(());
    }
    writeln!(text, "  {:<18} {}", "", words::residual_basis(residuals))
}

fn write_fit(text: &mut String, on: &str, fit: Fit, has_noise_model: bool) -> fmt::Result {
    let name = format!("FIT %, {on}");
    let [simulated, one_step] = [fit.simulated, fit.one_step].map(percent);
    // The past of y helps no prediction where the noise has no model.
    let note = if has_noise_model {
        ""
    } else {
        " (equal: no noise model)"
    };
    let note = if simulated == one_step { note } else { "" };
    let ahead = fit.ahead.map_or_else(String::new, |ahead| {
        format!(", {} {} steps ahead", percent(ahead.fit), ahead.steps)
    });
    let line = format!("  {name:<18} {simulated} simulated, {one_step} one-step{note}{ahead}");
    text.write_str(&wrap(&line, 80, &" ".repeat(21)))
}

/// Writes a vector, four numbers per line.
fn write_vector(text: &mut String, name: &str, values: &[f64]) -> fmt::Result {
    for (i, line) in values.chunks(4).enumerate() {
        let name = if i == 0 { name } else { "" };
        let numbers: Vec<String> = line
            .iter()
            .map(|value| scientific(*value, DIGITS - 1))
            .collect();
        writeln!(text, "  {name:<18} {}", numbers.join(" "))?;
    }
    Ok(())
}

/// Formats a number like C's `%13.5e`, so that columns line up: a signed exponent of at least two digits.
fn scientific(value: f64, digits: usize) -> String {
    // Adding 0 turns -0 into 0.
    let text = format!("{:.digits$e}", value + 0.0);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    format!("{:>13}", format!("{mantissa}e{exponent:+03}"))
}

/// Formats a FIT; "undefined" if it is undefined or overflows.
fn percent(fit: f64) -> String {
    if fit.abs() < 1e6 {
        format!("{fit:.3}")
    } else if fit.is_finite() {
        format!("{fit:.3e}")
    } else {
        "undefined".to_owned()
    }
}
