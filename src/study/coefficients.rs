//! Coefficients of an output compared with the truth: a column for the signed error of each of
//! `a_1 ... a_n, h_1 ... h_n`. With `coverage = true` there are also columns for the standard errors and for both ends
//! of the 95 % intervals of the error.

use super::file::ExperimentFile;
use super::tally::OutputTally;
use crate::data::Realisation;
use crate::estimator::{Pass, Progress};
use crate::metric::{Coverage, Statistics, Worse, Z};

/// Returns how many columns a file needs for an output of order n.
pub(super) fn columns(file: &ExperimentFile, order: usize) -> usize {
    match (file.coverage, file.parameters) {
        (true, _) => 8 * order,
        (false, true) => 2 * order,
        (false, false) => 0,
    }
}

/// Appends a trial's columns. They are NaN if there is no estimate, if the orders differ, or if a coefficient has no
/// standard error.
pub(super) fn append(
    columns: usize,
    n: usize,
    pass: &Pass,
    record: &Realisation,
    to: &mut Vec<f64>,
) {
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
fn name(i: usize, order: usize) -> String {
    let letter = if i < order { 'a' } else { 'h' };
    format!("{letter}_{}", i % order + 1)
}

/// Returns the statistics of the signed errors.
pub(super) fn errors(tally: &OutputTally, order: usize) -> Vec<(String, Statistics)> {
    let errors = tally.parameters.iter().take(2 * order).enumerate();
    errors
        .map(|(i, sample)| (name(i, order), sample.statistics(Worse::Larger)))
        .collect()
}

/// Returns the coverage of the intervals, for coefficients that have some; empty if not wanted.
pub(super) fn coverage(tally: &OutputTally, order: usize) -> Vec<(String, Coverage)> {
    let parts: Vec<_> = tally.parameters.chunks(2 * order).collect();
    let &[errors, ses, low, high] = parts.as_slice() else {
        return Vec::new();
    };
    let of = |i: usize| {
        let found = Coverage::new(&errors[i], &ses[i], low[i].sketch(), high[i].sketch());
        (name(i, order), found)
    };
    let has = |i: &usize| ses[*i].count() > 0;
    (0..2 * order).filter(has).map(of).collect()
}
