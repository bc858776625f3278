//! Errors of a method after several numbers of samples, `[course]`.

use crate::design::file::CourseTable;
use crate::design::{CellObserver, DiscreteCell, Experiment, Measure};
use crate::outcome::coefficients::COURSES;
use crate::outcome::row::Row;
use asobench_identification::data::Realisation;
use asobench_identification::estimator::{Estimator, Pass, Progress, SetupError, Window};
use asobench_identification::metric::{StateError, relative_error};
use asobench_identification::observer::{Gain, ObservedModel, ObserverKind};

/// The measures of each error: its root mean square, and when it stays below the bound.
const MEASURES: [[Measure; 2]; COURSES.len()] = [
    [Measure::CourseEa, Measure::SettledA],
    [Measure::CourseEb, Measure::SettledB],
    [Measure::CourseEx, Measure::SettledX],
];

/// Runs the methods of one cell along a record, with its own buffers.
pub(crate) struct Courses<'e> {
    table: &'e CourseTable,
    points: &'e [usize],
    /// For each method that does not run along a record: an estimator for every point, `None` where there are too few
    /// samples.
    anew: Vec<Vec<Option<Box<dyn Estimator>>>>,
    scorers: Vec<Scorer>,
    /// For each method, the pass that it fills along a record.
    passes: Vec<Pass>,
}

/// The errors of the outputs of one method.
struct Scorer {
    observer: CellObserver,
    /// How many of the last samples determine the observer's state; `None`: all.
    memory: Option<usize>,
    a: Vec<f64>,
    b: Vec<f64>,
    zero: Vec<f64>,
    points: usize,
    /// Three courses for each output, one after the other.
    values: Vec<f64>,
    /// a and b of every point, for a replay; empty if not wanted.
    kept: Option<Vec<Vec<f64>>>,
}

impl<'e> Courses<'e> {
    /// Makes buffers for a cell; `None` if the experiment has no `[course]`.
    ///
    /// # Errors
    /// If an observer cannot serve the cell.
    pub(crate) fn new(experiment: &'e Experiment, cell: &'e DiscreteCell) -> Result<Option<Self>, SetupError> {
        let Some(table) = &experiment.file.course else {
            return Ok(None);
        };
        let (points, order) = (table.points(cell.window), cell.plant_order());
        let (mut anew, mut scorers) = (Vec::new(), Vec::new());
        let passes = vec![Pass::new(cell.order); experiment.methods.len()];
        for method in &experiment.methods {
            // A window that is too short has no model yet.
            let estimator = |k: &usize| cell.prepare_for(*k, method, false).ok();
            anew.push(if method.runs_along() {
                Vec::new()
            } else {
                points.iter().map(estimator).collect()
            });
            let of_method = method.order(cell.order);
            let gain = match method.observer() {
                Some(ObserverKind::Luenberger(gain)) => gain,
                _ => &cell.gain,
            };
            let outputs = method.reported().len();
            scorers.push(Scorer {
                observer: CellObserver::new(cell, method)?,
                memory: (*gain == Gain::DeadBeat).then_some(of_method),
                a: vec![0.0; order],
                b: vec![0.0; order],
                zero: vec![0.0; of_method],
                points: points.len(),
                values: vec![f64::NAN; outputs * COURSES.len() * points.len()],
                kept: None,
            });
        }
        Ok(Some(Self {
            table,
            points,
            anew,
            scorers,
            passes,
        }))
    }

    /// Runs a method along a record. `estimator` is that of the whole window, and `passes` its passes, which are used
    /// up for methods that are run anew.
    pub(crate) fn run(
        &mut self,
        method: usize,
        estimator: &mut dyn Estimator,
        passes: &mut [Pass],
        reported: &[usize],
        record: &Realisation,
    ) {
        let scorer = &mut self.scorers[method];
        scorer.values.fill(f64::NAN);
        if let Some(kept) = &mut scorer.kept {
            kept.clear();
        }
        if record.failure.is_some() {
            return;
        }
        let window = |k: usize| Window::with_reference(&record.u, &record.y, &record.r, k);
        let anew = &mut self.anew[method];
        if anew.is_empty() {
            let whole = window(self.points.last().copied().unwrap_or(0));
            let mut index = 0;
            let points = self.points;
            let pass = &mut self.passes[method];
            estimator.run_along(whole, points, pass, &mut |k, pass, state| {
                scorer.note((0, index, k), pass, state, record);
                index += 1;
            });
            return;
        }
        for (index, (k, estimator)) in self.points.iter().zip(anew).enumerate() {
            let Some(estimator) = estimator else {
                continue;
            };
            passes.iter_mut().for_each(Pass::clear);
            estimator.estimate(window(*k), passes);
            for (output, number) in reported.iter().enumerate() {
                scorer.note((output, index, *k), &passes[*number], None, record);
            }
        }
    }

