//! Names, words and folders of a stranger: nothing of them drives the terminal, a spreadsheet or a browser, nothing is
//! shortened, and what cannot be told apart is refused.

use super::{Place, stderr, stdout, succeeds};
use std::path::Path;
use std::process::Output;

/// Escape, bell, NUL, C1, directions, zero width; as TOML writes them.
const UNSEEN: [&str; 10] = [
    "\\u001b[31m",
    "\\u0007",
    "\\u0000",
    "\\u009b2J",
    "\\u202e",
    "\\u2066",
    "\\u200f",
    "\\u061c",
    "\\u200b",
    "\\ufeff",
];

/// Names that are odd and yet names: they come out as they went in.
const ODD: [&str; 9] = [
    "x=1",
    "y=1",
    "=cmd|' /C calc'!A0",
    "@SUM(1+1)*cmd",
    "+1",
    "-2+3",
    "<script>alert(1)</script> & \"q\"",
    "../../x#?%41",
    "\u{1f468}\u{200d}\u{1f469}\u{200d}\u{1f467} \u{5e9}\u{5dc}\u{5d5}\u{5dd}",
];

/// Whether a text has nothing but what is seen, and line ends; the joiners of an emoji are part of it.
fn assert_seen(text: &str, what: &str) {
    let text = text.replace(ODD[8], "");
    let unseen = text.chars().find(|c| {
        (c.is_control() && *c != '\n')
            || matches!(*c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}')
            || matches!(*c, '\u{61c}' | '\u{feff}' | '\u{ad}')
    });
    assert_eq!(unseen, None, "{what}: {text}");
}

fn seen(output: &Output) -> String {
    let text = stdout(output);
    assert_seen(&text, "stdout");
    assert_seen(&stderr(output), "stderr");
    text
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A study whose title and question hold all that is unseen, with every odd name as a claim and as a method; methods
/// have no parentheses.
fn study() -> String {
    let words = UNSEEN.concat();
    let claims: Vec<String> = ODD.iter().map(|name| quoted(name)).collect();
    let methods = ODD.iter().map(|name| {
        let name = quoted(&method(name));
        format!("[[methods]]\nname = {name}\nestimator = \"ls\"\n")
    });
    let methods: String = methods.collect();
    format!(
        "title = \"T {words}\\n<script>alert(1)</script>\"\nquestion = \"Q {words}\"\nhypothesis = \
         \"\"\"H\nforged\"\"\"\n\
         trials = 20\nmeasures = [\"e_a\"]\ncompare = [[\"x=1\", \"y=1\"], [\"+1\", \"-2+3\"]]\n\
         [settings]\nclaim = [{}]\nplant = \"=p;=q\"\nnoise = \"@n\"\nhorizon = 110\n\
         [plants.\"=p;=q\"]\na = [-0.7, 1.5]\nb = [1.0, 0.5]\n[noises.\"@n\"]\nnumerator = [1.0]\n\
         {methods}[[bounds]]\nmeasure = \"e_a\"\nlabel = \"=b\"\nbelow = 0.1\n",
        claims.join(", ")
    )
}

fn method(name: &str) -> String {
    name.replace(['(', ')'], "|")
}

/// The cells of a table (RFC 4180).
fn cells(text: &str) -> Vec<Vec<String>> {
    let (mut rows, mut row, mut cell, mut quoted) = (Vec::new(), Vec::new(), String::new(), false);
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                cell.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => row.push(std::mem::take(&mut cell)),
            '\n' if !quoted => {
                row.push(std::mem::take(&mut cell));
                rows.push(std::mem::take(&mut row));
            }
            '\r' if !quoted => {}
            c => cell.push(c),
        }
    }
    rows
}

/// Whether a cell is a name, but for an apostrophe before it.
fn is(cell: &str, name: &str) -> bool {
    cell.strip_prefix('\'').unwrap_or(cell) == name
}

/// No cell is a formula; what is a number stays one.
fn assert_no_formulas(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).expect("a table");
    assert_seen(&text.replace("\r\n", "\n"), "a table");
    let rows = cells(&text);
    for cell in rows.iter().flatten() {
        let number = cell == "-" || cell.parse::<f64>().is_ok();
        let begins = |part: &str| part.trim_start_matches([' ', '"']).starts_with(['=', '+', '-', '@']);
        assert!(number || !cell.split(';').any(begins), "{}: {cell}", path.display());
    }
    rows
}

fn decoded(address: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = address.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let code = std::str::from_utf8(after.get(..2).unwrap_or_default()).unwrap_or_default();
        if let (b'%', Ok(byte)) = (first, u8::from_str_radix(code, 16)) {
            bytes.push(byte);
            rest = &after[2..];
        } else {
            bytes.push(*first);
            rest = after;
        }
    }
    String::from_utf8(bytes).expect("UTF-8")
}

