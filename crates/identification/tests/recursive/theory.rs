//! Against least squares, against the plant without noise, and against asymptotic theory.

use super::{distance, run};
use asobench_identification::estimator::recursive::{
    ExtendedLeastSquares, RecursiveEstimator, RecursiveForm, RecursiveInstruments, RecursiveIv, RecursiveLeastSquares,
    RecursivePrediction, RecursiveSettings, RecursiveSriv,
};
use asobench_identification::estimator::{ArxOptions, MethodKind, Pass, Shape, Window};
use asobench_identification::model::{LinearModel, Orders};
use asobench_identification::signal::{Input, InputLaw, Purpose, Sequence, stream};

fn draw(trial: u64, purpose: Purpose, length: usize) -> Vec<f64> {
    let mut signal = vec![0.0; length];
    let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
    input.fill(&mut stream(41, trial, purpose), &mut signal);
    signal
}

/// A model with these free coefficients.
fn model(orders: &str, theta: &[f64]) -> LinearModel {
    let mut model = LinearModel::zero(orders.parse().expect("orders"));
    model.set_parameters(theta);
    model
}

/// A record of the model, with white e of this deviation.
fn record(model: &LinearModel, trial: u64, length: usize, sigma: f64) -> (Vec<f64>, Vec<f64>) {
    let u = draw(trial, Purpose::Input, length);
    let e = draw(trial, Purpose::Plant, length);
    let mut y = vec![0.0; length];
    model.simulate(&u, &mut y);
    // C/(A D) e.
    let noise = LinearModel {
        b: model.c.clone(),
        f: model.d.clone(),
        delay: 0,
        ..model.clone()
    };
    let mut v = vec![0.0; length];
    noise.simulate(&e, &mut v);
    y.iter_mut().zip(&v).for_each(|(y, v)| *y += sigma * v);
    (u, y)
}

fn all(orders: Orders) -> Vec<(&'static str, Box<dyn RecursiveEstimator>)> {
    let with = |orders: Orders| RecursiveSettings::new(orders);
    let Orders { na, nb, nk, .. } = orders;
    let output_error = Orders {
        nb,
        nf: na,
        nk,
        ..Orders::default()
    };
    let extended = Orders { nc: 1, ..orders };
    let iv = |instruments| Box::new(RecursiveIv::new(with(orders), instruments));
    vec![
        (
            "rls",
            Box::new(RecursiveLeastSquares::new(with(orders), RecursiveForm::SquareRoot)),
        ),
        ("delayed", iv(RecursiveInstruments::Delayed)),
        ("auxiliary", iv(RecursiveInstruments::Auxiliary)),
        ("rels", Box::new(ExtendedLeastSquares::new(with(extended)))),
        ("sriv", Box::new(RecursiveSriv::new(with(output_error)))),
        ("rpem", Box::new(RecursivePrediction::new(with(output_error)))),
    ]
}

/// The free coefficients of the plant in the order of a method's theta.
fn plant(method: &str, truth: &LinearModel, theta: &[f64]) -> Vec<f64> {
    let (a, b) = (&truth.a[1..], &truth.b[truth.delay..]);
    match method {
        "sriv" | "rpem" => [b, a].concat(),
        "rels" => [a, b, &theta[theta.len() - 1..]].concat(),
        _ => [a, b].concat(),
    }
}

