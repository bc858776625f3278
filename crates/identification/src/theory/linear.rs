//! Limits of the estimates `theta = (sum z phi')^-1 sum z y`, and their fluctuation about the limits.

use super::joint_state::{covariance, long_run_covariance};
use super::matrix::Matrix;
use super::missing::{Missing, NoTheory};
use super::population::{NOISE, Population};
use super::signal::{Signal, Source};

/// Smaller correlations count as zero: instruments and error are then uncorrelated.
const ORTHOGONAL: f64 = 1e-9;

/// Smallest reciprocal condition number, in the 1-norm, of a matrix that may be inverted, after scaling its rows and
/// columns.
const SINGULAR: f64 = 1e-14;

/// The fluctuation of an estimate about its limit: `sqrt(N) (theta_hat - theta) = N^(-1/2) sum_k W m(k)`, with m the
/// products `a_i(k) b_i(k)` less their means.
#[derive(Clone, Debug)]
pub struct Influence {
    /// The products.
    pub products: Vec<(Signal, Signal)>,
    /// W, a row for each parameter.
    pub weights: Matrix,
}

impl Influence {
    /// P, the covariance of `sqrt(N) (theta_hat - theta)`.
    ///
    /// # Errors
    /// As for [`long_run_covariance`].
    pub fn covariance(&self, sources: &[Source]) -> Result<Matrix, NoTheory> {
        let s = long_run_covariance(sources, &self.products)?;
        Ok(&(&self.weights * &s) * &self.weights.transpose())
    }

    /// Adds `matrix` times the influence of another estimate, without columns that are only rounding.
    fn add(&mut self, matrix: &Matrix, other: &Self) {
        let more = matrix * &other.weights;
        let least = 1e-13 * self.weights.norm_max();
        for (j, product) in other.products.iter().enumerate() {
            let column = more.col(j);
            if column.iter().all(|x| x.abs() <= least) {
                continue;
            }
            let known = self.products.iter().position(|p| p == product);
            let place = known.unwrap_or_else(|| {
                self.products.push(product.clone());
                self.products.len() - 1
            });
            if known.is_none() {
                self.weights.push_column();
            }
            for (i, x) in column.iter().enumerate() {
                self.weights[(i, place)] += x;
            }
        }
    }
}

/// A linear estimate in the limit.
#[derive(Clone)]
pub struct Linear {
    /// The limit.
    pub theta: Vec<f64>,
    /// Whether the limit is the truth.
    pub is_consistent: bool,
    /// `y - phi'theta` at the limit.
    pub error: Signal,
    /// The fluctuation of the estimate about the limit.
    pub influence: Influence,
    /// `E[z phi']`.
    moments: Matrix,
}

impl Linear {
    /// The estimate with instruments z. `truth` is the true theta with its error, if the model has one.
    ///
    /// # Errors
    /// [`Missing`], above all [`Missing::Singular`].
    pub fn new(
        population: &Population,
        z: &[Signal],
        phi: &[Signal],
        y: &Signal,
        truth: Option<(Vec<f64>, &Signal)>,
    ) -> Result<Self, Missing> {
        let sources = &population.sources;
        let moments = invertible(sources, z, phi)?;
        let consistent = match truth {
            Some((theta, error)) if are_orthogonal(sources, z, error)? => Some((theta, error)),
            _ => None,
        };
        let is_consistent = consistent.is_some();
        let (theta, error) = if let Some((theta, error)) = consistent {
            (theta, error.clone())
        } else {
            let right = covariance(sources, z, std::slice::from_ref(y))?;
            let solution = moments.solve(&right);
            let theta: Vec<f64> = (0..phi.len()).map(|i| solution[(i, 0)]).collect();
            let mut error = y.clone();
            for (theta, phi) in theta.iter().zip(phi) {
                error = error.plus(-theta, phi);
            }
            (theta, error)
        };
        let mut products: Vec<(Signal, Signal)> = z.iter().map(|z| (z.clone(), error.clone())).collect();
        let mut moved = Matrix::identity(phi.len());
        if !is_consistent && !population.level.is_empty() {
            let by_scale = by_noise_scale(sources, z, &error)?;
            let level = &population.level;
            let old = moved;
            moved = Matrix::from_fn(phi.len(), phi.len() + level.len(), |i, j| {
                match j.checked_sub(phi.len()) {
                    None => old[(i, j)],
                    Some(j) => level[j].0 * by_scale[i],
                }
            });
            products.extend(level.iter().map(|(_, a, b)| (a.clone(), b.clone())));
        }
        Ok(Self {
            influence: Influence {
                products,
                weights: moments.solve(&moved),
            },
            theta,
            is_consistent,
            error,
            moments,
        })
    }

