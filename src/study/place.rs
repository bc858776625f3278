//! Which settings tell cells apart, and where a cell is, in words.

use super::file::Key;
use super::row::Measure;
use super::summary::CellSummary;
use std::collections::{BTreeMap, HashSet};

/// Where a cell, or a family of cells, is in its study: the values of its settings as text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    values: BTreeMap<Key, String>,
    continuous: bool,
}

impl CellSummary {
    /// Where the cell is.
    pub fn place(&self) -> Place {
        let continuous = self.settings.contains_key(&Key::Disturbance);
        let keys = Key::ALL.iter().filter(|key| key.is_of(continuous));
        Place {
            values: keys.map(|key| (*key, self.setting(*key))).collect(),
            continuous,
        }
    }
}

impl Place {
    /// The value of a setting; empty where there is none.
    pub fn value(&self, key: Key) -> &str {
        self.values.get(&key).map_or("", String::as_str)
    }

    /// The place of all cells that differ in these settings alone.
    #[must_use]
    pub fn without(mut self, keys: &[Key]) -> Self {
        self.values.retain(|key, _| !keys.contains(key));
        self
    }

    /// The values of some settings in words: "1/A noise, N = 98"; readings are named only where
    /// they are not the default.
    pub fn words(&self, keys: &[Key]) -> String {
        const READINGS: [Key; 4] = [Key::Numerator, Key::Sequence, Key::EtaOver, Key::EtaOf];
        let told = keys.iter().filter(|key| {
            self.values.contains_key(key) && !(READINGS.contains(key) && self.is_default(**key))
        });
        told.map(|key| words(*key, self.value(*key)))
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Whether a setting has its default.
    pub fn is_default(&self, key: Key) -> bool {
        key.default_of(self.continuous)
            .is_some_and(|value| value.to_string() == self.value(key))
    }
}

/// The settings that tell places apart, without those that follow from another one.
pub fn varying(all: &[Place]) -> Vec<Key> {
    const FIRST: [Key; 6] = [
        Key::Claim,
        Key::PlantOrder,
        Key::Order,
        Key::Window,
        Key::Eta,
        Key::L,
    ];
    let others = Key::ALL.iter().filter(|key| !FIRST.contains(key));
    let mut kept: Vec<Key> = Vec::new();
    for key in FIRST.iter().chain(others).copied() {
        let is_told = || kept.iter().any(|other| follows(all, key, *other));
        if values(all, key).len() > 1 && !is_told() {
            kept.push(key);
        }
    }
    kept
}

/// Whether the value of one setting gives that of the other.
fn follows(all: &[Place], key: Key, from: Key) -> bool {
    let mut seen: BTreeMap<&str, &str> = BTreeMap::new();
    all.iter().all(|place| {
        let value = place.value(key);
        *seen.entry(place.value(from)).or_insert(value) == value
    })
}

/// The values of a setting, in order: by size where all are numbers, else of appearance.
pub fn values(all: &[Place], key: Key) -> Vec<String> {
    let mut seen = HashSet::new();
    let all = all.iter().map(|place| place.value(key));
    let mut values: Vec<String> = all
        .filter(|value| seen.insert(*value))
        .map(str::to_owned)
        .collect();
    let number = |value: &String| value.parse::<f64>().ok();
    if values.iter().all(|value| number(value).is_some()) {
        values.sort_by(|a, b| {
            number(a)
                .partial_cmp(&number(b))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
    }
    values
}

/// A setting's value in words: "N = 98", "eta = 2 %", "white noise".
pub fn words(key: Key, value: &str) -> String {
    match key {
        Key::Claim => value.to_owned(),
        Key::X0 => format!("x0 = {value}"),
        Key::Numerator => format!("{value} numerator"),
        Key::Sequence => format!("{value} input"),
        Key::EtaOver => format!("{value} eta"),
        Key::EtaOf => format!("eta of the {value} output"),
        Key::Window => format!("N = {value}"),
        Key::Eta => format!("eta = {value} %"),
        Key::Noise => format!("{} noise", noise(value)),
        Key::Feedback => format!("feedback {value}"),
        Key::InputNoise => format!("input noise {value} %"),
        Key::ProcessNoise => format!("process noise {value}"),
        Key::X0Deviation => format!("x0 within {value}"),
        Key::ScoredFrom => format!("scored from the {value}"),
        Key::PlantOrder => format!("plant's n = {value}"),
        Key::Order => format!("n = {value}"),
        Key::PoleRadius => format!("poles within {value}"),
        Key::ObserverStart => format!("start at {value}"),
        Key::Gain => gain(value),
        Key::Disturbance => format!("{value} disturbance"),
        Key::Frequency => format!("{value} rad/s"),
        Key::Phase => format!("phase {value}"),
        Key::NoiseHold => format!("hold {value} s"),
        Key::GainScale => format!("gains times {value}"),
        Key::Step => format!("step {value} s"),
        _ => format!("{key} {value}"),
    }
}

/// The noise's name as people say it.
fn noise(value: &str) -> &str {
    match value {
        "ar" => "1/A",
        "ma" => "MA",
        "arma" => "ARMA",
        _ => value,
    }
}

/// A gain by the poles of F.
fn gain(value: &str) -> String {
    match value.strip_prefix("scaled:") {
        Some("1") => "no feedback (scaled:1)".to_owned(),
        Some(factor) => format!("poles {factor} times A's"),
        None => format!("{value} gain"),
    }
}

/// A value as an axis of names shows it.
pub fn value_name(key: Key, value: &str) -> String {
    match (key, value) {
        (Key::Noise, _) => noise(value).to_owned(),
        (Key::Gain, "dead-beat") => "0".to_owned(),
        (Key::Gain, _) => value.strip_prefix("scaled:").unwrap_or(value).to_owned(),
        _ => value.to_owned(),
    }
}

/// A setting as an axis is labelled, with its unit.
pub fn axis_label(key: Key) -> String {
    match key {
        Key::Window => "N, samples".to_owned(),
        Key::Eta => "eta, %".to_owned(),
        Key::InputNoise => "input noise, %".to_owned(),
        Key::Order => "order n of the estimator".to_owned(),
        Key::PlantOrder => "order n of the plant".to_owned(),
        Key::PoleRadius => "largest pole radius".to_owned(),
        Key::X0 => "x0, every component".to_owned(),
        Key::Gain => "poles of F over those of A".to_owned(),
        Key::Level => "level of the disturbance".to_owned(),
        Key::Frequency => "frequency, rad/s".to_owned(),
        Key::NoiseHold => "hold of white noise, s".to_owned(),
        Key::GainScale => "factor on the adaptation gains".to_owned(),
        Key::Step => "step, s".to_owned(),
        _ => key.name().replace('_', " "),
    }
}

/// A figure's name as texts show it.
pub fn measure_name(measure: Measure) -> String {
    match measure {
        Measure::ExMax => "max e_x".to_owned(),
        Measure::ExRms => "rms e_x".to_owned(),
        Measure::ExMaxPrinted => "max e_x as printed".to_owned(),
        Measure::ExRmsPrinted => "rms e_x as printed".to_owned(),
        Measure::FreshFit => "FIT".to_owned(),
        Measure::SpectralRadius => "spectral radius".to_owned(),
        Measure::Condition => "condition number".to_owned(),
        Measure::RmsState => "rms of the state's error".to_owned(),
        Measure::RmsState1 => "rms error of x_1".to_owned(),
        Measure::RmsState2 => "rms error of x_2".to_owned(),
        Measure::ThetaRms => "rms e_theta".to_owned(),
        Measure::Reaching => "time to come within 10 %, s".to_owned(),
        Measure::Settling => "time to stay within 10 %, s".to_owned(),
        Measure::Frozen => "frozen from, s".to_owned(),
        Measure::MixedDisturbance => "largest |dbar|".to_owned(),
        Measure::StepError => "error by step halving".to_owned(),
        Measure::StepOrder => "order of the integration".to_owned(),
        _ => measure.name().replace("_as_printed", " as printed"),
    }
}

/// Whether a smaller value of the measure is the better one.
pub fn is_error(measure: Measure) -> bool {
    measure.name().starts_with("e_") || measure.name().starts_with("rms_")
}
