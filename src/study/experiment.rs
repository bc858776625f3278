//! What is studied: cells with their processes, and methods.

use super::file::{
    AUTOMATIC, Axis, ExperimentFile, FeedbackTable, FileError, Key, Scalar, Settings, TrialRule,
    cells,
};
use super::row::Figure;
use super::state_feedback::StateFeedback;
use crate::data::{Feedback, NoiseColour, OutputFeedback, PlantSource, Process, ProcessSettings};
use crate::estimator::{Method, Output, SetupError, Shape, Solver};
use crate::names::named_enum;
use crate::observer::Gain;
use crate::plant::{StateSpace, TransferFunction, nikolov2023};
use crate::signal::{Input, LevelReading, NoiseFilter};
use serde_json::Value;

named_enum! {
    /// Where the observer starts.
    ObserverStart, "start of the observer" {
        /// From the estimate of x0 (the default).
        Estimate = "x0-hat",
        /// From zero.
        Zero = "zero",
    }
}

/// One combination of settings under which trials are drawn.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The settings that it was made of.
    pub settings: Settings,
    /// Draws the records.
    pub process: Process,
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
}

impl Cell {
    /// The shape of the estimators' problem.
    pub fn shape(&self) -> Shape {
        Shape {
            order: self.order,
            window: self.window,
        }
    }
}

/// A Monte-Carlo experiment. A trial is a pure function of the experiment, a cell and a trial index.
pub struct Experiment {
    /// The file that it was made of, every default written out.
    pub file: ExperimentFile,
    /// Settings, each with trials of its own on common random numbers.
    pub cells: Vec<Cell>,
    /// What is compared, all on the same records.
    pub methods: Vec<Method>,
    /// Pairs of outputs that are compared, as indices in [`Self::outputs`].
    pub compare: Vec<[usize; 2]>,
}

/// Plants, noises and feedbacks that need no table.
const PLANTS: [&str; 2] = ["nikolov2023", "random"];
const NOISES: [&str; 2] = ["ar", "white"];
const FEEDBACKS: [&str; 1] = ["none"];

/// The largest order, window or record: a record of more samples would not fit into memory.
const LARGEST_COUNT: f64 = 1e7;

/// The experiment file of Nikolov et al. (2023), claims C1 to C3.
pub const NIKOLOV2023: &str = include_str!("../../experiments/nikolov2023.toml");

