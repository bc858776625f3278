//! The losses that others found, and cases near them.

use super::{Place, REPRODUCE, stderr, tree};
use std::os::unix::fs::symlink;
use std::process::{Command, Stdio};

const RUN: [&str; 4] = ["run", "study.toml", "--out", "out"];

/// The thesis that was lost: `mkdir -p k2/blocks/deep`.
#[test]
fn reproduce_removes_nothing_of_others() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("k2/blocks/deep")).expect("a folder");
    std::fs::write(place.path("k2/blocks/deep/thesis.txt"), "thesis").expect("written");
    let before = tree(&place.path("k2/blocks"));
    place.refuses(&[&REPRODUCE[..], &["--out", "k2"]].concat(), "k2/blocks/deep");
    assert!(tree(&place.path("k2/blocks")) == before);
    // A run needs nothing removed there.
    let deep = tree(&place.path("k2/blocks/deep"));
    let output = place.run(&["run", "study.toml", "--out", "k2"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(tree(&place.path("k2/blocks/deep")) == deep);
}

/// The default folder is emptied before a run, of the program's own files only.
#[test]
fn the_default_folder_is_no_exception() {
    let place = Place::new();
    let run = || place.run(&REPRODUCE);
    assert_eq!(run().status.code(), Some(0));
    for (name, content) in [
        ("results/reproduce/trials.parquet", "a thesis\n"),
        ("results/reproduce/fig2.svg", "<svg>a drawing</svg>"),
        ("results/reproduce/manifest.json", "{\"experiment\": {}}"),
    ] {
        let own = std::fs::read(place.path(name)).expect("a file");
        std::fs::write(place.path(name), content).expect("written");
        let before = tree(&place.path("results"));
        place.refuses(&REPRODUCE, name);
        assert!(tree(&place.path("results")) == before, "{name}");
        std::fs::write(place.path(name), own).expect("written");
        assert_eq!(run().status.code(), Some(0), "{name}");
    }
    std::fs::remove_dir_all(place.path("results/reproduce")).expect("removed");
    symlink(place.path("victim/own"), place.path("results/reproduce")).expect("a link");
    let before = tree(&place.path("victim"));
    place.refuses(&REPRODUCE, "results/reproduce");
    assert!(tree(&place.path("victim")) == before);
    // The other paper's folders are looked at before the first one's experiment is run.
    symlink(place.path("victim"), place.path("paper/gpebo-noise")).expect("a link");
    let both = ["reproduce", "--trials", "100000000", "--out", "paper"];
    place.refuses(&both, "paper/gpebo-noise");
    assert!(tree(&place.path("victim")) == before);
}

/// Names that temporary files had once, and have now, as links: none is followed, and only the program's own go.
#[test]
fn temporary_files_follow_no_link() {
    let place = Place::new();
    let old = [
        ".summary.json.tmp",
        ".manifest.json.tmp",
        ".trials.parquet.tmp",
        ".writable.tmp",
        "blocks/design.tmp",
        "blocks/thesis.tmp",
        "blocks/c00000-0000000008-0000000012.tmp",
        "timing/times.tmp",
    ];
    let new = (0..40).map(|i| format!(".asobench-manifest-1-{i}.tmp"));
    let names: Vec<String> = old.iter().map(ToString::to_string).chain(new).collect();
    for name in &names {
        symlink(place.path("victim/thesis.txt"), place.path("out").join(name)).expect("a link");
    }
    let stale = place.path("out/.asobench-summary-4242-7.tmp");
    std::fs::write(&stale, "{\"title\"").expect("written");
    let before = tree(&place.path("victim"));
    let output = place.run(&[&RUN[..], &["--trials", "12"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(tree(&place.path("victim")) == before);
    assert!(!stale.exists(), "what a killed run left is removed");
    for name in &names {
        let link = std::fs::symlink_metadata(place.path("out").join(name));
        assert!(link.expect("still there").is_symlink(), "{name}");
    }
}

/// A folder of results is named in many ways; a link is no way to name one that is written.
#[test]
fn links_by_any_spelling() {
    let place = Place::new();
    symlink(place.path("victim/own"), place.path("link")).expect("a link");
    let before = tree(&place.path("victim"));
    for out in ["link", "link/", "link/.", "./link//", "out/../link", "out/../link/"] {
        place.refuses(&["run", "study.toml", "--out", out], "link");
        place.refuses(&["report", "out", "--out", out], "link");
        place.refuses(&[&REPRODUCE[..], &["--out", out]].concat(), "link");
    }
    assert!(tree(&place.path("victim")) == before);
    for out in ["out/", "out/.", "./out//", "out/../out"] {
        let output = place.run(&["run", "study.toml", "--out", out]);
        assert_eq!(output.status.code(), Some(0), "{out}: {}", stderr(&output));
        assert!(output.stderr.ends_with(b"measured again\n"), "{out}");
    }
    // A folder within that of another study holds its own results, and neither is in the other's way.
    for out in ["out/inner", "out/blocks"] {
        let output = place.run(&["run", "study.toml", "--trials", "4", "--out", out]);
        assert_eq!(output.status.code(), Some(0), "{out}: {}", stderr(&output));
        let output = place.run(&RUN);
        assert_eq!(output.status.code(), Some(0), "{out}: {}", stderr(&output));
    }
}

/// Results that are there are no place for a record or for states.
#[test]
fn outputs_replace_their_own_kind_only() {
    let place = Place::new();
    std::fs::write(place.path("notes.csv"), "# asobench is what I use\nk,x1\n").expect("written");
    for target in [
        "out/summary.json",
        "out/manifest.json",
        "out/trials.parquet",
        "out/report.html",
        "study.toml",
        "notes.csv",
        "states.csv",
    ] {
        let before = tree(&place.path("."));
        place.refuses(&["replay", "out", "0:0", "--data", target], target);
        assert!(tree(&place.path(".")) == before, "{target}");
    }
    let states = |target: &'static str| {
        let mut arguments = super::ESTIMATE;
        arguments[7] = target;
        arguments
    };
    for target in ["data.csv", "out/summary.json", "notes.csv"] {
        let before = tree(&place.path("."));
        place.refuses(&states(target), target);
        assert!(tree(&place.path(".")) == before, "{target}");
    }
    // An empty file holds nothing of anybody's.
    std::fs::write(place.path("empty.csv"), "").expect("written");
    let output = place.run(&states("empty.csv"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(place.path("empty.csv").metadata().expect("a file").len() > 0);
}

/// A plain file where a report's folder should be is bad input.
#[test]
fn reports_go_into_folders() {
    let place = Place::new();
    place.refuses(&["report", "out", "--out", "study.toml"], "--out study.toml");
    place.refuses(&["report", "out", "--out", "study.toml/page"], "--out study.toml");
}

/// A reader that goes away takes nothing from a run that is done; a full device is told.
#[test]
fn standard_output_that_nobody_reads() {
    let place = Place::new();
    let with = |script: &str| {
        let mut command = Command::new("bash");
        command.args(["-c", &format!("set -o pipefail; {script}"), "bash"]);
        command.arg(super::PROGRAM).current_dir(place.folder.path());
        super::wait(command)
    };
    for arguments in [
        "run study.toml --out out",
        "report out",
        "replay out 0:0",
        "schema",
        "check study.toml",
        "--help",
    ] {
        let output = with(&format!("(sleep 0.3; \"$1\" {arguments}) | true"));
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", stderr(&output));
        assert!(!stderr(&output).contains("standard output"), "{arguments}");
        let output = with(&format!("\"$1\" {arguments} > /dev/full"));
        assert_eq!(output.status.code(), Some(1), "{arguments}");
        let message = stderr(&output);
        assert!(message.contains("cannot write to standard output"), "{message}");
    }
    // A single estimate that failed stays one.
    let rows = (0..40).map(|k| format!("{},{}", (k * 7) % 5, k % 2));
    let record = rows.collect::<Vec<_>>().join("\n");
    std::fs::write(place.path("rank.csv"), format!("u,y\n{record}")).expect("written");
    let output = with("(sleep 0.3; \"$1\" estimate rank.csv --order 12) | true");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
}

/// A run from standard input needs a name for its folder.
#[test]
fn standard_input_is_asked_for_by_a_dash() {
    let place = Place::new();
    let from = |file: &str, arguments: &[&str]| {
        let mut command = super::command(place.folder.path(), arguments);
        let file = std::fs::File::open(place.path(file)).expect("a file");
        command.stdin(Stdio::from(file));
        super::wait(command)
    };
    let output = from("study.toml", &["run", "-"]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("--out"));
    let output = from("study.toml", &["run", "-", "--out", "piped"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let summary = |folder: &str| std::fs::read(place.path(folder).join("summary.json")).expect("a file");
    assert!(summary("piped") == summary("out"));
    let output = from("data.csv", &["estimate", "-", "--order", "6", "--window", "18"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}
