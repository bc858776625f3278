//! All that one trial computes, printed by stage.

use crate::cli::error::{Error, failed};
use crate::cli::output::{Format, Lines, show};
use crate::data::Realisation;
use crate::estimator::auxiliary::AuxiliaryModel;
use crate::estimator::information::Information;
use crate::estimator::solver::Instruments;
use crate::estimator::{Auxiliary, InstrumentSource, Method, Output, Pass, Progress, Stabilise, Window};
use crate::study::file::MethodTable;
use crate::study::{
    Cell, DiscreteCell, Experiment, Measure, Row, Rows, Source, StoreError, StoredTrials, TrialRecord, design_of,
    read_manifest, read_results, stage_twelve,
};
use crate::text::{number, visible};
use serde_json::{Value, json};
use std::path::Path;

/// The uses of a replay.
pub(in crate::cli) struct Options<'a> {
    /// The flag that names the trial, for messages; empty if it is an argument.
    pub(in crate::cli) flag: &'static str,
    /// The folder with whose rows the replay is compared.
    pub(in crate::cli) folder: &'a Path,
    /// The command that makes this replay.
    pub(in crate::cli) command: String,
    /// The file to which the record is written.
    pub(in crate::cli) data: Option<&'a Path>,
    /// The form of the output.
    pub(in crate::cli) format: Format,
    /// Whether long vectors are printed whole: the samples.
    pub(in crate::cli) samples: bool,
}

/// A vector with more numbers is one of samples, of which text has the first line alone unless it is asked for.
const LONG: usize = 48;
/// Numbers in a line.
const IN_LINE: usize = 3;

/// Whether the stored rows equal these bit for bit; `None` if the folder does not hold this trial of this experiment.
///
/// # Errors
/// If the stored trials cannot be read.
pub(super) fn stored(
    folder: &Path,
    experiment: &Experiment,
    cell: usize,
    rows: &Rows,
) -> Result<Option<bool>, StoreError> {
    // Other contents of the folder do not matter to a replay.
    if !matches!(read_manifest(folder), Ok(Some(_))) {
        return Ok(None);
    }
    read_results(folder, |manifest| {
        let Some(trials) = trials_of(manifest, experiment) else {
            return Ok(None);
        };
        let all = trials.iter().fold(0_u64, |all, of| all.saturating_add(*of));
        let all = all.saturating_mul(rows.len() as u64);
        match StoredTrials::open(folder, all)? {
            Some(mut stored) => stored.alike(experiment, cell, &trials, rows),
            None => Ok(None),
        }
    })
}

/// The number of trials of each cell, if the manifest is that of whole results of this experiment.
fn trials_of(manifest: &Value, experiment: &Experiment) -> Option<Vec<u64>> {
    let partial = manifest["partial"] == Value::Bool(true);
    if partial || design_of(&manifest["experiment"]) != experiment.design() {
        return None;
    }
    match &manifest["trials"] {
        Value::Array(counts) => counts.iter().map(Value::as_u64).collect(),
        count => Some(vec![count.as_u64()?; experiment.cells.len()]),
    }
}

/// One stage's vectors under their names.
pub(super) type Stage = (String, Vec<(String, Vec<f64>)>);

/// All that one trial computes, by stage.
pub(super) struct Replay<'a> {
    pub(super) cell: &'a Cell,
    pub(super) index: usize,
    pub(super) trial: u64,
    pub(super) seed: u64,
    /// Whether the rows equal the stored ones; `None` if there are none.
    pub(super) stored: Result<Option<bool>, StoreError>,
    /// A method whose program says that it is not deterministic.
    pub(super) may_differ: Option<String>,
    pub(super) stages: Vec<Stage>,
    pub(super) rows: Vec<(Output, &'a Row)>,
}

impl<'a> Replay<'a> {
    pub(super) fn new(
        experiment: &'a Experiment,
        (index, cell): (usize, &DiscreteCell),
        trial: u64,
        record: &TrialRecord<'a>,
    ) -> Self {
        let data = record.realisation;
        let window = Window::with_reference(&data.u, &data.y, &data.r, cell.window);
        let named = |name: &str, values: &[f64]| (name.to_owned(), values.to_vec());
        let mut vectors = vec![
            named("u", &data.u),
            named("y", &data.y),
            named("noise factor", &[data.scale]),
        ];
        let truth = &data.truth;
        vectors.push(named("true a", &truth.a));
        vectors.push(named("true b", &truth.b));
        vectors.push(named("true x(0)", &truth.x0));
        if !cell.follows_input() {
            vectors.push(named("x(k), k = 0, 1, ...", &data.states));
        }
        let mut stages = vec![("Stage 1: data".to_owned(), vectors)];
        let tables = experiment.file.methods.iter().zip(&experiment.methods);
        for ((table, method), passes) in tables.zip(&record.methods) {
            for (number, pass) in passes.iter().enumerate() {
                let name = format!("{} pass {number}", table.output_name(number));
                let solve = if number == 0 { 3 } else { 10 };
                if table.is_of_the_paper() {
                    stages.extend(information(table, window, passes, number, &name));
                }
                stages.extend(parameters(&name, solve, pass));
                stages.extend(observer(&name, cell, method, data, pass));
            }
        }
        let output = |row: &Row| record.passes[row.output].0.clone();
        Self {
            cell: &experiment.cells[index],
            index,
            trial,
            seed: experiment.file.seed,
            stored: Ok(None),
            may_differ: None,
            stages,
            rows: record.rows.iter().map(|row| (output(row), row)).collect(),
        }
    }

