//! `asobench reproduce --replay CELL:TRIAL`: every stage of one trial.

use super::error::{Error, failed};
use super::files::write_whole;
use super::reproduce::Arguments;
use super::{Format, note, print};
use crate::data::csv;
use crate::estimator::auxiliary::AuxiliaryModel;
use crate::estimator::information::Information;
use crate::estimator::{Instruments, IvOptions, Pass, Progress, Window};
use crate::observer::Observer;
use crate::study::{
    Cell, Experiment, Figure, Row, Trial, TrialRecord, read_manifest, stored_alike,
};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

/// A cell, by its claim or its number, and a trial.
#[derive(Clone, Debug)]
pub(super) struct Which {
    cell: String,
    trial: u64,
}

impl std::str::FromStr for Which {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once(':').and_then(|(cell, trial)| {
            let trial = trial.parse().ok()?;
            let cell = cell.to_owned();
            Some(Self { cell, trial })
        });
        parts.ok_or_else(|| "expected CELL:TRIAL, such as C2:17".to_owned())
    }
}

impl Which {
    fn cell(&self, experiment: &Experiment) -> Result<usize, Error> {
        let cells = &experiment.cells;
        let by_claim = cells
            .iter()
            .position(|cell| cell.claim.eq_ignore_ascii_case(&self.cell));
        let by_number = || {
            self.cell
                .parse()
                .ok()
                .filter(|number| *number < cells.len())
        };
        by_claim.or_else(by_number).ok_or_else(|| {
            let claims: Vec<&str> = cells.iter().map(|cell| cell.claim.as_str()).collect();
            Error::Input(format!(
                "--replay: no cell '{}'; expected {} or 0 to {}",
                self.cell,
                claims.join(", "),
                cells.len() - 1
            ))
        })
    }
}

