//! C5: does the iteration converge, are four passes enough.
//!
//! A cell converges where less than 1 % of its trials fail or are unstable at the last pass (the upper end of the
//! 95 % interval); four passes are enough where the median of e_a of pass 4 over that of the last pass, on the same trials where
//! the file compares them, is within 5 % of 1.

use super::{Finding, Number, Ratio, Standing, Studies, condition, count_of, settle};
use crate::metric::Share;
use crate::report::results::{Study, median, place};
use crate::report::table::share;
use crate::study::{CellSummary, Measure, OutputSummary};

/// The largest share of failed or unstable trials of an iteration that converges.
const LOST: f64 = 0.01;

/// Trials that fail or leave an unstable model; a failed trial may be unstable too, so at most this.
fn lost(output: &OutputSummary) -> Share {
    let outcomes = &output.outcomes;
    Share::new(
        (outcomes.failed() + outcomes.unstable).min(outcomes.trials),
        outcomes.trials,
    )
}

/// C5.
pub(super) fn four_passes(studies: Studies<'_>) -> Finding {
    let Some(study) = studies.named("convergence") else {
        return Finding::not_run("convergence");
    };
    let passes = study.summary.cells.iter().flat_map(|cell| &cell.outputs);
    let last = passes
        .filter(|of| of.estimator == "iv")
        .map(|of| of.pass)
        .max()
        .unwrap_or(0);
    if last <= 4 {
        return Finding::undecided(study, "The results have no pass beyond the fourth.");
    }
    let label = format!("iv({last})");
    let cells: Vec<Judged<'_>> = study
        .summary
        .cells
        .iter()
        .filter_map(|cell| judge(cell, &label))
        .collect();
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    for cell in &cells {
        match (cell.converges, cell.enough) {
            (Some(true), Some(true)) => good.push(cell),
            (Some(false), _) | (_, Some(false)) => bad.push(cell),
            _ => {}
        }
    }
    let all = cells.len();
    let verdict = settle(good.len(), bad.len(), all - good.len() - bad.len());
    let converging = cells
        .iter()
        .filter(|cell| cell.converges == Some(true))
        .count();
    let enough = cells
        .iter()
        .filter(|cell| cell.enough == Some(true))
        .count();
    let mut because = format!(
        "At pass {last} less than 1 % of the trials are failed or unstable in {} cells; {}. The median e_a of pass 4 is within 5 % of that of pass {last} in {} cells{}.",
        count_of(converging, all),
        most_lost(study, &cells),
        count_of(enough, all),
        farthest(study, &cells),
    );
    let [held, refuted]: [Vec<&CellSummary>; 2] =
        [&good, &bad].map(|of| of.iter().map(|of| of.cell).collect());
    because.push_str(&settled(study, &label));
    because.push_str(&rescued(study, last));
    let numbers = cells
        .iter()
        .filter_map(|of| {
            Some(of.ratio?.number(format!(
                "e_a, pass 4 over {last}: {}",
                place(of.cell, &study.varying())
            )))
        })
        .chain(cells.iter().map(|of| {
            let name = format!(
                "failed or unstable, pass {last}: {}",
                place(of.cell, &study.varying())
            );
            Number::new(name, of.lost.share, of.lost.mcse)
        }));
    Finding::new(study, verdict, because)
        .numbers(numbers.collect())
        .led_by(&condition(study, &held, &refuted))
}

struct Judged<'a> {
    cell: &'a CellSummary,
    lost: Share,
    ratio: Option<Ratio>,
    converges: Option<bool>,
    enough: Option<bool>,
}

fn judge<'a>(cell: &'a CellSummary, last: &str) -> Option<Judged<'a>> {
    let lost = lost(cell.output(last)?);
    let pair = cell
        .comparisons
        .iter()
        .find(|pair| pair.first == "iv(4)" && pair.second == last);
    let paired = pair.and_then(|pair| Ratio::paired(pair.measures.get(&Measure::Ea)?.median_ratio));
    let ratio = paired.or_else(|| {
        Ratio::of(
            median(cell, "iv(4)", Measure::Ea),
            median(cell, last, Measure::Ea),
        )
    });
    let standing = ratio.map(Ratio::standing);
    Some(Judged {
        cell,
        lost,
        ratio,
        converges: if lost.high < LOST {
            Some(true)
        } else {
            (lost.low > LOST).then_some(false)
        },
        enough: match standing {
            Some(Standing::Same) => Some(true),
            Some(Standing::Above | Standing::Below) => Some(false),
            _ => None,
        },
    })
}

