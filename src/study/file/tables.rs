//! The smaller tables of an experiment file.

use super::super::measure::Measure;
use super::{Axis, ExperimentFile, Key, Scalar};
use crate::metric::SlopeOf;
use crate::text::number;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A plant: a with b or h.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlantTable {
    /// Last row of A: `a_1 ... a_n`.
    pub a: Vec<f64>,
    /// Input vector b.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b: Option<Vec<f64>>,
    /// Numerator h of W(z), instead of b.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h: Option<Vec<f64>>,
    /// Initial state, taken where the setting x0 is "plant".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x0: Option<Vec<f64>>,
    /// Consent to an unstable plant.
    #[serde(default)]
    pub unstable: bool,
}

/// A noise filter `C(q) / D(q)` of white Gaussian noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseTable {
    /// `c_0 ... c_q`.
    pub numerator: Vec<f64>,
    /// `1, d_1 ... d_p`.
    #[serde(default = "one")]
    pub denominator: Vec<f64>,
}

fn one() -> Vec<f64> {
    vec![1.0]
}

/// A feedback: of the measured output, `u(k) = -K(q) y(k) + r(k)`, or of the adaptive observer's state,
/// `u(k) = -k'xhat(k) + r(k)` after the first `identify` samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeedbackTable {
    /// Numerator of K(q): `c_0 ... c_q`; one number is a static gain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub numerator: Option<Vec<f64>>,
    /// Denominator of K(q): `1, d_1 ... d_p`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denominator: Option<Vec<f64>>,
    /// State feedback: k, one number per state.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state_gain: Option<Vec<f64>>,
    /// State feedback: samples of the open loop from which the observer's model is identified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identify: Option<usize>,
    /// The reference's amplitude instead of the setting `amplitude`; 0 is r = 0, with state feedback once the
    /// loop is closed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<f64>,
}

/// A log-log slope: of a statistic of a measure over an axis, for every output and every value of the other axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlopeTable {
    /// The measure.
    #[serde(rename(serialize = "figure"), alias = "figure")]
    pub measure: Measure,
    /// The axis.
    pub over: Key,
    /// "median" or "rmse".
    #[serde(default)]
    pub statistic: SlopeOf,
    /// Only cells from this value of the axis on.
    #[serde(default)]
    pub from: f64,
}

impl SlopeTable {
    /// Whether the setting has values to take a slope over.
    pub(in crate::study) fn check(&self, file: &ExperimentFile) -> Result<(), String> {
        let Self { over, from, .. } = self;
        let Some(Axis::Many(values)) = file.settings.get(over) else {
            return Err(format!("'{over}' has no list in [settings]"));
        };
        let taken = |value: &&Scalar| match value {
            Scalar::Number(number) => number >= from,
            Scalar::Text(_) => true,
        };
        let positive = |value: &Scalar| matches!(value, Scalar::Number(number) if *number > 0.0);
        let taken: Vec<&Scalar> = values.iter().filter(taken).collect();
        if taken.len() < 2 || !taken.into_iter().all(positive) {
            return Err(format!(
                "'{over}' must have at least two values from {from} on, all of them numbers above 0"
            ));
        }
        Ok(())
    }
}

/// A bound: of every cell, or of those whose `claim` is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundTable {
    /// The cells' claim; all cells where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub claim: Option<String>,
    /// The measure.
    #[serde(rename(serialize = "figure"), alias = "figure")]
    pub measure: Measure,
    /// The figure's name in a table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// The measure must be below this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below: Option<f64>,
    /// Or below this multiple of eps times the condition number: "zero".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rounding: Option<f64>,
}

impl BoundTable {
    /// Whether a row's measure meets the bound; a measure that is undefined (NaN) does not.
    pub fn is_met(&self, value: f64, condition: f64) -> bool {
        let limits = [
            self.below,
            self.rounding
                .map(|multiple| multiple * f64::EPSILON * condition),
        ];
        let mut limits = limits.into_iter().flatten();
        limits.clone().next().is_some() && limits.all(|limit| value < limit)
    }

    /// What is bounded and how, whatever it is called and of whatever cells.
    pub(crate) fn limits(&self) -> (Measure, Option<f64>, Option<f64>) {
        (self.measure, self.below, self.rounding)
    }

    /// The bound as a table shows it.
    pub fn text(&self) -> String {
        let below = self.below.map(|limit| format!("< {}", number(limit)));
        match (below, self.rounding) {
            (Some(below), None) => below,
            (Some(below), Some(_)) => format!("= 0 up to rounding, and {below}"),
            (None, _) => "= 0".to_owned(),
        }
    }

    /// The figure's name in a table.
    pub fn label(&self) -> &str {
        self.label.as_deref().unwrap_or(self.measure.name())
    }
}

/// What `--quick` changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuickTable {
    /// Trials in each cell.
    pub trials: u64,
    /// Settings instead of the file's.
    #[serde(default)]
    pub settings: BTreeMap<Key, Axis>,
}
