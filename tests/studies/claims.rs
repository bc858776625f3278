//! Claims of a file, from `check` to the report. Under 1/A noise least squares is asymptotically efficient: for the paper's
//! plant sqrt(N) rms e_a is 0.970, that of IV 1.297 (specification, section 7), so the truth of each claim is known.

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

fn claim(id: &str, of: &str, to: &str, below: f64) -> String {
    format!(
        "[[claims]]\nid = \"{id}\"\ntext = \"a claim\"\n\
         test = {{ ratio = \"e_a\", of = \"{of}\", to = \"{to}\", below = {below} }}\n"
    )
}

/// What a command that succeeds prints.
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
    let report = lines(&place, &["report", "own"]);
    for text in [&run, &report] {
        for line in expected {
            assert!(
                text.lines().any(|of| of.starts_with(line)),
                "{line}: {text}"
            );
        }
    }
    let page = std::fs::read_to_string(place.path("own/report.html")).unwrap();
    assert!(page.contains("The cells behind it: 2"));
}

/// How many verdicts say that their claims were added.
fn added(text: &str) -> usize {
    let words: Vec<&str> = text.split_whitespace().collect();
    words
        .join(" ")
        .matches("Added or changed after the run.")
        .count()
}

#[test]
fn an_edited_claim_asks_for_no_other_run() {
    let place = Place::new();
    let few = FILE.replace("2000", "200");
    let first = few.clone() + &claim("W1", "ls", "iv(4)", 1.0);
    place.write("own.toml", first.as_bytes());
    lines(&place, &["run", "own.toml", "--out", "own"]);
    let trials = std::fs::read_to_string(place.path("own/summary.json")).unwrap();
    // Another limit, another pair, a measure and a share that the run did not keep.
    let more = few
        + &claim("W1", "ls", "iv(4)", 2.0)
        + &claim("W2", "iv(4)", "ls", 2.0)
        + "[[claims]]\nid = \"W3\"\ntest = { value = \"e_x0\", of = \"ls\", below = 1 }\n"
        + "[[claims]]\nid = \"W4\"\ntest = { share = \"failed\", of = \"ls\", below = 0.5 }\n";
    place.write("own.toml", more.as_bytes());
    let text = lines(&place, &["run", "own.toml", "--out", "own"]);
    for line in ["W1  holds", "W2  undecided", "W3  undecided", "W4  holds"] {
        assert!(
            text.lines().any(|of| of.starts_with(line)),
            "{line}: {text}"
        );
    }
    assert_eq!(added(&text), 4, "{text}");
    // What was asked then is no addition, whatever it is called now.
    place.write("own.toml", first.replace("W1", "W5").as_bytes());
    let text = lines(&place, &["run", "own.toml", "--out", "own"]);
    assert_eq!(added(&text), 0, "{text}");
    place.write("own.toml", more.as_bytes());
    let text = lines(&place, &["run", "own.toml", "--out", "own"]);
    assert_eq!(added(&text), 4, "{text}");
    let again = std::fs::read_to_string(place.path("own/summary.json")).unwrap();
    let cells = |text: &str| {
        let json: serde_json::Value = serde_json::from_str(text).unwrap();
        json["cells"].clone()
    };
    assert_eq!(cells(&trials), cells(&again));
}
