//! Blocks whose head was forged, with the checksum that belongs to it: what is wrong is said with the name of the file.

use super::{Place, stderr};
use xxhash_rust::xxh3::xxh3_128;

const NAME: &str = "c00000-0000000000-0000000004.block";

/// Changes the head of the first block, and its checksum with it.
fn forge(place: &Place, change: impl Fn(&mut [u8])) {
    let path = place.path("out/blocks").join(NAME);
    let bytes = std::fs::read(&path).expect("a block");
    let mut bytes = bytes[..bytes.len() - 16].to_vec();
    change(&mut bytes);
    bytes.extend(xxh3_128(&bytes).to_le_bytes());
    std::fs::write(path, bytes).expect("written");
}

#[test]
fn a_forged_head_is_told_with_its_file() {
    type Change = fn(&mut [u8]);
    let range = "damaged (no such cell or no trials in its head)";
    // After "asobench": format, fingerprint, cell, first trial, end.
    let cases: [(&str, Change, &str, &str); 6] = [
        ("cell", |bytes| bytes[28..32].fill(0xff), range, range),
        ("no trials", |bytes| bytes[40..48].fill(0), range, range),
        ("endless", |bytes| bytes[40..48].fill(0xff), range, range),
        (
            "other trials",
            |bytes| bytes[32] = 1,
            "damaged",
            "has the name of another block",
        ),
        (
            "fingerprint",
            |bytes| bytes[12] ^= 1,
            "a block of another experiment",
            "of another experiment or version",
        ),
        (
            "format",
            |bytes| bytes[8] = 0xff,
            "written by a newer version of asobench (format 255",
            "written by a newer version of asobench (format 255",
        ),
    ];
    for (case, change, run, merge) in cases {
        let place = Place::new();
        forge(&place, change);
        let arguments = ["run", "study.toml", "--out", "out"];
        place.refuses(&arguments, &format!("{NAME}: {run}"));
        let output = place.run(&["plan", "study.toml", "--shards", "1", "--out", "plan.json"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let output = place.run(&["merge", "plan.json", "out/blocks", "--out", "merged"]);
        let said = stderr(&output);
        let line = said.lines().find(|line| line.contains(NAME));
        let line = line.unwrap_or_else(|| panic!("{case}: not named in {said}"));
        assert!(line.contains(&format!("{NAME}: {merge}")), "{case}: {line}");
        assert!(line.ends_with("not taken"), "{case}: {line}");
        // The other half of the trials is there, and the forged one is missing.
        assert_eq!(output.status.code(), Some(75), "{case}: {said}");
    }
    let place = Place::new();
    let blocks = place.path("out/blocks");
    std::fs::rename(blocks.join(NAME), blocks.join("c00007-0000000000-0000000004.block")).expect("renamed");
    place.run(&["plan", "study.toml", "--shards", "1", "--out", "plan.json"]);
    let output = place.run(&["merge", "plan.json", "out/blocks", "--out", "merged"]);
    let said = stderr(&output);
    assert!(
        said.contains("c00007-0000000000-0000000004.block: no such cell or no trials in its name, not taken"),
        "{said}"
    );
}
