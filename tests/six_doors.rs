//! The doors by which foreign bytes come in: records as CSV, Parquet and workbook, experiment files, manifest and
//! summary, blocks, and replies of workers. Whatever comes is taken, or refused in one line that names the file, soon
//! and in little memory. Nothing panics.
//!
//! `ASOBENCH_FUZZ_SECONDS=3600 cargo test --release --test it six_doors -- --ignored --nocapture` spends an hour at all
//! doors in turn. A failure tells its file and seed and keeps the input; `ASOBENCH_FUZZ_DOOR=study.toml` and
//! `ASOBENCH_FUZZ_SEED` begin there.

use crate::common::{copy, counting, stderr};
use crate::hostile::{command, parquet_files, wait};
use crate::stored_damage::{Random, STUDY, originals};
use asobench::data::csv::{Missing, ReadOptions};
use asobench::files::{numbers_as_parquet, read_record};
use asobench::report::{Study, report};
use asobench::study::file::ExperimentFile;
use asobench::study::{Block, BlockFolder, Experiment};
use asobench::worker::{Record, heard};
use std::io::{Cursor, Write};
use std::ops::Range;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::xxh3_128;
use zip::{ZipWriter, write::SimpleFileOptions};

/// An input may take so long, and so much memory, and so much more for each of its bytes.
const PATIENCE: Duration = Duration::from_secs(10);
const ROOM: usize = 64 << 20;
const EACH: usize = 200;
/// Longest input that is made longer.
const LONG: usize = 1 << 20;
/// How often the program itself reads an input that was refused.
const PROGRAM: Duration = Duration::from_millis(500);

/// Parts over which a reader may stumble.
const WORDS: &str = "1e400 -0 -0.0 1e-400 NaN inf -inf null true 0 1 -1 2 1000 2147483648 4294967296 \
    9223372036854775808 -9223372036854775809 18446744073709551616 1e308 0.1 1,5 0x10 1979-05-27T07:32:00Z \"\" \" ''' \
    # ; , = \n \r\n \t \0 \u{feff} \u{202e} [] {} [";
const BRACKETS: [&str; 6] = ["[", "{", "{\"a\":", "{a=", "a.", "]"];

const WORKBOOK: &str = "record.xlsx";
const BLOCK: &str = "out/blocks/c00000-0000000000-0000000010.block";
const READY: &str =
    r#"{"frame":"ready","protocol":1,"name":"mine","version":"1","returns":"matrices","deterministic":true}"#;

/// A file, its true contents, what reads it, and the command that does; none where only a process reaches the door.
/// Contents are changed before they are sealed: checksums and compression would end most inputs.
struct Door {
    file: &'static str,
    corpus: Vec<Vec<u8>>,
    read: fn(&Path) -> Result<(), String>,
    command: &'static str,
}

/// A run of letters and digits about a random place.
fn token(random: &mut Random, bytes: &[u8]) -> Range<usize> {
    let is_part = |byte: &&u8| byte.is_ascii_alphanumeric() || b"_.+-".contains(byte);
    let (before, after) = bytes.split_at(random.below(bytes.len()));
    let start = before.len() - before.iter().rev().take_while(is_part).count();
    start..before.len() + after.iter().take_while(is_part).count().max(1)
}

impl Door {
    /// The input with a number; the same for the same corpus.
    fn input(&self, seed: u64) -> Vec<u8> {
        let random = &mut Random(seed);
        let words: Vec<&str> = WORDS.split(' ').collect();
        let mut bytes = random.of(&self.corpus).clone();
        for _ in 0..=random.below(4) {
            if bytes.is_empty() {
                break;
            }
            let (place, other) = (token(random, &bytes), random.of(&self.corpus));
            let from = random.below(other.len());
            let piece = &other[from..(from + 1 + random.below(200)).min(other.len())];
            let times = 10_usize.pow(random.below(6) as u32);
            let new = match random.below(9) {
                0 => random.of(&words).as_bytes().to_vec(),
                1 => [&bytes[place.clone()], random.of(&words).as_bytes()].concat(),
                2 => other[token(random, other)].to_vec(),
                3 => [piece, &bytes[place.clone()]].concat(),
                4 if bytes.len() < LONG => piece.repeat(times.min(LONG / piece.len())),
                5 if bytes.len() < LONG => random.of(&BRACKETS).repeat(times).into_bytes(),
                _ => {
                    random.damage(&mut bytes);
                    continue;
                }
            };
            bytes.splice(place, new);
        }
        bytes = self.sealed(bytes);
        if random.below(10) == 0 && !bytes.is_empty() {
            random.damage(&mut bytes);
        }
        bytes
    }

