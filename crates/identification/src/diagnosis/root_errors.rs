//! Poles, zeros and static gain with their errors, and poles that the record cannot tell from zeros. The covariance of
//! the parameters is propagated by derivatives (the delta method).

use super::{CHI_SQUARE_2_95, Z_95};
use crate::metric::tails::normal_above;
use crate::model::{LinearModel, Orders};
use crate::plant::PoleFinder;
use faer::c64;
use serde::Serialize;

/// A pole or a zero of `B/(A F)`.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// Its value.
    pub at: c64,
    /// Its uncertainty; NaN without a covariance, and for a multiple root, which has no derivative.
    pub error: RootError,
}

/// The covariance of a root's real and imaginary part.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RootError {
    /// Standard error of the real part.
    pub re: f64,
    /// Standard error of the imaginary part; 0 for a real root.
    pub im: f64,
    /// Their covariance.
    pub covariance: f64,
    /// Standard error of the modulus.
    pub modulus: f64,
}

/// A pole and a zero that the record cannot tell apart. Their difference lies within its 95 % region about 0, and so
/// does `B` at the pole. The second condition excludes a distant zero with a large error.
#[derive(Clone, Copy, Debug)]
pub struct Cancellation {
    /// The pole; the upper one of a complex pair.
    pub pole: c64,
    /// The zero.
    pub zero: c64,
    /// The probability of such a difference, or a larger one, if pole and zero are equal; at least 5 %. For a
    /// difference d with covariance S, `d' S^-1 d` is chi-square, with 1 degree of freedom for real roots and 2 for
    /// complex ones.
    pub p_value: f64,
    /// Whether F has the pole, not A.
    in_f: bool,
}

/// A difference is significant if its probability is below this.
const LEVEL: f64 = 0.05;

impl Root {
    /// The boundary of the root's 95 % region as (real, imaginary): an ellipse of `points` points, or for a real root
    /// the two ends of an interval. `None` without a finite error.
    ///
    /// With the covariance `S = L L'`, the ellipse is `at + sqrt(5.991) L (cos t, sin t)`; its area is
    /// `5.991 pi sqrt(det S)`.
    pub fn region_95(&self, points: usize) -> Option<Vec<(f64, f64)>> {
        let RootError { re, im, covariance, .. } = self.error;
        if !(re.is_finite() && im.is_finite() && covariance.is_finite()) {
            return None;
        }
        let c64 { re: x, im: y } = self.at;
        if y == 0.0 {
            return Some(vec![(x - Z_95 * re, 0.0), (x + Z_95 * re, 0.0)]);
        }
        let scale = CHI_SQUARE_2_95.sqrt();
        let below = if re > 0.0 { covariance / re } else { 0.0 };
        let rest = (im * im - below * below).max(0.0).sqrt();
        let ends = (0..points).map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / points as f64).sin_cos();
            (x + scale * re * cos, y + scale * (below * cos + rest * sin))
        });
        Some(ends.collect())
    }
}

impl Cancellation {
    /// `|pole - zero|`.
    pub fn distance(&self) -> f64 {
        (self.pole - self.zero).norm()
    }

    /// The orders without the pair, or without both conjugate pairs.
    pub fn orders_without(&self, mut orders: Orders) -> Orders {
        let count = if self.pole.im == 0.0 { 1 } else { 2 };
        let of_poles = if self.in_f { &mut orders.nf } else { &mut orders.na };
        *of_poles -= count;
        orders.nb -= count;
        orders
    }
}

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
    /// Computes the precision of a model with given poles; standard errors are NaN without a covariance.
    pub fn new(model: &LinearModel, poles: &[c64]) -> Self {
        let numerator = Factor::numerator(model);
        let poles: Vec<Sensitive<'_>> = poles
            .iter()
            .map(|at| Sensitive::new(model, Factor::of_pole(model, *at), *at))
            .collect();
        let zeros: Vec<Sensitive<'_>> = numerator
            .roots()
            .into_iter()
            .map(|at| Sensitive::new(model, numerator, at))
            .collect();
        let root = |root: &Sensitive<'_>| Root {
            at: root.at,
            error: RootError::new(root.at, spread(&root.gradient, &root.weighted)),
        };
        Self {
            cancellations: cancellations(model, &poles, &zeros),
            poles: poles.iter().map(root).collect(),
            zeros: zeros.iter().map(root).collect(),
            static_gain: model.static_gain(),
            static_gain_se: model.variance_of(&model.static_gain_gradient()).sqrt(),
        }
    }
}

