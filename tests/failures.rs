//! Records from which a method cannot have a model, and options that it cannot have, for every estimator of the
//! registry. The expected failures follow from how the methods solve, as `docs/methods.md` says under "Failures".

use asobench::estimator::{EstimatorName, FailureKind, Method, MethodOptions, Pass, Problem, Progress, Shape, Window};
use asobench::model::LinearModel;
use asobench::signal::{Purpose, stream};
use rand::Rng as _;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// u, y and r.
type Signals = [Vec<f64>; 3];

/// Uniform numbers between -1 and 1.
fn uniform(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    let mut random = stream(127, trial, purpose);
    let mut draw = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
    (0..n).map(|_| draw()).collect()
}

/// `u = r - 0.1 y(k-1)` and `y = B/F u + e`, e uniform of this size.
fn in_a_loop([b, f]: [&[f64]; 2], size: f64, trial: u64, n: usize) -> Signals {
    let r = uniform(trial, Purpose::Input, n);
    let e = uniform(trial, Purpose::NoiseDrive, n);
    let [mut u, mut x, mut y] = [(); 3].map(|()| vec![0.0; n]);
    for k in 0..n {
        let past = |c: &[f64], s: &[f64]| -> f64 {
            let terms = c.iter().enumerate().skip(1).filter(|(lag, _)| *lag <= k);
            terms.map(|(lag, c)| c * s[k - lag]).sum()
        };
        x[k] = past(b, &u) - past(f, &x);
        y[k] = x[k] + size * e[k];
        u[k] = r[k] - past(&[0.0, 0.1], &y);
    }
    [u, y, r]
}

/// `y = B/F u + e` in open loop: r is u.
fn open([b, f]: [&[f64]; 2], u: Vec<f64>, size: f64, trial: u64) -> Signals {
    let mut model = LinearModel::zero(asobench::model::Orders {
        nb: b.len() - 1,
        nf: f.len() - 1,
        nk: 1,
        ..Default::default()
    });
    model.set_parameters(&[&b[1..], &f[1..]].concat());
    let mut y = vec![0.0; u.len()];
    model.simulate(&u, &mut y);
    let e = uniform(trial, Purpose::NoiseDrive, u.len());
    y.iter_mut().zip(e).for_each(|(y, e)| *y += size * e);
    [u.clone(), y, u]
}

const SECOND: [&[f64]; 2] = [&[0.0, 1.0, 0.5], &[1.0, -1.5, 0.7]];

/// The estimators that need no more than a record, with the options that they must be given and these.
fn methods(more: &[(&str, Value)]) -> Vec<(EstimatorName, MethodOptions)> {
    let needed = [("ts", json!(1.0)), ("controller", json!("0,0.1/1"))];
    let of = |name: &EstimatorName| {
        let given = needed.iter().chain(more);
        // Other estimators have other instruments.
        let with_r = |key: &str| key != "instruments" || name.name().starts_with("iv");
        let given = given.filter(|(key, _)| name.takes(key) && with_r(key));
        let given = given.map(|(key, value)| ((*key).to_owned(), value.clone()));
        let options = name.parse(given.collect()).expect("options");
        (!options.needs().plant).then_some((*name, options))
    };
    EstimatorName::ALL.iter().filter_map(of).collect()
}

/// The last pass of a method; `None` if the record is too short for it.
fn estimate(options: &MethodOptions, order: usize, [u, y, r]: &Signals) -> Option<Pass> {
    let method = Method::named("method", options.clone());
    let window = y.len();
    let problem = Problem {
        covariance: true,
        ..Shape { order, window }.into()
    };
    let mut estimator = method.prepare(problem).ok()?;
    let mut passes = vec![Pass::new(order); method.passes()];
    estimator.estimate(Window::with_reference(u, y, r, window), &mut passes);
    passes.pop()
}

/// Asserts that a failure without a model left none, and that what left a model left a finite one, with standard errors
/// only at a rest; returns the kind.
fn checked(what: &str, pass: &Pass) -> Option<FailureKind> {
    let kind = pass.failure.map(|failure| failure.kind);
    if kind.is_some_and(|kind| !kind.leaves_a_model()) {
        assert_eq!(pass.progress, Progress::Nothing, "{what}: {kind:?}");
    } else {
        assert!(pass.progress >= Progress::Parameters, "{what}: {kind:?}");
        let finite = pass.model.parameters().all(f64::is_finite);
        assert!(finite, "{what}: {:?}", pass.model);
        let covariance = &pass.model.covariance;
        assert!(kind.is_none() || covariance.is_empty(), "{what}: {kind:?}");
    }
    kind
}

/// Observers begin with a model and change it: a record that says nothing leaves it.
fn observes(name: EstimatorName) -> bool {
    ["kreisselmeier", "zhang", "joint-ekf"].contains(&name.name())
}

