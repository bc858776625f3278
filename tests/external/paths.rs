//! Names and paths: a path need not be UTF-8, and a name is never a path.

use super::consent::text;
use super::root;
use crate::common::PROGRAM;
use crate::common::{PYTHON, runs};
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program; a byte `?` of the arguments is one that no UTF-8 has.
fn asobench(folder: &Path, arguments: &str, temporary: &OsStr) -> Output {
    Command::new(PROGRAM)
        .args(arguments.split(' ').map(bad))
        .current_dir(folder)
        .env("XDG_STATE_HOME", folder.join("state"))
        .env("TMPDIR", temporary)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

fn bad(name: &str) -> OsString {
    let bytes = name.bytes().map(|b| if b == b'?' { 0xff } else { b });
    OsStr::from_bytes(&bytes.collect::<Vec<u8>>()).to_owned()
}

/// Writes a study of a program, with these lines before its methods.
fn write_study(path: &Path, lines: &str) {
    let worker = root().join("examples/workers/least_squares.py");
    let worker = worker.display();
    let method = format!("name = \"mine\"\nbatch = 4\ncommand = [\"python3\", \"{worker}\"]\n");
    std::fs::write(path, format!("{lines}[[methods]]\n{method}")).unwrap();
}

/// Of every command that takes files: in a folder and of files whose names are no UTF-8.
#[test]
fn a_path_need_not_be_utf8() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join(bad("fol?der"));
    std::fs::create_dir(&folder).unwrap();
    let lines = "trials = 4\nstore = \"trials\"\n[settings]\nwindow = 98\neta = [5, 10]\n";
    write_study(&folder.join(bad("s?.toml")), lines);
    let plain = format!("{lines}[[methods]]\nestimator = \"arx\"\n");
    std::fs::write(folder.join(bad("p?.toml")), plain).unwrap();
    write_study(&folder.join(bad("own?.toml")), "");
    for (arguments, made) in [
        ("check s?.toml", ""),
        ("test-method s?.toml --allow-commands", ""),
        ("run s?.toml --allow-commands", "results/s?/manifest.json"),
        ("run p?.toml", "results/p?/manifest.json"),
        (
            "run results/s?/manifest.json --allow-commands --out m?",
            "m?/manifest.json",
        ),
        ("plan s?.toml --shards 1 --allow-commands", "s?.plan.json"),
        ("shard s?.plan.json 1 --allow-commands", "s?-shards/shard-0001"),
        ("status s?.plan.json", ""),
        ("merge s?.plan.json --out d?", "d?/manifest.json"),
        ("report results/s? results/p? --out r?", "r?/report.html"),
        ("failures results/s?", ""),
        ("plot results/s? --out f?.svg", "f?.svg"),
        ("replay results/s? cell=0:1 --allow-commands --data k?.csv", "k?.csv"),
        ("compare results/s? m?", ""),
        ("estimate k?.csv --order 2 --report e?.html --states x?.csv", "x?.csv"),
        ("theory p?.toml", ""),
        ("throughput p?.toml --trials 100", ""),
        (
            "suite own?.toml --only P01 --first 2 --out n? --allow-commands",
            "n?/methods/mine.json",
        ),
        (
            "suite times own?.toml --only P01 --rounds 3 --out n? --allow-commands",
            "n?/times.json",
        ),
        ("suite scores n? --only P01 --first 2", ""),
    ] {
        let done = asobench(&folder, arguments, OsStr::new("/tmp"));
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(0), "{arguments}: {said}");
        assert!(folder.join(bad(made)).exists(), "{arguments}: no {made}");
    }
    // A place that needs a word, or a text, says so in a line.
    for (arguments, part) in [
        ("run s?.toml", "add --allow-commands"),
        ("plan s?.toml", "add --allow-commands"),
        ("test-method s?.toml", "add --allow-commands"),
        ("suite own?.toml --only P01 --first 2", "add --allow-commands"),
        ("replay results/s? cell=0:1", "expected --allow-commands"),
        ("slurm s?.toml", "expected a path in UTF-8"),
    ] {
        let refused = asobench(&folder, arguments, OsStr::new("/tmp"));
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{arguments}: {said}");
        assert!(said.contains(part) && said.lines().count() == 1, "{arguments}: {said}");
    }
}

/// Two paths that look the same where they are shown are two paths.
#[test]
fn paths_that_differ_in_a_byte_are_two() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let names = [b"a\xfe", b"a\xff"].map(|name| OsStr::from_bytes(name).to_owned());
    let study = "trials = 2\n[settings]\neta = 10\n[[methods]]\nestimator = \"arx\"\n";
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).arg("run");
    for name in &names {
        let mut file = name.clone();
        file.push(".toml");
        std::fs::write(folder.join(&file), study).unwrap();
        command.arg(file);
    }
    let ran = command.output().unwrap();
    assert_eq!(ran.status.code(), Some(0), "{}", text(&ran.stderr));
    let both = names.map(|name| folder.join("results").join(name));
    assert!(both.iter().all(|folder| folder.join("manifest.json").exists()));
    let mut command = Command::new(PROGRAM);
    let report = command.arg("report").args(&both).arg("--out").arg("report");
    let report = report.current_dir(folder).output().unwrap();
    assert_eq!(report.status.code(), Some(0), "{}", text(&report.stderr));
}

/// An empty TMPDIR is one that is not set; any other is a path, of any bytes.
#[test]
fn the_folder_for_temporary_files() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    write_study(&folder.join("s.toml"), "trials = 4\n[settings]\neta = 10\n");
    std::fs::create_dir(folder.join(bad("t?"))).unwrap();
    std::fs::create_dir(folder.join("x".repeat(200))).unwrap();
    for (out, temporary) in ["", "t?", &"x".repeat(200)].into_iter().enumerate() {
        let command = format!("run s.toml --allow-commands --out {out}");
        let ran = asobench(folder, &command, &bad(temporary));
        assert_eq!(ran.status.code(), Some(0), "{temporary}: {}", text(&ran.stderr));
    }
    let summary = |out: &str| std::fs::read(folder.join(out).join("summary.json")).unwrap();
    assert!(summary("0") == summary("1") && summary("0") == summary("2"));
}

/// A newcomer's name is a part of file names: nothing is written but in the folder of the results.
#[test]
fn a_name_is_never_a_path() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("a/b/c");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, part) in [
        ("../../../x", "~2e.~2f..~2f..~2fx"),
        ("a/b[*]", "a~2fb~5b~2a~5d"),
        ("..", "~2e."),
    ] {
        let file = format!("[[methods]]\nname = {name:?}\nestimator = \"arx\"\n");
        std::fs::write(folder.join("new.toml"), file).unwrap();
        let done = asobench(&folder, "suite new.toml --only P01 --first 2", OsStr::new("/tmp"));
        assert_eq!(done.status.code(), Some(0), "{name}: {}", text(&done.stderr));
        let out = folder.join(format!("results/suite-quick-{part}"));
        assert!(out.join(format!("methods/{part}.json")).exists(), "{name}");
    }
    let entries = |folder: &Path| std::fs::read_dir(folder).unwrap().count();
    assert_eq!(
        [
            entries(place.path()),
            entries(&place.path().join("a")),
            entries(&place.path().join("a/b"))
        ],
        [1; 3]
    );
    assert_eq!([entries(&folder), entries(&folder.join("results"))], [2, 3]);
}
