//! Nothing is started without a word from the user.

use super::{root, runs};
use crate::common::PROGRAM;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A worker that leaves a file where it runs.
const WORKER: &str = "open('started', 'w')\nexec(open(__import__('sys').argv[1]).read())\n";

pub fn asobench(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(PROGRAM)
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
        line.contains("python3 (method mine) worker.py") && line.contains("--allow-commands"),
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

/// Results are of a program that says the same version: a run that finds them says so. Their manifest runs the program
/// in the current folder, as `replay` does.
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

/// A terminal of 80 columns, to which the command of the arguments writes; its answer is "n".
const TERMINAL: &str = r#"
import os, pty, sys
child, end = pty.fork()
if child == 0:
    os.execv(sys.argv[1], sys.argv[1:])
seen = b""
while True:
    try:
        part = os.read(end, 65536)
    except OSError:
        break
    if not part:
        break
    if b"[y/N] " in part:
        os.write(end, b"n\n")
    seen += part
os.waitpid(child, 0)
sys.stdout.buffer.write(seen)
"#;

/// A command, its folder or its file may be padded with blanks: the program is named, and all that is not shown is
/// counted.
#[test]
fn a_padded_command_is_seen() {
    if !runs(&["python3", "-c", "import pty"]) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let program = PROGRAM;
    let blanks = " ".repeat(3144);
    let many: Vec<String> = (0..500).map(|i| format!("a{i}")).collect();
    let many: Vec<&str> = ["rm", "-rf"]
        .into_iter()
        .chain(many.iter().map(String::as_str))
        .collect();
    let long = "x".repeat(5000);
    for (command, parts) in [
        (
            vec!["rm", "-rf", &blanks, "ls"],
            &[
                "rm (method",
                "-rf \\ \\ \\ ",
                "characters",
                "... 1 more arguments, 2 characters",
            ][..],
        ),
        (
            vec!["rm", "-rf", "a   b\t\u{3000}\u{202e}c"],
            &["rm (method", "-rf a\\ \\ \\ b\\t\\u{3000}\\u{202e}c"],
        ),
        (many, &["rm (method", "-rf a0 a1", "more arguments"]),
        (vec![&long, "-rf"], &["xxx... ", "-rf"]),
        (
            vec!["rm", "", "\n\n\n\n"],
            &["rm (method", "'' \\n\\n\\n\\n"],
        ),
    ] {
        let file = format!("{}study.toml", " ".repeat(200));
        let study = format!(
            "trials = 2\n[settings]\neta = 10\n[[methods]]\nname = \"m{}e\"\ncommand = {}\n",
            " ".repeat(150),
            serde_json::to_string(&command).unwrap()
        );
        std::fs::write(folder.join(&file), study).unwrap();
        let piped = asobench(folder, &["run", &file]);
        let terminal = Command::new("python3")
            .args(["-c", TERMINAL, program, "run", &file])
            .current_dir(folder)
            .env("XDG_STATE_HOME", folder.join("state"))
            .output()
            .unwrap();
        for (shown, most) in [
            (text(&piped.stderr), 1000),
            (text(&terminal.stdout), 80 * 22),
        ] {
            for part in parts {
                assert!(shown.contains(part), "{part}: {shown}");
            }
            assert!(!shown.contains("    "), "{shown}");
            let lines = shown.lines().map(|line| line.chars().count().div_ceil(80));
            assert!(
                shown.chars().count() <= most && lines.sum::<usize>() <= 22,
                "{shown}"
            );
            assert!(
                shown.contains("--allow-commands")
                    || shown.contains("Is that what you want? [y/N]")
            );
        }
        assert!(!folder.join("results").exists());
    }
}
