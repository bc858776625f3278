//! Pages in headless Chromium: a study's report, an estimate, an observer.

use crate::common::browser::{WIDTHS, browser, frames, seen, with_script};
use crate::common::{PROGRAM, PYTHON, asobench_in, copy, done_in, runs, stdout};
use serde_json::Value;
use std::path::Path;

const MEASURE: &str = include_str!("pages/measure.js");
const POINT: &str = include_str!("pages/point.js");

/// Two plants at three levels, and least squares of one's own, which gives up on some records.
const STUDY: &str = r#"title = "Does least squares keep up?"
trials = 40
measures = ["e_a", "e_b"]
[settings]
plant = ["lightly", "well"]
noise = "white"
eta = [2, 10, 30]
window = 98
[plants.lightly]
A = [1, -1.6, 0.9]
B = [0, 0.4, 0.2]
[plants.well]
A = [1, -1.1, 0.3]
B = [0, 1, 0.5]
[[methods]]
name = "mine"
command = ["python3", "mine.py"]
[[methods]]
estimator = "oe"
[[methods]]
estimator = "iv"
report = [4]
"#;

fn texts(of: &Value) -> Vec<&str> {
    let all = of.as_array().expect("a list").iter();
    all.map(|text| text.as_str().expect("a text")).collect()
}

/// A number as a table has it, such as `0.0879(5)`, or with all digits.
fn shown(cell: &str) -> Option<f64> {
    let (number, rest) = cell.split_once('(').unwrap_or((cell, ""));
    let exponent = rest.split_once(')').map_or("", |(_, exponent)| exponent);
    format!("{number}{exponent}")
        .trim()
        .parse()
        .ok()
        .filter(|x: &f64| x.is_finite())
}

/// Numbers in order, and after them cells without one.
fn check_order(cells: &Value, sign: f64, what: &str) {
    let numbers: Vec<Option<f64>> = texts(&cells["cells"]).into_iter().map(shown).collect();
    let known: Vec<f64> = numbers.iter().map_while(|x| x.map(|x| sign * x)).collect();
    assert!(numbers[known.len()..].iter().all(Option::is_none), "{what}: {cells}");
    assert!(known.is_sorted() && cells["order"] == true, "{what}: {cells}");
}

/// Checks a page at both widths and in both schemes; returns what it says of itself.
fn check(browser: &str, folder: &Path, page: &str, script: &str) -> Vec<Value> {
    let own = seen(browser, folder, page, "dark");
    assert_eq!(own.console, Vec::<String>::new(), "{page}");
    let said = frames(browser, folder, page, &format!("{script}{MEASURE}"));
    for (of, width) in said.iter().zip(WIDTHS) {
        let what = format!("{page} at {width}");
        for state in ["closed", "open"] {
            assert!(
                of[state].as_i64().expect("a width") <= 1,
                "{what}: scrolls sideways, {state}"
            );
        }
        assert_eq!(texts(&of["unmarked"]), [""; 0], "{what}: scrolls without a mark");
        assert_eq!(of["shut"], 0, "{what}: details that stay shut");
        assert_eq!(texts(&of["dangling"]), [""; 0], "{what}: links to nothing");
        for table in of["tables"].as_array().expect("tables") {
            check_order(&table["up"], 1.0, &what);
            check_order(&table["down"], -1.0, &what);
        }
        for file in texts(&of["files"]) {
            assert!(Path::new(file).is_file(), "{what}: {file}");
            assert!(Path::new(file).starts_with(folder), "{what}: {file}");
        }
        // The grounds and inks of html/page.css and plot/inks.rs.
        assert_eq!(
            texts(&of["colours"]),
            ["rgb(255, 255, 255)", "rgb(27, 31, 36)"],
            "{what}"
        );
    }
    let text = std::fs::read_to_string(folder.join(page)).expect("a page");
    let colours = MEASURE.replace("parent.postMessage({", "document.title = JSON.stringify({");
    let colours = colours.replace("}, \"*\");", "}.colours);");
    std::fs::write(folder.join("dark.html"), with_script(&text, &colours)).expect("written");
    let dark = seen(browser, folder, "dark.html", "dark");
    assert_eq!(dark.console, Vec::<String>::new());
    let title = "<title>[\"rgb(22, 24, 29)\",\"rgb(228, 230, 234)\"]</title>";
    assert!(dark.document.contains(title), "{page}: dark");
    said
}

/// A report of the study in `first`, moved to `moved`.
fn moved_report(folder: &Path) -> std::path::PathBuf {
    let worker = include_str!("../examples/workers/least_squares.py");
    let line = "least_squares(signal(0, i), signal(1, i), na, nb, nk)";
    assert!(worker.contains(line));
    let worker = worker.replace(
        line,
        &format!("(2.0, [0.0] * 4) if int(1e6 * abs(signal(1, i)[-1])) % 4 == 0 else {line}"),
    );
    std::fs::write(folder.join("mine.py"), worker).expect("written");
    std::fs::write(folder.join("mine.toml"), STUDY).expect("written");
    done_in(folder, &["run", "mine.toml", "--out", "first", "--allow-commands"]);
    done_in(folder, &["report", "first"]);
    let moved = folder.join("moved & co");
    copy(&folder.join("first"), &moved);
    std::fs::rename(folder.join("first"), folder.join("elsewhere")).expect("renamed");
    moved
}

/// The words on a point of a method in a cell.
fn words_on<'a>(words: &[&'a str], begin: &str) -> &'a str {
    let found = words.iter().find(|words| words.starts_with(begin));
    found.unwrap_or_else(|| panic!("{begin}: {words:?}"))
}

