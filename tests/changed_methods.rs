//! A study whose file gets another method, or loses one: what is there is kept, and the results are those of a fresh
//! run, byte for byte.

use crate::common::{PROGRAM, stderr, stdout};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// Ten methods of the lanes, and an eleventh.
const LANES: [&str; 11] = [
    "estimator = \"ls\"",
    "name = \"a\"\nestimator = \"iv\"\niterations = 8\nreport = [8]",
    "name = \"b\"\nestimator = \"iv\"\niterations = 9\nreport = [9]",
    "name = \"c\"\nestimator = \"iv\"\niterations = 1\nreport = [1]",
    "name = \"d\"\nestimator = \"iv\"\niterations = 2\nreport = [2]",
    "name = \"e\"\nestimator = \"iv\"\niterations = 3\nreport = [3]",
    "name = \"f\"\nestimator = \"iv\"\niterations = 10\nreport = [10]",
    "name = \"g\"\nestimator = \"iv\"\niterations = 5\nreport = [5]",
    "name = \"h\"\nestimator = \"iv\"\niterations = 6\nreport = [6]",
    "name = \"i\"\nestimator = \"iv\"\niterations = 7\nreport = [7]",
    "name = \"new\"\nestimator = \"iv\"\niterations = 4\nreport = [2, 4]",
];

/// Methods of faer, of which the second has standard errors.
const FAER: [&str; 4] = [
    "estimator = \"iv4\"",
    "name = \"arx\"\nestimator = \"arx\"",
    "name = \"late\"\nestimator = \"iv-delayed\"",
    "estimator = \"ls\"\nsolver = \"qr\"",
];

const HEAD: &str = "trials = 70\nmeasures = [\"e_a\", \"e_b\", \"e_x_rms\", \"condition\"]\nparameters = true\n\
    slopes = [{ measure = \"e_a\", over = \"window\" }]\n\
    bounds = [{ measure = \"e_b\", below = 0.5 }]\n";

const SETTINGS: &str = "[settings]\neta = [0, 40]\nwindow = [50, 98]\n";

/// A file with these methods, in this order.
fn study(head: &str, methods: &[&str]) -> String {
    let methods: Vec<String> = methods
        .iter()
        .map(|method| format!("[[methods]]\n{method}\n"))
        .collect();
    format!("{HEAD}{head}{SETTINGS}{}", methods.concat())
}

fn asobench(folder: &Path, file: &str, arguments: &[&str]) -> Output {
    std::fs::write(folder.join("s.toml"), file).expect("a file");
    let mut command = Command::new(PROGRAM);
    command
        .current_dir(folder)
        .args(["run", "s.toml", "--out"])
        .args(arguments);
    command.output().expect("it runs")
}

fn done(folder: &Path, file: &str, arguments: &[&str]) -> String {
    let output = asobench(folder, file, arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(!stdout(&output).is_empty());
    stderr(&output)
}

/// The files of results, by name, and of blocks; times aside.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    for file in std::fs::read_dir(folder).expect("a folder") {
        let path = file.expect("a file").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            let inside = files(&path).into_iter();
            found.extend(inside.map(|(file, content)| (format!("{name}/{file}"), content)));
        } else {
            found.push((name, std::fs::read(&path).expect("a file")));
        }
    }
    found.sort();
    found
}

fn assert_same(one: &Path, other: &Path, blocks: bool) {
    let names = |of: &[(String, Vec<u8>)]| of.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let kept = |of: Vec<(String, Vec<u8>)>| -> Vec<_> {
        of.into_iter()
            .filter(|(name, _)| blocks || !name.starts_with("blocks/c"))
            .collect()
    };
    let (one, other) = (kept(files(one)), kept(files(other)));
    assert_eq!(names(&one), names(&other));
    for ((name, left), (_, right)) in one.iter().zip(&other) {
        assert!(left == right, "{name}");
    }
}

/// Runs the first file and then the second in one folder, and the second alone in another. Returns what the second
/// said.
fn changed(first: &str, second: &str, blocks: bool) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    done(at, first, &["grown"]);
    let said = done(at, second, &["grown"]);
    done(at, second, &["fresh"]);
    assert_same(&at.join("grown"), &at.join("fresh"), blocks);
    said
}

