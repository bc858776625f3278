//! B1 to B3: the GPEBO observer of Bobtsov et al. (2023) under disturbances.

use super::{Finding, Number, Ratio, Standing, Studies, condition, count_of, listed, settle};
use crate::report::number::uncertain;
use crate::report::results::{Study, place, statistics};
use crate::study::file::Key;
use crate::study::{CellSummary, ComparisonSummary, Figure};

const PROPOSED: &str = "proposed";

/// The comparison of the proposed estimator with another output.
fn against<'a>(cell: &'a CellSummary, other: &str) -> Option<&'a ComparisonSummary> {
    cell.comparisons
        .iter()
        .find(|pair| pair.first == PROPOSED && pair.second == other)
}

/// The median over the trials of a figure of the proposed estimator over that of another output.
fn ratio(cell: &CellSummary, other: &str, figure: Figure) -> Option<Ratio> {
    Ratio::paired(against(cell, other)?.figures.get(&figure)?.median_ratio)
}

/// Whether the proposed estimate of theta settles as fast as the gradient's: not in fewer trials, and not later by
/// more than 5 % where both do. `None` where that is open or nothing settles.
fn as_fast(cell: &CellSummary) -> Option<bool> {
    let of = against(cell, "gradient")?.figures.get(&Figure::Settling)?;
    if of.only_second > of.only_first {
        return Some(false);
    }
    match Ratio::paired(of.median_ratio)?.standing() {
        Standing::Above => Some(false),
        Standing::Same | Standing::Below => Some(true),
        Standing::Open => None,
    }
}

/// What a cell says: it holds, it does not, or that is open.
type Says = Option<bool>;

/// Below, by more than 5 %.
fn below(ratio: Option<Ratio>) -> Says {
    match ratio?.standing() {
        Standing::Below => Some(true),
        Standing::Same | Standing::Above => Some(false),
        Standing::Open => None,
    }
}

