//! The same bits in every file for any number of threads, any blocks, any history of a folder.

use super::{Contents, Place, assert_same, blocks, contents, stderr, succeeds};

/// The files that a study writes.
const FILES: [&str; 4] = ["manifest.json", "summary.json", "summary.parquet", "trials.parquet"];

fn names(contents: &Contents) -> Vec<&str> {
    contents.keys().map(String::as_str).collect()
}

#[test]
fn threads_and_blocks_move_no_bit() {
    let place = Place::new();
    let expected = place.results("first", &["--threads", "1"]);
    assert_eq!(names(&expected), FILES);
    for (threads, block) in [("2", "7"), ("5", "64"), ("1", "1000"), ("2", "1000"), ("5", "399")] {
        let out = format!("out-{threads}-{block}");
        let found = place.results(&out, &["--threads", threads, "--block", block]);
        assert_same(&found, &expected, &out);
    }
    // Another seed gives other bits: the comparison can fail.
    let other = place.results("other", &["--set", "seed=6"]);
    for name in FILES {
        assert!(other[name] != expected[name], "{name}");
    }
}

#[test]
fn extension_gives_the_bits_of_one_run() {
    let place = Place::new();
    let expected = place.results("once", &["--trials", "900"]);
    let first = place.results("twice", &["--trials", "300", "--block", "77", "--threads", "2"]);
    assert!(first["summary.json"] != expected["summary.json"]);
    let before = blocks(&place.path("twice"));
    let extended = place.results("twice", &["--trials", "900", "--block", "100", "--threads", "1"]);
    assert_same(&extended, &expected, "extended");
    // The first blocks are there still: nothing was computed twice.
    let after = blocks(&place.path("twice"));
    assert!(before.iter().all(|block| after.contains(block)));
    // Once more with nothing to do: the same files.
    let again = place.results("twice", &["--trials", "900"]);
    assert_same(&again, &expected, "again");
    assert_eq!(blocks(&place.path("twice")), after);
    // Fewer are refused, and nothing changes.
    let fewer = ["run", "everything.toml", "--out", "twice", "--trials", "300"];
    place.refuses(&fewer, &["twice", "up to trial 900", "300"]);
    assert_same(&contents(&place.path("twice")), &expected, "refused");
}

#[test]
fn summaries_are_those_of_stored_trials() {
    let place = Place::new();
    let summaries = ["--set", "store=summaries"];
    let with = |more: &[&'static str]| [&summaries[..], more].concat();
    let expected = place.results("once", &with(&["--trials", "900"]));
    assert_eq!(names(&expected), &FILES[..3]);
    place.results("twice", &with(&["--trials", "300", "--block", "7", "--threads", "5"]));
    let extended = place.results("twice", &with(&["--trials", "900", "--block", "64"]));
    assert_same(&extended, &expected, "extended");
    assert_eq!(blocks(&place.path("twice")).len(), 12, "one block for each cell");
    // Stored trials move no figure.
    let trials = place.results("trials", &["--trials", "900"]);
    for name in ["summary.json", "summary.parquet"] {
        assert!(trials[name] == expected[name], "{name}");
    }
}

/// A rule whose target some cells meet on the way and others never.
const UNTIL: &str = "trials={ until = 'e_a', output = 'iv(2)', relative_mcse = 0.05, minimum = 150, maximum = 400 }";

#[test]
fn a_rule_for_the_number_of_trials_moves_no_bit() {
    let place = Place::new();
    for store in ["store=trials", "store=summaries"] {
        let out = |name: &str| format!("{name}-{store}");
        let rule = ["--set", UNTIL, "--set", store];
        let with = |more: &[&'static str]| [&rule[..], more].concat();
        let expected = place.results(&out("one"), &with(&["--threads", "1"]));
        let manifest: serde_json::Value = serde_json::from_slice(&expected["manifest.json"]).expect("JSON");
        let trials = manifest["trials"].as_array().expect("a number for each cell");
        let trials: Vec<u64> = trials.iter().map(|count| count.as_u64().expect("a number")).collect();
        assert!(trials.iter().all(|count| [150, 300, 400].contains(count)), "{trials:?}");
        for count in [300, 400] {
            assert!(trials.contains(&count), "{trials:?}");
        }
        for (threads, block) in [("2", "64"), ("5", "1000")] {
            let name = out(threads);
            let found = place.results(&name, &with(&["--threads", threads, "--block", block]));
            assert_same(&found, &expected, &name);
        }
        // After a part of it by a plain number, with blocks of another size.
        let name = out("part");
        place.results(&name, &["--trials", "100", "--block", "30", "--set", store]);
        let found = place.results(&name, &rule);
        assert_same(&found, &expected, &name);
        // Killed on the way.
        let name = out("killed");
        let arguments = [
            &[
                "run",
                "everything.toml",
                "--out",
                &name,
                "--block",
                "2",
                "--threads",
                "1",
            ],
            &rule[..],
        ]
        .concat();
        let mut child = place.start(&arguments);
        // However fast the machine is: an ended run has one block for each cell.
        let mut ended = || child.try_wait().expect("a state").is_some();
        super::wait_until(|| blocks(&place.path(&name)).len() > 20 || ended());
        child.kill().expect("killed");
        child.wait().expect("ended");
        let found = place.results(&name, &rule);
        assert_same(&found, &expected, &name);
    }
}

/// Language and time zone have nothing to say.
#[test]
fn the_environment_moves_no_bit() {
    let place = Place::new();
    let expected = place.results("plain", &["--trials", "30"]);
    for (i, (locale, zone)) in [("de_DE.UTF-8", "Asia/Kolkata"), ("tr_TR.UTF-8", "America/St_Johns")]
        .into_iter()
        .enumerate()
    {
        let out = format!("out{i}");
        let mut command = place.command(&["run", "everything.toml", "--trials", "30", "--out", &out]);
        command.env("LC_ALL", locale).env("LANG", locale).env("TZ", zone);
        let output = command.output().expect("the program runs");
        succeeds(&output);
        let speed = stderr(&output);
        assert!(speed.lines().all(|line| line.contains(" trials/s: ")), "{speed}");
        assert_same(&contents(&place.path(&out)), &expected, locale);
    }
}
