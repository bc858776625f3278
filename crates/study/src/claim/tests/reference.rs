//! Reference cases that were computed apart from this program (`verdicts.json`): p-values, ranks and ends of intervals
//! by exact fractions, scipy and mpmath. `ASOBENCH_VERDICTS=FILE` reads other cases in the same form.

#![expect(clippy::print_stdout, reason = "the cases that this engine does not have")]

use crate::claim::bets::mean_above;
use crate::claim::cuts::median_below;
use crate::claim::known::{Bound, Known, Range};
use crate::claim::one_sided::Side;
use crate::claim::ranked::{Group, Ranked, end_rank};
use serde_json::Value;

/// Procedures that were weighed and not taken.
const NOT_TAKEN: [&str; 2] = ["confidence sequence (share)", "shares of the level"];

fn number(value: &Value) -> Option<f64> {
    value.as_f64()
}

/// Numbers as words, and digits.
fn count(word: &str) -> Option<usize> {
    const WORDS: [&str; 10] = [
        "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten",
    ];
    let known = WORDS.iter().position(|known| *known == word);
    match word {
        "twice" => Some(2),
        "twenty" => Some(20),
        "thirty" => Some(30),
        _ => known.map(|at| at + 1).or_else(|| word.parse().ok()),
    }
}

fn value(word: &str) -> f64 {
    match word {
        "lost" | "infinite" => f64::INFINITY,
        word => word.parse().unwrap_or_else(|_| panic!("no number: {word}")),
    }
}

/// The numbers `((k i) mod 10007) / 10007`, i = 1 ... n.
fn spread(k: u64, n: usize) -> Vec<f64> {
    let of = |i: u64| (k * i % 10_007) as f64 / 10_007.0;
    (1..=n as u64).map(of).collect()
}

/// Reads "19 x 1, 2 x 1.1, 19 x 1.3", "eight equal values 1", "30 x 1 and 10 lost trials", "0, 0.5, 1 thirty times".
fn listed(text: &str) -> Vec<f64> {
    if let Some((list, times)) = text.strip_suffix(" times").and_then(|text| text.rsplit_once(' ')) {
        let once: Vec<f64> = list.split(',').map(|x| value(x.trim())).collect();
        return once.repeat(count(times).unwrap());
    }
    let parts = text.split([',', ';']).flat_map(|part| part.split(" and "));
    let values = parts.flat_map(|part| {
        let words: Vec<&str> = part.split_whitespace().collect();
        let times = count(words[0]).unwrap_or_else(|| panic!("no count: {part}"));
        let words = words[1..].iter();
        let mut words = words.filter(|word| !["x", "values", "equal", "trials", "value"].contains(word));
        vec![value(words.next().unwrap()); times]
    });
    values.collect()
}

/// Reads the values of a case: a list, or a function of evenly spread numbers u.
fn values(data: &str, n: usize) -> Vec<f64> {
    let Some((_, formula)) = data.split_once("x = ") else {
        let list = data.split(" (").next().unwrap();
        return listed(list);
    };
    let u = spread(7919, n).into_iter();
    match formula {
        "u" => u.collect(),
        "-ln(1 - u)" => u.map(|u| -(1.0 - u).ln()).collect(),
        "exp(u)" => u.map(f64::exp).collect(),
        other => panic!("no formula: {other}"),
    }
}

