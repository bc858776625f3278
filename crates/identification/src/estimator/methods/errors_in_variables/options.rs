//! The options of `tls`, `bels` and `iv-compensated`.

use super::{ErrorsInVariables, Noise};
use crate::estimator::initial_state_choice::StartState;
use crate::estimator::method_kind::{MethodKind, OptionUnits, Problem, options};
use crate::estimator::methods::arx::ArxOptions;
use crate::estimator::option_error::OptionError;
use crate::estimator::{Estimator, SetupError};
use crate::model::Orders;

/// Earlier inputs by default, for each of a and b.
const EARLIER: usize = 3;

options! {
    /// The options of `tls`.
    pub struct TlsOptions {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// The variance of the output's noise over that of the input's; by default 1.
        pub ratio: Option<f64>,
        /// The initial state: estimate (stage 6 for the model found), or zero.
        pub initial_state: StartState,
    }
}

options! {
    /// The options of `bels`.
    pub struct BelsOptions {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// Earlier inputs among the equations; by default 3 (na + nb).
        pub earlier: Option<usize>,
        /// The variance of the output's noise, in units of y^2, if it is known; otherwise it is estimated.
        pub output_noise: Option<f64>,
        /// The variance of the input's noise, in units of u^2, if it is known, such as 0; otherwise it is estimated.
        pub input_noise: Option<f64>,
        /// The initial state: estimate (stage 6 for the model found), or zero.
        pub initial_state: StartState,
    }
}

options! {
    /// The options of `iv-compensated`.
    pub struct IvCompensatedOptions {
        /// Orders na, nb and the delay nk, such as na=2,nb=2,nk=1; by default na = nb = the setting `order`, nk = 1.
        pub orders: Option<Orders>,
        /// Earlier inputs among the instruments; by default 0.
        pub earlier: Option<usize>,
        /// The variance of the output's noise, in units of y^2; by default 0.
        pub output_noise: Option<f64>,
        /// The variance of the input's noise, in units of u^2; by default 0.
        pub input_noise: Option<f64>,
        /// The initial state: estimate (stage 6 for the model found), or zero.
        pub initial_state: StartState,
    }
}

/// The largest number of earlier inputs.
const MOST_EARLIER: usize = 1000;

fn check_numbers(earlier: Option<usize>, variances: [Option<f64>; 2]) -> Result<(), OptionError> {
    if earlier.is_some_and(|earlier| earlier > MOST_EARLIER) {
        let message = format!("expected at most {MOST_EARLIER}");
        return Err(OptionError::new("earlier", message));
    }
    for (key, variance) in ["output_noise", "input_noise"].into_iter().zip(variances) {
        if variance.is_some_and(|v| !(v >= 0.0 && v.is_finite())) {
            return Err(OptionError::new(key, "expected a variance of at least 0"));
        }
    }
    Ok(())
}

/// The unit of variances that were given; that of 0 does not matter.
fn of_variances(output: Option<f64>, input: Option<f64>) -> OptionUnits {
    let given = [output, input].into_iter().flatten().any(|v| v > 0.0);
    OptionUnits::Signals.only_if(given)
}

/// Defines how a method is prepared: its orders, its earlier inputs, what it knows of the noise, whether y(k) is among
/// the instruments.
macro_rules! eiv {
    ($options:ident, check: $check:expr, units: $units:expr, settings: $settings:expr) => {
        impl $options {
            fn orders(&self, order: usize) -> Orders {
                self.orders.unwrap_or(Orders::arx(order, order, 1))
            }
        }

        impl MethodKind for $options {
            fn check(&self) -> Result<(), OptionError> {
                let check: fn(&Self) -> Result<(), OptionError> = $check;
                check(self)?;
                ArxOptions::check_orders(self.orders)
            }

            fn model_orders(&self, setting: usize) -> Option<Orders> {
                Some(self.orders(setting))
            }

            fn option_units(&self) -> OptionUnits {
                let units: fn(&Self) -> OptionUnits = $units;
                units(self)
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                let orders = self.orders(problem.shape.order);
                let settings: fn(&Self, Orders) -> (Noise, usize, bool) = $settings;
                let (noise, earlier, present) = settings(self, orders);
                let (window, start) = (problem.shape.window, self.initial_state);
                let method = ErrorsInVariables::new(orders, noise, [earlier, usize::from(present)], start, window)?;
                Ok(Box::new(method))
            }
        }
    };
}

eiv!(
    TlsOptions,
    check: |of| match of.ratio {
        Some(ratio) if !(ratio > 0.0 && ratio.is_finite()) => {
            Err(OptionError::new("ratio", "expected a number above 0"))
        }
        _ => Ok(()),
    },
    // The default has one too.
    units: |_| OptionUnits::Gain,
    settings: |of, _| (Noise::Ratio(of.ratio.unwrap_or(1.0)), 0, true)
);
eiv!(
    BelsOptions,
    check: |of| {
        if of.output_noise.is_some() && of.input_noise.is_some() {
            let message = "both variances are known; expected one or none, or the estimator iv-compensated";
            return Err(OptionError::new("input_noise", message));
        }
        check_numbers(of.earlier, [of.output_noise, of.input_noise])?;
        match of.earlier {
            Some(0) => Err(OptionError::new("earlier", "expected at least 1")),
            _ => Ok(()),
        }
    },
    units: |of| of_variances(of.output_noise, of.input_noise),
    settings: |of, orders| {
        let noise = Noise::Variances([of.output_noise, of.input_noise]);
        (noise, of.earlier.unwrap_or(EARLIER * (orders.na + orders.nb)), true)
    }
);
eiv!(
    IvCompensatedOptions,
    check: |of| check_numbers(of.earlier, [of.output_noise, of.input_noise]),
    units: |of| of_variances(of.output_noise, of.input_noise),
    settings: |of, _| {
        let known = [of.output_noise, of.input_noise].map(|v| Some(v.unwrap_or(0.0)));
        (Noise::Variances(known), of.earlier.unwrap_or(0), false)
    }
);
