//! Studies in continuous time: the same bits whatever the threads and the history, and what a file may not say.

use super::{Place, assert_same, stderr, stdout, succeeds};

/// Random disturbances, every observer, trials stored.
const COURSES: &str = r#"
trials = 60
store = "trials"
measures = ["rms_x", "e_theta", "e_theta_rms", "t_reach", "t_settle",
            "t_frozen", "adaptation", "excitation", "dbar_max", "step_error", "step_order"]
compare = [["proposed", "gradient"]]

[continuous]
until = 6
scored_from = 2
filters = [1]
error_limit = 0.1
trace_every = 0.5

[settings]
disturbance = ["white", "square"]
level = [0, 0.4]
phase = "random"
noise_hold = 0.05
step = 0.05

[[observers]]
observer = "luenberger"
gain = [2, 3.2]

[[observers]]
observer = "kalman-bucy"
measurement = 0.05
prior = 4

[[observers]]
observer = "gradient"
gains = [1]

[[observers]]
observer = "proposed"
gains = [1e11, 1e13]
"#;

fn json(place: &Place, name: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(place.path(name)).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn place() -> Place {
    let place = Place::new();
    place.write("courses.toml", COURSES.as_bytes());
    place
}

fn run(place: &Place, out: &str, more: &[&str]) -> super::Contents {
    let mut arguments = vec!["run", "courses.toml", "--out", out];
    arguments.extend(more);
    succeeds(&place.run(&arguments));
    super::contents(&place.path(out))
}

#[test]
fn threads_blocks_and_history_move_no_bit() {
    let place = place();
    let expected = run(&place, "once", &["--threads", "1"]);
    let cut = run(&place, "cut", &["--threads", "2", "--block", "7"]);
    assert_same(&cut, &expected, "blocks");
    run(&place, "grown", &["--trials", "13", "--block", "5"]);
    assert_same(&run(&place, "grown", &[]), &expected, "extension");
    let other = run(&place, "other", &["--set", "seed=6"]);
    assert!(other["summary.json"] != expected["summary.json"]);
}

#[test]
fn any_trial_can_be_replayed() {
    let place = place();
    run(&place, "out", &[]);
    let replay = place.run(&["replay", "out", "1:37"]);
    succeeds(&replay);
    let text = stdout(&replay);
    assert!(text.contains("These rows equal, bit for bit"), "{text}");
    assert!(
        text.contains("Observer proposed") && text.contains("theta_hat_2"),
        "{text}"
    );
    let json = stdout(&place.run(&["replay", "out", "1:37", "--format", "json"]));
    assert!(json.contains("\"equal_to_stored\": true"));
    place.refuses(&["replay", "out", "1:0", "--data", "x.csv"], &["--data", "no record"]);
}

/// Level 0: nothing is learnt by the proposed estimator, and theta stays where it starts; the gradient learns.
#[test]
fn without_a_disturbance() {
    let place = place();
    run(&place, "out", &["--trials", "2"]);
    let summary = json(&place, "out/summary.json");
    let output = |name: &str| {
        let outputs = summary["cells"][0]["outputs"].as_array().unwrap();
        let output = outputs.iter().find(|output| output["estimator"] == name).unwrap();
        output["figures"]["e_theta"]["mean"]["value"].as_f64().unwrap()
    };
    assert!((output("proposed") - 1.0).abs() < 1e-9);
    assert!(output("gradient") < 1e-3);
}

/// Without phases and white numbers, at level 0 too, a cell has one trial, whatever is asked for,
/// and says so.
#[test]
fn a_deterministic_cell_has_one_trial() {
    let place = place();
    let trials = |summary: &serde_json::Value| -> Vec<(u64, bool)> {
        let cells = summary["cells"].as_array().unwrap().iter();
        cells
            .map(|cell| {
                let outputs = cell["outputs"].as_array().unwrap().iter();
                let trials = cell["trials"].as_u64().unwrap();
                assert!(outputs.clone().all(|output| output["outcomes"]["trials"] == trials));
                (trials, cell.get("deterministic") == Some(&true.into()))
            })
            .collect()
    };
    // White and square, at the levels 0 and 0.4.
    run(&place, "out", &[]);
    let summary = json(&place, "out/summary.json");
    let mixed = [(1, true), (60, false), (1, true), (60, false)];
    assert_eq!(trials(&summary), mixed);
    assert_eq!(summary["cells"][0]["outputs"], summary["cells"][2]["outputs"]);
    let manifest = json(&place, "out/manifest.json");
    assert_eq!(manifest["trials"], serde_json::json!([1, 60, 1, 60]));
    let checked = stdout(&place.run(&["check", "courses.toml"]));
    assert!(checked.contains("60 in each cell, but 1 in the 2 without random numbers"));
    let replay = stdout(&place.run(&["replay", "out", "2:0"]));
    assert!(replay.contains("These rows equal, bit for bit"), "{replay}");

    let until = "trials = { until = \"e_theta\", output = \"gradient\", \
                 relative_mcse = 1e-9, minimum = 2, maximum = 4 }";
    place.write("courses.toml", COURSES.replace("trials = 60", until).as_bytes());
    run(&place, "until", &[]);
    let summary = json(&place, "until/summary.json");
    assert_eq!(trials(&summary), [(1, true), (4, false), (1, true), (4, false)]);

    let fixed = COURSES.replace("phase = \"random\"", "phase = 0.5");
    place.write("courses.toml", fixed.as_bytes());
    run(&place, "fixed", &["--trials", "3"]);
    let summary = json(&place, "fixed/summary.json");
    assert_eq!(trials(&summary), [(1, true), (3, false), (1, true), (1, true)]);
}

#[test]
fn what_cannot_be() {
    let place = place();
    for (old, new, parts) in [
        ("until = 6", "until = 0", ["continuous.until", "above 0"]),
        (
            "scored_from = 2",
            "scored_from = 6",
            ["continuous.scored_from", "less than 'until'"],
        ),
        (
            "error_limit = 0.1",
            "error_limit = -1",
            ["continuous.error_limit", "above 0"],
        ),
        (
            "filters = [1]",
            "filters = [-1]",
            ["filters in [continuous]: expected positive", "-1"],
        ),
        (
            "filters = [1]",
            "filters = [1, 2]",
            ["filters in [continuous]: expected 1 number", "2"],
        ),
        ("gains = [1]", "gains = [0]", ["gains: expected positive", "0"]),
        (
            "gains = [1]",
            "gains = [1, 2, 3]",
            ["observers[2] (gradient)", "expected 2 numbers"],
        ),
        (
            "gains = [1]",
            "gains = [1]\npole = 2",
            ["unknown key 'pole'", "expected gains"],
        ),
        (
            "gain = [2, 3.2]",
            "poles = \"-1+i\"",
            ["observers[0] (luenberger)", "conjugate"],
        ),
        (
            "gain = [2, 3.2]",
            "",
            ["observers[0] (luenberger)", "'gain', 'poles' and 'bandwidth'"],
        ),
        ("prior = 4", "", ["observers[1] (kalman-bucy)", "'prior'"]),
        (
            "prior = 4",
            "process = -1",
            ["observers[1] (kalman-bucy)", "expected an intensity"],
        ),
        ("step = 0.05", "step = 0", ["step: 0", "above 0"]),
        ("step = 0.05", "step = 7", ["step of 7 s", "horizon of 6 s"]),
        ("step = 0.05", "step = 1e-12", ["steps", "at most 1e7"]),
        ("noise_hold = 0.05", "noise_hold = 1e-9", ["noise_hold", "holds"]),
        (
            "\"white\", \"square\"",
            "\"squares\"",
            ["disturbance", "did you mean 'square'?"],
        ),
        ("[settings]", "[settings]\nwindow = 98", ["window", "continuous time"]),
        (
            "[settings]",
            "[settings]\nplant = \"bobtsov\"",
            ["plant", "did you mean 'bobtsov2023'?"],
        ),
        ("store = ", "curves = true\nstore = ", ["curves", "continuous time"]),
    ] {
        let text = COURSES.replacen(old, new, 1);
        assert!(text != COURSES, "{old}");
        place.write("wrong.toml", text.as_bytes());
        place.refuses(&["check", "wrong.toml"], &["wrong.toml", parts[0], parts[1]]);
    }
    place.write("wrong.toml", b"[settings]\nlevel = 1");
    place.refuses(&["check", "wrong.toml"], &["level", "discrete time"]);
}

#[test]
fn plants_and_signals_of_files() {
    let place = place();
    let plant = "\n[continuous_plants.mine]\na = [[-1, 0], [0, -2]]\nb = [1, 1]\nc = [1, 0]\nx0 = [1, 1]\n";
    let text = COURSES.replace("[settings]", "[settings]\nplant = \"mine\"") + plant;
    place.write("wrong.toml", text.as_bytes());
    place.refuses(
        &["check", "wrong.toml"],
        &["continuous_plants.mine", "rank 1", "order is 2"],
    );

    let signal = "\n[signals.recorded]\nwaves = [{ wave = \"file\", file = \"delta.csv\", hold = \"linear\" }]\n";
    let text = COURSES.replace("\"white\", \"square\"", "\"recorded\"") + signal;
    place.write("recorded.toml", text.as_bytes());
    place.refuses(&["check", "recorded.toml"], &["signals.recorded.waves[0]", "delta.csv"]);
    place.write("delta.csv", b"t,delta\n0,0.1\n2,0.2\n4,0.1\n");
    place.refuses(&["check", "recorded.toml"], &["disturbance", "4 s", "6 s"]);
    place.write("delta.csv", b"t,delta\n0,0.1\n2,x\n");
    place.refuses(
        &["check", "recorded.toml"],
        &["delta.csv: line 3", "two finite numbers"],
    );
    place.write("delta.csv", b"t,delta\n0,0.1\n2,0.2\n4,0.1\n6,0\n");
    let done = place.run(&["run", "recorded.toml", "--trials", "1", "--out", "recorded"]);
    succeeds(&done);
    // The manifest holds the samples: the file is not needed any more.
    std::fs::remove_file(place.path("delta.csv")).unwrap();
    let replay = place.run(&["replay", "recorded", "1:0"]);
    assert!(stdout(&replay).contains("bit for bit"), "{}", stderr(&replay));
}

/// A step that is too long is a failure of that trial, counted, and no number of it is used.
#[test]
fn a_step_that_is_too_long_is_a_failure() {
    let place = place();
    let set = ["--set", "continuous.error_limit=1e-6", "--trials", "3"];
    run(&place, "out", &set);
    let summary = json(&place, "out/summary.json");
    let proposed = &summary["cells"][3]["outputs"][3];
    assert_eq!(proposed["outcomes"]["failures"]["step-too-long"], 3);
    assert_eq!(proposed["figures"]["rms_x"]["count"], 0);
    assert_eq!(proposed["figures"]["step_error"]["count"], 0);
    // A more exact observer does not fail.
    assert_eq!(
        summary["cells"][3]["outputs"][1]["outcomes"]["failures"]
            .as_object()
            .unwrap()
            .len(),
        0
    );
}

/// With A = [0 1; -9 0], C = (5, 0) and L = (l_1, l_2) the poles are the roots of `s^2 + 5 l_1 s + 9 + 5 l_2`.
#[test]
fn check_warns_of_an_observer_that_is_not_stable() {
    let place = place();
    let warning = "warning: this observer is not stable";
    let checked = stdout(&place.run(&["check", "courses.toml"]));
    assert!(
        checked.contains("poles of luenberger: -5, -5") && !checked.contains(warning),
        "{checked}"
    );
    let text = COURSES.replacen("gain = [2, 3.2]", "gain = [-1, 3.2]", 1);
    place.write("unstable.toml", text.as_bytes());
    let checked = stdout(&place.run(&["check", "unstable.toml"]));
    // 2.5 +- sqrt(25 - 6.25) i.
    assert!(
        checked.contains("poles of luenberger: 2.5 +- 4.33i") && checked.contains(warning),
        "{checked}"
    );
}

/// The plant has two states.
#[test]
fn a_measure_of_a_state_that_no_plant_has_is_refused() {
    let place = place();
    let text = COURSES.replacen("\"e_theta\", ", "\"rms_x3\", ", 1);
    place.write("wrong.toml", text.as_bytes());
    place.refuses(&["check", "wrong.toml"], &["measures: 'rms_x3'", "at most 'rms_x2'"]);
}
