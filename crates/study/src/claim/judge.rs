//! Judges claims by the results of a study.

use crate::claim::decision_rule::Cells;
use crate::claim::decision_rule::PValues;
use crate::claim::decision_rule::Verdict;
use crate::claim::decision_rule::certain_count;
use crate::claim::decision_rule::decide;
use crate::claim::evidence::Evidence;
use crate::claim::evidence::Part;
use crate::claim::family::Family;
use crate::claim::family::strictest;
use crate::claim::interval::FAIL;
use crate::claim::interval::LEFT_OUT;
use crate::claim::interval::Levels;
use crate::claim::interval::PASS;
use crate::claim::judged::{Judged, JudgedCell, JudgedNumber, JudgedTest, added, undecided};
use crate::claim::known::worst;
use crate::claim::power::Open;
use crate::claim::power::Undecided;
use crate::claim::sentence::Findings;
use crate::claim::sentence::UnitFindings;
use crate::claim::statistics::Results;
use crate::claim::units::Unit;
use crate::claim::units::units;
use crate::claim::{sentence, standing};
use crate::design::file::{ClaimTable, ClaimTest, ExperimentFile, Holds, TrialRule};
use crate::outcome::looks::Look;
use crate::outcome::method_times::MethodTime;
use crate::outcome::place::Place;
use crate::outcome::place::varying;
use crate::outcome::summary::Summary;

/// Judges every claim of a resolved file that has a test by the results of the study.
/// `look` says what the verdicts may spend of the claims' level.
pub fn judge(file: &ExperimentFile, summary: &Summary, times: &[MethodTime], look: Look) -> Vec<Judged> {
    let claims = file.claims.iter().filter(|claim| !claim.test.is_empty());
    let claims: Vec<&ClaimTable> = claims.collect();
    let alone = |claim: &ClaimTable| judge_at(claim, look, file, summary, times);
    let mut judged: Vec<Judged> = match Family::of(file) {
        Some(family) => family.judge(&claims, alone),
        None => claims.iter().map(|claim| alone(claim)).collect(),
    };
    for (claim, judged) in claims.into_iter().zip(&mut judged) {
        standing::mark(judged, claim, file);
    }
    judged
}

/// Whether results decide the claim until which the trials of a file continue.
pub fn decides(file: &ExperimentFile, summary: &Summary, look: Look) -> bool {
    let TrialRule::Decided(until) = &file.trials else {
        return true;
    };
    let claim = file.claims.iter().find(|claim| claim.id == until.claim);
    claim.is_none_or(|claim| {
        let claim = &strictest(claim, file);
        verdict_at(claim, look, file, summary) != Verdict::Undecided
    })
}

/// Returns the verdict on one claim at a look, without its sentence and the trials that would decide it.
pub(crate) fn verdict_at(claim: &ClaimTable, look: Look, file: &ExperimentFile, summary: &Summary) -> Verdict {
    let given = claim.given.as_ref().map(ClaimTest::from_table).transpose();
    let (Ok(cases), Ok(given)) = (claim.cases(), given) else {
        return Verdict::Undecided;
    };
    let judge = Judge {
        claim,
        cases: &cases,
        given: given.as_ref(),
        look,
    };
    let results = Results { summary, times: &[] };
    let Ok(found) = judge.found(results, file) else {
        return Verdict::Undecided;
    };
    let kept = found.iter().filter(|found| found.judged);
    let kept: Vec<PValues> = kept.map(|found| found.p_values).collect();
    let cells = Cells {
        judged: &kept,
        among: found.len(),
    };
    decide(claim.holds, cells, judge.level(look.share))
}

/// Judges one claim at a look.
pub fn judge_at(
    claim: &ClaimTable,
    look: Look,
    file: &ExperimentFile,
    summary: &Summary,
    times: &[MethodTime],
) -> Judged {
    let given = claim.given.as_ref().map(ClaimTest::from_table).transpose();
    let level = claim.level * look.share;
    match (claim.cases(), given) {
        (Ok(cases), Ok(given)) => {
            let results = Results { summary, times };
            let judge = Judge {
                claim,
                cases: &cases,
                given: given.as_ref(),
                look,
            };
            judge.judge(results, file)
        }
        (Err(error), _) | (_, Err(error)) => undecided(claim, level, &error.to_string()),
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

/// The fewest trials in each cell from which the number needed for a decision is computed.
pub(crate) const FEWEST_FOR_POWER: u64 = 20;

/// A claim with its tests.
pub(crate) struct Judge<'a> {
    claim: &'a ClaimTable,
    cases: &'a [Vec<ClaimTest>],
    given: Option<&'a ClaimTest>,
    look: Look,
}

/// The result in one unit.
pub(crate) struct Found<'a> {
    tests: &'a [ClaimTest],
    unit: Unit,
    evidence: Evidence,
    /// The evidence on the claim's condition, if it has one.
    given: Option<Evidence>,
    /// The p-values with the condition.
    p_values: PValues,
    /// Whether the condition may be met: the others are left out.
    judged: bool,
}

impl<'a> Judge<'a> {
    /// Evaluates one of `among` units.
    fn find(&self, results: Results<'_>, tests: &'a [ClaimTest], unit: Unit, among: usize) -> Found<'a> {
        let evidence = Evidence::new(results, tests, &unit.members);
        let given = self.given.map(std::slice::from_ref);
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
    fn level(&self, share: f64) -> f64 {
        let part = if self.given.is_some() { 0.5 } else { 1.0 };
        self.claim.level * share * part
    }

