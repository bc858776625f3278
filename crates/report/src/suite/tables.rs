//! The tables of the suite's page, each with the name of its files.

use super::subject::SuitePage;
use crate::table::{CellText, Column, Table};
use asobench_identification::number::uncertain_within;
use asobench_study::suite::{
    ARCHIVE, Division, Estimated, IDEAL, MethodResults, RecordedFits, Scenario, ScenarioResults, Score, VALUES,
    efficiency, paired, score,
};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Methods beside each other in a table of scenarios.
const BESIDE: usize = 7;
/// Digits of a number.
const DIGITS: i32 = 4;
/// Efficiencies below it are not told apart.
const LEAST: f64 = 0.001;
/// A lower FIT is not told apart: the model explains nothing.
const LEAST_FIT: f64 = -100.0;
/// So many standard errors make a difference of two methods certain.
const CERTAIN: f64 = 4.0;
/// A claim names at most so many methods that are not told apart from the best.
const ALIKE: usize = 2;
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
    pub title: &'static str,
    /// The table.
    pub table: Table,
}

impl SuiteTable {
    fn new(name: impl Into<String>, title: &'static str, table: Table) -> Self {
        let name = name.into();
        Self { name, title, table }
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
    of: &'a SuitePage<'a>,
    scenarios: Vec<&'a Scenario>,
    /// All scenarios, then those of each difficulty.
    groups: Vec<Group>,
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

fn percent(share: f64) -> CellText {
    CellText::number(format!("{:.1}", 100.0 * share), 100.0 * share)
}

fn count(number: usize) -> CellText {
    CellText::number(number.to_string(), number as f64)
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

/// What a reason for a lost run means; `None` for a failure whose name says it.
pub fn about_loss(reason: &str) -> Option<&'static str> {
    Some(match reason {
        "other orders" => "a model of a larger order than the method was told",
        "declined" => "the method cannot serve the scenario",
        "boundary" | "iteration-limit" => "the search came to no minimum",
        "unstable" => "a pole on or outside the unit circle",
        "crashed" => "the program ended before it answered",
        "timeout" => "no answer within the method's timeout",
        "malformed" => "an answer that docs/protocol.md does not allow",
        _ => return None,
    })
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
        all.extend(self.difficulties());
        all.extend(self.reasons());
        all.push(self.scenarios());
        all.extend(self.efficiencies());
        all.extend(self.contributed());
        all
    }

    /// The name of a table's files: with a word in the open division, whose page is that of the closed one.
    fn file(&self, name: &str) -> String {
        if self.of.suite.division == Division::Open {
            format!("choosing-{name}")
        } else {
            name.to_owned()
        }
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

    /// The methods that are for every scenario, by their relative efficiency; the first so many.
    pub(super) fn ranking(&self, most: usize) -> SuiteTable {
        let all = &self.groups[0];
        let is_timed = self.of.times.is_some();
        // Responses of the open division have no intervals.
        let is_covered = self.of.suite.division != Division::Open;
        let mut columns = vec![
            Column::text("method").width(15),
            Column::number("median", "").width(9),
            Column::number("90 %", "").width(9),
            Column::number("failure rate", "%").width(17),
        ];
        if is_covered {
            columns.push(Column::number("coverage", "%").width(13));
        }
        columns.push(Column::number("FIT", "%").width(8));
        if is_timed {
            columns.push(Column::number("time", "").width(8));
        }
        let ranked = self.ranked(all);
        let mut caption = format!(
            "Methods over the same scenarios ({}), by relative efficiency: 1 is the Cramer-Rao bound, 0 says that the \
             run of that quantile is lost",
            all.members.len()
        );
        if most < ranked.len() {
            let _ = write!(caption, "; the first {most} of {}", ranked.len());
        }
        if let Some((over, score)) = self.yardstick() {
            let [median, tenth] = score.efficiency.map(|of| efficient(of).text);
            let _ = write!(
                caption,
                ". {IDEAL}, told the structure and started at the truth, has {median} and {tenth} over {over}"
            );
        }
        let mut table = Table::new(caption, columns);
        for (method, score) in ranked.into_iter().take(most) {
            let mut name = self.named(method);
            if score.is_below {
                name.text += " (below the bound)";
            }
            let [median, tenth] = score.efficiency.map(efficient);
            let coverage = score.coverage.map_or_else(none, |of| cell(of, 100.0));
            let rest = is_covered.then_some(coverage).into_iter();
            let rest = rest.chain([cell(score.fit, 1.0)]).chain(self.time(method));
            let first = [name, median, tenth, cell(score.lost, 100.0)];
            table.row(first.into_iter().chain(rest));
        }
        SuiteTable::new(self.file("ranking"), "The reference suite", table)
    }

    /// The score of the yardstick, and over how many scenarios.
    fn yardstick(&self) -> Option<(usize, &Score)> {
        let place = self.of.methods.iter().position(|of| of.method == IDEAL)?;
        let own = self.of.methods[place].scenarios.iter();
        let over = own.filter(|of| of.has_runs()).count();
        Some((over, self.groups[0].scores[place].as_ref()?))
    }

    /// Whether some method is below the bound.
    pub(super) fn has_below(&self) -> bool {
        let mut scores = self.groups[0].scores.iter().flatten();
        scores.any(|of| of.is_below)
    }

    /// The cell of a method's time over that of the reference; `None` if no times were measured.
    fn time(&self, method: &MethodResults) -> Option<CellText> {
        let times = self.of.times?;
        let both = self.scenarios.iter().zip(&method.scenarios);
        let own = both.filter(|(_, of)| of.has_runs()).map(|(scenario, _)| *scenario);
        let theirs = self.of.contributed.iter().find(|of| of.results.method == method.method);
        let times = theirs.map_or(Some(times), |of| of.times.as_ref());
        let own = times.and_then(|times| times.of(&method.method, own));
        Some(own.map_or_else(none, |own| cell(own.typical(), 1.0)))
    }

    /// The methods that are for some scenarios alone, each beside the best of the others there.
    pub(super) fn partial(&self) -> Option<SuiteTable> {
        let columns = vec![
            Column::text("method").width(15),
            Column::number("scenarios", "").width(9),
            Column::number("median", "").width(9),
            Column::number("90 %", "").width(9),
            Column::number("failure rate", "%").width(17),
            Column::text("the best there of those for all").width(24),
        ];
        let mut table = Table::new(
            "Methods that are for some scenarios alone, which give what they need",
            columns,
        );
        let ranked = self.ranked(&self.groups[0]);
        let both = self.of.methods.iter().zip(&self.groups[0].scores);
        for (method, score) in both {
            let is_there = ranked.iter().any(|(of, _)| of.method == method.method);
            let is_other = !is_there && method.method != IDEAL;
            let Some(own) = score.as_ref().filter(|_| is_other) else {
                continue;
            };
            let there: Vec<usize> = (0..self.scenarios.len())
                .filter(|i| method.scenarios[*i].has_runs())
                .collect();
            let others = ranked.iter().map(|(other, _)| {
                let both = there.iter();
                let both: Vec<_> = both.map(|i| (self.scenarios[*i], &other.scenarios[*i])).collect();
                (other, score_of(&both))
            });
            let best = others.max_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
            let [median, tenth] = own.efficiency.map(efficient);
            table.row([
                self.named(method),
                count(there.len()),
                median,
                tenth,
                cell(own.lost, 100.0),
                best.map_or_else(none, |(other, of)| beside(other, of)),
            ]);
        }
        let named = SuiteTable::new(self.file("partial"), "Methods for some scenarios", table);
        (!named.table.rows.is_empty()).then_some(named)
    }

    /// The newcomer beside each other method, on the same records.
    pub(super) fn against(&self) -> Option<SuiteTable> {
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
        let caption =
            format!("{newcomer} beside each method on the same records: in how many runs it is nearer to the truth");
        let mut table = Table::new(caption, columns);
        for other in self.of.methods.iter().filter(|method| !is_it(method)) {
            let Some(found) = paired(own, other) else {
                continue;
            };
            table.row([
                CellText::text(other.method.clone()),
                percent(found.win),
                percent(found.tie),
                percent(found.loss),
                cell(found.lead, 100.0),
            ]);
        }
        let title = "The newcomer beside the others";
        Some(SuiteTable::new(self.file("newcomer"), title, table))
    }

    /// Where the newcomer lost runs, and why; `None` without any.
    pub(super) fn own_losses(&self) -> Option<SuiteTable> {
        let newcomer = self.of.newcomer?;
        let own = self.of.methods.iter().find(|of| of.method == newcomer)?;
        let columns = vec![
            Column::text("scenario").width(18),
            Column::number("lost runs", "").width(9),
            Column::text("reason").width(15),
            Column::text("what it means"),
        ];
        let caption = format!("Where {newcomer} lost runs, and why; workers.log of a study has what a program printed");
        let mut table = Table::new(caption, columns);
        for scenario in &own.scenarios {
            for (reason, runs) in &scenario.lost {
                table.row([
                    CellText::text(scenario.name.clone()),
                    CellText::number(runs.to_string(), *runs as f64),
                    CellText::text(reason.clone()),
                    CellText::text(about_loss(reason).unwrap_or("a numerical failure")),
                ]);
            }
        }
        let named = SuiteTable::new(self.file("lost"), "Lost runs of the newcomer", table);
        (!named.table.rows.is_empty()).then_some(named)
    }

    /// The best three methods of each difficulty.
    pub(super) fn best(&self) -> Option<SuiteTable> {
        let mut columns = vec![
            Column::text("what is hard").width(24),
            Column::number("scenarios", "").width(9),
        ];
        columns.extend(["first", "second", "third"].map(|of| Column::text(of).width(24)));
        let caption = "The best three methods of each difficulty, by the median relative efficiency, of those that \
                       are for all its scenarios. Methods with the same numbers stand once";
        let mut table = Table::new(caption, columns);
        for group in &self.groups[1..] {
            let ranked = self.distinct(group);
            let best = ranked.iter().take(3);
            let best = best.map(|(method, score)| beside(method, score.efficiency[0]));
            let first = [CellText::text(group.words.clone()), count(group.members.len())];
            table.row(first.into_iter().chain(best));
        }
        let named = SuiteTable::new(self.file("best"), "The best of each difficulty", table);
        (!named.table.rows.is_empty()).then_some(named)
    }

    /// Which method to use when, where that is certain.
    pub(super) fn claims(&self) -> Vec<String> {
        self.groups.iter().filter_map(|of| self.claim(of)).collect()
    }

    /// The claim of a group: its first method is certainly nearer to the truth, run by run on the same records, than
    /// all others but [`ALIKE`], and certainly farther than none.
    fn claim(&self, group: &Group) -> Option<String> {
        let ranked = self.distinct(group);
        let ((first, score), others) = ranked.split_first()?;
        let mut alike = Vec::new();
        for (other, _) in others {
            let lead = lead(first, other, &group.members);
            if lead < -CERTAIN {
                return None;
            }
            if lead <= CERTAIN {
                alike.push(format!("`{}`", other.method));
            }
        }
        let behind = others.len() - alike.len();
        if alike.len() > ALIKE || behind == 0 {
            return None;
        }
        let when = match group.words.as_str() {
            "all" => "Over all scenarios".to_owned(),
            words if NOISES.contains(&words) => format!("Where the noise model is {words}"),
            words => format!("Where the difficulty is {words}"),
        };
        let not_told_apart = if alike.is_empty() {
            String::new()
        } else {
            format!(" (or {}, not told apart from it)", alike.join(" or "))
        };
        let others = if alike.is_empty() { "" } else { " other" };
        Some(format!(
            "{when}, use `{}`{not_told_apart}: efficiency {}, certainly nearer to the truth than {behind}{others} \
             methods.",
            first.method,
            efficient(score.efficiency[0]).text
        ))
    }

    /// Each method in the scenarios of each difficulty: efficiency of the median run, and failure rate.
    pub(super) fn difficulties(&self) -> Vec<SuiteTable> {
        type Number = fn(&Score) -> CellText;
        let kinds: [(&str, &str, &str, Number); 2] = [
            (
                "efficiency-by-difficulty",
                "Relative efficiency by difficulty",
                "Relative efficiency of the median run, by what is hard",
                |of| efficient(of.efficiency[0]),
            ),
            (
                "failures-by-difficulty",
                "Failure rates by difficulty",
                "Failure rate, %, by what is hard",
                |of| cell(of.lost, 100.0),
            ),
        ];
        let tables = kinds.into_iter().map(|(name, title, caption, number)| {
            let headings = self.groups.iter();
            let headings = headings.map(|of| format!("{} ({})", of.words, of.members.len()));
            let first = [Column::text("method").width(15)];
            let mut table = with_headings(caption, &first, headings, 9);
            for (place, method) in self.of.methods.iter().enumerate() {
                let scores = self.groups.iter().map(|group| &group.scores[place]);
                let numbers = scores.map(|score| score.as_ref().map_or_else(none, number));
                table.row([self.named(method)].into_iter().chain(numbers));
            }
            SuiteTable::new(self.file(name), title, table)
        });
        tables.collect()
    }

    /// Why runs were lost, in per cent of all runs of a method. Without the methods whose results do not say it, as
    /// where only the first trials of a scenario are taken.
    pub(super) fn reasons(&self) -> Option<SuiteTable> {
        let total =
            |of: &MethodResults, number: &dyn Fn(&ScenarioResults) -> u64| of.scenarios.iter().map(number).sum::<u64>();
        let lost = |of: &MethodResults| total(of, &|of| of.lost_runs() as u64);
        let told = |of: &&MethodResults| total(of, &|of| of.lost.values().sum()) == lost(of);
        let methods = self.of.methods.iter().filter(|of| lost(of) > 0);
        let methods: Vec<&MethodResults> = methods.filter(told).collect();
        let scenarios = methods.iter().flat_map(|of| &of.scenarios);
        let words: BTreeSet<&str> = scenarios.flat_map(|of| of.lost.keys().map(String::as_str)).collect();
        let caption = "Why runs were lost, % of the runs of a method";
        let first = [
            Column::text("method").width(15),
            Column::number("failure rate", "%").width(16),
        ];
        let mut table = with_headings(caption, &first, words.iter().copied(), 6);
        for method in methods {
            let runs = total(method, &|of| of.d.len() as u64) as f64;
            let share = |lost: u64| match lost {
                0 => none(),
                lost => percent(lost as f64 / runs),
            };
            let shares = words.iter().map(|word| {
                let own = |of: &ScenarioResults| of.lost.get(*word).copied().unwrap_or(0);
                share(total(method, &own))
            });
            let first = [self.named(method), share(lost(method))];
            table.row(first.into_iter().chain(shares));
        }
        let named = SuiteTable::new(self.file("reasons"), "Why runs were lost", table);
        (!named.table.rows.is_empty()).then_some(named)
    }

    /// The scenarios.
    pub(super) fn scenarios(&self) -> SuiteTable {
        let columns = vec![
            Column::text("scenario").width(18),
            Column::text("system").width(40),
            Column::number("p", "").width(3),
            Column::text("noise model").width(11),
            Column::number("yardstick", "").width(9),
            Column::text("what is hard").width(20),
            Column::text("checksum"),
        ];
        let mut table = Table::new(
            format!(
                "The scenarios, each with the checksum of what it is. yardstick: the relative efficiency of {IDEAL} \
                 there, 1 where the record is long enough for the law of d"
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
                let hard = scenario.hard.iter().map(String::as_str);
                let hard: Vec<&str> = hard.filter(|word| !NOISES.contains(word)).collect();
                table.row([
                    self.linked(&study.name, &scenario.name),
                    CellText::text(study.file().title.clone()),
                    count(scenario.free),
                    CellText::text(noise_model(scenario)),
                    yardstick,
                    CellText::text(hard.join(", ")),
                    CellText::text(scenario.content.clone()),
                ]);
            }
        }
        SuiteTable::new(self.file("scenarios"), "The scenarios", table)
    }

    fn linked(&self, study: &str, scenario: &str) -> CellText {
        let name = CellText::text(scenario);
        if self.of.has_studies {
            return name.link(format!("studies/{study}/report.html"));
        }
        name
    }

    /// The efficiency of the median run of each method in each scenario.
    pub(super) fn efficiencies(&self) -> Vec<SuiteTable> {
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
            let name = self.file(&format!("by-scenario-{number}"));
            SuiteTable::new(name, "Relative efficiency in each scenario", table)
        });
        tables.collect()
    }

