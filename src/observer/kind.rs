//! Which observer looks at a model: by pole placement, or Kalman's.

use super::{Gain, GainError};

/// An observer of a method's own instead of the setting's gain. All are one-step predictors:
/// xhat(k) is made of data up to k - 1.
#[derive(Clone, Debug, PartialEq)]
pub enum ObserverKind {
    /// Luenberger's, with poles that are placed.
    Luenberger(Gain),
    /// The steady-state Kalman filter. With the true plant the covariances and the colour of the
    /// noise are known too; with an identified one they are identified on the window.
    Kalman,
    /// The time-varying Kalman filter from the covariance of x(0), all known.
    KalmanVarying,
}

/// Why an observer was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObserverKindError {
    /// Not one of the forms.
    #[error(
        "unknown observer '{0}'; expected kalman, kalman-varying, dead-beat, scaled:RHO or \
        poles:LIST"
    )]
    Form(String),
    /// What is wrong with a gain.
    #[error(transparent)]
    Gain(#[from] GainError),
}

impl std::fmt::Display for ObserverKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Luenberger(gain) => gain.fmt(f),
            Self::Kalman => f.write_str("kalman"),
            Self::KalmanVarying => f.write_str("kalman-varying"),
        }
    }
}

impl std::str::FromStr for ObserverKind {
    type Err = ObserverKindError;

    fn from_str(text: &str) -> Result<Self, ObserverKindError> {
        match text {
            "kalman" => Ok(Self::Kalman),
            "kalman-varying" => Ok(Self::KalmanVarying),
            _ => text.parse().map(Self::Luenberger).map_err(|e| match e {
                GainError::Form(text) => ObserverKindError::Form(text),
                other => other.into(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names() {
        for text in ["kalman", "kalman-varying", "dead-beat", "scaled:0.5"] {
            assert_eq!(text.parse::<ObserverKind>().unwrap().to_string(), text);
        }
        let error = "kalmann".parse::<ObserverKind>().unwrap_err().to_string();
        assert!(error.contains("'kalmann'; expected kalman,"), "{error}");
        let error = "scaled:x".parse::<ObserverKind>().unwrap_err().to_string();
        assert!(error.contains("'x' is not a finite number"), "{error}");
    }
}
