//! States a verdict in one plain sentence with at most two numbers with errors.

#![allow(clippy::format_push_string, reason = "a few lines")]

use crate::claim::condition::condition;
use crate::claim::decision_rule::Verdict;
use crate::claim::evidence::Part;
use crate::claim::found::{Found, Judge};
use crate::claim::needed::Needed;
use crate::design::file::lists::each_once;
use crate::design::file::{
    Assumption, ClaimTest, CoefficientStatistic, Holds, Limit, Outcome, RatioStatistic, TestKind, TheoryReference,
};
use crate::outcome::place::Place;
use asobench_identification::metric::SlopeOf;
use asobench_identification::number::{listed, uncertain};

/// The findings that a sentence reports.
pub(crate) struct Findings<'a> {
    pub(crate) judge: &'a Judge<'a>,
    /// The judged units with their evidence.
    pub(crate) units: &'a [&'a Found<'a>],
    /// The number of cells left out, because the condition is not certain in them.
    pub(crate) left_out: usize,
    /// The judged cells that certainly pass or fail, as indices.
    pub(crate) passing: &'a [usize],
    pub(crate) failing: &'a [usize],
    /// How many certainly pass, and how many certainly fail, all together.
    pub(crate) at_least: [usize; 2],
    pub(crate) verdict: Verdict,
    pub(crate) needed: Option<Needed>,
}

