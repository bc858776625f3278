//! Compares models with the plant in lock step: by impulse response, and by their output under a fresh input.

use super::passes::PassPack;
use super::record::{RecordSource, Streams};
use super::{order, splat};
use asobench_identification::metric::{Response, System};
use asobench_identification::real::{MOST_LANES, Real};
use asobench_identification::signal::Purpose;

/// The plant's responses in every lane.
pub struct Responses<R, const N: usize> {
    n: usize,
    /// The true plant.
    a: [R; N],
    b: [R; N],
    response: Response<R>,
}

impl<R: Real, const N: usize> Responses<R, N> {
    /// Makes the plant's impulse response over `samples` samples.
    pub fn new(source: &RecordSource<'_>, samples: usize) -> Self {
        let plant = source.plant;
        let mut this = Self {
            n: plant.order(),
            a: splat(plant.a()),
            b: splat(plant.b()),
            response: Response::new(samples),
        };
        R::run(
            #[inline(always)]
            || {
                let (n, mut x) = (order::<N>(this.n), [R::zero(); N]);
                let plant = system(&this.a, &this.b, n);
                this.response.set_impulse_response(plant, &mut x[..n]);
            },
        );
        this
    }

    /// Draws a trial's fresh input in each lane and simulates the plant under it.
    pub fn draw(&mut self, source: &RecordSource<'_>, trials: &[u64; MOST_LANES]) {
        let fresh = Streams::<R>::new(source.seed, trials, Purpose::FreshInput);
        fresh.fill(&source.settings.input, self.response.input());
        R::run(
            #[inline(always)]
            || {
                let (n, mut x) = (order::<N>(self.n), [R::zero(); N]);
                let plant = system(&self.a, &self.b, n);
                self.response.set_fresh_output(plant, &mut x[..n]);
            },
        );
    }

    /// Returns [`Response::impulse_response_error`] of a pass; NaN if it has no parameters.
    pub fn impulse_response_error(&self, pass: &PassPack<R, N>) -> R {
        R::run(
            #[inline(always)]
            || {
                let (n, mut x) = (order::<N>(self.n), [R::zero(); N]);
                let model = system(&pass.a, &pass.b, n);
                let error = self.response.impulse_response_error(model, &mut x[..n]);
                R::select(pass.parameters, error, R::splat(f64::NAN))
            },
        )
    }

    /// Returns [`Response::fresh_fit`] of a pass; NaN if it has no parameters.
    pub fn fresh_fit(&self, pass: &PassPack<R, N>) -> R {
        R::run(
            #[inline(always)]
            || {
                let (n, mut x) = (order::<N>(self.n), [R::zero(); N]);
                let model = system(&pass.a, &pass.b, n);
                let fit = self.response.fresh_fit(model, &mut x[..n]);
                R::select(pass.parameters, fit, R::splat(f64::NAN))
            },
        )
    }
}

/// Makes a system from the first n coefficients.
#[inline(always)]
fn system<'a, R: Real, const N: usize>(a: &'a [R; N], b: &'a [R; N], n: usize) -> System<'a, R> {
    System {
        a: &a[..n],
        b: &b[..n],
        d: R::splat(0.0),
    }
}
