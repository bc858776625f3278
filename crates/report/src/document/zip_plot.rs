//! Zip plots: the 95 % intervals of single trials, sorted by how far they are from the truth (Morris, White and
//! Crowther, Statistics in Medicine 38, 2019).

use super::figure::{Drawn, WHOSE};
use super::layout::{Form, sheet};
use super::lead::lead_outputs;
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Style, extent, points};
use crate::results::{Study, at};
use asobench_identification::metric::{Share, Z};
use asobench_study::study::{CellSummary, StoreError};

/// Intervals of a panel. Of more trials, as many are drawn, evenly by rank.
const INTERVALS: usize = 200;
/// Largest number of panels.
const OUTPUTS: usize = 6;
/// The place in the palette of a shaded range.
const SHADE: usize = 2;
/// The nominal coverage.
const NOMINAL: f64 = 0.95;

/// The choices for a zip plot; by default the cell and the coefficient whose coverage is farthest from 95 %.
#[derive(Clone, Debug, Default)]
pub(super) struct Zipped<'a> {
    /// The cell.
    pub cell: Option<&'a CellSummary>,
    /// The coefficient, such as `a_1`.
    pub coefficient: Option<&'a str>,
    /// The outputs with their places in the palette; the ones that the report begins with if there are none.
    pub outputs: Vec<(usize, String)>,
    /// The title.
    pub title: Option<&'a str>,
    /// The form of the sheet.
    pub form: Form,
}

/// The zip plot of a study that kept its trials and their standard errors.
///
/// # Errors
/// In words: what is missing.
pub(super) fn zip_plot(study: &Study, wanted: &Zipped<'_>) -> Result<Drawn, String> {
    let without = "a zip plot needs the intervals of single trials: run the study with `coverage = true` and `store = \
                   \"trials\"`";
    let outputs = match wanted.outputs.as_slice() {
        [] => lead_outputs(study),
        some => some.to_vec(),
    };
    let (cell, coefficient) = worst(study, wanted, &outputs).ok_or(without)?;
    let rows = study.rows_of(cell);
    let said = |error: StoreError| error.to_string();
    let mut stored = study.trials_stored().map_err(said)?.ok_or(without)?;
    let mut plots = Vec::new();
    for (_, label) in outputs.iter().take(OUTPUTS) {
        let Some(output) = study.output(cell, label) else {
            continue;
        };
        let of = (output.estimator.as_str(), output.pass);
        let pairs = stored.errors(rows, of, coefficient);
        let pairs = pairs.map_err(said)?.ok_or(without)?;
        if !pairs.is_empty() {
            plots.push(panel(label, coefficient, &pairs));
        }
    }
    let own = own_ranges(&mut plots);
    let at = at(cell, &study.varying());
    let title = wanted.title.map_or_else(
        || format!("{}: 95 % intervals of {coefficient}{at}, trial by trial", study.title()),
        str::to_owned,
    );
    let what = format!(
        "Each line is the 95 % interval of {coefficient} in one trial{at}, less the true value. They are sorted by the \
         distance of the estimate from the truth in its standard errors, the farthest at the top. Intervals that miss \
         the truth lie above the line at 95 % if there are as many of them as there should be. Above each panel stands \
         the share that holds it; its 95 % interval is shaded.{own}"
    );
    let (picture, note) = sheet(&title, &what, plots, wanted.form)
        .ok_or_else(|| format!("no output has intervals of {coefficient}{at}"))?;
    Ok(Drawn {
        name: "zip".to_owned(),
        picture,
        caption: format!(
            "{what}{note} Of more than {INTERVALS} trials, {INTERVALS} are drawn, evenly by rank. {WHOSE}"
        ),
    })
}

/// The cell and the coefficient to show.
fn worst<'a>(study: &'a Study, wanted: &Zipped<'a>, outputs: &[(usize, String)]) -> Option<(&'a CellSummary, &'a str)> {
    let cells = study.summary.cells.iter();
    let cells = cells.filter(|cell| wanted.cell.is_none_or(|of| of.cell == cell.cell));
    let all = cells.flat_map(|cell| {
        let known = outputs.iter().filter_map(|(_, label)| study.output(cell, label));
        known.flat_map(move |output| output.coverage.iter().map(move |of| (cell, of)))
    });
    let named = all.filter(|(_, (name, _))| wanted.coefficient.is_none_or(|of| of == name));
    let distance = |coverage: f64| (coverage - NOMINAL).abs();
    let worst = named.max_by(|(_, a), (_, b)| distance(a.1.covered.share).total_cmp(&distance(b.1.covered.share)));
    worst.map(|(cell, (name, _))| (cell, name.as_str()))
}

