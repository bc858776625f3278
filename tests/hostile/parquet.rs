//! Parquet files that claim more than they hold, made by hand: each is refused in a line that names the file, in little
//! memory and soon.

use super::stderr;
use crate::common::PROGRAM;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Far more than an honest small record takes, and a fraction of what any of these files asks for.
const MEMORY_KIB: u64 = 1_500_000;
const SOON: Duration = Duration::from_secs(20);

/// A value of Thrift's compact protocol.
#[derive(Clone)]
enum Value {
    Int(i64),
    Bytes(Vec<u8>),
    List(Vec<Value>),
    Fields(Vec<(i16, Value)>),
    /// A list of structures that says it has so many.
    Claims(u64),
    /// Bytes that say they are so many.
    Long(u64),
    /// A list of booleans, which have no bytes of their own in the eyes of some readers.
    Booleans(u64),
}
use Value::{Booleans, Bytes, Claims, Fields, Int, List, Long};

fn varint(mut number: u64, to: &mut Vec<u8>) {
    while number > 0x7f {
        to.push(number as u8 | 0x80);
        number >>= 7;
    }
    to.push(number as u8);
}

impl Value {
    fn wire(&self) -> u8 {
        match self {
            Int(_) => 6,
            Bytes(_) | Long(_) => 8,
            List(_) | Claims(_) | Booleans(_) => 9,
            Fields(_) => 12,
        }
    }

    fn write(&self, to: &mut Vec<u8>) {
        match self {
            Int(number) => varint(((number << 1) ^ (number >> 63)) as u64, to),
            Bytes(bytes) => {
                varint(bytes.len() as u64, to);
                to.extend(bytes);
            }
            Long(length) => varint(*length, to),
            List(values) => {
                to.push(0xf0 | values.first().map_or(12, Self::wire));
                varint(values.len() as u64, to);
                for value in values {
                    value.write(to);
                }
            }
            Claims(count) | Booleans(count) => {
                to.push(if matches!(self, Claims(_)) { 0xfc } else { 0xf1 });
                varint(*count, to);
            }
            Fields(fields) => {
                for (number, value) in fields {
                    to.push(value.wire());
                    Int(i64::from(*number)).write(to);
                    value.write(to);
                }
                to.push(0);
            }
        }
    }
}

const DOUBLE: i64 = 5;
const TEXT: i64 = 6;
const OPTIONAL: i64 = 1;

fn group(name: &str, children: i64) -> Value {
    Fields(vec![(3, Int(0)), (4, Bytes(name.into())), (5, Int(children))])
}

fn column(name: &str, of: i64, repetition: i64) -> Value {
    Fields(vec![(1, Int(of)), (3, Int(repetition)), (4, Bytes(name.into()))])
}

/// A chunk of a column: its codec, values, and bytes.
fn chunk(codec: i64, values: i64, [start, length]: [i64; 2]) -> Value {
    let about = vec![
        (1, Int(DOUBLE)),
        (2, List(vec![Int(0)])),
        (3, List(vec![Bytes(b"u".to_vec())])),
        (4, Int(codec)),
        (5, Int(values)),
        (6, Int(length)),
        (7, Int(length)),
        (9, Int(start)),
    ];
    Fields(vec![(2, Int(start)), (3, Fields(about))])
}

fn rows(count: i64, chunks: Vec<Value>) -> Value {
    Fields(vec![(1, List(chunks)), (2, Int(8)), (3, Int(count))])
}

/// A page: its kind, its claim of bytes, its data, and the field of its head.
fn page(kind: i64, claims: i64, data: &[u8], (field, head): (i16, Vec<(i16, Value)>)) -> Vec<u8> {
    let mut bytes = Vec::new();
    let length = Int(data.len() as i64);
    Fields(vec![
        (1, Int(kind)),
        (2, Int(claims)),
        (3, length),
        (field, Fields(head)),
    ])
    .write(&mut bytes);
    bytes.extend(data);
    bytes
}

