//! A study: an experiment and its trials (pure functions), the runner (the only part with threads) and the store (the
//! only part with files).

mod blocks;
mod build;
mod campaign;
mod claims;
pub mod cluster;
mod coefficients;
mod compute;
mod continuous_time;
mod cost;
mod curves;
mod engine;
mod event;
mod experiment;
pub mod file;
mod folder;

pub mod kernels;
mod looks;
pub mod measure;
mod names;
mod need;
mod observers;
mod pack;
mod peak;
mod pilot;
pub mod place;
mod plan;
mod rounds;
mod row;
mod rows;
mod runner;
mod score;
mod spent;
mod state_feedback;
mod store;
mod summary;
mod tally;
mod theory;
mod times;
mod trial;
mod trial_table;
mod workload;

pub use blocks::{BlockError, Done, done};
#[doc(hidden)]
pub use blocks::{BlockFolder, Content};
pub use campaign::{Campaign, RunOptions};
pub use continuous_time::{ContinuousCell, ContinuousTrial, OutputTrace, Term, Traces};
pub use cost::Cost;
pub use curves::{CURVE_BIN_ERROR, CurveQuantiles, Curves};
pub use engine::{Engine, Worker, WorkerError};
pub use event::{CampaignError, Event};
pub use experiment::design_of;
pub use experiment::{
    BOBTSOV2023, Cell, Experiment, NIKOLOV2023, ObserverStart, ScoredFrom, Source,
};
pub use folder::MANIFEST;
#[doc(hidden)]
pub use folder::parse_manifest;
pub use folder::{FolderError, ResultsFolder, read_manifest, stored_design};
pub use looks::{Look, Looks};
pub use measure::{Better, Measure};
pub use need::{Disk, disk_of, memory_of, row_of};
pub use observers::{Used, stage_twelve};
pub use pack::PackTrial;
pub use peak::fma_peak;
pub use pilot::{Pilot, pilot_seed};
pub use plan::Plan;
pub use row::Row;
pub use rows::{OutputRows, Rows};
pub use runner::{Block, RunError, Span, block_size, run, run_and_forget};
pub use spent::Spent;
pub use state_feedback::{LoopModel, StateFeedback};
pub use store::stored_alike;
pub use summary::{
    BoundSummary, CellSummary, ComparisonSummary, MedianPair, OutputShare, OutputSummary,
    SlopeStatistics, SlopeSummary, Summary,
};
pub use tally::{CellTally, Outcomes, OutputTally, Trials};
pub use theory::{FoundTheory, LimitError, OfBounds, TheoryReference, TheorySummary};
pub use times::MethodTime;
pub use trial::{Trial, TrialRecord};
pub use trial_table::StoreError;
pub use workload::W98;
