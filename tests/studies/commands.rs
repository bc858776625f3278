//! `new`, `check`, `schema`, `replay`, `--set`, and the columns of tables.

use super::{EVERYTHING, Place, assert_same, contents, stderr, stdout, succeeds};
use crate::common::table::Table;
use asobench::study::Experiment;
use asobench::study::file::{ExperimentFile, TrialRule};
use polars_arrow::datatypes::ArrowDataType as DataType;
use serde_json::{Value, json};
use std::path::PathBuf;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_new_study_can_be_checked_and_run() {
    let place = Place::new();
    let output = place.run(&["new", "mine"]);
    succeeds(&output);
    let text = std::fs::read_to_string(place.path("mine.toml")).expect("the file");
    // A second one does not overwrite it.
    place.write("mine.toml", b"title = \"kept\"");
    place.refuses(&["new", "mine"], &["mine.toml", "exists"]);
    place.refuses(&["new", "mine.toml"], &["mine.toml", "exists"]);
    assert_eq!(
        std::fs::read(place.path("mine.toml")).expect("the file"),
        b"title = \"kept\""
    );
    place.refuses(&["new", "nowhere/mine"], &["nowhere/mine.toml", "no folder nowhere"]);
    place.write("mine.toml", text.as_bytes());
    let output = place.run(&["check", "mine.toml"]);
    succeeds(&output);
    for part in [
        "My study",
        "cells     12",
        "outputs   5: ls, iv(1)",
        "1000 in each cell",
        "memory",
        "stores    summaries",
    ] {
        assert!(stdout(&output).contains(part), "no '{part}' in {}", stdout(&output));
    }
    let output = place.run(&["run", "--quick", "mine.toml"]);
    succeeds(&output);
    assert!(stdout(&output).contains("12 cells, 600 trials"), "{}", stdout(&output));
    let summary = contents(&place.path("results/mine-quick"))
        .remove("summary.json")
        .expect("a summary");
    let summary: Value = serde_json::from_slice(&summary).expect("JSON");
    assert_eq!(summary["cells"].as_array().map(Vec::len), Some(12));
    assert_eq!(summary["cells"][0]["trials"], 50);
}

/// The schema in the tree is the program's: `asobench schema > experiments/schema.json`.
#[test]
fn the_schema_is_the_committed_one() {
    let output = Place::new().run(&["schema"]);
    succeeds(&output);
    let committed = std::fs::read_to_string(root().join("experiments/schema.json")).expect("the schema");
    assert!(
        stdout(&output) == committed,
        "asobench schema > experiments/schema.json"
    );
    let schema: Value = serde_json::from_str(&committed).expect("JSON");
    let settings = &schema["properties"]["settings"];
    assert_eq!(settings["additionalProperties"], false);
    assert_eq!(settings["properties"].as_object().map(serde_json::Map::len), Some(33));
}

/// Every experiment of the tree, and its quick variant; small files that begin with the schema's line.
#[test]
fn the_experiments_of_the_tree() {
    let place = Place::new();
    let mut seen = 0;
    for entry in std::fs::read_dir(root().join("experiments")).expect("the folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let file = path.to_str().expect("UTF-8");
        let text = std::fs::read_to_string(&path).expect("the file");
        assert!(text.starts_with("#:schema schema.json\n"), "{file}");
        let output = place.run(&["check", file]);
        assert_eq!(output.status.code(), Some(0), "{file}: {}", stderr(&output));
        assert_eq!(stderr(&output), "", "{file}");
        let quick = ExperimentFile::read(&path).expect("a valid file").quick();
        assert!(
            matches!(quick.trials, TrialRule::Fixed(1..=1000)),
            "{file}: no quick variant"
        );
        if let Err(error) = Experiment::new(quick) {
            panic!("{file}, quick: {error}");
        }
        seen += 1;
    }
    assert!(seen >= 1);
}

