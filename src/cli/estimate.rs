//! `asobench estimate`: the twelve stages on a user's own record.

use super::error::Error;
use super::files::{check_output, write_whole};
use super::{Format, note, print, print_json};
use crate::data::csv::{self, Record};
use crate::data::{Detrend, Trend};
use crate::diagnosis::{Precision, Residuals};
use crate::estimator::{
    EstimatorName, Failure, FailureKind, Method, Pass, Problem, Progress, Shape, Stage, Window,
};
use crate::files::Kind;
use crate::metric::{Fit, FitModel, fit};
use crate::model::{LinearModel, Orders};
use crate::observer::{Gain, ObservedModel, Observer};
use crate::plant::PoleFinder;
use crate::text::rounded;
use faer::c64;
use flags::OptionFlags;
use load::{load, orders, ranges};
use scan::Span;
use serde_json::{Map, Value, json};
use std::io::Write as _;
use std::iter;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

mod flags;
mod hints;
mod json;
mod load;
mod page;
mod pictures;
mod scan;
pub(super) mod study_from;
mod text;
mod unit;
mod words;

/// Estimate a plant, its initial state and its observer from a CSV file with columns u and y.
#[derive(clap::Args)]
#[command(
    after_help = "Gains: dead-beat, scaled:RHO (eigenvalues RHO * eig(A-hat)), poles:LIST (such as \
                        poles:0.2,0.1+0.3i,0.1-0.3i)"
)]
pub(super) struct Arguments {
    #[command(flatten)]
    record: RecordArguments,
    /// Estimators, separated by commas; `asobench methods` prints them
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "ls,iv"
    )]
    estimator: Vec<EstimatorName>,
    /// The observer's gain: dead-beat, scaled:RHO, poles:LIST
    #[arg(long, value_name = "GAIN", default_value_t)]
    gain: Gain,
    /// Write the last estimator's observer states, k = 0 ... K, to a CSV file
    #[arg(long, value_name = "STATES.csv")]
    states: Option<PathBuf>,
    /// Draw measured and simulated output, and prediction errors; for a range of orders, the criteria
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Write a page: the record, models with intervals, residuals, poles and zeros, responses
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    format: Format,
    #[command(flatten, next_help_heading = "Options of the estimators")]
    options: OptionFlags,
}

/// A record, and the orders of its models.
#[derive(Clone, clap::Args)]
struct RecordArguments {
    /// CSV file with a header line, or - for standard input: columns u, y and perhaps k or t (time); lines beginning
    /// with # are comments
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Order n of the plant: na = nb = n; or --orders, for estimators that take it. A range such as 1:8 compares ARX
    /// models of these orders
    #[arg(long, value_name = "n", allow_negative_numbers = true)]
    order: Option<Span>,
    /// Delay nk of the input, samples, or a range, beside --order [default: 1]
    #[arg(long, value_name = "nk", allow_negative_numbers = true)]
    delay: Option<Span>,
    /// Samples used for estimation, from the first [default: all]; the rest is for validation
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole)]
    window: Option<usize>,
    /// Trend to subtract from u and y, fitted on the window: none, mean, linear
    #[arg(long, value_name = "WHAT", default_value_t)]
    detrend: Detrend,
}

fn whole(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number) if number >= 1 => Ok(number),
        _ => Err("expected a whole number of at least 1".to_owned()),
    }
}

/// The estimates, with all that is printed.
struct Report {
    file: PathBuf,
    /// The record, in a unit that [`unit_of`] chooses.
    record: Record,
    /// The unit of u and y, a power of two; 1 for all records but those of very large or very small numbers.
    unit: f64,
    /// Samples in the window.
    window: usize,
    /// The orders as given; with `--order` and `--delay`, those of the ARX form.
    orders: Orders,
    detrend: Detrend,
    /// The trends subtracted from u and from y.
    trends: [Trend; 2],
    gain: Gain,
    /// [`feedback_p_value`] of the window.
    feedback: Option<f64>,
    estimates: Vec<Estimate>,
}

/// One estimator's passes and what follows from its last one.
struct Estimate {
    name: EstimatorName,
    /// Every option with its value.
    options: Map<String, Value>,
    /// For estimators without a delay: by how many samples y was advanced to remove the delay.
    shift: usize,
    /// Passes with their numbers; the number is 0 for an estimator without iterations.
    passes: Vec<(usize, PassReport)>,
    observer: Option<Observed>,
    fit: Option<Fits>,
    /// What the user may do about the record or the method.
    hints: Vec<String>,
}

