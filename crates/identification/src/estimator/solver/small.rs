//! Inverses of small matrices: faer's sums with faer's bits, without its preparations, which take several times as
//! long as the sums for a matrix of order 6.
//!
//! Where faer has fused multiply-add instructions its kernels add products one after the other, each fused, and its
//! recursions split a matrix in halves. So does this; the tests compare bits.

use crate::estimator::FailureKind;
use crate::real::with_fma;
use faer::{MatMut, MatRef};

/// The largest order.
const MOST: usize = 8;

/// Columns.
type Square<const N: usize> = [[f64; N]; N];

#[inline(always)]
fn load<const N: usize>(from: MatRef<'_, f64>) -> Square<N> {
    assert!(from.nrows() == N && from.ncols() == N);
    let mut to = [[0.0; N]; N];
    for (j, column) in to.iter_mut().enumerate() {
        for (i, x) in column.iter_mut().enumerate() {
            *x = from[(i, j)];
        }
    }
    to
}

/// The sum of columns with these factors.
#[inline(always)]
fn combine<const N: usize>(columns: &Square<N>, factors: &[f64; N]) -> [f64; N] {
    let mut sums = columns[0].map(|x| x * factors[0]);
    for (column, factor) in columns.iter().zip(factors).skip(1) {
        for (sum, x) in sums.iter_mut().zip(column) {
            *sum = x.mul_add(*factor, *sum);
        }
    }
    sums
}

/// Computes `out = A^-1` by LU with partial pivoting; `None`: A is not small.
pub(super) fn invert(a: MatRef<'_, f64>, out: MatMut<'_, f64>) -> Option<Result<(), FailureKind>> {
    with_fma(
        #[inline(always)]
        || match a.nrows() {
            2 => Some(invert_of::<2>(a, out)),
            3 => Some(invert_of::<3>(a, out)),
            4 => Some(invert_of::<4>(a, out)),
            5 => Some(invert_of::<5>(a, out)),
            6 => Some(invert_of::<6>(a, out)),
            7 => Some(invert_of::<7>(a, out)),
            8 => Some(invert_of::<8>(a, out)),
            _ => None,
        },
    )
}

#[inline(always)]
fn invert_of<const N: usize>(
    a: MatRef<'_, f64>,
    mut out: MatMut<'_, f64>,
) -> Result<(), FailureKind> {
    assert!(out.nrows() == N && out.ncols() == N);
    let mut lu: Square<N> = load(a);
    let places = factorise(&mut lu);
    for (i, column) in lu.iter().enumerate() {
        if column[i] == 0.0 {
            return Err(FailureKind::RankDeficient);
        }
        if !column[i].is_finite() {
            return Err(FailureKind::NonFinite);
        }
    }
    let (mut lower, mut upper) = ([[0.0; N]; N], [[0.0; N]; N]);
    for (i, column) in lower.iter_mut().enumerate() {
        column[i] = 1.0;
    }
    Triangle::<N, true>::invert(0, N, &lu, &mut lower);
    Triangle::<N, false>::invert(0, N, &lu, &mut upper);
    for (place, factors) in places.into_iter().zip(&lower) {
        for (i, x) in combine(&upper, factors).into_iter().enumerate() {
            out[(i, place)] = x;
        }
    }
    Ok(())
}

/// Replaces A by L, whose diagonal is 1, and U of `P A = L U`; returns which row of A became each row.
#[inline(always)]
fn factorise<const N: usize>(lu: &mut Square<N>) -> [usize; N] {
    let mut places = std::array::from_fn(|i| i);
    for j in 0..N {
        let (mut best, mut largest) = (j, 0.0);
        for i in j..N {
            let size = lu[j][i].abs();
            if size > largest {
                (best, largest) = (i, size);
            }
        }
        if best != j {
            places.swap(j, best);
            for column in &mut *lu {
                column.swap(j, best);
            }
        }
        let inverse = lu[j][j].recip();
        for i in j + 1..N {
            lu[j][i] *= inverse;
        }
        let pivots = lu[j];
        for column in &mut lu[j + 1..] {
            let factor = -column[j];
            for i in j + 1..N {
                column[i] = pivots[i].mul_add(factor, column[i]);
            }
        }
    }
    places
}

/// The inverse of the lower triangle, whose diagonal is 1, or of the upper one, which is a lower one whose rows and
/// columns are counted from the end.
struct Triangle<const N: usize, const LOWER: bool>;

/// The most rows of half a matrix.
const HALF: usize = MOST / 2;

impl<const N: usize, const LOWER: bool> Triangle<N, LOWER> {
    #[inline(always)]
    fn at(m: &Square<N>, i: usize, j: usize) -> f64 {
        if LOWER {
            m[j][i]
        } else {
            m[N - 1 - j][N - 1 - i]
        }
    }

    #[inline(always)]
    fn put(m: &mut Square<N>, i: usize, j: usize, x: f64) {
        if LOWER {
            m[j][i] = x;
        } else {
            m[N - 1 - j][N - 1 - i] = x;
        }
    }

    /// Inverts the block of n rows from the row `first` on.
    #[inline(always)]
    fn invert(first: usize, n: usize, from: &Square<N>, to: &mut Square<N>) {
        if n <= 2 {
            return Self::invert_least(first, n, from, to);
        }
        let (half, second) = (n / 2, first + n / 2);
        Self::invert_half(first, half, from, to);
        Self::invert_half(second, n - half, from, to);
        Self::below(first, half, n - half, from, to);
    }

