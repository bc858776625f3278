//! Kills of either side: nothing stays behind, and the same command ends with the same bits.

use super::chaos::{LONG_PERIOD, all_gone, study};
use super::{list, root, runs};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn start(folder: &Path, out: &str, threads: usize) -> Child {
    Command::new(env!("CARGO_BIN_EXE_asobench"))
        .args([
            "run",
            "study.toml",
            "--allow-commands",
            "--threads",
            &threads.to_string(),
            "--block",
            "16",
            "--out",
            out,
        ])
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// The processes that a run of this number started as workers.
fn workers(of: u32) -> Vec<i32> {
    let mark = format!("/asobench-{of}-");
    let entries = std::fs::read_dir("/proc").unwrap().flatten();
    let numbers = entries.filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok());
    let has = |number: &i32| {
        let surroundings = std::fs::read(format!("/proc/{number}/environ")).unwrap_or_default();
        surroundings
            .windows(mark.len())
            .any(|part| part == mark.as_bytes())
    };
    numbers.filter(has).collect()
}

fn wait_for(what: &str, mut done: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !done() {
        assert!(begin.elapsed() < Duration::from_mins(1), "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn kill(process: i32) -> bool {
    let killed = Command::new("kill")
        .args(["-KILL", &process.to_string()])
        .status();
    killed.is_ok_and(|status| status.success())
}

/// The memory of a process, bytes.
fn memory(process: u32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024 * line.split_whitespace().next()?.parse::<u64>().ok()?)
}

fn blocks(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder.join("blocks"));
    entries.map_or(0, |entries| {
        entries
            .flatten()
            .filter(|e| e.path().extension().is_some_and(|x| x == "block"))
            .count()
    })
}

#[test]
fn the_same_bits_after_kills_of_either_side() {
    if !runs(&["python3", "-c", "1"]) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let worker = root().join("tests/external/slow.py");
    let command = list(&["python3", &worker.display().to_string()]);
    let study = format!(
        "trials = 160\nstore = \"trials\"\n[settings]\nwindow = 40\neta = 10\n[[methods]]\nname = \"mine\"\nbatch = 8\n\
         command = {command}\n"
    );
    std::fs::write(folder.join("study.toml"), study).unwrap();
    assert!(start(folder, "whole", 2).wait().unwrap().success());

    // This side is killed as soon as it has stored something.
    let mut run = start(folder, "killed", 2);
    wait_for("no block", || blocks(&folder.join("killed")) > 0);
    assert!(!workers(run.id()).is_empty());
    run.kill().unwrap();
    run.wait().unwrap();
    wait_for("workers are left", || workers(run.id()).is_empty());

    // The other side is killed while the run goes on.
    let mut run = start(folder, "killed", 2);
    let mut kills = 0;
    wait_for("no end", || {
        if kills < 3
            && let [process, ..] = workers(run.id())[..]
            && blocks(&folder.join("killed")) > kills
        {
            kills += usize::from(kill(process));
        }
        run.try_wait().unwrap().is_some()
    });
    assert!(kills > 0 && run.wait().unwrap().success());
    wait_for("workers are left", || workers(run.id()).is_empty());
    for name in ["trials.parquet", "summary.json", "manifest.json"] {
        let content = |out: &str| std::fs::read(folder.join(out).join(name)).unwrap();
        assert!(content("whole") == content("killed"), "{name}");
    }
}

/// The worker that goes wrong, in ten thousand trials: memory stays as it is, and kills of both sides change no bit.
#[test]
#[ignore = "takes minutes: cargo test --release --test external -- --ignored"]
fn the_same_bits_of_chaos_after_kills() {
    /// Workers write ten times as much where nothing is meant to be kept.
    const GROWTH: u64 = 1 << 26;
    const THREADS: usize = 16;
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let processes = folder.join("processes");
    let text = study(&processes, LONG_PERIOD, 5);
    let text = format!("trials = 10000\nstore = \"trials\"\n{text}");
    std::fs::write(folder.join("study.toml"), text).unwrap();

    let mut run = start(folder, "whole", THREADS);
    let mut seen = Vec::new();
    while run.try_wait().unwrap().is_none() {
        seen.extend(memory(run.id()));
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(run.wait().unwrap().success());
    let most = |part: &[u64]| part.iter().max().copied().unwrap();
    let third = seen.len() / 3;
    let (early, late) = (most(&seen[..third]), most(&seen[2 * third..seen.len() - 1]));
    assert!(late < early + GROWTH, "{early} then {late} bytes");

    for number in 0..4 {
        let mut run = start(folder, "killed", THREADS);
        let before = blocks(&folder.join("killed"));
        wait_for("no block", || {
            blocks(&folder.join("killed")) > before + 20 * number
                || run.try_wait().unwrap().is_some()
        });
        for worker in workers(run.id()).into_iter().take(2) {
            kill(worker);
        }
        std::thread::sleep(Duration::from_millis(500));
        run.kill().unwrap();
        run.wait().unwrap();
        wait_for("workers are left", || workers(run.id()).is_empty());
    }
    assert!(start(folder, "killed", THREADS).wait().unwrap().success());
    for name in ["trials.parquet", "summary.json", "manifest.json"] {
        let content = |out: &str| std::fs::read(folder.join(out).join(name)).unwrap();
        assert!(content("whole") == content("killed"), "{name}");
    }
    all_gone(&processes);
}
