//! The options that all recursive estimators share, and what follows from them.

use super::batch::Batch;
use super::{Coefficients, RecursiveEstimator, RecursiveSettings};
use crate::estimator::initial_state_choice::StartState;
use crate::estimator::{Estimator, MethodKind, OptionError, OptionUnits, Problem, SetupError, enough_equations};
use crate::model::Orders;

/// Defines the options of a recursive estimator: its orders, those of its own, those of the methods that least squares
/// starts if it is `with start`, and those that all share.
macro_rules! recursive_options {
    (
        $(#[$about:meta])* $name:ident {
            $(#[$orders:meta])* orders,
            $(first { $($first:tt)* })?
            $(then { $($then:tt)* })?
            $(with $start:ident)?
        }
    ) => {
        $crate::estimator::method_kind::options! {
            $(#[$about])*
            pub struct $name {
                $(#[$orders])*
                pub orders: Option<$crate::model::Orders>,
                $($($first)*)?
                /// The parameters before the first equation, in the order A, B, C, D, F, such as -1.5,0.7,1,0.5; by
                /// default zeros.
                pub theta0: Option<super::Coefficients>,
                /// P before the first equation is p0 times the identity; by default exact, the limit of p0 to infinity.
                pub p0: Option<f64>,
                /// Forgetting factor: the weight of an equation that is i samples old is its i-th power; 1 (the
                /// default): none.
                pub forgetting: Option<f64>,
                $(
                    /// Forgetting factor after the start, which approaches `forgetting` by 1 % of the difference a
                    /// sample; without p0 and forgetting by default 0.98 of recursive-sriv and recursive-iv with
                    /// auxiliary instruments, 0.97 of rpem; otherwise there is no such rise.
                    pub early_forgetting: Option<f64>,
                    /// Equations that least squares solves before residuals, instruments or filters are used; by
                    /// default 0 with p0, else two for each parameter, and 60 of recursive-sriv and recursive-iv with
                    /// auxiliary instruments, but at most a quarter of all.
                    pub $start: Option<usize>,
                )?
                $($($then)*)?
                /// The initial state: estimate (stage 6 for the model found), or zero.
                pub initial_state: $crate::estimator::initial_state_choice::StartState,
            }
        }

        impl super::options::SharedOptions for $name {
            fn given(&self) -> super::options::Given<'_> {
                use super::options::Given;
                let given = Given {
                    orders: self.orders,
                    theta0: self.theta0.as_ref(),
                    p0: self.p0,
                    forgetting: self.forgetting,
                    early_forgetting: None,
                    start: None,
                    initial_state: self.initial_state,
                };
                $(let given = Given {
                    early_forgetting: self.early_forgetting,
                    $start: self.$start,
                    ..given
                };)?
                given
            }
        }
    };
}

pub(super) use recursive_options;

/// The options that all recursive estimators have, and those of a start.
pub(super) struct Given<'a> {
    pub(super) orders: Option<Orders>,
    pub(super) theta0: Option<&'a Coefficients>,
    pub(super) p0: Option<f64>,
    pub(super) forgetting: Option<f64>,
    pub(super) early_forgetting: Option<f64>,
    pub(super) start: Option<usize>,
    pub(super) initial_state: StartState,
}

/// Options of which some are shared.
pub(super) trait SharedOptions {
    /// Returns those.
    fn given(&self) -> Given<'_>;
}

/// Options of one recursive estimator beside those of all.
pub(super) trait RecursiveOptions: SharedOptions {
    /// The estimator.
    type Recursion: RecursiveEstimator + 'static;

    /// Returns the orders of the model for a value of the setting `order`.
    fn orders(&self, order: usize) -> Orders;

    /// Checks the orders and the options that others do not have.
    fn check_own(&self) -> Result<(), OptionError>;

    /// The equations of the start, and the early forgetting, that what runs along needs, by evidence
    /// (`examples/defaults.rs`).
    fn beginning(&self) -> (usize, f64) {
        (0, 1.0)
    }

    /// Makes the estimator.
    fn recursion(&self, settings: RecursiveSettings) -> Self::Recursion;
}

/// [`RecursiveOptions::beginning`] where the output of the present model makes the instruments.
pub(super) const INSTRUMENTS: (usize, f64) = (60, 0.98);

impl<O: RecursiveOptions> MethodKind for O {
    fn check(&self) -> Result<(), OptionError> {
        self.check_own()?;
        let given = self.given();
        let wrong = |key: &str, text: String| Err(OptionError::new(key, text));
        if let Some(p0) = given.p0.filter(|p0| !(*p0 > 0.0 && p0.is_finite())) {
            return wrong("p0", format!("{p0}; expected a number above 0"));
        }
        for (key, rate) in [
            ("forgetting", given.forgetting),
            ("early_forgetting", given.early_forgetting),
        ] {
            if let Some(rate) = rate.filter(|rate| !(*rate > 0.0 && *rate <= 1.0)) {
                return wrong(key, format!("{rate}; expected a number above 0, at most 1"));
            }
        }
        let (Some(orders), Some(theta0)) = (given.orders, given.theta0) else {
            return Ok(());
        };
        let (given, needed) = (theta0.numbers().len(), orders.parameters());
        if given == needed {
            return Ok(());
        }
        let text = format!("{given} numbers; orders {orders} have {needed} parameters");
        wrong("theta0", text)
    }

    fn model_orders(&self, setting: usize) -> Option<Orders> {
        Some(self.orders(setting))
    }

    /// The unit of theta0 and of p0; zeros have none.
    fn option_units(&self) -> OptionUnits {
        let given = self.given();
        let has_size = |theta0: &Coefficients| theta0.numbers().iter().any(|x| *x != 0.0);
        match given.p0 {
            Some(_) => OptionUnits::Signals,
            None => OptionUnits::Gain.only_if(given.theta0.is_some_and(has_size)),
        }
    }

    fn runs_along(&self) -> bool {
        true
    }

    fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let settings = settings(self, problem)?;
        let covariance = settings.remembers();
        let recursion = self.recursion(settings);
        let start = self.given().initial_state;
        Ok(Box::new(Batch::new(recursion, start, covariance)))
    }
}

/// Makes the settings of options for models of these orders.
fn settings<O: RecursiveOptions>(options: &O, problem: &Problem<'_>) -> Result<RecursiveSettings, SetupError> {
    let (orders, given) = (options.orders(problem.shape.order), options.given());
    let d = orders.parameters();
    let mut settings = RecursiveSettings::new(orders);
    if let Some(theta0) = given.theta0 {
        if theta0.numbers().len() != d {
            return Err(SetupError::ParameterCount {
                orders,
                given: theta0.numbers().len(),
            });
        }
        settings.theta0.copy_from_slice(theta0.numbers());
    }
    settings.p0 = given.p0;
    settings.forgetting = given.forgetting.unwrap_or(1.0);
    let window = problem.shape.window;
    let rows = window.saturating_sub(settings.first());
    let (start, early) = match (given.p0, given.forgetting) {
        (Some(_), _) => (0, settings.forgetting),
        (None, Some(rate)) => (2 * d, rate),
        (None, None) => {
            let (start, early) = options.beginning();
            (start.min(rows / 4).max(2 * d), early)
        }
    };
    settings.early_forgetting = given.early_forgetting.unwrap_or(early);
    settings.start = given.start.unwrap_or(start);
    enough_equations(orders, window, rows, d)?;
    Ok(settings)
}
