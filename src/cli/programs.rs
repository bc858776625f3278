//! Methods that are programs: none is started before the user has agreed to it.

use super::error::{Error, failed};
use super::{note, progress};
use crate::estimator::ProgramError;
use crate::files::{self, Kind};
use crate::study::file::ExperimentFile;
use crate::study::{Experiment, stored_design};
use crate::text::visible;
use crate::worker::{self, Guard, Permit, Program};
use serde_json::{Value, json};
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_128;

/// What was agreed to, a line each.
const AGREED: &str = "agreed-commands";
/// How that file begins.
pub(crate) const AGREED_TITLE: &str = "# asobench: commands that were agreed to\n";
/// What workers printed, beside the results.
const LOG: &str = "workers.log";
/// Lines of it that are shown where something went wrong.
const LINES: usize = 10;

/// Whether programs may run.
#[derive(Clone, Copy, clap::Args)]
pub(super) struct Consent {
    /// Run the programs that are methods of the file without asking
    #[arg(long)]
    pub(super) allow_commands: bool,
}

impl Consent {
    /// The flag as it was given, behind a blank.
    pub(super) fn flag(self) -> &'static str {
        if self.allow_commands {
            " --allow-commands"
        } else {
            ""
        }
    }
}

/// A study whose programs may run, each of which has said what it is: so that its version is part of the design.
pub(super) fn introduced(
    mut file: ExperimentFile,
    path: &Path,
    consent: Consent,
) -> Result<(ExperimentFile, Option<Experiment>), Error> {
    if file.methods.iter().all(|method| method.program().is_none()) {
        return Ok((file, None));
    }
    let experiment = Experiment::new(file.clone());
    let experiment =
        experiment.map_err(|error| Error::Input(format!("{}: {error}", path.display())))?;
    let folder = folder_of(path)?;
    if !consent.allow_commands {
        ask(&experiment, path, &folder)?;
    }
    permit(&experiment, &folder)?;
    for (program, identity) in identities(&experiment)? {
        for table in &mut file.methods {
            if table.program() == Some(&program.options) {
                table.set_worker(identity.clone());
            }
        }
    }
    Ok((file, Some(experiment)))
}

/// What each program says that it is.
fn identities(experiment: &Experiment) -> Result<Vec<(&Arc<Program>, String)>, Error> {
    let cell = &experiment.cells[0];
    let problem = cell.problem(cell.window);
    let programs = experiment.programs.iter();
    let introduced = programs.map(|program| {
        let ready = worker::introduce(program, &problem);
        let ready = ready.inspect_err(|_| printed(program, 0).iter().for_each(|line| note(line)));
        Ok((program, ready.map_err(refused)?.identity()))
    });
    introduced.collect()
}

/// The last lines that a program printed since there were so many bytes, such as what a crash says.
pub(super) fn printed(program: &Program, since: u64) -> Vec<String> {
    let lines = program.log.last_lines(since, LINES).into_iter();
    lines.map(|line| format!("| {}", visible(line))).collect()
}

/// Refuses results in a folder that another version of a program made.
pub(super) fn same_versions(experiment: &Experiment, folder: &Path) -> Result<(), Error> {
    let stored = stored_design(folder).unwrap_or_default();
    let now = experiment.design();
    let worker =
        |design: &Value, i: usize| Some(design["methods"][i]["worker"].as_str()?.to_owned());
    for (i, table) in experiment.file.methods.iter().enumerate() {
        if let (Some(before), Some(now)) = (worker(&stored, i), worker(&now, i))
            && before != now
        {
            return Err(Error::Input(format!(
                "{}: method '{}' says that it is '{}', the results are of '{}'; choose another folder",
                folder.display(),
                visible(table.output_name(0)),
                visible(now),
                visible(before)
            )));
        }
    }
    Ok(())
}

/// The first method whose program says that it is not deterministic.
pub(super) fn not_deterministic(experiment: &Experiment) -> Result<Option<String>, Error> {
    let cell = &experiment.cells[0];
    let problem = cell.problem(cell.window);
    for program in &experiment.programs {
        if !worker::introduce(program, &problem)
            .map_err(refused)?
            .deterministic
        {
            return Ok(Some(program.name.clone()));
        }
    }
    Ok(None)
}

/// A program that is not what the file says is bad input; so is one that does not start.
fn refused(error: ProgramError) -> Error {
    match error {
        ProgramError::Stopped => Error::Interrupted("interrupted".to_owned()),
        other => Error::Input(other.to_string()),
    }
}

/// Lets the programs of a study run in a folder.
pub(super) fn permit(experiment: &Experiment, folder: &Path) -> Result<(), Error> {
    if experiment.programs.is_empty() {
        return Ok(());
    }
    let own = std::env::current_exe().and_then(|program| Guard::start(&program));
    let guard = Arc::new(own.map_err(failed)?);
    for program in &experiment.programs {
        program.permit(Permit {
            folder: folder.to_owned(),
            stop: progress::stop_flag()?,
            guard: Some(Arc::clone(&guard)),
        });
    }
    Ok(())
}