/// Reads the two columns of a case with pairs.
fn columns(data: &str, n: usize) -> Vec<[f64; 2]> {
    if data.contains("u as above") {
        let scale = data.strip_prefix("a = ").unwrap().split(' ').next().unwrap();
        let a = spread(7919, n).into_iter().map(|u| value(scale) * (0.5 + u));
        let b = spread(6007, n).into_iter().map(|v| 0.5 + v);
        return a.zip(b).map(|(a, b)| [a, b]).collect();
    }
    if let Some((_, formula)) = data.split_once("a = 0.9 + 0.3 u, b = 1") {
        assert!(formula.is_empty(), "{data}");
        let a = spread(7919, n).into_iter().map(|u| 0.9 + 0.3 * u);
        return a.map(|a| [a, 1.0]).collect();
    }
    if let Some((a, b)) = data.strip_prefix("a: ").and_then(|data| data.split_once("; b: ")) {
        let column = |text: &str| match text.strip_prefix('(') {
            Some(repeated) => {
                let (list, times) = repeated.split_once(") ").unwrap();
                listed(list).repeat(count(times).unwrap())
            }
            None => listed(text.split(" (").next().unwrap()),
        };
        let (a, b) = (column(a), column(b));
        assert_eq!(a.len(), b.len(), "{data}");
        return a.into_iter().zip(b).map(|(a, b)| [a, b]).collect();
    }
    // "22 pairs (1, 2), 8 pairs (3, 2)", "60 pairs (0, 0): ratio 1; one (lost, 2): infinite"
    let mut pairs = Vec::new();
    for part in data.split(')') {
        let Some((before, pair)) = part.rsplit_once('(') else {
            continue;
        };
        let words = before.split([' ', ',', ';', ':']).filter(|word| !word.is_empty());
        let times = words.filter(|word| *word != "ratio").filter_map(count).next_back();
        let (a, b) = pair.split_once(',').unwrap();
        let pair = [value(a.trim()), value(b.trim())];
        pairs.extend(vec![pair; times.unwrap_or_else(|| panic!("no count: {part}"))]);
    }
    pairs
}

fn range(claim: &Value) -> Range {
    let between = claim["between"].as_array();
    let at = |i: usize| between.and_then(|ends| number(&ends[i]));
    Range {
        low: number(&claim["above"]).or(at(0)).unwrap_or(f64::NEG_INFINITY),
        high: number(&claim["below"]).or(at(1)).unwrap_or(f64::INFINITY),
        open: between.is_none(),
    }
}

fn ranked(values: impl Iterator<Item = f64>) -> Ranked {
    let group = |value| Group {
        lowest: value,
        highest: value,
        count: 1,
    };
    Ranked::new(values.map(group).collect())
}

fn quantile(q: f64, ranked: Ranked) -> Known {
    Known::Quantile {
        q,
        value: ranked.quantile(q),
        error: f64::NAN,
        ranked,
    }
}

/// Ratios without dividing: 1 where both are equal, 0 and infinite where one is lost.
fn ratio([a, b]: [f64; 2]) -> f64 {
    if a == b { 1.0 } else { a / b }
}

/// The p-values of a case; NaN where it states none.
fn found(case: &Value) -> [f64; 2] {
    let (data, claim) = (case["data"].as_str().unwrap(), &case["claim"]);
    let n = case["n"].as_u64().unwrap() as usize;
    let range = range(claim);
    let both = |known: &Known| [known.inside(range), known.outside(range)];
    let weighed = |values: Vec<f64>| values.into_iter().map(|x| (x, 1.0)).collect::<Vec<_>>();
    match case["kind"].as_str().unwrap() {
        "quantile" => {
            let q = number(&claim["q"]).unwrap();
            let values = values(data, n);
            assert_eq!(values.len(), n);
            let known = quantile(q, ranked(values.into_iter()));
            ends(case, &known, q);
            both(&known)
        }
        "share" => both(&Known::Share {
            count: case["k"].as_u64().unwrap(),
            total: n as u64,
        }),
        "paired ratio" => {
            let pairs = columns(data, n);
            assert_eq!(pairs.len(), n, "{data}");
            both(&quantile(0.5, ranked(pairs.into_iter().map(ratio))))
        }
        "ratio of two medians" => {
            let pairs = columns(data, n).into_iter();
            [median_below(pairs.map(|[a, b]| [a, range.high * b])).p, f64::NAN]
        }
        "mean by bets" => {
            let values = values(data.split(", no cap").next().unwrap(), n);
            let test = match number(&claim["cap"]) {
                Some(cap) if range.high.is_finite() => {
                    let lacks = values.into_iter().map(|x| cap - x.min(cap)).collect();
                    mean_above(weighed(lacks).into_iter(), cap - range.high)
                }
                _ => mean_above(weighed(values).into_iter(), range.low),
            };
            [test.p, f64::NAN]
        }
        "mean square below, with a stated kurtosis" => {
            let bound = Bound::Kurtosis {
                kurtosis: number(&claim["kurtosis"]).unwrap(),
                mean_square: number(&case["mean"]).unwrap(),
                count: n as f64,
            };
            [bound.test(Side::Below, range.high, 1).p, f64::NAN]
        }
        "rms ratio by bets, cap" => {
            let pairs = match data {
                "the same five times" => return [f64::NAN; 2],
                data => columns(data.split_once(": ").unwrap().1, n),
            };
            [ratio_of_squares(&pairs, claim), f64::NAN]
        }
        other => panic!("no such kind: {other}"),
    }
}

