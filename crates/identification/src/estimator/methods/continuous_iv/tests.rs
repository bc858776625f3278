use super::*;
use crate::estimator::method_kind::MethodKind;
use crate::estimator::{ArxOptions, MethodOptions, Pass, Progress, Shape, StmcbOptions};
use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

fn draw(law: InputLaw, trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
    let mut signal = vec![0.0; n];
    let input = Input::new(law, 1.0, Sequence::Independent);
    input.fill(&mut stream(83, trial, purpose), &mut signal);
    signal
}

/// Random signs that change every `hold` samples.
fn signs(trial: u64, n: usize, hold: usize) -> Vec<f64> {
    let drawn = draw(InputLaw::Signs, trial, Purpose::Input, n);
    (0..n).map(|k| drawn[k / hold]).collect()
}

fn model(numerator: &[f64], denominator: &[f64], step: f64, hold: Hold) -> ContinuousModel {
    ContinuousModel {
        numerator: numerator.to_vec(),
        denominator: denominator.to_vec(),
        step,
        hold,
        ..ContinuousModel::default()
    }
}

/// The output of a model from rest, by its sampled form.
fn simulated(of: &ContinuousModel, u: &[f64]) -> Vec<f64> {
    let (nb, n) = (of.numerator.len(), of.denominator.len() - 1);
    let orders = ContinuousModel::sampled_orders(nb, n, of.hold, of.dead_time);
    let mut sampled = LinearModel::zero(orders);
    of.sample(&mut sampled);
    let mut y = vec![0.0; u.len()];
    sampled.simulate(u, &mut y);
    y
}

fn rao_garnier() -> ContinuousModel {
    model(
        &[-6400.0, 1600.0],
        &[1.0, 5.0, 408.0, 416.0, 1600.0],
        0.01,
        Hold::Zero,
    )
}

fn estimate(options: impl Into<MethodOptions>, order: usize, u: &[f64], y: &[f64]) -> Pass {
    let shape = Shape {
        order,
        window: y.len(),
    };
    let mut estimator = options.into().prepare(&shape.into()).expect("an estimator");
    let mut passes = [Pass::new(order)];
    estimator.estimate(Window::new(u, y, y.len()), &mut passes);
    let [pass] = passes;
    pass
}

fn srivc(of: &ContinuousModel) -> SrivcOptions {
    SrivcOptions {
        orders: Some(Orders {
            nb: of.numerator.len(),
            nf: of.denominator.len() - 1,
            nk: of.dead_time + 1,
            ..Orders::default()
        }),
        hold: of.hold,
        ts: Some(of.step),
        stabilise: None,
    }
}

/// Without noise every coefficient comes back, with a dead time, a direct term, both holds, and modes a decade apart.
#[test]
fn plants_are_recovered_without_noise() {
    let mut late = model(&[2.0], &[1.0, 4.0, 3.0], 0.05, Hold::Zero);
    late.dead_time = 3;
    let truths = [
        (rao_garnier(), 1e-8),
        (late, 1e-9),
        (model(&[1.0, 1.0], &[1.0, 0.5, 1.0], 0.1, Hold::First), 1e-9),
        (
            model(&[0.5, 1.0, 3.0], &[1.0, 0.5, 1.0], 0.1, Hold::Zero),
            1e-9,
        ),
        (model(&[1.0], &[1.0, 0.7], 1.5, Hold::Zero), 1e-9),
        (
            model(&[100.0, 2.0], &[1.0, 105.0, 500.0], 0.004, Hold::Zero),
            1e-8,
        ),
    ];
    for (trial, (truth, tolerance)) in truths.iter().enumerate() {
        let u = signs(trial as u64, 1000, 4);
        let y = simulated(truth, &u);
        // A record without noise does not tell a noise model: `rivc` has none here.
        let SrivcOptions {
            orders, hold, ts, ..
        } = srivc(truth);
        let rivc = RivcOptions {
            orders,
            hold,
            ts,
            ..RivcOptions::default()
        };
        for pass in [estimate(srivc(truth), 2, &u, &y), estimate(rivc, 2, &u, &y)] {
            assert_eq!(pass.failure, None, "{truth:?}");
            let found = pass.continuous.parameters();
            for (found, truth) in found.iter().zip(truth.parameters()) {
                assert!((found / truth - 1.0).abs() < *tolerance, "{found} {truth}");
            }
        }
    }
}

