//! The rule for the number of trials: a number, or until a measure is known well enough or a claim is decided.

use crate::design::Measure;
use asobench_identification::names::named_enum;
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
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Until {
    /// The measure.
    pub until: Measure,
    /// The output, such as "iv(4)".
    pub output: String,
    /// The statistic.
    #[schemars(default)]
    pub statistic: UntilStatistic,
    /// The target: standard error over value.
    pub relative_mcse: f64,
    /// The fewest trials.
    pub minimum: u64,
    /// The most trials.
    pub maximum: u64,
}

/// Trials until a claim of the file is decided. Their number is `minimum` in every cell, doubled until
/// the claim holds or does not, or `maximum` is reached. Every look uses an equal share of the claim's level.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct UntilDecided {
    /// The claim's id.
    #[serde(rename = "until")]
    pub claim: String,
    /// The fewest trials.
    pub minimum: u64,
    /// The most trials.
    pub maximum: u64,
}

impl UntilDecided {
    /// Returns the number of trials that follows this one.
    pub fn next(&self, trials: u64) -> u64 {
        trials.saturating_mul(2).min(self.maximum)
    }
}

/// How many trials each cell has.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TrialRule {
    /// A number.
    Fixed(u64),
    /// Until a target is met.
    Until(Until),
    /// Until a claim is decided.
    Decided(UntilDecided),
}

/// A rule as it is written in a file; `until` tells which kind it is.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    until: String,
    output: Option<String>,
    statistic: Option<UntilStatistic>,
    relative_mcse: Option<f64>,
    minimum: u64,
    maximum: u64,
}

impl Written {
    fn rule<E: Error>(self) -> Result<TrialRule, E> {
        let (minimum, maximum) = (self.minimum, self.maximum);
        let of_claim = self.output.is_none() && self.statistic.is_none() && self.relative_mcse.is_none();
        match self.until.parse::<Measure>() {
            Ok(until) => Ok(TrialRule::Until(Until {
                until,
                output: self.output.ok_or_else(|| E::missing_field("output"))?,
                statistic: self.statistic.unwrap_or_default(),
                relative_mcse: self.relative_mcse.ok_or_else(|| E::missing_field("relative_mcse"))?,
                minimum,
                maximum,
            })),
            Err(_) if of_claim => Ok(TrialRule::Decided(UntilDecided {
                claim: self.until,
                minimum,
                maximum,
            })),
            Err(unknown) => Err(E::custom(unknown)),
        }
    }
}

/// The largest number of trials of a cell.
pub const TRIAL_LIMIT: u64 = 4_000_000_000;

impl TrialRule {
    /// Returns the fewest and the most trials of a cell.
    pub fn extent(&self) -> (u64, u64) {
        match self {
            Self::Fixed(trials) => (*trials, *trials),
            Self::Until(until) => (until.minimum, until.maximum),
            Self::Decided(until) => (until.minimum, until.maximum),
        }
    }

    /// Returns at how many numbers of trials the rule may stop.
    pub fn looks(&self) -> u32 {
        let (minimum, maximum) = self.extent();
        let mut trials = minimum.max(1);
        let mut looks = 1;
        while trials < maximum {
            trials = trials.saturating_mul(2).min(maximum);
            looks += 1;
        }
        looks
    }

    /// Returns what is wrong with the rule, if anything.
    pub fn fault(&self) -> Option<String> {
        let (minimum, maximum) = self.extent();
        if ![minimum, maximum].iter().all(|count| (1..=TRIAL_LIMIT).contains(count)) {
            return Some(format!("must be 1 to {TRIAL_LIMIT}"));
        }
        match self {
            _ if minimum > maximum => Some("'minimum' is above 'maximum'".to_owned()),
            Self::Until(until) if !(until.relative_mcse > 0.0) => Some("'relative_mcse' must be above 0".to_owned()),
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
        Written::deserialize(MapAccessDeserializer::new(map))?.rule()
    }
}

impl<'de> Deserialize<'de> for TrialRule {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RuleVisitor)
    }
}
