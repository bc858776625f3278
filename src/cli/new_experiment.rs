//! `asobench new`: writes a commented experiment file.

use super::error::Error;
use super::output::note;
use crate::files;
use crate::study::file::{Key, Scalar, StudyKind};
use crate::text::shell_word;
use std::fmt::Write as _;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::ExitCode;

/// Write a commented experiment file to begin with: NAME.toml
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The study's name, or the file's path
    name: PathBuf,
    /// A study of observers in continuous time
    #[arg(long)]
    continuous: bool,
}

const DISCRETE: &str = r#"# An experiment of asobench: `asobench check THIS_FILE`, then `asobench run THIS_FILE`.
title = "My study"
question = "What do I want to know?"
hypothesis = "What do I expect?"
seed = 1
trials = 1000
# Or until a measure is known well enough in every cell:
# trials = { until = "e_a", output = "iv(4)", relative_mcse = 0.01, minimum = 1000, maximum = 100000 }
# "trials" keeps every trial in trials.parquet too.
store = "summaries"
measures = ["e_a", "e_b", "e_x_max", "e_x_rms"]
# Pairs of outputs that are compared on the same trials.
compare = [["iv(4)", "ls"]]
# Settings whose lists move together:
# zip = [["eta", "window"]]
# Cells to leave out:
# exclude = [{ noise = "white", window = 18 }]

# One value each, or a list, which makes an axis of the grid, or a range such as { logspace = [0.1, 100, 13] }.
[settings]
eta = [2, 5, 10]
window = [98, 218]
noise = ["ar", "white"]
# Further down stands every other setting with its default.

# Methods, all run on the same records; a list in an option makes one method per value.
[[methods]]
estimator = "iv"
iterations = 4
# solver = ["partitioned", "lu", "qr", "svd", "dual", "augmented"]
# stage10 = "corrected"      # E2: or "as-printed", "as-printed-2024"
# auxiliary = "refresh"      # E4: or "frozen", "literal"
# drive = "model"            # E12: or "observer"
# instruments = "u"          # or "r", with feedback
# stabilise = "none"         # or "reflect"
# initial_state = "estimate" # or "zero"
# report = [0, 4]            # only these passes

# A program of your own in any language: docs/protocol.md; `asobench test-method THIS_FILE` tests it.
# [[methods]]
# name = "mine"
# command = ["python3", "mine.py"]
# batch = 256                # records in a message

# [[slopes]]
# measure = "e_a"
# over = "window"

# [[bounds]]
# measure = "e_a"
# below = 0.033

# A claim with the test that decides it: share, value, ratio, cells, slope or time; below, above, between or within.
# [[claims]]
# id = "W1"
# text = "In white noise IV(4) is more exact than least squares."
# holds = "everywhere"          # or "typically", "somewhere"
# where = { noise = "white" }   # all cells without it
# test = { ratio = "e_a", of = "iv(4)", to = "ls", below = 1.0 }

# The plant 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2); `asobench check` prints each plant so.
# [plants.mine]
# A = [1, -1.5, 0.7]
# B = [0, 1, 0.5]

# Inputs of your own, for `input = "mine"`: prbs, multisine, sines, steps or binary.
# [inputs.mine]
# law = "prbs"
# register = 7

# White noise e through C/D: e(k) + 0.5 e(k-1), then 1/(1 - 0.9 q^-1).
# [noises.coloured]
# C = [1, 0.5]
# D = [1, -0.9]

# [feedbacks.static]
# numerator = [0.3]

# A run of a minute or less: `asobench run --quick`.
[quick]
trials = 50

# Every other setting with its default, for the table [settings] above:
"#;

const CONTINUOUS: &str = r#"# An experiment of asobench in continuous time: `asobench check THIS_FILE`, then `asobench run THIS_FILE`.
title = "My study"
question = "What do I want to know?"
hypothesis = "What do I expect?"
seed = 1
trials = 200
measures = ["rms_x", "e_theta_rms", "t_settle", "step_error"]
# Pairs of observers that are compared on the same trials.
compare = [["proposed", "gradient"], ["proposed", "luenberger"]]

# The plant x' = A x + B u, y = C'x + disturbance runs from t = 0 to `until`. This table makes it a study in continuous time.
[continuous]
until = 20                   # seconds
scored_from = 8              # root mean squares are taken from this time on, seconds
# input = 1                  # u, a constant from t = 0 on
# filters = [1]              # n - 1 filters that extend regression (9): a for a / (p + a), or { delay = 0.5 }
error_limit = 1e-2           # a trial whose error by step halving is larger has failed
# trace_every = 0.02         # keeps the course of the first trial, for figures