#[test]
fn what_a_stranger_wrote_is_shown_and_does_nothing() {
    let place = Place::new();
    place.write("study.toml", study().as_bytes());
    let text = seen(&place.run(&["check", "study.toml"]));
    assert_eq!(
        text.lines().filter(|line| line.starts_with("title ")).count(),
        1,
        "{text}"
    );
    assert!(text.contains("\\u{1b}[31m\\u{7}\\u{0}\\u{9b}2J\\u{202e}"), "{text}");
    let out = "a#b?c \u{1b}[2J\u{202e}\n%41";
    let output = place.run(&["run", "study.toml", "--out", out]);
    succeeds(&output);
    assert!(seen(&output).contains("results in a#b?c \\u{1b}[2J\\u{202e}\\n%41"));
    let output = place.run(&["report", out]);
    succeeds(&output);
    seen(&output);

    let folder = place.path(out);
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    assert_seen(&page, "report.html");
    assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert(1)"));
    let links: Vec<&str> = page.split("href=\"").skip(1).collect();
    let links = links.iter().map(|rest| &rest[..rest.find('"').expect("an end")]);
    let files: Vec<&str> = links.filter(|to| !to.starts_with(['#', 'd'])).collect();
    assert!(files.len() > 4, "{files:?}");
    for link in files {
        assert!(!link.contains(['#', '?', ' ', '<']), "{link}");
        assert!(folder.join(decoded(link)).is_file(), "{link}");
    }
    for entry in std::fs::read_dir(folder.join("figures")).expect("figures") {
        let figure = std::fs::read_to_string(entry.expect("an entry").path()).expect("a figure");
        assert_seen(&figure, "a figure");
        assert!(!figure.contains("<script>"));
    }
    let mut results = Vec::new();
    for entry in std::fs::read_dir(folder.join("tables")).expect("tables") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "tex") {
            // No spreadsheet opens it; its escapes have tests of their own.
            let text = std::fs::read_to_string(&path).expect("a table");
            assert_seen(&text, "a LaTeX table");
            continue;
        }
        let rows = assert_no_formulas(&path);
        let output = rows[0].iter().position(|name| name == "output");
        let labels = rows.iter().skip(1).filter_map(|row| row.get(output?));
        for label in labels {
            let known = ODD.iter().any(|name| is(label, &method(name)));
            assert!(known, "{}: {label}", path.display());
        }
        if path.display().to_string().ends_with("-results.csv") {
            results = rows;
        }
    }
    // Every name whole, and no two alike.
    assert_eq!(results[0][..2], ["claim", "output"]);
    for claim in ODD {
        for label in ODD.map(method) {
            let is_row = |row: &&Vec<String>| is(&row[0], claim) && is(&row[1], &label);
            assert_eq!(results.iter().filter(is_row).count(), 1, "{claim} {label}");
        }
    }

    for (i, name) in ODD.iter().enumerate() {
        let which = format!("{name}:0");
        let output = place.run(&["replay", "--", out, &which]);
        succeeds(&output);
        let head = format!("Cell {i}, {name} (");
        assert!(seen(&output).starts_with(&head), "{name}: {}", stdout(&output));
        let json = place.run(&["replay", "--format", "json", "--", out, &which]);
        let json: serde_json::Value = serde_json::from_str(&seen(&json)).expect("JSON");
        assert_eq!(json["cell"]["claim"], *name);
        let estimators = json["rows"].as_array().expect("rows").iter();
        let estimators: Vec<_> = estimators
            .map(|row| row["estimator"].as_str().expect("a name").to_owned())
            .collect();
        assert_eq!(estimators, ODD.map(method));
    }
    let output = place.run(&["replay", out, "0:0", "--data", "trial.csv"]);
    succeeds(&output);
    seen(&output);
    // The folder's name ends no comment.
    let record = std::fs::read_to_string(place.path("trial.csv")).expect("a record");
    assert_seen(&record, "a record");
    let ends = record.lines().position(|line| line == "k,u,y").expect("a header");
    assert!(record.lines().take(ends).all(|line| line.starts_with("# ")));
    succeeds(&place.run(&["estimate", "trial.csv", "--order", "2"]));
}