impl Experiment {
    /// Resolves a file and checks every cell with every method.
    ///
    /// # Errors
    /// What is wrong, the first that is found.
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
                "an empty list; expected at least one figure",
            ));
        }
        own_names("plants", file.plants.keys(), &PLANTS)?;
        own_names("noises", file.noises.keys(), &NOISES)?;
        own_names("feedbacks", file.feedbacks.keys(), &FEEDBACKS)?;
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
        let methods: Result<Vec<Method>, FileError> = tables.map(|(i, m)| m.method(i)).collect();
        let mut experiment = Self {
            cells: cells?,
            methods: methods?,
            compare: Vec::new(),
            file,
        };
        experiment.check()?;
        Ok(experiment)
    }

    /// The experiment of Nikolov et al. (2023): claims C1 (noise-free, N = 18), C2 (eta 10.018 %, N = 98)
    /// and C3 (eta 10.014 %, N = 218), K = 400 samples, least squares and four IV passes, every
    /// reading at its default.
    ///
    /// # Panics
    /// Never: the file is part of the program, and tested.
    pub fn nikolov2023(seed: u64) -> Self {
        let file = ExperimentFile::parse(NIKOLOV2023).expect("a valid file");
        Self::new(ExperimentFile { seed, ..file }).expect("a valid experiment")
    }

    /// The outputs of all methods, in the order of a trial's rows.
    pub fn outputs(&self) -> Vec<Output> {
        let outputs = self.methods.iter().flat_map(Method::outputs);
        outputs.cloned().collect()
    }

    /// The settings that vary, beside those that every result has a column of.
    pub fn axes(&self) -> Vec<Key> {
        let varies = |key: &Key| matches!(self.file.settings.get(key), Some(Axis::Many(_)));
        Key::ALL
            .iter()
            .copied()
            .filter(|key| varies(key) && !key.is_always_a_column())
            .collect()
    }

    /// What makes results comparable bit for bit: everything but words, the number of trials and timing.
    pub fn design(&self) -> Value {
        design_of(&serde_json::to_value(&self.file).unwrap_or_default())
    }

    /// The index of an output by its label, such as "iv(4)".
    ///
    /// # Errors
    /// With the labels that there are; `key` names the place in the file.
    pub fn output(&self, key: &str, label: &str) -> Result<usize, FileError> {
        let outputs = self.outputs();
        let found = outputs.iter().position(|output| output.label() == label);
        found.ok_or_else(|| {
            let labels: Vec<String> = outputs.iter().map(Output::label).collect();
            let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
            let unknown = crate::names::UnknownName::new("output", label, &labels);
            FileError::key(key, unknown.to_string())
        })
    }

    /// Checks what the parts of the file say of each other, and takes the comparisons' indices.
    fn check(&mut self) -> Result<(), FileError> {
        self.check_methods()?;
        for [first, second] in &self.file.compare {
            let pair = [
                self.output("compare", first)?,
                self.output("compare", second)?,
            ];
            if first == second {
                return Err(FileError::key("compare", format!("'{first}' with itself")));
            }
            self.compare.push(pair);
        }
        if let TrialRule::Until(until) = &self.file.trials {
            self.output("trials.output", &until.output)?;
            self.check_measure("trials.until", until.until)?;
        }
        for slope in &self.file.slopes {
            self.check_measure("slopes", slope.figure)?;
            let Some(Axis::Many(values)) = self.file.settings.get(&slope.over) else {
                let message = format!("'{}' has no list in [settings]", slope.over);
                return Err(FileError::key("slopes.over", message));
            };
            let taken = |value: &&Scalar| match value {
                Scalar::Number(number) => *number >= slope.from,
                Scalar::Text(_) => true,
            };
            let positive =
                |value: &Scalar| matches!(value, Scalar::Number(number) if *number > 0.0);
            let taken: Vec<&Scalar> = values.iter().filter(taken).collect();
            if taken.len() < 2 || !taken.into_iter().all(positive) {
                let message = format!(
                    "'{}' must have at least two values from {} on, all of them numbers above 0",
                    slope.over, slope.from
                );
                return Err(FileError::key("slopes.over", message));
            }
        }
        for bound in &self.file.bounds {
            self.check_measure("bounds", bound.figure)?;
            if bound.below.is_some() == bound.rounding.is_some() {
                return Err(FileError::key(
                    "bounds",
                    "expected either 'below' or 'rounding'",
                ));
            }
            let limit = bound.below.or(bound.rounding);
            if let Some(limit) = limit.filter(|limit| !limit.is_finite()) {
                return Err(FileError::key(
                    "bounds",
                    format!("{limit} is not a finite number"),
                ));
            }
        }
        Ok(())
    }

    /// Every method must serve every cell, and every output have a name of its own.
    fn check_methods(&self) -> Result<(), FileError> {
        if self.methods.is_empty() {
            return Err(FileError::key(
                "methods",
                "an empty list; expected at least one method",
            ));
        }
        let mut labels: Vec<String> = self.outputs().iter().map(Output::label).collect();
        labels.sort();
        if let Some([twice, _]) = labels.windows(2).find(|pair| pair[0] == pair[1]) {
            let message =
                format!("two outputs are called '{twice}'; expected a name for each method");
            return Err(FileError::key("methods", message));
        }
        let mut shapes: Vec<Shape> = self.cells.iter().map(Cell::shape).collect();
        shapes.sort_by_key(|shape| (shape.order, shape.window));
        shapes.dedup();
        for (i, method) in self.methods.iter().enumerate() {
            for shape in &shapes {
                let prepared = method.prepare(*shape);
                prepared.map_err(|e| FileError::key(&format!("methods[{i}]"), e.to_string()))?;
            }
        }
        Ok(())
    }

    fn check_measure(&self, key: &str, figure: Figure) -> Result<(), FileError> {
        if self.file.measures.contains(&figure) {
            return Ok(());
        }
        Err(FileError::key(
            key,
            format!("'{figure}' is not among the measures"),
        ))
    }
}

/// What of a resolved file makes results comparable bit for bit.
pub(crate) fn design_of(file: &Value) -> Value {
    const WORDS: [&str; 8] = [
        "title",
        "question",
        "hypothesis",
        "claims",
        "expected_time",
        "trials",
        "timing",
        "quick",
    ];
    let mut design = file.clone();
    if let Some(design) = design.as_object_mut() {
        design.retain(|key, _| !WORDS.contains(&key.as_str()));
    }
    design
}

/// Makes a cell of its settings.
struct Build<'a> {
    file: &'a ExperimentFile,
    settings: Settings,
}

