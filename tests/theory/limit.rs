//! The limit of least squares as the window grows, by step-down recursions: another way than that of the crate and of
//! `population.rs`.

use asobench::plant::StateSpace;
use asobench::plant::stability::StepDown;
use asobench::signal::NoiseFilter;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Why there is no limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LimitError {
    /// The plant is not stable, so its output has no stationary variance.
    #[error("the plant is not stable: its output is not stationary")]
    UnstablePlant,
    /// The amplitude or a noise level is out of range.
    #[error("the amplitude must be above 0 and both noise levels at least 0 %, all of them finite")]
    Level,
    /// The noise has variance 0 and cannot be scaled to a level.
    #[error("the noise filter is zero")]
    NoNoise,
    /// R is singular up to rounding: without noise, the true order of the plant is lower than stated.
    #[error("the covariance of the regressors is not positive definite")]
    Singular,
}

/// Computes the limit `p = (alpha, beta)` of least squares for N -> infinity in open loop, with probability one.
///
/// ```text
/// p = theta + R^-1 E[phi(k) v(k)],   R = E[phi phi'],   v = A(q) f - B(q) w_u,
/// phi(k) = (-y(k-1) ... -y(k-n), u(k-1) ... u(k-n)),   y = y0 + f,   u = u0 + w_u
/// ```
///
/// Source: Soderstrom and Stoica, System Identification, 1989, chapters 7 and 8. `amplitude` is the standard deviation
/// of the white input u0. f is noise of the colour `noise`, scaled so that `100 sigma_f / sigma_y0 = eta` for the
/// stationary processes, with y0 the noise-free output. For a record whose own window has exactly eta, the result
/// differs by O(1/N). w_u is white, independent of f, with a standard deviation of `input_noise` per cent of the
/// amplitude (errors in variables). With autocovariances r0 of y0 and r of f, and the Markov parameters g of the plant:
///
/// ```text
/// E[y(k-i) y(k-j)] = r0(i-j) + r(i-j),   E[y(k-i) u(k-j)] = amplitude^2 g(j-i),   g(j) = 0 for j < 1,
/// E[u(k-i) u(k-j)] = (amplitude^2 + sigma_u^2) [i = j],
/// E[-y(k-i) v(k)] = -sum_j alpha_j r(i-j), alpha_0 = 1,   E[u(k-i) v(k)] = -beta_i sigma_u^2.
/// ```
///
/// No series is truncated: `r(t) = energy(C (1 + q^-t) / D) / 2 - energy(C / D)` for `f = C/D w`. Each energy is a
/// finite sum by the step-down recursion ([`StepDown::energy`]).
///
/// # Errors
/// [`LimitError`].
pub fn least_squares_limit(
    plant: &StateSpace,
    amplitude: f64,
    noise: &NoiseFilter,
    eta: f64,
    input_noise: f64,
) -> Result<Vec<f64>, LimitError> {
    let percentages = [eta, input_noise].iter().all(|x| *x >= 0.0 && x.is_finite());
    if !(amplitude > 0.0 && amplitude.is_finite() && percentages) {
        return Err(LimitError::Level);
    }
    let n = plant.order();
    let (alpha, beta) = (plant.denominator(), plant.h());
    let input = amplitude * amplitude;
    let input_error = input * (input_noise / 100.0).powi(2);

    let numerator = [&[0.0], beta.as_slice()].concat();
    let r0 = autocovariances(&numerator, &alpha, n).ok_or(LimitError::UnstablePlant)?;
    // Autocovariances of the unscaled noise; NoiseFilter has checked its stability.
    let r = autocovariances(noise.numerator(), &noise.denominator(), n).ok_or(LimitError::NoNoise)?;
    let square = match (eta, r[0]) {
        (0.0, _) => 0.0,
        (_, variance) if variance > 0.0 => (eta / 100.0).powi(2) * input * r0[0] / variance,
        _ => return Err(LimitError::NoNoise),
    };

    let output = |i: usize, j: usize| input.mul_add(r0[i.abs_diff(j)], square * r[i.abs_diff(j)]);
    let cross = |i: usize, j: usize| {
        if j > i { -input * plant.b()[j - i - 1] } else { 0.0 }
    };
    let covariance = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => output(i, j),
        (true, false) => cross(i, j - n),
        (false, true) => cross(j, i - n),
        (false, false) if i == j => input + input_error,
        (false, false) => 0.0,
    });
    // Covariance of A(q) f with f(k-i-1): alpha_0 belongs to f(k).
    let coloured = |i: usize| -> f64 {
        let terms = alpha.iter().enumerate();
        terms.map(|(j, alpha)| alpha * r[(i + 1).abs_diff(j)]).sum()
    };
    let mut bias = Mat::from_fn(2 * n, 1, |i, _| {
        if i < n {
            -square * coloured(i)
        } else {
            -input_error * beta[i - n]
        }
    });
    let factors = covariance.llt(Side::Lower).map_err(|_| LimitError::Singular)?;
    factors.solve_in_place(bias.as_mut());
    let truth = alpha[1..].iter().chain(&beta);
    let limit: Vec<f64> = truth.enumerate().map(|(i, theta)| theta + bias[(i, 0)]).collect();
    if limit.iter().all(|p| p.is_finite()) {
        Ok(limit)
    } else {
        Err(LimitError::Singular)
    }
}

