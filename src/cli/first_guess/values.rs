//! What follows from the value of a flag.

use crate::names::here;
use crate::text::rounded;

/// What is meant by a flag with a value that it does not take.
pub(super) fn meant(flag: &str, value: &str) -> Option<String> {
    match flag {
        "--missing" => here(value, &["longest-run"]).map(|run| format!("--missing {run}")),
        "--delay" | "--order" if ["auto", "best", "estimate"].contains(&value) => {
            Some(format!("{flag} 1:8"))
        }
        "--plot" if value.contains(',') => {
            let kinds: Vec<String> = value
                .split(',')
                .map(|kind| format!("--plot {kind}"))
                .collect();
            Some(kinds.join(" "))
        }
        "--plot" | "--out" => {
            let (stem, _) = value.rsplit_once('.')?;
            Some(format!("{flag} {stem}.svg"))
        }
        "--validate" | "--validation" => window(value),
        _ => None,
    }
}

/// `--window` of the share of the samples that is for validation: 0.3 or 30%.
pub(super) fn window(validated: &str) -> Option<String> {
    per_cent(validated).map(|share| format!("--window {}%", rounded(100.0 - share, 6)))
}

/// `--window` of the share that is estimated from.
pub(super) fn training(share: &str) -> Option<String> {
    per_cent(share).map(|share| format!("--window {}%", rounded(share, 6)))
}

/// A share between 0 and 1, or in per cent. A number of 1 or more may be one of samples.
fn per_cent(given: &str) -> Option<f64> {
    let share = match given.strip_suffix('%') {
        Some(number) => number.trim().parse().ok()?,
        None => 100.0 * given.parse::<f64>().ok()?,
    };
    (share > 0.0 && share < 100.0).then_some(share)
}

/// A picture, unless numbers are asked for.
pub(super) fn residuals(file: &str) -> Option<String> {
    let form = file.rsplit_once('.').map_or("", |(_, form)| form);
    match form {
        "csv" | "txt" | "json" => None,
        "svg" | "pdf" => Some(format!("--plot residuals={file}")),
        _ => Some("--plot residuals".to_owned()),
    }
}

/// The number of coefficients of B from that of its zeros.
pub(super) fn coefficients(zeros: &str) -> Option<String> {
    let zeros: usize = zeros.parse().ok().filter(|zeros| *zeros < 100)?;
    Some(format!("--nb {}", zeros + 1))
}

/// `--order 1:8` of `8`, `1:8` or `1..8`.
pub(super) fn range(given: &str) -> Option<String> {
    let (first, last) = given
        .split_once(':')
        .or_else(|| given.split_once(".."))
        .unwrap_or(("1", given));
    let number = |text: &str| text.trim().parse::<usize>().ok();
    Some(format!("--order {}:{}", number(first)?, number(last)?))
}

/// `--ts` of a sampling rate in Hz.
pub(super) fn period(rate: &str) -> Option<String> {
    let rate: f64 = rate.parse().ok().filter(|rate: &f64| *rate > 0.0)?;
    Some(format!("--ts {}", rounded(1.0 / rate, 9)))
}

/// The noise level of an SNR in dB.
pub(super) fn noise_of_snr(given: &str) -> Option<String> {
    let given = given.trim_end_matches("dB").trim_end_matches("db");
    let decibels: f64 = given.parse().ok().filter(|of: &f64| of.abs() < 200.0)?;
    Some(format!(
        "--set eta={}",
        rounded(100.0 / 10_f64.powf(decibels / 20.0), 3)
    ))
}

/// A colour of noise; of a number it is not known what it is relative to.
pub(super) fn noise(given: &str) -> Option<String> {
    let is_name = !given.is_empty() && given.parse::<f64>().is_err();
    is_name.then(|| format!("--set noise={given}"))
}

/// `--paper` of a word with the name of a paper.
pub(super) fn paper(given: &str) -> Option<String> {
    let papers = ["nikolov", "bobtsov"];
    papers
        .iter()
        .find(|name| given.starts_with(**name))
        .map(|name| format!("--paper {name}"))
}

/// What writes a file of such a name: a page, a picture, or the states.
pub(super) fn written(file: &str) -> Option<String> {
    let (stem, kind) = file.rsplit_once('.')?;
    match kind {
        "html" => Some(format!("--report {file}")),
        "json" => Some("--format json".to_owned()),
        "svg" | "pdf" => Some(format!("--plot {file}")),
        "png" | "eps" | "jpg" => Some(format!("--plot {stem}.svg")),
        _ => None,
    }
}

/// The trial of the first cell, if it is a number.
pub(super) fn of_first_cell(trial: &str) -> Option<String> {
    let trial: u64 = trial.parse().ok()?;
    Some(format!("0:{trial}"))
}
