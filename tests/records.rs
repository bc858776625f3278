//! Records as people have them: what `asobench estimate` prints of each.
//!
//! The plant is of second order: natural frequency 10 rad/s, damping 0.2, sampled every 0.05 s.

use crate::common::table::Table;
use polars_arrow::array::{PrimitiveArray, Utf8ViewArray};
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

const PROGRAM: &str = env!("CARGO_BIN_EXE_asobench");
const STEP: f64 = 0.05;
const SAMPLES: usize = 60;

/// `z^2 + a_1 z + a_2` with the roots `exp(s T)`, `s = -2 + 10 sqrt(0.96) i`.
fn denominator() -> [f64; 2] {
    let (decay, turn) = (-2.0 * STEP, 10.0 * f64::sqrt(0.96) * STEP);
    [-2.0 * decay.exp() * turn.cos(), (2.0 * decay).exp()]
}

/// u and y with six decimals, which is all their noise.
fn samples() -> Vec<[String; 2]> {
    let [a_1, a_2] = denominator();
    let mut seed = 1_u64;
    let (mut u, mut y) = ([0.0; 2], [0.0; 2]);
    let rows = (0..SAMPLES).map(|_| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let now = ((seed >> 40) as f64 / 1e6).sin();
        let next = -a_1 * y[0] - a_2 * y[1] + 0.5 * u[0] + 0.25 * u[1];
        (u, y) = ([now, u[0]], [next, y[0]]);
        [format!("{now:.6}"), format!("{next:.6}")]
    });
    rows.collect()
}

/// A table with a header, of rows made from the number of a sample, u and y.
fn table(header: &str, row: impl Fn(usize, &str, &str) -> String) -> String {
    let samples = samples();
    let rows = samples.iter().enumerate().map(|(k, [u, y])| row(k, u, y) + "\n");
    format!("{header}{}", rows.collect::<String>())
}

/// A table with times that pass `step(k)` seconds before sample k.
fn timed(step: impl Fn(usize) -> f64) -> String {
    let mut t = 0.0;
    let times = (0..SAMPLES).map(|k| {
        if k > 0 {
            t += step(k);
        }
        format!("{t:.4}")
    });
    let times: Vec<String> = times.collect();
    table("t,u,y\n", |k, u, y| format!("{},{u},{y}", times[k]))
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

fn comma(number: &str) -> String {
    number.replace('.', ",")
}

fn run(command: &str, text: &[u8], flags: &[&str]) -> Output {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("my.csv"), text).expect("a file");
    std::fs::write(
        folder.path().join("other.csv"),
        table("u,y\n", |_, u, y| format!("{u},{y}")),
    )
    .expect("a file");
    let mut program = Command::new(PROGRAM);
    program
        .current_dir(folder.path())
        .args([command, "my.csv", "--estimator", "arx"]);
    program.args(flags).output().expect("the program")
}

/// The output on a record: errors and warnings, the head, the equation, and the lines on its time.
fn printed(text: &[u8], flags: &[&str]) -> String {
    let mut all = vec!["--order", "2"];
    all.extend(flags);
    let output = run("estimate", text, &all);
    let mut shown = format!("$ asobench estimate my.csv {}\n", flags.join(" "));
    shown += &stderr(&output);
    let out = String::from_utf8(output.stdout).expect("UTF-8");
    let head = out.lines().take_while(|line| !line.is_empty());
    let of_model = out.lines().filter(|line| {
        ["y(k) =", "  frequencies", " damping "]
            .iter()
            .any(|part| line.contains(part))
    });
    for line in head.chain(of_model) {
        let _ = writeln!(shown, "{line}");
    }
    let _ = writeln!(shown, "exit code {}", output.status.code().unwrap_or(-1));
    shown
}

