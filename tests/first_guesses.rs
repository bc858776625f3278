//! Commands typed first: a part of a study, another seed, results beside each other, words explained, and names that
//! other tools have.

use crate::common::{asobench_in as asobench, done_in as done, stderr, stdout};
use serde_json::Value;
use std::path::Path;

const STUDY: &str = "trials = 30\nmeasures = [\"e_a\", \"e_b\"]\ncompare = [[\"iv(4)\", \"ls\"]]\n\
    [settings]\nwindow = [40, 98]\nnoise = \"white\"\n\
    [[methods]]\nestimator = \"iv\"\n[[methods]]\nestimator = \"arx\"\n\
    [[claims]]\nid = \"W\"\ntest = { ratio = \"e_a\", of = \"iv(4)\", to = \"arx\", below = 100 }\n";

/// The line of an error; what follows it is the command that was meant.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = asobench(folder, arguments);
    let text = stderr(&output);
    let (line, meant) = text.split_once('\n').unwrap_or_default();
    let is_one = meant.is_empty() || meant.starts_with("  try: ") && meant.lines().count() == 1;
    assert!(output.status.code() == Some(2) && is_one, "{arguments:?}: {text}");
    line.to_owned()
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.toml"), STUDY).expect("a file");
    folder
}

fn summary(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path.join("summary.json")).expect("a file")).expect("JSON")
}

/// Records do not depend on methods: a method has the same numbers alone as among others.
#[test]
fn one_method_alone_has_the_numbers_that_it_has_among_others() {
    let folder = folder();
    let at = folder.path();
    done(at, &["run", "s.toml", "--out", "all"]);
    let alone = done(at, &["run", "s.toml", "--method", "ARX", "--out", "one"]);
    let said = stderr(&alone);
    assert!(
        said.contains(
            "left out because they need other methods: the comparison of iv(4) with ls; claim W, which compares with \
             iv(4)"
        ),
        "{said}"
    );
    let [all, one] = ["all", "one"].map(|name| summary(&at.join(name)));
    for cell in 0..2 {
        let outputs = one["cells"][cell]["outputs"].as_array().expect("a list");
        assert_eq!(outputs.len(), 1);
        let among = all["cells"][cell]["outputs"].as_array().expect("a list");
        assert!(among.contains(&outputs[0]), "cell {cell}");
    }
    let line = refused(at, &["run", "s.toml", "--method", "oee"]);
    assert!(
        line.contains("--method oee: unknown method 'oee'") && line.contains("arx"),
        "{line}"
    );
}

#[test]
fn another_seed_and_store_are_keys_of_the_file() {
    let folder = folder();
    let at = folder.path();
    done(
        at,
        &["run", "s.toml", "--seed", "7", "--store", "trials", "--out", "flags"],
    );
    done(
        at,
        &[
            "run",
            "s.toml",
            "--set",
            "seed=7",
            "--set",
            "store=trials",
            "--out",
            "keys",
        ],
    );
    for file in ["summary.json", "trials.parquet"] {
        let [flags, keys] = ["flags", "keys"].map(|name| std::fs::read(at.join(name).join(file)).expect("a file"));
        assert!(flags == keys, "{file}");
    }
    let line = refused(at, &["run", "s.toml", "--seed", "7", "--confirm", "9"]);
    assert!(line.contains("--seed") && line.contains("--confirm"), "{line}");
}

