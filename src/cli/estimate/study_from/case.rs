//! The source of the trials: a record and the model estimated from it.

use super::arguments::{Arguments, Bootstrap, InputOf};
use crate::cli::error::{Error, bad_input};
use crate::cli::estimate::arguments::Arguments as EstimateArguments;
use crate::cli::estimate::load::load;
use crate::cli::estimate::orders::{orders, ranges};
use crate::cli::estimate::record;
use crate::cli::estimate::report::Report;
use crate::cli::estimate::{hints, one_estimator, words};
use crate::data::OutputFeedback;
use crate::diagnosis::{FeedbackTest, Residuals};
use crate::estimator::spectrum;
use crate::metric::prediction_errors;
use crate::model::LinearModel;
use crate::model::polynomial::{divide, filter, multiply};
use crate::plant::StateSpace;
use crate::plant::stability::StepDown;
use crate::signal::NoiseFilter;
use crate::signal::arithmetic::{mean, variance};
use crate::text::rounded;
use asobench_identification::Fitted;

/// The largest chance that a record in open loop is taken for one in closed loop.
const LOOP_LEVEL: f64 = 0.05;

/// The refusal of several models.
const RANGE: &str = "--order, --delay: a range; a study has one model: expected one number each";

/// The source of the trials.
pub(super) struct Case {
    pub(super) report: Report,
    /// The constant that was estimated, and is subtracted from the report's y.
    pub(super) offset: Option<f64>,
    /// Hints of `estimate` on the record.
    pub(super) hints: Vec<String>,
    pub(super) model: LinearModel,
    pub(super) plant: StateSpace,
    pub(super) x0: Vec<f64>,
    pub(super) residuals: Option<Residuals>,
    /// u, or r with feedback: the name of its column, and its samples in the window.
    pub(super) input: (&'static str, Vec<f64>),
    /// The input's spectrum, if the input is drawn anew.
    pub(super) spectrum: Option<NoiseFilter>,
    /// The samples of e, if noise is drawn from them.
    pub(super) drawn: Option<Vec<f64>>,
    pub(super) feedback: Option<OutputFeedback>,
}

impl Case {
    pub(super) fn new(arguments: &Arguments, estimator: &EstimateArguments) -> Result<Self, Error> {
        let name = arguments.estimator;
        if ranges(estimator).is_some() {
            return Err(Error::Input(RANGE.to_owned()));
        }
        let file = &estimator.record.file;
        let found = record::whole(record::read(file, &estimator.record)?, file, "study-from")?;
        let mut report = load(estimator, orders(estimator)?, found)?;
        check_unit(&report)?;
        hints::warn_of_offset(&report, &[name]);
        let mut estimate = one_estimator::estimate(estimator, name, &report)?;
        let path = report.file.display();
        let refused = |message: &str| Error::Input(format!("{path}: {name}: {message}"));
        if let Some(failure) = estimate.failure() {
            hints::tell(&estimate.hints);
            return Err(refused(&format!("no model to make a study of: {failure}")));
        }
        if estimate.shift() > 0 {
            return Err(refused(
                "takes the delay out of the record, and x(0) with it; expected --estimator arx or another one with \
                 orders",
            ));
        }
        let Some((_, last)) = estimate.passes.pop() else {
            return Err(refused("no model"));
        };
        let Fitted { pass, model, .. } = last.fitted;
        let plant = model.plant().ok_or_else(|| {
            refused("u acts on y at once (nk = 0); a study's plant has a delay of at least one sample")
        })?;
        if !plant.is_stable() {
            return Err(refused(
                "the estimated plant is not stable; expected other orders or another estimator",
            ));
        }
        if noise_filter(&model).is_none() {
            return Err(refused(
                "the estimated noise model C/(A D) is not stable; expected other orders or another estimator",
            ));
        }
        if !(model.noise_variance > 0.0 && model.noise_variance.is_finite()) {
            return Err(refused(
                "the noise variance is unknown; expected more samples than parameters, and residuals that are not all \
                 0",
            ));
        }
        if !model.covariance.iter().all(|entry| entry.is_finite()) {
            return Err(refused("the information matrix is singular; expected smaller orders"));
        }
        // The study is of y less its offset.
        report.record.y = pass.less_offset(0, &report.record.y).into_owned();
        let residuals = last.residuals;
        check_loop(arguments, report.feedback).map_err(|message| refused(&message))?;
        let u = report.record.u[..report.window].to_vec();
        let input = match &arguments.feedback {
            None => ("u", u.clone()),
            Some(law) => {
                if !is_loop_stable(&model, law) {
                    return Err(bad_input(
                        "--feedback: the loop around the estimated plant is not stable; is the sign of K \
                                   that of u = -K y + r?",
                    ));
                }
                ("r", reference(law, &u, &report.record.y))
            }
        };
        let spectrum = match arguments.trial_input {
            InputOf::Fixed => None,
            InputOf::Spectrum if variance(&input.1) > 0.0 => Some(spectrum(&about_mean(&input.1))),
            InputOf::Spectrum => {
                return Err(Error::Input(format!(
                    "--trial-input spectrum: {} is constant; expected --trial-input fixed",
                    input.0
                )));
            }
        };
        let drawn = match arguments.bootstrap {
            Bootstrap::Parametric => None,
            Bootstrap::Residual => {
                let errors = prediction_errors(&model, &u, &report.record.y[..u.len()], u.len());
                let (first, mut errors) = errors.ok_or_else(|| refused("no residuals: the predictor is not stable"))?;
                Some(errors.split_off(first))
            }
        };
        Ok(Self {
            report,
            offset: pass.offsets.first().map(|offset| offset.value),
            hints: estimate.hints,
            model,
            plant,
            x0: pass.x0,
            residuals,
            input,
            spectrum,
            drawn,
            feedback: arguments.feedback.clone(),
        })
    }

