//! Ranges of axes, ticks and their labels, and the way from a value to its place.

use super::{Axis, Scale};

/// A tick and its label.
pub(super) type Tick = (f64, String);

/// From values of an axis to lengths in the figure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Map {
    log: bool,
    ends: (f64, f64),
    lengths: (f64, f64),
}

/// Lengths beyond this are cut; far outside of any figure.
const FAR: f64 = 1e4;

impl Map {
    /// The map that takes the two ends of a range to two lengths.
    pub(super) fn new(scale: &Scale, range: (f64, f64), lengths: (f64, f64)) -> Self {
        let log = *scale == Scale::Log;
        let place = |value: f64| if log { value.log10() } else { value };
        Self {
            log,
            ends: (place(range.0), place(range.1)),
            lengths,
        }
    }

    /// The coordinate on the axis: the value, or its decimal logarithm; none where that is undefined.
    pub(super) fn coordinate(&self, value: f64) -> Option<f64> {
        let place = if self.log { value.log10() } else { value };
        place.is_finite().then_some(place)
    }

    /// The length at a coordinate of the axis.
    pub(super) fn length(&self, coordinate: f64) -> f64 {
        let share = (coordinate - self.ends.0) / (self.ends.1 - self.ends.0);
        let length = self.lengths.0 + share * (self.lengths.1 - self.lengths.0);
        length.clamp(-FAR, FAR)
    }

    /// The place of a value; none where that is undefined.
    pub(super) fn at(&self, value: f64) -> Option<f64> {
        Some(self.length(self.coordinate(value)?))
    }

    /// The place of an end of an interval: a value that a logarithmic axis cannot show, or minus infinity, is at its
    /// lower end.
    pub(super) fn end(&self, value: f64) -> Option<f64> {
        if value.is_nan() {
            return None;
        }
        let below = value == f64::NEG_INFINITY || (self.log && value <= 0.0);
        let above = value == f64::INFINITY;
        Some(match (below, above) {
            (true, _) => self.lengths.0,
            (_, true) => self.lengths.1,
            _ => self.at(value)?,
        })
    }

    /// Whether a value lies between the ends.
    pub(super) fn holds(&self, value: f64) -> bool {
        let room = 1e-9 * (self.ends.1 - self.ends.0);
        let (low, high) = (self.ends.0 - room, self.ends.1 + room);
        self.coordinate(value)
            .is_some_and(|place| (low..=high).contains(&place))
    }

    /// The two ends as coordinates.
    pub(super) fn ends(&self) -> (f64, f64) {
        self.ends
    }

    /// Length of one unit of the coordinate.
    pub(super) fn unit(&self) -> f64 {
        ((self.lengths.1 - self.lengths.0) / (self.ends.1 - self.ends.0)).abs()
    }
}

/// The range of an axis: the given one, the names, or that of the values with some room (a share of the whole).
pub(super) fn range(axis: &Axis, values: impl Iterator<Item = f64>, room: f64) -> (f64, f64) {
    if let Scale::Categories(names) = &axis.scale {
        return (-0.5, names.len().max(1) as f64 - 0.5);
    }
    let log = axis.scale == Scale::Log;
    let drawn = |value: &f64| value.abs() < 1e300 && (!log || *value > 1e-300);
    if let Some((low, high)) = axis.range.filter(|(low, high)| low < high)
        && drawn(&low)
        && drawn(&high)
    {
        return (low, high);
    }
    let (low, high) = values
        .filter(drawn)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    if low > high {
        return if log { (0.1, 10.0) } else { (0.0, 1.0) };
    }
    if log {
        log_range(low, high, room)
    } else {
        linear_range(low, high, room)
    }
}

/// At least a factor of five, so that two of 1, 2, 5 lie inside.
fn log_range(low: f64, high: f64, room: f64) -> (f64, f64) {
    let (low, high) = (low.log10(), high.log10());
    let missing = (5.0_f64.log10() + 0.01 - (high - low)).max(0.0);
    let room = (room * (high - low)).max(missing / 2.0);
    (10.0_f64.powf(low - room), 10.0_f64.powf(high + room))
}

fn linear_range(low: f64, high: f64, room: f64) -> (f64, f64) {
    if high - low <= 1e-12 * high.abs().max(low.abs()) {
        let room = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        return (low - room, high + room);
    }
    let room = room * (high - low);
    // A quantity that is never negative has no room below zero.
    let bottom = if low >= 0.0 {
        (low - room).max(0.0)
    } else {
        low - room
    };
    (bottom, high + room)
}

