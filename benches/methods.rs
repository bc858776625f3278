//! Every estimator on one record: orders 2, 4, 6, windows of 98, 998, 5000 samples, and the record of W98. The records
//! are written to `target/records` for `benches/peers/methods.py`.
//!
//! The plants have the first n of the poles 0.8, -0.7, 0.5, -0.4, 0.2, -0.2, and white output noise of a tenth of the
//! output's size. Every method has n coefficients for each of its polynomials (one for C and D).
//! `examples/method_table.rs` prints the times as a table.

use asobench::data::Realisation;
use asobench::estimator::{EstimatorName, MethodOptions, Pass, Shape, Window};
use asobench::model::{LinearModel, Orders};
use asobench::signal::{Input, InputLaw, Purpose, Sequence, stream};
use asobench::study::Experiment;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use serde_json::{Map, Value};
use std::hint::black_box;
use std::iter;
use std::path::Path;
use std::time::Duration;

/// An estimator with orders n; `None` if it needs more than a record. In continuous time a sample is a second; methods
/// for a closed loop get u for the reference, which is the work of any other.
fn options(estimator: EstimatorName, n: usize) -> Option<MethodOptions> {
    let given = [("ts", Value::from(1.0)), ("controller", "0,0.1/1".into())];
    let given = given.into_iter().filter(|(key, _)| estimator.takes(key));
    let mut options: Map<_, _> = given.map(|(key, value)| (key.to_owned(), value)).collect();
    let defaults = estimator.parse(options.clone()).ok()?;
    if defaults.needs().plant {
        return None;
    }
    if let Some(orders) = defaults.default_orders(n) {
        let (nc, nd) = (orders.nc.min(1), orders.nd.min(1));
        let orders = Orders { nc, nd, ..orders };
        options.insert("orders".to_owned(), Value::from(orders.to_string()));
    }
    if estimator.takes("block_rows") {
        options.insert("block_rows".to_owned(), Value::from(10));
    }
    estimator.parse(options).ok()
}

/// `arx` of the order by AIC among 1 to 8.
fn chosen_of_eight() -> MethodOptions {
    let arx: EstimatorName = "arx".parse().expect("an estimator");
    let given = [("orders", "na=8,nb=8"), ("choose", "aic")];
    let given = given.map(|(key, value)| (key.to_owned(), Value::from(value)));
    arx.parse(Map::from_iter(given)).expect("options")
}

fn record(n: usize, window: usize) -> (Vec<f64>, Vec<f64>) {
    let mut f = vec![1.0];
    for pole in &[0.8, -0.7, 0.5, -0.4, 0.2, -0.2][..n] {
        let with = |k: usize| f.get(k).copied().unwrap_or(0.0);
        f = (0..=f.len())
            .map(|k| with(k) - if k > 0 { pole * with(k - 1) } else { 0.0 })
            .collect();
    }
    let b = (0..n).map(|i| 1.0 / (1.0 + i as f64));
    let mut truth = LinearModel::zero(format!("nb={n},nf={n}").parse().expect("orders"));
    let theta: Vec<f64> = b.chain(f[1..].iter().copied()).collect();
    truth.set_parameters(&theta);
    let draw = |purpose| {
        let mut signal = vec![0.0; window];
        let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
        input.fill(&mut stream(61, n as u64, purpose), &mut signal);
        signal
    };
    let (u, e) = (draw(Purpose::Input), draw(Purpose::Plant));
    let mut y = vec![0.0; window];
    truth.simulate(&u, &mut y);
    y.iter_mut().zip(&e).for_each(|(y, e)| *y += 0.2 * e);
    (u, y)
}

fn write(name: &str, u: &[f64], y: &[f64]) -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/records");
    std::fs::create_dir_all(&folder)?;
    let rows = u.iter().zip(y).map(|(u, y)| format!("{u:?},{y:?}\n"));
    let text: String = iter::once("u,y\n".to_owned()).chain(rows).collect();
    std::fs::write(folder.join(format!("{name}.csv")), text)
}

fn bench(criterion: &mut Criterion, n: usize, name: &str, u: &[f64], y: &[f64]) {
    write(name, u, y).expect("a record in target/records");
    let mut group = criterion.benchmark_group("methods");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800));
    let shape = Shape {
        order: n,
        window: y.len(),
    };
    let named = EstimatorName::ALL.iter().filter_map(|estimator| {
        let options = options(*estimator, n)?;
        Some((estimator.name(), options))
    });
    for (name_of_method, options) in named.chain([("arx-choose", chosen_of_eight())]) {
        let mut passes: Vec<Pass> = options.outputs("method").iter().map(|_| Pass::new(n)).collect();
        let mut method = options.prepare(&shape.into()).expect("a valid shape");
        group.bench_function(BenchmarkId::new(name_of_method, name), |b| {
            b.iter(|| {
                method.estimate(Window::with_reference(u, y, u, y.len()), &mut passes);
                black_box(passes.len())
            });
        });
    }
    group.finish();
}

fn methods(criterion: &mut Criterion) {
    for n in [2, 4, 6] {
        for window in [98, 998, 5000] {
            let (u, y) = record(n, window);
            bench(criterion, n, &format!("n={n},N={window}"), &u, &y);
        }
    }
    let experiment = Experiment::nikolov2023(1);
    let cell = experiment
        .cells
        .iter()
        .filter_map(|cell| cell.discrete())
        .find(|cell| cell.window == 98);
    let cell = cell.expect("the paper's cell of 98 samples");
    let mut record = Realisation::default();
    cell.realise(experiment.file.seed, 0, &mut record);
    bench(criterion, 6, "W98", &record.u[..98], &record.y[..98]);
}

criterion_group!(benches, methods);
criterion_main!(benches);