    #[inline(always)]
    fn invert_half(first: usize, n: usize, from: &Square<N>, to: &mut Square<N>) {
        if n <= 2 {
            return Self::invert_least(first, n, from, to);
        }
        let (half, second) = (n / 2, first + n / 2);
        Self::invert_least(first, half, from, to);
        Self::invert_least(second, n - half, from, to);
        Self::below(first, half, n - half, from, to);
    }

    #[inline(always)]
    fn invert_least(first: usize, n: usize, from: &Square<N>, to: &mut Square<N>) {
        let at = |i: usize, j: usize| Self::at(from, first + i, first + j);
        if LOWER {
            if n == 2 {
                Self::put(to, first + 1, first, -at(1, 0));
            }
            return;
        }
        let diagonal = at(0, 0).recip();
        Self::put(to, first, first, diagonal);
        if n == 2 {
            let other = at(1, 1).recip();
            Self::put(to, first + 1, first, (-other * at(1, 0)) * diagonal);
            Self::put(to, first + 1, first + 1, other);
        }
    }

    /// The block below the diagonal blocks of `half` and `rows` rows, whose inverses are known: minus the inverse of
    /// the second times the block times that of the first.
    #[inline(always)]
    fn below(first: usize, half: usize, rows: usize, from: &Square<N>, to: &mut Square<N>) {
        let second = first + half;
        let (mut factors, mut scales) = ([[0.0; HALF]; HALF], [1.0; HALF]);
        for i in 0..rows {
            if !LOWER {
                scales[i] = Self::at(from, second + i, second + i).recip();
            }
            for j in 0..i {
                factors[i][j] = -Self::at(from, second + i, second + j) * scales[i];
            }
        }
        for j in 0..half {
            let mut column = [0.0; HALF];
            for i in 0..rows {
                let term = |k: usize| {
                    let k = if LOWER { k } else { half - 1 - k };
                    let x = Self::at(from, second + i, first + k);
                    // Above the diagonal are zeros, whose products faer adds too.
                    let y = if k >= j {
                        Self::at(to, first + k, first + j)
                    } else {
                        0.0
                    };
                    (x, y)
                };
                let (x, y) = term(0);
                column[i] = if half == 1 {
                    x.mul_add(-y, 0.0)
                } else {
                    let sum = (1..half).map(term);
                    -sum.fold(x * y, |sum, (x, y)| x.mul_add(y, sum))
                };
            }
            for i in 0..rows {
                let mut x = column[i];
                if !LOWER {
                    x *= scales[i];
                }
                for l in 0..i {
                    x += factors[i][l] * column[l];
                }
                column[i] = x;
                Self::put(to, second + i, first + j, x);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
    use faer::linalg::lu::partial_pivoting::{factor, inverse};
    use faer::{Mat, Par};
    use rand::Rng as _;

    fn bits(m: &Mat<f64>) -> Vec<u64> {
        let columns = (0..m.ncols()).flat_map(|j| m.col_as_slice(j));
        columns.map(|x| x.to_bits()).collect()
    }

    /// Matrices of rows and columns of any size, with zeros among some, some singular.
    fn matrices(n: usize) -> Vec<Mat<f64>> {
        let mut random = crate::signal::stream(7, n as u64, crate::signal::Purpose::Plant);
        let mut uniform = || (random.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
        let mut matrix = |trial: usize| {
            let sizes: Vec<f64> = (0..n).map(|_| 10_f64.powf(3.0 * uniform())).collect();
            Mat::from_fn(n, n, |i, j| {
                let x = uniform();
                let x = if trial.is_multiple_of(7) && x > 0.4 {
                    0.0
                } else {
                    x
                };
                let column = if trial.is_multiple_of(2) {
                    sizes[j]
                } else {
                    1.0
                };
                x * sizes[i] * column
            })
        };
        (0..1000).map(&mut matrix).collect()
    }

    #[test]
    fn inverses_have_the_bits_of_faer() {
        for n in 2..=MOST {
            let lu = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default());
            let scratch = inverse::inverse_scratch::<usize, f64>(n, Par::Seq);
            let mut memory = MemBuffer::new(StackReq::any_of(&[lu, scratch]));
            let (mut expected, mut found) = (Mat::zeros(n, n), Mat::zeros(n, n));
            let mut inverted = 0;
            for a in matrices(n) {
                let stack = MemStack::new(&mut memory);
                let (mut forward, mut back) = (vec![0_usize; n], vec![0; n]);
                let mut lu = a.clone();
                let (_, permutation) = factor::lu_in_place(
                    lu.as_mut(),
                    &mut forward,
                    &mut back,
                    Par::Seq,
                    stack,
                    Default::default(),
                );
                let result = invert(a.as_ref(), found.as_mut());
                if (0..n).any(|i| lu[(i, i)] == 0.0 || !lu[(i, i)].is_finite()) {
                    assert!(matches!(result, Some(Err(_))));
                    continue;
                }
                assert_eq!(result, Some(Ok(())));
                let lu = lu.as_ref();
                inverse::inverse(expected.as_mut(), lu, lu, permutation, Par::Seq, stack);
                assert_eq!(bits(&found), bits(&expected), "{a:?}");
                inverted += 1;
            }
            assert!(inverted > 900, "{n}: {inverted}");
        }
    }
}
