//! Solvers, initial states, closed loops, observers, input noise.

use super::cells::{AMPLITUDE, OPEN, bias, check, component, expected, limit, open, plant, population};
use super::population::inverse_square_of_state;
use super::study::{Check, Found, Theory, cut, extrapolate, mean, median, ratio, rmse, run, vector};
use asobench::estimator::Output;
use asobench::observer::Gain;
use asobench::study::{Measure, Row};

/// Whether the normal equations of 2n columns may fail by the rank rule, that is where their
/// condition number is above `1 / (8 n eps)`: it is at most that of the columns squared, times 2n
/// for the 1-norm and 2n for columns that are scaled to a power of two.
fn may_be_rank_deficient(label: &str, columns: f64, order: usize) -> bool {
    let is_normal = ["partitioned", "lu", "cholesky"]
        .iter()
        .any(|solver| label.contains(&format!("solver={solver}")));
    let n = order as f64;
    is_normal && (2.0 * n * columns).powi(2) > 1.0 / (8.0 * n * f64::EPSILON)
}

/// C6: a backward stable solver's error is within a small multiple of eps times its condition
/// number; that of `dual`, which is regularised by 2^-26, of 2^-26 times the condition number of
/// `Z'Phi` (here of `lu`). 10 trials in each of 22 cells; the largest error of a and h in these
/// units, and how many of the passes have none, but where the condition number of the columns,
/// that of `svd`, excuses those that square it.
pub fn solvers() -> Vec<Check> {
    const TRIALS: u64 = 10;
    let experiment = cut("solvers", &["window=[36, 60, 200]"]);
    let labels: Vec<String> = experiment.outputs().iter().map(Output::label).collect();
    let square_of: Vec<Option<usize>> = labels
        .iter()
        .map(|label| {
            label
                .contains("dual")
                .then(|| experiment.output("", &label.replace("dual", "lu")).unwrap())
        })
        .collect();
    let columns = experiment.output("", "ls solver=svd").unwrap();
    let mut largest = vec![0.0_f64; labels.len()];
    let mut lost = vec![0.0_f64; labels.len()];
    for cell in 0..experiment.cells.len() {
        let found = run(&experiment, cell, TRIALS);
        let rows: Vec<Row> = found.rows().collect();
        for trial in rows.chunks_exact(labels.len()) {
            let condition = trial[columns][Measure::Condition];
            for row in trial {
                let has_no_error = row[Measure::Ea].is_nan() || row[Measure::Eh].is_nan();
                if row.failure.is_some() || has_no_error {
                    let order = experiment.cells[cell].order();
                    let excused = may_be_rank_deficient(&labels[row.output], condition, order);
                    lost[row.output] += f64::from(!excused);
                    continue;
                }
                let unit = match square_of[row.output] {
                    None => f64::EPSILON * row[Measure::Condition],
                    Some(square) => f64::EPSILON.sqrt() * trial[square][Measure::Condition],
                };
                // f64::max leaves NaN out: the condition number of an `lu` that failed.
                largest[row.output] = largest[row.output]
                    .max(row[Measure::Ea] / unit)
                    .max(row[Measure::Eh] / unit);
            }
        }
    }
    let checks_of = |((label, largest), lost): ((&String, f64), f64)| {
        let unit = if label.contains("dual") { "sqrt(eps)" } else { "eps" };
        let text = format!("{label}: max error / ({unit} cond)");
        let check = |text, found, most| check("solvers", text, TRIALS, (found, 0.0), Theory::AtMost(most));
        [
            check(text, largest, 100.0),
            check(format!("{label}: lost without a reason"), lost, 0.0),
        ]
    };
    labels.iter().zip(largest).zip(lost).flat_map(checks_of).collect()
}

