//! PARSIM-K: a subspace method in the predictor form that estimates each Markov parameter once, also in feedback.
//!
//! Source: G. Pannocchia, M. Calosi, "A predictor form PARSIMonious algorithm for closed-loop subspace identification",
//! J. Process Control 20 (2010), 517-524.

use super::state_sequence::{innovations, innovations_options, model_orders};
use super::subspace::{block_rows, columns, left_singular_vectors, longest_rows};
use crate::estimator::chosen::{Chosen, OrderRule};
use crate::estimator::excitation::excited_rows;
use crate::estimator::hankel::{Delays, Hankel};
use crate::estimator::method_kind::{MethodKind, Problem};
use crate::estimator::null_space::HighOrder;
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::kernels::{Triangle, copy_delayed, divide_each};
use crate::estimator::reflection::{Stabilise, reflect_zeros, stable};
use crate::estimator::solver::rank::{check_rank_of_columns, condition_of_triangle};
use crate::estimator::{Estimator, FailureKind, InitialCondition, Pass, SetupError, SinglePass, Window};
use crate::model::{LinearModel, Orders};
use faer::Mat;
use faer::linalg::solvers::SolveLstsq;

innovations_options!(
    ParsimKOptions,
    "The options of `parsim-k`.",
    {},
    check: |_| Ok(()),
    prepare: |of, orders, problem| {
        let (n, rows, window) = (orders.na, of.block_rows, problem.shape.window);
        block_rows(rows, n, window)?;
        Ok(Box::new(ParsimK {
            orders,
            rows,
            ending: (of.stabilise, of.initial),
            is_start: problem.is_start,
            high: HighOrder::new(true, 1, None, window),
        }))
    }
);

/// With z the last s outputs and inputs, `y(t+i) = G_i z(t) + sum_(j <= i) (h_j u + g_j y)(t+i-j) + e(t+i)`, g_0 = 0.
/// Least squares of row i gives G_i, h_i and g_i, with those of the rows before. The left singular vectors of `G W`, W
/// W' the covariance of z without future inputs, span the observability matrix of `A - K C`, and so
/// `C(q) = det(I - (A - K C) q^-1)`. Given C, `y = (C - A)/C y + B/C u + P/C delta + e` is linear in A, B and in P, the
/// effect of the initial state.
pub struct ParsimK {
    orders: Orders,
    rows: Option<usize>,
    /// How an unstable A is treated, and the start.
    ending: (Stabilise, InitialCondition),
    /// Whether the model is a start, for which u need not excite the block rows.
    is_start: bool,
    high: HighOrder,
}

impl ParsimK {
    fn find(
        &mut self,
        u: &[f64],
        y: &[f64],
        singular_values: &mut Vec<f64>,
    ) -> Result<(LinearModel, f64), FailureKind> {
        let n = self.orders.na;
        let rows = self.rows.unwrap_or_else(|| {
            self.high.fit(u, y);
            let longest = longest_rows(y.len()).max(n + 1);
            (2 * self.high.order()).clamp(n + 1, longest)
        });
        let rows = if self.is_start {
            rows
        } else {
            excited_rows(u, rows, self.rows.unwrap_or(n + 1))?
        };
        let observability = observability(u, y, rows, self.orders.nk == 0, singular_values)?;
        if !(singular_values[n - 1] > 0.0) {
            return Err(FailureKind::RankDeficient);
        }
        let mut shift = observability.get(1.., ..n).to_owned();
        observability.get(..rows - 1, ..n).qr().solve_lstsq_in_place(&mut shift);
        let mut model = LinearModel::zero(self.orders);
        innovations::characteristic(shift.get(..n, ..), &mut model.c)?;
        let finite = stable(&model.c, &mut Vec::new()) || reflect_zeros(&mut model.c);
        finite.then_some(()).ok_or(FailureKind::NonFinite)?;
        let condition = fit_given_c(&mut model, u, y)?;
        Ok((model, condition))
    }
}

