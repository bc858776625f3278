//! The experiment: its cells, each with a process, and its methods.

use super::build::Build;
use super::continuous_time::ContinuousCell;
use super::curves::Curves;
use super::engine::Engine;
use super::file::{
    Axis, ExperimentFile, FileError, Key, MethodTable, Settings, TrialRule, Until, at_most, cells,
};
use super::measure::Measure;
use super::names::{check_labels, check_names};
use super::observers::CellObserver;
use super::theory::Theories;
use crate::worker::{Program, Record, seed_of};
use asobench_identification::data::{Process, Realisation, Truth};
use asobench_identification::estimator::{
    Estimator, KnownModel, Method, Output, Problem, SetupError, Shape,
};
use asobench_identification::names::named_enum;
use asobench_identification::observer::Gain;
use asobench_identification::real::MOST_LANES;
use asobench_identification::signal::Input;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::OnceLock;
use xxhash_rust::xxh3::xxh3_128;

named_enum! {
    /// Where the observer starts.
    ObserverStart, "start of the observer" {
        /// From the estimate of x0 (the default).
        Estimate = "x0-hat",
        /// From zero.
        Zero = "zero",
    }
}

/// What a cell's trials are drawn from.
#[derive(Clone, Debug)]
pub enum Source {
    /// Records of a process in discrete time.
    Record(Box<Process>),
    /// Courses in continuous time.
    Continuous(Box<ContinuousCell>),
}

named_enum! {
    /// The sample from which errors of the state are taken.
    ScoredFrom, "start of the score" {
        /// From k = N on: after the window that the model was estimated from (the default).
        Window = "window",
        /// From k = 0 on, including the transients of filters that know the plant.
        Start = "start",
    }
}

/// One combination of settings under which trials are drawn.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The settings that it was made of.
    pub settings: Settings,
    /// What the trials are drawn from. In continuous time, of the fields below only the claim and the order are used;
    /// eta, window and horizon are 0.
    pub source: Source,
    /// The claim or case, such as "C2".
    pub claim: String,
    /// The noise level eta, per cent.
    pub eta: f64,
    /// The estimators' order n.
    pub order: usize,
    /// The window N, samples.
    pub window: usize,
    /// The record's length K, samples.
    pub horizon: usize,
    /// The observer's gain, stage 12.
    pub gain: Gain,
    /// Where the observer starts.
    pub observer_start: ObserverStart,
    /// The sample from which errors of the state are taken.
    pub scored_from: ScoredFrom,
}

impl Cell {
    /// Makes a cell in continuous time.
    pub(super) fn continuous(of: ContinuousCell, claim: String, settings: Settings) -> Self {
        Self {
            settings,
            claim,
            eta: 0.0,
            order: of.plant.order(),
            window: 0,
            horizon: 0,
            gain: Gain::default(),
            observer_start: ObserverStart::default(),
            scored_from: ScoredFrom::default(),
            source: Source::Continuous(Box::new(of)),
        }
    }

    /// Returns what draws records; `None` in continuous time.
    pub fn process(&self) -> Option<&Process> {
        match &self.source {
            Source::Record(process) => Some(process),
            Source::Continuous(_) => None,
        }
    }

    /// Whether nothing is random, so that all trials are identical.
    pub fn is_deterministic(&self) -> bool {
        match &self.source {
            Source::Record(process) => process.is_deterministic(self.eta),
            Source::Continuous(of) => of.is_deterministic(),
        }
    }

    /// The order of the plant.
    pub fn plant_order(&self) -> usize {
        self.process().map_or(self.order, Process::order)
    }

    /// The shape of the estimators' problem.
    pub fn shape(&self) -> Shape {
        Shape {
            order: self.order,
            window: self.window,
        }
    }

    /// Returns the first sample at which the error of the state is scored.
    pub fn first_scored(&self) -> usize {
        match self.scored_from {
            ScoredFrom::Window => self.window,
            ScoredFrom::Start => 0,
        }
    }

    /// Whether x(k) follows from the true plant, x(0) and the measured input: without noise of the process and of the
    /// input.
    pub fn follows_input(&self) -> bool {
        let settings = self.process().map(Process::settings);
        settings.is_some_and(|of| of.process_noise == 0.0 && of.input_noise == 0.0)
    }

