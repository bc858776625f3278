//! What the readings of the errata cost: the ratio of the median under another reading to that under the default.
//!
//! "The same" holds where a ratio's 95 % interval lies within 5 % of 1; "as well" also where it lies below. Where that
//! is so of some figures and cells and not of others, it holds only for these. A reading under which more than half
//! of the trials of a cell fail is not as good there, whatever the others give.

use super::{Finding, Ratio, Standing, Studies, count_of, listed, settle};
use crate::estimator::IvOptions;
use crate::report::html::Verdict;
use crate::report::results::{
    Study, apart, is_default, measure_name, median, place, statistics, words,
};
use crate::study::file::Key;
use crate::study::{CellSummary, Measure, OutputSummary};

/// Ratios under one reading.
struct Cost {
    reading: String,
    measure: Measure,
    place: String,
    ratio: Ratio,
}

impl Cost {
    fn case(&self) -> String {
        format!("{}, {}", measure_name(self.measure), self.place)
            .trim_end_matches([',', ' '])
            .to_owned()
    }
}

const FIGURES: [Measure; 3] = [Measure::Ea, Measure::Eb, Measure::ExMax];

/// What is asked of a reading.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Asked {
    Same,
    AsWell,
}

/// `failing` are cells where a reading fails, in words.
fn finding(study: &Study, costs: &[Cost], failing: &[String], asked: Asked, what: &str) -> Finding {
    if costs.is_empty() && failing.is_empty() {
        return Finding::undecided(
            study,
            &format!("The results hold no {what} beside the default reading."),
        );
    }
    let count = |wanted: &[Standing]| {
        costs
            .iter()
            .filter(|cost| wanted.contains(&cost.ratio.standing()))
            .count()
    };
    let same = if asked == Asked::Same {
        count(&[Standing::Same])
    } else {
        count(&[Standing::Same, Standing::Below])
    };
    let open = count(&[Standing::Open]);
    let verdict = settle(same, costs.len() - same - open + failing.len(), open);
    let mut readings: Vec<&String> = Vec::new();
    for cost in costs {
        if !readings.contains(&&cost.reading) {
            readings.push(&cost.reading);
        }
    }
    let text = |reading: &&String| {
        let of = || costs.iter().filter(|cost| cost.reading == **reading);
        let most = of().max_by(|a, b| a.ratio.value.total_cmp(&b.ratio.value));
        let least = of().min_by(|a, b| a.ratio.value.total_cmp(&b.ratio.value));
        let show = |cost: Option<&Cost>| {
            cost.map_or_else(String::new, |cost| {
                if readings.len() > 2 {
                    cost.ratio.text()
                } else {
                    format!("{} ({})", cost.ratio.text(), cost.case())
                }
            })
        };
        if of().count() == 1 {
            format!("{reading} {}", show(most))
        } else {
            format!("{reading} {} to {}", show(least), show(most))
        }
    };
    let texts: Vec<String> = readings.iter().map(text).collect();
    let wanted = if asked == Asked::Same {
        "within 5 % of 1"
    } else {
        "below 1.05"
    };
    let mut because = if costs.is_empty() {
        String::new()
    } else {
        let unsure = match open {
            0 => String::new(),
            _ => format!("; in {open} the 95 % interval leaves it open"),
        };
        format!(
            "Medians over those of the default reading, least to greatest: {}; {wanted} beyond doubt in {}{unsure}.",
            texts.join("; "),
            count_of(same, costs.len())
        )
    };
    if !failing.is_empty() {
        let space = if because.is_empty() { "" } else { " " };
        because.push_str(&format!(
            "{space}More than half of the trials fail with {}.",
            listed(failing)
        ));
    }
    let numbers = costs.iter().map(|cost| {
        cost.ratio
            .number(format!("{}, {}", cost.reading, cost.case()))
    });
    let holds = |cost: &&Cost| match cost.ratio.standing() {
        Standing::Same => true,
        Standing::Below => asked == Asked::AsWell,
        _ => false,
    };
    let held = if verdict == Verdict::HoldsOnlyIf {
        cases(&costs.iter().filter(holds).collect::<Vec<_>>())
    } else {
        String::new()
    };
    Finding::new(study, verdict, because)
        .numbers(numbers.collect())
        .led_by(&held)
}

