//! The ratio of two medians on the same trials, by all cuts: a test that holds under every joint law.
//!
//! If median A is not below median B, there is a cut t with `P(A < t) <= 1/2` and `P(B > t) <= 1/2`, and hence
//! `P(A < t < B) <= P(A >= t >= B)`. For each cut three binomial tests reject this, with 0.8, 0.1 and 0.1 of the level.
//! Only the values of A and B matter as cuts, and since one cut that is not rejected is enough to stay silent, their
//! number costs nothing.

use crate::claim::one_sided::{OneSided, Prospect};
use asobench_identification::metric::tails::binomial_at_least;

/// The shares of the level for the three tests of a cut.
const OF_PAIRS: f64 = 0.8;
const OF_EACH: f64 = 0.1;

/// Tests that the median of the first is below that of the second.
pub(crate) fn median_below(pairs: impl Iterator<Item = [f64; 2]>) -> OneSided {
    let pairs: Vec<[f64; 2]> = pairs.collect();
    let sorted = |at: usize| {
        let mut values: Vec<f64> = pairs.iter().map(|pair| pair[at]).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let (first, second) = (sorted(0), sorted(1));
    let mut cuts: Vec<f64> = first.iter().chain(&second).copied().collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let from = |t: f64| cuts.partition_point(|cut| *cut < t);
    let beyond = |t: f64| cuts.partition_point(|cut| *cut <= t);
    // Differences along the cuts of the numbers of pairs that are for and against it.
    let mut steps = vec![[0_i64; 2]; cuts.len() + 1];
    for [a, b] in &pairs {
        let (at, start, end) = if a < b {
            (0, beyond(*a), from(*b))
        } else {
            (1, from(*b), beyond(*a))
        };
        steps[start][at] += 1;
        steps[end][at] -= 1;
    }
    let n = pairs.len() as u64;
    let mut worst = OneSided {
        p: (0.5_f64.powf(n as f64) / OF_EACH).min(1.0),
        prospect: Prospect::Root,
    };
    let mut now = [0_i64; 2];
    for (t, step) in cuts.iter().zip(&steps) {
        now = [now[0] + step[0], now[1] + step[1]];
        let [fors, all] = [now[0] as u64, (now[0] + now[1]) as u64];
        let below = first.partition_point(|a| a < t) as u64;
        let above = n - second.partition_point(|b| b <= t) as u64;
        let each = |count: u64| binomial_at_least(count, n, 0.5) / OF_EACH;
        let p = each(below.max(above)).min(binomial_at_least(fors, all, 0.5) / OF_PAIRS);
        if p > worst.p {
            let prospect = Prospect::Few {
                count: all - fors,
                total: all,
                chance: 0.5,
                share: OF_PAIRS,
            };
            worst = OneSided {
                p: p.min(1.0),
                prospect,
            };
        }
        if p >= 1.0 {
            break;
        }
    }
    worst
}
