//! Methods that are programs: none is started before the user has agreed.

use super::error::{Error, bad_file, bad_input, failed};
use super::output::{asked, note};
use super::progress;
use crate::estimator::{Problem, ProgramError};
use crate::files::{self, Kind};
use crate::study::file::ExperimentFile;
use crate::study::{Experiment, stored_design};
use crate::text::{judged_word, shell_word, visible};
use crate::worker::{self, Guard, Permit, Program};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_128;

/// The file with the agreed commands, one per line.
const AGREED: &str = "agreed-commands";
/// The file beside the results with what workers printed.
const LOG: &str = "workers.log";
/// How much of the commands is shown before they are agreed to: characters, those of a path, programs, and the least
/// of an argument. All of it fits a terminal of 24 lines of 80 columns.
const COMMANDS_SHOWN: usize = 640;
const PATH_SHOWN: usize = 80;
const PROGRAMS_SHOWN: usize = 8;
const SHORTEST: usize = 16;
/// How many of its lines are shown after a failure.
const LINES: usize = 10;

/// Which programs may run without a question.
#[derive(Clone, clap::Args)]
pub(super) struct Consent {
    /// Run the programs that are methods of the file without asking
    #[arg(long)]
    allow_commands: bool,
    /// Run this program without asking: its whole 'command' as a JSON list; may be repeated
    #[arg(long, value_name = "COMMAND", value_parser = command)]
    allow_command: Vec<Command>,
}

/// The text of a command: the program and all its arguments.
#[derive(Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct Command(Vec<String>);

fn command(text: &str) -> Result<Command, &'static str> {
    let expected = r#"expected a JSON list of texts, such as '["python3", "mine.py"]'"#;
    serde_json::from_str(text).map_err(|_| expected)
}

impl Consent {
    /// Returns the flags as given, each with a leading blank.
    pub(super) fn flags(&self) -> String {
        let all = self.allow_commands.then(|| " --allow-commands".to_owned());
        let each = self.allow_command.iter().map(|command| {
            let command = json!(command).to_string();
            format!(" --allow-command {}", shell_word(command))
        });
        all.into_iter().chain(each).collect()
    }

    /// Returns the programs of a study that the flags do not name.
    fn others<'a>(&self, experiment: &'a Experiment) -> Vec<&'a Program> {
        let named = |program: &Program| {
            let mut agreed = self.allow_command.iter();
            self.allow_commands || agreed.any(|command| command.0 == program.options.command)
        };
        let programs = experiment.programs.iter().map(Arc::as_ref);
        programs.filter(|program| !named(program)).collect()
    }
}

