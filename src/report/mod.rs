//! Claims, tables and figures: readers of stored results, never of a running study.

#[allow(clippy::format_push_string, reason = "sentences of a few words")]
mod claims;
#[cfg(test)]
mod demo;
#[allow(clippy::format_push_string, reason = "sentences of a few words")]
mod document;
mod example;
mod figures;
mod folder;
pub mod html;
mod markup;
pub mod plot;
mod results;
mod shipped;
mod table;

use crate::number;
pub use crate::number::uncertain;
pub use claims::{Claim, Number, claims};
pub use document::{Files, course_figures, report};
pub use example::{ends, example_table};
pub use figures::{FigureError, draw};
pub use folder::{WriteError, write as write_report};
pub use results::{ResultsError, Study, Time};
pub use table::verdict_table;