/// The cases where a reading does as well: the figures with the cells in which they do.
fn cases(held: &[&Cost]) -> String {
    let mut cells: Vec<((&str, &str), Vec<Measure>)> = Vec::new();
    for cost in held {
        let cell = (cost.reading.as_str(), cost.place.as_str());
        match cells.iter_mut().find(|(known, _)| *known == cell) {
            Some((_, figures)) => figures.push(cost.measure),
            None => cells.push((cell, vec![cost.measure])),
        }
    }
    let mut groups: Vec<(Vec<Measure>, Vec<String>)> = Vec::new();
    let several = held.iter().any(|cost| cost.reading != held[0].reading);
    for ((reading, place), figures) in cells {
        let place = if several {
            format!("{reading}, {place}")
        } else {
            place.to_owned()
        };
        match groups.iter_mut().find(|(known, _)| *known == figures) {
            Some((_, places)) => places.push(place),
            None => groups.push((figures, vec![place])),
        }
    }
    let text = |(figures, places): &(Vec<Measure>, Vec<String>)| {
        let names: Vec<String> = figures
            .iter()
            .map(|measure| measure_name(*measure))
            .collect();
        format!("{} ({})", listed(&names), places.join("; "))
    };
    let texts: Vec<String> = groups.iter().map(text).collect();
    format!("It holds for {}.", listed(&texts))
}

/// A reading that is a setting: against the cell with every other setting the same.
pub(super) fn setting(studies: Studies<'_>, id: &str) -> Finding {
    let (keys, names): (&[Key], &[&str]) = match id {
        "E1" => (&[Key::Numerator], &["errata", "c2-c3"]),
        "E5" => (&[Key::Sequence], &["c2-c3"]),
        "E7" => (&[Key::EtaOver, Key::EtaOf], &["c2-c3"]),
        _ => (&[Key::Gain], &["observer-poles", "c2-c3"]),
    };
    let varies = |study: &&Study| keys.iter().any(|key| study.values(*key).len() > 1);
    let Some(study) = names
        .iter()
        .find_map(|name| studies.named(name).filter(varies))
    else {
        return Finding::not_run(&names.join(" or "));
    };
    let Some(output) = study.main_output() else {
        return Finding::undecided(study, "The results have no IV output at its defaults.");
    };
    let mut costs = Vec::new();
    for cell in &study.summary.cells {
        for key in keys {
            costs.extend(costs_of(study, cell, *key, &output));
        }
    }
    finding(
        study,
        &costs,
        &[],
        if id == "E5" {
            Asked::AsWell
        } else {
            Asked::Same
        },
        "other reading",
    )
}

/// A cell that differs from the default readings in one key only.
fn costs_of(study: &Study, cell: &CellSummary, key: Key, output: &str) -> Vec<Cost> {
    const READINGS: [Key; 6] = [
        Key::Numerator,
        Key::Sequence,
        Key::EtaOver,
        Key::EtaOf,
        Key::Gain,
        Key::ObserverStart,
    ];
    let default = |key: Key| {
        key.default()
            .map_or_else(String::new, |value| value.to_string())
    };
    let elsewhere = READINGS.iter().filter(|other| **other != key);
    let value = cell.setting(key);
    if cell.eta == 0.0
        || value == default(key)
        || !elsewhere
            .clone()
            .all(|other| cell.setting(*other) == default(*other))
    {
        return Vec::new();
    }
    let same = |other: &&CellSummary| {
        Key::ALL.iter().all(|k| {
            let wanted = if *k == key {
                default(key)
            } else {
                cell.setting(*k)
            };
            other.setting(*k) == wanted
        })
    };
    let Some(base) = study.summary.cells.iter().find(same) else {
        return Vec::new();
    };
    let keys: Vec<Key> = study
        .varying()
        .into_iter()
        .filter(|k| !READINGS.contains(k))
        .collect();
    let cost = |measure: &Measure| {
        let ratio = Ratio::of(
            median(cell, output, *measure),
            median(base, output, *measure),
        )?;
        Some(Cost {
            reading: words(key, &value),
            measure: *measure,
            place: place(cell, &keys),
            ratio,
        })
    };
    FIGURES.iter().filter_map(cost).collect()
}

