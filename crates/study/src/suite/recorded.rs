//! Recorded data beside the simulated suite: the FIT of methods that choose their orders, on the part of a record that
//! they have not seen. There is no truth and no Monte-Carlo error, so nothing is claimed.

use super::competitor::{Competitor, Told};
use super::manifest::{self, Division};
use super::results::{ResultsError, parsed};
use crate::files;
use crate::text::visible;
use asobench_identification::data::{Detrend, Trend, csv::Record};
use asobench_identification::estimator::{EstimatorName, MethodOptions};
use asobench_identification::fit;
use asobench_identification::model::Orders;
use asobench_identification::signal::NoiseLaw;
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
pub fn recorded_entries() -> Result<Vec<RecordEntry>, ResultsError> {
    let read: Result<Entries, _> = toml::from_str(manifest::RECORDS);
    let wrong = |error| ResultsError::Damaged(format!("suite/recorded/records.toml: {error}"));
    Ok(read.map_err(wrong)?.records)
}

/// The methods that choose their orders, without the ideal, which knows the truth.
pub fn choosing() -> Vec<(String, EstimatorName)> {
    let all = Competitor::of(Division::Open).into_iter();
    let estimator = |of: Competitor| match of {
        Competitor::Choosing(estimator) => Some((of.name(), estimator)),
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
        controller: None,
        shortest: first,
        division: Division::Open,
        has_contests: false,
        law: NoiseLaw::Gaussian,
        has_noisy_input: false,
    };
    let table = Competitor::Choosing(estimator).tables(&told).into_iter().next()?;
    let Value::Object(mut options) = table else {
        return None;
    };
    options.retain(|key, _| !["name", "estimator", "report"].contains(&key.as_str()));
    estimator.parse(options).ok()
}

impl RecordedFits {
    /// Reads the text of a file and checks its checksum, and that a run could have written it.
    ///
    /// # Errors
    /// [`ResultsError::Damaged`].
    pub fn parse(text: &str) -> Result<Self, ResultsError> {
        let own: Self = parsed(text)?;
        match own.records.iter().find(|of| of.fits.len() != own.methods.len()) {
            Some(of) => Err(ResultsError::Damaged(format!(
                "record {}: expected a FIT for each method",
                visible(&of.file)
            ))),
            None => Ok(own),
        }
    }

    /// Returns the text of the file, with its checksum.
    pub fn text(&self) -> String {
        files::sealed(self)
    }

    /// Those that the program carries.
    ///
    /// # Errors
    /// [`ResultsError::Damaged`].
    pub fn shipped() -> Result<Option<Self>, ResultsError> {
        let text = manifest::RECORDED;
        (!text.is_empty()).then(|| Self::parse(text)).transpose()
    }
}
