//! White noise in the states and in the output of a plant, by its covariances.

use super::StateSpace;
use crate::signal::{Stream, fill_white};
use faer::{Mat, MatRef};

/// White Gaussian noise of `x(k+1) = A x(k) + b u(k) + w(k)`, `y(k) = c'x(k) + v(k)`: `Q = E[w w']` (n x n),
/// `R = E[v v]`, `S = E[w v]` (n), in units of the states and of y. Without R, v is of another source and S = 0.
///
/// It is drawn as `w = L z + (S / sqrt R) f`, `v = sqrt(R) f` with independent white z (n) and f of variance 1 and `L
/// L' = Q - S S' / R`.
#[derive(Clone, Debug, PartialEq)]
pub struct StateNoise {
    /// L, n x n.
    factor: Mat<f64>,
    /// S / sqrt R.
    cross: Vec<f64>,
    /// R.
    measurement: Option<f64>,
}

/// Why covariances were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StateNoiseError {
    /// Q is not n x n, or an entry is not finite.
    #[error("expected {0} rows of {0} finite numbers, one per state")]
    Shape(usize),
    /// Q is not symmetric.
    #[error("not symmetric in row {0}, column {1}; expected a covariance")]
    NotSymmetric(usize, usize),
    /// Q has a negative eigenvalue.
    #[error("not positive semidefinite; expected a covariance")]
    Indefinite,
    /// R is not a positive number.
    #[error("{0}; expected a variance above 0")]
    Variance(f64),
    /// S does not have n finite numbers.
    #[error("expected {0} finite numbers, one per state")]
    Cross(usize),
    /// S without R.
    #[error("expected R beside it, the variance of the noise with which w is correlated")]
    CrossAlone,
    /// No w and v have these covariances.
    #[error("too large for Q and R: Q - S S' / R is not positive semidefinite; expected a covariance")]
    Correlation,
}

impl StateNoiseError {
    /// The covariance that is wrong: Q, R or S.
    pub const fn key(&self) -> &'static str {
        match self {
            Self::Shape(_) | Self::NotSymmetric(..) | Self::Indefinite => "Q",
            Self::Variance(_) => "R",
            Self::Cross(_) | Self::CrossAlone | Self::Correlation => "S",
        }
    }
}

impl StateNoise {
    /// Makes the noise of covariances in any coordinates. Q may be singular; it counts as symmetric where entries
    /// differ by 1e-12 of their size, and as semidefinite up to rounding, in any units of the states.
    ///
    /// # Errors
    /// [`StateNoiseError`].
    pub fn new(q: MatRef<'_, f64>, r: Option<f64>, s: Option<&[f64]>) -> Result<Self, StateNoiseError> {
        let n = q.nrows();
        if q.ncols() != n || !q.is_all_finite() {
            return Err(StateNoiseError::Shape(n));
        }
        let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        for (i, j) in pairs {
            let (lower, upper) = (q[(i, j)], q[(j, i)]);
            if (lower - upper).abs() > 1e-12 * lower.abs().max(upper.abs()) {
                return Err(StateNoiseError::NotSymmetric(j + 1, i + 1));
            }
        }
        let sizes: Vec<f64> = (0..n).map(|i| q[(i, i)]).collect();
        let factor = semidefinite_factor(q, &sizes).ok_or(StateNoiseError::Indefinite)?;
        if let Some(r) = r.filter(|r| !(*r > 0.0 && r.is_finite())) {
            return Err(StateNoiseError::Variance(r));
        }
        let none = Self {
            factor,
            cross: vec![0.0; n],
            measurement: r,
        };
        let Some(s) = s else {
            return Ok(none);
        };
        if s.len() != n || !s.iter().all(|s| s.is_finite()) {
            return Err(StateNoiseError::Cross(n));
        }
        let deviation = r.ok_or(StateNoiseError::CrossAlone)?.sqrt();
        let cross: Vec<f64> = s.iter().map(|s| s / deviation).collect();
        let rest = Mat::from_fn(n, n, |i, j| q[(i, j)] - cross[i] * cross[j]);
        let factor = semidefinite_factor(rest.as_ref(), &sizes);
        Ok(Self {
            factor: factor.ok_or(StateNoiseError::Correlation)?,
            cross,
            ..none
        })
    }

