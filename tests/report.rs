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

/// The shipped experiment with one measure less: another design.
fn modified() -> String {
    let shipped = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/experiments/initial-state.toml"
    );
    let text = fs::read_to_string(shipped).expect("the file");
    let modified = text.replacen("\"e_b\", ", "", 1);
    assert_ne!(modified, text);
    modified
}

const OWN: &str = "title = \"x0 & <more>\"\ntrials = 40\ncurves = true\nparameters = true\nmeasures = [\"e_a\", \"e_b\"]\n[settings]\nwindow = [98, 198, 400]\n\
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
    let own = path("my-study.toml");
    fs::write(&own, OWN).expect("a file");
    done(&["run", &own, "--out", &path("my-study")]);
    let shipped = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/experiments/initial-state.toml"
    );
    let quick = ["run", shipped, "--quick", "--trials", "30", "--out"];
    done(&[&quick[..], &[&path("anything")]].concat());
    let results = [path("anything"), path("my-study")];
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
    for command in [
        "asobench run experiments/initial-state.toml --trials 30 --set seed=2023 --out",
        &format!("asobench run {}/manifest.json --out", path("my-study")),
    ] {
        assert!(html.contains(command), "{command}");
    }
    for name in first.keys().filter(|name| name.contains("/tables/")) {
        check_csv(
            name,
            &String::from_utf8(first[name].clone()).expect("UTF-8"),
        );
    }
    for part in [
        "figures/my-study-curves.svg",
        "figures/my-study-e_a.svg",
        "figures/my-study-bias.svg",
        "tables/claims.csv",
        "tables/my-study-slopes.csv",
    ] {
        assert!(first.contains_key(&format!("{out}/{part}")), "{part}");
    }
    let verdicts = of("claims.md");
    for part in [
        "\n| C8 | ",
        "No experiment in this report speaks to C1, C2, C3, ",
        "Taking x0 as 0 instead of estimating it costs",
    ] {
        assert!(verdicts.contains(part), "{part}: {verdicts}");
    }
    assert!(!verdicts.contains("| C1 |"), "{verdicts}");

    // Nothing but the report; the same again, bit for bit.
    done(&["report", &results[0], &results[1], "--out", &out]);
    assert_eq!(files(Path::new(&out)), first);
    // A single folder is where its report goes.
    done(&["report", &results[1]]);
    assert!(Path::new(&results[1]).join("report.html").exists());
    assert!(Path::new(&results[1]).join("summary.json").exists());
    // It says nothing of the papers' claims.
    assert!(!Path::new(&results[1]).join("claims.md").exists());
    let page = fs::read_to_string(Path::new(&results[1]).join("report.html")).expect("a page");
    assert!(!page.contains("Verdicts"));
    // The command on its page gives the same results.
    let manifest = format!("{}/manifest.json", results[1]);
    done(&["run", &manifest, "--out", &path("again")]);
    for name in ["summary.json", "manifest.json"] {
        let of = |folder: &str| fs::read(Path::new(folder).join(name)).expect("a file");
        assert_eq!(of(&path("again")), of(&results[1]), "{name}");
    }
}

/// A verdict needs the experiment's design, not its name.
#[test]
fn another_design_is_no_judge() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (file, results) = (path("initial-state.toml"), path("initial-state"));
    fs::write(&file, modified()).expect("a file");
    let run = ["run", &file, "--quick", "--trials", "20", "--out", &results];
    done(&run);
    let text = done(&["report", &results]);
    assert!(!text.contains("C8"), "{text}");
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
