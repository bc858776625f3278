//! The tally of a block: counts and accumulators that give the same bits in whatever order they are merged.

use crate::design::file::BoundTable;
use crate::design::{Cell, Experiment, Measure, curve_bytes};
use crate::outcome::coefficients;
use crate::outcome::curves::Curves;
use crate::outcome::outcomes::Outcomes;
use crate::outcome::rows::{Flags, OutputRows};
use crate::outcome::traces::Traces;
use crate::outcome::trials::Trials;
use asobench_identification::metric::{JACKKNIFE_GROUPS, Paired, Sample};
use asobench_identification::real::Real;
use asobench_lanes::{Call, Isa};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

/// One output of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OutputTally {
    /// Trials, failures, unstable models.
    pub outcomes: Outcomes,
    /// Every measure, in the order of the file.
    pub samples: Vec<Sample>,
    /// The requested values of each coefficient, then the errors over `[course]` (`coefficients`).
    pub parameters: Vec<Sample>,
    /// The number of trials that meet each bound, in the order of the file.
    pub met: Vec<u64>,
}

/// All outputs of a cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CellTally {
    /// Trials.
    pub trials: u64,
    /// Solves of a lane that were repeated with pivoting.
    pub fallbacks: u64,
    /// Every output.
    pub outputs: Vec<OutputTally>,
    /// Every measure of every comparison; then, if there are any, the ratios of [`Experiment::kept_ratios`].
    pub pairs: Vec<Vec<Paired>>,
    /// The jackknife's groups, for every measure with a slope and every output.
    pub groups: Vec<Vec<Vec<Sample>>>,
    /// For every series that the cell keeps, runs of the measure trial by trial, keyed by their first trial. A failed
    /// trial is NaN.
    pub series: Vec<BTreeMap<u64, Vec<f64>>>,
    /// e_x(k) over k for the first and the last output.
    pub curves: Option<Curves>,
    /// The course of trial 0 in continuous time, if wanted.
    pub traces: Option<Traces>,
}

/// Adds parts to others, or moves them where there are none.
fn merge_all<T>(left: &mut Vec<T>, right: Vec<T>, merge: impl Fn(&mut T, T)) {
    if left.is_empty() {
        *left = right;
    } else {
        left.iter_mut().zip(right).for_each(|(left, right)| merge(left, right));
    }
}

fn merge_samples(left: &mut Vec<Sample>, right: Vec<Sample>) {
    merge_all(left, right, |left, right| left.merge(&right));
}

impl CellTally {
    /// Returns the tally of some trials. Their curves move into it.
    pub fn from_trials(experiment: &Experiment, cell: &Cell, trials: &mut Trials) -> Self {
        // One instruction set for all orders.
        Isa::best().dispatch(1, Counted(experiment, cell, trials))
    }

