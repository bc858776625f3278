//! Iterations for `y = B/F u + e` that solve a linear problem in each pass: Steiglitz-McBride, and Young's simplified
//! refined instrumental variables.

use crate::estimator::fixed_point::{Damping, MOST_PASSES, replace, unfinished};
use crate::estimator::instruments::{InstrumentalRegression, Instruments, Signals};
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::noise_fit::REST;
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::{Stabilise, stay_stable};
use crate::estimator::regression::{Regression, Rows};
use crate::estimator::{Estimator, FailureKind, Iteration, SetupError, Window};
use crate::model::polynomial::{divide, divide_each, filter};
use crate::model::{LinearModel, Orders};

/// Defines the options of an iteration; both iterations have the same.
macro_rules! iteration {
    ($options:ident, $doc:literal, refined: $refined:literal) => {
        options! {
            #[doc = $doc]
            pub struct $options {
                /// Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk
                /// = 1.
                pub orders: Option<Orders>,
                /// The treatment of an unstable F: reflect (its zeros into the unit circle, the default), none (the
                /// method fails).
                pub stabilise: Option<Stabilise>,
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                check_output_error(self.orders)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(output_error(self.orders, setting))
            }

            fn begins_at_rest(&self) -> bool {
                true
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = output_error(self.orders, problem.shape.order);
                let window = problem.shape.window;
                let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
                let iteration = OutputErrorIteration::new(orders, window, $refined, stabilise)?;
                Ok(Box::new(iteration))
            }
        }
    };
}

iteration!(StmcbOptions, "The options of `stmcb`.", refined: false);
iteration!(SrivOptions, "The options of `sriv`.", refined: true);

/// Returns the orders of an output-error model.
pub(super) fn output_error(orders: Option<Orders>, order: usize) -> Orders {
    orders.unwrap_or(Orders::output_error(order, order, 1))
}

/// Checks that only nb, nf and nk are given.
pub(super) fn check_output_error(orders: Option<Orders>) -> Result<(), OptionError> {
    match orders {
        Some(Orders { na, nc, nd, .. }) if na + nc + nd > 0 => {
            let message = "expected nb, nf, nk; the model has no A, C, D";
            Err(OptionError::new("orders", message))
        }
        Some(Orders { nb: 0, .. }) => Err(OptionError::new("orders", "expected an nb of at least 1")),
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
    stabilise: Stabilise,
    /// The stable model with the lowest sum of squared output errors, and that sum.
    best: LinearModel,
    least: f64,
}

impl OutputErrorIteration {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub fn new(orders: Orders, window: usize, refined: bool, stabilise: Stabilise) -> Result<Self, SetupError> {
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
            stabilise,
            best: LinearModel::zero(orders),
            least: f64::INFINITY,
        })
    }

    /// Iterates until convergence. Returns the condition of the last pass.
    ///
    /// # Errors
    /// As for [`Regression::solve`]; [`FailureKind::UnstablePredictor`] if nothing is reflected;
    /// [`FailureKind::IterationLimit`] after the last pass.
    fn iterate(&mut self, u: &[f64], y: &[f64], passes: &mut usize) -> Result<f64, FailureKind> {
        self.first.solve(u, y)?;
        replace(&mut self.theta, self.first.theta(), 1.0, |_| 1.0);
        self.model.set_plant(&self.theta);
        let mut damping = Damping::none();
        while *passes < MOST_PASSES {
            *passes += 1;
            stay_stable(&mut self.model.f, self.stabilise, &mut self.scratch)?;
            self.theta[..self.orders.nf].copy_from_slice(&self.model.f[1..]);
            self.u.copy_from_slice(u);
            self.y.copy_from_slice(y);
            divide_each(&self.model.f, [&mut self.u, &mut self.y]);
            // `self.u` is u/F, so x is B/F u here, and below it is divided by F.
            filter(&self.model.b, &self.u, &mut self.x);
            self.keep_best(y);
            let (new, condition) = match &mut self.refined {
                None => {
                    let condition = self.first.solve(&self.u, &self.y)?;
                    (self.first.theta(), condition)
                }
                Some(refined) => {
                    divide(&self.model.f, &mut self.x);
                    let signals = Signals::new(&self.u, &self.y, &self.x);
                    let condition = refined.solve(signals)?;
                    (refined.theta(), condition)
                }
            };
            let [way, size] = replace(&mut self.theta, new, damping.share, |_| 1.0);
            self.model.set_plant(&self.theta);
            let change = way / size;
            if change <= REST {
                return Ok(condition);
            }
            if damping.goes_around(*passes, change) {
                self.best.write_plant(&mut self.theta);
                self.model.set_plant(&self.theta);
            }
        }
        Err(FailureKind::IterationLimit)
    }

    /// Keeps the model if its output `x = B/F u` is the closest to y so far.
    fn keep_best(&mut self, y: &[f64]) {
        let sum: f64 = y.iter().zip(&self.x).map(|(y, x)| (y - x).powi(2)).sum();
        if sum < self.least {
            self.least = sum;
            self.best.assign(&self.model);
        }
    }
}

impl Iteration for OutputErrorIteration {
    fn find(&mut self, Window { u, y, .. }: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        *passes = 0;
        self.least = f64::INFINITY;
        self.iterate(u, y, passes).map_err(|kind| {
            unfinished(kind, self.least).map_or(kind, |unfinished| {
                self.model.assign(&self.best);
                unfinished
            })
        })
    }

    fn conclude(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind> {
        let (Window { u, y, .. }, d) = (window, self.theta.len());
        let sum = output_errors(&mut self.model, u, y, [&mut self.e, &mut self.x]);
        if let (Some(refined), true) = (&mut self.refined, at_rest) {
            let model = &mut self.model;
            refined.covariance_of_instruments(model.noise_variance, &mut model.covariance);
            move_first_to_last(&mut model.covariance, d, self.orders.nf);
        }
        Ok(sum)
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }
}

/// Computes the errors `e = y - B/F u` of a model and their variance, and clears its covariance. Returns their sum of
/// squares.
pub(super) fn output_errors(model: &mut LinearModel, u: &[f64], y: &[f64], [e, scratch]: [&mut [f64]; 2]) -> f64 {
    model.residuals(u, y, e, scratch);
    let sum: f64 = e.iter().map(|e| e * e).sum();
    model.noise_variance = sum / (y.len() - model.orders().parameters()) as f64;
    model.covariance.clear();
    sum
}

/// Reorders a covariance of (f, b), with nf numbers in f, to one of (b, f).
pub(super) fn move_first_to_last(covariance: &mut [f64], n: usize, nf: usize) {
    covariance.rotate_left(nf * n);
    for row in covariance.chunks_exact_mut(n) {
        row.rotate_left(nf);
    }
}
