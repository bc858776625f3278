//! Results that take the place of others: `--overwrite`, and every run that ends in a folder with results. Nothing
//! foreign is touched, nothing is lost before the new results are whole, and a reader sees the old or the new ones.

use super::{Contents, Place, assert_same, blocks, contents, copy, stderr, stdout, succeeds, wait_until};
use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};

/// A study that keeps its trials; [`OTHER`] keeps none, and has other cells.
const FIRST: &str = "trials = 40\nseed = 1\nstore = \"trials\"\nmeasures = [\"e_a\"]\n[settings]\neta = [2, 10]\n\
                     window = 18\n[[methods]]\nestimator = \"ls\"\n\
                     [[claims]]\nid = \"c1\"\ntext = \"Small.\"\n\
                     test = { value = \"e_a\", of = \"ls\", below = 9 }\n";
const OTHER: &str = "trials = 60\nseed = 2\nmeasures = [\"e_a\"]\n[settings]\neta = 5\nwindow = 50\n[[methods]]\n\
                     iterations = 1\n\
                     [[claims]]\nid = \"c2\"\ntext = \"Large.\"\n\
                     test = { value = \"e_a\", of = \"iv(1)\", below = 9 }\n";

/// The studies, and the results of the first in `out`.
fn prepared() -> Place {
    let place = Place::new();
    place.write("first.toml", FIRST.as_bytes());
    place.write("other.toml", OTHER.as_bytes());
    succeeds(&place.run(&["run", "first.toml", "--out", "out"]));
    place
}

const OVERWRITE: [&str; 5] = ["run", "other.toml", "--out", "out", "--overwrite"];

/// Every file below a folder with its content, and every folder.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    let mut left = vec![folder.to_owned()];
    while let Some(folder) = left.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let is_file = path.is_file();
            found.insert(path.clone(), is_file.then(|| std::fs::read(&path).expect("a file")));
            if !is_file {
                left.push(path);
            }
        }
    }
    found
}

/// A command that is refused leaves a folder as it was, to the last byte and name.
fn leaves(place: &Place, folder: &str, arguments: &[&str], parts: &[&str]) {
    let before = tree(&place.path(folder));
    place.refuses(arguments, parts);
    assert!(tree(&place.path(folder)) == before, "{arguments:?}");
}

/// The extension of a browser, whose `manifest.json` is none of ours, and a thesis beside it; other folders of people.
#[test]
fn a_foreign_folder_stays_as_it_is() {
    type Folder = (&'static [(&'static str, &'static str)], &'static str);
    let folders: [Folder; 6] = [
        (
            &[
                (
                    "manifest.json",
                    "{\"manifest_version\": 3, \"name\": \"Clipper\", \"version\": \"1.2\"}",
                ),
                ("background.js", "console.log(1)"),
                ("thesis.tex", "\\documentclass{book}"),
            ],
            "kept/manifest.json",
        ),
        (
            &[
                (
                    "manifest.json",
                    "{\"experiment\": {\"seed\": 1}, \"version\": \"0.2.0\"}",
                ),
                ("thesis.tex", "\\documentclass{book}"),
            ],
            "kept/manifest.json",
        ),
        (&[("blocks/photo.jpg", "wooden"), ("blocks/plan/a.txt", "b")], "kept"),
        (
            &[("blocks/design.json", "{\"version\": \"1\"}")],
            "kept/blocks/design.json",
        ),
        (&[("thesis.tex", "\\documentclass{book}")], "kept"),
        (&[("summary.json", "{\"title\": \"\"}")], "kept"),
    ];
    for (files, named) in folders {
        let place = prepared();
        for (name, content) in files {
            let path = place.path("kept").join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, content).expect("written");
        }
        let run = ["run", "other.toml", "--out", "kept", "--overwrite"];
        leaves(&place, "kept", &run, &["--out", named]);
    }
    // A folder that is not there, an empty one, and one of a run that was killed are as good as any.
    let place = prepared();
    std::fs::create_dir(place.path("empty")).expect("made");
    for out in ["empty", "new", "new"] {
        succeeds(&place.run(&["run", "other.toml", "--out", out, "--overwrite"]));
    }
}