/// Signs that a matrix has no full rank: a column of zeros is `singular` where columns are scaled; a pivot of sums
/// or of a recursion is zero, `rank-deficient`; a search finds that nothing depends on a parameter, `not-identifiable`.
/// Subspace methods project first, so that rounding decides between the first two.
fn of_no_rank(name: EstimatorName) -> &'static [FailureKind] {
    use FailureKind::{NotIdentifiable, RankDeficient, Singular};
    match name.name() {
        "oe" | "armax" | "bj" | "general" | "pem-t" => &[NotIdentifiable],
        "pem-eiv" => &[NotIdentifiable, Singular],
        "wnsf" | "bjsm" | "morsm" | "ssarx" | "rls" | "recursive-iv" | "rels" | "recursive-sriv" | "rpem" => {
            &[RankDeficient]
        }
        "moesp" | "n4sid" | "cva" | "parsim-k" | "pem" => &[Singular, RankDeficient],
        _ => &[Singular],
    }
}

/// An input or output of zeros determines no B, or no A.
#[test]
fn silence_determines_nothing() {
    let (silence, noise) = (vec![0.0; 200], uniform(1, Purpose::NoiseDrive, 200));
    let records = [
        ("u = 0", [silence.clone(), noise.clone(), silence.clone()]),
        ("y = 0", [noise.clone(), silence.clone(), noise]),
        ("both", [silence.clone(), silence.clone(), silence]),
    ];
    for (what, record) in &records {
        for (name, options) in methods(&[]) {
            let pass = estimate(&options, 2, record).expect("enough samples");
            let kind = checked(&format!("{name}, {what}"), &pass);
            if observes(name) {
                assert_eq!(kind, None, "{name}, {what}");
            } else {
                let expected = of_no_rank(name);
                let is_expected = kind.is_some_and(|kind| expected.contains(&kind));
                assert!(is_expected, "{name}, {what}: {kind:?}, not {expected:?}");
            }
        }
    }
}

/// A reference of zeros makes no instruments.
#[test]
fn a_silent_reference_is_singular() {
    let [u, y, _] = in_a_loop(SECOND, 0.3, 2, 200);
    let record = [u, y, vec![0.0; 200]];
    let mut count = 0;
    for (name, options) in methods(&[("instruments", json!("r"))]).into_iter().chain(methods(&[])) {
        if options.needs().reference.is_some() {
            count += 1;
            let pass = estimate(&options, 2, &record).expect("enough samples");
            let kind = checked(name.name(), &pass);
            assert_eq!(kind, Some(FailureKind::Singular), "{name}");
        }
    }
    assert!(count > 5);
}

/// One sample that is no number, of a signal that the method uses.
#[test]
fn one_sample_that_is_not_finite() {
    let good = in_a_loop(SECOND, 0.3, 3, 200);
    for (name, options) in methods(&[]) {
        for signal in 0..3 {
            if signal == 2 && options.needs().reference.is_none() {
                continue;
            }
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut record = good.clone();
                record[signal][100] = value;
                let pass = estimate(&options, 2, &record).expect("enough samples");
                let what = format!("{name}, {value} in signal {signal}");
                let kind = checked(&what, &pass);
                assert_eq!(kind, Some(FailureKind::NonFinite), "{what}");
            }
        }
    }
}

/// Two samples are too few for any method that solves for a model of second order; with one sample after another it is
/// refused, until it has a model or a typed failure.
#[test]
fn the_shortest_record_that_a_method_takes() {
    let good = in_a_loop(SECOND, 0.3, 4, 200);
    for (name, options) in methods(&[]) {
        let least = (1..=200)
            .find(|n| {
                let record = good.each_ref().map(|signal| signal[..*n].to_vec());
                let pass = estimate(&options, 2, &record);
                pass.is_some_and(|pass| {
                    checked(&format!("{name}, {n} samples"), &pass);
                    true
                })
            })
            .expect("200 are enough");
        assert!(least > 2 || observes(name), "{name}: {least}");
        for n in least..least + 8 {
            let record = good.each_ref().map(|signal| signal[..n].to_vec());
            let pass = estimate(&options, 2, &record).expect("more samples");
            checked(&format!("{name}, {n} samples"), &pass);
        }
    }
}

