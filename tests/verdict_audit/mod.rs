//! An audit of verdicts through the program: workers whose errors are known exactly, and built-in methods of known
//! moments, at limits that are the truth or just beside it. Ignored, since it takes minutes.

mod built_in;
mod cost;
mod law;
mod rows;
mod study;

use law::{Draws, Law, Stream};
use rows::{Row, Truth};
use std::path::Path;
use study::{Verdict, looks, make_worker};

/// Whether the program has the keys `cap` and `kurtosis` and the statistic `share-above`.
const WITH_ASSUMPTIONS: bool = true;

/// The promised rate of wrong verdicts, a side.
const LEVEL: f64 = 0.025;

/// Returns a share in per cent with its binomial error.
fn per_cent(count: usize, of: usize) -> String {
    let share = count as f64 / of as f64;
    let error = (share * (1.0 - share) / of as f64).sqrt();
    format!("{:5.1} +- {:3.1}", 100.0 * share, 100.0 * error)
}

/// How many studies said what is wrong: that the claim holds, or that it does not.
fn wrong(truth: Truth, all: &[Vec<(Verdict, String)>]) -> [usize; 2] {
    let said = |verdict: Verdict, where_true: Truth| {
        let study = |looks: &&Vec<(Verdict, String)>| looks.iter().any(|(said, _)| *said == verdict);
        if truth == where_true {
            0
        } else {
            all.iter().filter(study).count()
        }
    };
    [
        said(Verdict::Holds, Truth::Holds),
        said(Verdict::DoesNotHold, Truth::Fails),
    ]
}

/// Returns a number from the environment.
fn set(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

/// The verdicts of one claim's studies.
struct Found<'a> {
    law: &'a str,
    test: &'a str,
    truth: Truth,
    trials: String,
    all: &'a [Vec<(Verdict, String)>],
    never: &'a str,
}

impl Found<'_> {
    /// Prints a line; returns it if there are more wrong verdicts than the level and three simulation errors let
    /// through, or a sentence says what it must not.
    fn line(&self) -> Option<String> {
        let (all, studies) = (self.all, self.all.len() as f64);
        let wrong = wrong(self.truth, all);
        let is_open = |looks: &&Vec<(Verdict, String)>| looks.iter().all(|(said, _)| *said == Verdict::Undecided);
        let open = all.iter().filter(is_open).count() as f64;
        let claim = self.test.replace("value = ", "").replace("'e_a', of = 'x', ", "");
        let claim = claim.replace("statistic = ", "").replace('\'', "");
        let mut line = format!(
            "{:33} {claim:60} {:6} {:>14}  {}  {}  {:7.1} %",
            self.law,
            format!("{:?}", self.truth),
            self.trials,
            per_cent(wrong[0], all.len()),
            per_cent(wrong[1], all.len()),
            100.0 * open / studies
        );
        let allowed = studies * LEVEL + 3.0 * (studies * LEVEL * (1.0 - LEVEL)).sqrt();
        if wrong.iter().any(|count| *count as f64 > allowed) {
            line += "  BEYOND";
        }
        let says = |sentence: &str| !self.never.is_empty() && sentence.contains(self.never);
        if let Some((_, sentence)) = all.iter().flatten().find(|(_, sentence)| says(sentence)) {
            line += &("  BEYOND: ".to_owned() + sentence);
        }
        println!("{line}");
        line.contains("BEYOND").then_some(line)
    }
}

/// Whether the environment asks for this law and claim.
fn is_chosen(law: &str, test: &str) -> bool {
    let part = std::env::var("AUDIT_ROWS").unwrap_or_default();
    law.contains(&part) || test.contains(&part)
}

/// Prints a line for each row, and returns those beyond the level.
fn audit(rows: &[Row], folder: &Path, studies: u32) -> Vec<String> {
    let mut beyond = Vec::new();
    // A seed for each row: with one, all rows would have the same luck.
    let numbered = rows.iter().zip(set("AUDIT_SEED", 2023)..);
    for (row, seed) in numbered.filter(|(row, _)| is_chosen(row.law, &row.test)) {
        let all = looks(folder, row, studies, seed);
        let trials = match &row.looks[..] {
            [(_, trials)] => trials.to_string(),
            looks => format!("{} ... {}", looks[0].1, looks[looks.len() - 1].1),
        };
        let found = Found {
            law: row.law,
            test: &row.test,
            truth: row.truth,
            trials,
            all: &all,
            never: row.never,
        };
        beyond.extend(found.line());
    }
    beyond
}

