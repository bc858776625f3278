//! Recorded data beside the simulated suite: the FIT of methods that choose their orders, on the part of a record that
//! they have not seen. There is no truth and no Monte-Carlo error, so nothing is claimed.

use super::competitor::{Competitor, Told};
use super::manifest::{self, Division};
use super::stored::{Stored, SuiteError};
use crate::text::visible;
use asobench_identification::data::{Detrend, Trend, csv::Record};
use asobench_identification::estimator::{EstimatorName, MethodOptions};
use asobench_identification::fit;
use asobench_identification::model::Orders;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A record of the appendix.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordEntry {
    /// Its file.
    pub file: String,
    /// How many samples models are estimated from; the rest is for validation.
    pub first: usize,
}

#[derive(Deserialize)]
struct Entries {
    records: Vec<RecordEntry>,
}

/// The FIT of each method on each record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedFits {
    /// The edition of the suite.
    pub suite: String,
    /// The methods.
    pub methods: Vec<String>,
    /// The records.
    pub records: Vec<RecordFits>,
}

/// The FIT of each method on a record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordFits {
    /// The file.
    pub file: String,
    /// The file's own description: what was recorded, where it is from, its licence.
    pub about: Vec<String>,
    /// The samples of the record, and of them the first, which models are estimated from.
    pub samples: [usize; 2],
    /// For each method the FIT in per cent over the rest, to a tenth: simulated, and predicted one step ahead; null
    /// without a model, or if its output overflows.
    pub fits: Vec<Option<[f64; 2]>>,
}

/// The records that the suite names.
///
/// # Errors
/// A fault in the list.
pub fn recorded_entries() -> Result<Vec<RecordEntry>, SuiteError> {
    let read: Result<Entries, _> = toml::from_str(manifest::RECORDS);
    Ok(read.map_err(SuiteError::of("suite/recorded/records.toml"))?.records)
}

/// The methods that choose their orders, without the ideal, which knows the truth.
pub fn choosing() -> Vec<(String, EstimatorName)> {
    let all = Competitor::of(Division::Open).into_iter();
    let estimator = |of: Competitor| match of {
        Competitor::Estimator(estimator) => Some((of.name(), estimator)),
        _ => None,
    };
    all.filter_map(estimator).collect()
}

impl RecordFits {
    /// Estimates a model with each method from the first samples, whose means are subtracted from the whole record, and
    /// takes its FIT over the rest.
    pub fn of(
        entry: &RecordEntry,
        about: Vec<String>,
        mut record: Record,
        methods: &[(String, EstimatorName)],
    ) -> Self {
        let first = entry.first.min(record.y.len());
        for signal in [&mut record.u, &mut record.y] {
            Trend::fit(Detrend::Mean, &signal[..first]).subtract(signal);
        }
        let fits = methods
            .iter()
            .map(|(_, estimator)| validated(*estimator, &record, first));
        Self {
            file: entry.file.clone(),
            about,
            samples: [record.y.len(), first],
            fits: fits.collect(),
        }
    }
}

/// The FIT of a method over the samples that it has not seen.
fn validated(estimator: EstimatorName, record: &Record, first: usize) -> Option<[f64; 2]> {
    let Record { u, y, .. } = record;
    let model = fit(options(estimator, first)?, 1, &u[..first], &y[..first]).ok()?;
    let found = model.compare(u, y, first, first..y.len(), 1);
    let both = [found.simulated, found.one_step];
    both[0].is_finite().then(|| both.map(|fit| (10.0 * fit).round() / 10.0))
}

/// The options of the open division, with a delay of one sample.
fn options(estimator: EstimatorName, first: usize) -> Option<MethodOptions> {
    let told = Told {
        order: 1,
        truth: Orders::arx(1, 1, 1),
        shortest: first,
        division: Division::Open,
        ..Told::default()
    };
    let table = Competitor::Estimator(estimator).tables(&told).into_iter().next()?;
    let Value::Object(mut options) = table else {
        return None;
    };
    options.retain(|key, _| !["name", "estimator", "report"].contains(&key.as_str()));
    estimator.parse(options).ok()
}

impl Stored for RecordedFits {
    fn fault(&self) -> Option<String> {
        let mut all = self.records.iter();
        let of = all.find(|of| of.fits.len() != self.methods.len())?;
        Some(format!("record {}: expected a FIT for each method", visible(&of.file)))
    }
}

impl RecordedFits {
    /// Those that the program carries.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn shipped() -> Result<Option<Self>, SuiteError> {
        Self::carried(manifest::RECORDED)
    }
}
