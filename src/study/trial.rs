//! One trial: draw a record, run every method on it, measure every pass.

use super::measure::Measure;
use super::row::Row;
use super::score::{self, Scorer};
use super::tally::Trials;
use super::{Cell, Experiment};
use crate::data::{Process, Realisation};
use crate::estimator::{Estimator, Output, Pass, Progress, SetupError, Window};
use crate::metric::relative_error;

/// Buffers to run trials of one cell: one value per worker.
pub struct Trial<'e> {
    experiment: &'e Experiment,
    cell: &'e Cell,
    process: &'e Process,
    outputs: Vec<Output>,
    realisation: Realisation,
    methods: Vec<MethodRun<'e>>,
    scorer: Scorer,
    /// What [`Self::run`] computed last.
    last: Trials,
}

/// A method's estimator and its passes.
struct MethodRun<'e> {
    estimator: Box<dyn Estimator>,
    passes: Vec<Pass>,
    /// The passes that are reported.
    reported: &'e [usize],
}

/// Everything that one trial computed, for a replay.
pub struct TrialRecord<'a> {
    /// The record and its truth.
    pub realisation: &'a Realisation,
    /// The passes of every output, in order.
    pub passes: Vec<(&'a Output, &'a Pass)>,
    /// All passes of every method, reported or not.
    pub methods: Vec<&'a [Pass]>,
    /// The rows as they are stored.
    pub rows: &'a [Row],
}

impl<'e> Trial<'e> {
    /// Buffers for a cell of an experiment.
    ///
    /// # Errors
    /// If a method cannot serve the cell, or it is in continuous time.
    pub fn new(experiment: &'e Experiment, cell: &'e Cell) -> Result<Self, SetupError> {
        let process = cell.process().ok_or(SetupError::ContinuousTime)?;
        let mut methods = Vec::new();
        for method in &experiment.methods {
            methods.push(MethodRun {
                estimator: cell.prepare(method)?,
                passes: vec![Pass::new(cell.order); method.passes()],
                reported: method.reported(),
            });
        }
        Ok(Self {
            experiment,
            cell,
            process,
            outputs: experiment.outputs(),
            realisation: Realisation::default(),
            methods,
            scorer: Scorer::new(experiment, cell, process)?,
            last: Trials::default(),
        })
    }

    /// Runs a trial: its rows, one per output.
    pub fn run(&mut self, trial: u64) -> &[Row] {
        let mut last = std::mem::take(&mut self.last);
        last.rows.clear();
        last.parameters.clear();
        self.run_into(trial, &mut last);
        self.last = last;
        &self.last.rows
    }

    /// Runs a trial and appends what is wanted of it.
    pub fn run_into(&mut self, trial: u64, to: &mut Trials) {
        let (file, cell) = (&self.experiment.file, self.cell);
        let record = &mut self.realisation;
        self.process.realise(
            file.seed,
            trial,
            cell.eta,
            cell.window,
            cell.horizon,
            record,
        );
        self.scorer.begin(file.seed, trial, record);
        let window = Window::with_reference(&record.u, &record.y, &record.r, cell.window);
        let mut output = 0;
        for (method, run) in self.methods.iter_mut().enumerate() {
            let MethodRun {
                estimator,
                passes,
                reported,
            } = run;
            passes.iter_mut().for_each(Pass::clear);
            match record.failure {
                None => estimator.estimate(window, passes),
                Some(failure) => passes.iter_mut().for_each(|pass| pass.fail(failure.into())),
            }
            for &number in *reported {
                let pass = &passes[number];
                let mut row = Row::new(trial, output);
                row.unstable_so_far = passes[..=number].iter().any(|pass| pass.unstable);
                if let Some(before) = number.checked_sub(1) {
                    row[Measure::Change] = change(&passes[before], pass);
                }
                let pass_number = self.outputs[output].pass;
                self.scorer
                    .score(method, pass_number, pass, record, &mut row);
                to.rows.push(row);
                if file.parameters {
                    score::append_parameter_errors(pass, record, &mut to.parameters);
                }
                if let Some(curves) = &mut to.curves {
                    if output == 0 {
                        curves.add(false, self.scorer.curve().iter().copied());
                    }
                    if output + 1 == self.outputs.len() {
                        curves.add(true, self.scorer.curve().iter().copied());
                    }
                }
                output += 1;
            }
        }
    }

    /// What the last [`Self::run`] computed.
    pub fn record(&self) -> TrialRecord<'_> {
        let passes = self
            .methods
            .iter()
            .flat_map(|method| method.reported.iter().map(|number| &method.passes[*number]));
        TrialRecord {
            realisation: &self.realisation,
            passes: self.outputs.iter().zip(passes).collect(),
            methods: self
                .methods
                .iter()
                .map(|method| &method.passes[..])
                .collect(),
            rows: &self.last.rows,
        }
    }
}

/// `|| a - a_before || / || a_before ||`; NaN where one of them is not known.
fn change(before: &Pass, pass: &Pass) -> f64 {
    if before.progress.min(pass.progress) >= Progress::Parameters {
        relative_error(&before.a, &pass.a)
    } else {
        f64::NAN
    }
}
