//! Windows, noise levels and colours, passes, readings, orders: limits, covariances and rates.

use super::cells::{bias, check, expected, limit, open, plant, size};
use super::population::{parts, relative_covariance, response};
use super::study::{self, Check, Found, Theory, cut, extrapolate, mean, median, ratio, rmse, run, vector};
use asobench::estimator::FailureKind;
use asobench::plant::StateSpace;
use asobench::study::file::ExperimentFile;
use asobench::study::{CellPart, Experiment, Measure, Summary};
use faer::Mat;

const PARTS: [(Measure, usize); 3] = [(Measure::Ea, 0), (Measure::Eh, 1), (Measure::Eb, 2)];

/// C3's cell with a longer window: both estimators under the paper's own noise. 3000 trials.
pub fn the_papers_experiment() -> Vec<Check> {
    const TRIALS: u64 = 3000;
    let set = [
        "claim=C3",
        "eta=10.014",
        "window=5000",
        "horizon=auto",
        "measures=[\"e_a\", \"e_b\", \"e_h\"]",
    ];
    let experiment = cut("nikolov2023", &set);
    let found = run(&experiment, 0, TRIALS);
    let theory = open("ar", 10.014);
    let covariances = [
        ("ls", 0, theory.least_squares_covariance()),
        ("iv(4)", 4, theory.instruments_covariance()),
    ];
    let mut checks = Vec::new();
    for (label, output, covariance) in &covariances {
        for (figure, part) in PARTS {
            let text = format!("{label} RMSE of {figure}, N = 5000, 1/A");
            let value = rmse(&found.figure(*output, figure));
            checks.push(check(
                "nikolov2023",
                text,
                TRIALS,
                value,
                expected(&theory, covariance, part, 5000),
            ));
        }
    }
    checks
}

/// Least squares under 1/A: `sigma^2 R^-1 / N`, in proportion to eta at small eta (2000 trials); and the noise levels
/// at which section 4 of the specification found the paper's bounds to be medians, to their printed digits (4000
/// trials).
pub fn noise_levels() -> Vec<Check> {
    const TRIALS: u64 = 2000;
    let set = [
        "eta=[0.1, 1]",
        "window=5000",
        "measures=[\"e_a\", \"e_b\"]",
        "methods=[{estimator = \"ls\"}]",
    ];
    let experiment = cut("noise-level", &set);
    let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
    let mut checks = Vec::new();
    for (found, eta) in found.iter().zip([0.1, 1.0]) {
        let theory = open("ar", eta);
        let covariance = theory.least_squares_covariance();
        let text = format!("ls RMSE of e_a, N = 5000, eta = {eta}");
        let value = rmse(&found.figure(0, Measure::Ea));
        checks.push(check(
            "noise-level",
            text,
            TRIALS,
            value,
            expected(&theory, &covariance, 0, 5000),
        ));
    }
    let square = |i: usize| -> Vec<f64> { found[i].figure(0, Measure::Ea).iter().map(|e| e * e).collect() };
    let (value, error) = ratio(&square(1), &square(0));
    let root_mean_square = |eta| {
        let theory = open("ar", eta);
        size(&theory, &theory.least_squares_covariance(), 0, 5000)
    };
    let root = (value.sqrt(), error / (2.0 * value.sqrt()));
    checks.push(check(
        "noise-level",
        "ls RMSE of e_a, ratio of eta = 1 to 0.1",
        TRIALS,
        root,
        Theory::Value(root_mean_square(1.0) / root_mean_square(0.1)),
    ));

    const FEW: u64 = 4000;
    for (window, eta, figure, bound, half_digit) in [
        (98, 2.8, Measure::Ea, 0.033, 0.05),
        (218, 2.3, Measure::Ea, 0.017, 0.05),
        (98, 4.5, Measure::Eb, 0.01, 0.05),
        (218, 4.0, Measure::Eb, 0.0057, 0.5),
        (98, 1.0, Measure::ExMax, 0.065, 0.05),
        (218, 0.45, Measure::ExMax, 0.024, 0.005),
    ] {
        let set = [
            format!("eta={eta}"),
            format!("window={window}"),
            "horizon=400".to_owned(),
            "methods=[{iterations = 4, report = [4]}]".to_owned(),
        ];
        let experiment = cut("noise-level", &set.each_ref().map(String::as_str));
        let value = median(run(&experiment, 0, FEW).figure(0, figure));
        let text = format!("iv(4) median of {figure}, N = {window}, eta = {eta}");
        let theory = Theory::Printed(bound, 0.0, bound * half_digit / eta);
        checks.push(check("noise-level", text, FEW, value, theory));
    }
    checks
}

