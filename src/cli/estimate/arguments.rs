//! The arguments of `asobench estimate`.

use super::drawing::Drawing;
use super::flags::OptionFlags;
use super::span::{Given, Span};
use crate::cli::error::Error;
use crate::cli::files::page_path;
use crate::cli::output::Format;
use crate::data::Detrend;
use crate::data::csv::{Decimal, Missing};
use crate::estimator::EstimatorName;
use crate::names::UnknownName;
use crate::observer::{Gain, GainError, ObserverKind};
use clap::builder::{PathBufValueParser, TypedValueParser as _};
use std::path::PathBuf;

/// The sections of the help.
const RECORD: &str = "The record";
const MODEL: &str = "The model";
const OUTPUT: &str = "Output";
/// The section of the options of estimators.
pub(super) const ESTIMATORS: &str = "Options of the estimators";

/// Estimate a plant, its initial state and its observer from a CSV file with columns u and y
#[derive(Default, clap::Args)]
#[command(
    after_help = "All options, those of each estimator too: asobench estimate --help",
    after_long_help = "Gains: dead-beat, scaled:RHO (eigenvalues RHO * eig(A-hat)), poles:LIST (such as \
                       poles:0.2,0.1+0.3i,0.1-0.3i). Kalman filters, bands of the states: asobench observe"
)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) record: RecordArguments,
    /// More records of the same plant
    ///
    /// One model is fitted to all, each from a start of its own.
    #[arg(value_name = "MORE.csv", value_parser = further_record)]
    pub(super) more: Vec<PathBuf>,
    /// Estimators by commas; asobench methods
    ///
    /// Estimators, separated by commas; `asobench methods` prints them. Of several a table is printed, best first
    /// [default: ls,iv; arx for orders of its own and for a range of orders].
    #[arg(
        long,
        aliases = ["method", "methods", "estimators"],
        value_name = "LIST",
        value_delimiter = ',',
        value_parser = estimator,
        help_heading = MODEL
    )]
    pub(super) estimator: Vec<EstimatorName>,
    /// The observer's gain: dead-beat, scaled:RHO, poles:LIST
    #[arg(
        long,
        value_name = "GAIN",
        default_value_t,
        value_parser = gain,
        hide_short_help = true,
        help_heading = MODEL
    )]
    pub(super) gain: Gain,
    /// A second record, for validation
    ///
    /// The models are validated on it instead of the samples after the window.
    #[arg(
        long,
        alias = "validation",
        value_name = "FILE",
        value_parser = second_record,
        help_heading = MODEL
    )]
    pub(super) validate: Option<PathBuf>,
    /// Print each of several models too
    ///
    /// Below the table, which stands alone without it.
    #[arg(long, help_heading = OUTPUT)]
    pub(super) details: bool,
    /// Write the last estimator's observer states, k = 0 ... K, to a CSV file
    #[arg(long, value_name = "STATES.csv", hide_short_help = true, help_heading = OUTPUT)]
    pub(super) states: Option<PathBuf>,
    /// FILE.svg, bode, step, poles, residuals
    ///
    /// Draw a picture: output (measured and simulated, and prediction errors; of a range of orders the criteria), bode,
    /// step, poles or residuals. KIND=FILE.svg (or .pdf) names both; a file alone is that of output, a kind alone draws
    /// KIND.svg; may be repeated.
    #[arg(long, value_name = "PICTURE", help_heading = OUTPUT)]
    pub(super) plot: Vec<Drawing>,
    /// Write a page with pictures and intervals
    ///
    /// Of the record, models with intervals, residuals, poles and zeros, responses, the observer.
    #[arg(
        long,
        value_name = "FILE.html",
        value_parser = PathBufValueParser::new().try_map(page_path),
        help_heading = OUTPUT
    )]
    pub(super) report: Option<PathBuf>,
    /// Time between samples, seconds
    ///
    /// By default that of the column of times, if there is one.
    #[arg(
        long,
        value_name = "SECONDS",
        allow_negative_numbers = true,
        value_parser = seconds,
        help_heading = RECORD
    )]
    pub(super) ts: Option<f64>,
    /// Frequencies in Hz instead of rad/s, where the time between samples is known
    #[arg(long, hide_short_help = true, help_heading = OUTPUT)]
    pub(super) hz: bool,
    /// Print the FIT of predictions K steps ahead too, which know u up to their sample and y up to K samples before
    #[arg(
        long,
        alias = "prediction-horizon",
        value_name = "K",
        default_value_t = 1,
        hide_default_value = true,
        allow_negative_numbers = true,
        value_parser = whole,
        hide_short_help = true,
        help_heading = OUTPUT
    )]
    pub(super) horizon: usize,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t, hide_default_value = true, help_heading = OUTPUT)]
    pub(super) format: Format,
    #[command(flatten, next_help_heading = ESTIMATORS)]
    pub(super) options: OptionFlags,
}

