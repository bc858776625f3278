use super::*;
use crate::outcome::folder_layout::span_of;
use crate::outcome::publication::WHOLE;
use crate::outcome::stored_results::read_results;
use std::fs;

/// Checks a design and makes the folder one of it, as a run does.
fn claim(results: &ResultsFolder, design: &Value) -> Result<(), FolderError> {
    results.check_design(design, &[])?;
    results.claim(design)
}

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
    results.publish(true).unwrap();
    let mut names: Vec<_> = fs::read_dir(&path).unwrap().map(|f| f.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, [".lock", "a.svg", "manifest.json"]);
    drop(results);

    let results = ResultsFolder::open(&path).unwrap();
    assert!(matches!(ResultsFolder::open(&path), Err(FolderError::Busy(_))));
    claim(&results, &design(1, 2)).unwrap();
    let error = results.check_design(&design(2, 3), &[]).unwrap_err().to_string();
    assert!(
        error.contains("(different: seed 1 there, 2 here, x.y 2 there, 3 here)"),
        "{error}"
    );
    fs::remove_file(path.join(MANIFEST)).unwrap();
    let error = results.check_design(&design(1, 3), &[]).unwrap_err().to_string();
    assert!(
        error.contains("(different: x.y 2 there, 3 here)"),
        "by the blocks: {error}"
    );
    fs::write(path.join("blocks/design.json"), r#"{"version": "99.0.0"}"#).unwrap();
    fs::write(path.join("summary.json"), b"{}").unwrap();
    let error = results.check_design(&design(1, 2), &[]).unwrap_err().to_string();
    assert!(error.contains("99.0.0, which is newer"), "{error}");
}

#[test]
fn results_without_a_manifest_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let results = ResultsFolder::open(folder.path()).unwrap();
    for (name, _) in RESULTS {
        fs::write(folder.path().join(name), b"").unwrap();
        let error = results.check_design(&json!({}), &[]).unwrap_err().to_string();
        assert!(error.contains(&format!("holds {name} without")), "{error}");
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    claim(&results, &json!({})).unwrap();
}

/// Publishes a manifest and a summary of a design.
fn publish(results: &mut ResultsFolder, design: &Value) {
    results.write("summary.json", Kind::Summary, OWN_SUMMARY).unwrap();
    let experiment = &design["experiment"];
    let manifest = json!({"program": "asobench", "version": design["version"], "experiment": experiment});
    results.write_manifest(manifest).unwrap();
    results.publish(true).unwrap();
}

/// Another study is computed beside the results that it replaces, which stay until it is whole; then its blocks and
/// results are there, and those before are gone.
#[test]
fn another_study_takes_the_place_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut results = ResultsFolder::open(path).unwrap();
    claim(&results, &design(1, 2)).unwrap();
    fs::write(path.join("blocks/c00000-0000000000-0000000001.block"), b"asobench").unwrap();
    results.write("summary.parquet", Kind::Parquet, b"").unwrap();
    publish(&mut results, &design(1, 2));
    fs::create_dir(path.join("timing")).unwrap();
    fs::write(path.join("timing/times.json"), br#"{"design":"1"}"#).unwrap();
    fs::write(path.join("thesis.txt"), b"thesis").unwrap();
    results.replace(&[], false).unwrap();
    results.claim(&design(2, 3)).unwrap();
    let beside = results.replaced_beside().unwrap().unwrap();
    assert_eq!(beside, ["thesis.txt"]);
    let stored = || read_manifest(path).unwrap().unwrap()["experiment"]["seed"].clone();
    assert_eq!((stored(), path.join("summary.parquet").exists()), (1.into(), true));
    publish(&mut results, &design(2, 3));
    assert_eq!(stored(), 2);
    let mut names: Vec<_> = files::list(path)
        .unwrap()
        .into_iter()
        .map(|path| path.file_name().unwrap().to_owned())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [".lock", "blocks", "manifest.json", "summary.json", "thesis.txt"]
    );
    assert_eq!(files::list(&path.join("blocks")).unwrap().len(), 1);
}

