//! `asobench observe`: the states of a record, by an observer of a model that is fitted to it.

use super::arguments::refuse;
use super::one_estimator::estimate;
use super::outputs::{state_columns, write_csv, write_page, write_picture, wrote};
use super::report::{Estimate, Report};
use super::{hints, load::load, orders, record, text, words};
use crate::cli::error::{Error, bad_input};
use crate::cli::files::{check_output, write_whole};
use crate::cli::output::{Lines, show};
use crate::estimator::{EstimatorName, Progress};
use crate::files::{Kind, numbers_as_parquet};
use crate::number::plus_minus;
use crate::observer::{ObserverKind, RiccatiError};
use crate::report::plot::Picture;
use crate::text::{rounded, visible};
use arguments::{Choice, Numbers};
use asobench_identification::{ModelObserver, NoiseCovariances, Observation, ObservationError, observe_adaptively};
use faer::{Mat, c64};
use serde_json::{Value, json};
use std::io::Write as _;
use std::path::Path;

mod arguments;
mod picture;

pub(in crate::cli) use arguments::Arguments;

/// Significant digits.
const DIGITS: usize = 6;

/// An observer, and what it made of a record.
struct Observed<'a> {
    report: &'a Report,
    choice: &'a Choice,
    /// `None` of an adaptive one.
    observer: Option<ModelObserver>,
    states: Observation,
    /// Whether the covariances were given.
    is_known: bool,
}

pub(in crate::cli) fn run(arguments: &Arguments) -> Result<(), Error> {
    check_output("--out", arguments.out.as_deref(), Kind::States)?;
    check_output("--plot", arguments.plot.as_deref(), Kind::Figure)?;
    check_output("--report", arguments.report.as_deref(), Kind::Page)?;
    let (mut report, name) = fitted(arguments)?;
    report.tell_in_unit_of_file();
    super::warn(&report, &[name]);
    let pass = &report.estimates[0].last().fitted.pass;
    if pass.progress < Progress::InitialState {
        let why = pass.failure.map(|failure| failure.to_string());
        let why = why.unwrap_or_else(|| "there is no initial state".to_owned());
        return Err(Error::Failed(format!("--estimator {name}: {why}")));
    }
    let observed = observe(arguments, &report)?;
    observed.write(arguments)?;
    show(arguments.format, || observed.text(), || observed.json())
}

/// Reads the record and fits the model.
fn fitted(arguments: &Arguments) -> Result<(Report, EstimatorName), Error> {
    let name = match (&arguments.observer, arguments.estimator) {
        (Choice::Adaptive(name), Some(other)) if other != *name => {
            return Err(Error::Input(format!(
                "--estimator {other}: --observer {name} estimates its own model; expected no --estimator"
            )));
        }
        (Choice::Adaptive(name), _) => *name,
        (Choice::OfModel(_), given) => given.unwrap_or(EstimatorName::InstrumentalVariables),
    };
    let (record, options) = (arguments.record.clone(), arguments.options.clone());
    let mut of = super::Arguments::of_one(record, name, options);
    of.ts = arguments.ts;
    if let Choice::OfModel(ObserverKind::Luenberger(gain)) = &arguments.observer {
        of.gain = gain.clone();
    }
    orders::understand(&mut of)?;
    refuse(&[("--order", orders::ranges(&of).is_some())], orders::ONE_MODEL)?;
    let orders = orders::orders(&of)?;
    let table = record::read(&of.record.file, &of.record)?;
    let mut report = load(&of, orders, record::whole(table, &of.record.file, "observe")?)?;
    let model = estimate(&of, name, &report)?;
    report.estimates.push(model);
    Ok((report, name))
}

/// Returns a covariance of order n, in the unit of the report.
fn covariance(flag: &str, Numbers(numbers): &Numbers, n: usize, unit: f64) -> Result<Mat<f64>, Error> {
    let of = |at: &dyn Fn(usize, usize) -> f64| Mat::from_fn(n, n, |i, j| at(i, j) / (unit * unit));
    Ok(match numbers.len() {
        1 => of(&|i, j| numbers[0] * f64::from(i == j)),
        count if count == n => of(&|i, j| if i == j { numbers[i] } else { 0.0 }),
        count if count == n * n => of(&|i, j| numbers[i * n + j]),
        count => {
            return Err(Error::Input(format!(
                "{flag}: {count} numbers; expected 1, {n} or {}, for {n} states",
                n * n
            )));
        }
    })
}

