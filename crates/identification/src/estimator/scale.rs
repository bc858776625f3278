//! The scale of a record: none that can be measured changes a model.

use super::{Covariance, Estimator, Pass, ProgramError, Records, Visit, Window};
use crate::real::with_fma;

/// The binary exponents of the largest sample that estimators are given as they are: squares, and products of four
/// samples, neither overflow nor underflow.
const BAND: std::ops::RangeInclusive<i32> = -64..=64;

/// Returns the power of two that brings the largest of some samples to between 1 and 2; 1 for samples that need none,
/// because it is within 2^-64 to 2^65, zero, or not finite.
pub fn unit_of(signals: &[&[f64]]) -> f64 {
    let largest = with_fma(
        #[inline(always)]
        || {
            let sizes = signals.iter().map(|signal| largest_size(signal));
            sizes.fold(0.0, larger)
        },
    );
    let exponent = ((largest.to_bits() >> 52) as i32) - 1023;
    if largest == 0.0 || largest.is_infinite() || BAND.contains(&exponent) {
        return 1.0;
    }
    // 2^1023 / 2^1023 is 1, and the inverse of a unit is a normal number.
    2.0_f64.powi(exponent.max(-1022))
}

/// The larger number; `of` where x is not a number.
#[inline(always)]
fn larger(of: f64, x: f64) -> f64 {
    if x > of { x } else { of }
}

/// Returns the largest size of some samples, those that are not numbers left out.
#[inline(always)]
fn largest_size(signal: &[f64]) -> f64 {
    let mut most = [0.0; 16];
    let (whole, rest) = signal.as_chunks::<16>();
    for samples in whole {
        for (most, x) in most.iter_mut().zip(samples) {
            *most = larger(*most, x.abs());
        }
    }
    let rest = rest.iter().map(|x| x.abs());
    most.into_iter().chain(rest).fold(0.0, larger)
}

/// An estimator that sees records far from 1 in a unit of its own, a power of two that u, y and r share. So no sample
/// is rounded, and the polynomials of the model and the covariance of their coefficients need no change.
pub(super) struct Scaled {
    inner: Box<dyn Estimator>,
    signals: [Vec<f64>; 3],
}

impl Scaled {
    pub(super) fn new(inner: Box<dyn Estimator>) -> Self {
        let signals = std::array::from_fn(|_| Vec::new());
        Self { inner, signals }
    }
}

impl Scaled {
    /// Keeps the samples in their unit, if it is not 1, and returns it.
    fn rescale(&mut self, window: Window<'_>) -> f64 {
        let given = [window.u, window.y, window.r];
        let unit = unit_of(&given);
        if unit != 1.0 {
            for (scaled, given) in self.signals.iter_mut().zip(given) {
                scaled.clear();
                scaled.extend(given.iter().map(|sample| sample / unit));
            }
        }
        unit
    }
}

impl Estimator for Scaled {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let unit = self.rescale(window);
        if unit == 1.0 {
            return self.inner.estimate(window, passes);
        }
        let [u, y, r] = &self.signals;
        let scaled = Window::with_reference(u, y, r, window.len());
        self.inner.estimate(scaled, passes);
        for pass in passes {
            pass.set_unit(unit);
        }
    }

    fn estimate_from(&mut self, known: &[Pass], window: Window<'_>, passes: &mut [Pass]) {
        // In another unit the known passes would have to be brought back to it.
        if unit_of(&[window.u, window.y, window.r]) == 1.0 {
            self.inner.estimate_from(known, window, passes);
        } else {
            self.estimate(window, passes);
        }
    }

    fn estimate_again(
        &mut self,
        covariance: Covariance,
        window: Window<'_>,
        found: &[Pass],
        passes: &mut [Pass],
    ) -> bool {
        unit_of(&[window.u, window.y, window.r]) == 1.0
            && self.inner.estimate_again(covariance, window, found, passes)
    }

    fn run_along(
        &mut self,
        window: Window<'_>,
        at: &[usize],
        pass: &mut Pass,
        visit: &mut Visit<'_>,
    ) {
        let unit = self.rescale(window);
        if unit == 1.0 {
            return self.inner.run_along(window, at, pass, visit);
        }
        let [u, y, r] = &self.signals;
        let scaled = Window::with_reference(u, y, r, window.len());
        let mut in_samples = Vec::new();
        self.inner
            .run_along(scaled, at, pass, &mut |k, pass, state| {
                in_samples.clear();
                in_samples.extend(state.into_iter().flatten().map(|x| x * unit));
                visit(k, pass, state.map(|_| &in_samples[..]));
            });
    }

    fn gather(&mut self, trial: u64, records: &mut dyn Records) -> Result<(), ProgramError> {
        self.inner.gather(trial, records)
    }
}

