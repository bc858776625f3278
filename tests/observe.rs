//! `asobench observe`: from a record to its states in one command; and the table of several models.

use crate::common::{asobench_in, done_in, stderr, stdout};
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let record = include_str!("../examples/record.csv");
    std::fs::write(folder.path().join("record.csv"), record).expect("written");
    folder
}

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

fn json(folder: &Path, line: &str) -> Value {
    let line = format!("{line} --format json");
    serde_json::from_str(&stdout(&done_in(folder, &words(&line)))).expect("JSON")
}

/// The columns of a CSV file; an empty cell is NaN.
fn columns(path: &Path) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(path).expect("a file");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().expect("a header").split(',');
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|name| (name.to_owned(), vec![])).collect();
    for line in lines {
        for ((_, column), cell) in columns.iter_mut().zip(line.split(',')) {
            column.push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

fn numbers(of: &Value) -> Vec<f64> {
    let all = of.as_array().expect("a list").iter();
    all.map(|x| x.as_f64().expect("a number")).collect()
}

/// Twelve stages in one command: the states are those of `estimate` with the papers' method and gain.
#[test]
fn the_papers_algorithm_from_a_record_to_states() {
    let folder = folder();
    let folder = folder.path();
    done_in(folder, &words("observe record.csv --order 2 --out a.csv"));
    done_in(
        folder,
        &words("estimate record.csv --order 2 --estimator iv --states b.csv"),
    );
    let (observed, estimated) = (columns(&folder.join("a.csv")), columns(&folder.join("b.csv")));
    let names: Vec<&str> = observed.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["k", "x1", "x2", "y", "y_predicted", "innovation"]);
    assert_eq!(observed[..3], estimated[..3]);
    assert_eq!(observed[0].1.len(), 401);
    let [y, predicted, innovation] = [3, 4, 5].map(|i| &observed[i].1);
    for k in 0..400 {
        assert!((y[k] - predicted[k] - innovation[k]).abs() < 1e-9);
    }
    assert!(y[400].is_nan() && predicted[400].is_nan());
}

/// The steady state of a first-order plant by hand: P^2 = q r + ..., and states, bands and predictions that agree in
/// text, JSON, CSV and Parquet.
#[test]
fn a_kalman_filter_with_known_covariances() {
    let folder = folder();
    let folder = folder.path();
    let line = "observe record.csv --estimator arx --order 1 --observer kalman --process-covariance 4 \
                --measurement-variance 100";
    let found = json(folder, &format!("{line} --out x.csv --plot x.svg --report x.html"));
    let (model, of) = (&found["estimates"][0]["a"], &found["observer"]);
    let a = numbers(model)[0];
    // P = a^2 P + q - a^2 P^2 / (P + r): P^2 + (r (1 - a^2) - q) P - q r = 0.
    let (q, r) = (4.0, 100.0);
    let half = (r * (1.0 - a * a) - q) / 2.0;
    let p = -half + (half * half + q * r).sqrt();
    let gain = a * p / (p + r);
    let near = |found: &Value, exact: f64| {
        let found = found.as_f64().expect("a number");
        assert!((found - exact).abs() <= 1e-10 * exact.abs(), "{found} {exact}");
    };
    near(&of["gain"][0], gain);
    near(&of["poles"][0]["re"], a - gain);
    near(&of["covariance"][0][0], p);
    near(&of["innovation_variance"], p + r);
    near(&of["deviations"][7][0], p.sqrt());
    let columns = columns(&folder.join("x.csv"));
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["k", "x1", "x1_sd", "y", "y_predicted", "innovation"]);
    for (k, state) in of["states"].as_array().expect("rows").iter().enumerate() {
        assert_eq!(numbers(state)[0], columns[1].1[k]);
    }
    assert_eq!(numbers(&of["predictions"])[..], columns[4].1[..400]);
    for (file, part) in [("x.svg", "x_1"), ("x.html", "The observer")] {
        let text = std::fs::read_to_string(folder.join(file)).expect("a file");
        assert!(text.contains(part), "{file}");
    }
    // Parquet has the same columns: it is read as a record, less the last row, which has no output.
    done_in(folder, &words(&format!("{line} --out x.parquet")));
    let as_record = |file: &str| {
        let line =
            format!("estimate {file} --input innovation --output y --missing longest-run --estimator arx --order 1");
        json(folder, &line)["estimates"][0]["model"].clone()
    };
    assert_eq!(as_record("x.csv"), as_record("x.parquet"));
    // Its own files are replaced, those of others are not.
    done_in(folder, &words(&format!("{line} --out x.parquet --plot x.svg")));
    std::fs::write(folder.join("mine.parquet"), "PAR1 is mine").expect("written");
    let refused = asobench_in(folder, &words(&format!("{line} --out mine.parquet")));
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
}

