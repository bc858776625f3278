//! Prints the estimates for people, at most 80 columns wide.

use super::report::{Estimate, Frequency, PassReport, Report};
use super::{comparison, words};
use crate::cli::equation::broken;
use crate::diagnosis::{FeedbackTest, Mode, Residuals, Root, Z_95};
use crate::estimator::Progress;
use crate::metric::Fit;
use crate::model::{ContinuousModel, Orders};
use crate::number::{measured, plus_minus};
use crate::text::{rounded, visible, wrap};
use asobench_identification::Fitted;
use std::fmt::{self, Write};

/// Significant digits.
const DIGITS: usize = 6;

/// Several models begin with a table of them; `details` is whether each follows.
pub(super) fn render(report: &Report, details: bool) -> String {
    let mut text = String::new();
    write_report(&mut text, report, details).expect("writing to a string does not fail");
    text
}

/// The orders as one number and a delay where that says all.
pub(super) fn asked(orders: Orders) -> String {
    let Orders { na, nk, .. } = orders;
    if orders == Orders::arx(na, na, nk) {
        format!("order {na}, delay {nk}")
    } else {
        format!("orders {orders}")
    }
}

fn write_report(text: &mut String, report: &Report, details: bool) -> fmt::Result {
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
    if let estimates @ [_, _, ..] = report.estimates.as_slice() {
        let mut ranked: Vec<&Estimate> = estimates.iter().collect();
        ranked.sort_by(|a, b| comparison::is_better(a, b, report));
        comparison::write(text, report, &ranked)?;
        if !details {
            let best = ranked[0];
            text.push_str(&comparison::hints(best));
            let (name, command) = (best.name, comparison::command(&["--estimator", "--format"]));
            return writeln!(
                text,
                "All of {name}, and with --details of each:\n  {command} --estimator {name}"
            );
        }
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
    let mut passes = report.estimates.iter().map(|of| &of.last().fitted.pass);
    if passes.any(|pass| !pass.offsets.is_empty()) {
        let offset = "with an offset, y less it stands for y: it is the output in equilibrium where u is 0";
        text.push_str(&wrap(offset, 80, ""));
    }
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
            let cause = words::cause(failure.kind, estimate).map_or(String::new(), |cause| format!(": {cause}"));
            let line = format!("  FAILED: {failure}{cause}");
            text.push_str(&wrap(&line, 80, &" ".repeat(10)));
        }
    }
    for hint in &estimate.hints {
        let line = format!("  {:<18} {hint}", "hint");
        text.push_str(&wrap(&line, 80, &" ".repeat(21)));
    }
    write_pass(text, report, unit, estimate.parts.is_empty())?;
    if let Some(start) = words::start(estimate) {
        let line = format!("  {:<18} {start}", "start");
        text.push_str(&wrap(&line, 80, &" ".repeat(21)));
    }
    if let Some(fit) = &estimate.fit {
        let has_noise_model = words::has_noise_model(&report.fitted.model);
        write_fit(text, "window", fit.window, has_noise_model)?;
        match fit.validation {
            Some(fit) => write_fit(text, "validation", fit, has_noise_model)?,
            None => writeln!(text, "  FIT %, validation  none: no samples after the window")?,
        }
    }
    if let Some(observer) = &estimate.observer {
        write_vector(text, "observer g", &observer.g)?;
        write_vector(text, "xhat(N)", &observer.at_window)?;
        write_vector(text, "xhat(K-1)", &observer.last)?;
    } else if report.fitted.pass.direct != 0.0 {
        writeln!(text, "  {:<18} none: u acts on y at once (nk = 0)", "observer")?;
    }
    Ok(())
}

