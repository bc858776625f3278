//! The covariance of an estimate from the contribution of each equation to its error,
//! `theta_hat - theta = sum over k of psi(k) v(k)`, whatever the correlation of the equation errors v.

use super::autoregression::Autoregression;
use super::triangular::solve_normal_of;
use crate::names::named_enum;
use faer::MatRef;

named_enum! {
    /// The assumption about the equation errors v from which the covariance of the parameters is computed.
    Covariance, "covariance" {
        /// They are white (the default).
        White = "white",
        /// They are coloured and independent of the instruments: `v = e / D(q)`. D is an autoregression of the
        /// residuals by Yule-Walker, with its order chosen by AIC.
        Coloured = "coloured",
        /// Nothing is assumed: sums over lags with Bartlett's weights (Newey and West 1987).
        Robust = "robust",
    }
}

/// Numbers that are computed side by side.
const LANES: usize = 4;
type Lanes = [f64; LANES];

/// Rows that are solved side by side.
pub(super) const ROWS: usize = 8;

/// The rows psi(k) with the residuals v(k) of an estimate.
#[derive(Default)]
pub(super) struct Influence {
    /// Row by row, one number for each parameter, and zeros to whole lanes.
    rows: Vec<Lanes>,
    /// Numbers of a row.
    width: usize,
    residuals: Vec<f64>,
    autoregression: Autoregression,
    /// Some rows, one in each lane.
    block: Vec<[f64; ROWS]>,
}

