//! Estimators of a consistent structure on long records: within four of their own standard errors of the truth;
//! subspace methods, which have none, nearer to it the longer the record; recovery without noise; failures of short
//! records.

use asobench::estimator::{EstimatorName, FailureKind, MethodOptions, Pass, Shape, Window};
use asobench::model::LinearModel;
use asobench::model::polynomial::{divide, filter};
use asobench::signal::{Input, InputLaw, Purpose, Sequence, stream};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// The methods' options, as files have them.
fn options(estimator: &str, orders: &str) -> MethodOptions {
    let name: EstimatorName = estimator.parse().expect("an estimator");
    let mut options = Map::new();
    options.insert("orders".to_owned(), Value::from(orders));
    name.parse(options).expect("options")
}

fn estimate(options: &MethodOptions, order: usize, u: &[f64], y: &[f64]) -> Pass {
    let shape = Shape { order, window: y.len() };
    let mut estimator = options.prepare(&shape.into()).expect("an estimator");
    let mut passes: Vec<Pass> = options.outputs("method").iter().map(|_| Pass::new(order)).collect();
    estimator.estimate(Window::new(u, y, y.len()), &mut passes);
    passes.pop().expect("a pass")
}

fn normal(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    let mut signal = vec![0.0; n];
    let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
    input.fill(&mut stream(47, trial, purpose), &mut signal);
    signal
}

/// `A y = B/F u + C/D e` from rest, e of this standard deviation.
fn record(truth: &LinearModel, sd: f64, trial: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let u = normal(trial, Purpose::Input, n);
    let mut e = normal(trial, Purpose::Plant, n);
    for e in &mut e {
        *e *= sd;
    }
    let (mut y, mut v) = (vec![0.0; n], vec![0.0; n]);
    truth.simulate(&u, &mut y);
    filter(&truth.c, &e, &mut v);
    divide(&truth.d, &mut v);
    divide(&truth.a, &mut v);
    y.iter_mut().zip(&v).for_each(|(y, v)| *y += v);
    (u, y)
}

fn truth(orders: &str, parameters: &[f64]) -> LinearModel {
    let mut model = LinearModel::zero(orders.parse().expect("orders"));
    model.set_parameters(parameters);
    model
}

