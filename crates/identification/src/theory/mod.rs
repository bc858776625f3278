//! Theory of a cell as N grows: limits, asymptotic covariances of `sqrt(N) (theta_hat - limit)`, Cramer-Rao bounds, and
//! the distribution of measures that are smooth in theta.
//!
//! `theta = p = (alpha, beta)`, as in the specification. Every signal of a cell is a sum of rational filters of
//! independent white sources ([`Signal`]). All covariances and their sums over lags follow from Lyapunov equations of
//! their joint state ([`joint_state`]); no series is truncated and nothing is simulated. For an estimate
//! `theta = (sum z phi')^-1 sum z y` with the error `e = y - phi'theta` at its limit,
//!
//! ```text
//! sqrt(N) (theta_hat - theta) = N^(-1/2) sum_k G^-1 (z(k) e(k) + H xi(k) + 2 E_w[z e] delta(k)),   G = E[z phi'],
//! ```
//!
//! Here xi is the same sum for the estimate that the instruments are built from, and `H = E[(dz/dtheta') e]`. If eta
//! holds exactly in each window, delta is the relative change of the noise's factor s; E_w is the part due to the
//! measurement noise. The covariance of such sums contains the fourth cumulants of the input and of the noise's source.
//! In open loop, a consistent estimate has only the term `z e`: `P = G^-1 sum_t (E[z z'](t) E[v v](t)) G^-T`.
//!
//! Sources: Soderstrom and Stoica, System Identification, 1989, chapters 7, 8, 10; Ljung, System Identification, 2nd
//! ed., chapter 9; docs/theory.md.

mod canonical;
mod cramer_rao;
mod errors_in_variables;
mod estimator_limits;
mod fisher_information;
pub mod joint_state;
mod linear;
mod matrix;
mod missing;
mod noise_model;
mod noisy_record;
mod own_information;
mod passes;
mod population;
mod quadratic_form;
mod record_information;
mod response_bound;
mod signal;
mod smooth_measure;
mod spectrum;
#[cfg(test)]
mod tests;

pub use canonical::Asymptotic;
pub use fisher_information::FisherInformation;
pub use matrix::Matrix;
pub use missing::{LARGEST, Missing, NoTheory};
pub use own_information::OwnInformation;
pub use population::Population;
pub use quadratic_form::{distribution, quantile};
pub use record_information::RecordInformation;
pub use response_bound::{ResponseBound, weights_between};
pub use signal::{Signal, Source};
pub use smooth_measure::{Figure, SmoothMeasure};

use crate::data::{NoiseColour, Process};
use crate::estimator::recursive::RecursiveInstruments;
use crate::estimator::{ArmaxOptions, ArxOptions, BjOptions, Method, MethodOptions, OeOptions};
use crate::model::Orders;
use canonical::Shape;
use passes::Passes;

/// The theory of an estimate or of a bound.
#[derive(Clone, Debug)]
pub struct Theory {
    /// Whether the limit is the truth.
    pub is_consistent: bool,
    /// The trace of P.
    pub trace: f64,
    /// The measures; those that the estimate does not have are left out.
    pub figures: Vec<(SmoothMeasure, Figure)>,
    /// The limit and P.
    pub asymptotic: Asymptotic,
}

impl Theory {
    /// Returns the theory of a measure, if the estimate has it.
    pub fn figure(&self, measure: SmoothMeasure) -> Option<&Figure> {
        let mut figures = self.figures.iter();
        let found = figures.find(|(of, _)| *of == measure);
        found.map(|(_, figure)| figure)
    }

    fn new(population: &Population, asymptotic: Asymptotic) -> Result<Self, Missing> {
        let p = &asymptotic.covariance;
        if !p.is_all_finite() {
            return Err(Missing::Singular);
        }
        let measures = SmoothMeasure::ALL.iter();
        let figures = measures.filter_map(|measure| {
            let figure = smooth_measure::figure(population, &asymptotic, *measure);
            figure.map(|figure| (*measure, figure))
        });
        Ok(Self {
            is_consistent: asymptotic.is_consistent,
            trace: (0..p.nrows()).map(|i| p[(i, i)]).sum(),
            figures: figures.collect(),
            asymptotic,
        })
    }

    fn of_bound(population: &Population, covariance: Matrix) -> Result<Self, Missing> {
        let asymptotic = Asymptotic {
            p: [&population.alpha[1..], &population.beta[1..]].concat(),
            is_consistent: true,
            covariance,
            of_b: None,
        };
        Self::new(population, asymptotic)
    }
}

/// The theory of a cell.
#[derive(Clone, Debug)]
pub struct CellTheory {
    /// The outputs of all methods, in order: label and theory.
    pub outputs: Vec<(String, Result<Theory, Missing>)>,
    /// The Cramer-Rao bound if plant and noise share A, as under 1/A noise.
    pub shared: Result<Theory, Missing>,
    /// The Cramer-Rao bound if the noise model has its own poles.
    pub separate: Result<Theory, Missing>,
    /// Instrumental variables with optimal instruments.
    pub optimal_instruments: Result<Theory, Missing>,
}

