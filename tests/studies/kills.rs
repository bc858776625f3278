//! A run that was killed or stopped at any moment goes on by the same command, to the same bits.

use super::{Contents, Place, assert_same, blocks, contents, stderr, wait_until};
use std::process::Command;
use std::time::{Duration, Instant};

/// Numbers from a seed: Knuth's linear congruential generator, its upper bits.
struct Moments(u64);

impl Moments {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }
}

/// How many kills: `ASOBENCH_KILLS`, by default 12.
fn kills() -> usize {
    let given = std::env::var("ASOBENCH_KILLS").ok();
    given.map_or(12, |count| count.parse().expect("a number of kills"))
}

/// Runs `arguments` in `out` with kills at random moments up to its end; returns how many there were.
fn run_with_kills(place: &Place, arguments: &[&str], longest: u64, moments: &mut Moments, limit: usize) -> usize {
    let mut killed = 0;
    loop {
        let mut child = place.start(arguments);
        if killed < limit {
            std::thread::sleep(Duration::from_millis(moments.below(longest)));
            if child.try_wait().expect("a child").is_none() {
                child.kill().expect("killed");
                child.wait().expect("ended");
                killed += 1;
                continue;
            }
        }
        let output = child.wait_with_output().expect("ended");
        assert_eq!(
            output.status.code(),
            Some(0),
            "after {killed} kills: {}",
            stderr(&output)
        );
        return killed;
    }
}

#[test]
fn killed_runs_go_on_to_the_same_bits() {
    let place = Place::new();
    let mut moments = Moments(2023);
    let mut left = kills();
    let study = |store: &'static str, out: &'static str| -> Vec<&str> {
        vec![
            "run",
            "everything.toml",
            "--out",
            out,
            "--trials",
            "600",
            "--block",
            "40",
            "--set",
            store,
        ]
    };
    let cases = [
        ("store=trials", "trials", "ref-t"),
        ("store=summaries", "summaries", "ref-s"),
    ];
    let references: Vec<(Contents, u64)> = cases
        .iter()
        .map(|(store, _, reference)| {
            let begin = Instant::now();
            let output = place.run(&study(store, reference));
            assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
            (contents(&place.path(reference)), begin.elapsed().as_millis() as u64)
        })
        .collect();
    let mut round = 0;
    while left > 0 {
        let (store, out, _) = cases[round % 2];
        let (expected, whole) = &references[round % 2];
        // At most as many as may be needed to get to the end, so that the last steps are hit too.
        let killed = run_with_kills(
            &place,
            &study(store, out),
            whole + whole / 4 + 20,
            &mut moments,
            left.min(6),
        );
        left -= killed;
        assert_same(
            &contents(&place.path(out)),
            expected,
            &format!("{store}, {killed} kills, {left} left"),
        );
        std::fs::remove_dir_all(place.path(out)).expect("removed");
        round += 1;
    }
}

/// SIGTERM and SIGINT: exit code 130 within 3 s, one line that says how to go on; then the same command does.
#[test]
fn stopped_runs_say_how_to_go_on() {
    let place = Place::new();
    let arguments = ["run", "everything.toml", "--trials", "1500", "--block", "50", "--out"];
    let with = |out: &'static str| [&arguments[..], &[out]].concat();
    let whole = place.run(&with("whole"));
    assert_eq!(whole.status.code(), Some(0), "{}", stderr(&whole));
    for signal in ["-TERM", "-INT"] {
        let child = place.start(&with("stopped"));
        wait_until(|| !blocks(&place.path("stopped")).is_empty());
        let begin = Instant::now();
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
        let output = child.wait_with_output().expect("the program ends");
        assert!(begin.elapsed() < Duration::from_secs(3));
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(130), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(
            message.contains("of 18000 trials") && message.contains("the same command resumes"),
            "{message}"
        );
        assert!(contents(&place.path("stopped")).is_empty(), "no results of a part");
        let resumed = place.run(&with("stopped"));
        assert_eq!(resumed.status.code(), Some(0), "{}", stderr(&resumed));
        assert_same(
            &contents(&place.path("stopped")),
            &contents(&place.path("whole")),
            signal,
        );
        std::fs::remove_dir_all(place.path("stopped")).expect("removed");
    }
}

