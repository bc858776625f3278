//! Weighted null-space fitting of the structures of `oe`, `armax` and `bj`, for `wnsf` and as starts of searches.
//!
//! Source: M. Galrinho, C. R. Rojas, H. Hjalmarsson, "Parametric identification using weighted null-space fitting",
//! IEEE Trans. Automatic Control 64 (2019), 2798-2813.

use super::lag_sums::{System, TINY, lagged_products};
use super::prediction_error::kernels::{Triangle, divide};
use super::reflection::reflect_zeros;
use super::reflection::stable;
use crate::model::{LinearModel, Orders};
use faer::MatRef;

/// The largest order of a high-order model with past outputs, and of one without; and the samples for each.
const MOST_ARX: usize = 50;
const MOST_FIR: usize = 150;
const SAMPLES_ARX: usize = 6;
const SAMPLES_FIR: usize = 4;

/// A high-order model `A_h y = B_h q^-nk u + e` with m coefficients in each polynomial, or `y = B_h q^-nk u + e` for
/// output-error structures.
///
/// The coefficients of q^-1, of q^-2 and so on stand together, so that one Cholesky factorisation serves all orders up
/// to the largest.
pub(super) struct HighOrder {
    with_outputs: bool,
    delay: usize,
    /// The largest order, and whether it is the only one.
    most: usize,
    given: Option<usize>,
    normal: System,
    /// The orders to which the normal equations are positive definite.
    reached: usize,
    /// The order by AIC.
    chosen: usize,
    /// Whether the largest order of a response is doubled, as far as the record allows, until it holds the response.
    pub(super) grows: bool,
    /// Whether the largest order cuts a response: its last tenth explains more of y than chance.
    pub(super) is_cut: bool,
    pub(super) equations: Equations,
}

/// The equations of a high-order model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Equations {
    /// One for each sample, with zeros before the record.
    Prewindow,
    /// Only the equations whose samples are all in the record.
    Complete,
    /// The same with a constant.
    WithConstant,
}

impl HighOrder {
    pub(super) fn new(with_outputs: bool, delay: usize, given: Option<usize>, window: usize) -> Self {
        let rule = if with_outputs {
            MOST_ARX.min(window / SAMPLES_ARX)
        } else {
            MOST_FIR.min(window / SAMPLES_FIR)
        };
        Self {
            with_outputs,
            delay,
            most: given.unwrap_or(rule).max(1),
            given,
            normal: System::default(),
            reached: 0,
            chosen: 0,
            grows: false,
            is_cut: false,
            equations: Equations::Prewindow,
        }
    }

    /// The order by AIC; 0 if there is none.
    pub(super) fn chosen(&self) -> usize {
        self.chosen
    }

    /// The order that was given, as far as [`Self::fit`] reached it, or that by AIC; 0 if there is none.
    pub(super) fn order(&self) -> usize {
        self.given.map_or(self.chosen, |_| self.reached)
    }

    /// The largest order.
    pub(super) fn most(&self) -> usize {
        self.most
    }

    /// The model of an order that [`Self::fit`] reached.
    pub(super) fn model(&self, order: usize) -> LinearModel {
        let step = self.step();
        let mut solution = vec![0.0; order * step];
        self.normal.back_substitute(&mut solution);
        let na = if self.with_outputs { order } else { 0 };
        let mut model = LinearModel::zero(Orders::arx(na, order, self.delay));
        for (i, pair) in solution.chunks_exact(step).enumerate() {
            if self.with_outputs {
                model.a[i + 1] = pair[0];
            }
            model.b[self.delay + i] = pair[step - 1];
        }
        model
    }

    /// Coefficients for each power of q^-1.
    fn step(&self) -> usize {
        1 + usize::from(self.with_outputs)
    }

    /// Computes the normal equations of a record and the order by AIC.
    pub(super) fn fit(&mut self, u: &[f64], y: &[f64]) {
        let most = self.most;
        loop {
            self.fit_to(u, y);
            let longer = (2 * self.most).min(y.len() / SAMPLES_FIR);
            if !(self.grows && self.is_cut && longer > self.most) {
                break;
            }
            self.most = longer;
        }
        // The next record begins anew.
        self.most = most;
    }

