//! Looks at the results of a study: how often its claims were judged, and what each look may spend of their level.
//!
//! Whoever extends a study until its claims are decided judges them several times. If each time had the full level, the
//! chance of a wrong verdict would add up. So every look has a share of the level, and all shares together are at most
//! 1 (Bonferroni), whatever follows: the first rule of a folder sets nine tenths of the level aside, every further one
//! half of what is left. A rule with several numbers of trials at which it may stop divides its part by their number. A
//! file with `looks = K` divides what is left into equal parts for the looks up to the K-th, and leaves nothing for
//! later ones. The share of a look that was made is stored, and counts whatever the file says later.
//!
//! A look is known by the number of trials in all cells together: with one design and seed, the same number of trials
//! are the same trials, and to judge them again is no new look. Looks in other folders beside this one count too: those
//! at one of its claims by trials of the same seed, and where it confirms claims, other confirmations of one of them.

use crate::design::Experiment;
use crate::design::file::{ClaimTable, ExperimentFile, TestTable, TrialRule};
use crate::files;
use crate::files::Kind;
use crate::outcome::folder_error::FolderError;
use crate::outcome::folder_layout::LOOKS;
use crate::outcome::publication::read_current;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::Path;

/// The share of the level that the first rule of a folder sets aside.
const FIRST: f64 = 0.9;

/// A look that was made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Made {
    /// Trials in all cells together.
    trials: u64,
    /// The share of the level at which claims are judged.
    share: f64,
    /// The share that its rule set aside for all its looks.
    set_aside: f64,
    /// In another folder: the seed of its trials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    elsewhere: Option<u64>,
}

/// The study by which the claims of a folder are judged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Study {
    /// The checksum of the design without its seed and what claims need.
    design: String,
    seed: u64,
    confirms: Option<u64>,
    /// Checksums of the claims.
    claims: Vec<String>,
}

impl Study {
    /// Returns the study of an experiment; `None` if it has no claim to judge.
    fn of(experiment: &Experiment) -> Option<Self> {
        let file = &experiment.file;
        let judged = file.claims.iter().filter(|claim| !claim.test.is_empty());
        let claims: Vec<String> = judged.map(number_of).collect();
        let mut design = experiment.stamped_design();
        if let Some(keys) = design["experiment"].as_object_mut() {
            keys.retain(|key, _| !["seed", "confirms", "needed"].contains(&key.as_str()));
        }
        (!claims.is_empty()).then(|| Self {
            design: files::checksum(design.to_string().as_bytes()),
            seed: file.seed,
            confirms: file.confirms,
            claims,
        })
    }

    /// Whether looks at another study are looks at this one: the same trials, or both confirm the same one.
    fn shares_with(&self, other: &Self) -> bool {
        self.design == other.design
            && self.confirms == other.confirms
            && (self.seed == other.seed || self.confirms.is_some())
            && self.claims.iter().any(|claim| other.claims.contains(claim))
    }
}

/// Returns the checksum of the number that a claim is about: a claim whose limit was edited keeps it.
fn number_of(claim: &ClaimTable) -> String {
    let tests = claim.test.iter().map(|test| TestTable {
        below: None,
        above: None,
        between: None,
        within: None,
        ..test.clone()
    });
    let number = json!([claim.cells, tests.collect::<Vec<_>>()]);
    files::checksum(number.to_string().as_bytes())
}

/// The looks at a folder, in their order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Looks {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    study: Option<Study>,
    looks: Vec<Made>,
}

/// The place of a look among those at a folder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Its number, from 1.
    pub number: usize,
    /// The share of a claim's level at which it judges.
    pub share: f64,
    /// The share of a look with more trials after it; 0 if nothing is left.
    pub next: f64,
}

impl Look {
    /// The first look, with the whole level, after which none follows.
    pub const ONLY: Self = Self {
        number: 1,
        share: 1.0,
        next: 0.0,
    };
}