/// One trial that takes longer than anybody waits does not hold up a stop for more than itself: long spans are
/// left between two trials.
#[test]
fn long_spans_are_left_between_trials() {
    let place = Place::new();
    let arguments = [
        "run",
        "everything.toml",
        "--trials",
        "4000000",
        "--block",
        "4000000",
        "--anyway",
        "--out",
        "out",
    ];
    let child = place.start(&arguments);
    std::thread::sleep(Duration::from_millis(500));
    let begin = Instant::now();
    let sent = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
    let output = child.wait_with_output().expect("the program ends");
    assert!(begin.elapsed() < Duration::from_secs(3));
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(!blocks(&place.path("out")).is_empty(), "what was computed is kept");
}

/// A study whose times are measured; the times are of its design, and measured once.
const TIMED: &str = "trials = 2\ntiming = true\n[settings]\neta = 0\nwindow = 18\n\
                     [[methods]]\nsolver = [\"partitioned\", \"lu\"]\niterations = 1";

fn times(place: &Place) -> Vec<u8> {
    std::fs::read(place.path("out/timing/times.json")).expect("the times")
}

#[test]
fn times_are_measured_once() {
    let place = Place::new();
    place.write("timed.toml", TIMED.as_bytes());
    let run = ["run", "timed.toml", "--out", "out"];
    let again = |part: &str| {
        let output = place.run(&run);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(0), "{message}");
        assert!(message.contains(part), "{message}");
        times(&place)
    };
    let first = again("measuring times");
    assert!(again("times are there already") == first);
    // Times of another design, or half of a file, are not this study's.
    let text = String::from_utf8(first.clone()).expect("UTF-8");
    let other = text.replacen("\"design\":\"", "\"design\":\"0", 1);
    assert!(other != text);
    for damaged in [other.as_str(), &text[..text.len() / 2], ""] {
        place.write("out/timing/times.json", damaged.as_bytes());
        assert!(again("measuring times") != damaged.as_bytes());
    }
    // More trials change no time.
    let before = times(&place);
    let output = place.run(&[&run[..], &["--trials", "3"]].concat());
    assert!(stderr(&output).contains("times are there already"));
    assert!(times(&place) == before);
    assert_eq!(
        std::fs::read_dir(place.path("out/timing")).expect("a folder").count(),
        1
    );
}

/// A signal while times are measured ends that between two measurements; the results stay.
#[test]
fn measuring_times_can_be_stopped() {
    let place = Place::new();
    let text = TIMED
        .replace("eta = 0", "eta = { linspace = [0, 10, 1000] }")
        .replace("trials = 2", "trials = 1");
    place.write("timed.toml", text.as_bytes());
    let child = place.start(&["run", "timed.toml", "--out", "out"]);
    wait_until(|| place.path("out/manifest.json").exists());
    let begin = Instant::now();
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
    let output = child.wait_with_output().expect("the program ends");
    assert!(begin.elapsed() < Duration::from_secs(3));
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert!(
        message.contains("times were measured") && message.contains("same command"),
        "{message}"
    );
    assert!(!place.path("out/timing").exists());
    assert_eq!(contents(&place.path("out")).len(), 3, "the results are there");
}

/// A second signal does not wait for the trial that is under way: one of thousand passes over a long window.
#[test]
fn a_second_signal_ends_at_once() {
    let place = Place::new();
    let text = "trials = 1000\n[settings]\nwindow = 1000000\n[[methods]]\niterations = 1000\nreport = [1000]";
    place.write("long.toml", text.as_bytes());
    let mut child = place.start(&["run", "long.toml", "--out", "out", "--threads", "1"]);
    wait_until(|| place.path("out/blocks/design.json").exists());
    std::thread::sleep(Duration::from_millis(500));
    let signal = || {
        let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
    };
    let begin = Instant::now();
    signal();
    std::thread::sleep(Duration::from_millis(200));
    signal();
    let status = child.wait().expect("the program ends");
    assert!(begin.elapsed() < Duration::from_secs(2));
    assert_eq!(status.code(), Some(130));
    assert!(contents(&place.path("out")).is_empty() && blocks(&place.path("out")).is_empty());
}