/// The truth of each noise in the structure that a method is consistent for. `iv(4)`'s own standard errors are those of
/// white equation noise, so it stands where that is white.
#[test]
fn consistent_methods_at_twenty_thousand_samples() {
    let oe = truth("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7]);
    let arx = truth("na=2,nb=2", &[-1.5, 0.7, 1.0, 0.5]);
    let armax = truth("na=2,nb=2,nc=1", &[-1.5, 0.7, 1.0, 0.5, 0.6]);
    let bj = truth("nb=2,nc=1,nd=1,nf=2", &[1.0, 0.5, 0.6, -0.8, -1.5, 0.7]);
    let cases: [(&LinearModel, &[&str]); 4] = [
        (&oe, &["sriv", "oe"]),
        (&arx, &["arx", "iv", "iv-delayed", "iv4"]),
        (&armax, &["armax"]),
        (&bj, &["riv", "bj"]),
    ];
    for (trial, (truth, methods)) in cases.into_iter().enumerate() {
        let (u, y) = record(truth, 0.5, trial as u64, 20_000);
        for method in methods {
            let options = options(method, &truth.orders().to_string());
            let pass = estimate(&options, 2, &u, &y);
            assert_eq!(pass.failure, None, "{method}");
            let errors = pass.model.standard_errors().expect("standard errors");
            let both = pass.model.parameters().zip(truth.parameters());
            for ((found, truth), error) in both.zip(errors) {
                let distance = (found - truth).abs() / error;
                assert!(distance < 4.0, "{method}: {found} {truth}, {distance} errors");
            }
            let variance = pass.model.noise_variance / 0.25 - 1.0;
            // Four standard errors of a variance, sqrt(2/N) each; IV4's is of filtered residuals.
            assert!(variance.abs() < 0.04, "{method}: {variance}");
        }
    }
    // Steiglitz and McBride have no standard errors: those of the output-error method, which is efficient, and some.
    let (u, y) = record(&oe, 0.5, 0, 20_000);
    let orders = oe.orders().to_string();
    let stmcb = estimate(&options("stmcb", &orders), 2, &u, &y);
    let errors = estimate(&options("oe", &orders), 2, &u, &y).model.standard_errors();
    let both = stmcb.model.parameters().zip(oe.parameters());
    for ((found, truth), error) in both.zip(errors.expect("standard errors")) {
        assert!((found - truth).abs() < 8.0 * error, "{found} {truth} {error}");
    }
}

/// The median distance of the denominator from the truth falls from 1,250 to 5,000 to 20,000 samples. The noise has the
/// plant's poles: with poles of its own the states would be more than the order asked for.
#[test]
fn subspace_methods_approach_the_truth() {
    let truth = truth("na=2,nb=2,nc=1", &[-1.5, 0.7, 1.0, 0.5, 0.6]);
    for method in ["moesp", "n4sid"] {
        let options = options(method, "n=2,nk=1");
        let medians = [1250, 5000, 20_000].map(|n| {
            let distance = |trial: u64| {
                let (u, y) = record(&truth, 0.5, 100 + trial, n);
                let pass = estimate(&options, 2, &u, &y);
                assert_eq!(pass.failure, None, "{method}");
                let both = pass.model.f.iter().zip(&truth.a);
                both.map(|(f, truth)| (f - truth).abs()).fold(0.0, f64::max)
            };
            let mut distances: Vec<f64> = (0..21).map(distance).collect();
            distances.sort_by(f64::total_cmp);
            distances[10]
        });
        // Half as large each time in theory.
        for pair in medians.windows(2) {
            assert!(pair[1] < 0.75 * pair[0], "{method}: {medians:?}");
        }
    }
}

/// Orders 1 to 6 with delays 0 to 3, without noise. Poles between 0.2 and 0.8, so that the problem is well conditioned.
#[test]
fn plants_are_recovered_without_noise() {
    for order in 1..=6_usize {
        for delay in 0..=3_usize {
            let mut f = vec![1.0];
            for i in 0..order {
                let pole = [0.8, -0.7, 0.5, -0.4, 0.2, -0.2][i];
                let with = |k: usize| f.get(k).copied().unwrap_or(0.0);
                f = (0..=f.len())
                    .map(|k| with(k) - if k > 0 { pole * with(k - 1) } else { 0.0 })
                    .collect();
            }
            let b: Vec<f64> = (0..order).map(|i| 1.0 / (1.0 + i as f64)).collect();
            let output_error = format!("nb={order},nf={order},nk={delay}");
            let arx = format!("na={order},nb={order},nk={delay}");
            let truth = truth(&output_error, &[&b[..], &f[1..]].concat());
            let (u, y) = record(&truth, 0.0, (10 * order + delay) as u64, 400);
            let methods = [
                ("arx", &arx),
                ("iv", &arx),
                ("iv-delayed", &arx),
                ("stmcb", &output_error),
                ("sriv", &output_error),
                ("oe", &output_error),
            ];
            for (method, orders) in methods {
                let pass = estimate(&options(method, orders), order, &u, &y);
                assert_eq!(pass.failure, None, "{method} {orders}");
                let denominator = pass.model.denominator();
                let pairs = denominator.iter().zip(&f).chain(pass.model.b.iter().zip(&truth.b));
                for (found, truth) in pairs {
                    assert!((found - truth).abs() < 1e-8, "{method} {orders}: {found} {truth}");
                }
            }
        }
    }
}

/// The order by each rule on records without noise: one too many has no model, or one whose errors are rounding as
/// well, and one too few has errors; so the chosen order is not below the true one, and the model has its response.
/// Subspace methods have the true poles among theirs.
#[test]
fn chosen_orders_without_noise() {
    let truth = truth("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7]);
    let (u, y) = record(&truth, 0.0, 77, 300);
    for method in ["oe", "moesp", "n4sid", "cva", "ssarx", "parsim-k", "pem"] {
        for rule in ["aicc", "aic", "bic", "fpe", "cross-validation"] {
            let name: EstimatorName = method.parse().expect("an estimator");
            let mut given = Map::new();
            given.insert("choose".to_owned(), Value::from(rule));
            let pass = estimate(&name.parse(given).expect("options"), 3, &u, &y);
            assert_eq!(pass.failure, None, "{method} {rule}");
            assert!(pass.a.len() >= 2, "{method} {rule}");
            let mut simulated = vec![0.0; y.len()];
            pass.model.simulate(&u, &mut simulated);
            let off = simulated.iter().zip(&y);
            let off = off.fold(0.0_f64, |m, (x, y)| m.max((x - y).abs()));
            assert!(off < 1e-7, "{method} {rule}: {off}");
        }
    }
}

/// At 20,000 samples the order by BIC is the true one, whose penalty grows with N, and the model is within four
/// standard errors of the truth.
#[test]
fn chosen_orders_at_twenty_thousand_samples() {
    let armax = truth("na=2,nb=2,nc=2", &[-1.5, 0.7, 1.0, 0.5, 0.6, 0.2]);
    let cases = [
        ("oe", truth("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7])),
        ("armax", armax.clone()),
        (
            "bj",
            truth("nb=2,nc=2,nd=2,nf=2", &[1.0, 0.5, 0.6, 0.2, -0.8, 0.3, -1.5, 0.7]),
        ),
        ("pem", armax),
        ("arx", truth("na=2,nb=2", &[-1.5, 0.7, 1.0, 0.5])),
    ];
    for (trial, (method, truth)) in cases.iter().enumerate() {
        let (u, y) = record(truth, 0.5, 200 + trial as u64, 20_000);
        let name: EstimatorName = method.parse().expect("an estimator");
        let mut given = Map::new();
        given.insert("choose".to_owned(), Value::from("bic"));
        let pass = estimate(&name.parse(given).expect("options"), 3, &u, &y);
        assert_eq!(pass.failure, None, "{method}");
        assert_eq!(pass.model.orders(), truth.orders(), "{method}");
        let errors = pass.model.standard_errors().expect("standard errors");
        for ((found, truth), error) in pass.model.parameters().zip(truth.parameters()).zip(errors) {
            let distance = (found - truth).abs() / error;
            assert!(distance < 4.0, "{method}: {found} {truth}, {distance} errors");
        }
    }
}

/// Short records of a plant under heavy noise. Reflected iterations have a model in each, with the kind
/// "iteration-limit" where they did not converge; without reflection each end of an iteration is reached, and none is a
/// panic.
#[test]
fn failures_of_iterations_are_typed() {
    let truth = truth("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7]);
    let mut kinds = [BTreeMap::new(), BTreeMap::new()];
    for trial in 0..400 {
        let (u, y) = record(&truth, 20.0, 1000 + trial, 40);
        for method in ["sriv", "stmcb"] {
            for (stabilise, kinds) in ["reflect", "none"].iter().zip(&mut kinds) {
                let name: EstimatorName = method.parse().expect("an estimator");
                let mut given = Map::new();
                given.insert("orders".to_owned(), Value::from("nb=2,nf=2"));
                given.insert("stabilise".to_owned(), Value::from(*stabilise));
                let pass = estimate(&name.parse(given).expect("options"), 2, &u, &y);
                if let Some(failure) = pass.failure {
                    *kinds.entry(failure.kind.to_string()).or_insert(0) += 1;
                    if *stabilise == "reflect" {
                        assert!(pass.model.f.iter().all(|f| f.is_finite()), "{method} {trial}");
                        assert!(pass.model.b.iter().any(|b| *b != 0.0), "{method} {trial}");
                    }
                }
            }
        }
    }
    let [reflected, plain] = kinds.map(|kinds| kinds.into_keys().collect::<Vec<String>>());
    assert_eq!(reflected, [FailureKind::IterationLimit.to_string()]);
    for kind in [FailureKind::UnstablePredictor, FailureKind::IterationLimit] {
        assert!(plain.contains(&kind.to_string()), "{kind}: {plain:?}");
    }
}
