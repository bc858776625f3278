//! The memory and disk that `check` expects of a run, against those it takes; and runs where there is not enough.

use super::{Place, contents, stderr, stdout, succeeds};
use std::fs;
use std::path::Path;

/// The line of a name in what `check` prints.
fn line<'a>(text: &'a str, name: &str) -> &'a str {
    let mut lines = text.lines();
    let found = lines.find(|line| line.split(' ').next() == Some(name));
    found.unwrap_or_else(|| panic!("no {name} in {text}"))
}

/// The amounts of a line in bytes, in their order.
fn amounts(line: &str) -> Vec<f64> {
    let words: Vec<&str> = line.split([' ', ',', ';', ':']).collect();
    let amount = |pair: &[&str]| {
        let factor = match pair[1] {
            "kB" => 1e3,
            "MB" => 1e6,
            "GB" => 1e9,
            "TB" => 1e12,
            "PB" => 1e15,
            _ => return None,
        };
        Some(pair[0].parse::<f64>().ok()? * factor)
    };
    words.windows(2).filter_map(amount).collect()
}

/// The bytes that all files in a folder and below it take on a disk with blocks of 4 kB.
fn bytes(path: &Path) -> f64 {
    let metadata = fs::metadata(path).expect("a file");
    if !metadata.is_dir() {
        return 4096.0 * metadata.len().div_ceil(4096) as f64;
    }
    let entries = fs::read_dir(path).expect("a folder");
    entries.map(|entry| bytes(&entry.expect("an entry").path())).sum()
}

/// Whether an amount that is told in whole kB, or to two digits, is within a factor of 1.5.
fn is_near(said: f64, is: f64) -> bool {
    said <= 1.5 * is + 1e3 && is <= 1.5 * said + 1e3
}

#[test]
fn times_of_methods_and_records_of_threads_are_counted() {
    let place = Place::new();
    let check = |set: &[&str]| {
        let sets = set.iter().flat_map(|set| ["--set", set]);
        let all: Vec<&str> = ["check", "everything.toml"].into_iter().chain(sets).collect();
        let output = place.run(&all);
        succeeds(&output);
        stdout(&output)
    };
    let text = check(&["timing=true"]);
    let size = text.find("cells     12").expect("the grid");
    assert!(size < text.find("time  ").expect("the time"), "{text}");
    assert!(text.contains("for the times of the methods, on one"), "{text}");
    let text = check(&["store=summaries"]);
    assert!(!text.contains("trials.parquet") && !text.contains("times of"), "{text}");
    // A record of 2 million samples, (6 + n) numbers each, one a thread.
    let text = check(&["horizon=2000000", "curves=false"]);
    assert!(amounts(line(&text, "memory"))[0] >= 128e6, "{text}");
}

#[test]
fn a_run_takes_the_room_that_was_told() {
    let place = Place::new();
    for (out, more) in [
        ("kept", &["--trials", "2000"][..]),
        ("few", &["--trials", "20"]),
        ("counted", &["--trials", "500", "--set", "store=summaries"]),
    ] {
        let output = place.run(&[&["check", "everything.toml"], more].concat());
        let text = stdout(&output);
        let said = amounts(line(&text, "disk"));
        place.results(out, more);
        let size = |name: &str| bytes(&place.path(out).join(name));
        let blocks = size("blocks");
        let summaries = size("summary.json") + size("summary.parquet");
        let kept = place.path(out).join("trials.parquet").exists();
        let trials = kept.then(|| size("trials.parquet"));
        let parts: Vec<f64> = [blocks].into_iter().chain(trials).chain([summaries]).collect();
        for (said, is) in said[1..].iter().zip(&parts) {
            assert!(is_near(*said, *is), "{out}: {text}, but {parts:?}");
        }
        assert!(is_near(said[0], parts.iter().sum()), "{out}: {text}, but {parts:?}");
    }
}

/// The most memory that a run of these arguments has at once, by the kernel's account while it runs.
#[cfg(target_os = "linux")]
fn peak(place: &Place, arguments: &[&str]) -> f64 {
    let mut child = place.start(arguments);
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0.0_f64;
    while child.try_wait().expect("a process").is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let number = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
        most = most.max(1024.0 * number.unwrap_or(0.0));
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    most
}

/// Memory and the bytes of a report are told to a factor of two, also where rows or curves take most of it, or nothing
/// does.
#[test]
#[cfg(target_os = "linux")]
fn memory_and_a_report_take_what_was_told() {
    let place = Place::new();
    for (out, more) in [
        ("kept", &["--trials", "5000"][..]),
        ("few", &["--trials", "20", "--set", "curves=false"]),
        ("counted", &["--trials", "20000", "--set", "store=summaries"]),
        ("long", &["--trials", "20", "--set", "horizon=4000"]),
    ] {
        let text = stdout(&place.run(&[&["check", "everything.toml"], more].concat()));
        let said = amounts(line(&text, "memory"))[0];
        let run = ["run", "everything.toml", "--out", out];
        let is = peak(&place, &[&run[..], more].concat());
        assert!(said <= 2.0 * is && is <= 2.0 * said, "{out}: {said} of {is}: {text}");
        let said = amounts(line(&text, "disk"));
        succeeds(&place.run(&["report", out, "--out", "page"]));
        let is = bytes(&place.path("page"));
        let report = said[said.len() - 2];
        assert!(
            report <= 2.0 * is && is <= 2.0 * report,
            "{out}: {report} of {is}: {text}"
        );
        fs::remove_dir_all(place.path("page")).expect("removed");
    }
}

#[test]
fn what_is_there_is_taken_off() {
    let place = Place::new();
    let check = ["check", "everything.toml", "--trials", "40", "--out"];
    let printed = |out: &str| {
        let output = place.run(&[&check[..], &[out]].concat());
        succeeds(&output);
        stdout(&output)
    };
    assert!(!printed("half").contains("there  "));
    place.results("half", &["--trials", "20"]);
    let text = printed("half");
    assert!(line(&text, "there").contains("240 trials"), "{text}");
    // Of another design nothing is.
    let other = place.run(&[&check[..], &["half", "--set", "seed=7"]].concat());
    assert!(!stdout(&other).contains("there  "));
}

/// A row takes more than 200 bytes in its block, so that this takes some 10 PB.
#[test]
fn a_run_that_cannot_fit_is_refused_unless_it_is_to_start_anyway() {
    let place = Place::new();
    let rule = "trials={until = \"e_a\", output = \"iv(2)\", relative_mcse = 1e9, minimum = 4, maximum = 4000000000}";
    let more = ["--set", rule, "--set", "eta=5"];
    let run = [&["run", "everything.toml", "--out", "out"][..], &more].concat();
    place.refuses(&run, &["disk", "are free", "--anyway"]);
    assert!(!place.path("out").exists());
    let check = place.run(&[&["check", "everything.toml"][..], &more].concat());
    succeeds(&check);
    let text = stdout(&check);
    assert!(line(&text, "warning").contains("disk"), "{text}");
    let started = place.run(&[&run[..], &["--anyway"]].concat());
    assert!(started.status.success(), "{}", stderr(&started));
    assert!(contents(&place.path("out")).contains_key("manifest.json"));
}
