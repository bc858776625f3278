//! The estimates, with all that is printed.

use crate::data::csv::Record;
use crate::data::{Detrend, Rounding, Trend};
use crate::diagnosis::{FeedbackTest, Mode, Precision, Residuals, Whiteness};
use crate::estimator::{EstimatorName, Failure, Progress, Runs};
use crate::metric::Fit;
use crate::model::{LinearModel, Orders};
use crate::observer::Gain;
use asobench_identification::Fitted;
use serde_json::{Map, Value};
use std::f64::consts::TAU;
use std::fmt::{Display, Formatter};
use std::path::{self, Path, PathBuf};

/// The largest order of excitation that is told apart.
pub(super) const MOST_EXCITED: usize = 20;

/// The estimates, with all that is printed.
pub(super) struct Report {
    pub(super) file: PathBuf,
    /// The records that follow each other, if there are several.
    pub(super) parts: Vec<Part>,
    /// The form of the file where it is not the plain one.
    pub(super) form: Vec<String>,
    /// The record, in a unit that [`unit_of`] chooses.
    pub(super) record: Record,
    /// The line of each sample in the file; none of several records.
    pub(super) lines: Vec<u64>,
    /// The last digits of the record's numbers.
    pub(super) rounding: Rounding,
    /// The order of excitation of u over the window, at most [`MOST_EXCITED`].
    pub(super) excitation: usize,
    /// The unit of u and y, a power of two; 1 for all records but those of very large or very small numbers.
    pub(super) unit: f64,
    /// Samples in the window.
    pub(super) window: usize,
    /// Samples left out before the record.
    pub(super) skipped: usize,
    /// The times of the samples, if they are known.
    pub(super) clock: Option<Clock>,
    /// Whether frequencies are printed in Hz. They are in rad/sample where the time between samples is unknown.
    pub(super) hertz: bool,
    /// Steps of the predictions ahead.
    pub(super) horizon: usize,
    /// The record for validation, if it is another one.
    pub(super) validation: Option<Validation>,
    /// The orders as given; with `--order` and `--delay`, those of the ARX form.
    pub(super) orders: Orders,
    pub(super) detrend: Detrend,
    /// The trends subtracted from u and from y.
    pub(super) trends: [Trend; 2],
    pub(super) gain: Gain,
    /// The test of the window for feedback.
    pub(super) feedback: Option<FeedbackTest>,
    pub(super) estimates: Vec<Estimate>,
}

impl Report {
    /// The name of the file without its folder.
    pub(super) fn name(&self) -> path::Display<'_> {
        Path::new(self.file.file_name().unwrap_or(self.file.as_os_str())).display()
    }

    /// Returns the record with u'(k) = u(k) and y'(k) = y(k + shift), whose delay is 1.
    pub(super) fn shifted(&self, shift: usize) -> Samples<'_> {
        Samples {
            u: &self.record.u[..self.record.u.len() - shift],
            y: &self.record.y[shift..],
            r: self.record.r.get(..self.record.u.len() - shift),
            window: self.window - shift,
        }
    }

    /// Returns the lengths of the records; none of one record.
    pub(super) fn lengths(&self) -> Vec<usize> {
        self.parts.iter().map(|part| part.samples).collect()
    }

    /// Returns the index ranges of the records in the window.
    pub(super) fn runs(&self) -> Runs {
        match self.parts.as_slice() {
            [] => Runs::new(&[self.window]),
            _ => Runs::new(&self.lengths()),
        }
    }

    /// Returns what was subtracted from u and from y, in the unit of the file; `None` if nothing was.
    pub(super) fn subtracted(&self) -> Option<[Trend; 2]> {
        let any = self.trends != [Trend::default(); 2];
        any.then(|| self.trends.map(|trend| trend.times(self.unit)))
    }

    /// Returns the time of a sample of the record, seconds, to 13 digits; its number where times are unknown.
    pub(super) fn time(&self, k: usize) -> f64 {
        self.clock.map_or(k as f64, |Clock { start, step }| {
            let time = start + k as f64 * step;
            // 2999 steps of 0.01 s are 29.99 s.
            format!("{time:.12e}").parse().unwrap_or(time)
        })
    }

    /// Returns the unit of frequencies.
    pub(super) fn frequency(&self) -> Frequency {
        match self.clock {
            None => Frequency::Sample,
            Some(_) if self.hertz => Frequency::Hertz,
            Some(_) => Frequency::Radian,
        }
    }

    /// Whether y acts on u, or u at once on y.
    pub(super) fn in_loop(&self) -> bool {
        self.feedback.is_some_and(|test| test.is_found())
    }

    /// Returns the largest shift of an estimate.
    pub(super) fn shift(&self) -> usize {
        let shifts = self.estimates.iter().map(Estimate::shift);
        shifts.max().unwrap_or(0)
    }
}

