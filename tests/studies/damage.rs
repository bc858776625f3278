//! Folders that are damaged, foreign, busy or full.

use super::{Contents, Place, assert_same, blocks, contents, copy, stderr, wait_until};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;
use xxhash_rust::xxh3::xxh3_128;

const RUN: [&str; 4] = ["run", "everything.toml", "--block", "100"];

fn run_in(out: &str) -> Vec<&str> {
    [&RUN[..], &["--out", out]].concat()
}

/// Every file of a folder and of its blocks, with its time of change.
fn state(folder: &Path) -> Vec<(PathBuf, Vec<u8>, SystemTime)> {
    let mut files = blocks(folder);
    files.extend(contents(folder).keys().map(|name| folder.join(name)));
    files.push(folder.join("blocks/design.json"));
    let time = |path: &Path| std::fs::metadata(path).and_then(|m| m.modified()).expect("a time");
    let read = |path: PathBuf| (path.clone(), std::fs::read(&path).expect("a file"), time(&path));
    files.into_iter().map(read).collect()
}

/// Changes a block file's bytes before its checksum, and the checksum with them.
fn with_checksum(bytes: &[u8], change: impl Fn(&mut [u8])) -> Vec<u8> {
    let mut bytes = bytes[..bytes.len() - 16].to_vec();
    change(&mut bytes);
    let checksum = xxh3_128(&bytes).to_le_bytes();
    bytes.extend(checksum);
    bytes
}

