//! `asobench suite list` and `asobench suite show`: what the suite has.

use super::part::Part;
use crate::cli::error::Error;
use crate::cli::methods::filled;
use crate::cli::output::print;
use crate::suite::{Suite, SuiteStudy, Tier};

/// Show a system: where it comes from, what is hard about it, its scenarios and settings
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// A system, study or scenario, such as P07
    #[arg(value_name = "NAME")]
    name: String,
}

pub(super) fn list(part: &Part) -> Result<(), Error> {
    let suite = part.suite()?;
    let scenarios = suite.scenarios().count();
    let mut text = format!(
        "suite {}, tier {}, contest {}: {scenarios} scenarios, {} runs each{}\n",
        suite.manifest.edition,
        suite.tier,
        suite.division,
        suite.trials(false),
        if suite.scenarios().any(|of| of.is_bank) {
            format!(", {} of a plant of the bank", suite.trials(true))
        } else {
            String::new()
        }
    );
    for scenario in suite.scenarios() {
        let head = format!("{:<17} p = {:<3}", scenario.name, scenario.free);
        let mut words = scenario.hard.join(", ");
        if scenario.separate < 0.995 {
            words.extend([format!("; separate polynomials: at most {:.2}", scenario.separate)]);
        }
        text += &filled(&head, &words, 25);
    }
    print(&text)
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let only = std::slice::from_ref(&arguments.name);
    let suite = Suite::new(Tier::Full, only)?;
    let mut text = String::new();
    if let Some(first) = suite.studies.first() {
        let file = first.file();
        text.extend([format!("{}: {}\n", first.entry.system, file.title)]);
        text += &filled("", &file.question, 0);
        text += &filled("Source: ", &file.source, 0);
    }
    for study in &suite.studies {
        text += &described(study, &suite);
    }
    print(&text)
}

/// A study with its scenarios, and what to write into an experiment file.
fn described(study: &SuiteStudy, suite: &Suite) -> String {
    let entry = &study.entry;
    let mut text = format!(
        "\n{}, from tier {} on; methods are told {}\n",
        study.name,
        entry.tier,
        study.truth()
    );
    for (key, value) in &study.file().settings {
        let value = serde_json::to_string(value).unwrap_or_default();
        text.extend([format!("  {key} = {value}\n")]);
    }
    for scenario in &study.scenarios {
        text += &filled(
            &format!(
                "  {} p = {}, {}, weight {:.6}: ",
                scenario.name, scenario.free, scenario.content, scenario.weight
            ),
            &scenario.hard.join(", "),
            4,
        );
    }
    let (seed, system) = (suite.manifest.seed, &entry.system);
    text.extend([format!(
        "  seed = {seed}; suite/{system}.toml has the plant and its noises\n"
    )]);
    text
}
