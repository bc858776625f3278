//! The numbers in a study's summary that tests look at. Only this part of the engine knows where they are stored.
//!
//! Populations: shares, quantiles and paired ratios are over all trials, with lost ones ranked last. Means, root mean
//! squares and biases are over the trials that have the measure; [`Number::kept`] tells their share.

use super::known::{Freedom, Known};
use super::moment::{self, Caution, Sum};
use crate::metric::slope_weights;
use crate::metric::{
    Estimate, JACKKNIFE_GROUPS, PairedStatistics, Quantile, SKETCH_ERROR, Share, SlopeOf,
    Statistics, Worse, Z,
};
use crate::study::file::{
    BoundTable, ClaimStatistic, ClaimTest, Outcome, SlopeTable, TestKind, ValueOf,
};
use crate::study::{CellSummary, Measure, MethodTime, OutputSummary, Summary, TheoryReference};

/// A number of a cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Number {
    /// The coefficient, if a test looks at several.
    pub(super) name: Option<String>,
    /// What is known of it.
    pub(super) known: Known,
    /// The share of trials that it covers, if not all of them.
    pub(super) kept: Option<f64>,
    /// Why it cannot be certain on one side of a limit or on both, in words.
    pub(super) caution: Option<String>,
}

impl From<Known> for Number {
    fn from(known: Known) -> Self {
        Self {
            name: None,
            known,
            kept: None,
            caution: None,
        }
    }
}

impl Number {
    /// Makes a number of a moment; without error it is exact.
    fn of_moment((known, caution): (Known, Caution)) -> Result<Self, Missing> {
        let (value, error) = known.shown();
        if !value.is_finite() {
            return Err("the number is undefined".to_owned());
        }
        if error == 0.0 {
            return Ok(Known::Exact(value).into());
        }
        if !(error > 0.0 && error.is_finite()) {
            return Err("there are too few trials for a standard error".to_owned());
        }
        Ok(Self {
            caution,
            ..known.into()
        })
    }
}

/// Why there is no number, in words.
type Missing = String;

/// The results by which claims are judged.
#[derive(Clone, Copy)]
pub(super) struct Results<'a> {
    pub(super) summary: &'a Summary,
    pub(super) times: &'a [MethodTime],
}

/// The cells of a test, as indices in the summary: one, two (from, to) or a family.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Members {
    Cell(usize),
    Pair(usize, usize),
    Family(Vec<usize>),
}

