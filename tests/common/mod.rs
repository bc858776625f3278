//! Functions shared by the tests that start the program.

pub mod browser;
pub mod counting;
pub mod table;

use std::path::Path;
use std::process::{Command, Output, Stdio};

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_asobench");

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// Writes a script that can be started. Another process writes it: a file that this one has open to write may be
/// inherited by a process that a test beside it starts just then, and what is open to write cannot be started.
#[cfg(unix)]
pub fn executable(path: &Path, text: &str) {
    let draft = path.with_extension("draft");
    std::fs::write(&draft, text).expect("a writable file");
    let mut install = Command::new("install");
    install.args(["-m", "755"]).arg(&draft).arg(path);
    assert!(install.status().expect("a copy").success());
    std::fs::remove_file(draft).expect("removed");
}

/// Whether CI is set: a test that could be made there is made.
pub fn is_ci() -> bool {
    std::env::var("CI").is_ok_and(|of| !of.is_empty())
}

/// Whether a command runs without complaint.
pub fn answers(command: &[&str]) -> bool {
    let mut started = Command::new(command[0]);
    started.args(&command[1..]).stdin(Stdio::null());
    let status = started.stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// Whether a command runs. Where it does not, a test says so and passes; but CI needs Python.
pub fn runs(command: &[&str]) -> bool {
    let runs = answers(command);
    if !runs {
        eprintln!("not tested: {command:?} does not run here");
        assert!(!is_ci() || command != PYTHON, "CI needs {command:?}");
    }
    runs
}

/// Starts Python, for [`runs`].
pub const PYTHON: &[&str] = &["python3", "-c", "1"];

/// Copies a folder with all its content.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.file_type().expect("a type").is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).expect("a copy");
        }
    }
}

/// Runs the program in a folder.
pub fn asobench_in(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).args(arguments);
    command.output().expect("it runs")
}

/// Runs the program in a folder, to the end.
pub fn done_in(folder: &Path, arguments: &[&str]) -> Output {
    let output = asobench_in(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    output
}
