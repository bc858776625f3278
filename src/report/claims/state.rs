//! C8, the initial state, and C9, the observer's poles.

use super::{Finding, Number, Ratio, Standing, Studies, condition, count_of, settle};
use crate::report::number::uncertain;
use crate::report::results::{Study, distinct, median, place, words};
use crate::study::file::Key;
use crate::study::{CellSummary, Figure};

/// The cell with the same settings but for one.
fn twin<'a>(
    study: &'a Study,
    cell: &CellSummary,
    key: Key,
    value: &str,
) -> Option<&'a CellSummary> {
    study.summary.cells.iter().find(|other| {
        other.setting(key) == value
            && Key::ALL
                .iter()
                .all(|k| *k == key || other.setting(*k) == cell.setting(*k))
    })
}

/// C8: in every cell with x0 other than 0, taking x0 as 0 must cost more than 5 % of the median e_a, on the same
/// trials where the file compares them. The same cell with x0 = 0 is told beside it, but decides nothing: at the same
/// eta the noise is larger where the transient adds to sigma_y.
pub(super) fn initial_state(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("initial-state") else {
        return Finding::not_run("initial-state");
    };
    let others = study
        .summary
        .cells
        .iter()
        .filter(|cell| cell.setting(Key::X0) != "0");
    let (mut level, mut needed) = (Vec::new(), Vec::new());
    for cell in others {
        let here = median(cell, "iv(4)", Figure::Ea);
        let zero = cell
            .comparisons
            .iter()
            .find(|pair| pair.first == "iv-zero(4)" && pair.second == "iv(4)");
        let zero = zero.and_then(|pair| Ratio::paired(pair.figures.get(&Figure::Ea)?.median_ratio));
        let zero = zero.or_else(|| Ratio::of(median(cell, "iv-zero(4)", Figure::Ea), here));
        needed.extend(zero.map(|zero| (cell, zero)));
        let rest = twin(study, cell, Key::X0, "0").map(|rest| median(rest, "iv(4)", Figure::Ea));
        level.extend(
            rest.and_then(|rest| Ratio::of(here, rest))
                .map(|ratio| (cell, ratio)),
        );
    }
    if needed.is_empty() {
        return Finding::undecided(
            study,
            "The results lack cells with x0 other than 0, or the outputs iv(4) and iv-zero(4).",
        );
    }
    let all = needed.len();
    let is = |wanted: &[Standing]| {
        needed
            .iter()
            .filter(|(_, ratio)| wanted.contains(&ratio.standing()))
            .count()
    };
    let (helps, idle) = (
        is(&[Standing::Above]),
        is(&[Standing::Same, Standing::Below]),
    );
    let cells_of = |wanted: &[Standing]| -> Vec<&CellSummary> {
        needed
            .iter()
            .filter(|(_, ratio)| wanted.contains(&ratio.standing()))
            .map(|(cell, _)| *cell)
            .collect()
    };
    let helped = cells_of(&[Standing::Above]);
    let not = cells_of(&[Standing::Same, Standing::Below]);
    let because = format!(
        "Taking x0 as 0 instead of estimating it costs more than 5 % of the median e_a in {} cells with another x0, and no more in {}{}.{} With the estimate, e_a differs from that for x0 = 0 at the same eta{}: a transient that adds to sigma_y makes the noise larger.",
        count_of(helps, all),
        idle,
        farthest(study, &needed),
        condition(study, &helped, &not),
        farthest(study, &level),
    );
    let number = |what: &str, (cell, ratio): &(&CellSummary, Ratio)| {
        ratio.number(format!("{what}: {}", place(cell, &study.varying())))
    };
    let numbers: Vec<Number> = needed
        .iter()
        .map(|of| number("e_a with x0 taken as 0 over estimated", of))
        .chain(level.iter().map(|of| number("e_a over that at x0 = 0", of)))
        .collect();
    Finding::new(study, settle(helps, idle, all - helps - idle), because).numbers(numbers)
}

