//! Zhang's adaptive observer, with exponential forgetting.

use super::AdaptiveObserver;
use super::filters::StateFilters;
use crate::estimator::recursive::{Diverged, SquareRoot};

/// The tuning of [`Zhang`].
#[derive(Clone, Debug, PartialEq)]
pub struct ZhangSettings {
    /// The gain K, n numbers: A0 - K c' has the characteristic polynomial `z^n + K_1 z^(n-1) + ... + K_n`.
    pub gain: Vec<f64>,
    /// The forgetting factor lambda, above 0 and at most 1.
    pub forgetting: f64,
    /// P(0) is p0 times the identity.
    pub p0: f64,
}

/// With `theta = (alpha, h)`, `Psi(k) = (-I y(k), I u(k))`:
///
/// ```text
///     e = y - c' xhat_o,  w = Upsilon' c,  theta+ = theta + P w e / (lambda + w' P w),  P+ as recursive least squares
///     Upsilon+ = (A0 - K c') Upsilon + Psi
///     xhat_o+ = A0 xhat_o + Psi theta + K e + Upsilon+ (theta+ - theta)
/// ```
///
/// The last term makes the error `xhat_o - x_o - Upsilon (theta - true theta)` obey `A0 - K c'` alone, whatever theta
/// does. P is kept as a [`SquareRoot`]. A sample takes about 28 n^2 multiplications and additions.
///
/// Source: Q. Zhang, Adaptive observer for multiple-input-multiple-output linear time-varying systems, IEEE Trans.
/// Automatic Control 47, 2002; A. Guyader and Q. Zhang, Adaptive observer for discrete time linear time varying
/// systems, IFAC SYSID 2003; A. Ticlea and G. Besancon, Exponential forgetting factor observer in discrete time,
/// Systems and Control Letters 61, 2012.
#[derive(Clone, Debug)]
pub struct Zhang {
    settings: ZhangSettings,
    /// Upsilon is (-M_y, M_u).
    filters: StateFilters,
    root: SquareRoot,
    theta: Vec<f64>,
    /// w, then P w, then theta's step with the signs of M.
    step: Vec<f64>,
    /// xhat_o.
    observed: Vec<f64>,
}

impl Zhang {
    /// Makes the observer of a plant of the gain's order, from theta = 0 and xhat_o = 0.
    ///
    /// # Panics
    /// If the gain has no numbers.
    pub fn new(settings: ZhangSettings) -> Self {
        let n = settings.gain.len();
        let (theta, mut root) = (vec![0.0; 2 * n], SquareRoot::new(2 * n));
        root.restart(Some(settings.p0), &theta);
        Self {
            filters: StateFilters::new(&settings.gain),
            root,
            step: theta.clone(),
            theta,
            observed: vec![0.0; n],
            settings,
        }
    }

    /// Returns theta = (alpha, h).
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }
}

impl AdaptiveObserver for Zhang {
    fn restart(&mut self) {
        self.filters.restart();
        self.theta.fill(0.0);
        self.observed.fill(0.0);
        self.root.restart(Some(self.settings.p0), &self.theta);
    }

    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
        let n = self.observed.len();
        let error = y - self.observed[0];
        self.filters.regressors(&mut self.step);
        self.step[..n].iter_mut().for_each(|w| *w = -*w);
        self.root.update(&self.step, 0.0, self.settings.forgetting);
        self.root.gain(&mut self.step);
        let (alpha, h) = self.theta.split_at(n);
        // A0 xhat_o + Psi theta + K e.
        self.observed.rotate_left(1);
        self.observed[n - 1] = 0.0;
        for i in 0..n {
            self.observed[i] += h[i] * u - alpha[i] * y + self.settings.gain[i] * error;
        }
        for (i, (theta, step)) in self.theta.iter_mut().zip(&mut self.step).enumerate() {
            *step *= error;
            *theta += *step;
            if i < n {
                *step = -*step;
            }
        }
        self.filters.update(u, y);
        self.filters.add_product(&self.step, &mut self.observed);
        let (alpha, h) = self.theta.split_at(n);
        self.filters.set(alpha, h, &self.observed)
    }

    fn state(&self) -> &[f64] {
        self.filters.state()
    }

    fn plant(&self) -> &[f64] {
        self.filters.plant()
    }
}