#[test]
fn a_report_answers_a_pointer_and_leads_to_its_files_where_it_was_moved() {
    let Some(browser) = browser().filter(|_| runs(PYTHON)) else {
        return;
    };
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().canonicalize().expect("a path");
    let moved = moved_report(&folder);
    let said = check(browser, &moved, "report.html", POINT);
    let medians = std::fs::read_to_string(moved.join("tables/first-e_a-paper.csv")).expect("a table");
    let lost = std::fs::read_to_string(moved.join("tables/first-lost.csv")).expect("a table");
    for (of, width) in said.iter().zip(WIDTHS) {
        assert!(
            texts(&of["files"]).len() > 10 && of["details"].as_u64() > Some(0),
            "{width}"
        );
        assert!(of["tables"].as_array().expect("tables").len() > 10, "{width}");
        let pointed = &of["pointed"];
        // Three methods in six cells.
        assert_eq!(pointed["count"], 18, "{width}");
        assert_eq!(pointed["stops"], 1, "{width}");
        let titles = texts(&pointed["titles"]);
        let walked = texts(&pointed["walked"]);
        let said = titles.iter().map(|title| title.replacen('\n', ". ", 1));
        assert_eq!(walked, said.collect::<Vec<_>>(), "{width}");
        let hovered = texts(&pointed["hovered"]);
        assert!(
            hovered.len() > 12 && hovered.iter().all(|words| walked.contains(words)),
            "{width}"
        );
        for name in pointed["names"].as_array().expect("names") {
            assert_eq!(name["once"], serde_json::json!([true, false, true, "false"]), "{name}");
            assert_eq!(
                name["twice"],
                serde_json::json!([false, false, false, "true"]),
                "{name}"
            );
        }
        let names = pointed["names"].as_array().expect("names").iter();
        let names: Vec<&str> = names.filter_map(|of| of["name"].as_str()).map(str::trim).collect();
        assert!(
            ["mine", "oe", "iv(4)"].iter().all(|name| names.contains(name)),
            "{names:?}"
        );
        check_words(&titles, &medians, &lost);
    }
    let titles = texts(&said[0]["pointed"]["titles"]);
    check_replay(&folder, words_on(&titles, "mine at eta = 30 %, plant lightly"));
}

/// The words have the numbers of the tables, in every cell.
fn check_words(titles: &[&str], medians: &str, lost: &str) {
    for (row, lost) in medians.lines().zip(lost.lines()).skip(1) {
        let (row, lost): (Vec<&str>, Vec<&str>) = (row.split(',').collect(), lost.split(',').collect());
        assert_eq!(row[..2], lost[..2]);
        for (column, method) in (2..).zip(["mine", "oe", "iv(4)"]) {
            let words = words_on(titles, &format!("{method} at eta = {} %, plant {}: ", row[0], row[1]));
            assert!(
                words.contains(&format!(": median e_a {}; 40 trials", row[column])),
                "{words}"
            );
            // Per cent of 40 trials.
            let count = lost[column].parse::<f64>().expect("a share") * 0.4;
            let said = words
                .split_once(" trials")
                .expect("trials")
                .1
                .split_once('\n')
                .expect("a command")
                .0;
            let expected = if count > 0.0 {
                format!(", {} lost", count.round())
            } else {
                String::new()
            };
            assert_eq!(said, expected, "{words}");
        }
    }
}

/// The command on a point replays a trial that failed.
fn check_replay(folder: &Path, words: &str) {
    let (_, command) = words.split_once('\n').expect("two lines");
    let arguments = command.strip_prefix("asobench replay first ").expect("a command");
    let mut all = vec!["replay", "elsewhere"];
    all.extend(arguments.split(' '));
    let output = asobench_in(folder, &all);
    assert!(
        stdout(&output).contains("no full rank"),
        "{PROGRAM} {all:?}: {}",
        stdout(&output)
    );
}

#[test]
fn pages_of_a_record_hold_in_a_browser() {
    let Some(browser) = browser() else {
        return;
    };
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().canonicalize().expect("a path");
    std::fs::write(folder.join("record.csv"), include_str!("../examples/record.csv")).expect("written");
    for (line, page) in [
        (
            "estimate record.csv --order 2 --estimator arx,oe --report estimate.html",
            "estimate.html",
        ),
        ("observe record.csv --order 2 --report observe.html", "observe.html"),
    ] {
        done_in(&folder, &line.split(' ').collect::<Vec<_>>());
        let said = check(browser, &folder, page, "");
        for of in said {
            assert!(!of["tables"].as_array().expect("tables").is_empty(), "{page}");
        }
    }
}

/// A page with a script that is not its own, a wide line and a link to nothing is found out.
#[test]
fn a_bad_page_is_seen_to_be_bad() {
    let Some(browser) = browser() else {
        return;
    };
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().canonicalize().expect("a path");
    let page = "<!DOCTYPE html><html><head><meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
        style-src 'unsafe-inline'; script-src 'sha256-AAAA'\"></head><body><p style=\"width:3000px\">wide</p>\
        <svg class=\"asoplot\"><text>a</text></svg><a href=\"#none\">none</a><a href=\"none.csv\">none</a>\
        <details><summary>s</summary></details><script>\"own\"</script></body></html>";
    std::fs::write(folder.join("bad.html"), page).expect("written");
    let console = seen(browser, &folder, "bad.html", "light").console;
    assert!(
        console.iter().any(|line| line.contains("Content Security Policy")),
        "{console:?}"
    );
    for of in frames(browser, &folder, "bad.html", MEASURE) {
        assert!(of["closed"].as_i64() > Some(1000), "{of}");
        assert_eq!(texts(&of["dangling"]), ["#none"]);
        assert!(texts(&of["files"])[0].ends_with("/none.csv"));
    }
}
