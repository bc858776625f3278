//! A record is simulated, and three models of it are estimated with their standard errors:
//! `cargo run --release -p asobench-identification --example three_models`

use asobench_identification::estimator::{ArxOptions, IvOptions, MethodOptions, OeOptions};
use asobench_identification::fit;
use asobench_identification::model::LinearModel;
use asobench_identification::signal::{Input, InputLaw, Purpose, Sequence, stream};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // y = B/F u + noise: u and the noise are white and normal.
    let (mut u, mut noise, mut y) = (vec![0.0; 500], vec![0.0; 500], vec![0.0; 500]);
    Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent)
        .fill(&mut stream(1, 0, Purpose::Input), &mut u);
    Input::new(InputLaw::Gaussian, 0.3, Sequence::Independent)
        .fill(&mut stream(1, 0, Purpose::Plant), &mut noise);
    let mut truth = LinearModel::zero("nb=2,nf=2,nk=1".parse()?);
    truth.set_parameters(&[1.0, 0.5, -1.5, 0.7]);
    truth.simulate(&u, &mut y);
    y.iter_mut().zip(&noise).for_each(|(y, noise)| *y += noise);

    let arx = || "na=2,nb=2,nk=1".parse().map(Some);
    let methods: [(&str, MethodOptions); 3] = [
        (
            "arx",
            ArxOptions {
                orders: arx()?,
                ..ArxOptions::default()
            }
            .into(),
        ),
        (
            "oe",
            OeOptions {
                orders: "nb=2,nf=2,nk=1".parse().map(Some)?,
                ..OeOptions::default()
            }
            .into(),
        ),
        (
            "iv",
            IvOptions {
                orders: arx()?,
                ..IvOptions::default()
            }
            .into(),
        ),
    ];
    for (name, options) in methods {
        let model = fit(options, 2, &u, &y)?;
        println!("{name}: {}", model.linear().equation().rounded(4));
        println!(
            "    standard errors {:.4?}",
            model.linear().standard_errors()
        );
        println!(
            "    simulated FIT {:.1} %",
            model.compare(&u, &y, 500, 0..500).simulated
        );
    }
    Ok(())
}