/// The kinds that a method must have on some of the records below, and those that it may have.
fn kinds(name: EstimatorName) -> [Vec<FailureKind>; 2] {
    use FailureKind::{
        Boundary, Implausible, IterationLimit, NoConvergence, NonFinite, NotIdentifiable, RankDeficient, Singular,
        UnstableInstruments, UnstablePredictor,
    };
    let solves = [NonFinite, Singular, RankDeficient];
    let with = |more: &[FailureKind]| [&solves, more].concat();
    let iterates = [IterationLimit, UnstablePredictor];
    match name.name() {
        "kreisselmeier" | "zhang" | "joint-ekf" => [vec![NonFinite], vec![]],
        "rls" | "recursive-iv" | "rels" | "recursive-sriv" | "rpem" | "ssarx" => {
            [vec![NonFinite, RankDeficient], vec![]]
        }
        "iv4" => [with(&[UnstableInstruments]), vec![]],
        "sriv" | "stmcb" | "srivc" | "two-stage" | "joint" => [with(&iterates), vec![]],
        "bels" => [with(&[IterationLimit]), vec![Implausible]],
        // Those with a noise model.
        "riv" | "rivc" => [with(&[&iterates[..], &[Boundary]].concat()), vec![]],
        "clriv" | "clrivc" => [
            with(&[&iterates[..], &[Boundary, UnstableInstruments]].concat()),
            vec![],
        ],
        "indirect" => [with(&[NoConvergence, UnstablePredictor]), vec![]],
        "wnsf" => [vec![NonFinite, RankDeficient, IterationLimit], vec![Implausible]],
        "bjsm" | "morsm" => [
            vec![NonFinite, RankDeficient, IterationLimit, UnstablePredictor],
            vec![],
        ],
        "oe" | "armax" | "bj" | "general" | "pem-t" => {
            [vec![NonFinite, NotIdentifiable, Boundary], vec![IterationLimit]]
        }
        "pem-eiv" => [
            vec![NonFinite, Boundary],
            vec![Singular, RankDeficient, NotIdentifiable, IterationLimit],
        ],
        "pem" => [with(&[Boundary]), vec![NotIdentifiable, IterationLimit]],
        "kernel-fir" => [
            vec![NonFinite, Singular, Boundary, IterationLimit, NotIdentifiable],
            vec![Implausible],
        ],
        // Whether u excites the block rows is asked first.
        "moesp" | "n4sid" | "parsim-k" => [vec![NonFinite, RankDeficient], vec![Singular]],
        _ => [with(&[]), vec![]],
    }
}