    /// Does [`Self::from_trials`] by the vector instructions of R.
    fn counted<R: Real>(experiment: &Experiment, cell: &Cell, trials: &mut Trials) -> Self {
        let traces = trials.traces.take();
        let curves = trials.curves.take();
        let curves = curves.map(|mut curves| curves.take(&trials.rows.trials()));
        let rows = &trials.rows;
        let file = &experiment.file;
        // The rows contain every measure of the file.
        let place = |measure: Measure| rows.measures().iter().position(|other| *other == measure);
        let counted = |output: usize, measure: Measure| -> Cow<'_, [f64]> {
            let rows = &rows.outputs()[output];
            place(measure).map_or(Cow::default(), |at| rows.counted(&rows.values()[at]))
        };
        // Leave the failed trials out of each column once, for all that use it.
        let columns: Vec<Vec<Cow<'_, [f64]>>> = (0..rows.outputs().len())
            .map(|output| file.measures.iter().map(|measure| counted(output, *measure)).collect())
            .collect();
        let column = |output: usize, measure: Measure| -> &[f64] {
            let at = file.measures.iter().position(|other| *other == measure);
            at.map_or(&[], |at| &columns[output][at])
        };
        let of_coefficients = coefficients::columns(file, cell.order());
        let of_output = |(output, columns): (&OutputRows, &Vec<Cow<'_, [f64]>>)| OutputTally {
            outcomes: outcomes(output, rows.trials().start),
            samples: columns.iter().map(|column| sample::<R>(column)).collect(),
            parameters: output
                .parameters()
                .iter()
                .enumerate()
                .map(|(i, errors)| {
                    if i < of_coefficients {
                        sample::<R>(&output.counted(errors))
                    } else {
                        // An error over `[course]` is right, whatever came later.
                        sample::<R>(errors)
                    }
                })
                .collect(),
            met: met(experiment, cell, rows.measures(), output),
        };
        let outputs: Vec<OutputTally> = rows.outputs().iter().zip(&columns).map(of_output).collect();
        let pair = |compared: [(usize, usize); 2]| {
            let values = compared.map(|(output, measure)| &*columns[output][measure]);
            Paired::of_columns::<R>(
                values,
                compared.map(|(output, measure)| &outputs[output].samples[measure]),
            )
        };
        let measures = 0..file.measures.len();
        let all_measures = |of: &[usize; 2]| measures.clone().map(|at| pair(of.map(|output| (output, at)))).collect();
        let mut pairs: Vec<Vec<Paired>> = experiment.compare.iter().map(all_measures).collect();
        let ratios = experiment.kept_ratios().into_iter();
        let ratios: Vec<Paired> = ratios.map(|(_, of)| pair(of)).collect();
        pairs.extend(Some(ratios).filter(|ratios| !ratios.is_empty()));
        let first = rows.trials().start;
        let group = |column: &[f64], group: usize| {
            let groups = JACKKNIFE_GROUPS as u64;
            let begin = (group as u64 + groups - first % groups) % groups;
            let of_group = column.iter().skip(begin as usize);
            Sample::gathered::<R>(of_group.step_by(JACKKNIFE_GROUPS).copied())
        };
        let groups_of = |measure: Measure| -> Vec<Vec<Sample>> {
            let of_output = |output| {
                let column = column(output, measure);
                (0..JACKKNIFE_GROUPS).map(|number| group(column, number)).collect()
            };
            (0..columns.len()).map(of_output).collect()
        };
        let groups = experiment.sloped_measures().into_iter().map(groups_of);
        let series = experiment.series_of(cell);
        let series = series.map(|(output, measure)| BTreeMap::from([(first, column(output, measure).to_vec())]));
        Self {
            trials: rows.trial_count() as u64,
            fallbacks: trials.fallbacks,
            outputs,
            pairs,
            groups: groups.collect(),
            series: series.collect(),
            curves,
            traces,
        }
    }

    /// Checks that this has the parts of what [`Self::from_trials`] returns for these trials of a cell.
    ///
    /// # Errors
    /// The faulty part.
    pub(crate) fn check(&self, experiment: &Experiment, cell: &Cell, trials: &Range<u64>) -> Result<(), &'static str> {
        let none = Self::from_trials(experiment, cell, &mut Trials::new(experiment, cell));
        let traces = |traces: &Traces| traces.are_of(cell.order(), self.outputs.len());
        let curves = self.curves.as_ref().map_or(0, Curves::trials);
        if self.trials != trials.end - trials.start {
            Err("a wrong number of trials")
        } else if curves > self.trials {
            Err("curves of more trials")
        } else if self.parts() != none.parts() || !self.traces.as_ref().is_none_or(traces) {
            Err("parts of another study")
        } else {
            Ok(())
        }
    }

    /// Returns the lengths of all parts that do not depend on the trials.
    fn parts(&self) -> Vec<usize> {
        let outputs = self
            .outputs
            .iter()
            .flat_map(|output| [output.samples.len(), output.parameters.len(), output.met.len()]);
        let pairs = self.pairs.iter().map(Vec::len);
        let groups = self
            .groups
            .iter()
            .flat_map(|of_measure| [of_measure.len()].into_iter().chain(of_measure.iter().map(Vec::len)));
        let whole = [
            self.outputs.len(),
            self.pairs.len(),
            self.groups.len(),
            self.series.len(),
            self.curves.as_ref().map_or(0, Curves::horizon),
        ];
        whole.into_iter().chain(outputs).chain(pairs).chain(groups).collect()
    }

    /// Returns the bytes of the tally in memory, but for small parts.
    pub(crate) fn bytes(&self) -> usize {
        let outputs = self.outputs.iter();
        let samples = outputs.flat_map(|output| output.samples.iter().chain(&output.parameters));
        let samples = samples.chain(self.groups.iter().flatten().flatten());
        let pairs = self.pairs.iter().flatten();
        let series = self.series.iter().flat_map(BTreeMap::values);
        let curves = self.curves.as_ref().map_or(0, |curves| curve_bytes(curves.horizon()));
        samples.map(Sample::bytes).sum::<usize>()
            + pairs.map(Paired::bytes).sum::<usize>()
            + series.map(|run| size_of_val(&run[..])).sum::<usize>()
            + curves
    }

    /// Returns the ratios of [`Experiment::kept_ratios`].
    pub(crate) fn ratios(&self, experiment: &Experiment) -> &[Paired] {
        self.pairs.get(experiment.compare.len()).map_or(&[], Vec::as_slice)
    }

    /// Returns the series of all trials, in their order.
    pub fn whole_series(&self) -> CellSeries {
        let whole = |parts: &BTreeMap<u64, Vec<f64>>| parts.values().flatten().copied().collect();
        self.series.iter().map(whole).collect()
    }

    /// Adds the tally of other trials of the same cell.
    pub fn merge(&mut self, other: Self) {
        self.trials += other.trials;
        self.fallbacks += other.fallbacks;
        merge_all(&mut self.outputs, other.outputs, |left, right| {
            left.outcomes.merge(&right.outcomes);
            merge_samples(&mut left.samples, right.samples);
            merge_samples(&mut left.parameters, right.parameters);
            merge_all(&mut left.met, right.met, |left, right| *left += right);
        });
        merge_all(&mut self.pairs, other.pairs, |left, right| {
            merge_all(left, right, |left, right| left.merge(&right));
        });
        merge_all(&mut self.groups, other.groups, |left, right| {
            merge_all(left, right, merge_samples);
        });
        merge_all(&mut self.series, other.series, BTreeMap::extend);
        self.curves = match (self.curves.take(), other.curves) {
            (Some(mut left), Some(right)) => {
                left.merge(right);
                Some(left)
            }
            (left, right) => left.or(right),
        };
        self.traces = self.traces.take().or(other.traces);
    }
}

