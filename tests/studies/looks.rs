//! Every look at the claims of a folder spends level, whichever way the trials were extended.

use super::{Place, stdout, succeeds};
use serde_json::Value;

const STUDY: &str = "
measures = ['e_a']
[settings]
window = 98
eta = 10
[[claims]]
id = 'W1'
test = { value = 'e_a', of = 'iv(4)', above = 1e-9 }
";

fn shares(place: &Place, out: &str) -> Vec<f64> {
    let text = std::fs::read(place.path(out).join("looks.json")).expect("a list");
    let list: Value = serde_json::from_slice(&text).expect("JSON");
    let looks = list["looks"].as_array().expect("looks").iter();
    looks
        .map(|look| look["share"].as_f64().expect("a share"))
        .collect()
}

fn run(place: &Place, out: &str, more: &[&str]) -> String {
    let arguments = [&["run", "study.toml", "--out", out][..], more].concat();
    let output = place.run(&arguments);
    succeeds(&output);
    let text = stdout(&output);
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn extensions_are_further_looks_and_repetitions_are_none() {
    let place = Place::new();
    place.write("study.toml", STUDY.as_bytes());
    let first = run(&place, "out", &["--trials", "100"]);
    assert!(
        first.contains("W1 holds") && !first.contains("Look"),
        "{first}"
    );
    run(&place, "out", &["--trials", "100"]);
    assert_eq!(shares(&place, "out"), [0.9]);
    let second = run(&place, "out", &["--trials", "200"]);
    let words = "Look 2 at this study, at 0.125 % a side; all looks together keep 2.5 %.";
    assert!(second.contains(words), "{second}");
    run(&place, "out", &["--trials", "400"]);
    let spent: f64 = shares(&place, "out").iter().sum();
    assert!(shares(&place, "out").len() == 3 && spent < 1.0);
    // A report of the same trials is the same look.
    succeeds(&place.run(&["report", "out"]));
    assert_eq!(shares(&place, "out").len(), 3);
}

/// The other claims of an `until` file are judged where its rule happened to stop: at a look's share of 100, 200, 400.
/// More trials after it are a further look.
#[test]
fn a_rule_leaves_little_for_what_follows() {
    let place = Place::new();
    let rule = "trials = { until = 'W1', minimum = 100, maximum = 400 }";
    place.write("study.toml", format!("{rule}\n{STUDY}").as_bytes());
    run(&place, "out", &[]);
    let found = shares(&place, "out");
    assert!(
        found.len() == 1 && (found[0] - 0.3).abs() < 1e-12,
        "{found:?}"
    );
    let more = run(&place, "out", &["--trials", "800"]);
    assert!(more.contains("Look 2 at this study, at 0.125 %"), "{more}");
}

/// A single planned look has the whole level, and a later one none: what is not exact stays undecided.
#[test]
fn a_planned_look_has_the_whole_level() {
    let place = Place::new();
    place.write("study.toml", format!("looks = 1\n{STUDY}").as_bytes());
    assert!(run(&place, "out", &["--trials", "100"]).contains("W1 holds"));
    let second = run(&place, "out", &["--trials", "200"]);
    let words = ["W1 undecided", "its looks are used up", "Look 2"];
    assert!(words.iter().all(|word| second.contains(word)), "{second}");
    let refused = format!("looks = 0\n{STUDY}");
    place.write("study.toml", refused.as_bytes());
    place.refuses(
        &["run", "study.toml", "--out", "none"],
        &["looks", "expected at least 1"],
    );
}
