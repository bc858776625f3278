//! Pictures of a record and of the models estimated from it.

use super::report::{Estimate, Report};
use crate::diagnosis::{Precision, Residuals, Root, Z_95, frequency_response, step_response};
use crate::estimator::Progress;
use crate::metric::prediction_errors;
use crate::model::LinearModel;
use crate::report::plot::{Course, Picture, Plot, PlotAxis, Point, Scale, Series, Sharing, Style, small_multiples};
use std::f64::consts::PI;

const SHARED_TIME: Sharing = Sharing { x: true, y: false };

/// Points on an ellipse.
const ELLIPSE: usize = 120;
/// Positions in the palette whose markers are a cross and a ring.
const POLE_SLOT: usize = 6;
const ZERO_SLOT: usize = 5;
/// Another colour, so that the interval of a zero is seen across the circle.
const CIRCLE_SLOT: usize = 2;
/// The largest distance from 0 that the plane of poles and zeros shows.
const FARTHEST: f64 = 2.0;

/// Makes a plot over the samples of the record, with the end of the window marked.
pub(super) fn over_time(report: &Report, title: &str, label: &str) -> Plot {
    let plot = Plot::new(title, time_axis(report), PlotAxis::linear(label));
    if report.window < report.record.y.len() {
        let end = Course::Vertical(report.time(report.window));
        plot.reference("end of the window", end)
    } else {
        plot
    }
}

/// The axis of samples: seconds, if their times are known.
fn time_axis(report: &Report) -> PlotAxis {
    PlotAxis::linear(if report.clock.is_some() { "t, s" } else { "k, samples" })
}

/// Draws input and output, after detrending.
pub(super) fn record(report: &Report) -> Picture {
    let panel = |name: &str, values: &[f64]| {
        let series = Series::new("", Style::Line, points(report, 0, values));
        over_time(report, "", name).series(series.slot(0))
    };
    let panels = [panel("u", &report.record.u), panel("y", &report.record.y)];
    let description = "Above the input, below the measured output.";
    small_multiples("Input and output", description, &panels, 1, SHARED_TIME)
}

/// Draws measured and simulated output, and prediction errors.
pub(super) fn outputs(report: &Report) -> Picture {
    let measured = Series::new("measured", Style::Line, points(report, 0, &report.record.y));
    let outputs = over_time(report, "measured and simulated output", "y");
    let mut outputs = outputs.series(measured.slot(0));
    let mut errors = over_time(report, "errors of the one-step prediction", "e");
    for (i, estimate) in report.estimates.iter().enumerate() {
        let name = estimate.name.name();
        if let Some(y) = simulated(estimate, report) {
            let points = points(report, estimate.shift(), &y);
            let series = Series::new(name, Style::Line, points);
            outputs = outputs.series(series.slot(i + 1));
        }
        if let Some((first, e)) = errors_of(estimate, report) {
            let series = Series::new(name, Style::Line, points(report, first, &e));
            errors = errors.series(series.slot(i + 1));
        }
    }
    let measured = ends(&mut report.record.y.iter().copied());
    outputs.y = framed(outputs.y, measured, &outputs.series);
    cut_unstable(&mut outputs, report);
    if let Some(((low, high), worst)) = measured.zip(worst(&errors.series))
        && worst > high - low
    {
        errors.y = errors.y.range(low - high, high - low);
    }
    let title = format!("Models of {}", report.name());
    let description = "Above: the measured output and that of each model under u alone, from x0. Below: the \
                       errors of each model's one-step prediction.";
    small_multiples(&title, description, &[outputs, errors], 1, SHARED_TIME)
}

/// Cuts unstable models off where they leave the axes, so that they hide nothing.
fn cut_unstable(plot: &mut Plot, report: &Report) {
    let Some((low, high)) = plot.y.range else {
        return;
    };
    let estimates = report.estimates.iter();
    for estimate in estimates.filter(|estimate| estimate.last().fitted.pass.unstable) {
        let series = plot.series.iter_mut();
        for series in series.filter(|series| series.label == estimate.name.name()) {
            let points = series.points.iter();
            let inside = points.take_while(|point| (low..=high).contains(&point.y));
            let inside = inside.count();
            series.points.truncate(inside);
        }
    }
}

