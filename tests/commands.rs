//! Habits of a command line: version, completions, colour, several files at once, the page in the browser.

use crate::common::{PROGRAM, asobench_in, done_in, stderr, stdout};
use std::path::Path;
use std::process::{Command, Output};

fn asobench(folder: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder);
    for name in ["NO_COLOR", "CLICOLOR_FORCE"] {
        command.env_remove(name);
    }
    command
}

fn study(folder: &Path, name: &str) {
    let text = "trials = 20\nmeasures = [\"e_a\"]\n[settings]\nwindow = 98\n\
                [[claims]]\nid = \"W\"\ntest = { value = \"e_a\", of = \"iv(4)\", below = 100 }\n";
    std::fs::write(folder.join(name), text).expect("a file");
}

#[test]
fn the_version_says_of_which_source_and_for_which_instructions() {
    let output = asobench(Path::new(".")).arg("--version").output().expect("it runs");
    let text = stdout(&output);
    let expected = concat!("asobench ", env!("CARGO_PKG_VERSION"), " (");
    assert!(text.starts_with(expected), "{text}");
    let isa = ["avx512)", "avx2)", "portable)"];
    assert!(isa.iter().any(|isa| text.trim_end().ends_with(isa)), "{text}");
}

#[test]
fn completions_know_every_command() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = asobench(Path::new("."))
            .args(["completions", shell])
            .output()
            .expect("it runs");
        let text = stdout(&output);
        for word in ["study-from", "test-method", "--detrend"] {
            assert!(
                output.status.success() && text.contains(word.trim_start_matches('-')),
                "{shell} {word}"
            );
        }
    }
    let output = asobench(Path::new("."))
        .args(["completions", "tcsh"])
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn every_command_has_a_manual_page() {
    let page = |words: &[&str]| done_in(Path::new("."), &[&["completions", "--manual"], words].concat());
    let whole = stdout(&page(&[]));
    let listed = whole
        .lines()
        .filter_map(|line| line.strip_prefix("asobench\\-")?.strip_suffix("(1)"));
    let commands: Vec<String> = listed.map(|name| name.replace('\\', "")).collect();
    assert!(commands.len() > 20, "{whole}");
    for command in &commands {
        let text = stdout(&page(&[command]));
        assert!(text.contains(&format!(".TH asobench-{command} 1")), "{command}: {text}");
    }
    let other = asobench_in(Path::new("."), &["completions", "--manual", "nothing"]);
    assert!(stderr(&other).contains("--manual nothing: expected"), "{other:?}");
}

#[test]
fn verdicts_have_colour_where_that_is_wanted() {
    let folder = tempfile::tempdir().expect("a folder");
    study(folder.path(), "a.toml");
    let run = |names: &[(&str, &str)]| {
        let mut command = asobench(folder.path());
        command.args(["run", "a.toml"]).envs(names.iter().copied());
        stdout(&command.output().expect("it runs"))
    };
    let plain = run(&[]);
    assert!(plain.contains("W  holds") && !plain.contains('\x1b'), "{plain}");
    let forced = [("CLICOLOR_FORCE", "1")];
    let coloured = run(&forced);
    assert!(coloured.contains("W  \x1b[32mholds\x1b[0m"), "{coloured}");
    assert_eq!(coloured.replace("\x1b[32m", "").replace("\x1b[0m", ""), plain);
    assert_eq!(run(&[forced[0], ("NO_COLOR", "1")]), plain);
}

