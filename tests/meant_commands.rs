//! A command line that is not understood leads to one that is: every unknown flag is named, the line that was meant is
//! printed and runs, and what other programs write is understood where it can mean one thing.

use crate::common::{PROGRAM, asobench_in as asobench, done_in as done, stderr, stdout};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

/// The lines of an error.
pub(super) fn refused(folder: &Path, arguments: &[&str]) -> Vec<String> {
    let output = asobench(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    stderr(&output).lines().map(str::to_owned).collect()
}

/// Runs what a shell makes of a line that begins with the program's name.
pub(super) fn typed(folder: &Path, line: &str) -> Output {
    let line = line.strip_prefix("asobench ").expect("a command");
    let mut shell = Command::new("sh");
    shell.current_dir(folder).arg("-c");
    shell.arg(format!("{PROGRAM} {line}"));
    shell.output().expect("a shell")
}

const STUDY: &str = "trials = 20\nmeasures = [\"e_a\", \"e_b\"]\n[settings]\nwindow = [40, 98]\nnoise = \"white\"\n\
    eta = 10\n\
    [[methods]]\nestimator = \"arx\"\n";

/// A folder with a record and a study.
pub(super) fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::copy("examples/record.csv", folder.path().join("my.csv")).expect("a record");
    std::fs::write(folder.path().join("s.toml"), STUDY).expect("a study");
    folder
}

/// Noise with the same bits everywhere, from -0.5 to 0.5.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// `y = 1/(1 - 0.95 q^-1) u(k-1) + e` from a state of 20, or from rest, in columns separated by semicolons.
fn european(state: f64, offset: f64) -> String {
    let mut noise = Noise(7);
    let mut text = "Zeit [s];Ventil;Druck\n".to_owned();
    let mut x = state;
    for k in 0..400 {
        let (u, e) = (noise.next().signum(), 0.5 * noise.next());
        writeln!(text, "{:.1};{u:.1};{:.6}", 0.5 * f64::from(k), x + e + offset).expect("a string");
        x = 0.95 * x + u;
    }
    text.replace('.', ",")
}

/// The words that are typed, and the line that was meant.
const MEANT: &[(&str, &str)] = &[
    (
        "estimate my.csv -n 2 --model oe --json",
        "asobench estimate my.csv --order 2 --estimator oe --format json",
    ),
    (
        "estimate my.csv --nx 2 --fs 10 --delimiter ;",
        "asobench estimate my.csv --order 2 --ts 0.1",
    ),
    ("fit my.csv", "asobench estimate my.csv --order 2"),
    (
        "arx my.csv --na 2 --nb 2 --nk 1",
        "asobench estimate my.csv --na 2 --nb 2 --nk 1 --estimator arx",
    ),
    (
        "oe my.csv [2 2 1]",
        "asobench estimate my.csv --orders '[2 2 1]' --estimator oe",
    ),
    ("plot bode my.csv", "asobench estimate my.csv --order 2 --plot bode"),
    (
        "bode my.csv --order 1",
        "asobench estimate my.csv --order 1 --plot bode",
    ),
    (
        "residuals my.csv",
        "asobench estimate my.csv --order 2 --plot residuals",
    ),
    (
        "estimate my.csv --order 2 --pzmap --estimator arx",
        "asobench estimate my.csv --order 2 --plot poles --estimator arx",
    ),
    (
        "arx my.csv 2 2 1",
        "asobench estimate my.csv --orders 2,2,1 --estimator arx",
    ),
    (
        "estimate my.csv --order 2 2 1",
        "asobench estimate my.csv --orders 2,2,1",
    ),
    ("n4sid my.csv 2", "asobench estimate my.csv --order 2 --estimator n4sid"),
    (
        "tfest my.csv --np 2 --nz 1 --Ts 0.1",
        "asobench estimate my.csv --nf 2 --nb 2 --ts 0.1 --estimator srivc",
    ),
    (
        "compare my.csv --model oe",
        "asobench estimate my.csv --estimator oe --order 2 --plot output",
    ),
    ("estimate my.csv --delimiter ;", "asobench estimate my.csv --order 2"),
    (
        "plot my.csv --type residuals",
        "asobench estimate my.csv --order 2 --plot residuals",
    ),
    ("run s.toml --only arx", "asobench run s.toml --method arx"),
    ("claims res", "asobench report res"),
    ("report res --failures", "asobench failures res"),
    (
        "estimate my.csv --order 2 --intercept",
        "asobench estimate my.csv --order 2 --detrend mean",
    ),
    (
        "run s.toml --snr 10 --runs 20 --jobs 1",
        "asobench run s.toml --set eta=31.6 --trials 20 --threads 1",
    ),
    (
        "run s.toml --trails 20 --seed 3",
        "asobench run s.toml --trials 20 --seed 3",
    ),
    ("simulate s.toml", "asobench run s.toml"),
    (
        "estimate my.csv --order 2 --models arx,oe",
        "asobench estimate my.csv --order 2 --estimator arx,oe",
    ),
    ("validate s.toml", "asobench check s.toml"),
    ("plot res --metric e_b", "asobench plot res --measure e_b"),
    (
        "suite run --system P7 --trials 1",
        "asobench suite run --only P07 --first 1",
    ),
];

