//! The observers of an experiment file in continuous time: each with the options of its kind.

use crate::design::file::table::tables;
use crate::design::file::{CovariancesTable, FilterTable, operators};
use crate::text;
use asobench_identification::names::named_enum;
use asobench_identification::observer::gpebo::{Factor, ObserverSpec, Operator};
use asobench_identification::observer::{butterworth, care_correlated, parse_poles, place};
use asobench_identification::plant::{ContinuousPlant, StateNoise};
use faer::Mat;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An observer with its options; all run on the same trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct ObserverTable {
    /// Name in the results; the observer's if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Which observer, with its options.
    #[serde(flatten)]
    pub observer: ObserverOptions,
}

/// An observer in continuous time with the options that it takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "observer", rename_all = "kebab-case")]
pub enum ObserverOptions {
    /// GPEBO with the proposed estimator, Eqs. (11) to (17).
    Proposed(ProposedOptions),
    /// GPEBO with the gradient estimator on Eq. (10).
    Gradient(GradientOptions),
    /// GPEBO with the gradient estimator on Eq. (10), corrected so that it converges in finite time.
    FiniteTime(FiniteTimeOptions),
    /// GPEBO with gradient estimators on mixed least squares (LS+DREM).
    LsDrem(LsDremOptions),
    /// The full-order observer, Eq. (4): one of `gain`, `poles` and `bandwidth`.
    Luenberger(LuenbergerOptions),
    /// The Kalman-Bucy filter: the time-varying one with a prior, else the steady-state one.
    KalmanBucy(KalmanBucyOptions),
}

named_enum! {
    /// Whether the common factor g = e^m of (17) is kept.
    FactorName, "factor" {
        /// Kept, as in the paper.
        Keep = "keep",
        /// Cancelled; this needs other gains.
        Drop = "drop",
    }
}

tables! {
    /// The options of `proposed`.
    pub struct ProposedOptions {
        /// Adaptation gains, one for each component of theta, or one for all.
        gains: Vec<f64>,
        /// k of the filter k / (p + k), Eq. (11).
        pole?: Option<f64>,
        /// Order of the expansion of exp(delta), 1 or 2.
        expansion?: Option<usize>,
        /// Filters of the second mixing, poles or delays, as many as the expansion's order.
        filters?: Option<Vec<FilterTable>>,
        /// Keep (the paper's) or drop the common factor.
        factor?: Option<FactorName>,
    }

    /// The options of `gradient`.
    pub struct GradientOptions {
        /// Adaptation gains, one for each component of theta, or one for all.
        gains: Vec<f64>,
    }

    /// The options of `finite-time`.
    pub struct FiniteTimeOptions {
        /// Adaptation gains, one for each component of theta, or one for all.
        gains: Vec<f64>,
        /// The share of theta that the gradient must have learnt before its estimate is corrected in full; 0.5 if
        /// absent.
        share?: Option<f64>,
    }

    /// The options of `ls-drem`; of `measurement` and `prior` the ratio r / p0 counts.
    pub struct LsDremOptions {
        /// Adaptation gains, one for each component of theta, or one for all.
        gains: Vec<f64>,
        /// Intensity r of the measurement noise assumed.
        measurement: f64,
        /// Variance p0 of every component of theta, P(0) = p0 I.
        prior: f64,
    }

    /// The options of `luenberger`: one of them.
    pub struct LuenbergerOptions {
        /// L, n numbers.
        gain?: Option<Vec<f64>>,
        /// The n poles of A - L C', such as "-1+2i,-1-2i".
        poles?: Option<String>,
        /// All n poles of A - L C' in a Butterworth pattern of this radius, rad/s.
        bandwidth?: Option<f64>,
    }

    /// The options of `kalman-bucy`.
    pub struct KalmanBucyOptions {
        /// Intensity q of the process noise assumed in every state, Q = q I; with `G` of the noise that enters there.
        process?: Option<f64>,
        /// Instead: the intensity of the process noise assumed, n rows of n numbers.
        #[serde(rename = "Q")]
        intensity?: Option<Vec<Vec<f64>>>,
        /// Instead, with `process`: n numbers, Q = process G G'.
        #[serde(rename = "G")]
        channel?: Option<Vec<f64>>,
        /// Instead: the root s of the intensity of white noise assumed on the input, Q = s^2 B B'.
        input?: Option<f64>,
        /// The intensity of the process noise with that of the measurement, n numbers; zeros if absent.
        #[serde(rename = "S")]
        cross?: Option<Vec<f64>>,
        /// Intensity r of the measurement noise assumed.
        measurement: f64,
        /// For the time-varying filter: variance p0 of every component of theta, P(0) = p0 I. Without it the filter is
        /// in its steady state, which needs process noise.
        prior?: Option<f64>,
    }
}