/// A name is seen, told from the others, and has an end.
#[test]
fn names_that_cannot_be_told_apart_are_refused() {
    let place = Place::new();
    let long = "x".repeat(10_000);
    let mut bad: Vec<String> = UNSEEN.iter().map(|unseen| format!("a{unseen}b")).collect();
    bad.extend(["a\\nb", "a\\tb", " a", "a ", &long].map(str::to_owned));
    for name in &bad {
        for (text, part) in [
            (format!("[[methods]]\nname = \"{name}\""), "methods[0].name: '"),
            (format!("[settings]\nclaim = [\"{name}\", \"C2\"]"), "claim: '"),
            (format!("[noises.\"{name}\"]\nnumerator = [1.0]"), "noises: '"),
            (format!("[plants.\"{name}\"]\na = [0.5]\nb = [1.0]"), "plants: '"),
            (format!("[feedbacks.\"{name}\"]\nnumerator = [0.3]"), "feedbacks: '"),
            (
                format!("[[bounds]]\nmeasure = \"e_a\"\nbelow = 1\nlabel = \"{name}\""),
                "bounds[0].label: '",
            ),
        ] {
            place.write("bad.toml", text.as_bytes());
            place.refuses(&["check", "bad.toml"], &[part, "expected "]);
            seen(&place.run(&["check", "bad.toml"]));
        }
    }
    for (text, parts) in [
        (
            "[[methods]]\nname = \"a b\"\n[[methods]]\nname = \"A  b\"",
            ["methods: 'a b", "differ only in case"],
        ),
        (
            "[[methods]]\n[[methods]]\nname = \"LS\"\nestimator = \"ls\"",
            ["methods: 'ls' and 'LS'", "differ only in case"],
        ),
        ("[[methods]]\nname = \"ls\"", ["methods[0].estimator: ", "named 'ls'"]),
        (
            "[[methods]]\nname = \"ls\"\nestimator = \"iv\"",
            ["methods[0].name: 'ls'", "another estimator"],
        ),
        (
            "[[methods]]\nname = \"iv\"\nestimator = \"ls\"",
            ["methods[0].name: 'iv'", "another estimator"],
        ),
        (
            "[noises.a]\nnumerator = [1.0]\n[noises.A]\nnumerator = [1.0]",
            ["noises: 'A' and 'a'", "differ only in case"],
        ),
        ("[noises.White]\nnumerator = [1.0]", ["noises.White", "built in"]),
        ("[settings]\nclaim = [\"C2\", \"c2\"]", ["line 2", "c2 is given twice"]),
        ("[settings]\nclaim = [1, \"1\"]", ["line 2", "1 is given twice"]),
    ] {
        place.refuses_file(text, &parts);
    }
}

