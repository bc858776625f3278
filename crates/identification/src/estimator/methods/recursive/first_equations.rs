//! The first equations of instrumental variables that start from `P = p0 I`.

use super::dot;
use super::elimination::Elimination;
use crate::estimator::solver::rank::{Equilibration, RANK_MULTIPLE, check_rank_of_columns};
use faer::MatRef;

/// While Z'Phi has not full rank, `R = I/p0 + Z'Phi` is singular but for the prior, which rounding may lose, and what
/// is lost there stays lost. So Z'Phi is kept as `E'F`, E having as many rows as there are independent instruments. The
/// instruments z of an equation are eliminated by these rows with pivoting, `z = sum_i g_i E_i + rest`, which adds
/// `g_i phi` to row i of F; the rest is a new row of E with phi beside it, unless it is rounding. With `c = 1/p0` times
/// all lambda, and G beside F for `y - phi'theta(0)`,
///
/// ```text
///     theta = theta(0) + s,  F s + c l = G,  s = E'l:  (c I + E'F) s = E'G
/// ```
///
/// which is solved for s and l together: `F E'` would add squares of y to those of u, which are of other units.
#[derive(Clone, Debug)]
pub(super) struct FirstEquations {
    /// theta(0).
    start: Vec<f64>,
    /// c; `None` without p0, and once Z'Phi has full rank.
    prior: Option<f64>,
    /// A column for each row of E, in which later rows are 0.
    pivots: Vec<usize>,
    /// The rows of `[E F G]`, and that of a new equation.
    rows: Vec<f64>,
    row: Vec<f64>,
    /// For each number of E the sum of the sizes of what it is the difference of.
    terms: Vec<f64>,
    of_row: Vec<f64>,
    /// The largest size of each instrument.
    sizes: Vec<f64>,
    matrix: Vec<f64>,
    solution: Vec<f64>,
    elimination: Elimination,
    equilibration: Equilibration,
}

impl FirstEquations {
    pub(super) fn new(d: usize) -> Self {
        let vector = || vec![0.0; d];
        Self {
            start: vector(),
            prior: None,
            pivots: Vec::with_capacity(d),
            rows: vec![0.0; d * (2 * d + 1)],
            row: vec![0.0; 2 * d + 1],
            terms: vec![0.0; d * d],
            of_row: vector(),
            sizes: vector(),
            matrix: vec![0.0; 4 * d * d],
            solution: vec![0.0; d * d.max(2)],
            elimination: Elimination::new(2 * d),
            equilibration: Equilibration::new(d, d),
        }
    }

    /// Before the first equation theta is this and P is p0 times the identity. Without p0 least squares has solved
    /// enough equations.
    pub(super) fn restart(&mut self, theta: &[f64], p0: Option<f64>) {
        self.start.copy_from_slice(theta);
        self.prior = p0.map(f64::recip);
        self.pivots.clear();
        self.sizes.fill(0.0);
    }

    /// Whether theta follows from these equations.
    pub(super) fn is_needed(&self) -> bool {
        self.prior.is_some()
    }

    /// Takes an equation.
    pub(super) fn take(&mut self, z: &[f64], phi: &[f64], y: f64, lambda: f64) {
        let Some(prior) = &mut self.prior else {
            return;
        };
        *prior *= lambda;
        let (d, width) = (z.len(), self.row.len());
        self.row[..d].copy_from_slice(z);
        self.row[d..2 * d].copy_from_slice(phi);
        self.row[2 * d] = y - dot(phi, &self.start);
        for (j, z) in z.iter().enumerate() {
            self.of_row[j] = z.abs();
            self.sizes[j] = self.sizes[j].max(z.abs());
        }
        let kept = self.rows.chunks_exact_mut(width);
        let kept = kept.zip(self.terms.chunks_exact_mut(d));
        for (pivot, (kept, terms)) in self.pivots.iter().zip(kept) {
            kept[d..].iter_mut().for_each(|f| *f *= lambda);
            if self.row[*pivot].abs() > kept[*pivot].abs() {
                self.row.swap_with_slice(kept);
                self.of_row.swap_with_slice(terms);
            }
            let share = self.row[*pivot] / kept[*pivot];
            for j in 0..d {
                self.row[j] -= share * kept[j];
                self.of_row[j] += share.abs() * terms[j];
            }
            self.row[*pivot] = 0.0;
            for (f, of_row) in kept[d..].iter_mut().zip(&self.row[d..]) {
                *f += share * of_row;
            }
        }
        if let Some(pivot) = self.new_pivot() {
            let count = self.pivots.len();
            self.rows[count * width..][..width].copy_from_slice(&self.row);
            self.terms[count * d..][..d].copy_from_slice(&self.of_row);
            self.pivots.push(pivot);
        }
        if self.pivots.len() == d && self.has_full_rank() {
            self.prior = None;
        }
    }

    /// The first column in which the rest is largest beside the instrument's size; `None` if all of it is rounding.
    fn new_pivot(&self) -> Option<usize> {
        let d = self.sizes.len();
        let least = RANK_MULTIPLE * 2.0 * d as f64 * f64::EPSILON;
        let counts = |j: &usize| self.row[*j].abs() > least * self.of_row[*j];
        let size = |j: &usize| self.row[*j].abs() / self.sizes[*j];
        let columns = (0..d).rev().filter(counts);
        columns.max_by(|i, j| size(i).total_cmp(&size(j)))
    }

    /// The rank rule of all solvers, for E'F.
    fn has_full_rank(&mut self) -> bool {
        let (d, width) = (self.sizes.len(), self.row.len());
        let product = &mut self.matrix[..d * d];
        product.fill(0.0);
        for row in self.rows.chunks_exact(width) {
            let (e, f) = row.split_at(d);
            for (to, e) in product.chunks_exact_mut(d).zip(e) {
                to.iter_mut().zip(f).for_each(|(to, f)| *to += e * f);
            }
        }
        let inverse = &mut self.solution[..d * d];
        inverse.fill(0.0);
        (0..d).for_each(|i| inverse[i * d + i] = 1.0);
        self.elimination.solve(d, product, inverse);
        let [product, inverse] = [&*product, inverse].map(|of| MatRef::from_row_major_slice(of, d, d));
        let scales = &mut self.equilibration;
        let condition = scales
            .of(product)
            .map(|()| scales.norm1(product, 0) * scales.inverse_norm1(inverse, 0));
        condition.is_ok_and(|condition| check_rank_of_columns(condition, d).is_ok())
    }

    /// Computes theta.
    pub(super) fn solve(&mut self, theta: &mut [f64]) {
        let (d, count) = (theta.len(), self.pivots.len());
        let size = d + count;
        let matrix = &mut self.matrix[..size * size];
        let solution = &mut self.solution[..size];
        matrix.fill(0.0);
        solution.fill(0.0);
        let rows = self.rows.chunks_exact(self.row.len()).take(count);
        for (i, row) in rows.enumerate() {
            let (e, f) = row.split_at(d);
            matrix[i * size..][..d].copy_from_slice(&f[..d]);
            matrix[i * size + d + i] = self.prior.unwrap_or(0.0);
            solution[i] = f[d];
            for (j, e) in e.iter().enumerate() {
                matrix[(count + j) * size + d + i] = -e;
            }
        }
        for j in 0..d {
            matrix[(count + j) * size + j] = 1.0;
        }
        self.elimination.solve(size, matrix, solution);
        for ((theta, start), step) in theta.iter_mut().zip(&self.start).zip(&*solution) {
            *theta = start + step;
        }
    }
}
