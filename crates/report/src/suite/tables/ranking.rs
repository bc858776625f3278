//! The tables that rank methods: over all scenarios, in those that they are for, and by difficulty.

use super::{SuiteTable, Tables, beside, cell, count, efficient, none, percent, with_headings};
use crate::table::{CellText, Column, Table};
use asobench_study::suite::{Division, IDEAL, MethodResults, ScenarioResults, Score, ranks, score};
use std::collections::BTreeSet;
use std::fmt::Write as _;

impl Tables<'_> {
    /// The methods that are for every scenario, by their relative efficiency; the first so many.
    pub(in crate::suite) fn ranking(&self, most: usize) -> SuiteTable {
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
            "Methods over the same scenarios ({}), by relative efficiency: 1 is the Cramer-Rao bound, 0 a quantile \
             that is lost",
            all.members.len()
        );
        if most < ranked.len() {
            let _ = write!(caption, "; the first {most} of {}", ranked.len());
        }
        if let Some((over, score)) = self.yardstick() {
            let [median, tenth] = score.efficiency.map(|of| efficient(of).text);
            let _ = write!(
                caption,
                ". The ideal {IDEAL}, told the structure and started at the truth, has a median of {median} and \
                 {tenth} at 90 % over {over} scenarios"
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
        self.table("ranking", "The reference suite", table)
    }

    /// The places of each method by scenario, by plant and in the bank; `None` in an edition without a bank.
    pub(in crate::suite) fn places(&self) -> Option<SuiteTable> {
        let suite = self.of.suite;
        if !suite.scenarios().any(|of| of.is_bank) {
            return None;
        }
        let mut columns = vec![Column::text("method").width(15)];
        for by in ["scenario", "plant", "bank"] {
            columns.push(Column::number(format!("by {by}"), "").width(11));
            columns.push(Column::number("place", "").width(5));
        }
        let mut table = Table::new(
            "Median relative efficiency, and the place by it, of the methods that are for every scenario: published \
             scenarios of equal weight, published plants of equal weight, the plants of the bank",
            columns,
        );
        let mut all = ranks(suite, self.of.methods);
        all.sort_by_key(|of| of.place[1]);
        for of in all {
            let both = of.efficiency.into_iter().zip(of.place);
            let numbers =
                both.flat_map(|(value, place)| [CellText::number(format!("{value:.2}"), value), count(place)]);
            table.row([CellText::text(of.method.clone())].into_iter().chain(numbers));
        }
        self.table("places", "Places by scenario, plant and bank", table)
            .unless_empty()
    }

    /// The score of the yardstick, and over how many scenarios.
    fn yardstick(&self) -> Option<(usize, &Score)> {
        let place = self.of.methods.iter().position(|of| of.method == IDEAL)?;
        let own = self.of.methods[place].scenarios.iter();
        let over = own.filter(|of| of.has_runs()).count();
        Some((over, self.groups[0].scores[place].as_ref()?))
    }

    /// Whether some method is below the bound.
    pub(in crate::suite) fn has_below(&self) -> bool {
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
    pub(in crate::suite) fn partial(&self) -> Option<SuiteTable> {
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
        for (method, found) in both {
            let is_there = ranked.iter().any(|(of, _)| of.method == method.method);
            let is_other = !is_there && method.method != IDEAL;
            let Some(own) = found.as_ref().filter(|_| is_other) else {
                continue;
            };
            let there: Vec<usize> = (0..self.scenarios.len())
                .filter(|i| method.scenarios[*i].has_runs())
                .collect();
            let others = ranked.iter().map(|(other, _)| {
                let both = there.iter();
                let both: Vec<_> = both.map(|i| (self.scenarios[*i], &other.scenarios[*i])).collect();
                (other, score(&both).efficiency[0])
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
        self.table("partial", "Methods for some scenarios", table)
            .unless_empty()
    }

    /// The best three methods of each difficulty.
    pub(in crate::suite) fn best(&self) -> Option<SuiteTable> {
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
        self.table("best", "The best of each difficulty", table).unless_empty()
    }

    /// Each method in the scenarios of each difficulty: efficiency of the median run, and failure rate.
    pub(in crate::suite) fn difficulties(&self) -> Vec<SuiteTable> {
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
            self.table(name, title, table)
        });
        tables.collect()
    }

    /// Why runs were lost, in per cent of all runs of a method. Without the methods whose results do not say it, as
    /// where only the first trials of a scenario are taken.
    pub(in crate::suite) fn reasons(&self) -> Option<SuiteTable> {
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
        self.table("reasons", "Why runs were lost", table).unless_empty()
    }
}
