//! Units in which the numbers of a Riccati equation are of like sizes.

use crate::plant::{balance, in_units, power_of_two};
use faer::{Mat, MatRef};

/// Units, powers of two: `x = D z`, `y = output eta`, `t = tau / rate`, and of variances. Solutions then do not depend
/// on what states, y and time are measured in, up to rounding.
pub(super) struct Scaling {
    states: Vec<f64>,
    output: f64,
    rate: f64,
    variance: f64,
}

impl Scaling {
    /// Finds the units of `x' = A x + w`, `y = c'x + v` with the intensities Q of w and r > 0 of v, for a rate: those
    /// in which `[A, g; c' 0]` is balanced, `g_i^2 = Q_ii / r`, and v has an intensity of 1 to 2. In discrete time the
    /// rate is 1 and intensities are covariances.
    pub(super) fn new(a: MatRef<'_, f64>, c: &[f64], q: MatRef<'_, f64>, r: f64, rate: f64) -> Self {
        let n = a.nrows();
        let all = Mat::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
            (true, true) => a[(i, j)] / rate,
            (true, false) => q[(i, i)].max(0.0).sqrt() / r.sqrt() / rate,
            (false, true) => c[j],
            (false, false) => 0.0,
        });
        let mut states = balance(all.as_ref());
        let output = states.pop().unwrap_or(1.0);
        Self {
            states,
            output,
            rate,
            variance: power_of_two(r * rate / output / output),
        }
    }

    /// Returns A in these units.
    pub(super) fn a(&self, a: MatRef<'_, f64>) -> Mat<f64> {
        faer::Scale(self.rate.recip()) * in_units(a, &self.states)
    }

    /// Returns c in these units.
    pub(super) fn c(&self, c: &[f64]) -> Vec<f64> {
        let pairs = c.iter().zip(&self.states);
        pairs.map(|(c, unit)| c * (unit / self.output)).collect()
    }

    /// Returns Q in these units.
    pub(super) fn q(&self, q: MatRef<'_, f64>) -> Mat<f64> {
        let (units, by) = (&self.states, self.rate * self.variance);
        Mat::from_fn(q.nrows(), q.ncols(), |i, j| q[(i, j)] / units[i] / units[j] / by)
    }

    /// Returns the covariance s of w and v, in discrete time, in these units.
    pub(super) fn s(&self, s: &[f64]) -> Vec<f64> {
        let pairs = s.iter().zip(&self.states);
        pairs.map(|(s, unit)| s / unit / self.output / self.variance).collect()
    }

    /// Returns r in these units.
    pub(super) fn r(&self, r: f64) -> f64 {
        r * self.rate / self.output / self.output / self.variance
    }

    /// Returns P, of which this is the one in these units.
    pub(super) fn covariance(&self, p: &Mat<f64>) -> Mat<f64> {
        let (units, by) = (&self.states, self.variance);
        Mat::from_fn(p.nrows(), p.ncols(), |i, j| p[(i, j)] * by * units[i] * units[j])
    }

    /// Returns the gain of which this is the one in these units.
    pub(super) fn gain(&self, gain: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let by = self.rate / self.output;
        let pairs = gain.into_iter().zip(&self.states);
        pairs.map(|(gain, unit)| gain * unit * by).collect()
    }

    /// Returns the variance of y, in discrete time, of which this is the one in these units.
    pub(super) fn of_output(&self, variance: f64) -> f64 {
        variance * self.variance * self.output * self.output
    }
}