/// In a folder of results, files of others stay and are named; with one of them in place of a result, or among the
/// blocks, nothing is replaced.
#[test]
fn what_is_not_listed_stays_and_is_said() {
    let place = prepared();
    for (name, content) in [
        (
            "out/summary.json",
            "{\"title\":\"\",\"question\":\"\",\"hypothesis\":\"\"}",
        ),
        ("out/blocks/thesis.txt", "thesis"),
        ("out/looks.json", "{}"),
    ] {
        let own = std::fs::read(place.path(name)).ok();
        place.write(name, content.as_bytes());
        leaves(&place, "out", &OVERWRITE, &["--out", name]);
        match own {
            Some(own) => std::fs::write(place.path(name), own).expect("written"),
            None => std::fs::remove_file(place.path(name)).expect("removed"),
        }
    }
    std::fs::create_dir(place.path("out/notes")).expect("made");
    place.write("out/notes/a.txt", b"mine");
    place.write("out/thesis.tex", b"mine too");
    succeeds(&place.run(&["report", "out"]));
    let before = tree(&place.path("out"));
    let output = place.run(&OVERWRITE);
    succeeds(&output);
    let said = stderr(&output);
    assert!(
        said.contains("claims.md, figures, notes, report.html, simulated.md, tables, thesis.tex"),
        "{said}"
    );
    let after = tree(&place.path("out"));
    for (path, content) in &before {
        let within = path.strip_prefix(place.path("out")).expect("within");
        let top = within.iter().next().expect("a name").to_string_lossy().into_owned();
        if !["manifest.json", "looks.json", "blocks"].contains(&top.as_str())
            && !top.starts_with("summary")
            && top != "trials.parquet"
        {
            assert!(after.get(path) == Some(content), "{}", path.display());
        }
    }
    assert!(!place.path("out/trials.parquet").exists(), "the new study keeps none");
    succeeds(&place.run(&["run", "other.toml", "--out", "alone"]));
    assert!(!place.path("alone/trials.parquet").exists());
    for (name, content) in contents(&place.path("alone")) {
        assert!(contents(&place.path("out"))[&name] == content, "{name}");
    }
    // Results of a study that are there need no replacing.
    let again = place.run(&OVERWRITE);
    assert!(stderr(&again).contains("nothing to compute"), "{}", stderr(&again));
}

/// Mistakes of the new study are found while the old results stay as they are, byte for byte.
#[test]
fn a_wrong_study_replaces_nothing() {
    let place = prepared();
    let (unjudged, _) = OTHER.split_once("[[claims]]").expect("claims");
    let study = |name: &str, of: &str, from: &str, to: &str| {
        assert!(of.contains(from));
        place.write(name, of.replace(from, to).as_bytes());
    };
    study("typo.toml", OTHER, "iterations = 1", "estimator = \"arks\"");
    study("key.toml", OTHER, "seed = 2", "sed = 2");
    study("claim.toml", OTHER, "of = \"iv(1)\"", "of = \"iv(7)\"");
    for (name, command) in [("consent.toml", "true"), ("crash.toml", "false")] {
        let method = format!("name = \"m\"\ncommand = [\"{command}\"]");
        study(name, unjudged, "iterations = 1", &method);
    }
    let run = |file| ["run", file, "--out", "out", "--overwrite"];
    for (file, part) in [
        ("typo.toml", "arks"),
        ("key.toml", "'sed'"),
        ("claim.toml", "iv(7)"),
        ("consent.toml", "--allow-commands"),
        ("missing.toml", "missing.toml"),
    ] {
        leaves(&place, "out", &run(file), &[part]);
    }
    leaves(
        &place,
        "out",
        &[&OVERWRITE[..], &["--trials", "4000000000", "--set", "store=trials"]].concat(),
        &["disk", "--anyway"],
    );
    let before = tree(&place.path("out"));
    let output = place.run(&[&run("crash.toml")[..], &["--allow-commands"]].concat());
    assert_ne!(output.status.code(), Some(0));
    assert!(tree(&place.path("out")) == before, "{}", stderr(&output));
}

/// A folder in which another run writes is refused, with and without results in it.
#[test]
fn a_busy_folder_is_refused() {
    let place = prepared();
    let long = [
        "run",
        "first.toml",
        "--out",
        "out",
        "--trials",
        "20000000",
        "--block",
        "50",
        "--anyway",
    ];
    let count = blocks(&place.path("out")).len();
    let mut child = place.start(&long);
    wait_until(|| blocks(&place.path("out")).len() > count + 3);
    let before = contents(&place.path("out"));
    place.refuses(&OVERWRITE, &["--out", "out", "another run"]);
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert_same(&contents(&place.path("out")), &before, "the results before");
    succeeds(&place.run(&OVERWRITE));
}

