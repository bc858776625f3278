//! The tables of the suite's page.

use super::subject::SuitePage;
use crate::table::{CellText, Column, Table};
use asobench_identification::number::uncertain_within;
use asobench_study::suite::{
    Division, Estimated, IDEAL, MethodResults, RecordedFits, Scenario, ScenarioResults, Score,
    efficiency, paired, score,
};

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

/// An efficiency. One that is certainly below [`LEAST`] is not told apart from others.
fn efficient(number: Estimated) -> CellText {
    if number.value + 4.0 * number.error < LEAST {
        CellText::number(format!("< {LEAST}"), number.value)
    } else {
        cell(number, 1.0)
    }
}

/// A number of a table, times a factor.
fn cell(number: Estimated, factor: f64) -> CellText {
    let [value, error] = [number.value, number.error].map(|x| factor * x);
    CellText::number(uncertain_within(value, error, DIGITS), value)
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
            Column::number("scenarios", "").width(9),
            Column::number("lost", "%").width(9),
            Column::number("efficiency, typical", "").width(19),
            Column::number("worst tenth", "").width(11),
            Column::number("coverage", "%").width(9),
            Column::number("FIT", "%").width(8),
        ];
        if self.of.times.is_some() {
            columns.push(Column::number("time, of arx", "").width(12));
        }
        let caption = match self.of.suite.division {
            Division::Closed => "Each method over the scenarios that it is for, weighted equally",
            Division::Open => {
                "Each method that chooses its order, over all scenarios, weighted equally; d is that of the response"
            }
        };
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
                CellText::number(count.to_string(), count as f64),
                cell(score.lost, 100.0),
                efficient(typical),
                efficient(worst),
                coverage,
                cell(score.fit, 1.0),
            ];
            table.row(row.into_iter().chain(self.time(method)));
        }
        table
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

    /// Each method in the scenarios of each difficulty: efficiency of a typical run, and lost runs.
    pub(super) fn difficulties(&self) -> Vec<Table> {
        let words = self.of.suite.difficulties();
        type Number = fn(&Score) -> CellText;
        let kinds: [(&str, Number); 2] = [
            ("Efficiency of a typical run, by what is hard", |of| {
                efficient(of.efficiency[0])
            }),
            ("Lost runs, %, by what is hard", |of| cell(of.lost, 100.0)),
        ];
        let tables = kinds.into_iter().map(|(caption, number)| {
            let mut columns = vec![Column::text("method").width(15)];
            columns.extend(words.iter().map(|word| {
                let count = self
                    .scenarios
                    .iter()
                    .filter(|of| of.hard.contains(word))
                    .count();
                Column::number(format!("{word} ({count})"), "").width(word.len().max(9) + 4)
            }));
            let mut table = Table::new(caption, columns);
            for method in self.of.methods {
                let numbers = words.iter().map(|word| {
                    let score = self.score(method, |scenario| scenario.hard.contains(word));
                    score.map_or_else(none, |(_, score)| number(&score))
                });
                let name = CellText::text(method.method.clone());
                table.row([name].into_iter().chain(numbers));
            }
            table
        });
        tables.collect()
    }

    /// Why runs were lost, in per cent of all runs of a method; `None` if results do not say, as where only the first trials
    /// of a scenario are taken.
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
        let mut columns = vec![Column::text("method").width(15)];
        columns.extend(
            words
                .iter()
                .map(|word| Column::number(*word, "").width(word.len().max(6))),
        );
        let mut table = Table::new("Why runs were lost, % of the runs of a method", columns);
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
            Column::text("content").width(17),
            Column::text("what is hard"),
        ];
        let mut table = Table::new(
            "The scenarios, each with the checksum of what it is",
            columns,
        );
        for study in &self.of.suite.studies {
            for scenario in &study.scenarios {
                table.row([
                    self.linked(&study.name, &scenario.name),
                    CellText::text(study.file().title.clone()),
                    CellText::number(scenario.free.to_string(), scenario.free as f64),
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
            let mut columns = vec![Column::text("scenario").width(18)];
            columns.extend(methods.iter().map(|method| {
                Column::number(method.method.clone(), "").width(method.method.len().max(8))
            }));
            let names: Vec<&str> = methods
                .iter()
                .map(|method| method.method.as_str())
                .collect();
            let caption = format!(
                "Efficiency of a typical run in each scenario: {}",
                names.join(", ")
            );
            let mut table = Table::new(caption, columns);
            let studies = self.of.suite.studies.iter();
            let named =
                studies.flat_map(|study| study.scenarios.iter().map(|of| (&study.name, of)));
            for (i, (study, scenario)) in named.enumerate() {
                let numbers = methods.iter().map(|method| {
                    let results = &method.scenarios[i];
                    if !results.has_runs() {
                        return none();
                    }
                    let number = efficient(efficiency(scenario, results, 0.5));
                    let lost = results.lost_runs();
                    if method.method == IDEAL || !self.of.has_studies || lost == results.d.len() {
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
        let mut columns = vec![
            Column::text("record").width(26),
            Column::number("samples", "").width(8),
            Column::number("used", "").width(5),
        ];
        let methods = fits.methods.iter();
        columns
            .extend(methods.map(|name| Column::number(name.clone(), "").width(name.len().max(6))));
        let mut table = Table::new(caption, columns);
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
