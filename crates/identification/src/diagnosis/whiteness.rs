//! Tests of residuals: whether they are white and free of the input (Ljung, *System Identification*, 2nd ed., section
//! 16.6).

use super::Z_99;
use super::outliers::{Outlier, outliers};
use super::past_input::past_input;
use super::verdict::{LAGS, Whiteness};
use crate::data::Rounding;
use crate::estimator::InitialCondition;
use crate::metric::prediction_errors;
use crate::metric::tails::chi_square_above;
use crate::model::{LinearModel, Orders};
use crate::signal::arithmetic::dot;
use serde::Serialize;

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
    /// Whether the residuals are as small as the rounding of the record's numbers makes them: nothing is tested.
    pub fits_to_rounding: bool,
    /// The verdict on whiteness, by Ljung and Box's statistic; `None` if the model fits to rounding.
    pub white: Option<Whiteness>,
    /// The F test of added lags of u, in residuals that zeros before the record make where the model has them. If it
    /// fails, the model misses part of the effect of u. `None` if the model fits to rounding, or if nothing is left to
    /// test with this input.
    pub free_of_past_input: Option<Whiteness>,
    /// Residuals beyond what as many normal numbers show, the largest first.
    pub outliers: Vec<Outlier>,
}

/// Returns `1/M sum_k x(k + lag) z(k)` for as many lags, from 0 on.
fn covariances(x: &[f64], z: &[f64], lags: usize) -> Vec<f64> {
    /// Samples that all lags use while they are in the first-level cache.
    const CHUNK: usize = 1024;
    let rows = z.len();
    let mut sums = vec![0.0; lags];
    with_fma!(|| {
        for (place, z) in z.chunks(CHUNK).enumerate() {
            for (lag, sum) in sums.iter_mut().enumerate() {
                let late = x.get(place * CHUNK + lag..).unwrap_or_default();
                let count = late.len().min(z.len());
                *sum += dot(&late[..count], &z[..count]);
            }
        }
    });
    sums.iter().map(|sum| sum / rows as f64).collect()
}

impl Whiteness {
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
}

