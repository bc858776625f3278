//! Pictures of single trials and of many settings, from a run to the file.

use crate::common::PROGRAM;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

/// Least squares is biased here in white noise, so its intervals miss the truth.
const STUDY: &str = r#"
trials = 300
store = "trials"
measures = ["e_a"]
coverage = true

[settings]
plant = "second"
noise = ["ar", "white"]
eta = [5, 20]
window = [100, 400, 1600]
order = 2

[plants.second]
A = [1, -1.5, 0.7]
B = [0, 1, 0.5]

[[methods]]
estimator = "arx"
[[methods]]
estimator = "iv"
report = [4]
covariance = "coloured"
"#;

fn asobench(at: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(PROGRAM);
    command.current_dir(at).args(arguments).output().expect("it runs")
}

fn said(at: &Path, arguments: &[&str]) -> String {
    let output = asobench(at, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {error}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The error of a command that is refused.
fn refused(at: &Path, arguments: &[&str]) -> String {
    let output = asobench(at, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A PDF of one page is the picture that the SVG is: its texts, its size in points of 1/96 inch, and its title.
#[test]
fn a_picture_is_written_as_pdf_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("s.toml"), STUDY.replace("trials = 300", "trials = 20")).expect("a file");
    said(at, &["run", "s.toml", "--out", "all"]);
    let title = ["--title", "Gr\u{f6}\u{df}e \u{3c3} (x)", "--width", "600"];
    for file in ["f.svg", "f.pdf"] {
        said(at, &[&["plot", "all", "--out", file], &title[..]].concat());
    }
    let svg = std::fs::read_to_string(at.join("f.svg")).expect("a figure");
    let pdf = std::fs::read(at.join("f.pdf")).expect("a figure");
    let text: String = pdf.iter().map(|byte| char::from(*byte)).collect();
    let height: f64 = svg
        .split(" height=\"")
        .nth(1)
        .and_then(|rest| rest.split('"').next()?.parse().ok())
        .expect("it");
    assert!(
        text.contains(&format!("/MediaBox [0 0 450 {}]", 0.75 * height)),
        "{text}"
    );
    // Each object begins where the table of the file says.
    let (_, tail) = text.split_once("xref\n").expect("a table");
    let entries = tail.lines().filter(|line| line.trim_end().ends_with(" n"));
    let mut objects = 0;
    for (number, entry) in (1..).zip(entries) {
        let place: usize = entry.split(' ').next().expect("it").parse().expect("a number");
        let begin = format!("{number} 0 obj");
        assert!(pdf[place..].starts_with(begin.as_bytes()), "{entry}");
        objects += 1;
    }
    assert!(objects > 8, "{tail}");
    // The texts of the SVG, by the table of letters of the font that each is set in.
    let texts = texts_of(&text);
    for words in svg
        .split("</text>")
        .filter_map(|part| part.rsplit_once('>').map(|(_, words)| words))
        .filter(|words| !words.trim().is_empty() && !words.contains('&'))
    {
        assert!(texts.iter().any(|of| of == words), "{words}: {texts:?}");
    }
    // Every font that is described is in the file.
    let count = |part: &str| text.matches(part).count();
    assert_eq!([count("/Type /FontDescriptor"), count("/FontFile2")], [2, 2]);
    // 88 mm are 249.4 points, 467.7 units of 8/15 points; a picture has a whole number of them.
    said(at, &["plot", "all", "--width", "88mm", "--out", "print.pdf"]);
    said(at, &["plot", "all", "--width", "88mm", "--out", "print.svg"]);
    let print = std::fs::read(at.join("print.pdf")).expect("a figure");
    let print: String = print.iter().map(|byte| char::from(*byte)).collect();
    assert!(print.contains("/MediaBox [0 0 249.6 "), "{print}");
    let print = std::fs::read_to_string(at.join("print.svg")).expect("a figure");
    assert!(print.contains(" width=\"249.60pt\""), "{print}");
    assert!(refused(at, &["plot", "all", "--width", "20mm"]).contains("expected 57mm to 564mm"));
    assert!(text.contains("/Creator (asobench)"));
    let line = refused(at, &["plot", "all", "--title", "\u{4e2d}", "--out", "f.pdf"]);
    assert!(line.contains("'\u{4e2d}'") && line.lines().count() == 1, "{line}");
    std::fs::write(at.join("mine.pdf"), "%PDF-1.7").expect("a file");
    assert!(refused(at, &["plot", "all", "--out", "mine.pdf"]).contains("not written by asobench"));
}

/// The texts of a page whose characters are numbers of two bytes, by the fonts' tables of letters.
fn texts_of(pdf: &str) -> Vec<String> {
    let hex = |text: &str| u32::from_str_radix(text, 16).ok();
    // The fonts come in the order of the tables, R before B.
    let tables: Vec<BTreeMap<u32, char>> = pdf
        .split("begincmap")
        .skip(1)
        .map(|part| {
            let part = part.split("endcmap").next().unwrap_or_default();
            let pairs = part
                .lines()
                .filter_map(|line| line.strip_prefix('<')?.strip_suffix('>')?.split_once("> <"));
            pairs
                .filter_map(|(code, letter)| Some((hex(code)?, char::from_u32(hex(letter)?)?)))
                .collect()
        })
        .collect();
    let mut texts = Vec::new();
    for part in pdf.split(" Tf\n").skip(1) {
        let before = &pdf[..part.as_ptr() as usize - pdf.as_ptr() as usize - 4];
        let font = usize::from(before.rsplit('/').next().is_some_and(|name| name.starts_with('B')));
        let shown = part.split(" Tj").next().unwrap_or_default();
        let bytes: Vec<u32> = match shown.strip_prefix('<') {
            Some(codes) => (0..codes.len() / 2)
                .filter_map(|i| hex(&codes[2 * i..2 * i + 2]))
                .collect(),
            None => literal(&shown[1..shown.len() - 1]),
        };
        let codes = bytes.chunks(2).map(|pair| 256 * pair[0] + pair[1]);
        texts.push(codes.map(|code| tables[font][&code]).collect());
    }
    texts
}

/// The bytes of a literal string (ISO 32000-1, section 7.3.4.2).
fn literal(text: &str) -> Vec<u32> {
    let mut letters = text.chars();
    let mut bytes = Vec::new();
    while let Some(letter) = letters.next() {
        let escaped = if letter == '\\' { letters.next() } else { None };
        bytes.push(match escaped {
            None => u32::from(letter),
            Some('n') => 10,
            Some('r') => 13,
            Some('t') => 9,
            Some('b') => 8,
            Some('f') => 12,
            Some(digit) if digit.is_ascii_digit() => {
                let rest = letters.by_ref().take(2);
                rest.fold(u32::from(digit) - 48, |sum, of| 8 * sum + u32::from(of) - 48)
            }
            Some(same) => u32::from(same),
        });
    }
    bytes
}

/// The share above each panel of a zip plot is the coverage that summary.json has, which was counted while the study
/// ran.
#[test]
fn a_zip_plot_counts_the_intervals_that_the_summary_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("s.toml"), STUDY).expect("a file");
    said(at, &["run", "s.toml", "--out", "all"]);
    let text = std::fs::read_to_string(at.join("all/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let cells = summary["cells"].as_array().expect("cells");
    let mut seen = 0;
    for (noise, eta, window) in [("ar", "5", "100"), ("white", "20", "1600"), ("white", "5", "400")] {
        let is = |cell: &&serde_json::Value| {
            cell["settings"]["noise"] == noise
                && cell["eta"].as_f64() == eta.parse().ok()
                && cell["window"].as_f64() == window.parse().ok()
        };
        let cell = cells.iter().find(is).expect("the cell");
        for coefficient in ["a_1", "h_2"] {
            let places = [("noise", noise), ("eta", eta), ("window", window)];
            let places = places.map(|(key, value)| format!("{key}={value}"));
            let mut arguments = vec!["plot", "all", "--zip", "--coefficient", coefficient];
            for place in &places {
                arguments.extend(["--where", place]);
            }
            said(at, &[&arguments[..], &["--out", "zip.svg"]].concat());
            let svg = std::fs::read_to_string(at.join("zip.svg")).expect("a figure");
            for output in cell["outputs"].as_array().expect("outputs") {
                let coverage = output["coverage"].as_array().expect("coverage");
                let of = coverage.iter().find(|of| of[0] == coefficient).expect("it");
                let share = of[1]["covered"]["share"].as_f64().expect("a share");
                let shown = format!("{:.1} %", 100.0 * share);
                assert!(svg.contains(&shown), "{noise} {eta} {window} {coefficient}: {shown}");
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 12);
    // The worst of all: least squares in white noise.
    let words = said(at, &["plot", "all", "--zip"]);
    assert!(
        words.contains("white noise") && words.contains("all-zip.svg"),
        "{words}"
    );
    // It is in the report too.
    said(at, &["report", "all", "--out", "page"]);
    assert!(at.join("page/figures/all-zip.svg").is_file());
}

#[test]
fn figures_of_many_settings_marks_and_held_settings() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let file = STUDY
        .replace("store = \"trials\"", "spread = false")
        .replace("trials = 300", "trials = 40");
    std::fs::write(at.join("s.toml"), file).expect("a file");
    said(at, &["run", "s.toml", "--out", "all"]);
    let svg = |arguments: &[&str]| {
        said(at, &[&["plot", "all", "--out", "f.svg"], arguments].concat());
        std::fs::read_to_string(at.join("f.svg")).expect("a figure")
    };
    let loops = svg(&["--nested-loop"]);
    assert!(
        loops.contains("the 12 cells") && [">noise<", ">1/A<", ">white<"].iter().all(|name| loops.contains(name)),
        "{loops}"
    );
    let held = svg(&[
        "--where",
        "noise=white",
        "--where",
        "eta=20",
        "--spread",
        "--width",
        "440",
    ]);
    assert!(held.contains("width=\"440\"") && held.contains("middle 90 %") && !held.contains("1/A"));
    // The file says that there are no bands.
    assert!(!svg(&[]).contains("middle 90 %"));
    let mark = "elsewhere: window=400, noise=ar, eta=5: 0.05";
    let with = svg(&["--mark", mark]);
    assert!(with.contains(">elsewhere<"));
    assert!(!svg(&["--mark", mark, "--without", "elsewhere"]).contains("elsewhere"));
    for (arguments, part) in [
        (
            &["--zip"][..],
            "run the study with `coverage = true` and `store = \"trials\"`",
        ),
        (&["--where", "noise=pink"], "unknown value of noise 'pink'"),
        (&["--where", "noise"], "expected SETTING=VALUE"),
        (&["--mark", "0.033"], "expected NAME: SETTING=VALUE, ...: NUMBER"),
        (&["--mark", "x: colour=ar: 1"], "colour"),
        (&["--nested-loop", "--zip"], "cannot be used with"),
    ] {
        let line = refused(at, &[&["plot", "all"], arguments].concat());
        assert!(line.contains(part), "{arguments:?}: {line}");
    }
}
