//! README and docs show what the program prints, and their links lead somewhere.

mod prose;

use crate::common::PROGRAM;
use std::path::Path;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a file")
}

/// The verdict table of docs/reproduce.md is the committed one, to the letter.
#[test]
fn the_verdict_table_is_the_committed_one() {
    let verdict = read("results/nikolov2023/verdict.txt");
    assert!(read("docs/reproduce.md").contains(verdict.trim_end()));
}

/// So is the table of claims.
#[test]
fn the_table_of_claims_is_the_committed_one() {
    let (findings, claims) = (read("docs/findings.md"), read("results/report/claims.md"));
    let rows: Vec<&str> = claims
        .lines()
        .filter(|line| line.starts_with('|'))
        .collect();
    assert!(rows.len() > 10);
    assert!(findings.contains(&rows.join("\n")));
}

/// The papers' sentences have the verdicts of the committed table: "`C2` (`nikolov2023`): does not hold".
#[test]
fn the_verdicts_of_the_papers_sentences_are_the_committed_ones() {
    let (page, claims) = (read("docs/reproduce.md"), read("results/report/claims.md"));
    let verdicts: Vec<Vec<&str>> = claims
        .lines()
        .filter(|line| line.starts_with('|'))
        .map(|line| {
            line.split(" | ")
                .map(|cell| cell.trim_matches(['|', ' ']))
                .collect()
        })
        .collect();
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
        assert!(
            said.starts_with(&format!("{} (", row[2])),
            "{id} of {study}: {said}"
        );
        seen += 1;
    }
    assert!(seen > 30, "{seen}");
}

/// docs/methods.md shows what `asobench methods` prints.
#[test]
fn the_table_of_estimators_is_the_programs() {
    let printed = printed(&["methods"]);
    assert!(printed.contains("arx"));
    let block = format!("```text\n{printed}```");
    assert!(read("docs/methods.md").contains(&block), "{printed}");
}

/// The output of the program.
fn printed(arguments: &[&str]) -> String {
    let output = std::process::Command::new(PROGRAM).args(arguments).output();
    String::from_utf8(output.expect("asobench runs").stdout).expect("UTF-8")
}

/// The page of all keys is the program's.
#[test]
fn the_reference_of_keys_is_the_programs() {
    let page = printed(&["schema", "--markdown"]);
    let command = "asobench schema --markdown > docs/reference.md";
    assert!(read("docs/reference.md") == page, "{command}");
}

/// README stays a front page.
#[test]
fn the_front_page_is_short() {
    assert!(read("README.md").lines().count() <= 150);
}

/// README, the pages of docs, and the index of results, as paths from the root.
fn pages() -> Vec<String> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let docs = std::fs::read_dir(docs).expect("a folder");
    let docs = docs.map(|file| file.expect("a file").file_name());
    let docs = docs.map(|name| format!("docs/{}", name.to_string_lossy()));
    let pages = ["README.md", "results/README.md"].map(str::to_owned);
    pages.into_iter().chain(docs).collect()
}

/// Every file that README, docs and indices link to is there.
#[test]
fn links_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let indices = ["CONTRIBUTING.md", "experiments/README.md"].map(str::to_owned);
    let pages: Vec<String> = pages().into_iter().chain(indices).collect();
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

/// The index of the experiments names the claims of every file.
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
    assert!(rows.len() > 20);
    for (name, claims) in rows {
        let file = read(&format!("experiments/{name}.toml"));
        let ids = file.split("[[claims]]\nid = \"").skip(1);
        let ids: Vec<&str> = ids.filter_map(|rest| rest.split('"').next()).collect();
        assert_eq!(claims, ids.join(", "), "{name}");
    }
}
