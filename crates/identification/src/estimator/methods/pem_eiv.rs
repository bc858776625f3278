//! Maximum likelihood in errors in variables: `u = r + w_u`, `y = B/F r + w_y`, where r, `w_u` and `w_y` are white and
//! Gaussian, zero before the record, and their variances `s_r, s_u, s_y` are unknown.
//!
//! Given u, y is Gaussian: with `a = s_r + s_u`, `kappa = s_r / a`, `q = s_r s_u / a` the equation errors
//! `w = F y - kappa B u` have mean 0 and the band covariance `R = q T_B T_B' + s_y T_F T_F' = L L'`, T_c being the
//! Toeplitz matrix of a polynomial, and u is white with variance a. So, exactly and in O(N n^2),
//!
//! ```text
//! -2 log p(u, y) = N log a + u'u / a + 2 sum_k log l_kk + sum_k eps(k)^2,   eps = L^-1 w,
//! ```
//!
//! up to a constant. Steps are those of Fisher's scoring over b, f and the logarithms of the variances, with
//! `F_ij = sum_k (nu_i nu_j + 2 lambda_i lambda_j) + N a_i a_j / (2 a^2)`, `lambda_i` the derivative of `log l_kk` and
//! `nu_i = eps_i + lambda_i eps`. No filter is run backwards and nothing is divided by F, so that any F is covered.
//!
//! Source: T. Soderstrom, *Errors-in-Variables Methods in System Identification*, 2018, chapter 9.

use super::output_error_iteration::output_error;
use crate::estimator::band::BandRoot;
use crate::estimator::lag_sums::dot;
use crate::estimator::method_kind::{MethodKind, Needs, OptionUnits, Problem, options};
use crate::estimator::option_error::OptionError;
use crate::estimator::prediction_error::{SearchStarts, solve_positive};
use crate::estimator::{
    BelsOptions, Estimator, FailureKind, OeOptions, Pass, SetupError, SinglePass, Window, enough_equations,
};
use crate::model::polynomial::{delayed, extent, filter, multiply};
use crate::model::{LinearModel, Orders};
use faer::Mat;

/// The variances of r, `w_u` and `w_y`.
const VARIANCES: usize = 3;

/// The squared distance of the minimum, in standard deviations, at which the search rests, and the largest at which it
/// may end where no step helps.
const REST: f64 = 1e-16;
const FLAT: f64 = 1e-8;
const MOST_ITERATIONS: usize = 200;
const HALVINGS: usize = 30;

/// The shares of u's variance that its noise has at the starts.
const SHARES: [f64; 3] = [0.02, 0.1, 0.4];

/// A variance below this share of its signal's is at its border, 0.
const NOTHING: f64 = 1e-8;

options! {
    /// The options of `pem-eiv`.
    pub struct PemEivOptions {
        /// Orders nb, nf and the delay nk, such as nb=2,nf=2,nk=1; by default nb = nf = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The starts of the search: rule, the models of bels and of least squares of the output error; a number, that
        /// of random starts of the latter; truth, the true plant alone.
        pub starts: SearchStarts,
    }
}

impl MethodKind for PemEivOptions {
    fn check(&self) -> Result<(), OptionError> {
        let orders = OeOptions {
            orders: self.orders,
            ..OeOptions::default()
        };
        orders.check()
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(output_error(self.orders, setting))
    }

    fn needs(&self) -> Needs {
        self.starts.needs()
    }

    fn option_units(&self) -> OptionUnits {
        self.starts.option_units()
    }

    fn begins_at_rest(&self) -> bool {
        true
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let orders = self.model_orders(problem.shape.order).unwrap_or_default();
        let Orders { nb, nf, nk, .. } = orders;
        let window = problem.shape.window;
        enough_equations(orders, window, window, orders.parameters() + VARIANCES + 1)?;
        let model = LinearModel::zero(orders);
        if self.starts == SearchStarts::Truth {
            let truth = problem.known.ok_or(SetupError::NoKnownPlant)?;
            plant(&truth.pass().model, orders).ok_or(SetupError::TruthOfOtherOrders { orders })?;
            let starts: Vec<Box<dyn Estimator>> = vec![Box::new(truth.clone())];
            return Ok(Box::new(NoisyInput { starts, model }));
        }
        let of_output = OeOptions {
            orders: Some(orders),
            starts: self.starts,
            ..OeOptions::default()
        };
        let problem = Problem {
            is_start: true,
            covariance: false,
            ..*problem
        };
        let mut starts = vec![of_output.prepare(&problem)?];
        // A record may be too short for it.
        let instrumental = BelsOptions {
            orders: Some(Orders::arx(nf, nb, nk)),
            ..BelsOptions::default()
        };
        if let Ok(start) = instrumental.prepare(&problem) {
            starts.push(start);
        }
        Ok(Box::new(NoisyInput { starts, model }))
    }
}