/// The median of |e| for a normal vector of covariance S, by 200,000 draws: a standard error of 0.2 %.
pub fn median_of_norm(covariance: &Mat<f64>) -> (f64, f64) {
    use asobench::signal::{Purpose, normal::fill_standard_normal, stream};
    let n = covariance.nrows();
    let l = covariance.llt(faer::Side::Lower).unwrap();
    let mut z = vec![0.0; 200_000 * n];
    fill_standard_normal(&mut stream(1, 0, Purpose::NoiseDrive), &mut z);
    let norm = |z: &[f64]| {
        let row = |i: usize| (0..=i).map(|j| l.L()[(i, j)] * z[j]).sum::<f64>();
        (0..n).map(|i| row(i).powi(2)).sum::<f64>().sqrt()
    };
    median(z.chunks_exact(n).map(norm).collect())
}

/// C4: the shipped slopes; the limit of least squares and the covariance of IV in white noise. 1500 trials.
pub fn windows() -> Vec<Check> {
    const TRIALS: u64 = 1500;
    let file = ExperimentFile::read(&study::path("window")).unwrap();
    let experiment = Experiment::new(file.set("window=[2000, 5000, 10000]").unwrap()).unwrap();
    let mut found: Vec<Found> = (0..6).map(|cell| run(&experiment, cell, TRIALS)).collect();
    let found_in = experiment.cells.iter().zip(&mut found);
    let parts = found_in.enumerate().map(|(index, (cell, found))| {
        let tally = found.tally(&experiment, cell);
        CellPart::new(&experiment, index, &tally)
    });
    let mut checks = Vec::new();
    for slope in Summary::new(&experiment, parts.collect()).slopes {
        let noise = slope
            .settings
            .values()
            .map(ToString::to_string)
            .find(|v| v == "ar" || v == "white")
            .unwrap();
        // Under white noise least squares, and the first passes from it at finite N, have no such rate.
        if noise == "ar" && slope.output != "iv(2)" || slope.output == "iv(4)" {
            let text = format!(
                "{} slope of the {} of {}, {noise}",
                slope.output, slope.table.statistic, slope.table.measure
            );
            let value = slope.slope.unwrap();
            checks.push(check(
                "window",
                text,
                TRIALS,
                (value.value, value.mcse),
                Theory::Value(-0.5),
            ));
        }
    }
    let theory = open("white", 10.0);
    let errors = extrapolate(&found[4].errors(0), &found[5].errors(0));
    checks.push(vector(
        "window",
        "ls limit in white noise",
        &errors,
        &bias(&limit("white", 10.0, 0.0), &theory.theta),
    ));
    let covariance = theory.instruments_covariance();
    for (figure, part) in [(Measure::Ea, 0), (Measure::Eb, 2)] {
        let values = found[5].figure(3, figure);
        let text = format!("iv(4) RMSE of {figure}, N = 10000, white");
        checks.push(check(
            "window",
            text,
            TRIALS,
            rmse(&values),
            expected(&theory, &covariance, part, 10000),
        ));
        let relative = relative_covariance(&theory.theta, &covariance, part);
        let (value, error) = median_of_norm(&relative);
        let root = (10000.0 - 6.0_f64).sqrt();
        let text = format!("iv(4) median of {figure}, N = 10000, white");
        checks.push(check(
            "window",
            text,
            TRIALS,
            median(values),
            Theory::Printed(value / root, error / root, 0.0),
        ));
    }
    checks
}

/// Limits of least squares and covariances of IV in coloured noise. 1000 trials.
pub fn colours() -> Vec<Check> {
    const TRIALS: u64 = 1000;
    let mut checks = Vec::new();
    for colour in ["ma", "arma", "strong"] {
        let noise = format!("noise={colour}");
        let experiment = cut("noise-colour", &[&noise, "eta=10", "window=[5000, 10000]"]);
        let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
        let theory = open(colour, 10.0);
        let errors = extrapolate(&found[0].errors(0), &found[1].errors(0));
        let expect = bias(&limit(colour, 10.0, 0.0), &theory.theta);
        checks.push(vector("noise-colour", &format!("ls limit, {colour}"), &errors, &expect));
        let text = format!("iv(4) RMSE of e_a, N = 10000, {colour}");
        let value = rmse(&found[1].figure(2, Measure::Ea));
        checks.push(check(
            "noise-colour",
            text,
            TRIALS,
            value,
            expected(&theory, &theory.instruments_covariance(), 0, 10000),
        ));
    }
    checks
}

/// C5: IV(20) is consistent where least squares is biased, with the covariance of the true instruments. 600 trials.
pub fn convergence() -> Vec<Check> {
    const TRIALS: u64 = 600;
    let methods = "methods=[{name = \"iv\", iterations = 20, report = [0, 20]}]";
    let experiment = cut(
        "convergence",
        &["noise=white", "eta=10", "window=[5000, 10000]", methods],
    );
    let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
    let theory = open("white", 10.0);
    let errors = extrapolate(&found[0].errors(1), &found[1].errors(1));
    let value = rmse(&found[1].figure(1, Measure::Ea));
    let least_squares = mean(&found[1].figure(0, Measure::Ea));
    vec![
        vector("convergence", "iv(20) limit in white noise", &errors, &[0.0; 12]),
        check(
            "convergence",
            "iv(20) RMSE of e_a, N = 10000, white",
            TRIALS,
            value,
            expected(&theory, &theory.instruments_covariance(), 0, 10000),
        ),
        check(
            "convergence",
            "ls mean of e_a, N = 10000, white: biased",
            TRIALS,
            least_squares,
            Theory::AtLeast(4.0 * value.0),
        ),
    ]
}