/// Hard records of order 1 to 4: no excitation, no relation, a plant that grows, more noise than signal in open and
/// closed loop, and controllers that would not stabilise. Each method meets each kind that its steps can end in, and no
/// other.
#[test]
fn every_kind_of_every_method_is_met() {
    let n = 200;
    let u = || uniform(5, Purpose::Input, n);
    let ones = vec![1.0; n];
    let sine = (0..n).map(|k| (0.3 * k as f64).sin()).collect();
    let mut not_finite = in_a_loop(SECOND, 0.3, 6, n);
    for signal in &mut not_finite {
        signal[100] = f64::INFINITY;
    }
    let silence = || vec![0.0; n];
    let unstable: [&[f64]; 2] = [&[0.0, 1.0], &[1.0, -1.2]];
    let mut records = vec![
        (2, not_finite),
        (2, [silence(), silence(), silence()]),
        (2, [u(), silence(), u()]),
        (2, [silence(), u(), silence()]),
        (2, [ones.clone(), ones.clone(), ones]),
        (3, open(SECOND, sine, 0.0, 7)),
        (3, open(SECOND, u(), 0.0, 8)),
        (1, open(unstable, u(), 0.3, 9)),
        (4, [u(), uniform(10, Purpose::NoiseDrive, n), u()]),
    ];
    for trial in 0..100 {
        let input = uniform(1000 + trial, Purpose::Input, 40);
        records.push((2, open(SECOND, input, 20.0, 1000 + trial)));
        records.push((2, in_a_loop(SECOND, 3.0, 2000 + trial, 60)));
    }
    let variants: [&[(&str, Value)]; 4] = [
        &[],
        &[("stabilise", json!("none"))],
        &[("rows", json!("complete"))],
        &[("controller", json!("5"))],
    ];
    let mut met: BTreeMap<&str, BTreeSet<FailureKind>> = BTreeMap::new();
    for (i, variant) in variants.iter().enumerate() {
        for (name, options) in methods(variant) {
            let of_name = met.entry(name.name()).or_default();
            if i > 0 && !name.takes(variant[0].0) {
                continue;
            }
            for (at, (order, record)) in records.iter().enumerate() {
                let Some(pass) = estimate(&options, *order, record) else {
                    continue;
                };
                of_name.extend(checked(&format!("{name}, record {at}"), &pass));
            }
        }
    }
    let mut wrong = Vec::new();
    for (name, _) in methods(&[]) {
        let [must, may] = kinds(name);
        let met = &met[name.name()];
        let missing: Vec<_> = must.iter().filter(|kind| !met.contains(kind)).collect();
        let others = met.iter().filter(|kind| !must.contains(kind) && !may.contains(kind));
        let others: Vec<_> = others.collect();
        if !(missing.is_empty() && others.is_empty()) {
            wrong.push(format!("{name}: not met {missing:?}, beyond {others:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Values that a numeric option refuses: out of its range, or of no meaning. Texts and names have tests of their
/// own.
fn refused(key: &str) -> Vec<Value> {
    match key {
        // Positive numbers.
        "p0" | "ts" | "ratio" => vec![json!(0.0), json!(-1.0)],
        "dead_time" => vec![json!(-0.1), json!("3:1")],
        // Shares: rates of forgetting are above 0 and at most 1.
        "forgetting" | "early_forgetting" => vec![json!(0.0), json!(-0.5), json!(1.001)],
        "memory" => vec![json!(-0.1), json!(1.001)],
        "pole" => vec![json!(-1.0), json!(1.0)],
        "freedom" => vec![json!(2.0), json!(101.0)],
        "gamma" => vec![json!(0.0), json!(2.0)],
        // Variances.
        "output_noise" | "input_noise" | "state_noise" | "parameter_noise" | "ridge" => {
            vec![json!(-1.0)]
        }
        "measurement_noise" | "state_variance" | "parameter_variance" => {
            vec![json!(0.0), json!(-1.0)]
        }
        // Counts that cannot be zero.
        "iterations" | "taps" | "high_order" | "long" | "block_rows" => {
            vec![json!(0), json!(-1), json!(1.5)]
        }
        // Counts.
        "start" | "earlier" | "extra" => vec![json!(-1), json!(1.5)],
        // A number or a text.
        "controller" => vec![json!("x"), json!("1/"), json!(true)],
        _ => Vec::new(),
    }
}

/// Every numeric option of every estimator refuses what is out of its range, and says which option it is.
#[test]
fn numbers_out_of_range_are_refused() {
    let mut tried = BTreeSet::new();
    let mut wrong = Vec::new();
    for name in EstimatorName::ALL {
        for option in name.options() {
            let is_numeric = |kind: &Value| kind == "number" || kind == "integer";
            let numeric = match &option.schema["type"] {
                Value::Array(kinds) => kinds.iter().any(is_numeric),
                kind => is_numeric(kind),
            };
            if !numeric {
                continue;
            }
            let values = refused(&option.key);
            if values.is_empty() {
                wrong.push(format!("{name}: {} has no bad value", option.key));
            }
            for value in values {
                tried.insert(option.key.clone());
                let given = Map::from_iter([(option.key.clone(), value.clone())]);
                let error = name.parse(given);
                let key = error.as_ref().err().and_then(|error| error.key.as_deref());
                if key != Some(option.key.as_str()) {
                    wrong.push(format!("{name}: {} {value}: {error:?}", option.key));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for key in ["p0", "forgetting", "early_forgetting", "start"] {
        assert!(tried.contains(key), "{key}");
    }
}

/// The options of recursions that are no numbers: theta0 of another length, or with what is no number, orders that are
/// none, names that are none.
#[test]
fn texts_that_recursions_refuse() {
    let mut count = 0;
    for name in EstimatorName::ALL {
        if !name.takes("theta0") {
            continue;
        }
        count += 1;
        let refused = |given: &[(&str, Value)], key: &str| {
            let given = given.iter().cloned();
            let given = given.map(|(key, value)| (key.to_owned(), value));
            let error = name.parse(given.collect()).expect_err("refused");
            assert_eq!(error.key.as_deref(), Some(key), "{name}: {error}");
        };
        let orders = name
            .parse(Map::new())
            .ok()
            .and_then(|options| options.default_orders(1))
            .expect("orders");
        let orders = ("orders", json!(orders.to_string()));
        refused(&[orders.clone(), ("theta0", json!("1"))], "theta0");
        refused(&[orders, ("theta0", json!("1,2,3,4,5,6,7,8,9"))], "theta0");
        for text in ["", "1,,2", "1,x", "nan,1", "inf,1"] {
            refused(&[("theta0", json!(text))], "theta0");
        }
        for text in ["", "na=-1", "nk=1", "nx=2"] {
            refused(&[("orders", json!(text))], "orders");
        }
        for key in ["initial_state", "form", "instruments"] {
            if name.takes(key) {
                refused(&[(key, json!("none such"))], key);
            }
        }
        // Without orders among the options the setting decides, and a theta0 of another length is refused there.
        let given = Map::from_iter([("theta0".to_owned(), json!("1,2,3"))]);
        let options = name.parse(given).expect("three numbers");
        let shape = Shape { order: 4, window: 200 };
        let error = options.prepare(&shape.into()).err().expect("refused");
        assert!(error.to_string().contains('3'), "{name}: {error}");
    }
    assert_eq!(count, 5);
}
