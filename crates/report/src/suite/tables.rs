//! The tables of the suite's page.

use super::subject::SuitePage;
use crate::table::{CellText, Column, Table};
use asobench_identification::number::uncertain_within;
use asobench_study::suite::{
    Division, Estimated, IDEAL, MethodResults, NEAR, REFERENCE, RecordedFits, Scenario,
    ScenarioResults, Score, VALUES, efficiency, paired, score,
};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Methods beside each other in a table of scenarios.
const BESIDE: usize = 8;
/// Digits of a number.
const DIGITS: i32 = 4;
/// Efficiencies below it are not told apart.
const LEAST: f64 = 0.001;
/// A lower FIT is not told apart: the model explains nothing.
const LEAST_FIT: f64 = -100.0;

pub(super) struct Tables<'a> {
    of: &'a SuitePage<'a>,
    scenarios: Vec<&'a Scenario>,
}

/// An efficiency. One below [`LEAST`] is not told apart from others, nor is a smaller error.
fn efficient(number: Estimated) -> CellText {
    let Estimated { value, error } = number;
    if value < LEAST && error < 2.0 * LEAST {
        return CellText::number(format!("< {LEAST}"), value);
    }
    let error = error.max(LEAST);
    let rounded = if value < LEAST { 0.0 } else { value };
    CellText::number(uncertain_within(rounded, error, DIGITS), value)
}

/// A number of a table, times a factor.
fn cell(number: Estimated, factor: f64) -> CellText {
    let [value, error] = [number.value, number.error].map(|x| factor * x);
    CellText::number(uncertain_within(value, error, DIGITS), value)
}

/// A table with first columns and a column for each heading, as wide as that and at least so wide.
fn with_headings<S: Into<String>>(
    caption: impl Into<String>,
    first: &[Column],
    headings: impl IntoIterator<Item = S>,
    least: usize,
) -> Table {
    let column = |heading: S| {
        let heading = heading.into();
        let width = heading.len().max(least);
        Column::number(heading, "").width(width)
    };
    let others = headings.into_iter().map(column);
    Table::new(caption, first.iter().cloned().chain(others).collect())
}

/// No number: the method is not for it.
fn none() -> CellText {
    CellText::text("-")
}

impl<'a> Tables<'a> {
    pub(super) fn new(of: &'a SuitePage<'a>) -> Self {
        Self {
            of,
            scenarios: of.suite.scenarios().collect(),
        }
    }

    /// How many of the scenarios that are chosen a method is for, and its score there; `None` without any.
    fn score(
        &self,
        method: &MethodResults,
        chosen: impl Fn(&Scenario) -> bool,
    ) -> Option<(usize, Score)> {
        let both = self.scenarios.iter().copied().zip(&method.scenarios);
        let both: Vec<(&Scenario, &ScenarioResults)> = both
            .filter(|(scenario, of)| chosen(scenario) && of.has_runs())
            .collect();
        (!both.is_empty()).then(|| (both.len(), score(&both)))
    }

    /// Each method over all scenarios, with its times if they were measured.
    pub(super) fn scores(&self) -> Table {
        let mut columns = vec![
            Column::text("method").width(15),
            Column::number("lost", "%").width(8),
            Column::number("typical", "").width(9),
            Column::number("worst", "").width(9),
            Column::text("near").width(8),
        ];
        // Responses of the open division have no intervals.
        let is_covered = !self.of.suite.division.is_open();
        if is_covered {
            columns.push(Column::number("cover", "%").width(7));
        }
        columns.push(Column::number("FIT", "%").width(8));
        if self.of.times.is_some() {
            columns.push(Column::number("time", "").width(8));
        }
        let caption = match self.of.suite.division {
            Division::Closed | Division::Orders | Division::Structure => {
                "Each method over the scenarios that it is for, weighted equally"
            }
            Division::Open => {
                "Each method that chooses its order, weighted equally; d is that of the response"
            }
        };
        let mut caption = format!(
            "{caption}. typical, worst: efficiency of a median run and of the worst tenth; near: scenarios in which \
             the typical one is at least {NEAR}, of those it is for"
        );
        if is_covered {
            caption += "; cover: of 95 % intervals";
        }
        if self.of.times.is_some() {
            let _ = write!(caption, "; time: that of {REFERENCE} is 1");
        }
        let mut table = Table::new(caption, columns);
        for method in self.of.methods {
            let Some((count, score)) = self.score(method, |_| true) else {
                continue;
            };
            let mut name = method.method.clone();
            if score.is_below {
                name += " (below the bound)";
            }
            let [typical, worst] = score.efficiency;
            let coverage = score.coverage.map_or_else(none, |of| cell(of, 100.0));
            let row = [
                CellText::text(name),
                cell(score.lost, 100.0),
                efficient(typical),
                efficient(worst),
                CellText::text(format!("{} of {count}", score.near)),
            ];
            let coverage = is_covered.then_some(coverage);
            let rest = coverage.into_iter().chain([cell(score.fit, 1.0)]);
            table.row(row.into_iter().chain(rest).chain(self.time(method)));
        }
        table
    }

