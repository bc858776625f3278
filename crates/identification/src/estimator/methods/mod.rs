//! The estimators of this crate, one line each. An estimator's file has its options, and these define everything else.

pub mod adaptive;
mod arx;
mod closed_loop_continuous;
mod closed_loop_iv;
mod continuous_iv;
mod errors_in_variables;
mod indirect;
mod instrumental_variables;
mod iv4;
mod iv_delayed;
mod kernel_fir;
mod known;
mod least_squares;
mod morsm;
mod output_error_iteration;
mod parsim;
mod pem;
mod pem_eiv;
mod prediction_error;
pub mod recursive;
mod riv;
mod state_sequence;
mod student_t;
mod subspace;
mod two_stage;
mod wnsf;

pub use arx::{Arx, ArxOptions};
pub use closed_loop_continuous::ClrivcOptions;
pub use closed_loop_iv::ClrivOptions;
pub use continuous_iv::{ContinuousIv, DeadTime, DeadTimeError, RivcOptions, SrivcOptions};
pub use errors_in_variables::{BelsOptions, ErrorsInVariables, IvCompensatedOptions, TlsOptions};
pub use indirect::{Indirect, IndirectOptions};
pub use instrumental_variables::InstrumentalVariables;
pub use iv_delayed::{IvDelayed, IvDelayedOptions};
pub use iv4::{Iv4, Iv4Options};
pub use kernel_fir::{Kernel, KernelFir, KernelFirOptions, NoiseVariance};
pub use known::KnownOptions;
pub use least_squares::{LeastSquares, LsOptions};
pub use morsm::{BjsmOptions, Morsm, MorsmOptions};
pub use output_error_iteration::{OutputErrorIteration, SrivOptions, StmcbOptions};
pub use parsim::{ParsimK, ParsimKOptions};
pub use pem::{PemOptions, SubspaceStart};
pub use pem_eiv::PemEivOptions;
pub use prediction_error::{ArmaxOptions, BjOptions, GeneralOptions, OeOptions};
pub use riv::{RefinedIv, RivOptions};
pub use state_sequence::{CvaOptions, SsarxOptions, StateSequence};
pub use student_t::PemTOptions;
pub use subspace::{MoespOptions, N4sidOptions, Subspace, SubspaceReading, Weights};
pub use two_stage::{JointOptions, TwoStage, TwoStageOptions};

use super::method_kind::{MethodKind, Needs, OptionUnits, Output, Problem};
#[cfg(feature = "json")]
use super::option_error::OptionError;
use super::{Estimator, IvOptions, SetupError};
use crate::model::Orders;
use crate::names::named_enum;
#[cfg(feature = "json")]
use serde_json::{Map, Value};

