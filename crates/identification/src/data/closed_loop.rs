//! The loop around the plant: none, output feedback, or a user-defined controller.
//!
//! The plant is strictly proper: y(k) depends on u up to k - 1 only. So u(k) may use y(k) without an algebraic loop.

use super::{ControlLaw, DrawFailure, History, Realisation};
use crate::model::polynomial;
use crate::plant::{StateSpace, drive};
use crate::text::{text_in_files, text_or_number};
#[cfg(feature = "json")]
use serde_json::{Value, json};

/// The feedback that closes the loop.
#[derive(Clone, Debug, Default)]
pub enum Feedback {
    /// Nothing: u = r (the default).
    #[default]
    None,
    /// `u(k) = -K(q) y(k) + r(k)` from k = 0 on.
    Output(OutputFeedback),
    /// A user-defined controller, after an open-loop part of [`ControlLaw::pilot`] samples that precedes the record.
    Controlled(ControlLaw),
}

impl Feedback {
    /// Returns the number of samples in open loop before the record.
    pub const fn pilot(&self) -> usize {
        match self {
            Self::Controlled(law) => law.pilot(),
            Self::None | Self::Output(_) => 0,
        }
    }

    /// Returns every setting, for a manifest.
    #[cfg(feature = "json")]
    pub fn describe(&self) -> Value {
        match self {
            Self::None => json!("none"),
            Self::Output(law) => json!({
                "output": { "numerator": law.numerator, "denominator": law.denominator() }
            }),
            Self::Controlled(law) => json!({
                "controlled": {
                    "pilot": law.pilot(),
                    "silent": law.is_silent(),
                    "law": law.description(),
                }
            }),
        }
    }
}

/// Output feedback `K(q) = (c_0 + c_1 q^-1 + ...) / (1 + d_1 q^-1 + ...)`, acting on the measured y, at rest before k =
/// 0.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputFeedback {
    /// c_0 ... c_q.
    numerator: Vec<f64>,
    /// d_1 ... d_p.
    denominator: Vec<f64>,
}

/// Why an output feedback was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FeedbackError {
    /// The numerator is empty or has a coefficient that is not finite.
    #[error("the feedback's numerator must be finite numbers, at least one")]
    Numerator,
    /// The denominator is empty, does not begin with 1, or has a coefficient that is not finite.
    #[error("the feedback's denominator must be finite numbers beginning with 1")]
    Denominator,
    /// The text is not a K(q).
    #[error(
        "feedback '{0}': expected a gain (such as 0.5) or c_0,c_1,.../1,d_1,... \
         (such as 0.5,-0.2/1,-0.9)"
    )]
    Form(String),
}

impl OutputFeedback {
    /// Makes K(q) from c_0, c_1, ... and 1, d_1, ... It need not be stable.
    ///
    /// # Errors
    /// If a polynomial is empty or not finite, or the denominator is not monic.
    pub fn new(numerator: &[f64], denominator: &[f64]) -> Result<Self, FeedbackError> {
        if numerator.is_empty() || !numerator.iter().all(|c| c.is_finite()) {
            return Err(FeedbackError::Numerator);
        }
        if denominator.first() != Some(&1.0) || !denominator.iter().all(|d| d.is_finite()) {
            return Err(FeedbackError::Denominator);
        }
        Ok(Self {
            numerator: numerator.to_vec(),
            denominator: denominator[1..].to_vec(),
        })
    }

    /// Returns c_0 ... c_q.
    pub fn numerator(&self) -> &[f64] {
        &self.numerator
    }

    /// Returns 1, d_1 ... d_p.
    pub fn denominator(&self) -> Vec<f64> {
        [&[1.0], self.denominator.as_slice()].concat()
    }

    /// Returns `v(k) = sum_i c_i y(k-i) - sum_i d_i v(k-i)`, summed from the newest sample, given v(0) ... v(k-1) and
    /// y(0) ... y(k).
    #[inline(always)]
    fn output(&self, k: usize, y: &[f64], v: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (i, c) in self.numerator.iter().enumerate().take(k + 1) {
            sum = c.mul_add(y[k - i], sum);
        }
        for (i, d) in self.denominator.iter().enumerate().take(k) {
            sum = (-d).mul_add(v[k - 1 - i], sum);
        }
        sum
    }

    /// Runs the loop with the noise `scale f` from the state in `to.x`; computes y0, y, u0 and the states.
    pub(super) fn run(&self, plant: &StateSpace, scale: f64, to: &mut Realisation) {
        let n = plant.order();
        let Realisation {
            r,
            u0,
            y,
            y0,
            f,
            states,
            x,
            fed_back: v,
            ..
        } = to;
        v.resize(r.len(), 0.0);
        drive(
            plant.a(),
            plant.b(),
            x,
            r.len(),
            #[inline(always)]
            |k, x| {
                y0[k] = x[0];
                states[k * n..(k + 1) * n].copy_from_slice(x);
                y[k] = scale.mul_add(f[k], x[0]);
                v[k] = self.output(k, y, v);
                u0[k] = r[k] - v[k];
                u0[k]
            },
        );
    }
}

/// Runs a controller's loop with the noise `scale f` from the state in `to.x`; computes y0, y, u0, u, the states and
/// their estimates. On entry, `to.u` holds the input-measurement noise.
pub(super) fn run_controlled(
    law: &ControlLaw,
    plant: &StateSpace,
    scale: f64,
    to: &mut Realisation,
) -> Result<(), DrawFailure> {
    let n = plant.order();
    let Realisation {
        r,
        u,
        u0,
        y,
        y0,
        f,
        states,
        x,
        truth,
        estimates,
        controller,
        ..
    } = to;
    let controller = controller.for_law(law, truth);
    let mut outcome = Ok(());
    drive(plant.a(), plant.b(), x, r.len(), |k, x| {
        y0[k] = x[0];
        states[k * n..(k + 1) * n].copy_from_slice(x);
        y[k] = scale.mul_add(f[k], x[0]);
        let history = History {
            r: &r[..=k],
            u: &u[..k],
            y: &y[..=k],
        };
        u0[k] = if k < law.pilot() {
            r[k]
        } else if outcome.is_ok() {
            let input = controller.control(history).unwrap_or_else(|failure| {
                outcome = Err(failure);
                f64::NAN
            });
            estimates.extend_from_slice(controller.estimate());
            input
        } else {
            f64::NAN
        };
        u[k] += u0[k];
        u0[k]
    });
    outcome
}

// A number is a static gain.
text_in_files!(OutputFeedback, text_or_number, ["string", "number"]);

impl std::str::FromStr for OutputFeedback {
    type Err = FeedbackError;

    /// Parses `c_0,c_1,...` or `c_0,c_1,.../1,d_1,...`.
    fn from_str(text: &str) -> Result<Self, FeedbackError> {
        let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
        let numbers = |list: &str| polynomial::parse(list).ok_or_else(|| FeedbackError::Form(text.to_owned()));
        Self::new(&numbers(numerator)?, &numbers(denominator)?)
    }
}

impl std::fmt::Display for OutputFeedback {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&polynomial::text(&self.numerator))?;
        if self.denominator.is_empty() {
            return Ok(());
        }
        write!(f, "/{}", polynomial::text(&self.denominator()))
    }
}
