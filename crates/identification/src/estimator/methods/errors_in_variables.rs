//! Methods for records whose input is measured with noise too: errors in variables, `A y0 = B u0` with `y = y0 + white
//! noise` and `u = u0 + white noise`.
//!
//! With z(k) = (y(k) ... y(k-na), u(k-nk) ... u(k-nk-nb+1), earlier inputs), S the mean of z z' and c = (1, a, -b, 0),
//! the noise alone makes `S c` differ from zero: `S c = D c`, D = diag(v_y ... v_y, v_u ... v_u, 0 ... 0), v_y and v_u
//! the variances of the two noises. The methods differ in what they are told of D.
//!
//! Sources: T. Soderstrom, *Errors-in-variables methods in system identification*, Automatica 43 (2007), and *A
//! generalized instrumental variable estimation method for errors-in-variables identification problems*, Automatica 47
//! (2011); W. X. Zheng, *A bias correction method for identification of linear dynamic errors-in-variables models*,
//! IEEE Trans. Automatic Control 47 (2002); M. J. Levin, *Estimation of a system pulse transfer function in the
//! presence of noise*, IEEE Trans. Automatic Control 9 (1964) (total least squares).

mod options;

use crate::estimator::covariance::{Covariance, Influence};
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::instruments::TwoStages;
use crate::estimator::{FailureKind, Pass, SetupError, SinglePass, Window};
use crate::model::{LinearModel, Orders};
use faer::linalg::solvers::{Llt, SelfAdjointEigen};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatMut, Par, Side};
pub use options::{BelsOptions, IvCompensatedOptions, TlsOptions};

/// The most steps of a search, and the relative step at which it rests.
const MOST_STEPS: usize = 200;
const REST: f64 = 1e-10;

/// The relative rise of the sum that is rounding.
const ROUNDING: f64 = 1e-12;

/// How often the lines are weighted anew.
const WEIGHTINGS: usize = 2;

/// The least variance beside that of the signal that is not rounding below 0.
const NEGATIVE: f64 = 1e-9;

/// How often a step that raises the sum of squares is halved.
const HALVINGS: usize = 20;

/// Knowledge of the two variances.
#[derive(Clone, Copy, Debug)]
enum Noise {
    /// v_y / v_u.
    Ratio(f64),
    /// Those given; the others are estimated.
    Variances([Option<f64>; 2]),
}

/// The estimators of this file.
///
/// - `tls`: c is the eigenvector of the smallest eigenvalue v_u of `S c = v_u diag(rho ... rho, 1 ... 1) c`;
/// - `bels`: c and the unknown variances make the sum of squares of `(S - D) c`, each line over the size of its signal,
///   least, by steps of Gauss and Newton from the solution of the lines of the earlier inputs, which have no noise;
///   then twice the sum weighted with the inverse covariance of the lines' errors, by Bartlett's weights over lags,
///   from which most of the minima far from the truth are gone (L. P. Hansen, *Large sample properties of generalized
///   method of moments estimators*, Econometrica 50 (1982));
/// - `iv-compensated`: the same without the line of y(k), with all variances known: a linear problem, and least squares
///   without them.
///
/// The covariance is that of `P sum (z z' - D) c` over the samples, P being the derivative of the solution by the
/// equations, with sums over lags by Bartlett's weights, since z z' c is correlated.
pub struct ErrorsInVariables {
    orders: Orders,
    noise: Noise,
    /// The lines: those of y(k) (or not), of the regressors, of earlier inputs.
    lines: usize,
    first: usize,
    count: usize,
    /// S, row by row, of all signals.
    s: Vec<f64>,
    signals: usize,
    sizes: Vec<f64>,
    stages: TwoStages,
    /// (a, b), then the variances that are estimated.
    x: Vec<f64>,
    variances: [f64; 2],
    /// `L L'`, the covariance of the lines' errors up to a factor; `None`: the identity.
    weight: Option<Llt<f64>>,
    model: LinearModel,
    state: StateEstimate,
}

