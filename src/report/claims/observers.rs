//! K1: no observer of the same information beats the Kalman filter; and what not knowing the plant costs.

use super::{Finding, Number, Studies};
use crate::metric::Quantile;
use crate::report::html::Verdict;
use crate::report::number::uncertain;
use crate::report::results::{Study, place};
use crate::study::file::Key;
use crate::study::{CellSummary, ComparisonSummary, Measure};

/// The best that knows plant and noise.
const FILTER: &str = "known observer=kalman-varying";

/// Standard errors by which an observer must beat the filter to refute the law.
const ERRORS: f64 = 4.0;

/// Stored numbers have nine digits.
const ROUNDING: f64 = 1e-8;

/// The root mean square of an observer's error over that of the filter, on the same trials.
fn ratio(pair: &ComparisonSummary) -> Option<(f64, f64)> {
    let of = pair.measures.get(&Measure::RmsState)?.rmse_ratio;
    of.value.is_finite().then_some((of.value, of.mcse))
}

/// The pairs of a cell that compare with the filter, of those that know the plant or of those that do not.
fn pairs(cell: &CellSummary, known: bool) -> impl Iterator<Item = &ComparisonSummary> {
    let pairs = cell.comparisons.iter();
    pairs.filter(move |pair| pair.second == FILTER && pair.first.starts_with("known") == known)
}

/// The median ratio of a pair over the cells with process noise, in words.
fn price(study: &Study, first: &str, second: &str) -> (String, Vec<Number>) {
    let noisy = |cell: &&CellSummary| !matches!(cell.setting(Key::ProcessNoise).as_str(), "" | "0");
    let mut found: Vec<(&CellSummary, Quantile)> = Vec::new();
    for cell in study.summary.cells.iter().filter(noisy) {
        let pair = cell
            .comparisons
            .iter()
            .find(|of| of.first == first && of.second == second);
        let of = pair.and_then(|pair| pair.measures.get(&Measure::RmsState));
        found.extend(of.map(|of| (cell, of.median_ratio)));
    }
    found.retain(|(_, of)| of.value.is_finite());
    let numbers = found.iter().map(|(cell, of)| {
        let name = format!(
            "rms_x, {first} over {second}: {}",
            place(cell, &study.varying())
        );
        Number::new(name, of.value, of.mcse)
    });
    let numbers = numbers.collect();
    found.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let text = |of: &Quantile| uncertain(of.value, of.mcse);
    let range = match found.as_slice() {
        [] => "undefined".to_owned(),
        [(_, one)] => text(one),
        [(_, least), .., (_, most)] => format!("{} to {}", text(least), text(most)),
    };
    (range, numbers)
}

/// K1: in no cell may an observer that knows what the filter knows have an RMS error below the filter's by more than four
/// standard errors of their ratio.
pub(super) fn kalman(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("observer-comparison") else {
        return Finding::not_run("observer-comparison");
    };
    let mut compared: Vec<(&CellSummary, &ComparisonSummary, f64, f64)> = Vec::new();
    for cell in &study.summary.cells {
        let of = pairs(cell, true).filter_map(|pair| Some((pair, ratio(pair)?)));
        compared.extend(of.map(|(pair, (value, mcse))| (cell, pair, value, mcse)));
    }
    let least = compared.iter().min_by(|a, b| a.2.total_cmp(&b.2));
    let Some((cell, pair, value, mcse)) = least else {
        let why = format!("The results lack comparisons of rms_x with {FILTER}.");
        return Finding::undecided(study, &why);
    };
    let beats = |value: f64, mcse: f64| value < 1.0 - ERRORS * mcse - ROUNDING;
    let beaten = compared
        .iter()
        .filter(|(_, _, value, mcse)| beats(*value, *mcse))
        .count();
    // A ratio of few trials has no standard error, so it may be that of a better observer.
    let open = compared.iter().any(|(.., mcse)| mcse.is_nan());
    let verdict = match (beaten, open) {
        (0, false) => Verdict::Holds,
        (0, true) => Verdict::Undecided,
        _ => Verdict::DoesNotHold,
    };
    let (model, mut numbers) = price(
        study,
        "iv observer=dead-beat(4)",
        "known observer=dead-beat",
    );
    let (dead_beat, more) = price(study, "iv observer=dead-beat(4)", FILTER);
    numbers.extend(more);
    let (identified, more) = price(study, "iv observer=kalman(4)", FILTER);
    numbers.extend(more);
    let because = format!(
        "Of {} comparisons over {} cells {beaten} have an RMS error of the state below the filter's by more than {ERRORS} standard errors; the smallest ratio is {} ({}, {}). Where there is process noise the adaptive observer with dead beat has {dead_beat} times the filter's error (medians), {model} times that of a dead-beat observer that knows the plant, which is the price of not knowing it; with a Kalman gain of identified noise {identified} times the filter's.",
        compared.len(),
        study.summary.cells.len(),
        uncertain(*value, if *mcse < ROUNDING { ROUNDING } else { *mcse }),
        pair.first,
        place(cell, &study.varying()),
    );
    numbers.extend(compared.iter().map(|(cell, pair, value, mcse)| {
        let name = format!(
            "RMS, {} over filter: {}",
            pair.first,
            place(cell, &study.varying())
        );
        Number::new(name, *value, *mcse)
    }));
    Finding::new(study, verdict, because).numbers(numbers)
}
