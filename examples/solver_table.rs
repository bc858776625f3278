//! Prints the table of solvers in docs/methods.md from criterion's stored estimates (run `cargo bench --bench kernels`
//! first) and from the golden files: time of one solve, digits of the result.
//!
//! `cargo run --release --example solver_table`

mod criterion;

use asobench::data::csv;
use asobench::estimator::{Estimator, InstrumentalVariables, IvOptions, LeastSquares, Pass, Shape, Solver, Window};
use asobench::metric::relative_error;
use serde_json::Value;
use std::path::Path;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Formats criterion's median time of a benchmark; "-" if it was not run.
fn time(group: &str, solver: Solver, size: &str) -> String {
    let benchmark = criterion::folder().join(group).join(solver.name());
    match criterion::median(&benchmark.join(size), "new") {
        None => "-".to_owned(),
        Some([ns, _]) if ns < 1e6 => format!("{:.1} \u{b5}s", ns / 1e3),
        Some([ns, _]) => format!("{:.1} ms", ns / 1e6),
    }
}

/// The worst relative error of p = (alpha, beta) over the passes of one golden file.
fn error(name: &str, solver: Solver, instruments: bool) -> Result<f64> {
    let folder = Path::new("tests/golden/data");
    let reference: Value = serde_json::from_str(&std::fs::read_to_string(folder.join(format!("{name}.json")))?)?;
    let record = csv::read(std::fs::File::open(folder.join(format!("{name}.csv")))?)?;
    let size = |key: &str| reference[key].as_u64().unwrap_or(0) as usize;
    let shape = Shape {
        order: size("order"),
        window: size("window"),
    };
    let window = Window::new(&record.u, &record.y, shape.window);
    let numbers = |value: &Value| -> Vec<f64> {
        value
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_f64)
            .collect()
    };
    let theta = |a: &[f64], h: &[f64]| [a, h].concat();
    let difference = |pass: &Pass, reference: &Value| {
        relative_error(
            &theta(&numbers(&reference["a"]), &numbers(&reference["h"])),
            &theta(&pass.a, &pass.h),
        )
    };
    if !instruments {
        let mut passes = [Pass::new(shape.order)];
        LeastSquares::new(shape, solver)?.estimate(window, &mut passes);
        return Ok(difference(&passes[0], &reference["ls"]));
    }
    let options = IvOptions {
        solver,
        ..IvOptions::default()
    };
    let mut passes = vec![Pass::new(shape.order); 5];
    InstrumentalVariables::new(shape, &options)?.estimate(window, &mut passes);
    let references = reference["iv_refresh"].as_array().into_iter().flatten();
    let differences = passes[1..]
        .iter()
        .zip(references)
        .map(|(pass, reference)| difference(pass, reference));
    Ok(differences.fold(0.0, f64::max))
}

/// The number of correct decimal digits for a relative error.
fn digits(error: f64) -> String {
    format!("{:.1}", -error.max(1e-17).log10())
}

fn main() -> Result<()> {
    println!(
        "| solver | LS, n 6, N 98 | IV, n 6, N 98 | LS, n 6, N 998 | IV, n 6, N 998 | IV, n 12, N 998 | digits N 18 | \
         digits N 98 |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|");
    for &solver in Solver::ALL {
        let mut cells = vec![format!("`{solver}`")];
        for (group, size) in [
            ("solver_ls", "n6_N98"),
            ("solver_iv", "n6_N98"),
            ("solver_ls", "n6_N998"),
            ("solver_iv", "n6_N998"),
            ("solver_iv", "n12_N998"),
        ] {
            cells.push(time(group, solver, size));
        }
        for name in ["case11_00_n6_N18", "case11_01_n6_N98"] {
            let ls = digits(error(name, solver, false)?);
            cells.push(if solver == Solver::Cholesky {
                format!("{ls} / -")
            } else {
                format!("{ls} / {}", digits(error(name, solver, true)?))
            });
        }
        println!("| {} |", cells.join(" | "));
    }
    Ok(())
}