    pub(super) fn print(&self, options: &Options<'_>) -> Result<(), Error> {
        show(options.format, || self.text(options), || self.json())?;
        self.stored.as_ref().map(|_| ()).map_err(failed)
    }

    /// Returns the cell's settings, and what its vectors mean.
    fn head(&self) -> (String, &'static str) {
        match &self.cell.source {
            Source::Discrete(cell) => (
                format!(
                    "eta = {} %, N = {}, K = {}",
                    number(cell.eta),
                    cell.window,
                    cell.horizon
                ),
                "p = (alpha, beta), A(q) = 1 + alpha_1 q^-1 + ..., a_i = -alpha_(n+1-i), h = beta",
            ),
            Source::Continuous(cell) => (
                format!("continuous time, T = {} s, step {} s", cell.until, cell.step),
                "integration errors are estimated by halving the step twice",
            ),
        }
    }

    fn text(&self, options: &Options<'_>) -> String {
        let mut text = Lines::default();
        let folder = options.folder;
        let (settings, meaning) = self.head();
        let name = match self.cell.claim.as_str() {
            "" => self.index.to_string(),
            claim => format!("{}, {}", self.index, visible(claim)),
        };
        text.line(format_args!(
            "Cell {name} ({settings}), trial {}, seed {}\n{meaning}\n\nRows",
            self.trial, self.seed
        ));
        for (output, row) in &self.rows {
            let status = row.failure.map_or_else(|| "ok".to_owned(), |f| f.to_string());
            let name = match self.cell.source {
                Source::Discrete(_) => format!("{} pass {}", output.estimator, output.pass),
                Source::Continuous(_) => output.label(),
            };
            text.line(format_args!("  {}: {status}", visible(name)));
            for &figure in Measure::ALL {
                if !row[figure].is_nan() {
                    text.line(format_args!("    {:<20} {:>24?}", figure.name(), row[figure]));
                }
            }
        }
        let equal = match self.stored {
            Err(_) => "Not compared: the stored trials cannot be read in",
            Ok(None) => {
                "Not compared: no rows of this trial (those of the run's own trials are kept by store = \"trials\") in"
            }
            Ok(Some(true)) => "These rows equal, bit for bit, those stored in",
            Ok(Some(false)) => "These rows DIFFER from those stored in",
        };
        let line = format!("{equal} {}.", visible(folder.display()));
        text.line("");
        text.paragraph(&line, "");
        if let (Ok(Some(false)), Some(method)) = (&self.stored, &self.may_differ) {
            let line = format!("Those of '{method}' may: it says that it is not deterministic.");
            text.line(visible(line));
        }
        for (title, vectors) in &self.stages {
            text.line(format_args!("\n{}", visible(title)));
            for (name, values) in vectors {
                text.line(format_args!("  {name}"));
                let is_whole = options.samples || values.len() <= LONG;
                let shown = if is_whole { values.len() } else { IN_LINE };
                for line in values[..shown].chunks(IN_LINE) {
                    let line: Vec<String> = line.iter().map(|v| format!("{v:>24?}")).collect();
                    text.line(format_args!("  {}", line.join(" ")));
                }
                if !is_whole {
                    let more = values.len() - shown;
                    text.line(format_args!("  ... {more} more; --samples prints them"));
                }
            }
        }
        text.0
    }

    fn json(&self) -> Value {
        let stage = |(title, vectors): &Stage| {
            let mut stage = json!({ "stage": title });
            for (name, values) in vectors {
                stage[name] = json!(values);
            }
            stage
        };
        let mut cell = json!({ "index": self.index, "claim": self.cell.claim });
        if let Some(of) = self.cell.discrete() {
            cell["eta"] = json!(of.eta);
            cell["window"] = json!(of.window);
            cell["horizon"] = json!(of.horizon);
        }
        cell["settings"] = json!(self.cell.settings);
        json!({
            "cell": cell,
            "trial": self.trial,
            "seed": self.seed,
            "stages": self.stages.iter().map(stage).collect::<Vec<Value>>(),
            "rows": self.rows.iter().map(|(output, row)| self.row_json(output, row)).collect::<Vec<Value>>(),
            "equal_to_stored": self.stored.as_ref().ok().copied().flatten(),
        })
    }