/// Fewer trials replace more, and a study that was to replace another and was stopped continues with the same command;
/// the results before stay readable, and their command finds them whole.
#[test]
fn a_stopped_replacement_goes_on() {
    let place = prepared();
    let rows = OTHER.replace("seed = 2", "seed = 2\nstore = \"trials\"");
    place.write("other.toml", rows.as_bytes());
    let before = contents(&place.path("out"));
    let long = [&OVERWRITE[..], &["--trials", "300000", "--block", "50"]].concat();
    let child = place.start(&long);
    let replacing = place.path("out/.asobench-replacing");
    wait_until(|| blocks(&replacing).len() > 3);
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("the same command resumes"),
        "{}",
        stderr(&output)
    );
    assert_same(&contents(&place.path("out")), &before, "stopped");
    succeeds(&place.run(&["report", "out", "--out", "page"]));
    let first = place.run(&["run", "first.toml", "--out", "out"]);
    assert!(stderr(&first).contains("nothing to compute"), "{}", stderr(&first));
    // Blocks that were computed are not computed again.
    let kept = blocks(&replacing).into_iter().next().expect("a block");
    let time = |path: &Path| std::fs::metadata(path).and_then(|of| of.modified()).expect("a time");
    let stamp = time(&kept);
    let (count, mut child) = (blocks(&replacing).len(), place.start(&long));
    wait_until(|| blocks(&replacing).len() > count + 3);
    assert!(kept.exists() && time(&kept) == stamp);
    child.kill().expect("killed");
    child.wait().expect("ended");
    // Fewer trials than that run has computed, then fewer than the results have.
    for trials in ["60", "50"] {
        let output = place.run(&[&OVERWRITE[..], &["--trials", trials]].concat());
        succeeds(&output);
        let alone = format!("alone-{trials}");
        succeeds(&place.run(&["run", "other.toml", "--out", &alone, "--trials", trials]));
        assert_same(&contents(&place.path("out")), &contents(&place.path(&alone)), trials);
        assert!(!replacing.exists());
    }
    place.refuses(
        &["run", "other.toml", "--out", "out", "--trials", "40"],
        &["up to trial 50, more than 40", "--overwrite"],
    );
}

/// The times of the study before are not those of the new one; its own are measured.
#[test]
fn times_of_another_study_go() {
    let place = prepared();
    let timed = ["run", "first.toml", "--out", "out", "--set", "timing=true"];
    succeeds(&place.run(&timed));
    let times = place.path("out/timing/times.json");
    let first = std::fs::read(&times).expect("times");
    succeeds(&place.run(&OVERWRITE));
    assert!(!times.exists());
    succeeds(&place.run(&["report", "out"]));
    succeeds(&place.run(&[&timed[..], &["--overwrite"]].concat()));
    assert!(std::fs::read(&times).expect("times") != first);
}

/// Kills the process at the N-th step that changes a folder, counted from 0: `ASOBENCH_TEST_KILL_AT=N`.
const KILLER: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>
static void step(void) {
    static atomic_int steps;
    const char *at = getenv("ASOBENCH_TEST_KILL_AT");
    if (at && atomic_fetch_add(&steps, 1) == atoi(at)) kill(getpid(), SIGKILL);
}
#define REAL(name) ((__typeof__(&name)) dlsym(RTLD_NEXT, #name))
int rename(const char *from, const char *to) { step(); return REAL(rename)(from, to); }
int unlink(const char *path) { step(); return REAL(unlink)(path); }
int rmdir(const char *path) { step(); return REAL(rmdir)(path); }
int mkdir(const char *path, mode_t mode) { step(); return REAL(mkdir)(path, mode); }
"#;

/// Compiles the killer; `None`, with a word, where there is no C compiler.
fn killer(place: &Place) -> Option<PathBuf> {
    let (source, library) = (place.write("killer.c", KILLER.as_bytes()), place.path("killer.so"));
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-o"])
        .arg(&library)
        .arg(source)
        .arg("-ldl");
    match cc.status() {
        Ok(status) if status.success() => Some(library),
        failed => {
            println!("skipped: no C compiler ({failed:?})");
            None
        }
    }
}

/// The readers' view of the results in `out`: the report's tables and the rows of a trial.
fn read(place: &Place, page: &str) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    // Tables of the other study would stay.
    let _ = std::fs::remove_dir_all(place.path(page));
    succeeds(&place.run(&["report", "out", "--out", page]));
    let found = tree(&place.path(page)).into_iter();
    let named = found.map(|(path, content)| {
        let within = path.strip_prefix(place.path(page)).expect("within");
        (within.to_owned(), content)
    });
    named.collect()
}