    fn fit_to(&mut self, u: &[f64], y: &[f64]) {
        let (m, step, nk) = (self.most, self.step(), self.delay);
        let (width, input) = (m * step, step - 1);
        // The first equation that counts.
        let first = match self.equations {
            Equations::Prewindow => 0,
            _ => (m * (step - 1)).max(nk + m - 1).min(y.len()),
        };
        let with_constant = self.equations == Equations::WithConstant;
        let equations = Sums { first, with_constant };
        let normal = &mut self.normal;
        normal.clear(width);
        equations.products((u, nk, m), (u, nk, m), |i, j, value| {
            normal.add(step * i + input, step * j + input, value);
        });
        equations.products((u, nk, m), (y, 0, 1), |i, _, value| {
            normal.add(step * i + input, width, value);
        });
        if self.with_outputs {
            equations.products((y, 1, m), (y, 1, m), |i, j, value| {
                normal.add(step * i, step * j, value);
            });
            equations.products((y, 1, m), (u, nk, m), |i, j, value| {
                normal.add(step * i, step * j + 1, -value);
                normal.add(step * j + 1, step * i, -value);
            });
            equations.products((y, 1, m), (y, 0, 1), |i, _, value| {
                normal.add(step * i, width, -value);
            });
        }
        self.reached = normal.factorise(TINY) / step;
        let mut samples = (y.len() - first) as f64;
        let mut square: f64 = y[first..].iter().map(|y| y * y).sum();
        if with_constant {
            square -= y[first..].iter().sum::<f64>().powi(2) / samples;
            samples -= 1.0;
        }
        let mut rest = square;
        let mut least = f64::INFINITY;
        self.chosen = 0;
        for (i, parts) in normal.right[..self.reached * step].chunks_exact(step).enumerate() {
            rest -= parts.iter().map(|x| x * x).sum::<f64>();
            let order = i + 1;
            // The differences are rounding where a model is nearly exact.
            let variance = (rest / samples).max(1e-14 * square / samples);
            let criterion = samples * variance.ln() + 2.0 * (step * order) as f64;
            if criterion < least {
                (least, self.chosen) = (criterion, order);
            }
        }
        let squares = normal.right[..self.reached * step].iter().map(|x| x * x);
        self.is_cut = is_cut(squares, rest / (samples - width as f64), square);
    }
}

/// Sums over the equations from the first that counts.
#[derive(Clone, Copy)]
struct Sums {
    first: usize,
    /// Whether they have a constant, which is eliminated.
    with_constant: bool,
}

impl Sums {
    /// Calls `add` with terms of the inner products of delayed signals, each a signal, its first delay and their count.
    fn products(
        self,
        (a, of_a, count_a): (&[f64], usize, usize),
        (b, of_b, count_b): (&[f64], usize, usize),
        mut add: impl FnMut(usize, usize, f64),
    ) {
        let Self { first, .. } = self;
        let (of, with) = ((of_a, count_a), (of_b, count_b));
        lagged_products(a, b, of, with, &mut add);
        if first > 0 {
            let before = |i, j, value: f64| add(i, j, -value);
            lagged_products(&a[..first], &b[..first], of, with, before);
        }
        if self.with_constant {
            let sums = |signal: &[f64], (delay, count): (usize, usize)| -> Vec<f64> {
                let sum = |late: usize| {
                    let late = delay + late;
                    let part = first.saturating_sub(late)..signal.len().saturating_sub(late);
                    signal[part].iter().sum()
                };
                (0..count).map(sum).collect()
            };
            let (of_a, of_b) = (sums(a, of), sums(b, with));
            for (i, of_a) in of_a.iter().enumerate() {
                for (j, of_b) in of_b.iter().enumerate() {
                    add(i, j, -of_a * of_b / (a.len() - first) as f64);
                }
            }
        }
    }
}

/// Whether the taps of a response do not hold it: by the squares that each explains of y beside those before it, the
/// last tenth explains more than chance, by six standard deviations of chi-squared, and more than rounding.
pub(super) fn is_cut(squares: impl ExactSizeIterator<Item = f64>, variance: f64, of_y: f64) -> bool {
    let (n, k) = (squares.len(), squares.len().div_ceil(10));
    let last: f64 = squares.skip(n - k).sum();
    let chance = k as f64 + 6.0 * (2.0 * k as f64).sqrt();
    last > (chance * variance).max(1e-20 * of_y)
}

/// Returns the model `A y = B q^-delay u + e` by least squares, of the order by AIC (at most 50, and N/6); `None` if no
/// order has a solution.
pub(super) fn long_autoregression(u: &[f64], y: &[f64], delay: usize) -> Option<LinearModel> {
    let mut high = HighOrder::new(true, delay, None, y.len());
    high.fit(u, y);
    (high.chosen > 0).then(|| high.model(high.chosen))
}

/// Returns that order, at most `most` too; 0 if no order has a solution.
pub(crate) fn long_autoregression_order(u: &[f64], y: &[f64], delay: usize, most: usize) -> usize {
    let mut high = HighOrder::new(true, delay, None, y.len());
    high.most = high.most.min(most).max(1);
    high.fit(u, y);
    high.chosen
}