impl Results<'_> {
    /// Returns the numbers that a test looks at: one, or one for every coefficient.
    pub(super) fn numbers(
        self,
        test: &ClaimTest,
        members: &Members,
    ) -> Result<Vec<Number>, Missing> {
        let cell = |index: usize| {
            let cell = self.summary.cells.get(index);
            cell.ok_or_else(|| format!("cell {index} is missing"))
        };
        match (&test.kind, members) {
            (TestKind::Cells { measure, .. }, Members::Pair(from, to)) => {
                let known = self.pair([*from, *to], &test.output, *measure);
                let sure = cell(*from)?.deterministic && cell(*to)?.deterministic;
                single(known).map(|numbers| if sure { exact(numbers) } else { numbers })
            }
            (TestKind::Slope(slope), Members::Family(cells)) => self
                .slope(slope, &test.output, cells)
                .map(|number| vec![number]),
            (TestKind::Time { to }, Members::Cell(index)) => {
                single(self.time(*index, &test.output, to))
            }
            (_, Members::Cell(index)) => in_cell(cell(*index)?, test),
            _ => Err("the test is about other cells".to_owned()),
        }
    }

    /// Returns the number of trials of the cell; of the second cell of a pair, the first of a family.
    pub(super) fn trials(self, members: &Members) -> u64 {
        let index = match members {
            Members::Cell(index) | Members::Pair(_, index) => Some(index),
            Members::Family(cells) => cells.first(),
        };
        let cell = index.and_then(|index| self.summary.cells.get(*index));
        cell.map_or(0, |cell| cell.trials)
    }

    /// Returns the ratio of an output's measure in one cell to that in another, on the same trials.
    fn pair(
        self,
        [from, to]: [usize; 2],
        output: &str,
        measure: Measure,
    ) -> Result<Known, Missing> {
        let mut pairs = self.summary.cell_pairs.iter();
        let found = pairs.find(|pair| {
            let cells = (pair.from, pair.to) == (from, to);
            cells && pair.table.measure == measure && pair.table.output == output
        });
        let what = || not_kept(&format!("pairs of cells in {measure} of '{output}'"));
        Ok(paired_median(&found.ok_or_else(what)?.ratio, measure))
    }

    fn slope(self, table: &SlopeTable, output: &str, cells: &[usize]) -> Result<Number, Missing> {
        let mut slopes = self.summary.slopes.iter();
        let found = slopes
            .find(|slope| slope.table == *table && slope.output == output && slope.cells == cells);
        let what = || {
            format!(
                "slope of {} over {} of '{output}'",
                table.measure, table.over
            )
        };
        let found = found.ok_or_else(|| not_kept(&what()))?;
        let undefined = || {
            format!(
                "the {} is undefined: {}",
                what(),
                found.undefined.clone().unwrap_or_default()
            )
        };
        let slope = found.slope.ok_or_else(undefined)?;
        let freedom = Freedom::constant((JACKKNIFE_GROUPS - 1) as f64);
        if table.statistic == SlopeOf::Median {
            return Ok(known((slope.value, slope.mcse), freedom, false)?.into());
        }
        let estimate = Estimate {
            value: slope.value,
            mcse: slope.mcse,
        };
        let sums = self
            .sums_of_squares(table, output, cells)
            .ok_or_else(|| not_kept(&what()))?;
        Ok(Number {
            kept: self.least_kept(cells, output, table.measure),
            ..Number::of_moment(moment::slope(estimate, freedom, &sums))?
        })
    }

    /// Returns the weight in a slope, and the sum of squares, of every cell.
    fn sums_of_squares(
        self,
        table: &SlopeTable,
        output: &str,
        cells: &[usize],
    ) -> Option<Vec<(f64, Sum)>> {
        let cells = cells.iter().map(|cell| self.summary.cells.get(*cell));
        let cells: Vec<&CellSummary> = cells.collect::<Option<_>>()?;
        let x = cells
            .iter()
            .map(|cell| cell.setting(table.over).parse::<f64>());
        let x: Vec<f64> = x.collect::<Result<_, _>>().ok()?;
        let sum = |cell: &&CellSummary| {
            let statistics = cell.output(output)?.measures.get(&table.measure)?;
            Some(Sum::of_powers(statistics, 2, table.measure))
        };
        let sums: Vec<Sum> = cells.iter().map(sum).collect::<Option<_>>()?;
        Some(slope_weights(&x)?.into_iter().zip(sums).collect())
    }

    /// Returns the smallest share of trials that have a measure, over some cells.
    fn least_kept(self, cells: &[usize], output: &str, measure: Measure) -> Option<f64> {
        let cells = cells
            .iter()
            .filter_map(|cell| self.summary.cells.get(*cell));
        let shares = cells.filter_map(|cell| {
            let statistics = cell.output(output)?.measures.get(&measure)?;
            kept(statistics.count, cell.trials)
        });
        shares.reduce(f64::min)
    }

    /// Returns the ratio of two methods' times. A time is the median of repetitions with known quartiles. The
    /// repetitions share the state of the machine, so their number does not reduce the error. The error is therefore
    /// the standard deviation of one repetition, (q75 - q25) / 1.349.
    fn time(self, cell: usize, method: &str, to: &str) -> Result<Known, Missing> {
        let relative = |method: &str| {
            let mut times = self.times.iter();
            let time = times.find(|time| time.cell == cell && time.method == method);
            let time = time.ok_or_else(|| {
                format!("no times of '{method}' were measured; they need timing = true")
            })?;
            let error = (time.q75_seconds - time.q25_seconds) / 1.349;
            Ok::<_, Missing>((time.median_seconds, error / time.median_seconds))
        };
        let ((first, a), (second, b)) = (relative(method)?, relative(to)?);
        let ratio = first / second;
        known((ratio, ratio * a.hypot(b)), Freedom::FIXED, true)
    }
}

fn single(known: Result<Known, Missing>) -> Result<Vec<Number>, Missing> {
    known.map(|known| vec![known.into()])
}

fn not_kept(what: &str) -> Missing {
    format!("the run did not keep {what}; a new run of the file keeps what its claims need")
}

/// Makes the numbers of a cell without randomness exact: one trial stands for all.
fn exact(mut numbers: Vec<Number>) -> Vec<Number> {
    for number in &mut numbers {
        number.known = Known::Exact(number.known.shown().0);
        number.caution = None;
    }
    numbers
}