#[test]
fn an_eleventh_method_is_computed_alone() {
    let (ten, eleven) = (study("", &LANES[..10]), study("", &LANES));
    let said = changed(&ten, &eleven, true);
    assert_eq!(said.lines().next(), Some("the methods changed: 10 kept; computed: new"));
    // In the middle of the list, with the courses of e_x(k), of which the first and the last method's are kept.
    let middle: Vec<&str> = [&LANES[..4], &LANES[10..], &LANES[4..10]].concat();
    let said = changed(
        &study("curves = true\n", &LANES[..10]),
        &study("curves = true\n", &middle),
        true,
    );
    assert!(
        said.starts_with("the methods changed: 10 kept; computed: new\n"),
        "{said}"
    );
    // And with every trial.
    let store = "store = \"trials\"\n";
    let said = changed(&study(store, &LANES[..10]), &study(store, &LANES), false);
    assert!(
        said.starts_with("the methods changed: 10 kept; computed: new\n"),
        "{said}"
    );
}

/// Pairs need the trials of both: they are there, or the old method is computed again, and it says so.
#[test]
fn comparisons_of_old_and_new() {
    let claims =
        "\n[[claims]]\nid = \"R\"\ntext = \"r\"\ntest = { ratio = \"e_a\", of = \"c(1)\", to = \"ls\", below = 2 }\n";
    let before = |store: &str| study(&format!("{store}compare = [[\"c(1)\", \"ls\"]]\n"), &LANES[..10]) + claims;
    let after = |store: &str| {
        study(
            &format!("{store}compare = [[\"new(4)\", \"ls\"], [\"c(1)\", \"ls\"]]\n"),
            &LANES,
        ) + claims
    };
    let kept = "store = \"trials\"\n";
    let said = changed(&before(kept), &after(kept), false);
    assert!(
        said.starts_with("the methods changed: 10 kept; computed: new\n"),
        "{said}"
    );
    // The ratio of two measures of one output is there, whatever comes beside it.
    let ratio = "\n[[claims]]\nid = \"M\"\ntext = \"m\"\n\
        test = { ratio = \"e_a\", of = \"c(1)\", to = \"c(1)\", measure_of_to = \"e_b\", below = 20 }\n";
    let said = changed(&(study("", &LANES[..10]) + ratio), &(study("", &LANES) + ratio), true);
    assert!(
        said.starts_with("the methods changed: 10 kept; computed: new\n"),
        "{said}"
    );
    let said = changed(&before(""), &after(""), true);
    // ls is compared with c, so c goes with it.
    assert!(
        said.contains("8 kept; computed: new; computed again, as a comparison"),
        "{said}"
    );
    assert!(said.contains("keeps them): ls, c\n"), "{said}");
}

/// By faer, with standard errors; a method that is taken out, one that is changed, and another order.
#[test]
fn methods_of_faer_that_come_go_and_change() {
    let of = |methods: &[&str]| study("coverage = true\nengine = \"faer\"\n", methods);
    changed(&of(&FAER[..3]), &of(&FAER), true);
    let said = changed(&of(&FAER), &of(&FAER[1..]), true);
    assert!(said.contains("3 kept; removed from the results: iv4"), "{said}");
    let said = changed(&of(&FAER), &of(&[FAER[3], FAER[1], FAER[0], FAER[2]]), true);
    assert!(said.starts_with("the methods changed: 4 kept\n"), "{said}");
    let other = FAER[3].replace("qr", "lu");
    let said = changed(&of(&FAER), &of(&[FAER[0], FAER[1], &other]), true);
    assert!(
        said.contains("2 kept; computed: ls; removed from the results: late, ls"),
        "{said}"
    );
}

