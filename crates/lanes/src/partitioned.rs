//! Stages 3 and 10 in lock step: p by block elimination without pivoting. Lanes for which that is not safe are solved
//! again with pivots, one by one (`inverses`).
//!
//! Eliminating one block, then the remaining Schur complement of the other, is the partitioned inverse without forming
//! an inverse: r is transformed along, and p follows from the triangles. G22 is eliminated first. It is made of u
//! alone, so it is well conditioned and positive definite; together with G21 and r2 it is the same in every pass of a
//! record. Inverses are formed only if the condition number is wanted.

use super::information::PackedInformation;
use super::{Square, inverses, unrolled};
use asobench_identification::estimator::solver::rank::rank_limit;
use asobench_identification::real::{Mask, Real, Word};
use std::hint::black_box;

/// An elimination is repeated with pivots if its multipliers sum to more than this; it could lose as many digits as
/// this number has.
const LARGEST_MULTIPLIERS: f64 = 256.0;

/// A bound on the condition number below which no exact one is needed for the rank rule.
const SURELY_REGULAR: f64 = 1e10;

/// p of every lane.
#[derive(Clone, Copy)]
pub(crate) struct Parameters<R, const N: usize> {
    /// alpha and beta.
    pub(crate) p: [[R; N]; 2],
    /// The condition number, NaN if not asked for.
    pub(crate) condition: R,
}

/// The triangles from eliminating `[G22 G21; G12 G11] (p2, p1) = (r2, r1)`. y is scaled to about the size of u, so
/// nothing depends on the units of y.
pub(crate) struct Triangles<R, const N: usize> {
    /// U of G22, then `L^-1 G21`.
    top: [Square<R, N>; 2],
    /// U of the Schur complement `G11 - G12 G22^-1 G21`.
    bottom: Square<R, N>,
    /// Reciprocal pivots of both.
    inverse: [[R; N]; 2],
    /// `L^-1 (r2, r1)`.
    r: [[R; N]; 2],
    /// Bounds on the row sums of `|L^-1|`.
    sums: [[R; N]; 2],
    /// The sums of the multipliers' absolute values: up to the end of the top, and up to the end.
    multipliers: [R; 2],
    /// The power of two by which y is multiplied.
    unit: R,
    /// The largest row sum of `|G21|` and `|G22|`.
    input_norm: R,
}

/// A row that is being eliminated, with its right-hand side.
struct Pending<R, const N: usize> {
    left: [R; N],
    right: [R; N],
    r: R,
    sum: R,
    multipliers: R,
}

impl<R: Real, const N: usize> Pending<R, N> {
    /// Subtracts the multiple of pivot row `k` of G22 that makes column k zero.
    #[inline(always)]
    fn eliminate_left(&mut self, n: usize, k: usize, by: &Triangles<R, N>) {
        let factor = self.left[k] * by.inverse[0][k];
        for j in k + 1..n {
            self.left[j] = factor.neg_mul_add(by.top[0][k][j], self.left[j]);
        }
        for j in 0..n {
            self.right[j] = factor.neg_mul_add(by.top[1][k][j], self.right[j]);
        }
        self.account(factor, by.r[0][k], by.sums[0][k]);
    }

    /// Does the same with a pivot row of the Schur complement.
    #[inline(always)]
    fn eliminate_right(&mut self, n: usize, k: usize, by: &Triangles<R, N>) {
        let factor = self.right[k] * by.inverse[1][k];
        for j in k + 1..n {
            self.right[j] = factor.neg_mul_add(by.bottom[k][j], self.right[j]);
        }
        self.account(factor, by.r[1][k], by.sums[1][k]);
    }

    #[inline(always)]
    fn account(&mut self, factor: R, r: R, sum: R) {
        self.r = factor.neg_mul_add(r, self.r);
        self.sum = factor.abs().mul_add(sum, self.sum);
        self.multipliers = self.multipliers + factor.abs();
    }
}

