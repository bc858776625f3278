//! Second derivatives of the sum of squares.

use super::{A, B, C, D, F, INITIAL, OFFSET, Predictor, divide_each_in, filter_in};
use crate::estimator::Runs;
use crate::estimator::lag_sums::dot;
use crate::estimator::prediction_error::kernels::{divide, filter};
use crate::model::LinearModel;
use faer::Mat;
use std::ops::Range;

/// The pairs of groups whose second derivatives are not zero.
const PAIRS: [(usize, usize); 15] = [
    (A, C),
    (B, C),
    (C, C),
    (D, C),
    (F, C),
    (A, D),
    (B, D),
    (F, D),
    (B, F),
    (F, F),
    (OFFSET, C),
    (OFFSET, A),
    (OFFSET, D),
    (INITIAL, C),
    (INITIAL, F),
];

/// Those whose signals are divided by C side by side, and by F.
const BY_C: Range<usize> = 0..8;
const BY_F: Range<usize> = 7..10;

/// Divides the signals that are not empty by a polynomial, in each record by itself, up to four side by side.
fn divide_all(runs: &Runs, d: &[f64], signals: &mut [Vec<f64>]) {
    let used = signals.iter_mut().filter(|signal| !signal.is_empty());
    let mut used: Vec<&mut [f64]> = used.map(Vec::as_mut_slice).collect();
    for four in used.chunks_mut(4) {
        match four {
            [x] => divide_each_in(runs, d, [x]),
            [x, y] => divide_each_in(runs, d, [x, y]),
            [x, y, z] => divide_each_in(runs, d, [x, y, z]),
            [x, y, z, w] => divide_each_in(runs, d, [x, y, z, w]),
            _ => {}
        }
    }
}

impl Predictor {
    /// Computes the lower triangle of half the Hessian of the sum, `psi'psi + sum e(k) e''(k)`, at the last
    /// [`Self::linearise`].
    ///
    /// A second derivative with respect to c is the first divided by -C, twice that if both are of C; the same with F
    /// for what has F in its denominator; with respect to d it is the first without D. Each depends on the sum of both
    /// delays alone. With respect to the offset and a it is -D/C of a step, with respect to the offset and d -A/C of
    /// it.
    pub(in crate::estimator::prediction_error) fn hessian(&mut self, to: &mut Mat<f64>) {
        let r = self.psi.r();
        for j in 0..r.ncols() {
            for i in j..r.ncols() {
                to[(i, j)] = (0..=j).map(|l| r[(l, i)] * r[(l, j)]).sum();
            }
        }
        let counts = self.blocks().map(|(_, count, ..)| count);
        let all = |of: usize| counts[of] * self.records_of(of);
        let places: [usize; 7] = std::array::from_fn(|of| (0..of).map(all).sum());
        let mut seconds = std::mem::take(&mut self.seconds);
        seconds.resize_with(PAIRS.len(), Vec::new);
        for ((one, other), second) in PAIRS.into_iter().zip(&mut seconds) {
            second.clear();
            if counts[one] > 0 && counts[other] > 0 {
                self.begin(one, other, second);
            }
        }
        let LinearModel { c, f, .. } = &self.model;
        divide_all(&self.runs, c, &mut seconds[BY_C]);
        divide_all(&self.runs, f, &mut seconds[BY_F]);
        for ((one, other), second) in PAIRS.into_iter().zip(&seconds) {
            if second.is_empty() {
                continue;
            }
            let blocks = self.blocks();
            let (_, _, delay, sign) = blocks[one];
            let with_delay = delay + blocks[other].2;
            let factor = match other {
                C | F if one == other => -2.0 * sign,
                C | F => -sign,
                _ => sign,
            };
            let last = counts[one] + counts[other] - 1;
            let records = self.records_of(one);
            for (record, lag) in (0..records).flat_map(|of| (0..last).map(move |lag| (of, lag))) {
                let runs = self.runs.iter().enumerate();
                let runs = runs.filter(|(i, _)| one < OFFSET || *i == record);
                let value = runs.map(|(_, run)| {
                    let late = self.e[run.clone()].get(with_delay + lag..);
                    let late = late.unwrap_or_default();
                    let start = if one >= OFFSET { 0 } else { run.start };
                    dot(late, &second[start..start + late.len()])
                });
                let value = factor * value.sum::<f64>();
                let first = places[one] + record * counts[one];
                for i in (lag + 1).saturating_sub(counts[other])..counts[one].min(lag + 1) {
                    let (row, column) = (first + i, places[other] + lag - i);
                    if one == other {
                        if row >= column {
                            to[(row, column)] += value;
                        }
                    } else {
                        to[(row.max(column), row.min(column))] += value;
                    }
                }
            }
        }
        self.seconds = seconds;
    }

    /// Begins the signal of a pair: what [`BY_C`] and [`BY_F`] divide, or all of it.
    fn begin(&self, one: usize, other: usize, second: &mut Vec<f64>) {
        let LinearModel { a, b, c, d, f, .. } = &self.model;
        match (one, other) {
            (_, C | F) => {
                second.extend_from_slice(self.blocks()[one].0);
                if one >= OFFSET {
                    divide(if other == C { c } else { f }, second);
                }
            }
            (OFFSET, _) => {
                let step = vec![1.0; self.e.len()];
                second.resize(step.len(), 0.0);
                filter(if other == A { d } else { a }, &step, second);
                divide(c, second);
            }
            (A, _) => second.extend_from_slice(&self.y),
            (B, _) => second.extend_from_slice(&self.u),
            _ => {
                second.resize(self.u.len(), 0.0);
                filter_in(&self.runs, b, &self.u, second);
            }
        }
    }
}