#[test]
fn results_are_compared_by_experiment_and_by_cell() {
    let folder = folder();
    let at = folder.path();
    done(at, &["run", "s.toml", "--out", "a"]);
    done(
        at,
        &["run", "s.toml", "--seed", "7", "--set", "window=98", "--out", "b"],
    );
    let text = stdout(&done(at, &["compare", "a", "b", "--measure", "e_b"]));
    assert!(
        text.contains("seed: 2023 -> 7") && text.contains("settings.window: [40,98] -> 98"),
        "{text}"
    );
    // One cell is common, with five outputs of iv and one of arx.
    let rows = text.lines().filter(|line| line.starts_with("N = 98"));
    let all: Vec<&str> = rows.collect();
    assert!(all.len() == 6 && !text.contains("N = 40"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let same = stdout(&done(at, &["compare", "a", "a"]));
    assert!(same.starts_with("a and a: the same experiment."), "{same}");
    assert!(
        same.lines()
            .filter(|line| line.starts_with("N = "))
            .all(|line| line.ends_with(" 0.0")),
        "{same}"
    );
    let line = refused(at, &["compare", "a", "b", "--measure", "fit_fresh"]);
    assert!(line.contains("no cell with the same settings has fit_fresh"), "{line}");
}

/// With 18 samples some passes fail in some trials.
#[test]
fn failures_are_listed_with_the_command_that_replays_one() {
    let folder = folder();
    let at = folder.path();
    let text = stdout(&done(
        at,
        &["run", "s.toml", "--set", "window=18", "--trials", "200", "--out", "few"],
    ));
    let listed = stdout(&done(at, &["failures", "few"]));
    let counted = summary(&at.join("few"));
    let outputs = counted["cells"][0]["outputs"].as_array().expect("a list");
    let kinds = outputs.iter().flat_map(|output| {
        let kinds = output["outcomes"]["failures"].as_object().into_iter().flatten();
        kinds
            .map(|(kind, count)| format!("{kind} in {count} of 200 trials"))
            .collect::<Vec<_>>()
    });
    let kinds: Vec<String> = kinds.collect();
    assert!(!kinds.is_empty(), "{text}");
    let joined = listed.replace("\n    ", " ");
    for kind in kinds {
        assert!(joined.contains(&kind), "{kind}: {listed}");
    }
    let command = listed
        .lines()
        .find_map(|line| line.strip_prefix("  asobench "))
        .expect("a command");
    let replayed = done(at, &command.split(' ').collect::<Vec<_>>());
    assert!(!stdout(&replayed).is_empty());
    let line = refused(at, &["failures", "few", "--method", "oe"]);
    assert!(line.contains("unknown output 'oe'"), "{line}");
}

#[test]
fn words_are_explained() {
    let folder = folder();
    let explained = |word: &str| stdout(&done(folder.path(), &["explain", word]));
    for (word, part) in [
        ("eta", "eta (setting): noise level"),
        ("E_A", "e_a (measure)"),
        ("oe", "Prediction error method"),
        ("iterations", "option of iv"),
        ("boundary", "failure or status"),
        ("trials", "key of an experiment file"),
        ("noise colour", "(glossary)"),
        ("below", "key of a table"),
        ("persistent excitation", "(glossary)"),
        ("instrumental-variables", "least squares with"),
        ("Dead-Beat", "an observer whose poles are all at zero"),
        ("oe model", "Prediction error method"),
    ] {
        let text = explained(word);
        assert!(text.contains(part), "{word}: {text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }
    let line = refused(folder.path(), &["explain", "bucy"]);
    assert!(
        line.contains("the texts of these have it") && line.contains("Kalman filter"),
        "{line}"
    );
    let line = refused(folder.path(), &["explain", "sede"]);
    assert!(line.contains("did you mean 'seed'?") && line.len() < 200, "{line}");
}

#[test]
fn names_from_elsewhere_lead_to_ours() {
    let folder = folder();
    for (given, here) in [
        ("N=5", "'N', which is called 'window' here"),
        ("n=5", "'n', which is called 'order' here"),
        (
            "snr=10",
            "'snr', which is called 'eta' here: noise over output in per cent; an SNR of 20 dB is eta = 10",
        ),
        ("runs=10", "'runs', which is called 'trials' here"),
        (
            "input=PRBS",
            "a table [inputs.NAME] with law = \"prbs\", or input = \"signs\" with sequence = \"periodic-127\"",
        ),
    ] {
        let line = refused(folder.path(), &["check", "s.toml", "--set", given]);
        assert!(line.contains(here), "{line}");
    }
    let line = refused(folder.path(), &["methods", "ssest"]);
    assert!(line.contains("'ssest', which is called 'pem' here"), "{line}");
}

#[test]
fn a_figure_is_drawn_as_it_is_asked_for() {
    let folder = folder();
    let at = folder.path();
    done(at, &["run", "s.toml", "--out", "all"]);
    let drawn = |arguments: &[&str]| {
        let said = stdout(&done(at, &[&["plot", "all"], arguments].concat()));
        let path = said.lines().next().expect("a path").to_owned();
        (
            path.clone(),
            std::fs::read_to_string(at.join(path)).expect("a figure"),
            said,
        )
    };
    let (path, svg, said) = drawn(&["--measure", "e_b", "--method", "arx"]);
    assert_eq!(path, "all-e_b.svg");
    assert!(
        svg.contains("arx") && !svg.contains("iv(4)") && said.contains("median"),
        "{said}"
    );
    let (_, svg, _) = drawn(&["--measure", "e_b", "--method", "arx, iv(4)"]);
    assert!(svg.contains("arx") && svg.contains("iv(4)"));
    let (path, svg, said) = drawn(&[
        "--statistic",
        "rmse",
        "--method",
        "iv",
        "--title",
        "RMSE of five passes",
        "--linear",
        "--out",
        "p.svg",
    ]);
    assert!(path == "p.svg" && svg.contains("RMSE of five passes") && svg.contains("iv(4)"));
    assert!(said.contains("RMSE over trials with 95 % intervals."), "{said}");
    for (arguments, part) in [
        (
            &["--measure", "fit_fresh"][..],
            "unknown measure 'fit_fresh'; expected e_a, e_b",
        ),
        (&["--over", "eta"], "unknown setting that varies 'eta'"),
        (&["--method", "oe"], "unknown output 'oe'"),
        (&["--statistic", "median"], "unknown statistic 'median'"),
    ] {
        let output = asobench(at, &[&["plot", "all"], arguments].concat());
        assert!(
            !output.status.success() && stderr(&output).contains(part),
            "{}",
            stderr(&output)
        );
    }
}

/// The same flag by another name of ours gives the same result.
#[test]
fn flags_have_the_names_of_other_commands() {
    let folder = folder();
    let at = folder.path();
    let rows = (0..60).map(|k| format!("{},{}", (k * k) % 7, (k * k * k) % 11));
    let record = rows.collect::<Vec<_>>().join("\n");
    std::fs::write(at.join("my.csv"), format!("u,y\n{record}\n")).expect("a file");
    let same = |one: &[&str], other: &[&str]| {
        assert_eq!(stdout(&done(at, one)), stdout(&done(at, other)));
    };
    same(
        &["estimate", "my.csv", "--order", "1", "--estimator", "arx"],
        &["estimate", "my.csv", "--order", "1", "--method", "arx"],
    );
    done(at, &["run", "s.toml", "-o", "all"]);
    done(at, &["run", "s.toml", "--methods", "iv,arx", "--output", "both"]);
    let [all, both] = ["all", "both"].map(|name| summary(&at.join(name)));
    assert_eq!(all["cells"], both["cells"]);
    same(
        &["plot", "all", "--over", "window", "--measure", "e_b"],
        &["plot", "all", "--x", "N", "--y", "e_b"],
    );
    let text = stdout(&done(at, &["explain", "detrend", "time constant", "offset"]));
    assert!(
        text.contains("detrend (flag of estimate, observe, study-from): Subtract a trend")
            && text.contains("time constant (glossary)"),
        "{text}"
    );
    let text = stdout(&done(at, &["explain", "N", "undecided"]));
    assert!(
        text.contains("window (setting)") && text.contains("verdict (glossary)"),
        "{text}"
    );
    // Of the settings those of this kind of study, the nearest first.
    let line = refused(at, &["check", "s.toml", "--set", "settings.windwo=5"]);
    assert!(
        line.contains("expected window,") && !line.contains("gain_scale"),
        "{line}"
    );
    std::fs::write(at.join("own.toml"), "[settings]\nwindwo = 5\n").expect("a file");
    let line = refused(at, &["check", "own.toml"]);
    assert!(
        line.contains("expected window,") && !line.contains("gain_scale"),
        "{line}"
    );
}

/// An answer is of the command that was typed.
#[test]
fn an_answer_names_what_the_command_has() {
    let folder = folder();
    for (arguments, part) in [
        (&["run", "s.toml", "--algorithm", "oe"][..], "here: --method NAME"),
        (&["run", "s.toml", "--noise", "0.2"], "here: --set eta=10"),
        (
            &["run", "s.toml", "--resume"],
            "the same command goes on where it was stopped",
        ),
        (
            &["estimate", "my.csv", "--save", "m.json"],
            "here: --format json > FILE.json",
        ),
        (
            &["estimate", "my.csv", "--ahead", "5"],
            "here: --horizon K: FIT of predictions K steps ahead",
        ),
        (&["reproduce", "paper"], "here: --paper nikolov"),
        (&["reproduce", "--quick"], "here: --paper nikolov --trials 100"),
        (
            &["plot", "out", "--y", "rmse"],
            "expected a measure, such as e_a, and --statistic rmse",
        ),
        (
            &["compare", "a", "b", "--threads", "2"],
            "compare does not have it; of asobench reproduce, run",
        ),
    ] {
        let line = refused(folder.path(), arguments);
        assert!(line.contains(part), "{line}");
    }
}

/// Commands, flags and keys of other programs: one line that says what they are here.
#[test]
fn names_of_other_programs_lead_to_those_here() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("a.csv"), "u,y\n1,2\n").expect("a file");
    for (arguments, part) in [
        (&["fit", "my.csv"][..], "here: asobench estimate RECORD.csv --order 2"),
        (&["arx", "my.csv"], "asobench estimate RECORD.csv --estimator NAME"),
        (&["simulate", "s.toml"], "here: asobench run STUDY.toml"),
        (&["estimate", "my.csv", "-n", "2"], "here: --order N"),
        (
            &["run", "s.toml", "--na", "2"],
            "orders = \"na=2,nb=2,nk=1\" of a method in the file",
        ),
        (&["estimate", "my.csv", "--model", "oe"], "here: --estimator NAME"),
        (
            &["estimate", "my.csv", "--delimiter", ";"],
            "separators, decimal commas and headers are recognised",
        ),
        (&["run", "s.toml", "--jobs", "2"], "here: --threads N"),
        (&["run", "s.toml", "-M", "50"], "here: --trials N"),
        (&["plot", "out", "--metric", "e_a"], "here: --measure NAME"),
        (&["bode", "my.csv"], "--report my.html has equations, poles, responses"),
        (
            &["residuals", "my.csv"],
            "asobench estimate RECORD.csv --order 2 --report",
        ),
        (&["predict", "my.csv", "--order", "2"], "--validate OTHER.csv"),
        (&["validate", "s.toml"], "here: asobench check STUDY.toml"),
        (&["list"], "here: asobench methods"),
        (&["init"], "here: asobench new NAME.toml"),
        (
            &["compare", "a.csv", "b.csv"],
            "asobench estimate A.csv --validate B.csv",
        ),
        (&["estimate", "my.csv", "--json"], "here: --format json"),
        (&["estimate", "my.csv", "--csv", "x"], "--states FILE.csv"),
        (&["estimate", "my.csv", "--train", "0.7"], "here: --window 70%"),
        (&["estimate", "my.csv", "--intercept"], "here: --detrend mean"),
        (&["estimate", "--file", "my.csv"], "the file is the first argument"),
        (&["run", "s.toml", "--dry-run"], "here: asobench check STUDY.toml"),
        (
            &["estimate", "my.csv", "--time-unit", "ms"],
            "the unit of times stands in the column's name",
        ),
        (&["estimate", "my.csv", "--resample", "0.1"], "nothing is resampled"),
        (
            &["estimate", "my.csv", "--wavelets"],
            "unexpected argument '--wavelets'; asobench estimate --help",
        ),
        (&["run", "s.toml", "--save-trials"], "--store trials keeps a row"),
        (
            &["replay", "results", "--trial", "17"],
            "asobench replay DIR CELL:TRIAL",
        ),
        (&["export", "results"], "tables/NAME.tex"),
        (
            &["run", "s.toml", "--method", "n4sid"],
            "[[methods]] with estimator = \"n4sid\"",
        ),
        (
            &["estimate", "my.csv", "--order", "2", "--estimator", "ARXX"],
            "unknown estimator 'ARXX', did you mean 'arx'?",
        ),
    ] {
        let line = refused(at, arguments);
        assert!(line.contains(part), "{line}");
    }
}

/// Keys of other programs in an experiment file.
#[test]
fn keys_of_other_programs_lead_to_those_here() {
    let folder = folder();
    let at = folder.path();
    for (text, part) in [
        (
            "[plants.p]\nnum = [1]\nden = [1, 1]\ndt = 0.1\n",
            "'dt', which is called 'Ts' here",
        ),
        (
            "[plants.p]\nnum = [1]\nden = [1, 1]\nmethod = \"zoh\"\n",
            "'method', which is called 'hold' here",
        ),
        (
            "[inputs.x]\nlaw = \"prbs\"\norder = 7\n",
            "'order', which is called 'register' here",
        ),
        ("[inputs]\nx = \"prbs\"\n", "expected a table [inputs.NAME]"),
        (
            "[[methods]]\ntype = \"oe\"\n",
            "'type', which is called 'estimator' here",
        ),
        (
            "[[methods]]\nname = \"iv4\"\n",
            "a method without an estimator is iv, but this one is named 'iv4'",
        ),
        (
            "[[methods]]\nestimator = \"arx\"\nna = 2\n",
            "'na', which is called 'orders' here",
        ),
    ] {
        std::fs::write(at.join("own.toml"), text).expect("a file");
        let line = refused(at, &["check", "own.toml"]);
        assert!(line.contains(part), "{line}");
    }
}

/// A line that could only fail is not printed: of a record as a study. Of a file with two columns of its own names the
/// flags that choose them are said, and they do.
#[test]
fn no_line_is_said_that_fails() {
    let folder = folder();
    let at = folder.path();
    std::fs::copy("examples/record.csv", at.join("my.csv")).expect("a record");
    let error = stderr(&asobench(at, &["simulate", "my.csv"]));
    assert!(error.contains("unexpected command 'simulate'"), "{error}");
    assert!(!error.contains("try:"), "{error}");
    let record = std::fs::read_to_string("examples/record.csv").expect("a record");
    let lines = record.lines().filter(|line| !line.starts_with(['#', 'k']));
    let samples = lines.filter_map(|line| line.split_once(','));
    let samples: Vec<&str> = samples.map(|(_, sample)| sample).collect();
    let own = format!("Eingang,Ausgang\n{}\n", samples.join("\n"));
    std::fs::write(at.join("own.csv"), own).expect("a file");
    let line = ["estimate", "own.csv", "--order", "2"];
    let chosen = "--input Eingang --output Ausgang";
    let error = refused(at, &line);
    assert!(error.contains(chosen), "{error}");
    let chosen: Vec<&str> = line.into_iter().chain(chosen.split(' ')).collect();
    done(at, &chosen);
}
