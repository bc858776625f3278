//! One trial: draw a record, run every method on it, measure every pass.

use crate::design::{CURVE_TRIALS, Cell, DiscreteCell, Experiment, Measure};
use crate::outcome::coefficients;
use crate::outcome::row::Row;
use crate::outcome::spent::{Spent, Watch};
use crate::outcome::trials::Trials;
use crate::run::course::Courses;
use crate::run::score::Scorer;
use crate::worker::seed_of;
use asobench_identification::data::Realisation;
use asobench_identification::estimator::{
    Estimator, Kinship, Method, Output, Pass, Progress, Records, SetupError, Window,
};
use asobench_identification::metric::relative_error;

/// Buffers to run trials of one cell; each worker has its own.
pub struct Trial<'e> {
    experiment: &'e Experiment,
    cell: &'e DiscreteCell,
    outputs: Vec<Output>,
    realisation: Realisation,
    /// Records of other trials, for methods that need them.
    others: Others<'e>,
    methods: Vec<MethodRun<'e>>,
    scorer: Scorer,
    courses: Option<Courses<'e>>,
    /// The rows of the last trial.
    rows: Vec<Row>,
    /// Room for the requested values of each coefficient of a row.
    parameters: Vec<f64>,
}

/// A method's estimator and its passes.
struct MethodRun<'e> {
    estimator: Box<dyn Estimator>,
    passes: Vec<Pass>,
    /// The passes that are reported.
    reported: &'e [usize],
    /// Whether the model is the true plant: not an estimate that may be unstable where the plant is not.
    known: bool,
    /// An earlier method whose passes need not be computed again, and what they have in common.
    kin: Option<(usize, Kinship)>,
}

impl MethodRun<'_> {
    /// Estimates a window, `before` having done so.
    fn estimate(&mut self, before: &mut [Self], window: Window<'_>) {
        let Self { estimator, passes, .. } = self;
        passes.iter_mut().for_each(Pass::clear);
        match self.kin {
            None => estimator.estimate(window, passes),
            Some((kin, Kinship::Same)) => {
                for (pass, found) in passes.iter_mut().zip(&before[kin].passes) {
                    pass.assign(found);
                }
            }
            Some((kin, common @ Kinship::Passes { .. })) => {
                estimator.estimate_from(common.of(&before[kin].passes), window, passes);
            }
            Some((kin, Kinship::Covariance(assumed))) => {
                let kin = &mut before[kin];
                let found = &kin.passes;
                if !(kin.estimator).estimate_again(assumed, window, found, passes) {
                    passes.iter_mut().for_each(Pass::clear);
                    estimator.estimate(window, passes);
                }
            }
        }
    }
}

/// Returns the earlier method with which one has most in common, if it saves work. Over a `[course]` an estimator sees
/// other windows between.
fn kin(experiment: &Experiment, before: &[MethodRun<'_>], method: &Method) -> Option<(usize, Kinship)> {
    let file = &experiment.file;
    if file.course.is_some() {
        return None;
    }
    let earlier = experiment.methods.iter().zip(before).enumerate();
    let found = earlier.filter_map(|(index, (earlier, run))| {
        let found = method.kinship(earlier, file.coverage)?;
        // Who did not estimate itself cannot do it again.
        let estimated = matches!(run.kin, None | Some((_, Kinship::Passes { .. })));
        (estimated || !matches!(found, Kinship::Covariance(_))).then_some((index, found))
    });
    found.max_by_key(|(index, found)| {
        let saved = match *found {
            Kinship::Same => usize::MAX,
            Kinship::Covariance(_) => usize::MAX - 1,
            Kinship::Passes { most, .. } => most,
        };
        (saved, usize::MAX - index)
    })
}

/// All that one trial computed, for a replay.
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

/// Draws records of other trials.
struct Others<'e> {
    seed: u64,
    cell: &'e DiscreteCell,
    realisation: Realisation,
}

impl Records for Others<'_> {
    fn draw(&mut self, trial: u64) -> Option<Window<'_>> {
        let (cell, record) = (self.cell, &mut self.realisation);
        let (eta, window) = (cell.eta, cell.window);
        // A shorter record has the same samples as the beginning of a longer one.
        cell.process.realise(self.seed, trial, eta, window, window, record);
        let drawn = record.failure.is_none();
        drawn.then(|| Window::with_reference(&record.u, &record.y, &record.r, window))
    }

    fn seed(&self, trial: u64) -> u64 {
        seed_of(self.seed, trial)
    }
}

impl<'e> Trial<'e> {
    /// Makes buffers for a cell of an experiment.
    ///
    /// # Errors
    /// If a method cannot serve the cell, or it is in continuous time.
    pub fn new(experiment: &'e Experiment, cell: &'e Cell) -> Result<Self, SetupError> {
        let cell = cell.discrete().ok_or(SetupError::ContinuousTime)?;
        let mut methods = Vec::new();
        for method in &experiment.methods {
            methods.push(MethodRun {
                estimator: cell.prepare(method, experiment.file.coverage)?,
                passes: vec![Pass::new(cell.order); method.passes()],
                reported: method.reported(),
                known: method.needs().plant,
                kin: kin(experiment, &methods, method),
            });
        }
        Ok(Self {
            experiment,
            cell,
            outputs: experiment.outputs(),
            realisation: Realisation::default(),
            others: Others {
                seed: experiment.file.seed,
                cell,
                realisation: Realisation::default(),
            },
            methods,
            scorer: Scorer::new(experiment, cell)?,
            courses: Courses::new(experiment, cell)?,
            rows: Vec::new(),
            parameters: Vec::new(),
        })
    }

