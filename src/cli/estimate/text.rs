//! The estimates for people, at most 80 columns wide.

use super::{Estimate, Name, PassReport, Report};
use crate::estimator::Progress;
use crate::metric::Fit;
use crate::text::visible;
use std::fmt::{self, Write};

pub(super) fn render(report: &Report) -> String {
    let mut text = String::new();
    write_report(&mut text, report).expect("writing to a string does not fail");
    text
}

fn write_report(text: &mut String, report: &Report) -> fmt::Result {
    let Report {
        order,
        delay,
        samples,
        window,
        ..
    } = report;
    writeln!(
        text,
        "{}: order {order}, delay {delay}, window {window} of {samples} samples",
        visible(report.file.display())
    )?;
    writeln!(
        text,
        "solver {}, detrend {}, gain {}\n\n\
         state space: x(k+1) = A x(k) + b u(k), y = x_1, last row of A is a\n\
         polynomials: A(q) y = B(q) u, A = 1 + alpha_1 q^-1 + ..., B = beta_1 q^-1 + ...",
        report.solver, report.detrend, report.gain
    )?;
    if *delay > 1 {
        let shift = delay - 1;
        writeln!(
            text,
            "with the delay taken out: y(k) stands for y(k + {shift}) of the file"
        )?;
    }
    for estimate in &report.estimates {
        write_estimate(text, estimate)?;
    }
    Ok(())
}

fn write_estimate(text: &mut String, estimate: &Estimate) -> fmt::Result {
    let (number, report) = &estimate.passes[estimate.passes.len() - 1];
    let title = match estimate.name {
        Name::LeastSquares => "Least squares".to_owned(),
        Name::InstrumentalVariables => format!("Instrumental variables, after pass {number}"),
    };
    writeln!(text, "\n{title}")?;
    if let Some(failure) = report.pass.failure {
        writeln!(text, "  FAILED: {failure}")?;
    }
    write_pass(text, report)?;
    if let Some(fit) = &estimate.fit {
        write_fit(text, "window", fit.window)?;
        match fit.validation {
            Some(fit) => write_fit(text, "validation", fit)?,
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
    }
    Ok(())
}

fn write_pass(text: &mut String, report: &PassReport) -> fmt::Result {
    let pass = &report.pass;
    if pass.progress >= Progress::Parameters {
        let alpha: Vec<f64> = pass.a.iter().rev().map(|a| -a).collect();
        write_vector(text, "alpha", &alpha)?;
        write_vector(text, "beta = h", &pass.h)?;
        write_vector(text, "a", &pass.a)?;
        write_vector(text, "b", &pass.b)?;
    }
    if pass.progress == Progress::InitialState {
        write_vector(text, "x0", &pass.x0)?;
    }
    for (i, pole) in report.poles.iter().enumerate() {
        let name = if i == 0 { "poles" } else { "" };
        let imaginary = if pole.im == 0.0 {
            String::new()
        } else {
            format!(" {:+.9} i", pole.im)
        };
        let position = format!("{:.9}{imaginary}", pole.re);
        writeln!(
            text,
            "  {name:<18} {position:<30} modulus {:.9}",
            pole.norm()
        )?;
    }
    if let Some(radius) = report.radius {
        let note = if pass.unstable { " (unstable)" } else { "" };
        writeln!(text, "  {:<18} {radius:.9}{note}", "spectral radius")?;
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

fn write_fit(text: &mut String, on: &str, fit: Fit) -> fmt::Result {
    let name = format!("FIT %, {on}");
    writeln!(
        text,
        "  {name:<18} {} simulated, {} one-step",
        percent(fit.simulated),
        percent(fit.one_step)
    )
}

/// A vector, three numbers a line, ten significant digits.
fn write_vector(text: &mut String, name: &str, values: &[f64]) -> fmt::Result {
    for (i, line) in values.chunks(3).enumerate() {
        let name = if i == 0 { name } else { "" };
        let numbers: Vec<String> = line.iter().map(|value| scientific(*value, 9)).collect();
        writeln!(text, "  {name:<18} {}", numbers.join(" "))?;
    }
    Ok(())
}

/// As C's `%18.9e`, so that columns line up: two digits of exponent at least, with a sign.
fn scientific(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    format!("{:>18}", format!("{mantissa}e{exponent:+03}"))
}

/// A FIT; one that is undefined, or so bad that it overflows, is "undefined".
fn percent(fit: f64) -> String {
    if fit.abs() < 1e6 {
        format!("{fit:.3}")
    } else if fit.is_finite() {
        format!("{fit:.3e}")
    } else {
        "undefined".to_owned()
    }
}
