//! `study-from`, and what it writes: inputs and noises from files.

use super::{Place, assert_same, contents, stdout, succeeds};
use asobench::data::Realisation;
use asobench::study::Experiment;
use asobench::study::file::{ExperimentFile, FileError};
use serde_json::Value;
use std::fmt::Write as _;

/// `y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2) + e(k)` of numbers that a linear congruence makes; with `gain`
/// in the loop `u = r - gain y`.
fn record(samples: usize, gain: f64) -> String {
    let mut state = 12_345_u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24) - 0.5
    };
    let (mut text, mut u, mut y) = ("u,y\n".to_owned(), [0.0; 2], [0.0; 2]);
    for _ in 0..samples {
        let now = 1.5 * y[0] - 0.7 * y[1] + u[0] + 0.5 * u[1] + 4.0 * uniform();
        let sign = if uniform() > 0.0 { 1.0 } else { -1.0 };
        (y, u) = ([now, y[0]], [sign - gain * now, u[0]]);
        // Writing to a string does not fail.
        let _ = writeln!(text, "{},{now}", u[0]);
    }
    text
}

/// A study whose input is `mine.csv`, on both engines; 40 samples.
const GIVEN: &str = r#"
trials = 300
store = "trials"
measures = ["e_a", "e_g", "fit_fresh"]
parameters = true

[settings]
plant = "mine"
noise = "coloured"
x0 = "plant"
input = "file:mine.csv#in"
window = [30, 40]
eta_over = "absolute"
eta = 25

[plants.mine]
A = [1, -1.5, 0.7]
B = [0, 1, 0.5]
x0 = [1, -2]

[noises.coloured]
C = [1, 0.5]
D = [1, -0.9]

[[methods]]
estimator = "iv"
iterations = 2
"#;

fn table() -> String {
    let rows = (0..40).map(|k| format!("{},{}\n", k, f64::from((k * 7) % 5) - 1.5));
    "t,in\n".to_owned() + &rows.collect::<String>()
}

fn given() -> (ExperimentFile, Vec<f64>) {
    let mut file = ExperimentFile::parse(GIVEN).expect("a file");
    let u: Vec<f64> = (0..40).map(|k| f64::from((k * 7) % 5) - 1.5).collect();
    file.columns.insert("file:mine.csv#in".to_owned(), u.clone());
    (file, u)
}

/// Every trial is `y = y0 + 0.25 f`: y0 by the difference equation from x(0) = (y0(0), y0(1) - b_1 u(0)), f by that of
/// the noise from white numbers of variance 1.
#[test]
fn a_trial_with_a_given_input_obeys_the_equations() {
    let (file, u) = given();
    let experiment = Experiment::new(file).expect("a study");
    let cell = experiment.cells[1].discrete().expect("records");
    let mut squares = 0.0;
    for trial in 0..200 {
        let mut drawn = Realisation::default();
        cell.realise(experiment.file.seed, trial, &mut drawn);
        assert_eq!((&drawn.u, cell.horizon), (&u, 40));
        let mut y0 = vec![1.0, -2.0];
        for k in 2..40 {
            y0.push(1.5 * y0[k - 1] - 0.7 * y0[k - 2] + u[k - 1] + 0.5 * u[k - 2]);
        }
        // x_2(0) is y0(1) without u(0).
        let mut response = 0.0;
        let mut before = 0.0;
        for k in 1..40 {
            // The impulse response of h: what b_1 u(0) = u(0) adds at k = 1.
            let now = if k == 1 { u[0] } else { 1.5 * response - 0.7 * before };
            (before, response) = (response, now);
            y0[k] += now;
        }
        for k in 0..40 {
            let error = drawn.y[k] - (y0[k] + 0.25 * drawn.f[k]);
            assert!(error.abs() < 1e-12 * 100.0, "k = {k}: {error}");
        }
        // w is what the noise's equation leaves: w(k) = f(k) - 0.9 f(k-1) - 0.5 w(k-1), from an unknown w(0) that
        // fades.
        let mut w = 0.0;
        for k in 1..40 {
            w = drawn.f[k] - 0.9 * drawn.f[k - 1] - 0.5 * w;
            if k >= 20 {
                squares += w * w;
            }
        }
    }
    // 4,000 squares of white numbers of variance 1; 4.5 standard errors.
    assert!(
        (squares / 4000.0 - 1.0).abs() < 4.5 * (2.0 / 4000.0_f64).sqrt(),
        "{squares}"
    );
}

