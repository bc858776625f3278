//! `asobench report` from outside: two small studies, their page, tables and verdicts.

use crate::common::PROGRAM;
use asobench::study::Experiment;
use asobench::study::file::ExperimentFile;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

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

const OWN: &str = "title = \"x0 & <more>\"\ntrials = 40\ncurves = true\nparameters = true\n\
    measures = [\"e_a\", \"e_b\"]\n[settings]\nwindow = [98, 198, 400]\n\
    [[slopes]]\nfigure = \"e_a\"\nover = \"window\"\n[[bounds]]\nfigure = \"e_a\"\nbelow = 0.1\n";

/// White noise: e_a of least squares is far from 10 and from 1e-9 in every trial.
const JUDGED: &str = "trials = 60\nmeasures = [\"e_a\"]\n[settings]\nwindow = [98, 198]\n\
    [[claims]]\nid = \"W1\"\ntext = \"Least squares is nearer to a than ten.\"\n\
    test = { share = \"e_a\", of = \"ls\", bound = 10, above = 0.5 }\n\
    [[claims]]\nid = \"W2\"\ntext = \"It is within a billionth.\"\n\
    test = { share = \"e_a\", of = \"ls\", bound = 1e-9, above = 0.5 }\n";

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

/// A row of a tabular: its cells, split at `&` outside of braces; the rest of the text must be escaped.
fn latex_cells(row: &str) -> usize {
    let (mut depth, mut cells) = (0, 1);
    let mut letters = row.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => drop(letters.next()),
            '{' => depth += 1,
            '}' => depth -= 1,
            '&' => cells += usize::from(depth == 0),
            '%' | '#' | '<' | '>' | '~' | '|' | '"' => panic!("'{letter}' in {row}"),
            _ => {}
        }
        assert!(depth >= 0, "{row}");
    }
    assert_eq!(depth, 0, "{row}");
    cells
}

/// A table of booktabs, all rows of one length, with nothing that is a command by accident.
fn check_latex(name: &str, text: &str) {
    let body = text
        .lines()
        .skip(1)
        .filter(|line| !line.starts_with("\\begin{tabular}"));
    for line in body {
        latex_cells(line);
    }
    let rows = |from: &str, to: &str| -> Vec<usize> {
        let start = text.find(from).expect("a rule") + from.len();
        let rows = text[start..].split(to).next().unwrap_or_default();
        rows.trim().lines().map(latex_cells).collect()
    };
    let head = rows("\\toprule\n", "\\midrule");
    let all = rows("\\midrule\n", "\\bottomrule");
    assert_eq!(head.len(), 1, "{name}");
    assert!(
        !all.is_empty() && all.iter().all(|cells| *cells == head[0]),
        "{name}: {all:?}"
    );
    assert!(
        text.contains("\\caption{") && text.ends_with("\\end{table}\n"),
        "{name}"
    );
    assert!(all.len() <= 50, "{name}");
}

/// A document with all tables compiles with no package but booktabs.
fn compile(folder: &Path, tables: &[String]) {
    let tables: Vec<String> = tables.iter().map(|table| format!("{table}\\clearpage\n")).collect();
    let text = format!(
        "\\documentclass{{article}}\n\\usepackage{{booktabs}}\n\\begin{{document}}\n{}\\end{{document}}\n",
        tables.concat()
    );
    fs::write(folder.join("all.tex"), text).expect("a file");
    let arguments = ["-interaction=nonstopmode", "-halt-on-error", "all.tex"];
    let Ok(output) = Command::new("pdflatex").args(arguments).current_dir(folder).output() else {
        println!("skipped: no pdflatex");
        return;
    };
    let log = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && folder.join("all.pdf").exists(), "{log}");
}

