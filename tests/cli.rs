//! The program from outside: what it prints, its exit codes, its one-line messages.

#![expect(clippy::format_push_string, reason = "records of a few lines")]

use crate::common::{PROGRAM, stderr, stdout};
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn asobench(arguments: &[&str]) -> Output {
    let mut command = Command::new(PROGRAM);
    command.args(arguments).stdin(Stdio::null());
    command.output().expect("the program runs")
}

/// Bad input: exit code 2, nothing on stdout, one line on stderr with each of `parts`, and perhaps the command that was
/// meant.
fn refused(arguments: &[&str], parts: &[&str]) {
    let output = asobench(arguments);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert_eq!(stdout(&output), "", "{arguments:?}");
    let lines = message.lines().filter(|line| !line.starts_with("  try: "));
    assert_eq!(lines.count(), 1, "{arguments:?}: {message}");
    assert!(message.starts_with("asobench: "), "{message}");
    for part in parts {
        assert!(message.contains(part), "{arguments:?}: no '{part}' in: {message}");
    }
}

/// A folder with files of given content.
struct Files {
    folder: tempfile::TempDir,
}

impl Files {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        Self { folder }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().expect("UTF-8").to_owned()
    }

    fn write(&self, name: &str, content: &str) -> String {
        let path = self.path(name);
        std::fs::write(&path, content).expect("a writable file");
        path
    }
}

fn golden(name: &str) -> String {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    root.join("tests/golden/data")
        .join(name)
        .to_str()
        .expect("UTF-8")
        .to_owned()
}

/// 40 rows of a first-order system.
fn record() -> String {
    let mut text = "k,u,y\n".to_owned();
    let mut y = 0.0;
    for k in 0..40 {
        let u = f64::from((k * 7) % 5) - 2.0;
        text += &format!("{k},{u},{y}\n");
        y = 0.3 * y + u;
    }
    text
}

#[test]
fn bad_records_are_refused_by_line_and_column() {
    let files = Files::new();
    let refuse = |content: &str, parts: &[&str]| {
        let path = files.write("bad.csv", content);
        let mut all = vec!["bad.csv"];
        all.extend(parts);
        refused(&["estimate", &path, "--order", "1"], &all);
    };
    refused(
        &["estimate", &files.path("none.csv"), "--order", "1"],
        &["none.csv", "No such file"],
    );
    refuse("", &["empty", "header"]);
    refuse("1,2\n3,4\n", &["line 1", "no header"]);
    refuse(
        "u,y,z\n1,2,3\n",
        &[
            "line 1",
            "unknown column 'z'",
            "expected u and y (and perhaps k, t or time)",
        ],
    );
    refuse("u,x\n1,2\n", &["line 1", "'x'"]);
    refuse("u,y\n1,2\n1,two\n", &["line 3", "column y", "'two'"]);
    refuse("u,y\n1,2\nNaN,2\n", &["line 3", "column u", "'NaN'"]);
    refuse("u,y\n1,inf\n", &["line 2", "column y", "'inf'"]);
    refuse("u,y\n1,2\n3\n", &["line 3", "1 cell, but the header has 2"]);
    refuse("u,y\n1,2\n3,4,5\n", &["line 3", "3 cells"]);
    refuse("u,y\n1,2\n2,3\n", &["2 samples are too few for order 1", "at least 3"]);
    refuse("u,y\n1,2\n1,3\n1,4\n1,7\n", &["column u is constant"]);
    refuse("u,y\n1,2\n0,2\n1,2\n4,2\n", &["column y is constant"]);
    refuse("u,y\n", &["no samples"]);
    let mut ramp = "u,y\n".to_owned();
    for k in 0..30 {
        ramp += &format!("{k},{}\n", (k * 7) % 5);
    }
    let path = files.write("ramp.csv", &ramp);
    refused(
        &["estimate", &path, "--order", "1", "--detrend", "linear"],
        &["ramp.csv", "column u", "linear trend"],
    );
    let binary = files.path("binary.csv");
    std::fs::write(&binary, [0xff, 0xfe, 0x00, 0x01]).expect("a writable file");
    refused(&["estimate", &binary, "--order", "1"], &["binary.csv", "line 1"]);
    refused(
        &["estimate", files.folder.path().to_str().unwrap(), "--order", "1"],
        &["directory"],
    );
}

#[test]
fn what_would_fill_the_memory_is_refused() {
    let files = Files::new();
    let mut long = "u,y\n".to_owned();
    for k in 0..3003 {
        long += &format!("{},{}\n", k % 7, k % 5);
    }
    let long = files.write("long.csv", &long);
    refused(&["estimate", &long, "--order", "1001"], &["--order: ", "at most 1000"]);
    refused(
        &["estimate", &long, "--order", "1", "--iterations", "1000000000000"],
        &["--iterations: ", "1 to 1000"],
    );
}