    /// The results of others, and where they are from; `None` without any.
    pub(super) fn contributed(&self) -> Option<SuiteTable> {
        let columns = vec![
            Column::text("method").width(15),
            Column::text("computed by").width(30),
            Column::text("what it is").width(40),
            Column::text("file").width(20),
        ];
        let mut table = Table::new("Results of others, as their files say", columns);
        for of in self.of.contributed {
            table.row([
                CellText::text(of.results.method.clone()),
                CellText::text(of.programs.join(", ")),
                CellText::text(of.method.to_string()),
                CellText::text(of.file()).link(format!("{ARCHIVE}/{}", of.file())),
            ]);
        }
        let named = SuiteTable::new(self.file("contributed"), "Results of others", table);
        (!named.table.rows.is_empty()).then_some(named)
    }
}

/// A method with its efficiency.
fn beside(method: &MethodResults, efficiency: Estimated) -> CellText {
    CellText::text(format!("{} {}", method.method, efficient(efficiency).text))
}

/// The median efficiency over scenarios.
fn score_of(both: &[(&Scenario, &ScenarioResults)]) -> Estimated {
    score(both).efficiency[0]
}

/// The words of a scenario that are its noise model.
fn noise_model(scenario: &Scenario) -> String {
    let words = scenario.hard.iter().map(String::as_str);
    let words: Vec<&str> = words.filter(|word| NOISES.contains(word)).collect();
    words.join(", ")
}

