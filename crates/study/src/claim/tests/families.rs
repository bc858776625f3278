//! Error rates of claims that are corrected together, by simulation of claims whose true numbers are known.

use crate::claim::decision_rule::Verdict;
use crate::claim::judge::judge;
use crate::claim::judged::Judged;
use crate::claim::tests::*;
use crate::design::file::experiment_file::ExperimentFile;
use asobench_identification::signal::normal::fill_standard_normal;
use asobench_identification::signal::{Purpose, stream};

const REPETITIONS: u64 = 2000;
const LEVEL: f64 = 0.025;
/// The numbers behind an estimate.
const NUMBERS: usize = 20;
/// So many trials give the error of a median 19 degrees of freedom, as 20 numbers give that of their mean.
const TRIALS: u64 = 1504;

/// Where the true number of a claim "below 0" is.
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
    let mut text = format!(
        "family = {family}\n[settings]\neta = [{}]\n",
        values.join(", ")
    );
    for i in 1..=claims {
        let claim = format!(
            "[[claims]]\nid = 'W{i}'\nwhere = {{ eta = {i} }}\n{more}\
             test = {{ value = 'e_a', of = 'new', below = 5 }}\n"
        );
        text.push_str(&claim);
    }
    ExperimentFile::parse(&text).unwrap()
}

/// A study with an estimate from normal numbers in each cell. The cells have `common` numbers among theirs, so they
/// depend on each other; every other one with the opposite sign if `opposite`.
fn study(truths: &[Truth], repetition: u64, common: usize, opposite: bool) -> Summary {
    let n = NUMBERS;
    let mut stream = stream(3, repetition, Purpose::Input);
    let mut shared = vec![0.0; common];
    fill_standard_normal(&mut stream, &mut shared);
    let cell = |(i, truth): (usize, &Truth)| {
        let mut z = vec![0.0; n];
        fill_standard_normal(&mut stream, &mut z);
        let sign = if opposite && i % 2 == 1 { -1.0 } else { 1.0 };
        for (z, shared) in z.iter_mut().zip(&shared) {
            *z = sign * shared;
        }
        let mean = z.iter().sum::<f64>() / n as f64;
        let squares: f64 = z.iter().map(|z| (z - mean) * (z - mean)).sum();
        let truth = match truth {
            Truth::Limit => 5.0,
            Truth::Below => 0.0,
        };
        let mut cell = cell(i, (i + 1) as f64, TRIALS);
        cell.e_a().q50 = Quantile {
            value: truth + mean,
            mcse: (squares / (n as f64 - 1.0) / n as f64).sqrt(),
            lost: false,
        };
        cell
    };
    summary(truths.iter().enumerate().map(cell).collect())
}

/// The shares of repetitions in which any claim at its limit holds, and in which any does not hold.
fn rates(family: bool, truths: &[Truth], common: usize, opposite: bool) -> [f64; 2] {
    let file = file(family, truths.len(), "");
    let mut wrong = [0; 2];
    for repetition in 0..REPETITIONS {
        let judged = judge(
            &file,
            &study(truths, repetition, common, opposite),
            &[],
            LOOK,
        );
        for (wrong, verdict) in wrong.iter_mut().zip([Verdict::Holds, Verdict::DoesNotHold]) {
            let at_limit = |(claim, truth): (&Judged, &Truth)| {
                matches!(truth, Truth::Limit) && claim.verdict == verdict
            };
            *wrong += u64::from(judged.iter().zip(truths).any(at_limit));
        }
    }
    wrong.map(|count| count as f64 / REPETITIONS as f64)
}

/// Three standard errors of a share of the repetitions.
fn three(share: f64) -> f64 {
    3.0 * (share * (1.0 - share) / REPETITIONS as f64).sqrt()
}

/// Of five independent claims at their limits each is decided at 0.5 % a side: 1 - 0.995^5 = 2.48 %. Each by itself at
/// 2.5 %, they would be at 1 - 0.975^5 = 11.9 %.
#[test]
fn five_claims_at_their_limits() {
    let truths = [Truth::Limit; 5];
    for rate in rates(true, &truths, 0, false) {
        assert!((rate - 0.0248).abs() < three(0.0248), "{rate}");
    }
    for rate in rates(false, &truths, 0, false) {
        assert!((rate - 0.119).abs() < three(0.119), "{rate}");
    }
    for rate in rates(true, &truths, 18, true) {
        assert!(rate < LEVEL + three(LEVEL), "{rate}");
    }
}

/// Three claims that certainly hold leave two at their limits. These may hold at half the level, 1 - 0.9875^2 = 2.48 %,
/// where Bonferroni would give 1 - 0.995^2 = 1 %. That they do not hold is still corrected over all five: 1 %.
#[test]
fn what_is_decided_leaves_its_level_to_the_others() {
    use Truth::{Below, Limit};
    let [holds, not] = rates(true, &[Below, Limit, Below, Limit, Below], 0, false);
    assert!((holds - 0.0248).abs() < three(0.0248), "{holds}");
    assert!((not - 0.01).abs() < three(0.01), "{not}");
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
        assert!(
            claim.line.ends_with(" Corrected over 4 claims."),
            "{}",
            claim.line
        );
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

/// The mean of 20 numbers is 2.5 standard errors below the limit: p = 0.011 with 19 degrees of freedom, so it holds by
/// itself, and not as one of three. Its number of trials is then that of a smaller level.
#[test]
fn a_claim_that_is_certain_alone_may_be_open_in_a_family() {
    let mut summary = study(&[Truth::Limit; 3], 0, 0, false);
    for (cell, inside) in summary.cells.iter_mut().zip([2.5, 0.0, 0.0]) {
        cell.e_a().q50 = Quantile {
            value: 5.0 - inside,
            mcse: 1.0,
            lost: false,
        };
    }
    let alone = judge(&file(false, 3, ""), &summary, &[], LOOK);
    let family = judge(&file(true, 3, ""), &summary, &[], LOOK);
    assert_eq!(alone[0].verdict, Verdict::Holds);
    assert_eq!(family[0].verdict, Verdict::Undecided);
    assert_eq!(family[0].level, LEVEL / 3.0);
    assert!(family[0].needed.is_some());
}