impl<R: Real, const N: usize> Triangles<R, N> {
    pub(crate) fn new() -> Self {
        let square = [[R::zero(); N]; N];
        let pair = [[R::zero(); N]; 2];
        Self {
            top: [square; 2],
            bottom: square,
            inverse: pair,
            r: pair,
            sums: pair,
            multipliers: [R::zero(); 2],
            unit: R::splat(1.0),
            input_norm: R::zero(),
        }
    }

    /// Eliminates G22, once for all passes of a record.
    #[inline(always)]
    pub(crate) fn eliminate_input(&mut self, information: &PackedInformation<R, N>) {
        let n = information.order();
        let one = R::splat(1.0);
        let [g11, _, g21, g22] = &information.g;
        self.unit = unit(g22[0][0], g11[0][0]);
        self.input_norm = norm(n, [g21, g22], self.unit);
        self.multipliers[0] = R::zero();
        unrolled::<N>(
            n,
            #[inline(always)]
            |i| {
                let mut row = Pending {
                    left: g22[i],
                    right: scaled(n, &g21[i], self.unit),
                    r: information.r[1][i] * self.unit,
                    sum: one,
                    multipliers: self.multipliers[0],
                };
                unrolled::<N>(
                    i,
                    #[inline(always)]
                    |k| row.eliminate_left(n, k, self),
                );
                self.inverse[0][i] = one / row.left[i];
                self.top[0][i] = row.left;
                self.top[1][i] = row.right;
                self.keep(0, i, &row);
            },
        );
    }

    /// Eliminates the rest.
    #[inline(always)]
    fn eliminate_output(&mut self, information: &PackedInformation<R, N>) {
        let n = information.order();
        let one = R::splat(1.0);
        let [g11, g12, ..] = &information.g;
        let square = self.unit * self.unit;
        self.multipliers[1] = self.multipliers[0];
        // Not unrolled: the loop's code runs n times while it is in the instruction cache.
        for i in 0..n {
            let mut row = Pending {
                left: scaled(n, &g12[i], self.unit),
                right: scaled(n, &g11[i], square),
                r: information.r[0][i] * square,
                sum: one,
                multipliers: self.multipliers[1],
            };
            // Read the top in place. Moved out of the loop it would be copied, because no register is free.
            let top = black_box(&*self);
            unrolled::<N>(
                n,
                #[inline(always)]
                |k| row.eliminate_left(n, k, top),
            );
            self.bottom[i] = row.right;
            self.keep(1, i, &row);
        }
        unrolled::<N>(
            n,
            #[inline(always)]
            |i| {
                let mut row = Pending {
                    left: [R::zero(); N],
                    right: self.bottom[i],
                    r: self.r[1][i],
                    sum: self.sums[1][i],
                    multipliers: self.multipliers[1],
                };
                unrolled::<N>(
                    i,
                    #[inline(always)]
                    |k| row.eliminate_right(n, k, self),
                );
                self.inverse[1][i] = one / row.right[i];
                self.bottom[i] = row.right;
                self.keep(1, i, &row);
            },
        );
    }

    #[inline(always)]
    fn keep(&mut self, half: usize, i: usize, row: &Pending<R, N>) {
        self.r[half][i] = row.r;
        self.sums[half][i] = row.sum;
        self.multipliers[half] = row.multipliers;
    }