    /// Evaluates every unit of every case.
    fn found(&self, results: Results<'_>, file: &ExperimentFile) -> Result<Vec<Found<'a>>, String> {
        let mut all = Vec::new();
        for tests in self.cases {
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

    fn judge(&self, results: Results<'_>, file: &ExperimentFile) -> Judged {
        let found = match self.found(results, file) {
            Ok(found) => found,
            Err(why) => return undecided(self.claim, self.claim.level * self.look.share, &why),
        };
        let among = found.len();
        let kept: Vec<&Found> = found.iter().filter(|found| found.judged).collect();
        let p_values: Vec<PValues> = kept.iter().map(|found| found.p_values).collect();
        let holds = self.claim.holds;
        let judged = Cells {
            judged: &p_values,
            among,
        };
        let level = self.level(self.look.share);
        let verdict = decide(holds, judged, level);
        let trials = |found: &&Found| results.trials(&found.unit.members);
        let enough = kept.iter().all(|found| trials(found) >= FEWEST_FOR_POWER);
        let open = verdict == Verdict::Undecided && !kept.is_empty();
        let needed = (open && enough).then(|| {
            let cells: Vec<Open> = kept
                .iter()
                .map(|found| Open {
                    evidence: &found.evidence,
                    given: found.given.as_ref(),
                    trials: trials(found),
                })
                .collect();
            Undecided {
                cells: &cells,
                among,
                holds,
                level: self.level(self.look.next),
            }
            .needed()
        });
        let [passing, failing] = judged.certain(holds, level);
        let (pass, fail): (Vec<f64>, Vec<f64>) = p_values.iter().map(|cell| (cell.pass, cell.fail)).unzip();
        let units: Vec<UnitFindings> = kept
            .iter()
            .map(|found| UnitFindings {
                tests: found.tests,
                place: found.unit.place.clone(),
                evidence: &found.evidence,
            })
            .collect();
        let findings = Findings {
            holds,
            cases: self.cases,
            given: self.given,
            units: &units,
            left_out: among - kept.len(),
            passing: &passing,
            failing: &failing,
            at_least: [(pass, holds.passes(kept.len())), (fail, holds.fails(kept.len()))]
                .map(|(p, first)| certain_count(&p, first, among, level)),
            verdict,
            needed,
            look: self.look,
            level: self.claim.level,
        };
        let sentence = findings.sentence();
        let mut judged = undecided(self.claim, self.claim.level * self.look.share, "");
        judged.verdict = verdict;
        let added = added(self.claim);
        judged.line = format!("{}  {verdict}{sentence}{added}", self.claim.id);
        judged.needed = needed;
        let mut tests = self.cases.iter().flatten().chain(self.given);
        judged.timed = tests.any(ClaimTest::is_timed);
        let tests = 0..self.claim.test.len();
        judged.tests = tests.map(|test| JudgedTest::new(&findings.any(test))).collect();
        judged.cells = self.cells(&found, &passing, &failing);
        judged
    }

    /// Returns the table of the cells; `passing` and `failing` are indices among the judged ones.
    fn cells(&self, found: &[Found], passing: &[usize], failing: &[usize]) -> Vec<JudgedCell> {
        let places: Vec<Place> = found.iter().map(|found| found.unit.place.clone()).collect();
        let keys = varying(&places);
        let mut judged = 0;
        let kept = found.iter().filter(|found| found.judged).count();
        let certain = [passing.len(), failing.len()];
        let whole = self.level(self.look.share);
        let levels = Levels::new(self.claim.holds, certain, kept, found.len(), whole);
        let cell = |found: &Found| {
            let index = judged;
            judged += usize::from(found.judged);
            let parts = found.evidence.parts.iter();
            let case = found.tests.first().filter(|_| self.cases.len() > 1);
            let case = case.map(sentence::of_and_to);
            let says = match found.judged {
                false => LEFT_OUT,
                true if passing.contains(&index) => PASS,
                true if failing.contains(&index) => FAIL,
                true => "open",
            };
            let level = levels.of(says);
            let count = found.evidence.parts.len() + found.evidence.missing.len();
            let number = |part| {
                let interval = Part::interval(part, says, level.unwrap_or(whole), count);
                number(found.tests, part, interval)
            };
            JudgedCell {
                cells: found.unit.members.cells(),
                place: {
                    let parts = [Some(found.unit.place.words(&keys)), case.clone()];
                    let parts = parts.into_iter().flatten().filter(|part| !part.is_empty());
                    parts.collect::<Vec<String>>().join(", ")
                },
                case,
                says,
                p_pass: found.p_values.pass,
                p_fail: found.p_values.fail,
                level,
                numbers: parts.map(number).collect(),
                missing: found.evidence.missing.clone(),
            }
        };
        found.iter().map(cell).collect()
    }
}

pub(crate) fn number(tests: &[ClaimTest], part: &Part, interval: [f64; 2]) -> JudgedNumber {
    let test = &tests[part.test];
    let (value, error) = part.number.known.shown();
    JudgedNumber {
        test: part.test,
        what: sentence::noun(test, part.number.name.as_deref()),
        text: sentence::value(test, part),
        value,
        error,
        interval,
        kept: part.number.kept,
    }
}
