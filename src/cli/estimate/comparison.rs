//! Several models of a record in one table, best first.

use super::report::{Estimate, PartReport, Report};
use crate::cli::output::Lines;
use crate::estimator::Criterion;
use crate::metric::Fit;
use crate::text::shell_word;
use std::cmp::Ordering;

/// The FIT that counts: on the samples for validation; on the window where there are none; of several records together.
fn fit(estimate: &Estimate, report: &Report) -> Option<Fit> {
    if !estimate.parts.is_empty() {
        return Some(fit_of_all(&estimate.parts, report));
    }
    let fits = estimate.fit.as_ref()?;
    Some(fits.validation.unwrap_or(fits.window))
}

/// The FIT of several records together: `100 (1 - sqrt(sum e^2 / sum (y - mean of its record)^2))`.
pub(super) fn fit_of_all(parts: &[PartReport], report: &Report) -> Fit {
    let runs = report.runs();
    let together = |fit: &dyn Fn(&Fit) -> f64| {
        let squares = runs.iter().zip(parts).map(|(run, part)| {
            let y = &report.record.y[run.clone()];
            let mean = y.iter().sum::<f64>() / y.len() as f64;
            let spread: f64 = y.iter().map(|y| (y - mean).powi(2)).sum();
            (spread * (1.0 - fit(&part.fit) / 100.0).powi(2), spread)
        });
        let (left, spread) = squares.fold((0.0, 0.0), |(left, all), (e, of)| (left + e, all + of));
        100.0 * (1.0 - (left / spread).sqrt())
    };
    Fit {
        simulated: together(&|fit| fit.simulated),
        one_step: together(&|fit| fit.one_step),
        ahead: None,
    }
}

/// Whether samples are left for validation.
fn is_validated(report: &Report) -> bool {
    report.validation.is_some() || report.window < report.record.y.len()
}

/// BIC over the window, of the parameters and of the start where it was fitted; `None` without a loss.
pub(super) fn bic(estimate: &Estimate, report: &Report) -> Option<f64> {
    let pass = &estimate.last().fitted.pass;
    let parameters = estimate.last().fitted.model.orders().parameters() + pass.start_numbers;
    let loss = pass.loss * report.told_unit().powi(2);
    let bic = Criterion::Bic.value(loss, report.window, parameters);
    bic.is_finite().then_some(bic)
}

/// The better of two comes first: by FIT of the simulated output on samples that the models have not seen; where there
/// are none, by BIC. Models that grow over the record come last, and after them methods that leave no model.
pub(super) fn is_better(a: &Estimate, b: &Estimate, report: &Report) -> Ordering {
    let merit = |estimate: &Estimate| {
        let merit = if is_validated(report) {
            fit(estimate, report).map(|fit| fit.simulated)
        } else {
            bic(estimate, report).map(|bic| -bic)
        };
        merit.filter(|merit| merit.is_finite()).unwrap_or(f64::NEG_INFINITY)
    };
    let rank = |estimate: &Estimate| (merit(estimate) == f64::NEG_INFINITY, grows(estimate, report));
    rank(a).cmp(&rank(b)).then(merit(b).total_cmp(&merit(a)))
}

/// Whether the residuals are white; `None` where they are not tested.
pub(super) fn white(estimate: &Estimate) -> Option<bool> {
    let residuals = estimate.last().residuals.as_ref();
    let white = residuals.and_then(|residuals| residuals.white);
    Some(white.or(estimate.white)?.passed)
}

pub(super) fn status(estimate: &Estimate) -> String {
    match estimate.failure() {
        Some(failure) => failure.kind.to_string(),
        None if is_unstable(estimate) => "unstable".to_owned(),
        None => "ok".to_owned(),
    }
}

fn is_unstable(estimate: &Estimate) -> bool {
    estimate.last().fitted.pass.unstable
}

/// Whether a model is unstable, and more than an integrator is to rounding and noise: its slowest unstable mode doubles
/// within the record.
fn grows(estimate: &Estimate, report: &Report) -> bool {
    let radius = estimate.last().radius.unwrap_or(f64::INFINITY);
    is_unstable(estimate) && radius.powf(report.record.y.len() as f64) > 2.0
}

