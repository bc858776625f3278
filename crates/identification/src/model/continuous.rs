//! Models in continuous time, `B(s)/A(s)`, and the difference equation that their samples obey exactly.

use super::units::{multiply, multiply_part};
use super::{LinearModel, Orders, Units};
use crate::names::named_enum;
use crate::plant::exponential;
use faer::{Mat, MatRef};

named_enum! {
    /// The input between two samples.
    Hold, "hold" {
        /// It keeps the value of the last sample (the default).
        Zero = "zero-order",
        /// It goes from sample to sample on straight lines.
        First = "first-order",
    }
}

/// The model `y(t) = B(s)/A(s) u(t - dead_time step)` with `A = s^n + a_1 s^(n-1) + ... + a_n` and
/// `B = b_0 s^m + ... + b_m`, m at most n. An empty numerator is no model; `a_n = 0` is an integrator.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContinuousModel {
    /// `b_0 ... b_m`, in powers of 1/s for a time in seconds.
    pub numerator: Vec<f64>,
    /// `1, a_1 ... a_n`.
    pub denominator: Vec<f64>,
    /// The covariance of `(b_0 ... b_m, a_1 ... a_n)`, and of the dead time in seconds if it was estimated, row by row;
    /// empty if there is none.
    pub covariance: Vec<f64>,
    /// The time between samples, seconds.
    pub step: f64,
    /// The input between two samples.
    pub hold: Hold,
    /// The dead time in samples, of which it need be no whole number.
    pub dead_time: f64,
}

/// A linear system with the states `s^(n-1)/A v, ..., 1/A v`, or any other, seen at its samples:
/// `x(k+1) = E x(k) + now v(k) + next v(k+1)`. The time between samples is 1.
pub(crate) struct Sampled {
    /// E.
    pub(crate) transition: Mat<f64>,
    /// The effect of v(k).
    pub(crate) now: Vec<f64>,
    /// The effect of v(k+1); zeros with a zero-order hold.
    pub(crate) next: Vec<f64>,
}

impl Sampled {
    /// Samples `x' = M x + g v`: with `exp [M g 0; 0 0 1; 0 0 0] = [E p r; ...]`, `now = p - r`, `next = r` for
    /// straight lines, and `now = p` for a constant input.
    pub(crate) fn new(m: MatRef<'_, f64>, g: &[f64], hold: Hold) -> Self {
        Self::over(1.0, m, g, hold)
    }

    /// Goes over a share of the time between samples only, in which a straight line rises by this share.
    pub(crate) fn over(share: f64, m: MatRef<'_, f64>, g: &[f64], hold: Hold) -> Self {
        let n = m.nrows();
        let block = Mat::from_fn(n + 2, n + 2, |i, j| match (i < n, j < n) {
            (true, true) => share * m[(i, j)],
            (true, false) if j == n => share * g[i],
            (false, false) if i == n && j == n + 1 => 1.0,
            _ => 0.0,
        });
        let e = exponential(block.as_ref());
        let ramp = |i: usize| {
            if hold == Hold::First {
                share * e[(i, n + 1)]
            } else {
                0.0
            }
        };
        Self {
            transition: e.get(..n, ..n).to_owned(),
            now: (0..n).map(|i| e[(i, n)] - ramp(i)).collect(),
            next: (0..n).map(ramp).collect(),
        }
    }

    /// Computes the states of the first sample from rest.
    pub(crate) fn start(&self, first: f64, x: &mut [f64]) {
        for (x, next) in x.iter_mut().zip(&self.next) {
            *x = next * first;
        }
    }

