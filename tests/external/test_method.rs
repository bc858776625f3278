//! `asobench test-method`: what the protocol allows passes, what is wrong is told with what the program printed.

use super::consent::{asobench, text};
use super::root;
use crate::common::{PYTHON, runs};

/// The output of `test-method` for the worker of examples/workers with something after a part of it, and its exit code.
fn tested(after: &str, more: &str) -> Option<(String, i32)> {
    printed(&["test-method"], after, more)
}

/// The same of another command.
fn printed(command: &[&str], after: &str, more: &str) -> Option<(String, i32)> {
    if !runs(PYTHON) {
        return None;
    }
    let place = tempfile::tempdir().unwrap();
    let path = root().join("examples/workers/least_squares.py");
    let source = std::fs::read_to_string(path).unwrap();
    assert!(source.contains(after));
    let source = source.replace(after, &format!("{after}{more}"));
    std::fs::write(place.path().join("worker.py"), source).unwrap();
    let study = "[settings]\nwindow = 40\neta = 10\n[[methods]]\nname = \"mine\"\nbatch = 32\ntimeout = 20\n\
                 command = [\"python3\", \"worker.py\"]\n";
    std::fs::write(place.path().join("study.toml"), study).unwrap();
    let arguments = [command, &["study.toml", "--allow-commands"]].concat();
    let output = asobench(place.path(), &arguments);
    let code = output.status.code().unwrap();
    Some((text(&output.stdout) + &text(&output.stderr), code))
}

const FOUND: &str = "        found = [least_squares(signal(0, i), signal(1, i), na, nb, nk) for i in range(m)]\n";

#[test]
fn a_record_that_is_declined_is_a_note() {
    let more = "        found = [(1.0, p[1]) if numbers[i] % 3 == 0 else p for i, p in enumerate(found)]\n";
    let Some((text, code)) = tested(FOUND, more) else {
        return;
    };
    assert_eq!(code, 0, "{text}");
    assert!(
        text.contains("note    models: of 16 records 6 declined, 10 with a model"),
        "{text}"
    );
    let noise_free = "note    a record without noise: impulse response";
    assert!(text.contains(noise_free), "{text}");
    assert!(text.contains("trial 1: no model for the trials before it"), "{text}");
    assert!(!text.contains("WRONG") && text.contains("ok      time"), "{text}");
}

#[test]
fn after_what_is_wrong_comes_what_was_printed_and_the_other_checks() {
    let more = "        assert y_is_fine(signal(1, 0))\n";
    let Some((text, code)) = tested(FOUND, more) else {
        return;
    };
    assert_eq!(code, 1, "{text}");
    for part in [
        "WRONG   models: crashed",
        "| NameError: name 'y_is_fine' is not defined",
        "worker.py\", line",
        "WRONG   odd records: NaN: crashed",
        "WRONG   time",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

/// Models that differ from message to message, with the size of a batch, or from the plant where there is no noise.
#[test]
fn wrong_models_are_told() {
    let changed = |by: &str| format!("        found = [(s, [x + {by} for x in p]) for s, p in found]\n");
    for (by, part) in [
        (
            "int.from_bytes(os.urandom(4), 'big') * 1e-15",
            "WRONG   the same batch twice",
        ),
        ("1e-9 * m", "WRONG   other batch sizes"),
        ("1e-4", "WRONG   a record without noise"),
    ] {
        let Some((text, code)) = tested(FOUND, &changed(by)) else {
            return;
        };
        assert_eq!(code, 1, "{text}");
        assert!(text.contains(part) && text.matches("ok  ").count() >= 2, "{text}");
    }
}

#[test]
fn a_batch_that_takes_more_than_half_of_its_time() {
    let command = ["test-method", "--set", "methods.0.timeout=3"];
    let more = "        __import__('time').sleep(1.7 if m > 16 else 0)\n";
    let Some((text, code)) = printed(&command, FOUND, more) else {
        return;
    };
    assert_eq!(code, 1, "{text}");
    assert!(
        text.contains("WRONG   time") && text.matches("WRONG").count() == 1,
        "{text}"
    );
}

#[test]
fn keys_that_the_text_does_not_name_are_ignored() {
    for after in ["\"deterministic\": True", "\"bytes\": 8 * len(blocks)"] {
        let Some((text, code)) = tested(after, ", \"more\": [1]") else {
            return;
        };
        assert_eq!(code, 0, "{text}");
    }
}

#[test]
#[ignore = "takes minutes: cargo test --release --test it external:: -- --ignored"]
fn the_first_ready_may_take_two_minutes() {
    let late = |seconds: u32| {
        let more = format!("        __import__('time').sleep({seconds})\n");
        let command = ["run", "--trials", "1", "--set", "methods.0.timeout=1"];
        printed(&command, "        hello = head\n", &more).unwrap()
    };
    let (text, code) = late(100);
    assert_eq!(code, 0, "{text}");
    let (text, code) = late(125);
    assert_eq!(code, 2, "{text}");
    assert!(text.contains("is not ready after 120 s"), "{text}");
}

#[test]
fn a_program_that_does_not_start_shows_its_error() {
    let Some((text, code)) = tested("import", " import") else {
        return;
    };
    assert_eq!(code, 2, "{text}");
    assert!(
        text.contains("| SyntaxError") && text.contains("worker.py\", line"),
        "{text}"
    );
}

#[test]
fn a_run_warns_early_of_a_program_that_answers_nothing() {
    let fails = "        raise ValueError('not yet written')\n";
    let run = ["run", "--trials", "8", "--threads", "1"];
    let Some((text, code)) = printed(&run, FOUND, fails) else {
        return;
    };
    assert_eq!(code, 0, "{text}");
    for part in [
        "warning: method mine: no batch was answered in 3 attempts; the last: crashed: the process ended with exit \
         status 1",
        "| ValueError: not yet written",
        "test-method FILE tests the program",
        "mine: crashed 8",
    ] {
        assert_eq!(text.matches(part).count(), 1, "{part}: {text}");
    }
}