/// The truth at 20,000 samples is within four standard errors, in seconds and as a sampled model.
#[test]
fn consistent_at_twenty_thousand_samples() {
    let n = 20_000;
    let truth = rao_garnier();
    let orders = ContinuousModel::sampled_orders(2, 4, Hold::Zero, 0);
    let mut sampled = LinearModel::zero(orders);
    truth.sample(&mut sampled);
    let u = signs(1, n, 7);
    let x = simulated(&truth, &u);
    let noise = draw(InputLaw::Gaussian, 1, Purpose::Plant, n);
    let coloured = |c: &[f64], d: &[f64]| {
        let mut v = vec![0.0; n];
        filter(c, &noise, &mut v);
        divide(d, &mut v);
        x.iter().zip(&v).map(|(x, v)| x + v).collect::<Vec<f64>>()
    };
    let white = coloured(&[1.0], &[1.0]);
    let hybrid = coloured(&[1.0, 0.5], &[1.0, -0.85]);
    let rivc = RivcOptions {
        orders: Some("nb=2,nc=1,nd=1,nf=4,nk=1".parse().unwrap()),
        ts: Some(truth.step),
        ..RivcOptions::default()
    };
    let options: [(MethodOptions, &[f64], &[f64]); 2] = [
        (srivc(&truth).into(), &white, &[]),
        (rivc.into(), &hybrid, &[0.5, -0.85]),
    ];
    for (options, y, noise) in options {
        let pass = estimate(options, 4, &u, y);
        assert_eq!(pass.failure, None);
        let near = |found: Vec<f64>, truth: Vec<f64>, errors: Vec<f64>| {
            for ((found, truth), error) in found.iter().zip(truth).zip(errors) {
                assert!(
                    (found - truth).abs() < 4.0 * error,
                    "{found} {truth} {error}"
                );
            }
        };
        let continuous = &pass.continuous;
        let errors = continuous.standard_errors().expect("errors");
        near(continuous.parameters(), truth.parameters(), errors);
        let errors = pass.model.standard_errors().expect("errors");
        let all = [&sampled.b[1..], noise, &sampled.f[1..]].concat();
        near(pass.model.parameters().collect(), all, errors);
        assert!((pass.model.noise_variance - 1.0).abs() < 0.04);
    }
}

/// Standard errors are those that 200 records show: their squares average to the variance, within four of its errors.
#[test]
fn standard_errors_are_those_of_many_records() {
    let truth = model(&[2.0], &[1.0, 4.0, 3.0], 0.05, Hold::Zero);
    let (n, trials) = (600, 200);
    let mut squares = [0.0; 3];
    for trial in 0..trials {
        let u = signs(trial, n, 8);
        let mut y = simulated(&truth, &u);
        let noise = draw(InputLaw::Gaussian, trial, Purpose::Plant, n);
        y.iter_mut().zip(noise).for_each(|(y, e)| *y += 0.1 * e);
        let pass = estimate(srivc(&truth), 2, &u, &y);
        let continuous = &pass.continuous;
        let errors = continuous.standard_errors().expect("errors");
        let found = continuous.parameters();
        for (i, truth) in truth.parameters().iter().enumerate() {
            squares[i] += ((found[i] - truth) / errors[i]).powi(2) / trials as f64;
        }
    }
    for square in squares {
        assert!(
            (square - 1.0).abs() < 4.0 * (2.0 / trials as f64).sqrt(),
            "{square}"
        );
    }
}

/// The plant of Rao and Garnier at Ts = 0.01 and 10 dB, the published stress test of fast sampling. Over 20 records the
/// output without noise is found to 5 % by srivc in each, and by least squares of the sampled model in none. Where its
/// equations are filtered, as Steiglitz and McBride do, the sampled model is found too.
#[test]
fn fast_sampling_breaks_methods_in_discrete_time() {
    let truth = rao_garnier();
    let n = 1000;
    let orders: Orders = "nb=4,nf=4,nk=1".parse().unwrap();
    let mut good = [0; 3];
    for trial in 0..20 {
        let u = signs(100 + trial, n, 7);
        let x = simulated(&truth, &u);
        let size = (x.iter().map(|x| x * x).sum::<f64>() / n as f64).sqrt();
        let noise = draw(InputLaw::Gaussian, 100 + trial, Purpose::Plant, n);
        let y: Vec<f64> = x
            .iter()
            .zip(&noise)
            .map(|(x, e)| x + size * 0.1_f64.sqrt() * e)
            .collect();
        let arx = ArxOptions {
            orders: Some(Orders::arx(4, 4, 1)),
            ..ArxOptions::default()
        };
        let stmcb = StmcbOptions {
            orders: Some(orders),
            ..StmcbOptions::default()
        };
        let options: [MethodOptions; 3] = [srivc(&truth).into(), arx.into(), stmcb.into()];
        for (good, options) in good.iter_mut().zip(options) {
            let pass = estimate(options, 4, &u, &y);
            let mut found = vec![0.0; n];
            pass.model.simulate(&u, &mut found);
            let error = found
                .iter()
                .zip(&x)
                .map(|(f, x)| (f - x).powi(2))
                .sum::<f64>();
            *good += usize::from((error / n as f64).sqrt() < 0.05 * size);
        }
    }
    let [srivc, arx, stmcb] = good;
    println!("output found to 5 %: srivc {srivc}, arx {arx}, stmcb {stmcb} of 20");
    assert!(srivc == 20 && arx == 0 && stmcb > 0, "{good:?}");
}

