//! Repeated measurements of trials per second.

use crate::cli::error::{Error, failed};
use crate::study::RunError;
use std::convert::Infallible;
use std::time::Instant;

/// Trials per second of every repetition, ascending.
pub(super) struct Rates(pub(super) Vec<f64>);

impl Rates {
    /// Times repetitions of so many trials each.
    pub(super) fn measure(
        repetitions: u16,
        trials: u64,
        mut once: impl FnMut() -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let mut rates = Vec::new();
        for _ in 0..repetitions {
            let begin = Instant::now();
            once()?;
            rates.push(trials as f64 / begin.elapsed().as_secs_f64());
        }
        rates.sort_by(f64::total_cmp);
        Ok(Self(rates))
    }

    pub(super) fn median(&self) -> f64 {
        let Self(rates) = self;
        f64::midpoint(rates[(rates.len() - 1) / 2], rates[rates.len() / 2])
    }

    /// The slowest and the fastest.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.0[0], self.0[self.0.len() - 1]]
    }
}

/// Returns the error of a run that ended early.
pub(super) fn ended(error: RunError<Infallible>) -> Error {
    match error {
        RunError::Interrupted { .. } => Error::Interrupted("interrupted".to_owned()),
        error => failed(error),
    }
}
