//! C1 to C3: bounds on single runs, taken as bounds of a typical realisation.
//!
//! A bound is met typically where Wilson's 95 % interval of the share of realisations that meet it lies above 1/2.

use super::{Finding, Number, Studies, count_of, listed};
use crate::metric::{Quantile, Share, Verdict as Typical, verdict};
use crate::report::html::Verdict;
use crate::report::number::uncertain;
use crate::report::results::{Study, is_default, measure_name, median, shown, words};
use crate::report::table::share;
use crate::study::file::Key;
use crate::study::{CellSummary, Measure};

/// The share of the last output that meets each bound, as "e_a < 0.033".
struct Met {
    name: String,
    measure: Measure,
    share: Share,
}

fn met(cell: &CellSummary, output: &str) -> Vec<Met> {
    let of = cell.bounds.iter().filter_map(|bound| {
        let found = bound.outputs.iter().find(|share| share.output == output)?;
        let measure = bound.bound.measure;
        Some(Met {
            name: format!("{} {}", measure_name(measure), bound.bound.text()),
            measure,
            share: found.met,
        })
    });
    of.collect()
}

fn typical(met: &[Met]) -> bool {
    !met.is_empty() && met.iter().all(|of| verdict(of.share) == Typical::Typical)
}

/// C1, C2 or C3.
pub(super) fn bounds(studies: Studies<'_>, id: &str) -> Finding {
    let Some(study) = studies.named("nikolov2023") else {
        return Finding::not_run("nikolov2023");
    };
    let cells = study.cells(&[(Key::Claim, id)]);
    let (Some(cell), Some(output)) = (cells.first(), study.main_output()) else {
        return Finding::undecided(study, "The results have no cell of this claim.");
    };
    let shares = met(cell, &output);
    if shares.is_empty() {
        return Finding::undecided(study, "The results count no bound of this claim.");
    }
    let count = |which: Typical| {
        shares
            .iter()
            .filter(|of| verdict(of.share) == which)
            .count()
    };
    let [yes, no] = [Typical::Typical, Typical::NotTypical].map(count);
    let mut found = super::settle(yes, no, shares.len() - yes - no);
    let texts: Vec<String> = shares
        .iter()
        .map(|of| format!("{} in {}", of.name, share(of.share)))
        .collect();
    let mut because = format!(
        "Of {} realisations {} meets {}.",
        cell.trials,
        shown(&output),
        listed(&texts)
    );
    if let Some(multiple) = cell.bounds.iter().find_map(|of| of.bound.rounding) {
        because.push_str(&format!(
            " \"= 0\" means below {multiple} eps times the condition number."
        ));
    }
    let (grid, exists, best) = readings(studies, id).unwrap_or_default();
    if exists && found == Verdict::DoesNotHold {
        found = Verdict::HoldsOnlyIf;
    }
    let number = |of: &Met| {
        Number::new(
            format!("share with {}", of.name),
            of.share.share,
            of.share.mcse,
        )
    };
    Finding::new(study, found, because)
        .numbers(shares.iter().map(number).chain(best).collect())
        .part("c2-c3", &grid)
        .part("noise-level", &levels(studies, cell))
}

const RELATIVE: [Measure; 3] = [Measure::Ea, Measure::Eb, Measure::ExMax];

