//! `asobench suite run`: every method on every scenario of a tier, each study an ordinary one in a folder of its own.

use super::page;
use super::part::{How, Part, competitors, write};
use crate::cli::cluster::word;
use crate::cli::error::{Error, failed};
use crate::cli::execute::{execute, threads};
use crate::cli::files::cannot_write;
use crate::cli::output::note;
use crate::cli::programs;
use crate::files;
use crate::report::{Study, SuitePage, report, write_report};
use crate::study::{Experiment, RunOptions};
use crate::suite::{
    Competitor, METHODS, MethodResults, STUDIES, ScenarioResults, Stored, Suite, SuiteStudy, collect, declined,
};
use crate::text::file_part;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Run the suite: every method, or some, on every scenario of a tier. A run that was stopped resumes with the same
/// command
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    part: Part,
    /// Only this method; may be repeated
    #[arg(long, value_name = "NAME")]
    method: Vec<String>,
    #[command(flatten)]
    how: How,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { part, method, how } = arguments;
    let suite = part.suite()?;
    let competitors = competitors(suite.division, method)?;
    let out = how.out.clone().unwrap_or_else(|| PathBuf::from(part.folder()));
    let methods = compute(&suite, &competitors, (how, None), &out)?;
    let command = format!("asobench suite scores {} {}", word(&out), part.flags());
    page::conclude(SuitePage::new(&suite, &methods, &command), part, &out)
}

/// Computes the results of some methods in a folder, and writes them there, one file for each. `own`: the experiment
/// file of a user's method, in whose folder a program runs.
pub(super) fn compute(
    suite: &Suite,
    competitors: &[Competitor],
    (how, own): (&How, Option<&Path>),
    out: &Path,
) -> Result<Vec<MethodResults>, Error> {
    let mut methods: Vec<MethodResults> = competitors
        .iter()
        .map(|competitor| MethodResults {
            suite: suite.manifest.edition.clone(),
            division: suite.division,
            method: competitor.name(),
            seed: suite.manifest.seed,
            ..MethodResults::default()
        })
        .collect();
    files::make_folder(out).map_err(|error| cannot_write(&error))?;
    let studies = files::make_subfolder(out, STUDIES).map_err(|error| cannot_write(&error))?;
    for study in &suite.studies {
        let begin = Instant::now();
        let folder = studies.join(&study.name);
        let trials = suite.trials(study.entry.is_bank());
        let found = match study.experiment(competitors, trials)? {
            (Some(experiment), _) => in_folder(study, experiment, (how, own), &folder)?,
            (None, _) => Vec::new(),
        };
        for (method, competitor) in methods.iter_mut().zip(competitors) {
            if !study.is_for(competitor) {
                method.not_for.extend(study.scenarios.iter().map(|of| of.name.clone()));
                continue;
            }
            let own = found.iter().find(|(name, _)| *name == method.method);
            let own = own.map_or_else(|| declined(study, trials), |(_, results)| results.clone());
            method.scenarios.extend(own);
        }
        note(&format!("{}: {:.1} s", study.name, begin.elapsed().as_secs_f64()));
    }
    for method in methods.iter().filter(|method| !method.scenarios.is_empty()) {
        let name = format!("{}.json", file_part(&method.method));
        write(&out.join(METHODS), &name, &method.text())?;
    }
    let whole = methods.into_iter().map(|method| method.of(suite));
    let mut whole: Vec<MethodResults> = whole.collect::<Result<_, _>>().map_err(failed)?;
    whole.retain(MethodResults::has_runs);
    Ok(whole)
}

/// Runs an experiment in its folder, with its report, and collects its results.
fn in_folder(
    study: &SuiteStudy,
    experiment: Experiment,
    (how, own): (&How, Option<&Path>),
    folder: &Path,
) -> Result<Vec<(String, Vec<ScenarioResults>)>, Error> {
    how.overwrite.check(folder)?;
    let experiment = match own {
        Some(path) => programs::started(experiment, path, &how.consent)?,
        None => experiment,
    };
    let overwrite = how.overwrite.overwrite;
    if !overwrite {
        programs::same_versions(&experiment, folder)?;
    }
    let options = RunOptions {
        threads: threads(how.threads),
        overwrite,
        ..RunOptions::default()
    };
    let rule = experiment.file.trials.clone();
    let executed = execute(folder, &experiment, rule, options, |_| Vec::new());
    programs::conclude(&experiment, folder);
    executed?;
    let pages = [Study::read(folder).map_err(failed)?];
    write_report(folder, &report(&pages, &mut |_| ())).map_err(|error| cannot_write(&error))?;
    collect(study, &experiment, folder).map_err(failed)
}