#[test]
fn words_and_lists_have_an_end() {
    let place = Place::new();
    let many = |table: &str| table.repeat(1001);
    let options: Vec<String> = (1..=32).map(|i| i.to_string()).collect();
    let options = options.join(", ");
    let numbered = |count: usize, table: &dyn Fn(usize) -> String| -> String {
        (0..count).map(table).collect::<Vec<_>>().concat()
    };
    let noise = |i| format!("[noises.n{i}]\nnumerator = [1.0]\n");
    let method = |i| format!("[[methods]]\nname = \"m{i}\"\niterations = 1000\n");
    for (text, parts) in [
        (many("[[methods]]\n"), ["methods: 1001 entries", "at most 1000"]),
        (
            format!(
                "[[methods]]\niterations = [{options}]\ndrive = \"observer\"\ngain = [{}]",
                (1..=32)
                    .map(|i| format!("\"scaled:0.{i}\""))
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
            ["methods[0]: 1024 methods", "at most 1000"],
        ),
        (
            format!("compare = [{}]", many("[\"iv(4)\", \"ls\"],")),
            ["compare: 1001 entries", "at most 1000"],
        ),
        (
            many("[[slopes]]\nmeasure = \"e_a\"\nover = \"eta\"\n"),
            ["slopes: 1001 entries", "at most 1000"],
        ),
        (
            many("[[bounds]]\nmeasure = \"e_a\"\nbelow = 1\n"),
            ["bounds: 1001 entries", "at most 1000"],
        ),
        (
            format!("claims = [{}]", many("\"C1\",")),
            ["claims: 1001 entries", "at most 1000"],
        ),
        (
            format!("exclude = [{}]", many("{ eta = 1 },")),
            ["exclude: 1001 entries", "at most 1000"],
        ),
        (
            format!(
                "[continuous]\nuntil = 1.0\n{}",
                many("[[observers]]\nobserver = \"gradient\"\ngains = [1]\n")
            ),
            ["observers: 1001 entries", "at most 1000"],
        ),
        (numbered(10_001, &noise), ["noises: 10001 tables", "at most 10000"]),
        (numbered(11, &method), ["methods: 11011 outputs", "at most 10000"]),
        (
            format!("[[methods]]\nreport = [{}]", "0, ".repeat(1002)),
            ["methods[0].report: 1002 passes", "at most 1001"],
        ),
        (
            format!("title = \"{}\"", "t".repeat(201)),
            ["title: 201 characters", "at most 200"],
        ),
        (
            format!("question = \"{}\"", "q".repeat(5001)),
            ["question: 5001 characters", "at most 5000"],
        ),
    ] {
        place.refuses_file(&text, &parts);
    }
    // A line that would have no end says how much of it is left out.
    place.write("bad.toml", format!("{} = 1", "k".repeat(100_000)).as_bytes());
    place.refuses(&["check", "bad.toml"], &["more characters"]);
}

/// A claim of several cells, and one that looks like a number, name no single cell.
#[test]
fn a_replay_needs_one_cell() {
    let place = Place::new();
    let text = "trials = 2\nmeasures = [\"e_a\"]\n[settings]\nclaim = [\"C2\", \"1\", \"a:b\"]\neta = [5, 10]\n\
                plant = \"p\"\n\
                horizon = 110\n[plants.p]\na = [-0.7, 1.5]\nb = [1.0, 0.5]\n[[methods]]\nname = \"m pass \
                7\"\niterations = 1\n";
    place.write("cells.toml", text.as_bytes());
    succeeds(&place.run(&["run", "cells.toml", "--out", "out"]));
    // Cells 0 and 1 are C2, cells 2 and 3 "1".
    place.refuses(&["replay", "out", "C2:1"], &["'C2' matches 2 cells", "cell=0, cell=1"]);
    place.refuses(&["replay", "out", "c2:1"], &["cell=0, cell=1"]);
    place.refuses(
        &["replay", "out", "1:1"],
        &["'1' matches 3 cells", "cell=1, cell=2, cell=3"],
    );
    place.refuses(&["replay", "out", "a:b:1"], &["cell=4, cell=5"]);
    place.refuses(
        &["replay", "out", "cell=6:1"],
        &["no cell 'cell=6'", "C2, 1, a:b, or a number from 0 to 5"],
    );
    for (which, head) in [("cell=1:1", "Cell 1, C2 (eta = 10"), ("3:1", "Cell 3, 1 (eta = 10")] {
        let output = place.run(&["replay", "out", which]);
        succeeds(&output);
        assert!(stdout(&output).starts_with(head), "{}", stdout(&output));
    }
    let json = stdout(&place.run(&["replay", "out", "0:1", "--format", "json"]));
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["rows"][1]["estimator"], "m pass 7");
    assert_eq!(json["rows"][1]["pass"], 1);
    // One of several cells has the claim: that is the cell.
    place.write("one.toml", text.replace("eta = [5, 10]", "eta = 5").as_bytes());
    succeeds(&place.run(&["run", "one.toml", "--out", "one"]));
    let output = place.run(&["replay", "one", "a:b:1"]);
    succeeds(&output);
    assert!(stdout(&output).starts_with("Cell 2, a:b ("));
}

/// A number is shown in the digits that it has.
#[test]
fn numbers_are_short() {
    let place = Place::new();
    let text = "trials = 2\nmeasures = [\"e_a\"]\n[settings]\nx0 = [-1e99, 1e-99, 1]\nhorizon = 110\n\
                [[bounds]]\nmeasure = \"e_a\"\nbelow = 1e300\n";
    place.write("large.toml", text.as_bytes());
    succeeds(&place.run(&["run", "large.toml", "--out", "out"]));
    succeeds(&place.run(&["report", "out"]));
    let page = std::fs::read_to_string(place.path("out/report.html")).expect("a page");
    let zeros = "0".repeat(30);
    assert!(page.contains("-1e99") && page.contains("&lt; 1e300") && !page.contains(&zeros));
    for (setting, part) in [("window=1e300", "1e300; expected"), ("eta=-1e300", "-1e300; expected")] {
        let output = place.run(&["check", "large.toml", "--set", setting]);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(part) && !stderr(&output).contains(&zeros));
    }
}

/// Folders whose names differ in case alone have reports of their own.
#[test]
fn reports_do_not_share_files() {
    let place = Place::new();
    for out in ["one/study", "two/Study"] {
        succeeds(&place.run(&["run", "everything.toml", "--trials", "5", "--out", out]));
    }
    succeeds(&place.run(&["report", "one/study", "two/Study", "--out", "report"]));
    for table in ["study-results.csv", "Study-2-results.csv"] {
        assert!(place.path("report/tables").join(table).is_file(), "{table}");
    }
    // The first report's ratio-e_a is the second's e_a.
    for out in ["x", "x-ratio"] {
        succeeds(&place.run(&["run", "everything.toml", "--trials", "5", "--out", out]));
    }
    place.refuses(
        &["report", "x", "x-ratio", "--out", "both"],
        &["x-ratio-e_a.svg", "different names"],
    );
    assert!(!place.path("both").exists());
}