    /// Solves `U (p2, p1) = L^-1 (r2, r1)` for p1 and p2. Also returns a bound on the largest row sum of `|G^-1|`: that
    /// of `|U^-1| |L^-1|` with the triangles' off-diagonal entries taken as negative.
    #[inline(always)]
    fn substitute(&self, n: usize) -> ([[R; N]; 2], R) {
        let [mut p2, mut p1] = self.r;
        let [mut sums2, mut sums1] = self.sums;
        let mut largest = R::zero();
        for i in (0..n).rev() {
            p1[i] = p1[i] * self.inverse[1][i];
            sums1[i] = sums1[i] * self.inverse[1][i].abs();
            largest = larger(largest, sums1[i]);
            for j in 0..i {
                let u = self.bottom[j][i];
                p1[j] = u.neg_mul_add(p1[i], p1[j]);
                sums1[j] = u.abs().mul_add(sums1[i], sums1[j]);
            }
        }
        for i in 0..n {
            for j in 0..n {
                let u = self.top[1][j][i];
                p2[j] = u.neg_mul_add(p1[i], p2[j]);
                sums2[j] = u.abs().mul_add(sums1[i], sums2[j]);
            }
        }
        for i in (0..n).rev() {
            p2[i] = p2[i] * self.inverse[0][i];
            sums2[i] = sums2[i] * self.inverse[0][i].abs();
            largest = larger(largest, sums2[i]);
            for j in 0..i {
                let u = self.top[0][j][i];
                p2[j] = u.neg_mul_add(p2[i], p2[j]);
                sums2[j] = u.abs().mul_add(sums2[i], sums2[j]);
            }
        }
        ([p1, scaled(n, &p2, R::splat(1.0) / self.unit)], largest)
    }
}

/// Returns the larger number.
#[inline(always)]
fn larger<R: Real>(x: R, y: R) -> R {
    R::select(x.less(y), y, x)
}

/// Returns the largest row sum of `|left| unit + |right|`.
#[inline(always)]
fn norm<R: Real, const N: usize>(n: usize, [left, right]: [&Square<R, N>; 2], unit: R) -> R {
    let mut largest = R::zero();
    for i in 0..n {
        let (mut of_left, mut of_right) = (R::zero(), R::zero());
        for j in 0..n {
            of_left = of_left + left[i][j].abs();
            of_right = of_right + right[i][j].abs();
        }
        largest = larger(largest, of_left.mul_add(unit, of_right));
    }
    largest
}

/// Returns a power of two near `sqrt(of_u / of_y)`, or 1 if its square could overflow or underflow.
#[inline(always)]
fn unit<R: Real>(of_u: R, of_y: R) -> R {
    // This is 2^500.
    const LIMIT: f64 = 3.273_390_607_896_141_6e150;
    let ratio = (of_u / of_y).sqrt();
    let fits = R::splat(1.0 / LIMIT).less(ratio) & ratio.less(R::splat(LIMIT));
    let power = R::from_bits(ratio.to_bits() & R::Word::splat(0x7ff << 52));
    R::select(fits, power, R::splat(1.0))
}

#[inline(always)]
fn scaled<R: Real, const N: usize>(n: usize, values: &[R; N], by: R) -> [R; N] {
    let mut to = [R::zero(); N];
    for i in 0..n {
        to[i] = values[i] * by;
    }
    to
}

/// Solves all lanes; must follow [`Triangles::eliminate_input`]. The mask holds the lanes whose numbers must not be
/// used; see [`inverses::solve_alone`].
#[inline(always)]
pub(crate) fn solve<R: Real, const N: usize>(
    information: &PackedInformation<R, N>,
    by: &mut Triangles<R, N>,
    with_condition: bool,
) -> (Parameters<R, N>, R::Mask) {
    let n = information.order();
    by.eliminate_output(information);
    let (p, inverse_bound) = by.substitute(n);
    let tame = by.multipliers[1].at_most(R::splat(LARGEST_MULTIPLIERS));
    // Half the limit of the rank rule: cases closer to the limit are decided with pivots, one lane at a time.
    let limit = R::splat(0.5 / rank_limit(n));
    let (condition, regular) = if with_condition {
        let condition = inverses::condition(information);
        (condition, condition.less(limit))
    } else {
        let [g11, g12, ..] = &information.g;
        let of_output = norm(n, [g11, g12], by.unit) * by.unit;
        let bound = larger(of_output, by.input_norm) * inverse_bound;
        let mut regular = bound.less(R::splat(SURELY_REGULAR));
        if (!regular).any() {
            regular = regular | inverses::condition(information).less(limit);
        }
        (R::splat(f64::NAN), regular)
    };
    (Parameters { p, condition }, !(tame & regular))
}
