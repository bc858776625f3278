//! Workload W98, timed on each engine beside the peak of the machine.

use super::arguments::Arguments;
use super::study::median;
use crate::cli::error::{Error, bad_input, failed};
use crate::cli::output::{Format, print, print_json};
use crate::cli::progress;
use crate::lanes::Isa;
use crate::metric::Worse;
use crate::study::file::ExperimentFile;
use crate::study::{CellTally, Engine, Experiment, RunError, W98, fma_peak, run};
use serde_json::{Value, json};
use std::convert::Infallible;
use std::fmt::Write as _;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// The operations counted for a trial of W98, whatever the program really computes. So wasteful code does not look
/// good.
const FLOP_PER_TRIAL: f64 = 110_000.0;

/// Returns the trials in a repetition: about a second's work on one thread.
const fn default_trials(engine: Engine) -> u64 {
    match engine {
        Engine::Faer => 16_384,
        Engine::Auto | Engine::Lanes => 524_288,
    }
}

/// The times of one engine with some number of threads.
struct Timing {
    engine: Engine,
    threads: usize,
    trials: u64,
    /// Trials per second of every repetition, ascending.
    rates: Vec<f64>,
    /// Flop per second of all threads, just before and just after the timing.
    peak: [f64; 2],
    tally: CellTally,
}

impl Timing {
    fn median(&self) -> f64 {
        median(&self.rates)
    }

    fn fraction_of_peak(&self) -> f64 {
        let [before, after] = self.peak;
        self.median() * FLOP_PER_TRIAL / f64::midpoint(before, after)
    }

    /// Returns the medians of e_a, e_b and max e_x with their standard errors.
    fn figures(&self) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|figure| {
            let median = self.tally.outputs[0].samples[figure].quantile(0.5, Worse::Larger);
            [median.value, median.mcse]
        })
    }

    fn instructions(&self) -> &'static str {
        match self.engine {
            Engine::Faer => Engine::faer_instructions(),
            Engine::Auto | Engine::Lanes => Isa::best().name(),
        }
    }

    fn json(&self) -> Value {
        let [e_a, e_b, e_x_max] = self.figures();
        json!({
            "engine": self.engine,
            "instructions": self.instructions(),
            "threads": self.threads,
            "trials": self.trials,
            "repetitions": self.rates.len(),
            "trials_per_second": self.median(),
            "slowest": self.rates.first(),
            "fastest": self.rates.last(),
            "fma_peak_gflops": self.peak.map(|peak| peak / 1e9),
            "fraction_of_fma_peak": self.fraction_of_peak(),
            "e_a": e_a[0],
            "e_b": e_b[0],
            "e_x_max": e_x_max[0],
            "e_a_mcse": e_a[1],
            "e_b_mcse": e_b[1],
            "e_x_max_mcse": e_x_max[1],
            "failed": self.tally.outputs[0].outcomes.failed(),
            "fallbacks": self.tally.fallbacks,
        })
    }
}

fn time(
    experiment: &Experiment,
    trials: u64,
    threads: usize,
    repetitions: u16,
    stop: &AtomicBool,
) -> Result<Timing, Error> {
    // The first run loads and allocates, so it is not timed.
    sample(experiment, trials.min(2000), threads, stop)?;
    let before = peak(threads);
    let mut rates = Vec::new();
    let mut tally = CellTally::default();
    for _ in 0..repetitions {
        let begin = Instant::now();
        tally = sample(experiment, trials, threads, stop)?;
        rates.push(trials as f64 / begin.elapsed().as_secs_f64());
    }
    rates.sort_by(f64::total_cmp);
    Ok(Timing {
        engine: experiment.file.engine,
        threads,
        trials,
        rates,
        peak: [before, peak(threads)],
        tally,
    })
}

