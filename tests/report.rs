//! `asobench report` from outside: two small studies, their page, tables and verdicts.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const PROGRAM: &str = env!("CARGO_BIN_EXE_asobench");

fn asobench(arguments: &[&str]) -> Output {
    let output = Command::new(PROGRAM).args(arguments).output();
    output.expect("the program runs")
}

fn done(arguments: &[&str]) -> String {
    let output = asobench(arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

const INITIAL_STATE: &str = "title = \"x0 & <more>\"\nclaims = [\"C8\"]\ntrials = 30\nparameters = true\n\
    measures = [\"e_a\", \"e_x_max\"]\ncompare = [[\"iv-zero(4)\", \"iv(4)\"]]\n\
    [settings]\nx0 = [0, 100]\nnoise = [\"ar\", \"white\"]\n[[methods]]\nname = \"iv\"\n\
    [[methods]]\nname = \"iv-zero\"\ninitial_state = \"zero\"\nreport = [4]\n";

const OWN: &str = "trials = 40\ncurves = true\nmeasures = [\"e_a\", \"e_b\"]\n[settings]\nwindow = [98, 198, 400]\n\
    [[slopes]]\nfigure = \"e_a\"\nover = \"window\"\n[[bounds]]\nfigure = \"e_a\"\nbelow = 0.1\n";

/// Every file under a folder, by its path.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.display().to_string(), fs::read(&path).expect("a file"));
        }
    }
    found
}

/// Tags close in the order in which they open, outside of styles and scripts.
fn check_tags(html: &str) {
    const VOID: [&str; 5] = ["meta", "link", "br", "!DOCTYPE", "img"];
    let mut open: Vec<&str> = Vec::new();
    let mut rest = html;
    while let Some(start) = rest.find('<') {
        let tag = &rest[start + 1..start + rest[start..].find('>').expect("a tag without end")];
        rest = &rest[start + tag.len() + 2..];
        let name = tag.split([' ', '\n', '/']).next().unwrap_or_default();
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
            if ["style", "script"].contains(&name) {
                rest = &rest[rest.find(&format!("</{name}>")).expect("an end")..];
            }
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

/// Rows of RFC 4180, all of one length.
fn check_csv(name: &str, text: &str) {
    let mut widths = Vec::new();
    let (mut quoted, mut fields) = (false, 1);
    for character in text.chars() {
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => fields += 1,
            '\n' if !quoted => widths.push(std::mem::replace(&mut fields, 1)),
            _ => {}
        }
    }
    assert!(!quoted && text.ends_with("\r\n"), "{name}");
    assert!(
        widths.len() > 1 && widths.iter().all(|width| *width == widths[0]),
        "{name}: {widths:?}"
    );
}

#[test]
fn two_studies_make_a_page_with_verdicts_figures_and_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let mut results = Vec::new();
    for (name, toml) in [("initial-state", INITIAL_STATE), ("my-study", OWN)] {
        let file = path(&format!("{name}.toml"));
        fs::write(&file, toml).expect("a file");
        done(&["run", &file, "--out", &path(name)]);
        results.push(path(name));
    }
    let out = path("report");
    let text = done(&["report", &results[0], &results[1], "--out", &out]);
    assert!(
        text.contains("C8 ") && text.contains("initial-state") && !text.contains("C1 "),
        "{text}"
    );

    let first = files(Path::new(&out));
    let of =
        |name: &str| String::from_utf8(first[&format!("{out}/{name}")].clone()).expect("UTF-8");
    let html = of("report.html");
    check_tags(&html);
    assert!(
        html.contains("x0 &amp; &lt;more&gt;")
            && !html.contains("NaN")
            && !html.contains("http://localhost")
    );
    assert!(
        html.find("Verdicts").expect("verdicts") < html.find("To run it again").expect("a command")
    );
    assert!(html.contains(
        "asobench run experiments/my-study.toml --trials 40 --set seed=2023 --out results/my-study"
    ));
    for name in first.keys().filter(|name| name.starts_with("tables/")) {
        check_csv(
            name,
            &String::from_utf8(first[name].clone()).expect("UTF-8"),
        );
    }
    for part in [
        "figures/my-study-curves.svg",
        "figures/my-study-e_a.svg",
        "figures/initial-state-bias.svg",
        "tables/claims.csv",
        "tables/my-study-slopes.csv",
    ] {
        assert!(first.contains_key(&format!("{out}/{part}")), "{part}");
    }
    let verdicts = of("claims.md");
    assert!(
        verdicts.contains("| C1 | ") && verdicts.contains("| undecided | not run |"),
        "{verdicts}"
    );
    assert!(
        verdicts.contains("**C1: undecided.** Not run: needs the experiment nikolov2023."),
        "{verdicts}"
    );
    assert!(
        verdicts.contains("Taking x0 as 0 instead of estimating it costs"),
        "{verdicts}"
    );

    // Nothing but the report; the same again, bit for bit.
    done(&["report", &results[0], &results[1], "--out", &out]);
    assert_eq!(files(Path::new(&out)), first);
    // A single folder is where its report goes.
    done(&["report", &results[1]]);
    assert!(Path::new(&results[1]).join("report.html").exists());
    assert!(Path::new(&results[1]).join("summary.json").exists());
}

#[test]
fn folders_without_results_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().display().to_string();
    let refused = |part: &str| {
        let output = asobench(&["report", &path]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(
            message.lines().count() == 1 && message.contains(part) && message.contains(&path),
            "{message}"
        );
    };
    refused("no results there (no manifest.json)");
    fs::write(folder.path().join("manifest.json"), "{}").expect("a file");
    refused("no experiment in it");
    fs::write(
        folder.path().join("manifest.json"),
        r#"{"experiment": {"title": "x"}}"#,
    )
    .expect("a file");
    refused("summary.json");
    fs::write(folder.path().join("summary.json"), r#"{"title": 1}"#).expect("a file");
    refused("not a summary of this version");
    assert!(!folder.path().join("report.html").exists());
}
