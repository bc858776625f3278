//! The tables that rank methods: over all scenarios, in those that they are for, and by difficulty.

use super::{SuiteTable, Tables, beside, cell, count, efficient, headed, none, percent};
use crate::document::columns::Columns;
use crate::table::{CellText, Column};
use asobench_study::suite::{Division, IDEAL, MethodResults, Scenario, ScenarioResults, Score, Times, score, score_by};
use std::collections::BTreeSet;
use std::fmt::Write as _;

impl Tables<'_> {
    /// The methods that are for every scenario, by their relative efficiency; the first so many.
    pub(in crate::suite) fn ranking(&self, most: usize) -> SuiteTable {
        let all = &self.groups[0];
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
        let mut columns = Columns::new(ranked.into_iter().take(most))
            .with(Column::text("method").width(15), |(method, score)| {
                let mut name = self.named(method);
                name.text += if score.is_below { " (below the bound)" } else { "" };
                name
            })
            .with(Column::number("median", "").width(9), |of| {
                efficient(of.1.efficiency[0])
            })
            .with(Column::number("90 %", "").width(9), |of| efficient(of.1.efficiency[1]))
            .with(Column::number("failure rate", "%").width(17), |of| {
                cell(of.1.lost, 100.0)
            });
        // Responses of the open division have no intervals.
        if self.of.suite.division != Division::Open {
            columns = columns.with(Column::number("coverage", "%").width(13), |of| {
                of.1.coverage.map_or_else(none, |of| cell(of, 100.0))
            });
        }
        columns = columns.with(Column::number("FIT", "%").width(8), |of| cell(of.1.fit, 1.0));
        if let Some(times) = self.of.times {
            columns = columns.with(Column::number("time", "").width(8), |of| self.time(times, of.0));
        }
        let table = columns.whole(caption);
        self.table("ranking", "The reference suite", table)
    }

    /// The places of each method by scenario, by plant and in the bank; `None` in an edition without a bank.
    pub(in crate::suite) fn places(&self) -> Option<SuiteTable> {
        let suite = self.of.suite;
        if !suite.scenarios().any(|of| of.is_bank) {
            return None;
        }
        let is_for_all = |of: &&MethodResults| of.method != IDEAL && of.scenarios.iter().all(ScenarioResults::has_runs);
        let all: Vec<&MethodResults> = self.of.methods.iter().filter(is_for_all).collect();
        let typical = |is_bank: bool, weight: fn(&Scenario) -> f64| -> Vec<f64> {
            let of_method = |method: &&MethodResults| {
                let both = suite.scenarios().zip(&method.scenarios);
                let both: Vec<_> = both.filter(|(of, _)| of.is_bank == is_bank).collect();
                if both.is_empty() {
                    0.0
                } else {
                    score_by(&both, weight).efficiency[0].value.min(1.0)
                }
            };
            all.iter().map(of_method).collect()
        };
        let by = [
            ("by scenario", typical(false, |_| 1.0)),
            ("by plant", typical(false, |of| of.weight)),
            ("by bank", typical(true, |of| of.weight)),
        ];
        // The best is 1, and equal ones share a place.
        let place = |of: &[f64], i: usize| 1 + of.iter().filter(|other| **other > of[i]).count();
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by_key(|i| place(&by[1].1, *i));
        let mut columns = Columns::new(order.into_iter()).with(Column::text("method").width(15), |i| &all[*i].method);
        for (title, efficiency) in &by {
            columns = columns
                .with(Column::number(*title, "").width(11), |i| {
                    CellText::number(format!("{:.2}", efficiency[*i]), efficiency[*i])
                })
                .with(Column::number("place", "").width(5), move |i| {
                    count(place(efficiency, *i))
                });
        }
        let table = columns.whole(
            "Median relative efficiency, and the place by it, of the methods that are for every scenario: published \
             scenarios of equal weight, published plants of equal weight, the plants of the bank",
        );
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

    /// The cell of a method's time over that of the reference.
    fn time(&self, times: &Times, method: &MethodResults) -> CellText {
        let both = self.scenarios.iter().zip(&method.scenarios);
        let own = both.filter(|(_, of)| of.has_runs()).map(|(scenario, _)| *scenario);
        let theirs = self.of.contributed.iter().find(|of| of.results.method == method.method);
        let times = theirs.map_or(Some(times), |of| of.times.as_ref());
        let own = times.and_then(|times| times.of(&method.method, own));
        own.map_or_else(none, |own| cell(own.typical(), 1.0))
    }

    /// The methods that are for some scenarios alone, each beside the best of the others there.
    pub(in crate::suite) fn partial(&self) -> Option<SuiteTable> {
        let ranked = self.ranked(&self.groups[0]);
        let is_other = |of: &MethodResults| of.method != IDEAL && ranked.iter().all(|(all, _)| all.method != of.method);
        let there = |of: &MethodResults| -> Vec<usize> {
            let all = 0..self.scenarios.len();
            all.filter(|i| of.scenarios[*i].has_runs()).collect()
        };
        let both = self.of.methods.iter().zip(&self.groups[0].scores);
        let others = both.filter_map(|(method, score)| Some((method, score.as_ref().filter(|_| is_other(method))?)));
        let table = Columns::new(others)
            .with(Column::text("method").width(15), |of| self.named(of.0))
            .with(Column::number("scenarios", "").width(9), |of| count(there(of.0).len()))
            .with(Column::number("median", "").width(9), |of| {
                efficient(of.1.efficiency[0])
            })
            .with(Column::number("90 %", "").width(9), |of| efficient(of.1.efficiency[1]))
            .with(Column::number("failure rate", "%").width(17), |of| {
                cell(of.1.lost, 100.0)
            })
            .with(Column::text("the best there of those for all").width(24), |of| {
                let there = there(of.0);
                let others = ranked.iter().map(|(other, _)| {
                    let both = there.iter().map(|i| (self.scenarios[*i], &other.scenarios[*i]));
                    (other, score(&both.collect::<Vec<_>>()).efficiency[0])
                });
                let best = others.max_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
                best.map_or_else(none, |(other, of)| beside(other, of))
            })
            .whole("Methods that are for some scenarios alone, which give what they need");
        self.table("partial", "Methods for some scenarios", table)
            .unless_empty()
    }

    /// The best three methods of each difficulty.
    pub(in crate::suite) fn best(&self) -> Option<SuiteTable> {
        let groups = self.groups[1..].iter().map(|group| (group, self.distinct(group)));
        let mut columns = Columns::new(groups)
            .with(Column::text("what is hard").width(24), |of| &of.0.words)
            .with(Column::number("scenarios", "").width(9), |of| count(of.0.members.len()));
        for (place, title) in ["first", "second", "third"].into_iter().enumerate() {
            columns = columns.with(Column::text(title).width(24), move |of| {
                let best = of.1.get(place);
                best.map_or_else(CellText::default, |(method, score)| beside(method, score.efficiency[0]))
            });
        }
        let table = columns.whole(
            "The best three methods of each difficulty, by the median relative efficiency, of those that are for all \
             its scenarios. Methods with the same numbers stand once",
        );
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
            let methods = self.of.methods.iter().enumerate();
            let mut columns = Columns::new(methods).with(Column::text("method").width(15), |of| self.named(of.1));
            for group in &self.groups {
                let heading = format!("{} ({})", group.words, group.members.len());
                columns = columns.with(headed(heading, 9), move |(place, _)| {
                    group.scores[*place].as_ref().map_or_else(none, number)
                });
            }
            let table = columns.whole(caption);
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
        let share = |method: &MethodResults, lost: u64| match lost {
            0 => none(),
            lost => percent(lost as f64 / total(method, &|of| of.d.len() as u64) as f64),
        };
        let mut columns = Columns::new(methods.iter())
            .with(Column::text("method").width(15), |of| self.named(of))
            .with(Column::number("failure rate", "%").width(16), |of| share(of, lost(of)));
        for word in words {
            columns = columns.with(headed(word, 6), move |method| {
                share(method, total(method, &|of| of.lost.get(word).copied().unwrap_or(0)))
            });
        }
        let table = columns.whole("Why runs were lost, % of the runs of a method");
        self.table("reasons", "Why runs were lost", table).unless_empty()
    }
}
