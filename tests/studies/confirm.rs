//! The worth of claims: exploratory ones, families, and confirmation by fresh trials.

use super::{Place, stdout, succeeds};

const FILE: &str = r#"
trials = 100
measures = ["e_a"]
[settings]
window = 218
[[methods]]
estimator = "iv"
report = [0, 4]
[[claims]]
id = "W1"
exploratory = true
test = { ratio = "e_a", of = "ls", to = "iv(4)", below = 1 }
[[claims]]
id = "W2"
test = { share = "lost", of = "ls", below = 0.5 }
"#;

fn place() -> Place {
    let place = Place::new();
    place.write("own.toml", FILE.as_bytes());
    place
}

/// The output of a command, with every run of blanks as one.
fn words(place: &Place, arguments: &[&str]) -> String {
    let output = place.run(arguments);
    succeeds(&output);
    let text = stdout(&output);
    text.split_whitespace().collect::<Vec<&str>>().join(" ")
}

fn json(place: &Place, name: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(place.path(name)).unwrap();
    serde_json::from_str(&text).unwrap()
}

const EXPLORATORY: &str = "Exploratory: written after results of the same kind were seen.";
const CONFIRMED: &str = "Confirmation by fresh trials, seed 1000002023.";

#[test]
fn an_exploratory_claim_says_so_until_fresh_trials_judge_it() {
    let place = place();
    let text = words(&place, &["run", "own.toml"]);
    assert_eq!(text.matches(EXPLORATORY).count(), 1, "{text}");
    assert!(
        text.ends_with(
            "2 claims were tested, each at 2.5 % a side; if all were at their limits, up to 0.1 wrong verdicts would \
             be expected. No error rate holds for 1 of them, which is exploratory or newer than the results. First \
             look in this folder."
        ),
        "{text}"
    );
    let text = words(&place, &["report", "results/own"]);
    assert!(text.contains(EXPLORATORY), "{text}");
    let page = |name: &str| std::fs::read_to_string(place.path(name)).unwrap();
    assert!(page("results/own/claims.md").contains("| holds (exploratory) |"));
    let numbers = page("results/own/tables/claims.csv");
    let ends: Vec<&str> = numbers.lines().map(|line| line.rsplit(',').next().unwrap()).collect();
    assert_eq!(ends, ["standing", "exploratory", "planned"]);
    let html = page("results/own/report.html");
    assert!(html.contains("<td>exploratory</td>") && html.contains("2 claims were tested"));

    // The confirmation: the trials that a run with this seed has, judged without the mark.
    let text = words(&place, &["run", "own.toml", "--confirm"]);
    assert!(!text.contains("Exploratory") && !text.contains("Added"), "{text}");
    assert_eq!(text.matches(CONFIRMED).count(), 2, "{text}");
    let counted = "A confirmation run: its seed is 1000002023, that of the file is 2023. 2 claims were tested";
    assert!(text.contains(counted), "{text}");
    words(
        &place,
        &["run", "own.toml", "--set", "seed=1000002023", "--out", "plain"],
    );
    let folder = "results/own-confirm-1000002023";
    let cells = |folder: &str| json(&place, &format!("{folder}/summary.json"))["cells"].clone();
    assert_eq!(cells(folder), cells("plain"));
    assert_ne!(cells(folder), cells("results/own"));
    let experiment = json(&place, &format!("{folder}/manifest.json"))["experiment"].clone();
    assert_eq!([&experiment["seed"], &experiment["confirms"]], [1_000_002_023, 2023]);
    let text = words(&place, &["report", folder]);
    assert!(text.contains(CONFIRMED) && text.contains(counted), "{text}");
    words(&place, &["replay", folder, "0:17"]);
    // Its manifest repeats it.
    let manifest = format!("{folder}/manifest.json");
    let text = words(&place, &["run", &manifest, "--out", "again"]);
    assert!(text.contains(CONFIRMED), "{text}");
    assert_eq!(cells("again"), cells(folder));
}

