//! Pole placement for an observer of any observable pair (A, C), also in continuous time: Ackermann's formula. The
//! paper's own gain, for the canonical form, is in `pole_placement.rs`.

use super::pole_placement::{Gain, GainError, Poles};
use crate::plant::{Equilibrated, Observability};
use faer::{Mat, MatRef, c64};
use std::f64::consts::PI;

/// Returns L (n numbers) such that `A - L C'` has the characteristic polynomial phi of the poles (Ackermann 1972):
/// `L = phi(A) O^-1 (0, ..., 0, 1)'`. The observability matrix O has the rows `C'A^i`, i = 0 ... n-1. A is n x n, C has
/// length n. Meant for continuous-time plants with few states: the condition number of O limits the order. Time is
/// measured by the fastest eigenvalue of A, and columns and rows of O in units of their own sizes, so that neither the
/// result nor the limit depends on the units of time, of the states and of y.
///
/// # Errors
/// [`GainError::Count`] if there are not n poles; [`GainError::Observability`] if O in these units has a condition
/// number (1-norm) above 1e9, so that less than half of the digits of L would be right.
pub fn place(a: MatRef<'_, f64>, c: &[f64], poles: &Poles) -> Result<Vec<f64>, GainError> {
    let n = a.nrows();
    if poles.len() != n {
        return Err(GainError::Count(poles.len(), n));
    }
    let Observability { rate, a, matrix } = Observability::new(a, c);
    let observability = Equilibrated::new(matrix.as_ref());
    let condition = observability.condition();
    if !(condition <= LARGEST_CONDITION) {
        return Err(GainError::Observability(condition));
    }
    let last = Mat::from_fn(n, 1, |i, _| if i + 1 == n { 1.0 } else { 0.0 });
    let q = observability.solve(last.as_ref());
    // Horner: phi(A) q = A (... A (A q + phi_1 q) + ...) + phi_n q, with the poles in the same unit of time.
    let (mut gain, mut unit) = (q.clone(), 1.0);
    for phi in poles.polynomial() {
        unit *= rate;
        gain = &a * &gain + faer::Scale(*phi / unit) * &q;
    }
    Ok((0..n).map(|i| gain[(i, 0)] * rate).collect())
}

/// The largest condition number of an observability matrix from which poles are placed.
const LARGEST_CONDITION: f64 = 1e9;

/// Parses a list of poles such as "-1+2i,-1-2i".
///
/// # Errors
/// If an entry is not a number or a complex pole lacks its conjugate.
pub fn parse_poles(list: &str) -> Result<Poles, GainError> {
    match format!("poles:{list}").parse()? {
        Gain::Poles(poles) => Ok(poles),
        Gain::DeadBeat | Gain::Scaled(_) => Err(GainError::Form(list.to_owned())),
    }
}

/// Returns n poles evenly spread on the left half of the circle with this radius (rad/s): those of a Butterworth
/// filter.
pub fn butterworth(n: usize, radius: f64) -> Poles {
    let pole = |i: usize| {
        let angle = PI * (2 * i + n + 1) as f64 / (2 * n) as f64;
        c64::new(radius * angle.cos(), radius * angle.sin())
    };
    // Conjugates are made from the same numbers, and the pole in the middle is real.
    let poles = (0..n).map(|i| match (2 * i + 1).cmp(&n) {
        std::cmp::Ordering::Less => pole(i),
        std::cmp::Ordering::Equal => c64::new(-radius, 0.0),
        std::cmp::Ordering::Greater => pole(n - 1 - i).conj(),
    });
    Poles::new(poles.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The eigenvalues of A - L C' are where they were asked for.
    #[test]
    fn poles_are_placed() {
        for n in 1..=4 {
            let a = Mat::from_fn(n, n, |i, j| ((3 * i + 7 * j) % 5) as f64 - 1.5 - f64::from(i == j));
            let c: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * i as f64).collect();
            let gain = place(a.as_ref(), &c, &butterworth(n, 3.0)).unwrap();
            let closed = Mat::from_fn(n, n, |i, j| a[(i, j)] - gain[i] * c[j]);
            for pole in closed.eigenvalues().unwrap() {
                assert!((pole.norm() - 3.0).abs() < 1e-9 && pole.re < 0.0, "{n}: {pole}");
            }
        }
    }

    /// Of twelve lags side by side, whose observability matrix is Vandermonde's, less than half of the digits of L
    /// would be right. The condition is the same in any units of states and time.
    #[test]
    fn ill_conditioned_placement_is_refused() {
        let n = 12;
        let condition = |unit: f64, rate: f64| {
            let lag = |i: usize| -rate * (i as f64 + 1.0);
            let a = Mat::from_fn(n, n, |i, j| if i == j { lag(i) } else { 0.0 });
            let c: Vec<f64> = (0..n).map(|i| unit.powi(i as i32)).collect();
            match place(a.as_ref(), &c, &butterworth(n, 3.0 * rate)) {
                Err(GainError::Observability(condition)) => condition,
                other => panic!("{other:?}"),
            }
        };
        let own = condition(1.0, 1.0);
        assert!(own > 1e9);
        for (unit, rate) in [(1e-3, 1.0), (8.0, 1.0), (1.0, 1e9), (10.0, 1e-7)] {
            assert!((condition(unit, rate) / own - 1.0).abs() < 1e-3);
        }
    }

    /// The double integrator by hand: phi = s^2 + 2 s + 5, L = (2, 5).
    #[test]
    fn the_double_integrator() {
        let a = Mat::from_fn(2, 2, |i, j| if (i, j) == (0, 1) { 1.0 } else { 0.0 });
        let poles = parse_poles("-1+2i,-1-2i").unwrap();
        let gain = place(a.as_ref(), &[1.0, 0.0], &poles).unwrap();
        assert!((gain[0] - 2.0).abs() < 1e-14 && (gain[1] - 5.0).abs() < 1e-14);
        assert_eq!(
            place(a.as_ref(), &[1.0, 0.0], &butterworth(3, 1.0)),
            Err(GainError::Count(3, 2))
        );
        assert!(parse_poles("-1+2i").is_err());
    }
}
