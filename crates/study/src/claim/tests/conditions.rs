//! Claims with a condition whose truth is known: what is left out by chance makes no verdict wrong more often than the
//! level.

#![expect(clippy::print_stdout, reason = "the rates that were found")]

use crate::claim::decision_rule::Verdict;
use crate::claim::judge::verdict_at;
use crate::claim::tests::*;
use crate::design::file::experiment_file::ExperimentFile;
use asobench_identification::signal::{Purpose, stream};
use rand::RngExt;

const LEVEL: f64 = 0.025;
const REPETITIONS: u64 = 2000;
const TRIALS: u64 = 300;

/// The true shares of a cell: that of the condition, which must be below 0.1, and that of the test, below 0.5.
type Truth = [f64; 2];

/// A cell whose condition is met and that passes; one that fails; one that passes where the condition is not met, and
/// one that fails there. The last two are at the limit of the condition, where it is hardest to tell.
const PASSES: Truth = [0.02, 0.3];
const FAILS: Truth = [0.02, 0.7];
const PASSES_OUTSIDE: Truth = [0.1, 0.3];
const FAILS_OUTSIDE: Truth = [0.1, 0.7];
/// Just inside the condition: the limit from below.
const PASSES_INSIDE: Truth = [0.0999, 0.3];
const FAILS_INSIDE: Truth = [0.0999, 0.7];
/// At the limit of the test, with the condition met.
const AT_LIMIT: Truth = [0.02, 0.5];

/// Returns the share of studies with this verdict.
fn rate(holds: &str, cells: &[Truth], wrong: Verdict) -> f64 {
    let etas: Vec<String> = (1..=cells.len()).map(|i| (10 * i).to_string()).collect();
    let file = format!(
        "[settings]\neta = [{}]\n[[claims]]\nid = 'W1'\nholds = '{holds}'\n\
         given = {{ share = 'failed', of = 'new', below = 0.1 }}\n\
         test = {{ share = 'failed', of = 'old', below = 0.5 }}",
        etas.join(", ")
    );
    let file = ExperimentFile::parse(&file).unwrap();
    let one = |number: u64| {
        let mut random = stream(7, number, Purpose::Input);
        let cells = cells.iter().enumerate().map(|(index, truth)| {
            let mut cell = cell(index, 10.0 * (index + 1) as f64, TRIALS);
            for (output, share) in cell.outputs.iter_mut().zip(truth) {
                let fails = (0..TRIALS).filter(|_| random.random_bool(*share));
                let count = fails.count() as u64;
                output.outcomes.failures.insert("singular".to_owned(), count);
            }
            cell
        });
        let results = summary(cells.collect());
        u64::from(verdict_at(&file.claims[0], LOOK, &file, &results) == wrong)
    };
    (0..REPETITIONS).map(one).sum::<u64>() as f64 / REPETITIONS as f64
}

#[test]
fn conditions_keep_the_level() {
    use Verdict::{DoesNotHold, Holds};
    let most = LEVEL + 3.0 * (LEVEL * (1.0 - LEVEL) / REPETITIONS as f64).sqrt();
    let cases: [(&str, &[Truth], Verdict); 8] = [
        // Not all cells inside pass.
        ("everywhere", &[PASSES, PASSES, FAILS_INSIDE], Holds),
        ("everywhere", &[PASSES, PASSES, AT_LIMIT], Holds),
        // All cells inside pass.
        ("everywhere", &[PASSES, PASSES, FAILS_OUTSIDE], DoesNotHold),
        ("everywhere", &[PASSES, AT_LIMIT, FAILS_OUTSIDE], DoesNotHold),
        // No cell inside passes, and one does.
        ("somewhere", &[FAILS, FAILS, PASSES_OUTSIDE], Holds),
        ("somewhere", &[FAILS, FAILS, PASSES_INSIDE], DoesNotHold),
        // Two of four inside pass, which is not more than half; and two of three.
        ("typically", &[PASSES, PASSES, FAILS, FAILS, PASSES_OUTSIDE], Holds),
        ("typically", &[PASSES, PASSES_INSIDE, FAILS, FAILS_OUTSIDE], DoesNotHold),
    ];
    let mut wrong = Vec::new();
    for (holds, cells, verdict) in cases {
        let found = rate(holds, cells, verdict);
        println!("{holds} {cells:?}: {verdict} in {found}");
        if found > most {
            wrong.push(format!("{holds} {cells:?}: {verdict} in {found}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
    // Clear cases are decided: the test is not passed by an engine that never decides.
    let clear = rate("everywhere", &[PASSES, PASSES, FAILS], DoesNotHold);
    assert!(clear > 0.99, "{clear}");
    let clear = rate("everywhere", &[PASSES; 3], Holds);
    assert!(clear > 0.99, "{clear}");
}
