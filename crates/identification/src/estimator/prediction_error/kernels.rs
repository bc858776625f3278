//! The arithmetic of a search: filters and a triangle by Householder reflections, compiled for the machine's vectors.
//!
//! The rules of [`crate::signal::arithmetic`] make the bits the same on every machine.

use crate::estimator::FailureKind;
use crate::estimator::lag_sums::System;
use crate::failure::all_finite;
use crate::signal::arithmetic;
use faer::MatRef;

/// Rows that are reduced at a time: a block of some ten columns stays in the first cache.
const BLOCK_ROWS: usize = 256;

/// Computes `to(i) = signal(first + i - lag)`, with zeros before the record.
pub(in crate::estimator) fn copy_delayed(signal: &[f64], lag: usize, first: usize, to: &mut [f64]) {
    let (before, rest) = to.split_at_mut(lag.saturating_sub(first).min(to.len()));
    before.fill(0.0);
    let from = (first + before.len()).saturating_sub(lag);
    rest.copy_from_slice(&signal[from..][..rest.len()]);
}

/// Computes `to += factor x` over the shorter length.
#[inline(always)]
pub(in crate::estimator) fn add_multiple(factor: f64, x: &[f64], to: &mut [f64]) {
    for (to, x) in to.iter_mut().zip(x) {
        *to = factor.mul_add(*x, *to);
    }
}

/// Computes `to(k) = sum_i c_i x(k-i)`, with zeros before the record.
pub(in crate::estimator) fn filter(c: &[f64], x: &[f64], to: &mut [f64]) {
    let delay = c.iter().position(|c| *c != 0.0).unwrap_or(c.len());
    let (begin, delayed) = to.split_at_mut(delay.min(to.len()));
    begin.fill(0.0);
    let c = &c[delay..];
    with_fma!(|| match c.len() {
        _ if c.contains(&0.0) => filter_by_lags(c, x, delayed),
        1 => filter_of::<1>(c, x, delayed),
        2 => filter_of::<2>(c, x, delayed),
        3 => filter_of::<3>(c, x, delayed),
        4 => filter_of::<4>(c, x, delayed),
        5 => filter_of::<5>(c, x, delayed),
        6 => filter_of::<6>(c, x, delayed),
        7 => filter_of::<7>(c, x, delayed),
        _ => filter_by_lags(c, x, delayed),
    });
}

/// A lag after the other; coefficients that are zero are no terms. `to` may be shorter than x.
#[inline(always)]
fn filter_by_lags(c: &[f64], x: &[f64], to: &mut [f64]) {
    to.fill(0.0);
    for (lag, c) in c.iter().enumerate().take(to.len()) {
        if *c != 0.0 {
            add_multiple(*c, x, &mut to[lag..]);
        }
    }
}

/// L coefficients in one run over the signal, with the same sums.
#[inline(always)]
fn filter_of<const L: usize>(c: &[f64], x: &[f64], to: &mut [f64]) {
    let mut coefficients = [0.0; L];
    coefficients.copy_from_slice(c);
    let (first, rest) = to.split_at_mut((L - 1).min(to.len()));
    for (k, to) in first.iter_mut().enumerate() {
        *to = (0..=k).fold(0.0, |sum, lag| c[lag].mul_add(x[k - lag], sum));
    }
    for (to, x) in rest.iter_mut().zip(x.array_windows::<L>()) {
        let mut sum = 0.0;
        for lag in 0..L {
            sum = coefficients[lag].mul_add(x[L - 1 - lag], sum);
        }
        *to = sum;
    }
}

/// Divides a signal by a monic polynomial, in place: `x(k) <- x(k) - sum_(i >= 1) d_i x(k-i)`.
pub(in crate::estimator) fn divide(d: &[f64], x: &mut [f64]) {
    divide_each(d, [x]);
}

