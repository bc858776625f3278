//! The noise model `D w = C e` of refined instrumental variables, fitted by prediction errors to `w = y - B/F u`.

use super::covariance::Covariance;
use super::fixed_point::replace;
use super::prediction_error::{Descent, OfRecord};
use super::{FailureKind, Runs};
use crate::model::{LinearModel, Orders};

/// The relative step at which an iteration of refined instrumental variables has converged.
pub(super) const REST: f64 = 1e-12;

/// Buffers of the fit for records of one length.
pub(super) struct NoiseFit {
    /// The search; `None`: white noise.
    search: Option<Descent>,
    /// (d, c).
    theta: Vec<f64>,
    nd: usize,
    silence: Vec<f64>,
    block: Vec<f64>,
}

impl NoiseFit {
    /// Makes buffers for windows of `window` samples.
    pub(super) fn new(Orders { nc, nd, .. }: Orders, window: usize) -> Self {
        let arma = Orders::armax(nd, 0, nc, 1);
        Self {
            search: (nc + nd > 0).then(|| Descent::new(arma, OfRecord::default(), Runs::new(&[window]))),
            theta: vec![0.0; nd + nc],
            nd,
            silence: vec![0.0; window],
            block: Vec::new(),
        }
    }

    /// Forgets the last fit.
    pub(super) fn reset(&mut self) {
        self.theta.fill(0.0);
    }

    /// Fits C and D to w; returns their change relative to their size, and the sum of squared prediction errors. Where
    /// the fit has no minimum its best model is taken, and why it has none is written to `unfinished`.
    pub(super) fn fit(
        &mut self,
        w: &[f64],
        model: &mut LinearModel,
        unfinished: &mut Option<FailureKind>,
    ) -> Result<[f64; 2], FailureKind> {
        *unfinished = None;
        let Some(search) = &mut self.search else {
            return Ok([0.0, w.iter().map(|w| w * w).sum()]);
        };
        let found = search.run(&self.silence, w, &self.theta, REST);
        match found.failure {
            Some(kind) if !kind.leaves_a_model() => return Err(kind),
            failure => *unfinished = failure,
        }
        let [way, size] = replace(&mut self.theta, search.theta(), 1.0, |_| 1.0);
        let (d, c) = self.theta.split_at(self.nd);
        model.d[1..].copy_from_slice(d);
        model.c[1..].copy_from_slice(c);
        Ok([way / size.max(f64::MIN_POSITIVE), found.sum])
    }

    /// Puts the covariance of C and D of the last fit, to w, in that of a model.
    pub(super) fn put_covariance(
        &mut self,
        w: &[f64],
        variance: f64,
        orders: Orders,
        to: &mut [f64],
    ) -> Result<(), FailureKind> {
        let Some(search) = &mut self.search else {
            return Ok(());
        };
        let Orders { na, nb, nc, nd, .. } = orders;
        search.condition(&self.silence, w, &self.theta)?;
        search.covariance(Covariance::White, variance, &mut self.block);
        let before = na + nb;
        let place = |i: usize| {
            if i < nd { before + nc + i } else { before + i - nd }
        };
        put_block(&self.block, nd + nc, place, orders.parameters(), to);
        Ok(())
    }
}

/// Copies a square block of n rows to the positions that `place` returns, in a matrix of `total` rows.
pub(super) fn put_block(block: &[f64], n: usize, place: impl Fn(usize) -> usize, total: usize, to: &mut [f64]) {
    for (i, row) in block.chunks_exact(n).enumerate() {
        for (j, value) in row.iter().enumerate() {
            to[place(i) * total + place(j)] = *value;
        }
    }
}
