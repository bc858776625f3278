//! Experiment files: TOML, or the same structure as JSON in a manifest with every default written out.

mod axis;
mod bounds;
mod claim;
mod claim_test;
mod columns;
mod continuous_tables;
mod grid;
mod key;
mod limits;
mod method;
mod parse;
mod rule;
mod tables;

pub use axis::{Axis, Scalar};
pub use bounds::BoundTable;
pub use claim::{
    CLAIM_LEVEL, ClaimStatistic, ClaimTable, Holds, MediansTable, Needs, SeriesTable, TestTable,
    TimeOf,
};
pub use claim_test::{ClaimTest, Limit, Outcome, TestKind, TestUnit, ValueOf};
pub use continuous_tables::{
    ContinuousPlantTable, ContinuousTable, FactorName, FilterTable, HoldName, ObserverName,
    ObserverTable, SignalTable, WaveName, WaveTable,
};
pub use grid::{CELL_LIMIT, Conditions, Settings, cells, conditions, matches, partners};
pub(in crate::study) use key::Time;
pub use key::{AUTOMATIC, Key};
pub(super) use limits::at_most;
pub use method::MethodTable;
pub use parse::{FileError, schema};
pub use rule::{TRIAL_LIMIT, TrialRule, Until, UntilDecided, UntilStatistic};
pub use tables::{FeedbackTable, NoiseTable, PlantTable, QuickTable, SlopeTable};

use super::engine::Engine;
use super::measure::Measure;
use asobench_identification::names::named_enum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

named_enum! {
    /// What a study keeps.
    Store, "store" {
        /// Exact sums, counts and quantile sketches of every measure (the default).
        Summaries = "summaries",
        /// Also the rows of every trial, in one trials.parquet.
        Trials = "trials",
    }
}

named_enum! {
    /// What becomes of trials whose search for the lowest minimum left a model that is not at one (status `boundary` or
    /// `iteration-limit`).
    Unfinished, "treatment" {
        /// They are failures, and lost (the default).
        Lost = "lost",
        /// Their models count as others do; the trials are still listed under these kinds, with "-counted".
        Counted = "counted",
    }
}

impl Unfinished {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "what serde calls")]
    fn is_lost(&self) -> bool {
        *self == Self::Lost
    }
}

/// A study: what is asked, the data-generating process, the grid, the methods, what is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a key of its own")]
pub struct ExperimentFile {
    /// A title of a few words.
    pub title: String,
    /// The question, in words.
    pub question: String,
    /// The hypothesis that the study tests, in words.
    pub hypothesis: String,
    /// The claims that the study examines, with the tests that decide them.
    #[serde(with = "claim::list")]
    #[schemars(schema_with = "claim::list::schema")]
    pub claims: Vec<ClaimTable>,
    /// Whether the verdicts are corrected over all claims of the file (Holm), so that the smallest `level` of a claim is
    /// the error rate of all of them together, a side.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub family: bool,
    /// In a resolved file: what the claims have added to the lists of measures, comparisons, bounds and slopes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needed: Option<Needs>,
    /// How long it takes on two cores, in words.
    pub expected_time: String,
    /// The seed from which all random numbers follow.
    pub seed: u64,
    /// In a resolved file of `run --confirm`: the seed of the file whose claims it confirms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirms: Option<u64>,
    /// Trials in each cell: a number, or a rule such as { until = "e_a", output = "iv(4)", relative_mcse = 0.01,
    /// minimum = 1000, maximum = 100000 }.
    pub trials: TrialRule,
    /// How many times the claims are to be judged, each time with more trials: their level is divided by it, and nothing
    /// is left for further looks. Without it there may be any number, and the first spends nine tenths of the level.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub looks: Option<u32>,
    /// What computes the trials: "auto", "lanes" or "faer".
    pub engine: Engine,
    /// What is kept: "summaries" or "trials".
    pub store: Store,
    /// Whether trials whose search left a model that is not at a minimum (`boundary`, `iteration-limit`) are "lost" (the
    /// default) or "counted".
    #[serde(skip_serializing_if = "Unfinished::is_lost")]
    pub unfinished: Unfinished,
    /// The measures that are computed and summarised.
    pub measures: Vec<Measure>,
    /// Whether the signed error of every coefficient of a and h is summarised too: bias, SD, RMSE.
    pub parameters: bool,
    /// Whether standard errors of every coefficient are computed, and how often their 95 % intervals contain the truth;
    /// includes what `parameters` gives.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub coverage: bool,
    /// Whether quantiles of e_x(k) for every k are kept, for the first and the last output.
    pub curves: bool,
    /// Whether the methods' times are measured after the run; stored apart, under timing/.
    pub timing: bool,
    /// The settings: one value each, or a list or range, which makes an axis of the grid.
    pub settings: BTreeMap<Key, Axis>,
    /// Groups of settings whose lists move together.
    pub zip: Vec<Vec<Key>>,
    /// Cells that are left out: those with one of the given values of every given setting.
    pub exclude: Vec<BTreeMap<Key, Axis>>,
    /// Plants by name.
    pub plants: BTreeMap<String, PlantTable>,
    /// Noise filters by name.
    pub noises: BTreeMap<String, NoiseTable>,
    /// In a resolved file: the columns of CSV files that `input` and the noises name, by these names.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub columns: BTreeMap<String, Vec<f64>>,
    /// Feedbacks by name.
    pub feedbacks: BTreeMap<String, FeedbackTable>,
    /// Makes it a study of observers in continuous time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub continuous: Option<ContinuousTable>,
    /// Plants in continuous time by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub continuous_plants: BTreeMap<String, ContinuousPlantTable>,
    /// Disturbances in continuous time by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub signals: BTreeMap<String, SignalTable>,
    /// Observers in continuous time, all run on the same trials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub observers: Vec<ObserverTable>,
    /// The methods, all run on the same records; a list in an option makes one method per value.
    pub methods: Vec<MethodTable>,
    /// Pairs of outputs that are compared on the same trials, such as `["iv(4)", "ls"]`.
    pub compare: Vec<[String; 2]>,
    /// Log-log slopes over an axis.
    pub slopes: Vec<SlopeTable>,
    /// Bounds whose share of trials is counted.
    pub bounds: Vec<BoundTable>,
    /// What `--quick` changes: a run of a minute or less.
    pub quick: Option<QuickTable>,
}