    /// Whether some method is below the bound.
    pub(super) fn has_below(&self) -> bool {
        let mut scores = self.of.methods.iter();
        scores.any(|of| self.score(of, |_| true).is_some_and(|(_, of)| of.is_below))
    }

    /// The cell of a method's time over that of the reference; `None` if no times were measured.
    fn time(&self, method: &MethodResults) -> Option<CellText> {
        let times = self.of.times?;
        let both = self.scenarios.iter().zip(&method.scenarios);
        let own = both
            .filter(|(_, of)| of.has_runs())
            .map(|(scenario, _)| *scenario);
        let own = times.of(&method.method, own);
        Some(own.map_or_else(none, |own| cell(own.typical(), 1.0)))
    }

    /// The newcomer beside each other method, on the same records.
    pub(super) fn against(&self) -> Option<Table> {
        let newcomer = self.of.newcomer?;
        let is_it = |method: &&MethodResults| method.method == newcomer;
        let own = self.of.methods.iter().find(is_it)?;
        let columns = vec![
            Column::text("beside").width(15),
            Column::number("nearer", "%").width(10),
            Column::number("tie", "%").width(7),
            Column::number("farther", "%").width(11),
            Column::number("nearer - farther", "%").width(20),
        ];
        let caption = format!(
            "{newcomer} beside each method on the same records: in how many runs it is nearer to the truth"
        );
        let mut table = Table::new(caption, columns);
        for other in self.of.methods.iter().filter(|method| !is_it(method)) {
            let Some(found) = paired(own, other) else {
                continue;
            };
            let percent =
                |share: f64| CellText::number(format!("{:.1}", 100.0 * share), 100.0 * share);
            table.row([
                CellText::text(other.method.clone()),
                percent(found.win),
                percent(found.tie),
                percent(found.loss),
                cell(found.lead, 100.0),
            ]);
        }
        Some(table)
    }

    /// The difficulties, with the names of the scenarios. Words of the same scenarios stand together.
    fn groups(&self) -> Vec<(String, BTreeSet<&str>)> {
        let mut groups: Vec<(String, BTreeSet<&str>)> = Vec::new();
        for word in self.of.suite.difficulties() {
            let of = self.scenarios.iter().filter(|of| of.hard.contains(&word));
            let members: BTreeSet<&str> = of.map(|of| of.name.as_str()).collect();
            match groups.iter_mut().find(|(_, others)| *others == members) {
                Some((words, _)) => {
                    let _ = write!(words, ", {word}");
                }
                None => groups.push((word, members)),
            }
        }
        groups
    }

    /// Each method in the scenarios of each difficulty: efficiency of a typical run, and lost runs.
    pub(super) fn difficulties(&self) -> Vec<Table> {
        let groups = self.groups();
        type Number = fn(&Score) -> CellText;
        let kinds: [(&str, Number); 2] = [
            ("Efficiency of a typical run, by what is hard", |of| {
                efficient(of.efficiency[0])
            }),
            ("Lost runs, %, by what is hard", |of| cell(of.lost, 100.0)),
        ];
        let tables = kinds.into_iter().map(|(caption, number)| {
            let headings = groups
                .iter()
                .map(|(of, members)| format!("{of} ({})", members.len()));
            let mut table =
                with_headings(caption, &[Column::text("method").width(15)], headings, 9);
            for method in self.of.methods {
                let numbers = groups.iter().map(|(_, members)| {
                    let score = self.score(method, |of| members.contains(of.name.as_str()));
                    score.map_or_else(none, |(_, score)| number(&score))
                });
                let name = CellText::text(method.method.clone());
                table.row([name].into_iter().chain(numbers));
            }
            table
        });
        tables.collect()
    }

    /// Why runs were lost, in per cent of all runs of a method; `None` if results do not say, as where only the first
    /// trials of a scenario are taken.
    pub(super) fn reasons(&self) -> Option<Table> {
        let mut words: Vec<&str> = Vec::new();
        let runs =
            |of: &MethodResults| of.scenarios.iter().map(|of| of.d.len() as u64).sum::<u64>();
        let told = |of: &MethodResults| -> u64 {
            let scenarios = of.scenarios.iter().flat_map(|of| of.lost.values());
            scenarios.sum()
        };
        let lost = |of: &MethodResults| {
            of.scenarios
                .iter()
                .map(|of| of.lost_runs() as u64)
                .sum::<u64>()
        };
        if self.of.methods.iter().any(|of| told(of) != lost(of)) {
            return None;
        }
        for scenario in self.of.methods.iter().flat_map(|of| &of.scenarios) {
            for word in scenario.lost.keys() {
                if !words.contains(&word.as_str()) {
                    words.push(word);
                }
            }
        }
        words.sort_unstable();
        let caption = "Why runs were lost, % of the runs of a method";
        let first = [Column::text("method").width(15)];
        let mut table = with_headings(caption, &first, words.iter().copied(), 6);
        for method in self.of.methods.iter().filter(|of| lost(of) > 0) {
            let shares = words.iter().map(|word| {
                let own = method.scenarios.iter().filter_map(|of| of.lost.get(*word));
                let share = 100.0 * own.sum::<u64>() as f64 / runs(method) as f64;
                if share > 0.0 {
                    CellText::number(format!("{share:.1}"), share)
                } else {
                    none()
                }
            });
            let name = CellText::text(method.method.clone());
            table.row([name].into_iter().chain(shares));
        }
        (!words.is_empty()).then_some(table)
    }

