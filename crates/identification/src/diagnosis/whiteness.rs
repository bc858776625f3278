//! Tests of residuals: whether they are white and uncorrelated with the input (Ljung, *System Identification*, 2nd ed.,
//! section 16.6).

use super::{LEVEL, Z_99};
use crate::metric::prediction_errors;
use crate::metric::tails::{chi_square_above, normal_above};
use crate::model::{LinearModel, Orders};
use crate::signal::arithmetic::{dot, with_fma};
use faer::linalg::solvers::Solve as _;
use faer::{Mat, Side};
use serde::Serialize;
use std::ops::Range;

/// Largest lag tested.
const LAGS: usize = 25;

/// Correlations of residuals e with themselves and with the input u, over M samples:
/// `R_e(tau) = 1/M sum e(k) e(k - tau)`, `R_eu(tau) = 1/M sum e(k) u(k - tau)`.
#[derive(Clone, Debug, Serialize)]
pub struct Residuals {
    /// Number M of residuals.
    pub rows: usize,
    /// `sum e^2`.
    pub rss: f64,
    /// `R_e(tau)`, tau = 0 ... 25 (fewer if there are fewer than 100 residuals).
    #[serde(rename = "R_e")]
    pub autocovariances: Vec<f64>,
    /// `r_e = R_e / R_e(0)`.
    #[serde(rename = "r_e")]
    pub autocorrelations: Vec<f64>,
    /// `R_eu(tau)`, tau = -25 ... 25; positive tau is the past of u.
    #[serde(rename = "R_eu")]
    pub crosscovariances: Vec<f64>,
    /// `r_eu = R_eu / sqrt(R_e(0) R_u(0))`.
    #[serde(rename = "r_eu")]
    pub crosscorrelations: Vec<f64>,
    /// `R_u(0)`.
    #[serde(rename = "R_u0")]
    pub input_variance: f64,
    /// 99 % bound of one `|r_e(tau)|` of white residuals: `2.576 / sqrt(M)`.
    pub bound_r_e_99: f64,
    /// 99 % bound of one `|r_eu(tau)|` if e or u is white.
    pub bound_r_eu_simple_99: f64,
    /// `R_e(0) R_u(0) + 2 sum_(tau = 1)^25 R_e(tau) R_u(tau)`, the variance of `sqrt(M) R_eu(tau)`.
    #[serde(rename = "P1")]
    pub cross_variance: f64,
    /// 99 % bound of one `|R_eu(tau)|`: `2.576 sqrt(P1 / M)`.
    #[serde(rename = "bound_R_eu_99")]
    pub bound_cross_99: f64,
    /// Lags above 0 where `|r_e|` is beyond its bound.
    pub autocorrelations_outside: usize,
    /// Lags where `|r_eu|` is beyond its simple bound.
    pub crosscorrelations_outside_simple: usize,
    /// `M sum r_e(tau)^2`.
    pub box_pierce: f64,
    /// `M (M + 2) sum r_e(tau)^2 / (M - tau)`.
    pub ljung_box: f64,
    /// The verdict on whiteness.
    pub white: Whiteness,
    /// The test of `R_eu(tau)`, tau = nk ... 25: the largest, and all together by chi-square with as many degrees of
    /// freedom as lags less the parameters of B and F; the p-value is that of the smaller one of two. If it fails, the
    /// model misses part of the effect of u.
    pub free_of_past_input: Whiteness,
    /// The same for tau below 0. If it fails, y acts on u, as under feedback.
    pub free_of_future_input: Whiteness,
}

/// A test at 1 %.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Whiteness {
    /// Degrees of freedom, or the number of lags that share the 1 %.
    pub degrees: usize,
    /// The probability of this result or a worse one if the residuals satisfy the hypothesis; by Sidak's inequality if
    /// lags share it.
    pub p_value: f64,
    /// Whether the p-value is at least 1 %.
    pub passed: bool,
}

impl Whiteness {
    fn new(degrees: usize, p_value: f64) -> Self {
        Self {
            degrees,
            p_value,
            passed: p_value >= LEVEL,
        }
    }