pub(super) fn run(
    arguments: &Arguments,
    experiment: &Experiment,
    which: &Which,
) -> Result<ExitCode, Error> {
    let index = which.cell(experiment)?;
    let cell = &experiment.cells[index];
    let mut trial = Trial::new(experiment, cell).map_err(failed)?;
    trial.run(which.trial, None);
    let record = trial.record();
    if let Some(path) = &arguments.data {
        let comments = comments(experiment, cell, &record, which.trial);
        let data = record.realisation;
        write_whole("--data", path, None, |to| {
            csv::write(to, &comments, &data.u, &data.y)
        })?;
        note(&format!("wrote {}", path.display()));
    }
    let stored = stored(arguments, experiment, index, &record);
    let mut replay = Replay::new(experiment, index, which.trial, &record);
    replay.stored = stored;
    match arguments.format {
        Format::Text => print(&replay.text(arguments.folder())?)?,
        Format::Json => {
            let text = serde_json::to_string_pretty(&replay.json()).map_err(failed)?;
            print(&format!("{text}\n"))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The truth, as comment lines of a CSV file.
fn comments(
    experiment: &Experiment,
    cell: &Cell,
    record: &TrialRecord<'_>,
    trial: u64,
) -> Vec<String> {
    let truth = &record.realisation.truth;
    vec![
        format!(
            "asobench reproduce --seed {} --replay {}:{trial}",
            experiment.seed, cell.claim
        ),
        format!(
            "order: {}; window: {}; eta: {} %",
            truth.a.len(),
            cell.window,
            cell.eta
        ),
        format!("true a: {:?}", truth.a),
        format!("true b: {:?}", truth.b),
        format!("true h: {:?}", truth.h),
        format!("true x0: {:?}", truth.x0),
    ]
}

/// Whether the rows stood bit for bit in the results' folder; `None` where it holds no such trial of this
/// experiment.
fn stored(
    arguments: &Arguments,
    experiment: &Experiment,
    cell: usize,
    record: &TrialRecord<'_>,
) -> Option<bool> {
    let folder = arguments.folder();
    // Whatever else is in the folder is no concern of a replay.
    let manifest = read_manifest(folder).ok()??;
    if manifest["experiment"] != experiment.describe() {
        return None;
    }
    let trials = manifest["trials"].as_u64().unwrap_or(0);
    let file = folder.join("trials.parquet");
    stored_alike(&file, experiment, cell, trials, record.rows).unwrap_or_else(|error| {
        note(&format!("warning: the stored rows cannot be read: {error}"));
        None
    })
}

/// One stage's vectors under their names.
type Stage = (String, Vec<(String, Vec<f64>)>);

/// All that one trial computed, by stage.
struct Replay<'a> {
    cell: &'a Cell,
    trial: u64,
    seed: u64,
    /// Whether the rows equal the stored ones; unknown at first.
    stored: Option<bool>,
    stages: Vec<Stage>,
    rows: Vec<(String, &'a Row)>,
}

impl<'a> Replay<'a> {
    fn new(experiment: &'a Experiment, index: usize, trial: u64, record: &TrialRecord<'a>) -> Self {
        let cell = &experiment.cells[index];
        let order = experiment.process.order();
        let data = record.realisation;
        let window = Window::new(&data.u, &data.y, cell.window);
        let mut stages = vec![(
            "Stage 1: data".to_owned(),
            vec![
                ("u".to_owned(), data.u.clone()),
                ("y".to_owned(), data.y.clone()),
                ("noise factor".to_owned(), vec![data.scale]),
            ],
        )];
        let mut information = Information::new(order);
        information.least_squares(window);
        // The experiment's readings are the defaults.
        let IvOptions { drive, gain, .. } = IvOptions::default();
        let mut model = AuxiliaryModel::new(order, cell.window, drive, gain);
        let mut previous: Option<&Pass> = None;
        for (output, pass) in &record.passes {
            let of = format!("{} pass {}", output.estimator, output.pass);
            let (first, solve) = if output.pass == 0 { (2, 3) } else { (9, 10) };
            if let Some(before) = previous
                && before.progress == Progress::InitialState
                && model.run(&before.a, &before.b, &before.x0, window).is_ok()
            {
                let yhat = vec![("yhat".to_owned(), model.yhat.clone())];
                stages.push((format!("Stage 7, {of}: auxiliary model"), yhat));
                information.instruments(window, Instruments::new(&model.yhat));
            }
            if previous.is_none_or(|before| before.progress == Progress::InitialState) {
                stages.push((
                    format!("Stage {first}, {of}: information blocks, G by columns"),
                    blocks(&information),
                ));
            }
            stages.extend(parameters(&of, solve, pass));
            stages.extend(observer(&of, experiment, cell, data, pass));
            previous = Some(pass);
        }
        let name = |row: &Row| {
            let (output, _) = &record.passes[row.output];
            format!("{} pass {}", output.estimator, output.pass)
        };
        Self {
            cell,
            trial,
            seed: experiment.seed,
            stored: None,
            stages,
            rows: record.rows.iter().map(|row| (name(row), row)).collect(),
        }
    }

    fn text(&self, folder: &Path) -> Result<String, Error> {
        let mut text = String::new();
        let Cell {
            claim,
            eta,
            window,
            horizon,
        } = self.cell;
        writeln!(
            text,
            "Cell {claim} (eta = {eta} %, N = {window}, K = {horizon}), trial {}, seed {}\n\
             p = (alpha, beta), A(q) = 1 + alpha_1 q^-1 + ..., a_i = -alpha_(n+1-i), h = beta",
            self.trial, self.seed
        )
        .map_err(failed)?;
        writeln!(text, "\nRows").map_err(failed)?;
        for (name, row) in &self.rows {
            let status = row
                .failure
                .map_or_else(|| "ok".to_owned(), |f| f.to_string());
            writeln!(text, "  {name}: {status}").map_err(failed)?;
            for &figure in Figure::ALL {
                if !row[figure].is_nan() {
                    writeln!(text, "    {:<20} {:>24?}", figure.name(), row[figure])
                        .map_err(failed)?;
                }
            }
        }
        let equal = match self.stored {
            None => "Not compared: no readable rows of this trial and experiment in",
            Some(true) => "These rows equal, bit for bit, those stored in",
            Some(false) => "These rows DIFFER from those stored in",
        };
        writeln!(text, "\n{equal} {}.", folder.display()).map_err(failed)?;
        for (title, vectors) in &self.stages {
            writeln!(text, "\n{title}").map_err(failed)?;
            for (name, values) in vectors {
                writeln!(text, "  {name}").map_err(failed)?;
                for line in values.chunks(3) {
                    let line: Vec<String> = line.iter().map(|v| format!("{v:>24?}")).collect();
                    writeln!(text, "  {}", line.join(" ")).map_err(failed)?;
                }
            }
        }
        Ok(text)
    }

    fn json(&self) -> Value {
        let stages: Vec<Value> = self
            .stages
            .iter()
            .map(|(title, vectors)| {
                let mut stage = Map::new();
                stage.insert("stage".to_owned(), json!(title));
                for (name, values) in vectors {
                    stage.insert(name.clone(), json!(values));
                }
                Value::Object(stage)
            })
            .collect();
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|(_, row)| self.row_json(row))
            .collect();
        json!({
            "cell": self.cell,
            "trial": self.trial,
            "seed": self.seed,
            "stages": stages,
            "rows": rows,
            "equal_to_stored": self.stored,
        })
    }

    fn row_json(&self, row: &Row) -> Value {
        let (name, _) = &self.rows[row.output];
        let (estimator, pass) = name.split_once(" pass ").unwrap_or((name, "0"));
        let mut object = Map::new();
        object.insert("estimator".to_owned(), json!(estimator));
        object.insert("pass".to_owned(), json!(pass.parse::<u64>().unwrap_or(0)));
        object.insert("status".to_owned(), json!(row.status()));
        object.insert("unstable".to_owned(), json!(row.unstable));
        for &figure in Figure::ALL {
            object.insert(figure.name().to_owned(), json!(row[figure]));
        }
        Value::Object(object)
    }
}

fn blocks(information: &Information) -> Vec<(String, Vec<f64>)> {
    let g = information.matrix();
    let columns = (0..g.ncols()).flat_map(|j| (0..g.nrows()).map(move |i| g[(i, j)]));
    vec![
        ("G".to_owned(), columns.collect()),
        ("Z'y".to_owned(), information.rhs().to_vec()),
    ]
}

/// Stages 3 or 10, 4, 5 and 6 of a pass, as far as it came.
fn parameters(of: &str, solve: usize, pass: &Pass) -> Vec<Stage> {
    let mut stages = Vec::new();
    if pass.progress >= Progress::Parameters {
        let alpha = pass.a.iter().rev().map(|a| -a);
        let vectors = vec![
            (
                "p".to_owned(),
                alpha.chain(pass.h.iter().copied()).collect(),
            ),
            ("a".to_owned(), pass.a.clone()),
            ("h".to_owned(), pass.h.clone()),
            ("b".to_owned(), pass.b.clone()),
        ];
        stages.push((
            format!("Stages {solve}, 4 and 5, {of}: parameters"),
            vectors,
        ));
    }
    if pass.progress >= Progress::InitialState {
        let vectors = vec![("x0".to_owned(), pass.x0.clone())];
        stages.push((format!("Stage 6, {of}: initial state"), vectors));
    }
    if let Some(failure) = pass.failure {
        stages.push((format!("{of} failed: {failure}"), Vec::new()));
    }
    stages
}

/// Stage 12 of a pass.
fn observer(
    of: &str,
    experiment: &Experiment,
    cell: &Cell,
    data: &crate::data::Realisation,
    pass: &Pass,
) -> Option<Stage> {
    let mut observer = Observer::new(experiment.gain.clone(), pass.a.len());
    let (mut at_window, mut last) = (Vec::new(), Vec::new());
    let run = observer.run(pass.observed()?, &data.u, &data.y, |k, x| {
        if k == cell.window {
            at_window = x.to_vec();
        }
        last = x.to_vec();
    });
    run.ok()?;
    let vectors = vec![
        ("g".to_owned(), observer.g().to_vec()),
        ("xhat(N)".to_owned(), at_window),
        ("xhat(K-1)".to_owned(), last),
    ];
    Some((format!("Stage 12, {of}: observer"), vectors))
}
