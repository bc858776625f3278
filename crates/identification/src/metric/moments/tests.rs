use super::*;
use crate::signal::normal::fill_standard_normal;
use crate::signal::{Purpose, stream};
use proptest::prelude::*;

fn normals(seed: u64, count: usize) -> Vec<f64> {
    let mut z = vec![0.0; count];
    fill_standard_normal(&mut stream(seed, 0, Purpose::NoiseDrive), &mut z);
    z
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs(),
        "{found:e} {expected:e}"
    );
}

/// 1 ... M: mean (M + 1)/2, variance M (M + 1)/12, mean fourth central moment
/// (M^2 - 1)(3 M^2 - 7)/240, mean square (M + 1)(2 M + 1)/6, sum of fourth powers
/// M (M + 1)(2 M + 1)(3 M^2 + 3 M - 1)/30.
#[test]
fn consecutive_integers() {
    let count = 1000;
    let m = f64::from(count);
    let found = Sample::from_values((1..=count).map(f64::from)).statistics(Worse::Larger);
    let eps = 8.0 * f64::EPSILON;
    assert_eq!(found.mean.value, 500.5);
    let variance = m * (m + 1.0) / 12.0;
    near(found.mean.mcse, (variance / m).sqrt(), eps);
    near(found.sd.value, variance.sqrt(), eps);
    let fourth = (m * m - 1.0) * (3.0 * m * m - 7.0) / 240.0;
    let of_variance = (fourth - variance * variance * (m - 3.0) / (m - 1.0)) / m;
    near(found.sd.mcse, (of_variance / (4.0 * variance)).sqrt(), 2.0 * eps);
    let mse = (m + 1.0) * (2.0 * m + 1.0) / 6.0;
    near(found.mse.value, mse, eps);
    let fourths = (m + 1.0) * (2.0 * m + 1.0) * (3.0 * m * m + 3.0 * m - 1.0) / 30.0;
    let mcse = ((fourths - mse * mse) / (m - 1.0)).sqrt();
    near(found.mse.mcse, mcse, 2.0 * eps);
    near(found.rmse.value, mse.sqrt(), eps);
    near(found.rmse.mcse, mcse / (2.0 * mse.sqrt()), 2.0 * eps);
    assert_eq!((found.min, found.max, found.count), (1.0, m, 1000));
    near(found.largest_share, 1.0 / mse * m, eps);
    assert!(!found.dominated);
    // Integers are the lower edges of their bins, so the sketch overestimates each.
    near(found.trimmed.value, 500.5, crate::metric::SKETCH_ERROR);
    near(found.q25.value, 250.75, 2.0 * crate::metric::SKETCH_ERROR);
}

/// With an offset of 2^40, x^4 needs 160 bits more than the spread. sd and its error must not change: x + 2^40 is
/// exact for these x.
#[test]
fn offsets_do_not_cancel() {
    let plain = Sample::from_values((0..500).map(|i| f64::from((i * i) % 97)));
    for offset in [2.0_f64.powi(20), 2.0_f64.powi(40)] {
        let moved = Sample::from_values((0..500).map(|i| f64::from((i * i) % 97) + offset));
        let (a, b) = (plain.sd(), moved.sd());
        near(b.value, a.value, 1e-15);
        near(moved.mean().mcse, plain.mean().mcse, 1e-15);
        assert_eq!(moved.mean().value, plain.mean().value + offset);
        // mu_4 has an error of 2^-104 of mean x^4: (offset / sd)^4 2^-104.
        let condition = (offset / a.value).powi(4) * 2.0_f64.powi(-100);
        if condition < 0.01 {
            near(b.mcse, a.mcse, condition.max(1e-14));
        }
    }
    let constant = Sample::from_values([0.1; 50]).statistics(Worse::Larger);
    assert_eq!((constant.sd.value, constant.sd.mcse), (0.0, 0.0));
    assert_eq!((constant.mean.value, constant.mean.mcse), (0.1, 0.0));
    assert_eq!(constant.q50.value, 0.1);
}

