//! The square root of the information, updated by Givens rotations.

use super::weights::Weights;
use crate::estimator::solver::rank::{Equilibration, check_rank_of_columns};
use faer::MatRef;

/// `R'R = P^-1` with R upper triangular, and `z = R theta`: the equations seen so far, rotated into d rows.
///
/// An equation `y = phi' theta + e` is rotated in after the others are multiplied by `sqrt(lambda)`:
///
/// ```text
///     Q [sqrt(lambda) R   sqrt(lambda) z]  =  [R+   z+]
///       [     phi'              y       ]     [0     r]
/// ```
///
/// which is recursive least squares with forgetting, `P+ = (P - P phi phi' P / (lambda + phi' P phi)) / lambda`, but no
/// matrix is ever subtracted: P stays positive definite whatever is rounded. R = 0 is `P = infinity I`.
///
/// An update takes about 3 d^2 multiplications and additions and d square roots, and a solution d^2 more.
///
/// Source: G. J. Bierman, *Factorization Methods for Discrete Sequential Estimation*, 1977, chapter IV; W. M.
/// Gentleman, Least squares computations by Givens transformations without square roots, J. Inst. Maths Applics 12,
/// 1973.
#[derive(Clone, Debug)]
pub struct SquareRoot {
    d: usize,
    /// d rows of d + 1 numbers: R with z as its last column.
    r: Vec<f64>,
    row: Vec<f64>,
    rows: usize,
    weights: Weights,
    residual_sum: f64,
    determined: bool,
    equilibration: Equilibration,
}

/// Rotates an equation into the rows of `[R z]`; the rest of it is its residual.
#[inline(always)]
fn rotate_in(r: &mut [f64], equation: &mut [f64]) {
    let width = equation.len();
    for (i, row) in r.chunks_exact_mut(width).enumerate() {
        let b = equation[i];
        if b == 0.0 {
            continue;
        }
        let a = row[i];
        let length = (a * a + b * b).sqrt();
        let (cos, sin) = (a / length, b / length);
        row[i] = length;
        for (r, x) in row[i + 1..].iter_mut().zip(&mut equation[i + 1..]) {
            let old = *r;
            *r = cos * old + sin * *x;
            *x = cos * *x - sin * old;
        }
    }
}

impl SquareRoot {
    /// Makes the square root of no information about d parameters.
    pub fn new(d: usize) -> Self {
        Self {
            d,
            r: vec![0.0; d * (d + 1)],
            row: vec![0.0; d + 1],
            rows: 0,
            weights: Weights::default(),
            residual_sum: 0.0,
            determined: d == 0,
            equilibration: Equilibration::new(0, d),
        }
    }

    /// Returns to `P = p0 I` and theta0, or to no information.
    ///
    /// # Panics
    /// If there is a p0 and theta0 is not of length d.
    pub fn restart(&mut self, p0: Option<f64>, theta0: &[f64]) {
        self.r.fill(0.0);
        self.rows = 0;
        self.weights = Weights::default();
        self.residual_sum = 0.0;
        self.determined = self.d == 0 || p0.is_some();
        if let Some(p0) = p0 {
            for i in 0..self.d {
                self.set_weight(i, 1.0 / p0.sqrt(), theta0[i]);
            }
        }
    }

    /// Sets the diagonal element of a row that has no others, with the parameter's value.
    fn set_weight(&mut self, i: usize, weight: f64, theta: f64) {
        let width = self.d + 1;
        self.r[i * width + i] = weight;
        self.r[i * width + self.d] = weight * theta;
    }

    /// Takes over the information of `of`, whose parameter i is parameter `places[i]` here, in ascending order. Other
    /// parameters get this weight, the root of their information, with their values in `theta`; z follows from theta.
    pub(super) fn embed(&mut self, of: &Self, places: &[usize], weight: f64, theta: &[f64]) {
        self.restart(None, &[]);
        for i in 0..self.d {
            self.set_weight(i, weight, theta[i]);
        }
        let width = self.d + 1;
        for (i, row) in places.iter().zip(of.r.chunks_exact(of.d + 1)) {
            for (j, r) in places.iter().zip(row) {
                self.r[i * width + j] = *r;
            }
            let row = &self.r[i * width..][..self.d];
            self.r[i * width + self.d] = super::dot(row, theta);
        }
        self.rows = of.rows;
        self.weights = of.weights;
        self.residual_sum = of.residual_sum;
        self.determined = of.determined;
    }

