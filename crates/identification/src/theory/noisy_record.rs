//! The Fisher information of a finite record from rest whose input is measured with noise.

use super::matrix::Matrix;
use crate::estimator::BandRoot;
use crate::model::LinearModel;
use crate::model::polynomial::{delayed, divide, filter};
use crate::signal::arithmetic::dot;

/// The information about `f, b, s_r, s_u, s_y` ([`super::RecordInformation::of_noisy_input`]); `None` if the
/// covariance is not positive definite.
///
/// Given u, y is Gaussian with mean `kappa T u` and covariance `R = q T T' + s_y I`, with `kappa = s_r / a`,
/// `q = s_r s_u / a`, and u is white with variance `a = s_r + s_u`. So
///
/// ```text
/// F_ij = N a_i a_j / (2 a^2) + a tr((kappa T)_i' R^-1 (kappa T)_j) + tr(R^-1 R_i R^-1 R_j) / 2.
/// ```
///
/// With `T = T_F^-1 T_B`, `T_F R T_F' = q T_B T_B' + s_y T_F T_F' = L L'` is a band matrix, and `R_i` appears as
/// `W_i = L^-1 T_F R_i T_F' L^-T`. Both traces are summed column by column, each in O(N p n).
pub(super) fn noisy_record(model: &LinearModel, variances: [f64; 3], samples: usize) -> Option<Matrix> {
    let [s_r, s_u, s_y] = variances;
    if !variances.iter().all(|of| *of > 0.0) {
        return None;
    }
    let a = s_r + s_u;
    let (kappa, q) = (s_r / a, s_r * s_u / a);
    let root = BandRoot::new(&[(q, &model.b), (s_y, &model.f)], samples)?;
    let of = Slopes { model, root: &root };
    let count = model.orders().parameters();
    // Derivatives by s_r, s_u, s_y.
    let of_a = [1.0, 1.0, 0.0];
    let of_kappa = [s_u / (a * a), -s_r / (a * a), 0.0];
    let of_q = [(s_u / a).powi(2), (s_r / a).powi(2), 0.0];
    let mut sum = Matrix::zeros(count + 3, count + 3);
    for column in 0..samples {
        let mut unit = vec![0.0; samples];
        unit[column] = 1.0;
        let mut mean = of.forward(&unit);
        for x in mean.iter_mut().flatten() {
            *x *= kappa * a.sqrt();
        }
        let gain = of.whitened(&model.b, &unit);
        mean.extend(of_kappa.map(|by| gain.iter().map(|x| by * a.sqrt() * x).collect()));
        add_products(&mean, 1.0, &mut sum);
        root.solve_transposed(&mut unit);
        let (by_b, by_f) = (correlate(&model.b, &unit), correlate(&model.f, &unit));
        let mut spread = of.forward(&by_b);
        for (to, late) in spread.iter_mut().zip(of.backward(&unit)) {
            let late = of.whitened(&model.b, &late);
            to.iter_mut().zip(late).for_each(|(to, x)| *to = q * (*to + x));
        }
        let (by_b, by_f) = (of.whitened(&model.b, &by_b), of.whitened(&model.f, &by_f));
        spread.extend(of_q.map(|by| by_b.iter().map(|x| by * x).collect()));
        spread[count + 2] = by_f;
        add_products(&spread, 0.5, &mut sum);
    }
    let of_input = |i: usize| i.checked_sub(count).map_or(0.0, |i| of_a[i] / a);
    Some(Matrix::from_fn(count + 3, count + 3, |i, j| {
        sum[(i.max(j), i.min(j))] + 0.5 * samples as f64 * of_input(i) * of_input(j)
    }))
}

/// Adds the weighted products of all pairs, in the lower triangle.
fn add_products(of: &[Vec<f64>], weight: f64, sum: &mut Matrix) {
    for (i, x) in of.iter().enumerate() {
        for (j, y) in of[..=i].iter().enumerate() {
            sum[(i, j)] += weight * dot(x, y);
        }
    }
}

/// `T_c' x`.
fn correlate(c: &[f64], x: &[f64]) -> Vec<f64> {
    let sum = |k: usize| c.iter().zip(&x[k..]).map(|(c, x)| c * x).sum();
    (0..x.len()).map(sum).collect()
}

/// The maps `S_i = T_F T_i`, `T_i` the derivative of T: `-q^-i B/F` by f_i and `q^-i` by b_i.
struct Slopes<'a> {
    model: &'a LinearModel,
    root: &'a BandRoot,
}

impl Slopes<'_> {
    fn response(&self, x: &[f64]) -> Vec<f64> {
        let mut response = vec![0.0; x.len()];
        filter(&self.model.b, x, &mut response);
        divide(&self.model.f, &mut response);
        response
    }

    /// The lags of `-B/F x` and of x that f and b have.
    fn lags<'b>(&self, response: &'b [f64], x: &'b [f64]) -> Vec<(&'b [f64], usize, f64)> {
        let LinearModel { b, f, delay, .. } = self.model;
        let of_f = (1..f.len()).map(|i| (response, i, -1.0));
        of_f.chain((*delay..b.len()).map(|i| (x, i, 1.0))).collect()
    }

    /// `L^-1 S_i x` of all parameters.
    fn forward(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let response = self.response(x);
        let solved = |(x, by, sign): (&[f64], usize, f64)| {
            let mut y = delayed(x, by, sign);
            self.root.solve(&mut y);
            y
        };
        self.lags(&response, x).into_iter().map(solved).collect()
    }

    /// `S_i' x` of all parameters: the same backwards in time.
    fn backward(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let reversed: Vec<f64> = x.iter().rev().copied().collect();
        let mut response = self.response(&reversed);
        response.reverse();
        let advanced = |(x, by, sign): (&[f64], usize, f64)| {
            let late = x.get(by..).unwrap_or_default();
            let mut y: Vec<f64> = late.iter().map(|x| sign * x).collect();
            y.resize(x.len(), 0.0);
            y
        };
        self.lags(&response, x).into_iter().map(advanced).collect()
    }

    /// `L^-1 T_c x`.
    fn whitened(&self, c: &[f64], x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        filter(c, x, &mut y);
        self.root.solve(&mut y);
        y
    }
}