#[derive(Serialize, Deserialize)]
struct Stored {
    looks_of: String,
    #[serde(flatten)]
    looks: Looks,
}

impl Looks {
    /// Reads the looks at a folder. Results without a list, as older versions wrote them, had no look that is known.
    ///
    /// # Errors
    /// If the list cannot be read, or no run could have written it.
    pub fn read(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(LOOKS);
        let Some(text) = read_current(folder, LOOKS, Kind::Looks)? else {
            return Ok(Self::default());
        };
        let stored = files::parsed(&text).and_then(|json| {
            let stored: Result<Stored, _> = serde_json::from_value(json);
            stored.map_err(|error| error.to_string())
        });
        let share = |share: f64| (0.0..=1.0).contains(&share);
        let sound = |look: &Made| share(look.share) && share(look.set_aside);
        match stored {
            Ok(stored) if stored.looks.looks.iter().all(sound) => Ok(stored.looks),
            Ok(_) => Err("a share outside 0 to 1".to_owned()),
            Err(reason) => Err(reason),
        }
        .map_err(|reason| FolderError::Looks { path, reason })
    }

    /// Reads the looks at a folder before a run there, and adds those at the same claims that stand in the folders
    /// beside it. A list there that cannot be read counts for nothing; the folder's own is `forgotten` if it is about
    /// results of another study, which are replaced.
    ///
    /// # Errors
    /// As for [`Self::read`].
    pub(crate) fn before_run(folder: &Path, experiment: &Experiment, forgotten: bool) -> Result<Self, FolderError> {
        let mut looks = if forgotten {
            Self::default()
        } else {
            Self::read(folder)?
        };
        looks.study = Study::of(experiment);
        let Some(study) = looks.study.clone() else {
            return Ok(looks);
        };
        for other in files::beside(folder) {
            let other = Self::read(&other).unwrap_or_default();
            let Some(its) = other.study.filter(|its| study.shares_with(its)) else {
                continue;
            };
            for made in other.looks {
                let seed = made.elsewhere.unwrap_or(its.seed);
                let same = |known: &&Made| known.trials == made.trials && known.elsewhere.unwrap_or(study.seed) == seed;
                if !looks.looks.iter().any(|known| same(&known)) {
                    looks.looks.push(Made {
                        elsewhere: Some(seed),
                        ..made
                    });
                }
            }
        }
        Ok(looks)
    }

    /// Returns how many of the looks were made in other folders.
    pub(crate) fn elsewhere(&self) -> usize {
        let there = self.looks.iter().filter(|look| look.elsewhere.is_some());
        there.count()
    }

    /// Returns the place of the look at so many trials of this folder, if it was made here or elsewhere.
    fn made(&self, trials: u64) -> Option<usize> {
        let own = self.study.as_ref().map(|study| study.seed);
        let is_own = |look: &Made| look.elsewhere.is_none() || look.elsewhere == own;
        let mut looks = self.looks.iter();
        looks.position(|look| look.trials == trials && is_own(look))
    }

    /// Returns the look at so many trials: the one that was made, or the next one under a rule.
    pub fn at(&self, trials: u64, file: &ExperimentFile, rule: &TrialRule) -> Look {
        let made = self.made(trials);
        let look = made.map_or_else(|| self.new_look(trials, file.looks, rule), |at| self.looks[at]);
        let mut after = self.clone();
        after.add_planned(trials, file.looks, rule);
        let next = match rule {
            // Another step of the same rule.
            TrialRule::Until(_) | TrialRule::Decided(_) if made.is_none() => look.share,
            _ => after.new_look(0, file.looks, &TrialRule::Fixed(0)).share,
        };
        Look {
            number: made.unwrap_or(self.looks.len()) + 1,
            share: look.share,
            next,
        }
    }

