//! Error rates by simulation: 2,000 repetitions of small studies whose true numbers are known.
//!
//! A claim is at its boundary if the true number equals the limit. Either verdict may then be wrong, at the level of
//! 2.5 %. The tests allow three standard errors of the simulation above that.

#![expect(clippy::print_stdout, reason = "the rates that were found")]

use crate::claim::decision_rule::{Cells, PValues, Verdict, decide};
use crate::claim::evidence::Evidence;
use crate::claim::power::{Open, Undecided};
use crate::claim::statistics::{Members, Results};
use crate::claim::tests::*;
use crate::design::file::claim::Holds;
use asobench_identification::metric::tails::normal_point;
use asobench_identification::signal::normal::fill_standard_normal;
use asobench_identification::signal::{Purpose, stream};

const REPETITIONS: u64 = 2000;
const LEVEL: f64 = 0.025;
const CELLS: [usize; 3] = [1, 24, 76];

/// Three standard errors of a share of the repetitions.
fn three(share: f64) -> f64 {
    3.0 * (share * (1.0 - share) / REPETITIONS as f64).sqrt()
}

/// A certain pass, and a certain fail.
const PASS: PValues = PValues { pass: 0.0, fail: 1.0 };
const FAIL: PValues = PValues { pass: 1.0, fail: 0.0 };

/// A kind of number with its sampling distribution.
trait Law {
    /// Returns how many normal numbers a draw takes.
    fn width(&self) -> usize;
    /// Returns the evidence of a draw on a test whose true number is `truth`.
    fn evidence(&self, truth: f64, z: &[f64]) -> Evidence;
    /// Returns the limit.
    fn limit(&self) -> f64;
    fn trials(&self) -> u64;
}

/// Returns the evidence of a cell's summary on one test.
fn of_cell(test: ClaimTest, trials: u64, draw: impl FnOnce(&mut CellSummary)) -> Evidence {
    let mut results = summary(vec![cell(0, 10.0, trials)]);
    draw(&mut results.cells[0]);
    let results = Results {
        summary: &results,
        times: &[],
    };
    Evidence::new(results, &[test], &Members::Cell(0))
}

/// The share of trials that fail.
struct Failures(f64, u64);

impl Failures {
    /// Returns the evidence of so many failures.
    fn counted(&self, count: u64) -> Evidence {
        let test = test_again(&format!("share = 'failed'\nof = 'new'\nbelow = {}", self.0));
        of_cell(test, self.1, |cell| {
            let failures = &mut cell.outputs[0].outcomes.failures;
            failures.insert("singular".to_owned(), count);
        })
    }
}

impl Law for Failures {
    fn width(&self) -> usize {
        1
    }
    fn evidence(&self, truth: f64, z: &[f64]) -> Evidence {
        // The count at the same probability as the normal number.
        let above = asobench_identification::metric::tails::normal_above(z[0]);
        let (n, odds) = (self.1, truth / (1.0 - truth));
        let mut term = (n as f64 * (1.0 - truth).ln()).exp();
        let (mut count, mut below) = (0, term);
        while below < above && count < n {
            term *= odds * (n - count) as f64 / (count + 1) as f64;
            below += term;
            count += 1;
        }
        self.counted(count)
    }
    fn limit(&self) -> f64 {
        self.0
    }
    fn trials(&self) -> u64 {
        self.1
    }
}

/// The median of exp(1.5 z), z normal: heavy-tailed.
struct Median(u64);

impl Law for Median {
    fn width(&self) -> usize {
        self.0 as usize
    }
    fn evidence(&self, truth: f64, z: &[f64]) -> Evidence {
        let test = test_again("value = 'e_a'\nof = 'new'\nbelow = 2");
        of_cell(test, self.0, |cell| {
            cell.draw(z.iter().map(|z| truth * (1.5 * z).exp()));
        })
    }
    fn limit(&self) -> f64 {
        2.0
    }
    fn trials(&self) -> u64 {
        self.0
    }
}

/// Returns the p-values of `cells` draws of a law. `number` is that of the repetition. Every law and size has its own
/// random numbers.
fn p_values(law: &dyn Law, truth: f64, number: u64, cells: usize) -> Vec<PValues> {
    let mut z = vec![0.0; law.width() * cells];
    let seed = (law.limit() * 1000.0) as u64 + law.trials();
    fill_standard_normal(&mut stream(seed, number, Purpose::NoiseDrive), &mut z);
    let chunks = z.chunks(law.width());
    chunks.map(|z| law.evidence(truth, z).p_values()).collect()
}

fn verdict(holds: Holds, judged: &[PValues], level: f64) -> Verdict {
    let among = judged.len();
    decide(holds, Cells { judged, among }, level)
}

/// Returns m cells, as few passing as the claim needs and one of them at its boundary: the hardest case.
fn on_the_edge(holds: Holds, boundary: PValues, m: usize) -> Vec<PValues> {
    let passes = holds.passes(m) - 1;
    let mut cells = vec![PASS; passes];
    cells.push(boundary);
    cells.resize(m, FAIL);
    cells
}

/// Returns the shares of repetitions with the verdict (holds, does not hold).
fn rates(mut judge: impl FnMut(u64) -> Verdict) -> [f64; 2] {
    let mut counts = [0_u64; 2];
    for repetition in 0..REPETITIONS {
        match judge(repetition) {
            Verdict::Holds => counts[0] += 1,
            Verdict::DoesNotHold => counts[1] += 1,
            Verdict::HoldsInPart | Verdict::Undecided => {}
        }
    }
    counts.map(|count| count as f64 / REPETITIONS as f64)
}

