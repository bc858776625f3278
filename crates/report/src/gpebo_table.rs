//! The example of Bobtsov et al. (2023) as a table: theta and the state of every observer.

use super::number::uncertain;
use super::plot::extent;
use super::table::{CellText, Column, Table};
use asobench_study::study::{CellSummary, Measure, OutputTrace, Summary, Traces};

/// The table of a continuous-time study of one trial with a stored course, 80 columns wide.
pub fn example_table(summary: &Summary, scored_from: f64) -> String {
    let mut cells = summary.cells.iter().rev();
    let with = cells.find_map(|cell| Some((cell, cell.traces.as_ref()?)));
    let Some((cell, traces)) = with else {
        return String::new();
    };
    let n = traces.theta.len();
    let states: Vec<Measure> = Measure::STATES.into_iter().take(n).collect();
    // The line above the columns, the columns, and the true theta.
    let mut above = vec![String::new()];
    let mut columns = vec![Column::text("observer").width(12)];
    let mut truth = vec!["true".to_owned()];
    for (i, theta) in (1..).zip(&traces.theta) {
        above.extend([String::new(), format!("theta_{i}")]);
        columns.push(Column::number("mean ", "").width(9));
        columns.push(Column::number("half range", "").width(10));
        truth.extend([theta.to_string(), String::new()]);
    }
    above.push("  rms error of the state".to_owned());
    columns.extend((1..=states.len()).map(|i| Column::number(format!("x_{i}"), "").width(10)));
    let table = Table::new("", columns);
    let row = |cells: Vec<String>| {
        let cells: Vec<CellText> = cells.into_iter().map(CellText::text).collect();
        table.text_row(&cells)
    };
    let rule = "-".repeat(12 + n * 21 + states.len().max(2) * 11 + 4) + "\n";
    let mut text = row(above) + &table.text_head() + &rule + &row(truth);
    for (output, trace) in cell.outputs.iter().zip(&traces.outputs) {
        let mut cells = vec![output.label()];
        cells.extend((0..n).flat_map(|i| course(traces, trace, i, scored_from)));
        cells.extend(states.iter().map(|measure| {
            let statistics = output.measures.get(measure);
            digits(statistics.map_or(f64::NAN, |statistics| statistics.mean.value))
        }));
        text += &row(cells);
    }
    text + &rule
}

/// Formats four decimals; "-" if undefined.
fn digits(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.4}")
    } else {
        "-".to_owned()
    }
}

/// Mean and half the range of an estimate over the scored time.
fn course(traces: &Traces, trace: &OutputTrace, i: usize, from: f64) -> [String; 2] {
    let Some(values) = trace.theta_hat.get(i) else {
        return ["-".to_owned(), String::new()];
    };
    let late = traces.times.iter().zip(values).filter(|(t, _)| **t >= from);
    let late: Vec<f64> = late.map(|(_, value)| *value).collect();
    let mean = late.iter().sum::<f64>() / late.len() as f64;
    let (low, high) = extent(late);
    [mean, (high - low) / 2.0].map(|x| format!("{x:.4}"))
}

/// The final estimate of theta in every cell, to compare steps: "step 0.005 s: 1.00279006 1.89516278".
pub fn ends(summary: &Summary, label: &str) -> Vec<String> {
    let line = |cell: &CellSummary| {
        let place = cell.outputs.iter().position(|output| output.label() == label)?;
        let theta = &cell.traces.as_ref()?.outputs.get(place)?.theta_hat;
        let ends: Vec<String> = theta
            .iter()
            .filter_map(|course| Some(format!("{:.8}", course.last()?)))
            .collect();
        let output = &cell.outputs[place];
        let measure = |measure| {
            output
                .measures
                .get(&measure)
                .map_or(f64::NAN, |statistics| statistics.mean.value)
        };
        Some(format!(
            "step {:<9} theta_hat(T) = ({}), order {},\n\
             {:26}frozen from {:.1} s, largest |dbar| {}",
            format!("{} s:", cell.setting(asobench_study::study::file::Key::Step)),
            ends.join(", "),
            uncertain(measure(Measure::StepOrder), f64::NAN),
            "",
            measure(Measure::Frozen),
            uncertain(measure(Measure::MixedDisturbance), f64::NAN),
        ))
    };
    summary.cells.iter().filter_map(line).collect()
}
