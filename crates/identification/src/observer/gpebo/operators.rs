//! The operators H_i that extend a regression, over the nodes of steps: first-order lags, exact for inputs that are
//! parabolas over each step, and delays.

use crate::real::{Mask, Real};

/// Values of a signal at 0, h/2 and h of a step.
pub type Nodes<R = f64> = [R; 3];

/// Returns the nodes of a signal that is zero.
#[inline(always)]
pub(super) fn no_signal<R: Real>() -> Nodes<R> {
    [R::zero(); 3]
}

/// Returns `int a b dt` over a step of length h, by Simpson's rule from the nodes of both signals.
#[inline(always)]
pub(super) fn simpson<R: Real>(h: R, a: &Nodes<R>, b: &Nodes<R>) -> R {
    h / R::splat(6.0) * (a[0] * b[0] + R::splat(4.0) * a[1] * b[1] + a[2] * b[2])
}

/// Returns `int a b dt` over the first half of a step of length h: of the parabola that Simpson's rule is of.
#[inline(always)]
pub(super) fn half_simpson<R: Real>(h: R, a: &Nodes<R>, b: &Nodes<R>) -> R {
    let (five, eight) = (R::splat(5.0), R::splat(8.0));
    h / R::splat(24.0) * (five * a[0] * b[0] + eight * a[1] * b[1] - a[2] * b[2])
}

/// Returns `phi_0 ... phi_3` at z: `phi_0 = e^z`, `phi_(k+1)(z) = (phi_k(z) - 1/k!) / z`, `phi_k(0) = 1/k!`.
///
/// For `|z| <= 1` it uses the Taylor series of phi_3 and the recurrence downwards, elsewhere the recurrence upwards.
/// Neither cancels. Source: M. Hochbruck and A. Ostermann, Exponential integrators, Acta Numerica 19 (2010) 209-286.
pub fn phi_functions(z: f64) -> [f64; 4] {
    if z.abs() > 1.0 {
        let first = z.exp_m1() / z;
        let second = (first - 1.0) / z;
        return [z.exp(), first, second, (second - 0.5) / z];
    }
    // phi_3 = sum z^k / (k + 3)!, by Horner from a term below 1e-18
    let third = (4..=19).rev().fold(1.0, |sum, k| 1.0 + z * sum / f64::from(k)) / 6.0;
    let second = 0.5 + z * third;
    let first = 1.0 + z * second;
    [z.exp(), first, second, third]
}

/// The filter `a / (p + a)`, i.e. `x' = -a x + a u`, a > 0 in 1/s, advanced by steps of a fixed length h in seconds.
#[derive(Clone, Copy, Debug)]
pub struct Filter<R = f64> {
    pole: f64,
    step: R,
    half: [R; 4],
    full: [R; 4],
}

impl<R: Real> Filter<R> {
    /// Returns the filter `a / (p + a)` with `a = pole`. No step length is set yet.
    pub fn new(pole: f64) -> Self {
        Self {
            pole,
            step: R::zero(),
            half: [1.0, 0.0, 0.0, 0.0].map(R::splat),
            full: [1.0, 0.0, 0.0, 0.0].map(R::splat),
        }
    }

    /// Prepares steps of length h.
    #[inline(always)]
    pub fn set_step(&mut self, h: R) {
        let others = h.less(self.step) | self.step.less(h);
        if others.any() {
            self.change_step(h, others);
        }
    }

    /// Computes the weights of the lanes whose step has changed.
    #[cold]
    #[inline(never)]
    fn change_step(&mut self, h: R, of: R::Mask) {
        self.step = h;
        for lane in of.lanes() {
            let h = h.lane(lane);
            for (to, s) in [(&mut self.half, 0.5), (&mut self.full, 1.0)] {
                for (to, weight) in to.iter_mut().zip(weights(self.pole, h, s)) {
                    *to = to.with_lane(lane, weight);
                }
            }
        }
    }

    /// Returns the filter's states at 0, h/2 and h, given its state at 0 and the input at these times. Exact if the
    /// input is the parabola through its three values; otherwise the error of one step is O(h^4).
    #[inline(always)]
    pub fn step(&self, state: R, u: &Nodes<R>) -> Nodes<R> {
        [state, weigh(&self.half, state, u), weigh(&self.full, state, u)]
    }
}

/// Returns the sum of the state and the three inputs by their weights.
#[inline(always)]
fn weigh<R: Real>(weights: &[R; 4], state: R, u: &Nodes<R>) -> R {
    weights[0] * state + weights[1] * u[0] + weights[2] * u[1] + weights[3] * u[2]
}

/// Returns the weights of the state and of the three inputs in the state at `s h`.
///
/// With `u(t) = c_0 + c_1 t/h + c_2 (t/h)^2` and `z = -a s h`,
/// `x(s h) = e^z x + a s h sum_k c_k s^k k! phi_(k+1)(z)`.
fn weights(a: f64, h: f64, s: f64) -> [f64; 4] {
    let [decay, phi_1, phi_2, phi_3] = phi_functions(-a * s * h);
    let gain = a * s * h;
    let (c0, c1, c2) = (gain * phi_1, gain * s * phi_2, gain * s * s * 2.0 * phi_3);
    [decay, c0 - 3.0 * c1 + 2.0 * c2, 4.0 * (c1 - c2), 2.0 * c2 - c1]
}

