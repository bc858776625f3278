//! The plants of a study as difference equations, so that a mistake in a sign is seen before a run. In continuous time
//! their poles, and those of the full-order observers.

use crate::cli::equation::broken;
use crate::cli::groups;
use crate::data::PlantSource;
use crate::model::{LinearModel, Orders};
use crate::observer::gpebo::ObserverSpec;
use crate::plant::{ContinuousPlant, PoleFinder, StateSpace, eigenvalues};
use crate::study::file::Key;
use crate::study::{ContinuousCell, Experiment, Source};
use crate::text::{rounded, visible};
use faer::{Mat, c64};

/// The largest number of plants shown.
const SHOWN: usize = 8;

/// The columns of the name of a line.
const INDENT: usize = 10;

/// A step response that has not settled after so many samples counts as not settling.
const LONGEST: usize = 100_000;

/// The response has settled within this fraction of its last value.
const SETTLED: f64 = 0.02;

/// Numbers below this share of the largest one are rounding: they are shown as 0.
const ROUNDING: f64 = 1e-14;

/// Every plant of the cells: its equation, poles, static gain and settling time.
pub(super) fn plants(experiment: &Experiment) -> String {
    // Each description once, with the names of all plants that it fits.
    let mut plants: Vec<(String, Vec<String>)> = Vec::new();
    for cell in &experiment.cells {
        let name = cell.settings.get(&Key::Plant).map(ToString::to_string);
        let name = name.unwrap_or_default();
        let text = match &cell.source {
            Source::Continuous(of) => described_in_continuous_time(of, experiment),
            Source::Discrete(cell) => match &cell.process.settings().plant {
                PlantSource::Fixed(plant) => described(plant),
                PlantSource::Random { order, radius } => {
                    let radius = rounded(*radius, 6);
                    let indent = " ".repeat(INDENT);
                    format!("{indent}of order {order}, poles within {radius}\n")
                }
            },
        };
        groups::add(&mut plants, text, name);
    }
    let more = plants.len().saturating_sub(SHOWN);
    let lines = plants.iter().take(SHOWN).map(|(text, names)| {
        let names = names.join(", ");
        format!("{:<INDENT$}{}\n{text}", "plant", visible(&names))
    });
    let mut text: String = lines.collect();
    if more > 0 {
        text.extend([format!("          and {more} more plants\n")]);
    }
    text
}

fn described(plant: &StateSpace) -> String {
    let indent = " ".repeat(INDENT);
    let mut model = LinearModel::from(plant);
    without_rounding(&mut model.b);
    let equation = model.equation().rounded(6).to_string();
    let equation = broken(&equation, INDENT, INDENT + 4);
    let poles = PoleFinder::new(plant.order()).poles(plant.a());
    let poles = listed("poles ", &poles);
    let settles = match settling(&model, plant.is_stable()) {
        None => "unstable".to_owned(),
        Some(LONGEST) => format!("not within 2 % after {LONGEST} samples"),
        Some(1) => "settles to 2 % in 1 sample".to_owned(),
        Some(samples) => format!("settles to 2 % in {samples} samples"),
    };
    let gain = rounded(model.static_gain(), 6);
    let orders = delayed(&model).map_or_else(String::new, |orders| {
        format!("{indent}its orders are {orders}; a method's are set by its key orders\n")
    });
    format!("{indent}{equation}\n{poles}{indent}static gain {gain}, {settles}\n{orders}")
}

/// The orders of a plant whose delay is longer than one sample, without the zeros at the ends of its polynomials.
fn delayed(model: &LinearModel) -> Option<Orders> {
    let last = |numbers: &[f64]| numbers.iter().rposition(|x| *x != 0.0);
    let nk = model.b.iter().position(|b| *b != 0.0)?;
    let (na, nb) = (last(&model.a)?, last(&model.b)? + 1 - nk);
    (nk > 1).then(|| Orders::arx(na, nb, nk))
}

