//! The first equations, which least squares solves before instruments, filters and residuals are used.

use super::{RecursiveSettings, SquareRoot, dot};

/// Least squares of `A y = B u + e`, or of `F y = B u + e`, until there were enough equations.
#[derive(Clone, Debug)]
pub(super) struct Start {
    root: SquareRoot,
    /// Where its parameters are among all, in ascending order.
    places: Vec<usize>,
    phi: Vec<f64>,
    theta: Vec<f64>,
    /// The sum of y^2.
    power: f64,
}

impl Start {
    pub(super) fn new(places: Vec<usize>) -> Self {
        let d = places.len();
        Self {
            root: SquareRoot::new(d),
            places,
            phi: vec![0.0; d],
            theta: vec![0.0; d],
            power: 0.0,
        }
    }

    pub(super) fn restart(&mut self, settings: &RecursiveSettings) {
        for (theta, place) in self.theta.iter_mut().zip(&self.places) {
            *theta = settings.theta0[*place];
        }
        self.root.restart(settings.p0, &self.theta);
        self.power = 0.0;
    }

    /// Whether there were as many equations as wanted, and enough.
    pub(super) fn is_over(&self, settings: &RecursiveSettings) -> bool {
        self.root.rows() >= settings.start && self.root.is_determined()
    }

    /// Whether the equations determine their parameters.
    pub(super) fn is_determined(&self) -> bool {
        self.root.is_determined()
    }

    /// Returns a number that is not finite once its information was not.
    pub(super) fn size(&self) -> f64 {
        self.root.size()
    }

    /// Returns the information about its parameters.
    pub(super) fn root(&self) -> &SquareRoot {
        &self.root
    }

    /// Takes an equation whose regressors are at `places` of `phi`, and writes the solution to these places of theta.
    /// Returns the residual.
    pub(super) fn update(&mut self, phi: &[f64], y: f64, lambda: f64, theta: &mut [f64]) -> f64 {
        for (own, place) in self.phi.iter_mut().zip(&self.places) {
            *own = phi[*place];
        }
        self.root.update(&self.phi, y, lambda);
        self.power = lambda * self.power + y * y;
        if !self.root.is_determined() {
            return 0.0;
        }
        self.root.solve(&mut self.theta);
        for (own, place) in self.theta.iter().zip(&self.places) {
            theta[*place] = *own;
        }
        y - dot(&self.phi, &self.theta)
    }

    /// Hands the information to the recursion that goes on. A parameter that was not estimated gets `P = p0`, or
    /// without p0 the one that makes its standard deviation 1.
    pub(super) fn hand_over(&self, settings: &RecursiveSettings, theta: &[f64], to: &mut SquareRoot) {
        let weight = match settings.p0 {
            Some(p0) => 1.0 / p0.sqrt(),
            None => self.deviation(),
        };
        to.embed(&self.root, &self.places, weight, theta);
    }

    /// The standard deviation of the residuals, not below sqrt(eps) times the size of y: without noise P would be
    /// infinite.
    fn deviation(&self) -> f64 {
        let (rows, d) = (self.root.rows(), self.places.len());
        let freedom = rows.saturating_sub(d).max(1) as f64;
        let least = f64::EPSILON * self.power / rows.max(1) as f64;
        (self.root.residual_sum() / freedom).max(least).sqrt()
    }
}
