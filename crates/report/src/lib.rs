//! Claims, tables and figures. They read stored results, never a running study.

#[allow(clippy::format_push_string, reason = "sentences of a few words")]
mod document;
mod figures;
mod folder;
mod gpebo_table;
pub mod html;
mod index;
mod latex;
mod markup;
pub mod plot;
mod results;
mod table;
#[allow(clippy::format_push_string, reason = "lines of a terminal")]
pub mod terminal;
#[cfg(test)]
mod tests;

use asobench_identification::number;
pub use asobench_identification::number::uncertain;
pub use document::{Files, course_figures, report};
pub use figures::{OneTrial, TrialErrors, draw};
pub use folder::{prepare as prepare_report, write as write_report};
pub use gpebo_table::{ends, example_table};
pub use results::{ResultsError, Study, Time};
pub use table::verdict_table;