    /// The file of these contents: a block has its checksum, a worksheet stands in its workbook.
    fn sealed(&self, mut bytes: Vec<u8>) -> Vec<u8> {
        match self.file {
            BLOCK => {
                bytes.truncate(bytes.len().saturating_sub(16));
                bytes.extend(xxh3_128(&bytes).to_le_bytes());
                bytes
            }
            WORKBOOK => workbook(&bytes),
            _ => bytes,
        }
    }

    /// Reads the file. The inner error is what was said.
    fn read(&self, path: &Path, bytes: &[u8]) -> Result<Result<(), String>, String> {
        std::fs::write(path, bytes).expect("written");
        let (begin, before) = (Instant::now(), counting::begin());
        let said = catch_unwind(|| (self.read)(path)).map_err(|_| "a panic".to_owned())?;
        let (took, held) = (begin.elapsed(), counting::most_held() - before);
        match said {
            _ if took > PATIENCE => Err(format!("{took:?}")),
            _ if held > (ROOM + EACH * bytes.len()).cast_signed() => {
                Err(format!("{held} bytes of memory for {}", bytes.len()))
            }
            Err(said) if said.lines().count() != 1 => Err(format!("said: {said}")),
            said => Ok(said),
        }
    }

    /// The program takes the file too, or refuses it in a line that names it.
    fn run(&self, original: &Path, bytes: &[u8], taken: bool) -> Result<(), String> {
        let folder = tempfile::tempdir().expect("a folder");
        copy(original, folder.path());
        std::fs::write(folder.path().join(self.file), bytes).expect("written");
        let words: Vec<&str> = self.command.split(' ').collect();
        let output = wait(command(folder.path(), &words));
        let (said, code) = (stderr(&output), output.status.code());
        let name = self.file.rsplit('/').next().expect("a name");
        let is_refused = code == Some(2) && said.contains(name) && said.lines().count() == 1;
        let is_taken = taken && matches!(code, Some(0..3)) && !said.contains("panicked");
        let what = || format!("{words:?}, {code:?}: {said}");
        (is_refused || is_taken).then_some(()).ok_or_else(what)
    }

    /// Tries inputs for some time. Returns the failures.
    fn knock(&self, time: Duration, first: u64, original: &Path) -> Vec<String> {
        let (place, file) = (tempfile::tempdir().expect("a folder"), self.file);
        copy(original, place.path());
        let path = place.path().join(file);
        println!("{file}: what aborts or hangs is {}", path.display());
        for bytes in &self.corpus {
            let said = self.read(&path, &self.sealed(bytes.clone()));
            assert!(said.is_ok(), "{file}, unchanged: {said:?}");
        }
        let (begin, mut next, mut failures) = (Instant::now(), Duration::ZERO, Vec::new());
        let (mut seed, mut taken, mut slowest) = (first, 0, (Duration::ZERO, 0));
        while seed == first || begin.elapsed() < time && failures.len() < 20 {
            let (bytes, start) = (self.input(seed), begin.elapsed());
            let said = self.read(&path, &bytes);
            slowest = slowest.max((begin.elapsed().saturating_sub(start), seed));
            let is_taken = said == Ok(Ok(()));
            taken += u64::from(is_taken);
            let mut failure = said.err();
            // An experiment that is taken may take hours.
            let is_short = !self.command.is_empty() && (!is_taken || file != "study.toml");
            if failure.is_none() && start >= next && is_short {
                // Of a block the program needs no more than its head if another one has its trials.
                failure = self.run(original, &bytes, is_taken || file == BLOCK).err();
                next = begin.elapsed() + PROGRAM;
            }
            if let Some(what) = failure {
                let kept = format!("six-doors-{seed}-{}", file.replace('/', "-"));
                let kept = std::env::temp_dir().join(kept);
                std::fs::write(&kept, &bytes).expect("written");
                failures.push(format!("{file}, {seed} ({}): {what}", kept.display()));
                println!("{}", failures[failures.len() - 1]);
            }
            seed += 1;
        }
        let tried = seed - first;
        println!("{file}: {tried} inputs, {taken} taken, slowest {slowest:?}");
        failures
    }
}

fn in_words<T, E: std::fmt::Display>(said: Result<T, E>) -> Result<T, String> {
    said.map_err(|error| error.to_string())
}

