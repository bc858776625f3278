//! Recorded data against Octave's control package: `arx` on eight public records (`data/README.md`).

use asobench::data::{Detrend, Trend, csv};
use asobench::estimator::{Estimator, LeastSquares, Pass, Shape, Solver, Window};
use serde_json::Value;
use std::path::Path;

/// theta = (alpha, beta) of least squares on the case's rows, with its delay taken out.
fn theta(case: &Value, folder: &Path, solver: Solver) -> Vec<f64> {
    let size = |value: &Value| value.as_u64().expect("a size") as usize;
    let file = folder.join(case["data"].as_str().expect("a file"));
    let mut record =
        csv::read(std::fs::File::open(file).expect("a record")).expect("a valid record");
    let (first, last) = (size(&case["rows"][0]), size(&case["rows"][1]));
    let detrend: Detrend = case["detrend"]
        .as_str()
        .expect("a name")
        .parse()
        .expect("a detrend");
    for values in [&mut record.u, &mut record.y] {
        *values = values[first..last].to_vec();
        Trend::fit(detrend, values).subtract(values);
    }
    let delay = size(&case["nk"]) - 1;
    record.y.drain(..delay);
    record.u.truncate(record.y.len());
    let shape = Shape {
        order: size(&case["na"]),
        window: record.y.len(),
    };
    let mut passes = [Pass::new(shape.order)];
    let window = Window::new(&record.u, &record.y, shape.window);
    LeastSquares::new(shape, solver)
        .expect("a valid shape")
        .estimate(window, &mut passes);
    let [pass] = passes;
    assert_eq!(pass.failure, None, "{}", case["name"]);
    pass.a
        .iter()
        .rev()
        .map(|a| -a)
        .chain(pass.h.iter().copied())
        .collect()
}

/// Every case with na = nb (two of them with a delay) within 1e-7 by QR, as the largest difference relative
/// to the largest coefficient; the expected values have 12 digits.
#[test]
fn octave_arx() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recorded_data/data");
    let text = std::fs::read_to_string(folder.join("expected.json")).expect("expected.json");
    let cases: Value = serde_json::from_str(&text).expect("JSON");
    let cases = cases["cases"].as_array().expect("cases");
    assert!(cases.len() >= 15);
    for case in cases {
        assert_eq!(case["na"], case["nb"]);
        let expected = case["expected"]["theta"].as_array().expect("theta");
        let expected: Vec<f64> = expected
            .iter()
            .map(|v| v.as_f64().expect("a number"))
            .collect();
        for solver in [Solver::Qr, Solver::Svd] {
            let found = theta(case, &folder, solver);
            assert_eq!(found.len(), expected.len());
            let difference = |(found, expected): (&f64, &f64)| (found - expected).abs();
            let worst = found
                .iter()
                .zip(&expected)
                .map(difference)
                .fold(0.0, f64::max);
            println!("{} {solver}: {worst:.1e}", case["name"]);
            assert!(worst < 1e-7, "{} {solver}: {worst:e}", case["name"]);
        }
    }
}
