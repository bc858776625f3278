//! Residuals that normal noise does not have.

use super::LEVEL;
use crate::metric::tails::student_above;
use serde::Serialize;

/// The median of `|x|` of a standard normal x.
const MEDIAN: f64 = 0.674_489_750_196_081_7;

/// The efficiency of the median of absolute deviations, beside the standard deviation, for normal numbers (Rousseeuw
/// and Croux, J. Amer. Statist. Assoc. 88 (1993), 1273-1283).
const EFFICIENCY: f64 = 0.37;

/// A residual beyond what as many normal numbers show.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outlier {
    /// Its sample k, from 0.
    pub sample: usize,
    /// Its distance from the median in robust standard deviations.
    pub deviations: f64,
}

/// Returns the residuals beyond what as many normal numbers show, the largest first; `first` is the sample of the first
/// one, and `least` a standard deviation that they have in any case, by rounding.
///
/// The standard deviation is the median of the absolute deviations from the median, divided by 0.6745. A residual
/// counts where M numbers have one as large with a chance of 1 % at most, by Bonferroni's bound `2 M P(T > t)`; T has
/// Student's law with 0.37 M degrees of freedom, as the robust standard deviation has as much spread as that of 0.37
/// M numbers.
pub(super) fn outliers(e: &[f64], first: usize, least: f64) -> Vec<Outlier> {
    let center = median(e.to_vec());
    let scale = median(e.iter().map(|e| (e - center).abs()).collect()) / MEDIAN;
    let scale = scale.max(least);
    let m = e.len() as f64;
    let deviations = e.iter().map(|e| (e - center).abs() / scale).enumerate();
    let chance = |t: f64| 2.0 * m * student_above(t, EFFICIENCY * m);
    // Below three nothing is beyond, whatever M is.
    let beyond = deviations.filter(|(_, t)| *t > 3.0 && t.is_finite() && chance(*t) < LEVEL);
    let mut found: Vec<Outlier> = beyond
        .map(|(k, deviations)| Outlier {
            sample: first + k,
            deviations,
        })
        .collect();
    found.sort_by(|a, b| b.deviations.total_cmp(&a.deviations));
    found
}

/// Returns the median; the mean of the middle two of an even number.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[middle],
        _ => f64::midpoint(values[middle - 1], values[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::tails::binomial_at_least;
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

    /// Normal numbers have an outlier in at most about 1 % of the records, short or long: the numbers seen are less
    /// than 1.5 % would show with a chance of 0.1 %. One of ten standard deviations is always named, first.
    #[test]
    fn normal_numbers_have_no_outliers() {
        for (n, trials) in [(40, 2000), (200, 2000), (1000, 1000)] {
            let mut alarms = 0;
            for trial in 0..trials {
                let mut e = vec![0.0; n];
                let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
                input.fill(&mut stream(77, trial, Purpose::Input), &mut e);
                alarms += u64::from(!outliers(&e, 0, 0.0).is_empty());
                e[17] = -10.0;
                let found = outliers(&e, 3, 0.0);
                assert_eq!(found[0].sample, 20);
            }
            let chance = binomial_at_least(alarms, trials, 0.015);
            assert!(chance > 1e-3, "{n}: {alarms} of {trials}");
        }
    }

    /// By hand: 1 ... 9 and 1000 have the median 5.5, and deviations with the median 2.5.
    #[test]
    fn deviations_by_hand() {
        let e: Vec<f64> = (1..=29_u32).map(f64::from).chain([1e6]).collect();
        let found = outliers(&e, 0, 0.0);
        // Median 15.5; absolute deviations 0.5, 0.5, 1.5 ... 14.5, 14.5 less one, and 1e6: the middle two are 7.5.
        let expected = (1e6 - 15.5) / (7.5 / MEDIAN);
        assert_eq!((found.len(), found[0].sample), (1, 29));
        assert!((found[0].deviations / expected - 1.0).abs() < 1e-12);
        assert!(outliers(&e[..29], 0, 0.0).is_empty());
        assert!(outliers(&[0.0; 30], 0, 0.0).is_empty());
    }
}
