//! Stages 3 and 10 in lock step: p by elimination in blocks, without pivoting; lanes where that is not safe are solved
//! again with pivots, one by one, by the two inverses of [`crate::estimator::solver::Partitioned`].
//!
//! Eliminating one block, then the Schur complement that is left in the place of the other, is the partitioned inverse
//! without forming an inverse: r goes along, and p follows from the triangles. The block that goes first is G22: it is
//! made of u alone, so it is well conditioned, positive definite, and with G21 and r2 the same in every pass of a record.
//! The inverses, and `C = G^-1`, are formed where the condition number is asked for.

use super::information::Information;
use super::{Square, each};
use crate::estimator::FailureKind;
use crate::estimator::solver::condition::{RANK_MULTIPLE, check_rank};
use crate::real::{Mask, Real, Word};

/// Eliminations whose multipliers sum up to more are done again with pivots: they lose up to as many digits.
const LARGEST_MULTIPLIERS: f64 = 256.0;

/// A bound on the condition number below which no exact one is needed for the rank rule.
const SURELY_REGULAR: f64 = 1e10;

/// p of every lane.
#[derive(Clone, Copy)]
pub(crate) struct Parameters<R, const N: usize> {
    /// alpha and beta.
    pub(crate) p: [[R; N]; 2],
    /// The condition number, NaN where it was not asked for.
    pub(crate) condition: R,
}

/// p of a lane that was solved alone, and its condition number, NaN where it is not known.
pub(crate) type Single<const N: usize> = (Result<[[f64; N]; 2], FailureKind>, f64);

