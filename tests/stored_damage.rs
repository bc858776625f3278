//! Every command that reads stored files, on files with some bytes changed, left out or added: a line that names the
//! file and an exit code that is not 0, or the same output as before. Never a panic, never other numbers. Forged files
//! make no panic either, and commands that only read write nothing.
//!
//! `ASOBENCH_DAMAGES=5000 cargo test --release --test it stored_damage` tries that many.

use crate::common::{asobench_in, copy, done_in, stderr};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Trials, intervals, curves, times, a claim: every file that a run can leave.
pub(crate) const STUDY: &str = r#"
title = "Small"
seed = 5
trials = 30
store = "trials"
coverage = true
curves = true
timing = true
measures = ["e_a"]
compare = [["iv(2)", "ls"]]
[settings]
horizon = 60
eta = [2, 10]
window = 50
[[methods]]
estimator = "iv"
iterations = 2
[[slopes]]
measure = "e_a"
over = "eta"
[[claims]]
id = "small"
text = "IV errs little"
test = { value = "e_a", of = "iv(2)", below = 0.5 }
"#;

/// A command: its words, what it writes, and whether what it says holds times of this machine.
type Asked = (&'static [&'static str], &'static str, bool);

/// The commands that read a folder of results, one of the suite, and shards with their plan.
const ASKED: [(&str, &[Asked]); 3] = [
    (
        "out",
        &[
            (&["report", "out", "--out", "page"], "page", false),
            (&["plot", "out", "--measure", "e_a", "--out", "a.svg"], "a.svg", false),
            (&["plot", "out", "--zip", "--out", "z.svg"], "z.svg", false),
            (&["failures", "out"], "", false),
            (&["compare", "out", "out"], "", false),
            (&["replay", "out", "0:3"], "", false),
            (&["replay", "out", "1:29", "--format", "json"], "", false),
            (&["theory", "out/manifest.json"], "", false),
            (&["check", "out/manifest.json"], "", true),
            (&["check", "out"], "", false),
            (&["plan", "out/manifest.json", "--shards", "2"], "", true),
            (&["run", "study.toml", "--out", "out"], "out", true),
            (&["run", "study.toml", "--out", "out", "--trials", "40"], "out", true),
            (&["run", "out/manifest.json", "--out", "again"], "again", true),
        ],
    ),
    (
        "suite",
        &[
            (&["suite", "scores", "suite", "--edition", "1.1"], "", false),
            (
                &["suite", "scores", "suite", "--edition", "1.1", "--page", "page"],
                "page",
                false,
            ),
        ],
    ),
    (
        "shards",
        &[
            (&["status", "shards/p.plan.json"], "", false),
            (&["status", "shards/p.plan.json", "--verify"], "", false),
            (&["shard", "shards/p.plan.json", "1/2"], "", true),
            (&["merge", "shards/p.plan.json", "--out", "merged"], "merged", true),
        ],
    ),
];

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % limit as u64) as usize
    }

    pub(crate) fn of<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }

    /// Changes, leaves out or adds some bytes, at any place or near the end; tells what it did.
    pub(crate) fn damage(&mut self, bytes: &mut Vec<u8>) -> String {
        let last = bytes.len() - 1;
        let at = match self.below(2) {
            0 => self.below(bytes.len()),
            _ => last - self.below(80.min(bytes.len())),
        };
        let (kind, count) = (self.below(5), 1 + self.below(19));
        let end = (at + count).min(bytes.len());
        match kind {
            0 => bytes[at] ^= 1 << self.below(8),
            1 => bytes[at] = self.below(256) as u8,
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..end)),
            _ => drop(bytes.splice(at..at, (0..count).map(|_| self.below(256) as u8))),
        }
        format!("kind {kind} at {at}, {count} bytes")
    }
}

/// The files of a folder and those within, but for locks, by their paths.
fn files(folder: &Path, place: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut left) = (BTreeMap::new(), vec![folder.join(place)]);
    while let Some(path) = left.pop() {
        if path.is_dir() {
            let entries = std::fs::read_dir(&path).expect("a folder");
            left.extend(entries.map(|entry| entry.expect("an entry").path()));
        } else if !path.ends_with(".lock") && path.is_file() {
            let bytes = std::fs::read(&path).expect("a file");
            found.insert(path.strip_prefix(folder).expect("within").to_owned(), bytes);
        }
    }
    found
}

/// The words and the files of a command: the results alone where it computes or times.
fn outcome(folder: &Path, asked: &Asked, output: &Output) -> (Vec<u8>, BTreeMap<PathBuf, Vec<u8>>) {
    let (_, written, timed) = asked;
    let mut left = match *written {
        "" => BTreeMap::new(),
        place => files(folder, place),
    };
    let within = |path: &Path, name: &str| path.components().any(|part| part.as_os_str() == name);
    left.retain(|path, _| !within(path, "timing") && !within(path, "blocks"));
    let said = if *timed { Vec::new() } else { output.stdout.clone() };
    (said, left)
}

/// A folder with one of each: results, a suite's, and shards.
pub(crate) fn originals() -> tempfile::TempDir {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    for folder in ["out", "suite/methods", "shards"] {
        std::fs::create_dir_all(at(folder)).expect("a folder");
    }
    std::fs::write(at("study.toml"), STUDY).expect("written");
    done_in(place.path(), &["run", "study.toml", "--out", "out", "--block", "10"]);
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("suite");
    for (from, to) in [
        ("results/arx.json", "methods/arx.json"),
        ("results/oe.json", "methods/oe.json"),
        ("times.json", "times.json"),
    ] {
        std::fs::copy(own.join(from), at("suite").join(to)).expect("a copy");
    }
    let plan = "shards/p.plan.json";
    done_in(place.path(), &["plan", "study.toml", "--shards", "2", "--out", plan]);
    for shard in ["1/2", "2/2"] {
        done_in(place.path(), &["shard", plan, shard]);
    }
    place
}

