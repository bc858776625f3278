//! Makes the noise of a cell from tables of covariances in the plant's own states.

use crate::design::SettingsReader;
use crate::design::file::{At, CovariancesTable, FileError, Key, wrong};
use asobench_identification::data::{PlantSource, Process};
use asobench_identification::names::UnknownName;
use asobench_identification::observer::ObserverKind;
use asobench_identification::plant::{OwnStates, StateNoise, StateNoiseError};
use asobench_identification::text::number;
use faer::Mat;
use std::collections::BTreeMap;

impl SettingsReader<'_> {
    /// Returns the plant in its own states; `None` if its table does not have it in them.
    pub(crate) fn own_states(&self) -> Result<Option<OwnStates>, FileError> {
        let name = self.text(Key::Plant);
        let states = self.file.plants.get(&name).and_then(|table| table.states.as_ref());
        let own = states.map(|states| states.own().at(format_args!("plants.{name}")));
        own.transpose()
    }

    /// Returns the covariances that observers name.
    pub(crate) fn covariances(&self, process: &Process) -> Result<BTreeMap<String, StateNoise>, FileError> {
        let mut all = BTreeMap::new();
        for (i, method) in self.file.methods.iter().enumerate() {
            if let Some(ObserverKind::KalmanNamed(name)) = method.observer(i)? {
                let place = format!("methods[{i}].observer");
                let plant = &process.settings().plant;
                all.insert(name.clone(), self.state_noise(place, &name, plant)?);
            }
        }
        Ok(all)
    }

    /// Returns the noise of a table of `[covariances]` in the coordinates in which the plant is simulated; `place` is
    /// where it is named.
    pub(crate) fn state_noise(
        &self,
        place: impl std::fmt::Display,
        name: &str,
        plant: &PlantSource,
    ) -> Result<StateNoise, FileError> {
        let tables = &self.file.covariances;
        let unknown = || UnknownName::new("covariances", name, tables.keys());
        let table = tables.get(name).ok_or_else(unknown).at(&place)?;
        let PlantSource::Fixed(plant) = plant else {
            let message = format!("'{name}' beside random plants; expected one plant for all trials");
            return wrong(place, message);
        };
        let own = self.own_states()?;
        let b = own.as_ref().map_or(plant.b(), OwnStates::b);
        let placed = |error: StateNoiseError| FileError::key(format_args!("covariances.{name}.{}", error.key()), error);
        let given = table.noise(b).map_err(|(key, message)| {
            let dot = if key.is_empty() { "" } else { "." };
            FileError::key(format_args!("covariances.{name}{dot}{key}"), message)
        })?;
        StateNoise::new(given.as_ref(), None, None).map_err(placed)?;
        let q = match (&own, table.input) {
            (Some(own), None) => own.noise(given.as_ref()),
            _ => given,
        };
        let noise = StateNoise::new(q.as_ref(), table.measurement, table.cross.as_deref());
        let noise = noise.map_err(placed)?;
        Ok(own.map_or(noise.clone(), |own| noise.transformed(own.to_canonical().as_ref())))
    }
}

impl CovariancesTable {
    /// Returns Q (n x n) as it is given, for a plant with this input vector; or the key that is wrong, none if it is
    /// more than one, and the reason.
    pub(crate) fn noise(&self, b: &[f64]) -> Result<Mat<f64>, (&'static str, String)> {
        let n = b.len();
        let variance = |key, given: f64, expected: &str| {
            if given >= 0.0 && given.is_finite() {
                return Ok(());
            }
            Err((key, format!("{}; expected {expected} of at least 0", number(given))))
        };
        match (&self.process, &self.channel, self.variance, self.input) {
            (Some(rows), None, None, None) => {
                if rows.len() == n && rows.iter().all(|row| row.len() == n) {
                    return Ok(Mat::from_fn(n, n, |i, j| rows[i][j]));
                }
                Err(("Q", StateNoiseError::Shape(n).to_string()))
            }
            (None, Some(g), Some(intensity), None) => {
                variance("variance", intensity, "a variance")?;
                if g.len() != n {
                    return Err(("G", StateNoiseError::Cross(n).to_string()));
                }
                Ok(Mat::from_fn(n, n, |i, j| intensity * g[i] * g[j]))
            }
            (None, None, None, Some(s)) => {
                variance("input", s, "a standard deviation")?;
                Ok(Mat::from_fn(n, n, |i, j| s * s * b[i] * b[j]))
            }
            (None, None, None, None) if self.measurement.is_some() => Ok(Mat::zeros(n, n)),
            _ => Err((
                "",
                "expected one of Q, G with variance, and input, for the noise in the states, or R alone".to_owned(),
            )),
        }
    }
}