/// The poles of a plant and of the full-order observers that run on it; an observer that is not stable is marked.
fn described_in_continuous_time(cell: &ContinuousCell, experiment: &Experiment) -> String {
    let plant = &cell.plant;
    let mut text = listed("poles ", &eigenvalues(plant.a()).unwrap_or_default());
    let outputs = experiment.outputs();
    for (observer, output) in cell.observers.iter().zip(&outputs) {
        if let ObserverSpec::Luenberger { gain, .. } = observer {
            let poles = eigenvalues(closed(plant, gain).as_ref()).unwrap_or_default();
            let label = format!("poles of {}: ", visible(output.label()));
            text.push_str(&listed(&label, &poles));
            if poles.iter().any(|pole| pole.re >= 0.0) {
                let indent = " ".repeat(INDENT);
                text.push_str(&indent);
                text.push_str("warning: this observer is not stable: its error does not decay\n");
            }
        }
    }
    text
}

/// `A - L C'`.
fn closed(plant: &ContinuousPlant, gain: &[f64]) -> Mat<f64> {
    let (a, c) = (plant.a(), plant.c());
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] - gain[i] * c[j])
}

/// Sets to 0 what is rounding of the largest number.
fn without_rounding(numbers: &mut [f64]) {
    let largest = numbers.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for number in numbers {
        if number.abs() < ROUNDING * largest {
            *number = 0.0;
        }
    }
}

/// Poles, four digits, pairs as one, on lines of at most 80 columns.
fn listed(label: &str, poles: &[c64]) -> String {
    let indent = " ".repeat(INDENT);
    let largest = poles.iter().fold(0.0_f64, |most, pole| most.max(pole.norm()));
    let part = |x: f64| {
        let x = if x.abs() < ROUNDING * largest { 0.0 } else { x };
        rounded(x, 4)
    };
    let poles = poles.iter().filter(|pole| pole.im >= 0.0);
    let poles: Vec<String> = poles
        .map(|pole| match part(pole.im).as_str() {
            "0" => part(pole.re),
            im => format!("{} +- {im}i", part(pole.re)),
        })
        .collect();
    let mut lines = String::new();
    let mut column = usize::MAX;
    for (i, pole) in poles.iter().enumerate() {
        let part = if i + 1 < poles.len() {
            format!("{pole}, ")
        } else {
            pole.clone()
        };
        if column.saturating_add(part.len()) > 79 {
            let start = if i == 0 {
                format!("{indent}{label}")
            } else {
                format!("\n{indent}      ")
            };
            column = if i == 0 {
                INDENT + label.chars().count()
            } else {
                INDENT + 6
            };
            lines.push_str(&start);
        }
        column += part.len();
        lines.push_str(&part);
    }
    lines + "\n"
}

/// Returns the first sample from which the step response stays within 2 % of its last value; if that is 0, of its
/// largest value.
fn settling(model: &LinearModel, stable: bool) -> Option<usize> {
    if !stable {
        return None;
    }
    let mut y = vec![0.0; LONGEST];
    model.simulate(&vec![1.0; LONGEST], &mut y);
    let end = model.static_gain();
    let largest = y.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
    let size = if end.abs() > 1e-9 * largest { end.abs() } else { largest };
    let outside = y.iter().rposition(|y| (y - end).abs() > SETTLED * size);
    Some(outside.map_or(0, |last| last + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The step response of `y(k) = 0.5 y(k-1) + u(k-1)` is `2 (1 - 0.5^k)`: within 2 % from k = 6 on.
    #[test]
    fn a_first_order_plant_settles_by_hand() {
        let plant = StateSpace::new(vec![0.5], vec![1.0]).unwrap();
        let model = LinearModel::from(&plant);
        assert_eq!(settling(&model, true), Some(6));
        assert_eq!(settling(&model, false), None);
        let text = described(&plant);
        let expected = "          y(k) = 0.5 y(k-1) + u(k-1)\n          poles 0.5\n          static gain 2, \
                        settles to 2 % in 6 samples\n";
        assert_eq!(text, expected);
        let delayed = LinearModel {
            a: vec![1.0, -0.5, 0.0, 0.0],
            b: vec![0.0, 0.0, 0.0, 2.0],
            ..model
        };
        assert_eq!(super::delayed(&delayed), Some(Orders::arx(1, 1, 3)));
    }
}