/// A run that ends in a folder with results, killed at each of its steps: at each of them there is a manifest, the
/// readers have the old results or the new ones and say nothing else, and the same command ends with the new ones.
fn killed_at_every_step(before: &[&str], run: &[&str]) {
    let place = Place::new();
    place.write("first.toml", FIRST.as_bytes());
    place.write("other.toml", OTHER.as_bytes());
    let Some(killer) = killer(&place) else {
        return;
    };
    let out = place.path("out");
    succeeds(&place.run(before));
    let (old, old_page) = (contents(&out), read(&place, "page-old"));
    copy(&out, &place.path("template"));
    succeeds(&place.run(run));
    let (new, new_page) = (contents(&out), read(&place, "page-new"));
    assert!(old != new && old_page != new_page);
    let (mut at, mut after) = (0, 0);
    loop {
        std::fs::remove_dir_all(&out).expect("removed");
        copy(&place.path("template"), &out);
        let mut command = place.command(run);
        command.env("LD_PRELOAD", &killer);
        command.env("ASOBENCH_TEST_KILL_AT", at.to_string());
        let output = command.output().expect("it runs");
        assert!(out.join("manifest.json").exists(), "step {at}");
        if output.status.signal().is_none() {
            succeeds(&output);
            break;
        }
        let page = read(&place, "page");
        let is_new = page == new_page;
        assert!(is_new || page == old_page, "step {at}: neither old nor new");
        assert!(is_new || after == 0, "step {at}: old after new");
        after += usize::from(is_new);
        let replayed = place.run(&["replay", "out", "0:0"]);
        succeeds(&replayed);
        assert!(
            !stderr(&replayed).contains("warning"),
            "step {at}: {}",
            stderr(&replayed)
        );
        assert!(
            !stdout(&replayed).contains("differ"),
            "step {at}: {}",
            stdout(&replayed)
        );
        succeeds(&place.run(run));
        assert_same(&contents(&out), &new, &format!("step {at}"));
        let left = std::fs::read_dir(&out).expect("a folder").flatten();
        let left = left.filter(|entry| entry.file_name().to_string_lossy().starts_with(".asobench"));
        assert_eq!(left.count(), 0, "step {at}");
        at += 1;
    }
    // Among the steps are several before and after the one that counts.
    assert!(at > 10 && after > 3 && at - after > 3, "{after} of {at}");
}

#[test]
fn a_replacement_killed_at_every_step() {
    killed_at_every_step(&["run", "first.toml", "--out", "out"], &OVERWRITE);
}

#[test]
fn an_extension_killed_at_every_step() {
    let run = ["run", "first.toml", "--out", "out"];
    killed_at_every_step(&run, &[&run[..], &["--trials", "80"]].concat());
}

/// Readers beside runs that replace each other's results: each reads the one or the other.
#[test]
fn readers_beside_see_old_or_new() {
    let place = prepared();
    let first = ["run", "first.toml", "--out", "out", "--overwrite"];
    let pages = [&first, &OVERWRITE].map(|run| {
        succeeds(&place.run(run));
        read(&place, "page")
    });
    let stop = AtomicBool::new(false);
    let readings = std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut readings = 0;
            while !stop.load(Ordering::Relaxed) {
                let page = read(&place, "beside");
                assert!(pages.contains(&page), "reading {readings}: neither");
                readings += 1;
            }
            readings
        });
        for _ in 0..15 {
            succeeds(&place.run(&first));
            succeeds(&place.run(&OVERWRITE));
        }
        stop.store(true, Ordering::Relaxed);
        reader.join().expect("every reading is one of them")
    });
    assert!(readings > 3, "{readings}");
}

/// `merge`, `reproduce` and the suite replace by the same rule.
#[test]
fn every_command_that_writes_results_replaces_by_the_same_rule() {
    let place = prepared();
    succeeds(&place.run(&["plan", "other.toml", "--shards", "1"]));
    succeeds(&place.run(&["shard", "other.plan.json", "1/1"]));
    let merge = ["merge", "other.plan.json", "--out", "out"];
    leaves(&place, "out", &merge, &["another design", "--overwrite"]);
    place.write("out/thesis.tex", b"mine");
    let output = place.run(&[&merge[..], &["--overwrite"]].concat());
    succeeds(&output);
    assert!(
        stderr(&output).contains("left as it is: thesis.tex"),
        "{}",
        stderr(&output)
    );
    succeeds(&place.run(&["run", "other.toml", "--out", "alone"]));
    let mut merged = contents(&place.path("out"));
    assert_eq!(merged.remove("thesis.tex").as_deref(), Some(&b"mine"[..]));
    assert_same(&merged, &contents(&place.path("alone")), "merged");
    std::fs::create_dir(place.path("kept")).expect("made");
    place.write("kept/thesis.tex", b"mine");
    let foreign = ["merge", "other.plan.json", "--out", "kept", "--overwrite"];
    leaves(&place, "kept", &foreign, &["kept", "no manifest.json"]);

    let paper = ["reproduce", "--paper", "nikolov", "--trials", "1", "--out", "out"];
    place.refuses(&paper, &["another design", "--overwrite"]);
    succeeds(&place.run(&[&paper[..], &["--overwrite"]].concat()));
    let found: Contents = contents(&place.path("out"));
    assert!(found.contains_key("fig1.svg") && found.contains_key("thesis.tex"));
    assert!(!place.path("out/blocks").exists());
}