/// Theory, at a million values: statistics within 4.5 standard errors, the standard errors within 2 %. Uniform:
/// mean 1/2, variance 1/12, mu_4 = 1/80; normal: error of sd sigma / sqrt(2 M); exponential: mean and sd 1, mu_4 =
/// 9, E x^4 = 24, median ln 2.
#[test]
fn known_distributions() {
    let count = 1 << 20;
    let m = f64::from(count);
    let z = normals(5, 2 * count as usize);
    let exponential = z.as_chunks::<2>().0.iter();
    let exponential: Vec<f64> = exponential.map(|[a, b]| 0.5 * (a * a + b * b)).collect();
    let uniform = exponential.iter().map(|x| (-x).exp());
    // mean, sd, its error, mean square, its error, median, its error
    let laws = [
        (
            Sample::from_values(uniform),
            [0.5, (1.0_f64 / 12.0).sqrt(), 1.0 / 3.0, 0.5],
            [1.0 / 80.0, 1.0 / 5.0 - 1.0 / 9.0, 0.5],
        ),
        (
            Sample::from_values(z[..count as usize].iter().copied()),
            [0.0, 1.0, 1.0, 0.0],
            [3.0, 2.0, (0.5 * std::f64::consts::PI).sqrt()],
        ),
        (
            Sample::from_values(exponential.iter().copied()),
            [1.0, 1.0, 2.0, std::f64::consts::LN_2],
            [9.0, 20.0, 1.0],
        ),
    ];
    for (sample, [mean, sd, mse, median], [fourth, of_square, of_median]) in laws {
        let found = sample.statistics(Worse::Larger);
        let root = m.sqrt();
        let of_sd = (fourth - sd.powi(4)).sqrt() / (2.0 * sd) / root;
        let of_mse = of_square.sqrt() / root;
        for (estimate, truth, error) in [
            (found.mean, mean, sd / root),
            (found.sd, sd, of_sd),
            (found.mse, mse, of_mse),
            (found.rmse, mse.sqrt(), of_mse / (2.0 * mse.sqrt())),
        ] {
            assert!((estimate.value - truth).abs() < 4.5 * error, "{found:?}");
            near(estimate.mcse, error, 0.02);
        }
        assert!((found.q50.value - median).abs() < 4.5 * of_median / root + 2e-4);
        let floor = median * crate::metric::SKETCH_ERROR / super::super::Z;
        near(found.q50.mcse, (of_median / root).max(floor), 0.1);
        assert!(!found.dominated && found.overflowed == 0);
    }
}

