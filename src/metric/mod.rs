//! Error measures and their summaries over trials.

mod error;
mod fit;
mod response;
mod summary;

pub use error::{StateError, relative_error, relative_error_as_printed};
pub use fit::{Fit, FitModel, fit};
pub use response::{Response, System};
pub use summary::{Quantile, Share, Verdict, quantile, verdict};
