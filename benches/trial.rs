//! One whole trial of the paper's experiment: record, least squares, four IV passes, observers, errors.

use asobench::data::Realisation;
use asobench::study::{Experiment, Trial, Trials};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

fn trial(criterion: &mut Criterion) {
    let experiment = Experiment::nikolov2023(1);
    let mut group = criterion.benchmark_group("trial");
    group.throughput(Throughput::Elements(1));
    for cell in &experiment.cells[1..] {
        let mut trial = Trial::new(&experiment, cell).expect("a valid cell");
        let mut trials = Trials::new(&experiment, cell);
        let mut index = 0;
        let of = cell.discrete().expect("records");
        group.bench_function(BenchmarkId::new("whole", of.window), |b| {
            b.iter(|| {
                index += 1;
                trials.rows.clear();
                trial.run_into(index, &mut trials).expect("a trial");
                black_box(trials.rows.len())
            });
        });
        let (mut record, mut index) = (Realisation::default(), 0);
        group.bench_function(BenchmarkId::new("record", of.window), |b| {
            b.iter(|| {
                index += 1;
                of.realise(1, index, &mut record);
            });
        });
    }
    group.finish();
}

criterion_group!(benches, trial);
criterion_main!(benches);
