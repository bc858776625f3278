//! The joint extended Kalman filter of state and parameters.

use super::AdaptiveObserver;
use super::filters::finite;
use crate::estimator::recursive::Diverged;

/// The tuning of [`JointEkf`]: variances, and where it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct JointEkfSettings {
    /// xhat(0), n numbers.
    pub x0: Vec<f64>,
    /// a and b before the first sample, n numbers each.
    pub a0: Vec<f64>,
    /// See `a0`.
    pub b0: Vec<f64>,
    /// The variance of each error of x0.
    pub state_variance: f64,
    /// The variance of each error of a0 and b0.
    pub parameter_variance: f64,
    /// The variance of the measurement noise.
    pub noise: f64,
    /// The variance of the noise that drives each state.
    pub state_noise: f64,
    /// The variance of the steps of each parameter; 0 for a constant plant, whose gain then falls to 0.
    pub parameter_noise: f64,
}

/// The extended Kalman filter of `s = (x, a, b)`, `x(k+1) = A x(k) + b u(k) + w`, a and b a random walk, `y = x_1 + e`:
///
/// ```text
///     K = P h / (h' P h + r),  s = s + K (y - x_1),  P = P - K h' P,  then
///     s+ = (A x + b u, a, b),  P+ = J P J' + Q,  J the Jacobian of the step at s
/// ```
///
/// In the papers' coordinates only the last row of A is unknown, so J has a row with the states, and shifts. The gain
/// does not follow from how K depends on the parameters, so it may diverge or be biased where the noise variances are
/// wrong. A sample takes about 36 n^2 multiplications and additions.
///
/// Source: L. Ljung, Asymptotic behavior of the extended Kalman filter as a parameter estimator for linear systems,
/// IEEE Trans. Automatic Control 24, 1979, Eqs. (3) to (7), which also say why the steps of a constant plant should be
/// 0.
#[derive(Clone, Debug)]
pub struct JointEkf {
    settings: JointEkfSettings,
    n: usize,
    /// x, a, b.
    s: Vec<f64>,
    /// P, 3n x 3n.
    p: Vec<f64>,
    gain: Vec<f64>,
    /// Rows 0 ... n-1 of J P, each 3n numbers.
    product: Vec<f64>,
    samples: usize,
}

impl JointEkf {
    /// Makes the filter.
    ///
    /// # Panics
    /// If x0, a0, b0 are empty or of different lengths.
    pub fn new(settings: JointEkfSettings) -> Self {
        let n = settings.x0.len();
        assert!(n > 0 && settings.a0.len() == n && settings.b0.len() == n);
        let mut made = Self {
            s: vec![0.0; 3 * n],
            p: vec![0.0; 9 * n * n],
            n,
            gain: vec![0.0; 3 * n],
            product: vec![0.0; 3 * n * n],
            samples: 0,
            settings,
        };
        made.restart();
        made
    }

    fn correct(&mut self, y: f64) {
        let d = 3 * self.n;
        let variance = self.p[0] + self.settings.noise;
        // h'P is the first row, and P is symmetric.
        self.gain.copy_from_slice(&self.p[..d]);
        let error = (y - self.s[0]) / variance;
        for i in 0..d {
            self.s[i] += self.gain[i] * error;
            let share = self.gain[i] / variance;
            for j in 0..=i {
                self.p[i * d + j] -= share * self.gain[j];
                self.p[j * d + i] = self.p[i * d + j];
            }
        }
    }

    /// Adds `J_i v` for row i of J, whose entries beyond those of the parameters' identity are few; `v(m)` is entry m.
    fn row_of_step(&self, i: usize, u: f64, v: impl Fn(usize) -> f64) -> f64 {
        let n = self.n;
        let through_input = u * v(2 * n + i);
        if i + 1 < n {
            return v(i + 1) + through_input;
        }
        let (x, a) = (&self.s[..n], &self.s[n..2 * n]);
        let last = |m: usize| a[m] * v(m) + x[m] * v(n + m);
        (0..n).map(last).sum::<f64>() + through_input
    }

    fn predict(&mut self, u: f64) {
        let (n, d) = (self.n, 3 * self.n);
        for i in 0..n {
            for j in 0..d {
                self.product[i * d + j] = self.row_of_step(i, u, |m| self.p[m * d + j]);
            }
        }
        // J P J': the columns of the states, then the mirrored rows of the parameters.
        for i in 0..n {
            for j in 0..n {
                self.p[i * d + j] = self.row_of_step(j, u, |m| self.product[i * d + m]);
            }
            for j in n..d {
                self.p[i * d + j] = self.product[i * d + j];
                self.p[j * d + i] = self.product[i * d + j];
            }
        }
        for i in 0..d {
            self.p[i * d + i] += if i < n {
                self.settings.state_noise
            } else {
                self.settings.parameter_noise
            };
        }
        let last = (0..n).map(|m| self.s[n + m] * self.s[m]).sum();
        self.s[..n].rotate_left(1);
        self.s[n - 1] = last;
        for i in 0..n {
            self.s[i] += self.s[2 * n + i] * u;
        }
    }
}

impl AdaptiveObserver for JointEkf {
    fn restart(&mut self) {
        let (n, of) = (self.n, &self.settings);
        for (to, from) in self.s.chunks_exact_mut(n).zip([&of.x0, &of.a0, &of.b0]) {
            to.copy_from_slice(from);
        }
        self.p.fill(0.0);
        for i in 0..3 * n {
            self.p[i * 3 * n + i] = if i < n {
                of.state_variance
            } else {
                of.parameter_variance
            };
        }
        self.samples = 0;
    }

    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
        self.correct(y);
        self.predict(u);
        self.samples += 1;
        finite(&self.s, self.samples)
    }

    fn state(&self) -> &[f64] {
        &self.s[..self.n]
    }

    fn plant(&self) -> &[f64] {
        &self.s[self.n..]
    }
}
