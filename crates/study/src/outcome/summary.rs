//! The summary of a study: all that a report shows, computed from tallies and stored in summary.json.

use crate::design::file::{BoundTable, Distributions, JointTable, Key, Scalar, Settings, SlopeTable};
use crate::design::{Cell, Experiment, Measure, smooth};
use crate::outcome::cell_pair::{CellPair, cell_pairs};
use crate::outcome::coefficient_statistics;
use crate::outcome::coefficients;
use crate::outcome::course_summary::CourseSummary;
use crate::outcome::curves::{CURVE_BIN_ERROR, CurveQuantiles};
use crate::outcome::nine_digits::rounded;
use crate::outcome::outcomes::Outcomes;
use crate::outcome::tally::{CellSeries, CellTally, OutputTally};
use crate::outcome::theory_summary::{TheorySummary, beside};
use crate::outcome::traces::Traces;
use asobench_identification::estimator::Output;
use asobench_identification::metric::{
    BoundVerdict, Coverage, Jackknife, Paired, PairedStatistics, Quantiles, SKETCH_ERROR, Share, Sketch, Slope,
    Statistics, slope_of_statistics, verdict,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One output of one method in one cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OutputSummary {
    /// The estimator's name.
    pub estimator: String,
    /// The pass.
    pub pass: usize,
    /// Failures by kind.
    pub outcomes: Outcomes,
    /// The share of trials with a failure.
    pub failed: Share,
    /// The share of trials with an unstable A-hat.
    pub unstable: Share,
    /// Statistics of every measure.
    #[serde(rename = "figures", alias = "measures")]
    pub measures: BTreeMap<Measure, Statistics>,
    /// Statistics of the signed errors of a_1 ... a_n, h_1 ... h_n: bias (mean), SD, RMSE.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<(String, Statistics)>,
    /// The shares of estimates of a_1 ... h_n above the truth.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub above_truth: Vec<(String, Share)>,
    /// The distributions of the measures whose values claims look at.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sketches: BTreeMap<Measure, Sketch>,
    /// How the 95 % intervals of the coefficients cover the truth, for coefficients with a standard error.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coverage: Vec<(String, Coverage)>,
    /// Quantiles of the errors over `[course]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub course: Option<CourseSummary>,
    /// Theoretical values of the measures that theory knows; empty if the cell has no theory.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub theory: BTreeMap<Measure, TheorySummary>,
}

impl OutputSummary {
    pub(crate) fn new(
        experiment: &Experiment,
        output: &Output,
        cell: &Cell,
        tally: &OutputTally,
        judged: &Distributions,
    ) -> Self {
        let Outcomes { trials, unstable, .. } = tally.outcomes;
        let order = cell.order();
        let of_coefficients = coefficients::columns(&experiment.file, order);
        let (parameters, course) = tally.parameters.split_at(of_coefficients.min(tally.parameters.len()));
        let measures = experiment.file.measures.iter().copied();
        let label = output.label();
        let is_judged = |measure: &Measure| {
            let mut all = judged.measures.iter();
            all.any(|(output, of)| *output == label && of == measure)
        };
        let sketched = measures.clone().zip(&tally.samples);
        let sketched = sketched.filter(|(measure, _)| is_judged(measure));
        Self {
            estimator: output.estimator.clone(),
            pass: output.pass,
            outcomes: tally.outcomes.clone(),
            failed: Share::new(tally.outcomes.failed(), trials),
            unstable: Share::new(unstable, trials),
            measures: measures
                .zip(&tally.samples)
                .map(|(measure, sample)| {
                    let mut statistics = sample.statistics(measure.worse());
                    // A measure that this output never has does not count as failed.
                    if statistics.count == 0 && tally.outcomes.failed() == 0 {
                        statistics.quantiles = Quantiles::default();
                        statistics.conditional = None;
                    }
                    (measure, statistics)
                })
                .collect(),
            parameters: coefficient_statistics::errors(parameters, order),
            above_truth: coefficient_statistics::above_truth(parameters, order),
            sketches: sketched
                .map(|(measure, sample)| (measure, sample.sketch().clone()))
                .collect(),
            coverage: coefficient_statistics::coverage(parameters, order),
            course: CourseSummary::new(experiment, cell, course),
            theory: BTreeMap::new(),
        }
    }

    /// The label, such as "iv(4)".
    pub fn label(&self) -> String {
        Output {
            estimator: self.estimator.clone(),
            pass: self.pass,
        }
        .label()
    }
}

/// Two outputs on the same trials.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ComparisonSummary {
    /// The first output's label.
    pub first: String,
    /// The second output's label.
    pub second: String,
    /// Differences and ratios of every measure.
    #[serde(rename = "figures", alias = "measures")]
    pub measures: BTreeMap<Measure, PairedStatistics>,
    /// The distributions of the ratios that claims look at.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub ratios: BTreeMap<Measure, Sketch>,
}