#[test]
fn bad_settings_are_refused_by_flag() {
    let files = Files::new();
    let path = files.write("good.csv", &record());
    let refuse = |flags: &[&str], parts: &[&str]| {
        let mut arguments = vec!["estimate", &path];
        arguments.extend(flags);
        refused(&arguments, parts);
    };
    refuse(&["--plot", "output"], &["--plot: needs a single model", "--order"]);
    refuse(&["--order", "0"], &["--order", "at least 1"]);
    refuse(&["--order", "two"], &["--order", "two"]);
    refuse(&["--order", "14"], &["40 samples are too few for order 14"]);
    refuse(&["--order", "18446744073709551615"], &["too few"]);
    refuse(&["--order", "1", "--delay", "-1"], &["--delay", "at least 0"]);
    refuse(
        &["--order", "1", "--delay", "0", "--estimator", "ls"],
        &["--estimator ls", "no direct term for --delay 0"],
    );
    refuse(&["--order", "1", "--window", "41"], &["--window", "41", "40 samples"]);
    refuse(&["--order", "2", "--window", "5"], &["--window", "5", "at least 6"]);
    refuse(
        &["--order", "1", "--solver", "cholesy"],
        &["--solver", "did you mean 'cholesky'"],
    );
    refuse(
        &["--order", "1", "--estimator", "lss"],
        &["--estimator", "did you mean 'ls'"],
    );
    refuse(
        &["--order", "1", "--auxiliary", "frosen"],
        &["--auxiliary", "did you mean 'frozen'"],
    );
    refuse(
        &["--order", "1", "--stage10", "as-print"],
        &["--stage10", "did you mean 'as-printed'"],
    );
    refuse(
        &["--order", "1", "--detrend", "meen"],
        &["--detrend", "did you mean 'mean'"],
    );
    refuse(&["--order", "1", "--format", "xml"], &["--format", "text, json"]);
    refuse(&["--order", "1", "--iterations", "0"], &["--iterations"]);
    refuse(
        &["--order", "1", "--solver", "cholesky"],
        &["iv", "cholesky", "least squares only"],
    );
    refuse(
        &["--order", "1", "--solver", "qr", "--stage10", "as-printed"],
        &["--stage10", "solver 'partitioned' only"],
    );
    refuse(
        &["--order", "1", "--gain", "deadbeat"],
        &["--gain", "dead-beat, scaled:RHO"],
    );
    refuse(
        &["--order", "1", "--gain", "poles:0.1,0.2"],
        &["--gain", "2 poles", "order is 1"],
    );
    refuse(
        &["--order", "2", "--gain", "poles:0.1+0.2i,0.3"],
        &["--gain", "conjugate"],
    );
    refuse(
        &["--order", "1", "--states", "/nonexistent/x.csv"],
        &["--states", "/nonexistent/x.csv"],
    );
    refuse(&["--order", "1", "--windw", "9"], &["--windw", "--window"]);
    refuse(&["--order", "-1"], &["--order", "-1", "whole number"]);
    refuse(&["--order", "1", "--window", "-5"], &["--window", "-5"]);
    refuse(
        &["--order", "1", "--states", &path],
        &["--states", "good.csv", "not written by asobench"],
    );
    refuse(
        &["--order", "1", "--states", "/dev/null"],
        &["--states", "not a regular file"],
    );
    refuse(&["--order", "1", "--gain", "scaled:1e400"], &["--gain", "'1e400'"]);
    refuse(&["--order", "1", "--solver", "a\n\nb"], &["--solver"]);
    refused(&["estimate", "a\nb.csv", "--order", "1"], &["a\\nb.csv"]);
}

#[test]
fn bad_flags_of_reproduce_are_refused() {
    refused(&["reproduce", "--threads", "65535"], &["--threads", "1024"]);
    refused(&["reproduce", "--threads", "0"], &["--threads", "0"]);
    refused(
        &["reproduce", "--paper", "nikolov", "--trials", "0"],
        &["--trials", "0"],
    );
    refused(&["reproduce", "--replay", "C2"], &["--replay", "CELL:TRIAL"]);
    refused(&["reproduce", "--replay", "C9:0"], &["--replay", "C9", "C1, C2, C3"]);
    refused(&["reprodce"], &["reprodce", "reproduce"]);
}

/// `dual` and `augmented` say what they would need.
#[test]
fn naive_solvers_refuse_what_is_too_large() {
    let files = Files::new();
    let mut text = "u,y\n".to_owned();
    for k in 0..5000_u32 {
        text += &format!("{},{}\n", (k * k) % 7, (k * k * k) % 11);
    }
    let path = files.write("long.csv", &text);
    for (solver, dimension) in [("dual", "4999"), ("augmented", "5001")] {
        refused(
            &[
                "estimate",
                &path,
                "--order",
                "1",
                "--estimator",
                "ls",
                "--solver",
                solver,
            ],
            &[solver, dimension, "limit is 4096"],
        );
    }
}

/// Flags of estimators and orders that do not fit each other are refused by one line that says what is expected.
#[test]
fn orders_and_estimators_that_do_not_fit_are_refused() {
    let files = Files::new();
    let path = files.write("good.csv", &record());
    for (flags, parts) in [
        (
            "--states states.csv",
            [
                "--states: needs a single model; expected --order n, or --orders",
                "where the estimators take it",
            ],
        ),
        (
            "--estimator ls,arx --orders na=1,nb=1",
            ["--orders: estimator 'ls'", "--order and --delay"],
        ),
        (
            "--estimator arx --order 1 --orders na=1,nb=1",
            ["--order: ", "together with --orders"],
        ),
        (
            "--estimator arx --delay 2 --orders na=1,nb=1",
            ["--delay: ", "together with --orders"],
        ),
        ("--estimator arx --orders na=1,nx=1", ["--orders: 'nx'", "na, nb, nc"]),
        (
            "--estimator arx --orders na=1,nb=1,nc=1",
            ["--orders: expected na, nb, nk", ""],
        ),
        ("--estimator arx --orders nk=1", ["--orders: ", "at least 1"]),
        (
            "--estimator arx --orders na=20,nb=30",
            ["40 samples are too few", "orders na=20,nb=30,nk=1"],
        ),
        (
            "--estimator arx --order 1 --iterations 3",
            ["--iterations: an option of estimator 'iv' or 'wnsf' only", ""],
        ),
        (
            "--estimator ls --order 1 --rows padded",
            ["--rows: an option of estimator 'iv' or 'arx'", ""],
        ),
        (
            "--estimator arx --order 1 --rows all",
            ["unknown rows 'all'", "prewindow"],
        ),
        ("--estimator known --order 1", ["--estimator known: ", "no known plant"]),
        ("--order 1 --plot x.csv", ["--plot ", ".svg"]),
        ("--order 1 --report x.svg", ["--report ", ".html"]),
    ] {
        let arguments = ["estimate", &path].into_iter().chain(flags.split_whitespace());
        refused(&arguments.collect::<Vec<_>>(), &parts);
    }
}

