//! The table: every obstacle at every place where a command reads or writes.

use super::obstacle::Obstacle;
use super::{ESTIMATE, Place, REPRODUCE, stderr, tree};

const RUN: [&str; 4] = ["run", "study.toml", "--out", "out"];
const BLOCK: &str = "out/blocks/c00000-0000000000-0000000004.block";

/// The use that a command makes of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Use {
    /// It writes there, so what is not its own makes it refuse.
    Writes,
    /// It writes in the folder that is there, so that a folder of somebody, who named it, is as good as its own.
    Folder,
    /// It reads there.
    Reads,
}
use Use::{Folder, Reads, Writes};

/// Every obstacle at each of these places, one at a time.
fn check(arguments: &[&str], places: &[(&str, Use)]) {
    for (name, use_of) in places {
        for obstacle in Obstacle::ALL {
            check_one(arguments, name, *use_of, obstacle);
        }
    }
}

fn check_one(arguments: &[&str], name: &str, use_of: Use, obstacle: Obstacle) {
    let place = Place::new();
    obstacle.put(&place, name);
    let (victim, there) = (place.path("victim"), place.path(name));
    let (before, own) = (tree(&victim), tree(&there));
    let output = place.run(arguments);
    let message = stderr(&output);
    let what = format!("{arguments:?}, {obstacle:?} at {name}: {message}");
    assert!(tree(&victim) == before, "something outside was touched: {what}");
    let code = output.status.code().unwrap_or(-1);
    assert!((0..=2).contains(&code), "code {code}: {what}");
    // Two warnings, and two files that were written.
    assert!(message.lines().count() <= 4, "{what}");
    if obstacle.is_foreign() {
        for (path, content) in &own {
            assert!(tree(path).get(path) == Some(content), "{}: {what}", path.display());
        }
    }
    if code != 0 {
        let last = name.rsplit('/').next().unwrap_or(name);
        assert!(message.contains(last), "{what}");
    }
    let refused = match use_of {
        Writes => obstacle.is_foreign(),
        Folder => obstacle.is_foreign() && obstacle != Obstacle::Folder,
        Reads => false,
    };
    if refused {
        assert_eq!(code, 2, "{what}");
        assert_eq!(message.lines().count(), 1, "{what}");
    }
    if obstacle == Obstacle::Own {
        assert_eq!(code, 0, "{what}");
    }
}

#[test]
fn run() {
    check(
        &RUN,
        &[
            ("out", Folder),
            ("out/.lock", Reads),
            ("out/manifest.json", Writes),
            ("out/summary.json", Writes),
            ("out/summary.parquet", Writes),
            ("out/trials.parquet", Writes),
        ],
    );
}

#[test]
fn resumed_run() {
    let more = [&RUN[..], &["--trials", "12"]].concat();
    check(
        &more,
        &[
            ("out/blocks", Folder),
            ("out/blocks/design.json", Writes),
            (BLOCK, Writes),
            ("out/blocks/c00000-0000000008-0000000012.block", Writes),
            ("out/timing", Folder),
            ("out/timing/times.json", Writes),
            ("study.toml", Reads),
        ],
    );
}

#[test]
fn repair() {
    let repair = [&RUN[..], &["--repair"]].concat();
    // A regular file with the name of a block is set aside, whatever is in it.
    for obstacle in [Obstacle::Foreign, Obstacle::Alike, Obstacle::HardLink] {
        let place = Place::new();
        obstacle.put(&place, BLOCK);
        let (victim, block) = (place.path("victim"), place.path(BLOCK));
        let (before, content) = (tree(&victim), std::fs::read(&block).expect("a file"));
        let output = place.run(&repair);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(tree(&victim) == before);
        let aside = place.path(&format!("{BLOCK}.damaged"));
        assert_eq!(std::fs::read(aside).expect("set aside"), content);
        assert!(std::fs::read(block).expect("a block").starts_with(b"asobench"));
    }
    for obstacle in [
        Obstacle::LinkToFile,
        Obstacle::LinkToOwn,
        Obstacle::LinkToZero,
        Obstacle::Pipe,
        Obstacle::Folder,
    ] {
        check_one(&repair, BLOCK, Writes, obstacle);
    }
}