impl Influence {
    /// Removes all rows and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.residuals.clear();
    }

    /// Appends v(k) and psi(k). `row` fills psi(k), which starts as zeros; all rows have the same width.
    pub(super) fn push(&mut self, width: usize, residual: f64, row: impl FnOnce(&mut [f64])) {
        self.width = width;
        let begin = self.rows.len();
        self.rows.resize(begin + self.stride(), [0.0; LANES]);
        row(&mut self.rows[begin..].as_flattened_mut()[..width]);
        self.residuals.push(residual);
    }

    /// Replaces all rows by `(R'R)^-1 psi(k)`.
    pub(super) fn solve_normal(&mut self, r: MatRef<'_, f64>) {
        let (width, stride) = (self.width, self.stride());
        let Self { rows, block, .. } = self;
        block.resize(width, [0.0; ROWS]);
        with_fma!(|| {
            for rows in rows.chunks_mut(ROWS * stride.max(1)) {
                for (lane, row) in rows.chunks_exact(stride).enumerate() {
                    for (to, x) in block.iter_mut().zip(row.as_flattened()) {
                        to[lane] = *x;
                    }
                }
                solve_normal_of(r, block);
                for (lane, row) in rows.chunks_exact_mut(stride).enumerate() {
                    for (x, from) in row.as_flattened_mut().iter_mut().zip(&*block) {
                        *x = from[lane];
                    }
                }
            }
        });
    }

    /// Returns how many groups of lanes a row has.
    fn stride(&self) -> usize {
        self.width.div_ceil(LANES)
    }

    /// Computes the covariance, row by row. All kinds carry the factor M / (M - d) for M rows and d parameters.
    ///
    /// - white: `s^2 sum psi psi'`, `s^2 = sum v^2 / M`;
    /// - coloured: `lambda sum psi_D psi_D'`, `psi_D(k) = psi(k+0) + h_1 psi(k+1) + ...` with
    ///   `1/D = 1 + h_1 q^-1 + ...`, over all k for which it is not 0 (Soderstrom and Stoica 1989, section 8.2);
    /// - robust: `S_0 + sum_(t=1)^L (1 - t/(L+1)) (S_t + S_t')`, `S_t = sum psi(k) v(k) v(k-t) psi(k-t)'`,
    ///   `L = floor(4 (M/100)^(2/9))`.
    pub(super) fn covariance(&mut self, kind: Covariance, to: &mut Vec<f64>) {
        let (rows, width) = (self.residuals.len(), self.width);
        to.clear();
        to.resize(width * width, 0.0);
        let scale = match kind {
            Covariance::White => {
                self.add_products(1.0, 0, false, to);
                square_sum(&self.residuals) / rows as f64
            }
            Covariance::Coloured => {
                let variance = self.autoregression.fit(&self.residuals);
                self.filter();
                self.add_products(1.0, 0, true, to);
                self.add_before(to);
                variance
            }
            Covariance::Robust => {
                let stride = self.stride();
                for (row, v) in self.rows.chunks_exact_mut(stride).zip(&self.residuals) {
                    row.as_flattened_mut().iter_mut().for_each(|psi| *psi *= v);
                }
                let lags = (4.0 * (rows as f64 / 100.0).powf(2.0 / 9.0)) as usize;
                for lag in 0..=lags.min(rows - 1) {
                    let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
                    self.add_products(weight, lag, false, to);
                }
                1.0
            }
        };
        let scale = scale * rows as f64 / (rows as f64 - width as f64);
        for x in to {
            *x *= scale;
        }
    }

    /// Adds `weight psi(k) psi(k-lag)'` for each k, from the first or from the last on, and its transpose if the lag is
    /// not 0.
    fn add_products(&self, weight: f64, lag: usize, backwards: bool, to: &mut [f64]) {
        let (width, stride) = (self.width, self.stride());
        for (i, j) in (0..stride).flat_map(|i| (0..stride).map(move |j| (i, j))) {
            let mut sum = [[0.0; LANES]; LANES];
            for_each_entry([i, j], width, |at, [row, column]| sum[row][column] = to[at]);
            let sum = with_fma!(|| self.sum_of_products([i, j], weight, lag, backwards, sum));
            for_each_entry([i, j], width, |at, [row, column]| to[at] = sum[row][column]);
        }
    }

    /// One block of such a sum, by value: it stays in registers.
    #[inline(always)]
    fn sum_of_products(
        &self,
        [i, j]: [usize; 2],
        weight: f64,
        lag: usize,
        backwards: bool,
        mut sum: [Lanes; LANES],
    ) -> [Lanes; LANES] {
        let (count, stride) = (self.residuals.len(), self.stride());
        for k in lag..count {
            let k = if backwards { count - 1 - k + lag } else { k };
            let [early, late] = [k - lag, k].map(|k| &self.rows[k * stride..][..stride]);
            add_product(&mut sum, weight, late[i], early[j]);
            if lag > 0 {
                add_product(&mut sum, weight, early[i], late[j]);
            }
        }
        sum
    }

    /// Overwrites psi by psi_D, from the end: `psi_D(k) = psi(k) - d_1 psi_D(k+1) - ...`.
    fn filter(&mut self) {
        let stride = self.stride();
        let (d, rows) = (&self.autoregression.denominator()[1..], &mut self.rows);
        with_fma!(|| {
            for at in (0..rows.len()).rev() {
                let (row, later) = rows[at..].split_first_mut().expect("at is below its length");
                for (d, later) in d.iter().zip(later.iter().skip(stride - 1).step_by(stride)) {
                    row.iter_mut().zip(later).for_each(|(x, y)| *x -= d * y);
                }
            }
        });
    }

    /// Adds the contribution of e before the first row: the recursion of psi_D continues without new rows until it has
    /// died away.
    fn add_before(&self, to: &mut [f64]) {
        const NEGLIGIBLE: f64 = 1e-24;
        let (d, width) = (&self.autoregression.denominator()[1..], self.width);
        if d.is_empty() {
            return;
        }
        let first = self.rows.chunks_exact(self.stride()).take(d.len());
        let mut recent: Vec<f64> = first.flat_map(|row| &row.as_flattened()[..width]).copied().collect();
        let limit = NEGLIGIBLE * square_sum(&recent);
        for _ in 0..self.residuals.len() {
            let mut row = vec![0.0; width];
            for (d, later) in d.iter().zip(recent.chunks_exact(width)) {
                row.iter_mut().zip(later).for_each(|(x, y)| *x -= d * y);
            }
            for (to, x) in to.chunks_exact_mut(width).zip(&row) {
                to.iter_mut().zip(&row).for_each(|(to, y)| *to += x * y);
            }
            recent.rotate_right(width);
            recent[..width].copy_from_slice(&row);
            if square_sum(&recent) <= limit {
                break;
            }
        }
    }
}

