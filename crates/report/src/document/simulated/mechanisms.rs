//! Data-generating mechanisms: plants, inputs, noises, every setting, the grid, the trials and their random numbers.

use super::words::{Part, Row, at_most, listed, row, table};
use crate::results::Study;
use asobench_identification::plant::{ContinuousPlant, Numerator, nikolov2023};
use asobench_study::study::file::{AUTOMATIC, Axis, ExperimentFile, FeedbackTable, Key, StudyKind, TrialRule};
use asobench_study::text::{grouped, number};
use serde::Serialize;

pub(super) fn part(study: &Study) -> Part {
    let file = &study.file;
    let mut rows = at_most(plants(file));
    // The plants have rows of their own.
    let wanted = |key| key != Key::Plant && !is_of_methods(key) && !is_of_truth(key);
    let (given, defaults) = settings(study, wanted);
    rows.extend(given);
    rows.extend(at_most(filters(file)));
    rows.extend(at_most(continuous(file)));
    rows.extend(grid(study));
    rows.extend(trials(study));
    Part::new("Data-generating mechanisms", rows, defaults)
}

/// Whether a setting says what the methods do with a record, not how it is drawn.
pub(super) fn is_of_methods(key: Key) -> bool {
    key.entry().of_observer || matches!(key, Key::Order | Key::GainScale)
}

/// Whether a setting says what the estimates are compared with.
pub(super) fn is_of_truth(key: Key) -> bool {
    key == Key::ScoredFrom
}

/// Settings that every reader asks for, shown without a click even if they have their default.
const ALWAYS: [Key; 10] = [
    Key::X0,
    Key::Input,
    Key::Amplitude,
    Key::Noise,
    Key::Eta,
    Key::Window,
    Key::Horizon,
    Key::Order,
    Key::Disturbance,
    Key::Level,
];

/// The settings that `wanted` selects: those that are axes, not at their default, or always asked for; then the others.
pub(super) fn settings(study: &Study, wanted: fn(Key) -> bool) -> (Vec<Row>, Vec<Row>) {
    let file = &study.file;
    let kind = file.kind();
    let (mut given, mut defaults) = (Vec::new(), Vec::new());
    let keys = Key::ALL.iter().copied();
    for key in keys.filter(|key| key.is_of(kind) && wanted(*key)) {
        let axis = axis(file, key);
        let mut text = listed(values(file, key).into_iter(), " \u{b7} ");
        if text == AUTOMATIC {
            let found = study.values(key).iter().cloned();
            text.push_str(&format!(": {}", listed(found, " \u{b7} ")));
        }
        let is_default = axis == key.default_of(kind).map(Axis::One);
        if text.is_empty() {
            continue;
        }
        let unit = match key.entry().unit {
            "" => String::new(),
            unit => format!(" ({unit})"),
        };
        let row = row(key.name(), format!("{text}{unit}"));
        if is_default && !ALWAYS.contains(&key) {
            defaults.push(row);
        } else {
            given.push(row);
        }
    }
    (given, defaults)
}

/// The values of a setting, those of its default if it is not set; `None` without any.
fn axis(file: &ExperimentFile, key: Key) -> Option<Axis> {
    let set = file.settings.get(&key).cloned();
    set.or_else(|| key.default_of(file.kind()).map(Axis::One))
}

/// The same as text.
fn values(file: &ExperimentFile, key: Key) -> Vec<String> {
    let values = axis(file, key).map(|axis| axis.values(key.entry().count));
    values.iter().flatten().map(ToString::to_string).collect()
}

fn vector(numbers: &[f64]) -> String {
    format!("[{}]", listed(numbers.iter().copied().map(number), ", "))
}

/// Every plant with its coefficients.
fn plants(file: &ExperimentFile) -> Vec<Row> {
    let names = values(file, Key::Plant);
    let mut rows = Vec::new();
    for name in &names {
        let term = format!("plant {name}");
        if let Some(plant) = file.plants.get(name) {
            rows.push(row(term, table(plant, &[])));
        } else if let Some(plant) = file.continuous_plants.get(name) {
            let equations = "x' = A x + B u, y = C'x + delta";
            rows.push(row(term, format!("{equations}: {}", table(plant, &[]))));
        } else if name == "random" {
            rows.push(row(term, "a new one in every trial: plant_order, pole_radius"));
        } else if file.kind() == StudyKind::Continuous {
            rows.push(row(term, example_in_continuous_time()));
        } else {
            for numerator in values(file, Key::Numerator) {
                rows.push(row(term.clone(), example(&numerator)));
            }
        }
    }
    rows
}

/// The plant of Nikolov et al. (2023) in one of its readings.
fn example(numerator: &str) -> String {
    let plant = nikolov2023(numerator.parse::<Numerator>().unwrap_or_default());
    format!(
        "the example of Nikolov et al. (2023), numerator {numerator}: a = {}, b = {}",
        vector(plant.a()),
        vector(plant.b())
    )
}

