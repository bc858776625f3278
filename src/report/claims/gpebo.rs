//! B1 to B3: the GPEBO observer of Bobtsov et al. (2023) under disturbances.

use super::{Finding, Number, Ratio, Standing, Studies, condition, count_of, listed, settle};
use crate::metric::{Share, Z};
use crate::report::number::uncertain;
use crate::report::results::{Study, median, place, statistics};
use crate::study::file::Key;
use crate::study::{CellSummary, ComparisonSummary, Measure, OutputSummary};

const PROPOSED: &str = "proposed";

/// The comparison of the proposed estimator with another output.
fn against<'a>(cell: &'a CellSummary, other: &str) -> Option<&'a ComparisonSummary> {
    cell.comparisons
        .iter()
        .find(|pair| pair.first == PROPOSED && pair.second == other)
}

/// The median over the trials of a measure of the proposed estimator over that of another output.
fn ratio(cell: &CellSummary, other: &str, measure: Measure) -> Option<Ratio> {
    Ratio::paired(against(cell, other)?.measures.get(&measure)?.median_ratio)
}

/// How much less often the proposed estimator may come near theta and still do so as often: a share of the trials.
const LESS_OFTEN: f64 = 0.05;

/// Whether the proposed estimate of theta comes within 10 % as fast as the gradient's: as often, to within
/// [`LESS_OFTEN`], and not later by more than 5 % where both do. The interval of the difference of shares is that of
/// paired trials, by the normal approximation with half a trial added to each of the four counts (Agresti and Min
/// 2005), so that a few trials that agree leave it open.
fn as_fast(cell: &CellSummary) -> Says {
    let of = against(cell, "gradient")?
        .measures
        .get(&Measure::Reaching)?;
    let all = cell.trials as f64 + 2.0;
    let [first, second] = [of.only_first, of.only_second].map(|count| (count as f64 + 0.5) / all);
    let difference = first - second;
    let half = Z * ((first + second - difference * difference) / all).sqrt();
    let often = if difference - half > -LESS_OFTEN {
        Some(true)
    } else if difference + half < -LESS_OFTEN {
        Some(false)
    } else {
        None
    };
    both(often, not_above(Ratio::paired(of.median_ratio)))
}

