//! Young's refined instrumental variables for a model in continuous time, `y = B(s)/A(s) u + C/D e` at the samples.
//!
//! Sources: P. C. Young and A. J. Jakeman, *Refined instrumental variable methods of recursive time-series analysis,
//! part III*, Int. J. Control 31 (1980); H. Garnier and L. Wang (eds.), *Identification of Continuous-time Models from
//! Sampled Data*, 2008, chapters 4 and 5; S. Pan, R. A. Gonzalez, J. S. Welsh and C. R. Rojas, *Consistency analysis of
//! the simplified refined instrumental variable method for continuous-time systems*, Automatica 113 (2020).

mod dead_time;
mod options;

use super::output_error_iteration::{MOST_PASSES, PROGRESS, ROUND};
use crate::estimator::instruments::TwoStages;
use crate::estimator::loop_input::LoopInput;
use crate::estimator::noise_fit::{NoiseFit, put_block, replace};
use crate::estimator::reflection::Stabilise;
use crate::estimator::solver::rank::inverse_power_of_two;
use crate::estimator::{FailureKind, Iteration, Offset, Pass, SetupError, Window, enough_equations};
use crate::model::polynomial::{divide, filter};
use crate::model::{ContinuousModel, Hold, LinearModel, Orders, Sampled, controller_form, output_of, row_times_form};
use crate::plant::{PoleFinder, polynomial_from_poles};
pub use dead_time::{DeadTime, DeadTimeError};
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
        run(&of_y, None, [w, w], &mut self.scratch, |k, x| {
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
        run(&of_u.system, way, [u, next], &mut self.scratch, |k, states| {
            let v = weight * u[k] + of_next * next[k];
            let mut x = 0.0;
            for (i, b) in b.iter().enumerate() {
                let value = power(i, nb, &a, v, states);
                columns[nf + i][k] = value;
                x += b * value;
            }
            for (column, x) in columns[nf + nb + 1..].iter_mut().zip(&states[n..]) {
                column[k] = x / of_u.unit;
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
        run(&of_u.system, None, [v, v], &mut self.scratch, |k, states| {
            for (column, x) in columns[nf + nb + 1..].iter_mut().zip(&states[n..]) {
                column[k] = x / of_u.unit;
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
        let mut x = vec![0.0; n + f.len()];
        x[0] = 1.0;
        for k in 0..self.w.len() {
            for (i, number) in start.iter().enumerate() {
                self.others[i][k] = x[i];
                self.w[k] -= number * x[i];
            }
            for (column, x) in self.columns[own + 1..].iter_mut().zip(&x[n..]) {
                column[k] += x / of_impulse.unit;
            }
            let scratch = &mut self.scratch[..n + f.len()];
            of_impulse.system.step([0.0; 2], &mut x, scratch);
        }
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
    fn solve(&mut self, instrumental: bool, joint: bool, condition: &mut f64) -> Result<(), FailureKind> {
        let Orders { nb, nf: n, .. } = self.structure.orders;
        let (columns, looped) = (&self.columns, self.source.is_some());
        let stages = match &mut self.joint {
            Some(stages) if joint => stages,
            _ => &mut self.stages,
        };
        let others = &self.others[..stages.theta.len() - n - nb];
        let put = |mut to: MatMut<'_, f64>, column: usize, from: &[f64], first: usize, sign: f64| {
            let rows = to.nrows();
            for (row, value) in from[first..first + rows].iter().enumerate() {
                to[(row, column)] = sign * value;
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
        stages.solve(self.u.len(), fill, condition)
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
    fn start(&mut self, window: Window<'_>, condition: &mut f64) -> Result<(), FailureKind> {
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
            let tried = self.try_filter(window, condition);
            if tried.is_err() {
                outcome = tried;
            }
        }
        if self.least.is_finite() { Ok(()) } else { outcome }
    }

    fn try_filter(&mut self, window: Window<'_>, condition: &mut f64) -> Result<(), FailureKind> {
        self.filter_all(window.y);
        self.solve(false, false, condition)?;
        self.take(1.0);
        let mut unused = None;
        for _ in 0..TRIES {
            self.noise.reset();
            self.look(window, &mut unused)?;
            self.whiten();
            self.solve(true, false, condition)?;
            self.take(1.0);
        }
        self.look(window, &mut unused).map(|_| ())
    }

    fn iterate(&mut self, window: Window<'_>, passes: &mut usize, condition: &mut f64) -> Result<(), FailureKind> {
        let (mut share, mut asked) = (1.0, f64::INFINITY);
        let mut unfinished = None;
        for pass in 1..=MOST_PASSES {
            *passes += 1;
            let of_noise = self.look(window, &mut unfinished)?;
            self.whiten();
            self.solve(true, false, condition)?;
            let of_plant = self.take(share);
            if of_plant <= REST && of_noise <= REST.sqrt() {
                let of_loop = self.source.as_ref();
                let unstable = of_loop.is_some_and(|source| source.is_unstable);
                let unstable = unstable.then_some(FailureKind::UnstableInstruments);
                return unfinished.or(unstable).map_or(Ok(()), Err);
            }
            if pass.is_multiple_of(ROUND) {
                if of_plant > PROGRESS * asked {
                    share /= 2.0;
                    self.theta.copy_from_slice(&self.best);
                }
                asked = of_plant;
            }
        }
        Err(unfinished.unwrap_or(FailureKind::IterationLimit))
    }

    /// Begins anew at the present dead time, and iterates.
    fn settle(&mut self, window: Window<'_>, passes: &mut usize, condition: &mut f64) -> Result<(), FailureKind> {
        self.least = f64::INFINITY;
        self.start(window, condition)?;
        self.theta.copy_from_slice(&self.best);
        self.noise.reset();
        self.iterate(window, passes, condition)
    }

    /// Searches the dead time on a range.
    fn search(
        &mut self,
        window: Window<'_>,
        [low, high]: [f64; 2],
        passes: &mut usize,
        condition: &mut f64,
    ) -> Result<(), FailureKind> {
        let mut outcome = Err(FailureKind::Singular);
        let mut best = (f64::INFINITY, low, Vec::new());
        let halves = (2.0 * low).floor() as usize..=(2.0 * high).ceil() as usize;
        for dead_time in halves.map(|i| (0.5 * i as f64).clamp(low, high)) {
            self.delay(window.u, dead_time, dead_time.floor());
            match self.settle(window, passes, condition) {
                Err(kind) if self.least.is_infinite() => outcome = Err(kind),
                _ if self.least < best.0 => best = (self.least, dead_time, self.best.clone()),
                _ => {}
            }
        }
        let (least, from, theta) = best;
        if least.is_infinite() {
            return outcome;
        }
        let mut found = (f64::INFINITY, from, from.floor(), theta.clone());
        // A whole dead time has a sample on either side.
        let mut cells = vec![from.ceil() - 1.0, from.floor()];
        cells.dedup();
        for whole in cells {
            let ends = [whole.max(low), (whole + 1.0).min(high)];
            if ends[0] >= ends[1] {
                continue;
            }
            self.theta.copy_from_slice(&theta);
            let reached = self.approach(window, whole, ends, from, passes, condition);
            if self.least < found.0 {
                let own = self.continuous.dead_time;
                (found, outcome) = ((self.least, own, whole, self.best.clone()), reached);
            }
        }
        let (_, dead_time, whole, theta) = found;
        self.theta.copy_from_slice(&theta);
        self.best.copy_from_slice(&theta);
        self.delay(window.u, dead_time, whole);
        if outcome.is_ok() {
            self.least = f64::INFINITY;
            outcome = self.iterate(window, passes, condition);
            outcome = outcome.and_then(|()| self.solve(true, true, condition));
        }
        // The end of a range that was given hides the minimum; no plant has a dead time below 0.
        let is_hidden = dead_time == high || (dead_time == low && low > 0.0);
        let has_model = outcome.err().is_none_or(FailureKind::leaves_a_model);
        if is_hidden && has_model {
            return Err(FailureKind::Boundary);
        }
        outcome
    }

    /// Goes to the dead time where the loss is least between two of them, after `whole` samples: where the step that
    /// the equation asks for is 0, or at an end beyond which it goes.
    fn approach(
        &mut self,
        window: Window<'_>,
        whole: f64,
        [mut low, mut high]: [f64; 2],
        from: f64,
        passes: &mut usize,
        condition: &mut f64,
    ) -> Result<(), FailureKind> {
        let (ends, mut dead_time) = ([low, high], from);
        let mut seen = [false; 2];
        for _ in 0..MOST_STEPS {
            self.delay(window.u, dead_time, whole);
            self.least = f64::INFINITY;
            self.iterate(window, passes, condition)?;
            self.solve(true, true, condition)?;
            let Some(stages) = &self.joint else {
                return Ok(());
            };
            let last = stages.theta.len() - 1;
            let step = stages.theta[last];
            let size = |(j, theta): (usize, &f64)| theta.abs() * stages.length(j);
            let size = stages.theta[..last].iter().enumerate().map(size);
            let is_small = step.abs() * stages.length(last) <= REST * size.fold(0.0, f64::max);
            let is_outside = (dead_time == ends[0] && step < 0.0) || (dead_time == ends[1] && step > 0.0);
            let (bound, other) = if step > 0.0 { (&mut low, high) } else { (&mut high, low) };
            *bound = dead_time;
            seen[usize::from(step < 0.0)] = true;
            let rounding = 4.0 * f64::EPSILON * high.max(1.0);
            if is_small || is_outside || high - low <= rounding {
                return Ok(());
            }
            let next = dead_time + step;
            dead_time = if low < next && next < high {
                next
            } else if seen[usize::from(step > 0.0)] {
                0.5 * (low + high)
            } else {
                other
            };
        }
        Err(FailureKind::IterationLimit)
    }

    /// Returns the constant in y.
    fn offset(&self) -> f64 {
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

/// A model `B/A`, and behind it the filter 1/F of its output: n states and nf more.
struct Cascade {
    system: Sampled,
    /// The same over a share of the time between samples.
    way: Option<Sampled>,
    /// The filter's states are in this unit, a power of two: an exponential would round in that of the numerator.
    unit: f64,
}

impl Cascade {
    fn new(numerator: &[f64], a: &[f64], f: &[f64], hold: Hold, share: Option<f64>) -> Self {
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
            unit,
        }
    }
}

/// Returns `s^n/A` of a signal, from the states `s^(n-1)/A ... 1/A` and the signal.
fn highest(a: &[f64], v: f64, x: &[f64]) -> f64 {
    v - a.iter().zip(x).map(|(a, x)| a * x).sum::<f64>()
}

/// Returns `s^(nb-1-i)/A` of a signal, in the same way.
fn power(i: usize, nb: usize, a: &[f64], v: f64, x: &[f64]) -> f64 {
    match (a.len() + i).checked_sub(nb) {
        Some(state) => x[state],
        None => highest(a, v, x),
    }
}

/// Delays a signal by some samples.
fn delay(signal: &[f64], samples: usize, before: f64, to: &mut [f64]) {
    let samples = samples.min(signal.len());
    to[..samples].fill(before);
    to[samples..].copy_from_slice(&signal[..signal.len() - samples]);
}

/// Runs a system from rest under v, and tells the states of each sample, or those that `way` goes to from there with
/// the input's next value.
fn run(
    system: &Sampled,
    way: Option<&Sampled>,
    [v, next]: [&[f64]; 2],
    scratch: &mut [f64],
    mut tell: impl FnMut(usize, &[f64]),
) {
    let n = system.now.len();
    let (mut x, mut seen) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..v.len() {
        if k == 0 {
            system.start(v[0], &mut x);
        } else {
            system.step([v[k - 1], v[k]], &mut x, &mut scratch[..n]);
        }
        let Some(way) = way else {
            tell(k, &x);
            continue;
        };
        seen.copy_from_slice(&x);
        way.step([v[k], next[k]], &mut seen, &mut scratch[..n]);
        tell(k, &seen);
    }
}

impl Iteration for ContinuousIv {
    fn find(&mut self, window: Window<'_>, passes: &mut usize, condition: &mut f64) -> Result<(), FailureKind> {
        self.least = f64::INFINITY;
        if let Some(source) = &mut self.source {
            source.follow(window.u, window.r)?;
            let dead = self.continuous.dead_time as usize;
            delay(&source.hat, dead, 0.0, &mut self.v);
        }
        let found = if let Some(range) = self.structure.range {
            self.search(window, range, passes, condition)
        } else {
            let dead_time = self.continuous.dead_time;
            self.delay(window.u, dead_time, dead_time.floor());
            self.settle(window, passes, condition)
        };
        found.map_err(|kind| {
            let ends = [FailureKind::UnstablePredictor, FailureKind::UnstableInstruments];
            if ends.contains(&kind) || self.least.is_infinite() {
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

#[cfg(test)]
mod tests;
