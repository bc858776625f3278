//! The figure of the state error over time.

use super::figure::Drawn;
use super::layout::{Choice, Layout, panel_title, sheet};
use super::lead::OUTPUTS;
use crate::figures::curve;
use crate::plot::{Course, Plot, PlotAxis, Point, Series, Style};
use crate::results::{Study, words};
use asobench_study::study::file::Key;

/// e_x(k) over k.
pub(super) fn curves(study: &Study) -> Option<Drawn> {
    let axes = || {
        (
            PlotAxis::linear("k, samples"),
            PlotAxis::log("e_x(k), relative"),
        )
    };
    let several = study.values(Key::Gain).len() > 1;
    let used: &[Key] = if several { &[Key::Gain] } else { &[] };
    let layout = Layout::new(study, None, used);
    let labels = study.labels();
    let ends = [labels.first(), labels.last()].map(|label| label.cloned().unwrap_or_default());
    let draw = |panel: &Choice| {
        let cells = layout.cells(study, panel);
        let (x, y) = axes();
        let mut plot = Plot::new(panel_title(panel, &cells), x, y);
        for cell in cells.iter().take(OUTPUTS) {
            let Some([first, last]) = &cell.curves else {
                continue;
            };
            if several {
                let gain = words(Key::Gain, &cell.setting(Key::Gain));
                let medians = curve(last)
                    .into_iter()
                    .map(|point| Point::new(point.x, point.y));
                plot = plot.series(Series::new(gain, Style::Line, medians.collect()));
            } else {
                plot = plot.series(Series::new(ends[0].clone(), Style::Band, curve(first)).slot(0));
                plot = plot.series(Series::new(ends[1].clone(), Style::Band, curve(last)).slot(1));
            }
            plot = plot.reference("k = N", Course::Vertical(cell.window as f64));
        }
        plot.references.dedup();
        plot
    };
    let plots: Vec<Plot> = layout.panels.iter().map(draw).collect();
    let what = if several {
        format!("Medians of e_x(k) with {} for each gain.", ends[1])
    } else {
        "Medians of e_x(k), bands hold the middle 90 % of the trials.".to_owned()
    };
    let (svg, note) = sheet(
        &format!("{}: error of the state over time", study.title()),
        &what,
        plots,
    )?;
    let percent = 100.0 * study.summary.curve_relative_error;
    Some(Drawn {
        name: "curves".to_owned(),
        svg,
        caption: format!(
            "{what} Before k = N it is the error of an observer run over the window once the estimate is \
            made. Quantiles of curves come from bins with a relative error below \
            {percent:.1} %.{note}{}",
            layout.held_text()
        ),
    })
}
