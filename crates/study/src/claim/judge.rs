//! Judges claims by the results of a study.

use crate::claim::decision_rule::{Cells, PValues, Verdict, certain_count, decide};
use crate::claim::evidence::Part;
use crate::claim::family::{Family, strictest};
use crate::claim::found::{Found, Judge};
use crate::claim::interval::{FAIL, LEFT_OUT, Levels, PASS};
use crate::claim::judged::{Judged, JudgedCell, JudgedNumber, JudgedTest, added, undecided};
use crate::claim::power::{Open, Undecided};
use crate::claim::sentence::Findings;
use crate::claim::statistics::Results;
use crate::claim::{sentence, standing};
use crate::design::file::{ClaimTable, ClaimTest, ExperimentFile, TrialRule};
use crate::outcome::looks::Look;
use crate::outcome::method_times::MethodTime;
use crate::outcome::place::{Place, varying};
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
    let results = Results { summary, times: &[] };
    let Ok(judge) = Judge::new(claim, look) else {
        return Verdict::Undecided;
    };
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
    let results = Results { summary, times };
    let judge = Judge::new(claim, look).map_err(|error| error.to_string());
    let judged = judge.and_then(|judge| judge.judge(results, file));
    judged.unwrap_or_else(|why| undecided(claim, claim.level * look.share, &why))
}

/// The fewest trials in each cell from which the number needed for a decision is computed.
pub(crate) const FEWEST_FOR_POWER: u64 = 20;

impl Judge<'_> {
    fn judge(&self, results: Results<'_>, file: &ExperimentFile) -> Result<Judged, String> {
        let found = self.found(results, file)?;
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
            let open = kept.iter().map(|found| Open {
                evidence: &found.evidence,
                given: found.given.as_ref(),
                trials: trials(found),
            });
            Undecided {
                cells: &open.collect::<Vec<_>>(),
                among,
                holds,
                level: self.level(self.look.next),
            }
            .needed()
        });
        let [passing, failing] = judged.certain(holds, level);
        let (pass, fail): (Vec<f64>, Vec<f64>) = p_values.iter().map(|cell| (cell.pass, cell.fail)).unzip();
        let findings = Findings {
            judge: self,
            units: &kept,
            left_out: among - kept.len(),
            passing: &passing,
            failing: &failing,
            at_least: [(pass, holds.passes(kept.len())), (fail, holds.fails(kept.len()))]
                .map(|(p, first)| certain_count(&p, first, among, level)),
            verdict,
            needed,
        };
        let sentence = findings.sentence();
        let mut judged = undecided(self.claim, self.claim.level * self.look.share, "");
        judged.verdict = verdict;
        let added = added(self.claim);
        judged.line = format!("{}  {verdict}{sentence}{added}", self.claim.id);
        judged.needed = needed;
        let mut tests = self.cases.iter().flatten().chain(&self.given);
        judged.timed = tests.any(ClaimTest::is_timed);
        let tests = 0..self.claim.test.len();
        judged.tests = tests.map(|test| JudgedTest::new(&findings.any(test))).collect();
        judged.cells = self.cells(&found, &passing, &failing);
        Ok(judged)
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
