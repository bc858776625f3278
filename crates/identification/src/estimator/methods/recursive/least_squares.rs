//! Recursive least squares.

use super::options::{RecursiveOptions, recursive_options};
use super::recursion::{Recursion, RecursiveMethod, Shared};
use super::weights::Weights;
use super::{RecursiveSettings, SquareRoot, dot};
use crate::estimator::{ArxOptions, OptionError};
use crate::model::Orders;
use crate::names::named_enum;

named_enum! {
    /// The matrix that recursive least squares carries from sample to sample.
    RecursiveForm, "form" {
        /// The square root of the information: P stays positive definite (the default).
        SquareRoot = "square-root",
        /// P itself, by the formula of the textbooks; needs p0.
        Covariance = "covariance",
    }
}

recursive_options! {
    /// The options of `rls`.
    RlsOptions {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        orders,
        then {
            /// The matrix that is carried from sample to sample: square-root (of the information, the default),
            /// covariance (P itself).
            pub form: Option<RecursiveForm>,
        }
    }
}

impl RecursiveOptions for RlsOptions {
    type Recursion = RecursiveLeastSquares;

    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders::arx(order, order, 1))
    }

    fn check_own(&self) -> Result<(), OptionError> {
        ArxOptions::check_orders(self.orders)?;
        if self.form == Some(RecursiveForm::Covariance) && self.p0.is_none() {
            let message = "'covariance' needs p0: infinity is no number of P";
            return Err(OptionError::new("form", message));
        }
        Ok(())
    }

    fn recursion(&self, settings: RecursiveSettings) -> RecursiveLeastSquares {
        RecursiveLeastSquares::new(settings, self.form.unwrap_or_default())
    }
}

/// `A(q) y = B(q) u + e` by recursive least squares with forgetting: with `phi(k) = (-y(k-1) ... -y(k-na), u(k-nk) ...
/// u(k-nk-nb+1))`,
///
/// ```text
///     K = P phi / (lambda + phi' P phi),  theta += K (y - phi' theta),  P = (P - K phi' P) / lambda
/// ```
///
/// theta(k) minimises `sum lambda^(k-i) (y(i) - phi(i)' theta)^2 + lambda^(k-k0+1) |theta - theta0|^2 / p0`. With
/// lambda = 1 and an exact start it is `arx` of the samples so far. The covariance is `s^2 P`.
///
/// A sample takes about 4 d^2 multiplications and additions in the square-root form ([`SquareRoot`]), 3 d^2 in the
/// other, d = na + nb.
///
/// Source: L. Ljung, *System Identification*, 2nd ed., 1999, section 11.2.
pub type RecursiveLeastSquares = Recursion<LeastSquares>;

/// The equations of [`RecursiveLeastSquares`].
#[derive(Clone, Debug)]
pub struct LeastSquares {
    memory: Memory,
    phi: Vec<f64>,
}

/// The state that is carried from sample to sample.
#[derive(Clone, Debug)]
enum Memory {
    Root(SquareRoot),
    Covariance {
        p: Vec<f64>,
        gain: Vec<f64>,
        residual_sum: f64,
        weights: Weights,
    },
}

impl RecursiveLeastSquares {
    /// Makes the buffers; orders nc, nd and nf must be 0.
    ///
    /// # Panics
    /// If theta0 does not fit the orders, or the covariance form has no p0.
    pub fn new(settings: RecursiveSettings, form: RecursiveForm) -> Self {
        let Orders { na, nb, nk, .. } = settings.orders;
        let d = na + nb;
        assert!(form == RecursiveForm::SquareRoot || settings.p0.is_some());
        let memory = match form {
            RecursiveForm::SquareRoot => Memory::Root(SquareRoot::new(d)),
            RecursiveForm::Covariance => Memory::Covariance {
                p: vec![0.0; d * d],
                gain: vec![0.0; d],
                residual_sum: 0.0,
                weights: Weights::default(),
            },
        };
        let method = LeastSquares {
            memory,
            phi: vec![0.0; d],
        };
        // It needs no start.
        Self::begin(settings, [na, nb + nk], Vec::new(), method)
    }
}

impl RecursiveMethod for LeastSquares {
    fn take(&mut self, shared: &mut Shared, _: f64, y: f64, wanted: bool) {
        if !shared.has_equation() {
            return;
        }
        let (na, nk) = (shared.settings.orders.na, shared.settings.orders.nk);
        let (lambda, phi) = (shared.settings.forgetting, &mut self.phi);
        phi[..na].copy_from_slice(&shared.outputs);
        phi[na..].copy_from_slice(&shared.inputs[nk..]);
        match &mut self.memory {
            Memory::Root(root) => {
                root.update(phi, y, lambda);
                if wanted && root.is_determined() {
                    root.solve(&mut shared.theta);
                }
            }
            Memory::Covariance {
                p,
                gain,
                residual_sum,
                weights,
            } => {
                let d = phi.len();
                for (gain, row) in gain.iter_mut().zip(p.chunks_exact(d)) {
                    *gain = dot(row, phi);
                }
                let scale = lambda + dot(phi, gain);
                let error = y - dot(phi, &shared.theta);
                for i in 0..d {
                    shared.theta[i] += gain[i] / scale * error;
                    // Both halves get the same bits: forgetting would blow up any difference by 1/lambda a sample.
                    for j in 0..=i {
                        p[i * d + j] = (p[i * d + j] - gain[i] / scale * gain[j]) / lambda;
                        p[j * d + i] = p[i * d + j];
                    }
                }
                *residual_sum = lambda * (*residual_sum + error * error / scale);
                weights.add(lambda);
            }
        }
    }

    fn numbers<'a>(&'a self, shared: &'a Shared) -> (&'a [f64], f64) {
        let size = match &self.memory {
            Memory::Root(root) => root.size(),
            Memory::Covariance { residual_sum, .. } => *residual_sum,
        };
        (&shared.theta, size)
    }

    fn is_determined(&self, _: &Shared) -> bool {
        match &self.memory {
            Memory::Root(root) => root.is_determined(),
            Memory::Covariance { .. } => true,
        }
    }

    fn variance(&self, theta: &[f64]) -> f64 {
        let (sum, weights) = match &self.memory {
            Memory::Root(root) => (root.residual_sum(), root.weights()),
            Memory::Covariance {
                residual_sum, weights, ..
            } => (*residual_sum, *weights),
        };
        weights.variance(sum, theta.len())
    }

    fn covariance(&mut self, variance: f64, to: &mut [f64]) {
        match &self.memory {
            Memory::Root(root) => root.covariance(variance, to),
            Memory::Covariance { p, .. } => {
                to.iter_mut().zip(p).for_each(|(to, p)| *to = variance * p);
            }
        }
    }

    fn restart(&mut self, shared: &mut Shared) {
        let RecursiveSettings { p0, theta0, .. } = &shared.settings;
        match &mut self.memory {
            Memory::Root(root) => root.restart(*p0, theta0),
            Memory::Covariance {
                p,
                residual_sum,
                weights,
                ..
            } => {
                p.fill(0.0);
                let (d, p0) = (theta0.len(), p0.unwrap_or(f64::NAN));
                (0..d).for_each(|i| p[i * d + i] = p0);
                (*residual_sum, *weights) = (0.0, Weights::default());
            }
        }
        shared.started = true;
    }
}
