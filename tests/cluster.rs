//! Studies in shards from outside: however they are split, stopped, computed twice or damaged, the results are those of
//! one machine.

use crate::common::{PROGRAM, copy, stderr};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Six cells, everything that a summary has, and a cell with one trial.
const STUDY: &str = r#"
title = "A small study"
seed = 5
trials = 200
coverage = true
curves = true
measures = ["e_a", "e_x_rms"]
compare = [["iv(2)", "ls"]]

[settings]
horizon = 110
eta = [2, 10]
window = [18, 50, 98]

[[methods]]
estimator = "iv"
iterations = 2

[[slopes]]
measure = "e_a"
over = "window"
"#;

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let place = Self { folder };
        place.write("study.toml", STUDY);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("a writable file");
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM);
        command
            .args(arguments)
            .current_dir(self.folder.path())
            .stdin(Stdio::null());
        for name in ["SLURM_ARRAY_TASK_ID", "SLURM_CPUS_PER_TASK"] {
            command.env_remove(name);
        }
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program runs")
    }

    /// Runs it to exit code 0; gives what it printed.
    fn done(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    /// Runs it to an exit code; gives what it printed and what it said on stderr.
    fn ends(&self, code: i32, arguments: &[&str]) -> (String, String) {
        let output = self.run(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        (String::from_utf8(output.stdout).expect("UTF-8"), said)
    }

    /// One line of bad input with all parts.
    fn refused(&self, arguments: &[&str], parts: &[&str]) {
        let (printed, said) = self.ends(2, arguments);
        assert_eq!(
            (printed.as_str(), said.lines().count()),
            ("", 1),
            "{arguments:?}: {said}"
        );
        for part in parts {
            assert!(said.contains(part), "{arguments:?}: no '{part}' in: {said}");
        }
    }

    /// Plans so many shards, and computes them all; gives their folders.
    fn shards(&self, count: usize, threads: &str, more: &[&str]) -> Vec<PathBuf> {
        let count = count.to_string();
        let mut arguments = vec!["plan", "study.toml", "--shards", &count];
        arguments.extend(more);
        self.done(&arguments);
        let plan = json(&self.path("study.plan.json"));
        let shards = plan["shards"].as_array().expect("shards").len();
        for i in 1..=shards {
            let i = i.to_string();
            self.done(&["shard", "study.plan.json", &i, "--threads", threads, "--block", "17"]);
        }
        (1..=shards)
            .map(|i| self.path(&format!("study-shards/shard-{i:04}")))
            .collect()
    }
}

fn json(path: &Path) -> Value {
    let text = std::fs::read(path).expect("a file");
    serde_json::from_slice(&text).expect("JSON")
}

/// The files of a folder of results that must have the same bytes: all but the lock, and blocks where the study keeps
/// its trials, which stay where they are.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_file() && ![".lock", "looks.json"].contains(&name.as_str()) {
            found.insert(name, std::fs::read(&path).expect("a file"));
        }
    }
    found
}

fn assert_same(left: &Path, right: &Path, what: &str) {
    let (left, right) = (files(left), files(right));
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<String>>();
    assert_eq!(names(&left), names(&right), "{what}");
    for (name, bytes) in &left {
        assert!(bytes == &right[name], "{what}: {name} differs");
    }
}

fn blocks_in(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(blocks_in(&path));
        } else if path.extension().is_some_and(|extension| extension == "block") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Any number of shards and threads, any order of folders: the files of one machine.
#[test]
fn shards_move_no_bit() {
    for (store, threads) in [("store=trials", "1"), ("store=summaries", "2")] {
        let place = Place::new();
        place.done(&["run", "study.toml", "--out", "one", "--set", store]);
        for (round, count) in [1, 3, 7, 100].into_iter().enumerate() {
            let mut folders = place.shards(count, threads, &["--set", store]);
            let middle = folders.len() / 2;
            folders.rotate_left(middle);
            if round % 2 == 1 {
                folders.reverse();
            }
            let mut arguments = vec!["merge", "study.plan.json", "--out", "merged"];
            arguments.extend(folders.iter().map(|path| path.to_str().expect("UTF-8")));
            // Twice the same is harmless.
            arguments.push(folders[0].to_str().expect("UTF-8"));
            place.done(&arguments);
            let what = format!("{store}, {count} shards, {threads} threads");
            assert_same(&place.path("merged"), &place.path("one"), &what);
            let same_blocks = |folder: &str| {
                let names = blocks_in(&place.path(folder));
                names
                    .iter()
                    .map(|path| std::fs::read(path).expect("a block"))
                    .collect::<Vec<_>>()
            };
            if store == "store=summaries" {
                assert!(same_blocks("merged") == same_blocks("one"), "{what}");
            }
            for folder in ["merged", "study-shards"] {
                std::fs::remove_dir_all(place.path(folder)).expect("removed");
            }
        }
    }
}

