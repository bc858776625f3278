//! Kernel estimates against dense formulas, without noise, on long records, and where they fail.

use super::*;
use crate::data::{Detrend, Trend, csv};
use crate::estimator::test_setup::{self, estimate, plant};
use crate::estimator::{Progress, Shape};
use crate::signal::Purpose;
use serde_json::Value;

fn normal(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    test_setup::normal(83, trial, purpose, n)
}

/// `y = B/F u + sd e`.
fn record(truth: &LinearModel, sd: f64, trial: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let (u, e) = (normal(trial, Purpose::Input, n), normal(trial, Purpose::Plant, n));
    let mut y = vec![0.0; n];
    truth.simulate(&u, &mut y);
    y.iter_mut().zip(&e).for_each(|(y, e)| *y += sd * e);
    (u, y)
}

/// `reference.py` says how its numbers were made. Hyperparameters of a flat likelihood are known to about 1e-6 in
/// either program, and the taps with them.
#[test]
fn taps_and_intervals_of_another_program() {
    let cases: Value = serde_json::from_str(include_str!("reference.json")).unwrap();
    let cases = cases.as_array().unwrap();
    assert_eq!(cases.len(), 12);
    for case in cases {
        let number = |key: &str| case[key].as_f64().unwrap();
        let text = |key: &str| case[key].as_str().unwrap();
        let numbers = |key: &str| -> Vec<f64> {
            case[key]
                .as_array()
                .unwrap()
                .iter()
                .map(|x| x.as_f64().unwrap())
                .collect()
        };
        let path = format!("../../tests/recorded_data/data/{}", text("file"));
        let record = csv::read(std::fs::File::open(path).unwrap()).unwrap();
        let n = number("N") as usize;
        let less_mean = |signal: &[f64]| {
            let mut signal = signal[..n].to_vec();
            Trend::fit(Detrend::Mean, &signal).subtract(&mut signal);
            signal
        };
        let (u, y) = (less_mean(&record.u), less_mean(&record.y));
        let options = KernelFirOptions {
            orders: Some(Orders::arx(0, number("taps") as usize, number("nk") as usize)),
            kernel: text("kernel").parse().unwrap(),
            noise_variance: text("noise_variance").parse().unwrap(),
            ..KernelFirOptions::default()
        };
        let pass = estimate(&options, 1, &u, &y);
        let name = format!("{} {} {}", text("file"), text("kernel"), text("noise_variance"));
        assert_eq!(pass.failure, None, "{name}");
        let near = |what: &str, found: &[f64], expected: &[f64], allowed: f64| {
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (found, expected) in found.iter().zip(expected) {
                let error = (found - expected).abs() / largest;
                assert!(error < allowed, "{name} {what}: {found} {expected} ({error:e})");
            }
        };
        near("s^2", &[pass.model.noise_variance], &[number("s2")], 1e-5);
        near("g", &pass.model.b[pass.model.delay..], &numbers("g"), 1e-5);
        near("se", &pass.model.standard_errors().unwrap(), &numbers("se"), 1e-5);
    }
}

/// The response and every reduced model, orders 1 to 4, delays 0 to 2. 0.6^50 is below 1e-11.
#[test]
fn a_record_without_noise_gives_its_model() {
    for order in 1..=4_usize {
        let mut f = vec![1.0];
        for pole in &[0.6, -0.4, 0.3, -0.2][..order] {
            f = crate::model::polynomial::multiply(&f, &[1.0, -pole]);
        }
        let b = (0..order).map(|i| 1.0 / (1.0 + i as f64));
        let theta: Vec<f64> = b.chain(f[1..].iter().copied()).collect();
        for (nk, kernel) in (0..3).zip(Kernel::ALL) {
            let orders = format!("nb={order},nf={order},nk={nk}");
            let truth = plant(&orders, &theta);
            let (u, y) = record(&truth, 0.0, order as u64, 200);
            let options = KernelFirOptions {
                orders: Some(truth.orders()),
                kernel: *kernel,
                taps: Some(50),
                ..KernelFirOptions::default()
            };
            let pass = estimate(&options, order, &u, &y);
            // Without noise the reduction ends at rounding, where its search may not see that it has settled.
            let left = pass.failure.is_none_or(|failure| failure.kind.leaves_a_model());
            assert!(left, "{orders} {kernel}: {:?}", pass.failure);
            assert_eq!(pass.progress, Progress::InitialState, "{orders} {kernel}");
            for (found, truth) in pass.model.parameters().zip(&theta) {
                assert!((found - truth).abs() < 1e-7, "{orders} {kernel}: {found} {truth}");
            }
        }
    }
}