/// Searches from each start; the lowest minimum is taken.
struct NoisyInput {
    starts: Vec<Box<dyn Estimator>>,
    model: LinearModel,
}

/// A point of the search: b, f and the logarithms of the variances.
struct Point {
    theta: Vec<f64>,
    /// Half of `-2 log p`.
    loss: f64,
    root: BandRoot,
    errors: Vec<f64>,
}

/// `a, kappa, q, s_y`, and their derivatives by the logarithms of the variances.
struct Levels {
    values: [f64; 4],
    slopes: [[f64; VARIANCES]; 4],
}

impl Levels {
    fn new(logarithms: &[f64]) -> Self {
        let [r, u, y] = [0, 1, 2].map(|i| libm::exp(logarithms[i]));
        let a = r + u;
        let product = r * u / (a * a);
        Self {
            values: [a, r / a, r * u / a, y],
            slopes: [
                [r, u, 0.0],
                [product, -product, 0.0],
                [product * u, product * r, 0.0],
                [0.0, 0.0, y],
            ],
        }
    }
}

/// The likelihood of a record.
struct Likelihood<'a> {
    window: Window<'a>,
    model: LinearModel,
}

impl Likelihood<'_> {
    /// `None` if R is not positive definite or a number overflows.
    fn at(&mut self, theta: Vec<f64>) -> Option<Point> {
        let Window { u, y, .. } = self.window;
        let (of_plant, logarithms) = theta.split_at(theta.len() - VARIANCES);
        self.model.set_parameters(of_plant);
        let LinearModel { b, f, .. } = &self.model;
        let [a, kappa, q, s_y] = Levels::new(logarithms).values;
        let root = BandRoot::new(&[(q, b), (s_y, f)], y.len())?;
        let (mut errors, mut input) = (vec![0.0; y.len()], vec![0.0; y.len()]);
        filter(f, y, &mut errors);
        filter(b, u, &mut input);
        for (e, x) in errors.iter_mut().zip(&input) {
            *e -= kappa * x;
        }
        root.solve(&mut errors);
        let count = y.len() as f64;
        let of_input = 0.5 * (count * libm::log(a) + dot(u, u) / a);
        let logarithm: f64 = (0..y.len()).map(|k| libm::log(root.at(k, k))).sum();
        let loss = of_input + logarithm + 0.5 * dot(&errors, &errors);
        loss.is_finite().then_some(Point {
            theta,
            loss,
            root,
            errors,
        })
    }

    /// Half the gradient of `-2 log p` and the information.
    fn slopes(&mut self, at: &Point) -> (Vec<f64>, Mat<f64>) {
        let Window { u, y, .. } = self.window;
        let (of_plant, logarithms) = at.theta.split_at(at.theta.len() - VARIANCES);
        self.model.set_parameters(of_plant);
        let LinearModel { b, f, delay, .. } = &self.model;
        let levels = Levels::new(logarithms);
        let [a, kappa, q, s_y] = levels.values;
        let mut input = vec![0.0; u.len()];
        filter(b, u, &mut input);
        let unit = |i: usize| {
            let mut lag = vec![0.0; i + 1];
            lag[i] = 1.0;
            lag
        };
        let mut pairs: Vec<[Vec<f64>; 2]> = Vec::new();
        let mut add = |mut errors: Vec<f64>, terms: &[(f64, &[f64], &[f64])]| {
            let by = at.root.derivative(terms);
            by.subtract_product(&at.errors, &mut errors);
            at.root.solve(&mut errors);
            let lambda: Vec<f64> = (0..y.len()).map(|k| by.at(k, k) / at.root.at(k, k)).collect();
            pairs.push([errors, lambda]);
        };
        for i in *delay..b.len() {
            add(delayed(u, i, -kappa), &[(q, b, &unit(i)), (q, &unit(i), b)]);
        }
        for i in 1..f.len() {
            add(delayed(y, i, 1.0), &[(s_y, f, &unit(i)), (s_y, &unit(i), f)]);
        }
        for i in 0..VARIANCES {
            let [_, of_kappa, of_q, of_y] = levels.slopes.map(|slopes| slopes[i]);
            add(delayed(&input, 0, -of_kappa), &[(of_q, b, b), (of_y, f, f)]);
        }
        let (size, count) = (at.theta.len(), y.len() as f64);
        let of_a = |i: usize| {
            let variance = (i + VARIANCES).checked_sub(size);
            variance.map_or(0.0, |i| levels.slopes[0][i] / a)
        };
        let residual = 0.5 * (count - dot(u, u) / a);
        let gradient = pairs
            .iter()
            .enumerate()
            .map(|(i, [errors, lambda])| lambda.iter().sum::<f64>() + dot(&at.errors, errors) + residual * of_a(i));
        let gradient = gradient.collect();
        for [errors, lambda] in &mut pairs {
            for ((nu, lambda), e) in errors.iter_mut().zip(lambda).zip(&at.errors) {
                *nu += *lambda * e;
            }
        }
        let information = Mat::from_fn(size, size, |i, j| {
            let ([nu, lambda], [other, late]) = (&pairs[i], &pairs[j]);
            dot(nu, other) + 2.0 * dot(lambda, late) + 0.5 * count * of_a(i) * of_a(j)
        });
        (gradient, information)
    }

    /// The variances of the noises in u and y; 0 where one has gone to nothing.
    fn noises(&self, at: &Point) -> [f64; 2] {
        let Window { u, y, .. } = self.window;
        let variances = &at.theta[at.theta.len() - VARIANCES..];
        let noise = |logarithm: f64, signal: &[f64]| {
            let variance = libm::exp(logarithm);
            let is_something = variance * signal.len() as f64 >= NOTHING * dot(signal, signal);
            if is_something { variance } else { 0.0 }
        };
        [noise(variances[1], u), noise(variances[2], y)]
    }

    /// Searches from a point; returns its end, and why it is no minimum.
    fn descend(&mut self, mut at: Point, steps: &mut usize) -> (Point, Option<FailureKind>) {
        for _ in 0..MOST_ITERATIONS {
            let (gradient, information) = self.slopes(&at);
            let mut step = gradient.clone();
            if !solve_scaled(&information, &mut step) {
                return (at, Some(FailureKind::NotIdentifiable));
            }
            let distance = dot(&step, &gradient);
            if distance <= REST {
                return (at, None);
            }
            *steps += 1;
            let mut next = None;
            for _ in 0..HALVINGS {
                let moved = at.theta.iter().zip(&step).map(|(x, by)| x - by).collect();
                // Rounding hides whether the last steps help.
                let allowed = at.loss + if distance < FLAT { 1e-9 } else { 0.0 };
                next = self.at(moved).filter(|next| next.loss <= allowed);
                if next.is_some() {
                    break;
                }
                for x in &mut step {
                    *x /= 2.0;
                }
            }
            match next {
                Some(next) => at = next,
                None if distance < FLAT => return (at, None),
                None => break,
            }
            if self.noises(&at).contains(&0.0) {
                return (at, Some(FailureKind::Boundary));
            }
        }
        (at, Some(FailureKind::IterationLimit))
    }

    /// The best point with the plant of a model, over shares of the noise in u; `None` if it is not of these orders.
    fn start(&mut self, of: &LinearModel) -> Option<Point> {
        let Window { u, y, .. } = self.window;
        let mut theta = plant(of, self.model.orders())?;
        let mut residual = vec![0.0; y.len()];
        of.simulate(u, &mut residual);
        for (of_y, y) in residual.iter_mut().zip(y) {
            *of_y -= y;
        }
        let count = y.len() as f64;
        // An unstable model tells nothing of the noise.
        let square = dot(&residual, &residual).min(dot(y, y)) / count;
        let power = dot(u, u) / count;
        theta.extend([0.0; VARIANCES]);
        let first = theta.len() - VARIANCES;
        let points = SHARES.map(|share| {
            let variances = [(1.0 - share) * power, share * power, 0.5 * square];
            for (to, variance) in theta[first..].iter_mut().zip(variances) {
                *to = libm::log(variance);
            }
            self.at(theta.clone())
        });
        let points = points.into_iter().flatten();
        points.min_by(|one, other| one.loss.total_cmp(&other.loss))
    }
}

