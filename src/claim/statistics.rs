//! The numbers of a study's summary that tests look at: the only part of the engine that knows
//! where they stand.
//!
//! Populations: shares and quantiles are over all trials, lost ones last; means, root mean squares
//! and biases are over the trials that have the measure, and say so ([`Number::kept`]).

use super::known::{Freedom, Known};
use crate::metric::{Estimate, JACKKNIFE_GROUPS, PairedStatistics, Quantile, Statistics};
use crate::study::file::{
    BoundTable, ClaimStatistic, ClaimTest, Outcome, SlopeTable, TestKind, ValueOf,
};
use crate::study::{Better, CellSummary, Measure, MethodTime, OutputSummary, Summary};

/// A number of a cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Number {
    /// The coefficient, where a test looks at several.
    pub(super) name: Option<String>,
    /// What is known of it.
    pub(super) known: Known,
    /// The share of the trials that it is over, where that is not all of them.
    pub(super) kept: Option<f64>,
}

impl From<Known> for Number {
    fn from(known: Known) -> Self {
        Self {
            name: None,
            known,
            kept: None,
        }
    }
}

/// Why there is no number, in words.
type Missing = String;

/// The results that claims are judged by.
#[derive(Clone, Copy)]
pub(super) struct Results<'a> {
    pub(super) summary: &'a Summary,
    pub(super) times: &'a [MethodTime],
}

/// The cells that a test is about, as indices in the summary: one, two (from, to) or a family.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Members {
    Cell(usize),
    Pair(usize, usize),
    Family(Vec<usize>),
}

impl Results<'_> {
    /// The numbers that a test looks at: one, or one for every coefficient.
    pub(super) fn numbers(self, test: &ClaimTest, of: &Members) -> Result<Vec<Number>, Missing> {
        let cell = |index: usize| {
            let cell = self.summary.cells.get(index);
            cell.ok_or_else(|| format!("cell {index} is missing"))
        };
        match (&test.kind, of) {
            (TestKind::Cells { measure, .. }, Members::Pair(from, to)) => {
                one(self.pair(cell(*from)?, cell(*to)?, &test.of, *measure))
            }
            (TestKind::Slope(slope), Members::Family(cells)) => {
                one(self.slope(slope, &test.of, cells))
            }
            (TestKind::Time { to }, Members::Cell(index)) => one(self.time(*index, &test.of, to)),
            (_, Members::Cell(index)) => in_cell(cell(*index)?, test),
            _ => Err("the test is about other cells".to_owned()),
        }
    }

    /// The trials of a cell.
    pub(super) fn trials(self, of: &Members) -> u64 {
        let index = match of {
            Members::Cell(index) | Members::Pair(_, index) => Some(index),
            Members::Family(cells) => cells.first(),
        };
        let cell = index.and_then(|index| self.summary.cells.get(*index));
        cell.map_or(0, |cell| cell.trials)
    }

    /// A measure of an output in one cell over that in another, on the same trials.
    #[expect(clippy::unused_self, reason = "results hold no pairs of cells yet")]
    fn pair(
        self,
        _from: &CellSummary,
        _to: &CellSummary,
        output: &str,
        measure: Measure,
    ) -> Result<Known, Missing> {
        Err(not_kept(&format!(
            "pairs of cells in {measure} of '{output}'"
        )))
    }

    fn slope(self, of: &SlopeTable, output: &str, cells: &[usize]) -> Result<Known, Missing> {
        let mut slopes = self.summary.slopes.iter();
        let found =
            slopes.find(|slope| slope.of == *of && slope.output == output && slope.cells == cells);
        let what = || format!("slope of {} over {} of '{output}'", of.measure, of.over);
        let found = found.ok_or_else(|| not_kept(&what()))?;
        let undefined = || {
            format!(
                "the {} is undefined: {}",
                what(),
                found.undefined.clone().unwrap_or_default()
            )
        };
        let slope = found.slope.ok_or_else(undefined)?;
        let estimate = (slope.value, slope.mcse);
        known(
            estimate,
            Freedom::constant((JACKKNIFE_GROUPS - 1) as f64),
            false,
        )
    }

    /// A time is a median over repetitions, of which quartiles are known. Repetitions share the
    /// state of the machine, so their number says nothing: the standard deviation of one of them,
    /// (q75 - q25) / 1.349, is taken for the error.
    fn time(self, cell: usize, of: &str, to: &str) -> Result<Known, Missing> {
        let relative = |method: &str| {
            let mut times = self.times.iter();
            let time = times.find(|time| time.cell == cell && time.method == method);
            let time = time.ok_or_else(|| {
                format!("no times of '{method}' were measured; they need timing = true")
            })?;
            let error = (time.q75_seconds - time.q25_seconds) / 1.349;
            Ok::<_, Missing>((time.median_seconds, error / time.median_seconds))
        };
        let ((first, a), (second, b)) = (relative(of)?, relative(to)?);
        let ratio = first / second;
        known((ratio, ratio * a.hypot(b)), Freedom::FIXED, true)
    }
}