/// A page of data: how many values, in which encoding.
fn data(values: i64, encoding: i64, claims: i64, bytes: &[u8]) -> Vec<u8> {
    let head = vec![(1, Int(values)), (2, Int(encoding)), (3, Int(3)), (4, Int(3))];
    page(0, claims, bytes, (5, head))
}

fn dictionary(values: i64, claims: i64, bytes: &[u8]) -> Vec<u8> {
    page(2, claims, bytes, (7, vec![(1, Int(values)), (2, Int(0))]))
}

/// A file with these pages and this footer.
fn file(pages: &[u8], footer: Vec<(i16, Value)>) -> Vec<u8> {
    let mut bytes = [b"PAR1", pages].concat();
    let start = bytes.len();
    Fields(footer).write(&mut bytes);
    let length = (bytes.len() - start) as u32;
    bytes.extend(length.to_le_bytes());
    bytes.extend(b"PAR1");
    bytes
}

fn footer(schema: Vec<Value>, count: i64, groups: Vec<Value>) -> Vec<(i16, Value)> {
    vec![(1, Int(1)), (2, List(schema)), (3, Int(count)), (4, List(groups))]
}

fn u_and_y(repetition: i64) -> Vec<Value> {
    let columns = ["u", "y"].map(|name| column(name, DOUBLE, repetition));
    [vec![group("root", 2)], columns.to_vec()].concat()
}

/// A record of u and y, both with the same pages.
fn record(codec: i64, count: i64, repetition: i64, pages: &[u8]) -> Vec<u8> {
    let chunk = chunk(codec, count, [4, pages.len() as i64]);
    let groups = vec![rows(count, vec![chunk.clone(), chunk])];
    file(pages, footer(u_and_y(repetition), count, groups))
}