/// C8: at x0 = 0, instruments from the estimated x0 and from x0 = 0 differ in O(1) samples, so the estimates by O(1/N):
/// slope -1 of the median (400 trials). Stage 6 with the true model: `(D'D)^-1 D' Cov(f) D (D'D)^-1` (600 trials).
pub fn initial_states() -> Vec<Check> {
    const TRIALS: u64 = 400;
    let mut checks = Vec::new();
    let experiment = cut(
        "initial-state",
        &[
            "x0=0",
            "eta=10",
            "noise=white",
            "window=[5000, 20000]",
            "measures=[\"e_a\"]",
        ],
    );
    let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
    let difference = |found: &Found| {
        let pairs = found.errors(2).into_iter().zip(found.errors(4));
        let norm = |(p, q): (Vec<f64>, Vec<f64>)| p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum::<f64>().sqrt();
        pairs.map(norm).collect::<Vec<f64>>()
    };
    let (short, long) = (median(difference(&found[0])), median(difference(&found[1])));
    let slope = (long.0 / short.0).ln() / 4.0_f64.ln();
    let error = (long.1 / long.0).hypot(short.1 / short.0) / 4.0_f64.ln();
    checks.push(check(
        "initial-state",
        "x0 = 0: slope of |p - p| between estimated and zero x0",
        TRIALS,
        (slope, error),
        Theory::Value(-1.0),
    ));
    for (figure, text) in [(2, "estimated"), (4, "zero")] {
        let theory = open("white", 10.0);
        let value = rmse(&found[1].figure(figure, Measure::Ea));
        let text = format!("x0 = 0, {text}: iv(4) RMSE of e_a, N = 20000, white");
        checks.push(check(
            "initial-state",
            text,
            TRIALS,
            value,
            expected(&theory, &theory.instruments_covariance(), 0, 20000),
        ));
    }
    const MORE: u64 = 600;
    for noise in ["ar", "white"] {
        let set = format!("noise={noise}");
        let experiment = cut(
            "initial-state",
            &[&set, "x0=1", "eta=10", "window=10000", "measures=[\"e_x0\"]"],
        );
        let value = rmse(&run(&experiment, 0, MORE).figure(2, Measure::Ex0));
        let square = open(noise, 10.0).initial_state_error(&plant()) / 6.0;
        let text = format!("iv(4) RMSE of e_x0, N = 10000, {noise}");
        checks.push(check("initial-state", text, MORE, value, Theory::Value(square.sqrt())));
    }
    checks
}

/// C7: see each part.
pub fn closed_loops() -> Vec<Check> {
    let mut checks = Vec::new();
    // r = 0 and a static K: nothing is identifiable, in any noise, by any method. 20 trials in each of 9 cells.
    let experiment = cut("closed-loop", &["feedback=\"static, r = 0\"", "window=218"]);
    let cells = 0..experiment.cells.len();
    let failed = |found: Found| found.rows().all(|row| row.failure.is_some());
    let all = cells.clone().filter(|cell| failed(run(&experiment, *cell, 20))).count();
    let share = all as f64 / cells.len() as f64;
    checks.push(check(
        "closed-loop",
        "static, r = 0: share of cells where every trial fails",
        20,
        (share, 0.0),
        Theory::Value(1.0),
    ));
    // With r: limits (800 trials). Least squares and IV from u by the population's version of each pass; IV from r is
    // consistent.
    const TRIALS: u64 = 800;
    let dynamic: (&[f64], &[f64]) = (&[0.4, -0.1], &[1.0, -0.5]);
    for (name, law) in [("static", (&[0.4][..], &[1.0][..])), ("dynamic", dynamic)] {
        for noise in ["white", "strong"] {
            let set = [format!("feedback={name}"), format!("noise={noise}")];
            let experiment = cut("closed-loop", &[&set[0], &set[1], "eta=5", "window=[5000, 10000]"]);
            let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
            let errors = |output: usize| extrapolate(&found[0].errors(output), &found[1].errors(output));
            let theory = population(noise, 5.0, 0.0, law);
            let limits = theory.iterated(4);
            let expect = |pass: usize| bias(&limits[pass], &theory.theta);
            checks.push(vector(
                "closed-loop",
                &format!("{name}, {noise}: ls limit"),
                &errors(0),
                &expect(0),
            ));
            checks.push(vector(
                "closed-loop",
                &format!("{name}, {noise}: iv(4) limit"),
                &errors(1),
                &expect(4),
            ));
            checks.push(vector(
                "closed-loop",
                &format!("{name}, {noise}: iv-r(4) limit"),
                &errors(2),
                &[0.0; 12],
            ));
        }
    }
    // State feedback: consistent from r too.
    let experiment = cut(
        "closed-loop",
        &["feedback=state", "noise=white", "eta=5", "window=[5000, 10000]"],
    );
    let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
    let errors = extrapolate(&found[0].errors(2), &found[1].errors(2));
    checks.push(vector(
        "closed-loop",
        "state, white: iv-r(4) limit",
        &errors,
        &[0.0; 12],
    ));
    checks
}

