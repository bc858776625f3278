//! Young's refined instrumental variables for the structure of Box and Jenkins, `y = B/F u + C/D e`.
//!
//! Source: P. C. Young, *Recursive Estimation and Time-Series Analysis*, 2nd ed., 2011, chapter 7.

use super::output_error_iteration::OutputErrorIteration;
use super::prediction_error::BjOptions;
use crate::estimator::fixed_point::{Damping, MOST_PASSES, replace, unfinished};
use crate::estimator::instruments::{InstrumentalRegression, Instruments, Signals};
use crate::estimator::loop_input::LoopInput;
use crate::estimator::method_kind::{MethodKind, Problem, options};
use crate::estimator::noise_fit::{NoiseFit, REST, put_block};
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::{Stabilise, stay_stable};
use crate::estimator::regression::Rows;
use crate::estimator::{Estimator, FailureKind, Iteration, SetupError, Window, enough_equations};
use crate::model::polynomial::{divide, divide_each, filter};
use crate::model::{LinearModel, Orders};

options! {
    /// The options of `riv`.
    pub struct RivOptions {
        /// Orders nb, nc, nd, nf and the delay nk, such as nb=2,nc=1,nd=1,nf=2,nk=1; by default nb = nc = nd = nf = the
        /// setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The treatment of an unstable F: reflect (its zeros into the unit circle, the default), none (the method
        /// fails).
        pub stabilise: Option<Stabilise>,
    }
}

impl RivOptions {
    pub(super) fn as_bj(&self) -> BjOptions {
        BjOptions {
            orders: self.orders,
            ..BjOptions::default()
        }
    }
}

impl MethodKind for RivOptions {
    fn check(&self) -> Result<(), OptionError> {
        self.as_bj().check()
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        self.as_bj().model_orders(setting)
    }

    fn begins_at_rest(&self) -> bool {
        true
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let orders = self.as_bj().orders(problem.shape.order);
        let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
        let method = RefinedIv::new(orders, problem.shape.window, stabilise)?;
        Ok(Box::new(method))
    }
}

/// Starts from B/F of `sriv` and alternates two steps until both converge:
///
/// - C and D by prediction errors of the ARMA model `D w = C e` of `w = y - B/F u`;
/// - F and B by instrumental variables of `D/(C F) y` and `D/(C F) u`, with `D/(C F) B/F u` instead of the output in
///   the instruments.
///
/// All signals are zero before the record. Where it converges, the gradient of `bj` is zero. The covariance is
/// `s^2 (Z'Z)^-1` for B and F and that of the ARMA model for C and D, without cross terms.
pub struct RefinedIv {
    orders: Orders,
    start: OutputErrorIteration,
    instruments: InstrumentalRegression,
    noise: NoiseFit,
    stabilise: Stabilise,
    model: LinearModel,
    /// The stable model with the lowest sum of squared prediction errors, and that sum.
    best: LinearModel,
    least: f64,
    /// (f, b).
    theta: Vec<f64>,
    /// In a closed loop the instruments have its input without noise instead of u; v is that, filtered.
    source: Option<LoopInput>,
    v: Vec<f64>,
    u: Vec<f64>,
    y: Vec<f64>,
    x: Vec<f64>,
    w: Vec<f64>,
    block: Vec<f64>,
    scratch: Vec<f64>,
}

impl RefinedIv {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub fn new(orders: Orders, window: usize, stabilise: Stabilise) -> Result<Self, SetupError> {
        let Orders { nb, nf, nk, .. } = orders;
        enough_equations(orders, window, window, orders.parameters() + 1)?;
        let linear = Orders::arx(nf, nb, nk);
        let output_error = Orders::output_error(nb, nf, nk);
        let signal = || vec![0.0; window];
        Ok(Self {
            orders,
            start: OutputErrorIteration::new(output_error, window, true, stabilise)?,
            instruments: InstrumentalRegression::new(linear, Instruments::Signal, Rows::Prewindow, window)?,
            noise: NoiseFit::new(orders, window),
            stabilise,
            model: LinearModel::zero(orders),
            best: LinearModel::zero(orders),
            least: f64::INFINITY,
            theta: vec![0.0; nf + nb],
            source: None,
            v: Vec::new(),
            u: signal(),
            y: signal(),
            x: signal(),
            w: signal(),
            block: Vec::new(),
            scratch: Vec::new(),
        })
    }