#[test]
fn several_files_run_one_after_the_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    for name in ["a.toml", "b.toml"] {
        study(path, name);
    }
    let output = asobench(path)
        .args(["run", "a.toml", "b.toml"])
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", stderr(&output));
    for name in ["a", "b"] {
        assert!(path.join("results").join(name).join("summary.json").is_file());
    }
    std::fs::create_dir(path.join("other")).expect("a folder");
    study(&path.join("other"), "a.toml");
    std::fs::write(path.join("bad.toml"), "trials = 0\n").expect("a file");
    study(path, "new.toml");
    for (arguments, part) in [
        (["new.toml", "bad.toml"].as_slice(), "bad.toml"),
        (&["a.toml", "other/a.toml"], "results/a"),
        (&["a.toml", "b.toml", "--out", "x"], "--out"),
    ] {
        let output = asobench(path).arg("run").args(arguments).output().expect("it runs");
        let line = stderr(&output);
        assert!(output.status.code() == Some(2) && line.contains(part), "{line}");
        assert_eq!(line.lines().count(), 1, "{line}");
    }
    // Nothing ran before the mistake was found.
    assert!(!path.join("results/new").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn a_report_is_opened() {
    use crate::common::executable;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    study(path, "a.toml");
    asobench(path).args(["run", "a.toml"]).output().expect("it runs");
    executable(&path.join("xdg-open"), "#!/bin/sh\necho \"$1\" > opened\n");
    let paths = format!("{}:/usr/bin:/bin", path.display());
    let report = |paths: &str| {
        let mut command = asobench(path);
        command.args(["report", "results/a", "--open"]).env("PATH", paths);
        command.output().expect("it runs")
    };
    assert!(report(&paths).status.success());
    let opened = std::fs::read_to_string(path.join("opened")).expect("it was opened");
    assert_eq!(opened.trim_end(), "results/a/report.html");
    let output = report("/nowhere");
    let line = stderr(&output);
    assert!(
        output.status.code() == Some(1) && line.contains("--open: xdg-open"),
        "{line}"
    );
}

#[test]
fn a_continuous_study_begins_with_a_template() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let new = asobench(path)
        .args(["new", "mine", "--continuous"])
        .output()
        .expect("it runs");
    assert!(new.status.success(), "{}", stderr(&new));
    let run = asobench(path)
        .args(["run", "mine.toml", "--quick"])
        .output()
        .expect("it runs");
    let text = stdout(&run);
    assert!(
        run.status.success() && text.contains("proposed"),
        "{text}{}",
        stderr(&run)
    );
    // A key of the other kind is answered by those of this one.
    let file = std::fs::read_to_string(path.join("mine.toml")).expect("a file");
    let wrong = file.replace("level = [0.1, 0.3]", "amplitude = 0.1");
    std::fs::write(path.join("wrong.toml"), wrong).expect("a file");
    let output = asobench(path).args(["run", "wrong.toml"]).output().expect("it runs");
    let line = stderr(&output);
    assert!(
        line.contains("amplitude") && line.contains("level, frequency"),
        "{line}"
    );
}

/// Text, JSON and page have the same numbers, in the unit of the file where doubles hold their squares. 2^-166 is
/// 1.07e-50.
fn tells_results_in_the_unit_of_the_file(path: &Path, estimate: &dyn Fn(f64) -> Output) {
    let told = |power: i32| {
        let output = estimate(2.0_f64.powi(power));
        let json: serde_json::Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        let output = asobench(path)
            .args(["estimate", "r.csv", "--order", "2", "--detrend", "mean"])
            .args(["--estimator", "arx,oe,riv,bj", "--details"])
            .output()
            .expect("it runs");
        let page = std::fs::read_to_string(path.join("r.html")).expect("a page");
        (json, stdout(&output), page)
    };
    let number = |json: &serde_json::Value, pointer: &str| {
        json.pointer(pointer)
            .and_then(serde_json::Value::as_f64)
            .expect("a number")
    };
    let (first, ..) = told(0);
    for (power, unit) in [(-166, 0), (166, 0), (-450, -450)] {
        let (json, text, page) = told(power);
        let scale = 2.0_f64.powi(power - unit);
        for (pointer, degree) in [
            ("/estimates/0/noise_variance", 2),
            ("/estimates/0/loss", 2),
            ("/estimates/0/x0/1", 1),
            ("/estimates/0/observer/x_last/0", 1),
            ("/estimates/0/residuals/rss", 2),
            ("/estimates/0/residuals/R_eu/30", 2),
            ("/estimates/0/residuals/P1", 4),
            ("/estimates/0/residuals/bound_R_eu_99", 2),
        ] {
            let ratio = number(&json, pointer) / number(&first, pointer) / scale.powi(degree);
            assert!(unit != 0 || (ratio - 1.0).abs() < 1e-9, "2^{power}: {pointer} {ratio}");
        }
        let variance = number(&json, "/estimates/0/noise_variance");
        let line = text.lines().find(|line| line.contains("noise variance"));
        let said = line
            .and_then(|line| line.split_whitespace().last())
            .expect("a variance");
        let said: f64 = said.parse().expect("a number");
        assert!((said / variance - 1.0).abs() < 1e-5, "{said} {variance}");
        let shown = format!("{said:e}");
        assert!(unit != 0 || page.contains(&shown), "no {shown}");
        for output in [&text, &page] {
            assert_eq!(output.contains("beyond doubles"), unit != 0, "2^{power}");
        }
        assert_eq!(number(&json, "/unit") != 1.0, unit != 0);
    }
}

