//! Uncertainty of a model's poles, zeros and static gain. The covariance of the parameters is propagated by their
//! derivatives (the delta method).

use super::root_errors::{Cancellation, Root, Roots};
use crate::model::LinearModel;
use faer::c64;

/// Quantities derived from a model's parameters, with standard errors derived from those of the parameters.
#[derive(Clone, Debug)]
pub struct Precision {
    /// Each pole of `B/(A F)`, in the order in which the poles were given.
    pub poles: Vec<Root>,
    /// Each zero of B without its delay, largest modulus first.
    pub zeros: Vec<Root>,
    /// Pairs of a pole and a zero that the record cannot tell apart, closest first.
    pub cancellations: Vec<Cancellation>,
    /// `B(1)/(A(1) F(1))`.
    pub static_gain: f64,
    /// Its standard error; NaN without a covariance.
    pub static_gain_se: f64,
}

impl Precision {
    /// Computes the precision of a model; standard errors are NaN without a covariance.
    pub fn new(model: &LinearModel, poles: &[c64]) -> Self {
        let Roots {
            poles,
            zeros,
            cancellations,
        } = Roots::new(model, poles);
        Self {
            poles,
            zeros,
            cancellations,
            static_gain: model.static_gain(),
            static_gain_se: model.variance_of(&model.static_gain_gradient()).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PoleFinder;

    /// Derivatives compared with differences of the poles and of the gain.
    #[test]
    fn derivatives_against_differences() {
        for orders in ["na=3,nb=3", "nb=3,nf=2", "na=1,nb=1,nf=2,nc=1"] {
            let mut model = LinearModel::zero(orders.parse().unwrap());
            let n = model.orders().parameters();
            let theta: Vec<f64> = [-0.9, 0.5, 0.3, 0.7, -0.2, 0.4][..n].to_vec();
            model.set_parameters(&theta);
            let poles_of = |model: &LinearModel| {
                let denominator = model.denominator();
                let a: Vec<f64> = denominator[1..].iter().rev().map(|c| -c).collect();
                PoleFinder::new(a.len()).poles(&a)
            };
            let poles = poles_of(&model);
            for parameter in 0..n {
                // With this covariance the standard error is the size of the derivative.
                let mut shown = model.clone();
                shown.covariance = vec![0.0; n * n];
                shown.covariance[parameter * (n + 1)] = 1.0;
                let precision = Precision::new(&shown, &poles);
                let h = 1e-6;
                let beside = |sign: f64| {
                    let mut theta = theta.clone();
                    theta[parameter] += sign * h;
                    let mut model = model.clone();
                    model.set_parameters(&theta);
                    model
                };
                let (low, high) = (beside(-1.0), beside(1.0));
                let gain = (high.static_gain() - low.static_gain()) / (2.0 * h);
                assert!((precision.static_gain_se - gain.abs()).abs() < 1e-6 * (1.0 + gain.abs()));
                let near = |poles: &[c64], pole: c64| {
                    let by = |p: &&c64, q: &&c64| (**p - pole).norm().total_cmp(&(**q - pole).norm());
                    *poles.iter().min_by(by).unwrap()
                };
                let zeros_of = |model: &LinearModel| {
                    let zeros = Precision::new(model, &[]).zeros;
                    zeros.iter().map(|zero| zero.at).collect::<Vec<c64>>()
                };
                let low = [poles_of(&low), zeros_of(&low)].concat();
                let high = [poles_of(&high), zeros_of(&high)].concat();
                let roots = precision.poles.iter().chain(&precision.zeros);
                assert_eq!(roots.clone().count(), low.len());
                for Root { at: pole, error } in roots {
                    let change = (near(&high, *pole) - near(&low, *pole)) / (2.0 * h);
                    assert!((error.re - change.re.abs()).abs() < 1e-5, "{orders} {parameter}");
                    assert!((error.im - change.im.abs()).abs() < 1e-5, "{orders} {parameter}");
                    assert!((error.covariance - change.re * change.im).abs() < 1e-4);
                    let modulus = (pole.re * change.re + pole.im * change.im) / pole.norm();
                    assert!((error.modulus - modulus.abs()).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn without_a_covariance_nothing_is_claimed() {
        let mut model = LinearModel::zero("na=1,nb=1".parse().unwrap());
        model.set_parameters(&[-0.5, 1.0]);
        let precision = Precision::new(&model, &[c64::new(0.5, 0.0)]);
        assert_eq!(precision.static_gain, 2.0);
        assert!(precision.static_gain_se.is_nan() && precision.poles[0].error.re.is_nan());
    }
}
