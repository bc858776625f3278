//! A judged claim: its verdict, its tests and their numbers.

use crate::claim::decision_rule::Verdict;
use crate::claim::needed::Needed;
use crate::claim::scale::Scale;
use crate::claim::sentence;
use crate::design::file::{ClaimTable, ClaimTest};
use asobench_identification::names::named_enum;
use serde::Serialize;
named_enum! {
    /// How a claim came about.
    Standing, "standing" {
        /// It was there before the results.
        Planned = "planned",
        /// Its author had seen results of the same kind.
        Exploratory = "exploratory",
        /// It was written after these results were there.
        Added = "added after the run",
        /// It was there before these results, which are of another seed than those of its file.
        Confirmation = "confirmation",
    }
}

/// A claim with its verdict from the results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// The claim's name in its file.
    pub id: String,
    /// The claim, in words.
    pub text: String,
    /// Who claims it.
    pub source: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The one-sided error rate of the verdict.
    pub level: f64,
    /// One line: "W1  holds: in all 12 cells ...".
    pub line: String,
    /// The number of trials in every cell that would decide it, if it is undecided and more trials help.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needed: Option<Needed>,
    /// Whether it was planned, exploratory, added after the run, or judged by the trials of a confirmation.
    pub standing: Standing,
    /// Whether the claim was written after the results were made.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub added_after_run: bool,
    /// Whether it uses times, which differ between machines and runs.
    pub timed: bool,
    /// Its tests.
    pub tests: Vec<JudgedTest>,
    /// Every cell to which the claim applies.
    pub cells: Vec<JudgedCell>,
}

/// A test of a claim.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedTest {
    /// The quantity that it looks at: "the median e_a of iv(4)".
    pub what: String,
    /// The limit in words: "below 1".
    pub must: String,
    /// The limit as numbers; one of them may be infinite.
    pub limits: [f64; 2],
    /// The scale on which its numbers are compared.
    pub scale: Scale,
}

/// The result of a claim in one cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedCell {
    /// The indices of the cells: one, the two that are compared, or those of a slope.
    pub cells: Vec<usize>,
    /// The cell in words, with the output if the claim lists several.
    pub place: String,
    /// That output, or pair of outputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub case: Option<String>,
    /// "pass", "fail" or "open"; "left out" if the claim's condition is certainly not met.
    pub says: &'static str,
    /// The p-value of "the tests do not pass"; small if they certainly pass.
    pub p_pass: f64,
    /// The p-value of "the tests do not fail"; small if they certainly fail.
    pub p_fail: f64,
    /// The level at which `says` was decided: that of the claim after Holm's correction over its cells. A cell passes
    /// if `p_pass` is at most this, fails if `p_fail` is, and is open if neither is. None if the cell is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<f64>,
    /// Every number that was looked at.
    pub numbers: Vec<JudgedNumber>,
    /// Why numbers are missing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}

/// A number behind a verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedNumber {
    /// The index of the test that looks at it.
    pub test: usize,
    /// The quantity: "the median e_a of iv(4)". A test of every coefficient has several numbers.
    pub what: String,
    /// The number with its error: "0.0879(5)"; a share in per cent.
    pub text: String,
    /// The value; infinite if it is that of a trial without a measure.
    pub value: f64,
    /// Its standard error; NaN if it has none.
    pub error: f64,
    /// Its interval at the level of its cell, or at the level of the claim if the cell is left out. The limit is beyond
    /// an end exactly if this number is certain. An end is infinite if the trials do not tell it.
    pub interval: [f64; 2],
    /// The share of trials that it covers, if not all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<f64>,
}

pub(crate) fn added(claim: &ClaimTable) -> &'static str {
    if claim.added_after_run {
        " Added or changed after the run."
    } else {
        ""
    }
}

pub(crate) fn undecided(claim: &ClaimTable, level: f64, why: &str) -> Judged {
    let verdict = Verdict::Undecided;
    Judged {
        id: claim.id.clone(),
        text: claim.text.clone(),
        source: claim.source.clone(),
        verdict,
        level,
        line: format!("{}  {verdict}: {why}.{}", claim.id, added(claim)),
        needed: None,
        standing: Standing::default(),
        added_after_run: claim.added_after_run,
        timed: false,
        tests: Vec::new(),
        cells: Vec::new(),
    }
}

impl JudgedTest {
    pub(crate) fn new(test: &ClaimTest) -> Self {
        Self {
            what: sentence::noun(test, None),
            must: sentence::must(test),
            limits: test.limit.ends(),
            scale: Scale::for_test(test),
        }
    }
}