/// C7: the bias of IV from u in coloured noise grows as eta^2; the next term is in the population's ratio. 800 trials.
pub fn bias_in_a_loop() -> Vec<Check> {
    const TRIALS: u64 = 800;
    let experiment = cut(
        "closed-loop",
        &["feedback=static", "noise=white", "eta=[5, 10]", "window=10000"],
    );
    let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
    let means: Vec<(f64, f64)> = (0..12).map(|i| mean(&component(&found[0].errors(1), i))).collect();
    let best = (0..12)
        .max_by(|&i, &j| {
            (means[i].0 / means[i].1)
                .abs()
                .total_cmp(&(means[j].0 / means[j].1).abs())
        })
        .unwrap();
    let value = ratio(
        &component(&found[1].errors(1), best),
        &component(&found[0].errors(1), best),
    );
    let bias = |eta: f64| {
        let theory = population("white", eta, 0.0, (&[0.4], &[1.0]));
        theory.iterated(4)[4][best] - theory.theta[best]
    };
    vec![check(
        "closed-loop",
        "static, white: iv(4) bias, ratio of eta = 10 to 5",
        TRIALS,
        value,
        Theory::Value(bias(10.0) / bias(5.0)),
    )]
}

/// C9: with the true model `E e_x^2 = E |x - xhat|^2 E 1/|x|^2`, since x depends on u alone and its error on f alone.
/// The model's own error adds O(1/N), which two windows take out. 150 trials of 4000 samples and more.
pub fn observers() -> Vec<Check> {
    const TRIALS: u64 = 150;
    let mut checks = Vec::new();
    let inverse = inverse_square_of_state(&plant(), AMPLITUDE);
    for noise in ["ar", "white"] {
        for name in ["dead-beat", "scaled:0.25", "scaled:0.5", "scaled:0.75"] {
            let set = [format!("noise={noise}"), format!("gain={name}")];
            let rest = [
                "observer_start=x0-hat",
                "process_noise=0",
                "scored_from=window",
                "eta=10",
                "window=[10000, 20000]",
                "horizon=24000",
                "measures=[\"e_x_rms\"]",
            ];
            let experiment = cut("observer-poles", &[&[set[0].as_str(), &set[1]], &rest[..]].concat());
            let squares = |cell: usize| -> Vec<Vec<f64>> {
                let values = run(&experiment, cell, TRIALS).figure(1, Measure::ExRms);
                values.into_iter().map(|e| vec![e * e]).collect()
            };
            let (found, error) = mean(&extrapolate(&squares(0), &squares(1)).concat());
            let gain: Gain = name.parse().unwrap();
            let square = open(noise, 10.0).observer_error(&plant(), &gain) * inverse;
            let text = format!("rms e_x, {name}, {noise}, N to infinity");
            let value = (found.sqrt(), error / (2.0 * found.sqrt()));
            checks.push(check(
                "observer-poles",
                text,
                TRIALS,
                value,
                Theory::Value(square.sqrt()),
            ));
        }
    }
    checks
}

/// Errors in variables: limits of least squares and of four passes of IV, whose instruments hold the input's error too.
/// 800 trials.
pub fn input_noises() -> Vec<Check> {
    const TRIALS: u64 = 800;
    let mut checks = Vec::new();
    for noise in ["ar", "white"] {
        for input_noise in [5.0, 20.0] {
            let set = [format!("noise={noise}"), format!("input_noise={input_noise}")];
            let experiment = cut(
                "input-noise",
                &[&set[0], &set[1], "eta=10", "window=[5000, 10000]", "measures=[\"e_a\"]"],
            );
            let found = [run(&experiment, 0, TRIALS), run(&experiment, 1, TRIALS)];
            let theory = population(noise, 10.0, input_noise, OPEN);
            let expect = [limit(noise, 10.0, input_noise), theory.iterated(4)[4].clone()];
            for (output, label) in [(0, "ls"), (1, "iv(4)")] {
                let errors = extrapolate(&found[0].errors(output), &found[1].errors(output));
                let text = format!("{label} limit, input noise {input_noise} %, {noise}");
                checks.push(vector(
                    "input-noise",
                    &text,
                    &errors,
                    &bias(&expect[output], &theory.theta),
                ));
            }
        }
    }
    checks
}
