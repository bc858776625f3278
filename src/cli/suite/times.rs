//! `asobench suite times`: times of the methods, apart from their results.

use super::newcomer::method;
use super::part::{Part, TIMES, competitors, write};
use crate::cli::error::{Error, failed};
use crate::cli::output::{note, print};
use crate::cli::programs::{self, Consent};
use crate::lanes::Isa;
use crate::report::times_table;
use crate::study::Experiment;
use crate::suite::{Competitor, MethodTimes, REFERENCE, Stored, SuiteStudy, Times, time};
use std::path::PathBuf;

/// Time the methods: on one thread, in turns on the same records, as ratios to arx
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Experiment file whose one method is timed too
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    part: Part,
    /// Only this method; may be repeated
    #[arg(long, value_name = "NAME")]
    method: Vec<String>,
    /// Rounds, in each of which every method has its turn on one record
    #[arg(long, value_name = "R", default_value_t = 7, value_parser = clap::value_parser!(u64).range(3..=1000))]
    rounds: u64,
    /// Folder of a run of the suite, whose page then shows these times
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    consent: Consent,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { file, part, .. } = arguments;
    let suite = part.suite()?;
    let mut chosen = competitors(suite.division, &arguments.method)?;
    if let Some(path) = file {
        if arguments.method.is_empty() {
            chosen.clear();
        }
        chosen.push(Competitor::Own(Box::new(method(path)?)));
    }
    let all = Competitor::of(suite.division);
    let reference = all.into_iter().find(|of| of.name() == REFERENCE);
    // The reference is timed too, first.
    chosen.retain(|of| of.name() != REFERENCE);
    chosen.splice(0..0, reference);
    let mut methods: Vec<MethodTimes> = chosen
        .iter()
        .map(|of| MethodTimes {
            method: of.name(),
            scenarios: Vec::new(),
        })
        .collect();
    for study in &suite.studies {
        time_study(study, &chosen, arguments, &mut methods)?;
        note(&format!("{}: timed", study.name));
    }
    methods.retain(|of| !of.scenarios.is_empty());
    let times = Times {
        suite: suite.manifest.edition.clone(),
        program: format!("asobench {} ({})", env!("CARGO_PKG_VERSION"), Isa::best()),
        methods,
    };
    if let Some(out) = &arguments.out {
        write(out, TIMES, &times.text())?;
    }
    let (program, rounds) = (&times.program, arguments.rounds);
    let table = times_table(&times).text();
    print(&format!("{program}, {rounds} rounds on one thread\n{table}"))
}

/// Adds the times of the methods that are for a study and can serve it.
fn time_study(
    study: &SuiteStudy,
    chosen: &[Competitor],
    arguments: &Arguments,
    methods: &mut [MethodTimes],
) -> Result<(), Error> {
    let mut experiments: Vec<(&mut MethodTimes, Experiment)> = Vec::new();
    for (competitor, times) in chosen.iter().zip(methods) {
        let (made, _) = study.experiment(std::slice::from_ref(competitor), arguments.rounds)?;
        let Some(experiment) = made else { continue };
        let experiment = match (competitor, &arguments.file) {
            (Competitor::Own(_), Some(path)) => programs::started(experiment, path, &arguments.consent)?,
            _ => experiment,
        };
        experiments.push((times, experiment));
    }
    for (cell, scenario) in study.scenarios.iter().enumerate() {
        let at_work: Vec<&Experiment> = experiments.iter().map(|(_, experiment)| experiment).collect();
        let timed = time(scenario, (cell, arguments.rounds), &at_work).map_err(failed)?;
        experiments
            .iter_mut()
            .zip(timed)
            .for_each(|((of, _), times)| of.scenarios.push(times));
    }
    for program in experiments.iter().flat_map(|(_, of)| &of.programs) {
        program.end();
    }
    Ok(())
}
