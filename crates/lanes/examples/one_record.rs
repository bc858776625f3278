//! Least squares and an instrumental variable pass of one record, in the lanes of this machine:
//! `cargo run --release -p asobench-lanes --example one_record`

use asobench_identification::estimator::{Estimator, IvOptions, Pass, Shape, Window};
use asobench_lanes::Isa;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let u: Vec<f64> = (0..60).map(|k| f64::from((k * k) % 7) - 3.0).collect();
    let mut y = vec![0.0; 60];
    for k in 2..60 {
        y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + u[k - 1] + 0.3 * u[k - 2];
    }
    let shape = Shape { order: 2, window: 60 };
    let options = IvOptions {
        iterations: 1,
        ..IvOptions::default()
    };
    let isa = Isa::best();
    let mut passes = vec![Pass::new(2); 2];
    let mut lanes: Box<dyn Estimator> = isa.estimator(shape, &options)?;
    lanes.estimate(Window::new(&u, &y, 60), &mut passes);
    for (number, pass) in passes.iter().enumerate() {
        println!("{isa}, pass {number}: a = {:.12?}, h = {:.12?}", pass.a, pass.h);
    }
    Ok(())
}
