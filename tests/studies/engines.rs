//! Studies on lanes and on faer: what a manifest says, what goes together, what replays compare.

use super::{Contents, Place, assert_same, blocks, contents, stderr, stdout, succeeds};
use asobench::lanes::Isa;
use serde_json::Value;
use std::process::Output;

/// Everything that lanes can be asked for.
const COVERED: &str = r#"
seed = 5
trials = 400
store = "trials"
parameters = true
curves = true
measures = ["e_a", "e_b", "e_x_max", "e_x_rms", "condition"]
compare = [["iv(2)", "ls"]]
[settings]
plant = "mine"
horizon = 110
eta = [2, 30]
window = [6, 50]
[plants.mine]
a = [-0.7, 1.5]
b = [1.0, 0.5]
[[methods]]
estimator = "iv"
iterations = 2
[[slopes]]
measure = "e_a"
over = "window"
[[bounds]]
measure = "e_b"
rounding = 100
"#;

/// A folder with `covered.toml`, and `mixed.toml` whose second half has feedback.
fn place() -> Place {
    let place = Place::new();
    place.write("covered.toml", COVERED.as_bytes());
    let mixed = COVERED.replace("eta = [2, 30]", "feedback = [\"none\", \"f\"]");
    let mixed = format!("{mixed}[feedbacks.f]\nnumerator = [0.1]\n");
    place.write("mixed.toml", mixed.as_bytes());
    place
}

/// Runs a study to its end: its files.
fn results(place: &Place, file: &str, out: &str, more: &[&str]) -> Contents {
    let arguments = [&["run", file, "--out", out], more].concat();
    succeeds(&place.run(&arguments));
    contents(&place.path(out))
}

fn json(contents: &Contents, name: &str) -> Value {
    serde_json::from_slice(&contents[name]).expect("JSON")
}

/// Lanes in one cell, faer in the other: the manifest says so, and names the instructions that bits depend on.
#[test]
fn a_manifest_says_what_computed() {
    let place = place();
    let instructions = asobench::study::Engine::faer_instructions();
    for (file, flag, asked, engine, by_faer) in [
        ("covered.toml", "auto", "auto", Value::from("lanes"), false),
        ("covered.toml", "lanes", "lanes", Value::from("lanes"), false),
        ("covered.toml", "faer", "faer", Value::from("faer"), true),
        (
            "mixed.toml",
            "auto",
            "auto",
            Value::from(vec!["lanes", "lanes", "faer", "faer"]),
            true,
        ),
        ("everything.toml", "auto", "auto", Value::from("faer"), true),
    ] {
        let out = format!("{flag}-{file}");
        let found = results(&place, file, &out, &["--trials", "20", "--engine", flag]);
        let manifest = json(&found, "manifest.json");
        assert_eq!(manifest["engine"], engine, "{out}");
        assert_eq!(manifest["experiment"]["engine"], asked, "{out}");
        let expected = if by_faer {
            Value::from(instructions)
        } else {
            Value::Null
        };
        assert_eq!(manifest["faer_instructions"], expected, "{out}");
    }
    // The flag is the file's key.
    let by_flag = results(&place, "covered.toml", "flag", &["--trials", "20", "--engine", "faer"]);
    let by_key = results(
        &place,
        "covered.toml",
        "key",
        &["--trials", "20", "--set", "engine=faer"],
    );
    assert_same(&by_flag, &by_key, "--set engine=faer");
    let lanes = ["run", "mixed.toml", "--engine", "lanes"];
    place.refuses(&lanes, &["mixed.toml", "engine", "feedback", "cell 2"]);
    let wrong = ["run", "covered.toml", "--engine", "fast"];
    place.refuses(&wrong, &["--engine", "'fast'", "auto", "lanes", "faer"]);
}

/// Threads, blocks and extensions change a study on lanes as little as one on faer: not at all.
#[test]
fn threads_blocks_and_extensions_move_no_bit_of_lanes() {
    let place = place();
    let expected = results(&place, "covered.toml", "first", &["--threads", "1"]);
    for (threads, block) in [("2", "7"), ("5", "64"), ("1", "1000"), ("2", "399"), ("2", "1")] {
        let out = format!("out-{threads}-{block}");
        let more = ["--threads", threads, "--block", block];
        let found = results(&place, "covered.toml", &out, &more);
        assert_same(&found, &expected, &out);
    }
    let part = ["--trials", "133", "--block", "11"];
    results(&place, "covered.toml", "extended", &part);
    let found = results(&place, "covered.toml", "extended", &["--block", "5"]);
    assert_same(&found, &expected, "extended");
    // Some trials failed, some solves were done again: they are in the tallies that must not change.
    let summary = String::from_utf8(expected["summary.json"].clone()).expect("UTF-8");
    assert!(summary.contains("unstable"), "{summary}");
}

/// The two engines' bits do not mix in a folder.
#[test]
fn another_engine_cannot_go_on_with_a_folder() {
    let place = place();
    for (first, second) in [
        ("lanes", "faer"),
        ("faer", "lanes"),
        ("auto", "faer"),
        ("auto", "lanes"),
    ] {
        let out = format!("{first}-{second}");
        let before = results(&place, "covered.toml", &out, &["--trials", "20", "--engine", first]);
        let there = blocks(&place.path(&out));
        let again = [
            "run",
            "covered.toml",
            "--out",
            &out,
            "--trials",
            "40",
            "--engine",
            second,
        ];
        place.refuses(&again, &[out.as_str(), "engine"]);
        assert_same(&contents(&place.path(&out)), &before, "refused");
        assert_eq!(blocks(&place.path(&out)), there);
        // The same one goes on.
        results(&place, "covered.toml", &out, &["--trials", "40", "--engine", first]);
    }
}