/// A reading that is an option of the method: on the same trials, paired where the file asks for it.
pub(super) fn method(studies: Studies<'_>, id: &str) -> Finding {
    let option = match id {
        "E2" => "stage10",
        "E4" => "auxiliary",
        _ => "drive",
    };
    let names: &[&str] = if id == "E2" {
        &["errata"]
    } else {
        &["errata", "c2-c3"]
    };
    let Some(study) = names.iter().find_map(|name| studies.named(name)) else {
        return Finding::not_run(&names.join(" or "));
    };
    let Some(base) = study.main_output() else {
        return Finding::undecided(study, "The results have no IV output at its defaults.");
    };
    let default = IvOptions::default();
    let (mut costs, mut failing) = (Vec::new(), Vec::new());
    for label in study.labels().iter().filter(|label| **label != base) {
        let options = label
            .strip_suffix("(4)")
            .and_then(|method| study.options(method));
        let differences = options
            .map(|options| apart(&options, &default))
            .unwrap_or_default();
        let [(key, value)] = differences.as_slice() else {
            continue;
        };
        if key == option {
            costs.extend(against(study, label, &base, value));
            failing.extend(failures(study, label, value));
        }
    }
    let mut found = finding(study, &costs, &failing, Asked::AsWell, "other reading");
    if id == "E2" {
        found.because.push_str(&useful(study, option));
    }
    found
}

/// Where more than half of an output's trials fail.
fn failures(study: &Study, label: &str, reading: &str) -> Option<String> {
    let cells = study.summary.cells.iter();
    let outputs: Vec<(&CellSummary, &OutputSummary)> = cells
        .filter_map(|cell| Some((cell, cell.output(label)?)))
        .collect();
    let failing: Vec<_> = outputs
        .iter()
        .filter(|(_, output)| output.failed.low > 0.5)
        .collect();
    let least = failing
        .iter()
        .map(|(_, output)| output.failed.share)
        .fold(1.0, f64::min);
    let count = count_of(failing.len(), outputs.len());
    (!failing.is_empty()).then(|| {
        format!(
            "{reading} in {count} cells (at least {:.0} %)",
            (100.0 * least).floor()
        )
    })
}

/// How often stage 10 as printed gives a measure at all that is below 1.
fn useful(study: &Study, option: &str) -> String {
    let default = IvOptions::default();
    let mut least = f64::INFINITY;
    for label in study.labels() {
        let options = label
            .strip_suffix("(4)")
            .and_then(|method| study.options(method));
        if options.is_some_and(|options| {
            apart(&options, &default)
                .iter()
                .any(|(key, _)| key == option)
        }) {
            let cells = study.summary.cells.iter();
            let found = cells.filter_map(|cell| Some(statistics(cell, label, Measure::Ea)?.min));
            least = found.filter(|min| min.is_finite()).fold(least, f64::min);
        }
    }
    if least.is_finite() {
        format!(
            " The least e_a of any trial with a printed stage 10 is {}.",
            crate::report::uncertain(least, 0.0)
        )
    } else {
        String::new()
    }
}

/// The costs of one output against another on the same trials, in cells with noise.
fn against(study: &Study, label: &str, base: &str, reading: &str) -> Vec<Cost> {
    const HIDDEN: [Key; 5] = [
        Key::Numerator,
        Key::Sequence,
        Key::EtaOver,
        Key::EtaOf,
        Key::Gain,
    ];
    let plain = |cell: &&CellSummary| {
        let works = cell
            .output(label)
            .is_some_and(|output| output.failed.low <= 0.5);
        works && cell.eta > 0.0 && HIDDEN.iter().all(|key| is_default(cell, *key))
    };
    let keys: Vec<Key> = study
        .varying()
        .into_iter()
        .filter(|key| !HIDDEN.contains(key))
        .collect();
    let mut costs = Vec::new();
    for cell in study.summary.cells.iter().filter(plain) {
        let pair = cell
            .comparisons
            .iter()
            .find(|pair| pair.first == label && pair.second == base);
        for measure in FIGURES {
            let paired =
                pair.and_then(|pair| Ratio::paired(pair.measures.get(&measure)?.median_ratio));
            let ratio = paired
                .or_else(|| Ratio::of(median(cell, label, measure), median(cell, base, measure)));
            costs.extend(ratio.map(|ratio| Cost {
                reading: reading.to_owned(),
                measure,
                place: place(cell, &keys),
                ratio,
            }));
        }
    }
    costs
}

