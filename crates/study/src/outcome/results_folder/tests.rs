use super::*;
use std::fs;

/// Returns a design with two keys.
fn design(seed: u64, y: u64) -> Value {
    let experiment = json!({"seed": seed, "x": {"y": y}});
    json!({"version": "0.0.0", "experiment": experiment})
}

fn write(results: &mut ResultsFolder, name: &str) {
    results.write(name, Kind::Figure, OWN_FIGURE).unwrap();
}

const OWN_FIGURE: &[u8] = b"<svg xmlns=\"x\" class=\"asoplot\" width=\"1\"/>";
const OWN_SUMMARY: &[u8] = br#"{"title":"","question":"","hypothesis":"","claims":[]}"#;

#[test]
fn results_appear_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new");
    let mut results = ResultsFolder::open(&path).unwrap();
    write(&mut results, "a.svg");
    drop(results);
    assert_eq!(fs::read_dir(&path).unwrap().count(), 1, "only the lock");

    let mut results = ResultsFolder::open(&path).unwrap();
    let mut manifest = json!({"program": "asobench"});
    manifest["version"] = "0.0.0".into();
    manifest["experiment"] = design(1, 2)["experiment"].clone();
    results.write_manifest(manifest).unwrap();
    write(&mut results, "a.svg");
    results.publish().unwrap();
    let mut names: Vec<_> = fs::read_dir(&path)
        .unwrap()
        .map(|f| f.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(names, [".lock", "a.svg", "manifest.json"]);
    drop(results);

    let results = ResultsFolder::open(&path).unwrap();
    assert!(matches!(
        ResultsFolder::open(&path),
        Err(FolderError::Busy(_))
    ));
    results.claim_design(&design(1, 2), &[]).unwrap();
    let error = results
        .claim_design(&design(2, 3), &[])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("(different: seed 1 there, 2 here, x.y 2 there, 3 here)"),
        "{error}"
    );
    fs::remove_file(path.join(MANIFEST)).unwrap();
    let error = results
        .claim_design(&design(1, 3), &[])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("(different: x.y 2 there, 3 here)"),
        "by the blocks: {error}"
    );
    fs::write(path.join("blocks/design.json"), r#"{"version": "99.0.0"}"#).unwrap();
    fs::write(path.join("summary.json"), b"{}").unwrap();
    let error = results
        .claim_design(&design(1, 2), &[])
        .unwrap_err()
        .to_string();
    assert!(error.contains("99.0.0, which is newer"), "{error}");
}

#[test]
fn results_without_a_manifest_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let results = ResultsFolder::open(folder.path()).unwrap();
    for (name, _) in RESULTS {
        fs::write(folder.path().join(name), b"").unwrap();
        let error = results
            .claim_design(&json!({}), &[])
            .unwrap_err()
            .to_string();
        assert!(error.contains(&format!("holds {name} without")), "{error}");
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    results.claim_design(&json!({}), &[]).unwrap();
}

/// The design stays beside results without a manifest. Otherwise it is removed.
#[test]
fn removing_blocks_leaves_no_results_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let results = ResultsFolder::open(path).unwrap();
    results.claim_design(&design(1, 2), &[]).unwrap();
    let (kept, block) = (
        path.join("blocks/design.json"),
        path.join("blocks/c00000-0000000000-0000000001.block"),
    );
    fs::write(&block, b"asobench").unwrap();
    fs::write(path.join("summary.json"), OWN_SUMMARY).unwrap();
    results.remove_blocks().unwrap();
    assert!(kept.exists() && !block.exists());
    results.claim_design(&design(1, 2), &[]).unwrap();
    results.clear(&[], false).unwrap();
    assert!(!path.join(BLOCKS).exists() && !path.join("summary.json").exists());
    results.remove_blocks().unwrap();
}

/// The whole folder is inspected before any file is removed.
#[test]
fn what_is_not_own_is_never_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let results = ResultsFolder::open(path).unwrap();
    results.claim_design(&design(1, 2), &[]).unwrap();
    fs::write(path.join("summary.json"), OWN_SUMMARY).unwrap();
    for foreign in [
        "trials.parquet",
        "blocks/thesis.txt",
        "blocks/thesis.block",
        "blocks/c00001-0000000000-0000000001.block",
    ] {
        fs::write(path.join(foreign), b"thesis").unwrap();
        let error = results.clear(&[], false).unwrap_err().to_string();
        assert!(error.contains(foreign), "{error}");
        assert!(path.join(foreign).exists() && path.join("summary.json").exists());
        fs::remove_file(path.join(foreign)).unwrap();
    }
    results.clear(&[], false).unwrap();
}

#[test]
fn names_of_blocks() {
    for (name, is) in [
        ("c00000-0000000000-0000000100.block", true),
        ("c123456-0000000000-12345678901.block", true),
        ("c0000-0000000000-0000000100.block", false),
        ("c00000-0000000000-0000000100.block.damaged", false),
        ("c00000-0000000000.block", false),
        ("c00000-0000000000-000000010x.block", false),
        ("thesis.block", false),
    ] {
        assert_eq!(span_of(Path::new(name)).is_some(), is, "{name}");
    }
}
