//! The joint state of signals: covariances and long-run covariances by Lyapunov equations, exact to rounding.
//!
//! Each pair of a source w and a monic denominator D is one companion block, `v(k) = w(k) - d_1 v(k-1) - ...` with its
//! past. All blocks together form `x(k+1) = F x(k) + G w(k+1)`, and every signal is `c x(k)` with a row c of
//! numerators. With `P = F P F' + sum_s sigma_s^2 g_s g_s'` a covariance is `E[a(k+t) b(k)] = c_a F^t P c_b'`, t >= 0.

use super::matrix::Matrix;
use super::missing::NoTheory;
use super::signal::{Part, Signal, Source};
use super::spectrum::Line;
use crate::model::polynomial::value;
use crate::step_down::StepDown;
use faer::c64;

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
    /// `F, F^2, F^4, ...` of as many states as the denominator needs.
    powers: Vec<Matrix>,
}

impl Block {
    fn is_of(&self, part: &Part) -> bool {
        self.source == part.source && self.denominator == part.denominator
    }

    /// The states that the denominator needs.
    fn core(&self) -> usize {
        (self.denominator.len() - 1).max(1)
    }

    fn states(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.length
    }

    /// The powers of F with this number of states.
    fn powers(&self, states: usize) -> Result<Vec<Matrix>, NoTheory> {
        if !is_stable(&self.denominator) {
            return Err(NoTheory::NotStationary);
        }
        let mut f = Matrix::zeros(states, states);
        for (i, d) in self.denominator[1..].iter().enumerate() {
            f[(0, i)] = -d;
        }
        for i in 1..states {
            f[(i, i - 1)] = 1.0;
        }
        let mut powers = Vec::new();
        while f.norm_max() > LOST {
            let next = &f * &f;
            powers.push(f);
            f = next;
            if powers.len() > DOUBLINGS || !f.is_all_finite() {
                return Err(NoTheory::NotStationary);
            }
        }
        Ok(powers)
    }

    /// `v F`, for a row v of all states.
    fn times(&self, v: &[f64]) -> Vec<f64> {
        let d = |i: usize| self.denominator.get(i + 1).copied().unwrap_or(0.0);
        let next = |i: usize| v.get(i + 1).copied().unwrap_or(0.0);
        (0..v.len()).map(|i| (-v[0]).mul_add(d(i), next(i))).collect()
    }
}

/// Solves `X = A X B + Q` by doubling (Smith 1968), given the powers `A^(2^j)` and `B^(2^j)`: after j steps
/// `X = sum_i A^i Q B^i` has 2^j terms.
fn stein(left: &[Matrix], mut x: Matrix, right: &[Matrix]) -> Matrix {
    for (left, right) in left.iter().zip(right) {
        x += &(&(left * &x) * right);
    }
    x
}

fn transposed(powers: &[Matrix]) -> Vec<Matrix> {
    powers.iter().map(Matrix::transpose).collect()
}

/// The covariances `E[v_a(k) v_b(k-t)]` of two blocks of one source from `t = 1 - a.length` to `b.length - 1`. The
/// covariances of the states that the denominators need solve a Lyapunov equation; the others follow by the recursions
/// of v_a and v_b, since w(k) is independent of the past.
fn covariances(a: &Block, b: &Block, variance: f64) -> Vec<f64> {
    let mut q = Matrix::zeros(a.core(), b.core());
    q[(0, 0)] = variance;
    let x = stein(&a.powers, q, &transposed(&b.powers));
    let zero = a.length - 1;
    let mut r = vec![0.0; zero + b.length];
    for t in 0..a.core().min(a.length) {
        r[zero - t] = x[(t, 0)];
    }
    for t in 0..b.core().min(b.length) {
        r[zero + t] = x[(0, t)];
    }
    let recursion = |d: &[f64], at: &dyn Fn(usize) -> f64| {
        let terms = d[1..].iter().enumerate();
        -terms.map(|(i, d)| d * at(i + 1)).sum::<f64>()
    };
    for t in b.core()..b.length {
        let next = recursion(&a.denominator, &|i| r[zero + t - i]);
        r[zero + t] = next;
    }
    for t in a.core()..a.length {
        let next = recursion(&b.denominator, &|i| r[zero + i - t]);
        r[zero - t] = next;
    }
    r
}

