//! The measures of a linearisation: how near it is to a minimum, its condition, the covariance that it implies.

use super::Predictor;
use crate::estimator::FailureKind;
use crate::estimator::covariance::Covariance;
use crate::estimator::offset::leading_block;
use crate::estimator::regression::covariance_of_triangle;
use crate::estimator::solver::rank::check_rank_of_columns;

impl Predictor {
    /// Returns `|| Q'e || / || e ||`, at the last [`Self::linearise`].
    pub(in crate::estimator::prediction_error) fn decrement(&self, sum: f64) -> f64 {
        let top = self.psi.top();
        (top.iter().map(|x| x * x).sum::<f64>() / sum).sqrt()
    }

    /// Returns the largest cosine between e and a column of psi, at the last [`Self::linearise`].
    pub(in crate::estimator::prediction_error) fn scaled_gradient(&self, sum: f64) -> f64 {
        let (r, top) = (self.psi.r(), self.psi.top());
        let cosine = |j: usize| {
            let column = (0..=j).map(|i| (r[(i, j)], top[i]));
            let (product, square) = column.fold((0.0, 0.0), |(p, s), (r, e)| (p + r * e, s + r * r));
            if square > 0.0 {
                (product / (square * sum).sqrt()).abs()
            } else {
                0.0
            }
        };
        (0..self.width()).map(cosine).fold(0.0, f64::max)
    }

    /// Returns `psi'e`, at the last [`Self::linearise`].
    pub(in crate::estimator::prediction_error) fn gradient(&self, to: &mut [f64]) {
        let (r, top) = (self.psi.r(), self.psi.top());
        for (j, to) in to.iter_mut().enumerate() {
            *to = (0..=j).map(|i| r[(i, j)] * top[i]).sum();
        }
    }

    /// Returns the condition of psi's triangle with its columns scaled.
    ///
    /// # Errors
    /// [`FailureKind::NotIdentifiable`] if `psi'psi` is singular up to rounding.
    pub(in crate::estimator::prediction_error) fn condition(&mut self) -> Result<f64, FailureKind> {
        let singular = |_| FailureKind::NotIdentifiable;
        let r = self.psi.r();
        let condition = self.equilibration.of_triangle(r, &mut self.column).map_err(singular)?;
        check_rank_of_columns(condition, self.column.len()).map_err(singular)?;
        Ok(condition)
    }

    /// Computes the covariance of the parameters and the offsets at the last linearisation. For white prediction errors
    /// it is `variance (psi'psi)^-1`; otherwise it follows from each sample's contribution to theta,
    /// `-(psi'psi)^-1 psi(k) e(k)`.
    pub(in crate::estimator::prediction_error) fn covariance(
        &mut self,
        kind: Covariance,
        variance: f64,
        to: &mut Vec<f64>,
    ) {
        let all = self.width();
        if kind == Covariance::White {
            covariance_of_triangle(self.psi.r(), variance, &mut self.column, to);
        } else {
            let mut influence = std::mem::take(&mut self.influence);
            let (r, columns) = (self.psi.r(), self.columns());
            influence.clear();
            for (i, run) in self.runs.iter().enumerate() {
                for (k, e) in self.e[run.clone()].iter().enumerate() {
                    influence.push(all, *e, |row| {
                        for (psi, column) in row.iter_mut().zip(&columns) {
                            let signal = column.within(i, run).filter(|_| k >= column.delay);
                            *psi = signal.map_or(0.0, |x| column.sign * x[k - column.delay]);
                        }
                    });
                }
            }
            influence.solve_normal(r);
            influence.covariance(kind, to);
            self.influence = influence;
        }
        leading_block(to, all, all - self.initial);
    }
}