/// A replay computes rows as the study did.
#[test]
fn replays_of_lanes_equal_what_is_stored() {
    let place = place();
    for engine in ["lanes", "faer", "auto"] {
        results(&place, "covered.toml", engine, &["--trials", "30", "--engine", engine]);
        for which in ["0:0", "0:29", "1:7", "2:13", "3:28"] {
            let text = stdout(&place.run(&["replay", engine, which]));
            let equal = "These rows equal, bit for bit, those stored in";
            assert!(text.contains(equal), "{engine} {which}: {text}");
            let output = place.run(&["replay", engine, which, "--format", "json"]);
            succeeds(&output);
            let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
            assert_eq!(json["equal_to_stored"], true, "{engine} {which}");
        }
    }
    // The engines' rows differ in their last bits, so that the comparison is one.
    let [lanes, faer] = ["lanes", "faer"].map(|engine| {
        let output = place.run(&["replay", engine, "1:7", "--format", "json"]);
        let json: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        json["rows"].clone()
    });
    assert_ne!(lanes, faer);
    let e_a = |rows: &Value| rows[2]["e_a"].as_f64().expect("a number");
    assert!((e_a(&lanes) / e_a(&faer) - 1.0).abs() < 1e-6);
}

/// Runs the program with a word for its instruction set.
fn under(place: &Place, word: &str, arguments: &[&str]) -> Output {
    let mut command = place.command(arguments);
    command.env("ASOBENCH_INSTRUCTIONS", word);
    command.output().expect("the program runs")
}

/// The files of a study, what theory says of it, and models of a record, are the same bytes under each instruction set:
/// those of lanes and of theory on every machine, those of continuous time where the platform's sine is the same, those
/// of faer on this one, as it chooses its own.
#[test]
fn every_instruction_set_leaves_the_same_bytes() {
    let place = place();
    succeeds(&place.run(&["new", "--continuous", "continuous"]));
    let record = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/record.csv");
    let names = "ls,arx,iv,sriv,riv,oe,armax,bj,pem,moesp,n4sid,cva,wnsf,kernel-fir,rls,recursive-iv";
    let estimate = [
        "estimate",
        record,
        "--estimator",
        names,
        "--order",
        "2",
        "--ts",
        "1",
        "--format",
        "json",
    ];
    let everything = |isa: Isa| {
        let word = isa.name();
        let mut all = Contents::new();
        for file in ["covered", "mixed", "continuous"] {
            let (toml, out) = (format!("{file}.toml"), format!("{file}-{word}"));
            let run = ["run", &toml, "--out", &out, "--trials", "40"];
            succeeds(&under(&place, word, &run));
            for (name, bytes) in contents(&place.path(&out)) {
                all.insert(format!("{file}/{name}"), bytes);
            }
        }
        for command in [&["theory", "covered.toml", "--format", "json"][..], &estimate] {
            let output = under(&place, word, command);
            assert!(output.status.code() < Some(2), "{}", stderr(&output));
            all.insert(command[0].to_owned(), output.stdout);
        }
        all
    };
    let expected = everything(Isa::Portable);
    assert!(expected.len() > 10 && expected["estimate"].len() > 10_000);
    let here = Isa::ALL.iter().filter(|isa| isa.is_here());
    for isa in here.filter(|isa| **isa != Isa::Portable) {
        assert_same(&everything(*isa), &expected, isa.name());
    }
}

/// Shards of a study of lanes by different instruction sets are merged to the bytes of one machine.
#[test]
fn shards_of_different_instruction_sets_have_the_bytes_of_a_run() {
    let place = place();
    let expected = results(&place, "covered.toml", "run", &["--trials", "40"]);
    succeeds(&place.run(&["plan", "covered.toml", "--shards", "3", "--trials", "40"]));
    let here: Vec<&Isa> = Isa::ALL.iter().filter(|isa| isa.is_here()).collect();
    for (number, isa) in (1..=3).zip(here.iter().cycle()) {
        let shard = format!("{number}/3");
        let arguments = ["shard", "covered.plan.json", &shard];
        succeeds(&under(&place, isa.name(), &arguments));
    }
    let merge = ["merge", "covered.plan.json", "--out", "merged"];
    succeeds(&under(&place, here[0].name(), &merge));
    assert_same(&contents(&place.path("merged")), &expected, "merged");
}

#[test]
fn an_instruction_set_that_is_not_there_is_an_error() {
    let place = Place::new();
    let line = |word: &str| {
        let output = under(&place, word, &["methods"]);
        (output.status.code(), stderr(&output))
    };
    let (code, text) = line("avx9");
    assert_eq!((code, text.lines().count()), (Some(2), 1));
    for word in ["ASOBENCH_INSTRUCTIONS", "avx9", "portable", "avx2", "avx512"] {
        assert!(text.contains(word), "{text}");
    }
    for isa in Isa::ALL {
        let (code, text) = line(isa.name());
        let expected = if isa.is_here() { 0 } else { 2 };
        assert_eq!(code, Some(expected), "{isa}: {text}");
        assert_eq!(text.contains("this machine has no"), !isa.is_here());
    }
    // An empty word is none.
    assert_eq!(line("").0, Some(0));
}
