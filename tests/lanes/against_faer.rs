//! The lanes and faer's [`Trial`] on the same trials: two programs for one computation.

use super::{Case, cases, empty, small, tested};
use asobench::data::PlantSource;
use asobench::metric::Sample;
use asobench::study::{CURVE_BIN_ERROR, CURVE_TRIALS, Curves, Experiment, Measure, Plan, Row, Trial, Trials};
use std::ops::Range;

fn by_faer(experiment: &Experiment, count: u64) -> Trials {
    let mut trial = Trial::new(experiment, &experiment.cells[0]).expect("a valid cell");
    let mut trials = empty(experiment);
    (0..count).for_each(|index| trial.run_into(index, &mut trials).unwrap());
    trials
}

/// By the widest lanes: the others give the same bits.
fn by_lanes(experiment: &Experiment, count: u64) -> Trials {
    let plan = Plan::new(experiment, &experiment.cells[0]).expect("a covered cell");
    let mut trials = empty(experiment);
    plan.pack(tested()[0]).run_into(0..count, &mut trials);
    trials
}

/// The differences in the comparison of a case.
#[derive(Default)]
struct Found {
    rows: usize,
    /// (a, h).
    truth: Vec<f64>,
    /// Relative differences of (a, h), and of the condition number, in rows of trials that are stable and without
    /// failure in this and all earlier passes, on both; and of their figures e_a ... e_x_rms.
    estimates: Vec<f64>,
    conditions: Vec<f64>,
    figures: Vec<f64>,
    /// Differences of e_g, of FIT as a share, and of rms_x relative to the state or to its error,
    /// whichever is larger.
    responses: [Vec<f64>; 3],
    /// The largest estimate's difference, of eps times the condition number of the worst pass: least squares, IV.
    multiples: [f64; 2],
    /// Rows whose failure or stability differs where rounding can have grown to any size.
    explained: usize,
    /// The others, in words.
    unexplained: Vec<String>,
}

/// Two rows of an output and the errors of its parameters.
struct Pair<'a> {
    faer: &'a Row,
    lanes: &'a Row,
    faer_errors: &'a [f64],
    lanes_errors: &'a [f64],
    is_iv: bool,
}

impl Pair<'_> {
    fn agree(&self) -> bool {
        (self.faer.failure, self.faer.unstable) == (self.lanes.failure, self.lanes.unstable)
    }

    fn tame(&self) -> bool {
        self.agree() && self.faer.failure.is_none() && self.faer.unstable == Some(false)
    }

    /// `|theta_lanes - theta_faer| / |theta_faer|` of theta = (a, h).
    fn difference(&self, truth: &[f64]) -> f64 {
        let errors = || self.lanes_errors.iter().zip(self.faer_errors);
        let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
        let faer = norm(&mut truth.iter().zip(self.faer_errors).map(|(x, e)| x + e));
        norm(&mut errors().map(|(x, y)| x - y)) / faer
    }
}

