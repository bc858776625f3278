//! The lanes: every kernel at every width, whole packs of W98 compared with faer, and the scaling of both in N, n and
//! threads.

use asobench::lanes::Isa;
use asobench::lanes::pack::Kernel;
use asobench::plant::{Numerator, PoleFinder, nikolov2023, random_stable};
use asobench::signal::{Purpose, stream};
use asobench::study::file::ExperimentFile;
use asobench::study::{Block, Engine, Experiment, PackTrial, Plan, Trials, W98, Worker, run};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::convert::Infallible;
use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

fn widths() -> impl Iterator<Item = Isa> {
    [Isa::Avx512, Isa::Avx2, Isa::Portable]
        .into_iter()
        .filter(|isa| isa.is_here())
}

fn experiment(text: &str) -> Experiment {
    let file = ExperimentFile::parse(text).expect("a valid file");
    Experiment::new(file).expect("a valid experiment")
}

/// W98 with another window; its record has 100 samples more.
fn of_window(window: usize) -> Experiment {
    let file = W98
        .replace("window = 98", &format!("window = {window}"))
        .replace("horizon = 400", &format!("horizon = {}", window + 100));
    experiment(&file)
}

/// W98 on a random stable plant, the same in every session. Orders 5, 7 and 12 have an ill-conditioned initial state or
/// ill-conditioned equations. There single lanes are solved again, at least once a trial, so the times are those of
/// that path.
fn of_order(order: usize, window: usize) -> Experiment {
    let plant = random_stable(order, 0.7, &mut stream(1, 0, Purpose::Plant));
    let file = W98
        .replace("[settings]", "[settings]\nplant = \"random_stable\"")
        .replace("window = 98", &format!("window = {window}"))
        .replace("horizon = 400", &format!("horizon = {}", window + 100));
    experiment(&format!(
        "{file}[plants.random_stable]\na = {:?}\nb = {:?}\n",
        plant.a(),
        plant.b()
    ))
}

fn plan(experiment: &Experiment) -> Plan<'_> {
    Plan::new(experiment, &experiment.cells[0]).expect("what the lanes cover")
}

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .sample_size(30);
    group
}

fn kernels(criterion: &mut Criterion) {
    let w98 = experiment(W98);
    let with_condition = W98.replace("\"e_a\",", "\"e_a\", \"condition\",");
    let with_condition = experiment(&with_condition);
    for isa in widths() {
        let mut group = group(criterion, &format!("lanes_{isa}"));
        let mut pack = plan(&w98).first_pack(isa);
        group.throughput(Throughput::Elements(pack.lanes() as u64));
        for &kernel in Kernel::ALL {
            group.bench_function(kernel.name(), |b| b.iter(|| pack.run_kernel(kernel)));
        }
        let mut pack = plan(&with_condition).first_pack(isa);
        for kernel in [Kernel::Solve, Kernel::Estimate] {
            let name = format!("{kernel}_condition");
            group.bench_function(name, |b| b.iter(|| pack.run_kernel(kernel)));
        }
        group.finish();
    }
}

/// References for the kernel `spectral_radius`: the code of one lane on one number, and faer's eigenvalues.
fn poles(criterion: &mut Criterion) {
    let plant = nikolov2023(Numerator::StateSpace);
    let mut finder = PoleFinder::new(plant.order());
    let mut group = group(criterion, "poles");
    group.bench_function("spectral_radius", |b| {
        b.iter(|| finder.spectral_radius(black_box(plant.a()), true));
    });
    group.bench_function("eigenvalues", |b| {
        b.iter(|| finder.poles(black_box(plant.a())));
    });
    group.finish();
}

/// Times packs of trials, one after the other.
fn bench_pack(
    group: &mut BenchmarkGroup<'_, WallTime>,
    id: BenchmarkId,
    experiment: &Experiment,
    pack: &mut PackTrial,
) {
    let lanes = pack.lanes() as u64;
    let trials = Trials::new(experiment, &experiment.cells[0]);
    bench_trials(group, id, lanes, trials, |from, trials| {
        pack.run_into(from..from + lanes, trials);
    });
}

/// Times trials on faer.
fn bench_faer(group: &mut BenchmarkGroup<'_, WallTime>, id: BenchmarkId, experiment: &Experiment) {
    let mut experiment = Experiment::new(experiment.file.clone()).expect("a valid experiment");
    experiment.file.engine = Engine::Faer;
    let mut worker = Worker::new(&experiment, &experiment.cells[0]).expect("a valid cell");
    let trials = Trials::new(&experiment, &experiment.cells[0]);
    bench_trials(group, id, 1, trials, |from, trials| {
        worker.run_into(from..from + 1, trials).expect("a trial");
    });
}

fn bench_trials(
    group: &mut BenchmarkGroup<'_, WallTime>,
    id: BenchmarkId,
    at_once: u64,
    mut trials: Trials,
    mut run: impl FnMut(u64, &mut Trials),
) {
    let mut from = 0;
    group.throughput(Throughput::Elements(at_once));
    group.bench_function(id, |b| {
        b.iter(|| {
            trials.rows.clear();
            run(from, &mut trials);
            from += at_once;
            black_box(trials.rows.len())
        });
    });
}

fn packs(criterion: &mut Criterion) {
    let w98 = experiment(W98);
    let mut group = group(criterion, "w98");
    for isa in widths() {
        let mut pack = plan(&w98).pack(isa);
        let id = BenchmarkId::new("trials", isa.name());
        bench_pack(&mut group, id, &w98, &mut pack);
    }
    bench_faer(&mut group, BenchmarkId::new("trials", "faer"), &w98);
    group.finish();
}

fn scaling(criterion: &mut Criterion) {
    let of_orders = (1..=12).map(|n| (n, 98)).chain([(20, 2000)]);
    let of_orders = of_orders.map(|(n, window)| {
        let name = format!("n{n:02}_N{window}");
        ("scaling_order", name, of_order(n, window))
    });
    let of_windows = [98, 998, 9998].map(|window| {
        let name = format!("N{window:04}");
        ("scaling_window", name, of_window(window))
    });
    for (name, size, experiment) in of_windows.into_iter().chain(of_orders) {
        let mut group = group(criterion, name);
        let mut pack = plan(&experiment).pack(Isa::best());
        bench_pack(&mut group, BenchmarkId::new("lanes", &size), &experiment, &mut pack);
        bench_faer(&mut group, BenchmarkId::new("faer", &size), &experiment);
        group.finish();
    }
}

/// Times blocks of trials as a study runs them.
fn threads(criterion: &mut Criterion) {
    let mut group = group(criterion, "threads");
    group.sample_size(10);
    let stop = AtomicBool::new(false);
    for (engine, trials) in [(Engine::Lanes, 1 << 15), (Engine::Faer, 1 << 11)] {
        let mut experiment = experiment(W98);
        experiment.file.engine = engine;
        group.throughput(Throughput::Elements(trials));
        for threads in [1, 2] {
            let id = BenchmarkId::new(engine.name(), threads);
            group.bench_function(id, |b| {
                b.iter(|| {
                    let consume = |block: Block| {
                        black_box(block.tally);
                        Ok::<(), Infallible>(())
                    };
                    run(&experiment, trials, threads, &stop, consume)
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, kernels, poles, packs, scaling, threads);
criterion_main!(benches);