/// `y(k) = 0.3 y(k-1) + u(k-1)`: as the record was made, in every form of the output.
#[test]
fn arx_finds_what_the_record_was_made_by() {
    let files = Files::new();
    let (path, svg) = (files.write("good.csv", &record()), files.path("plot.svg"));
    let arguments = [
        "estimate",
        &path,
        "--estimator",
        "arx",
        "--orders",
        "na=1,nb=1,nk=1",
        "--plot",
        &svg,
    ];
    let text = stdout(&asobench(&arguments));
    assert!(text.contains("y(k) = 0.3 y(k-1) + u(k-1)"), "{text}");
    let drawing = std::fs::read_to_string(&svg).expect("a drawing");
    assert!(drawing.contains(">arx<") && drawing.contains(">measured<"));
    let json = asobench(&[&arguments[..6], &["--format", "json"]].concat());
    let json: Value = serde_json::from_str(&stdout(&json)).expect("JSON");
    let arx = &json["estimates"][0];
    let close = |found: &Value, expected: &[f64]| {
        let found = numbers(found);
        let same = |(f, e): (&f64, &f64)| (f - e).abs() < 1e-12;
        found.len() == expected.len() && found.iter().zip(expected).all(same)
    };
    assert!(close(&arx["model"]["A"], &[1.0, -0.3]) && close(&arx["model"]["B"], &[0.0, 1.0]));
    assert!(close(
        &arx["poles"]
            .as_array()
            .map_or(Value::Null, |p| p.iter().map(|p| p["re"].clone()).collect()),
        &[0.3]
    ));
    assert_eq!(
        (&arx["status"], &json["orders"]),
        (&"ok".into(), &"na=1,nb=1,nk=1".into())
    );
    assert_eq!(numbers(&arx["se"]).len(), 2);
}

/// 400 samples of `y(k) = 0.8 y(k-1) + u(k-1) + e(k)`, u signs, e uniform, by a linear congruence.
fn noisy_record() -> String {
    let mut state = 1_u64;
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    };
    let (mut text, mut y) = ("u,y\n".to_owned(), 0.0);
    for _ in 0..400 {
        let (u, e) = (draw().signum(), draw());
        text += &format!("{u},{y}\n");
        y = 0.8 * y + u + e;
    }
    text
}

/// The model of a record with `--delay 3` is that of the same one with its output two samples earlier and `--delay 1`,
/// moved by two samples; also for methods that know no delay.
#[test]
fn a_delay_moves_every_model() {
    let text = noisy_record();
    let rows = text.lines().skip(1);
    let rows: Vec<(&str, &str)> = rows.filter_map(|line| line.split_once(',')).collect();
    let files = Files::new();
    let write = |name: &str, ahead: usize| {
        let pairs = rows.iter().zip(&rows[ahead..]);
        let lines = pairs.map(|((u, _), (_, y))| format!("{u},{y}\n"));
        files.write(name, &format!("u,y\n{}", lines.collect::<String>()))
    };
    let (late, early) = (write("late.csv", 0), write("early.csv", 2));
    let coefficients = |path: &str, delay: &str, name: &str| {
        let order = ["estimate", path, "--order", "1", "--delay", delay];
        let found = asobench(&[&order[..], &["--estimator", name, "--format", "json"]].concat());
        let found: Value = serde_json::from_str(&stdout(&found)).expect("JSON");
        numbers(&found["estimates"][0]["model"]["B"])
    };
    for name in ["ls", "iv"] {
        let late = coefficients(&late, "3", name);
        let early = coefficients(&early, "1", name);
        assert_eq!(late[..3], [0.0; 3], "{name}");
        assert_eq!(late[3..], early[1..], "{name}");
    }
}

#[test]
fn a_page_about_a_record() {
    let files = Files::new();
    let (path, page) = (files.write("a<b>&'c.csv", &noisy_record()), files.path("page.html"));
    let arguments = [
        "estimate",
        &path,
        "--order",
        "2",
        "--window",
        "300",
        "--estimator",
        "arx,moesp",
        "--detrend",
        "mean",
        "--report",
        &page,
        "--details",
    ];
    let output = asobench(&arguments);
    let (text, message) = (stdout(&output), stderr(&output));
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let words: Vec<&str> = text.split_whitespace().collect();
    let sentence = "the order may be too high; try orders na=1,nb=1,nk=1";
    assert!(words.join(" ").contains(sentence), "{text}");
    let json = asobench(&[&arguments[..10], &["--format", "json"]].concat());
    let json: Value = serde_json::from_str(&stdout(&json)).expect("JSON");
    let (arx, moesp) = (&json["estimates"][0], &json["estimates"][1]);
    let pair = &arx["cancellations"][0];
    assert_eq!(pair["orders"], "na=1,nb=1,nk=1");
    let part = |root: &str| pair[root]["re"].as_f64().expect("a number");
    assert_eq!(
        pair["distance"].as_f64().expect("a number"),
        (part("pole") - part("zero")).abs()
    );
    assert!(pair["p_value"].as_f64().expect("a chance") >= 0.05);
    assert_eq!(arx["zeros"][0]["re"], pair["zero"]["re"]);
    assert!(moesp["cancellations"].as_array().expect("a list").is_empty());
    let html = std::fs::read_to_string(&page).expect("a page");
    for part in [
        "<title>asobench report: a&lt;b&gt;&amp;&#39;c.csv</title>",
        "300 samples",
        "--detrend mean",
        "not correlated with past input",
        "99 % bound of one lag",
        "95 % regions of poles",
        "<code>moesp</code> has no bands: this estimator gives no covariance",
        "Frequency response of B/(A F)",
        sentence,
        "y(k) = ",
    ] {
        assert!(html.contains(part), "no '{part}'");
    }
    // Record, outputs, step, Bode; correlations and poles of both estimators; each for a wide and for a narrow screen.
    assert_eq!(html.matches("<svg xmlns").count(), 16);
    for bad in ["NaN", "inf<", "a<b>", "<script src", "http://127"] {
        assert!(!html.contains(bad), "'{bad}'");
    }
    // It is the program's own, and may be replaced; a page of somebody else may not.
    assert_eq!(asobench(&arguments).status.code(), Some(0));
    std::fs::write(&page, "<!DOCTYPE html><title>My thesis</title>").expect("written");
    refused(&arguments, &["--report ", "page.html"]);
    let kept = std::fs::read_to_string(&page).expect("a page");
    assert!(kept.contains("My thesis"));
    refused(
        &[&arguments[..10], &["--report", "page.svg"]].concat(),
        &[
            "'page.svg' for '--report <FILE.html>'",
            "expected a name that ends in .html",
        ],
    );
}

