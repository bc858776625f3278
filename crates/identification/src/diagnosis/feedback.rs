//! Whether y acts on u.

use super::LEVEL;
use super::added_columns::{Added, AddedColumns};
use super::verdict::{lags_of, of_two};
use crate::data::Rounding;
use crate::estimator::long_autoregression_order;
use serde::Serialize;

/// Future inputs that are tested by themselves beside all of them, u(k) included.
const NEAR: usize = 6;

/// Singular values of the past that count, of the largest: an input that its own past tells adds nothing.
const TOLERANCE: f64 = 1e-13;

/// The most samples that are tested, the first of a record.
const MOST: usize = 20_000;

/// The share of the squares of y beside its past that u(k) leaves where it tells y(k): one per cent of y's size.
const TOLD: f64 = 1e-4;

/// The signs of feedback in a record: p-values of F tests at 1 % that future inputs help to predict y(k) beside its
/// past.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FeedbackTest {
    /// Of u(k) ... u(k+L), without u(k) if nk = 0: that of the smaller p-value of two, the first six and all.
    pub p_value: f64,
    /// Of u(k) alone; `None` if nk = 0.
    pub at_once: Option<f64>,
    /// Of u(k+1) ... u(k+5) beside u(k).
    pub later: Option<f64>,
    /// Whether u(k) and the past tell y(k) to one per cent of the part that the past does not.
    pub told: bool,
}

/// A conclusion of [`FeedbackTest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoopVerdict {
    /// No future input helps.
    Open,
    /// Later inputs follow y, as under feedback. A direct term does not do that.
    Feedback,
    /// u(k) and y(k) move together and no later input follows y: u acts at once (nk = 0), or a controller without
    /// memory answers within the sample.
    AtOnce,
    /// The same, and u(k) tells y(k): a controller without a change of its setpoint, or u acts at once without noise.
    Told,
}

impl FeedbackTest {
    /// Tests a record; `None` where its input cannot tell: its own past tells it, as of few sines or a ramp, or there
    /// are too few samples, or y is told by its past to rounding.
    ///
    /// y(k) is regressed on 1, 2p values of its past (at most N/8) and max(2p + 5, p + L) of that of u (at most N/4), p
    /// being the order of `A y = B u + e` by AIC (at most N/10 and 50, signals less their means) and L = 25 or N/8;
    /// of more than 20,000 samples the first are tested. So the result does not depend on the model that is being
    /// judged, whose own residuals can hide feedback.
    pub fn of(u: &[f64], y: &[f64], delay: usize, rounding: Rounding) -> Option<Self> {
        let n = y.len().min(MOST);
        let lags = lags_of(n);
        let direct = delay == 0;
        let centred = |signal: &[f64]| {
            let mean = signal[..n].iter().sum::<f64>() / n as f64;
            signal[..n].iter().map(|x| x - mean).collect::<Vec<f64>>()
        };
        if lags == 0 {
            return None;
        }
        let (u, y) = (centred(u), centred(y));
        let p = long_autoregression_order(&u, &y, usize::from(!direct), n / 10);
        let of_y = (2 * p).min(n / 8);
        let of_u = (2 * p + 5).max(p + lags).min(n / 4);
        let first = of_y.max(of_u);
        let rows = n.checked_sub(first + lags).filter(|rows| *rows > 0)?;
        // Ahead of k; the past of u ends at u(k) where u acts at once.
        let past_u = usize::from(direct) + of_u;
        let known = 1 + of_y + past_u;
        let added = lags + usize::from(!direct);
        let regression = AddedColumns::new(rows, known + added + 1, TOLERANCE, |column, row, to| {
            let k = first + row;
            let range = |signal: &[f64], from: usize, to: &mut [f64]| {
                let count = to.len();
                to.copy_from_slice(&signal[from..from + count]);
            };
            match column {
                0 => to.fill(1.0),
                j if j <= of_y => range(&y, k - j, to),
                j if j < known => range(&u, k + 1 - usize::from(!direct) - (j - of_y), to),
                j if j < known + added => range(&u, k + usize::from(direct) + (j - known), to),
                _ => range(&y, k, to),
            }
        })?;
        let near = regression.test(known, NEAR.min(added));
        let all = regression.test(known, added);
        let exact = |test: &Option<Added>| {
            let of_y = rows as f64 * rounding.y * rounding.y;
            test.as_ref().is_some_and(|test| test.squares <= of_y)
        };
        if exact(&near) || exact(&all) {
            return None;
        }
        let p_value = of_two(near, all, added)?.p_value;
        let at_once = if direct { None } else { regression.test(known, 1) };
        let beside = known + usize::from(!direct);
        let later = regression.test(beside, (NEAR - 1).min(added - usize::from(!direct)));
        Some(Self {
            p_value,
            told: at_once.as_ref().is_some_and(|test| test.left < TOLD),
            at_once: at_once.map(|test| test.p_value),
            later: later.map(|test| test.p_value),
        })
    }

