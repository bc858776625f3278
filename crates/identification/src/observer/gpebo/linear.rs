//! Integrates everything linear exactly, by matrix exponentials.
//!
//! The base state is `[x; xi; z through the lags; line of u; line of delta; oscillators]`. Each sine in u and delta
//! is an oscillator with two states `(amplitude sin, amplitude cos)`. All other waves of a signal together form one
//! straight line over a step, with two states (value, slope). These states are set anew at the start of each step,
//! so that no phase drifts. No observer feeds back into the base state, so an observer that overflows spoils nothing
//! else.

use faer::Mat;
use std::sync::Arc;

use super::matrices::{fill_plant, fill_signals, multiply, regressor_matrix};
use super::settings::{GpeboOptions, ObserverSpec, Scenario};
use super::state_observer::{StateEstimate, StateObserver};
use crate::plant::{ContinuousPlant, exponential_by};
use crate::real::{MOST_LANES, Real};
use crate::signal::{Signal, Wave};

/// The system matrices, and the positions of the parts of the base state.
#[derive(Clone, Debug)]
pub struct LinearSystem {
    n: usize,
    c: Vec<f64>,
    x0: Vec<f64>,
    xi0: Vec<f64>,
    signals: [Signal; 2],
    /// Index of the first of the two states of each line, u and delta.
    lines: [usize; 2],
    /// Index of the first oscillator state.
    oscillators: usize,
    /// Indices of the base states that add up to delta.
    disturbance: Vec<usize>,
    base: Mat<f64>,
    observers: Vec<StateObserver>,
    /// The rows of M that lags make, from 1 on; the others are delays.
    lag_rows: Vec<usize>,
    /// The matrix of `[Phi; phi through the lags]`, square, n and one row for each lag.
    regressor: Mat<f64>,
}

/// Propagators over one step length, row by row.
#[derive(Clone, Debug)]
pub struct Propagator<R = f64> {
    base: Vec<R>,
    regressor: Vec<R>,
    /// Of each state observer its own rows.
    observers: Vec<Vec<R>>,
}

impl<R: Real> Propagator<R> {
    /// Returns the same propagators in every lane.
    pub fn splat(of: &Propagator) -> Self {
        let splat = |numbers: &Vec<f64>| numbers.iter().map(|x| R::splat(*x)).collect();
        Self {
            base: splat(&of.base),
            regressor: splat(&of.regressor),
            observers: of.observers.iter().map(splat).collect(),
        }
    }

    /// Replaces those of some lanes.
    pub fn set(&mut self, lanes: R::Mask, of: &Propagator) {
        let set = |(to, from): (&mut Vec<R>, &Vec<f64>)| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = R::select(lanes, R::splat(*from), *to);
            }
        };
        [(&mut self.base, &of.base), (&mut self.regressor, &of.regressor)]
            .into_iter()
            .chain(self.observers.iter_mut().zip(&of.observers))
            .for_each(set);
    }
}

/// Propagators that are known already, of systems that are alike.
#[derive(Debug, Default)]
pub struct Propagators {
    of: Option<LinearSystem>,
    /// With the length of the step, and the squarings that were added.
    known: Vec<((f64, i32), Arc<Propagator>)>,
}

impl Propagators {
    /// So many are kept at most.
    const MOST: usize = 64;

    /// Returns the propagators of a system over a step of h seconds, with so many squarings more than needed.
    pub fn get(&mut self, system: &LinearSystem, h: f64, more: i32) -> Arc<Propagator> {
        if let Some((_, propagator)) = self.known.iter().find(|(of, _)| *of == (h, more)) {
            return propagator.clone();
        }
        let found = Arc::new(system.propagator(h, more));
        if self.known.len() < Self::MOST {
            self.known.push(((h, more), found.clone()));
        }
        found
    }

    /// Forgets those of systems that are unlike this one.
    pub fn of(&mut self, system: &LinearSystem) {
        if self.of.as_ref().is_none_or(|of| !of.is_like(system)) {
            self.known.clear();
            self.of = Some(system.clone());
        }
    }
}

/// The state of the linear systems.
#[derive(Clone, Debug)]
pub struct LinearState<R> {
    base: Vec<R>,
    /// One for each state observer.
    pub(super) observers: Vec<StateEstimate<R>>,
    /// `[Phi; phi through the lags]`, n columns, column-major.
    regressor: Vec<R>,
    scratch: Vec<R>,
}

