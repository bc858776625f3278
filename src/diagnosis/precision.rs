//! How far a model's poles and static gain may be from the truth: the covariance of its parameters, propagated by their
//! derivatives (the delta method).

use crate::model::LinearModel;
use faer::c64;
use serde::Serialize;

/// Standard errors that follow from those of the parameters.
#[derive(Clone, Debug, Serialize)]
pub struct Precision {
    /// Of each pole of `B/(A F)`, in the order in which the poles were given.
    pub poles: Vec<PoleError>,
    /// `B(1)/(A(1) F(1))`.
    pub static_gain: f64,
    /// Its standard error; NaN without a covariance.
    pub static_gain_se: f64,
}

/// The covariance of a pole's real and imaginary part.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PoleError {
    /// Standard error of the real part.
    pub re: f64,
    /// Standard error of the imaginary part; 0 for a real pole.
    pub im: f64,
    /// Their covariance.
    pub covariance: f64,
    /// Standard error of the modulus.
    pub modulus: f64,
}

impl Precision {
    /// Of a model with a covariance; NaN without one, and of a multiple pole, which has no derivative.
    pub fn new(model: &LinearModel, poles: &[c64]) -> Self {
        let sum = |c: &[f64]| c.iter().sum::<f64>();
        let (a, b, f) = (sum(&model.a), sum(&model.b), sum(&model.f));
        let gain = b / (a * f);
        let orders = model.orders();
        // d gain / d theta, in the order A, B, C, D, F.
        let gradient: Vec<f64> = [
            vec![-gain / a; orders.na],
            vec![1.0 / (a * f); orders.nb],
            vec![0.0; orders.nc + orders.nd],
            vec![-gain / f; orders.nf],
        ]
        .concat();
        Self {
            poles: poles.iter().map(|pole| pole_error(model, *pole)).collect(),
            static_gain: gain,
            static_gain_se: product(model, &gradient, &gradient).sqrt(),
        }
    }
}

/// `x' P y` with the covariance of the parameters; NaN without one.
fn product(model: &LinearModel, x: &[f64], y: &[f64]) -> f64 {
    let n = x.len();
    if model.covariance.len() != n * n {
        return f64::NAN;
    }
    let rows = model.covariance.chunks_exact(n);
    rows.zip(x)
        .map(|(row, x)| x * row.iter().zip(y).map(|(p, y)| p * y).sum::<f64>())
        .sum()
}

/// A pole p is a zero of a monic polynomial P (A or F) of degree n: `dp/dc_i = -p^(n-i) / P'(p)`, P in powers of p.
fn pole_error(model: &LinearModel, pole: c64) -> PoleError {
    let orders = model.orders();
    let (n, first, polynomial) = nearest(model, pole);
    // P'(p) by Horner.
    let mut derivative = c64::new(0.0, 0.0);
    for (i, c) in polynomial[..n].iter().enumerate() {
        derivative = derivative * pole + (n - i) as f64 * *c;
    }
    let mut real = vec![0.0; orders.parameters()];
    let mut imaginary = real.clone();
    let mut power = c64::new(-1.0, 0.0) / derivative;
    for i in (1..=n).rev() {
        real[first + i - 1] = power.re;
        imaginary[first + i - 1] = if pole.im == 0.0 { 0.0 } else { power.im };
        power *= pole;
    }
    let (re, im) = (
        product(model, &real, &real),
        product(model, &imaginary, &imaginary),
    );
    let covariance = product(model, &real, &imaginary);
    let modulus = pole.norm();
    let of_modulus =
        (pole.re * pole.re * re + 2.0 * pole.re * pole.im * covariance + pole.im * pole.im * im)
            / (modulus * modulus);
    PoleError {
        re: re.sqrt(),
        im: im.sqrt(),
        covariance,
        modulus: of_modulus.sqrt(),
    }
}

/// The degree, the first parameter and the polynomial, A or F, that has the pole.
fn nearest(model: &LinearModel, pole: c64) -> (usize, usize, &[f64]) {
    let orders = model.orders();
    let value = |polynomial: &[f64]| {
        let zero = c64::new(0.0, 0.0);
        let value = polynomial.iter().fold(zero, |value, c| value * pole + *c);
        value.norm()
    };
    let of_f = (
        orders.nf,
        orders.parameters() - orders.nf,
        model.f.as_slice(),
    );
    let of_a = (orders.na, 0, model.a.as_slice());
    match (orders.na, orders.nf) {
        (0, _) => of_f,
        (_, 0) => of_a,
        _ if value(&model.a) <= value(&model.f) => of_a,
        _ => of_f,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PoleFinder;

    /// Derivatives against differences of the poles and of the gain themselves.
    #[test]
    fn derivatives_against_differences() {
        for orders in ["na=3,nb=2", "nb=2,nf=2", "na=1,nb=1,nf=2,nc=1"] {
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
                // With this covariance the standard error is the derivative's size.
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
                    let by =
                        |p: &&c64, q: &&c64| (**p - pole).norm().total_cmp(&(**q - pole).norm());
                    *poles.iter().min_by(by).unwrap()
                };
                let (low, high) = (poles_of(&low), poles_of(&high));
                for (pole, error) in poles.iter().zip(&precision.poles) {
                    let change = (near(&high, *pole) - near(&low, *pole)) / (2.0 * h);
                    assert!(
                        (error.re - change.re.abs()).abs() < 1e-5,
                        "{orders} {parameter}"
                    );
                    assert!(
                        (error.im - change.im.abs()).abs() < 1e-5,
                        "{orders} {parameter}"
                    );
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
        assert!(precision.static_gain_se.is_nan() && precision.poles[0].re.is_nan());
    }
}
