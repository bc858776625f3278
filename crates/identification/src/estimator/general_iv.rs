//! The paper's instrumental variables for any orders na, nb and delay nk: least squares, then IV passes. The
//! instruments are the output of the previous pass's model, or of one fixed model.

use super::auxiliary::AuxiliaryModel;
use super::covariance::{Covariance, freedom};
use super::fixed_model::FixedModel;
use super::initial_state_choice::{StartState, StateEstimate};
use super::instruments::{InstrumentalRegression, Instruments, Signals};
use super::other_tools::{R_SYSID_RIDGE, Reading};
use super::regression::{Regression, Rows};
use super::{Drive, Estimator, FailureKind, Pass, Progress, Runs, SetupError, Stage, Window};
use crate::failure::all_finite;
use crate::model::{LinearModel, Orders};
use crate::observer::Gain;

/// The options of the general form.
pub(super) struct GeneralOptions {
    pub(super) orders: Orders,
    pub(super) rows: Rows,
    pub(super) reading: Option<Reading>,
    pub(super) fixed_model: Option<FixedModel>,
    pub(super) initial_state: StartState,
    pub(super) covariance: Covariance,
}

/// Pass 0 is least squares. Pass i is `theta = (Z'Phi)^-1 Z'y`, with Z equal to Phi except for x instead of y. x is the
/// output of the model of pass i-1: from its x0 if only complete rows are used, from rest if zeros precede the record.
pub struct GeneralIv {
    regression: Regression,
    instruments: InstrumentalRegression,
    fixed: Option<FixedModel>,
    auxiliary: AuxiliaryModel,
    covariance: Covariance,
    from_rest: bool,
    runs: Runs,
    rest: Vec<f64>,
    model: LinearModel,
    state: StateEstimate,
}