    /// Rotates an equation in.
    ///
    /// # Panics
    /// If phi is not of length d.
    pub fn update(&mut self, phi: &[f64], y: f64, lambda: f64) {
        let d = self.d;
        self.row[..d].copy_from_slice(phi);
        self.row[d] = y;
        if lambda < 1.0 {
            let root = lambda.sqrt();
            self.r.iter_mut().for_each(|r| *r *= root);
            self.residual_sum *= lambda;
        }
        let (r, equation) = (&mut self.r, &mut self.row);
        with_fma!(|| rotate_in(r, equation));
        self.residual_sum += self.row[d] * self.row[d];
        self.rows += 1;
        self.weights.add(lambda);
        if !self.determined && self.rows >= d {
            self.determined = self.has_full_rank();
        }
    }

    /// The rank rule of all solvers. With the rows the rounding of rotations adds up like independent errors, with the
    /// root of their number.
    fn has_full_rank(&mut self) -> bool {
        let d = self.d;
        let r = MatRef::from_row_major_slice_with_stride(&self.r, d, d, d + 1);
        let growth = (self.rows as f64 / d as f64).sqrt();
        let condition = self.equilibration.of_triangle(r, &mut self.row);
        condition.is_ok_and(|condition| check_rank_of_columns(condition * growth, d).is_ok())
    }

    /// Whether there is a p0, or the equations had full rank at some time.
    pub fn is_determined(&self) -> bool {
        self.determined
    }

    /// Returns the number of equations.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the weights that forgetting left to the equations.
    pub(super) fn weights(&self) -> Weights {
        self.weights
    }

    /// Returns the sum of squared residuals of the solution, each with the weight that forgetting left it.
    pub fn residual_sum(&self) -> f64 {
        self.residual_sum
    }

    /// Solves `R theta = z`.
    ///
    /// # Panics
    /// If theta is not of length d.
    pub fn solve(&self, theta: &mut [f64]) {
        let (d, width) = (self.d, self.d + 1);
        for i in (0..d).rev() {
            let row = &self.r[i * width..][..width];
            let rest = super::dot(&row[i + 1..d], &theta[i + 1..d]);
            theta[i] = (row[d] - rest) / row[i];
        }
    }

    /// Computes `P psi` in place, by two triangular systems.
    ///
    /// # Panics
    /// If psi is not of length d.
    pub fn gain(&self, psi: &mut [f64]) {
        let (d, width) = (self.d, self.d + 1);
        for i in 0..d {
            let row = &self.r[i * width..][..d];
            psi[i] /= row[i];
            let (done, rest) = psi.split_at_mut(i + 1);
            for (x, r) in rest.iter_mut().zip(&row[i + 1..]) {
                *x -= r * done[i];
            }
        }
        for i in (0..d).rev() {
            let row = &self.r[i * width..][..d];
            psi[i] = (psi[i] - super::dot(&row[i + 1..], &psi[i + 1..d])) / row[i];
        }
    }

    /// Fills `information` with `R'R`, row by row, and `products` with `R'z`: Phi'Phi and Phi'y, with the prior's part.
    /// Returns y'y.
    ///
    /// # Panics
    /// If they are not of length d^2 and d.
    pub fn moments(&self, information: &mut [f64], products: &mut [f64]) -> f64 {
        let (d, width) = (self.d, self.d + 1);
        assert!(information.len() == d * d && products.len() == d);
        information.fill(0.0);
        products.fill(0.0);
        let mut power = self.residual_sum;
        for row in self.r.chunks_exact(width) {
            for i in 0..d {
                for (to, r) in information[i * d..].iter_mut().zip(&row[..d]) {
                    *to += row[i] * r;
                }
                products[i] += row[i] * row[d];
            }
            power += row[d] * row[d];
        }
        power
    }

    /// Returns the sum of the diagonal of R, which is not finite once an element was not.
    pub fn size(&self) -> f64 {
        (0..self.d).map(|i| self.r[i * (self.d + 2)]).sum()
    }

    /// Fills `to` with `variance P`, row by row.
    ///
    /// # Panics
    /// If `to` is not of length d^2.
    pub fn covariance(&self, variance: f64, to: &mut [f64]) {
        let (d, width) = (self.d, self.d + 1);
        assert_eq!(to.len(), d * d);
        // The inverse of R, upper triangular.
        for j in 0..d {
            for i in (0..=j).rev() {
                let row = &self.r[i * width..][..d];
                let rest: f64 = (i + 1..=j).map(|m| row[m] * to[m * d + j]).sum();
                let one = if i == j { 1.0 } else { 0.0 };
                to[i * d + j] = (one - rest) / row[i];
            }
        }
        // P_ij needs columns from j on of rows i and j, so nothing is overwritten before it was used.
        for i in 0..d {
            for j in i..d {
                let p: f64 = (j..d).map(|m| to[i * d + m] * to[j * d + m]).sum();
                to[i * d + j] = variance * p;
            }
        }
        for i in 0..d {
            for j in 0..i {
                to[i * d + j] = to[j * d + i];
            }
        }
    }
}
