//! `promises/*.md` name a test for each promise of a page of `docs`: it must be there, in a module of its program.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// The paths of the Rust modules at a path and below it, without extensions, and their texts.
fn modules(path: &Path, found: &mut Vec<(PathBuf, String)>) {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).expect("a folder").flatten();
        entries.for_each(|entry| modules(&entry.path(), found));
    } else if path.extension().is_some_and(|of| of == "rs") {
        let mut module = path.with_extension("");
        if ["mod", "main", "lib"].iter().any(|of| module.ends_with(of)) {
            module.pop();
        }
        found.push((module, read_to_string(path).expect("UTF-8")));
    }
}

#[test]
fn every_promise_has_a_test() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut all = Vec::new();
    for folder in ["tests", "src", "crates"] {
        modules(&root.join(folder), &mut all);
    }
    let is_declared = |module: &Path| {
        let name = module.file_name().expect("a name").to_string_lossy();
        let mut above = all.iter().filter(|(path, _)| Some(&**path) == module.parent());
        above.any(|(_, text)| text.contains(&format!("mod {name};")))
    };
    let is_there = |test: &str| {
        if let Some((file, name)) = test.strip_prefix("python: ").and_then(|of| of.split_once('.')) {
            let text = read_to_string(root.join(format!("python/tests/{file}.py")));
            let name = name.rsplit('.').next().unwrap_or(name);
            return text.is_ok_and(|text| text.contains(&format!("def {name}(")));
        }
        let Some((module, name)) = test.rsplit_once("::") else {
            return test.starts_with(".ci/") && root.join(test).exists();
        };
        let (module, name) = (module.replace("::", "/"), format!("fn {name}("));
        let mut named = all.iter().filter(|(path, _)| path.ends_with(&module));
        named.any(|(path, text)| text.contains(&name) && is_declared(path))
    };
    for page in std::fs::read_dir(root.join("tests/promises")).expect("pages") {
        let text = read_to_string(page.expect("a page").path()).expect("UTF-8");
        for row in text.lines().filter(|line| line.starts_with('|')).skip(2) {
            let last = row.trim_end_matches(['|', ' ']).rsplit('|').next();
            let tests: Vec<&str> = last.unwrap_or(row).split('`').skip(1).step_by(2).collect();
            assert!(!tests.is_empty(), "no test: {row}");
            for test in tests {
                assert!(is_there(test), "no test {test}: {row}");
            }
        }
    }
}