impl Findings<'_> {
    fn places(&self) -> Vec<Place> {
        self.units.iter().map(|unit| unit.unit.place.clone()).collect()
    }

    /// Returns "cells", or "cases" if each is a cell with one of several outputs.
    fn cells(&self) -> &'static str {
        if self.judge.cases.len() > 1 { "cases" } else { "cells" }
    }

    /// Returns where it certainly holds: settings, or outputs if the claim lists several.
    fn holds_where(&self) -> Option<String> {
        if self.judge.cases.len() == 1 {
            return condition(&self.places(), self.passing, self.failing);
        }
        let all_pass = |case: &&Vec<ClaimTest>| {
            let mut units = (0..self.units.len())
                .filter(|unit| std::ptr::eq(self.units[*unit].tests, case.as_slice()))
                .peekable();
            units.peek().is_some() && units.all(|unit| self.passing.contains(&unit))
        };
        let held = self.judge.cases.iter().filter(all_pass);
        let names: Vec<String> = held.filter_map(|case| Some(of_and_to(case.first()?))).collect();
        (1..=6).contains(&names.len()).then(|| format!("of {}", listed(&names)))
    }

    /// Returns the text after the verdict's word.
    pub(crate) fn sentence(&self) -> String {
        let mut sentence = match self.verdict {
            Verdict::Undecided => self.undecided(),
            _ if self.units.len() == 1 => self.of_one(),
            Verdict::Holds => self.holding(),
            Verdict::DoesNotHold => self.failing(),
            Verdict::HoldsInPart => self.in_part(),
        };
        if self.left_out > 0 && !self.units.is_empty() {
            let given = self.judge.given.as_ref();
            let given = given.map(|test| format!("{} is certainly not {}", noun(test, None), must(test)));
            let cells = match self.left_out {
                1 => "one cell".to_owned(),
                count => format!("{count} cells"),
            };
            let given = given.unwrap_or_default();
            sentence.push_str(&format!(" Left out: {cells}, where {given}."));
        }
        sentence.push_str(&self.look_words());
        sentence
    }

    /// Returns which look at the results this is, if it is not the first, and the level that is left for it.
    fn look_words(&self) -> String {
        match self.judge.look.number {
            0 | 1 => String::new(),
            number => format!(
                " Look {number} at this study, at {} % a side; all looks together keep {} %.",
                short(100.0 * self.judge.claim.level * self.judge.look.share),
                short(100.0 * self.judge.claim.level)
            ),
        }
    }

    /// Orders cells by how far their numbers are inside the limit: by values if all belong to one test, otherwise by
    /// standard errors. Cells without a number come last.
    fn by_depth(&self, mut cells: Vec<usize>) -> Vec<usize> {
        let parts = || self.units.iter().filter_map(|unit| unit.evidence.decisive());
        let alike = parts().all(|part| Some(part.test) == parts().next().map(|first| first.test));
        let depth = |cell: &usize| {
            let inside = if alike { Part::depth } else { Part::margin };
            self.units[*cell].evidence.decisive().map_or(f64::INFINITY, inside)
        };
        cells.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
        cells
    }

    /// Returns the judged cell nearest to failing, or failing most.
    fn nearest(&self, among: &[usize]) -> Option<usize> {
        self.by_depth(among.to_vec()).first().copied()
    }

    fn all(&self) -> Vec<usize> {
        (0..self.units.len()).collect()
    }

    /// Returns the middle cell in the order of depth inside the limit.
    fn middle(&self) -> Option<usize> {
        let all = self.by_depth(self.all());
        all.get(all.len() / 2).copied()
    }

    /// Returns " at N = 98", or nothing if there is only one cell.
    fn at(&self, cell: usize) -> String {
        let keys = crate::outcome::place::varying(&self.places());
        let words = self.units[cell].unit.place.words(&keys);
        if words.is_empty() {
            words
        } else {
            let word = if words.ends_with("noise") && !words.contains([',', '=']) {
                "in"
            } else {
                "at"
            };
            format!(" {word} {words}")
        }
    }

    /// Returns, for the cell's decisive number, "the median e_a of iv(4)", the number itself, and its limit in words.
    fn words(&self, cell: usize) -> Option<(String, String, String)> {
        let unit = &self.units[cell];
        let part = unit.evidence.decisive()?;
        let test = &unit.tests[part.test];
        let mut value = value(test, part);
        if let Some(kept) = part.number.kept {
            value.push_str(&format!(" (of the {:.1} % of trials with a value)", 100.0 * kept));
        }
        Some((noun(test, part.number.name.as_deref()), value, must(test)))
    }

    /// Returns "the share of lost trials of ls is below 1 %", or that all tests pass.
    fn claim(&self, verb: &str) -> String {
        match self.judge.cases[0].as_slice() {
            [test] => format!("{} {verb} {}", noun(&self.any(0), None), must(test)),
            tests => format!(
                "all {} tests {}",
                tests.len(),
                if verb == "is" { "pass" } else { "do not pass" }
            ),
        }
    }

    /// Returns the test of this index with all outputs that the claim lists.
    pub(crate) fn any(&self, index: usize) -> ClaimTest {
        let mut any = self.judge.cases[0][index].clone();
        let all = || self.judge.cases.iter().map(|case| &case[index]);
        any.output = each_of(all().map(|test| test.output.clone()));
        if let Some(to) = any.kind.other_mut() {
            *to = each_of(all().filter_map(|test| test.kind.other().cloned()));
        }
        any
    }

    fn of_one(&self) -> String {
        let Some((noun, value, must)) = self.words(0) else {
            return ".".to_owned();
        };
        let not = if self.verdict == Verdict::Holds { "" } else { "not " };
        format!(": {noun} is {value}, {not}{must}.")
    }

    fn holding(&self) -> String {
        let m = self.units.len();
        let number = |cell: Option<usize>, word: &str| {
            let named = cell.and_then(|cell| Some((self.words(cell)?, self.at(cell))));
            let several = self.judge.cases.len() > 1 || self.judge.cases[0].len() > 1;
            named.map_or_else(String::new, |((noun, value, must), at)| {
                let place = if at.is_empty() {
                    at.clone()
                } else {
                    format!("{at}, where")
                };
                if several {
                    format!("; {word}{place} {noun} is {value} and must be {must}")
                } else {
                    format!("; {word} {value}{at}")
                }
            })
        };
        match self.judge.claim.holds {
            Holds::Everywhere => format!(
                ": in all {m} {} {}{}.",
                self.cells(),
                self.claim("is"),
                number(self.nearest(&self.all()), "nearest to the limit:")
            ),
            Holds::Typically => format!(
                ": in at least {} of {m} {} {}{}.",
                self.at_least[0],
                self.cells(),
                self.claim("is"),
                number(self.middle(), "in the median cell:")
            ),
            Holds::Somewhere => {
                let cell = self.passing.first().copied();
                format!(": {}{}.", self.claim("is"), number(cell, "such as"))
            }
        }
    }

    fn failing(&self) -> String {
        let m = self.units.len();
        let cell_words = |cell: Option<usize>| {
            let (noun, value, must) = self.words(cell?)?;
            Some(format!("{noun} is {value}{}, not {must}", self.at(cell?)))
        };
        match self.judge.claim.holds {
            Holds::Everywhere => {
                let cells = self.cells();
                let counter = cell_words(self.nearest(self.failing)).unwrap_or_default();
                let count = match self.failing.len() {
                    1 => format!("one certain counterexample in {m} {cells}"),
                    count => format!("{count} certain counterexamples in {m} {cells}"),
                };
                let place = self.holds_where();
                let place = place.map(|place| format!(" It certainly holds {place}."));
                format!(": {counter}; {count}.{}", place.unwrap_or_default())
            }
            Holds::Typically => format!(
                ": in at least {} of {m} {} {}; in the median cell {}.",
                self.at_least[1],
                self.cells(),
                self.claim("is not"),
                cell_words(self.middle()).unwrap_or_default()
            ),
            Holds::Somewhere => {
                if self.judge.cases[0].len() > 1 {
                    return format!(": in none of {m} {} all tests pass.", self.cells());
                }
                let known = |cell: &usize| self.units[*cell].evidence.decisive().is_some();
                let all = self.by_depth(self.all().into_iter().filter(known).collect());
                let best = all.last().copied();
                format!(
                    ": in none of {m} {}; at best {}.",
                    self.cells(),
                    cell_words(best).unwrap_or_default()
                )
            }
        }
    }

    fn in_part(&self) -> String {
        let place = self.holds_where();
        let place = place.map_or_else(String::new, |place| format!(" It certainly holds {place}."));
        format!(
            ": {} in {} of {} {} for certain, certainly not in {}.{place}",
            self.claim("is"),
            self.passing.len(),
            self.units.len(),
            self.cells(),
            self.failing.len()
        )
    }

    fn undecided(&self) -> String {
        if self.units.is_empty() && self.left_out == 0 {
            return ": the results have no cell to which it applies.".to_owned();
        }
        if self.units.is_empty() {
            return ": its condition is certainly not met in any cell.".to_owned();
        }
        let m = self.units.len();
        let found = self.units.iter().map(|unit| &unit.evidence);
        let found = found.flat_map(|evidence| evidence.missing.iter().chain(&evidence.cautions));
        let mut reasons = each_once(found.cloned());
        let is_silent = |unit: &&&Found| !(unit.evidence.missing.is_empty() && unit.evidence.cautions.is_empty());
        let silent = self.units.iter().filter(is_silent).count();
        let open = m - self.passing.len() - self.failing.len();
        let open = match self.words(0).filter(|_| m == 1) {
            Some((noun, value, must)) => format!("{noun} is {value}, not certainly {must} or not"),
            None if m == 1 => "nothing is known of the cell".to_owned(),
            None if open == 1 => format!("1 of {m} {} is undecided", self.cells()),
            None => format!("{open} of {m} {} are undecided", self.cells()),
        };
        let trials = match self.needed {
            _ if silent == m && self.units.iter().all(|unit| unit.evidence.parts.is_empty()) => String::new(),
            _ if self.judge.cases.iter().flatten().any(ClaimTest::is_timed) => {
                "; more trials do not make times more precise".to_owned()
            }
            Some(_) if self.judge.look.next <= 0.0 => {
                "; its looks are used up, and a run with another seed in another folder can decide it".to_owned()
            }
            Some(Needed { from: None, .. }) if !reasons.is_empty() => String::new(),
            Some(needed) => format!("; {}", needed.sentence()),
            None => String::new(),
        };
        let why = if reasons.is_empty() {
            String::new()
        } else {
            reasons.truncate(2);
            let cells = if silent == m {
                String::new()
            } else {
                format!(" ({silent} of them)")
            };
            format!("{cells}: {}", listed(&reasons))
        };
        format!(": {open}{why}{trials}.")
    }
}