/// The triangles that an elimination leaves of `[G22 G21; G12 G11] (p2, p1) = (r2, r1)`, y counted in units in which it
/// is about as large as u: so nothing depends on the units that it came in.
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
    /// The sums of the multipliers' absolute values: to the end of the top, and to the end.
    multipliers: [R; 2],
    /// A power of two, which y is multiplied by.
    unit: R,
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

    /// The same with the Schur complement.
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
        }
    }

    /// Eliminates G22: once for all passes of a record.
    #[inline(always)]
    pub(crate) fn eliminate_input(&mut self, of: &Information<R, N>) {
        let n = of.order();
        let one = R::splat(1.0);
        let [g11, _, g21, g22] = &of.g;
        self.unit = unit(g22[0][0], g11[0][0]);
        self.multipliers[0] = R::zero();
        each::<N>(
            n,
            #[inline(always)]
            |i| {
                let mut row = Pending {
                    left: g22[i],
                    right: scaled(n, &g21[i], self.unit),
                    r: of.r[1][i] * self.unit,
                    sum: one,
                    multipliers: self.multipliers[0],
                };
                each::<N>(
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
    fn eliminate_output(&mut self, of: &Information<R, N>) {
        let n = of.order();
        let one = R::splat(1.0);
        let [g11, g12, ..] = &of.g;
        let square = self.unit * self.unit;
        self.multipliers[1] = self.multipliers[0];
        // A loop, not written out: its code runs n times while it is in the instruction cache.
        for i in 0..n {
            let mut row = Pending {
                left: scaled(n, &g12[i], self.unit),
                right: scaled(n, &g11[i], square),
                r: of.r[0][i] * square,
                sum: one,
                multipliers: self.multipliers[1],
            };
            each::<N>(
                n,
                #[inline(always)]
                |k| row.eliminate_left(n, k, self),
            );
            self.bottom[i] = row.right;
            self.keep(1, i, &row);
        }
        each::<N>(
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
                each::<N>(
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

    /// p1 and p2 by `U (p2, p1) = L^-1 (r2, r1)`.
    #[inline(always)]
    fn parameters(&self, n: usize) -> [[R; N]; 2] {
        let [mut p2, mut p1] = self.r;
        for i in (0..n).rev() {
            p1[i] = p1[i] * self.inverse[1][i];
            for j in 0..i {
                p1[j] = self.bottom[j][i].neg_mul_add(p1[i], p1[j]);
            }
        }
        for i in 0..n {
            for j in 0..n {
                p2[j] = self.top[1][j][i].neg_mul_add(p1[i], p2[j]);
            }
        }
        for i in (0..n).rev() {
            p2[i] = p2[i] * self.inverse[0][i];
            for j in 0..i {
                p2[j] = self.top[0][j][i].neg_mul_add(p2[i], p2[j]);
            }
        }
        [p1, scaled(n, &p2, R::splat(1.0) / self.unit)]
    }

    /// A bound on `|| G^-1 ||`, rows summed: `|U^-1| |L^-1|` with the triangles' off-diagonal entries taken as negative.
    #[inline(always)]
    fn inverse_bound(&self, n: usize) -> R {
        let [mut top, mut bottom] = self.sums;
        let mut largest = R::zero();
        for i in (0..n).rev() {
            bottom[i] = bottom[i] * self.inverse[1][i].abs();
            largest = larger(largest, bottom[i]);
            for j in 0..i {
                bottom[j] = self.bottom[j][i].abs().mul_add(bottom[i], bottom[j]);
            }
        }
        for i in 0..n {
            for j in 0..n {
                top[j] = self.top[1][j][i].abs().mul_add(bottom[i], top[j]);
            }
        }
        for i in (0..n).rev() {
            top[i] = top[i] * self.inverse[0][i].abs();
            largest = larger(largest, top[i]);
            for j in 0..i {
                top[j] = self.top[0][j][i].abs().mul_add(top[i], top[j]);
            }
        }
        largest
    }
}

/// The inverses that the condition number is made of.
struct Inverses<R, const N: usize> {
    /// `G11^-1`.
    m1: Square<R, N>,
    /// `G11^-1 G12`.
    m1_g12: Square<R, N>,
    /// The Schur complement `G22 - G21 G11^-1 G12`.
    schur: Square<R, N>,
    /// Its inverse.
    m2: Square<R, N>,
}

/// `a <- a^-1` by Gauss and Jordan without pivots.
#[inline(always)]
fn invert<R: Real, const N: usize>(n: usize, a: &mut Square<R, N>) {
    for k in 0..n {
        let inverse = R::splat(1.0) / a[k][k];
        let pivot_row = a[k];
        for i in 0..n {
            if i == k {
                continue;
            }
            let factor = a[i][k] * inverse;
            for j in 0..n {
                a[i][j] = factor.neg_mul_add(pivot_row[j], a[i][j]);
            }
            a[i][k] = -factor;
        }
        for j in 0..n {
            a[k][j] = pivot_row[j] * inverse;
        }
        a[k][k] = inverse;
    }
}

impl<R: Real, const N: usize> Inverses<R, N> {
    #[inline(always)]
    fn new() -> Self {
        let zero = [[R::zero(); N]; N];
        Self {
            m1: zero,
            m1_g12: zero,
            schur: zero,
            m2: zero,
        }
    }
}

/// The same with row pivots.
#[inline(always)]
fn invert_pivoted<const N: usize>(n: usize, a: &mut Square<f64, N>) -> Result<(), FailureKind> {
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    for k in 0..n {
        let mut pivot = k;
        for i in k + 1..n {
            if a[i][k].abs() > a[pivot][k].abs() {
                pivot = i;
            }
        }
        a.swap(k, pivot);
        order.swap(k, pivot);
        if a[k][k] == 0.0 {
            return Err(FailureKind::RankDeficient);
        }
        if !a[k][k].is_finite() {
            return Err(FailureKind::NonFinite);
        }
        let inverse = 1.0 / a[k][k];
        let pivot_row = a[k];
        for i in (0..n).filter(|i| *i != k) {
            let factor = a[i][k] * inverse;
            for j in 0..n {
                a[i][j] = (-factor).mul_add(pivot_row[j], a[i][j]);
            }
            a[i][k] = -factor;
        }
        for j in 0..n {
            a[k][j] = pivot_row[j] * inverse;
        }
        a[k][k] = inverse;
    }
    // Row exchanges of a are column exchanges of its inverse.
    for row in &mut a[..n] {
        let from = *row;
        for j in 0..n {
            row[order[j]] = from[j];
        }
    }
    Ok(())
}

/// `out <- c + sign a b`, c zero where there is none.
#[inline(always)]
fn product<const MINUS: bool, R: Real, const N: usize>(
    n: usize,
    c: Option<&Square<R, N>>,
    a: &Square<R, N>,
    b: &Square<R, N>,
    out: &mut Square<R, N>,
) {
    for i in 0..n {
        let mut row = [R::zero(); N];
        if let Some(c) = c {
            row = c[i];
        }
        for l in 0..n {
            let factor = a[i][l];
            for j in 0..n {
                row[j] = if MINUS {
                    factor.neg_mul_add(b[l][j], row[j])
                } else {
                    factor.mul_add(b[l][j], row[j])
                };
            }
        }
        out[i] = row;
    }
}

/// `c + a x`, or `c - a x`.
#[inline(always)]
fn apply<const MINUS: bool, R: Real, const N: usize>(
    n: usize,
    c: &[R; N],
    a: &Square<R, N>,
    x: &[R; N],
) -> [R; N] {
    let mut out = *c;
    for j in 0..n {
        for i in 0..n {
            out[i] = if MINUS {
                a[i][j].neg_mul_add(x[j], out[i])
            } else {
                a[i][j].mul_add(x[j], out[i])
            };
        }
    }
    out
}

/// What a solve needs of the blocks, by the inverses of `G11` and of the Schur complement.
#[inline(always)]
fn parameters<R: Real, const N: usize>(of: &Information<R, N>, by: &Inverses<R, N>) -> [[R; N]; 2] {
    let n = of.order();
    let zero = [R::zero(); N];
    let [r1, r2] = &of.r;
    let q = apply::<false, R, N>(n, &zero, &by.m1, r1);
    let rest = apply::<true, R, N>(n, r2, &of.g[2], &q);
    let p2 = apply::<false, R, N>(n, &zero, &by.m2, &rest);
    [apply::<true, R, N>(n, &q, &by.m1_g12, &p2), p2]
}

/// The larger one.
#[inline(always)]
fn larger<R: Real>(x: R, y: R) -> R {
    R::select(x.less(y), y, x)
}

/// `|| G ||`, rows summed, in the triangles' units.
#[inline(always)]
fn norm<R: Real, const N: usize>(of: &Information<R, N>, unit: R) -> R {
    let n = of.order();
    let mut largest = R::zero();
    for half in 0..2 {
        for i in 0..n {
            let (mut left, mut right) = (R::zero(), R::zero());
            for j in 0..n {
                left = left + of.g[2 * half][i][j].abs();
                right = right + of.g[2 * half + 1][i][j].abs();
            }
            let sum = left.mul_add(unit, right);
            largest = larger(largest, if half == 0 { sum * unit } else { sum });
        }
    }
    largest
}

/// A power of two near `sqrt(of_u / of_y)`, 1 where that is none that could be squared.
#[inline(always)]
fn unit<R: Real>(of_u: R, of_y: R) -> R {
    // 2^500.
    const LIMIT: f64 = 3.273_390_607_896_141_6e150;
    let ratio = (of_u / of_y).sqrt();
    let fits = R::splat(1.0 / LIMIT).less(ratio) & ratio.less(R::splat(LIMIT));
    let power = R::from_bits(ratio.to_bits() & R::Word::splat(0x7ff << 52));
    R::select(fits, power, R::splat(1.0))
}

#[inline(always)]
fn scaled<R: Real, const N: usize>(n: usize, of: &[R; N], by: R) -> [R; N] {
    let mut to = [R::zero(); N];
    for i in 0..n {
        to[i] = of[i] * by;
    }
    to
}

/// The power of two s with `s x` in [1, 2).
#[inline(always)]
fn inverse_power_of_two<R: Real>(x: R) -> R {
    let exponent = x.to_bits() & R::Word::splat(0x7ff << 52);
    R::from_bits(R::Word::splat(2046 << 52).minus(exponent))
}

/// The condition number as [`crate::estimator::solver::Partitioned`] defines it; not finite where G is not or has a
/// zero row or column.
#[inline(always)]
fn condition<R: Real, const N: usize>(of: &Information<R, N>, by: &Inverses<R, N>) -> R {
    let n = of.order();
    let [g11, g12, g21, g22] = &of.g;
    let Inverses {
        m1,
        m1_g12,
        schur,
        m2,
    } = by;
    let zero = [[R::zero(); N]; N];
    let (mut g21_m1, mut m2_g21_m1, mut c11, mut c12) = (zero, zero, zero, zero);
    product::<false, R, N>(n, None, g21, m1, &mut g21_m1);
    product::<false, R, N>(n, None, m2, &g21_m1, &mut m2_g21_m1);
    product::<false, R, N>(n, Some(m1), m1_g12, &m2_g21_m1, &mut c11);
    product::<false, R, N>(n, None, m1_g12, m2, &mut c12);
    // Signs do not matter in norms.
    let g = [[g11, g12], [g21, g22]];
    let c = [[&c11, &c12], [&m2_g21_m1, m2]];

    let mut rows = [[R::zero(); N]; 2];
    for half in 0..2 {
        for i in 0..n {
            let mut row = R::zero();
            for block in g[half] {
                for j in 0..n {
                    row = row.maximum(block[i][j].abs());
                }
            }
            rows[half][i] = inverse_power_of_two(row);
        }
    }
    let mut columns = [[R::zero(); N]; 2];
    let (mut norm, mut inverse_norm) = (R::zero(), R::zero());
    let (mut schur_norm, mut schur_inverse, mut pivot_inverse) = (R::zero(), R::zero(), R::zero());
    for half in 0..2 {
        for j in 0..n {
            let (mut size, mut sum) = (R::zero(), R::zero());
            for above in 0..2 {
                for i in 0..n {
                    let entry = g[above][half][i][j].abs() * rows[above][i];
                    size = size.maximum(entry);
                    sum = sum + entry;
                }
            }
            columns[half][j] = inverse_power_of_two(size);
            norm = norm.maximum(sum * columns[half][j]);
        }
    }
    let one = R::splat(1.0);
    let (mut unscale_rows, mut unscale_columns) = (rows, columns);
    for half in 0..2 {
        for i in 0..n {
            unscale_rows[half][i] = one / rows[half][i];
            unscale_columns[half][i] = one / columns[half][i];
        }
    }
    for half in 0..2 {
        for j in 0..n {
            let mut sum = R::zero();
            for above in 0..2 {
                for i in 0..n {
                    let entry = c[above][half][i][j].abs();
                    sum = entry.mul_add(unscale_columns[above][i], sum);
                }
            }
            inverse_norm = inverse_norm.maximum(sum * unscale_rows[half][j]);
        }
    }
    for j in 0..n {
        let (mut of_schur, mut of_m2, mut of_m1) = (R::zero(), R::zero(), R::zero());
        for i in 0..n {
            of_schur = schur[i][j].abs().mul_add(rows[1][i], of_schur);
            of_m2 = m2[i][j].abs().mul_add(unscale_columns[1][i], of_m2);
            of_m1 = m1[i][j].abs().mul_add(unscale_columns[0][i], of_m1);
        }
        schur_norm = schur_norm.maximum(of_schur * columns[1][j]);
        schur_inverse = schur_inverse.maximum(of_m2 * unscale_rows[1][j]);
        pivot_inverse = pivot_inverse.maximum(of_m1 * unscale_rows[0][j]);
    }
    (norm * inverse_norm.maximum(pivot_inverse)).maximum(schur_norm * schur_inverse)
}

/// The reciprocal condition below which a matrix is rank deficient.
fn rank_limit(order: usize) -> f64 {
    RANK_MULTIPLE * 2.0 * order as f64 * f64::EPSILON
}

/// Solves all lanes, after [`Triangles::eliminate_input`]; the mask holds those whose numbers must not be used: see
/// [`solve_alone`].
#[inline(always)]
pub(crate) fn solve<R: Real, const N: usize>(
    of: &Information<R, N>,
    by: &mut Triangles<R, N>,
    with_condition: bool,
) -> (Parameters<R, N>, R::Mask) {
    let n = of.order();
    by.eliminate_output(of);
    let p = by.parameters(n);
    let tame = by.multipliers[1].at_most(R::splat(LARGEST_MULTIPLIERS));
    // Half the rank rule's limit: what is nearer is judged alone.
    let limit = R::splat(0.5 / rank_limit(n));
    let (condition, regular) = if with_condition {
        let condition = unpivoted_condition(of);
        (condition, condition.less(limit))
    } else {
        let bound = norm(of, by.unit) * by.inverse_bound(n);
        let mut regular = bound.less(R::splat(SURELY_REGULAR));
        if (!regular).any() {
            regular = regular | unpivoted_condition(of).less(limit);
        }
        (R::splat(f64::NAN), regular)
    };
    (Parameters { p, condition }, !(tame & regular))
}

#[inline(always)]
fn unpivoted_condition<R: Real, const N: usize>(of: &Information<R, N>) -> R {
    let n = of.order();
    let [g11, g12, g21, g22] = &of.g;
    let mut by = Inverses::new();
    by.m1 = *g11;
    invert(n, &mut by.m1);
    product::<false, R, N>(n, None, &by.m1, g12, &mut by.m1_g12);
    product::<true, R, N>(n, Some(g22), g21, &by.m1_g12, &mut by.schur);
    by.m2 = by.schur;
    invert(n, &mut by.m2);
    condition(of, &by)
}

/// One lane with pivots, its condition number and its failure.
pub(crate) fn solve_alone<R: Real, const N: usize>(
    of: &Information<R, N>,
    lane: usize,
) -> Single<N> {
    let of = of.lane(lane);
    f64::run(
        #[inline(always)]
        || solve_pivoted(&of),
    )
}

#[inline(always)]
fn solve_pivoted<const N: usize>(of: &Information<f64, N>) -> Single<N> {
    let n = of.order();
    let unknown = |kind| (Err(kind), f64::NAN);
    let finite = |block: &Square<f64, N>| block.as_flattened().iter().all(|x| x.is_finite());
    if !of.g.iter().all(finite) {
        return unknown(FailureKind::NonFinite);
    }
    let [g11, g12, g21, g22] = &of.g;
    let zero_row = |left: &Square<f64, N>, right: &Square<f64, N>, i: usize| {
        left[i].iter().chain(&right[i]).all(|x| *x == 0.0)
    };
    let zero_column = |above: &Square<f64, N>, below: &Square<f64, N>, j: usize| {
        above.iter().chain(below).all(|row| row[j] == 0.0)
    };
    let singular = (0..n).any(|i| {
        zero_row(g11, g12, i)
            || zero_row(g21, g22, i)
            || zero_column(g11, g21, i)
            || zero_column(g12, g22, i)
    });
    if singular {
        return unknown(FailureKind::Singular);
    }
    let mut by = Inverses::new();
    by.m1 = *g11;
    if let Err(kind) = invert_pivoted(n, &mut by.m1) {
        return unknown(kind);
    }
    product::<false, f64, N>(n, None, &by.m1, g12, &mut by.m1_g12);
    product::<true, f64, N>(n, Some(g22), g21, &by.m1_g12, &mut by.schur);
    by.m2 = by.schur;
    if let Err(kind) = invert_pivoted(n, &mut by.m2) {
        return unknown(kind);
    }
    let p = parameters(of, &by);
    let condition = condition(of, &by);
    (check_rank(condition, n).map(|()| p), condition)
}
