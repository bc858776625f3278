//! `check --pilot`: what a few trials say of the claims, without a trace.

use super::{Place, stderr, stdout, succeeds};
use std::io::{BufRead, BufReader};

/// One claim that is plainly true, and one that few trials do not decide.
const FILE: &str = r#"
trials = 2000
measures = ["e_a"]
[settings]
window = 218
[[claims]]
id = "W1"
test = { ratio = "e_a", of = "ls", to = "iv(4)", below = 1 }
[[claims]]
id = "W2"
test = { ratio = "e_a", of = "ls", to = "iv(4)", below = 0.75 }
"#;

fn names(place: &Place) -> Vec<String> {
    let entries = std::fs::read_dir(place.path(".")).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn piloted(place: &Place, arguments: &[&str]) -> String {
    let output = place.run(arguments);
    succeeds(&output);
    let text = stdout(&output);
    let pilot = text.find("\npilot").expect("a pilot");
    let pilot = &text[pilot + 1..];
    for line in pilot.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    pilot.to_owned()
}

#[test]
fn a_pilot_foretells_and_leaves_nothing() {
    let place = Place::new();
    place.write("own.toml", FILE.as_bytes());
    let before = names(&place);
    let text = piloted(&place, &["check", "own.toml", "--pilot", "200"]);
    assert_eq!(names(&place), before);
    let words = text.split_whitespace().collect::<Vec<&str>>().join(" ");
    for part in [
        "pilot 200 trials of each cell",
        "W1 holds in the pilot: the median ratio",
        "200 trials were enough for the pilot.",
        "W2 undecided in the pilot: the median ratio",
        "threads of this machine.",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    // The number that is said to decide is the one that the time is for.
    let undecided = words.split("W2 undecided in the pilot").nth(1);
    let before = undecided.and_then(|rest| rest.split(" trials").next());
    let number = before.and_then(|text| text.rsplit("; ").next());
    let number = number.unwrap_or_default();
    assert!(number.ends_with(|c: char| c.is_ascii_digit()), "{words}");
    assert!(words.contains(&format!("It would take {number} trials")), "{words}");
    // Other random numbers than those of the study: another number of the same kind.
    let run = place.run(&["run", "own.toml", "--trials", "200"]);
    let run = stdout(&run).split_whitespace().collect::<Vec<&str>>().join(" ");
    let number = |text: &str| text.split("over iv(4), is ").nth(1).map(|rest| rest[..6].to_owned());
    assert!(
        number(&run).is_some() && number(&run) != number(&words),
        "{run} {words}"
    );
}

#[test]
fn a_pilot_in_continuous_time() {
    let place = Place::new();
    let file = r#"
trials = 40
measures = ["rms_x"]
[continuous]
until = 6
scored_from = 2
error_limit = 0.1
[settings]
disturbance = "white"
level = 0.4
noise_hold = 0.05
step = 0.05
[[observers]]
observer = "luenberger"
gain = [2, 3.2]
[[claims]]
id = "B"
test = { value = "rms_x", of = "luenberger", below = 1e6 }
"#;
    place.write("own.toml", file.as_bytes());
    let before = names(&place);
    let text = piloted(&place, &["check", "own.toml", "--pilot", "20"]);
    assert!(text.contains("\nB  holds in the pilot: "), "{text}");
    assert_eq!(names(&place), before);
}

#[test]
fn pilots_that_say_nothing_are_refused() {
    let place = Place::new();
    place.write("own.toml", FILE.as_bytes());
    let expected = "expected 20 to 2000";
    for trials in ["0", "19", "2001"] {
        place.refuses(&["check", "own.toml", "--pilot", trials], &["--pilot", expected]);
    }
    place.refuses(&["check", "own.toml", "--pilot", "-3"], &["--pilot"]);
    place.refuses(&["check", "own.toml", "--pilot", "9", "--trials", "10"], &["10 trials"]);
    place.refuses(&["check", "everything.toml", "--pilot", "20"], &["[[claims]]"]);
}

#[cfg(unix)]
#[test]
fn a_pilot_can_be_interrupted() {
    let place = Place::new();
    let long = FILE.replace("trials = 2000", "trials = 4000000000");
    place.write("own.toml", long.as_bytes());
    let before = names(&place);
    let mut command = place.command(&["check", "own.toml", "--pilot", "4000000000"]);
    let piped = std::process::Stdio::piped;
    command.stdout(piped()).stderr(piped());
    let mut child = command.spawn().expect("the program runs");
    let id = child.id().to_string();
    // From its first line on it hears Ctrl-C.
    let mut line = String::new();
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe"));
    lines.read_line(&mut line).expect("a line");
    assert!(line.starts_with("title"), "{line}");
    let rest = std::thread::spawn(move || std::io::copy(&mut lines, &mut std::io::sink()));
    let sent = std::process::Command::new("kill").args(["-INT", &id]).status();
    assert!(sent.expect("kill runs").success());
    let output = child.wait_with_output().expect("ended");
    rest.join().expect("no panic").expect("read to its end");
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("interrupted; a pilot leaves nothing behind"), "{said}");
    assert_eq!(names(&place), before);
}
