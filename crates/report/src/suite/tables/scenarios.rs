//! The tables of scenarios, with the efficiency of each method there, and the FIT of recorded data.

use super::{NOISES, SuiteTable, Tables, cell, count, efficient, headed, noise_model, none};
use crate::document::columns::Columns;
use crate::table::{CellText, Column};
use asobench_study::suite::{IDEAL, RecordedFits, Scenario, SuiteStudy, VALUES, efficiency};
use asobench_study::text::grouped;

/// Methods beside each other in a table of scenarios.
const BESIDE: usize = 7;
/// A lower FIT is not told apart: the model explains nothing.
const LEAST_FIT: f64 = -100.0;

impl Tables<'_> {
    /// Every scenario with its place and its study.
    fn placed(&self) -> impl Iterator<Item = (usize, &SuiteStudy, &Scenario)> {
        let studies = self.of.suite.studies.iter();
        let all = studies.flat_map(|study| study.scenarios.iter().map(move |of| (study, of)));
        all.enumerate().map(|(place, (study, of))| (place, study, of))
    }

    /// The scenarios.
    pub(in crate::suite) fn scenarios(&self) -> SuiteTable {
        let truth = self.of.methods.iter().find(|of| of.method == IDEAL);
        let law = |scenario| self.of.laws.and_then(|laws| laws.of(scenario));
        let of_laws = self.of.laws.map_or_else(String::new, |laws| {
            format!(
                "; mean d, law of d: the mean of its d in {} runs of their own, and whether that is 0.9 to 1.1 and d \
                 has the law of an efficient method (Kolmogorov's test, corrected over all scenarios); undecided where \
                 the mean is not known to 0.05",
                grouped(laws.runs)
            )
        });
        let table = Columns::new(self.placed())
            .with(Column::text("scenario").width(18), |of| self.linked(of.1, of.2))
            .with(Column::text("system").width(40), |of| &of.1.file().title)
            .with(Column::number("p", "").width(3), |of| count(of.2.free))
            .with(Column::text("noise model").width(11), |of| noise_model(of.2))
            .with(Column::number("yardstick", "").width(9), |(place, _, of)| {
                let own = truth.map(|truth| &truth.scenarios[*place]);
                let own = own.filter(|own| own.has_runs());
                own.map_or_else(none, |own| efficient(efficiency(of, own, VALUES[0])))
            })
            .with(Column::number("mean d", "").width(8), |of| {
                law(of.2).map_or_else(none, |law| cell(law.mean(), 1.0))
            })
            .with(Column::text("law of d").width(13), |of| {
                law(of.2).map_or("-", |law| law.verdict().name())
            })
            .with(Column::text("what is hard").width(20), |of| {
                let words = of.2.hard.iter().map(String::as_str);
                let hard: Vec<&str> = words.filter(|word| !NOISES.contains(word)).collect();
                hard.join(", ")
            })
            .text("checksum", |of| &of.2.content)
            .whole(format!(
                "The scenarios, each with the checksum of what it is. yardstick: the relative efficiency of {IDEAL} \
                 there, 1 where the record is long enough for the law of d{of_laws}"
            ));
        self.table("scenarios", "The scenarios", table)
    }

    fn linked(&self, study: &SuiteStudy, scenario: &Scenario) -> CellText {
        let name = CellText::text(&scenario.name);
        if self.of.has_studies {
            return name.link(page_of(study));
        }
        name
    }

    /// The efficiency of the median run of each method in each scenario.
    pub(in crate::suite) fn efficiencies(&self) -> Vec<SuiteTable> {
        let groups = self.of.methods.chunks(BESIDE).zip(1..);
        let tables = groups.map(|(methods, number)| {
            let mut columns = Columns::new(self.placed())
                .with(Column::text("scenario").width(18), |of| self.linked(of.1, of.2))
                .with(Column::text("noise model").width(11), |of| noise_model(of.2));
            for method in methods {
                columns = columns.with(headed(&method.method, 8), |(place, study, of)| {
                    let results = &method.scenarios[*place];
                    if !results.has_runs() {
                        return none();
                    }
                    let number = efficient(efficiency(of, results, VALUES[0]));
                    let is_here = self.of.has_studies && self.of.newcomer.is_none_or(|name| name == method.method);
                    if method.method == IDEAL || !is_here || results.lost_runs() == results.d.len() {
                        return number;
                    }
                    number.link(page_of(study))
                });
            }
            let names: Vec<&str> = methods.iter().map(|of| of.method.as_str()).collect();
            let table = columns.whole(format!(
                "Relative efficiency of the median run in each scenario: {}",
                names.join(", ")
            ));
            let name = format!("by-scenario-{number}");
            self.table(&name, "Relative efficiency in each scenario", table)
        });
        tables.collect()
    }
}

/// The report of a study beside the page.
fn page_of(study: &SuiteStudy) -> String {
    format!("studies/{}/report.html", study.name)
}

/// The FIT of each method on each recorded file over the samples that it has not seen: simulated, and one step ahead.
pub fn recorded(fits: &RecordedFits) -> Vec<SuiteTable> {
    let kinds = [
        ("recorded-simulated", "simulated"),
        ("recorded-predicted", "predicted one step ahead"),
    ];
    let tables = kinds.into_iter().enumerate().map(|(place, (name, how))| {
        let mut columns = Columns::new(fits.records.iter())
            .with(Column::text("record").width(26), |of| &of.file)
            .with(Column::number("samples", "").width(8), |of| count(of.samples[0]))
            .with(Column::number("used", "").width(5), |of| count(of.samples[1]));
        for (i, method) in fits.methods.iter().enumerate() {
            columns = columns.with(headed(method, 6), move |of| {
                of.fits[i].map_or_else(none, |fit| match fit[place] {
                    fit if fit < LEAST_FIT => CellText::number(format!("< {LEAST_FIT}"), fit),
                    fit => CellText::number(format!("{fit:.1}"), fit),
                })
            });
        }
        SuiteTable {
            name: name.to_owned(),
            title: "Recorded data".to_owned(),
            table: columns.whole(format!(
                "FIT on recorded data, %, {how} over the samples that were not used"
            )),
        }
    });
    tables.collect()
}
