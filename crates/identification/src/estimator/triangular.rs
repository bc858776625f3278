//! Equations of a triangle R, of one vector or of several side by side with the same bits.

use faer::MatRef;

/// Computes `x = (R'R)^-1 x`.
pub(super) fn solve_normal(r: MatRef<'_, f64>, x: &mut [f64]) {
    solve_normal_of(r, x.as_chunks_mut::<1>().0);
}

/// Computes `x = R^-T x`.
pub(super) fn solve_transposed(r: MatRef<'_, f64>, x: &mut [f64]) {
    solve_transposed_of(r, x.as_chunks_mut::<1>().0);
}

/// Computes `x = (R'R)^-1 x` for L vectors side by side.
#[inline(always)]
pub(super) fn solve_normal_of<const L: usize>(r: MatRef<'_, f64>, x: &mut [[f64; L]]) {
    solve_transposed_of(r, x);
    for i in (0..x.len()).rev() {
        let (x, later) = x[i..].split_first_mut().expect("i is below its length");
        eliminate(x, later, (i + 1..).map(|j| r[(i, j)]), r[(i, i)]);
    }
}

/// Computes `x = R^-T x` for L vectors side by side.
#[inline(always)]
pub(super) fn solve_transposed_of<const L: usize>(r: MatRef<'_, f64>, x: &mut [[f64; L]]) {
    for i in 0..x.len() {
        let (before, x) = x.split_at_mut(i);
        eliminate(&mut x[0], before, (0..).map(|j| r[(j, i)]), r[(i, i)]);
    }
}

/// Returns the sum of `factor * x` over some vectors x.
#[inline(always)]
pub(super) fn sum_of_products<'a, const L: usize>(terms: impl Iterator<Item = (f64, &'a [f64; L])>) -> [f64; L] {
    let mut sum = [-0.0; L];
    for (factor, x) in terms {
        sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += factor * x);
    }
    sum
}

/// Computes `x = (x - sum of factor * known) / pivot`.
#[inline(always)]
fn eliminate<const L: usize>(x: &mut [f64; L], known: &[[f64; L]], factors: impl Iterator<Item = f64>, pivot: f64) {
    let sum = sum_of_products(known.iter().zip(factors).map(|(x, factor)| (factor, x)));
    x.iter_mut().zip(sum).for_each(|(x, sum)| *x = (*x - sum) / pivot);
}