/// The bits do not depend on threads or stops, results need the CSV file no longer, and a changed one is not mixed in.
#[test]
fn a_given_input_is_part_of_the_design() {
    let place = Place::new();
    place.write("study.toml", GIVEN.as_bytes());
    place.write("mine.csv", table().as_bytes());
    for (folder, threads, block) in [("one", "1", "300"), ("three", "3", "37")] {
        succeeds(&place.run(&[
            "run",
            "study.toml",
            "--out",
            folder,
            "--threads",
            threads,
            "--block",
            block,
        ]));
    }
    assert_same(
        &contents(&place.path("one")),
        &contents(&place.path("three")),
        "threads and blocks",
    );
    succeeds(&place.run(&["run", "study.toml", "--out", "short", "--trials", "100"]));
    succeeds(&place.run(&["run", "study.toml", "--out", "short"]));
    assert_same(
        &contents(&place.path("one")),
        &contents(&place.path("short")),
        "an extension",
    );
    succeeds(&place.run(&["plan", "study.toml", "--shards", "2"]));
    for shard in ["1", "2"] {
        succeeds(&place.run(&["shard", "study.plan.json", shard]));
    }
    succeeds(&place.run(&["merge", "study.plan.json", "--out", "merged"]));
    assert_same(
        &contents(&place.path("one")),
        &contents(&place.path("merged")),
        "shards",
    );
    let theory = place.run(&["theory", "study.toml"]);
    assert!(
        stdout(&theory).contains("no theory: the input is given sample by sample"),
        "{}",
        stdout(&theory)
    );
    place.write("mine.csv", table().replace(".5\n", ".25\n").as_bytes());
    place.refuses(
        &["run", "study.toml", "--out", "one"],
        &["another design", "columns.file:mine.csv#in"],
    );
    std::fs::remove_file(place.path("mine.csv")).expect("the file");
    place.refuses(&["run", "study.toml", "--out", "one"], &["mine.csv", "No such file"]);
    succeeds(&place.run(&["replay", "one", "1:7"]));
    succeeds(&place.run(&["report", "one", "--out", "page"]));
    succeeds(&place.run(&["run", "one/manifest.json", "--out", "again"]));
    assert_same(
        &contents(&place.path("one")),
        &contents(&place.path("again")),
        "a manifest",
    );
}

#[test]
fn mistakes_with_given_inputs_are_told() {
    let place = Place::new();
    place.write("mine.csv", table().as_bytes());
    place.write("text.csv", b"in\n1\nx\n");
    place.write("same.csv", b"e\n2\n2\n");
    for (from, to, parts) in [
        ("[30, 40]", "41", &["window", "N = 41", "has 40"][..]),
        (
            "window = [30, 40]",
            "window = 30\nhorizon = 50",
            &["horizon", "K = 50", "has 40"],
        ),
        ("mine.csv#in", "none.csv#in", &["input", "none.csv", "No such file"]),
        ("mine.csv#in", "mine.csv", &["input", "mine.csv", "no column 'u'"]),
        ("mine.csv#in", "text.csv#in", &["text.csv", "line 3, column in", "'x'"]),
        (
            "\"file:mine.csv#in\"",
            "\"colored\"",
            &["input", "did you mean 'coloured'"],
        ),
        ("eta = 25", "eta = 25\namplitude = 2", &["amplitude", "means nothing"]),
        ("\"absolute\"", "\"nominal\"", &["settings", "'exact' or 'absolute'"]),
        (
            "eta = 25",
            "eta = 25\neta_of = \"measured\"",
            &["settings", "eta_of", "noise-free"],
        ),
        (
            "C = [1, 0.5]",
            "residuals = \"same.csv\"\nC = [1]",
            &["noises.coloured.residuals", "file:PATH#COLUMN"],
        ),
        (
            "C = [1, 0.5]",
            "residuals = \"file:same.csv#e\"\nC = [1]",
            &["noises.coloured.residuals", "not all the same"],
        ),
    ] {
        let text = GIVEN.replacen(from, to, 1);
        assert_ne!(text, GIVEN);
        place.write("bad.toml", text.as_bytes());
        place.refuses(&["check", "bad.toml"], parts);
    }
    let error = ExperimentFile::parse(GIVEN)
        .and_then(Experiment::new)
        .err()
        .map(|e: FileError| e.to_string());
    assert!(error.is_some_and(|e| e.contains("was not read")));
    // Lanes take a given input, and no filtered one, nor noise that is drawn.
    let lanes = |from: &str, to: &str| {
        let text = format!("engine = \"lanes\"\n{}", GIVEN.replacen(from, to, 1));
        let mut file = ExperimentFile::parse(&text).expect("a file");
        for column in ["in", "e"] {
            file.columns.insert(format!("file:mine.csv#{column}"), given().1);
        }
        Experiment::new(file).err().map(|e| e.to_string())
    };
    assert_eq!(lanes("", ""), None);
    let filtered = lanes("input = \"file:mine.csv#in\"", "input = \"coloured\"");
    assert!(filtered.is_some_and(|e| e.contains("an input through a filter")));
    let drawn = lanes(
        "[noises.coloured]\n",
        "[noises.coloured]\nresiduals = \"file:mine.csv#e\"\n",
    );
    assert!(drawn.is_some_and(|e| e.contains("not Gaussian")));
}

