//! Criterion's stored estimates.

use serde_json::Value;
use std::path::{Path, PathBuf};

/// The folder of the estimates.
pub fn folder() -> PathBuf {
    let folder_in = |name| std::env::var_os(name).map(PathBuf::from);
    folder_in("CRITERION_HOME").unwrap_or_else(|| {
        folder_in("CARGO_TARGET_DIR")
            .unwrap_or_else(|| PathBuf::from("target"))
            .join("criterion")
    })
}

/// The median time of a benchmark in nanoseconds, and its standard error.
pub fn median(benchmark: &Path, baseline: &str) -> Option<[f64; 2]> {
    let file = benchmark.join(baseline).join("estimates.json");
    let estimates: Value = serde_json::from_str(&std::fs::read_to_string(file).ok()?).ok()?;
    let median = &estimates["median"];
    Some([median["point_estimate"].as_f64()?, median["standard_error"].as_f64()?])
}
