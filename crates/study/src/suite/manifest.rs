//! `suite/suite.toml`: which systems, settings and sizes, in which tier; and the files that the program carries.

use super::stored::SuiteError;
use crate::design::file::{Axis, ExperimentFile, Key};
use asobench_identification::names::{UnknownName, named_enum};
use serde::Deserialize;
use std::collections::BTreeMap;

include!(concat!(env!("OUT_DIR"), "/suite_files.rs"));

named_enum! {
    /// How much of the suite is run; each tier contains those before it.
    Tier, "tier" {
        /// A minute: what continuous integration runs (the default).
        Quick = "quick",
        /// A quarter of an hour on two cores.
        Standard = "standard",
        /// An evening, or a cluster.
        Full = "full",
    }
}

named_enum! {
    /// The knowledge that methods are given. Editions 1 have the divisions `closed` and `open`; from 2.0 on there are
    /// the contests `orders`, `structure` and `open`.
    Division, "contest" {
        /// Editions 1: the orders of the truth.
        Closed = "closed",
        /// na, nb and nk of the plant alone (the default from 2.0 on).
        Orders = "orders",
        /// Which polynomials the truth has, with their orders.
        Structure = "structure",
        /// Nothing but the record: methods choose. In editions 1 the delay too.
        Open = "open",
    }
}

impl Division {
    /// Whether it is the closed one.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
    pub(super) fn is_closed(&self) -> bool {
        *self == Self::Closed
    }

    /// Whether d is that of the response, since methods choose their orders.
    pub fn is_open(self) -> bool {
        self == Self::Open
    }
}

impl Tier {
    /// Whether a run of this tier has what belongs to another.
    pub fn contains(self, other: Self) -> bool {
        let place = |tier: Self| Self::ALL.iter().position(|of| *of == tier);
        place(other) <= place(self)
    }
}

/// The manifest.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The edition that was asked for, the current one if none was.
    #[serde(skip)]
    pub edition: String,
    /// All editions, the first one first. Each has the scenarios of those before it.
    pub editions: Vec<String>,
    /// The edition that a command takes which names none.
    pub current: String,
    /// The first edition with contests, weights by plant, and the information of each record.
    pub contests: String,
    /// The seed of all records.
    pub seed: u64,
    /// Trials of a scenario in each tier. The trials of a smaller tier are the first of a larger one.
    pub trials: BTreeMap<Tier, u64>,
    /// The same in editions with contests, where it is another number.
    pub contest_trials: BTreeMap<Tier, u64>,
    /// Trials of a plant of the bank in each tier.
    pub bank_trials: BTreeMap<Tier, u64>,
    /// The studies.
    pub studies: Vec<StudyEntry>,
}

/// A system with its settings, a table of the manifest or a line of the bank: an experiment with one scenario for each
/// N.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyEntry {
    /// The system: a file of `suite/`, or a plant of the bank.
    #[serde(alias = "name")]
    pub system: String,
    /// The part of its scenarios' names after the system's; none in the bank.
    #[serde(default)]
    pub variant: String,
    /// The smallest tier that has it.
    pub tier: Tier,
    /// The first edition that has it; the first of all if absent, in the bank the first with contests.
    #[serde(default)]
    pub since: Option<String>,
    /// The edition that withdrew it; none if absent.
    #[serde(default)]
    pub until: Option<String>,
    /// The system of a plant of the bank.
    #[serde(default)]
    file: Option<Box<ExperimentFile>>,
    /// The sizes N.
    pub window: Axis,
    /// Its difficulties, in the suite's words; colour, loop, delay and short records are added.
    #[serde(default)]
    pub hard: Vec<String>,
    /// Whether the system is one in continuous time, sampled behind a zero-order hold.
    #[serde(default)]
    pub sampled: bool,
    /// Its settings, besides those of the system's file.
    #[serde(default)]
    pub settings: BTreeMap<Key, Axis>,
}

/// The quantiles of d that are compared with those of the bound: a typical run and the worst decile.
pub const VALUES: [f64; 2] = [0.5, 0.9];

