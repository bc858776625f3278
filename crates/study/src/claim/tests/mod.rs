//! Tests of the engine on summaries of invented studies.

use crate::design::file::axis::Scalar;
use crate::design::file::claim_test::ClaimTest;
use crate::design::file::key::Key;
use crate::design::file::test_table::TestTable;
use crate::design::measure::Measure;
use crate::outcome::looks::Look;
use crate::outcome::outcomes::Outcomes;
use crate::outcome::summary::{CellSummary, ComparisonSummary, OutputSummary, Summary};
use asobench_identification::metric::{Paired, PairedStatistics, Sample, Share, Statistics, Worse};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::sync::LazyLock;

mod chains;
mod conditions;
mod enumeration;
mod families;
mod rates;
mod reference;
mod words;

/// A look with the whole level, and as much for the next one.
const LOOK: Look = Look {
    number: 1,
    share: 1.0,
    next: 1.0,
};

/// Parses a test from a line of TOML.
fn test(toml: &str) -> ClaimTest {
    let table: TestTable = toml::from_str(toml).unwrap();
    ClaimTest::from_table(&table).unwrap()
}

/// The same for a simulation, which asks for few tests and for each of them thousands of times: parsing takes longer
/// than judging.
fn test_again(toml: &str) -> ClaimTest {
    thread_local! {
        static PARSED: RefCell<HashMap<String, ClaimTest>> = RefCell::default();
    }
    PARSED.with_borrow_mut(|parsed| {
        if !parsed.contains_key(toml) {
            parsed.insert(toml.to_owned(), test(toml));
        }
        parsed[toml].clone()
    })
}

/// Makes an output without failures, whose e_a is 1 in all of `trials` trials.
fn output(label: &str, trials: u64) -> OutputSummary {
    OutputSummary {
        estimator: label.to_owned(),
        pass: 0,
        outcomes: Outcomes {
            trials,
            ..Outcomes::default()
        },
        failed: Share::new(0, trials),
        unstable: Share::new(0, trials),
        measures: BTreeMap::from([(Measure::Ea, ones(trials))]),
        parameters: Vec::new(),
        above_truth: Vec::new(),
        sketches: BTreeMap::new(),
        coverage: Vec::new(),
        course: None,
        theory: BTreeMap::new(),
    }
}

fn ones(trials: u64) -> Statistics {
    // The sums of a sample take many pages of memory: once for the tens of thousands of cells of a simulation.
    static ONE: LazyLock<Statistics> = LazyLock::new(|| Sample::from_values([1.0]).statistics(Worse::Larger));
    let mut statistics = *ONE;
    statistics.count = trials;
    statistics.dominated = false;
    statistics
}

/// Makes a cell with the outputs "new" and "old", which are compared, at a noise level.
fn cell(index: usize, eta: f64, trials: u64) -> CellSummary {
    static PAIR: LazyLock<PairedStatistics> =
        LazyLock::new(|| Paired::from_pairs([(Some(1.0), Some(1.0))]).statistics(Worse::Larger));
    let mut pair = *PAIR;
    pair.both = trials;
    pair.dominated = false;
    CellSummary {
        deterministic: false,
        cell: index,
        claim: String::new(),
        eta,
        order: 2,
        window: 98,
        horizon: 400,
        settings: BTreeMap::from([(Key::Eta, Scalar::Number(eta))]),
        trials,
        fallbacks: 0,
        outputs: vec![output("new", trials), output("old", trials)],
        comparisons: vec![ComparisonSummary {
            first: "new".to_owned(),
            second: "old".to_owned(),
            measures: BTreeMap::from([(Measure::Ea, pair)]),
            ratios: BTreeMap::new(),
        }],
        joint: Vec::new(),
        bounds: Vec::new(),
        curves: None,
        traces: None,
    }
}

fn summary(cells: Vec<CellSummary>) -> Summary {
    Summary {
        title: String::new(),
        question: String::new(),
        hypothesis: String::new(),
        claims: Vec::new(),
        partial: false,
        seed: 1,
        axes: Vec::new(),
        quantile_relative_error: 0.0,
        curve_relative_error: 0.0,
        cells,
        slopes: Vec::new(),
        cell_pairs: Vec::new(),
    }
}

impl CellSummary {
    /// Gives "new" these values of e_a; NaN for a lost trial.
    fn draw(&mut self, values: impl IntoIterator<Item = f64>) {
        let sample = Sample::from_values(values);
        let new = &mut self.outputs[0];
        new.measures.insert(Measure::Ea, sample.statistics(Worse::Larger));
        new.sketches.insert(Measure::Ea, sample.sketch().clone());
    }

    /// Gives "new" and "old" these values of e_a.
    fn pair(&mut self, pairs: impl IntoIterator<Item = (f64, f64)>) {
        let pairs = pairs.into_iter().map(|(a, b)| (Some(a), Some(b)));
        let paired = Paired::from_pairs(pairs);
        let comparison = &mut self.comparisons[0];
        let statistics = paired.statistics(Worse::Larger);
        comparison.measures.insert(Measure::Ea, statistics);
        comparison.ratios.insert(Measure::Ea, paired.ratio().clone());
    }
}