#[test]
fn two_studies_make_a_page_with_verdicts_figures_and_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let own = path("my-study.toml");
    fs::write(&own, OWN).expect("a file");
    done(&["run", &own, "--out", &path("my-study")]);
    let judged = path("judged.toml");
    fs::write(&judged, JUDGED).expect("a file");
    done(&["run", &judged, "--out", &path("anything")]);
    let results = [path("anything"), path("my-study")];
    let out = path("report");
    let text = done(&["report", &results[0], &results[1], "--out", &out]);
    assert!(
        text.starts_with("W1  holds") && text.contains("\nW2  does not hold"),
        "{text}"
    );

    let first = files(Path::new(&out));
    let page = |name: &str| String::from_utf8(first[&format!("{out}/{name}")].clone()).expect("UTF-8");
    let html = page("report.html");
    check_tags(&html);
    assert!(html.contains("x0 &amp; &lt;more&gt;") && !html.contains("NaN") && !html.contains("http://localhost"));
    assert!(html.find("Verdicts").expect("verdicts") < html.find("To run it again").expect("a command"));
    for folder in &results {
        let command = format!("asobench run {folder}/manifest.json --out");
        assert!(html.contains(&command), "{command}");
    }
    let text = |name: &String| String::from_utf8(first[name].clone()).expect("UTF-8");
    let tables = first.keys().filter(|name| name.contains("/tables/"));
    let (latex, csv): (Vec<&String>, Vec<&String>) = tables.partition(|name| name.rsplit('.').next() == Some("tex"));
    for name in &csv {
        check_csv(name, &text(name));
    }
    for name in &latex {
        check_latex(name, &text(name));
    }
    // Of each study overview and bounds, of one slopes, of the other two claims; the verdicts; of three measures
    // medians by cells and methods.
    assert_eq!(latex.len(), 2 + 2 + 1 + 2 + 1 + 3, "{latex:?}");
    compile(folder.path(), &latex.iter().map(|name| text(name)).collect::<Vec<_>>());
    for name in latex {
        let name = name.rsplit('/').next().unwrap_or_default();
        assert!(html.contains(&format!("href=\"tables/{name}\"")), "{name}");
    }
    // The number in parentheses is that of the paper's CSV and of the LaTeX table.
    let of_paper = page("tables/my-study-overview-paper.csv");
    let median = of_paper
        .lines()
        .nth(1)
        .and_then(|row| row.split(',').nth(2))
        .expect("a median");
    assert!(median.ends_with(')'), "{median}");
    assert!(page("tables/my-study-overview.tex").contains(&format!("${median}$")));
    assert!(page("simulated.md").starts_with("# What was simulated\n"));
    let cited = html.split_once("How to cite this").expect("a citation").1;
    let version = format!("asobench {}", env!("CARGO_PKG_VERSION"));
    for part in [&version, "x0 &amp; &lt;more&gt;", "seed 2023", "design "] {
        assert!(cited.contains(part), "{part}");
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
    let verdicts = page("claims.md");
    for part in [
        "\n| W1 | Least squares is nearer to a than ten. | holds | anything |\n",
        "\n| W2 | It is within a billionth. | does not hold | anything |\n",
        "\nW1  holds: ",
        "\nW2  does not hold: ",
    ] {
        assert!(verdicts.contains(part), "{part}: {verdicts}");
    }
    // A row for each cell of each claim.
    let numbers = page("tables/claims.csv");
    assert_eq!(numbers.lines().count(), 1 + 2 * 2, "{numbers}");

    // Nothing but the report; the same again, bit for bit.
    done(&["report", &results[0], &results[1], "--out", &out]);
    assert_eq!(files(Path::new(&out)), first);
    // Files that somebody else put there are not replaced.
    for name in ["tables/my-study-overview.tex", "simulated.md"] {
        let place = Path::new(&out).join(name);
        fs::write(&place, "% mine").expect("a file");
        let output = asobench(&["report", &results[0], &results[1], "--out", &out]);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && message.contains(name), "{message}");
        assert_eq!(fs::read_to_string(&place).expect("a file"), "% mine");
        fs::write(&place, &first[&place.display().to_string()]).expect("a file");
    }
    // A single folder is where its report goes.
    done(&["report", &results[1]]);
    assert!(Path::new(&results[1]).join("report.html").exists());
    assert!(Path::new(&results[1]).join("summary.json").exists());
    // Its file has no claims.
    assert!(!Path::new(&results[1]).join("claims.md").exists());
    let page = fs::read_to_string(Path::new(&results[1]).join("report.html")).expect("a page");
    assert!(!page.contains("Verdicts"));
    // The command on its page gives the same results.
    let manifest = format!("{}/manifest.json", results[1]);
    done(&["run", &manifest, "--out", &path("again")]);
    for name in ["summary.json", "manifest.json"] {
        let content = |folder: &str| fs::read(Path::new(folder).join(name)).expect("a file");
        assert_eq!(content(&path("again")), content(&results[1]), "{name}");
    }
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
    refused("no results in this folder (no manifest.json)");
    fs::write(folder.path().join("manifest.json"), "{}").expect("a file");
    refused("no experiment in it");
    fs::write(folder.path().join("manifest.json"), r#"{"experiment": {"title": "x"}}"#).expect("a file");
    refused("summary.json");
    fs::write(folder.path().join("summary.json"), r#"{"title": 1}"#).expect("a file");
    refused("not a summary of this version");
    assert!(!folder.path().join("report.html").exists());
}

/// The string literals of Rust source, without those of comments.
fn literals(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = source;
    while let Some(at) = rest.find(['"', '\'', '/', '#']) {
        let raw = rest[at..]
            .find('"')
            .filter(|end| rest[at..at + end].chars().all(|c| c == '#'));
        let quoted = |text: &str| {
            let mut escaped = false;
            let end = text.find(|c| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            end.expect("a literal without end")
        };
        let text = &rest[at..];
        let (literal, length) = if text.starts_with("//") {
            (None, text.find('\n').unwrap_or(text.len()))
        } else if let Some(hashes) = raw.filter(|hashes| *hashes > 0 && rest[..at].ends_with('r')) {
            let end = format!("\"{}", "#".repeat(hashes));
            let inner = &text[hashes + 1..];
            let length = inner.find(&end).expect("a literal without end");
            (Some(&inner[..length]), hashes + 1 + length + end.len())
        } else if let Some(inner) = text.strip_prefix('"') {
            let length = quoted(inner);
            (Some(&inner[..length]), length + 2)
        } else if text.starts_with("'\"'") {
            (None, 3)
        } else {
            (None, 1)
        };
        found.extend(literal.map(|literal| literal.replace("\\\"", "\"")));
        rest = &rest[at + length..];
    }
    found
}

/// A module and those below it, without tests.
fn sources(module: &Path, folder: &Path, found: &mut Vec<String>) {
    let text = fs::read_to_string(module).expect("a module");
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let mut is_test = false;
    for line in text.lines() {
        let line = line.trim_start_matches("pub ");
        if let Some(name) = line.strip_prefix("mod ").and_then(|rest| rest.strip_suffix(';')) {
            let [own, below] = [format!("{name}.rs"), format!("{name}/mod.rs")];
            let paths = [own, below].map(|path| folder.join(path));
            let path = paths.iter().find(|path| path.exists()).expect("a module");
            if !is_test {
                sources(path, &folder.join(name), found);
            }
        }
        is_test = line == "#[cfg(test)]" || is_test && line.starts_with("#[");
    }
    found.push(text.to_owned());
}

/// Reports know no study: nothing that they say is the name of a shipped file, of its claims or of its outputs.
#[test]
fn reports_know_no_shipped_study() {
    let tricky = "let a = \"b\"; // \"c\"\n\
        r#\"d \"e\"\"#; '\"'; \"f\\\"g\"; #[h = \"i\"] 'x' &'a \"\" ";
    assert_eq!(literals(tricky), ["b", "d \"e\"", "f\"g", "i", ""]);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut names = BTreeSet::new();
    for entry in fs::read_dir(root.join("experiments")).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        names.extend(path.file_stem().map(|name| name.display().to_string()));
        let text = fs::read_to_string(&path).expect("a file");
        let file = ExperimentFile::parse(&text).expect("an experiment");
        let experiment = Experiment::new(file).expect("an experiment");
        names.extend(experiment.file.claims.iter().map(|claim| claim.id.clone()));
        for output in experiment.outputs() {
            names.extend([output.label(), output.estimator]);
        }
    }
    let mut modules = Vec::new();
    let report = root.join("crates/report/src");
    sources(&report.join("lib.rs"), &report, &mut modules);
    let said: Vec<String> = modules.iter().flat_map(|text| literals(text)).collect();
    assert!(modules.len() > 15 && said.len() > 300 && names.len() > 100);
    let known: Vec<&String> = said.iter().filter(|text| names.contains(*text)).collect();
    assert!(known.is_empty(), "{known:?}");
}