/// Fourteen records, refused or taken; each that is taken has the plant's equation.
#[test]
fn fourteen_records() {
    let plain = table("u,y\n", |_, u, y| format!("{u},{y}"));
    let columns = |header: &str| table(header, |k, u, y| format!("{},{u},{y},{}", k + 7, 20 + k % 3));
    let european = table("\u{feff}sep=;\r\nZeit [s];Ventil;Druck\r\n", |k, u, y| {
        format!(
            "{};{};{}\r",
            comma(&format!("{:.2}", k as f64 * STEP)),
            comma(u),
            comma(y)
        )
    });
    let gaps = |k: usize, y: &str| {
        if k == 9 || k == 45 { String::new() } else { y.to_owned() }
    };
    let gaps = table("u;y\n", |k, u, y| format!("{u};{}", gaps(k, y)));
    let lost = table("t,u,y\n", |k, u, y| {
        let t = STEP * (k + usize::from(k >= 20)) as f64;
        format!("{t:.2},{u},{y}")
    });
    let constant = table("u,y\n", |_, _, y| format!("1,{y}"));
    let bare = table("", |_, u, y| format!("  {u}   {y}"));
    let records: [(&str, String, &[&str]); 14] = [
        (
            "semicolons, decimal commas, byte order mark, names",
            european,
            &["--input", "Ventil", "--output", "Druck", "--time", "1"],
        ),
        ("tabs", table("U\tY\n", |_, u, y| format!("{u}\t{y}")), &[]),
        ("blanks, no header", bare.clone(), &[]),
        ("blanks, no header, by number", bare, &["--input", "1", "--output", "2"]),
        (
            "commas for everything",
            table("u,y\n", |_, u, y| format!("{},{}", comma(u), comma(y))),
            &[],
        ),
        ("further columns", columns("n,in,out,temp\n"), &[]),
        (
            "further columns, chosen",
            columns("n,in,out,temp\n"),
            &["--input", "in", "--output", "3"],
        ),
        ("a time column in seconds", timed(|_| STEP), &["--skip", "5", "--hz"]),
        ("one longer step", timed(|k| if k == 30 { 0.075 } else { STEP }), &[]),
        ("jitter", timed(|k| STEP * (1.0 + 0.12 * (k as f64).sin())), &[]),
        (
            "a step that changes halfway",
            timed(|k| if k < 30 { STEP } else { 0.1 }),
            &[],
        ),
        ("missing samples", gaps.clone(), &[]),
        (
            "missing samples, the longest run",
            gaps,
            &["--missing", "longest-run", "--ts", "0.05"],
        ),
        ("constant input", constant, &[]),
    ];
    let mut shown = String::new();
    for (name, text, flags) in &records {
        let _ = writeln!(shown, "# {name}\n{}", printed(text.as_bytes(), flags));
    }
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!("records", shown);
    });
    // One sample that was lost, not one that is missing.
    let lost_sample = printed(lost.as_bytes(), &[]);
    assert!(
        lost_sample.contains("line 22, column t: a step of 0.1"),
        "{lost_sample}"
    );
    let kept = printed(lost.as_bytes(), &["--missing", "longest-run"]);
    assert!(kept.contains("40 of 60 rows, lines 22 to 61"), "{kept}");
    assert!(printed(plain.as_bytes(), &[]).contains("window 60 of 60"));
}

fn json(text: &str, flags: &[&str]) -> serde_json::Value {
    let order: &[&str] = if flags.contains(&"--order") {
        &[]
    } else {
        &["--order", "2"]
    };
    let flags = [flags, order, &["--format", "json"]].concat();
    let output = run("estimate", text.as_bytes(), &flags);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Natural frequency, damping and time constant are the plant's, by `--ts` and by a column in milliseconds.
#[test]
fn poles_in_seconds() {
    let milliseconds = table("t [ms],u,y\n", |k, u, y| format!("{},{u},{y}", 50 * k));
    let plain = table("u,y\n", |_, u, y| format!("{u},{y}"));
    for (text, flags) in [(&milliseconds, &[][..]), (&plain, &["--ts", "0.05"])] {
        let report = json(text, flags);
        assert_eq!(report["sampling_time"], 0.05);
        let modes = report["estimates"][0]["modes"].as_array().expect("modes");
        let [mode] = modes.as_slice() else { panic!("{modes:?}") };
        // Rounding to six decimals makes the error.
        for (key, truth) in [("frequency", 10.0), ("damping", 0.2), ("time_constant", 0.5)] {
            let found = mode[key].as_f64().expect("a number");
            assert!((found / truth - 1.0).abs() < 1e-4, "{key}: {found}");
        }
    }
    assert!(json(&plain, &[])["estimates"][0]["modes"].is_null());
    for (flags, parts) in [
        (
            &["--hz"][..],
            "--hz: the time between samples is not known; expected --ts SECONDS",
        ),
        (&["--ts", "-1"], "expected a number of seconds above 0"),
        (&["--skip", "60"], "--skip: 60 leaves none of the 60 samples of my.csv"),
    ] {
        let all = [flags, &["--order", "2"]].concat();
        let output = run("estimate", plain.as_bytes(), &all);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(parts), "{}", stderr(&output));
    }
    let all = ["--order", "2", "--ts", "0.1"];
    let output = run("estimate", milliseconds.as_bytes(), &all);
    assert!(stderr(&output).contains("--ts 0.1: the column of times has steps of 0.05"));
}

