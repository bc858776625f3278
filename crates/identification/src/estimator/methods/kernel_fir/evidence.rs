//! The marginal likelihood of a record given a prior of its impulse response, and its greatest value.
//!
//! `Y = Phi g + e`, `g ~ N(0, c L L')`, `e ~ N(0, s^2 I)`. With `[Phi Y] = Q [R z; 0 r]`, `M = R L` and `mu = s^2 / c`,
//!
//! `-2 ln p = N ln s^2 + ln det(M M' + mu I) - n ln mu + J(mu) / s^2`,
//! `J(mu) = min_w |z - M w|^2 + mu |w|^2 + r^2`, up to `N ln 2 pi`.
//!
//! Source: T. Chen, L. Ljung, "Implementation of algorithms for tuning parameters in regularized least squares problems
//! in system identification", Automatica 49 (2013), 2213-2220. M is reduced to bidiagonal form once for all mu (L.
//! Elden, "Algorithms for the regularization of ill-conditioned least squares problems", BIT 17 (1977), 134-145).

use crate::estimator::lag_sums::dot;
use crate::estimator::least_value::least;
use crate::estimator::solver::rank::inverse_power_of_two;

/// `M = U B V'` with `U'z`, B being upper bidiagonal.
#[derive(Default)]
pub(super) struct Bidiagonal {
    diagonal: Vec<f64>,
    above: Vec<f64>,
    z: Vec<f64>,
    /// M by columns, and room for a row.
    m: Vec<f64>,
    row: Vec<f64>,
    sum: Vec<f64>,
    /// `|M|^2`, the sum of squares.
    square: f64,
}

/// The value of s^2, if it is known.
#[derive(Clone, Copy)]
pub(super) enum Variance {
    Known(f64),
    /// It is chosen with the other hyperparameters: `J / N`.
    Free,
}

/// The marginal likelihood for one mu.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// `-2 ln p` up to a constant of the record, which makes it independent of y's unit to the last bit.
    pub(super) value: f64,
    pub(super) mu: f64,
    /// s^2.
    pub(super) variance: f64,
}

/// The decades of `mu / |M|^2` that are searched, and the points in each.
const DECADES: std::ops::RangeInclusive<i32> = -24..=8;
const POINTS: i32 = 2;

impl Bidiagonal {
    /// Reduces M, by columns, with n rows and columns.
    pub(super) fn reduce(&mut self, m: &[f64], z: &[f64]) {
        let n = z.len();
        self.m.clear();
        self.m.extend_from_slice(m);
        self.z.clear();
        self.z.extend_from_slice(z);
        self.square = dot(m, m);
        self.diagonal.clear();
        self.above.clear();
        for j in 0..n {
            self.eliminate_column(j, n);
            self.eliminate_row(j, n);
        }
    }

    /// Reflects rows j to n such that column j ends at its diagonal.
    fn eliminate_column(&mut self, j: usize, n: usize) {
        let (done, rest) = self.m.split_at_mut((j + 1) * n);
        let v = &mut done[j * n + j..];
        let (diagonal, scale) = reflector(v);
        self.diagonal.push(diagonal);
        if scale == 0.0 {
            return;
        }
        for column in rest.chunks_exact_mut(n).map(|column| &mut column[j..]) {
            add(-scale * dot(v, column), v, column);
        }
        let z = &mut self.z[j..];
        add(-scale * dot(v, z), v, z);
    }

    /// Reflects the columns after j such that row j ends right of its diagonal.
    fn eliminate_row(&mut self, j: usize, n: usize) {
        let first = j + 1;
        self.row.clear();
        self.row.extend((first..n).map(|l| self.m[l * n + j]));
        if self.row.is_empty() {
            return;
        }
        let (above, scale) = reflector(&mut self.row);
        self.above.push(above);
        if scale == 0.0 {
            return;
        }
        self.sum.clear();
        self.sum.resize(n - first, 0.0);
        let columns = || self.row.iter().enumerate();
        for (l, v) in columns() {
            add(*v, &self.m[(first + l) * n + first..][..n - first], &mut self.sum);
        }
        for (l, v) in columns() {
            let column = &mut self.m[(first + l) * n + first..][..n - first];
            add(-scale * v, &self.sum, column);
        }
    }