/// In how many trials the iteration has come to rest, between which cells: the shares that meet a bound on the change.
fn settled(study: &Study, label: &str) -> String {
    let of_cell = |cell: &CellSummary| {
        let bounds = cell.bounds.iter();
        let mut of_change = bounds.filter(|of| of.bound.measure == Measure::Change);
        let bound = of_change.find(|of| of.bound.below.is_some())?;
        let output = bound.outputs.iter().find(|of| of.output == label)?;
        Some((
            output.met,
            bound.bound.below?,
            place(cell, &study.varying()),
        ))
    };
    let mut shares: Vec<(Share, f64, String)> =
        study.summary.cells.iter().filter_map(of_cell).collect();
    shares.sort_by(|(a, ..), (b, ..)| a.share.total_cmp(&b.share));
    let (Some((least, below, at_least)), Some((most, _, at_most))) =
        (shares.first(), shares.last())
    else {
        return String::new();
    };
    format!(
        " That pass changes a by less than {below} of itself in {} of the trials ({at_least}) to {} ({at_most}); what is neither settled nor lost oscillates.",
        share(*least),
        share(*most)
    )
}

/// Where most trials are lost.
fn most_lost(study: &Study, cells: &[Judged<'_>]) -> String {
    let most = cells
        .iter()
        .max_by(|a, b| a.lost.share.total_cmp(&b.lost.share));
    most.map_or_else(String::new, |of| {
        let place = place(of.cell, &study.varying());
        format!("most are lost at {place}: {}", share(of.lost))
    })
}

/// Where the fourth pass is farthest from the last.
fn farthest(study: &Study, cells: &[Judged<'_>]) -> String {
    let far = |of: &Judged<'_>| of.ratio.map_or(0.0, |ratio| ratio.value.ln().abs());
    let most = cells.iter().max_by(|a, b| far(a).total_cmp(&far(b)));
    most.and_then(|of| Some((of, of.ratio?)))
        .map_or_else(String::new, |(of, ratio)| {
            let place = place(of.cell, &study.varying());
            format!(
                "; the ratio is farthest from 1 at {place}: {}",
                ratio.text()
            )
        })
}

/// What reflecting unstable poles saves, and what it costs the others.
fn rescued(study: &Study, last: usize) -> String {
    let (mut plain, mut reflected) = ([0, 0], [0, 0]);
    let mut ratios: Vec<f64> = Vec::new();
    for cell in &study.summary.cells {
        let outputs = (
            cell.output(&format!("iv({last})")),
            cell.output(&format!("iv-reflect({last})")),
        );
        let (Some(one), Some(other)) = outputs else {
            continue;
        };
        for (sums, of) in [(&mut plain, one), (&mut reflected, other)] {
            let lost = lost(of);
            sums[0] += lost.count;
            sums[1] += lost.of;
        }
        let pair = cell.comparisons.iter().find(|pair| {
            pair.first == format!("iv-reflect({last})") && pair.second == format!("iv({last})")
        });
        let ratio = pair
            .and_then(|pair| pair.measures.get(&Measure::Ea))
            .map(|of| of.median_ratio.value);
        ratios.extend(ratio.filter(|ratio| ratio.is_finite()));
    }
    if plain[1] == 0 {
        return String::new();
    }
    let [before, after] = [plain, reflected].map(|[count, of]| share(Share::new(count, of)));
    let most = ratios
        .iter()
        .map(|ratio| 100.0 * (ratio - 1.0).abs())
        .fold(0.0, f64::max);
    let cost = if ratios.is_empty() {
        String::new()
    } else {
        format!("; where both give an estimate the median ratio of e_a is within {most:.2} % of 1")
    };
    format!(
        " Reflecting unstable poles takes the lost trials of all cells from {before} to {after}{cost}."
    )
}
