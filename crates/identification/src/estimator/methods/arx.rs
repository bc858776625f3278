//! Least squares for any orders: `A(q) y = B(q) u + e`.

use crate::estimator::covariance::Covariance;
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::method_kind::{MethodKind, OptionUnits, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::order_choice::{Criterion, OrderComparison};
use crate::estimator::other_tools::{R_SYSID_RIDGE, Reading};
use crate::estimator::regression::{Regression, Rows};
use crate::estimator::{Estimator, FailureKind, Pass, SetupError, SinglePass, Window};
use crate::model::{LinearModel, Orders};
use std::ops::Range;

options! {
    /// The options of `arx`.
    pub struct ArxOptions {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The equations that are used: complete, prewindow (zeros before the record), padded (zeros before and after).
        pub rows: Rows,
        /// The initial state: estimate (stage 6 for the model found), or zero.
        pub initial_state: StartState,
        /// Ridge: weight of the squared parameters in the criterion; 0: none.
        pub ridge: Option<f64>,
        /// The conventions of another tool: r-sysid.
        pub reading: Option<Reading>,
        /// Chooses n = na = nb, from 1 to the na = nb of `orders`, by a criterion: aic, aicc, bic, fpe.
        pub choose: Option<Criterion>,
        /// The equation errors that standard errors assume: white (the default), coloured (and independent of the
        /// instruments), robust.
        pub covariance: Option<Covariance>,
    }
}

impl ArxOptions {
    fn orders(&self, order: usize) -> Orders {
        self.orders.unwrap_or(Orders::arx(order, order, 1))
    }

    /// Checks that only na, nb and nk are given.
    pub(super) fn check_orders(orders: Option<Orders>) -> Result<(), OptionError> {
        let wrong = |message: &str| Err(OptionError::new("orders", message));
        match orders {
            Some(Orders { nc, nd, nf, .. }) if nc + nd + nf > 0 => {
                wrong("expected na, nb, nk; the model has no C, D, F")
            }
            Some(Orders { na: 0, nb: 0, .. }) => wrong("expected an na or nb of at least 1"),
            _ => Ok(()),
        }
    }
}

impl MethodKind for ArxOptions {
    fn check(&self) -> Result<(), OptionError> {
        if let Some(ridge) = self.ridge
            && !(ridge >= 0.0 && ridge.is_finite())
        {
            let message = format!("{ridge}; expected a number of at least 0");
            return Err(OptionError::new("ridge", message));
        }
        if self.reading.is_some() {
            let rows = (self.rows != Rows::default()).then_some(self.rows);
            Reading::refuse(rows, self.ridge)?;
        }
        if self.choose.is_some() && self.orders.is_some_and(|orders| orders.na != orders.nb) {
            let message = "expected na = nb, the largest order to choose from";
            return Err(OptionError::new("orders", message));
        }
        Self::check_orders(self.orders)
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders(setting))
    }

    fn option_units(&self) -> OptionUnits {
        OptionUnits::Signals.only_if(self.ridge.is_some() || self.reading.is_some())
    }

    fn begins_at_rest(&self) -> bool {
        self.rows != Rows::Complete
    }

    fn takes_runs(&self) -> bool {
        self.rows == Rows::Complete && self.reading.is_none() && self.choose.is_none()
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let (orders, window) = (self.orders(problem.shape.order), problem.shape.window);
        let runs = problem.runs();
        let (rows, ridge) = match self.reading {
            Some(Reading::RSysid) => (Rows::Padded, R_SYSID_RIDGE),
            None => (self.rows, self.ridge.unwrap_or(0.0)),
        };
        let fit = |orders: Orders| {
            Ok(Fit {
                regression: Regression::with_ridge(orders, rows, ridge, window)?.of_runs(&runs)?,
                model: LinearModel::zero(orders),
                ridge: ridge > 0.0,
                covariance: self.covariance.unwrap_or_default(),
            })
        };
        let (orders, choice) = match self.choose {
            None => (vec![orders], None),
            Some(criterion) => {
                let of = |n| Orders::arx(n, n, orders.nk);
                let orders: Vec<Orders> = (1..=orders.na).map(of).collect();
                let comparison = OrderComparison::new(&orders, window)?;
                (orders, Some((criterion, comparison)))
            }
        };
        let fits: Result<Vec<Fit>, SetupError> = orders.iter().copied().map(fit).collect();
        Ok(Box::new(Arx {
            fits: fits?,
            choice,
            state: StateEstimate::new(orders[0].order(), self.initial_state),
            first: runs.first(orders[0].order()),
        }))
    }
}

/// Least squares `theta = argmin sum (y(k) - phi(k)' theta)^2`, with x0 by stage 6. The loss is RSS / N. For white
/// errors the covariance of theta is `s^2 (Phi'Phi)^-1`, `s^2 = RSS / (rows - parameters)`.
pub struct Arx {
    /// One fit for each order that may be chosen.
    fits: Vec<Fit>,
    choice: Option<(Criterion, OrderComparison)>,
    state: StateEstimate,
    /// The first record, from whose start x0 is.
    first: Range<usize>,
}

/// Least squares of one order.
struct Fit {
    regression: Regression,
    model: LinearModel,
    ridge: bool,
    covariance: Covariance,
}

