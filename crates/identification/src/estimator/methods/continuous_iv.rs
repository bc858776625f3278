//! Young's refined instrumental variables for a model in continuous time, `y = B(s)/A(s) u + C/D e` at the samples.
//!
//! Sources: P. C. Young and A. J. Jakeman, *Refined instrumental variable methods of recursive time-series analysis,
//! part III*, Int. J. Control 31 (1980); H. Garnier and L. Wang (eds.), *Identification of Continuous-time Models from
//! Sampled Data*, 2008, chapters 4 and 5; S. Pan, R. A. Gonzalez, J. S. Welsh and C. R. Rojas, *Consistency analysis of
//! the simplified refined instrumental variable method for continuous-time systems*, Automatica 113 (2020).

mod options;

use super::output_error_iteration::{MOST_PASSES, PROGRESS, ROUND, move_first_to_last};
use crate::estimator::instruments::TwoStages;
use crate::estimator::loop_input::LoopInput;
use crate::estimator::noise_fit::{NoiseFit, put_block, replace};
use crate::estimator::reflection::Stabilise;
use crate::estimator::solver::rank::inverse_power_of_two;
use crate::estimator::{FailureKind, Iteration, SetupError, Window, enough_equations};
use crate::model::polynomial::{divide, filter};
use crate::model::{
    ContinuousModel, Hold, LinearModel, Orders, Sampled, controller_form, output_of,
};
use crate::plant::{PoleFinder, polynomial_from_poles};
use faer::{Mat, MatMut, c64};
pub use options::{RivcOptions, SrivcOptions};

/// The relative step at which an iteration rests. Columns of derivatives are nearly dependent, so rounding is larger
/// than in discrete time.
const REST: f64 = 1e-10;

/// The fastest state-variable filter of the start, rad/sample; each next one is half as fast, down to this many time
/// constants in the record.
const FASTEST: f64 = 2.0;
const MOST_FILTERS: usize = 12;
const TIME_CONSTANTS: f64 = 8.0;

/// Passes of instrumental variables after each filter of the start.
const TRIES: usize = 2;

/// The least decay of a reflected pole, per sample.
const LEAST_DECAY: f64 = 1e-6;

/// Returns the orders of the sampled model.
fn sampled(orders: Orders, hold: Hold) -> Orders {
    let Orders {
        nb, nc, nd, nf, nk, ..
    } = orders;
    let plant = ContinuousModel::sampled_orders(nb, nf, hold, nk - 1);
    Orders { nc, nd, ..plant }
}

/// Alternates until both converge:
///
/// - C and D by prediction errors of the ARMA model `D w = C e` of `w = y - B/A u`, white noise without them;
/// - A and B by `s^n y_f = -a_1 s^(n-1) y_f - ... + b_0 s^m u_f + ...`, `y_f = D/(C A) y`, `u_f = D/(C A) u`, with
///   `B/A u_f` instead of y_f in the instruments.
///
/// Signals are zero before the record. u and `B/A u` are filtered exactly for the hold; y is filtered on straight lines
/// between samples, which moves no solution: at rest the residual of the equation is `D/C (y - B/A u)` at the samples,
/// and the instruments are its gradient. So the result is a stationary point of the sum of its squares. Derivatives are
/// those of a time in samples, so the step in seconds changes no digit of the sampled model.
pub struct ContinuousIv {
    orders: Orders,
    hold: Hold,
    stages: TwoStages,
    noise: NoiseFit,
    stabilise: Stabilise,
    model: LinearModel,
    continuous: ContinuousModel,
    /// (a, b) per sample; the stable ones with the lowest sum of squared prediction errors, and that sum.
    theta: Vec<f64>,
    best: Vec<f64>,
    least: f64,
    /// `s^(n-1)/A y ... 1/A y`, `s^m/A u ... 1/A u`, `s^n/A y`, and the instruments: `s^(n-1) B/A^2 v ... B/A^2 v`,
    /// v being u or the input of a closed loop without noise; of that also `s^m/A v ... 1/A v`.
    columns: Vec<Vec<f64>>,
    source: Option<LoopInput>,
    /// The input after the dead time, and v.
    u: Vec<f64>,
    v: Vec<f64>,
    /// `B/A u`, and the output less it.
    x: Vec<f64>,
    w: Vec<f64>,
    scratch: Vec<f64>,
}