/// Makes the observer and runs it over the record.
fn observe<'a>(arguments: &'a Arguments, report: &'a Report) -> Result<Observed<'a>, Error> {
    let choice = &arguments.observer;
    let wrong = |error: ObservationError| {
        let line = format!("--observer {choice}: {error}");
        match error {
            ObservationError::NoCovariances => Error::Input(format!(
                "{line}: --process-covariance, --measurement-variance and --start-covariance"
            )),
            ObservationError::Riccati(RiccatiError::NotStabilising(_) | RiccatiError::NoConvergence(_)) => {
                Error::Failed(line)
            }
            ObservationError::Gain(_) | ObservationError::Setup(_) | ObservationError::Riccati(_) => Error::Input(line),
            _ => Error::Failed(line),
        }
    };
    let estimate = &report.estimates[0];
    let fitted = &estimate.last().fitted;
    let (u, y) = (&report.record.u, &report.record.y);
    let n = fitted.pass.a.len();
    let given = |flag: &str, numbers: &Numbers| covariance(flag, numbers, n, report.unit);
    let noise = match (&arguments.process_covariance, arguments.measurement_variance) {
        (Some(process), Some(measurement)) => {
            let start = arguments.start_covariance.as_ref();
            Some(NoiseCovariances {
                process: given("--process-covariance", process)?,
                measurement: measurement / (report.unit * report.unit),
                start: start.map(|start| given("--start-covariance", start)).transpose()?,
            })
        }
        _ => None,
    };
    let kind = match choice {
        Choice::OfModel(ObserverKind::Gpebo(_)) | Choice::Adaptive(_) if noise.is_some() => {
            return Err(Error::Input(format!(
                "--process-covariance: --observer {choice} takes no covariances; expected none"
            )));
        }
        Choice::OfModel(kind) => kind,
        Choice::Adaptive(name) => {
            let options = name.parse(estimate.given()).map_err(bad_input)?;
            let [u, y] = fitted.shifted(u, y);
            return Ok(Observed {
                report,
                choice,
                observer: None,
                states: observe_adaptively(options, n, u, y).map_err(wrong)?,
                is_known: false,
            });
        }
    };
    let window = report.window;
    let observer = fitted.observer(kind, noise.as_ref(), &u[..window], &y[..window]);
    let observer = observer.map_err(wrong)?;
    Ok(Observed {
        report,
        choice,
        states: observer.run(u, y).map_err(wrong)?,
        observer: Some(observer),
        is_known: noise.is_some(),
    })
}

/// The rows of a matrix.
fn rows(m: &Mat<f64>) -> Vec<Vec<f64>> {
    let row = |i: usize| (0..m.ncols()).map(|j| m[(i, j)]).collect();
    (0..m.nrows()).map(row).collect()
}

