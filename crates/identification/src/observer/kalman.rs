//! The Kalman filter of a plant on a record, and its gains.

#[cfg(test)]
mod tests;

use super::riccati::{Discrete, Equation, RiccatiError, check_covariance};
use super::stochastic_model::StochasticModel;
use crate::failure::{FailureKind, all_finite};
use faer::{Mat, MatRef};
use std::sync::Arc;

/// The gains K(k) and innovation variances of a Kalman filter. They do not depend on the data, so one sequence serves
/// all records of a cell.
#[derive(Clone, Debug)]
pub struct GainSequence {
    order: usize,
    /// K(k) is stored at k m ... (k + 1) m.
    gains: Vec<f64>,
    /// `h'P(k) h + r`.
    variances: Vec<f64>,
    /// The diagonal of P(k), as the gains are stored.
    diagonals: Vec<f64>,
    /// P one step after the last gain.
    p: Mat<f64>,
    settled: bool,
}

/// A sequence has settled when K and P change by no more than this in a step, relative to their largest entry and norm.
const SETTLED: f64 = 1e-14;

impl GainSequence {
    /// Returns the sequence with the single gain of the steady state.
    ///
    /// # Errors
    /// As for [`super::dare`].
    pub fn steady(model: &StochasticModel) -> Result<Self, RiccatiError> {
        let riccati = model.riccati()?;
        Ok(Self {
            order: model.order(),
            gains: riccati.gain,
            variances: vec![riccati.innovation],
            diagonals: (0..model.order()).map(|i| riccati.p[(i, i)]).collect(),
            p: riccati.p,
            settled: true,
        })
    }

    /// Computes the gains for k < `horizon` from the covariance `p0` (m x m) of `x(0) - xhat(0)`:
    /// `K = (F P h + s) / (h'P h + r)`, `P+ = (F - K h') P (F - K h')' + Q - K s' - s K' + K r K'`. This is Joseph's
    /// form with a cross covariance: P+ is symmetric, and non-negative if P is.
    ///
    /// Once K and P change by 1e-14 or less in a step, the last gain is used for all later k. If the filter's slowest
    /// pole has modulus lambda, that gain is within about `1e-14 / (1 - lambda^2)` of the limit.
    ///
    /// # Errors
    /// As for [`super::dare`], except that no stabilising solution need exist; for `p0` the same as for Q.
    /// [`RiccatiError::NoConvergence`] if P overflows.
    pub fn time_varying(model: &StochasticModel, p0: MatRef<'_, f64>, horizon: usize) -> Result<Self, RiccatiError> {
        let m = model.order();
        let f = model.f.as_ref();
        let equation = Discrete::new(f, &model.h, model.q.as_ref(), &model.s, model.r)?;
        Self::until_settled(check_covariance("the initial covariance", p0, m)?, &equation, horizon)
    }

    /// Does the same for a model with r = 0 and s = 0, whose output is measured exactly: `K = F P h / h'P h`, and 0
    /// once h'P h is rounding, since nothing is left to learn then. Without `horizon` it is the steady state, reached
    /// from `p0`.
    ///
    /// # Errors
    /// As for [`Self::time_varying`]. [`RiccatiError::NoConvergence`] if the steady state is not reached in 100,000
    /// steps.
    pub fn without_measurement_noise(
        model: &StochasticModel,
        p0: MatRef<'_, f64>,
        horizon: Option<usize>,
    ) -> Result<Self, RiccatiError> {
        const MOST: usize = 100_000;
        let m = model.order();
        let p = check_covariance("the initial covariance", p0, m)?;
        let q = check_covariance("Q", model.q.as_ref(), m)?;
        let smallest = 1e-14 * p.norm_max().max(q.norm_max());
        let equation = Discrete::of_exact_output(model.f.as_ref(), &model.h, q, smallest);
        let mut sequence = Self::until_settled(p, &equation, horizon.unwrap_or(MOST))?;
        if horizon.is_none() {
            if !sequence.settled {
                return Err(RiccatiError::NoConvergence(f64::INFINITY));
            }
            sequence.gains.drain(..sequence.gains.len() - m);
            sequence.variances.drain(..sequence.variances.len() - 1);
            sequence.diagonals.drain(..sequence.diagonals.len() - m);
        }
        Ok(sequence)
    }