/// Starts the study's programs after the user agreed, and records what each says that it is. So its version is part of
/// the design.
pub(super) fn introduced(
    mut file: ExperimentFile,
    path: &Path,
    consent: &Consent,
) -> Result<(ExperimentFile, Option<Experiment>), Error> {
    if file.methods.iter().all(|method| method.program().is_none()) {
        return Ok((file, None));
    }
    let experiment = Experiment::new(file.clone());
    let experiment = experiment.map_err(bad_file(path))?;
    let folder = folder_of(path)?;
    match &consent.others(&experiment)[..] {
        [] => {}
        others => ask(others, path, &folder)?,
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

/// The experiment of a user's file, its programs started and told apart by their version.
pub(super) fn started(experiment: Experiment, path: &Path, consent: &Consent) -> Result<Experiment, Error> {
    let (file, introduced) = introduced(experiment.file, path, consent)?;
    let experiment = Experiment::new(file).map_err(failed)?;
    take_over(&experiment, introduced.as_ref());
    Ok(experiment)
}

/// Returns the problem of the first cell; `None` in continuous time, where no method is a program.
fn problem(experiment: &Experiment) -> Option<Problem<'_>> {
    let cell = experiment.cells[0].discrete()?;
    Some(cell.problem(cell.window))
}

/// Returns what each program says that it is.
fn identities(experiment: &Experiment) -> Result<Vec<(&Arc<Program>, String)>, Error> {
    let Some(problem) = problem(experiment) else {
        return Ok(Vec::new());
    };
    let programs = experiment.programs.iter();
    let introduced = programs.map(|program| {
        let ready = worker::introduce(program, &problem);
        let ready = ready.inspect_err(|_| printed(program, 0).iter().for_each(|line| note(line)));
        Ok((program, ready.map_err(refused)?.identity()))
    });
    introduced.collect()
}

/// Returns the last lines that a program printed after the first `since` bytes, such as the message of a crash.
pub(super) fn printed(program: &Program, since: u64) -> Vec<String> {
    let lines = program.log.last_lines(since, LINES).into_iter();
    lines.map(|line| format!("| {}", visible(line))).collect()
}

/// Refuses results in a folder that were made by another version of a program.
pub(super) fn same_versions(experiment: &Experiment, folder: &Path) -> Result<(), Error> {
    let stored = stored_design(folder).unwrap_or_default();
    let now = experiment.design();
    let worker = |design: &Value, i: usize| Some(design["methods"][i]["worker"].as_str()?.to_owned());
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

/// Returns the first method whose program says that it is not deterministic.
pub(super) fn not_deterministic(experiment: &Experiment) -> Result<Option<String>, Error> {
    let Some(problem) = problem(experiment) else {
        return Ok(None);
    };
    for program in &experiment.programs {
        if !worker::introduce(program, &problem).map_err(refused)?.deterministic {
            return Ok(Some(program.name.clone()));
        }
    }
    Ok(None)
}

/// Returns an input error for a program that does not start or is not what the file says.
fn refused(error: ProgramError) -> Error {
    match error {
        ProgramError::Stopped => Error::Interrupted("interrupted".to_owned()),
        other => bad_input(other),
    }
}

/// Permits the programs of a study to run in a folder.
pub(super) fn permit(experiment: &Experiment, folder: &Path) -> Result<(), Error> {
    if experiment.programs.is_empty() {
        return Ok(());
    }
    files::remove_left_pipes();
    let own = std::env::current_exe().and_then(|program| Guard::start(&program));
    let guard = Arc::new(own.map_err(failed)?);
    for program in &experiment.programs {
        program.permit(Permit {
            folder: folder.to_owned(),
            stop: progress::stop_flag()?,
            guard: Some(Arc::clone(&guard)),
            warn: progress::warn,
        });
    }
    Ok(())
}

/// Permits the programs of a stored study to run in the current folder, if the user allows it. The stored study does
/// not record where its file was.
pub(super) fn permit_here(experiment: &Experiment, stored: &Path, consent: &Consent) -> Result<(), Error> {
    match consent.others(experiment).first() {
        None if experiment.programs.is_empty() => Ok(()),
        None => permit(experiment, &folder_of(Path::new("-"))?),
        Some(program) => Err(Error::Input(format!(
            "{}: this study starts a program: {}; expected --allow-commands, which runs it in this folder",
            judged_path(stored),
            command_shown(program, COMMANDS_SHOWN)
        ))),
    }
}

/// Hands the processes of a study's introduced programs over to the same study.
pub(super) fn take_over(experiment: &Experiment, introduced: Option<&Experiment>) {
    let before = introduced.iter().flat_map(|experiment| &experiment.programs);
    for (program, before) in experiment.programs.iter().zip(before) {
        program.take_over(before);
    }
}

/// Ends the programs, and writes what they printed to a file beside the results.
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
        Ok(()) => note(&format!("output of the programs: {}", path.display())),
        Err(error) => note(&format!("warning: the output of the programs is lost: {error}")),
    }
}

/// Returns the folder of an experiment file, in which its programs run. It is the current folder for standard input,
/// and for the manifest of results, which does not say where its file was.
pub(super) fn folder_of(path: &Path) -> Result<PathBuf, Error> {
    let folder = match path.parent() {
        Some(parent)
            if path != Path::new("-") && parent != Path::new("") && !path.ends_with(crate::study::MANIFEST) =>
        {
            parent.to_owned()
        }
        _ => PathBuf::from("."),
    };
    let absolute = folder.canonicalize();
    absolute.map_err(bad_file(&folder))
}

