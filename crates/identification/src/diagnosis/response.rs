//! Step and frequency response of `G = B/(A F)` with standard errors. The covariance of the parameters is propagated by
//! the derivatives of the responses (the delta method).

use crate::model::LinearModel;
use crate::model::polynomial::{divide, value};
use faer::c64;

/// The step response at one k.
#[derive(Clone, Copy, Debug)]
pub struct StepPoint {
    /// The output k samples after a unit step of u, from rest.
    pub value: f64,
    /// Its standard error; NaN without a covariance.
    pub se: f64,
}

/// The frequency response at one frequency.
#[derive(Clone, Copy, Debug)]
pub struct FrequencyPoint {
    /// The frequency, rad/sample.
    pub omega: f64,
    /// `|G(e^(i omega))|`.
    pub magnitude: f64,
    /// Standard error of `ln |G|`: the 95 % interval of the magnitude is `|G| exp(-+ 1.96 se)`.
    pub log_magnitude_se: f64,
    /// `arg G(e^(i omega))`, rad, without jumps of 2 pi between neighbours.
    pub phase: f64,
    /// Its standard error, rad.
    pub phase_se: f64,
}

/// Computes the step response at k = 0 ... `samples` - 1. With `s = G 1`:
/// `ds/da_i = -q^-i s/A`, `ds/db_j = q^-(nk+j) 1/(A F)`, `ds/df_i = -q^-i s/F`.
pub fn step_response(model: &LinearModel, samples: usize) -> Vec<StepPoint> {
    let orders = model.orders();
    let step = vec![1.0; samples];
    let (mut s, mut by_b) = (vec![0.0; samples], step.clone());
    model.simulate(&step, &mut s);
    divide(&model.a, &mut by_b);
    divide(&model.f, &mut by_b);
    let over = |polynomial: &[f64]| {
        let mut signal: Vec<f64> = s.iter().map(|s| -s).collect();
        divide(polynomial, &mut signal);
        signal
    };
    let (by_a, by_f) = (over(&model.a), over(&model.f));
    let at = |k: usize| {
        let delayed = |signal: &[f64], delay: usize| k.checked_sub(delay).map_or(0.0, |k| signal[k]);
        let gradient: Vec<f64> = (1..=orders.na)
            .map(|i| delayed(&by_a, i))
            .chain((0..orders.nb).map(|j| delayed(&by_b, orders.nk + j)))
            .chain(std::iter::repeat_n(0.0, orders.nc + orders.nd))
            .chain((1..=orders.nf).map(|i| delayed(&by_f, i)))
            .collect();
        StepPoint {
            value: s[k],
            se: model.variance_of(&gradient).sqrt(),
        }
    };
    (0..samples).map(at).collect()
}

/// Computes the frequency response at ascending frequencies, in rad/sample. With `z^-1 = e^(-i omega)`:
/// `d ln G/da_i = -z^-i/A`, `d ln G/db_j = z^-(nk+j)/B`, `d ln G/df_i = -z^-i/F`. The real part belongs to `ln |G|`,
/// the imaginary part to the phase.
pub fn frequency_response(model: &LinearModel, frequencies: &[f64]) -> Vec<FrequencyPoint> {
    let orders = model.orders();
    let mut before = 0.0;
    let at = |omega: &f64| {
        let back = c64::new(omega.cos(), -omega.sin());
        let [a, b, f] = [&model.a, &model.b, &model.f].map(|c| value(c, back));
        let gain = b / (a * f);
        let mut gradient = Vec::with_capacity(orders.parameters());
        let mut powers = |first: usize, count: usize, factor: c64| {
            let mut power = factor * back.powu(first as u32);
            for _ in 0..count {
                gradient.push(power);
                power *= back;
            }
        };
        let one = c64::new(1.0, 0.0);
        powers(1, orders.na, -one / a);
        powers(orders.nk, orders.nb, one / b);
        powers(0, orders.nc + orders.nd, c64::new(0.0, 0.0));
        powers(1, orders.nf, -one / f);
        let error = |part: fn(&c64) -> f64| {
            let gradient: Vec<f64> = gradient.iter().map(part).collect();
            model.variance_of(&gradient).sqrt()
        };
        let turns = ((gain.arg() - before) / std::f64::consts::TAU).round();
        let phase = gain.arg() - turns * std::f64::consts::TAU;
        if phase.is_finite() {
            before = phase;
        }
        FrequencyPoint {
            omega: *omega,
            magnitude: gain.norm(),
            log_magnitude_se: error(|g| g.re),
            phase,
            phase_se: error(|g| g.im),
        }
    };
    frequencies.iter().map(at).collect()
}
