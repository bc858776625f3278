//! One model of several records against NumPy and SciPy, and a gap that costs its equations alone.

use super::Runs;
use crate::estimator::{EstimatorName, Method, Pass, Problem, Shape, Window};
use serde_json::{Map, Value, json};

fn estimate(name: &str, options: Map<String, Value>, lengths: &[usize], u: &[f64], y: &[f64]) -> Pass {
    let name: EstimatorName = name.parse().unwrap();
    let method = Method::named(name.name(), name.parse(options).unwrap());
    let shape = Shape {
        order: 2,
        window: y.len(),
    };
    let problem = Problem {
        covariance: true,
        runs: lengths,
        ..shape.into()
    };
    let mut estimator = method.prepare(problem).unwrap();
    let mut passes = vec![Pass::new(2); method.passes()];
    estimator.estimate(Window::new(u, y, y.len()), &mut passes);
    passes.pop().unwrap()
}

fn numbers(of: &Value) -> Vec<f64> {
    let list = of.as_array().unwrap().iter();
    list.map(|x| x.as_f64().unwrap()).collect()
}

fn options(orders: &str, initial: &Value) -> Map<String, Value> {
    let mut options = Map::new();
    options.insert("orders".to_owned(), json!(orders));
    if !initial.is_null() {
        options.insert("initial".to_owned(), initial.clone());
    }
    options
}

const ORDERS: [(&str, &str); 5] = [
    ("arx", "na=2,nb=2,nk=1"),
    ("iv", "na=2,nb=2,nk=1"),
    ("oe", "nb=2,nf=2,nk=1"),
    ("armax", "na=2,nb=2,nc=2,nk=1"),
    ("bj", "nb=2,nc=1,nd=1,nf=2,nk=1"),
];

#[test]
fn models_of_another_program() {
    let reference: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let (mut u, mut y, mut lengths) = (Vec::new(), Vec::new(), Vec::new());
    for record in reference["records"].as_array().unwrap() {
        u.extend(numbers(&record[0]));
        y.extend(numbers(&record[1]));
        lengths.push(y.len() - lengths.iter().sum::<usize>());
    }
    let cases = reference["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 8);
    for case in cases {
        let name = case["estimator"].as_str().unwrap();
        let (_, orders) = ORDERS.iter().find(|(of, _)| *of == name).unwrap();
        let pass = estimate(name, options(orders, &case["initial"]), &lengths, &u, &y);
        assert_eq!(pass.failure, None, "{case}");
        let pairs = pass.model.parameters().zip(numbers(&case["theta"]));
        for (found, expected) in pairs {
            assert!((found - expected).abs() < 1e-8, "{name}: {found} {expected}");
        }
        let errors = pass.model.standard_errors().unwrap();
        for (found, expected) in errors.iter().zip(numbers(&case["se"])) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{name}: {found} {expected}");
        }
        if let Some(loss) = case["loss"].as_f64() {
            assert!((pass.loss / loss - 1.0).abs() < 1e-10, "{name}");
        }
    }
}

/// Without noise the model is found whatever each record begins with.
#[test]
fn each_record_has_a_start_of_its_own() {
    let (u, mut y) = (
        crate::estimator::test_setup::normal(5, 1, crate::signal::Purpose::Input, 90),
        vec![0.0; 90],
    );
    let (lengths, starts) = ([40, 30, 20], [[0.0, 0.0], [7.0, -3.0], [-20.0, 11.0]]);
    for (run, start) in Runs::new(&lengths).iter().zip(starts) {
        let mut x = start;
        for k in run.clone() {
            y[k] = x[0];
            x = [1.5 * x[0] + x[1] + u[k], -0.7 * x[0] + 0.5 * u[k]];
        }
    }
    for (name, orders) in ORDERS.iter().take(4) {
        let initial = match *name {
            "arx" | "iv" => Value::Null,
            _ => json!("estimate"),
        };
        let pass = estimate(name, options(orders, &initial), &lengths, &u, &y);
        let truth: &[f64] = match *name {
            "oe" => &[1.0, 0.5, -1.5, 0.7],
            _ => &[-1.5, 0.7, 1.0, 0.5],
        };
        for (found, expected) in pass.model.parameters().zip(truth) {
            assert!((found - expected).abs() < 1e-7, "{name}: {found} {expected}");
        }
    }
}

