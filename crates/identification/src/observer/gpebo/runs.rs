//! Runs in lock step: of several trials, a lane for each, and of several refinements of one grid.

use super::cascade::Cascade;
use super::linear::Propagators;
use super::oscillators::Oscillators;
use super::run::{Run, Start};
use super::summary::{Sample, Summary};
use crate::real::Real;

impl Cascade {
    /// Runs with each base step divided into `refine` parts (0 counts as 1). Calls `visit` at t = 0 and after each
    /// base step.
    pub fn run(&self, refine: usize, mut visit: impl FnMut(&Sample<'_>)) -> Summary {
        let mut known = Propagators::default();
        let mut runs = Runs::<f64>::start(vec![self], &[refine.max(1)], &mut known);
        visit(&runs.sample());
        while runs.advance(&mut known) != 0 {
            visit(&runs.sample());
        }
        runs.summary(0)
    }
}

/// Where a lane is on its grid.
#[derive(Clone, Copy, Debug)]
struct Place {
    gap: usize,
    /// Base steps done in this gap.
    done: usize,
    t: f64,
    over: bool,
}

/// Runs in progress. Lanes whose end is reached go on repeating their last step, and what they find does not count.
#[derive(Debug)]
pub struct Runs<'a, R> {
    /// The cascade of each lane; those beyond the trials repeat the last.
    lanes: Vec<&'a Cascade>,
    places: Vec<Place>,
    /// In the order of the refinements; the last is the finest.
    pub(super) refined: Vec<Run<'a, R>>,
    oscillators: Oscillators,
}

impl<'a, R: Real> Runs<'a, R> {
    /// Starts runs at t = 0, whose base steps are divided into so many parts; the lanes fit each other.
    pub fn start(mut lanes: Vec<&'a Cascade>, refinements: &[usize], known: &mut Propagators) -> Self {
        let asked = lanes.len();
        if let Some(last) = lanes.last().copied() {
            lanes.resize(R::LANES, last);
        }
        if let [first, ..] = lanes[..] {
            known.of(&first.system);
        }
        let place = |lane| Place {
            gap: 0,
            done: 0,
            t: 0.0,
            over: lane >= asked,
        };
        let mut oscillators = Oscillators::new(&lanes);
        let finest = refinements.len().saturating_sub(1);
        let runs = refinements
            .iter()
            .enumerate()
            .map(|(k, &refine)| Run::start(&lanes, refine, finest - k, known, &mut oscillators));
        Self {
            refined: runs.collect(),
            places: (0..lanes.len()).map(place).collect(),
            lanes,
            oscillators,
        }
    }

    /// Advances one base step. Returns the lanes that did, as bits: not those at the horizon, nor those in which the
    /// plant's state in the finest run is not finite.
    pub fn advance(&mut self, known: &mut Propagators) -> u8 {
        let mut start = Start::default();
        let finest = self.refined.last();
        let mut advanced = 0;
        for (lane, (place, cascade)) in self.places.iter_mut().zip(&self.lanes).enumerate() {
            if !place.over {
                let finite = finest.is_some_and(|run| run.is_finite(lane));
                place.over = !finite || place.gap == cascade.grid.gaps.len();
                advanced |= u8::from(!place.over) << lane;
            }
            // At the end the last step is repeated.
            let at_end = place.gap == cascade.grid.gaps.len();
            let gap = cascade.grid.gaps[place.gap - usize::from(at_end)];
            let done = if at_end { gap.count - 1 } else { place.done };
            start.length[lane] = cascade.grid.lengths[gap.length];
            start.from[lane] = gap.time(done);
            start.to[lane] = gap.time(done + 1);
            start.first |= u8::from(done == 0) << lane;
            if place.over {
                continue;
            }
            place.t = start.to[lane];
            place.done += 1;
            if place.done == gap.count {
                (place.gap, place.done) = (place.gap + 1, 0);
            }
        }
        if advanced != 0 {
            for run in &mut self.refined {
                run.advance(&start, &self.lanes, known, &mut self.oscillators);
            }
        }
        advanced
    }

    /// Returns the lanes that are not over after this base step, as bits.
    pub fn going_on(&self) -> u8 {
        let finest = self.refined.last();
        let goes_on = |lane: usize| {
            let (place, cascade) = (&self.places[lane], self.lanes[lane]);
            let finite = finest.is_some_and(|run| run.is_finite(lane));
            !place.over && finite && place.gap < cascade.grid.gaps.len()
        };
        (0..self.lanes.len()).fold(0, |bits, lane| bits | u8::from(goes_on(lane)) << lane)
    }

    /// Returns the summary of the finest run so far, in a lane.
    pub fn summary(&self, lane: usize) -> Summary {
        self.refined[self.refined.len() - 1].summary(lane)
    }
}

impl Runs<'_, f64> {
    /// Returns the state of the finest run after the last base step.
    pub fn sample(&self) -> Sample<'_> {
        self.refined[self.refined.len() - 1].sample(self.places[0].t)
    }
}