/// E11: five passes for four.
pub(super) fn five_passes(studies: Studies<'_>) -> Finding {
    let names = ["convergence", "errata", "c2-c3"];
    let with_five = |study: &&Study| study.labels().iter().any(|label| five(study, label));
    let Some(study) = names
        .iter()
        .find_map(|name| studies.named(name).filter(with_five))
    else {
        return Finding::not_run(&names.join(" or "));
    };
    let base = study.main_output();
    let label = study.labels().iter().find(|label| five(study, label));
    let costs = label
        .zip(base)
        .map(|(label, base)| against(study, label, &base, "five passes"));
    finding(
        study,
        &costs.unwrap_or_default(),
        &[],
        Asked::AsWell,
        "fifth pass",
    )
}

/// Whether an output is a fifth pass with every option at its default.
fn five(study: &Study, label: &str) -> bool {
    let method = label.strip_suffix("(5)");
    let options = method.and_then(|method| study.options(method));
    options.is_some_and(|options| apart(&options, &IvOptions::default()).is_empty())
}

/// E3: figures as printed against relative ones, of the same trials.
pub(super) fn printed_errors(studies: Studies<'_>) -> Finding {
    const PAIRS: [(Measure, Measure); 3] = [
        (Measure::Ea, Measure::EaPrinted),
        (Measure::Eb, Measure::EbPrinted),
        (Measure::ExMax, Measure::ExMaxPrinted),
    ];
    let names = ["nikolov2023", "c2-c3"];
    let Some(study) = names.iter().find_map(|name| studies.named(name)) else {
        return Finding::not_run(&names.join(" or "));
    };
    let Some(output) = study.main_output() else {
        return Finding::undecided(study, "The results have no IV output at its defaults.");
    };
    let default = |cell: &&CellSummary| {
        let keys = [
            Key::Numerator,
            Key::Sequence,
            Key::EtaOver,
            Key::EtaOf,
            Key::Gain,
        ];
        keys.iter().all(|key| is_default(cell, *key))
    };
    let mut costs = Vec::new();
    for cell in study
        .summary
        .cells
        .iter()
        .filter(default)
        .filter(|cell| cell.eta > 0.0)
    {
        for (relative, printed) in PAIRS {
            let ratio = Ratio::of(
                median(cell, &output, printed),
                median(cell, &output, relative),
            );
            costs.extend(ratio.map(|ratio| Cost {
                reading: "as printed".to_owned(),
                measure: relative,
                place: place(cell, &[Key::Claim]),
                ratio,
            }));
        }
    }
    let mut found = finding(study, &costs, &[], Asked::Same, "figure as printed");
    let undefined: Vec<String> = undefined(study, &output);
    if !undefined.is_empty() {
        found.because.push_str(&format!(
            " Undefined, a sum below 0, in {} of the trials.",
            listed(&undefined)
        ));
    }
    found
}

/// Where figures as printed are undefined, in per cent of the trials.
fn undefined(study: &Study, output: &str) -> Vec<String> {
    let text = |cell: &CellSummary| {
        let of = statistics(cell, output, Measure::ExMaxPrinted)?;
        let share = 100.0 * of.undefined as f64 / (of.undefined + of.count).max(1) as f64;
        (of.undefined > 0 && cell.eta > 0.0 && !cell.claim.is_empty())
            .then(|| format!("{share:.1} % ({}, max e_x)", cell.claim))
    };
    study
        .summary
        .cells
        .iter()
        .filter_map(text)
        .take(3)
        .collect()
}
