//! Limits of the estimates `theta = (sum z phi')^-1 sum z y`, and their fluctuation about the limits.

use super::joint_state::{covariance, long_run_covariance};
use super::missing::{Missing, NoTheory};
use super::population::{NOISE, Population};
use super::signal::{Signal, Source};
use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};

/// Smaller correlations count as zero: instruments and error are then uncorrelated.
const ORTHOGONAL: f64 = 1e-9;

/// Smallest reciprocal condition number of a matrix that may be inverted, after scaling its rows and columns.
const SINGULAR: f64 = 1e-14;

/// The fluctuation of an estimate about its limit: `sqrt(N) (theta_hat - theta) = N^(-1/2) sum_k W m(k)`, with m the
/// products `a_i(k) b_i(k)` less their means.
#[derive(Clone, Debug)]
pub struct Influence {
    /// The products.
    pub products: Vec<(Signal, Signal)>,
    /// W, a row for each parameter.
    pub weights: Mat<f64>,
}

impl Influence {
    /// P, the covariance of `sqrt(N) (theta_hat - theta)`.
    ///
    /// # Errors
    /// As for [`long_run_covariance`].
    pub fn covariance(&self, sources: &[Source]) -> Result<Mat<f64>, NoTheory> {
        let s = long_run_covariance(sources, &self.products)?;
        Ok(&self.weights * s * self.weights.transpose())
    }

    /// Adds `matrix` times the influence of another estimate, without columns that are only rounding.
    fn add(&mut self, matrix: &Mat<f64>, other: &Self) {
        let more = matrix * &other.weights;
        let largest = self.weights.norm_max();
        for (j, product) in other.products.iter().enumerate() {
            let column = more.col(j);
            if column.norm_max() <= 1e-13 * largest {
                continue;
            }
            let known = self.products.iter().position(|p| p == product);
            let place = known.unwrap_or_else(|| {
                self.products.push(product.clone());
                self.products.len() - 1
            });
            let width = self.products.len();
            if known.is_none() {
                self.weights
                    .resize_with(self.weights.nrows(), width, |_, _| 0.0);
            }
            for i in 0..self.weights.nrows() {
                self.weights[(i, place)] += column[i];
            }
        }
    }
}

/// A linear estimate in the limit.
pub struct Linear {
    /// The limit.
    pub theta: Vec<f64>,
    /// Whether the limit is the truth.
    pub is_consistent: bool,
    /// `y - phi'theta` at the limit.
    pub error: Signal,
    /// The fluctuation of the estimate about the limit.
    pub influence: Influence,
    factors: PartialPivLu<f64>,
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
        let factors = invertible(sources, z, phi)?;
        let consistent = match truth {
            Some((theta, error)) if are_orthogonal(sources, z, error)? => Some((theta, error)),
            _ => None,
        };
        let is_consistent = consistent.is_some();
        let (theta, error) = if let Some((theta, error)) = consistent {
            (theta, error.clone())
        } else {
            let right = covariance(sources, z, std::slice::from_ref(y))?;
            let solution = factors.solve(&right);
            let theta: Vec<f64> = (0..phi.len()).map(|i| solution[(i, 0)]).collect();
            let mut error = y.clone();
            for (theta, phi) in theta.iter().zip(phi) {
                error = error.plus(-theta, phi);
            }
            (theta, error)
        };
        let mut products: Vec<(Signal, Signal)> =
            z.iter().map(|z| (z.clone(), error.clone())).collect();
        let mut moved = Mat::<f64>::identity(phi.len(), phi.len());
        if !is_consistent && !population.level.is_empty() {
            let by_scale = by_noise_scale(sources, z, &error)?;
            let level = &population.level;
            let old = moved;
            moved = Mat::from_fn(phi.len(), phi.len() + level.len(), |i, j| {
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
                weights: factors.solve(&moved),
            },
            theta,
            is_consistent,
            error,
            factors,
        })
    }

    /// Adds to `to` the influence that the instruments inherit from another estimate that they are built from. `slopes`
    /// is `E[(dz / dtheta') e]`, with theta the parameters of that estimate.
    pub fn follow(&self, slopes: &Mat<f64>, other: &Influence, to: &mut Influence) {
        to.add(&self.factors.solve(slopes), other);
    }
}

/// The derivative of `E[z e]` with respect to log s: twice the part due to the measurement noise.
fn by_noise_scale(sources: &[Source], z: &[Signal], error: &Signal) -> Result<Vec<f64>, NoTheory> {
    let of_noise: Vec<Signal> = z.iter().map(|z| z.from_source(NOISE)).collect();
    let moments = covariance(sources, &of_noise, &[error.from_source(NOISE)])?;
    Ok((0..z.len()).map(|i| 2.0 * moments[(i, 0)]).collect())
}

/// LU factors of `E[z phi']`.
///
/// # Errors
/// [`Missing::Singular`].
pub fn invertible(
    sources: &[Source],
    z: &[Signal],
    phi: &[Signal],
) -> Result<PartialPivLu<f64>, Missing> {
    let g = covariance(sources, z, phi)?;
    is_regular(&g)?;
    Ok(g.partial_piv_lu())
}

/// Checks that a square matrix can be inverted, after scaling rows and columns by their largest entries.
///
/// # Errors
/// [`Missing::Singular`].
pub fn is_regular(g: &Mat<f64>) -> Result<(), Missing> {
    let n = g.nrows();
    let mut scaled = g.clone();
    for _ in 0..2 {
        for i in 0..n {
            let size = scaled.row(i).norm_max();
            scaled.row_mut(i).iter_mut().for_each(|x| *x /= size);
        }
        for j in 0..n {
            let size = scaled.col(j).norm_max();
            scaled.col_mut(j).iter_mut().for_each(|x| *x /= size);
        }
    }
    if n == 0 || !scaled.is_all_finite() {
        return Err(Missing::Singular);
    }
    let values = scaled.singular_values().map_err(|_| Missing::Singular)?;
    if values[n - 1] > SINGULAR * values[0] {
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
pub(super) fn without_noise(moments: &Mat<f64>, count: usize) -> Result<Mat<f64>, Missing> {
    let (all, rest) = (moments.nrows(), moments.nrows() - count);
    let plant = moments.as_ref().get(..count, ..count);
    if rest == 0 {
        return Ok(plant.to_owned());
    }
    let noise = moments.as_ref().get(count..all, count..all).to_owned();
    is_regular(&noise)?;
    let across = moments.as_ref().get(count..all, ..count);
    let solved = noise.partial_piv_lu().solve(across);
    Ok(plant - across.transpose() * solved)
}