/// One of several records.
pub(super) struct Part {
    pub(super) file: PathBuf,
    /// Its lines, if it is a part of a file between gaps.
    pub(super) lines: Option<[u64; 2]>,
    pub(super) samples: usize,
    /// The test of the record for feedback.
    pub(super) feedback: Option<FeedbackTest>,
}

/// A model on one of several records.
pub(super) struct PartReport {
    /// Tests of the residuals, if there are enough of them.
    pub(super) residuals: Option<Residuals>,
    pub(super) fit: Fit,
}

/// The unit of frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Frequency {
    /// rad/sample.
    Sample,
    /// rad/s.
    Radian,
    /// Hz.
    Hertz,
}

impl Frequency {
    /// Returns a frequency in this unit, given in rad/s, or in rad/sample where the time between samples is unknown.
    pub(super) fn of(self, omega: f64) -> f64 {
        match self {
            Self::Sample | Self::Radian => omega,
            Self::Hertz => omega / TAU,
        }
    }
}

impl Display for Frequency {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Sample => "rad/sample",
            Self::Radian => "rad/s",
            Self::Hertz => "Hz",
        })
    }
}

/// The times of samples, seconds.
#[derive(Clone, Copy)]
pub(super) struct Clock {
    /// The time of the first sample.
    pub(super) start: f64,
    /// The time between samples.
    pub(super) step: f64,
}

/// A second record, in the unit of the first and less the same trend.
pub(super) struct Validation {
    pub(super) file: PathBuf,
    pub(super) record: Record,
}

/// One estimator's passes and what follows from its last one.
pub(super) struct Estimate {
    pub(super) name: EstimatorName,
    /// Every option with its value.
    pub(super) options: Map<String, Value>,
    /// Passes with their numbers; the number is 0 for an estimator without iterations.
    pub(super) passes: Vec<(usize, PassReport)>,
    pub(super) observer: Option<Observed>,
    pub(super) fit: Option<Fits>,
    /// Of several records, what the model is on each.
    pub(super) parts: Vec<PartReport>,
    /// Whether the residuals of all of them are white.
    pub(super) white: Option<Whiteness>,
    /// Whether the record told how the model begins, and if it does not begin at rest, the chance of that.
    pub(super) start_told: bool,
    pub(super) start_chance: Option<f64>,
    /// Hints on the record or the method.
    pub(super) hints: Vec<String>,
}

impl Estimate {
    /// Returns the options that have a value, in the form in which they are read.
    pub(super) fn given(&self) -> Map<String, Value> {
        let mut given = self.options.clone();
        given.retain(|_, value| !value.is_null());
        given
    }

    /// Returns the last pass, the estimator's result.
    pub(super) fn last(&self) -> &PassReport {
        &self.passes[self.passes.len() - 1].1
    }

    pub(super) fn failure(&self) -> Option<Failure> {
        self.last().fitted.pass.failure
    }

    /// Returns by how many samples y was advanced for an estimator without a delay.
    pub(super) fn shift(&self) -> usize {
        self.last().fitted.shift
    }
}

/// A pass, and what follows from its parameters if it has any.
pub(super) struct PassReport {
    pub(super) fitted: Fitted,
    /// The spectral radius.
    pub(super) radius: Option<f64>,
    /// Poles, largest modulus first, zeros and static gain with their standard errors.
    pub(super) precision: Option<Precision>,
    /// The poles in continuous time, if the time between samples is known.
    pub(super) modes: Option<Vec<Mode>>,
    /// Tests of the residuals, if there are enough of them.
    pub(super) residuals: Option<Residuals>,
}

impl PassReport {
    /// Returns the model if it has parameters.
    pub(super) fn known_model(&self) -> Option<&LinearModel> {
        (self.fitted.pass.progress >= Progress::Parameters).then_some(&self.fitted.model)
    }
}

pub(super) struct Fits {
    pub(super) window: Fit,
    pub(super) validation: Option<Fit>,
}

/// Stage 12 on the whole record.
pub(super) struct Observed {
    pub(super) g: Vec<f64>,
    /// xhat(k), k = 0 ... K, n numbers each.
    pub(super) states: Vec<f64>,
    /// N, as the estimator has it.
    pub(super) window: usize,
}

impl Observed {
    /// xhat(k).
    fn at(&self, k: usize) -> &[f64] {
        let n = self.g.len();
        &self.states[k * n..(k + 1) * n]
    }

    /// xhat(N).
    pub(super) fn at_window(&self) -> &[f64] {
        self.at(self.window)
    }

    /// xhat(K-1).
    pub(super) fn last(&self) -> &[f64] {
        self.at(self.states.len() / self.g.len() - 2)
    }
}

/// u and y as an estimator without a delay receives them, and the window's length.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub(super) u: &'a [f64],
    pub(super) y: &'a [f64],
    /// The reference of a closed loop, if the record has it.
    pub(super) r: Option<&'a [f64]>,
    pub(super) window: usize,
}