/// Efficient in white output noise: at 20,000 samples within four standard errors, which are those of the bound.
#[test]
fn the_bound_at_twenty_thousand_samples() {
    let truth = plant("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7]);
    let (u, y) = record(&truth, 0.5, 7, 20_000);
    for kernel in Kernel::ALL {
        let options = KernelFirOptions {
            kernel: *kernel,
            ..KernelFirOptions::default()
        };
        let pass = estimate(&options, 2, &u, &y);
        assert_eq!(pass.failure, None);
        let errors = pass.model.standard_errors().unwrap();
        let oe = crate::estimator::OeOptions::default();
        let mut efficient = oe
            .prepare(
                &Shape {
                    order: 2,
                    window: u.len(),
                }
                .into(),
            )
            .unwrap();
        let mut passes = [Pass::new(2)];
        efficient.estimate(Window::new(&u, &y, u.len()), &mut passes);
        let bound = passes[0].model.standard_errors().unwrap();
        for (i, (found, truth)) in pass.model.parameters().zip(truth.parameters()).enumerate() {
            assert!((found - truth).abs() < 4.0 * errors[i], "{kernel}: {found} {truth}");
            let ratio = errors[i] / bound[i];
            assert!((0.9..1.1).contains(&ratio), "{kernel}: {ratio}");
        }
    }
}

/// Nominal 95 % intervals of the taps cover the truth about as often, over 60 records of 150 samples. They average over
/// the prior, so the share of all taps is tested, not each tap's.
#[test]
fn intervals_cover_the_response() {
    let truth = plant("nb=2,nf=2", &[1.0, 0.5, -1.5, 0.7]);
    let mut impulse = vec![0.0; 51];
    impulse[0] = 1.0;
    let mut response = vec![0.0; 51];
    truth.simulate(&impulse, &mut response);
    let (mut covered, mut all) = (0, 0);
    for trial in 0..60 {
        let (u, y) = record(&truth, 1.0, 100 + trial, 150);
        let options = KernelFirOptions {
            orders: Some(Orders::arx(0, 50, 1)),
            ..KernelFirOptions::default()
        };
        let pass = estimate(&options, 1, &u, &y);
        assert_eq!(pass.failure, None);
        let errors = pass.model.standard_errors().unwrap();
        for (i, error) in errors.iter().enumerate() {
            all += 1;
            covered += usize::from((pass.model.b[1 + i] - response[1 + i]).abs() < 1.96 * error);
        }
    }
    let share = f64::from(covered as u32) / f64::from(all);
    assert!((0.85..0.999).contains(&share), "{share}");
}

/// Short noisy records: FIT of the response over new samples without noise. The median of the reduced response is above
/// that of the output-error method of the true order.
#[test]
fn short_noisy_records_gain() {
    let truth = plant("nb=4,nf=4", &[0.3, 0.5, -0.2, 0.1, -1.9, 1.6, -0.9, 0.35]);
    let mut fits = [Vec::new(), Vec::new(), Vec::new()];
    let (v, mut x) = (normal(1, Purpose::InitialState, 400), vec![0.0; 400]);
    truth.simulate(&v, &mut x);
    for trial in 0..40 {
        let (u, y) = record(&truth, 1.0, 300 + trial, 100);
        let kernel = |orders: &str| {
            let options = KernelFirOptions {
                orders: Some(orders.parse().unwrap()),
                ..KernelFirOptions::default()
            };
            estimate(&options, 4, &u, &y)
        };
        let oe = crate::estimator::OeOptions::default();
        let mut oe = oe
            .prepare(
                &Shape {
                    order: 4,
                    window: u.len(),
                }
                .into(),
            )
            .unwrap();
        let mut passes = [Pass::new(4)];
        oe.estimate(Window::new(&u, &y, u.len()), &mut passes);
        let [of_oe] = passes;
        let found = [kernel("nb=50,nf=0"), kernel("nb=4,nf=4"), of_oe];
        for (fits, pass) in fits.iter_mut().zip(found) {
            let mut simulated = vec![0.0; 400];
            pass.model.simulate(&v, &mut simulated);
            let square = |f: &dyn Fn(usize) -> f64| (0..400).map(|k| f(k).powi(2)).sum::<f64>();
            let fit = 1.0 - (square(&|k| x[k] - simulated[k]) / square(&|k| x[k])).sqrt();
            fits.push(100.0 * fit);
        }
    }
    let [response, reduced, oe] = fits.map(|mut fits| {
        fits.sort_by(f64::total_cmp);
        fits[20]
    });
    assert!(response > oe && reduced > oe, "{response} {reduced} {oe}");
}

#[test]
fn what_cannot_be_estimated_is_typed() {
    let (u, zero) = (normal(5, Purpose::Input, 60), vec![0.0; 60]);
    let kind = |options: &KernelFirOptions, u: &[f64], y: &[f64]| estimate(options, 1, u, y).failure.unwrap().kind;
    let options = KernelFirOptions::default();
    assert_eq!(kind(&options, &u, &zero), FailureKind::Singular);
    assert_eq!(kind(&options, &zero, &u), FailureKind::Singular);
    let mut huge = u.clone();
    huge[3] = f64::MAX;
    huge[4] = f64::MAX;
    assert_eq!(kind(&options, &u, &huge), FailureKind::NonFinite);
    // A sine is exciting of order two only: least squares has no variance, the likelihood has one.
    let sine: Vec<f64> = (0..60).map(|k| (0.7 * f64::from(k)).sin()).collect();
    let complete = KernelFirOptions {
        rows: Some(Rows::Complete),
        taps: Some(20),
        ..options.clone()
    };
    assert_eq!(kind(&complete, &sine, &u), FailureKind::RankDeficient);
    let likelihood = KernelFirOptions {
        noise_variance: NoiseVariance::Likelihood,
        orders: Some(Orders::arx(0, 20, 1)),
        taps: None,
        ..complete
    };
    assert_eq!(estimate(&likelihood, 1, &sine, &u).failure, None);
    let short = Shape { order: 4, window: 8 };
    let error = options.prepare(&short.into()).err().unwrap().to_string();
    assert!(error.contains("too short for orders"), "{error}");
    for (orders, taps, part) in [
        ("nb=2,nf=2", Some(0), "expected 1 to"),
        ("nb=20,nf=0", Some(5), "nf = 0"),
        ("na=1,nb=1", None, "the model has no A"),
    ] {
        let options = KernelFirOptions {
            orders: Some(orders.parse().unwrap()),
            taps,
            ..KernelFirOptions::default()
        };
        let error = options.check().unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// A pole at 0.985 by default: the taps, and those of the FIR model of `wnsf`, are doubled until they hold the
/// response, and both find the pole. With 60 taps the model is too fast, and that is its status.
#[test]
fn the_length_follows_the_record() {
    let truth = plant("nb=1,nf=1", &[0.02, -0.985]);
    let (u, y) = record(&truth, 0.01, 1, 1200);
    let orders = Some("nb=1,nf=1,nk=1".parse().unwrap());
    let taps = |taps| KernelFirOptions {
        orders,
        taps,
        ..KernelFirOptions::default()
    };
    let wnsf = |high_order| crate::estimator::methods::wnsf::WnsfOptions {
        orders,
        high_order,
        ..Default::default()
    };
    let all: [[Box<dyn MethodKind>; 2]; 2] = [
        [Box::new(taps(None)), Box::new(taps(Some(60)))],
        [Box::new(wnsf(None)), Box::new(wnsf(Some(60)))],
    ];
    for [free, cut] in all {
        let pass = estimate(free.as_ref(), 1, &u, &y);
        assert_eq!(pass.failure, None);
        let error = pass.model.standard_errors().unwrap()[1];
        assert!(
            (pass.model.f[1] + 0.985).abs() < 5.0 * error,
            "{:?} {error}",
            pass.model.f
        );
        let pass = estimate(cut.as_ref(), 1, &u, &y);
        assert_eq!(pass.failure.map(|failure| failure.kind), Some(FailureKind::Implausible));
        assert!(pass.model.covariance.is_empty());
    }
}
