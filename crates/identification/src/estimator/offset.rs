//! A constant of the output as a parameter: `A (y - mu) = B/F u + C/D e`.
//!
//! mu is the output of the equilibrium in which u is 0, for every structure: `y = B/F u + mu + C/D e`, and
//! `A y = B u + A(1) mu + C e`. A constant u0 of the input has the same effect, `mu = y0 - G(1) u0` with the static
//! gain G(1), so the two cannot be told apart. A plant with an integrator has no equilibrium: its mu is that of the
//! start, or, if the start is estimated too, the record does not determine it.

use super::{FailureKind, Offset, Runs, Window};
use crate::model::{LinearModel, Units};
use crate::names::named_enum;

named_enum! {
    /// Whether the output has a constant that is estimated.
    OffsetChoice, "offset" {
        /// No constant (the default).
        None = "none",
        /// The constant is estimated together with the parameters.
        Estimate = "estimate",
    }
}

/// The levels of u and y about which a search sees each record, and the record less these. An offset about a level near
/// that of y is a small number, and starts that know of no offset are near.
pub(super) struct Levels {
    /// Whether u has a level too: where the start is estimated, a constant of u is one of y.
    of_input: bool,
    of_records: Vec<[f64; 2]>,
    u: Vec<f64>,
    y: Vec<f64>,
}

impl Levels {
    pub(super) fn new(of_input: bool) -> Self {
        Self {
            of_input,
            of_records: Vec::new(),
            u: Vec::new(),
            y: Vec::new(),
        }
    }

    /// Subtracts from each record its means; from one at rest before its first sample the mean of y before u moves.
    pub(super) fn subtract(&mut self, Window { u, y, .. }: Window<'_>, runs: &Runs) -> Window<'_> {
        let mean = |signal: &[f64]| signal.iter().sum::<f64>() / signal.len() as f64;
        self.of_records.clear();
        for (to, from) in [(&mut self.u, u), (&mut self.y, y)] {
            to.clear();
            to.extend_from_slice(from);
        }
        for run in runs {
            let (u, y) = (&mut self.u[run.clone()], &mut self.y[run.clone()]);
            let level = if self.of_input {
                [mean(u), mean(y)]
            } else {
                let moves = u.iter().position(|u| *u != 0.0).unwrap_or(u.len());
                [0.0, mean(&y[..moves.clamp(1, y.len())])]
            };
            for (signal, level) in [u, y].into_iter().zip(level) {
                for x in signal.iter_mut() {
                    *x -= level;
                }
            }
            self.of_records.push(level);
        }
        Window::new(&self.u, &self.y, self.y.len())
    }

    /// Returns the offset of each record, in units of y, from those about the levels. The covariance of the model,
    /// which is in these units, is that of its parameters and the offsets, and is reduced to that of the parameters.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the model has an integrator, and so no equilibrium.
    pub(super) fn offsets(
        &self,
        model: &mut LinearModel,
        about: &[f64],
        units: Units,
    ) -> Result<Vec<Offset>, FailureKind> {
        let (gain, gradient) = (model.static_gain(), model.static_gain_gradient());
        let n = gradient.len();
        let offset = |(i, [u, y]): (usize, &[f64; 2])| {
            // Without a level of u the gain does not matter, not even that of an integrator.
            let moved = |by: f64| {
                if *u == 0.0 { 0.0 } else { -by * u / units.input }
            };
            let mut of_record: Vec<f64> = gradient.iter().map(|g| moved(*g)).collect();
            of_record.resize(n + about.len(), 0.0);
            of_record[n + i] = 1.0;
            Offset {
                value: y / units.output + about[i] + moved(gain),
                se: model.variance_of(&of_record).sqrt(),
            }
        };
        let offsets: Vec<Offset> = self.of_records.iter().enumerate().map(offset).collect();
        leading_block(&mut model.covariance, n + about.len(), n);
        let finite = offsets.iter().all(|mu| mu.value.is_finite());
        finite.then_some(offsets).ok_or(FailureKind::NonFinite)
    }
}

/// Reduces a square matrix of `of` rows to its first n rows and columns; an empty one stays empty.
pub(super) fn leading_block(matrix: &mut Vec<f64>, of: usize, n: usize) {
    if matrix.is_empty() {
        return;
    }
    for i in 1..n {
        matrix.copy_within(i * of..i * of + n, i * n);
    }
    matrix.truncate(n * n);
}