/// The largest ratio of the widths of panels that have one axis.
const WIDER: f64 = 3.0;

/// Gives each panel its own range of x where one range would make the intervals of some too short to be seen; says so.
fn own_ranges(plots: &mut [Plot]) -> &'static str {
    let range = |plot: &Plot| {
        let ends = points(std::slice::from_ref(plot)).flat_map(|point| [point.low, point.high]);
        extent(ends.filter(|end| end.is_finite()).chain([0.0]))
    };
    let ranges: Vec<(f64, f64)> = plots.iter().map(range).collect();
    let widths = ranges.iter().map(|(low, high)| high - low);
    let (least, most) = extent(widths.filter(|width| *width > 0.0));
    if most <= WIDER * least {
        return "";
    }
    for (plot, (low, high)) in plots.iter_mut().zip(ranges) {
        let room = 0.03 * (high - low);
        plot.x.range = Some((low - room, high + room));
    }
    " Each panel has its own range of x, since some intervals are more than three times as wide as others."
}

/// The intervals of an output, with its coverage in the title.
fn panel(label: &str, coefficient: &str, pairs: &[[f64; 2]]) -> Plot {
    let mut pairs = pairs.to_vec();
    let z = |[error, se]: &[f64; 2]| (error / se).abs();
    pairs.sort_by(|a, b| z(a).total_cmp(&z(b)));
    let (count, last) = (pairs.len(), pairs.len() - 1);
    let drawn = count.min(INTERVALS);
    let rank = |i: usize| (i * last).checked_div(drawn - 1).unwrap_or(0);
    let (mut held, mut missed) = (Vec::new(), Vec::new());
    for i in (0..drawn).map(rank) {
        let [error, se] = pairs[i];
        let centile = 100.0 * (i as f64 + 0.5) / count as f64;
        let point = Point::interval(error, centile, error - Z * se, error + Z * se);
        let holds = point.low <= 0.0 && 0.0 <= point.high;
        if holds { &mut held } else { &mut missed }.push(point);
    }
    let covered = pairs.iter().filter(|pair| z(pair) <= Z).count();
    let covered = Share::new(covered as u64, count as u64);
    let title = format!("{label}: {:.1} %", 100.0 * covered.share);
    let x = PlotAxis::linear(format!("interval of {coefficient}, less its true value"));
    let y = PlotAxis::linear("centile of |error| / standard error, %").range(0.0, 100.0);
    // The shade reaches from edge to edge; this is its entry in the legend.
    let shade = Series::new(
        "95 % interval of the share",
        Style::Region,
        vec![Point::new(f64::NAN, f64::NAN)],
    );
    let mut plot = Plot::new(title, x, y)
        .series(Series::new("holds the truth", Style::Spans, held).slot(5))
        .series(Series::new("misses it", Style::Spans, missed).slot(1))
        .reference("truth", Course::Vertical(0.0))
        .reference("95 %", Course::Horizontal(100.0 * NOMINAL))
        .series(shade.slot(SHADE));
    plot.shaded = Some([covered.low, covered.high].map(|end| 100.0 * end));
    plot
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 1,000 errors with a standard error of 1, evenly from -4 to 4, those beyond 1.96 miss: 51 %.
    #[test]
    fn intervals_are_sorted_and_those_that_miss_are_at_the_top() {
        let pairs: Vec<[f64; 2]> = (0..1000).map(|i| [(f64::from(i) - 499.5) / 125.0, 1.0]).collect();
        let plot = panel("arx", "a_1", &pairs);
        assert_eq!(plot.title, "arx: 49.0 %");
        let [held, missed] = [&plot.series[0].points, &plot.series[1].points];
        assert_eq!(held.len() + missed.len(), INTERVALS);
        assert!(held.iter().all(|point| point.low <= 0.0 && 0.0 <= point.high));
        assert!(missed.iter().all(|point| point.low > 0.0 || point.high < 0.0));
        let top = held.iter().map(|point| point.y).fold(0.0, f64::max);
        assert!(missed.iter().all(|point| point.y > top) && (48.0..50.0).contains(&top));
        assert!(missed.windows(2).all(|pair| pair[0].y < pair[1].y));
        // Wilson's interval of 490 in 1,000, from statsmodels (proportion_confint).
        let [low, high] = plot.shaded.unwrap();
        assert!(
            (low - 45.911_403_097_425_707).abs() < 1e-9 && (high - 52.096_250_419_545_4).abs() < 1e-9,
            "{low} {high}"
        );
    }

    #[test]
    fn one_trial_has_a_line() {
        let plot = panel("arx", "a_1", &[[0.1, 0.2]]);
        assert_eq!((plot.series[0].points.len(), plot.series[1].points.len()), (1, 0));
    }
}
