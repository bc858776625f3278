//! C4: how errors fall with N, and where instruments help.
//!
//! The claim's "proportion" is tested twice: of the error itself (slope -1 of log error on log N) and of its square
//! (slope -1/2). A slope is one of these where its 95 % interval comes within 0.05 of it, and not of the other.

use super::{Finding, Number, Ratio, Standing, Studies, count_of, listed};
use crate::report::html::Verdict;
use crate::report::number::uncertain;
use crate::report::results::{Study, measure_name, median, shown, words};
use crate::study::file::Key;
use crate::study::{CellSummary, Measure, SlopeSummary};

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
    // A slope without standard error is near both.
    let near = |centre: f64| !(low >= centre + SLOPE_MARGIN || high <= centre - SLOPE_MARGIN);
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
            && of.measure == Measure::Ea
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
            "The error itself falls in proportion to 1/N",
        )
    } else if error + square == all || (square > 0 && open == 0) {
        (
            Verdict::HoldsOnlyIf,
            "It holds for the square of the error, which falls as 1/N, the error itself as 1/sqrt(N)",
        )
    } else if neither == all {
        (
            Verdict::DoesNotHold,
            "Neither the error nor its square falls in proportion to 1/N",
        )
    } else {
        (
            Verdict::Undecided,
            "The intervals hold more than one rate, or rates differ",
        )
    };
    let texts: Vec<String> = found.iter().map(|slope| slope_text(slope)).collect();
    let cases = if neither > 0 && verdict == Verdict::HoldsOnlyIf {
        format!(", in {} cases", count_of(square, all))
    } else {
        String::new()
    };
    let mut because = format!(
        "{judgement}{cases}: the slope of log median e_a on log N with {} is {}.",
        shown(&output),
        listed(&texts)
    );
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
        median(before, "ls", Measure::Ea),
        median(last, "ls", Measure::Ea),
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
    let measure = Measure::Ea;
    let better = |cell: &CellSummary| {
        let pair = cell
            .comparisons
            .iter()
            .find(|pair| pair.first == "iv(4)" && pair.second == "ls");
        let ratio = Ratio::paired(pair?.measures.get(&measure)?.median_ratio)?;
        ratio.high.is_finite().then_some(ratio.high < 1.0)
    };
    let etas = match study.values(Key::Eta).len() {
        0 | 1 => "",
        _ => "at every eta ",
    };
    let text = |noise: &String| {
        let of_noise = study.cells(&[(Key::Noise, noise)]);
        let judged: Vec<(usize, bool)> = of_noise
            .iter()
            .filter_map(|cell| Some((cell.window, better(cell)?)))
            .collect();
        let name = words(Key::Noise, noise);
        let wins = judged.iter().filter(|(_, better)| *better).count();
        let lost = judged.iter().filter(|(_, better)| !*better);
        let last = lost.map(|(n, _)| *n).max();
        let from = judged
            .iter()
            .map(|(n, _)| *n)
            .filter(|n| Some(*n) > last)
            .min();
        match (wins, from) {
            (0, _) => (0, format!("in no cell under {name}")),
            (_, Some(n)) => (1, format!("{etas}from N = {n} on under {name}")),
            _ => {
                let count = count_of(wins, judged.len());
                (2, format!("in {count} cells under {name}"))
            }
        }
    };
    let values = study.values(Key::Noise);
    let mut texts: Vec<(u8, String)> = values.iter().map(text).collect();
    texts.sort_by_key(|(order, _)| *order);
    let texts: Vec<String> = texts.into_iter().map(|(_, text)| text).collect();
    format!(
        " On the same trials {} of IV(4) is smaller than that of its iteration 0 {}.",
        measure_name(measure),
        listed(&texts)
    )
}