impl Build<'_> {
    fn cell(self) -> Result<Cell, FileError> {
        let plant = self.plant()?;
        let n = plant.order();
        let order = self.count_or(Key::Order, n)?;
        let window = match self.settings.get(&Key::L) {
            Some(_) => 3 * order + 2 * self.count(Key::L)?,
            None => self.count(Key::Window)?,
        };
        if order == 0 {
            return Err(FileError::key("order", SetupError::ZeroOrder.to_string()));
        }
        let shape = Shape { order, window };
        shape
            .check()
            .map_err(|e| FileError::key("window", e.to_string()))?;
        let horizon = self.count_or(Key::Horizon, 400.max(window + 200))?;
        if horizon < window {
            let message = format!(
                "the record of K = {horizon} samples is shorter than the window N = {window}"
            );
            return Err(FileError::key("horizon", message));
        }
        if horizon as f64 > LARGEST_COUNT {
            let message =
                format!("a record of K = {horizon} samples; expected at most {LARGEST_COUNT}");
            return Err(FileError::key("horizon", message));
        }
        let eta = self.number(Key::Eta)?;
        if eta < 0.0 {
            return Err(FileError::key(
                "eta",
                format!("{eta}; expected a percentage of at least 0"),
            ));
        }
        let gain: Gain = self.name(Key::Gain)?;
        gain.check(order)
            .map_err(|e| FileError::key("gain", e.to_string()))?;
        let process = self.process(plant)?;
        Ok(Cell {
            process,
            claim: self.text(Key::Claim),
            eta,
            order,
            window,
            horizon,
            gain,
            observer_start: self.name(Key::ObserverStart)?,
            settings: self.settings,
        })
    }

    fn process(&self, plant: PlantSource) -> Result<Process, FileError> {
        let x0 = self.x0(plant.order())?;
        let (feedback, reference) = self.feedback(plant.order())?;
        let amplitude = match reference {
            Some(reference) => reference,
            None => self.number(Key::Amplitude)?,
        };
        let settings = ProcessSettings {
            x0,
            input: Input::new(self.name(Key::Input)?, amplitude, self.name(Key::Sequence)?),
            noise: self.noise()?,
            level: LevelReading {
                over: self.name(Key::EtaOver)?,
                of: self.name(Key::EtaOf)?,
            },
            input_noise: self.number(Key::InputNoise)?,
            feedback,
            plant,
        };
        Process::from_settings(settings).map_err(|e| FileError::key("settings", e.to_string()))
    }

    fn plant(&self) -> Result<PlantSource, FileError> {
        let name = self.text(Key::Plant);
        match name.as_str() {
            "nikolov2023" => Ok(nikolov2023(self.name(Key::Numerator)?).into()),
            "random" => Ok(PlantSource::Random {
                order: self.count(Key::PlantOrder)?,
                radius: self.number(Key::PoleRadius)?,
            }),
            _ => {
                let known = self.file.plants.keys().map(String::as_str);
                let known: Vec<&str> = PLANTS.into_iter().chain(known).collect();
                let table = self.file.plants.get(&name);
                let table = table.ok_or_else(|| unknown(Key::Plant, &name, &known))?;
                let place = format!("plants.{name}");
                let wrong = |e: String| FileError::key(&place, e);
                let plant = match (&table.b, &table.h) {
                    (Some(b), None) => StateSpace::new(table.a.clone(), b.clone()),
                    (None, Some(h)) => {
                        TransferFunction::new(table.a.clone(), h.clone()).map(StateSpace::from)
                    }
                    _ => return Err(wrong("expected either b or h beside a".to_owned())),
                }
                .map_err(|e| wrong(e.to_string()))?;
                if !plant.is_stable() && !table.unstable {
                    return Err(wrong(
                        "the plant is not stable; expected 'unstable = true' if that is meant"
                            .to_owned(),
                    ));
                }
                Ok(plant.into())
            }
        }
    }

    fn x0(&self, order: usize) -> Result<Vec<f64>, FileError> {
        match &self.settings[&Key::X0] {
            Scalar::Number(x) => Ok(vec![*x; order]),
            Scalar::Text(text) if text == "plant" => {
                let table = self.file.plants.get(&self.text(Key::Plant));
                let x0 = table.and_then(|table| table.x0.clone());
                x0.ok_or_else(|| FileError::key("x0", "the plant's table has no x0"))
            }
            Scalar::Text(text) => Err(FileError::key(
                "x0",
                format!("'{text}'; expected a number or \"plant\""),
            )),
        }
    }

    fn noise(&self) -> Result<NoiseColour, FileError> {
        let name = self.text(Key::Noise);
        match name.as_str() {
            "ar" => Ok(NoiseColour::InverseDenominator),
            "white" => Ok(NoiseFilter::white().into()),
            _ => {
                let known = self.file.noises.keys().map(String::as_str);
                let known: Vec<&str> = NOISES.into_iter().chain(known).collect();
                let table = self.file.noises.get(&name);
                let table = table.ok_or_else(|| unknown(Key::Noise, &name, &known))?;
                let filter = NoiseFilter::new(&table.numerator, &table.denominator);
                let filter =
                    filter.map_err(|e| FileError::key(&format!("noises.{name}"), e.to_string()));
                Ok(filter?.into())
            }
        }
    }

    /// The feedback and the reference's amplitude, where the table has one.
    fn feedback(&self, order: usize) -> Result<(Feedback, Option<f64>), FileError> {
        let name = self.text(Key::Feedback);
        if name == "none" {
            return Ok((Feedback::None, None));
        }
        let known = self.file.feedbacks.keys().map(String::as_str);
        let known: Vec<&str> = FEEDBACKS.into_iter().chain(known).collect();
        let table = self.file.feedbacks.get(&name);
        let table = table.ok_or_else(|| unknown(Key::Feedback, &name, &known))?;
        let place = format!("feedbacks.{name}");
        let wrong = |message: String| FileError::key(&place, message);
        let FeedbackTable {
            numerator,
            denominator,
            state_gain,
            identify,
            ..
        } = table;
        let feedback = match (numerator, state_gain, identify) {
            (Some(numerator), None, None) => {
                let denominator = denominator.as_deref().unwrap_or(&[1.0]);
                let law = OutputFeedback::new(numerator, denominator);
                Feedback::Output(law.map_err(|e| wrong(e.to_string()))?)
            }
            (None, Some(gain), Some(identify)) if denominator.is_none() => {
                if gain.len() != order {
                    return Err(wrong(format!(
                        "state_gain must be {order} numbers, one per state"
                    )));
                }
                if *identify as f64 > LARGEST_COUNT {
                    return Err(wrong(format!(
                        "identify = {identify}; expected at most {LARGEST_COUNT}"
                    )));
                }
                let law = StateFeedback {
                    k: gain.clone(),
                    pilot: *identify,
                    gain: self.name(Key::Gain)?,
                    solver: Solver::default(),
                };
                let law = law.law().map_err(|e| wrong(e.to_string()))?;
                if table.reference == Some(0.0) {
                    // The model is identified with a reference in any case.
                    return Ok((Feedback::Controlled(law.without_reference()), None));
                }
                Feedback::Controlled(law)
            }
            _ => {
                let message = "expected numerator (and denominator), or state_gain and identify";
                return Err(wrong(message.to_owned()));
            }
        };
        Ok((feedback, table.reference))
    }

    fn text(&self, key: Key) -> String {
        self.settings
            .get(&key)
            .map_or_else(String::new, Scalar::to_string)
    }

    fn number(&self, key: Key) -> Result<f64, FileError> {
        match self.settings.get(&key) {
            Some(Scalar::Number(number)) => Ok(*number),
            other => {
                let given = other.map_or_else(String::new, Scalar::to_string);
                Err(FileError::key(
                    key.name(),
                    format!("'{given}'; expected a number"),
                ))
            }
        }
    }

    fn count(&self, key: Key) -> Result<usize, FileError> {
        let number = self.number(key)?;
        if (0.0..=LARGEST_COUNT).contains(&number) && number.fract() == 0.0 {
            Ok(number as usize)
        } else {
            let message = format!("{number}; expected a whole number of 0 to {LARGEST_COUNT}");
            Err(FileError::key(key.name(), message))
        }
    }

    fn count_or(&self, key: Key, automatic: usize) -> Result<usize, FileError> {
        if self.text(key) == AUTOMATIC {
            Ok(automatic)
        } else {
            self.count(key)
        }
    }

    fn name<T: std::str::FromStr<Err: std::fmt::Display>>(&self, key: Key) -> Result<T, FileError> {
        let text = self.text(key);
        text.parse()
            .map_err(|e: T::Err| FileError::key(key.name(), e.to_string()))
    }
}

/// Checks that no table has the name of one that is built in, which would hide it.
fn own_names<'a>(
    table: &str,
    mut names: impl Iterator<Item = &'a String>,
    built_in: &[&str],
) -> Result<(), FileError> {
    match names.find(|name| built_in.contains(&name.as_str())) {
        Some(name) => {
            let place = format!("{table}.{name}");
            Err(FileError::key(
                &place,
                "the name of a built-in one; expected another",
            ))
        }
        None => Ok(()),
    }
}

fn unknown(key: Key, given: &str, known: &[&str]) -> FileError {
    FileError::key(
        key.name(),
        crate::names::UnknownName::new(key.name(), given, known).to_string(),
    )
}