/// Formats a number with three significant digits: "0.125".
fn short(x: f64) -> String {
    format!("{x:.2e}").parse::<f64>().unwrap_or(x).to_string()
}

/// Returns "iv(4)", or "each of iv(4) and ls".
fn each_of(names: impl Iterator<Item = String>) -> String {
    match each_once(names).as_slice() {
        [name] => name.clone(),
        all => format!("each of {}", listed(all)),
    }
}

/// Returns "iv(4)", or "iv(4) over ls".
pub(crate) fn of_and_to(test: &ClaimTest) -> String {
    match test.kind.other() {
        Some(to) => {
            let to = TheoryReference::named(to).map_or(to.as_str(), |of| of.words());
            format!("{} over {to}", test.output)
        }
        None => test.output.clone(),
    }
}

/// Formats the number with its error.
pub(crate) fn value(test: &ClaimTest, part: &Part) -> String {
    let (value, error) = part.number.known.shown();
    if value.is_infinite() {
        match test.kind {
            TestKind::Ratio { .. } | TestKind::Cells { .. } => "infinite".to_owned(),
            _ => "that of a trial without a value".to_owned(),
        }
    } else if test.kind.is_share() {
        format!("{} %", uncertain(100.0 * value, 100.0 * error))
    } else {
        uncertain(value, error)
    }
}