impl ObserverOptions {
    /// Returns the name of the observer, as in files.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Proposed(_) => "proposed",
            Self::Gradient(_) => "gradient",
            Self::FiniteTime(_) => "finite-time",
            Self::LsDrem(_) => "ls-drem",
            Self::Luenberger(_) => "luenberger",
            Self::KalmanBucy(_) => "kalman-bucy",
        }
    }
}

impl ObserverOptions {
    /// Makes the observer. Luenberger observers start from xi(0), as GPEBO does.
    pub(crate) fn spec(&self, plant: &ContinuousPlant, xi0: &[f64], scale: f64) -> Result<ObserverSpec, String> {
        let n = plant.order();
        Ok(match self {
            ObserverOptions::Luenberger(options) => full_order(luenberger(options, plant)?, xi0),
            ObserverOptions::Gradient(options) => ObserverSpec::Gradient {
                gains: gains(&options.gains, n, scale)?,
            },
            ObserverOptions::FiniteTime(options) => ObserverSpec::FiniteTime {
                gains: gains(&options.gains, n, scale)?,
                share: options.share.unwrap_or(0.5),
            },
            ObserverOptions::LsDrem(options) => ObserverSpec::LsDrem {
                gains: gains(&options.gains, n, scale)?,
                p0: options.prior,
                r: options.measurement,
            },
            ObserverOptions::Proposed(options) => {
                let order = options.expansion.unwrap_or(2);
                // The default: the paper's filters, 2/(p + 2) and 6/(p + 6).
                let paper = [Operator::Lag(2.0), Operator::Lag(6.0)];
                let filters = options.filters.as_deref().map(operators);
                ObserverSpec::Proposed {
                    k: options.pole.unwrap_or(1.0),
                    order,
                    filters: filters.unwrap_or_else(|| paper.into_iter().take(order).collect()),
                    gains: gains(&options.gains, n, scale)?,
                    factor: match options.factor.unwrap_or_default() {
                        FactorName::Keep => Factor::Keep,
                        FactorName::Drop => Factor::Drop,
                    },
                }
            }
            ObserverOptions::KalmanBucy(options) => kalman_bucy(options, plant, xi0)?,
        })
    }
}

fn full_order(gain: Vec<f64>, xi0: &[f64]) -> ObserverSpec {
    ObserverSpec::Luenberger { gain, x0: xi0.to_vec() }
}

/// Returns the gain L.
fn luenberger(options: &LuenbergerOptions, plant: &ContinuousPlant) -> Result<Vec<f64>, String> {
    let poles = match (&options.gain, &options.poles, options.bandwidth) {
        (Some(gain), None, None) => return Ok(gain.clone()),
        (None, Some(list), None) => parse_poles(list).map_err(|error| error.to_string())?,
        (None, None, Some(radius)) if radius > 0.0 => butterworth(plant.order(), radius),
        (None, None, Some(radius)) => {
            let radius = text::number(radius);
            return Err(format!("bandwidth {radius}; expected a number above 0"));
        }
        _ => return Err("expected one of 'gain', 'poles' and 'bandwidth'".to_owned()),
    };
    place(plant.a(), plant.c(), &poles).map_err(|error| error.to_string())
}