fn ratio_of_squares(pairs: &[[f64; 2]], claim: &Value) -> f64 {
    let cap = number(&claim["cap"]).unwrap();
    let square = |x: f64| x.min(cap).powi(2);
    let bound = Bound::Squares {
        pairs: pairs.iter().map(|pair| pair.map(square)).collect(),
        top: cap * cap,
    };
    bound.test(Side::Below, number(&claim["below"]).unwrap(), 2).p
}

/// The ranks and the interval of a quantile at 2.5 % a side.
fn ends(case: &Value, known: &Known, q: f64) {
    let n = case["n"].as_u64().unwrap();
    let expected = case["ranks"].as_array().unwrap();
    let ranks = [Side::Above, Side::Below].map(|side| end_rank(n, q, side, 0.025));
    let none = [0, n + 1];
    for ((found, expected), none) in ranks.into_iter().zip(expected).zip(none) {
        assert_eq!(found.unwrap_or(none), expected.as_u64().unwrap(), "{case}");
    }
    let Known::Quantile { ranked, .. } = known else {
        unreachable!()
    };
    let sides = [Side::Above, Side::Below];
    let interval = case["interval_0_025_a_side"].as_array().unwrap();
    for (side, expected) in sides.into_iter().zip(interval) {
        let found = ranked.end(q, side, 0.025);
        match number(expected) {
            Some(expected) => near(found, expected, case),
            None => assert!(found.is_infinite(), "{case}"),
        }
    }
}

fn near(found: f64, expected: f64, case: &Value) {
    let error = (found - expected).abs();
    assert!(error <= 1e-9 * expected.abs(), "{found:e} {expected:e} {case}");
}

#[test]
fn the_reference_cases() {
    let text = match std::env::var_os("ASOBENCH_VERDICTS") {
        #[expect(clippy::disallowed_methods, reason = "a file of the one who asks")]
        Some(path) => std::fs::read_to_string(path).unwrap(),
        None => include_str!("verdicts.json").to_owned(),
    };
    let all: Value = serde_json::from_str(&text).unwrap();
    let cases = all["cases"].as_array().unwrap();
    let (mut checked, mut left) = (0, 0);
    let mut last = Vec::new();
    for case in cases {
        let kind = case["kind"].as_str().unwrap();
        if NOT_TAKEN.contains(&kind) {
            left += 1;
            continue;
        }
        let mut p = found(case);
        if kind.starts_with("rms ratio") {
            // "The same five times" is about the pairs of the case before.
            if p[0].is_nan() {
                let pairs: &Vec<[f64; 2]> = &last;
                p[0] = ratio_of_squares(&pairs.repeat(5), &case["claim"]);
            } else {
                let data = case["data"].as_str().unwrap();
                last = columns(data.split_once(": ").unwrap().1, 0);
                last.retain(|pair| pair.iter().all(|x| x.is_finite()));
            }
        }
        for (found, key) in p.into_iter().zip(["p_holds", "p_fails"]) {
            if let Some(expected) = number(&case[key]) {
                near(found, expected, case);
            }
        }
        for (key, level) in [("decision_at_0.025", 0.025), ("decision_first_look_0.0225", 0.0225)] {
            let decision = match p {
                [holds, _] if holds <= level => "holds",
                [_, fails] if fails <= level => "does not hold",
                _ => "undecided",
            };
            assert_eq!(case[key].as_str(), Some(decision), "{case}");
        }
        checked += 1;
    }
    println!("{checked} cases; {left} of procedures that are not taken: {NOT_TAKEN:?}");
    assert!(checked > 0);
}