/// Returns the limit in words: "below 1", "from -0.1 to 0.1".
pub(crate) fn must(test: &ClaimTest) -> String {
    let number = |x: f64| {
        if test.kind.is_share() {
            // Drops the digits that binary fractions add: 100 times 0.57 is 56.99999999999999.
            let per_cent = format!("{:.10}", 100.0 * x);
            let short = per_cent.trim_end_matches('0').trim_end_matches('.');
            format!("{short} %")
        } else {
            x.to_string()
        }
    };
    match test.limit {
        Limit::Below(x) => format!("below {}", number(x)),
        Limit::Above(x) => format!("above {}", number(x)),
        Limit::Between(low, high) => format!("from {} to {}", number(low), number(high)),
        Limit::Within(factor) => format!("1 within a factor of {factor}"),
    }
}

/// Returns what a test looks at: "the median e_a of iv(4)".
pub(crate) fn noun(test: &ClaimTest, coefficient: Option<&str>) -> String {
    let noun = plain_noun(test, coefficient);
    match test.assumption {
        None => noun,
        Some(Assumption::Cap(cap)) => format!("{noun}, with errors above {cap} counted as {cap},"),
        Some(Assumption::Kurtosis(most)) => {
            format!("{noun}, if the mean fourth power is at most {most} squares of the mean square,")
        }
    }
}

fn plain_noun(test: &ClaimTest, coefficient: Option<&str>) -> String {
    let output = &test.output;
    match &test.kind {
        TestKind::Outcome(Outcome::Lost) => {
            format!("the share of lost trials (failed or unstable) of {output}")
        }
        TestKind::Outcome(outcome) => format!("the share of {outcome} trials of {output}"),
        TestKind::Bound(bound) => {
            let measure = bound.measure.label();
            let text = match bound.below {
                None => "= 0 up to rounding".to_owned(),
                Some(_) => bound.text(),
            };
            format!("the share of trials of {output} with {measure} {text}")
        }
        TestKind::Wins { measure, to } => format!(
            "the share of trials in which {output} is better than {to} in {}",
            measure.label()
        ),
        TestKind::Value { measure, statistic } => {
            format!("{} {} of {output}", statistic.words(), measure.label())
        }
        TestKind::Coefficient { name, statistic } => {
            let name = name.as_deref().or(coefficient);
            let name = name.unwrap_or("every coefficient");
            match statistic {
                CoefficientStatistic::Coverage => {
                    format!("the coverage of the 95 % intervals of {name} of {output}")
                }
                CoefficientStatistic::ShareAbove => {
                    format!("the share of estimates of {name} by {output} above the truth")
                }
                CoefficientStatistic::Bias => {
                    format!("the bias of {name} of {output}, in standard deviations,")
                }
            }
        }
        TestKind::Ratio {
            measure,
            to,
            measure_of_to,
            statistic,
        } => {
            let (first, second) = (measure.label(), measure_of_to.label());
            let to = TheoryReference::named(to).map_or(to.as_str(), |of| of.words());
            match statistic {
                RatioStatistic::Median if measure != measure_of_to => {
                    format!("the ratio of the median {first} of {output} to the median {second} of {to}")
                }
                RatioStatistic::Median => {
                    format!("the ratio of the median {first} of {output} to that of {to}")
                }
                RatioStatistic::Rms => {
                    format!("the ratio of the rms over trials of {first} of {output} to that of {to}")
                }
                RatioStatistic::PairedMedian if measure != measure_of_to => {
                    format!("the median ratio of {first} of {output} to {second} of {to}")
                }
                RatioStatistic::PairedMedian => {
                    format!("the median ratio of {first}, {output} over {to},")
                }
            }
        }
        TestKind::Cells {
            measure,
            axis,
            from,
            to,
        } => {
            let axis = axis.name().replace('_', " ");
            let to = match to.as_deref() {
                Some([value]) => format!("{axis} {value}"),
                _ => format!("another {axis}"),
            };
            format!("the median ratio of {} of {output}, {to} over {from},", measure.label())
        }
        TestKind::Slope(slope) => {
            let statistic = match slope.statistic {
                SlopeOf::Rmse => "rms",
                SlopeOf::Median => "median",
            };
            let over = crate::outcome::place::axis_label(slope.over);
            let over = over.split(',').next().unwrap_or_default();
            let measure = slope.measure.label();
            format!("the log-log slope of the {statistic} of {measure} of {output} over {over}")
        }
        TestKind::Time { to } => format!("the time of {output} over that of {to}"),
    }
}
