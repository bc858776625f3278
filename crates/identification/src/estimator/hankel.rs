//! The triangle R of a matrix of delayed signals, `H = Q R`, with which subspace methods begin.

use super::FailureKind;
use super::lag_sums::dot;
use super::solver::rank::{inverse_power_of_two, triangular_condition};
use super::solver::{Reduction, column};
use faer::{Mat, MatMut, MatRef, Side};

/// Columns of H: `signal(k + first + i)` in row k, i = 0 ... count-1, of which column `at` is the first; those after it
/// stand `step` columns apart.
#[derive(Clone, Copy)]
pub(super) struct Delays<'a> {
    pub(super) signal: &'a [f64],
    pub(super) first: usize,
    pub(super) count: usize,
    pub(super) at: usize,
    pub(super) step: isize,
}

impl<'a> Delays<'a> {
    /// Columns side by side.
    pub(super) fn new(signal: &'a [f64], first: usize, count: usize, at: usize) -> Self {
        Self {
            signal,
            first,
            count,
            at,
            step: 1,
        }
    }

    /// The same columns, with the latest signal first.
    pub(super) fn backwards(self) -> Self {
        Self {
            at: self.column(self.count - 1),
            step: -self.step,
            ..self
        }
    }

    fn column(&self, i: usize) -> usize {
        self.at.wrapping_add_signed(self.step * i as isize)
    }
}

/// Above this condition number R comes from H itself. Products square it: models keep some ten digits, those of moesp
/// and n4sid all.
const MOST: f64 = 2e4;

/// H, reduced to R: upper triangular with zeros below the diagonal.
pub(super) struct Hankel {
    r: Mat<f64>,
    /// The 1-norm condition number with u and y in their own units, where R comes from products.
    condition: Option<f64>,
}