impl ErrorsInVariables {
    fn new(
        orders: Orders,
        noise: Noise,
        [earlier, present]: [usize; 2],
        start: StartState,
        window: usize,
    ) -> Result<Self, SetupError> {
        let width = orders.na + orders.nb;
        let unknown = match noise {
            Noise::Ratio(_) => 0,
            Noise::Variances(of) => of.iter().filter(|v| v.is_none()).count(),
        };
        let reach = orders.reach().max(orders.nk + orders.nb + earlier - 1);
        let count = window.saturating_sub(reach);
        let (signals, lines) = (1 + width + earlier, present + width + earlier);
        if width == 0 || count <= signals {
            return Err(SetupError::ShortRecord {
                orders,
                window,
                rows: count,
                needed: signals + 1,
            });
        }
        Ok(Self {
            noise,
            lines,
            first: reach,
            count,
            s: vec![0.0; signals * signals],
            signals,
            sizes: vec![0.0; signals],
            stages: TwoStages::new(width + unknown, width + unknown, lines),
            x: vec![0.0; width + unknown],
            variances: [0.0; 2],
            weight: None,
            model: LinearModel::zero(orders),
            state: StateEstimate::new(orders.order(), start),
            orders,
        })
    }

    /// Computes z(k).
    fn signals_at(&self, Window { u, y, .. }: Window<'_>, k: usize, z: &mut [f64]) {
        let Orders { na, nk, .. } = self.orders;
        let (of_y, of_u) = z.split_at_mut(na + 1);
        for (i, z) in of_y.iter_mut().enumerate() {
            *z = y[k - i];
        }
        for (i, z) in of_u.iter_mut().enumerate() {
            *z = u[k - nk - i];
        }
    }

    /// Computes S and the sizes of the signals.
    fn gather(&mut self, window: Window<'_>) -> Result<(), FailureKind> {
        let mut row = vec![0.0; self.signals];
        self.s.fill(0.0);
        for k in self.first..self.first + self.count {
            self.signals_at(window, k, &mut row);
            for (to, z) in self.s.chunks_exact_mut(self.signals).zip(&row) {
                to.iter_mut().zip(&row).for_each(|(to, other)| *to += z * other);
            }
        }
        let count = self.count as f64;
        self.s.iter_mut().for_each(|s| *s /= count);
        for (i, size) in self.sizes.iter_mut().enumerate() {
            *size = self.s[i * self.signals + i].sqrt();
        }
        match self.sizes.iter().copied().fold(f64::INFINITY, f64::min) {
            0.0 => Err(FailureKind::Singular),
            _ if self.sizes.iter().all(|size| size.is_finite()) => Ok(()),
            _ => Err(FailureKind::NonFinite),
        }
    }

    /// Returns c, and the variance of each signal's noise.
    fn c_and_d(&self, i: usize) -> [f64; 2] {
        let Orders { na, nb, .. } = self.orders;
        let [v_y, v_u] = self.variances;
        match i {
            0 => [1.0, v_y],
            _ if i <= na => [self.x[i - 1], v_y],
            _ if i <= na + nb => [-self.x[i - 1], v_u],
            _ => [0.0, 0.0],
        }
    }

    /// Returns the signal of a line.
    fn signal_of(&self, line: usize) -> usize {
        line + self.signals - self.lines
    }

    /// Returns a line of `(S - D) c` over the size of its signal, with its derivatives by x.
    fn line(&self, line: usize, slopes: &mut [f64]) -> f64 {
        let Orders { na, nb, .. } = self.orders;
        let at = self.signal_of(line);
        let row = &self.s[at * self.signals..][..self.signals];
        let [c, d] = self.c_and_d(at);
        let sum: f64 = row.iter().enumerate().map(|(i, s)| s * self.c_and_d(i)[0]).sum();
        for (j, slope) in slopes.iter_mut().take(na + nb).enumerate() {
            let own = if at == j + 1 { d } else { 0.0 };
            let sign = if j < na { 1.0 } else { -1.0 };
            *slope = sign * (row[j + 1] - own) / self.sizes[at];
        }
        if let Noise::Variances(known) = self.noise {
            let of = [at <= na, at > na && at <= na + nb];
            let unknown = of.into_iter().zip(known).filter(|(_, known)| known.is_none());
            for (slope, (own, _)) in slopes[na + nb..].iter_mut().zip(unknown) {
                *slope = if own { -c / self.sizes[at] } else { 0.0 };
            }
        }
        (sum - d * c) / self.sizes[at]
    }

