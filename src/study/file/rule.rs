//! How many trials: a number, or until a measure is known well enough.

use super::super::measure::Measure;
use crate::names::named_enum;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

named_enum! {
    /// Which statistic a rule looks at.
    UntilStatistic, "statistic" {
        /// The median (the default).
        Median = "median",
        /// The mean.
        Mean = "mean",
        /// The root mean square.
        Rmse = "rmse",
    }
}

/// Trials until the Monte-Carlo standard error of a measure is small enough in a cell. The number is
/// `minimum`, doubled until the target is met or `maximum` reached, so that it does not depend on the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Until {
    /// The measure.
    pub until: Measure,
    /// The output, such as "iv(4)".
    pub output: String,
    /// The statistic.
    #[serde(default)]
    pub statistic: UntilStatistic,
    /// The target: standard error over value.
    pub relative_mcse: f64,
    /// The fewest trials.
    pub minimum: u64,
    /// The most trials.
    pub maximum: u64,
}

/// How many trials each cell has.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TrialRule {
    /// A number.
    Fixed(u64),
    /// Until a target is met.
    Until(Until),
}

/// The most trials of a cell.
pub const TRIAL_LIMIT: u64 = 4_000_000_000;

impl TrialRule {
    /// The fewest and the most trials of a cell.
    pub fn extent(&self) -> (u64, u64) {
        match self {
            Self::Fixed(trials) => (*trials, *trials),
            Self::Until(until) => (until.minimum, until.maximum),
        }
    }

    /// What is wrong with the rule, if anything is.
    pub fn fault(&self) -> Option<String> {
        let counts: &[u64] = match self {
            Self::Fixed(count) => &[*count],
            Self::Until(until) => &[until.minimum, until.maximum],
        };
        if !counts.iter().all(|count| (1..=TRIAL_LIMIT).contains(count)) {
            return Some(format!("must be 1 to {TRIAL_LIMIT}"));
        }
        match self {
            Self::Until(until) if until.minimum > until.maximum => {
                Some("'minimum' is above 'maximum'".to_owned())
            }
            Self::Until(until) if !(until.relative_mcse > 0.0) => {
                Some("'relative_mcse' must be above 0".to_owned())
            }
            _ => None,
        }
    }
}

struct RuleVisitor;

impl<'de> Visitor<'de> for RuleVisitor {
    type Value = TrialRule;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a whole number of trials, or a table { until = ..., ... }")
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<TrialRule, E> {
        Ok(TrialRule::Fixed(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<TrialRule, E> {
        let count = u64::try_from(value);
        count
            .map(TrialRule::Fixed)
            .map_err(|_| E::custom(format!("{value} trials; expected at least 1")))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TrialRule, A::Error> {
        Until::deserialize(MapAccessDeserializer::new(map)).map(TrialRule::Until)
    }
}

impl<'de> Deserialize<'de> for TrialRule {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RuleVisitor)
    }
}
