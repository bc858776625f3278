//! `asobench study-from`: turns a record and its estimate into an experiment file, a study of the user's own case.

use super::flags::OptionFlags;
use super::{RecordArguments, Report};
use crate::cli::error::Error;
use crate::cli::{Format, note, print};
use crate::data::OutputFeedback;
use crate::diagnosis::Residuals;
use crate::estimator::{EstimatorName, spectrum};
use crate::files::{self, Kind, Staged};
use crate::metric::prediction_errors;
use crate::model::LinearModel;
use crate::model::polynomial::{divide, filter, multiply};
use crate::names::named_enum;
use crate::observer::Gain;
use crate::plant::StateSpace;
use crate::plant::stability::StepDown;
use crate::signal::NoiseFilter;
use crate::signal::arithmetic::{mean, variance};
use crate::text::{name_fault, rounded, shell_word, visible, wrap};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

mod file;
mod methods;

named_enum! {
    /// The input of the trials.
    InputOf, "input" {
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
    record: RecordArguments,
    /// The estimator whose model is taken for the true plant and noise; `asobench methods` prints them
    #[arg(long, value_name = "NAME", default_value = "arx")]
    estimator: EstimatorName,
    /// The experiment file that is written, NAME.toml; its samples go beside it, into NAME-record.csv
    #[arg(long, value_name = "NAME.toml")]
    out: PathBuf,
    /// The input of the trials: fixed (the record's own) or spectrum (drawn anew with its spectrum)
    #[arg(long, value_name = "WHAT", default_value_t)]
    input: InputOf,
    /// What the noise is drawn from: parametric (Gaussian numbers) or residual (the record's residuals)
    #[arg(long, value_name = "WHAT", default_value_t)]
    bootstrap: Bootstrap,
    /// K(q) of u = -K(q) y + r, where the record was taken in closed loop: a gain or c_0,c_1,.../1,d_1,...
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    feedback: Option<OutputFeedback>,
    /// The record was taken in open loop, whatever its residuals show
    #[arg(long, conflicts_with = "feedback")]
    open_loop: bool,
    #[command(flatten, next_help_heading = "Options of the estimators")]
    options: OptionFlags,
}

/// The largest chance that a record in open loop is taken for one in closed loop.
const LOOP_LEVEL: f64 = 0.05;

/// The source of the trials.
struct Case {
    report: Report,
    model: LinearModel,
    plant: StateSpace,
    x0: Vec<f64>,
    residuals: Option<Residuals>,
    /// u, or r with feedback: the name of its column, and its samples in the window.
    input: (&'static str, Vec<f64>),
    /// The input's spectrum, if the input is drawn anew.
    spectrum: Option<NoiseFilter>,
    /// The samples of e, if noise is drawn from them.
    drawn: Option<Vec<f64>>,
    feedback: Option<OutputFeedback>,
}

pub(in crate::cli) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let places = Places::new(&arguments.out)?;
    let estimator = super::Arguments {
        record: arguments.record.clone(),
        estimator: vec![arguments.estimator],
        gain: Gain::default(),
        states: None,
        plot: None,
        report: None,
        format: Format::Text,
        options: arguments.options.clone(),
    };
    let case = Case::new(arguments, &estimator)?;
    let methods = methods::all(&case, arguments);
    let text = file::text(&case, arguments, &methods, &places);
    places.write(&case, text.as_bytes())?;
    conclude(&case, arguments, &methods, &places)?;
    Ok(ExitCode::SUCCESS)
}

impl Case {
    fn new(arguments: &Arguments, estimator: &super::Arguments) -> Result<Self, Error> {
        let name = arguments.estimator;
        if super::ranges(estimator).is_some() {
            let message =
                "--order, --delay: a range; a study has one model: expected one number each";
            return Err(Error::Input(message.to_owned()));
        }
        let report = super::load(estimator, super::orders(estimator)?)?;
        if report.unit != 1.0 {
            return Err(Error::Input(format!(
                "{}: the largest sample is about {}; expected a record in a unit nearer to its samples",
                report.file.display(),
                rounded(report.unit, 1)
            )));
        }
        let mut estimate = super::estimate(estimator, name, &report)?;
        let path = report.file.display();
        let refused = |message: &str| Error::Input(format!("{path}: {name}: {message}"));
        if let Some(failure) = estimate.failure() {
            return Err(refused(&format!("no model to make a study of: {failure}")));
        }
        if estimate.shift > 0 {
            return Err(refused(
                "takes the delay out of the record, and x(0) with it; expected --estimator arx or another one with orders",
            ));
        }
        let Some((_, last)) = estimate.passes.pop() else {
            return Err(refused("no model"));
        };
        let model = last.model;
        let plant = model.plant().ok_or_else(|| {
            refused(
                "u acts on y at once (nk = 0); a study's plant has a delay of at least one sample",
            )
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
                "the noise variance is unknown; expected more samples than parameters, and residuals that are not all 0",
            ));
        }
        if !model.covariance.iter().all(|entry| entry.is_finite()) {
            return Err(refused(
                "the information matrix is singular; expected smaller orders",
            ));
        }
        let x0 = last.pass.x0;
        let residuals = last.residuals;
        check_loop(arguments, residuals.as_ref()).map_err(|message| refused(&message))?;
        let u = report.record.u[..report.window].to_vec();
        let input = match &arguments.feedback {
            None => ("u", u.clone()),
            Some(law) => {
                if !is_loop_stable(&model, law) {
                    return Err(Error::Input("--feedback: the loop around the estimated plant is not stable; is the sign of K that of u = -K y + r?".to_owned()));
                }
                ("r", reference(law, &u, &report.record.y))
            }
        };
        let spectrum = match arguments.input {
            InputOf::Fixed => None,
            InputOf::Spectrum if variance(&input.1) > 0.0 => Some(spectrum(&about_mean(&input.1))),
            InputOf::Spectrum => {
                return Err(Error::Input(format!(
                    "--input spectrum: {} is constant; expected --input fixed",
                    input.0
                )));
            }
        };
        let drawn = match arguments.bootstrap {
            Bootstrap::Parametric => None,
            Bootstrap::Residual => {
                let errors = prediction_errors(&model, &u, &report.record.y[..u.len()], u.len());
                let (first, mut errors) =
                    errors.ok_or_else(|| refused("no residuals: the predictor is not stable"))?;
                Some(errors.split_off(first))
            }
        };
        Ok(Self {
            report,
            model,
            plant,
            x0,
            residuals,
            input,
            spectrum,
            drawn,
            feedback: arguments.feedback.clone(),
        })
    }

    /// Returns the setting `eta`: the standard deviation of the noise e, per cent of a unit of y.
    fn eta(&self) -> f64 {
        100.0 * self.model.noise_variance.sqrt()
    }
}

