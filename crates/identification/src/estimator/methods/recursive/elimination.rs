//! Linear equations of a few unknowns, whatever the units of their rows and columns.

/// Numbers of a row that are computed side by side.
const LANES: usize = 4;
type Lanes = [f64; LANES];

/// Up to so many groups of lanes hold few unknowns.
const MOST_GROUPS: usize = 4;

/// Gaussian elimination with scaled partial pivoting: the pivot of a column is the number that is largest beside its
/// row, all columns having been brought to the same size. So a change of units by powers of two changes no bit but
/// exponents.
#[derive(Clone, Debug)]
pub(crate) struct Elimination {
    matrix: Vec<f64>,
    /// 1 over the largest number of each column, and of each row after that.
    columns: Vec<f64>,
    rows: Vec<f64>,
    /// The rows of `[matrix | right]` of few unknowns, with zeros to whole lanes.
    few: Vec<Lanes>,
}

impl Elimination {
    /// For at most d unknowns.
    pub(crate) fn new(d: usize) -> Self {
        Self {
            matrix: vec![0.0; d * d],
            columns: vec![0.0; d],
            rows: vec![0.0; d],
            few: vec![[0.0; LANES]; MOST_GROUPS * MOST_GROUPS * LANES],
        }
    }

    /// Solves `matrix X = right` of d unknowns in place: both row by row, X with as many columns as fit. A singular
    /// matrix leaves numbers that are not finite.
    pub(crate) fn solve(&mut self, d: usize, matrix: &[f64], right: &mut [f64]) {
        let Self { few, rows, .. } = self;
        let groups = if right.len() == d { (d + 1).div_ceil(LANES) } else { 0 };
        with_fma!(|| match groups {
            1 => solve_few::<1>(few, rows, matrix, right),
            2 => solve_few::<2>(few, rows, matrix, right),
            3 => solve_few::<3>(few, rows, matrix, right),
            MOST_GROUPS => solve_few::<MOST_GROUPS>(few, rows, matrix, right),
            _ => {}
        });
        if !(1..=MOST_GROUPS).contains(&groups) {
            self.solve_many(d, matrix, right);
        }
    }

    /// Does the same for any number of unknowns and right-hand sides.
    fn solve_many(&mut self, d: usize, matrix: &[f64], right: &mut [f64]) {
        let width = right.len() / d;
        self.matrix[..d * d].copy_from_slice(matrix);
        self.measure(d);
        for j in 0..d {
            self.exchange(d, j, right);
            let (above, below) = self.matrix[..d * d].split_at_mut((j + 1) * d);
            let pivot = &above[j * d..];
            let (solved, rest) = right.split_at_mut((j + 1) * width);
            let of_pivot = &solved[j * width..];
            for (row, of_row) in below.chunks_exact_mut(d).zip(rest.chunks_exact_mut(width)) {
                let factor = row[j] / pivot[j];
                subtract(&mut row[j..], factor, &pivot[j..]);
                subtract(of_row, factor, of_pivot);
            }
        }
        for i in (0..d).rev() {
            let row = &self.matrix[i * d..][..d];
            let (unknown, known) = right[i * width..].split_at_mut(width);
            for (factor, of_row) in row[i + 1..].iter().zip(known.chunks_exact(width)) {
                subtract(unknown, *factor, of_row);
            }
            for x in unknown {
                *x /= row[i];
            }
        }
    }

    fn measure(&mut self, d: usize) {
        let largest = |numbers: &mut dyn Iterator<Item = f64>| numbers.fold(0.0, f64::max).recip();
        for (j, column) in self.columns[..d].iter_mut().enumerate() {
            *column = largest(&mut (0..d).map(|i| self.matrix[i * d + j].abs()));
        }
        let rows = self.matrix[..d * d].chunks_exact(d);
        for (scale, row) in self.rows.iter_mut().zip(rows) {
            *scale = largest(&mut row.iter().zip(&self.columns).map(|(x, s)| x.abs() * s));
        }
    }

    /// Brings the pivot of column j to row j.
    fn exchange(&mut self, d: usize, j: usize, right: &mut [f64]) {
        let width = right.len() / d;
        let size = |i: &usize| self.matrix[i * d + j].abs() * self.rows[*i];
        let best = (j..d).max_by(|a, b| size(a).total_cmp(&size(b)));
        let Some(best) = best.filter(|best| *best > j) else {
            return;
        };
        self.rows.swap(j, best);
        (0..d).for_each(|i| self.matrix.swap(j * d + i, best * d + i));
        (0..width).for_each(|i| right.swap(j * width + i, best * width + i));
    }
}

fn subtract(from: &mut [f64], factor: f64, of: &[f64]) {
    for (x, y) in from.iter_mut().zip(of) {
        *x -= factor * y;
    }
}

