//! Forged files with the right checksum. Whatever a block, a manifest or a summary contains, it is either refused with
//! a message of one line, or decoded, merged, summarised and reported. Nothing panics.
//!
//! `ASOBENCH_MUTATIONS=100000 cargo test --release -p asobench-report forged -- --nocapture` tries that many and counts
//! the outcomes.

#![expect(clippy::print_stdout, reason = "the counts that were found")]

use crate::{Study, report};
use asobench_study::study::file::ExperimentFile;
use asobench_study::study::{
    Block, BlockFolder, Campaign, CellPart, CellTally, Experiment, Looks, RunOptions, Summary, check_result,
    parse_manifest, read_manifest,
};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use xxhash_rust::xxh3::xxh3_128;

/// Pairs, slopes, curves, parameters, bounds and failures; the rest of the file adds other engines and stores.
const DISCRETE: &str = r#"
trials = 60
measures = ["e_a", "e_x_max", "condition"]
parameters = true
curves = true
compare = [["iv(4)", "ls"]]
[settings]
window = [18, 24]
eta = 40
horizon = 40
[[methods]]
estimator = "iv"
[[slopes]]
figure = "e_a"
over = "window"
statistic = "median"
[[bounds]]
figure = "e_a"
below = 0.5
"#;

/// Random disturbances with a stored course.
const CONTINUOUS: &str = r#"
trials = 6
store = "trials"
measures = ["rms_x", "e_theta"]
compare = [["proposed", "luenberger"]]
[continuous]
until = 2
scored_from = 1
filters = [1]
error_limit = 0.5
trace_every = 0.5
[settings]
disturbance = "white"
level = [0, 0.4]
noise_hold = 0.05
step = 0.05
[[observers]]
observer = "luenberger"
gain = [2, 3.2]
[[observers]]
observer = "proposed"
gains = [1e11, 1e13]
"#;

/// A study with the bytes of its files.
struct Original {
    experiment: Experiment,
    folder: tempfile::TempDir,
    /// The first block of every cell.
    blocks: Vec<(PathBuf, Vec<u8>)>,
    manifest: Value,
    summary: Value,
}

impl Original {
    fn new(text: &str) -> Self {
        let experiment = Experiment::new(ExperimentFile::parse(text).unwrap()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let (rule, options) = (experiment.file.trials.clone(), RunOptions::default());
        let campaign = Campaign::open(folder.path(), &experiment, rule, options).unwrap();
        let stop = AtomicBool::new(false);
        campaign.run(&stop, |_| {}, |_| Vec::new()).unwrap();
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        let json = |name: &str| {
            let mut json: Value = serde_json::from_str(&read(name)).unwrap();
            // As version 0.2.0 wrote them.
            let keys = json.as_object_mut().unwrap();
            keys.retain(|key, _| !key.starts_with("checksum"));
            json
        };
        let block = |cell: usize| {
            let files = std::fs::read_dir(folder.path().join("blocks")).unwrap();
            let mut paths: Vec<PathBuf> = files.map(|file| file.unwrap().path()).collect();
            paths.sort();
            let of_cell = |path: &&PathBuf| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                name.starts_with(&format!("c{cell:05}"))
            };
            let path = paths.iter().find(of_cell).unwrap().clone();
            let bytes = std::fs::read(&path).unwrap();
            (path, bytes)
        };
        Self {
            blocks: (0..experiment.cells.len()).map(block).collect(),
            manifest: json("manifest.json"),
            summary: json("summary.json"),
            experiment,
            folder,
        }
    }

    /// Decodes a block file; `None` if it is refused.
    fn decode(&self, path: &Path, bytes: Vec<u8>) -> Option<Block> {
        let blocks = BlockFolder::open(self.folder.path(), &self.experiment).unwrap();
        let refused = |reason: String| assert!(!reason.contains('\n'), "one line: {reason}");
        let (span, content) = match blocks.parsed(path, bytes) {
            Ok(found) => found,
            Err(error) => {
                refused(error.to_string());
                return None;
            }
        };
        Block::decode(&content, &self.experiment, span).ok()
    }

    /// Decodes a block, merges it with the true ones and reports the result. Returns false if it was refused.
    fn take_block(&self, cell: usize, bytes: Vec<u8>) -> bool {
        let Some(block) = self.decode(&self.blocks[cell].0, bytes) else {
            return false;
        };
        let mut parts = Vec::new();
        for (index, (path, bytes)) in self.blocks.iter().enumerate() {
            let own = self.decode(path, bytes.clone()).expect("a true block");
            let mut tally = CellTally::default();
            if index == block.span.cell {
                tally.merge(block.tally.clone());
                tally.merge(own.tally.clone());
            } else {
                tally.merge(own.tally.clone());
            }
            parts.push(CellPart::new(&self.experiment, index, &tally));
        }
        let summary = Summary::new(&self.experiment, parts);
        let summary = serde_json::to_value(summary).expect("a summary is JSON");
        let taken = self.take_results(&self.manifest, &summary);
        assert!(taken, "a summary of what was taken is refused");
        true
    }