impl Manifest {
    /// Reads the manifest that the program carries, as it is in an edition or the current one. Later editions stay
    /// known, since their results serve an earlier one.
    ///
    /// # Errors
    /// If there is no such edition, or a fault in the manifest.
    pub fn read(edition: Option<&str>) -> Result<Self, SuiteError> {
        let read = toml::from_str(MANIFEST).map_err(SuiteError::of("suite/suite.toml"));
        let mut manifest: Self = read?;
        for line in BANK.lines() {
            let read = serde_json::from_str(line).map_err(SuiteError::of("suite/bank.jsonl"));
            manifest.studies.push(StudyEntry {
                since: Some(manifest.contests.clone()),
                ..read?
            });
        }
        manifest.edition = edition.unwrap_or(&manifest.current).to_owned();
        let mut studies = std::mem::take(&mut manifest.studies);
        let place = manifest.place_of(&manifest.edition);
        if place.is_none() {
            let unknown = UnknownName::new("edition", &manifest.edition, &manifest.editions);
            return Err(SuiteError::new(unknown));
        }
        let begins = |at: &str| manifest.place_of(at).is_some_and(|at| Some(at) <= place);
        studies.retain(|of| of.since.as_deref().is_none_or(begins) && !of.until.as_deref().is_some_and(begins));
        Ok(Self { studies, ..manifest })
    }

    /// Whether the edition has contests.
    pub fn has_contests(&self) -> bool {
        self.place_of(&self.edition) >= self.place_of(&self.contests)
    }

    /// Whether results of an edition are measured as those of this one: F, weights and contests.
    pub(super) fn is_alike(&self, edition: &str) -> bool {
        (self.place_of(edition) >= self.place_of(&self.contests)) == self.has_contests()
    }

    /// The place of an edition among all; `None` if there is no such one.
    pub(super) fn place_of(&self, edition: &str) -> Option<usize> {
        self.editions.iter().position(|of| of == edition)
    }

    /// Returns the number of trials of a scenario in a tier, or of a plant of the bank.
    pub fn trials_of(&self, tier: Tier, is_bank: bool) -> u64 {
        let trials = if is_bank { &self.bank_trials } else { &self.trials };
        let own = self.contest_trials.get(&tier);
        let own = own.filter(|_| !is_bank && self.has_contests());
        own.or_else(|| trials.get(&tier)).copied().unwrap_or(0)
    }
}

impl StudyEntry {
    /// The name of the study: the system and the variant, if there is one.
    pub(super) fn name(&self) -> String {
        match self.variant.as_str() {
            "" => self.system.clone(),
            variant => format!("{}-{variant}", self.system),
        }
    }

    /// Whether it is a plant of the bank.
    pub fn is_bank(&self) -> bool {
        self.file.is_some()
    }

    /// The system, as an experiment without methods.
    ///
    /// # Errors
    /// If there is no such one, or a fault in it.
    pub(super) fn file(&self) -> Result<ExperimentFile, SuiteError> {
        if let Some(file) = &self.file {
            return Ok((**file).clone());
        }
        let found = SYSTEMS.iter().find(|(of, _)| *of == self.system);
        let unknown = || SuiteError::new(UnknownName::new("system", &self.system, systems()));
        let (_, text) = found.ok_or_else(unknown)?;
        ExperimentFile::parse(text).map_err(SuiteError::of(self.name()))
    }
}

/// The names of the systems.
pub(super) fn systems() -> impl Iterator<Item = &'static str> {
    SYSTEMS.iter().map(|(name, _)| *name)
}

/// The shipped results of a division, one text for each method; `contests`: those of the editions with contests.
pub(super) fn results(division: Division, contests: bool) -> impl Iterator<Item = &'static str> {
    let all = match division {
        Division::Closed => RESULTS,
        Division::Orders => ORDERS_RESULTS,
        Division::Structure => STRUCTURE_RESULTS,
        Division::Open if contests => NOTHING_RESULTS,
        Division::Open => OPEN_RESULTS,
    };
    all.iter().map(|(_, text)| *text)
}
