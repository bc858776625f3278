//! `asobench test-method`: tests whether a program follows docs/protocol.md and does what a method must.

use super::error::{Error, bad_file, failed};
use super::exit_code::FAILED;
use super::output::{print, wrapped};
use super::programs::{self, Consent, introduced};
use super::study_arguments::StudyArguments;
use crate::data::{Process, ProcessSettings};
use crate::estimator::{Pass, Progress};
use crate::model::LinearModel;
use crate::study::DiscreteCell;
use crate::text::visible;
use crate::worker::{Answered, Program, Record, ask_once, introduce};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Records on which models are compared.
const RECORDS: u64 = 16;
/// The largest difference between models from different batch sizes.
const ALIKE: f64 = 1e-10;
/// The largest relative error of a model from a record without noise.
const RECOVERED: f64 = 1e-6;
/// Samples of impulse responses.
const SAMPLES: usize = 50;
/// The indentation of continued lines.
const INDENT: &str = "          ";
/// How often a message is timed, unless that takes longer than [`TIMING`].
const REPETITIONS: usize = 5;
const TIMING: Duration = Duration::from_secs(5);

/// Test the programs that are methods of an experiment file, on records of its first cell.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    #[command(flatten)]
    consent: Consent,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let study = &arguments.study;
    let (_, experiment) = introduced(study.read()?, &study.file, &arguments.consent)?;
    let Some(experiment) = experiment else {
        let message = "no method is a program; expected [[methods]] with 'command'";
        return Err(bad_file(&study.file)(message));
    };
    let cell = experiment.cells[0].discrete();
    let cell = cell.ok_or_else(|| failed("a study in continuous time has no records"))?;
    let mut passed = true;
    for program in &experiment.programs {
        let test = Test {
            program,
            cell,
            seed: experiment.file.seed,
        };
        passed &= test.run()?;
        program.end();
    }
    if passed { Ok(()) } else { Err(Error::Told(FAILED)) }
}

/// Why a check did not pass.
enum Stop {
    /// The program is wrong.
    Wrong(String),
    /// The test itself cannot go on.
    Ended(Error),
}

/// The word for the result of a check and its description.
type Outcome = Result<(&'static str, String), Stop>;

/// All is as required.
fn fine(seen: impl Into<String>) -> (&'static str, String) {
    ("ok", seen.into())
}

/// It is allowed, and worth knowing.
fn notable(seen: impl Into<String>) -> (&'static str, String) {
    ("note", seen.into())
}

fn wrong(why: impl Into<String>) -> Outcome {
    Err(Stop::Wrong(why.into()))
}

struct Test<'a> {
    program: &'a Arc<Program>,
    cell: &'a DiscreteCell,
    seed: u64,
}

