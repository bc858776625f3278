//! Bias and coverage of the coefficients of an output.

use crate::outcome::coefficients::name;
use asobench_identification::metric::{Coverage, Sample, Share, Statistics, Worse};

/// Returns the statistics of the signed errors.
pub(crate) fn errors(parameters: &[Sample], order: usize) -> Vec<(String, Statistics)> {
    let errors = parameters.iter().take(2 * order).enumerate();
    errors
        .map(|(i, sample)| (name(i, order), sample.statistics(Worse::Larger)))
        .collect()
}

/// Returns the shares of estimates above the truth, of coefficients that are estimated.
pub(crate) fn above_truth(parameters: &[Sample], order: usize) -> Vec<(String, Share)> {
    let errors = parameters.iter().take(2 * order).enumerate();
    let share = |(i, sample): (usize, &Sample)| {
        let bins = || sample.sketch().bins();
        // A coefficient that a delay makes 0 in every model has no errors at all.
        let is_estimated = bins().any(|(lowest, ..)| lowest != 0.0);
        let above = bins().filter(|(lowest, ..)| *lowest > 0.0);
        let above = above.map(|(.., count)| count).sum();
        is_estimated.then(|| (name(i, order), Share::new(above, sample.count())))
    };
    errors.filter_map(share).collect()
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