/// At the boundary, in 1, 24 and 76 cells, for every way to hold: neither verdict is more frequent than the level.
/// `exact`: with one cell, both have the frequency of the level.
fn keeps_its_level(name: &str, law: &dyn Law, exact: bool) {
    let most = LEVEL + three(LEVEL);
    let drawn: Vec<Vec<PValues>> = (0..REPETITIONS).map(|i| p_values(law, law.limit(), i, 76)).collect();
    for m in CELLS {
        for holds in Holds::ALL.iter().copied() {
            let all = rates(|i| verdict(holds, &drawn[i as usize][..m], LEVEL));
            let edge = rates(|i| verdict(holds, &on_the_edge(holds, drawn[i as usize][0], m), LEVEL));
            println!("{name:<14} {m:>3} {holds:<11} all {all:?}, edge {edge:?}");
            for rate in [all, edge].concat() {
                assert!(rate <= most, "{name} in {m} cells, {holds}: {all:?} {edge:?}");
            }
            if exact && m == 1 {
                for rate in all {
                    assert!(rate >= LEVEL - three(LEVEL), "{name}: {all:?}");
                }
            }
        }
    }
}

#[test]
fn shares_at_the_boundary() {
    keeps_its_level("share 1 %", &Failures(0.01, 1000), false);
    keeps_its_level("share 50 %", &Failures(0.5, 400), false);
}

#[test]
fn medians_with_heavy_tails_at_the_boundary() {
    keeps_its_level("median of 200", &Median(200), false);
}

/// 75 cells that certainly pass, and one that fails by 5 standard errors of a share of 400.
#[test]
fn a_counterexample_of_five_standard_errors_is_found() {
    let law = Failures(0.5, 400);
    let truth = 0.5 + 5.0 * 0.025;
    let [_, refuted] = rates(|i| {
        let mut cells = vec![PASS; 75];
        cells.extend(p_values(&law, truth, i, 1));
        verdict(Holds::Everywhere, &cells, LEVEL)
    });
    assert!(refuted > 0.9, "{refuted}");
}

/// Returns the number of trials that the engine asks for if every one of m cells has this evidence from so many trials.
fn asked_for(evidence: &Evidence, trials: u64, holds: Holds, m: usize) -> u64 {
    let open = Open {
        evidence,
        given: None,
        trials,
    };
    let cells = vec![open; m];
    let undecided = Undecided {
        cells: &cells,
        among: m,
        holds,
        level: LEVEL,
    };
    undecided.trials(0.0).expect("a number")
}

/// A planted effect that few trials leave open. With the number of trials that the engine asks for, 80 % of studies
/// decide it, in 1 and in 12 cells. Counts are discrete: never too few trials.
#[test]
fn the_stated_number_of_trials_decides_shares() {
    for (limit, truth, few) in [(0.5, 0.4, 60), (0.5, 0.56, 100), (0.01, 0.004, 500), (0.01, 0.02, 300)] {
        let expected = usize::from(truth > limit);
        for m in [1, 12] {
            let evidence = Failures(limit, few).counted((truth * few as f64).round() as u64);
            let trials = asked_for(&evidence, few, Holds::Everywhere, m);
            let law = Failures(limit, trials);
            let power = rates(|i| verdict(Holds::Everywhere, &p_values(&law, truth, i, m), LEVEL))[expected];
            println!("share {truth} against {limit} in {m}: {trials} trials, {power}");
            assert!(power >= 0.8 - three(0.8), "{truth} in {m} cells: {power} with {trials}");
            assert!(power <= 0.9 || trials == few + 1, "{power} with {trials}");
        }
    }
}

/// The same for medians, from a study of 1,000 whose values are evenly spread.
#[test]
fn the_stated_number_of_trials_decides_medians() {
    for (truth, expected) in [(1.75, 0), (2.3, 1)] {
        let few = Median(1000);
        let points = (0..1000).map(|i| normal_point((f64::from(i) + 0.5) / 1000.0));
        let evidence = few.evidence(truth, &points.collect::<Vec<f64>>());
        let trials = asked_for(&evidence, few.0, Holds::Everywhere, 1);
        let law = Median(trials);
        let power = rates(|i| verdict(Holds::Everywhere, &p_values(&law, truth, i, 1), LEVEL));
        println!("median {truth}: {trials} trials, {power:?}");
        let power = power[expected];
        assert!(
            (0.8 - three(0.8)..=0.9).contains(&power),
            "{truth}: {power} with {trials}"
        );
    }
}

/// A rule that looks at a claim at its boundary after 20, 40, ..., 1,280 trials, each time at a seventh of the level,
/// and stops at the first verdict.
#[test]
fn seven_looks_keep_the_level() {
    let sizes: Vec<usize> = (0..7).map(|look| 20 << look).collect();
    let limit = Median(20).limit();
    for m in [1, 12] {
        let found = rates(|repetition| {
            let mut z = vec![0.0; m * sizes[6]];
            fill_standard_normal(&mut stream(21, repetition, Purpose::NoiseDrive), &mut z);
            let look = |size: &usize| {
                let p_values: Vec<PValues> = z
                    .chunks(sizes[6])
                    .map(|z| Median(*size as u64).evidence(limit, &z[..*size]).p_values())
                    .collect();
                verdict(Holds::Everywhere, &p_values, LEVEL / 7.0)
            };
            let mut looks = sizes.iter().map(look);
            looks.find(|verdict| *verdict != Verdict::Undecided).unwrap_or_default()
        });
        println!("seven looks at {m} cells: {found:?}");
        for rate in found {
            assert!(rate <= LEVEL + three(LEVEL), "{m} cells: {found:?}");
        }
        // Seven looks, each at the whole level, would be wrong far more often.
        assert!(m > 1 || found[0] + found[1] > 0.01, "{found:?}");
    }
}
