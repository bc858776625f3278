use super::*;
use crate::metric::quantile;
use crate::signal::normal::fill_standard_normal;
use crate::signal::{Purpose, stream};
use proptest::prelude::*;

fn normals(count: usize) -> Vec<f64> {
    let mut z = vec![0.0; count];
    fill_standard_normal(&mut stream(11, 0, Purpose::NoiseDrive), &mut z);
    z
}

fn number() -> impl Strategy<Value = f64> {
    any::<u64>()
        .prop_map(f64::from_bits)
        .prop_filter("NaN", |x| !x.is_nan())
}

#[test]
fn bins_of_special_values() {
    let values = [
        f64::NEG_INFINITY,
        f64::MIN,
        -1.0,
        -f64::from_bits(1),
        0.0,
        f64::from_bits(1),
        1.0,
        f64::MAX,
        f64::INFINITY,
    ];
    let bins: Vec<i32> = values.iter().map(|x| bin_of(*x)).collect();
    assert!(bins.is_sorted_by(|a, b| a < b));
    assert_eq!((bins[0], bins[4], bins[8]), (-INFINITE, 0, INFINITE));
    assert_eq!(bin_of(-0.0), 0);
    assert_eq!(edges(bin_of(1.0)), (1.0, 1.0 + 2.0 * SKETCH_ERROR));
    assert_eq!(edges(bin_of(f64::MAX)).1, f64::MAX);
    let sketch = Sketch::from_values(values);
    assert_eq!(sketch.quantile(0.0).value, f64::NEG_INFINITY);
    assert_eq!(sketch.quantile(0.5).value, 0.0);
    assert_eq!(sketch.quantile(1.0).value, f64::INFINITY);
    assert!(sketch.trimmed_mean(0.0).value.is_nan());
}

#[test]
fn an_empty_sketch_and_a_single_value() {
    let empty = Sketch::default();
    assert!(empty.quantile(0.5).value.is_nan() && empty.trimmed_mean(0.1).value.is_nan());
    assert_eq!((empty.count(), empty.share_below(1.0).total), (0, 0));
    let lone = Sketch::from_values([4.0]);
    let middle = 4.0 * (1.0 + SKETCH_ERROR);
    assert_eq!(lone.quantile(0.3).value, middle);
    assert_eq!(lone.trimmed_mean(0.4).value, middle);
    assert!(lone.quantile(0.3).mcse.is_nan() && lone.trimmed_mean(0.4).mcse.is_nan());
    // For equal values, only the bin limits the accuracy; zero is known exactly.
    let alike = Sketch::from_values([4.0; 10]).quantile(0.5);
    assert!((alike.mcse - 4.0 * SKETCH_ERROR / Z).abs() < 1e-15);
    let zero = Sketch::from_values([0.0; 10]).quantile(0.5);
    assert_eq!((zero.value, zero.mcse), (0.0, 0.0));
}

/// Quantiles agree with those of the sorted values, to the resolution of the bins; so do their standard errors.
#[test]
fn quantiles_agree_with_sorted_values() {
    for count in [1, 2, 3, 10, 400, 20_000] {
        let mut sorted = normals(count);
        let sketch = Sketch::from_values(sorted.iter().copied());
        sorted.sort_by(f64::total_cmp);
        for q in [0.0, 0.01, 0.05, 0.25, 0.5, 0.6, 0.95, 1.0] {
            let (exact, found) = (quantile(&sorted, q), sketch.quantile(q));
            // Neighbours are at most as large as the next order statistic.
            let scale = sorted[((q * count as f64) as usize).min(count - 1)].abs() + 0.1;
            assert!(
                (exact.value - found.value).abs() <= 2.0 * SKETCH_ERROR * scale,
                "{count} {q} {exact:?} {found:?}"
            );
            assert_eq!(found.mcse.is_nan(), exact.mcse.is_nan());
            assert!(!(found.mcse < exact.mcse - 4.0 * SKETCH_ERROR * scale));
        }
    }
}

/// 2^20 values in one octave are 1024 to a bin. Positions inside a bin are then much finer than the bin, but the
/// standard error stays at the bin's half width over 1.96.
#[test]
fn dense_values_are_resolved_by_rank() {
    let m = 1 << 20;
    let values = (0..m).map(|i| 1.0 + (f64::from(i) + 0.5) / f64::from(m));
    let sketch = Sketch::from_values(values);
    for q in [0.1, 0.5, 0.77777] {
        let found = sketch.quantile(q);
        assert!((found.value - (1.0 + q)).abs() < 1.0 / f64::from(m));
        let expected = (q * (1.0 - q) / f64::from(m)).sqrt();
        assert!(found.mcse >= (SKETCH_ERROR / Z).max(expected * 0.99));
        assert!(found.mcse <= (SKETCH_ERROR / Z).max(expected * 1.01) * (1.0 + 1e-9));
    }
    assert_eq!(sketch.share_below(1.5).count, 1 << 19);
    assert_eq!(sketch.share_below(1.0).count, 0);
    assert_eq!(sketch.share_below(2.0).count, 1 << 20);
    assert!((sketch.share_below(1.123_456).share - 0.123_456).abs() < 1e-5);
}

