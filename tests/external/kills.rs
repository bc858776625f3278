//! Kills of either side: nothing stays behind, and the same command ends with the same bits.

use super::chaos::{LONG_PERIOD, all_gone, study};
use super::{list, root};
use crate::common::PROGRAM;
use crate::common::{PYTHON, runs};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn start(folder: &Path, out: &str, threads: usize) -> Child {
    start_in(folder, out, threads, None)
}

/// Starts a run with another folder for temporary files.
fn start_in(folder: &Path, out: &str, threads: usize, temporary: Option<&Path>) -> Child {
    let mut command = Command::new(PROGRAM);
    if let Some(temporary) = temporary {
        command.env("TMPDIR", temporary);
    }
    command
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
        surroundings.windows(mark.len()).any(|part| part == mark.as_bytes())
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
    let killed = Command::new("kill").args(["-KILL", &process.to_string()]).status();
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
    if !runs(PYTHON) {
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

/// A worker that does not end with its requests, which are its only sign that the run has ended.
const DEAF: &str = "import sys, time\n\
    __file__ = sys.argv[1]\n\
    try:\n    exec(open(sys.argv[1]).read())\n\
    finally:\n    time.sleep(600)\n";

/// The guard is killed first, then the run: another guard has taken its place.
#[test]
fn no_worker_stays_where_the_guard_is_killed_too() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    // A path with a line end: what the guard is told must hold it.
    let temporary = folder.join("tmp\nx");
    std::fs::create_dir(&temporary).unwrap();
    let worker = root().join("tests/external/slow.py");
    std::fs::write(folder.join("deaf.py"), DEAF).unwrap();
    let command = list(&["python3", "deaf.py", &worker.display().to_string()]);
    let study = format!(
        "trials = 100000\n[settings]\nwindow = 40\neta = 10\n[[methods]]\nname = \"mine\"\nbatch = 8\n\
         command = {command}\n"
    );
    std::fs::write(folder.join("study.toml"), study).unwrap();
    let guards = |of: u32| -> Vec<i32> {
        let list = Command::new("ps")
            .args(["-o", "pid=,args=", "--ppid", &of.to_string()])
            .output();
        let text = String::from_utf8_lossy(&list.unwrap().stdout).into_owned();
        let lines = text.lines().filter(|line| line.contains("guard-workers"));
        lines
            .map(|line| line.split_whitespace().next().unwrap().parse().unwrap())
            .collect()
    };
    let mut run = start_in(folder, "out", 2, Some(&temporary));
    wait_for("no block", || blocks(&folder.join("out")) > 0);
    let first = guards(run.id());
    assert_eq!(first.len(), 1);
    kill(first[0]);
    wait_for("no other guard", || {
        guards(run.id()).iter().any(|guard| *guard != first[0])
    });
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(workers(run.id()).len(), 2);
    run.kill().unwrap();
    run.wait().unwrap();
    wait_for("workers are left", || workers(run.id()).is_empty());
}

/// A run that is killed while a worker starts leaves a folder with two pipes, which the next one removes: those of a
/// run that is alive stay, and so does anything else.
#[test]
fn pipes_of_a_killed_run_are_removed_by_the_next_one() {
    if !runs(PYTHON) {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let temporary = folder.join("tmp");
    std::fs::create_dir(&temporary).unwrap();
    let study = |command: &str| {
        let text = format!(
            "trials = 8\n[settings]\nwindow = 40\neta = 10\n[[methods]]\nname = \"mine\"\nbatch = 8\ncommand = \
             {command}\n"
        );
        std::fs::write(folder.join("study.toml"), text).unwrap();
    };
    let left = || {
        let names = std::fs::read_dir(&temporary).unwrap().flatten();
        let mut names: Vec<String> = names.map(|e| e.file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    // It never opens its pipes.
    study(&list(&["sleep", "600"]));
    let mut killed = start_in(folder, "out", 1, Some(&temporary));
    wait_for("no pipes", || left().len() == 1);
    let mut alive = start_in(folder, "other", 1, Some(&temporary));
    wait_for("no other pipes", || left().len() == 2);
    killed.kill().unwrap();
    killed.wait().unwrap();
    let of_the_killed = format!("asobench-{}-0", killed.id());
    assert!(left().contains(&of_the_killed));
    // With a name of ours, but something else in it.
    std::fs::create_dir_all(temporary.join("asobench-1-0/work")).unwrap();
    study(&list(&[
        "python3",
        &root().join("examples/workers/least_squares.py").display().to_string(),
    ]));
    assert!(start_in(folder, "third", 1, Some(&temporary)).wait().unwrap().success());
    let expected = ["asobench-1-0".to_owned(), format!("asobench-{}-0", alive.id())];
    assert_eq!(left(), expected);
    alive.kill().unwrap();
    alive.wait().unwrap();
    wait_for("workers are left", || workers(alive.id()).is_empty());
}

/// The worker that goes wrong, in ten thousand trials: memory stays as it is, and kills of both sides change no bit.
#[test]
#[ignore = "takes minutes: cargo test --release --test it external:: -- --ignored"]
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
            blocks(&folder.join("killed")) > before + 20 * number || run.try_wait().unwrap().is_some()
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
