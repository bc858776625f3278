//! Limits and asymptotic covariances from impulse responses: second-order theory written independently of that of
//! the crate, for open and closed loops. Soderstrom and Stoica, System Identification, chapters 7, 8, 10.

use asobench::observer::Gain;
use asobench::plant::StateSpace;
use faer::Mat;
use faer::linalg::solvers::Solve;

/// Samples of every impulse response: a pole at 0.95 has decayed to 4e-34 of its start.
const LENGTH: usize = 1500;

/// The impulse response of a rational filter.
pub fn response(numerator: &[f64], denominator: &[f64]) -> Vec<f64> {
    let mut g: Vec<f64> = Vec::with_capacity(LENGTH);
    for k in 0..LENGTH {
        let mut sum = numerator.get(k).copied().unwrap_or(0.0);
        for (i, d) in denominator.iter().enumerate().skip(1).take(k) {
            sum -= d * g[k - i];
        }
        g.push(sum);
    }
    g
}

fn convolve(a: &[f64], b: &[f64]) -> Vec<f64> {
    let length = LENGTH.min(a.len() + b.len() - 1);
    let term = |k: usize| {
        (k.saturating_sub(b.len() - 1)..=k.min(a.len() - 1))
            .map(|i| a[i] * b[k - i])
            .sum()
    };
    (0..length).map(term).collect()
}

fn correlation(a: &[f64], b: &[f64], lag: usize) -> f64 {
    a.iter().zip(b.iter().skip(lag)).map(|(a, b)| a * b).sum()
}

/// A stationary signal by its impulse responses from three independent white sources of unit variance: the reference
/// (the input in open loop), the noise's drive, and the input-measurement noise.
#[derive(Clone, Default)]
pub struct Signal([Vec<f64>; 3]);

impl Signal {
    fn through(&self, filter: &[f64]) -> Self {
        Self(
            self.0
                .each_ref()
                .map(|h| if h.is_empty() { Vec::new() } else { convolve(h, filter) }),
        )
    }

    /// `E[self(k) other(k + lag)]`.
    fn covariance(&self, other: &Self, lag: i64) -> f64 {
        let shift = lag.unsigned_abs() as usize;
        let pairs = self.0.iter().zip(&other.0);
        pairs
            .map(|(a, b)| {
                if lag >= 0 {
                    correlation(a, b, shift)
                } else {
                    correlation(b, a, shift)
                }
            })
            .sum()
    }
}

/// Measured signals, or their substitutes: the outputs and inputs of which regressors and instruments are made.
type Pair<'a> = (&'a Signal, &'a Signal);

/// `E[z phi']`, z and phi of n lags of two pairs, outputs negative.
fn moments(z: Pair<'_>, phi: Pair<'_>, n: usize) -> Mat<f64> {
    Mat::from_fn(2 * n, 2 * n, |i, j| {
        let (left, right) = (if i < n { z.0 } else { z.1 }, if j < n { phi.0 } else { phi.1 });
        let sign = if (i < n) == (j < n) { 1.0 } else { -1.0 };
        sign * left.covariance(right, (i % n) as i64 - (j % n) as i64)
    })
}

/// The process of one cell.
pub struct Population {
    pub n: usize,
    /// (alpha, beta).
    pub theta: Vec<f64>,
    /// Measured output, measured input, reference.
    y: Signal,
    u: Signal,
    r: Signal,
    /// `v = A(q) f` from the noise's drive.
    equation_error: Vec<f64>,
    /// The scaled noise f from its drive.
    pub noise: Vec<f64>,
}

/// The parts of a process; feedback `u = -K(q) y + r`, K = (numerator, denominator).
pub struct Made<'a> {
    pub plant: &'a StateSpace,
    pub amplitude: f64,
    pub noise: (&'a [f64], &'a [f64]),
    pub eta: f64,
    pub input_noise: f64,
    pub feedback: (&'a [f64], &'a [f64]),
}