impl Hankel {
    /// Reduces the `rows` rows of H: by the Cholesky factor of `H'H`, whose entries follow from few inner products, or
    /// where that would lose digits by Householder reflections.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if an entry overflows.
    pub(super) fn new(blocks: &[Delays<'_>], rows: usize) -> Result<Self, FailureKind> {
        let width = blocks.iter().map(|block| block.count).sum();
        if let Some(found) = Self::of_products(blocks, rows, width) {
            return Ok(found);
        }
        let mut reduction = Reduction::new(width, rows, 0);
        reduction.run(rows, |begin, mut z: MatMut<'_, f64>, _: MatMut<'_, f64>| {
            for block in blocks {
                for i in 0..block.count {
                    let to = column(&mut z, block.column(i));
                    to.copy_from_slice(&block.signal[block.first + i + begin..][..to.len()]);
                }
            }
        })?;
        Ok(Self {
            r: reduction.r().to_owned(),
            condition: None,
        })
    }

    fn of_products(blocks: &[Delays<'_>], rows: usize, width: usize) -> Option<Self> {
        let mut gram = Mat::zeros(width, width);
        for (p, a) in blocks.iter().enumerate() {
            for (q, b) in blocks[..=p].iter().enumerate() {
                products(a, b, p == q, rows, |i, j, value| {
                    gram[(a.column(i), b.column(j))] = value;
                    gram[(b.column(j), a.column(i))] = value;
                });
            }
        }
        let mut units = vec![0.0; width];
        for block in blocks {
            let squares = (0..block.count).map(|i| gram[(block.column(i), block.column(i))]);
            let largest = squares.fold(0.0, f64::max);
            // Squares of smaller numbers lose digits.
            if !(1e-200..1e200).contains(&largest) {
                return None;
            }
            (0..block.count).for_each(|i| units[block.column(i)] = inverse_power_of_two(largest.sqrt()));
        }
        let factor = gram.llt(Side::Lower).ok()?;
        let l = factor.L();
        let r = Mat::from_fn(width, width, |i, j| if i <= j { l[(j, i)] } else { 0.0 });
        let condition = triangular_condition(r.as_ref(), &units, &mut vec![0.0; width]).ok()?;
        (condition <= MOST).then_some(Self {
            r,
            condition: Some(condition),
        })
    }

    pub(super) fn r(&self) -> MatRef<'_, f64> {
        self.r.as_ref()
    }

    /// Whether every set of columns is independent, far from rounding.
    pub(super) fn is_well_conditioned(&self) -> bool {
        self.condition.is_some()
    }

    /// Returns a bound from below of the singular values of a well-conditioned R whose columns have one unit.
    pub(super) fn least_singular_value(&self) -> Option<f64> {
        let root = (self.r.ncols() as f64).sqrt();
        self.condition.map(|condition| self.r.norm_max() / (root * condition))
    }
}

/// Calls `put(i, j, sum_k a(k + i) b(k + j))` with the delays of two blocks, k = 0 ... rows-1. Only sums with the first
/// i or the first j are inner products; the others follow: `s(i+1, j+1) = s(i, j) - a(i) b(j) + a(i+rows) b(j+rows)`.
fn products(a: &Delays<'_>, b: &Delays<'_>, same: bool, rows: usize, mut put: impl FnMut(usize, usize, f64)) {
    let (x, y) = (&a.signal[a.first..], &b.signal[b.first..]);
    let mut diagonal = |i: usize, j: usize| {
        let mut sum = dot(&x[i..i + rows], &y[j..j + rows]);
        put(i, j, sum);
        for step in 1..(a.count - i).min(b.count - j) {
            let (i, j) = (i + step, j + step);
            sum += x[i - 1 + rows] * y[j - 1 + rows] - x[i - 1] * y[j - 1];
            put(i, j, sum);
        }
    };
    (0..b.count).for_each(|j| diagonal(0, j));
    if !same {
        (1..a.count).for_each(|i| diagonal(i, 0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::test_setup::normal;
    use crate::signal::Purpose;

    /// `R'R = H'H` for blocks that share a signal, run backwards or stand among another's columns, with a
    /// well-conditioned H and with one that is not.
    #[test]
    fn the_triangle_has_the_products_of_its_matrix() {
        let n = 300;
        let u = normal(5, 1, Purpose::Input, n);
        let noisy: Vec<f64> = normal(5, 1, Purpose::Plant, n)
            .iter()
            .zip(&u)
            .map(|(e, u)| 1e3 * u + 300.0 * e)
            .collect();
        let exact: Vec<f64> = (0..n)
            .map(|k| u[k] - if k > 0 { 0.5 * u[k - 1] } else { 0.0 })
            .collect();
        for (y, by_products) in [(&noisy, true), (&exact, false)] {
            let among = |signal, at| Delays {
                step: 2,
                ..Delays::new(signal, 2, 3, at)
            };
            let backwards = Delays::new(y, 0, 2, 6).backwards();
            let blocks = [among(&u, 0), among(y, 1), backwards, Delays::new(&u, 5, 2, 8)];
            let (rows, width) = (n - 9, 10);
            let triangle = Hankel::new(&blocks, rows).unwrap();
            assert_eq!(triangle.is_well_conditioned(), by_products);
            let mut h = Mat::zeros(rows, width);
            for block in &blocks {
                for i in 0..block.count {
                    for k in 0..rows {
                        h[(k, block.column(i))] = block.signal[k + block.first + i];
                    }
                }
            }
            let expected = h.transpose() * &h;
            let found = triangle.r().transpose() * triangle.r();
            for j in 0..width {
                for i in 0..width {
                    let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
                    assert!((found[(i, j)] - expected[(i, j)]).abs() < 1e-13 * size, "{i} {j}");
                }
            }
        }
        let alone = Hankel::new(&[Delays::new(&u, 0, 8, 0)], n - 7).unwrap();
        let values = alone.r().singular_values().unwrap();
        let bound = alone.least_singular_value().unwrap();
        assert!(bound < values[7] && bound > 0.01 * values[7]);
    }

    /// Squares that overflow or vanish are left to reflections.
    #[test]
    fn units_at_the_ends_of_the_numbers_are_reduced_too() {
        for unit in [1e-170, 1e160] {
            let u: Vec<f64> = normal(6, 1, Purpose::Input, 60).iter().map(|u| u * unit).collect();
            let triangle = Hankel::new(&[Delays::new(&u, 0, 3, 0)], 58).unwrap();
            assert!(!triangle.is_well_conditioned());
            assert!(triangle.r()[(0, 0)].abs() > unit);
        }
    }
}
