//! Consequences of the value of a flag.

use crate::estimator::EstimatorName;
use crate::names::here;
use crate::text::rounded;

/// Returns what is typed by a template of the table for an argument with a value, which may be empty; `None` where the
/// value does not determine it.
pub(super) fn typed(template: &str, argument: &str, value: &str) -> Option<Vec<String>> {
    let filled = |word: &str| {
        let Some((before, rest)) = word.split_once('{') else {
            return Some(word.to_owned());
        };
        let (reading, after) = rest.split_once('}')?;
        Some(format!("{before}{}{after}", read(reading, argument, value)?))
    };
    template.split(" / ").find_map(|words| {
        let words = words.split_whitespace().map(filled);
        let words = words.filter(|word| word.as_deref() != Some(""));
        words.collect()
    })
}

/// Returns what a reading of the table makes of a value.
fn read(reading: &str, argument: &str, value: &str) -> Option<String> {
    let number = || value.parse::<f64>().ok();
    let file = value.rsplit_once('.');
    let is = |kinds: &[&str]| file.is_some_and(|(_, kind)| kinds.contains(&kind));
    let text = match reading {
        "" => Some(value).filter(|value| !value.is_empty())?.to_owned(),
        "none" => String::new(),
        "setting" => format!("{}={value}", argument.trim_start_matches('-')),
        "estimator" => {
            let names: Vec<&str> = EstimatorName::ALL.iter().map(|name| name.name()).collect();
            let known = names.iter().copied().find(|name| *name == value);
            known.or_else(|| here(value, &names))?.to_owned()
        }
        // The share of the samples for validation, and the one that is estimated from.
        "rest" => rounded(100.0 - per_cent(value)?, 6),
        "share" => rounded(per_cent(value)?, 6),
        // B has a coefficient more than zeros.
        "coefficients" => (value.parse::<usize>().ok().filter(|zeros| *zeros < 100)? + 1).to_string(),
        "range" => range(value)?,
        // A sampling rate in Hz.
        "period" => rounded(1.0 / number().filter(|rate| *rate > 0.0)?, 9),
        // An SNR in dB.
        "eta" => {
            let ratio = value.trim_end_matches("dB").trim_end_matches("db");
            let ratio: f64 = ratio.parse().ok().filter(|ratio: &f64| ratio.abs() < 200.0)?;
            rounded(100.0 / 10_f64.powf(ratio / 20.0), 3)
        }
        // Of a number it is not known what it is relative to.
        "colour" if !value.is_empty() && number().is_none() => value.to_owned(),
        "paper" => {
            let mut papers = ["nikolov", "bobtsov"].into_iter();
            papers.find(|name| value.starts_with(name))?.to_owned()
        }
        "trial" => value.parse::<u64>().ok()?.to_string(),
        "html" if is(&["html"]) => value.to_owned(),
        "json" if is(&["json"]) => "json".to_owned(),
        "picture" if is(&["svg", "pdf"]) => value.to_owned(),
        "stem" if is(&["png", "eps", "jpg"]) => file?.0.to_owned(),
        // Residuals are not written as numbers.
        "drawn" if !is(&["csv", "txt", "json"]) => String::new(),
        _ => return None,
    };
    Some(text)
}

/// A share between 0 and 1, or in per cent. A number of 1 or more may be one of samples.
fn per_cent(given: &str) -> Option<f64> {
    let share = match given.strip_suffix('%') {
        Some(number) => number.trim().parse().ok()?,
        None => 100.0 * given.parse::<f64>().ok()?,
    };
    (share > 0.0 && share < 100.0).then_some(share)
}

/// `1:8` of `8`, `1:8` or `1..8`.
fn range(given: &str) -> Option<String> {
    let parts = given.split_once(':').or_else(|| given.split_once(".."));
    let (first, last) = parts.unwrap_or(("1", given));
    let number = |text: &str| text.trim().parse::<usize>().ok();
    Some(format!("{}:{}", number(first)?, number(last)?))
}

/// The meaning of a flag with a value that it does not take.
pub(super) fn meant(flag: &str, value: &str) -> Option<Vec<String>> {
    let values = match flag {
        "--missing" => vec![here(value, &["longest-run"])?.to_owned()],
        "--delay" | "--order" if ["auto", "best", "estimate"].contains(&value) => {
            vec!["1:8".to_owned()]
        }
        "--plot" if value.contains(',') => value.split(',').map(str::to_owned).collect(),
        "--plot" | "--out" => vec![format!("{}.svg", value.rsplit_once('.')?.0)],
        "--validate" | "--validation" => return typed("--window {rest}%", flag, value),
        _ => return None,
    };
    let flagged = values.into_iter().map(|value| [flag.to_owned(), value]);
    Some(flagged.flatten().collect())
}