impl Made<'_> {
    /// Responses of (y, u) to a sequence added to u and one added to the plant's output.
    fn run(&self, r: &[f64], f: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (alpha, h, n) = (self.plant.denominator(), self.plant.h(), self.plant.order());
        let (c, d) = self.feedback;
        let (mut x, mut y, mut u, mut fed) = (vec![], vec![], vec![], vec![]);
        let at = |s: &[f64], k: usize, i: usize| {
            if i <= k && k - i < s.len() { s[k - i] } else { 0.0 }
        };
        for k in 0..LENGTH {
            let now: f64 = (1..=n).map(|i| h[i - 1] * at(&u, k, i) - alpha[i] * at(&x, k, i)).sum();
            x.push(now);
            y.push(now + at(f, k, 0));
            let numerator: f64 = c.iter().enumerate().map(|(i, c)| c * at(&y, k, i)).sum();
            let denominator: f64 = d.iter().enumerate().skip(1).map(|(i, d)| d * at(&fed, k, i)).sum();
            fed.push(numerator - denominator);
            u.push(at(r, k, 0) - fed[k]);
        }
        (y, u)
    }

    pub fn population(&self) -> Population {
        let n = self.plant.order();
        let alpha = self.plant.denominator();
        let (y_r, u_r) = self.run(&[self.amplitude], &[]);
        let mut noise = response(self.noise.0, self.noise.1);
        let level = self.eta / 100.0;
        let scale = level * (correlation(&y_r, &y_r, 0) / correlation(&noise, &noise, 0)).sqrt();
        for f in &mut noise {
            *f *= scale;
        }
        let (y_w, u_w) = self.run(&[], &noise);
        let error = vec![self.input_noise / 100.0 * self.amplitude];
        Population {
            n,
            theta: [&alpha[1..], &self.plant.h()].concat(),
            equation_error: convolve(&noise, &alpha),
            noise,
            y: Signal([y_r, y_w, vec![]]),
            u: Signal([u_r, u_w, error]),
            r: Signal([vec![self.amplitude], vec![], vec![]]),
        }
    }
}

fn column(values: impl Fn(usize) -> f64, length: usize) -> Mat<f64> {
    Mat::from_fn(length, 1, |i, _| values(i))
}

fn model(p: &[f64]) -> Vec<f64> {
    let n = p.len() / 2;
    response(&[&[0.0], &p[n..]].concat(), &[&[1.0], &p[..n]].concat())
}

impl Population {
    /// The limit of `(Z'Phi)^-1 Z'y` of order m.
    fn limit(&self, z: Pair<'_>, m: usize) -> Vec<f64> {
        let matrix = moments(z, (&self.y, &self.u), m);
        let right = column(
            |i| match i.checked_sub(m) {
                None => -z.0.covariance(&self.y, i as i64 + 1),
                Some(i) => z.1.covariance(&self.y, i as i64 + 1),
            },
            2 * m,
        );
        let p = matrix.partial_piv_lu().solve(&right);
        (0..2 * m).map(|i| p[(i, 0)]).collect()
    }

    /// The limit of least squares of order m.
    pub fn least_squares(&self, m: usize) -> Vec<f64> {
        self.limit((&self.y, &self.u), m)
    }

    /// The limits of passes 0 ... `passes` with instruments from the measured input, each pass's from the model before.
    pub fn iterated(&self, passes: usize) -> Vec<Vec<f64>> {
        let mut limits = vec![self.least_squares(self.n)];
        for pass in 0..passes {
            let auxiliary = self.u.through(&model(&limits[pass]));
            limits.push(self.limit((&auxiliary, &self.u), self.n));
        }
        limits
    }

    /// `sigma_v^2 R^-1`: N times the covariance of least squares where v is white.
    pub fn least_squares_covariance(&self) -> Mat<f64> {
        let white = &self.equation_error;
        assert!(white[1..].iter().all(|v| v.abs() < 1e-9 * white[0]), "v is not white");
        let r = moments((&self.y, &self.u), (&self.y, &self.u), self.n);
        let unit = Mat::<f64>::identity(2 * self.n, 2 * self.n);
        let inverse = r.partial_piv_lu().solve(&unit);
        Mat::from_fn(2 * self.n, 2 * self.n, |i, j| white[0] * white[0] * inverse[(i, j)])
    }

    /// `(E z phi')^-1 E[z_H z_H'] (E z phi')^-T`, `v = H(q) w`, `z_H = H(q) z`: N times the covariance of IV with the
    /// instruments of the true model, driven by the reference (by the input in open loop).
    pub fn instruments_covariance(&self) -> Mat<f64> {
        self.covariance_with(&self.theta)
    }

    /// The same with the instruments of another model.
    pub fn covariance_with(&self, p: &[f64]) -> Mat<f64> {
        let (n, r) = (self.n, &self.r);
        let auxiliary = r.through(&model(p));
        let matrix = moments((&auxiliary, r), (&self.y, &self.u), n);
        let h = &self.equation_error;
        let filtered = (auxiliary.through(h), r.through(h));
        let z = (&filtered.0, &filtered.1);
        let middle = moments(z, z, n);
        let lu = matrix.partial_piv_lu();
        let half = lu.solve(&middle);
        lu.solve(half.transpose().to_owned())
    }

