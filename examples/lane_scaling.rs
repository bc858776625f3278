//! Prints how a trial's time grows with its order and its window, from criterion's medians of the last
//! `cargo bench --bench lanes -- scaling`.
//!
//! `cargo run --release --example lane_scaling`

mod criterion;

use serde_json::Value;
use std::path::Path;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Microseconds of a trial with one engine: the benchmark's median over the trials of one iteration.
fn microseconds(benchmark: &Path) -> Result<f64> {
    let missing = || format!("{}: no results of the benchmark", benchmark.display());
    let [ns, _] = criterion::median(benchmark, "new").ok_or_else(missing)?;
    let text = std::fs::read_to_string(benchmark.join("new/benchmark.json"))?;
    let about: Value = serde_json::from_str(&text)?;
    let trials = about["throughput"]["Elements"].as_f64();
    Ok(ns / 1e3 / trials.ok_or_else(missing)?)
}

fn main() -> Result<()> {
    println!("order, N      lanes us    faer us   times faster   lanes: exponent of N");
    println!("{}", "-".repeat(71));
    let orders = (1..=12).map(|n| (n, 98)).chain([(20, 2000)]);
    let orders = orders.map(|(n, window)| ("scaling_order", n, window, format!("n{n:02}_N{window}")));
    let windows = [98, 998, 9998].map(|window| ("scaling_window", 6, window, format!("N{window:04}")));
    let mut before: Option<(usize, f64)> = None;
    for (group, n, window, size) in orders.chain(windows) {
        let time = |engine| microseconds(&criterion::folder().join(group).join(engine).join(&size));
        let (lanes, faer) = (time("lanes")?, time("faer")?);
        // The growth from one window to the next for the same plant.
        let exponent = match before {
            Some((shorter, time)) if group == "scaling_window" => {
                let exponent = (lanes / time).ln() / (window as f64 / shorter as f64).ln();
                format!("{exponent:>22.2}")
            }
            _ => String::new(),
        };
        before = (group == "scaling_window").then_some((window, lanes));
        println!(
            "{n:>5}, {window:>4} {lanes:>10.2} {faer:>10.1} {:>14.1}{exponent}",
            faer / lanes
        );
    }
    Ok(())
}
