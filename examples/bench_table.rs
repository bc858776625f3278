//! Compares criterion's medians of the last run with those of a saved baseline.
//!
//! `cargo run --release --example bench_table BASELINE [NOISE]`: changes up to NOISE per cent count as noise, 10 by
//! default.

mod criterion;

use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Half the width of a 95 % interval in standard errors.
const Z: f64 = 1.96;

/// One benchmark in both runs.
struct Change {
    name: String,
    /// Nanoseconds, before and now.
    times: [f64; 2],
    /// Now over before, and its 95 % interval.
    ratio: [f64; 3],
}

impl Change {
    fn new(name: String, before: [f64; 2], now: [f64; 2]) -> Self {
        let ratio = now[0] / before[0];
        let error = ratio * (before[1] / before[0]).hypot(now[1] / now[0]);
        Self {
            name,
            times: [before[0], now[0]],
            ratio: [ratio, ratio - Z * error, ratio + Z * error],
        }
    }

    /// The mark of a change whose interval lies entirely beyond the noise.
    fn mark(&self, noise: f64) -> &'static str {
        let [_, low, high] = self.ratio;
        if low > 1.0 + noise {
            "SLOWER"
        } else if high < 1.0 / (1.0 + noise) {
            "faster"
        } else {
            ""
        }
    }
}

/// Finds every folder below `folder` with results of the last run.
fn benchmarks(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    if folder.join("new/estimates.json").is_file() {
        found.push(folder.to_owned());
        return Ok(());
    }
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            benchmarks(&path, found)?;
        }
    }
    Ok(())
}

fn time(ns: f64) -> String {
    match ns {
        _ if ns < 1e3 => format!("{ns:.0} ns"),
        _ if ns < 1e6 => format!("{:.1} \u{b5}s", ns / 1e3),
        _ => format!("{:.2} ms", ns / 1e6),
    }
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let baseline = arguments.next().ok_or("which baseline?")?;
    let percent: f64 = arguments.next().map_or(Ok(10.0), |noise| noise.parse())?;
    let noise = percent / 100.0;
    let home = criterion::folder();
    let mut found = Vec::new();
    benchmarks(&home, &mut found).map_err(|error| format!("{}: {error}", home.display()))?;
    let mut changes = Vec::new();
    for path in found {
        let medians = [&baseline, "new"].map(|run| criterion::median(&path, run));
        // Medians equal to the last bit: the benchmark was not run again since the baseline was saved.
        if let [Some(before), Some(now)] = medians
            && before != now
        {
            let name = path.strip_prefix(&home)?.display().to_string();
            changes.push(Change::new(name, before, now));
        }
    }
    if changes.is_empty() {
        return Err(format!("no benchmark of baseline '{baseline}' in {}", home.display()).into());
    }
    // Largest slowdown first.
    changes.sort_by(|a, b| b.ratio[0].total_cmp(&a.ratio[0]).then(a.name.cmp(&b.name)));
    println!("benchmark                           before      now  ratio [95 % interval]");
    println!("{}", "-".repeat(80));
    for change in &changes {
        let [before, now] = change.times.map(time);
        let [ratio, low, high] = change.ratio;
        let (name, mark) = (&change.name, change.mark(noise));
        let line = format!("{name:<33} {before:>8} {now:>8}  {ratio:.2} [{low:.2}, {high:.2}] {mark}");
        println!("{}", line.trim_end());
    }
    println!("{}", "-".repeat(80));
    // The changes are sorted in descending order.
    let at = |share: f64| changes[(share * (changes.len() - 1) as f64).round() as usize].ratio[0];
    let marked = |mark| {
        let all = changes.iter();
        all.filter(|change| change.mark(noise) == mark).count()
    };
    println!(
        "{} benchmarks: {} slower, {} faster\n\
         median ratio {:.2}, nine of ten in [{:.2}, {:.2}]",
        changes.len(),
        marked("SLOWER"),
        marked("faster"),
        at(0.5),
        at(0.95),
        at(0.05),
    );
    println!(
        "Ratios of medians, now over '{baseline}'; marked where the interval lies wholly beyond\n\
         {percent} % of change."
    );
    Ok(())
}