/// Returns the filter from e to the output, `C/(A D)`; `None` if it is not stable.
fn noise_filter(model: &LinearModel) -> Option<NoiseFilter> {
    NoiseFilter::new(&model.c, &multiply(&model.a, &model.d)).ok()
}

fn about_mean(signal: &[f64]) -> Vec<f64> {
    let mean = mean(signal);
    signal.iter().map(|sample| sample - mean).collect()
}

/// Refuses a record that may come from a closed loop, unless the user gives the feedback or declares an open loop.
fn check_loop(arguments: &Arguments, residuals: Option<&Residuals>) -> Result<(), String> {
    const WAYS: &str = "expected --feedback K, or --open-loop where nothing fed y back";
    if arguments.feedback.is_some() || arguments.open_loop {
        return Ok(());
    }
    match residuals.map(Residuals::feedback_p_value) {
        Some(p) if p >= LOOP_LEVEL => Ok(()),
        Some(p) => Err(format!(
            "u follows the residuals ({}), as in a closed loop, or with too few orders; {WAYS}",
            super::words::chance(p)
        )),
        None => Err(format!(
            "too few residuals to tell open from closed loop; {WAYS}"
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

/// A column of a CSV file: its name and its samples.
type Column<'a> = (&'a str, &'a [f64]);

/// The paths of the files.
struct Places {
    file: PathBuf,
    record: PathBuf,
    residuals: PathBuf,
}

impl Places {
    fn new(out: &Path) -> Result<Self, Error> {
        let refused =
            |message: &str| Err(Error::Input(format!("--out {}: {message}", out.display())));
        let (Some(name), Some("toml")) = (
            out.file_stem().and_then(|name| name.to_str()),
            out.extension().and_then(|extension| extension.to_str()),
        ) else {
            return refused("expected a name that ends in .toml");
        };
        if let Some(fault) = name_fault(name) {
            return refused(&fault);
        }
        if files::is_there(out) {
            return refused("exists already; expected the name of a new file");
        }
        Ok(Self {
            file: out.to_owned(),
            record: out.with_file_name(format!("{name}-record.csv")),
            residuals: out.with_file_name(format!("{name}-residuals.csv")),
        })
    }

    /// Returns the name of a file without its folder, which all files share.
    fn name(path: &Path) -> String {
        path.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    }

    /// Returns the CSV files with their columns.
    fn columns<'a>(&'a self, case: &'a Case) -> Vec<(&'a Path, Vec<Column<'a>>)> {
        let mut files = Vec::new();
        if case.spectrum.is_none() {
            let (record, n) = (&case.report.record, case.report.window);
            let mut columns = vec![("u", &record.u[..n]), ("y", &record.y[..n])];
            if case.feedback.is_some() {
                columns.push((case.input.0, &case.input.1));
            }
            files.push((self.record.as_path(), columns));
        }
        if let Some(drawn) = &case.drawn {
            files.push((self.residuals.as_path(), vec![("e", drawn.as_slice())]));
        }
        files
    }

    /// Writes all files, or none.
    fn write(&self, case: &Case, text: &[u8]) -> Result<(), Error> {
        let attempt = || {
            let mut staged = Staged::default();
            for (path, columns) in self.columns(case) {
                let mut content = Vec::new();
                let comments = [
                    format!(
                        "asobench record of {}, detrend {}",
                        case.report.file.display(),
                        case.report.detrend
                    ),
                    format!("order: {}", case.plant.order()),
                ];
                let written = crate::data::csv::write_columns(&mut content, &comments, &columns);
                written.map_err(files::PathError::io(path))?;
                staged.write(path, Kind::Record, &content)?;
            }
            staged.write(&self.file, Kind::Experiment, text)?;
            staged.publish()
        };
        attempt().map_err(|error| Error::Input(format!("--out {error}")))
    }
}

/// Prints what was written, and the next command.
fn conclude(
    case: &Case,
    arguments: &Arguments,
    methods: &methods::Methods,
    places: &Places,
) -> Result<(), Error> {
    let name = arguments.estimator;
    let orders = case.model.orders();
    let mut text = String::new();
    let mut line = |line: String| text += &wrap(&line, 79, "  ");
    line(format!(
        "The plant is {name} {orders}; its noise has the variance {}.",
        rounded(case.model.noise_variance, 4)
    ));
    line(file::input_in_words(case));
    line(file::noise_in_words(case).to_owned());
    line(file::loop_in_words(case, arguments.open_loop));
    line(format!("Methods: {}.", methods.labels().join(", ")));
    let written = places.columns(case).into_iter().map(|(path, _)| path);
    let written: Vec<String> = written
        .chain([places.file.as_path()])
        .map(|path| visible(path.display()))
        .collect();
    line(format!("Written: {}.", written.join(", ")));
    line(format!(
        "Next: asobench run {}",
        shell_word(places.file.display())
    ));
    print(&text)?;
    for doubt in file::doubts(case) {
        note(&format!("warning: {doubt}"));
    }
    Ok(())
}
