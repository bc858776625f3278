//! A method that sees the last samples of a window alone: a sliding window.

use super::{Estimator, Pass, ProgramError, Progress, Records, Window};

/// Hands the last samples to a method. The state at the record's start is not known from them, so x0 is taken as 0.
pub(super) struct LastSamples {
    inner: Box<dyn Estimator>,
    samples: usize,
}

impl LastSamples {
    pub(super) fn new(inner: Box<dyn Estimator>, samples: usize) -> Self {
        Self { inner, samples }
    }
}

impl Estimator for LastSamples {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        let from = window.len().saturating_sub(self.samples);
        self.inner.estimate(window.part(from..window.len()), passes);
        if from > 0 {
            for pass in passes {
                if pass.progress == Progress::InitialState {
                    pass.start_at_zero();
                }
            }
        }
    }

    fn gather(&mut self, trial: u64, records: &mut dyn Records) -> Result<(), ProgramError> {
        self.inner.gather(trial, records)
    }
}
