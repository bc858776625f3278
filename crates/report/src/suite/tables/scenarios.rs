//! The tables of scenarios, with the efficiency of each method there, and the FIT of recorded data.

use super::{NOISES, SuiteTable, Tables, cell, count, efficient, noise_model, none, with_headings};
use crate::table::{CellText, Column, Table};
use asobench_study::suite::{IDEAL, Law, RecordedFits, VALUES, efficiency};
use asobench_study::text::grouped;

/// Methods beside each other in a table of scenarios.
const BESIDE: usize = 7;
/// A lower FIT is not told apart: the model explains nothing.
const LEAST_FIT: f64 = -100.0;

impl Tables<'_> {
    /// The scenarios.
    pub(in crate::suite) fn scenarios(&self) -> SuiteTable {
        let columns = vec![
            Column::text("scenario").width(18),
            Column::text("system").width(40),
            Column::number("p", "").width(3),
            Column::text("noise model").width(11),
            Column::number("yardstick", "").width(9),
            Column::number("mean d", "").width(8),
            Column::text("law of d").width(13),
            Column::text("what is hard").width(20),
            Column::text("checksum"),
        ];
        let mut table = Table::new(
            format!(
                "The scenarios, each with the checksum of what it is. yardstick: the relative efficiency of {IDEAL} \
                 there, 1 where the record is long enough for the law of d{}",
                self.of.laws.map_or_else(String::new, |laws| format!(
                    "; mean d, law of d: the mean of its d in {} runs of their own, and whether that is 0.9 to 1.1 and \
                     d has the law of an efficient method (Kolmogorov's test, corrected over all scenarios); undecided \
                     where the mean is not known to 0.05",
                    grouped(laws.runs)
                ))
            ),
            columns,
        );
        let truth = self.of.methods.iter().find(|of| of.method == IDEAL);
        let mut place = 0..;
        for study in &self.of.suite.studies {
            for scenario in &study.scenarios {
                let own = place.next().zip(truth);
                let own = own.map(|(place, truth)| &truth.scenarios[place]);
                let yardstick = own
                    .filter(|of| of.has_runs())
                    .map_or_else(none, |of| efficient(efficiency(scenario, of, VALUES[0])));
                let law = self.of.laws.and_then(|laws| laws.of(scenario));
                let hard = scenario.hard.iter().map(String::as_str);
                let hard: Vec<&str> = hard.filter(|word| !NOISES.contains(word)).collect();
                table.row([
                    self.linked(&study.name, &scenario.name),
                    CellText::text(study.file().title.clone()),
                    count(scenario.free),
                    CellText::text(noise_model(scenario)),
                    yardstick,
                    law.map_or_else(none, |law| cell(law.mean(), 1.0)),
                    CellText::text(law.map_or("-", Law::verdict)),
                    CellText::text(hard.join(", ")),
                    CellText::text(scenario.content.clone()),
                ]);
            }
        }
        self.table("scenarios", "The scenarios", table)
    }

    fn linked(&self, study: &str, scenario: &str) -> CellText {
        let name = CellText::text(scenario);
        if self.of.has_studies {
            return name.link(format!("studies/{study}/report.html"));
        }
        name
    }

    /// The efficiency of the median run of each method in each scenario.
    pub(in crate::suite) fn efficiencies(&self) -> Vec<SuiteTable> {
        let groups = self.of.methods.chunks(BESIDE).zip(1..);
        let tables = groups.map(|(methods, number)| {
            let names: Vec<&str> = methods.iter().map(|of| of.method.as_str()).collect();
            let listed = names.join(", ");
            let caption = format!("Relative efficiency of the median run in each scenario: {listed}");
            let first = [
                Column::text("scenario").width(18),
                Column::text("noise model").width(11),
            ];
            let mut table = with_headings(caption, &first, names, 8);
            let studies = self.of.suite.studies.iter();
            let named = studies.flat_map(|study| study.scenarios.iter().map(|of| (&study.name, of)));
            for (i, (study, scenario)) in named.enumerate() {
                let numbers = methods.iter().map(|method| {
                    let results = &method.scenarios[i];
                    if !results.has_runs() {
                        return none();
                    }
                    let number = efficient(efficiency(scenario, results, VALUES[0]));
                    let lost = results.lost_runs();
                    let is_here = self.of.has_studies && self.of.newcomer.is_none_or(|name| name == method.method);
                    if method.method == IDEAL || !is_here || lost == results.d.len() {
                        return number;
                    }
                    number.link(format!("studies/{study}/report.html"))
                });
                let first = [
                    self.linked(study, &scenario.name),
                    CellText::text(noise_model(scenario)),
                ];
                table.row(first.into_iter().chain(numbers));
            }
            let name = format!("by-scenario-{number}");
            self.table(&name, "Relative efficiency in each scenario", table)
        });
        tables.collect()
    }
}

/// The FIT of each method on each recorded file over the samples that it has not seen: simulated, and one step ahead.
pub fn recorded(fits: &RecordedFits) -> Vec<SuiteTable> {
    let kinds = [
        (
            "recorded-simulated",
            "FIT on recorded data, %, simulated over the samples that were not used",
        ),
        (
            "recorded-predicted",
            "FIT on recorded data, %, predicted one step ahead over the samples that were not used",
        ),
    ];
    let tables = kinds.into_iter().enumerate().map(|(place, (name, caption))| {
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
            let head = [CellText::text(record.file.clone()), count(samples), count(first)];
            table.row(head.into_iter().chain(numbers));
        }
        SuiteTable {
            name: name.to_owned(),
            title: "Recorded data".to_owned(),
            table,
        }
    });
    tables.collect()
}
