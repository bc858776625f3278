//! The record beside what the models make of it: measured and simulated output, prediction errors.

use super::{Estimate, Report};
use crate::estimator::Progress;
use crate::plant::simulate;
use crate::report::plot::{Course, Plot, PlotAxis, Point, Series, Sharing, Style, small_multiples};

pub(super) fn render(report: &Report) -> String {
    let window = report.window as f64;
    let panel = |title: &str, label: &str| {
        let plot = Plot::new(
            title,
            PlotAxis::linear("k, samples"),
            PlotAxis::linear(label),
        );
        if report.window < report.record.y.len() {
            plot.reference("end of the window", Course::Vertical(window))
        } else {
            plot
        }
    };
    let measured = Series::new("measured", Style::Line, points(0, &report.record.y));
    let mut outputs = panel("measured and simulated output", "y").series(measured.slot(0));
    let mut errors = panel("errors of the one-step prediction", "e");
    for (i, estimate) in report.estimates.iter().enumerate() {
        let name = estimate.name.name();
        if let Some(y) = simulated(estimate, report) {
            let points = points(estimate.shift, &y);
            let series = Series::new(name, Style::Line, points);
            outputs = outputs.series(series.slot(i + 1));
        }
        if let Some((first, e)) = prediction_errors(estimate, report) {
            let series = Series::new(name, Style::Line, points(first, &e));
            errors = errors.series(series.slot(i + 1));
        }
    }
    let title = format!("Models of {}", report.file.display());
    let description = "Above: the measured output and that of each model under u alone, from x0. Below: what each \
                       model's prediction from the samples before misses.";
    let sharing = Sharing { x: true, y: false };
    small_multiples(&title, description, &[outputs, errors], 1, sharing)
}

fn points(first: usize, values: &[f64]) -> Vec<Point> {
    let samples = values.iter().enumerate();
    let points = samples.map(|(k, value)| Point::new((first + k) as f64, *value));
    points.filter(|point| point.y.is_finite()).collect()
}

/// The output under u alone; `None` where there is no x0.
fn simulated(estimate: &Estimate, report: &Report) -> Option<Vec<f64>> {
    let pass = &estimate.last().pass;
    if pass.progress < Progress::InitialState {
        return None;
    }
    let samples = report.shifted(estimate.shift);
    let (mut y, mut x) = (Vec::new(), pass.x0.clone());
    simulate(&pass.a, &pass.b, &mut x, samples.u, |k, x| {
        y.push(x[0] + pass.direct * samples.u[k]);
    });
    Some(y)
}

/// The errors from the first sample on whose prediction looks back into the record alone.
fn prediction_errors(estimate: &Estimate, report: &Report) -> Option<(usize, Vec<f64>)> {
    let last = estimate.last();
    if last.pass.progress < Progress::Parameters {
        return None;
    }
    let (u, y) = (&report.record.u, &report.record.y);
    let (mut e, mut scratch) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    last.model.residuals(u, y, &mut e, &mut scratch);
    let first = last.model.orders().reach().min(e.len());
    Some((first, e.split_off(first)))
}
