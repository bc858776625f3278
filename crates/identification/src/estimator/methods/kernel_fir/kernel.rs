//! Prior covariances of an impulse response, as triangular factors.

use crate::estimator::FailureKind;
use crate::estimator::prediction_error::kernels::Triangle;
use crate::names::named_enum;

named_enum! {
    /// The prior covariance of the taps `g_1 ... g_n`, `c K`.
    Kernel, "kernel" {
        /// Tuned and correlated, `K_ij = alpha^max(i, j)` (the default).
        Tc = "tc",
        /// Diagonal and correlated, `K_ij = alpha^((i+j)/2) rho^|i-j|`.
        Dc = "dc",
        /// Stable spline, `K_ij = alpha^(i+j+max(i,j)) / 2 - alpha^(3 max(i,j)) / 6`.
        Ss = "ss",
    }
}

impl Kernel {
    /// Computes L, column by column, with `L L' = K`; rho is that of [`Self::Dc`].
    ///
    /// Read from the last tap to the first, each prior is a Markov process. `tc` is `dc` with `rho^2 = alpha`, an
    /// autoregression in units of `alpha^(i/2)`. `ss` is integrated Brownian motion at the times `alpha^i`.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`].
    pub(super) fn factor(self, alpha: f64, rho: f64, n: usize, l: &mut Vec<f64>) -> Result<(), FailureKind> {
        l.clear();
        l.resize(n * n, 0.0);
        match self {
            Self::Tc => autoregression(alpha, alpha.sqrt(), n, l),
            Self::Dc => autoregression(alpha, rho, n, l),
            Self::Ss => return spline(alpha, n, l),
        }
        Ok(())
    }
}

/// `g_i = alpha^(i/2) x_i`, `x_i = rho x_(i+1) + sqrt(1 - rho^2) w_i`: L is upper triangular.
fn autoregression(alpha: f64, rho: f64, n: usize, l: &mut [f64]) {
    let root = alpha.sqrt();
    let innovation = (1.0 - rho * rho).max(0.0).sqrt();
    for (j, column) in l.chunks_exact_mut(n).enumerate() {
        let mut correlation = if j + 1 < n { innovation } else { 1.0 };
        for i in (0..=j).rev() {
            column[i] = correlation * root.powi(i as i32 + 1);
            correlation *= rho;
        }
    }
}

/// `g_i` is the integral at the time `t_i = alpha^i` of a Brownian motion that begins at time 0. Each step has two
/// white numbers, so the rows are reduced to a triangle: L is lower triangular.
fn spline(alpha: f64, n: usize, l: &mut [f64]) -> Result<(), FailureKind> {
    let time = |i: usize| alpha.powi(i as i32 + 1);
    let entry = |j: usize, second: bool, i: usize| {
        if i > j {
            return 0.0;
        }
        let step = if j + 1 < n { time(j) - time(j + 1) } else { time(j) };
        let (root, since) = (step.sqrt(), time(i) - time(j));
        if second {
            return root / 2.0 * since;
        }
        root * (step / 3.0_f64.sqrt() + 0.75_f64.sqrt() * since)
    };
    let mut triangle = Triangle::new(n);
    triangle.run(2 * n, |i, first, to| {
        for (row, to) in to.iter_mut().enumerate() {
            let row = first + row;
            *to = if i < n { entry(row / 2, row % 2 == 1, i) } else { 0.0 };
        }
    })?;
    let r = triangle.r();
    for (j, column) in l.chunks_exact_mut(n).enumerate() {
        for (i, l) in column.iter_mut().enumerate().skip(j) {
            *l = r[(j, i)];
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `L L'` against the formulas of the kernels.
    #[test]
    fn factors_are_those_of_the_formulas() {
        let n = 40;
        let formula = |kernel: Kernel, alpha: f64, rho: f64, i: f64, j: f64| {
            let most = i.max(j);
            match kernel {
                Kernel::Tc => alpha.powf(most),
                Kernel::Dc => alpha.powf(f64::midpoint(i, j)) * rho.powf((i - j).abs()),
                Kernel::Ss => alpha.powf(i + j + most) / 2.0 - alpha.powf(3.0 * most) / 6.0,
            }
        };
        let mut l = Vec::new();
        for kernel in Kernel::ALL {
            for (alpha, rho) in [(0.3, 0.2), (0.9, 0.99), (0.9999, 0.5)] {
                kernel.factor(alpha, rho, n, &mut l).unwrap();
                for i in 0..n {
                    for j in 0..n {
                        let product = |m: usize| l[m * n + i] * l[m * n + j];
                        let found: f64 = (0..n).map(product).sum();
                        let of = |i, j| formula(*kernel, alpha, rho, i as f64 + 1.0, j as f64 + 1.0);
                        let scale = (of(i, i) * of(j, j)).sqrt();
                        // Rounding grows with the number of terms.
                        let allowed = 40.0 * n as f64 * f64::EPSILON * scale;
                        assert!((found - of(i, j)).abs() <= allowed, "{kernel} {alpha} {i} {j}");
                    }
                }
            }
        }
    }
}
