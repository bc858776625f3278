//! The models of a trial over the samples seen, `[course]`.

use super::printed::Stage;
use crate::study::{Experiment, Trial};

/// Returns a(k) and b(k) of every output, NaN where there is no model.
pub(super) fn courses(experiment: &Experiment, trial: &Trial<'_>) -> Vec<Stage> {
    let mut stages = Vec::new();
    for (number, method) in experiment.methods.iter().enumerate() {
        let (points, models) = trial.course(number);
        let outputs = method.outputs();
        let Some(length) = models.iter().map(Vec::len).max().filter(|length| *length > 0) else {
            continue;
        };
        for (place, output) in outputs.iter().enumerate() {
            let of_output = || models.iter().skip(place).step_by(outputs.len());
            let mut vectors = vec![("k".to_owned(), points.iter().map(|k| *k as f64).collect())];
            for i in 0..length {
                let letter = if i < length / 2 { 'a' } else { 'b' };
                let name = format!("{letter}_{}(k)", i % (length / 2) + 1);
                let value = |model: &Vec<f64>| model.get(i).copied().unwrap_or(f64::NAN);
                vectors.push((name, of_output().map(value).collect()));
            }
            stages.push((format!("Course of {}", output.label()), vectors));
        }
    }
    stages
}
