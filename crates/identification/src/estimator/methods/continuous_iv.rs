//! Young's refined instrumental variables for a model in continuous time, `y = B(s)/A(s) u + C/D e` at the samples.
//!
//! Sources: P. C. Young and A. J. Jakeman, *Refined instrumental variable methods of recursive time-series analysis,
//! part III*, Int. J. Control 31 (1980); H. Garnier and L. Wang (eds.), *Identification of Continuous-time Models from
//! Sampled Data*, 2008, chapters 4 and 5; S. Pan, R. A. Gonzalez, J. S. Welsh and C. R. Rojas, *Consistency analysis of
//! the simplified refined instrumental variable method for continuous-time systems*, Automatica 113 (2020).

mod cascade;
mod dead_time;
mod iteration;
mod options;
mod search;

use crate::estimator::fixed_point::{Damping, MOST_PASSES, replace};
use crate::estimator::instruments::TwoStages;
use crate::estimator::loop_input::LoopInput;
use crate::estimator::noise_fit::NoiseFit;
use crate::estimator::reflection::Stabilise;
use crate::estimator::solver::column;
use crate::estimator::{FailureKind, SetupError, Window, enough_equations};
use crate::model::polynomial::{divide, filter};
use crate::model::{ContinuousModel, Hold, LinearModel, Orders, Sampled, controller_form, output_of, row_times_form};
use crate::plant::{PoleFinder, polynomial_from_poles};
use cascade::{Cascade, delay, highest, power, run};
pub use dead_time::{DeadTime, DeadTimeError};
use faer::{MatMut, c64};
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

/// The most steps to a dead time within the time between two samples.
const MOST_STEPS: usize = 60;

/// The numbers that are estimated.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Structure {
    /// The numbers of coefficients; nf counts those of F(s), `A = F`, or `A = s F` with an integrator.
    pub(super) orders: Orders,
    /// Whether a pole is fixed at 0.
    pub(super) integrator: bool,
    /// Whether the state at the first sample is estimated; u is its first value before the record.
    pub(super) initial: bool,
    /// Whether a constant in y is estimated.
    pub(super) offset: bool,
    /// The range of the dead time in samples, if it is estimated.
    pub(super) range: Option<[f64; 2]>,
}

impl Structure {
    /// Returns the degree of A(s).
    fn degree(self) -> usize {
        self.orders.nf + usize::from(self.integrator)
    }

    /// Returns how many numbers are estimated besides B, F, C, D and the dead time.
    fn others(self) -> usize {
        usize::from(self.initial) * self.degree() + usize::from(self.offset)
    }

    /// Returns the orders of the sampled model. One of an estimated dead time has all its coefficients at a whole one.
    fn sampled(self, hold: Hold, dead_time: f64) -> Orders {
        let is_between = self.range.is_some() && dead_time.fract() == 0.0;
        let dead_time = dead_time + f64::from(u8::from(is_between)) / 2.0;
        let Orders { nb, nc, nd, .. } = self.orders;
        let plant = ContinuousModel::sampled_orders(nb, self.degree(), hold, dead_time);
        Orders { nc, nd, ..plant }
    }
}