/// Without noise, least squares with an exact start has the plant after 2n equations, whatever the orders and the
/// delay; and the other methods keep it, since their start finds it; not `sriv`, whose changing filters have a
/// transient. Rounding: eps times the condition of so few equations.
#[test]
fn exact_after_two_equations_for_each_order() {
    for (trial, nk) in (0..24).zip([1, 0, 3].into_iter().cycle()) {
        let n = 1 + trial as usize % 4;
        let theta: Vec<f64> = draw(trial, Purpose::Plant, 2 * n).into_iter().collect();
        let (a, b) = theta.split_at(n);
        // Well within the unit circle: the coefficients of A sum to less than 1/2.
        let size: f64 = 2.0 * a.iter().map(|a| a.abs()).sum::<f64>() + 0.5;
        let theta: Vec<f64> = a.iter().map(|a| a / size).chain(b.iter().copied()).collect();
        let truth = model(&format!("na={n},nb={n},nk={nk}"), &theta);
        let (u, y) = record(&truth, trial, 1000, 0.0);
        let first = n.max(n + nk - 1);
        for (name, mut recursion) in all(truth.orders()) {
            let least_squares = name == "rls";
            run(&mut *recursion, &u, &y, |k, theta| {
                let exact = plant(name, &truth, theta);
                if least_squares && k < first + 2 * n {
                    assert!(theta.iter().all(|theta| *theta == 0.0), "{k}");
                } else if least_squares || name != "sriv" && k > first + 4 * n {
                    let off = distance(theta, &exact);
                    assert!(off < 1e-8, "{name} n = {n} nk = {nk} k = {k}: {off}");
                }
            });
            assert!(recursion.is_determined());
        }
    }
}

/// One order too many without noise: `(1 + c/q) A` and `(1 + c/q) B` fit for every c. Nothing is determined with an
/// exact start, also where poles are near the unit circle and rounding is large. With p0 the criterion is regular, and
/// of those that fit its minimum is the nearest to theta0, as p0 grows: off by at most `|theta - theta0| / (p0 s)`, s
/// the least of the other eigenvalues of Phi'Phi, here above 1.
#[test]
fn one_order_too_many_without_noise() {
    let truth = model("na=2,nb=2", &[-1.5, 0.7, 1.0, 0.5]);
    let slow = model("na=2,nb=2", &[-1.97, 0.9702, 0.1, 0.05]);
    let orders: Orders = "na=3,nb=3,nk=1".parse().unwrap();
    let (fits, direction) = ([-1.5, 0.7, 0.0, 1.0, 0.5, 0.0], [1.0, -1.5, 0.7, 0.0, 1.0, 0.5]);
    for (trial, length) in [(1, 60), (2, 200), (3, 2000), (4, 20_000)] {
        for truth in [&truth, &slow] {
            let (u, y) = record(truth, trial, length, 0.0);
            for (name, mut recursion) in all(orders) {
                run(&mut *recursion, &u, &y, |k, theta| {
                    assert!(theta.iter().all(|theta| *theta == 0.0), "{name} {k}");
                });
                assert!(!recursion.is_determined(), "{name} {length}");
            }
        }
        let (u, y) = record(&truth, trial, length, 0.0);
        for theta0 in [[0.0; 6], [0.3, -0.2, 0.1, 0.5, -0.4, 0.2]] {
            let along = |of: [f64; 6]| -> f64 { of.iter().zip(direction).map(|(x, t)| x * t).sum() };
            let c = (along(theta0) - along(fits)) / along(direction);
            let nearest: Vec<f64> = fits.iter().zip(direction).map(|(x, t)| x + c * t).collect();
            for form in [RecursiveForm::SquareRoot, RecursiveForm::Covariance] {
                let settings = RecursiveSettings {
                    p0: Some(1e6),
                    theta0: theta0.to_vec(),
                    start: 0,
                    ..RecursiveSettings::new(orders)
                };
                let mut recursion = RecursiveLeastSquares::new(settings, form);
                run(&mut recursion, &u, &y, |_, _| ());
                for (found, expected) in recursion.theta().iter().zip(&nearest) {
                    let off = (found - expected).abs();
                    assert!(off < 5e-6, "{form} {length}: {found} {expected}");
                }
            }
        }
    }
}

