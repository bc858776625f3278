//! Poles of the canonical plant: eigenvalues of A, and their largest modulus.

use super::radius::{self, on_its_side};
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, evd_real, evd_scratch};
use faer::{Mat, Par, c64};

/// Finds poles of many systems. Systems of the same order share the buffers.
pub struct PoleFinder {
    companion: Mat<f64>,
    real: Diag<f64>,
    imaginary: Diag<f64>,
    memory: MemBuffer,
}

impl PoleFinder {
    /// Makes buffers for order n.
    pub fn new(n: usize) -> Self {
        let no = ComputeEigenvectors::No;
        let scratch = evd_scratch::<f64>(n, no, no, Par::Seq, Default::default());
        Self {
            companion: Mat::zeros(n, n),
            real: Diag::zeros(n),
            imaginary: Diag::zeros(n),
            memory: MemBuffer::new(scratch),
        }
    }

    /// Computes the eigenvalues; returns false if a coefficient is not finite or the iteration fails.
    fn find(&mut self, a: &[f64]) -> bool {
        let n = a.len();
        if n != self.companion.nrows() {
            *self = Self::new(n);
        }
        if !a.iter().all(|a| a.is_finite()) {
            return false;
        }
        self.companion.fill(0.0);
        for i in 0..n {
            if i + 1 < n {
                self.companion[(i, i + 1)] = 1.0;
            }
            self.companion[(n - 1, i)] = a[i];
        }
        evd_real(
            self.companion.as_ref(),
            self.real.as_mut(),
            self.imaginary.as_mut(),
            None,
            None,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        )
        .is_ok()
    }

    /// Returns the zeros of `z^n - a_n z^(n-1) - ... - a_1`, largest modulus first. Empty if `a` is not finite or the
    /// eigenvalue iteration does not converge.
    pub fn poles(&mut self, a: &[f64]) -> Vec<c64> {
        if !self.find(a) {
            return Vec::new();
        }
        let n = a.len();
        let mut poles: Vec<c64> = (0..n).map(|i| c64::new(self.real[i], self.imaginary[i])).collect();
        poles.sort_by(|p, q| {
            let modulus = q.norm().total_cmp(&p.norm());
            modulus.then(q.re.total_cmp(&p.re)).then(q.im.total_cmp(&p.im))
        });
        poles
    }

    /// Returns the largest modulus of the poles; NaN if a coefficient is not finite or the iteration does not converge.
    ///
    /// The result is 1 or more exactly if `a` is not `stable` by [`is_stable`](super::stability::is_stable). Up to
    /// order 24 it has the same bits as in the lanes; above, it comes from the eigenvalues.
    pub fn spectral_radius(&mut self, a: &[f64], stable: bool) -> f64 {
        if a.len() <= radius::LARGEST_ORDER {
            return run!(f64, || radius::spectral_radius::<f64, { radius::LARGEST_ORDER }>(
                a, stable
            ));
        }
        if !self.find(a) {
            return f64::NAN;
        }
        let moduli = (0..a.len()).map(|i| self.real[i].hypot(self.imaginary[i]));
        on_its_side(moduli.fold(0.0, f64::max), stable)
    }
}

/// Returns the coefficients `phi_1 ... phi_n` of `z^n + phi_1 z^(n-1) + ... = prod_i (z - p_i)`.
pub fn polynomial_from_poles(poles: &[c64]) -> Vec<c64> {
    let mut phi = vec![c64::new(1.0, 0.0)];
    for pole in poles {
        phi.push(c64::new(0.0, 0.0));
        for i in (1..phi.len()).rev() {
            let previous = phi[i - 1];
            phi[i] -= pole * previous;
        }
    }
    phi.remove(0);
    phi
}

/// Returns a complex number whose conjugate is not among the others, if there is one.
pub fn unmatched_pole(poles: &[c64]) -> Option<c64> {
    let mut left: Vec<c64> = poles.iter().copied().filter(|pole| pole.im != 0.0).collect();
    while let Some(pole) = left.pop() {
        let Some(conjugate) = left.iter().position(|other| *other == pole.conj()) else {
            return Some(pole);
        };
        left.swap_remove(conjugate);
    }
    None
}

/// Parses `0.3`, `-0.2`, `0.1+0.3i`, `0.1-0.3i` or `0.3i`.
pub fn parse_pole(text: &str) -> Option<c64> {
    let number = |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite());
    let Some(complex) = text.strip_suffix(['i', 'j']) else {
        return number(text).map(|re| c64::new(re, 0.0));
    };
    // The sign between the parts: the last sign that begins neither the text nor an exponent.
    let split = complex
        .char_indices()
        .rev()
        .find(|&(i, c)| (c == '+' || c == '-') && i > 0 && !complex[..i].ends_with(['e', 'E']));
    let (re, im) = match split {
        Some((i, _)) => (number(&complex[..i])?, &complex[i..]),
        None => (0.0, complex),
    };
    let im = match im {
        "+" | "" => 1.0,
        "-" => -1.0,
        _ => number(im)?,
    };
    Some(c64::new(re, im))
}