    /// Returns what is subtracted from the record, in words.
    pub(super) fn detrended(&self) -> String {
        let offset = self.offset.map(|mu| format!(", y less its offset {}", rounded(mu, 6)));
        format!("detrend {}{}", self.report.detrend, offset.unwrap_or_default())
    }

    /// Returns the setting `eta`: the standard deviation of the noise e, per cent of a unit of y.
    pub(super) fn eta(&self) -> f64 {
        100.0 * self.model.noise_variance.sqrt()
    }
}

/// Returns the filter from e to the output, `C/(A D)`; `None` if it is not stable.
pub(super) fn noise_filter(model: &LinearModel) -> Option<NoiseFilter> {
    NoiseFilter::new(&model.c, &multiply(&model.a, &model.d)).ok()
}

fn about_mean(signal: &[f64]) -> Vec<f64> {
    let mean = mean(signal);
    signal.iter().map(|sample| sample - mean).collect()
}

/// Refuses a record whose squares leave the range of doubles.
fn check_unit(report: &Report) -> Result<(), Error> {
    if report.unit == 1.0 {
        return Ok(());
    }
    Err(Error::Input(format!(
        "{}: the largest sample is about {}; expected a record in a unit nearer to its samples",
        report.file.display(),
        rounded(report.unit, 1)
    )))
}

/// Refuses a record that may come from a closed loop, unless the user gives the feedback or declares an open loop.
fn check_loop(arguments: &Arguments, feedback: Option<FeedbackTest>) -> Result<(), String> {
    const WAYS: &str = "expected --feedback K, or --open-loop where nothing fed y back";
    if arguments.feedback.is_some() || arguments.open_loop {
        return Ok(());
    }
    match feedback {
        Some(test) if test.p_value >= LOOP_LEVEL => Ok(()),
        Some(test) => Err(format!(
            "u follows y ({}), as in a closed loop, or acts on it at once; {WAYS}",
            words::chance(test.p_value)
        )),
        None => Err(format!(
            "this input cannot tell an open from a closed loop, nor can a record without noise or with few samples; \
             {WAYS}"
        )),
    }
}

/// Whether `A F D_K + B C_K` is stable.
fn is_loop_stable(model: &LinearModel, law: &OutputFeedback) -> bool {
    let mut sum = multiply(&model.denominator(), &law.denominator());
    let forward = multiply(&model.b, law.numerator());
    sum.resize(sum.len().max(forward.len()), 0.0);
    for (sum, term) in sum.iter_mut().zip(forward) {
        *sum += term;
    }
    StepDown::new(&sum[1..]).is_some()
}

/// Computes `r = u + K(q) y`, with K at rest before k = 0.
fn reference(law: &OutputFeedback, u: &[f64], y: &[f64]) -> Vec<f64> {
    let mut r = vec![0.0; u.len()];
    filter(law.numerator(), &y[..u.len()], &mut r);
    divide(&law.denominator(), &mut r);
    for (r, u) in r.iter_mut().zip(u) {
        *r += u;
    }
    r
}
