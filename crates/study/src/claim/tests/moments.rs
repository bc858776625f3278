//! Error rates of claims on moments under heavy tails, by simulation: the true moment equals the limit, so either
//! verdict is wrong. What is printed is the share of wrong verdicts, and the share of studies that leave a limit open
//! which lies a quarter above the truth.

#![expect(clippy::print_stdout, reason = "the rates that were found")]

use crate::claim::decision_rule::PValues;
use crate::claim::evidence::Evidence;
use crate::claim::statistics::{Members, Results};
use crate::claim::tests::*;
use crate::design::file::tables::SlopeTable;
use crate::outcome::summary::SlopeSummary;
use asobench_identification::metric::{Jackknife, SlopeOf, slope_of_statistics};
use asobench_identification::signal::normal::fill_standard_normal;
use asobench_identification::signal::{Purpose, stream};
use rand::RngExt;
use rayon::prelude::*;
use std::f64::consts::{E, PI};

const LEVEL: f64 = 0.025;
const SIZES: [usize; 8] = [3, 8, 20, 40, 100, 400, 1000, 4000];

/// A law of an error that is never negative.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    /// |T| of Student's law.
    Student(f64),
    /// |Z| with one outlier, thirty times as large, in a hundred.
    Outliers,
    /// exp(sigma Z).
    LogNormal(f64),
    /// |Z|.
    HalfNormal,
}

const LAWS: [Law; 7] = [
    Law::Student(2.1),
    Law::Student(3.0),
    Law::Student(5.0),
    Law::Outliers,
    Law::LogNormal(1.0),
    Law::LogNormal(0.5),
    Law::HalfNormal,
];

impl Law {
    fn draw(self, seed: u64, trial: u64, count: usize) -> Vec<f64> {
        let mut random = stream(seed, trial, Purpose::NoiseDrive);
        let mut z = vec![0.0; count];
        fill_standard_normal(&mut random, &mut z);
        z.iter()
            .map(|z| match self {
                Self::HalfNormal => z.abs(),
                Self::LogNormal(sigma) => (sigma * z).exp(),
                Self::Outliers => z.abs() * if random.random_bool(0.01) { 30.0 } else { 1.0 },
                Self::Student(nu) => (z / (2.0 * gamma(nu / 2.0, &mut random) / nu).sqrt()).abs(),
            })
            .collect()
    }

    /// The mean, and the root mean square.
    fn moments(self) -> [f64; 2] {
        match self {
            Self::HalfNormal => [(2.0 / PI).sqrt(), 1.0],
            Self::Outliers => [(2.0 / PI).sqrt() * (0.99 + 0.3), (0.99_f64 + 9.0).sqrt()],
            Self::LogNormal(s) => [E.powf(s * s / 2.0), E.powf(s * s)],
            // 2 sqrt(nu) / ((nu - 1) B(nu/2, 1/2)), B by mpmath.
            Self::Student(nu) => {
                let beta = match nu {
                    2.1 => 1.943_094_622_823_108_6,
                    3.0 => PI / 2.0,
                    _ => 3.0 * PI / 8.0,
                };
                [
                    2.0 * nu.sqrt() / ((nu - 1.0) * beta),
                    (nu / (nu - 2.0)).sqrt(),
                ]
            }
        }
    }
}

/// A number of the gamma law with this shape, at least 1 (Marsaglia and Tsang 2000).
fn gamma(shape: f64, random: &mut rand_xoshiro::Xoshiro256PlusPlus) -> f64 {
    let d = shape - 1.0 / 3.0;
    let c = 1.0 / (9.0 * d).sqrt();
    loop {
        let mut z = [0.0];
        fill_standard_normal(random, &mut z);
        let v = (1.0 + c * z[0]).powi(3);
        let u: f64 = random.random();
        if v > 0.0 && u.ln() < 0.5 * z[0] * z[0] + d - d * v + d * v.ln() {
            return d * v;
        }
    }
}

/// A statistic that claims look at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Of {
    Mean,
    Rms,
    /// Of two independent outputs.
    Ratio,
    /// Over three cells whose errors fall as N^(-1/2).
    Slope,
    /// The bias of a coefficient over its standard deviation, from the law less its mean.
    Bias,
}

impl Of {
    fn truth(self, law: Law) -> f64 {
        match self {
            Self::Mean => law.moments()[0],
            Self::Rms => law.moments()[1],
            Self::Ratio => 1.0,
            Self::Slope => -0.5,
            Self::Bias => 0.0,
        }
    }

    fn test(self, below: f64) -> ClaimTest {
        test_again(&match self {
            Self::Mean => format!("value = 'e_a'\nof = 'new'\nstatistic = 'mean'\nbelow = {below}"),
            Self::Rms => format!("value = 'e_a'\nof = 'new'\nstatistic = 'rms'\nbelow = {below}"),
            Self::Ratio => {
                format!("ratio = 'e_a'\nof = 'new'\nto = 'old'\nstatistic = 'rms'\nbelow = {below}")
            }
            Self::Slope => format!(
                "slope = 'e_a'\nof = 'new'\nover = 'window'\nstatistic = 'rms'\nbelow = {below}"
            ),
            Self::Bias => format!("value = 'a_1'\nof = 'new'\nbelow = {below}"),
        })
    }

