//! The discrete equation with its cross covariance removed.

use super::check::{check, check_column, check_covariance, check_definite};
use super::equation::{Equation, RiccatiError, double, symmetric};
use crate::observer::lyapunov::{spectral_radius, sum_of_powers};
use faer::{Col, ColRef, Mat, MatRef};

/// `P = F~ P F~' + Q~ - F~ P h (h'P h + r)^-1 h'P F~'`, `F~ = F - s h' / r`, `Q~ = Q - s s' / r`.
/// Its gains are `K~ = K - s / r`, and `F~ - K~ h' = F - K h'`.
pub(in crate::observer) struct Discrete {
    f: Mat<f64>,
    h: Col<f64>,
    q: Mat<f64>,
    /// s / r.
    shift: Col<f64>,
    r: f64,
    /// |Q||_F of the given Q.
    size: f64,
    /// With an innovation variance up to this, the gain is 0.
    smallest: f64,
}

impl Discrete {
    /// Checks and reduces an equation; see [`super::dare`] for shapes and errors.
    pub(in crate::observer) fn new(
        f: MatRef<'_, f64>,
        h: &[f64],
        q: MatRef<'_, f64>,
        s: &[f64],
        r: f64,
    ) -> Result<Self, RiccatiError> {
        let n = f.nrows();
        check("F", f, n, n)?;
        check_column("h", h, n)?;
        check_column("s", s, n)?;
        if !(r > 0.0 && r.is_finite()) {
            return Err(RiccatiError::Variance(r));
        }
        let q = check_covariance("Q", q, n)?;
        let size = q.norm_l2();
        let (h, s) = (ColRef::from_slice(h), ColRef::from_slice(s));
        let shift = Col::from_fn(n, |i| s[i] / r);
        let q = Mat::from_fn(n, n, |i, j| q[(i, j)] - s[i] * s[j] / r);
        check_definite("Q - s s' / r", &q, 1e-12 * size)?;
        Ok(Self {
            f: f - &shift * h.transpose(),
            h: h.to_owned(),
            q,
            shift,
            r,
            size,
            smallest: 0.0,
        })
    }

    /// Returns the equation with r = 0 and s = 0 and a checked Q.
    pub(in crate::observer) fn of_exact_output(f: MatRef<'_, f64>, h: &[f64], q: Mat<f64>, smallest: f64) -> Self {
        Self {
            f: f.to_owned(),
            h: ColRef::from_slice(h).to_owned(),
            shift: Col::zeros(h.len()),
            r: 0.0,
            size: q.norm_l2(),
            q,
            smallest,
        }
    }

    /// Returns `h'P h + r`.
    pub(in crate::observer) fn innovation(&self, p: &Mat<f64>) -> f64 {
        self.h.transpose() * (p * &self.h) + self.r
    }

    /// Returns K, given K~.
    pub(in crate::observer) fn predictor_gain(&self, gain: &Col<f64>) -> Vec<f64> {
        (gain + &self.shift).iter().copied().collect()
    }

    /// Returns `F - K h'`.
    fn closed_loop(&self, gain: &Col<f64>) -> Mat<f64> {
        &self.f - gain * self.h.transpose()
    }

    /// Advances the covariance by one step with any gain, in Joseph's form
    /// `P+ = (F - K h') P (F - K h')' + Q - K s' - s K' + K r K'`. The result is symmetric, and >= 0 if P is. It is
    /// computed as `(F~ - K~ h') P (F~ - K~ h')' + Q~ + K~ r K~'`, which is the same.
    pub(in crate::observer) fn step(&self, p: &Mat<f64>, gain: &Col<f64>) -> Mat<f64> {
        let closed = self.closed_loop(gain);
        let predicted = &closed * p * closed.transpose();
        let next = Mat::from_fn(gain.nrows(), gain.nrows(), |i, j| {
            predicted[(i, j)] + self.q[(i, j)] + gain[i] * self.r * gain[j]
        });
        symmetric(&next)
    }
}

impl Equation for Discrete {
    fn double(&self, eps: f64) -> Option<(Mat<f64>, usize)> {
        let n = self.f.nrows();
        let g = Mat::from_fn(n, n, |i, j| self.h[i] * self.h[j] / self.r);
        let q = Mat::from_fn(n, n, |i, j| self.q[(i, j)] + if i == j { eps } else { 0.0 });
        double(self.f.transpose().to_owned(), g, q)
    }

    fn gain(&self, p: &Mat<f64>) -> Col<f64> {
        let innovation = self.innovation(p);
        if innovation <= self.smallest {
            return Col::zeros(p.nrows());
        }
        let gain = &self.f * (p * &self.h);
        Col::from_fn(gain.nrows(), |i| gain[i] / innovation)
    }

    fn margin(&self, gain: &Col<f64>) -> f64 {
        1.0 - spectral_radius(self.closed_loop(gain).as_ref())
    }

    /// Computes `F~ P F~' - K~ (h'P h + r) K~' + Q~ - P`. Unlike in Joseph's form, no term is larger than F P F',
    /// however large the gain.
    fn defect(&self, p: &Mat<f64>) -> (Mat<f64>, f64) {
        let (gain, innovation) = (self.gain(p), self.innovation(p));
        let predicted = &self.f * p * self.f.transpose();
        let defect = Mat::from_fn(gain.nrows(), gain.nrows(), |i, j| {
            predicted[(i, j)] - gain[i] * innovation * gain[j] + self.q[(i, j)] - p[(i, j)]
        });
        (symmetric(&defect), self.size.max(p.norm_l2()))
    }

    fn correction(&self, gain: &Col<f64>, defect: Mat<f64>) -> Option<Mat<f64>> {
        sum_of_powers(self.closed_loop(gain), defect)
    }

    fn scale(&self) -> f64 {
        self.size + self.r / self.h.squared_norm_l2().max(f64::MIN_POSITIVE)
    }
}