/// [`Elimination::solve_many`] of few unknowns and one right-hand side, whose rows are in G groups of lanes; the
/// same bits.
#[inline(always)]
fn solve_few<const G: usize>(few: &mut [Lanes], scales: &mut [f64], matrix: &[f64], right: &mut [f64]) {
    let d = right.len();
    let (rows, scales) = (&mut few.as_chunks_mut::<G>().0[..d], &mut scales[..d]);
    for ((row, left), right) in rows.iter_mut().zip(matrix.chunks_exact(d)).zip(&*right) {
        let row = row.as_flattened_mut();
        row[..d].copy_from_slice(left);
        row[d] = *right;
        row[d + 1..].fill(0.0);
    }
    measure_few(rows, scales);
    for j in 0..d {
        let (group, lane) = (j / LANES, j % LANES);
        let best = pivot_of(rows, scales, j);
        if best > j {
            scales.swap(j, best);
            rows.swap(j, best);
        }
        let (above, below) = rows.split_at_mut(j + 1);
        let pivot = &above[j];
        for row in below {
            let factor = row[group][lane] / pivot[group][lane];
            // Columns before j are not read again.
            for g in group..G {
                for l in 0..LANES {
                    row[g][l] -= factor * pivot[g][l];
                }
            }
        }
    }
    for i in (0..d).rev() {
        let row = rows[i].as_flattened();
        let (known, mut x) = (&right[i + 1..], row[d]);
        for (factor, known) in row[i + 1..d].iter().zip(known) {
            x -= factor * known;
        }
        right[i] = x / row[i];
    }
}

/// The larger number; `of` where x is not a number.
#[inline(always)]
fn larger(of: f64, x: f64) -> f64 {
    if x > of { x } else { of }
}

/// [`Elimination::measure`]; what is beside the matrix has columns of no size.
#[inline(always)]
fn measure_few<const G: usize>(rows: &[[Lanes; G]], scales: &mut [f64]) {
    let mut columns = [[0.0; LANES]; G];
    for row in rows {
        for g in 0..G {
            for l in 0..LANES {
                columns[g][l] = larger(columns[g][l], row[g][l].abs());
            }
        }
    }
    for largest in columns.as_flattened_mut() {
        *largest = largest.recip();
    }
    columns.as_flattened_mut()[rows.len()..].fill(0.0);
    for (row, scale) in rows.iter().zip(scales) {
        let mut most = [0.0; LANES];
        for g in 0..G {
            for l in 0..LANES {
                most[l] = larger(most[l], row[g][l].abs() * columns[g][l]);
            }
        }
        *scale = most.into_iter().fold(0.0, larger).recip();
    }
}

/// The row of the pivot of column j, by the order of [`f64::total_cmp`] without branches.
#[inline(always)]
fn pivot_of<const G: usize>(rows: &[[Lanes; G]], scales: &[f64], j: usize) -> usize {
    let size = |i: usize| {
        let size = rows[i][j / LANES][j % LANES].abs() * scales[i];
        let bits = size.to_bits() as i64;
        bits ^ ((bits >> 63) as u64 >> 1) as i64
    };
    let (mut best, mut largest) = (j, size(j));
    for i in j + 1..rows.len() {
        let size = size(i);
        let is_larger = size >= largest;
        best = if is_larger { i } else { best };
        largest = if is_larger { size } else { largest };
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Purpose, stream};
    use rand::Rng as _;

    /// Few unknowns have the bits of any number, whatever the units, with zeros and singular matrices too.
    #[test]
    fn few_unknowns_have_the_bits_of_many() {
        let mut random = stream(11, 0, Purpose::Plant);
        let mut uniform = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
        for d in 1..=18 {
            let mut elimination = Elimination::new(d);
            for trial in 0..200 {
                let sizes: Vec<f64> = (0..d).map(|_| 10_f64.powf(4.0 * uniform())).collect();
                let zeros = if trial % 5 == 0 { 0.5 } else { 2.0 };
                let matrix: Vec<f64> = (0..d * d)
                    .map(|at| {
                        let x = uniform();
                        let x = if x.abs() > zeros { 0.0 } else { x };
                        x * sizes[at / d] * if trial % 2 == 0 { sizes[at % d] } else { 1.0 }
                    })
                    .collect();
                let mut found: Vec<f64> = (0..d).map(|_| uniform()).collect();
                let mut expected = found.clone();
                elimination.solve(d, &matrix, &mut found);
                elimination.solve_many(d, &matrix, &mut expected);
                let same = |(x, y): (&f64, &f64)| x.to_bits() == y.to_bits() || x.is_nan() && y.is_nan();
                assert!(found.iter().zip(&expected).all(same), "{matrix:?}");
            }
        }
    }
}
