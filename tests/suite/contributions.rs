//! Results of others: exported from a run, put on a page, and refused where they do not fit.

use crate::common::{asobench_in as asobench, done_in, stderr, stdout};
use std::path::Path;

const PART: [&str; 2] = ["--only", "P18-bj"];

/// A run of a method of one's own in the folder `out`.
fn computed(folder: &Path) {
    let study = "[[methods]]\nname = \"mine\"\nestimator = \"oe\"\nstarts = 0\n";
    std::fs::write(folder.join("mine.toml"), study).unwrap();
    done_in(folder, &[&["suite", "mine.toml", "--out", "out"], &PART[..]].concat());
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// A contribution says which program computed it, has the runs of the results, and stands on a page beside the others.
#[test]
fn a_contribution_is_exported_and_shown() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    computed(folder);
    done_in(folder, &["suite", "export", "out/methods/mine.json"]);
    let whole: serde_json::Value = serde_json::from_str(&read(&folder.join("mine.json"))).unwrap();
    let results: serde_json::Value = serde_json::from_str(&read(&folder.join("out/methods/mine.json"))).unwrap();
    assert_eq!(whole["results"]["scenarios"], results["scenarios"]);
    let program = format!("asobench {}, commit ", env!("CARGO_PKG_VERSION"));
    assert!(whole["programs"][0].as_str().unwrap().starts_with(&program));
    assert_eq!(whole["method"]["estimator"], "oe");
    assert_eq!(whole["method"]["starts"], 0);
    let add = [&["suite", "add", "mine.json", "--out", "page"], &PART[..]].concat();
    let shown = stdout(&done_in(folder, &add));
    assert!(
        shown.lines().any(|line| line.starts_with("mine (contributed) ")),
        "{shown}"
    );
    let page = read(&folder.join("page/report.html"));
    for word in ["mine (contributed)", &program, "href=\"archive/mine.json\""] {
        assert!(page.contains(word), "{word}");
    }
    assert_eq!(
        read(&folder.join("mine.json")),
        read(&folder.join("page/archive/mine.json"))
    );
    // The numbers of the others do not depend on it.
    let alone = stdout(&done_in(folder, &[&["suite", "scores"], &PART[..]].concat()));
    let row = |text: &str| {
        let mut lines = text.lines().map(|line| line.replace('|', " "));
        let line = lines.find(|line| line.trim_start().starts_with("bj "));
        line.unwrap().split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(row(&shown), row(&alone));
}

/// One line refuses a file that is none, was changed, or belongs to another edition, scenario, part or name.
#[test]
fn what_does_not_fit_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    computed(folder);
    done_in(folder, &["suite", "export", "out/methods/mine.json"]);
    let text = read(&folder.join("mine.json"));
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    // Without its checksum a file may be changed.
    let (open, _) = text.rsplit_once(",\"checksum\":").unwrap();
    let open = format!("{open}}}");
    write("changed.json", &text.replacen("0.", "1.", 1));
    write("edition.json", &open.replace("\"suite\":\"2.0\"", "\"suite\":\"0.9\""));
    write("taken.json", &open.replace("\"method\":\"mine\"", "\"method\":\"arx\""));
    let (before, content) = open.split_once("\"content\":\"").unwrap();
    write("scenario.json", &format!("{before}\"content\":\"z{}", &content[1..]));
    write("none.json", "{}");
    for (file, part) in [
        ("changed.json", "the checksum differs"),
        ("edition.json", "of suite 0.9; expected suite"),
        ("taken.json", "a method 'arx' is there already"),
        ("scenario.json", "of another scenario under the name P18-bj-300"),
        ("none.json", "no contribution; expected a file of suite export"),
        (
            "out/methods/mine.json",
            "no contribution; expected a file of suite export",
        ),
        ("nothing.json", "nothing.json"),
    ] {
        let add = [&["suite", "add", file, "--out", "page"], &PART[..]].concat();
        let refused = asobench(folder, &add);
        let said = stderr(&refused);
        assert_eq!(refused.status.code(), Some(2), "{file}: {said}");
        assert_eq!(said.lines().count(), 1, "{file}: {said}");
        assert!(said.contains(part), "{file}: {said}");
    }
    // A part of the suite is no whole tier.
    let refused = asobench(folder, &["suite", "add", "mine.json"]);
    assert!(stderr(&refused).contains("without scenario"), "{}", stderr(&refused));
    // Results away from their run do not say where they are from.
    write("alone.json", &read(&folder.join("out/methods/mine.json")));
    let refused = asobench(folder, &["suite", "export", "alone.json", "--out", "x.json"]);
    assert!(
        stderr(&refused).contains("expected methods/NAME.json"),
        "{}",
        stderr(&refused)
    );
}
