//! A column that is not used, but shows by its name and its steps that it holds times.

use super::clock::Clock;
use super::layout::Layout;
use super::table::LikeTimes;
use super::times::{Time, Times};

/// A column that is not used, but may hold times.
pub(super) struct Followed {
    pub(super) place: usize,
    pub(super) clock: Clock,
    times: Times,
    are_equal: bool,
    /// The times with their lines.
    all: Vec<(f64, u64)>,
}

impl Followed {
    pub(super) fn new(place: usize, clock: Clock) -> Self {
        Self {
            place,
            clock,
            times: Times::new(),
            are_equal: true,
            all: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, time: Time, line: u64) {
        self.are_equal = self.are_equal && self.times.add(time, line).is_ok();
        self.all.push((time.value, line));
    }

    /// Returns what is like times, and whether they fall: at equal steps, or with a few gaps.
    pub(super) fn finish(self, layout: &Layout) -> Option<(LikeTimes, bool)> {
        let gaps = if self.are_equal {
            self.times.step().filter(|step| *step > 0.0)?;
            None
        } else {
            Some(gaps(&self.all)?)
        };
        let column = layout.cells[self.place].clone();
        Some((LikeTimes { column, gaps }, self.clock.sign < 0.0))
    }
}

/// Counts the steps that are longer than the others, and returns the line after the first of them; `None` if not nearly
/// all steps are equal, or none is longer.
fn gaps(times: &[(f64, u64)]) -> Option<(usize, u64)> {
    const LONGER: f64 = 1.5;
    const FEW: usize = 10;
    let steps = || times.windows(2).map(|pair| (pair[1].0 - pair[0].0, pair[1].1));
    let mut sorted: Vec<f64> = steps().map(|(step, _)| step).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = *sorted.get(sorted.len() / 2)?;
    let shortest = *sorted.first()?;
    let mut longer = steps().filter(|(step, _)| *step >= LONGER * middle);
    let (_, line) = longer.next()?;
    let count = 1 + longer.count();
    // A step shorter than half the others is no gap.
    (shortest > (2.0 - LONGER) * middle && count * FEW <= sorted.len()).then_some((count, line))
}
