//! The tables of the suite's page, each with the name of its files.

mod claims;
mod commands;
mod newcomer;
mod ranking;
mod scenarios;

use super::subject::SuitePage;
use crate::document::columns::Columns;
use crate::table::{CellText, Column, Table};
use asobench_identification::metric::Estimate;
use asobench_identification::number::uncertain_within;
use asobench_study::suite::{ARCHIVE, Division, IDEAL, MethodResults, Scenario, ScenarioResults, Score, score};
use std::collections::BTreeSet;
use std::fmt::Write as _;

pub use commands::{law_table, published_table, times_table};
pub use newcomer::about_loss;
pub use scenarios::recorded;

/// Digits of a number.
const DIGITS: i32 = 4;
/// Efficiencies below it are not told apart.
const LEAST: f64 = 0.001;
/// The words for noise models among those that say what is hard.
const NOISES: [&str; 6] = [
    "white",
    "1/A",
    "coloured",
    "errors in variables",
    "heavy tails",
    "outliers",
];

/// A table with the name of its files and its title there.
pub struct SuiteTable {
    /// The name of the files, without an ending.
    pub name: String,
    /// The title in a paper.
    pub title: String,
    /// The table.
    pub table: Table,
}

impl SuiteTable {
    /// The table, if it has rows.
    fn unless_empty(self) -> Option<Self> {
        (!self.table.rows.is_empty()).then_some(self)
    }
}

/// Some scenarios with the score of each method there.
struct Group {
    words: String,
    members: BTreeSet<usize>,
    /// In the order of the methods; `None` for a method that is for none of them.
    scores: Vec<Option<Score>>,
}

pub(super) struct Tables<'a> {
    pub(super) of: &'a SuitePage<'a>,
    scenarios: Vec<&'a Scenario>,
    /// All scenarios, then those of each difficulty.
    groups: Vec<Group>,
}

/// An efficiency. One below [`LEAST`] is not told apart from others, nor is a smaller error.
fn efficient(number: Estimate) -> CellText {
    let Estimate { value, mcse: error } = number;
    if value < LEAST && error < 2.0 * LEAST {
        return CellText::number(format!("< {LEAST}"), value);
    }
    let error = error.max(LEAST);
    let rounded = if value < LEAST { 0.0 } else { value };
    CellText::number(uncertain_within(rounded, error, DIGITS), value)
}

/// A number of a table, times a factor.
fn cell(number: Estimate, factor: f64) -> CellText {
    let [value, error] = [number.value, number.mcse].map(|x| factor * x);
    CellText::number(uncertain_within(value, error, DIGITS), value)
}

fn percent(share: f64) -> CellText {
    CellText::number(format!("{:.1}", 100.0 * share), 100.0 * share)
}

fn count(number: usize) -> CellText {
    CellText::number(number.to_string(), number as f64)
}

/// A column of numbers as wide as its heading, and at least so wide.
fn headed(heading: impl Into<String>, least: usize) -> Column {
    let column = Column::number(heading, "");
    let width = column.title.len().max(least);
    column.width(width)
}

/// No number: the method is not for it.
fn none() -> CellText {
    CellText::text("-")
}

impl<'a> Tables<'a> {
    pub(super) fn new(of: &'a SuitePage<'a>) -> Self {
        let scenarios: Vec<&Scenario> = of.suite.scenarios().collect();
        let mut parts: Vec<(String, BTreeSet<usize>)> = vec![("all".to_owned(), (0..scenarios.len()).collect())];
        // Words of the same scenarios stand together.
        for word in of.suite.difficulties() {
            let own = (0..scenarios.len()).filter(|i| scenarios[*i].hard.contains(&word));
            let members: BTreeSet<usize> = own.collect();
            match parts[1..].iter_mut().find(|(_, others)| *others == members) {
                Some((words, _)) => {
                    let _ = write!(words, ", {word}");
                }
                None => parts.push((word, members)),
            }
        }
        let scored = |method: &MethodResults, members: &BTreeSet<usize>| {
            let both = members.iter().map(|i| (scenarios[*i], &method.scenarios[*i]));
            let both: Vec<(&Scenario, &ScenarioResults)> = both.filter(|(_, of)| of.has_runs()).collect();
            (!both.is_empty()).then(|| score(&both))
        };
        let groups = parts.into_iter().map(|(words, members)| Group {
            scores: of.methods.iter().map(|of| scored(of, &members)).collect(),
            words,
            members,
        });
        Self {
            of,
            groups: groups.collect(),
            scenarios,
        }
    }