    /// Forms the instruments from a closed loop's input without noise.
    pub(super) fn with_source(mut self, source: LoopInput) -> Self {
        self.v.clone_from(&source.hat);
        self.source = Some(source);
        self
    }

    /// Computes `w = y - B/F u`.
    fn noise_of(&mut self, u: &[f64], y: &[f64]) {
        self.model.simulate(u, &mut self.x);
        for ((w, y), x) in self.w.iter_mut().zip(y).zip(&self.x) {
            *w = y - x;
        }
    }

    /// Changes F and B by a share of the way to those of the instruments, given C and D; returns the way's relative
    /// length, and the condition.
    fn refine(&mut self, u: &[f64], y: &[f64], share: f64) -> Result<[f64; 2], FailureKind> {
        for (to, from) in [(&mut self.u, u), (&mut self.y, y)] {
            filter(&self.model.d, from, to);
        }
        divide_each(&self.model.c, [&mut self.u, &mut self.y]);
        divide_each(&self.model.f, [&mut self.u, &mut self.y]);
        let v = self.source.as_ref().map(|source| {
            filter(&self.model.d, &source.hat, &mut self.v);
            divide(&self.model.c, &mut self.v);
            divide(&self.model.f, &mut self.v);
            self.v.as_slice()
        });
        self.model.simulate(v.unwrap_or(&self.u), &mut self.x);
        let (u, y, x) = (&self.u, &self.y, &self.x);
        let condition = self.instruments.solve(Signals { u, y, x, v })?;
        let new = self.instruments.theta();
        let [way, size] = replace(&mut self.theta, new, share, |_| 1.0);
        self.model.set_plant(&self.theta);
        Ok([way / size.max(f64::MIN_POSITIVE), condition])
    }

    fn iterate(&mut self, window: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        let Window { u, y, .. } = window;
        let mut damping = Damping::none();
        let mut unfinished = None;
        while *passes < MOST_PASSES {
            *passes += 1;
            stay_stable(&mut self.model.f, self.stabilise, &mut self.scratch)?;
            self.theta[..self.orders.nf].copy_from_slice(&self.model.f[1..]);
            self.noise_of(u, y);
            let fitted = self.noise.fit(&self.w, &mut self.model, &mut unfinished);
            let [of_noise, sum] = fitted?;
            if sum < self.least {
                self.least = sum;
                self.best.assign(&self.model);
            }
            if let Some(source) = &mut self.source {
                source.close(&self.model, window);
            }
            let [of_plant, condition] = self.refine(u, y, damping.share)?;
            // Both have converged if the plant has, because the noise model follows from it.
            if of_plant <= REST && of_noise <= REST.sqrt() {
                return LoopInput::end(self.source.as_ref(), unfinished).map(|()| condition);
            }
            if damping.goes_around(*passes, of_plant) {
                self.best.write_plant(&mut self.theta);
                self.model.set_plant(&self.theta);
            }
        }
        Err(unfinished.unwrap_or(FailureKind::IterationLimit))
    }
}

impl Iteration for RefinedIv {
    fn find(&mut self, window: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        *passes = 0;
        self.least = f64::INFINITY;
        let Window { u, y, r } = window;
        let found = match &mut self.source {
            Some(source) => {
                source.follow(u, r)?;
                let input = Window::new(&source.hat, y, y.len());
                self.start.find(input, &mut 0)
            }
            None => self.start.find(window, &mut 0),
        };
        if let Err(kind) = found
            && !kind.leaves_a_model()
        {
            return Err(kind);
        }
        self.start.model().write_plant(&mut self.theta);
        self.model.set_plant(&self.theta);
        self.noise.reset();
        self.iterate(window, passes).map_err(|kind| {
            unfinished(kind, self.least).map_or(kind, |unfinished| {
                self.model.assign(&self.best);
                unfinished
            })
        })
    }

