//! A method of this crate as the registry sees it: its outputs, its needs, and how it is prepared.

use super::iv_options::IvOptions;
use super::known_model::KnownModel;
use super::option_error::OptionError;
use super::{Estimator, Runs, SetupError, Shape};
use crate::data::Process;
use crate::model::Orders;

/// One line of a method's results: the name of an estimator and the number of a pass.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Output {
    /// The estimator's name, such as "ls" or "iv".
    pub estimator: String,
    /// The number of the pass; 0 for a method without iterations.
    pub pass: usize,
}

impl Output {
    /// Returns the name, with the pass if it is not 0: "ls", "iv(4)".
    pub fn label(&self) -> String {
        match self.pass {
            0 => self.estimator.clone(),
            pass => format!("{}({pass})", self.estimator),
        }
    }
}

/// The problem that an estimator is prepared for.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The setting's order and the window.
    pub shape: Shape,
    /// The true model for a method that is given it, if all trials have the same one.
    pub known: Option<&'a KnownModel>,
    /// The process that draws the records and the noise level eta in per cent, for a method that may know them.
    pub process: Option<(&'a Process, f64)>,
    /// Whether standard errors are wanted from methods that can do without them.
    pub covariance: bool,
    /// The passes of which they are wanted; `None`: all.
    pub reported: Option<&'a [usize]>,
    /// The lengths of the records that follow each other in the window; empty: it is one record.
    pub runs: &'a [usize],
    /// Whether the model is the start of a search, which need not be right.
    pub is_start: bool,
}

impl Problem<'_> {
    /// Returns the records of the window.
    pub fn runs(&self) -> Runs {
        match self.runs {
            [] => Runs::new(&[self.shape.window]),
            lengths => Runs::new(lengths),
        }
    }
}

impl From<Shape> for Problem<'_> {
    fn from(shape: Shape) -> Self {
        Self {
            shape,
            known: None,
            process: None,
            covariance: false,
            reported: None,
            runs: &[],
            is_start: false,
        }
    }
}

/// The needs of a method besides a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// The true plant.
    pub plant: bool,
    /// A separate reference, which exists in feedback only: the key and value of the option that requires it.
    pub reference: Option<(&'static str, &'static str)>,
    /// The controller of the loop, for its option `controller`.
    pub controller: bool,
    /// A system in continuous time behind a hold.
    pub hold: bool,
}

/// The unit of the numbers among the options of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionUnits {
    /// No number has one, so u and y may each be seen in a unit of its own.
    None,
    /// The unit of y over the unit of u, as a controller has: u and y may be seen in a unit that they share.
    Gain,
    /// The unit of u or y, as a variance of noise has.
    Signals,
}

impl OptionUnits {
    /// Returns the unit, or none where no number was given.
    #[must_use]
    pub fn only_if(self, given: bool) -> Self {
        if given { self } else { Self::None }
    }
}

/// Defines the options of an estimator. A field that states no default has that of its type.
macro_rules! options {
    (
        $(#[$about:meta])*
        pub struct $name:ident {
            $($(#[$field_about:meta])* pub $field:ident: $type:ty $(= $default:expr)?,)*
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq)]
        #[cfg_attr(
            feature = "json",
            derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
            serde(deny_unknown_fields, default)
        )]
        pub struct $name {
            $($(#[$field_about])* pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $($field: $crate::estimator::method_kind::options!(@default $($default)?),)*
                }
            }
        }
    };
    (@default) => { Default::default() };
    (@default $default:expr) => { $default };
}
pub(super) use options;

/// The interface of an estimator's options to the registry. One struct with serde and docs yields the keys of
/// experiment files, their schema, the flags of `asobench estimate` and docs/methods.md.
pub trait MethodKind {
    /// Checks that the options are within their bounds and fit together.
    ///
    /// # Errors
    /// The key and what is wrong with it.
    fn check(&self) -> Result<(), OptionError> {
        Ok(())
    }

    /// Returns the outputs of a method with this name; by default one, pass 0.
    fn outputs(&self, name: &str) -> Vec<Output> {
        vec![Output {
            estimator: name.to_owned(),
            pass: 0,
        }]
    }

    /// Returns the orders of the estimator's models for a value of the setting `order`. `None`: the paper's form of
    /// that order.
    fn model_orders(&self, _setting: usize) -> Option<Orders> {
        None
    }

    /// Returns the orders that the option `orders` has if it is not given; those of the models, where it counts their
    /// coefficients.
    fn default_orders(&self, setting: usize) -> Option<Orders> {
        self.model_orders(setting)
    }

    /// Returns what the estimator needs of a cell.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// Returns the unit of the numbers among the options.
    fn option_units(&self) -> OptionUnits {
        OptionUnits::None
    }

    /// Whether the signals before the record are taken as zero.
    fn begins_at_rest(&self) -> bool {
        false
    }

    /// Whether one model can be fitted to several records ([`Problem::runs`]).
    fn takes_runs(&self) -> bool {
        false
    }

    /// Returns an estimator with buffers for a problem.
    ///
    /// # Errors
    /// If the estimator cannot serve the problem.
    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError>;

    /// Whether the estimator implements [`Estimator::run_along`].
    fn runs_along(&self) -> bool {
        false
    }

    /// Returns the options in the form that lanes run, that of IV passes. `None`: lanes do not have the estimator.
    ///
    /// An implementation must destructure all options (no `..`) and name the values that lanes support, so that a new
    /// value runs on the scalar engine.
    ///
    /// # Errors
    /// The option that lanes do not support, in words.
    fn in_lanes(&self) -> Option<Result<IvOptions, String>> {
        None
    }
}