/// Returns an estimate; its error is 0 if nothing is random.
fn estimated(cell: &CellSummary, estimate: Estimate) -> Estimate {
    Estimate {
        mcse: if cell.deterministic {
            0.0
        } else {
            estimate.mcse
        },
        ..estimate
    }
}

fn in_cell(cell: &CellSummary, test: &ClaimTest) -> Result<Vec<Number>, Missing> {
    let output = cell.output(&test.output);
    let output = output.ok_or_else(|| format!("the results have no output '{}'", test.output))?;
    let numbers = match &test.kind {
        TestKind::Outcome(outcome) => single(outcome_count(cell, output, *outcome)),
        TestKind::Bound(bound) => single(bound_count(cell, &test.output, bound)),
        TestKind::Wins { measure, to } => single(wins(cell, &test.output, to, *measure)),
        TestKind::Value {
            what: ValueOf::Measure(measure),
            statistic,
        } => value(cell, output, *measure, *statistic).map(|number| vec![number]),
        TestKind::Value { what, statistic } => {
            let name = match what {
                ValueOf::Parameter(name) => Some(name),
                _ => None,
            };
            match statistic {
                ClaimStatistic::Coverage => coverages(cell, output, name),
                _ => biases(cell, output, name),
            }
        }
        TestKind::Ratio {
            measure,
            to,
            measure_of_to,
            statistic,
        } => match (TheoryReference::named(to), statistic) {
            (Some(reference), statistic) => {
                let measures = [*measure, *measure_of_to];
                over_theory(cell, output, measures, reference, *statistic)
                    .map(|number| vec![number])
            }
            (None, ClaimStatistic::Median) => single(ratio_of_medians(
                cell,
                [(&test.output, *measure), (to, *measure_of_to)],
            )),
            (None, statistic) => {
                ratio(cell, &test.output, to, *measure, *statistic).map(|number| vec![number])
            }
        },
        TestKind::Cells { .. } | TestKind::Slope(_) | TestKind::Time { .. } => Ok(Vec::new()),
    }?;
    Ok(if cell.deterministic {
        exact(numbers)
    } else {
        numbers
    })
}

/// The largest relative error with which a ratio is judged. Beyond it, the logarithm is not nearly normal.
const MOST_RELATIVE_ERROR: f64 = 0.5;

/// Returns an estimate with its standard error; without error it is exact.
fn known(
    (value, error): (f64, f64),
    freedom: Freedom,
    logarithmic: bool,
) -> Result<Known, Missing> {
    if !value.is_finite() || logarithmic && value <= 0.0 {
        Err("the number is undefined".to_owned())
    } else if logarithmic && error > MOST_RELATIVE_ERROR * value {
        Err("its standard error is more than half its value".to_owned())
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
    let count = match outcome {
        Outcome::Failed => output.outcomes.failed(),
        Outcome::Unstable => output.outcomes.unstable,
        Outcome::Lost => output.outcomes.lost,
    };
    count_of(count, cell.trials)
}

fn count_of(count: u64, total: u64) -> Result<Known, Missing> {
    if total == 0 {
        Err("there is no trial to count".to_owned())
    } else {
        Ok(Known::Count { count, total })
    }
}

fn bound_count(cell: &CellSummary, label: &str, bound: &BoundTable) -> Result<Known, Missing> {
    let found = cell
        .bounds
        .iter()
        .find(|summary| summary.bound.limits() == bound.limits());
    let output =
        found.and_then(|summary| summary.outputs.iter().find(|output| output.output == label));
    let what = || {
        not_kept(&format!(
            "the share of trials with {} {}",
            bound.measure,
            bound.text()
        ))
    };
    let met = output.ok_or_else(what)?.met;
    count_of(met.count, met.total)
}

fn compared<'a>(
    cell: &'a CellSummary,
    output: &str,
    to: &str,
    measure: Measure,
) -> Result<&'a PairedStatistics, Missing> {
    let mut pairs = cell.comparisons.iter();
    let pair = pairs.find(|pair| pair.first == output && pair.second == to);
    let found = pair.and_then(|pair| pair.measures.get(&measure));
    found.ok_or_else(|| {
        not_kept(&format!(
            "the comparison of '{output}' with '{to}' in {measure}"
        ))
    })
}

