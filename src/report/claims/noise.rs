//! C4: how errors fall with N, and where instruments help.
//!
//! The claim's "proportion" is tested twice: of the error itself (slope -1 of log error on log N) and of its square
//! (slope -1/2). A slope is one of these where its 95 % interval comes within 0.05 of it, and not of the other.

use super::{Finding, Number, Ratio, Standing, Studies, count_of, listed};
use crate::report::html::Verdict;
use crate::report::number::uncertain;
use crate::report::results::{Study, figure_name, median, shown, words};
use crate::study::file::Key;
use crate::study::{CellSummary, Figure, SlopeSummary};

/// How far a slope may be from the theory's.
const SLOPE_MARGIN: f64 = 0.05;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Rate {
    Error,
    Square,
    Neither,
    Open,
}

fn rate_of(slope: &SlopeSummary) -> Option<Rate> {
    let (low, high) = slope.slope?.interval();
    let near = |centre: f64| low < centre + SLOPE_MARGIN && high > centre - SLOPE_MARGIN;
    Some(match (near(-1.0), near(-0.5)) {
        (true, false) => Rate::Error,
        (false, true) => Rate::Square,
        (false, false) => Rate::Neither,
        (true, true) => Rate::Open,
    })
}

/// The slopes of the median of e_a over N: every noise, one output.
fn slopes<'a>(study: &'a Study, output: &str) -> Vec<&'a SlopeSummary> {
    let wanted = |slope: &&SlopeSummary| {
        let of = &slope.of;
        slope.output == output
            && of.over == Key::Window
            && of.figure == Figure::Ea
            && of.statistic == crate::metric::SlopeOf::Median
            && slope.slope.is_some()
    };
    study.summary.slopes.iter().filter(wanted).collect()
}

fn slope_text(slope: &SlopeSummary) -> String {
    let case = slope
        .settings
        .get(&Key::Noise)
        .map_or_else(String::new, |noise| {
            format!(" under {}", words(Key::Noise, &noise.to_string()))
        });
    let value = slope
        .slope
        .map_or_else(|| "-".to_owned(), |of| uncertain(of.value, of.mcse));
    format!("{value}{case}")
}

/// C4.
pub(super) fn rate(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("window") else {
        return Finding::not_run("window");
    };
    let output = study.main_output().unwrap_or_default();
    let found = slopes(study, &output);
    let rates: Vec<Rate> = found.iter().filter_map(|slope| rate_of(slope)).collect();
    if rates.is_empty() {
        return Finding::undecided(
            study,
            "The results have no slope of the median of e_a over N.",
        );
    }
    let count = |which: Rate| rates.iter().filter(|rate| **rate == which).count();
    let [error, square, neither, open] =
        [Rate::Error, Rate::Square, Rate::Neither, Rate::Open].map(count);
    let all = rates.len();
    let (verdict, judgement) = if error == all {
        (
            Verdict::Holds,
            "the error itself falls in proportion to 1/N",
        )
    } else if error + square == all || (square > 0 && open == 0) {
        (
            Verdict::HoldsOnlyIf,
            "the error's square falls in proportion to 1/N, the error as 1/sqrt(N)",
        )
    } else if neither == all {
        (
            Verdict::DoesNotHold,
            "neither the error nor its square falls in proportion to 1/N",
        )
    } else {
        (
            Verdict::Undecided,
            "the intervals hold more than one rate, or rates differ",
        )
    };
    let texts: Vec<String> = found.iter().map(|slope| slope_text(slope)).collect();
    let mut because = format!(
        "The slope of log median e_a on log N with {} is {}: {judgement}",
        shown(&output),
        listed(&texts)
    );
    if neither > 0 && verdict == Verdict::HoldsOnlyIf {
        because.push_str(&format!(", in {} cases", count_of(square, all)));
    }
    because.push('.');
    let least = slopes(study, "ls");
    if !least.is_empty() {
        let texts: Vec<String> = least.iter().map(|slope| slope_text(slope)).collect();
        because.push_str(&format!(" Least squares: {}", listed(&texts)));
        because.push_str(&floor(study));
    }
    let colours = studies
        .named("noise-colour")
        .map(beaten)
        .unwrap_or_default();
    let number = |slope: &&SlopeSummary| {
        let of = slope.slope?;
        Some(Number::new(
            format!("slope, {} {}", slope.output, slope_text(slope)),
            of.value,
            of.mcse,
        ))
    };
    let numbers = found.iter().chain(&least).filter_map(number).collect();
    Finding::new(study, verdict, because)
        .numbers(numbers)
        .part("noise-colour", &colours)
}

/// The floor that bias gives to least squares in white noise.
fn floor(study: &Study) -> String {
    let mut cells: Vec<&CellSummary> = study.cells(&[(Key::Noise, "white")]);
    cells.sort_by_key(|cell| cell.window);
    let [.., before, last] = cells.as_slice() else {
        return ".".to_owned();
    };
    let (a, b) = (
        median(before, "ls", Figure::Ea),
        median(last, "ls", Figure::Ea),
    );
    match Ratio::of(b, a).map(Ratio::standing) {
        Some(Standing::Same) => format!(
            "; in white noise its bias is a floor of {} from N = {} to {}.",
            uncertain(b.value, b.mcse),
            before.window,
            last.window
        ),
        Some(Standing::Below) => format!(
            "; in white noise it still falls from N = {} to {}.",
            before.window, last.window
        ),
        _ => ".".to_owned(),
    }
}

/// Where IV beats least squares on the same trials, by noise.
fn beaten(study: &Study) -> String {
    let figure = Figure::Ea;
    let better = |cell: &CellSummary| {
        let pair = cell
            .comparisons
            .iter()
            .find(|pair| pair.first == "iv(4)" && pair.second == "ls");
        let ratio = Ratio::paired(pair?.figures.get(&figure)?.median_ratio)?;
        Some(ratio.high < 1.0)
    };
    let text = |noise: &String| {
        let of_noise = study.cells(&[(Key::Noise, noise)]);
        let judged: Vec<(usize, bool)> = of_noise
            .iter()
            .filter_map(|cell| Some((cell.window, better(cell)?)))
            .collect();
        let name = words(Key::Noise, noise);
        let first = judged
            .iter()
            .filter(|(_, better)| *better)
            .map(|(n, _)| *n)
            .min();
        first.map_or_else(
            || format!("nowhere in {name}"),
            |n| {
                let of: Vec<&(usize, bool)> =
                    judged.iter().filter(|(window, _)| *window >= n).collect();
                let wins = of.iter().filter(|(_, better)| *better).count();
                format!(
                    "from N = {n} on in {name} ({} cells)",
                    count_of(wins, of.len())
                )
            },
        )
    };
    let texts: Vec<String> = study.values(Key::Noise).iter().map(text).collect();
    format!(
        " By the paired {} IV(4) beats its own iteration 0 {}.",
        figure_name(figure),
        listed(&texts)
    )
}