/// Blocks that are damaged or of another seed are named and computed again or left; blocks there twice do no harm.
#[test]
fn what_is_damaged_is_missing() {
    let place = Place::new();
    place.done(&["run", "study.toml", "--out", "one"]);
    let folders = place.shards(4, "1", &[]);
    let (plan, merge) = ("study.plan.json", ["merge", "study.plan.json", "--out", "merged"]);
    copy(&folders[1], &place.path("study-shards/copy-of-2"));
    assert!(place.done(&["status", plan]).contains("4 shards: 4 whole"));
    // Another block stands for this one.
    let copied = &blocks_in(&place.path("study-shards/copy-of-2"))[0];
    std::fs::write(copied, "asobench").expect("written");
    let (_, said) = place.ends(0, &["status", plan, "--verify"]);
    assert!(said.contains("copy-of-2") && said.contains("not taken"), "{said}");

    let block = &blocks_in(&folders[2])[0];
    let name = block.file_name().and_then(|name| name.to_str()).expect("UTF-8");
    let bytes = std::fs::read(block).expect("a block");
    std::fs::write(block, &bytes[..bytes.len() - 3]).expect("written");
    let (printed, said) = place.ends(75, &["status", plan, "--verify"]);
    assert!(
        printed.contains("shard 3: ") && printed.contains("run again: shards 3,"),
        "{printed}"
    );
    assert!(said.contains("damaged") && said.contains(name), "{said}");
    let (_, said) = place.ends(75, &merge);
    assert!(said.contains("missing: cell ") && said.contains("shards 3,"), "{said}");
    assert!(!place.path("merged/manifest.json").exists());

    // A block under the name of another one, and a link to one, are named.
    let first = blocks_in(&folders[0])[0].clone();
    let moved = folders[0].join("r/c00000-0000000000-0000000001.block");
    std::fs::create_dir(moved.parent().expect("a folder")).expect("made");
    std::fs::copy(&first, &moved).expect("copied");
    let run = first.with_file_name("run.json");
    std::fs::copy(run, moved.with_file_name("run.json")).expect("copied");
    #[cfg(unix)]
    std::os::unix::fs::symlink(&first, folders[0].join("link.block")).expect("a link");
    let (_, said) = place.ends(75, &["status", plan, "--verify"]);
    assert!(
        said.contains("c00000-0000000000-0000000001.block: has the name of another block, not taken"),
        "{said}"
    );
    #[cfg(unix)]
    assert!(said.contains("link.block: not a file or a folder but a link"), "{said}");
    std::fs::remove_dir_all(moved.parent().expect("a folder")).expect("removed");
    place.write("other.toml", &STUDY.replace("seed = 5", "seed = 6"));
    place.done(&["plan", "other.toml", "--shards", "1"]);
    place.done(&["shard", "other.plan.json", "1"]);
    copy(&place.path("other-shards"), &place.path("study-shards/other"));
    let (_, said) = place.ends(75, &["status", plan, "--verify"]);
    assert!(said.contains("of another experiment or version, not taken"), "{said}");

    place.done(&["shard", plan, "3/4"]);
    place.done(&["status", plan, "--verify"]);
    place.done(&merge);
    assert_same(&place.path("merged"), &place.path("one"), "after all");

    // A damaged block in the folder of the results: `merge` has no --repair, which `run` has.
    let block = &blocks_in(&place.path("merged"))[0];
    let bytes = std::fs::read(block).expect("a block");
    std::fs::write(block, &bytes[..bytes.len() - 3]).expect("written");
    let output = place.run(&merge);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("remove this file") && !said.contains("--repair"),
        "{said}"
    );
    let output = place.run(&["run", "study.toml", "--out", "merged"]);
    assert!(
        stderr(&output).contains("--repair computes it again"),
        "{}",
        stderr(&output)
    );
}

