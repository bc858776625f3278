//! The summary of stored trials: quantiles, failures and what they say of each printed bound.

use super::claims::Bound;
use crate::metric::{Quantile, Share, Verdict, quantile, verdict};
use crate::study::{
    CURVE_BIN_ERROR, Cell, CurveQuantiles, Curves, Figure, Outcomes, StoreError, TrialTable,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// Quantiles of one figure over the trials that have it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quantiles {
    /// Trials that have the figure.
    pub count: u64,
    /// 5 % quantile.
    pub q05: Quantile,
    /// Lower quartile.
    pub q25: Quantile,
    /// Median.
    pub q50: Quantile,
    /// Upper quartile.
    pub q75: Quantile,
    /// 95 % quantile.
    pub q95: Quantile,
}

impl Quantiles {
    /// Quantiles of a sample, which is sorted; NaN must have been taken out.
    fn of(mut sample: Vec<f64>) -> Self {
        sample.sort_unstable_by(f64::total_cmp);
        let at = |q| quantile(&sample, q);
        Self {
            count: sample.len() as u64,
            q05: at(0.05),
            q25: at(0.25),
            q50: at(0.5),
            q75: at(0.75),
            q95: at(0.95),
        }
    }
}

/// One output of one method in one cell.
#[derive(Clone, Debug, Serialize)]
pub struct OutputSummary {
    /// The estimator's name.
    pub estimator: String,
    /// The pass.
    pub pass: u32,
    /// Trials, failures and unstable models.
    pub outcomes: Outcomes,
    /// Quantiles by figure.
    pub quantiles: BTreeMap<&'static str, Quantiles>,
}

impl OutputSummary {
    /// "LS", "IV(4)": the estimator with its pass.
    pub fn label(&self) -> String {
        label(&self.estimator, self.pass)
    }
}

fn label(estimator: &str, pass: u32) -> String {
    let name = estimator.to_uppercase();
    if pass == 0 {
        name
    } else {
        format!("{name}({pass})")
    }
}

/// One cell.
#[derive(Clone, Debug, Serialize)]
pub struct CellSummary {
    /// The cell's index.
    pub cell: usize,
    /// Its settings.
    #[serde(flatten)]
    pub settings: Cell,
    /// Every output.
    pub outputs: Vec<OutputSummary>,
    /// Quantiles of e_x(k), k = 0 ... K-1, of the first and the last output.
    pub curves: [CurveQuantiles; 2],
}

/// How one output fares with a bound.
#[derive(Clone, Debug, Serialize)]
pub struct EstimatorShare {
    /// The estimator's name.
    pub estimator: String,
    /// The pass.
    pub pass: u32,
    /// Quantiles of the figure, over the trials that have it.
    pub quantiles: Quantiles,
    /// The share of all trials that meet the bound; a failed trial does not.
    pub met: Share,
}

impl EstimatorShare {
    /// "LS", "IV(4)": the estimator with its pass.
    pub fn label(&self) -> String {
        label(&self.estimator, self.pass)
    }
}

/// One bound.
#[derive(Clone, Debug, Serialize)]
pub struct BoundSummary {
    /// The claim.
    pub claim: &'static str,
    /// The figure.
    pub figure: Figure,
    /// The figure's name in a table.
    pub label: &'static str,
    /// The bound in words.
    pub bound: String,
    /// The printed number; null for "zero".
    pub value: Option<f64>,
    /// The multiple of eps times condition that counts as zero; null for a printed number.
    pub rounding: Option<f64>,
    /// The first and the last output.
    pub estimators: [EstimatorShare; 2],
    /// What the last output's share says.
    pub verdict: Verdict,
}

/// Everything that the report shows.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Trials a cell.
    pub trials: u64,
    /// The seed.
    pub seed: u64,
    /// The largest relative error of the quantiles in `curves`: half a bin.
    pub curve_relative_error: f64,
    /// Every cell.
    pub cells: Vec<CellSummary>,
    /// Every bound.
    pub bounds: Vec<BoundSummary>,
}