/// A record is described as well by its own model as a second one of the same plant, from its own initial state, and
/// a shift of both columns is taken out by the same means.
#[test]
fn validation_on_a_second_record() {
    let plain = table("u,y\n", |_, u, y| format!("{u},{y}"));
    let late = plain.lines().skip(20).collect::<Vec<_>>().join("\n");
    let late = format!("u,y\n{late}\n");
    let report = json(&late, &["--validate", "other.csv"]);
    assert_eq!(report["validation"], "other.csv");
    for kind in ["simulated", "one_step"] {
        let fit = report["estimates"][0]["fit_percent"]["validation"][kind]
            .as_f64()
            .expect("a number");
        assert!(fit > 99.99 && fit <= 100.0, "{kind} {fit}");
    }
    let all = ["--order", "2", "--detrend", "linear", "--validate", "other.csv"];
    let output = run("estimate", plain.as_bytes(), &all);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--validate: the straight line of one record is not that of another"));
}

/// Parts of one record are several records of its plant; flags of one record are refused beside them.
#[test]
fn several_records() {
    let plain = table("u,y\n", |_, u, y| format!("{u},{y}"));
    let late = plain.lines().skip(20).collect::<Vec<_>>().join("\n");
    let late = format!("u,y\n{late}\n");
    let report = json(&late, &["other.csv"]);
    let parts = report["records"].as_array().expect("records");
    let samples: Vec<_> = parts.iter().map(|part| &part["samples"]).collect();
    assert_eq!(samples, [41, 60]);
    let estimate = &report["estimates"][0];
    for part in estimate["records"].as_array().expect("records") {
        let fit = part["fit_percent"]["simulated"].as_f64();
        assert!(fit.is_some_and(|fit| fit > 99.99), "{part}");
    }
    let [one, other] = denominator();
    for (found, truth) in [(1, one), (2, other)] {
        let found = estimate["model"]["A"][found].as_f64().expect("a number");
        assert!((found - truth).abs() < 1e-4, "{found} {truth}");
    }
    for (flags, part) in [
        (&["--validate", "other.csv"][..], "--validate: is for one record"),
        (&["--window", "20"], "--window: is for one record"),
        (&["--order", "2", "--report", "a.html"], "--report: is for one record"),
    ] {
        let order: &[&str] = if flags.contains(&"--order") {
            &[]
        } else {
            &["--order", "2"]
        };
        let output = run("estimate", plain.as_bytes(), &[&["other.csv"], flags, order].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    }
}

/// A range of orders compares models over the same equations of each record: that of order 1 by its normal equations.
#[test]
fn orders_of_several_records() {
    let plain = table("u,y\n", |_, u, y| format!("{u},{y}"));
    let rows: Vec<[f64; 2]> = plain
        .lines()
        .skip(1)
        .map(|line| {
            let (u, y) = line.split_once(',').expect("two cells");
            [u, y].map(|cell| cell.parse().expect("a number"))
        })
        .collect();
    let late = plain.lines().skip(20).collect::<Vec<_>>().join("\n");
    let scan = json(&format!("u,y\n{late}\n"), &["other.csv", "--order", "1:3"]);
    // The first 20 lines are the header and 19 samples.
    let records = [&rows[19..], &rows[..]];
    let equations: Vec<[f64; 3]> = records
        .iter()
        .flat_map(|record| (3..record.len()).map(|k| [-record[k - 1][1], record[k - 1][0], record[k][1]]))
        .collect();
    assert_eq!(scan["rows"], equations.len());
    let sum = |i: usize, j: usize| equations.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let determinant = sum(0, 0) * sum(1, 1) - sum(0, 1).powi(2);
    let a = (sum(0, 2) * sum(1, 1) - sum(0, 1) * sum(1, 2)) / determinant;
    let b = (sum(0, 0) * sum(1, 2) - sum(0, 1) * sum(0, 2)) / determinant;
    let errors = equations.iter().map(|row| row[2] - a * row[0] - b * row[1]);
    let loss = errors.map(|e| e * e).sum::<f64>() / equations.len() as f64;
    let found = scan["table"][0]["V"].as_f64().expect("a loss");
    assert!((found / loss - 1.0).abs() < 1e-9, "{found} {loss}");
    let fit = scan["table"][1]["fit_percent"]["window"].as_f64();
    assert!(fit.is_some_and(|fit| fit > 99.99), "{scan}");
    let models = json(
        &format!("u,y\n{late}\n"),
        &["other.csv", "--order", "1:3", "--estimator", "oe"],
    );
    assert_eq!(models["tables"][1]["best"]["bic"]["n"], 2, "{models}");
}

/// A gap costs the equations that touch it: the parts on either side are records of their own.
#[test]
fn equations_that_touch_a_gap() {
    let noisy = |k: usize, u: &str, y: &str| {
        let y: f64 = y.parse().expect("a number");
        format!("{u},{}", y + 0.01 * (7.3 * k as f64).sin())
    };
    let missing = |k: usize, u: &str, y: &str| match k {
        20 => format!("{u},"),
        21 => format!("{u},#N/A"),
        _ => noisy(k, u, y),
    };
    let whole = table("u,y\n", noisy);
    let part = |from: usize, to: usize| {
        let rows: Vec<&str> = whole.lines().skip(1 + from).take(to - from).collect();
        format!("u,y\n{}\n", rows.join("\n"))
    };
    let rows = whole.lines().count() - 1;
    let folder = tempfile::tempdir().expect("a folder");
    let files = [
        ("gap.csv", table("u,y\n", missing)),
        ("a.csv", part(0, 20)),
        ("b.csv", part(22, rows)),
    ];
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let estimate = |arguments: &[&str]| {
        let mut program = Command::new(PROGRAM);
        program.current_dir(folder.path()).arg("estimate").args(arguments);
        program.output().expect("the program")
    };
    let json = ["--order", "2", "--estimator", "arx,oe", "--format", "json"];
    let gap = ["gap.csv", "--missing", "equations"];
    let report = |arguments: &[&str]| {
        let output = estimate(&[arguments, &json].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON")
    };
    let [gapped, apart] = [report(&gap), report(&["a.csv", "b.csv"])];
    let lines: Vec<_> = gapped["records"]
        .as_array()
        .expect("records")
        .iter()
        .map(|part| &part["lines"])
        .collect();
    assert_eq!(lines, [&serde_json::json!([2, 21]), &serde_json::json!([24, rows + 1])]);
    for of in 0..2 {
        let both = [&gapped, &apart].map(|report| &report["estimates"][of]["model"]);
        assert_eq!(both[0], both[1]);
    }
    for (arguments, expected) in [
        (&["gap.csv"][..], "--missing equations leaves out the equations"),
        (
            &["gap.csv", "--missing", "equations", "--estimator", "n4sid"],
            "one record",
        ),
        (
            &["gap.csv", "--missing", "equations", "--detrend", "linear"],
            "--detrend linear",
        ),
        (
            &["a.csv", "--missing", "equations", "--validate", "gap.csv"],
            "2 parts between gaps, but --validate needs one",
        ),
    ] {
        let output = estimate(&[arguments, &["--order", "2"]].concat());
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(expected), "{said}");
    }
}

/// A column of times that is not used shows that samples are missing.
#[test]
fn gaps_of_times_that_are_not_used_are_said() {
    let table = |late: f64| {
        let row = |k: usize, u: &str, y: &str| {
            let t = 0.01 * k as f64 + if k < 30 { 0.0 } else { late };
            format!("{t:.2};{u};{y}")
        };
        table("Zeit_s;Spannung;Drehzahl\n", row)
    };
    let flags = ["--input", "Spannung", "--output", "Drehzahl", "--order", "2"];
    let said = |late: f64| stderr(&run("estimate", table(late).as_bytes(), &flags));
    let gap = said(0.03);
    assert!(
        gap.contains("column Zeit_s, which is not used, has a step that is longer than the others before line 32"),
        "{gap}"
    );
    assert!(said(0.0).contains("column Zeit_s has equal steps"));
    let time = run(
        "estimate",
        table(0.03).as_bytes(),
        &[&flags[..], &["--time", "Zeit_s"]].concat(),
    );
    assert!(stderr(&time).contains("line 32, column Zeit_s"), "{}", stderr(&time));
}

/// `--initial` is one flag for both keys, and the old name of one of them is understood.
#[test]
fn one_name_for_the_start() {
    let plain = table("u,y\n", |_, u, y| format!("{u},{y}"));
    let options = |flags: &[&str]| {
        let report = json(&plain, flags);
        let estimates = report["estimates"].as_array().expect("estimates").clone();
        let options = |i: usize, key: &str| estimates[i]["options"][key].clone();
        [options(0, "initial_state"), options(1, "initial")]
    };
    for (flags, expected) in [
        (&["--estimator", "oe"][..], ["estimate", "zero"]),
        (&["--estimator", "oe", "--initial", "zero"], ["zero", "zero"]),
        (
            &["--estimator", "oe", "--initial", "estimate"],
            ["estimate", "estimate"],
        ),
        (
            &["--estimator", "oe", "--initial-state", "estimate"],
            ["estimate", "estimate"],
        ),
    ] {
        assert_eq!(options(flags), expected.map(serde_json::Value::from), "{flags:?}");
    }
}

/// `study-from` reads the same tables, and its trials have the columns that were chosen.
#[test]
fn a_study_from_a_european_table() {
    let text = table("Zeit (s);Ventil;Druck\n", |k, u, y| {
        // Noise of a size that its methods can estimate.
        let y = y.parse::<f64>().expect("a number") + 1e-2 * ((k * k % 17) as f64 - 8.0);
        format!(
            "{};{};{}",
            comma(&format!("{:.2}", k as f64 * STEP)),
            comma(u),
            comma(&format!("{y:.6}"))
        )
    });
    let flags = [
        "--order",
        "2",
        "--input",
        "2",
        "--output",
        "Druck",
        "--open-loop",
        "--out",
        "mine.toml",
    ];
    let output = run("study-from", text.as_bytes(), &flags);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(
        stderr(&output)
            .starts_with("my.csv: separated by semicolons, decimal commas, u is column 'Ventil', y is column 'Druck'")
    );
}

/// A unit in brackets may be left off, and capitals are one with small letters, where one column is meant.
#[test]
fn a_column_without_its_unit() {
    let european = |header: &str| {
        table(header, |k, u, y| {
            let t = comma(&format!("{:.2}", k as f64 * STEP));
            format!("{t};{};{}", comma(u), comma(y))
        })
    };
    let flags = ["--input", "Heizung", "--output", "temperatur", "--time", "Zeit"];
    let shown = printed(
        european("\u{feff}Zeit [s];Heizung [V];Temperatur (\u{b0}C)\n").as_bytes(),
        &flags,
    );
    assert!(
        shown.contains(
            "decimal commas, a byte order mark, u is column 'Heizung [V]', y is column 'Temperatur (\u{b0}C)', t is \
             column 'Zeit [s]'"
        ),
        "{shown}"
    );
    assert!(shown.contains("exit code 0"), "{shown}");
    let two = printed(european("Zeit [s];Heizung [V];Heizung [A]\n").as_bytes(), &flags);
    let line = "line 1: several columns are named 'Heizung'; expected a column's number, from 1";
    assert!(two.contains(line), "{two}");
    // A name that is there whole goes before others without their units.
    let whole = printed(
        european("Zeit [s];Heizung;Heizung [A]\n").as_bytes(),
        &["--input", "Heizung", "--output", "3", "--time", "1"],
    );
    assert!(whole.contains("u is column 'Heizung'"), "{whole}");
}

/// A record about u = 40 and y = 60 that begins far from there: its means are not the offset. Hints name points
/// ever nearer to the plant's line `y = 60 + (u - 40)`, until none is given; 40 and 60 give the model of the
/// deviations.
#[test]
fn a_record_about_an_operating_point() {
    let mut seed = 7_u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (mut x, mut rows) = (-10.0, Vec::new());
    for _ in 0..400 {
        let u = draw().signum();
        rows.push([u, x + 0.1 * draw()]);
        x = 0.95 * x + 0.05 * u;
    }
    let text = |of: [f64; 2]| {
        let rows = rows.iter().map(|[u, y]| format!("{},{:.6}\n", of[0] + u, of[1] + y));
        format!("u,y\n{}", rows.collect::<String>())
    };
    let folder = tempfile::tempdir().expect("a folder");
    let oe = |text: &str, flags: &[&str]| {
        std::fs::write(folder.path().join("my.csv"), text).expect("a file");
        let mut program = Command::new(PROGRAM);
        program.current_dir(folder.path());
        program.args([
            "estimate",
            "my.csv",
            "--order",
            "1",
            "--estimator",
            "oe",
            "--initial",
            "estimate",
        ]);
        let output = program.args(flags).output().expect("the program");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let found = |text: &str, flags: &[&str]| {
        let json = oe(text, &[flags, &["--format", "json"]].concat());
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let model = &json["estimates"][0]["model"];
        let numbers = [&model["B"][1], &model["F"][1]].map(|of| of.as_f64().expect("a number"));
        (numbers, json["subtracted"].clone())
    };
    let moved = text([40.0, 60.0]);
    let (about, subtracted) = found(&moved, &["--operating-point", "40,60"]);
    let (plain, nothing) = found(&text([0.0, 0.0]), &[]);
    for (one, other) in about.iter().zip(plain) {
        assert!((one - other).abs() < 1e-6 && other.abs() > 1e-3, "{one} {other}");
    }
    assert_eq!(subtracted["y"], serde_json::json!([60.0, 0.0]));
    assert!(nothing.is_null());
    let words = |flags: &[&str]| {
        let text = oe(&moved, flags);
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    // The means are no equilibrium. With what the hint advises the model is that about the equilibrium, and no hint is
    // left.
    let means = ["--detrend", "mean"];
    assert!(words(&means).contains("--offset estimate the noise variance is"));
    let fitted = [&means[..], &["--offset", "estimate"]].concat();
    assert!(!words(&fitted).contains("the record begins"));
    let (fitted, _) = found(&moved, &fitted);
    for (one, other) in fitted.iter().zip(plain) {
        assert!((one - other).abs() < 0.02 * other.abs(), "{one} {other}");
    }
    for wrong in ["40", "40,x", "1,2,3"] {
        let output = run(
            "estimate",
            moved.as_bytes(),
            &["--order", "1", "--operating-point", wrong],
        );
        assert!(stderr(&output).contains("expected two numbers, of u and of y"));
    }
}

/// One record as MATLAB's `writetable`, `writematrix` and `save -ascii`, and Octave's `save -text`, write it.
#[test]
fn exports_of_matlab() {
    let double = |text: &str| text.parse::<f64>().expect("a number");
    let short = |text: &str| {
        let number = format!("{:.7e}", double(text));
        let (digits, power) = number.split_once('e').expect("a power");
        let power: i32 = power.parse().expect("a power");
        let sign = if power < 0 { '-' } else { '+' };
        format!("{digits:>13}e{sign}{:02}", power.abs())
    };
    let by_number = ["--input", "1", "--output", "2"];
    let octave = "# Created by Octave 8.4.0, Tue Nov 24 15:00:00 2026 UTC <user@host>\n# name: z\n# type: matrix\n\
                  # rows: 60\n# columns: 2\n";
    let of = |header: &str, row: &dyn Fn(&str, &str) -> String| table(header, |_, u, y| row(u, y));
    let comma = |u: &str, y: &str| format!("{},{}", double(u), double(y));
    let plain = json(&of("u,y\n", &comma), &[]);
    for (name, text, flags) in [
        ("writetable", of("u,y\r\n", &|u, y| comma(u, y) + "\r"), &[][..]),
        ("writematrix", of("", &comma), &by_number),
        ("save -ascii", of("", &|u, y| short(u) + " " + &short(y)), &by_number),
        (
            "save -text",
            of(octave, &|u, y| format!(" {} {}", double(u), double(y))),
            &by_number,
        ),
    ] {
        let found = json(&text, flags);
        let [expected, found] = [&plain, &found].map(|report| {
            let model = &report["estimates"][0]["model"];
            let both = ["A", "B"].map(|name| model[name].as_array().expect("numbers").clone());
            let numbers = both.iter().flatten().filter_map(serde_json::Value::as_f64);
            numbers.collect::<Vec<f64>>()
        });
        assert_eq!((expected.len(), found.len()), (6, 6), "{name}");
        for (expected, found) in expected.iter().zip(&found) {
            assert!((expected - found).abs() < 2e-6, "{name}: {found} {expected}");
        }
    }
}

/// A Parquet table gives the digits of the same table in CSV; damaged ones and columns without numbers end in one line.
#[test]
fn parquet_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let numbers = |place: usize| -> Vec<f64> {
        let samples = samples();
        samples
            .iter()
            .map(|row| row[place].parse().expect("a number"))
            .collect()
    };
    let columns = [
        ("step", PrimitiveArray::from_vec((0..SAMPLES as i64).collect()).boxed()),
        ("Heizung [V]", PrimitiveArray::from_vec(numbers(0)).boxed()),
        ("Druck", PrimitiveArray::from_vec(numbers(1)).boxed()),
        ("note", Utf8ViewArray::from_slice_values(vec!["a, b"; SAMPLES]).boxed()),
    ];
    let columns = columns.map(|(name, column)| (name.to_owned(), column));
    Table(columns.to_vec()).write(&at("my.parquet"));
    let text = table("step,Heizung [V],Druck\n", |k, u, y| format!("{k},{u},{y}"));
    std::fs::write(at("my.csv"), text).expect("a file");
    let estimate = |file: &str, more: &[&str]| {
        let mut program = Command::new(PROGRAM);
        program
            .current_dir(folder.path())
            .args(["estimate", file, "--order", "2"]);
        program.args(["--estimator", "arx", "--format", "json"]).args(more);
        program.output().expect("the program")
    };
    let chosen = ["--input", "Heizung", "--output", "Druck"];
    let [csv, parquet] = ["my.csv", "my.parquet"].map(|file| {
        let output = estimate(file, &chosen);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let mut json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        // The table in CSV has no column of texts.
        json["file"] = "".into();
        json["form"] = "".into();
        json
    });
    assert_eq!(csv, parquet);
    let note = stderr(&estimate("my.parquet", &["--input", "note", "--output", "Druck"]));
    assert!(
        note.contains("line 2, column note: 'a, b' is not a finite number"),
        "{note}"
    );
    let whole = std::fs::read(at("my.parquet")).expect("a file");
    for length in [0, 3, whole.len() / 2, whole.len() - 1] {
        std::fs::write(at("cut.parquet"), &whole[..length]).expect("a file");
        let line = stderr(&estimate("cut.parquet", &chosen));
        assert_eq!(
            line,
            "asobench: cut.parquet: not a whole Parquet file; it begins and ends with PAR1\n"
        );
    }
    for place in (4..whole.len() - 4).step_by(29) {
        let mut damaged = whole.clone();
        damaged[place] ^= 0x55;
        std::fs::write(at("damaged.parquet"), damaged).expect("a file");
        let output = estimate("damaged.parquet", &chosen);
        let code = output.status.code();
        assert!(matches!(code, Some(0..=2)), "{place}: {}", stderr(&output));
        assert!(!stderr(&output).contains("panicked"), "{place}: {}", stderr(&output));
    }
}

/// Tables as pyarrow and polars encode them (dictionaries, pages of both versions, snappy, gzip, several groups of rows)
/// give the digits of the same table in CSV.
#[test]
fn parquet_of_other_programs() {
    let folder = tempfile::tempdir().expect("a folder");
    let csv = folder.path().join("table.csv");
    let rows = (0..60).map(|k| format!("{},{}\n", 7 * k * k % 11, 5 * k * k % 11));
    std::fs::write(&csv, "u,y\n".to_owned() + &rows.collect::<String>()).expect("a file");
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recorded_data/data");
    let estimate = |file: &Path| {
        let mut program = Command::new(PROGRAM);
        program
            .arg("estimate")
            .arg(file)
            .args(["--input", "u", "--output", "y"]);
        program.args(["--order", "2", "--estimator", "arx", "--format", "json"]);
        let output = program.output().expect("the program");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let mut json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        json["file"] = "".into();
        json["form"] = "".into();
        json
    };
    let expected = estimate(&csv);
    for file in ["pyarrow.parquet", "polars.parquet"] {
        assert_eq!(estimate(&data.join(file)), expected, "{file}");
    }
}

/// `estimate`, `--validate`, `study-from` and the inputs of studies read by one door: the same refusal of a row that
/// begins with an error value, and the same marks of decimals.
#[test]
fn one_door() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text);
    let good = table("u,y\n", |_, u, y| format!("{u},{y}"));
    let gap = table("u,y\n", |k, u, y| format!("{},{y}", if k == 20 { "#N/A" } else { u }));
    let study = "[settings]\nwindow = 20\nhorizon = 40\ninput = \"file:gap.csv#1\"\n[[methods]]\nestimator = \"arx\"\n";
    for (name, text) in [
        ("good.csv", &good),
        ("gap.csv", &gap),
        ("study.toml", &study.to_owned()),
    ] {
        write(name, text).expect("written");
    }
    let arx = ["--estimator", "arx", "--order", "2"];
    for arguments in [
        &["estimate", "gap.csv"][..],
        &["estimate", "good.csv", "--validate", "gap.csv"],
        &["study-from", "gap.csv", "--out", "mine.toml"],
        &["check", "study.toml"],
    ] {
        let mut program = Command::new(PROGRAM);
        program.current_dir(folder.path()).args(arguments);
        if arguments[0] != "check" {
            program.args(arx);
        }
        let output = program.output().expect("the program");
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(
            said.contains("gap.csv: line 22, column u: a sample is missing ('#N/A')"),
            "{said}"
        );
    }
    let thousands = table("u;y\n", |k, _, _| {
        format!("{};{}.125", if k % 7 == 0 { "68" } else { "2.719" }, k + 1)
    });
    let refused = printed(thousands.as_bytes(), &[]);
    assert!(
        refused.contains("may be 2.719 or 2719") && refused.contains("--decimal point or --decimal comma"),
        "{refused}"
    );
}