/// The plant of Bobtsov et al. (2023).
fn example_in_continuous_time() -> String {
    let plant = ContinuousPlant::bobtsov2023();
    let a = plant.a();
    let rows = (0..a.nrows()).map(|i| {
        let row: Vec<f64> = (0..a.ncols()).map(|j| a[(i, j)]).collect();
        vector(&row)
    });
    format!(
        "the example of Bobtsov et al. (2023), x' = A x + B u, y = C'x + delta: A = [{}], B = {}, C = {}",
        rows.collect::<Vec<_>>().join(", "),
        vector(plant.b()),
        vector(plant.c())
    )
}

/// Inputs, noise filters, changes, feedbacks and given samples.
fn filters(file: &ExperimentFile) -> Vec<Row> {
    let law = |of: &FeedbackTable| match of.state_gain {
        Some(_) => "u(k) = -k'xhat(k) + r(k): ",
        None => "u(k) = -K(q) y(k) + r(k): ",
    };
    let mut rows = tables("input", &file.inputs, |_| "");
    rows.extend(tables("noise", &file.noises, |_| "white noise through C(q)/D(q): "));
    rows.extend(tables("change", &file.changes, |_| "A and b of the plant move: "));
    rows.extend(tables("covariances", &file.covariances, |_| ""));
    rows.extend(tables("feedback", &file.feedbacks, law));
    rows.extend(file.columns.iter().map(|(name, samples)| {
        let count = grouped(samples.len() as u64);
        row(name.clone(), format!("{count} samples, in manifest.json"))
    }));
    rows
}

/// The tables of a kind by name, each in words after those of `lead`.
fn tables<'a, T: Serialize + 'a>(
    kind: &str,
    all: impl IntoIterator<Item = (&'a String, &'a T)>,
    lead: impl Fn(&T) -> &'static str,
) -> Vec<Row> {
    let of = |(name, of)| row(format!("{kind} {name}"), lead(of).to_owned() + &table(of, &[]));
    all.into_iter().map(of).collect()
}

/// The times and the disturbances of a study in continuous time.
fn continuous(file: &ExperimentFile) -> Vec<Row> {
    let times = |of| row("continuous", format!("times in seconds: {}", table(of, &[])));
    let mut rows: Vec<Row> = file.continuous.iter().map(times).collect();
    rows.extend(tables("disturbance", &file.signals, |_| "a sum of waves: "));
    rows
}

/// The number of cells and how they come about.
fn grid(study: &Study) -> Vec<Row> {
    let file = &study.file;
    let axis = |key: &Key| {
        let count = file.settings.get(key)?.values(key.entry().count).len();
        // Settings that move together are one axis, told at the first of them.
        let group = file.zip.iter().find(|group| group.contains(key));
        let group = group.map_or(std::slice::from_ref(key), Vec::as_slice);
        let names: Vec<&str> = group.iter().map(|key| key.name()).collect();
        let first = group.iter().min() == Some(key) && count > 1;
        first.then(|| format!("{} {count}", names.join(" + ")))
    };
    let axes: Vec<String> = Key::ALL.iter().filter_map(axis).collect();
    let cells = grouped(study.summary.cells.len() as u64);
    let product = match axes.as_slice() {
        [] => String::new(),
        axes => format!(": {}", axes.join(" \u{d7} ")),
    };
    let mut rows = vec![row("cells", format!("{cells}{product}"))];
    for group in &file.zip {
        let names: Vec<&str> = group.iter().map(|key| key.name()).collect();
        rows.push(row("zip", format!("{} move together", names.join(", "))));
    }
    let excluded = file.exclude.iter();
    rows.extend(at_most(
        excluded.map(|cells| row("exclude", table(cells, &[]))).collect(),
    ));
    rows
}

/// The number of trials with its rule, and where their random numbers are from.
fn trials(study: &Study) -> Vec<Row> {
    let file = &study.file;
    let rule = match &file.trials {
        TrialRule::Fixed(trials) => format!("{} in each cell", grouped(*trials)),
        rule => format!("a rule: {}", table(rule, &[])),
    };
    let alike = study.summary.cells.iter().any(|cell| cell.deterministic);
    let alike = if alike { "; one where nothing is random" } else { "" };
    let revision = study.revision.as_deref();
    let revision = revision.map_or_else(String::new, |revision| format!(", revision {revision}"));
    vec![
        row("trials", format!("{rule}{alike}. Made: {}", study.extent())),
        row("seed", study.summary.seed.to_string()),
        row(
            "random numbers",
            "trial i has the same in every cell and for every method, so comparisons are paired",
        ),
        row("engine", file.engine.to_string()),
        row("program", format!("asobench {}{revision}", study.version)),
    ]
}