    /// The tables of this part of the page, in its order, but for the first rows of the ranking.
    pub(super) fn all(&self) -> Vec<SuiteTable> {
        let mut all = vec![self.ranking(usize::MAX)];
        all.extend(self.against());
        all.extend(self.own_losses());
        all.extend(self.best());
        all.extend(self.partial());
        all.extend(self.places());
        all.extend(self.difficulties());
        all.extend(self.reasons());
        all.push(self.scenarios());
        all.extend(self.efficiencies());
        all.extend(self.contributed());
        all
    }

    /// A table of this part. The names of its files have a word in the open division, whose page is that of the closed
    /// one.
    fn table(&self, name: &str, title: &str, table: Table) -> SuiteTable {
        let suite = self.of.suite;
        let (edition, contest, tier) = (&suite.manifest.edition, suite.division, suite.tier);
        let title = format!("{title} (edition {edition}, contest {contest}, tier {tier})");
        let name = format!("{}{name}", if contest == Division::Open { "choosing-" } else { "" });
        SuiteTable { name, title, table }
    }

    /// The methods that are for all scenarios of a group, the best first, and their scores. Without the yardstick.
    fn ranked<'b>(&'b self, group: &'b Group) -> Vec<(&'a MethodResults, &'b Score)> {
        let both = self.of.methods.iter().zip(&group.scores);
        let mut ranked: Vec<(&MethodResults, &Score)> = both
            .filter(|(method, _)| method.method != IDEAL)
            .filter(|(method, _)| {
                let mut own = group.members.iter().map(|i| &method.scenarios[*i]);
                own.all(ScenarioResults::has_runs)
            })
            .filter_map(|(method, score)| Some((method, score.as_ref()?)))
            .collect();
        ranked.sort_by(|(_, a), (_, b)| {
            let of = |score: &Score| score.efficiency.map(|of| of.value);
            let ([a, a_tenth], [b, b_tenth]) = (of(a), of(b));
            b.total_cmp(&a).then(b_tenth.total_cmp(&a_tenth))
        });
        ranked
    }

    /// The same without those that have the numbers of another one, since they are the same here.
    fn distinct<'b>(&'b self, group: &'b Group) -> Vec<(&'a MethodResults, &'b Score)> {
        let mut ranked = self.ranked(group);
        ranked.dedup_by(|(_, b), (_, a)| a.efficiency == b.efficiency && a.efficiency[0].value > 0.0);
        ranked
    }

    /// The name of a method in a table, with whose it is.
    fn named(&self, method: &MethodResults) -> CellText {
        let name = &method.method;
        let mut others = self.of.contributed.iter();
        CellText::text(if self.of.newcomer == Some(name.as_str()) {
            format!("{name} (yours)")
        } else if others.any(|of| of.results.method == *name) {
            format!("{name} (contributed)")
        } else {
            name.clone()
        })
    }

    /// The results of others, and where they are from; `None` without any.
    pub(super) fn contributed(&self) -> Option<SuiteTable> {
        let table = Columns::new(self.of.contributed.iter())
            .with(Column::text("method").width(15), |of| &of.results.method)
            .with(Column::text("computed by").width(30), |of| of.programs.join(", "))
            .with(Column::text("what it is").width(40), |of| of.method.to_string())
            .with(Column::text("file").width(20), |of| {
                CellText::text(of.file()).link(format!("{ARCHIVE}/{}", of.file()))
            })
            .whole("Results of others, as their files say");
        self.table("contributed", "Results of others", table).unless_empty()
    }
}

/// A method with its efficiency.
fn beside(method: &MethodResults, efficiency: Estimate) -> CellText {
    CellText::text(format!("{} {}", method.method, efficient(efficiency).text))
}

/// The words of a scenario that are its noise model.
fn noise_model(scenario: &Scenario) -> String {
    let words = scenario.hard.iter().map(String::as_str);
    let words: Vec<&str> = words.filter(|word| NOISES.contains(word)).collect();
    words.join(", ")
}