/// Figures that are undefined on one side only.
fn undefined_differ(pair: &Pair<'_>) -> Vec<&'static str> {
    let differs = |figure: &&Measure| pair.faer[**figure].is_nan() != pair.lanes[**figure].is_nan();
    let differ = Measure::ALL.iter().filter(differs);
    differ.map(|figure| figure.name()).collect()
}

const FIGURES: [Measure; 9] = [
    Measure::Ea,
    Measure::Eb,
    Measure::Eh,
    Measure::Ex0,
    Measure::ExMax,
    Measure::ExRms,
    Measure::ImpulseResponse,
    Measure::FreshFit,
    Measure::RmsState,
];

fn compare(case: &Case, count: u64) -> Found {
    let experiment = case.experiment();
    let cell = experiment.cells[0].discrete().expect("records");
    let (n, window) = (cell.order, cell.window);
    let PlantSource::Fixed(plant) = &cell.process.settings().plant else {
        panic!("a fixed plant");
    };
    let truth = [plant.a(), &plant.h()].concat();
    let (faer, lanes) = (by_faer(&experiment, count), by_lanes(&experiment, count));
    let mut found = Found {
        rows: faer.rows.len(),
        truth: truth.clone(),
        ..Found::default()
    };
    assert_eq!(lanes.rows.len(), found.rows);
    for trial in 0..count as usize {
        let mut first = 0;
        for method in &experiment.methods {
            let mut before = Before::default();
            for (index, pass) in method.reported().iter().enumerate() {
                assert_eq!(index, *pass, "every pass is reported");
                let output = first + index;
                let row = |trials: &Trials| trials.rows.row(trial, output);
                let errors = |trials: &Trials| trials.rows.parameters(trial, output);
                let pair = Pair {
                    faer: &row(&faer),
                    lanes: &row(&lanes),
                    faer_errors: &errors(&faer),
                    lanes_errors: &errors(&lanes),
                    is_iv: index > 0,
                };
                before.account(&pair, window);
                found.account(&case.name, &pair, &before, lost_by_a_solve(n, window));
                before.end(&pair, &truth);
            }
            first += method.reported().len();
        }
    }
    found
}

/// The error of theta by rounding in a solve, relative to eps and condition: sums of N products with N eps of their
/// absolute values, which are at most 2n times the matrix's norm, on both sides of the equations; two programs. See
/// `noise_free_recovery` in tests/properties.rs.
fn lost_by_a_solve(n: usize, window: usize) -> f64 {
    (8 * n * window) as f64
}

/// The worst of a trial's passes up to one.
#[derive(Default)]
struct Before {
    /// Whether an earlier pass failed or was unstable.
    wild: bool,
    /// The largest condition number.
    condition: f64,
    /// How much the auxiliary models' simulations let grow: the largest `rho^N`.
    growth: f64,
    /// The difference of the last estimate.
    difference: f64,
}

impl Before {
    fn account(&mut self, pair: &Pair<'_>, window: usize) {
        for row in [pair.faer, pair.lanes] {
            // f64::max leaves NaN out.
            self.condition = self.condition.max(row[Measure::Condition]);
            let radius = row[Measure::SpectralRadius].max(1.0);
            self.growth = self.growth.max(radius.powi(window as i32));
        }
    }

    fn end(&mut self, pair: &Pair<'_>, truth: &[f64]) {
        self.wild |= !pair.tame();
        self.difference = pair.difference(truth);
    }
}

impl Found {
    /// One row; `lost` is what a solve loses of eps times the condition number.
    fn account(&mut self, name: &str, pair: &Pair<'_>, before: &Before, lost: f64) {
        let (faer, lanes) = (pair.faer, pair.lanes);
        let lost = lost * f64::EPSILON * before.condition;
        if !pair.agree() {
            // Rounding, grown by simulations of unstable models, has reached the estimates' size; or a pole lies on the
            // circle to rounding.
            let chaotic = before.wild && !(lost * before.growth < 1e-3);
            let on_circle = |row: &Row| (row[Measure::SpectralRadius] - 1.0).abs() < 1e-6;
            let flips = faer.failure == lanes.failure && on_circle(faer) && on_circle(lanes);
            if chaotic || flips || !(lost < 1.0) {
                self.explained += 1;
            } else {
                self.unexplained.push(format!(
                    "{:?} {:?} for {:?} {:?}, condition {:e}, growth {:e}, before {:e}, e_x {:e} {:e}",
                    lanes.failure,
                    lanes.unstable,
                    faer.failure,
                    faer.unstable,
                    before.condition,
                    before.growth,
                    before.difference,
                    lanes[Measure::ExMax],
                    faer[Measure::ExMax],
                ));
            }
            return;
        }
        let differ = undefined_differ(pair);
        if !differ.is_empty() {
            let why = faer.failure;
            self.unexplained
                .push(format!("{differ:?} undefined on one side, {why:?}"));
        }
        if before.wild || !pair.tame() {
            return;
        }
        let difference = pair.difference(&self.truth);
        self.estimates.push(difference);
        self.conditions.push(before.condition);
        let multiple = difference / (f64::EPSILON * before.condition);
        let which = &mut self.multiples[usize::from(pair.is_iv)];
        *which = which.max(multiple);
        assert!(difference <= lost, "{name}: {difference:e} > {lost:e}");
        for figure in FIGURES {
            let (x, y) = (lanes[figure], faer[figure]);
            if !x.is_nan() {
                self.figures.push((x - y).abs() / y.abs());
            }
        }
        let difference = |measure: Measure| (lanes[measure] - faer[measure]).abs();
        let error = faer[Measure::RmsState];
        let size = error.max(error / faer[Measure::ExRms]);
        let differences = [
            difference(Measure::ImpulseResponse),
            difference(Measure::FreshFit) / 100.0,
            difference(Measure::RmsState) / size,
        ];
        for (all, difference) in self.responses.iter_mut().zip(differences) {
            assert!(difference.is_finite(), "{name}: {differences:?}");
            all.push(difference);
        }
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Every estimate of a trial that is stable in every pass differs by at most what rounding takes, `8 n N eps` times the
/// largest condition number so far. That is derived for least squares; in later passes what differs before enters
/// through instruments, which move an estimate by its residual only, and the same bound is asserted.
///
/// The differences of e_g, FIT and rms_x are in the middle at most a thousand times those of the estimates: the
/// responses of these models move by up to 50 times as much.
///
/// The median is at most 1e-10, or `2n eps` times the median condition number where that is more (order 20).
///
/// Failures and stability agree wherever rounding cannot have grown to the estimates' size, and there in all but a
/// fiftieth of the rows of trials that are not stable in every pass: those simulate unstable models, each pass with the
/// estimates of the one before.
#[test]
fn estimates_and_failures_are_those_of_faer() {
    let count = if small() { 20 } else { 120 };
    let cases = cases();
    let measured = cases.iter().filter(|case| case.text.contains("\"change\"]"));
    let (mut rows, mut wild, mut explained, mut unexplained) = (0, 0, 0, 0);
    for case in measured {
        let mut found = compare(case, count);
        let tame = found.estimates.len();
        let largest = found.estimates.iter().copied().fold(0.0, f64::max);
        let middle = median(&mut found.estimates);
        println!(
            "{}: {tame} of {} rows tame; estimates: median {middle:.1e}, largest {largest:.1e}, of eps condition {:.1} \
             {:.1}; figures: median {:.1e}; explained {}, unexplained {}",
            case.name,
            found.rows,
            found.multiples[0],
            found.multiples[1],
            median(&mut found.figures),
            found.explained,
            found.unexplained.len(),
        );
        for line in found.unexplained.iter().take(3) {
            println!("    {line}");
        }
        let ill = found.truth.len() as f64 * f64::EPSILON * median(&mut found.conditions);
        assert!(middle <= ill.max(1e-10), "{}: {middle:e}", case.name);
        let responses = found.responses.each_mut().map(|errors| median(errors));
        println!("    e_g, FIT, rms_x: {responses:?}");
        let most = 1e3 * middle.max(f64::EPSILON);
        assert!(
            responses.iter().all(|response| *response <= most),
            "{}: {responses:?} for {middle:e}",
            case.name
        );
        rows += found.rows;
        wild += found.rows - tame;
        explained += found.explained;
        unexplained += found.unexplained.len();
    }
    println!("{rows} rows, {wild} of them not tame; {explained} explained, {unexplained} unexplained");
    assert_eq!(unexplained, 0);
    assert!(50 * explained <= wild, "{explained} of {wild}");
}

/// The other measures of a study move no bit of a measure, by either engine.
#[test]
fn a_measure_alone_is_what_it_is_among_all() {
    let case = Case::all("all", 6, "window = 30\nhorizon = 90\neta = 30.0", super::IV);
    let all = case.experiment();
    for engine in [by_faer, by_lanes] {
        let expected = engine(&all, 40);
        for &measure in &all.file.measures {
            let top = format!("measures = [\"{measure}\"]");
            let settings = "window = 30\nhorizon = 90\neta = 30.0";
            let case = Case::new("alone", 6, &top, settings, super::IV);
            let found = engine(&case.experiment(), 40);
            for (found, expected) in found.rows.iter().zip(expected.rows.iter()) {
                let bits = |row: &Row| row[measure].to_bits();
                assert_eq!(bits(&found), bits(&expected), "{measure}");
            }
        }
    }
}

/// Quantiles of e_x(k) for every k: an order statistic that differs by rounding is in the same bin or the next one.
#[test]
fn curves_are_those_of_faer() {
    for (name, order, eta, x0) in [
        ("plain", 2, 5.0, "1.0"),
        ("at rest", 2, 5.0, "0.0"),
        ("six", 6, 2.0, "1.0"),
    ] {
        let settings = format!("window = 60\nhorizon = 130\neta = {eta:?}\nx0 = {x0}");
        let top = "measures = [\"e_a\"]\ncurves = true";
        let case = Case::new(
            name,
            order,
            top,
            &settings,
            "[[methods]]\nestimator = \"iv\"\nreport = [0, 4]\n",
        );
        let experiment = case.experiment();
        let (faer, lanes) = (by_faer(&experiment, 300), by_lanes(&experiment, 300));
        let [faer, lanes] = [faer, lanes].map(|trials| trials.curves.expect("curves").take(&(0..300)));
        for last in [false, true] {
            let (faer, lanes) = (faer.quantiles(last), lanes.quantiles(last));
            for (faer, lanes) in [(faer.q05, lanes.q05), (faer.q50, lanes.q50), (faer.q95, lanes.q95)] {
                for (k, (faer, lanes)) in faer.into_iter().zip(lanes).enumerate() {
                    assert_eq!(faer.is_some(), lanes.is_some(), "{name}: k = {k}, {faer:?} {lanes:?}");
                    if let (Some(faer), Some(lanes)) = (faer, lanes) {
                        let ratio = faer.max(lanes) / faer.min(lanes);
                        assert!(
                            ratio <= 1.0 + 2.0 * CURVE_BIN_ERROR,
                            "{name}: k = {k}, {faer:e} {lanes:e}"
                        );
                    }
                }
            }
        }
    }
}

/// Curves are over the first trials of a cell, wherever a pack begins and whatever computes it.
#[test]
fn curves_end_with_their_last_trial() {
    let methods = "[[methods]]\nestimator = \"iv\"\nreport = [0, 4]\n";
    let top = "measures = [\"e_a\"]\ncurves = true";
    let settings = "window = 60\nhorizon = 70\neta = 5.0\nx0 = 1.0";
    let experiment = Case::new("end", 2, top, settings, methods).experiment();
    let cell = &experiment.cells[0];
    let curves = |range: Range<u64>, by_lanes: bool| {
        let mut trials = empty(&experiment);
        if by_lanes {
            let plan = Plan::new(&experiment, cell).expect("a covered cell");
            plan.pack(tested()[0]).run_into(range.clone(), &mut trials);
        } else {
            let mut trial = Trial::new(&experiment, cell).expect("a valid cell");
            let all = range.clone();
            all.for_each(|index| trial.run_into(index, &mut trials).unwrap());
        }
        trials.curves.expect("curves").take(&range)
    };
    for by_lanes in [false, true] {
        let first = CURVE_TRIALS - 11;
        let until_end = curves(first..CURVE_TRIALS, by_lanes);
        assert!(until_end.quantiles(true).q50[69].is_some());
        assert_eq!(curves(first..CURVE_TRIALS + 9, by_lanes), until_end);
        assert_eq!(curves(CURVE_TRIALS..CURVE_TRIALS + 9, by_lanes), Curves::new(70));
    }
}

/// Where rounding grows to the size of the estimates, their distribution is the same: medians of all trials within four
/// standard errors of their difference, as if the trials were independent (they share their records).
#[test]
fn distributions_are_those_of_faer() {
    let count = if small() { 60 } else { 800 };
    for (order, window, eta) in [(6, 18, 30.0), (6, 30, 80.0), (3, 12, 150.0)] {
        let settings = format!("window = {window}\nhorizon = {}\neta = {eta:?}", window + 60);
        let case = Case::all(&format!("order {order}, N = {window}"), order, &settings, super::IV);
        let experiment = case.experiment();
        let (faer, lanes) = (by_faer(&experiment, count), by_lanes(&experiment, count));
        let outputs = experiment.outputs().len();
        for output in 0..outputs {
            let sample = |trials: &Trials, figure: Measure| {
                let rows = trials.rows.iter().skip(output).step_by(outputs);
                Sample::from_values(rows.map(|row| row[figure])).quantile(0.5, asobench::metric::Worse::Larger)
            };
            for figure in FIGURES {
                let (faer, lanes) = (sample(&faer, figure), sample(&lanes, figure));
                let error = faer.mcse.hypot(lanes.mcse);
                let difference = (faer.value - lanes.value).abs();
                println!(
                    "{}, {figure}({output}): {:e} {:e} +- {error:.1e}",
                    case.name, faer.value, lanes.value
                );
                assert!(
                    difference <= 4.0 * error,
                    "{}, {figure}({output}): {difference:e}",
                    case.name
                );
            }
            // Counts of failures and of unstable models.
            let share = |trials: &Trials, what: &dyn Fn(&Row) -> bool| {
                let rows = trials.rows.iter().skip(output).step_by(outputs);
                rows.filter(|row| what(row)).count() as f64
            };
            for what in [&|row: &Row| row.failure.is_some(), &|row: &Row| {
                row.unstable == Some(true)
            }] as [&dyn Fn(&Row) -> bool; 2]
            {
                let (faer, lanes) = (share(&faer, what), share(&lanes, what));
                let p = faer / count as f64;
                let error = (2.0 * count as f64 * p * (1.0 - p)).sqrt();
                assert!(
                    (faer - lanes).abs() <= 4.0 * error.max(1.0),
                    "{}: {faer} {lanes}",
                    case.name
                );
            }
        }
    }
}
