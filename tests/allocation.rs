//! A trial allocates nothing once its worker has warmed up. A program of its own: a program has one allocator, and this
//! one counts.

#[path = "common/counting.rs"]
mod counting;

use asobench::estimator::{ArxOptions, EstimatorName, Method, Pass, Shape, Window};
use asobench::model::Orders;
use asobench::signal::{Purpose, stream};
use asobench::study::{Cell, DiscreteCell, Engine, Experiment, Measure, OutputRows, Source, Trials, Worker};
use counting::allocations;
use rand::Rng as _;

/// The estimators that take memory for a record besides the buffers that were prepared: searches keep the minima that
/// they meet, a reflection finds zeros in memory of its own, and faer's singular values and eigenvalues take it in each
/// call. All others are counted, one that is added too.
const TAKE_MEMORY: [&str; 27] = [
    "riv",
    "srivc",
    "rivc",
    "clriv",
    "clrivc",
    "two-stage",
    "joint",
    "indirect",
    "tls",
    "bels",
    "iv-compensated",
    "wnsf",
    "bjsm",
    "morsm",
    "oe",
    "armax",
    "bj",
    "general",
    "pem-t",
    "pem-eiv",
    "moesp",
    "n4sid",
    "cva",
    "ssarx",
    "parsim-k",
    "pem",
    "kernel-fir",
];

/// On records of one length.
fn an_estimate_allocates_nothing() {
    let n = 200;
    let record = |trial: u64| {
        let mut random = stream(71, trial, Purpose::Input);
        let mut uniform = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
        let u: Vec<f64> = (0..n).map(|_| uniform()).collect();
        let mut y = vec![0.0; n];
        for k in 2..n {
            y[k] = 1.5 * y[k - 1] - 0.7 * y[k - 2] + u[k - 1] + 0.1 * uniform();
        }
        (u, y)
    };
    let records: Vec<_> = (0..60).map(record).collect();
    for estimator in EstimatorName::ALL {
        let options = estimator.parse(serde_json::Map::new()).expect("defaults");
        if TAKE_MEMORY.contains(&estimator.name()) || options.needs().plant {
            continue;
        }
        let mut passes = vec![Pass::new(2); options.outputs("method").len()];
        let shape = Shape { order: 2, window: n };
        let mut method = options.prepare(&shape.into()).expect("an estimator");
        let mut run = |range: std::ops::Range<usize>| {
            for (u, y) in &records[range] {
                method.estimate(Window::new(u, y, n), &mut passes);
            }
        };
        run(0..40);
        let before = allocations();
        run(40..60);
        let made = allocations() - before;
        assert_eq!(made, 0, "{estimator}: {made} allocations in 20 records");
    }
}

/// Trials of the paper's cells, and of one where estimates diverge and are solved by every way there is.
#[test]
fn a_trial_allocates_nothing() {
    an_estimate_allocates_nothing();
    for engine in [Engine::Faer, Engine::Lanes] {
        let mut experiment = Experiment::nikolov2023(1);
        experiment.file.engine = engine;
        // Everything that a trial can be asked for.
        experiment.file.parameters = true;
        let discrete = Measure::ALL
            .iter()
            .filter(|measure| measure.is_of(asobench::study::file::StudyKind::Discrete));
        // Lanes do not have the distances d and d_g, predictions ahead and innovations. d_g takes room for the states
        // of any model, predictions for their errors, innovations for their correlations.
        let distances = [
            Measure::Distance,
            Measure::ResponseDistance,
            Measure::FitAhead,
            Measure::InnovationsWhite,
        ];
        let has =
            |measure: &Measure| !distances.contains(measure) || engine == Engine::Faer && *measure == Measure::Distance;
        experiment.file.measures = discrete.copied().filter(has).collect();
        if engine == Engine::Faer {
            let orders = Some(Orders::arx(3, 2, 2));
            let options = ArxOptions {
                orders,
                ..ArxOptions::default()
            };
            experiment.methods.push(Method::named("arx", options));
        }
        let outputs = experiment.output_count();
        let quiet = experiment.cells[0].discrete().expect("records");
        let diverging = Cell {
            claim: "diverging".to_owned(),
            source: Source::Discrete(Box::new(DiscreteCell {
                eta: 60.0,
                ..quiet.clone()
            })),
            ..experiment.cells[0].clone()
        };
        experiment.cells.push(diverging);
        for cell in &experiment.cells {
            let mut worker = Worker::new(&experiment, cell).expect("a valid cell");
            assert_eq!(matches!(worker, Worker::Lanes(_)), engine == Engine::Lanes);
            let mut trials = Trials::new(&experiment, cell);
            let mut run = |from: u64| {
                trials.rows.clear();
                let ran = worker.run_into(from..from + 50, &mut trials);
                ran.expect("trials");
                assert_eq!(trials.rows.len(), 50 * outputs);
                let width = |of: &OutputRows| of.parameters().len();
                assert!(trials.rows.outputs().iter().all(|of| width(of) == 12));
                trials.fallbacks
            };
            // Long enough to meet ill-conditioned models, whose buffers grow to the longest problem met.
            let warm = (0..3000).step_by(50).map(&mut run).max();
            let before = allocations();
            let end = (3000..3500).step_by(50).map(&mut run).max();
            let made = allocations() - before;
            let claim = &cell.claim;
            assert_eq!(made, 0, "{engine}, {claim}: {made} allocations in 500 trials");
            // Solves of lanes alone were among them.
            if engine == Engine::Lanes && claim == "diverging" {
                assert!(end > warm, "{warm:?} {end:?}");
            }
        }
    }
}
