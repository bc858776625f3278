//! A method under study: its name, and how workers make their own copy of it.

use super::iv_options::IvOptions;
use super::kinship::Kinship;
use super::last_samples::LastSamples;
use super::method_kind::{Needs, Output, Problem};
use super::methods::{KnownOptions, LsOptions, MethodOptions};
use super::scale::Scaled;
use super::{Estimator, Pass, SetupError, Shape, Window};
use crate::model::Orders;
use crate::observer::ObserverKind;

/// Makes an estimator with buffers for a shape.
type Factory = dyn Fn(&Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync;

/// A method: the names of its outputs and a factory of estimators.
pub struct Method {
    outputs: Vec<Output>,
    /// The passes that are reported, ascending.
    reported: Vec<usize>,
    passes: usize,
    maker: Maker,
    /// The observer of the outputs; `None`: one with the setting's gain.
    observer: Option<ObserverKind>,
    /// The method sees so many of the last samples; `None`: all of the window.
    last: Option<usize>,
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
        Self::own(Some(identity.into()), outputs, None, move |of| factory(of.shape))
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
            last: None,
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

    /// Uses the last `samples` of the window alone; x0 is not estimated then but taken as 0.
    #[must_use]
    pub fn on_last(mut self, samples: usize) -> Self {
        self.last = Some(samples);
        self
    }

    /// Returns how many of the last samples the method uses, if not all.
    pub fn last(&self) -> Option<usize> {
        self.last
    }

    /// Whether its estimator takes a record sample by sample, [`Estimator::run_along`].
    pub fn runs_along(&self) -> bool {
        self.last.is_none() && self.options().is_some_and(MethodOptions::runs_along)
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
        self.outputs = self.reported.iter().map(|pass| self.outputs[*pass].clone()).collect();
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
    pub fn prepare<'a>(&self, problem: impl Into<Problem<'a>>) -> Result<Box<dyn Estimator>, SetupError> {
        let mut problem = Problem {
            reported: Some(&self.reported),
            ..problem.into()
        };
        if let Some(last) = self.last {
            problem.shape.window = problem.shape.window.min(last);
        }
        let made: Box<dyn Estimator> = match &self.maker {
            Maker::Own { factory, .. } => factory(&problem)?,
            Maker::Options(options) => Box::new(Scaled::new(options.prepare(&problem)?, options.option_units())),
        };
        Ok(match self.last {
            None => made,
            Some(samples) => Box::new(LastSamples::new(made, samples)),
        })
    }

    /// Estimates once from a record, or from several that follow each other with these lengths: a pass for each of
    /// [`Self::passes`]. `errors`: whether standard errors are wanted from methods that can do without them.
    ///
    /// # Errors
    /// As [`Self::prepare`].
    pub fn estimate_once(
        &self,
        order: usize,
        lengths: &[usize],
        window: Window<'_>,
        errors: bool,
    ) -> Result<Vec<Pass>, SetupError> {
        let shape = Shape {
            order,
            window: window.len(),
        };
        let problem = Problem {
            covariance: errors,
            runs: lengths,
            ..shape.into()
        };
        let mut passes = vec![Pass::new(order); self.passes];
        self.prepare(problem)?.estimate(window, &mut passes);
        Ok(passes)
    }

    /// Returns what the method has in common with an earlier one that estimates the same window, if it saves work.
    /// `errors`: whether standard errors are wanted from methods that can do without them.
    pub fn kinship(&self, earlier: &Self, errors: bool) -> Option<Kinship> {
        let whole = self.last.is_none() && earlier.last.is_none();
        let found = Kinship::between(earlier.options()?, self.options()?, errors)?;
        // Standard errors are of the reported passes alone.
        let reported = !errors || self.reported == earlier.reported;
        match found {
            Kinship::Passes { .. } => whole.then_some(found),
            Kinship::Covariance(_) => (whole && reported).then_some(found),
            Kinship::Same => (reported && self.last == earlier.last).then_some(found),
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
