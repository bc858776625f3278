//! README and docs show what the program prints, and their links lead somewhere.

mod prose;

use crate::common::PROGRAM;
use std::collections::BTreeMap;
use std::path::Path;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a file")
}

/// README says how to build and to test, and CI calls these two commands.
#[test]
fn ci_calls_the_commands_of_the_readme() {
    for command in ["cargo build --release", "cargo test --release"] {
        let calls = |text: &str| {
            text.lines()
                .any(|line| line.split(['#', '"']).any(|part| part.trim() == command))
        };
        let in_ci = |text: &str| {
            text.lines()
                .any(|line| line.starts_with("step ") && line.ends_with(command))
        };
        assert!(calls(&read("README.md")), "README: {command}");
        assert!(in_ci(&read(".ci/run")), ".ci/run: {command}");
    }
}

/// The verdict table of docs/reproduce.md is the committed one, to the letter.
#[test]
fn the_verdict_table_is_the_committed_one() {
    let verdict = read("results/nikolov2023/verdict.txt");
    assert!(read("docs/reproduce.md").contains(verdict.trim_end()));
}

/// "10 pass, 13 fail": the cells of a claim in the table of all numbers.
fn cells_of(numbers: &[Vec<String>], id: &str, study: &str) -> String {
    let rows = numbers.iter().filter(|row| row[0] == id && row[5] == study);
    let cells: BTreeMap<&str, &str> = rows.map(|row| (&*row[6], &*row[7])).collect();
    let count = |says: &str| {
        let count = cells.values().filter(|of| **of == says).count();
        (count > 0).then(|| format!("{count} {says}"))
    };
    let counts = ["pass", "fail", "open", "left out"].into_iter();
    counts.filter_map(count).collect::<Vec<_>>().join(", ")
}

/// The papers' sentences have the verdicts and cells of the committed tables: "`C2` (`nikolov2023`): does not hold (1
/// fail)".
#[test]
fn the_verdicts_of_the_papers_sentences_are_the_committed_ones() {
    let (page, claims) = (read("docs/reproduce.md"), read("results/report/claims.md"));
    let verdicts: Vec<Vec<&str>> = claims
        .lines()
        .filter(|line| line.starts_with('|'))
        .map(|line| line.split(" | ").map(|cell| cell.trim_matches(['|', ' '])).collect())
        .collect();
    let numbers = read("results/report/tables/claims.csv");
    let numbers: Vec<Vec<String>> = numbers.lines().map(prose::fields).collect();
    let mut seen = 0;
    for part in page.split(['|', ';']) {
        let part = part.trim().strip_prefix('`');
        let Some((id, rest)) = part.and_then(|part| part.split_once("` (`")) else {
            continue;
        };
        let Some((study, said)) = rest.split_once("`): ") else {
            continue;
        };
        let row = verdicts.iter().find(|row| row[0] == id && row[3] == study);
        let row = row.unwrap_or_else(|| panic!("{id} of {study} is in no report"));
        let found = format!("{} ({})", row[2], cells_of(&numbers, id, study));
        assert_eq!(said, found, "{id} of {study}");
        seen += 1;
    }
    assert!(seen > 30, "{seen}");
}

