//! `asobench estimate record.csv` without an order: a table of methods whose commands lead to the same models.

use crate::common::{asobench_in, stderr, stdout};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use tempfile::TempDir;

const SAMPLES: usize = 1000;
/// The part of the variance of y that is noise.
const NOISE: f64 = 0.04;

/// A uniform number in [-1, 1).
fn next(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// `y = (q^-3 + 0.5 q^-4)/(1 - 1.5 q^-1 + 0.7 q^-2) u + v` with v of a first-order spectrum.
fn record() -> String {
    let (mut seed, mut x, mut v) = (1, [0.0; 2], 0.0);
    let mut u = [0.0; 4];
    let mut rows = Vec::new();
    for _ in 0..SAMPLES {
        let now = next(&mut seed).signum();
        let free = 1.5 * x[0] - 0.7 * x[1] + u[2] + 0.5 * u[3];
        x = [free, x[0]];
        v = 0.8 * v + 0.6 * next(&mut seed) * 3.0_f64.sqrt();
        rows.push((now, free, v));
        u = [now, u[0], u[1], u[2]];
    }
    let power = rows.iter().map(|row| row.1 * row.1).sum::<f64>() / SAMPLES as f64;
    let scale = (NOISE / (1.0 - NOISE) * power).sqrt();
    rows.iter().fold("u,y\n".to_owned(), |mut text, (u, x, v)| {
        let _ = writeln!(text, "{u},{:.9}", x + scale * v);
        text
    })
}

/// A folder with the record.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("record.csv"), record()).unwrap();
    folder
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = asobench_in(folder, &[arguments, &["--format", "json"]].concat());
    let read = serde_json::from_slice(&output.stdout);
    read.unwrap_or_else(|error| panic!("{error}: {}", stderr(&output)))
}

#[test]
fn the_best_comes_first_and_its_command_gives_the_same_model() {
    let folder = folder();
    let folder = folder.path();
    let found = json(folder, &["estimate", "record.csv", "--delay", "1:20"]);
    assert_eq!((&found["nk"], &found["window"]), (&3.into(), &700.into()));
    let rows = found["panel"].as_array().unwrap();
    let mut names: Vec<&str> = rows.iter().map(|row| row["estimator"].as_str().unwrap()).collect();
    let fits: Vec<f64> = rows
        .iter()
        .map(|row| row["fit_percent"]["validation"]["simulated"].as_f64().unwrap())
        .collect();
    assert!(fits.is_sorted_by(|a, b| a >= b), "{fits:?}");
    // FIT of the true plant is 100 (1 - sqrt(NOISE)); of a fitted one a little less.
    let of_truth = 100.0 * (1.0 - NOISE.sqrt());
    assert!((fits[0] - of_truth).abs() < 2.0, "{fits:?}");
    for row in rows {
        let command = row["command"].as_str().unwrap();
        let words: Vec<&str> = command.split_whitespace().skip(1).collect();
        assert!(command.contains("--window 70%"), "{command}");
        let again = json(folder, &words);
        let of = &again["estimates"][0];
        assert_eq!(of["fit_percent"], row["fit_percent"], "{command}");
        assert_eq!(of["estimator"], row["estimator"]);
    }
    names.sort_unstable();
    assert_eq!(names, ["armax", "arx", "bj", "n4sid", "oe"]);
    // Methods, a delay and a window that were given are taken.
    let words = [
        "estimate",
        "record.csv",
        "--estimator=oe,bj",
        "--delay",
        "2",
        "--window",
        "500",
    ];
    let some = json(folder, &words);
    let rows = some["panel"].as_array().unwrap();
    assert_eq!(
        (rows.len(), &rows[0]["nk"], &some["window"]),
        (2, &2.into(), &500.into())
    );
    let command = rows[0]["command"].as_str().unwrap();
    let (method, n) = (rows[0]["estimator"].as_str().unwrap(), &rows[0]["n"]);
    let expected = format!("asobench estimate record.csv --window 500 --estimator {method} --order {n} --delay 2");
    assert_eq!(command, expected);
}

#[test]
fn the_table_fits_a_screen_and_pictures_need_one_model() {
    let folder = folder();
    let text = stdout(&asobench_in(
        folder.path(),
        &["estimate", "record.csv", "--delay", "1:20"],
    ));
    let wide = |line: &&str| line.len() > 80 && !line.contains("asobench estimate");
    assert_eq!(text.lines().find(wide), None);
    let plain = stdout(&asobench_in(folder.path(), &["estimate", "record.csv"]));
    assert!(plain.contains("delay 1;"), "{plain}");
    let words: Vec<&str> = text.split_whitespace().collect();
    let about = "delay 3 of 1:20 by BIC of long ARX models";
    assert!(words.join(" ").contains(about), "{text}");
    for (flag, value) in [("--plot", "output"), ("--report", "page.html"), ("--states", "x.csv")] {
        let output = asobench_in(folder.path(), &["estimate", "record.csv", flag, value]);
        let said = stderr(&output);
        assert!(
            said.contains(&format!("{flag}: needs a single model; expected --order n")),
            "{said}"
        );
        assert_eq!(output.status.code(), Some(2));
    }
}

