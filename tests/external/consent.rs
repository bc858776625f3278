//! Nothing is started without a word from the user.

use super::root;
use crate::common::PROGRAM;
use crate::common::{PYTHON, runs};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A worker that leaves a file where it runs.
const WORKER: &str = "open('started', 'w')\nprint('begun', flush=True)\nexec(open(__import__('sys').argv[1]).read())\n";

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
    if !runs(PYTHON) {
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
    // Its output is kept, but never in a file of somebody else.
    let log = folder.join("results/study/workers.log");
    let printed = std::fs::read_to_string(&log).unwrap();
    assert!(
        printed.starts_with("# asobench: what workers printed\n") && printed.contains("begun"),
        "{printed}"
    );
    std::fs::write(&log, "my notes").unwrap();
    let more = ["run", "study.toml", "--allow-commands", "--trials", "30"];
    let more = asobench(folder, &more);
    assert_eq!(more.status.code(), Some(0), "{}", text(&more.stderr));
    assert!(text(&more.stderr).contains("the output of the programs is lost"));
    assert_eq!(std::fs::read(&log).unwrap(), b"my notes");
    std::fs::remove_file(folder.join("started")).unwrap();
    let manifest = std::fs::read_to_string(folder.join("results/study/manifest.json")).unwrap();
    assert!(
        manifest.contains("\"worker\":\"least squares in Python 1.0\"")
            || manifest.contains("\"worker\": \"least squares in Python 1.0\"")
    );

    // Results that are there are read, and a replay asks.
    let report = asobench(folder, &["report", "results/study"]);
    assert_eq!(report.status.code(), Some(0), "{}", text(&report.stderr));
    let replay = asobench(folder, &["replay", "results/study", "0:3"]);
    assert_eq!(replay.status.code(), Some(2));
    assert!(text(&replay.stderr).contains("--allow-commands"));
    assert!(!started());
    let replay = asobench(folder, &["replay", "results/study", "0:3", "--allow-commands"]);
    assert_eq!(replay.status.code(), Some(0), "{}", text(&replay.stderr));
    assert!(text(&replay.stdout).contains("bit for bit") && started());
}

/// A study of programs, each of which leaves a file with its own name.
fn study_of(folder: &Path, names: &[&str]) -> Vec<String> {
    let worker = root().join("examples/workers/least_squares.py");
    let source = "open(__import__('sys').argv[2], 'w')\nexec(open(__import__('sys').argv[1]).read())\n";
    std::fs::write(folder.join("worker.py"), source).unwrap();
    let worker = worker.to_str().unwrap();
    let commands: Vec<String> = names
        .iter()
        .map(|name| serde_json::to_string(&["python3", "worker.py", worker, name]).unwrap())
        .collect();
    let methods = names
        .iter()
        .zip(&commands)
        .map(|(name, command)| format!("[[methods]]\nname = \"{name}\"\nbatch = 4\ncommand = {command}\n"));
    let methods = methods.collect::<String>();
    let study = format!("trials = 4\n[settings]\nwindow = 98\neta = 10\n{methods}");
    std::fs::write(folder.join("study.toml"), study).unwrap();
    commands
}

/// Consent is given to the text of a command: of a study with two programs, the one that was not named starts nowhere.
#[test]
fn consent_to_one_command_is_none_to_another() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let commands = study_of(folder, &["one", "two"]);
    let own = ["--allow-command", &commands[0]];
    let both = [own, ["--allow-command", &commands[1]]].concat();
    let started = |name: &str| folder.join(name).exists();
    let refuse = |arguments: &[&str]| {
        let refused = asobench(folder, &[arguments, &own].concat());
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(
            said.contains("(method two)") && !said.contains("(method one)"),
            "{said}"
        );
        assert!(!started("one") && !started("two"), "{arguments:?}");
    };
    for command in ["run", "plan", "test-method", "slurm"] {
        refuse(&[command, "study.toml"]);
    }
    let ran = asobench(folder, &[&["run", "study.toml"], &both[..]].concat());
    assert_eq!(ran.status.code(), Some(0), "{}", text(&ran.stderr));
    assert!(started("one") && started("two"));
    let planned = asobench(folder, &["plan", "study.toml", "--shards", "1", "--allow-commands"]);
    assert_eq!(planned.status.code(), Some(0), "{}", text(&planned.stderr));
    for name in ["one", "two"] {
        std::fs::remove_file(folder.join(name)).unwrap();
    }
    refuse(&["replay", "results/study", "0:1"]);
    refuse(&["shard", "study.plan.json", "1"]);
    refuse(&["run", "results/study/manifest.json", "--out", "again"]);
    let replay = asobench(folder, &[&["replay", "results/study", "0:1"], &both[..]].concat());
    assert_eq!(replay.status.code(), Some(0), "{}", text(&replay.stderr));
    // A part of the text is another text, and what is no list of texts is refused.
    for (given, part) in [
        ("[\"python3\", \"worker.py\"]", "starts a program"),
        ("python3 worker.py", "expected a JSON list of texts"),
        ("[\"python3\", 1]", "expected a JSON list of texts"),
    ] {
        let refused = asobench(folder, &["run", "study.toml", "--allow-command", given]);
        assert_eq!(refused.status.code(), Some(2));
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
    }
}

