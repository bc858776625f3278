//! Runs that have not ended: every reader tells them from a folder without a run, and a report of a part says so.

use super::{Place, assert_same, blocks, contents, stderr, stdout, succeeds, wait_until};
use std::process::Command;

/// One cell, so that what is there are the first trials. The judged measure comes from a search, which takes its time.
const STUDY: &str = "trials = 4000\nmeasures = [\"e_a\"]\nstore = \"trials\"\ncoverage = true\n[settings]\n\
                     plant = \"mine\"\nnoise = \"white\"\neta = 10\nwindow = 98\n\
                     [plants.mine]\nA = [1, -1.5, 0.7]\nB = [0, 1, 0.5]\n\
                     [[methods]]\nestimator = \"arx\"\n[[methods]]\nestimator = \"oe\"\n\
                     [[claims]]\nid = \"c1\"\ntext = \"OE is nearer.\"\n\
                     test = { ratio = \"e_a\", of = \"oe\", to = \"arx\", below = 1.0 }\n";

/// On one thread, so that those that are there have no gap.
const RUN: [&str; 8] = ["run", "study.toml", "--out", "out", "--block", "50", "--threads", "1"];

/// Starts the study, and stops it when it has some blocks; the number of trials that are there.
fn stopped(place: &Place, signal: &str) -> String {
    place.write("study.toml", STUDY.as_bytes());
    let child = place.start(&RUN);
    wait_until(|| blocks(&place.path("out")).len() > 3);
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
    child.wait_with_output().expect("it ends");
    assert!(
        !place.path("out/manifest.json").exists(),
        "it was to be stopped before its end"
    );
    let ends = blocks(&place.path("out")).into_iter().map(|path| {
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let (start, end) = name[7..].split_once('-').expect("a range");
        end.parse::<u64>().expect("an end") - start.parse::<u64>().expect("a start")
    });
    ends.sum::<u64>().to_string()
}

#[test]
fn every_reader_tells_a_stopped_run_from_none() {
    for signal in ["-INT", "-KILL"] {
        let place = Place::new();
        let there = stopped(&place, signal);
        std::fs::create_dir(place.path("empty")).expect("made");
        for reader in [
            &["report", "out"][..],
            &["plot", "out"],
            &["failures", "out"],
            &["compare", "out", "out"],
            &["replay", "out", "0:0"],
        ] {
            let said =
                format!("out: no results yet (no manifest.json): {there} of 4000 trials of a run that has not ended");
            place.refuses(reader, &[&said, "the same command goes on", "report --partial"]);
            let empty: Vec<&str> = reader
                .iter()
                .map(|word| if *word == "out" { "empty" } else { *word })
                .collect();
            place.refuses(&empty, &["empty: no results in this folder", "run an experiment"]);
        }
        place.refuses(&["report", "empty", "--partial"], &["empty: no results in this folder"]);
    }
}

/// The page of a part is marked, judges nothing, and has the numbers of a run of as many trials; the run goes on to the
/// results of one that was never stopped.
#[test]
fn a_part_is_reported_as_such() {
    let place = Place::new();
    let there = stopped(&place, "-INT");
    let output = place.run(&["report", "out", "--partial"]);
    succeeds(&output);
    let said = stdout(&output);
    assert!(
        said.contains(&format!("Partial results: {there} trials in 1 cells")),
        "{said}"
    );
    assert!(!said.contains("c1") && !said.contains("no claims"), "{said}");
    let page = std::fs::read_to_string(place.path("out/report.html")).expect("a page");
    assert!(page.contains("Partial results: ") && page.contains("the run has not ended"));
    assert!(!page.contains("OE is nearer") && !page.contains("To run it again"));
    assert!(!place.path("out/claims.md").exists() && !place.path("out/manifest.json").exists());
    // Those trials alone, in a folder of their own.
    succeeds(&place.run(&["run", "study.toml", "--out", "few/out", "--trials", &there]));
    succeeds(&place.run(&["report", "few/out"]));
    let table = |folder: &str| {
        let path = place.path(folder).join("tables/out-results.csv");
        std::fs::read(path).expect("a table")
    };
    assert!(table("out") == table("few/out"));
    succeeds(&place.run(&RUN));
    succeeds(&place.run(&["run", "study.toml", "--out", "whole"]));
    let mut found = contents(&place.path("out"));
    found.retain(|name, _| !["report.html", "simulated.md"].contains(&name.as_str()));
    assert_same(&found, &contents(&place.path("whole")), "gone on");
    let output = place.run(&["report", "out"]);
    assert!(stdout(&output).contains("c1  holds"), "{}", stdout(&output));
    let page = std::fs::read_to_string(place.path("out/report.html")).expect("a page");
    assert!(!page.contains("Partial results"));
}

/// A claim that is written after a part was looked at is one after the run; a stop alone shows nothing.
#[test]
fn a_claim_after_a_look_at_a_part_says_so() {
    for looked in [true, false] {
        let place = Place::new();
        stopped(&place, "-INT");
        if looked {
            succeeds(&place.run(&["report", "out", "--partial", "--out", "page"]));
        }
        let edited = STUDY.replace("below = 1.0", "below = 0.9");
        place.write("study.toml", edited.as_bytes());
        let output = place.run(&RUN);
        succeeds(&output);
        let said = stdout(&output).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(said.contains("Added or changed after the run."), looked, "{said}");
    }
}

/// A run that is under way is not looked at, and goes on.
#[test]
fn a_part_of_a_running_study_is_refused() {
    let place = Place::new();
    place.write("study.toml", STUDY.as_bytes());
    let mut child = place.start(&[&RUN[..], &["--trials", "20000000", "--anyway"]].concat());
    wait_until(|| blocks(&place.path("out")).len() > 3);
    place.refuses(&["report", "out", "--partial"], &["out", "another run"]);
    assert!(child.try_wait().expect("a child").is_none(), "it goes on");
    child.kill().expect("killed");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(stderr(&output), "");
}