/// Writes models in their order, and why the first is the best.
pub(super) fn write(text: &mut Lines, report: &Report, ranked: &[&Estimate]) {
    let orders = |estimate: &Estimate| {
        let known = estimate.last().known_model();
        known.map_or("-".to_owned(), |model| model.orders().to_string())
    };
    let widest = |width: usize, of: &dyn Fn(&Estimate) -> usize| {
        ranked.iter().map(|estimate| of(estimate)).fold(width, usize::max)
    };
    let names = widest("method".len(), &|estimate| estimate.name.name().len());
    let shapes = widest("orders".len(), &|estimate| orders(estimate).len());
    let (method, shape) = ("method", "orders");
    text.line(format_args!(
        "\n{method:<names$} {shape:<shapes$}  FIT % 1 step        BIC white? status"
    ));
    for estimate in ranked {
        let told = |fit: Option<f64>| match fit.filter(|fit| fit.is_finite()) {
            None => "-".to_owned(),
            Some(fit) if fit.abs() < 1e3 => format!("{fit:.2}"),
            Some(fit) => format!("{fit:.0e}"),
        };
        let fit = fit(estimate, report);
        text.line(format_args!(
            "{:<names$} {:<shapes$} {:>6} {:>6} {:>10} {:<6} {}",
            estimate.name.name(),
            orders(estimate),
            told(fit.map(|fit| fit.simulated)),
            told(fit.map(|fit| fit.one_step)),
            bic(estimate, report).map_or("-".to_owned(), |bic| format!("{bic:.1}")),
            match white(estimate) {
                None => "-",
                Some(true) => "yes",
                Some(false) => "NO",
            },
            status(estimate)
        ));
    }
    text.line("");
    text.paragraph(&reason(report, ranked), "");
    let begun = ranked.iter().filter(|of| of.start_chance.is_some());
    let begun: Vec<&str> = begun.map(|of| of.name.name()).collect();
    if !begun.is_empty() {
        let line = format!(
            "The record does not begin at rest: the start is fitted with {}.",
            begun.join(", ")
        );
        text.paragraph(&line, "");
    }
    let best = ranked.first().and_then(|of| fit(of, report));
    if best.is_some_and(|fit| fit.simulated <= 0.0) {
        text.paragraph(USELESS, "");
    }
}

/// Where the first FIT is not above 0.
const USELESS: &str = "No model simulates y there better than its mean does (FIT 0 %): of a plant that only its loop \
                       holds stable judge by one step; where y stands still there, take other samples (--window, \
                       --validate).";

/// The hints on the model that is not printed whole.
pub(super) fn hints(text: &mut Lines, best: &Estimate) {
    for hint in &best.hints {
        text.paragraph(&format!("hint on {}: {hint}", best.name), "  ");
    }
}

/// Says what the order of the table is by, and how far the first is from the second.
fn reason(report: &Report, ranked: &[&Estimate]) -> String {
    let by_fit = "FIT of the simulated output there";
    let (place, by) = match (&report.validation, is_validated(report)) {
        (Some(_), _) => ("the record for validation", by_fit),
        (None, true) => ("the samples after the window", by_fit),
        (None, false) => (
            "the window",
            "BIC, since no samples are left for validation (--window 70% leaves some)",
        ),
    };
    let ahead = match ranked {
        [first, second, ..] => {
            let numbers = if is_validated(report) {
                let of = |estimate: &Estimate| fit(estimate, report).map(|fit| fit.simulated);
                of(first).zip(of(second)).map(|(a, b)| (a - b, 2, " %"))
            } else {
                let of = |estimate: &Estimate| bic(estimate, report);
                of(first).zip(of(second)).map(|(a, b)| (b - a, 1, ""))
            };
            // Of two useless models none leads.
            let useless = fit(first, report).is_some_and(|fit| fit.simulated <= 0.0);
            let told = numbers.filter(|(by, ..)| by.is_finite() && !useless);
            told.map_or_else(String::new, |(by, digits, unit)| {
                format!(", {by:.digits$}{unit} ahead of {}", second.name)
            })
        }
        _ => String::new(),
    };
    let last = if ranked.iter().any(|of| grows(of, report)) {
        ", unstable models last"
    } else {
        ""
    };
    match ranked.first().filter(|first| fit(first, report).is_some()) {
        Some(first @ Estimate { name, .. }) => {
            let whites: Vec<&str> = ranked
                .iter()
                .filter(|of| white(of) == Some(true))
                .map(|of| of.name.name())
                .collect();
            let alone = if whites.is_empty() || white(first) == Some(true) {
                String::new()
            } else {
                let names = whites.join(", ");
                format!(" White residuals, on which standard errors rest, have {names}.")
            };
            format!("FIT % (simulated) and 1 step: on {place}. Best first by {by}{last}: {name}{ahead}.{alone}")
        }
        None => "No method leaves a model.".to_owned(),
    }
}

/// The command that was given, without some of its flags and their values.
pub(super) fn command(without: &[&str]) -> String {
    let mut words = std::env::args_os().skip(1);
    let mut command = "asobench".to_owned();
    while let Some(word) = words.next() {
        let word = word.to_string_lossy();
        let (flag, value) = word
            .split_once('=')
            .map_or((&*word, None), |(flag, value)| (flag, Some(value)));
        let flag = match flag {
            "--estimators" | "--method" | "--methods" => "--estimator",
            flag => flag,
        };
        if without.contains(&flag) {
            if value.is_none() {
                words.next();
            }
        } else {
            command.extend([" ", &shell_word(word)]);
        }
    }
    command
}
