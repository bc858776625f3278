//! The README shows what the program prints.

use std::path::Path;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a file")
}

/// The verdict table of the README is the committed one, to the letter.
#[test]
fn the_verdict_table_is_the_committed_one() {
    let verdict = read("results/nikolov2023/verdict.txt");
    assert!(read("README.md").contains(verdict.trim_end()));
}

/// So is the table of claims.
#[test]
fn the_table_of_claims_is_the_committed_one() {
    let (readme, claims) = (read("README.md"), read("results/report/claims.md"));
    let rows: Vec<&str> = claims
        .lines()
        .filter(|line| line.starts_with('|'))
        .collect();
    assert!(rows.len() > 10);
    assert!(readme.contains(&rows.join("\n")));
}

/// Every file that the README links to is there.
#[test]
fn links_lead_somewhere() {
    let readme = read("README.md");
    let links = readme
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    for link in links.filter(|link| !link.starts_with("http")) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(link);
        assert!(path.exists(), "{link}");
    }
}
