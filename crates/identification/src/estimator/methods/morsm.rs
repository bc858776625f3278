//! Steiglitz-McBride iterations of signals that a high-order ARX model has filtered: `B/F` of a Box-Jenkins process
//! without a model of its noise.
//!
//! Sources: Y. Zhu, H. Hjalmarsson, "The Box-Jenkins Steiglitz-McBride algorithm", Automatica 65 (2016), 170-182;
//! N. Everitt, M. Galrinho, H. Hjalmarsson, "Open-loop asymptotically efficient model reduction with the
//! Steiglitz-McBride method", Automatica 89 (2018), 221-234.

use super::output_error_iteration::{
    OutputErrorIteration, check_output_error, output_error, output_errors,
};
use crate::estimator::lag_sums::check_squares;
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::null_space::HighOrder;
use crate::estimator::option_error::OptionError;
use crate::estimator::output_gradient::OutputGradient;
use crate::estimator::reflection::Stabilise;
use crate::estimator::regression::covariance_of_triangle;
use crate::estimator::{Estimator, FailureKind, Iteration, SetupError, Window, enough_equations};
use crate::model::polynomial::filter;
use crate::model::{LinearModel, Orders};

/// The output that the iteration fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Output {
    /// The record's, filtered: `A_h y`.
    Measured,
    /// The high-order model's, filtered: `A_h (B_h/A_h) u = B_h u`.
    Simulated,
}

/// Defines the options of a method; both have the same.
macro_rules! filtered_iteration {
    ($options:ident, $doc:literal, $output:expr) => {
        options! {
            #[doc = $doc]
            pub struct $options {
                /// Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk
                /// = 1.
                pub orders: Option<Orders>,
                /// Order of the high-order model; by default that by AIC, at most 50 and a sixth of the samples.
                pub high_order: Option<usize>,
                /// What is done if F is unstable: reflect (its zeros into the unit circle, the default), none (the
                /// method fails).
                pub stabilise: Option<Stabilise>,
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                if self.high_order == Some(0) {
                    return Err(OptionError::new("high_order", "0; expected at least 1"));
                }
                check_output_error(self.orders)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(output_error(self.orders, setting))
            }

            fn begins_at_rest(&self) -> bool {
                true
            }

            fn takes_memory(&self) -> bool {
                true
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = output_error(self.orders, problem.shape.order);
                let window = problem.shape.window;
                let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
                let method = Morsm::new(orders, $output, self.high_order, stabilise, window)?;
                Ok(Box::new(method))
            }
        }
    };
}

filtered_iteration!(BjsmOptions, "The options of `bjsm`.", Output::Measured);
filtered_iteration!(MorsmOptions, "The options of `morsm`.", Output::Simulated);

/// Steiglitz and McBride's iteration on `A_h u` and either output, A_h and B_h by least squares. The noise behind A_h
/// is white, so with psi the gradient of `B/F A_h u` the covariance is `s^2 (psi'psi)^-1`, s^2 the variance of
/// `A_h (y - B/F u)`.
pub struct Morsm {
    output: Output,
    high: HighOrder,
    iteration: OutputErrorIteration,
    gradient: OutputGradient,
    model: LinearModel,
    u: Vec<f64>,
    y: Vec<f64>,
    e: Vec<f64>,
    x: Vec<f64>,
    scratch: Vec<f64>,
}

impl Morsm {
    fn new(
        orders: Orders,
        output: Output,
        high_order: Option<usize>,
        stabilise: Stabilise,
        window: usize,
    ) -> Result<Self, SetupError> {
        let high = HighOrder::new(true, orders.nk, high_order, window);
        let needed = 2 * high_order.unwrap_or(1) + 1;
        enough_equations(orders, window, window, needed)?;
        let signal = || vec![0.0; window];
        Ok(Self {
            output,
            high,
            iteration: OutputErrorIteration::new(orders, window, false, stabilise)?,
            gradient: OutputGradient::new(orders, window),
            model: LinearModel::zero(orders),
            u: signal(),
            y: signal(),
            e: signal(),
            x: signal(),
            scratch: vec![0.0; orders.parameters()],
        })
    }
}