/// Divides several signals of one length by a monic polynomial, in place. Each waits for its own past alone, so
/// that they take little longer than one.
///
/// The oldest term is subtracted first, so that a sample waits for the one before it during one operation only.
pub(in crate::estimator) fn divide_each<const K: usize>(d: &[f64], x: [&mut [f64]; K]) {
    #[inline(always)]
    fn of_order<const N: usize, const K: usize>(d: &[f64], x: [&mut [f64]; K]) {
        let (mut past, mut minus) = ([[0.0; K]; N], [0.0; N]);
        for (minus, d) in minus.iter_mut().zip(&d[1..]) {
            *minus = -d;
        }
        let length = x.iter().map(|x| x.len()).min().unwrap_or(0);
        let mut x = x.map(|x| &mut x[..length]);
        for k in 0..length {
            let mut values: [f64; K] = std::array::from_fn(|j| x[j][k]);
            for i in (0..N).rev() {
                for (value, past) in values.iter_mut().zip(past[i]) {
                    *value = minus[i].mul_add(past, *value);
                }
            }
            past = std::array::from_fn(|i| if i == 0 { values } else { past[i - 1] });
            for (x, value) in x.iter_mut().zip(values) {
                x[k] = value;
            }
        }
    }
    #[inline(always)]
    fn of_any_order(d: &[f64], x: &mut [f64]) {
        for k in 0..x.len() {
            let mut value = x[k];
            for i in (1..=(d.len() - 1).min(k)).rev() {
                value = (-d[i]).mul_add(x[k - i], value);
            }
            x[k] = value;
        }
    }
    with_fma!(|| match d.len() {
        0 | 1 => {}
        2 => of_order::<1, K>(d, x),
        3 => of_order::<2, K>(d, x),
        4 => of_order::<3, K>(d, x),
        5 => of_order::<4, K>(d, x),
        6 => of_order::<5, K>(d, x),
        7 => of_order::<6, K>(d, x),
        _ => x.into_iter().for_each(|x| of_any_order(d, x)),
    });
}

/// `Z = Q R` and `Q'` applied to one more column, by Householder reflections of blocks of rows below the triangle so
/// far, in memory independent of the number of rows.
#[derive(Default)]
pub(in crate::estimator) struct Triangle {
    width: usize,
    /// R by columns; below it are zeros.
    r: Vec<f64>,
    top: Vec<f64>,
    /// A block of rows of `[Z | column]`, by columns.
    block: Vec<f64>,
}

impl Triangle {
    /// Makes buffers for a Z with `width` columns.
    pub(in crate::estimator) fn new(width: usize) -> Self {
        Self {
            width,
            r: vec![0.0; width * width],
            top: vec![0.0; width],
            block: vec![0.0; (width + 1) * BLOCK_ROWS],
        }
    }

    /// Reduces `total` rows. `fill(column, first, to)` writes the rows from `first` on of a column; the one after the
    /// last of Z is the other column.
    ///
    /// # Errors
    /// [`FailureKind::NonFinite`] if an entry overflows.
    pub(in crate::estimator) fn run(
        &mut self,
        total: usize,
        mut fill: impl FnMut(usize, usize, &mut [f64]),
    ) -> Result<(), FailureKind> {
        self.r.fill(0.0);
        self.top.fill(0.0);
        let mut first = 0;
        while first < total {
            let rows = BLOCK_ROWS.min(total - first);
            for (j, column) in self.block.chunks_exact_mut(BLOCK_ROWS).enumerate() {
                fill(j, first, &mut column[..rows]);
            }
            with_fma!(|| self.reduce(rows));
            first += rows;
        }
        all_finite(self.r.iter().chain(&self.top))
    }

    /// Annihilates the block. Column j's reflection involves row j of R and the block alone.
    #[inline(always)]
    fn reduce(&mut self, rows: usize) {
        let n = self.width;
        for j in 0..n {
            let (done, rest) = self.block.split_at_mut((j + 1) * BLOCK_ROWS);
            let v = &done[j * BLOCK_ROWS..][..rows];
            let below = arithmetic::dot(v, v);
            if below == 0.0 {
                continue;
            }
            let diagonal = self.r[j * n + j];
            let norm = diagonal.mul_add(diagonal, below).sqrt();
            let alpha = if diagonal > 0.0 { -norm } else { norm };
            let first = diagonal - alpha;
            let scale = 2.0 / first.mul_add(first, below);
            self.r[j * n + j] = alpha;
            for (l, column) in (j + 1..=n).zip(rest.chunks_exact_mut(BLOCK_ROWS)) {
                let column = &mut column[..rows];
                let above = if l < n {
                    &mut self.r[l * n + j]
                } else {
                    &mut self.top[j]
                };
                let product = scale * first.mul_add(*above, arithmetic::dot(v, column));
                *above = (-product).mul_add(first, *above);
                add_multiple(-product, v, column);
            }
        }
    }