    /// Returns the noise of the states `T x`, T m x n.
    ///
    /// # Panics
    /// If T does not have n columns.
    #[must_use]
    pub fn transformed(&self, t: MatRef<'_, f64>) -> Self {
        let sum = |i: usize| (0..t.ncols()).map(|j| t[(i, j)] * self.cross[j]).sum();
        Self {
            factor: t * &self.factor,
            cross: (0..t.nrows()).map(sum).collect(),
            measurement: self.measurement,
        }
    }

    /// Returns Q, n x n, exactly symmetric.
    pub fn covariance(&self) -> Mat<f64> {
        let n = self.cross.len();
        let entry = |i: usize, j: usize| {
            let products = (0..n).map(|k| self.factor[(i, k)] * self.factor[(j, k)]);
            products.sum::<f64>() + self.cross[i] * self.cross[j]
        };
        Mat::from_fn(n, n, |i, j| entry(i.max(j), i.min(j)))
    }

    /// Returns R, where it is given.
    pub fn measurement(&self) -> Option<f64> {
        self.measurement
    }

    /// Returns S, n numbers.
    pub fn cross(&self) -> Vec<f64> {
        let deviation = self.measurement.unwrap_or(0.0).sqrt();
        self.cross.iter().map(|cross| cross * deviation).collect()
    }

    /// Returns the variance of c'x under w alone, for the canonical plant of order n in whose coordinates w is; `None`
    /// of an unstable plant.
    pub fn output_variance(&self, plant: &StateSpace) -> Option<f64> {
        let columns = self.factor.col_iter().map(|c| c.iter().copied().collect());
        let columns = columns.chain([self.cross.clone()]);
        let energy = |b: Vec<f64>| StateSpace::new(plant.a().to_vec(), b).ok()?.energy();
        columns.map(energy).sum()
    }

    /// Fills row k of `rows` (n numbers a row) with w(k), for the noise `v(k) = sqrt(R) f(k)`.
    ///
    /// # Panics
    /// If `rows` does not have n numbers for each f(k).
    pub fn draw(&self, numbers: &mut Stream, f: &[f64], rows: &mut [f64]) {
        let n = self.cross.len();
        assert!(rows.len() == n * f.len());
        fill_white(numbers, 1.0, rows);
        let mut z = vec![0.0; n];
        with_fma!(|| {
            for (row, f) in rows.chunks_exact_mut(n).zip(f) {
                z.copy_from_slice(row);
                for (i, w) in row.iter_mut().enumerate() {
                    *w = self.cross[i] * f;
                    for (j, z) in z.iter().enumerate() {
                        *w = self.factor[(i, j)].mul_add(*z, *w);
                    }
                }
            }
        });
    }
}