    /// Returns the model that a method with the true plant receives: the plant, and the mean of its initial states.
    ///
    /// # Errors
    /// [`SetupError::NoKnownPlant`] unless all trials share one plant of the cell's order, in open loop;
    /// [`SetupError::ContinuousTime`] in continuous time.
    pub fn known_model(&self) -> Result<KnownModel, SetupError> {
        let process = self.process().ok_or(SetupError::ContinuousTime)?;
        let plant = process.open_loop().map(|(plant, ..)| plant);
        let plant = plant.filter(|plant| plant.order() == self.order);
        let plant = plant.ok_or(SetupError::NoKnownPlant)?;
        Ok(KnownModel::new(plant, &process.settings().x0))
    }

    /// Prepares a method's estimator for this cell. `covariance`: whether standard errors are wanted.
    ///
    /// # Errors
    /// If the method cannot serve the cell.
    pub fn prepare(
        &self,
        method: &Method,
        covariance: bool,
    ) -> Result<Box<dyn Estimator>, SetupError> {
        let known = if method.needs().plant {
            Some(self.known_model()?)
        } else {
            None
        };
        method.prepare(Problem {
            known: known.as_ref(),
            covariance,
            ..self.problem(self.window)
        })
    }

    /// Returns the problem that a method without knowledge of the plant is prepared for, with a window of this length.
    pub fn problem(&self, window: usize) -> Problem<'_> {
        Problem {
            shape: Shape {
                order: self.order,
                window,
            },
            known: None,
            process: self.process().map(|process| (process, self.eta)),
            covariance: false,
        }
    }

    /// Draws a trial of a process and returns the record that a program receives, with the true plant.
    pub fn record_for_program(
        &self,
        (process, eta): (&Process, f64),
        seed: u64,
        trial: u64,
    ) -> (Record, Truth) {
        let (mut drawn, window) = (Realisation::default(), self.window);
        process.realise(seed, trial, eta, window, self.horizon, &mut drawn);
        let cut = |signal: &[f64]| signal[..window].to_vec();
        let record = Record {
            trial,
            seed: seed_of(seed, trial),
            u: cut(&drawn.u),
            y: cut(&drawn.y),
            r: cut(&drawn.r),
        };
        (record, drawn.truth)
    }

    /// Returns the size in bytes of a record with its truth: u, y, r, u0, y0, f and n states for every sample.
    pub fn record_bytes(&self) -> usize {
        size_of::<f64>() * (6 + self.plant_order()) * self.horizon
    }
}

/// A Monte-Carlo experiment. A trial is a pure function of the experiment, a cell and a trial index.
pub struct Experiment {
    /// The file from which the experiment was made, with every default written out.
    pub file: ExperimentFile,
    /// The cells. Their trials use common random numbers.
    pub cells: Vec<Cell>,
    /// The methods, compared on the same records. None in continuous time, where observers are compared.
    pub methods: Vec<Method>,
    /// Those methods of the file that are external programs, in the order of the file.
    pub programs: Vec<Arc<Program>>,
    /// Pairs of outputs that are compared, as indices in [`Self::outputs`].
    pub compare: Vec<[usize; 2]>,
    /// Theoretical values of the cells, computed on demand.
    pub(super) theories: OnceLock<Theories>,
}

/// The largest number of outputs over all methods, counting passes.
const OUTPUT_LIMIT: usize = 10_000;

/// The experiment file of Nikolov et al. (2023), claims C1 to C3.
pub const NIKOLOV2023: &str = include_str!("../../../../experiments/nikolov2023.toml");

/// The experiment files of Bobtsov et al. (2023) that `asobench reproduce` runs, the example first. Each comes with the
/// number of trials that decides its claims.
pub const BOBTSOV2023: [(&str, &str, u64); 3] = [
    (
        "gpebo-figures",
        include_str!("../../../../experiments/gpebo-figures.toml"),
        1,
    ),
    (
        "gpebo-noise",
        include_str!("../../../../experiments/gpebo-noise.toml"),
        100,
    ),
    (
        "gpebo-amplitude",
        include_str!("../../../../experiments/gpebo-amplitude.toml"),
        60,
    ),
];