/// A polynomial in falling powers of z. Its coefficients from index `skipped` on are the parameters from index `first`
/// on.
#[derive(Clone, Copy)]
struct Factor<'a> {
    coefficients: &'a [f64],
    skipped: usize,
    first: usize,
}

impl<'a> Factor<'a> {
    /// B without its delay and leading zeros.
    fn numerator(model: &'a LinearModel) -> Self {
        let b = &model.b[model.delay..];
        let zeros = b.iter().take_while(|b| **b == 0.0).count();
        Self {
            coefficients: &b[zeros..],
            skipped: 0,
            first: model.orders().na + zeros,
        }
    }

    /// Returns A or F, whichever has the pole.
    fn of_pole(model: &'a LinearModel, pole: c64) -> Self {
        let orders = model.orders();
        let monic = |coefficients: &'a [f64], first| Self {
            coefficients,
            skipped: 1,
            first,
        };
        let of_f = monic(&model.f, orders.parameters() - orders.nf);
        let of_a = monic(&model.a, 0);
        match (orders.na, orders.nf) {
            (0, _) => of_f,
            (_, 0) => of_a,
            _ if of_a.value(pole).norm() <= of_f.value(pole).norm() => of_a,
            _ => of_f,
        }
    }

    fn degree(self) -> usize {
        self.coefficients.len().saturating_sub(1)
    }

    fn value(self, z: c64) -> c64 {
        let zero = c64::new(0.0, 0.0);
        let coefficients = self.coefficients.iter();
        coefficients.fold(zero, |value, c| value * z + *c)
    }

    fn derivative(self, z: c64) -> c64 {
        let n = self.degree();
        let mut value = c64::new(0.0, 0.0);
        for (i, c) in self.coefficients.iter().take(n).enumerate() {
            value = value * z + (n - i) as f64 * *c;
        }
        value
    }

    fn roots(self) -> Vec<c64> {
        let Some((leading, rest)) = self.coefficients.split_first() else {
            return Vec::new();
        };
        let a: Vec<f64> = rest.iter().rev().map(|c| -c / leading).collect();
        if a.is_empty() {
            return Vec::new();
        }
        PoleFinder::new(a.len()).poles(&a)
    }

    /// Adds `factor z^(n-i)` to the entry of each coefficient i: the derivative of `factor P(z)`.
    fn add_powers(self, z: c64, factor: c64, gradient: &mut [c64]) {
        let mut power = factor;
        for i in (self.skipped..self.coefficients.len()).rev() {
            gradient[self.first + i - self.skipped] += power;
            power *= z;
        }
    }
}

/// A root with its gradient with respect to the parameters, and the covariance of the parameters times that gradient.
struct Sensitive<'a> {
    at: c64,
    factor: Factor<'a>,
    gradient: Vec<c64>,
    weighted: Vec<c64>,
}

impl<'a> Sensitive<'a> {
    /// Computes the gradient of a root p of P: `dp/dc_i = -p^(n-i) / P'(p)`.
    fn new(model: &LinearModel, factor: Factor<'a>, at: c64) -> Self {
        let zero = c64::new(0.0, 0.0);
        let mut gradient = vec![zero; model.orders().parameters()];
        let by = c64::new(-1.0, 0.0) / factor.derivative(at);
        factor.add_powers(at, by, &mut gradient);
        if at.im == 0.0 {
            for derivative in &mut gradient {
                derivative.im = 0.0;
            }
        }
        let weighted = weighted(model, &gradient);
        Self {
            at,
            factor,
            gradient,
            weighted,
        }
    }
}