    /// Reports from a manifest and a summary. Returns false if they were refused.
    fn take_results(&self, manifest: &Value, summary: &Value) -> bool {
        let path = self.folder.path().join("manifest.json");
        let Ok(manifest) = parse_manifest(&path, manifest.to_string().as_bytes()) else {
            return false;
        };
        match Study::decode(
            self.folder.path(),
            &manifest,
            summary.to_string().as_bytes(),
            None,
            &Looks::default(),
        ) {
            Ok(study) => {
                let files = report(&[study], &mut |_| {});
                assert!(files.iter().all(|(_, text)| !text.is_empty()));
                true
            }
            Err(error) => {
                assert!(!error.to_string().contains('\n'), "one line: {error}");
                false
            }
        }
    }
}

/// Alters files.
struct Forger(Xoshiro256PlusPlus);

impl Forger {
    fn below(&mut self, limit: usize) -> usize {
        (self.0.random::<u64>() % limit.max(1) as u64) as usize
    }

    fn one_of<T: Clone>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())].clone()
    }

    /// Alters a block's content or the part of its head after the fingerprint, and gives it the right checksum.
    fn block(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        const SPAN: usize = 28;
        const CONTENT: usize = 48;
        bytes.truncate(bytes.len() - 16);
        let from = if self.below(20) == 0 { SPAN } else { CONTENT };
        for _ in 0..=self.below(3) {
            self.bytes(&mut bytes, from);
        }
        bytes.extend(xxh3_128(&bytes).to_le_bytes());
        bytes
    }

    fn bytes(&mut self, bytes: &mut Vec<u8>, from: usize) {
        let numbers: [f64; 9] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            -0.0,
            1e308,
            -1e308,
            5e-324,
            -1.0,
            1e160,
        ];
        if bytes.len() <= from {
            return;
        }
        let at = from + self.below(bytes.len() - from);
        let end = |at: usize, count: usize, bytes: &[u8]| (at + count).min(bytes.len());
        match self.below(9) {
            0 => bytes[at] ^= 1 << self.below(8),
            1 => bytes[at] = self.below(256) as u8,
            2 => bytes[at] = self.one_of(&[0, 1, 0x7f, 0x80, 0xff]),
            3 => bytes.insert(at, self.below(256) as u8),
            4 => drop(bytes.remove(at)),
            5 => bytes.truncate(at),
            6 => {
                let to = end(at, 1 + self.below(40), bytes);
                let copy = bytes[at..to].to_vec();
                let to = from + self.below(bytes.len() - from);
                bytes.splice(to..to, copy);
            }
            7 => {
                let to = end(at, 8, bytes);
                let number = self.one_of(&numbers).to_le_bytes();
                bytes[at..to].copy_from_slice(&number[..to - at]);
            }
            _ => {
                // The largest varint, and lengths beyond any buffer.
                let long = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1];
                let to = end(at, 1, bytes);
                bytes.splice(at..to, long[self.below(9)..].to_vec());
            }
        }
    }

    /// Alters some nodes of a JSON tree.
    fn json(&mut self, value: &mut Value) {
        for _ in 0..=self.below(3) {
            self.node(value);
        }
    }

    /// Descends to a random node and alters it.
    fn node(&mut self, value: &mut Value) {
        let stop = self.below(12) == 0;
        match value {
            Value::Array(values) if !values.is_empty() && !stop => {
                let at = self.below(values.len());
                self.node(&mut values[at]);
            }
            Value::Object(values) if !values.is_empty() && !stop => {
                let at = self.below(values.len());
                if let Some((_, value)) = values.iter_mut().nth(at) {
                    self.node(value);
                }
            }
            Value::Array(values) if !values.is_empty() => {
                let at = self.below(values.len());
                match self.below(3) {
                    0 => drop(values.remove(at)),
                    1 => values.push(values[at].clone()),
                    _ => values.clear(),
                }
            }
            Value::Object(values) if !values.is_empty() => {
                let at = self.below(values.len());
                let key = values.keys().nth(at).cloned().unwrap_or_default();
                if let Some(value) = values.remove(&key)
                    && self.below(2) == 0
                {
                    values.insert(format!("{key}x"), value);
                }
            }
            leaf => *leaf = self.leaf(leaf),
        }
    }

    fn leaf(&mut self, value: &Value) -> Value {
        let number = value.as_f64().unwrap_or(1.0);
        let changed = [
            json!(number + 1.0),
            json!(-number),
            json!(number * 1e-3),
            json!(value.as_u64().unwrap_or(0).wrapping_add(1)),
            json!(value.as_u64().unwrap_or(0).saturating_sub(1)),
        ];
        let others = [
            json!(0),
            json!(-1),
            json!(1.5),
            json!(u64::MAX),
            json!(i64::MIN),
            json!(1e308),
            json!(-1e308),
            json!(5e-324),
            Value::Null,
            json!(true),
            json!(""),
            json!("<b>`|\u{202e}\u{7}"),
            json!("e_a"),
            json!([]),
            json!({}),
        ];
        if self.below(2) == 0 {
            self.one_of(&changed)
        } else {
            self.one_of(&others)
        }
    }
}