impl Experiment {
    /// Resolves a file and checks every cell with every method.
    ///
    /// # Errors
    /// The first fault that is found.
    pub fn new(file: ExperimentFile) -> Result<Self, FileError> {
        if let Some(fault) = file
            .quick
            .as_ref()
            .and_then(|quick| TrialRule::Fixed(quick.trials).fault())
        {
            return Err(FileError::key("quick.trials", fault));
        }
        let file = file.resolve()?;
        if let Some(fault) = file.trials.fault() {
            return Err(FileError::key("trials", fault));
        }
        if file.measures.is_empty() {
            return Err(FileError::key(
                "measures",
                "an empty list; expected at least one measure",
            ));
        }
        check_names(&file)?;
        let all = cells(&file.settings, &file.zip, &file.exclude)?;
        let cells: Result<Vec<Cell>, FileError> = all
            .into_iter()
            .map(|settings| {
                Build {
                    file: &file,
                    settings,
                }
                .cell()
            })
            .collect();
        let tables = file.methods.iter().enumerate();
        let programs = programs(&file);
        let method = |(i, table): (usize, &MethodTable)| table.method(i, programs[i].as_ref());
        let methods: Result<Vec<Method>, FileError> = tables.map(method).collect();
        let mut experiment = Self {
            cells: cells?,
            methods: methods?,
            programs: programs.into_iter().flatten().collect(),
            compare: Vec::new(),
            theories: OnceLock::new(),
            file,
        };
        experiment.check()?;
        traces_fit(&experiment.file, experiment.cells.len())?;
        for cell in 0..experiment.cells.len() {
            experiment.engine(cell)?;
        }
        Ok(experiment)
    }

    /// Returns the experiment of Nikolov et al. (2023): claims C1 (noise-free, N = 18), C2 (eta 10.018 %, N = 98) and
    /// C3 (eta 10.014 %, N = 218), K = 400 samples, least squares and four IV passes, every reading at its default.
    ///
    /// # Panics
    /// Never: the file is part of the program, and tested.
    pub fn nikolov2023(seed: u64) -> Self {
        let file = ExperimentFile::parse(NIKOLOV2023).expect("a valid file");
        Self::new(ExperimentFile { seed, ..file }).expect("a valid experiment")
    }

    /// Returns the outputs of all methods (in continuous time, of all observers) in the order of a trial's rows.
    pub fn outputs(&self) -> Vec<Output> {
        let observers = self.file.observers.iter().map(|table| Output {
            estimator: table.label(),
            pass: 0,
        });
        let outputs = self.methods.iter().flat_map(Method::outputs);
        outputs.cloned().chain(observers).collect()
    }

    /// Returns the number of outputs.
    pub fn output_count(&self) -> usize {
        let of_methods: usize = self.methods.iter().map(|m| m.outputs().len()).sum();
        of_methods + self.file.observers.len()
    }

    /// Returns the number of trials in the largest batch of any program. Blocks end at multiples of it.
    pub fn batch(&self) -> u64 {
        let batches = self.programs.iter().map(|program| program.options.batch);
        batches.max().unwrap_or(1)
    }

    /// Returns how many trials a cell has if `asked` are requested: all of them, or one if they would all be identical.
    pub fn trials_of(&self, cell: usize, asked: u64) -> u64 {
        if self.cells[cell].is_deterministic() {
            asked.min(1)
        } else {
            asked
        }
    }

    /// Returns the engine that runs a cell: [`Engine::Lanes`] or [`Engine::Faer`].
    ///
    /// # Errors
    /// If the file asks for lanes and they do not cover the cell.
    pub fn engine(&self, cell: usize) -> Result<Engine, FileError> {
        let engine = self.file.engine.of(self, &self.cells[cell]);
        engine.map_err(|reason| {
            let message = format!(
                "\"lanes\" do not cover {reason} (cell {cell}); expected \"auto\" or \"faer\""
            );
            FileError::key("engine", message)
        })
    }

    /// Returns the settings that vary, except those for which every result has a column anyway.
    pub fn axes(&self) -> Vec<Key> {
        let varies = |key: &Key| matches!(self.file.settings.get(key), Some(Axis::Many(_)));
        Key::ALL
            .iter()
            .copied()
            .filter(|key| varies(key) && !key.is_always_a_column())
            .collect()
    }

