//! Intervals known by hand, and intervals against the p-values of the same numbers.

use crate::claim::decision_rule::holm;
use crate::claim::interval::*;
use crate::claim::known::{Bound, Range};
use crate::claim::ranked::{Group, Ranked};
use crate::claim::statistics::number::Number;

fn near(found: [f64; 2], truth: [f64; 2]) {
    for (found, truth) in found.into_iter().zip(truth) {
        assert!((found - truth).abs() < 1e-4 * truth.abs().max(1.0), "{found} {truth}");
    }
}

fn part(known: Known, [low, high]: [f64; 2], open: bool) -> Part {
    let number = Number::from(known);
    let range = Range { low, high, open };
    let test = 0;
    Part { test, number, range }
}

const BELOW_1: [f64; 2] = [f64::NEG_INFINITY, 1.0];

/// Of 24 cells, 7 certain: Holm stops at the eighth, which is compared at level / 17. With none it is level / 24, with
/// all level / 1. A claim that needs all cells, of which all are certain, has the level itself although 30 others were
/// left out.
#[test]
fn levels_by_hand() {
    let of = |holds, certain, judged, among| {
        let levels = Levels::new(holds, certain, judged, among, 0.024);
        ["pass", "fail", "open", "left out"].map(|says| levels.of(says))
    };
    let over = |parts: f64| Some(0.024 / parts);
    let near = |found: [Option<f64>; 4], truth: [Option<f64>; 4]| {
        for (found, truth) in found.into_iter().zip(truth) {
            let same = match (found, truth) {
                (Some(x), Some(y)) => (x - y).abs() < 1e-15,
                (None, None) => true,
                _ => false,
            };
            assert!(same, "{found:?} {truth:?}");
        }
    };
    let everywhere = Holds::Everywhere;
    near(
        of(everywhere, [7, 0], 24, 24),
        [over(17.0), over(24.0), over(24.0), None],
    );
    near(
        of(everywhere, [24, 0], 24, 24),
        [over(1.0), over(24.0), over(24.0), None],
    );
    near(
        of(everywhere, [10, 0], 10, 40),
        [over(1.0), over(40.0), over(40.0), None],
    );
    near(
        of(Holds::Typically, [10, 0], 10, 40),
        [over(31.0), over(40.0), over(40.0), None],
    );
    near(
        of(Holds::Somewhere, [0, 5], 5, 5),
        [over(5.0), over(1.0), over(5.0), None],
    );
    near(of(everywhere, [0, 0], 1, 1), [over(1.0), over(1.0), over(1.0), None]);
}

/// One level for all cells makes the same cells certain as Holm's step-down does.
#[test]
fn one_level_is_as_good_as_the_steps() {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    for round in 0..2000 {
        let judged = 1 + round % 9;
        let among = judged + round % 3;
        let p: Vec<f64> = (0..judged).map(|_| random().powi(4)).collect();
        let mut steps = holm(&p, among, 0.05);
        steps.sort_unstable();
        let levels = Levels::new(Holds::Typically, [steps.len(), 0], judged, among, 0.05);
        let level = levels.of(PASS).unwrap();
        let at_once: Vec<usize> = (0..judged).filter(|i| p[*i] <= level).collect();
        assert_eq!(steps, at_once, "{p:?}");
    }
}

/// The normal law for the logarithm of times: 1.95996 standard errors at 2.5 %. Clopper and Pearson: of 10 trials 0 are
/// below 1 - 0.025^(1/10) = 0.30850, and 5 are from 0.18709 to 0.81291. A cell that fails by one of two numbers
/// compares each at half the level: at 1.25 % it is 2.24140 standard errors.
#[test]
fn intervals_by_hand() {
    let time = Known::Time { value: 2.0, error: 0.2 };
    let ratio = part(time, BELOW_1, true);
    let factor = 0.195_996_4_f64.exp();
    near(ratio.interval("open", 0.025, 1), [2.0 / factor, 2.0 * factor]);
    let factor = 0.224_140_3_f64.exp();
    near(ratio.interval(FAIL, 0.025, 2), [2.0 / factor, 2.0 * factor]);
    let count = |count| part(Known::Share { count, total: 10 }, BELOW_1, true);
    near(count(0).interval(PASS, 0.025, 1), [0.0, 0.308_50]);
    near(count(5).interval(FAIL, 0.025, 1), [0.187_09, 0.812_91]);
    near(count(10).interval(PASS, 0.025, 1), [0.691_50, 1.0]);
    let exact = part(Known::Exact(2.0), BELOW_1, true);
    assert_eq!(exact.interval(FAIL, 0.025, 1), [2.0, 2.0]);
}