/// Of 101 trials, those with the values 0 ... 60 have a measure. The median is the 51st of all, 50; the upper
/// quartile, the 76th, has none. If larger is better, the 40 others are the smallest: the lower quartile, the
/// 26th, has none, and the median is the 11th of the others, 10.
#[test]
fn quantiles_are_over_all_trials_with_failed_ones_at_the_worse_end() {
    let values = (0..101).map(|i| if i <= 60 { f64::from(i) } else { f64::NAN });
    let sample = Sample::from_values(values);
    let found = sample.statistics(Worse::Larger);
    assert!((found.q50.value - 50.0).abs() < 0.03, "{found:?}");
    assert!((found.q25.value - 25.0).abs() < 0.02);
    assert!(found.q75.lost && found.q75.value.is_nan() && found.q75.mcse.is_nan());
    // Its interval, 51 -+ 9.9 ranks, ends at rank 60.9, just below the last measure.
    assert!(found.q50.mcse > 0.0 && !found.q50.lost);
    let conditional = found.conditional.unwrap();
    assert!((conditional.q50.value - 30.0).abs() < 0.02);
    assert!((conditional.q75.value - 45.0).abs() < 0.03);
    let better = sample.statistics(Worse::Smaller);
    assert!(better.q25.lost && (better.q50.value - 10.0).abs() < 0.01);
    let text = serde_json::to_string(&found).unwrap();
    assert!(
        text.contains(r#""q75":{"value":null,"mcse":null,"lost":true}"#),
        "{text}"
    );
    let read: Statistics = serde_json::from_str(&text).unwrap();
    assert!(read.q75.lost);
    assert!(
        Sample::from_values([1.0, 2.0])
            .statistics(Worse::Larger)
            .conditional
            .is_none()
    );
}

#[test]
fn powers_that_overflow_are_counted() {
    let fourth = Sample::from_values([1e80, 1.0, -1.0].repeat(20)).statistics(Worse::Larger);
    assert_eq!(fourth.overflowed, 20);
    assert!(fourth.mean.mcse.is_finite() && fourth.rmse.value.is_finite());
    assert!(fourth.sd.value.is_finite() && fourth.sd.mcse.is_nan());
    assert!(fourth.mse.mcse.is_nan() && fourth.rmse.mcse.is_nan());
    let square = Sample::from_values([1e200, 1.0, -1.0]).statistics(Worse::Larger);
    assert!(square.mean.value.is_finite() && square.mean.mcse.is_nan());
    assert!(square.sd.value.is_nan() && square.mse.value.is_nan() && square.dominated);
    // Each power is in range, but their sum is not.
    let sum = Sample::from_values([1e77, -1e77, 9e76].repeat(50)).statistics(Worse::Larger);
    assert!(sum.overflowed == 0 && sum.mse.value.is_finite() && sum.sd.value.is_finite());
    assert!(sum.mse.mcse.is_nan() && sum.rmse.mcse.is_nan() && sum.sd.mcse.is_nan());
    let infinite = Sample::from_values([f64::INFINITY, 1.0, 2.0]).statistics(Worse::Larger);
    assert!(infinite.mean.value.is_nan() && infinite.max == f64::INFINITY);
    assert!(infinite.overflowed == 1 && infinite.q05.value.is_finite());
    let undefined = Sample::from_values([f64::NAN, 1.0]).statistics(Worse::Larger);
    assert_eq!((undefined.count, undefined.undefined), (1, 1));
    assert!(undefined.mean.value == 1.0 && undefined.mean.mcse.is_nan());
    let empty = Sample::default().statistics(Worse::Larger);
    assert!(empty.mean.value.is_nan() && empty.min.is_nan() && !empty.dominated);
}

/// Errors begin at [`FEWEST_FOR_MEANS`] and [`FEWEST_FOR_SQUARES`] trials, and for quantiles when their interval
/// exists.
#[test]
fn errors_begin_with_enough_trials() {
    let z = normals(9, 100);
    let errors = |count: usize| {
        let found = Sample::from_values(z[..count].iter().copied()).statistics(Worse::Larger);
        let moments = [found.mean, found.trimmed, found.sd, found.mse, found.rmse].map(|estimate| estimate.mcse);
        let quantiles = [found.q50, found.q25, found.q05].map(|estimate| estimate.mcse);
        [&moments[..], &quantiles[..]].concat()
    };
    let from = [7, 7, 40, 40, 40, 6, 16, 92];
    for count in 1..=z.len() {
        for (error, from) in errors(count).into_iter().zip(from) {
            assert_eq!(error > 0.0, count >= from, "{count} {from} {error}");
            assert_eq!(error.is_nan(), count < from, "{count} {from} {error}");
        }
    }
}

#[test]
fn undefined_numbers_are_null_in_json_and_come_back() {
    let found = Sample::from_values([f64::NAN, 1.0]).statistics(Worse::Larger);
    let text = serde_json::to_string(&found).unwrap();
    assert!(text.contains(r#""mean":{"value":1.0,"mcse":null}"#));
    let read: Statistics = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&read).unwrap(), text);
    assert!(read.mean.mcse.is_nan());
    let full = Sample::from_values(normals(1, 100)).statistics(Worse::Larger);
    let text = serde_json::to_string(&full).unwrap();
    assert_eq!(serde_json::from_str::<Statistics>(&text).unwrap(), full);
}

fn value() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0,
        1 => any::<u64>().prop_map(f64::from_bits),
        1 => Just(0.0),
        1 => Just(-0.0),
    ]
}

proptest! {
    #[test]
    fn order_and_grouping_do_not_matter(
        values in prop::collection::vec(value(), 0..60)
            .prop_flat_map(|values| (Just(values.clone()), Just(values).prop_shuffle())),
        cuts in (0..60_usize, 0..60_usize),
    ) {
        let (values, shuffled) = values;
        let whole = Sample::from_values(values.iter().copied());
        prop_assert!(whole.count() + whole.undefined() == values.len() as u64);
        let ends = [cuts.0.min(cuts.1), cuts.0.max(cuts.1)];
        let [a, b] = ends.map(|end| end.min(values.len()));
        let mut merged = Sample::from_values(shuffled[b..].iter().copied());
        let mut rest = Sample::from_values(shuffled[..a].iter().copied());
        rest.merge(&Sample::from_values(shuffled[a..b].iter().copied()));
        merged.merge(&rest);
        let bytes = postcard::to_stdvec(&whole).unwrap();
        prop_assert_eq!(&whole, &merged);
        prop_assert_eq!(&bytes, &postcard::to_stdvec(&merged).unwrap());
        let read: Sample = postcard::from_bytes(&bytes).unwrap();
        prop_assert_eq!(&read, &merged);
        prop_assert_eq!(
            format!("{:?}", read.statistics(Worse::Larger)),
            format!("{:?}", merged.statistics(Worse::Larger))
        );
    }
}
