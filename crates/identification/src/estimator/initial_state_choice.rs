//! Stage 6 in one pass of a method: whether x0 is estimated, and where it is stored.

use super::initial_state::InitialState;
use super::{FailureKind, Pass, Stage, Window};
use crate::names::named_enum;

named_enum! {
    /// Whether stage 6 is run: claim C8.
    StartState, "initial state" {
        /// x0 is estimated, stage 6 (the default).
        Estimate = "estimate",
        /// x0 = 0 is taken.
        Zero = "zero",
    }
}

/// Buffers for stage 6 of one pass.
pub struct StateEstimate {
    pub(super) start: StartState,
    initial_state: InitialState,
    x0: Vec<f64>,
    /// y minus the immediate effect of u, if there is one.
    undelayed: Vec<f64>,
}

impl StateEstimate {
    /// Makes buffers for a plant of this order.
    pub fn new(order: usize, start: StartState) -> Self {
        Self {
            start,
            initial_state: InitialState::new(order),
            x0: vec![0.0; order],
            undelayed: Vec::new(),
        }
    }

    /// Sets x0 of a pass whose a, b, h are set, or records the failure.
    pub fn estimate(&mut self, window: Window<'_>, number: usize, pass: &mut Pass) {
        if self.start == StartState::Zero {
            pass.start_at_zero();
            return;
        }
        match self.of(window, pass) {
            Ok(x0) => pass.set_initial_state(x0),
            Err(kind) => pass.fail_at(Stage::InitialState, number, kind),
        }
    }

    /// Returns the state at the start of a record of the model of a pass; 0 if it is not estimated.
    ///
    /// # Errors
    /// As for [`InitialState::estimate`].
    pub(super) fn of(&mut self, window: Window<'_>, pass: &Pass) -> Result<&[f64], FailureKind> {
        if pass.direct != 0.0 {
            let samples = window.y.iter().zip(window.u);
            self.undelayed.clear();
            self.undelayed.extend(samples.map(|(y, u)| y - pass.direct * u));
        }
        // A model may have another order than the previous one.
        if self.x0.len() != pass.a.len() {
            self.initial_state = InitialState::new(pass.a.len());
            self.x0.resize(pass.a.len(), 0.0);
        }
        let y = if pass.direct == 0.0 { window.y } else { &self.undelayed };
        self.x0.fill(0.0);
        if self.start == StartState::Estimate {
            let window = Window { y, ..window };
            self.initial_state.estimate(&pass.a, &pass.b, window, &mut self.x0)?;
        }
        Ok(&self.x0)
    }
}
