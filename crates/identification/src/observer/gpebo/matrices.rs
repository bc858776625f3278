//! The matrices of the linear systems.

use faer::Mat;

use crate::plant::ContinuousPlant;
use crate::real::Real;
use crate::signal::{Signal, Wave};

/// Fills the rows of x, xi and z through the lags: `zf_i' = a_i (C'x - C'xi + delta - zf_i)`.
pub(super) fn fill_plant(
    base: &mut Mat<f64>,
    plant: &ContinuousPlant,
    lags: &[f64],
    input: &[usize],
    disturbance: &[usize],
) {
    let n = plant.order();
    for i in 0..n {
        for j in 0..n {
            base[(i, j)] = plant.a()[(i, j)];
            base[(n + i, n + j)] = plant.a()[(i, j)];
        }
        for &k in input {
            base[(i, k)] = plant.b()[i];
            base[(n + i, k)] = plant.b()[i];
        }
    }
    for (row, &pole) in lags.iter().enumerate() {
        let row = 2 * n + row;
        for j in 0..n {
            base[(row, j)] = pole * plant.c()[j];
            base[(row, n + j)] = -pole * plant.c()[j];
        }
        for &k in disturbance {
            base[(row, k)] = pole;
        }
        base[(row, row)] = -pole;
    }
}

/// Fills the rows of the lines and of the oscillators.
pub(super) fn fill_signals(base: &mut Mat<f64>, lines: [usize; 2], first: usize, signals: &[Signal; 2]) {
    for line in lines {
        base[(line, line + 1)] = 1.0;
    }
    let frequencies = signals
        .iter()
        .flat_map(|signal| &signal.waves)
        .filter_map(|wave| match wave {
            Wave::Sine { frequency, .. } => Some(*frequency),
            _ => None,
        });
    for (k, frequency) in frequencies.enumerate() {
        let row = first + 2 * k;
        base[(row, row + 1)] = frequency;
        base[(row + 1, row)] = -frequency;
    }
}

/// Returns the matrix of `Phi' = A Phi`, `phi_i' = a_i (C'Phi - phi_i)`.
pub(super) fn regressor_matrix(plant: &ContinuousPlant, lags: &[f64]) -> Mat<f64> {
    let n = plant.order();
    let rows = n + lags.len();
    let mut m = Mat::zeros(rows, rows);
    m.submatrix_mut(0, 0, n, n).copy_from(plant.a());
    for (row, &pole) in lags.iter().enumerate() {
        for j in 0..n {
            m[(n + row, j)] = pole * plant.c()[j];
        }
        m[(n + row, n + row)] = -pole;
    }
    m
}

/// Writes P v to `out`, P row by row, each row's terms added to zero in order.
#[inline(always)]
pub(super) fn multiply<R: Real>(p: &[R], v: &[R], out: &mut [R]) {
    for i in 0..out.len() {
        let row = &p[i * v.len()..][..v.len()];
        out[i] = add_product(R::zero(), row, v);
    }
}

/// Returns the sum and the products of a row, added in order.
#[inline(always)]
pub(super) fn add_product<R: Real>(mut sum: R, row: &[R], v: &[R]) -> R {
    for j in 0..v.len().min(row.len()) {
        sum = sum + row[j] * v[j];
    }
    sum
}