/// Numbers as they are.
fn plain(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A run of one index of a dictionary, after its width in bits.
fn run_of(count: u64) -> Vec<u8> {
    let mut bytes = vec![1];
    varint(count << 1, &mut bytes);
    bytes.push(0);
    bytes
}

/// The files, with a part of what is said of each.
#[expect(clippy::too_many_lines, reason = "a list")]
pub(crate) fn files() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    const MANY: i64 = 1_000_000_000_000_000_000;
    const LARGE: i64 = (1 << 31) - 1;
    let nested = |depth: usize| {
        let groups = (0..depth).map(|_| group("g", 1));
        let schema = groups.chain([column("u", DOUBLE, 0)]).collect();
        file(&[], footer(schema, 0, vec![]))
    };
    let with = |field, value| {
        let mut fields = footer(u_and_y(0), 0, vec![]);
        fields.push((field, value));
        file(&[], fields)
    };
    let one = || data(1, 0, 8, &plain(&[1.0]));
    let empty_groups = || vec![rows(0, vec![]); 200_000];
    let deep = (0..10_000).fold(Int(1), |within, _| Fields(vec![(1, within)]));
    let lists = (0..10_000).fold(Int(1), |within, _| List(vec![within]));
    let short_run = [dictionary(1, 8, &plain(&[1.0])), data(100, 8, 4, &run_of(1 << 40))].concat();
    let shared = {
        let columns: Vec<Value> = (0..9_000).map(|i| column(&format!("c{i}"), DOUBLE, 0)).collect();
        let pages = [
            dictionary(1, 8, &plain(&[1.0])),
            data(1_000_000, 8, 4, &run_of(1_000_000)),
        ]
        .concat();
        let chunks = vec![chunk(0, 1_000_000, [4, pages.len() as i64]); 9_000];
        let schema = [vec![group("root", 9_000)], columns].concat();
        file(&pages, footer(schema, 1_000_000, vec![rows(1_000_000, chunks)]))
    };
    let texts = {
        let text = [&(1_u32 << 30).to_le_bytes()[..], b"abc"].concat();
        let pages = data(1, 0, LARGE, &text);
        let chunk = chunk(0, 1, [4, pages.len() as i64]);
        let schema = vec![group("root", 2), column("u", TEXT, 0), column("y", TEXT, 0)];
        file(&pages, footer(schema, 1, vec![rows(1, vec![chunk.clone(), chunk])]))
    };
    let delta = |count: u64| {
        let mut bytes = Vec::new();
        // Values of a block, miniblocks in it, all values, the first one, the least step, and widths.
        for number in [128, 4, count, 0, 0] {
            varint(number, &mut bytes);
        }
        bytes.extend([0; 4]);
        let pages = data(100, 5, bytes.len() as i64, &bytes);
        let chunk = chunk(0, 100, [4, pages.len() as i64]);
        let schema = vec![group("root", 2), column("u", 2, 0), column("y", 2, 0)];
        file(&pages, footer(schema, 100, vec![rows(100, vec![chunk.clone(), chunk])]))
    };
    let small = |count: i64, claims: i64| data(count, 0, claims, &plain(&[1.0]));
    vec![
        ("groups in groups", nested(5_000), "nested too deeply"),
        ("33 groups", nested(33), "nested too deeply"),
        (
            "a list of 2^31",
            file(&[], vec![(2, Claims(1 << 31))]),
            "ends too early",
        ),
        (
            "row groups of 2^40",
            file(&[], vec![(4, Claims(1 << 40))]),
            "ends too early",
        ),
        ("a long text", with(6, Long(1 << 60)), "ends too early"),
        ("booleans", with(20, Booleans(1 << 31)), "ends too early"),
        ("deep fields", with(20, deep), "nested too deeply"),
        ("deep lists", with(20, lists), "nested too deeply"),
        (
            "columns",
            file(&[], vec![(2, List(vec![column("u", DOUBLE, 0); 20_000]))]),
            "too many columns",
        ),
        (
            "children",
            file(
                &[],
                footer(vec![group("root", LARGE), column("u", DOUBLE, 0)], 0, vec![]),
            ),
            "tree of columns",
        ),
        (
            "no columns",
            file(&[], footer(vec![group("root", 0)], MANY, vec![rows(MANY, vec![])])),
            "the file is empty",
        ),
        ("rows without pages", record(0, MANY, 0, &[]), "rows of 2 columns"),
        (
            "rows in a page",
            record(0, MANY, 0, &small(LARGE, 8)),
            "rows of 2 columns",
        ),
        ("other rows", record(0, 1000, 0, &one()), "ends too early"),
        (
            "sums of rows",
            file(&[], footer(u_and_y(0), i64::MAX, vec![rows(i64::MAX, vec![]); 2])),
            "other columns",
        ),
        ("less rows", record(0, -1, 0, &one()), "is negative"),
        (
            "a run",
            record(
                0,
                100_000_000,
                0,
                &[
                    dictionary(1, 8, &plain(&[1.0])),
                    data(100_000_000, 8, 6, &run_of(100_000_000)),
                ]
                .concat(),
            ),
            "rows of 2 columns",
        ),
        ("a run that is longer than its page", short_run_record(&short_run), ""),
        (
            "a dictionary of 2^31",
            record(
                0,
                1,
                0,
                &[dictionary(LARGE, 8, &plain(&[1.0])), data(1, 8, 4, &run_of(1))].concat(),
            ),
            "pages of",
        ),
        (
            "bytes of a dictionary",
            record(
                6,
                1,
                0,
                &[dictionary(1, LARGE, &plain(&[1.0])), data(1, 8, 4, &run_of(1))].concat(),
            ),
            "pages of",
        ),
        ("zstd", record(6, 1, 0, &small(1, LARGE)), "pages of"),
        ("gzip", record(2, 1, 0, &small(1, LARGE)), "pages of"),
        ("snappy", record(1, 1, 0, &small(1, LARGE)), "pages of"),
        ("brotli", record(4, 1, 0, &small(1, LARGE)), "pages of"),
        (
            "many large pages",
            record(6, 1000, 0, &small(1, 60 << 20).repeat(1000)),
            "pages of",
        ),
        ("less bytes", record(6, 1, 0, &small(1, -5)), "is negative"),
        ("a codec", record(99, 1, 0, &one()), "compression"),
        ("levels", record(0, 1, OPTIONAL, &data(1, 0, 8, &[0xff; 12])), ""),
        (
            "beyond the end",
            file(
                &[],
                footer(u_and_y(0), 1, vec![rows(1, vec![chunk(0, 1, [4, i64::MAX]); 2])]),
            ),
            "beyond its end",
        ),
        ("one chunk for 9,000 columns", shared, "rows of 9000 columns"),
        (
            "empty groups of rows",
            file(&[], footer(u_and_y(0), 0, empty_groups())),
            "other columns",
        ),
        ("texts", texts, "has no numbers"),
        ("delta", delta(1 << 40), ""),
        (
            "Arrow",
            with(
                5,
                List(vec![Fields(vec![
                    (1, Bytes(b"ARROW:schema".to_vec())),
                    (2, Bytes(b"/////////w==".to_vec())),
                ])]),
            ),
            "Arrow",
        ),
    ]
}