    /// The scenarios.
    pub(super) fn scenarios(&self) -> Table {
        let columns = vec![
            Column::text("scenario").width(18),
            Column::text("system").width(40),
            Column::number("p", "").width(3),
            Column::number("law", "").width(9),
            Column::text("content").width(17),
            Column::text("what is hard"),
        ];
        let mut table = Table::new(
            format!(
                "The scenarios, each with the checksum of what it is. law: the efficiency of {IDEAL}, 1 where the \
                 record is long enough for the law of d"
            ),
            columns,
        );
        let truth = self.of.methods.iter().find(|of| of.method == IDEAL);
        let mut place = 0..;
        for study in &self.of.suite.studies {
            for scenario in &study.scenarios {
                let own = place.next().zip(truth);
                let own = own.map(|(place, truth)| &truth.scenarios[place]);
                let law = own
                    .filter(|of| of.has_runs())
                    .map_or_else(none, |of| efficient(efficiency(scenario, of, VALUES[0])));
                table.row([
                    self.linked(&study.name, &scenario.name),
                    CellText::text(study.file().title.clone()),
                    CellText::number(scenario.free.to_string(), scenario.free as f64),
                    law,
                    CellText::text(scenario.content.clone()),
                    CellText::text(scenario.hard.join(", ")),
                ]);
            }
        }
        table
    }

    fn linked(&self, study: &str, scenario: &str) -> CellText {
        let name = CellText::text(scenario);
        if self.of.has_studies {
            return name.link(format!("studies/{study}/report.html"));
        }
        name
    }

    /// The efficiency of a typical run of each method in each scenario.
    pub(super) fn efficiencies(&self) -> Vec<Table> {
        let groups = self.of.methods.chunks(BESIDE);
        let tables = groups.map(|methods| {
            let names: Vec<&str> = methods.iter().map(|of| of.method.as_str()).collect();
            let listed = names.join(", ");
            let caption = format!("Efficiency of a typical run in each scenario: {listed}");
            let mut table = with_headings(caption, &[Column::text("scenario").width(18)], names, 8);
            let studies = self.of.suite.studies.iter();
            let named =
                studies.flat_map(|study| study.scenarios.iter().map(|of| (&study.name, of)));
            for (i, (study, scenario)) in named.enumerate() {
                let numbers = methods.iter().map(|method| {
                    let results = &method.scenarios[i];
                    if !results.has_runs() {
                        return none();
                    }
                    let number = efficient(efficiency(scenario, results, VALUES[0]));
                    let lost = results.lost_runs();
                    let is_here = self.of.has_studies
                        && self.of.newcomer.is_none_or(|name| name == method.method);
                    if method.method == IDEAL || !is_here || lost == results.d.len() {
                        return number;
                    }
                    number.link(format!("studies/{study}/report.html"))
                });
                let first = self.linked(study, &scenario.name);
                table.row([first].into_iter().chain(numbers));
            }
            table
        });
        tables.collect()
    }
}

/// The FIT of each method on each recorded file over the samples that it has not seen: simulated, and one step ahead.
pub fn recorded(fits: &RecordedFits) -> Vec<Table> {
    let kinds = [
        "FIT on recorded data, %, simulated over the samples that were not used",
        "FIT on recorded data, %, predicted one step ahead over the samples that were not used",
    ];
    let tables = kinds.into_iter().enumerate().map(|(place, caption)| {
        let first = [
            Column::text("record").width(26),
            Column::number("samples", "").width(8),
            Column::number("used", "").width(5),
        ];
        let mut table = with_headings(caption, &first, &fits.methods, 6);
        for record in &fits.records {
            let [samples, first] = record.samples;
            let numbers = record.fits.iter().map(|fit| {
                fit.map_or_else(none, |fit| {
                    let fit = fit[place];
                    let text = if fit < LEAST_FIT {
                        format!("< {LEAST_FIT}")
                    } else {
                        format!("{fit:.1}")
                    };
                    CellText::number(text, fit)
                })
            });
            let head = [
                CellText::text(record.file.clone()),
                CellText::number(samples.to_string(), samples as f64),
                CellText::number(first.to_string(), first as f64),
            ];
            table.row(head.into_iter().chain(numbers));
        }
        table
    });
    tables.collect()
}