    /// Adds to `to` the influence that the instruments inherit from another estimate that they are built from. `slopes`
    /// is `E[(dz / dtheta') e]`, with theta the parameters of that estimate.
    pub fn follow(&self, slopes: &Matrix, other: &Influence, to: &mut Influence) {
        to.add(&self.moments.solve(slopes), other);
    }
}

/// The derivative of `E[z e]` with respect to log s: twice the part due to the measurement noise.
fn by_noise_scale(sources: &[Source], z: &[Signal], error: &Signal) -> Result<Vec<f64>, NoTheory> {
    let of_noise: Vec<Signal> = z.iter().map(|z| z.from_source(NOISE)).collect();
    let moments = covariance(sources, &of_noise, &[error.from_source(NOISE)])?;
    Ok((0..z.len()).map(|i| 2.0 * moments[(i, 0)]).collect())
}

/// `E[z phi']`, which can be inverted.
///
/// # Errors
/// [`Missing::Singular`].
pub fn invertible(sources: &[Source], z: &[Signal], phi: &[Signal]) -> Result<Matrix, Missing> {
    let g = covariance(sources, z, phi)?;
    is_regular(&g)?;
    Ok(g)
}

/// Checks that a square matrix can be inverted, after scaling rows and columns by their largest entries.
///
/// # Errors
/// [`Missing::Singular`].
pub fn is_regular(g: &Matrix) -> Result<(), Missing> {
    let n = g.nrows();
    let mut scaled = g.clone();
    for _ in 0..2 {
        for i in 0..n {
            let size = (0..n).fold(0.0_f64, |most, j| scaled[(i, j)].abs().max(most));
            (0..n).for_each(|j| scaled[(i, j)] /= size);
        }
        for j in 0..n {
            let size = scaled.col(j).iter().fold(0.0_f64, |most, x| x.abs().max(most));
            (0..n).for_each(|i| scaled[(i, j)] /= size);
        }
    }
    if n == 0 || !scaled.is_all_finite() {
        return Err(Missing::Singular);
    }
    if scaled.condition().recip() > SINGULAR {
        Ok(())
    } else {
        Err(Missing::Singular)
    }
}

/// Whether no instrument is correlated with the error, source by source.
///
/// # Errors
/// As for [`covariance`].
pub fn are_orthogonal(sources: &[Source], z: &[Signal], error: &Signal) -> Result<bool, NoTheory> {
    for source in 0..sources.len() {
        let error = [error.from_source(source)];
        if error[0].parts.is_empty() || sources[source].variance == 0.0 {
            continue;
        }
        let z: Vec<Signal> = z.iter().map(|z| z.from_source(source)).collect();
        let size = covariance(sources, &error, &error)?[(0, 0)];
        let moments = covariance(sources, &z, &error)?;
        let sizes = covariance(sources, &z, &z)?;
        for i in 0..z.len() {
            let largest = (size * sizes[(i, i)]).sqrt();
            if moments[(i, 0)].abs() > ORTHOGONAL * largest {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// The Schur complement of all but the first `count` rows and columns.
pub(super) fn without_noise(moments: &Matrix, count: usize) -> Result<Matrix, Missing> {
    let (all, rest) = (moments.nrows(), moments.nrows() - count);
    let plant = moments.part(0..count, 0..count);
    if rest == 0 {
        return Ok(plant);
    }
    let noise = moments.part(count..all, count..all);
    is_regular(&noise)?;
    let across = moments.part(count..all, 0..count);
    Ok(&plant - &(&across.transpose() * &noise.solve(&across)))
}
