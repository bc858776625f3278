//! Error rates of claims that are corrected together, by simulation of claims whose true numbers are known.

use crate::claim::decision_rule::Verdict;
use crate::claim::judge::judge;
use crate::claim::judged::Judged;
use crate::claim::tests::*;
use crate::design::file::experiment_file::ExperimentFile;
use asobench_identification::metric::tails::binomial_at_most;
use asobench_identification::signal::{Purpose, stream};
use rand::RngExt;

const REPETITIONS: u64 = 2000;
const LEVEL: f64 = 0.025;
/// Trials of a cell. The claims are about the share of failed ones.
const TRIALS: u64 = 1504;

/// Where the true share of a claim "below 0.5" is.
#[derive(Clone, Copy)]
enum Truth {
    /// At the limit: either verdict has the level.
    Limit,
    /// Far below: it certainly holds.
    Below,
}

/// A file with a claim for each of `claims` cells.
fn file(family: bool, claims: usize, more: &str) -> ExperimentFile {
    let values: Vec<String> = (1..=claims).map(|i| i.to_string()).collect();
    let mut text = format!("family = {family}\n[settings]\neta = [{}]\n", values.join(", "));
    for i in 1..=claims {
        let claim = format!(
            "[[claims]]\nid = 'W{i}'\nwhere = {{ eta = {i} }}\n{more}\
             test = {{ share = 'failed', of = 'new', below = 0.5 }}\n"
        );
        text.push_str(&claim);
    }
    ExperimentFile::parse(&text).unwrap()
}

/// A study with a count of failed trials in each cell. The cells have the first `common` trials in common, so they
/// depend on each other; in every other one those fail that do not fail here if `opposite`.
fn study(truths: &[Truth], repetition: u64, common: u64, opposite: bool) -> Summary {
    let mut random = stream(3, repetition, Purpose::Input);
    // Trials in words of 32, each bit of which fails with chance one half.
    let mut ones = |trials: u64| -> u64 {
        let words = (0..trials / 32).map(|_| u64::from(random.random::<u32>().count_ones()));
        words.sum()
    };
    let shared = ones(common);
    let cell = |(i, truth): (usize, &Truth)| {
        let shared = if opposite && i % 2 == 1 {
            common - shared
        } else {
            shared
        };
        let count = match truth {
            Truth::Limit => shared + ones(TRIALS - common),
            Truth::Below => 0,
        };
        failing(i, count)
    };
    summary(truths.iter().enumerate().map(cell).collect())
}

/// A cell in which so many trials fail.
fn failing(index: usize, count: u64) -> CellSummary {
    let mut cell = cell(index, (index + 1) as f64, TRIALS);
    let failures = &mut cell.outputs[0].outcomes.failures;
    failures.insert("singular".to_owned(), count);
    cell
}

/// The largest chance of the binomial law's tail that is not above a level: counts are discrete.
fn reached(level: f64) -> f64 {
    let tails = (0..TRIALS).map(|count| binomial_at_most(count, TRIALS, 0.5));
    tails.filter(|tail| *tail <= level).fold(0.0, f64::max)
}

/// The shares of repetitions in which any claim at its limit holds, and in which any does not hold.
fn rates(family: bool, truths: &[Truth], common: u64, opposite: bool) -> [f64; 2] {
    let file = file(family, truths.len(), "");
    let mut wrong = [0; 2];
    for repetition in 0..REPETITIONS {
        let judged = judge(&file, &study(truths, repetition, common, opposite), &[], LOOK);
        for (wrong, verdict) in wrong.iter_mut().zip([Verdict::Holds, Verdict::DoesNotHold]) {
            let at_limit =
                |(claim, truth): (&Judged, &Truth)| matches!(truth, Truth::Limit) && claim.verdict == verdict;
            *wrong += u64::from(judged.iter().zip(truths).any(at_limit));
        }
    }
    wrong.map(|count| count as f64 / REPETITIONS as f64)
}

