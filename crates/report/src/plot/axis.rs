//! Axes in plotters' terms: ranges, ticks and their labels. plotters maps values to places and finds the ticks of
//! linear axes. This module adds ranges that hold the values, the ticks 1, 2, 5 of logarithmic axes, names, and labels
//! that fit.

use super::backend::TICK;
use super::metrics::{widest, width, wrap};
use super::{PlotAxis, Scale, extent};
use plotters::coord::combinators::{IntoLogRange, LogCoord};
use plotters::coord::ranged1d::{KeyPointHint, KeyPointWeight, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use std::ops::Range;

/// A tick and its label.
type Tick = (f64, String);

/// An axis of a given length with its ticks.
#[derive(Clone, Debug, Default)]
pub(super) struct Span {
    log: bool,
    pub(super) names: bool,
    /// Whether values grow downwards, as names do.
    downwards: bool,
    /// The ends as coordinates: values, or their decimal logarithms.
    ends: (f64, f64),
    ticks: Vec<Tick>,
    /// Space that ticks and labels need, below the axes or to their left.
    pub(super) room: f64,
    /// Space to the left of the axes for x labels that are turned because they do not fit side by side; otherwise zero.
    pub(super) overhang: f64,
}

/// Height of a line of labels.
const LINE: f64 = super::metrics::LINE * TICK;
/// Largest width of a name on a y axis, and its largest share of the figure's width.
pub(super) const WIDEST_NAME: f64 = 230.0;
pub(super) const NAME_SHARE: f64 = 0.36;

impl Span {
    fn new(axis: &PlotAxis, range: (f64, f64)) -> Self {
        let log = axis.scale == Scale::Log;
        let place = |value: f64| if log { value.log10() } else { value };
        let ends = (place(range.0), place(range.1));
        let names = axis.has_names();
        Self {
            log,
            names,
            ends,
            ..Self::default()
        }
    }

    /// A horizontal axis.
    pub(super) fn x(axis: &PlotAxis, range: (f64, f64), length: f64) -> Self {
        let mut span = Self::new(axis, range);
        if let Scale::Categories(names) = &axis.scale {
            span.name(names, length / names.len().max(1) as f64);
        } else {
            span.ticks = span.fitting(length, 10.0, |label| width(label, TICK));
            span.room = LINE + 6.0;
        }
        span
    }

    /// A vertical axis; the first name is at the top, and names are at most `widest` wide.
    pub(super) fn y(axis: &PlotAxis, range: (f64, f64), length: f64, widest_name: f64) -> Self {
        let mut span = Self::new(axis, range);
        if let Scale::Categories(names) = &axis.scale {
            let label = |name: &String| wrap(name, TICK, widest_name).join("\n");
            span.ticks = (0..).map(f64::from).zip(names.iter().map(label)).collect();
            span.downwards = true;
        } else {
            span.ticks = span.fitting(length, 0.7 * TICK, |_| TICK);
        }
        span.room = widest(span.ticks.iter().flat_map(|(_, label)| label.lines()), TICK) + 10.0;
        span
    }

    /// The most ticks whose labels do not touch on an axis of a given length.
    fn fitting(&self, length: f64, gap: f64, extent: impl Fn(&str) -> f64) -> Vec<Tick> {
        let apart = |ticks: &Vec<Tick>| {
            let mut end = f64::NEG_INFINITY;
            ticks.iter().all(|(value, label)| {
                let (place, half) = (length * self.share(*value), extent(label) / 2.0);
                let before = std::mem::replace(&mut end, place + half);
                place - half > before + gap
            })
        };
        let range = (self.value(self.ends.0), self.value(self.ends.1));
        let choices = CHOICES.iter().filter(|_| self.log);
        let powers = choices.map(|(factors, every)| powers(range, factors, *every));
        let powers = powers.filter(|ticks| (2..=12).contains(&ticks.len()));
        // If fewer than two of 1, 2, 5 are in range, or there is no room: round numbers in equal steps.
        let mut all = powers.chain((3..=9).rev().map(|most| linear_ticks(range, most)));
        all.find(apart).unwrap_or_else(|| linear_ticks(range, 2))
    }

    /// Sets names as labels: in up to three lines if their words fit, otherwise turned. If even that is too dense, only
    /// some are shown.
    fn name(&mut self, names: &[String], room: f64) {
        const SLOPE: f64 = 0.71;
        let words = names.iter().flat_map(|name| name.split_whitespace());
        let labels = names.iter().map(|name| wrap(name, TICK, room - 8.0).join("\n"));
        self.ticks = (0..).map(f64::from).zip(labels).collect();
        let most = self.most_lines();
        self.room = LINE * most as f64 + 6.0;
        if widest(words, TICK) > room - 8.0 || most > 3 {
            let every = (22.0 / room.max(1e-3)).ceil().clamp(1.0, 1e6) as usize;
            let kept = (0..).map(f64::from).zip(names.iter().cloned());
            self.ticks = kept.step_by(every).collect();
            self.room = widest(names.iter().map(String::as_str), TICK) * SLOPE + 22.0;
            let beside = |(i, name): &Tick| width(name, TICK) * SLOPE - (i + 0.5) * room;
            self.overhang = self.ticks.iter().map(beside).fold(0.0, f64::max) + 10.0;
        }
    }

    /// The number of lines of the longest label.
    pub(super) fn most_lines(&self) -> usize {
        let lines = self.ticks.iter().map(|(_, label)| label.lines().count());
        lines.max().unwrap_or(1)
    }

    /// The smallest height for the names of a y axis.
    pub(super) fn least_height(axis: &PlotAxis) -> f64 {
        match &axis.scale {
            Scale::Categories(names) => 34.0 * names.len() as f64,
            _ => 0.0,
        }
    }

    /// The coordinate of a value; `None` if it is undefined.
    pub(super) fn coordinate(&self, value: f64) -> Option<f64> {
        let place = if self.log { value.log10() } else { value };
        place.is_finite().then_some(place)
    }

    /// The value at a coordinate.
    pub(super) fn value(&self, coordinate: f64) -> f64 {
        if self.log { 10_f64.powf(coordinate) } else { coordinate }
    }

    /// The length in units of the coordinate.
    pub(super) fn length(&self) -> f64 {
        self.ends.1 - self.ends.0
    }

    /// Where a value lies, as a share of the axis.
    pub(super) fn share(&self, value: f64) -> f64 {
        let place = self.coordinate(value).unwrap_or(self.ends.0);
        (place - self.ends.0) / self.length()
    }

    /// Whether a value lies within the ends.
    pub(super) fn holds(&self, value: f64) -> bool {
        let inside = -1e-9..=1.0 + 1e-9;
        self.coordinate(value).is_some() && inside.contains(&self.share(value))
    }
}

impl Ranged for Span {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    /// The pixel of a value. A value that is far outside, or that a logarithmic axis cannot show, is moved to thirty
    /// lengths away, which plotters' integers can still hold.
    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let far = 30.0 * self.length();
        let value = value.clamp(self.value(self.ends.0 - far), self.value(self.ends.1 + far));
        let limits = if self.downwards { (last, first) } else { (first, last) };
        if self.log {
            LogCoord::from(self.range().log_scale()).map(&value, limits)
        } else {
            RangedCoordf64::from(self.range()).map(&value, limits)
        }
    }

    /// The ticks, or the minor ticks: multiples of powers of ten, on fewer than six decades.
    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let Range { start, end } = self.range();
        let ticks = match hint.weight() {
            KeyPointWeight::Bold => self.ticks.clone(),
            KeyPointWeight::Any if self.log && self.length() < 6.0 => {
                powers((start, end), &[2, 3, 4, 5, 6, 7, 8, 9], 1)
            }
            KeyPointWeight::Any => Vec::new(),
        };
        ticks.into_iter().map(|(value, _)| value).collect()
    }

    fn range(&self) -> Range<f64> {
        self.value(self.ends.0)..self.value(self.ends.1)
    }
}

