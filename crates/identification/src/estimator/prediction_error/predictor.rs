//! Prediction errors of a model, and their derivatives by one bank of filters.
//!
//! Each column of `psi = de/dtheta` is one of five signals, delayed (Ljung, *System Identification*, 2nd ed., section
//! 10.3): `D/C y` for A, `v = D/(C F) u` for B, `e/C` for C, `w/C` for D, `B v/F` for F, with `w = A y - B/F u` and y
//! less its offset, if it has one. Its column is `-A D/C` of a step.

mod judged;
mod second;

use super::kernels::{Triangle, copy_delayed, divide, divide_each, filter};
use crate::estimator::covariance::Influence;
use crate::estimator::lag_sums::dot;
use crate::estimator::lag_sums::{System, lagged_products};
use crate::estimator::reflection::stable;
use crate::estimator::solver::rank::Equilibration;
use crate::estimator::{FailureKind, Runs};
use crate::model::{LinearModel, Orders};
use std::ops::Range;

/// How psi's triangle is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reduction {
    /// From `psi'psi`, whose entries are few inner products since columns are delays of five signals. Its rounding is
    /// that of the squared condition, so a triangle that is nearly singular is computed by reflections all the same.
    Products,
    /// By Householder reflections.
    Reflections,
}

/// Pivots of `psi'psi` below this share of the diagonal ask for reflections.
const ILL_CONDITIONED: f64 = 1e-9;

/// The groups of parameters in theta.
const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3;
const F: usize = 4;
/// From here on each record has numbers of its own.
const OFFSET: usize = 5;
const INITIAL: usize = 6;

/// The numbers of each record that are fitted beside the parameters.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::estimator) struct OfRecord {
    /// Whether y has an offset.
    pub(in crate::estimator) offset: bool,
    /// How many represent the signals before the record.
    pub(in crate::estimator) initial: usize,
}

impl OfRecord {
    pub(in crate::estimator) fn count(self) -> usize {
        usize::from(self.offset) + self.initial
    }
}

/// Returns how many numbers represent the effect on e of the signals before the record. The effect is `P(q)/(C F)` of
/// an impulse at k = 0; P has as many coefficients as the predictor `(D A F y - D B u)/(C F)` has states.
pub fn initial_numbers(orders: Orders) -> usize {
    let Orders { na, nb, nc, nd, nf, nk } = orders;
    (nc + nf).max(nd + na + nf).max((nd + nb + nk).saturating_sub(1))
}

/// Columns of psi: a signal, the number of columns, the first delay, a sign. The columns of the offset and of the
/// initial numbers are for the first record; as many follow for each other one.
type Block<'a> = (&'a [f64], usize, usize, f64);

/// A column of psi, or e: a delayed signal, of one record alone if it belongs to the numbers of that record.
struct Column<'a> {
    signal: &'a [f64],
    delay: usize,
    sign: f64,
    of: Option<usize>,
}

impl Column<'_> {
    /// Returns the signal in a record, the i-th; `None` where the column is zero.
    fn within(&self, i: usize, run: &Range<usize>) -> Option<&[f64]> {
        match self.of {
            None => Some(&self.signal[run.clone()]),
            Some(of) if of == i => Some(&self.signal[..run.len()]),
            Some(_) => None,
        }
    }
}

/// Divides a signal by a polynomial, in each record by itself.
fn divide_in(runs: &Runs, d: &[f64], x: &mut [f64]) {
    divide_each_in(runs, d, [x]);
}

/// Does the same of several signals.
fn divide_each_in<const K: usize>(runs: &Runs, d: &[f64], mut x: [&mut [f64]; K]) {
    for run in runs {
        divide_each(d, x.each_mut().map(|x| &mut x[run.clone()]));
    }
}

/// Filters a signal, in each record by itself.
fn filter_in(runs: &Runs, c: &[f64], x: &[f64], to: &mut [f64]) {
    for run in runs {
        filter(c, &x[run.clone()], &mut to[run.clone()]);
    }
}

