//! The weights that forgetting leaves to equations, and what they make of a sum of squares.

/// `sum w` and `sum w^2` over the equations so far, `w(i)` being the product of all lambda after equation i.
///
/// With the residuals of weighted least squares and white errors of variance s^2,
///
/// ```text
///     E sum w eps^2 = s^2 (sum w - tr((Phi'W Phi)^-1 Phi'W^2 Phi)),  cov theta = s^2 P Phi'W^2 Phi P,  P = (Phi'W
///     Phi)^-1
/// ```
///
/// Regressors of a stationary signal have about the same moments under any weights, `Phi'W Phi = sum w R` and `Phi'W^2
/// Phi = sum w^2 R`, which makes the trace `d sum w^2 / sum w` and the covariance `s^2 P sum w^2 / sum w`. With all
/// weights 1 both are exact: the sum over equations less parameters, and s^2 P.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Weights {
    sum: f64,
    squares: f64,
}

impl Weights {
    /// Takes an equation, after all others got the factor lambda.
    pub(super) fn add(&mut self, lambda: f64) {
        self.sum = lambda * self.sum + 1.0;
        self.squares = lambda * lambda * self.squares + 1.0;
    }

    /// Returns `sum w^2 / sum w`.
    pub(super) fn ratio(self) -> f64 {
        self.squares / self.sum
    }

    /// Returns the variance of errors of which d parameters left this weighted sum of squares; NaN where there are too
    /// few.
    pub(super) fn variance(self, sum: f64, d: usize) -> f64 {
        let freedom = self.sum - d as f64 * self.ratio();
        if freedom > 0.0 { sum / freedom } else { f64::NAN }
    }
}