const METHODS: &str = r#"
trials = 30
store = "trials"
[settings]
plant = "mine"
noise = ["ar", "white"]
gain = "scaled:0.5"
feedback = "loop"
window = [30, 60]
[plants.mine]
a = [-0.7, 1.5]
h = [1.0, 0.5]
[feedbacks.loop]
numerator = [0.3]
[[methods]]
estimator = "iv"
solver = ["partitioned", "lu", "qr", "svd"]
iterations = 3
report = [0, 3]
[[methods]]
name = "frozen"
auxiliary = "frozen"
stabilise = "reflect"
[[methods]]
name = "literal"
auxiliary = "literal"
initial_state = "zero"
[[methods]]
name = "observer"
drive = "observer"
gain = "scaled:0.3"
[[methods]]
name = "by r"
instruments = "r"
[[methods]]
name = "printed"
stage10 = "as-printed"
[[methods]]
name = "cholesky"
estimator = "ls"
solver = "cholesky"
"#;

#[test]
fn replays_equal_what_is_stored() {
    let place = Place::new();
    place.write("methods.toml", METHODS.as_bytes());
    succeeds(&place.run(&["run", "methods.toml", "--out", "out", "--block", "7"]));
    for which in ["0:0", "0:29", "1:7", "2:13", "3:29"] {
        let output = place.run(&["replay", "out", which]);
        succeeds(&output);
        assert!(
            stdout(&output).contains("These rows equal, bit for bit, those stored in"),
            "{}",
            stdout(&output)
        );
        let output = place.run(&["replay", "out", which, "--format", "json"]);
        let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        assert_eq!(json["equal_to_stored"], true);
        assert_eq!(json["rows"].as_array().map(Vec::len), Some(4 * 2 + 5 * 5 + 1));
    }
    // Beyond what is stored nothing is said to be equal.
    let output = place.run(&["replay", "out", "0:30", "--format", "json"]);
    let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    assert_eq!(json["equal_to_stored"], Value::Null);
    place.refuses(&["replay", "out", "4:0"], &["no cell '4'", "0 to 3"]);
    place.refuses(&["replay", "out", "0"], &["CELL:TRIAL"]);
    place.refuses(&["replay", "out", "0:-1"], &["CELL:TRIAL"]);
    place.refuses(&["replay", "nowhere", "0:0"], &["nowhere", "no results"]);
    // One changed number is seen: another study's trials instead of these.
    place.write("other.toml", METHODS.replace("a = [-0.7", "a = [-0.6").as_bytes());
    succeeds(&place.run(&["run", "other.toml", "--out", "other"]));
    std::fs::copy(place.path("other/trials.parquet"), place.path("out/trials.parquet")).expect("a copy");
    let replay = ["replay", "out", "1:7", "--format", "json"];
    let output = place.run(&replay);
    let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    assert_eq!(json["equal_to_stored"], Value::Null);
    let said = "trials.parquet: damaged: the checksum in manifest.json differs";
    assert!(stderr(&output).contains(said), "{}", stderr(&output));
    place.take_checksums("out");
    let json: Value = serde_json::from_str(&stdout(&place.run(&replay))).expect("JSON");
    assert_eq!(json["equal_to_stored"], false);
}

/// A manifest that was edited by hand tells a replay no more than it holds.
#[test]
fn replays_of_a_damaged_manifest_are_compared_with_nothing() {
    let place = Place::new();
    place.write("methods.toml", METHODS.as_bytes());
    succeeds(&place.run(&["run", "methods.toml", "--out", "out"]));
    let path = place.path("out/manifest.json");
    let mut whole: Value = serde_json::from_slice(&std::fs::read(&path).expect("a file")).expect("JSON");
    // With its checksum, which would no longer be right, it is refused.
    whole.as_object_mut().expect("an object").remove("checksum");
    let compared = |trials: Value| {
        let mut manifest = whole.clone();
        manifest["trials"] = trials;
        std::fs::write(&path, manifest.to_string()).expect("written");
        let output = place.run(&["replay", "out", "2:7", "--format", "json"]);
        let said = stderr(&output);
        let other = said.contains("trials.parquet: damaged: ") && said.contains(" rows; expected ");
        assert_eq!(output.status.code(), Some(i32::from(other)), "{said}");
        let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        json["equal_to_stored"].clone()
    };
    assert_eq!(compared(json!(30)), true);
    assert_eq!(compared(json!([30, 30, 30, 30])), true);
    for trials in [
        json!([]),
        json!([30, 30]),
        json!(["30", 30, 30, 30, 30]),
        json!([30, -1, 30, 30]),
        json!([u64::MAX, u64::MAX, 30, 30]),
        json!([u64::MAX / 2, 0, 30, 30]),
        json!([30, 30, 7, 30]),
        json!(null),
    ] {
        assert_eq!(compared(trials.clone()), Value::Null, "{trials}");
    }
    // A file that ends before the trial.
    assert_ne!(compared(json!([1_000_000_000_000_u64, 0, 30, 30])), true);
}

