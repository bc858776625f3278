//! The Fisher information of a record whose input is measured with noise.

use super::linear::without_noise;
use super::matrix::Matrix;
use super::missing::Missing;
use super::population::{INPUT_NOISE, NOISE, Population, REFERENCE};
use super::spectrum::turn;
use crate::data::{Feedback, Process};
use crate::model::polynomial::value;
use crate::signal::Input;
use faer::c64;

/// Frequencies of the mean: the sums converge as `rho^POINTS`, with rho the modulus of the largest pole.
const POINTS: usize = 1 << 14;
/// The variances that are not known: of the input, its noise, and the output's.
const VARIANCES: usize = 3;

/// The information `F` of N samples of `u = r + w_u`, `y = G r + e` about `alpha_1 ... alpha_n, beta_1 ... beta_n`, all
/// of r, w_u and e white and Gaussian and their variances unknown: the Schur complement of their block of
///
/// ```text
/// F_ij = N / (4 pi) int tr(S^-1 S_i S^-1 S_j) d omega,   S = [s_r + s_u, s_r G*; s_r G, s_r |G|^2 + s_e]
/// ```
///
/// with S the spectrum of (u, y) and S_i its derivatives. Source: Whittle 1953; Soderstrom, *Errors-in-Variables
/// Methods in System Identification*, 2018, section 4.4.
///
/// # Errors
/// [`Missing`].
pub(super) fn errors_in_variables(
    process: &Process,
    population: &Population,
    window: usize,
) -> Result<Matrix, Missing> {
    let variances = variances(process, population)?;
    let n = population.plant.order();
    let count = 2 * n + VARIANCES;
    let mut sum = Matrix::zeros(count, count);
    for point in 0..POINTS {
        let delay = turn(point, POINTS);
        let f = value(&population.alpha, delay);
        let g = value(&population.beta, delay) / f;
        let lag = |i: usize| delay.powi(i as i32) / f;
        let slopes = (1..=n).map(|i| -g * lag(i)).chain((1..=n).map(lag));
        let slopes: Vec<c64> = slopes.collect();
        add(variances, g, &slopes, &mut sum);
    }
    let scale = 0.5 * window as f64 / POINTS as f64;
    let all = Matrix::from_fn(count, count, |i, j| scale * sum[(i, j)]);
    let matrix = without_noise(&all, 2 * n)?;
    if matrix.is_all_finite() {
        Ok(matrix)
    } else {
        Err(Missing::Singular)
    }
}

/// The variances of the input, its noise and that of the output, all white and Gaussian, in open loop.
///
/// # Errors
/// [`Missing::NoisyInput`] if they are not.
pub(super) fn variances(process: &Process, population: &Population) -> Result<[f64; 3], Missing> {
    let settings = process.settings();
    let is_white = population.noise.0.len() == 1 && population.noise.1.len() == 1;
    let is_covered = matches!(process.input(), Input::Gaussian { .. })
        && matches!(settings.feedback, Feedback::None)
        && settings.process_noise == 0.0
        && is_white;
    if !is_covered {
        return Err(Missing::NoisyInput);
    }
    let variance = |source: usize| population.sources[source].variance;
    let lead = population.noise.0[0];
    Ok([
        variance(REFERENCE),
        variance(INPUT_NOISE),
        variance(NOISE) * lead * lead,
    ])
}

/// A Hermitian matrix `[a, b*; b, d]`.
#[derive(Clone, Copy)]
struct Hermitian {
    a: f64,
    b: c64,
    d: f64,
}

impl Hermitian {
    /// The real trace of the product of `S^-1 X` and `S^-1 Y`, given `S^-1`.
    fn trace(inverse: Self, x: Self, y: Self) -> f64 {
        let times = |m: Self| {
            let row = |p: c64, q: c64| [p * m.a + q * m.b, p * m.b.conj() + q * m.d];
            [
                row(inverse.a.into(), inverse.b.conj()),
                row(inverse.b, inverse.d.into()),
            ]
        };
        let (x, y) = (times(x), times(y));
        let sum: c64 = (0..2)
            .flat_map(|i| (0..2).map(move |j| (i, j)))
            .map(|(i, j)| x[i][j] * y[j][i])
            .sum();
        sum.re
    }
}

/// Adds `tr(S^-1 S_i S^-1 S_j)` at a frequency, given G and its derivatives by the plant's parameters.
fn add([s, input_noise, output_noise]: [f64; 3], g: c64, slopes: &[c64], sum: &mut Matrix) {
    let power = g.norm_sqr();
    let of = Hermitian {
        a: s + input_noise,
        b: s * g,
        d: s * power + output_noise,
    };
    let determinant = of.a * of.d - of.b.norm_sqr();
    let inverse = Hermitian {
        a: of.d / determinant,
        b: -of.b / determinant,
        d: of.a / determinant,
    };
    let plant = slopes.iter().map(|slope| Hermitian {
        a: 0.0,
        b: s * *slope,
        d: 2.0 * s * (g.conj() * *slope).re,
    });
    let zero = c64::new(0.0, 0.0);
    let variances = [(1.0, g, power), (1.0, zero, 0.0), (0.0, zero, 1.0)];
    let variances = variances.map(|(a, b, d)| Hermitian { a, b, d });
    let all: Vec<Hermitian> = plant.chain(variances).collect();
    for (i, x) in all.iter().enumerate() {
        for (j, y) in all.iter().enumerate() {
            sum[(i, j)] += Hermitian::trace(inverse, *x, *y);
        }
    }
}
