//! The choice of an observer: by pole placement, the Kalman filter, or GPEBO.

use super::{Gain, GainError, ThetaEstimator};

/// A method's own observer, used instead of the setting's gain. Every kind is a one-step predictor: xhat(k) uses data
/// up to k - 1.
#[derive(Clone, Debug, PartialEq)]
pub enum ObserverKind {
    /// Luenberger's observer with placed poles.
    Luenberger(Gain),
    /// The steady-state Kalman filter. With the true plant, the covariances and the colour of the noise are known too.
    /// With an identified plant, they are identified on the window.
    Kalman,
    /// The steady-state Kalman filter of an identified model whose measurement noise has the colour that was identified
    /// with it.
    KalmanColoured,
    /// The time-varying Kalman filter, starting from the covariance of x(0). Everything is known.
    KalmanVarying,
    /// The steady-state Kalman filter of the true plant with covariances of the noise that an experiment file has by
    /// this name, right or wrong.
    KalmanNamed(String),
    /// GPEBO: no feedback, and an estimate of the error of the start.
    Gpebo(ThetaEstimator),
}

/// Why an observer was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObserverKindError {
    /// The text has none of the known forms.
    #[error(
        "unknown observer '{0}'; expected kalman, kalman-coloured, kalman-varying, kalman:COVARIANCES, dead-beat, \
        gpebo-drem:GAMMA, gpebo-squares:RHO, scaled:RHO or poles:LIST"
    )]
    Form(String),
    /// The number of a GPEBO is wrong.
    #[error("observer '{0}': expected a number above 0 after the colon")]
    Positive(String),
    /// The gain is wrong.
    #[error(transparent)]
    Gain(#[from] GainError),
}

const DREM: &str = "gpebo-drem:";
const SQUARES: &str = "gpebo-squares:";
const NAMED: &str = "kalman:";

impl std::fmt::Display for ObserverKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Luenberger(gain) => gain.fmt(f),
            Self::Kalman => f.write_str("kalman"),
            Self::KalmanColoured => f.write_str("kalman-coloured"),
            Self::KalmanVarying => f.write_str("kalman-varying"),
            Self::KalmanNamed(name) => write!(f, "{NAMED}{name}"),
            Self::Gpebo(ThetaEstimator::Drem(gamma)) => write!(f, "{DREM}{gamma:?}"),
            Self::Gpebo(ThetaEstimator::Squares(rho)) => write!(f, "{SQUARES}{rho:?}"),
        }
    }
}

impl std::str::FromStr for ObserverKind {
    type Err = ObserverKindError;

    fn from_str(text: &str) -> Result<Self, ObserverKindError> {
        type Estimator = fn(f64) -> ThetaEstimator;
        let estimators: [(&str, Estimator); 2] = [(DREM, ThetaEstimator::Drem), (SQUARES, ThetaEstimator::Squares)];
        for (name, estimator) in estimators {
            if let Some(number) = text.strip_prefix(name) {
                let number = number.parse().ok();
                let positive = number.filter(|x: &f64| x.is_finite() && *x > 0.0);
                let kind = positive.map(|number| Self::Gpebo(estimator(number)));
                return kind.ok_or_else(|| ObserverKindError::Positive(text.to_owned()));
            }
        }
        if let Some(name) = text.strip_prefix(NAMED).filter(|name| !name.is_empty()) {
            return Ok(Self::KalmanNamed(name.to_owned()));
        }
        match text {
            "kalman" => Ok(Self::Kalman),
            "kalman-coloured" => Ok(Self::KalmanColoured),
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
        for text in [
            "kalman",
            "kalman-coloured",
            "kalman-varying",
            "kalman:believed",
            "gpebo-drem:2.0",
            "gpebo-squares:1e-6",
            "dead-beat",
            "scaled:0.5",
        ] {
            assert_eq!(text.parse::<ObserverKind>().unwrap().to_string(), text);
        }
        let error = "kalmann".parse::<ObserverKind>().unwrap_err().to_string();
        assert!(error.contains("'kalmann'; expected kalman,"), "{error}");
        for wrong in ["gpebo-drem:0", "gpebo-squares:-1", "gpebo-drem:inf"] {
            let error = wrong.parse::<ObserverKind>().unwrap_err().to_string();
            assert!(error.contains("above 0"), "{error}");
        }
        let error = "scaled:x".parse::<ObserverKind>().unwrap_err().to_string();
        assert!(error.contains("'x' is not a finite number"), "{error}");
    }
}