/// Every claim of a paper is in the table of its sentences. Its source names the paper, not as what this project adds
/// ("own: ...") or found ("erratum ..."); "the same sentence" is that of the claim before.
#[test]
fn every_claim_of_a_paper_is_among_its_sentences() {
    let page = read("docs/reproduce.md");
    let (_, table) = page.split_once("## Sentence by sentence").expect("a table");
    let (mut seen, mut missing) = (0, Vec::new());
    for study in studies() {
        let file = read(&format!("experiments/{study}.toml"));
        let mut is_of_paper = false;
        for claim in file.split("[[claims]]\n").skip(1) {
            let value = |key: &str| {
                let line = claim.lines().find_map(|line| line.strip_prefix(key));
                let value = line.unwrap_or_else(|| panic!("{study}: {key}"));
                value.trim_matches(['"', '\'']).to_owned()
            };
            let (id, source) = (value("id = "), value("source = "));
            if !source.starts_with("the same sentence") {
                let names = ["Nikolov", "Bobtsov"].iter().any(|name| source.contains(name));
                let is_ours = source.starts_with("own:") || source.starts_with("erratum");
                is_of_paper = names && !is_ours;
            }
            if is_of_paper {
                seen += 1;
                let named = format!("`{id}` (`{study}`): ");
                missing.extend((!table.contains(&named)).then_some(named));
            }
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
    assert!(seen > 40, "{seen}");
}

/// Every estimator that `asobench methods` prints has a row in the table at the top of docs/methods.md.
#[test]
fn the_table_of_estimators_is_the_programs() {
    let printed = printed(&["methods"]);
    let names = printed.lines().filter(|line| !line.starts_with(' '));
    let names = names.filter_map(|line| Some(line.split_once(": ")?.0));
    let page = read("docs/methods.md");
    let first = |row: &str| row.strip_prefix("| `")?.split(" | ").next().map(str::to_owned);
    let table: Vec<String> = page.lines().filter_map(first).collect();
    let mut seen = 0;
    for name in names.filter(|name| *name != "command") {
        let row = table
            .iter()
            .find(|cell| cell.trim_end_matches('`').split("`, `").any(|of| of == name));
        assert!(row.is_some(), "{name}");
        seen += 1;
    }
    assert!(seen > 35, "{seen}");
}

/// The output of the program.
fn printed(arguments: &[&str]) -> String {
    let output = std::process::Command::new(PROGRAM).args(arguments).output();
    String::from_utf8(output.expect("asobench runs").stdout).expect("UTF-8")
}

/// The book's page of all keys is printed by the command that docs/reference.md names: it has every table of the schema
/// and every method, its tables parse, and its links lead to pages of `docs`.
#[test]
fn the_reference_of_keys_is_the_programs() {
    assert!(read("docs/reference.md").contains("asobench schema --markdown"));
    let page = printed(&["schema", "--markdown"]);
    for heading in [
        "The file",
        "Settings",
        "Measures",
        "Claim",
        "Method `arx`",
        "Method `known`",
    ] {
        assert!(page.contains(&format!("\n## {heading}\n")), "{heading}");
    }
    let links = page.split("](").skip(1);
    for link in links.filter_map(|rest| rest.split([')', '#']).next()) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(link);
        assert!(path.exists(), "{link}");
    }
    let cells = |row: &str| row.replace("\\|", "").matches('|').count();
    let lines: Vec<&str> = page.lines().collect();
    for rows in lines
        .windows(2)
        .filter(|rows| rows.iter().all(|row| row.starts_with('|')))
    {
        assert_eq!(cells(rows[0]), cells(rows[1]), "{rows:?}");
    }
}

/// README stays a front page.
#[test]
fn the_front_page_is_short() {
    assert!(read("README.md").lines().count() <= 150);
}

/// README, the pages of docs, and the indices of results and experiments, as paths from the root.
fn pages() -> Vec<String> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let docs = std::fs::read_dir(docs).expect("a folder");
    let docs = docs.map(|file| file.expect("a file").file_name());
    let docs = docs.map(|name| format!("docs/{}", name.to_string_lossy()));
    let pages = ["README.md", "results/README.md", "experiments/README.md"].map(str::to_owned);
    pages.into_iter().chain(docs).collect()
}

/// Every file that README, docs and indices link to is there.
#[test]
fn links_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages: Vec<String> = pages().into_iter().chain(["CONTRIBUTING.md".to_owned()]).collect();
    assert!(pages.len() > 10);
    for page in pages {
        let text = read(&page);
        let links = text.split("](").skip(1);
        let links = links.filter_map(|rest| rest.split([')', '#']).next());
        for link in links.filter(|link| !link.is_empty() && !link.starts_with("http")) {
            let path = root.join(&page);
            let path = path.parent().expect("a folder").join(link);
            assert!(path.exists(), "{page}: {link}");
        }
    }
}

/// The names of the experiments' files.
fn studies() -> Vec<String> {
    let files = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let files = std::fs::read_dir(files).expect("a folder");
    let files = files.map(|file| file.expect("a file").file_name());
    let files = files.map(|name| name.to_string_lossy().into_owned());
    files
        .filter_map(|name| Some(name.strip_suffix(".toml")?.to_owned()))
        .collect()
}

/// The index of the experiments has a row for every file, and names its claims.
#[test]
fn the_index_of_experiments_names_their_claims() {
    let index = read("experiments/README.md");
    let row = |line: &str| {
        let cells: Vec<String> = line.split(" | ").map(str::to_owned).collect();
        let name = cells.first()?.strip_prefix("| `")?.strip_suffix('`')?;
        let claims = cells.get(2)?.trim_end_matches([' ', '|']).to_owned();
        Some((name.to_owned(), claims))
    };
    let rows: Vec<(String, String)> = index.lines().filter_map(row).collect();
    assert_eq!(rows.len(), studies().len());
    for (name, claims) in rows {
        let file = read(&format!("experiments/{name}.toml"));
        let ids = file.split("[[claims]]\nid = \"").skip(1);
        let ids: Vec<&str> = ids.filter_map(|rest| rest.split('"').next()).collect();
        assert_eq!(claims, ids.join(", "), "{name}");
    }
}
