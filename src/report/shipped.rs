//! The experiments of this repository, told by their designs: only their results say something of a claim.

use crate::study::design_of;
use crate::study::file::ExperimentFile;
use serde_json::Value;

macro_rules! shipped {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../../experiments/", $name, ".toml")))),*]
    };
}

const FILES: [(&str, &str); 21] = shipped![
    "nikolov2023",
    "c2-c3",
    "noise-level",
    "window",
    "noise-colour",
    "convergence",
    "solvers",
    "closed-loop",
    "initial-state",
    "observer-poles",
    "observer-comparison",
    "errata",
    "order",
    "input-noise",
    "check-grid",
    "gpebo-figures",
    "gpebo-noise",
    "gpebo-sine",
    "gpebo-amplitude",
    "gpebo-gain",
    "gpebo-plant",
];

/// A shipped experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shipped {
    /// Its file's name without ".toml".
    pub name: &'static str,
    /// Whether it is the quick variant.
    pub quick: bool,
}

impl Shipped {
    /// The shipped experiment whose design a resolved file has, whatever seed and trials; `None` where a setting, a
    /// method or a measure is another one.
    pub fn of(file: &ExperimentFile) -> Option<Self> {
        let design = design(file.clone());
        let mut variants = FILES
            .iter()
            .flat_map(|(name, text)| [false, true].map(|quick| (*name, *text, quick)));
        variants.find_map(|(name, text, quick)| {
            let file = ExperimentFile::parse(text).ok()?;
            let file = if quick { file.quick() } else { file };
            let same = design.is_some() && self::design(file.resolve().ok()?) == design;
            same.then_some(Self { name, quick })
        })
    }

    /// The experiment of a name.
    #[cfg(test)]
    pub fn named(name: &str) -> Option<Self> {
        let mut names = FILES.iter().map(|(of, _)| *of);
        let name = names.find(|of| *of == name)?;
        Some(Self { name, quick: false })
    }

    /// Where it stands in a report; other studies come after all of these.
    pub fn place(shipped: Option<Self>) -> usize {
        let of = shipped.and_then(|of| FILES.iter().position(|(name, _)| *name == of.name));
        of.unwrap_or(FILES.len())
    }
}

fn design(file: ExperimentFile) -> Option<Value> {
    let mut design = design_of(&serde_json::to_value(file).ok()?);
    let keys = design.as_object_mut()?;
    keys.remove("seed");
    keys.remove("store");
    Some(design)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Experiment;

    #[test]
    fn every_file_is_known_by_its_design_alone() {
        for (name, text) in FILES {
            let file = ExperimentFile::parse(text).unwrap();
            for quick in [false, true] {
                let file = if quick {
                    file.clone().quick()
                } else {
                    file.clone()
                };
                let resolved = Experiment::new(file.set("seed=7").unwrap()).unwrap().file;
                // Where the quick variant has the same cells it is the experiment itself.
                let found = Shipped::of(&resolved).unwrap();
                assert_eq!(found.name, name);
                assert!(found.quick == quick || !found.quick, "{name}");
                let key = if file.continuous.is_some() {
                    "level"
                } else {
                    "amplitude"
                };
                let other = file
                    .set(&format!("{key}=7"))
                    .and_then(Experiment::new)
                    .unwrap();
                assert_eq!(Shipped::of(&other.file), None, "{name}");
            }
        }
    }

    #[test]
    fn no_file_is_forgotten() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/experiments");
        let files = std::fs::read_dir(folder).unwrap();
        let toml = files.filter(|file| {
            let path = file.as_ref().unwrap().path();
            path.extension()
                .is_some_and(|extension| extension == "toml")
        });
        assert_eq!(toml.count(), FILES.len());
    }
}