/// The trials of [`CellTally::from_trials`].
struct Counted<'a>(&'a Experiment, &'a Cell, &'a mut Trials);

impl Call for Counted<'_> {
    type Output = CellTally;

    fn with<R: Real, const N: usize>(self) -> CellTally {
        let Self(experiment, cell, trials) = self;
        CellTally::counted::<R>(experiment, cell, trials)
    }
}

fn sample<R: Real>(column: &[f64]) -> Sample {
    Sample::gathered::<R>(column.iter().copied())
}

/// Counts the outcomes of trials from `first` on.
pub(crate) fn outcomes(rows: &OutputRows, first: u64) -> Outcomes {
    let count = |is: &dyn Fn(&Flags) -> bool| rows.flags().iter().filter(|flags| is(flags)).count() as u64;
    let is_unstable = |flags: &Flags| flags.unstable() == Some(true);
    let unstable = count(&is_unstable);
    let mut outcomes = Outcomes {
        trials: rows.len() as u64,
        unstable,
        unstable_so_far: count(&|flags| flags.unstable_so_far()),
        lost: unstable,
        failures: BTreeMap::new(),
        failed_trials: BTreeMap::new(),
    };
    for (place, failure) in rows.failures() {
        let lost = !failure.kind.is_counted() && !is_unstable(&rows.flags()[*place]);
        outcomes.lost += u64::from(lost);
        outcomes.add_failure(failure.kind.name(), first + *place as u64);
    }
    outcomes
}

/// Counts the rows that meet each bound of the file.
fn met(experiment: &Experiment, cell: &Cell, measures: &[Measure], rows: &OutputRows) -> Vec<u64> {
    let column = |measure: Measure| {
        let at = measures.iter().position(|other| *other == measure);
        at.map(|at| &rows.values()[at][..])
    };
    let condition = column(Measure::Condition);
    let of_bound = |bound: &BoundTable| {
        let asked = bound.claim.as_ref().is_none_or(|claim| *claim == cell.claim);
        let values = column(bound.measure).filter(|_| asked);
        let Some(values) = values.map(|values| rows.counted(values)) else {
            return 0;
        };
        let condition = |place: usize| condition.map_or(f64::NAN, |numbers| numbers[place]);
        let values = values.iter().enumerate();
        values
            .filter(|(place, value)| bound.is_met(**value, condition(*place)))
            .count() as u64
    };
    experiment.file.bounds.iter().map(of_bound).collect()
}

/// The series that a cell kept trial by trial, in the order of [`Experiment::series_of`].
pub type CellSeries = Vec<Vec<f64>>;

#[cfg(test)]
mod tests;