/// Returns the lower triangular L (n x n) with `L L' = M` for a symmetric M >= 0 that may be singular: Cholesky's
/// method, where a pivot that is rounding of the diagonal's entry in `sizes` leaves a column of zeros. `None` if M is
/// indefinite. A change of units by powers of two changes L by them alone.
fn semidefinite_factor(m: MatRef<'_, f64>, sizes: &[f64]) -> Option<Mat<f64>> {
    let n = m.nrows();
    let rounding = 16.0 * n as f64 * f64::EPSILON;
    let mut l: Mat<f64> = Mat::zeros(n, n);
    for j in 0..n {
        let left = |l: &Mat<f64>, i: usize| {
            let sum: f64 = (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum();
            0.5 * (m[(i, j)] + m[(j, i)]) - sum
        };
        let pivot = left(&l, j);
        let smallest = rounding * sizes[j];
        if !(pivot >= -smallest) {
            return None;
        }
        if pivot <= smallest {
            // In M >= 0 what is left beside a pivot p is at most sqrt(p M_ii).
            let most = |i: usize| 2.0 * (smallest * sizes[i]).sqrt();
            if (j + 1..n).any(|i| !(left(&l, i).abs() <= most(i))) {
                return None;
            }
            continue;
        }
        let root = pivot.sqrt();
        l[(j, j)] = root;
        for i in j + 1..n {
            l[(i, j)] = left(&l, i) / root;
        }
    }
    Some(l)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Purpose, stream};
    use faer::mat;

    const COUNT: usize = 40_000;

    /// w (n numbers a row) and v.
    fn drawn(noise: &StateNoise, n: usize) -> (Vec<f64>, Vec<f64>) {
        let (mut f, mut w) = (vec![0.0; COUNT], vec![0.0; n * COUNT]);
        fill_white(&mut stream(7, 0, Purpose::NoiseDrive), 1.0, &mut f);
        noise.draw(&mut stream(7, 0, Purpose::ProcessNoise), &f, &mut w);
        let deviation = noise.measurement().unwrap_or(1.0).sqrt();
        (w, f.iter().map(|f| deviation * f).collect())
    }

    /// Of each product the mean, within 4.5 standard errors, `sqrt((Q_ii Q_jj + Q_ij^2) / N)`; of (w, v) the sum of
    /// `z'Sigma^-1 z`, chi-squared with N (n + 1) degrees of freedom; and no correlation with the sample before.
    #[test]
    fn draws_have_the_covariances() {
        let whole = (mat![[0.5, 0.1], [0.1, 0.3]], 0.4, vec![0.2, -0.1]);
        let singular = (
            mat![[4.0, -2.0, 0.0], [-2.0, 1.0, 0.0], [0.0, 0.0, 0.0]],
            9.0,
            vec![3.0, -1.5, 0.0],
        );
        for (q, r, s) in [whole, singular] {
            let n = q.nrows();
            let noise = StateNoise::new(q.as_ref(), Some(r), Some(&s)).unwrap();
            assert!((noise.covariance() - &q).norm_max() < 1e-15);
            assert!(noise.cross().iter().zip(&s).all(|(x, y)| (x - y).abs() < 1e-15));
            let (w, v) = drawn(&noise, n);
            let all = Mat::from_fn(n + 1, COUNT, |i, k| if i < n { w[n * k + i] } else { v[k] });
            let sigma = Mat::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
                (true, true) => q[(i, j)],
                (false, false) => r,
                _ => s[i.min(j)],
            });
            let count = COUNT as f64;
            for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
                let mean = |lag: usize| {
                    let products = (lag..COUNT).map(|k| all[(i, k)] * all[(j, k - lag)]);
                    products.sum::<f64>() / count
                };
                let size = sigma[(i, i)] * sigma[(j, j)];
                let error = ((size + sigma[(i, j)].powi(2)) / count).sqrt();
                assert!((mean(0) - sigma[(i, j)]).abs() <= 4.5 * error, "{i} {j}");
                assert!(mean(1).abs() <= 4.5 * (size / count).sqrt(), "{i} {j}");
            }
            if n == 2 {
                use faer::linalg::solvers::Solve;
                let solved = sigma.partial_piv_lu().solve(&all);
                let pairs = all.col_iter().zip(solved.col_iter());
                let sum: f64 = pairs.map(|(x, y)| x.transpose() * y).sum();
                let degrees = count * (n + 1) as f64;
                assert!((sum - degrees).abs() < 4.5 * (2.0 * degrees).sqrt(), "{sum}");
            }
        }
    }

    /// q^2 I is the noise of deviation q in every state; states in units of powers of two have the same numbers.
    #[test]
    fn equal_states_and_other_units() {
        let square = mat![[0.09, 0.0], [0.0, 0.09]];
        let (w, _) = drawn(&StateNoise::new(square.as_ref(), None, None).unwrap(), 2);
        let mut plain = vec![0.0; 2 * COUNT];
        fill_white(&mut stream(7, 0, Purpose::ProcessNoise), 0.3, &mut plain);
        let same = |(x, y): (&f64, &f64)| (x - y).abs() <= 1e-15 * y.abs();
        assert!(w.iter().zip(&plain).all(same));
        let q = mat![[0.5, 0.1], [0.1, 0.3]];
        let of = |units: [f64; 2], of_y: f64| {
            let q = Mat::from_fn(2, 2, |i, j| q[(i, j)] * units[i] * units[j]);
            let s = [0.2 * units[0] * of_y, -0.1 * units[1] * of_y];
            let noise = StateNoise::new(q.as_ref(), Some(0.4 * of_y * of_y), Some(&s)).unwrap();
            drawn(&noise, 2).0
        };
        let plain = of([1.0; 2], 1.0);
        let scaled = of([2_f64.powi(40), 2_f64.powi(-33)], 2_f64.powi(20));
        for (x, y) in plain.chunks(2).zip(scaled.chunks(2)) {
            assert_eq!([x[0] * 2_f64.powi(40), x[1] * 2_f64.powi(-33)], [y[0], y[1]]);
        }
    }

    /// A matrix is refused in any units of the states, also where the fault is far smaller than its largest entry.
    #[test]
    fn refusals() {
        for units in [[1.0, 1.0], [1e9, 1e-9], [1e-6, 1e6]] {
            let of = |q: Mat<f64>, r: Option<f64>, s: Option<[f64; 2]>| {
                let q = Mat::from_fn(2, 2, |i, j| q[(i, j)] * units[i] * units[j]);
                let s = s.map(|s| [s[0] * units[0], s[1] * units[1]]);
                let made = StateNoise::new(q.as_ref(), r, s.as_ref().map(|s| &s[..]));
                made.map(|_| ()).map_err(|error| error.key())
            };
            assert_eq!(of(mat![[1.0, 1.0], [1.0, 1.0]], None, None), Ok(()));
            assert_eq!(of(mat![[0.0, 0.0], [0.0, 0.0]], None, None), Ok(()));
            assert_eq!(of(mat![[1.0, 1.001], [1.001, 1.0]], None, None), Err("Q"));
            assert_eq!(of(mat![[1.0, 0.5], [0.4, 1.0]], None, None), Err("Q"));
            assert_eq!(of(mat![[0.0, 0.1], [0.1, 1.0]], None, None), Err("Q"));
            assert_eq!(of(mat![[1.0, 0.0], [0.0, -1e-3]], None, None), Err("Q"));
            let q = || mat![[1.0, 0.2], [0.2, 1.0]];
            assert_eq!(of(q(), Some(0.0), None), Err("R"));
            assert_eq!(of(q(), None, Some([0.1, 0.0])), Err("S"));
            assert_eq!(of(q(), Some(1.0), Some([1.01, 0.0])), Err("S"));
            assert_eq!(of(q(), Some(1.0), Some([1.0, 0.2])), Ok(()));
            assert_eq!(of(q(), Some(1.0), Some([f64::NAN, 0.0])), Err("S"));
        }
    }

    /// As the variance of a long simulation's output would be: by `sum_k c'A^k Q A'^k c`.
    #[test]
    fn the_variance_of_the_output() {
        let plant = StateSpace::new(vec![-0.7, 1.5], vec![1.0, 2.0]).unwrap();
        let q = mat![[0.5, 0.1], [0.1, 0.3]];
        let noise = StateNoise::new(q.as_ref(), Some(0.4), Some(&[0.2, -0.1])).unwrap();
        let (mut row, mut sum) = (mat![[1.0, 0.0]], 0.0);
        for _ in 0..500 {
            sum += (&row * &q * row.transpose())[(0, 0)];
            row = &row * mat![[0.0, 1.0], [-0.7, 1.5]];
        }
        let found = noise.output_variance(&plant).unwrap();
        assert!((found / sum - 1.0).abs() < 1e-12, "{found} {sum}");
    }
}
