//! A record is simulated, and three models of order 2 are estimated with their standard errors:
//! `cargo run --release -p asobench-identification --example three_models`

use asobench_identification::estimator::{ArxOptions, IvOptions, MethodOptions, OeOptions};
use asobench_identification::fit;
use asobench_identification::model::LinearModel;
use asobench_identification::signal::{Purpose, fill_white, stream};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // y = B/F u + noise: u and the noise are white and normal.
    let [mut u, mut y, mut noise] = [(); 3].map(|()| vec![0.0; 500]);
    fill_white(&mut stream(1, 0, Purpose::Input), 1.0, &mut u);
    fill_white(&mut stream(1, 0, Purpose::NoiseDrive), 0.3, &mut noise);
    let mut truth = LinearModel::zero("nb=2,nf=2,nk=1".parse()?);
    truth.set_parameters(&[1.0, 0.5, -1.5, 0.7]);
    truth.simulate(&u, &mut y);
    y.iter_mut().zip(&noise).for_each(|(y, noise)| *y += noise);

    let arx = MethodOptions::from(ArxOptions::default());
    for options in [arx, OeOptions::default().into(), IvOptions::default().into()] {
        let model = fit(options, 2, &u, &y)?;
        println!("{}", model.linear().equation(Some(4)));
        println!("standard errors {:.4?}", model.linear().standard_errors());
    }
    Ok(())
}