#[test]
fn damaged_blocks_are_named_and_repaired() {
    type Damage = (&'static str, fn(&[u8]) -> Vec<u8>);
    let place = Place::new();
    let expected = place.results("whole", &RUN[2..]);
    let damages: [Damage; 8] = [
        ("truncated", |bytes| bytes[..bytes.len() - 1].to_vec()),
        ("half", |bytes| bytes[..bytes.len() / 2].to_vec()),
        ("flipped", |bytes| {
            let mut bytes = bytes.to_vec();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            bytes
        }),
        ("head", |bytes| {
            let mut bytes = bytes.to_vec();
            bytes[33] ^= 1;
            bytes
        }),
        ("empty", |_| Vec::new()),
        ("foreign", |_| {
            b"PAR1 something else that is long enough to be a block by its length alone PAR1".to_vec()
        }),
        ("shorter", |bytes| {
            // The tally's number of trials.
            with_checksum(bytes, |bytes| bytes[48] -= 1)
        }),
        ("undecodable", |bytes| {
            with_checksum(bytes, |bytes| bytes[48..].fill(0xff))
        }),
    ];
    for (i, (name, damage)) in damages.into_iter().enumerate() {
        let folder = place.path(name);
        copy(&place.path("whole"), &folder);
        let victim = blocks(&folder).swap_remove(5 * i);
        let victim_name = victim.file_name().and_then(|name| name.to_str()).expect("a name");
        std::fs::write(&victim, damage(&std::fs::read(&victim).expect("a file"))).expect("written");
        let before = state(&folder);
        place.refuses(&run_in(name), &[victim_name, "--repair"]);
        assert!(state(&folder) == before, "{name}: a refused run must change nothing");
        let output = place.run(&[&run_in(name)[..], &["--repair"]].concat());
        assert_eq!(output.status.code(), Some(0), "{name}: {}", stderr(&output));
        assert_same(&contents(&folder), &expected, name);
        for (path, bytes, time) in before
            .iter()
            .filter(|(path, ..)| super::is_block(path) && *path != victim)
        {
            let now = std::fs::metadata(path).and_then(|m| m.modified()).expect("a time");
            assert!(
                now == *time && std::fs::read(path).expect("a file") == *bytes,
                "{name}: {}",
                path.display()
            );
        }
        let output = place.run(&run_in(name));
        assert_eq!(output.status.code(), Some(0), "{name}: {}", stderr(&output));
    }
    // Several at once, one of them gone.
    let folder = place.path("several");
    copy(&place.path("whole"), &folder);
    let all = blocks(&folder);
    std::fs::write(&all[0], b"").expect("written");
    std::fs::write(&all[40], b"asobench").expect("written");
    std::fs::remove_file(&all[20]).expect("removed");
    let output = place.run(&[&run_in("several")[..], &["--repair"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_same(&contents(&folder), &expected, "several");
}

/// Blocks whose checksum and fingerprint are right and whose content is not.
#[test]
fn blocks_that_do_not_fit_are_damaged() {
    let place = Place::new();
    let few = ["--trials", "100"];
    let expected = place.results("whole", &few);
    let victim = blocks(&place.path("whole")).swap_remove(3);
    let name = victim.file_name().expect("a name").to_owned();
    let name = name.to_str().expect("UTF-8");
    let whole = std::fs::read(&victim).expect("a file");
    let mut forged = vec![
        with_checksum(&whole, |bytes| bytes[28..32].fill(0xff)),
        with_checksum(&whole, |bytes| bytes[28] = 12),
        with_checksum(&whole, |bytes| bytes[40..48].fill(0)),
        // The tally's number of trials.
        with_checksum(&whole, |bytes| bytes[48] -= 1),
    ];
    for (i, change) in [
        "horizon=111",
        "curves=false",
        "parameters=false",
        "store=summaries",
        "measures=[\"e_a\", \"e_b\"]",
        "bounds=[]",
        "slopes=[]",
        "compare=[]",
    ]
    .into_iter()
    .enumerate()
    {
        let out = format!("other{i}");
        place.results(&out, &[&few[..], &["--set", change]].concat());
        let other = std::fs::read(place.path(&out).join("blocks").join(name)).expect("a file");
        forged.push(with_checksum(&other, |bytes| {
            bytes[12..28].copy_from_slice(&whole[12..28]);
        }));
    }
    let run = [&["run", "everything.toml", "--out", "whole"][..], &few].concat();
    for (i, bytes) in forged.into_iter().enumerate() {
        std::fs::write(&victim, bytes).expect("written");
        place.refuses(&run, &[name, "damaged", "--repair"]);
        let output = place.run(&[&run[..], &["--repair"]].concat());
        assert_eq!(output.status.code(), Some(0), "{i}: {}", stderr(&output));
        assert_same(&contents(&place.path("whole")), &expected, name);
    }
}

/// A block that says it covers others takes their place only where it can be decoded.
#[test]
fn a_forged_head_removes_no_block() {
    let place = Place::new();
    let expected = place.results("whole", &["--trials", "100", "--block", "25"]);
    let folder = place.path("whole");
    let first = blocks(&folder).swap_remove(0);
    let bytes = std::fs::read(&first).expect("a file");
    let wide = with_checksum(&bytes, |bytes| {
        bytes[40..48].copy_from_slice(&100_u64.to_le_bytes());
    });
    let name = "c00000-0000000000-0000000100.block";
    let before = state(&folder);
    std::fs::write(folder.join("blocks").join(name), wide).expect("written");
    let run = ["run", "everything.toml", "--trials", "100", "--out", "whole"];
    place.refuses(&run, &[name, "damaged", "--repair"]);
    for (path, bytes, _) in &before {
        assert!(std::fs::read(path).is_ok_and(|now| now == *bytes));
    }
    let output = place.run(&[&run[..], &["--repair"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_same(&contents(&folder), &expected, "repaired");
}

#[test]
fn newer_versions_and_other_designs_are_left_alone() {
    let place = Place::new();
    place.results("out", &RUN[2..]);
    let folder = place.path("out");
    let refuses = |more: &[&str], parts: &[&str]| {
        let before = state(&folder);
        place.refuses(&[&run_in("out")[..], more].concat(), parts);
        assert!(state(&folder) == before, "{more:?}: a refused run must change nothing");
    };
    refuses(&["--set", "eta=[2, 11]"], &["out", "another design", "settings.eta"]);
    refuses(&["--set", "seed=6", "--set", "curves=false"], &["seed", "curves"]);
    // Other methods alone are computed beside what is there; not so with another seed.
    let methods = ["--set", "methods.0.iterations=3", "--set", "compare=[]"];
    refuses(
        &[&methods[..], &["--set", "seed=6"]].concat(),
        &["methods", "compare", "seed"],
    );
    refuses(
        &["--set", "noises.coloured.numerator=[1.0, 0.6]"],
        &["noises.coloured.numerator"],
    );
    refuses(&["--set", "store=summaries"], &["store"]);
    // Words are no part of the design.
    let words = ["--set", "title=Another title", "--set", "claims=[\"C4\"]"];
    let output = place.run(&[&run_in("out")[..], &words[..]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));

    let victim = blocks(&folder).swap_remove(3);
    let name = victim
        .file_name()
        .and_then(|name| name.to_str())
        .expect("a name")
        .to_owned();
    let whole = std::fs::read(&victim).expect("a file");
    let newer = with_checksum(&whole, |bytes| bytes[8] += 1);
    std::fs::write(&victim, newer).expect("written");
    for more in [&[][..], &["--repair"]] {
        refuses(more, &[&name, "newer version of asobench"]);
    }
    let older = with_checksum(&whole, |bytes| bytes[8] -= 1);
    std::fs::write(&victim, older).expect("written");
    for more in [&[][..], &["--repair"]] {
        refuses(more, &[&name, "older build of asobench", "--overwrite"]);
    }
    let foreign = with_checksum(&whole, |bytes| bytes[12] ^= 1);
    std::fs::write(&victim, foreign).expect("written");
    for more in [&[][..], &["--repair"]] {
        refuses(more, &[&name, "another experiment", "remove this file"]);
    }
    std::fs::write(&victim, whole).expect("written");
    // A newer program's manifest and design.
    for file in ["manifest.json", "blocks/design.json"] {
        let path = folder.join(file);
        let text = std::fs::read_to_string(&path).expect("a file");
        let version = concat!("\"version\":\"", env!("CARGO_PKG_VERSION"), "\"");
        assert!(text.contains(version), "{text}");
        std::fs::write(&path, text.replace(version, "\"version\":\"99.0.0\"")).expect("written");
        refuses(&[], &[file, "99.0.0", "newer"]);
        if file == "manifest.json" {
            place.refuses(&["replay", "out", "0:0"], &[file, "99.0.0", "newer"]);
            place.refuses(&["report", "out"], &[file, "99.0.0", "newer"]);
        }
        std::fs::write(&path, text).expect("written");
    }
    // Not this program's.
    for file in ["manifest.json", "blocks/design.json"] {
        let path = folder.join(file);
        let text = std::fs::read_to_string(&path).expect("a file");
        std::fs::write(&path, "[1, 2").expect("written");
        refuses(&[], &[file, "not a manifest"]);
        std::fs::write(&path, text).expect("written");
    }
    // `reproduce` does not take another study's blocks away.
    let before = state(&folder);
    place.refuses(
        &["reproduce", "--paper", "nikolov", "--trials", "1", "--out", "out"],
        &["--out", "another design"],
    );
    assert!(state(&folder) == before);
}

/// A kill while results are published leaves some of them without a manifest; the blocks' design tells of which study.
#[test]
fn killed_while_publishing() {
    let place = Place::new();
    for store in ["store=trials", "store=summaries"] {
        let run = [&run_in("out")[..], &["--trials", "50", "--set", store]].concat();
        let again = |what: &str, expected: &Contents| {
            let output = place.run(&run);
            assert_eq!(output.status.code(), Some(0), "{what}: {}", stderr(&output));
            assert_same(&contents(&place.path("out")), expected, what);
        };
        let output = place.run(&run);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let expected = contents(&place.path("out"));
        let names: Vec<&String> = expected.keys().filter(|n| *n != "manifest.json").collect();
        // Everything but the manifest is there, then one file less each time.
        for gone in 0..=names.len() {
            for name in [&"manifest.json".to_owned()]
                .into_iter()
                .chain(names[..gone].iter().copied())
            {
                std::fs::remove_file(place.path("out").join(name)).expect("removed");
            }
            if gone == 1 {
                place.refuses(&["report", "out"], &["out", "no results"]);
                let other = [&run[..], &["--set", "seed=6"]].concat();
                place.refuses(&other, &["out", "another design", "seed"]);
            }
            again(&format!("{store}, {gone} gone"), &expected);
        }
        std::fs::remove_dir_all(place.path("out")).expect("removed");
    }
    // `reproduce` keeps no blocks beside whole results, but their design beside a part of them.
    let reproduce = ["reproduce", "--paper", "nikolov", "--trials", "1", "--out", "paper"];
    let done = || {
        let output = place.run(&reproduce);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        contents(&place.path("paper"))
    };
    let expected = done();
    let design = place.path("paper/blocks/design.json");
    assert!(!design.exists());
    std::fs::remove_file(place.path("paper/manifest.json")).expect("removed");
    place.refuses(&reproduce, &["paper", "trials.parquet without manifest.json"]);
    // A kill leaves some files, and the blocks.
    let manifest: serde_json::Value = serde_json::from_slice(&expected["manifest.json"]).expect("JSON");
    let experiment = asobench::study::Experiment::nikolov2023(2023).design();
    std::fs::create_dir(place.path("paper/blocks")).expect("a folder");
    let text = serde_json::json!({ "version": manifest["version"], "experiment": experiment });
    std::fs::write(&design, text.to_string()).expect("written");
    assert_same(&done(), &expected, "reproduce");
    assert!(!design.exists());
}

/// Another program's summary.json is not overwritten.
#[test]
fn foreign_results_are_left_alone() {
    let place = Place::new();
    std::fs::create_dir(place.path("out")).expect("a folder");
    for name in ["summary.json", "summary.parquet", "trials.parquet"] {
        let path = place.write(&format!("out/{name}"), b"precious");
        let without = format!("{name} without manifest.json");
        place.refuses(&run_in("out"), &["--out", "out", &without]);
        place.refuses(
            &["reproduce", "--paper", "nikolov", "--trials", "1", "--out", "out"],
            &[&without],
        );
        assert_eq!(std::fs::read(&path).expect("a file"), b"precious");
        assert!(!place.path("out/blocks").exists());
        std::fs::remove_file(path).expect("removed");
    }
}

#[test]
fn two_runs_in_one_folder() {
    let place = Place::new();
    let arguments = [
        "run",
        "everything.toml",
        "--out",
        "out",
        "--trials",
        "1000000",
        "--block",
        "50",
    ];
    let mut child = place.start(&arguments);
    wait_until(|| !blocks(&place.path("out")).is_empty());
    place.refuses(&arguments, &["--out", "out", "another run"]);
    place.refuses(
        &["reproduce", "--paper", "nikolov", "--trials", "1", "--out", "out"],
        &["another run"],
    );
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert!(contents(&place.path("out")).is_empty());
}

/// A path that cannot be a folder is refused before anything is computed.
#[test]
fn folders_that_cannot_be() {
    let place = Place::new();
    place.write("file", b"");
    std::fs::create_dir(place.path("odd")).expect("a folder");
    place.write("odd/blocks", b"");
    for (out, part) in [
        ("file", "file"),
        ("file/out", "file/out"),
        ("/proc/asobench", "/proc/asobench"),
        ("odd", "odd/blocks"),
    ] {
        place.refuses(&run_in(out), &["--out", part, "cannot write"]);
    }
    place.refuses(&run_in(""), &["--out", "value is required"]);
    let long = "x".repeat(300);
    place.refuses(&run_in(&long), &["--out", "cannot write"]);
}

/// A file system of 300 kB in memory, which is taken away again.
struct Small(PathBuf);

impl Small {
    fn mount(path: PathBuf, size: &str) -> Option<Self> {
        std::fs::create_dir(&path).expect("a folder");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", size, "tmpfs"])
            .arg(&path)
            .output();
        mounted
            .is_ok_and(|output| output.status.success())
            .then_some(Self(path))
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        // The test is over, or failing already.
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// A full disk ends the run in one line; the blocks that were finished are good, and with more space it goes on.
#[test]
fn a_full_disk() {
    let place = Place::new();
    let expected = place.results("whole", &RUN[2..]);
    let ends = |out: &str, output: std::process::Output, whole: &Contents| {
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(message.contains(out), "{message}");
        assert!(contents(&place.path(out)).is_empty(), "no results of a part");
        assert!(whole.len() == 4);
    };
    // A limit on the size of files: blocks fit, the table of trials does not.
    let script = format!(
        "trap '' XFSZ; ulimit -f 300; exec '{}' run everything.toml --block 100 --out limited",
        super::PROGRAM
    );
    let output = Command::new("bash")
        .args(["-c", &script])
        .current_dir(place.folder.path())
        .output();
    ends("limited", output.expect("bash runs"), &expected);
    assert_eq!(blocks(&place.path("limited")).len(), 48, "finished blocks stay");
    assert_same(&place.results("limited", &RUN[2..]), &expected, "limited");

    let Some(small) = Small::mount(place.path("small"), "size=300k") else {
        println!("skipped: no file system could be mounted (not root?)");
        return;
    };
    let run = [&run_in("small/out")[..], &["--anyway"]].concat();
    ends("small/out", place.run(&run), &expected);
    let finished = blocks(&place.path("small/out"));
    assert!(!finished.is_empty() && finished.len() < 48);
    let grown = Command::new("mount")
        .args(["-o", "remount,size=60m"])
        .arg(&small.0)
        .status();
    assert!(grown.expect("mount runs").success());
    let before: Vec<Vec<u8>> = finished
        .iter()
        .map(|path| std::fs::read(path).expect("a file"))
        .collect();
    assert_same(&place.results("small/out", &RUN[2..]), &expected, "small");
    for (path, bytes) in finished.iter().zip(before) {
        assert!(std::fs::read(path).expect("a file") == bytes, "{}", path.display());
    }
}