impl GeneralIv {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`].
    pub(super) fn new(options: GeneralOptions, runs: Runs) -> Result<Self, SetupError> {
        let GeneralOptions { orders, .. } = options;
        let window = runs.samples();
        let (rows, ridge) = match options.reading {
            Some(Reading::RSysid) => (Rows::Padded, R_SYSID_RIDGE),
            None => (options.rows, 0.0),
        };
        let n = orders.order();
        Ok(Self {
            regression: Regression::with_ridge(orders, rows, ridge, window)?.of_runs(&runs)?,
            instruments: InstrumentalRegression::new(orders, Instruments::Signal, rows, window)?.of_runs(&runs)?,
            fixed: options.fixed_model,
            auxiliary: AuxiliaryModel::new(n, window, Drive::Model, Gain::DeadBeat),
            covariance: options.covariance,
            from_rest: rows != Rows::Complete,
            runs,
            rest: vec![0.0; n],
            model: LinearModel::zero(orders),
            state: StateEstimate::new(n, options.initial_state),
        })
    }

    /// Computes the instruments of the past outputs.
    fn simulate(&mut self, window: Window<'_>, previous: &Pass) -> Result<(), FailureKind> {
        if let Some(model) = &self.fixed {
            for run in &self.runs {
                let yhat = &mut self.auxiliary.yhat[run.clone()];
                model.run(&window.u[run.clone()], yhat);
            }
            return all_finite(&self.auxiliary.yhat);
        }
        for (i, run) in self.runs.iter().enumerate() {
            let part = window.part(run.clone());
            let x0 = if self.from_rest {
                &self.rest
            } else if i == 0 {
                &previous.x0
            } else {
                self.state.of(part, previous)?
            };
            let Pass { a, b, .. } = previous;
            self.auxiliary.run_driven(a, b, x0, part, part.u, run.start)?;
        }
        let x = self.auxiliary.yhat.iter_mut().zip(window.u);
        x.for_each(|(x, u)| *x += previous.direct * u);
        Ok(())
    }

    /// Computes the model of a pass; on failure returns its kind and stage.
    fn find(
        &mut self,
        window: Window<'_>,
        previous: Option<&Pass>,
        pass: &mut Pass,
    ) -> Result<(), (FailureKind, Stage)> {
        let at = |stage: Stage| move |kind: FailureKind| (kind, stage);
        let Window { u, y, .. } = window;
        self.model.noise_variance = f64::NAN;
        self.model.covariance.clear();
        let (stage, condition) = match previous {
            None => {
                let solved = self.regression.solve(u, y);
                let condition = solved.map_err(at(Stage::LeastSquares))?;
                let theta = self.regression.theta();
                self.model.set_parameters(theta);
                if let Some(freedom) = freedom(self.regression.rows(), theta.len()) {
                    let variance = self.regression.residual_sum() / freedom;
                    self.model.noise_variance = variance;
                    let covariance = &mut self.model.covariance;
                    self.regression.covariance(self.covariance, variance, covariance);
                }
                (Stage::LeastSquares, condition)
            }
            Some(previous) => {
                let simulated = self.simulate(window, previous);
                simulated.map_err(at(Stage::AuxiliaryModel))?;
                let x = &self.auxiliary.yhat;
                let solved = self.instruments.solve(Signals::new(u, y, x));
                let condition = solved.map_err(at(Stage::Instruments))?;
                let theta = self.instruments.theta();
                self.model.set_parameters(theta);
                if let Some(freedom) = freedom(self.instruments.rows(), theta.len()) {
                    let variance = self.instruments.residual_sum() / freedom;
                    self.model.noise_variance = variance;
                    let covariance = &mut self.model.covariance;
                    self.instruments.covariance(self.covariance, variance, covariance);
                }
                (Stage::Instruments, condition)
            }
        };
        pass.set_model(&self.model, condition).map_err(at(stage))
    }
}

impl Estimator for GeneralIv {
    fn estimate(&mut self, window: Window<'_>, passes: &mut [Pass]) {
        for number in 0..passes.len() {
            let (done, rest) = passes.split_at_mut(number);
            let (previous, pass) = (done.last(), &mut rest[0]);
            pass.clear();
            if let Some(previous) = previous
                && previous.progress != Progress::InitialState
            {
                // Nothing to start from: the failure is passed on.
                pass.failure = previous.failure;
                continue;
            }
            match self.find(window, previous, pass) {
                Ok(()) => {
                    let first = window.part(self.runs.first(pass.a.len()));
                    self.state.estimate(first, number, pass);
                }
                Err((kind, stage)) => pass.fail_at(stage, number, kind),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{IvOptions, MethodKind, Shape};
    use crate::signal::{Purpose, stream};
    use rand::Rng as _;

    /// For na = nb = n and nk = 1 every pass equals the paper's, which other code computes with other arithmetic.
    #[test]
    fn the_papers_form_is_a_special_case() {
        let n = 300;
        let mut random = stream(29, 1, Purpose::Input);
        let mut uniform = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
        let u: Vec<f64> = (0..n).map(|_| uniform().signum()).collect();
        let mut y = vec![0.0; n];
        let model = FixedModel::new(vec![0.0, 1.0, 0.5], vec![1.0, -1.5, 0.7]).unwrap();
        model.run(&u, &mut y);
        for y in &mut y {
            *y += 0.3 * uniform();
        }
        let passes = |orders| {
            let options = IvOptions {
                orders,
                ..IvOptions::default()
            };
            let shape = Shape { order: 2, window: n };
            let mut passes: Vec<Pass> = (0..5).map(|_| Pass::new(2)).collect();
            let mut estimator = options.prepare(&shape.into()).unwrap();
            estimator.estimate(Window::new(&u, &y, n), &mut passes);
            passes
        };
        let (paper, general) = (passes(None), passes(Some(Orders::arx(2, 2, 1))));
        for (paper, general) in paper.iter().zip(&general) {
            assert!(paper.failure.is_none() && general.failure.is_none());
            for (p, g) in [(&paper.a, &general.a), (&paper.b, &general.b), (&paper.x0, &general.x0)] {
                assert!(p.iter().zip(g).all(|(p, g)| (p - g).abs() < 1e-11), "{p:?} {g:?}");
            }
        }
        assert!((paper[1].a[0] - paper[4].a[0]).abs() > 1e-6);
    }
}
