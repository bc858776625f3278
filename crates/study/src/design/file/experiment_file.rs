//! The keys of an experiment file.

use crate::design::file::axis::Axis;
use crate::design::file::bounds::BoundTable;
use crate::design::file::claim::{ClaimTable, list};
use crate::design::file::continuous_tables::{ContinuousPlantTable, ContinuousTable, SignalTable};
use crate::design::file::course_table::CourseTable;
use crate::design::file::engine::Engine;
use crate::design::file::input_table::InputTable;
use crate::design::file::key::{Key, StudyKind};
use crate::design::file::method::MethodTable;
use crate::design::file::needs::Needs;
use crate::design::file::observer_table::ObserverTable;
use crate::design::file::rule::TrialRule;
use crate::design::file::tables::{
    ChangeTable, FeedbackTable, NoiseTable, PlantTable, QuickTable, SlopeTable,
};
use crate::design::measure::Measure;
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
    /// Where the system comes from, in words.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// The claims that the study examines, with the tests that decide them.
    #[serde(with = "list")]
    #[schemars(schema_with = "list::schema")]
    pub claims: Vec<ClaimTable>,
    /// Whether the verdicts are corrected over all claims of the file (Holm), so that the smallest `level` of a claim
    /// is the error rate of all of them together, a side.
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
    /// How many times the claims are to be judged, each time with more trials: their level is divided by it, and
    /// nothing is left for further looks. Without it there may be any number, and the first spends nine tenths of the
    /// level.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub looks: Option<u32>,
    /// What computes the trials: "auto", "lanes" or "faer".
    pub engine: Engine,
    /// What is kept: "summaries" or "trials".
    pub store: Store,
    /// Whether trials whose search left a model that is not at a minimum (`boundary`, `iteration-limit`) are "lost"
    /// (the default) or "counted".
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
    /// Whether quantiles of e_x(k) for every k are kept, for the first and the last output, over the first 10000 trials
    /// of a cell.
    pub curves: bool,
    /// Errors over the number of samples seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub course: Option<CourseTable>,
    /// Whether the methods' times are measured after the run; stored apart, under timing/.
    pub timing: bool,
    /// Whether figures of medians show the spread of the trials too, as bands or boxes. Without it they do for up to
    /// three outputs, over an axis of names up to four, since more would hide each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spread: Option<bool>,
    /// The settings: one value each, or a list or range, which makes an axis of the grid.
    pub settings: BTreeMap<Key, Axis>,
    /// Groups of settings whose lists move together.
    pub zip: Vec<Vec<Key>>,
    /// Cells that are left out: those with one of the given values of every given setting.
    pub exclude: Vec<BTreeMap<Key, Axis>>,
    /// Plants by name.
    pub plants: BTreeMap<String, PlantTable>,
    /// Changes of the plant during the record by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub changes: BTreeMap<String, ChangeTable>,
    /// Inputs by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub inputs: BTreeMap<String, InputTable>,
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
            source: String::new(),
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
            course: None,
            timing: false,
            spread: None,
            settings: BTreeMap::new(),
            zip: Vec::new(),
            exclude: Vec::new(),
            plants: BTreeMap::new(),
            changes: BTreeMap::new(),
            inputs: BTreeMap::new(),
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
    /// The kind of the study.
    pub fn kind(&self) -> StudyKind {
        match self.continuous {
            Some(_) => StudyKind::Continuous,
            None => StudyKind::Discrete,
        }
    }
}