    /// Returns the part of the file that fixes the results bit for bit: everything except words, the number of trials
    /// and timing.
    pub fn design(&self) -> Value {
        let mut design = design_of(&serde_json::to_value(&self.file).unwrap_or_default());
        let own: Vec<&str> = self.methods.iter().filter_map(Method::identity).collect();
        if !own.is_empty() {
            design["own_methods"] = json!(own);
        }
        design
    }

    /// Returns the design with the version of this program.
    pub fn stamped_design(&self) -> Value {
        json!({ "version": env!("CARGO_PKG_VERSION"), "experiment": self.design() })
    }

    /// Returns the fingerprint of [`Self::stamped_design`].
    pub fn fingerprint(&self) -> u128 {
        xxh3_128(self.stamped_design().to_string().as_bytes())
    }

    /// Returns the bytes that a thread allocates for trials of a cell before it draws the first, as far as they grow
    /// with the settings: the record, the window of every method, and curves; in continuous time the disturbance.
    pub fn thread_bytes(&self, cell: usize) -> usize {
        const NUMBER: usize = size_of::<f64>();
        let (engine, cell) = (self.engine(cell), &self.cells[cell]);
        let Cell {
            order,
            window,
            horizon,
            ..
        } = *cell;
        // Stage 7's output, and the rows of stage 6 that are solved by themselves.
        let methods = self.methods.len() * window * (order + 2) * NUMBER;
        // The batch of a program's records, as it is drawn and as it is sent.
        let batches = self
            .programs
            .iter()
            .map(|program| program.options.batch as usize);
        let methods = methods + batches.sum::<usize>() * window * 3 * 2 * NUMBER;
        let curve = if self.file.curves { horizon } else { 0 };
        let (samples, lanes) = match (&cell.source, engine) {
            (Source::Continuous(of), _) => return NUMBER * of.disturbance_numbers(),
            (_, Ok(Engine::Lanes)) => (2 * horizon + window + 4 * curve, MOST_LANES),
            // The noise filter's scratch.
            _ => (cell.record_bytes() / NUMBER + horizon + curve, 1),
        };
        let curves = if curve > 0 { Curves::bytes(horizon) } else { 0 };
        samples * lanes * NUMBER + methods * lanes + curves
    }

    /// Returns the index of an output by its label, such as "iv(4)".
    ///
    /// # Errors
    /// If there is no such output. The error lists the labels; `key` names the place in the file.
    pub fn output(&self, key: &str, label: &str) -> Result<usize, FileError> {
        let outputs = self.outputs();
        let found = outputs.iter().position(|output| output.label() == label);
        found.ok_or_else(|| {
            let labels: Vec<String> = outputs.iter().map(Output::label).collect();
            let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
            let unknown =
                asobench_identification::names::UnknownName::new("output", label, &labels);
            FileError::key(key, unknown.to_string())
        })
    }

    /// Checks the parts of the file against each other, and resolves the indices of the comparisons.
    fn check(&mut self) -> Result<(), FileError> {
        self.check_methods()?;
        self.check_use()?;
        super::claims::check(self)?;
        for [first, second] in &self.file.compare {
            let pair = [
                self.output("compare", first)?,
                self.output("compare", second)?,
            ];
            if first == second {
                return Err(FileError::key(
                    "compare",
                    format!("'{first}' is compared with itself"),
                ));
            }
            self.compare.push(pair);
        }
        match &self.file.trials {
            TrialRule::Fixed(_) => {}
            TrialRule::Until(until) => {
                self.target(until)?;
            }
            TrialRule::Decided(until) => super::claims::check_target(&self.file, &until.claim)?,
        }
        for slope in &self.file.slopes {
            self.measure("slopes", slope.measure)?;
            let checked = slope.check(&self.file);
            checked.map_err(|message| FileError::key("slopes.over", message))?;
        }
        for bound in &self.file.bounds {
            self.measure("bounds", bound.measure)?;
            let limits = [bound.below, bound.rounding];
            if limits == [None; 2] {
                let message = "expected 'below', 'rounding' or both";
                return Err(FileError::key("bounds", message));
            }
            let mut limits = limits.into_iter().flatten();
            if let Some(limit) = limits.find(|limit| !limit.is_finite()) {
                return Err(FileError::key(
                    "bounds",
                    format!("{limit} is not a finite number"),
                ));
            }
        }
        Ok(())
    }