/// As many ticks with labels as `fits` accepts.
pub(super) fn ticks(scale: &Scale, range: (f64, f64), fits: impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    match scale {
        Scale::Linear => linear_ticks(range, &fits),
        Scale::Log => log_ticks(range, &fits),
        Scale::Categories(names) => {
            let names = names.iter().enumerate();
            names.map(|(i, name)| (i as f64, name.clone())).collect()
        }
    }
}

fn linear_ticks((low, high): (f64, f64), fits: &impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let mut ticks = Vec::new();
    for count in (2..=8).rev() {
        ticks = multiples(low, high, step(high - low, count));
        if fits(&ticks) {
            break;
        }
    }
    ticks
}

/// The least of 1, 2, 5 times a power of ten that divides a span into at most `count` parts.
fn step(span: f64, count: u32) -> f64 {
    let least = span / f64::from(count);
    let decade = 10.0_f64.powf(least.log10().floor());
    let factors = [1.0, 2.0, 5.0];
    let enough = |factor: &f64| factor * decade >= least * (1.0 - 1e-9);
    factors.into_iter().find(enough).unwrap_or(10.0) * decade
}

/// The multiples of a step in a range.
fn multiples(low: f64, high: f64, step: f64) -> Vec<Tick> {
    let (first, last) = ((low / step - 1e-6).ceil(), (high / step + 1e-6).floor());
    let largest = first.abs().max(last.abs()) * step;
    let plain = if largest >= 1e6 {
        step < 1e4
    } else {
        step >= 1e-3 * (1.0 - 1e-9) || largest >= 1e-2
    };
    let count = (last - first).clamp(0.0, 100.0) as usize;
    let values = (0..=count).map(|i| (first + i as f64) * step);
    let ticks = values.map(|value| (value, linear_label(value, step, plain)));
    ticks.filter(|_| first <= last).collect()
}

/// A label with as many decimals as its axis' step needs.
fn linear_label(value: f64, step: f64, plain: bool) -> String {
    let fine = exponent(step);
    if value.abs() < step / 2.0 {
        return "0".to_owned();
    }
    if plain {
        return format!("{value:.*}", (-fine).clamp(0, 20) as usize);
    }
    let coarse = exponent(value.abs());
    format!("{value:.*e}", (coarse - fine).clamp(0, 20) as usize)
}

/// The decimal exponent of a positive number that may be a power of ten but for rounding.
fn exponent(value: f64) -> i32 {
    (value.log10() + 1e-9).floor() as i32
}

