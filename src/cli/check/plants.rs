//! Prints the plants of a study as difference equations, so that a wrong sign is seen before a run.

use crate::cli::equation::broken;
use crate::data::PlantSource;
use crate::model::LinearModel;
use crate::plant::{PoleFinder, StateSpace};
use crate::study::Experiment;
use crate::study::file::Key;
use crate::text::{rounded, visible};
use std::fmt::Write as _;

/// The largest number of plants shown.
const SHOWN: usize = 8;

/// The columns of the name of a line.
const INDENT: usize = 10;

/// A step response that has not settled after so many samples counts as not settling.
const LONGEST: usize = 100_000;

/// The response has settled within this fraction of its last value.
const SETTLED: f64 = 0.02;

/// Returns every plant of the cells: its equation, poles, static gain and settling time.
pub(super) fn plants(experiment: &Experiment) -> String {
    let mut plants: Vec<(String, &PlantSource)> = Vec::new();
    for cell in &experiment.cells {
        let Some(process) = cell.process() else {
            continue;
        };
        let plant = &process.settings().plant;
        let name = cell.settings.get(&Key::Plant).map(ToString::to_string);
        if !plants.iter().any(|(_, other)| *other == plant) {
            plants.push((name.unwrap_or_default(), plant));
        }
    }
    let more = plants.len().saturating_sub(SHOWN);
    let lines = plants.iter().take(SHOWN).map(|(name, plant)| match plant {
        PlantSource::Fixed(plant) => described(name, plant),
        PlantSource::Random { order, radius } => {
            format!(
                "plant     random, of order {order}, poles within {}\n",
                rounded(*radius, 6)
            )
        }
    });
    let mut text: String = lines.collect();
    if more > 0 {
        // Writing to a string does not fail.
        let _ = writeln!(text, "          and {more} more plants");
    }
    text
}

fn described(name: &str, plant: &StateSpace) -> String {
    let indent = " ".repeat(INDENT);
    let head = format!("{:<INDENT$}{}: ", "plant", visible(name));
    let model = LinearModel::from(plant);
    let equation = model.equation().rounded(6).to_string();
    let equation = broken(&equation, head.chars().count(), INDENT + 4);
    let poles = PoleFinder::new(plant.order()).poles(plant.a());
    let poles = poles.iter().filter(|pole| pole.im >= 0.0);
    let poles: Vec<String> = poles
        .map(|pole| match pole.im {
            0.0 => rounded(pole.re, 4),
            im => format!("{} +- {}i", rounded(pole.re, 4), rounded(im, 4)),
        })
        .collect();
    let settles = match settling(&model, plant.is_stable()) {
        None => "unstable".to_owned(),
        Some(LONGEST) => format!("not within 2 % after {LONGEST} samples"),
        Some(samples) => format!("settles to 2 % in {samples} samples"),
    };
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
                format!("{indent}poles ")
            } else {
                format!("\n{indent}      ")
            };
            column = INDENT + 6;
            lines.push_str(&start);
        }
        column += part.len();
        lines.push_str(&part);
    }
    let gain = rounded(model.static_gain(), 6);
    format!("{head}{equation}\n{lines}\n{indent}static gain {gain}, {settles}\n")
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
    let size = if end.abs() > 1e-9 * largest {
        end.abs()
    } else {
        largest
    };
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
        let text = described("p", &plant);
        let expected = "plant     p: y(k) = 0.5 y(k-1) + u(k-1)\n          poles 0.5\n          static gain 2, \
                        settles to 2 % in 6 samples\n";
        assert_eq!(text, expected);
    }
}