/// Makes the Kalman-Bucy filter: with a prior the time-varying one, which without process noise is least squares on
/// theta; else the steady-state one, which is a full-order observer.
fn kalman_bucy(options: &KalmanBucyOptions, plant: &ContinuousPlant, xi0: &[f64]) -> Result<ObserverSpec, String> {
    let r = options.measurement;
    match (intensities(options, plant)?, options.prior) {
        (None, None) => Err("expected 'process' above 0, Q or input, or 'prior'".to_owned()),
        (None, Some(p0)) => Ok(ObserverSpec::KalmanBucy { p0, r }),
        (Some((q, s)), Some(p0)) => Ok(ObserverSpec::Filter {
            p0,
            q,
            s,
            r,
            x0: xi0.to_vec(),
        }),
        (Some((q, s)), None) => {
            let solved = care_correlated(plant.a(), plant.c(), q.as_ref(), &s, r);
            let solved = solved.map_err(|error| error.to_string())?;
            Ok(full_order(solved.gain, xi0))
        }
    }
}

/// Q (n x n) and S (n numbers).
type Intensities = (Mat<f64>, Vec<f64>);

/// Returns Q and S of a Kalman-Bucy filter; `None` without process noise.
fn intensities(options: &KalmanBucyOptions, plant: &ContinuousPlant) -> Result<Option<Intensities>, String> {
    let KalmanBucyOptions {
        process,
        intensity,
        channel,
        input,
        cross,
        measurement,
        ..
    } = options;
    let n = plant.order();
    let own = [intensity.is_some(), channel.is_some(), input.is_some()];
    let q = match *process {
        None | Some(0.0) if own == [false; 3] => {
            return match cross {
                None => Ok(None),
                Some(_) => Err("S: expected process noise beside it".to_owned()),
            };
        }
        Some(q) if own == [false; 3] => {
            if !(q > 0.0) {
                let q = text::number(q);
                return Err(format!("process: {q}; expected an intensity of at least 0"));
            }
            Mat::from_fn(n, n, |i, j| if i == j { q } else { 0.0 })
        }
        _ => {
            let table = CovariancesTable {
                process: intensity.clone(),
                channel: channel.clone(),
                variance: *process,
                input: *input,
                ..CovariancesTable::default()
            };
            let q = table.noise(plant.b());
            q.map_err(|(key, message)| match key {
                "" => "expected one of 'process', with G or not, Q and input".to_owned(),
                "variance" => format!("process: {message}"),
                _ => format!("{key}: {message}"),
            })?
        }
    };
    let noise = StateNoise::new(q.as_ref(), Some(*measurement), cross.as_deref());
    noise.map_err(|error| match error.key() {
        "R" => format!("measurement: {error}"),
        key => format!("{key}: {error}"),
    })?;
    let cross = cross.clone().unwrap_or_else(|| vec![0.0; n]);
    Ok(Some((q, cross)))
}

/// Returns the adaptation gains times their scale. A single gain applies to all components.
fn gains(given: &[f64], n: usize, scale: f64) -> Result<Vec<f64>, String> {
    let all = match given {
        [value] => vec![*value; n],
        all if all.len() == n => all.to_vec(),
        _ => return Err(format!("gains; expected {n} numbers, or one for all")),
    };
    Ok(all.into_iter().map(|gain| gain * scale).collect())
}

impl ObserverTable {
    /// Returns the name of its output.
    pub fn label(&self) -> String {
        let name = || self.observer.name().to_owned();
        self.name.clone().unwrap_or_else(name)
    }
}

#[cfg(test)]
mod tests {
    use crate::design::file::experiment_file::ExperimentFile;

    #[test]
    fn an_option_of_another_observer_is_refused_with_the_observers_own() {
        let of = |lines: &str| {
            let text = format!("[[observers]]\n{lines}\n");
            ExperimentFile::parse(&text)
                .map_err(|error| error.to_string())
                .map(|_| ())
        };
        assert_eq!(of("name = \"g\"\nobserver = \"gradient\"\ngains = [1]"), Ok(()));
        for (lines, part) in [
            (
                "observer = \"gradient\"\ngains = [1]\npole = 1",
                "unknown key 'pole'; expected gains",
            ),
            (
                "observer = \"ls-drem\"\ngains = [1]\nprior = 1",
                "missing field `measurement`",
            ),
            ("observer = \"gradeint\"", "did you mean 'gradient'?"),
        ] {
            let error = of(lines).unwrap_err();
            assert!(error.contains(part), "{lines}: {error}");
        }
    }
}