pub(super) fn points(report: &Report, first: usize, values: &[f64]) -> Vec<Point> {
    let samples = values.iter().enumerate();
    let points = samples.map(|(k, value)| Point::new(report.time(first + k), *value));
    points.filter(|point| point.y.is_finite()).collect()
}

/// Returns the output simulated from u alone; `None` if there is no x0.
pub(super) fn simulated(estimate: &Estimate, report: &Report) -> Option<Vec<f64>> {
    let fitted = &estimate.last().fitted;
    if fitted.pass.progress < Progress::InitialState {
        return None;
    }
    Some(fitted.simulate_from(fitted.pass.x0.clone(), report.shifted(fitted.shift).u))
}

/// Returns the prediction errors that count, and the index of the first.
fn errors_of(estimate: &Estimate, report: &Report) -> Option<(usize, Vec<f64>)> {
    let model = estimate.last().known_model()?;
    let y = estimate.last().fitted.less_offset(&report.record.y);
    let of_start = if estimate.last().fitted.begins_at_rest() {
        0
    } else {
        report.window
    };
    let (first, mut e) = prediction_errors(model, &report.record.u, &y, of_start)?;
    Some((first, e.split_off(first)))
}

/// Returns the models with their estimators' positions in the palette.
fn models(report: &Report) -> impl Iterator<Item = (usize, &Estimate, &LinearModel)> {
    let estimates = report.estimates.iter().enumerate();
    estimates.filter_map(|(i, estimate)| Some((i + 1, estimate, estimate.last().known_model()?)))
}

/// Returns the largest error.
fn worst(series: &[Series]) -> Option<f64> {
    let points = series.iter().flat_map(|series| &series.points);
    points.map(|point| point.y.abs()).reduce(f64::max)
}

/// Draws step responses of all models, stable ones with bands. The axis is chosen for the stable ones.
pub(super) fn steps(report: &Report) -> Picture {
    let samples = settling(report);
    let step = report.clock.map_or(1.0, |clock| clock.step);
    let (mut series, mut stable) = (Vec::new(), Vec::new());
    for (slot, estimate, model) in models(report) {
        let unstable = estimate.last().fitted.pass.unstable;
        let points = step_response(model, samples).into_iter().enumerate();
        let points = points.map(|(k, point)| {
            let se = if unstable { f64::NAN } else { point.se };
            Point::uncertain(k as f64 * step, point.value, se)
        });
        let points: Vec<Point> = points.collect();
        if !unstable {
            stable.extend(points.iter().map(|point| point.y));
        }
        series.push(banded(estimate, points).slot(slot));
    }
    let held = ends(&mut stable.into_iter());
    let axis = PlotAxis::linear("output after a unit step of u");
    let axis = framed(axis, held.or_else(|| ends(&mut values(&series))), &series);
    let mut plot = Plot::new("Step response", time_axis(report), axis);
    plot.series = series;
    cut_unstable(&mut plot, report);
    plot.picture()
}

/// Returns the number of samples until the slowest stable model has settled to 1 %, within limits.
fn settling(report: &Report) -> usize {
    const FEWEST: f64 = 20.0;
    const MOST: f64 = 1000.0;
    let radii = report.estimates.iter().map(|estimate| {
        let last = estimate.last();
        let settled = 0.01_f64.ln() / last.radius.filter(|radius| *radius < 1.0)?.ln();
        Some(settled + last.fitted.model.orders().reach() as f64)
    });
    radii.flatten().fold(FEWEST, f64::max).min(MOST).ceil() as usize
}

