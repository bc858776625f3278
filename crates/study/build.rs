//! Tells the program its git revision, if it is built from a git checkout, and which files the suite has.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

/// The files of a folder with this extension, by name.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    // One that is not there yet would be a change each time.
    if folder.exists() {
        println!("cargo::rerun-if-changed={}", folder.display());
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|of| of == extension));
    paths.sort();
    paths
}

/// A table of names with the texts of their files.
fn texts(name: &str, paths: &[PathBuf]) -> String {
    let mut table = format!("pub(super) const {name}: &[(&str, &str)] = &[\n");
    for path in paths {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let path = path.canonicalize().unwrap_or_else(|_| path.clone());
        let _ = writeln!(table, "({stem:?}, include_str!({:?})),", path.display().to_string());
    }
    table + "];\n"
}

fn suite() {
    let suite = Path::new(env!("CARGO_MANIFEST_DIR")).join("suite");
    let single = [
        ("MANIFEST", suite.join("suite.toml")),
        ("PUBLISHED", suite.join("published/tables.toml")),
        ("RECORDS", suite.join("recorded/records.toml")),
        ("RECORDED", suite.join("recorded/fits.json")),
        ("TIMES", suite.join("times.json")),
        ("BANK", suite.join("bank.jsonl")),
        ("LAW", suite.join("law.json")),
    ];
    let mut systems = files(&suite, "toml");
    systems.retain(|path| single.iter().all(|(_, other)| path != other));
    let mut generated = texts("SYSTEMS", &systems);
    for (name, folder) in [
        ("RESULTS", "results"),
        ("OPEN_RESULTS", "results/open"),
        ("ORDERS_RESULTS", "results/2.0/orders"),
        ("STRUCTURE_RESULTS", "results/2.0/structure"),
        ("NOTHING_RESULTS", "results/2.0/open"),
    ] {
        generated += &texts(name, &files(&suite.join(folder), "json"));
    }
    for (name, path) in single {
        // Before they are made for the first time there are none.
        let content = if path.exists() {
            // Of a file that is not there cargo would build anew each time.
            println!("cargo::rerun-if-changed={}", path.display());
            format!("include_str!({:?})", path.display().to_string())
        } else {
            "\"\"".to_owned()
        };
        let _ = writeln!(generated, "pub(super) const {name}: &str = {content};");
    }
    let to = std::env::var("OUT_DIR").map(PathBuf::from).unwrap_or_default();
    if let Err(error) = std::fs::write(to.join("suite_files.rs"), generated) {
        println!("cargo::error=suite_files.rs: {error}");
    }
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    suite();
    // Without the log (a checkout without history) the revision cannot change either.
    for path in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", path])
            && std::path::Path::new(&path).exists()
        {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    if let Some(revision) = git(&["rev-parse", "HEAD"]) {
        println!("cargo::rustc-env=ASOBENCH_GIT_REVISION={revision}");
    }
}