impl ValueFormatter<f64> for Span {
    fn format_ext(&self, value: &f64) -> String {
        let known = self.ticks.iter().find(|(tick, _)| tick == value);
        known.map_or_else(String::new, |(_, label)| label.clone())
    }
}

/// The range of an axis: the given one, that of the names, or that of the values plus `room` (as a share of the whole).
pub(super) fn range(axis: &PlotAxis, values: impl Iterator<Item = f64>, room: f64) -> (f64, f64) {
    if let Scale::Categories(names) = &axis.scale {
        return (-0.5, names.len().max(1) as f64 - 0.5);
    }
    let log = axis.scale == Scale::Log;
    let drawn = |value: &f64| value.abs() < 1e300 && (!log || *value > 1e-300);
    // Narrower ranges have no ticks in double precision.
    let wide = |low: f64, high: f64| high - low > 1e-9 * high.abs().max(low.abs());
    if let Some((low, high)) = axis.range
        && drawn(&low)
        && drawn(&high)
        && wide(low, high)
    {
        return (low, high);
    }
    let places = values
        .filter(drawn)
        .map(|value| if log { value.log10() } else { value });
    let (low, high) = extent(places);
    if low > high {
        return if log { (0.1, 10.0) } else { (0.0, 1.0) };
    }
    let least = match (log, low) {
        // A factor of five, so that at least two of 1, 2, 5 are inside.
        (true, _) => 0.71,
        (false, 0.0) => 2.0,
        (false, _) => 0.2 * low.abs(),
    };
    let least = if log || !wide(low, high) { least } else { 0.0 };
    let room = f64::max(room * (high - low), (least - (high - low)) / 2.0);
    if log {
        return (10_f64.powf(low - room), 10_f64.powf(high + room));
    }
    // A quantity that is never negative gets no space below zero.
    let floor = if low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
    (floor.max(low - room), high + room)
}

