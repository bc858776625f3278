//! The evidence for or against a claim's tests in one cell.

use crate::claim::decision_rule::PValues;
use crate::claim::known::{Range, worst};
use crate::claim::one_sided::More;
use crate::claim::statistics::number::Number;
use crate::claim::statistics::{Members, Results};
use crate::design::file::{ClaimTest, Limit};

/// One number that a test looks at.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// The test's index in the claim.
    pub(crate) test: usize,
    /// The number.
    pub(crate) number: Number,
    /// The range in which it must lie.
    pub(crate) range: Range,
}

/// The evidence of a cell on the tests that must all pass in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Evidence {
    /// The numbers of all tests that have numbers.
    pub(crate) parts: Vec<Part>,
    /// Why other tests have none.
    pub(crate) missing: Vec<String>,
    /// Why numbers cannot be judged on one side or on both.
    pub(crate) cautions: Vec<String>,
}

impl Evidence {
    /// Collects the evidence on all tests of a claim.
    pub(crate) fn new(results: Results<'_>, tests: &[ClaimTest], cells: &Members) -> Self {
        let mut evidence = Self::default();
        for (index, test) in tests.iter().enumerate() {
            match results.numbers(test, cells) {
                Ok(numbers) => {
                    let range = Range::for_test(test);
                    let cautions = numbers.iter().filter_map(|number: &Number| number.caution.clone());
                    evidence.cautions.extend(cautions);
                    let part = |number| Part {
                        test: index,
                        number,
                        range,
                    };
                    evidence.parts.extend(numbers.into_iter().map(part));
                }
                Err(why) => evidence.missing.push(why),
            }
        }
        evidence
    }

    /// Returns the p-values. To pass, all numbers must be inside: the largest p-value. To fail, one outside is enough:
    /// Bonferroni.
    pub(crate) fn p_values(&self) -> PValues {
        let inside = self.parts.iter().map(|part| part.number.known.inside(part.range));
        let outside = self.parts.iter().map(|part| part.number.known.outside(part.range));
        PValues {
            pass: if self.missing.is_empty() && !self.parts.is_empty() {
                inside.fold(0.0, worst)
            } else {
                1.0
            },
            fail: (self.count() * outside.fold(1.0, f64::min)).min(1.0),
        }
    }

    fn count(&self) -> f64 {
        (self.parts.len() + self.missing.len()) as f64
    }

    /// Whether the values pass, certain or not.
    pub(crate) fn seems_to_pass(&self) -> bool {
        let pass = |part: &Part| part.number.known.seems_inside(part.range);
        self.missing.is_empty() && self.parts.iter().all(pass)
    }

    /// Returns the chance of a certain pass at a level with more trials.
    pub(crate) fn power_of_pass(&self, more: More, level: f64) -> f64 {
        if !self.missing.is_empty() {
            return 0.0;
        }
        let passes = |part: &Part| part.number.known.power_inside(part.range, more, level);
        self.parts.iter().map(passes).product()
    }

    /// Returns the chance of a certain fail.
    pub(crate) fn power_of_fail(&self, more: More, level: f64) -> f64 {
        let part_level = level / self.count();
        let misses = |part: &Part| 1.0 - part.number.known.power_outside(part.range, more, part_level);
        1.0 - self.parts.iter().map(misses).product::<f64>()
    }

    /// Returns the number nearest to failing, or failing most: that which makes the p-values of the cell. Numbers with
    /// equal ones, or with such that are certain at any level, are compared by standard errors.
    pub(crate) fn decisive(&self) -> Option<&Part> {
        const CERTAIN: f64 = 1e-9;
        let rank = |part: &Part| {
            let known = &part.number.known;
            [
                known.outside(part.range).max(CERTAIN),
                -known.inside(part.range).max(CERTAIN),
                part.margin(),
            ]
        };
        let order = |(a, _): &([f64; 3], &Part), (b, _): &([f64; 3], &Part)| {
            let mut orders = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
            orders.find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        };
        let ranked = self.parts.iter().map(|part| (rank(part), part));
        ranked.min_by(order).map(|(_, part)| part)
    }
}

impl Part {
    /// Returns how far inside its range the number lies, in approximate standard errors; negative outside.
    pub(crate) fn margin(&self) -> f64 {
        self.number.known.margin(self.range)
    }

    /// Returns how far inside its range the value lies; negative outside.
    pub(crate) fn depth(&self) -> f64 {
        self.number.known.depth(self.range)
    }
}

impl Range {
    /// Returns the numbers that pass a test. Shares lie between 0 and 1, so a range that reaches 0 or 1 has no limit
    /// there.
    fn for_test(test: &ClaimTest) -> Self {
        let [low, high] = test.limit.ends();
        let open = matches!(test.limit, Limit::Below(_) | Limit::Above(_));
        let reaches = test.kind.is_share() && !open;
        Self {
            low: if reaches && low <= 0.0 { f64::NEG_INFINITY } else { low },
            high: if reaches && high >= 1.0 { f64::INFINITY } else { high },
            open,
        }
    }
}
