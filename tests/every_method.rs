//! Hard records, and changes of units, for every estimator of the registry with its defaults.

use asobench::estimator::{
    EstimatorName, FailureKind, Method, MethodOptions, Pass, Progress, Shape, Window, option_keys,
};
use asobench::signal::{Purpose, stream};
use rand::Rng as _;
use serde_json::{Map, Value};
use std::collections::BTreeSet;

/// u, y and r.
type Signals = [Vec<f64>; 3];

/// A record of `u = r - 0.1 y(k-1)` and `y = B/F u + e`, e uniform of this size.
struct Recipe {
    name: &'static str,
    b: &'static [f64],
    f: &'static [f64],
    order: usize,
    samples: usize,
    noise: f64,
    constant: bool,
}

const SECOND: Recipe = Recipe {
    name: "second order",
    b: &[0.0, 1.0, 0.5],
    f: &[1.0, -1.5, 0.7],
    order: 2,
    samples: 200,
    noise: 0.3,
    constant: false,
};

const HARD: [Recipe; 8] = [
    SECOND,
    Recipe {
        name: "order 6, 40 samples",
        b: &[0.0, 1.0, 0.3, 0.2, 0.1, 0.2, 0.1],
        f: &[1.0, -0.6, -0.53, 0.32, 0.05, -0.02, -0.004],
        order: 6,
        samples: 40,
        noise: 2.0,
        ..SECOND
    },
    Recipe {
        name: "a constant input",
        constant: true,
        ..SECOND
    },
    Recipe {
        name: "a constant input without noise",
        constant: true,
        noise: 0.0,
        ..SECOND
    },
    Recipe {
        name: "delay 5",
        b: &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.5],
        ..SECOND
    },
    Recipe {
        name: "near cancellation",
        b: &[0.0, 1.0, -0.799_999],
        f: &[1.0, -1.3, 0.4],
        ..SECOND
    },
    Recipe {
        name: "no noise",
        noise: 0.0,
        ..SECOND
    },
    Recipe {
        name: "an order too many, no noise",
        order: 3,
        noise: 0.0,
        samples: 60,
        ..SECOND
    },
];

fn record(recipe: &Recipe) -> Signals {
    let mut random = stream(113, 0, Purpose::Input);
    let mut uniform = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
    let n = recipe.samples;
    let [mut u, mut y, mut x, mut r] = [(); 4].map(|()| vec![0.0; n]);
    for k in 0..n {
        let past = |c: &[f64], s: &[f64]| -> f64 {
            let terms = c.iter().enumerate().skip(1).filter(|(lag, _)| *lag <= k);
            terms.map(|(lag, c)| c * s[k - lag]).sum()
        };
        x[k] = past(recipe.b, &u) - past(recipe.f, &x);
        let (drawn, e) = (uniform(), uniform());
        y[k] = x[k] + recipe.noise * e;
        r[k] = if recipe.constant { 1.0 } else { drawn };
        u[k] = r[k] - if recipe.constant { 0.0 } else { past(&[0.0, 0.1], &y) };
    }
    [u, y, r]
}

/// The defaults of an estimator that needs no more than a record.
fn options(name: EstimatorName) -> Option<MethodOptions> {
    let mut options = Map::new();
    if name.takes("controller") {
        options.insert("controller".to_owned(), Value::from("0,0.1/1"));
    }
    let options = name.parse(options).expect("defaults");
    (!options.needs().plant).then_some(options)
}

fn estimate(options: &MethodOptions, order: usize, [u, y, r]: &Signals) -> Option<Pass> {
    let method = Method::named("method", options.clone());
    let window = y.len();
    let mut estimator = method.prepare(Shape { order, window }).ok()?;
    let mut passes = vec![Pass::new(order); method.passes()];
    estimator.estimate(Window::with_reference(u, y, r, window), &mut passes);
    passes.pop()
}

