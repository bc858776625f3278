//! The evidence on a claim in every unit that is judged by itself.

use crate::claim::decision_rule::PValues;
use crate::claim::evidence::Evidence;
use crate::claim::known::worst;
use crate::claim::statistics::Results;
use crate::claim::units::{Unit, units};
use crate::design::file::{ClaimTable, ClaimTest, ExperimentFile, FileError, Holds};
use crate::outcome::looks::Look;

/// A claim with its tests.
pub(crate) struct Judge<'a> {
    pub(crate) claim: &'a ClaimTable,
    /// The tests, for each output that the claim lists.
    pub(crate) cases: Vec<Vec<ClaimTest>>,
    /// The condition on results.
    pub(crate) given: Option<ClaimTest>,
    pub(crate) look: Look,
}

/// The result in one unit, which is judged by itself, with one of the outputs that the claim lists.
pub(crate) struct Found<'a> {
    pub(crate) tests: &'a [ClaimTest],
    pub(crate) unit: Unit,
    pub(crate) evidence: Evidence,
    /// The evidence on the claim's condition, if it has one.
    pub(crate) given: Option<Evidence>,
    /// The p-values with the condition.
    pub(crate) p_values: PValues,
    /// Whether the condition may be met: the others are left out.
    pub(crate) judged: bool,
}

impl<'a> Judge<'a> {
    /// Parses the tests of a claim, which is judged at a look.
    pub(crate) fn new(claim: &'a ClaimTable, look: Look) -> Result<Self, FileError> {
        Ok(Self {
            claim,
            cases: claim.cases()?,
            given: claim.given.as_ref().map(ClaimTest::from_table).transpose()?,
            look,
        })
    }

    /// Evaluates one of `among` units.
    fn find<'t>(&self, results: Results<'_>, tests: &'t [ClaimTest], unit: Unit, among: usize) -> Found<'t> {
        let evidence = Evidence::new(results, tests, &unit.members);
        let given = self.given.as_ref().map(std::slice::from_ref);
        let given = given.map(|given| Evidence::new(results, given, &unit.members));
        let condition = given.as_ref().map(Evidence::p_values);
        Found {
            tests,
            unit,
            p_values: with_condition(self.claim.holds, evidence.p_values(), condition),
            // Among so many cells some would miss the condition by chance (Bonferroni).
            judged: condition.is_none_or(|given| given.fail > self.level(self.look.share) / among as f64),
            evidence,
            given,
        }
    }

    /// Returns the level of the tests in the cells, at a look with this share. A condition takes half of the verdict's
    /// level, for the cells that are left out.
    pub(crate) fn level(&self, share: f64) -> f64 {
        let part = if self.given.is_some() { 0.5 } else { 1.0 };
        self.claim.level * share * part
    }

    /// Evaluates every unit of every case.
    pub(crate) fn found(&self, results: Results<'_>, file: &ExperimentFile) -> Result<Vec<Found<'_>>, String> {
        let mut all = Vec::new();
        for tests in &self.cases {
            let Some(first) = tests.first() else { continue };
            for unit in units(self.claim, first, file, results.summary)? {
                all.push((tests, unit));
            }
        }
        let among = all.len();
        let found = all.into_iter();
        let found = found.map(|(tests, unit)| self.find(results, tests, unit, among));
        Ok(found.collect())
    }
}

/// Returns the p-values of a cell in which the tests count only if a condition is met. Where the condition is open, a
/// cell counts as one of those that a verdict needs only if the condition is certain too. A verdict on all cells needs
/// no condition: it is right in a cell that is wrongly kept.
pub(crate) fn with_condition(holds: Holds, tests: PValues, condition: Option<PValues>) -> PValues {
    let met = condition.map_or(0.0, |given| given.pass);
    PValues {
        pass: match holds {
            Holds::Everywhere => tests.pass,
            Holds::Typically | Holds::Somewhere => worst(tests.pass, met),
        },
        fail: match holds {
            Holds::Somewhere => tests.fail,
            Holds::Everywhere | Holds::Typically => worst(tests.fail, met),
        },
    }
}
