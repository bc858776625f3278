//! C8, the initial state, and C9, the observer's poles.

use super::{Finding, Number, Ratio, Standing, Studies, condition, count_of, settle};
use crate::metric::Quantile;
use crate::report::number::uncertain;
use crate::report::results::{Study, distinct, median, place, statistics, words};
use crate::study::file::Key;
use crate::study::{CellSummary, Measure};

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
        let here = median(cell, "iv(4)", Measure::Ea);
        let zero = cell
            .comparisons
            .iter()
            .find(|pair| pair.first == "iv-zero(4)" && pair.second == "iv(4)");
        let zero =
            zero.and_then(|pair| Ratio::paired(pair.measures.get(&Measure::Ea)?.median_ratio));
        let zero = zero.or_else(|| Ratio::of(median(cell, "iv-zero(4)", Measure::Ea), here));
        needed.extend(zero.map(|zero| (cell, zero)));
        let rest = twin(study, cell, Key::X0, "0").map(|rest| median(rest, "iv(4)", Measure::Ea));
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
        "Taking x0 as 0 instead of estimating it costs more than 5 % of the median e_a in {} cells with another x0, and no more in {idle}{}. The estimate does not undo the transient: e_a is not that of the same cell with x0 = 0{}, since a transient that adds to sigma_y makes the noise larger at the same eta.",
        count_of(helps, all),
        farthest(study, &needed),
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
    Finding::new(study, settle(helps, idle, all - helps - idle), because)
        .numbers(numbers)
        .led_by(&condition(study, &helped, &not))
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
    let measure = Measure::ExMax;
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
                    median(cell, &output, measure),
                    median(alone, &output, measure),
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
            let no_worse = match yes {
                0 => String::new(),
                _ => format!(", no worse in {} cells", count_of(yes, of)),
            };
            texts.push(format!(
                "{low:.2} to {high:.2} times with {}{no_worse}",
                words(Key::Gain, gain)
            ));
        }
    }
    if texts.is_empty() {
        return Finding::undecided(
            study,
            "No median of max e_x is there for two gains of the same cell.",
        );
    }
    let all = good + bad + open;
    let no_worse = match good {
        0 => format!("None of these gains is as good beyond doubt in any of {all} cells."),
        _ => format!("A gain is no worse in {} cells.", count_of(good, all)),
    };
    let because = format!(
        "The median of max e_x over that of the model without feedback, least to greatest of the cells: {}. {no_worse}{}{}",
        super::listed(&texts),
        levels(study, &output, &gains),
        tails(study, &output)
    );
    Finding::new(study, settle(good, bad, open), because).numbers(numbers)
}

/// The medians themselves, gain by gain.
fn levels(study: &Study, output: &str, gains: &[String]) -> String {
    let text = |gain: &String| {
        let of = study.cells(&[(Key::Gain, gain.as_str())]);
        let medians = of
            .into_iter()
            .map(|cell| median(cell, output, Measure::ExMax));
        let mut medians: Vec<Quantile> = medians.filter(|of| of.value.is_finite()).collect();
        medians.sort_by(|a, b| a.value.total_cmp(&b.value));
        let (low, high) = (medians.first()?, medians.last()?);
        Some(format!(
            "{} to {} with {}",
            uncertain(low.value, low.mcse),
            uncertain(high.value, high.mcse),
            words(Key::Gain, gain)
        ))
    };
    // The ends of the list tell enough: the poles at zero, and those of A.
    let ends = gains
        .iter()
        .filter(|gain| ["dead-beat", "scaled:1"].contains(&gain.as_str()));
    let texts: Vec<String> = ends.filter_map(text).collect();
    if texts.is_empty() {
        return String::new();
    }
    format!(" The median itself is {}.", super::listed(&texts))
}

/// What feedback does where more than 5 % of the models are unstable, so that one of them makes the 95 % quantile.
fn tails(study: &Study, output: &str) -> String {
    let upper = |cell: &CellSummary| statistics(cell, output, Measure::ExMax).map(|of| of.q95);
    let unstable = |cell: &&CellSummary| {
        let alone = cell.setting(Key::Gain) == "scaled:1";
        alone && cell.output(output).is_some_and(|of| of.unstable.low > 0.05)
    };
    let keys: Vec<Key> = study.varying();
    let keys: Vec<Key> = keys
        .into_iter()
        .filter(|key| ![Key::Gain, Key::ObserverStart].contains(key))
        .collect();
    let mut places: Vec<String> = Vec::new();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for alone in study.summary.cells.iter().filter(unstable) {
        let place = place(alone, &keys);
        if !places.contains(&place) {
            places.push(place);
        }
        least = least.min(upper(alone).map_or(f64::INFINITY, |of| of.value));
        for gain in study
            .values(Key::Gain)
            .iter()
            .filter(|of| *of != "scaled:1")
        {
            let with = twin(study, alone, Key::Gain, gain).and_then(upper);
            // Without standard error nothing bounds the quantile.
            let upper = with.map_or(0.0, |of| of.interval().1);
            most = most.max(if upper.is_nan() { f64::INFINITY } else { upper });
        }
    }
    if places.is_empty() || !least.is_finite() || !(most > 0.0 && most < least) {
        return String::new();
    }
    format!(
        " Where more than 5 % of the models are unstable ({}) feedback saves the tail: the 95 % quantile is below {} with it, {} or more without.",
        places.join("; "),
        uncertain(most, 0.0),
        uncertain(least, 0.0)
    )
}
