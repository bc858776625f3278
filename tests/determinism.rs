//! Same bits for any number of threads, any order of cells, any length of the run.

use crate::common::table::Table;
use asobench::estimator::{Estimator, LeastSquares, Method, Output, Pass, Solver, Window};
use asobench::study::file::{ExperimentFile, TrialRule};
use asobench::study::{
    Campaign, Cell, CellTally, DiscreteCell, Engine, Experiment, Measure, Row, Rows, RunOptions, Source, StoredTrials,
    Trial, Trials, Worker, run,
};
use std::path::Path;
use std::sync::atomic::AtomicBool;

const TRIALS: u64 = 700;

/// The paper's experiment on an engine.
fn on(engine: Engine, seed: u64) -> Experiment {
    let mut experiment = Experiment::nikolov2023(seed);
    experiment.file.engine = engine;
    experiment
}

/// The rows of one trial by the engine that the experiment says, after those of others.
fn rows_after(experiment: &Experiment, cell: &Cell, before: &[u64], trial: u64) -> Vec<Row> {
    kept_after(experiment, cell, before, trial).iter().collect()
}

fn kept_after(experiment: &Experiment, cell: &Cell, before: &[u64], trial: u64) -> Rows {
    let mut worker = Worker::new(experiment, cell).expect("a valid cell");
    let by_lanes = matches!(worker, Worker::Lanes(_));
    assert_eq!(by_lanes, experiment.file.engine != Engine::Faer);
    for other in before {
        let other = worker.run_into(*other..other + 1, &mut Trials::new(experiment, cell));
        other.expect("a trial");
    }
    let mut trials = Trials::of_all_measures(experiment, cell);
    let ran = worker.run_into(trial..trial + 1, &mut trials);
    ran.expect("a trial");
    trials.rows
}

/// Runs into a folder in blocks of its own length for each number of threads; returns the bytes of its trials and the
/// cells' tallies.
fn bytes(experiment: &Experiment, trials: u64, threads: usize, path: &Path) -> (Vec<u8>, Vec<CellTally>) {
    let stop = AtomicBool::new(false);
    let options = RunOptions {
        threads,
        block: Some(331 / threads as u64),
        fresh: true,
        ..RunOptions::default()
    };
    let folder = path.parent().expect("a folder");
    Campaign::open(folder, experiment, TrialRule::Fixed(trials), options)
        .and_then(|campaign| campaign.run(&stop, |_| (), |_| Vec::new()))
        .expect("a run");
    let mut tallies = vec![CellTally::default(); experiment.cells.len()];
    run(experiment, trials, threads, &stop, |block| {
        tallies[block.span.cell].merge(block.tally);
        Ok::<(), std::io::Error>(())
    })
    .expect("a run");
    (std::fs::read(path).expect("the file"), tallies)
}

/// The tallies without their series, and the bits of the series, which are kept block by block.
fn parts(tallies: &[CellTally]) -> Vec<(CellTally, Vec<Vec<u64>>)> {
    let part = |tally: &CellTally| {
        let mut rest = tally.clone();
        rest.series.clear();
        let bits = |series: &Vec<f64>| series.iter().map(|x| x.to_bits()).collect();
        (rest, tally.whole_series().iter().map(bits).collect())
    };
    tallies.iter().map(part).collect()
}

/// Writes a table with the last bit of one number flipped.
fn write_changed(table: &Table, name: &str, row: usize, path: &Path) {
    let mut values = table.numbers::<f64>(name);
    values[row] = values[row].map(|x| f64::from_bits(x.to_bits() ^ 1));
    let mut changed = table.clone();
    changed.set(name, values);
    changed.write(path);
}

#[test]
fn threads_move_no_bit() {
    check_threads(&on(Engine::Lanes, 1));
}

#[test]
fn threads_move_no_bit_of_faer() {
    check_threads(&on(Engine::Faer, 1));
}

