//! Adaptive observers as methods: their options, and an observer run over a whole window.

use super::{AdaptiveObserver, JointEkf, JointEkfSettings, Kreisselmeier, KreisselmeierSettings, Zhang, ZhangSettings};
use crate::estimator::initial_state_choice::{StartState, StateEstimate};
use crate::estimator::method_kind::options;
use crate::estimator::recursive::Diverged;
use crate::estimator::recursive::batch::along;
use crate::estimator::{
    Estimator, FailureKind, MethodKind, OptionError, Pass, Problem, SetupError, SinglePass, Visit, Window,
};
use crate::model::Units;
use crate::names::named_enum;
use crate::plant::canonical::{multiply_toeplitz, reverse_negated};
use crate::plant::{polynomial_from_poles, power_of_two};
use faer::c64;

/// Defines the options of an adaptive observer, each a number with its default and its range.
macro_rules! adaptive_options {
    (
        $(#[$about:meta])* $name:ident = $observer:expr;
        $($(#[$option_about:meta])* $option:ident = $default:literal, $low:literal to $high:literal,)*
    ) => {
        options! {
            $(#[$about])*
            pub struct $name {
                $($(#[$option_about])* pub $option: f64 = $default,)*
                /// The units of u and y to which these numbers apply: record (the root mean squares of the first 3n
                /// samples, or of the 3n from the first on that is not zero; the default), given (those of the data,
                /// so that other units of u or y ask for other numbers).
                pub units: TuningUnits,
                /// The initial state of the model that is left at the end: estimate (stage 6), or zero.
                pub initial_state: StartState,
            }
        }

        impl MethodKind for $name {
            fn check(&self) -> Result<(), OptionError> {
                $(in_range(stringify!($option), self.$option, $low, $high)?;)*
                Ok(())
            }

            fn runs_along(&self) -> bool {
                true
            }

            fn prepare(&self, problem: &Problem<'_>) -> Result<Box<dyn Estimator>, SetupError> {
                problem.shape.check()?;
                let observer = $observer(self, problem.shape.order);
                let order = problem.shape.order;
                let adapted = Adapted::new(observer, order, self.units, self.initial_state);
                Ok(Box::new(adapted))
            }
        }
    };
}

named_enum! {
    /// The units of u and y to which the tuning of an adaptive observer applies.
    TuningUnits, "units" {
        /// The sizes of the record's first samples (the default).
        Record = "record",
        /// The units of the data.
        Given = "given",
    }
}

fn in_range(key: &str, value: f64, low: f64, high: f64) -> Result<(), OptionError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let text = format!("{value}; expected a number of {low:?} to {high:?}");
    Err(OptionError::new(key, text))
}

adaptive_options! {
    /// The options of `kreisselmeier`. The source leaves all three free within the stable range; the defaults are
    /// dead-beat filters and the gamma in the middle of it.
    KreisselmeierOptions = kreisselmeier;
    /// All poles of the filters.
    pole = 0.0, -0.999 to 0.999,
    /// The share of the memory that is left after a sample.
    memory = 0.98, 0.0 to 1.0,
    /// Steps of the gradient are gamma over the trace of the memory; stable below 2.
    gamma = 1.0, 1e-6 to 1.999,
}

adaptive_options! {
    /// The options of `zhang`.
    ZhangOptions = zhang;
    /// All poles of A0 - K c'.
    pole = 0.0, -0.999 to 0.999,
    /// The forgetting factor lambda.
    forgetting = 1.0, 0.01 to 1.0,
    /// P(0) is p0 times the identity.
    p0 = 1e4, 1e-12 to 1e12,
}

adaptive_options! {
    /// The options of `joint-ekf`, which starts from a = b = x0 = 0. The defaults are for a constant plant, and
    /// measurement noise of 10 % of the output.
    JointEkfOptions = joint_ekf;
    /// The variance of the measurement noise.
    measurement_noise = 0.01, 1e-12 to 1e12,
    /// The variance of the errors of x(0).
    state_variance = 1.0, 1e-12 to 1e12,
    /// The variance of the errors of the first a and b.
    parameter_variance = 1.0, 1e-12 to 1e12,
    /// The variance of the noise that drives each state.
    state_noise = 0.0, 0.0 to 1e12,
    /// The variance of the steps of each parameter; 0 for a constant plant.
    parameter_noise = 0.0, 0.0 to 1e12,
}

/// The coefficients f_1 ... f_n of a polynomial with n equal roots.
fn filter(pole: f64, order: usize) -> Vec<f64> {
    let coefficients = polynomial_from_poles(&vec![c64::new(pole, 0.0); order]);
    coefficients.iter().map(|coefficient| coefficient.re).collect()
}

fn kreisselmeier(options: &KreisselmeierOptions, order: usize) -> Kreisselmeier {
    Kreisselmeier::new(KreisselmeierSettings {
        filter: filter(options.pole, order),
        memory: options.memory,
        gain: options.gamma,
    })
}

fn zhang(options: &ZhangOptions, order: usize) -> Zhang {
    Zhang::new(ZhangSettings {
        gain: filter(options.pole, order),
        forgetting: options.forgetting,
        p0: options.p0,
    })
}

fn joint_ekf(options: &JointEkfOptions, order: usize) -> JointEkf {
    let zeros = || vec![0.0; order];
    JointEkf::new(JointEkfSettings {
        x0: zeros(),
        a0: zeros(),
        b0: zeros(),
        state_variance: options.state_variance,
        parameter_variance: options.parameter_variance,
        noise: options.measurement_noise,
        state_noise: options.state_noise,
        parameter_noise: options.parameter_noise,
    })
}

/// Returns the root mean square of the first samples of a signal, so many; of those from the first on that is not zero,
/// if they are. 1 for a signal of zeros.
fn size(signal: &[f64], count: usize) -> f64 {
    let first = |from: usize| &signal[from..signal.len().min(from + count)];
    let some = |part: &[f64]| part.iter().any(|x| *x != 0.0);
    let begin = signal.iter().position(|x| *x != 0.0).unwrap_or_default();
    let part = if some(first(0)) { first(0) } else { first(begin) };
    // In a unit near them no square overflows or vanishes.
    let unit = power_of_two(part.iter().fold(0.0, |most: f64, x| most.max(x.abs())));
    let squares: f64 = part.iter().map(|x| (x / unit) * (x / unit)).sum();
    let size = unit * (squares / part.len() as f64).sqrt();
    if size.is_normal() { size } else { 1.0 }
}

/// An adaptive observer on a whole window: the model that it has found after the last sample. `iterations` of the pass
/// is the number of samples taken.
///
/// With [`TuningUnits::Record`] it sees u and y divided by the root mean squares of their first 3n samples: gradients,
/// and the first variances of a and of b, would otherwise depend on what u and y are measured in. Where these samples
/// are all zero, as before a step, the 3n from the first on that is not zero serve; nothing is learnt before it.
struct Adapted<O> {
    observer: O,
    tuning: TuningUnits,
    units: Units,
    order: usize,
    state: StateEstimate,
    /// (alpha, h).
    p: Vec<f64>,
    x: Vec<f64>,
}

impl<O: AdaptiveObserver> Adapted<O> {
    fn new(observer: O, order: usize, tuning: TuningUnits, start: StartState) -> Self {
        Self {
            observer,
            tuning,
            units: Units::ONE,
            order,
            state: StateEstimate::new(order, start),
            p: vec![0.0; 2 * order],
            x: vec![0.0; order],
        }
    }

    fn restart(&mut self, window: Window<'_>) {
        self.units = match self.tuning {
            TuningUnits::Given => Units::ONE,
            TuningUnits::Record => Units {
                input: size(window.u, 3 * self.order),
                output: size(window.y, 3 * self.order),
            },
        };
        self.observer.restart();
    }

    fn update(&mut self, u: f64, y: f64) -> Result<(), Diverged> {
        let Units { input, output } = self.units;
        self.observer.update(u / input, y / output)
    }

    /// Takes the observer's plant over.
    fn set(&mut self, pass: &mut Pass) -> Result<(), FailureKind> {
        let (a, b) = self.observer.plant().split_at(self.order);
        let (alpha, h) = self.p.split_at_mut(self.order);
        reverse_negated(a, alpha);
        h.copy_from_slice(b);
        multiply_toeplitz(a, h);
        for h in h.iter_mut() {
            *h *= self.units.gain();
        }
        pass.set_parameters(&self.p, f64::NAN)
    }

    fn find(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        self.restart(window);
        for (k, (u, y)) in window.u.iter().zip(window.y).enumerate() {
            pass.iterations = Some(k);
            self.update(*u, *y).map_err(|end| end.kind)?;
        }
        pass.iterations = Some(window.len());
        self.set(pass)
    }
}

impl<O: AdaptiveObserver> SinglePass for Adapted<O> {
    fn fit(&mut self, window: Window<'_>, pass: &mut Pass) -> Result<(), FailureKind> {
        self.find(window, pass)?;
        self.state.estimate(window, 0, pass);
        Ok(())
    }

    fn fit_along(&mut self, window: Window<'_>, at: &[usize], pass: &mut Pass, visit: &mut Visit<'_>) {
        self.restart(window);
        let mut goes_on = true;
        along(window, at, pass, |(u, y), pass, k| {
            goes_on = goes_on && self.update(u, y).is_ok();
            if let Some(k) = k {
                let known = goes_on && self.set(pass).is_ok();
                for (to, x) in self.x.iter_mut().zip(self.observer.state()) {
                    *to = x * self.units.output;
                }
                visit(k, pass, known.then_some(&self.x[..]));
            }
        });
    }
}
