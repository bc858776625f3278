//! Folders of results as earlier versions wrote them, `tests/formats/VERSION`: read, judged and replayed.

use crate::common::{asobench_in, copy, stdout};
use std::path::Path;

/// A copy of the folder of this version, in a folder of its own.
fn of_version(version: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let at = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats");
    copy(&at.join(version), &folder.path().join("old"));
    folder
}

/// The output of a command that succeeds beside such a folder.
fn output_in(folder: &tempfile::TempDir, words: &[&str]) -> String {
    let done = asobench_in(folder.path(), words);
    assert!(done.status.success(), "{words:?}: {done:?}");
    stdout(&done)
}

/// Version 0.2.0 printed for claim C1 that max e_x of iv(4) is 0 up to rounding in 99.5 +- 0.1 %, and for C2 that it
/// is below 0.065 in none (`git show 37b5a469:results/nikolov2023/verdict.txt`).
#[test]
fn results_of_0_2_0_are_read_judged_and_replayed() {
    let folder = of_version("0.2.0");
    let run = |words: &[&str]| output_in(&folder, words);
    let judged = run(&["report", "old", "--out", "page"]);
    assert!(judged.contains("C1  holds"), "{judged}");
    assert!(judged.contains("is 99.48(7) %, above 50 %"), "{judged}");
    assert!(judged.contains("C2  does not hold"), "{judged}");
    assert!(folder.path().join("page/report.html").exists());
    assert!(run(&["check", "old"]).contains("results of a version without checksums"));
    let trial = run(&["replay", "old", "0:7"]);
    assert!(trial.contains("trial 7, seed 2023"), "{trial}");
    let rounding = trial.lines().filter_map(|line| line.trim().strip_prefix("e_x_max "));
    let errors: Vec<f64> = rounding.map(|text| text.trim().parse().expect("a number")).collect();
    assert!(errors.len() > 1 && errors.iter().all(|error| *error < 1e-6));
}

/// A build of 0.3.0 printed of the 20 trials that C1 holds with 100 %, C2 has none, and E3, whose ratios it kept as
/// both numbers of every trial, does not hold. Its stored trials are those that a replay computes.
#[test]
fn results_of_0_3_0_are_read_judged_and_replayed() {
    let folder = of_version("0.3.0");
    let run = |words: &[&str]| output_in(&folder, words);
    let judged = run(&["report", "old", "--out", "page"]);
    let judged = judged.split_whitespace().collect::<Vec<_>>().join(" ");
    for verdict in [
        "C1 holds: the share of trials of iv(4) with e_a = 0 up to rounding, and < 1e-6 is 100.0 %, above 50 %.",
        "C2 does not hold: the share of trials of iv(4) with e_a < 0.033 is 0 %, not above 50 %.",
        "E3 does not hold: the median ratio of e_a as printed of iv(4) to e_a of iv(4) is 1.8062(2) at C2",
    ] {
        assert!(judged.contains(verdict), "{verdict}\n{judged}");
    }
    assert!(folder.path().join("page/report.html").exists());
    run(&["check", "old"]);
    let trial = run(&["replay", "old", "C2:7"]);
    assert!(trial.contains("trial 7, seed 2023"), "{trial}");
    assert!(trial.contains("These rows equal, bit for bit"), "{trial}");
}
