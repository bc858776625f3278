//! The keys of an experiment file.

use crate::design::Measure;
use crate::design::file::table::tables;
use crate::design::file::{
    Axis, BoundTable, ChangeTable, ClaimTable, ContinuousPlantTable, ContinuousTable, CourseTable, CovariancesTable,
    Engine, FeedbackTable, InputTable, Key, MethodTable, Needs, NoiseTable, ObserverTable, PlantTable, QuickTable,
    SignalTable, SlopeTable, StudyKind, TrialRule, list,
};
use asobench_identification::names::named_enum;
use std::collections::BTreeMap;

named_enum! {
    /// The results that a study keeps.
    Store, "store" {
        /// Exact sums, counts and quantile sketches of every measure (the default).
        Summaries = "summaries",
        /// Also the rows of every trial, in one trials.parquet.
        Trials = "trials",
    }
}

named_enum! {
    /// The fate of trials whose search for the lowest minimum left a model that is not at one (status `boundary` or
    /// `iteration-limit`).
    Unfinished, "treatment" {
        /// They are failures, and lost (the default).
        Lost = "lost",
        /// Their models count as others do; the trials are still listed under these kinds, with "-counted".
        Counted = "counted",
    }
}

named_enum! {
    /// Whose Fisher information d and d_g are measured with.
    InformationOf, "information" {
        /// The information of a stationary record (the default); along an input that is the same in every trial, from
        /// rest.
        Stationary = "stationary",
        /// The information of each record from rest, with its own input or reference.
        Record = "record",
    }
}

tables! {
    /// A study: what is asked, the data-generating process, the grid, the methods, what is measured.
    pub struct ExperimentFile: Default {
        /// A title of a few words.
        title: String,
        /// The question, in words.
        question: String,
        /// The hypothesis that the study tests, in words.
        hypothesis: String,
        /// Where the system comes from, in words.
        source?: String,
        /// The claims that the study examines, with the tests that decide them.
        #[serde(with = "list")]
        #[schemars(schema_with = "list::schema")]
        claims: Vec<ClaimTable>,
        /// Whether the verdicts are corrected over all claims of the file (Holm), so that the smallest `level` of a
        /// claim is the error rate of all of them together, a side.
        family?: bool,
        /// In a resolved file: what the claims have added to the lists of measures, comparisons, bounds and slopes.
        needed?: Option<Needs>,
        /// How long it takes on two cores, in words.
        expected_time: String,
        /// The seed from which all random numbers follow.
        seed: u64 = 2023,
        /// In a resolved file of `run --confirm`: the seed of the file whose claims it confirms.
        confirms?: Option<u64>,
        /// Trials in each cell: a number, or a rule such as { until = "e_a", output = "iv(4)", relative_mcse = 0.01,
        /// minimum = 1000, maximum = 100000 }.
        trials: TrialRule = TrialRule::Fixed(1000),
        /// How many times the claims are to be judged, each time with more trials: their level is divided by it, and
        /// nothing is left for further looks. Without it there may be any number, and the first spends nine tenths of
        /// the level.
        looks?: Option<u32>,
        /// The engine that computes the trials: "auto", "lanes" or "faer".
        engine: Engine,
        /// The results that are kept: "summaries" or "trials".
        store: Store,
        /// Whether trials whose search left a model that is not at a minimum (`boundary`, `iteration-limit`) are "lost"
        /// (the default) or "counted".
        unfinished?: Unfinished,
        /// Whether the measurement noise begins at rest, as the plant does with x0 = 0, instead of being stationary.
        noise_from_rest?: bool,
        /// Whose Fisher information `d` and `d_g` are measured with: "stationary" (the default), or "record", that of
        /// each record from rest with its own input.
        information?: InformationOf,
        /// The measures that are computed and summarised.
        measures: Vec<Measure> = vec![
            Measure::Ea,
            Measure::Eb,
            Measure::Eh,
            Measure::Ex0,
            Measure::ExMax,
            Measure::ExRms,
            Measure::SpectralRadius,
            Measure::Condition,
        ],
        /// Whether the signed error of every coefficient of a and h is summarised too: bias, SD, RMSE.
        parameters: bool,
        /// Whether standard errors of every coefficient are computed, and how often their 95 % intervals contain the
        /// truth; includes what `parameters` gives.
        coverage?: bool,
        /// Whether quantiles of e_x(k) for every k are kept, for the first and the last output, over the first 10000
        /// trials of a cell.
        curves: bool,
        /// Errors over the number of samples seen.
        course?: Option<CourseTable>,
        /// Whether the methods' times are measured after the run; stored apart, under timing/.
        timing: bool,
        /// Whether figures of medians show the spread of the trials too, as bands or boxes. Without it they do for up
        /// to three outputs, over an axis of names up to four, since more would hide each other.
        spread?: Option<bool>,
        /// The settings: one value each, or a list or range, which makes an axis of the grid.
        settings: BTreeMap<Key, Axis>,
        /// Groups of settings whose lists move together.
        zip: Vec<Vec<Key>>,
        /// Cells that are left out: those with one of the given values of every given setting.
        exclude: Vec<BTreeMap<Key, Axis>>,
        /// Plants by name.
        plants: BTreeMap<String, PlantTable>,
        /// Changes of the plant during the record by name.
        changes?: BTreeMap<String, ChangeTable>,
        /// Inputs by name.
        inputs?: BTreeMap<String, InputTable>,
        /// Noise filters by name.
        noises: BTreeMap<String, NoiseTable>,
        /// Covariances of noise in the states and in the output by name, for `process_noise` and `observer =
        /// "kalman:NAME"`.
        covariances?: BTreeMap<String, CovariancesTable>,
        /// In a resolved file: the columns of CSV files that `input` and the noises name, by these names.
        columns?: BTreeMap<String, Vec<f64>>,
        /// Feedbacks by name.
        feedbacks: BTreeMap<String, FeedbackTable>,
        /// Makes it a study of observers in continuous time.
        continuous?: Option<ContinuousTable>,
        /// Plants in continuous time by name.
        continuous_plants?: BTreeMap<String, ContinuousPlantTable>,
        /// Disturbances in continuous time by name.
        signals?: BTreeMap<String, SignalTable>,
        /// Observers in continuous time, all run on the same trials.
        observers?: Vec<ObserverTable>,
        /// The methods, all run on the same records; a list in an option makes one method per value.
        methods: Vec<MethodTable> = vec![MethodTable::default()],
        /// Pairs of outputs that are compared on the same trials, such as `["iv(4)", "ls"]`.
        compare: Vec<[String; 2]>,
        /// Log-log slopes over an axis.
        slopes: Vec<SlopeTable>,
        /// Bounds whose share of trials is counted.
        bounds: Vec<BoundTable>,
        /// The changes by `--quick`: a run of a minute or less.
        quick: Option<QuickTable>,
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
