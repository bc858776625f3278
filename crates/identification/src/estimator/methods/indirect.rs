//! The plant in a closed loop with a known controller, from a model of the whole loop.
//!
//! Source: T. Soderstrom, P. Stoica and B. Friedlander, *An indirect prediction error method for system
//! identification*, Automatica 27 (1991).

use super::output_error_iteration::{output_error, output_errors};
use super::riv::{RefinedIv, RivOptions};
use crate::data::OutputFeedback;
use crate::estimator::instruments::TwoStages;
use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::reflection::Stabilise;
use crate::estimator::{Estimator, FailureKind, Iteration, SetupError, Window};
use crate::failure::all_finite;
use crate::model::{LinearModel, Orders};
use faer::MatMut;

options! {
    /// The options of `indirect`.
    pub struct IndirectOptions {
        /// Orders nb, nf and the delay nk of the plant, nc and nd of the noise in the loop, such as nb=2,nf=2,nk=1; by
        /// default nb = nf = the setting `order`, nk = 1, nc = nd = 0.
        pub orders: Option<Orders>,
        /// The controller K of the loop u = r - K(q) y: a gain, or c_0,c_1,.../1,d_1,...; by default 0, open loop.
        pub controller: Option<OutputFeedback>,
        /// The treatment of an unstable model of the loop: reflect (its poles into the unit circle, the default),
        /// none (the method fails).
        pub stabilise: Option<Stabilise>,
    }
}

impl IndirectOptions {
    fn orders(&self, setting: usize) -> Orders {
        output_error(self.orders, setting)
    }

    /// Returns the controller's numerator and denominator.
    fn controller(&self) -> [Vec<f64>; 2] {
        self.controller
            .as_ref()
            .map_or([vec![0.0], vec![1.0]], |of| [of.numerator().to_vec(), of.denominator()])
    }
}

impl MethodKind for IndirectOptions {
    fn check(&self) -> Result<(), OptionError> {
        RivOptions {
            orders: self.orders,
            stabilise: None,
        }
        .check()?;
        let [n, _] = self.controller();
        match self.orders {
            Some(Orders { nk: 0, .. }) if n[0] != 0.0 => {
                let message = "acts at once, as the plant does with nk = 0; expected c_0 = 0, or nk of at least 1";
                Err(OptionError::new("controller", message))
            }
            _ => Ok(()),
        }
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        let Orders { nb, nf, nk, .. } = self.orders(setting);
        Some(Orders::output_error(nb, nf, nk))
    }

    fn default_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders(setting))
    }

    fn needs(&self) -> Needs {
        Needs {
            reference: Some(("estimator", "indirect")),
            controller: true,
            ..Needs::default()
        }
    }

    fn begins_at_rest(&self) -> bool {
        true
    }

    fn option_units(&self) -> OptionUnits {
        OptionUnits::Gain.only_if(self.controller.is_some())
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let window = problem.shape.window;
        let Orders { nb, nc, nd, nf, nk, .. } = self.orders(problem.shape.order);
        let [n, m] = self.controller();
        let whole = Orders {
            na: 0,
            nb: nb + m.len() - 1,
            nf: (nf + m.len() - 1).max(nk + nb + n.len() - 2),
            nc,
            nd,
            nk,
        };
        let plant = Orders::output_error(nb, nf, nk);
        let stabilise = self.stabilise.unwrap_or(Stabilise::Reflect);
        let rows = whole.nb + whole.nf;
        Ok(Box::new(Indirect {
            whole: RefinedIv::new(whole, window, stabilise)?,
            map: map(plant, whole, &n, &m),
            stages: TwoStages::new(nb + nf, nb + nf, rows),
            model: LinearModel::zero(plant),
            denominator: m,
        }))
    }
}

/// Returns the matrix from (b, f) to the coefficients (b', f') of the loop, row by row: `B' = B M`,
/// `F' = F M + B N`.
fn map(plant: Orders, whole: Orders, n: &[f64], m: &[f64]) -> Vec<f64> {
    let Orders { nb, nf, nk, .. } = plant;
    let at = |c: &[f64], i: usize, lag: usize| i.checked_sub(lag).and_then(|i| c.get(i).copied());
    let mut rows = Vec::new();
    for i in nk..nk + whole.nb {
        rows.extend((0..nb).map(|j| at(m, i, nk + j).unwrap_or(0.0)));
        rows.extend((0..nf).map(|_| 0.0));
    }
    for i in 1..=whole.nf {
        rows.extend((0..nb).map(|j| at(n, i, nk + j).unwrap_or(0.0)));
        rows.extend((1..=nf).map(|j| at(m, i, j).unwrap_or(0.0)));
    }
    rows
}