    /// Returns the sequence from P on, at most so many gains, fewer if it settles.
    fn until_settled(p: Mat<f64>, equation: &Discrete, most: usize) -> Result<Self, RiccatiError> {
        let mut sequence = Self {
            order: p.nrows(),
            gains: Vec::new(),
            variances: Vec::new(),
            diagonals: Vec::new(),
            p,
            settled: false,
        };
        while sequence.stored() < most && !sequence.settled {
            sequence.advance(equation)?;
        }
        Ok(sequence)
    }

    /// Appends the gain K of P and advances P to P+.
    fn advance(&mut self, equation: &Discrete) -> Result<(), RiccatiError> {
        let m = self.order;
        let reduced = equation.gain(&self.p);
        let gain = equation.predictor_gain(&reduced);
        let p = equation.step(&self.p, &reduced);
        if !p.is_all_finite() {
            return Err(RiccatiError::NoConvergence(f64::INFINITY));
        }
        let change = (&p - &self.p).norm_l2() <= SETTLED * p.norm_l2();
        self.settled = change && self.variances.last().is_some() && {
            let last = &self.gains[self.gains.len() - m..];
            let largest = gain.iter().fold(0.0_f64, |max, k| max.max(k.abs()));
            let mut pairs = gain.iter().zip(last);
            pairs.all(|(k, last)| (k - last).abs() <= SETTLED * largest)
        };
        self.variances.push(equation.innovation(&self.p));
        self.gains.extend(gain);
        self.diagonals.extend((0..m).map(|i| self.p[(i, i)]));
        self.p = p;
        Ok(())
    }

    /// Returns K(k), m numbers.
    ///
    /// # Panics
    /// If the sequence has not settled and k is beyond its horizon.
    #[inline]
    pub fn gain(&self, k: usize) -> &[f64] {
        let k = self.index(k);
        &self.gains[k * self.order..(k + 1) * self.order]
    }

    /// Returns the variance `h'P(k) h + r` of the innovation `y(k) - h'xhat(k)`.
    ///
    /// # Panics
    /// As for [`Self::gain`].
    #[inline]
    pub fn variance(&self, k: usize) -> f64 {
        self.variances[self.index(k)]
    }

    /// Returns the diagonal of P(k), the variances of the errors of xhat(k|k-1); m numbers.
    ///
    /// # Panics
    /// As for [`Self::gain`].
    pub fn state_variances(&self, k: usize) -> &[f64] {
        let k = self.index(k);
        &self.diagonals[k * self.order..(k + 1) * self.order]
    }

    /// Returns the covariance P(k) one step after the last stored gain; if the sequence has settled, that of the steady
    /// state.
    pub fn covariance(&self) -> MatRef<'_, f64> {
        self.p.as_ref()
    }

    /// Returns how many gains are stored.
    pub fn stored(&self) -> usize {
        self.variances.len()
    }

    /// Returns whether the sequence is long enough for a record of `samples`.
    pub fn covers(&self, samples: usize) -> bool {
        self.settled || samples <= self.stored()
    }

    #[inline]
    fn index(&self, k: usize) -> usize {
        if self.settled { k.min(self.stored() - 1) } else { k }
    }
}

/// A non-zero entry of F.
#[derive(Clone, Copy, Debug)]
struct Entry {
    row: usize,
    column: usize,
    value: f64,
}

/// The filter in predictor form,
/// `xhat(k+1|k) = F xhat(k|k-1) + g u(k) + K(k) (y(k) - h'xhat(k|k-1))`, with buffers for one
/// model. A clone shares the gains.
#[derive(Clone, Debug)]
pub struct Kalman {
    f: Vec<Entry>,
    g: Vec<f64>,
    h: Vec<f64>,
    states: usize,
    gains: Arc<GainSequence>,
    x: Vec<f64>,
    next: Vec<f64>,
}

