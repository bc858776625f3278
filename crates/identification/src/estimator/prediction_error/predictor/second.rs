//! Second derivatives of the sum of squares.

use super::{A, B, C, D, F, INITIAL, OFFSET, Predictor, filter_in};
use crate::estimator::Runs;
use crate::estimator::lag_sums::dot;
use crate::estimator::prediction_error::kernels::{divide, filter};
use crate::model::LinearModel;
use faer::Mat;

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

/// Divides a signal by a polynomial back in time, in each record by itself: the adjoint of the division.
fn divide_back(runs: &Runs, d: &[f64], x: &[f64], to: &mut Vec<f64>) {
    to.clear();
    for run in runs {
        to.extend(x[run.clone()].iter().rev());
        divide(d, &mut to[run.clone()]);
        to[run.clone()].reverse();
    }
}

impl Predictor {
    /// Computes the lower triangle of half the Hessian of the sum, `psi'psi + sum e(k) e''(k)`, at the last
    /// [`Self::linearise`].
    ///
    /// A second derivative with respect to c is the first divided by -C, twice that if both are of C; the same with F
    /// for what has F in its denominator; with respect to d it is the first without D. Each depends on the sum of both
    /// delays alone. With respect to the offset and a it is -D/C of a step, with respect to the offset and d -A/C of
    /// it. The inner product of a second derivative with e is that of the signal before the division with e divided
    /// back in time, so that e is divided in place of each signal.
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
        let LinearModel { a, b, c, d, f, .. } = &self.model;
        let [by_c, by_f, by_both] = &mut self.divided;
        divide_back(&self.runs, c, &self.e, by_c);
        divide_back(&self.runs, f, &self.e, by_f);
        if counts[D] > 0 && counts[F] > 0 {
            divide_back(&self.runs, f, by_c, by_both);
            filter_in(&self.runs, b, &self.u, &mut self.x);
        }
        let (blocks, [by_c, by_f, by_both]) = (self.blocks(), &self.divided);
        for (one, other) in PAIRS {
            if counts[one] == 0 || counts[other] == 0 {
                continue;
            }
            let mut of_step = Vec::new();
            let (divided, signal) = match (one, other) {
                (_, C) => (by_c, blocks[one].0),
                (_, F) => (by_f, blocks[one].0),
                (A, _) => (by_c, self.y.as_slice()),
                (B, _) => (by_c, self.u.as_slice()),
                (F, _) => (by_both, self.x.as_slice()),
                _ => {
                    of_step.resize(self.e.len(), 0.0);
                    filter(if other == A { d } else { a }, &vec![1.0; self.e.len()], &mut of_step);
                    (by_c, of_step.as_slice())
                }
            };
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
                    let late = divided[run.clone()].get(with_delay + lag..).unwrap_or_default();
                    let start = if one >= OFFSET { 0 } else { run.start };
                    dot(late, &signal[start..start + late.len()])
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
    }
}