    /// `E |x - xhat|^2` of the observer with the true model: `sum_ij F^i g g' F'^j r(i - j)`, r the autocovariance of
    /// f.
    pub fn observer_error(&self, plant: &StateSpace, gain: &Gain) -> f64 {
        let n = self.n;
        let mut g = vec![0.0; n];
        gain.compute(plant.a(), &mut g);
        let mut columns = vec![g.clone()];
        for i in 0..80 {
            let last = &columns[i];
            let mut next: Vec<f64> = (0..n)
                .map(|row| {
                    if row + 1 < n {
                        last[row + 1]
                    } else {
                        correlation(plant.a(), last, 0)
                    }
                })
                .collect();
            next.iter_mut().zip(&g).for_each(|(next, g)| *next -= g * last[0]);
            columns.push(next);
        }
        let r: Vec<f64> = (0..columns.len())
            .map(|lag| correlation(&self.noise, &self.noise, lag))
            .collect();
        let pairs = columns
            .iter()
            .enumerate()
            .flat_map(|(i, a)| columns.iter().enumerate().map(move |(j, b)| (i, a, j, b)));
        pairs.map(|(i, a, j, b)| correlation(a, b, 0) * r[i.abs_diff(j)]).sum()
    }

    /// `tr (D'D)^-1 D' Cov(f) D (D'D)^-1`: `E |x0 - x0hat|^2` of stage 6 with the true model.
    pub fn initial_state_error(&self, plant: &StateSpace) -> f64 {
        const ROWS: usize = 120;
        let n = self.n;
        let mut rows = Mat::<f64>::zeros(ROWS, n);
        for k in 0..ROWS {
            for j in 0..n {
                // c'A^(k+1) = (c'A^k) A.
                rows[(k, j)] = if k < n {
                    f64::from(u8::from(k == j))
                } else {
                    rows[(k - 1, n - 1)] * plant.a()[j] + if j > 0 { rows[(k - 1, j - 1)] } else { 0.0 }
                };
            }
        }
        let lu = (rows.transpose() * &rows).partial_piv_lu();
        let pseudo = lu.solve(rows.transpose().to_owned());
        let covariance = Mat::from_fn(ROWS, ROWS, |i, j| correlation(&self.noise, &self.noise, i.abs_diff(j)));
        let product = &pseudo * &covariance * pseudo.transpose();
        (0..n).map(|i| product[(i, i)]).sum()
    }
}

/// a, h and b of p.
pub fn parts(p: &[f64]) -> [Vec<f64>; 3] {
    let n = p.len() / 2;
    let plant = StateSpace::from_polynomials(&p[..n], &p[n..]).unwrap();
    [plant.a().to_vec(), p[n..].to_vec(), plant.b().to_vec()]
}

/// The covariance of one part (0: a, 1: h, 2: b) by the delta method, over the part's squared length: the mean of the
/// squared relative error, if `covariance` is that of p.
pub fn relative_covariance(theta: &[f64], covariance: &Mat<f64>, part: usize) -> Mat<f64> {
    let count = theta.len();
    let n = count / 2;
    let moved = |j: usize, step: f64| {
        let mut p = theta.to_vec();
        p[j] += step;
        parts(&p)[part].clone()
    };
    const STEP: f64 = 1e-5;
    let jacobian: Vec<Vec<f64>> = (0..count)
        .map(|j| {
            moved(j, STEP)
                .iter()
                .zip(moved(j, -STEP))
                .map(|(up, down)| (up - down) / (2.0 * STEP))
                .collect()
        })
        .collect();
    let jacobian = Mat::from_fn(n, count, |i, j| jacobian[j][i]);
    let size: f64 = parts(theta)[part].iter().map(|v| v * v).sum();
    let result = &jacobian * covariance * jacobian.transpose();
    Mat::from_fn(n, n, |i, j| result[(i, j)] / size)
}

pub fn trace(matrix: &Mat<f64>) -> f64 {
    (0..matrix.nrows()).map(|i| matrix[(i, i)]).sum()
}

/// `E 1/|x|^2` of the stationary state under +-`amplitude`: the mean over all sequences of 2^16 signs, before which the
/// plant rests (what is cut off is 0.4^16 = 4e-7 of the state).
pub fn inverse_square_of_state(plant: &StateSpace, amplitude: f64) -> f64 {
    const SIGNS: usize = 16;
    let n = plant.order();
    // x = sum_i A^i b u(k-1-i): the Markov parameters from i + 1 on.
    let mut weights = vec![plant.b().to_vec()];
    for i in 1..SIGNS {
        let last = &weights[i - 1];
        let row = |j: usize| {
            if j + 1 < n {
                last[j + 1]
            } else {
                correlation(plant.a(), last, 0)
            }
        };
        let next = (0..n).map(row).collect();
        weights.push(next);
    }
    let inverse = |signs: usize| {
        let mut x = vec![0.0; n];
        for (i, weight) in weights.iter().enumerate() {
            let u = if signs >> i & 1 == 1 { amplitude } else { -amplitude };
            x.iter_mut().zip(weight).for_each(|(x, w)| *x += w * u);
        }
        1.0 / x.iter().map(|x| x * x).sum::<f64>()
    };
    (0..1 << SIGNS).map(inverse).sum::<f64>() / f64::from(1 << SIGNS)
}