/// Three standard errors of a share of the repetitions.
fn three(share: f64) -> f64 {
    3.0 * (share * (1.0 - share) / REPETITIONS as f64).sqrt()
}

/// Of five independent claims at their limits each is decided at 0.5 % a side: 1 - 0.995^5 = 2.48 %, or what the counts
/// reach of that. Each by itself at 2.5 %, they would be at 1 - 0.975^5 = 11.9 %.
#[test]
fn five_claims_at_their_limits() {
    let truths = [Truth::Limit; 5];
    let any = |level: f64| 1.0 - (1.0 - reached(level)).powi(5);
    for rate in rates(true, &truths, 0, false) {
        let expected = any(LEVEL / 5.0);
        assert!((rate - expected).abs() < three(0.0248), "{rate}");
    }
    for rate in rates(false, &truths, 0, false) {
        assert!((rate - any(LEVEL)).abs() < three(0.119), "{rate}");
    }
    for rate in rates(true, &truths, 1344, true) {
        assert!(rate < LEVEL + three(LEVEL), "{rate}");
    }
}

/// Three claims that certainly hold leave two at their limits. These may hold at half the level, 1 - 0.9875^2 = 2.48 %,
/// where Bonferroni would give 1 - 0.995^2 = 1 %. That they do not hold is still corrected over all five: 1 %.
#[test]
fn what_is_decided_leaves_its_level_to_the_others() {
    use Truth::{Below, Limit};
    let any = |level: f64| 1.0 - (1.0 - reached(level)).powi(2);
    let [holds, not] = rates(true, &[Below, Limit, Below, Limit, Below], 0, false);
    let expected = [any(LEVEL / 2.0), any(LEVEL / 5.0)];
    assert!((holds - expected[0]).abs() < three(0.0248), "{holds}");
    assert!((not - expected[1]).abs() < three(0.01), "{not}");
}

/// The level of a family is the smallest of its claims: four claims at 1 % and 20 %.
#[test]
fn the_smallest_level_is_that_of_all() {
    let mut file = file(true, 4, "");
    file.claims[2].level = 0.01;
    file.claims[1].level = 0.2;
    let judged = judge(&file, &study(&[Truth::Below; 4], 0, 0, false), &[], LOOK);
    let mut levels: Vec<f64> = judged.iter().map(|claim| claim.level).collect();
    levels.sort_by(f64::total_cmp);
    assert_eq!(levels, [0.01 / 4.0, 0.01 / 3.0, 0.01 / 2.0, 0.01]);
    for claim in &judged {
        assert_eq!(claim.verdict, Verdict::Holds);
        assert!(claim.line.ends_with(" Corrected over 4 claims."), "{}", claim.line);
    }
    // One claim is a family without a correction.
    let alone = judge(
        &crate::claim::tests::families::file(true, 1, ""),
        &study(&[Truth::Below], 0, 0, false),
        &[],
        LOOK,
    );
    assert_eq!(alone[0].level, LEVEL);
    assert!(!alone[0].line.contains("Corrected"));
}

/// 708 of 1,504 fail: p = 0.0124, so it holds by itself, and not as one of three. Its number of trials is then that of
/// a smaller level.
#[test]
fn a_claim_that_is_certain_alone_may_be_open_in_a_family() {
    let cells = [708, 752, 752].into_iter().enumerate();
    let summary = summary(cells.map(|(i, count)| failing(i, count)).collect());
    let alone = judge(&file(false, 3, ""), &summary, &[], LOOK);
    let family = judge(&file(true, 3, ""), &summary, &[], LOOK);
    assert_eq!(alone[0].verdict, Verdict::Holds);
    assert_eq!(family[0].verdict, Verdict::Undecided);
    assert_eq!(family[0].level, LEVEL / 3.0);
    assert!(family[0].needed.is_some());
}
