//! Workload W98, timed on each engine beside the peak of the machine.

use super::arguments::Arguments;
use super::rates::{Rates, ended};
use crate::cli::error::{Error, bad_input, failed};
use crate::cli::output::show;
use crate::cli::progress;
use crate::lanes::Isa;
use crate::metric::Worse;
use crate::study::file::ExperimentFile;
use crate::study::{CellTally, Engine, Experiment, W98, fma_peak, run};
use serde_json::{Value, json};
use std::convert::Infallible;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

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
    rates: Rates,
    /// Flop per second of all threads, just before and just after the timing.
    peak: [f64; 2],
    tally: CellTally,
}

impl Timing {
    fn fraction_of_peak(&self) -> f64 {
        let [before, after] = self.peak;
        self.rates.median() * FLOP_PER_TRIAL / f64::midpoint(before, after)
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
        let [slowest, fastest] = self.rates.ends();
        json!({
            "engine": self.engine,
            "instructions": self.instructions(),
            "threads": self.threads,
            "trials": self.trials,
            "repetitions": self.rates.0.len(),
            "trials_per_second": self.rates.median(),
            "slowest": slowest,
            "fastest": fastest,
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
    let mut tally = CellTally::default();
    let rates = Rates::measure(repetitions, trials, || {
        tally = sample(experiment, trials, threads, stop)?;
        Ok(())
    })?;
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
    done.map_err(ended)?;
    Ok(tally)
}

fn peak(threads: usize) -> f64 {
    fma_peak(Isa::best(), threads, Duration::from_millis(100))
}

fn text(timings: &[Timing]) -> String {
    let speeds = timings.iter().map(|timing| {
        let [slowest, fastest] = timing.rates.ends();
        format!(
            "{:<7} {:<13} {:>7} {:>10.0}  {:<20} {:>12.1} %\n",
            timing.engine.name(),
            timing.instructions(),
            timing.threads,
            timing.rates.median(),
            format!("({slowest:.0}, {fastest:.0})"),
            100.0 * timing.fraction_of_peak(),
        )
    });
    let medians = timings.iter().map(|timing| {
        let [e_a, e_b, e_x_max] = timing.figures().map(|[value, mcse]| {
            if mcse.is_finite() {
                format!("{value:.5} \u{b1} {mcse:.5}")
            } else {
                format!("{value:.5}")
            }
        });
        let (engine, threads, trials) = (timing.engine.name(), timing.threads, timing.trials);
        format!("{engine:<7} {threads:>7} {trials:>10}  {e_a:<15} {e_b:<15} {e_x_max}\n")
    });
    let peaks = timings.iter().map(|timing| (timing.peak[0] + timing.peak[1]) / 2e9);
    let peaks: Vec<String> = peaks.map(|peak| format!("{peak:.0}")).collect();
    format!(
        "W98: n = 6, N = 98, K = 400, least squares and four IV passes, observer\n\n\
         engine  instructions  threads   trials/s  (slowest, fastest)   share of peak\n{}\n\
         engine  threads     trials  median e_a      median e_b      median max e_x\n{}\n\
         Share of peak: {FLOP_PER_TRIAL} flop for a trial, a fixed count, over the measured peak of\n\
         fused multiply-adds on registers ({} Gflop/s, before and after each line).\n\
         Every line is the median of repetitions; the last one's medians are printed.\n",
        speeds.collect::<String>(),
        medians.collect::<String>(),
        peaks.join(", "),
    )
}

/// Times the workload on the engines and numbers of threads that were asked for.
pub(super) fn time_engines(arguments: &Arguments, threads: &[usize], processors: usize) -> Result<(), Error> {
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
    let best = |peak: f64, timing: &Timing| peak.max(timing.peak[0]).max(timing.peak[1]);
    let json = || {
        json!({
            "workload": "W98",
            "flop_per_trial": FLOP_PER_TRIAL,
            "processors": processors,
            "fma_peak_gflops": timings.iter().fold(0.0, best) / 1e9,
            "engines": timings.iter().map(Timing::json).collect::<Vec<Value>>(),
        })
    };
    show(arguments.format, || text(&timings), json)
}
