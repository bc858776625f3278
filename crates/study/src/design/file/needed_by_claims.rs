//! The needs of a file's claims of a run.

use crate::design::Measure;
use crate::design::file::lists::{extend, push};
use crate::design::file::{
    BoundTable, ClaimTable, ClaimTest, CoefficientStatistic, ExperimentFile, JointTable, Key, Needs, RatioStatistic,
    SeriesTable, TestKind, TheoryReference,
};

impl ExperimentFile {
    /// Returns what the claims need of a run beyond what a resolved file asks for itself. Faulty tests need nothing.
    pub fn needs(&self) -> Needs {
        let mut needs = Needs::default();
        for claim in &self.claims {
            for test in claim.all_tests() {
                needs.add(claim, &test, self);
            }
        }
        needs.measures.sort_unstable();
        needs
    }

    /// Adds what the claims need. If `needed` is given already, adds exactly that.
    pub(crate) fn add_needs(&mut self) {
        let needs = self.needed.take().unwrap_or_else(|| self.needs());
        extend(&mut self.measures, &needs.measures);
        extend(&mut self.compare, &needs.compare);
        extend(&mut self.bounds, &needs.bounds);
        extend(&mut self.slopes, &needs.slopes);
        self.parameters |= needs.parameters;
        self.coverage |= needs.coverage;
        self.timing |= needs.timing;
        self.needed = Some(needs).filter(|needs| !needs.is_empty());
    }
}

/// The distributions by which claims are judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Distributions {
    /// A measure of an output.
    pub(crate) measures: Vec<(String, Measure)>,
    /// The ratio of a measure of two outputs on the same trials.
    pub(crate) ratios: Vec<([String; 2], Measure)>,
    /// Both values of each trial.
    pub(crate) joint: Vec<JointTable>,
}

impl Distributions {
    /// Returns those that the claims of a file look at.
    pub(crate) fn of_claims(file: &ExperimentFile) -> Self {
        let mut all = Self::default();
        for test in file.claims.iter().flat_map(ClaimTable::all_tests) {
            all.add(&test);
        }
        all
    }

    fn add(&mut self, test: &ClaimTest) {
        let output = test.output.clone();
        match &test.kind {
            TestKind::Value { measure, .. } => push(&mut self.measures, &[], (output, *measure)),
            TestKind::Slope(slope) => push(&mut self.measures, &[], (output, slope.measure)),
            TestKind::Ratio { measure, to, .. } if TheoryReference::named(to).is_some() => {
                push(&mut self.measures, &[], (output, *measure));
            }
            TestKind::Ratio {
                measure,
                to,
                statistic: RatioStatistic::PairedMedian,
                ..
            } => push(&mut self.ratios, &[], ([output, to.clone()], *measure)),
            TestKind::Ratio { .. } => push(&mut self.joint, &[], test.joint()),
            _ => {}
        }
    }
}

impl Needs {
    fn add(&mut self, claim: &ClaimTable, test: &ClaimTest, file: &ExperimentFile) {
        let output = || test.output.clone();
        for measure in test.measures() {
            push(&mut self.measures, &file.measures, measure);
        }
        match &test.kind {
            TestKind::Outcome(_) | TestKind::Value { .. } => {}
            TestKind::Bound(bound) => {
                // A bound of the file may apply to the cells of one claim only.
                let claim = claim.single(Key::Claim);
                let counted = |table: &BoundTable| {
                    table.limits() == bound.limits() && (table.claim.is_none() || table.claim == claim)
                };
                if !file.bounds.iter().any(counted) {
                    let claim = claim.clone();
                    push(&mut self.bounds, &[], BoundTable { claim, ..bound.clone() });
                }
            }
            TestKind::Wins { to, .. } => push(&mut self.compare, &file.compare, [output(), to.clone()]),
            TestKind::Coefficient { statistic, .. } => match statistic {
                CoefficientStatistic::Coverage => self.coverage |= !file.coverage,
                CoefficientStatistic::Bias | CoefficientStatistic::ShareAbove => {
                    self.parameters |= !file.parameters;
                }
            },
            TestKind::Ratio {
                measure,
                to,
                measure_of_to,
                statistic,
            } => {
                if TheoryReference::named(to).is_some() {
                    return;
                }
                if *statistic == RatioStatistic::Median || test.assumption.is_some() {
                    push(&mut self.medians, &[], test.joint());
                } else if measure != measure_of_to {
                    push(&mut self.ratios, &[], test.joint());
                }
                if *statistic != RatioStatistic::Median && measure == measure_of_to {
                    push(&mut self.compare, &file.compare, [output(), to.clone()]);
                }
            }
            TestKind::Cells { measure, axis, .. } => {
                for (from, to) in test.unit().steps(&file.settings) {
                    let series = SeriesTable {
                        measure: *measure,
                        output: output(),
                        axis: *axis,
                        from,
                        to,
                    };
                    push(&mut self.series, &[], series);
                }
            }
            TestKind::Slope(slope) => {
                if slope.check(&file.settings).is_ok() {
                    push(&mut self.slopes, &file.slopes, slope.clone());
                }
            }
            TestKind::Time { .. } => self.timing |= !file.timing,
        }
    }
}
