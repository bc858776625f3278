//! A method under study: what it is called and how workers make their own copy of it.

use super::{Estimator, InstrumentalVariables, IvOptions, LeastSquares, SetupError, Shape, Solver};
use serde_json::{Value, json};

/// One line of a method's results: an estimator's name and the number of its pass.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Output {
    /// The estimator's name, such as "ls" or "iv".
    pub estimator: String,
    /// The number of the pass; 0 for a method without iterations.
    pub pass: usize,
}

/// Makes an estimator with buffers for a shape.
type Factory = dyn Fn(Shape) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync;

/// A method: the names of its outputs and a factory of estimators.
pub struct Method {
    outputs: Vec<Output>,
    options: Value,
    factory: Box<Factory>,
}

impl Method {
    /// A method of your own: `outputs` names what [`Estimator::estimate`] fills, in order.
    pub fn new(
        outputs: Vec<Output>,
        factory: impl Fn(Shape) -> Result<Box<dyn Estimator>, SetupError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            outputs,
            options: Value::Null,
            factory: Box::new(factory),
        }
    }

    /// Adds what a manifest should say of the method's options.
    #[must_use]
    pub fn with_options(mut self, options: Value) -> Self {
        self.options = options;
        self
    }

    /// Every setting, for a manifest.
    pub fn describe(&self) -> Value {
        json!({ "outputs": self.outputs, "options": self.options })
    }

    /// Least squares: one output, ("ls", 0).
    pub fn least_squares(solver: Solver) -> Self {
        let output = Output {
            estimator: "ls".to_owned(),
            pass: 0,
        };
        Self::new(vec![output], move |shape| {
            Ok(Box::new(LeastSquares::new(shape, solver)?))
        })
        .with_options(json!({ "solver": solver }))
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
        let described = json!(options);
        Self::new(outputs, move |shape| {
            Ok(Box::new(InstrumentalVariables::new(shape, &options)?))
        })
        .with_options(described)
    }

    /// What the method reports, in order.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// An estimator with buffers for a shape.
    ///
    /// # Errors
    /// If the method cannot serve the shape.
    pub fn prepare(&self, shape: Shape) -> Result<Box<dyn Estimator>, SetupError> {
        (self.factory)(shape)
    }
}
