//! The reduction of an impulse response to a model `B/F`.

use crate::estimator::lag_sums::lagged_products;
use crate::estimator::output_gradient::OutputGradient;
use crate::estimator::prediction_error::{InitialCondition, PredictionError, SearchStarts};
use crate::estimator::triangular::solve_normal;
use crate::estimator::{Estimator, FailureKind, Pass, SetupError, Window};
use crate::model::{LinearModel, Orders};

/// Fits `B/F u` to the output `Phi g` of a response, which is free of the noise that the prior took away. That is the
/// response's nearest model in the norm of `Phi'Phi`, as the prediction error method finds it.
///
/// With `psi` the gradient of `B/F u` and P the covariance of the response, the covariance of (b, f) is `H P H'`,
/// `H = (psi'psi)^-1 psi'Phi`.
pub(super) struct Reduced {
    orders: Orders,
    fit: PredictionError,
    output: Vec<f64>,
    /// `psi'Phi` by columns, then H.
    h: Vec<f64>,
    taps: usize,
}

impl Reduced {
    pub(super) fn new(orders: Orders, taps: usize, window: usize) -> Result<Self, SetupError> {
        let random = SearchStarts::default().random(window);
        Ok(Self {
            fit: PredictionError::new(orders, random, InitialCondition::Zero, window)?,
            output: vec![0.0; window],
            h: vec![0.0; orders.parameters() * taps],
            orders,
            taps,
        })
    }

    /// Fills the pass with the reduced model of a response.
    pub(super) fn run(&mut self, response: &LinearModel, window: Window<'_>, pass: &mut Pass) {
        let Window { u, y, .. } = window;
        response.simulate(u, &mut self.output);
        let noiseless = Window::new(u, &self.output, y.len());
        self.fit.estimate(noiseless, std::slice::from_mut(pass));
        if pass.failure.is_some_and(|failure| !failure.kind.leaves_a_model()) {
            return;
        }
        pass.model.simulate(u, &mut self.output);
        let errors = self.output.iter().zip(y).map(|(x, y)| (y - x).powi(2));
        let (sum, n) = (errors.sum::<f64>(), y.len());
        pass.loss = sum / n as f64;
        pass.model.noise_variance = sum / (n - self.orders.parameters()) as f64;
        pass.model.covariance.clear();
        if pass.failure.is_none()
            && let Err(kind) = self.covariance(response, u, &mut pass.model)
        {
            pass.fail_for(kind);
        }
    }

    fn covariance(&mut self, response: &LinearModel, u: &[f64], model: &mut LinearModel) -> Result<(), FailureKind> {
        let Orders { nb, nf, nk, .. } = self.orders;
        let (d, n) = (nb + nf, self.taps);
        let OutputGradient { of_b, of_f, psi } = OutputGradient::new(model, u)?;
        let h = &mut self.h;
        lagged_products(&of_b, u, (nk, nb), (nk, n), |i, j, value| {
            h[j * d + i] = value;
        });
        lagged_products(&of_f, u, (1, nf), (nk, n), |i, j, value| {
            h[j * d + nb + i] = -value;
        });
        let r = psi.r();
        for column in self.h.chunks_exact_mut(d) {
            solve_normal(r, column);
        }
        // Rows of H P, then H P H'.
        let row = |i: usize| -> Vec<f64> {
            let of = |l: usize| {
                let products = (0..n).map(|j| self.h[j * d + i] * response.covariance[j * n + l]);
                products.sum()
            };
            (0..n).map(of).collect()
        };
        for row in (0..d).map(row) {
            let entry = |l: usize| (0..n).map(|j| row[j] * self.h[j * d + l]).sum::<f64>();
            model.covariance.extend((0..d).map(entry));
        }
        let finite = model.covariance.iter().all(|entry| entry.is_finite());
        finite.then_some(()).ok_or(FailureKind::NotIdentifiable)
    }
}
