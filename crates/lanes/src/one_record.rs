//! The stages of a pack behind [`Estimator`], for one record at a time: every lane gets the same record.

use super::passes::Passes;
use super::{Call, Isa, LARGEST_ORDER, lane};
use asobench_identification::estimator::{Estimator, IvOptions, Pass, SetupError, Shape, Window};
use asobench_identification::real::{MOST_LANES, Mask, Real};

impl Isa {
    /// Returns an estimator for given records, meant for tests and not for speed. It supports the readings of the
    /// options that lanes have, and `iterations`; 0 is least squares.
    ///
    /// # Errors
    /// As for every estimator, if the shape is not valid.
    ///
    /// # Panics
    /// If this machine does not have the instructions, or the order is above [`LARGEST_ORDER`].
    pub fn estimator(self, shape: Shape, options: &IvOptions) -> Result<Box<dyn Estimator>, SetupError> {
        shape.check()?;
        assert!(shape.order <= LARGEST_ORDER);
        Ok(self.dispatch(shape.order, Make { shape, options }))
    }
}

struct Make<'a> {
    shape: Shape,
    options: &'a IvOptions,
}

impl Call for Make<'_> {
    type Output = Box<dyn Estimator>;

    fn with<R: Real, const N: usize>(self) -> Self::Output {
        let Self { shape, options } = self;
        let passes = options.iterations + 1;
        Box::new(Single::<R, N> {
            passes: Passes::new(shape.order, options, passes, shape.window, true),
            u: vec![R::zero(); shape.window],
            y: vec![R::zero(); shape.window],
        })
    }
}

struct Single<R: Real, const N: usize> {
    passes: Passes<R, N>,
    u: Vec<R>,
    y: Vec<R>,
}

impl<R: Real, const N: usize> Estimator for Single<R, N> {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        for (to, from) in [(&mut self.u, window.u), (&mut self.y, window.y)] {
            assert_eq!(to.len(), from.len());
            for (to, from) in to.iter_mut().zip(from) {
                *to = R::load(&[*from; MOST_LANES]);
            }
        }
        self.passes.estimate(&self.u, &self.y, R::Mask::from_bits(1));
        for (to, from) in passes.iter_mut().zip(&self.passes.done) {
            let n = to.a.len();
            if from.parameters.lane(0) {
                let a: [f64; N] = lane(&from.a, 0);
                let h: [f64; N] = lane(&from.h, 0);
                let alpha = a[..n].iter().rev().map(|a| -a);
                let p: Vec<f64> = alpha.chain(h[..n].iter().copied()).collect();
                // Numbers that a lane calls finite are finite here too.
                let _ = to.set_parameters(&p, from.condition.lane(0));
                // In the reading `literal`, b does not follow from p.
                let b: [f64; N] = lane(&from.b, 0);
                to.b.copy_from_slice(&b[..n]);
            }
            if from.state.lane(0) {
                let x0: [f64; N] = lane(&from.x0, 0);
                to.set_initial_state(&x0[..n]);
            }
            if let Some(failure) = from.failures[0] {
                to.fail(failure);
            }
        }
    }
}