impl Test<'_> {
    /// Prints a line for each check. Returns whether all passed.
    fn run(&self) -> Result<bool, Error> {
        let ready = introduce(self.program, &self.cell.problem(self.cell.window)).map_err(failed)?;
        let returns = if ready.matrices { "matrices" } else { "polynomials" };
        let same = if ready.deterministic { "" } else { "not " };
        print(&format!(
            "{}: {}, returns {returns}, {same}deterministic\n",
            visible(&self.program.name),
            visible(ready.identity())
        ))?;
        type Check<'a, 'b> = &'b dyn Fn(&Test<'a>) -> Outcome;
        let checks: [(&str, Check<'_, '_>); 6] = [
            ("models", &Self::models),
            ("the same batch twice", &|test| test.twice(ready.deterministic)),
            ("other batch sizes", &|test| test.sizes(ready.deterministic)),
            ("a record without noise", &Self::noise_free),
            ("odd records", &Self::odd),
            ("time", &Self::time),
        ];
        let mut passed = true;
        let mut told = Vec::new();
        for (name, check) in checks {
            let before = self.program.log.length();
            let (word, text) = match check(self) {
                Ok(seen) => seen,
                Err(Stop::Wrong(wrong)) => ("WRONG", wrong),
                Err(Stop::Ended(error)) => return Err(error),
            };
            let line = format!("  {word:<7} {name}: {}", visible(text));
            print(&wrapped(&line, INDENT))?;
            if word == "WRONG" {
                passed = false;
                let printed = programs::printed(self.program, before);
                if printed != told {
                    let lines = printed.iter().map(|line| format!("{INDENT}{line}\n"));
                    print(&lines.collect::<String>())?;
                    told = printed;
                }
            }
        }
        Ok(passed)
    }

    fn records(&self, count: u64) -> Vec<Record> {
        let record = |trial| self.cell.record_for_program(self.seed, trial).0;
        (0..count).map(record).collect()
    }

    fn ask(&self, records: &[Record]) -> Result<Answered, Stop> {
        let samples = records.first().map_or(0, |record| record.y.len());
        let asked = ask_once(self.program, &self.cell.problem(samples), records);
        asked.map_err(|error| Stop::Ended(failed(error)))?.map_err(Stop::Wrong)
    }

    fn models(&self) -> Outcome {
        let answered = self.ask(&self.records(RECORDS))?;
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for pass in &answered.passes {
            *counts.entry(word(pass)).or_default() += 1;
        }
        let found: Vec<String> = counts.iter().map(|(name, count)| format!("{count} {name}")).collect();
        let text = format!("of {RECORDS} records {}", found.join(", "));
        match (counts.contains_key(MODEL), counts.len()) {
            (false, _) => wrong(format!("{text}; expected a model for at least one")),
            (true, 1) => Ok(fine(text)),
            (true, _) => Ok(notable(text)),
        }
    }

    fn twice(&self, deterministic: bool) -> Outcome {
        let records = self.records(RECORDS);
        let (first, second) = (self.ask(&records)?, self.ask(&records)?);
        match (first.same_bits(&second), deterministic) {
            (true, _) => Ok(fine("the same bits")),
            (false, false) => Ok(fine("different bits, as it declares")),
            (false, true) => wrong("different bits, although it says that it is deterministic"),
        }
    }

    fn sizes(&self, deterministic: bool) -> Outcome {
        if !deterministic {
            return Ok(notable("not compared, since it is not deterministic"));
        }
        let records = self.records(RECORDS);
        let whole = self.ask(&records)?;
        let mut largest = 0.0_f64;
        for size in [1, 5] {
            for (part, expected) in records.chunks(size).zip(whole.passes.chunks(size)) {
                let found = self.ask(part)?;
                for ((found, expected), record) in found.passes.iter().zip(expected).zip(part) {
                    let trial = record.trial;
                    let Some(apart) = apart(found, expected) else {
                        return wrong(format!(
                            "trial {trial} in a batch of {size}: {}; in one of {RECORDS}: {}; expected the same \
                             status and orders",
                            word(found),
                            word(expected)
                        ));
                    };
                    if !(apart <= ALIKE) {
                        return wrong(format!(
                            "trial {trial} in a batch of {size} is {apart:.1e} from the same in one of {RECORDS}; \
                             expected at most {ALIKE:e}"
                        ));
                    }
                    largest = largest.max(apart);
                }
            }
        }
        Ok(fine(format!("1 and 5 instead of {RECORDS}: within {largest:.1e}")))
    }

    fn noise_free(&self) -> Outcome {
        let plant_order = self.cell.plant_order();
        let asked = self.program.options.orders;
        if asked.map_or(self.cell.order, crate::model::Orders::order) < plant_order {
            return Ok(notable("not asked, since the plant has a larger order"));
        }
        let process = Process::from_settings(ProcessSettings {
            x0: vec![0.0; plant_order],
            x0_deviation: 0.0,
            input_noise: 0.0,
            process_noise: 0.0,
            state_noise: None,
            change: None,
            ..self.cell.process.settings().clone()
        });
        let noise_free = DiscreteCell {
            process: process.map_err(|error| Stop::Ended(failed(error)))?,
            eta: 0.0,
            ..self.cell.clone()
        };
        let mut first = String::new();
        for trial in 0..RECORDS {
            let (record, truth) = noise_free.record_for_program(self.seed, trial);
            let answered = self.ask(&[record])?;
            let pass = &answered.passes[0];
            if pass.progress >= Progress::Parameters {
                let plant = LinearModel::from_canonical(&truth.a, &truth.h, 1);
                return recovered(&plant, &pass.model, trial);
            }
            if trial == 0 {
                word(pass).clone_into(&mut first);
            }
        }
        Ok(notable(format!(
            "trial 0 {first}, no model of trials 0 to {}",
            RECORDS - 1
        )))
    }

    fn odd(&self) -> Outcome {
        let plain = self.records(1).swap_remove(0);
        let n = plain.y.len();
        let of = |u: f64, y: f64| Record {
            u: vec![u; n],
            y: vec![y; n],
            r: vec![u; n],
            ..plain.clone()
        };
        let short = 3 * self.cell.order;
        let cut = |signal: &[f64]| signal[..short.min(n)].to_vec();
        let shortened = Record {
            u: cut(&plain.u),
            y: cut(&plain.y),
            r: cut(&plain.r),
            ..plain.clone()
        };
        let (mut seen, mut all_fine) = (Vec::new(), true);
        for (name, record) in [
            ("NaN", of(f64::NAN, f64::NAN)),
            ("constant", of(1.0, 1.0)),
            ("zero", of(0.0, 0.0)),
            ("short", shortened),
            ("as before", plain.clone()),
        ] {
            let what = match self.ask(&[record]) {
                Ok(answered) => word(&answered.passes[0]).to_owned(),
                Err(Stop::Wrong(why)) => {
                    all_fine = false;
                    why
                }
                ended => ended.map(|_| String::new())?,
            };
            seen.push(format!("{name}: {what}"));
        }
        let seen = seen.join(", ");
        if all_fine { Ok(fine(seen)) } else { wrong(seen) }
    }

    /// Returns the median time of a message with so many records, seconds.
    fn seconds(&self, count: u64) -> Result<f64, Stop> {
        let (records, begin) = (self.records(count), Instant::now());
        let mut seconds = Vec::new();
        while seconds.len() < REPETITIONS && (seconds.is_empty() || begin.elapsed() < TIMING) {
            seconds.push(self.ask(&records)?.elapsed.as_secs_f64());
        }
        seconds.sort_by(f64::total_cmp);
        Ok(seconds[seconds.len() / 2])
    }

    fn time(&self) -> Outcome {
        let batch = self.program.options.batch;
        let (single, seconds) = (self.seconds(1)?, self.seconds(batch)?);
        let text = format!(
            "{:.3} ms for a record alone, {:.3} ms for each of {batch}",
            1e3 * single,
            1e3 * seconds / batch as f64
        );
        let timeout = self.program.options.timeout;
        if seconds > timeout / 2.0 {
            return wrong(format!(
                "{text}: {seconds:.1} s for a batch, near the timeout of {timeout} s; expected a smaller 'batch'"
            ));
        }
        Ok(fine(text))
    }
}

