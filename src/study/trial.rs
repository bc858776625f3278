//! One trial: draw a record, run every method on it, measure every pass.

use super::row::{Figure, Row};
use super::{Cell, Curves, Experiment};
use crate::data::Realisation;
use crate::estimator::{
    Estimator, Failure, FailureKind, Output, Pass, Progress, SetupError, Stage, Window,
};
use crate::metric::{StateError, relative_error, relative_error_as_printed};
use crate::observer::{ObservedModel, Observer};
use crate::plant::PoleFinder;

/// Buffers to run trials of one cell: one value per worker.
pub struct Trial<'e> {
    experiment: &'e Experiment,
    cell: &'e Cell,
    outputs: Vec<Output>,
    realisation: Realisation,
    methods: Vec<Worker>,
    scorer: Scorer,
    rows: Vec<Row>,
}

/// A method's estimator and its passes.
struct Worker {
    estimator: Box<dyn Estimator>,
    passes: Vec<Pass>,
}

/// Everything that one trial computed, for a replay.
pub struct TrialRecord<'a> {
    /// The record and its truth.
    pub realisation: &'a Realisation,
    /// The passes of every output, in order.
    pub passes: Vec<(&'a Output, &'a Pass)>,
    /// The rows as they are stored.
    pub rows: &'a [Row],
}

impl<'e> Trial<'e> {
    /// Buffers for a cell of a valid experiment.
    ///
    /// # Errors
    /// If a method cannot serve the cell.
    pub fn new(experiment: &'e Experiment, cell: &'e Cell) -> Result<Self, SetupError> {
        let order = experiment.process.order();
        let mut methods = Vec::new();
        for method in &experiment.methods {
            methods.push(Worker {
                estimator: method.prepare(experiment.shape(cell))?,
                passes: vec![Pass::new(order); method.outputs().len()],
            });
        }
        Ok(Self {
            experiment,
            cell,
            outputs: experiment.outputs(),
            realisation: Realisation::default(),
            methods,
            scorer: Scorer::new(experiment, cell),
            rows: Vec::new(),
        })
    }

    /// Runs a trial: its rows, one per output. `curves` gathers e_x(k) of the first and last output.
    pub fn run(&mut self, trial: u64, mut curves: Option<&mut Curves>) -> &[Row] {
        let (experiment, cell) = (self.experiment, self.cell);
        let record = &mut self.realisation;
        let (process, seed) = (&experiment.process, experiment.seed);
        process.realise(seed, trial, cell.eta, cell.window, cell.horizon, record);
        let window = Window::with_reference(&record.u, &record.y, &record.r, cell.window);
        self.rows.clear();
        for Worker { estimator, passes } in &mut self.methods {
            passes.iter_mut().for_each(Pass::clear);
            match record.failure {
                Some(failure) => passes.iter_mut().for_each(|pass| pass.fail(failure.into())),
                None => estimator.estimate(window, passes),
            }
            for pass in passes {
                let output = self.rows.len();
                let mut row = Row::new(trial, output);
                self.scorer
                    .score(self.outputs[output].pass, pass, record, &mut row);
                self.rows.push(row);
                if let Some(curves) = curves.as_deref_mut() {
                    if output == 0 {
                        curves.add(false, &self.scorer.curve);
                    }
                    if output + 1 == self.outputs.len() {
                        curves.add(true, &self.scorer.curve);
                    }
                }
            }
        }
        &self.rows
    }

    /// What the last [`Self::run`] computed.
    pub fn record(&self) -> TrialRecord<'_> {
        let passes = self.methods.iter().flat_map(|method| &method.passes);
        TrialRecord {
            realisation: &self.realisation,
            passes: self.outputs.iter().zip(passes).collect(),
            rows: &self.rows,
        }
    }
}

/// Measures passes against the truth.
struct Scorer {
    window: usize,
    observer: Observer,
    poles: PoleFinder,
    /// e_x(k), k = 0 ... K-1, of the pass that was measured last; NaN where undefined.
    curve: Vec<f64>,
}

impl Scorer {
    fn new(experiment: &Experiment, cell: &Cell) -> Self {
        let n = experiment.process.order();
        Self {
            window: cell.window,
            observer: Observer::new(experiment.gain.clone(), n),
            poles: PoleFinder::new(n),
            curve: vec![f64::NAN; cell.horizon],
        }
    }

    /// Fills the row of a pass, whose number is for its failures.
    fn score(&mut self, number: usize, pass: &Pass, record: &Realisation, row: &mut Row) {
        row.failure = pass.failure;
        let truth = &record.truth;
        row[Figure::Condition] = pass.condition;
        self.curve.fill(f64::NAN);
        if pass.progress >= Progress::Parameters {
            row.unstable = Some(pass.unstable);
            row[Figure::SpectralRadius] = self.poles.spectral_radius(&pass.a);
            for (truth, found, relative, printed) in [
                (&truth.a, &pass.a, Figure::Ea, Figure::EaPrinted),
                (&truth.b, &pass.b, Figure::Eb, Figure::EbPrinted),
                (&truth.h, &pass.h, Figure::Eh, Figure::EhPrinted),
            ] {
                row[relative] = relative_error(truth, found);
                row[printed] = relative_error_as_printed(truth, found);
            }
        }
        if let Some(model) = pass.observed() {
            row[Figure::Ex0] = relative_error(&truth.x0, &pass.x0);
            row[Figure::Ex0Printed] = relative_error_as_printed(&truth.x0, &pass.x0);
            if let Err(kind) = self.observe(model, record, row) {
                self.curve.fill(f64::NAN);
                row.failure = Some(Failure {
                    kind,
                    stage: Stage::Observer,
                    pass: number,
                });
            }
        }
    }

    /// Stage 12: the observer from k = 0 to K, and its errors from k = N on.
    fn observe(
        &mut self,
        model: ObservedModel<'_>,
        record: &Realisation,
        row: &mut Row,
    ) -> Result<(), FailureKind> {
        let n = model.a.len();
        let mut errors = StateError::default();
        let (window, curve, states) = (self.window, &mut self.curve, &record.states);
        self.observer.run(
            model,
            &record.u,
            &record.y,
            #[inline(always)]
            |k, x_hat| {
                let x = &states[k * n..(k + 1) * n];
                let square = if k < window {
                    StateError::default().add(x, x_hat)
                } else {
                    errors.add(x, x_hat)
                };
                curve[k] = square.sqrt();
            },
        )?;
        let figures = [
            (Figure::ExMax, errors.maximum()),
            (Figure::ExRms, errors.rms()),
            (Figure::ExMaxPrinted, errors.maximum_as_printed()),
            (Figure::ExRmsPrinted, errors.rms_as_printed()),
        ];
        if figures.iter().any(|(_, value)| value.is_infinite()) {
            return Err(FailureKind::NonFinite);
        }
        for (figure, value) in figures {
            row[figure] = value;
        }
        Ok(())
    }
}