    /// Takes the variances from x and from what is known.
    fn set_variances(&mut self) {
        let Noise::Variances(known) = self.noise else {
            return;
        };
        let mut estimated = self.x[self.orders.na + self.orders.nb..].iter();
        for (variance, known) in self.variances.iter_mut().zip(known) {
            *variance = known.or_else(|| estimated.next().copied()).unwrap_or(0.0);
        }
    }

    /// Computes the step of Gauss and Newton; only the lines from `first` on count.
    fn step(&mut self, first: usize) -> Result<f64, FailureKind> {
        let width = self.x.len();
        let equations = self.equations(first);
        let mut stages = std::mem::replace(&mut self.stages, TwoStages::new(1, 1, 1));
        let solved = stages.solve(self.lines - first, fill(&equations, width));
        self.stages = stages;
        solved
    }

    /// Returns the lines from `first` on: their derivatives by x, and their values; weighted, if all count.
    fn equations(&self, first: usize) -> Mat<f64> {
        let width = self.x.len();
        let mut equations = Mat::zeros(self.lines - first, width + 1);
        let mut slopes = vec![0.0; width];
        for line in first..self.lines {
            equations[(line - first, width)] = self.line(line, &mut slopes);
            for (j, slope) in slopes.iter().enumerate() {
                equations[(line - first, j)] = *slope;
            }
        }
        if let (Some(weight), 0) = (&self.weight, first) {
            solve_lower_triangular_in_place(weight.L(), equations.as_mut(), Par::Seq);
        }
        equations
    }

    fn sum_of_squares(&self) -> f64 {
        self.equations(0).col(self.x.len()).squared_norm_l2()
    }

    /// Weights the lines with the inverse covariance of their errors at x. Nothing changes where it is singular.
    fn weigh(&mut self, window: Window<'_>) -> bool {
        let [c, d] = [0, 1].map(|i| {
            let of = (0..self.signals).map(|at| self.c_and_d(at)[i]);
            of.collect::<Vec<f64>>()
        });
        let lines = self.lines;
        let mut z = vec![0.0; self.signals];
        let mut influence = Influence::default();
        let mut unused = vec![0.0; self.x.len()];
        let means: Vec<f64> = (0..lines).map(|line| self.line(line, &mut unused)).collect();
        for k in self.first..self.first + self.count {
            self.signals_at(window, k, &mut z);
            let e: f64 = z.iter().zip(&c).map(|(z, c)| z * c).sum();
            influence.push(lines, 1.0, |row| {
                for (line, row) in row.iter_mut().enumerate() {
                    let at = self.signal_of(line);
                    *row = (z[at] * e - d[at] * c[at]) / self.sizes[at] - means[line];
                }
            });
        }
        let mut all = Vec::new();
        influence.covariance(Covariance::Robust, &mut all);
        let covariance = Mat::from_fn(lines, lines, |i, j| all[i * lines + j] / self.count as f64);
        let found = covariance.llt(Side::Lower).ok();
        let is_found = found.is_some();
        self.weight = found.or(self.weight.take());
        is_found
    }