/// (1) The model `y = B'/F' r + C/D e` of the loop, at rest of `riv`; (2) B and F from its linear equations
/// `B' = B M`, `F' = F M + B N`, `K = N/M`, weighted with the inverse covariance of B' and F'. The covariance is
/// `(X' W X)^-1`, X being the matrix of these equations; it is right where C/D holds the colour of the loop's noise.
pub struct Indirect {
    whole: RefinedIv,
    map: Vec<f64>,
    stages: TwoStages,
    model: LinearModel,
    /// M.
    denominator: Vec<f64>,
}

impl Indirect {
    /// Returns the Cholesky factor of the covariance of the loop's (b', f'), row by row.
    fn factor(&self) -> Result<Vec<f64>, FailureKind> {
        let whole = self.whole.model();
        let (orders, total) = (whole.orders(), whole.orders().parameters());
        let noise = orders.nc + orders.nd;
        let place = |i: usize| if i < orders.nb { i } else { i + noise };
        let n = orders.nb + orders.nf;
        let mut l = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
                let rest = whole.covariance[place(i) * total + place(j)] - sum;
                l[i * n + j] = if i == j { rest.sqrt() } else { rest / l[j * n + j] };
            }
            // A NaN is no pivot either.
            if !(l[i * n + i] > 0.0) {
                return Err(FailureKind::RankDeficient);
            }
        }
        Ok(l)
    }
}

impl Iteration for Indirect {
    fn find(&mut self, Window { y, r, .. }: Window<'_>, passes: &mut usize) -> Result<f64, FailureKind> {
        let looped = Window::new(r, y, y.len());
        let found = self.whole.find(looped, passes);
        found.map_err(|kind| match kind {
            // Its best model has no covariance to weigh with.
            kind if kind.leaves_a_model() => FailureKind::NoConvergence,
            kind => kind,
        })?;
        self.whole.conclude(looped, true)?;
        let factor = self.factor()?;
        let (whole, width) = (self.whole.model(), self.stages.theta.len());
        let (orders, m) = (whole.orders(), &self.denominator);
        let given = whole.b[orders.nk..].iter().copied();
        let of_m = |i: usize| m.get(i).copied().unwrap_or(0.0);
        let given = given.chain((1..=orders.nf).map(|i| whole.f[i] - of_m(i)));
        // The equations: X beside what is to be met, row by row, then whitened.
        let rows = self.map.chunks_exact(width).zip(given);
        let mut right: Vec<f64> = rows
            .flat_map(|(row, value)| row.iter().copied().chain([value]))
            .collect();
        // Solve L x = right, column by column.
        let n = orders.nb + orders.nf;
        for column in 0..=width {
            for i in 0..n {
                let product = |k: usize| factor[i * n + k] * right[k * (width + 1) + column];
                let sum: f64 = (0..i).map(product).sum();
                let at = i * (width + 1) + column;
                right[at] = (right[at] - sum) / factor[i * n + i];
            }
        }
        let fill = |first: usize, mut z: MatMut<'_, f64>, mut to: MatMut<'_, f64>| {
            for row in 0..z.nrows() {
                let from = &right[(first + row) * (width + 1)..][..=width];
                for (column, value) in from.iter().enumerate() {
                    to[(row, column)] = *value;
                    if column < width {
                        z[(row, column)] = *value;
                    }
                }
            }
        };
        self.stages.solve(n, fill)
    }

    fn conclude(&mut self, Window { u, y, .. }: Window<'_>, _: bool) -> Result<f64, FailureKind> {
        self.model.set_parameters(&self.stages.theta);
        let scratch = [&mut vec![0.0; u.len()][..], &mut vec![0.0; u.len()]];
        let sum = output_errors(&mut self.model, u, y, scratch);
        self.stages.covariance_of_instruments(1.0, &mut self.model.covariance);
        // The estimate is of r and y; u enters here alone.
        all_finite(&[sum])?;
        Ok(sum)
    }

    fn model(&self) -> &LinearModel {
        &self.model
    }
}