/// Two measures over the same trials.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Joint {
    /// Which measures.
    #[serde(rename = "of")]
    pub table: JointTable,
    /// The ratio of the first to the second.
    pub ratio: PairedStatistics,
    /// The distribution of this ratio.
    pub ratios: Sketch,
    /// Both values of every trial, where a claim needs them; null if the output is lost.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trials: Vec<[Option<f64>; 2]>,
}

impl Joint {
    /// Returns the ratios that a cell kept, then the pairs whose series are there.
    fn of_cell(experiment: &Experiment, index: usize, tally: &CellTally, judged: &Distributions) -> Vec<Self> {
        let ratios = experiment.kept_ratios().into_iter();
        let mut joint: Vec<Self> = ratios
            .zip(tally.ratios(experiment))
            .map(|((table, _), paired)| Self::new(table, paired, Vec::new()))
            .collect();
        let kept: Vec<(usize, Measure)> = experiment.series_of(&experiment.cells[index]).collect();
        let needed = experiment.file.needed.iter();
        let tables: Vec<&JointTable> = needed.flat_map(|needed| &needed.medians).collect();
        if tables.is_empty() {
            return joint;
        }
        let series = tally.whole_series();
        let values = |label: &str, measure: Measure| {
            let output = experiment.output("output", label).ok()?;
            let place = kept.iter().position(|kept| *kept == (output, measure))?;
            series.get(place)
        };
        let number = |x: &f64| Some(*x).filter(|x| x.is_finite());
        let pair = |table: &&JointTable| {
            let first = values(&table.output, table.measure)?.iter().map(number);
            let second = values(&table.to, table.measure_of_to)?.iter().map(number);
            let pairs = first.zip(second);
            let paired = Paired::from_pairs(pairs.clone());
            let trials = pairs.map(|(a, b)| [a, b]);
            let trials = trials.take_while(|_| judged.joint.contains(table)).collect();
            Some(Self::new(table, &paired, trials))
        };
        joint.extend(tables.iter().filter_map(pair));
        joint
    }

    fn new(table: &JointTable, paired: &Paired, trials: Vec<[Option<f64>; 2]>) -> Self {
        Self {
            table: table.clone(),
            ratio: paired.statistics(table.measure.worse()),
            ratios: paired.ratio().clone(),
            trials,
        }
    }
}

/// How often one output meets a bound.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OutputShare {
    /// The output's label.
    pub output: String,
    /// The share of all trials that meet the bound; a failed trial does not.
    pub met: Share,
}

/// One bound in one cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BoundSummary {
    /// The bound.
    pub bound: BoundTable,
    /// Every output.
    pub outputs: Vec<OutputShare>,
    /// The verdict of the last output's share.
    pub verdict: BoundVerdict,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_false(value: &bool) -> bool {
    !value
}

/// One cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CellSummary {
    /// The cell's index.
    pub cell: usize,
    /// The claim or case.
    pub claim: String,
    /// The noise level, per cent.
    pub eta: f64,
    /// The estimators' order n.
    pub order: usize,
    /// The window N.
    pub window: usize,
    /// The record's length K.
    pub horizon: usize,
    /// The settings of the file.
    pub settings: Settings,
    /// Trials.
    pub trials: u64,
    /// Whether nothing is random. One trial then stands for all, its values have no Monte-Carlo error, and shares of
    /// trials mean nothing.
    #[serde(default, skip_serializing_if = "is_false")]
    pub deterministic: bool,
    /// Solves of a lane that were repeated with pivoting; 0 if faer ran.
    #[serde(default)]
    pub fallbacks: u64,
    /// Every output.
    pub outputs: Vec<OutputSummary>,
    /// The comparisons that the file asks for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<ComparisonSummary>,
    /// Measures that claims compare trial by trial.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint: Vec<Joint>,
    /// The bounds of this cell.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bounds: Vec<BoundSummary>,
    /// Quantiles of e_x(k), k = 0 ... K-1, of the first and the last output.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curves: Option<[CurveQuantiles; 2]>,
    /// The course of trial 0 in continuous time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traces: Option<Traces>,
}