/// Choices of ticks: 1, 2, 5, or fewer of them, or every n-th power of ten.
const CHOICES: [(&[u32], i32); 9] = [
    (&[1, 2, 5], 1),
    (&[1, 5], 1),
    (&[1], 1),
    (&[1], 2),
    (&[1], 3),
    (&[1], 5),
    (&[1], 10),
    (&[1], 20),
    (&[1], 50),
];

/// At most `most` multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks((low, high): (f64, f64), most: usize) -> Vec<Tick> {
    // plotters compares with numbers of size 1.
    let unit = 10.0_f64.powf((high - low).log10().floor());
    let (first, last) = (low / unit - 1e-9, high / unit + 1e-9);
    let values = RangedCoordf64::from(first..last).key_points(most);
    let step = match values.as_slice() {
        [first, second, ..] => unit * (second - first),
        _ => high - low,
    };
    let largest = low.abs().max(high.abs());
    let plain = if largest >= 1e6 {
        step < 1e4
    } else {
        step >= 1e-3 * (1.0 - 1e-6) || largest >= 1e-2
    };
    // The decimal exponent of a positive number; rounding just below a power of ten does not lower it.
    let exponent = |value: f64| (value.log10() + 1e-6).floor() as i32;
    let digits = |value: f64| (exponent(value) - exponent(step)).clamp(0, 20) as usize;
    // As many decimals as the step needs.
    let label = |value: f64| match value.abs() {
        size if size < step / 2.0 => "0".to_owned(),
        _ if plain => format!("{value:.*}", digits(1.0)),
        size => format!("{value:.*e}", digits(size)),
    };
    let values = values.into_iter().map(|value| unit * value);
    values.map(|value| (value, label(value))).collect()
}