/// theta(N) and its covariance are those of `arx` of the same samples, by Householder reflections: with an exact start,
/// and in the limit of p0. The covariance form subtracts from p0, so it has about `eps p0` less.
#[test]
fn recursive_least_squares_is_least_squares() {
    for orders in ["na=2,nb=2,nk=1", "na=4,nb=1,nk=0", "na=0,nb=3,nk=2", "na=6,nb=6,nk=1"] {
        let orders: Orders = orders.parse().unwrap();
        let theta: Vec<f64> = (0..orders.parameters()).map(|i| 0.5 / (2 + i) as f64).collect();
        let truth = model(&orders.to_string(), &theta);
        let (u, y) = record(&truth, 7, 500, 0.5);
        let options = ArxOptions {
            orders: Some(orders),
            ..ArxOptions::default()
        };
        let shape = Shape {
            order: orders.order(),
            window: y.len(),
        };
        let mut passes = [Pass::new(orders.order())];
        let mut arx = options.prepare(&shape.into()).unwrap();
        arx.estimate(Window::new(&u, &y, y.len()), &mut passes);
        let exact: Vec<f64> = passes[0].model.parameters().collect();
        for (p0, form, tolerance) in [
            (None, RecursiveForm::SquareRoot, 1e-13),
            (Some(1e18), RecursiveForm::SquareRoot, 1e-13),
            (Some(1e6), RecursiveForm::SquareRoot, 1e-7),
            (Some(1e6), RecursiveForm::Covariance, 1e-7),
        ] {
            let settings = RecursiveSettings {
                p0,
                ..RecursiveSettings::new(orders)
            };
            let mut recursion = RecursiveLeastSquares::new(settings, form);
            run(&mut recursion, &u, &y, |_, _| ());
            let off = distance(recursion.theta(), &exact);
            assert!(off < tolerance, "{orders} {p0:?} {form}: {off}");
            let mut covariance = vec![0.0; exact.len().pow(2)];
            recursion.covariance(&mut covariance);
            let off = distance(&covariance, &passes[0].model.covariance);
            // The residuals' sum has the prior in it, of weight 1/p0.
            assert!(off < tolerance.max(1e-12), "{orders} {p0:?} {form}: covariance {off}");
        }
    }
}

/// theta0 is as good as `1/p0` of an equation for each parameter: the criterion that the docs print, by its gradient.
#[test]
fn the_criterion_with_forgetting() {
    let truth = model("na=1,nb=1,nk=1", &[-0.8, 1.0]);
    let (u, y) = record(&truth, 3, 60, 0.5);
    let (lambda, p0, theta0) = (0.9_f64, 0.01, [0.3, -2.0]);
    for form in [RecursiveForm::SquareRoot, RecursiveForm::Covariance] {
        let settings = RecursiveSettings {
            theta0: theta0.to_vec(),
            p0: Some(p0),
            forgetting: lambda,
            ..RecursiveSettings::new(truth.orders())
        };
        let mut recursion = RecursiveLeastSquares::new(settings, form);
        run(&mut recursion, &u, &y, |k, theta| {
            let age = |i: usize| (k - 1 - i) as i32;
            let prior = lambda.powi(k as i32 - 1) / p0;
            let mut gradient = [0, 1].map(|j| prior * (theta[j] - theta0[j]));
            for i in 1..k {
                let phi = [-y[i - 1], u[i - 1]];
                let error = y[i] - phi[0] * theta[0] - phi[1] * theta[1];
                let weight = lambda.powi(age(i));
                (0..2).for_each(|j| gradient[j] -= weight * error * phi[j]);
            }
            assert!(gradient.iter().all(|g| g.abs() < 1e-10), "{k} {gradient:?}");
        });
    }
}