/// Numbers of each kind about 1, from few and from many trials.
fn numbers() -> Vec<Known> {
    let values = |n: u64, shift: f64| -> Vec<Group> {
        let value = |i| shift + (i as f64 + 0.5) / n as f64;
        let group = |value| Group {
            lowest: value,
            highest: value,
            count: 1,
        };
        (0..n).map(|i| group(value(i))).collect()
    };
    let mut all = Vec::new();
    for n in [20, 400] {
        for k in 0..30 {
            let shift = f64::from(k) / 25.0;
            let pairs = values(n, shift).into_iter().map(|group| [group.lowest, 1.0]);
            let squares: Vec<[f64; 2]> = pairs.clone().collect();
            let (value, error) = (shift + 0.5, 0.3 / (n as f64).sqrt());
            all.push(Known::Quantile {
                q: 0.5,
                value,
                error,
                ranked: Ranked::new(values(n, shift)),
            });
            all.push(Known::Medians {
                value,
                error,
                pairs: pairs.collect(),
            });
            let bound = || Bound::Squares {
                pairs: squares.clone(),
                top: 5.0,
            };
            all.push(Known::Moment {
                value: value.sqrt(),
                error,
                power: 2,
                unit: 1.0,
                bounds: Box::new([bound(), bound()]),
            });
            all.push(Known::Slope {
                value,
                error,
                cells: vec![(1.0, Ranked::new(values(n, shift + 1.0)))],
            });
            all.push(Known::Time { value, error });
        }
    }
    all
}

/// The interval is inside the limits exactly where the number certainly passes, and outside where it certainly fails.
/// At the level of an open cell it is neither.
#[test]
fn intervals_and_p_values_agree() {
    let ranges = [
        (BELOW_1, true),
        ([0.8, f64::INFINITY], true),
        ([0.8, 1.0], false),
        ([0.99, 1.01], false),
    ];
    let levels = [0.025, 0.025 / 24.0, 1e-6];
    let mut counts = [0; 3];
    for (i, (limits, open)) in ranges.into_iter().enumerate() {
        let counts_of = (0..=60).map(|count| Known::Share { count, total: 60 });
        for known in numbers().into_iter().chain(counts_of.take(if i == 3 { 0 } else { 61 })) {
            let part = part(known.clone(), limits, open);
            let (value, error) = known.shown();
            let kind = std::mem::discriminant(&known);
            let said = format!("{kind:?} {value} {error} in {limits:?}");
            let [low, high] = limits;
            for level in levels {
                let (pass, fail) = (known.inside(part.range), known.outside(part.range));
                let inside = |[a, b]: [f64; 2]| low < a && b < high;
                let outside = |[a, b]: [f64; 2]| high < a || b < low;
                let near = |p: f64| (p / level - 1.0).abs() < 1e-6;
                if near(pass) || near(fail) {
                    continue;
                }
                assert_eq!(pass <= level, inside(part.interval(PASS, level, 1)), "{said}");
                assert_eq!(fail <= level, outside(part.interval(FAIL, level, 1)), "{said}");
                let is_open = pass > level && fail > level;
                let bar = part.interval("open", level, 1);
                assert!(!is_open || !inside(bar) && !outside(bar), "{said} {bar:?}");
                counts[if pass <= level { 0 } else { 1 + usize::from(is_open) }] += 1;
            }
        }
    }
    assert!(counts.iter().all(|count| *count > 50), "{counts:?}");
}