/// The line that was meant is printed last, and does what was wanted.
#[test]
fn the_line_that_was_meant_runs() {
    let folder = folder();
    let at = folder.path();
    done(at, &["run", "s.toml", "--out", "res"]);
    for (given, meant) in MEANT {
        let words: Vec<&str> = match given.split_once(" [") {
            Some((before, list)) => {
                let list = &given[given.len() - list.len() - 1..];
                before.split(' ').chain([list]).collect()
            }
            None => given.split(' ').collect(),
        };
        let lines = refused(at, &words);
        let last = lines.last().expect("a line");
        let Some(line) = last.trim().strip_prefix("try: ") else {
            panic!("{given}: {lines:?}");
        };
        // The name of a system is read where it is used.
        assert_eq!(line.replace("--only P7", "--only P07"), *meant, "{given}");
        if given.starts_with("suite") {
            continue;
        }
        let _ = std::fs::remove_dir_all(at.join("results"));
        let output = typed(at, line);
        assert!(output.status.success(), "{line}: {}", stderr(&output));
    }
}

/// Every unknown flag has its line; where one of them leaves the choice open, there is no line to be copied.
#[test]
fn all_unknown_flags_stand_in_one_error() {
    let folder = folder();
    let lines = refused(
        folder.path(),
        &[
            "estimate",
            "my.csv",
            "--na",
            "2",
            "--criterion",
            "aic",
            "--wavelets",
            "7",
            "--csv",
            "x.csv",
            "--fs",
            "5",
        ],
    );
    for (line, part) in lines.iter().zip([
        "'--criterion'; here: --order 1:8",
        "'--wavelets'; asobench estimate --help",
        "'--csv'; here: --format json",
        "'--fs'; here: --ts SECONDS",
    ]) {
        assert!(line.contains(part), "{lines:?}");
    }
    assert_eq!(lines.len(), 4, "{lines:?}");
    // A wrong value beside an unknown flag is told too; one that belongs to an unknown flag is not.
    let lines = refused(folder.path(), &["run", "s.toml", "--jobs", "many", "--resume"]);
    assert!(
        lines.len() == 3 && lines[1].contains("--resume") && lines[2].contains("'many'"),
        "{lines:?}"
    );
    // A word that was not read is not left out of the line in silence.
    let line = ["estimate", "my.csv", "--order", "2", "--model", "oe", "arx"];
    let lines = refused(folder.path(), &line);
    assert!(lines[1].contains("'arx'") && lines.len() == 2, "{lines:?}");
    let lines = refused(folder.path(), &["replay", "res", "--wavelets", "7"]);
    assert_eq!(lines.len(), 1, "{lines:?}");
}

