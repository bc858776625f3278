//! Looks at the results of a folder: how often its claims were judged, and what each look may spend of their level.
//!
//! Whoever extends a study until its claims are decided judges them several times. If each time had the full level, the
//! chance of a wrong verdict would add up. So every look has a share of the level, and all shares of a folder together
//! are at most 1 (Bonferroni), whatever follows: the first rule of a folder sets nine tenths of the level aside, every
//! further one half of what is left. A rule with several numbers of trials at which it may stop divides its part by
//! their number. A file with `looks = K` divides the whole level into K equal parts instead, and leaves nothing for
//! later looks.
//!
//! A look is known by the number of trials in all cells together: with one design and seed, the same number of trials
//! are the same trials, and to judge them again is no new look.

use crate::design::file::experiment_file::ExperimentFile;
use crate::design::file::rule::TrialRule;
use crate::files;
use crate::files::Kind;
use crate::outcome::layout::LOOKS;
use crate::outcome::publication::read_current;
use crate::outcome::results_folder::FolderError;
use serde::{Deserialize, Serialize};
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
}

/// The looks at a folder, in their order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Looks {
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

    /// Returns the look at so many trials: the one that was made, or the next one under a rule.
    pub fn at(&self, trials: u64, file: &ExperimentFile, rule: &TrialRule) -> Look {
        let made = self.looks.iter().position(|look| look.trials == trials);
        let number = made.unwrap_or(self.looks.len()) + 1;
        let look = made.map_or_else(|| self.new_look(trials, rule), |at| self.looks[at]);
        if let Some(planned) = file.looks {
            let share = |number: usize| {
                let planned = planned as usize;
                if number <= planned {
                    1.0 / planned as f64
                } else {
                    0.0
                }
            };
            return Look {
                number,
                share: share(number),
                next: share(self.looks.len().max(number) + 1),
            };
        }
        let mut after = self.clone();
        after.add(trials, rule);
        let next = match rule {
            // Another step of the same rule.
            TrialRule::Until(_) | TrialRule::Decided(_) if made.is_none() => look.share,
            _ => after.new_look(0, &TrialRule::Fixed(0)).share,
        };
        Look {
            number,
            share: look.share,
            next,
        }
    }

    fn new_look(&self, trials: u64, rule: &TrialRule) -> Made {
        let spent: f64 = self.looks.iter().map(|look| look.set_aside).sum();
        let set_aside = if self.looks.is_empty() {
            FIRST
        } else {
            0.5 * (1.0 - spent).max(0.0)
        };
        Made {
            trials,
            share: set_aside / f64::from(rule.looks()),
            set_aside,
        }
    }

    /// Adds the look at so many trials, unless it was made.
    pub fn add(&mut self, trials: u64, rule: &TrialRule) {
        if !self.looks.iter().any(|look| look.trials == trials) {
            self.looks.push(self.new_look(trials, rule));
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
            assert_eq!(
                looks.at(trials, &file, &fixed).share,
                look.share,
                "no new look"
            );
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
            looks.add(trials, &fixed);
        }
        assert_eq!(shares, [0.5, 0.5, 0.0]);
        let (once, fixed) = rule("trials = 100\nlooks = 1");
        assert_eq!(Looks::default().at(100, &once, &fixed), Look::ONLY);
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
        assert!(
            error.contains("looks.json") && error.contains("a share"),
            "{error}"
        );
    }
}