/// Compares a model with the plant that made the noise-free record of a trial.
fn recovered(plant: &LinearModel, model: &LinearModel, trial: u64) -> Outcome {
    let response = |model: &LinearModel| {
        let (mut impulse, mut response) = (vec![0.0; SAMPLES], vec![0.0; SAMPLES]);
        impulse[0] = 1.0;
        model.simulate(&impulse, &mut response);
        response
    };
    let error = crate::metric::relative_error(&response(plant), &response(model));
    let text = format!("impulse response {error:.1e} from the plant's");
    if !(error <= RECOVERED) {
        return wrong(format!("{text}; expected at most {RECOVERED:e}"));
    }
    match trial {
        0 => Ok(fine(text)),
        later => Ok(notable(format!(
            "{text}, for trial {later}: no model for the trials before it"
        ))),
    }
}

/// The word for a pass that has not failed.
const MODEL: &str = "with a model";

/// Describes a pass in a word.
fn word(pass: &Pass) -> &str {
    let failure = pass.failure.as_ref();
    failure.map_or(MODEL, |failure| failure.kind.name())
}

/// Returns the largest difference of a coefficient between two models, relative if it is above 1; `None` if they cannot
/// be compared.
fn apart(a: &Pass, b: &Pass) -> Option<f64> {
    if word(a) != word(b) || a.model.orders() != b.model.orders() {
        return None;
    }
    let pairs = a.model.parameters().zip(b.model.parameters());
    let apart = pairs.map(|(a, b)| (a - b).abs() / b.abs().max(1.0));
    Some(apart.fold(0.0, f64::max))
}
