//! The arguments of `asobench study-from`.

use crate::cli::estimate::arguments::{RecordArguments, estimator};
use crate::cli::estimate::flags::OptionFlags;
use crate::data::OutputFeedback;
use crate::estimator::EstimatorName;
use crate::names::named_enum;
use std::path::PathBuf;

named_enum! {
    /// The input of the trials.
    InputOf, "input of the trials" {
        /// The record's own input, the same in every trial (the default).
        Fixed = "fixed",
        /// Drawn anew: Gaussian with the record's spectrum.
        Spectrum = "spectrum",
    }
}

named_enum! {
    /// The source of the trials' noise.
    Bootstrap, "bootstrap" {
        /// Gaussian numbers of the estimated variance (the default).
        Parametric = "parametric",
        /// The record's residuals, drawn with replacement.
        Residual = "residual",
    }
}

/// Estimate a plant and its noise from a record, and write an experiment file whose trials are like it
#[derive(clap::Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) record: RecordArguments,
    /// The estimator whose model is taken for the true plant and noise; `asobench methods` prints them
    #[arg(long, value_name = "NAME", default_value = "arx", alias = "method", value_parser = estimator)]
    pub(super) estimator: EstimatorName,
    /// The experiment file that is written, NAME.toml; its samples go beside it, into NAME-record.csv
    #[arg(long, value_name = "NAME.toml")]
    pub(super) out: PathBuf,
    /// The input of the trials: fixed (the record's own) or spectrum (drawn anew with its spectrum)
    #[arg(long, value_name = "WHAT", default_value_t)]
    pub(super) trial_input: InputOf,
    /// The source of the noise: parametric (Gaussian numbers) or residual (the record's residuals)
    #[arg(long, value_name = "WHAT", default_value_t)]
    pub(super) bootstrap: Bootstrap,
    /// K(q) of u = -K(q) y + r, where the record was taken in closed loop: a gain or c_0,c_1,.../1,d_1,...
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    pub(super) feedback: Option<OutputFeedback>,
    /// The record was taken in open loop, whatever its residuals show
    #[arg(long, conflicts_with = "feedback")]
    pub(super) open_loop: bool,
    #[command(flatten, next_help_heading = "Options of the estimators")]
    pub(super) options: OptionFlags,
}