impl Arguments {
    /// The arguments of one estimator, without any others.
    pub(super) fn of_one(record: RecordArguments, estimator: EstimatorName, options: OptionFlags) -> Self {
        Self {
            record,
            estimator: vec![estimator],
            horizon: 1,
            options,
            ..Self::default()
        }
    }

    /// The flags of pictures, of the page and of the states, each with whether it was given.
    pub(super) fn drawn(&self) -> [(&'static str, bool); 3] {
        [
            ("--plot", !self.plot.is_empty()),
            ("--report", self.report.is_some()),
            ("--states", self.states.is_some()),
        ]
    }

    /// Whether all estimators take the signals before the record as zero.
    pub(super) fn begins_at_rest(&self) -> bool {
        self.estimator.iter().all(|name| {
            let options = name.parse(self.options.taken_by(*name));
            options.is_ok_and(|options| options.begins_at_rest())
        })
    }
}

/// Refuses the first flag that was given.
pub(super) fn refuse(flags: &[(&str, bool)], why: &str) -> Result<(), Error> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(Error::Input(format!("{flag}: {why}"))),
        None => Ok(()),
    }
}

/// A record, and the orders of its models.
#[derive(Clone, Default, clap::Args)]
pub(super) struct RecordArguments {
    /// CSV, .parquet, .xlsx, or - for a pipe
    ///
    /// Standard input is -. Columns u, y and perhaps k or t (time), or those that --input and --output choose; lines
    /// beginning with # are comments.
    #[arg(value_name = "FILE.csv")]
    pub(super) file: PathBuf,
    /// Worksheet of a workbook [default: the first one that has the columns]
    #[arg(long, value_name = "NAME", hide_short_help = true, help_heading = RECORD)]
    pub(super) sheet: Option<String>,
    /// Column of u, by name or number
    ///
    /// Its number counts from 1 [default: u, input or in].
    #[arg(long, value_name = "COLUMN", help_heading = RECORD)]
    pub(super) input: Option<String>,
    /// Column of y, by name or number
    ///
    /// [default: y, output or out]
    #[arg(long, value_name = "COLUMN", help_heading = RECORD)]
    pub(super) output: Option<String>,
    /// Column of a closed loop's reference r, by its name or its number [default: r or reference, if there is one]
    #[arg(long, value_name = "COLUMN", hide_short_help = true, help_heading = RECORD)]
    pub(super) reference: Option<String>,
    /// Column of the times, or none
    ///
    /// By its name or its number [default: t or time, if there is one].
    #[arg(long, value_name = "COLUMN", help_heading = RECORD)]
    pub(super) time: Option<String>,
    /// Mark before decimals: point or comma [default: the one that the numbers show]
    #[arg(long, value_name = "MARK", hide_short_help = true, help_heading = RECORD)]
    pub(super) decimal: Option<Decimal>,
    /// The treatment of missing samples: refuse, longest-run (the longest part without a gap is the record), equations
    /// (only the equations that touch a gap are left out; arx, iv, oe, armax, bj)
    #[arg(long, value_name = "WHAT", default_value_t, hide_short_help = true, help_heading = RECORD)]
    pub(super) missing: Missing,
    /// Leave out the first N samples
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        hide_default_value = true,
        allow_negative_numbers = true,
        hide_short_help = true,
        help_heading = RECORD
    )]
    pub(super) skip: usize,
    /// Order of the plant; 1:8 compares orders
    ///
    /// Order n of the plant: na = nb = n; or --orders, for estimators that take it. A range such as 1:8 compares
    /// models of these orders, of arx unless --estimator names others.
    #[arg(long, value_name = "n", allow_negative_numbers = true, help_heading = MODEL)]
    pub(super) order: Option<Given>,
    /// Delay of the input, samples
    ///
    /// nk, or a range, beside --order; 0: u acts at once [default: 1].
    #[arg(
        long,
        value_name = "nk",
        allow_negative_numbers = true,
        value_parser = Span::of_delays,
        help_heading = MODEL
    )]
    pub(super) delay: Option<Span>,
    /// Samples for estimation, or a share: 70%
    ///
    /// From the first; the rest is for validation [default: all].
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = part,
        help_heading = MODEL
    )]
    pub(super) window: Option<Part>,
    /// Subtract a trend: none, mean, linear
    ///
    /// Trend to subtract from u and y, fitted on the window: none, mean (also --detrend alone), linear.
    #[arg(
        long,
        value_name = "WHAT",
        default_value_t,
        hide_default_value = true,
        num_args = 0..=1,
        default_missing_value = "mean",
        help_heading = RECORD
    )]
    pub(super) detrend: Detrend,
    /// Subtract U from u and Y from y instead, the point about which the record moves
    #[arg(
        long,
        value_name = "U,Y",
        conflicts_with = "detrend",
        allow_hyphen_values = true,
        value_parser = pair,
        hide_short_help = true,
        help_heading = RECORD
    )]
    pub(super) operating_point: Option<[f64; 2]>,
}