fn sines(signal: &Signal) -> impl Iterator<Item = &Wave> {
    signal.waves.iter().filter(|wave| matches!(wave, Wave::Sine { .. }))
}

impl LinearSystem {
    /// Returns the matrices of checked settings.
    pub fn new(
        plant: &ContinuousPlant,
        scenario: &Scenario,
        options: &GpeboOptions,
        observers: &[ObserverSpec],
    ) -> Self {
        let n = plant.order();
        let signals = [scenario.u.clone(), scenario.delta.clone()];
        let (lag_rows, lags): (Vec<usize>, Vec<f64>) = (1..)
            .zip(&options.filters)
            .filter_map(|(row, operator)| Some((row, operator.lag()?)))
            .unzip();
        let lines = [2 * n + lags.len(), 2 * n + lags.len() + 2];
        let oscillators = lines[1] + 2;
        let count = signals.each_ref().map(|signal| sines(signal).count());
        let sum = |line: usize, first: usize, count: usize| -> Vec<usize> {
            std::iter::once(line).chain((0..count).map(|k| first + 2 * k)).collect()
        };
        let input = sum(lines[0], oscillators, count[0]);
        let disturbance = sum(lines[1], oscillators + 2 * count[0], count[1]);
        let size = oscillators + 2 * (count[0] + count[1]);
        let mut base = Mat::zeros(size, size);
        fill_plant(&mut base, plant, &lags, &input, &disturbance);
        fill_signals(&mut base, lines, oscillators, &signals);
        let observers = observers
            .iter()
            .filter_map(|spec| StateObserver::new(spec, &base, plant, [&input, &disturbance]))
            .collect();
        Self {
            n,
            c: plant.c().to_vec(),
            x0: scenario.x0.clone(),
            xi0: options.xi0.clone(),
            signals,
            lines,
            oscillators,
            disturbance,
            base,
            observers,
            regressor: regressor_matrix(plant, &lags),
            lag_rows,
        }
    }