/// The numbers of a list in a TOML or JSON value.
fn numbers(list: &impl serde::Serialize) -> Vec<f64> {
    let list = serde_json::to_value(list).expect("JSON");
    let list = list.as_array().into_iter().flatten();
    list.map(|x| x.as_f64().expect("a number")).collect()
}

/// The written file holds what `estimate` says, and runs; in every mode.
#[test]
fn a_record_becomes_a_study_that_runs() {
    let place = Place::new();
    place.write("open.csv", record(300, 0.0).as_bytes());
    place.write("closed.csv", record(400, 0.5).as_bytes());
    let estimated = place.run(&[
        "estimate",
        "open.csv",
        "--estimator",
        "armax",
        "--orders",
        "na=2,nb=2,nc=1",
        "--format",
        "json",
    ]);
    let estimated: Value = serde_json::from_str(&stdout(&estimated)).expect("JSON");
    let estimated = &estimated["estimates"][0];
    let armax = ["--estimator", "armax", "--orders", "na=2,nb=2,nc=1"];
    let modes: [(&str, &str, &[&str]); 4] = [
        ("fixed", "open.csv", &[]),
        ("spectrum", "open.csv", &["--trial-input", "spectrum"]),
        (
            "residual",
            "open.csv",
            &["--bootstrap", "residual", "--detrend", "mean"],
        ),
        ("loop", "closed.csv", &["--feedback", "0.5"]),
    ];
    for (name, csv, flags) in modes {
        let out = format!("{name}.toml");
        let arguments = [&["study-from", csv, "--out", &out], &armax[..], flags].concat();
        let output = place.run(&arguments);
        succeeds(&output);
        let said = stdout(&output);
        assert!(
            said.lines().count() <= 12 && said.lines().all(|line| line.len() <= 80),
            "{said}"
        );
        assert!(said.contains(&format!("Next: asobench run {out}")), "{said}");
        succeeds(&place.run(&["check", &out]));
        let file = ExperimentFile::read(&place.path(&out)).expect("a file");
        let own = serde_json::to_value(&file.methods[0]).expect("JSON");
        assert_eq!(own["estimator"], "armax", "the model's own method is first");
        if name == "fixed" {
            let (plant, noise) = (&file.plants["record"], &file.noises["record"]);
            let model = &estimated["model"];
            let [a, b] = [&plant.output_polynomial, &plant.input_polynomial].map(|of| numbers_of(of.as_ref()));
            assert_eq!([a.clone(), b], ["A", "B"].map(|key| numbers(&model[key])));
            assert_eq!(numbers_of(noise.moving_average.as_ref()), numbers(&model["C"]));
            assert_eq!(
                (numbers_of(noise.autoregression.as_ref()), numbers_of(plant.x0.as_ref())),
                (a, numbers(&estimated["x0"]))
            );
            let eta = numbers(&file.settings[&asobench::study::file::Key::Eta].values(false));
            let variance = estimated["noise_variance"].as_f64().expect("a number");
            assert_eq!(eta, [100.0 * variance.sqrt()]);
            let (u, own) = (&file.columns["file:fixed-record.csv#u"], record(300, 0.0));
            let own: Vec<f64> = own
                .lines()
                .skip(1)
                .map(|line| line.split(',').next().expect("u").parse().expect("a number"))
                .collect();
            assert_eq!(*u, own);
        }
    }
    let theory = stdout(&place.run(&["theory", "spectrum.toml"]));
    assert!(theory.contains("armax") && !theory.contains("no theory"), "{theory}");
    // The loop's reference is the signs that the record was made with.
    let file = ExperimentFile::read(&place.path("loop.toml")).expect("a file");
    let r = &file.columns["file:loop-record.csv#r"];
    assert!(r.iter().all(|r| (r.abs() - 1.0).abs() < 1e-12), "{r:?}");
    let run = ["run", "loop.toml", "--trials", "3", "--out", "ran"];
    succeeds(&place.run(&run));
    succeeds(&place.run(&["run", "residual.toml", "--trials", "3"]));
}

