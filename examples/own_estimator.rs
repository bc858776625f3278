//! An estimator of your own (ridge) in a Monte-Carlo comparison: `cargo run --release --example own_estimator`

use asobench::estimator::information::Information;
use asobench::estimator::{Estimator, Failure, Method, Output, Pass, Stage, Window};
use asobench::metric::quantile;
use asobench::study::{Experiment, Measure, run};
use faer::linalg::solvers::Solve;
use std::sync::atomic::AtomicBool;

/// `p = (Phi'Phi + lambda I)^-1 Phi'y`; the buffers are made once per worker.
struct Ridge {
    lambda: f64,
    information: Information,
}

impl Estimator for Ridge {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let pass = &mut passes[0];
        pass.clear();
        self.information.least_squares(window);
        let mut matrix = self.information.matrix().to_owned();
        for i in 0..matrix.nrows() {
            matrix[(i, i)] += self.lambda;
        }
        let rhs = faer::col::ColRef::from_slice(self.information.rhs());
        let p: Vec<f64> = matrix.partial_piv_lu().solve(rhs).iter().copied().collect();
        let (stage, number) = (Stage::LeastSquares, 0);
        match pass.set_parameters(&p, f64::NAN) {
            Ok(()) => pass.set_initial_state(&vec![0.0; pass.a.len()]),
            // A numerical failure is recorded, never hidden.
            Err(kind) => pass.fail(Failure {
                kind,
                stage,
                pass: number,
            }),
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut experiment = Experiment::nikolov2023(1);
    for lambda in [1.0, 10.0, 100.0, 1000.0] {
        let estimator = format!("ridge {lambda}");
        let identity = format!("own_estimator 1.0, lambda = {lambda}");
        let outputs = vec![Output { estimator, pass: 0 }];
        let ridge = Method::new(identity, outputs, move |shape| {
            let information = Information::new(shape.order);
            Ok(Box::new(Ridge {
                lambda,
                information,
            }))
        });
        experiment.methods.push(ridge);
    }

    let outputs = experiment.outputs();
    let mut errors = vec![Vec::new(); experiment.cells.len() * outputs.len()];
    run(&experiment, 2000, 2, &AtomicBool::new(false), |block| {
        for row in block.rows.iter().filter(|row| row.failure.is_none()) {
            errors[block.span.cell * outputs.len() + row.output].push(row[Measure::Ea]);
        }
        Ok::<(), std::io::Error>(())
    })?;

    println!("median of e_a +- its Monte-Carlo standard error, 2000 trials");
    for (i, mut sample) in errors.into_iter().enumerate() {
        let (cell, output) = (
            &experiment.cells[i / outputs.len()],
            &outputs[i % outputs.len()],
        );
        sample.sort_by(f64::total_cmp);
        let median = quantile(&sample, 0.5);
        let (name, pass) = (&output.estimator, output.pass);
        println!(
            "{} {name:<10} pass {pass}: {:.3e} +- {:.1e}",
            cell.claim, median.value, median.mcse
        );
    }
    Ok(())
}
