//! `asobench test-method`: tests whether a program follows docs/protocol.md and does what a method must.

use super::error::{Error, failed};
use super::exit_code::FAILED;
use super::output::print;
use super::programs::{self, Consent, introduced};
use super::study_arguments::StudyArguments;
use crate::data::{Process, ProcessSettings};
use crate::estimator::{Pass, Progress};
use crate::model::LinearModel;
use crate::study::DiscreteCell;
use crate::text::{visible, wrap};
use crate::worker::{Answered, Program, Record, ask_once, introduce};
use std::collections::BTreeMap;
use std::process::ExitCode;
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
/// Columns in a line, and the indentation of continued lines.
const WIDTH: usize = 80;
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

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let study = &arguments.study;
    let (_, experiment) = introduced(study.read()?, &study.file, &arguments.consent)?;
    let Some(experiment) = experiment else {
        let message = "no method is a program; expected [[methods]] with 'command'";
        return Err(Error::Input(format!("{}: {message}", study.file.display())));
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
    Ok(if passed {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(FAILED)
    })
}

/// The observation of a check that passed.
enum Seen {
    /// As required.
    Fine(String),
    /// Allowed, and worth knowing.
    Note(String),
}

/// The result of a check: what was observed, or what is wrong.
type Outcome = Result<Seen, String>;

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
        type Check<'a, 'b> = &'b dyn Fn(&Test<'a>) -> Result<Outcome, Error>;
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
            let (word, text) = match check(self)? {
                Ok(Seen::Fine(seen)) => ("ok", seen),
                Ok(Seen::Note(seen)) => ("note", seen),
                Err(wrong) => ("WRONG", wrong),
            };
            let line = format!("  {word:<7} {name}: {}", visible(text));
            print(&wrap(&line, WIDTH, INDENT))?;
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

    fn ask(&self, records: &[Record]) -> Result<Result<Answered, String>, Error> {
        let samples = records.first().map_or(0, |record| record.y.len());
        ask_once(self.program, &self.cell.problem(samples), records).map_err(failed)
    }

    fn models(&self) -> Result<Outcome, Error> {
        Ok(self.ask(&self.records(RECORDS))?.and_then(|answered| {
            let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
            for pass in &answered.passes {
                *counts.entry(word(pass)).or_default() += 1;
            }
            let found = counts.iter().map(|(name, count)| format!("{count} {name}"));
            let found = found.collect::<Vec<_>>().join(", ");
            let text = format!("of {RECORDS} records {found}");
            match (counts.contains_key(MODEL), counts.len()) {
                (false, _) => Err(format!("{text}; expected a model for at least one")),
                (true, 1) => Ok(Seen::Fine(text)),
                (true, _) => Ok(Seen::Note(text)),
            }
        }))
    }

    fn twice(&self, deterministic: bool) -> Result<Outcome, Error> {
        let records = self.records(RECORDS);
        let first = match self.ask(&records)? {
            Ok(first) => first,
            Err(wrong) => return Ok(Err(wrong)),
        };
        Ok(self
            .ask(&records)?
            .and_then(|second| match (first.same_bits(&second), deterministic) {
                (true, _) => Ok(Seen::Fine("the same bits".to_owned())),
                (false, false) => Ok(Seen::Fine("different bits, as it declares".to_owned())),
                (false, true) => Err("different bits, although it says that it is deterministic".to_owned()),
            }))
    }

    fn sizes(&self, deterministic: bool) -> Result<Outcome, Error> {
        if !deterministic {
            let text = "not compared, since it is not deterministic";
            return Ok(Ok(Seen::Note(text.to_owned())));
        }
        let records = self.records(RECORDS);
        let whole = match self.ask(&records)? {
            Ok(whole) => whole,
            Err(wrong) => return Ok(Err(wrong)),
        };
        let mut largest = 0.0_f64;
        for size in [1, 5] {
            for (part, expected) in records.chunks(size).zip(whole.passes.chunks(size)) {
                let found = match self.ask(part)? {
                    Ok(found) => found,
                    Err(wrong) => return Ok(Err(wrong)),
                };
                for ((found, expected), record) in found.passes.iter().zip(expected).zip(part) {
                    let trial = record.trial;
                    let Some(apart) = apart(found, expected) else {
                        return Ok(Err(format!(
                            "trial {trial} in a batch of {size}: {}; in one of {RECORDS}: {}; expected the same \
                             status and orders",
                            word(found),
                            word(expected)
                        )));
                    };
                    if !(apart <= ALIKE) {
                        return Ok(Err(format!(
                            "trial {trial} in a batch of {size} is {apart:.1e} from the same in one of {RECORDS}; \
                             expected at most {ALIKE:e}"
                        )));
                    }
                    largest = largest.max(apart);
                }
            }
        }
        Ok(Ok(Seen::Fine(format!(
            "1 and 5 instead of {RECORDS}: within {largest:.1e}"
        ))))
    }

    fn noise_free(&self) -> Result<Outcome, Error> {
        let plant_order = self.cell.plant_order();
        let asked = self.program.options.orders;
        if asked.map_or(self.cell.order, crate::model::Orders::order) < plant_order {
            let text = "not asked, since the plant has a larger order";
            return Ok(Ok(Seen::Note(text.to_owned())));
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
            process: process.map_err(failed)?,
            eta: 0.0,
            ..self.cell.clone()
        };
        let mut first = String::new();
        for trial in 0..RECORDS {
            let (record, truth) = noise_free.record_for_program(self.seed, trial);
            let answered = match self.ask(&[record])? {
                Ok(answered) => answered,
                Err(wrong) => return Ok(Err(wrong)),
            };
            let pass = &answered.passes[0];
            if pass.progress >= Progress::Parameters {
                let plant = LinearModel::from_canonical(&truth.a, &truth.h, 1);
                return Ok(recovered(&plant, &pass.model, trial));
            }
            if trial == 0 {
                word(pass).clone_into(&mut first);
            }
        }
        let text = format!("trial 0 {first}, no model of trials 0 to {}", RECORDS - 1);
        Ok(Ok(Seen::Note(text)))
    }

    fn odd(&self) -> Result<Outcome, Error> {
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
        let (mut seen, mut fine) = (Vec::new(), true);
        for (name, record) in [
            ("NaN", of(f64::NAN, f64::NAN)),
            ("constant", of(1.0, 1.0)),
            ("zero", of(0.0, 0.0)),
            ("short", shortened),
            ("as before", plain.clone()),
        ] {
            let asked = self.ask(&[record])?;
            fine &= asked.is_ok();
            let what = asked.map_or_else(|wrong| wrong, |answered| word(&answered.passes[0]).to_owned());
            seen.push(format!("{name}: {what}"));
        }
        let seen = seen.join(", ");
        Ok(if fine { Ok(Seen::Fine(seen)) } else { Err(seen) })
    }

    /// Returns the median time of a message with so many records, seconds.
    fn seconds(&self, count: u64) -> Result<Result<f64, String>, Error> {
        let (records, begin) = (self.records(count), Instant::now());
        let mut seconds = Vec::new();
        while seconds.len() < REPETITIONS && (seconds.is_empty() || begin.elapsed() < TIMING) {
            match self.ask(&records)? {
                Ok(answered) => seconds.push(answered.elapsed.as_secs_f64()),
                Err(wrong) => return Ok(Err(wrong)),
            }
        }
        seconds.sort_by(f64::total_cmp);
        Ok(Ok(seconds[seconds.len() / 2]))
    }

    fn time(&self) -> Result<Outcome, Error> {
        let batch = self.program.options.batch;
        let single = match self.seconds(1)? {
            Ok(single) => single,
            Err(wrong) => return Ok(Err(wrong)),
        };
        Ok(self.seconds(batch)?.and_then(|seconds| {
            let text = format!(
                "{:.3} ms for a record alone, {:.3} ms for each of {batch}",
                1e3 * single,
                1e3 * seconds / batch as f64
            );
            let timeout = self.program.options.timeout;
            if seconds > timeout / 2.0 {
                return Err(format!(
                    "{text}: {seconds:.1} s for a batch, near the timeout of {timeout} s; expected a smaller 'batch'"
                ));
            }
            Ok(Seen::Fine(text))
        }))
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
        return Err(format!("{text}; expected at most {RECOVERED:e}"));
    }
    Ok(match trial {
        0 => Seen::Fine(text),
        later => Seen::Note(format!("{text}, for trial {later}: no model for the trials before it")),
    })
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