/// A pass with its poles, largest modulus first, and its spectral radius if it has parameters.
struct PassReport {
    pass: Pass,
    /// The model of the original record, including its delay.
    model: LinearModel,
    poles: Vec<c64>,
    radius: Option<f64>,
    /// Standard errors of the poles and of the static gain.
    precision: Option<Precision>,
    /// Tests of the residuals, if there are enough of them.
    residuals: Option<Residuals>,
    /// [`feedback_p_value`] of the record.
    feedback: Option<f64>,
}

impl PassReport {
    /// Returns the model if it has parameters.
    fn known_model(&self) -> Option<&LinearModel> {
        (self.pass.progress >= Progress::Parameters).then_some(&self.model)
    }
}

struct Fits {
    window: Fit,
    validation: Option<Fit>,
}

struct Observed {
    g: Vec<f64>,
    at_window: Vec<f64>,
    last: Vec<f64>,
}

/// u and y as an estimator without a delay receives them, and the window's length.
#[derive(Clone, Copy)]
struct Samples<'a> {
    u: &'a [f64],
    y: &'a [f64],
    window: usize,
}

impl Report {
    /// Returns the record with u'(k) = u(k) and y'(k) = y(k + shift), whose delay is 1.
    fn shifted(&self, shift: usize) -> Samples<'_> {
        Samples {
            u: &self.record.u[..self.record.u.len() - shift],
            y: &self.record.y[shift..],
            window: self.window - shift,
        }
    }

    /// Returns the largest shift of an estimate.
    fn shift(&self) -> usize {
        let shifts = self.estimates.iter().map(|estimate| estimate.shift);
        shifts.max().unwrap_or(0)
    }
}

impl Estimate {
    /// Returns the last pass, the estimator's result.
    fn last(&self) -> &PassReport {
        &self.passes[self.passes.len() - 1].1
    }

