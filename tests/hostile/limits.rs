//! Files and machines that ask for too much: an answer in a line, and soon.

use crate::common::{PROGRAM, stderr};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Far more than an answer takes, and far less than what went wrong took: 20 s and more where the program is optimised.
const SOON: Duration = Duration::from_secs(15);

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let begin = Instant::now();
    let output = Command::new(PROGRAM)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("runs");
    assert!(begin.elapsed() < SOON, "{arguments:?}: {:?}", begin.elapsed());
    output
}

/// One line that has these parts, and no more than a reader wants.
fn refuses(folder: &Path, arguments: &[&str], parts: &[&str]) {
    let output = run(folder, arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(said.lines().count() == 1 && said.len() < 1200, "{said}");
    for part in parts {
        assert!(said.contains(part), "no '{part}' in: {said}");
    }
}

#[test]
fn long_names_and_long_lists_are_refused_soon() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path();
    let long = "a".repeat(5_000_000);
    let numbers = vec!["0.1"; 100_000].join(", ");
    let method = "\n[[methods]]\nestimator = \"arx\"\n";
    for (text, part) in [
        (
            format!("\"{long}\" = 1\n[settings]\nwindow = 98{method}"),
            "unknown key 'aaa",
        ),
        (format!("[settings]\n\"{long}\" = 1{method}"), "unknown setting 'aaa"),
        (format!("[settings]\nplant = \"{long}\"{method}"), "plant"),
        (
            format!("[[methods]]\nestimator = \"{long}\"\n"),
            "unknown estimator 'aaa",
        ),
        (
            format!("[settings]\nplant = \"p\"\n[plants.p]\nA = [1, {numbers}]\nB = [0, 1]{method}"),
            "plants.p: an order of 100000; expected at most 1000",
        ),
        (
            format!("[settings]\nplant = \"p\"\n[plants.p]\na = [{numbers}]\nb = [{numbers}]{method}"),
            "plants.p: an order of 100000; expected at most 1000",
        ),
    ] {
        std::fs::write(folder.join("study.toml"), text).expect("written");
        refuses(folder, &["check", "study.toml"], &["study.toml: ", part]);
    }
}

/// Tables that are never closed, with closed ones where no value is due: a parser that counts the latter as an end of
/// the former goes deeper with every line.
#[test]
fn unclosed_tables_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let text = "t = { a b \"\na = { b = 1 }\n".repeat(4000);
    std::fs::write(place.path().join("study.toml"), text).expect("written");
    refuses(place.path(), &["check", "study.toml"], &["study.toml: line 1"]);
}

/// A limit of the system on the size of files is an error of the file, not a signal without a word.
#[test]
fn a_limit_of_file_sizes_is_named() {
    let place = tempfile::tempdir().expect("a folder");
    let text = "trials = 2000\nstore = \"trials\"\n[settings]\nwindow = 98\n[[methods]]\nestimator = \"arx\"\n";
    std::fs::write(place.path().join("study.toml"), text).expect("written");
    for (blocks, code) in [("0", 2), ("1", 1), ("8", 1)] {
        let command = format!("ulimit -f {blocks}; exec \"$0\" run study.toml --out out");
        let output = Command::new("bash")
            .args(["-c", &command, PROGRAM])
            .current_dir(place.path())
            .output()
            .expect("bash");
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{blocks}: {said}");
        assert!(said.contains("out") && said.contains("File too large"), "{said}");
    }
}

/// The program has a stack of its own. Where there is no memory for it, it says so.
#[test]
fn a_small_stack_is_enough() {
    let place = tempfile::tempdir().expect("a folder");
    let text = "trials = 20\n[settings]\nwindow = 98\n[[methods]]\nestimator = \"arx\"\n";
    std::fs::write(place.path().join("study.toml"), text).expect("written");
    for command in ["run study.toml --out out", "report out --out page", "methods"] {
        let command = format!("ulimit -s 64; exec \"$0\" {command}");
        let output = Command::new("bash")
            .args(["-c", &command, PROGRAM])
            .current_dir(place.path())
            .output()
            .expect("bash");
        assert_eq!(output.status.code(), Some(0), "{command}: {}", stderr(&output));
    }
}

#[test]
fn nothing_is_no_experiment() {
    let place = tempfile::tempdir().expect("a folder");
    for command in [&["run", "-", "--out", "out"][..], &["check", "-"]] {
        refuses(
            place.path(),
            command,
            &["standard input is empty; expected an experiment file"],
        );
    }
}

#[test]
fn throughput_of_a_program_says_what_it_times() {
    let place = tempfile::tempdir().expect("a folder");
    let text = "[settings]\nwindow = 98\n[[methods]]\nname = \"mine\"\ncommand = [\"false\"]\n";
    std::fs::write(place.path().join("study.toml"), text).expect("written");
    refuses(
        place.path(),
        &["throughput", "study.toml"],
        &[
            "method 'mine' is a program",
            "throughput times methods of asobench only",
        ],
    );
}

/// Theory of a plant with hundreds of coefficients would take minutes: it says so, in a run and by itself.
#[test]
fn theory_has_a_limit() {
    let place = tempfile::tempdir().expect("a folder");
    let text = |order: usize| {
        let a = vec!["0.001"; order].join(", ");
        format!(
            "trials = 2\nmeasures = [\"e_a\"]\n[settings]\nplant = \"p\"\nwindow = 300\nhorizon = 300\neta = 10\n\
             [plants.p]\nA = [1, {a}]\nB = [0, 1]\n[[methods]]\nestimator = \"arx\"\n"
        )
    };
    std::fs::write(place.path().join("study.toml"), text(80)).expect("written");
    let output = run(place.path(), &["theory", "study.toml"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        said.contains("80 coefficients of a polynomial; theory is for 60 at most"),
        "{said}"
    );
    let output = run(place.path(), &["run", "study.toml", "--out", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    // A small one has theory.
    std::fs::write(place.path().join("study.toml"), text(2)).expect("written");
    let output = run(place.path(), &["theory", "study.toml"]);
    assert!(!String::from_utf8_lossy(&output.stdout).contains("no theory"));
}

/// A trial of order 1000 takes seconds: Ctrl-C and SIGTERM end the run meanwhile, with the code of what was asked for.
#[test]
fn a_long_trial_is_interrupted_within_a_second() {
    let place = tempfile::tempdir().expect("a folder");
    let text = "trials = 50\nmeasures = [\"e_a\"]\n[settings]\nwindow = 4000\nhorizon = 4000\norder = 1000\n\
                [[methods]]\nestimator = \"arx\"\n";
    std::fs::write(place.path().join("study.toml"), text).expect("written");
    // `check` has no handler, so the signal itself ends it; SIGINT would be ignored where the tests run in the
    // background.
    for (command, signal, code) in [
        (["run", "study.toml"], "-INT", 130),
        (["check", "study.toml"], "-TERM", -1),
    ] {
        let mut child = Command::new(PROGRAM)
            .args(command)
            .args(["--out", "out"])
            .current_dir(place.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("runs");
        std::thread::sleep(Duration::from_secs(3));
        assert_eq!(child.try_wait().expect("waits"), None, "{command:?} ended by itself");
        let number = child.id().to_string();
        let killed = Command::new("kill").args([signal, &number]).status();
        assert!(killed.expect("kill").success());
        let begin = Instant::now();
        let status = child.wait().expect("waits");
        assert!(
            begin.elapsed() < Duration::from_secs(3),
            "{command:?}: {:?}",
            begin.elapsed()
        );
        assert_eq!(status.code().unwrap_or(-1), code, "{command:?}");
    }
}
