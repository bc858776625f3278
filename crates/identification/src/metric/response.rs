//! Compares models of any order with the plant: by impulse response, and by their output under a fresh input. Generic
//! over [`Real`]: one trial, or one per lane.

use crate::plant::inlined::{decay, simulate};
use crate::real::Real;

/// A system given by the last row of A, its input vector of the same length, and its direct term. It is a plant or a
/// model; their orders may differ.
#[derive(Clone, Copy, Debug)]
pub struct System<'a, R = f64> {
    /// Last row of A.
    pub a: &'a [R],
    /// Input vector.
    pub b: &'a [R],
    /// Direct term.
    pub d: R,
}

impl<R: Real> System<'_, R> {
    /// A mask of the lanes in which all coefficients are finite.
    #[inline(always)]
    fn is_finite(self) -> R::Mask {
        let mut check = R::zero();
        for i in 0..self.a.len() {
            check = self.a[i].mul_add(R::zero(), check);
            check = self.b[i].mul_add(R::zero(), check);
        }
        check = self.d.mul_add(R::zero(), check);
        check.is_finite()
    }
}

/// The plant's responses over L samples, and their buffers; each worker has one.
///
/// Every argument `x` is scratch space for the state of the system passed with it; its contents are overwritten. For
/// speed, call these functions from within [`Real::run`].
#[derive(Clone, Debug)]
pub struct Response<R = f64> {
    /// Markov parameters g(1) ... g(L) of the plant, `g(k) = c'A^(k-1) b`.
    markov: Vec<R>,
    /// `|| g ||^2`.
    size: R,
    /// The fresh input u.
    u: Vec<R>,
    /// The plant's noise-free output under u, from rest.
    y: Vec<R>,
    /// `|| y - mean(y) ||^2`.
    spread: R,
}

impl<R: Real> Response<R> {
    /// Allocates buffers for L samples.
    pub fn new(samples: usize) -> Self {
        let zero = R::zero();
        let zeros = || vec![zero; samples];
        Self {
            markov: zeros(),
            size: zero,
            u: zeros(),
            y: zeros(),
            spread: zero,
        }
    }

    /// Computes and stores the impulse response of a plant.
    ///
    /// # Panics
    /// If a, b and `x` differ in length or are empty.
    #[inline(always)]
    pub fn set_impulse_response(&mut self, plant: System<'_, R>, x: &mut [R]) {
        let (markov, mut size) = (&mut self.markov[..], R::zero());
        x.copy_from_slice(plant.b);
        decay(
            plant.a,
            x,
            markov.len(),
            #[inline(always)]
            |k, x| {
                markov[k] = x[0];
                size = x[0].mul_add(x[0], size);
            },
        );
        self.size = size;
    }

    /// The fresh input, L samples. Fill it before calling [`Self::set_fresh_output`].
    pub fn input(&mut self) -> &mut [R] {
        &mut self.u
    }

    /// Computes and stores the noise-free output of a plant, from rest, under the fresh input.
    ///
    /// # Panics
    /// If a, b and `x` differ in length or are empty.
    #[inline(always)]
    pub fn set_fresh_output(&mut self, plant: System<'_, R>, x: &mut [R]) {
        let (y, mut sum) = (&mut self.y[..], R::zero());
        x.fill(R::zero());
        simulate(
            plant.a,
            plant.b,
            x,
            &self.u,
            #[inline(always)]
            |k, x| {
                y[k] = x[0];
                sum = sum + x[0];
            },
        );
        let mean = sum / R::splat(y.len() as f64);
        let mut spread = R::zero();
        for y in y {
            let difference = *y - mean;
            spread = difference.mul_add(difference, spread);
        }
        self.spread = spread;
    }

    /// `|| g - ghat || / || g ||` over the direct term, which is zero for the plant, and the first L Markov parameters.
    ///
    /// Infinite if the response of an unstable model overflows. NaN if g is zero or overflows, or if a coefficient of
    /// the model is not finite.
    ///
    /// # Panics
    /// If the model's a, b and `x` differ in length or are empty.
    #[inline(always)]
    pub fn impulse_response_error(&self, model: System<'_, R>, x: &mut [R]) -> R {
        let (markov, mut error) = (&self.markov[..], model.d * model.d);
        x.copy_from_slice(model.b);
        decay(
            model.a,
            x,
            markov.len(),
            #[inline(always)]
            |k, x| {
                let difference = markov[k] - x[0];
                error = difference.mul_add(difference, error);
            },
        );
        relative(error, self.size, model)
    }