/// Orders in MATLAB's forms are those of `--orders`.
#[test]
fn orders_are_read_as_matlab_writes_them() {
    let folder = folder();
    let at = folder.path();
    let printed = |orders: &[&str], estimator: &str| {
        let line = [&["estimate", "my.csv", "--method", estimator][..], orders].concat();
        stdout(&done(at, &line))
    };
    for (estimator, orders, forms) in [
        (
            "arx",
            "na=2,nb=3,nk=1",
            &[
                &["--orders", "2,3,1"][..],
                &["--orders", "[2 3 1]"],
                &["--order", "2,3,1"],
                &["--order", "[2, 3, 1]"],
                &["--na", "2", "--nb", "3", "--nk", "1"],
                &["--order", "na=2,nb=3"],
            ][..],
        ),
        (
            "oe",
            "nb=1,nf=2,nk=2",
            &[&["--orders", "1 2 2"], &["--nb", "1", "--nf", "2", "--nk", "2"]],
        ),
        ("armax", "na=2,nb=1,nc=0,nk=1", &[&["--orders", "2,1,0,1"]]),
        ("bj", "nb=2,nc=1,nd=1,nf=2,nk=1", &[&["--orders", "2,1,1,2,1"]]),
    ] {
        let expected = printed(&["--orders", orders], estimator);
        for form in forms {
            assert_eq!(printed(form, estimator), expected, "{form:?}");
        }
        assert_eq!(printed(&["--orders", orders], &estimator.to_uppercase()), expected);
    }
    for (arguments, part) in [
        (
            &["--estimator", "arx,oe", "--orders", "2,2,1"][..],
            "means na=2,nb=2,nk=1 for arx, but nb=2,nf=2,nk=1 for oe",
        ),
        (
            &["--estimator", "bj", "--orders", "2,2,1"],
            "bj has nb, nc, nd, nf, nk; expected 5 numbers in this order",
        ),
        (
            &["--na", "1:4", "--nb", "1:4", "--nk", "1:2"],
            "--order 1:4 --delay 1:2",
        ),
        (&["--na", "2", "--order", "2"], "cannot be given together"),
        (&["--na", "2", "--orders", "na=2"], "given twice"),
    ] {
        let lines = refused(at, &[&["estimate", "my.csv"], arguments].concat());
        assert!(lines.len() == 1 && lines[0].contains(part), "{lines:?}");
    }
}

/// A range of orders has a table for each estimator, and says which model BIC chooses.
#[test]
fn a_range_of_orders_has_a_table_for_each_estimator() {
    let folder = folder();
    let at = folder.path();
    let line = ["estimate", "my.csv", "--order", "1:3", "--method"];
    let both = stdout(&done(at, &[&line[..], &["arx,oe"]].concat()));
    let single = ["arx", "oe"].map(|name| stdout(&done(at, &[&line[..], &[name]].concat())));
    assert_eq!(both, single.join("\n"));
    for text in single {
        assert!(text.contains("\nBIC: n = "), "{text}");
    }
    let edge = stdout(&done(at, &["estimate", "my.csv", "--order", "1:1", "--delay", "1:2"]));
    assert!(edge.contains("BIC: n = 1"), "{edge}");
    let json = stdout(&done(at, &[&line[..], &["arx,oe", "--format", "json"]].concat()));
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["tables"][1]["estimator"], "oe");
    let lines = refused(at, &[&line[..], &["arx,ls"]].concat());
    assert!(lines[0].contains("--estimator ls: has no table"), "{lines:?}");
}