impl ContinuousIv {
    /// Makes buffers for windows of `window` samples.
    pub(super) fn new(
        orders: Orders,
        mut continuous: ContinuousModel,
        stabilise: Stabilise,
        window: usize,
    ) -> Result<Self, SetupError> {
        let Orders { nb, nf, nk, .. } = orders;
        enough_equations(orders, window, window, orders.parameters() + 1)?;
        continuous.dead_time = nk - 1;
        let signal = || vec![0.0; window];
        Ok(Self {
            hold: continuous.hold,
            stages: TwoStages::new(nf + nb, nf + nb, window),
            noise: NoiseFit::new(orders, window),
            source: None,
            stabilise,
            model: LinearModel::zero(sampled(orders, continuous.hold)),
            continuous,
            theta: vec![0.0; nf + nb],
            best: vec![0.0; nf + nb],
            least: f64::INFINITY,
            columns: (0..=2 * nf + nb).map(|_| signal()).collect(),
            u: signal(),
            v: Vec::new(),
            x: signal(),
            w: signal(),
            scratch: signal(),
            orders,
        })
    }

    /// Forms the instruments from a closed loop's input without noise.
    pub(super) fn with_source(mut self, source: LoopInput) -> Self {
        let window = self.x.len();
        let more = (0..self.orders.nb).map(|_| vec![0.0; window]);
        self.columns.extend(more);
        self.v = vec![0.0; window];
        self.source = Some(source);
        self
    }