impl CellSummary {
    /// Summarises a cell.
    pub fn new(experiment: &Experiment, index: usize, tally: &CellTally) -> Self {
        let cell = &experiment.cells[index];
        let (eta, window, horizon) = cell.columns();
        let outputs = experiment.outputs();
        let (file, labels) = (&experiment.file, outputs.iter().map(Output::label));
        let labels: Vec<String> = labels.collect();
        let judged = Distributions::of_claims(file);
        let compared = file.measures.iter().copied();
        let all = outputs.iter().zip(&tally.outputs);
        let mut summaries: Vec<OutputSummary> = all
            .map(|(output, tally)| OutputSummary::new(experiment, output, cell, tally, &judged))
            .collect();
        let is_known = file.measures.iter().any(|measure| smooth(*measure).is_some());
        if let Some(Ok(theory)) = is_known.then(|| experiment.theory(index)) {
            for (summary, (_, of_output)) in summaries.iter_mut().zip(&theory.outputs) {
                summary.theory = beside(theory, of_output, window, &summary.measures);
            }
        }
        let comparisons = experiment.compare.iter().zip(&tally.pairs);
        Self {
            cell: index,
            claim: cell.claim.clone(),
            eta,
            order: cell.order(),
            window,
            horizon,
            settings: cell.settings.clone(),
            trials: tally.trials,
            deterministic: cell.is_deterministic(),
            fallbacks: tally.fallbacks,
            outputs: summaries,
            comparisons: comparisons
                .map(|([first, second], pairs)| ComparisonSummary {
                    first: labels[*first].clone(),
                    second: labels[*second].clone(),
                    measures: compared
                        .clone()
                        .zip(pairs)
                        .map(|(measure, pair)| (measure, pair.statistics(measure.worse())))
                        .collect(),
                    ratios: compared
                        .clone()
                        .zip(pairs)
                        .filter(|(measure, _)| {
                            let pair = [first, second].map(|output| labels[*output].clone());
                            judged.ratios.contains(&(pair, *measure))
                        })
                        .map(|(measure, pair)| (measure, pair.ratio().clone()))
                        .collect(),
                })
                .collect(),
            joint: Joint::of_cell(experiment, index, tally, &judged),
            bounds: bounds(experiment, &cell.claim, &labels, tally),
            curves: tally
                .curves
                .as_ref()
                .map(|curves| [false, true].map(|last| curves.quantiles(last))),
            traces: tally.traces.clone(),
        }
    }

    fn labels(&self) -> Vec<String> {
        self.outputs.iter().map(OutputSummary::label).collect()
    }

    /// Whether a stored cell has the parts by which others find it, and courses of its length.
    fn has_parts_of(&self, index: usize, labels: &[String]) -> bool {
        let mut curves = self.curves.iter().flatten();
        let outputs = self.outputs.len();
        let of_labels = |pair: &ComparisonSummary| {
            [&pair.first, &pair.second]
                .into_iter()
                .all(|label| labels.contains(label))
        };
        self.cell == index
            && self.labels() == labels
            && self.comparisons.iter().all(of_labels)
            && curves.all(|curve| curve.are_of(self.horizon))
            && self
                .traces
                .as_ref()
                .is_none_or(|traces| traces.are_of(self.order, outputs))
    }

    /// Returns the output with this label.
    pub fn output(&self, label: &str) -> Option<&OutputSummary> {
        self.outputs.iter().find(|output| output.label() == label)
    }

    /// Whether a setting's value is a number. A text is not one, even if it looks like a number.
    pub fn is_number(&self, key: Key) -> bool {
        let count = matches!(key, Key::Window | Key::Order | Key::Horizon);
        count || matches!(self.settings.get(&key), Some(Scalar::Number(_)))
    }

    /// Returns a setting's value as text.
    pub fn setting(&self, key: Key) -> String {
        match key {
            Key::Window => self.window.to_string(),
            Key::Order => self.order.to_string(),
            Key::Horizon => self.horizon.to_string(),
            _ => self.settings.get(&key).map_or_else(String::new, ToString::to_string),
        }
    }
}