/// A record that is shorter than the equations reach back has none, wherever it stands.
#[test]
fn short_records_have_no_equations() {
    use crate::estimator::test_setup::{self, plant};
    let (u, mut y) = (
        test_setup::normal(6, 1, crate::signal::Purpose::Input, 60),
        vec![0.0; 60],
    );
    plant("na=2,nb=2", &[-1.5, 0.7, 1.0, 0.5]).simulate(&u, &mut y);
    let none = || options("na=2,nb=2,nk=1", &Value::Null);
    let whole = estimate("arx", none(), &[60], &u, &y);
    for lengths in [&[1, 59][..], &[59, 1], &[1, 1, 58], &[2, 58]] {
        let pass = estimate("arx", none(), lengths, &u, &y);
        assert_eq!(pass.failure.map(|of| of.kind), None, "{lengths:?}");
        let mut pairs = pass.model.parameters().zip(whole.model.parameters());
        let same = pairs.all(|(one, other)| (one - other).abs() < 1e-12);
        assert!(same, "{lengths:?}");
    }
}

/// Intervals of 95 % cover as often as that: over 400 sets of three records, up to four standard errors of the share.
#[test]
fn standard_errors_are_right() {
    use crate::estimator::test_setup::{self, plant};
    use crate::model::Realisation;
    const SETS: usize = 400;
    let lengths = [150, 100, 50];
    let cases = [
        ("arx", "na=2,nb=2,nk=1", &[-1.5, 0.7, 1.0, 0.5][..]),
        ("iv", "na=2,nb=2,nk=1", &[-1.5, 0.7, 1.0, 0.5]),
        ("armax", "na=2,nb=2,nc=1,nk=1", &[-1.5, 0.7, 1.0, 0.5, 0.4]),
        ("oe", "nb=2,nf=2,nk=1", &[1.0, 0.5, -1.5, 0.7]),
        ("bj", "nb=2,nc=1,nd=1,nf=2,nk=1", &[1.0, 0.5, 0.4, -0.6, -1.5, 0.7]),
    ];
    for (name, orders, truth) in cases {
        let model = plant(orders, truth);
        let mut covered = vec![0; truth.len()];
        for set in 0..SETS {
            let (mut u, mut y) = (Vec::new(), Vec::new());
            for (record, length) in lengths.into_iter().enumerate() {
                let draw = |purpose| test_setup::normal(7, (3 * set + record) as u64, purpose, length);
                let own = draw(crate::signal::Purpose::Input);
                let mut e = draw(crate::signal::Purpose::NoiseDrive);
                for e in &mut e {
                    *e *= 0.5;
                }
                let mut output = vec![0.0; length];
                Realisation::new(&model).simulate(&own, &e, &mut output);
                u.extend(own);
                y.extend(output);
            }
            let pass = estimate(name, options(orders, &Value::Null), &lengths, &u, &y);
            assert_eq!(pass.failure, None, "{name}, set {set}");
            let errors = pass.model.standard_errors().unwrap();
            let found = pass.model.parameters().zip(errors).zip(truth);
            for (((found, error), truth), covered) in found.zip(&mut covered) {
                *covered += usize::from((found - truth).abs() <= 1.96 * error);
            }
        }
        for count in covered {
            let share = count as f64 / SETS as f64;
            // Four standard errors of 0.95, and what intervals by linear theory miss in 300 samples.
            let allowed = 4.0 * (0.95 * 0.05 / SETS as f64).sqrt();
            assert!((share - 0.95).abs() < allowed, "{name}: {share}");
        }
    }
}

/// Others say that they take one record.
#[test]
fn other_methods_refuse_several() {
    for name in EstimatorName::ALL {
        let Ok(options) = name.parse(Map::new()) else {
            continue;
        };
        let problem = Problem {
            runs: &[150, 150],
            ..Shape { order: 2, window: 300 }.into()
        };
        let prepared = Method::named(name.name(), options).prepare(problem);
        let takes = name.name() == "general" || ORDERS.iter().any(|(of, _)| *of == name.name());
        match prepared {
            Ok(_) => assert!(takes, "{name}"),
            Err(error) => assert!(!takes && error.to_string().contains("one record"), "{name}: {error}"),
        }
    }
}