fn log_ticks((low, high): (f64, f64), fits: &impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let choices: [(&[u32], i32); 9] = [
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
    for (factors, every) in choices {
        let ticks = powers(low, high, factors, every);
        if ticks.len() < 2 {
            break;
        }
        if ticks.len() <= 12 && fits(&ticks) {
            return ticks;
        }
    }
    // Less than two of 1, 2, 5, or no room: round numbers in equal steps.
    linear_ticks((low, high), fits)
}

/// Factors times every n-th power of ten in a range.
fn powers(low: f64, high: f64, factors: &[u32], every: i32) -> Vec<Tick> {
    let decades = low.log10().floor() as i32 - 1..=high.log10().ceil() as i32 + 1;
    let kept = decades.filter(|decade| decade.rem_euclid(every) == 0);
    kept.flat_map(|decade| factors.iter().map(move |factor| (*factor, decade)))
        // Through text, so that a tick is the number nearest to its label.
        .filter_map(|(factor, decade)| {
            let value: f64 = format!("{factor}e{decade}").parse().ok()?;
            Some((value, log_label(factor, decade, value)))
        })
        .filter(|(value, _)| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(value))
        .collect()
}

fn log_label(factor: u32, decade: i32, value: f64) -> String {
    if (-3..5).contains(&decade) {
        value.to_string()
    } else {
        format!("{factor}e{decade}")
    }
}

/// The multiples 2 to 9 of the powers of ten in a range of at most six decades: short ticks without labels.
pub(super) fn minor_ticks(scale: &Scale, (low, high): (f64, f64)) -> Vec<f64> {
    if *scale != Scale::Log || high / low > 1e6 {
        return Vec::new();
    }
    let factors = [2, 3, 4, 5, 6, 7, 8, 9];
    let ticks = powers(low, high, &factors, 1).into_iter();
    ticks.map(|(value, _)| value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: &Scale, range: (f64, f64), most: usize) -> Vec<String> {
        let ticks = ticks(scale, range, |ticks| ticks.len() <= most);
        ticks.into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_labelled_in_their_step() {
        for (range, expected) in [
            ((0.0, 400.0), "0 50 100 150 200 250 300 350 400"),
            ((-1.0, 1.0), "-1.0 -0.5 0 0.5 1.0"),
            ((0.0, 0.0042), "0 0.001 0.002 0.003 0.004"),
            ((0.0, 0.00042), "0 1e-4 2e-4 3e-4 4e-4"),
            ((0.001, 0.0301), "0.005 0.010 0.015 0.020 0.025 0.030"),
            ((0.0, 2.5e7), "0 5e6 1.0e7 1.5e7 2.0e7 2.5e7"),
            (
                (100.0, 100.0004),
                "100.0000 100.0001 100.0002 100.0003 100.0004",
            ),
        ] {
            let most = if range.1 == 400.0 { 9 } else { 6 };
            assert_eq!(labels(&Scale::Linear, range, most).join(" "), expected);
        }
    }

    #[test]
    fn log_ticks_are_1_2_5_until_they_are_too_many() {
        for (range, most, expected) in [
            (
                (0.0007, 0.3),
                99,
                "0.001 0.002 0.005 0.01 0.02 0.05 0.1 0.2",
            ),
            ((0.0007, 0.3), 7, "0.001 0.005 0.01 0.05 0.1"),
            (
                (5e-6, 30000.0),
                99,
                "1e-5 1e-4 0.001 0.01 0.1 1 10 100 1000 10000",
            ),
            ((1e-13, 1e3), 10, "1e-12 1e-10 1e-8 1e-6 1e-4 0.01 1 100"),
            ((18.0, 1000.0), 99, "20 50 100 200 500 1000"),
            ((2.1, 2.9), 6, "2.2 2.4 2.6 2.8"),
            ((9e4, 6e5), 99, "1e5 2e5 5e5"),
        ] {
            assert_eq!(labels(&Scale::Log, range, most).join(" "), expected);
        }
    }

    #[test]
    fn known_values_are_at_known_places() {
        let map = Map::new(&Scale::Log, (0.01, 100.0), (400.0, 0.0));
        for (value, place) in [(0.01, 400.0), (0.1, 300.0), (1.0, 200.0), (100.0, 0.0)] {
            assert!((map.at(value).unwrap() - place).abs() < 1e-9);
        }
        assert_eq!(map.at(0.0), None);
        assert_eq!(map.at(-1.0), None);
        assert_eq!(map.at(f64::NAN), None);
        assert_eq!(map.end(-1.0), Some(400.0));
        assert_eq!(map.end(f64::INFINITY), Some(0.0));
        let map = Map::new(&Scale::Linear, (0.0, 10.0), (100.0, 200.0));
        assert_eq!(map.at(2.5), Some(125.0));
        assert!(map.holds(10.0) && !map.holds(10.1));
    }

    #[test]
    fn ranges_hold_the_values_and_are_never_empty() {
        let axis = Axis::log("");
        let held = range(&axis, [1e-5, 0.0, f64::NAN, 1e-2].into_iter(), 0.0);
        assert!((held.0 / 1e-5 - 1.0).abs() < 1e-9 && (held.1 / 1e-2 - 1.0).abs() < 1e-9);
        let one = range(&axis, [3.0].into_iter(), 0.05);
        assert!(one.0 < 3.0 && one.1 > 3.0 && one.1 / one.0 >= 5.0);
        assert_eq!(range(&axis, [].into_iter(), 0.05), (0.1, 10.0));
        let axis = Axis::linear("");
        assert_eq!(range(&axis, [5.0].into_iter(), 0.05), (4.5, 5.5));
        assert_eq!(range(&axis, [0.0].into_iter(), 0.05), (-1.0, 1.0));
        assert_eq!(range(&axis, [0.0, 10.0].into_iter(), 0.1), (0.0, 11.0));
        assert_eq!(
            range(&axis.clone().range(2.0, 3.0), [9.0].into_iter(), 0.1),
            (2.0, 3.0)
        );
        assert_eq!(
            range(&axis.range(3.0, 2.0), [9.0, 10.0].into_iter(), 0.0),
            (9.0, 10.0)
        );
        let names = Axis::categories("", &["a", "b"]);
        assert_eq!(range(&names, [9.0].into_iter(), 0.1), (-0.5, 1.5));
    }
}
