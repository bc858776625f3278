//! The first equations of instrumental variables that start from `P = p0 I`.

use super::dot;
use super::elimination::Elimination;
use crate::estimator::solver::rank::{Equilibration, RANK_MULTIPLE, check_rank_of_columns};
use faer::MatRef;

/// While Z'Phi has not full rank, `R = I/p0 + Z'Phi` is singular but for the prior, which rounding may lose, and what is
/// lost there stays lost. So Z'Phi is kept as `E'F`, E having as many rows as there are independent instruments: an
/// equation with the instruments `z = sum_i f_i E_i + rest` adds `f_i phi` to row i of F, and the rest is a new row of E
/// with phi beside it, unless it is rounding. With `c = 1/p0` times all lambda, and G in F's place for
/// `y - phi'theta(0)`,
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
    /// The columns in which rows of E are the first that are not 0.
    pivots: Vec<usize>,
    /// E, and the rows of `[F G]`.
    directions: Vec<f64>,
    equations: Vec<f64>,
    /// The largest size of each instrument.
    sizes: Vec<f64>,
    rest: Vec<f64>,
    /// The sum of the sizes of what the rest is the difference of.
    terms: Vec<f64>,
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
            directions: vec![0.0; d * d],
            equations: vec![0.0; d * (d + 1)],
            sizes: vector(),
            rest: vector(),
            terms: vector(),
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
        let (d, count) = (z.len(), self.pivots.len());
        let value = y - dot(phi, &self.start);
        for (size, z) in self.sizes.iter_mut().zip(z) {
            *size = size.max(z.abs());
        }
        self.rest.copy_from_slice(z);
        self.terms.iter_mut().zip(z).for_each(|(t, z)| *t = z.abs());
        let rows = self.equations[..count * (d + 1)].chunks_exact_mut(d + 1);
        let directions = self.directions.chunks_exact(d);
        for ((row, direction), pivot) in rows.zip(directions).zip(&self.pivots) {
            let share = self.rest[*pivot] / direction[*pivot];
            let sums = self.rest.iter_mut().zip(&mut self.terms);
            for ((rest, terms), e) in sums.zip(direction) {
                *rest -= share * e;
                *terms += (share * e).abs();
            }
            self.rest[*pivot] = 0.0;
            let (of_phi, of_value) = row.split_at_mut(d);
            for (to, phi) in of_phi.iter_mut().zip(phi) {
                *to = lambda * *to + share * phi;
            }
            of_value[0] = lambda * of_value[0] + share * value;
        }
        if let Some(pivot) = self.new_pivot() {
            self.pivots.push(pivot);
            self.directions[count * d..][..d].copy_from_slice(&self.rest);
            let row = &mut self.equations[count * (d + 1)..][..d + 1];
            row[..d].copy_from_slice(phi);
            row[d] = value;
        }
        if self.pivots.len() == d && self.has_full_rank() {
            self.prior = None;
        }
    }

    /// The column in which the rest is largest beside the instrument's size; `None` if all of it is rounding.
    fn new_pivot(&self) -> Option<usize> {
        let d = self.rest.len();
        let least = RANK_MULTIPLE * 2.0 * d as f64 * f64::EPSILON;
        let counts = |j: &usize| self.rest[*j].abs() > least * self.terms[*j];
        let size = |j: &usize| self.rest[*j].abs() / self.sizes[*j];
        (0..d)
            .filter(counts)
            .max_by(|i, j| size(i).total_cmp(&size(j)))
    }

    /// The rank rule of all solvers, for E'F.
    fn has_full_rank(&mut self) -> bool {
        let d = self.rest.len();
        let product = &mut self.matrix[..d * d];
        product.fill(0.0);
        for (direction, row) in self
            .directions
            .chunks_exact(d)
            .zip(self.equations.chunks_exact(d + 1))
        {
            for (to, e) in product.chunks_exact_mut(d).zip(direction) {
                to.iter_mut().zip(row).for_each(|(to, f)| *to += e * f);
            }
        }
        let inverse = &mut self.solution[..d * d];
        inverse.fill(0.0);
        (0..d).for_each(|i| inverse[i * d + i] = 1.0);
        self.elimination.solve(d, product, inverse);
        let [product, inverse] =
            [&*product, inverse].map(|of| MatRef::from_row_major_slice(of, d, d));
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
        for i in 0..count {
            let row = &self.equations[i * (d + 1)..][..d + 1];
            matrix[i * size..][..d].copy_from_slice(&row[..d]);
            matrix[i * size + d + i] = self.prior.unwrap_or(0.0);
            solution[i] = row[d];
            for (j, e) in self.directions[i * d..][..d].iter().enumerate() {
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