impl Summary {
    /// Summarises stored trials.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn of(
        table: &TrialTable,
        cells: &[Cell],
        curves: &[Curves],
        bounds: &[Bound],
        trials: u64,
        seed: u64,
    ) -> Result<Self, StoreError> {
        let mut summaries = cell_summaries(table, cells, curves)?;
        for &figure in Figure::ALL {
            let values = table.figure(figure)?;
            for (group, output) in outputs_of(table, &mut summaries) {
                let sample = table.rows_of(group).map(|row| values[row]);
                let defined = sample.filter(|value| !value.is_nan()).collect();
                output
                    .quantiles
                    .insert(figure.name(), Quantiles::of(defined));
            }
        }
        let bounds = bound_summaries(table, &summaries, bounds)?;
        Ok(Self {
            trials,
            seed,
            curve_relative_error: CURVE_BIN_ERROR,
            cells: summaries,
            bounds,
        })
    }
}

fn cell_summaries(
    table: &TrialTable,
    cells: &[Cell],
    curves: &[Curves],
) -> Result<Vec<CellSummary>, StoreError> {
    let mut summaries: Vec<CellSummary> = cells
        .iter()
        .zip(curves)
        .enumerate()
        .map(|(cell, (settings, curves))| CellSummary {
            cell,
            settings: settings.clone(),
            outputs: Vec::new(),
            curves: [curves.quantiles(false), curves.quantiles(true)],
        })
        .collect();
    for (group, outcomes) in table.groups().iter().zip(table.outcomes()?) {
        summaries[group.cell as usize].outputs.push(OutputSummary {
            estimator: group.estimator.clone(),
            pass: group.pass,
            outcomes,
            quantiles: BTreeMap::new(),
        });
    }
    Ok(summaries)
}

/// Every output with the index of its group in the table, in the same order.
fn outputs_of<'a>(
    table: &TrialTable,
    cells: &'a mut [CellSummary],
) -> impl Iterator<Item = (usize, &'a mut OutputSummary)> {
    // Groups stand cell by cell in the file, and so do the outputs here.
    let groups = 0..table.groups().len();
    groups.zip(cells.iter_mut().flat_map(|cell| &mut cell.outputs))
}

fn bound_summaries(
    table: &TrialTable,
    cells: &[CellSummary],
    bounds: &[Bound],
) -> Result<Vec<BoundSummary>, StoreError> {
    let conditions = table.figure(Figure::Condition)?;
    let mut summaries = Vec::new();
    for bound in bounds {
        let Some(cell) = cells.iter().find(|cell| cell.settings.claim == bound.claim) else {
            continue;
        };
        let values = table.figure(bound.figure)?;
        let share = |output: &OutputSummary| {
            let group = table.groups().iter().position(|group| {
                (group.cell as usize, group.pass) == (cell.cell, output.pass)
                    && group.estimator == output.estimator
            });
            let rows = group.into_iter().flat_map(|group| table.rows_of(group));
            let met = rows.filter(|&row| bound.is_met(values[row], conditions[row]));
            EstimatorShare {
                estimator: output.estimator.clone(),
                pass: output.pass,
                quantiles: output.quantiles[bound.figure.name()],
                met: Share::new(met.count() as u64, output.outcomes.trials),
            }
        };
        let (Some(first), Some(last)) = (cell.outputs.first(), cell.outputs.last()) else {
            continue;
        };
        summaries.push(summarise_bound(bound, [share(first), share(last)]));
    }
    Ok(summaries)
}

fn summarise_bound(bound: &Bound, estimators: [EstimatorShare; 2]) -> BoundSummary {
    use super::Limit;
    let (value, rounding) = match bound.limit {
        Limit::Value(value) => (Some(value), None),
        Limit::Rounding(multiple) => (None, Some(multiple)),
    };
    BoundSummary {
        claim: bound.claim,
        figure: bound.figure,
        label: bound.label,
        bound: bound.text(),
        value,
        rounding,
        verdict: verdict(estimators[1].met),
        estimators,
    }
}