impl CellTheory {
    /// Computes the theory of a process at noise level `eta` (per cent) for estimators of an order, and for methods.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn new(process: &Process, eta: f64, order: usize, methods: &[Method]) -> Result<Self, NoTheory> {
        let largest = largest(process, order, methods);
        if largest > LARGEST {
            return Err(NoTheory::Large(largest));
        }
        let population = Population::new(process, eta)?;
        let bound = |covariance: Result<Matrix, Missing>| {
            covariance.and_then(|covariance| Theory::of_bound(&population, covariance))
        };
        let mut outputs = Vec::new();
        for method in methods {
            let found = estimates(&population, method, order);
            for (output, found) in method.outputs().iter().zip(found) {
                let theory = found.and_then(|found| Theory::new(&population, found));
                outputs.push((output.label(), theory));
            }
        }
        Ok(Self {
            outputs,
            shared: bound(cramer_rao::shared_bound(&population)),
            separate: bound(cramer_rao::separate_bound(&population)),
            optimal_instruments: bound(cramer_rao::optimal_instruments(&population)),
        })
    }
}

/// The largest number of coefficients of a polynomial of the plant, the noise or a model.
fn largest(process: &Process, order: usize, methods: &[Method]) -> usize {
    let noise = match &process.settings().noise {
        NoiseColour::InverseDenominator => 0,
        NoiseColour::Filter(filter) => filter.numerator().len().max(filter.denominator().len()),
    };
    let models = methods.iter().map(|method| method.order(order));
    let largest = process.order().max(order).max(noise);
    models.fold(largest, usize::max)
}

/// Whether a forgetting factor is 1.
fn forgets_nothing(factor: Option<f64>) -> bool {
    factor.is_none_or(|factor| factor == 1.0)
}

/// The limits and covariances of a method's outputs, in their order.
fn estimates(population: &Population, method: &Method, order: usize) -> Vec<Result<Asymptotic, Missing>> {
    use MethodOptions as M;
    let none = |of: &'static str| vec![Err(Missing::Method(of)); method.outputs().len()];
    let Some(options) = method.options() else {
        return none("methods of one's own");
    };
    if method.last().is_some() {
        return none("methods on the last samples alone");
    }
    let orders = options.model_orders(order);
    let orders = orders.unwrap_or(Orders::arx(order, order, 1));
    let one = match options {
        M::InstrumentalVariables(options)
            if options.fixed_model.is_some() || orders != Orders::arx(order, order, 1) =>
        {
            return none("iv of other orders or with a fixed model");
        }
        M::Arx(ArxOptions { choose: Some(_), .. })
        | M::Oe(OeOptions { choose: Some(_), .. })
        | M::Armax(ArmaxOptions { choose: Some(_), .. })
        | M::Bj(BjOptions { choose: Some(_), .. }) => Err(Missing::Method("methods of a chosen order")),
        M::InstrumentalVariables(options) => {
            return Passes::new(population, options, order).run(method.reported());
        }
        M::LeastSquares(_) | M::Arx(_) => regression(population, orders),
        M::IvDelayed(options) => estimator_limits::delayed_inputs(population, orders, options.extra),
        M::Iv4(_) => estimator_limits::four_steps(population, orders),
        M::Sriv(_) | M::Oe(_) => estimator_limits::output_error(population, orders, false),
        M::Stmcb(_) => estimator_limits::output_error(population, orders, true),
        // Asymptotically efficient, as prediction error methods of the same structure.
        M::Wnsf(_) if orders.na == 0 && orders.nc + orders.nd == 0 => {
            estimator_limits::output_error(population, orders, false)
        }
        M::Wnsf(_) if orders.na == 0 => estimator_limits::bj(population, orders),
        M::Wnsf(_) | M::Armax(_) => estimator_limits::armax(population, orders),
        // At a fixed point of `riv` the gradient of `bj` is zero.
        M::Riv(_) | M::Bj(_) => estimator_limits::bj(population, orders),
        M::Moesp(_) | M::N4sid(_) => Err(Missing::Method("subspace methods")),
        // A recursion that forgets nothing tends to what solves all its equations at once.
        M::Rls(options) if forgets_nothing(options.forgetting) => regression(population, orders),
        M::RecursiveIv(options)
            if forgets_nothing(options.forgetting) && options.instruments == RecursiveInstruments::Delayed =>
        {
            estimator_limits::delayed_inputs(population, orders, 0)
        }
        M::RecursiveSriv(options) if forgets_nothing(options.forgetting) => {
            estimator_limits::output_error(population, orders, false)
        }
        M::Rls(_) | M::RecursiveIv(_) | M::Rels(_) | M::RecursiveSriv(_) | M::Rpem(_) => {
            let missing = "rels, rpem, recursive-iv with an auxiliary model, and forgetting";
            Err(Missing::Method(missing))
        }
        M::Kreisselmeier(_) | M::Zhang(_) | M::JointEkf(_) => Err(Missing::Method("adaptive observers")),
        M::Known(_) => Err(Missing::Method("a known plant")),
        // A newcomer has no theory until a line above says otherwise.
        _ => Err(Missing::Method(options.estimator().name())),
    };
    vec![one]
}

/// Least squares of any orders.
fn regression(population: &Population, orders: Orders) -> Result<Asymptotic, Missing> {
    let shape = Shape::new(orders);
    let linear = passes::least_squares(population, shape)?;
    let covariance = linear.influence.covariance(&population.sources)?;
    Ok(shape.asymptotic(&linear.theta, linear.is_consistent, &covariance))
}
