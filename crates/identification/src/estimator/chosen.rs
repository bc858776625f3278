//! An estimator with its order chosen for each record: by an information criterion, or by cross-validation.
//!
//! Source: L. Ljung, *System Identification*, 2nd ed., sections 16.4 (criteria) and 16.5 (validation).

use super::method_kind::{MethodKind, Problem};
use super::order_choice::Criterion;
use super::{Estimator, FailureKind, Pass, Progress, SetupError, Shape, SinglePass, Window};
use crate::estimator::prediction_errors;
use crate::names::named_enum;

named_enum! {
    /// The rule that decides an order. V is the mean squared prediction error over N samples, d the number
    /// of parameters.
    OrderRule, "rule for the order" {
        /// Schwarz's criterion, `N ln V + d ln N` (the default).
        Bic = "bic",
        /// Akaike's for few samples, `N ln V + 2 d + 2 d (d + 1)/(N - d - 1)`. Of `oe`, `armax` and `bj` it takes
        /// orders that are too large, at N = 1,000 too: a pair of pole and zero near the circle that nearly cancel fits
        /// the noise, a search finds the best place for it, and no criterion of Akaike counts that.
        Aicc = "aicc",
        /// Akaike's, `N ln V + 2 d`.
        Aic = "aic",
        /// Akaike's final prediction error, `V (1 + d/N)/(1 - d/N)`.
        Fpe = "fpe",
        /// The mean squared prediction error over the last third of the record, of a model of the first two thirds.
        CrossValidation = "cross-validation",
    }
}

impl OrderRule {
    /// Returns the information criterion; `None`: cross-validation.
    const fn criterion(self) -> Option<Criterion> {
        match self {
            Self::Aicc => Some(Criterion::Aicc),
            Self::Aic => Some(Criterion::Aic),
            Self::Bic => Some(Criterion::Bic),
            Self::Fpe => Some(Criterion::Fpe),
            Self::CrossValidation => None,
        }
    }
}

/// Returns how many samples cross-validation estimates from.
pub const fn first_part(window: usize) -> usize {
    window - window / 3
}

/// One order that may be chosen.
struct Candidate {
    estimator: Box<dyn Estimator>,
    /// The estimator of the first part of the record, for cross-validation.
    first: Option<Box<dyn Estimator>>,
    pass: Pass,
}

/// Estimates a model of each order, and keeps that with the smallest value of the rule, the smallest among equal ones.
/// Orders without a model are left out; if there is no model at all, the failure is that of the smallest order.
pub struct Chosen {
    rule: OrderRule,
    candidates: Vec<Candidate>,
    e: Vec<f64>,
    x: Vec<f64>,
}

/// Whether a pass has a model that can be compared.
fn compares(pass: &Pass) -> bool {
    let unfinished = pass.failure.is_none_or(|failure| failure.kind.leaves_a_model());
    unfinished && pass.progress >= Progress::Parameters
}

impl Chosen {
    /// Prepares the estimators of the orders 1 to `most` for a problem; `of_order` returns the options of an order.
    ///
    /// # Errors
    /// As of the options of the largest.
    pub(super) fn prepare<O: MethodKind>(
        rule: OrderRule,
        most: usize,
        problem: &Problem<'_>,
        of_order: impl Fn(usize) -> O,
    ) -> Result<Box<dyn Estimator>, SetupError> {
        let window = problem.shape.window;
        let with = |order: usize, window: usize| {
            let shape = Shape { order, window };
            of_order(order).prepare(&Problem { shape, ..*problem })
        };
        let candidate = |order: usize| -> Result<Candidate, SetupError> {
            let validated = rule == OrderRule::CrossValidation;
            let first = validated.then(|| with(order, first_part(window)));
            Ok(Candidate {
                estimator: with(order, window)?,
                first: first.transpose()?,
                pass: Pass::new(order),
            })
        };
        let candidates: Result<Vec<Candidate>, SetupError> = (1..=most).map(candidate).collect();
        Ok(Box::new(Self {
            rule,
            candidates: candidates?,
            e: vec![0.0; window],
            x: vec![0.0; window],
        }))
    }