/// Alternates until both converge:
///
/// - C and D by prediction errors of the ARMA model `D w = C e` of `w = y - B/A u`, white noise without them;
/// - F and B by `s^n y_f = -f_1 s^(n-1) y_f - ... + b_0 s^m u_f + ...`, `y_f = D/(C A) y`, `u_f = D/(C A) u`, with
///   `B/A u_f` instead of y_f in the instruments. A is F, or s F with an integrator: then only `s y_f = D/(C F) y` and
///   higher derivatives are in the equation, and no output is integrated.
///
/// Signals are zero before the record. u and `B/A u` are filtered exactly for the hold; y is filtered on straight lines
/// between samples, which moves no solution: at rest the residual of the equation is `D/C (y - B/A u)` at the samples,
/// and the instruments are its gradient. So the result is a stationary point of the sum of its squares. Derivatives are
/// those of a time in samples, so the step in seconds changes no digit of the sampled model.
///
/// A dead time is exact for the hold too: a delayed state is that of an earlier time, between two samples. The state at
/// the first sample adds `K/A` of an impulse with the n coefficients of K, and an offset c; both are columns of the
/// equation. Where the dead time tau is estimated, all of this is done at each of a grid, half a sample apart; in the
/// samples beside the best, tau follows the step that the equation with one more column, `dx/dtau = -s B/A u`, asks
/// for, between bounds on both sides of the root. The covariance of all is `s^2 (Z'Z)^-1` with that column in Z.
pub struct ContinuousIv {
    structure: Structure,
    hold: Hold,
    stages: TwoStages,
    /// The same with the column of the dead time, if that is estimated.
    joint: Option<TwoStages>,
    noise: NoiseFit,
    stabilise: Stabilise,
    model: LinearModel,
    continuous: ContinuousModel,
    /// (f, b) per sample, the state at the first sample, the offset; the stable ones with the lowest sum of squared
    /// prediction errors, and that sum.
    theta: Vec<f64>,
    best: Vec<f64>,
    least: f64,
    /// The standard error of the offset.
    offset_error: f64,
    /// `s^(n-1)/A y ... 1/A y`, `s^m/A u ... 1/A u`, `s^n/A y`, and the instruments: `s^(n-1) B/A^2 v ... B/A^2 v`,
    /// v being u or the input of a closed loop without noise; of that also `s^m/A v ... 1/A v`.
    columns: Vec<Vec<f64>>,
    /// The columns of the state at the first sample, of the offset, and of the dead time.
    others: Vec<Vec<f64>>,
    source: Option<LoopInput>,
    /// The share of the time between samples that is left of it after the dead time, if that is not whole.
    share: Option<f64>,
    /// The input after the dead time, and v; of a dead time that is not whole the inputs at the samples on both sides.
    u: Vec<f64>,
    next: Vec<f64>,
    v: Vec<f64>,
    /// The output less `B/A u` and what is of the record, and its prediction errors.
    w: Vec<f64>,
    x: Vec<f64>,
    scratch: Vec<f64>,
}

impl ContinuousIv {
    /// Makes buffers for windows of `window` samples.
    pub(super) fn new(
        structure: Structure,
        continuous: ContinuousModel,
        stabilise: Stabilise,
        window: usize,
    ) -> Result<Self, SetupError> {
        let Structure { orders, range, .. } = structure;
        let Orders { nb, nf, .. } = orders;
        let joint = usize::from(range.is_some());
        let own = nf + nb + structure.others();
        let needed = own + joint + orders.nc + orders.nd + 1;
        enough_equations(orders, window, window, needed)?;
        let signal = || vec![0.0; window];
        Ok(Self {
            hold: continuous.hold,
            stages: TwoStages::new(own, own, window),
            joint: range.map(|_| TwoStages::new(own + 1, own + 1, window)),
            noise: NoiseFit::new(orders, window),
            source: None,
            stabilise,
            model: LinearModel::zero(structure.sampled(continuous.hold, continuous.dead_time)),
            continuous,
            theta: vec![0.0; own],
            best: vec![0.0; own],
            least: f64::INFINITY,
            offset_error: f64::NAN,
            columns: (0..=2 * nf + nb).map(|_| signal()).collect(),
            others: (0..structure.others() + joint).map(|_| signal()).collect(),
            share: None,
            u: signal(),
            next: signal(),
            v: Vec::new(),
            x: signal(),
            w: signal(),
            scratch: signal(),
            structure,
        })
    }

    /// Forms the instruments from a closed loop's input without noise.
    pub(super) fn with_source(mut self, source: LoopInput) -> Self {
        let window = self.x.len();
        let more = (0..self.structure.orders.nb).map(|_| vec![0.0; window]);
        self.columns.extend(more);
        self.v = vec![0.0; window];
        self.source = Some(source);
        self
    }

    /// Takes a dead time of so many samples, the last of them after `whole`, which may be all of it.
    fn delay(&mut self, u: &[f64], dead_time: f64, whole: f64) {
        self.continuous.dead_time = dead_time;
        let part = dead_time - whole;
        self.share = (self.joint.is_some() || part > 0.0).then_some(1.0 - part);
        let before = if self.structure.initial { u[0] } else { 0.0 };
        let whole = whole as usize;
        let late = whole + usize::from(self.share.is_some());
        delay(u, late, before, &mut self.u);
        delay(u, whole, before, &mut self.next);
    }

    /// Returns A, F and B of theta.
    fn polynomials(&self) -> [Vec<f64>; 3] {
        let Orders { nb, nf, .. } = self.structure.orders;
        let (f, b) = self.theta[..nf + nb].split_at(nf);
        let mut a = f.to_vec();
        a.resize(self.structure.degree(), 0.0);
        [a, f.to_vec(), b.to_vec()]
    }