    /// Takes L of `Z'Z = L L'` as R', and `L^-1 Z'column`.
    pub(in crate::estimator) fn take(&mut self, normal: &System) {
        for j in 0..self.width {
            let row = normal.row(j);
            let column = &mut self.r[j * self.width..];
            column[..row.len()].copy_from_slice(row);
            column[row.len()..self.width].fill(0.0);
        }
        self.top.copy_from_slice(&normal.right);
    }

    /// Returns R.
    pub(in crate::estimator) fn r(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.r, self.width, self.width)
    }

    /// Returns the first rows of `Q'` times the other column, as many as R has.
    pub(in crate::estimator) fn top(&self) -> &[f64] {
        &self.top
    }

    /// Computes `x = R^-1 x`; false if R is singular.
    pub(in crate::estimator) fn solve(&self, x: &mut [f64]) -> bool {
        let n = self.width;
        for j in (0..n).rev() {
            let column = &self.r[j * n..];
            if column[j] == 0.0 {
                return false;
            }
            x[j] /= column[j];
            let (above, solved) = x.split_at_mut(j);
            add_multiple(-solved[0], &column[..j], above);
        }
        x.iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::lag_sums::dot;
    use crate::model::polynomial;

    fn signal(count: usize, factor: f64) -> Vec<f64> {
        (0..count).map(|k| (factor * (k * k) as f64).sin()).collect()
    }

    /// Every order of the filters against those of [`crate::model::polynomial`].
    #[test]
    fn filters_agree_with_the_model() {
        let x = signal(400, 0.37);
        for order in 0..=9 {
            let mut d = vec![1.0];
            d.extend((1..=order).map(|i| 0.5_f64.powi(i) * (1.3 * f64::from(i)).cos()));
            let (mut found, mut expected) = (x.clone(), x.clone());
            let mut other = signal(400, 0.71);
            let mut alone = other.clone();
            divide_each(&d, [&mut other, &mut found]);
            divide(&d, &mut alone);
            assert_eq!(other, alone, "{order}");
            polynomial::divide(&d, &mut expected);
            let close = |(f, e): (&f64, &f64)| (f - e).abs() < 1e-13;
            assert!(found.iter().zip(&expected).all(close), "{order}");
            filter(&d, &x, &mut found);
            polynomial::filter(&d, &x, &mut expected);
            assert!(found.iter().zip(&expected).all(close), "{order}");
            // In one run over the signal and by lags: the same bits, delays and zeros among the coefficients too.
            for c in [
                d.clone(),
                [&[0.0, 0.0], &d[..]].concat(),
                [&d[..], &[0.0, 0.3]].concat(),
            ] {
                for length in [0, 1, 2, 4, 7, 400] {
                    let (mut found, mut expected) = (vec![f64::NAN; length], vec![0.0; length]);
                    filter(&c, &x[..length], &mut found);
                    filter_by_lags(&c, &x[..length], &mut expected);
                    assert_eq!(found, expected, "{c:?} {length}");
                }
            }
        }
    }

    /// `R'R = Z'Z` and `R' top = Z' y` over several blocks; the solution leaves residuals orthogonal to Z.
    #[test]
    fn the_triangle_is_that_of_the_normal_equations() {
        let (rows, width) = (3 * BLOCK_ROWS + 17, 4);
        let columns: Vec<Vec<f64>> = (0..=width).map(|j| signal(rows, 0.11 + 0.07 * j as f64)).collect();
        let mut triangle = Triangle::new(width);
        let fill = |j: usize, first: usize, to: &mut [f64]| {
            to.copy_from_slice(&columns[j][first..][..to.len()]);
        };
        triangle.run(rows, fill).unwrap();
        let r = triangle.r();
        for i in 0..width {
            for j in 0..width {
                let product: f64 = (0..=i.min(j)).map(|l| r[(l, i)] * r[(l, j)]).sum();
                assert!((product - dot(&columns[i], &columns[j])).abs() < 1e-10);
            }
        }
        let mut theta = triangle.top().to_vec();
        assert!(triangle.solve(&mut theta));
        let mut residual = columns[width].clone();
        for (theta, column) in theta.iter().zip(&columns) {
            add_multiple(-theta, column, &mut residual);
        }
        for column in &columns[..width] {
            assert!(dot(column, &residual).abs() < 1e-10);
        }
    }
}