    /// The FIT in per cent, `100 (1 - || y - yhat || / || y - mean(y) ||)`, of the model's simulated output under the
    /// fresh input. Plant and model start from rest, without noise.
    ///
    /// Minus infinity if the output of an unstable model overflows. NaN if y is constant (as without input) or
    /// overflows, or if a coefficient of the model is not finite.
    ///
    /// # Panics
    /// If the model's a, b and `x` differ in length or are empty.
    #[inline(always)]
    pub fn fresh_fit(&self, model: System<'_, R>, x: &mut [R]) -> R {
        let (u, y, mut error) = (&self.u[..], &self.y[..], R::zero());
        x.fill(R::zero());
        simulate(
            model.a,
            model.b,
            x,
            u,
            #[inline(always)]
            |k, x| {
                let difference = model.d.neg_mul_add(u[k], y[k] - x[0]);
                error = difference.mul_add(difference, error);
            },
        );
        R::splat(100.0) * (R::splat(1.0) - relative(error, self.spread, model))
    }
}

/// The root of the ratio of a model's sum of squared errors to the plant's sum of squares. An error sum that is NaN has
/// overflowed (as infinity minus infinity) and counts as infinite. NaN if there is nothing to compare.
#[inline(always)]
fn relative<R: Real>(error: R, size: R, model: System<'_, R>) -> R {
    let is_number = error.at_most(R::splat(f64::INFINITY));
    let error = R::select(is_number, error, R::splat(f64::INFINITY));
    let defined = R::zero().less(size) & size.is_finite() & model.is_finite();
    R::select(defined, (error / size).sqrt(), R::splat(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

    /// The responses of a plant of the first order, with random signs as input.
    fn response(a: f64, b: f64, samples: usize) -> Response {
        let mut response = Response::new(samples);
        let input = Input::new(InputLaw::Signs, 2.0, Sequence::Independent);
        input.fill(&mut stream(1, 2, Purpose::FreshInput), response.input());
        let plant = System {
            a: &[a],
            b: &[b],
            d: 0.0,
        };
        response.set_impulse_response(plant, &mut [0.0]);
        response.set_fresh_output(plant, &mut [0.0]);
        response
    }

    fn errors(response: &Response, a: &[f64], b: &[f64]) -> [f64; 2] {
        let (model, x) = (System { a, b, d: 0.0 }, &mut vec![f64::NAN; a.len()]);
        let error = response.impulse_response_error(model, x);
        [error, response.fresh_fit(model, x)]
    }

    /// g(k) = 0.5^(k-1) against 0.25^(k-1): sums of 0.25^k, 0.125^k and 0.0625^k.
    #[test]
    fn a_first_order_impulse_response_by_hand() {
        let [error, _] = errors(&response(0.5, 1.0, 60), &[0.25], &[1.0]);
        let size: f64 = 1.0 / (1.0 - 0.25);
        let expected = ((size - 2.0 / (1.0 - 0.125) + 1.0 / (1.0 - 0.0625)) / size).sqrt();
        assert!((error - expected).abs() < 1e-14, "{error} {expected}");
    }

    /// A model of higher order whose extra pole and zero cancel equals the plant.
    #[test]
    fn cancelling_poles_and_zeros_do_not_count() {
        // (z - 0.3) / ((z - 0.5)(z - 0.3)): a = (-0.15, 0.8), h = (1, -0.3), b = (1, 0.5).
        let response = response(0.5, 1.0, 100);
        let [error, fit] = errors(&response, &[-0.15, 0.8], &[1.0, 0.5]);
        assert!(error < 1e-15 && (fit - 100.0).abs() < 1e-12);
        // A model with zero output explains next to nothing.
        let [error, fit] = errors(&response, &[0.0], &[0.0]);
        assert_eq!(error, 1.0);
        assert!(fit <= 1e-12 && fit > -10.0);
    }

    /// A direct term g(0) = 3 adds 9 to the squared error, relative to `sum 0.25^k`.
    #[test]
    fn a_direct_term_counts() {
        let response = response(0.5, 1.0, 60);
        let model = System {
            a: &[0.5],
            b: &[1.0],
            d: 3.0,
        };
        let error = response.impulse_response_error(model, &mut [0.0]);
        assert!((error - (9.0_f64 * 0.75).sqrt()).abs() < 1e-14, "{error}");
        // 3 u with |u| = 2 adds 6 to the output in every sample.
        let fit = response.fresh_fit(model, &mut [0.0]);
        let expected = 100.0 * (1.0 - 6.0 * (60.0 / response.spread).sqrt());
        assert!((fit - expected).abs() < 1e-10, "{fit} {expected}");
    }

    #[test]
    fn what_is_not_finite_is_stated() {
        let system = response(0.5, 1.0, 20_000);
        let unstable = errors(&system, &[-3.0], &[1.0]);
        assert_eq!(unstable, [f64::INFINITY, f64::NEG_INFINITY]);
        for broken in [f64::NAN, f64::INFINITY] {
            assert!(errors(&system, &[broken], &[1.0]).iter().all(|x| x.is_nan()));
            assert!(errors(&system, &[0.5], &[broken]).iter().all(|x| x.is_nan()));
        }
        let silent = response(0.5, 0.0, 100);
        assert!(errors(&silent, &[-3.0], &[1.0]).iter().all(|x| x.is_nan()));
    }
}