/// Buffers for records of one length.
pub(super) struct Predictor {
    orders: Orders,
    /// The records: each has numbers of its own.
    runs: Runs,
    model: LinearModel,
    /// y less the offsets.
    y: Vec<f64>,
    /// `u/F`, `B/F u`, w.
    u: Vec<f64>,
    x: Vec<f64>,
    w: Vec<f64>,
    pub(super) e: Vec<f64>,
    of_y: Vec<f64>,
    of_u: Vec<f64>,
    of_x: Vec<f64>,
    of_e: Vec<f64>,
    /// `w/C`, from which e follows.
    of_w: Vec<f64>,
    /// How many offsets there are, which follow the parameters in theta, and numbers for the signals before the
    /// records, which follow these.
    offsets: usize,
    initial: usize,
    /// `A D/C` of a step.
    step: Vec<f64>,
    /// The impulse response of `1/(C F)`, and the contribution of the initial numbers to e.
    impulse: Vec<f64>,
    free: Vec<f64>,
    scratch: Vec<f64>,
    scaled: Vec<f64>,
    pub(super) psi: Triangle,
    normal: System,
    /// The signals of the second derivatives.
    seconds: Vec<Vec<f64>>,
    equilibration: Equilibration,
    column: Vec<f64>,
    influence: Influence,
}

impl Predictor {
    /// Makes buffers for windows of these records.
    pub(super) fn new(orders: Orders, of_record: OfRecord, runs: Runs) -> Self {
        let window = runs.samples();
        let offsets = usize::from(of_record.offset) * runs.count();
        let initial = of_record.initial * runs.count();
        let n = orders.parameters() + offsets + initial;
        let signal = |needed: bool| vec![0.0; if needed { window } else { 0 }];
        Self {
            orders,
            runs,
            model: LinearModel::zero(orders),
            y: signal(true),
            u: signal(true),
            x: signal(true),
            w: signal(true),
            e: signal(true),
            of_y: signal(orders.na > 0),
            of_u: signal(true),
            of_x: signal(orders.nf > 0),
            of_e: signal(orders.nc > 0),
            of_w: signal(true),
            offsets,
            initial,
            step: signal(offsets > 0),
            impulse: signal(initial > 0),
            free: signal(initial > 0),
            scratch: Vec::new(),
            scaled: Vec::new(),
            psi: Triangle::new(n),
            normal: System::default(),
            seconds: Vec::new(),
            equilibration: Equilibration::new(n, n),
            column: vec![0.0; n],
            influence: Influence::default(),
        }
    }

    /// Returns the number of parameters, offsets and initial numbers.
    pub(super) fn width(&self) -> usize {
        self.column.len()
    }

    /// Returns the number of offsets and initial numbers, the last of theta.
    pub(super) fn of_records(&self) -> usize {
        self.offsets + self.initial
    }

    /// Takes the parameters; returns whether the predictor is stable.
    pub(super) fn set(&mut self, theta: &[f64]) -> bool {
        let parameters = theta.len() - self.of_records();
        self.model.set_parameters(&theta[..parameters]);
        let LinearModel { c, f, .. } = &self.model;
        stable(f, &mut self.scratch) && stable(c, &mut self.scratch)
    }

    /// Returns whether a zero of C or F is outside the circle of this radius, at the parameters of the last
    /// [`Self::set`].
    pub(super) fn exceeds(&mut self, radius: f64) -> bool {
        let LinearModel { c, f, .. } = &self.model;
        [c, f].into_iter().any(|polynomial| {
            let mut power = 1.0;
            self.scaled.clear();
            self.scaled.extend(polynomial.iter().map(|x| {
                let scaled = x / power;
                power *= radius;
                scaled
            }));
            !stable(&self.scaled, &mut self.scratch)
        })
    }

    /// Computes `sum e(k)^2`. `None` if the predictor is not stable or something overflows.
    pub(super) fn sum(&mut self, u: &[f64], y: &[f64], theta: &[f64]) -> Option<f64> {
        if !self.set(theta) {
            return None;
        }
        let (offsets, initial) = theta[theta.len() - self.of_records()..].split_at(self.offsets);
        let LinearModel { a, b, c, d, f, .. } = &self.model;
        self.u.copy_from_slice(u);
        self.y.copy_from_slice(y);
        let runs = &self.runs;
        for (run, offset) in runs.iter().zip(offsets) {
            self.y[run.clone()].iter_mut().for_each(|y| *y -= offset);
        }
        divide_in(runs, f, &mut self.u);
        filter_in(runs, b, &self.u, &mut self.x);
        filter_in(runs, a, &self.y, &mut self.w);
        for (w, x) in self.w.iter_mut().zip(&self.x) {
            *w -= x;
        }
        self.of_w.copy_from_slice(&self.w);
        divide_in(runs, c, &mut self.of_w);
        filter_in(runs, d, &self.of_w, &mut self.e);
        if self.initial > 0 {
            self.impulse.fill(0.0);
            self.impulse[0] = 1.0;
            divide(c, &mut self.impulse);
            divide(f, &mut self.impulse);
            let each = initial.chunks(self.initial / runs.count());
            for (run, initial) in runs.iter().zip(each) {
                filter(initial, &self.impulse, &mut self.free[run.clone()]);
            }
            for (e, free) in self.e.iter_mut().zip(&self.free) {
                *e += free;
            }
        }
        let sum = dot(&self.e, &self.e);
        sum.is_finite().then_some(sum)
    }