/// Runs trials as a study does, and collects what a study keeps of them.
fn sample(experiment: &Experiment, trials: u64, threads: usize, stop: &AtomicBool) -> Result<CellTally, Error> {
    let mut tally = CellTally::default();
    let done = run::<Infallible>(experiment, trials, threads, stop, |block| {
        tally.merge(block.tally);
        Ok(())
    });
    match done {
        Ok(()) => Ok(tally),
        Err(RunError::Interrupted { .. }) => Err(Error::Interrupted("interrupted".to_owned())),
        Err(error) => Err(failed(error)),
    }
}

fn peak(threads: usize) -> f64 {
    fma_peak(Isa::best(), threads, Duration::from_millis(100))
}

fn text(timings: &[Timing]) -> Result<String, Error> {
    let mut text = String::from(
        "W98: n = 6, N = 98, K = 400, least squares and four IV passes, observer\n\n\
         engine  instructions  threads   trials/s  (slowest, fastest)   share of peak\n",
    );
    for timing in timings {
        let (engine, instructions) = (timing.engine.name(), timing.instructions());
        let spread = format!("({:.0}, {:.0})", timing.rates[0], timing.rates[timing.rates.len() - 1]);
        writeln!(
            text,
            "{engine:<7} {instructions:<13} {:>7} {:>10.0}  {spread:<20} {:>12.1} %",
            timing.threads,
            timing.median(),
            100.0 * timing.fraction_of_peak(),
        )
        .map_err(failed)?;
    }
    text.push_str("\nengine  threads     trials  median e_a      median e_b      median max e_x\n");
    for timing in timings {
        let figures = timing.figures().map(|[value, mcse]| {
            if mcse.is_finite() {
                format!("{value:.5} \u{b1} {mcse:.5}")
            } else {
                format!("{value:.5}")
            }
        });
        let [e_a, e_b, e_x_max] = figures;
        writeln!(
            text,
            "{:<7} {:>7} {:>10}  {e_a:<15} {e_b:<15} {e_x_max}",
            timing.engine.name(),
            timing.threads,
            timing.trials,
        )
        .map_err(failed)?;
    }
    let peaks = timings
        .iter()
        .map(|timing| format!("{:.0}", (timing.peak[0] + timing.peak[1]) / 2e9));
    let peaks: Vec<String> = peaks.collect();
    writeln!(
        text,
        "\nShare of peak: {FLOP_PER_TRIAL} flop for a trial, a fixed count, over the measured peak \
         of\n\
         fused multiply-adds on registers ({} Gflop/s, before and after each line).\n\
         Every line is the median of repetitions; the last one's medians are printed.",
        peaks.join(", "),
    )
    .map_err(failed)?;
    Ok(text)
}

/// Times the workload on the engines and numbers of threads that were asked for.
pub(super) fn time_engines(arguments: &Arguments, threads: &[usize], processors: usize) -> Result<ExitCode, Error> {
    if arguments.engine.contains(&Engine::Auto) {
        return Err(bad_input(
            "--engine: 'auto' is not an engine that can be timed; expected lanes or faer",
        ));
    }
    let stop = progress::stop_flag()?;
    let mut timings = Vec::new();
    let engines = match &arguments.engine[..] {
        [] => &[Engine::Lanes, Engine::Faer],
        asked => asked,
    };
    for &engine in engines {
        let mut file = ExperimentFile::parse(W98).map_err(failed)?;
        file.engine = engine;
        let experiment = Experiment::new(file).map_err(failed)?;
        let trials = arguments.trials;
        for &threads in threads {
            let share = default_trials(engine) * threads as u64;
            let trials = trials.unwrap_or(share);
            timings.push(time(&experiment, trials, threads, arguments.repetitions, &stop)?);
        }
    }
    match arguments.format {
        Format::Text => print(&text(&timings)?)?,
        Format::Json => {
            let engines: Vec<Value> = timings.iter().map(Timing::json).collect();
            let best = |peak: f64, timing: &Timing| peak.max(timing.peak[0]).max(timing.peak[1]);
            print_json(&json!({
                "workload": "W98",
                "flop_per_trial": FLOP_PER_TRIAL,
                "processors": processors,
                "fma_peak_gflops": timings.iter().fold(0.0, best) / 1e9,
                "engines": engines,
            }))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
