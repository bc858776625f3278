//! Inputs of a file's own: `[inputs.NAME]`.

use crate::design::file::at_most;
use asobench_identification::signal::periodic_input;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The longest period in samples, of which every cell keeps a copy.
const PERIOD_LIMIT: usize = 1 << 18;
/// The longest period of a multisine, whose time grows with its square.
const MULTISINE_LIMIT: usize = 1 << 14;

/// The laws of tables of inputs, as names.
pub(crate) const LAWS: [&str; 5] = ["prbs", "multisine", "sines", "steps", "binary"];

/// An input, times the setting `amplitude` (or the reference's). All but "binary" are periodic: the same samples in
/// every trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "law", rename_all = "kebab-case", deny_unknown_fields)]
#[serde(expecting = "a table [inputs.NAME]")]
pub enum InputTable {
    /// A pseudo-random binary sequence of longest period, `(2^register - 1) clock` samples.
    Prbs {
        /// Length of the shift register, 2 to 18.
        register: usize,
        /// Samples for which each sign is held.
        #[serde(default = "one")]
        clock: usize,
        /// The values that -1 and +1 become, before the amplitude.
        #[serde(default = "signs")]
        levels: [f64; 2],
    },
    /// A sum of cosines of equal size at the lines of a period, with Schroeder's phases, of root mean square 1.
    Multisine {
        /// Samples of a period.
        period: usize,
        /// The lowest and the highest frequency, as shares of the Nyquist frequency.
        #[serde(default = "whole_band")]
        band: [f64; 2],
        /// Whether only odd lines are there.
        #[serde(default)]
        odd: bool,
    },
    /// A sum of sines, `sum_i amplitudes_i sin(2 pi k / periods_i)`.
    Sines {
        /// Their amplitudes, before the setting `amplitude`.
        amplitudes: Vec<f64>,
        /// Their periods, samples.
        periods: Vec<usize>,
    },
    /// Steps: each value is held, the first comes after the last.
    Steps {
        /// The values, before the amplitude.
        values: Vec<f64>,
        /// Samples for which each is held.
        hold: usize,
    },
    /// The signs of Gaussian numbers through a filter, drawn anew in every trial.
    Binary {
        /// The filter: a name in `[noises]`.
        filter: String,
    },
}

fn one() -> usize {
    1
}

fn signs() -> [f64; 2] {
    [-1.0, 1.0]
}

fn whole_band() -> [f64; 2] {
    [0.0, 1.0]
}

impl InputTable {
    /// Returns one period before the amplitude; `None` for what every trial draws anew.
    ///
    /// # Errors
    /// The key that is wrong, and what was expected.
    pub(crate) fn period(&self) -> Result<Option<Vec<f64>>, String> {
        match self {
            Self::Prbs {
                register,
                clock,
                levels: [low, high],
            } => {
                let known = periodic_input::REGISTERS;
                if !known.contains(register) {
                    let [first, last] = [known.start(), known.end()];
                    return Err(format!("register: {register}; expected {first} to {last}"));
                }
                let length = ((1_usize << register) - 1).saturating_mul(*clock);
                is_short(length, PERIOD_LIMIT)?;
                if !(low.is_finite() && high.is_finite() && low != high) {
                    return Err(format!("levels: [{low}, {high}]; expected two different numbers"));
                }
                let signs = periodic_input::prbs(*register, *clock);
                let signs = signs.ok_or("clock: 0; expected at least 1 sample")?;
                let level = |sign: f64| if sign < 0.0 { *low } else { *high };
                Ok(Some(signs.into_iter().map(level).collect()))
            }
            Self::Multisine { period, band, odd } => {
                is_short(*period, MULTISINE_LIMIT)?;
                let [low, high] = *band;
                if !(0.0 <= low && low < high && high <= 1.0) {
                    let message = "expected two shares of the Nyquist frequency from 0 to 1, the lower one first";
                    return Err(format!("band: [{low}, {high}]; {message}"));
                }
                let lines = periodic_input::lines(*period, *band, *odd);
                if lines.is_empty() {
                    return Err(format!(
                        "band: no line of a period of {period} samples is in it; expected a longer period or a wider \
                         band"
                    ));
                }
                Ok(Some(periodic_input::multisine(*period, &lines)))
            }
            Self::Steps { values, hold } => {
                is_short(values.len().saturating_mul(*hold), PERIOD_LIMIT)?;
                if values.is_empty() || *hold == 0 {
                    return Err("expected values, each held for at least 1 sample".to_owned());
                }
                if !values.iter().all(|value| value.is_finite()) {
                    return Err("values: expected finite numbers".to_owned());
                }
                Ok(Some(periodic_input::steps(values, *hold)))
            }
            Self::Sines { amplitudes, periods } => sines(amplitudes, periods).map(Some),
            Self::Binary { .. } => Ok(None),
        }
    }
}