/// Calls `entry` for each entry of block (i, j) of a square matrix: its place in the matrix, stored row by row, and in
/// the block.
fn for_each_entry([i, j]: [usize; 2], width: usize, mut entry: impl FnMut(usize, [usize; 2])) {
    let within = |block: usize| 0..LANES.min(width - block * LANES);
    for row in within(i) {
        for column in within(j) {
            entry((i * LANES + row) * width + j * LANES + column, [row, column]);
        }
    }
}

/// Adds `weight x y'` to a matrix.
#[inline(always)]
fn add_product(to: &mut [Lanes; LANES], weight: f64, x: Lanes, y: Lanes) {
    for (row, x) in to.iter_mut().zip(x) {
        let x = weight * x;
        row.iter_mut().zip(y).for_each(|(to, y)| *to += x * y);
    }
}

fn square_sum(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Returns the number of rows minus that of parameters, if it is positive.
pub(super) fn freedom(rows: usize, parameters: usize) -> Option<f64> {
    (rows > parameters).then(|| (rows - parameters) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{
        ArxOptions, IvDelayedOptions, IvOptions, LsOptions, Method, MethodKind, OeOptions, Pass, Problem, Shape, Window,
    };
    use crate::model::Orders;

    const N: usize = 200;

    /// Returns a record that other programs can reproduce: `v = e / (1 - 0.8 q^-1)`,
    /// `y(k) = 1.5 y(k-1) - 0.7 y(k-2) + u(k-1) + 0.5 u(k-2) + 0.3 v(k)`.
    fn record() -> [Vec<f64>; 2] {
        let mut u = vec![0.0; N];
        let (mut v, mut y) = (u.clone(), u.clone());
        for k in 0..N {
            let square = (k * k) as f64;
            u[k] = (0.37 * square).sin();
            let past = |x: &[f64], lag: usize| k.checked_sub(lag).map_or(0.0, |k| x[k]);
            v[k] = (1.9 * square + k as f64).cos() + 0.8 * past(&v, 1);
            y[k] = 1.5 * past(&y, 1) - 0.7 * past(&y, 2) + past(&u, 1) + 0.5 * past(&u, 2) + 0.3 * v[k];
        }
        [u, y]
    }

    fn passes(options: &dyn MethodKind, count: usize) -> Vec<Pass> {
        let [u, y] = record();
        let shape = Shape { order: 2, window: N };
        let problem = Problem {
            covariance: true,
            ..shape.into()
        };
        let mut passes = vec![Pass::new(2); count];
        let mut estimator = options.prepare(&problem).unwrap();
        estimator.estimate(Window::new(&u, &y, N), &mut passes);
        passes
    }

    fn errors(options: &dyn MethodKind) -> Vec<f64> {
        passes(options, 1)[0].model.standard_errors().unwrap()
    }

    fn check(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }

    /// Robust: statsmodels 0.14, `OLS(...).fit(cov_type="HAC", cov_kwds={"maxlags": 4, "use_correction": True})`.
    /// Coloured: `psi' R psi M/(M-4)`, R being the Toeplitz matrix of `arma_acovf` of its `yule_walker` of order 1, the
    /// order that AIC takes.
    #[test]
    fn least_squares_against_statsmodels() {
        let arx = |kind| ArxOptions {
            covariance: Some(kind),
            ..ArxOptions::default()
        };
        let robust = [
            0.0183707304118283,
            0.02052830984083,
            0.0280277457916401,
            0.0324995936331327,
        ];
        check(&errors(&arx(Covariance::Robust)), &robust);
        let coloured = [
            0.0210296326737988,
            0.0220495160979496,
            0.0305745741041869,
            0.031252280386613,
        ];
        check(&errors(&arx(Covariance::Coloured)), &coloured);
        // The paper's form is the same regression.
        let ls = LsOptions {
            covariance: Some(Covariance::Robust),
            ..LsOptions::default()
        };
        check(&errors(&ls), &robust);
    }

    /// The same by numpy, with the regressors' projection on nine delayed inputs instead of psi's regressors.
    #[test]
    fn two_stage_least_squares_against_numpy() {
        let of = |kind| IvDelayedOptions {
            covariance: Some(kind),
            ..IvDelayedOptions::default()
        };
        let robust = [
            0.0227517697167617,
            0.0239345712807164,
            0.0283218720291425,
            0.030668672046655,
        ];
        check(&errors(&of(Covariance::Robust)), &robust);
        let coloured = [
            0.021743752763367,
            0.0237063648586335,
            0.0313897282537495,
            0.0295440892258291,
        ];
        check(&errors(&of(Covariance::Coloured)), &coloured);
    }

    /// The paper's passes have the covariances of the general form, which other code computes.
    #[test]
    fn passes_of_the_paper_as_in_the_general_form() {
        for kind in [Covariance::White, Covariance::Coloured, Covariance::Robust] {
            let paper = IvOptions {
                covariance: Some(kind),
                ..IvOptions::default()
            };
            let general = IvOptions {
                orders: Some(Orders::arx(2, 2, 1)),
                ..paper.clone()
            };
            for (paper, general) in passes(&paper, 5).iter().zip(passes(&general, 5)) {
                let [paper, general] = [&paper.model, &general.model].map(|of| of.standard_errors().unwrap());
                check(&paper, &general);
            }
        }
    }

    /// A pass that is not reported has no covariance; the others have the same as before.
    #[test]
    fn covariances_of_reported_passes_alone() {
        let [u, y] = record();
        let shape = Shape { order: 2, window: N };
        let errors = |reported: &[usize]| {
            let options = IvOptions {
                covariance: Some(Covariance::Robust),
                ..IvOptions::default()
            };
            let method = Method::named("iv", options).reporting(reported).unwrap();
            let mut passes = vec![Pass::new(2); 4];
            let problem = Problem {
                covariance: true,
                ..shape.into()
            };
            let mut estimator = method.prepare(problem).unwrap();
            estimator.estimate(Window::new(&u, &y, N), &mut passes);
            passes.into_iter().map(|pass| pass.model.standard_errors())
        };
        let all: Vec<_> = errors(&[0, 1, 2, 3]).collect();
        assert!(all.iter().all(Option::is_some));
        for reported in [&[2][..], &[0, 3]] {
            for (pass, found) in errors(reported).enumerate() {
                let expected = reported.contains(&pass).then(|| all[pass].clone());
                assert_eq!(found, expected.flatten(), "{pass}");
            }
        }
    }

    /// If the filter is 1, the sums are those of white errors. A covariance that is not asked for is not computed.
    #[test]
    fn of_white_errors_all_are_near() {
        let [u, _] = record();
        let mut y = vec![0.0; N];
        for k in 1..N {
            let white = (1.9 * (k * k) as f64).cos();
            y[k] = u[k - 1] + 0.5 * white;
        }
        let of = |kind| {
            let options = OeOptions {
                orders: Some("nb=1,nk=1".parse().unwrap()),
                covariance: Some(kind),
                ..OeOptions::default()
            };
            let mut passes = [Pass::new(1)];
            let shape = Shape { order: 1, window: N };
            let mut estimator = options.prepare(&shape.into()).unwrap();
            estimator.estimate(Window::new(&u, &y, N), &mut passes);
            passes[0].model.standard_errors().unwrap()[0]
        };
        let white = of(Covariance::White);
        for kind in [Covariance::Coloured, Covariance::Robust] {
            assert!((of(kind) / white - 1.0).abs() < 0.2, "{kind}");
        }
        let shape = Shape { order: 2, window: N };
        let mut passes = [Pass::new(2)];
        let mut ls = LsOptions::default().prepare(&shape.into()).unwrap();
        ls.estimate(Window::new(&u, &y, N), &mut passes);
        assert_eq!(passes[0].model.standard_errors(), None);
    }
}
