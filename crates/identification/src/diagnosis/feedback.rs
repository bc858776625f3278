//! Whether y acts on u.

use super::{LEVEL, Residuals};
use crate::estimator::long_autoregression;

/// Returns the probability of a record like this, or one that speaks more for it, if there is no feedback from y to u;
/// `None` if there are too few samples.
///
/// The residuals are those of a long model `A y = B q^-delay u + e`, of the order by AIC, which is consistent in open
/// and closed loop whatever the noise is. So the result does not depend on the model that is being judged, whose own
/// residuals can hide feedback. They are tested by [`Residuals::feedback_p_value`].
pub fn feedback_p_value(u: &[f64], y: &[f64], delay: usize) -> Option<f64> {
    let model = long_autoregression(u, y, delay)?;
    Some(Residuals::new(&model, u, y)?.feedback_p_value())
}

/// Whether [`feedback_p_value`] speaks of feedback, at the level of the residual tests.
pub fn is_feedback(p_value: f64) -> bool {
    p_value < LEVEL
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

    fn normal(trial: u64, purpose: Purpose, n: usize) -> Vec<f64> {
        let mut signal = vec![0.0; n];
        let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
        input.fill(&mut stream(54, trial, purpose), &mut signal);
        signal
    }

    /// Coloured noise, `v(k) = 0.8 v(k-1) + e(k)`, and `u(k) = -K y(k) + r(k)`: without feedback the false alarms are
    /// as rare as the level, with it nearly all records show it.
    #[test]
    fn feedback_is_seen_and_its_absence_too() {
        let (n, trials) = (500, 600);
        let mut alarms = [0; 2];
        for trial in 0..trials {
            let (r, e) = (
                normal(trial, Purpose::Input, n),
                normal(trial, Purpose::Plant, n),
            );
            for (gain, alarms) in [0.0, 0.8].into_iter().zip(&mut alarms) {
                let (mut u, mut y, mut x, mut v) = (vec![0.0; n], vec![0.0; n], 0.0, 0.0);
                for k in 0..n {
                    if k > 0 {
                        x = 0.6 * x + u[k - 1];
                    }
                    v = 0.8 * v + 0.5 * e[k];
                    y[k] = x + v;
                    u[k] = r[k] - gain * y[k];
                }
                let p = feedback_p_value(&u, &y, 1).unwrap();
                *alarms += u64::from(is_feedback(p));
            }
        }
        // A share of 1 % of 600 is 6, with a standard error of 2.4.
        assert!(alarms[0] <= 18 && alarms[1] >= trials - 6, "{alarms:?}");
    }
}