    /// Checks that every method serves every cell, and that every output has a distinct name.
    fn check_methods(&self) -> Result<(), FileError> {
        let place = if self.file.continuous.is_some() {
            "observers"
        } else {
            "methods"
        };
        if self.output_count() == 0 {
            return Err(FileError::key(
                place,
                "an empty list; expected at least one",
            ));
        }
        at_most(place, self.output_count(), "outputs", OUTPUT_LIMIT)?;
        let labels: Vec<String> = self.outputs().iter().map(Output::label).collect();
        check_labels(place, &labels)?;
        let mut shapes: Vec<Shape> = self.cells.iter().map(Cell::shape).collect();
        shapes.sort_by_key(|shape| (shape.order, shape.window));
        shapes.dedup();
        for (i, method) in self.methods.iter().enumerate() {
            if method.needs().plant {
                continue;
            }
            for shape in &shapes {
                let prepared = method.prepare(*shape);
                prepared.map_err(|e| FileError::key(&format!("methods[{i}]"), e.to_string()))?;
            }
        }
        self.check_observers()
    }

    /// Checks that a method that knows the plant knows it in every cell, and that every method's own observer serves
    /// every cell.
    fn check_observers(&self) -> Result<(), FileError> {
        for (i, method) in self.methods.iter().enumerate() {
            let known = method.needs().plant;
            if !known && method.observer().is_none() {
                continue;
            }
            for (number, cell) in self.cells.iter().enumerate() {
                let model = if known {
                    cell.known_model().map(|_| ())
                } else {
                    Ok(())
                };
                let observer = model.and_then(|()| CellObserver::new(cell, method));
                observer.map_err(|e| {
                    FileError::key(&format!("methods[{i}]"), format!("{e} (cell {number})"))
                })?;
            }
        }
        Ok(())
    }

    /// Checks that every given key has a meaning in at least one cell.
    fn check_use(&self) -> Result<(), FileError> {
        let fixed = |cell: &Cell| cell.settings.get(&Key::Plant) != Some(&"random".into());
        if self.cells.iter().all(fixed) {
            for key in [Key::PlantOrder, Key::PoleRadius] {
                // A resolved file has every setting, so a default value does not show that the setting was given.
                let given = self.file.settings.get(&key);
                if given.is_some_and(|axis| Some(axis) != key.default().map(Axis::One).as_ref()) {
                    let message = "no cell has plant = \"random\", so it has no effect; expected a random plant or \
                                   no such key";
                    return Err(FileError::key(key.name(), message));
                }
            }
        }
        let given = |cell: &Cell| {
            let process = cell.process();
            process.is_some_and(|process| matches!(process.input(), Input::Samples(_)))
        };
        if !self.cells.is_empty() && self.cells.iter().all(given) {
            for key in [Key::Amplitude, Key::Sequence] {
                let axis = self.file.settings.get(&key);
                if axis.is_some_and(|axis| Some(axis) != key.default().map(Axis::One).as_ref()) {
                    let message = "the input is a file's in every cell, so it means nothing; expected no such key";
                    return Err(FileError::key(key.name(), message));
                }
            }
        }
        let states = self.cells.iter().map(Cell::plant_order).max();
        let most = states.unwrap_or(usize::MAX);
        let mut measures = self.file.measures.iter();
        if let Some(measure) = measures.find(|measure| measure.least_order() > most) {
            let message = format!("no plant has so many states; expected at most 'rms_x{most}'");
            return Err(FileError::key(&format!("measures: '{measure}'"), message));
        }
        let open = |cell: &Cell| cell.settings.get(&Key::Feedback) == Some(&"none".into());
        if self.cells.iter().all(open) {
            for (i, method) in self.methods.iter().enumerate() {
                if let Some((key, value)) = method.needs().reference {
                    let message = format!(
                        "\"{value}\" where no cell has feedback, so there is no reference; expected \"u\", or a \
                         feedback in [settings]"
                    );
                    return Err(FileError::key(&format!("methods[{i}].{key}"), message));
                }
            }
        }
        Ok(())
    }

    /// Returns the indices of the output and of the measure that a rule looks at.
    ///
    /// # Errors
    /// If there is no such output or measure.
    pub fn target(&self, until: &Until) -> Result<(usize, usize), FileError> {
        let output = self.output("trials.output", &until.output)?;
        Ok((output, self.measure("trials.until", until.until)?))
    }

