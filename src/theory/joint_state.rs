//! The joint state of signals: covariances and long-run covariances by Lyapunov equations, exact to rounding.
//!
//! Each source w through each monic D of its signals is one companion block, `v(k) = w(k) - d_1 v(k-1) - ...` with its
//! past; all blocks make `x(k+1) = F x(k) + G w(k+1)`, and every signal is a row c of numerators, `c x(k)`. With
//! `P = F P F' + sum_s sigma_s^2 g_s g_s'` a covariance is `E[a(k+t) b(k)] = c_a F^t P c_b'`, t >= 0.

use super::NoTheory;
use super::signal::{Signal, Source};
use crate::observer::lyapunov;
use faer::{Col, Mat};

struct Block {
    source: usize,
    denominator: Vec<f64>,
    /// Where it begins in the state, and how long it is.
    first: usize,
    length: usize,
}

/// The joint state of some signals.
struct JointState {
    blocks: Vec<Block>,
    f: Mat<f64>,
    /// The state's covariance under each source, of unit variance.
    of_source: Vec<Mat<f64>>,
    /// The state's covariance.
    p: Mat<f64>,
}

impl JointState {
    fn new<'a>(
        sources: &[Source],
        signals: impl Iterator<Item = &'a Signal>,
    ) -> Result<Self, NoTheory> {
        let mut blocks: Vec<Block> = Vec::new();
        for part in signals.flat_map(|signal| &signal.parts) {
            let length = part.numerator.len().max(part.denominator.len() - 1).max(1);
            let same =
                |b: &&mut Block| b.source == part.source && b.denominator == part.denominator;
            match blocks.iter_mut().find(same) {
                Some(block) => block.length = block.length.max(length),
                None => blocks.push(Block {
                    source: part.source,
                    denominator: part.denominator.clone(),
                    first: 0,
                    length,
                }),
            }
        }
        let mut n = 0;
        for block in &mut blocks {
            block.first = n;
            n += block.length;
        }
        let mut f = Mat::zeros(n, n);
        for block in &blocks {
            for (i, d) in block.denominator[1..].iter().enumerate() {
                f[(block.first, block.first + i)] = -d;
            }
            for i in 1..block.length {
                f[(block.first + i, block.first + i - 1)] = 1.0;
            }
        }
        let mut p = Mat::zeros(n, n);
        let mut of_source = Vec::new();
        for (number, source) in sources.iter().enumerate() {
            let drives = blocks.iter().any(|block| block.source == number);
            if !drives || source.variance == 0.0 {
                of_source.push(Mat::zeros(n, n));
                continue;
            }
            let mut g = Col::<f64>::zeros(n);
            for block in blocks.iter().filter(|block| block.source == number) {
                g[block.first] = 1.0;
            }
            let covariance = lyapunov(f.as_ref(), (&g * g.transpose()).as_ref())?;
            p += source.variance * &covariance;
            of_source.push(covariance);
        }
        Ok(Self {
            blocks,
            f,
            of_source,
            p,
        })
    }

    /// The column c' of a signal.
    fn column(&self, signal: &Signal) -> Col<f64> {
        let mut c = Col::zeros(self.f.nrows());
        for part in &signal.parts {
            let same = |b: &&Block| b.source == part.source && b.denominator == part.denominator;
            if let Some(block) = self.blocks.iter().find(same) {
                for (i, value) in part.numerator.iter().enumerate() {
                    c[block.first + i] += value;
                }
            }
        }
        c
    }

    fn columns<'a>(&self, signals: impl Iterator<Item = &'a Signal>) -> Mat<f64> {
        let columns: Vec<Col<f64>> = signals.map(|signal| self.column(signal)).collect();
        Mat::from_fn(self.f.nrows(), columns.len(), |i, j| columns[j][i])
    }
}

/// `E[left(k) right(k)']`.
///
/// # Errors
/// [`NoTheory::Lyapunov`] where a denominator is not stable.
pub fn covariance(
    sources: &[Source],
    left: &[Signal],
    right: &[Signal],
) -> Result<Mat<f64>, NoTheory> {
    let state = JointState::new(sources, left.iter().chain(right))?;
    let (left, right) = (state.columns(left.iter()), state.columns(right.iter()));
    Ok(left.transpose() * &state.p * right)
}

/// The long-run covariance of products `a_i(k) b_i(k)`, the limit of `N cov(mean)`:
///
/// ```text
/// S_ij = sum_t (R_aiaj(t) R_bibj(t) + R_aibj(t) R_biaj(t)) + sum_s kappa_s (a_i b_i)_s (a_j b_j)_s,
/// ```
///
/// kappa_s the fourth cumulant of source s and `(a b)_s` the sum of the products of the two impulse responses from it
/// (Brillinger, Time Series, 1975, section 2.3: cumulants of products of linear processes). The sum over t >= 0 is
/// `c_ai X_j c_bi'` with `X_j = F X_j F' + P (c_aj' c_bj + c_bj' c_aj) P`.
///
/// # Errors
/// As for [`covariance`].
pub fn long_run_covariance(
    sources: &[Source],
    products: &[(Signal, Signal)],
) -> Result<Mat<f64>, NoTheory> {
    let count = products.len();
    let both = products.iter().flat_map(|(a, b)| [a, b]);
    let state = JointState::new(sources, both)?;
    let a = state.columns(products.iter().map(|(a, _)| a));
    let b = state.columns(products.iter().map(|(_, b)| b));
    let (pa, pb) = (&state.p * &a, &state.p * &b);
    let mut later = Mat::<f64>::zeros(count, count);
    for j in 0..count {
        let outer = pa.col(j) * pb.col(j).transpose();
        let right = &outer + outer.transpose();
        let x = lyapunov(state.f.as_ref(), right.as_ref())?;
        let xb = &x * &b;
        for i in 0..count {
            later[(i, j)] = a.col(i).transpose() * xb.col(i);
        }
    }
    let (aa, ab, ba, bb) = (
        a.transpose() * &pa,
        a.transpose() * &pb,
        b.transpose() * &pa,
        b.transpose() * &pb,
    );
    let mut s = Mat::from_fn(count, count, |i, j| {
        let now = aa[(i, j)] * bb[(i, j)] + ab[(i, j)] * ba[(i, j)];
        later[(i, j)] + later[(j, i)] - now
    });
    for (source, covariance) in sources.iter().zip(&state.of_source) {
        let fourth = source.excess * source.variance * source.variance;
        if fourth != 0.0 {
            let wb = covariance * &b;
            let sum = |i: usize| a.col(i).transpose() * wb.col(i);
            let sums: Vec<f64> = (0..count).map(sum).collect();
            s += Mat::from_fn(count, count, |i, j| fourth * sums[i] * sums[j]);
        }
    }
    Ok(s)
}