pub(crate) fn bounds(experiment: &Experiment, claim: &str, labels: &[String], tally: &CellTally) -> Vec<BoundSummary> {
    let all = experiment.file.bounds.iter().enumerate();
    let of_cell = all.filter(|(_, bound)| bound.claim.as_ref().is_none_or(|c| c == claim));
    of_cell
        .map(|(i, bound)| {
            let outputs: Vec<OutputShare> = labels
                .iter()
                .zip(&tally.outputs)
                .map(|(label, tally)| OutputShare {
                    output: label.clone(),
                    met: Share::new(tally.met[i], tally.outcomes.trials),
                })
                .collect();
            BoundSummary {
                bound: bound.clone(),
                verdict: outputs
                    .last()
                    .map_or_else(BoundVerdict::default, |last| verdict(last.met)),
                outputs,
            }
        })
        .collect()
}

/// The parts of a study's summary that a cell gives, instead of its tally.
#[derive(Clone, Debug)]
pub struct CellPart {
    /// The summary of the cell.
    pub cell: CellSummary,
    /// For every slope of the file, the statistic of every output.
    slopes: Vec<Vec<Option<Jackknife>>>,
    /// The series that pairs of cells are made of.
    series: CellSeries,
}

impl CellPart {
    /// Extracts it from a cell's tally.
    pub fn new(experiment: &Experiment, index: usize, tally: &CellTally) -> Self {
        let measures = experiment.sloped_measures();
        let groups_of = |table: &SlopeTable| {
            let groups = measures.iter().zip(&tally.groups);
            let mut groups = groups.filter(|(measure, _)| **measure == table.measure);
            groups.next().map_or(&[][..], |(_, outputs)| outputs)
        };
        let slopes = experiment.file.slopes.iter().map(|table| {
            let groups = groups_of(table).iter();
            groups
                .map(|groups| Jackknife::from_groups(groups, table.statistic, table.measure.worse()))
                .collect()
        });
        Self {
            cell: CellSummary::new(experiment, index, tally),
            slopes: slopes.collect(),
            series: tally.whole_series(),
        }
    }
}

/// A log-log slope of one output over some cells.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SlopeSummary {
    /// The slope that was asked for.
    #[serde(rename = "of")]
    pub table: SlopeTable,
    /// The output's label.
    pub output: String,
    /// The settings that these cells share, among those that vary.
    pub settings: Settings,
    /// The cells.
    pub cells: Vec<usize>,
    /// The slope; null if it is undefined.
    pub slope: Option<Slope>,
    /// Why it is undefined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undefined: Option<String>,
}

/// A study's results. In JSON the numbers of cells and slopes have nine significant digits; summary.parquet has all
/// digits.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// The title.
    pub title: String,
    /// The question.
    pub question: String,
    /// The hypothesis.
    pub hypothesis: String,
    /// The names of the study's claims.
    pub claims: Vec<String>,
    /// Whether trials that the study asks for are missing.
    #[serde(default, skip_serializing_if = "is_false")]
    pub partial: bool,
    /// The seed.
    pub seed: u64,
    /// The settings that vary, other than claim, eta and window.
    pub axes: Vec<Key>,
    /// The largest relative error of quantiles and trimmed means due to binning. It comes on top of their standard
    /// error.
    pub quantile_relative_error: f64,
    /// The same for the quantiles in `curves`.
    pub curve_relative_error: f64,
    /// Every cell.
    #[serde(serialize_with = "rounded")]
    pub cells: Vec<CellSummary>,
    /// Slopes.
    #[serde(default, skip_serializing_if = "Vec::is_empty", serialize_with = "rounded")]
    pub slopes: Vec<SlopeSummary>,
    /// Pairs of cells that claims compare.
    #[serde(default, skip_serializing_if = "Vec::is_empty", serialize_with = "rounded")]
    pub cell_pairs: Vec<CellPair>,
}

