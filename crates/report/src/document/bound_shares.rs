//! The figure with the shares of trials that satisfy each bound.

use super::figure::Drawn;
use super::layout::{Form, sheet};
use super::lead::lead_outputs;
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Style};
use crate::results::Study;
use crate::verdict_table::share;
use std::collections::HashMap;

/// The share of realisations that satisfy each bound: for the last output, or over all combinations of a large grid.
pub(super) fn shares(study: &Study) -> Option<Drawn> {
    const FEW: usize = 4;
    let mut names: Vec<String> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut found: Vec<Vec<(&str, asobench_identification::metric::Share)>> = Vec::new();
    for cell in &study.summary.cells {
        for bound in &cell.bounds {
            let name = format!("{}: {} {}", cell.claim, bound.bound.measure.label(), bound.bound.text());
            let name = name.trim_start_matches(": ").to_owned();
            let at = *places.entry(name).or_insert_with_key(|name| {
                names.push(name.clone());
                found.push(Vec::new());
                names.len() - 1
            });
            let outputs = bound.outputs.iter();
            found[at].extend(outputs.map(|share| (share.output.as_str(), share.met)));
        }
    }
    let most = found.iter().map(Vec::len).max()?;
    let outputs = lead_outputs(study);
    let single = most <= study.labels().len();
    let x = PlotAxis::linear("share of realisations that meet the bound, %").range(0.0, 100.0);
    let mut plot = Plot::new("", x, PlotAxis::categories("", &names));
    let what = if single {
        for (slot, label) in outputs.iter().take(FEW) {
            let points = found.iter().enumerate().filter_map(|(i, shares_met)| {
                let met = shares_met.iter().find(|(output, _)| output == label)?.1;
                Some(Point::interval(
                    100.0 * met.share,
                    i as f64,
                    100.0 * met.low,
                    100.0 * met.high,
                ))
            });
            plot = plot.series(Series::new(label, Style::ErrorBars, points.collect()).slot(*slot));
        }
        "Shares of all trials that meet the bound, with Wilson's 95 % intervals; a failed trial meets no bound."
    } else {
        let points = found.iter().enumerate().filter_map(|(i, shares_met)| {
            let mut shares: Vec<f64> = shares_met.iter().map(|(_, met)| 100.0 * met.share).collect();
            shares.sort_by(f64::total_cmp);
            let at = |q: f64| shares.get(((shares.len() - 1) as f64 * q) as usize).copied();
            let mut point = Point::interval(at(0.5)?, i as f64, at(0.0)?, at(1.0)?);
            point.quartiles = [at(0.25)?, at(0.75)?];
            Some(point)
        });
        plot = plot.series(Series::new("all cells and outputs", Style::Boxes, points.collect()));
        "For each bound the shares of realisations over all cells and outputs: boxes hold the \
        middle half of the combinations, whiskers reach the worst and the best."
    };
    plot = plot.reference("typical: half", Course::Vertical(50.0));
    let title = format!("{}: share of trials that meet each bound", study.title());
    let (picture, note) = sheet(&title, what, vec![plot], Form::default())?;
    let best = found
        .iter()
        .flatten()
        .map(|(_, met)| *met)
        .max_by(|a, b| a.share.total_cmp(&b.share))?;
    Some(Drawn {
        name: "bounds".to_owned(),
        picture,
        caption: format!("{what}{note} The largest share of all is {}.", share(best)),
    })
}
