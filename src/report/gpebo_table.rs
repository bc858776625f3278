//! The example of Bobtsov et al. (2023) as a table: theta and the state of every observer.

use super::number::uncertain;
use crate::study::{CellSummary, Measure, OutputTrace, Summary, Traces};
use std::fmt::{self, Write};

/// The table of a continuous-time study of one trial with a stored course, 80 columns wide.
pub fn example_table(summary: &Summary, scored_from: f64) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_table(&mut text, summary, scored_from);
    text
}

fn write_table(text: &mut String, summary: &Summary, scored_from: f64) -> fmt::Result {
    let with = |cell: &&CellSummary| cell.traces.is_some();
    let Some((cell, traces)) = summary
        .cells
        .iter()
        .rfind(with)
        .and_then(|cell| Some((cell, cell.traces.as_ref()?)))
    else {
        return Ok(());
    };
    let rule = "-".repeat(80);
    writeln!(
        text,
        "{:<12} {:>20} {:>20}   {:<22}",
        "", "theta_1", "theta_2", "rms error of the state"
    )?;
    let half = "mean  half range";
    writeln!(
        text,
        "{:<12} {half:>20} {half:>20} {:>10} {:>10}",
        "observer", "x_1", "x_2"
    )?;
    writeln!(text, "{rule}")?;
    let theta: Vec<String> = traces
        .theta
        .iter()
        .map(|x| format!("{x:>9}{:>11}", ""))
        .collect();
    writeln!(
        text,
        "{}",
        format!("{:<12} {}", "true", theta.join(" ")).trim_end()
    )?;
    for (output, trace) in cell.outputs.iter().zip(&traces.outputs) {
        let rms = [Measure::RmsState1, Measure::RmsState2].map(|measure| {
            let value = output
                .measures
                .get(&measure)
                .map_or(f64::NAN, |statistics| statistics.mean.value);
            digits(value)
        });
        let theta: Vec<String> = (0..traces.theta.len())
            .map(|i| course(traces, trace, i, scored_from))
            .collect();
        writeln!(
            text,
            "{:<12} {} {:>10} {:>10}",
            output.label(),
            theta.join(" "),
            rms[0],
            rms[1]
        )?;
    }
    writeln!(text, "{rule}")
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
fn course(traces: &Traces, trace: &OutputTrace, i: usize, from: f64) -> String {
    let Some(values) = trace.theta_hat.get(i) else {
        return format!("{:>9} {:>10}", "-", "");
    };
    let late = traces.times.iter().zip(values).filter(|(t, _)| **t >= from);
    let late: Vec<f64> = late.map(|(_, value)| *value).collect();
    let mean = late.iter().sum::<f64>() / late.len() as f64;
    let low = late.iter().copied().fold(f64::INFINITY, f64::min);
    let high = late.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    format!("{mean:>9.4} {:>10.4}", (high - low) / 2.0)
}

/// The final estimate of theta in every cell, to compare steps: "step 0.005 s: 1.00279006 1.89516278".
pub fn ends(summary: &Summary, label: &str) -> Vec<String> {
    let line = |cell: &CellSummary| {
        let place = cell
            .outputs
            .iter()
            .position(|output| output.label() == label)?;
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
            format!("{} s:", cell.setting(crate::study::file::Key::Step)),
            ends.join(", "),
            uncertain(measure(Measure::StepOrder), f64::NAN),
            "",
            measure(Measure::Frozen),
            uncertain(measure(Measure::MixedDisturbance), f64::NAN),
        ))
    };
    summary.cells.iter().filter_map(line).collect()
}
