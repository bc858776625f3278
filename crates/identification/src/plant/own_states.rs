//! A discrete plant in states of its own, sampled or not, and the way to the canonical coordinates.

use super::balance::{balance, in_units, norm_1, power_of_two};
use super::observability::observability_matrix;
use super::{ContinuousPlant, StateSpace, eigenvalues, exponential, polynomial_from_poles};
use faer::{Mat, MatRef, Scale};

/// The plant `z(k+1) = A z(k) + b u(k)`, `y(k) = c'z(k)` in any coordinates z (n). The canonical state is `x = O z`, O
/// the observability matrix `c'; c'A; ...; c'A^(n-1)`: for `c'A^n = a'O` (Cayley and Hamilton).
#[derive(Clone, Debug)]
pub struct OwnStates {
    a: Mat<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    /// The matrix of z' = A z in continuous time, and the sampling time, of a plant that is sampled.
    sampled: Option<(Mat<f64>, f64)>,
}

impl OwnStates {
    /// Takes the matrices of a plant as those of one in discrete time.
    pub fn discrete(plant: &ContinuousPlant) -> Self {
        Self {
            a: plant.a().to_owned(),
            b: plant.b().to_vec(),
            c: plant.c().to_vec(),
            sampled: None,
        }
    }

    /// Samples a plant in continuous time every `interval` seconds, u being held between the samples: `A_d = e^(A T)`,
    /// `b_d = int_0^T e^(A t) dt B`.
    pub fn sampled(plant: &ContinuousPlant, interval: f64) -> Self {
        let (n, b) = (plant.order(), plant.b());
        let with_input = Mat::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
            (true, true) => plant.a()[(i, j)] * interval,
            (true, false) => b[i] * interval,
            (false, _) => 0.0,
        });
        let all = exponential(with_input.as_ref());
        Self {
            a: all.submatrix(0, 0, n, n).to_owned(),
            b: (0..n).map(|i| all[(i, n)]).collect(),
            c: plant.c().to_vec(),
            sampled: Some((plant.a().to_owned(), interval)),
        }
    }

    /// Returns b, n numbers.
    pub fn b(&self) -> &[f64] {
        &self.b
    }

    /// Returns O, n x n.
    pub fn to_canonical(&self) -> Mat<f64> {
        observability_matrix(&self.a, &self.c)
    }

    /// Returns the canonical plant: a from the eigenvalues of A, and `b = O b`. `None` if a number is not finite.
    pub fn canonical(&self) -> Option<StateSpace> {
        let rest = polynomial_from_poles(&eigenvalues(self.a.as_ref())?);
        let a = rest.iter().rev().map(|x| -x.re).collect();
        let o = self.to_canonical();
        let b = o.row_iter().map(|row| {
            let pairs = row.iter().zip(&self.b);
            pairs.map(|(o, b)| o * b).sum()
        });
        StateSpace::new(a, b.collect()).ok()
    }

    /// Returns the covariance of w(k) in z (n x n) for white noise in z: Q itself, or, of a plant that is sampled, Van
    /// Loan's integral of the intensity Q ([`sampled_noise`]).
    pub fn noise(&self, q: MatRef<'_, f64>) -> Mat<f64> {
        match &self.sampled {
            None => q.to_owned(),
            Some((a, interval)) => sampled_noise(a.as_ref(), q, *interval),
        }
    }
}