    /// Returns the value of the rule for a candidate, whose pass then has its model of the whole window, except in
    /// cross-validation; infinite without a model.
    fn value(&mut self, i: usize, window: Window<'_>) -> f64 {
        let (n, rule) = (window.len(), self.rule);
        let Candidate { estimator, first, pass } = &mut self.candidates[i];
        pass.clear();
        let Window { u, y, r } = window;
        if let Some(first) = first {
            let early = Window::with_reference(u, y, r, first_part(n));
            first.estimate(early, std::slice::from_mut(pass));
        } else {
            estimator.estimate(window, std::slice::from_mut(pass));
        }
        if !compares(pass) {
            return f64::INFINITY;
        }
        let y = pass.less_offset(0, y);
        pass.model.residuals(u, &y, &mut self.e, &mut self.x);
        if first.is_some() && pass.x0.iter().any(|x| *x != 0.0) {
            // A start that was estimated is carried on.
            match prediction_errors(&pass.model, u, &y, first_part(n)) {
                Some((_, e)) => self.e = e,
                None => return f64::INFINITY,
            }
        }
        let errors = |from: usize| self.e[from..].iter().map(|e| e * e).sum::<f64>() / (n - from) as f64;
        let value = match rule.criterion() {
            None => errors(first_part(n)),
            Some(criterion) => {
                let loss = if pass.loss.is_nan() { errors(0) } else { pass.loss };
                criterion.value(loss, n, pass.fitted_numbers())
            }
        };
        // An unstable predictor may overflow.
        if value.is_nan() { f64::INFINITY } else { value }
    }
}

impl SinglePass for Chosen {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let values: Vec<f64> = (0..self.candidates.len()).map(|i| self.value(i, window)).collect();
        let best = (0..values.len()).filter(|i| values[*i] < f64::INFINITY);
        let Some(best) = best.min_by(|a, b| values[*a].total_cmp(&values[*b])) else {
            let first = self.candidates.first();
            pass.failure = first.and_then(|candidate| candidate.pass.failure);
            let failed = pass.failure.is_some();
            return failed.then_some(()).ok_or(FailureKind::NonFinite);
        };
        let chosen = &mut self.candidates[best];
        if chosen.first.is_some() {
            chosen.pass.clear();
            chosen
                .estimator
                .estimate(window, std::slice::from_mut(&mut chosen.pass));
        }
        pass.clone_from(&chosen.pass);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::test_setup::{self, estimate};
    use crate::estimator::{ArmaxOptions, CvaOptions, InitialCondition, MethodKind, MoespOptions, OeOptions};
    use crate::model::{LinearModel, Orders};
    use crate::signal::Purpose;

    fn oe(choose: OrderRule, n: usize) -> OeOptions {
        OeOptions {
            orders: Some(format!("nb={n},nf={n},nk=1").parse().unwrap()),
            choose: Some(choose),
            ..OeOptions::default()
        }
    }

    /// `y = B/F u + sd e` of order 2.
    fn record(sd: f64, trial: u64, n: usize) -> [Vec<f64>; 2] {
        let normal = |purpose| test_setup::normal(101, trial, purpose, n);
        let (u, e) = (normal(Purpose::Input), normal(Purpose::NoiseDrive));
        let mut truth = LinearModel::zero("nb=2,nf=2".parse().unwrap());
        truth.set_parameters(&[1.0, 0.5, -1.5, 0.7]);
        let mut y = vec![0.0; n];
        truth.simulate(&u, &mut y);
        y.iter_mut().zip(&e).for_each(|(y, e)| *y += sd * e);
        [u, y]
    }

    /// By BIC nearly always the true order, by the others never a smaller one, in white output noise at N = 400.
    #[test]
    fn the_order_of_an_output_error_model() {
        let mut right = Vec::new();
        for rule in OrderRule::ALL {
            let options = oe(*rule, 3);
            let chosen: Vec<usize> = (0..8)
                .map(|trial| {
                    let [u, y] = record(0.5, trial, 400);
                    let pass = estimate(&options, 3, &u, &y);
                    assert!(compares(&pass), "{rule} {:?}", pass.failure);
                    assert_eq!(pass.a.len(), pass.model.f.len() - 1);
                    pass.a.len()
                })
                .collect();
            assert!(chosen.iter().all(|n| *n >= 2), "{rule}: {chosen:?}");
            right.push(chosen.iter().filter(|n| **n == 2).count());
        }
        let [bic, aicc, aic, ..] = right[..] else {
            unreachable!()
        };
        // The penalties are in this order.
        assert!(bic >= 7 && bic >= aicc && aicc >= aic, "{right:?}");
    }