/// E4 in white noise: `literal` reports the b of least squares for ever, the first n Markov parameters, which with
/// white input are consistent whatever the noise, so e_b falls as N^-1/2; `frozen` is consistent, with the covariance
/// of instruments of (A, b of least squares). 800 trials.
pub fn errata() -> Vec<Check> {
    const TRIALS: u64 = 800;
    let set = [
        "zip=[]",
        "claim=C2",
        "eta=10.018",
        "window=[5000, 10000]",
        "horizon=auto",
    ];
    let rest = [
        "noise=white",
        "numerator=state-space",
        "measures=[\"e_a\", \"e_b\", \"e_h\"]",
    ];
    let experiment = cut("errata", &[&set[..], &rest[..]].concat());
    let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
    let output = |label: &str| experiment.output("", label).unwrap();
    let (literal, frozen) = (output("iv-literal(4)"), output("iv-frozen(4)"));
    let (limit, theory) = (limit("white", 10.018, 0.0), open("white", 10.018));
    let (of_limit, truth) = (parts(&limit)[2].clone(), parts(&theory.theta)[2].clone());
    assert!(asobench::metric::relative_error(&truth, &of_limit) < 1e-9);
    let squares =
        |cell: usize| -> Vec<f64> { found[cell].figure(literal, Measure::Eb).iter().map(|e| e * e).collect() };
    let (square, error) = ratio(&squares(0), &squares(1));
    let fall = (square.sqrt(), error / (2.0 * square.sqrt()));
    let mixed = StateSpace::new(plant().a().to_vec(), of_limit).unwrap();
    let p = [&theory.theta[..6], &mixed.h()].concat();
    let errors = extrapolate(&found[0].errors(frozen), &found[1].errors(frozen));
    let spread = rmse(&found[1].figure(frozen, Measure::Ea));
    let rate = Theory::Value((9994.0_f64 / 4994.0).sqrt());
    vec![
        check(
            "errata",
            "iv-literal(4) RMSE of e_b, N = 5000 over 10000, white",
            TRIALS,
            fall,
            rate,
        ),
        vector("errata", "iv-frozen(4) limit, white", &errors, &[0.0; 12]),
        check(
            "errata",
            "iv-frozen(4) RMSE of e_a, N = 10000, white",
            TRIALS,
            spread,
            expected(&theory, &theory.covariance_with(&p), 0, 10000),
        ),
    ]
}

/// Too high an order without noise has no unique solution (40 trials in each of 16 cells). Too low an order under noise
/// tends to the projection on its regressors (400 trials).
pub fn orders() -> Vec<Check> {
    let experiment = cut("order", &["order=[7, 8, 9, 10]", "eta=0"]);
    let typed = Some(FailureKind::RankDeficient);
    let (mut deficient, mut all) = (0, 0);
    for cell in 0..experiment.cells.len() {
        for row in run(&experiment, cell, 40).rows() {
            deficient += u32::from(row.failure.map(|failure| failure.kind) == typed);
            all += 1;
        }
    }
    let share = f64::from(deficient) / f64::from(all);
    let mut checks = vec![check(
        "order",
        "orders 7 to 10, no noise: share rank-deficient",
        40,
        (share, 0.0),
        Theory::Value(1.0),
    )];
    const TRIALS: u64 = 400;
    for order in [2, 3, 4] {
        let set = format!("order={order}");
        let experiment = cut(
            "order",
            &[
                &set,
                "eta=10",
                "noise=white",
                "window=[10000, 20000]",
                "measures=[\"e_g\"]",
            ],
        );
        let error = |cell: usize| -> Vec<Vec<f64>> {
            let values = run(&experiment, cell, TRIALS).figure(0, Measure::ImpulseResponse);
            values.into_iter().map(|e| vec![e]).collect()
        };
        let found: Vec<f64> = extrapolate(&error(0), &error(1)).concat();
        let theory = open("white", 10.0);
        let markov = |p: &[f64]| {
            let (alpha, beta) = p.split_at(p.len() / 2);
            response(&[&[0.0], beta].concat(), &[&[1.0], alpha].concat())
        };
        let (truth, low) = (markov(&theory.theta), markov(&theory.least_squares(order)));
        let text = format!("order {order}: ls limit of e_g, white");
        let value = asobench::metric::relative_error(&truth, &low);
        checks.push(check("order", text, TRIALS, mean(&found), Theory::Value(value)));
    }
    checks
}