/// The suite asks for a newcomer that is a program, as a run does.
#[test]
fn the_suite_asks_too() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let commands = study_of(folder, &["newcomer"]);
    let started = || folder.join("newcomer").exists();
    let part = ["study.toml", "--only", "P01", "--first", "2"];
    for command in [&["suite"][..], &["suite", "times"]] {
        let arguments = [command, &part].concat();
        let refused = asobench(folder, &arguments);
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(
            said.contains("python3 (method newcomer) worker.py") && said.contains("--allow-commands"),
            "{said}"
        );
        let other = asobench(folder, &[&arguments[..], &["--allow-command", "[\"true\"]"]].concat());
        assert_eq!(other.status.code(), Some(2));
        assert!(!started());
        let own = ["--allow-command", &commands[0]];
        let done = asobench(folder, &[&arguments[..], &own].concat());
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        assert!(started());
        std::fs::remove_file(folder.join("newcomer")).unwrap();
    }
}

/// Results are of a program that says the same version: a run that finds them says so. Their manifest runs the program
/// in the current folder, as `replay` does.
#[test]
fn results_that_are_there_are_not_computed_again() {
    if !runs(PYTHON) {
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
    // Another version neither resumes results nor computes a shard of a plan of the first one.
    run(&["plan", "study.toml", "--shards", "1", "--allow-commands"]);
    let source = std::fs::read_to_string(folder.join("mine.py")).unwrap();
    std::fs::write(folder.join("mine.py"), source.replace("1.0", "2.0")).unwrap();
    for arguments in [
        &["run", "study.toml", "--trials", "30"][..],
        &["shard", "study.plan.json", "1"],
    ] {
        let refused = asobench(folder, &[arguments, &["--allow-commands"]].concat());
        let said = text(&refused.stderr);
        assert_ne!(refused.status.code(), Some(0), "{said}");
        assert!(said.contains("says that it is 'least squares in Python 2.0'"), "{said}");
    }
}

/// An answer on a terminal counts for that content in that folder: another content, command or folder is asked for.
#[test]
fn an_answer_is_for_one_content_in_one_folder() {
    if !runs(&["python3", "-c", "import pty"]) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    study_of(folder, &["one"]);
    let run = ["run", "study.toml", "--out", "out"];
    let answered = Command::new("python3")
        .args([&["-c", TERMINAL, "y", PROGRAM], &run[..]].concat())
        .current_dir(folder)
        .env("XDG_STATE_HOME", folder.join("state"))
        .output()
        .unwrap();
    let started = || std::fs::remove_file(folder.join("one")).is_ok();
    assert!(started(), "{}", text(&answered.stdout));
    assert_eq!(asobench(folder, &["test-method", "study.toml"]).status.code(), Some(0));
    assert!(started());
    let study = std::fs::read_to_string(folder.join("study.toml")).unwrap();
    std::fs::write(folder.join("other.toml"), study.replace("eta = 10", "eta = 11")).unwrap();
    std::fs::create_dir(folder.join("below")).unwrap();
    for name in ["study.toml", "worker.py"] {
        std::fs::copy(folder.join(name), folder.join("below").join(name)).unwrap();
    }
    let command = r#"methods.0.command=["python3", "below/worker.py"]"#;
    for arguments in [
        &["run", "other.toml"][..],
        &["run", "below/study.toml"],
        &["run", "study.toml", "--set", command],
        &["replay", "out", "0:1"],
    ] {
        let refused = asobench(folder, arguments);
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains("starts a program"), "{said}");
    }
    assert!(!started() && !folder.join("below/one").exists());
}

/// A terminal of 80 columns, to which the command of the later arguments writes; the first one is the answer.
const TERMINAL: &str = r#"
import os, pty, sys
child, end = pty.fork()
if child == 0:
    os.execv(sys.argv[2], sys.argv[2:])
seen = b""
while True:
    try:
        part = os.read(end, 65536)
    except OSError:
        break
    if not part:
        break
    if b"[y/N] " in part:
        os.write(end, sys.argv[1].encode() + b"\n")
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
        (vec!["rm", "", "\n\n\n\n"], &["rm (method", "'' \\n\\n\\n\\n"]),
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
            .args(["-c", TERMINAL, "n", program, "run", &file])
            .current_dir(folder)
            .env("XDG_STATE_HOME", folder.join("state"))
            .output()
            .unwrap();
        for (shown, most) in [(text(&piped.stderr), 1000), (text(&terminal.stdout), 80 * 22)] {
            for part in parts {
                assert!(shown.contains(part), "{part}: {shown}");
            }
            assert!(!shown.contains("    "), "{shown}");
            let lines = shown.lines().map(|line| line.chars().count().div_ceil(80));
            assert!(shown.chars().count() <= most && lines.sum::<usize>() <= 22, "{shown}");
            assert!(shown.contains("--allow-commands") || shown.contains("Is that what you want? [y/N]"));
        }
        assert!(!folder.join("results").exists());
    }
}