impl Fit {
    fn find(&mut self, u: &[f64], y: &[f64], pass: &mut Pass) -> Result<(), FailureKind> {
        let (regression, model) = (&mut self.regression, &mut self.model);
        let condition = regression.solve(u, y)?;
        let parameters = regression.theta().len();
        model.set_parameters(regression.theta());
        let (rows, sum) = (regression.rows(), regression.residual_sum());
        model.noise_variance = f64::NAN;
        model.covariance.clear();
        if rows > parameters {
            let variance = sum / (rows - parameters) as f64;
            model.noise_variance = variance;
            if !self.ridge {
                regression.covariance(self.covariance, variance, &mut model.covariance);
            }
        }
        pass.loss = sum / y.len() as f64;
        pass.set_model(model, condition)
    }
}

impl SinglePass for Arx {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let chosen = match &mut self.choice {
            None => 0,
            Some((criterion, comparison)) => {
                comparison.run(window.u, window.y);
                comparison.best(*criterion)?
            }
        };
        self.fits[chosen].find(window.u, window.y, pass)?;
        self.state.estimate(window.part(self.first.clone()), 0, pass);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{Progress, Shape};
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};
    use rand::Rng as _;

    const N: usize = 300;

    fn input(trial: u64) -> Vec<f64> {
        let mut u = vec![0.0; N];
        let input = Input::new(InputLaw::Signs, 2.0, Sequence::Independent);
        input.fill(&mut stream(3, trial, Purpose::Input), &mut u);
        u
    }

    fn arx(orders: Orders, rows: Rows, u: &[f64], y: &[f64]) -> Pass {
        let options = ArxOptions {
            orders: Some(orders),
            rows,
            ..ArxOptions::default()
        };
        let shape = Shape {
            order: 1,
            window: u.len(),
        };
        let mut passes = [Pass::new(1)];
        let mut estimator = options.prepare(&shape.into()).unwrap();
        estimator.estimate(Window::new(u, y, u.len()), &mut passes);
        let [pass] = passes;
        pass
    }

    /// From a record without noise, the model that made it is found, whatever its orders, delay and rows. So is its
    /// start from rest.
    #[test]
    fn a_record_without_noise_gives_its_model() {
        for trial in 0..128_u64 {
            let (na, nb, nk) = (trial as usize % 5, 1 + trial as usize / 5 % 4, trial as usize / 20 % 4);
            let orders = Orders::arx(na, nb, nk);
            let mut random = stream(5, trial, Purpose::Plant);
            let mut uniform = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
            let mut model = LinearModel::zero(orders);
            // Within the unit circle: the coefficients of A sum to less than 1.
            let theta: Vec<f64> = (0..na + nb).map(|_| uniform() / 5.0).collect();
            model.set_parameters(&theta);
            let (u, mut y) = (input(trial), vec![0.0; N]);
            model.simulate(&u, &mut y);
            for rows in [Rows::Complete, Rows::Prewindow] {
                let pass = arx(orders, rows, &u, &y);
                assert_eq!((pass.failure, pass.progress), (None, Progress::InitialState));
                for (found, true_one) in pass.model.parameters().zip(&theta) {
                    assert!((found - true_one).abs() < 1e-12, "{orders} {found} {true_one}");
                }
                assert!(pass.loss < 1e-25 && !pass.unstable);
                assert_eq!(pass.a.len(), orders.order());
                assert!(pass.x0.iter().all(|x| x.abs() < 1e-11), "{orders}: {:?}", pass.x0);
                assert_eq!(pass.observed().is_some(), nk > 0);
            }
        }
    }

    /// `y(k) = 2 u(k) - 1 + (+-0.5)`, alternating. By hand, b = 2 if u is orthogonal to the rest.
    #[test]
    fn the_covariance_by_hand() {
        let u = [1.0, 1.0, -1.0, -1.0];
        let y = [2.5, 1.5, -1.5, -2.5];
        let pass = arx(Orders::arx(0, 1, 0), Rows::Complete, &u, &y);
        assert!((pass.model.b[0] - 2.0).abs() < 1e-15);
        // RSS = 4 * 0.25, three degrees of freedom, Phi'Phi = 4.
        assert!((pass.model.noise_variance - 1.0 / 3.0).abs() < 1e-15);
        assert!((pass.model.covariance[0] - 1.0 / 12.0).abs() < 1e-15);
        assert!((pass.loss - 0.25).abs() < 1e-15);
        assert_eq!(pass.direct, pass.model.b[0]);
    }

    #[test]
    fn what_cannot_be_solved_is_typed() {
        let (u, y) = (input(1), vec![0.0; N]);
        let kind = |orders, y: &[f64]| arx(orders, Rows::Complete, &u, y).failure.unwrap().kind;
        assert_eq!(kind(Orders::arx(1, 1, 1), &y), FailureKind::Singular);
        let mut huge = u.clone();
        huge[7] = f64::MAX;
        huge[8] = f64::MAX;
        assert_eq!(kind(Orders::arx(1, 1, 1), &huge), FailureKind::NonFinite);
        // y is twice u, so one column is a multiple of another.
        let double: Vec<f64> = u.iter().map(|u| 2.0 * u).collect();
        let found = kind(Orders::arx(1, 2, 0), &double);
        assert_eq!(found, FailureKind::RankDeficient);
        let short = ArxOptions::default().prepare(&Shape { order: 4, window: 11 }.into());
        let error = short.err().unwrap().to_string();
        assert_eq!(
            error,
            "a window of 11 samples is too short for orders na=4,nb=4,nk=1: 7 equations, at least 8 are needed"
        );
    }
}
