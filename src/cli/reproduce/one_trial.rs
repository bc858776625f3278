//! The first trial of a cell, which the figures show beside the distributions.

use crate::data::Realisation;
use crate::estimator::{Pass, SetupError};
use crate::metric::{relative_error, relative_error_as_printed};
use crate::observer::{Gain, Observer};
use crate::report::{OneTrial, TrialErrors};
use crate::study::{Cell, Experiment, Trial};

/// An error of a vector's estimate.
type Reading = fn(&[f64], &[f64]) -> f64;

/// Computes the errors of trial 0.
///
/// # Errors
/// If a method cannot serve the cell.
pub(super) fn first_trial(experiment: &Experiment, cell: &Cell) -> Result<OneTrial, SetupError> {
    let mut trial = Trial::new(experiment, cell)?;
    trial.run(0)?;
    let record = trial.record();
    let ends = [record.passes.first(), record.passes.last()];
    let outputs = ends.map(|end| {
        let of = end.zip(cell.discrete());
        of.map(|((_, pass), cell)| errors(&cell.gain, pass, record.realisation))
            .unwrap_or_default()
    });
    Ok(OneTrial {
        seed: experiment.file.seed,
        trial: 0,
        outputs,
    })
}

/// Returns the errors of a pass in both readings of Eq. (7); NaN, and no e_x, after a failure.
fn errors(gain: &Gain, pass: &Pass, record: &Realisation) -> [TrialErrors; 2] {
    let Some(model) = pass.observed() else {
        return Default::default();
    };
    let n = model.a.len();
    let mut x_hat = Vec::with_capacity(record.states.len());
    let mut observer = Observer::new(gain.clone(), n);
    let run = observer.run(model, &record.u, &record.y, |_, x| {
        x_hat.extend_from_slice(x);
    });
    if run.is_err() {
        x_hat.clear();
    }
    let readings: [Reading; 2] = [relative_error, relative_error_as_printed];
    readings.map(|error| TrialErrors {
        e_x: record
            .states
            .chunks_exact(n)
            .zip(x_hat.chunks_exact(n))
            .map(|(x, x_hat)| error(x, x_hat))
            .collect(),
        e_a: error(&record.truth.a, &pass.a),
        e_b: error(&record.truth.b, &pass.b),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Measure;

    /// The errors that are drawn are those of the trial's rows, in both readings.
    #[test]
    fn the_trial_is_that_of_the_rows() {
        let experiment = Experiment::nikolov2023(2023);
        for cell in &experiment.cells[1..] {
            let found = first_trial(&experiment, cell).unwrap();
            let of = cell.discrete().unwrap();
            let mut trial = Trial::new(&experiment, cell).unwrap();
            let rows = trial.run(0).unwrap();
            let ends = [&rows[0], &rows[rows.len() - 1]];
            for (row, readings) in ends.into_iter().zip(&found.outputs) {
                let measures = [
                    [Measure::ExMax, Measure::Ea, Measure::Eb],
                    [Measure::ExMaxPrinted, Measure::EaPrinted, Measure::EbPrinted],
                ];
                for (errors, measures) in readings.iter().zip(measures) {
                    assert_eq!(errors.e_x.len(), of.horizon);
                    let largest = errors.e_x[of.window..].iter();
                    // NaN, where the reading is undefined, is not larger.
                    let largest = largest.fold(0.0_f64, |most, e_x| most.max(*e_x));
                    for (found, of) in [largest, errors.e_a, errors.e_b].into_iter().zip(measures) {
                        let expected = row[of];
                        assert!((found / expected - 1.0).abs() < 1e-12, "{of}: {found} {expected}");
                    }
                }
            }
        }
    }
}