/// Draws magnitude and phase of all models, with bands.
pub(super) fn bode(report: &Report) -> Picture {
    let unit = report.frequency();
    let step = report.clock.map_or(1.0, |clock| clock.step);
    let place = |omega: f64| unit.of(omega / step);
    let (mut magnitudes, mut phases) = (Vec::new(), Vec::new());
    for (slot, estimate, model) in models(report) {
        let precision = estimate.last().precision.as_ref();
        let response = frequency_response(model, &frequencies(report.window, precision));
        let magnitude = response.iter().map(|point| {
            let factor = (Z_95 * point.log_magnitude_se).exp();
            let size = point.magnitude;
            Point::interval(place(point.omega), size, size / factor, size * factor)
        });
        let phase = response.iter().map(|point| {
            let [phase, se] = [point.phase, point.phase_se].map(f64::to_degrees);
            Point::uncertain(place(point.omega), phase, se)
        });
        magnitudes.push(banded(estimate, magnitude.collect()).slot(slot));
        phases.push(banded(estimate, phase.collect()).slot(slot));
    }
    let panel = |label: PlotAxis, series: Vec<Series>| {
        let place = |value: f64| {
            if label.scale == Scale::Log { value.ln() } else { value }
        };
        let held = ends(&mut values(&series).map(place));
        let axis = framed(label, held, &series);
        let mut plot = Plot::new("", PlotAxis::log(format!("frequency, {unit}")), axis);
        plot.series = series;
        plot
    };
    let panels = [
        panel(PlotAxis::log("magnitude"), magnitudes),
        panel(PlotAxis::linear("phase, degrees"), phases),
    ];
    let description = "Above the magnitude, below the phase of B/(A F).";
    small_multiples("Frequency response", description, &panels, 1, SHARED_TIME)
}

