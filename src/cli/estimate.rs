//! `asobench estimate`: the twelve stages on a record of the user's own.

use super::error::Error;
use super::files::{check_output, write_whole};
use super::{Format, note, print, print_json};
use crate::data::csv::{self, Record};
use crate::data::{Detrend, Trend};
use crate::estimator::{
    Auxiliary, Drive, Failure, FailureKind, IvOptions, LsOptions, Method, Pass, Progress,
    SetupError, Shape, Solver, Stage, Stage10, Window,
};
use crate::files::{self, Kind};
use crate::metric::{Fit, FitModel, fit};
use crate::names::named_enum;
use crate::observer::{Gain, ObservedModel, Observer};
use crate::plant::{ORDER_LIMIT, PoleFinder};
use crate::study::file::MOST_ITERATIONS;
use faer::c64;
use std::io::Write as _;
use std::iter;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

mod json;
mod text;

named_enum! {
    /// An estimator that the command line knows.
    Name, "estimator" {
        /// Least squares.
        LeastSquares = "ls",
        /// Instrumental variables.
        InstrumentalVariables = "iv",
    }
}

/// Estimate a plant, its initial state and its observer from a CSV file with columns u and y.
#[derive(clap::Args)]
#[command(
    after_help = "Gains: dead-beat, scaled:RHO (eigenvalues RHO * eig(A-hat)), poles:LIST (such as \
                        poles:0.2,0.1+0.3i,0.1-0.3i)"
)]
pub(super) struct Arguments {
    /// CSV file with a header line, or - for standard input: columns u, y and perhaps k; lines beginning with # are
    /// comments
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Order n of the plant
    #[arg(long, value_name = "n", allow_negative_numbers = true, value_parser = whole)]
    order: usize,
    /// Delay nk of the input, samples
    #[arg(long, value_name = "nk", default_value_t = 1, allow_negative_numbers = true, value_parser = whole)]
    delay: usize,
    /// Samples used for estimation, from the first [default: all]; the rest validates
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole)]
    window: Option<usize>,
    /// Estimators, separated by commas: ls, iv
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "ls,iv"
    )]
    estimator: Vec<Name>,
    /// IV passes
    #[arg(long, value_name = "COUNT", default_value_t = 4, allow_negative_numbers = true, value_parser = whole)]
    iterations: usize,
    /// How p is solved for: partitioned, lu, cholesky (ls only), qr, svd, dual, augmented
    #[arg(long, value_name = "NAME", default_value_t)]
    solver: Solver,
    /// What each IV pass renews: refresh, frozen, literal
    #[arg(long, value_name = "READING", default_value_t)]
    auxiliary: Auxiliary,
    /// What drives the auxiliary model: model, observer
    #[arg(long, value_name = "READING", default_value_t)]
    drive: Drive,
    /// Formula of stage 10: corrected, as-printed, as-printed-2024
    #[arg(long, value_name = "READING", default_value_t)]
    stage10: Stage10,
    /// Subtract from u and y, fitted on the window: none, mean, linear
    #[arg(long, value_name = "WHAT", default_value_t)]
    detrend: Detrend,
    /// The observer's gain: dead-beat, scaled:RHO, poles:LIST
    #[arg(long, value_name = "GAIN", default_value_t)]
    gain: Gain,
    /// Write the last estimator's observer states, k = 0 ... K, to a CSV file
    #[arg(long, value_name = "STATES.csv")]
    states: Option<PathBuf>,
    /// Form of the output: text or json
    #[arg(long, value_name = "FORMAT", default_value_t)]
    format: Format,
}

fn whole(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number) if number >= 1 => Ok(number),
        _ => Err("expected a whole number of at least 1".to_owned()),
    }
}

/// What was estimated, for printing.
struct Report {
    file: PathBuf,
    order: usize,
    delay: usize,
    /// Samples of the record after the shift by the delay.
    samples: usize,
    /// Window after the shift.
    window: usize,
    solver: Solver,
    detrend: Detrend,
    gain: Gain,
    estimates: Vec<Estimate>,
}

/// One estimator's passes and what follows from its last one.
struct Estimate {
    name: Name,
    /// Passes with their numbers: 0 for least squares, 1, 2, ... for IV.
    passes: Vec<(usize, PassReport)>,
    observer: Option<Observed>,
    fit: Option<Fits>,
}