    /// Runs a trial and returns its rows, one per output.
    ///
    /// # Errors
    /// [`SetupError::Program`].
    pub fn run(&mut self, trial: u64) -> Result<&[Row], SetupError> {
        self.measure(trial, |_, _, _, _| ())?;
        Ok(&self.rows)
    }

    /// Runs a trial and appends the requested results; nothing if there is an error.
    ///
    /// # Errors
    /// [`SetupError::Program`].
    pub fn run_into(&mut self, trial: u64, to: &mut Trials) -> Result<(), SetupError> {
        let (order, last) = (self.cell.order, self.outputs.len() - 1);
        let columns = coefficients::columns(&self.experiment.file, order);
        let mut parameters = std::mem::take(&mut self.parameters);
        let spent = self.measure(trial, |row, pass, record, [curve, course]| {
            parameters.clear();
            if columns > 0 {
                coefficients::append(columns, order, pass, record, &mut parameters);
            }
            parameters.extend_from_slice(course);
            to.rows.push(row, &parameters);
            if let Some(curves) = to.curves.as_mut().filter(|_| trial < CURVE_TRIALS) {
                for (is_last, output) in [(false, 0), (true, last)] {
                    if row.output == output {
                        curves.add(is_last, curve.iter().copied());
                    }
                }
            }
        });
        self.parameters = parameters;
        to.spent += spent?;
        Ok(())
    }

    /// Runs a trial. `on_row` receives each row with its pass, the record, e_x(k), and the errors over `[course]`.
    pub(crate) fn measure(
        &mut self,
        trial: u64,
        mut on_row: impl FnMut(&Row, &Pass, &Realisation, [&[f64]; 2]),
    ) -> Result<Spent, SetupError> {
        self.rows.clear();
        let (mut spent, mut watch) = (Spent::default(), Watch::start());
        for run in &mut self.methods {
            run.estimator.gather(trial, &mut self.others)?;
        }
        spent.estimation += watch.lap();
        let (file, cell) = (&self.experiment.file, self.cell);
        let record = &mut self.realisation;
        cell.realise(file.seed, trial, record);
        self.scorer.begin(file.seed, trial, record);
        let window = Window::with_reference(&record.u, &record.y, &record.r, cell.window);
        spent.simulation += watch.lap();
        let mut output = 0;
        for method in 0..self.methods.len() {
            let (before, rest) = self.methods.split_at_mut(method);
            let run = &mut rest[0];
            if let Some(courses) = &mut self.courses {
                let (estimator, passes) = (run.estimator.as_mut(), &mut run.passes);
                courses.run(method, estimator, passes, run.reported, record);
            }
            match record.failure {
                None => run.estimate(before, window),
                Some(failure) => {
                    for pass in &mut run.passes {
                        pass.clear();
                        pass.fail(failure.into());
                    }
                }
            }
            let MethodRun {
                passes,
                reported,
                known,
                ..
            } = run;
            spent.estimation += watch.lap();
            for (place, &number) in reported.iter().enumerate() {
                let pass = &passes[number];
                let mut row = Row::new(trial, output);
                row.unstable_so_far = passes[..=number].iter().any(|pass| pass.unstable);
                if let Some(before) = number.checked_sub(1) {
                    row[Measure::Change] = change(&passes[before], pass);
                }
                let pass_number = self.outputs[output].pass;
                self.scorer.score(method, pass_number, pass, record, &mut row);
                if *known {
                    row.unstable = row.unstable.map(|_| false);
                    row.unstable_so_far = false;
                }
                let courses = self.courses.as_ref();
                let course = courses.map_or(&[][..], |of| of.fill(method, place, &mut row));
                on_row(&row, pass, record, [self.scorer.curve(), course]);
                self.rows.push(row);
                output += 1;
            }
            spent.measures += watch.lap();
        }
        Ok(spent)
    }

    /// From the next run on keeps the models over `[course]`, for [`Self::course`].
    pub fn keep_courses(&mut self) {
        if let Some(courses) = &mut self.courses {
            courses.keep();
        }
    }

    /// Returns the points of `[course]`, and a and b that a method found there in the last run with
    /// [`Self::keep_courses`]: for each point one for each output, empty where there was none.
    pub fn course(&self, method: usize) -> (&[usize], &[Vec<f64>]) {
        let courses = self.courses.as_ref();
        courses.map_or((&[], &[]), |courses| courses.kept(method))
    }

    /// Returns all that the last [`Self::run`] computed.
    pub fn record(&self) -> TrialRecord<'_> {
        let passes = self
            .methods
            .iter()
            .flat_map(|method| method.reported.iter().map(|number| &method.passes[*number]));
        TrialRecord {
            realisation: &self.realisation,
            passes: self.outputs.iter().zip(passes).collect(),
            methods: self.methods.iter().map(|method| &method.passes[..]).collect(),
            rows: &self.rows,
        }
    }
}

/// Returns `|| a - a_before || / || a_before ||`; NaN if one of them is not known.
fn change(before: &Pass, pass: &Pass) -> f64 {
    if before.progress.min(pass.progress) >= Progress::Parameters {
        relative_error(&before.a, &pass.a)
    } else {
        f64::NAN
    }
}