/// Both must hold.
fn both(first: Says, second: Says) -> Says {
    match (first, second) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

/// A verdict over cells.
fn judge(
    study: &Study,
    told: &[(&CellSummary, Says)],
    because: String,
    numbers: Vec<Number>,
) -> Finding {
    let of = |wanted: Says| -> Vec<&CellSummary> {
        let is = told.iter().filter(|(_, says)| *says == wanted);
        is.map(|(cell, _)| *cell).collect()
    };
    let [holds, fails, open] = [Some(true), Some(false), None].map(of);
    let verdict = settle(holds.len(), fails.len(), open.len());
    Finding::new(study, verdict, because)
        .numbers(numbers)
        .led_by(&condition(study, &holds, &fails))
}

/// Ratios of a figure over the cells, as numbers and as the range that they span.
fn ratios(study: &Study, other: &str, figure: Figure) -> (Vec<Number>, String) {
    let cells = study.summary.cells.iter();
    let mut found: Vec<(&CellSummary, Ratio)> = cells
        .filter_map(|cell| Some((cell, ratio(cell, other, figure)?)))
        .collect();
    let name = |cell: &CellSummary| {
        format!(
            "{figure}, proposed over {other}: {}",
            place(cell, &study.varying())
        )
    };
    let numbers = found
        .iter()
        .map(|(cell, of)| of.number(name(cell)))
        .collect();
    found.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let at = |(cell, of): &(&CellSummary, Ratio)| {
        format!("{} ({})", of.text(), place(cell, &study.varying()))
    };
    let text = match found.as_slice() {
        [] => "undefined".to_owned(),
        [one] => at(one),
        [least, .., most] => format!("from {} to {}", at(least), at(most)),
    };
    (numbers, text)
}

/// What the paper's own example shows, where it was run.
fn example(studies: Studies<'_>, figure: Figure, what: &str) -> String {
    let cell = studies
        .named("gpebo-figures")
        .and_then(|study| study.summary.cells.last());
    let Some(cell) = cell else {
        return String::new();
    };
    let told = |label: &str| {
        let value = statistics(cell, label, figure)?.mean.value;
        value
            .is_finite()
            .then(|| format!("{label} {}", uncertain(value, f64::NAN)))
    };
    let all: Vec<String> = cell
        .outputs
        .iter()
        .filter_map(|output| told(&output.label()))
        .collect();
    format!("In the paper's example {what} {}.", all.join(", "))
}

/// B1: in every cell of random disturbances the median ratio of the errors of theta over the scored time must be below
/// 1 by more than 5 %, and theta must settle within 10 % as often and as fast as the gradient's.
pub(super) fn parameters(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("gpebo-noise") else {
        return Finding::not_run("gpebo-noise");
    };
    let exact = |cell: &CellSummary| below(ratio(cell, "gradient", Figure::ThetaRms));
    let cells = || study.summary.cells.iter();
    let told: Vec<(&CellSummary, Says)> = cells()
        .map(|cell| (cell, both(exact(cell), as_fast(cell))))
        .collect();
    let count = |says: &dyn Fn(&CellSummary) -> Says| {
        let yes = cells().filter(|cell| says(cell) == Some(true)).count();
        count_of(yes, told.len())
    };
    let (numbers, range) = ratios(study, "gradient", Figure::ThetaRms);
    let because = format!(
        "The proposed estimate of theta is more exact than the gradient's (rms error from 8 s on, more than 5 %) in {} cells, and settles within 10 % as often and as fast in {}. Its error over the gradient's, median of the trials: {range}.",
        count(&exact),
        count(&as_fast),
    );
    let shown = example(
        studies,
        Figure::ThetaRms,
        "the relative rms errors of theta are:",
    );
    judge(study, &told, because, numbers).part("gpebo-figures", &shown)
}

/// B2: the same of the state, beside the gradient and beside the full-order observer.
pub(super) fn state(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("gpebo-noise") else {
        return Finding::not_run("gpebo-noise");
    };
    let better = |cell: &CellSummary, other: &str| below(ratio(cell, other, Figure::RmsState));
    let cells = || study.summary.cells.iter();
    let told: Vec<(&CellSummary, Says)> = cells()
        .map(|cell| {
            (
                cell,
                both(better(cell, "gradient"), better(cell, "luenberger")),
            )
        })
        .collect();
    let count = |other: &str| {
        let yes = cells()
            .filter(|cell| better(cell, other) == Some(true))
            .count();
        count_of(yes, told.len())
    };
    let (mut numbers, gradient) = ratios(study, "gradient", Figure::RmsState);
    let (others, luenberger) = ratios(study, "luenberger", Figure::RmsState);
    numbers.extend(others);
    let because = format!(
        "The state is better than with the gradient in {} cells (rms error over its: {gradient}), and than with the full-order observer in {} ({luenberger}).",
        count("gradient"),
        count("luenberger"),
    );
    let shown = example(
        studies,
        Figure::RmsState,
        "the rms errors of the state are:",
    );
    judge(study, &told, because, numbers).part("gpebo-figures", &shown)
}

/// B3: in every cell, whatever the disturbance, a typical trial must end within 10 % of theta.
pub(super) fn no_information(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("gpebo-amplitude") else {
        return Finding::not_run("gpebo-amplitude");
    };
    let share = |cell: &CellSummary, bound: usize| {
        let bound = cell.bounds.get(bound)?;
        let of = bound.outputs.iter().find(|of| of.output == PROPOSED)?;
        Some(of.met)
    };
    let says = |cell: &CellSummary| match share(cell, 0)? {
        met if met.low > 0.5 => Some(true),
        met if met.high < 0.5 => Some(false),
        _ => None,
    };
    let told: Vec<(&CellSummary, Says)> = study
        .summary
        .cells
        .iter()
        .map(|cell| (cell, says(cell)))
        .collect();
    let (mut converged, mut nearer, mut all) = (0.0, 0.0, 0.0);
    let mut numbers = Vec::new();
    for cell in &study.summary.cells {
        let (Some(met), Some(near)) = (share(cell, 0), share(cell, 1)) else {
            continue;
        };
        let trials = cell.trials as f64;
        converged += met.share * trials;
        nearer += (near.share - met.share) * trials;
        all += trials;
        let name = format!("share converged: {}", place(cell, &study.varying()));
        numbers.push(Number::new(name, met.share, met.mcse));
    }
    if all == 0.0 {
        return Finding::undecided(study, "The results lack the shares of the output proposed.");
    }
    let levels = study.values(Key::Level);
    let by_level: Vec<String> = levels
        .iter()
        .map(|level| {
            let cells = study.cells(&[(Key::Level, level)]);
            let all: f64 = cells.iter().map(|cell| cell.trials as f64).sum();
            let of = |cell: &&CellSummary| Some(share(cell, 0)?.share * cell.trials as f64);
            let met: f64 = cells.iter().filter_map(of).sum();
            format!("{:.0} % at {level}", 100.0 * met / all)
        })
        .collect();
    let yes = told.iter().filter(|(_, says)| *says == Some(true)).count();
    let percent = |count: f64| format!("{:.0} %", 100.0 * count / all);
    let because = format!(
        "A typical trial comes within 10 % of theta in {} cells. Of all trials {} converge, {} stop short of it, {} end no nearer than they began or fail; without a disturbance the regressors of (17) are collinear and the estimate never moves. By level of the disturbance converge {}.",
        count_of(yes, told.len()),
        percent(converged),
        percent(nearer),
        percent(all - converged - nearer),
        listed(&by_level),
    );
    judge(study, &told, because, numbers)
}