/// The joint state of some signals.
struct JointState {
    blocks: Vec<Block>,
    /// The state's covariance.
    p: Matrix,
}

impl JointState {
    fn new<'a>(sources: &[Source], signals: impl Iterator<Item = &'a Signal>) -> Result<Self, NoTheory> {
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
            block.powers = block.powers(block.core())?;
        }
        let mut state = Self {
            blocks,
            p: Matrix::zeros(n, n),
        };
        state.correlate(sources);
        Ok(state)
    }

    /// Computes P, block by block: each is a Toeplitz matrix.
    fn correlate(&mut self, sources: &[Source]) {
        for (number, a) in self.blocks.iter().enumerate() {
            let of_source = |b: &&Block| b.source == a.source;
            for b in self.blocks[number..].iter().filter(of_source) {
                let source = &sources[a.source];
                let r = match &source.spectrum {
                    None => covariances(a, b, source.variance),
                    Some(spectrum) => line_covariances(a, b, &spectrum.lines),
                };
                for i in 0..a.length {
                    for l in 0..b.length {
                        let value = r[a.length - 1 + l - i];
                        self.p[(a.first + i, b.first + l)] = value;
                        self.p[(b.first + l, a.first + i)] = value;
                    }
                }
            }
        }
    }

    /// The columns c' of signals.
    fn columns<'a>(&self, signals: impl ExactSizeIterator<Item = &'a Signal>) -> Matrix {
        let mut columns = Matrix::zeros(self.p.nrows(), signals.len());
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

    /// `sum_t (e'F^t s) F^t + (F^t s) (e'F^t)`, over t >= 0.
    fn summed(&self, powers: &[Vec<Matrix>], e: &[f64], s: &[f64]) -> Matrix {
        let mut sum = Matrix::zeros(e.len(), e.len());
        let outer = |x: &[f64], y: &[f64]| Matrix::from_fn(x.len(), y.len(), |i, j| x[i] * y[j]);
        for (b, of_b) in self.blocks.iter().zip(powers) {
            // A row of the first sum over a block is the one below it times F, as in F, and the last is s'W with
            // W = sum_t F'^t e (0 ... 0 1) F^t.
            let (mut last, mut row) = (vec![0.0; b.length], vec![0.0; b.length]);
            last[b.length - 1] = 1.0;
            for (c, of_c) in self.blocks.iter().zip(powers) {
                let (e_c, s_c) = (&e[c.states()], &s[c.states()]);
                let w = stein(&transposed(of_c), outer(e_c, &last), of_b);
                for (row, j) in row.iter_mut().zip(0..) {
                    *row += w.col(j).iter().zip(s_c).map(|(w, s)| w * s).sum::<f64>();
                }
                let n = stein(of_c, outer(s_c, &e[b.states()]), of_b);
                for i in 0..c.length {
                    for j in 0..b.length {
                        sum[(c.first + i, b.first + j)] += n[(i, j)];
                    }
                }
            }
            for i in b.states().rev() {
                for (j, x) in b.states().zip(&row) {
                    sum[(i, j)] += x;
                }
                row = b.times(&row);
            }
        }
        sum
    }
}

