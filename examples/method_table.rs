//! Prints the tables of times in docs/performance.md from criterion's stored estimates (run
//! `cargo bench --bench methods` first, and `cargo bench --bench recursive` for that of a sample).
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

/// The benchmarks of a sample in `benches/recursive.rs`, and of a whole solve beside it.
const SAMPLES: [&str; 14] = [
    "rls",
    "rls-covariance",
    "recursive-iv-delayed",
    "recursive-iv-auxiliary",
    "rels",
    "recursive-sriv",
    "rpem",
    "fed-by-rls",
    "kreisselmeier",
    "zhang",
    "joint-ekf",
    "iv-again,N=98",
    "iv-again,N=998",
    "iv-again,N=5000",
];

fn samples() {
    println!("\n| \u{b5}s a sample | n = 2 | n = 4 | n = 6 |\n|---|--:|--:|--:|");
    for name in SAMPLES {
        let (name, window) = name.split_once(',').unwrap_or((name, ""));
        let times = [2, 4, 6].map(|n| {
            let size = [&format!("n={n}"), window].join(",");
            let benchmark = criterion::folder().join("recursive").join(name);
            let median = criterion::median(&benchmark.join(size.trim_end_matches(',')), "new");
            median.map_or("-".to_owned(), |[ns, _]| format!("{:.2}", ns / 1e3))
        });
        println!("| `{name}` {window} | {} |", times.join(" | "));
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
    samples();
}
