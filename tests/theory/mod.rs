//! The shipped experiment files against theory: limits, asymptotic covariances, rates, printed figures; and their quick
//! variants against themselves. `cargo test --release --test it theory:: -- --nocapture` prints the table.
//!
//! Trials are few and windows long, so that terms of order 1/N stay below the Monte-Carlo standard error; where they do
//! not, `2 X(2N) - X(N)` trial by trial takes them out. eta is exact in each window, not of the processes: where an
//! estimate is consistent this moves no limit and changes covariances by O(1/N) relatively; elsewhere by O(1/N) too.

mod asymptotic;
mod cells;
mod consistent;
mod limit;
mod population;
mod printed;
mod settings;
mod study;

use asobench::study::file::ExperimentFile;
use asobench::study::{Experiment, OutputRows, Trials, Worker};
use consistent::{colours, convergence, errata, noise_levels, orders, the_papers_experiment, windows};
use printed::{printed_medians, printed_shares};
use settings::{bias_in_a_loop, closed_loops, initial_states, input_noises, observers, solvers};
use study::Check;

#[test]
fn the_shipped_experiments_agree_with_theory() {
    let parts: [fn() -> Vec<Check>; 15] = [
        the_papers_experiment,
        printed_shares,
        printed_medians,
        noise_levels,
        windows,
        colours,
        convergence,
        solvers,
        initial_states,
        closed_loops,
        bias_in_a_loop,
        observers,
        orders,
        errata,
        input_noises,
    ];
    println!(
        "{:<14} {:<62} {:>6} {:>9} +- {:<8} {:>11} {:>6}",
        "experiment", "figure", "trials", "found", "SE", "theory", "in SE"
    );
    let mut wrong = Vec::new();
    for part in parts {
        for check in part() {
            println!("{}", check.text());
            if !check.holds() {
                wrong.push(check.text());
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// Every cell of the quick variant is a cell of the full study, and its trials are the first ones of it, bit for bit.
#[test]
fn quick_trials_are_the_first_trials_of_the_full_study() {
    let mut files = 0;
    for entry in std::fs::read_dir(study::path("x").parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        files += 1;
        let file = ExperimentFile::read(&path).unwrap();
        assert!(file.quick.is_some(), "{}", path.display());
        let quick = Experiment::new(file.clone().quick()).unwrap();
        let full = Experiment::new(file).unwrap();
        assert_eq!(full.outputs(), quick.outputs());
        for cell in &quick.cells {
            let same = full.cells.iter().find(|other| other.settings == cell.settings);
            let same = same.unwrap_or_else(|| panic!("{}: {:?}", path.display(), cell.settings));
            let trials = |experiment, cell| {
                let mut trials = Trials::of_all_measures(experiment, cell);
                let mut worker = Worker::new(experiment, cell).unwrap();
                worker.run_into(0..3, &mut trials).unwrap();
                trials
            };
            let (short, long) = (trials(&quick, cell), trials(&full, same));
            assert_eq!(short.rows.len(), long.rows.len());
            let equal = short.rows.iter().zip(long.rows.iter()).all(|(a, b)| a.same_bits(&b));
            let bits = |trials: &Trials| {
                let columns = trials.rows.outputs().iter().flat_map(OutputRows::parameters);
                let bits = columns.flatten().map(|x| x.to_bits());
                bits.collect::<Vec<u64>>()
            };
            assert!(
                equal && bits(&short) == bits(&long),
                "{}: {:?}",
                path.display(),
                cell.settings
            );
        }
    }
    assert_eq!(files, 45);
}
