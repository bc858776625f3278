//! Error measures and their summaries over trials.

mod error;
mod summary;

pub use error::{StateError, relative_error, relative_error_as_printed};
pub use summary::{Quantile, Share, Verdict, quantile, verdict};
