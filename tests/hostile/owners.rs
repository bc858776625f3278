//! Folders and files that another user owns, or that may not be written.

use super::{Place, command, copy, stderr, tree};
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::path::Path;

/// The user whom root tests stand for, so that permissions mean something.
const NOBODY: u32 = 65_534;

fn is_root() -> bool {
    std::fs::metadata("/proc/self").is_ok_and(|metadata| metadata.uid() == 0)
}

/// Gives a tree to the user who runs the program.
fn give(path: &Path) {
    if is_root() {
        for path in tree(path).keys() {
            chown(path, Some(NOBODY), Some(NOBODY)).expect("given");
        }
    }
}

/// The program as a user without privileges: its exit code and message.
fn run(place: &Place, arguments: &[&str]) -> (i32, String) {
    let mut command = command(place.folder.path(), arguments);
    if is_root() {
        command.uid(NOBODY).gid(NOBODY);
    }
    let output = super::wait(command);
    (output.status.code().unwrap_or(-1), stderr(&output))
}

fn mode(path: &Path, mode: u32) {
    let permissions = std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(path, permissions).expect("set");
}

const COMMANDS: [(&[&str], &str); 3] = [
    (&["run", "study.toml", "--trials", "12", "--out", "out"], "out"),
    (&["report", "out"], "out"),
    (&["replay", "out", "0:0", "--data", "out/data.csv"], "out"),
];

#[test]
fn read_only_folders() {
    for (arguments, part) in COMMANDS {
        let place = Place::new();
        give(place.folder.path());
        for folder in ["out", "out/blocks", "out/figures", "out/tables", "out/timing"] {
            mode(&place.path(folder), 0o555);
        }
        let before = tree(&place.path("out"));
        let (code, message) = run(&place, arguments);
        assert!(code == 1 || code == 2, "{arguments:?}: {message}");
        assert!(message.lines().count() == 1 && message.contains(part), "{message}");
        assert!(tree(&place.path("out")) == before, "{arguments:?}");
        for folder in ["out", "out/blocks", "out/figures", "out/tables", "out/timing"] {
            mode(&place.path(folder), 0o755);
        }
    }
}

/// Files of another user that cannot be read cannot be recognised, so they stay.
#[test]
fn files_of_another_user() {
    if !is_root() {
        println!("skipped: only root can give files away");
        return;
    }
    for (arguments, name) in [
        (COMMANDS[0].0, "out/summary.json"),
        (COMMANDS[0].0, "out/manifest.json"),
        (COMMANDS[0].0, "out/blocks/design.json"),
        (COMMANDS[0].0, "out/timing/times.json"),
        (COMMANDS[1].0, "out/report.html"),
        (&["replay", "out", "0:0", "--data", "data.csv"], "data.csv"),
        (&super::ESTIMATE, "states.csv"),
    ] {
        let place = Place::new();
        give(place.folder.path());
        chown(place.path(name), Some(0), Some(0)).expect("given");
        mode(&place.path(name), 0o600);
        let before = tree(&place.path(name));
        let (code, message) = run(&place, arguments);
        assert_eq!(code, 2, "{name}: {message}");
        assert!(message.contains(name), "{name}: {message}");
        assert!(tree(&place.path(name)) == before, "{name}");
    }
}

/// A folder of another user with everything in it is left as it is.
#[test]
fn folders_of_another_user() {
    if !is_root() {
        println!("skipped: only root can give files away");
        return;
    }
    for (arguments, part) in COMMANDS {
        let place = Place::new();
        give(place.folder.path());
        std::fs::remove_dir_all(place.path("out")).expect("removed");
        copy(&place.path("victim/own"), &place.path("out"));
        let before = tree(&place.path("out"));
        let (code, message) = run(&place, arguments);
        assert!(code == 1 || code == 2, "{arguments:?}: {message}");
        assert!(message.contains(part), "{message}");
        assert!(tree(&place.path("out")) == before, "{arguments:?}");
    }
}