/// The record of a replay, estimated as a file by the same method, gives the same numbers bit for bit.
#[test]
fn a_replayed_record_can_be_estimated() {
    let place = Place::new();
    succeeds(&place.run(&["run", "everything.toml", "--out", "out", "--trials", "5"]));
    let output = place.run(&["replay", "out", "5:3", "--data", "trial.csv", "--format", "json"]);
    succeeds(&output);
    let replay: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    let estimate = [
        "estimate",
        "trial.csv",
        "--order",
        "2",
        "--window",
        "98",
        "--iterations",
        "2",
        "--format",
        "json",
    ];
    let output = place.run(&estimate);
    succeeds(&output);
    let estimate: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    for pass in 1..=2 {
        let title = format!("Stages 10, 4 and 5, iv pass {pass}: parameters");
        let stages = replay["stages"].as_array().expect("stages");
        let expected = stages.iter().find(|stage| stage["stage"] == *title).expect("the stage");
        for key in ["a", "b", "h"] {
            assert_eq!(
                estimate["estimates"][1]["passes"][pass - 1][key],
                expected[key],
                "pass {pass}, {key}"
            );
        }
    }
}

/// A value of `--set` is as if it stood in the file.
#[test]
fn keys_are_set_as_in_the_file() {
    /// The setting, and the text that it replaces in the file.
    type Case<'a> = (&'a [&'a str], &'a [(&'a str, &'a str)]);
    let place = Place::new();
    let cases: [Case<'_>; 8] = [
        (&["eta=5"], &[("eta = [2, 10]", "eta = 5")]),
        (&["settings.eta = [3, 4.5]"], &[("eta = [2, 10]", "eta = [3, 4.5]")]),
        (
            &["noise=white"],
            &[("noise = [\"ar\", \"coloured\"]", "noise = \"white\"")],
        ),
        (&["noise=[\"ar\",\"white\"]"], &[("\"coloured\"]", "\"white\"]")]),
        (&["methods.1.solver=lu"], &[("solver = \"svd\"", "solver = \"lu\"")]),
        (
            &["methods.1.solver=[\"lu\", \"qr\"]", "compare=[]"],
            &[
                ("solver = \"svd\"", "solver = [\"lu\", \"qr\"]"),
                ("[[\"iv(2)\", \"ls\"], [\"svd\", \"ls\"]]", "[]"),
            ],
        ),
        (
            &["plants.mine.b=[2, 1]", "bounds.0.below=0.2", "seed=7"],
            &[
                ("b = [1.0, 0.5]", "b = [2.0, 1.0]"),
                ("below = 0.1", "below = 0.2"),
                ("seed = 5", "seed = 7"),
            ],
        ),
        (
            &["window={ linspace = [18, 98, 3] }"],
            &[("[18, 50, 98]", "[18, 58, 98]")],
        ),
    ];
    for (i, (sets, replaced)) in cases.into_iter().enumerate() {
        let mut text = EVERYTHING.replace("trials = 400", "trials = 10");
        for (from, to) in replaced {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        place.write("set.toml", text.as_bytes());
        let (written, set) = (format!("written{i}"), format!("set{i}"));
        succeeds(&place.run(&["run", "set.toml", "--out", &written]));
        let mut arguments = vec!["run", "everything.toml", "--trials", "10", "--out", &set];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        succeeds(&place.run(&arguments));
        assert_same(
            &contents(&place.path(&set)),
            &contents(&place.path(&written)),
            &format!("{sets:?}"),
        );
    }
    for (set, parts) in [
        ("etaa=1", ["--set etaa", "did you mean 'eta'"]),
        ("eta", ["--set eta", "KEY=VALUE"]),
        ("seed=x", ["--set seed", "invalid type"]),
        ("methods.7.solver=lu", ["--set methods.7.solver", "no '7'"]),
        ("methods.0.solvr=lu", ["--set methods.0.solvr", "did you mean 'solver'"]),
        ("plants.mine.c=1", ["--set plants.mine.c", "unknown key 'c'"]),
        ("settings.etaa=1", ["--set settings.etaa", "did you mean 'eta'"]),
        ("eta=[]", ["--set eta", "empty list"]),
        ("eta=nan", ["--set eta", "finite"]),
        ("eta=[1, inf]", ["--set eta", "finite"]),
        ("trials=0", ["trials", "1 to 4000000000"]),
        ("seed.x=1", ["--set seed.x", "no 'x'"]),
        ("=1", ["--set", "unknown"]),
        ("methods.0=3", ["--set methods.0", "invalid type"]),
    ] {
        place.refuses(&["check", "everything.toml", "--set", set], &parts);
    }
    for flag in [
        ["--trials", "0"],
        ["--trials", "-1"],
        ["--trials", "5000000000"],
        ["--threads", "0"],
        ["--block", "0"],
    ] {
        let arguments = [&["run", "everything.toml", "--out", "out"], &flag[..]].concat();
        place.refuses(&arguments, &flag);
    }
}

/// The columns of `trials.parquet` before there were experiment files.
fn columns() -> Vec<(&'static str, DataType)> {
    let mut columns = vec![
        ("cell", DataType::Int32),
        ("claim", DataType::Utf8View),
        ("eta", DataType::Float64),
        ("window", DataType::Int32),
        ("trial", DataType::Int64),
        ("estimator", DataType::Utf8View),
        ("pass", DataType::Int32),
        ("status", DataType::Utf8View),
        ("failed_pass", DataType::Int32),
        ("failed_stage", DataType::Int32),
        ("unstable", DataType::Boolean),
        ("unstable_so_far", DataType::Boolean),
    ];
    let figures = [
        "e_a",
        "e_b",
        "e_h",
        "e_x0",
        "e_x_max",
        "e_x_rms",
        "e_a_as_printed",
        "e_b_as_printed",
        "e_h_as_printed",
        "e_x0_as_printed",
        "e_x_max_as_printed",
        "e_x_rms_as_printed",
        "spectral_radius",
        "condition",
    ];
    columns.extend(figures.map(|name| (name, DataType::Float64)));
    columns
}

#[test]
fn tables_have_the_columns_they_had() {
    let place = Place::new();
    succeeds(&place.run(&["reproduce", "--paper", "nikolov", "--trials", "3", "--out", "paper"]));
    let paper = Table::read(&place.path("paper/trials.parquet"));
    assert_eq!(paper.types(), columns());
    assert_eq!(paper.height(), 3 * 3 * 5);

    let grid = root().join("experiments/check-grid.toml");
    let grid = grid.to_str().expect("UTF-8");
    succeeds(&place.run(&["run", grid, "--trials", "3", "--out", "grid"]));
    let grid = Table::read(&place.path("grid/trials.parquet"));
    let mut expected = columns();
    expected.insert(4, ("noise", DataType::Utf8View));
    assert_eq!(grid.types(), expected);
    assert_eq!(grid.height(), 24 * 3 * 5);
    let noise = grid.texts("noise");
    assert_eq!(
        noise.iter().filter(|noise| **noise == Some("white")).count(),
        12 * 3 * 5
    );

    // One row for every cell, output and figure; parameters are figures of their own.
    place.results("everything", &["--trials", "25"]);
    let summary = Table::read(&place.path("everything/summary.parquet"));
    assert_eq!(summary.height(), 12 * 4 * (5 + 4));
    let names: Vec<&str> = summary.types().into_iter().map(|(name, _)| name).collect();
    assert_eq!(
        names[..12],
        [
            "cell",
            "claim",
            "eta",
            "window",
            "noise",
            "estimator",
            "pass",
            "trials",
            "failed",
            "unstable",
            "measure",
            "count",
        ]
    );
}