/// `AUDIT_ROWS` names a part of the laws or claims, `AUDIT_STUDIES` and `AUDIT_SEED` set the number of studies and the
/// seed.
#[test]
#[ignore = "15 minutes: cargo test --release --test it verdict_audit::wrong -- --ignored --nocapture"]
fn wrong_verdicts_on_known_laws_keep_the_level() {
    let mut rows = [rows::moments(), rows::quantiles(), rows::own_laws(), rows::others()].concat();
    if WITH_ASSUMPTIONS {
        rows.extend(rows::with_assumptions());
    }
    let folder = tempfile::tempdir().expect("a folder");
    make_worker(folder.path());
    let studies = set("AUDIT_STUDIES", 1000) as u32;
    println!(
        "{:33} {:60} truth          trials  wrong: holds      does not  undecided",
        "law", "claim"
    );
    let mut beyond = audit(&rows, folder.path(), studies);
    // A run for each study: a tenth of them.
    beyond.extend(built_in::audit(folder.path(), u64::from(studies / 10)));
    assert!(beyond.is_empty(), "{} rows:\n{}", beyond.len(), beyond.join("\n"));
}

/// `AUDIT_STUDIES` and `AUDIT_TRIALS` set the number of studies and the largest number of trials.
#[test]
#[ignore = "prints a table, 20 minutes: cargo test --release --test it verdict_audit::trials -- --ignored --nocapture"]
fn trials_for_even_odds_of_a_decision() {
    let folder = tempfile::tempdir().expect("a folder");
    make_worker(folder.path());
    let (studies, most) = (set("AUDIT_STUDIES", 100), set("AUDIT_TRIALS", 50_000));
    cost::table(folder.path(), studies as u32, most, WITH_ASSUMPTIONS);
}

/// Shares of 100,000 draws within five standard errors of what the laws are by arithmetic.
#[test]
fn laws_are_what_they_are_called() {
    let known = [
        ("halfnormal 1", 0.674_489_750_196_081_7, 0.5),
        ("lognormal 2", 1.0, 0.5),
        ("exponential 2", 2.0, 1.0 - (-1_f64).exp()),
        ("pareto 2.2 3", 6.0, 1.0 - 2_f64.powf(-2.2)),
        ("cauchy 5", 5.0, 0.75),
        // 1/2 + (x / (1 + x^2) + atan x) / pi at x = t / sqrt(3) = 1.
        ("t3 1", 3_f64.sqrt(), 0.75 + 0.5 / std::f64::consts::PI),
        ("geometric 0.3", 1.5, 0.51),
        ("binomial 3 0.5", 1.5, 0.5),
        ("die 20", 4.5, 0.2),
        ("cantor", 1.0 / 6.0, 0.25),
        ("arcsine", 0.5, 0.5),
        ("arcsine", 0.146_446_609_406_726_24, 0.25),
        ("power 2 geometric 0.5", 3.0, 0.75),
        ("rounded 1 pareto 0.8 1", 2.25, 1.0 - 2.5_f64.powf(-0.8)),
        ("short 8 const 0 mix 0.3 const 1 sum const 1 uniform 0 2", 2.0, 0.65),
        ("product die 4 uniform 0.9 1.1", 2.5, 0.5),
        ("common normal 1 2", 1.0, 0.5),
    ];
    for (words, below, share) in known {
        let law = Law::read(&mut words.split(' ')).expect("a law");
        let of_trial = |trial: u64| {
            let (common, own) = (Stream::new(&[trial, 1]), Stream::new(&[trial, 2]));
            law.draw(&mut Draws {
                common,
                own,
                samples: 10.0,
            })
        };
        let found = (0..100_000).filter(|trial| of_trial(*trial) < below).count() as f64 / 1e5;
        let error = (share * (1.0 - share) / 1e5).sqrt();
        assert!((found - share).abs() < 5.0 * error, "{words}: {found} for {share}");
    }
    assert!(Law::read(&mut "mix 0.5 const 1".split(' ')).is_err());
    assert!(Law::read(&mut "unknown 0.5".split(' ')).is_err());
}