    /// Computes all columns, x and w for A and B of theta.
    fn filter_all(&mut self, y: &[f64]) {
        let Orders { nb, nf: n, .. } = self.orders;
        let (a, b) = self.theta.split_at(n);
        let form = controller_form(a);
        let mut input = vec![0.0; 2 * n];
        input[0] = 1.0;
        let of_y = Sampled::new(form.as_ref(), &input[..n], Hold::First);
        // The exponential of the cascade would round in the unit of B.
        let unit = inverse_power_of_two(b.iter().fold(0.0, |most, b| b.abs().max(most)));
        let (c, d) = output_of(b, a);
        input[n] = d * unit;
        // The model, and behind it the filter of its output.
        let cascade = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => form[(i, j)],
            (false, false) => form[(i - n, j - n)],
            (false, true) if i == n => c[j] * unit,
            _ => 0.0,
        });
        let of_u = Sampled::new(cascade.as_ref(), &input, self.hold);
        let highest = |v: f64, x: &[f64]| v - a.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        // `s^(nb-1-i)/A` of a signal, from the states and the signal.
        let power = |i: usize, v: f64, x: &[f64]| match (n + i).checked_sub(nb) {
            Some(state) => x[state],
            None => highest(v, &x[..n]),
        };
        let columns = &mut self.columns;
        run(&of_y, y, &mut self.scratch, |k, x| {
            for (column, x) in columns.iter_mut().zip(x) {
                column[k] = *x;
            }
            columns[n + nb][k] = highest(y[k], x);
        });
        let (u, w, simulated) = (&self.u, &mut self.w, &mut self.x);
        run(&of_u, u, &mut self.scratch, |k, states| {
            let mut x = 0.0;
            for (i, b) in b.iter().enumerate() {
                let value = power(i, u[k], states);
                columns[n + i][k] = value;
                x += b * value;
            }
            for (column, x) in columns[n + nb + 1..].iter_mut().zip(&states[n..]) {
                column[k] = x / unit;
            }
            simulated[k] = x;
            w[k] = y[k] - x;
        });
        if self.source.is_none() {
            return;
        }
        let v = &self.v;
        run(&of_u, v, &mut self.scratch, |k, states| {
            for (column, x) in columns[n + nb + 1..].iter_mut().zip(&states[n..]) {
                column[k] = x / unit;
            }
            for (i, column) in columns[2 * n + nb + 1..].iter_mut().enumerate() {
                column[k] = power(i, v[k], states);
            }
        });
    }

    /// Filters all columns by D/C.
    fn whiten(&mut self) {
        if self.orders.nc + self.orders.nd == 0 {
            return;
        }
        for column in &mut self.columns {
            filter(&self.model.d, column, &mut self.scratch);
            divide(&self.model.c, &mut self.scratch);
            std::mem::swap(column, &mut self.scratch);
        }
    }

    /// Solves the linear equation of the columns, with instruments or by least squares.
    fn solve(&mut self, instrumental: bool, condition: &mut f64) -> Result<(), FailureKind> {
        let Orders { nb, nf: n, .. } = self.orders;
        let (columns, looped) = (&self.columns, self.source.is_some());
        let put = |mut to: MatMut<'_, f64>, column: usize, from: usize, first: usize, sign: f64| {
            let rows = to.nrows();
            for (row, value) in columns[from][first..first + rows].iter().enumerate() {
                to[(row, column)] = sign * value;
            }
        };
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut right: MatMut<'_, f64>| {
            let of_z = if instrumental { n + nb + 1 } else { 0 };
            for i in 0..n {
                put(z.as_mut(), i, of_z + i, first, -1.0);
                put(right.as_mut(), i, i, first, -1.0);
            }
            let of_v = if instrumental && looped {
                n + nb + 1
            } else {
                0
            };
            for i in n..n + nb {
                put(z.as_mut(), i, of_v + i, first, 1.0);
                put(right.as_mut(), i, i, first, 1.0);
            }
            put(right.as_mut(), n + nb, n + nb, first, 1.0);
        };
        self.stages.solve(self.u.len(), fill, condition)
    }

    /// Changes theta by a share of the way to the solution; returns the longest way relative to the largest term of the
    /// equation, each parameter times the length of its column.
    fn take(&mut self, share: f64) -> f64 {
        let (theta, stages) = (&mut self.theta, &self.stages);
        let [way, size] = replace(theta, &stages.theta, share, |j| stages.length(j));
        way / size.max(f64::MIN_POSITIVE)
    }

    /// Reflects zeros of A(s) with `Re s >= 0`, if that is wanted.
    fn stay_stable(&mut self) -> Result<(), FailureKind> {
        let n = self.orders.nf;
        let reversed: Vec<f64> = self.theta[..n].iter().rev().map(|a| -a).collect();
        let mut poles: Vec<c64> = PoleFinder::new(n).poles(&reversed);
        if poles.is_empty() {
            return Err(FailureKind::NonFinite);
        }
        if poles.iter().all(|pole| pole.re < 0.0) {
            return Ok(());
        }
        if self.stabilise == Stabilise::None {
            return Err(FailureKind::UnstablePredictor);
        }
        for pole in poles.iter_mut().filter(|pole| pole.re >= 0.0) {
            pole.re = -pole.re.max(LEAST_DECAY);
        }
        for (a, phi) in self.theta.iter_mut().zip(polynomial_from_poles(&poles)) {
            *a = phi.re;
        }
        Ok(())
    }

    /// Computes v of the loop of the present model and the known controller.
    fn close(&mut self, window: Window<'_>) {
        let Some(source) = &mut self.source else {
            return;
        };
        let (a, b) = self.theta.split_at(self.orders.nf);
        self.continuous.set_per_sample(b, a, &[]);
        self.continuous.sample(&mut self.model);
        source.close(&self.model, window);
        delay(&source.hat, self.continuous.dead_time, &mut self.v);
    }

    /// Filters by the present model and keeps it if its errors are the smallest so far; returns the change of C and D.
    fn look(
        &mut self,
        window: Window<'_>,
        unfinished: &mut Option<FailureKind>,
    ) -> Result<f64, FailureKind> {
        self.stay_stable()?;
        self.close(window);
        self.filter_all(window.y);
        let [change, sum] = self.noise.fit(&self.w, &mut self.model, unfinished)?;
        if sum < self.least {
            self.least = sum;
            self.best.copy_from_slice(&self.theta);
        }
        Ok(change)
    }

    /// Tries state-variable filters `1/(s + lambda)^n`: least squares, and a few passes from it.
    fn start(&mut self, window: Window<'_>, condition: &mut f64) -> Result<(), FailureKind> {
        let mut outcome = Ok(());
        let n = self.orders.nf;
        for i in 0..MOST_FILTERS {
            let lambda = FASTEST * 0.5_f64.powi(i as i32);
            if i > 0 && lambda * (window.len() as f64) < TIME_CONSTANTS {
                break;
            }
            self.theta.fill(0.0);
            let poles = vec![c64::new(-lambda, 0.0); n];
            for (a, phi) in self.theta.iter_mut().zip(polynomial_from_poles(&poles)) {
                *a = phi.re;
            }
            let tried = self.try_filter(window, condition);
            if tried.is_err() {
                outcome = tried;
            }
        }
        if self.least.is_finite() {
            Ok(())
        } else {
            outcome
        }
    }

    fn try_filter(&mut self, window: Window<'_>, condition: &mut f64) -> Result<(), FailureKind> {
        self.filter_all(window.y);
        self.solve(false, condition)?;
        self.take(1.0);
        let mut unused = None;
        for _ in 0..TRIES {
            self.noise.reset();
            self.look(window, &mut unused)?;
            self.whiten();
            self.solve(true, condition)?;
            self.take(1.0);
        }
        self.look(window, &mut unused).map(|_| ())
    }

    fn iterate(
        &mut self,
        window: Window<'_>,
        passes: &mut usize,
        condition: &mut f64,
    ) -> Result<(), FailureKind> {
        let (mut share, mut asked) = (1.0, f64::INFINITY);
        let mut unfinished = None;
        while *passes < MOST_PASSES {
            *passes += 1;
            let of_noise = self.look(window, &mut unfinished)?;
            self.whiten();
            self.solve(true, condition)?;
            let of_plant = self.take(share);
            if of_plant <= REST && of_noise <= REST.sqrt() {
                let of_loop = self.source.as_ref();
                let unstable = of_loop.is_some_and(|source| source.is_unstable);
                let unstable = unstable.then_some(FailureKind::UnstableInstruments);
                return unfinished.or(unstable).map_or(Ok(()), Err);
            }
            if passes.is_multiple_of(ROUND) {
                if of_plant > PROGRESS * asked {
                    share /= 2.0;
                    self.theta.copy_from_slice(&self.best);
                }
                asked = of_plant;
            }
        }
        Err(unfinished.unwrap_or(FailureKind::IterationLimit))
    }

    /// Computes the covariance of the sampled model: `J P J'` for B and F, that of the ARMA model for C and D.
    fn put_covariance(&mut self, jacobian: &[f64], variance: f64) -> Result<(), FailureKind> {
        let p = &self.continuous.covariance;
        let width = self.theta.len();
        let rows: Vec<&[f64]> = jacobian.chunks_exact(width).collect();
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
        self.noise
            .put_covariance(&self.w, variance, orders, &mut covariance)?;
        self.model.covariance = covariance;
        Ok(())
    }
}