/// How many files are damaged.
fn damages() -> usize {
    std::env::var("ASOBENCH_DAMAGES").map_or(250, |count| count.parse().expect("a number"))
}

#[test]
fn a_damaged_file_is_named_or_changes_nothing() {
    let count = damages();
    let original = originals();
    let fresh = || {
        let folder = tempfile::tempdir().expect("a folder");
        copy(original.path(), folder.path());
        folder
    };
    let mut expected = BTreeMap::new();
    for asked in ASKED.iter().flat_map(|(_, asked)| *asked) {
        let folder = fresh();
        let before = files(folder.path(), "");
        let output = done_in(folder.path(), asked.0);
        let reads = asked.1.is_empty() && !asked.2;
        assert!(!reads || files(folder.path(), "") == before, "{:?} writes", asked.0);
        expected.insert(asked.0, outcome(folder.path(), asked, &output));
    }
    let mut random = Random(1);
    let (mut named, mut same) = (0, 0);
    for _ in 0..count {
        let (place, asked) = random.of(&ASKED);
        let asked = random.of(asked);
        let stored: Vec<PathBuf> = files(original.path(), place).into_keys().collect();
        let (blocks, others): (Vec<_>, Vec<_>) = stored
            .into_iter()
            .partition(|path| path.extension().is_some_and(|of| of == "block"));
        let path = match random.below(3) {
            0 if !blocks.is_empty() => random.of(&blocks),
            _ => random.of(&others),
        };
        let folder = fresh();
        let victim = folder.path().join(path);
        let mut bytes = std::fs::read(&victim).expect("a file");
        let how = random.damage(&mut bytes);
        std::fs::write(&victim, &bytes).expect("written");
        let output = asobench_in(folder.path(), asked.0);
        let (said, code) = (stderr(&output), output.status.code());
        let what = format!("{:?}, {}, {how}: code {code:?}, {said}", asked.0, path.display());
        if code == Some(0) {
            let (words, mut left) = outcome(folder.path(), asked, &output);
            let (before, mut files) = expected[asked.0].clone();
            // Files that the command has not read stay as they are.
            if left.get(path) == Some(&bytes) {
                left.remove(path);
                files.remove(path);
            }
            assert!(words == before, "{what}");
            let differs = files
                .keys()
                .chain(left.keys())
                .find(|path| files.get(*path) != left.get(*path));
            assert!(differs.is_none(), "{differs:?} differs: {what}");
            same += 1;
        } else {
            assert!(matches!(code, Some(1 | 2 | 75)), "{what}");
            let name = path.file_name().expect("a name").to_string_lossy();
            let lines = said.lines().filter(|line| line.contains(&*name));
            // A merge says beside the damaged block which trials are missing.
            assert!(
                lines.count() > 0 && (code == Some(75) || said.lines().count() <= 2),
                "{what}"
            );
            named += 1;
        }
    }
    assert!(named > count / 4 && same > count / 4, "{named} named, {same} the same");
}

/// Puts another value somewhere into a JSON value.
fn forge(json: &mut Value, random: &mut Random) {
    let within = match json {
        Value::Array(list) => list.len(),
        Value::Object(map) => map.len(),
        _ => 0,
    };
    if within == 0 || random.below(4) == 0 {
        *json = random
            .of(&[
                json!(-1),
                json!(0),
                json!(u64::MAX),
                json!(1e308),
                json!(null),
                json!("x"),
                json!([]),
                json!({}),
            ])
            .clone();
        return;
    }
    let at = random.below(within);
    let part = match json {
        Value::Array(list) => list.get_mut(at),
        Value::Object(map) => map.values_mut().nth(at),
        _ => None,
    };
    forge(part.expect("a part"), random);
}

/// A file without checksums may say anything.
#[test]
fn a_forged_file_makes_no_panic() {
    let original = originals();
    let mut random = Random(2);
    for _ in 0..damages() / 4 {
        let (place, asked) = random.of(&ASKED);
        let asked = random.of(asked);
        let folder = tempfile::tempdir().expect("a folder");
        copy(original.path(), folder.path());
        let mut stored: Vec<PathBuf> = files(folder.path(), place).into_keys().collect();
        stored.retain(|path| path.extension().is_some_and(|of| of == "json"));
        let victim = random.of(&stored);
        let mut what = String::new();
        for path in &stored {
            let path_of = folder.path().join(path);
            let text = std::fs::read(&path_of).expect("a file");
            let mut json: Value = serde_json::from_slice(&text).expect("JSON");
            let object = json.as_object_mut().expect("an object");
            object.retain(|key, _| !key.starts_with("checksum"));
            if path == victim {
                forge(&mut json, &mut random);
                what = format!("{:?}, {}: {json}", asked.0, path.display());
            }
            std::fs::write(&path_of, json.to_string()).expect("written");
        }
        let output = asobench_in(folder.path(), asked.0);
        let (said, code) = (stderr(&output), output.status.code());
        let is_told = matches!(code, Some(0..=2 | 75)) && !said.contains("panicked");
        assert!(is_told, "{what}: {code:?}, {said}");
    }
}
