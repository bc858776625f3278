//! Replays a trial in continuous time.

use super::super::error::{Error, bad_input, failed};
use super::printed::{Options, Replay, Stage, stored};
use crate::estimator::Output;
use crate::study::{ContinuousCell, ContinuousTrial, Experiment, Row, Traces, Trials};

/// Replays a trial in continuous time: prints its rows, and its course at some times.
pub(super) fn show(
    experiment: &Experiment,
    index: usize,
    cell: &ContinuousCell,
    trial: u64,
    options: &Options<'_>,
) -> Result<(), Error> {
    /// Points of the course.
    const POINTS: f64 = 20.0;
    if options.data.is_some() {
        return Err(bad_input("--data: a trial in continuous time has no record k, u, y"));
    }
    let mut trials = Trials::of_all_measures(experiment, &experiment.cells[index]);
    let worker = ContinuousTrial::new(experiment, cell).map_err(failed)?;
    worker.run_with_course(trial, Some(cell.until / POINTS), &mut trials);
    let outputs = experiment.outputs();
    let rows: Vec<Row> = trials.rows.iter().collect();
    let output = |row: &Row| outputs[row.output].clone();
    Replay {
        cell: &experiment.cells[index],
        index,
        trial,
        seed: experiment.file.seed,
        stored: stored(options.folder, experiment, index, &trials.rows),
        may_differ: None,
        stages: trials
            .traces
            .as_ref()
            .map_or_else(Vec::new, |traces| course(traces, &outputs)),
        rows: rows.iter().map(|row| (output(row), row)).collect(),
    }
    .print(options)
}

/// Returns the true state, then the estimates of every observer.
fn course(traces: &Traces, outputs: &[Output]) -> Vec<Stage> {
    let named = |name: &str, courses: &[Vec<f64>]| -> Vec<(String, Vec<f64>)> {
        let courses = courses.iter().enumerate();
        courses
            .map(|(i, values)| (format!("{name}_{}", i + 1), values.clone()))
            .collect()
    };
    let mut plant = vec![("t, s".to_owned(), traces.times.clone())];
    plant.extend(named("x", &traces.x));
    plant.push(("theta = x(0) - xi(0)".to_owned(), traces.theta.clone()));
    let mut stages = vec![("Plant".to_owned(), plant)];
    for (output, trace) in outputs.iter().zip(&traces.outputs) {
        let mut vectors = named("xhat", &trace.x_hat);
        vectors.extend(named("theta_hat", &trace.theta_hat));
        stages.push((format!("Observer {}", output.label()), vectors));
    }
    stages
}