impl Iteration for Morsm {
    fn find(
        &mut self,
        Window { u, y, .. }: Window<'_>,
        passes: &mut usize,
        condition: &mut f64,
    ) -> Result<(), FailureKind> {
        check_squares([u, y])?;
        self.high.fit(u, y);
        let order = self.high.order();
        if order == 0 {
            return Err(FailureKind::RankDeficient);
        }
        let high = self.high.model(order);
        filter(&high.a, u, &mut self.u);
        match self.output {
            Output::Measured => filter(&high.a, y, &mut self.y),
            Output::Simulated => filter(&high.b, u, &mut self.y),
        }
        let window = Window::new(&self.u, &self.y, y.len());
        self.iteration.find(window, passes, condition)
    }

    fn conclude(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind> {
        let (Window { u, y, .. }, model) = (window, &mut self.model);
        model.assign(self.iteration.model());
        let sum = output_errors(model, u, y, [&mut self.e, &mut self.x]);
        if at_rest {
            let high = self.high.model(self.high.order());
            filter(&high.a, &self.e, &mut self.x);
            let freedom = (y.len() - self.scratch.len()) as f64;
            let variance = self.x.iter().map(|x| x * x).sum::<f64>() / freedom;
            self.gradient.run(model, &self.u)?;
            let r = self.gradient.psi.r();
            covariance_of_triangle(r, variance, &mut self.scratch, &mut model.covariance);
        }
        Ok(sum)
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::test_setup::{self, estimate, plant};
    use crate::estimator::{BjOptions, Progress, Shape};
    use crate::model::polynomial::divide;
    use crate::signal::Purpose;
    use serde_json::Value;

    fn both(orders: Orders, high_order: Option<usize>) -> [Box<dyn MethodKind>; 2] {
        let orders = Some(orders);
        let stabilise = None;
        [
            Box::new(BjsmOptions {
                orders,
                high_order,
                stabilise,
            }),
            Box::new(MorsmOptions {
                orders,
                high_order,
                stabilise,
            }),
        ]
    }

    /// `y = B/F u + sd C/D e`.
    fn record(truth: &LinearModel, sd: f64, trial: u64, n: usize) -> [Vec<f64>; 2] {
        let normal = |purpose| test_setup::normal(97, trial, purpose, n);
        let (u, e) = (normal(Purpose::Input), normal(Purpose::NoiseDrive));
        let (mut y, mut v) = (vec![0.0; n], vec![0.0; n]);
        truth.simulate(&u, &mut y);
        filter(&truth.c, &e, &mut v);
        divide(&truth.d, &mut v);
        y.iter_mut().zip(&v).for_each(|(y, v)| *y += sd * v);
        [u, y]
    }

    /// Recorded and simulated data against the fixed points of the iterations by numpy; `morsm.py` says how.
    #[test]
    fn fixed_points_of_another_program() {
        let cases: Value = serde_json::from_str(include_str!("morsm.json")).unwrap();
        for case in cases.as_array().unwrap() {
            let number = |key: &str| case[key].as_u64().unwrap() as usize;
            let file = case["file"].as_str().unwrap();
            let path = format!("../../tests/recorded_data/data/{file}");
            let record = crate::data::csv::read(std::fs::File::open(path).unwrap()).unwrap();
            let n = number("N");
            let orders: Orders = case["orders"].as_str().unwrap().parse().unwrap();
            let place = usize::from(case["method"] == "morsm");
            let options = &both(orders, Some(number("high_order")))[place];
            let pass = estimate(options.as_ref(), 2, &record.u[..n], &record.y[..n]);
            assert_eq!(pass.failure, None, "{file}");
            let errors = pass.model.standard_errors().unwrap();
            let expected = case["theta"].as_array().unwrap();
            for (i, (found, expected)) in pass.model.parameters().zip(expected).enumerate() {
                let expected = expected.as_f64().unwrap();
                assert!(
                    (found - expected).abs() < 1e-7,
                    "{file} {place}: {found} {expected}"
                );
                let error = case["se"][i].as_f64().unwrap();
                assert!(
                    (errors[i] / error - 1.0).abs() < 1e-5,
                    "{file} {place}: {} {error}",
                    errors[i]
                );
            }
        }
    }

    #[test]
    fn a_record_without_noise_gives_its_model() {
        for (nk, orders) in ["nb=1,nf=1,nk=0", "nb=2,nf=2,nk=1", "nb=1,nf=2,nk=2"]
            .iter()
            .enumerate()
        {
            let theta = [&[1.0, 0.5][..], &[-0.9, 0.2]].concat();
            let shape: Orders = orders.parse().unwrap();
            let truth = plant(
                orders,
                &[&theta[..shape.nb], &theta[2..2 + shape.nf]].concat(),
            );
            let [u, y] = record(&truth, 0.0, nk as u64, 300);
            for options in both(shape, None) {
                let pass = estimate(options.as_ref(), 2, &u, &y);
                assert_eq!(
                    (pass.failure, pass.progress),
                    (None, Progress::InitialState)
                );
                for (found, truth) in pass.model.parameters().zip(truth.parameters()) {
                    assert!((found - truth).abs() < 1e-8, "{orders}: {found} {truth}");
                }
            }
        }
    }

    /// Efficient for a Box-Jenkins process in open loop: at 20,000 samples within four standard errors, which are those
    /// of `bj` with the true structure.
    #[test]
    fn the_bound_at_twenty_thousand_samples() {
        let orders = "nb=2,nc=1,nd=1,nf=2";
        let truth = plant(orders, &[1.0, 0.5, 0.6, -0.8, -1.5, 0.7]);
        let [u, y] = record(&truth, 0.5, 5, 20_000);
        let bj = BjOptions {
            orders: Some(truth.orders()),
            ..BjOptions::default()
        };
        let bound = estimate(&bj, 2, &u, &y).model.standard_errors().unwrap();
        let plant_orders = Orders {
            nc: 0,
            nd: 0,
            ..truth.orders()
        };
        for options in both(plant_orders, None) {
            let pass = estimate(options.as_ref(), 2, &u, &y);
            assert_eq!(pass.failure, None);
            let errors = pass.model.standard_errors().unwrap();
            let expected = [1.0, 0.5, -1.5, 0.7];
            for (i, (found, place)) in pass.model.parameters().zip([0, 1, 4, 5]).enumerate() {
                assert!(
                    (found - expected[i]).abs() < 4.0 * errors[i],
                    "{found} {}",
                    expected[i]
                );
                let ratio = errors[i] / bound[place];
                assert!((0.95..1.05).contains(&ratio), "{ratio}");
            }
        }
    }

    #[test]
    fn what_cannot_be_estimated_is_typed() {
        let truth = plant("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7]);
        let [u, _] = record(&truth, 20.0, 3, 40);
        let kind = |options: &dyn MethodKind, y: &[f64]| {
            estimate(options, 2, &u, y).failure.map(|f| f.kind)
        };
        for options in both(truth.orders(), None) {
            assert_eq!(
                kind(options.as_ref(), &[0.0; 40]),
                Some(FailureKind::RankDeficient)
            );
        }
        let fails = BjsmOptions {
            stabilise: Some(Stabilise::None),
            ..BjsmOptions::default()
        };
        let mut kinds = std::collections::BTreeSet::new();
        for trial in 0..200 {
            let [u, y] = record(&truth, 20.0, 1000 + trial, 40);
            let pass = estimate(&fails, 2, &u, &y);
            kinds.extend(pass.failure.map(|failure| failure.kind.to_string()));
            let pass = estimate(&BjsmOptions::default(), 2, &u, &y);
            let limit = pass
                .failure
                .is_none_or(|failure| failure.kind == FailureKind::IterationLimit);
            assert!(limit && pass.model.f.iter().all(|f| f.is_finite()));
        }
        assert!(kinds.contains("unstable-predictor"), "{kinds:?}");
        let error = BjsmOptions {
            high_order: Some(30),
            ..BjsmOptions::default()
        };
        let error = error
            .prepare(
                &Shape {
                    order: 2,
                    window: 40,
                }
                .into(),
            )
            .err()
            .unwrap();
        assert!(error.to_string().contains("too short"), "{error}");
        let wrong = MorsmOptions {
            orders: Some("na=1,nb=1".parse().unwrap()),
            ..MorsmOptions::default()
        };
        assert!(wrong.check().is_err());
    }
}
