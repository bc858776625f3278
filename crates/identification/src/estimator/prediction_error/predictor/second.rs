//! Second derivatives of the sum of squares.

use super::{A, B, C, D, F, INITIAL, OFFSET, Predictor, divide_in, filter_in};
use crate::estimator::lag_sums::dot;
use crate::estimator::prediction_error::kernels::{divide, filter};
use crate::model::LinearModel;
use faer::Mat;

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
        let pairs = [
            (A, C),
            (B, C),
            (C, C),
            (D, C),
            (F, C),
            (OFFSET, C),
            (INITIAL, C),
            (OFFSET, A),
            (OFFSET, D),
            (A, D),
            (B, D),
            (F, D),
            (B, F),
            (F, F),
            (INITIAL, F),
        ];
        let counts = self.blocks().map(|(_, count, ..)| count);
        let all = |of: usize| counts[of] * self.records_of(of);
        let places: [usize; 7] = std::array::from_fn(|of| (0..of).map(all).sum());
        let mut second = std::mem::take(&mut self.second);
        for (one, other) in pairs {
            if counts[one] == 0 || counts[other] == 0 {
                continue;
            }
            let LinearModel { a, b, c, d, f, .. } = &self.model;
            let (runs, blocks) = (&self.runs, self.blocks());
            let (signal, _, delay, mut factor) = blocks[one];
            let with_delay = delay + blocks[other].2;
            match (one, other) {
                (_, C | F) => {
                    second.copy_from_slice(signal);
                    let by = if other == C { c } else { f };
                    if one >= OFFSET {
                        divide(by, &mut second);
                    } else {
                        divide_in(runs, by, &mut second);
                    }
                    factor *= if one == other { -2.0 } else { -1.0 };
                }
                (OFFSET, _) => {
                    let step = vec![1.0; second.len()];
                    filter(if other == A { d } else { a }, &step, &mut second);
                    divide(c, &mut second);
                }
                (A, _) => {
                    second.copy_from_slice(&self.y);
                    divide_in(runs, c, &mut second);
                }
                (B, _) => {
                    second.copy_from_slice(&self.u);
                    divide_in(runs, c, &mut second);
                }
                _ => {
                    filter_in(runs, b, &self.u, &mut second);
                    divide_in(runs, c, &mut second);
                    divide_in(runs, f, &mut second);
                }
            }
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
        self.second = second;
    }
}