    /// Computes the signals that make up psi, at the parameters of the last [`Self::sum`].
    fn filter_signals(&mut self) {
        let LinearModel { a, b, c, d, f, .. } = &self.model;
        let y = &self.y;
        let Orders { na, nb, nc, nd, nf, .. } = self.orders;
        let (runs, of_input) = (&self.runs, nb + nf > 0);
        if nc > 0 {
            self.of_e.copy_from_slice(&self.e);
        }
        if nd == 0 {
            self.of_u.copy_from_slice(&self.u);
            let (of_y, of_u, of_e) = (&mut self.of_y, &mut self.of_u, &mut self.of_e);
            if na > 0 {
                of_y.copy_from_slice(y);
            }
            // Signals side by side take little longer than one.
            match (na > 0, of_input) {
                _ if nc == 0 => {}
                (false, false) => divide_in(runs, c, of_e),
                (true, false) => divide_each_in(runs, c, [of_y, of_e]),
                (false, true) => divide_each_in(runs, c, [of_u, of_e]),
                (true, true) => divide_each_in(runs, c, [of_y, of_u, of_e]),
            }
        } else {
            // `x` is not needed any more and serves as scratch.
            if na > 0 {
                self.x.copy_from_slice(y);
                divide_in(runs, c, &mut self.x);
                filter_in(runs, d, &self.x, &mut self.of_y);
            }
            self.x.copy_from_slice(&self.u);
            match of_input {
                _ if nc == 0 => {}
                false => divide_in(runs, c, &mut self.of_e),
                true => divide_each_in(runs, c, [&mut self.x, &mut self.of_e]),
            }
            filter_in(runs, d, &self.x, &mut self.of_u);
        }
        if nf > 0 {
            filter_in(runs, b, &self.of_u, &mut self.of_x);
            if self.initial > 0 {
                // The contribution of the initial numbers has C F in the denominator too.
                for (of_x, free) in self.of_x.iter_mut().zip(&self.free) {
                    *of_x -= free;
                }
            }
            divide_in(runs, f, &mut self.of_x);
        }
        if self.offsets > 0 {
            self.x.fill(1.0);
            filter(a, &self.x, &mut self.step);
            self.x.copy_from_slice(&self.step);
            filter(d, &self.x, &mut self.step);
            divide(c, &mut self.step);
        }
    }

    /// Returns the initial numbers, of one record, with which the errors of the last [`Self::sum`] would be least.
    pub(super) fn best_start(&self) -> Option<Vec<f64>> {
        let mut columns = Triangle::new(self.initial);
        let reduced = columns.run(self.e.len(), |j, first, to| {
            let (signal, lag) = if j < self.initial {
                (&self.impulse, j)
            } else {
                (&self.e, 0)
            };
            copy_delayed(signal, lag, first, to);
        });
        let mut start: Vec<f64> = columns.top().iter().map(|e| -e).collect();
        (reduced.is_ok() && columns.solve(&mut start)).then_some(start)
    }

    /// Returns the signals whose delays are the columns of psi, and which delays, at the last [`Self::sum`].
    pub(super) fn signals(&mut self) -> Vec<(Vec<f64>, Range<usize>)> {
        self.filter_signals();
        let blocks = self.blocks().into_iter();
        let used = blocks.filter(|(_, count, ..)| *count > 0);
        used.map(|(signal, count, first, sign)| {
            let signed = signal.iter().map(|x| sign * x);
            (signed.collect(), first..first + count)
        })
        .collect()
    }

    fn blocks(&self) -> [Block<'_>; 7] {
        let Orders { na, nb, nc, nd, nf, nk } = self.orders;
        [
            (&self.of_y, na, 1, 1.0),
            (&self.of_u, nb, nk, -1.0),
            (&self.of_e, nc, 1, -1.0),
            (&self.of_w, nd, 1, 1.0),
            (&self.of_x, nf, 1, 1.0),
            (&self.step, self.offsets / self.runs.count(), 0, -1.0),
            (&self.impulse, self.initial / self.runs.count(), 0, 1.0),
        ]
    }