#[test]
fn reproduce() {
    let arguments = [&REPRODUCE[..], &["--out", "paper"]].concat();
    check(
        &arguments,
        &[
            ("paper", Folder),
            ("paper/manifest.json", Writes),
            ("paper/summary.json", Writes),
            ("paper/trials.parquet", Writes),
            ("paper/fig1.svg", Writes),
            ("paper/fig3.svg", Writes),
        ],
    );
}

/// Blocks of `reproduce` are removed: with anything else among them it refuses.
#[test]
fn blocks_of_reproduce() {
    let arguments = [&REPRODUCE[..], &["--out", "paper"]].concat();
    for obstacle in Obstacle::ALL {
        for name in ["paper/blocks/deep", "paper/blocks/design.json"] {
            let place = Place::new();
            std::fs::create_dir(place.path("paper/blocks")).expect("a folder");
            obstacle.put(&place, name);
            let (before, own) = (tree(&place.path("victim")), tree(&place.path(name)));
            let output = place.run(&arguments);
            let message = stderr(&output);
            let code = if obstacle.is_foreign() { 2 } else { 0 };
            assert_eq!(output.status.code(), Some(code), "{obstacle:?}: {message}");
            assert!(tree(&place.path("victim")) == before, "{obstacle:?}");
            if obstacle.is_foreign() {
                assert!(message.contains(name), "{obstacle:?}: {message}");
                assert!(tree(&place.path(name)) == own, "{obstacle:?}");
            }
        }
        check_one(&arguments, "paper/blocks", Folder, obstacle);
    }
}

#[test]
fn report() {
    let name_in = |folder: &str| {
        let place = Place::new();
        let mut names: Vec<String> = tree(&place.path(folder))
            .into_keys()
            .filter(|path| path.is_file())
            .filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()))
            .collect();
        names.sort();
        format!("{folder}/{}", names.swap_remove(0))
    };
    let (figure, table) = (name_in("out/figures"), name_in("out/tables"));
    check(
        &["report", "out"],
        &[
            ("out/report.html", Writes),
            ("out/figures", Folder),
            (&figure, Writes),
            ("out/tables", Folder),
            (&table, Writes),
            ("out/manifest.json", Reads),
            ("out/summary.json", Reads),
            ("out/timing", Reads),
            ("out/timing/times.json", Reads),
        ],
    );
    check(&["report", "out", "--out", "page"], &[("page", Folder)]);
}

#[test]
fn replay() {
    check(
        &["replay", "out", "0:0"],
        &[("out/manifest.json", Reads), ("out/trials.parquet", Reads)],
    );
    check(&["replay", "out", "0:0", "--data", "data.csv"], &[("data.csv", Writes)]);
}

#[test]
fn estimate() {
    check(&ESTIMATE, &[("data.csv", Reads), ("states.csv", Writes)]);
    let drawn = ["--plot", "fit.svg", "--report", "page.html"];
    check(
        &[&ESTIMATE[..6], &drawn].concat(),
        &[("fit.svg", Writes), ("page.html", Writes)],
    );
}

/// A file that the user may have written is never replaced, not even if the program wrote it first.
#[test]
fn new() {
    for obstacle in Obstacle::ALL {
        let place = Place::new();
        obstacle.put(&place, "mine.toml");
        let (victim, there) = (place.path("victim"), place.path("mine.toml"));
        let before = (tree(&victim), tree(&there));
        let output = place.run(&["new", "mine"]);
        let code = if obstacle == Obstacle::Nothing { 0 } else { 2 };
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(tree(&victim) == before.0, "{obstacle:?}");
        assert!(obstacle == Obstacle::Nothing || tree(&there) == before.1);
    }
}

#[test]
fn check_of_files() {
    check(&["check", "study.toml"], &[("study.toml", Reads)]);
    check(&["check", "out/manifest.json"], &[("out/manifest.json", Reads)]);
    check(&["check", "waves.toml"], &[("waves.toml", Reads), ("wave.csv", Reads)]);
}
