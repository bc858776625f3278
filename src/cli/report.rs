//! `asobench report`: pages, figures, tables and verdicts from stored results; nothing is run.

#![allow(clippy::format_push_string, reason = "a few lines")]

use super::error::{Error, failed};
use super::{print, progress};
use crate::report::{Study, claims, report, write_report};
use std::path::PathBuf;
use std::process::ExitCode;

/// Make a report of results: report.html, figures, tables, and the verdict on every claim.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Results folders, such as results/window
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Folder of the report [default: DIR if there is one, else report]
    #[arg(long, value_name = "OUT")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let mut studies: Vec<Study> = Vec::new();
    let mut steps = progress::Steps::new();
    for folder in &arguments.folders {
        steps.show(&format!("reading {}", folder.display()));
        let mut study = Study::read(folder).map_err(|error| Error::Input(error.to_string()))?;
        let name = study.name.clone();
        let taken = |name: &str| studies.iter().any(|other| other.name == name);
        let mut number = 2;
        while taken(&study.name) {
            study.name = format!("{name}-{number}");
            number += 1;
        }
        studies.push(study);
    }
    let out = match (&arguments.out, arguments.folders.as_slice()) {
        (Some(out), _) => out.clone(),
        (None, [folder]) => folder.clone(),
        (None, _) => PathBuf::from("report"),
    };
    steps.show("verdicts");
    let claims = claims(&studies);
    let files = report(&studies, &claims, &mut |step| steps.show(step));
    steps.show("writing");
    write_report(&out, &files).map_err(failed)?;
    drop(steps);
    let mut text = String::new();
    for claim in claims.iter().filter(|claim| claim.is_judged()) {
        text.push_str(&format!(
            "{:<4} {:<13} {}\n",
            claim.id,
            claim.verdict.name(),
            claim.experiment
        ));
    }
    let page = out.join("report.html");
    text.push_str(&format!(
        "{} files; the page is {}\n",
        files.len(),
        page.display()
    ));
    print(&text)?;
    Ok(ExitCode::SUCCESS)
}