/// In how many runs of some scenarios, which have equal weights, the first method is nearer to the truth than the second
/// one, less in how many it is farther, in standard errors of equal methods (McNemar's, by scenario), so that a few runs
/// are not certain.
fn lead(first: &MethodResults, second: &MethodResults, members: &BTreeSet<usize>) -> f64 {
    let alone = |of: &MethodResults, i: usize| MethodResults {
        scenarios: vec![of.scenarios[i].clone()],
        ..MethodResults::default()
    };
    let (mut sum, mut square) = (0.0, 0.0);
    for i in members.iter().copied() {
        if let Some(found) = paired(&alone(first, i), &alone(second, i)) {
            sum += found.win - found.loss;
            square += (found.win + found.loss) / first.scenarios[i].d.len() as f64;
        }
    }
    if square > 0.0 { sum / square.sqrt() } else { 0.0 }
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
        SuiteTable::new(name, "Recorded data", table)
    });
    tables.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn method(scenarios: &[(usize, f64)]) -> MethodResults {
        let scenarios = scenarios.iter().map(|(runs, d)| ScenarioResults {
            d: vec![Some(*d); *runs],
            ..ScenarioResults::default()
        });
        MethodResults {
            scenarios: scenarios.collect(),
            ..MethodResults::default()
        }
    }

    /// By hand: n wins of n are n / sqrt(n) standard errors of equal methods; with 4 and 16 runs in two scenarios of equal
    /// weight 2 / sqrt(1/4 + 1/16).
    #[test]
    fn a_lead_is_in_errors_of_equal_methods() {
        let near = method(&[(4, 1.0), (16, 1.0)]);
        let far = method(&[(4, 2.0), (16, 3.0)]);
        let of = |members: &[usize]| lead(&near, &far, &members.iter().copied().collect());
        assert_eq!(of(&[1]), 4.0);
        assert_eq!(of(&[0]), 2.0);
        assert!((of(&[0, 1]) - 2.0 / 0.3125_f64.sqrt()).abs() < 1e-12);
        let all = [0, 1].into_iter().collect();
        assert_eq!(lead(&far, &near, &all), -of(&[0, 1]));
        assert_eq!(lead(&near, &near, &all), 0.0);
    }
}
