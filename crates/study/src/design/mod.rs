//! The study to be simulated: the experiment file, its settings, the cells, the experiment.

pub(crate) mod build_cell;
pub(crate) mod build_continuous_cell;
pub(crate) mod cell;
pub(crate) mod cell_observer;
pub(crate) mod claim_checks;
pub(crate) mod continuous_cell;
pub(crate) mod curve_bins;
pub(crate) mod engine_of_cell;
pub(crate) mod experiment;
pub(crate) mod experiment_checks;
pub mod file;
pub(crate) mod lane_plan;
pub mod measure;
pub(crate) mod name_checks;
pub(crate) mod settings_reader;
pub(crate) mod state_feedback;
pub(crate) mod theory;
pub(crate) mod thread_bytes;