/// A run that was ended, and results that were extended before and after.
#[test]
fn interruptions_and_extensions() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let (ten, eleven) = (study("", &LANES[..10]), study("", &LANES));
    done(at, &ten, &["grown", "--trials", "30", "--block", "7"]);
    done(at, &ten, &["grown", "--block", "16"]);
    // The blocks as they were when the first of them had been replaced.
    let blocks = at.join("grown/blocks");
    let old = files(&blocks);
    done(at, &eleven, &["grown"]);
    let new = files(&blocks);
    let of_first = |of: &[(String, Vec<u8>)]| of.iter().position(|(name, _)| name.starts_with("c00000"));
    let first = of_first(&new).expect("a block");
    done(at, &eleven, &["fresh"]);
    // The looks stay what they were: at 30 and at 70 trials in each of four cells. The fresh folder has one.
    let looks = |folder: &str| -> Value {
        serde_json::from_slice(&std::fs::read(at.join(folder).join("looks.json")).expect("a file")).expect("JSON")
    };
    let trials = |looks: &Value| -> Vec<u64> {
        let looks = looks["looks"].as_array().expect("a list").iter();
        looks.map(|look| look["trials"].as_u64().expect("a number")).collect()
    };
    assert_eq!(
        (trials(&looks("grown")), trials(&looks("fresh"))),
        (vec![120, 280], vec![280])
    );
    std::fs::copy(at.join("fresh/looks.json"), at.join("grown/looks.json")).expect("a file");
    assert_same(&at.join("grown"), &at.join("fresh"), false);

    // A kill before the last block was replaced: old blocks stand beside a new one, and the design names both. The
    // blocks of the new method are those of a study of it alone. Where one of them is lost, its trials are computed
    // again.
    for is_lost in [false, true] {
        let (alone, added) = (format!("alone-{is_lost}"), at.join("grown/added-lanes"));
        done(at, &study("", &LANES[10..]), &[&alone]);
        std::fs::rename(at.join(alone).join("blocks"), &added).expect("a folder");
        if is_lost {
            let there = files(&added);
            let last = there.iter().rfind(|(name, _)| name.starts_with('c')).expect("a block");
            std::fs::remove_file(added.join(&last.0)).expect("a block");
        }
        for (name, content) in old.iter().filter(|(name, _)| *name != new[first].0) {
            std::fs::write(blocks.join(name), content).expect("a file");
        }
        let of_design = |of: &[(String, Vec<u8>)]| {
            let found = of.iter().find(|(name, _)| name == "design.json");
            let mut json: Value = serde_json::from_slice(&found.expect("a design").1).expect("JSON");
            json.as_object_mut().expect("an object").remove("checksum");
            json
        };
        let mut both = of_design(&new);
        both["before"] = of_design(&old);
        std::fs::write(blocks.join("design.json"), asobench::files::sealed(&both)).expect("a file");
        done(at, &eleven, &["grown"]);
        assert_same(&at.join("grown"), &at.join("fresh"), true);
    }
}

/// A run that was ended leaves many blocks of neighbouring trials. Each gets the new method's trials.
#[test]
fn every_block_of_a_run_that_was_ended() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let (ten, eleven) = (study("", &LANES[..10]), study("", &LANES));
    done(at, &ten, &["grown"]);
    let blocks = at.join("grown/blocks");
    for (name, _) in files(&blocks).iter().filter(|(name, _)| name.starts_with('c')) {
        std::fs::remove_file(blocks.join(name)).expect("a block");
    }
    // Blocks of seven trials, as two shards leave them.
    let command = |arguments: &str| {
        let output = Command::new(PROGRAM)
            .current_dir(at)
            .args(arguments.split(' '))
            .output()
            .expect("it runs");
        assert!(output.status.success(), "{}", stderr(&output));
    };
    command("plan s.toml --shards 2");
    command("shard s.plan.json 1 --out shards --block 7");
    command("shard s.plan.json 2 --out shards --block 7");
    let mut copied = 0;
    for (path, content) in files(&at.join("shards")) {
        let name = path.rsplit('/').next().expect("a name");
        if name.starts_with('c') {
            std::fs::write(blocks.join(name), content).expect("a block");
            copied += 1;
        }
    }
    assert!(copied >= 12, "{copied} blocks of four cells");
    done(at, &eleven, &["grown"]);
    done(at, &eleven, &["fresh"]);
    assert_same(&at.join("grown"), &at.join("fresh"), false);
}

/// A change of more than methods, or one that would change the engine's last digits, is refused as before.
#[test]
fn refusals() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let two = study("", &LANES[..2]);
    done(at, &two, &["out"]);
    let before = files(&at.join("out"));
    let refused = |file: &str, arguments: &[&str], part: &str| {
        let output = asobench(at, file, arguments);
        let line = stderr(&output);
        assert_eq!((output.status.code(), line.lines().count()), (Some(2), 1), "{line}");
        assert!(line.contains(part), "{line}");
        assert!(files(&at.join("out")) == before, "nothing was touched");
    };
    refused(
        &study("seed = 5\n", &LANES),
        &["out"],
        "of another design (different: methods, seed ",
    );
    refused(
        &study("", &["estimator = \"oe\""]),
        &["out"],
        "of another design (different: methods)",
    );
    refused(
        &study("", &[LANES[0], LANES[1], "estimator = \"arx\""]),
        &["out"],
        "beside arx",
    );
    refused(
        &study("", &LANES),
        &["out", "--method", "new"],
        "of another design (different: methods)",
    );
}
