//! State feedback from the adaptive observer: `u(k) = -k' xhat(k) + r(k)`, claim C7.

use asobench_identification::data::{ControlLaw, Controller, DrawFailure, History, Truth};
use asobench_identification::estimator::{Estimator, Failure, LeastSquares, Pass, SetupError, Shape, Solver, Window};
use asobench_identification::names::named_enum;
use asobench_identification::observer::{Gain, ObservedModel, Observer};
use serde_json::json;

named_enum! {
    /// The model of the observer in the loop.
    LoopModel, "model of a state feedback" {
        /// Identified by least squares on the samples in open loop, without noise filter.
        Identified = "identified",
        /// The plant itself and its initial state, for comparison.
        True = "true",
    }
}

/// The settings of the state feedback. The loop is open (u = r) for k < N1. Then least squares on these N1 samples
/// identifies (a, b, x0), or these are the plant's own, and the observer runs over the samples from x0. From k = N1 on
/// `u(k) = -k' xhat(k) + r(k)`. The model is not updated; xhat(k) uses y up to k - 1.
#[derive(Clone, Debug, PartialEq)]
pub struct StateFeedback {
    /// The feedback k, n numbers; n is also the order of the model.
    pub k: Vec<f64>,
    /// N1, samples in open loop.
    pub pilot: usize,
    /// Where the observer's model comes from.
    pub model: LoopModel,
    /// The gain of the observer in the loop.
    pub gain: Gain,
    /// The solver of the identification.
    pub solver: Solver,
}

impl StateFeedback {
    /// Returns the law for [`asobench_identification::data::Feedback::Controlled`].
    ///
    /// # Errors
    /// If N1 is below 3n, k is empty, or gain or solver do not fit.
    ///
    /// # Panics
    /// Never: the settings are checked first.
    pub fn law(&self) -> Result<ControlLaw, SetupError> {
        Adaptive::new(self)?;
        let description = json!({
            "state_feedback": {
                "k": self.k, "model": self.model, "gain": self.gain, "solver": self.solver,
            }
        });
        let settings = self.clone();
        Ok(ControlLaw::new(self.pilot, description, move || {
            Box::new(Adaptive::new(&settings).expect("the settings were checked"))
        }))
    }
}

/// The model of the current trial.
enum Model {
    Identified {
        estimator: Box<LeastSquares>,
        pass: Box<Pass>,
    },
    True(Truth),
}

impl Model {
    fn observed(&self) -> Option<ObservedModel<'_>> {
        match self {
            Self::Identified { pass, .. } => pass.observed(),
            Self::True(Truth { a, b, x0, .. }) => Some(ObservedModel { a, b, x0 }),
        }
    }
}

/// The controller.
struct Adaptive {
    k: Vec<f64>,
    model: Model,
    observer: Observer,
    /// Whether the loop is closed.
    closed: bool,
}

impl Adaptive {
    pub(crate) fn new(settings: &StateFeedback) -> Result<Self, SetupError> {
        let shape = Shape {
            order: settings.k.len(),
            window: settings.pilot,
        };
        settings.gain.check(shape.order)?;
        let model = match settings.model {
            LoopModel::Identified => Model::Identified {
                estimator: Box::new(LeastSquares::new(shape, settings.solver)?),
                pass: Box::new(Pass::new(shape.order)),
            },
            LoopModel::True => Model::True(Truth::default()),
        };
        Ok(Self {
            k: settings.k.clone(),
            model,
            closed: false,
            observer: Observer::new(settings.gain.clone(), shape.order),
        })
    }

    /// Identifies the model from the open-loop part, unless it is known, and computes xhat(N1).
    fn close(&mut self, u: &[f64], y: &[f64]) -> Result<(), DrawFailure> {
        if let Model::Identified { estimator, pass } = &mut self.model {
            let window = Window::new(u, y, u.len());
            estimator.estimate(window, std::slice::from_mut(&mut **pass));
            if let Some(Failure { kind, .. }) = pass.failure {
                return Err(kind.into());
            }
        }
        let model = self.model.observed().ok_or(DrawFailure::NonFinite)?;
        self.observer.run(model, u, y, |_, _| {})?;
        self.closed = true;
        Ok(())
    }
}

impl Controller for Adaptive {
    fn reset(&mut self, truth: &Truth) {
        self.closed = false;
        match &mut self.model {
            Model::Identified { pass, .. } => pass.clear(),
            Model::True(model) => model.clone_from(truth),
        }
    }

    fn control(&mut self, history: History<'_>) -> Result<f64, DrawFailure> {
        let (k, History { r, u, y }) = (history.k(), history);
        match self.model.observed() {
            Some(model) if self.closed => self.observer.advance(model, u[k - 1], y[k - 1]),
            _ => self.close(u, &y[..k])?,
        }
        let mut input = r[k];
        for (gain, x) in self.k.iter().zip(self.observer.state()) {
            input = (-gain).mul_add(*x, input);
        }
        Ok(input)
    }

    fn estimate(&self) -> &[f64] {
        self.observer.state()
    }
}