    /// Returns what a cell keeps trial by trial, so that claims can compare it with other cells, or two medians in it:
    /// the index of an output, and a measure.
    pub fn series_of(&self, cell: &Cell) -> impl Iterator<Item = (usize, Measure)> {
        let tables = self.file.needed.iter().flat_map(|needed| &needed.series);
        let value = |key| cell.settings.get(key);
        let kept = tables.filter(|of| [Some(&of.from), Some(&of.to)].contains(&value(&of.axis)));
        let kept = kept.map(|of| (&of.output, of.measure));
        let medians = self.file.needed.iter().flat_map(|needed| &needed.medians);
        let medians = medians.flat_map(|of| [(&of.output, of.measure), (&of.to, of.measure_of_to)]);
        let found: BTreeSet<(usize, Measure)> = kept
            .chain(medians)
            .filter_map(|(label, measure)| Some((self.output("output", label).ok()?, measure)))
            .collect();
        found.into_iter()
    }

    /// Returns the measures that slopes need, each once. The jackknife's groups are kept for these.
    pub fn sloped_measures(&self) -> Vec<Measure> {
        let slopes = self.file.slopes.iter();
        each_once(slopes.map(|slope| slope.measure))
    }

    /// Returns the measures that the file or its bounds ask for, each once, those of the file first.
    pub fn measures_asked(&self) -> Vec<Measure> {
        let ExperimentFile {
            measures, bounds, ..
        } = &self.file;
        let rounding = bounds.iter().any(|bound| bound.rounding.is_some());
        let of_bounds = bounds.iter().map(|bound| bound.measure);
        let of_bounds = of_bounds.chain(rounding.then_some(Measure::Condition));
        each_once(measures.iter().copied().chain(of_bounds))
    }

    /// Returns the index of a measure among those of the file.
    fn measure(&self, key: &str, measure: Measure) -> Result<usize, FileError> {
        let mut measures = self.file.measures.iter();
        let found = measures.position(|of| *of == measure);
        found.ok_or_else(|| FileError::key(key, format!("'{measure}' is not among the measures")))
    }
}

/// Removes repetitions; the order of first occurrence stays.
fn each_once(measures: impl Iterator<Item = Measure>) -> Vec<Measure> {
    let mut once = Vec::new();
    for measure in measures {
        if !once.contains(&measure) {
            once.push(measure);
        }
    }
    once
}

/// Returns the part of a resolved file that fixes the results bit for bit.
pub fn design_of(file: &Value) -> Value {
    const WORDS: [&str; 10] = [
        "title",
        "question",
        "hypothesis",
        "claims",
        "family",
        "expected_time",
        "trials",
        "looks",
        "timing",
        "quick",
    ];
    let mut design = file.clone();
    if let Some(design) = design.as_object_mut() {
        design.retain(|key, _| !WORDS.contains(&key.as_str()));
    }
    design
}

/// Returns, for every method of a resolved file, the program that it is, if it is one.
fn programs(file: &ExperimentFile) -> Vec<Option<Arc<Program>>> {
    // Identifies the study, whatever version a program reports.
    let mut design = design_of(&serde_json::to_value(file).unwrap_or_default());
    for method in design["methods"].as_array_mut().into_iter().flatten() {
        if let Some(method) = method.as_object_mut() {
            method.shift_remove("worker");
        }
    }
    let fingerprint = format!("{:032x}", xxh3_128(design.to_string().as_bytes()));
    let program = |table: &MethodTable| {
        let options = table.program()?.clone();
        let program = Program::new(table.base_name(), options, fingerprint.clone());
        Some(Arc::new(program))
    };
    file.methods.iter().map(program).collect()
}

/// Checks that not too many points of courses are kept.
fn traces_fit(file: &ExperimentFile, cells: usize) -> Result<(), FileError> {
    const MOST: f64 = 1e5;
    let Some((every, until)) = file
        .continuous
        .as_ref()
        .and_then(|of| Some((of.trace_every?, of.until)))
    else {
        return Ok(());
    };
    let points = until / every * cells as f64;
    if points <= MOST {
        return Ok(());
    }
    let message = format!("{points:.0} points over all cells; expected at most {MOST}");
    Err(FileError::key("continuous.trace_every", message))
}