/// A model with finite numbers, or the kind of a failure, and nothing that is neither.
#[test]
fn hard_records_end_in_a_model_or_a_typed_failure() {
    let mut wrong = Vec::new();
    for (recipe, scale) in HARD.iter().zip([1.0, 1e6, 1e-6].into_iter().cycle()) {
        let record = record(recipe);
        let record = record.map(|s| s.iter().map(|x| x * scale).collect());
        for name in EstimatorName::ALL {
            let Some(options) = options(*name) else {
                continue;
            };
            let Some(pass) = estimate(&options, recipe.order, &record) else {
                continue;
            };
            let has_a_model = pass.progress >= Progress::Parameters;
            let finite = pass.model.parameters().all(f64::is_finite);
            let errors = pass.model.standard_errors().unwrap_or_default();
            let is_whole = has_a_model && finite && errors.iter().all(|se| *se >= 0.0 && se.is_finite());
            let promised = pass.failure.is_none_or(|failure| failure.kind.leaves_a_model());
            if promised && !is_whole {
                wrong.push(format!("{}: {name}: {:?} {errors:?}", recipe.name, pass.failure));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Without noise an order too many leaves the parameters open, however many rows the rounding of a recursion has added
/// up over.
#[test]
fn recursions_notice_an_order_too_many() {
    for samples in [60, 400, 20_000] {
        let recipe = Recipe {
            name: "an order too many, no noise",
            order: 3,
            noise: 0.0,
            samples,
            ..SECOND
        };
        let record = record(&recipe);
        for name in ["rls", "rels", "recursive-iv", "recursive-sriv", "rpem", "arx"] {
            let options = options(name.parse().expect("a name")).expect("options");
            let kind = |order: usize| {
                let pass = estimate(&options, order, &record).expect("a pass");
                pass.failure.map(|failure| failure.kind)
            };
            assert_eq!(kind(3), Some(FailureKind::RankDeficient), "{name}, {samples} samples");
            assert_eq!(kind(2), None, "{name}, {samples} samples");
        }
    }
}

const LARGE: f64 = 1_048_576.0;

/// The factors of u and y: powers of two of any size, and one that is in the way of rounding.
fn factors() -> Vec<[f64; 2]> {
    let power = |exponent: i32| 2_f64.powi(exponent);
    let exponents = [-400, -200, -63, -20, 0, 20, 63, 200, 400];
    let pairs = exponents.map(|u| exponents.map(|y| [power(u), power(y)]));
    pairs
        .into_iter()
        .flatten()
        .chain([[1.0, 1000.0], [1e-3, 1.0]])
        .collect()
}

/// The numbers of a pass, those with the same unit together, and the units that these factors give them.
fn with_units(pass: &Pass, [of_input, of_output]: [f64; 2]) -> Vec<(&'static str, Vec<f64>, f64)> {
    let (model, gain) = (&pass.model, of_output / of_input);
    let errors = model.standard_errors().unwrap_or_default();
    let (a, rest) = errors.split_at(model.orders().na.min(errors.len()));
    let (b, others) = rest.split_at(model.orders().nb.min(rest.len()));
    let polynomials = [&model.a, &model.c, &model.d, &model.f];
    vec![
        ("A, C, D, F", polynomials.map(Vec::clone).concat(), 1.0),
        ("B", model.b.clone(), gain),
        ("se", [a, others].concat(), 1.0),
        ("se of B", b.to_vec(), gain),
        ("B(s)", pass.continuous.numerator.clone(), gain),
        ("sd of e", vec![model.noise_variance.sqrt()], of_output),
        ("loss", vec![pass.loss.sqrt()], of_output),
        ("x0", pass.x0.clone(), of_output),
        ("singular values", pass.singular_values.clone(), of_output),
        ("correlations", pass.correlations.clone(), 1.0),
    ]
}

/// The options with the numbers that have a unit in these units.
fn in_units(name: EstimatorName, gain: f64) -> Option<MethodOptions> {
    let mut keys = Map::new();
    if name.takes("controller") {
        let controller = format!("0,{:e}/1", 0.1 / gain);
        keys.insert("controller".to_owned(), Value::from(controller));
    }
    if name.takes("ratio") {
        keys.insert("ratio".to_owned(), Value::from(gain * gain));
    }
    name.parse(keys).ok()
}

/// In other units for u (and r) and y every estimator has the same model, to rounding, or a kind of failure, and that
/// only where B is 2^400 of its unit away from it: no constant of a method has a unit.
#[test]
fn other_units_change_nothing_but_the_units() {
    let signals = record(&SECOND);
    let mut wrong = Vec::new();
    for name in EstimatorName::ALL {
        let Some(of_record) = options(*name).and_then(|options| estimate(&options, 2, &signals)) else {
            assert_eq!(name.name(), "known");
            continue;
        };
        for [of_input, of_output] in factors() {
            let times = |s: &Vec<f64>, by: f64| s.iter().map(|x| x * by).collect();
            let [u, y, r] = &signals;
            let scaled = [times(u, of_input), times(y, of_output), times(r, of_input)];
            let gain = of_output / of_input;
            // A ratio of variances is beyond doubles before B is.
            let Some(options) = in_units(*name, gain) else {
                assert!(gain < 1e-150 && name.takes("ratio"), "{name}");
                continue;
            };
            let case = format!("{name} {of_input:e} {of_output:e}");
            let pass = estimate(&options, 2, &scaled).expect("the same shape");
            if pass.failure != of_record.failure {
                if (1e-121..1e121).contains(&gain) || pass.failure.is_none() {
                    let failures = (of_record.failure, pass.failure);
                    wrong.push(format!("{case}: {failures:?}"));
                }
                continue;
            }
            let expected = with_units(&of_record, [1.0, 1.0]);
            let found = with_units(&pass, [of_input, of_output]);
            for ((what, expected, _), (_, found, unit)) in expected.iter().zip(&found) {
                let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let near = |(x, y): (&f64, &f64)| (x - y / unit).abs() <= 1e-9 * largest || x.is_nan() && y.is_nan();
                if expected.len() != found.len() || !expected.iter().zip(found).all(near) {
                    wrong.push(format!("{case} {what}: {expected:?} {found:?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Searches see a record in units of its own, powers of two, so that they take the same steps to the same minimum: no
/// bit of a model differs but those of the unit.
#[test]
fn searches_take_the_same_steps_in_all_units() {
    for recipe in &HARD {
        let signals = record(recipe);
        for name in ["oe", "armax", "bj"] {
            let name: EstimatorName = name.parse().expect("an estimator");
            let options = options(name).expect("no plant");
            let of_record = estimate(&options, recipe.order, &signals).expect("enough samples");
            for (of_input, of_output) in [(1.0, 1024.0), (1.0 / 64.0, 1.0), (LARGE, 0.5)] {
                let times = |s: &Vec<f64>, by: f64| s.iter().map(|x| x * by).collect();
                let [u, y, r] = &signals;
                let scaled = [times(u, of_input), times(y, of_output), times(r, of_input)];
                let pass = estimate(&options, recipe.order, &scaled).expect("enough samples");
                let what = format!("{}: {name} {of_input} {of_output}", recipe.name);
                let counts = |pass: &Pass| (pass.failure, pass.iterations, pass.minima);
                assert_eq!(counts(&pass), counts(&of_record), "{what}");
                if pass.progress < Progress::Parameters {
                    continue;
                }
                let (gain, model) = (of_output / of_input, &mut pass.model.clone());
                model.b.iter_mut().for_each(|b| *b /= gain);
                let orders = model.orders();
                let (n, before) = (orders.parameters(), orders.na);
                let of_b = |i: usize| {
                    let is_of_b = (before..before + orders.nb).contains(&i);
                    if is_of_b { gain } else { 1.0 }
                };
                for (i, value) in model.covariance.iter_mut().enumerate() {
                    *value /= of_b(i / n) * of_b(i % n);
                }
                model.noise_variance /= of_output * of_output;
                assert_eq!(*model, of_record.model, "{what}");
                assert_eq!(pass.loss / (of_output * of_output), of_record.loss, "{what}");
            }
        }
    }
}

/// Estimators that share the key of an option share a flag of the command line, which reads one kind of value.
#[test]
fn an_option_has_one_kind_of_value() {
    let kind = |schema: &Value| match &schema["type"] {
        _ if schema["enum"].is_array() => "a name".to_owned(),
        Value::Array(kinds) => kinds
            .iter()
            .find(|kind| *kind != "null")
            .map_or_else(String::new, Value::to_string),
        kind => kind.to_string(),
    };
    for key in option_keys() {
        let takers = EstimatorName::ALL.iter().flat_map(|name| name.options());
        let of_key = takers.filter(|option| option.key == key.as_str());
        let kinds: BTreeSet<String> = of_key.map(|option| kind(&option.schema)).collect();
        assert_eq!(kinds.len(), 1, "{key}: {kinds:?}");
    }
}
