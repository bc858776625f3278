//! The continuous equation.

use super::check::{check, check_column, check_covariance};
use super::equation::{Equation, RiccatiError, double, symmetric};
use crate::observer::lyapunov::sum_of_powers;
use crate::plant::eigenvalues;
use faer::linalg::solvers::Solve;
use faer::{Col, Mat, MatRef, Scale};

/// `A P + P A' + Q - P c r^-1 c'P = 0`.
pub(super) struct Continuous {
    a: Mat<f64>,
    c: Col<f64>,
    q: Mat<f64>,
    r: f64,
}

impl Continuous {
    /// Checks an equation; see [`super::care`] for shapes and errors.
    pub(super) fn new(a: MatRef<'_, f64>, c: &[f64], q: MatRef<'_, f64>, r: f64) -> Result<Self, RiccatiError> {
        let n = a.nrows();
        check("A", a, n, n)?;
        check_column("c", c, n)?;
        if !(r > 0.0 && r.is_finite()) {
            return Err(RiccatiError::Variance(r));
        }
        Ok(Self {
            a: a.to_owned(),
            c: Col::from_fn(n, |i| c[i]),
            q: check_covariance("Q", q, n)?,
            r,
        })
    }

    /// Returns `[[A', -c c' / r], [-Q, -A]]` with Q + eps I instead of Q.
    fn hamiltonian(&self, eps: f64) -> Mat<f64> {
        let n = self.a.nrows();
        Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => self.a[(j, i)],
            (true, false) => -self.c[i] * self.c[j - n] / self.r,
            (false, true) => -self.q[(i - n, j)] - if i - n == j { eps } else { 0.0 },
            (false, false) => -self.a[(i - n, j - n)],
        })
    }

    /// Returns the parameter of the Cayley transform `(z - gamma)^-1 (z + gamma)`: the geometric mean of the smallest
    /// and the largest modulus of the Hamiltonian's eigenvalues. It keeps the images of both far from the unit circle.
    /// It also lies to the right of A's spectrum, where the transform always exists.
    fn gamma(&self, hamiltonian: &Mat<f64>) -> Option<f64> {
        let (small, large) = moduli(hamiltonian)?;
        let right = eigenvalues(self.a.as_ref())?;
        let right = right.iter().map(|z| z.re).fold(0.0, f64::max);
        let gamma = (small.max(1e-6 * large) * large).sqrt().max(1.25 * right);
        Some(if gamma > 0.0 { gamma } else { 1.0 })
    }

    /// Returns `A - L c'`.
    fn closed_loop(&self, gain: &Col<f64>) -> Mat<f64> {
        &self.a - gain * self.c.transpose()
    }
}

/// Returns the smallest and the largest modulus of the eigenvalues. `None` if they cannot be computed.
fn moduli(m: &Mat<f64>) -> Option<(f64, f64)> {
    let eigenvalues = eigenvalues(m.as_ref())?;
    let moduli = eigenvalues.iter().map(|z| z.norm());
    Some(moduli.fold((f64::INFINITY, 0.0), |(s, l), z| (s.min(z), l.max(z))))
}

/// Returns `M + gamma I`.
fn shifted(m: &Mat<f64>, gamma: f64) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| {
        m[(i, j)] + if i == j { gamma } else { 0.0 }
    })
}

impl Equation for Continuous {
    /// Doubles the Cayley transform. With M the Hamiltonian, `M_1`, `M_2` the left and right block columns, and
    /// `N = [(M - gamma)_1, (M + gamma)_2]`, the start is `N^-1 (M + gamma)_1 = [A_0; -H_0]` and
    /// `N^-1 (M - gamma)_2 = [G_0; A_0']`.
    fn double(&self, eps: f64) -> Option<(Mat<f64>, usize)> {
        let n = self.a.nrows();
        let hamiltonian = self.hamiltonian(eps);
        let gamma = self.gamma(&hamiltonian)?;
        let (plus, minus) = (shifted(&hamiltonian, gamma), shifted(&hamiltonian, -gamma));
        let pick = |left: &Mat<f64>, right: &Mat<f64>| {
            Mat::from_fn(2 * n, 2 * n, |i, j| if j < n { left[(i, j)] } else { right[(i, j)] })
        };
        let start = pick(&minus, &plus).partial_piv_lu().solve(pick(&plus, &minus));
        let block = |i, j| start.submatrix(i, j, n, n).to_owned();
        let (g, h) = (symmetric(&block(0, n)), symmetric(&-block(n, 0)));
        double(block(0, 0), g, h)
    }

    fn gain(&self, p: &Mat<f64>) -> Col<f64> {
        let gain = p * &self.c;
        Col::from_fn(gain.nrows(), |i| gain[i] / self.r)
    }

    fn margin(&self, gain: &Col<f64>) -> f64 {
        let Some(poles) = eigenvalues(self.closed_loop(gain).as_ref()) else {
            return f64::NAN;
        };
        let right = poles.iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max);
        let large = poles.iter().map(|z| z.norm()).fold(0.0, f64::max);
        if large == 0.0 { 0.0 } else { -right / large }
    }

    fn defect(&self, p: &Mat<f64>) -> (Mat<f64>, f64) {
        let ap = &self.a * p;
        let gain = self.gain(p);
        let fed_back = Mat::from_fn(gain.nrows(), gain.nrows(), |i, j| gain[i] * self.r * gain[j]);
        let defect = &ap + ap.transpose() + &self.q - &fed_back;
        let size = ap.norm_l2().max(self.q.norm_l2()).max(fed_back.norm_l2());
        (symmetric(&defect), size)
    }

    /// Solves `S X + X S' + defect = 0` with `S = A - L c'`, by its Cayley transform.
    fn correction(&self, gain: &Col<f64>, defect: Mat<f64>) -> Option<Mat<f64>> {
        let closed = self.closed_loop(gain);
        let (small, large) = moduli(&closed)?;
        let gamma = (small * large).sqrt();
        let lu = shifted(&closed, -gamma).partial_piv_lu();
        let noise = lu.solve(lu.solve(Scale(2.0 * gamma) * defect).transpose());
        sum_of_powers(lu.solve(shifted(&closed, gamma)), symmetric(&noise))
    }

    fn scale(&self) -> f64 {
        let c = self.c.squared_norm_l2().max(f64::MIN_POSITIVE);
        self.q.norm_l2() + self.a.squared_norm_l2().max(1.0) * self.r / c
    }
}