/// b and f of a model's plant, if it has these orders.
fn plant(of: &LinearModel, orders: Orders) -> Option<Vec<f64>> {
    let mut denominator = multiply(&of.a, &of.f);
    let needed = denominator.iter().rposition(|f| *f != 0.0)? + 1;
    denominator.resize(orders.nf + 1, 0.0);
    let last = orders.nk + orders.nb;
    let fits = extent(&of.b).is_none_or(|(from, to)| from >= orders.nk && to < last);
    let coefficient = |i: usize| of.b.get(i).copied().unwrap_or(0.0);
    let b = (orders.nk..last).map(coefficient);
    (fits && needed <= orders.nf + 1).then(|| b.chain(denominator.drain(1..)).collect())
}

impl SinglePass for NoisyInput {
    /// The covariance is the inverse of the information of the scoring, the variances' block eliminated.
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        let mut likelihood = Likelihood {
            window,
            model: self.model.clone(),
        };
        let (mut best, mut failed): (Option<(Point, Option<FailureKind>)>, _) = (None, FailureKind::NotIdentifiable);
        let mut steps = 0;
        for start in &mut self.starts {
            let mut found = Pass::new(self.model.orders().order());
            start.estimate(window, std::slice::from_mut(&mut found));
            if let Some(failure) = found.failure
                && !failure.kind.leaves_a_model()
            {
                failed = failure.kind;
                continue;
            }
            let Some(point) = likelihood.start(&found.model) else {
                continue;
            };
            let end = likelihood.descend(point, &mut steps);
            // A minimum before a point that is none.
            let rank = |(point, failure): &(Point, Option<FailureKind>)| (failure.is_some(), point.loss);
            if best.as_ref().is_none_or(|best| rank(&end) < rank(best)) {
                best = Some(end);
            }
        }
        pass.iterations = Some(steps);
        let (point, failure) = best.ok_or(failed)?;
        if failure.is_some_and(|kind| !kind.leaves_a_model()) {
            return failure.map_or(Ok(()), Err);
        }
        self.report(&mut likelihood, &point, failure.is_none(), pass)?;
        pass.start_at_zero();
        failure.map_or(Ok(()), Err)
    }
}

