//! Iterations for `y = B/F u + e` that solve a linear problem in each pass: Steiglitz-McBride, and Young's simplified
//! refined instrumental variables.

use super::instruments::{InstrumentalRegression, Instruments, Signals};
use super::method::{MethodKind, OptionError, Problem};
use super::regression::{Regression, Rows};
use super::{Estimator, Failure, FailureKind, Pass, SetupError, Stage, Window};
use crate::model::polynomial::divide;
use crate::model::{LinearModel, Orders};
use crate::plant::canonical::reverse_negated;
use crate::plant::stability::is_stable;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The largest number of passes of an iteration.
pub(super) const MOST_PASSES: usize = 200;

/// The relative step at which an iteration has converged.
pub(super) const REST: f64 = 1e-12;

/// Defines the options of an iteration; both iterations have the same.
macro_rules! iteration {
    ($options:ident, $doc:literal, refined: $refined:literal) => {
        #[doc = $doc]
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $options {
            /// Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk = 1.
            pub orders: Option<Orders>,
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                check_output_error(self.orders)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(output_error(self.orders, setting))
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = output_error(self.orders, problem.shape.order);
                let window = problem.shape.window;
                let iteration = OutputErrorIteration::new(orders, window, $refined)?;
                Ok(Box::new(iteration))
            }
        }
    };
}

iteration!(StmcbOptions, "The options of `stmcb`.", refined: false);
iteration!(SrivOptions, "The options of `sriv`.", refined: true);

/// Returns the orders of an output-error model.
pub(super) fn output_error(orders: Option<Orders>, order: usize) -> Orders {
    orders.unwrap_or(Orders {
        nb: order,
        nf: order,
        nk: 1,
        ..Orders::default()
    })
}

/// Checks that only nb, nf and nk are given.
pub(super) fn check_output_error(orders: Option<Orders>) -> Result<(), OptionError> {
    match orders {
        Some(Orders { na, nc, nd, .. }) if na + nc + nd > 0 => {
            let message = "expected nb, nf, nk; the model has no A, C, D";
            Err(OptionError::new("orders", message))
        }
        Some(Orders { nb: 0, .. }) => {
            Err(OptionError::new("orders", "expected an nb of at least 1"))
        }
        _ => Ok(()),
    }
}

/// Iterates from F and B of the previous pass, with `yf = y/F`, `uf = u/F` and all signals zero before the record.
/// Steiglitz-McBride fits `yf = phi' theta` by least squares. Refined IV replaces yf by `B/F uf` in the instruments.
pub struct OutputErrorIteration {
    orders: Orders,
    first: Regression,
    /// The regression of refined IV; `None`: Steiglitz-McBride.
    refined: Option<InstrumentalRegression>,
    model: LinearModel,
    theta: Vec<f64>,
    u: Vec<f64>,
    y: Vec<f64>,
    x: Vec<f64>,
    e: Vec<f64>,
    scratch: Vec<f64>,
    /// The number of passes taken.
    pub(super) passes: usize,
}

impl OutputErrorIteration {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub fn new(orders: Orders, window: usize, refined: bool) -> Result<Self, SetupError> {
        let linear = Orders::arx(orders.nf, orders.nb, orders.nk);
        let rows = Rows::Prewindow;
        let signal = || vec![0.0; window];
        let instruments = || InstrumentalRegression::new(linear, Instruments::Signal, rows, window);
        Ok(Self {
            first: Regression::new(linear, rows, window)?,
            refined: if refined { Some(instruments()?) } else { None },
            model: LinearModel::zero(orders),
            theta: vec![0.0; orders.parameters()],
            orders,
            u: signal(),
            y: signal(),
            x: signal(),
            e: signal(),
            scratch: vec![0.0; orders.nf],
            passes: 0,
        })
    }

    /// Returns the last model.
    pub(super) fn model(&self) -> &LinearModel {
        &self.model
    }