fn one(known: Result<Known, Missing>) -> Result<Vec<Number>, Missing> {
    known.map(|known| vec![known.into()])
}

fn not_kept(what: &str) -> Missing {
    format!("the run did not keep {what}; a new run of the file keeps what its claims need")
}

/// Whether one trial stands for all: nothing in the cell is random.
fn is_deterministic(_cell: &CellSummary) -> bool {
    false
}

fn in_cell(cell: &CellSummary, test: &ClaimTest) -> Result<Vec<Number>, Missing> {
    let output = cell.output(&test.of);
    let output = output.ok_or_else(|| format!("the results have no output '{}'", test.of))?;
    let mut numbers = match &test.kind {
        TestKind::Outcome(outcome) => one(outcome_count(cell, output, *outcome)),
        TestKind::Bound(bound) => one(bound_count(cell, &test.of, bound)),
        TestKind::Wins { measure, to } => one(wins(cell, &test.of, to, *measure)),
        TestKind::Value {
            what: ValueOf::Measure(measure),
            statistic,
        } => value(cell, output, *measure, *statistic).map(|number| vec![number]),
        TestKind::Value {
            what: ValueOf::Parameter(name),
            ..
        } => biases(cell, output, Some(name)),
        TestKind::Value {
            what: ValueOf::Parameters,
            ..
        } => biases(cell, output, None),
        TestKind::Ratio {
            measure,
            to,
            measure_of_to,
            statistic,
        } => match statistic {
            ClaimStatistic::Median => one(ratio_of_medians(
                cell,
                [(&test.of, *measure), (to, *measure_of_to)],
            )),
            statistic => ratio(cell, &test.of, to, *measure, *statistic).map(|number| vec![number]),
        },
        TestKind::Cells { .. } | TestKind::Slope(_) | TestKind::Time { .. } => Ok(Vec::new()),
    }?;
    if is_deterministic(cell) {
        for number in &mut numbers {
            number.known = Known::Exact(number.known.shown().0);
        }
    }
    Ok(numbers)
}

/// An estimate with its standard error; without error it is exact.
fn known(
    (value, error): (f64, f64),
    freedom: Freedom,
    logarithmic: bool,
) -> Result<Known, Missing> {
    if !value.is_finite() || logarithmic && value <= 0.0 {
        Err("the number is undefined".to_owned())
    } else if error == 0.0 {
        Ok(Known::Exact(value))
    } else if error > 0.0 && error.is_finite() {
        Ok(Known::Estimate {
            value,
            error,
            freedom,
            logarithmic,
        })
    } else {
        Err("there are too few trials for a standard error".to_owned())
    }
}

fn outcome_count(
    cell: &CellSummary,
    output: &OutputSummary,
    outcome: Outcome,
) -> Result<Known, Missing> {
    let (failed, unstable) = (output.outcomes.failed(), output.outcomes.unstable);
    let count = match outcome {
        Outcome::Failed => failed,
        Outcome::Unstable => unstable,
        Outcome::Lost if failed == 0 || unstable == 0 => failed + unstable,
        Outcome::Lost => {
            return Err(not_kept("how many trials are both failed and unstable"));
        }
    };
    count_of(count, cell.trials)
}

fn count_of(count: u64, of: u64) -> Result<Known, Missing> {
    if of == 0 {
        Err("there is no trial to count".to_owned())
    } else {
        Ok(Known::Count { count, of })
    }
}

fn bound_count(cell: &CellSummary, label: &str, bound: &BoundTable) -> Result<Known, Missing> {
    let same = |of: &BoundTable| {
        (of.measure, of.below, of.rounding) == (bound.measure, bound.below, bound.rounding)
    };
    let found = cell.bounds.iter().find(|of| same(&of.bound));
    let output = found.and_then(|of| of.outputs.iter().find(|output| output.output == label));
    let what = || {
        not_kept(&format!(
            "the share of trials with {} {}",
            bound.measure,
            bound.text()
        ))
    };
    let met = output.ok_or_else(what)?.met;
    count_of(met.count, met.of)
}