/// Returns the left singular vectors of `G W`, and its singular values.
fn observability(
    u: &[f64],
    y: &[f64],
    s: usize,
    direct: bool,
    singular_values: &mut Vec<f64>,
) -> Result<Mat<f64>, FailureKind> {
    let count = columns(s, y.len());
    // Columns z, then u and y of each future row.
    let (of_u, of_y) = (|i: usize| 2 * s + 2 * i, |i: usize| 2 * s + 2 * i + 1);
    let past = |signal, at| Delays::new(signal, 0, s, at).backwards();
    let future = |signal, at| Delays {
        step: 2,
        ..Delays::new(signal, s, s, at)
    };
    let blocks = [past(y, 0), past(u, s), future(u, of_u(0)), future(y, of_y(0))];
    let triangle = Hankel::new(&blocks, count)?;
    // In the coordinates of R every signal is a column of it.
    let r = triangle.r();
    let signal = |j: usize| Mat::from_fn(4 * s, 1, |i, _| if i <= j { r[(i, j)] } else { 0.0 });
    let upper = |width: usize| Mat::from_fn(4 * s, width, |i, j| if i <= j { r[(i, j)] } else { 0.0 });
    let first = Inverse::of(&upper(2 * s + usize::from(direct)))?;
    let later = Inverse::of(&upper(2 * s + 2))?;
    let mut g = Mat::zeros(s, 2 * s);
    let (mut of_inputs, mut of_outputs) = (vec![0.0; s], vec![0.0; s]);
    for i in 0..s {
        let mut known = signal(of_y(i));
        for j in 0..i {
            known -= of_inputs[j] * signal(of_u(i - j)) + of_outputs[j] * signal(of_y(i - j));
        }
        let row = if i == 0 {
            first.times(&known)
        } else {
            later.times(&known)
        };
        for j in 0..2 * s {
            g[(i, j)] = row[(j, 0)];
        }
        if i > 0 || direct {
            of_inputs[i] = row[(2 * s, 0)];
        }
        if i > 0 {
            of_outputs[i] = row[(2 * s + 1, 0)];
        }
    }
    // z without future inputs: the rows of z below those of u in the triangle of [u z].
    let both = Mat::from_fn(4 * s, 3 * s, |i, j| {
        let j = if j < s { of_u(j) } else { j - s };
        if i <= j { r[(i, j)] } else { 0.0 }
    });
    let qr = both.qr();
    let triangle = qr.thin_R();
    let weight = Mat::from_fn(2 * s, 2 * s, |i, j| if i <= j { triangle[(s + i, s + j)] } else { 0.0 });
    let (left, values) = left_singular_vectors(&(&g * weight.transpose()))?;
    *singular_values = values;
    // Rounding of a record without noise is no direction.
    let smallest = singular_values[0] * s as f64 * f64::EPSILON * 16.0;
    for value in singular_values.iter_mut().filter(|value| **value <= smallest) {
        *value = 0.0;
    }
    Ok(Mat::from_fn(s, s, |i, j| left[(i, j)] * singular_values[j].sqrt()))
}

/// The pseudo-inverse of a matrix; singular values that are rounding of the largest are taken as 0.
struct Inverse {
    inverse: Mat<f64>,
}

impl Inverse {
    fn of(x: &Mat<f64>) -> Result<Self, FailureKind> {
        let svd = x.thin_svd().map_err(|_| FailureKind::NonFinite)?;
        let (values, n) = (svd.S(), x.ncols());
        if !(values[0] > 0.0) {
            return Err(FailureKind::Singular);
        }
        let smallest = values[0] * n as f64 * f64::EPSILON * 16.0;
        let scaled = Mat::from_fn(n, n, |i, j| {
            let value = values[j];
            if value > smallest { svd.V()[(i, j)] / value } else { 0.0 }
        });
        Ok(Self {
            inverse: scaled * svd.U().get(.., ..n).transpose(),
        })
    }

    fn times(&self, x: &Mat<f64>) -> Mat<f64> {
        &self.inverse * x
    }
}

/// Fits A, B and the effect of the initial state, given a stable C; returns the condition.
fn fit_given_c(model: &mut LinearModel, u: &[f64], y: &[f64]) -> Result<f64, FailureKind> {
    let Orders { na: n, nb, nk, .. } = model.orders();
    let (mut of_y, mut of_u, mut impulse) = (y.to_vec(), u.to_vec(), vec![0.0; y.len()]);
    impulse[0] = 1.0;
    divide_each(&model.c, [&mut of_y, &mut of_u, &mut impulse]);
    let width = 2 * n + nb;
    let mut triangle = Triangle::new(width);
    triangle.run(y.len(), |j, first, to| {
        let (signal, lag) = match j {
            j if j < n => (&of_y, j + 1),
            j if j < n + nb => (&of_u, nk + j - n),
            j if j < width => (&impulse, j - n - nb),
            _ => return copy_delayed(y, 0, first, to),
        };
        copy_delayed(signal, lag, first, to);
    })?;
    let mut theta = triangle.top().to_vec();
    let condition = condition_of_triangle(triangle.r())?;
    check_rank_of_columns(condition, width)?;
    if !triangle.solve(&mut theta) {
        return Err(FailureKind::Singular);
    }
    for i in 0..n {
        model.a[i + 1] = model.c[i + 1] - theta[i];
    }
    model.b[nk..].copy_from_slice(&theta[n..n + nb]);
    Ok(condition)
}

impl SinglePass for ParsimK {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let found = self.find(window.u, window.y, &mut pass.singular_values)?;
        innovations::conclude(window, self.ending, found, pass)
    }
}