    /// Computes all columns and w for theta.
    fn filter_all(&mut self, y: &[f64]) {
        let [a, f, b] = self.polynomials();
        let (n, nf, nb) = (a.len(), f.len(), b.len());
        let level = self.offset();
        let (columns, others) = (&mut self.columns, &mut self.others);
        self.w.copy_from_slice(y);
        if self.structure.offset {
            self.w.iter_mut().for_each(|w| *w -= level);
            others[self.structure.others() - 1].fill(1.0);
        }
        let mut input = vec![0.0; nf];
        input.iter_mut().take(1).for_each(|g| *g = 1.0);
        let of_y = Sampled::new(controller_form(&f).as_ref(), &input, Hold::First);
        let w = &self.w[..];
        run(&of_y, None, [w, w], |k, x| {
            for (column, x) in columns.iter_mut().zip(x) {
                column[k] = *x;
            }
            columns[nf + nb][k] = highest(&f, w[k], x) + level;
        });
        let of_u = Cascade::new(&b, &a, &f, self.hold, self.share);
        let (u, next, w) = (&self.u, &self.next, &mut self.w);
        let share = self.share.unwrap_or(0.0);
        let ([weight, of_next], [back, forth]) = (self.hold.weights(share), self.hold.rates());
        let (c, d) = output_of(&b, &a);
        let rate = row_times_form(&c, &a);
        let is_joint = self.joint.is_some();
        let way = of_u.way.as_ref();
        run(&of_u.system, way, [u, next], |k, states| {
            let v = weight * u[k] + of_next * next[k];
            let mut x = 0.0;
            for (i, b) in b.iter().enumerate() {
                let value = power(i, nb, &a, v, states);
                columns[nf + i][k] = value;
                x += b * value;
            }
            for (column, x) in columns[nf + nb + 1..].iter_mut().zip(&states[n..]) {
                column[k] = x * of_u.factor;
            }
            w[k] -= x;
            if is_joint && let Some(column) = others.last_mut() {
                let of_state: f64 = rate.iter().zip(states).map(|(c, x)| c * x).sum();
                column[k] = -(of_state + c[0] * v + d * (back * u[k] + forth * next[k]));
            }
        });
        if self.structure.initial {
            self.add_start(&a, &f);
        }
        if self.source.is_none() {
            return;
        }
        let (v, columns) = (&self.v, &mut self.columns);
        run(&of_u.system, None, [v, v], |k, states| {
            for (column, x) in columns[nf + nb + 1..].iter_mut().zip(&states[n..]) {
                column[k] = x * of_u.factor;
            }
            for (i, column) in columns[2 * nf + nb + 1..].iter_mut().enumerate() {
                column[k] = power(i, nb, &a, v[k], states);
            }
        });
    }

    /// Computes the columns of the state at the first sample, and adds its effect.
    fn add_start(&mut self, a: &[f64], f: &[f64]) {
        let (n, own) = (a.len(), f.len() + self.structure.orders.nb);
        let start = &self.theta[own..own + n];
        let of_impulse = Cascade::new(start, a, f, Hold::Zero, None);
        let [mut x, mut later] = [(); 2].map(|()| vec![0.0; n + f.len()]);
        x[0] = 1.0;
        with_fma!(|| {
            for k in 0..self.w.len() {
                for (i, number) in start.iter().enumerate() {
                    self.others[i][k] = x[i];
                    self.w[k] -= number * x[i];
                }
                for (column, x) in self.columns[own + 1..].iter_mut().zip(&x[n..]) {
                    column[k] += x * of_impulse.factor;
                }
                of_impulse.system.step([0.0; 2], &x, &mut later);
                std::mem::swap(&mut x, &mut later);
            }
        });
    }

    /// Filters all columns by D/C.
    fn whiten(&mut self) {
        if self.structure.orders.nc + self.structure.orders.nd == 0 {
            return;
        }
        for column in self.columns.iter_mut().chain(&mut self.others) {
            filter(&self.model.d, column, &mut self.scratch);
            divide(&self.model.c, &mut self.scratch);
            std::mem::swap(column, &mut self.scratch);
        }
    }