    /// Sets the measures of an output of the method run last, and returns its columns.
    pub(crate) fn fill(&self, method: usize, output: usize, row: &mut Row) -> &[f64] {
        let width = COURSES.len() * self.points.len();
        let columns = &self.scorers[method].values[output * width..][..width];
        let from = self.table.from;
        let first = self.points.partition_point(|k| *k < from);
        let courses = columns.chunks_exact(self.points.len());
        for ([rms, settled], course) in MEASURES.into_iter().zip(courses) {
            let counted = &course[first..];
            let squares: f64 = counted.iter().map(|error| error * error).sum();
            let mean = (squares / counted.len() as f64).sqrt();
            row[rms] = if mean.is_finite() { mean } else { f64::NAN };
            // NaN is not below the bound.
            let above = counted.iter().rposition(|error| !(*error < self.table.bound));
            let at = self.points.get(first + above.map_or(0, |last| last + 1));
            row[settled] = at.map_or(f64::NAN, |k| (k - from) as f64);
        }
        columns
    }

    /// From the next run on keeps a and b of every point, for [`Self::kept`].
    pub(crate) fn keep(&mut self) {
        for scorer in &mut self.scorers {
            scorer.kept = Some(Vec::new());
        }
    }

    /// Returns the points, and for each of them (and of each output of the method) a and b found there; nothing where
    /// there was no model.
    pub(crate) fn kept(&self, method: usize) -> (&[usize], &[Vec<f64>]) {
        let kept = self.scorers[method].kept.as_deref();
        (self.points, kept.unwrap_or_default())
    }
}

impl Scorer {
    /// Takes the errors of an output after the first k samples, which is the point of this index.
    fn note(
        &mut self,
        (output, index, k): (usize, usize, usize),
        pass: &Pass,
        state: Option<&[f64]>,
        record: &Realisation,
    ) {
        let n = self.a.len();
        let known = pass.progress >= Progress::Parameters && pass.a.len() == n;
        if let Some(kept) = &mut self.kept {
            let model = known.then(|| [&pass.a[..], &pass.b].concat());
            kept.push(model.unwrap_or_default());
        }
        if !known {
            return;
        }
        record.plants.at(k - 1, &mut self.a, &mut self.b);
        let errors = [
            relative_error(&self.a, &pass.a),
            relative_error(&self.b, &pass.b),
            self.state_error(k, pass, state, record).unwrap_or(f64::NAN),
        ];
        let from = output * COURSES.len() * self.points;
        for (course, error) in errors.into_iter().enumerate() {
            let finite = if error.is_finite() { error } else { f64::NAN };
            self.values[from + course * self.points + index] = finite;
        }
    }

    /// Returns e_x(k) of the method's own state, or of the observer with the present model, from zero at k = 0.
    fn state_error(&mut self, k: usize, pass: &Pass, state: Option<&[f64]>, record: &Realisation) -> Option<f64> {
        let n = self.a.len();
        let x = record.states.get(k * n..(k + 1) * n)?;
        let error = |x_hat: &[f64]| StateError::default().add(x, x_hat).sqrt();
        if let Some(state) = state {
            return Some(error(state));
        }
        if pass.direct != 0.0 || self.zero.len() != n {
            return None;
        }
        let model = ObservedModel {
            a: &pass.a,
            b: &pass.b,
            x0: &self.zero,
        };
        let from = self.memory.map_or(0, |memory| k.saturating_sub(memory));
        let (u, y) = (record.u.get(from..=k)?, record.y.get(from..=k)?);
        let mut found = None;
        let ran = self.observer.run(pass, model, u, y, |i, x_hat, _| {
            if from + i == k {
                found = Some(error(x_hat));
            }
        });
        ran.ok()?;
        found
    }
}
