//! Prints the table of times in docs/performance.md from criterion's stored estimates (run
//! `cargo bench --bench methods` first).
//!
//! `cargo run --release --example method_table`

mod criterion;

use asobench::estimator::EstimatorName;

/// Formats criterion's median; "-" if it was not run.
fn time(estimator: EstimatorName, size: &str) -> String {
    let benchmark = criterion::folder().join("methods").join(estimator.name());
    match criterion::median(&benchmark.join(size), "new") {
        None => "-".to_owned(),
        Some([ns, _]) if ns < 1e4 => format!("{:.1}", ns / 1e3),
        Some([ns, _]) => format!("{:.0}", ns / 1e3),
    }
}

fn main() {
    let mut sizes = Vec::new();
    for n in [2, 4, 6] {
        for window in [98, 998, 5000] {
            sizes.push(format!("n={n},N={window}"));
        }
    }
    sizes.push("W98".to_owned());
    println!("| \u{b5}s | {} |", sizes.join(" | "));
    println!("|---|{}", "--:|".repeat(sizes.len()));
    for estimator in EstimatorName::ALL {
        if *estimator != EstimatorName::Known {
            let times: Vec<String> = sizes.iter().map(|size| time(*estimator, size)).collect();
            println!("| `{estimator}` | {} |", times.join(" | "));
        }
    }
}