impl NoisyInput {
    fn report(
        &mut self,
        likelihood: &mut Likelihood<'_>,
        at: &Point,
        is_minimum: bool,
        pass: &mut Pass,
    ) -> Result<(), FailureKind> {
        let (size, count) = (at.theta.len(), at.errors.len());
        let parameters = size - VARIANCES;
        let [s_u, s_y] = likelihood.noises(at);
        pass.noise_variances = Some([s_y, s_u]);
        let errors = at.errors.iter().enumerate();
        let squares = errors.map(|(k, e)| (at.root.at(k, k) * e).powi(2));
        pass.loss = squares.sum::<f64>() / count as f64;
        let model = &mut self.model;
        model.set_parameters(&at.theta[..parameters]);
        model.noise_variance = s_y;
        model.covariance.clear();
        let mut condition = f64::NAN;
        if is_minimum {
            let (_, information) = likelihood.slopes(at);
            let scale: Vec<f64> = (0..size).map(|i| information[(i, i)].sqrt()).collect();
            let mut norms = [0.0_f64; 2];
            for j in 0..size {
                let mut column = vec![0.0; size];
                column[j] = 1.0;
                if !solve_scaled(&information, &mut column) {
                    return Err(FailureKind::NotIdentifiable);
                }
                let sum = |of: &dyn Fn(usize) -> f64| (0..size).map(|i| of(i).abs()).sum::<f64>();
                let of_matrix = sum(&|i| information[(i, j)] / (scale[i] * scale[j]));
                let of_inverse = sum(&|i| column[i] * scale[i] * scale[j]);
                norms = [norms[0].max(of_matrix), norms[1].max(of_inverse)];
                if j < parameters {
                    model.covariance.extend(&column[..parameters]);
                }
            }
            condition = norms[0] * norms[1];
        }
        pass.set_model(model, condition)
    }
}

/// Solves `F x = b` with F scaled to ones on its diagonal; false if it is not positive definite.
fn solve_scaled(information: &Mat<f64>, x: &mut [f64]) -> bool {
    let n = x.len();
    let scale: Vec<f64> = (0..n).map(|i| information[(i, i)].sqrt().recip()).collect();
    let mut scaled = Mat::from_fn(n, n, |i, j| information[(i, j)] * scale[i] * scale[j]);
    x.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s);
    let solved = solve_positive(&mut scaled, x);
    x.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s);
    solved
}

#[cfg(test)]
mod tests;