/// Of a model without noise model predictions at every horizon are the simulation; of others they lie between one step
/// and the simulation.
#[test]
fn predictions_further_ahead() {
    let folder = folder();
    let of = |method: &str, horizon: &str| {
        let flags = ["--order", "2", "--delay", "3", "--window", "70%", "--estimator", method];
        let words = [&["estimate", "record.csv", "--horizon", horizon], &flags[..]].concat();
        let found = json(folder.path(), &words);
        found["estimates"][0]["fit_percent"]["validation"].clone()
    };
    let oe = of("oe", "5");
    assert_eq!(oe["ahead"]["steps"], 5);
    let [ahead, one] = [&oe["ahead"]["fit"], &oe["one_step"]].map(|fit| fit.as_f64().unwrap());
    assert!((ahead - one).abs() < 1e-9, "{oe}");
    assert_eq!(of("bj", "1").get("ahead"), None);
    let bj = ["2", "4", "400"].map(|horizon| of("bj", horizon)["ahead"]["fit"].as_f64().unwrap());
    let [one, free] = ["one_step", "simulated"].map(|key| of("bj", "1")[key].as_f64().unwrap());
    assert!(one > bj[0] && bj[0] > bj[1] && bj[1] > bj[2], "{one} {bj:?}");
    assert!((bj[2] - free).abs() < 0.2, "{bj:?} {free}");
}

/// A record whose validation part no model simulates is not left with a best model and no word.
#[test]
fn a_best_model_of_no_use_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut seed = 7;
    let mut before = 0.0;
    let turned = (0..400).fold("u,y\n".to_owned(), |mut text, k| {
        // After the window the gain has the other sign.
        let gain = if k < 280 { 1.0 } else { -3.0 };
        let (u, e) = (next(&mut seed).signum(), next(&mut seed));
        let _ = writeln!(text, "{u},{}", gain * before + 0.1 * e);
        before = u;
        text
    });
    std::fs::write(folder.path().join("record.csv"), turned).unwrap();
    let output = asobench_in(folder.path(), &["estimate", "record.csv"]);
    let text = stdout(&output);
    assert!(text.contains("No model simulates y there better"), "{text}");
    let right = self::folder();
    let output = asobench_in(right.path(), &["estimate", "record.csv", "--delay", "1"]);
    assert!(!stdout(&output).contains("No model simulates"));
}

/// Modes of 0.95 and of modulus 0.89, far from rest at k = 0. The order is chosen with the fitted start: at rest
/// a model of order 2 has the lowest BIC, for it spends its modes on the start.
#[test]
fn orders_are_chosen_with_the_start() {
    const F: [f64; 3] = [-2.15, 1.94, -0.76];
    const B: [f64; 3] = [0.1, 0.3, 0.1];
    let (mut seed, mut x, mut u) = (5, [-200.0; 3], [0.0; 3]);
    let late = (0..800).fold("u,y\n".to_owned(), |mut text, _| {
        let now = 3.0 + next(&mut seed).signum();
        let free: f64 = (0..3).map(|i| B[i] * u[i] - F[i] * x[i]).sum();
        let _ = writeln!(text, "{now},{:.9}", free + 0.5 * next(&mut seed));
        (x, u) = ([free, x[0], x[1]], [now, u[0], u[1]]);
        text
    });
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("record.csv"), late).unwrap();
    let found = json(folder, &["estimate", "record.csv", "--estimator", "oe,bj"]);
    for row in found["panel"].as_array().unwrap() {
        assert_eq!(row["n"], 3, "{row}");
    }
    // No order of the range has a lower BIC than the table says.
    let range = [
        "estimate",
        "record.csv",
        "--window",
        "70%",
        "--estimator",
        "oe",
        "--order",
        "1:6",
    ];
    let table = json(folder, &range);
    let all = table["table"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["bic"].as_f64().unwrap());
    let least = all.fold(f64::INFINITY, f64::min);
    let mut rows = found["panel"].as_array().unwrap().iter();
    let own = rows.find(|row| row["estimator"] == "oe").unwrap()["bic"]
        .as_f64()
        .unwrap();
    assert!((own - least).abs() < 1e-6, "{own} {least}");
}