fn wins(cell: &CellSummary, output: &str, to: &str, measure: Measure) -> Result<Known, Missing> {
    let smaller = compared(cell, output, to, measure)?.share_smaller;
    let count = match measure.worse() {
        Worse::Larger => smaller.count,
        Worse::Smaller => smaller.total - smaller.count,
    };
    if smaller.total == 0 {
        return Err("all trials are ties".to_owned());
    }
    count_of(count, smaller.total)
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
    let statistics = statistics(output, measure)?;
    let quantile = |q: f64, of_q: Quantile| Ok(quantile(statistics, q, of_q, measure).into());
    match statistic {
        ClaimStatistic::Mean => moment(cell, statistics, 1, measure),
        ClaimStatistic::Rms => moment(cell, statistics, 2, measure),
        ClaimStatistic::Q05 => quantile(0.05, statistics.q05),
        ClaimStatistic::Q25 => quantile(0.25, statistics.q25),
        ClaimStatistic::Q75 => quantile(0.75, statistics.q75),
        ClaimStatistic::Q95 => quantile(0.95, statistics.q95),
        _ => quantile(0.5, statistics.q50),
    }
}

/// Returns a mean (power 1) or root mean square (power 2) over the trials that have the measure.
fn moment(
    cell: &CellSummary,
    statistics: &Statistics,
    power: u8,
    measure: Measure,
) -> Result<Number, Missing> {
    let count = statistics.count;
    let estimate = if power == 1 {
        statistics.mean
    } else {
        statistics.rmse
    };
    let estimate = estimated(cell, estimate);
    let found = if power == 1 && statistics.min < 0.0 {
        let sum = Sum::about_mean(statistics, measure.name());
        moment::signed(estimate, statistics.sd.value, count, sum)
    } else {
        let sum = Sum::of_powers(statistics, power, measure);
        moment::not_negative(estimate, count, power, sum)
    };
    Ok(Number {
        kept: kept(count, cell.trials),
        ..Number::of_moment(found)?
    })
}

fn kept(count: u64, total: u64) -> Option<f64> {
    (count < total).then(|| count as f64 / total as f64)
}

/// Returns a quantile over all trials.
fn quantile(statistics: &Statistics, q: f64, quantile: Quantile, measure: Measure) -> Known {
    let (n, lost) = (
        statistics.count + statistics.undefined,
        statistics.undefined,
    );
    // Lost trials rank below or above the others.
    let (below, end) = match measure.worse() {
        Worse::Larger => (0, (f64::INFINITY, statistics.count)),
        Worse::Smaller => (lost, (f64::NEG_INFINITY, lost)),
    };
    let value = if quantile.lost { end.0 } else { quantile.value };
    let extremes = [
        (statistics.min, below + 1),
        (statistics.max, below + statistics.count),
    ];
    let quantiles = [0.05, 0.25, 0.5, 0.75, 0.95].into_iter();
    let quantiles = quantiles.zip(statistics.quantiles.all().map(|quantile| quantile.value));
    let points = at_ranks(quantiles, n).chain(extremes).chain([end]);
    ranks(q, n, (value, quantile.mcse), points, false)
}

/// Returns quantiles of n values with their ranks. A quantile lies between the values of ranks j and j + 1, or equals
/// one of them; j is q (n - 1) rounded down, ranks from 0.
fn at_ranks(
    quantiles: impl Iterator<Item = (f64, f64)>,
    n: u64,
) -> impl Iterator<Item = (f64, u64)> {
    let rank = move |q: f64| (q * n.saturating_sub(1) as f64) as u64 + 1;
    quantiles.map(move |(q, x)| (x, rank(q)))
}

/// Returns a quantile with its standard error, or, if it has none, with the ranks of known values.
fn ranks(
    q: f64,
    total: u64,
    (value, error): (f64, f64),
    points: impl Iterator<Item = (f64, u64)>,
    logarithmic: bool,
) -> Known {
    let is_near_normal = value.is_finite() && error > 0.0 && error.is_finite();
    if is_near_normal && !(logarithmic && error > MOST_RELATIVE_ERROR * value) {
        return Known::Estimate {
            value,
            error,
            freedom: Freedom::of_quantile(q, total),
            logarithmic,
        };
    }
    Known::Ranks {
        value,
        q,
        total,
        points: points.filter(|(x, _)| !x.is_nan()).collect(),
    }
}

