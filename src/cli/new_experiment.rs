//! `asobench new`: writes a commented experiment file.

use super::error::Error;
use super::output::{Lines, note};
use crate::files;
use crate::study::file::{Key, Scalar, StudyKind};
use crate::text::shell_word;
use std::io::ErrorKind;
use std::path::PathBuf;

/// Write a commented experiment file to begin with: NAME.toml
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The study's name, or the file's path
    name: PathBuf,
    /// A study of observers in continuous time
    #[arg(long)]
    continuous: bool,
}

/// The file without its list of other settings.
const DISCRETE: &str = include_str!("new_experiment/discrete.toml");
/// The same of a study in continuous time.
const CONTINUOUS: &str = include_str!("new_experiment/continuous.toml");

fn content(kind: StudyKind) -> String {
    let text = match kind {
        StudyKind::Continuous => CONTINUOUS,
        StudyKind::Discrete => DISCRETE,
    };
    let (_, settings) = text.split_once("\n[settings]\n").unwrap_or_default();
    let (settings, _) = settings.split_once("\n\n").unwrap_or_default();
    let mut all = Lines(text.to_owned());
    let given = |key: &Key| settings.lines().any(|line| line.starts_with(&format!("{key} = ")));
    for key in Key::ALL.iter().filter(|key| key.is_of(kind) && !given(key)) {
        let value = match key.default_of(kind) {
            None => {
                // The two keys exclude each other.
                all.line(format_args!("# Instead of window: {key} = 20 ({})", key.about()));
                continue;
            }
            Some(Scalar::Number(number)) => number.to_string(),
            Some(Scalar::Text(text)) => format!("\"{text}\""),
        };
        all.line(format_args!("# {:<32} # {}", format!("{key} = {value}"), key.about()));
    }
    all.0
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let mut path = arguments.name.clone();
    if path.extension().is_none() {
        path.set_extension("toml");
    }
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty())
        && !folder.is_dir()
    {
        return Err(Error::Input(format!(
            "{}: there is no folder {}; expected one that exists",
            path.display(),
            folder.display()
        )));
    }
    let kind = if arguments.continuous {
        StudyKind::Continuous
    } else {
        StudyKind::Discrete
    };
    let written = files::create(&path, content(kind).as_bytes());
    written.map_err(|error| {
        let what = match error.kind() {
            ErrorKind::AlreadyExists => "exists already; expected the name of a new file".to_owned(),
            _ => error.to_string(),
        };
        Error::Input(format!("{}: {what}", path.display()))
    })?;
    note(&format!(
        "wrote {}; next: asobench check {}",
        path.display(),
        shell_word(path.display())
    ));
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::study::Experiment;
    use crate::study::file::{ExperimentFile, Key, StudyKind};

    /// The file, and the lines of its list of settings.
    fn parts(kind: StudyKind) -> (String, Vec<String>) {
        let content = super::content(kind);
        let (file, list) = content.split_once("for the table [settings] above:\n").unwrap();
        (file.to_owned(), list.lines().map(str::to_owned).collect())
    }

    /// With all that is commented out and is no sentence.
    fn uncommented(file: &str, but: [&str; 2]) -> String {
        let lines = file.lines().map(|line| {
            let code = line.strip_prefix("# ").filter(|code| {
                let key = code.split(" = ").next().unwrap_or_default();
                let is_set = code.contains(" = ") && !key.is_empty() && !key.contains(' ');
                (code.starts_with('[') || is_set) && !but.contains(&key)
            });
            code.unwrap_or(line).to_owned() + "\n"
        });
        lines.collect()
    }

    /// Each setting by itself makes a valid experiment: it clashes with none that is given.
    fn every_setting_stands_alone(kind: StudyKind) -> usize {
        let (file, list) = parts(kind);
        let list = list.iter().filter(|line| !line.starts_with("# Instead of"));
        let settings = list.map(|line| {
            let setting = line.strip_prefix("# ").unwrap();
            let changed = file.replacen("[settings]\n", &format!("[settings]\n{setting}\n"), 1);
            let experiment = ExperimentFile::parse(&changed).and_then(Experiment::new);
            assert!(experiment.is_ok(), "{line}: {:?}", experiment.err());
        });
        settings.count()
    }

    #[test]
    fn the_template_is_a_valid_experiment() {
        let content = super::content(StudyKind::Discrete);
        let experiment = Experiment::new(ExperimentFile::parse(&content).unwrap()).unwrap();
        assert_eq!((experiment.cells.len(), experiment.outputs().len()), (12, 5));
        let text = uncommented(&parts(StudyKind::Discrete).0, ["trials", "zip"]);
        let file = ExperimentFile::parse(&text);
        assert!(file.is_ok(), "{file:?}\n{text}");
        // Three are given, and l is instead of one.
        let all = Key::ALL.iter().filter(|key| key.is_of(StudyKind::Discrete)).count();
        assert_eq!(every_setting_stands_alone(StudyKind::Discrete), all - 4);
    }

    #[test]
    fn the_continuous_template_is_a_valid_experiment() {
        let content = super::content(StudyKind::Continuous);
        let experiment = Experiment::new(ExperimentFile::parse(&content).unwrap()).unwrap();
        assert_eq!((experiment.cells.len(), experiment.outputs().len()), (4, 3));
        // Own plant, own disturbance, the fourth observer and the claim.
        let text = uncommented(&parts(StudyKind::Continuous).0, [""; 2]);
        let file = ExperimentFile::parse(&text);
        assert!(file.is_ok(), "{file:?}\n{text}");
        // Five are given.
        let all = Key::ALL.iter().filter(|key| key.is_of(StudyKind::Continuous)).count();
        assert_eq!(every_setting_stands_alone(StudyKind::Continuous), all - 5);
    }
}
