//! Studies from outside: experiment files, folders that can be gone on with, and the bits in them.

mod claims;
mod commands;
mod confirm;
mod continuous;
mod course;
mod damage;
mod engines;
mod few;
mod files;
mod hostile;
mod identity;
mod kills;
mod looks;
mod meaning;
mod needs;
mod own_case;
mod pilot;
mod recompute;
mod replacing;
mod replay;
mod unfinished;
mod verdicts;

use crate::common::{PROGRAM, copy, stderr, stdout};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Twelve cells, four outputs, and everything that a file can ask for.
const EVERYTHING: &str = r#"
title = "A small study of everything"
seed = 5
trials = 400
store = "trials"
parameters = true
curves = true
measures = ["e_a", "e_b", "e_x_max", "e_x_rms", "condition"]
compare = [["iv(2)", "ls"], ["svd", "ls"]]

[settings]
plant = "mine"
horizon = 110
noise = ["ar", "coloured"]
eta = [2, 10]
window = [18, 50, 98]

[plants.mine]
a = [-0.7, 1.5]
b = [1.0, 0.5]

[noises.coloured]
numerator = [1.0, 0.5]
denominator = [1.0, -0.9]

[[methods]]
estimator = "iv"
iterations = 2

[[methods]]
name = "svd"
estimator = "ls"
solver = "svd"

[[slopes]]
measure = "e_a"
over = "window"

[[bounds]]
measure = "e_a"
below = 0.1

[[bounds]]
measure = "e_b"
rounding = 100
"#;

/// A folder of files and results.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    /// A folder with `everything.toml`.
    fn new() -> Self {
        let place = Self {
            folder: tempfile::tempdir().expect("a folder"),
        };
        place.write("everything.toml", EVERYTHING.as_bytes());
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, content: &[u8]) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, content).expect("a writable file");
        path
    }

    /// The program within the folder.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(arguments).current_dir(self.folder.path());
        command.stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program runs")
    }

    fn start(&self, arguments: &[&str]) -> Child {
        let mut command = self.command(arguments);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().expect("the program runs")
    }

    /// Makes the manifest of a folder one of version 0.2.0, whose results have no checksums.
    fn take_checksums(&self, folder: &str) {
        let path = self.path(folder).join("manifest.json");
        let text = std::fs::read(&path).expect("a manifest");
        let mut manifest: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        let keys = manifest.as_object_mut().expect("an object");
        keys.retain(|key, _| !key.starts_with("checksum"));
        std::fs::write(path, manifest.to_string()).expect("written");
    }

    /// Runs `everything.toml` to its end: its files.
    fn results(&self, out: &str, more: &[&str]) -> Contents {
        let mut arguments = vec!["run", "everything.toml", "--out", out];
        arguments.extend(more);
        succeeds(&self.run(&arguments));
        contents(&self.path(out))
    }

    /// Bad input: exit code 2, nothing on stdout, one line on stderr with each of `parts`.
    fn refuses(&self, arguments: &[&str], parts: &[&str]) {
        let output = self.run(arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert_eq!(stdout(&output), "", "{arguments:?}");
        assert_eq!(message.lines().count(), 1, "{arguments:?}: {message}");
        assert!(message.starts_with("asobench: "), "{message}");
        for part in parts {
            let there = message.contains(part);
            assert!(there, "{arguments:?}: no '{part}' in: {message}");
        }
    }
}

/// The files at the top of a folder by name, without the lock and the list of looks, which tells the history of the
/// folder.
type Contents = BTreeMap<String, Vec<u8>>;

fn contents(folder: &Path) -> Contents {
    let mut contents = Contents::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let entry = entry.expect("an entry");
        let name = entry.file_name().into_string().expect("UTF-8");
        let is_result = name != ".lock" && name != "looks.json";
        if is_result && entry.file_type().expect("a type").is_file() {
            contents.insert(name, std::fs::read(entry.path()).expect("a file"));
        }
    }
    contents
}

/// Whether two folders' files are equal in every byte, with the names of those that are not.
fn assert_same(found: &Contents, expected: &Contents, what: &str) {
    let names = |contents: &Contents| contents.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected), "{what}");
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "{what}: {name} differs");
    }
}

/// The block files of a folder.
fn blocks(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder.join("blocks")) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<PathBuf> = paths.filter(|path| is_block(path)).collect();
    paths.sort();
    paths
}

fn is_block(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "block")
}

fn succeeds(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

/// Waits until something holds, for half a minute at most.
fn wait_until(mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < Duration::from_secs(30), "waited in vain");
        std::thread::sleep(Duration::from_millis(2));
    }
}