/// Writes what a model is on each of several records.
fn write_parts(text: &mut String, estimate: &Estimate, report: &Report) -> fmt::Result {
    for (part, of) in report.parts.iter().zip(&estimate.parts) {
        let lines = part
            .lines
            .map_or_else(String::new, |[first, last]| format!(", lines {first} to {last}"));
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

fn write_pass(text: &mut String, report: &PassReport, unit: Frequency, of_one: bool) -> fmt::Result {
    let Fitted { pass, model, .. } = &report.fitted;
    if pass.progress >= Progress::Parameters {
        let equation = model.equation().rounded(DIGITS).to_string();
        for line in equation.lines() {
            writeln!(text, "  {}", broken(line, 2, 6))?;
        }
        if let Some(errors) = model.standard_errors() {
            let mut names = words::parameters(model.orders());
            let (of_records, offsets): (Vec<_>, Vec<_>) = words::offsets(pass).unzip();
            names.extend(of_records);
            let values = model.parameters().chain(offsets.iter().map(|of| of.value));
            let errors = errors.into_iter().chain(offsets.iter().map(|of| of.se));
            write_parameters(text, &names, values, errors)?;
        } else {
            for (name, offset) in words::offsets(pass) {
                write_vector(text, &name, &[offset.value])?;
            }
        }
        write_continuous(text, &pass.continuous)?;
        for (name, value) in [("noise variance", model.noise_variance), ("loss", pass.loss)] {
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
            "  {:<18} {}",
            "static gain",
            plus_minus(precision.static_gain, precision.static_gain_se)
        )?;
    }
    if let Some(radius) = report.radius {
        let note = if pass.continuous.has_integrator() {
            " (an integrator)"
        } else if pass.unstable {
            " (unstable)"
        } else {
            ""
        };
        let radius = rounded(radius, DIGITS);
        writeln!(text, "  {:<18} {radius}{note}", "spectral radius")?;
    }
    match &report.residuals {
        Some(residuals) => write_residuals(text, residuals, report.feedback)?,
        None if of_one && pass.progress >= Progress::Parameters => {
            writeln!(text, "  {:<18} {}", "residuals", words::NOT_TESTED)?;
        }
        None => {}
    }
    if pass.condition.is_finite() {
        writeln!(text, "  {:<18} {}", "condition", rounded(pass.condition, 3))?;
    }
    Ok(())
}

/// Writes a model in continuous time, if there is one.
fn write_continuous(text: &mut String, model: &ContinuousModel) -> fmt::Result {
    let (nb, n) = (model.numerator.len(), model.denominator.len().max(1) - 1);
    if nb == 0 {
        return Ok(());
    }
    let fixed = usize::from(model.has_integrator());
    writeln!(
        text,
        "  {:<18} y = B(s)/A(s) u{}, {} hold, {} s between samples",
        "continuous time",
        if fixed > 0 { ", A(0) = 0" } else { "" },
        model.hold,
        rounded(model.step, DIGITS),
    )?;
    if model.dead_time > 0.0 || model.dead_time_error().is_some() {
        let error = model.dead_time_error().unwrap_or(f64::NAN);
        let seconds = plus_minus(model.dead_time * model.step, error);
        writeln!(text, "  {:<18} {seconds} s", "dead time")?;
    }
    let of_b = (0..nb).rev().map(|power| format!("B(s): s^{power}"));
    let of_a = (fixed..n).rev().map(|power| format!("A(s): s^{power}"));
    let names: Vec<String> = of_b.chain(of_a).collect();
    if let Some(errors) = model.standard_errors() {
        return write_parameters(text, &names, model.parameters(), errors);
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
            let [size, _] = measured(at.im.abs(), error.im);
            format!(" {} {size} i", if at.im < 0.0 { '-' } else { '+' })
        };
        let position = format!("{}{imaginary}", measured(at.re, error.re)[0]);
        let modulus = plus_minus(at.norm(), error.modulus);
        writeln!(text, "  {name:<18} {position:<26} modulus {modulus}")?;
    }
    Ok(())
}

/// Writes the poles in continuous time.
fn write_modes(text: &mut String, modes: &[Mode], unit: Frequency) -> fmt::Result {
    for (i, mode) in modes.iter().enumerate() {
        let name = if i == 0 { "frequencies" } else { "" };
        let frequency = format!(
            "{} {unit}",
            plus_minus(unit.of(mode.frequency), unit.of(mode.frequency_se))
        );
        let decay = mode.time_constant.map_or_else(
            || "does not decay".to_owned(),
            |time| format!("time constant {} s", plus_minus(time, mode.time_constant_se)),
        );
        // Of a real pole the damping is 1 whatever its error.
        let damping = plus_minus(mode.damping, mode.damping_se);
        writeln!(text, "  {name:<18} {frequency}")?;
        let mut line = format!("damping {damping}, {decay}");
        if line.len() > 80 - 21 {
            line = format!("damping {damping},\n{:21}{decay}", "");
        }
        writeln!(text, "{:21}{line}", "")?;
    }
    Ok(())
}

/// Writes each parameter with its standard error and its 95 % interval.
fn write_parameters(
    text: &mut String,
    names: &[String],
    values: impl IntoIterator<Item = f64>,
    errors: impl IntoIterator<Item = f64>,
) -> fmt::Result {
    writeln!(
        text,
        "  {:<18} {:>13} {:>13}   95 % interval",
        "parameter", "estimate", "std. error"
    )?;
    for ((name, theta), error) in names.iter().zip(values).zip(errors) {
        let [estimate, se] = measured(theta, error);
        let [low, high] = [theta - Z_95 * error, theta + Z_95 * error];
        let [[low, _], [high, _]] = [low, high].map(|end| measured(end, error));
        writeln!(text, "  {name:<18} {estimate:>13} {se:>13}   {low} ... {high}")?;
    }
    Ok(())
}

/// Writes the results of the residual tests in words.
fn write_residuals(text: &mut String, residuals: &Residuals, feedback: Option<FeedbackTest>) -> fmt::Result {
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
        // Adding 0 turns -0 into 0.
        let numbers = line.iter().map(|value| rounded(value + 0.0, DIGITS));
        let numbers: Vec<String> = numbers.map(|number| format!("{number:>13}")).collect();
        writeln!(text, "  {name:<18} {}", numbers.join(" "))?;
    }
    Ok(())
}

/// Formats a FIT; "undefined" if it is undefined or overflows.
pub(super) fn percent(fit: f64) -> String {
    if fit.abs() < 1e6 {
        format!("{fit:.3}")
    } else if fit.is_finite() {
        format!("{fit:.3e}")
    } else {
        "undefined".to_owned()
    }
}
