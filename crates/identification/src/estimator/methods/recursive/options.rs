//! The options that all recursive estimators share, and what follows from them.

use super::batch::Batch;
use super::{Coefficients, RecursiveEstimator, RecursiveSettings};
use crate::estimator::initial_state_choice::StartState;
use crate::estimator::{Estimator, OptionError, OptionUnits, Problem, SetupError};
use crate::model::Orders;

/// Defines the options of a recursive estimator: its orders, those of its own, and those that all share; `start` stands
/// for those of the methods that least squares starts.
macro_rules! recursive_options {
    (
        $(#[$about:meta])* $name:ident {
            $(#[$orders:meta])* orders,
            $(first { $($first:tt)* })?
            $(then { $($then:tt)* })?
        }
    ) => {
        recursive_options! {
            @define [$(#[$about])* $name] [$(#[$orders])*] [$($($first)*)?] [] [$($($then)*)?]
        }
    };
    (
        $(#[$about:meta])* $name:ident {
            $(#[$orders:meta])* orders,
            $(first { $($first:tt)* })?
            start
        }
    ) => {
        recursive_options! {
            @define [$(#[$about])* $name] [$(#[$orders])*] [$($($first)*)?] [
                /// Forgetting factor after the start, which approaches `forgetting` by 1 % of the difference a sample;
                /// without p0 and forgetting by default 0.98 of recursive-sriv and recursive-iv with auxiliary
                /// instruments, 0.97 of rpem; otherwise there is no such rise.
                early_forgetting: Option<f64>,
                /// Equations that least squares solves before residuals, instruments or filters are used; by default 0
                /// with p0, else two for each parameter, and 60 of recursive-sriv and recursive-iv with auxiliary
                /// instruments, but at most a quarter of all.
                start: Option<usize>,
            ] []
        }
    };
    (
        @define [$(#[$about:meta])* $name:ident] [$(#[$orders:meta])*]
        [$($(#[$first_about:meta])* $first:ident: $first_type:ty,)*]
        [$($(#[$start_about:meta])* $start:ident: $start_type:ty,)*]
        [$($(#[$then_about:meta])* $then:ident: $then_type:ty,)*]
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, Default, PartialEq)]
        #[cfg_attr(
            feature = "json",
            derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
            serde(deny_unknown_fields, default)
        )]
        pub struct $name {
            $(#[$orders])*
            pub orders: Option<$crate::model::Orders>,
            $($(#[$first_about])* pub $first: $first_type,)*
            /// The parameters before the first equation, in the order A, B, C, D, F, such as -1.5,0.7,1,0.5; by default
            /// zeros.
            pub theta0: Option<super::Coefficients>,
            /// P before the first equation is p0 times the identity; by default exact, the limit of p0 to infinity.
            pub p0: Option<f64>,
            /// Forgetting factor: the weight of an equation that is i samples old is its i-th power; 1 (the default):
            /// none.
            pub forgetting: Option<f64>,
            $($(#[$start_about])* pub $start: $start_type,)*
            $($(#[$then_about])* pub $then: $then_type,)*
            /// The initial state: estimate (stage 6 for the model found), or zero.
            pub initial_state: $crate::estimator::initial_state_choice::StartState,
        }

        impl super::options::SharedOptions for $name {
            fn given_orders(&self) -> Option<$crate::model::Orders> {
                self.orders
            }

            fn theta0(&self) -> Option<&super::Coefficients> {
                self.theta0.as_ref()
            }

            fn p0(&self) -> Option<f64> {
                self.p0
            }

            fn forgetting(&self) -> Option<f64> {
                self.forgetting
            }

            fn initial_state(&self) -> $crate::estimator::initial_state_choice::StartState {
                self.initial_state
            }

            $(fn $start(&self) -> $start_type {
                self.$start
            })*
        }

        impl $crate::estimator::MethodKind for $name {
            fn check(&self) -> Result<(), $crate::estimator::OptionError> {
                super::options::check(self)
            }

            fn model_orders(&self, setting: usize) -> Option<$crate::model::Orders> {
                Some(RecursiveOptions::orders(self, setting))
            }

            fn option_units(&self) -> $crate::estimator::OptionUnits {
                super::options::option_units(self)
            }

            fn runs_along(&self) -> bool {
                true
            }

            fn prepare(
                &self,
                problem: &$crate::estimator::Problem<'_>,
            ) -> Result<Box<dyn $crate::estimator::Estimator>, $crate::estimator::SetupError> {
                super::options::prepare(self, problem)
            }
        }
    };
}

pub(super) use recursive_options;

/// The options that all recursive estimators have.
pub(super) trait SharedOptions {
    fn given_orders(&self) -> Option<Orders>;
    fn theta0(&self) -> Option<&Coefficients>;
    fn p0(&self) -> Option<f64>;
    fn forgetting(&self) -> Option<f64>;
    fn initial_state(&self) -> StartState;

    fn early_forgetting(&self) -> Option<f64> {
        None
    }

    fn start(&self) -> Option<usize> {
        None
    }
}

/// What a recursive estimator adds to the options that all share.
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

/// Checks all options.
pub(super) fn check<O: RecursiveOptions>(options: &O) -> Result<(), OptionError> {
    options.check_own()?;
    let wrong = |key: &str, text: String| Err(OptionError::new(key, text));
    if let Some(p0) = options.p0().filter(|p0| !(*p0 > 0.0 && p0.is_finite())) {
        return wrong("p0", format!("{p0}; expected a number above 0"));
    }
    for (key, rate) in [
        ("forgetting", options.forgetting()),
        ("early_forgetting", options.early_forgetting()),
    ] {
        if let Some(rate) = rate.filter(|rate| !(*rate > 0.0 && *rate <= 1.0)) {
            return wrong(key, format!("{rate}; expected a number above 0, at most 1"));
        }
    }
    let (Some(orders), Some(theta0)) = (options.given_orders(), options.theta0()) else {
        return Ok(());
    };
    let (given, needed) = (theta0.numbers().len(), orders.parameters());
    if given == needed {
        return Ok(());
    }
    let text = format!("{given} numbers; orders {orders} have {needed} parameters");
    wrong("theta0", text)
}

/// The unit of theta0 and of p0; zeros have none.
pub(super) fn option_units<O: RecursiveOptions>(options: &O) -> OptionUnits {
    let has_size = |theta0: &Coefficients| theta0.numbers().iter().any(|x| *x != 0.0);
    match options.p0() {
        Some(_) => OptionUnits::Signals,
        None => OptionUnits::Gain.only_if(options.theta0().is_some_and(has_size)),
    }
}

/// Makes the settings of options for models of these orders.
fn settings<O: RecursiveOptions>(
    options: &O,
    problem: &Problem<'_>,
) -> Result<RecursiveSettings, SetupError> {
    let orders = options.orders(problem.shape.order);
    let d = orders.parameters();
    let mut settings = RecursiveSettings::new(orders);
    if let Some(theta0) = options.theta0() {
        if theta0.numbers().len() != d {
            return Err(SetupError::ParameterCount {
                orders,
                given: theta0.numbers().len(),
            });
        }
        settings.theta0.copy_from_slice(theta0.numbers());
    }
    settings.p0 = options.p0();
    settings.forgetting = options.forgetting().unwrap_or(1.0);
    let window = problem.shape.window;
    let rows = window.saturating_sub(settings.first());
    let (start, early) = match (options.p0(), options.forgetting()) {
        (Some(_), _) => (0, settings.forgetting),
        (None, Some(rate)) => (2 * d, rate),
        (None, None) => {
            let (start, early) = options.beginning();
            (start.min(rows / 4).max(2 * d), early)
        }
    };
    settings.early_forgetting = options.early_forgetting().unwrap_or(early);
    settings.start = options.start().unwrap_or(start);
    if rows < d {
        return Err(SetupError::ShortRecord {
            orders,
            window,
            rows,
            needed: d,
        });
    }
    Ok(settings)
}

/// Makes the estimator of a whole window.
pub(super) fn prepare<O: RecursiveOptions>(
    options: &O,
    problem: &Problem<'_>,
) -> Result<Box<dyn Estimator>, SetupError> {
    let settings = settings(options, problem)?;
    let covariance = settings.remembers();
    let recursion = options.recursion(settings);
    let state = options.initial_state();
    Ok(Box::new(Batch::new(recursion, state, covariance)))
}