    /// Returns the marginal likelihood for mu; `samples` is N, and `rest` is r^2.
    fn at(&self, mu: f64, rest: f64, samples: f64, variance: Variance) -> Evidence {
        let root = mu.sqrt();
        // The row below that is being eliminated: its entry, and its right-hand side.
        let (mut below, mut right) = (root, 0.0);
        // The determinant, at most 10^224 of it not yet in its logarithm: no factor is below 1, and none above 10^24,
        // by `DECADES`.
        let (mut logarithm, mut product) = (0.0, 1.0);
        let mut cost = rest;
        with_fma!(|| {
            for (k, (d, z)) in self.diagonal.iter().zip(&self.z).enumerate() {
                let square = d.mul_add(*d, below * below);
                let size = square.sqrt();
                let (cosine, sine) = (d / size, below / size);
                product *= square / mu;
                if product > 1e200 {
                    logarithm += product.ln();
                    product = 1.0;
                }
                right = cosine * right - sine * z;
                let fill = -sine * self.above.get(k).copied().unwrap_or(0.0);
                below = fill.mul_add(fill, mu).sqrt();
                let left = root / below * right;
                cost += left * left;
                right *= fill / below;
            }
        });
        logarithm += product.ln();
        // Nothing is known better than to rounding.
        let square = (rest + dot(&self.z, &self.z)) / samples;
        let least = f64::EPSILON.powi(2) * square;
        let variance = match variance {
            Variance::Known(variance) => variance,
            Variance::Free => cost / samples,
        };
        let variance = variance.max(least);
        Evidence {
            value: samples * (variance * inverse_power_of_two(square)).ln() + logarithm + cost / variance,
            mu,
            variance,
        }
    }

    /// Returns the greatest marginal likelihood over mu.
    pub(super) fn best(&self, rest: f64, samples: f64, variance: Variance) -> Evidence {
        let of = |x: f64| self.at(self.square * x.exp(), rest, samples, variance);
        let step = std::f64::consts::LN_10 / f64::from(POINTS);
        let ends = [DECADES.start() * POINTS, DECADES.end() * POINTS];
        let grid = (ends[0]..=ends[1]).map(|i| f64::from(i) * step);
        let (x, _) = least(grid, |x| of(x).value);
        of(x)
    }
}

/// Replaces x by v of the reflection `I - scale v v'` that leaves its first entry only; returns that entry and scale.
fn reflector(x: &mut [f64]) -> (f64, f64) {
    let (square, first) = (dot(x, x), x[0]);
    if square < f64::MIN_POSITIVE || x.len() == 1 {
        return (first, 0.0);
    }
    let norm = square.sqrt();
    let entry = if first > 0.0 { -norm } else { norm };
    x[0] = first - entry;
    let scale = 2.0 / dot(x, x);
    (entry, scale)
}

/// Computes `to += factor x`.
fn add(factor: f64, x: &[f64], to: &mut [f64]) {
    with_fma!(|| {
        for (to, x) in to.iter_mut().zip(x) {
            *to = factor.mul_add(*x, *to);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand for n = 1: M = 2, z = 3, r^2 = 5, N = 4, s^2 = 2, mu = 4: `J = 9 - 36/8 + 5`, det = 8.
    #[test]
    fn one_tap_by_hand() {
        let mut reduced = Bidiagonal::default();
        reduced.reduce(&[2.0], &[3.0]);
        let found = reduced.at(4.0, 5.0, 4.0, Variance::Known(2.0));
        // In the unit of s^2 = 2.
        let expected = 8.0_f64.ln() - 4.0_f64.ln() + 9.5 / 2.0;
        assert!((found.value - expected).abs() < 1e-14, "{found:?}");
        let free = reduced.at(4.0, 5.0, 4.0, Variance::Free);
        assert!((free.variance - 9.5 / 4.0).abs() < 1e-15);
    }
}
