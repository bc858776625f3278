//! The ratio of the medians of two outputs on the same trials, whose truth is known: its error uses that they are of
//! the same trials, and its verdicts keep their level.

#![expect(clippy::print_stdout, reason = "the rates that were found")]

use crate::claim::evidence::Evidence;
use crate::claim::statistics::{Members, Results};
use crate::claim::tests::*;
use crate::design::file::needs::MediansTable;
use crate::outcome::summary::MedianPair;
use asobench_identification::metric::correlation_of_medians;
use asobench_identification::signal::normal::fill_standard_normal;
use asobench_identification::signal::{Purpose, stream};

const LEVEL: f64 = 0.025;
const REPETITIONS: u64 = 2000;

/// Returns the ratio of the medians of a study, its standard error as the engine prints it, and the p-values of "it is
/// below 1", which is the truth's limit: both outputs are log-normal with median 1, and their logarithms have this
/// correlation.
fn drawn(number: u64, trials: usize, rho: f64) -> (Option<[f64; 2]>, [f64; 2]) {
    let mut z = vec![0.0; 2 * trials];
    fill_standard_normal(&mut stream(8, number, Purpose::NoiseDrive), &mut z);
    let (x, y) = z.split_at(trials);
    let first: Vec<f64> = x.iter().map(|x| x.exp()).collect();
    let other = (1.0 - rho * rho).sqrt();
    let second = x.iter().zip(y).map(|(x, y)| (rho * x + other * y).exp());
    let second: Vec<f64> = second.collect();
    let mut results = summary(vec![cell(0, 10.0, trials as u64)]);
    let cell = &mut results.cells[0];
    let correlation = correlation_of_medians((&first, Worse::Larger), (&second, Worse::Larger));
    cell.medians = vec![MedianPair {
        table: MediansTable {
            output: "new".to_owned(),
            measure: Measure::Ea,
            to: "old".to_owned(),
            measure_of_to: Measure::Ea,
        },
        correlation: correlation.unwrap(),
    }];
    for (output, values) in cell.outputs.iter_mut().zip([first, second]) {
        let statistics = Sample::from_values(values).statistics(Worse::Larger);
        output.measures.insert(Measure::Ea, statistics);
    }
    let results = Results {
        summary: &results,
        times: &[],
    };
    let test =
        test_again("ratio = 'e_a'\nof = 'new'\nto = 'old'\nstatistic = 'median'\nbelow = 1.0");
    let evidence = Evidence::new(results, &[test], &Members::Cell(0));
    let shown = evidence.parts.first().map(|part| part.number.known.shown());
    let p = evidence.p_values();
    (shown.map(|(value, error)| [value, error]), [p.pass, p.fail])
}

#[test]
fn ratios_of_medians_keep_their_level_and_use_the_pairing() {
    let most = LEVEL + 3.0 * (LEVEL * (1.0 - LEVEL) / REPETITIONS as f64).sqrt();
    for trials in [8, 20, 100, 400] {
        for rho in [0.0, 0.9, -0.9] {
            let (mut wrong, mut values, mut errors) = ([0_u64; 2], vec![], vec![]);
            for number in 0..REPETITIONS {
                let (shown, p) = drawn(number, trials, rho);
                for (count, p) in wrong.iter_mut().zip(p) {
                    *count += u64::from(p <= LEVEL);
                }
                if let Some([value, error]) = shown {
                    values.push(value.ln());
                    errors.push(error / value);
                }
            }
            let rates = wrong.map(|count| count as f64 / REPETITIONS as f64);
            println!("{trials} trials, correlation {rho}: {rates:?}");
            assert!(
                rates.iter().all(|rate| *rate <= most),
                "{trials} {rho}: {rates:?}"
            );
            if trials == 400 {
                // The true spread over the studies, and the printed one.
                let n = values.len() as f64;
                let mean = values.iter().sum::<f64>() / n;
                let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
                let (spread, printed) = ((squares / n).sqrt(), errors.iter().sum::<f64>() / n);
                println!("spread {spread:.4}, printed {printed:.4}");
                assert!(
                    (0.9..1.25).contains(&(printed / spread)),
                    "{rho}: {printed} {spread}"
                );
            }
        }
    }
}