impl Default for ExperimentFile {
    fn default() -> Self {
        Self {
            title: String::new(),
            question: String::new(),
            hypothesis: String::new(),
            claims: Vec::new(),
            family: false,
            needed: None,
            expected_time: String::new(),
            seed: 2023,
            confirms: None,
            trials: TrialRule::Fixed(1000),
            looks: None,
            engine: Engine::default(),
            store: Store::default(),
            unfinished: Unfinished::default(),
            measures: vec![
                Measure::Ea,
                Measure::Eb,
                Measure::Eh,
                Measure::Ex0,
                Measure::ExMax,
                Measure::ExRms,
                Measure::SpectralRadius,
                Measure::Condition,
            ],
            parameters: false,
            coverage: false,
            curves: false,
            timing: false,
            settings: BTreeMap::new(),
            zip: Vec::new(),
            exclude: Vec::new(),
            plants: BTreeMap::new(),
            noises: BTreeMap::new(),
            columns: BTreeMap::new(),
            feedbacks: BTreeMap::new(),
            continuous: None,
            continuous_plants: BTreeMap::new(),
            signals: BTreeMap::new(),
            observers: Vec::new(),
            methods: vec![MethodTable::default()],
            compare: Vec::new(),
            slopes: Vec::new(),
            bounds: Vec::new(),
            quick: None,
        }
    }
}

impl ExperimentFile {
    /// Applies the changes of `[quick]` to the file.
    #[must_use]
    pub fn quick(mut self) -> Self {
        if let Some(quick) = self.quick.take() {
            self.trials = TrialRule::Fixed(quick.trials);
            self.settings.extend(quick.settings);
        }
        self
    }

    /// Checks that every entry of `exclude`, every claim and every bound's claim applies to at least one cell. Checks
    /// the file as written: `--quick` and `--set` may leave them without a cell.
    ///
    /// # Errors
    /// The first that applies to no cell. If the grid itself is wrong, nothing is checked.
    pub fn check_filters(&self) -> Result<(), FileError> {
        let Ok(resolved) = self.clone().resolve() else {
            return Ok(());
        };
        let Ok(all) = cells(&resolved.settings, &resolved.zip, &[]) else {
            return Ok(());
        };
        for (i, table) in self.exclude.iter().enumerate() {
            let conditions = conditions(table);
            if !all.iter().any(|cell| matches(cell, &conditions)) {
                let message = "no cell has these values; expected values from [settings]";
                return Err(FileError::key(&format!("exclude[{i}]"), message));
            }
        }
        super::claims::check_cells(&resolved, &all)?;
        for (i, bound) in self.bounds.iter().enumerate() {
            let Some(claim) = &bound.claim else { continue };
            let of = |cell: &Settings| cell.get(&Key::Claim).map(ToString::to_string);
            if !all.iter().any(|cell| of(cell).as_ref() == Some(claim)) {
                let message =
                    format!("no cell has the claim '{claim}'; expected one of the setting 'claim'");
                return Err(FileError::key(&format!("bounds[{i}].claim"), message));
            }
        }
        Ok(())
    }

