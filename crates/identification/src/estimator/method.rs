//! A method under study: its name, and how workers make their own copy of it.

use super::scale::Scaled;
use super::{
    Estimator, IvOptions, KnownModel, KnownOptions, LsOptions, MethodOptions, SetupError, Shape,
};
use crate::data::Process;
use crate::model::Orders;
use crate::observer::ObserverKind;

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

/// Makes an estimator with buffers for a shape.
type Factory = dyn Fn(&Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync;

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
}

impl From<Shape> for Problem<'_> {
    fn from(shape: Shape) -> Self {
        Self {
            shape,
            known: None,
            process: None,
            covariance: false,
        }
    }
}

/// What a method needs of a cell besides a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// The true plant.
    pub plant: bool,
    /// A separate reference, which exists in feedback only: the key and value of the option that requires it.
    pub reference: Option<(&'static str, &'static str)>,
}

/// An error in an option.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", .key.as_ref().map_or_else(String::new, |key| format!("{key}: ")))]
pub struct OptionError {
    /// The option's key; `None` if the message names it.
    pub key: Option<String>,
    /// What is wrong and what was expected.
    pub message: String,
}

impl OptionError {
    /// Makes the error of a key.
    pub fn new(key: &str, message: impl Into<String>) -> Self {
        Self {
            key: Some(key.to_owned()),
            message: message.into(),
        }
    }
}

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

    /// Returns what the estimator needs of a cell.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// Returns an estimator with buffers for a problem.
    ///
    /// # Errors
    /// If the estimator cannot serve the problem.
    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError>;

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

/// A method: the names of its outputs and a factory of estimators.
pub struct Method {
    outputs: Vec<Output>,
    /// The passes that are reported, ascending.
    reported: Vec<usize>,
    passes: usize,
    maker: Maker,
    /// The observer of the outputs; `None`: one with the setting's gain.
    observer: Option<ObserverKind>,
}

/// The source of a method's estimators.
enum Maker {
    Options(MethodOptions),
    Own {
        /// `None` for a program, which the experiment file identifies.
        identity: Option<String>,
        /// The orders of the method's models; `None`: the setting's.
        orders: Option<Orders>,
        factory: Box<Factory>,
    },
}

impl Method {
    /// Makes a method of your own; `outputs` names what [`Estimator::estimate`] fills, in order.
    ///
    /// `identity` distinguishes it from other methods and from its own earlier versions: a name, a version, and every
    /// option. It is part of the design's fingerprint, so results of another identity are never reused.
    pub fn new(
        identity: impl Into<String>,
        outputs: Vec<Output>,
        factory: impl Fn(Shape) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync + 'static,
    ) -> Self {
        Self::own(Some(identity.into()), outputs, None, move |of| {
            factory(of.shape)
        })
    }

    /// Makes a method of your own with one output. Its name and version identify it, as `identity` does in
    /// [`Self::new`].
    pub fn single(
        name: &str,
        version: &str,
        factory: impl Fn(Shape) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync + 'static,
    ) -> Self {
        let output = Output {
            estimator: name.to_owned(),
            pass: 0,
        };
        Self::new(format!("{name} {version}"), vec![output], factory)
    }

    /// Does the same as [`Self::new`] for models of given orders; the factory gets all that is known of the problem.
    pub fn own(
        identity: Option<String>,
        outputs: Vec<Output>,
        orders: Option<Orders>,
        factory: impl Fn(&Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync + 'static,
    ) -> Self {
        let maker = Maker::Own {
            identity,
            orders,
            factory: Box::new(factory),
        };
        Self::from_maker(outputs, maker)
    }

    /// Makes a method of this crate, with this name in the results.
    pub fn named(name: &str, options: impl Into<MethodOptions>) -> Self {
        let options = options.into();
        Self::from_maker(options.outputs(name), Maker::Options(options))
    }

    fn from_maker(outputs: Vec<Output>, maker: Maker) -> Self {
        Self {
            reported: (0..outputs.len()).collect(),
            passes: outputs.len(),
            outputs,
            maker,
            observer: None,
        }
    }

    /// Makes the method that returns the true plant: one output, ("known", 0).
    pub fn known() -> Self {
        Self::named("known", KnownOptions {})
    }

    /// Uses `observer` for the outputs instead of one with the setting's gain.
    #[must_use]
    pub fn observed_by(mut self, observer: ObserverKind) -> Self {
        self.observer = Some(observer);
        self
    }

    /// Returns the method's own observer, if it has one.
    pub fn observer(&self) -> Option<&ObserverKind> {
        self.observer.as_ref()
    }

    /// Makes least squares: one output, ("ls", 0).
    pub fn least_squares(options: LsOptions) -> Self {
        Self::named("ls", options)
    }

    /// Makes instrumental variables with iteration 0: ("ls", 0), ("iv", 1), ("iv", 2), ...
    pub fn instrumental_variables(options: IvOptions) -> Self {
        Self::named("iv", options)
    }

    /// Reports only the given passes.
    ///
    /// # Errors
    /// The first pass that the method does not have.
    pub fn reporting(mut self, passes: &[usize]) -> Result<Self, usize> {
        if let Some(beyond) = passes.iter().find(|pass| **pass >= self.passes) {
            return Err(*beyond);
        }
        self.reported.retain(|pass| passes.contains(pass));
        self.outputs = self
            .reported
            .iter()
            .map(|pass| self.outputs[*pass].clone())
            .collect();
        Ok(self)
    }

    /// Returns the reported outputs, in order.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// Returns the numbers of the reported passes, one per output.
    pub fn reported(&self) -> &[usize] {
        &self.reported
    }

    /// Returns how many passes [`Estimator::estimate`] fills.
    pub fn passes(&self) -> usize {
        self.passes
    }

    /// Returns an estimator with buffers for a problem, or for a shape alone.
    ///
    /// # Errors
    /// If the method cannot serve the problem, or needs a plant ([`SetupError::NoKnownPlant`]).
    pub fn prepare<'a>(
        &self,
        problem: impl Into<Problem<'a>>,
    ) -> Result<Box<dyn Estimator>, SetupError> {
        let problem = problem.into();
        match &self.maker {
            Maker::Own { factory, .. } => factory(&problem),
            Maker::Options(options) => Ok(Box::new(Scaled::new(options.prepare(&problem)?))),
        }
    }

    /// Returns the order of the method's models for a value of the setting `order`.
    pub fn order(&self, setting: usize) -> usize {
        match &self.maker {
            Maker::Own { orders, .. } => orders.map_or(setting, Orders::order),
            Maker::Options(options) => options.order(setting),
        }
    }

    /// Returns what the method needs of a cell.
    pub fn needs(&self) -> Needs {
        self.options().map(MethodOptions::needs).unwrap_or_default()
    }

    /// Returns the options if the method is one of this crate.
    pub fn options(&self) -> Option<&MethodOptions> {
        match &self.maker {
            Maker::Own { .. } => None,
            Maker::Options(options) => Some(options),
        }
    }

    /// Returns the identity of a method of your own.
    pub fn identity(&self) -> Option<&str> {
        match &self.maker {
            Maker::Own { identity, .. } => identity.as_deref(),
            Maker::Options(_) => None,
        }
    }
}