/// Buffers for records of one length.
///
/// With `A_h = A/C`, `B_h = B/C` (ARMAX), `A_h = D/C`, `B_h = B D/(C F)` (Box and Jenkins) or `B_h = B/F` (output
/// error) the parameters satisfy linear equations in the coefficients of the high-order model:
/// `C A_h - A = 0`, `C B_h - B = 0`; `C A_h - D = 0`, `F B_h - B A_h = 0`; `F B_h - B = 0`. They are solved by least
/// squares, and then with the inverse covariance of their errors as weight, which depends on C, F and B of the
/// solution before.
pub(super) struct NullSpaceFit {
    orders: Orders,
    high: HighOrder,
    /// The order of the high-order model, and its coefficients with those of q^0.
    order: usize,
    of_y: Vec<f64>,
    of_u: Vec<f64>,
    solution: Vec<f64>,
    /// Weighted columns of the equations, one after another; the constant terms are the last.
    columns: Vec<f64>,
    rest: [Vec<f64>; 2],
    triangle: Triangle,
    theta: Vec<f64>,
    pub(super) model: LinearModel,
    scratch: Vec<f64>,
}

impl NullSpaceFit {
    /// Makes buffers for windows of `window` samples; the order of the high-order model may be given.
    pub(super) fn new(orders: Orders, high_order: Option<usize>, window: usize) -> Self {
        let with_outputs = orders.na + orders.nc + orders.nd > 0;
        Self {
            orders,
            high: HighOrder::new(with_outputs, orders.nk, high_order, window),
            order: 0,
            of_y: Vec::new(),
            of_u: Vec::new(),
            solution: Vec::new(),
            columns: Vec::new(),
            rest: Default::default(),
            triangle: Triangle::new(orders.parameters()),
            theta: vec![0.0; orders.parameters()],
            model: LinearModel::zero(orders),
            scratch: Vec::new(),
        }
    }

    /// Returns how many samples the high-order model needs: one more than its coefficients, of which there must be as
    /// many as parameters.
    pub(super) fn samples_needed(&self) -> usize {
        let least = self.orders.parameters().div_ceil(self.high.step());
        let samples = if self.high.with_outputs {
            SAMPLES_ARX
        } else {
            SAMPLES_FIR
        };
        match self.high.given {
            Some(order) => order.max(least) * self.high.step() + 1,
            None => least * samples,
        }
    }

    /// Fits the high-order model; returns the orders that are worth a fit: that by AIC, twice it, the largest.
    pub(super) fn begin(&mut self, u: &[f64], y: &[f64]) -> [usize; 3] {
        self.high.fit(u, y);
        let HighOrder {
            reached, chosen, given, ..
        } = self.high;
        if given.is_some() {
            return [reached; 3];
        }
        let Orders { na, nb, nc, nd, nf, .. } = self.orders;
        let least = na.max(nd) + nc + nb + nf;
        let short = chosen.max(least).min(reached);
        [short, (2 * short).min(reached), reached]
    }

    /// Lets the high-order model of an output-error structure follow the record; [`HighOrder::is_cut`].
    pub(super) fn follow_the_record(mut self) -> Self {
        self.high.grows = !self.high.with_outputs && self.high.given.is_none();
        self
    }

    /// Takes other equations of the high-order model.
    pub(super) fn of_equations(mut self, equations: Equations) -> Self {
        self.high.equations = equations;
        self
    }

    /// How many samples the equations of the largest high-order model look back.
    pub(super) fn memory(&self) -> usize {
        self.high.most + self.orders.nk
    }

    /// Whether the high-order model of an output-error structure cuts the response.
    pub(super) fn is_cut(&self) -> bool {
        !self.high.with_outputs && self.high.is_cut
    }