/// Returns `r(0) ... r(lags)` of white noise of unit variance through `C(q) / D(q)`, D monic; `None` if D is not
/// stable.
fn autocovariances(numerator: &[f64], denominator: &[f64], lags: usize) -> Option<Vec<f64>> {
    let step_down = StepDown::new(denominator.get(1..)?)?;
    let variance = step_down.energy(numerator);
    let covariance = |lag: usize| {
        let mut sum = numerator.to_vec();
        sum.resize(numerator.len() + lag, 0.0);
        for (later, c) in sum[lag..].iter_mut().zip(numerator) {
            *later += c;
        }
        0.5f64.mul_add(step_down.energy(&sum), -variance)
    };
    Some(
        (0..=lags)
            .map(|lag| if lag == 0 { variance } else { covariance(lag) })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use asobench::plant::{Numerator, nikolov2023};

    /// An AR(1) process: `r(t) = a^t / (1 - a^2)`; a moving average `1 + c q^-1`: 1 + c^2, c, 0.
    #[test]
    fn autocovariances_by_hand() {
        let r = autocovariances(&[1.0], &[1.0, -0.9], 4).unwrap();
        for (t, r) in (0..).zip(r) {
            assert!((r * 0.19 - 0.9_f64.powi(t)).abs() < 1e-14, "{t}");
        }
        let r = autocovariances(&[1.0, 0.8], &[1.0], 2).unwrap();
        assert!((r[0] - 1.64).abs() < 1e-15 && (r[1] - 0.8).abs() < 1e-15 && r[2].abs() < 1e-15);
        assert_eq!(autocovariances(&[1.0], &[1.0, -1.0], 1), None);
    }

    /// `y(k) = -alpha y(k-1) + beta u(k-1)` in white noise of variance s, with input noise of variance q:
    /// `R = diag(r0 + s, 1 + q)`. Hence alpha tends to `alpha r0 / (r0 + s)` and beta to `beta / (1 + q)`.
    #[test]
    fn a_first_order_plant_by_hand() {
        let (alpha, beta) = (-0.8, 2.0);
        let plant = StateSpace::from_polynomials(&[alpha], &[beta]).unwrap();
        let limit = least_squares_limit(&plant, 3.0, &NoiseFilter::white(), 50.0, 10.0).unwrap();
        assert!((limit[0] - alpha / 1.25).abs() < 1e-14);
        assert!((limit[1] - beta / 1.01).abs() < 1e-14);
    }

    #[test]
    fn least_squares_is_consistent_where_the_equation_error_is_white() {
        let plant = nikolov2023(Numerator::default());
        let noise = NoiseFilter::new(&[1.0], &plant.denominator()).unwrap();
        let theta = [&plant.denominator()[1..], &plant.h()].concat();
        let limit = least_squares_limit(&plant, 10.0, &noise, 30.0, 0.0).unwrap();
        for (p, theta) in limit.iter().zip(&theta) {
            assert!((p - theta).abs() < 1e-12);
        }
        let biased = least_squares_limit(&plant, 10.0, &NoiseFilter::white(), 30.0, 0.0).unwrap();
        assert!((biased[0] - theta[0]).abs() > 0.1);
    }

    #[test]
    fn refusals() {
        let white = NoiseFilter::white();
        let stable = StateSpace::new(vec![0.5], vec![1.0]).unwrap();
        let limit = |plant: &StateSpace, amplitude, noise: &NoiseFilter, eta| {
            least_squares_limit(plant, amplitude, noise, eta, 0.0).unwrap_err()
        };
        let unstable = StateSpace::new(vec![1.5], vec![1.0]).unwrap();
        assert_eq!(limit(&unstable, 1.0, &white, 1.0), LimitError::UnstablePlant);
        assert_eq!(limit(&stable, 0.0, &white, 1.0), LimitError::Level);
        assert_eq!(limit(&stable, 1.0, &white, f64::NAN), LimitError::Level);
        let silent = NoiseFilter::new(&[0.0], &[1.0]).unwrap();
        assert_eq!(limit(&stable, 1.0, &silent, 1.0), LimitError::NoNoise);
        let dead = StateSpace::new(vec![0.5], vec![0.0]).unwrap();
        assert_eq!(limit(&dead, 1.0, &white, 0.0), LimitError::Singular);
    }
}