/// The covariances from a source with lines: those of `v(k) = w(k) / D` are `sum_m P_m Re(e^(-i omega_m t) / (D_a
/// conj(D_b)))`, for the lags of [`covariances`].
fn line_covariances(a: &Block, b: &Block, lines: &[Line]) -> Vec<f64> {
    let first = 1 - a.length as i32;
    let begin = |line: &Line| {
        let [of_a, of_b] = [a, b].map(|block| value(&block.denominator, line.delay));
        let power = line.power / (of_a * of_b.conj());
        // e^(-i omega) is the delay, whose inverse is its conjugate.
        (line.delay.conj(), power * line.delay.conj().powi(first))
    };
    let mut terms: Vec<(c64, c64)> = lines.iter().map(begin).collect();
    let lags = 0..a.length + b.length - 1;
    lags.map(|_| {
        let mut sum = 0.0;
        for (step, term) in &mut terms {
            sum += term.re;
            *term *= *step;
        }
        sum
    })
    .collect()
}

/// `E[left(k) right(k)']`.
///
/// # Errors
/// [`NoTheory::NotStationary`] if a denominator is not stable.
pub fn covariance(sources: &[Source], left: &[Signal], right: &[Signal]) -> Result<Matrix, NoTheory> {
    let state = JointState::new(sources, left.iter().chain(right))?;
    let (left, right) = (state.columns(left.iter()), state.columns(right.iter()));
    Ok(&left.transpose() * &(&state.p * &right))
}

/// The long-run covariance of products `a_i(k) b_i(k)`, the limit of `N cov(mean)`:
///
/// ```text
/// S_ij = sum_t (R_aiaj(t) R_bibj(t) + R_aibj(t) R_biaj(t)) + sum_s kappa_s (a_i b_i)_s (a_j b_j)_s,
/// ```
///
/// Here kappa_s is the fourth cumulant of source s, and `(a b)_s` the sum of the products of the two impulse responses
/// from it (Brillinger, Time Series, 1975, section 2.3: cumulants of products of linear processes). The sum over t >= 0
/// is `c_ai M P c_aj'`, M being the sum over t of `(c_bi F^t P c_bj') F^t + (F^t P c_bj') (c_bi F^t)`.
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
pub fn long_run_covariance(sources: &[Source], products: &[(Signal, Signal)]) -> Result<Matrix, NoTheory> {
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
        let Some(spectrum) = &source.spectrum else {
            continue;
        };
        let responses = Responses::new(products);
        for line in &spectrum.lines {
            responses.add_line(&mut s, (sources, given), line);
        }
    }
    Ok(s)
}

/// The frequency responses of the signals of some products. Many are lags of others, so each filter is evaluated once.
struct Responses {
    /// The source, the denominator, and the numerator without its first zeros.
    filters: Vec<(usize, Vec<f64>, Vec<f64>)>,
    /// The parts of each signal, two signals for a product: a filter, and its delay.
    signals: Vec<Vec<(usize, usize)>>,
    longest: usize,
}

impl Responses {
    fn new(products: &[(Signal, Signal)]) -> Self {
        let (mut filters, mut longest) = (Vec::new(), 0);
        let mut place = |part: &Part| {
            let delay = part.numerator.iter().take_while(|c| **c == 0.0).count();
            let top = part.numerator[delay..].to_vec();
            let filter = (part.source, part.denominator.clone(), top);
            longest = longest.max(delay);
            let known = filters.iter().position(|known| *known == filter);
            let place = known.unwrap_or_else(|| {
                filters.push(filter);
                filters.len() - 1
            });
            (place, delay)
        };
        let both = products.iter().flat_map(|(a, b)| [a, b]);
        let signals = both.map(|signal| signal.parts.iter().map(&mut place).collect());
        let signals = signals.collect();
        Self {
            filters,
            signals,
            longest,
        }
    }