/// The cell whose ratio is farthest from 1, in words.
fn farthest(study: &Study, of: &[(&CellSummary, Ratio)]) -> String {
    let most = of
        .iter()
        .max_by(|a, b| a.1.value.ln().abs().total_cmp(&b.1.value.ln().abs()));
    most.map_or_else(String::new, |(cell, ratio)| {
        format!(
            " (farthest: {} times at {})",
            ratio.text(),
            place(cell, &study.varying())
        )
    })
}

/// C9: an observer is there to be better than the model alone, which is `scaled:1` from the estimate of x0. A gain
/// is good in a cell where its median max e_x is no more than 5 % above that of the model alone.
pub(super) fn poles(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("observer-poles") else {
        return Finding::not_run("observer-poles");
    };
    let figure = Figure::ExMax;
    let cells: Vec<&CellSummary> = study.summary.cells.iter().collect();
    let gains = distinct(&cells, Key::Gain);
    let Some(output) = study
        .main_output()
        .filter(|_| gains.iter().any(|gain| gain == "scaled:1"))
    else {
        return Finding::undecided(
            study,
            "The results lack the gain scaled:1, the model without feedback.",
        );
    };
    let mut texts = Vec::new();
    let (mut good, mut bad, mut open) = (0, 0, 0);
    let mut numbers = Vec::new();
    for gain in gains.iter().filter(|gain| *gain != "scaled:1") {
        let (mut yes, mut of, mut ratios) = (0, 0, Vec::new());
        for cell in study.cells(&[(Key::Gain, gain.as_str())]) {
            let alone = twin(study, cell, Key::Gain, "scaled:1");
            let ratio = alone.and_then(|alone| {
                Ratio::of(
                    median(cell, &output, figure),
                    median(alone, &output, figure),
                )
            });
            let Some(ratio) = ratio else {
                continue;
            };
            of += 1;
            match ratio.standing() {
                Standing::Same | Standing::Below => yes += 1,
                Standing::Above => bad += 1,
                Standing::Open => open += 1,
            }
            ratios.push(ratio);
            let keys = study.varying();
            numbers.push(ratio.number(format!(
                "max e_x over that without feedback: {}",
                place(cell, &keys)
            )));
        }
        good += yes;
        let fold =
            |(low, high): (f64, f64), ratio: &Ratio| (low.min(ratio.value), high.max(ratio.value));
        let (low, high) = ratios.iter().fold((f64::INFINITY, 0.0), fold);
        if of > 0 {
            texts.push(format!(
                "{} is no worse in {} cells ({low:.2} to {high:.2} times)",
                words(Key::Gain, gain),
                count_of(yes, of)
            ));
        }
    }
    if texts.is_empty() {
        return Finding::undecided(
            study,
            "No median of max e_x is there for two gains of the same cell.",
        );
    }
    let because = format!(
        "Against the model without feedback, by the median of max e_x: {}.{}",
        super::listed(&texts),
        best(study, &output)
    );
    Finding::new(study, settle(good, bad, open), because).numbers(numbers)
}

/// The best gain by start of the observer.
fn best(study: &Study, output: &str) -> String {
    let cells: Vec<&CellSummary> = study.summary.cells.iter().collect();
    let text = |start: String| {
        let of = study.cells(&[(Key::ObserverStart, start.as_str())]);
        let least = of
            .into_iter()
            .map(|cell| (cell, median(cell, output, Figure::ExMax)))
            .filter(|(_, of)| of.value.is_finite())
            .min_by(|a, b| a.1.value.total_cmp(&b.1.value));
        least.map_or_else(String::new, |(cell, of)| {
            format!(
                " From {start} the least median is {} ({}).",
                uncertain(of.value, of.mcse),
                place(cell, &study.varying())
            )
        })
    };
    distinct(&cells, Key::ObserverStart)
        .into_iter()
        .map(text)
        .collect()
}