    /// Returns the propagators over a step of h seconds. With more squarings than needed they are the same numbers with
    /// another rounding.
    pub fn propagator(&self, h: f64, more: i32) -> Propagator {
        let over = |m: &Mat<f64>| exponential_by((faer::Scale(h) * m).as_ref(), more);
        let rows = |m: &Mat<f64>, first_row: usize| -> Vec<f64> {
            (first_row..m.nrows())
                .flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)]))
                .collect()
        };
        let size = self.base.nrows();
        let observers = self
            .observers
            .iter()
            .map(|observer| rows(&over(&observer.matrix), size));
        Propagator {
            base: rows(&over(&self.base), 0),
            regressor: rows(&over(&self.regressor), 0),
            observers: observers.collect(),
        }
    }

    /// Whether propagators and states of one system are those of the other too: they differ at most in their signals'
    /// lines, phases and amplitudes. The starts are the same too.
    pub fn is_like(&self, other: &Self) -> bool {
        self.base == other.base
            && self.observers == other.observers
            && self.regressor == other.regressor
            && (&self.c, &self.x0, &self.xi0) == (&other.c, &other.x0, &other.xi0)
            && (&self.disturbance, &self.lag_rows) == (&other.disturbance, &other.lag_rows)
            && (self.lines, self.oscillators) == (other.lines, other.oscillators)
    }

    /// Returns the states at t = 0; [`Self::start_step`] sets those of the signals.
    pub fn initial<R: Real>(&self) -> LinearState<R> {
        let (n, rows) = (self.n, self.regressor.nrows());
        let splat = |x: &f64| R::splat(*x);
        let zeros = vec![0.0; self.base.nrows() - 2 * n];
        let base = self.x0.iter().chain(&self.xi0).chain(&zeros);
        let base: Vec<R> = base.map(splat).collect();
        let mut regressor = vec![R::zero(); rows * n];
        for j in 0..n {
            regressor[j * rows + j] = R::splat(1.0);
        }
        LinearState {
            scratch: vec![R::zero(); base.len().max(rows * n)],
            base,
            observers: self.observers.iter().map(StateObserver::initial).collect(),
            regressor,
        }
    }

    /// Returns the number of oscillators.
    pub fn oscillators(&self) -> usize {
        (self.base.nrows() - self.oscillators) / 2
    }

    /// Computes the states of the oscillators at t.
    pub fn oscillate(&self, t: f64, states: &mut [(f64, f64)]) {
        let waves = self.signals.iter().flat_map(sines);
        for (state, wave) in states.iter_mut().zip(waves) {
            *state = wave.sine(t);
        }
    }

    /// Computes the lines of u and delta at t; the time `inside` selects the piece of each signal.
    pub fn line(&self, t: f64, inside: f64) -> [(f64, f64); 2] {
        self.signals.each_ref().map(|signal| signal.line(t, inside))
    }

    /// Sets the states of u and delta at the start of a step: the lines of the lanes, and their oscillators, each with
    /// all lanes together.
    #[inline(always)]
    pub fn start_step<R: Real>(
        &self,
        state: &mut LinearState<R>,
        lines: &[[[f64; MOST_LANES]; 2]; 2],
        oscillators: &[[[f64; MOST_LANES]; 2]],
    ) {
        for (line, &first) in lines.iter().zip(&self.lines) {
            state.base[first] = R::load(&line[0]);
            state.base[first + 1] = R::load(&line[1]);
        }
        let states = &mut state.base[self.oscillators..];
        for (k, pair) in oscillators.iter().enumerate() {
            states[2 * k] = R::load(&pair[0]);
            states[2 * k + 1] = R::load(&pair[1]);
        }
    }

    /// Computes the rows of phi and of lags of M (row-major n x n, rows phi and H_i phi) and of `zbar = [z; H_i z]`,
    /// Eqs. (9), (10).
    #[inline(always)]
    pub fn observe<R: Real>(&self, state: &LinearState<R>, m: &mut [R], zbar: &mut [R]) {
        let (n, rows) = (self.n, self.regressor.nrows());
        // The sum of nothing is -0.
        let (mut delta, mut error) = (R::splat(-0.0), R::splat(-0.0));
        for &k in &self.disturbance {
            delta = delta + state.base[k];
        }
        for i in 0..n {
            error = error + R::splat(self.c[i]) * (state.base[i] - state.base[n + i]);
        }
        zbar[0] = error + delta;
        for (k, &row) in self.lag_rows.iter().enumerate() {
            zbar[row] = state.base[2 * n + k];
        }
        for j in 0..n {
            let column = &state.regressor[j * rows..][..rows];
            let mut sum = R::splat(-0.0);
            for i in 0..n {
                sum = sum + R::splat(self.c[i]) * column[i];
            }
            m[j] = sum;
            for (k, &row) in self.lag_rows.iter().enumerate() {
                m[row * n + j] = column[n + k];
            }
        }
    }
}

impl<R: Real> LinearState<R> {
    /// Takes over the state of the same systems.
    pub fn copy_from(&mut self, other: &Self) {
        self.base.copy_from_slice(&other.base);
        for (to, from) in self.observers.iter_mut().zip(&other.observers) {
            to.copy_from(from);
        }
        self.regressor.copy_from_slice(&other.regressor);
    }

    /// Advances the state by one propagation. Allocates nothing.
    #[inline(always)]
    pub fn advance(&mut self, by: &Propagator<R>, n: usize) {
        let (rows, size) = (self.regressor.len() / n, self.base.len());
        let Self {
            base,
            observers,
            scratch,
            regressor,
        } = self;
        // The observers need the base state at the start of the step.
        for (observer, by) in observers.iter_mut().zip(&by.observers) {
            observer.advance(by, base);
        }
        multiply(&by.base, base, &mut scratch[..size]);
        base.copy_from_slice(&scratch[..size]);
        for j in 0..n {
            let column = &mut regressor[j * rows..][..rows];
            multiply(&by.regressor, column, &mut scratch[..rows]);
            column.copy_from_slice(&scratch[..rows]);
        }
    }

    /// Returns x, of length n.
    pub fn x(&self, n: usize) -> &[R] {
        &self.base[..n]
    }

    /// Computes `xhat = xi + Phi theta_hat`, Eq. (8).
    #[inline(always)]
    pub fn reconstruct(&self, theta: &[R], xhat: &mut [R]) {
        let n = theta.len();
        let rows = self.regressor.len() / n;
        for i in 0..n {
            let mut sum = self.base[n + i];
            for j in 0..n {
                sum = sum + self.regressor[j * rows + i] * theta[j];
            }
            xhat[i] = sum;
        }
    }
}