/// Returns `int_0^T e^(A t) Q e^(A't) dt` (n x n), the covariance of white noise of intensity Q after a sampling time
/// T, exactly symmetric.
///
/// `exp([-A, Q; 0, A'] h) = [., G; 0, F']` has `F G`, the integral over h (C. F. Van Loan, Computing integrals
/// involving the matrix exponential, IEEE Trans. Automatic Control 23 (1978) 395-404). The first block grows as fast as
/// the plant decays, so h is T / 2^k with a norm of `A h` below 1, in units of the states in which A is balanced; then
/// the integral over 2h is that over h plus `F (.) F'`, which rounds nothing away.
///
/// # Panics
/// If A and Q are not square and of one size.
pub fn sampled_noise(a: MatRef<'_, f64>, q: MatRef<'_, f64>, interval: f64) -> Mat<f64> {
    let n = a.nrows();
    assert!(a.shape() == (n, n) && q.shape() == (n, n));
    let units = balance(a);
    let own = Scale(interval) * in_units(a, &units);
    let noise = Mat::from_fn(n, n, |i, j| q[(i, j)] / units[i] / units[j] * interval);
    let size = power_of_two(norm_1(noise.as_ref()));
    let norm = norm_1(own.as_ref());
    let doublings = if norm.is_finite() {
        norm.log2().ceil().max(0.0) as i32
    } else {
        0
    };
    let part = 0.5_f64.powi(doublings);
    let block = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => -own[(i, j)] * part,
        (true, false) => noise[(i, j - n)] / size * part,
        (false, true) => 0.0,
        (false, false) => own[(j - n, i - n)] * part,
    });
    let all = exponential(block.as_ref());
    let mut f = all.submatrix(n, n, n, n).transpose().to_owned();
    let mut sum = &f * all.submatrix(0, n, n, n);
    for _ in 0..doublings {
        sum += &f * &sum * f.transpose();
        f = &f * &f;
    }
    Mat::from_fn(n, n, |i, j| {
        0.5 * (sum[(i, j)] + sum[(j, i)]) * size * units[i] * units[j]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;

    /// mpmath 1.3, 40 digits: `quad(lambda t: (expm(A t) Q expm(A t).T)[i, j], linspace(0, T, 9))`: a lightly damped
    /// pair, a motor, a double integrator, and a stiff plant with an unstable mode, whose exp(-A T) is 1e86. In other
    /// units of the states too.
    #[test]
    fn van_loans_integral_as_mpmath() {
        let cases = [
            (
                mat![[0.0, 1.0], [-4.0, -0.4]],
                mat![[0.3, 0.1], [0.1, 0.5]],
                0.5,
                mat![
                    [0.1423370878619096, -0.04337880940530615],
                    [-0.04337880940530615, 0.23652439642526295]
                ],
            ),
            (
                mat![[-1.0, 100.0], [-0.2, -50.0]],
                mat![[0.0, 0.0], [0.0, 2.0]],
                0.01,
                mat![
                    [0.004621547021313557, 0.006168219427210576],
                    [0.006168219427210576, 0.012635169433201997]
                ],
            ),
            (
                mat![[0.0, 1.0], [0.0, 0.0]],
                mat![[0.0, 0.0], [0.0, 1.0]],
                2.0,
                mat![[8.0 / 3.0, 2.0], [2.0, 2.0]],
            ),
            (
                mat![[-200.0, 1.0, 0.0], [0.0, -1.0, 3.0], [0.0, 0.0, 0.5]],
                mat![[1.0, 0.2, 0.0], [0.2, 2.0, 0.1], [0.0, 0.1, 0.5]],
                1.0,
                mat![
                    [0.002558384253387749, 0.011723258028146473, 0.0050086346068872807],
                    [0.011723258028146473, 2.159980897023148, 1.0100370159417854],
                    [0.0050086346068872807, 1.0100370159417854, 0.8591409142295227]
                ],
            ),
        ];
        for (a, q, interval, exact) in cases {
            let n = a.nrows();
            for units in [[1.0; 3], [1.0, 1024.0, 1e-3], [1e-9, 1.0, 1e9]] {
                let own = Mat::from_fn(n, n, |i, j| a[(i, j)] * units[i] / units[j]);
                let noise = Mat::from_fn(n, n, |i, j| q[(i, j)] * units[i] * units[j]);
                let found = sampled_noise(own.as_ref(), noise.as_ref(), interval);
                for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                    let size = f64::sqrt(exact[(i, i)] * exact[(j, j)]);
                    let error = found[(i, j)] / units[i] / units[j] - exact[(i, j)];
                    assert!(error.abs() < 1e-12 * size, "{units:?} {a:?}: {error:e}");
                    assert_eq!(found[(i, j)], found[(j, i)]);
                }
            }
        }
    }

    /// `scipy.signal.cont2discrete` of 104 / (s^2 + 4 s + 104) at 0.05 s, in states of its own; and the canonical state
    /// O z follows z.
    #[test]
    fn the_canonical_plant_of_own_states() {
        let a = [vec![0.0, 1.0], vec![-104.0, -4.0]];
        let plant = ContinuousPlant::new(&a, vec![0.0, 104.0], vec![1.0, 0.0]).unwrap();
        let own = OwnStates::sampled(&plant, 0.05);
        let canonical = own.canonical().unwrap();
        let expected = [
            -0.8187307530779823,
            1.5881390788285354,
            0.1191700272875067,
            0.11142164696194001,
        ];
        let found = [canonical.a(), &canonical.h()].concat();
        for (x, y) in found.iter().zip(expected) {
            assert!((x - y).abs() < 1e-14, "{found:?}");
        }
        let (o, mut z) = (own.to_canonical(), mat![[0.3], [-2.0]]);
        let mut x: Vec<f64> = (&o * &z).col_as_slice(0).to_vec();
        for k in 0..20 {
            let u = f64::from(k % 3) - 1.0;
            z = &own.a * &z + Mat::from_fn(2, 1, |i, _| own.b[i] * u);
            let next = [
                x[1] + canonical.b()[0] * u,
                canonical.a()[0] * x[0] + canonical.a()[1] * x[1] + canonical.b()[1] * u,
            ];
            x.copy_from_slice(&next);
            let expected = &o * &z;
            for i in 0..2 {
                assert!((x[i] - expected[(i, 0)]).abs() < 1e-13, "{k}");
            }
        }
    }
}
