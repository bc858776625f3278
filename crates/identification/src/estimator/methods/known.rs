//! The true plant instead of an estimate: what observers achieve if they know it.

use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Problem};
use crate::estimator::{Estimator, SetupError};

/// The options of `known`: none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "json",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(deny_unknown_fields)
)]
pub struct KnownOptions {}

impl MethodKind for KnownOptions {
    fn needs(&self) -> Needs {
        Needs {
            plant: true,
            ..Needs::default()
        }
    }

    fn option_units(&self) -> OptionUnits {
        OptionUnits::Signals
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let known = problem.known.ok_or(SetupError::NoKnownPlant)?;
        Ok(Box::new(known.clone()))
    }
}
