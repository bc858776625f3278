//! Integrates everything linear exactly, by matrix exponentials.
//!
//! The base state is `[x; xi; z through the lags; line of u; line of delta; oscillators]`. Each sine in u and delta is
//! an oscillator with two states `(amplitude sin, amplitude cos)`. All other waves of a signal together form one
//! straight line over a step, with two states (value, slope). These states are set anew at the start of each step, so
//! that no phase drifts. No observer feeds back into the base state, so an observer that overflows spoils nothing else.

use faer::Mat;

use super::matrices::{fill_plant, fill_signals, multiply_add, observer_matrix, regressor_matrix};
use super::observer_spec::ObserverSpec;
use super::riccati_filter::{FilterState, FilterSystem};
use super::scenario::{GpeboOptions, Scenario};
use crate::plant::{ContinuousPlant, exponential};
use crate::signal::{Signal, Wave};

/// A full-order observer's gain and initial state.
#[derive(Clone, Debug)]
struct Luenberger {
    gain: Vec<f64>,
    x0: Vec<f64>,
}

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
    /// `[base 0; coupling, A - L C']` for each full-order observer.
    observers: Vec<Mat<f64>>,
    luenberger: Vec<Luenberger>,
    filters: Vec<FilterSystem>,
    /// The rows of M that lags make, from 1 on; the others are delays.
    lag_rows: Vec<usize>,
    /// The matrix of `[Phi; phi through the lags]`, square, n and one row for each lag.
    regressor: Mat<f64>,
}

/// Column-major propagators over one step length.
#[derive(Clone, Debug)]
pub struct Propagator {
    base: Vec<f64>,
    observers: Vec<Vec<f64>>,
    filters: Vec<Vec<f64>>,
    regressor: Vec<f64>,
}

/// The state of the linear systems.
#[derive(Clone, Debug)]
pub struct LinearState {
    base: Vec<f64>,
    /// n numbers for each full-order observer.
    observers: Vec<f64>,
    /// The time-varying filters.
    pub(super) filters: Vec<FilterState>,
    /// `[Phi; phi through the lags]`, n columns, column-major.
    regressor: Vec<f64>,
    scratch: Vec<f64>,
}

fn sines(signal: &Signal) -> impl Iterator<Item = &Wave> {
    signal
        .waves
        .iter()
        .filter(|wave| matches!(wave, Wave::Sine { .. }))
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
            std::iter::once(line)
                .chain((0..count).map(|k| first + 2 * k))
                .collect()
        };
        let input = sum(lines[0], oscillators, count[0]);
        let disturbance = sum(lines[1], oscillators + 2 * count[0], count[1]);
        let size = oscillators + 2 * (count[0] + count[1]);
        let mut base = Mat::zeros(size, size);
        fill_plant(&mut base, plant, &lags, &input, &disturbance);
        fill_signals(&mut base, lines, oscillators, &signals);
        let luenberger: Vec<Luenberger> = observers.iter().filter_map(luenberger).collect();
        let filters = observers
            .iter()
            .filter_map(|spec| FilterSystem::new(spec, &base, plant, &input, &disturbance))
            .collect();
        let observers = luenberger
            .iter()
            .map(|observer| observer_matrix(&base, plant, &observer.gain, &input, &disturbance))
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
            luenberger,
            filters,
            regressor: regressor_matrix(plant, &lags),
            lag_rows,
        }
    }

    /// Returns the propagators over a step of h seconds.
    pub fn propagator(&self, h: f64) -> Propagator {
        let over = |m: &Mat<f64>| exponential((faer::Scale(h) * m).as_ref());
        let columns = |m: &Mat<f64>, first_row: usize| -> Vec<f64> {
            (0..m.ncols())
                .flat_map(|j| (first_row..m.nrows()).map(move |i| m[(i, j)]))
                .collect()
        };
        Propagator {
            base: columns(&over(&self.base), 0),
            observers: self
                .observers
                .iter()
                .map(|m| columns(&over(m), self.base.nrows()))
                .collect(),
            filters: self
                .filters
                .iter()
                .map(|filter| columns(&over(&filter.matrix), self.base.nrows()))
                .collect(),
            regressor: columns(&over(&self.regressor), 0),
        }
    }

    /// Returns the states at t = 0; [`Self::start_step`] sets those of the signals.
    pub fn initial(&self) -> LinearState {
        let (n, rows) = (self.n, self.regressor.nrows());
        let mut base = vec![0.0; self.base.nrows()];
        base[..n].copy_from_slice(&self.x0);
        base[n..2 * n].copy_from_slice(&self.xi0);
        let mut regressor = vec![0.0; rows * n];
        for j in 0..n {
            regressor[j * rows + j] = 1.0;
        }
        LinearState {
            scratch: vec![0.0; base.len().max(rows * n)],
            base,
            observers: self
                .luenberger
                .iter()
                .flat_map(|l| l.x0.iter().copied())
                .collect(),
            filters: self.filters.iter().map(FilterSystem::initial).collect(),
            regressor,
        }
    }

    /// Sets the states of u and delta at t; the time `inside` selects the piece of each signal.
    pub fn start_step(&self, state: &mut LinearState, t: f64, inside: f64) {
        for (signal, &first) in self.signals.iter().zip(&self.lines) {
            (state.base[first], state.base[first + 1]) = signal.line(t, inside);
        }
        let all = self.signals.iter().flat_map(sines);
        for (wave, pair) in all.zip(state.base[self.oscillators..].chunks_exact_mut(2)) {
            (pair[0], pair[1]) = wave.sine(t);
        }
    }

    /// Computes the rows of phi and of lags of M (row-major n x n, rows phi and H_i phi) and of `zbar = [z; H_i z]`,
    /// Eqs. (9), (10).
    pub fn observe(&self, state: &LinearState, m: &mut [f64], zbar: &mut [f64]) {
        let (n, rows) = (self.n, self.regressor.nrows());
        let (x, rest) = state.base.split_at(n);
        let delta: f64 = self.disturbance.iter().map(|&k| state.base[k]).sum();
        let error = self
            .c
            .iter()
            .zip(x.iter().zip(rest))
            .map(|(c, (x, xi))| c * (x - xi));
        zbar[0] = error.sum::<f64>() + delta;
        for (&row, filtered) in self.lag_rows.iter().zip(&state.base[2 * n..]) {
            zbar[row] = *filtered;
        }
        for (j, column) in state.regressor.chunks_exact(rows).enumerate() {
            m[j] = self.c.iter().zip(column).map(|(c, phi)| c * phi).sum();
            for (&row, filtered) in self.lag_rows.iter().zip(&column[n..]) {
                m[row * n + j] = *filtered;
            }
        }
    }
}