/// Asks on a terminal, once for each content of a file in a folder.
fn ask(programs: &[&Program], path: &Path, folder: &Path) -> Result<(), Error> {
    let agreed = agreement(programs, path, folder)?;
    let place = agreed_file();
    let known = place.as_deref().map(lines_of).transpose()?.unwrap_or_default();
    if agreed.as_ref().is_some_and(|line| known.contains(line)) {
        return Ok(());
    }
    let shown = commands_shown(programs);
    let file = judged_path(path);
    let question = format!(
        "{file} starts these programs, in the folder {}:\n  {}\nIs that what you want?",
        judged_path(folder),
        shown.join("\n  ")
    );
    let refused = match asked(&question)? {
        Some(true) => None,
        Some(false) => Some("no program was started, since you did not agree".to_owned()),
        None => Some(format!(
            "this study starts a program: {}; add --allow-commands if that is what you want",
            shown.join("; ")
        )),
    };
    if let Some(why) = refused {
        return Err(Error::Input(format!("{file}: {why}")));
    }
    match (place, agreed) {
        (Some(place), Some(agreed)) => remember(&place, known, agreed),
        _ => Ok(()),
    }
}

/// Returns the line of the file with the agreed commands. Commands of standard input are asked for each time.
fn agreement(programs: &[&Program], path: &Path, folder: &Path) -> Result<Option<Value>, Error> {
    if path == Path::new("-") {
        return Ok(None);
    }
    // The content is that of the file, without changes by flags; the commands are those that will run.
    let file = ExperimentFile::read(path).map_err(bad_input)?;
    let content = serde_json::to_string(&file).map_err(failed)?;
    let commands = programs.iter().map(|program| &program.options.command);
    // A path need not be UTF-8: then its bytes.
    let bytes = || json!(folder.as_os_str().as_encoded_bytes());
    Ok(Some(json!({
        "folder": folder.to_str().map_or_else(bytes, |text| json!(text)),
        "commands": commands.collect::<Vec<_>>(),
        "content": format!("{:032x}", xxh3_128(content.as_bytes())),
    })))
}

/// Returns a path for people who judge it: of a long one the end, where its name is.
fn judged_path(path: &Path) -> String {
    let text = path.display().to_string();
    let left_out = text.chars().count().saturating_sub(PATH_SHOWN);
    let end = text.char_indices().nth(left_out).map_or(0, |(at, _)| at);
    let shown = judged_word(&text[end..], 2 * PATH_SHOWN);
    if left_out == 0 {
        return shown;
    }
    format!("{left_out} characters ...{shown}")
}

/// Returns what a study starts, a line for each program: the program first, then the method, then every argument, with
/// nothing that could hide a part of it or scroll it away.
fn commands_shown(programs: &[&Program]) -> Vec<String> {
    let shown = programs.len().clamp(1, PROGRAMS_SHOWN);
    let mut lines: Vec<String> = programs[..shown.min(programs.len())]
        .iter()
        .map(|program| command_shown(program, COMMANDS_SHOWN / shown))
        .collect();
    if let more @ 1.. = programs.len() - lines.len() {
        lines.push(format!("... and {more} more programs, which the file names"));
    }
    lines
}

/// Returns a program, its method and its arguments, of about `most` characters.
fn command_shown(program: &Program, most: usize) -> String {
    let command = &program.options.command;
    let mut text = format!(
        "{} (method {})",
        judged_word(&command[0], most / 2),
        judged_word(&program.name, most / 8)
    );
    for (i, argument) in command.iter().enumerate().skip(1) {
        let left = most.saturating_sub(text.chars().count());
        if left < SHORTEST && judged_word(argument, SHORTEST).chars().count() > left {
            let rest = command[i..].iter().map(|argument| argument.chars().count());
            let (arguments, characters) = (command.len() - i, rest.sum::<usize>());
            return format!("{text} ... {arguments} more arguments, {characters} characters");
        }
        text += " ";
        text += &judged_word(argument, left.max(SHORTEST));
    }
    text
}

/// Returns the path of the file with the agreed commands, below $XDG_STATE_HOME or ~/.local/state.
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
    let lines = text.lines().filter_map(|line| serde_json::from_str(line).ok());
    Ok(lines.collect())
}

fn remember(path: &Path, mut known: Vec<Value>, agreed: Value) -> Result<(), Error> {
    known.push(agreed);
    let lines = known.iter().map(|line| format!("{line}\n"));
    let text = crate::files::AGREED_TITLE.to_owned() + &lines.collect::<String>();
    files::make_folder(path.parent().unwrap_or(Path::new("."))).map_err(failed)?;
    files::replace(path, Kind::Agreed, text.as_bytes()).map_err(failed)
}
