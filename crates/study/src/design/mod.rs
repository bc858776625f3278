//! The study to be simulated: the experiment file, its settings, the cells, the experiment.

pub(crate) mod build_cell;
pub(crate) mod build_continuous_cell;
mod build_covariances;
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

pub(crate) use build_cell::{CHANGES, FEEDBACKS, NOISES, PLANTS};
pub(crate) use build_continuous_cell::{CONTINUOUS_PLANTS, SIGNALS};
pub(crate) use cell::{Cell, DiscreteCell, ObserverStart, RESPONSE_SAMPLES, ScoredFrom, Source};
pub(crate) use cell_observer::CellObserver;
pub(crate) use continuous_cell::{ContinuousCell, Term};
pub(crate) use curve_bins::{BINS, BINS_PER_OCTAVE_LOG2, CURVE_TRIALS, CURVES_LIMIT, LOWEST_EXPONENT, curve_bytes};
pub(crate) use experiment::{Experiment, design_of};
pub(crate) use lane_plan::{Plan, covered};
pub(crate) use measure::Measure;
pub(crate) use name_checks::{check_labels, check_names};
pub(crate) use settings_reader::{LARGEST_COUNT, SettingsReader, named};
pub(crate) use state_feedback::{LoopModel, StateFeedback};
pub(crate) use theory::{FoundTheory, Theories, smooth};
