//! Shards of a study with a program: the bytes of one machine, and no start without a word.

use super::consent::{asobench, text};
use super::{list, root};
use crate::common::{PYTHON, runs};
use std::path::Path;

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = asobench(folder, arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
    text(&output.stdout)
}

#[test]
fn merged_shards_are_the_bytes_of_one_machine() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let command = list(&["python3", "worker.py"]);
    let worker = root().join("examples/workers/least_squares.py");
    std::fs::copy(worker, folder.join("worker.py")).unwrap();
    // Parts of shards end within batches.
    let study = format!(
        "trials = 100\nstore = \"trials\"\n[settings]\nwindow = [18, 40]\neta = 10\n[[methods]]\nestimator = \"ls\"\n\
         [[methods]]\nname = \"mine\"\nbatch = 7\ncommand = {command}\n"
    );
    std::fs::write(folder.join("study.toml"), study).unwrap();
    let allow = "--allow-commands";
    done(folder, &["run", "study.toml", "--out", "whole", allow]);
    let planned = done(folder, &["plan", "study.toml", "--shards", "3", allow]);
    assert!(planned.contains("I/3 --allow-commands"), "{planned}");

    let refused = asobench(folder, &["shard", "study.plan.json", "1/3"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("mine") && text(&refused.stderr).contains(allow));
    assert!(!folder.join("study-shards").exists());
    for shard in ["1/3", "2/3", "3/3"] {
        done(folder, &["shard", "study.plan.json", shard, allow]);
    }
    // Neither needs the program.
    std::fs::remove_file(folder.join("worker.py")).unwrap();
    done(folder, &["status", "study.plan.json", "--verify"]);
    done(folder, &["merge", "study.plan.json", "--out", "merged"]);
    for name in ["trials.parquet", "summary.json", "summary.parquet"] {
        let content = |out: &str| std::fs::read(folder.join(out).join(name)).unwrap();
        assert!(content("whole") == content("merged"), "{name}");
    }
}
