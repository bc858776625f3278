//! The reference suite: published systems under one manifest, the score of a method, and results that a newcomer is
//! measured against.
//!
//! A scenario is one cell of an ordinary experiment: a system of `suite/NAME.toml` with the settings of
//! `suite/suite.toml` and one N, or a plant of the bank, `suite/bank.jsonl`. The score of a run is the measure d,
//! `(theta_hat - theta)' F (theta_hat - theta) / p` with the Fisher information F of the record, in editions 1 of the
//! scenario ([`asobench_identification::theory::FisherInformation`]); a lost run is infinitely far. No number depends
//! on who else takes part.

mod archive;
mod competitor;
mod law;
mod manifest;
mod published;
mod recorded;
mod records;
mod results;
mod scenario;
mod score;
mod stored;
mod times;

pub use archive::{ARCHIVE, Contribution};
pub use competitor::{Competitor, KINDS};
pub use law::{Law, Laws, law};
pub use manifest::{Division, Manifest, StudyEntry, Tier, VALUES};
pub use published::{PublishedTable, Reproduced, published};
pub use recorded::{RecordEntry, RecordFits, RecordedFits, choosing, recorded_entries};
pub use results::{METHODS, MethodResults, STUDIES, ScenarioResults, collect, declined, of_folder, shipped};
pub use scenario::{Made, Scenario, Suite, SuiteStudy, ideal_weights};
pub use score::{Paired, Score, efficiency, ideal_share, paired, paired_in, score, score_by, share_within};
pub use stored::{Stored, SuiteError};
pub use times::{MethodTimes, REFERENCE, ScenarioTimes, TIME_LIMIT, Times, time};

/// The name under which the prediction error method started at the truth stands in results.
pub const IDEAL: &str = "pem-from-truth";
