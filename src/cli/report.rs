//! `asobench report`: makes pages, figures, tables and verdicts from stored results; runs nothing.

use super::error::{Error, bad_file, bad_input, failed};
use super::execute::{refused, threads};
use super::files::cannot_write;
use super::output::{print, print_with_verdicts, wrapped};
use super::progress;
use crate::files;
use crate::report::{ResultsError, Study, prepare_report, report, terminal, write_report};
use crate::study::file::ExperimentFile;
use crate::study::{FolderError, partial_results};
use crate::text::{alike, folded, visible};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Make a report of results: report.html, figures, tables, and the verdict on every claim of their
/// files.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Results folders, such as results/window
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Folder of the report [default: DIR if there is one, else report]
    #[arg(long, alias = "output", short_alias = 'o', value_name = "OUT")]
    out: Option<PathBuf>,
    /// Report also a run that has not ended, marked as partial; its claims are not judged
    #[arg(long)]
    partial: bool,
    /// Judge the claims of this experiment file instead of those stored with the results
    #[arg(long, value_name = "FILE")]
    claims: Option<PathBuf>,
    /// Show the page in the browser
    #[arg(long)]
    open: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let others = arguments.claims.as_deref().map(ExperimentFile::read);
    let others = others.transpose().map_err(bad_input)?;
    let mut studies: Vec<Study> = Vec::new();
    let mut steps = progress::Steps::new();
    for folder in &arguments.folders {
        steps.show(&format!("reading {}", folder.display()));
        let mut study = read(folder, arguments.partial)?;
        study.check_trials().map_err(bad_input)?;
        if let Some(file) = &others {
            study.judge_others(file).map_err(bad_file(folder))?;
        }
        let name = study.name.clone();
        // File names must differ even where case is ignored.
        let taken = |name: &str| studies.iter().any(|other| folded(&other.name) == folded(name));
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
    if files::is_there(&out) {
        prepare_report(&out).map_err(|e| cannot_write(&e))?;
    }
    let files = report(&studies, &mut |step| steps.show(step));
    if let Some([_, twice]) = alike(files.iter().map(|(name, _)| name.as_str())) {
        return Err(Error::Input(format!(
            "two of these reports would write {twice}; expected folders with different names"
        )));
    }
    steps.show("writing");
    prepare_report(&out).map_err(|e| cannot_write(&e))?;
    write_report(&out, &files).map_err(|error| {
        if error.foreign {
            cannot_write(&error)
        } else {
            failed(error)
        }
    })?;
    drop(steps);
    let verdicts: String = studies.iter().map(terminal::verdicts).collect();
    print_with_verdicts("", &verdicts)?;
    let parts = studies.iter().filter_map(Study::partial_line);
    let parts: String = parts.map(|line| wrapped(&line, "")).collect();
    print(&parts)?;
    if parts.is_empty() && verdicts.is_empty() {
        print("no claims: --claims FILE.toml judges those of a file\n")?;
    }
    let page = out.join("report.html");
    let (count, shown) = (files.len(), visible(page.display()));
    print(&format!("{count} files; the page is {shown}\n"))?;
    if arguments.open {
        open(&page)?;
    }
    Ok(())
}

/// Reads the results in a folder; with `partial` those of a run that has not ended, too.
fn read(folder: &Path, partial: bool) -> Result<Study, Error> {
    let error = match Study::read(folder) {
        Err(error @ ResultsError::Folder(FolderError::Unfinished { .. })) if partial => error,
        read => return read.map_err(bad_input),
    };
    let part = partial_results(folder, threads(None), &*progress::stop_flag()?);
    let (file, summary) = part.map_err(|e| refused("", e))?.ok_or_else(|| bad_input(&error))?;
    Study::of_part(folder, file, &summary).map_err(bad_input)
}

/// Opens a page with the system's program for it.
fn open(page: &Path) -> Result<(), Error> {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(windows) {
        "explorer"
    } else {
        "xdg-open"
    };
    let told = |why: &dyn std::fmt::Display| failed(format!("--open: {program}: {why}"));
    let mut command = Command::new(program);
    let quiet = command.arg(page).stdout(Stdio::null()).stderr(Stdio::null());
    let status = quiet.status().map_err(|error| told(&error))?;
    if status.success() { Ok(()) } else { Err(told(&status)) }
}