/// The longest delay in steps: its memory is that of so many steps of every delayed signal.
pub const LONGEST_DELAY: f64 = 1e4;

/// A linear operator H_i that extends a regression; of a signal that is zero before t = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operator {
    /// The lag `a / (p + a)` with the pole a > 0 in 1/s, from zero.
    Lag(f64),
    /// The delay `e^(-d p)` of d > 0 seconds: `H(v)(t) = v(t - d)` from t = d on, and 0 before.
    Delay(f64),
}

impl Operator {
    /// Returns the pole of a lag.
    pub(super) fn lag(&self) -> Option<f64> {
        match self {
            Self::Lag(pole) => Some(*pole),
            Self::Delay(_) => None,
        }
    }

    /// Returns the seconds of a delay.
    pub(super) fn delay(&self) -> Option<f64> {
        match self {
            Self::Lag(_) => None,
            Self::Delay(seconds) => Some(*seconds),
        }
    }

    /// Returns its number, the pole or the delay.
    pub(super) fn number(&self) -> f64 {
        match self {
            Self::Lag(number) | Self::Delay(number) => *number,
        }
    }
}

/// Returns a delay as a number of steps of length h, if it is a whole number from 1 to [`LONGEST_DELAY`].
pub(super) fn whole_steps(delay: f64, h: f64) -> Option<usize> {
    let steps = (delay / h).round();
    let whole = (delay / h - steps).abs() <= 1e-12 * steps;
    (whole && (1.0..=LONGEST_DELAY).contains(&steps)).then_some(steps as usize)
}

/// Signals delayed by a whole number of steps: the nodes of a step are those of an earlier step, exactly, and zero
/// before t = 0. A jump at the start of a step stays one.
#[derive(Clone, Debug)]
pub(super) struct DelayLine<R> {
    signals: usize,
    /// A ring of the nodes of the last steps, all signals of a step together.
    ring: Vec<Nodes<R>>,
    oldest: usize,
}

impl<R: Real> DelayLine<R> {
    /// Returns the line of so many signals and steps, with zeros in it.
    pub fn new(signals: usize, steps: usize) -> Self {
        Self {
            signals,
            ring: vec![no_signal(); signals * steps],
            oldest: 0,
        }
    }

    /// Returns the delayed signals in the current step.
    pub fn delayed(&self) -> &[Nodes<R>] {
        &self.ring[self.oldest..self.oldest + self.signals]
    }

    /// Returns the same to be replaced by the signals themselves, before [`Self::advance`].
    pub fn delayed_mut(&mut self) -> &mut [Nodes<R>] {
        &mut self.ring[self.oldest..self.oldest + self.signals]
    }

    /// Ends the step.
    pub fn advance(&mut self) {
        self.oldest = (self.oldest + self.signals) % self.ring.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Inputs 1, t, t^2 have closed-form responses. The particular solution of `x' = a (u - x)` is the polynomial
    /// `u - u'/a + u''/a^2`; a decaying exponential is added.
    #[test]
    fn parabolas_are_filtered_exactly() {
        for (a, h) in [(2.0, 0.7), (3.0, 1.0), (50.0, 1.0), (2000.0, 1.0)] {
            let c = [0.3, -1.2, 2.5];
            let u = |t: f64| c[0] + c[1] * t + c[2] * t * t;
            let particular = |t: f64| u(t) - (c[1] + 2.0 * c[2] * t) / a + 2.0 * c[2] / (a * a);
            let exact = |t: f64| particular(t) + (0.9 - particular(0.0)) * (-a * t).exp();
            let mut filter = Filter::new(a);
            filter.set_step(h);
            let found = filter.step(0.9, &[u(0.0), u(h / 2.0), u(h)]);
            for (found, t) in found.iter().zip([0.0, h / 2.0, h]) {
                assert!((found - exact(t)).abs() < 1e-13, "a {a} h {h}");
            }
        }
    }

    /// For `a h -> 0` the step becomes Simpson's rule, to first order in a h, however small a h is.
    #[test]
    fn tiny_steps() {
        for a in [1e-6, 1e-12, 1e-300] {
            let mut filter = Filter::new(a);
            filter.set_step(1.0);
            let state = filter.step(0.0, &[1.0, 2.0, 5.0])[2];
            let simpson = (1.0 + 8.0 + 5.0) / 6.0;
            assert!((state / (a * simpson) - 1.0).abs() < 2.0 * a + 1e-15);
        }
    }

    /// Both branches agree at |z| = 1, and phi_k(0) = 1/k!.
    #[test]
    fn phi_functions_are_continuous() {
        assert_eq!(phi_functions(0.0), [1.0, 1.0, 0.5, 1.0 / 6.0]);
        for z in [-1.0, 1.0_f64] {
            let (inner, outer) = (phi_functions(z), phi_functions(z * (1.0 + 1e-15)));
            for (inner, outer) in inner.iter().zip(outer) {
                assert!((inner - outer).abs() < 5e-15);
            }
        }
    }

    #[test]
    fn delays_are_whole_numbers_of_steps() {
        assert_eq!(whole_steps(0.3, 0.1), Some(3));
        assert_eq!(whole_steps(50.0, 0.005), Some(10_000));
        for (delay, h) in [(0.25, 0.1), (0.3 + 1e-9, 0.1), (0.04, 0.1), (50.005, 0.005)] {
            assert_eq!(whole_steps(delay, h), None, "{delay} {h}");
        }
    }
}
