//! Stages 3 and 10 by the two inverses of [`asobench_identification::estimator::solver::Partitioned`]: the condition
//! number of all lanes, and p of a lane for which elimination without pivots is not safe.

use super::Square;
use super::information::PackedInformation;
use asobench_identification::estimator::FailureKind;
use asobench_identification::estimator::solver::rank::check_rank;
use asobench_identification::real::{Real, Word};
use std::convert::Infallible;

/// p of a lane that was solved alone, and its condition number, NaN if unknown.
pub(crate) type Single<const N: usize> = (Result<[[f64; N]; 2], FailureKind>, f64);

/// The inverses from which p and the condition number are computed.
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

impl<R: Real, const N: usize> Inverses<R, N> {
    /// Computes the inverses; `invert` overwrites a matrix by its inverse.
    #[inline(always)]
    fn new<E>(
        information: &PackedInformation<R, N>,
        mut invert: impl FnMut(usize, &mut Square<R, N>) -> Result<(), E>,
    ) -> Result<Self, E> {
        let n = information.order();
        let [g11, g12, g21, g22] = &information.g;
        let zero = [[R::zero(); N]; N];
        let (mut m1, mut m1_g12, mut schur) = (*g11, zero, zero);
        invert(n, &mut m1)?;
        product::<false, R, N>(n, None, &m1, g12, &mut m1_g12);
        product::<true, R, N>(n, Some(g22), g21, &m1_g12, &mut schur);
        let mut m2 = schur;
        invert(n, &mut m2)?;
        Ok(Self { m1, m1_g12, schur, m2 })
    }
}

/// Does step k of Gauss-Jordan elimination; the inverse overwrites the matrix.
#[inline(always)]
fn eliminate<R: Real, const N: usize>(n: usize, k: usize, a: &mut Square<R, N>) {
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

/// Overwrites `a` by its inverse, with row pivots.
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
        eliminate(n, k, a);
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

/// Computes `out <- c + sign a b`; c is zero if absent.
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

/// Computes `c + a x`, or `c - a x`.
#[inline(always)]
fn apply<const MINUS: bool, R: Real, const N: usize>(n: usize, c: &[R; N], a: &Square<R, N>, x: &[R; N]) -> [R; N] {
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

/// Computes p1 and p2: `q = M1 r1`, `p2 = M2 (r2 - G21 q)`, `p1 = q - M1 G12 p2`.
#[inline(always)]
fn parameters<R: Real, const N: usize>(information: &PackedInformation<R, N>, by: &Inverses<R, N>) -> [[R; N]; 2] {
    let n = information.order();
    let zero = [R::zero(); N];
    let [r1, r2] = &information.r;
    let q = apply::<false, R, N>(n, &zero, &by.m1, r1);
    let rest = apply::<true, R, N>(n, r2, &information.g[2], &q);
    let p2 = apply::<false, R, N>(n, &zero, &by.m2, &rest);
    [apply::<true, R, N>(n, &q, &by.m1_g12, &p2), p2]
}

/// Returns the power of two s with `s x` in [1, 2).
#[inline(always)]
fn inverse_power_of_two<R: Real>(x: R) -> R {
    let exponent = x.to_bits() & R::Word::splat(0x7ff << 52);
    R::from_bits(R::Word::splat(2046 << 52).minus(exponent))
}

/// Returns the condition number as [`asobench_identification::estimator::solver::Partitioned`] defines it. Not finite
/// if G is not finite or has a zero row or column.
#[inline(always)]
fn condition_by<R: Real, const N: usize>(information: &PackedInformation<R, N>, by: &Inverses<R, N>) -> R {
    let n = information.order();
    let [g11, g12, g21, g22] = &information.g;
    let Inverses { m1, m1_g12, schur, m2 } = by;
    let zero = [[R::zero(); N]; N];
    let (mut g21_m1, mut m2_g21_m1, mut c11, mut c12) = (zero, zero, zero, zero);
    product::<false, R, N>(n, None, g21, m1, &mut g21_m1);
    product::<false, R, N>(n, None, m2, &g21_m1, &mut m2_g21_m1);
    product::<false, R, N>(n, Some(m1), m1_g12, &m2_g21_m1, &mut c11);
    product::<false, R, N>(n, None, m1_g12, m2, &mut c12);
    // Norms do not depend on signs.
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

/// Returns the condition number of all lanes, by inverses without pivots; see [`condition_by`].
///
/// It is a separate function because most solves do not need its matrices, which take 28 KB of stack.
#[inline(never)]
pub(super) fn condition<R: Real, const N: usize>(information: &PackedInformation<R, N>) -> R {
    R::run(
        #[inline(always)]
        || {
            let Ok(by) = Inverses::new(
                information,
                #[inline(always)]
                |n, a| {
                    for k in 0..n {
                        eliminate(n, k, a);
                    }
                    Ok::<(), Infallible>(())
                },
            );
            condition_by(information, &by)
        },
    )
}

/// Solves one lane with pivots; returns p or its failure, and its condition number.
pub(crate) fn solve_alone<R: Real, const N: usize>(information: &PackedInformation<R, N>, lane: usize) -> Single<N> {
    let information = information.lane(lane);
    f64::run(
        #[inline(always)]
        || solve_pivoted(&information),
    )
}

#[inline(always)]
fn solve_pivoted<const N: usize>(information: &PackedInformation<f64, N>) -> Single<N> {
    let n = information.order();
    let unknown = |kind| (Err(kind), f64::NAN);
    let finite = |block: &Square<f64, N>| block.as_flattened().iter().all(|x| x.is_finite());
    if !information.g.iter().all(finite) {
        return unknown(FailureKind::NonFinite);
    }
    let [g11, g12, g21, g22] = &information.g;
    let zero_row =
        |left: &Square<f64, N>, right: &Square<f64, N>, i: usize| left[i].iter().chain(&right[i]).all(|x| *x == 0.0);
    let zero_column =
        |above: &Square<f64, N>, below: &Square<f64, N>, j: usize| above.iter().chain(below).all(|row| row[j] == 0.0);
    let singular = (0..n).any(|i| {
        zero_row(g11, g12, i) || zero_row(g21, g22, i) || zero_column(g11, g21, i) || zero_column(g12, g22, i)
    });
    if singular {
        return unknown(FailureKind::Singular);
    }
    match Inverses::new(information, invert_pivoted) {
        Ok(by) => {
            let condition = condition_by(information, &by);
            let p = parameters(information, &by);
            (check_rank(condition, n).map(|()| p), condition)
        }
        Err(kind) => unknown(kind),
    }
}