/// A record of `y = q^-delay (1 + 0.5 q^-1)/(1 - 1.5 q^-1 + 0.7 q^-2) u + noise e`, in six digits.
fn simulated(samples: usize, delay: usize, noise: f64) -> TempDir {
    let (mut seed, mut x) = (3, [0.0; 2]);
    let mut inputs = vec![0.0; delay + 2];
    let text = (0..samples).fold("u,y\n".to_owned(), |mut text, _| {
        let free = 1.5 * x[0] - 0.7 * x[1] + inputs[delay - 1] + 0.5 * inputs[delay];
        let u = next(&mut seed);
        let _ = writeln!(text, "{u:.5e},{:.5e}", free + noise * next(&mut seed));
        x = [free, x[0]];
        inputs.insert(0, u);
        text
    });
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("record.csv"), text).unwrap();
    folder
}

/// Of models that fit to the rounding of a record without noise, the smallest is chosen: criteria of larger ones
/// compare rounding. A range of orders says so.
#[test]
fn of_exact_models_the_smallest_is_chosen() {
    let folder = simulated(300, 1, 0.0);
    let found = json(folder.path(), &["estimate", "record.csv", "--estimator", "oe,armax,bj"]);
    let rows = found["panel"].as_array().unwrap();
    let orders: Vec<&Value> = rows.iter().map(|row| &row["n"]).collect();
    assert_eq!(orders, [2, 2, 2]);
    let range = ["estimate", "record.csv", "--estimator", "oe", "--order", "1:6"];
    assert_eq!(json(folder.path(), &range)["fits_to_rounding"]["n"], 2);
    let text = stdout(&asobench_in(folder.path(), &range));
    assert!(text.contains("n = 2, nk = 1: the fewest parameters"), "{text}");
}

/// Without `--delay` a larger one is told where the record favours it, and the printed flag leads to it.
#[test]
fn a_larger_delay_is_told() {
    let folder = simulated(400, 7, 1.0);
    let folder = folder.path();
    let text = stdout(&asobench_in(folder, &["estimate", "record.csv", "--estimator", "oe"]));
    assert!(text.contains("with a delay of 7 than of 1"), "{text}");
    let flag = text.lines().find_map(|line| line.split_once("--delay ")).unwrap().1;
    let found = json(
        folder,
        &["estimate", "record.csv", "--estimator", "oe", "--delay", flag.trim()],
    );
    assert_eq!((&found["nk"], &found["panel"][0]["n"]), (&7.into(), &2.into()));
    assert_eq!(found["later_delay"], Value::Null);
    let right = simulated(400, 1, 1.0);
    let found = json(right.path(), &["estimate", "record.csv", "--estimator", "oe"]);
    assert_eq!(found["later_delay"], Value::Null);
}

/// A record that is too short for a method is not too short for the table.
#[test]
fn a_short_record_leaves_methods_out() {
    let folder = simulated(10, 1, 0.1);
    let folder = folder.path();
    let found = json(folder, &["estimate", "record.csv"]);
    assert_eq!(found["without_model"], serde_json::json!(["n4sid"]));
    let text = stdout(&asobench_in(folder, &["estimate", "record.csv"]));
    let line = "No model at any order: n4sid (a window of 7 samples with 2 block rows is";
    assert!(text.contains(line), "{text}");
    let alone = asobench_in(folder, &["estimate", "record.csv", "--estimator", "n4sid"]);
    let said = stderr(&alone);
    assert_eq!((alone.status.code(), said.lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains("too short for order 1"), "{said}");
}

/// A range of orders fits each model as the model alone is fitted, noise polynomials included, and the table's command
/// has the delay of its model, 0 too.
#[test]
fn ranges_and_commands_have_the_same_models() {
    let folder = simulated(400, 1, 1.0);
    let folder = folder.path();
    let of = |estimator: &str, order: &str| {
        let line = ["estimate", "record.csv", "--estimator", estimator, "--order", order];
        json(folder, &line)
    };
    for estimator in ["armax", "oe", "bj", "pem"] {
        let range = of(estimator, "1:2");
        let alone = of(estimator, "2");
        let loss = alone["estimates"][0]["loss"].as_f64();
        let loss = loss.unwrap_or_else(|| panic!("{estimator}: {alone}"));
        let row = &range["table"][1];
        assert!(
            (row["V"].as_f64().unwrap() / loss - 1.0).abs() < 1e-9,
            "{estimator}: {row}, {loss}"
        );
    }
    let found = json(
        folder,
        &["estimate", "record.csv", "--estimator", "oe,armax", "--delay", "0"],
    );
    for row in found["panel"].as_array().unwrap() {
        assert!(row["command"].as_str().unwrap().ends_with(" --delay 0"), "{row}");
    }
}