    /// Computes the states of the next sample. It is quick inside [`crate::real::with_fma`].
    #[inline(always)]
    pub(crate) fn step(&self, v: [f64; 2], from: &[f64], to: &mut [f64]) {
        match to.len() {
            1 => self.step_of::<1>(v, from, to),
            2 => self.step_of::<2>(v, from, to),
            3 => self.step_of::<3>(v, from, to),
            4 => self.step_of::<4>(v, from, to),
            6 => self.step_of::<6>(v, from, to),
            _ => {
                self.begin_step(v, to);
                for (j, x) in from.iter().enumerate() {
                    for (to, e) in to.iter_mut().zip(self.transition.col_as_slice(j)) {
                        *to = e.mul_add(*x, *to);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn begin_step(&self, v: [f64; 2], to: &mut [f64]) {
        for ((to, now), next) in to.iter_mut().zip(&self.now).zip(&self.next) {
            *to = now.mul_add(v[0], next * v[1]);
        }
    }

    /// The same in registers.
    #[inline(always)]
    fn step_of<const N: usize>(&self, v: [f64; 2], from: &[f64], to: &mut [f64]) {
        let mut sums = [0.0; N];
        self.begin_step(v, &mut sums);
        for (j, x) in from[..N].iter().enumerate() {
            let column = &self.transition.col_as_slice(j)[..N];
            for i in 0..N {
                sums[i] = column[i].mul_add(*x, sums[i]);
            }
        }
        to.copy_from_slice(&sums);
    }
}

/// Returns the matrix of `x' = M x + e_1 v` with the states `s^(n-1)/A v, ..., 1/A v`.
pub(crate) fn controller_form(a: &[f64]) -> Mat<f64> {
    let n = a.len();
    Mat::from_fn(n, n, |i, j| match i {
        0 => -a[j],
        _ if i == j + 1 => 1.0,
        _ => 0.0,
    })
}

/// Returns how `B/A v` follows from the states and v: `c' x + d v`, for numerators of at most n + 1 numbers.
pub(crate) fn output_of(b: &[f64], a: &[f64]) -> (Vec<f64>, f64) {
    let n = a.len();
    let direct = if b.len() > n { b[0] } else { 0.0 };
    let own = &b[b.len().saturating_sub(n)..];
    let mut c = vec![0.0; n];
    c[n - own.len()..].copy_from_slice(own);
    for (c, a) in c.iter_mut().zip(a) {
        *c -= direct * a;
    }
    (c, direct)
}

/// A number with its derivatives by all parameters would be dear; a matrix with its derivative by one is enough.
struct Directed {
    value: Mat<f64>,
    slope: Mat<f64>,
}

impl Hold {
    /// Returns how an input a share of the time after a sample follows from its values at this sample and the next.
    pub(crate) fn weights(self, share: f64) -> [f64; 2] {
        match self {
            Self::Zero => [1.0, 0.0],
            Self::First => [1.0 - share, share],
        }
    }

    /// Returns the rate of the input between two samples, in the same way.
    pub(crate) fn rates(self) -> [f64; 2] {
        match self {
            Self::Zero => [0.0, 0.0],
            Self::First => [-1.0, 1.0],
        }
    }
}

/// Returns the row `c' M` of the matrix of [`controller_form`].
pub(crate) fn row_times_form(c: &[f64], a: &[f64]) -> Vec<f64> {
    let next = |j: usize| c.get(j + 1).copied().unwrap_or(0.0);
    (0..c.len()).map(|j| next(j) - c[0] * a[j]).collect()
}

impl ContinuousModel {
    /// Does what [`LinearModel::set_units`] does.
    pub(crate) fn set_units(&mut self, units: Units, lost: &mut bool) {
        let count = self.numerator.len();
        let size = self.covariance.len().isqrt();
        let numerator = self.numerator.iter_mut();
        numerator.for_each(|b| multiply(b, units.gain(), lost));
        multiply_part(&mut self.covariance, size, 0..count, units.gain(), lost);
    }

    /// Returns the orders of the sampled model: n + 1 coefficients from q^0 on where u acts at once, else n from q^-1
    /// on; the whole samples of the dead time in front. A part of a sample is one coefficient more, from q^-1 on for a
    /// zero-order hold.
    pub fn sampled_orders(numerator: usize, n: usize, hold: Hold, dead_time: f64) -> Orders {
        let is_late = dead_time.fract() != 0.0;
        let at_once = hold == Hold::First || (numerator > n && !is_late);
        let whole = dead_time as usize;
        let nb = n + usize::from(at_once) + usize::from(is_late);
        Orders::output_error(nb, n, whole + usize::from(!at_once))
    }

    /// Whether a pole is fixed at 0.
    pub fn has_integrator(&self) -> bool {
        !self.numerator.is_empty() && self.denominator.last() == Some(&0.0)
    }

    /// Returns the parameters, `b_0 ... b_m, a_1 ... a_n`.
    pub fn parameters(&self) -> Vec<f64> {
        [&self.numerator, &self.denominator[1..]].concat()
    }

    /// Returns the standard errors of the parameters; `None` if there is no covariance.
    pub fn standard_errors(&self) -> Option<Vec<f64>> {
        let count = self.numerator.len() + self.denominator.len() - 1;
        (!self.covariance.is_empty()).then(|| (0..count).map(|i| self.error(i)).collect())
    }

    /// Returns the standard error of the dead time in seconds; `None` if it was not estimated or has no covariance, NaN
    /// beyond a million samples: where the leading coefficient of B(s) is 0, both change the output alike.
    pub fn dead_time_error(&self) -> Option<f64> {
        let count = self.numerator.len() + self.denominator.len().max(1) - 1;
        (self.covariance.len() > count * count).then(|| {
            let error = self.error(count);
            if error < 1e6 * self.step { error } else { f64::NAN }
        })
    }

    fn error(&self, i: usize) -> f64 {
        let n = self.covariance.len().isqrt();
        self.covariance[i * n + i].sqrt()
    }

    /// Returns the powers of the step that turn parameters per second into parameters per sample: a_i by i, b_j by the
    /// degree that it lacks to n, and the dead time, last, by -1.
    fn powers(&self) -> impl Iterator<Item = i32> {
        let (nb, n) = (self.numerator.len() as i32, self.denominator.len() as i32 - 1);
        (0..nb).map(move |j| n + 1 - nb + j).chain(1..=n).chain([-1])
    }

    /// Sets a model whose unit of time is the sample.
    pub(crate) fn set_per_sample(&mut self, b: &[f64], a: &[f64], covariance: &[f64]) {
        self.numerator.clear();
        self.numerator.extend_from_slice(b);
        self.denominator.clear();
        self.denominator.push(1.0);
        self.denominator.extend_from_slice(a);
        let scales: Vec<f64> = self.powers().map(|i| self.step.powi(-i)).collect();
        let places = self.numerator.iter_mut().chain(&mut self.denominator[1..]);
        places.zip(&scales).for_each(|(p, scale)| *p *= scale);
        self.covariance.clear();
        self.covariance.extend_from_slice(covariance);
        let size = covariance.len().isqrt().max(1);
        for (row, scale) in self.covariance.chunks_exact_mut(size).zip(&scales) {
            row.iter_mut().zip(&scales).for_each(|(p, other)| *p *= scale * other);
        }
    }

    /// Computes the sampled model `B(q)/F(q)` in `to`, whose orders are [`Self::sampled_orders`]. Returns the
    /// derivatives of its `(B, F)` by the parameters, row by row, and last by the dead time in seconds if the orders
    /// are those of a dead time with a part of a sample.
    ///
    /// With `x(k+1) = E x(k) + p u(k) + r u(k+1)`, `y = c'x + d u`: `F = det(z - E)` and
    /// `B = c' adj(z - E) (p + r z) + d F`, by the recursion of Faddeev and Leverrier. The output at a share of the
    /// time after a sample is another such c and d of the state of that sample.
    pub fn sample(&self, to: &mut LinearModel) -> Vec<f64> {
        let scaled = |(p, i): (f64, i32)| p * self.step.powi(i);
        let all: Vec<f64> = self.parameters().into_iter().zip(self.powers()).map(scaled).collect();
        let (b, a) = all.split_at(self.numerator.len());
        let (n, nb) = (a.len(), b.len());
        let whole = self.dead_time.floor();
        let (first, count) = (to.delay - whole as usize, to.orders().nb);
        let on_samples = Self::sampled_orders(nb, n, self.hold, whole);
        let is_late = (to.delay, count) != (on_samples.nk, on_samples.nb);
        let share = is_late.then_some(1.0 - (self.dead_time - whole));
        let width = all.len() + usize::from(is_late);
        let rows = count + n;
        let mut jacobian = vec![0.0; rows * width];
        let units = (0..nb).map(|j| (0..nb).map(|i| f64::from(u8::from(i == j))).collect());
        let units: Vec<Vec<f64>> = units.collect();
        for (column, unit) in units.iter().enumerate() {
            // B is linear in b.
            let [_, by_b, ..] = sampled_polynomials(unit, a, None, self.hold, share);
            for (row, value) in by_b[first..first + count].iter().enumerate() {
                jacobian[row * width + column] = *value;
            }
        }
        for i in 0..n {
            let [f, numerator, of_f, of_b, of_late] = sampled_polynomials(b, a, Some(i), self.hold, share);
            let slopes = of_b[first..first + count].iter().chain(&of_f[1..=n]);
            for (row, value) in slopes.enumerate() {
                jacobian[row * width + nb + i] = *value;
            }
            if is_late {
                for (row, value) in of_late[first..first + count].iter().enumerate() {
                    jacobian[row * width + nb + n] = *value;
                }
            }
            to.f.copy_from_slice(&f[..=n]);
            to.b[..to.delay].fill(0.0);
            to.b[to.delay..].copy_from_slice(&numerator[first..first + count]);
        }
        let scales: Vec<f64> = self.powers().map(|i| self.step.powi(i)).collect();
        for row in jacobian.chunks_exact_mut(width) {
            row.iter_mut().zip(&scales).for_each(|(d, scale)| *d *= scale);
        }
        jacobian
    }
}

/// An output `c'x + direct (v(k), v(k+1))` of the states at a sample, and its derivative by one a_i.
struct Reading {
    c: Vec<f64>,
    d_c: Vec<f64>,
    direct: [f64; 2],
    d_direct: [f64; 2],
}

impl Reading {
    /// Reads an output a share of the time after a sample, to which `way` goes: of the doubled system, whose second
    /// half is the state and whose first half is its derivative.
    fn after(c: Vec<f64>, d_c: Vec<f64>, direct: [f64; 2], way: Option<&Sampled>) -> Self {
        let Some(way) = way else {
            return Self {
                c,
                d_c,
                direct,
                d_direct: [0.0; 2],
            };
        };
        let n = c.len();
        let row = |c: &[f64], first: usize, j: usize| -> f64 {
            let terms = c.iter().enumerate();
            terms.map(|(i, c)| c * way.transition[(first + i, n + j)]).sum()
        };
        let dot = |c: &[f64], g: &[f64]| c.iter().zip(g).map(|(c, g)| c * g).sum::<f64>();
        let inputs = [&way.now, &way.next];
        Self {
            d_direct: inputs.map(|g| dot(&d_c, &g[n..]) + dot(&c, &g[..n])),
            direct: [0, 1].map(|i| direct[i] + dot(&c, &inputs[i][n..])),
            d_c: (0..n).map(|j| row(&d_c, n, j) + row(&c, 0, j)).collect(),
            c: (0..n).map(|j| row(&c, n, j)).collect(),
        }
    }
}

/// Returns F and B of the sampled `b/a` as polynomials in q^-1, their derivatives by a_i, and that of B by a dead
/// time in samples. With `share` the output is that at this share of the time after the sample before.
fn sampled_polynomials(b: &[f64], a: &[f64], by: Option<usize>, hold: Hold, share: Option<f64>) -> [Vec<f64>; 5] {
    let n = a.len();
    let form = controller_form(a);
    // exp [M dM; 0 M] = [exp M, its derivative; 0, exp M], for M with the input's columns.
    let mut input = vec![0.0; 2 * n];
    input[n] = 1.0;
    let doubled = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => form[(i, j)],
        (false, false) => form[(i - n, j - n)],
        (true, false) if i == 0 && Some(j - n) == by => -1.0,
        _ => 0.0,
    });
    let sampled = Sampled::new(doubled.as_ref(), &input, hold);
    let way = share.map(|share| Sampled::over(share, doubled.as_ref(), &input, hold));
    let e = Directed {
        value: sampled.transition.get(n.., n..).to_owned(),
        slope: sampled.transition.get(..n, n..).to_owned(),
    };
    let split = |both: &[f64]| [both[n..].to_vec(), both[..n].to_vec()];
    let [now, d_now] = split(&sampled.now);
    let [next, d_next] = split(&sampled.next);
    let (c, d) = output_of(b, a);
    let d_c: Vec<f64> = (0..n).map(|j| if by == Some(j) { -d } else { 0.0 }).collect();
    let weights = share.map_or([1.0, 0.0], |share| hold.weights(share));
    // A later output is an earlier state: its derivative by the dead time is less that by time, `c'(M x + e_1 v)`.
    let rates = hold.rates();
    let of_rate = [0, 1].map(|i| -(c[0] * weights[i] + d * rates[i]));
    let rate = row_times_form(&c, a).iter().map(|c| -c).collect();
    let late = Reading::after(rate, vec![0.0; n], of_rate, way.as_ref());
    let read = Reading::after(c, d_c, weights.map(|weight| d * weight), way.as_ref());
    let shift = usize::from(way.is_some());
    let mut polynomials = [(); 5].map(|()| vec![0.0; n + 2]);
    let [f, numerator, of_f, of_b, of_late] = &mut polynomials;
    f[0] = 1.0;
    let mut m = Directed {
        value: Mat::identity(n, n),
        slope: Mat::zeros(n, n),
    };
    let product = |c: &[f64], m: MatRef<'_, f64>, g: &[f64]| -> f64 {
        let row = |j: usize| (0..n).map(|i| c[i] * m[(i, j)]).sum::<f64>();
        (0..n).map(|j| row(j) * g[j]).sum()
    };
    for k in 1..=n {
        // m is the matrix beside z^(n-k) in adj(z - E).
        let (value, slope) = (m.value.as_ref(), m.slope.as_ref());
        for (g, d_g, at) in [(&now, &d_now, k + shift), (&next, &d_next, k - 1 + shift)] {
            numerator[at] += product(&read.c, value, g);
            of_b[at] += product(&read.d_c, value, g) + product(&read.c, slope, g) + product(&read.c, value, d_g);
            of_late[at] += product(&late.c, value, g);
        }
        let moved = Directed {
            slope: &e.slope * &m.value + &e.value * &m.slope,
            value: &e.value * &m.value,
        };
        let trace = |m: &Mat<f64>| (0..n).map(|i| m[(i, i)]).sum::<f64>() / k as f64;
        (f[k], of_f[k]) = (-trace(&moved.value), -trace(&moved.slope));
        m = moved;
        for i in 0..n {
            m.value[(i, i)] += f[k];
            m.slope[(i, i)] += of_f[k];
        }
    }
    for k in 0..=n {
        for (i, at) in [k + shift, k].into_iter().enumerate() {
            numerator[at] += read.direct[i] * f[k];
            of_b[at] += read.direct[i] * of_f[k] + read.d_direct[i] * f[k];
            of_late[at] += late.direct[i] * f[k];
        }
    }
    polynomials
}

#[cfg(test)]
mod tests;