    /// Tests whether numbers of mean zero are white, by Ljung and Box's statistic over up to 25 lags less the
    /// parameters that were fitted to them. `None` of fewer than four numbers, or if they are all 0 or not finite.
    pub fn of(e: &[f64], fitted: usize) -> Option<Self> {
        let (lags, m) = (LAGS.min(e.len() / 4), e.len() as f64);
        let r = covariances(e, e, lags + 1);
        if lags == 0 || !(r[0] > 0.0 && r[0].is_finite()) {
            return None;
        }
        let terms = (1..=lags).map(|lag| (r[lag] / r[0]).powi(2) / (m - lag as f64));
        let degrees = lags.saturating_sub(fitted).max(1);
        let statistic = m * (m + 2.0) * terms.sum::<f64>();
        Some(Self::new(degrees, chi_square_above(statistic, degrees)))
    }

    /// Tests the largest of covariances with mean zero and standard deviation `unit`, by Sidak's inequality.
    fn largest(covariances: &[f64], unit: f64) -> Self {
        let largest = covariances.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        let (single, count) = (2.0 * normal_above(largest / unit), covariances.len());
        Self::new(count, any_of(single, count))
    }
}

/// Returns the largest probability that one of `count` normal values is as unlikely as `single`, whatever their
/// correlations: `1 - (1 - single)^count` (Sidak, J. Amer. Statist. Assoc. 62 (1967), 626-633).
fn any_of(single: f64, count: usize) -> f64 {
    -(count as f64 * (-single).ln_1p()).exp_m1()
}

/// Returns `1/M sum_k x(k + lag) z(k)` for as many lags, from 0 on.
fn covariances(x: &[f64], z: &[f64], lags: usize) -> Vec<f64> {
    /// Samples that all lags use while they are in the first-level cache.
    const CHUNK: usize = 1024;
    let rows = z.len();
    let mut sums = vec![0.0; lags];
    with_fma(
        #[inline(always)]
        || {
            for (place, z) in z.chunks(CHUNK).enumerate() {
                for (lag, sum) in sums.iter_mut().enumerate() {
                    let late = x.get(place * CHUNK + lag..).unwrap_or_default();
                    let count = late.len().min(z.len());
                    *sum += dot(&late[..count], &z[..count]);
                }
            }
        },
    );
    sums.iter().map(|sum| sum / rows as f64).collect()
}

/// Returns `r' P^-1 r` for covariances r of e and u at successive lags. P, with entries
/// `P(h) = sum_tau w(tau) R_e(tau) R_u(tau + h)`, is the covariance of `sqrt(M) r`; the weights
/// `w = 1 - |tau|/(lags + 1)` keep it positive definite; R_e is known for all these lags, R_u for those and as many as
/// r has. `None` if P is singular up to rounding.
fn together(r: &[f64], of_e: &[f64], of_u: &[f64]) -> Option<f64> {
    let (lags, count) = (of_e.len() - 1, r.len());
    let p: Vec<f64> = (0..count)
        .map(|h| {
            let term = |tau: usize| {
                let weight = 1.0 - tau as f64 / (lags + 1) as f64;
                let both = if tau == 0 {
                    of_u[h]
                } else {
                    of_u[tau + h] + of_u[tau.abs_diff(h)]
                };
                weight * of_e[tau] * both
            };
            (0..=lags).map(term).sum()
        })
        .collect();
    let matrix = Mat::from_fn(count, count, |i, j| p[i.abs_diff(j)]);
    let solved = matrix
        .llt(Side::Lower)
        .ok()?
        .solve(Mat::from_fn(count, 1, |i, _| r[i]));
    let square: f64 = r.iter().enumerate().map(|(i, r)| r * solved[(i, 0)]).sum();
    square.is_finite().then_some(square)
}