/// Not above by more than 5 %.
fn not_above(ratio: Option<Ratio>) -> Says {
    match ratio?.standing() {
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

/// What every cell says.
fn tell(study: &Study, says: impl Fn(&CellSummary) -> Says) -> Vec<(&CellSummary, Says)> {
    let cells = study.summary.cells.iter();
    cells.map(|cell| (cell, says(cell))).collect()
}

/// In how many cells it holds: "2 of 9".
fn holding(told: &[(&CellSummary, Says)]) -> String {
    let yes = told.iter().filter(|(_, says)| *says == Some(true)).count();
    count_of(yes, told.len())
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

/// Ratios of a measure over the cells, as numbers and as the range that they span.
fn ratios(study: &Study, other: &str, measure: Measure) -> (Vec<Number>, String) {
    let cells = study.summary.cells.iter();
    let mut found: Vec<(&CellSummary, Ratio)> = cells
        .filter_map(|cell| Some((cell, ratio(cell, other, measure)?)))
        .collect();
    let name = |cell: &CellSummary| {
        format!(
            "{measure}, proposed over {other}: {}",
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

/// What the paper's own example shows at its shortest step, where it was run.
fn example(studies: Studies<'_>, measure: Measure, what: &str) -> String {
    let step = |cell: &&CellSummary| cell.setting(Key::Step).parse().unwrap_or(f64::INFINITY);
    let study = studies.named("gpebo-figures");
    let cells = study.map_or(&[][..], |study| &study.summary.cells);
    let Some(cell) = cells
        .iter()
        .min_by(|a, b| f64::total_cmp(&step(a), &step(b)))
    else {
        return String::new();
    };
    let told = |label: &str| {
        let value = statistics(cell, label, measure)?.mean.value;
        value
            .is_finite()
            .then(|| format!("{label} {}", uncertain(value, f64::NAN)))
    };
    let labels = cell.outputs.iter().map(OutputSummary::label);
    let all: Vec<String> = labels.filter_map(|label| told(&label)).collect();
    format!("In the paper's example {what} {}.", all.join(", "))
}

/// How many trials of the proposed estimator have failed: their figures are undefined, and no pair counts them.
fn failed(study: &Study) -> String {
    let cells = study.summary.cells.iter();
    let failed: u64 = cells
        .filter_map(|cell| cell.output(PROPOSED))
        .map(|of| of.outcomes.failed())
        .sum();
    match failed {
        0 => String::new(),
        some => format!(
            " Of the proposed estimator's {} trials {some} failed and are left out.",
            study.trials()
        ),
    }
}

/// B1: in every cell of random disturbances the median ratio of the errors of theta over the scored time must be below
/// 1 by more than 5 %, and theta must be reached within 10 % as often and as fast as with the gradient.
pub(super) fn parameters(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("gpebo-noise") else {
        return Finding::not_run("gpebo-noise");
    };
    let exact = |cell: &CellSummary| below(ratio(cell, "gradient", Measure::ThetaRms));
    let told = tell(study, |cell| both(exact(cell), as_fast(cell)));
    let (mut numbers, range) = ratios(study, "gradient", Measure::ThetaRms);
    let (times, later) = ratios(study, "gradient", Measure::Reaching);
    numbers.extend(times);
    let because = format!(
        "The proposed estimate of theta is more exact than the gradient's (rms error from 8 s on, more than 5 %) in {} cells, and comes within 10 % of theta as often and as fast in {} (time over the gradient's, where both do: {later}). Its error over the gradient's, median of the trials: {range}.{}",
        holding(&tell(study, exact)),
        holding(&tell(study, as_fast)),
        failed(study),
    );
    let shown = example(
        studies,
        Measure::ThetaRms,
        "the relative rms errors of theta are:",
    );
    judge(study, &told, because, numbers).part("gpebo-figures", &shown)
}

/// B2: the same of both states, each by itself, beside the gradient and beside the full-order observer.
pub(super) fn state(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("gpebo-noise") else {
        return Finding::not_run("gpebo-noise");
    };
    let better = |cell: &CellSummary, other: &str| {
        let of = |measure| below(ratio(cell, other, measure));
        both(of(Measure::RmsState1), of(Measure::RmsState2))
    };
    let than = |other| tell(study, move |cell| better(cell, other));
    let told = tell(study, |cell| {
        both(better(cell, "gradient"), better(cell, "luenberger"))
    });
    let (mut numbers, gradient) = ratios(study, "gradient", Measure::RmsState);
    let (others, luenberger) = ratios(study, "luenberger", Measure::RmsState);
    numbers.extend(others);
    let because = format!(
        "Both states are better than with the gradient in {} cells (rms of the whole error over its: {gradient}), and than with the full-order observer of the paper's gain in {} ({luenberger}).{}",
        holding(&than("gradient")),
        holding(&than("luenberger")),
        failed(study),
    );
    let shown = example(
        studies,
        Measure::RmsState,
        "the rms errors of the state are:",
    );
    judge(study, &told, because, numbers).part("gpebo-figures", &shown)
}

/// Whether the mixed disturbance is what the paper assumes in a typical trial: |dbar_i| < 1.
fn is_small(cell: &CellSummary) -> bool {
    median(cell, PROPOSED, Measure::MixedDisturbance).value < 1.0
}

/// The share of the proposed estimator's trials that meet a bound of the file.
fn share(cell: &CellSummary, bound: usize) -> Option<Share> {
    let outputs = &cell.bounds.get(bound)?.outputs;
    outputs
        .iter()
        .find(|of| of.output == PROPOSED)
        .map(|of| of.met)
}

/// Whether a typical trial converges.
fn converges(cell: &CellSummary) -> Says {
    match share(cell, 0)? {
        met if met.low > 0.5 => Some(true),
        met if met.high < 0.5 => Some(false),
        _ => None,
    }
}

/// How the trials of some cells end: per cent that converge, stop short, end no nearer or fail.
fn endings(cells: &[&CellSummary]) -> Option<[f64; 3]> {
    let (mut converged, mut nearer, mut all) = (0.0, 0.0, 0.0);
    for cell in cells {
        let (met, near) = (share(cell, 0)?, share(cell, 1)?);
        converged += met.count as f64;
        nearer += near.count as f64;
        all += met.of as f64;
    }
    let shares = [converged, nearer - converged, all - nearer];
    (all > 0.0).then(|| shares.map(|count| 100.0 * count / all))
}

/// Per cent that converge at every level.
fn by_level(study: &Study) -> String {
    let at = |level: &String| {
        let [converged, ..] = endings(&study.cells(&[(Key::Level, level)]))?;
        Some(format!("{converged:.0} % at {level}"))
    };
    listed(
        &study
            .values(Key::Level)
            .iter()
            .filter_map(at)
            .collect::<Vec<String>>(),
    )
}

/// B3: wherever the mixed disturbance is as small as the paper assumes, a typical trial must end within 10 % of theta.
/// Cells with a larger one are told beside it.
pub(super) fn no_information(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("gpebo-amplitude") else {
        return Finding::not_run("gpebo-amplitude");
    };
    let cells: Vec<&CellSummary> = study.summary.cells.iter().collect();
    let (small, large): (Vec<_>, Vec<_>) = tell(study, converges)
        .into_iter()
        .partition(|(cell, _)| is_small(cell));
    let Some([converged, short, lost]) = endings(&cells).filter(|_| !small.is_empty()) else {
        let why =
            "The results lack the shares of the output proposed, or cells with |dbar| below 1.";
        return Finding::undecided(study, why);
    };
    let because = format!(
        "With |dbar| below 1, as the paper assumes, a typical trial comes within 10 % of theta in {} cells; with a larger one in {}. Of all trials {converged:.0} % converge, {short:.0} % stop short of it, {lost:.0} % end no nearer than they began or fail. By level of the disturbance converge {}.",
        holding(&small),
        holding(&large),
        by_level(study),
    );
    let numbers = study.summary.cells.iter().filter_map(|cell| {
        let met = share(cell, 0)?;
        let name = format!("share converged: {}", place(cell, &study.varying()));
        Some(Number::new(name, met.share, met.mcse))
    });
    judge(study, &small, because, numbers.collect())
}
