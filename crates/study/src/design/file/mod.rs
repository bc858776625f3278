//! Experiment files: TOML, or the same structure as JSON in a manifest with every default written out.

pub(crate) mod axis;
pub(crate) mod bounds;
pub(crate) mod claim;
pub(crate) mod claim_statistic;
pub(crate) mod claim_test;
pub(crate) mod columns;
pub(crate) mod continuous_tables;
pub(crate) mod course_table;
pub(crate) mod engine;
pub(crate) mod error;
pub(crate) mod experiment_file;
pub(crate) mod grid;
pub(crate) mod input_table;
pub(crate) mod key;
pub(crate) mod lengths;
pub(crate) mod limits;
pub(crate) mod lists;
pub(crate) mod method;
pub(crate) mod needed_by_claims;
pub(crate) mod needs;
pub(crate) mod observer_table;
pub(crate) mod only;
pub(crate) mod parse;
pub(crate) mod resolve;
pub(crate) mod rule;
pub(crate) mod sampled_plant;
pub(crate) mod table;
pub(crate) mod tables;
pub(crate) mod test_table;
pub(crate) mod theory_reference;

pub use axis::{Axis, Scalar};
pub use bounds::BoundTable;
pub use claim::{CLAIM_LEVEL, ClaimTable, Holds};
pub use claim_statistic::{CoefficientStatistic, RatioStatistic, ValueStatistic};
pub use claim_test::{ClaimTest, Limit, Outcome, TestKind, TestUnit};
pub use continuous_tables::{
    ContinuousPlantTable, ContinuousTable, FilterTable, HoldName, SignalTable, WaveName, WaveTable,
};
pub use course_table::CourseTable;
pub use error::FileError;
pub use experiment_file::{ExperimentFile, InformationOf, Store, Unfinished};
pub use grid::{CELL_LIMIT, Conditions, Settings, cells, conditions, matches, partners};
pub use input_table::InputTable;
pub use key::{AUTOMATIC, Entry as KeyEntry, Key, StudyKind};
pub use method::MethodTable;
pub use needs::{JointTable, Needs, SeriesTable};
pub use observer_table::{FactorName, ObserverOptions, ObserverTable};
pub use parse::schema;
pub use rule::{TRIAL_LIMIT, TrialRule, Until, UntilDecided, UntilStatistic};
pub use tables::{
    CovariancesTable, FeedbackTable, NoiseTable, OutlierTable, PlantTable, QuickTable, SlopeTable, StatesTable,
};
pub use test_table::{TestTable, TimeOf};

pub(crate) use claim::list;
pub(crate) use claim_statistic::OutputStatistic;
pub(crate) use claim_test::Assumption;
pub(crate) use continuous_tables::operators;
pub(crate) use engine::Engine;
pub(crate) use error::{At, wrong};
pub(crate) use input_table::LAWS;
pub(crate) use key::Time;
pub(crate) use limits::{LIST_LIMIT, at_most};
pub(crate) use needed_by_claims::Distributions;
pub(crate) use tables::ChangeTable;
pub(crate) use theory_reference::TheoryReference;