/// The multiples `factors` of every n-th power of ten in a range.
fn powers((low, high): (f64, f64), factors: &[u32], every: i32) -> Vec<Tick> {
    let decades = low.log10().floor() as i32 - 1..=high.log10().ceil() as i32 + 1;
    let kept = decades.filter(|decade| decade.rem_euclid(every) == 0);
    kept.flat_map(|decade| factors.iter().map(move |factor| (*factor, decade)))
        // Parsed from text, so that a tick is the number nearest to its label.
        .filter_map(|(factor, decade)| {
            let short = format!("{factor}e{decade}");
            let value: f64 = short.parse().ok()?;
            let plain = (-3..5).contains(&decade);
            Some((value, if plain { value.to_string() } else { short }))
        })
        .filter(|(value, _)| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(value))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_labelled_in_their_step() {
        let linear = [
            ((-1.0, 1.0), 300.0, "-1.0 -0.5 0 0.5 1.0"),
            ((0.0, 0.0042), 300.0, "0 0.001 0.002 0.003 0.004"),
            ((0.0, 3.2e-19), 300.0, "0 1e-19 2e-19 3e-19"),
            ((0.0, 2.5e7), 300.0, "0 5e6 1.0e7 1.5e7 2.0e7 2.5e7"),
            ((50.0, 50.0002), 300.0, "50.0000 50.0001 50.0002"),
        ];
        let log = [
            ((0.0007, 0.3), 420.0, "0.001 0.005 0.01 0.05 0.1"),
            ((9e4, 6e5), 300.0, "1e5 2e5 5e5"),
            ((1e-13, 1e3), 300.0, "1e-12 1e-9 1e-6 0.001 1 1000"),
            ((2.1, 2.9), 200.0, "2.2 2.4 2.6 2.8"),
        ];
        let linear = linear.map(|case| (PlotAxis::linear(""), case));
        let all = linear.into_iter().chain(log.map(|case| (PlotAxis::log(""), case)));
        for (axis, (range, length, expected)) in all {
            let span = Span::x(&axis, range, length);
            let ticks = span.key_points(plotters::coord::ranged1d::BoldPoints(11));
            let labels: Vec<String> = ticks.iter().map(|tick| span.format_ext(tick)).collect();
            assert_eq!(labels.join(" "), expected);
        }
    }

    #[test]
    fn known_values_are_at_known_places() {
        let span = Span::y(&PlotAxis::log(""), (0.01, 100.0), 400.0, WIDEST_NAME);
        let known = [(0.01, 400), (0.1, 300), (1.0, 200), (100.0, 0)];
        for (value, place) in known.into_iter().chain([(-1.0, 12400)]) {
            assert_eq!(span.map(&value, (400, 0)), place);
        }
        assert_eq!(span.map(&1e300, (400, 0)), -12000);
        assert!(span.coordinate(0.0).is_none() && span.coordinate(-1.0).is_none());
        assert!(span.holds(100.0) && !span.holds(101.0));
    }

    #[test]
    fn ranges_hold_the_values_and_are_never_empty() {
        let log = |values: &[f64]| range(&PlotAxis::log(""), values.iter().copied(), 0.0);
        let (low, high) = log(&[1e-5, 0.0, f64::NAN, 1e-2]);
        assert!((low / 1e-5 - 1.0).abs() < 1e-9 && (high / 1e-2 - 1.0).abs() < 1e-9);
        let (low, high) = log(&[3.0]);
        assert!(low < 3.0 && high > 3.0 && high / low >= 5.0);
        let axis = PlotAxis::linear("");
        for (values, expected) in [
            (&[][..], (0.0, 1.0)),
            (&[5.0], (4.5, 5.5)),
            (&[0.0], (0.0, 1.0)),
            (&[0.0, 10.0], (0.0, 11.0)),
            (&[-10.0, 10.0], (-12.0, 12.0)),
        ] {
            assert_eq!(range(&axis, values.iter().copied(), 0.1), expected);
        }
        let given = axis.clone().range(2.0, 3.0);
        assert_eq!(range(&given, [9.0].into_iter(), 0.1), (2.0, 3.0));
        let wrong = axis.range(3.0, 2.0);
        assert_eq!(range(&wrong, [9.0, 10.0].into_iter(), 0.0), (9.0, 10.0));
    }
}
