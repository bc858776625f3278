//! An audit of verdicts through the program: workers whose errors are known exactly, and built-in methods of known
//! moments, at limits that are the truth or just beside it. Ignored, since it takes minutes.

mod law;
mod rows;
mod study;

use law::{Draws, Law, Stream};
use rows::{Row, Truth};
use study::{Verdict, looks, make_worker};

/// Whether the program has the keys `cap` and `kurtosis` and the statistic `share-above`.
const WITH_ASSUMPTIONS: bool = false;

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
        let study =
            |looks: &&Vec<(Verdict, String)>| looks.iter().any(|(said, _)| *said == verdict);
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

/// Prints a line for each row, and returns those of more wrong verdicts than the level and three simulation errors let
/// through.
fn audit(rows: &[Row], studies: u32) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    make_worker(folder.path());
    let chosen = std::env::var("AUDIT_ROWS").unwrap_or_default();
    let allowed = LEVEL + 3.0 * (LEVEL * (1.0 - LEVEL) / f64::from(studies)).sqrt();
    println!(
        "{:34} {:76} {:6} {:>14}  {:>12}  {:>12}  {:>9}",
        "law", "claim", "truth", "trials", "wrong: holds", "does not", "undecided"
    );
    let mut beyond = Vec::new();
    for row in rows
        .iter()
        .filter(|row| row.law.contains(&chosen) || row.test.contains(&chosen))
    {
        let all = looks(folder.path(), row, studies, set("AUDIT_SEED", 2023));
        let wrong = wrong(row.truth, &all);
        let open = |looks: &&Vec<(Verdict, String)>| {
            looks.iter().all(|(said, _)| *said == Verdict::Undecided)
        };
        let open = all.iter().filter(open).count();
        let trials = match &row.looks[..] {
            [(_, trials)] => trials.to_string(),
            looks => format!("{} ... {}", looks[0].1, looks[looks.len() - 1].1),
        };
        let claim = row
            .test
            .replace("value = ", "")
            .replace("'e_a', of = 'x', ", "");
        let claim = claim.replace("statistic = ", "").replace('\'', "");
        let mut line = format!(
            "{:34} {claim:76} {:6} {trials:>14}  {}  {}  {:8.1} %",
            row.law,
            format!("{:?}", row.truth),
            per_cent(wrong[0], all.len()),
            per_cent(wrong[1], all.len()),
            100.0 * open as f64 / all.len() as f64
        );
        if wrong
            .iter()
            .any(|count| *count as f64 > allowed * all.len() as f64)
        {
            line += "  BEYOND";
        }
        let says = |sentence: &str| !row.never.is_empty() && sentence.contains(row.never);
        if let Some((_, sentence)) = all.iter().flatten().find(|(_, sentence)| says(sentence)) {
            line += &format!("  BEYOND: {sentence}");
        }
        println!("{line}");
        if line.contains("BEYOND") {
            beyond.push(line);
        }
    }
    beyond
}

/// `AUDIT_ROWS` names a part of the laws or claims, `AUDIT_STUDIES` and `AUDIT_SEED` another number of studies and seed.
#[test]
#[ignore = "20 minutes: cargo test --release --test it verdict_audit::wrong -- --ignored --nocapture"]
fn wrong_verdicts_on_known_laws_keep_the_level() {
    let mut rows = [
        rows::moments(),
        rows::quantiles(),
        rows::own_laws(),
        rows::others(),
    ]
    .concat();
    if WITH_ASSUMPTIONS {
        rows.extend(rows::with_assumptions());
    }
    let beyond = audit(&rows, set("AUDIT_STUDIES", 1000) as u32);
    assert!(
        beyond.is_empty(),
        "{} rows:\n{}",
        beyond.len(),
        beyond.join("\n")
    );
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
        (
            "short 8 const 0 mix 0.3 const 1 sum const 1 uniform 0 2",
            2.0,
            0.65,
        ),
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
        let found = (0..100_000)
            .filter(|trial| of_trial(*trial) < below)
            .count() as f64
            / 1e5;
        let error = (share * (1.0 - share) / 1e5).sqrt();
        assert!(
            (found - share).abs() < 5.0 * error,
            "{words}: {found} for {share}"
        );
    }
    assert!(Law::read(&mut "mix 0.5 const 1".split(' ')).is_err());
    assert!(Law::read(&mut "unknown 0.5".split(' ')).is_err());
}
