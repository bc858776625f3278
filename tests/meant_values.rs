//! A value that a flag does not take, and a word where a command or a folder stands, lead to the line that was meant.

use super::meant_commands::{folder, refused, typed};
use crate::common::{done_in as done, stdout};

/// A picture's file says which picture, gaps are not interpolated, each picture has a flag, and a program is a file.
#[test]
fn a_value_says_what_is_meant() {
    let folder = folder();
    let at = folder.path();
    let estimate = ["estimate", "my.csv", "--estimator", "arx", "--order", "2"];
    for (more, part) in [
        (
            ["--out", "bode.png"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --plot bode.svg",
        ),
        (
            ["--skip-rows", "1"],
            "  try: asobench estimate my.csv --estimator arx --order 2",
        ),
        (
            ["--missing", "interpolate"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --missing longest-run",
        ),
        (
            ["--plot", "bode,step"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --plot bode --plot step",
        ),
        (
            ["--plot", "fit.png"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --plot fit.svg",
        ),
        (
            ["--validate", "0.3"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --window 70%",
        ),
        (
            ["--delay", "auto"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --delay 1:8",
        ),
        (
            // The word of the value is the command's too.
            ["--delay", "estimate"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --delay 1:8",
        ),
        (
            ["--train", "0.7"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --window 70%",
        ),
        (
            ["-o", "model.json"],
            "  try: asobench estimate my.csv --estimator arx --order 2 --format json",
        ),
    ] {
        let lines = refused(at, &[&estimate[..], &more].concat());
        assert!(lines.last().expect("a line").contains(part), "{lines:?}");
        if let Some(meant) = lines.last().and_then(|line| line.strip_prefix("  try: ")) {
            assert!(typed(at, meant).status.success(), "{meant}");
        }
    }
}

/// Studies and their results: a program is a file, what differs is said, and so is what a folder of results leads to.
#[test]
fn studies_and_results_that_are_meant() {
    let folder = folder();
    let at = folder.path();
    let lines = refused(at, &["suite", "run", "--method", "./x.py"]);
    assert!(
        lines[0].contains("command = [\"python3\", \"my.py\"]: asobench suite FILE.toml"),
        "{lines:?}"
    );
    done(at, &["run", "s.toml", "--out", "r"]);
    for line in [
        "run s.toml --set eta=[1,5] --set window=98 --out q",
        "run s.toml --set eta=[2,20] --set window=98 --out p",
    ] {
        done(at, &line.split(' ').collect::<Vec<_>>());
    }
    let lines = refused(at, &["compare", "q", "p"]);
    assert!(
        lines[0].contains("eta is 1, 5 in q, 2, 20 in p; asobench run FILE --set KEY=VALUE"),
        "{lines:?}"
    );
    let lines = refused(at, &["run", "s.toml", "--seed", "9", "--out", "r"]);
    assert!(lines[0].contains("there, 9 here)"), "{lines:?}");
    let lines = refused(at, &["replay", "r", "--trial", "7"]);
    assert_eq!(lines.last().expect("a line"), "  try: asobench replay r 0:7");
    assert!(stdout(&done(at, &["report", "r"])).starts_with("no claims"));
    for (line, meant) in [
        (&["help", "fit"][..], "  try: asobench explain fit"),
        (
            &["export", "r", "-o", "summary.csv"],
            "  try: asobench report r --out tables",
        ),
        (
            &["export", "r", "-o", "summary.csv", "--open"],
            "  try: asobench report r --open --out tables",
        ),
        (&["list", "failures", "r"], "  try: asobench failures r"),
    ] {
        let lines = refused(at, line);
        assert_eq!(lines.last().expect("a line"), meant, "{lines:?}");
    }
    // The delay may be left out of a list.
    let said = done(at, &["estimate", "my.csv", "--estimator", "armax", "--order", "2,2,2"]);
    let said = stdout(&said);
    assert!(said.contains("orders na=2,nb=2,nc=2,nk=1"), "{said}");
}
