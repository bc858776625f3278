//! The joint state of signals: covariances and long-run covariances by Lyapunov equations, exact to rounding.
//!
//! Each pair of a source w and a monic denominator D is one companion block, `v(k) = w(k) - d_1 v(k-1) - ...` with its
//! past. All blocks together form `x(k+1) = F x(k) + G w(k+1)`, and every signal is `c x(k)` with a row c of
//! numerators. With `P = F P F' + sum_s sigma_s^2 g_s g_s'` a covariance is `E[a(k+t) b(k)] = c_a F^t P c_b'`, t >= 0.

use super::missing::NoTheory;
use super::signal::{Part, Signal, Source};
use super::spectrum::{Line, value};
use crate::step_down::StepDown;
use faer::{Mat, c64};

/// Powers `F^(2^j)` with no entry larger than this add nothing.
const LOST: f64 = 1e-14;

/// Number of doublings. A pole that has not decayed after these is on the unit circle.
const DOUBLINGS: usize = 50;

struct Block {
    source: usize,
    denominator: Vec<f64>,
    /// Index of its first state, and its number of states.
    first: usize,
    length: usize,
    /// `F, F^2, F^4, ...` of the block.
    powers: Vec<Mat<f64>>,
}

impl Block {
    fn is_of(&self, part: &Part) -> bool {
        self.source == part.source && self.denominator == part.denominator
    }

    fn find_powers(&mut self) -> Result<(), NoTheory> {
        if !is_stable(&self.denominator) {
            return Err(NoTheory::NotStationary);
        }
        let mut f = Mat::zeros(self.length, self.length);
        for (i, d) in self.denominator[1..].iter().enumerate() {
            f[(0, i)] = -d;
        }
        for i in 1..self.length {
            f[(i, i - 1)] = 1.0;
        }
        while f.norm_max() > LOST {
            let next = &f * &f;
            self.powers.push(f);
            f = next;
            if self.powers.len() > DOUBLINGS || !f.is_all_finite() {
                return Err(NoTheory::NotStationary);
            }
        }
        Ok(())
    }
}

/// The joint state of some signals.
struct JointState {
    blocks: Vec<Block>,
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
            match blocks.iter_mut().find(|block| block.is_of(part)) {
                Some(block) => block.length = block.length.max(length),
                None => blocks.push(Block {
                    source: part.source,
                    denominator: part.denominator.clone(),
                    first: 0,
                    length,
                    powers: Vec::new(),
                }),
            }
        }
        let mut n = 0;
        for block in &mut blocks {
            block.first = n;
            n += block.length;
            block.find_powers()?;
        }
        let mut q = Mat::zeros(n, n);
        for a in &blocks {
            let white = sources[a.source].spectrum.is_none();
            for b in blocks.iter().filter(|b| white && b.source == a.source) {
                q[(a.first, b.first)] = sources[a.source].variance;
            }
        }
        let mut state = Self {
            blocks,
            p: Mat::zeros(n, n),
        };
        state.p = state.lyapunov(q);
        state.add_lines(sources);
        Ok(state)
    }

    /// Adds what a source with a spectrum of its own gives: `v(k) = w(k) / D` has the covariances
    /// `sum_m P_m Re(e^(i omega_m (l - i)) / (D_a conj(D_b)))` of `v_a(k-i)` and `v_b(k-l)`.
    fn add_lines(&mut self, sources: &[Source]) {
        for a in &self.blocks {
            let Some(spectrum) = &sources[a.source].spectrum else {
                continue;
            };
            for b in self.blocks.iter().filter(|b| b.source == a.source) {
                let terms = spectrum.lines.iter().map(|line| {
                    let [a, b] = [a, b].map(|block| value(&block.denominator, line.delay));
                    (line.delay, line.power / (a * b.conj()))
                });
                let terms: Vec<(c64, c64)> = terms.collect();
                let at = |lag: i32| -> f64 {
                    terms
                        .iter()
                        .map(|(delay, of)| (delay.powi(lag) * of).re)
                        .sum()
                };
                let lags = 1 - b.length as i32..a.length as i32;
                let covariances: Vec<f64> = lags.map(at).collect();
                for i in 0..a.length {
                    for l in 0..b.length {
                        self.p[(a.first + i, b.first + l)] = covariances[i + b.length - 1 - l];
                    }
                }
            }
        }
    }

    /// Solves `X = F X F' + Q`, Q symmetric, by doubling (Smith 1968): after j steps `X = sum_i F^i Q F'^i` has 2^j
    /// terms.
    fn lyapunov(&self, mut x: Mat<f64>) -> Mat<f64> {
        for (i, a) in self.blocks.iter().enumerate() {
            for b in &self.blocks[i..] {
                let (rows, columns) = (a.first..a.first + a.length, b.first..b.first + b.length);
                let mut part = x.as_ref().get(rows.clone(), columns.clone()).to_owned();
                for (left, right) in a.powers.iter().zip(&b.powers) {
                    part += left * &part * right.transpose();
                }
                let of_both = part.transpose().to_owned();
                x.as_mut()
                    .get_mut(columns.clone(), rows.clone())
                    .copy_from(&of_both);
                x.as_mut().get_mut(rows, columns).copy_from(&part);
            }
        }
        x
    }

    /// The columns c' of signals.
    fn columns<'a>(&self, signals: impl ExactSizeIterator<Item = &'a Signal>) -> Mat<f64> {
        let mut columns = Mat::zeros(self.p.nrows(), signals.len());
        for (j, signal) in signals.enumerate() {
            for part in &signal.parts {
                let Some(block) = self.blocks.iter().find(|block| block.is_of(part)) else {
                    continue;
                };
                for (i, value) in part.numerator.iter().enumerate() {
                    columns[(block.first + i, j)] += value;
                }
            }
        }
        columns
    }
}