#[test]
fn every_observer_runs_within_a_screen() {
    let folder = folder();
    for observer in [
        "dead-beat",
        "scaled:0.5",
        "poles:0.2,0.1",
        "kalman",
        "kalman-coloured",
        "gpebo-drem:1",
        "gpebo-squares:0.1",
        "kreisselmeier",
        "zhang",
        "joint-ekf",
    ] {
        let line = format!("observe record.csv --order 2 --detrend mean --observer {observer}");
        let text = stdout(&done_in(folder.path(), &words(&line)));
        assert!(text.lines().all(|line| line.len() <= 80), "{text}");
        assert!(text.contains(observer) && text.contains("innovations"), "{text}");
        assert!(text.lines().count() <= 30, "{text}");
    }
    let line = "observe record.csv --order 2 --observer kalman-varying --process-covariance 1,2 \
                --measurement-variance 100 --start-covariance 50";
    let found = json(folder.path(), line);
    let of = &found["observer"]["deviations"];
    let first = numbers(&of[0]);
    assert!(first.iter().all(|sd| (sd - 50.0_f64.sqrt()).abs() < 1e-12), "{first:?}");
    // From P(0) to the limit.
    let last = numbers(&of[400])[0].powi(2);
    let limit = found["observer"]["covariance"][0][0].as_f64().expect("a number");
    assert!((last / limit - 1.0).abs() < 1e-9, "{last} {limit}");
}

#[test]
fn mistakes_are_told_in_a_line() {
    let folder = folder();
    for (line, part) in [
        ("observe record.csv", "expected --order n"),
        ("observe record.csv --order 1:3", "--order: needs a single model"),
        (
            "observe record.csv --order 2 --observer kalmann",
            "unknown observer 'kalmann'; expected kalman",
        ),
        (
            "observe record.csv --order 2 --observer poles:0.1",
            "--gain: the gain has 1 poles, but the order is 2",
        ),
        (
            "observe record.csv --order 2 --observer zhang --estimator arx",
            "--estimator arx: --observer zhang estimates its own model",
        ),
        (
            "observe record.csv --order 2 --observer kalman --Q 1,2,3 --R 1",
            "--process-covariance: 3 numbers; expected 1, 2 or 4",
        ),
        (
            "observe record.csv --order 2 --observer kalman --Q 1",
            "--measurement-variance",
        ),
        (
            "observe record.csv --order 2 --observer zhang --Q 1 --R 1",
            "--process-covariance: --observer zhang takes no covariances",
        ),
        (
            "observe record.csv --order 2 --observer kalman --Q 1 --R 0",
            "variance must be positive",
        ),
        (
            "observe record.csv --order 2 --observer kalman-varying",
            "needs Q, r and the covariance P(0) of the start: --process-covariance",
        ),
        ("observe record.csv --order 2 --out x.txt", "ends in .csv or .parquet"),
        (
            "estimate record.csv --order 2 --gain kalman",
            "asobench observe RECORD.csv --order 2 --observer kalman",
        ),
        (
            "estimate record.csv --order 2 --observer kalman",
            "asobench observe RECORD.csv --order 2 --observer kalman",
        ),
        (
            "kalman record.csv",
            "asobench observe record.csv --order 2 --observer kalman",
        ),
        (
            "estimate record.csv --order 2 --input u1,u2",
            "--input u1,u2: one input; this program is for single-input single-output systems",
        ),
        (
            "estimate record.csv --order 2 --output y,k",
            "--output y,k: one output; this program is for single-input single-output systems",
        ),
    ] {
        let output = asobench_in(folder.path(), &words(line));
        let said = stderr(&output);
        assert!(said.contains(part), "{line}: {said}");
        assert_eq!(output.status.code(), Some(2), "{line}");
    }
}