    /// Solves the linear equation of the columns, with instruments or by least squares; `joint`: with the step of the
    /// dead time.
    fn solve(&mut self, instrumental: bool, joint: bool) -> Result<f64, FailureKind> {
        let Orders { nb, nf: n, .. } = self.structure.orders;
        let (columns, looped) = (&self.columns, self.source.is_some());
        let stages = match &mut self.joint {
            Some(stages) if joint => stages,
            _ => &mut self.stages,
        };
        let others = &self.others[..stages.theta.len() - n - nb];
        let put = |mut to: MatMut<'_, f64>, j: usize, from: &[f64], first: usize, sign: f64| {
            for (to, value) in column(&mut to, j).iter_mut().zip(&from[first..]) {
                *to = sign * value;
            }
        };
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut right: MatMut<'_, f64>| {
            let of_z = if instrumental { n + nb + 1 } else { 0 };
            for i in 0..n {
                put(z.as_mut(), i, &columns[of_z + i], first, -1.0);
                put(right.as_mut(), i, &columns[i], first, -1.0);
            }
            let of_v = if instrumental && looped { n + nb + 1 } else { 0 };
            for i in n..n + nb {
                put(z.as_mut(), i, &columns[of_v + i], first, 1.0);
                put(right.as_mut(), i, &columns[i], first, 1.0);
            }
            for (i, other) in others.iter().enumerate() {
                put(z.as_mut(), n + nb + i, other, first, 1.0);
                put(right.as_mut(), n + nb + i, other, first, 1.0);
            }
            let last = n + nb + others.len();
            put(right.as_mut(), last, &columns[n + nb], first, 1.0);
        };
        stages.solve(self.u.len(), fill)
    }

    /// Changes theta by a share of the way to the solution; returns the longest way relative to the largest term of the
    /// equation, each parameter times the length of its column.
    fn take(&mut self, share: f64) -> f64 {
        let (theta, stages) = (&mut self.theta, &self.stages);
        let [way, size] = replace(theta, &stages.theta, share, |j| stages.length(j));
        way / size.max(f64::MIN_POSITIVE)
    }

    /// Reflects zeros of F(s) with `Re s >= 0`, if that is wanted.
    fn stay_stable(&mut self) -> Result<(), FailureKind> {
        let n = self.structure.orders.nf;
        if n == 0 {
            return Ok(());
        }
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
        let (a, b) = self.theta.split_at(self.structure.orders.nf);
        self.continuous.set_per_sample(b, a, &[]);
        self.continuous.sample(&mut self.model);
        source.close(&self.model, window);
        let dead = self.continuous.dead_time as usize;
        delay(&source.hat, dead, 0.0, &mut self.v);
    }

    /// Filters by the present model and keeps it if its errors are the smallest so far; returns the change of C and D.
    fn look(&mut self, window: Window<'_>, unfinished: &mut Option<FailureKind>) -> Result<f64, FailureKind> {
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
    fn start(&mut self, window: Window<'_>) -> Result<(), FailureKind> {
        let mut outcome = Ok(());
        let Orders { nb, nf: n, .. } = self.structure.orders;
        for i in 0..if n == 0 { 1 } else { MOST_FILTERS } {
            let lambda = FASTEST * 0.5_f64.powi(i as i32);
            if i > 0 && lambda * (window.len() as f64) < TIME_CONSTANTS {
                break;
            }
            self.theta.fill(0.0);
            if self.structure.offset {
                self.theta[n + nb + self.structure.others() - 1] = window.y[0];
            }
            let poles = vec![c64::new(-lambda, 0.0); n];
            for (a, phi) in self.theta.iter_mut().zip(polynomial_from_poles(&poles)) {
                *a = phi.re;
            }
            let tried = self.try_filter(window);
            if tried.is_err() {
                outcome = tried;
            }
        }
        if self.least.is_finite() { Ok(()) } else { outcome }
    }

    fn try_filter(&mut self, window: Window<'_>) -> Result<(), FailureKind> {
        self.filter_all(window.y);
        self.solve(false, false)?;
        self.take(1.0);
        let mut unused = None;
        for _ in 0..TRIES {
            self.noise.reset();
            self.look(window, &mut unused)?;
            self.whiten();
            self.solve(true, false)?;
            self.take(1.0);
        }
        self.look(window, &mut unused).map(|_| ())
    }

    fn iterate(&mut self, window: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        let mut damping = Damping::none();
        let mut unfinished = None;
        for pass in 1..=MOST_PASSES {
            *passes += 1;
            let of_noise = self.look(window, &mut unfinished)?;
            self.whiten();
            let condition = self.solve(true, false)?;
            let of_plant = self.take(damping.share);
            if of_plant <= REST && of_noise <= REST.sqrt() {
                return LoopInput::end(self.source.as_ref(), unfinished).map(|()| condition);
            }
            if damping.goes_around(pass, of_plant) {
                self.theta.copy_from_slice(&self.best);
            }
        }
        Err(unfinished.unwrap_or(FailureKind::IterationLimit))
    }
}

#[cfg(test)]
mod tests;