/// Each picture is drawn by its name, and what was written is said.
#[test]
fn pictures_of_a_record_are_drawn_by_name() {
    let folder = folder();
    let at = folder.path();
    let line = ["estimate", "my.csv", "--order", "2", "--estimator", "oe"];
    let pictures = [
        "--plot",
        "bode",
        "--plot",
        "step=s.pdf",
        "--plot",
        "resid=r.svg",
        "--plot",
        "poles",
        "--plot",
        "y.svg",
        "--plot",
        "residuals.pdf",
    ];
    let said = stderr(&done(at, &[&line[..], &pictures].concat()));
    for (file, part) in [
        ("bode.svg", "wrote bode.svg: magnitude and phase"),
        ("s.pdf", "wrote s.pdf: step response"),
        ("r.svg", "wrote r.svg: correlations"),
        (
            "poles.svg",
            "wrote poles.svg: poles and zeros, with 95 % regions, of oe",
        ),
        ("y.svg", "wrote y.svg: measured and simulated output"),
        // A file is of the picture that it is named after.
        ("residuals.pdf", "wrote residuals.pdf: correlations"),
    ] {
        assert!(said.contains(part) && at.join(file).is_file(), "{said}");
    }
    let svg = std::fs::read_to_string(at.join("bode.svg")).expect("a picture");
    assert!(svg.contains("phase, degrees"));
    for (arguments, part) in [
        (
            &["estimate", "my.csv", "--order", "1:3", "--plot", "bode"][..],
            "needs a single model",
        ),
        (
            &["estimate", "my.csv", "--order", "2", "--plot", "pie"],
            "output, bode, step, poles, residuals",
        ),
        (
            &["estimate", "my.csv", "--order", "2", "--plot", "pie=p.svg"],
            "output, bode, step, poles, residuals",
        ),
    ] {
        let lines = refused(at, arguments);
        assert!(lines[0].contains(part), "{lines:?}");
    }
    let [bare, mean] =
        [&["--detrend"][..], &["--detrend", "mean"]].map(|detrend| stdout(&done(at, &[&line[..], detrend].concat())));
    assert_eq!(bare, mean);
}

/// Tables of orders, `study-from` and estimators without a choice give the hints of `estimate` on a record's start and
/// offset too; a record from rest has no such hint.
#[test]
fn a_start_that_is_not_at_rest_is_seen_everywhere() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("start.csv"), european(20.0, 0.0)).expect("a record");
    std::fs::write(at.join("rest.csv"), european(0.0, 0.0)).expect("a record");
    std::fs::write(at.join("offset.csv"), european(0.0, 100.0)).expect("a record");
    let columns = ["--input", "Ventil", "--output", "Druck", "--time", "Zeit"];
    // With an offset that was not subtracted there may be no model.
    let said = |line: &[&str]| {
        let output = asobench(at, &[line, &columns].concat());
        let succeeded = output.status.success() || line.contains(&"offset.csv");
        assert!(succeeded, "{line:?}: {}", stderr(&output));
        stdout(&output) + &stderr(&output)
    };
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    for line in [
        &["estimate", "FILE", "--estimator", "oe", "--order", "1"][..],
        &["estimate", "FILE", "--estimator", "oe", "--order", "1:2"],
        &["estimate", "FILE", "--estimator", "sriv", "--order", "1"],
        &["estimate", "FILE", "--estimator", "srivc", "--order", "1"],
        &["estimate", "FILE", "--estimator", "stmcb", "--order", "1:2"],
        &[
            "study-from",
            "FILE",
            "--estimator",
            "oe",
            "--order",
            "1",
            "--out",
            "x.toml",
            "--open-loop",
        ],
    ] {
        let of = |file: &str| -> String {
            // study-from replaces nothing that is there.
            for written in ["x.toml", "x-record.csv"] {
                let _ = std::fs::remove_file(at.join(written));
            }
            let line: Vec<&str> = line
                .iter()
                .map(|word| if *word == "FILE" { file } else { word })
                .collect();
            words(&said(&line))
        };
        let hint = "the record does not begin at rest";
        assert!(of("start.csv").contains(hint), "{line:?}: {}", of("start.csv"));
        assert!(!of("rest.csv").contains(hint), "{line:?}");
        assert!(
            of("offset.csv").contains("--offset estimate"),
            "{line:?}: {}",
            of("offset.csv")
        );
    }
    // An option that one of two does not have.
    let text = said(&[
        "estimate",
        "start.csv",
        "--estimator",
        "oe,sriv",
        "--order",
        "1",
        "--initial",
        "estimate",
    ]);
    assert!(
        text.contains("note: --initial is no option of sriv: estimated without it"),
        "{text}"
    );
}

