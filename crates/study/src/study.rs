//! A study: what is to be simulated, how it is run, and what came out, under one name.

pub use crate::design::cell::{Cell, DiscreteCell, ObserverStart, ScoredFrom, Source};
pub use crate::design::cell_observer::{Used, stage_twelve};
pub use crate::design::continuous_cell::{ContinuousCell, Term};
pub use crate::design::curve_bins::CURVE_TRIALS;
pub use crate::design::experiment::{Experiment, design_of};
pub use crate::design::experiment_checks::{BOBTSOV2023, NIKOLOV2023};
pub use crate::design::file;
pub use crate::design::file::engine::Engine;
pub use crate::design::file::theory_reference::TheoryReference;
pub use crate::design::lane_plan::Plan;
pub use crate::design::measure::{self, Better, Measure};
pub use crate::design::state_feedback::{LoopModel, StateFeedback};
pub use crate::design::theory::FoundTheory;
pub use crate::outcome::course_summary::{CourseQuantiles, CourseSummary};
pub use crate::outcome::curves::{CURVE_BIN_ERROR, CurveQuantiles, Curves};
pub use crate::outcome::design_difference::same_trials;
pub use crate::outcome::folder_error::FolderError;
pub use crate::outcome::folder_layout::{Done, MANIFEST, TIMES, TIMING};
pub use crate::outcome::looks::{Look, Looks};
pub use crate::outcome::method_times::MethodTime;
pub use crate::outcome::outcomes::Outcomes;
pub use crate::outcome::place;
pub use crate::outcome::publication::{current, read_current};
pub use crate::outcome::results_folder::ResultsFolder;
pub use crate::outcome::row::Row;
pub use crate::outcome::rows::{OutputRows, Rows};
pub use crate::outcome::spent::Spent;
#[doc(hidden)]
pub use crate::outcome::stored_results::parse_manifest;
pub use crate::outcome::stored_results::{
    check_result, check_results, read_announced, read_manifest, read_results, stored_design, stored_designs,
};
pub use crate::outcome::stored_trials::{CellRows, StoredTrials};
pub use crate::outcome::summary::{
    BoundSummary, CellPart, CellSummary, ComparisonSummary, Joint, OutputShare, OutputSummary, SlopeSummary, Summary,
};
pub use crate::outcome::tally::{CellTally, OutputTally};
pub use crate::outcome::theory_summary::{LimitError, OfBounds, TheorySummary};
pub use crate::outcome::traces::{OutputTrace, Traces};
pub use crate::outcome::trial_table::StoreError;
pub use crate::outcome::trials::Trials;
pub use crate::run::block_file::BlockError;
#[doc(hidden)]
pub use crate::run::block_file::BlockFolder;
pub use crate::run::campaign::{Campaign, RunOptions};
pub use crate::run::changed_methods::{MethodChange, take_over};
pub use crate::run::cluster;
pub use crate::run::continuous_trial::ContinuousTrial;
pub use crate::run::event::{CampaignError, Event};
pub use crate::run::forecast::{Disk, Forecast};
pub use crate::run::machine_peak::fma_peak;
pub use crate::run::pack_trial::PackTrial;
pub use crate::run::partial::partial_results;
pub use crate::run::pilot::{Pilot, pilot_seed};
pub use crate::run::resume::done;
pub use crate::run::runner::{Block, RunError, Span, block_size, run, run_and_forget};
pub use crate::run::trial::{Trial, TrialRecord};
pub use crate::run::trial_worker::{Worker, WorkerError};
pub use crate::run::workload::W98;