/// Files of other programs' own forms, and pictures in other forms, name the way.
#[test]
fn other_forms_name_the_way() {
    for (flags, part) in [
        (
            &["my.xls", "--order", "2"][..],
            "my.xls: a spreadsheet; expected it saved as .xlsx or as CSV",
        ),
        (&["my.mat", "--order", "2"], "save -ascii"),
        (
            &["my.csv", "--order", "2", "--plot", "fit.png"],
            "expected a name that ends in .svg or .pdf; rsvg-convert -f png -o fit.png fit.svg \
             converts one",
        ),
    ] {
        let output = Command::new(PROGRAM).arg("estimate").args(flags).output();
        let output = output.expect("the program");
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    }
}

/// Options beside a range of orders are those of every model of the table, or are refused.
#[test]
fn options_beside_a_range_of_orders() {
    let folder = tempfile::tempdir().expect("a folder");
    // The start is not at rest, so that `--initial` matters.
    let text = table("u,y\n", |_, u, y| format!("{u},{y}"));
    let late: String = text
        .lines()
        .filter(|line| line.contains('u'))
        .chain(text.lines().skip(9))
        .fold(String::new(), |all, line| all + line + "\n");
    std::fs::write(folder.path().join("my.csv"), late).expect("a file");
    let estimate = |flags: &[&str]| {
        let mut program = Command::new(PROGRAM);
        program.current_dir(folder.path()).args(["estimate", "my.csv"]);
        program.args(flags).output().expect("the program")
    };
    let loss = |flags: &[&str]| {
        let output = estimate(&[flags, &["--estimator", "oe", "--format", "json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        json["table"][1]["V"].as_f64().expect("V")
    };
    let [zero, free] = ["zero", "estimate"].map(|start| loss(&["--order", "1:2", "--initial", start]));
    assert!(free < 1e-3 * zero, "{zero} {free}");
    assert_eq!(free, loss(&["--order", "1:2"]));
    for flags in [
        &["--order", "1:2", "--rows", "complete", "--estimator", "arx"][..],
        &["--order", "1:2", "--gain", "scaled:0.5"],
        &["--order", "1:2", "--initial", "zero"],
    ] {
        let output = estimate(flags);
        assert_eq!(output.status.code(), Some(2), "{flags:?}");
        let line = stderr(&output);
        assert!(
            line.contains("needs a single model") || line.contains("an option of estimator"),
            "{line}"
        );
    }
}
