//! Prints the estimates for people, at most 80 columns wide.

use super::report::{Estimate, Frequency, Report};
use super::{comparison, words};
use crate::cli::equation::broken;
use crate::cli::output::Lines;
use crate::diagnosis::{FeedbackTest, Mode, Residuals, Root, Z_95};
use crate::estimator::Progress;
use crate::metric::Fit;
use crate::model::{ContinuousModel, LinearModel, Orders};
use crate::number::{measured, plus_minus};
use crate::text::{rounded, visible};
use asobench_identification::Fitted;
use std::fmt::Display;
use std::iter;

/// Significant digits.
const DIGITS: usize = 6;

/// The orders as one number and a delay where that says all.
pub(super) fn asked(orders: Orders) -> String {
    let Orders { na, nk, .. } = orders;
    if orders == Orders::arx(na, na, nk) {
        format!("order {na}, delay {nk}")
    } else {
        format!("orders {orders}")
    }
}

/// Several models begin with a table of them; `details` is whether each follows.
pub(super) fn render(report: &Report, details: bool) -> String {
    let mut text = Lines::default();
    if report.parts.is_empty() {
        text.line(format_args!(
            "{}: {}, window {} of {} samples\ndetrend {}, observer's gain {}",
            visible(report.file.display()),
            asked(report.orders),
            report.window,
            report.record.y.len(),
            report.detrend,
            report.gain
        ));
    } else {
        let (count, orders) = (report.parts.len(), asked(report.orders));
        let detrend = report.detrend;
        let line = format!(
            "{count} records, {} samples: {orders}, each from a start of its own; detrend {detrend} of each file",
            report.window
        );
        text.paragraph(&line, "");
    }
    text.record(report);
    if let estimates @ [_, _, ..] = report.estimates.as_slice() {
        let mut ranked: Vec<&Estimate> = estimates.iter().collect();
        ranked.sort_by(|a, b| comparison::is_better(a, b, report));
        comparison::write(&mut text, report, &ranked);
        if !details {
            let best = ranked[0];
            comparison::hints(&mut text, best);
            let (name, command) = (best.name, comparison::command(&["--estimator", "--format"]));
            text.line(format_args!(
                "All of {name}, and with --details of each:\n  {command} --estimator {name}"
            ));
            return text.0;
        }
    }
    for estimate in &report.estimates {
        write_estimate(&mut text, estimate, report);
        write_parts(&mut text, estimate, report);
    }
    let shift = report.shift();
    text.line(
        "\nA(q) y = B(q)/F(q) u + C(q)/D(q) e with A = 1 + a_1 q^-1 + ...; in state space\n\
         x(k+1) = A x(k) + b u(k), y = x_1 + d u, last row of A is a; d = 0 where nk > 0",
    );
    let mut passes = report.estimates.iter().map(|of| &of.last().fitted.pass);
    if passes.any(|pass| !pass.offsets.is_empty()) {
        let offset = "with an offset, y less it stands for y: it is the output in equilibrium where u is 0";
        text.paragraph(offset, "");
    }
    if shift > 0 {
        let states = format!(
            "the states of ls and iv belong to the record without its delay: their y(k) is the file's y(k + {shift})"
        );
        text.paragraph(&states, "");
    }
    text.0
}

impl Lines {
    /// Appends what [`words::record`] says, and the unit of the record if it is not that of the file.
    pub(super) fn record(&mut self, report: &Report) {
        self.add(&words::record(report));
        if let Some(unit) = report.unit_in_words() {
            self.paragraph(&unit, "");
        }
    }

    /// Appends a line of a model, wrapped: a name and what it is.
    pub(super) fn fact(&mut self, name: &str, value: impl Display) {
        self.paragraph(&format!("  {name:<18} {value}"), &" ".repeat(21));
    }

    /// Appends a line for each of some values.
    pub(super) fn facts(&mut self, name: &str, values: impl IntoIterator<Item: Display>) {
        values.into_iter().for_each(|value| self.fact(name, value));
    }

    /// Appends the model as an equation.
    pub(super) fn equation(&mut self, model: &LinearModel) {
        for line in model.equation(Some(DIGITS)).lines() {
            self.line(format_args!("  {}", broken(line, 2, 6)));
        }
    }

