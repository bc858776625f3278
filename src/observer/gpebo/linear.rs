//! Everything linear, integrated exactly by matrix exponentials.
//!
//! The base state is `[x; xi; filtered z; line of u; line of delta; oscillators]`: the sines of u
//! and delta are oscillators of two states `(amplitude sin, amplitude cos)`, all their other waves
//! are one straight line over a step, of two states (value, slope). They are set anew at each
//! step's start, so that no phase drifts. Nothing feeds back into the base state from an observer,
//! so that an observer that overflows spoils nothing else.

use faer::Mat;

use super::matrices::{fill_plant, fill_signals, observer_matrix, regressor_matrix};
use super::scenario::{GpeboOptions, ObserverSpec, Scenario};
use crate::plant::{ContinuousPlant, exponential};
use crate::signal::{Signal, Wave};

/// A full-order observer's gain and initial state.
#[derive(Clone, Debug)]
struct Luenberger {
    gain: Vec<f64>,
    x0: Vec<f64>,
}

/// The system matrices, and where the parts of the base state are.
#[derive(Clone, Debug)]
pub struct LinearSystem {
    n: usize,
    c: Vec<f64>,
    x0: Vec<f64>,
    xi0: Vec<f64>,
    signals: [Signal; 2],
    /// First of the two states of the lines of u and delta.
    lines: [usize; 2],
    /// First oscillator state.
    oscillators: usize,
    /// Which base states sum up to delta.
    disturbance: Vec<usize>,
    base: Mat<f64>,
    /// `[base 0; coupling, A - L C']` of each full-order observer.
    observers: Vec<Mat<f64>>,
    luenberger: Vec<Luenberger>,
    /// Of `[Phi; filtered phi]`, (2n - 1) x (2n - 1).
    regressor: Mat<f64>,
}

/// Column-major propagators over one length.
#[derive(Clone, Debug)]
pub struct Propagator {
    base: Vec<f64>,
    observers: Vec<Vec<f64>>,
    regressor: Vec<f64>,
}

/// The linear states.
#[derive(Clone, Debug)]
pub struct LinearState {
    base: Vec<f64>,
    /// n numbers for each full-order observer.
    observers: Vec<f64>,
    /// `[Phi; filtered phi]`, (2n - 1) x n, column-major.
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
    /// The matrices of checked settings.
    pub fn new(
        plant: &ContinuousPlant,
        scenario: &Scenario,
        options: &GpeboOptions,
        observers: &[ObserverSpec],
    ) -> Self {
        let n = plant.order();
        let signals = [scenario.u.clone(), scenario.delta.clone()];
        let lines = [3 * n - 1, 3 * n + 1];
        let oscillators = 3 * n + 3;
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
        fill_plant(&mut base, plant, options, &input, &disturbance);
        fill_signals(&mut base, lines, oscillators, &signals);
        let luenberger: Vec<Luenberger> = observers.iter().filter_map(luenberger).collect();
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
            regressor: regressor_matrix(plant, options),
        }
    }

    /// The propagators over h seconds.
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
            regressor: columns(&over(&self.regressor), 0),
        }
    }

    /// The states at t = 0; the signals' are set by [`Self::start_step`].
    pub fn initial(&self) -> LinearState {
        let (n, rows) = (self.n, 2 * self.n - 1);
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
            regressor,
        }
    }

    /// Sets the states of u and delta at t, as they are in the piece around `inside`.
    pub fn start_step(&self, state: &mut LinearState, t: f64, inside: f64) {
        for (signal, &first) in self.signals.iter().zip(&self.lines) {
            (state.base[first], state.base[first + 1]) = signal.line(t, inside);
        }
        let all = self.signals.iter().flat_map(sines);
        for (wave, pair) in all.zip(state.base[self.oscillators..].chunks_exact_mut(2)) {
            (pair[0], pair[1]) = wave.sine(t);
        }
    }

    /// Fills M (row-major n x n, rows phi and filtered phi) and `zbar = [z; filtered z]`, Eqs. (9),
    /// (10).
    pub fn observe(&self, state: &LinearState, m: &mut [f64], zbar: &mut [f64]) {
        let (n, rows) = (self.n, 2 * self.n - 1);
        let (x, rest) = state.base.split_at(n);
        let delta: f64 = self.disturbance.iter().map(|&k| state.base[k]).sum();
        let error = self
            .c
            .iter()
            .zip(x.iter().zip(rest))
            .map(|(c, (x, xi))| c * (x - xi));
        zbar[0] = error.sum::<f64>() + delta;
        zbar[1..].copy_from_slice(&state.base[2 * n..3 * n - 1]);
        for (j, column) in state.regressor.chunks_exact(rows).enumerate() {
            m[j] = self.c.iter().zip(column).map(|(c, phi)| c * phi).sum();
            for (i, filtered) in column[n..].iter().enumerate() {
                m[(i + 1) * n + j] = *filtered;
            }
        }
    }
}

impl LinearState {
    /// One propagation; allocates nothing.
    pub fn advance(&mut self, by: &Propagator, n: usize) {
        let rows = 2 * n - 1;
        // The observers need the base state at the start.
        for (p, xhat) in by.observers.iter().zip(self.observers.chunks_exact_mut(n)) {
            let (from_base, own) = p.split_at(self.base.len() * n);
            let next = &mut self.scratch[..n];
            next.fill(0.0);
            multiply_add(from_base, &self.base, next);
            multiply_add(own, xhat, next);
            xhat.copy_from_slice(next);
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

    /// x, of length n.
    pub fn x(&self, n: usize) -> &[f64] {
        &self.base[..n]
    }

    /// `xhat = xi + Phi theta_hat`, Eq. (8).
    pub fn reconstruct(&self, theta: &[f64], xhat: &mut [f64]) {
        let n = theta.len();
        xhat.copy_from_slice(&self.base[n..2 * n]);
        for (column, theta) in self.regressor.chunks_exact(2 * n - 1).zip(theta) {
            for (xhat, phi) in xhat.iter_mut().zip(column) {
                *xhat += phi * theta;
            }
        }
    }

    /// The estimate of the k-th full-order observer.
    pub fn luenberger(&self, k: usize, n: usize) -> &[f64] {
        &self.observers[k * n..(k + 1) * n]
    }
}

/// `out += P v`, P column-major.
#[inline]
fn multiply_add(p: &[f64], v: &[f64], out: &mut [f64]) {
    for (column, v) in p.chunks_exact(out.len()).zip(v) {
        for (out, p) in out.iter_mut().zip(column) {
            *out += p * v;
        }
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