    /// Solves the equations of known and estimated variances.
    fn search(&mut self, window: Window<'_>, steps: &mut usize) -> Result<f64, FailureKind> {
        let width = self.orders.na + self.orders.nb;
        self.x.fill(0.0);
        self.set_variances();
        self.weight = None;
        if self.x.len() == width {
            return self.descend(steps);
        }
        if self.lines > 2 * width {
            self.start_without_noise(self.lines - width)?;
        }
        let mut found = self.descend(steps);
        for _ in 0..WEIGHTINGS {
            if found.is_err_and(|kind| !kind.leaves_a_model()) || !self.weigh(window) {
                break;
            }
            found = self.descend(steps);
        }
        found
    }

    /// Steps to the least sum of squares.
    fn descend(&mut self, steps: &mut usize) -> Result<f64, FailureKind> {
        let width = self.orders.na + self.orders.nb;
        let mut sum = self.sum_of_squares();
        for _ in 0..MOST_STEPS {
            *steps += 1;
            let condition = self.step(0)?;
            let before = self.x.clone();
            let mut share = 1.0;
            for halving in 0..=HALVINGS {
                let steps = before.iter().zip(&self.stages.theta);
                for (x, (old, step)) in self.x.iter_mut().zip(steps) {
                    *x = old + share * step;
                }
                self.set_variances();
                let new = self.sum_of_squares();
                // In the end rounding hides whether the sum falls.
                if new <= sum * (1.0 + ROUNDING) || halving == HALVINGS {
                    sum = new;
                    break;
                }
                share /= 2.0;
            }
            // A linear problem ends after its first step.
            let (largest, longest) = self.scaled();
            if !largest.is_finite() {
                return Err(FailureKind::NonFinite);
            }
            if self.x.len() == width || longest <= REST * largest {
                return Ok(condition);
            }
        }
        Err(FailureKind::IterationLimit)
    }

    /// Returns the largest of the unknowns and of the last step, each times the length of its column.
    fn scaled(&self) -> (f64, f64) {
        let pairs = self.x.iter().zip(&self.stages.theta).enumerate();
        pairs.fold((0.0, 0.0), |(x, step), (j, (new, change))| {
            let length = self.stages.length(j);
            (x.max((new * length).abs()), step.max((change * length).abs()))
        })
    }

    /// Starts from least squares of the lines without noise, from the line `first` on.
    fn start_without_noise(&mut self, first: usize) -> Result<(), FailureKind> {
        let width = self.orders.na + self.orders.nb;
        let mut stages = TwoStages::new(width, width, self.lines - first);
        let equations = self.equations(first);
        stages.solve(self.lines - first, fill(&equations, width))?;
        self.x[..width].copy_from_slice(&stages.theta);
        Ok(())
    }

    /// Solves the equations of a known ratio.
    fn smallest(&mut self, ratio: f64) -> Result<f64, FailureKind> {
        let (n, na) = (self.signals, self.orders.na);
        let root = |i: usize| if i <= na { ratio.sqrt() } else { 1.0 };
        let scaled = Mat::from_fn(n, n, |i, j| self.s[i * n + j] / (root(i) * root(j)));
        let eigen = SelfAdjointEigen::new(scaled.as_ref(), Side::Lower);
        let eigen = eigen.map_err(|_| FailureKind::NonFinite)?;
        let (values, vectors) = (eigen.S(), eigen.U());
        let lead = vectors[(0, 0)] / root(0);
        // Two smallest eigenvalues, or none of y(k) in the vector: no c.
        let gap = values[1] - values[0];
        let condition = values[n - 1] / gap;
        if !(condition.recip() >= 8.0 * n as f64 * f64::EPSILON) || lead == 0.0 {
            return Err(FailureKind::RankDeficient);
        }
        for i in 1..n {
            let c = vectors[(i, 0)] / (root(i) * lead);
            self.x[i - 1] = if i <= na { c } else { -c };
        }
        self.variances = [ratio * values[0], values[0]];
        Ok(condition)
    }

