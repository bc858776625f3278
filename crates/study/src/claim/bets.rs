//! Tests of a mean by bets, which hold under every law.
//!
//! Let `Y >= 0` and let its mean be at most m. A gambler who stakes the fraction `2^-j` of the capital on Y in each
//! trial has `prod_i (1 + 2^-j (y_i / m - 1))` after n of them, whose mean is at most 1. So has the average e over j =
//! 1 ... 10, and by Markov's inequality `P(e >= 1 / level) <= level` (Waudby-Smith and Ramdas, *JRSS B* 86, 2024). So
//! `min(1, 1/e)` is a p-value of "the mean is at most m" with no assumption about the law.
//!
//! An upper bound of a mean is a lower bound of `T - Y`, which needs `Y <= T`. Without such a bound no trials tell that
//! a mean is small (Bahadur and Savage, *Annals of Mathematical Statistics* 27, 1956).

use crate::claim::one_sided::{OneSided, Prospect};

/// The number of fractions at stake.
const STAKES: i32 = 10;

/// Tests that the mean of values, each with its number of trials, is above m. The values are not negative.
#[expect(clippy::needless_pass_by_value, reason = "an iterator is passed as one")]
pub(crate) fn mean_above(values: impl Iterator<Item = (f64, f64)> + Clone, m: f64) -> OneSided {
    if m < 0.0 || m == 0.0 && values.clone().any(|(y, count)| y > 0.0 && count > 0.0) {
        return OneSided::SURE;
    }
    let trials: f64 = values.clone().map(|(_, count)| count).sum();
    if !(m > 0.0) || trials == 0.0 {
        return OneSided::NEVER;
    }
    let stake = |j: i32| {
        let log = |y: f64| (0.5_f64.powi(j) * (y / m - 1.0)).ln_1p();
        let gains = || values.clone().map(|(y, count)| (log(y), count));
        let sum: f64 = gains().map(|(gain, count)| gain * count).sum();
        let mean = sum / trials;
        let squares = gains().map(|(gain, count)| count * (gain - mean) * (gain - mean));
        (sum, (squares.sum::<f64>() / trials).sqrt())
    };
    let stakes: Vec<(f64, f64)> = (1..=STAKES).map(stake).collect();
    let (best, spread) = stakes
        .iter()
        .copied()
        .fold((f64::NEG_INFINITY, 0.0), |a, b| if b.0 > a.0 { b } else { a });
    if best == f64::INFINITY {
        return OneSided::SURE;
    }
    let sum: f64 = stakes.iter().map(|(log, _)| (log - best).exp()).sum();
    let log_e = best + (sum / f64::from(STAKES)).ln();
    OneSided {
        p: (-log_e).exp().min(1.0),
        prospect: Prospect::Gain {
            mean: best / trials,
            spread,
            trials,
        },
    }
}
