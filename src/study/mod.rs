//! A study: an experiment, its trials (pure functions), the runner (the only threads) and the store
//! (the only files).

mod curves;
mod experiment;
mod folder;
mod row;
mod runner;
mod state_feedback;
mod store;
mod trial;

pub use curves::{CURVE_BIN_ERROR, CurveQuantiles, Curves};
pub use experiment::{Cell, Experiment, ExperimentError};
pub use folder::{FolderError, ResultsFolder, read_manifest};
pub use row::{Figure, Row};
pub use runner::{Block, RunError, run};
pub use state_feedback::StateFeedback;
pub use store::{Group, Outcomes, StoreError, TrialTable, TrialWriter, stored_alike};
pub use trial::{Trial, TrialRecord};
