//! Models of any order against the plant: by impulse response, and by their output under a fresh input.

use crate::plant::{drive, simulate};
use crate::signal::{Input, Purpose, stream};

/// A system by its last row of A and its input vector, of one length: a plant or a model, not necessarily of one order.
#[derive(Clone, Copy, Debug)]
pub struct System<'a> {
    /// Last row of A.
    pub a: &'a [f64],
    /// Input vector.
    pub b: &'a [f64],
}

/// The plant's responses over L samples, with buffers of their own: one value per worker.
#[derive(Clone, Debug)]
pub struct Response {
    /// Markov parameters g(1) ... g(L) of the plant, `g(k) = c'A^(k-1) b`.
    markov: Vec<f64>,
    /// The fresh input.
    u: Vec<f64>,
    /// The plant's noise-free output under it, from rest.
    y: Vec<f64>,
    /// The state under way.
    x: Vec<f64>,
}

impl Response {
    /// Buffers for L samples.
    pub fn new(samples: usize) -> Self {
        let vector = || vec![0.0; samples];
        Self {
            markov: vector(),
            u: vector(),
            y: vector(),
            x: Vec::new(),
        }
    }

    /// Takes a trial's plant, and draws its fresh input from the stream of [`Purpose::FreshInput`], by the law and
    /// amplitude of the process's input.
    ///
    /// # Panics
    /// If the plant's a and b differ in length or are empty.
    pub fn set_plant(&mut self, plant: System<'_>, input: &Input, seed: u64, trial: u64) {
        let markov = &mut self.markov;
        restart(&mut self.x, plant.b);
        drive(plant.a, plant.b, &mut self.x, markov.len(), |k, x| {
            markov[k] = x[0];
            0.0
        });
        let mut fresh = stream(seed, trial, Purpose::FreshInput);
        input.fill(&mut fresh, &mut self.u);
        self.x.fill(0.0);
        let y = &mut self.y;
        simulate(plant.a, plant.b, &mut self.x, &self.u, |k, x| y[k] = x[0]);
    }

    /// `|| g - ghat || / || g ||` over the first L Markov parameters.
    ///
    /// Infinite where the response of an unstable model overflows; NaN where g is zero or overflows, or where a
    /// coefficient of the model is not finite.
    ///
    /// # Panics
    /// If the model's a and b differ in length or are empty.
    pub fn impulse_response_error(&mut self, model: System<'_>) -> f64 {
        let (markov, mut error) = (&self.markov, 0.0);
        restart(&mut self.x, model.b);
        drive(model.a, model.b, &mut self.x, markov.len(), |k, x| {
            error = (markov[k] - x[0]).mul_add(markov[k] - x[0], error);
            0.0
        });
        let size = markov.iter().fold(0.0, |sum: f64, g| g.mul_add(*g, sum));
        if !(size > 0.0 && size.is_finite()) {
            return f64::NAN;
        }
        (overflow_as_infinity(model, error) / size).sqrt()
    }

    /// FIT per cent, `100 (1 - || y - yhat || / || y - mean(y) ||)`, of the model's simulated output on the fresh input;
    /// plant and model from rest, without noise.
    ///
    /// Minus infinity where the output of an unstable model overflows; NaN where y is constant (as without input) or
    /// overflows, or where a coefficient of the model is not finite.
    ///
    /// # Panics
    /// If the model's a and b differ in length or are empty.
    pub fn fresh_fit(&mut self, model: System<'_>) -> f64 {
        let (y, mut error) = (&self.y, 0.0);
        self.x.clear();
        self.x.resize(model.a.len(), 0.0);
        simulate(model.a, model.b, &mut self.x, &self.u, |k, x| {
            error = (y[k] - x[0]).mul_add(y[k] - x[0], error);
        });
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let spread = y
            .iter()
            .fold(0.0, |sum, y| (y - mean).mul_add(y - mean, sum));
        if !(spread > 0.0 && spread.is_finite()) {
            return f64::NAN;
        }
        100.0 * (1.0 - (overflow_as_infinity(model, error) / spread).sqrt())
    }
}

/// The state b: the response to an impulse at k = 0 from k = 1 on.
fn restart(x: &mut Vec<f64>, b: &[f64]) {
    x.clear();
    x.extend_from_slice(b);
}

/// A sum of squares of a finite model that is NaN has overflowed (as infinity minus infinity).
fn overflow_as_infinity(model: System<'_>, sum: f64) -> f64 {
    let finite = model.a.iter().chain(model.b).all(|c| c.is_finite());
    if finite && sum.is_nan() {
        f64::INFINITY
    } else {
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{InputLaw, Sequence};

    fn response(a: &[f64], b: &[f64], samples: usize) -> Response {
        let mut response = Response::new(samples);
        let input = Input::new(InputLaw::Signs, 2.0, Sequence::Independent);
        response.set_plant(System { a, b }, &input, 1, 2);
        response
    }

    /// g(k) = 0.5^(k-1) against 0.25^(k-1): sums of 0.25^k, 0.125^k and 0.0625^k.
    #[test]
    fn a_first_order_impulse_response_by_hand() {
        let mut response = response(&[0.5], &[1.0], 60);
        let error = response.impulse_response_error(System {
            a: &[0.25],
            b: &[1.0],
        });
        let size: f64 = 1.0 / (1.0 - 0.25);
        let expected = ((size - 2.0 / (1.0 - 0.125) + 1.0 / (1.0 - 0.0625)) / size).sqrt();
        assert!((error - expected).abs() < 1e-14, "{error} {expected}");
    }

    /// A model of higher order with a pole and a zero that cancel is the plant.
    #[test]
    fn cancelling_poles_and_zeros_do_not_count() {
        // (z - 0.3) / ((z - 0.5)(z - 0.3)): a = (-0.15, 0.8), h = (1, -0.3), b = (1, 0.5).
        let model = System {
            a: &[-0.15, 0.8],
            b: &[1.0, 0.5],
        };
        let mut response = response(&[0.5], &[1.0], 100);
        assert!(response.impulse_response_error(model) < 1e-15);
        assert!((response.fresh_fit(model) - 100.0).abs() < 1e-12);
        // Its zero output explains next to nothing.
        let zero = System {
            a: &[0.0],
            b: &[0.0],
        };
        assert_eq!(response.impulse_response_error(zero), 1.0);
        assert!(response.fresh_fit(zero) <= 1e-12 && response.fresh_fit(zero) > -10.0);
    }

    #[test]
    fn what_is_not_finite_is_stated() {
        let mut response = response(&[0.5], &[1.0], 20_000);
        let unstable = System {
            a: &[-3.0],
            b: &[1.0],
        };
        assert_eq!(response.impulse_response_error(unstable), f64::INFINITY);
        assert_eq!(response.fresh_fit(unstable), f64::NEG_INFINITY);
        let broken = System {
            a: &[f64::NAN],
            b: &[1.0],
        };
        assert!(response.impulse_response_error(broken).is_nan());
        assert!(response.fresh_fit(broken).is_nan());
        let zero = System {
            a: &[0.5],
            b: &[0.0],
        };
        response.set_plant(
            zero,
            &Input::new(InputLaw::Gaussian, 1.0, Sequence::default()),
            1,
            2,
        );
        assert!(response.impulse_response_error(unstable).is_nan());
        assert!(response.fresh_fit(unstable).is_nan());
    }
}