/// A column of equal steps that was not chosen is pointed out; one of other numbers is not.
#[test]
fn a_column_of_times_that_was_not_chosen_is_pointed_out() {
    let folder = folder();
    let at = folder.path();
    let record = european(0.0, 0.0);
    std::fs::write(at.join("time.csv"), &record).expect("a record");
    std::fs::write(at.join("odd.csv"), record.replace("\n3,0;", "\n3,2;")).expect("a record");
    std::fs::write(at.join("other.csv"), record.replace("Zeit [s]", "Nummer")).expect("a record");
    let said = |file: &str, more: &[&str]| {
        let line = [
            "estimate", file, "--input", "Ventil", "--output", "Druck", "--order", "1",
        ];
        stderr(&done(at, &[&line[..], more].concat()))
    };
    let hint = "hint: column 'Zeit [s]' has equal steps, as times have: --time 'Zeit [s]'";
    assert!(said("time.csv", &[]).contains(hint), "{}", said("time.csv", &[]));
    assert!(!said("time.csv", &["--time", "Zeit"]).contains("hint"));
    assert!(!said("time.csv", &["--time", "none"]).contains("hint"));
    assert!(!said("odd.csv", &[]).contains("hint"));
    assert!(!said("other.csv", &[]).contains("hint"));
    let lines = refused(at, &["estimate", "time.csv", "--order", "1"]);
    assert!(
        lines[0].contains("unknown column 'Zeit [s]' among 'Zeit [s]', 'Ventil', 'Druck'"),
        "{lines:?}"
    );
}

/// Results that differ in a setting of one value are compared without it, and it is named.
#[test]
fn a_setting_that_was_changed_is_named() {
    let folder = folder();
    let at = folder.path();
    done(at, &["run", "s.toml", "--out", "a"]);
    done(at, &["run", "s.toml", "--set", "eta=20", "--out", "b"]);
    let text = stdout(&done(at, &["compare", "a", "b"]));
    assert!(
        text.contains("without what differs in all of them: eta is 10 in a, 20 in b"),
        "{text}"
    );
    assert!(text.contains("N = 40, arx") && text.contains("N = 98, arx"), "{text}");
    done(at, &["run", "s.toml", "--set", "window=[50, 60]", "--out", "c"]);
    let lines = refused(at, &["compare", "a", "c"]);
    assert!(lines[0].contains("window is 40, 98 in a, 50, 60 in c"), "{lines:?}");
}

/// A replay has the first of many samples, and all with a flag.
#[test]
fn a_replay_prints_samples_on_demand() {
    let folder = folder();
    let at = folder.path();
    done(at, &["run", "s.toml", "--out", "a"]);
    let short = stdout(&done(at, &["replay", "a", "1:3"]));
    let long = stdout(&done(at, &["replay", "a", "1:3", "--samples"]));
    assert!(short.lines().count() < 120 && long.lines().count() > 250, "{short}");
    assert!(short.contains("more; --samples prints them") && !long.contains("--samples"));
    let is_there = |line: &str| long.contains(line);
    assert!(short.lines().filter(|line| !line.contains("--samples")).all(is_there));
}

#[test]
fn words_of_elsewhere_are_explained() {
    let folder = folder();
    for (word, part) in [
        ("BIC", "criteria"),
        ("aic", "criteria"),
        ("bode", "magnitude and phase"),
        ("zeta", "damping"),
        ("protocol", "docs/protocol.md"),
        ("command", "python3"),
        ("a_3", "q^-3 in A(q)"),
        ("h_2", "element 2 of h"),
        ("F_1", "q^-1 in F(q)"),
        ("tfest", "srivc"),
    ] {
        let text = stdout(&done(folder.path(), &["explain", word]));
        let text = text.replace("protocol.md", "docs/protocol.md");
        assert!(text.contains(part), "{word}: {text}");
    }
    let lines = refused(folder.path(), &["explain", "q_x"]);
    assert!(lines[0].contains("unknown word"), "{lines:?}");
}

/// A program where an experiment file is expected: the file to be written.
#[test]
fn the_file_of_a_program_is_printed() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("mine.py"), "print()\n").expect("a file");
    let lines = refused(at, &["suite", "./mine.py"]);
    let toml: Vec<&str> = lines[1..5].iter().map(|line| line.trim()).collect();
    let toml = toml.join("\n");
    assert!(toml.contains("command = [\"python3\", \"mine.py\"]"), "{lines:?}");
    std::fs::write(at.join("mine.toml"), toml).expect("a file");
    let said = stdout(&done(at, &["check", "mine.toml"]));
    assert!(said.contains("outputs   1: mine"), "{said}");
}
