//! A method under study: what it is called and how workers make their own copy of it.

use super::{
    Estimator, InstrumentalVariables, IvOptions, LeastSquares, LsOptions, SetupError, Shape,
};
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
type Factory = dyn Fn(Shape) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync;

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
    Own(Box<Factory>),
}

/// The choices of a method of this crate.
#[derive(Clone, Debug, PartialEq)]
pub enum MethodOptions {
    /// Of [`LeastSquares`].
    LeastSquares(LsOptions),
    /// Of [`InstrumentalVariables`].
    InstrumentalVariables(IvOptions),
    /// None: [`super::KnownModel`], which is made of a plant, not by [`Method::prepare`].
    Known,
}

impl Method {
    /// A method of your own: `outputs` names what [`Estimator::estimate`] fills, in order.
    pub fn new(
        outputs: Vec<Output>,
        factory: impl Fn(Shape) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync + 'static,
    ) -> Self {
        Self::of(outputs, Maker::Own(Box::new(factory)))
    }

    fn of(outputs: Vec<Output>, maker: Maker) -> Self {
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
        let output = Output {
            estimator: "known".to_owned(),
            pass: 0,
        };
        Self::of(vec![output], Maker::Options(MethodOptions::Known))
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
        let output = Output {
            estimator: "ls".to_owned(),
            pass: 0,
        };
        let options = MethodOptions::LeastSquares(options);
        Self::of(vec![output], Maker::Options(options))
    }

    /// Instrumental variables with its iteration 0: ("ls", 0), ("iv", 1), ("iv", 2), ...
    pub fn instrumental_variables(options: IvOptions) -> Self {
        let name = |pass| if pass == 0 { "ls" } else { "iv" };
        let outputs = (0..=options.iterations)
            .map(|pass| Output {
                estimator: name(pass).to_owned(),
                pass,
            })
            .collect();
        let options = MethodOptions::InstrumentalVariables(options);
        Self::of(outputs, Maker::Options(options))
    }

    /// Gives every output another name; "iv" and "ls" leave what is so called, with iteration 0 as "ls".
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        if !matches!(name, "iv" | "ls") {
            for output in &mut self.outputs {
                name.clone_into(&mut output.estimator);
            }
        }
        self
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

    /// An estimator with buffers for a shape.
    ///
    /// # Errors
    /// If the method cannot serve the shape, or needs a plant ([`SetupError::NoKnownPlant`]).
    pub fn prepare(&self, shape: Shape) -> Result<Box<dyn Estimator>, SetupError> {
        match &self.maker {
            Maker::Own(factory) => factory(shape),
            Maker::Options(MethodOptions::LeastSquares(options)) => {
                let estimator = LeastSquares::new(shape, options.solver)?;
                Ok(Box::new(estimator.with_start(options.initial_state)))
            }
            Maker::Options(MethodOptions::InstrumentalVariables(options)) => {
                Ok(Box::new(InstrumentalVariables::new(shape, options)?))
            }
            Maker::Options(MethodOptions::Known) => Err(SetupError::NoKnownPlant),
        }
    }

    /// The choices, where the method is one of this crate.
    pub fn options(&self) -> Option<&MethodOptions> {
        match &self.maker {
            Maker::Own(_) => None,
            Maker::Options(options) => Some(options),
        }
    }
}