/// Reads a record, and its longest part without a gap.
fn record(path: &Path) -> Result<(), String> {
    let read = |missing| {
        let options = ReadOptions {
            missing,
            ..ReadOptions::default()
        };
        in_words(read_record(path, None, &options))
    };
    let part = read(Missing::LongestRun).err().unwrap_or_default();
    assert!(!part.contains('\n'), "{part}");
    read(Missing::Refuse).map(drop)
}

fn experiment(path: &Path) -> Result<(), String> {
    let file = in_words(ExperimentFile::read(path))?;
    in_words(file.check_filters().and_then(|()| Experiment::new(file))).map(drop)
}

/// A workbook with one worksheet, as Excel packs it.
fn workbook(sheet: &[u8]) -> Vec<u8> {
    const MAIN: &str = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    const OFFICE: &str = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    const PACKAGE: &str = "http://schemas.openxmlformats.org/package/2006";
    let relations = |kind: &str, target: &str| {
        format!(
            "<Relationships xmlns=\"{PACKAGE}/relationships\"><Relationship Id=\"rId1\" Type=\"{OFFICE}/{kind}\" \
             Target=\"{target}\"/></Relationships>"
        )
    };
    let parts = [
        (
            "[Content_Types].xml",
            format!("<Types xmlns=\"{PACKAGE}/content-types\"/>"),
        ),
        ("_rels/.rels", relations("officeDocument", "xl/workbook.xml")),
        (
            "xl/workbook.xml",
            format!(
                "<workbook xmlns=\"{MAIN}\" xmlns:r=\"{OFFICE}\"><sheets>\
             <sheet name=\"a\" sheetId=\"1\" r:id=\"rId1\"/>\
                 </sheets></workbook>"
            ),
        ),
        (
            "xl/_rels/workbook.xml.rels",
            relations("worksheet", "worksheets/sheet1.xml"),
        ),
    ];
    let parts = parts.iter().map(|(name, text)| (*name, text.as_bytes()));
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in parts.chain([("xl/worksheets/sheet1.xml", sheet)]) {
        zip.start_file(name, SimpleFileOptions::default()).expect("a part");
        zip.write_all(text).expect("written");
    }
    zip.finish().expect("a workbook").into_inner()
}

/// A worksheet of u and y, whose y is of formulas and has a style.
fn worksheet() -> Vec<u8> {
    let text = |cell: &str, text: &str| format!("<c r=\"{cell}\" t=\"inlineStr\"><is><t>{text}</t></is></c>");
    let head = [text("A1", "u"), text("B1", "y")].concat();
    let row = |k: u32| {
        let (u, y) = (f64::from(k * k * 7 % 11), f64::from(k * k * 5 % 11));
        format!("<row r=\"{k}\"><c r=\"A{k}\"><v>{u}</v></c><c r=\"B{k}\" s=\"1\"><f>A{k}*2</f><v>{y}</v></c></row>")
    };
    let rows: String = (2..62).map(row).collect();
    let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    format!(
        "<worksheet xmlns=\"{main}\"><dimension ref=\"A1:B61\"/><sheetData><row r=\"1\">{head}</row>{rows}</sheetData>\
         </worksheet>"
    )
    .into_bytes()
}

/// A table of u and y with compressed pages.
fn table() -> Vec<u8> {
    let numbers = |factor: i64| (0..60_i64).map(move |k| (k * k * factor % 11) as f64);
    let column = |name: &str, factor| (name.to_owned(), numbers(factor).collect::<Vec<_>>());
    numbers_as_parquet(vec![column("u", 7), column("y", 5)]).expect("written")
}

/// Reports the results about a manifest or a summary.
fn results(path: &Path) -> Result<(), String> {
    let study = in_words(Study::read(path.parent().expect("a folder")))?;
    report(&[study], &mut |_| {});
    Ok(())
}

fn block(path: &Path) -> Result<(), String> {
    let file = ExperimentFile::parse(STUDY).and_then(Experiment::new);
    let experiment = file.expect("an experiment");
    let folder = path.ancestors().nth(2).expect("results");
    let blocks = in_words(BlockFolder::open(folder, &experiment))?;
    let (span, content) = in_words(blocks.parsed(path, std::fs::read(path).expect("a file")))?;
    in_words(Block::decode(&content, &experiment, span)).map(drop)
}

/// Reads a greeting, or a reply about two records.
fn reply(path: &Path) -> Result<(), String> {
    let bytes = std::fs::read(path).expect("a file");
    let signal: Vec<f64> = (0..40).map(|k| f64::from(k * k * 7 % 11)).collect();
    let record = Record {
        u: signal.clone(),
        y: signal.clone(),
        r: signal,
        ..Record::default()
    };
    let number = (!bytes.starts_with(b"{\"frame\":\"ready")).then_some(1);
    let matrices = bytes.windows(7).any(|part| part == b"\"order\"");
    heard(&bytes, number, matrices, &[record.clone(), record]).map(drop)
}

