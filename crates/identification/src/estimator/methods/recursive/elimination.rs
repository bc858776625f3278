//! Linear equations of a few unknowns, whatever the units of their rows and columns.

/// Gaussian elimination with scaled partial pivoting: the pivot of a column is the number that is largest beside its row,
/// all columns having been brought to the same size. So a change of units by powers of two changes no bit but exponents.
#[derive(Clone, Debug)]
pub(super) struct Elimination {
    matrix: Vec<f64>,
    /// 1 over the largest number of each column, and of each row after that.
    columns: Vec<f64>,
    rows: Vec<f64>,
}

impl Elimination {
    /// For at most d unknowns.
    pub(super) fn new(d: usize) -> Self {
        Self {
            matrix: vec![0.0; d * d],
            columns: vec![0.0; d],
            rows: vec![0.0; d],
        }
    }

    /// Solves `matrix X = right` of d unknowns in place: both row by row, X with as many columns as fit. A singular matrix
    /// leaves numbers that are not finite.
    pub(super) fn solve(&mut self, d: usize, matrix: &[f64], right: &mut [f64]) {
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