/// `E[left(k) right(k)']`.
///
/// # Errors
/// [`NoTheory::NotStationary`] if a denominator is not stable.
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
/// Here kappa_s is the fourth cumulant of source s, and `(a b)_s` the sum of the products of the two impulse responses
/// from it (Brillinger, Time Series, 1975, section 2.3: cumulants of products of linear processes). The sum over t >= 0
/// is `c_ai X_j c_bi'` with `X_j = F X_j F' + P (c_aj' c_bj + c_bj' c_aj) P`.
///
/// A part that is the same in every trial, with a spectrum of lines, does not fluctuate itself. With d for that part
/// and n for the others, the products that it takes part in give
///
/// ```text
/// sum_m P_m sum_s sigma_s^2 Re(w_i conj(w_j)),   w_i = A_i^d conj(B_i^s) + B_i^d conj(A_i^s),
/// ```
///
/// where `A_i^s` is the frequency response of `a_i` from source s at line m.
///
/// # Errors
/// As for [`covariance`], and [`NoTheory::BinaryInput`].
pub fn long_run_covariance(
    sources: &[Source],
    products: &[(Signal, Signal)],
) -> Result<Mat<f64>, NoTheory> {
    let has_lines = |signal: &Signal| {
        let mut parts = signal.parts.iter();
        parts.any(|part| sources[part.source].spectrum.is_some())
    };
    let spectra = || sources.iter().filter_map(|source| source.spectrum.as_ref());
    let is_drawn = spectra().any(|spectrum| spectrum.is_drawn);
    if is_drawn && products.iter().any(|(a, b)| has_lines(a) && has_lines(b)) {
        return Err(NoTheory::BinaryInput);
    }
    let of_white = |(a, b): &(Signal, Signal)| (a.from_white(sources), b.from_white(sources));
    let others: Vec<(Signal, Signal)> = products.iter().map(of_white).collect();
    let mut s = of_white_sources(sources, &others)?;
    for (given, source) in sources.iter().enumerate() {
        for line in source.spectrum.iter().flat_map(|spectrum| &spectrum.lines) {
            add_line(&mut s, (sources, products), given, line);
        }
    }
    Ok(s)
}

/// Adds what the products of one line with all white sources give to a long-run covariance.
fn add_line(
    s: &mut Mat<f64>,
    (sources, products): (&[Source], &[(Signal, Signal)]),
    given: usize,
    line: &Line,
) {
    let responses = |source: usize| -> Vec<[c64; 2]> {
        let of = |(a, b): &(Signal, Signal)| [a, b].map(|x| x.response(source, line.delay));
        products.iter().map(of).collect()
    };
    let of_line = responses(given);
    for (number, source) in sources.iter().enumerate() {
        if source.spectrum.is_some() || source.variance == 0.0 {
            continue;
        }
        let w: Vec<c64> = of_line
            .iter()
            .zip(&responses(number))
            .map(|([a, b], [of_a, of_b])| a * of_b.conj() + b * of_a.conj())
            .collect();
        let size = line.power * source.variance;
        *s += Mat::from_fn(w.len(), w.len(), |i, j| size * (w[i] * w[j].conj()).re);
    }
}

/// The long-run covariance of products of filtered white sources.
fn of_white_sources(
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
        let xb = state.lyapunov(&outer + outer.transpose()) * &b;
        for i in 0..count {
            later[(i, j)] = a.col(i).transpose() * xb.col(i);
        }
    }
    let (aa, ab) = (a.transpose() * &pa, a.transpose() * &pb);
    let (ba, bb) = (b.transpose() * &pa, b.transpose() * &pb);
    let mut s = Mat::from_fn(count, count, |i, j| {
        let now = aa[(i, j)] * bb[(i, j)] + ab[(i, j)] * ba[(i, j)];
        later[(i, j)] + later[(j, i)] - now
    });
    for (number, source) in sources.iter().enumerate() {
        if source.excess == 0.0 {
            continue;
        }
        // The part of E[a b] due to this source is sigma^2 (a b)_s.
        let mut of_source = a.clone();
        for block in state.blocks.iter().filter(|block| block.source != number) {
            of_source
                .as_mut()
                .subrows_mut(block.first, block.length)
                .fill(0.0);
        }
        let moment = |i: usize| of_source.col(i).transpose() * pb.col(i);
        let moments: Vec<f64> = (0..count).map(moment).collect();
        s += Mat::from_fn(count, count, |i, j| source.excess * moments[i] * moments[j]);
    }
    Ok(s)
}

/// Whether all zeros of a monic polynomial are inside the unit circle.
pub fn is_stable(polynomial: &[f64]) -> bool {
    StepDown::new(&polynomial[1..]).is_some()
}