/// A reply about two records, with so many numbers of each model.
fn reply_of(form: &str, width: usize) -> Vec<u8> {
    let (count, start) = (2 * (2 + width), r#"{"frame":"reply","number":1,"trials":2"#);
    let header = format!("{start},{form},\"bytes\":{}}}\n", 8 * count);
    let number = |k: usize| if k < 2 { 0.0 } else { 0.3 / k as f64 };
    let numbers = (0..count).flat_map(|k| number(k).to_le_bytes());
    header.bytes().chain(numbers).chain([b'\n']).collect()
}

/// The files with an ending in a folder, in order.
fn all(folder: &Path, ending: &str) -> Vec<Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries.map(|of| of.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|of| of == ending));
    paths.sort();
    let read = |path: &PathBuf| std::fs::read(path).expect("a file");
    paths.iter().map(read).collect()
}

/// Tries inputs at all doors, in so much time at each.
fn knock(time: Duration) {
    let variable = |name: &str| std::env::var(format!("ASOBENCH_FUZZ_{name}")).ok();
    let (folder, sources) = (originals(), Path::new(env!("CARGO_MANIFEST_DIR")));
    let out = folder.path().join("out");
    // As version 0.2.0 wrote them: without checksums.
    let unsealed = |name: &str| {
        let text = std::fs::read(out.join(name)).expect("a file");
        let mut json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        let keys = json.as_object_mut().expect("an object");
        keys.retain(|key, _| !key.starts_with("checksum"));
        std::fs::write(out.join(name), json.to_string()).expect("written");
        vec![json.to_string().into_bytes()]
    };
    let mut csv = all(&sources.join("tests/recorded_data/data"), "csv");
    csv.extend(all(&sources.join("tests/recorded_data/newcomers"), "csv"));
    csv.extend(all(&sources.join("examples"), "csv"));
    for text in &mut csv {
        text.truncate(2000);
    }
    let mut parquet = all(&out, "parquet");
    parquet.extend(parquet_files().into_iter().map(|(_, bytes, _)| bytes));
    parquet.retain(|bytes| bytes.len() < 100_000);
    parquet.extend(vec![table(); parquet.len()]);
    let mut toml = all(&sources.join("experiments"), "toml");
    toml.extend(all(&sources.join("suite"), "toml"));
    let replies = vec![
        [READY, "\n"].concat().into(),
        reply_of(r#""na":2,"nb":2,"covariance":true,"noise_variance":true"#, 21),
        reply_of(r#""nb":1,"nc":1,"nd":1,"nf":2,"reasons":["none"]"#, 5),
        reply_of(r#""order":2"#, 11),
    ];
    let blocks = all(&out.join("blocks"), "block");
    let [manifest, summary] = ["manifest.json", "summary.json"].map(unsealed);
    let doors: [(_, _, fn(&Path) -> _, _); 8] = [
        ("record.csv", csv, record, "estimate record.csv --order 1"),
        ("record.parquet", parquet, record, "estimate record.parquet --order 1"),
        (WORKBOOK, vec![worksheet()], record, "estimate record.xlsx --order 1"),
        ("study.toml", toml, experiment, "check study.toml"),
        ("out/manifest.json", manifest, results, "report out"),
        ("out/summary.json", summary, results, "report out"),
        (BLOCK, blocks, block, "run study.toml --out out --trials 40"),
        ("reply", replies, reply, ""),
    ];
    let mut doors: Vec<Door> = doors
        .into_iter()
        .map(|(file, corpus, read, command)| Door {
            file,
            corpus,
            read,
            command,
        })
        .collect();
    doors.retain(|door| variable("DOOR").is_none_or(|file| file == door.file));
    let first = variable("SEED").map_or(0, |seed| seed.parse().expect("a number"));
    let failures = doors.iter().flat_map(|door| door.knock(time, first, folder.path()));
    let failures: Vec<String> = failures.collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_second_at_each_door() {
    knock(Duration::from_secs(1));
}

#[test]
#[ignore = "an hour (ASOBENCH_FUZZ_SECONDS): cargo test --release --test it six_doors -- --ignored --nocapture"]
fn an_hour_at_the_doors() {
    let seconds = std::env::var("ASOBENCH_FUZZ_SECONDS");
    let seconds = seconds.map_or(3600, |seconds| seconds.parse().expect("a number"));
    knock(Duration::from_secs(seconds) / 8);
}