fn compared<'a>(
    cell: &'a CellSummary,
    of: &str,
    to: &str,
    measure: Measure,
) -> Result<&'a PairedStatistics, Missing> {
    let mut pairs = cell.comparisons.iter();
    let pair = pairs.find(|pair| pair.first == of && pair.second == to);
    let found = pair.and_then(|pair| pair.measures.get(&measure));
    found.ok_or_else(|| {
        not_kept(&format!(
            "the comparison of '{of}' with '{to}' in {measure}"
        ))
    })
}

fn wins(cell: &CellSummary, of: &str, to: &str, measure: Measure) -> Result<Known, Missing> {
    let smaller = compared(cell, of, to, measure)?.share_smaller;
    let count = if measure.better() == Better::Larger {
        smaller.of - smaller.count
    } else {
        smaller.count
    };
    if smaller.of == 0 {
        return Err("all trials are ties".to_owned());
    }
    count_of(count, smaller.of)
}

fn statistics(output: &OutputSummary, measure: Measure) -> Result<&Statistics, Missing> {
    let found = output.measures.get(&measure);
    found.ok_or_else(|| not_kept(&format!("the measure {measure}")))
}

fn value(
    cell: &CellSummary,
    output: &OutputSummary,
    measure: Measure,
    statistic: ClaimStatistic,
) -> Result<Number, Missing> {
    let of = statistics(output, measure)?;
    // Quantiles of summaries are over the trials that have the measure.
    let survivors = |known: Known| {
        Ok(Number {
            kept: kept(of.count, cell.trials),
            ..known.into()
        })
    };
    match statistic {
        ClaimStatistic::Mean => moment(cell, of, of.mean, measure),
        ClaimStatistic::Rms => moment(cell, of, of.rmse, measure),
        ClaimStatistic::Q05 => survivors(quantile(cell, of, 0.05, of.q05, measure)),
        ClaimStatistic::Q25 => survivors(quantile(cell, of, 0.25, of.q25, measure)),
        ClaimStatistic::Q75 => survivors(quantile(cell, of, 0.75, of.q75, measure)),
        ClaimStatistic::Q95 => survivors(quantile(cell, of, 0.95, of.q95, measure)),
        _ => survivors(quantile(cell, of, 0.5, of.q50, measure)),
    }
}

/// A mean or a root mean square, of the trials that have the measure.
fn moment(
    cell: &CellSummary,
    of: &Statistics,
    estimate: Estimate,
    measure: Measure,
) -> Result<Number, Missing> {
    if of.dominated {
        return Err(format!(
            "a single trial makes the mean square of {measure}, so means say nothing; quantiles do"
        ));
    }
    let estimate = (estimate.value, estimate.mcse);
    Ok(Number {
        kept: kept(of.count, cell.trials),
        ..known(estimate, Freedom::of_mean(of.count), false)?.into()
    })
}

fn kept(count: u64, of: u64) -> Option<f64> {
    (count < of).then(|| count as f64 / of as f64)
}

/// A quantile over all trials.
fn quantile(
    cell: &CellSummary,
    of: &Statistics,
    q: f64,
    quantile: Quantile,
    measure: Measure,
) -> Known {
    let n = cell.trials;
    let lost = n.saturating_sub(of.count);
    let is_lost = |q: f64| {
        let share = lost as f64 / n as f64;
        if measure.better() == Better::Larger {
            q < share
        } else {
            q > 1.0 - share
        }
    };
    let end = if measure.better() == Better::Larger {
        (f64::NEG_INFINITY, lost)
    } else {
        (f64::INFINITY, of.count)
    };
    let quantiles = [
        (0.0, of.min),
        (0.05, of.q05.value),
        (0.25, of.q25.value),
        (0.5, of.q50.value),
        (0.75, of.q75.value),
        (0.95, of.q95.value),
        (1.0, of.max),
    ];
    let inner = quantiles.into_iter().filter(|(q, _)| !is_lost(*q));
    let value = if is_lost(q) { end.0 } else { quantile.value };
    let estimate = (value, quantile.mcse);
    ranks(
        q,
        n,
        estimate,
        inner,
        [Some(end).filter(|_| lost > 0), None],
        false,
    )
}

