//! The arguments of `asobench observe`.

use crate::cli::estimate::arguments::{ESTIMATORS, RecordArguments, estimator};
use crate::cli::estimate::flags::OptionFlags;
use crate::cli::files::{page_path, picture_path, table_path};
use crate::cli::output::Format;
use crate::estimator::EstimatorName;
use crate::observer::ObserverKind;
use clap::builder::{PathBufValueParser, TypedValueParser as _};
use std::fmt::{Display, Formatter};
use std::path::PathBuf;
use std::str::FromStr;

/// The methods that have states of their own.
const ADAPTIVE: [EstimatorName; 3] = [
    EstimatorName::Kreisselmeier,
    EstimatorName::Zhang,
    EstimatorName::JointEkf,
];

/// Fit a model to a record and observe its states: the observer's gain and poles, xhat(k) with bands
#[derive(clap::Args)]
#[command(
    after_help = "All options, those of each estimator too: asobench observe --help",
    after_long_help = "asobench observe my.csv --order 2 is the algorithm of the papers, from a record to its states: \
                       least squares, passes of instrumental variables, a dead-beat observer"
)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) record: RecordArguments,
    /// Estimator of the model
    ///
    /// `asobench methods` prints them [default: iv, that of the papers].
    #[arg(long, alias = "method", value_name = "NAME", value_parser = estimator, help_heading = OBSERVER)]
    pub(super) estimator: Option<EstimatorName>,
    /// dead-beat, poles:LIST, kalman, ...
    ///
    /// dead-beat (the default), scaled:RHO (eigenvalues RHO * eig(A-hat)) or poles:LIST, such as
    /// poles:0.2,0.1+0.3i,0.1-0.3i; kalman or kalman-coloured (measurement noise of the model's colour) with the
    /// covariances that are given, or else identified by maximum likelihood; kalman-varying from P(0);
    /// gpebo-drem:GAMMA, gpebo-squares:RHO; or an adaptive one, which needs no model: kreisselmeier, zhang, joint-ekf.
    #[arg(
        long,
        alias = "gain",
        value_name = "OBSERVER",
        default_value_t,
        hide_default_value = true,
        help_heading = OBSERVER
    )]
    pub(super) observer: Choice,
    /// Q of the noise that drives the states
    ///
    /// Its covariance, in the square of y's unit: one number q for q I, n numbers for a diagonal, or n x n by rows.
    #[arg(
        long,
        alias = "Q",
        value_name = "Q",
        allow_negative_numbers = true,
        value_parser = numbers,
        requires = "measurement_variance",
        help_heading = OBSERVER
    )]
    pub(super) process_covariance: Option<Numbers>,
    /// r of the noise that y is measured with
    ///
    /// Its variance, in the square of y's unit.
    #[arg(
        long,
        alias = "R",
        value_name = "R",
        allow_negative_numbers = true,
        requires = "process_covariance",
        help_heading = OBSERVER
    )]
    pub(super) measurement_variance: Option<f64>,
    /// P(0) of kalman-varying
    ///
    /// The covariance of x(0) about its estimate, in the forms of --process-covariance.
    #[arg(
        long,
        alias = "P0",
        value_name = "P",
        allow_negative_numbers = true,
        value_parser = numbers,
        requires = "process_covariance",
        help_heading = OBSERVER
    )]
    pub(super) start_covariance: Option<Numbers>,
    /// FILE.csv or FILE.parquet of the states
    ///
    /// Write xhat(k) for k = 0 ... K with their standard deviations, y, its prediction and the innovation.
    #[arg(
        long,
        alias = "states",
        value_name = "FILE",
        value_parser = PathBufValueParser::new().try_map(table_path),
        help_heading = OUTPUT
    )]
    pub(super) out: Option<PathBuf>,
    /// Draw y, its prediction and the states
    ///
    /// As FILE.svg or FILE.pdf.
    #[arg(
        long,
        value_name = "FILE.svg",
        value_parser = PathBufValueParser::new().try_map(picture_path),
        help_heading = OUTPUT
    )]
    pub(super) plot: Option<PathBuf>,
    /// Write a page of model and observer
    #[arg(
        long,
        value_name = "FILE.html",
        value_parser = PathBufValueParser::new().try_map(page_path),
        help_heading = OUTPUT
    )]
    pub(super) report: Option<PathBuf>,
    /// Time between samples, seconds
    #[arg(
        long,
        value_name = "SECONDS",
        allow_negative_numbers = true,
        value_parser = crate::cli::estimate::arguments::seconds,
        help_heading = OUTPUT
    )]
    pub(super) ts: Option<f64>,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t, hide_default_value = true, help_heading = OUTPUT)]
    pub(super) format: Format,
    #[command(flatten, next_help_heading = ESTIMATORS)]
    pub(super) options: OptionFlags,
}

const OBSERVER: &str = "The observer";
const OUTPUT: &str = "Output";

/// An observer of a record.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Choice {
    /// Of a model that is fitted.
    OfModel(ObserverKind),
    /// A method with states of its own.
    Adaptive(EstimatorName),
}

impl Default for Choice {
    fn default() -> Self {
        Self::OfModel(ObserverKind::Luenberger(Default::default()))
    }
}

impl Display for Choice {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::OfModel(kind) => kind.fmt(f),
            Self::Adaptive(name) => name.fmt(f),
        }
    }
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(name) = ADAPTIVE.iter().find(|name| name.name() == text) {
            return Ok(Self::Adaptive(*name));
        }
        let kind: Result<ObserverKind, _> = text.parse();
        kind.map(Self::OfModel).map_err(|error| {
            let adaptive = ADAPTIVE.map(EstimatorName::name).join(", ");
            format!("{error}; or an adaptive one: {adaptive}")
        })
    }
}

/// The numbers of a covariance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Numbers(pub(super) Vec<f64>);

fn numbers(text: &str) -> Result<Numbers, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    numbers
        .map(Numbers)
        .ok_or_else(|| "expected numbers, such as 0.1 or 0.1,0.2".to_owned())
}