    /// Records that begin far from rest: each order is judged by the errors of its model of the first part, whose
    /// states go on from there, and the least errors choose.
    #[test]
    fn cross_validation_carries_the_start_on() {
        const N: usize = 200;
        let of_order = |n: usize, choose| OeOptions {
            initial: InitialCondition::Estimate,
            choose,
            ..oe(OrderRule::CrossValidation, n)
        };
        for trial in 0..12 {
            let normal = |purpose| test_setup::normal(103, trial, purpose, 2 * N);
            let (mut u, e) = (normal(Purpose::Input), normal(Purpose::NoiseDrive));
            u[..N].iter_mut().for_each(|u| *u += 3.0);
            let truth = test_setup::plant("nb=2,nf=2", &[1.0, 0.5, -1.68, 0.686]);
            let mut y = vec![0.0; 2 * N];
            truth.simulate(&u, &mut y);
            y.iter_mut().zip(&e).for_each(|(y, e)| *y += e);
            let (u, y) = (&u[N..], &y[N..]);
            let part = first_part(N);
            let errors = |n: usize| {
                let pass = estimate(&of_order(n, None), n, &u[..part], &y[..part]);
                let mut x = pass.x0.clone();
                let mut sum = 0.0;
                for k in 0..N {
                    if k >= part {
                        sum += (y[k] - x[0]).powi(2);
                    }
                    let last: f64 = pass.a.iter().zip(&x).map(|(a, x)| a * x).sum();
                    x.rotate_left(1);
                    x[n - 1] = last;
                    x.iter_mut().zip(&pass.b).for_each(|(x, b)| *x += b * u[k]);
                }
                sum
            };
            let best = (1..=3).min_by(|i, j| errors(*i).total_cmp(&errors(*j)));
            let chosen = of_order(3, Some(OrderRule::CrossValidation));
            let found = estimate(&chosen, 3, u, y).a.len();
            assert_eq!(Some(found), best, "{trial}");
        }
    }

    /// The model that is kept is the estimator's own of that order.
    #[test]
    fn the_model_is_the_estimators() {
        let [u, y] = record(0.5, 3, 300);
        for rule in [OrderRule::Bic, OrderRule::CrossValidation] {
            let choose = Some(rule);
            let orders = Some(Orders::arx(4, 4, 1));
            let pairs: [[Box<dyn MethodKind>; 2]; 3] = [
                [
                    Box::new(ArmaxOptions {
                        choose,
                        ..ArmaxOptions::default()
                    }),
                    Box::new(ArmaxOptions::default()),
                ],
                [
                    Box::new(MoespOptions {
                        orders,
                        choose,
                        ..MoespOptions::default()
                    }),
                    Box::new(MoespOptions::default()),
                ],
                [
                    Box::new(CvaOptions {
                        orders,
                        choose,
                        ..CvaOptions::default()
                    }),
                    Box::new(CvaOptions::default()),
                ],
            ];
            for [chosen, plain] in pairs {
                let pass = estimate(chosen.as_ref(), 3, &u, &y);
                let expected = estimate(plain.as_ref(), pass.a.len(), &u, &y);
                assert_eq!(pass.model.b, expected.model.b, "{rule}");
                assert_eq!(pass.x0, expected.x0);
            }
        }
    }

    #[test]
    fn what_cannot_be_chosen_is_typed() {
        let [u, _] = record(0.5, 1, 100);
        let pass = estimate(&oe(OrderRule::Bic, 3), 3, &u, &[0.0; 100]);
        let plain = estimate(&OeOptions::default(), 1, &u, &[0.0; 100]);
        assert_eq!(pass.failure, plain.failure);
        assert!(pass.failure.is_some());
        let short = oe(OrderRule::Bic, 40).prepare(&Shape { order: 2, window: 60 }.into());
        assert!(short.err().unwrap().to_string().contains("too short"));
        let orders = Some("nb=2,nf=3".parse().unwrap());
        let unequal = OeOptions {
            orders,
            ..oe(OrderRule::Bic, 3)
        };
        let error = unequal.check().unwrap_err().to_string();
        assert!(error.contains("equal orders, the largest to choose from"), "{error}");
    }
}