    /// Takes (f, b) from the solved linear problem and sets their relative change.
    fn take(&mut self, change: &mut f64) {
        let theta = match (&self.refined, self.passes) {
            (Some(refined), 1..) => refined.theta(),
            _ => self.first.theta(),
        };
        let (mut difference, mut size) = (0.0_f64, 0.0_f64);
        for (old, new) in self.theta.iter_mut().zip(theta) {
            difference = difference.max((*old - new).abs());
            size = size.max(new.abs());
            *old = *new;
        }
        *change = difference / size;
        let (f, b) = self.theta.split_at(self.orders.nf);
        self.model.f[1..].copy_from_slice(f);
        self.model.b[self.orders.nk..].copy_from_slice(b);
    }

    /// Iterates until convergence.
    ///
    /// # Errors
    /// As for [`Regression::solve`]; [`FailureKind::UnstablePredictor`], [`FailureKind::NoConvergence`].
    pub(super) fn find(
        &mut self,
        u: &[f64],
        y: &[f64],
        condition: &mut f64,
    ) -> Result<(), FailureKind> {
        self.passes = 0;
        self.first.solve(u, y, condition)?;
        let mut change = f64::INFINITY;
        self.take(&mut change);
        while self.passes < MOST_PASSES {
            self.passes += 1;
            if !stable(&self.model.f, &mut self.scratch) {
                return Err(FailureKind::UnstablePredictor);
            }
            for (to, from) in [(&mut self.u, u), (&mut self.y, y)] {
                to.copy_from_slice(from);
                divide(&self.model.f, to);
            }
            match &mut self.refined {
                None => self.first.solve(&self.u, &self.y, condition)?,
                Some(refined) => {
                    // `self.u` is u/F, so x is B/F u divided by F.
                    self.model.simulate(&self.u, &mut self.x);
                    let signals = Signals::new(&self.u, &self.y, &self.x);
                    refined.solve(signals, condition)?;
                }
            }
            self.take(&mut change);
            if change <= REST {
                return Ok(());
            }
        }
        Err(FailureKind::NoConvergence)
    }
}

/// Returns whether the zeros of a monic polynomial are inside the unit circle. `scratch` has room for twice its degree.
pub(super) fn stable(polynomial: &[f64], scratch: &mut Vec<f64>) -> bool {
    let n = polynomial.len() - 1;
    scratch.resize(2 * n, 0.0);
    let (a, scratch) = scratch.split_at_mut(n);
    reverse_negated(&polynomial[1..], a);
    is_stable(a, scratch)
}

impl Estimator for OutputErrorIteration {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let Some(pass) = passes.first_mut() else {
            return;
        };
        let Window { u, y, .. } = window;
        let mut condition = f64::NAN;
        let found = self.find(u, y, &mut condition).and_then(|()| {
            let (n, d) = (y.len() as f64, self.theta.len() as f64);
            self.model.residuals(u, y, &mut self.e, &mut self.x);
            let sum: f64 = self.e.iter().map(|e| e * e).sum();
            self.model.noise_variance = sum / (n - d);
            self.model.covariance.clear();
            if let Some(refined) = &mut self.refined {
                let variance = self.model.noise_variance;
                let mut covariance = std::mem::take(&mut self.model.covariance);
                refined.covariance_of_instruments(variance, &mut covariance);
                move_first_to_last(&mut covariance, self.theta.len(), self.orders.nf);
                self.model.covariance = covariance;
            }
            pass.loss = sum / n;
            pass.iterations = Some(self.passes);
            pass.set_model(&self.model, condition)
        });
        match found {
            Ok(()) => pass.start_at_zero(),
            Err(kind) => {
                pass.iterations = Some(self.passes);
                pass.fail(Failure {
                    kind,
                    stage: Stage::Instruments,
                    pass: 0,
                });
            }
        }
    }
}

/// Reorders a covariance of (f, b), with nf numbers in f, to one of (b, f).
fn move_first_to_last(covariance: &mut [f64], n: usize, nf: usize) {
    covariance.rotate_left(nf * n);
    for row in covariance.chunks_exact_mut(n) {
        row.rotate_left(nf);
    }
}