    fn failure(&self) -> Option<Failure> {
        self.last().pass.failure
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    check_output("--states", arguments.states.as_deref(), Kind::States)?;
    check_drawing("--plot", arguments.plot.as_deref(), "svg", Kind::Figure)?;
    check_drawing("--report", arguments.report.as_deref(), "html", Kind::Page)?;
    let orders = orders(arguments)?;
    let mut report = load(arguments, orders)?;
    if let Some((order, delay)) = ranges(arguments) {
        let scan = scan::scan(&report, order, delay)?;
        report.tell_in_unit_of_file();
        warn_of_offset(&report);
        write_drawings(arguments, || scan.picture(), || scan.page(&report))?;
        scan.print(&report, arguments.format)?;
        return Ok(ExitCode::SUCCESS);
    }
    for (i, name) in arguments.estimator.iter().enumerate() {
        if !arguments.estimator[..i].contains(name) {
            let estimate = estimate(arguments, *name, &report)?;
            report.estimates.push(estimate);
        }
    }
    report.tell_in_unit_of_file();
    warn(&report);
    if let Some(path) = &arguments.states {
        write_states(path, &report)?;
    }
    write_drawings(
        arguments,
        || pictures::outputs(&report),
        || page::render(&report),
    )?;
    match arguments.format {
        Format::Text => print(&text::render(&report))?,
        Format::Json => print_json(&json::render(&report))?,
    }
    let failed = report.estimates.iter().any(|estimate| {
        estimate
            .failure()
            .is_some_and(|of| !of.kind.leaves_a_model())
    });
    Ok(ExitCode::from(u8::from(failed)))
}

/// Refuses a file with the wrong extension, or a file that this program did not write.
fn check_drawing(
    flag: &str,
    path: Option<&Path>,
    extension: &str,
    kind: Kind,
) -> Result<(), Error> {
    if let Some(path) = path.filter(|path| path.extension().is_none_or(|own| own != extension)) {
        let path = path.display();
        return Err(Error::Input(format!(
            "{flag} {path}: expected a name that ends in .{extension}"
        )));
    }
    check_output(flag, path, kind)
}

/// Writes the picture and the page that were requested.
fn write_drawings(
    arguments: &Arguments,
    picture: impl FnOnce() -> String,
    page: impl FnOnce() -> String,
) -> Result<(), Error> {
    let write = |flag: &str, path: &Path, kind: Kind, text: String| {
        write_whole(flag, path, kind, |to| to.write_all(text.as_bytes()))
    };
    if let Some(path) = &arguments.plot {
        write("--plot", path, Kind::Figure, picture())?;
    }
    if let Some(path) = &arguments.report {
        write("--report", path, Kind::Page, page())?;
    }
    Ok(())
}

/// Warns of an output far from zero: models without an offset do not describe it. A step less its mean is nothing.
fn warn_of_offset(report: &Report) {
    if report.detrend != Detrend::None || hints::is_constant(&report.record.u[..report.window]) {
        return;
    }
    let y = &report.record.y[..report.window];
    let count = y.len() as f64;
    let mean = y.iter().sum::<f64>() / count;
    let variance = y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count;
    if mean.powi(2) > variance {
        note(&format!(
            "warning: y has mean {} and standard deviation {}, but the models have no offset; --detrend mean subtracts \
             the means",
            rounded(mean * report.unit, 3),
            rounded(variance.sqrt() * report.unit, 3)
        ));
    }
}

/// Runs an estimator on the window.
fn estimate(
    arguments: &Arguments,
    name: EstimatorName,
    report: &Report,
) -> Result<Estimate, Error> {
    let bad = |message: String| Error::Input(format!("--estimator {name}: {message}"));
    let Orders { na: order, nk, .. } = report.orders;
    let mut options = arguments.options.taken_by(name);
    if name.takes("gain") {
        options.insert("gain".to_owned(), json!(arguments.gain));
    }
    let parse = |options: &Map<String, Value>| {
        name.parse(options.clone())
            .map_err(|error| match error.key {
                Some(key) if key == "orders" && !arguments.options.has("orders") => {
                    bad(format!("of --order and --delay: {}", error.message))
                }
                Some(key) => {
                    let flag = key.replace('_', "-");
                    Error::Input(format!("--{flag}: {} (estimator {name})", error.message))
                }
                None => bad(error.message),
            })
    };
    let mut parsed = parse(&options)?;
    if let Some(orders) = parsed
        .model_orders(order)
        .filter(|_| !options.contains_key("orders"))
    {
        // From --order and --delay.
        options.insert("orders".to_owned(), json!(Orders { nk, ..orders }));
        parsed = parse(&options)?;
    }
    let options = parsed;
    // A model without a delay of its own sees the record without the delay.
    let shift = options.model_orders(order).map_or(nk - 1, |_| 0);
    let gain = arguments.gain.check(options.order(order));
    gain.map_err(|error| Error::Input(format!("--gain: {error}")))?;
    let samples = report.shifted(shift);
    let shape = Shape {
        order,
        window: samples.window,
    };
    let described = options.describe();
    let method = Method::named(name.name(), options);
    let prepared = method.prepare(Problem {
        covariance: true,
        ..shape.into()
    });
    let mut estimator = prepared.map_err(|error| bad(error.to_string()))?;
    let mut passes = vec![Pass::new(order); method.passes()];
    let window = Window::new(samples.u, samples.y, samples.window);
    estimator.estimate(window, &mut passes);
    // Iteration 0 may belong to another estimator, under that estimator's name.
    let numbers = method.outputs().iter().zip(passes);
    let own = numbers.filter(|(output, _)| output.estimator == name.name());
    let passes = own.map(|(output, pass)| (output.pass, pass_report(pass, report, shift)));
    let mut estimate = Estimate {
        name,
        options: described,
        shift,
        passes: passes.collect(),
        observer: None,
        fit: None,
        hints: Vec::new(),
    };
    conclude(&mut estimate, &arguments.gain, report);
    estimate.hints = hints::of(&estimate, report);
    Ok(estimate)
}

/// Returns a pass with its delay, loss and poles.
fn pass_report(mut pass: Pass, report: &Report, shift: usize) -> PassReport {
    let mut model = pass.model.clone();
    if pass.progress < Progress::Parameters {
        return PassReport {
            pass,
            model,
            poles: Vec::new(),
            radius: None,
            precision: None,
            residuals: None,
            feedback: None,
        };
    }
    model.delay += shift;
    model.b.splice(0..0, iter::repeat_n(0.0, shift));
    if pass.loss.is_nan() {
        let (sum, rows) = complete_residuals(&model, report);
        let parameters = model.orders().parameters();
        pass.loss = sum / report.window as f64;
        if model.noise_variance.is_nan() && rows > parameters {
            model.noise_variance = sum / (rows - parameters) as f64;
        }
    }
    // Without the zero poles that a delay adds.
    let degree = model.a.len() + model.f.len() - 2;
    let mut finder = PoleFinder::new(pass.a.len());
    let radius = finder.spectral_radius(&pass.a, !pass.unstable);
    let poles = finder.poles(&pass.a[pass.a.len() - degree..]);
    let (u, y) = (&report.record.u, &report.record.y);
    let window = report.window;
    PassReport {
        precision: Some(Precision::new(&model, &poles)),
        residuals: Residuals::new(&model, &u[..window], &y[..window]),
        feedback: report.feedback,
        poles,
        radius: Some(radius),
        pass,
        model,
    }
}

/// Returns the sum of squared prediction errors, and their number, over those rows of the window that look back only
/// within the record.
fn complete_residuals(model: &LinearModel, report: &Report) -> (f64, usize) {
    let (u, y) = (
        &report.record.u[..report.window],
        &report.record.y[..report.window],
    );
    let (mut e, mut scratch) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    model.residuals(u, y, &mut e, &mut scratch);
    let e = &e[model.orders().reach().min(u.len())..];
    (e.iter().map(|e| e * e).sum(), e.len())
}

/// Computes FIT and observer for the last pass.
fn conclude(estimate: &mut Estimate, gain: &Gain, report: &Report) {
    let samples = report.shifted(estimate.shift);
    let window = samples.window;
    let last = estimate.passes.len() - 1;
    let (number, PassReport { pass, .. }) = &mut estimate.passes[last];
    if pass.progress < Progress::InitialState {
        return;
    }
    let model = FitModel {
        model: &pass.model,
        a: &pass.a,
        b: &pass.b,
        d: pass.direct,
        x0: &pass.x0,
    };
    let on = |range| fit(model, samples.u, samples.y, window, range);
    estimate.fit = Some(Fits {
        window: on(0..window),
        validation: (window < samples.y.len()).then(|| on(window..samples.y.len())),
    });
    let observed = match pass.observed() {
        Some(model) => observe(model, gain, samples),
        None => return,
    };
    match observed {
        Err(kind) => pass.fail(Failure {
            kind,
            stage: Stage::Observer,
            pass: *number,
        }),
        Ok(observed) => estimate.observer = Some(observed),
    }
}

/// Runs stage 12 on the whole record.
fn observe(
    model: ObservedModel<'_>,
    gain: &Gain,
    samples: Samples<'_>,
) -> Result<Observed, FailureKind> {
    let mut observer = Observer::new(gain.clone(), model.a.len());
    let (mut at_window, mut last) = (Vec::new(), model.x0.to_vec());
    observer.run(model, samples.u, samples.y, |k, x| {
        if k == samples.window {
            at_window = x.to_vec();
        }
        last.copy_from_slice(x);
    })?;
    if samples.window == samples.y.len() {
        at_window = observer.state().to_vec();
    }
    Ok(Observed {
        g: observer.g().to_vec(),
        at_window,
        last,
    })
}

/// Prints warnings to standard error, one line each.
fn warn(report: &Report) {
    warn_of_offset(report);
    if report.gain.places_unstable_pole() {
        note(&format!(
            "warning: --gain {} has a pole on or outside the unit circle",
            report.gain
        ));
    }
    for estimate in &report.estimates {
        let last = estimate.last();
        if last.pass.unstable {
            note(&format!(
                "warning: {}: A-hat has a pole on or outside the unit circle",
                estimate.name
            ));
        }
        if let Some(sentence) = words::unfinished(estimate) {
            note(&format!("warning: {}: {sentence}", estimate.name));
        }
        if let (Gain::Scaled(rho), Some(pole)) = (&report.gain, last.poles.first())
            && rho.abs() * pole.norm() >= 1.0
        {
            note(&format!(
                "warning: {}: --gain {} leaves a pole on or outside the unit circle",
                estimate.name, report.gain
            ));
        }
    }
}

/// Writes the last estimator's observer states, k = 0 ... K, if they are known.
fn write_states(path: &Path, report: &Report) -> Result<(), Error> {
    let Some(estimate) = report
        .estimates
        .last()
        .filter(|estimate| estimate.observer.is_some())
    else {
        note(&format!(
            "warning: --states {}: not written, there is no observer",
            path.display()
        ));
        return Ok(());
    };
    let Some(model) = estimate.last().pass.observed() else {
        return Ok(());
    };
    let samples = report.shifted(estimate.shift);
    write_whole("--states", path, Kind::States, |to| {
        let unit = report
            .unit_in_words()
            .map_or_else(String::new, |words| format!("; {words}"));
        let comment = format!("observer {}, gain {}{unit}", estimate.name, report.gain);
        writeln!(to, "{}", csv::comment(&comment))?;
        let states = (1..=model.a.len()).map(|i| format!("x{i}"));
        let names: Vec<String> = iter::once("k".to_owned()).chain(states).collect();
        let names = names.iter().map(|name| csv::Cell::Text(name));
        writeln!(to, "{}", csv::line(names))?;
        let mut row = |k: usize, x: &[f64]| {
            let numbers = iter::once(k as f64).chain(x.iter().copied());
            writeln!(to, "{}", csv::line(numbers.map(csv::Cell::Number)))
        };
        let mut observer = Observer::new(report.gain.clone(), model.a.len());
        let mut written = Ok(());
        let observed = observer.run(model, samples.u, samples.y, |k, x| {
            if written.is_ok() {
                written = row(k, x);
            }
        });
        written?;
        observed.map_err(|kind| std::io::Error::other(kind.name()))?;
        row(samples.y.len(), observer.state())
    })
}