    /// Makes the results of a study with so many trials, and the cells of its test.
    fn study(self, law: Law, number: u64, trials: usize) -> (Summary, Members) {
        let draw = |cell: u64| law.draw(cell, number, trials);
        let sample = |values: Vec<f64>| Sample::from_values(values);
        let mut results = summary(vec![cell(0, 10.0, trials as u64)]);
        match self {
            Self::Mean | Self::Rms => {
                *results.cells[0].e_a() = sample(draw(1)).statistics(Worse::Larger);
            }
            Self::Ratio => {
                let (x, y) = (draw(1), draw(2));
                let both = x.iter().zip(&y).map(|(x, y)| (Some(*x), Some(*y)));
                let pair = Paired::from_pairs(both).statistics(Worse::Larger);
                let cell = &mut results.cells[0];
                cell.comparisons[0].measures.insert(Measure::Ea, pair);
                for (output, values) in cell.outputs.iter_mut().zip([x, y]) {
                    let statistics = sample(values).statistics(Worse::Larger);
                    output.measures.insert(Measure::Ea, statistics);
                }
            }
            Self::Bias => {
                let mean = law.moments()[0];
                let errors = draw(1).iter().map(|x| x - mean).collect();
                let statistics = sample(errors).statistics(Worse::Larger);
                results.cells[0].outputs[0].parameters = vec![("a_1".to_owned(), statistics)];
            }
            Self::Slope => return Self::slope(law, number, trials),
        }
        (results, Members::Cell(0))
    }

    fn slope(law: Law, number: u64, trials: usize) -> (Summary, Members) {
        let windows = [10, 100, 1000];
        let mut cells = Vec::new();
        let mut groups = Vec::new();
        for (index, window) in windows.into_iter().enumerate() {
            let scale = (window as f64).sqrt();
            let values = law.draw(index as u64 + 1, number, trials);
            let values: Vec<f64> = values.iter().map(|x| x / scale).collect();
            let of_group =
                |g: usize| Sample::from_values(values.iter().skip(g).step_by(20).copied());
            let samples: Vec<Sample> = (0..20).map(of_group).collect();
            groups.push(Jackknife::from_groups(
                &samples,
                SlopeOf::Rmse,
                Worse::Larger,
            ));
            let mut cell = cell(index, 10.0, trials as u64);
            cell.window = window;
            *cell.e_a() = Sample::from_values(values).statistics(Worse::Larger);
            cells.push(cell);
        }
        let mut results = summary(cells);
        let x = windows.map(|window| window as f64);
        results.slopes = vec![SlopeSummary {
            table: SlopeTable {
                measure: Measure::Ea,
                over: Key::Window,
                statistic: SlopeOf::Rmse,
                from: 0.0,
            },
            output: "new".to_owned(),
            settings: BTreeMap::new(),
            cells: vec![0, 1, 2],
            slope: slope_of_statistics(&x, &groups).ok(),
            undefined: None,
        }];
        (results, Members::Family(vec![0, 1, 2]))
    }

    /// The p-values of "below" this limit.
    fn p_values(self, results: &Summary, members: &Members, below: f64) -> PValues {
        let results = Results {
            summary: results,
            times: &[],
        };
        Evidence::new(results, &[self.test(below)], members).p_values()
    }
}

/// Returns the shares of `repetitions` studies that say "below" and "above" of a limit that is the truth, and that
/// leave a limit open which the truth is well below.
fn rates(of: Of, law: Law, trials: usize, repetitions: u64) -> [f64; 3] {
    let truth = of.truth(law);
    let far = match of {
        Of::Slope | Of::Bias => truth + 0.2,
        _ => 1.25 * truth,
    };
    let one = |number: u64| {
        let (results, members) = of.study(law, number, trials);
        let at = of.p_values(&results, &members, truth);
        let beyond = of.p_values(&results, &members, far);
        [at.pass <= LEVEL, at.fail <= LEVEL, beyond.pass > LEVEL].map(u64::from)
    };
    let counts = (0..repetitions)
        .into_par_iter()
        .map(one)
        .reduce(|| [0; 3], |a, b| std::array::from_fn(|i| a[i] + b[i]));
    counts.map(|count| count as f64 / repetitions as f64)
}

fn keeps_its_level(of: Of, repetitions: u64) {
    let most = LEVEL + 3.0 * (LEVEL * (1.0 - LEVEL) / repetitions as f64).sqrt();
    let mut wrong = Vec::new();
    for law in LAWS {
        for trials in SIZES {
            let [below, above, open] = rates(of, law, trials, repetitions);
            println!("{of:?} {law:?} {trials}: below {below}, above {above}; open {open}");
            if below > most || above > most {
                wrong.push(format!("{law:?} with {trials} trials: {below} {above}"));
            }
            // A quarter is far for tame laws, so the caution must not make everything undecided.
            if law == Law::HalfNormal && trials >= 1000 {
                let few = if of == Of::Slope || of == Of::Bias {
                    0.3
                } else {
                    0.02
                };
                assert!(open <= few, "{of:?} of {trials}: {open}");
            }
        }
    }
    assert!(wrong.is_empty(), "{of:?}: {wrong:?}");
}

#[test]
fn means_with_heavy_tails() {
    keeps_its_level(Of::Mean, 2000);
}

#[test]
fn root_mean_squares_with_heavy_tails() {
    keeps_its_level(Of::Rms, 2000);
}

#[test]
fn ratios_with_heavy_tails() {
    keeps_its_level(Of::Ratio, 1000);
}

#[test]
fn slopes_with_heavy_tails() {
    keeps_its_level(Of::Slope, 300);
}

#[test]
#[ignore = "takes minutes: cargo test --release --lib -- --ignored slopes_with_heavy"]
fn slopes_with_heavy_tails_in_2000_studies() {
    keeps_its_level(Of::Slope, 2000);
}

#[test]
fn biases_with_heavy_tails() {
    keeps_its_level(Of::Bias, 1000);
}