/// `P g` with the covariance of the parameters; NaN without one.
fn weighted(model: &LinearModel, gradient: &[c64]) -> Vec<c64> {
    let n = gradient.len();
    if model.covariance.len() != n * n {
        return vec![c64::new(f64::NAN, f64::NAN); n];
    }
    let rows = model.covariance.chunks_exact(n.max(1));
    rows.map(|row| row.iter().zip(gradient).map(|(p, g)| g * *p).sum())
        .collect()
}

/// Variances of the real and the imaginary part of `g' theta` and their covariance, from g and P g.
fn spread(gradient: &[c64], weighted: &[c64]) -> [f64; 3] {
    let mut spread = [0.0; 3];
    for (g, w) in gradient.iter().zip(weighted) {
        spread[0] += g.re * w.re;
        spread[1] += g.im * w.im;
        spread[2] += g.re * w.im;
    }
    spread
}

impl RootError {
    fn new(at: c64, [re, im, covariance]: [f64; 3]) -> Self {
        let of_modulus = (at.re * at.re * re + 2.0 * at.re * at.im * covariance + at.im * at.im * im) / at.norm_sqr();
        // Rounding may make a zero variance negative; NaN is kept.
        let error = |variance: f64| if variance < 0.0 { 0.0 } else { variance.sqrt() };
        Self {
            re: error(re),
            im: error(im),
            covariance,
            modulus: error(of_modulus),
        }
    }
}

/// The probability of a complex or real number at least this far from 0; NaN if a complex number's covariance is
/// singular.
fn chance(value: c64, real: bool, [re, im, covariance]: [f64; 3]) -> f64 {
    if real {
        return 2.0 * normal_above(value.re.abs() / re.sqrt());
    }
    let determinant = re * im - covariance * covariance;
    if determinant <= 0.0 {
        return f64::NAN;
    }
    let square =
        (im * value.re * value.re - 2.0 * covariance * value.re * value.im + re * value.im * value.im) / determinant;
    (-square / 2.0).exp()
}

fn cancellations(model: &LinearModel, poles: &[Sensitive<'_>], zeros: &[Sensitive<'_>]) -> Vec<Cancellation> {
    let numerator = Factor::numerator(model);
    let less = |a: &[c64], b: &[c64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
    let mut pairs = Vec::new();
    for pole in poles.iter().filter(|pole| pole.at.im >= 0.0) {
        let real = pole.at.im == 0.0;
        // B at the pole: dB(p) = B'(p) dp + sum p^(n-i) db_i.
        let of_numerator = || {
            let slope = numerator.derivative(pole.at);
            let mut gradient: Vec<c64> = pole.gradient.iter().map(|g| g * slope).collect();
            numerator.add_powers(pole.at, c64::new(1.0, 0.0), &mut gradient);
            let spread = spread(&gradient, &weighted(model, &gradient));
            chance(numerator.value(pole.at), real, spread)
        };
        let alike = |zero: &&Sensitive<'_>| zero.at.im >= 0.0 && (zero.at.im == 0.0) == real;
        for zero in zeros.iter().filter(alike) {
            let gradient = less(&pole.gradient, &zero.gradient);
            let spread = spread(&gradient, &less(&pole.weighted, &zero.weighted));
            let apart = chance(pole.at - zero.at, real, spread);
            if apart >= LEVEL && of_numerator() >= LEVEL {
                pairs.push(Cancellation {
                    pole: pole.at,
                    zero: zero.at,
                    p_value: apart,
                    in_f: std::ptr::eq(pole.factor.coefficients, model.f.as_slice()),
                });
            }
        }
    }
    pairs.sort_by(|a, b| a.distance().total_cmp(&b.distance()));
    // Keeps each pole and each zero once.
    let mut kept: Vec<Cancellation> = Vec::new();
    for pair in pairs {
        if kept.iter().all(|k| k.pole != pair.pole && k.zero != pair.zero) {
            kept.push(pair);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

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
