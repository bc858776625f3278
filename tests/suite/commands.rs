//! The commands of the suite: runs, shards, newcomers, pages, times and recorded data, and what is refused.

use super::root;
use crate::common::{asobench_in as asobench, done_in, stderr, stdout};
use asobench::suite::{Competitor, Division, MethodResults, Stored, Suite, Tier, Times, shipped};
use std::path::Path;

fn done(folder: &Path, arguments: &[&str]) -> String {
    stdout(&done_in(folder, arguments))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A folder for runs of a part of the suite.
struct Runs {
    place: tempfile::TempDir,
    part: &'static [&'static str],
}

impl Runs {
    fn run(&self, out: &str, threads: &str, methods: &[&str]) {
        let mut all = vec!["suite", "run", "--out", out, "--threads", threads];
        all.extend(self.part);
        all.extend(methods.iter().flat_map(|name| ["--method", *name]));
        done(self.place.path(), &all);
    }

    fn read(&self, path: &str) -> String {
        read(&self.place.path().join(path))
    }

    fn result(&self, out: &str, name: &str) -> String {
        self.read(&format!("{out}/methods/{name}.json"))
    }

    /// Computes a study of the folder `one` in shards, into the folder `three`.
    fn in_shards(&self, study: &str) {
        let folder = self.place.path();
        let manifest = format!("one/studies/{study}/manifest.json");
        let plan = ["plan", &manifest, "--shards", "2", "--out", "p.plan.json"];
        done(folder, &plan);
        let shards = self.read("p.plan.json").matches("\"shard\"").count().max(2);
        for shard in 1..=shards {
            let shard = format!("{shard}/{shards}");
            let _ = asobench(folder, &["shard", "p.plan.json", &shard]);
        }
        std::fs::create_dir_all(folder.join("three/studies")).unwrap();
        let merged = format!("three/studies/{study}");
        done(folder, &["merge", "p.plan.json", "--out", &merged]);
    }
}

/// Of the quick and of the standard tier: the results of a method have the same bytes for any number of threads, beside
/// any other methods, by shards, and when the same command is given again; those that are shipped too, but for the last
/// digits of another machine.
#[test]
fn results_do_not_depend_on_threads_shards_or_other_methods() {
    let parts: [(Tier, &str, &[&str]); 2] = [
        (Tier::Quick, "P18-bj", &["--edition", "1.1", "--only", "P18-bj"]),
        (
            Tier::Standard,
            "P18-white",
            &["--edition", "1.1", "--tier", "standard", "--only", "P18-white"],
        ),
    ];
    for (tier, study, part) in parts {
        let place = tempfile::tempdir().unwrap();
        let runs = Runs { place, part };
        runs.run("one", "1", &["arx", "oe"]);
        runs.run("two", "2", &["oe", "pem-from-truth"]);
        assert_eq!(runs.result("one", "oe"), runs.result("two", "oe"));
        let before = runs.read("one/report.html");
        runs.run("one", "2", &["arx", "oe"]);
        assert_eq!(before, runs.read("one/report.html"));
        runs.in_shards(study);
        runs.run("three", "1", &["arx", "oe"]);
        assert_eq!(runs.result("one", "arx"), runs.result("three", "arx"));
        assert_eq!(runs.result("one", "oe"), runs.result("three", "oe"));
        let suite = Suite::of(Some("1.1"), None, tier, &[study.to_owned()]).unwrap();
        let there = shipped(&suite).unwrap();
        let there = there.iter().find(|of| of.method == "arx").unwrap();
        let here = MethodResults::parse(runs.result("one", "arx")).unwrap();
        let [here, there] = [&here, there].map(|of| of.scenarios[0].distances());
        for (here, there) in here.zip(there) {
            assert!((here - there).abs() <= 2e-3 * there, "{here} {there}");
        }
    }
}

/// A run with a plant of the bank, whose page has a table of places, goes on with the same command.
#[test]
fn a_run_with_the_bank_goes_on() {
    let runs = Runs {
        place: tempfile::tempdir().unwrap(),
        part: &["--edition", "2.0", "--only", "B14"],
    };
    runs.run("one", "1", &["arx"]);
    let before = runs.read("one/report.html");
    assert!(!runs.read("one/tables/places.csv").is_empty());
    runs.run("one", "1", &["arx"]);
    assert_eq!(before, runs.read("one/report.html"));
}