/// A recursion that diverges says at which k, and says it again.
#[test]
fn divergence_has_its_sample() {
    for (name, mut recursion) in all("na=2,nb=2,nk=1".parse().unwrap()) {
        let (u, y) = record(&model("na=1,nb=1,nk=1", &[-0.5, 1.0]), 5, 40, 0.1);
        run(&mut *recursion, &u, &y, |_, _| ());
        let theta = recursion.theta().to_vec();
        let error = recursion.update(f64::INFINITY, 1.0).unwrap_err();
        assert_eq!(
            (error.k, error.to_string()),
            (40, "non-finite at k = 40".to_owned()),
            "{name}"
        );
        assert_eq!(recursion.update(1.0, 1.0), Err(error));
        assert_eq!((recursion.samples(), recursion.theta()), (40, &theta[..]));
        recursion.restart();
        run(&mut *recursion, &u, &y, |_, _| ());
        assert_eq!(recursion.theta(), theta);
    }
    // Squares beyond the largest number.
    let (_, mut recursion) = all("na=1,nb=1,nk=1".parse().unwrap()).remove(1);
    let diverged = (0..9)
        .map(|k| recursion.update(1e200 * f64::from(k), 1e200))
        .find_map(Result::err);
    assert!(diverged.is_some_and(|diverged| diverged.k < 9));
}

/// A case of the limit distribution: the true model, the orders of the method and the method.
type Case = (
    &'static str,
    LinearModel,
    fn(RecursiveSettings) -> Box<dyn RecursiveEstimator>,
);

/// With N = 20,000 the estimates of 400 records have the covariance of theory: the standard deviation of each
/// coefficient agrees with the mean printed one within four Monte-Carlo standard errors, `1/sqrt(2 trials)` of it, and
/// the mean with the truth within four of its own. Printed are the formulas of each method, right for these cases: for
/// white equation errors (`rls`, `recursive-iv`), and for the structure that made the record. Methods that run a
/// model along begin late and forget early, so that the first models leave no trace.
#[test]
fn the_asymptotic_covariance() {
    let (n, trials) = (20_000, 400);
    let cases: [Case; 6] = [
        ("rls", model("na=2,nb=2,nk=1", &[-1.5, 0.7, 1.0, 0.5]), |settings| {
            Box::new(RecursiveLeastSquares::new(settings, RecursiveForm::SquareRoot))
        }),
        ("delayed", model("na=2,nb=2,nk=1", &[-1.5, 0.7, 1.0, 0.5]), |settings| {
            Box::new(RecursiveIv::new(settings, RecursiveInstruments::Delayed))
        }),
        (
            "auxiliary",
            model("na=2,nb=2,nk=1", &[-1.5, 0.7, 1.0, 0.5]),
            |settings| Box::new(RecursiveIv::new(settings, RecursiveInstruments::Auxiliary)),
        ),
        ("sriv", model("nb=2,nf=2,nk=1", &[1.0, 0.5, -1.5, 0.7]), |settings| {
            Box::new(RecursiveSriv::new(settings))
        }),
        ("rpem", model("nb=2,nf=2,nk=1", &[1.0, 0.5, -1.5, 0.7]), |settings| {
            Box::new(RecursivePrediction::new(settings))
        }),
        (
            "rpem armax",
            model("na=2,nb=2,nc=1,nk=1", &[-1.5, 0.7, 1.0, 0.5, 0.6]),
            |settings| Box::new(RecursivePrediction::new(settings)),
        ),
    ];
    for (name, truth, make) in cases {
        let exact: Vec<f64> = truth.parameters().collect();
        let d = exact.len();
        let settings = RecursiveSettings::new(truth.orders());
        let mut recursion = make(match name {
            "rls" | "delayed" => settings,
            _ => RecursiveSettings {
                start: 50,
                early_forgetting: 0.95,
                ..settings
            },
        });
        let (mut sums, mut squares) = (vec![0.0; d], vec![0.0; d]);
        let (mut printed, mut covariance) = (vec![0.0; d], vec![0.0; d * d]);
        for trial in 0..trials {
            let (u, y) = record(&truth, trial, n, 0.5);
            recursion.restart();
            run(&mut *recursion, &u, &y, |_, _| ());
            recursion.covariance(&mut covariance);
            for i in 0..d {
                let off = recursion.theta()[i] - exact[i];
                sums[i] += off;
                squares[i] += off * off;
                printed[i] += covariance[i * d + i].sqrt() / trials as f64;
            }
        }
        let count = trials as f64;
        for i in 0..d {
            let mean = sums[i] / count;
            let deviation = ((squares[i] - count * mean * mean) / (count - 1.0)).sqrt();
            let of_deviation = (deviation / printed[i] - 1.0) * (2.0 * count).sqrt();
            let of_mean = mean / deviation * count.sqrt();
            println!("{name} {i}: {of_deviation:.2} {of_mean:.2}");
            assert!(
                of_deviation.abs() < 4.0 && of_mean.abs() < 4.0,
                "{name} {i}: {of_deviation} {of_mean}"
            );
        }
    }
}