    fn conclude(&mut self, window: Window<'_>, at_rest: bool) -> Result<f64, FailureKind> {
        let Window { u, y, .. } = window;
        self.noise_of(u, y);
        let Orders { nb, nc, nd, nf, .. } = self.orders;
        let total = self.orders.parameters();
        filter(&self.model.d, &self.w, &mut self.x);
        divide(&self.model.c, &mut self.x);
        let sum: f64 = self.x.iter().map(|e| e * e).sum();
        let variance = sum / (y.len() - total) as f64;
        self.model.noise_variance = variance;
        self.model.covariance.clear();
        if !at_rest {
            return Ok(sum);
        }
        let mut covariance = std::mem::take(&mut self.model.covariance);
        covariance.resize(total * total, 0.0);
        // Maps the positions of f, b, d, c to the order B, C, D, F.
        let place = |i: usize| if i < nf { nb + nc + nd + i } else { i - nf };
        self.instruments.covariance_of_instruments(variance, &mut self.block);
        put_block(&self.block, nf + nb, place, total, &mut covariance);
        let put = self
            .noise
            .put_covariance(&self.w, variance, self.orders, &mut covariance);
        put?;
        self.model.covariance = covariance;
        Ok(sum)
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::Pass;
    use crate::estimator::prediction_error::{InitialCondition, PredictionError};
    use crate::model::polynomial::{divide, filter};
    use crate::signal::{Input, InputLaw, Purpose, Sequence, stream};

    /// At convergence the gradient of the sum of squared prediction errors is zero; `bj`, which descends to it, ends
    /// there too.
    #[test]
    fn it_rests_at_the_minimum_of_box_jenkins() {
        for (trial, orders) in [
            "nb=2,nf=2,nc=1,nd=1",
            "nb=1,nf=2,nd=2,nk=2",
            "nb=2,nf=1,nc=2",
            "nb=2,nf=2",
        ]
        .into_iter()
        .enumerate()
        {
            let orders: Orders = orders.parse().unwrap();
            let n = 600;
            let mut truth = LinearModel::zero(orders);
            let places = [
                (&mut truth.b[orders.nk..], [1.0, 0.5]),
                (&mut truth.f[1..], [-0.8, 0.4]),
                (&mut truth.c[1..], [0.5, 0.3]),
                (&mut truth.d[1..], [-0.6, 0.2]),
            ];
            for (place, values) in places {
                place.copy_from_slice(&values[..place.len()]);
            }
            let normal = |purpose| {
                let mut signal = vec![0.0; n];
                let input = Input::new(InputLaw::Gaussian, 1.0, Sequence::Independent);
                input.fill(&mut stream(31, trial as u64, purpose), &mut signal);
                signal
            };
            let (u, e) = (normal(Purpose::Input), normal(Purpose::Plant));
            let (mut y, mut v) = (vec![0.0; n], vec![0.0; n]);
            truth.simulate(&u, &mut y);
            filter(&truth.c, &e, &mut v);
            divide(&truth.d, &mut v);
            y.iter_mut().zip(&v).for_each(|(y, v)| *y += 0.4 * v);
            let estimate = |estimator: &mut dyn Estimator| {
                let mut passes = [Pass::new(2)];
                estimator.estimate(Window::new(&u, &y, n), &mut passes);
                let [pass] = passes;
                assert_eq!(pass.failure, None, "{orders}");
                pass
            };
            let riv = estimate(&mut RefinedIv::new(orders, n, Stabilise::Reflect).unwrap());
            let bj = estimate(&mut PredictionError::new(orders, 4, InitialCondition::Zero, n).unwrap());
            for (riv, bj) in riv.model.parameters().zip(bj.model.parameters()) {
                assert!((riv - bj).abs() < 1e-8, "{orders}: {riv} {bj}");
            }
            assert!((riv.loss / bj.loss - 1.0).abs() < 1e-12);
            // Cross terms between B, F and C, D vanish as N grows, so the standard errors with them are nearly the
            // same.
            let errors = [&riv, &bj].map(|pass| pass.model.standard_errors().unwrap());
            for (riv, bj) in errors[0].iter().zip(&errors[1]) {
                assert!((riv / bj - 1.0).abs() < 0.05, "{orders}: {riv} {bj}");
            }
        }
    }
}
