//! Nothing is started without a word from the user.

use super::{root, runs};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A worker that leaves a file where it runs.
const WORKER: &str = "open('started', 'w')\nexec(open(__import__('sys').argv[1]).read())\n";

pub fn asobench(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_asobench"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_STATE_HOME", folder.join("state"))
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn no_command_starts_a_program_by_itself() {
    if !runs(&["python3", "-c", "1"]) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let worker = root().join("examples/workers/least_squares.py");
    std::fs::write(folder.join("worker.py"), WORKER).unwrap();
    let study = format!(
        "trials = 20\nstore = \"trials\"\n[settings]\nwindow = 98\neta = 10\n[[methods]]\nname = \"mine\"\nbatch = 10\n\
         command = [\"python3\", \"worker.py\", {:?}]\n",
        worker.display().to_string()
    );
    std::fs::write(folder.join("study.toml"), study).unwrap();
    let started = || folder.join("started").exists();

    let refused = asobench(folder, &["run", "study.toml"]);
    assert_eq!(refused.status.code(), Some(2));
    let line = text(&refused.stderr);
    assert!(
        line.contains("mine: python3 worker.py") && line.contains("--allow-commands"),
        "{line}"
    );
    let checked = asobench(folder, &["check", "study.toml"]);
    assert_eq!(checked.status.code(), Some(0), "{}", text(&checked.stderr));
    for arguments in [
        &["plan", "study.toml", "--shards", "2"][..],
        &["throughput", "study.toml"],
        &["test-method", "study.toml"],
    ] {
        let other = asobench(folder, arguments);
        assert_ne!(other.status.code(), Some(0), "{arguments:?}");
    }
    assert!(!started() && !folder.join("results").exists());

    let ran = asobench(folder, &["run", "study.toml", "--allow-commands"]);
    assert_eq!(ran.status.code(), Some(0), "{}", text(&ran.stderr));
    assert!(started());
    std::fs::remove_file(folder.join("started")).unwrap();
    let manifest = std::fs::read_to_string(folder.join("results/study/manifest.json")).unwrap();
    assert!(
        manifest.contains("\"worker\":\"least squares in Python 1.0\"")
            || manifest.contains("\"worker\": \"least squares in Python 1.0\"")
    );

    // What is there is read, and a replay asks.
    let report = asobench(folder, &["report", "results/study"]);
    assert_eq!(report.status.code(), Some(0), "{}", text(&report.stderr));
    let replay = asobench(folder, &["replay", "results/study", "0:3"]);
    assert_eq!(replay.status.code(), Some(2));
    assert!(text(&replay.stderr).contains("--allow-commands"));
    assert!(!started());
    let replay = asobench(
        folder,
        &["replay", "results/study", "0:3", "--allow-commands"],
    );
    assert_eq!(replay.status.code(), Some(0), "{}", text(&replay.stderr));
    assert!(text(&replay.stdout).contains("bit for bit") && started());
}

/// Results are of a program that says the same version: a run that finds them says so. Their manifest runs the program in
/// the current folder, as `replay` does.
#[test]
fn results_that_are_there_are_not_computed_again() {
    if !runs(&["python3", "-c", "1"]) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let worker = root().join("examples/workers/least_squares.py");
    std::fs::copy(worker, folder.join("mine.py")).unwrap();
    let study = "trials = 20\n[settings]\neta = 10\n[[methods]]\nname = \"mine\"\nbatch = 10\n\
                 command = [\"python3\", \"mine.py\"]\n";
    std::fs::write(folder.join("study.toml"), study).unwrap();
    let run = |arguments: &[&str]| {
        let ran = asobench(folder, arguments);
        assert_eq!(ran.status.code(), Some(0), "{}", text(&ran.stderr));
        text(&ran.stderr)
    };
    let command = ["run", "study.toml", "--allow-commands"];
    assert!(!run(&command).contains("nothing to compute"));
    let again = run(&command);
    assert!(
        again.contains("nothing to compute") && again.contains("another \"version\""),
        "{again}"
    );
    let manifest = [
        "run",
        "results/study/manifest.json",
        "--allow-commands",
        "--out",
        "again",
    ];
    run(&manifest);
    let content = |out: &str| std::fs::read(folder.join(out).join("summary.json")).unwrap();
    assert!(content("results/study") == content("again"));
}
