//! Units of states in which a matrix is balanced, and systems of equations in units of their own.
//!
//! Units of states are powers of two, so that a change of units rounds nothing.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatRef, c64};

/// Sweeps over all states end here at the latest; few are needed.
const SWEEPS: usize = 100;

/// Returns the largest power of two that is at most |x|; 1 for 0, and for what is not finite.
pub(crate) fn power_of_two(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    if x == 0.0 || !x.is_finite() {
        return 1.0;
    }
    f64::from_bits(x.abs().max(f64::MIN_POSITIVE).to_bits() & EXPONENT)
}

/// Returns the largest column sum of sizes, the 1-norm; NaN if an entry is.
pub(crate) fn norm_1(a: MatRef<'_, f64>) -> f64 {
    let columns = a.col_iter().map(|column| column.iter().map(|x| x.abs()));
    columns.map(Iterator::sum).fold(0.0, |most: f64, sum: f64| {
        // `max` would drop a NaN.
        if most.is_nan() || sum <= most { most } else { sum }
    })
}

/// Returns `D^-1 A D`, D the diagonal matrix of the units: A (n x n) in these units of the states.
pub(crate) fn in_units(a: MatRef<'_, f64>, units: &[f64]) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * (units[j] / units[i]))
}

/// Returns the 1-norm of the balanced A (n x n) as a power of two, 1 if that is 0: a rate of the plant's own, in which
/// time may be counted.
pub(crate) fn own_rate(a: MatRef<'_, f64>) -> f64 {
    power_of_two(norm_1(in_units(a, &balance(a)).as_ref()))
}

/// Returns a unit for each state, powers of two, in which the rows of A (n x n) are of about the sizes of its columns:
/// those of `D^-1 A D` have 2-norms within a factor of two, as far as that makes both together smaller by 5 %. The
/// matrix of a plant that is balanced already, or that is in other units, becomes about the same one. A state that
/// drives no other, or that none drives, takes a unit in which it does not enlarge the norm.
///
/// All units are 1 if that has the smaller 1-norm, and if an entry is not finite.
///
/// Source: R. James, J. Langou, B. R. Lowery, On matrix balancing and eigenvector computation, arXiv 1401.5766 (2014),
/// Algorithm 3, after B. N. Parlett and C. Reinsch, Numer. Math. 13 (1969) 293-304, whose 1-norms without the diagonal
/// may make eigenvalues worse.
pub fn balance(a: MatRef<'_, f64>) -> Vec<f64> {
    let n = a.nrows();
    let mut units = vec![1.0; n];
    if !a.is_all_finite() {
        return units;
    }
    let mut scaled = a.to_owned();
    let pairs = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)));
    let cycles = pairs.map(|(i, j)| a[(i, j)].abs().sqrt() * a[(j, i)].abs().sqrt());
    let cycle = cycles.fold(0.0, f64::max);
    let size = if cycle > 0.0 { cycle } else { 1.0 };
    for _ in 0..SWEEPS {
        let mut settled = true;
        for i in 0..n {
            let factor = factor(&scaled, i, size);
            // Units stay far from the ends of the numbers.
            let unit = units[i] * factor;
            if factor == 1.0 || !(unit.log2().abs() < 400.0) {
                continue;
            }
            settled = false;
            units[i] = unit;
            for j in (0..n).filter(|j| *j != i) {
                scaled[(j, i)] *= factor;
                scaled[(i, j)] /= factor;
            }
        }
        if settled {
            break;
        }
    }
    if norm_1(scaled.as_ref()) <= norm_1(a) {
        units
    } else {
        vec![1.0; n]
    }
}

/// Returns the power of two by which the unit of a state grows. The state alone is compared with `size`.
fn factor(a: &Mat<f64>, i: usize, size: f64) -> f64 {
    let n = a.nrows();
    let others = || (0..n).filter(|j| *j != i);
    let column = length(others().map(|j| a[(j, i)]));
    let row = length(others().map(|j| a[(i, j)]));
    if column == 0.0 || row == 0.0 {
        let most = column.max(row);
        let excess = if most > size {
            power_of_two(most / size) * 2.0
        } else {
            1.0
        };
        return if column == 0.0 { excess } else { 1.0 / excess };
    }
    let own = a[(i, i)];
    let (mut column, mut row) = (length([column, own]), length([row, own]));
    let before = column + row;
    let mut factor = 1.0;
    while column < row / 2.0 {
        (column, row, factor) = (2.0 * column, row / 2.0, 2.0 * factor);
    }
    while row <= column / 2.0 {
        (column, row, factor) = (column / 2.0, 2.0 * row, factor / 2.0);
    }
    if column + row < 0.95 * before { factor } else { 1.0 }
}

/// Returns the 2-norm, whose squares neither overflow nor vanish.
fn length(numbers: impl IntoIterator<Item = f64> + Clone) -> f64 {
    let largest = numbers.clone().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let unit = power_of_two(largest);
    let squares = numbers.into_iter().map(|x| (x / unit) * (x / unit));
    unit * squares.sum::<f64>().sqrt()
}

/// Returns the eigenvalues of a square matrix in the units of [`balance`], so that they are as exact in any units of
/// the states. `None` if an entry is not finite or the iteration does not converge.
pub fn eigenvalues(a: MatRef<'_, f64>) -> Option<Vec<c64>> {
    if !a.is_all_finite() {
        return None;
    }
    in_units(a, &balance(a)).eigenvalues().ok()
}

/// A square system of equations `M x = b` in units of its unknowns and equations in which the largest number of each
/// row is 1, after that of each column was.
pub(crate) struct Equilibrated {
    lu: PartialPivLu<f64>,
    rows: Vec<f64>,
    columns: Vec<f64>,
    condition: f64,
}