#[cfg(all(test, feature = "json"))]
mod tests {
    use super::*;
    use crate::data::csv;
    use crate::estimator::{EstimatorName, Method, Problem, Progress, Shape};

    /// The model of a record is that of the record in any other unit, from 1e-150 to 1e150, for every estimator.
    #[test]
    fn the_same_model_at_every_scale() {
        let record = include_bytes!("../../../../examples/record.csv");
        let record = csv::read(&record[..]).unwrap();
        let shape = Shape {
            order: 2,
            window: 400,
        };
        let model = |name: EstimatorName, scale: f64| {
            let times = |values: &[f64]| -> Vec<f64> { values.iter().map(|v| v * scale).collect() };
            let (u, y) = (times(&record.u), times(&record.y));
            let method = Method::named(name.name(), name.parse(serde_json::Map::new()).unwrap());
            let mut estimator = method
                .prepare(Problem {
                    covariance: true,
                    ..shape.into()
                })
                .ok()?;
            let mut passes = vec![Pass::new(shape.order); method.passes()];
            estimator.estimate(Window::new(&u, &y, shape.window), &mut passes);
            passes.pop()
        };
        let mut compared = 0;
        for name in EstimatorName::ALL {
            // `known` needs the plant.
            let Some(pass) = model(*name, 1.0) else {
                assert_eq!(name.name(), "known");
                continue;
            };
            assert_eq!(pass.progress, Progress::InitialState, "{name}");
            for power in (-150..=150).step_by(75) {
                let scale = 10.0_f64.powi(power);
                let other = model(*name, scale).unwrap();
                let near = |what: &str, a: &[f64], b: &[f64], unit: f64| {
                    assert_eq!(a.len(), b.len(), "{name} 1e{power}: {what}");
                    let largest = a.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
                    for (a, b) in a.iter().zip(b) {
                        let b = b / unit;
                        let close = (a - b).abs() <= 1e-6 * largest || a.is_nan() && b.is_nan();
                        assert!(close, "{name} 1e{power}: {what} {a} and {b}");
                    }
                };
                let (m, o) = (&pass.model, &other.model);
                near("A", &m.a, &o.a, 1.0);
                near("B", &m.b, &o.b, 1.0);
                near("C", &m.c, &o.c, 1.0);
                near("D", &m.d, &o.d, 1.0);
                near("F", &m.f, &o.f, 1.0);
                near("covariance", &m.covariance, &o.covariance, 1.0);
                near("x0", &pass.x0, &other.x0, scale);
                let variance = |pass: &Pass| [pass.model.noise_variance.sqrt()];
                near("sigma", &variance(&pass), &variance(&other), scale);
                let values = (&pass.singular_values, &other.singular_values);
                near("singular values", values.0, values.1, scale);
                near("rho", &pass.correlations, &other.correlations, 1.0);
                compared += 1;
            }
        }
        assert_eq!(compared, 5 * (EstimatorName::ALL.len() - 1));
    }

    #[test]
    fn units_are_powers_of_two() {
        for (largest, unit) in [
            (1.0, 1.0),
            (1e19, 1.0),
            (1e-19, 1.0),
            (0.0, 1.0),
            (f64::INFINITY, 1.0),
            (3.0 * 2.0_f64.powi(100), 2.0_f64.powi(101)),
            (1.5 * 2.0_f64.powi(-100), 2.0_f64.powi(-100)),
            (f64::MAX, 2.0_f64.powi(1023)),
            (5e-324, 2.0_f64.powi(-1022)),
        ] {
            assert_eq!(unit_of(&[&[0.0, -largest], &[largest / 4.0]]), unit);
        }
    }
}
