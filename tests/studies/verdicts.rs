//! The verdicts of a run and a report on the claims of a user's own file: the truth of each is known
//! from theory (see `claims`).

use super::{Place, stdout, succeeds};

const OWN: &str = r#"
title = "Three claims"
trials = 2000
measures = ["e_a"]
[settings]
window = [98, 218]
[[methods]]
estimator = "iv"
report = [0, 4]

[[claims]]
id = "W1"
text = "Least squares is more exact than IV."
test = { ratio = "e_a", of = "ls", to = "iv(4)", below = 1 }
[[claims]]
id = "W2"
text = "IV is more exact than least squares."
source = "a paper, page 3"
test = { ratio = "e_a", of = "iv(4)", to = "ls", below = 1 }
[[claims]]
id = "W3"
text = "As near to the truth as these trials do not tell."
test = { ratio = "e_a", of = "ls", to = "iv(4)", below = 0.748 }
"#;

const VERDICTS: [&str; 3] = ["W1  holds: ", "W2  does not hold: ", "W3  undecided: "];

#[test]
fn three_claims_from_check_to_the_page() {
    let place = Place::new();
    place.write("own.toml", OWN.as_bytes());
    succeeds(&place.run(&["check", "own.toml"]));
    let run = place.run(&["run", "own.toml", "--out", "own"]);
    succeeds(&run);
    let report = place.run(&["report", "own"]);
    succeeds(&report);
    for text in [stdout(&run), stdout(&report)] {
        for line in VERDICTS {
            let found = text.lines().filter(|other| other.starts_with(line)).count();
            assert_eq!(found, 1, "{line}: {text}");
        }
        let widest = text.lines().map(|line| line.chars().count()).max();
        assert!(widest.is_some_and(|widest| widest <= 80), "{text}");
    }
    let text = stdout(&run);
    for part in ["window  ls ", "median e_a", "No trial was lost.", "asobench report own"] {
        assert!(text.contains(part), "no '{part}': {text}");
    }
    the_page(&place);
}

/// Each claim has a part of its own, with verdict, picture and cells before the next one's.
fn the_page(place: &Place) {
    let page = std::fs::read_to_string(place.path("own/report.html")).unwrap();
    let parts: Vec<&str> = page.split("<article ").skip(1).collect();
    assert_eq!(parts.len(), 3);
    let verdicts = ["holds", "does not hold", "undecided"];
    for (i, (part, verdict)) in parts.iter().zip(verdicts).enumerate() {
        let id = format!("W{}", i + 1);
        assert!(part.starts_with(&format!("id=\"own:{id}\">")), "{part}");
        let end = part.find("</article>").unwrap();
        let places = [&format!("<h3>{id} "), verdict, "<svg", "<details>"];
        for text in places {
            assert!(part[..end].contains(text), "{id}: no '{text}'");
        }
        for kind in ["figures", "tables"] {
            let extension = if kind == "figures" { "svg" } else { "csv" };
            let path = format!("own/{kind}/own-claim-{id}.{extension}");
            assert!(place.path(&path).is_file(), "{path}");
        }
    }
    let table = std::fs::read_to_string(place.path("own/tables/own-claim-W2.csv")).unwrap();
    assert!(
        table.starts_with("cell,value,verdict,p (pass),p (fail),level"),
        "{table}"
    );
    assert_eq!(table.lines().filter(|line| line.contains(",fail,")).count(), 2);
    // The rest comes after the claims.
    let rest = page.find("Pictures and tables of all measures").unwrap();
    assert!(page.rfind("</article>").unwrap() < rest);
}

/// Two ids of which files that differ in case would be written are refused, as other names are.
#[test]
fn ids_that_differ_in_case_only_are_refused() {
    let place = Place::new();
    place.write("own.toml", OWN.replace("\"W2\"", "\"w1\"").as_bytes());
    place.refuses(&["check", "own.toml"], &["claims[1].id", "two claims"]);
}

/// A verdict on times names the processor that times.json names.
#[test]
fn times_are_of_a_machine() {
    let place = Place::new();
    let file = "trials = 20\ntiming = true\n[settings]\nwindow = 98\n[[methods]]\nestimator = \"iv\"\n\
                [[methods]]\nestimator = \"ls\"\nname = \"other\"\n\
                [[claims]]\nid = \"W1\"\ntest = { time = \"estimate\", of = \"other\", to = \"iv\", below = 1 }\n";
    place.write("own.toml", file.as_bytes());
    succeeds(&place.run(&["run", "own.toml", "--out", "own"]));
    let path = place.path("own/timing/times.json");
    let mut times: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert!(times["machine"].as_str().is_some_and(|name| !name.is_empty()));
    times["machine"] = "an abacus".into();
    let damaged = times.to_string();
    times.as_object_mut().unwrap().remove("checksum");
    place.write("own/timing/times.json", damaged.as_bytes());
    place.refuses(&["report", "own"], &["times.json", "the checksum differs"]);
    place.write("own/timing/times.json", times.to_string().as_bytes());
    let report = place.run(&["report", "own"]);
    succeeds(&report);
    let words: Vec<String> = stdout(&report).split_whitespace().map(str::to_owned).collect();
    let text = words.join(" ");
    assert!(text.contains("Measured on an abacus, one thread."), "{text}");
}
