//! Compares a user-defined estimator (ridge) in a Monte-Carlo study, and writes its summary and report:
//! `cargo run --release --example own_estimator`

use asobench::estimator::information::Information;
use asobench::estimator::{Estimator, Method, Pass, Window};
use asobench::report::terminal::overview;
use asobench::study::Experiment;
use asobench::study::file::TrialRule;
use faer::linalg::solvers::Solve;
use std::path::Path;

/// `p = (Phi'Phi + lambda I)^-1 Phi'y`; each worker allocates the buffers once.
struct Ridge {
    lambda: f64,
    information: Information,
}

impl Estimator for Ridge {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let pass = &mut passes[0];
        self.information.least_squares(window);
        let mut matrix = self.information.matrix().to_owned();
        for i in 0..matrix.nrows() {
            matrix[(i, i)] += self.lambda;
        }
        let rhs = faer::col::ColRef::from_slice(self.information.rhs());
        let p: Vec<f64> = matrix.partial_piv_lu().solve(rhs).iter().copied().collect();
        match pass.set_parameters(&p, f64::NAN) {
            Ok(()) => pass.start_at_zero(),
            // A numerical failure is recorded, never hidden.
            Err(kind) => pass.fail(kind.into()),
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut experiment = Experiment::nikolov2023(1);
    experiment.file.trials = TrialRule::Fixed(2000);
    for lambda in [1.0, 10.0, 100.0, 1000.0] {
        // Name and version are part of the design: results of another version are never reused.
        let ridge = Method::single(&format!("ridge {lambda}"), "1.1", move |shape| {
            let information = Information::new(shape.order);
            Ok(Box::new(Ridge { lambda, information }))
        });
        experiment.methods.push(ridge);
    }
    let folder = Path::new("results/own_estimator");
    let study = asobench::run_in(&experiment, folder)?;
    let page = folder.join("report.html");
    println!("{}\nreport: {}", overview(&study), page.display());
    Ok(())
}