impl Equilibrated {
    /// Factorises M (n x n).
    pub(crate) fn new(m: MatRef<'_, f64>) -> Self {
        let n = m.nrows();
        let columns = column_sizes(m);
        let within = Mat::from_fn(n, n, |i, j| m[(i, j)] / columns[j]);
        let rows = column_sizes(within.transpose());
        let scaled = Mat::from_fn(n, n, |i, j| within[(i, j)] / rows[i]);
        let lu = scaled.partial_piv_lu();
        let inverse = lu.solve(Mat::<f64>::identity(n, n));
        Self {
            condition: norm_1(scaled.as_ref()) * norm_1(inverse.as_ref()),
            lu,
            rows,
            columns,
        }
    }

    /// Returns the condition number (1-norm) in these units; infinite or NaN if M is singular.
    pub(crate) fn condition(&self) -> f64 {
        self.condition
    }

    /// Returns the solution for each column of B.
    pub(crate) fn solve(&self, b: MatRef<'_, f64>) -> Mat<f64> {
        let (rows, columns) = (&self.rows, &self.columns);
        let scaled = Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / rows[i]);
        let found = self.lu.solve(&scaled);
        Mat::from_fn(b.nrows(), b.ncols(), |i, j| found[(i, j)] / columns[i])
    }
}

/// Returns the size of the largest number of each column; 1 for a column of zeros.
pub(crate) fn column_sizes(m: MatRef<'_, f64>) -> Vec<f64> {
    let largest = |j: usize| (0..m.nrows()).fold(0.0, |most: f64, i| most.max(m[(i, j)].abs()));
    let sizes = (0..m.ncols()).map(largest);
    sizes.map(|size| if size > 0.0 { size } else { 1.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;

    #[test]
    fn powers_of_two() {
        for (x, unit) in [(1.0, 1.0), (-3.9, 2.0), (4.0, 4.0), (0.3, 0.25), (0.0, 1.0)] {
            assert_eq!(power_of_two(x), unit);
        }
        assert_eq!(power_of_two(f64::NAN), 1.0);
        assert_eq!(power_of_two(f64::MAX), 2_f64.powi(1023));
        assert_eq!(power_of_two(1e-320), f64::MIN_POSITIVE);
    }

    /// Moler's matrix, MathWorks' "A balancing act for the matrix exponential" (2012): its 1-norm of 2e10 becomes about
    /// the geometric mean of its cycle, `(66.7 * 2e10 * 1e-8)^(1/3)` and more for its diagonal.
    #[test]
    fn a_badly_scaled_matrix() {
        let a = mat![
            [0.0, 1e-8, 0.0],
            [-(2e10 + 4e8 / 6.0), -3.0, 2e10],
            [200.0 / 3.0, 0.0, -200.0 / 3.0]
        ];
        assert!(norm_1(in_units(a.as_ref(), &balance(a.as_ref())).as_ref()) < 300.0);
    }

    /// Chains, whose first state drives none and whose last one is driven by none.
    #[test]
    fn states_at_the_ends_of_chains() {
        let a = mat![[0.0, 1e12, 0.0], [0.0, 0.0, 1e15], [0.0, 0.0, 0.0]];
        assert!(norm_1(in_units(a.as_ref(), &balance(a.as_ref())).as_ref()) <= 2.0);
        let a = mat![[-3.0, 1e9], [0.0, -5.0]];
        assert!(norm_1(in_units(a.as_ref(), &balance(a.as_ref())).as_ref()) <= 10.0);
        assert_eq!(balance(mat![[f64::NAN]].as_ref()), [1.0]);
        assert!(balance(Mat::<f64>::zeros(0, 0).as_ref()).is_empty());
    }

    /// A motor with its current in pA under a filter with poles at -100, -10.05 and -200.
    #[test]
    fn eigenvalues_in_other_units() {
        let closed = mat![[-100.0, 1.0, 0.0], [0.0, -10.0, 1e-12], [0.0, -1e10, -200.0]];
        let mut poles = eigenvalues(closed.as_ref()).unwrap();
        poles.sort_by(|p, q| p.re.total_cmp(&q.re));
        // (s + 10) (s + 200) + 0.01 = 0
        let root = (95.0_f64.powi(2) - 0.01).sqrt();
        for (pole, exact) in poles.iter().zip([-105.0 - root, -100.0, -105.0 + root]) {
            assert!((pole - exact).norm() < 1e-12 * 200.0, "{poles:?}");
        }
        assert_eq!(eigenvalues(mat![[f64::INFINITY]].as_ref()), None);
    }

    /// Equations and unknowns in units from 1e-140 to 1e120 have the condition of the matrix itself.
    #[test]
    fn equations_in_other_units() {
        let m = mat![[2.0, 1.0], [1.0, 3.0]];
        let (rows, columns) = ([1e-100, 1e50], [1e120, 1e-140]);
        let scaled = Mat::from_fn(2, 2, |i, j| m[(i, j)] * rows[i] * columns[j]);
        let found = Equilibrated::new(scaled.as_ref());
        assert!(found.condition() < 20.0);
        // x = (1, 2) in the matrix' own units.
        let b = Mat::from_fn(2, 1, |i, _| [4.0, 7.0][i] * rows[i]);
        let x = found.solve(b.as_ref());
        for i in 0..2 {
            assert!((x[(i, 0)] * columns[i] - (1.0 + i as f64)).abs() < 1e-14);
        }
        assert!(!(Equilibrated::new(mat![[1.0, 2.0], [2.0, 4.0]].as_ref()).condition() < 1e15));
    }
}