/// By hand: 0 and 100 are cut from 0, 1, 2, 3, 4, 5, 6, 7, 8, 100; winsorised 1, 1, 2, ..., 8, 8. The integers are
/// replaced by the middles of their bins, so the tolerance is 2^-11 of the largest.
#[test]
fn trimmed_means_by_hand() {
    let values = [5.0, 0.0, 1.0, 2.0, 100.0, 3.0, 4.0, 6.0, 7.0, 8.0];
    let found = Sketch::from_values(values).trimmed_mean(0.1);
    assert!((found.value - 4.5).abs() <= 8.0 * SKETCH_ERROR);
    // Sum of squares about 4.5: 2 (3.5^2 + 3.5^2 + 2.5^2 + 1.5^2 + 0.5^2) = 66.5
    let expected = (66.5_f64 / 9.0).sqrt() / (0.8 * 10.0_f64.sqrt());
    assert!((found.mcse - expected).abs() <= expected * 4.0 * SKETCH_ERROR);
    // Nothing is cut: the mean and its standard error.
    let all = Sketch::from_values(values).trimmed_mean(0.05);
    assert!((all.value - 13.6).abs() <= 100.0 * SKETCH_ERROR);
}

#[test]
fn storage_is_compact_and_checked() {
    let sketch = Sketch::from_values(normals(20_000));
    let bytes = postcard::to_stdvec(&sketch).unwrap();
    assert!(bytes.len() <= 3 * sketch.bins.len() + 16);
    assert_eq!(postcard::from_bytes::<Sketch>(&bytes).unwrap(), sketch);
    let beyond = (2 * INFINITE + 1) as u32;
    for bad in [
        vec![(beyond, 1_u64)],
        vec![(u32::MAX, 1)],
        vec![(5, 0)],
        vec![(5, 1), (0, 1)],
        vec![(5, u64::MAX), (1, 1)],
        vec![(5, 1 << 42)],
    ] {
        let bytes = postcard::to_stdvec(&bad).unwrap();
        assert!(postcard::from_bytes::<Sketch>(&bytes).is_err(), "{bad:?}");
    }
    // A forged count fits its own word whatever is added to it.
    let forged = postcard::to_stdvec(&vec![(5, (1_u64 << 42) - 1), (1, 7)]).unwrap();
    let mut forged: Sketch = postcard::from_bytes(&forged).unwrap();
    forged.merge(&forged.clone());
    let counts: Vec<u64> = forged.bins().map(|(.., count)| count).collect();
    assert_eq!(counts, [(1 << 42) - 1, 14]);
}

proptest! {
    #[test]
    fn a_value_is_near_the_middle_of_its_bin(x in number()) {
        let middle = inside(bin_of(x), 0.5);
        let (low, high) = edges(bin_of(x));
        prop_assert!(low <= x && x <= high);
        prop_assert!(bin_of(middle) == bin_of(x));
        if x.is_normal() {
            prop_assert!((middle - x).abs() <= SKETCH_ERROR * x.abs());
        }
    }

    #[test]
    fn bins_ascend(x in number(), y in number()) {
        prop_assert!(x > y || bin_of(x) <= bin_of(y));
    }

    #[test]
    fn order_and_grouping_do_not_matter(
        values in prop::collection::vec(prop_oneof![number(), -2.0..2.0], 0..60)
            .prop_flat_map(|values| (Just(values.clone()), Just(values).prop_shuffle())),
        cut in 0..60_usize,
    ) {
        let (values, shuffled) = values;
        let cut = cut.min(values.len());
        let whole = Sketch::from_values(values.iter().copied());
        let mut merged = Sketch::from_values(shuffled[cut..].iter().copied());
        merged.merge(&Sketch::from_values(shuffled[..cut].iter().copied()));
        prop_assert_eq!(&whole, &merged);
        prop_assert_eq!(whole.count(), values.len() as u64);
        let bytes = postcard::to_stdvec(&whole).unwrap();
        prop_assert_eq!(postcard::from_bytes::<Sketch>(&bytes).unwrap(), whole);
    }
}