/// A record in any unit has the same model, standard errors and FIT; one whose squares cannot be told is refused.
#[test]
fn estimates_do_not_depend_on_the_unit() {
    let place = tempfile::tempdir().expect("a folder");
    let path = place.path();
    let record = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/record.csv");
    let text = std::fs::read_to_string(record).expect("a record");
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    let samples: Vec<[f64; 2]> = lines
        .map(|line| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            [cells[cells.len() - 2], cells[cells.len() - 1]]
        })
        .collect();
    let estimate = |units: [f64; 2]| {
        let rows = samples
            .iter()
            .map(|[u, y]| format!("{:e},{:e}\n", u * units[0], y * units[1]));
        let text = "u,y\n".to_owned() + &rows.collect::<String>();
        std::fs::write(path.join("r.csv"), text).expect("written");
        asobench(path)
            .args([
                "estimate",
                "r.csv",
                "--order",
                "2",
                "--detrend",
                "mean",
                "--format",
                "json",
            ])
            .args(["--estimator", "arx,oe,riv,bj", "--report", "r.html"])
            .output()
            .expect("it runs")
    };
    let numbers = |scale: f64| -> Vec<f64> {
        let output = estimate([scale; 2]);
        assert_eq!(output.status.code(), Some(0), "{scale:e}: {}", stderr(&output));
        let json: serde_json::Value = serde_json::from_str(&stdout(&output)).expect("JSON");
        let unit = json["unit"].as_f64().unwrap();
        let mut found = Vec::new();
        for estimate in json["estimates"].as_array().unwrap() {
            for list in [
                &estimate["model"]["A"],
                &estimate["model"]["B"],
                &estimate["model"]["F"],
                &estimate["se"],
            ] {
                found.extend(list.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()));
            }
            found.push(estimate["noise_variance"].as_f64().unwrap().sqrt() * (unit / scale));
            found.push(estimate["residuals"]["ljung_box"].as_f64().unwrap());
        }
        found
    };
    let expected = numbers(1.0);
    for scale in [1e-150, 1e-50, 1e-19, 1e20, 1e100, 1e150] {
        let found = numbers(scale);
        assert_eq!(found.len(), expected.len());
        for (a, b) in expected.iter().zip(&found) {
            assert!((a - b).abs() <= 1e-6 * a.abs().max(1e-3), "{scale:e}: {a} {b}");
        }
    }
    tells_results_in_the_unit_of_the_file(path, &|scale| estimate([scale; 2]));
    for (units, part) in [
        ([1e-300, 1e-300], "expected 1e-290 to 1e300: choose another unit"),
        ([1.0, 1e120], "expected at most 1e100 times as much"),
        ([1e120, 1.0], "expected at most 1e100 times as much"),
    ] {
        let output = estimate(units);
        assert_eq!(output.status.code(), Some(2), "{units:?}");
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    }
}