fn numbers_of(list: Option<&Vec<f64>>) -> Vec<f64> {
    list.cloned().unwrap_or_default()
}

#[test]
fn records_that_make_no_study_are_refused() {
    let place = Place::new();
    place.write("open.csv", record(300, 0.0).as_bytes());
    place.write("closed.csv", record(400, 0.5).as_bytes());
    let grows = (0..60).scan(1.0, |y, k| {
        let row = format!("{},{y}\n", f64::from(k % 3) - 1.0);
        *y = 1.05 * *y + f64::from(k % 3) - 1.0 + 0.01 * f64::from(k % 7);
        Some(row)
    });
    place.write(
        "grows.csv",
        ("u,y\n".to_owned() + &grows.collect::<String>()).as_bytes(),
    );
    place.write("there.toml", b"mine");
    place.write("other-record.csv", b"mine");
    for (arguments, parts) in [
        (
            &["closed.csv", "--order", "2"][..],
            &["closed.csv", "closed loop", "--feedback K", "--open-loop"][..],
        ),
        (
            &["closed.csv", "--order", "2", "--feedback=-5"],
            &["--feedback", "not stable"],
        ),
        (
            &["closed.csv", "--order", "2", "--feedback", "x"],
            &["--feedback", "expected"],
        ),
        (
            &["closed.csv", "--order", "2", "--feedback", "1", "--open-loop"],
            &["--open-loop", "--feedback"],
        ),
        (
            &["grows.csv", "--order", "1", "--open-loop", "--detrend"],
            &["grows.csv", "plant is not stable"],
        ),
        (&["open.csv", "--order", "120"], &["too few for order 120"]),
        (&["open.csv"], &["expected --order"]),
        (&["open.csv", "--order", "1:3"], &["--order", "a range"]),
        (&["open.csv", "--orders", "na=2,nb=2,nk=0"], &["nk = 0"]),
        (
            &["open.csv", "--order", "2", "--delay", "2", "--estimator", "ls"],
            &["ls", "takes the delay out"],
        ),
        (&["open.csv", "--order", "2", "--estimator", "known"], &["known"]),
        (
            &["open.csv", "--order", "2", "--trial-input", "fixd"],
            &["--trial-input", "did you mean 'fixed'"],
        ),
        (&["none.csv", "--order", "2"], &["none.csv", "No such file"]),
        (
            &["open.csv", "--order", "2", "--out", "there.toml"],
            &["there.toml", "already"],
        ),
        (&["open.csv", "--order", "2", "--out", "new.txt"], &["new.txt", ".toml"]),
        (&["open.csv", "--order", "2", "--out", "nowhere/new.toml"], &["nowhere"]),
        (
            &["open.csv", "--order", "2", "--out", "other.toml"],
            &["other-record.csv", "not written by asobench"],
        ),
    ] {
        let mut all = [&["study-from"], arguments].concat();
        if !arguments.contains(&"--out") {
            all.extend(["--out", "new.toml"]);
        }
        place.refuses(&all, parts);
        assert!(!place.path("new.toml").exists() && !place.path("new-record.csv").exists());
    }
    assert_eq!(
        std::fs::read(place.path("other-record.csv")).expect("the file"),
        b"mine"
    );
    assert!(!place.path("other.toml").exists());
}
