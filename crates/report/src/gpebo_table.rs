//! The example of Bobtsov et al. (2023) as a table: theta and the state of every observer.

use super::number::uncertain;
use asobench_study::study::{CellSummary, Measure, OutputTrace, Summary, Traces};
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
    let n = traces.theta.len();
    let states: Vec<Measure> = Measure::STATES.into_iter().take(n).collect();
    let columns = |count: usize, of: &dyn Fn(usize) -> String, width: usize| {
        let columns = (1..=count).map(|i| format!(" {:>width$}", of(i)));
        columns.collect::<String>()
    };
    let theta = columns(n, &|i| format!("theta_{i}"), 20);
    let caption = "rms error of the state";
    writeln!(text, "{:<12}{theta}   {caption:<22}", "")?;
    let half = columns(n, &|_| "mean  half range".to_owned(), 20);
    let names = columns(states.len(), &|i| format!("x_{i}"), 10);
    writeln!(text, "{:<12}{half}{names}", "observer")?;
    let rule = "-".repeat(12 + n * 21 + states.len().max(2) * 11 + 4);
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
        let rms = states.iter().map(|measure| {
            let value = output
                .measures
                .get(measure)
                .map_or(f64::NAN, |statistics| statistics.mean.value);
            format!(" {:>10}", digits(value))
        });
        let rms: String = rms.collect();
        let theta: Vec<String> = (0..traces.theta.len())
            .map(|i| course(traces, trace, i, scored_from))
            .collect();
        writeln!(text, "{:<12} {}{rms}", output.label(), theta.join(" "))?;
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
            format!(
                "{} s:",
                cell.setting(asobench_study::study::file::Key::Step)
            ),
            ends.join(", "),
            uncertain(measure(Measure::StepOrder), f64::NAN),
            "",
            measure(Measure::Frozen),
            uncertain(measure(Measure::MixedDisturbance), f64::NAN),
        ))
    };
    summary.cells.iter().filter_map(line).collect()
}
