//! The time that trials take, by part.

use std::ops::AddAssign;
use std::time::{Duration, Instant};

/// Time that threads spent on trials, summed over the threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spent {
    /// Drawing records: random numbers, noise, the plant. In continuous time also the observers, which run with the
    /// plant.
    pub simulation: Duration,
    /// Stages 1 to 11.
    pub estimation: Duration,
    /// Observers, errors and other measures.
    pub measures: Duration,
    /// Sums, counts and distributions over trials.
    pub statistics: Duration,
    /// Theoretical values of the cells.
    pub theory: Duration,
    /// Reading and writing files.
    pub storage: Duration,
}

impl Spent {
    /// Returns the sum of all parts.
    pub fn total(&self) -> Duration {
        let parts = self.parts().map(|(_, part)| part);
        parts.into_iter().sum()
    }

    /// Returns each part with its name.
    pub fn parts(&self) -> [(&'static str, Duration); 6] {
        let Self {
            simulation,
            estimation,
            measures,
            statistics,
            theory,
            storage,
        } = *self;
        [
            ("simulation", simulation),
            ("estimation", estimation),
            ("measures", measures),
            ("statistics", statistics),
            ("theory", theory),
            ("storage", storage),
        ]
    }
}

impl AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        self.simulation += other.simulation;
        self.estimation += other.estimation;
        self.measures += other.measures;
        self.statistics += other.statistics;
        self.theory += other.theory;
        self.storage += other.storage;
    }
}

/// Measures laps.
pub(crate) struct Watch(Instant);

impl Watch {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    /// Returns the time since the start or the last lap.
    pub(crate) fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now.duration_since(std::mem::replace(&mut self.0, now))
    }
}