    /// Returns R of the last least-squares problem, whose columns are the parameters.
    pub(super) fn r(&self) -> MatRef<'_, f64> {
        self.triangle.r()
    }

    /// Returns whether the zeros of C and F are inside the unit circle.
    pub(super) fn is_stable(&mut self) -> bool {
        let LinearModel { c, f, .. } = &self.model;
        stable(c, &mut self.scratch) && stable(f, &mut self.scratch)
    }

    /// Takes the high-order model of an order, and computes the parameters without weights. Returns false if there is
    /// no solution.
    pub(super) fn start(&mut self, order: usize) -> bool {
        let step = self.high.step();
        self.order = order;
        if order * step < self.orders.parameters() {
            return false;
        }
        self.solution.resize(order * step, 0.0);
        self.high.normal.back_substitute(&mut self.solution);
        self.of_y.clear();
        self.of_y.push(1.0);
        self.of_u.clear();
        for pair in self.solution.chunks_exact(step) {
            if step == 2 {
                self.of_y.push(pair[0]);
            }
            self.of_u.push(pair[step - 1]);
        }
        self.solve(false)
    }

    /// Computes the parameters with the weight of the present model, whose C and F are reflected first.
    pub(super) fn refine(&mut self) -> bool {
        self.stabilise() && self.solve(true)
    }

    /// Reflects the zeros of C and F outside the unit circle.
    pub(super) fn stabilise(&mut self) -> bool {
        reflect(&mut self.model, &mut self.scratch)
    }

    fn solve(&mut self, weighted: bool) -> bool {
        let Orders { na, nb, nc, nd, nf, .. } = self.orders;
        let (m, step) = (self.order, self.high.step());
        let rows = m * step;
        let box_jenkins = na == 0 && nc + nd > 0;
        self.columns.clear();
        // Parameters in the order A, B, C, D, F, then the constant terms.
        let kinds = [(0, na), (1, nb), (2, nc), (3, nd), (4, nf), (5, 1)];
        for (kind, lag) in kinds
            .into_iter()
            .flat_map(|(kind, count)| (0..count).map(move |lag| (kind, lag)))
        {
            let [first, second] = &mut self.rest;
            for part in [&mut *first, &mut *second] {
                part.clear();
                part.resize(m, 0.0);
            }
            // Equation i of the first is for q^-(i+1), of the second for q^-(nk+i).
            match kind {
                0 | 3 => first[lag] = -1.0,
                1 if box_jenkins => {
                    for (to, a) in second[lag.min(m)..].iter_mut().zip(&self.of_y) {
                        *to = -a;
                    }
                }
                1 => {
                    if let Some(to) = second.get_mut(lag) {
                        *to = -1.0;
                    }
                }
                2 => {
                    for (to, a) in first[lag.min(m)..].iter_mut().zip(&self.of_y) {
                        *to = *a;
                    }
                    if !box_jenkins {
                        shift(&self.of_u, lag + 1, second);
                    }
                }
                4 => shift(&self.of_u, lag + 1, second),
                _ => {
                    if step == 2 {
                        first.copy_from_slice(&self.of_y[1..]);
                    }
                    second.copy_from_slice(&self.of_u);
                }
            }
            let begin = self.columns.len();
            self.columns.resize(begin + rows, 0.0);
            if weighted {
                self.weigh(begin, box_jenkins);
            } else {
                let [first, second] = &self.rest;
                for (i, to) in self.columns[begin..].chunks_exact_mut(step).enumerate() {
                    to[0] = first[i];
                    to[step - 1] = second[i];
                }
            }
        }
        let columns = &self.columns;
        let reduced = self.triangle.run(rows, |j, first, to| {
            to.copy_from_slice(&columns[j * rows + first..][..to.len()]);
        });
        for (theta, top) in self.theta.iter_mut().zip(self.triangle.top()) {
            *theta = -top;
        }
        if reduced.is_err() || !self.triangle.solve(&mut self.theta) {
            return false;
        }
        self.model.set_parameters(&self.theta);
        true
    }

    /// Writes the weighted column of the equations in `rest`: errors of the equations are those of the coefficients
    /// through C and F, with B between, and the inverse covariance of the coefficients is `L L' / s^2`.
    fn weigh(&mut self, begin: usize, box_jenkins: bool) {
        let step = self.high.step();
        let LinearModel { b, c, f, delay, .. } = &self.model;
        let [first, second] = &mut self.rest;
        if step == 2 {
            divide(c, first);
        }
        if box_jenkins {
            for (lag, b) in b[*delay..].iter().enumerate() {
                // `first` begins at q^-1.
                for (to, a) in second.iter_mut().skip(lag + 1).zip(&*first) {
                    *to += b * a;
                }
            }
        }
        divide(if self.orders.na > 0 { c } else { f }, second);
        let to = &mut self.columns[begin..];
        for i in 0..self.order {
            for (place, value) in [(step * i, first[i]), (step * i + step - 1, second[i])] {
                if step == 1 && place == step * i && value == 0.0 {
                    continue;
                }
                for (to, l) in to.iter_mut().zip(self.high.normal.row(place)) {
                    *to += l * value;
                }
            }
        }
    }
}

/// Reflects the zeros of C and F outside the unit circle into it; false if the result is not finite.
pub(super) fn reflect(model: &mut LinearModel, scratch: &mut Vec<f64>) -> bool {
    let LinearModel { c, f, .. } = model;
    [c, f]
        .into_iter()
        .all(|polynomial| stable(polynomial, scratch) || reflect_zeros(polynomial))
}

/// Computes `to(i) = from(i - lag)`.
fn shift(from: &[f64], lag: usize, to: &mut [f64]) {
    for (to, from) in to.iter_mut().skip(lag).zip(from) {
        *to = *from;
    }
}
