//! One trial of the paper's experiment, cell C2: `cargo run --release -p asobench-study --example one_trial`

use asobench_study::study::{Experiment, Measure, Trial};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let experiment = Experiment::nikolov2023(2023);
    let mut trial = Trial::new(&experiment, &experiment.cells[1])?;
    for (output, row) in experiment.outputs().iter().zip(trial.run(0)?) {
        println!("{:<6} e_a = {:.4}", output.label(), row[Measure::Ea]);
    }
    Ok(())
}
