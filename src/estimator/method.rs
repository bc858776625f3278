//! A method under study: what it is called and how workers make their own copy of it.

use super::{
    Estimator, IvOptions, KnownModel, KnownOptions, LsOptions, MethodOptions, SetupError, Shape,
};
use crate::data::Process;
use crate::model::Orders;
use crate::observer::ObserverKind;

/// One line of a method's results: an estimator's name and the number of its pass.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Output {
    /// The estimator's name, such as "ls" or "iv".
    pub estimator: String,
    /// The number of the pass; 0 for a method without iterations.
    pub pass: usize,
}

impl Output {
    /// "ls", "iv(4)": the name, with the pass where it is not 0.
    pub fn label(&self) -> String {
        match self.pass {
            0 => self.estimator.clone(),
            pass => format!("{}({pass})", self.estimator),
        }
    }
}

/// Makes an estimator with buffers for a shape.
type Factory = dyn Fn(&Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync;

/// What an estimator is prepared for.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The setting's order and the window.
    pub shape: Shape,
    /// The model that a method with the true plant is given, where there is one for all trials.
    pub known: Option<&'a KnownModel>,
    /// What draws the records, with the noise level eta in per cent: for a method that may be told of it.
    pub process: Option<(&'a Process, f64)>,
    /// Whether standard errors are wanted of methods that can do without.
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

/// What a method needs of a cell beside a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// The true plant.
    pub plant: bool,
    /// A reference of its own, which only feedback has; the key and value of the option that asks for it.
    pub reference: Option<(&'static str, &'static str)>,
}

/// What is wrong with an option.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", .key.as_ref().map_or_else(String::new, |key| format!("{key}: ")))]
pub struct OptionError {
    /// Its key; `None` where the message names it.
    pub key: Option<String>,
    /// What is wrong, and what was expected.
    pub message: String,
}

impl OptionError {
    /// Of a key.
    pub fn new(key: &str, message: impl Into<String>) -> Self {
        Self {
            key: Some(key.to_owned()),
            message: message.into(),
        }
    }
}

/// What the registry asks of an estimator's options. One struct with serde and docs: keys of experiment files, their
/// schema, flags of `asobench estimate` and docs/methods.md follow from it.
pub trait MethodKind {
    /// Whether the options are within their bounds and fit each other.
    ///
    /// # Errors
    /// The key, and what is wrong with it.
    fn check(&self) -> Result<(), OptionError> {
        Ok(())
    }

    /// The outputs, of a method with this name: one, pass 0.
    fn outputs(&self, name: &str) -> Vec<Output> {
        vec![Output {
            estimator: name.to_owned(),
            pass: 0,
        }]
    }

    /// The orders of its models, where the setting `order` is so large; `None`: the paper's form of that order.
    fn model_orders(&self, _setting: usize) -> Option<Orders> {
        None
    }

    /// What it needs of a cell.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// An estimator with buffers for a problem.
    ///
    /// # Errors
    /// If it cannot serve it.
    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError>;

    /// The options as lanes run them, as those of IV passes; `None`: no lanes have the estimator. It must take every
    /// option apart (no `..`) and name the values that lanes have, so that a new one runs on the scalar engine.
    ///
    /// # Errors
    /// What of the options lanes do not have, in words.
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
    /// The observer of its outputs; `None`: with the setting's gain.
    observer: Option<ObserverKind>,
}

/// Where a method's estimators come from.
enum Maker {
    Options(MethodOptions),
    Own {
        /// `None` of a program, which the experiment file tells of.
        identity: Option<String>,
        /// The orders of its models; `None`: the setting's.
        orders: Option<Orders>,
        factory: Box<Factory>,
    },
}

impl Method {
    /// A method of your own: `outputs` names what [`Estimator::estimate`] fills, in order.
    ///
    /// `identity` is what tells it from others and from its own earlier versions: a name, a version, and every option.
    /// It is part of the design's fingerprint, so that results of another identity are never taken up.
    pub fn new(
        identity: impl Into<String>,
        outputs: Vec<Output>,
        factory: impl Fn(Shape) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync + 'static,
    ) -> Self {
        Self::own(Some(identity.into()), outputs, None, move |of| {
            factory(of.shape)
        })
    }

    /// A method of your own with one output. Its name and version tell it from others, as `identity` does in
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

    /// The same as [`Self::new`], of models of certain orders, made for a problem with all that is known of it.
    pub(crate) fn own(
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

    /// A method of this crate, with this name in the results.
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

    /// The true plant: one output, ("known", 0).
    pub fn known() -> Self {
        Self::named("known", KnownOptions {})
    }

    /// Has its outputs observed by an observer of its own, whatever gain the setting says.
    #[must_use]
    pub fn observed_by(mut self, observer: ObserverKind) -> Self {
        self.observer = Some(observer);
        self
    }

    /// The observer of its own, if it has one.
    pub fn observer(&self) -> Option<&ObserverKind> {
        self.observer.as_ref()
    }

    /// Least squares: one output, ("ls", 0).
    pub fn least_squares(options: LsOptions) -> Self {
        Self::named("ls", options)
    }

    /// Instrumental variables with its iteration 0: ("ls", 0), ("iv", 1), ("iv", 2), ...
    pub fn instrumental_variables(options: IvOptions) -> Self {
        Self::named("iv", options)
    }

    /// Reports only some passes.
    ///
    /// # Errors
    /// The pass that the method does not have.
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

    /// What the method reports, in order.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// The numbers of the passes that are reported, one per output.
    pub fn reported(&self) -> &[usize] {
        &self.reported
    }

    /// How many passes [`Estimator::estimate`] fills.
    pub fn passes(&self) -> usize {
        self.passes
    }

    /// An estimator with buffers for a problem, or for a shape alone.
    ///
    /// # Errors
    /// If the method cannot serve it, or needs a plant ([`SetupError::NoKnownPlant`]).
    pub fn prepare<'a>(
        &self,
        problem: impl Into<Problem<'a>>,
    ) -> Result<Box<dyn Estimator>, SetupError> {
        let problem = problem.into();
        match &self.maker {
            Maker::Own { factory, .. } => factory(&problem),
            Maker::Options(options) => options.prepare(&problem),
        }
    }

    /// The order of the models that it makes where the setting `order` says another one.
    pub fn order(&self, setting: usize) -> usize {
        match &self.maker {
            Maker::Own { orders, .. } => orders.map_or(setting, Orders::order),
            Maker::Options(options) => options.order(setting),
        }
    }

    /// What it needs of a cell.
    pub fn needs(&self) -> Needs {
        self.options().map(MethodOptions::needs).unwrap_or_default()
    }

    /// The choices, where the method is one of this crate.
    pub fn options(&self) -> Option<&MethodOptions> {
        match &self.maker {
            Maker::Own { .. } => None,
            Maker::Options(options) => Some(options),
        }
    }

    /// The identity of a method of your own.
    pub fn identity(&self) -> Option<&str> {
        match &self.maker {
            Maker::Own { identity, .. } => identity.as_deref(),
            Maker::Options(_) => None,
        }
    }
}