/// Files that differ from the manifest's list are not replaced by another study, and nothing else is removed then.
#[test]
fn what_is_not_listed_is_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut results = ResultsFolder::open(path).unwrap();
    claim(&results, &design(1, 2)).unwrap();
    publish(&mut results, &design(1, 2));
    let replace = |results: &mut ResultsFolder| {
        results.check_listed()?;
        results.replace(&[], true)
    };
    for foreign in [
        "trials.parquet",
        "summary.parquet",
        "looks.json",
        "blocks/thesis.txt",
        "blocks/thesis.block",
        "blocks/c00001-0000000000-0000000001.block",
    ] {
        fs::write(path.join(foreign), b"thesis").unwrap();
        let error = replace(&mut results).unwrap_err().to_string();
        assert!(error.contains(foreign), "{error}");
        assert!(path.join(foreign).exists() && path.join("summary.json").exists());
        fs::remove_file(path.join(foreign)).unwrap();
    }
    // The program's own, but changed since.
    let edited = [OWN_SUMMARY, b"\n"].concat();
    fs::write(path.join("summary.json"), edited).unwrap();
    let error = replace(&mut results).unwrap_err().to_string();
    assert!(error.contains("summary.json: not as manifest.json"), "{error}");
    fs::write(path.join("summary.json"), OWN_SUMMARY).unwrap();
    replace(&mut results).unwrap();
    // Nothing lists results without a manifest.
    fs::remove_file(path.join(MANIFEST)).unwrap();
    let error = replace(&mut results).unwrap_err().to_string();
    assert!(error.contains("summary.json"), "{error}");
}

/// Whole results count before those beside them, whichever of them have moved up, and a run moves up the rest.
#[test]
fn whole_results_count_first() {
    for moved in 0..=2 {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let mut results = ResultsFolder::open(path).unwrap();
        claim(&results, &design(1, 2)).unwrap();
        publish(&mut results, &design(1, 2));
        drop(results);
        let (whole, old) = (path.join(WHOLE), path.join(MANIFEST));
        fs::create_dir(&whole).unwrap();
        let text = fs::read_to_string(&old).unwrap();
        let mut manifest = files::parsed(text.as_bytes()).unwrap();
        manifest["experiment"]["seed"] = 7.into();
        fs::write(whole.join(MANIFEST), files::sealed(&manifest)).unwrap();
        fs::write(whole.join("summary.json"), OWN_SUMMARY).unwrap();
        for name in ["summary.json", MANIFEST].iter().take(moved) {
            fs::rename(whole.join(name), path.join(name)).unwrap();
        }
        let seed = || {
            read_results(path, |manifest| {
                check_result(path, manifest, "summary.json", None)?;
                Ok::<_, FolderError>(manifest["experiment"]["seed"].clone())
            })
        };
        assert_eq!(seed().unwrap(), 7, "{moved}");
        drop(ResultsFolder::open(path).unwrap());
        assert_eq!(seed().unwrap(), 7, "{moved}");
        assert!(!whole.exists() && fs::read_to_string(&old).unwrap() != text);
    }
}

/// Results that change while they are read are read again: never a manifest with another one's summary.
#[test]
fn what_changes_meanwhile_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let publish = |seed| {
        let mut results = ResultsFolder::open(path).unwrap();
        publish(&mut results, &design(seed, 2));
    };
    publish(1);
    let times = std::cell::Cell::new(0);
    let seed = read_results(path, |manifest| {
        times.set(times.get() + 1);
        if times.get() == 1 {
            publish(2);
            return Err(FolderError::Damaged(path.to_owned()));
        }
        Ok(manifest["experiment"]["seed"].clone())
    });
    assert_eq!((seed.unwrap(), times.get()), (2.into(), 2));
}

/// A run that has not ended is told from no run.
#[test]
fn a_folder_without_results_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let why = || {
        let read = read_results(path, |_| Ok::<_, FolderError>(()));
        read.unwrap_err().to_string()
    };
    assert!(why().contains("no results in this folder"), "{}", why());
    fs::create_dir(path.join("blocks")).unwrap();
    assert!(why().contains("no results in this folder"), "foreign");
    fs::remove_dir(path.join("blocks")).unwrap();
    let results = ResultsFolder::open(path).unwrap();
    claim(&results, &design(1, 2)).unwrap();
    for trials in ["0000000000-0000000040", "0000000050-0000000070"] {
        fs::write(path.join(format!("blocks/c00000-{trials}.block")), b"").unwrap();
    }
    assert!(
        why().contains("no results yet (no manifest.json): 60 trials"),
        "{}",
        why()
    );
    let manifest = json!({"program": "asobench", "experiment": {}, "wanted": 400});
    results.announce(manifest).unwrap();
    assert!(why().contains("60 of 400 trials of a run that has not ended"));
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
