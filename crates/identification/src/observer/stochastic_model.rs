//! The plant with its noises, as the Kalman filter sees it.

use super::lyapunov::lyapunov;
use super::riccati::{Riccati, RiccatiError, check_column, check_covariance, dare};
use faer::{Mat, MatRef};

/// The model `x(k+1) = F x(k) + g u(k) + w(k)`, `y(k) = h'x(k) + v(k)` with white w and v of zero mean, `E[w w'] = Q`,
/// `E[w v] = s`, `E[v v] = r`. The first `states` of the m components of x are those of the plant, the others those of
/// the measurement noise.
#[derive(Clone, Debug)]
pub struct StochasticModel {
    /// F, m x m.
    pub f: Mat<f64>,
    /// g, m numbers.
    pub g: Vec<f64>,
    /// h, m numbers.
    pub h: Vec<f64>,
    /// Q, m x m.
    pub q: Mat<f64>,
    /// s, m numbers.
    pub s: Vec<f64>,
    /// r > 0.
    pub r: f64,
    /// The number of leading components of x that belong to the plant.
    pub states: usize,
}

/// Measurement noise `f(k) = C(q) / D(q) w(k)` with white w of the given standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasurementNoise<'a> {
    /// c_0 ... c_q, c_0 not zero. Zeros of C may lie outside the unit circle but not on it, because the filter would
    /// then have a pole on the circle.
    pub numerator: &'a [f64],
    /// 1, d_1 ... d_p.
    pub denominator: &'a [f64],
    /// The standard deviation of w, in units of y.
    pub deviation: f64,
}

impl MeasurementNoise<'_> {
    /// Makes white noise.
    pub fn white(deviation: f64) -> Self {
        Self {
            numerator: &[1.0],
            denominator: &[1.0],
            deviation,
        }
    }

    /// Returns how many states f(k) needs: the larger of the degrees of C and D.
    fn states(&self) -> usize {
        let degree = |p: &[f64]| p.iter().rposition(|c| *c != 0.0).unwrap_or(0);
        degree(self.numerator).max(degree(self.denominator))
    }

    fn check(&self) -> Result<(), RiccatiError> {
        check_column("C", self.numerator, self.numerator.len().max(1))?;
        check_column("D", self.denominator, self.denominator.len().max(1))?;
        let c0 = self.numerator[0];
        let r = c0 * c0 * self.deviation * self.deviation;
        if self.denominator[0] != 1.0 {
            return Err(RiccatiError::NotMonic(self.denominator[0]));
        }
        if r > 0.0 && r.is_finite() {
            Ok(())
        } else {
            Err(RiccatiError::Variance(r))
        }
    }
}

impl StochasticModel {
    /// Returns the canonical plant `x(k+1) = A x(k) + b u(k) + w(k)`, `y(k) = x_1(k) + f(k)`, `A = [0 | I; a']`, with
    /// process noise of covariance `process` (n x n) and coloured measurement noise.
    ///
    /// The measurement noise is added in innovations form, with as many states as the larger of the degrees of C and D:
    /// `eta_i(k+1) = -d_i eta_1(k) + eta_(i+1)(k) + (c_i - c_0 d_i) w(k)`, `f(k) = eta_1(k) + c_0 w(k)`. Hence
    /// `r = c_0^2 sigma^2`, `s = [0; B_f c_0 sigma^2]` and `Q = blkdiag(process, B_f B_f' sigma^2)` with
    /// `(B_f)_i = c_i - c_0 d_i`.
    ///
    /// # Errors
    /// [`RiccatiError::Shape`], [`RiccatiError::NotFinite`]; [`RiccatiError::NotMonic`] for D;
    /// [`RiccatiError::Variance`] if `c_0 sigma` is zero; [`RiccatiError::NotSymmetric`] or
    /// [`RiccatiError::Indefinite`] for the process noise.
    pub fn new(
        a: &[f64],
        b: &[f64],
        process: MatRef<'_, f64>,
        noise: MeasurementNoise<'_>,
    ) -> Result<Self, RiccatiError> {
        let n = a.len();
        check_column("a", a, n.max(1))?;
        check_column("b", b, n)?;
        noise.check()?;
        let process = check_covariance("the process noise", process, n)?;
        let m = n + noise.states();
        let coefficient = |p: &[f64], i: usize| p.get(i).copied().unwrap_or(0.0);
        let c0 = noise.numerator[0];
        let variance = noise.deviation * noise.deviation;
        let d = |i: usize| coefficient(noise.denominator, i - n + 1);
        let b_f = |i: usize| coefficient(noise.numerator, i - n + 1) - c0 * d(i);
        Ok(Self {
            f: Mat::from_fn(m, m, |i, j| match (i < n, j < n) {
                (true, true) if i + 1 == n => a[j],
                (false, false) if j == n => -d(i) + f64::from(i + 1 == j),
                (true, true) | (false, false) => f64::from(i + 1 == j),
                _ => 0.0,
            }),
            g: (0..m).map(|i| if i < n { b[i] } else { 0.0 }).collect(),
            h: (0..m).map(|i| f64::from(i == 0 || i == n)).collect(),
            q: Mat::from_fn(m, m, |i, j| match (i < n, j < n) {
                (true, true) => process[(i, j)],
                (false, false) => b_f(i) * b_f(j) * variance,
                _ => 0.0,
            }),
            s: (0..m)
                .map(|i| if i < n { 0.0 } else { b_f(i) * c0 * variance })
                .collect(),
            r: c0 * c0 * variance,
            states: n,
        })
    }

    /// Returns m, the number of states of the plant and of the noise.
    pub fn order(&self) -> usize {
        self.f.nrows()
    }

    /// Solves [`dare`] of the model: the steady state of the filter.
    ///
    /// # Errors
    /// As for [`dare`].
    pub fn riccati(&self) -> Result<Riccati, RiccatiError> {
        dare(self.f.as_ref(), &self.h, self.q.as_ref(), &self.s, self.r)
    }

    /// Returns the covariance (m x m) of x(0) about its estimate, `blkdiag(plant, P_f)`. The plant's part of x(0) is
    /// known up to the covariance `plant` (n x n). The noise is stationary from its first sample:
    /// `P_f = A_f P_f A_f' + B_f B_f' sigma^2`.
    ///
    /// # Errors
    /// As for [`lyapunov`] of the noise part; [`RiccatiError::Shape`], [`RiccatiError::NotSymmetric`] or
    /// [`RiccatiError::Indefinite`] for `plant`.
    pub fn initial_covariance(&self, plant: MatRef<'_, f64>) -> Result<Mat<f64>, RiccatiError> {
        let n = self.states;
        let m = self.order();
        let plant = check_covariance("the initial state's covariance", plant, n)?;
        let noise = lyapunov(
            self.f.submatrix(n, n, m - n, m - n),
            self.q.submatrix(n, n, m - n, m - n),
        )?;
        Ok(Mat::from_fn(m, m, |i, j| match (i < n, j < n) {
            (true, true) => plant[(i, j)],
            (false, false) => noise[(i - n, j - n)],
            _ => 0.0,
        }))
    }
}