/// Two processes at the same shard at once.
#[test]
fn a_shard_is_computed_twice_at_once() {
    let place = Place::new();
    place.done(&["run", "study.toml", "--out", "one", "--trials", "2000"]);
    place.done(&["plan", "study.toml", "--shards", "1", "--trials", "2000"]);
    let start = |block: &str| {
        let arguments = ["shard", "study.plan.json", "1", "--block", block];
        let mut command = place.command(&arguments);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().expect("the program runs")
    };
    let both = ["13", "29", "40"].map(start);
    for child in both {
        let output = child.wait_with_output().expect("ended");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    place.done(&["merge", "study.plan.json", "--out", "merged"]);
    assert_same(&place.path("merged"), &place.path("one"), "three at once");
}

/// Partial results say that they are, even where a cell has no trial; later the whole ones take their place.
#[test]
fn partial_results_say_so() {
    for store in ["store=trials", "store=summaries"] {
        let place = Place::new();
        // Six cells of one trial each, so that some get none.
        let study = ["--set", store, "--trials", "1"];
        place.done(&[&["run", "study.toml", "--out", "one"][..], &study].concat());
        assert_eq!(place.shards(9, "2", &study).len(), 6);
        let folders = [
            "study-shards/shard-0001",
            "study-shards/shard-0002",
            "study-shards/shard-0004",
        ];
        let mut arguments = vec!["merge", "study.plan.json", "--out", "merged", "--partial"];
        arguments.extend(folders);
        let printed = place.done(&arguments);
        assert!(printed.contains("Partial results: "), "{printed}");
        let (manifest, summary) = ("merged/manifest.json", "merged/summary.json");
        for file in [manifest, summary] {
            assert_eq!(json(&place.path(file))["partial"], true, "{file}");
        }
        let trials = &json(&place.path(manifest))["trials"];
        assert_eq!(trials[5], 0, "{trials}");
        place.done(&["report", "merged"]);
        let page = std::fs::read_to_string(place.path("merged/report.html")).expect("a page");
        assert!(page.contains("Partial results: "));
        place.done(&["merge", "study.plan.json", "--out", "whole"]);
        assert_same(&place.path("whole"), &place.path("one"), store);
        std::fs::remove_dir_all(place.path("merged")).expect("removed");
        place.done(&arguments);
        place.done(&["merge", "study.plan.json", "--out", "merged"]);
        assert_same(&place.path("merged"), &place.path("one"), store);
    }
}

/// Claims that compare cells trial by trial, of which some have gaps or no trials.
#[test]
fn partial_results_of_shipped_studies_can_be_judged() {
    let place = Place::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    for name in ["window", "c2-c3", "closed-loop"] {
        let file = root.join(format!("{name}.toml"));
        let file = file.to_str().expect("UTF-8");
        let plan = format!("{name}.plan.json");
        place.done(&["plan", file, "--shards", "10", "--trials", "40"]);
        for shard in ["2", "5"] {
            place.done(&["shard", &plan, shard]);
        }
        place.done(&["merge", &plan, "--out", name, "--partial"]);
        place.done(&["report", name]);
    }
}

#[test]
fn bad_input_is_one_line() {
    let place = Place::new();
    place.done(&["plan", "study.toml", "--shards", "3"]);
    let plan = "study.plan.json";
    let text = std::fs::read_to_string(place.path(plan)).expect("a plan");
    place.write(
        "old.plan.json",
        &text.replacen("\"version\":\"", "\"version\":\"0.0.", 1),
    );
    place.refused(
        &["shard", "old.plan.json", "1"],
        &["old.plan.json", "made by asobench 0.0.", "plan again"],
    );
    place.write("edited.plan.json", &text.replace("\"seed\":5", "\"seed\":6"));
    place.refused(
        &["shard", "edited.plan.json", "1"],
        &["edited.plan.json", "the checksum differs", "plan again"],
    );
    let unsealed = text.split(",\"checksum\"").next().expect("a beginning");
    place.write("unsealed.plan.json", &format!("{unsealed}}}"));
    place.refused(
        &["status", "unsealed.plan.json"],
        &["unsealed.plan.json", "an older build", "plan again"],
    );
    place.write("cut.plan.json", &text[..text.len() / 2]);
    place.refused(&["merge", "cut.plan.json"], &["cut.plan.json", "not a plan"]);
    place.refused(&["status", "study.toml"], &["study.toml", "not a plan"]);
    place.refused(&["status", "none.plan.json"], &["none.plan.json", "No such file"]);
    for shard in ["0", "4", "x", "1/4"] {
        place.refused(&["shard", plan, shard], &[shard, "the shards 1 to 3"]);
    }
    place.refused(&["shard", plan], &["a shard's number", "SLURM_ARRAY_TASK_ID"]);
    let mut command = place.command(&["shard", plan]);
    let output = command.env("SLURM_ARRAY_TASK_ID", "7").output().expect("runs");
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("SLURM_ARRAY_TASK_ID '7': no such shard"));
    place.refused(&["shard", plan, "1", "--out", "not/there"], &["not: no such folder"]);
    place.refused(&["merge", plan, "nowhere"], &["nowhere", "No such file"]);
    place.refused(
        &["shard", plan, "1", "--time-limit", "90"],
        &["--time-limit", "90s, 30m"],
    );
    place.refused(
        &["plan", "study.toml", "--shards", "3", "--target-time", "1h"],
        &["--shards", "--target-time"],
    );
    // 5000 samples in each of 4.8e11 trials: 1e9 samples in a second would still be 2.4e6 shards.
    let endless = STUDY
        .replace("trials = 200", "trials = 4000000000")
        .replace("horizon = 110", "horizon = 5000")
        .replace("eta = [2, 10]", "eta = { linspace = [1, 40, 40] }")
        .replace("window = [18, 50, 98]", "window = [1000, 2000, 4000]");
    place.write("endless.toml", &endless);
    place.refused(
        &["plan", "endless.toml", "--target-time", "1s"],
        &["--target-time", "at most 1000000", "--shards"],
    );
    place.refused(&["plan", "-"], &["--out"]);

    // Two plans in one folder.
    place.write("other.toml", &STUDY.replace("seed = 5", "seed = 6"));
    place.refused(
        &["plan", "other.toml", "--out", plan],
        &[plan, "the plan of another design"],
    );
    place.done(&["shard", plan, "1"]);
    place.done(&["plan", "other.toml", "--shards", "3"]);
    let arguments = ["shard", "other.plan.json", "1", "--out", "study-shards"];
    place.refused(&arguments, &["study-shards/shard-0001", "runs of another design"]);
}

