//! The input of a closed loop without its noise, from the reference r: by a long model from r to u, or by a known
//! controller around the model.

use super::null_space::HighOrder;
use super::reflection::{reflect_zeros, stable};
use super::regression::{Regression, Rows};
use super::{FailureKind, SetupError, Window, enough_equations};
use crate::data::OutputFeedback;
use crate::model::polynomial::{divide, filter, multiply};
use crate::model::{LinearModel, Orders};

/// The orders of a long model.
fn orders(order: usize) -> Orders {
    Orders::arx(order, order + 1, 0)
}

/// Buffers for records of one length.
pub(super) struct LoopInput {
    /// The order m of `A s = B r + e` of the signal s, na = m and nb = m + 1; `None`: that by AIC.
    order: Option<usize>,
    model: LinearModel,
    controller: Option<OutputFeedback>,
    /// The signal without noise.
    pub(super) hat: Vec<f64>,
    /// Whether the present model's loop is unstable, so that `hat` is that of an earlier one.
    pub(super) is_unstable: bool,
}

impl LoopInput {
    /// Makes buffers for windows of `window` samples and a long model of this order, or that by AIC.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub(super) fn new(
        controller: Option<OutputFeedback>,
        order: Option<usize>,
        window: usize,
    ) -> Result<Self, SetupError> {
        let orders = orders(order.unwrap_or(1));
        enough_equations(orders, window, window, orders.parameters() + 1)?;
        Ok(Self {
            order,
            model: LinearModel::zero(orders),
            controller,
            hat: vec![0.0; window],
            is_unstable: false,
        })
    }

    /// Returns how an iteration with this input ends that has converged, if its last fit of the noise is `unfinished`.
    pub(super) fn end(source: Option<&Self>, unfinished: Option<FailureKind>) -> Result<(), FailureKind> {
        let unstable = source.is_some_and(|source| source.is_unstable);
        let unstable = unstable.then_some(FailureKind::UnstableInstruments);
        unfinished.or(unstable).map_or(Ok(()), Err)
    }

    /// Computes what of a signal follows from r, by the long model; all of it where it is r (open loop). Without noise
    /// the equations of a model that is too long are rank-deficient: then its order is lowered until they are not.
    ///
    /// # Errors
    /// As for [`Regression::solve`], as of an r that is zero.
    pub(super) fn follow(&mut self, signal: &[f64], r: &[f64]) -> Result<(), FailureKind> {
        self.is_unstable = false;
        if signal == r {
            self.hat.copy_from_slice(r);
            return Ok(());
        }
        let mut order = self.order.unwrap_or_else(|| {
            let mut high = HighOrder::new(true, 0, None, r.len());
            high.fit(r, signal);
            high.chosen().max(1)
        });
        loop {
            let long = Regression::new(orders(order), Rows::Prewindow, r.len());
            let mut long = long.map_err(|_| FailureKind::RankDeficient)?;
            match long.solve(r, signal) {
                Err(FailureKind::RankDeficient) if order > 1 => order -= 1,
                Err(kind) => return Err(kind),
                Ok(_) => {
                    self.model = LinearModel::zero(orders(order));
                    self.model.set_parameters(long.theta());
                    break;
                }
            }
        }
        if !stable(&self.model.a, &mut Vec::new()) && !reflect_zeros(&mut self.model.a) {
            return Err(FailureKind::NonFinite);
        }
        self.model.simulate(r, &mut self.hat);
        Ok(())
    }

    /// Computes the input of the loop of a model and the known controller `K = N/M`, `u = r - K y`:
    /// `F M/(F M + B N) r`. Nothing changes without a controller, or in open loop.
    pub(super) fn close(&mut self, model: &LinearModel, Window { u, r, .. }: Window<'_>) {
        let Some(controller) = self.controller.as_ref().filter(|_| u != r) else {
            return;
        };
        let mut product = multiply(&model.f, &controller.denominator());
        let mut closed = multiply(&model.b, controller.numerator());
        closed.resize(closed.len().max(product.len()), 0.0);
        closed.iter_mut().zip(&product).for_each(|(sum, p)| *sum += p);
        let lead = closed[0];
        for coefficient in closed.iter_mut().chain(&mut product) {
            *coefficient /= lead;
        }
        self.is_unstable = lead == 0.0 || !stable(&closed, &mut Vec::new());
        if !self.is_unstable {
            filter(&product, r, &mut self.hat);
            divide(&closed, &mut self.hat);
        }
    }
}