    /// Appends a vector, four numbers per line.
    fn vector(&mut self, name: &str, values: &[f64]) {
        // Adding 0 turns -0 into 0.
        let numbers = values.iter().map(|value| rounded(value + 0.0, DIGITS));
        self.cells(name, &numbers.collect::<Vec<String>>(), 4);
    }

    /// Appends numbers, so many per line.
    pub(super) fn cells(&mut self, name: &str, numbers: &[String], each: usize) {
        for (name, line) in iter::once(name).chain(iter::repeat("")).zip(numbers.chunks(each)) {
            let cells: Vec<String> = line.iter().map(|cell| format!("{cell:>13}")).collect();
            self.line(format_args!("  {name:<18} {}", cells.join(" ")));
        }
    }

    fn fit(&mut self, on: &str, fit: Fit, has_noise_model: bool) {
        let [simulated, one_step] = [fit.simulated, fit.one_step].map(percent);
        // The past of y helps no prediction where the noise has no model.
        let note = if simulated == one_step && !has_noise_model {
            " (equal: no noise model)"
        } else {
            ""
        };
        let ahead = fit.ahead.map_or_else(String::new, |ahead| {
            format!(", {} {} steps ahead", percent(ahead.fit), ahead.steps)
        });
        let value = format!("{simulated} simulated, {one_step} one-step{note}{ahead}");
        self.fact(&format!("FIT %, {on}"), value);
    }

    /// Appends the results of the residual tests in words.
    fn residuals(&mut self, residuals: Option<&Residuals>, feedback: Option<FeedbackTest>) {
        let Some(residuals) = residuals else {
            return self.line(format_args!("  {:<18} {}", "residuals", words::NOT_TESTED));
        };
        let mut verdicts = words::residual_tests(residuals, feedback);
        if !residuals.fits_to_rounding {
            verdicts.push(words::residual_basis(residuals));
        }
        for (name, verdict) in iter::once("residuals").chain(iter::repeat("")).zip(verdicts) {
            self.fact(name, verdict);
        }
    }

    /// Appends each parameter with its standard error and its 95 % interval.
    fn parameters(&mut self, rows: impl IntoIterator<Item = (String, f64, f64)>) {
        self.line(format_args!(
            "  {:<18} {:>13} {:>13}   95 % interval",
            "parameter", "estimate", "std. error"
        ));
        for (name, theta, error) in rows {
            let [estimate, se] = measured(theta, error);
            let [low, high] = [theta - Z_95 * error, theta + Z_95 * error];
            let [[low, _], [high, _]] = [low, high].map(|end| measured(end, error));
            self.line(format_args!("  {name:<18} {estimate:>13} {se:>13}   {low} ... {high}"));
        }
    }
}

fn write_estimate(text: &mut Lines, estimate: &Estimate, report: &Report) {
    let last = estimate.last();
    text.line(format_args!("\n{}", words::heading(estimate)));
    match words::status(estimate, report) {
        Some(Ok(status)) => text.fact("status", status),
        Some(Err(failed)) => text.paragraph(&format!("  FAILED: {failed}"), &" ".repeat(10)),
        None => {}
    }
    text.facts("hint", &estimate.hints);
    write_pass(text, estimate, report);
    text.facts("start", words::start(estimate));
    if let Some(fit) = &estimate.fit {
        let has_noise_model = words::has_noise_model(&last.fitted.model);
        text.fit("window", fit.window, has_noise_model);
        match fit.validation {
            Some(fit) => text.fit("validation", fit, has_noise_model),
            None => text.line("  FIT %, validation  none: no samples after the window"),
        }
    }
    if let Some(observer) = &estimate.observer {
        text.vector("observer g", &observer.g);
        text.vector("xhat(N)", observer.at_window());
        text.vector("xhat(K-1)", observer.last());
    } else if last.fitted.pass.direct != 0.0 {
        text.fact("observer", "none: u acts on y at once (nk = 0)");
    }
}

/// Writes what a model is on each of several records.
fn write_parts(text: &mut Lines, estimate: &Estimate, report: &Report) {
    for (part, of) in report.parts.iter().zip(&estimate.parts) {
        let lines = part
            .lines
            .map_or_else(String::new, |[first, last]| format!(", lines {first} to {last}"));
        let file = visible(part.file.display());
        text.line(format_args!("  {file}{lines}, {} samples", part.samples));
        let has_noise_model = words::has_noise_model(&estimate.last().fitted.model);
        text.fit("this record", of.fit, has_noise_model);
        text.residuals(of.residuals.as_ref(), part.feedback);
    }
    if let Some(white) = estimate.white {
        text.fact("residuals, all", words::whiteness(white));
    }
}