impl LinearState {
    /// Takes over the state of the same systems.
    pub fn copy_from(&mut self, other: &Self) {
        self.base.copy_from_slice(&other.base);
        self.observers.copy_from_slice(&other.observers);
        for (to, from) in self.filters.iter_mut().zip(&other.filters) {
            to.copy_from(from);
        }
        self.regressor.copy_from_slice(&other.regressor);
    }

    /// Advances the state by one propagation. Allocates nothing.
    pub fn advance(&mut self, by: &Propagator, n: usize) {
        let rows = self.regressor.len() / n;
        // The observers need the base state at the start of the step.
        for (p, xhat) in by.observers.iter().zip(self.observers.chunks_exact_mut(n)) {
            let (from_base, own) = p.split_at(self.base.len() * n);
            let next = &mut self.scratch[..n];
            next.fill(0.0);
            multiply_add(from_base, &self.base, next);
            multiply_add(own, xhat, next);
            xhat.copy_from_slice(next);
        }
        for (filter, by) in self.filters.iter_mut().zip(&by.filters) {
            filter.advance(by, &self.base);
        }
        let next = &mut self.scratch[..self.base.len()];
        next.fill(0.0);
        multiply_add(&by.base, &self.base, next);
        self.base.copy_from_slice(next);
        let next = &mut self.scratch[..rows * n];
        next.fill(0.0);
        for (column, next) in self
            .regressor
            .chunks_exact(rows)
            .zip(next.chunks_exact_mut(rows))
        {
            multiply_add(&by.regressor, column, next);
        }
        self.regressor.copy_from_slice(next);
    }

    /// Returns x, of length n.
    pub fn x(&self, n: usize) -> &[f64] {
        &self.base[..n]
    }

    /// Computes `xhat = xi + Phi theta_hat`, Eq. (8).
    pub fn reconstruct(&self, theta: &[f64], xhat: &mut [f64]) {
        let n = theta.len();
        xhat.copy_from_slice(&self.base[n..2 * n]);
        let rows = self.regressor.len() / n;
        for (column, theta) in self.regressor.chunks_exact(rows).zip(theta) {
            for (xhat, phi) in xhat.iter_mut().zip(column) {
                *xhat += phi * theta;
            }
        }
    }

    /// Returns the estimate of the k-th full-order observer.
    pub fn luenberger(&self, k: usize, n: usize) -> &[f64] {
        &self.observers[k * n..(k + 1) * n]
    }
}

fn luenberger(spec: &ObserverSpec) -> Option<Luenberger> {
    match spec {
        ObserverSpec::Luenberger { gain, x0 } => Some(Luenberger {
            gain: gain.clone(),
            x0: x0.clone(),
        }),
        _ => None,
    }
}