fn short_run_record(pages: &[u8]) -> Vec<u8> {
    record(0, 100, 0, pages)
}

/// Runs the program with little memory.
fn estimate(folder: &Path) -> std::process::Output {
    let script = format!("ulimit -v {MEMORY_KIB}; exec '{PROGRAM}' estimate claims.parquet --order 1 --estimator arx");
    let mut command = Command::new("bash");
    command.args(["-c", &script]).current_dir(folder).stdin(Stdio::null());
    command.env("RAYON_NUM_THREADS", "2");
    command.output().expect("bash runs")
}

#[test]
fn claims_beyond_the_file_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let path = place.path().join("claims.parquet");
    let mut other = Vec::new();
    for (name, bytes, part) in files() {
        std::fs::write(&path, &bytes).expect("written");
        let begin = Instant::now();
        let output = estimate(place.path());
        let said = stderr(&output);
        let what = format!("{name}, {} bytes: {:?}, {said}", bytes.len(), output.status);
        assert!(begin.elapsed() < SOON, "{what}");
        assert_eq!(output.status.code(), Some(2), "{what}");
        assert!(said.lines().count() == 1 && said.len() < 400, "{what}");
        if !said.starts_with("asobench: claims.parquet: ") || !said.contains(part) {
            other.push(what);
        }
    }
    assert!(other.is_empty(), "{}", other.join("\n"));
}

/// Two columns written by hand, `y(k) = 0.5 y(k-1) + u(k-1)`, are read.
#[test]
fn records_by_hand_are_read() {
    let place = tempfile::tempdir().expect("a folder");
    let u: Vec<f64> = (0..200).map(|k| f64::from((k * k * 7 + 3 * k) % 11) - 5.0).collect();
    let y = u.iter().scan(0.0, |state, u| {
        let now = *state;
        *state = 0.5 * now + u;
        Some(now)
    });
    let y: Vec<f64> = y.collect();
    let [u, y] = [u, y].map(|numbers| data(200, 0, 1600, &plain(&numbers)));
    let (of_u, of_y) = (u.len() as i64, y.len() as i64);
    let chunks = [[4, of_u], [4 + of_u, of_y]].map(|place| chunk(0, 200, place));
    let groups = vec![rows(200, chunks.to_vec())];
    let bytes = file(&[u, y].concat(), footer(u_and_y(0), 200, groups));
    std::fs::write(place.path().join("claims.parquet"), bytes).expect("written");
    let output = estimate(place.path());
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(said.contains("y(k) = 0.5 y(k-1) + u(k-1)\n"), "{said}");
}