/// Several models: a table, best first by FIT on validation samples; each with --details; all of it within 80 columns.
#[test]
fn several_models_are_compared_first() {
    let folder = folder();
    let folder = folder.path();
    let line = "estimate record.csv --order 2 --estimator arx,oe,armax,bj --window 70%";
    let text = stdout(&done_in(folder, &words(line)));
    assert!(text.lines().count() <= 20, "{text}");
    let is_command = |line: &str| line.contains("asobench estimate");
    assert!(text.lines().all(|line| line.len() <= 80 || is_command(line)), "{text}");
    let found = json(folder, line);
    let fit = |name: &str| {
        let mut estimates = found["estimates"].as_array().expect("a list").iter();
        let of = estimates.find(|of| of["estimator"] == name).expect("an estimator");
        let fit = &of["fit_percent"]["validation"]["simulated"];
        (fit.as_f64().expect("a number"), name.to_owned())
    };
    let mut ranked = ["arx", "oe", "armax", "bj"].map(fit);
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let rows = text.lines().skip_while(|line| !line.starts_with("method")).skip(1);
    let rows: Vec<Vec<&str>> = rows.take(4).map(words).collect();
    for (row, (fit, name)) in rows.iter().zip(&ranked) {
        assert_eq!(
            (row[0], row[2]),
            (name.as_str(), format!("{fit:.2}").as_str()),
            "{text}"
        );
    }
    let ahead = format!(
        "{}, {:.2} % ahead of {}.",
        ranked[0].1,
        ranked[0].0 - ranked[1].0,
        ranked[1].1
    );
    assert!(words(&text).join(" ").contains(&ahead), "{text}");
    assert!(!text.contains("std. error"));
    let all = stdout(&done_in(folder, &words(&format!("{line} --details"))));
    let table = text.split("hint on").next().and_then(|of| of.split("All of").next());
    assert!(all.starts_with(table.expect("a table")), "{all}");
    assert_eq!(all.matches("std. error").count(), 4);
    // Without samples for validation BIC decides.
    let text = stdout(&done_in(
        folder,
        &words("estimate record.csv --order 2 --estimator arx,oe"),
    ));
    assert!(words(&text).join(" ").contains("by BIC, since no samples"), "{text}");
}

/// The short help fits a screen, the long one has sections.
#[test]
fn short_help_on_a_screen() {
    let folder = folder();
    for command in ["estimate", "observe"] {
        let short = stdout(&done_in(folder.path(), &[command, "-h"]));
        let count = short.lines().count();
        assert!((24..=40).contains(&count), "{count} lines:\n{short}");
        assert!(short.lines().all(|line| line.len() <= 80), "{short}");
        assert!(short.contains("--window") && !short.contains("--stage10"), "{short}");
        let long = stdout(&done_in(folder.path(), &[command, "--help"]));
        for part in [
            "The record:",
            "The model:",
            "Options of the estimators:",
            "--stage10",
            "--operating-point",
        ] {
            assert!(long.contains(part), "{part}");
        }
    }
}

/// Hints of observers, followed to their ends: from placed poles to a Kalman filter, from one without noise in the
/// states to one with it, which has no further hint.
#[test]
fn hints_of_observers_end() {
    let folder = folder();
    let said = |line: &str| stdout(&done_in(folder.path(), &words(line)));
    let begin = "observe record.csv --order 2 --estimator oe";
    assert!(said(begin).contains("hint               --observer kalman weighs"));
    // The record has white noise in y alone.
    let kalman = format!("{begin} --observer kalman");
    let alone = said(&kalman);
    assert!(alone.contains("this observer is the model alone") && alone.contains("--process-covariance"));
    let stated = said(&format!("{kalman} --process-covariance 1 --measurement-variance 70"));
    assert!(!stated.contains("hint  "), "{stated}");
}

/// Models of a record in parts are compared by their FIT in all parts, and ranges of orders fit the start of each part.
#[test]
fn parts_between_gaps_are_compared() {
    let folder = folder();
    let folder = folder.path();
    let record = std::fs::read_to_string(folder.join("record.csv")).expect("a file");
    let lines = record.lines().enumerate();
    let lines = lines.map(|(i, line)| match line.rsplit_once(',') {
        Some((before, _)) if i == 150 => format!("{before},\n"),
        _ => format!("{line}\n"),
    });
    std::fs::write(folder.join("gap.csv"), lines.collect::<String>()).expect("written");
    let line = "estimate gap.csv --missing equations --order 2 --estimator oe,armax";
    let text = stdout(&done_in(folder, &words(line)));
    let rows = text
        .lines()
        .filter(|line| line.starts_with("oe ") || line.starts_with("armax "));
    // The noise has 20 % of the standard deviation of the output without it; its size is known to 4 % in 399 samples.
    let fits: Vec<f64> = rows.map(|row| words(row)[2].parse().expect("a FIT")).collect();
    let of_truth = 100.0 * (1.0 - 0.2 / 1.04_f64.sqrt());
    assert!(
        fits.len() == 2 && fits.iter().all(|fit| (fit - of_truth).abs() < 2.0),
        "{text}"
    );
    assert!(!text.contains("No model simulates"), "{text}");
}