    /// Returns for how many records a group has numbers of their own; 1 where all share them.
    fn records_of(&self, group: usize) -> usize {
        if group >= OFFSET { self.runs.count() } else { 1 }
    }

    /// Returns the columns of psi, and e.
    fn columns(&self) -> Vec<Column<'_>> {
        let mut columns = Vec::with_capacity(self.width() + 1);
        for (group, (signal, count, first, sign)) in self.blocks().into_iter().enumerate() {
            for record in 0..self.records_of(group) {
                columns.extend((first..first + count).map(|delay| Column {
                    signal,
                    delay,
                    sign,
                    of: (group >= OFFSET).then_some(record),
                }));
            }
        }
        columns.push(Column {
            signal: &self.e,
            delay: 0,
            sign: 1.0,
            of: None,
        });
        columns
    }

    /// Computes R and `Q'e` of psi at the parameters of the last [`Self::sum`].
    pub(super) fn linearise(&mut self, by: Reduction) -> Result<(), FailureKind> {
        self.filter_signals();
        if by == Reduction::Products && self.reduce_products() {
            return Ok(());
        }
        let mut psi = std::mem::take(&mut self.psi);
        let reduced = self.reduce(&mut psi, 0..0);
        self.psi = psi;
        reduced
    }

    /// Takes theta, that of the last [`Self::sum`], to the minimum of the linearisation over all but the parameters at
    /// `fixed`. Returns false if there is none.
    pub(super) fn step_beside(&mut self, theta: &mut [f64], fixed: Range<usize>) -> bool {
        if fixed.len() == theta.len() {
            return true;
        }
        self.filter_signals();
        let mut psi = Triangle::new(theta.len() - fixed.len());
        let reduced = self.reduce(&mut psi, fixed.clone());
        let mut step = psi.top().to_vec();
        if reduced.is_err() || !psi.solve(&mut step) {
            return false;
        }
        let (before, after) = theta.split_at_mut(fixed.start);
        let free = before.iter_mut().chain(&mut after[fixed.len()..]);
        for (to, step) in free.zip(step) {
            *to -= step;
        }
        true
    }

    /// Computes R and `Q'e` of the columns of psi but some.
    fn reduce(&self, psi: &mut Triangle, without: Range<usize>) -> Result<(), FailureKind> {
        let columns = self.columns();
        psi.run(self.e.len(), |j, first, to| {
            let later = if j < without.start { 0 } else { without.len() };
            let column = &columns[j + later];
            to.fill(0.0);
            for (i, run) in self.runs.iter().enumerate() {
                let rows = first.max(run.start + column.delay)..(first + to.len()).min(run.end);
                let Some(signal) = column.within(i, run).filter(|_| !rows.is_empty()) else {
                    continue;
                };
                let from = &signal[rows.start - run.start - column.delay..];
                let to = &mut to[rows.start - first..rows.end - first];
                for (to, x) in to.iter_mut().zip(from) {
                    *to = column.sign * x;
                }
            }
        })
    }

    /// Computes R and `Q'e` from `psi'psi` and `psi'e`; false if they are too near to singular, or of several records.
    fn reduce_products(&mut self) -> bool {
        if self.runs.count() > 1 {
            return false;
        }
        let mut normal = std::mem::take(&mut self.normal);
        let width = self.width();
        normal.clear(width);
        let blocks = self.blocks();
        let mut row = 0;
        for (i, (signal, count, delay, sign)) in blocks.iter().enumerate() {
            let mut column = 0;
            // The lower triangle.
            for (of_column, columns, late, other) in &blocks[..=i] {
                let put = |of_row, of_column, value| {
                    normal.put(row + of_row, column + of_column, sign * other * value);
                };
                lagged_products(signal, of_column, (*delay, *count), (*late, *columns), put);
                column += columns;
            }
            lagged_products(signal, &self.e, (*delay, *count), (0, 1), |of_row, _, value| {
                normal.put(row + of_row, width, sign * value);
            });
            row += count;
        }
        let reached = normal.factorise(ILL_CONDITIONED);
        self.psi.take(&normal);
        self.normal = normal;
        reached == width
    }
}