/// Delays a signal by some samples.
fn delay(signal: &[f64], samples: usize, to: &mut [f64]) {
    let samples = samples.min(signal.len());
    to[..samples].fill(0.0);
    to[samples..].copy_from_slice(&signal[..signal.len() - samples]);
}

/// Runs a system from rest, and tells the states of each sample.
fn run(system: &Sampled, v: &[f64], scratch: &mut [f64], mut tell: impl FnMut(usize, &[f64])) {
    let n = system.now.len();
    let mut x = vec![0.0; n];
    for k in 0..v.len() {
        if k == 0 {
            system.start(v[0], &mut x);
        } else {
            system.step([v[k - 1], v[k]], &mut x, &mut scratch[..n]);
        }
        tell(k, &x);
    }
}

impl Iteration for ContinuousIv {
    fn find(
        &mut self,
        window: Window<'_>,
        passes: &mut usize,
        condition: &mut f64,
    ) -> Result<(), FailureKind> {
        self.least = f64::INFINITY;
        let dead = self.continuous.dead_time;
        delay(window.u, dead, &mut self.u);
        if let Some(source) = &mut self.source {
            source.follow(window.u, window.r)?;
            delay(&source.hat, dead, &mut self.v);
        }
        self.start(window, condition)?;
        self.theta.copy_from_slice(&self.best);
        self.noise.reset();
        self.iterate(window, passes, condition).map_err(|kind| {
            let ends = [
                FailureKind::UnstablePredictor,
                FailureKind::UnstableInstruments,
            ];
            if ends.contains(&kind) {
                return kind;
            }
            self.theta.copy_from_slice(&self.best);
            if kind.leaves_a_model() {
                kind
            } else {
                FailureKind::IterationLimit
            }
        })
    }

    fn conclude(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind> {
        let y = window.y;
        let Orders { nf: n, .. } = self.orders;
        if !at_rest {
            self.stay_stable()?;
            self.filter_all(y);
            self.noise.fit(&self.w, &mut self.model, &mut None)?;
        }
        filter(&self.model.d, &self.w, &mut self.x);
        divide(&self.model.c, &mut self.x);
        let sum: f64 = self.x.iter().map(|e| e * e).sum();
        let variance = sum / (y.len() - self.orders.parameters()) as f64;
        let mut block = Vec::new();
        if at_rest {
            self.stages.covariance_of_instruments(variance, &mut block);
            move_first_to_last(&mut block, self.theta.len(), n);
        }
        let (a, b) = self.theta.split_at(n);
        self.continuous.set_per_sample(b, a, &block);
        let jacobian = self.continuous.sample(&mut self.model);
        self.model.noise_variance = variance;
        self.model.covariance.clear();
        if at_rest {
            self.put_covariance(&jacobian, variance)?;
        }
        Ok(sum)
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }

    fn continuous(&self) -> Option<&ContinuousModel> {
        Some(&self.continuous)
    }
}

#[cfg(test)]
mod tests;