/// Whatever bit of whatever stored file is flipped, the folder is refused in one line or says the same, to `report` and
/// to a run that goes on in it.
#[test]
fn flipped_bits_are_refused_or_change_nothing() {
    let original = Original::new(&format!("store = \"trials\"\n{DISCRETE}"));
    let (folder, experiment) = (original.folder.path(), &original.experiment);
    let said = || -> Result<Vec<(String, String)>, String> {
        let line = |error: String| {
            assert!(!error.contains('\n'), "one line: {error}");
            error
        };
        let manifest = read_manifest(folder).map_err(|e| line(e.to_string()))?;
        let manifest = manifest.ok_or("no manifest")?;
        for name in ["trials.parquet", "summary.parquet"] {
            check_result(folder, &manifest, name, None).map_err(|e| line(e.to_string()))?;
        }
        let (rule, options) = (experiment.file.trials.clone(), RunOptions::default());
        let campaign = Campaign::open(folder, experiment, rule, options);
        drop(campaign.map_err(|e| line(e.to_string()))?);
        let study = Study::read(folder).map_err(|e| line(e.to_string()))?;
        Ok(report(&[study], &mut |_| {}))
    };
    let expected = said().expect("nothing is damaged");
    let files = [folder, &folder.join("blocks")].map(|folder| {
        let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        paths
            .filter(|path| path.is_file() && !path.ends_with(".lock"))
            .collect::<Vec<_>>()
    });
    let mut forger = Forger(Xoshiro256PlusPlus::seed_from_u64(1));
    let mut refused = 0;
    for number in 0..300 {
        let path = forger.one_of(&files[number % 2]);
        let bytes = std::fs::read(&path).unwrap();
        let mut damaged = bytes.clone();
        // The ends of files have what is special.
        let last = forger.one_of(&[bytes.len(), 60.min(bytes.len())]);
        let place = bytes.len() - 1 - forger.below(last);
        damaged[place] ^= 1 << forger.below(8);
        std::fs::write(&path, &damaged).unwrap();
        match said() {
            Ok(found) => assert!(found == expected, "{}, byte {place}", path.display()),
            Err(_) => refused += 1,
        }
        std::fs::write(&path, &bytes).unwrap();
    }
    assert!(refused > 250, "{refused}");
}

/// The outcomes for the forged files of one kind.
#[derive(Default)]
struct Count {
    refused: usize,
    taken: usize,
    /// The numbers of the files that caused a panic.
    panics: Vec<u64>,
}

/// Forges the file with a number; equal numbers give equal files.
fn forge(originals: &[Original], number: u64, counts: &mut [Count; 3]) {
    let mut forger = Forger(Xoshiro256PlusPlus::seed_from_u64(number));
    let original = &originals[forger.below(originals.len())];
    let kind = forger.one_of(&[0, 0, 1, 2, 2]);
    let outcome = catch_unwind(AssertUnwindSafe(|| match kind {
        0 => {
            let cell = forger.below(original.blocks.len());
            let bytes = forger.block(original.blocks[cell].1.clone());
            original.take_block(cell, bytes)
        }
        1 => {
            let mut manifest = original.manifest.clone();
            forger.json(&mut manifest);
            original.take_results(&manifest, &original.summary)
        }
        _ => {
            let mut summary = original.summary.clone();
            forger.json(&mut summary);
            original.take_results(&original.manifest, &summary)
        }
    }));
    let count = &mut counts[kind];
    match outcome {
        Ok(true) => count.taken += 1,
        Ok(false) => count.refused += 1,
        Err(_) => count.panics.push(number),
    }
}

#[test]
fn forged_files_are_refused_or_taken() {
    let variable = |name: &str| std::env::var(name).ok()?.parse().ok();
    let count: u64 = variable("ASOBENCH_MUTATIONS").unwrap_or(400);
    let first: u64 = variable("ASOBENCH_FIRST_MUTATION").unwrap_or(0);
    let discrete = DISCRETE.replace("parameters = true", "coverage = true");
    let rows = format!("engine = \"faer\"\nstore = \"trials\"\n{discrete}");
    let originals = [DISCRETE, &rows, CONTINUOUS].map(Original::new);
    for original in &originals {
        assert!(original.take_results(&original.manifest, &original.summary));
        assert!(original.take_block(0, original.blocks[0].1.clone()));
    }
    let mut counts: [Count; 3] = Default::default();
    for number in first..first + count {
        forge(&originals, number, &mut counts);
    }
    for (name, count) in ["blocks", "manifests", "summaries"].iter().zip(&counts) {
        println!("{name}: {} refused, {} taken", count.refused, count.taken);
        assert!(count.refused > 0 && count.taken > 0, "{name}: both must happen");
    }
    let panics: Vec<u64> = counts.into_iter().flat_map(|count| count.panics).collect();
    assert!(panics.is_empty(), "panics with {panics:?}");
}