/// The program carries the results of all that take part in the standard tier, of which those of the quick tier are the
/// first, in less than 3 MB.
#[test]
fn shipped_results_serve_two_tiers() {
    let [quick, standard] = [Tier::Quick, Tier::Standard].map(|tier| {
        let suite = Suite::of(Some("1.1"), None, tier, &[]).unwrap();
        let methods = shipped(&suite).unwrap();
        (suite, methods)
    });
    let names = |methods: &[MethodResults]| -> Vec<String> { methods.iter().map(|of| of.method.clone()).collect() };
    // clrivc needs a loop and continuous time, which no scenario has.
    let all = Competitor::of(Division::Closed).into_iter();
    let all = all.map(|of| of.name());
    let all: Vec<String> = all.filter(|name| name != "clrivc").collect();
    assert_eq!(names(&standard.1), all);
    for method in &quick.1 {
        let longer = standard.1.iter().find(|of| of.method == method.method);
        for results in method.scenarios.iter().filter(|of| of.has_runs()) {
            let mut longer = longer.unwrap().scenarios.iter();
            let longer = longer.find(|of| of.name == results.name).unwrap();
            assert_eq!((results.d.len(), longer.d.len()), (20, 50));
            assert_eq!(results.d, longer.d[..20]);
        }
    }
    let open = Suite::of(Some("1.1"), Some(Division::Open), Tier::Standard, &[]).unwrap();
    let choosing = Competitor::of(Division::Open).into_iter();
    let choosing: Vec<String> = choosing.map(|of| of.name()).collect();
    assert_eq!(names(&shipped(&open).unwrap()), choosing);
    let size = |folder: &str| -> u64 {
        let files = std::fs::read_dir(root(folder)).unwrap();
        files.map(|file| file.unwrap().metadata().unwrap().len()).sum()
    };
    assert!(size("suite/results") + size("suite/results/open") < 3_000_000);
    assert_eq!([quick.0.trials(false), standard.0.trials(false)], [20, 50]);
}

/// Every number in the tables of the page is printed by the command that the page names.
#[test]
fn a_newcomer_is_placed_and_the_page_is_printed() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    std::fs::write(
        folder.join("mine.toml"),
        "[[methods]]\nname = \"mine\"\nestimator = \"oe\"\nstarts = 0\n",
    )
    .unwrap();
    let part = ["--edition", "1.1", "--only", "P18-bj"];
    let arguments = [&["suite", "mine.toml", "--out", "mine"], &part[..]].concat();
    let printed = done(folder, &arguments);
    assert!(
        printed.contains("mine beside each method on the same records"),
        "{printed}"
    );
    let line = |name: &str| {
        let mut lines = printed.lines().filter(|line| line.starts_with(&format!("{name} ")));
        lines.next().unwrap_or_else(|| panic!("{name} in {printed}")).to_owned()
    };
    // The same estimator with fewer starts finds the same minimum here: all ties, or nearly.
    let words: Vec<String> = printed
        .lines()
        .filter(|line| line.starts_with("oe "))
        .map(str::to_owned)
        .collect();
    let share = |text: &str| text.split_whitespace().nth(2).unwrap().parse::<f64>().unwrap();
    assert!(share(words.last().unwrap()) >= 90.0, "{words:?}");
    assert!(line("mine").split_whitespace().count() > 4);
    let page = read(&folder.join("mine/report.html"));
    for word in ["mine", "pem-from-truth", "P18-bj-300", "chi-squared(p)/p"] {
        assert!(page.contains(word), "{word}");
    }
    assert!(std::fs::exists(folder.join("mine/studies/P18-bj/report.html")).unwrap());
    let scores = done(folder, &[&["suite", "scores", "--page", "shipped"], &part[..]].concat());
    let page = read(&folder.join("shipped/report.html"));
    let cells = page.split("<td").skip(1).map(|cell| {
        let text = cell.split_once('>').unwrap().1.split("</td>").next().unwrap();
        let plain: String = text.split('<').map(|part| part.rsplit('>').next().unwrap()).collect();
        plain.trim().to_owned()
    });
    let numbers: Vec<String> = cells.filter(|text| text.contains('(') && text.len() < 20).collect();
    assert!(numbers.len() > 100, "{}", numbers.len());
    for number in numbers {
        assert!(scores.contains(&number), "{number}");
    }
}

