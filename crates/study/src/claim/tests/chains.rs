//! Chains of looks: a study is extended until its claim is decided. The true share is at its limit, so every verdict is
//! wrong, and all looks together keep the level.

#![expect(clippy::print_stdout, reason = "the rates that were found")]

use crate::claim::decision_rule::{Cells, Verdict, decide};
use crate::claim::evidence::Evidence;
use crate::claim::judge::{decides, verdict_at};
use crate::claim::power::{Open, Undecided};
use crate::claim::statistics::{Members, Results};
use crate::claim::tests::*;
use crate::design::file::claim::Holds;
use crate::design::file::experiment_file::ExperimentFile;
use crate::design::file::rule::TrialRule;
use crate::outcome::looks::Looks;
use asobench_identification::signal::{Purpose, stream};
use rand::RngExt;

const LEVEL: f64 = 0.025;
const CHAINS: u64 = 2000;
/// Trials of the first look, and the most.
const EXTENT: [u64; 2] = [128, 65_536];

/// How a chain goes on.
#[derive(Clone, Copy, Debug)]
enum Next {
    Doubled,
    /// By the fewest trials that the sentence says.
    Advised,
}

/// Returns the verdict with which a chain ends, and the number of looks. `shared`: at every look with its share of the
/// level, otherwise with the whole.
fn chain(number: u64, next: Next, shared: bool) -> (Verdict, usize) {
    let file = ExperimentFile::default();
    let mut random = stream(5, number, Purpose::Input);
    let (mut looks, mut trials, mut count) = (Looks::default(), 0, 0);
    let mut wanted = EXTENT[0];
    for made in 1.. {
        while trials < wanted {
            count += u64::from(random.random::<u64>().count_ones());
            trials += 64;
        }
        let look = looks.at(trials, &file, &file.trials);
        looks.add(trials, &file.trials);
        let [level, later] = [look.share, look.next].map(|share| LEVEL * if shared { share } else { 1.0 });
        let mut results = summary(vec![cell(0, 10.0, trials)]);
        let failures = &mut results.cells[0].outputs[0].outcomes.failures;
        failures.insert("singular".to_owned(), count);
        let results = Results {
            summary: &results,
            times: &[],
        };
        let tests = [test_again("share = 'failed'\nof = 'new'\nbelow = 0.5")];
        let evidence = Evidence::new(results, &tests, &Members::Cell(0));
        let cells = Cells {
            judged: &[evidence.p_values()],
            among: 1,
        };
        let verdict = decide(Holds::Everywhere, cells, level);
        if verdict != Verdict::Undecided || trials >= EXTENT[1] {
            return (verdict, made);
        }
        let open = Open {
            evidence: &evidence,
            given: None,
            trials,
        };
        let undecided = Undecided {
            cells: &[open],
            among: 1,
            holds: Holds::Everywhere,
            level: later,
        };
        wanted = match next {
            Next::Doubled => 2 * trials,
            Next::Advised => {
                let advised = undecided.needed().from.unwrap_or(EXTENT[1]);
                advised.next_multiple_of(64)
            }
        }
        .min(EXTENT[1]);
    }
    (Verdict::Undecided, 0)
}

/// Returns the shares of chains that end in "holds" and in "does not hold".
fn rates(next: Next, shared: bool) -> [f64; 2] {
    let mut counts = [0_u64; 2];
    let mut most = 0;
    for number in 0..CHAINS {
        let (verdict, looks) = chain(number, next, shared);
        counts[0] += u64::from(verdict == Verdict::Holds);
        counts[1] += u64::from(verdict == Verdict::DoesNotHold);
        most = most.max(looks);
    }
    let found = counts.map(|count| count as f64 / CHAINS as f64);
    println!("{next:?}, shared {shared}: {found:?}, at most {most} looks");
    found
}

#[test]
fn all_looks_together_keep_the_level() {
    let most = LEVEL + 3.0 * (LEVEL * (1.0 - LEVEL) / CHAINS as f64).sqrt();
    for next in [Next::Doubled, Next::Advised] {
        let found = rates(next, true);
        assert!(found.iter().all(|rate| *rate <= most), "{next:?}: {found:?}");
    }
    // The whole level at every look would be wrong far more often: the test can fail.
    let whole = rates(Next::Doubled, false);
    assert!(whole.iter().all(|rate| *rate > most), "{whole:?}");
}

/// A rule that stops when W1 is decided, and a claim beside it.
const BESIDE: &str = "
[trials]
until = 'W1'
minimum = 128
maximum = 16384
[[claims]]
id = 'W1'
test = { share = 'failed', of = 'new', below = 0.5 }
[[claims]]
id = 'W2'
test = { share = 'failed', of = 'old', below = 0.5 }";

/// Returns the verdict on W2, whose share is at its limit, when the rule has stopped and, if it is open, once more
/// after an extension to `EXTENT`. W1 and W2 fail in the same trials but for one in eight where `alike`.
fn beside(file: &ExperimentFile, number: u64, alike: bool) -> Verdict {
    let TrialRule::Decided(until) = &file.trials else {
        panic!("the rule has a claim");
    };
    let extended = TrialRule::Fixed(EXTENT[1]);
    let mut random = stream(6, number, Purpose::Input);
    let (mut looks, mut trials, mut counts) = (Looks::default(), 0, [0_u64; 2]);
    let (mut wanted, mut rule) = (until.minimum, &file.trials);
    loop {
        while trials < wanted {
            let old = random.random::<u64>();
            let other = random.random::<u64>();
            let flips = random.random::<u64>() & random.random::<u64>() & random.random::<u64>();
            counts[0] += u64::from(if alike { old ^ flips } else { other }.count_ones());
            counts[1] += u64::from(old.count_ones());
            trials += 64;
        }
        let look = looks.at(trials, file, rule);
        let mut results = summary(vec![cell(0, 10.0, trials)]);
        for (output, count) in results.cells[0].outputs.iter_mut().zip(counts) {
            output.outcomes.failures.insert("singular".to_owned(), count);
        }
        let first_rule = trials <= until.maximum;
        if first_rule && trials < until.maximum && !decides(file, &results, look) {
            wanted = 2 * trials;
            continue;
        }
        looks.add(trials, rule);
        let verdict = verdict_at(&file.claims[1], look, file, &results);
        if verdict != Verdict::Undecided || !first_rule {
            return verdict;
        }
        (wanted, rule) = (EXTENT[1], &extended);
    }
}

/// The trials stop for another claim, which knows nothing or nearly all of it.
#[test]
fn a_claim_beside_the_one_that_stops_keeps_its_level() {
    let file = ExperimentFile::parse(BESIDE).unwrap();
    let most = LEVEL + 3.0 * (LEVEL * (1.0 - LEVEL) / CHAINS as f64).sqrt();
    for alike in [false, true] {
        let mut counts = [0_u64; 2];
        for number in 0..CHAINS {
            let verdict = beside(&file, number, alike);
            counts[0] += u64::from(verdict == Verdict::Holds);
            counts[1] += u64::from(verdict == Verdict::DoesNotHold);
        }
        let found = counts.map(|count| count as f64 / CHAINS as f64);
        println!("beside, alike {alike}: {found:?}");
        assert!(found.iter().all(|rate| *rate <= most), "{alike}: {found:?}");
    }
}