#[test]
fn a_claim_of_after_the_confirmation_is_none() {
    let place = place();
    let confirm = ["run", "own.toml", "--confirm", "7", "--claims", "W2"];
    let text = words(&place, &confirm);
    assert!(text.contains("W2 holds") && !text.contains("W1"), "{text}");
    assert!(text.contains("1 claim was tested"), "{text}");
    // The file is edited when the results of seed 7 are known.
    place.write("own.toml", FILE.replace("below = 0.5", "below = 0.4").as_bytes());
    let text = words(&place, &confirm);
    assert!(!text.contains("Confirmation by"), "{text}");
    assert!(text.contains("Added or changed after the run."), "{text}");
    assert!(text.contains("No error rate holds for 1 of them"), "{text}");
}

#[test]
fn what_confirms_nothing_is_refused() {
    let place = place();
    let refuses = |more: &[&str], parts: &[&str]| {
        place.refuses(&[&["run", "own.toml"], more].concat(), parts);
    };
    refuses(
        &["--confirm", "2023"],
        &["own.toml: --confirm 2023", "such as 1000002023"],
    );
    refuses(&["--confirm", "x"], &["--confirm"]);
    refuses(&["--claims", "W1"], &["--confirm"]);
    refuses(
        &["--confirm", "--claims", "W9"],
        &["unknown claim 'W9'; expected W1, W2"],
    );
    refuses(&["--confirm", "2023", "--set", "seed=5"], &["--set seed"]);
    assert!(!place.path("results").exists());
    place.refuses(&["run", "everything.toml", "--confirm"], &["no claim"]);
    // Results that were there before are no confirmation, nor the other way round.
    words(&place, &["run", "own.toml", "--set", "seed=7", "--out", "seen"]);
    refuses(&["--confirm", "7", "--out", "seen"], &["another design", "confirms"]);
    words(&place, &["run", "own.toml", "--confirm", "7"]);
    refuses(&["--set", "seed=7", "--out", "results/own-confirm-7"], &["confirms"]);
    // Neither a confirmation's own seed nor the file's is fresh.
    let manifest = "results/own-confirm-7/manifest.json";
    for seed in ["7", "2023"] {
        place.refuses(&["run", manifest, "--out", "x", "--confirm", seed], &["--confirm"]);
    }
    place.write("same.toml", b"seed = 5\nconfirms = 5\n");
    place.refuses(&["check", "same.toml"], &["confirms"]);
}

#[test]
fn combinations_without_a_rate_are_refused() {
    let place = place();
    let rule = "trials = { until = \"W1\", minimum = 50, maximum = 100 }";
    let until = FILE.replace("trials = 100", rule);
    place.write("own.toml", until.as_bytes());
    place.refuses(&["check", "own.toml"], &["trials.until", "'W1' is exploratory"]);
    // Fresh trials give it a rate.
    let text = words(&place, &["run", "own.toml", "--confirm"]);
    assert!(text.contains("W1 holds"), "{text}");
    place.write("none.toml", b"family = true\n");
    place.refuses(&["check", "none.toml"], &["family", "[[claims]]"]);
    place.write(
        "word.toml",
        FILE.replace("exploratory = true", "exploratory = 1").as_bytes(),
    );
    place.refuses(&["check", "word.toml"], &["expected a boolean"]);
}

#[test]
fn a_family_is_no_part_of_the_design() {
    let place = place();
    let text = words(&place, &["run", "own.toml"]);
    assert!(!text.contains("Corrected"), "{text}");
    let family = format!("family = true\n{FILE}");
    place.write("own.toml", family.as_bytes());
    let text = words(&place, &["run", "own.toml"]);
    assert_eq!(text.matches(" Corrected over 2 claims.").count(), 2, "{text}");
    assert!(!text.contains("Added"), "{text}");
    let rate = "2 claims were tested, at 2.5 % a side over all of them (Holm's correction).";
    assert!(text.contains(rate), "{text}");
    // The family of the claims' own file counts.
    place.write("other.toml", FILE.as_bytes());
    let text = words(&place, &["report", "results/own", "--claims", "other.toml"]);
    assert!(!text.contains("Corrected"), "{text}");
}
