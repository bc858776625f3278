//! Folders that somebody prepared to do harm, or that hold what is dear to somebody: whatever stands where the program
//! reads or writes, nothing outside is touched, nothing foreign is replaced or removed, nothing hangs, and what went
//! wrong is said in a line that names the place.

mod blocks;
mod endless;
mod limits;
mod obstacle;
mod owners;
mod parquet;
mod table;
mod victims;

pub(crate) use parquet::files as parquet_files;

use crate::common::{PROGRAM, copy, stderr};
use std::collections::BTreeMap;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// One cell, two outputs, rows and times: every file that a run writes.
const STUDY: &str = "trials = 8\nstore = \"trials\"\ntiming = true\n[settings]\neta = 5\nwindow = 18\n\
                     [[methods]]\niterations = 1";

/// A disturbance that is read from a file.
const WAVES: &str = r#"
trials = 1
measures = ["rms_x"]
[continuous]
until = 2
scored_from = 1
[settings]
plant = "bobtsov2023"
disturbance = "measured"
step = 0.1
[signals.measured]
waves = [{ wave = "file", file = "wave.csv" }]
[[observers]]
observer = "gradient"
gains = [1]
"#;

/// How long a command may take; none needs a second.
const PATIENCE: Duration = Duration::from_mins(1);

/// A folder to work in: `victim`, which nobody may touch, and what the commands read.
struct Place {
    folder: TempDir,
}

/// A folder of results and all that is made of it, once for all tests.
fn template() -> &'static Path {
    static TEMPLATE: OnceLock<TempDir> = OnceLock::new();
    let folder = TEMPLATE.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("written");
        };
        write("study.toml", STUDY);
        write("waves.toml", WAVES);
        write("wave.csv", "t,delta\n0,0\n1,1\n2,0\n3,1\n");
        let run = |arguments: &[&str]| {
            let output = command(folder.path(), arguments).output();
            let output = output.expect("the program runs");
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
        };
        run(&["run", "study.toml", "--block", "4", "--out", "out"]);
        run(&["report", "out"]);
        run(&["replay", "out", "0:0", "--data", "data.csv"]);
        run(&ESTIMATE);
        run(&["new", "mine"]);
        run(&["check", "waves.toml"]);
        run(&[&REPRODUCE[..], &["--out", "paper"]].concat());
        let victim = folder.path().join("victim");
        std::fs::create_dir_all(victim.join("deep")).expect("a folder");
        for name in ["thesis.txt", "deep/thesis.tmp", "data.tmp"] {
            std::fs::write(victim.join(name), "a thesis\n").expect("written");
        }
        copy(&folder.path().join("out"), &victim.join("own"));
        folder
    });
    folder.path()
}

const REPRODUCE: [&str; 5] = ["reproduce", "--paper", "nikolov", "--trials", "2"];
const ESTIMATE: [&str; 8] = [
    "estimate",
    "data.csv",
    "--order",
    "6",
    "--window",
    "18",
    "--states",
    "states.csv",
];

/// The program in a folder, with a limit on its memory.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new("bash");
    command
        .args(["-c", "ulimit -v 4000000; exec \"$@\"", "bash", PROGRAM])
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null());
    command
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        copy(template(), folder.path());
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs the program to its end, which must come soon.
    fn run(&self, arguments: &[&str]) -> Output {
        wait(command(self.folder.path(), arguments))
    }

    /// The program ends with exit code 2 and one line that has `part`.
    fn refuses(&self, arguments: &[&str], part: &str) {
        let output = self.run(arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        let is_one_line = message.lines().count() == 1;
        assert!(is_one_line && message.contains(part), "{arguments:?}: {message}");
    }
}

/// Waits for a command to end, which it must do soon.
pub(crate) fn wait(mut command: Command) -> Output {
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let begin = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if begin.elapsed() > PATIENCE {
            child.kill().expect("killed");
            panic!("{command:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().expect("ended")
}

/// The entry at every path of a tree: its kind and permissions, and its content or where it leads.
type Tree = BTreeMap<PathBuf, (u32, Vec<u8>)>;

/// All that is at a path and below it; links are not followed, pipes and devices not opened.
fn tree(path: &Path) -> Tree {
    let mut found = Tree::new();
    let Ok(metadata) = std::fs::symlink_metadata(path) else {
        return found;
    };
    let mut content = Vec::new();
    if metadata.is_symlink() {
        let target = std::fs::read_link(path).expect("a link");
        content = target.as_os_str().as_encoded_bytes().to_vec();
    } else if metadata.is_file() {
        content = std::fs::read(path).expect("a file");
    } else if metadata.is_dir() {
        for entry in std::fs::read_dir(path).expect("a folder") {
            found.extend(tree(&entry.expect("an entry").path()));
        }
    }
    found.insert(path.to_owned(), (metadata.permissions().mode(), content));
    found
}
