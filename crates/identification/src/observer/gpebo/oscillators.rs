//! The sines of the signals, as states at the starts of steps.

use super::cascade::Cascade;
use crate::real::MOST_LANES;

/// Times of the lanes, and their states then, each with all lanes together.
type Slot = ([f64; MOST_LANES], Vec<[[f64; MOST_LANES]; 2]>);

/// The states of the oscillators at the starts of steps. Where several runs start a step at one time, they are
/// computed once.
#[derive(Debug)]
pub struct Oscillators {
    /// For each quarter of a base step.
    slots: [Slot; Self::SLOTS],
    buffer: Vec<(f64, f64)>,
}

impl Oscillators {
    const SLOTS: usize = 4;

    /// Makes room for those of the lanes.
    pub fn new(lanes: &[&Cascade]) -> Self {
        let count = lanes.first().map_or(0, |first| first.system.oscillators());
        let slot = || ([f64::NAN; MOST_LANES], vec![[[0.0; MOST_LANES]; 2]; count]);
        Self {
            slots: std::array::from_fn(|_| slot()),
            buffer: vec![(0.0, 0.0); count],
        }
    }

    /// Returns the states at the times of the lanes, the start of part `k` (from 0) of a base step of `refine` parts.
    pub fn at(
        &mut self,
        lanes: &[&Cascade],
        t: &[f64; MOST_LANES],
        k: usize,
        refine: usize,
    ) -> &[[[f64; MOST_LANES]; 2]] {
        let slot = if Self::SLOTS.is_multiple_of(refine) {
            k * (Self::SLOTS / refine)
        } else {
            0
        };
        let (times, states) = &mut self.slots[slot];
        if self.buffer.is_empty() {
            return states;
        }
        for (lane, cascade) in lanes.iter().enumerate() {
            if times[lane] == t[lane] {
                continue;
            }
            times[lane] = t[lane];
            cascade.system.oscillate(t[lane], &mut self.buffer);
            for (state, (sine, cosine)) in states.iter_mut().zip(&self.buffer) {
                (state[0][lane], state[1][lane]) = (*sine, *cosine);
            }
        }
        states
    }
}
