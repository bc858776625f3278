//! State feedback from the adaptive observer: `u(k) = -k' xhat(k) + r(k)`, claim C7.

use crate::data::{ControlLaw, Controller, DrawFailure, History};
use crate::estimator::{Estimator, Failure, LeastSquares, Pass, SetupError, Shape, Solver, Window};
use crate::observer::{Gain, Observer};
use serde_json::json;

/// The settings of the state feedback. The loop is open (u = r) for k < N1. Then least squares on these N1 samples
/// identifies (a, b, x0), and the observer runs over them from x0. From k = N1 on `u(k) = -k' xhat(k) + r(k)`. The
/// model is not updated; xhat(k) uses y up to k - 1.
#[derive(Clone, Debug, PartialEq)]
pub struct StateFeedback {
    /// The feedback k, n numbers; n is also the order of the model.
    pub k: Vec<f64>,
    /// N1, samples in open loop.
    pub pilot: usize,
    /// The gain of the observer in the loop.
    pub gain: Gain,
    /// The solver of the identification.
    pub solver: Solver,
}

impl StateFeedback {
    /// Returns the law for [`crate::data::Feedback::Controlled`].
    ///
    /// # Errors
    /// If N1 is below 3n, k is empty, or gain or solver do not fit.
    ///
    /// # Panics
    /// Never: the settings are checked first.
    pub fn law(&self) -> Result<ControlLaw, SetupError> {
        Adaptive::new(self)?;
        let description = json!({
            "state_feedback": { "k": self.k, "gain": self.gain, "solver": self.solver }
        });
        let settings = self.clone();
        Ok(ControlLaw::new(self.pilot, description, move || {
            Box::new(Adaptive::new(&settings).expect("the settings were checked"))
        }))
    }
}

/// The controller, with the model of the current trial.
struct Adaptive {
    k: Vec<f64>,
    pilot: usize,
    estimator: LeastSquares,
    model: Pass,
    observer: Observer,
}

impl Adaptive {
    fn new(settings: &StateFeedback) -> Result<Self, SetupError> {
        let shape = Shape {
            order: settings.k.len(),
            window: settings.pilot,
        };
        settings.gain.check(shape.order)?;
        Ok(Self {
            k: settings.k.clone(),
            pilot: settings.pilot,
            estimator: LeastSquares::new(shape, settings.solver)?,
            model: Pass::new(shape.order),
            observer: Observer::new(settings.gain.clone(), shape.order),
        })
    }

    /// Identifies the model from the open-loop part, and computes xhat(N1).
    fn identify(&mut self, u: &[f64], y: &[f64]) -> Result<(), DrawFailure> {
        let window = Window::new(u, y, self.pilot);
        let passes = std::slice::from_mut(&mut self.model);
        self.estimator.estimate(window, passes);
        if let Some(Failure { kind, .. }) = self.model.failure {
            return Err(kind.into());
        }
        let model = self.model.observed().ok_or(DrawFailure::NonFinite)?;
        let run = self.observer.run(model, u, y, |_, _| {});
        run.map_err(DrawFailure::from)
    }
}

impl Controller for Adaptive {
    fn reset(&mut self) {
        self.model.clear();
    }

    fn control(&mut self, history: History<'_>) -> Result<f64, DrawFailure> {
        let (k, History { r, u, y }) = (history.k(), history);
        match self.model.observed() {
            Some(model) => self.observer.advance(model, u[k - 1], y[k - 1]),
            None => self.identify(&u[..k], &y[..k])?,
        }
        let mut input = r[k];
        for (gain, x) in self.k.iter().zip(self.observer.state()) {
            input = (-gain).mul_add(*x, input);
        }
        Ok(input)
    }
}
