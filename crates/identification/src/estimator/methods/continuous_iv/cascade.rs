//! Signals through a model in continuous time and its filter, at the samples.

use crate::estimator::solver::rank::inverse_power_of_two;
use crate::model::{Hold, Sampled, controller_form, output_of};
use faer::Mat;

/// A model `B/A`, and behind it the filter 1/F of its output: n states and nf more.
pub(super) struct Cascade {
    pub(super) system: Sampled,
    /// The same over a share of the time between samples.
    pub(super) way: Option<Sampled>,
    /// The filter's states times this power of two are in the numerator's unit, in which an exponential would round.
    pub(super) factor: f64,
}

impl Cascade {
    pub(super) fn new(numerator: &[f64], a: &[f64], f: &[f64], hold: Hold, share: Option<f64>) -> Self {
        let (n, nf) = (a.len(), f.len());
        let (of_a, of_f) = (controller_form(a), controller_form(f));
        let most = numerator.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
        let unit = inverse_power_of_two(most);
        let (c, d) = output_of(numerator, a);
        let mut input = vec![0.0; n + nf];
        input[0] = 1.0;
        if nf > 0 {
            input[n] = d * unit;
        }
        let both = Mat::from_fn(n + nf, n + nf, |i, j| match (i < n, j < n) {
            (true, true) => of_a[(i, j)],
            (false, false) => of_f[(i - n, j - n)],
            (false, true) if i == n => c[j] * unit,
            _ => 0.0,
        });
        Self {
            way: share.map(|share| Sampled::over(share, both.as_ref(), &input, hold)),
            system: Sampled::new(both.as_ref(), &input, hold),
            factor: 1.0 / unit,
        }
    }
}

/// Returns `s^n/A` of a signal, from the states `s^(n-1)/A ... 1/A` and the signal.
pub(super) fn highest(a: &[f64], v: f64, x: &[f64]) -> f64 {
    v - a.iter().zip(x).map(|(a, x)| a * x).sum::<f64>()
}

/// Returns `s^(nb-1-i)/A` of a signal, in the same way.
pub(super) fn power(i: usize, nb: usize, a: &[f64], v: f64, x: &[f64]) -> f64 {
    match (a.len() + i).checked_sub(nb) {
        Some(state) => x[state],
        None => highest(a, v, x),
    }
}

/// Delays a signal by some samples.
pub(super) fn delay(signal: &[f64], samples: usize, before: f64, to: &mut [f64]) {
    let samples = samples.min(signal.len());
    to[..samples].fill(before);
    to[samples..].copy_from_slice(&signal[..signal.len() - samples]);
}

/// Runs a system from rest under v, and tells the states of each sample, or those that `way` goes to from there with
/// the input's next value.
pub(super) fn run(
    system: &Sampled,
    way: Option<&Sampled>,
    [v, next]: [&[f64]; 2],
    mut tell: impl FnMut(usize, &[f64]),
) {
    let [mut x, mut later, mut seen] = [(); 3].map(|()| vec![0.0; system.now.len()]);
    system.start(v[0], &mut x);
    with_fma!(|| {
        for k in 0..v.len() {
            if k > 0 {
                system.step([v[k - 1], v[k]], &x, &mut later);
                std::mem::swap(&mut x, &mut later);
            }
            let Some(way) = way else {
                tell(k, &x);
                continue;
            };
            way.step([v[k], next[k]], &x, &mut seen);
            tell(k, &seen);
        }
    });
}