/// Lets the programs of a stored study run in the current folder, where the user allows it: what is stored does not say
/// where its file was.
pub(super) fn permit_here(
    experiment: &Experiment,
    stored: &Path,
    consent: Consent,
) -> Result<(), Error> {
    match experiment.programs.first() {
        None => Ok(()),
        Some(_) if consent.allow_commands => permit(experiment, &folder_of(Path::new("-"))?),
        Some(program) => Err(Error::Input(format!(
            "{}: method '{}' is the program {}; expected --allow-commands, which runs it in this folder",
            stored.display(),
            visible(&program.name),
            visible(program.options.typed())
        ))),
    }
}

/// Has the study go on with the processes of the same one, whose programs were introduced.
pub(super) fn take_over(experiment: &Experiment, introduced: Option<&Experiment>) {
    let before = introduced
        .iter()
        .flat_map(|experiment| &experiment.programs);
    for (program, before) in experiment.programs.iter().zip(before) {
        program.take_over(before);
    }
}

/// Ends the programs and writes what they printed beside the results.
pub(super) fn conclude(experiment: &Experiment, folder: &Path) {
    let mut text = Vec::new();
    for program in &experiment.programs {
        program.end();
        text.extend(program.log.text().unwrap_or_default());
    }
    if text.is_empty() || !files::is_there(folder) {
        return;
    }
    let path = folder.join(LOG);
    match files::replace(&path, Kind::Log, &text) {
        Ok(()) => note(&format!("what programs printed: {}", path.display())),
        Err(error) => note(&format!("warning: what programs printed is lost: {error}")),
    }
}

/// The folder of an experiment file, in which its programs run; the current one for standard input.
pub(super) fn folder_of(path: &Path) -> Result<PathBuf, Error> {
    let folder = match path.parent() {
        Some(parent) if path != Path::new("-") && parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let absolute = folder.canonicalize();
    absolute.map_err(|error| Error::Input(format!("{}: {error}", folder.display())))
}

/// Asks on a terminal, once for each content of a file in a folder.
fn ask(experiment: &Experiment, path: &Path, folder: &Path) -> Result<(), Error> {
    // As it stands there, whatever flags change of it; the commands are those that will run.
    let file = if path == Path::new("-") {
        experiment.file.clone()
    } else {
        ExperimentFile::read(path).map_err(|error| Error::Input(error.to_string()))?
    };
    let content = serde_json::to_string(&file).map_err(failed)?;
    let commands: Vec<&[String]> = experiment
        .programs
        .iter()
        .map(|program| &program.options.command[..])
        .collect();
    let agreed = json!({
        "folder": folder,
        "commands": commands,
        "content": format!("{:032x}", xxh3_128(content.as_bytes())),
    });
    let place = agreed_file();
    let known = place
        .as_deref()
        .map(lines_of)
        .transpose()?
        .unwrap_or_default();
    if known.contains(&agreed) {
        return Ok(());
    }
    let shown = experiment.programs.iter().map(|program| {
        let command = program.options.typed();
        format!("  {}: {}\n", visible(&program.name), visible(command))
    });
    let shown: String = shown.collect();
    if !(io::stdin().is_terminal() && io::stderr().is_terminal()) {
        return Err(Error::Input(format!(
            "{}: this study starts a program ({}); add --allow-commands if that is what you want",
            path.display(),
            shown.trim().replace("\n  ", "; ")
        )));
    }
    let question = format!(
        "{} starts these programs, in the folder {}:\n{shown}Is that what you want? [y/N] ",
        visible(path.display()),
        visible(folder.display())
    );
    write!(io::stderr(), "{question}").map_err(failed)?;
    let mut line = String::new();
    io::stdin().read_line(&mut line).map_err(failed)?;
    if !matches!(line.trim(), "y" | "Y" | "yes") {
        let message = "no program was started, since you did not agree";
        return Err(Error::Input(format!("{}: {message}", path.display())));
    }
    match place {
        Some(place) => remember(&place, known, agreed),
        None => Ok(()),
    }
}

/// Where it is kept what was agreed to: below $XDG_STATE_HOME, or ~/.local/state.
fn agreed_file() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let state = variable("XDG_STATE_HOME").map(PathBuf::from);
    let state = state.filter(|path| path.is_absolute());
    let home = || Some(PathBuf::from(variable("HOME")?).join(".local/state"));
    Some(state.or_else(home)?.join("asobench").join(AGREED))
}

fn lines_of(path: &Path) -> Result<Vec<Value>, Error> {
    let text = files::read_own(path, Kind::Agreed).map_err(failed)?;
    let text = String::from_utf8_lossy(&text.unwrap_or_default()).into_owned();
    let lines = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    Ok(lines.collect())
}

fn remember(path: &Path, mut known: Vec<Value>, agreed: Value) -> Result<(), Error> {
    known.push(agreed);
    let lines = known.iter().map(|line| format!("{line}\n"));
    let text = AGREED_TITLE.to_owned() + &lines.collect::<String>();
    files::make_folder(path.parent().unwrap_or(Path::new("."))).map_err(failed)?;
    files::replace(path, Kind::Agreed, text.as_bytes()).map_err(failed)
}