impl Kalman {
    /// Returns the filter of a model with gains computed beforehand.
    ///
    /// # Panics
    /// If the gains, g or h are of another order than the model, or if `states` exceeds the model's order.
    pub fn new(model: &StochasticModel, gains: Arc<GainSequence>) -> Self {
        let m = model.order();
        assert!(gains.order == m && model.g.len() == m && model.h.len() == m);
        assert!(model.states <= m);
        let all = (0..m).flat_map(|row| (0..m).map(move |column| (row, column)));
        let f = all.map(|(row, column)| Entry {
            row,
            column,
            value: model.f[(row, column)],
        });
        Self {
            f: f.filter(|entry| entry.value != 0.0).collect(),
            g: model.g.clone(),
            h: model.h.clone(),
            states: model.states,
            gains,
            x: vec![0.0; m],
            next: vec![0.0; m],
        }
    }

    /// Returns the filter with the constant gain of the steady state.
    ///
    /// # Errors
    /// As for [`super::dare`].
    pub fn steady(model: &StochasticModel) -> Result<Self, RiccatiError> {
        Ok(Self::new(model, Arc::new(GainSequence::steady(model)?)))
    }

    /// Returns the filter with the gains of [`GainSequence::time_varying`].
    ///
    /// # Errors
    /// As for [`GainSequence::time_varying`].
    pub fn time_varying(model: &StochasticModel, p0: MatRef<'_, f64>, horizon: usize) -> Result<Self, RiccatiError> {
        let gains = GainSequence::time_varying(model, p0, horizon)?;
        Ok(Self::new(model, Arc::new(gains)))
    }

    /// Returns the gains, shared with all clones.
    pub fn gains(&self) -> &Arc<GainSequence> {
        &self.gains
    }

    /// Returns the plant's part of the state after the last sample of the last run, xhat(K|K-1).
    pub fn state(&self) -> &[f64] {
        &self.x[..self.states]
    }

    /// Calls `visit(k, xhat(k|k-1))` with the plant's part of the state for k = 0 ... K-1, starting from `xhat(0) = x0`
    /// (n numbers). The noise's states start at their mean 0. Afterwards [`Self::state`] is xhat(K|K-1).
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if the state overflows; the visited values must then not be used.
    ///
    /// # Panics
    /// If x0 is not of length n, u and y differ in length, or the gains do not cover them.
    pub fn run(
        &mut self,
        u: &[f64],
        y: &[f64],
        x0: &[f64],
        mut visit: impl FnMut(usize, &[f64]),
    ) -> Result<(), FailureKind> {
        let states = self.states;
        self.filter(u, y, x0, |k, x, _| visit(k, &x[..states]))
    }

    /// Does the same as [`Self::run`] with `step(k, xhat(k|k-1), y(k) - h'xhat(k|k-1))`, xhat with the noise's states.
    ///
    /// # Errors
    /// As for [`Self::run`].
    ///
    /// # Panics
    /// As for [`Self::run`].
    #[inline]
    pub fn filter(
        &mut self,
        u: &[f64],
        y: &[f64],
        x0: &[f64],
        mut step: impl FnMut(usize, &[f64], f64),
    ) -> Result<(), FailureKind> {
        assert!(u.len() == y.len() && self.gains.covers(y.len()));
        self.x[..self.states].copy_from_slice(x0);
        self.x[self.states..].fill(0.0);
        for (k, (u, y)) in u.iter().zip(y).enumerate() {
            let gain = self.gains.gain(k);
            let predicted: f64 = self.h.iter().zip(&self.x).map(|(h, x)| h * x).sum();
            let innovation = y - predicted;
            step(k, &self.x, innovation);
            for (next, (g, gain)) in self.next.iter_mut().zip(self.g.iter().zip(gain)) {
                *next = g * u + gain * innovation;
            }
            for entry in &self.f {
                self.next[entry.row] += entry.value * self.x[entry.column];
            }
            std::mem::swap(&mut self.x, &mut self.next);
        }
        // If a component is not finite, h'x is infinite or NaN, and through K so is the whole next state (0 inf = NaN).
        all_finite(&self.x)
    }
}
