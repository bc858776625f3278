//! The fit of a record, from its fixed point to the model at the samples.

use super::cascade::delay;
use super::{ContinuousIv, Structure};
use crate::estimator::fixed_point::unfinished;
use crate::estimator::noise_fit::put_block;
use crate::estimator::{FailureKind, Iteration, Offset, Pass, Window};
use crate::model::polynomial::{divide, filter};
use crate::model::{ContinuousModel, LinearModel, Orders};

impl ContinuousIv {
    /// Returns the constant in y.
    pub(super) fn offset(&self) -> f64 {
        let last = self.theta.last().copied().unwrap_or(0.0);
        if self.structure.offset { last } else { 0.0 }
    }

    /// Computes the covariance of the sampled model: `J P J'` for B and F, that of the ARMA model for C and D.
    fn put_covariance(&mut self, jacobian: &[f64], variance: f64) -> Result<(), FailureKind> {
        let p = &self.continuous.covariance;
        let Structure { orders, .. } = self.structure;
        // Derivatives by a dead time that is known do not count.
        let all = orders.nb + self.structure.degree() + usize::from(self.share.is_some());
        let width = p.len().isqrt();
        let rows = jacobian.chunks_exact(all).map(|row| &row[..width]);
        let rows: Vec<&[f64]> = rows.collect();
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let mut block = vec![0.0; rows.len() * rows.len()];
        for (i, row) in rows.iter().enumerate() {
            let product: Vec<f64> = p.chunks_exact(width).map(|of_p| dot(of_p, row)).collect();
            for (j, other) in rows.iter().enumerate() {
                block[i * rows.len() + j] = dot(&product, other);
            }
        }
        let orders = self.model.orders();
        let total = orders.parameters();
        let mut covariance = vec![0.0; total * total];
        let (nb, noise) = (orders.nb, orders.nc + orders.nd);
        let place = |i: usize| if i < nb { i } else { i + noise };
        put_block(&block, rows.len(), place, total, &mut covariance);
        self.noise.put_covariance(&self.w, variance, orders, &mut covariance)?;
        self.model.covariance = covariance;
        Ok(())
    }
}

impl Iteration for ContinuousIv {
    fn find(&mut self, window: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        self.least = f64::INFINITY;
        if let Some(source) = &mut self.source {
            source.follow(window.u, window.r)?;
            let dead = self.continuous.dead_time as usize;
            delay(&source.hat, dead, 0.0, &mut self.v);
        }
        let found = if let Some(range) = self.structure.range {
            self.search(window, range, passes)
        } else {
            let dead_time = self.continuous.dead_time;
            self.delay(window.u, dead_time, dead_time.floor());
            self.settle(window, passes)
        };
        found.map_err(|kind| {
            unfinished(kind, self.least).map_or(kind, |unfinished| {
                self.theta.copy_from_slice(&self.best);
                unfinished
            })
        })
    }

    fn conclude(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind> {
        let y = window.y;
        let Structure {
            orders: Orders { nb, nf, nc, nd, .. },
            ..
        } = self.structure;
        let n = self.structure.degree();
        if !at_rest {
            self.stay_stable()?;
            self.filter_all(y);
            self.noise.fit(&self.w, &mut self.model, &mut None)?;
        }
        filter(&self.model.d, &self.w, &mut self.x);
        divide(&self.model.c, &mut self.x);
        let sum: f64 = self.x.iter().map(|e| e * e).sum();
        let stages = self.joint.as_mut().unwrap_or(&mut self.stages);
        let fitted = stages.theta.len();
        let variance = sum / (y.len() - fitted - nc - nd) as f64;
        let mut covariance = Vec::new();
        self.offset_error = f64::NAN;
        if at_rest {
            let mut block = Vec::new();
            stages.covariance_of_instruments(variance, &mut block);
            let last = self.theta.len() - 1;
            self.offset_error = block[last * fitted + last].sqrt();
            // Of B, of A, whose pole at 0 has no error, and of the dead time.
            let of_a = (0..n).map(|i| (i < nf).then_some(i));
            let places: Vec<Option<usize>> = (nf..nf + nb)
                .map(Some)
                .chain(of_a)
                .chain(self.joint.iter().map(|_| Some(fitted - 1)))
                .collect();
            let number = |i: Option<usize>, j: Option<usize>| -> Option<f64> { block.get(i? * fitted + j?).copied() };
            for i in &places {
                let row = places.iter().map(|j| number(*i, *j).unwrap_or(0.0));
                covariance.extend(row);
            }
        }
        let [a, _, b] = self.polynomials();
        self.continuous.set_per_sample(&b, &a, &covariance);
        let dead_time = self.continuous.dead_time;
        let mut model = LinearModel::zero(self.structure.sampled(self.hold, dead_time));
        std::mem::swap(&mut model.c, &mut self.model.c);
        std::mem::swap(&mut model.d, &mut self.model.d);
        self.model = model;
        let jacobian = self.continuous.sample(&mut self.model);
        self.model.noise_variance = variance;
        if at_rest {
            self.put_covariance(&jacobian, variance)?;
        }
        Ok(sum)
    }

    fn of_record(&mut self, Window { u, y, .. }: Window<'_>, pass: &mut Pass) {
        pass.start_numbers = self.structure.others();
        let (value, se) = (self.offset(), self.offset_error);
        pass.offsets.clear();
        pass.offsets
            .extend(self.structure.offset.then_some(Offset { value, se }));
        if !self.structure.initial {
            return pass.start_at_zero();
        }
        // The state is the output of the first samples less that from rest.
        let order = pass.x0.len();
        let mut from_rest = vec![0.0; y.len()];
        self.model.simulate(u, &mut from_rest);
        let outputs = y.iter().zip(&self.w).zip(from_rest);
        let free = outputs.map(|((y, w), x)| y - value - w - x);
        let mut x0: Vec<f64> = free.take(order).collect();
        x0.resize(order, 0.0);
        pass.set_initial_state(&x0);
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }

    fn continuous(&self) -> Option<&ContinuousModel> {
        Some(&self.continuous)
    }
}
