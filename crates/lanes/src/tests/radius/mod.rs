//! The spectral radius against roots of 50 digits, and equal bits at every width.

use super::tested;
use crate::{Call, LARGEST_ORDER, order};
use asobench_identification::plant::radius::spectral_radius;
use asobench_identification::plant::stability::is_stable;
use asobench_identification::plant::{PoleFinder, random_stable};
use asobench_identification::real::{MOST_LANES, Real};
use asobench_identification::signal::{Purpose, stream};

/// A polynomial, the radius of its zeros, and how far rounding of the coefficients moves that radius.
struct Polynomial {
    name: &'static str,
    radius: f64,
    condition: f64,
    a: Vec<f64>,
}

/// Returns the table made by roots.py: name, radius, condition, `a_1 ... a_n`.
fn table() -> Vec<Polynomial> {
    let lines = include_str!("roots.tsv").lines();
    let polynomial = |line: &'static str| {
        let mut fields = line.split('\t');
        let name = fields.next().expect("a name");
        let mut numbers = fields.map(|number| number.parse().expect("a number"));
        let mut next = || numbers.next().expect("a number");
        Polynomial {
            name,
            radius: next(),
            condition: next(),
            a: numbers.collect(),
        }
    };
    lines.map(polynomial).collect()
}

/// Computes the radius by the scalar path.
fn radius(a: &[f64]) -> f64 {
    let stable = is_stable(a, &mut vec![0.0; a.len()]);
    PoleFinder::new(a.len()).spectral_radius(a, stable)
}

/// Computes the radii of up to a pack of polynomials of one order, one in each lane.
struct Radii<'p>(&'p [&'p [f64]]);

impl Call for Radii<'_> {
    type Output = Vec<f64>;

    fn with<R: Real, const N: usize>(self) -> Vec<f64> {
        let n = self.0[0].len();
        let packs = self.0.chunks(R::LANES);
        let radii = packs.flat_map(|pack| {
            let lane = |i: usize, lane: usize| pack[lane.min(pack.len() - 1)][i];
            let mut a = [R::zero(); N];
            for (i, a) in a[..n].iter_mut().enumerate() {
                *a = R::load(&std::array::from_fn::<f64, MOST_LANES, _>(|l| lane(i, l)));
            }
            let radius = R::run(
                #[inline(always)]
                || {
                    let a = &a[..order::<N>(n)];
                    let stable = is_stable(a, &mut [R::zero(); N][..a.len()]);
                    spectral_radius::<R, N>(a, stable)
                },
            );
            (0..pack.len()).map(move |l| radius.lane(l))
        });
        radii.collect()
    }
}

#[test]
fn the_radius_is_as_exact_as_its_condition_allows() {
    let table = table();
    assert!(table.len() > 250);
    for Polynomial {
        name,
        radius: exact,
        condition,
        a,
    } in &table
    {
        let found = radius(a);
        let allowed = 4.0 * f64::EPSILON * condition.max(1.0) * exact;
        let error = (found - exact).abs();
        assert!(
            error <= allowed,
            "{name}, order {}: {found:e} for {exact:e}, {error:e} > {allowed:e}",
            a.len()
        );
    }
}

/// Neighbours that take another number of steps, do not converge or are not finite change no bit.
#[test]
fn every_width_gives_the_bits_of_one_number() {
    let table = table();
    for n in 1..=LARGEST_ORDER {
        let of_table = table.iter().filter(|plant| plant.a.len() == n);
        let mut all: Vec<Vec<f64>> = of_table.map(|plant| plant.a.clone()).collect();
        for special in [f64::NAN, f64::INFINITY, f64::MAX, 5e-324, -1e-310] {
            all.push(vec![special; n]);
            let mut single = vec![0.5; n];
            single[n / 2] = special;
            all.push(single);
        }
        let expected: Vec<u64> = all.iter().map(|a| radius(a).to_bits()).collect();
        let all: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
        for isa in tested() {
            for from in 0..MOST_LANES {
                let found = isa.dispatch(n, Radii(&all[from..]));
                let found: Vec<u64> = found.iter().map(|radius| radius.to_bits()).collect();
                assert_eq!(found, expected[from..], "{isa}, order {n}, from {from}");
            }
        }
    }
}

/// Tested on random polynomials whose largest zeros are within a few roundings of the unit circle, on both sides of it.
#[test]
fn the_radius_is_one_or_more_exactly_where_the_polynomial_is_not_stable() {
    let (mut unstable, mut near, count) = (0, 0, 4000);
    for trial in 0..count {
        let n = 1 + trial as usize % 12;
        let plant = random_stable(n, 0.95, &mut stream(8, trial, Purpose::Plant));
        let largest = PoleFinder::new(n).poles(plant.a())[0].norm();
        let ulps = (trial % 7) as f64 - 3.0;
        let scale = (1.0 + ulps * f64::EPSILON) / largest;
        let scaled = plant.a().iter().enumerate();
        let a: Vec<f64> = scaled.map(|(i, a)| a * scale.powi((n - i) as i32)).collect();
        let stable = is_stable(&a, &mut vec![0.0; n]);
        let radius = radius(&a);
        assert_eq!(stable, radius < 1.0, "{a:?}: {radius:e}");
        unstable += usize::from(!stable);
        near += usize::from((radius - 1.0).abs() < 1e-12);
    }
    let range = count as usize / 5..count as usize * 4 / 5;
    assert!(range.contains(&unstable), "{unstable}");
    assert!(near > count as usize * 9 / 10, "{near}");
}

#[test]
fn radii_that_are_known() {
    for (a, expected) in [
        (vec![-0.25], 0.25),
        (vec![0.0; 5], 0.0),
        (vec![0.0, 0.0, -3.0], 3.0),
        (vec![1e300], 1e300),
        (vec![0.0, f64::MAX], f64::MAX),
        // (z - 1e-308)(z + 2e-308), whose constant coefficient underflows.
        (vec![0.0, -1e-308], 1e-308),
        // (z^2 - 1/4) z^3, and the same with a pair +- 2i.
        (vec![0.0, 0.0, 0.0, 0.25, 0.0], 0.5),
        (vec![0.0, 0.0, 0.0, 1.0, 0.0, -3.75, 0.0], 2.0),
        // All six numbers converged to the fivefold zero when they started within the circle of radius 2.
        (vec![0.0, 0.0, 0.0, 0.0, 0.0, -2.0], 2.0),
    ] {
        let found = radius(&a);
        let error = (found - expected).abs();
        assert!(
            error <= 2.0 * f64::EPSILON * expected,
            "{a:?}: {found:e} for {expected:e}"
        );
    }
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(radius(&[0.5, bad, 0.1]).is_nan());
    }
    // Above the orders of the iteration: the roots of unity, whose eigenvalues are well conditioned.
    let mut a = vec![0.0; 30];
    a[0] = 1.0;
    assert!((1.0..1.0 + 1e-13).contains(&radius(&a)));
}