/// Defines the names, the options of each estimator, and the functions common to all.
macro_rules! estimators {
    ($(#[doc = $about:literal] $variant:ident = $name:literal: $options:ty,)*) => {
        named_enum! {
            /// An estimator of this crate.
            EstimatorName, "estimator" {
                $(#[doc = $about] $variant = $name,)*
            }
        }

        /// The options of a method of this crate.
        #[derive(Clone, Debug, PartialEq)]
        pub enum MethodOptions {
            $(#[doc = $about] $variant($options),)*
        }

        $(impl From<$options> for MethodOptions {
            fn from(options: $options) -> Self {
                Self::$variant(options)
            }
        })*

        impl EstimatorName {
            /// Returns a description in one sentence.
            pub const fn about(self) -> &'static str {
                match self {
                    $(Self::$variant => $about.trim_ascii(),)*
                }
            }
        }

        #[cfg(feature = "json")]
        impl EstimatorName {
            /// Reads the options; missing ones get their defaults.
            ///
            /// # Errors
            /// If a key is unknown or a value does not fit.
            pub fn parse(self, options: Map<String, Value>) -> Result<MethodOptions, OptionError> {
                let read = |options: Map<String, Value>| {
                    let options = Value::Object(options);
                    match self {
                        $(Self::$variant => serde_json::from_value(options).map(MethodOptions::$variant),)*
                    }
                };
                let options = read(options.clone()).map_err(|error| {
                    // The first key that cannot be read on its own either.
                    let alone = |(key, value): (&String, &Value)| {
                        let single = Map::from_iter([(key.clone(), value.clone())]);
                        read(single).is_err().then(|| key.clone())
                    };
                    OptionError {
                        key: options.iter().find_map(alone),
                        message: error.to_string(),
                    }
                })?;
                options.kind().check()?;
                Ok(options)
            }

            /// Returns the options with their defaults, in their order; null if the default follows from the setting.
            pub(super) fn defaults(self) -> Value {
                let defaults = match self {
                    $(Self::$variant => serde_json::to_value(<$options>::default()),)*
                };
                defaults.unwrap_or_default()
            }

            pub(super) fn options_schema(self) -> Value {
                match self {
                    $(Self::$variant => super::schema::inline_schema::<$options>(),)*
                }
            }
        }

        impl MethodOptions {
            /// Returns the estimator that has these options.
            pub fn estimator(&self) -> EstimatorName {
                match self {
                    $(Self::$variant(_) => EstimatorName::$variant,)*
                }
            }

            fn kind(&self) -> &dyn MethodKind {
                match self {
                    $(Self::$variant(options) => options,)*
                }
            }
        }

        #[cfg(feature = "json")]
        impl MethodOptions {
            /// Returns every option with its value, without those that follow from the setting.
            pub fn describe(&self) -> Map<String, Value> {
                let described = match self {
                    $(Self::$variant(options) => serde_json::to_value(options),)*
                };
                let Ok(Value::Object(mut described)) = described else {
                    return Map::new();
                };
                described.retain(|_, value| !value.is_null());
                described
            }
        }
    };
}

estimators! {
    /// Instrumental variables of the paper, with least squares as iteration 0 (the default).
    InstrumentalVariables = "iv": IvOptions,
    /// Least squares of the paper: iteration 0 alone.
    LeastSquares = "ls": least_squares::LsOptions,
    /// Least squares for any orders: na, nb and the delay nk.
    Arx = "arx": arx::ArxOptions,
    /// Instrumental variables for any orders: delayed inputs as instruments, two-stage least squares.
    IvDelayed = "iv-delayed": iv_delayed::IvDelayedOptions,
    /// Four-step instrumental variables of Ljung and Soderstrom.
    Iv4 = "iv4": iv4::Iv4Options,
    /// Simplified refined instrumental variables of Young, iterated until convergence: the output-error model B/F.
    Sriv = "sriv": output_error_iteration::SrivOptions,
    /// Steiglitz-McBride iteration until convergence: the output-error model B/F.
    Stmcb = "stmcb": output_error_iteration::StmcbOptions,
    /// Refined instrumental variables of Young, iterated until convergence: the Box-Jenkins model B/F, C/D.
    Riv = "riv": riv::RivOptions,
    /// Refined instrumental variables in continuous time: B(s)/A(s) from samples, with the hold stated.
    Srivc = "srivc": continuous_iv::SrivcOptions,
    /// Refined instrumental variables in continuous time with a noise model: B(s)/A(s), C/D from samples.
    Rivc = "rivc": continuous_iv::RivcOptions,
    /// Refined instrumental variables for a closed loop, with instruments from the reference: the Box-Jenkins model.
    Clriv = "clriv": closed_loop_iv::ClrivOptions,
    /// Refined instrumental variables in continuous time for a loop: B(s)/A(s), C/D, instruments from the reference.
    Clrivc = "clrivc": closed_loop_continuous::ClrivcOptions,
    /// Two-stage method for a closed loop: the reference's part of u, then the output-error model from it.
    TwoStage = "two-stage": two_stage::TwoStageOptions,
    /// Joint input-output method for a closed loop: the ratio of the reference's parts of y and u.
    Joint = "joint": two_stage::JointOptions,
    /// Indirect method for a closed loop with a known controller: the plant from a model of the loop.
    Indirect = "indirect": indirect::IndirectOptions,
    /// Total least squares for errors in variables: white noise in u and y, the ratio of its variances told.
    Tls = "tls": errors_in_variables::TlsOptions,
    /// Bias-eliminating least squares for errors in variables: white noise in u and y, its variances estimated.
    Bels = "bels": errors_in_variables::BelsOptions,
    /// Instrumental variables for errors in variables: white noise in u and y, its variances told.
    IvCompensated = "iv-compensated": errors_in_variables::IvCompensatedOptions,
    /// Weighted null-space fitting: an output-error, ARMAX or Box-Jenkins model from a high-order one, no search.
    Wnsf = "wnsf": wnsf::WnsfOptions,
    /// Box-Jenkins Steiglitz-McBride: B/F by stmcb on signals that a long ARX model has whitened, no noise model.
    Bjsm = "bjsm": morsm::BjsmOptions,
    /// Model order reduction Steiglitz-McBride: as bjsm, on the output of the long ARX model itself.
    Morsm = "morsm": morsm::MorsmOptions,
    /// Prediction error method: the output-error model B/F.
    Oe = "oe": prediction_error::OeOptions,
    /// Prediction error method: the ARMAX model A, B, C.
    Armax = "armax": prediction_error::ArmaxOptions,
    /// Prediction error method: the Box-Jenkins model B/F, C/D.
    Bj = "bj": prediction_error::BjOptions,
    /// Prediction error method: any model A, B, C, D, F, by default B/F.
    General = "general": prediction_error::GeneralOptions,
    /// Maximum likelihood with errors of Student's t, for heavy tails and outliers: any model A, B, C, D, F.
    PemT = "pem-t": student_t::PemTOptions,
    /// Maximum likelihood for errors in variables: B/F, white Gaussian input, noises in u and y; estimates variances.
    PemEiv = "pem-eiv": pem_eiv::PemEivOptions,
    /// Subspace method with past inputs and outputs as instruments (PO-MOESP).
    Moesp = "moesp": subspace::MoespOptions,
    /// Subspace method N4SID: as moesp, with a choice of the weighting.
    N4sid = "n4sid": subspace::N4sidOptions,
    /// Subspace method of canonical variates (CVA, Larimore), future inputs projected out: the innovations form.
    Cva = "cva": state_sequence::CvaOptions,
    /// Subspace method SSARX of Jansson, the future predicted by a long ARX model: the innovations form, also in loops.
    Ssarx = "ssarx": state_sequence::SsarxOptions,
    /// Subspace method PARSIM-K in the predictor form, each Markov parameter once: the innovations form, also in loops.
    ParsimK = "parsim-k": parsim::ParsimKOptions,
    /// Prediction error method for the innovations state-space form, one search from a subspace model.
    Pem = "pem": pem::PemOptions,
    /// Impulse response with a prior that it is smooth and decays (TC, DC, SS kernels), reduced to a model B/F.
    KernelFir = "kernel-fir": kernel_fir::KernelFirOptions,
    /// Recursive least squares with forgetting, sample by sample in square-root form.
    Rls = "rls": recursive::RlsOptions,
    /// Recursive instrumental variables: delayed inputs, or the output of the present model run along.
    RecursiveIv = "recursive-iv": recursive::RecursiveIvOptions,
    /// Recursive extended least squares (pseudo-linear regression): the ARMAX model A, B, C.
    Rels = "rels": recursive::RelsOptions,
    /// Recursive simplified refined instrumental variables of Young, filters run along: the output-error model B/F.
    RecursiveSriv = "recursive-sriv": recursive::RecursiveSrivOptions,
    /// Recursive prediction error method of Ljung, projected to stable predictors: any model A, B, C, D, F.
    Rpem = "rpem": recursive::RpemOptions,
    /// Kreisselmeier's adaptive observer: filters, and the gradient of a sum of squares with exponential memory.
    Kreisselmeier = "kreisselmeier": adaptive::KreisselmeierOptions,
    /// Zhang's adaptive observer with exponential forgetting.
    Zhang = "zhang": adaptive::ZhangOptions,
    /// The joint extended Kalman filter of state and parameters.
    JointEkf = "joint-ekf": adaptive::JointEkfOptions,
    /// The true plant and the mean of x(0): what an observer can achieve at best.
    Known = "known": known::KnownOptions,
}

impl MethodOptions {
    /// Returns the outputs of a method with this name.
    pub fn outputs(&self, name: &str) -> Vec<Output> {
        self.kind().outputs(name)
    }

    /// Returns the orders of the models for a value of the setting `order`. `None`: the paper's form of that order.
    pub fn model_orders(&self, setting: usize) -> Option<Orders> {
        self.kind().model_orders(setting)
    }

    /// Returns the orders that the option `orders` has if it is not given. `None`: the estimator has no such option.
    pub fn default_orders(&self, setting: usize) -> Option<Orders> {
        self.kind().default_orders(setting)
    }

    /// Returns the order of the part of the models that u drives, for a value of the setting `order`.
    pub fn order(&self, setting: usize) -> usize {
        self.model_orders(setting).map_or(setting, Orders::order)
    }

    /// Returns what the estimator needs of a cell.
    pub fn needs(&self) -> Needs {
        self.kind().needs()
    }

    /// Returns the unit of the numbers among the options.
    pub fn option_units(&self) -> OptionUnits {
        self.kind().option_units()
    }

    /// Whether the signals before the record are taken as zero.
    pub fn begins_at_rest(&self) -> bool {
        self.kind().begins_at_rest()
    }

    /// Whether one model can be fitted to several records ([`Problem::runs`]).
    pub fn takes_runs(&self) -> bool {
        self.kind().takes_runs()
    }

    /// Whether the estimator takes a record sample by sample.
    pub fn runs_along(&self) -> bool {
        self.kind().runs_along()
    }

    /// Returns an estimator with buffers for a problem.
    ///
    /// # Errors
    /// If the estimator cannot serve the problem.
    pub fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
        let kind = self.kind();
        if problem.runs().count() > 1 && !kind.takes_runs() {
            return Err(SetupError::OneRecord);
        }
        kind.prepare(problem)
    }

    /// Returns the options in the form that lanes run.
    ///
    /// # Errors
    /// The options that lanes do not support, in words.
    pub fn in_lanes(&self) -> Result<IvOptions, String> {
        let estimator = self.estimator();
        let kind = self.kind().in_lanes();
        kind.unwrap_or_else(|| Err(format!("the estimator \"{estimator}\"")))
    }
}
