//! Claims of a file, from `check` to the report. Under 1/A noise least squares is asymptotically efficient: for the
//! paper's plant sqrt(N) rms e_a is 0.970, that of IV 1.297 (specification, section 7), so the truth of each claim is
//! known.

use super::{Place, succeeds};

const FILE: &str = r#"
trials = 2000
measures = ["e_b"]
[settings]
window = [98, 218]
[[methods]]
estimator = "iv"
report = [0, 4]
"#;

fn claim(id: &str, output: &str, to: &str, below: f64) -> String {
    format!(
        "[[claims]]\nid = \"{id}\"\ntext = \"a claim\"\n\
         test = {{ ratio = \"e_a\", of = \"{output}\", to = \"{to}\", below = {below} }}\n"
    )
}

/// The output of a command that succeeds.
fn lines(place: &Place, arguments: &[&str]) -> String {
    let output = place.run(arguments);
    succeeds(&output);
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn each_line_begins_with_id_and_verdict() {
    let place = Place::new();
    let claims = [
        claim("true", "ls", "iv(4)", 1.0),
        claim("false", "iv(4)", "ls", 1.0),
        // As near to the truth as these trials do not tell.
        claim("open", "ls", "iv(4)", 0.97 / 1.297),
    ];
    place.write("own.toml", (FILE.to_owned() + &claims.concat()).as_bytes());
    lines(&place, &["check", "own.toml"]);
    let expected = ["true  holds", "false  does not hold", "open  undecided"];
    let run = lines(&place, &["run", "own.toml", "--out", "own"]);
    lines(&place, &["report", "own"]);
    // Once more: the report's own files are replaced.
    let report = lines(&place, &["report", "own"]);
    for text in [&run, &report] {
        for line in expected {
            assert!(text.lines().any(|other| other.starts_with(line)), "{line}: {text}");
        }
    }
    let page = std::fs::read_to_string(place.path("own/report.html")).unwrap();
    assert!(page.contains("The cells behind the verdict: 2"));
}

/// How many verdicts say that their claims were added.
fn added(text: &str) -> usize {
    let words: Vec<&str> = text.split_whitespace().collect();
    words.join(" ").matches("Added or changed after the run.").count()
}

#[test]
fn an_edited_claim_asks_for_no_other_run() {
    let place = Place::new();
    let few = FILE.replace("2000", "200");
    let first = few.clone() + &claim("W1", "ls", "iv(4)", 1.0);
    place.write("own.toml", first.as_bytes());
    lines(&place, &["run", "own.toml", "--out", "own"]);
    let trials = std::fs::read_to_string(place.path("own/summary.json")).unwrap();
    // A claim of that run is no addition, whatever its id is now.
    place.write("own.toml", first.replace("W1", "W5").as_bytes());
    let text = lines(&place, &["run", "own.toml", "--out", "own"]);
    assert_eq!(added(&text), 0, "{text}");
    // Another limit, another pair, a measure and a share that the run did not keep.
    let more = few
        + &claim("W1", "ls", "iv(4)", 2.0)
        + &claim("W2", "iv(4)", "ls", 2.0)
        + "[[claims]]\nid = \"W3\"\ntest = { value = \"e_x0\", of = \"ls\", below = 1 }\n"
        + "[[claims]]\nid = \"W4\"\ntest = { share = \"failed\", of = \"ls\", below = 0.5 }\n";
    place.write("own.toml", more.as_bytes());
    let text = lines(&place, &["run", "own.toml", "--out", "own"]);
    for line in ["W1  holds", "W2  undecided", "W3  undecided", "W4  holds"] {
        assert!(text.lines().any(|other| other.starts_with(line)), "{line}: {text}");
    }
    assert_eq!(added(&text), 4, "{text}");
    let text = lines(&place, &["run", "own.toml", "--out", "own"]);
    assert_eq!(added(&text), 4, "{text}");
    let again = std::fs::read_to_string(place.path("own/summary.json")).unwrap();
    let cells = |text: &str| {
        let json: serde_json::Value = serde_json::from_str(text).unwrap();
        json["cells"].clone()
    };
    assert_eq!(cells(&trials), cells(&again));
}

/// To first order the error of least squares is proportional to the noise, trial by trial: twice the
/// noise on the same streams gives twice the error.
#[test]
fn cells_are_compared_trial_by_trial() {
    let place = Place::new();
    let settings = "trials = 400\nmeasures = [\"e_b\"]\n[settings]\neta = [0.1, 0.2, 0.4]\n";
    let cells = |id: &str, to: &str, between: &str| {
        format!(
            "[[claims]]\nid = \"{id}\"\ntest = {{ cells = \"e_a\", of = [\"ls\", \"iv(4)\"], \
             axis = \"eta\", from = 0.1, to = {to}, between = {between} }}\n"
        )
    };
    let claims = cells("twice", "0.2", "[1.9, 2.1]")
        + &cells("four", "0.4", "[3.7, 4.3]")
        + &cells("thrice", "[0.2, 0.4]", "[2.9, 3.1]");
    place.write("own.toml", (settings.to_owned() + &claims).as_bytes());
    let text = lines(&place, &["run", "own.toml", "--out", "own", "--block", "50"]);
    for line in ["twice  holds", "four  holds", "thrice  does not hold"] {
        let found = text.lines().any(|other| other.starts_with(line));
        assert!(found, "{line}: {text}");
    }
    let json = std::fs::read_to_string(place.path("own/summary.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["cell_pairs"].as_array().unwrap().len(), 4);
    assert_eq!(json["cell_pairs"][0]["ratio"]["both"], 400);
    // Other threads and blocks, the same bits.
    lines(
        &place,
        &["run", "own.toml", "--out", "other", "--block", "33", "--threads", "1"],
    );
    let files = ["own/summary.json", "other/summary.json"];
    let [own, other] = files.map(|file| std::fs::read(place.path(file)).unwrap());
    assert!(own == other);
}

/// A claim that is certain at once ends the run at its fewest trials, one at its own truth does not
/// end it before the most.
#[test]
fn a_claim_may_end_a_run() {
    let place = Place::new();
    for (below, trials) in [(1.0, 500), (0.97 / 1.297, 4000)] {
        let rule = "trials = { until = \"W1\", minimum = 500, maximum = 4000 }\n";
        let file = FILE.replace("trials = 2000\n", rule) + &claim("W1", "ls", "iv(4)", below);
        place.write("own.toml", file.as_bytes());
        let out = format!("own-{trials}");
        lines(&place, &["check", "own.toml"]);
        lines(&place, &["run", "own.toml", "--out", &out]);
        let manifest = std::fs::read_to_string(place.path(&format!("{out}/manifest.json")));
        let manifest: serde_json::Value = serde_json::from_str(&manifest.unwrap()).unwrap();
        assert_eq!(manifest["trials"], trials);
        // The same command computes nothing more, and says the same.
        let again = lines(&place, &["run", "own.toml", "--out", &out]);
        let word = if trials == 500 { "holds" } else { "undecided" };
        assert!(again.contains(&format!("W1  {word}")), "{again}");
    }
    let rule = "trials = { until = \"W9\", minimum = 5, maximum = 40 }\n";
    let file = FILE.replace("trials = 2000\n", rule) + &claim("W1", "ls", "iv(4)", 1.0);
    place.write("own.toml", file.as_bytes());
    let output = place.run(&["check", "own.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("trials.until") && text.contains("expected W1"), "{text}");
}

#[test]
fn later_claims_are_marked_and_other_files_may_judge() {
    let place = Place::new();
    let few = FILE.replace("2000", "200");
    place.write("own.toml", (few.clone() + &claim("W1", "ls", "iv(4)", 1.0)).as_bytes());
    lines(&place, &["run", "own.toml", "--out", "own"]);
    let both = few.clone() + &claim("W1", "ls", "iv(4)", 1.0) + &claim("W2", "ls", "iv(4)", 1.2);
    place.write("own.toml", both.as_bytes());
    lines(&place, &["run", "own.toml", "--out", "own"]);
    let text = lines(&place, &["report", "own"]);
    let line = |id: &str| text.lines().find(|other| other.starts_with(id)).unwrap_or_default();
    assert!(!text.is_empty() && line("W1  holds").contains("in all"), "{text}");
    let joined = text.replace('\n', " ");
    assert_eq!(joined.matches("after the run").count(), 1, "{text}");
    // Claims of another file, on the same results.
    place.write("other.toml", claim("X1", "ls", "iv(4)", 0.5).as_bytes());
    let text = lines(&place, &["report", "own", "--claims", "other.toml"]);
    assert!(
        text.lines().any(|other| other.starts_with("X1  does not hold")),
        "{text}"
    );
    assert!(!text.contains("W1  "), "{text}");
    let wrong = "[[claims]]\nid = \"X1\"\ntest = { share = \"failed\", of = \"ls2\", below = 1 }\n";
    place.write("other.toml", wrong.as_bytes());
    let output = place.run(&["report", "own", "--claims", "other.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("ls2") && text.lines().count() == 1, "{text}");
}

/// Numbers that a file asks for may have more digits than results are stored with: a bound, a cell, an axis, a slope.
#[test]
fn numbers_of_sixteen_digits_are_found_again() {
    let place = Place::new();
    let third = "0.3333333333333333";
    let tests = [
        "share = 'e_a', of = 'ls', bound = THIRD, above = 0",
        "cells = 'e_a', of = 'ls', axis = 'eta', from = THIRD, above = 1",
        "slope = 'e_a', of = 'ls', over = 'eta', from = THIRD, above = 0",
        "value = 'e_a', of = 'ls', below = 1 }\nwhere = { eta = THIRD",
    ];
    let claims = tests.iter().zip(1..);
    let claims = claims.map(|(test, i)| format!("[[claims]]\nid = 'W{i}'\ntest = {{ {test} }}\n"));
    let settings = format!("{FILE}\n{}", claims.collect::<String>());
    let settings = settings.replace("window = [98, 218]", "window = 98\neta = [THIRD, 2, 4]");
    place.write("own.toml", settings.replace("THIRD", third).as_bytes());
    let run = lines(&place, &["run", "own.toml", "--out", "own"]);
    for said in [run, lines(&place, &["report", "own"])] {
        let held = said
            .lines()
            .filter(|line| line.starts_with('W') && line.contains("  holds: "));
        assert_eq!(held.count(), 4, "{said}");
    }
}