fn pair(text: &str) -> Result<[f64; 2], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match (text.split(',').count(), numbers.as_slice()) {
        (2, [u, y]) if u.is_finite() && y.is_finite() => Ok([*u, *y]),
        _ => Err("expected two numbers, of u and of y, such as 40,61.5".to_owned()),
    }
}

pub(super) fn whole(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number) if number >= 1 => Ok(number),
        _ => Err("expected a whole number of at least 1".to_owned()),
    }
}

/// A file that is there: a word too many is none.
fn further_record(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    path.exists()
        .then_some(path)
        .ok_or_else(|| "no such file; expected a further record of the same plant".to_owned())
}

/// A file, not a share of this one.
fn second_record(text: &str) -> Result<PathBuf, String> {
    if text.trim_end_matches('%').parse::<f64>().is_ok() {
        return Err(
            "expected a file with a second record; --window 70% leaves the last 30 % for validation".to_owned(),
        );
    }
    Ok(PathBuf::from(text))
}

/// A part of a record, from its first sample.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    /// So many samples.
    Samples(usize),
    /// A share of all samples, per cent.
    Percent(f64),
}

impl Part {
    /// Its samples, of so many.
    pub(super) fn of(self, samples: usize) -> usize {
        match self {
            Self::Samples(part) => part,
            Self::Percent(percent) => (samples as f64 * percent / 100.0).round() as usize,
        }
    }
}

fn part(text: &str) -> Result<Part, String> {
    let Some(percent) = text.strip_suffix('%') else {
        return whole(text)
            .map(Part::Samples)
            .map_err(|error| format!("{error}, or a share of them such as 70%"));
    };
    match percent.trim().parse() {
        Ok(percent) if percent > 0.0 && percent <= 100.0 => Ok(Part::Percent(percent)),
        _ => Err("expected a share above 0 % and up to 100 %".to_owned()),
    }
}

pub(super) fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if number > 0.0 && f64::is_finite(number) => Ok(number),
        _ => Err("expected a number of seconds above 0".to_owned()),
    }
}

/// A gain with placed poles.
fn gain(given: &str) -> Result<Gain, String> {
    given.parse().map_err(|error: GainError| {
        let other: Result<ObserverKind, _> = given.parse();
        match other {
            Ok(_) => format!("asobench observe RECORD.csv --order 2 --observer {given} has this observer"),
            Err(_) => format!("{error}; asobench observe has Kalman filters"),
        }
    })
}

/// An estimator, in capitals or not.
pub(in crate::cli) fn estimator(given: &str) -> Result<EstimatorName, UnknownName> {
    let lower = given.to_lowercase().parse();
    lower.or_else(|_| given.parse())
}