impl Observed<'_> {
    fn estimate(&self) -> &Estimate {
        &self.report.estimates[0]
    }

    /// The samples that are observed.
    fn samples(&self) -> usize {
        self.states.innovations.len()
    }

    /// Returns the observer in words.
    fn about(&self) -> String {
        let of = match self.choice {
            Choice::OfModel(ObserverKind::Luenberger(_)) => "placed poles",
            Choice::OfModel(ObserverKind::Kalman) => "steady state, white measurement noise",
            Choice::OfModel(ObserverKind::KalmanColoured) => "steady state, measurement noise C/(A D) e",
            Choice::OfModel(ObserverKind::KalmanVarying) => "from P(0)",
            Choice::OfModel(ObserverKind::KalmanNamed(_)) => "steady state",
            Choice::OfModel(ObserverKind::Gpebo(_)) => "no feedback, the start is estimated",
            Choice::Adaptive(_) => "state and parameters, sample by sample",
        };
        let has_noise = self.noise().is_some();
        let covariances = match (has_noise, self.is_known) {
            (false, _) => "",
            (true, true) => ", covariances as given",
            (true, false) => ", covariances identified by maximum likelihood",
        };
        format!("{}: {of}{covariances}", self.choice)
    }

    fn noise(&self) -> Option<&NoiseCovariances> {
        self.observer.as_ref()?.noise.as_ref()
    }

    /// Returns names and values of the gain, the noise and the last state.
    fn numbers(&self) -> Vec<(&'static str, Vec<String>)> {
        let told = |x: &f64| rounded(x + 0.0, DIGITS);
        let all = |values: &[f64]| values.iter().map(told).collect::<Vec<String>>();
        let pole = |pole: &c64| match pole.im {
            0.0 => told(&pole.re),
            im if im < 0.0 => format!("{} - {}i", told(&pole.re), told(&-im)),
            im => format!("{} + {}i", told(&pole.re), told(&im)),
        };
        let mut numbers = Vec::new();
        if let Some(observer) = self.observer.as_ref().filter(|of| !of.gain.is_empty()) {
            numbers.push(("observer gain", all(&observer.gain)));
            numbers.push(("observer poles", observer.poles.iter().map(pole).collect()));
        }
        if let Some(noise) = self.noise() {
            numbers.push(("Q, by rows", all(&rows(&noise.process).concat())));
            numbers.push(("r", all(&[noise.measurement])));
        }
        if let Some(p) = self.observer.as_ref().and_then(|of| of.covariance.as_ref()) {
            let deviations = (0..p.nrows()).map(|i| p[(i, i)].max(0.0).sqrt());
            numbers.push(("sd of the states", all(&deviations.collect::<Vec<f64>>())));
        }
        let last = self.samples() * self.states.order;
        numbers.push(("xhat(K)", all(&self.states.states[last..])));
        numbers
    }

    /// Returns what the innovations say.
    fn innovations(&self) -> String {
        let e = &self.states.innovations;
        let square = e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64;
        let expected = self.observer.as_ref().map(|observer| observer.innovation);
        let expected = expected
            .filter(|of| of.is_finite())
            .map_or_else(String::new, |of| format!(", expected {}", rounded(of, 4)));
        let white = self.states.white.map_or("not tested".to_owned(), words::whiteness);
        format!("{white}; mean square {}{expected}", rounded(square, 4))
    }

    /// The next thing to try with this observer; `None` where it does what it can.
    fn remark(&self) -> Option<&'static str> {
        if self.noise().is_some_and(|of| of.process.norm_max() == 0.0) {
            return Some(
                "no noise in the states: this observer is the model alone, and its bands leave out the errors of the \
                 model and of its start; --process-covariance and --measurement-variance state such noise",
            );
        }
        let is_placed = matches!(self.choice, Choice::OfModel(ObserverKind::Luenberger(_)));
        let coloured = self.states.white.is_some_and(|white| !white.passed);
        if coloured && !self.is_known && matches!(self.choice, Choice::OfModel(ObserverKind::Kalman)) {
            return Some(
                "the innovations are not white: --observer kalman-coloured models a coloured measurement noise",
            );
        }
        (is_placed && coloured)
            .then_some("--observer kalman weighs the model against the noise; its innovations are white if both hold")
    }

    fn text(&self) -> String {
        let Self { report, .. } = self;
        let estimate = self.estimate();
        let mut text = Lines::default();
        text.paragraph(
            &format!(
                "{}: {}, window {} of {} samples, detrend {}",
                visible(report.file.display()),
                text::asked(report.orders),
                report.window,
                report.record.y.len(),
                report.detrend
            ),
            "",
        );
        text.record(report);
        text.line(format_args!("\n{}", words::heading(estimate)));
        // No standard errors are printed here.
        let hints = estimate.hints.iter();
        text.facts("hint", hints.filter(|hint| !hint.starts_with(hints::ASSUMED)));
        let fitted = &estimate.last().fitted;
        text.equation(&fitted.model);
        for (name, offset) in words::offsets(&fitted.pass) {
            text.fact(&name, plus_minus(offset.value, offset.se));
        }
        text.facts("start", words::start(estimate));
        if let Some(fit) = &estimate.fit {
            let [simulated, one_step] = [fit.window.simulated, fit.window.one_step].map(text::percent);
            text.fact("FIT %, window", format!("{simulated} simulated, {one_step} one-step"));
        }
        text.paragraph(&format!("\nobserver {}", self.about()), "  ");
        for (name, values) in self.numbers() {
            let widest = values.iter().map(|cell| cell.chars().count()).max();
            let each = match self.states.order {
                _ if widest > Some(13) => 2,
                n @ 2..=4 if values.len() == n * n => n,
                _ => 4,
            };
            text.cells(name, &values, each);
        }
        text.fact("innovations", self.innovations());
        if !self.states.deviations.is_empty() {
            text.fact("bands", BANDS);
        }
        text.facts("hint", self.remark());
        text.line("");
        text.paragraph(&self.form(), "");
        text.0
    }

    /// Says what the states are of.
    fn form(&self) -> String {
        let shift = self.estimate().shift();
        let of = if shift > 0 {
            format!("; y(k) here is y(k + {shift}) of the file")
        } else {
            String::new()
        };
        let less = match (self.estimate().last().fitted.offset(), self.report.subtracted()) {
            (None, None) => "",
            (None, Some(_)) => "; u and y are less what was subtracted",
            (Some(_), None) => " + offset",
            (Some(_), Some(_)) => " + offset; u and y are less what was subtracted",
        };
        format!(
            "x(k+1) = A x(k) + b u(k), last row of A is a, y = x_1 + d u{less}; xhat(k) knows u and y up to k - 1{of}"
        )
    }

    fn json(&self) -> Value {
        let observer = self.observer.as_ref();
        let noise = self.noise();
        let pole = |pole: &c64| json!({ "re": pole.re, "im": pole.im });
        let poles = observer.map(|of| of.poles.iter().map(pole).collect::<Vec<_>>());
        let n = self.states.order;
        let by_rows = |values: &[f64]| -> Vec<Vec<f64>> { values.chunks(n).map(<[f64]>::to_vec).collect() };
        let mut value = super::json::render(self.report);
        value["observer"] = json!({
            "observer": self.choice.to_string(),
            "gain": observer.map(|of| &of.gain),
            "poles": poles,
            "process_covariance": noise.map(|of| rows(&of.process)),
            "measurement_variance": noise.map(|of| of.measurement),
            "covariances_given": self.is_known,
            "covariance": observer.and_then(|of| of.covariance.as_ref()).map(rows),
            "innovation_variance": observer.map(|of| of.innovation),
            "white": self.states.white,
            "states": by_rows(&self.states.states),
            "deviations": by_rows(&self.states.deviations),
            "predictions": self.states.predictions,
            "innovations": self.states.innovations,
        });
        value
    }

    /// Writes the files that were requested, and says what was written.
    fn write(&self, arguments: &Arguments) -> Result<(), Error> {
        if let Some(path) = &arguments.out {
            self.write_states(path)?;
            wrote(path, "the states, k = 0 ... K");
        }
        let (name, model) = (self.choice.to_string(), &self.estimate().last().fitted);
        let figure = picture::states(self.report, &name, model, &self.states);
        if let Some(path) = &arguments.plot {
            write_picture(path, &figure, "y, its prediction and the states")?;
        }
        match &arguments.report {
            Some(path) => write_page(path, &self.page(&figure)),
            None => Ok(()),
        }
    }

    /// Returns the page of the model with a section of the observer.
    fn page(&self, figure: &Picture) -> String {
        let mut page = super::page::of_models(self.report);
        page.section("observer", "The observer", |section| {
            section.paragraph(&format!("{}.", words::capitalised(&self.about())));
            let numbers = self
                .numbers()
                .into_iter()
                .map(|(name, values)| (name, values.join(", ")));
            section.settings(&numbers.collect::<Vec<_>>());
            section.paragraph(&format!("Innovations: {}.", self.innovations()));
            if let Some(remark) = self.remark() {
                section.paragraph(&format!("{}.", words::capitalised(remark)));
            }
            let bands = if self.states.deviations.is_empty() {
                String::new()
            } else {
                format!(" Bands: {BANDS}.")
            };
            section.figure(
                figure,
                &format!(
                    "Above: y and its prediction; below: the states. {}.{bands}",
                    words::capitalised(&self.form())
                ),
            );
        });
        page.html()
    }

    /// The columns of the states' table; NaN is an empty cell.
    fn columns(&self) -> Vec<(String, Vec<f64>)> {
        let (n, samples, shift) = (self.states.order, self.samples(), self.estimate().shift());
        let of_samples = |values: &[f64]| {
            let values = values.iter().copied();
            values.chain([f64::NAN]).collect::<Vec<f64>>()
        };
        let mut columns = vec![("k".to_owned(), (0..=samples).map(|k| k as f64).collect())];
        columns.extend(state_columns(&self.states.states, n, ""));
        columns.extend(state_columns(&self.states.deviations, n, "_sd"));
        if self.report.clock.is_some() {
            columns.push(("t".to_owned(), (0..=samples).map(|k| self.report.time(k)).collect()));
        }
        columns.extend([
            ("y".to_owned(), of_samples(&self.report.record.y[shift..])),
            ("y_predicted".to_owned(), of_samples(&self.states.predictions)),
            ("innovation".to_owned(), of_samples(&self.states.innovations)),
        ]);
        columns
    }

    fn write_states(&self, path: &Path) -> Result<(), Error> {
        let columns = self.columns();
        if path
            .extension()
            .is_some_and(|form| form.eq_ignore_ascii_case("parquet"))
        {
            return write_whole("--out", path, Kind::States, |to| {
                to.write_all(&numbers_as_parquet(columns)?)
            });
        }
        let about = format!("observer {}; {}", self.choice, self.form());
        write_csv("--out", path, &about, self.report, &columns)
    }
}

/// The bands in words.
const BANDS: &str =
    "two standard deviations of x(k) - xhat(k) by the covariances above, as if the model were the plant";
