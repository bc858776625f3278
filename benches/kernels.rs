//! Every solver for least squares and for one IV pass at n = 2, 6, 12 and N = 98, 998; the information blocks by
//! recurrence and by the product of the data matrices.

use asobench::estimator::information::Information;
use asobench::estimator::solver::Solution;
use asobench::estimator::{Instruments, Shape, Solver, Stage10, Window};
use asobench::plant::random_stable;
use asobench::signal::{NoiseFilter, Purpose, RandomSigns, Sequence, stream};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;

/// The record of a random plant: u, noise-free and noisy output.
fn record(order: usize, window: usize) -> [Vec<f64>; 3] {
    let plant = random_stable(order, 0.7, &mut stream(1, 0, Purpose::Plant));
    let mut u = vec![0.0; window];
    let input = RandomSigns {
        amplitude: 1.0,
        sequence: Sequence::Independent,
    };
    input.fill(&mut stream(1, 0, Purpose::Input), &mut u);
    let (mut y0, mut states) = (vec![0.0; window], vec![0.0; window * order]);
    plant.simulate(&mut vec![1.0; order], &u, &mut y0, &mut states);
    let mut f = vec![0.0; window];
    let (mut start, mut drive) = (stream(1, 0, Purpose::NoiseStart), stream(1, 0, Purpose::NoiseDrive));
    NoiseFilter::white().fill(&mut start, &mut drive, &mut Vec::new(), &mut f);
    let y = y0.iter().zip(&f).map(|(y, f)| y + 0.1 * f).collect();
    [u, y0, y]
}

const SHAPES: [(usize, usize); 6] = [(2, 98), (6, 98), (12, 98), (2, 998), (6, 998), (12, 998)];

fn solvers(criterion: &mut Criterion) {
    for instruments in [false, true] {
        let name = if instruments { "solver_iv" } else { "solver_ls" };
        let mut group = criterion.benchmark_group(name);
        group
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(1));
        for (order, window) in SHAPES {
            let [u, y0, y] = record(order, window);
            let samples = Window::new(&u, &y, y.len());
            let shape = Shape { order, window };
            for &solver in Solver::ALL {
                if instruments && solver == Solver::Cholesky {
                    continue;
                }
                // The naive forms take milliseconds at N = 998.
                let naive = matches!(solver, Solver::Dual | Solver::Augmented);
                group.sample_size(if naive && window > 500 { 10 } else { 50 });
                let id = BenchmarkId::new(solver.name(), format!("n{order}_N{window}"));
                let mut solution = Solution::new(order);
                let mut prepared = solver.least_squares(shape).expect("a valid shape");
                if instruments {
                    let mut prepared = solver.instruments(shape, Stage10::Corrected).expect("a valid shape");
                    prepared
                        .least_squares(samples, &mut solution)
                        .expect("a regular record");
                    group.bench_function(id, |b| {
                        b.iter(|| prepared.instruments(black_box(samples), Instruments::new(&y0), &mut solution));
                    });
                } else {
                    group.bench_function(id, |b| {
                        b.iter(|| prepared.least_squares(black_box(samples), &mut solution));
                    });
                }
            }
        }
        group.finish();
    }
}

fn blocks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("information");
    group
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    for (order, window) in SHAPES {
        let [u, y0, y] = record(order, window);
        let samples = Window::new(&u, &y, y.len());
        let mut information = Information::new(order);
        let id = |name| BenchmarkId::new(name, format!("n{order}_N{window}"));
        group.bench_function(id("recurrence_ls"), |b| {
            b.iter(|| information.least_squares(black_box(samples)));
        });
        group.bench_function(id("recurrence_iv"), |b| {
            b.iter(|| information.instruments(black_box(samples), Instruments::new(&y0)));
        });
        group.bench_function(id("product"), |b| {
            b.iter(|| information.by_product(black_box(samples), Instruments::new(&y0)));
        });
    }
    group.finish();
}

criterion_group!(benches, solvers, blocks);
criterion_main!(benches);