/// One line refuses a command that the suite cannot follow.
#[test]
fn refusals() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("taken.toml", "[[methods]]\nestimator = \"arx\"\n");
    write(
        "two.toml",
        "[[methods]]\nestimator = \"arx\"\nname = \"a\"\n[[methods]]\nestimator = \"oe\"\n",
    );
    write("mine.toml", "[[methods]]\nname = \"mine\"\nestimator = \"arx\"\n");
    for (arguments, part) in [
        (
            vec!["suite", "taken.toml", "--edition", "1.1"],
            "'arx' is the name of a method of the suite",
        ),
        (vec!["suite", "two.toml"], "methods: 2; expected one, the newcomer"),
        (vec!["suite", "none.toml"], "none.toml"),
        (
            vec!["suite", "mine.toml", "--tier", "full", "--edition", "1.1"],
            "as in tier full",
        ),
        (vec!["suite", "show", "P99"], "unknown system or scenario 'P99'"),
        (vec!["suite", "list", "--tier", "slow"], "unknown tier 'slow'"),
        (vec!["suite", "run", "--method", "arxx"], "did you mean 'arx'"),
        (vec!["suite", "scores", "."], "."),
    ] {
        let output = asobench(folder, &arguments);
        let message = stderr(&output);
        assert_ne!(output.status.code(), Some(0), "{arguments:?}");
        assert_eq!(message.lines().count(), 1, "{arguments:?}: {message}");
        assert!(message.contains(part), "{arguments:?}: {message}");
    }
}

/// Times stand in a file of their own, of which the page of a folder takes its column; the results are the same bytes.
#[test]
fn times_are_apart_from_results() {
    let place = tempfile::tempdir().unwrap();
    let part: &[&str] = &["--edition", "1.1", "--only", "P18-bj"];
    let runs = Runs { place, part };
    runs.run("one", "1", &["arx", "oe"]);
    let before = runs.result("one", "oe");
    let folder = runs.place.path();
    let mut all = vec!["suite", "times", "--rounds", "3", "--method", "oe", "--out", "one"];
    all.extend(part);
    let printed = done(folder, &all);
    assert!(printed.lines().any(|line| line.starts_with("oe ")), "{printed}");
    let times = Times::parse(runs.read("one/times.json")).unwrap();
    assert_eq!(times.methods[0].method, "arx");
    assert_eq!(times.methods[0].scenarios[0].ratios, [Some(1.0); 3]);
    assert!(times.methods[1].typical().value > 1.0);
    assert!(Times::parse(runs.read("one/times.json").replace("arx", "arz")).is_err());
    runs.run("one", "1", &["arx", "oe"]);
    assert_eq!(before, runs.result("one", "oe"));
    assert!(
        runs.read("one/report.html")
            .contains("over that of <code>arx</code> in the same scenario")
    );
}

/// The FIT of `arx` on recorded data, simulated and one step ahead, against a numpy transcription: least squares, n by
/// AICc over common equations, the free response by least squares over the first samples. Each record comes with its
/// licence.
#[test]
fn recorded_data_have_the_fit_of_another_computation() {
    let printed = done(&root("."), &["suite", "recorded"]);
    for (file, expected) in [
        ("daisy_dryer.csv", [85.92, 95.33]),
        ("daisy_heating_system.csv", [60.06, 98.81]),
        ("epfl_active_suspension.csv", [71.75, 77.67]),
        ("epfl_laserbeam.csv", [88.74, 88.46]),
    ] {
        let is_of = |line: &&str| line.starts_with(&format!("| {file} "));
        let lines: Vec<&str> = printed.lines().filter(is_of).collect();
        assert_eq!(lines.len(), 2, "{printed}");
        for (line, expected) in lines.iter().zip(expected) {
            let arx = line.split('|').nth(4).unwrap().trim();
            let arx: f64 = arx.parse().unwrap();
            assert!((arx - expected).abs() < 0.06, "{file}: {arx} {expected}");
        }
    }
    for licence in [
        "no explicit licence on the DaISy data",
        "no licence file in carrier repo",
    ] {
        assert!(printed.contains(licence), "{licence}");
    }
}

/// A run of the suite that has not ended is told from a folder without one.
#[test]
fn a_stopped_run_is_told_from_none() {
    let place = tempfile::tempdir().expect("a folder");
    let part = ["--tier", "quick", "--only", "P01"];
    let scores = |folder: &str| {
        let output = asobench(place.path(), &[&["suite", "scores", folder], &part[..]].concat());
        assert_eq!(output.status.code(), Some(2));
        stderr(&output)
    };
    let studies = Suite::new(Tier::Quick, &["P01".to_owned()]).expect("a suite").studies;
    let ended = place.path().join("out/studies").join(&studies[0].name);
    std::fs::create_dir_all(place.path().join("empty")).expect("made");
    std::fs::create_dir_all(&ended).expect("made");
    std::fs::write(ended.join("manifest.json"), "{}").expect("written");
    let said = format!("out: no results yet: 1 of {} studies", studies.len());
    assert!(scores("out").contains(&said), "{}", scores("out"));
    assert!(scores("empty").contains("empty: no results of the suite"));
}