impl Residuals {
    /// Tests whether the residuals of several records are white: their statistics of Ljung and Box add, and the
    /// parameters of the model are fitted once.
    pub fn white_together<'a>(
        records: impl Iterator<Item = &'a Self>,
        orders: Orders,
    ) -> Option<Whiteness> {
        let (statistic, lags) = records.fold((0.0, 0), |(sum, lags), record| {
            (sum + record.ljung_box, lags + record.lags())
        });
        let degrees = lags.saturating_sub(orders.na + orders.nc + orders.nd);
        let p_value = chi_square_above(statistic, degrees.max(1));
        (lags > 0).then(|| Whiteness::new(degrees.max(1), p_value))
    }

    /// Computes the one-step prediction errors of a model over a record, with the start of [`prediction_errors`], and
    /// tests them. `None` if there is no start, if there are fewer than four residuals, or if residuals or u are all 0
    /// or not finite.
    ///
    /// Ljung and Box's statistic has as many degrees of freedom as there are lags, less the parameters of A, C and D,
    /// which are fitted to the past of the noise. In open loop those of B and F are not.
    pub fn new(model: &LinearModel, u: &[f64], y: &[f64]) -> Option<Self> {
        let (first, e) = prediction_errors(model, u, y, u.len())?;
        let orders = model.orders();
        let (e, u) = (&e[first..], &u[first..]);
        let rows = e.len();
        let lags = LAGS.min(rows / 4);
        let m = rows as f64;
        let autocovariances = covariances(e, e, lags + 1);
        let of_u = covariances(u, u, 2 * lags + 1);
        let future = covariances(u, e, lags + 1).into_iter().skip(1).rev();
        let past = covariances(e, u, lags + 1);
        let crosscovariances: Vec<f64> = future.chain(past).collect();
        let (variance, input_variance) = (autocovariances[0], of_u[0]);
        let scale = (variance * input_variance).sqrt();
        if rows < 3 || lags == 0 || !(scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let autocorrelations: Vec<f64> = autocovariances.iter().map(|r| r / variance).collect();
        let crosscorrelations: Vec<f64> = crosscovariances.iter().map(|r| r / scale).collect();
        let products = autocovariances.iter().zip(&of_u).skip(1);
        let cross_variance = scale * scale + 2.0 * products.map(|(e, u)| e * u).sum::<f64>();
        let bound = Z_99 / m.sqrt();
        let squares = autocorrelations.iter().enumerate().skip(1);
        let box_pierce = m * squares.clone().map(|(_, r)| r * r).sum::<f64>();
        let ljung_box = m
            * (m + 2.0)
            * squares
                .map(|(lag, r)| r * r / (m - lag as f64))
                .sum::<f64>();
        let degrees = lags
            .saturating_sub(orders.na + orders.nc + orders.nd)
            .max(1);
        let outside = |values: &[f64]| values.iter().filter(|r| r.abs() > bound).count();
        // A sum truncated at 25 lags need not be positive.
        let unit = (cross_variance.max(f64::EPSILON * scale * scale) / m).sqrt();
        let free = |range: Range<usize>| Whiteness::largest(&crosscovariances[range], unit);
        let past = lags + orders.nk.min(lags)..2 * lags + 1;
        let largest = free(past.clone());
        let fitted = (past.len() - 1).min(orders.nb + orders.nf);
        let degrees_of_past = past.len() - fitted;
        // Fitted parameters make the covariances small, so that the largest alone says nothing of a right model.
        let free_of_past_input = match together(&crosscovariances[past], &autocovariances, &of_u) {
            Some(square) => {
                let all = chi_square_above(m * square, degrees_of_past);
                Whiteness::new(degrees_of_past, any_of(largest.p_value.min(all), 2))
            }
            None => largest,
        };
        Some(Self {
            rows,
            rss: variance * m,
            bound_r_e_99: bound,
            bound_r_eu_simple_99: bound,
            bound_cross_99: Z_99 * (cross_variance / m).sqrt(),
            autocorrelations_outside: outside(&autocorrelations[1..]),
            crosscorrelations_outside_simple: outside(&crosscorrelations),
            white: Whiteness::new(degrees, chi_square_above(ljung_box, degrees)),
            free_of_past_input,
            free_of_future_input: free(0..lags),
            autocovariances,
            autocorrelations,
            crosscovariances,
            crosscorrelations,
            input_variance,
            cross_variance,
            box_pierce,
            ljung_box,
        })
    }

    /// The probability of these correlations or larger ones if there is no feedback from y to u. Two tests are made: e
    /// with u(k) ... u(k + 5), where feedback acts first, and e with all future u. The result is that of the
    /// smaller p-value of two. The plant must not have a direct term.
    pub fn feedback_p_value(&self) -> f64 {
        const NEAR: usize = 5;
        let lags = self.lags();
        let scale = self.autocovariances[0] * self.input_variance;
        let unit = (self.cross_variance.max(f64::EPSILON * scale) / self.rows as f64).sqrt();
        let near = &self.crosscovariances[lags.saturating_sub(NEAR)..=lags];
        let near = Whiteness::largest(near, unit).p_value;
        any_of(near.min(self.free_of_future_input.p_value), 2)
    }

    /// Takes the covariances, which are of signals in this unit, a power of two, for those of the signals themselves.
    pub fn set_unit(&mut self, unit: f64) {
        let square = unit * unit;
        let lists = self
            .autocovariances
            .iter_mut()
            .chain(&mut self.crosscovariances);
        let numbers = [
            &mut self.rss,
            &mut self.input_variance,
            &mut self.bound_cross_99,
        ];
        lists.chain(numbers).for_each(|product| *product *= square);
        self.cross_variance *= square * square;
    }

    /// The largest lag.
    pub fn lags(&self) -> usize {
        self.autocovariances.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{MethodKind as _, Pass, Shape, Window};
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

    fn normal(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
        let mut signal = vec![0.0; n];
        let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
        input.fill(&mut stream(53, trial, purpose), &mut signal);
        signal
    }

    /// With true residuals each test raises a false alarm in about 1 % of the records; with wrong ones, an alarm in
    /// nearly all.
    #[test]
    fn false_alarms_are_as_rare_as_stated() {
        let (n, trials) = (400, 2000);
        let mut model = LinearModel::zero("nb=1".parse().unwrap());
        model.b[1] = 1.0;
        let (mut alarms, mut found) = ([0; 3], [0; 2]);
        for trial in 0..trials {
            let (u, e) = (
                normal(trial, Purpose::Input, n),
                normal(trial, Purpose::Plant, n),
            );
            let mut y: Vec<f64> = (0..n)
                .map(|k| e[k] + if k > 0 { u[k - 1] } else { 0.0 })
                .collect();
            let residuals = Residuals::new(&model, &u, &y).unwrap();
            let tests = [
                residuals.white,
                residuals.free_of_past_input,
                residuals.free_of_future_input,
            ];
            for (alarms, test) in alarms.iter_mut().zip(tests) {
                *alarms += u32::from(!test.passed);
            }
            if trial < 100 {
                // A second delay that the model does not have, and noise with memory.
                for k in (2..n).rev() {
                    y[k] += 0.3 * u[k - 2];
                }
                let residuals = Residuals::new(&model, &u, &y).unwrap();
                found[0] += u32::from(!residuals.free_of_past_input.passed);
                let coloured: Vec<f64> = (0..n)
                    .map(|k| y[k] + if k > 0 { 0.5 * e[k - 1] } else { 0.0 })
                    .collect();
                found[1] += u32::from(!Residuals::new(&model, &u, &coloured).unwrap().white.passed);
            }
        }
        // Five standard errors of a share of 1 % of 2000 are 1.1 %. The chi-square and normal laws hold as N grows.
        for alarms in alarms {
            assert!((5..=45).contains(&alarms), "{alarms}");
        }
        assert!(found.iter().all(|found| *found >= 98), "{found:?}");
    }

    /// Residuals of right models whose parameters were fitted: the p-values are spread over 0 to 1 instead of lying at
    /// 1.
    #[test]
    fn fitted_parameters_do_not_hide_behind_a_p_value_of_one() {
        let (n, trials) = (300, 400);
        let mut values = Vec::new();
        let mut truth = LinearModel::zero("nb=1,nf=1".parse().unwrap());
        (truth.b[1], truth.f[1]) = (1.0, -0.7);
        let options = crate::estimator::OeOptions {
            orders: Some(truth.orders()),
            ..Default::default()
        };
        let shape = Shape {
            order: 1,
            window: n,
        };
        let mut method = options.prepare(&shape.into()).unwrap();
        for trial in 0..trials {
            let (u, e) = (
                normal(trial, Purpose::Input, n),
                normal(trial, Purpose::Plant, n),
            );
            let mut y = vec![0.0; n];
            truth.simulate(&u, &mut y);
            y.iter_mut().zip(&e).for_each(|(y, e)| *y += e);
            let mut passes = [Pass::new(1)];
            method.estimate(Window::new(&u, &y, n), &mut passes);
            let residuals = Residuals::new(&passes[0].model, &u, &y).unwrap();
            values.push(residuals.free_of_past_input.p_value);
        }
        let below = |p: f64| values.iter().filter(|value| **value < p).count();
        // Two tests at half the level each: conservative, at 1 % too (expected 4, standard error 2).
        assert!(below(0.01) <= 10, "{}", below(0.01));
        assert!((120..=280).contains(&below(0.7)), "{}", below(0.7));
        assert!(below(0.999) >= 380, "{}", below(0.999));
    }
}