/// Returns the ratio of two outputs on the same trials. A trial that one of them loses makes the ratio infinite or 0.
fn ratio(
    cell: &CellSummary,
    output: &str,
    to: &str,
    measure: Measure,
    statistic: ClaimStatistic,
) -> Result<Number, Missing> {
    let pair = compared(cell, output, to, measure)?;
    if statistic != ClaimStatistic::Rms {
        return Ok(paired_median(pair, measure).into());
    }
    let sum = |label: &str| {
        let output = cell.output(label);
        let output = output.ok_or_else(|| format!("the results have no output '{label}'"))?;
        Ok::<_, Missing>(Sum::of_powers(statistics(output, measure)?, 2, measure))
    };
    let sums = [sum(output)?, sum(to)?];
    let ratio = estimated(cell, pair.rmse_ratio);
    Ok(Number {
        kept: kept(pair.both, pair.trials()),
        ..Number::of_moment(moment::ratio(ratio, pair.both, sums))?
    })
}

/// Returns the median ratio of two outputs, or of two cells, over all trials.
fn paired_median(pair: &PairedStatistics, measure: Measure) -> Known {
    let all = pair.trials();
    let (zero, infinite) = match measure.worse() {
        Worse::Larger => (pair.only_first, pair.only_second),
        Worse::Smaller => (pair.only_second, pair.only_first),
    };
    let value = match pair.median_ratio {
        quantile if !quantile.lost => quantile.value,
        _ if zero > infinite => 0.0,
        _ => f64::INFINITY,
    };
    let quantiles = [
        (0.05, pair.ratio_q05.value),
        (0.25, pair.ratio_q25.value),
        (0.5, pair.median_ratio.value),
        (0.75, pair.ratio_q75.value),
        (0.95, pair.ratio_q95.value),
    ];
    let zero = (zero > 0).then_some((0.0, zero));
    let infinite = (infinite > 0).then_some((f64::INFINITY, all - infinite));
    // Ratios below 1, and ratios equal to 1.
    let (smaller, ties) = (pair.share_smaller.count, pair.ties);
    let ones = [(1.0, smaller), (1.0, smaller + ties)];
    let points = at_ranks(quantiles.into_iter(), all).chain(ones);
    let points = points.chain(zero).chain(infinite);
    ranks(0.5, all, (value, pair.median_ratio.mcse), points, true)
}

/// Returns the ratio of two medians on the same trials. With the relative errors a and b of the medians and their
/// correlation rho, the square of its own is `a^2 + b^2 - 2 rho a b`, but not below what the bins of the sketch leave.
/// Without a stored correlation, as in folders of older versions, the medians are treated as independent. A median among
/// failed trials makes the ratio infinite or 0.
fn ratio_of_medians(cell: &CellSummary, medians: [(&str, Measure); 2]) -> Result<Known, Missing> {
    let mut found = Vec::with_capacity(2);
    for (label, measure) in medians {
        let output = cell.output(label);
        let output = output.ok_or_else(|| format!("the results have no output '{label}'"))?;
        found.push(statistics(output, measure)?);
    }
    let [first, second] = [found[0], found[1]];
    let by_lost = |value: f64, point: (f64, u64)| Known::Ranks {
        value,
        q: 0.5,
        total: cell.trials,
        points: vec![point],
    };
    match (first.q50.lost, second.q50.lost) {
        (true, true) => return Err("both medians are those of failed trials".to_owned()),
        (true, false) => return Ok(by_lost(f64::INFINITY, (f64::INFINITY, first.count))),
        (false, true) => return Ok(by_lost(0.0, (0.0, second.undefined))),
        (false, false) => {}
    }
    let [(of, measure), (to, measure_of_to)] = medians;
    let mut pairs = cell.medians.iter();
    let pair = pairs.find(|pair| {
        let table = &pair.table;
        (table.output.as_str(), table.measure) == (of, measure)
            && (table.to.as_str(), table.measure_of_to) == (to, measure_of_to)
    });
    let correlation = pair.map_or(0.0, |pair| pair.correlation);
    let (first, second) = (first.q50, second.q50);
    let ratio = first.value / second.value;
    let (a, b) = (first.mcse / first.value, second.mcse / second.value);
    let square = a * a + b * b - 2.0 * correlation * a * b;
    let of_bins = 2.0 * (SKETCH_ERROR / Z).powi(2);
    // Not a number if there are too few trials for the error of a median.
    let relative = if square < of_bins { of_bins } else { square }.sqrt();
    let error = if cell.deterministic {
        0.0
    } else {
        ratio * relative
    };
    known((ratio, error), Freedom::of_quantile(0.5, cell.trials), true)
}

