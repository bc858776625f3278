//! The experiment: its cells, each with a process, and its methods.

use crate::design::file::lists::each_once;
use crate::design::file::{Axis, ExperimentFile, FileError, JointTable, Key, Scalar, Until};
use crate::design::{Cell, FoundTheory, Measure, Theories};
use crate::worker::Program;
use asobench_identification::estimator::{Method, Output};
use asobench_identification::names::UnknownName;
use asobench_identification::theory::{CellTheory, NoTheory};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::xxh3_128;

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
    pub(crate) theories: OnceLock<Theories>,
}

impl Experiment {
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

    /// Returns the settings that vary, except those for which every result has a column anyway.
    pub fn axes(&self) -> Vec<Key> {
        let varies = |key: &Key| matches!(self.file.settings.get(key), Some(Axis::Many(_)));
        Key::ALL
            .iter()
            .copied()
            .filter(|key| varies(key) && !key.entry().column)
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

    /// Returns the index of an output by its label, such as "iv(4)".
    ///
    /// # Errors
    /// If there is no such output. The error lists the labels; `key` names the place in the file.
    pub fn output(&self, key: &str, label: &str) -> Result<usize, FileError> {
        let outputs = self.outputs();
        let found = outputs.iter().position(|output| output.label() == label);
        found.ok_or_else(|| {
            let labels = outputs.iter().map(Output::label);
            FileError::key(key, UnknownName::new("output", label, labels))
        })
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

    /// Returns the ratios whose distribution a cell keeps, each with the indices of two outputs and of their measures.
    pub fn kept_ratios(&self) -> Vec<(&JointTable, [(usize, usize); 2])> {
        let tables = self.file.needed.iter().flat_map(|needed| &needed.ratios);
        let place = |label: &str, measure| {
            let output = self.output("output", label).ok()?;
            Some((output, self.measure("measure", measure).ok()?))
        };
        let places = |of: &JointTable| Some([place(&of.output, of.measure)?, place(&of.to, of.measure_of_to)?]);
        tables.filter_map(|of| Some((of, places(of)?))).collect()
    }

    /// Returns the measures that slopes need, each once. The jackknife's groups are kept for these.
    pub fn sloped_measures(&self) -> Vec<Measure> {
        let slopes = self.file.slopes.iter();
        each_once(slopes.map(|slope| slope.measure))
    }

    /// Returns the measures that the file or its bounds ask for, each once, those of the file first.
    pub fn measures_asked(&self) -> Vec<Measure> {
        let ExperimentFile { measures, bounds, .. } = &self.file;
        let rounding = bounds.iter().any(|bound| bound.rounding.is_some());
        let of_bounds = bounds.iter().map(|bound| bound.measure);
        let of_bounds = of_bounds.chain(rounding.then_some(Measure::Condition));
        each_once(measures.iter().copied().chain(of_bounds))
    }

    /// Returns the index of a measure among those of the file.
    pub(crate) fn measure(&self, key: &str, measure: Measure) -> Result<usize, FileError> {
        let mut measures = self.file.measures.iter();
        let found = measures.position(|of| *of == measure);
        found.ok_or_else(|| FileError::key(key, format!("'{measure}' is not among the measures")))
    }
}

/// Returns the part of a resolved file that fixes the results bit for bit.
pub fn design_of(file: &Value) -> Value {
    const WORDS: [&str; 12] = [
        "title",
        "question",
        "hypothesis",
        "source",
        "claims",
        "family",
        "expected_time",
        "trials",
        "looks",
        "timing",
        "spread",
        "quick",
    ];
    let mut design = file.clone();
    if let Some(design) = design.as_object_mut() {
        design.retain(|key, _| !WORDS.contains(&key.as_str()));
    }
    design
}

impl Experiment {
    /// Returns the theory of a cell as N grows, for every output.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn theory(&self, cell: usize) -> &FoundTheory {
        let all = self.theories.get_or_init(|| Theories::new(&self.cells));
        let (first, found) = &all.found[all.place[cell]];
        found.get_or_init(|| {
            let cell = &self.cells[*first];
            let of = cell.discrete().ok_or(NoTheory::ContinuousTime)?;
            // A column of a file is one record, not a period.
            if let Some(Scalar::Text(input)) = cell.settings.get(&Key::Input)
                && self.file.columns.contains_key(input)
            {
                return Err(NoTheory::GivenInput);
            }
            let begin = Instant::now();
            let theory = CellTheory::new(&of.process, of.eta, of.order, &self.methods);
            let spent = begin.elapsed().as_nanos() as u64;
            all.spent.fetch_add(spent, Ordering::Relaxed);
            theory
        })
    }

    /// Returns the time that threads have spent on the theory of all cells so far.
    pub(crate) fn time_of_theory(&self) -> Duration {
        let spent = self.theories.get().map_or(0, |all| all.spent.load(Ordering::Relaxed));
        Duration::from_nanos(spent)
    }
}