/// A step in other seconds changes the coefficients' unit alone; the sampled model keeps its digits.
#[test]
fn seconds_are_a_unit() {
    let truth = rao_garnier();
    let u = signs(5, 500, 7);
    let y = simulated(&truth, &u);
    let of = |ts| {
        let options = SrivcOptions {
            ts,
            ..srivc(&truth)
        };
        estimate(options, 4, &u, &y)
    };
    let (one, other) = (of(None), of(Some(0.25)));
    for (one, other) in one.model.parameters().zip(other.model.parameters()) {
        assert!((one - other).abs() < 1e-13 * one.abs());
    }
    let ratio = other.continuous.denominator[1] / one.continuous.denominator[1];
    assert!((ratio - 4.0).abs() < 1e-12);
}

/// Every kind of failure, and none without its kind.
#[test]
fn failures_are_typed() {
    let n = 60;
    let kind = |pass: &Pass| pass.failure.map(|failure| failure.kind);
    let options = || srivc(&model(&[1.0], &[1.0, 1.0], 1.0, Hold::Zero));
    let u = signs(1, n, 1);
    let pass = estimate(options(), 1, &u, &vec![0.0; n]);
    assert_eq!(kind(&pass), Some(FailureKind::Singular));
    let pass = estimate(options(), 1, &vec![0.0; n], &u);
    assert_eq!(kind(&pass), Some(FailureKind::Singular));
    let pass = estimate(options(), 1, &u, &vec![f64::MAX; n]);
    assert_eq!(kind(&pass), Some(FailureKind::NonFinite));
    assert_eq!(pass.progress, Progress::Nothing);
    // An output that grows has no stable model; noise alone leaves iterations without rest, with a model.
    let growing: Vec<f64> = (0..n).map(|k| 1.2_f64.powi(k as i32)).collect();
    let none = SrivcOptions {
        stabilise: Some(Stabilise::None),
        ..options()
    };
    let pass = estimate(none, 1, &u, &growing);
    assert_eq!(kind(&pass), Some(FailureKind::UnstablePredictor));
    let mut limits = 0;
    for trial in 0..40 {
        let (u, y) = (
            signs(trial, n, 1),
            draw(InputLaw::Gaussian, trial, Purpose::Plant, n),
        );
        let pass = estimate(srivc(&rao_garnier()), 4, &u, &y);
        if kind(&pass) == Some(FailureKind::IterationLimit) {
            limits += 1;
            assert!(pass.continuous.covariance.is_empty() && pass.model.covariance.is_empty());
            assert!(pass.progress == Progress::InitialState);
        }
    }
    assert!(limits > 0);
    let short = Shape {
        order: 4,
        window: 6,
    };
    let refused = srivc(&rao_garnier()).prepare(&short.into());
    assert!(matches!(refused, Err(SetupError::ShortRecord { .. })));
    for orders in [
        "nb=2",
        "nb=3,nf=1",
        "nb=1,nf=1,nk=0",
        "na=1,nb=1,nf=1",
        "nb=1,nf=1,nc=1",
    ] {
        let options = SrivcOptions {
            orders: Some(orders.parse().unwrap()),
            ..SrivcOptions::default()
        };
        assert!(options.check().is_err(), "{orders}");
    }
    let ts = SrivcOptions {
        ts: Some(-1.0),
        ..SrivcOptions::default()
    };
    assert_eq!(ts.check().unwrap_err().key.as_deref(), Some("ts"));
}
