//! `asobench suite times`: times of the methods, apart from their results.

use super::newcomer::method;
use super::part::{Part, TIMES, competitors, write, wrong};
use crate::cli::error::{Error, failed};
use crate::cli::output::{note, print};
use crate::cli::programs::{Consent, started};
use crate::lanes::Isa;
use crate::number::uncertain_within;
use crate::report::html::{CellText, Column, Table};
use crate::study::Experiment;
use crate::suite::{Competitor, MethodTimes, REFERENCE, ScenarioTimes, SuiteStudy, Times, time};
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
        for (name, found) in of_study(study, &chosen, arguments)? {
            if let Some(of) = methods.iter_mut().find(|of| of.method == name) {
                of.scenarios.extend(found.iter().cloned());
            }
        }
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
    print(&shown(&times, arguments.rounds))
}

type Found = Vec<(String, Vec<ScenarioTimes>)>;

/// The times of the methods that are for a study and can serve it.
fn of_study(study: &SuiteStudy, chosen: &[Competitor], arguments: &Arguments) -> Result<Found, Error> {
    let mut experiments: Vec<(String, Experiment)> = Vec::new();
    for competitor in chosen {
        let made = study.experiment(std::slice::from_ref(competitor), arguments.rounds);
        let Some(experiment) = made.map_err(|error| wrong(&error))?.0 else {
            continue;
        };
        let experiment = match (competitor, &arguments.file) {
            (Competitor::Own(_), Some(path)) => started(experiment, path, &arguments.consent)?,
            _ => experiment,
        };
        experiments.push((competitor.name(), experiment));
    }
    let methods: Vec<(String, &Experiment)> = experiments
        .iter()
        .map(|(name, experiment)| (name.clone(), experiment))
        .collect();
    let mut found: Found = methods.iter().map(|(name, _)| (name.clone(), Vec::new())).collect();
    for (cell, scenario) in study.scenarios.iter().enumerate() {
        let timed = time(scenario, (cell, arguments.rounds), &methods).map_err(failed)?;
        found.iter_mut().zip(timed).for_each(|((_, of), times)| of.push(times));
    }
    for program in experiments.iter().flat_map(|(_, of)| &of.programs) {
        program.end();
    }
    Ok(found)
}

fn shown(times: &Times, rounds: u64) -> String {
    let columns = vec![
        Column::text("method").width(15),
        Column::number("scenarios", "").width(9),
        Column::number("time, of arx", "").width(13),
        Column::number("least", "").width(9),
        Column::number("most", "").width(9),
        Column::number("longest run", "ms").width(16),
    ];
    let mut table = Table::new("", columns);
    for method in &times.methods {
        let (count, typical) = (method.scenarios.len(), method.typical());
        let number = |x: f64| CellText::number(uncertain_within(x, 0.0, 3), x);
        let [least, most] = method.extremes();
        let longest = 1e3 * method.longest().as_secs_f64();
        table.row([
            CellText::text(method.method.clone()),
            CellText::number(count.to_string(), count as f64),
            CellText::number(uncertain_within(typical.value, typical.error, 4), typical.value),
            number(least),
            number(most),
            number(longest),
        ]);
    }
    format!("{}, {rounds} rounds on one thread\n{}", times.program, table.text())
}