fn check_threads(experiment: &Experiment) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("trials.parquet");
    let (expected, tallies) = bytes(experiment, TRIALS, 1, &path);
    for threads in [2, 5] {
        let (found, others) = bytes(experiment, TRIALS, threads, &path);
        assert!(found == expected, "{threads} threads");
        assert!(parts(&others) == parts(&tallies), "{threads} threads");
        for (tally, other) in tallies.iter().zip(&others) {
            let (curves, others) = (tally.curves.as_ref(), other.curves.as_ref());
            let (curves, others) = (curves.expect("curves"), others.expect("curves"));
            for last in [false, true] {
                let last_quantiles = |curves: &asobench::study::Curves| curves.quantiles(last);
                assert_eq!(last_quantiles(curves), last_quantiles(others));
            }
        }
    }
    // CI compares the files of runs with different numbers of test threads.
    if experiment.file.engine == Engine::Lanes
        && let Some(copy) = std::env::var_os("ASOBENCH_DETERMINISM_COPY")
    {
        std::fs::write(copy, &expected).expect("a writable file");
    }
    // The numbers in the file are those that any trial gives alone, in any order.
    let table = Table::read(&path);
    let outputs = experiment.outputs().len();
    let values = table.numbers::<f64>("e_a");
    assert_eq!(values.len(), 3 * outputs * TRIALS as usize);
    let trials = [TRIALS; 3];
    for (cell, trial) in [(2, 699), (0, 0), (1, 256), (1, 3)] {
        let kept = kept_after(experiment, &experiment.cells[cell], &[], trial);
        let rows: Vec<Row> = kept.iter().collect();
        assert_eq!(rows.len(), outputs);
        for row in &rows {
            let index = (cell * TRIALS as usize + trial as usize) * outputs + row.output;
            let expected = Some(row[Measure::Ea]).filter(|value| !value.is_nan());
            assert_eq!(values[index].map(f64::to_bits), expected.map(f64::to_bits));
        }
        let alike = |folder: &Path| {
            let rows = trials.iter().sum::<u64>() * outputs as u64;
            let stored = StoredTrials::open(folder, rows).expect("a table");
            let mut stored = stored.expect("the trials");
            stored.alike(experiment, cell, &trials, &kept).expect("a table")
        };
        assert_eq!(alike(folder.path()), Some(true));
        let first = (cell * TRIALS as usize + trial as usize) * outputs;
        let changed = tempfile::tempdir().expect("a folder");
        write_changed(&table, "e_b", first, &changed.path().join("trials.parquet"));
        assert_eq!(alike(changed.path()), Some(false), "a changed bit must be seen");
    }
}

/// A trial does not depend on other cells, on other trials run by the same worker, or on the run's length.
#[test]
fn a_trial_is_a_pure_function() {
    for engine in [Engine::Lanes, Engine::Faer] {
        let whole = on(engine, 9);
        let mut alone = on(engine, 9);
        alone.cells.remove(0);
        alone.cells.swap(0, 1);
        let run_one = |experiment: &Experiment, claim: &str, before: &[u64]| -> Vec<Row> {
            let mut cells = experiment.cells.iter();
            let cell = cells.find(|cell| cell.claim == claim).expect("the cell");
            rows_after(experiment, cell, before, 5)
        };
        let expected = run_one(&whole, "C3", &[]);
        for found in [run_one(&alone, "C3", &[]), run_one(&whole, "C3", &[4, 1000, 5])] {
            assert!(expected.iter().zip(&found).all(|(a, b)| a.same_bits(b)));
        }
        assert!(!expected[0].same_bits(&run_one(&on(engine, 10), "C3", &[])[0]));
    }
}

/// Common random numbers: least squares on a longer record of the same trial sees the same start.
#[test]
fn cells_share_their_random_numbers() {
    for engine in [Engine::Lanes, Engine::Faer] {
        let mut experiment = on(engine, 3);
        let template = experiment.cells[1].clone();
        let cell = |window, horizon| Cell {
            claim: "X".to_owned(),
            source: Source::Discrete(Box::new(DiscreteCell {
                eta: 5.0,
                window,
                horizon,
                ..template.discrete().expect("records").clone()
            })),
            ..template.clone()
        };
        experiment.cells = vec![cell(98, 300), cell(98, 500)];
        let rows = |index: usize| rows_after(&experiment, &experiment.cells[index], &[], 12);
        let (short, long) = (rows(0), rows(1));
        for (short, long) in short.iter().zip(&long) {
            for figure in [Measure::Ea, Measure::Eb, Measure::Eh, Measure::Ex0, Measure::Condition] {
                assert_eq!(short[figure].to_bits(), long[figure].to_bits());
            }
        }
    }
}

/// A consumer's error and a raised flag end a run.
#[test]
fn a_run_can_be_ended() {
    let experiment = Experiment::nikolov2023(1);
    let stop = AtomicBool::new(false);
    let mut seen = 0;
    let ended = run(&experiment, 100_000_000, 2, &stop, |_| {
        seen += 1;
        if seen == 3 { Err("enough") } else { Ok(()) }
    });
    assert_eq!(ended.map_err(|e| e.to_string()), Err("enough".to_owned()));
    let stop = AtomicBool::new(false);
    let ended = run(&experiment, 100_000_000, 2, &stop, |_| {
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
        Ok::<(), std::io::Error>(())
    });
    let message = ended.expect_err("interrupted").to_string();
    assert!(message.starts_with("interrupted after") && message.ends_with("of 300000000 trials"));
}

/// Whether `run` panics within a minute, rather than hang.
fn panics_in_time(run: impl FnOnce() + Send + 'static) -> bool {
    let (sender, receiver) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run));
        sender.send(ended.is_err()).expect("somebody waits");
    });
    receiver.recv_timeout(std::time::Duration::from_mins(1)) == Ok(true)
}

/// An estimator that panics takes the run down with its panic; it does not hang it.
#[test]
fn a_panicking_estimator_ends_the_run() {
    struct Panics;
    impl Estimator for Panics {
        fn estimate(&mut self, _window: Window<'_>, _passes: &mut [Pass]) {
            panic!("a mistake in an estimator");
        }
    }
    let mut experiment = Experiment::nikolov2023(1);
    let output = Output {
        estimator: "own".to_owned(),
        pass: 0,
    };
    experiment
        .methods
        .push(Method::new("panics", vec![output], |_| Ok(Box::new(Panics))));
    assert!(panics_in_time(move || {
        let stop = AtomicBool::new(false);
        let _ = run(&experiment, 5000, 2, &stop, |_| Ok::<(), std::io::Error>(()));
    }));
}

