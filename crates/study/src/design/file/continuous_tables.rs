//! The tables of a study in continuous time.

use crate::design::file::FileError;
use crate::design::file::table::tables;
use crate::files::{self, Kind};
use asobench_identification::names::named_enum;
use asobench_identification::observer::gpebo::Operator;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

tables! {
    /// A study of observers in continuous time: x' = A x + B u, y = C'x + delta. A file with this table is such a
    /// study.
    pub struct ContinuousTable {
        /// The end T of a trial, seconds.
        until: f64,
        /// Root mean squares are taken from this time on, seconds.
        #[serde(default)]
        scored_from: f64,
        /// The input u: a constant from t = 0 on.
        #[serde(default = "unit")]
        input: f64,
        /// The n - 1 filters that extend regression (9): numbers a for lags a / (p + a), or delays such as { delay =
        /// 0.5 }; 1, 2, ..., n - 1 if absent.
        filters?: Option<Vec<FilterTable>>,
        /// A trial whose relative error by step halving is estimated above this has failed.
        #[serde(default = "error_limit")]
        error_limit: f64,
        /// Seconds between the points of the first trial's course that are kept for figures; none if absent.
        trace_every?: Option<f64>,
    }

    /// A delay: v(t - delay), and 0 before t = delay.
    #[derive(Copy)]
    pub struct DelayTable {
        /// Seconds, a whole number of steps.
        delay: f64,
    }

    /// A plant in continuous time.
    pub struct ContinuousPlantTable {
        /// A, n rows of n numbers.
        a: Vec<Vec<f64>>,
        /// B, n numbers.
        b: Vec<f64>,
        /// C, n numbers.
        c: Vec<f64>,
        /// x(0), n numbers.
        x0: Vec<f64>,
        /// xi(0), n numbers; zeros if absent.
        xi0?: Option<Vec<f64>>,
    }

    /// One term of a disturbance; the setting `level` multiplies all of them.
    #[derive(Default)]
    pub struct WaveTable {
        /// The shape.
        wave: WaveName,
        /// Value, slope, amplitude or standard deviation at level 1.
        #[serde(default = "unit")]
        amplitude: f64,
        /// Radians per second, of a sine or square; the setting `frequency` if absent.
        frequency?: Option<f64>,
        /// Radians, of a sine or square; the setting `phase` if absent.
        phase?: Option<f64>,
        /// A CSV file with the header `t,delta`, relative to this file.
        file?: Option<String>,
        /// The signal between the file's samples.
        #[serde(default)]
        hold: HoldName,
        /// Seconds between samples, taken from the file.
        interval?: Option<f64>,
        /// The samples, taken from the file.
        values?: Option<Vec<f64>>,
    }

    /// A disturbance: the sum of its terms.
    #[serde(expecting = "a table [signals.NAME]")]
    pub struct SignalTable {
        /// The terms.
        waves: Vec<WaveTable>,
    }
}

fn unit() -> f64 {
    1.0
}

fn error_limit() -> f64 {
    1e-4
}

/// A filter that extends a regression.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a pole in rad/s, or { delay = SECONDS }")]
pub enum FilterTable {
    /// The pole a of the lag a / (p + a), rad/s.
    Pole(f64),
    /// A delay.
    Delay(DelayTable),
}

named_enum! {
    /// The shape of a disturbance.
    WaveName, "wave" {
        /// A constant.
        Constant = "constant",
        /// A ramp with this slope per second.
        Ramp = "ramp",
        /// A sine.
        Sine = "sine",
        /// The sign of a sine.
        Square = "square",
        /// White Gaussian numbers, each held for a time.
        White = "white",
        /// Samples of a CSV file.
        File = "file",
    }
}

named_enum! {
    /// The signal between two samples.
    HoldName, "hold" {
        /// The previous sample.
        Zero = "zero",
        /// The straight line between them.
        Linear = "linear",
    }
}

impl SignalTable {
    /// Reads the samples of the files that its terms name, relative to `folder`.
    pub(crate) fn read_files(&mut self, folder: &Path, place: &str) -> Result<(), FileError> {
        for (i, wave) in self.waves.iter_mut().enumerate() {
            let place = format!("{place}.waves[{i}]");
            if let (Some(file), WaveName::File, None) = (&wave.file, wave.wave, &wave.values) {
                let path = folder.join(file);
                let wrong = |message: String| FileError::key(&place, format!("{}: {message}", path.display()));
                let text = files::read_named(&path, Kind::Signal);
                let text = text.map_err(|e| wrong(e.to_string()))?;
                let (interval, values) = samples(&text).map_err(wrong)?;
                (wave.interval, wave.values) = (Some(interval), Some(values));
            }
        }
        Ok(())
    }
}

/// Parses a table `t,delta` with evenly spaced times from 0 on. Returns the interval and the values.
fn samples(text: &str) -> Result<(f64, Vec<f64>), String> {
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let header = lines.next().map(|(_, line)| line.replace(' ', ""));
    if header.as_deref() != Some("t,delta") {
        return Err("no header; expected the line t,delta first".to_owned());
    }
    let mut rows: Vec<(usize, f64, f64)> = Vec::new();
    for (line, text) in lines {
        let mut cells = text.split(',').map(|cell| cell.trim().parse::<f64>().ok());
        let row = [cells.next(), cells.next()].map(Option::flatten);
        match (row, cells.next()) {
            ([Some(t), Some(value)], None) if t.is_finite() && value.is_finite() => {
                rows.push((line, t, value));
            }
            _ => {
                return Err(format!(
                    "line {line}: '{text}'; expected two finite numbers, t and delta"
                ));
            }
        }
    }
    let [(_, first, _), (_, second, _), ..] = rows[..] else {
        return Err("expected at least two samples".to_owned());
    };
    let interval = second - first;
    if interval <= 0.0 {
        return Err(format!("t = {second} after {first}; expected ascending times"));
    }
    for (k, (line, t, _)) in rows.iter().enumerate() {
        let due = k as f64 * interval;
        if (t - due).abs() > 1e-6 * interval {
            let expected = "expected evenly spaced times from 0 on";
            return Err(format!("line {line}: t = {t} where {due} is due; {expected}"));
        }
    }
    Ok((interval, rows.into_iter().map(|(_, _, value)| value).collect()))
}

/// Returns the operators of a list of filters.
pub(crate) fn operators(filters: &[FilterTable]) -> Vec<Operator> {
    let operator = |filter: &FilterTable| match filter {
        FilterTable::Pole(pole) => Operator::Lag(*pole),
        FilterTable::Delay(table) => Operator::Delay(table.delay),
    };
    filters.iter().map(operator).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_evenly_spaced_from_zero() {
        let text = "# a comment\nt,delta\n0,1\n0.5, 2\n1.0,-3\n";
        assert_eq!(samples(text), Ok((0.5, vec![1.0, 2.0, -3.0])));
        for (text, part) in [
            ("0,1\n1,2", "no header"),
            ("t,delta\n0,1", "at least two"),
            ("t,delta\n0,1\n1,2\n3,4", "line 4: t = 3 where 2 is due"),
            ("t,delta\n0,1\n1,nan", "line 3"),
            ("t,delta\n0,1\n1,2,3", "line 3"),
            ("t,delta\n1,1\n2,2", "line 2: t = 1 where 0 is due"),
        ] {
            let error = samples(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
