//! Error rates of exact tests by enumeration: the sum of the chances of all outcomes that give a wrong verdict. There
//! is no error of a simulation in them.

use crate::claim::cuts::median_below;
use crate::claim::known::{Known, Range};
use crate::claim::ranked::{Group, Ranked};
use asobench_identification::signal::{Purpose, stream};
use rand::RngExt;

const LEVELS: [f64; 3] = [0.025, 0.0225, 0.00125];
const SIZES: [u64; 12] = [1, 2, 5, 8, 10, 16, 20, 40, 73, 100, 150, 200];
const SHARES: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];
/// Sums of so many terms are exact to this.
const ROUNDING: f64 = 1e-10;

/// The binomial law, by the ratio of neighbouring terms from its mode.
fn binomial(n: u64, p: f64) -> Vec<f64> {
    let mode = ((n + 1) as f64 * p).floor().min(n as f64) as usize;
    let mut law = vec![0.0; n as usize + 1];
    law[mode] = 1.0;
    let odds = p / (1.0 - p);
    for k in mode + 1..law.len() {
        law[k] = law[k - 1] * odds * (n as f64 - k as f64 + 1.0) / k as f64;
    }
    for k in (0..mode).rev() {
        law[k] = law[k + 1] / odds * (k as f64 + 1.0) / (n as f64 - k as f64);
    }
    let sum: f64 = law.iter().sum();
    law.iter().map(|x| x / sum).collect()
}

/// The chances that a test of n trials says "inside" and "outside" at a level, if each counts with chance p.
fn rates(n: u64, p: f64, range: Range, level: f64, known: impl Fn(u64) -> Known) -> [f64; 2] {
    let mut rates = [0.0; 2];
    for (count, chance) in (0..).zip(binomial(n, p)) {
        let known = known(count);
        rates[0] += if known.inside(range) <= level { chance } else { 0.0 };
        rates[1] += if known.outside(range) <= level { chance } else { 0.0 };
    }
    rates
}

fn below(high: f64) -> Range {
    Range {
        low: f64::NEG_INFINITY,
        high,
        open: true,
    }
}

fn above(low: f64) -> Range {
    Range {
        low,
        high: f64::INFINITY,
        open: true,
    }
}

/// A share at its limit is wrongly on either side with at most the level, and between limits with the truth at an end.
#[test]
fn shares() {
    for n in SIZES {
        for s in SHARES {
            for level in LEVELS {
                let share = |count| Known::Share { count, total: n };
                let inside = Range {
                    low: (s - 0.02).max(0.001),
                    high: s,
                    open: false,
                };
                for range in [below(s), above(s)] {
                    let found = rates(n, s, range, level, share);
                    assert!(found.iter().all(|rate| *rate <= level + ROUNDING), "{n} {s}");
                }
                // At the end of a closed range only "outside" is wrong; barely beyond it only "inside".
                let found = rates(n, s, inside, level, share);
                assert!(found.iter().all(|rate| *rate <= level + ROUNDING), "{n} {s}");
            }
        }
    }
}

/// A quantile of a law with mass p below the limit, r at it and the rest above. Its quantile is below the limit, at it,
/// or either (in a gap, where p = q).
#[test]
fn quantiles_with_atoms_and_gaps() {
    let known = |q: f64, counts: [u64; 3]| {
        let groups = [0.5, 1.0, 2.0].into_iter().zip(counts);
        let group = |(value, count)| Group {
            lowest: value,
            highest: value,
            count,
        };
        Known::Quantile {
            q,
            value: f64::NAN,
            error: f64::NAN,
            ranked: Ranked::new(groups.map(group).collect()),
        }
    };
    let limit = 1.0;
    for n in SIZES {
        for q in [0.05, 0.25, 0.5, 0.75, 0.95] {
            for level in LEVELS {
                // A gap at the quantile: "below" and "above" are both wrong, as is "not below".
                let gap = |count| known(q, [count, 0, n - count]);
                for range in [below(limit), above(limit)] {
                    let found = rates(n, q, range, level, gap);
                    assert!(found.iter().all(|rate| *rate <= level + ROUNDING), "{n} {q}");
                }
                // Mass q up to the limit, most of it at the limit: a quantile at the limit is neither below nor above.
                let atom = |count| known(q, [0, count, n - count]);
                let found = rates(n, q, above(limit), level, atom);
                assert!(found[0] <= level + ROUNDING, "{n} {q}");
                let closed = Range {
                    open: false,
                    ..below(limit)
                };
                let found = rates(n, q, closed, level, atom);
                assert!(found.iter().all(|rate| *rate <= level + ROUNDING), "{n} {q}");
            }
        }
    }
    // All at the limit: certainly not below it, and not above it.
    let all = known(0.5, [0, 200, 0]);
    assert_eq!((all.inside(below(1.0)), all.inside(above(1.0))), (1.0, 1.0));
    assert!(all.outside(below(1.0)) < 1e-50 && all.outside(above(1.0)) < 1e-50);
}