    /// Computes the covariance of (a, b).
    fn covariance(&mut self, window: Window<'_>) -> Result<(), FailureKind> {
        let width = self.orders.na + self.orders.nb;
        let ratio = matches!(self.noise, Noise::Ratio(_));
        // By the ratio, the equation of y(k) follows from the others.
        let first = usize::from(ratio);
        self.step(first)?;
        let total = self.x.len();
        let d_of = |i: usize| self.c_and_d(i);
        let c: Vec<f64> = (0..self.signals).map(|i| d_of(i)[0]).collect();
        let d: Vec<f64> = (0..self.signals).map(|i| d_of(i)[1]).collect();
        let energy: f64 = c.iter().zip(&d).map(|(c, d)| c * c * d).sum();
        let lines = self.lines - first;
        let mut slopes = self.equations(first);
        if let (Some(weight), 0) = (&self.weight, first) {
            solve_upper_triangular_in_place(weight.L().transpose(), slopes.as_mut(), Par::Seq);
        }
        let mut z = vec![0.0; self.signals];
        let mut influence = Influence::default();
        for k in self.first..self.first + self.count {
            self.signals_at(window, k, &mut z);
            let e: f64 = z.iter().zip(&c).map(|(z, c)| z * c).sum();
            influence.push(total, 1.0, |row| {
                for line in 0..lines {
                    let at = self.signal_of(first + line);
                    let noise = if ratio { e * e / energy } else { 1.0 };
                    let score = (z[at] * e - noise * d[at] * c[at]) / self.sizes[at];
                    for (j, row) in row.iter_mut().enumerate() {
                        *row += slopes[(line, j)] * score;
                    }
                }
                self.stages.solve_normal(row);
                for row in row.iter_mut() {
                    *row /= self.count as f64;
                }
            });
        }
        let mut all = Vec::new();
        influence.covariance(Covariance::Robust, &mut all);
        let rows = all.chunks_exact(total).take(width);
        self.model.covariance.clear();
        for row in rows {
            self.model.covariance.extend_from_slice(&row[..width]);
        }
        Ok(())
    }

    fn find(&mut self, window: Window<'_>, steps: &mut usize) -> Result<f64, FailureKind> {
        self.gather(window)?;
        match self.noise {
            Noise::Ratio(ratio) => self.smallest(ratio),
            Noise::Variances(_) => self.search(window, steps),
        }
    }

    /// Whether a variance is below 0.
    fn is_implausible(&self) -> bool {
        let signals = [0, self.orders.na + 1].map(|i| self.sizes.get(i).map_or(0.0, |size| size * size));
        let pairs = self.variances.iter().zip(signals);
        pairs.into_iter().any(|(v, of)| *v < -NEGATIVE * of)
    }
}

/// Fills the matrices of [`TwoStages`] with the first columns of equations and their last.
fn fill(equations: &Mat<f64>, width: usize) -> impl FnMut(usize, MatMut<'_, f64>, MatMut<'_, f64>) {
    move |from, mut z, mut right| {
        for row in 0..z.nrows() {
            for j in 0..width {
                z[(row, j)] = equations[(from + row, j)];
                right[(row, j)] = z[(row, j)];
            }
            right[(row, width)] = -equations[(from + row, equations.ncols() - 1)];
        }
    }
}

impl SinglePass for ErrorsInVariables {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let mut steps = 0;
        let mut found = self.find(window, &mut steps);
        if found.is_ok() && self.is_implausible() {
            found = Err(FailureKind::Implausible);
        }
        pass.iterations = (steps > 0).then_some(steps);
        if let Err(kind) = found
            && !kind.leaves_a_model()
        {
            return Err(kind);
        }
        let width = self.orders.na + self.orders.nb;
        self.model.set_parameters(&self.x[..width]);
        self.model.covariance.clear();
        pass.noise_variances = Some(self.variances);
        if found.is_ok() {
            self.covariance(window)?;
        }
        pass.set_model(&self.model, found.unwrap_or(f64::NAN))?;
        self.state.estimate(window, 0, pass);
        // The failure of stage 6 comes first.
        if pass.failure.is_some() {
            Ok(())
        } else {
            found.map(|_| ())
        }
    }
}

#[cfg(test)]
mod tests;
