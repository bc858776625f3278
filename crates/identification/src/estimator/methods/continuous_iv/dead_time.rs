//! The dead time of a model in continuous time, as an option.

use crate::text::{text_in_files, text_or_number};

/// A dead time that is known, or a range on which it is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DeadTime {
    /// Seconds, at least 0.
    Known(f64),
    /// It is estimated between two numbers of seconds; by default from 0 to [`DeadTime::MOST_SAMPLES`] samples, at most
    /// a quarter of the record.
    Estimate(Option<[f64; 2]>),
}

impl DeadTime {
    /// The end of the default range.
    pub const MOST_SAMPLES: usize = 30;

    /// Returns the longest dead time that is asked for, seconds.
    pub(super) fn longest(self) -> f64 {
        match self {
            Self::Known(seconds) | Self::Estimate(Some([_, seconds])) => seconds,
            Self::Estimate(None) => 0.0,
        }
    }
}

/// A text that is no dead time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("dead time '{0}': expected seconds of at least 0, estimate, or a range of seconds LOW:HIGH to estimate on")]
pub struct DeadTimeError(String);

impl std::str::FromStr for DeadTime {
    type Err = DeadTimeError;

    fn from_str(text: &str) -> Result<Self, DeadTimeError> {
        let wrong = || DeadTimeError(text.to_owned());
        let seconds = |text: &str| {
            let number: f64 = text.trim().parse().map_err(|_| wrong())?;
            let is_valid = number >= 0.0 && number.is_finite();
            is_valid.then_some(number).ok_or_else(wrong)
        };
        if text == "estimate" {
            return Ok(Self::Estimate(None));
        }
        let Some((low, high)) = text.split_once(':') else {
            return seconds(text).map(Self::Known);
        };
        let range = [seconds(low)?, seconds(high)?];
        if range[0] < range[1] {
            Ok(Self::Estimate(Some(range)))
        } else {
            Err(wrong())
        }
    }
}

impl std::fmt::Display for DeadTime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Known(seconds) => write!(f, "{seconds}"),
            Self::Estimate(None) => f.write_str("estimate"),
            Self::Estimate(Some([low, high])) => write!(f, "{low}:{high}"),
        }
    }
}

// A number is one of seconds.
text_in_files!(DeadTime, text_or_number, ["string", "number"]);
