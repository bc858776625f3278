//! Inputs without an end, and larger than anything that the program reads.

use super::{Place, command, stderr};
use std::fs::File;
use std::process::{Command, Stdio};

/// Devices and pipes are refused at once, by their name.
#[test]
fn devices_are_no_inputs() {
    let place = Place::new();
    for device in ["/dev/zero", "/dev/full", "/dev/null", "/proc/self/fd"] {
        for arguments in [
            vec!["estimate", device, "--order", "1"],
            vec!["check", device],
            vec!["run", device, "--out", "new"],
        ] {
            place.refuses(&arguments, device);
        }
        let waves = super::WAVES.replace("wave.csv", device);
        std::fs::write(place.path("device.toml"), waves).expect("written");
        place.refuses(&["check", "device.toml"], device);
    }
    assert!(!place.path("new").exists());
}

/// Standard input has the same limits as files, and a line has one too.
#[test]
fn endless_standard_input() {
    let place = Place::new();
    for (arguments, part) in [
        (&["estimate", "-", "--order", "1"][..], "line 1: longer than"),
        (&["check", "-"][..], "larger than 64 MiB"),
    ] {
        let mut command = command(place.folder.path(), arguments);
        command.stdin(Stdio::from(File::open("/dev/zero").expect("a device")));
        let output = super::wait(command);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(part) && message.lines().count() == 1, "{message}");
    }
}

/// Files that are longer than their kind may be: told by their length, not by reading them.
#[test]
fn files_beyond_their_limit() {
    let block = "out/blocks/c00000-0000000000-0000000004.block";
    for (name, arguments) in [
        ("study.toml", &["check", "study.toml"][..]),
        ("wave.csv", &["check", "waves.toml"]),
        ("data.csv", &["estimate", "data.csv", "--order", "6"]),
        ("out/manifest.json", &["report", "out"]),
        ("out/summary.json", &["report", "out"]),
        ("out/timing/times.json", &["report", "out"]),
        (block, &["run", "study.toml", "--out", "out"]),
    ] {
        let place = Place::new();
        let file = File::options().write(true).open(place.path(name));
        file.expect("a file").set_len(5 << 30).expect("a sparse file");
        place.refuses(arguments, "larger than");
        place.refuses(arguments, name);
    }
}

/// A pipe that somebody writes to and never ends is not waited for.
#[test]
fn pipes_are_not_waited_for() {
    let place = Place::new();
    std::fs::remove_file(place.path("data.csv")).expect("removed");
    let made = Command::new("mkfifo").arg(place.path("data.csv")).status();
    assert!(made.expect("mkfifo runs").success());
    // Opened for both ends, so that neither side waits.
    let held = File::options().read(true).write(true).open(place.path("data.csv"));
    let held = held.expect("a pipe");
    place.refuses(&["estimate", "data.csv", "--order", "6"], "data.csv");
    drop(held);
}
