//! Coefficients of an output compared with the truth: a column for the signed error of each of
//! `a_1 ... a_n, h_1 ... h_n`. With `coverage = true` there are also columns for the standard errors and for both ends
//! of the 95 % intervals of the error.

use crate::design::Cell;
use crate::design::file::ExperimentFile;
use asobench_identification::data::Realisation;
use asobench_identification::estimator::{Pass, Progress};
use asobench_identification::metric::Z;

/// Returns how many columns a file needs for an output of order n.
pub(crate) fn columns(file: &ExperimentFile, order: usize) -> usize {
    match (file.coverage, file.parameters) {
        (true, _) => 8 * order,
        (false, true) => 2 * order,
        (false, false) => 0,
    }
}

/// The errors over `[course]` that an output has at each point, in the order of their columns.
pub(crate) const COURSES: [&str; 3] = ["e_a", "e_b", "e_x"];

/// Returns how many columns of a cell follow those of [`columns`]: e_a(k) at every point of `[course]`, then e_b(k) and
/// e_x(k). They are tallied for trials that fail later too, and not kept with the rows.
pub(crate) fn course_columns(file: &ExperimentFile, cell: &Cell) -> usize {
    let course = file.course.as_ref().zip(cell.discrete());
    let points = course.map(|(table, cell)| table.points(cell.window));
    COURSES.len() * points.map_or(0, <[usize]>::len)
}

/// Returns how many of these columns are kept with the rows: errors and standard errors. The ends of the intervals
/// follow from them.
pub(crate) fn kept(file: &ExperimentFile, order: usize) -> usize {
    if file.coverage { 4 * order } else { columns(file, order) }
}

/// The columns of trials.parquet for the coefficients of cells of any order: `error_a_1 ... error_h_n`, and with
/// `coverage = true` `se_a_1 ... se_h_n`, for the largest order n.
pub(crate) struct Kept {
    /// The largest order.
    order: usize,
    /// The number of columns.
    pub(crate) width: usize,
}

impl Kept {
    /// Makes the columns of a study with these cells.
    pub(crate) fn new(file: &ExperimentFile, cells: &[Cell]) -> Self {
        let order = cells.iter().map(Cell::order).max().unwrap_or(0);
        Self {
            order,
            width: kept(file, order),
        }
    }

    /// Returns the names of the columns.
    pub(crate) fn names(&self) -> Vec<String> {
        let coefficients = 2 * self.order;
        let of_column = |column: usize| {
            let kind = ["error", "se"][column / coefficients];
            format!("{kind}_{}", name(column % coefficients, self.order))
        };
        (0..self.width).map(of_column).collect()
    }

    /// Returns the place of a column among the values of an output of a cell of this order; `None` if the cell has no
    /// such coefficient.
    pub(crate) fn place(&self, column: usize, order: usize) -> Option<usize> {
        let (part, index) = (column / self.order, column % self.order);
        (index < order).then_some(part * order + index)
    }
}

/// Appends a trial's columns. They are NaN if there is no estimate, if the orders differ, or if a coefficient has no
/// standard error.
pub(crate) fn append(columns: usize, n: usize, pass: &Pass, record: &Realisation, to: &mut Vec<f64>) {
    let (truth, begin) = (&record.truth, to.len());
    if pass.progress < Progress::Parameters || truth.a.len() != n || pass.a.len() != n {
        to.resize(begin + columns, f64::NAN);
        return;
    }
    for (found, truth) in [(&pass.a, &truth.a), (&pass.h, &truth.h)] {
        to.extend(found.iter().zip(truth).map(|(found, truth)| found - truth));
    }
    if columns == 2 * n {
        return;
    }
    pass.model.canonical_standard_errors(n, to);
    for sign in [-1.0, 1.0] {
        for i in begin..begin + 2 * n {
            to.push(to[i] + sign * Z * to[i + 2 * n]);
        }
    }
}

/// Returns the name: "a_1", ... "h_n".
pub(crate) fn name(i: usize, order: usize) -> String {
    let letter = if i < order { 'a' } else { 'h' };
    format!("{letter}_{}", i % order + 1)
}