/// On short records of an FIR model early forgetting leaves few equations, and the weights count them: over 4000
/// records the mean of the variance of the residuals is that of e within four Monte-Carlo standard errors, and the
/// variance of each coefficient is the mean printed one within four of its own, `sqrt(2 / trials)` of it. The mean
/// printed one is that of the formula, whose terms of higher order are `d / N_eff` of it, `N_eff = (sum w)^2 / sum
/// w^2`.
#[test]
fn standard_errors_after_early_forgetting() {
    let (n, trials, sigma, early) = (60, 4000, 0.5, 0.9);
    let truth = model("nb=3,nk=1", &[1.0, 0.5, -0.3]);
    let d = 3;
    let settings = RecursiveSettings {
        early_forgetting: early,
        ..RecursiveSettings::new(truth.orders())
    };
    let (mut sum, mut squares, mut lambda) = (0.0, 0.0, early);
    for row in 0..n - 3 {
        let factor = if row < settings.start { 1.0 } else { lambda };
        (sum, squares) = (factor * sum + 1.0, factor * factor * squares + 1.0);
        if row >= settings.start {
            lambda = 1.0 - 0.99 * (1.0 - lambda);
        }
    }
    let higher = d as f64 * squares / (sum * sum);
    let delayed = RecursiveInstruments::Delayed;
    let methods: [(&str, Box<dyn RecursiveEstimator>); 4] = [
        ("iv", Box::new(RecursiveIv::new(settings.clone(), delayed))),
        ("rels", Box::new(ExtendedLeastSquares::new(settings.clone()))),
        ("sriv", Box::new(RecursiveSriv::new(settings.clone()))),
        ("rpem", Box::new(RecursivePrediction::new(settings))),
    ];
    for (name, mut recursion) in methods {
        let (mut sum, mut squares) = (0.0, 0.0);
        let (mut errors, mut printed) = ([0.0; 3], [0.0; 3]);
        let mut covariance = vec![0.0; d * d];
        for trial in 0..trials {
            let (u, y) = record(&truth, trial, n, sigma);
            recursion.restart();
            run(&mut *recursion, &u, &y, |_, _| ());
            let variance = recursion.noise_variance();
            sum += variance;
            squares += variance * variance;
            recursion.covariance(&mut covariance);
            for i in 0..d {
                errors[i] += (recursion.theta()[i] - truth.b[i + 1]).powi(2);
                printed[i] += covariance[i * d + i];
            }
        }
        let count = trials as f64;
        let mean = sum / count;
        let error = ((squares / count - mean * mean) / count).sqrt();
        let off = (mean - sigma * sigma) / error;
        println!("{name}: {mean:.5} {off:.2}");
        assert!(off.abs() < 4.0, "{name}: {mean}, {off} standard errors");
        for i in 0..d {
            let ratio = errors[i] / printed[i];
            println!("{name} {i}: {ratio:.4}");
            let allowed = 4.0 * (2.0 / count).sqrt() + higher;
            assert!((ratio - 1.0).abs() < allowed, "{name} {i}: {ratio}");
        }
    }
}