    /// Whether the record speaks of feedback or of a direct term.
    pub fn is_found(&self) -> bool {
        self.verdict() != LoopVerdict::Open
    }

    /// Returns the conclusion, each p-value at 1 %.
    pub fn verdict(&self) -> LoopVerdict {
        let small = |p: Option<f64>| p.is_some_and(|p| p < LEVEL);
        if self.p_value >= LEVEL {
            LoopVerdict::Open
        } else if small(self.at_once) && self.told {
            LoopVerdict::Told
        } else if small(self.at_once) && !small(self.later) {
            LoopVerdict::AtOnce
        } else {
            LoopVerdict::Feedback
        }
    }
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
            let (r, e) = (normal(trial, Purpose::Input, n), normal(trial, Purpose::Plant, n));
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
                let found = FeedbackTest::of(&u, &y, 1, Rounding::default()).unwrap();
                *alarms += u64::from(found.is_found());
            }
        }
        // A share of 1 % of 600 is 6, with a standard error of 2.4.
        assert!(alarms[0] <= 18 && alarms[1] >= trials - 6, "{alarms:?}");
    }

    /// A direct term, a controller that answers a sample later, and one at a constant setpoint, whose u(k) is a
    /// function of y(k), each under its own name. With nk = 0 the direct term is no sign of anything. One sine tells
    /// nothing.
    #[test]
    fn causes_are_told_apart() {
        let (n, trials) = (400, 40);
        let mut named = [0; 4];
        for trial in 0..trials {
            let (r, e) = (normal(trial, Purpose::Input, n), normal(trial, Purpose::Plant, n));
            let record = |direct: f64, at_once: f64, later: f64, setpoint: f64| {
                let (mut u, mut y, mut x) = (vec![0.0; n], vec![0.0; n], 0.0);
                for k in 0..n {
                    let before = if k > 0 { u[k - 1] } else { 0.0 };
                    x = 0.6 * x + before;
                    let last = if k > 0 { y[k - 1] } else { 0.0 };
                    let free = x + 0.5 * e[k];
                    u[k] = (setpoint * r[k] - at_once * free - later * last) / (1.0 + at_once * direct);
                    y[k] = free + direct * u[k];
                }
                [u, y]
            };
            let verdict = |[u, y]: [Vec<f64>; 2], delay: usize| {
                let found = FeedbackTest::of(&u, &y, delay, Rounding::default());
                found.map(|found| found.verdict())
            };
            let found = [
                verdict(record(0.7, 0.0, 0.0, 1.0), 1) == Some(LoopVerdict::AtOnce),
                verdict(record(0.7, 0.0, 0.0, 1.0), 0) == Some(LoopVerdict::Open),
                verdict(record(0.0, 0.0, 0.8, 1.0), 1) == Some(LoopVerdict::Feedback),
                verdict(record(0.0, 0.8, 0.0, 0.0), 1) == Some(LoopVerdict::Told),
            ];
            for (named, found) in named.iter_mut().zip(found) {
                *named += u64::from(found);
            }
            let sine: Vec<f64> = (0..n).map(|k| (0.3 * k as f64).sin()).collect();
            assert_eq!(FeedbackTest::of(&sine, &e, 1, Rounding::default()), None);
        }
        assert!(named.iter().all(|named| *named >= trials - 4), "{named:?}");
    }
}