    /// Adds what the products of one line with all white sources give to a long-run covariance.
    fn add_line(&self, s: &mut Matrix, (sources, given): (&[Source], usize), line: &Line) {
        let mut delays = vec![c64::new(1.0, 0.0)];
        for i in 0..self.longest {
            delays.push(delays[i] * line.delay);
        }
        let filters = self.filters.iter();
        let values: Vec<c64> = filters
            .map(|(_, bottom, top)| value(top, line.delay) / value(bottom, line.delay))
            .collect();
        let responses = |source: usize| -> Vec<c64> {
            let of_signal = |parts: &Vec<(usize, usize)>| {
                let parts = parts.iter().filter(|(of, _)| self.filters[*of].0 == source);
                parts.map(|(of, delay)| values[*of] * delays[*delay]).sum()
            };
            self.signals.iter().map(of_signal).collect()
        };
        let of_line = responses(given);
        for (number, source) in sources.iter().enumerate() {
            if source.spectrum.is_some() || source.variance == 0.0 {
                continue;
            }
            let of_source = responses(number);
            let pairs = of_line.as_chunks::<2>().0.iter();
            let w: Vec<c64> = pairs
                .zip(of_source.as_chunks::<2>().0)
                .map(|([a, b], [of_a, of_b])| a * of_b.conj() + b * of_a.conj())
                .collect();
            let size = line.power * source.variance;
            for (j, wj) in w.iter().enumerate() {
                for (i, wi) in w[..=j].iter().enumerate() {
                    let value = size * (wi.re * wj.re + wi.im * wj.im);
                    s[(i, j)] += value;
                    s[(j, i)] += if i == j { 0.0 } else { value };
                }
            }
        }
    }
}

/// The long-run covariance of products of filtered white sources.
fn of_white_sources(sources: &[Source], products: &[(Signal, Signal)]) -> Result<Matrix, NoTheory> {
    let count = products.len();
    let both = products.iter().flat_map(|(a, b)| [a, b]);
    let state = JointState::new(sources, both)?;
    let a = state.columns(products.iter().map(|(a, _)| a));
    let b = state.columns(products.iter().map(|(_, b)| b));
    let (pa, pb) = (&state.p * &a, &state.p * &b);
    let powers: Result<Vec<Vec<Matrix>>, NoTheory> =
        state.blocks.iter().map(|block| block.powers(block.length)).collect();
    let powers = powers?;
    // Most products have the same second factor.
    let mut seconds: Vec<usize> = Vec::new();
    let second: Vec<usize> = (0..count)
        .map(|i| {
            let known = seconds.iter().position(|j| b.col(*j) == b.col(i));
            known.unwrap_or_else(|| {
                seconds.push(i);
                seconds.len() - 1
            })
        })
        .collect();
    let mut later = Matrix::zeros(count, count);
    for (left, e) in seconds.iter().enumerate() {
        for (right, s) in seconds.iter().enumerate() {
            let sum = state.summed(&powers, b.col(*e), pb.col(*s));
            let all = &a.transpose() * &(&sum * &pa);
            for i in (0..count).filter(|i| second[*i] == left) {
                for j in (0..count).filter(|j| second[*j] == right) {
                    later[(i, j)] = all[(i, j)];
                }
            }
        }
    }
    let (of_a, of_b) = (a.transpose(), b.transpose());
    let (aa, ab) = (&of_a * &pa, &of_a * &pb);
    let (ba, bb) = (&of_b * &pa, &of_b * &pb);
    let mut s = Matrix::from_fn(count, count, |i, j| {
        let now = aa[(i, j)] * bb[(i, j)] + ab[(i, j)] * ba[(i, j)];
        later[(i, j)] + later[(j, i)] - now
    });
    for (number, source) in sources.iter().enumerate() {
        if source.excess == 0.0 {
            continue;
        }
        // The part of E[a b] due to this source is sigma^2 (a b)_s.
        let blocks = state.blocks.iter().filter(|block| block.source == number);
        let states: Vec<usize> = blocks.flat_map(Block::states).collect();
        let moment = |i: usize| -> f64 { states.iter().map(|k| a[(*k, i)] * pb[(*k, i)]).sum() };
        let moments: Vec<f64> = (0..count).map(moment).collect();
        s += &Matrix::from_fn(count, count, |i, j| source.excess * moments[i] * moments[j]);
    }
    Ok(s)
}

/// Whether all zeros of a monic polynomial are inside the unit circle.
pub fn is_stable(polynomial: &[f64]) -> bool {
    StepDown::new(&polynomial[1..]).is_some()
}