/// Two one-sided tests, as for coverage: with the truth at either end "inside" is wrong with at most the level, and
/// "outside" with the truth anywhere inside.
#[test]
fn ranges() {
    for n in [40, 100, 200] {
        for (low, high) in [(0.935, 0.965), (0.46, 0.54), (0.2, 0.8)] {
            let range = Range { low, high, open: false };
            let share = |count| Known::Share { count, total: n };
            for level in LEVELS {
                for end in [low, high] {
                    assert!(rates(n, end, range, level, share)[0] <= level + ROUNDING);
                }
                for part in 0..=10 {
                    let truth = low + (high - low) * f64::from(part) / 10.0;
                    assert!(rates(n, truth, range, level, share)[1] <= level + ROUNDING);
                }
            }
        }
    }
}

/// All ways to distribute n trials over the cells of a table, with their multinomial coefficients.
fn compositions(n: u64, cells: usize) -> Vec<(Vec<u64>, f64)> {
    if cells == 1 {
        return vec![(vec![n], 1.0)];
    }
    let mut all = Vec::new();
    let mut ways = 1.0;
    for first in 0..=n {
        for (mut rest, of_rest) in compositions(n - first, cells - 1) {
            rest.insert(0, first);
            all.push((rest, ways * of_rest));
        }
        ways *= (n - first) as f64 / (first + 1) as f64;
    }
    all
}

/// Two outputs with the values 1, 2 and 3 under random joint laws, also with atoms at both medians: whether "median A
/// is below median B" is said of laws of which it is false.
#[test]
fn two_medians_by_all_cuts() {
    const TRIALS: u64 = 9;
    const LEVEL: f64 = 0.025;
    let pairs: Vec<[f64; 2]> = (0..9).map(|i| [f64::from(i / 3 + 1), f64::from(i % 3 + 1)]).collect();
    let outcomes = compositions(TRIALS, 9).into_iter();
    let certain: Vec<(Vec<u64>, f64)> = outcomes
        .filter(|(counts, _)| {
            let all = pairs.iter().zip(counts);
            let all = all.flat_map(|(pair, count)| vec![*pair; *count as usize]);
            median_below(all).p <= LEVEL
        })
        .collect();
    assert!(!certain.is_empty());
    let mut random = stream(4, 0, Purpose::Input);
    let (mut laws, mut worst) = (0, 0.0_f64);
    while laws < 300 {
        // Of few cells and of many.
        let mut law: Vec<f64> = (0..9).map(|_| random.random::<f64>().powi(laws % 7)).collect();
        let sum: f64 = law.iter().sum();
        for p in &mut law {
            *p /= sum;
        }
        let mass = |is: &dyn Fn(&[f64; 2]) -> bool| -> f64 {
            let cells = pairs.iter().zip(&law).filter(|(pair, _)| is(pair));
            cells.map(|(_, p)| p).sum()
        };
        // False if a cut has at most half of A below it and at most half of B above it.
        let is_false = [1.0, 2.0, 3.0]
            .iter()
            .any(|t| mass(&|[a, _]| a < t) <= 0.5 && mass(&|[_, b]| b > t) <= 0.5);
        if !is_false {
            continue;
        }
        laws += 1;
        let chance = |(counts, ways): &(Vec<u64>, f64)| {
            let powers = counts.iter().zip(&law).map(|(count, p)| p.powi(*count as i32));
            ways * powers.product::<f64>()
        };
        worst = worst.max(certain.iter().map(chance).sum());
    }
    assert!(worst <= LEVEL + ROUNDING && worst > 0.0, "{worst}");
}