/// Returns the ratio of a median or root mean square to that of theory or of a bound, which has no error.
fn over_theory(
    cell: &CellSummary,
    output: &OutputSummary,
    [measure, of_theory]: [Measure; 2],
    reference: TheoryReference,
    statistic: ClaimStatistic,
) -> Result<Number, Missing> {
    let theory = output.theory.get(&of_theory);
    let theory = theory.and_then(|theory| theory.reference(reference));
    let theory = theory.ok_or_else(|| {
        let label = output.label();
        format!("there is no {reference} of {of_theory} for '{label}' here")
    })?;
    let statistics = statistics(output, measure)?;
    if statistic == ClaimStatistic::Rms {
        let mut number = moment(cell, statistics, 2, measure)?;
        number.known = number.known.over(theory.rms);
        return Ok(number);
    }
    let median = statistics.q50;
    if median.lost {
        let known = Known::Ranks {
            value: f64::INFINITY,
            q: 0.5,
            total: cell.trials,
            points: vec![(f64::INFINITY, statistics.count)],
        };
        return Ok(known.into());
    }
    let error = if cell.deterministic { 0.0 } else { median.mcse };
    let ratio = (median.value / theory.median, error / theory.median);
    Ok(known(ratio, Freedom::of_quantile(0.5, cell.trials), true)?.into())
}

/// Returns the shares of 95 % intervals that contain the truth, for one coefficient or for all with a standard error.
fn coverages(
    cell: &CellSummary,
    output: &OutputSummary,
    name: Option<&String>,
) -> Result<Vec<Number>, Missing> {
    let named = output.coverage.iter();
    let wanted = named.filter(|(parameter, _)| name.is_none_or(|name| name == parameter));
    let shares: Result<Vec<Number>, Missing> = wanted
        .map(|(parameter, coverage)| {
            let Share { count, total, .. } = coverage.covered;
            Ok(Number {
                name: Some(parameter.clone()),
                kept: kept(total, cell.trials),
                ..count_of(count, total)?.into()
            })
        })
        .collect();
    let shares = shares?;
    if shares.is_empty() {
        return Err(format!(
            "no coefficient of '{}' has a standard error; a run keeps them if coverage = true",
            output.label()
        ));
    }
    Ok(shares)
}

/// Returns the mean signed error over its standard deviation, delta = m / s, for one coefficient or for all. By the
/// delta method Var delta is `(Var m + delta^2 Var s - 2 delta Cov(m, s)) / s^2` with `Cov(m, s) = s^2 g / (2 M)`, where
/// g is the skewness of the errors.
fn biases(
    cell: &CellSummary,
    output: &OutputSummary,
    name: Option<&String>,
) -> Result<Vec<Number>, Missing> {
    let named = output.parameters.iter();
    // A coefficient that a delay makes 0 in every model has no errors at all.
    let estimated = |errors: &Statistics| errors.mean.value != 0.0 || errors.sd.value != 0.0;
    let wanted = named.filter(|(parameter, errors)| match name {
        Some(name) => name == parameter,
        None => estimated(errors),
    });
    let biases: Result<Vec<Number>, Missing> = wanted
        .map(|(parameter, errors)| {
            let (mean, sd) = (errors.mean, errors.sd);
            let delta = mean.value / sd.value;
            let m = errors.count as f64;
            // Older versions did not store the skewness.
            let skewness = Some(errors.skewness)
                .filter(|g| g.is_finite())
                .unwrap_or(0.0);
            let [of_mean, of_sd] = [mean.mcse / sd.value, delta * sd.mcse / sd.value];
            let square = of_mean * of_mean + of_sd * of_sd - delta * skewness / m;
            // Not a number if there are too few trials for the error of the standard deviation.
            let error = square.sqrt();
            let estimate = Estimate {
                value: delta,
                mcse: error,
            };
            let sum = Sum::about_mean(errors, &format!("the error of {parameter}"));
            Ok(Number {
                name: Some(parameter.clone()),
                kept: kept(errors.count, cell.trials),
                ..Number::of_moment(moment::bias(estimate, errors.count, sum))?
            })
        })
        .collect();
    let biases = biases?;
    if biases.is_empty() {
        return Err(not_kept("the errors of the coefficients"));
    }
    Ok(biases)
}