/// A range of orders has a picture and a page too, with the best of each criterion marked.
#[test]
fn a_page_about_orders() {
    let files = Files::new();
    let path = files.write("noisy.csv", &noisy_record());
    let (svg, page) = (files.path("orders.svg"), files.path("orders.html"));
    for (delay, line) in [("1:3", "delay nk = 3"), ("1:9", "best delay of each order")] {
        let output = asobench(&[
            "estimate", &path, "--order", "1:4", "--delay", delay, "--window", "300", "--plot", &svg, "--report", &page,
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        for file in [&svg, &page] {
            let drawn = std::fs::read_to_string(file).expect("a drawing");
            for part in ["AIC", "AICc", "BIC", "FPE", "FIT after the window, %", "best", line] {
                assert!(drawn.contains(&format!(">{part}<")), "{file}: no {part}");
            }
        }
        let html = std::fs::read_to_string(&page).expect("a page");
        // The smallest of each criterion, and the best FIT.
        assert_eq!(html.matches(" *</td>").count(), 5);
    }
}

/// A range of orders of any estimator that takes `orders`: each line is its model of that order, and BIC finds the
/// order by which the record was simulated.
#[test]
fn a_range_of_orders_of_any_estimator() {
    let path = "tests/recorded_data/data/sim_oe2.csv";
    let json = |arguments: &[&str]| -> Value {
        let output = asobench(&[&["estimate", path, "--format", "json"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    for (estimator, orders) in [("oe", "nb=2,nf=2,nk=1"), ("cva", "na=2,nb=2,nc=2,nk=1")] {
        let table = json(&["--order", "1:3", "--estimator", estimator]);
        assert_eq!(table["best"]["bic"]["orders"], orders);
        let row = &table["table"][1];
        let one = json(&["--order", "2", "--estimator", estimator]);
        assert_eq!(row["V"], one["estimates"][0]["loss"], "{estimator}");
        let aic = row["V"].as_f64().expect("V").ln() * 1000.0 + 2.0 * row["d"].as_f64().expect("d");
        assert!((row["aic"].as_f64().expect("AIC") - aic).abs() < 1e-9);
    }
    // Two numbers of the start are fitted beside two of B and two of F.
    let table = json(&["--order", "1:3", "--estimator", "oe", "--initial", "estimate"]);
    let row = &table["table"][1];
    let aic = row["V"].as_f64().expect("V").ln() * 1000.0 + 2.0 * 6.0;
    assert_eq!(row["d"], 6);
    assert!((row["aic"].as_f64().expect("AIC") - aic).abs() < 1e-9);
}

/// A failure has its reason on the page; a model without noise has no residuals to be tested.
#[test]
fn a_page_about_what_failed() {
    let files = Files::new();
    let path = files.write("rank.csv", &record());
    let page = files.path("page.html");
    let arguments = ["estimate", &path, "--order", "3", "--report", &page];
    assert_eq!(asobench(&arguments).status.code(), Some(1));
    let html = std::fs::read_to_string(&page).expect("a page");
    assert!(html.contains("Failed: rank-deficient"), "{html}");
    let short = files.write("short.csv", "u,y\n1,0\n-1,1\n1,-0.7\n1,0.8\n");
    let flags = "--order 1 --estimator arx --report";
    let arguments = [
        &["estimate", &short][..],
        &flags.split(' ').collect::<Vec<_>>(),
        &[&page],
    ];
    assert_eq!(asobench(&arguments.concat()).status.code(), Some(0));
    let html = std::fs::read_to_string(&page).expect("a page");
    assert!(html.contains("Not tested: "), "{html}");
}

/// A plant is the same one in each notation, and shown so before a run.
#[test]
fn check_prints_the_same_equation_in_every_notation() {
    let files = Files::new();
    for table in [
        "A = [1, -1.5, 0.7]\nB = [0, 1, 0.5]",
        "F = [1, -1.5, 0.7]\nB = [0, 1, 0.5]",
        "a = [-0.7, 1.5]\nh = [1, 0.5]",
        "a = [-0.7, 1.5]\nb = [1, 2]",
    ] {
        let text = format!("trials = 2\n[settings]\nplant = \"mine\"\n[plants.mine]\n{table}\n");
        let path = files.write("study.toml", &text);
        let out = files.path("out");
        let text = stdout(&asobench(&["check", &path, "--out", &out]));
        // Modulus sqrt(0.7); gain 1.5 / (1 - 1.5 + 0.7).
        let expected = "plant     mine\n          y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2)\n          \
                        poles 0.75 +- 0.3708i\n          static gain 7.5, settles to 2 % in ";
        assert!(text.contains(expected), "{text}");
    }
    // Equal plants are shown once, with all their names.
    let three = "trials = 2\n[settings]\nplant = [\"p\", \"q\", \"r\"]\n[plants.p]\nA = [1, -0.5]\nB = [0, 1]\n\
                 [plants.q]\na = [0.5]\nb = [1]\n[plants.r]\na = [0.25]\nb = [1]\n";
    let path = files.write("three.toml", three);
    let text = stdout(&asobench(&["check", &path, "--out", &files.path("out")]));
    assert!(
        text.contains("plant     p, q\n          y(k) = 0.5 y(k-1) + u(k-1)\n"),
        "{text}"
    );
    assert!(
        text.contains("plant     r\n          y(k) = 0.25 y(k-1) + u(k-1)\n"),
        "{text}"
    );
    // The orders of models are those of the setting, not the plant's.
    let arx = "trials = 2\n[settings]\norder = [2, 3]\nwindow = 98\n[[methods]]\nestimator = \"arx\"\n";
    let path = files.write("orders.toml", arx);
    let text = stdout(&asobench(&["check", &path, "--out", &files.path("out")]));
    assert!(
        text.contains("orders    na=2,nb=2,nk=1: arx\n          na=3,nb=3,nk=1: arx\n"),
        "{text}"
    );
    let random = "trials = 2\n[settings]\nplant = \"random\"\n";
    let path = files.write("random.toml", random);
    let text = stdout(&asobench(&["check", &path, "--out", &files.path("out")]));
    assert!(
        text.contains("plant     random\n          of order 2, poles within 0.9\n"),
        "{text}"
    );
}

#[test]
fn unstable_gains_are_warned_of() {
    let files = Files::new();
    let path = files.write("good.csv", &record());
    for (gain, part) in [("poles:1.0", "poles:1"), ("scaled:4", "scaled:4")] {
        let output = asobench(&["estimate", &path, "--order", "1", "--estimator", "ls", "--gain", gain]);
        assert_eq!(output.status.code(), Some(0));
        let message = stderr(&output);
        assert!(message.starts_with("warning: ") && message.contains(part), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

/// A numerical failure is a status with its reason, and exit code 1.
#[test]
fn a_numerical_failure_is_a_status() {
    let files = Files::new();
    let path = files.write("rank.csv", &record());
    let output = asobench(&["estimate", &path, "--order", "3", "--format", "json"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    let (ls, iv) = (&json["estimates"][0], &json["estimates"][1]);
    assert_eq!(ls["status"], "rank-deficient");
    assert_eq!(ls["failure"]["stage"], 3);
    assert_eq!(iv["passes"][3]["failure"]["pass"], 0);
    for key in ["a", "b", "h", "x0", "observer", "fit_percent", "spectral_radius"] {
        assert!(ls[key].is_null() && iv[key].is_null(), "{key}");
    }
    let text = stdout(&asobench(&["estimate", &path, "--order", "3"]));
    assert!(text.contains("FAILED: rank-deficient (stage 3, pass 0)"), "{text}");
}

/// An observer that overflows is a failure of stage 12; what comes before it stands.
#[test]
fn an_observer_that_overflows_is_a_status() {
    let files = Files::new();
    let mut text = "u,y\n".to_owned();
    let mut y = 1.0_f64;
    for k in 0..2500 {
        let u = f64::from((k * 7) % 5) - 2.0;
        text += &format!("{u},{y}\n");
        y = 0.5 * y + u;
    }
    let path = files.write("long.csv", &text);
    let states = files.path("states.csv");
    let output = asobench(&[
        "estimate", &path, "--order", "1", "--gain", "scaled:4", "--format", "json", "--states", &states,
    ]);
    assert_eq!(output.status.code(), Some(1));
    let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    for estimate in json["estimates"].as_array().expect("estimates") {
        assert_eq!(estimate["failure"]["stage"], 12);
        assert!(estimate["observer"].is_null() && !estimate["a"].is_null());
    }
    assert!(!Path::new(&states).exists());
    let text = stdout(&asobench(&["estimate", &path, "--order", "1", "--gain", "scaled:4"]));
    assert!(
        text.contains("FAILED: non-finite (stage 12") && !text.contains("inf"),
        "{text}"
    );
}

fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().expect("an array");
    array.iter().map(|v| v.as_f64().expect("a number")).collect()
}

/// JSON on a golden record: the stated shape, the golden values, both readings.
#[test]
fn estimates_as_json() {
    let reference = std::fs::read_to_string(golden("case11_01_n6_N98.json")).expect("a golden file");
    let reference: Value = serde_json::from_str(&reference).expect("JSON");
    for auxiliary in ["refresh", "frozen"] {
        let file = golden("case11_01_n6_N98.csv");
        let output = asobench(&[
            "estimate",
            &file,
            "--order",
            "6",
            "--window",
            "98",
            "--format",
            "json",
            "--auxiliary",
            auxiliary,
        ]);
        assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
        let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        let close = |found: &Value, expected: &Value| {
            let (found, expected) = (numbers(found), numbers(expected));
            asobench::metric::relative_error(&expected, &found) < 1e-8
        };
        let (ls, iv) = (&json["estimates"][0], &json["estimates"][1]);
        assert_eq!((&ls["estimator"], &iv["estimator"]), (&"ls".into(), &"iv".into()));
        assert_eq!((&ls["status"], &iv["status"]), (&"ok".into(), &"ok".into()));
        for key in ["a", "b", "h", "x0"] {
            assert!(close(&ls[key], &reference["ls"][key]), "ls {key}");
            for pass in 0..4 {
                let expected = &reference[format!("iv_{auxiliary}")][pass][key];
                assert!(close(&iv["passes"][pass][key], expected), "{auxiliary} {pass} {key}");
            }
        }
        if auxiliary == "refresh" {
            for key in ["g", "x_at_window", "x_last"] {
                assert!(close(&iv["observer"][key], &reference["observer"][key]), "{key}");
            }
        }
    }
}

/// `--states` holds x-hat(0) ... x-hat(K), consistent with the JSON.
#[test]
fn observer_states_as_csv() {
    let files = Files::new();
    let states = files.path("states.csv");
    let file = golden("case11_05_n2_N126.csv");
    let output = asobench(&[
        "estimate", &file, "--order", "2", "--window", "126", "--format", "json", "--states", &states,
    ]);
    let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    let text = std::fs::read_to_string(&states).expect("the states");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| !line.starts_with(['#', 'k']))
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    let samples = json["samples"].as_u64().expect("a size") as usize;
    assert_eq!(rows.len(), samples + 1);
    let observer = &json["estimates"][1]["observer"];
    assert_eq!(rows[126][1..], numbers(&observer["x_at_window"]));
    assert_eq!(rows[samples - 1][1..], numbers(&observer["x_last"]));
}

/// Every line of text fits 80 columns.
#[test]
fn text_fits_eighty_columns() {
    let file = golden("case11_00_n6_N18.csv");
    let files = Files::new();
    let out = files.path("out");
    for arguments in [
        vec!["estimate", &file, "--order", "6", "--window", "18"],
        vec!["reproduce", "--paper", "nikolov", "--trials", "1", "--out", &out],
        vec!["reproduce", "--paper", "nikolov", "--trials", "40", "--out", &out],
        vec!["reproduce", "--replay", "c3:3", "--out", &out],
        vec!["estimate", &file, "--orders", "na=6,nb=3,nk=2", "--estimator", "arx"],
        vec!["methods"],
        vec!["theory", "experiments/nikolov2023.toml"],
        vec!["theory", "experiments/gpebo-noise.toml"],
        vec!["reproduce", "--help"],
        vec!["estimate", "--help"],
        vec!["--help"],
    ] {
        let text = stdout(&asobench(&arguments));
        assert!(!text.is_empty());
        for line in text
            .lines()
            .filter(|line| !line.contains(&out) && !line.contains(&file))
        {
            assert!(line.chars().count() <= 80, "{arguments:?}: {line}");
        }
    }
}

#[test]
fn help_texts() {
    for (name, arguments) in [
        ("help", vec!["--help"]),
        ("help_reproduce", vec!["reproduce", "--help"]),
        ("help_estimate", vec!["estimate", "--help"]),
        ("help_run", vec!["run", "--help"]),
        ("help_check", vec!["check", "--help"]),
        ("help_new", vec!["new", "--help"]),
        ("help_schema", vec!["schema", "--help"]),
        ("help_replay", vec!["replay", "--help"]),
        ("help_throughput", vec!["throughput", "--help"]),
        ("help_plan", vec!["plan", "--help"]),
        ("help_shard", vec!["shard", "--help"]),
        ("help_merge", vec!["merge", "--help"]),
        ("help_status", vec!["status", "--help"]),
        ("help_slurm", vec!["slurm", "--help"]),
        ("help_theory", vec!["theory", "--help"]),
        ("help_suite", vec!["suite", "--help"]),
        ("help_methods", vec!["methods", "--help"]),
        ("help_explain", vec!["explain", "--help"]),
        ("help_failures", vec!["failures", "--help"]),
        ("help_compare", vec!["compare", "--help"]),
    ] {
        insta::assert_snapshot!(name, stdout(&asobench(&arguments)));
    }
}

/// The keys of the JSON; nulls where there is no rate, and in cells without theory.
#[test]
fn theory_as_json() {
    let theory = |arguments: &[&str]| -> Value {
        let output = asobench(&[&["theory", "--format", "json"], arguments].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_str(&stdout(&output)).expect("JSON")
    };
    let file = "experiments/nikolov2023.toml";
    let of_noise = theory(&[
        file,
        "--set",
        "noise=white",
        "--set",
        "claim=C2",
        "--set",
        "zip=[]",
        "--set",
        "eta=10.018",
        "--set",
        "window=98",
    ]);
    let cell = &of_noise["cells"][0];
    assert_eq!(cell["settings"]["noise"], "white");
    let output = |label: &str| {
        let mut outputs = cell["outputs"].as_array().unwrap().iter();
        outputs.find(|output| output["output"] == label).unwrap()
    };
    let close = |value: &Value, printed: f64, digit: f64| {
        let value = value.as_f64().unwrap();
        assert!((value - printed).abs() <= 0.5001 * digit, "{value} {printed}");
    };
    let (ls, iv) = (output("ls"), output("iv(4)"));
    close(&ls["limit"]["e_a"], 0.8435, 1e-4);
    close(&ls["trace"], 6.082, 1e-3);
    assert!(iv["limit"].is_null() && iv["sqrt_n_rms"]["e_x0"].is_null());
    close(&iv["sqrt_n_rms"]["e_a"], 4.741, 1e-3);
    for bound in ["shared", "separate"] {
        close(&cell["bounds"][bound]["sqrt_n_rms"]["e_a"], 4.092, 1e-3);
        assert!(cell["bounds"][bound]["trace"].is_number());
    }
    let none = theory(&["experiments/gpebo-noise.toml"]);
    let cell = &none["cells"][0];
    let output = &cell["outputs"][0];
    assert!(output["output"].is_string() && cell["why"].is_string());
    for value in [
        &output["limit"],
        &output["sqrt_n_rms"],
        &output["trace"],
        &cell["bounds"]["shared"],
    ] {
        assert!(value.is_null());
    }
}

/// Keys, counts and medians of W98: median e_a 0.119, e_b 0.0223, max e_x 0.649, by both engines (a study of 10^6
/// trials by faer), within five of their standard errors.
#[test]
fn throughput_is_measured_beside_the_peak() {
    let arguments = [
        "throughput",
        "--trials",
        "2000",
        "--repetitions",
        "1",
        "--threads",
        "1,2",
        "--format",
        "json",
    ];
    let output = asobench(&arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    let keys = |object: &Value| -> Vec<String> { object.as_object().expect("an object").keys().cloned().collect() };
    assert_eq!(
        keys(&json),
        ["workload", "flop_per_trial", "processors", "fma_peak_gflops", "engines"]
    );
    assert_eq!(json["workload"], "W98");
    let engines = json["engines"].as_array().expect("engines");
    let asked = [("lanes", 1), ("lanes", 2), ("faer", 1), ("faer", 2)];
    assert_eq!(engines.len(), asked.len());
    let number = |object: &Value, key: &str| object[key].as_f64().unwrap_or_else(|| panic!("{key}: {object}"));
    for (timing, (engine, threads)) in engines.iter().zip(asked) {
        assert_eq!(
            keys(timing),
            [
                "engine",
                "instructions",
                "threads",
                "trials",
                "repetitions",
                "trials_per_second",
                "slowest",
                "fastest",
                "fma_peak_gflops",
                "fraction_of_fma_peak",
                "e_a",
                "e_b",
                "e_x_max",
                "e_a_mcse",
                "e_b_mcse",
                "e_x_max_mcse",
                "failed",
                "fallbacks",
            ]
        );
        assert_eq!(timing["engine"], engine);
        assert_eq!(timing["threads"], threads);
        assert_eq!(timing["trials"], 2000);
        assert_eq!(timing["repetitions"], 1);
        assert_eq!(timing["failed"], 0);
        assert!(number(timing, "fallbacks") < 2000.0 && (engine == "lanes" || timing["fallbacks"] == 0));
        for (key, expected) in [("e_a", 0.119), ("e_b", 0.0223), ("e_x_max", 0.649)] {
            let error = number(timing, &format!("{key}_mcse"));
            let found = number(timing, key);
            assert!(error > 0.0 && error < 0.05 * expected, "{key}: {error}");
            assert!((found - expected).abs() < 5.0 * error, "{key}: {found} +- {error}");
        }
        let rate = number(timing, "trials_per_second");
        assert!(rate > 0.0 && rate == number(timing, "slowest") && rate == number(timing, "fastest"));
        let peaks = numbers(&timing["fma_peak_gflops"]);
        assert_eq!(peaks.len(), 2);
        let fraction = rate * number(&json, "flop_per_trial") / (0.5e9 * (peaks[0] + peaks[1]));
        assert!((number(timing, "fraction_of_fma_peak") / fraction - 1.0).abs() < 1e-12);
        assert!(peaks.iter().all(|peak| *peak <= number(&json, "fma_peak_gflops")));
    }
    // Threads move no figure.
    for key in ["e_a", "e_b", "e_x_max", "fallbacks"] {
        assert_eq!(engines[0][key], engines[1][key], "{key}");
        assert_eq!(engines[2][key], engines[3][key], "{key}");
    }
}

#[test]
fn throughput_as_text() {
    let fast = ["throughput", "--trials", "100", "--repetitions", "2", "--threads", "1"];
    let output = asobench(&[&fast[..], &["--format", "text"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let text = stdout(&output);
    let count = |engine: &str| text.lines().filter(|line| line.starts_with(engine)).count();
    assert_eq!((count("lanes "), count("faer ")), (2, 2), "{text}");
    assert!(text.starts_with("W98: n = 6, N = 98, K = 400"), "{text}");
    let output = asobench(&[&fast[..], &["--engine", "lanes"]].concat());
    assert!(!stdout(&output).contains("faer"), "{}", stdout(&output));
    refused(
        &["throughput", "--engine", "auto"],
        &["--engine", "'auto'", "lanes or faer"],
    );
    refused(&["throughput", "--engine", "lane"], &["--engine", "'lane'", "lanes"]);
    refused(&["throughput", "--trials", "99"], &["--trials", "99"]);
    refused(&["throughput", "--threads", "0"], &["--threads", "0"]);
    refused(&["throughput", "--threads", "1,x"], &["--threads", "x"]);
    refused(&["throughput", "--repetitions", "0"], &["--repetitions", "0"]);
}

/// Files of a folder, hidden ones too.
fn listing(path: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(path).expect("a folder");
    // The lock stays, whatever happens to a run.
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    names.retain(|name| name != ".lock");
    names.sort();
    names
}

/// A run writes all files, says the same with other threads, may be repeated, and refuses another design.
#[test]
fn reproduce_writes_whole_folders() {
    let files = Files::new();
    let out = files.path("out");
    let run = |more: &[&str]| {
        let mut arguments = vec!["reproduce", "--paper", "nikolov", "--trials", "300", "--out", &out];
        arguments.extend(more);
        asobench(&arguments)
    };
    let content = || -> Vec<Vec<u8>> {
        let folder = Path::new(&out);
        listing(folder)
            .iter()
            .map(|name| std::fs::read(folder.join(name)).expect("a file"))
            .collect()
    };
    let first = run(&["--threads", "1"]);
    assert_eq!(first.status.code(), Some(0), "{}", stderr(&first));
    let expected = [
        "fig1.svg",
        "fig2.svg",
        "fig3.svg",
        "looks.json",
        "manifest.json",
        "summary.json",
        "summary.parquet",
        "trials.parquet",
    ];
    assert_eq!(listing(Path::new(&out)), expected);
    let (text, bytes) = (stdout(&first), content());
    for verdict in [
        "C1  noise-free, N = 18",
        "typical",
        "not typical",
        "\nC1  holds: ",
        "\nC2  does not hold: ",
        "replay C2:0",
    ] {
        assert!(text.contains(verdict), "{text}");
    }
    let second = run(&["--threads", "5"]);
    assert!(stderr(&second).starts_with("replacing the results in"));
    assert_eq!(stdout(&second), text);
    assert!(content() == bytes, "other bits with 5 threads");
    refused(
        &[
            "reproduce",
            "--paper",
            "nikolov",
            "--trials",
            "300",
            "--seed",
            "7",
            "--out",
            &out,
        ],
        &["--out", "another design", "seed"],
    );
    assert!(content() == bytes, "a refused run must change nothing");
}

/// Two runs in one folder at once: the second is refused.
#[test]
fn two_runs_in_one_folder() {
    let files = Files::new();
    let out = files.path("out");
    let run = ["reproduce", "--paper", "nikolov", "--trials", "10", "--out", &out];
    let held = asobench::study::ResultsFolder::open(Path::new(&out)).expect("a folder");
    refused(&run, &["--out", "another run"]);
    drop(held);
    assert!(asobench(&run).status.success());
}

/// A folder that is not the program's is left alone.
#[test]
fn foreign_folders_are_refused() {
    let files = Files::new();
    let out = files.path("out");
    std::fs::create_dir(&out).expect("a folder");
    for (content, part) in [
        ("", "not a manifest"),
        ("{}", "no experiment"),
        ("[1]", "no experiment"),
    ] {
        files.write("out/manifest.json", content);
        refused(
            &["reproduce", "--paper", "nikolov", "--trials", "1", "--out", &out],
            &["--out", part],
        );
    }
    std::fs::remove_file(Path::new(&out).join("manifest.json")).expect("removed");
    files.write("out/trials.parquet", "");
    refused(
        &["reproduce", "--paper", "nikolov", "--trials", "1", "--out", &out],
        &["trials.parquet without manifest.json"],
    );
    std::fs::remove_file(Path::new(&out).join("trials.parquet")).expect("removed");
    // A file that cannot be replaced: nothing of this run stays under a temporary name.
    std::fs::create_dir(Path::new(&out).join("summary.json")).expect("a folder");
    let output = asobench(&["reproduce", "--paper", "nikolov", "--trials", "1", "--out", &out]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(listing(Path::new(&out)), ["summary.json"]);
}

/// A replay equals the stored rows; its data, estimated as a file, give the same numbers bit for bit.
#[test]
fn a_trial_can_be_replayed() {
    let files = Files::new();
    let (out, data) = (files.path("out"), files.path("trial.csv"));
    assert!(
        asobench(&["reproduce", "--paper", "nikolov", "--trials", "20", "--out", &out])
            .status
            .success()
    );
    let replay = ["reproduce", "--replay", "C2:17", "--out", &out, "--data", &data];
    let text = stdout(&asobench(&replay));
    assert!(
        text.contains("These rows equal, bit for bit, those stored in"),
        "{text}"
    );
    let by_number = stdout(&asobench(&["reproduce", "--replay", "1:17", "--out", &out]));
    assert_eq!(by_number, text);
    let json = stdout(&asobench(&[&replay[..], &["--format", "json"]].concat()));
    let json: Value = serde_json::from_str(&json).expect("JSON");
    let estimates = stdout(&asobench(&[
        "estimate", &data, "--order", "6", "--window", "98", "--format", "json",
    ]));
    let estimates: Value = serde_json::from_str(&estimates).expect("JSON");
    let stage = |title: &str| {
        let stages = json["stages"].as_array().expect("stages");
        stages
            .iter()
            .find(|stage| stage["stage"] == title)
            .unwrap_or_else(|| panic!("no {title}"))
    };
    for pass in 1..=4 {
        let found = &estimates["estimates"][1]["passes"][pass - 1];
        let expected = stage(&format!("Stages 10, 4 and 5, iv pass {pass}: parameters"));
        for key in ["a", "b", "h"] {
            assert_eq!(found[key], expected[key], "pass {pass}, {key}");
        }
    }
    let observer = stage("Stage 12, iv pass 4: observer dead-beat");
    let found = &estimates["estimates"][1]["observer"];
    assert_eq!(found["x_last"], observer["xhat(K-1)"]);
    assert_eq!(found["x_at_window"], observer["xhat(N)"]);
}

/// Nothing is left behind where the folder cannot be written to or the disk is full.
#[test]
fn output_folders_that_cannot_take_the_results() {
    let files = Files::new();
    let file = files.write("file", "");
    refused(
        &["reproduce", "--trials", "1", "--out", &format!("{file}/out")],
        &["--out", "cannot write"],
    );
    refused(
        &[
            "reproduce",
            "--paper",
            "nikolov",
            "--trials",
            "1",
            "--out",
            "/proc/asobench",
        ],
        &["--out", "/proc/asobench"],
    );
    // A limit on the size of files stands for a full disk.
    let out = files.path("full");
    let script = format!("trap '' XFSZ; ulimit -f 16; exec '{PROGRAM}' reproduce --trials 2000 --out '{out}'");
    let output = Command::new("bash").args(["-c", &script]).output().expect("bash runs");
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.contains(&out) && message.contains("blocks"), "{message}");
    assert_eq!(listing(Path::new(&out)), Vec::<String>::new());
}

/// Ctrl-C ends a run cleanly: exit code 130, one line, nothing left behind.
#[test]
fn an_interrupted_run_leaves_nothing() {
    let files = Files::new();
    let out = files.path("out");
    let child = Command::new(PROGRAM)
        .args([
            "reproduce",
            "--paper",
            "nikolov",
            "--trials",
            "100000000",
            "--anyway",
            "--out",
            &out,
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    // The results of `reproduce` replace those there in one step.
    let blocks = Path::new(&out).join(".asobench-replacing/blocks");
    let stored = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.is_ok_and(|entry| entry.path().extension().is_some_and(|e| e == "block"))
    };
    while !std::fs::read_dir(&blocks).is_ok_and(|mut blocks| blocks.any(stored)) {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::thread::sleep(std::time::Duration::from_millis(300));
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.expect("kill runs").success());
    let output = child.wait_with_output().expect("the program ends");
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert!(
        message.contains("interrupted with") && message.contains("nothing was written"),
        "{message}"
    );
    assert_eq!(listing(Path::new(&out)), Vec::<String>::new());
}

/// Long records take at most 200 bytes a row, so that ten million fit into 2 GB: here a quarter of both.
#[test]
fn long_records_take_200_bytes_a_row() {
    let files = Files::new();
    let path = files.path("long.csv");
    let mut to = std::io::BufWriter::new(std::fs::File::create(&path).expect("a writable file"));
    writeln!(to, "u,y").expect("written");
    let (mut x, mut word) = (0.0_f64, 1_u64);
    for _ in 0..2_500_000 {
        word = word
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let u = if word >> 63 == 1 { 1.0 } else { -1.0 };
        let noise = ((word >> 33) & 0xff) as f64 / 2560.0;
        writeln!(to, "{u},{:.4}", x + noise).expect("written");
        x = 0.8 * x + u;
    }
    to.flush().expect("written");
    for (solver, estimator) in [
        ("partitioned", "ls,iv"),
        ("lu", "ls,iv"),
        ("cholesky", "ls"),
        ("qr", "ls,iv"),
    ] {
        let script = format!(
            "ulimit -v 500000; exec '{PROGRAM}' estimate '{path}' --order 1 --estimator {estimator} \
             --solver {solver} --format json"
        );
        let output = Command::new("bash").args(["-c", &script]).output().expect("bash runs");
        assert_eq!(output.status.code(), Some(0), "{solver}: {}", stderr(&output));
        let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        assert_eq!(json["window"], 2_500_000);
        let last = json["estimates"].as_array().expect("estimates").len() - 1;
        let a = json["estimates"][last]["a"][0].as_f64().expect("a");
        assert!((a - 0.8).abs() < 0.01, "{solver}: {a}");
    }
}
