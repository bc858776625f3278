//! The figure of the state error over time.

use super::figure::{Drawn, Figure, series_of};
use super::layout::Layout;
use super::lead::OUTPUTS;
use crate::figures::curve;
use crate::plot::{Course, PlotAxis, Point, Series, Style};
use crate::results::{Study, words};
use asobench_study::study::CURVE_TRIALS;
use asobench_study::study::file::Key;

/// e_x(k) over k.
pub(super) fn curves(study: &Study) -> Option<Drawn> {
    let gains = study.values(Key::Gain);
    let several = gains.len() > 1;
    let labels = study.labels();
    let ends = [labels.first(), labels.last()].map(|label| label.cloned().unwrap_or_default());
    let what = if several {
        format!("Medians of e_x(k) with {} for each gain.", ends[1])
    } else {
        "Medians of e_x(k), bands hold the middle 90 % of the trials.".to_owned()
    };
    let of_gain = |gain| Series::new(words(Key::Gain, gain), Style::Line, Vec::new());
    let (used, series): (&[Key], _) = if several {
        let series = gains.iter().take(OUTPUTS).map(|gain| of_gain(gain));
        (&[Key::Gain], series.collect())
    } else {
        let ends = ends.into_iter().enumerate().collect::<Vec<_>>();
        (&[], series_of(&ends, Style::Band))
    };
    let cells = study.summary.cells.iter();
    let first = match cells.map(|cell| cell.trials).max() {
        Some(trials) if trials > CURVE_TRIALS => {
            format!(" They are over the first {CURVE_TRIALS} trials of a cell.")
        }
        _ => String::new(),
    };
    let percent = 100.0 * study.summary.curve_relative_error;
    Figure {
        name: "curves",
        title: "error of the state over time",
        what: &what,
        about: &format!(
            " Before k = N it is the error of an observer run over the window once the estimate is made. Quantiles of \
             curves come from bins with a relative error below {percent:.1} %.{first}"
        ),
        x: Some(PlotAxis::linear("k, samples")),
        series,
        points: &|i, cell, _| match &cell.curves {
            Some([_, last]) if several && cell.setting(Key::Gain) == gains[i] => {
                let medians = curve(last).into_iter();
                medians.map(|point| Point::new(point.x, point.y)).collect()
            }
            Some(curves) if !several => curve(&curves[i]),
            _ => Vec::new(),
        },
        guides: &|cells, mut plot| {
            for cell in cells.iter().filter(|cell| cell.curves.is_some()) {
                plot = plot.reference("k = N", Course::Vertical(cell.window as f64));
            }
            plot.references.dedup();
            plot
        },
        ..Figure::new(&Layout::new(study, None, used), PlotAxis::log("e_x(k), relative"))
    }
    .draw(study)
}