/// SIGTERM and --time-limit end with 75, one line that says how to go on, and what is finished.
#[test]
#[cfg(unix)]
fn stopped_shards_run_again() {
    let place = Place::new();
    place.done(&["plan", "study.toml", "--shards", "1", "--trials", "100000000"]);
    let missing = || {
        let (printed, _) = place.ends(75, &["status", "study.plan.json"]);
        let line = printed.lines().find(|line| line.contains("shard 1: "));
        let count = line.and_then(|line| line.split_whitespace().nth(2)?.parse::<u64>().ok());
        count.expect("a number")
    };
    let all = missing();
    let arguments = ["shard", "study.plan.json", "1", "--block", "50", "--threads", "2"];
    let mut child = place.command(&arguments).stderr(Stdio::piped()).spawn().expect("runs");
    let begin = Instant::now();
    let shards = place.path("study-shards");
    while !shards.exists() || blocks_in(&shards).len() < 3 {
        assert!(begin.elapsed() < Duration::from_mins(1), "no block");
        std::thread::sleep(Duration::from_millis(20));
    }
    let pid = child.id().to_string();
    Command::new("kill").args(["-TERM", &pid]).status().expect("kill");
    let code = child.wait().expect("ended").code();
    let output = child.wait_with_output().expect("ended");
    assert_eq!(code, Some(75), "{}", stderr(&output));
    let said = stderr(&output);
    let line = "stopped, run again: asobench shard study.plan.json 1/1";
    assert!(said.lines().count() == 1 && said.contains(line), "{said}");
    let after = missing();
    assert!(after < all, "{after} of {all}");
    let mut limited = arguments.to_vec();
    limited.extend(["--time-limit", "1s"]);
    place.ends(75, &limited);
    assert!(missing() < after);
}