impl Residuals {
    /// Tests whether the residuals of several records are white: their statistics of Ljung and Box add, and the
    /// parameters of the model are fitted once.
    pub fn white_together<'a>(records: impl Iterator<Item = &'a Self>, orders: Orders) -> Option<Whiteness> {
        let records = records.filter(|record| !record.fits_to_rounding);
        let (statistic, lags) = records.fold((0.0, 0), |(sum, lags), record| {
            (sum + record.ljung_box, lags + record.lags())
        });
        let degrees = lags.saturating_sub(orders.na + orders.nc + orders.nd);
        let p_value = chi_square_above(statistic, degrees.max(1));
        (lags > 0).then(|| Whiteness::new(degrees.max(1), p_value))
    }

    /// Computes the one-step prediction errors of a model over a record and tests them. `None` if there is no start, if
    /// there are fewer than four residuals, or if residuals or u are all 0 or not finite. `start` is that of the model:
    /// zeros before the record, or the start of [`prediction_errors`], which the F test fits too.
    ///
    /// Ljung and Box's statistic has as many degrees of freedom as there are lags, less the parameters of A, C and D,
    /// which are fitted to the past of the noise. In open loop those of B and F are not.
    pub fn new(model: &LinearModel, u: &[f64], y: &[f64], start: InitialCondition, rounding: Rounding) -> Option<Self> {
        let (whole_u, samples) = (u, u.len());
        let told_by = match start {
            InitialCondition::Zero => 0,
            InitialCondition::Estimate => u.len(),
        };
        let (first, e) = prediction_errors(model, u, y, told_by)?;
        let orders = model.orders();
        let (e, u) = (&e[first..], &u[first..]);
        let rows = e.len();
        let lags = LAGS.min(rows / 4);
        let m = rows as f64;
        let autocovariances = covariances(e, e, lags + 1);
        let of_u = covariances(u, u, lags + 1);
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
        let ljung_box = m * (m + 2.0) * squares.map(|(lag, r)| r * r / (m - lag as f64)).sum::<f64>();
        let degrees = lags.saturating_sub(orders.na + orders.nc + orders.nd).max(1);
        let outside = |values: &[f64]| values.iter().filter(|r| r.abs() > bound).count();
        let fits_to_rounding = variance <= largest_rounding(model, rounding, samples);
        Some(Self {
            rows,
            rss: variance * m,
            bound_r_e_99: bound,
            bound_r_eu_simple_99: bound,
            bound_cross_99: Z_99 * (cross_variance / m).sqrt(),
            autocorrelations_outside: outside(&autocorrelations[1..]),
            crosscorrelations_outside_simple: outside(&crosscorrelations),
            fits_to_rounding,
            white: (!fits_to_rounding).then(|| Whiteness::new(degrees, chi_square_above(ljung_box, degrees))),
            free_of_past_input: if fits_to_rounding {
                None
            } else {
                past_input(model, whole_u, y, start)
            },
            outliers: if fits_to_rounding {
                Vec::new()
            } else {
                outliers(e, first, rounding.y)
            },
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

    /// Takes the covariances, which are of signals in this unit, a power of two, for those of the signals themselves.
    pub fn set_unit(&mut self, unit: f64) {
        let square = unit * unit;
        let lists = self.autocovariances.iter_mut().chain(&mut self.crosscovariances);
        let numbers = [&mut self.rss, &mut self.input_variance, &mut self.bound_cross_99];
        lists.chain(numbers).for_each(|product| *product *= square);
        self.cross_variance *= square * square;
    }

    /// The largest lag.
    pub fn lags(&self) -> usize {
        self.autocovariances.len() - 1
    }
}

/// Returns the variance up to which residuals are rounding: four times that of the rounding errors, `r^2/12` each,
/// through
/// `D A/C` from y and `D B/(C F)` from u; 0 if it is not finite.
fn largest_rounding(model: &LinearModel, rounding: Rounding, samples: usize) -> f64 {
    /// Impulse responses are summed over at most so many samples.
    const LONG: usize = 2000;
    let samples = samples.min(LONG);
    let mut impulse = vec![0.0; samples];
    impulse[0] = 1.0;
    let zero = vec![0.0; samples];
    let mut scratch = zero.clone();
    let mut squares = |u: &[f64], y: &[f64]| {
        let mut e = vec![0.0; samples];
        model.residuals(u, y, &mut e, &mut scratch);
        e.iter().map(|e| e * e).sum::<f64>()
    };
    let of_y = squares(&zero, &impulse) * rounding.y * rounding.y;
    let of_u = squares(&impulse, &zero) * rounding.u * rounding.u;
    let largest = (of_y + if of_u > 0.0 { of_u } else { 0.0 }) / 3.0;
    if largest.is_finite() { largest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let (n, trials) = (400, 1000);
        let mut model = LinearModel::zero("nb=1".parse().unwrap());
        model.b[1] = 1.0;
        let tests = |model: &LinearModel, u: &[f64], y: &[f64]| {
            let start = InitialCondition::Estimate;
            let found = Residuals::new(model, u, y, start, Rounding::default()).unwrap();
            [found.white, found.free_of_past_input].map(|test| u64::from(!test.unwrap().passed))
        };
        let (mut alarms, mut found) = ([0; 2], [0; 2]);
        for trial in 0..trials {
            let (u, e) = (normal(trial, Purpose::Input, n), normal(trial, Purpose::Plant, n));
            let mut y: Vec<f64> = (0..n).map(|k| e[k] + if k > 0 { u[k - 1] } else { 0.0 }).collect();
            for (alarms, alarm) in alarms.iter_mut().zip(tests(&model, &u, &y)) {
                *alarms += alarm;
            }
            if trial < 100 {
                // A second delay that the model does not have, and noise with memory.
                for k in (2..n).rev() {
                    y[k] += 0.3 * u[k - 2];
                }
                found[0] += tests(&model, &u, &y)[1];
                let coloured: Vec<f64> = (0..n)
                    .map(|k| y[k] + if k > 0 { 0.5 * e[k - 1] } else { 0.0 })
                    .collect();
                found[1] += tests(&model, &u, &coloured)[0];
            }
        }
        // 10 are expected: fewer than 1 or more than 25 have a chance below 1e-4 (binomial).
        for alarms in alarms {
            assert!((1..=25).contains(&alarms), "{alarms}");
        }
        assert!(found.iter().all(|found| *found >= 98), "{found:?}");
    }

    /// A record without noise, printed with five decimals, fits to rounding: no test is made. With noise of three units
    /// of the last decimal it is tested.
    #[test]
    fn exact_records_are_not_tested() {
        let n = 300;
        let mut model = LinearModel::zero("nb=2,nf=2".parse().unwrap());
        model.set_parameters(&[1.0, 0.5, -1.5, 0.7]);
        let (u, e) = (normal(1, Purpose::Input, n), normal(1, Purpose::Plant, n));
        let mut y = vec![0.0; n];
        model.simulate(&u, &mut y);
        for (size, exact) in [(0.0, true), (3e-5, false)] {
            let printed = |x: f64| (x * 1e5).round() / 1e5;
            let y: Vec<f64> = y.iter().zip(&e).map(|(y, e)| printed(y + size * e)).collect();
            let rounding = Rounding::of(&u, &y);
            let found = Residuals::new(&model, &u, &y, InitialCondition::Zero, rounding).unwrap();
            assert_eq!(found.fits_to_rounding, exact, "{size}");
            assert_eq!(found.white.is_none(), exact);
            assert_eq!(found.free_of_past_input.is_none(), exact);
        }
    }
}
