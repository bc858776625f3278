//! The order of an ARX model by an information criterion, from losses over the same equations.

use super::regression::{Regression, Rows};
use super::{FailureKind, Runs, SetupError};
use crate::model::Orders;
use crate::names::named_enum;

named_enum! {
    /// The criterion whose smallest value decides the order of a model. `V = RSS/M` of M equations, d parameters.
    Criterion, "criterion" {
        /// Akaike's, `M ln V + 2 d`.
        Aic = "aic",
        /// Akaike's with Hurvich and Tsai's correction for few samples, `AIC + 2 d (d + 1)/(M - d - 1)`.
        Aicc = "aicc",
        /// Schwarz's, `M ln V + d ln M`.
        Bic = "bic",
        /// Akaike's final prediction error, `V (1 + d/M)/(1 - d/M)`.
        Fpe = "fpe",
    }
}

impl Criterion {
    /// Returns the name that tables use.
    pub const fn heading(self) -> &'static str {
        match self {
            Self::Aic => "AIC",
            Self::Aicc => "AICc",
            Self::Bic => "BIC",
            Self::Fpe => "FPE",
        }
    }

    /// Returns the value for a loss, a number of equations and a number of parameters; infinite if there are too few
    /// equations.
    pub fn value(self, loss: f64, equations: usize, parameters: usize) -> f64 {
        let (m, d) = (equations as f64, parameters as f64);
        let aic = m * loss.ln() + 2.0 * d;
        match self {
            Self::Aic => aic,
            Self::Aicc if equations <= parameters + 1 => f64::INFINITY,
            Self::Aicc => aic + 2.0 * d * (d + 1.0) / (m - d - 1.0),
            Self::Bic => m * loss.ln() + d * m.ln(),
            Self::Fpe if equations <= parameters => f64::INFINITY,
            Self::Fpe => loss * (1.0 + d / m) / (1.0 - d / m),
        }
    }
}

/// One of the ARX models that are compared.
pub struct Candidate {
    /// Its orders.
    pub orders: Orders,
    regression: Regression,
    /// The first sample of each record that the candidate sees, chosen so that its first equation is the common one.
    from: usize,
    /// `RSS / M` of the last record, or why there is none.
    pub loss: Result<f64, FailureKind>,
}

impl Candidate {
    /// Returns `(a_1 ... a_na, b_1 ... b_nb)` over the common equations, valid if [`Self::loss`] is `Ok`.
    pub fn theta(&self) -> &[f64] {
        self.regression.theta()
    }
}

/// Compares ARX models of several orders over the same equations `k = m ... N-1`. m is the largest of their
/// `max(na, nb + nk - 1)` (Ljung, *System Identification*, 2nd ed., section 16.4).
pub struct OrderComparison {
    candidates: Vec<Candidate>,
    runs: Runs,
    equations: usize,
}

impl OrderComparison {
    /// Makes buffers for windows of `window` samples.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if a model has more parameters than there are equations.
    pub fn new(orders: &[Orders], window: usize) -> Result<Self, SetupError> {
        Self::of_runs(orders, Runs::new(&[window]))
    }

    /// Makes buffers for several records, each of which begins with the common first equation.
    ///
    /// # Errors
    /// [`SetupError::ShortRecord`] if a model has more parameters than there are equations.
    pub fn of_runs(orders: &[Orders], runs: Runs) -> Result<Self, SetupError> {
        let left = |from: usize| runs.iter().map(move |run| run.len().saturating_sub(from));
        let reach = orders.iter().map(|orders| orders.reach()).max();
        let reach = reach.unwrap_or(0);
        let candidate = |orders: &Orders| -> Result<Candidate, SetupError> {
            let from = reach - orders.reach();
            let lengths: Vec<usize> = left(from).collect();
            let regression = Regression::new(*orders, Rows::Complete, lengths.iter().sum())?;
            Ok(Candidate {
                orders: *orders,
                regression: regression.of_runs(&Runs::new(&lengths))?,
                from,
                loss: Err(FailureKind::NotRun),
            })
        };
        Ok(Self {
            candidates: orders.iter().map(candidate).collect::<Result<_, _>>()?,
            equations: left(reach).sum(),
            runs,
        })
    }

    /// Computes the loss of each model.
    pub fn run(&mut self, u: &[f64], y: &[f64]) {
        let equations = self.equations as f64;
        for candidate in &mut self.candidates {
            let from = candidate.from;
            let regression = &mut candidate.regression;
            let [u, y] = [u, y].map(|signal| self.runs.without_first(from, signal));
            let solved = regression.solve(&u, &y);
            candidate.loss = solved.map(|_| regression.residual_sum() / equations);
        }
    }

    /// Returns the models in the given order.
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// Returns the number of equations M.
    pub fn equations(&self) -> usize {
        self.equations
    }

    /// Returns the index of the model with the smallest value, the first among equal ones.
    ///
    /// # Errors
    /// If no model was found, the failure of the first one.
    pub fn best(&self, criterion: Criterion) -> Result<usize, FailureKind> {
        let mut best: Option<(usize, f64)> = None;
        let mut failure = FailureKind::NotRun;
        for (number, candidate) in self.candidates.iter().enumerate().rev() {
            match candidate.loss {
                Ok(loss) => {
                    let parameters = candidate.orders.parameters();
                    let value = criterion.value(loss, self.equations, parameters);
                    if best.is_none_or(|(_, least)| value <= least) {
                        best = Some((number, value));
                    }
                }
                Err(kind) => failure = kind,
            }
        }
        best.map(|(number, _)| number).ok_or(failure)
    }
}
