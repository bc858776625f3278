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
    looks.map(|look| look["share"].as_f64().expect("a share")).collect()
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
    assert!(first.contains("W1 holds") && !first.contains("Look"), "{first}");
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
    assert!(found.len() == 1 && (found[0] - 0.3).abs() < 1e-12, "{found:?}");
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

/// An adversary doubles the trials and plans one look more each time: the first had the whole level, nothing is left.
#[test]
fn an_edited_plan_spends_what_is_left() {
    let place = Place::new();
    for (looks, trials, share) in [(2, "100", 0.5), (3, "200", 0.25), (1, "400", 0.0)] {
        place.write("study.toml", format!("looks = {looks}\n{STUDY}").as_bytes());
        run(&place, "out", &["--trials", trials]);
        assert_eq!(shares(&place, "out").last(), Some(&share));
    }
    // The same trials again, with a plan that would have given them the whole level.
    let again = run(&place, "out", &["--trials", "400"]);
    assert!(again.contains("W1 undecided") && again.contains("Look 3"), "{again}");
    assert_eq!(shares(&place, "out"), [0.5, 0.25, 0.0]);
}

/// Looks in folders beside this one count: at the same trials and more of them, whatever the limit is now, and at
/// confirmations by several seeds. A claim on another number, and another seed that confirms nothing, begin anew.
#[test]
fn looks_in_folders_beside_count() {
    let place = Place::new();
    let other = "[[claims]]\nid = 'W2'\ntest = { value = 'e_a', of = 'ls', above = 1e-9 }\n";
    place.write("study.toml", format!("{STUDY}{other}").as_bytes());
    let beside = |arguments: &[&str]| -> (String, String) {
        let run = [&["run", "study.toml"], arguments].concat();
        let output = place.run(&run);
        succeeds(&output);
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        (words(&stdout(&output)), words(&super::stderr(&output)))
    };
    run(&place, "results/a", &["--trials", "100"]);
    let (text, note) = beside(&["--trials", "200", "--out", "results/b"]);
    assert!(text.contains("Look 2 at this study, at 0.125 %"), "{text}");
    assert!(
        note.contains("1 look at these claims in folders beside results/b count"),
        "{note}"
    );
    // The first folder sees the second one's look at the same trials: no new look.
    run(&place, "results/a", &["--trials", "200"]);
    assert_eq!(shares(&place, "results/a"), shares(&place, "results/b"));
    let confirmed = |seed: &str, claims: &str| {
        let more = ["--trials", "100", "--confirm", seed, "--claims", claims];
        beside(&more).0.contains("Look 2 at this study")
    };
    assert!(!confirmed("7", "W1"), "the first confirmation");
    assert!(confirmed("8", "W1"), "the second one of this claim");
    assert!(!confirmed("9", "W2"), "the first one of another claim");
    place.write("study.toml", STUDY.replace("1e-9", "2e-9").as_bytes());
    let (text, _) = beside(&["--trials", "400", "--out", "results/c"]);
    assert!(text.contains("Look 3 at this study"), "{text}");
    let (text, _) = beside(&["--trials", "400", "--seed", "5", "--out", "results/d"]);
    assert!(!text.contains("Look"), "{text}");
    // Such a list is never required: a damaged one counts for nothing.
    for folder in ["a", "b", "c"] {
        place.write(&format!("results/{folder}/looks.json"), b"{\"looks_of\":\"asobench\",");
    }
    let (text, _) = beside(&["--trials", "800", "--out", "results/e"]);
    assert!(!text.contains("Look"), "{text}");
}