/// What the best combination of readings reaches, and whether one makes all bounds typical.
fn readings(studies: Studies<'_>, id: &str) -> Option<(String, bool, Vec<Number>)> {
    let study = studies.named("c2-c3")?;
    let cells = study.cells(&[(Key::Claim, id)]);
    let mut best: Vec<(Met, String)> = Vec::new();
    let mut all: Option<String> = None;
    let mut combinations = 0;
    for cell in cells {
        for output in &cell.outputs {
            let label = output.label();
            let (plain, printed): (Vec<Met>, Vec<Met>) = met(cell, &label)
                .into_iter()
                .partition(|of| RELATIVE.contains(&of.measure));
            for group in [plain, printed]
                .into_iter()
                .filter(|group| !group.is_empty())
            {
                combinations += 1;
                let name = combination(study, cell, &label);
                if typical(&group) && all.is_none() {
                    all = Some(name.clone());
                }
                for of in group {
                    improve(&mut best, of, &name);
                }
            }
        }
    }
    best.sort_by(|a, b| b.0.share.share.total_cmp(&a.0.share.share));
    let numbers = best.iter().map(|(of, name)| {
        let name = format!("largest share with {}: {name}", of.name);
        Number::new(name, of.share.share, of.share.mcse)
    });
    let numbers = numbers.collect();
    let text =
        |(of, name): &(Met, String)| format!("{} in {} with {name}", of.name, share(of.share));
    let (relative, printed): (Vec<_>, Vec<_>) = best
        .iter()
        .partition(|(of, _)| RELATIVE.contains(&of.measure));
    let largest: Vec<String> = [relative.first(), printed.first()]
        .into_iter()
        .flatten()
        .map(|of| text(of))
        .collect();
    if largest.is_empty() {
        return None;
    }
    let singly = best
        .iter()
        .filter(|(of, _)| verdict(of.share) == Typical::Typical)
        .count();
    let found = all.as_ref().map_or_else(
        || match singly {
            0 => "none makes any of the bounds typical".to_owned(),
            _ => format!(
                "none makes all of the bounds typical; singly, {} can be",
                count_of(singly, best.len())
            ),
        },
        |name| format!("all are typical with {name}"),
    );
    let text = format!(
        " Over {combinations} combinations of readings {found}; the largest shares are {}.",
        listed(&largest)
    );
    Some((text, all.is_some(), numbers))
}

fn improve(best: &mut Vec<(Met, String)>, of: Met, name: &str) {
    match best
        .iter_mut()
        .find(|(known, _)| known.measure == of.measure)
    {
        Some(known) if known.0.share.share < of.share.share => *known = (of, name.to_owned()),
        Some(_) => {}
        None => best.push((of, name.to_owned())),
    }
}

/// The settings of a cell that are not at their default, and the output.
fn combination(study: &Study, cell: &CellSummary, output: &str) -> String {
    let keys = study
        .varying()
        .into_iter()
        .filter(|key| *key != Key::Claim && !is_default(cell, *key));
    let words = keys.map(|key| words(key, &cell.setting(key)));
    [shown(output)]
        .into_iter()
        .chain(words)
        .collect::<Vec<_>>()
        .join(", ")
}

/// At which noise level each bound is the median.
fn levels(studies: Studies<'_>, of: &CellSummary) -> String {
    let Some((study, output)) = studies
        .named("noise-level")
        .and_then(|s| Some((s, s.main_output()?)))
    else {
        return String::new();
    };
    let cells = study.cells(&[(Key::Window, of.window.to_string().as_str())]);
    let bounds = of
        .bounds
        .iter()
        .filter(|bound| RELATIVE.contains(&bound.bound.measure));
    let texts: Vec<String> = bounds
        .filter_map(|bound| {
            let (measure, limit) = (bound.bound.measure, bound.bound.below?);
            let level = crossing(&cells, &output, measure, limit)?;
            Some(format!(
                "{} % ({})",
                uncertain(level.value, level.mcse),
                measure_name(measure)
            ))
        })
        .collect();
    if texts.is_empty() {
        return String::new();
    }
    format!(
        " The printed bounds are the medians at eta = {}.",
        listed(&texts)
    )
}

/// Where the median over eta crosses a limit, by interpolation in logarithms; its error is that of the median
/// over the slope there.
pub(super) fn crossing(
    cells: &[&CellSummary],
    output: &str,
    measure: Measure,
    limit: f64,
) -> Option<Quantile> {
    let mut points: Vec<(f64, Quantile)> = cells
        .iter()
        .map(|cell| (cell.eta, median(cell, output, measure)))
        .collect();
    points.retain(|(eta, of)| *eta > 0.0 && of.value > 0.0);
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.windows(2).find_map(|pair| {
        let [(eta, low), (next, high)] = [pair[0], pair[1]];
        if !(low.value < limit && limit <= high.value) {
            return None;
        }
        let slope = (high.value / low.value).ln() / (next / eta).ln();
        let value = eta * ((limit / low.value).ln() / slope).exp();
        let [relative, other] = [low, high].map(|of| of.mcse / of.value);
        // Not `f64::max`, which would leave out an end without standard error.
        let relative = if relative.is_nan() || other < relative {
            relative
        } else {
            other
        };
        Some(Quantile {
            value,
            mcse: value * relative / slope,
            lost: false,
        })
    })
}