/// The same plan command again is the next round, to the same results as one machine's.
#[test]
fn rules_are_met_in_rounds() {
    let place = Place::new();
    let rule = r#"trials={until="e_a",output="iv(2)",relative_mcse=0.1,minimum=20,maximum=300}"#;
    place.done(&["run", "study.toml", "--out", "one", "--set", rule]);
    let mut rounds = 0;
    loop {
        place.shards(3, "2", &["--set", rule]);
        rounds += 1;
        let output = place.run(&["merge", "study.plan.json", "--out", "merged"]);
        if output.status.code() == Some(0) {
            break;
        }
        assert_eq!(output.status.code(), Some(75), "{}", stderr(&output));
        assert!(stderr(&output).contains("by the rule 'trials'"), "{}", stderr(&output));
        assert!(rounds < 9);
    }
    let trials = json(&place.path("one/manifest.json"))["trials"].clone();
    assert!(rounds > 1 && trials.is_array(), "{rounds} rounds, {trials}");
    assert_same(&place.path("merged"), &place.path("one"), "in rounds");
    assert_eq!(blocks_in(&place.path("merged")).len(), 6);
    let printed = place.done(&["plan", "study.toml", "--set", rule]);
    assert!(printed.contains("nothing is missing"), "{printed}");
}

/// Bits of faer on machines of two kinds are only put together when that is asked for.
#[test]
fn bits_of_two_machines_are_not_mixed() {
    let place = Place::new();
    let folders = place.shards(3, "1", &["--set", "engine=faer"]);
    let run = |shard: &Path| {
        let entry = std::fs::read_dir(shard).expect("a folder").next();
        entry.expect("a run").expect("a run").path().join("run.json")
    };
    let mut other = json(&run(&folders[1]));
    let here = other["faer_instructions"].as_str().expect("text").to_owned();
    other["faer_instructions"] = "abacus".into();
    // With its checksum, which is no longer right, it says nothing.
    other.as_object_mut().expect("an object").remove("checksum");
    std::fs::write(run(&folders[1]), other.to_string()).expect("written");
    let merge = ["merge", "study.plan.json", "--out", "merged"];
    place.refused(&merge, &["abacus", &here, "--mix-instructions"]);
    let mut mixed = merge.to_vec();
    mixed.push("--mix-instructions");
    place.done(&mixed);
    let kinds = json(&place.path("merged/manifest.json"))["faer_instructions"].clone();
    assert!(
        kinds
            .as_str()
            .is_some_and(|isa| isa.contains("abacus+") || isa.contains("+abacus")),
        "{kinds}"
    );
    // Blocks of another machine do not count here; when this one has computed them, its own suffice.
    place.done(&["shard", "study.plan.json", "2"]);
    place.done(&merge);
    assert_eq!(json(&place.path("merged/manifest.json"))["faer_instructions"], *here);
}