/// A pass with its poles, largest modulus first, and the spectral radius where it has parameters.
struct PassReport {
    pass: Pass,
    poles: Vec<c64>,
    radius: Option<f64>,
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

impl Estimate {
    /// The last pass: what the estimator stands for.
    fn last(&self) -> &PassReport {
        &self.passes[self.passes.len() - 1].1
    }

    fn failure(&self) -> Option<Failure> {
        self.last().pass.failure
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    check_output("--states", arguments.states.as_deref(), Kind::States)?;
    let (record, window) = load(arguments)?;
    let report = estimate(arguments, &record, window)?;
    warn(&report);
    if let Some(path) = &arguments.states {
        write_states(path, &report, &record)?;
    }
    match arguments.format {
        Format::Text => print(&text::render(&report))?,
        Format::Json => print_json(&json::render(&report))?,
    }
    let failed = report
        .estimates
        .iter()
        .any(|estimate| estimate.failure().is_some());
    Ok(ExitCode::from(u8::from(failed)))
}

/// Reads, checks, shifts by the delay and detrends; returns the record and the window's length.
fn load(arguments: &Arguments) -> Result<(Record, usize), Error> {
    let path = arguments.file.display();
    let bad = |message: String| Error::Input(format!("{path}: {message}"));
    if arguments.stage10 != Stage10::Corrected && arguments.solver != Solver::Partitioned {
        return Err(Error::Input(format!(
            "--stage10 {}: exists for --solver partitioned only, not '{}'",
            arguments.stage10, arguments.solver
        )));
    }
    if arguments.iterations > MOST_ITERATIONS {
        return Err(Error::Input(format!(
            "--iterations: {}; expected 1 to {MOST_ITERATIONS}",
            arguments.iterations
        )));
    }
    arguments
        .gain
        .check(arguments.order)
        .map_err(|e| Error::Input(format!("--gain: {e}")))?;
    let file = files::open_named(&arguments.file, Kind::Record);
    let file = file.map_err(|error| bad(error.to_string()))?;
    let mut record = csv::read(file).map_err(|error| bad(error.to_string()))?;
    let rows = record.y.len();
    let needed = 3_usize
        .saturating_mul(arguments.order)
        .saturating_add(arguments.delay - 1);
    if rows < needed {
        return Err(bad(format!(
            "{rows} samples are too few for order {} and delay {}: at least {needed} are needed",
            arguments.order, arguments.delay
        )));
    }
    if arguments.order > ORDER_LIMIT {
        let error = SetupError::LargeOrder(arguments.order);
        return Err(Error::Input(format!("--order: {error}")));
    }
    let window = arguments.window.unwrap_or(rows);
    if window > rows {
        return Err(Error::Input(format!(
            "--window: {window} is more than the {rows} samples of {path}"
        )));
    }
    if window < needed {
        return Err(Error::Input(format!(
            "--window: {window} is too short for order {} and delay {}: at least {needed} are needed",
            arguments.order, arguments.delay
        )));
    }
    for (name, values) in [("u", &record.u), ("y", &record.y)] {
        if values[..window].iter().all(|value| *value == values[0]) {
            return Err(bad(format!(
                "column {name} is constant over the window; nothing can be identified from it"
            )));
        }
    }
    for (name, values) in [("u", &mut record.u), ("y", &mut record.y)] {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let before = largest(&values[..window]);
        Trend::fit(arguments.detrend, &values[..window]).subtract(values);
        if largest(&values[..window]) <= 64.0 * f64::EPSILON * before {
            return Err(bad(format!(
                "column {name} is nothing but its {} trend over the window; nothing is left to identify from",
                arguments.detrend
            )));
        }
    }
    // With u'(k) = u(k), y'(k) = y(k + nk - 1) the delay is 1.
    let shift = arguments.delay - 1;
    record.y.drain(..shift);
    record.u.truncate(rows - shift);
    Ok((record, window - shift))
}

fn estimate(arguments: &Arguments, record: &Record, window: usize) -> Result<Report, Error> {
    let shape = Shape {
        order: arguments.order,
        window,
    };
    let samples = Window::new(&record.u, &record.y, window);
    let options = IvOptions {
        iterations: arguments.iterations,
        solver: arguments.solver,
        stage10: arguments.stage10,
        auxiliary: arguments.auxiliary,
        drive: arguments.drive,
        gain: arguments.gain.clone(),
        ..IvOptions::default()
    };
    let mut estimates: Vec<Estimate> = Vec::new();
    for &name in &arguments.estimator {
        if estimates.iter().any(|estimate| estimate.name == name) {
            continue;
        }
        let method = match name {
            Name::LeastSquares => Method::least_squares(LsOptions {
                solver: arguments.solver,
                ..LsOptions::default()
            }),
            Name::InstrumentalVariables => Method::instrumental_variables(options.clone()),
        };
        let mut estimator = method
            .prepare(shape)
            .map_err(|error| Error::Input(format!("--estimator {name}: {error}")))?;
        let mut passes = vec![Pass::new(shape.order); method.outputs().len()];
        estimator.estimate(samples, &mut passes);
        let numbers = method.outputs().iter().map(|output| output.pass);
        let passes = numbers.zip(passes).filter(|(number, _)| match name {
            Name::LeastSquares => true,
            Name::InstrumentalVariables => *number > 0,
        });
        estimates.push(conclude(name, passes, arguments, record, window));
    }
    Ok(Report {
        file: arguments.file.clone(),
        order: arguments.order,
        delay: arguments.delay,
        samples: record.y.len(),
        window,
        solver: arguments.solver,
        detrend: arguments.detrend,
        gain: arguments.gain.clone(),
        estimates,
    })
}

/// Poles of every pass, FIT and observer of the last one.
fn conclude(
    name: Name,
    passes: impl Iterator<Item = (usize, Pass)>,
    arguments: &Arguments,
    record: &Record,
    window: usize,
) -> Estimate {
    let mut finder = PoleFinder::new(arguments.order);
    let passes: Vec<(usize, PassReport)> = passes
        .map(|(number, pass)| {
            let known = pass.progress >= Progress::Parameters;
            let (poles, radius) = if known {
                let radius = finder.spectral_radius(&pass.a, !pass.unstable);
                (finder.poles(&pass.a), Some(radius))
            } else {
                (Vec::new(), None)
            };
            let report = PassReport {
                pass,
                poles,
                radius,
            };
            (number, report)
        })
        .collect();
    let mut estimate = Estimate {
        name,
        passes,
        observer: None,
        fit: None,
    };
    let pass = &estimate.last().pass;
    if pass.progress == Progress::InitialState {
        let model = FitModel {
            a: &pass.a,
            b: &pass.b,
            h: &pass.h,
            x0: &pass.x0,
        };
        let samples = record.y.len();
        let on = |range| fit(model, &record.u, &record.y, range);
        let fits = Fits {
            window: on(0..window),
            validation: (window < samples).then(|| on(window..samples)),
        };
        let observed = pass
            .observed()
            .map(|model| observe(model, &arguments.gain, record, window));
        estimate.fit = Some(fits);
        let last = estimate.passes.len() - 1;
        let (number, report) = &mut estimate.passes[last];
        match observed {
            Some(Err(kind)) => report.pass.fail(Failure {
                kind,
                stage: Stage::Observer,
                pass: *number,
            }),
            Some(Ok(observed)) => estimate.observer = Some(observed),
            None => {}
        }
    }
    estimate
}

/// Stage 12 on the whole record.
fn observe(
    model: ObservedModel<'_>,
    gain: &Gain,
    record: &Record,
    window: usize,
) -> Result<Observed, FailureKind> {
    let mut observer = Observer::new(gain.clone(), model.a.len());
    let (mut at_window, mut last) = (Vec::new(), model.x0.to_vec());
    observer.run(model, &record.u, &record.y, |k, x| {
        if k == window {
            at_window = x.to_vec();
        }
        last.copy_from_slice(x);
    })?;
    if window == record.y.len() {
        at_window = observer.state().to_vec();
    }
    Ok(Observed {
        g: observer.g().to_vec(),
        at_window,
        last,
    })
}

/// Warnings on standard error, one line each.
fn warn(report: &Report) {
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

/// Writes the last estimator's observer states, k = 0 ... K, where they are known.
fn write_states(path: &Path, report: &Report, record: &Record) -> Result<(), Error> {
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
    write_whole("--states", path, Kind::States, |to| {
        let comment = format!("observer {}, gain {}", estimate.name, report.gain);
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
        let observed = observer.run(model, &record.u, &record.y, |k, x| {
            if written.is_ok() {
                written = row(k, x);
            }
        });
        written?;
        observed.map_err(|kind| std::io::Error::other(kind.name()))?;
        row(record.y.len(), observer.state())
    })
}