    /// Returns a look after those that were made, of which `planned` there are to be.
    fn new_look(&self, trials: u64, planned: Option<u32>, rule: &TrialRule) -> Made {
        let spent: f64 = self.looks.iter().map(|look| look.set_aside).sum();
        let left = (1.0 - spent).max(0.0);
        let set_aside = match planned {
            Some(planned) => match (planned as usize).checked_sub(self.looks.len()) {
                None | Some(0) => 0.0,
                Some(further) => left / further as f64,
            },
            None if self.looks.is_empty() => FIRST,
            None => 0.5 * left,
        };
        Made {
            trials,
            share: set_aside / f64::from(rule.looks()),
            set_aside,
            elsewhere: None,
        }
    }

    /// Adds the look at so many trials under a rule without a planned number of looks, unless it was made.
    pub fn add(&mut self, trials: u64, rule: &TrialRule) {
        self.add_planned(trials, None, rule);
    }

    /// Adds the look at so many trials, of which `planned` there are to be, unless it was made.
    pub(crate) fn add_planned(&mut self, trials: u64, planned: Option<u32>, rule: &TrialRule) {
        match self.made(trials) {
            Some(at) => self.looks[at].elsewhere = None,
            None => self.looks.push(self.new_look(trials, planned, rule)),
        }
    }

