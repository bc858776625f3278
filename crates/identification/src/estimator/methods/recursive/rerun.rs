//! A whole estimate made anew after every so many samples: the honest rival of a recursion.

use super::{Diverged, RecursiveEstimator};
use crate::estimator::{Estimator, FailureKind, Method, MethodOptions, Pass, Progress, SetupError, Shape, Window};
use crate::model::Orders;

/// The samples that each estimate is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RerunWindow {
    /// All so far, from the first of at least so many on.
    Growing(usize),
    /// The last so many.
    Sliding(usize),
}

/// Runs a method of the registry again, by default the papers' own, after every `every` samples, on a growing or
/// sliding window. Its last pass gives theta. A run that fails leaves theta as it was, and the next may succeed.
///
/// A sliding window allocates nothing after it was filled, where the method does not. A growing one prepares the method
/// for every length, and keeps the record.
pub struct Rerun {
    method: Method,
    order: usize,
    orders: Orders,
    window: RerunWindow,
    every: usize,
    sliding: Option<Box<dyn Estimator>>,
    u: Vec<f64>,
    y: Vec<f64>,
    passes: Vec<Pass>,
    theta: Vec<f64>,
    samples: usize,
    determined: bool,
}

impl Rerun {
    /// Prepares the method for models of this order.
    ///
    /// # Errors
    /// If the method cannot serve the window, or the smallest of a growing one.
    ///
    /// # Panics
    /// If `every` is 0.
    pub fn new(
        options: impl Into<MethodOptions>,
        order: usize,
        window: RerunWindow,
        every: usize,
    ) -> Result<Self, SetupError> {
        assert!(every > 0);
        let options = options.into();
        let orders = options.model_orders(order);
        let orders = orders.unwrap_or(Orders::arx(order, order, 1));
        let method = Method::named("rerun", options);
        let (RerunWindow::Growing(least) | RerunWindow::Sliding(least)) = window;
        let shape = Shape { order, window: least };
        shape.check()?;
        let prepared = method.prepare(shape)?;
        let sliding = matches!(window, RerunWindow::Sliding(_)).then_some(prepared);
        Ok(Self {
            passes: vec![Pass::new(order); method.passes()],
            theta: vec![0.0; orders.parameters()],
            u: Vec::with_capacity(least),
            y: Vec::with_capacity(least),
            method,
            order,
            orders,
            window,
            every,
            sliding,
            samples: 0,
            determined: false,
        })
    }

    /// Returns the last pass of the last run: the model with a, b, h and x0 of the window's start, or the failure.
    ///
    /// # Panics
    /// Never: every method has an output.
    pub fn pass(&self) -> &Pass {
        self.passes.last().expect("a method has an output")
    }

    fn run(&mut self) -> Result<(), FailureKind> {
        let n = self.y.len();
        let window = Window::new(&self.u, &self.y, n);
        self.passes.iter_mut().for_each(Pass::clear);
        if let Some(estimator) = &mut self.sliding {
            estimator.estimate(window, &mut self.passes);
        } else {
            let shape = Shape {
                order: self.order,
                window: n,
            };
            // It served a shorter window.
            let prepared = self.method.prepare(shape);
            let mut estimator = prepared.map_err(|_| FailureKind::NotRun)?;
            estimator.estimate(window, &mut self.passes);
        }
        let pass = self.pass();
        if let Some(failure) = pass.failure {
            return Err(failure.kind);
        }
        if pass.progress == Progress::Nothing {
            return Err(FailureKind::NotRun);
        }
        let parameters = self.passes.last().map(|pass| pass.model.parameters());
        for (theta, found) in self.theta.iter_mut().zip(parameters.into_iter().flatten()) {
            *theta = found;
        }
        self.determined = true;
        Ok(())
    }
}

impl RecursiveEstimator for Rerun {
    fn orders(&self) -> Orders {
        self.orders
    }

    /// # Errors
    /// The failure of the run of this sample.
    fn advance(&mut self, u: f64, y: f64, _: bool) -> Result<(), Diverged> {
        let (RerunWindow::Growing(least) | RerunWindow::Sliding(least)) = self.window;
        if self.sliding.is_some() && self.y.len() == least {
            for (signal, newest) in [(&mut self.u, u), (&mut self.y, y)] {
                signal.copy_within(1.., 0);
                signal[least - 1] = newest;
            }
        } else {
            self.u.push(u);
            self.y.push(y);
        }
        let k = self.samples;
        self.samples += 1;
        if self.samples < least || !(self.samples - least).is_multiple_of(self.every) {
            return Ok(());
        }
        self.run().map_err(|kind| Diverged { k, kind })
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn is_determined(&self) -> bool {
        self.determined
    }

    fn noise_variance(&self) -> f64 {
        self.pass().model.noise_variance
    }

    fn covariance(&mut self, to: &mut [f64]) {
        let found = &self.passes.last().map(|pass| &pass.model.covariance);
        match found {
            Some(found) if found.len() == to.len() => to.copy_from_slice(found),
            _ => to.fill(f64::NAN),
        }
    }

    fn samples(&self) -> usize {
        self.samples
    }

    fn restart(&mut self) {
        self.u.clear();
        self.y.clear();
        self.theta.fill(0.0);
        (self.samples, self.determined) = (0, false);
    }
}