/// Returns frequencies from one period per window to pi, denser near resonances and notches.
fn frequencies(window: usize, precision: Option<&Precision>) -> Vec<f64> {
    const COUNT: usize = 300;
    let low = (2.0 * PI / window as f64).min(0.01);
    let step = (PI / low).ln() / (COUNT - 1) as f64;
    let mut all: Vec<f64> = (0..COUNT - 1).map(|i| low * (step * i as f64).exp()).collect();
    let roots = precision.into_iter();
    for Root { at, .. } in roots.flat_map(|precision| precision.poles.iter().chain(&precision.zeros)) {
        let width = (1.0 - at.norm()).abs();
        all.extend([-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0].map(|i| at.arg() + i * width));
    }
    all.retain(|omega| (low..PI).contains(omega));
    all.push(PI);
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// Returns the series of an estimator: a band if there are errors, otherwise a line.
fn banded(estimate: &Estimate, points: Vec<Point>) -> Series {
    let has_band = points
        .iter()
        .any(|point| point.low.is_finite() && point.low < point.high);
    let style = if has_band { Style::Band } else { Style::Line };
    Series::new(estimate.name.name(), style, points)
}

fn values(series: &[Series]) -> impl Iterator<Item = f64> {
    let points = series.iter().flat_map(|series| &series.points);
    points.map(|point| point.y)
}

/// Returns the smallest and the largest finite value.
fn ends(values: &mut dyn Iterator<Item = f64>) -> Option<(f64, f64)> {
    let pairs = values.filter(|value| value.is_finite()).map(|value| (value, value));
    pairs.reduce(|(low, high), (value, _)| (low.min(value), high.max(value)))
}

/// Returns an axis that shows a range (of logarithms if it is logarithmic). It also shows other values and bands, as
/// far beyond the range as the range is long.
fn framed(axis: PlotAxis, held: Option<(f64, f64)>, series: &[Series]) -> PlotAxis {
    let Some((low, high)) = held else {
        return axis;
    };
    let log = axis.scale == Scale::Log;
    let place = |value: f64| if log { value.ln() } else { value };
    let points = series.iter().flat_map(|series| &series.points);
    let all = points.flat_map(|point| [point.y, point.low, point.high]);
    let (lowest, highest) = ends(&mut all.map(place)).unwrap_or((low, high));
    let least = if log { 1.0 } else { 0.1 * high.abs().max(low.abs()) };
    let span = (high - low).max(least);
    let low = lowest.max(low - span).min(low) - 0.05 * span;
    let high = highest.min(high + span).max(high) + 0.05 * span;
    if log {
        axis.range(low.exp(), high.exp())
    } else {
        axis.range(low, high)
    }
}

/// Draws correlations of the residuals with themselves and with the input.
pub(super) fn correlations(slot: usize, residuals: &Residuals) -> Picture {
    const BOUND: &str = "99 % bound of one lag";
    let lags = residuals.lags() as f64;
    let panel = |title: &str, label: &str, values: &mut dyn Iterator<Item = (f64, f64)>, bound: f64| {
        let stem = |(lag, r): (f64, f64)| Point::interval(lag, r, r.min(0.0), r.max(0.0));
        let points: Vec<Point> = values.map(stem).collect();
        let largest = points.iter().map(|point| point.y.abs());
        let bounds = Some(bound).filter(|bound| bound.is_finite());
        let largest = largest.fold(bounds.unwrap_or(0.0), f64::max) * 1.1;
        let x = PlotAxis::linear("lag, samples").range(-lags - 1.0, lags + 1.0);
        let y = PlotAxis::linear(label).range(-largest, largest);
        let mut plot = Plot::new(title, x, y);
        plot = plot.series(Series::new("", Style::Marks, points).slot(slot));
        if let Some(bound) = bounds {
            plot.shaded = Some([-bound, bound]);
            plot = plot
                .reference(BOUND, Course::Horizontal(bound))
                .reference(BOUND, Course::Horizontal(-bound));
        }
        plot
    };
    let own = residuals.autocorrelations.iter().enumerate().skip(1);
    let own: Vec<(f64, f64)> = own.map(|(lag, r)| (lag as f64, *r)).collect();
    let mirrored = own.iter().rev().map(|(lag, r)| (-lag, *r));
    let crossed = residuals.crosscorrelations.iter().enumerate();
    let mut crossed = crossed.map(|(i, r)| (i as f64 - lags, *r));
    let scale = residuals.autocovariances[0].sqrt() * residuals.input_variance.sqrt();
    let panels = [
        panel(
            "autocorrelation of the residuals, lag 0 (which is 1) left out",
            "r_e",
            &mut mirrored.chain(own.iter().copied()),
            residuals.bound_r_e_99,
        ),
        panel(
            "cross-correlation with the input, its past at positive lags",
            "r_eu",
            &mut crossed,
            residuals.bound_cross_99 / scale,
        ),
    ];
    let description = "Above r_e, below r_eu over the lag, with the 99 % bounds of a single lag.";
    small_multiples("Residual correlations", description, &panels, 1, SHARED_TIME)
}

/// Draws poles and zeros with their 95 % regions.
pub(super) fn plane(precision: &Precision) -> Picture {
    let Precision { poles, zeros, .. } = precision;
    let circle = (0..=360).map(|i| f64::from(i).to_radians().sin_cos());
    let circle = circle.map(|(sin, cos)| Point::new(cos, sin)).collect();
    let reach = |part: fn(&Root) -> f64| {
        let parts = poles.iter().chain(zeros).map(|root| part(root).abs());
        let near = parts.filter(|part| *part < FARTHEST);
        near.fold(1.0, f64::max) + 0.15
    };
    let (wide, high) = (reach(|root| root.at.re), reach(|root| root.at.im));
    let mut plot = Plot::new(
        "Poles and zeros",
        PlotAxis::linear("real part").range(-wide, wide),
        PlotAxis::linear("imaginary part").range(-high, high),
    );
    plot.equal_units = true;
    plot = plot.series(Series::new("unit circle", Style::Line, circle).slot(CIRCLE_SLOT));
    for (name, roots, slot) in [("poles", poles, POLE_SLOT), ("zeros", zeros, ZERO_SLOT)] {
        let regions = roots.iter().filter_map(|root| root.region_95(ELLIPSE));
        let gap = Point::new(f64::NAN, f64::NAN);
        let regions: Vec<Point> = regions
            .flat_map(|region| {
                let ends = region.into_iter().map(|(x, y)| Point::new(x, y));
                ends.chain([gap]).collect::<Vec<Point>>()
            })
            .collect();
        if !regions.is_empty() {
            let label = format!("95 % regions of {name}");
            plot = plot.series(Series::new(label, Style::Region, regions).slot(slot));
        }
        if !roots.is_empty() {
            let places = roots.iter().map(|root| Point::new(root.at.re, root.at.im));
            plot = plot.series(Series::new(name, Style::Marks, places.collect()).slot(slot));
        }
    }
    plot.picture()
}