/// Job scripts are the shell's, the user's once they are there, and submitted in order.
#[test]
#[cfg(unix)]
fn job_scripts_are_written_and_submitted() {
    use crate::common::executable;
    let place = Place::new();
    place.write(
        "slurm.toml",
        "partition = \"long\"\nmem = \"1G\"\narray-limit = 2\noptions = [\"--nice=5\"]\n",
    );
    let slurm = [
        "slurm",
        "study.toml",
        "--shards",
        "3",
        "--config",
        "slurm.toml",
        "--time",
        "2h",
        "--mem",
        "3G",
    ];
    let printed = place.done(&slurm);
    assert!(
        printed.contains("sbatch --array=1-3%2 study-slurm/study.sbatch"),
        "{printed}"
    );
    let script = std::fs::read_to_string(place.path("study-slurm/study.sbatch")).expect("a script");
    for line in [
        "#SBATCH --partition=long",
        "#SBATCH --mem=3G",
        "#SBATCH --time=02:00:00",
        "#SBATCH --nice=5",
        "study.plan.json --time-limit 01:59:00",
    ] {
        assert!(script.contains(line), "no {line} in\n{script}");
    }
    for script in ["study-slurm/study.sbatch", "study-slurm/study-merge.sbatch"] {
        let path = place.path(script);
        assert!(
            Command::new("bash")
                .arg("-n")
                .arg(path)
                .status()
                .expect("bash")
                .success()
        );
    }
    place.write("study-slurm/study.sbatch", &script.replace("nice=5", "nice=7"));
    let sbatch = "#!/bin/sh\necho \"$@\" >> calls\nwc -l < calls\n";
    executable(&place.path("sbatch"), sbatch);
    let path = format!(
        "{}:{}",
        place.folder.path().display(),
        std::env::var("PATH").expect("PATH")
    );
    let mut command = place.command(&slurm);
    let output = command.arg("--submit").env("PATH", path).output().expect("runs");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("kept, although"), "{}", stderr(&output));
    let calls = std::fs::read_to_string(place.path("calls")).expect("calls");
    let work = place.path("study-slurm");
    let work = work.display();
    let expected = format!(
        "--parsable --array=1-3%2 {work}/study.sbatch\n\
         --parsable --dependency=afterany:1 {work}/study-merge.sbatch\n"
    );
    assert_eq!(calls, expected);
    for (text, part) in [
        ("colour = 1", "unknown field `colour`"),
        ("time = \"soon\"", "--time: expected a time"),
        ("account = \"\"", "--account: expected a text"),
        ("mem = \"1G\\ntouch pwned\"", "--mem: '1G\\ntouch pwned'"),
        (
            "options = [\"-C avx512\"]",
            "options: '-C avx512'; expected an option of sbatch in one word",
        ),
        ("options = [\"--a=1\\rtouch pwned\"]", "without control characters"),
    ] {
        place.write("bad.toml", text);
        place.refused(&["slurm", "study.toml", "--config", "bad.toml"], &[part]);
    }
}

/// Nothing of a path is a command of a job script, in which a line feed would end a comment.
#[test]
#[cfg(unix)]
fn no_path_is_a_command_of_a_job_script() {
    let place = Place::new();
    for work in ["a\ntouch pwned\n#", "a\rb", "a\u{1b}[2J", "a\u{202e}b"] {
        let named = format!("--work={work}");
        place.refused(
            &["slurm", "study.toml", &named],
            &["expected a text without control characters"],
        );
        let out = format!("--out={work}");
        place.refused(&["slurm", "study.toml", &out], &["without control characters"]);
        assert!(!place.path(work).exists());
    }
    std::os::unix::fs::symlink("nothing", place.path("link")).expect("a link");
    let work = ["slurm", "study.toml", "--work", "link"];
    place.refused(&work, &["link", "not a folder but a link"]);
    for work in ["a\\b", "50%"] {
        place.refused(&["slurm", "study.toml", "--work", work], &["without \\ and %"]);
    }
    // The folder of the study too, which the scripts name by its absolute path.
    let folder = place.path("a\ntouch pwned\n#");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::copy(place.path("study.toml"), folder.join("study.toml")).expect("a copy");
    let mut command = place.command(&["slurm", "study.toml"]);
    let output = command.current_dir(&folder).output().expect("runs");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));

    let work = "it's $(touch pwned) \"b\" `touch pwned` #c;touch pwned";
    place.done(&[
        "slurm",
        "study.toml",
        "--shards",
        "2",
        "--work",
        work,
        "--out",
        "the results",
    ]);
    let run = |script: &str, task: &str| {
        let output = Command::new("bash")
            .arg(place.path(work).join(script))
            .env("SLURM_ARRAY_TASK_ID", task)
            .current_dir(place.folder.path())
            .output()
            .expect("bash");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    };
    run("study.sbatch", "1");
    run("study.sbatch", "2");
    run("study-merge.sbatch", "");
    assert!(place.path("the results/summary.json").exists());
    assert!(!place.path("pwned").exists() && !place.path(work).join("pwned").exists());
}
