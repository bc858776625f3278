//! Intervals known by hand, and intervals against the p-values of the same numbers.

use crate::claim::decision_rule::holm;
use crate::claim::freedom::Freedom;
use crate::claim::interval::*;
use crate::claim::statistics::number::Number;

fn near(found: [f64; 2], truth: [f64; 2]) {
    for (found, truth) in found.into_iter().zip(truth) {
        assert!(
            (found - truth).abs() < 1e-4 * truth.abs().max(1.0),
            "{found} {truth}"
        );
    }
}

fn part(known: Known, [low, high]: [f64; 2], open: bool) -> Part {
    let number = Number::from(known);
    let range = Range { low, high, open };
    let test = 0;
    Part {
        test,
        number,
        range,
    }
}

fn estimate(value: f64, error: f64, freedom: Freedom, logarithmic: bool) -> Known {
    Known::Estimate {
        value,
        error,
        freedom,
        logarithmic,
    }
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
    near(
        of(everywhere, [0, 0], 1, 1),
        [over(1.0), over(1.0), over(1.0), None],
    );
}

/// One level for all cells makes the same cells certain as Holm's step-down does.
#[test]
fn one_level_is_as_good_as_the_steps() {
    let mut state = 1_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
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

/// The normal law: 1.95996 standard errors at 2.5 %, of the logarithm for ratios. Clopper and Pearson: of 10 trials 0
/// are below 1 - 0.025^(1/10) = 0.30850, and 5 are from 0.18709 to 0.81291. A cell that fails by one of two numbers
/// compares each at half the level: at 1.25 % it is 2.24140 standard errors.
#[test]
fn intervals_by_hand() {
    let sure = Freedom::FIXED;
    let linear = part(estimate(3.0, 0.5, sure, false), BELOW_1, true);
    near(
        linear.interval(PASS, 0.025, 2),
        [3.0 - 0.979_98, 3.0 + 0.979_98],
    );
    near(
        linear.interval(FAIL, 0.025, 2),
        [3.0 - 1.120_70, 3.0 + 1.120_70],
    );
    let ratio = part(estimate(2.0, 0.2, sure, true), BELOW_1, true);
    let factor = 0.195_996_4_f64.exp();
    near(
        ratio.interval("open", 0.025, 1),
        [2.0 / factor, 2.0 * factor],
    );
    let count = |count| part(Known::Count { count, total: 10 }, BELOW_1, true);
    near(count(0).interval(PASS, 0.025, 1), [0.0, 0.308_50]);
    near(count(5).interval(FAIL, 0.025, 1), [0.187_09, 0.812_91]);
    near(count(10).interval(PASS, 0.025, 1), [0.691_50, 1.0]);
    let exact = part(Known::Exact(2.0), BELOW_1, true);
    assert_eq!(exact.interval(FAIL, 0.025, 1), [2.0, 2.0]);
}

/// A range that is a point: 5 % outside it is 2.5 % on either side. In a wide range an end is as good as alone:
/// 1.64485.
#[test]
fn two_ends_share_the_level() {
    let of = |low| {
        let known = estimate(0.0, 1.0, Freedom::FIXED, false);
        part(known, [low, 1.0], false).interval(FAIL, 0.05, 1)
    };
    near(of(1.0), [-1.959_96, 1.959_96]);
    near(of(-100.0), [-1.644_85, 1.644_85]);
}

/// Of 100 trials 40 are below 1, 40 are 1 and 20 are above. "At most 40 are below a median of 1 or more" has the tail
/// P(K <= 40) = 0.0284 of the binomial law, and "at least 80 below 2" has P(K >= 80) < 1e-9.
#[test]
fn ranks_end_at_known_values() {
    let known = Known::Ranks {
        value: 1.0,
        q: 0.5,
        total: 100,
        points: vec![(0.5, 40), (1.0, 80), (2.0, 81), (f64::INFINITY, 100)],
    };
    let part = part(known, BELOW_1, true);
    assert_eq!(part.interval("open", 0.03, 1)[1], 1.0);
    let [low, high] = part.interval("open", 0.001, 1);
    assert!(low <= 0.5 && high >= 1.0, "{low} {high}");
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
    let freedoms = [
        Freedom::FIXED,
        Freedom::constant(3.0),
        Freedom::of_quantile(0.5, 400),
    ];
    let levels = [0.025, 0.025 / 24.0, 1e-6];
    let mut counts = [0; 3];
    for (i, (limits, open)) in ranges.into_iter().enumerate() {
        let estimates = (1..40).flat_map(|k| {
            freedoms.map(|freedom| estimate(f64::from(k) / 20.0, 0.04, freedom, k % 2 == 0))
        });
        let counts_of = (0..=60).map(|count| Known::Count { count, total: 60 });
        for known in estimates.chain(counts_of.take(if i == 3 { 0 } else { 61 })) {
            let part = part(known.clone(), limits, open);
            let [low, high] = limits;
            for level in levels {
                let (pass, fail) = (known.inside(part.range), known.outside(part.range));
                let inside = |[a, b]: [f64; 2]| low < a && b < high;
                let outside = |[a, b]: [f64; 2]| high < a || b < low;
                let near = |p: f64| (p / level - 1.0).abs() < 1e-6;
                if near(pass) || near(fail) {
                    continue;
                }
                assert_eq!(
                    pass <= level,
                    inside(part.interval(PASS, level, 1)),
                    "{part:?}"
                );
                assert_eq!(
                    fail <= level,
                    outside(part.interval(FAIL, level, 1)),
                    "{part:?}"
                );
                let is_open = pass > level && fail > level;
                let bar = part.interval("open", level, 1);
                assert!(
                    !is_open || !inside(bar) && !outside(bar),
                    "{part:?} {bar:?}"
                );
                counts[if pass <= level {
                    0
                } else {
                    1 + usize::from(is_open)
                }] += 1;
            }
        }
    }
    assert!(counts.iter().all(|count| *count > 50), "{counts:?}");
}