/// So does a consumer that panics.
#[test]
fn a_panicking_consumer_ends_the_run() {
    assert!(panics_in_time(|| {
        let (experiment, stop) = (Experiment::nikolov2023(1), AtomicBool::new(false));
        let _ = run(&experiment, 50_000, 2, &stop, |_| -> Result<(), std::io::Error> {
            panic!("a mistake in a consumer")
        });
    }));
}

/// An estimator that leaves a pass unset leaves nothing, not the numbers of the trial before.
#[test]
fn the_identity_of_an_own_method_is_part_of_the_design() {
    let with = |identity: &str| {
        let mut experiment = Experiment::nikolov2023(1);
        let outputs = experiment.methods[0].outputs().to_vec();
        let method = Method::new(identity, outputs, |shape| {
            let estimator = LeastSquares::new(shape, Solver::Qr)?;
            Ok(Box::new(estimator))
        });
        experiment.methods = vec![method];
        experiment
    };
    let design = |identity| with(identity).fingerprint();
    assert_eq!(design("mine 1"), design("mine 1"));
    assert_ne!(design("mine 1"), design("mine 2"));
    assert_ne!(design("mine 1"), Experiment::nikolov2023(1).fingerprint());
    let described = with("mine 1").design();
    assert_eq!(described["own_methods"], serde_json::json!(["mine 1"]));
}

/// `arx` with the plant's orders is `ls` by QR, in every measure of parameters; with more coefficients it has no
/// coordinates to compare, and is nearly the plant by its response.
#[test]
fn arx_is_measured_as_its_structure_allows() {
    let text = "[course]\nat = [500]\n[settings]\neta = 1\nwindow = 500\n[[methods]]\nestimator = \"ls\"\n\
                solver = \"qr\"\n\
                [[methods]]\nestimator = \"arx\"\n\
                orders = [{ na = 6, nb = 6, nk = 1 }, \"na=8,nb=7,nk=1\", \"na=8,nb=8,nk=0\"]";
    let file = ExperimentFile::parse(text).expect("a valid file");
    let measures = Measure::ALL
        .iter()
        .filter(|measure| measure.is_of(asobench::study::file::StudyKind::Discrete));
    let measures: Vec<Measure> = measures.copied().collect();
    let experiment = Experiment::new(ExperimentFile { measures, ..file }).expect("an experiment");
    let labels: Vec<String> = experiment.outputs().iter().map(Output::label).collect();
    let orders = ["na=6,nb=6,nk=1", "na=8,nb=7,nk=1", "na=8,nb=8,nk=0"];
    let expected = orders.map(|orders| format!("arx orders={orders}"));
    assert_eq!(labels[1..], expected);
    let mut trial = Trial::new(&experiment, &experiment.cells[0]).expect("a valid cell");
    for number in 0..20 {
        let rows = trial.run(number).expect("a trial");
        let [ls, same, more, direct] = [0, 1, 2, 3].map(|i| &rows[i]);
        assert!(rows.iter().all(|row| row.failure.is_none()));
        for measure in [
            Measure::Ea,
            Measure::Eb,
            Measure::Eh,
            Measure::Ex0,
            Measure::ExRms,
            Measure::ImpulseResponse,
        ] {
            let (ls, same) = (ls[measure], same[measure]);
            assert!((ls - same).abs() < 1e-6 * ls, "{measure}: {ls} {same}");
            let coordinates = measure != Measure::ImpulseResponse;
            assert!(more[measure].is_nan() == coordinates && direct[measure].is_nan() == coordinates);
        }
        for row in [more, direct] {
            assert!(row[Measure::ImpulseResponse] < 0.2 && row[Measure::FreshFit] > 80.0);
            assert!(row[Measure::SpectralRadius] < 1.0);
        }
    }
}

#[test]
fn nothing_is_carried_from_trial_to_trial() {
    struct OnlyEven(u64);
    impl Estimator for OnlyEven {
        fn estimate(&mut self, _window: Window<'_>, passes: &mut [Pass]) {
            if self.0.is_multiple_of(2) {
                passes[0].set_parameters(&[0.1; 12], 1.0).expect("finite");
            }
            self.0 += 1;
        }
    }
    let mut experiment = Experiment::nikolov2023(1);
    let output = Output {
        estimator: "own".to_owned(),
        pass: 0,
    };
    experiment.methods = vec![Method::new("only even", vec![output], |_| Ok(Box::new(OnlyEven(0))))];
    let mut trial = Trial::new(&experiment, &experiment.cells[1]).expect("a valid cell");
    assert!(!trial.run(0).unwrap()[0][Measure::Ea].is_nan());
    assert!(trial.run(1).unwrap()[0][Measure::Ea].is_nan());
}