    fn row_json(&self, output: &Output, row: &Row) -> Value {
        let mut entry = json!({
            "estimator": output.estimator,
            "pass": output.pass,
            "status": row.status(),
            "unstable": row.unstable,
            "unstable_so_far": row.unstable_so_far,
        });
        let kind = self.cell.kind();
        for &figure in Measure::ALL.iter().filter(|of| of.is_of(kind)) {
            entry[figure.name()] = json!(row[figure]);
        }
        entry
    }
}

/// Returns stages 7 and 2 or 9 of a pass, if it got so far. Omitted for a reflected auxiliary model, which is not kept.
fn information(table: &MethodTable, window: Window<'_>, passes: &[Pass], number: usize, name: &str) -> Vec<Stage> {
    let order = passes[number].a.len();
    let mut information = Information::new(order);
    information.least_squares(window);
    let stage = |first: usize, information: &Information| {
        let title = format!("Stage {first}, {name}: information blocks, G by columns");
        (title, blocks(information))
    };
    if number == 0 {
        return vec![stage(2, &information)];
    }
    let (Some(options), previous) = (table.iv_options(), &passes[number - 1]) else {
        return Vec::new();
    };
    let known = previous.progress == Progress::InitialState;
    if !known || options.stabilise != Stabilise::None {
        return Vec::new();
    }
    let source = match options.auxiliary {
        Auxiliary::Refresh => previous,
        Auxiliary::Frozen | Auxiliary::Literal => &passes[0],
    };
    let input = match options.instruments {
        InstrumentSource::Input => None,
        InstrumentSource::Reference => Some(window.r),
    };
    let mut model = AuxiliaryModel::new(order, window.len(), options.drive, options.gain);
    let driver = input.unwrap_or(window.u);
    if model
        .run_driven(&previous.a, &source.b, &source.x0, window, driver, 0)
        .is_err()
    {
        return Vec::new();
    }
    let output = &model.yhat;
    information.instruments(window, Instruments { output, input });
    let yhat = vec![("yhat".to_owned(), output.clone())];
    let auxiliary = (format!("Stage 7, {name}: auxiliary model"), yhat);
    vec![auxiliary, stage(9, &information)]
}

fn blocks(information: &Information) -> Vec<(String, Vec<f64>)> {
    let g = information.matrix();
    let columns = (0..g.ncols()).flat_map(|j| (0..g.nrows()).map(move |i| g[(i, j)]));
    vec![
        ("G".to_owned(), columns.collect()),
        ("Z'y".to_owned(), information.rhs().to_vec()),
    ]
}

/// Returns stages 3 or 10, 4, 5 and 6 of a pass, as far as it got.
fn parameters(name: &str, solve: usize, pass: &Pass) -> Vec<Stage> {
    let mut stages = Vec::new();
    if pass.progress >= Progress::Parameters {
        let alpha = pass.a.iter().rev().map(|a| -a);
        let vectors = vec![
            ("p".to_owned(), alpha.chain(pass.h.iter().copied()).collect()),
            ("a".to_owned(), pass.a.clone()),
            ("h".to_owned(), pass.h.clone()),
            ("b".to_owned(), pass.b.clone()),
        ];
        stages.push((format!("Stages {solve}, 4 and 5, {name}: parameters"), vectors));
    }
    if pass.progress >= Progress::InitialState {
        let vectors = vec![("x0".to_owned(), pass.x0.clone())];
        stages.push((format!("Stage 6, {name}: initial state"), vectors));
    }
    if let Some(failure) = pass.failure {
        stages.push((format!("{name} failed: {failure}"), Vec::new()));
    }
    stages
}

/// Returns stage 12 of a pass.
fn observer(name: &str, cell: &DiscreteCell, method: &Method, data: &Realisation, pass: &Pass) -> Option<Stage> {
    let (mut at_window, mut last) = (Vec::new(), Vec::new());
    let used = stage_twelve(cell, method, pass, (&data.u, &data.y), |k, x| {
        if k == cell.window {
            at_window = x.to_vec();
        }
        last = x.to_vec();
    })?;
    let named = |(name, values): (&str, Vec<f64>)| (name.to_owned(), values);
    let mut vectors: Vec<(String, Vec<f64>)> = used.into_iter().map(named).collect();
    vectors.push(named(("xhat(N)", at_window)));
    vectors.push(named(("xhat(K-1)", last)));
    let kind = method
        .observer()
        .map_or_else(|| cell.gain.to_string(), ToString::to_string);
    Some((format!("Stage 12, {name}: observer {kind}"), vectors))
}
