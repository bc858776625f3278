//! Statistics of one measure of one output of a cell.

use crate::claim::known::{Bound, Known};
use crate::claim::ranked::{Group, Ranked};
use crate::claim::statistics::number::{Missing, Number, not_kept};
use crate::design::Measure;
use crate::design::file::{Assumption, ClaimTest};
use crate::outcome::summary::{CellSummary, OutputSummary};
use asobench_identification::metric::{Estimate, Quantile, Statistics, Worse};

pub(crate) fn count_of(count: u64, total: u64) -> Result<Known, Missing> {
    if total == 0 {
        Err("there is no trial to count".to_owned())
    } else {
        Ok(Known::Share { count, total })
    }
}

pub(crate) fn statistics(output: &OutputSummary, measure: Measure) -> Result<&Statistics, Missing> {
    let found = output.measures.get(&measure);
    found.ok_or_else(|| not_kept(&format!("the measure {measure}")))
}

/// Returns the values of a measure over all trials.
pub(crate) fn ranked(output: &OutputSummary, measure: Measure) -> Result<Ranked, Missing> {
    let statistics = statistics(output, measure)?;
    let label = output.label();
    let sketch = output.sketches.get(&measure);
    let sketch = sketch.ok_or_else(|| not_kept(&format!("the distribution of {measure} of '{label}'")))?;
    if statistics.count + statistics.undefined == 0 {
        return Err("there are no trials".to_owned());
    }
    Ok(Ranked::of_measure(sketch, statistics, measure))
}

/// Returns a quantile over all trials.
pub(crate) fn quantile(
    output: &OutputSummary,
    measure: Measure,
    (q, found): (f64, Quantile),
) -> Result<Known, Missing> {
    let value = match measure.worse() {
        _ if !found.lost => found.value,
        Worse::Larger => f64::INFINITY,
        Worse::Smaller => f64::NEG_INFINITY,
    };
    let (error, ranked) = (found.mcse, ranked(output, measure)?);
    Ok(Known::Quantile {
        q,
        value,
        error,
        ranked,
    })
}

/// Returns a mean (power 1) or root mean square (power 2): over the trials that have the measure, or with a cap over
/// all of them.
pub(crate) fn moment(
    cell: &CellSummary,
    output: &OutputSummary,
    (measure, power): (Measure, i32),
    test: &ClaimTest,
) -> Result<Number, Missing> {
    let statistics = statistics(output, measure)?;
    let ranked = ranked(output, measure)?;
    if let Some(Assumption::Cap(cap)) = test.assumption {
        return Ok(capped(&ranked, cap, power).into());
    }
    let estimate = if power == 1 { statistics.mean } else { statistics.rmse };
    let finite = ranked.groups().iter();
    let finite: Vec<&Group> = finite.filter(|group| group.lowest.is_finite()).collect();
    let bets = |values: Vec<(f64, f64)>, top| Bound::Bets { values, top };
    let counted = |value: &dyn Fn(&Group) -> f64| {
        let pairs = finite.iter().map(|group| (value(group), group.count as f64));
        pairs.collect::<Vec<_>>()
    };
    let from_zero = || {
        let smallest = |group: &Group| group.lowest.abs().min(group.highest.abs());
        bets(counted(&|group| smallest(group).powi(power)), None)
    };
    let [below, above] = match (measure.highest(), test.assumption) {
        (Some(top), _) if power == 1 => [
            bets(counted(&|group| top - group.highest.min(top)), Some(top)),
            Bound::Unknown,
        ],
        (_, Some(Assumption::Kurtosis(kurtosis))) => [
            Bound::Kurtosis {
                kurtosis,
                mean_square: statistics.mse.value,
                count: statistics.count as f64,
            },
            from_zero(),
        ],
        _ => [Bound::Unknown, from_zero()],
    };
    number(estimate, power, [below, above], test).map(|number| Number {
        kept: kept(statistics.count, cell.trials),
        ..number
    })
}

/// Returns a moment of `min(x, cap)` over all trials, in which lost ones count as the cap.
fn capped(ranked: &Ranked, cap: f64, power: i32) -> Known {
    let values = |of: &dyn Fn(&Group) -> f64| {
        let groups = ranked.groups().iter();
        let pairs = groups.map(|group| (of(group).min(cap).powi(power), group.count as f64));
        pairs.collect::<Vec<_>>()
    };
    let top = cap.powi(power);
    let middle = values(&|group| f64::midpoint(group.lowest, group.highest));
    let n = ranked.total() as f64;
    let mean = middle.iter().map(|(y, count)| y * count).sum::<f64>() / n;
    let squares = middle.iter().map(|(y, count)| count * (y - mean) * (y - mean));
    let error = (squares.sum::<f64>() / (n - 1.0) / n).sqrt();
    let (value, error) = match power {
        1 => (mean, error),
        _ => (mean.sqrt(), error / (2.0 * mean.sqrt())),
    };
    let mut lacks = values(&|group| group.highest);
    for (y, _) in &mut lacks {
        *y = top - *y;
    }
    let below = Bound::Bets {
        values: lacks,
        top: Some(top),
    };
    let above = Bound::Bets {
        values: values(&|group| group.lowest),
        top: None,
    };
    Known::Moment {
        value,
        error,
        power,
        unit: 1.0,
        bounds: Box::new([below, above]),
    }
}

/// Returns a moment with its bounds, and why it stays open if the side of its limit cannot be known.
pub(crate) fn number(
    Estimate { value, mcse: error }: Estimate,
    power: i32,
    bounds: [Bound; 2],
    test: &ClaimTest,
) -> Result<Number, Missing> {
    if !value.is_finite() {
        return Err("the number is undefined".to_owned());
    }
    let [low, high] = test.limit.ends();
    let [below, above] = &bounds;
    let unknown = |bound: &Bound, end: f64| *bound == Bound::Unknown && end.is_finite();
    let caution = if unknown(below, high) {
        Some("from above")
    } else if unknown(above, low) {
        Some("from below")
    } else {
        None
    };
    let caution = caution.map(|side| {
        let instead = test.instead();
        format!("no number of trials bounds this number {side} under every law; {instead}")
    });
    Ok(Number {
        caution,
        ..Known::Moment {
            value,
            error,
            power,
            unit: 1.0,
            bounds: Box::new(bounds),
        }
        .into()
    })
}

pub(crate) fn kept(count: u64, total: u64) -> Option<f64> {
    (count < total).then(|| count as f64 / total as f64)
}