/// A quantile by its standard error where it has one, else by the ranks: `known` quantiles, and the
/// `ends` that lost trials make.
fn ranks(
    q: f64,
    of: u64,
    (value, error): (f64, f64),
    known: impl IntoIterator<Item = (f64, f64)>,
    ends: [Option<(f64, u64)>; 2],
    logarithmic: bool,
) -> Known {
    let is_near_normal = value.is_finite() && error > 0.0 && error.is_finite();
    if is_near_normal && !(logarithmic && value <= 0.0) {
        return Known::Estimate {
            value,
            error,
            freedom: Freedom::of_quantile(q, of),
            logarithmic,
        };
    }
    // A quantile of n values is at or between those of the ranks j and j + 1 with j = q (n - 1)
    // rounded down, from 0.
    let rank = |q: f64| (q * of.saturating_sub(1) as f64) as u64 + 1;
    let inner = known.into_iter().filter(|(_, x)| !x.is_nan());
    let inner = inner.map(|(q, x)| (x, rank(q)));
    Known::Ranks {
        value,
        q,
        of,
        points: inner.chain(ends.into_iter().flatten()).collect(),
    }
}

/// Two outputs on the same trials. A trial that one of them loses makes the ratio infinite or 0.
fn ratio(
    cell: &CellSummary,
    of: &str,
    to: &str,
    measure: Measure,
    statistic: ClaimStatistic,
) -> Result<Number, Missing> {
    let pair = compared(cell, of, to, measure)?;
    let all = pair.both + pair.only_first + pair.only_second + pair.neither;
    if statistic == ClaimStatistic::Rms {
        if pair.dominated {
            return Err(format!(
                "a single trial makes the mean square of {measure}; statistic = \"median\" holds there"
            ));
        }
        let ratio = (pair.rmse_ratio.value, pair.rmse_ratio.mcse);
        return Ok(Number {
            kept: kept(pair.both, all),
            ..known(ratio, Freedom::of_mean(pair.both), true)?.into()
        });
    }
    Ok(Number {
        kept: kept(pair.both, all),
        ..paired_median(pair, all).into()
    })
}

/// The median ratio of two outputs, or of two cells, over all trials.
fn paired_median(pair: &PairedStatistics, all: u64) -> Known {
    let median = (pair.median_ratio.value, pair.median_ratio.mcse);
    let quantiles = [
        (0.05, pair.ratio_q05.value),
        (0.25, pair.ratio_q25.value),
        (0.5, pair.median_ratio.value),
        (0.75, pair.ratio_q75.value),
        (0.95, pair.ratio_q95.value),
    ];
    let zero = (pair.only_first > 0).then_some((0.0, pair.only_first));
    let infinite = (pair.only_second > 0).then_some((f64::INFINITY, all - pair.only_second));
    ranks(0.5, all, median, quantiles, [zero, infinite], true)
}

/// The ratio of two medians. Outputs that share their trials are taken as independent: nearly
/// always they rise and fall together, and the error is then too large rather than too small.
fn ratio_of_medians(cell: &CellSummary, of: [(&str, Measure); 2]) -> Result<Known, Missing> {
    let mut medians = [Quantile::UNDEFINED; 2];
    for (median, (label, measure)) in medians.iter_mut().zip(of) {
        let output = cell.output(label);
        let output = output.ok_or_else(|| format!("the results have no output '{label}'"))?;
        *median = statistics(output, measure)?.q50;
    }
    let [first, second] = medians;
    let ratio = first.value / second.value;
    let relative = (first.mcse / first.value).hypot(second.mcse / second.value);
    let freedom = Freedom::of_quantile(0.5, cell.trials);
    known((ratio, ratio * relative), freedom, true)
}

/// The mean signed error over its standard deviation, delta = m / s, of one coefficient or of all:
/// Var delta is nearly Var m / s^2 + delta^2 Var s / s^2, without the covariance of m and s, which
/// is 0 of symmetric errors.
fn biases(
    cell: &CellSummary,
    output: &OutputSummary,
    name: Option<&String>,
) -> Result<Vec<Number>, Missing> {
    let named = output.parameters.iter();
    let wanted = named.filter(|(of, _)| name.is_none_or(|name| name == of));
    let biases: Result<Vec<Number>, Missing> = wanted
        .map(|(of, errors)| {
            if errors.dominated {
                return Err(format!(
                    "a single trial makes the mean square of the error of {of}"
                ));
            }
            let (mean, sd) = (errors.mean, errors.sd);
            let delta = mean.value / sd.value;
            let error = (mean.mcse / sd.value).hypot(delta * sd.mcse / sd.value);
            Ok(Number {
                name: Some(of.clone()),
                kept: kept(errors.count, cell.trials),
                known: known((delta, error), Freedom::of_mean(errors.count), false)?,
            })
        })
        .collect();
    let biases = biases?;
    if biases.is_empty() {
        return Err(not_kept("the errors of the coefficients"));
    }
    Ok(biases)
}