    /// Refuses keys that belong to the other kind of study.
    fn check_kind(&self) -> Result<(), FileError> {
        let continuous = self.continuous.is_some();
        let kind = if continuous {
            "continuous time (the file has [continuous])"
        } else {
            "discrete time (the file has no [continuous])"
        };
        let wrong = |key: &str| {
            let message = format!("is not used in a study in {kind}");
            Err(FileError::key(key, message))
        };
        // The same error, with the names that this kind of study has.
        let instead = |key: &str, names: Vec<&str>| {
            let message = format!(
                "is not used in a study in {kind}; expected one of {}",
                names.join(", ")
            );
            Err(FileError::key(key, message))
        };
        if let Some(key) = self.settings.keys().find(|key| !key.is_of(continuous)) {
            let known = Key::ALL.iter().filter(|key| key.is_of(continuous));
            return instead(key.name(), known.map(|key| key.name()).collect());
        }
        let default = Self::default();
        let measured = self
            .measures
            .iter()
            .find(|measure| !measure.is_of(continuous));
        if let Some(measure) = measured.filter(|_| self.measures != default.measures) {
            let known = Measure::ALL.iter().filter(|of| of.is_of(continuous));
            let key = format!("measures: '{measure}'");
            return instead(&key, known.map(|of| of.name()).collect());
        }
        let given = [
            (
                "methods",
                continuous && self.methods != default.methods && !self.methods.is_empty(),
            ),
            ("plants", continuous && !self.plants.is_empty()),
            ("noises", continuous && !self.noises.is_empty()),
            ("feedbacks", continuous && !self.feedbacks.is_empty()),
            ("parameters", continuous && self.parameters),
            ("coverage", continuous && self.coverage),
            ("curves", continuous && self.curves),
            ("timing", continuous && self.timing),
            (
                "unfinished",
                continuous && self.unfinished == Unfinished::Counted,
            ),
            (
                "continuous_plants",
                !continuous && !self.continuous_plants.is_empty(),
            ),
            ("signals", !continuous && !self.signals.is_empty()),
            ("observers", !continuous && !self.observers.is_empty()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((key, _)) => wrong(key),
            None => Ok(()),
        }
    }

    /// Writes out every default, except those of [`Key::is_left_out`]: settings, and one table per method.
    ///
    /// # Errors
    /// If both `l` and `window` are given, or a method's options contradict each other.
    pub fn resolve(mut self) -> Result<Self, FileError> {
        if self.settings.contains_key(&Key::L) && self.settings.contains_key(&Key::Window) {
            let message = "cannot be set together with 'window' (N = 3n + 2l)";
            return Err(FileError::key("l", message));
        }
        let continuous = self.continuous.is_some();
        self.check_kind()?;
        self.check_lengths()?;
        if continuous {
            self.methods.clear();
            if self.measures == Self::default().measures {
                self.measures = vec![
                    Measure::RmsState,
                    Measure::Theta,
                    Measure::ThetaRms,
                    Measure::StepError,
                ];
            }
        }
        for key in Key::ALL {
            let absent = *key == Key::Window && self.settings.contains_key(&Key::L);
            if let Some(default) = key.default_of(continuous).filter(|_| !absent) {
                self.settings.entry(*key).or_insert(Axis::One(default));
            }
        }
        // Ranges and lists of counts become the values that they stand for.
        for (key, axis) in &mut self.settings {
            let mut values = axis.values(key.is_count());
            *axis = match (axis.clone(), values.len()) {
                (Axis::One(_), _) | (_, 1) => Axis::One(values.swap_remove(0)),
                _ => Axis::Many(values),
            };
        }
        self.settings.retain(|key, axis| {
            let default = key.default().map(Axis::One);
            !(key.is_left_out() && Some(&*axis) == default.as_ref())
        });
        self.drop_columns();
        for (name, noise) in &mut self.noises {
            let resolved = std::mem::take(noise).resolve();
            let wrong = |message: String| FileError::key(&format!("noises.{name}"), message);
            *noise = resolved.map_err(wrong)?;
        }
        let methods = self.methods.iter().enumerate();
        let expanded: Result<Vec<Vec<MethodTable>>, FileError> =
            methods.map(|(i, method)| method.expand(i)).collect();
        self.methods = expanded?.concat();
        self.check_lengths()?;
        self.add_needs();
        self.measures.sort_unstable();
        self.measures.dedup();
        self.quick = None;
        Ok(self)
    }
}
