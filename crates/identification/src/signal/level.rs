//! The noise level eta = 100 sigma_f / sigma_y, Eq. (6), in the readings of E7.

use super::arithmetic::{covariance, variance};
use crate::names::named_enum;
use crate::real::Real;

named_enum! {
    /// The signals whose standard deviations Eq. (6) takes: reading E7.
    LevelOver, "reading of eta" {
        /// The realisation in the window k = 0 ... N-1, so that eta holds exactly in every trial (the default).
        Window = "exact",
        /// The stationary processes, so that eta holds on average over trials. The output's process is that under
        /// independent signs.
        Process = "nominal",
        /// As [`Self::Window`], and after the window there is no noise at all.
        WindowAlone = "window-alone",
        /// Nothing: eta/100 is the standard deviation of the white noise before its filter, in units of y.
        Nothing = "absolute",
    }
}

named_enum! {
    /// Which output's standard deviation is the denominator of Eq. (6): reading E7.
    LevelOf, "output of eta" {
        /// The noise-free output c'x (the default).
        NoiseFree = "noise-free",
        /// The measured output y = c'x + f.
        Measured = "measured",
    }
}

impl LevelOver {
    /// Returns whether the level holds in the window of every trial.
    pub const fn is_of_window(self) -> bool {
        matches!(self, Self::Window | Self::WindowAlone)
    }

    /// Returns how many of the first samples of a record have noise.
    pub const fn noisy(self, window: usize, horizon: usize) -> usize {
        match self {
            Self::WindowAlone => window,
            _ => horizon,
        }
    }
}

/// The readings of Eq. (6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelReading {
    /// Realisation or process.
    pub over: LevelOver,
    /// Noise-free or measured output.
    pub of: LevelOf,
}

/// Variances of the two processes, for [`LevelOver::Process`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessVariances {
    /// The variance of the noise-free output.
    pub output: f64,
    /// The variance of the unscaled noise.
    pub noise: f64,
}

impl LevelReading {
    /// Returns the factor s such that y = y0 + s f has noise level `eta` per cent, Eq. (6).
    ///
    /// `y0` and `f` are the samples of the window, equally many. For the measured output, s solves
    /// `s^2 F = e^2 (Y + 2 s C + s^2 F)` with e = eta/100, the variances Y of y0 and F of f, and their covariance C.
    /// The positive root is taken (for processes C = 0). NaN if there is no finite factor: F = 0 with eta > 0, or eta
    /// >= 100 % of the measured output.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn scale<R: Real>(self, eta: f64, y0: &[R], f: &[R], process: ProcessVariances) -> R {
        if eta == 0.0 {
            return R::zero();
        }
        let e = R::splat(eta / 100.0);
        let (output, noise, cross) = match self.over {
            LevelOver::Nothing => return e,
            LevelOver::Window | LevelOver::WindowAlone => {
                let cross = match self.of {
                    LevelOf::NoiseFree => R::zero(),
                    LevelOf::Measured => covariance(y0, f),
                };
                (variance(y0), variance(f), cross)
            }
            LevelOver::Process => (R::splat(process.output), R::splat(process.noise), R::zero()),
        };
        let scale = match self.of {
            LevelOf::NoiseFree => e * (output / noise).sqrt(),
            LevelOf::Measured => {
                // (1 - e^2) F s^2 - 2 e^2 C s - e^2 Y = 0
                let square = e * e;
                let lead = (R::splat(1.0) - square) * noise;
                let half = square * cross;
                let root = (half + half.mul_add(half, lead * square * output).sqrt()) / lead;
                R::select(R::zero().less(lead), root, R::splat(f64::NAN))
            }
        };
        R::select(scale.is_finite(), scale, R::splat(f64::NAN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_holds_in_the_window_for_both_outputs() {
        let y0: Vec<f64> = (0..98).map(|k| libm::sin(0.3 * f64::from(k))).collect();
        let f: Vec<f64> = (0..98).map(|k| libm::cos(1.7 * f64::from(k * k))).collect();
        let process = ProcessVariances {
            output: 4.0,
            noise: 9.0,
        };
        for eta in [0.1, 10.018, 90.0] {
            for of in [LevelOf::NoiseFree, LevelOf::Measured] {
                let over = LevelOver::Window;
                let s = LevelReading { over, of }.scale(eta, &y0, &f, process);
                let y: Vec<f64> = y0.iter().zip(&f).map(|(y, f)| y + s * f).collect();
                let below = match of {
                    LevelOf::NoiseFree => variance(&y0),
                    LevelOf::Measured => variance(&y),
                };
                let level = 100.0 * s * (variance(&f) / below).sqrt();
                assert!((level / eta - 1.0).abs() < 1e-13, "{of:?} {eta}: {level}");
            }
        }
        let over = LevelOver::Process;
        let of = LevelOf::NoiseFree;
        let s = LevelReading { over, of }.scale(30.0, &y0, &f, process);
        assert!((s - 0.2).abs() < 1e-15);
        let of = LevelOf::Measured;
        let s = LevelReading { over, of }.scale(30.0, &y0, &f, process);
        assert!((s * s * 9.0 / (4.0 + s * s * 9.0) - 0.09).abs() < 1e-15);
        assert!(LevelReading { over, of }.scale(100.0, &y0, &f, process).is_nan());
    }
}