# One value each, or a list, which makes an axis of the grid, or a range such as { logspace = [0.1, 100, 13] }.
[settings]
disturbance = ["sine", "white"]
level = [0.1, 0.3]
phase = "random"
noise_hold = 0.05
step = 0.025
# Further down stands every other setting with its default.

# Observers, all run on the same trials.
[[observers]]
observer = "luenberger"      # full order
gain = [2, 3.2]              # L; or poles = "-1+2i,-1-2i", or bandwidth = 2

[[observers]]
observer = "gradient"        # GPEBO with the gradient estimator
gains = [1]                  # adaptation gains, one for each component of theta, or one for all

[[observers]]
observer = "proposed"        # GPEBO with DREM and the expansion of exp(delta)
gains = [1e11, 1e13]

# [[observers]]
# observer = "kalman-bucy"
# measurement = 0.01         # intensity of the measurement noise that it assumes
# prior = 4                  # variance of every component of theta at t = 0

# A claim with the test that decides it: share, value, ratio, cells or slope; below, above, between or within.
# [[claims]]
# id = "B1"
# text = "The proposed observer is more exact than the gradient's."
# test = { ratio = "rms_x", of = "proposed", to = "gradient", below = 1 }

# A plant of your own; set plant = "mine".
# [continuous_plants.mine]
# a = [[0, 1], [-1, -0.2]]
# b = [0, 1]
# c = [1, 0]
# x0 = [1, 0]

# A disturbance of your own; set disturbance = "mine".
# [signals.mine]
# waves = [{ wave = "sine", amplitude = 0.5, frequency = 0.7 }, { wave = "white", amplitude = 0.1 }]

# A run of a minute or less: `asobench run --quick`.
[quick]
trials = 20

# Every other setting with its default, for the table [settings] above:
"#;

fn content(kind: StudyKind) -> String {
    let text = match kind {
        StudyKind::Continuous => CONTINUOUS,
        StudyKind::Discrete => DISCRETE,
    };
    let mut text = text.to_owned();
    let (_, settings) = text.split_once("\n[settings]\n").unwrap_or_default();
    let (settings, _) = settings.split_once("\n\n").unwrap_or_default();
    let settings = settings.to_owned();
    let given = |key: &Key| {
        settings
            .lines()
            .any(|line| line.starts_with(&format!("{key} = ")))
    };
    for key in Key::ALL.iter().filter(|key| key.is_of(kind) && !given(key)) {
        let value = match key.default_of(kind) {
            None => {
                // The two keys exclude each other.
                let _ = writeln!(text, "# Instead of window: {key} = 20 ({})", key.about());
                continue;
            }
            Some(Scalar::Number(number)) => number.to_string(),
            Some(Scalar::Text(text)) => format!("\"{text}\""),
        };
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "# {:<32} # {}",
            format!("{key} = {value}"),
            key.about()
        );
    }
    text
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let mut path = arguments.name.clone();
    if path.extension().is_none() {
        path.set_extension("toml");
    }
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
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
            ErrorKind::AlreadyExists => {
                "exists already; expected the name of a new file".to_owned()
            }
            _ => error.to_string(),
        };
        Error::Input(format!("{}: {what}", path.display()))
    })?;
    note(&format!(
        "wrote {}; next: asobench check {}",
        path.display(),
        shell_word(path.display())
    ));
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use crate::study::Experiment;
    use crate::study::file::{ExperimentFile, Key, StudyKind};

    /// The file, and the lines of its list of settings.
    fn parts(kind: StudyKind) -> (String, Vec<String>) {
        let content = super::content(kind);
        let (file, list) = content
            .split_once("for the table [settings] above:\n")
            .unwrap();
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
        assert_eq!(
            (experiment.cells.len(), experiment.outputs().len()),
            (12, 5)
        );
        let text = uncommented(&parts(StudyKind::Discrete).0, ["trials", "zip"]);
        let file = ExperimentFile::parse(&text);
        assert!(file.is_ok(), "{file:?}\n{text}");
        // Three are given, and l is instead of one.
        let all = Key::ALL
            .iter()
            .filter(|key| key.is_of(StudyKind::Discrete))
            .count();
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
        let all = Key::ALL
            .iter()
            .filter(|key| key.is_of(StudyKind::Continuous))
            .count();
        assert_eq!(every_setting_stands_alone(StudyKind::Continuous), all - 5);
    }
}
