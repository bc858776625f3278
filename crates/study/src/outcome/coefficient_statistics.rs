//! Bias and coverage of the coefficients of an output.

use crate::outcome::coefficients::name;
use asobench_identification::metric::{Coverage, Sample, Statistics, Worse};

/// Returns the statistics of the signed errors.
pub(crate) fn errors(parameters: &[Sample], order: usize) -> Vec<(String, Statistics)> {
    let errors = parameters.iter().take(2 * order).enumerate();
    errors
        .map(|(i, sample)| (name(i, order), sample.statistics(Worse::Larger)))
        .collect()
}

/// Returns the coverage of the intervals, for coefficients that have some; empty if not wanted.
pub(crate) fn coverage(parameters: &[Sample], order: usize) -> Vec<(String, Coverage)> {
    let parts: Vec<_> = parameters.chunks(2 * order).collect();
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