    /// Returns the text of the list's file.
    pub(crate) fn text(&self) -> String {
        files::sealed(&Stored {
            looks_of: "asobench".to_owned(),
            looks: self.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(text: &str) -> (ExperimentFile, TrialRule) {
        let file = ExperimentFile::parse(text).unwrap();
        let rule = file.trials.clone();
        (file, rule)
    }

    /// Nine tenths, then half of what is left each time. The sum of any number of looks stays below 1.
    #[test]
    fn shares_of_extensions_by_hand() {
        let (file, fixed) = rule("trials = 100");
        let mut looks = Looks::default();
        let mut sum = 0.0;
        for (trials, share) in [(100, 0.9), (200, 0.05), (300, 0.025), (1000, 0.0125)] {
            let look = looks.at(trials, &file, &fixed);
            assert!((look.share - share).abs() < 1e-15, "{look:?}");
            sum += look.share;
            looks.add(trials, &fixed);
            assert_eq!(looks.at(trials, &file, &fixed).share, look.share, "no new look");
            let next = if trials == 100 { 0.05 } else { share / 2.0 };
            assert!((looks.at(trials, &file, &fixed).next - next).abs() < 1e-15);
        }
        assert!(sum < 1.0);
        // An old look again, after later ones.
        assert_eq!(looks.at(200, &file, &fixed).number, 2);
        for trials in 2000..2100 {
            looks.add(trials, &fixed);
        }
        let all: f64 = looks.looks.iter().map(|look| look.set_aside).sum();
        assert!(all <= 1.0);
    }

    /// A rule that may stop at 100, 200, 400, 800 divides its part by 4, whichever step it ends at. More trials after
    /// it have half of the rest.
    #[test]
    fn a_rule_with_several_steps_divides_its_part() {
        let until = "trials = { until = 'W', minimum = 100, maximum = 800 }";
        let (file, until) = rule(until);
        let mut looks = Looks::default();
        assert_eq!(looks.at(100, &file, &until).share, 0.225);
        assert_eq!(looks.at(800, &file, &until).share, 0.225);
        looks.add(400, &until);
        let fixed = TrialRule::Fixed(4000);
        assert!((looks.at(4000, &file, &fixed).share - 0.05).abs() < 1e-15);
    }

    /// A planned number of looks divides the whole level, and nothing is left for further ones.
    #[test]
    fn planned_looks_have_equal_parts_of_the_whole() {
        let (file, fixed) = rule("trials = 100\nlooks = 2");
        let mut looks = Looks::default();
        let mut shares = Vec::new();
        for trials in [100, 200, 300] {
            shares.push(looks.at(trials, &file, &fixed).share);
            looks.add_planned(trials, file.looks, &fixed);
        }
        assert_eq!(shares, [0.5, 0.5, 0.0]);
        let (once, fixed) = rule("trials = 100\nlooks = 1");
        assert_eq!(Looks::default().at(100, &once, &fixed), Look::ONLY);
    }

    /// Whoever doubles the trials and edits `looks` to what comes next has what is left: by hand.
    #[test]
    fn an_edited_plan_has_what_is_left() {
        let (_, fixed) = rule("trials = 100");
        let plan = |plans: &[Option<u32>]| -> Vec<f64> {
            let mut looks = Looks::default();
            let of = |(planned, step): (&Option<u32>, u32)| {
                let file = ExperimentFile {
                    looks: *planned,
                    ..ExperimentFile::default()
                };
                let trials = 100 << step;
                let share = looks.at(trials, &file, &fixed).share;
                looks.add_planned(trials, *planned, &fixed);
                // The stored share counts, whatever the file says now.
                let again = looks.at(trials, &ExperimentFile::default(), &fixed);
                assert_eq!((again.share, again.number), (share, step as usize + 1));
                share
            };
            plans.iter().zip(0..).map(of).collect()
        };
        assert_eq!(plan(&[Some(1), Some(2), Some(3)]), [1.0, 0.0, 0.0]);
        assert_eq!(plan(&[Some(2), Some(3), Some(4), None]), [0.5, 0.25, 0.125, 0.0625]);
        assert_eq!(plan(&[Some(4), Some(2), Some(1), Some(4)]), [0.25, 0.75, 0.0, 0.0]);
        let mixed = plan(&[None, Some(3), None, Some(9)]);
        let by_hand = [0.9, 0.05, 0.025, 0.025 / 6.0];
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-15;
        assert!(mixed.iter().zip(&by_hand).all(near), "{mixed:?}");
    }

    /// An adversary who chooses the plan or rule of each look at random, ten thousand times: all that can be judged at
    /// is never more than the level.
    #[test]
    fn no_edit_spends_more_than_there_is() {
        let mut state = 1_u64;
        let mut draw = move |below: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        for _ in 0..10_000 {
            let (mut looks, mut trials, mut spent) = (Looks::default(), 0, 0.0);
            for _ in 0..8 {
                trials += 1 + draw(100);
                let (text, steps) = match draw(3) {
                    0 => (String::new(), 1),
                    1 => (format!("looks = {}", 1 + draw(9)), 1),
                    _ => {
                        let most = trials << draw(4);
                        let rule = format!("trials = {{ until = 'W', minimum = {trials}, maximum = {most} }}");
                        (rule, most.ilog2() - trials.ilog2() + 1)
                    }
                };
                let (file, rule) = rule(&text);
                // Every step of the rule may be judged, at the same share.
                spent += f64::from(steps) * looks.at(trials, &file, &rule).share;
                looks.add_planned(trials, file.looks, &rule);
            }
            assert!(spent <= 1.0 + 1e-12, "{spent}: {looks:?}");
        }
    }

    #[test]
    fn a_list_comes_back_and_a_forged_one_is_refused() {
        let place = tempfile::tempdir().unwrap();
        assert_eq!(Looks::read(place.path()).unwrap(), Looks::default());
        let mut looks = Looks::default();
        looks.add(100, &TrialRule::Fixed(100));
        std::fs::write(place.path().join(LOOKS), looks.text()).unwrap();
        assert_eq!(Looks::read(place.path()).unwrap(), looks);
        let forged = r#"{"looks_of":"asobench","looks":[{"trials":1,"share":-3,"set_aside":0}]}"#;
        std::fs::write(place.path().join(LOOKS), forged).unwrap();
        let error = Looks::read(place.path()).unwrap_err().to_string();
        assert!(error.contains("looks.json") && error.contains("a share"), "{error}");
    }
}