/// The common period of some sines.
fn sines(amplitudes: &[f64], periods: &[usize]) -> Result<Vec<f64>, String> {
    if amplitudes.is_empty() || amplitudes.len() != periods.len() {
        return Err("expected as many amplitudes as periods, at least one".to_owned());
    }
    if !amplitudes.iter().all(|size| size.is_finite()) {
        return Err("amplitudes: expected finite numbers".to_owned());
    }
    let mut length = 1_usize;
    for period in periods {
        if *period < 2 {
            return Err(format!("periods: {period}; expected at least 2 samples"));
        }
        length /= periodic_input::greatest_divisor(length, *period);
        length = length.saturating_mul(*period);
        is_short(length, PERIOD_LIMIT)?;
    }
    Ok(periodic_input::sines(amplitudes, periods))
}

fn is_short(period: usize, limit: usize) -> Result<(), String> {
    at_most("the period", period, "samples", limit).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<InputTable, toml::de::Error> {
        toml::from_str(text)
    }

    #[test]
    fn tables_are_sequences() {
        let period = |text: &str| parsed(text).unwrap().period();
        let u = period("law = 'prbs'\nregister = 3\nlevels = [0, 2]").unwrap().unwrap();
        assert_eq!((u.len(), u.iter().sum::<f64>()), (7, 8.0));
        let u = period("law = 'multisine'\nperiod = 64").unwrap().unwrap();
        let square: f64 = u.iter().map(|u| u * u).sum();
        assert!((square / 64.0 - 1.0).abs() < 1e-14);
        let u = period("law = 'steps'\nvalues = [1, 0]\nhold = 2").unwrap().unwrap();
        assert_eq!(u, [1.0, 1.0, 0.0, 0.0]);
        let u = period("law = 'sines'\namplitudes = [1, 2]\nperiods = [4, 6]")
            .unwrap()
            .unwrap();
        let expected = [0.0, 1.0 + 3.0_f64.sqrt(), 3.0_f64.sqrt(), -1.0];
        assert_eq!(u.len(), 12);
        for (u, expected) in u.iter().zip(expected) {
            assert!((u - expected).abs() < 1e-14, "{u} {expected}");
        }
        assert_eq!(period("law = 'binary'\nfilter = 'low'"), Ok(None));
        for (text, part) in [
            ("law = 'prbs'\nregister = 19", "register: 19; expected 2 to 18"),
            ("law = 'prbs'\nregister = 18\nclock = 2", "at most 262144"),
            ("law = 'prbs'\nregister = 5\nclock = 0", "clock: 0"),
            ("law = 'prbs'\nregister = 5\nlevels = [1, 1]", "two different numbers"),
            ("law = 'multisine'\nperiod = 20\nband = [0.01, 0.02]", "no line"),
            (
                "law = 'multisine'\nperiod = 20\nband = [0.5, 0.1]",
                "the lower one first",
            ),
            ("law = 'multisine'\nperiod = 20000", "at most 16384"),
            (
                "law = 'sines'\namplitudes = [1]\nperiods = [4, 6]",
                "as many amplitudes as periods",
            ),
            ("law = 'sines'\namplitudes = [1]\nperiods = [1]", "at least 2 samples"),
            (
                "law = 'sines'\namplitudes = [1, 1, 1]\nperiods = [1009, 1013, 1019]",
                "at most 262144",
            ),
            ("law = 'steps'\nvalues = []\nhold = 5", "expected values"),
        ] {
            let error = period(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
        for (text, part) in [
            ("law = 'prbs'\nregister = 3\nclocks = 2", "unknown field `clocks`"),
            (
                "law = 'chirp'",
                "expected one of `prbs`, `multisine`, `sines`, `steps`, `binary`",
            ),
            ("law = 'prbs'", "missing field `register`"),
        ] {
            let error = parsed(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