impl Summary {
    /// Puts cells together.
    pub fn new(experiment: &Experiment, parts: Vec<CellPart>) -> Self {
        let file = &experiment.file;
        let asked = file.slopes.iter().enumerate();
        Self {
            title: file.title.clone(),
            question: file.question.clone(),
            hypothesis: file.hypothesis.clone(),
            partial: false,
            claims: file.claims.iter().map(|claim| claim.id.clone()).collect(),
            seed: file.seed,
            axes: experiment.axes(),
            quantile_relative_error: SKETCH_ERROR,
            curve_relative_error: CURVE_BIN_ERROR,
            slopes: asked
                .flat_map(|(i, table)| slopes(experiment, i, table, &parts))
                .collect(),
            cell_pairs: cell_pairs(experiment, |cell| &parts[cell].series),
            cells: parts.into_iter().map(|part| part.cell).collect(),
        }
    }

    /// The total number of trials.
    pub fn trials(&self) -> u64 {
        self.cells.iter().map(|cell| cell.trials).sum()
    }

    /// Returns the summary as it comes back from JSON.
    ///
    /// # Errors
    /// As for [`Self::from_json`].
    pub fn as_stored(&self) -> Result<Self, String> {
        let text = serde_json::to_vec(self).map_err(|error| error.to_string())?;
        Self::from_json(&text)
    }

    /// Reads a summary from JSON.
    ///
    /// # Errors
    /// If it is not one, or refers to what is not in it.
    pub fn from_json(text: &[u8]) -> Result<Self, String> {
        let summary: Self = serde_json::from_slice(text).map_err(|error| error.to_string())?;
        let cells = &summary.cells;
        let labels = cells.first().map_or_else(Vec::new, CellSummary::labels);
        let mut parts = cells.iter().enumerate();
        if let Some((index, _)) = parts.find(|(index, cell)| !cell.has_parts_of(*index, &labels)) {
            return Err(format!("damaged: cell {index}"));
        }
        let is_there = |cell: &usize| *cell < cells.len();
        let slope = |slope: &SlopeSummary| labels.contains(&slope.output) && slope.cells.iter().all(is_there);
        let pair = |pair: &CellPair| [pair.from, pair.to].iter().all(is_there);
        if summary.slopes.iter().all(slope) && summary.cell_pairs.iter().all(pair) {
            Ok(summary)
        } else {
            Err("damaged: cells that are not there".to_owned())
        }
    }
}

/// Returns the slopes of one table, for every combination of the other axes and every output.
pub(crate) fn slopes(
    experiment: &Experiment,
    index: usize,
    table: &SlopeTable,
    parts: &[CellPart],
) -> Vec<SlopeSummary> {
    let axes = [Key::Claim, Key::Eta, Key::Window].into_iter().chain(experiment.axes());
    // Settings that change together with the axis do not tell families apart: those zipped with it, and l, which
    // determines the window.
    let zip = experiment.file.zip.iter().find(|group| group.contains(&table.over));
    let moves = |key: &Key| {
        *key == table.over
            || *key == Key::L && table.over == Key::Window
            || zip.is_some_and(|group| group.contains(key))
    };
    let others: Vec<Key> = axes.filter(|key| !moves(key)).collect();
    let x = |cell: &CellSummary| cell.setting(table.over).parse::<f64>().unwrap_or(f64::NAN);
    let mut families: BTreeMap<String, (Settings, Vec<usize>)> = BTreeMap::new();
    for cell in parts.iter().map(|part| &part.cell).filter(|cell| x(cell) >= table.from) {
        let shared: Settings = others
            .iter()
            .filter_map(|key| cell.settings.get(key).map(|value| (*key, value.clone())))
            .collect();
        let name: Vec<String> = shared.values().map(ToString::to_string).collect();
        let family = families.entry(name.join("|")).or_insert_with(|| (shared, Vec::new()));
        family.1.push(cell.cell);
    }
    let mut found = Vec::new();
    for (settings, members) in families.into_values() {
        let xs: Vec<f64> = members.iter().map(|cell| x(&parts[*cell].cell)).collect();
        for (number, output) in experiment.outputs().iter().enumerate() {
            let of_cell = |cell: &usize| parts[*cell].slopes[index][number];
            let of_cells: Vec<Option<Jackknife>> = members.iter().map(of_cell).collect();
            let slope = slope_of_statistics(&xs, &of_cells);
            found.push(SlopeSummary {
                table: table.clone(),
                output: output.label(),
                settings: settings.clone(),
                cells: members.clone(),
                undefined: slope.as_ref().err().map(ToString::to_string),
                slope: slope.ok(),
            });
        }
    }
    found
}