fn write_pass(text: &mut Lines, estimate: &Estimate, report: &Report) {
    let last = estimate.last();
    let Fitted { pass, model, .. } = &last.fitted;
    let has_model = pass.progress >= Progress::Parameters;
    if has_model {
        text.equation(model);
        if model.standard_errors().is_some() {
            text.parameters(words::parameters(&last.fitted));
        } else {
            words::offsets(pass).for_each(|(name, offset)| text.vector(&name, &[offset.value]));
        }
        write_continuous(text, &pass.continuous);
        for (name, value) in [("noise variance", model.noise_variance), ("loss", pass.loss)] {
            if value.is_finite() {
                text.vector(name, &[value]);
            } else {
                text.fact(name, "undefined");
            }
        }
        let noises = pass.noise_variances.iter().flatten();
        for (name, value) in ["noise of y", "noise of u"].into_iter().zip(noises) {
            text.vector(name, &[*value]);
        }
        text.vector("a", &pass.a);
        text.vector("b", &pass.b);
        if pass.direct != 0.0 {
            text.vector("d", &[pass.direct]);
        }
    }
    if pass.progress == Progress::InitialState {
        text.vector("x0", &pass.x0);
    }
    if let Some(precision) = &last.precision {
        write_roots(text, "poles", &precision.poles);
        write_modes(text, last.modes.as_deref().unwrap_or_default(), report.frequency());
        write_roots(text, "zeros", &precision.zeros);
        text.facts("order", words::cancellation(model, precision));
        text.fact("static gain", words::static_gain(precision));
    }
    if let Some(radius) = last.radius {
        let note = if pass.continuous.has_integrator() {
            " (an integrator)"
        } else if pass.unstable {
            " (unstable)"
        } else {
            ""
        };
        text.fact("spectral radius", rounded(radius, DIGITS) + note);
    }
    if last.residuals.is_some() || estimate.parts.is_empty() && has_model {
        text.residuals(last.residuals.as_ref(), report.feedback);
    }
    if pass.condition.is_finite() {
        text.fact("condition", rounded(pass.condition, 3));
    }
}

/// Writes a model in continuous time, if there is one.
fn write_continuous(text: &mut Lines, model: &ContinuousModel) {
    let (nb, n) = (model.numerator.len(), model.denominator.len().max(1) - 1);
    if nb == 0 {
        return;
    }
    let fixed = usize::from(model.has_integrator());
    let integrator = if fixed > 0 { ", A(0) = 0" } else { "" };
    let (hold, step) = (model.hold, rounded(model.step, DIGITS));
    let about = format!("y = B(s)/A(s) u{integrator}, {hold} hold, {step} s between samples");
    text.fact("continuous time", about);
    if model.dead_time > 0.0 || model.dead_time_error().is_some() {
        text.fact("dead time", words::dead_time(model));
    }
    let of_b = (0..nb).rev().map(|power| format!("B(s): s^{power}"));
    let of_a = (fixed..n).rev().map(|power| format!("A(s): s^{power}"));
    let named = of_b.chain(of_a).zip(model.parameters());
    if let Some(errors) = model.standard_errors() {
        text.parameters(named.zip(errors).map(|((name, value), error)| (name, value, error)));
    } else {
        named.for_each(|(name, value)| text.vector(&name, &[value]));
    }
}

fn write_roots(text: &mut Lines, name: &str, roots: &[Root]) {
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
        text.line(format_args!("  {name:<18} {position:<26} modulus {modulus}"));
    }
}

/// Writes the poles in continuous time.
fn write_modes(text: &mut Lines, modes: &[Mode], unit: Frequency) {
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
        if mode.damping.is_nan() {
            text.fact(name, "an integrator: a pole at 1");
            continue;
        }
        // Of a real pole the damping is 1 whatever its error.
        let damping = plus_minus(mode.damping, mode.damping_se);
        text.fact(name, frequency);
        let mut line = format!("damping {damping}, {decay}");
        if line.len() > 80 - 21 {
            line = format!("damping {damping},\n{:21}{decay}", "");
        }
        text.line(format_args!("{:21}{line}", ""));
    }
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
